"""Hard case: the exported headers in all four rounding modes, for which nothing but rounding to nearest is proven.

Every function with a stated error is called at the same arguments to nearest, toward zero, upward and downward, with
and without FMA contraction. Its errors are shown as parts of the bound that is proven to nearest. In the other modes an
operation is off by up to a unit in the last place instead of half of one: that doubles the bound of rounding, to first
order, if the library's functions are as accurate in these modes. The results are held to the formula's bound and twice
that of rounding.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from dataclasses import dataclass, fields
from typing import NamedTuple

import numpy as np

from viscopade.kernels.toolchain import ToolchainError
from viscopade.progress import track
from viscopade_lab.hard_cases import compilers, million, processors
from viscopade_lab.hard_cases.compilers import HEADERS, Build, HeaderFunction, tools
from viscopade_lab.hard_cases.finding import Case, Cell, Chart, Check, Outcome, ResultTable, curve
from viscopade_lab.hard_cases.machine import Array
from viscopade_lab.hard_cases.processors import ANSWERS, NOTHING, Limits, ReferenceValues

MODES = {
    "to nearest": "FE_TONEAREST",
    "toward zero": "FE_TOWARDZERO",
    "upward": "FE_UPWARD",
    "downward": "FE_DOWNWARD",
}
NEAREST = next(iter(MODES))
BUILDS = {
    "separate": Build(("-O2", "-frounding-math", "-ffp-contract=off"), "bits", "c99"),
    "FMA": Build(("-O2", "-frounding-math", "-march=native", "-ffp-contract=fast"), "contracted", "gnu17"),
}
COMPILER = "gcc"  # with -frounding-math; for clang this is an experiment
NUMBER = {True: 200_000, False: 2000}
"""Arguments of each type, by thoroughness."""
QUICK = ("viscopade_half_line.h", "viscopade_full.h")
SECONDS = 900
_NOT_RUN = f"Not run: it needs {COMPILER} and a long double of 64 bits"


@dataclass(frozen=True)
class FunctionInMode(HeaderFunction):
    """A function of a header, called in a rounding mode."""

    mode: str = NEAREST

    @property
    def call(self) -> str:
        """The loop over all its arguments, in C."""
        return f"fesetround({MODES[self.mode]}); {super().call} fesetround(FE_TONEAREST);"


class ModeError(NamedTuple):
    """The largest errors of a kernel in a type, a mode and a build.

    Attributes
    ----------
    kernel, form, mode, build : str
    part : float
        Relative to the bound proven to nearest, where results are normal numbers.
    doubled : float
        Relative to the same bound with twice the part that is due to rounding.
    moved : float
        The largest difference from the result to nearest, relative to the bound of rounding, likewise.
    wrong : int
        Wrong results for 0, infinite, negative arguments and NaN; but to nearest, a neighbour of the number is right.
    """

    kernel: str
    form: str
    mode: str
    build: str
    part: float
    doubled: float
    moved: float
    wrong: int


def measured(thorough: bool, text_of: Callable[[str], str] = compilers.header) -> list[ModeError]:
    """Build and run everything; errors by kernel, type, mode and build.

    Raises
    ------
    ToolchainError
        If the compiler refuses a header.
    """
    headers = HEADERS if thorough else QUICK
    truth = ReferenceValues(processors.arguments(NUMBER[thorough]))
    claims = million.stated_bounds({name: text_of(name) for name in HEADERS})
    jobs = [(name, build) for name in headers for build in BUILDS]
    found: list[ModeError] = []
    for i in track(range(len(jobs)), "rounding modes"):
        name, build = jobs[i]
        limits = [truth.limits(claim) for claim in claims[name]]
        found += _in_all_modes(text_of(name), limits, truth, build)
    return found


def _in_all_modes(text: str, limits: Sequence[Limits], truth: ReferenceValues, build: str) -> list[ModeError]:
    functions = [_in_mode(limit.function, mode) for limit in limits for mode in MODES]
    text = f"#include <fenv.h>\n{text}"
    made = compilers.make(
        COMPILER, COMPILER, BUILDS[build], text, functions, truth.points, limit=SECONDS
    )  # one program for all modes
    if made.reason:
        raise ToolchainError(f"{COMPILER} {BUILDS[build].label}: {made.reason}")
    by_kernel: dict[tuple[str, str, str], list[ModeError]] = {}
    for i, limit in enumerate(limits):
        results = made.results[len(MODES) * i : len(MODES) * (i + 1)]
        for mode, result in zip(MODES, results, strict=True):
            one = _error(limit, mode, build, result, results[0])
            by_kernel.setdefault((one.kernel, one.form, one.mode), []).append(one)
    return [_largest(group) for group in by_kernel.values()]


def _in_mode(function: HeaderFunction, mode: str) -> FunctionInMode:
    given = {field.name: getattr(function, field.name) for field in fields(HeaderFunction)}
    return FunctionInMode(**given, mode=mode)


def _error(limit: Limits, mode: str, build: str, result: Array, nearest: Array) -> ModeError:
    function, answers = limit.function, np.array(ANSWERS[limit.function.kind])
    values, specials = result[: -len(answers)], result[-len(answers) :]
    error = np.abs(values - limit.truth) + limit.unknown
    moved = np.abs(values.astype(np.longdouble) - nearest[: len(values)])
    with np.errstate(invalid="ignore"):
        beside = np.abs(specials - answers) <= np.spacing(answers.astype(result.dtype))
    right = (specials == answers) | (np.isnan(specials) & np.isnan(answers)) | (beside & (mode != NEAREST))
    normal = np.abs(limit.truth) >= np.finfo(result.dtype).tiny
    return ModeError(
        function.name, function.form, mode, build,
        _part(error, limit.allowed, normal), _part(error, limit.allowed + limit.rounding),
        _part(moved, limit.rounding, normal),
        int((~right).sum()),
    )  # fmt: skip


def _part(error: Array, allowed: Array, among: Array | bool = True) -> float:
    """Return the largest error in parts of what is allowed, where something is stated; infinite for NaN."""
    stated = np.isfinite(allowed) & among
    part = error[stated] / allowed[stated]
    return float(np.where(np.isnan(part), np.inf, part).max())


def _largest(group: Sequence[ModeError]) -> ModeError:
    worst = {name: max(getattr(one, name) for one in group) for name in ("part", "doubled", "moved")}
    return group[0]._replace(**worst, wrong=sum(one.wrong for one in group))


# --- the case ---------------------------------------------------------------------------------------------------------


def outcome(found: Sequence[ModeError]) -> Outcome:
    """Return what is found."""
    nearest = [one.part for one in found if one.mode == NEAREST]
    others = [one.doubled for one in found if one.mode != NEAREST]
    checks = (
        Check.within("to nearest: largest error relative to the proven bound", max(nearest, default=0.0)),
        Check.within(
            "in the other modes: largest error relative to the formula's bound and twice that of rounding",
            max(others, default=0.0),
        ),
        Check.never(
            "wrong results for 0, infinite and negative arguments and NaN (in the other modes, a neighbour of the "
            "number is right)",
            sum(one.wrong for one in found),
        ),
    )
    if not found:
        return Outcome(_NOT_RUN, (), (NOTHING,), checks)
    return Outcome(_summary(found), _tables(found), (_chart(found),), checks)


def _summary(found: Sequence[ModeError]) -> str:
    sizes = {mode: max(one.part for one in found if one.mode == mode) for mode in MODES}
    worst = max((one for one in found if one.mode != NEAREST), key=lambda one: one.part)
    moved = max((one for one in found if one.mode != NEAREST), key=lambda one: one.moved)
    kernels = len({(one.kernel, one.form) for one in found})
    by_mode = ", ".join(f"{_cut(size)} {mode}" for mode, size in sizes.items())
    return (
        f"The bounds in the headers are proven for rounding to nearest. Largest error found relative to them, over "
        f"{kernels} kernels and types: {by_mode}. The largest "
        f"is that of {worst.kernel} in type {worst.form} ({worst.mode}, {worst.build}). The mode moves a result by at "
        f"most {_cut(moved.moved)} of the bound of rounding ({moved.kernel}, type {moved.form}). Kernels whose formula "
        "has the larger part of the bound hardly feel the mode."
    )


def _tables(found: Sequence[ModeError]) -> tuple[ResultTable, ...]:
    return tuple(
        ResultTable(title, ("kernel", "type", *(f"{mode}, {build}" for mode in MODES for build in BUILDS)), rows)
        for title, rows in (
            ("Largest error / bound proven to nearest", _rows(found, "part")),
            ("Largest difference from the result to nearest / bound of rounding", _rows(found, "moved")),
        )
    )


def _cut(number: float) -> str:
    """Return a number cut off after some digits, so that one below 1 never reads as 1."""
    return f"{math.floor(number * 1e3) / 1e3:.3f}" if math.isfinite(number) else str(number)


def _rows(found: Sequence[ModeError], column: str) -> tuple[tuple[Cell, ...], ...]:
    by_place = {one[:4]: getattr(one, column) for one in found}
    kernels = dict.fromkeys((one.kernel, one.form) for one in found)
    return tuple(
        (*kernel, *(_cut(by_place[(*kernel, mode, build)]) for mode in MODES for build in BUILDS)) for kernel in kernels
    )


def _chart(found: Sequence[ModeError]) -> Chart:
    kernels = list(dict.fromkeys((one.kernel, one.form) for one in found))
    at = range(1, len(kernels) + 1)
    curves = [
        curve(
            mode,
            at,
            [max(o.part for o in found if (*o[:2], o.mode) == (*kernel, mode)) for kernel in kernels],
            "points",
        )
        for mode in MODES
    ]
    bound = curve("proven to nearest", (1, max(2, len(kernels))), (1, 1), "bound")
    x_label, y_label = "kernel and type (row of the table)", "error / bound proven to nearest"
    return Chart("Largest errors in four rounding modes", x_label, y_label, (*curves, bound), "linear", "linear")


def check(thorough: bool) -> Outcome:
    """Measure in all modes, if there is a compiler."""
    return outcome(measured(thorough) if million.enough() and COMPILER in tools(False) else [])


CASE = Case(
    "rounding-modes",
    "Exported headers in other rounding modes",
    "How far does rounding toward zero, upward or downward move the results of the exported headers, whose bounds are "
    "proven for rounding to nearest?",
    check,
)
