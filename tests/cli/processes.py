"""Python in new processes: in other environments, and with streams that are closed, full or terminals."""

import fcntl
import os
import pty
import subprocess
import sys
from contextlib import suppress
from typing import NamedTuple

from tests.patience import HANGS

MEMORY = "/dev/shm"  # a directory in memory, where there is one: what a process leaves there is the same, and sooner
SHOWN = ("COLUMNS", "LINES", "FORCE_COLOR", "NO_COLOR")


class Ran(NamedTuple):
    """What a process printed, and its exit status."""

    out: bytes
    err: bytes
    status: int


def memory():
    """Return a directory in memory for temporary files, or None for the usual one."""
    return MEMORY if os.access(MEMORY, os.W_OK) else None


def program(*words):
    """Return Python code that runs the command with these words."""
    return f"import sys; from viscopade.cli.main import main; sys.argv[1:] = {[*words]!r}; main()"


def variables(changed=()):
    """Return the environment of a process, without what a user may have set; None takes a variable away."""
    usual = {k: v for k, v in os.environ.items() if k == "PYTHONPATH" or not k.startswith(("PYTHON", *SHOWN))}
    return {name: value for name, value in {**usual, **dict(changed)}.items() if value is not None}


def words_of(code, options=()):
    """Return the command line of Python code; as for the installed command, `.` is no place to look for modules."""
    return [sys.executable, "-P", *options, "-c", code]


def run(code, options=(), changed=(), directory=None, before=None, **streams):
    """Run Python code in a new process."""
    streams = {"stdin": subprocess.DEVNULL, "stdout": subprocess.PIPE, "stderr": subprocess.PIPE} | streams
    done = subprocess.run(
        words_of(code, options), env=variables(changed), cwd=directory, timeout=HANGS, preexec_fn=before, **streams
    )
    return Ran(done.stdout or b"", done.stderr or b"", done.returncode)


def run_without(code, *numbers):
    """Run code with some of standard input, output and error, 0 to 2, closed."""
    return run(code, before=lambda: [os.close(number) for number in numbers])


def run_into_full(code):
    """Run code with a full disk for standard output."""
    with open("/dev/full", "wb") as full:
        return run(code, stdout=full)


def read_one_byte(code):
    """Run code that prints into a pipe whose reader reads one byte and goes."""
    with subprocess.Popen(words_of(code), stdout=subprocess.PIPE, stderr=subprocess.PIPE, env=variables()) as process:
        with suppress(OSError, AttributeError):  # a pipe that holds less than what is printed
            fcntl.fcntl(process.stdout.fileno(), fcntl.F_SETPIPE_SZ, 4096)
        first = os.read(process.stdout.fileno(), 1)
        process.stdout.close()
        err = process.stderr.read()
    return Ran(first, err, process.returncode)


def run_on_terminal(code):
    """Run code with standard error on a terminal; what is shown there is returned as it."""
    ours, theirs = pty.openpty()
    shown = b""
    with subprocess.Popen(
        words_of(code), stdout=subprocess.PIPE, stderr=theirs, env=variables({"TERM": "xterm"})
    ) as process:
        os.close(theirs)
        with suppress(OSError):  # how a terminal ends
            while piece := os.read(ours, 65536):
                shown += piece
        out = process.communicate(timeout=HANGS)[0]
    os.close(ours)
    return Ran(out, shown, process.returncode)
