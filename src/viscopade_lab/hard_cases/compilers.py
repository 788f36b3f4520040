"""Hard case: the exported headers through every compiler that is there, with flags that people use and should not.

A program of all headers is compiled with each compiler, language standard and set of flags, and run at speeds for which
the exact function is known. What is proven of each kernel, which its header states, is what its results are held to.
With -ffast-math a compiler may break the rules of IEEE 754, which the bounds rest on: there a few units in the last
place more are allowed, and what comes of NaN and of negative numbers is only told.
"""

from __future__ import annotations

import random
import re
import shutil
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from functools import lru_cache
from itertools import pairwise
from pathlib import Path
from typing import Any, Literal, NamedTuple, Protocol

import numpy as np
import numpy.typing as npt
from mpmath import mpf

from viscopade.arithmetic.balls import to_mpf
from viscopade.arithmetic.decimals import at_most
from viscopade.collision import exact
from viscopade.kernels import requests, toolchain
from viscopade.kernels.targets.language import START, Runner
from viscopade.kernels.toolchain import ToolchainError
from viscopade.progress import track
from viscopade.scene.runners import INPUT, OUTPUT, Tool, run_driver
from viscopade_lab import proven
from viscopade_lab.hard_cases.finding import Case, Cell, Chart, ChartCurve, Check, Outcome, ResultTable, curve

Rules = Literal["bits", "contracted", "extended", "fast"]
Array = npt.NDArray[Any]
Form = Literal["double", "float"]

EXPORTS = Path(__file__).parents[3] / "exports"  # of a source tree; elsewhere the headers are made
HEADERS = tuple(name for name in requests.NAMES if name.endswith(".h") and name != requests.VERSION_HEADER)
FEW = ("viscopade_pade.h", "viscopade_half_line.h", "viscopade_full.h", "viscopade_speed_1em3.h")
DECIMAL = ("viscopade_pade.h", "viscopade_minimax.h", "viscopade_half_line.h", "viscopade_inverse.h")
"""Those that are also C++ before C++17, which has no hexadecimal constants."""
WARNINGS = ("-Wall", "-Wextra", "-Wpedantic", "-Werror")
FAST_ULPS = 4.0
"""What -ffast-math may add, in units in the last place: a product by a reciprocal instead of a quotient (1 more), the
sums of a compensation done in another order (1), and the estimates of reciprocals, refined once (2)."""

TYPES: Mapping[Form, type[np.floating[Any]]] = {"double": np.float64, "float": np.float32}
_FUNCTION = re.compile(
    r"^static inline (double|float) viscopade_(epsilon|one_minus_epsilon|v_star|restitution)_"
    r"((?:pade|minimax|halfline|inverse|full|lookup)\w*?)f?\((?:double|float) \w+(?:, (?:double|float) beta)?\)$",
    re.MULTILINE,
)
_OVER = {
    **dict.fromkeys(("v_star", "v_star_from_loss"), "epsilon"),
    **dict.fromkeys(("restitution", "rebound", "dissipation"), "speed"),
}
_SEED = 9


# --- what is compiled, and how ----------------------------------------------------------------------------------------


@dataclass(frozen=True)
class Build:
    """Flags, and what results they must give: the same bits, the proven bounds, or those and a few ulp."""

    flags: tuple[str, ...]
    rules: Rules
    standard: str = "c99"
    headers: tuple[str, ...] = FEW

    @property
    def label(self) -> str:
        """What stands in the table."""
        words = " ".join((f"-std={self.standard}", *self.flags))
        return words + {HEADERS: ", all headers", DECIMAL: ", headers without tables"}.get(self.headers, "")


class BuildResult(NamedTuple):
    """What a compiler made of the headers: results by function, or why there are none."""

    compiler: str
    build: Build
    functions: tuple[HeaderFunction, ...]
    results: tuple[Array, ...]
    reason: str


_PLAIN = (("-O0",), ("-O2",), ("-O3",), ("-Os",), ("-O2", "-fno-builtin"), ("-O3", "-ffp-contract=off"))
_NATIVE = ("-O3", "-march=native")
_FLAGS: tuple[tuple[tuple[str, ...], Rules], ...] = (
    *((flags, "bits") for flags in _PLAIN),
    (_NATIVE, "contracted"),
    ((*_NATIVE, "-ffp-contract=fast"), "contracted"),
    (("-O2", "-ffast-math"), "fast"),
    (("-O3", "-ffast-math"), "fast"),
    ((*_NATIVE, "-ffast-math"), "fast"),
)
_C, _CPP = ("c99", "c11", "c17", "c2x"), ("gnu++11", "gnu++14", "c++17", "c++20")
_FEW_FLAGS: tuple[tuple[tuple[str, ...], Rules], ...] = ((("-O2",), "bits"), ((*_NATIVE, "-ffast-math"), "fast"))


def builds(thorough: bool, cpp: bool) -> list[Build]:
    """Return what is built with a compiler: few headers with all flags and standards, and all with some flags."""
    first = "c++17" if cpp else "c99"
    wanted = [Build(flags, rules, first, FEW) for flags, rules in (_FLAGS if thorough else _FEW_FLAGS)]
    if not thorough:
        return wanted
    wanted += [Build(("-O2",), "bits", standard, FEW) for standard in (_CPP if cpp else _C) if standard != first]
    if cpp:
        wanted += [Build(("-O2",), "bits", standard, DECIMAL) for standard in ("c++11", "c++14")]
    else:
        wanted.append(Build(("-O2", "-m32", "-msse2", "-mfpmath=sse"), "bits", first, FEW))
        wanted += [Build(flags, rules, first, HEADERS) for flags, rules in _FEW_FLAGS]
    return wanted


def tools(thorough: bool) -> dict[str, tuple[str, bool]]:
    """Return the compilers that are there, by name: the command, and whether it is one of C++."""
    names = {"gcc": False, "clang": False, "tcc": False} | ({"g++": True, "clang++": True} if thorough else {})
    return {name: (path, cpp) for name, cpp in names.items() if (path := shutil.which(name)) is not None}


def header(name: str) -> str:
    """Return an exported header as it lies in a source tree, or made anew."""
    try:
        return toolchain.read_from(EXPORTS, name)
    except ValueError:
        return requests.file(name)


# --- functions and what is stated of them -----------------------------------------------------------------------------


@dataclass(frozen=True)
class StatedError:
    """What is proven of a function's error, and its header states.

    Attributes
    ----------
    smaller : tuple of (float, float)
        Up to which v*, and the bound relative to the smaller of eps and 1 - eps.
    value : float
        Relative to the result.
    ulps : float
        In units in the last place of the result, in its type.
    double_ulps : float
        The same of type double.
    low, high : float
        The v* for which it is stated.
    rounding : float
        Relative to the smaller of eps and 1 - eps: what rounding adds to the bounds of the formula in `smaller`.
    formula : float
        Relative to the result: the bound of the formula, to which rounding adds `value`.
    """

    smaller: tuple[tuple[float, float], ...] = ()
    value: float = 0.0
    ulps: float = 0.0
    double_ulps: float = 0.0
    low: float = 0.0
    high: float = float("inf")
    rounding: float = 0.0
    formula: float = 0.0


@dataclass(frozen=True)
class HeaderFunction:
    """A function of a header: of v*, of eps, or of the speed at beta = 1."""

    name: str
    kind: str
    form: Form
    stated: StatedError
    arrays: bool = False

    @property
    def over(self) -> str:
        """What it is a function of."""
        return _OVER.get(self.kind, "v_star")

    @property
    def call(self) -> str:
        """The loop over all its arguments, in C."""
        s = "f" if self.form == "float" else ""
        n, x = f"n_{self.over}{s}", f"{self.over}{s}"
        if self.arrays:
            return f"viscopade_{self.kind}_array_{self.name}{s}({n}, {x}, 1.0{s}, out{s});"
        beta = f", 1.0{s}" if self.over == "speed" else ""
        return f"for (i = 0; i < {n}; ++i) {{ out{s}[i] = viscopade_{self.kind}_{self.name}{s}({x}[i]{beta}); }}"


def header_functions(texts: Mapping[str, str]) -> list[HeaderFunction]:
    """Return the functions of some headers whose errors are proven; each once."""
    found: dict[tuple[str, ...], HeaderFunction] = {}
    for text in texts.values():
        for form, kind, name in _FUNCTION.findall(text):
            if kind == "restitution" and not name.startswith("lookup"):
                continue  # that of v*, but for pow
            for arrays in (False, True) if kind == "restitution" else (False,):
                key = form, kind, name, "array" if arrays else ""
                if key not in found:
                    found[key] = HeaderFunction(name, kind, form, stated_error(kind, name, form), arrays)
    return list(found.values())


def stated_error(kind: str, name: str, form: Form) -> StatedError:
    """Return what is proven of a function.

    Raises
    ------
    KeyError
        If nothing is.
    """
    found = proven.of(name, form)
    if name == "full":
        return StatedError(ulps=found.number(f"ulps of {kind}"))
    if name.startswith("lookup"):
        return _of_speed_table(name, form)
    rounding = found.number(f"rounding of {kind}")
    if name.startswith("inverse"):
        return StatedError(value=rounding, formula=found.number("formula"))
    if name.startswith("halfline"):
        return StatedError(((float("inf"), found.number("formula")),), rounding)
    return StatedError(found.up_to, rounding, high=max(end for end, _ in found.up_to))


def _of_speed_table(name: str, form: Form) -> StatedError:
    double, found = proven.of(name, "double"), proven.of(name, form)
    low, high = double.number("low"), double.number("high")
    # A result of type double is within half an ulp of type float once converted, but for its own error: 1e-4 of that.
    own, doubles = (1.0, 0.0) if found and form == "float" else (0.0, 1.0) if found else (0.5001, 1.0)
    if double.has("ulps"):
        ulps = double.number("ulps") + double.number("ulps of w")
        return StatedError(ulps=own * ulps if found else own, double_ulps=doubles * ulps, low=low, high=high)
    numbers = found or double
    smaller = ((float("inf"), numbers.number("formula")),)
    halves = own / 2 if found else own
    rounding = numbers.number("rounding")
    return StatedError(smaller, ulps=halves, double_ulps=doubles / 2, rounding=rounding, low=low, high=high)


# --- arguments and the truth ------------------------------------------------------------------------------------------

OVER = ("v_star", "speed", "epsilon")
"""What functions are functions of."""


def special(over: str, form: Form) -> Array:
    """Return arguments whose results are known without computing, two subnormal numbers of the type among them."""
    kind = TYPES[form]
    tiny, inf, nan = np.finfo(kind).smallest_subnormal, float("inf"), float("nan")
    if over == "epsilon":
        return np.array([1.0, 0.0, -0.0, -1.0, 2.0, inf, -inf, nan], dtype=kind)
    return np.array([0.0, -0.0, tiny, tiny * 2**19, inf, -1.0, -tiny, -inf, nan], dtype=kind)


_ANSWERS = {
    "epsilon": (1.0, 1.0, 1.0, 1.0, 0.0, *[float("nan")] * 4),
    "restitution": (1.0, 1.0, 1.0, 1.0, 0.0, *[float("nan")] * 4),
    "one_minus_epsilon": (0.0, 0.0, 0.0, 0.0, 1.0, *[float("nan")] * 4),
    "v_star": (0.0, *[float("nan")] * 7),
}


class DoubleDoubleValues(NamedTuple):
    """Exact values, each as the sum of two doubles."""

    v_star: Array
    high: Array
    low: Array
    smaller: Array


class Given(Protocol):
    """Arguments of functions."""

    def given(self, over: str, form: Form) -> Array:
        """Return arguments in a type."""


@dataclass(frozen=True)
class TestVectors:
    """Arguments, numbers of type float, and what is exact there, by kind of function."""

    arguments: Mapping[str, Array]
    truth: Mapping[str, DoubleDoubleValues]

    def given(self, over: str, form: Form) -> Array:
        """Return arguments in a type, with the special ones."""
        return np.concatenate([self.arguments[over].astype(TYPES[form]), special(over, form)])


@lru_cache(maxsize=2)
def reference_points(thorough: bool) -> TestVectors:
    """Return arguments over all the range of type float, most of them where eps is neither 0 nor 1."""
    generator = random.Random(_SEED)
    number = 120 if thorough else 20
    v_star = _floats(
        [*(10 ** generator.uniform(-2.2, 0.95) for _ in range(number)), 1e-30, 1e-12, 1e-5, 30.0, 1e4, 1e9]
    )
    speed = _floats(10 ** generator.uniform(-18, 9) for _ in range(number))
    epsilon = _floats(generator.uniform(0.001, 1) for _ in range(number // 2))
    at_v = [exact.collision(v_star=float(v), digits=40) for v in v_star]
    at_speed = [exact.collision(beta=1, speed=float(v), digits=40) for v in speed]
    at_epsilon = [exact.invert(epsilon=float(e), digits=40) for e in epsilon]
    arguments = {"v_star": v_star, "speed": speed, "epsilon": epsilon}
    kinds = {"epsilon": at_v, "one_minus_epsilon": at_v, "restitution": at_speed, "v_star": at_epsilon}
    truth = {kind: _truth(found, "epsilon" if kind == "restitution" else kind) for kind, found in kinds.items()}
    return TestVectors(arguments, truth)


def _floats(values: Any) -> Array:
    return np.array(list(values), dtype=np.float32).astype(np.float64)


def _truth(found: Sequence[exact.Collision], name: str) -> DoubleDoubleValues:
    values: list[mpf] = [to_mpf(getattr(collision, name)) for collision in found]
    high = np.array([float(value) for value in values])
    low = np.array([float(value - mpf(float(value))) for value in values])
    smaller = np.array([min(float(to_mpf(c.epsilon)), float(to_mpf(c.one_minus_epsilon))) for c in found])
    return DoubleDoubleValues(np.array([float(to_mpf(c.v_star)) for c in found]), high, low, smaller)


# --- building and running ---------------------------------------------------------------------------------------------

_DRIVER = """
#include <stdio.h>
#include "headers.h"

{arrays}
int main(void)
{{
    size_t i, done = 0;
    FILE *in = fopen("{input}", "rb"), *to = fopen("{output}", "wb");

    if (in == NULL || to == NULL) {{
        return 1;
    }}
{reads}
{calls}
    fclose(in);
    return fclose(to) != 0 || done != {pieces};
}}
"""


def driver(wanted: Sequence[HeaderFunction], given: Given) -> str:
    """Return the program that calls all functions: from numbers to numbers."""
    arrays, reads, calls = [], [], []
    for over in OVER:
        for form, s in (("double", ""), ("float", "f")):
            size = len(given.given(over, "double"))
            arrays.append(f"#define n_{over}{s} {size}\nstatic {form} {over}{s}[{size}];")
            reads.append(f"    done += fread({over}{s}, sizeof {over}{s}, 1, in);")
    most = max(len(given.given(over, "double")) for over in OVER)
    arrays += [f"static double out[{most}];", f"static float outf[{most}];"]
    for function in wanted:
        s = "f" if function.form == "float" else ""
        calls.append(f"    {function.call}")
        calls.append(f"    done += fwrite(out{s}, sizeof *out{s} * n_{function.over}{s}, 1, to);")
    return _DRIVER.format(
        input=INPUT, output=OUTPUT, arrays="\n".join(arrays), reads="\n".join(reads), calls="\n".join(calls),
        pieces=len(reads) + len(wanted),
    )  # fmt: skip


def make(
    name: str,
    command: str,
    build: Build,
    text: str,
    wanted: Sequence[HeaderFunction],
    given: Given,
    start: Sequence[str] = (),
    order: Literal["=", "<", ">"] = "=",
    limit: int = 300,
) -> BuildResult:
    """Compile headers and run them.

    `start` is the command of an emulator, and `order` is the byte order of the processor that it emulates;
    compiling, and then running, may take `limit` seconds.
    """
    ending = ".cpp" if "++" in build.standard else ".c"
    # Tables are written in hexadecimal, which C++ has from C++17 on and GNU's C++ before; it says so if pedantic.
    warnings = [w for w in WARNINGS if w != "-Wpedantic" or not build.standard.startswith("gnu++")]
    if "clang" in name:  # it also warns where a loop becomes no vector instructions, which changes no result
        warnings.append("-Wno-pass-failed")
    words = ("{tool}", f"-std={build.standard}", *warnings, *build.flags, "{driver}", "-o", "{program}", "-lm")
    runner = Runner((name,), ending, words, (*start, *START))
    types = {form: np.dtype(kind).newbyteorder(order) for form, kind in TYPES.items()}
    numbers = b"".join(given.given(over, form).astype(types[form]).tobytes() for over in OVER for form in TYPES)
    sizes = [given.given(f.over, f.form).nbytes for f in wanted]
    file, size = ("headers.h", text), sum(sizes)
    try:
        code = run_driver(runner, Tool((command,), ""), driver(wanted, given), file, numbers, size, limit)
    except ToolchainError as error:
        return BuildResult(name, build, tuple(wanted), (), str(error))
    ends = np.cumsum([0, *sizes])
    pieces = [code[first:last] for first, last in pairwise(ends)]
    results = tuple(
        np.frombuffer(piece, dtype=types[f.form]).astype(TYPES[f.form]) for piece, f in zip(pieces, wanted, strict=True)
    )
    return BuildResult(name, build, tuple(wanted), results, "")


# --- judging ----------------------------------------------------------------------------------------------------------


class BuildErrors(NamedTuple):
    """The largest errors of a build: in parts of what is stated, and beyond that in ulp; and wrong special results."""

    part: float
    excess: float
    wrong: int
    refused: int


def errors(given: TestVectors, made: BuildResult) -> BuildErrors:
    """Compare all results with the truth and with what the headers state."""
    each = [_errors(f, given, r, made.build.rules) for f, r in zip(made.functions, made.results, strict=True)]
    worst = [max(values) for values in zip(*((e.part, e.excess) for e in each), strict=True)]
    return BuildErrors(worst[0], worst[1], sum(e.wrong for e in each), sum(e.refused for e in each))


def _errors(function: HeaderFunction, given: TestVectors, result: Array, rules: Rules) -> BuildErrors:
    truth, at = given.truth[function.kind], len(given.arguments[function.over])
    values = result[:at].astype(np.float64)
    error = np.abs((values - truth.high) - truth.low)
    ulp = np.abs(np.spacing(truth.high.astype(TYPES[function.form]))).astype(np.float64)
    allowed = error_bound(function.stated, truth, ulp)
    # Subnormal results may be 0 where a compiler says so, and nothing is stated beyond a formula's interval.
    sound = (truth.high >= np.finfo(TYPES[function.form]).tiny) & np.isfinite(allowed)
    with np.errstate(divide="ignore", invalid="ignore"):
        part = np.where(sound, error / allowed, 0.0)
        excess = np.where(sound, (error - allowed) / ulp, 0.0)
    part, excess = (np.where(np.isnan(x), np.inf, x) for x in (part, excess))
    answers = np.array(_ANSWERS[function.kind])
    same = (result[at:] == answers) | (np.isnan(result[at:]) & np.isnan(answers))
    if rules == "fast":  # nothing is promised for NaN, infinite and negative arguments; 1 may be a few ulp less
        few = FAST_ULPS * np.finfo(result.dtype).eps * answers
        same |= (np.abs(result[at:] - answers) <= few) | np.isinf(special(function.over, function.form))
        same |= np.isnan(answers)
    refused = int(np.sum(np.isnan(result[at:]) & np.isnan(answers)))
    return BuildErrors(float(part.max()), max(0.0, float(excess.max())), int(np.sum(~same)), refused)


def error_bound(stated: StatedError, truth: DoubleDoubleValues, ulp: Array) -> Array:
    """Return the largest error that is stated, at each argument; infinite where nothing is."""
    relative = np.full(len(truth.v_star), 0.0 if not stated.smaller else np.inf)
    for end, share in reversed(stated.smaller):
        relative = np.where(truth.v_star <= end, share, relative)
    inside = (truth.v_star >= stated.low) & (truth.v_star < stated.high)
    units = stated.ulps * ulp + stated.double_ulps * np.spacing(truth.high)
    total = (relative + stated.rounding) * truth.smaller + (stated.formula + stated.value) * truth.high + units
    # The truth is known to 2^-105 of itself.
    return np.where(inside, total + 2.0**-100 * truth.high, np.inf)


def differing(first: BuildResult, other: BuildResult) -> int:
    """Return how many results differ from those of another build in any bit; NaN is like NaN."""
    return sum(
        int(np.sum((a != b) & ~(np.isnan(a) & np.isnan(b)))) for a, b in zip(first.results, other.results, strict=True)
    )


# --- the case ---------------------------------------------------------------------------------------------------------


def run_builds(thorough: bool, text_of: Callable[[str], str] = header) -> tuple[TestVectors, list[BuildResult]]:
    """Compile and run everything."""
    given = reference_points(thorough)
    jobs = [(name, *tool, build) for name, tool in tools(thorough).items() for build in builds(thorough, tool[1])]
    texts = {name: text_of(name) for name in dict.fromkeys(name for *_, build in jobs for name in build.headers)}
    made = []
    for i in track(range(len(jobs)), "compilers"):
        name, command, _, build = jobs[i]
        used = {header: texts[header] for header in build.headers}
        made.append(make(name, command, build, "\n".join(used.values()), header_functions(used), given))
    return given, made


_MISSING = re.compile(
    r"unrecogni[sz]ed|unknown argument|invalid value|unsupported option|cannot find|bits/|file '\w+\.o' not found|"
    "cannot be run: No such file",
    re.I,
)


def missing(made: BuildResult) -> bool:
    """Whether a compiler lacks a flag, a standard or a library of it: that says nothing about the headers."""
    return bool(made.reason) and _MISSING.search(made.reason) is not None


def outcome(given: TestVectors, made: Sequence[BuildResult]) -> Outcome:
    """Return what is found in the results."""
    here = [one for one in made if not missing(one)]
    built = [one for one in here if not one.reason]
    found = [(one, errors(given, one)) for one in built]
    strict = [(one, e) for one, e in found if one.build.rules != "fast"]
    fast = [e for one, e in found if one.build.rules == "fast"]
    first: dict[tuple[str, ...], BuildResult] = {}
    same = [one for one in built if one.build.rules == "bits"]
    bits = sum(differing(first.setdefault(one.build.headers, one), one) for one in same)
    parts = max((e.part for _, e in strict), default=0.0)
    excess = max((e.excess for e in fast), default=0.0)
    wrong, wrong_fast = sum(e.wrong for _, e in strict), sum(e.wrong for e in fast)
    checks = (
        Check.never("headers that a compiler refuses or warns of, over all builds", len(here) - len(built)),
        Check.within("largest error relative to the proven bound, without -ffast-math", parts),
        Check.never("results that differ in any bit between builds that neither fuse nor reorder", bits),
        Check.never("wrong results for 0, subnormal, infinite, negative arguments, NaN, without -ffast-math", wrong),
        Check("with -ffast-math: errors beyond the proven ones, in ulp (4 more roundings)", excess, "<=", FAST_ULPS),
        Check.never("with -ffast-math: results for 0 and subnormal numbers with a larger error than that", wrong_fast),
    )  # fmt: skip
    return Outcome(_summary(made, found), (_table(made, _by_build(found)),), (_chart(found),), checks)


def _by_build(found: Sequence[tuple[BuildResult, BuildErrors]]) -> dict[tuple[str, str], BuildErrors]:
    """Return the errors by compiler and flags."""
    return {(one.compiler, one.build.label): error for one, error in found}


def _summary(made: Sequence[BuildResult], found: Sequence[tuple[BuildResult, BuildErrors]]) -> str:
    if not found:
        return "Not run: there is no C compiler here."
    names = list(dict.fromkeys(one.compiler for one, _ in found))
    lacking, most = sum(map(missing, made)), max(len(one.functions) for one, _ in found)
    parts = max((e.part for one, e in found if one.build.rules != "fast"), default=0.0)
    text = (
        f"{len(found)} builds by {', '.join(names)}, of up to {most} functions each. Without -ffast-math the largest "
        f"error is at most {at_most(parts)} of what is proven."
    )
    if lacking:
        text += f" {lacking} builds were left out: the compiler has no such flag, standard or library."
    made_fast = [one for one, _ in found if one.build.rules == "fast"]
    fast = [e for one, e in found if one.build.rules == "fast"]
    if not fast:
        return text
    asked = sum(int(np.isnan(_ANSWERS[f.kind]).sum()) for one in made_fast for f in one.functions)
    return text + (
        " No bound is promised under -ffast-math. There, results for speeds that are numbers exceed the proven errors "
        f"by at most {at_most(max(e.excess for e in fast))} ulp. Of the results that should be NaN, "
        f"{sum(e.refused for e in fast)} of {asked} are: the compiler may remove the test for NaN, and the header then "
        "returns a number."
    )


def _table(made: Sequence[BuildResult], found: Mapping[tuple[str, str], BuildErrors]) -> ResultTable:
    header = ("compiler", "flags", "error / proven", "beyond it, ulp", "special results wrong", "NaN returned")
    rows: list[tuple[Cell, ...]] = []
    for one in made:
        error = found.get((one.compiler, one.build.label))
        if error is None:
            words = "not known here" if missing(one) else one.reason[:60]
            rows.append((one.compiler, one.build.label, words, "", "", ""))
        else:
            numbers = (f"{error.part:.3f}", f"{error.excess:.2f}", error.wrong, error.refused)
            rows.append((one.compiler, one.build.label, *numbers))
    return ResultTable(
        "Builds: the largest errors, and results for 0, infinity, negative numbers and NaN", header, tuple(rows)
    )


def _chart(found: Sequence[tuple[BuildResult, BuildErrors]]) -> Chart:
    """Return the errors of all builds. Those with -ffast-math are a group apart: the bound is not promised to them."""
    groups: dict[str, list[tuple[int, float]]] = {one.compiler: [] for one, _ in found if one.build.rules != "fast"}
    fast: list[tuple[int, float]] = []
    for i, (one, error) in enumerate(found, 1):
        (fast if one.build.rules == "fast" else groups[one.compiler]).append((i, error.part))
    curves = [_group(name, points) for name, points in groups.items()]
    curves.append(curve("proven", (1, max(2, len(found))), (1, 1), look="bound"))
    if fast:
        curves.append(_group("-ffast-math: no bound promised", fast))
    return Chart(
        "Largest error, relative to the proven bound", "build, in the order of the table", "error / proven bound",
        tuple(curves), "linear", "linear",
    )  # fmt: skip


def _group(name: str, points: Sequence[tuple[int, float]]) -> ChartCurve:
    return curve(name, [build for build, _ in points], [part for _, part in points], "points")


def check(thorough: bool) -> Outcome:
    """Build with every compiler that is there."""
    return outcome(*run_builds(thorough))


CASE = Case(
    "compilers",
    "Exported headers through compilers",
    "Does a compiler, a language standard or a flag such as -ffast-math make the error of an exported header "
    "exceed its proven bound?",
    check,
)
