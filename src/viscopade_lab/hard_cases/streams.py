"""How hard cases run the command in new processes, and what becomes of streams that are closed, full or terminals."""

from __future__ import annotations

import os
import subprocess
import sys
from collections.abc import Callable, Mapping, Sequence
from contextlib import suppress
from typing import NamedTuple

MEMORY = "/dev/shm"  # a directory in memory, where there is one: what a process leaves there is the same, and sooner
COMMAND = ("epsilon", "--v-star", "1.5", "--digits", "25")
TIMEOUT = 1800  # seconds after which a process hangs, however busy the machine is
ONE = "import sys; from viscopade.cli.main import main; sys.argv[1:] = {words!r}; main()"


class Ran(NamedTuple):
    """What a process printed, and its exit status."""

    out: bytes
    err: bytes
    status: int


class StreamRow(NamedTuple):
    """A row of the table: what was changed, what came, and the share of the output's lines that are as usual."""

    name: str
    result: str
    share: float
    good: bool


def memory() -> str | None:
    """Return a directory in memory for temporary files, or None for the usual one."""
    return MEMORY if os.access(MEMORY, os.W_OK) else None


def variables(changed: Mapping[str, str | None]) -> dict[str, str]:
    """Return the environment of a process."""
    usual = {name: value for name, value in os.environ.items() if not name.startswith("PYTHON")}
    usual = {k: v for k, v in usual.items() if k not in ("COLUMNS", "LINES", "FORCE_COLOR", "NO_COLOR")}
    merged: dict[str, str | None] = {**usual, **changed}
    return {name: value for name, value in merged.items() if value is not None}


def run(
    code: str,
    options: Sequence[str] = (),
    changed: Mapping[str, str | None] | None = None,
    directory: str | None = None,
    before: Callable[[], None] | None = None,
) -> Ran:
    """Run Python code in a new process; its arguments are those of `Environment`."""
    words = [sys.executable, "-P", *options, "-c", code]
    done = subprocess.run(
        words, capture_output=True, stdin=subprocess.DEVNULL, env=variables(changed or {}), cwd=directory,
        timeout=TIMEOUT, preexec_fn=before,
    )  # fmt: skip
    return Ran(done.stdout, done.stderr, done.returncode)


def program(*words: str) -> str:
    """Return Python code that runs the command with these words."""
    return ONE.format(words=list(words))


def reader_leaves() -> StreamRow:
    """Print into a pipe whose reader reads one byte and goes."""
    import fcntl  # not everywhere

    words = [sys.executable, "-P", "-c", program("export", "c", "--pade", "1/4", "--pade", "3/6")]
    with subprocess.Popen(words, stdout=subprocess.PIPE, stderr=subprocess.PIPE, env=variables({})) as process:
        assert process.stdout is not None
        assert process.stderr is not None
        with suppress(OSError, AttributeError):  # a pipe that holds less than what is printed
            fcntl.fcntl(process.stdout.fileno(), fcntl.F_SETPIPE_SZ, 4096)
        os.read(process.stdout.fileno(), 1)
        process.stdout.close()
        err = process.stderr.read()
    return StreamRow(
        "the reader of a pipe goes", f"exit {process.returncode}, {len(err)} bytes of complaint", 0.0, not err
    )


def disk_full() -> StreamRow | None:
    """Print to a full disk; None if there is none here."""
    if not os.path.exists("/dev/full"):
        return None
    words = [sys.executable, "-P", "-c", program(*COMMAND)]
    with open("/dev/full", "wb") as full:
        done = subprocess.run(words, stdout=full, stderr=subprocess.PIPE, env=variables({}), timeout=TIMEOUT)
    good = done.returncode != 0 and len(done.stderr.splitlines()) == 1
    return StreamRow("output to a full disk", f"exit {done.returncode}: {done.stderr.decode().strip()[:60]}", 0.0, good)


def closed(*numbers_of: int) -> StreamRow:
    """Run without standard input, output or standard error."""

    def close() -> None:
        for number in numbers_of:
            os.close(number)

    ran = run(program(*COMMAND), before=close)
    names = ", ".join(("stdin", "stdout", "stderr")[number] for number in numbers_of)
    good = b"Traceback" not in ran.err and (ran.status == 0 or len(ran.err.splitlines()) == 1)
    return StreamRow(f"closed: {names}", f"exit {ran.status}, {len(ran.err)} bytes of complaint", 0.0, good)


def on_terminal(usual: Ran) -> tuple[StreamRow, int]:
    """Run with standard error on a terminal, where progress comes and goes; return how many characters stay, too."""
    import pty  # not everywhere

    ours, theirs = pty.openpty()
    words = [sys.executable, "-P", "-c", program(*COMMAND)]
    shown = b""
    with subprocess.Popen(words, stdout=subprocess.PIPE, stderr=theirs, env=variables({"TERM": "xterm"})) as process:
        os.close(theirs)
        with suppress(OSError):  # how a terminal ends
            while piece := os.read(ours, 65536):
                shown += piece
        out = process.communicate(timeout=TIMEOUT)[0]
    os.close(ours)
    left = len(shown.rpartition(b"\x1b[2K")[2].strip()) if b"\x1b[2K" in shown else len(shown)
    good = usual.out.startswith(out) and bool(out) and left == 0
    words_ = "progress was shown and taken away" if shown else "no progress was shown"
    return StreamRow("standard error is a terminal", words_, 1.0, good), left
