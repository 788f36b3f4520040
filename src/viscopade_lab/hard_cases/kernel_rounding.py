"""Hard case: what rounding does to the exported functions at its worst, against the bounds that are proven of it.

A function is compared with the exact value of its own formula, with the same machine numbers, in ball arithmetic. The
worst argument is looked for: random ones first, then the neighbours of the worst, at distances of one to thousands of
numbers of the type. A root may be off by as much as the header allows: by how many units in the last place is looked
for, too.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass, replace
from functools import cached_property
from typing import NamedTuple

import numpy as np

from viscopade.arithmetic.balls import working
from viscopade.arithmetic.formats import DOUBLE, FLOAT, Format
from viscopade.kernels.forms.rounding_bounds import ULPS
from viscopade.kernels.forms.speed_kernel import TABLES
from viscopade.progress import track
from viscopade_lab.hard_cases import exported
from viscopade_lab.hard_cases.exported import ExportedFunction, FullFunction, unit_of
from viscopade_lab.hard_cases.finding import Case, Chart, ChartCurve, Check, Outcome, ResultTable, curve
from viscopade_lab.hard_cases.machine import Array, moved, type_of

SEED = 1911
STARTS = 6  # of the search by neighbours
STEPS = ULPS - 1  # a root that is rounded correctly, and then moved by these, is within ULPS
NEIGHBOURS = 12  # tried of each start in a round
REACH = 12  # neighbours are up to 2^REACH numbers away

AnyFunction = ExportedFunction | FullFunction


class ArithmeticVariant(NamedTuple):
    """How a function is computed."""

    name: str
    contracted: bool = False
    steps: int = 0


SEPARATE = ArithmeticVariant("each operation rounded")
FUSED = ArithmeticVariant("FMA contraction", contracted=True)
OFF = ArithmeticVariant(f"root off by up to {STEPS} ulp", steps=STEPS)
SHORT = {SEPARATE: "plain", FUSED: "fused", OFF: f"root off by {STEPS} ulp"}


@dataclass(frozen=True)
class WorstError:
    """The largest error found, in relation to the bound.

    Attributes
    ----------
    function, way : the function, and how it was computed
    x : float
    ratio : float
        Error over proven bound.
    relative, ulp : float
        The error over the exact value, and over its unit in the last place.
    """

    function: AnyFunction
    way: ArithmeticVariant
    x: float
    ratio: float
    relative: float
    ulp: float

    @cached_property
    def local(self) -> float | None:
        """The error over what is proven for this argument alone; None if nothing is."""
        function = self.function
        if not isinstance(function, ExportedFunction) or function.local is None:
            return None
        return self.relative / float(function.local(self.x))

    @property
    def roundings(self) -> float:
        """The relative error in units of u = 2^-precision, the unit roundoff."""
        return self.relative * 2.0**self.function.form.precision


class _Score(NamedTuple):
    ratio: float
    relative: float
    ulp: float


def largest_error(
    function: AnyFunction, way: ArithmeticVariant, number: int, rounds: int, generator: np.random.Generator
) -> WorstError:
    """Look for the largest error: at `number` random arguments, then by rounds of neighbours of the worst ones."""
    x = _draw(function, number, generator)
    steps = generator.integers(-way.steps, way.steps + 1, x.size)
    scores = _scores(function, way, x, steps)
    order = sorted(range(x.size), key=lambda i: scores[i].ratio, reverse=True)[:STARTS]
    found = [(scores[i], x[i], steps[i]) for i in order]
    for _ in range(rounds):
        found = [_climbed(function, way, *start, generator) for start in found]
    best, at, _ = max(found, key=lambda start: start[0].ratio)
    return WorstError(function, way, float(at), *best)


def _draw(function: AnyFunction, number: int, generator: np.random.Generator) -> Array:
    """Return arguments, half of them evenly by their logarithm, half by size; and the ends."""
    low, high = function.low, function.high
    logarithmic = np.exp(generator.uniform(np.log(low), np.log(high), number // 2))
    even = generator.uniform(low, high, number - number // 2)
    return _inside(function, np.concatenate([logarithmic, even, [low, high]]).astype(type_of(function.form)))


def _inside(function: AnyFunction, x: Array) -> Array:
    kind = type_of(function.form)
    return np.clip(x, kind(function.low), kind(function.high))


def _climbed(
    function: AnyFunction, way: ArithmeticVariant, score: _Score, x: float, steps: int, generator: np.random.Generator
) -> tuple[_Score, float, int]:
    """Return the best among an argument and its neighbours."""
    size = np.exp2(generator.uniform(0, REACH, NEIGHBOURS)).astype(np.int64)
    sign = generator.choice(np.array([-1, 1]), NEIGHBOURS)
    start = np.full(NEIGHBOURS, x, type_of(function.form))
    near = _inside(function, moved(start, sign * size))
    others = generator.integers(-way.steps, way.steps + 1, NEIGHBOURS)
    scores = _scores(function, way, near, others)
    best = max(range(NEIGHBOURS), key=lambda i: scores[i].ratio)
    return (scores[best], near[best], others[best]) if scores[best].ratio > score.ratio else (score, x, steps)


def _scores(function: AnyFunction, way: ArithmeticVariant, x: Array, steps: Array) -> list[_Score]:
    found = function.computed(x, steps, way.contracted).tolist()
    with working(exported.BITS):
        return [_score(function, at, value) for at, value in zip(x.tolist(), found, strict=True)]


def _score(function: AnyFunction, x: float, computed: float) -> _Score:
    """Compare one value; a NaN or an infinity is infinitely wrong."""
    if not np.isfinite(computed):
        return _Score(np.inf, np.inf, np.inf)
    ball = function.exact(x)
    error, exact = float(abs(ball - computed)), float(ball)
    sizes = function.allowed(exact), abs(exact), unit_of(exact, function.form)
    return _Score(*(error / size for size in sizes))


# --- the case ---------------------------------------------------------------------------------------------------------


class SearchPlan(NamedTuple):
    """What is tried: kernels, and how hard."""

    minimax: Sequence[tuple[int, int]]
    half_line: Sequence[str]
    inverse: Sequence[str]
    compact: Sequence[str]
    tables: Sequence[str]
    rows: int
    full: Sequence[tuple[Format, str]]
    full_speed: bool
    number: int
    rounds: int


QUICK = SearchPlan(exported.MINIMAX[:2], ("1e-5",), ("1e-3",), (), ("1e-3",), 4, ((DOUBLE, "epsilon"),), False, 150, 1)
THOROUGH = SearchPlan(
    exported.MINIMAX,
    tuple(exported.HALF_LINE),
    tuple(exported.INVERSE),
    tuple(exported.HALF_LINE),
    tuple(dict.fromkeys(tier for tier, _ in TABLES)),
    16,
    tuple((form, name) for form in (DOUBLE, FLOAT) for name in ("epsilon", "one_minus_epsilon")),
    True,
    2000,
    12,
)

FAMILIES = {
    "quotients of polynomials in v*": (SEPARATE, FUSED),
    "quotients in powers of a root": (SEPARATE, FUSED, OFF),
    "tables of speed": (SEPARATE, FUSED),
    "full accuracy": (SEPARATE,),
}
FAMILY = dict(zip(FAMILIES, ("polynomials", "powers of a root", "tables", "full accuracy"), strict=True))


def planned_functions(plan: SearchPlan) -> Iterator[tuple[str, AnyFunction]]:
    """Yield the functions of a plan with the names of their families."""
    polynomials, rooted, tables, accurate = FAMILIES
    for function in (*exported.of_pade(), *exported.of_minimax(plan.minimax)):
        yield polynomials, function
    roots = (exported.of_half_line, plan.half_line), (exported.of_inverse, plan.inverse)
    for of, accuracies in (*roots, (exported.of_compact, plan.compact)):
        for function in of(accuracies):
            yield rooted, function
    for function in exported.of_tables(plan.tables, plan.rows):
        yield tables, function
    for full in (*exported.of_full(plan.full), *([exported.of_full_speed()] if plan.full_speed else [])):
        yield accurate, full


def run(thorough: bool) -> Outcome:
    """Search, and compare with the bounds."""
    plan = THOROUGH if thorough else QUICK
    generator = np.random.default_rng(SEED)
    chosen = list(planned_functions(plan))
    found: dict[str, list[WorstError]] = {family: [] for family in FAMILIES}
    for i in track(range(len(chosen)), "worst rounding errors"):
        family, function = chosen[i]
        rows = plan.rows + 2 if isinstance(function, ExportedFunction) and function.kernel.startswith("table") else 1
        for way in FAMILIES[family]:
            found[family].append(largest_error(function, way, max(plan.number // rows, 20), plan.rounds, generator))
    return Outcome(_summary(found), tuple(_tables(found)), tuple(_charts(found)), tuple(_checks(found)))


def _checks(found: dict[str, list[WorstError]]) -> Iterator[Check]:
    for family, results in found.items():
        for way in FAMILIES[family]:
            most = max(w.ratio for w in results if w.way == way)
            yield Check.within(f"{family}, {way.name}: largest error found, relative to its proven bound", most)
    for family in list(FAMILIES)[:2]:
        most = max(w.local for w in found[family] if w.local is not None)
        statement = f"{family}: this error, relative to the bound that the same proof gives for its argument alone"
        yield Check.within(statement, most)
    quotients = [w for w in found["quotients of polynomials in v*"] if w.function.name == "epsilon"]
    # eps takes all values from 1 to far below 1/2: just above a power of 2 the last rounding alone errs by u.
    least = min(w.roundings for w in quotients)
    yield Check("for every quotient the search finds at least u, the round-off of the last division", least, ">=", 1)
    least = min(w.ulp for w in found["full accuracy"])
    statement = "for every function of full accuracy the search finds nearly half an ulp, its last rounding"
    yield Check(statement, least, ">=", 0.49)


Group = tuple[str, str]


def grouped(results: Sequence[WorstError]) -> dict[Group, list[WorstError]]:
    """Return the results of a kernel in a type together: those of its functions, branches, rows and ways."""
    groups: dict[Group, list[WorstError]] = {}
    for w in results:
        end = {"derivative": ", derivative", "epsilon, coefficients too": ", coefficients too"}.get(w.function.name, "")
        groups.setdefault((w.function.kernel + end, w.function.form.name), []).append(w)
    return groups


def by_way(group: Sequence[WorstError]) -> dict[ArithmeticVariant, WorstError]:
    """Return the worst result of each way."""
    ways = dict.fromkeys(w.way for w in group)
    return {way: max((w for w in group if w.way == way), key=lambda w: w.ratio) for way in ways}


def _tables(found: dict[str, list[WorstError]]) -> Iterator[ResultTable]:
    for family, results in found.items():
        ways = FAMILIES[family]
        rows = []
        for (kernel, form), group in grouped(results).items():
            best = by_way(group)
            w = max(group, key=lambda one: one.ratio)
            shown = f"{w.roundings:.2f}", f"{w.roundings / w.ratio:.2f}", f"{w.ulp:.2f}"
            ratios = (f"{best[way].ratio:.3f}" for way in ways)
            local = "" if w.local is None else f"{w.roundings / w.local:.2f}"
            function = w.function.name.removesuffix(", coefficients too")
            rows.append((kernel, form, function, SHORT[w.way], f"{w.x:.7g}", *shown, local, *ratios))
        header = (
            "kernel",
            "type",
            "function",
            "computed",
            "at x",
            "error (u)",
            "bound (u)",
            "error (ulp)",
            "bound at x (u)",
        )
        ends = tuple(f"error/bound, {SHORT[way]}" for way in ways)
        yield ResultTable(
            f"Worst errors found: {family} (u = 2^-53 in double, 2^-24 in float)", header + ends, tuple(rows)
        )


_SHOWN = (("Padé [1/4]", FLOAT), ("best [3/7]", FLOAT), ("best [3/7]", DOUBLE))
_SAMPLES = 2000  # of a curve
_BINS = 40


def _charts(found: dict[str, list[WorstError]]) -> Iterator[Chart]:
    polynomials, rooted, *_ = FAMILIES
    curves: list[ChartCurve] = []
    for kernel, form in _SHOWN:
        chosen = _of(found[polynomials], kernel, form)
        curves.append(_errors(f"{kernel}, {form.name}", chosen[:1], SEPARATE))
        if (kernel, form) != _SHOWN[1]:  # the bounds of a kernel are nearly the same in both types
            curves.append(_bound(f"bound, {kernel}", chosen[:1]))
    yield Chart("round-off of quotients of polynomials", r"$v_\ast$", "relative error of eps (u)", tuple(curves))
    chosen = _of(found[rooted], "half-line 1e-5", FLOAT)
    curves = [_errors("library's root", chosen, SEPARATE), _errors(SHORT[OFF], chosen, OFF), _bound("bound", chosen)]
    title = r"rounding in powers of $v_\ast^{1/3}$: half-line 1e-5, float"
    yield Chart(title, r"$v_\ast$", "relative error of eps (u)", tuple(curves))
    curves, at = [], 0
    for family, results in found.items():
        ratios = [w.ratio for group in grouped(results).values() for w in by_way(group).values()]
        curves.append(curve(FAMILY[family], range(at + 1, at + len(ratios) + 1), ratios, "points"))
        at += len(ratios)
    curves.append(curve("proven bound", (1, at), (1, 1), "bound"))
    x_label = "kernel and variant, as in the tables"
    yield Chart("largest error found / bound", x_label, "ratio", tuple(curves), x_scale="linear")


def _of(results: Sequence[WorstError], kernel: str, form: Format) -> list[ExportedFunction]:
    """Return the functions (or branches) of a kernel that give eps, each once."""
    found = (w.function for w in results if w.way == SEPARATE and w.function.name == "epsilon")
    return [f for f in found if isinstance(f, ExportedFunction) and (f.kernel, f.form) == (kernel, form)]


def _errors(name: str, functions: Sequence[ExportedFunction], way: ArithmeticVariant) -> ChartCurve:
    """Return the largest error in each of some intervals of the argument, in u."""
    low, high = max(functions[0].low, 1e-2), functions[-1].high
    generator = np.random.default_rng(SEED)
    places = np.geomspace(low, high, _BINS + 1)
    largest = np.zeros(_BINS)
    for function in functions:
        x = _draw(replace(function, low=max(low, function.low)), _SAMPLES, generator)
        scores = _scores(function, way, x, generator.integers(-way.steps, way.steps + 1, x.size))
        at = np.clip(np.searchsorted(places, x.astype(float)) - 1, 0, _BINS - 1)
        np.maximum.at(largest, at, [score.relative * 2.0**function.form.precision for score in scores])
    shown = largest > 0
    return curve(name, np.sqrt(places[1:] * places[:-1])[shown], largest[shown])


def _bound(name: str, functions: Sequence[ExportedFunction]) -> ChartCurve:
    bound = float(max(f.relative for f in functions)) * 2.0 ** functions[0].form.precision
    return curve(name, (max(functions[0].low, 1e-2), functions[-1].high), (bound, bound), "bound")


def _summary(found: dict[str, list[WorstError]]) -> str:
    everything = [w for results in found.values() for w in results]
    kernels = {(w.function.kernel, w.function.form.name) for w in everything}
    parts = []
    for family, results in found.items():
        ratios = [max(w.ratio for w in group) for group in grouped(results).values()]
        parts.append(f"{min(ratios):.2f} to {max(ratios):.2f} ({family})")
    # The bounds of full accuracy are little more than the last rounding, which errs by nearly all of its bound.
    w = max((w for w in everything if isinstance(w.function, ExportedFunction)), key=lambda w: w.ratio)
    return (
        f"The search covered {len(kernels)} kernels and types: {len(everything)} functions, rows of tables, branches "
        f"and arithmetic variants. Worst error found over proven bound, by kernel: {'; '.join(parts)}. Full accuracy "
        f"apart, whose bound is little more than the last rounding, {w.function.kernel}, type {w.function.form.name}, "
        f"comes nearest to its bound, with {w.ratio:.3f} of it, {w.roundings:.2f} u (u = 2^-53 in double, 2^-24 in "
        f"float; {SHORT[w.way]}). Bounds add the largest rounding of every operation with the same sign, over parts of "
        "the range: they are farther off where there is a root."
    )


CASE = Case(
    "kernel-rounding",
    "Largest round-off of the exported functions",
    "A search looks for the arguments with the largest round-off of every exported function, in float and double: "
    "computed plainly, with FMA contraction, and with roots as inaccurate as the headers allow. No error may exceed "
    "its proven bound.",
    run,
)
