"""The exact function at v* = 1e-1000 … 1e100, and its inverse, against asymptotic expansions that do not use it.

What an asymptotic expansion leaves out is nearly its first omitted term: with S_n the sum of the first n terms,
(exact - S_n)/t_(n+1) = 1 + t_(n+2)/t_(n+1) + … . At v* <= 1e-3 and v* >= 1e3 the terms that follow are small, so the
quotient lies between 1/2 and 2. That is the limit of every comparison, and over a range of v* it fixes the power and
the logarithms with which the difference vanishes.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Iterable, Mapping, Sequence
from dataclasses import dataclass, replace
from decimal import ROUND_HALF_EVEN, Context, Decimal
from fractions import Fraction
from functools import lru_cache
from itertools import pairwise
from typing import Any

import numpy as np
from flint import arb

from viscopade.arithmetic.balls import ball_of, bits_for, working
from viscopade.arithmetic.decimals import at_most
from viscopade.arrays import double, panels
from viscopade.arrays.checked import FloatArray
from viscopade.collision import exact
from viscopade.theory.series import series
from viscopade_lab import asymptotics
from viscopade_lab.asymptotics import Expansion, LogExpansion, PowerExpansion
from viscopade_lab.hard_cases.finding import Case, Cell, Chart, ChartCurve, Check, Outcome, ResultTable, curve

NEAR, FAR = "v* -> 0", "v* -> infinity"
LABELS = {"one_minus_epsilon": "1 - eps", "epsilon": "eps", "x_max": "x_max", "tau_c": "tau_c", "v_star": "v*"}
FACTOR = 2.0
"""Between the difference and the first omitted term, either way."""
SHOWN_ORDERS = 4
RESOLVED = 100  # times smaller than the term an enclosure must be for a difference to be measured
SHOWN_DECADES = 110  # of what is given, in the charts
SEED = 7


@dataclass(frozen=True)
class ExpansionPlan:
    """What a run computes: v*, or the portion given, as text, with the digits."""

    near: tuple[tuple[str, int], ...]
    far: tuple[tuple[str, int], ...]
    losses: tuple[tuple[str, int], ...]
    epsilons: tuple[tuple[str, int], ...]
    nested: tuple[tuple[str, tuple[int, ...]], ...]
    trip_digits: int
    longest: tuple[str, int]
    by_series: tuple[str, int, int]
    """v*, digits, and the order of the series."""
    inverse_by_series: tuple[str, int, int]
    """1 - eps, and the same."""
    near_order: int
    far_order: int
    coefficient_digits: int
    doubles: int


QUICK = ExpansionPlan(
    near=(("1e-3", 40), ("1e-4", 40), ("1e-6", 40), ("1e-10", 40), ("1e-30", 100), ("1e-1000", 20)),
    far=(("1e3", 45), ("1e4", 45), ("1e6", 30), ("1e10", 30), ("1e30", 12)),
    losses=(("1e-6", 40), ("1e-8", 40), ("1e-30", 60)),
    epsilons=(("1e-10", 40), ("1e-12", 40), ("1e-100", 6)),
    nested=(("1e-30", (20, 50, 100)), ("1", (20, 50, 100)), ("1e6", (20, 30))),
    trip_digits=20,
    longest=("1e-300", 150),
    by_series=("1e-30", 100, 6),
    inverse_by_series=("1e-30", 100, 9),
    near_order=5,
    far_order=5,
    coefficient_digits=50,
    doubles=300,
)
THOROUGH = ExpansionPlan(
    near=(
        *((f"1e-{n}", 100) for n in (3, 4, 5, 6, 8, 10, 15, 20)),
        *(("1e-30", 300), ("1e-100", 300), ("1e-1000", 300)),
    ),
    far=(*((f"1e{n}", 100) for n in (3, 4, 5, 6, 8, 10, 15, 20)), *(("1e30", 220), ("1e60", 20), ("1e100", 12))),
    losses=tuple((f"1e-{n}", 100) for n in (6, 9, 12, 30, 100, 1990)),
    epsilons=(*((f"1e-{n}", 80) for n in (10, 13, 20, 50)), ("1e-100", 20), ("1e-330", 6)),
    nested=(
        ("1e-30", (20, 50, 100, 300)),
        ("1", (20, 50, 100, 300, 1000)),
        ("1e6", (20, 50, 100)),
        ("1e30", (12, 220)),
    ),
    trip_digits=50,
    longest=("1e-300", 1000),
    by_series=("1e-30", 1000, 36),
    inverse_by_series=("1e-30", 1000, 69),
    near_order=8,
    far_order=8,
    coefficient_digits=220,
    doubles=5000,
)

LEAST = {"one_minus_epsilon": Decimal("1e-1990"), "epsilon": Decimal("1e-330")}  # that the inverse accepts
OUTSIDE: tuple[Callable[[], object], ...] = (
    lambda: exact.collision("1e-1001"),
    lambda: exact.collision("1.0001e100"),
    lambda: exact.invert("0.9e-330"),
    lambda: exact.invert(one_minus_epsilon="0.9e-1990"),
)


# --- the expansions ---------------------------------------------------------------------------------------------------


@lru_cache(maxsize=2)
def expansions_near_rest(order: int, digits: int, long_digits: int) -> dict[str, PowerExpansion]:
    """Return the expansions for v* -> 0, the first terms to more digits, by their closed forms."""
    rest, first = asymptotics.elastic(order, digits), asymptotics.elastic_in_closed_form(long_digits)
    return {name: _sharpened(first[name], rest[name]) for name in rest}


def _sharpened(first: PowerExpansion, rest: PowerExpansion) -> PowerExpansion:
    known = dict(first.coefficients)
    return PowerExpansion(rest.root, tuple((n, known.get(n, c)) for n, c in rest.coefficients))


# --- comparing --------------------------------------------------------------------------------------------------------


@dataclass(frozen=True)
class PartialSum:
    """How far the sum of the first terms is from the exact value, relative to that; logarithms to base 10.

    `resolved` says whether the enclosures are narrow enough to measure it; `quotient` is the difference in units of
    the first omitted term.
    """

    terms: int
    difference: float
    omitted: float
    quotient: float
    resolved: bool


@dataclass(frozen=True)
class ExpansionComparison:
    """The exact value of one quantity at one place against all partial sums of its expansion.

    `digits` is how many were asked for, `terms` how many were summed in the end, `agreed` how many digits are the
    same then; `excess` is the upper bound of the last difference in units of what may be: twice the first omitted term
    and a unit of the last digit.
    """

    end: str
    quantity: str
    at: str
    digits: int
    terms: int
    agreed: float
    excess: float
    orders: tuple[PartialSum, ...]

    @property
    def log_at(self) -> float:
        """log10 of where it is."""
        return _log10_of(self.at)


def _log10_of(text: str) -> float:
    return float(Decimal(text).log10())


def compared(end: str, quantity: str, at: str, digits: int, value: arb, expansion: Expansion) -> ExpansionComparison:
    """Compare an enclosure of the exact value with the sums."""
    with working(bits_for(digits) + 128):
        terms = expansion.terms(ball_of(Fraction(at)))
        total, orders = arb(0), []
        for n, (term, omitted) in enumerate(pairwise(terms), 1):
            total += term
            orders.append(_order(n, value - total, omitted, value))
        left = abs(value - total).abs_upper()
        allowed = FACTOR * abs(terms[-1]) + abs(value) * arb(10) ** (1 - digits)
        agreed = min(-_log10(left / abs(value)), float(digits))
        return ExpansionComparison(end, quantity, at, digits, len(orders), agreed, float(left / allowed), tuple(orders))


def _order(n: int, difference: arb, omitted: arb, value: arb) -> PartialSum:
    resolved = bool(arb(difference.rad()) * RESOLVED < abs(omitted) and difference != 0)
    quotient = float((difference / omitted).mid()) if resolved else math.nan
    return PartialSum(n, _log10(difference / value), _log10(omitted / value), quotient, resolved)


def _log10(value: arb) -> float:
    size = abs(value).mid() if not value.contains(0) else abs(value).abs_upper()
    return float(arb(size).log() / arb(10).log()) if size > 0 else -math.inf


@lru_cache(maxsize=64)
def _collision(v_star: str, digits: int) -> exact.Collision:
    return exact.collision(v_star, digits)


@lru_cache(maxsize=64)
def _inverse(name: str, portion: str, digits: int) -> exact.Collision:
    return (
        exact.invert(portion, digits) if name == "epsilon" else exact.invert(one_minus_epsilon=portion, digits=digits)
    )


def forward_comparisons(plan: ExpansionPlan) -> list[ExpansionComparison]:
    """Compare eps (or 1 - eps), x_max and tau_c at all v*."""
    sides = ((NEAR, (*plan.near, plan.longest), _near(plan).items()), (FAR, plan.far, _far(plan).items()))
    return [
        compared(end, name, at, digits, getattr(_collision(at, digits), name), expansion)
        for end, points, found in sides
        for name, expansion in found
        if name != "v_star"
        for at, digits in dict.fromkeys(points)
    ]


def inverse_comparisons(plan: ExpansionPlan) -> list[ExpansionComparison]:
    """Compare v* at all 1 - eps and eps."""
    sides = (
        (NEAR, "one_minus_epsilon", plan.losses, _near(plan)["v_star"]),
        (FAR, "epsilon", plan.epsilons, _far(plan)["v_star"]),
    )
    return [
        compared(end, "v_star", at, digits, _inverse(given, at, digits).v_star, expansion)
        for end, given, points, expansion in sides
        for at, digits in points
    ]


def series_comparisons(plan: ExpansionPlan) -> list[ExpansionComparison]:
    """Compare 1 - eps with the series of `viscopade.theory.series`, a third way."""
    at, digits, order = plan.by_series
    exactly = _collision(at, digits).one_minus_epsilon
    return [
        compared(NEAR, "one_minus_epsilon", at, digits, exactly, _loss(order, digits)),
        _back_by_series(*plan.inverse_by_series),
    ]


def _back_by_series(given: str, digits: int, order: int) -> ExpansionComparison:
    """Put v*(1 - eps) into the series, which has to give back 1 - eps: no order of v* itself is compared."""
    v_star = _inverse("one_minus_epsilon", given, digits + 5).decimals()["v_star"]
    with working(bits_for(digits) + 128):
        loss = ball_of(Fraction(given))
    found = compared(NEAR, "one_minus_epsilon", v_star, digits, loss, _loss(order, digits))
    return replace(found, quantity="v_star", at=given, orders=())


def _loss(order: int, digits: int) -> PowerExpansion:
    with working(bits_for(digits) + 64):
        loss = tuple((k, -h_k) for k, h_k in enumerate(series(order, digits).h) if k > 0 and h_k != 0)
    return PowerExpansion((1, 1), loss)


def _near(plan: ExpansionPlan) -> dict[str, PowerExpansion]:
    return expansions_near_rest(plan.near_order, plan.coefficient_digits, plan.longest[1])


def _far(plan: ExpansionPlan) -> dict[str, LogExpansion]:
    return asymptotics.viscous(plan.far_order, plan.coefficient_digits)


# --- slopes -----------------------------------------------------------------------------------------------------------


@dataclass(frozen=True)
class DifferenceSlope:
    """How the difference after some terms falls between the outermost places where it is resolved.

    `limit` is what the slope can be off if the difference is the first omitted term up to the factor, at both places.
    """

    end: str
    quantity: str
    terms: int
    points: int
    measured: float
    expected: float
    limit: float
    worst: float
    """Largest quotient of difference and first omitted term, or of the two the other way round."""


def slopes(comparisons: Iterable[ExpansionComparison]) -> list[DifferenceSlope]:
    """Return the slopes in double logarithmic scale, for every quantity and number of terms."""
    found: dict[tuple[str, str, int], list[tuple[float, PartialSum]]] = {}
    for comparison in comparisons:
        for order in comparison.orders[:SHOWN_ORDERS]:
            resolved = found.setdefault((comparison.end, comparison.quantity, order.terms), [])
            if order.resolved:
                resolved.append((comparison.log_at, order))
    return [_slope(*key, sorted(points, key=lambda p: p[0])) for key, points in found.items()]


def _slope(end: str, quantity: str, terms: int, points: Sequence[tuple[float, PartialSum]]) -> DifferenceSlope:
    if len(points) < 2:
        return DifferenceSlope(end, quantity, terms, len(points), math.nan, math.nan, math.nan, math.nan)
    (low, first), (high, last) = points[0], points[-1]
    width = high - low
    return DifferenceSlope(
        end,
        quantity,
        terms,
        len(points),
        (last.difference - first.difference) / width,
        (last.omitted - first.omitted) / width,
        2 * math.log10(FACTOR) / width,
        max(_either_way(order.quotient) for _, order in points),
    )


def _either_way(quotient: float) -> float:
    """Return the quotient or its inverse, whichever is larger; a wrong sign counts as infinite."""
    return max(quotient, 1 / quotient) if quotient > 0 else math.inf


# --- digits, and there and back ---------------------------------------------------------------------------------------


def nesting_faults(plan: ExpansionPlan) -> int:
    """Count the decimals that are not the rounded longer ones, and the enclosures that do not meet.

    The enclosure of v* must hold the v* that was given, too.
    """
    faults = sum(not _holds_what_was_given(*point) for point in (*plan.near, *plan.far))
    for v_star, digits in plan.nested:
        runs = [_collision(v_star, n) for n in digits]
        for i, short in enumerate(runs):
            faults += sum(_disagree(short, long, name) for long in runs[i + 1 :] for name in short.balls())
    return faults


def _holds_what_was_given(v_star: str, digits: int) -> bool:
    with working(bits_for(digits) + 64):
        return bool(_collision(v_star, digits).v_star.overlaps(ball_of(Fraction(v_star))))


def _disagree(short: exact.Collision, long: exact.Collision, name: str) -> bool:
    rounded = Decimal(long.decimals()[name]).normalize(_decimals(short.digits))
    meet = short.balls()[name].overlaps(long.balls()[name])
    return not meet or Decimal(short.decimals()[name]) != rounded


def _decimals(digits: int) -> Context:
    return Context(prec=digits, rounding=ROUND_HALF_EVEN, Emin=-(10**6), Emax=10**6)


def round_trip_faults(plan: ExpansionPlan) -> list[str]:
    """Return what does not come back in all digits: v* by way of eps or 1 - eps, and eps and 1 - eps by way of v*.

    Two digits less than were asked for must be the same: errors grow at most by the exponent, 10/3. All numbers given
    are powers of ten. Where the inverse does not accept what v* leads to, there is no way back.
    """
    faults = []
    for v_star, digits in (*plan.near, *plan.far):
        name = "one_minus_epsilon" if Decimal(v_star) < 1 else "epsilon"
        portion = _collision(v_star, digits).decimals()[name]
        if Decimal(portion) >= LEAST[name]:
            known = min(digits, plan.trip_digits) - 2
            faults += _other(v_star, _inverse(name, portion, known).decimals()["v_star"], known)
    for name, points in (("one_minus_epsilon", plan.losses), ("epsilon", plan.epsilons)):
        for portion, digits in points:
            known = min(digits, plan.trip_digits) - 2
            v_star = _inverse(name, portion, digits).decimals()["v_star"]
            faults += _other(portion, _collision(v_star, known).decimals()[name], known)
    return faults


def _other(given: str, back: str, digits: int) -> list[str]:
    same = Decimal(given) == Decimal(back).normalize(_decimals(digits - 1))
    return [] if same else [f"{given} comes back as {back}"]


def order_faults(plan: ExpansionPlan) -> int:
    """Count neighbouring v* where 1 - eps falls, or eps, x_max or tau_c rises."""
    points = sorted((*plan.near, *plan.far), key=lambda point: Decimal(point[0]))
    runs = [_collision(*point) for point in points]
    faults = 0
    for slow, fast in pairwise(runs):
        with working(bits_for(max(slow.digits, fast.digits)) + 64):
            faults += bool(fast.one_minus_epsilon < slow.one_minus_epsilon)
            faults += sum(bool(getattr(fast, name) > getattr(slow, name)) for name in ("epsilon", "x_max", "tau_c"))
    return faults


def accepted_outside() -> int:
    """Count numbers just beyond the ends that are not refused."""
    return sum(not _refused(call) for call in OUTSIDE)


def _refused(call: Callable[[], object]) -> bool:
    try:
        call()
    except ValueError:
        return True
    return False


# --- double precision -------------------------------------------------------------------------------------------------


@dataclass(frozen=True)
class DoubleErrors:
    """A function of `double` at one end: the largest error in units in the last place, and what is no number."""

    function: str
    end: str
    points: int
    worst: float
    at: float
    wrong: int


def doubles(plan: ExpansionPlan) -> list[DoubleErrors]:
    """Compare double precision with the expansions at v* = 1e-300 … 1e-3 and 1e3 … 1e300, and the inverse alike."""
    elastic, viscous = _near(plan), _far(plan)
    slow = _spread(plan.doubles, -300, -3)
    fast = np.concatenate([_spread(plan.doubles // 2, 3, 300), _spread(plan.doubles // 2, 3, 110)])  # eps > 0 to 1e97
    losses, epsilons = (_spread(plan.doubles, -323.3, high) for high in (-6, -10))
    found = [
        _doubles(name, end, points, getattr(double, name)(points), _truth(found, name))
        for end, points, found in ((NEAR, slow, dict(elastic)), (FAR, fast, dict(viscous)))
        for name in panels.NAMES
    ]
    backward = double.v_star_from(one_minus_epsilon=losses), double.v_star_from(epsilons)
    return [
        *found,
        _doubles("v_star_from", NEAR, losses, backward[0], _truth(dict(elastic), "v_star")),
        _doubles("v_star_from", FAR, epsilons, backward[1], _truth(dict(viscous), "v_star")),
    ]


def _spread(number: int, low: float, high: float) -> FloatArray:
    """Return 10^low, 10^high, and numbers between them of random logarithm."""
    exponents = np.random.default_rng(SEED).uniform(low, high, number)
    points: FloatArray = 10.0 ** np.array([low, high, *exponents])
    return points


def _truth(found: Mapping[str, Expansion], name: str) -> Callable[[arb], arb]:
    """Return the sum of an expansion; of eps and 1 - eps an end has one."""
    if name in found:
        return lambda at: sum(found[name].terms(at), arb(0))
    (other,) = {"epsilon", "one_minus_epsilon"} - {name}
    return lambda at: 1 - sum(found[other].terms(at), arb(0))


def _doubles(name: str, end: str, points: FloatArray, values: Any, truth: Callable[[arb], arb]) -> DoubleErrors:
    with working(192):
        errors = [_ulps(value, truth(arb(at))) for at, value in zip(points.tolist(), values.tolist(), strict=True)]
    worst = int(np.argmax(errors))
    wrong = int(np.count_nonzero(~np.isfinite(values) | (values < 0)))
    return DoubleErrors(name, end, len(points), errors[worst], float(points[worst]), wrong)


def _ulps(value: float, true: arb) -> float:
    """Return the error in units in the last place; below the normal numbers, of the smallest number."""
    if not math.isfinite(value):
        return math.inf
    return float(abs(arb(value) - true).abs_upper() / arb(math.ulp(float(true.mid()))))


# --- the result -------------------------------------------------------------------------------------------------------


def run(thorough: bool) -> Outcome:
    """Compare at both ends."""
    plan = THOROUGH if thorough else QUICK
    comparisons = [*forward_comparisons(plan), *inverse_comparisons(plan), *series_comparisons(plan)]
    falls, machine = slopes(comparisons), doubles(plan)
    return Outcome(
        _summary(comparisons, falls, machine),
        (_agreement_table(comparisons), _slope_table(falls), _coefficient_table(plan), _doubles_table(machine)),
        _charts(comparisons),
        _checks(plan, comparisons, falls, machine),
    )


def _summary(comparisons: list[ExpansionComparison], falls: list[DifferenceSlope], machine: list[DoubleErrors]) -> str:
    agreed = {end: max(c.agreed for c in comparisons if c.end == end) for end in (NEAR, FAR)}
    measured = [s for s in falls if s.points > 1]
    off = max(abs(s.measured - s.expected) for s in measured)
    steepest = min((s for s in measured if s.end == FAR and s.quantity == "epsilon"), key=lambda s: s.measured)
    worst = max(machine, key=lambda d: d.worst / double.ULP[d.function])
    return (
        "The exact function and its inverse agree with expansions derived anew for v* -> 0 and v* -> infinity in all "
        f"digits that both have: up to {math.floor(agreed[NEAR])} digits at the one end, {math.floor(agreed[FAR])} at "
        "the other. After n terms the difference is the next term, within a factor of "
        f"{at_most(max(s.worst for s in measured), 4)}, and over the decades its power is that of the next term within "
        f"{at_most(off, 1)}: relatively, eps after {steepest.terms} terms is off by v*^{steepest.measured:.3f}, with "
        "v*^(-10/3) and a logarithm for each. Double precision from v* = 1e-300 to 1e300 comes nearest to its stated "
        f"error in {worst.function}: {worst.worst:.2f} of {double.ULP[worst.function]:g} ulp at {worst.at:.4g}."
    )


def _checks(
    plan: ExpansionPlan,
    comparisons: list[ExpansionComparison],
    falls: list[DifferenceSlope],
    machine: list[DoubleErrors],
) -> tuple[Check, ...]:
    longest = [c for c in comparisons if (c.at, c.digits) == plan.longest]
    measured = [s for s in falls if s.points > 1]
    return (
        Check.within(
            "The exact value and the sum of all terms but the last differ by at most twice the last term plus one unit "
            "of the last digit: largest difference relative to this limit",
            max(c.excess for c in comparisons),
        ),
        Check(
            "After n = 1 … 4 terms the difference equals the first omitted term within a factor of 2, wherever the "
            "digits resolve it: largest factor",
            max((s.worst for s in measured), default=math.inf),
            "<=",
            FACTOR,
        ),
        Check(
            "The digits resolve the difference after n = 1 … 3 terms of every quantity at two points or more: least "
            "number of points",
            min(s.points for s in falls if s.terms < SHOWN_ORDERS),
            ">=",
            2,
        ),
        Check.within(
            "The log-log slopes of the differences equal those of the first omitted terms, logarithms included: "
            "largest deviation relative to that of a factor of 2 at both ends of the range",
            max((abs(s.measured - s.expected) / s.limit for s in measured), default=math.inf),
        ),
        Check(
            f"1 - eps, x_max and tau_c to {plan.longest[1]} digits at v* = {plan.longest[0]} agree with the expansions "
            "in all these digits but the last: digits in common",
            min(c.agreed for c in longest),
            ">=",
            plan.longest[1] - 1,
        ),
        Check.never(
            "Results to fewer digits are the rounded results to more digits, enclosures overlap, and the enclosure of "
            "v* contains the given v*: exceptions",
            nesting_faults(plan),
        ),
        Check.never(
            "The inverse of the function, and the function of the inverse, return the given number: exceptions",
            len(round_trip_faults(plan)),
        ),
        Check.never(
            "With growing v*, 1 - eps never falls, and eps, x_max and tau_c never rise: exceptions",
            order_faults(plan),
        ),
        Check.never("Numbers just beyond the accepted range are refused: exceptions", accepted_outside()),
        Check.within(
            "Double precision agrees with the expansions within its stated error: largest error relative to it",
            max(d.worst / double.ULP[d.function] for d in machine),
        ),
        Check.never(
            "Double precision never returns an infinity, a NaN or a negative number there: exceptions",
            sum(d.wrong for d in machine),
        ),
    )


# --- tables and charts ------------------------------------------------------------------------------------------------


def _agreement_table(comparisons: list[ExpansionComparison]) -> ResultTable:
    """Return the least agreement of the quantities at each place."""
    groups: dict[tuple[str, str, int], list[ExpansionComparison]] = {}
    for c in comparisons:
        given = "v*" if c.quantity != "v_star" else "1 - eps" if c.end == NEAR else "eps"
        groups.setdefault((f"{given} = {c.at}", c.end, c.digits), []).append(c)
    rows = [
        (
            at,
            ", ".join(LABELS[c.quantity] for c in group),
            digits,
            max(c.terms for c in group),
            round(min(c.agreed for c in group), 1),
            f"{max(c.excess for c in group):.2g}",
        )
        for (at, _, digits), group in groups.items()
    ]
    header = ("at", "compared", "digits asked for", "terms", "digits in common", "difference/allowed")
    return ResultTable("Exact function and inverse against the expansions", header, tuple(rows))


def _slope_table(falls: list[DifferenceSlope]) -> ResultTable:
    rows: list[tuple[Cell, ...]] = [
        (s.end, LABELS[s.quantity], s.terms, s.points, f"{s.measured:.6f}", f"{s.expected:.6f}", f"{s.worst:.6f}")
        for s in falls
        if s.points > 1
    ]
    header = ("end", "quantity", "terms", "places", "slope of the difference", "of the first omitted term", "quotient")
    return ResultTable("Relative difference after n terms, as a power of what is given", header, tuple(rows))


def _coefficient_table(plan: ExpansionPlan) -> ResultTable:
    """Return the first coefficients of all expansions."""
    elastic, viscous = _near(plan), _far(plan)
    rows: list[tuple[Cell, ...]] = []
    for name, expansion in elastic.items():
        variable = "v*" if name != "v_star" else "(1 - eps)^(1/2)"
        rows += [(LABELS[name], f"{variable}^{n}", _short(c)) for n, c in expansion.coefficients[:SHOWN_ORDERS]]
    for name in viscous:
        variable = "W" if name != "v_star" else "E"
        for n, p in enumerate(viscous[name].polynomials[:3]):
            text = " + ".join(f"({_short(c)}) ln^{k}" if k else f"({_short(c)})" for k, c in enumerate(p.coeffs()))
            rows.append((LABELS[name], f"{variable}^-{n} of the bracket", text))
    title = "First coefficients; W = 12^(1/3) v*^(10/3), E = 3/eps, ln is that of W or E"
    return ResultTable(title, ("quantity", "power", "coefficient"), tuple(rows))


def _short(number: arb) -> str:
    return str(number.mid().str(10, radius=False))


def _doubles_table(machine: list[DoubleErrors]) -> ResultTable:
    rows = [(d.function, d.end, d.points, f"{d.worst:.3f}", double.ULP[d.function], f"{d.at:.6g}") for d in machine]
    header = ("function", "end", "arguments", "largest error/ulp", "stated", "at")
    return ResultTable("Double precision against the expansions", header, tuple(rows))


def _charts(comparisons: list[ExpansionComparison]) -> tuple[Chart, ...]:
    orders = range(1, SHOWN_ORDERS + 1)
    curves = {
        ("1 - eps for v* -> 0", "log10 v*"): _curves(comparisons, NEAR, "one_minus_epsilon", orders),
        ("eps for v* -> infinity", "log10 v*"): _curves(comparisons, FAR, "epsilon", orders),
        ("the inverse at both ends", "log10 of the 1 - eps or eps that is given"): [
            *_curves(comparisons, NEAR, "v_star", (1, 2), ", 1 - eps"),
            *_curves(comparisons, FAR, "v_star", (1, 2), ", eps"),
        ],
    }
    return tuple(
        Chart(title, x_label, "log10 of the relative difference", tuple(found), "linear", "linear")
        for (title, x_label), found in curves.items()
    )


def _curves(
    comparisons: list[ExpansionComparison], end: str, quantity: str, terms: Iterable[int], of: str = ""
) -> Iterable[ChartCurve]:
    """Yield, for n terms, the difference where it is resolved, and the first omitted term."""
    chosen = [c for c in comparisons if c.end == end and c.quantity == quantity and abs(c.log_at) <= SHOWN_DECADES]
    chosen.sort(key=lambda c: c.log_at)
    for n in terms:
        orders = [(c.log_at, order) for c in chosen for order in c.orders if order.terms == n]
        measured = [(x, o.difference) for x, o in orders if o.resolved]
        if measured:
            yield curve(f"after {n}{of}", [x for x, _ in measured], [y for _, y in measured], look="points")
        yield curve(f"term {n + 1}{of}", [x for x, _ in orders], [o.omitted for _, o in orders], look="bound")


CASE = Case(
    "extremes",
    "Stiff and extreme: the exact function against asymptotic expansions",
    "At v* = 1e-1000 … 1e100, at 1 - eps = 1e-30 and eps = 1e-100, and to 1,000 digits: does the exact function agree "
    "with expansions for v* -> 0 and v* -> infinity that share nothing with it, and does the difference vanish at the "
    "rate of the first omitted term?",
    run,
)
