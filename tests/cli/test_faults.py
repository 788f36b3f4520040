"""Faults of the machine: closed and full streams, a reader that goes, signals, missing homes and packages.

Every end is the right output or one line, and no file is left half-written. Processes are started only where streams,
signals, the environment or the imports matter.
"""

import os
import pty
import re
import signal
import subprocess
import sys
import tomllib
from contextlib import suppress
from pathlib import Path
from typing import NamedTuple

import pytest

from tests.cli import VISCOPADE, called, refused
from tests.patience import HANGS
from viscopade import Points, fit
from viscopade.extras import EXTRAS
from viscopade.kernels import requests
from viscopade.theory.paper import TABLE
from viscopade_lab.figures import registry as figures

ROOT = Path(__file__).parents[2]
NOWHERE = f"{__file__}/nowhere"
"""A place that cannot be made, not even by root: its parent is a file."""
NUMBERS = ("epsilon", "--v-star", "1.5", "--digits", "25")
FULL = "viscopade: cannot print: No space left on device\n"


class Fault(NamedTuple):
    """A command line, what is wrong with its process, and its end: status, standard error."""

    words: tuple[str, ...]
    status: int
    said: str = ""
    closed: tuple[int, ...] = ()  # of standard input, output and error
    full: str | None = None  # stream that is a full disk
    environment: dict[str, str] = {}  # noqa: RUF012


FAULTS = {
    "help on a full disk": Fault((), 1, FULL, full="stdout"),
    "numbers on a full disk": Fault(NUMBERS, 1, FULL, full="stdout"),
    "refusal on a full disk": Fault(("epsilon", "--v-star", "1,5"), 2, full="stderr"),
    "no standard input": Fault(NUMBERS, 0, closed=(0,)),
    "no standard output": Fault(NUMBERS, 0, closed=(1,)),
    "no standard error": Fault(NUMBERS, 0, closed=(2,)),
    "no stream at all": Fault(NUMBERS, 0, closed=(0, 1, 2)),
    "no home": Fault(NUMBERS, 0, environment={"HOME": NOWHERE, "XDG_CACHE_HOME": NOWHERE}),
    "another backend": Fault(NUMBERS, 0, environment={"VISCOPADE_BACKEND": "numpy"}),
}


@pytest.mark.parametrize("name", FAULTS)
def test_a_fault_is_one_line_or_nothing(name):
    fault = FAULTS[name]
    if fault.full and not os.path.exists("/dev/full"):
        pytest.skip("there is no device that is always full")
    streams = {"stdin": subprocess.DEVNULL, "stdout": subprocess.PIPE, "stderr": subprocess.PIPE}
    if fault.full:
        streams[fault.full] = os.open("/dev/full", os.O_WRONLY)
    ended = subprocess.run(
        [*VISCOPADE, *fault.words],
        **streams,
        env=os.environ | fault.environment,
        preexec_fn=lambda: [os.close(number) for number in fault.closed],
        timeout=HANGS,
    )
    if fault.full:
        os.close(streams[fault.full])
    assert ended.returncode == fault.status
    if 2 not in fault.closed and fault.full != "stderr":
        assert ended.stderr.decode() == fault.said
    if fault.status == 0 and 1 not in fault.closed:
        assert ended.stdout.decode() == called(*fault.words).stdout


def test_the_reader_of_a_pipe_goes():
    """`viscopade … | true` ends quietly."""
    with subprocess.Popen([*VISCOPADE, *NUMBERS], stdout=subprocess.PIPE, stderr=subprocess.PIPE) as process:
        process.stdout.close()
        assert process.stderr.read() == b""


@pytest.fixture
def _interruptible():
    """Python ignores interruptions in jobs that a shell starts in the background, such as `make test &`."""
    before = signal.signal(signal.SIGINT, signal.default_int_handler)
    yield
    signal.signal(signal.SIGINT, before)


@pytest.mark.usefixtures("_interruptible")
def test_an_interruption_is_one_line(monkeypatch):
    monkeypatch.setattr(requests, "render_series", lambda *_: os.kill(os.getpid(), signal.SIGINT))
    ended = called("export", "series-json")
    assert (ended.returncode, ended.stdout, ended.stderr) == (130, "", "\nviscopade: interrupted\n")


def test_an_interruption_while_modules_are_imported_is_one_line():
    """By the entry point that is installed."""
    entry = tomllib.loads((ROOT / "pyproject.toml").read_text("utf-8"))["project"]["scripts"]["viscopade"]
    module, _, function = entry.partition(":")
    code = f"""
import os, signal, sys
signal.signal(signal.SIGINT, signal.default_int_handler)
from {module} import {function}
class Interrupting:
    def find_spec(self, name, *_):
        if name == "viscopade.cli.derive":
            os.kill(os.getpid(), signal.SIGINT)
sys.meta_path.insert(0, Interrupting())
{function}()
"""
    ended = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, timeout=HANGS)
    assert (ended.returncode, ended.stdout, ended.stderr) == (130, "", "\nviscopade: interrupted\n")


def test_progress_is_shown_on_a_terminal_only_and_taken_away():
    ours, theirs = pty.openpty()
    words = ("coefficients", "--order", "60", "--digits", "60")
    shown = b""
    with subprocess.Popen(
        [*VISCOPADE, *words], stdout=subprocess.PIPE, stderr=theirs, env=os.environ | {"TERM": "xterm"}
    ) as process:
        os.close(theirs)
        with suppress(OSError):  # how a terminal ends
            while piece := os.read(ours, 65536):
                shown += piece
        out = process.communicate(timeout=HANGS)[0]
    os.close(ours)
    assert b"perturbation orders" in shown
    assert re.split(rb"\x1b\[2K", shown)[-1].strip() == b""
    plain = called(*words, environment={"FORCE_COLOR": "1"})  # which Jupyter sets
    assert (plain.stdout.encode(), plain.stderr) == (out, "")


def test_reproduce_fails_on_a_mismatch_and_writes_nothing(tmp_path, monkeypatch):
    """The comparison can fail: with a digit of the printed table changed, it does."""
    a, b = TABLE[3, 6]
    monkeypatch.setitem(TABLE, (3, 6), (a, (*b[:-1], "0.235586")))
    result = called("reproduce", "--out", tmp_path / "out")
    assert result.returncode == 1
    assert "31 of 32 printed numbers agree" in result.stdout
    assert "NO" in result.stdout
    assert result.stderr == "viscopade: no file is written, because a printed number disagrees\n"
    assert not (tmp_path / "out").exists()


# --- what is not installed -------------------------------------------------------------------------------------------


@pytest.mark.parametrize(
    ("words", "user", "packages", "extras"),
    [
        (["figures", "--out"], "figures", "matplotlib, which is", "figures"),
        (["bench", "--picture"], "bench --picture", "matplotlib, which is", "figures"),
        (["hardcases", "--out"], "hardcases --out", "matplotlib, which is", "figures"),
        (["plot", "-o"], "plot", "matplotlib, which is", "figures"),
        (["plot", "--data", "data.csv", "-o"], "plot", "matplotlib and scipy, which are", "figures,fit"),
        (["fit", "data.csv", "--scene"], "fit", "scipy, which is", "fit"),
        (["fit", "data.ods", "--plot"], "fit", "scipy and python_calamine and matplotlib, which are", "figures,fit"),
    ],
    ids=["figures", "bench", "hardcases", "plot", "plot-data", "fit", "fit-plot"],
)
def test_what_to_install_is_said_before_any_work(words, user, packages, extras, tmp_path, monkeypatch):
    for package in EXTRAS:
        monkeypatch.setitem(sys.modules, package, None)  # importing it fails, as if it were not there
    monkeypatch.setattr(figures, "render", lambda *_, **__: pytest.fail("computed"))
    line = refused(*words, tmp_path / "new")
    assert line.startswith(f"viscopade: {user} needs {packages} not installed")
    assert line.endswith(f"{sys.executable} -m pip install 'viscopade[{extras}]'")
    assert not list(tmp_path.iterdir())


def test_public_functions_say_what_to_install(monkeypatch):
    points = Points.measured([0.1, 0.3, 1, 3], [0.938, 0.918, 0.901, 0.874])
    monkeypatch.setitem(sys.modules, "scipy", None)
    for call in (lambda: fit(points), lambda: Points.measured([0.1], [0.9])):
        with pytest.raises(ModuleNotFoundError, match=r"needs scipy, which is .*-m pip install 'viscopade\[fit\]'$"):
            call()


def test_extras_bring_what_they_are_said_to():
    project = tomllib.loads((ROOT / "pyproject.toml").read_text("utf-8"))["project"]
    for package, extra in EXTRAS.items():
        brought = project["optional-dependencies"][extra]
        assert any(line.startswith(f"{package.replace('_', '-')}>=") for line in brought), package


def test_without_the_compiler_of_the_environment_it_says_how_to_go_on(tmp_path):
    words = ("scene", "--example", "ice_rings", "--out", tmp_path / "new")
    assert "no-such-compiler" in refused(*words, environment={"CC": "no-such-compiler"})
    assert not (tmp_path / "new").exists()
