"""Tables and sentences on terminals: no number is cut in two, at any width."""

import fcntl
import os
import pty
import re
import struct
import subprocess
import sys
import termios
from collections import Counter
from contextlib import suppress
from pathlib import Path

import pytest

from tests.cli import printed as run
from viscopade import arguments
from viscopade.cli import console

NUMBER = re.compile(r"\S*[0-9][^\s:]*")
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


def on_terminal(monkeypatch, words, width):
    """What a command prints on a terminal of some width."""
    with monkeypatch.context() as patch:
        patch.setattr(console, "_is_terminal", lambda stream: stream is sys.stdout)
        patch.setenv("COLUMNS", str(width))
        patch.setenv("TERM", "xterm")
        return run(*words)


@pytest.mark.parametrize("words", COMMANDS, ids=lambda words: words[0])
def test_no_number_is_cut(words, monkeypatch):
    """Every word of what a wide terminal shows is there in one piece, and lines are longer only if words are."""
    wide = on_terminal(monkeypatch, words, 2000)
    for width in (40, 80, 120):
        shown = on_terminal(monkeypatch, words, width)
        assert Counter(NUMBER.findall(wide)) <= Counter(NUMBER.findall(shown))
        if width >= 120 and "100" not in words:
            assert max(map(len, shown.splitlines())) <= width
    piped = run(*words)
    assert Counter(NUMBER.findall(wide)) == Counter(NUMBER.findall(piped))
    assert "\x1b" not in wide + piped


def test_a_table_too_wide_has_heads_and_sentences_on_several_lines(monkeypatch, capsys):
    monkeypatch.setattr(console, "text_width", lambda: 30)
    rows = [("1.2345", "a sentence of words"), ("1" * 20, "")]
    console.show("text", ("a long head of a column", "why"), rows, {}, "A title of several words")
    lines = [line.rstrip() for line in capsys.readouterr().out.split("\n")]
    assert lines[0] == "A title of several words"
    assert " " + "1" * 20 in lines
    assert max(map(len, lines)) <= 36  # a number of 20 digits beside words of 8 letters
    console.show("text", ("a", "b"), [], {})
    assert "a   b" in capsys.readouterr().out


def test_a_table_far_too_wide_has_a_line_for_each_cell(capsys):
    sentence = "The damping lacks a factor. " * 4
    rows = [("A", *("-1.23456789e-10" for _ in range(5)), "", sentence), ("B", *("1" for _ in range(6)), "")]
    console.show("text", ("program", *(f"number{i}" for i in range(6)), "why"), rows, {}, "Title")
    lines = capsys.readouterr().out.splitlines()
    assert lines[:4] == ["Title", "", "program: A", "  number0: -1.23456789e-10"]
    assert lines[8:11] == [
        "  why: The damping lacks a factor. The damping lacks a factor. The damping lacks a factor. The",
        "    damping lacks a factor.",
        "",
    ]
    assert lines[11:] == ["program: B", *(f"  number{i}: 1" for i in range(6)), ""]


@pytest.mark.parametrize("words", [("audit",), ("audit", "mercurydpm", "--epsilon", "0.5", "--time-step", "0.02")])
def test_what_a_pipe_gets_has_at_most_100_columns(words):
    assert 90 < max(map(len, run(*words).splitlines())) <= 100


def test_lines_do_not_break_inside_a_formula(capsys):
    console.say("word " * 19 + "x = 1 - eps^2 <= 3")
    assert capsys.readouterr().out.splitlines()[1] == "x = 1 - eps^2 <= 3"


def test_two_columns_of_all_digits_stay_together_in_a_pipe(monkeypatch, capsys):
    number = "-0." + "7" * arguments.MAX_DIGITS
    console.show("text", ("what", "real", "imaginary"), [("pole", number, number)], {})
    assert capsys.readouterr().out.split()[-3:] == ["pole", number, number]


def test_a_real_terminal():
    ours, theirs = pty.openpty()
    fcntl.ioctl(theirs, termios.TIOCSWINSZ, struct.pack("HHHH", 50, 80, 0, 0))
    variables = {name: value for name, value in os.environ.items() if name != "COLUMNS"} | {"TERM": "xterm"}
    words = [sys.executable, "-m", "viscopade", "reproduce"]
    with subprocess.Popen(words, stdin=subprocess.DEVNULL, stdout=theirs, env=variables) as process:
        os.close(theirs)
        shown = b""
        with suppress(OSError):  # how a terminal ends
            while part := os.read(ours, 4096):
                shown += part
    os.close(ours)
    assert process.returncode == 0
    assert max(map(len, shown.decode().splitlines())) <= 80
    assert b"0.23558522186995282613" in shown


def test_a_long_loop_says_beforehand_how_long_it_takes(monkeypatch, capsys):
    """Step i takes i seconds, as its cost says; after the second step it is known what is left."""
    now = [0.0]
    monkeypatch.setattr(console, "monotonic", lambda: now[0])
    for last, cost, said in ((10, float, ""), (20, float, "viscopade: orders: about 3 min\n"), (20, None, "")):
        for i in console.tracker(range(1, last + 1), "orders", cost):
            now[0] += i
        assert capsys.readouterr().err == said
