"""Hard case: the command and the package in other environments: locales, encodings, directories, streams, settings.

The same commands run in new processes, each time with something changed, and what they print is compared with what they
print as usual. Other Pythons and other versions of packages take too long for this: `make matrix` records them in
data/environments.csv, and the record is told.
"""

from __future__ import annotations

import csv
import json
import os
import pkgutil
import re
import subprocess
from collections.abc import Mapping, Sequence
from contextlib import ExitStack
from dataclasses import dataclass, field
from tempfile import TemporaryDirectory
from typing import Any, cast

from viscopade.progress import track
from viscopade_lab.hard_cases.finding import Case, Cell, Chart, Check, Outcome, Table, curve
from viscopade_lab.hard_cases.streams import (
    COMMAND,
    TIMEOUT,
    Ran,
    StreamRow,
    closed,
    disk_full,
    on_terminal,
    program,
    reader_leaves,
    run,
)

RECORD = "data/environments.csv"
COMMANDS = (
    COMMAND,
    ("pade", "1", "4", "--digits", "8"),
    ("export", "c", "--pade", "1/4"),
    ("coefficients", "--order", "6", "--format", "csv"),
    ("epsilon", "--v-star", "1,5"),
)
"""What is run: tables with lines and accents, a generated file, numbers, and a wrong input with its message."""
SHADOWS = ("math", "numpy", "flint", "click", "string", "decimal")  # modules, of which a directory has files so named
_ESCAPE = re.compile(rb"\\u[0-9a-f]{4}|\\x[0-9a-f]{2}")
_NUMBER = re.compile(rb"\d[\d.]*(?:[eE][-+]?\d+)?")

# python -P: as for the installed command, the current directory is no place to look for modules.
PROGRAM = """
import sys
from viscopade.cli import main
for words in {commands!r}:
    sys.argv = ["viscopade", *words]
    try:
        main()
    except SystemExit as end:
        sys.stdout.flush()
        print("exit", end.code, flush=True)
"""

# What a program may have set before it calls the package, and how that reads afterwards.
SETTINGS: Mapping[str, tuple[str, str]] = {
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
}  # fmt: skip
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


@dataclass(frozen=True)
class Environment:
    """What is changed before the commands run.

    Attributes
    ----------
    name : str
    variables : mapping of str to str or None
        Of the environment; None takes one away.
    options : tuple of str
        Of Python.
    directory : "usual", "shadowing", "umlaut" or "deleted"
        The current directory.
    bytes : bool
        Whether the output must be the same to the byte; or else its numbers.
    """

    name: str
    variables: Mapping[str, str | None] = field(default_factory=dict)
    options: tuple[str, ...] = ()
    directory: str = "usual"
    bytes: bool = True


_NOWHERE = "/proc/viscopade/nowhere"
_QUICK = (
    Environment("C locale, no UTF-8", {"LC_ALL": "C", "PYTHONUTF8": "0", "PYTHONCOERCECLOCALE": "0"}, bytes=False),
    Environment("Latin-1 only", {"PYTHONIOENCODING": "latin-1"}, bytes=False),
    Environment("-OO, -W error, -X dev", {"PYTHONHASHSEED": "1"}, ("-OO", "-W", "error", "-X", "dev")),
    Environment(
        "directory deleted; no HOME, PATH, LANG; COLUMNS=1, FORCE_COLOR=1",
        {"HOME": _NOWHERE, "PATH": "", "COLUMNS": "1", "LANG": None, "FORCE_COLOR": "1"},
        directory="deleted",
    ),
)
_MORE = (
    *(Environment(f"PYTHONHASHSEED={seed}", {"PYTHONHASHSEED": str(seed)}) for seed in (0, 2, 3)),
    Environment("PYTHONUTF8=1", {"PYTHONUTF8": "1"}),
    Environment("ASCII only", {"PYTHONIOENCODING": "ascii"}, bytes=False),
    Environment("POSIX locale", {"LC_ALL": "POSIX", "LANG": None}),
    Environment("LANG unset", {"LANG": None, "LC_ALL": None}),
    Environment("python -E", {}, ("-E",)),
    Environment("python -I", {}, ("-I",)),
    Environment("python -O", {}, ("-O",)),
    Environment("python -bb", {}, ("-bb",)),
    Environment("directory with a space and an umlaut", {}, (), "umlaut"),
    Environment("directory with math.py, numpy.py, flint.py …", {}, (), "shadowing"),
    Environment("TERM=dumb", {"TERM": "dumb"}),
    Environment("TERM unset", {"TERM": None}),
    Environment("NO_COLOR", {"NO_COLOR": "1"}),
    Environment("COLUMNS=20, LINES=1", {"COLUMNS": "20", "LINES": "1"}),
    Environment("TZ, SOURCE_DATE_EPOCH", {"TZ": "Pacific/Chatham", "SOURCE_DATE_EPOCH": "0"}),
    Environment("MPMATH_NOGMPY", {"MPMATH_NOGMPY": "1"}),
    Environment("one thread", {"FLINT_NUM_THREADS": "1", "OMP_NUM_THREADS": "1"}),
    Environment("VISCOPADE_BACKEND=numpy", {"VISCOPADE_BACKEND": "numpy"}),
)
_LOCALES = ("de_DE.UTF-8", "fr_FR.UTF-8", "tr_TR.UTF-8", "fa_IR.UTF-8", "ar_EG.UTF-8", "hi_IN.UTF-8")
_DIRECTORIES = {"shadowing": "shadowing", "umlaut": "Größe und Maß"}


def locales() -> tuple[list[str], list[str]]:
    """Return the locales with other commas, digits and letters that this machine has, and those that it lacks."""
    try:
        listed = subprocess.run(["locale", "-a"], capture_output=True, timeout=TIMEOUT).stdout.decode(errors="replace")
    except OSError:
        listed = ""
    plain = {name.lower().replace("-", "") for name in listed.split()}
    here = [name for name in _LOCALES if name.lower().replace("-", "") in plain]
    return here, [name for name in _LOCALES if name not in here]


def in_environment(given: Environment, code: str) -> Ran:
    """Run code in an environment."""
    with ExitStack() as stack:
        place = stack.enter_context(TemporaryDirectory())
        directory = os.path.join(place, _DIRECTORIES.get(given.directory, "usual"))
        os.mkdir(directory)
        if given.directory == "shadowing":
            for name in SHADOWS:
                with open(os.path.join(directory, f"{name}.py"), "w", encoding="ascii") as file:
                    file.write("raise SystemExit('this is not the module that was wanted')\n")
        leave = (lambda: os.rmdir(directory)) if given.directory == "deleted" else None
        return run(code, given.options, given.variables, directory, leave)


def numbers(text: bytes) -> list[bytes]:
    """Return the numbers in a text; characters that were printed as escapes are none."""
    return _NUMBER.findall(_ESCAPE.sub(b"", text))


def compared(given: Environment, usual: Ran, ran: Ran) -> StreamRow:
    """Return what an environment did to the output."""
    if b"Traceback" in ran.err or b"Warning" in ran.err:
        return StreamRow(given.name, "traceback or warning", 0.0, False)
    lines, expected = ran.out.splitlines(), usual.out.splitlines()
    alike = sum(a == b for a, b in zip(lines, expected, strict=False)) / max(len(lines), len(expected), 1)
    if (ran.out, ran.err, ran.status) == usual:
        return StreamRow(given.name, "the same bytes", alike, True)
    if not given.bytes and numbers(ran.out) == numbers(usual.out) and ran.status == usual.status:
        return StreamRow(given.name, "the same numbers, other lines around them", alike, True)
    return StreamRow(given.name, "different", alike, False)


def drawn(changed: Mapping[str, str | None]) -> tuple[bytes, bytes]:
    """Return a figure that is drawn in a changed environment, and what is said on standard error."""
    with TemporaryDirectory() as place:
        ran = run(program("figures", "--only", "localSlope", "--out", place), changed=changed)
        path = os.path.join(place, "localSlope.svg")
        if not os.path.exists(path):
            return b"", ran.err
        with open(path, "rb") as file:
            return file.read(), ran.err


def drawing_without_home() -> StreamRow:
    """Draw where Matplotlib can keep neither settings nor its cache."""
    plain, _ = drawn({})
    nowhere = ("HOME", "XDG_CONFIG_HOME", "XDG_CACHE_HOME")
    picture, complaint = drawn({"MPLCONFIGDIR": None, **dict.fromkeys(nowhere, _NOWHERE)})
    same = bool(plain) and picture == plain
    words = f"{'the same' if same else 'another'} figure, {len(complaint)} bytes of complaint"
    return StreamRow("drawing; a HOME that cannot be written to", words, float(same), same and not complaint)


# --- the record -------------------------------------------------------------------------------------------------------


def record() -> list[dict[str, str]]:
    """Return the rows of the table that `make matrix` wrote."""
    text = cast(bytes, pkgutil.get_data("viscopade", RECORD)).decode()
    return list(csv.DictReader(text.splitlines()))


def recorded_failures(rows: Sequence[Mapping[str, str]]) -> int:
    """Return how many tests failed and how many exports differed, over all recorded environments."""
    return sum(int(row["failed"]) + int(row["exports"]) - int(row["exports_same"]) for row in rows)


def recorded_sets(rows: Sequence[Mapping[str, str]]) -> set[str]:
    """Return which of the two ends of what pyproject.toml allows were recorded."""
    return {row["set"] for row in rows} & {"oldest", "newest"}


def _matrix(rows: Sequence[Mapping[str, str]]) -> Table:
    names = (
        "python",
        "set",
        "sympy",
        "mpmath",
        "numpy",
        "python-flint",
        "click",
        "tests",
        "passed",
        "failed",
        "skipped",
    )
    cells = tuple((*(row[name] for name in names), f"{row['exports_same']} of {row['exports']}") for row in rows)
    return Table("Recorded by `make matrix`: other Pythons and packages", (*names, "exports the same"), cells)


# --- the case ---------------------------------------------------------------------------------------------------------


def settings(chosen: Sequence[str], here: Sequence[str] = ()) -> tuple[list[StreamRow], int, int]:
    """Call the package after a program has set something; return also how many results, and settings, changed.

    The locale of the environment is the first of `here`, if there is one: a program that sets it has decimal commas.
    """
    locale = {"LC_ALL": here[0]} if here else {}
    usual = json.loads(run(API.format(before="", state="None")).out)[0]
    rows, differing, lost = [], 0, 0
    for name in chosen:
        before, state = SETTINGS[name]
        ran = run(API.format(before=before, state=state), changed=locale)
        found, was, now = json.loads(ran.out) if ran.status == 0 else ([], "", "lost")
        same = sum(a == b for a, b in zip(found, usual, strict=False))
        differing += len(usual) - same
        lost += was != now
        words = f"{same} of {len(usual)} results the same, setting {'kept' if was == now else 'lost'}"
        rows.append(StreamRow(name, words, same / len(usual), same == len(usual) and was == now))
    return rows, differing, lost


def check(thorough: bool) -> Outcome:
    """Run everything, and compare."""
    here, lacking = locales()
    wanted = [*_QUICK, *(_MORE if thorough else ())]
    wanted += [Environment(f"locale {name}", {"LC_ALL": name}) for name in (here if thorough else here[:1])]
    code = PROGRAM.format(commands=COMMANDS)
    usual = run(code)
    ran = [(wanted[i], in_environment(wanted[i], code)) for i in track(range(len(wanted)), "environments")]
    rows = [compared(given, usual, one) for given, one in ran]
    streams = [reader_leaves(), disk_full(), closed(1), *((closed(0), closed(2), closed(0, 1, 2)) if thorough else ())]
    terminal, left = on_terminal(usual)
    of_streams = [row for row in streams if row is not None]
    of_settings, differing, lost = settings(list(SETTINGS) if thorough else list(SETTINGS)[:4:3], here)
    recorded = record()
    drawing = [drawing_without_home()] if thorough else []
    everything = [*rows, *drawing, *of_streams, terminal, *of_settings]
    bytes_ = [terminal, *drawing, *(row for (given, _), row in zip(ran, rows, strict=True) if given.bytes)]
    others = [row for (given, _), row in zip(ran, rows, strict=True) if not given.bytes]
    checks = (
        Check("environments in which the output differs in any byte", sum(not r.good for r in bytes_), "==", 0),
        Check("environments without UTF-8 in which a number differs", sum(not r.good for r in others), "==", 0),
        Check(
            "streams that are closed or full: runs that end with a traceback, with more than one line, or, the disk "
            "full, as if all were well", sum(not r.good for r in of_streams), "==", 0,
        ),
        Check("characters that progress leaves on a terminal", left, "==", 0),
        Check("results that depend on precisions and modes that the caller has set", differing, "==", 0),
        Check("settings of the caller that are lost", lost, "==", 0),
        Check("recorded for other Pythons and packages: failed tests, and exports that differ",
              recorded_failures(recorded), "==", 0),
        Check("of the oldest and the newest versions of the packages, how many were recorded",
              len(recorded_sets(recorded)), "==", 2),
    )  # fmt: skip
    return Outcome(
        _summary(everything, here, lacking, recorded), _tables(everything, recorded), (_chart(rows),), checks
    )


def _summary(rows: Sequence[StreamRow], here: Sequence[str], lacking: Sequence[str], recorded: Sequence[Any]) -> str:
    same = sum(row.result == "the same bytes" for row in rows)
    text = f"{len(rows)} environments, in {same} of which the output is the same to the byte; "
    text += f"{sum(not row.good for row in rows)} are not as they should be. "
    if lacking:
        text += f"Not tried, as this machine does not have them: the locales {', '.join(lacking)}. "
    pythons = sorted({row["python"] for row in recorded}, key=lambda v: [int(part) for part in v.split(".")])
    if pythons:
        tests = sum(int(row["passed"]) for row in recorded)
        text += f"Recorded by `make matrix`: Python {', '.join(pythons)}, in {len(recorded)} sets of versions of the "
        text += f"packages; {tests} tests passed, {sum(int(row['failed']) for row in recorded)} failed."
    return text.strip()


def _tables(rows: Sequence[StreamRow], recorded: Sequence[Mapping[str, str]]) -> tuple[Table, ...]:
    cells: tuple[tuple[Cell, ...], ...] = tuple((row.name, row.result, "yes" if row.good else "NO") for row in rows)
    return Table("What was changed, and what came", ("environment", "result", "as it should be"), cells), _matrix(
        recorded
    )


def _chart(rows: Sequence[StreamRow]) -> Chart:
    places = range(1, len(rows) + 1)
    return Chart(
        "Lines of the output that are as usual",
        "environment (row of the table)",
        "share",
        (curve("lines", places, [row.share for row in rows], "points"), curve("all", (1, len(rows)), (1, 1), "bound")),
        "linear",
        "linear",
    )


CASE = Case(
    "environments",
    "Other environments",
    "Do locale, encoding, directory, streams, Python's options or the settings of the calling program change a result?",
    check,
)
