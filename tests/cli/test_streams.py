"""Streams that are closed, full, terminals, or that nobody reads: one line at most, and never as if all were well."""

import os
import re

import pytest

from tests.cli.processes import Ran, program, read_one_byte, run, run_into_full, run_on_terminal, run_without

CODE = program("epsilon", "--v-star", "1.5", "--digits", "25")
LONG = program("export", "c", "--pade", "1/4", "--pade", "3/6")
CARELESS = "import sys\nfor _ in range(9999): print('x')\nprint('half', file=sys.stderr)"  # with tracebacks, or nothing
full_disk = pytest.mark.skipif(not os.path.exists("/dev/full"), reason="there is no device that is always full")


def good_end(ran):
    """Whether a process ended well, or with one line that is no traceback."""
    return b"Traceback" not in ran.err and (ran.status == 0 or len(ran.err.splitlines()) == 1)


def left_on_terminal(shown):
    """Return what stays on a terminal when the progress is taken away."""
    return re.split(rb"\x1b\[2K", shown)[-1].strip()


def test_the_reader_of_a_pipe_goes():
    ran = read_one_byte(LONG)
    assert (ran.out, ran.err) == (b"/", b"")


@full_disk
def test_the_disk_is_full():
    assert run_into_full(CODE) == Ran(b"", b"viscopade: cannot print: No space left on device\n", 1)


@pytest.mark.parametrize(
    "numbers", [(1,), *(pytest.param(numbers, marks=pytest.mark.slow) for numbers in ((0,), (2,), (0, 1, 2)))], ids=str
)
def test_streams_are_closed(numbers):
    assert good_end(run_without(CODE, *numbers))


def test_progress_is_taken_away_from_a_terminal():
    ran = run_on_terminal(CODE)
    assert ran.status == 0
    assert ran.out == run(CODE).out != b""
    assert left_on_terminal(ran.err) == b""


def test_programs_that_do_not_care_are_found():
    assert b"Traceback" in read_one_byte(CARELESS).err
    assert not good_end(run_without(f"{CARELESS}\nprint(1 / 0)", 1))
    assert left_on_terminal(run_on_terminal(CARELESS).err) == b"half"
