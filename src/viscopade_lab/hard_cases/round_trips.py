r"""Round trips: from a number, a material, a table or a text, and back to it.

A trip may lose what its two ways are allowed to lose, and no more: the stated or proven errors of both, times the
condition (`double_trips`), or roundings that are counted (`material_trips`).

Every function here takes a start and returns the error of the trip and its limit; the case samples starts with a seed,
and the tests let hypothesis look for worse ones.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Iterable, Mapping, Sequence
from decimal import Decimal
from fractions import Fraction
from typing import Any, NamedTuple

import numpy as np

from viscopade.arithmetic.balls import ball_of, bits_for, working
from viscopade.arithmetic.decimals import at_most
from viscopade.arrays import double
from viscopade.arrays.checked import FloatArray
from viscopade.collision import exact
from viscopade.kernels import requests
from viscopade_lab.hard_cases import compiled_text, double_trips, material_trips, tables_read_back
from viscopade_lab.hard_cases.double_trips import (
    LARGEST_CONDITION,
    LEAST_CONDITION,
    UNIT,
    Trip,
    change_of_odds,
    change_of_portion,
    change_of_v_star,
    condition,
    conditions,
    log_uniform,
    relative,
    ulp_of,
)
from viscopade_lab.hard_cases.finding import Case, Cell, Chart, ChartCurve, Check, Outcome, ResultTable, binned, curve
from viscopade_lab.hard_cases.material_trips import Tally

SEED = 7
_SLOPE = 1e-10  # what the 12 digits of `double.slope` leave open


# --- proven digits ----------------------------------------------------------------------------------------------------


class ProvenTrip(NamedTuple):
    """What a trip with proven digits comes back with: an interval that must contain the start.

    Attributes
    ----------
    v_star : float
    contains : bool
        Unless it is proven that the start lies outside.
    width : float
        Of the interval, relative to the start.
    expected : float
        The width of the rounded number in between, times the condition.
    """

    v_star: float
    contains: bool
    width: float
    expected: float


def rounding_interval(text: str, digits: int) -> tuple[Fraction, Fraction]:
    """Return the numbers that a decimal string of so many significant digits may be the rounding of."""
    number = Decimal(text)
    half = Fraction(10) ** (number.adjusted() - digits + 1) / 2
    return Fraction(number) - half, Fraction(number) + half


def _inverse(name: str, portion: Fraction | str, digits: int) -> exact.Collision:
    """Return the collision with this eps, or this 1 - eps."""
    if name == "epsilon":
        return exact.invert(portion, digits)
    return exact.invert(one_minus_epsilon=portion, digits=digits)


def exact_there_and_back(v_star: str, digits: int) -> ProvenTrip:
    """Go from v* to the smaller portion, rounded to `digits`, and back from both ends of what was rounded."""
    there = exact.collision(v_star, digits)
    name = _smaller(there)
    low, high = rounding_interval(there.decimals()[name], digits)
    ends = [_inverse(name, end, digits + 6).v_star for end in (low, high)]
    v = float(v_star)
    return _hull(ends, Fraction(v_star), v, digits, float((high - low) / low) / _slope(name, v))


def exact_back_and_there(name: str, portion: str, digits: int) -> ProvenTrip:
    """Go from a portion, at most 1/2, to v*, rounded, and back."""
    there = _inverse(name, portion, digits)
    low, high = rounding_interval(there.decimals()["v_star"], digits)
    ends = [getattr(exact.collision(end, digits + 6), name) for end in (low, high)]
    v = there.floats()["v_star"]
    return _hull(ends, Fraction(portion), v, digits, float((high - low) / low) * _slope(name, v))


def _smaller(collision: exact.Collision) -> str:
    return "epsilon" if bool(collision.epsilon < collision.one_minus_epsilon) else "one_minus_epsilon"


def _slope(name: str, v_star: float) -> float:
    """Return |d ln portion/d ln v*|."""
    rest = double.one_minus_epsilon(v_star) if name == "epsilon" else double.epsilon(v_star)
    return rest / float(condition(np.array(v_star)))


def _hull(ends: Sequence[Any], start: Fraction, v_star: float, digits: int, expected: float) -> ProvenTrip:
    with working(bits_for(digits) + 96):
        true = ball_of(start)
        lower, upper = ends if bool(ends[0] < ends[1]) else ends[::-1]
        outside = bool(lower > true) or bool(upper < true)
        width = (upper - lower) / true
        return ProvenTrip(v_star, not outside, float(width.abs_upper()), expected)


def _exact_trips(generator: np.random.Generator, number: int, most: int) -> tuple[list[ProvenTrip], list[ProvenTrip]]:
    """Return trips from v* between 1e-30 and 1e30, and from portions that belong to such, with 3 to `most` digits."""
    there, back = [], []
    for i in range(number):
        digits = int(generator.integers(3, most + 1))
        v_star = f"{generator.uniform(1, 10):.{digits}f}e{int(generator.integers(-30, 29))}"
        there.append(exact_there_and_back(v_star, digits))
        low = -60 if i % 2 else -90
        portion = f"{generator.uniform(1, 5):.{digits}f}e{int(generator.integers(low, 0))}"
        back.append(exact_back_and_there("one_minus_epsilon" if i % 2 else "epsilon", portion, digits))
    return there, back


# --- exported kernels for the inverse ---------------------------------------------------------------------------------


class InverseText(NamedTuple):
    """An exported kernel for v*(eps): its functions, as the text in Python defines them, and its proven error."""

    name: str
    v_star: Callable[[float], float]
    from_loss: Callable[[float], float]
    error: float


def inverse_texts(request: requests.Request) -> list[InverseText]:
    """Return the kernels of a request; each error is that of the formula and of its rounding together."""
    functions = compiled_text.python(request.render("python"))
    found = []
    for name, bound, rounding in compiled_text.proven_inverses(request.render("json")):
        total = (1 + bound) * (1 + rounding) - 1
        found.append(
            InverseText(
                name, functions[f"v_star_{name}"], functions[f"v_star_from_loss_{name}"], float(total) * (1 + 2**-50)
            )
        )
    return found


def v_star_by_text(kernel: InverseText, v_star: FloatArray) -> Trip:
    """Go from v* to the smaller portion in double precision, and back by the exported kernel."""
    epsilon, loss = double.epsilon(v_star), double.one_minus_epsilon(v_star)
    small = np.minimum(epsilon, loss)
    error = np.where(
        epsilon < loss, ulp_of("epsilon", np.asarray(small)), ulp_of("one_minus_epsilon", np.asarray(small))
    )
    back = np.array(
        [
            kernel.v_star(e) if e < d else kernel.from_loss(d)
            for e, d in zip(epsilon.tolist(), loss.tolist(), strict=True)
        ]
    )
    moved = change_of_v_star(v_star, change_of_odds(np.asarray(small), error))
    return Trip(v_star, relative(back, v_star), moved + kernel.error * (1 + moved))


def portion_by_text(kernel: InverseText, portion: FloatArray, *, loss: bool) -> Trip:
    """Go from eps, or from 1 - eps, to v* by the exported kernel, and back in double precision."""
    name, function = ("one_minus_epsilon", kernel.from_loss) if loss else ("epsilon", kernel.v_star)
    v_star = np.array([function(value) for value in portion.tolist()])
    back = getattr(double, name)(v_star)
    limit = change_of_portion(v_star, 1 - portion, -math.log1p(-kernel.error)) + ulp_of(name, portion) / portion
    return Trip(portion, relative(back, portion), limit)


def _text_trips(kernel: InverseText, generator: np.random.Generator, number: int) -> dict[str, Trip]:
    v_star = np.concatenate(
        [log_uniform(generator, 1e-150, 1e90, number // 2), log_uniform(generator, 1e-3, 1e3, number // 2)]
    )
    small = log_uniform(generator, 1e-300, 1.0, number)
    return {
        f"v* -> portion -> v*, {kernel.name}": v_star_by_text(kernel, v_star),
        f"eps -> v* -> eps, {kernel.name}": portion_by_text(kernel, small, loss=False),
        f"1 - eps -> v* -> 1 - eps, {kernel.name}": portion_by_text(kernel, np.minimum(small, 1 - UNIT), loss=True),
    }


# --- the case ---------------------------------------------------------------------------------------------------------


def _sizes(thorough: bool) -> dict[str, int]:
    names = "double", "exact", "text", "material", "quantity", "table", "compiled"
    quick, full = (60_000, 3, 1_500, 120, 10, 150, 80), (2_000_000, 120, 20_000, 10_000, 2_000, 3_000, 2_000)
    return dict(zip(names, full if thorough else quick, strict=True))


def _inverse_request(thorough: bool) -> requests.Request:
    return requests.INVERSE if thorough else requests.Request(inverse=requests.INVERSE.inverse[:1])


def run(thorough: bool) -> Outcome:
    """Take all trips from starts that a seed gives."""
    size, generator = _sizes(thorough), np.random.default_rng(SEED)
    doubles = double_trips.all_trips(generator, size["double"])
    there, back = _exact_trips(generator, size["exact"], 40 if thorough else 10)
    request = _inverse_request(thorough)
    texts = {
        name: trip
        for kernel in inverse_texts(request)
        for name, trip in _text_trips(kernel, generator, size["text"]).items()
    }
    materials = material_trips.all_trips(generator, size["material"])
    quantities = material_trips.changed_quantities(generator, size["quantity"])
    tables = tables_read_back.all_trips(np.random.default_rng(SEED), size["table"], thorough)
    code = compiled_text.all_trips(np.random.default_rng(SEED), size["compiled"], request, thorough)
    hulls = [*there, *back]
    return Outcome(
        _summary(doubles, hulls, materials, tables, code),
        (
            _trip_table(doubles, texts),
            _hull_table(there, back),
            _material_table(materials, quantities),
            tables_read_back.table(tables),
            compiled_text.table(code),
        ),
        (_double_chart(doubles), _text_chart(texts), compiled_text.chart(code)),
        _checks(doubles, hulls, texts, materials, quantities, tables, code),
    )


def _summary(
    doubles: Mapping[str, Trip],
    hulls: Sequence[ProvenTrip],
    materials: Mapping[str, Tally],
    tables: Sequence[tables_read_back.ReadBack],
    code: compiled_text.TextComparison,
) -> str:
    trip = doubles["v* -> eps -> v*"]
    lost = trip.start[(trip.limit >= 1) & (trip.start > 0)]
    elastic, far = lost[lost < 1].max(), lost[lost > 1].min()
    ways = max(tally.worst for tally in materials.values())
    return (
        "In double precision every trip between v* and eps stays within what the stated errors times the condition "
        f"allow (at most {at_most(100 * max(t.worst for t in doubles.values()), 2)}% of it). By way of eps, v* is lost "
        f"below {elastic:.1e}, where eps rounds to 1, and above {far:.1e}, where it underflows; by way of 1 - eps "
        f"small v* come back. {sum(h.contains for h in hulls)} of {len(hulls)} trips with proven digits contain their "
        f"start. Trips through materials and units reach {ways:.0%} of what their counted roundings allow. "
        f"{sum(t.cells for t in tables):,} cells of tables were written and read back, of which "
        f"{sum(t.changed for t in tables)} changed; of {code.compared:,} values of compiled C, {code.different} differ "
        "from those of the exported Python."
    )


def _checks(
    doubles: Mapping[str, Trip],
    hulls: Sequence[ProvenTrip],
    texts: Mapping[str, Trip],
    materials: Mapping[str, Tally],
    quantities: tuple[int, int],
    tables: Sequence[tables_read_back.ReadBack],
    code: compiled_text.TextComparison,
) -> tuple[Check, ...]:
    least, largest = conditions()
    family = "relative to the counted roundings on the way"
    return (
        Check(
            "kappa = d ln v*/d ln((1 - eps)/eps) is at least its limit for large v*",
            least,
            ">=",
            LEAST_CONDITION * (1 - _SLOPE),
        ),
        Check("kappa is at most its limit for small v*", largest, "<=", LARGEST_CONDITION * (1 + _SLOPE)),
        *(
            Check.within(
                f"{name} in double precision: largest error, relative to the stated errors times the condition number",
                trip.worst,
            )
            for name, trip in doubles.items()
        ),
        Check.never(
            "trips with proven digits whose interval does not contain the start",
            sum(not hull.contains for hull in hulls),
        ),
        Check(
            "largest width of these intervals, relative to the rounding in between times the condition number",
            max(hull.width / (hull.expected * (1 + hull.expected)) for hull in hulls),
            "<=",
            1.001,
        ),
        Check.within(
            "trips through exported inverse kernels: largest error, relative to their proven errors times the "
            "condition number",
            max(trip.worst for trip in texts.values()),
        ),
        Check.within(f"trips through A and beta: largest error, {family}", _worst(materials, "beta", "A")),
        Check.within(f"v* in other units: largest difference, {family}", _worst(materials, "v* in")),
        Check.within(f"speed and v*, density and mass: largest error, {family}", _worst(materials, "speed", "den")),
        Check.never("quantities that change when written with 17 digits and a unit, and read back", quantities[1]),
        *tables_read_back.checks(tables),
        *compiled_text.checks(code),
    )


def _worst(materials: Mapping[str, Tally], *words: str) -> float:
    """Return the worst of the trips that begin with a word or go by way of it."""
    return max(
        tally.worst
        for name, tally in materials.items()
        if any(name.startswith(word) or f"-> {word}" in name for word in words)
    )


def _trip_table(doubles: Mapping[str, Trip], texts: Mapping[str, Trip]) -> ResultTable:
    rows: list[tuple[Cell, ...]] = []
    for name, trip in (*doubles.items(), *texts.items()):
        known = trip.limit < 1
        lost = int(np.count_nonzero(~known))
        rows.append((name, len(trip.start), lost, f"{trip.error[known].max():.2e}", f"{trip.worst:.3f}"))
    header = ("trip", "starts", "lost: limit >= 1", "largest error of the others", "largest error/limit")
    return ResultTable("eps and v*: relative errors", header, tuple(rows))


def _hull_table(there: Sequence[ProvenTrip], back: Sequence[ProvenTrip]) -> ResultTable:
    rows: list[tuple[Cell, ...]] = []
    for name, hulls in (("v* -> portion -> v*", there), ("portion -> v* -> portion", back)):
        for hull in sorted(hulls)[:: max(1, len(hulls) // 5)]:
            rows.append(
                (
                    name,
                    f"{hull.v_star:.2e}",
                    "yes" if hull.contains else "no",
                    f"{hull.width:.2e}",
                    f"{hull.expected:.2e}",
                )
            )
    header = ("trip, some of them", "v*", "contains the start", "relative width", "rounded x condition")
    return ResultTable("Trips with proven digits through the smaller of eps and 1 - eps", header, tuple(rows))


def _material_table(materials: Mapping[str, Tally], quantities: tuple[int, int]) -> ResultTable:
    rows: list[tuple[Cell, ...]] = []
    for name, found in materials.items():
        worst = max(found.steps, key=lambda step: step[0] / step[1])
        rows.append(
            (
                name,
                len(found.steps),
                found.refused,
                f"{worst[0] / UNIT:.2f}",
                f"{worst[1] / UNIT:.2f}",
                f"{found.worst:.3f}",
            )
        )
    rows.append(
        ("SI number -> text with unit -> number", quantities[0], 0, "0" if not quantities[1] else "> 0", "0", "0")
    )
    header = ("trip", "starts", "refused", "error/2^-53", "limit/2^-53 there", "largest error/limit")
    return ResultTable("Materials, units and quantities", header, tuple(rows))


def _points_and_limit(name: str, trip: Trip, edges: FloatArray) -> Iterable[ChartCurve]:
    """Return the largest errors by interval of the start, and the largest limits there."""
    known = (trip.limit < 1) & (trip.start > 0)
    x, error, limit = trip.start[known], trip.error[known], trip.limit[known]
    yield curve(name, *binned(x, error, edges), "points")
    yield curve(f"limit of {name}", *binned(x, limit, edges), "bound")


def _double_chart(doubles: Mapping[str, Trip]) -> Chart:
    edges = np.linspace(-20, 100, 241)
    names = "v* -> eps -> v*", "v* -> 1 - eps -> v*"
    curves = [c for name in names for c in _points_and_limit(name, doubles[name], edges)]
    return Chart("v* -> eps -> v* in double precision", "v*", "relative error", tuple(curves))


def _text_chart(texts: Mapping[str, Trip]) -> Chart:
    edges = np.linspace(-6, 9, 121)
    curves = [
        c
        for name, trip in texts.items()
        if name.startswith("v*")
        for c in _points_and_limit(name.rpartition(", ")[2], trip, edges)
    ]
    return Chart("v* -> eps -> v* by exported kernels", "v*", "relative error", tuple(curves))


CASE = Case(
    "round-trips",
    "Round trips",
    "From eps to v* and back, from a material to beta and back, from a table to LaTeX, CSV and JSON and back, from an "
    "exported text to a compiled function and its values: does any value return with a larger error than both "
    "directions together allow?",
    run,
)
