"""Locale, encoding, directory, Python's options and the settings of the calling program change no result.

The same commands run in new processes, each time with something changed, and what they print is compared with what they
print as usual. Other Pythons and other versions of packages take too long for this: noxfile.py has them.
"""

import json
import os
import re
import subprocess
import sys
from dataclasses import dataclass, field
from functools import cache
from pathlib import Path
from typing import NamedTuple

import pytest

import viscopade as vp
from tests.patience import HANGS

COMMANDS = (
    ("epsilon", "--v-star", "1.5", "--digits", "25"),
    ("pade", "1", "4", "--digits", "8"),
    ("export", "c", "--pade", "1/4"),
    ("coefficients", "--order", "6", "--format", "csv"),
    ("epsilon", "--v-star", "1,5"),
)
"""Tables with lines and accents, a generated file, numbers, and a wrong input with its message."""
CODE = """
import sys
from viscopade.cli.main import main
for words in {commands!r}:
    sys.argv = ["viscopade", *words]
    try:
        main()
    except SystemExit as end:
        sys.stdout.flush()
        print("exit", end.code, flush=True)
"""
SHOWN = ("COLUMNS", "LINES", "FORCE_COLOR", "NO_COLOR")
SHADOWS = ("math", "numpy", "flint", "click", "string", "decimal")  # modules, of which a directory has files so named
NOWHERE = f"{__file__}/nowhere"
"""A place that cannot be made, not even by root: its parent is a file."""
ESCAPE = re.compile(rb"\\u[0-9a-f]{4}|\\x[0-9a-f]{2}")
NUMBER = re.compile(rb"\d[\d.]*(?:[eE][-+]?\d+)?")


@dataclass(frozen=True)
class Environment:
    """What is changed: variables (None takes one away), Python's options, the directory ("deleted": it is gone).

    The output must be the same: to the byte, or, where there is no UTF-8, its numbers.
    """

    name: str
    variables: dict[str, str | None] = field(default_factory=dict)
    options: tuple[str, ...] = ()
    directory: str = "usual"
    bytes: bool = True


QUICK = (
    Environment("C locale, no UTF-8", {"LC_ALL": "C", "PYTHONUTF8": "0", "PYTHONCOERCECLOCALE": "0"}, bytes=False),
    Environment("Latin-1 only", {"PYTHONIOENCODING": "latin-1"}, bytes=False),
    Environment("-OO, -W error, -X dev", {"PYTHONHASHSEED": "1"}, ("-OO", "-W", "error", "-X", "dev")),
    Environment(
        "directory deleted; no HOME, PATH, LANG; COLUMNS=1, FORCE_COLOR=1",
        {"HOME": NOWHERE, "PATH": "", "COLUMNS": "1", "LANG": None, "FORCE_COLOR": "1"},
        directory="deleted",
    ),
)
MORE = (
    Environment("PYTHONUTF8=1", {"PYTHONUTF8": "1"}),
    Environment("python -I", {}, ("-I",)),
    Environment("python -bb", {}, ("-bb",)),
    Environment("directory with a space and an umlaut", directory="Größe und Maß"),
    Environment("directory with math.py, numpy.py, flint.py …", directory="shadowing"),
    Environment("TERM=dumb", {"TERM": "dumb"}),
    Environment("COLUMNS=20, LINES=1", {"COLUMNS": "20", "LINES": "1"}),
    Environment("TZ, SOURCE_DATE_EPOCH", {"TZ": "Pacific/Chatham", "SOURCE_DATE_EPOCH": "0"}),
    Environment("MPMATH_NOGMPY", {"MPMATH_NOGMPY": "1"}),
    Environment("one thread", {"FLINT_NUM_THREADS": "1", "OMP_NUM_THREADS": "1"}),
)
LOCALES = ("de_DE.UTF-8", "fr_FR.UTF-8", "tr_TR.UTF-8", "fa_IR.UTF-8", "ar_EG.UTF-8", "hi_IN.UTF-8")
"""With other commas, digits and letters."""


@cache
def locales_here():
    """Return those that this machine has."""
    try:
        listed = subprocess.run(["locale", "-a"], capture_output=True, timeout=HANGS).stdout.decode(errors="replace")
    except OSError:
        return ()
    plain = {name.lower().replace("-", "") for name in listed.split()}
    return tuple(name for name in LOCALES if name.lower().replace("-", "") in plain)


class Ran(NamedTuple):
    """What a process printed, and its exit status."""

    out: bytes
    err: bytes
    status: int


def run(code, options=(), changed=(), directory=None, before=None):
    """Run Python code in a new process, without what a user may have set; None takes a variable away."""
    usual = {k: v for k, v in os.environ.items() if k == "PYTHONPATH" or not k.startswith(("PYTHON", *SHOWN))}
    variables = {name: value for name, value in {**usual, **dict(changed)}.items() if value is not None}
    words = [sys.executable, "-P", *options, "-c", code]  # as for the installed command, `.` has no modules
    done = subprocess.run(words, capture_output=True, env=variables, cwd=directory, timeout=HANGS, preexec_fn=before)
    return Ran(done.stdout, done.stderr, done.returncode)


def in_environment(given, code, top):
    """Run code in an environment, whose directory is made in `top`."""
    directory = Path(top) / given.directory
    directory.mkdir()
    if given.directory == "shadowing":
        for name in SHADOWS:
            (directory / f"{name}.py").write_text("raise SystemExit('this is not the module that was wanted')\n")
    leave = directory.rmdir if given.directory == "deleted" else None
    return run(code, given.options, given.variables, directory, leave)


def numbers(text):
    """Return the numbers in a text; characters that were printed as escapes are none."""
    return NUMBER.findall(ESCAPE.sub(b"", text))


def alike(given, usual, ran):
    """Whether an environment left the output as it must."""
    assert b"Traceback" not in ran.err
    assert b"Warning" not in ran.err
    return ran == usual or (not given.bytes and numbers(ran.out) == numbers(usual.out) and ran.status == usual.status)


@pytest.fixture(scope="module")
def usual():
    return run(CODE.format(commands=COMMANDS))


def test_what_is_printed_is_what_the_package_computes(usual):
    """The output that environments are compared with, by another route."""
    first, *others = usual.out.split(b"exit ")
    assert str(vp.exact.collision("1.5", digits=25).decimals()["epsilon"]).encode() in first
    assert [other.split(b"\n")[0] for other in others] == [b"0", b"0", b"0", b"0", b"2"]
    assert usual.err.count(b"\n") == 1


@pytest.mark.parametrize(
    "given", [*QUICK, *(pytest.param(one, marks=pytest.mark.slow) for one in MORE)], ids=lambda one: one.name
)
def test_an_environment_changes_nothing(given, usual, tmp_path):
    ran = in_environment(given, CODE.format(commands=COMMANDS), tmp_path)
    assert alike(given, usual, ran), ran


@pytest.mark.parametrize("first", [True, pytest.param(False, marks=pytest.mark.slow)], ids=["first", "others"])
def test_a_locale_changes_nothing(first, usual):
    here = locales_here()[:1] if first else locales_here()[1:]
    if not here:
        pytest.skip(f"this machine has none of {', '.join(LOCALES)}, or one only")
    for name in here:
        assert run(CODE.format(commands=COMMANDS), changed={"LC_ALL": name}) == usual, name


def test_a_user_whom_the_machine_does_not_know_has_no_home(tmp_path):
    """Programs in containers run with any number; Matplotlib then finds no place for its cache."""
    pytest.importorskip("matplotlib")
    unknown = "import pwd\ndef unknown(*_): raise KeyError\npwd.getpwuid = pwd.getpwnam = unknown\n"
    words = ("plot", "--beta", "0.1", "-o", str(tmp_path / "plot.svg"))
    ran = run(unknown + CODE.format(commands=[words]), changed={"HOME": None, "XDG_CACHE_HOME": NOWHERE})
    assert (ran.out[-7:], ran.err, ran.status) == (b"exit 0\n", b"", 0)


# --- settings of the calling program ----------------------------------------------------------------------------------

# What a program may have set before it calls the package, and how that reads afterwards.
SETTINGS = {
    "mpmath at 7 digits": ("import mpmath; mpmath.mp.dps = 7", "mpmath.mp.dps"),
    "FLINT at 20 bits": ("import flint; flint.ctx.prec = 20", "flint.ctx.prec"),
    "decimal with 5 digits, rounding up": (
        "import decimal; decimal.setcontext(decimal.Context(prec=5, rounding=decimal.ROUND_UP))",
        "decimal.getcontext().prec, decimal.getcontext().rounding",
    ),
    "NumPy: floating-point errors are raised": (
        "import numpy; numpy.seterr(all='raise')",
        "sorted(numpy.geterr().items())",
    ),
    "random and NumPy seeded": (
        "import random, numpy; random.seed(1); numpy.random.seed(1)",
        "random.getstate(), numpy.random.get_state()[1].tolist()",
    ),
    "locale of the environment": (
        "import locale; locale.setlocale(locale.LC_ALL, '')",
        "locale.setlocale(locale.LC_ALL)",
    ),
}
OFTEN = ("mpmath at 7 digits", "NumPy: floating-point errors are raised")
API = """
import json, sys
{before}
found = repr(({state}))
import viscopade as vp
results = [
    vp.exact.collision("1.5", digits=40).decimals(),
    vp.exact.invert("0.3", digits=30).decimals(),
    vp.series(30, 40).decimals(),
    vp.pade(3, 6).decimals(20),
    [x.hex() for x in vp.epsilon([0, 1e-300, 1e-5, 0.5, 1.5, 1e5, 1e300]).tolist()],
    [x.hex() for x in vp.one_minus_epsilon([0, 1e-300, 1e-5, 0.5, 1.5, 1e5, 1e300]).tolist()],
    [x.hex() for x in vp.restitution([0, 1e-300, 1e-5, 0.5, 1.5, 1e5, 1e300], 1.3).tolist()],
]
print(json.dumps([results, found, repr(({state}))]))
"""


@cache
def results():
    return json.loads(run(API.format(before="", state="None")).out)[0]


def after_setting(name):
    """Call the package after a program has set something; return whether all results are right, and it was kept.

    A program that sets the locale of the environment has decimal commas, if the machine has such a locale.
    """
    before, state = SETTINGS[name]
    locale = {"LC_ALL": locales_here()[0]} if locales_here() else {}
    ran = run(API.format(before=before, state=state), changed=locale)
    found, was, now = json.loads(ran.out)
    return found == results(), was == now


@pytest.mark.parametrize(
    "name", [name if name in OFTEN else pytest.param(name, marks=pytest.mark.slow) for name in SETTINGS]
)
def test_settings_are_kept_and_change_nothing(name):
    assert after_setting(name) == (True, True)
