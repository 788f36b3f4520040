"""The hard case of environments: it passes, and it finds what it looks for."""

import subprocess
import sys

import pytest

import viscopade as vp
from tests.hard_case import assert_passes
from viscopade_lab.hard_cases import environments, streams
from viscopade_lab.hard_cases.environments import COMMANDS, PROGRAM, Environment, compared, in_environment, numbers
from viscopade_lab.hard_cases.streams import Ran

HELLO = Ran(b"one\n2.50\n", b"", 0)


@pytest.fixture(scope="module")
def result():
    return environments.CASE.run(False)


def test_quick_run_passes(result):
    assert_passes(result)


@pytest.mark.slow
def test_thorough_run_passes():
    result = environments.CASE.run(True)
    assert_passes(result)


def test_what_is_printed_is_what_the_package_computes():
    """The output that environments are compared with, by another route."""
    ran = streams.run(PROGRAM.format(commands=COMMANDS[:1]))
    assert str(vp.exact.collision("1.5", digits=25).decimals()["epsilon"]).encode() in ran.out
    assert ran.out.endswith(b"exit 0\n")


@pytest.mark.parametrize(
    ("given", "ran", "good"),
    [
        (Environment("same"), HELLO, True),
        (Environment("number"), HELLO._replace(out=b"one\n2,50\n"), False),
        (Environment("number", bytes=False), HELLO._replace(out=b"one\n2.51\n"), False),
        (Environment("letters", bytes=False), HELLO._replace(out=b"un\n2.50\n"), True),
        (Environment("letters"), HELLO._replace(out=b"un\n2.50\n"), False),
        (Environment("warning", bytes=False), HELLO._replace(err=b"x.py:1: DeprecationWarning: y"), False),
        (Environment("status", bytes=False), HELLO._replace(status=1), False),
    ],
)
def test_differences_are_found(given, ran, good):
    assert compared(given, HELLO, ran).good is good


def test_numbers_are_found():
    assert numbers("v* 1.5e-3 │ 27\n".encode()) == [b"1.5e-3", b"27"]


def test_a_program_that_depends_on_its_environment_is_found():
    code = "import os; print(os.environ.get('TERM'), len(os.listdir('.')), __debug__)"
    usual = streams.run(code, (), {"TERM": "x"})
    for given in (Environment("TERM", {"TERM": "y"}), Environment("options", {"TERM": "x"}, ("-O",))):
        assert not compared(given, usual, in_environment(given, code)).good


def test_directories_are_as_they_are_said_to_be():
    """A module of the directory is not taken, and a directory that is gone is gone."""
    code = "import math, os; print(hasattr(math, 'cos'), os.path.exists('math.py'))"
    assert in_environment(Environment("x", directory="shadowing"), code).out == b"True True\n"
    gone = in_environment(Environment("x", directory="deleted"), "import os; os.getcwd()")
    assert b"FileNotFoundError" in gone.err


def test_settings_that_are_lost_are_found(monkeypatch):
    assert environments.settings(["mpmath at 7 digits"])[1:] == (0, 0)
    changed = environments.API.replace("print(json", "import mpmath; mpmath.mp.dps = 9\nprint(json")
    monkeypatch.setattr(environments, "API", changed)
    assert environments.settings(["mpmath at 7 digits"])[1:] == (0, 1)


def test_a_program_that_sets_its_locale_has_decimal_commas(monkeypatch):
    here, _ = environments.locales()
    if not here:
        pytest.skip("there is no locale with decimal commas")
    chosen = ["locale of the environment"]
    assert environments.settings(chosen, here)[1:] == (0, 0)
    printed = "import locale\nresults[0] = locale.str(1.5)\nprint(json"
    monkeypatch.setattr(environments, "API", environments.API.replace("print(json", printed))
    assert environments.settings(chosen, here)[1:] == (1, 0)


def test_streams_that_are_not_treated_well_are_found(monkeypatch):
    monkeypatch.setattr(streams, "ONE", "import sys\nfor _ in range(9999): print({words!r})")
    assert not streams.reader_leaves().good  # a traceback
    full = streams.disk_full()
    assert full is None or not full.good
    monkeypatch.setattr(streams, "ONE", "import sys; sys.stdout.write(''); {words!r}")
    assert not streams.closed(1).good


def test_progress_that_stays_is_found(monkeypatch):
    monkeypatch.setattr(streams, "ONE", "import sys; print('half', file=sys.stderr); print({words!r})")
    row, left = streams.on_terminal(HELLO)
    assert left > 0
    assert not row.good


def test_recorded_failures_count():
    row = {"failed": "2", "exports": "30", "exports_same": "29"}
    assert environments.recorded_failures([row, {**row, "failed": "0"}]) == 4


def test_console_needs_no_generic_parameters_of_click():
    """They exist from Click 8.4 on."""
    code = (
        "import click\n"
        "class Plain(click.ParamType):\n"
        "    __class_getitem__ = None\n"
        "click.ParamType = Plain\n"
        "import viscopade.cli.console"
    )
    assert subprocess.run([sys.executable, "-c", code], capture_output=True).stderr == b""
