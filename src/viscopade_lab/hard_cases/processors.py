"""Hard case: the exported headers on other processors, with other C libraries and compilers, run under emulation.

Every header is compiled by itself for each processor. Every function with a stated error is called at many arguments:
a million of each type in the thorough run. The bounds of the header must hold, wherever it states them. The bound of a
formula hides rounding errors, so the results are also compared with those of gcc on this machine: both are within the
stated rounding error of the formula's value, and so differ by at most twice that. A processor is left out if its
compiler or emulator is missing; INSTALL brings them all on Debian.
"""

from __future__ import annotations

import math
import platform
import shutil
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, replace
from tempfile import TemporaryDirectory
from typing import Literal, NamedTuple

import numpy as np

from viscopade.progress import track
from viscopade_lab.hard_cases import compilers, million
from viscopade_lab.hard_cases.compilers import HEADERS, OVER, TYPES, Build, BuildResult, Form, HeaderFunction, Rules
from viscopade_lab.hard_cases.finding import Case, Cell, Chart, ChartCurve, Check, Outcome, ResultTable, curve
from viscopade_lab.hard_cases.machine import Array, moved
from viscopade_lab.hard_cases.million import UNCERTAINTY, UNCERTAINTY_OF_DERIVATIVE, LongDoubleValues, StatedBounds

SEED = 17
NUMBER = {True: 1_000_000, False: 2000}
"""Arguments of each type, by thoroughness."""
FRACTION = 10  # of the arguments is for builds of a processor after its first
SECONDS = 1800  # for one program; emulated arithmetic is slow
ROWS = 64  # to an octave, at whose ends arguments are tried: the finest tables have as many

# --- processors -------------------------------------------------------------------------------------------------------


Compilation = tuple[str, Rules, str]
"""Flags, what results they must give, and the standard: a way to compile."""


@dataclass(frozen=True)
class Processor:
    """A processor with a C library and a compiler, and the ways to compile for it.

    Attributes
    ----------
    name : str
    compiler : str
        The command.
    emulator : str
        The command that runs programs; "" if this machine does.
    packages : str
        What brings them on Debian.
    builds : tuple of Compilation
        Rules are "bits" where every operation is rounded once, as on x86-64. The first gets all arguments.
    order : str
        The byte order of numbers: "<" or ">".
    """

    name: str
    compiler: str
    emulator: str
    packages: str
    builds: tuple[Compilation, ...]
    order: Literal["<", ">"] = "<"

    def missing(self) -> str:
        """Return what is not there; "" if nothing is missing."""
        return " and ".join(tool for tool in (self.compiler, self.emulator) if tool and shutil.which(tool) is None)

    def start(self, directory: str) -> tuple[str, ...]:
        """Return the words that run a program; Windows' registry goes to a directory."""
        if self.emulator == "wine":
            return ("env", f"WINEPREFIX={directory}", "WINEDEBUG=-all", "wine")
        return (self.emulator,) if self.emulator else ()

    def flags(self, words: str) -> tuple[str, ...]:
        """Return the flags of a build; programs that are emulated find no shared libraries."""
        return (*words.split(), "-static") if self.emulator.startswith("qemu") else tuple(words.split())


_OFF = "-O2 -ffp-contract=off"
_FUSED: tuple[Compilation, ...] = (("-O2", "contracted", "gnu17"), (_OFF, "bits", "c99"))
_NEON: tuple[Compilation, ...] = (("-O3 -mfpu=neon-vfpv4", "contracted", "gnu17"), (_OFF, "bits", "c99"))
_X87: tuple[Compilation, ...] = (
    ("-O2 -mfpmath=387", "extended", "gnu17"),
    ("-O2 -mfpmath=387", "extended", "c99"),
    ("-O0 -mfpmath=387", "extended", "gnu17"),
)
_PLAIN: tuple[Compilation, ...] = ((_OFF, "bits", "c99"),)
_TCC: tuple[Compilation, ...] = (("-O2", "bits", "c99"),)
_SSE: tuple[Compilation, ...] = (("-O2 -msse2 -mfpmath=sse", "bits", "c99"),)
# In a strict standard, s390x computes type float in type double (FLT_EVAL_METHOD 1).
_S390: tuple[Compilation, ...] = (("-O2", "contracted", "gnu17"), (_OFF, "bits", "gnu17"), (_OFF, "extended", "c99"))
_HOST = platform.machine()
HERE = Processor(f"{_HOST}, this machine", "gcc", "", "gcc", _PLAIN)
"""Its bits are those that others are compared with."""
TARGETS = (
    HERE,
    Processor(f"{_HOST}, musl", "musl-gcc", "", "musl-tools", _PLAIN),
    Processor(f"{_HOST}, tcc", "tcc", "", "tcc", _TCC),
    Processor("x86_64, MinGW", "x86_64-w64-mingw32-gcc", "wine", "gcc-mingw-w64-x86-64 wine64 wine", _PLAIN),
    Processor("aarch64", "aarch64-linux-gnu-gcc", "qemu-aarch64", "gcc-aarch64-linux-gnu", _FUSED),
    Processor("armhf", "arm-linux-gnueabihf-gcc", "qemu-arm", "gcc-arm-linux-gnueabihf", _NEON),
    Processor("riscv64", "riscv64-linux-gnu-gcc", "qemu-riscv64", "gcc-riscv64-linux-gnu", _FUSED),
    Processor("s390x", "s390x-linux-gnu-gcc", "qemu-s390x", "gcc-s390x-linux-gnu", _S390, ">"),
    Processor("i386, SSE2", "i686-linux-gnu-gcc", "qemu-i386", "gcc-i686-linux-gnu", _SSE),
    Processor("i386, x87", "i686-linux-gnu-gcc", "qemu-i386", "gcc-i686-linux-gnu", _X87),
)
INSTALL = "apt-get install " + " ".join(
    dict.fromkeys(["qemu-user", *" ".join(target.packages for target in TARGETS).split()])
)


def present() -> tuple[Processor, ...]:
    """Return what can be built and run here; nothing without gcc, with whose results others are compared."""
    found = tuple(target for target in TARGETS if not target.missing())
    return found if HERE in found else ()


# --- arguments and what is right for them -----------------------------------------------------------------------------

_INF, _NAN = float("inf"), float("nan")
_REFUSED = (-_INF, -1.0, _NAN)
_SPECIAL = (0.0, -0.0, _INF, *_REFUSED)
SPECIAL = {"v_star": _SPECIAL, "speed": _SPECIAL, "epsilon": (*_SPECIAL, 1.0, 2.0)}
"""Arguments whose results are known without computing."""
_NANS = (_NAN,) * len(_REFUSED)
ANSWERS = {
    "epsilon": (1.0, 1.0, 0.0, *_NANS),
    "one_minus_epsilon": (0.0, 0.0, 1.0, *_NANS),
    "epsilon_derivative": (0.0, 0.0, 0.0, *_NANS),
    "restitution": (1.0, 1.0, 0.0, *_NANS),
    "rebound": (0.0, 0.0, _INF, *_NANS),
    "dissipation": (0.0, 0.0, 1.0, *_NANS),
    "v_star": (_NAN, _NAN, _NAN, *_NANS, 0.0, _NAN),
    "v_star_from_loss": (0.0, 0.0, _NAN, *_NANS, _NAN, _NAN),
}
_USUAL = {"v_star": (-14, 5), "speed": (-100, 66)}  # exponents of 2, where eps is neither 0 nor 1, and tables are


@dataclass(frozen=True)
class Arguments:
    """Arguments of functions, by what they are and by type."""

    arguments: Mapping[tuple[str, Form], Array]

    def given(self, over: str, form: Form) -> Array:
        """Return arguments of a type, with the special ones."""
        return np.concatenate([self.arguments[over, form], np.array(SPECIAL[over], dtype=TYPES[form])])

    def first(self, number: int) -> Arguments:
        """Return the first of these."""
        return Arguments({key: x[:number] for key, x in self.arguments.items()})


def arguments(number: int) -> Arguments:
    """Return so many arguments of each type."""
    generator = np.random.default_rng(SEED)
    return Arguments({(over, form): _arguments(over, form, number, generator) for over in OVER for form in TYPES})


def _arguments(over: str, form: Form, number: int, generator: np.random.Generator) -> Array:
    """Return positive finite numbers: of all sizes; more where the functions change; at the ends of rows; mixed."""
    kind = TYPES[form]
    largest = 1.0 if over == "epsilon" else np.finfo(kind).max
    bits = np.array([np.finfo(kind).smallest_subnormal, largest], dtype=kind).view(f"i{np.dtype(kind).itemsize}")
    anywhere = generator.integers(bits[0], bits[1], number // 8, dtype=bits.dtype).view(kind)
    if over == "epsilon":
        near_one = 1 - generator.choice(anywhere, len(anywhere))
        usual = generator.uniform(0, 1, number - 2 * len(anywhere))
        found = np.concatenate([anywhere, near_one, usual]).astype(kind)
        below = np.nextafter(kind(1), kind(0))
        chosen = np.clip(found, np.finfo(kind).smallest_subnormal, below)
    else:
        ends = _ends(*_USUAL[over], kind)
        ends = generator.choice(ends, min(len(ends), number // 8), replace=False)
        usual = np.exp2(generator.uniform(*_USUAL[over], number - len(anywhere) - len(ends))).astype(kind)
        chosen = np.concatenate([anywhere, ends, usual])
    return generator.permutation(chosen)


def _ends(low: int, high: int, kind: type[np.floating]) -> Array:
    """Return the numbers at which rows of tables may begin, and those beside them."""
    ends = np.outer(np.exp2(np.arange(low, high)), 1 + np.arange(ROWS) / ROWS).ravel().astype(kind)
    return np.concatenate([moved(ends, np.array(step)) for step in (-1, 0, 1)])


class ReferenceValues:
    """Exact values at given arguments, computed once for all functions."""

    def __init__(self, points: Arguments) -> None:
        self.points = points
        self.few = points.first(len(points.arguments["v_star", "double"]) // FRACTION)
        self._known: dict[tuple[str, Form], LongDoubleValues] = {}

    def at(self, function: HeaderFunction) -> LongDoubleValues:
        """Return the exact values at a function's arguments."""
        key = function.kind if function.over == "epsilon" else f"of {function.over}", function.form
        if key not in self._known:
            x = self.points.arguments[function.over, function.form]
            if function.over == "epsilon":
                self._known[key] = million.long_double_inverse(x, function.kind == "v_star_from_loss")
            else:
                self._known[key] = million.long_double_values(function.over, x)
        return self._known[key]

    def limits(self, claim: StatedBounds) -> Limits:
        """Return what results of a function are held to."""
        at = self.at(claim.function)
        truth = at.of(claim.function.kind)
        unknown = UNCERTAINTY_OF_DERIVATIVE if claim.function.kind == "epsilon_derivative" else UNCERTAINTY
        allowed, rounding = claim.allowed(at, truth), claim.rounding(at, truth)
        return Limits(claim.function, at.x, truth, unknown * np.abs(truth), allowed, rounding, claim.plain(at))


class Limits(NamedTuple):
    """What results of a function are held to, at each argument.

    `allowed` is all that is stated, `rounding` what is of rounding alone; `plain` tells where libm is not called.
    """

    function: HeaderFunction
    x: Array
    truth: Array
    unknown: Array
    allowed: Array
    rounding: Array
    plain: Array


# --- building, running and judging ------------------------------------------------------------------------------------


class HeaderRun(NamedTuple):
    """What came of a header in a build.

    Attributes
    ----------
    target, build, header : Processor, Build, str
    results : int
        How many there are.
    part : float
        The largest error in parts of the stated bound; the uncertainty of the truth counts as error.
    where : str
        The function and the argument of that.
    off : float
        The largest difference from this machine's results, in parts of twice the stated rounding error.
    wrong : int
        Wrong results for special arguments.
    plain, differ_plain, differ : int
        Results without libm, how many of them differ in a bit from this machine's, and how many of all.
    reason : str
        Why there are none, if so.
    """

    target: Processor
    build: Build
    header: str
    results: int = 0
    part: float = 0.0
    where: str = ""
    off: float = 0.0
    wrong: int = 0
    plain: int = 0
    differ_plain: int = 0
    differ: int = 0
    reason: str = ""


def held_to_bounds(
    made: BuildResult, target: Processor, header: str, limits: Sequence[Limits], first: BuildResult | None
) -> HeaderRun:
    """Hold results to what is stated, and compare them with those of this machine."""
    found = HeaderRun(target, made.build, header, reason=made.reason)
    for i, (limit, result) in enumerate(zip(limits, made.results, strict=bool(made.results))):
        other = first.results[i] if first is not None and first.results else result
        found = _with(found, limit, result, other[: len(result)])
    return found


def _with(found: HeaderRun, limit: Limits, result: Array, other: Array) -> HeaderRun:
    special = len(ANSWERS[limit.function.kind])
    number = len(result) - special
    values, answers = result[:number], np.array(ANSWERS[limit.function.kind], dtype=result.dtype)
    part = _part(values, limit.truth[:number], limit.unknown[:number], limit.allowed[:number])
    off = _part(values, other[:number].astype(np.longdouble), 0.0, 2 * limit.rounding[:number])
    worst = int(part.argmax())
    wrong = ~((result[number:] == answers) | (np.isnan(result[number:]) & np.isnan(answers)))
    differ = (values != other[:number]) & ~(np.isnan(values) & np.isnan(other[:number]))
    if part[worst] > found.part:
        f = limit.function
        s, many = "f" if f.form == "float" else "", "_array" if f.arrays else ""
        x = limit.x[worst]
        found = found._replace(part=float(part[worst]), where=f"{f.kind}{many}_{f.name}{s} at {float(x):.4g}")
    plain = limit.plain[:number]
    return found._replace(
        off=max(found.off, float(off.max())),
        results=found.results + len(result),
        wrong=found.wrong + int(wrong.sum()),
        plain=found.plain + int(plain.sum()),
        differ_plain=found.differ_plain + int((differ & plain).sum()),
        differ=found.differ + int(differ.sum()),
    )


def _part(values: Array, truth: Array, unknown: Array | float, allowed: Array) -> Array:
    """Return errors in parts of what is allowed; 0 where nothing is stated, infinite for NaN."""
    with np.errstate(invalid="ignore", over="ignore"):
        part = np.where(np.isfinite(allowed), (np.abs(values - truth) + unknown) / allowed, 0)
    return np.where(np.isnan(part), np.inf, part)


QUICK = ("viscopade_full.h",)


def run_programs(
    thorough: bool, text_of: Callable[[str], str] = compilers.header, targets: Sequence[Processor] | None = None
) -> list[HeaderRun]:
    """Build and run everything, one program at a time."""
    wanted = list(present() if targets is None else targets)
    if not thorough:  # Windows takes half a minute to start
        wanted = [replace(target, builds=target.builds[:1]) for target in wanted if target.emulator != "wine"]
    headers = HEADERS if thorough else QUICK
    truth, claims = (
        ReferenceValues(arguments(NUMBER[thorough])),
        million.stated_bounds({name: text_of(name) for name in HEADERS}),
    )
    found = []
    with TemporaryDirectory(ignore_cleanup_errors=True) as directory:
        for i in track(range(len(headers)), "headers"):
            found += _header(headers[i], text_of(headers[i]), truth, claims[headers[i]], wanted, directory)
    return found


def _header(
    name: str,
    text: str,
    truth: ReferenceValues,
    claims: Sequence[StatedBounds],
    targets: Sequence[Processor],
    directory: str,
) -> list[HeaderRun]:
    """Build and run one header for all processors."""
    limits = [truth.limits(claim) for claim in claims]
    functions = [limit.function for limit in limits]
    found, first = [], None
    for target in targets:
        given = truth.points
        for flags, rules, standard in target.builds:
            build, start = Build(target.flags(flags), rules, standard), target.start(directory)
            made = compilers.make(
                target.compiler, target.compiler, build, text, functions, given, start, target.order, SECONDS
            )
            first = first or made
            found.append(held_to_bounds(made, target, name, limits, first))
            given = truth.few
    return found


# --- the case ---------------------------------------------------------------------------------------------------------

_NOT_RUN = f"Not run: it needs gcc and a long double of 64 bits. Debian: {INSTALL}"
NOTHING = Chart("Nothing was run", "row", "error / stated bound", (curve("stated bound", (1, 2), (1, 1), "bound"),))


def outcome(found: Sequence[HeaderRun]) -> Outcome:
    """Return what is found."""
    here = [one for one in found if not missing(one)]
    ran = [one for one in here if not one.reason]
    same = [one for one in ran if one.build.rules == "bits"]
    largest = max((one.part for one in ran), default=0.0)
    off = max((one.off for one in ran), default=0.0)
    plain = "results without libm that differ in any bit from this machine's, where each operation is rounded once"
    checks = (
        Check.never("headers that a compiler refuses or warns of, over all builds", len(here) - len(ran)),
        Check.within("largest error relative to the stated bound, on all processors", largest),
        Check.within("largest difference from this machine's results, relative to twice the stated round-off", off),
        Check.never("wrong results for 0, infinite and negative arguments and NaN", sum(one.wrong for one in ran)),
        Check.never(plain, sum(one.differ_plain for one in same)),
    )
    if not ran:
        return Outcome(_NOT_RUN, (), (NOTHING,), checks)
    return Outcome(_summary(ran), (_error_table(here), _bits(ran)), _charts(ran), checks)


def missing(one: HeaderRun) -> bool:
    """Whether a compiler lacks a flag or a library: that says nothing about the header."""
    return compilers.missing(BuildResult(one.target.compiler, one.build, (), (), one.reason))


def _summary(ran: Sequence[HeaderRun]) -> str:
    places = len({one.target.name for one in ran})
    worst = max(ran, key=lambda one: one.part)
    lacking = [f"{target.name} ({target.missing()})" for target in TARGETS if target.missing()]
    off = max(ran, key=lambda one: one.off)
    text = (
        f"{sum(one.results for one in ran):,} results of {len(ran)} programs, for {places} combinations of processor, "
        f"C library and compiler; builds after the first of a combination get {1 / FRACTION:.0%} of the arguments. The "
        f"largest error is {_share(worst.part)} of what its header states ({worst.where}; {worst.target.name}); the "
        f"uncertainty of the truth counts as error. In type float viscopade_full.h states hardly more than the half "
        f"ulp of rounding, so its largest errors are always close to that. The largest difference from this machine's "
        f"results is {_share(off.off)} of twice the stated rounding error ({off.target.name}, {off.header}); where "
        f"half an ulp is stated, one ulp is twice that. The headers' proofs do not hold for the x87 unit, which rounds "
        f"twice: there the bounds are only sampled."
    )
    return text + (f" Missing here, and left out: {', '.join(lacking)}. Debian: {INSTALL}" if lacking else "")


def _share(number: float) -> str:
    """Return a share cut off after some digits, so that one below 1 never reads as 1."""
    return f"{math.floor(number * 1e6) / 1e6:.6f}" if math.isfinite(number) else str(number)


def _label(target: Processor, build: Build) -> str:
    flags = " ".join(flag for flag in build.flags if flag != "-static")
    return f"{target.name}: -std={build.standard} {flags}"


def _short(header: str) -> str:
    return header.removeprefix("viscopade_").removesuffix(".h").replace("_", " ")


def _builds(found: Sequence[HeaderRun]) -> dict[str, list[HeaderRun]]:
    builds: dict[str, list[HeaderRun]] = {}
    for one in found:
        builds.setdefault(_label(one.target, one.build), []).append(one)
    return builds


def _error_table(found: Sequence[HeaderRun]) -> ResultTable:
    headers = list(dict.fromkeys(one.header for one in found))
    rows: list[tuple[Cell, ...]] = []
    for label, ones in _builds(found).items():
        by_header = {one.header: one for one in ones}
        rows.append((label, *(_cell(by_header[header]) for header in headers)))
    return ResultTable(
        "Largest error / stated bound, by header", ("processor and flags", *map(_short, headers)), tuple(rows)
    )


def _cell(one: HeaderRun) -> str:
    if one.reason:
        return "not known here" if missing(one) else one.reason[:60]
    return _share(one.part)


def _bits(ran: Sequence[HeaderRun]) -> ResultTable:
    rows: list[tuple[Cell, ...]] = []
    for label, ones in _builds(ran).items():
        off = _share(max(one.off for one in ones))
        rows.append((label, off, *_by_libm(ones), *_without_libm(ones)))
    compared = "largest difference / twice the stated rounding"
    header = ("processor and flags", compared, "results by libm", "differ", "without libm", "differ")
    title = "Results compared with this machine's: how far they are off, and how many differ in any bit"
    return ResultTable(title, header, tuple(rows))


def _charts(ran: Sequence[HeaderRun]) -> tuple[Chart, ...]:
    builds = list(_builds(ran).values())
    rows = range(1, len(builds) + 1)
    differ = [
        curve(name, rows, [100 * number / max(1, of) for of, number in map(count, builds)], "points")
        for name, count in (("by libm", _by_libm), ("without libm", _without_libm))
    ]
    row = "processor and flags (row of the table)"
    return (
        Chart("Largest error of each header", row, "error / stated bound",
              _by_group(builds, lambda one: one.part), "linear", "linear"),
        Chart("Difference from this machine's results", row, "difference / twice the stated rounding",
              _by_group(builds, lambda one: one.off), "linear", "linear"),
        Chart("Results that differ in a bit", row, "per cent", tuple(differ), "linear", "linear"),
    )  # fmt: skip


def _by_group(builds: Sequence[Sequence[HeaderRun]], measured: Callable[[HeaderRun], float]) -> tuple[ChartCurve, ...]:
    """Return the points of each group of headers over the builds, and the limit."""
    points = [(_group(one.header), i, measured(one)) for i, ones in enumerate(builds, 1) for one in ones]
    curves = []
    for name in dict.fromkeys(group for group, _, _ in points):
        mine = [(i, y) for group, i, y in points if group == name]
        curves.append(curve(name, [i for i, _ in mine], [y for _, y in mine], "points"))
    return (*curves, curve("limit", (1, max(2, len(builds))), (1, 1), look="bound"))


def _group(header: str) -> str:
    return "from the speed" if "speed" in header else "full accuracy" if "full" in header else "quotients"


def _without_libm(ones: Sequence[HeaderRun]) -> tuple[int, int]:
    """Return how many results need no libm, and how many of them differ."""
    return sum(one.plain for one in ones), sum(one.differ_plain for one in ones)


def _by_libm(ones: Sequence[HeaderRun]) -> tuple[int, int]:
    """Return the same of those that may need libm."""
    plain, differ_plain = _without_libm(ones)
    return sum(one.results for one in ones) - plain, sum(one.differ for one in ones) - differ_plain


def check(thorough: bool) -> Outcome:
    """Build for every processor whose compiler and emulator are there."""
    return outcome(run_programs(thorough) if million.enough() else [])


CASE = Case(
    "processors",
    "Exported headers on other processors",
    "Does another processor, byte order, C library or compiler make the error of an exported header exceed its "
    "stated bound?",
    check,
)
