"""What a command prints on a terminal of some width, and what must be true of it."""

import re
from collections import Counter

import click.testing

from viscopade.cli import console, main

WIDTHS = (40, 60, 80, 120)
_COLORS = re.compile(r"\x1b\[[0-9;]*m")


def run(words):
    """What a command prints, called as a function, without colours."""
    result = click.testing.CliRunner().invoke(main.command, list(map(str, words)), color=True)
    assert result.exception is None or isinstance(result.exception, SystemExit)
    return "".join(f"{line.rstrip()}\n" for line in _COLORS.sub("", result.stdout).splitlines())


def on_terminal(monkeypatch, words, width):
    """The same on a terminal."""
    with monkeypatch.context() as patch:
        patch.setattr(console, "_is_terminal", lambda stream: True)
        patch.setenv("COLUMNS", str(width))
        patch.setenv("TERM", "xterm")
        return run(words)


def assert_nothing_is_cut(printed, shown, width):
    """Every number of what a pipe gets is there in one piece, and no line is so long that a terminal cuts it."""
    numbers, found = (Counter(re.findall(r"\S*[0-9]\S*", text)) for text in (printed, shown))
    assert numbers <= found
    long = [line for line in shown.splitlines() if len(line) > width]
    assert [line for line in long if " " in line.strip()] == []
    assert all(len(line.strip()) > width - 4 for line in long)  # a single word, for which there is no room
