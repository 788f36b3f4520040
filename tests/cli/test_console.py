"""Tables and sentences on terminals: no number is cut in two, at any width."""

import fcntl
import os
import pty
import struct
import subprocess
import sys
import termios
from pathlib import Path

import pytest

from tests.terminal import WIDTHS, assert_nothing_is_cut, on_terminal, run
from viscopade import arguments
from viscopade.cli import console

ROOT = Path(__file__).parents[2]
SCENE = ("scene", ROOT / "examples" / "ice_rings.toml", "--no-check")
MATERIAL = ("--radius", "0.01", "--density", "2500", "--young-modulus", "1e7", "--poisson-ratio", "0.3")
COMMANDS = (
    SCENE,
    ("coefficients", "--order", "6", "--digits", "30"),
    ("coefficients", "--order", "6", "--digits", "100"),
    ("pade", "1", "4", "--digits", "15"),
    ("pade", "7", "10", "--digits", "15"),
    ("epsilon", "--v-star", "1.5", "--digits", "40"),
    ("invert", "--epsilon", "0.9", "--speed", "1", *MATERIAL),
    ("reproduce",),
    ("claims", "--only", "pole-of-2-5", "--only", "twenty-terms"),
)


@pytest.fixture(scope="module", params=COMMANDS, ids=lambda words: words[0])
def command(request):
    """A command, and what it prints in a pipe."""
    words = request.param
    return words, run(words)


@pytest.mark.parametrize("width", WIDTHS)
def test_no_number_is_cut(command, width, monkeypatch):
    words, printed = command
    assert_nothing_is_cut(printed, on_terminal(monkeypatch, words, width), width)


def test_a_wide_terminal_gets_what_a_pipe_gets(command, monkeypatch):
    words, printed = command
    assert on_terminal(monkeypatch, words, 2000) == printed


def table(monkeypatch, capsys, width, header, rows, title=None):
    monkeypatch.setattr(console, "terminal_width", lambda: width)
    console.show("text", header, rows, {}, title)
    return [line.rstrip() for line in capsys.readouterr().out.split("\n")]


def test_heads_take_several_lines_before_a_table_becomes_records(monkeypatch, capsys):
    lines = table(monkeypatch, capsys, 30, ("a long head of a column", "k"), [("1.2345", 1)])
    assert "1.2345   1" in lines[-3]
    assert max(map(len, lines)) <= 30


def test_records(monkeypatch, capsys):
    rows = [("glass on glass", "0.123456789", ""), ("ice", "1" * 30, "yes")]
    assert table(monkeypatch, capsys, 24, ("pair", "eps", "enough"), rows, "A title of several words") == [
        "A title of several words",
        "",
        "  pair    glass on glass",
        "  eps     0.123456789",
        "",
        "  pair    ice",
        "  eps",
        "    " + "1" * 30,  # the terminal has no room for it, and breaks it without changing it
        "  enough  yes",
        "",
        "",
    ]


def test_a_name_that_is_too_long_stands_above(monkeypatch, capsys):
    lines = table(monkeypatch, capsys, 20, ("of 1 - eps^2, sampled", "k"), [("0.000123456789", "3")])
    assert lines == ["", "  of 1 - eps^2,", "  sampled", "    0.000123456789", "  k  3", "", ""]


def test_a_table_without_rows(monkeypatch, capsys):
    assert "a   b" in table(monkeypatch, capsys, 40, ("a", "b"), [])[1]


def test_two_columns_of_all_digits_stay_together_in_a_pipe(monkeypatch, capsys):
    number = "-0." + "7" * arguments.MAX_DIGITS
    lines = table(monkeypatch, capsys, None, ("what", "real", "imaginary"), [("pole", number, number)])
    assert lines[-3].split() == ["pole", number, number]


def test_a_real_terminal():
    ours, theirs = pty.openpty()
    fcntl.ioctl(theirs, termios.TIOCSWINSZ, struct.pack("HHHH", 50, 80, 0, 0))
    variables = {name: value for name, value in os.environ.items() if name != "COLUMNS"} | {"TERM": "xterm"}
    words = [sys.executable, "-m", "viscopade", *map(str, SCENE)]
    process = subprocess.Popen(words, stdin=subprocess.DEVNULL, stdout=theirs, env=variables)
    os.close(theirs)
    shown = b""
    while part := _read(ours):
        shown += part
    os.close(ours)
    assert process.wait() == 0
    assert_nothing_is_cut(run(SCENE), shown.decode().replace("\r\n", "\n"), 80)


def _read(terminal):
    try:
        return os.read(terminal, 4096)
    except OSError:  # the other side is closed
        return b""
