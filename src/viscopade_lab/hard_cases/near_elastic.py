"""Hard case: nearly elastic collisions, 1 - eps at v* = 1e-8 and from 1e-1 down to 1e-160.

The difference 1 - eps of a computed eps has lost its digits there: eps itself is rounded to multiples of 2^-53. Every
function that gives 1 - eps, or 1 - eps^2, is compared with the exact one and held to the bounds that are proven of it.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import dataclass, replace
from fractions import Fraction
from functools import lru_cache
from typing import Any, NamedTuple

import numpy as np

from viscopade.arithmetic.formats import DOUBLE, FLOAT, FORMATS, Format
from viscopade.arithmetic.formats import decimal_value as fraction
from viscopade.arrays import double
from viscopade.collision import exact, spheres
from viscopade.kernels import names, registry
from viscopade.kernels.forms import last_place, speed_kernel
from viscopade.kernels.forms.speed_table_last_place import LastPlaceTable
from viscopade.kernels.registry import Entry
from viscopade.theory.paper import TABLE, last_digit
from viscopade_lab.hard_cases import exported
from viscopade_lab.hard_cases.exported import ExportedFunction, formats, minimax_coefficients
from viscopade_lab.hard_cases.finding import Case, Chart, Check, Outcome, ResultTable, curve
from viscopade_lab.hard_cases.machine import Array, type_of

DIGITS = 30
V_STAR = 1e-8
EXPONENTS = (*range(1, 17), 18, 20, 25, 30, 40, 60, 80, 100, 120, 140, 150, 154, 158, 160)
UNDERFLOW = 36  # of the smallest numbers: the most that a header of half-line kernels states
SWEEP = 60  # v* in each octave of the sweep

Loss = Callable[[float], float]


class Losses(NamedTuple):
    """1 - eps and 1 - eps^2."""

    loss: Fraction
    dissipation: Fraction


@lru_cache(maxsize=4096)
def exact_losses(v_star: Fraction, beta: float | None = None) -> Losses:
    """Return the exact numbers to `DIGITS` digits, at v*, or at speed 1 and beta."""
    collision = exact.collision(v_star, DIGITS) if beta is None else exact.collision(beta=beta, speed=1, digits=DIGITS)
    loss = Fraction(collision.decimals()["one_minus_epsilon"])
    return Losses(loss, loss * (2 - loss))


@dataclass(frozen=True)
class LossFunction:
    """How a kernel gives 1 - eps, or 1 - eps^2, in a type.

    Attributes
    ----------
    kernel, gives : str
    form : Format
    of : callable
        From v*, or from beta where the speed is 1, to the number.
    relative : Fraction
        The proven (for `double`: sampled) bound of its relative error.
    underflow : Fraction
        What underflow adds, absolutely.
    low, high : float
        The v* for which the bound is stated, or the function meant here is used.
    by_beta : bool
        Whether it takes a speed, 1, and beta = v*^2.
    """

    kernel: str
    gives: str
    form: Format
    of: Loss
    relative: Fraction
    underflow: Fraction
    low: float = 0.0
    high: float = 1.0
    by_beta: bool = False

    def error(self, v_star: float) -> tuple[float, float]:
        """Return the relative error near v*, and the error over the bound; NaN where nothing is stated."""
        x = float(type_of(self.form)(v_star**2 if self.by_beta else v_star))
        if not self.low <= v_star <= self.high or x == 0 or x < 2.0 ** (1 - self.form.largest):
            return math.nan, math.nan
        true = exact_losses(Fraction(v_star), x) if self.by_beta else exact_losses(Fraction(x))
        wanted = true.dissipation if self.gives == "1 - eps^2" else true.loss
        error = abs(Fraction(self.of(x)) - wanted)
        return float(error / wanted), float(error / (self.relative * wanted + self.underflow))


def entry(kind: str, tier: str, form: Format) -> Entry:
    """Return what the table of proven bounds has on a kernel."""
    wanted = kind, tier, "fast", registry.HOST, form.name
    return next(e for e in registry.entries() if (e.kind, e.tier, e.size, e.place, e.format) == wanted)


def ways() -> Iterator[LossFunction]:
    """Yield all functions that give 1 - eps or 1 - eps^2."""
    least = {form: Fraction(form.smallest) for form in FORMATS.values()}
    sampled = Fraction(double.ULP["one_minus_epsilon"]) / 2**52
    yield LossFunction(
        "viscopade.one_minus_epsilon", "1 - eps", DOUBLE, double.one_minus_epsilon, sampled, least[DOUBLE]
    )
    for form in (DOUBLE, FLOAT):
        bound = Fraction(entry("full", "full", form).inside)
        yield LossFunction("full", "1 - eps", form, _full(form, "one_minus_epsilon"), bound, least[form])
    for accuracy in exported.HALF_LINE:
        for form in formats(accuracy):
            bound, losses = Fraction(entry("half-line", accuracy, form).inside), half_line(accuracy, form)
            underflow = UNDERFLOW * least[form]
            yield LossFunction(f"half-line {accuracy}", "1 - eps", form, losses, bound, underflow)
        for form in formats(accuracy):
            low, _ = registry.limits(form.name)
            # beta^5 has to be a normal number, too: so it is where w is, as the speed is 1.
            given, of = entry("compact", accuracy, form), _compact(accuracy, form)
            bound = _of_dissipation(Fraction(given.outside), Fraction(given.loss))
            yield LossFunction(
                f"compact {accuracy}", "1 - eps^2", form, of, bound, Fraction(0), float(low), by_beta=True
            )
    for tier in names.TIERS:
        first = LastPlaceTable().first if tier == names.FULL else speed_kernel.TABLES[tier, names.FAST].first
        end = 0.99 * 2.0 ** (first / 10)  # from there on the table is used
        for form in FORMATS.values():
            bounds = _of_speed(tier, form)
            yield LossFunction(f"table {tier}", "1 - eps^2", form, _speed(tier, form), *bounds, high=end, by_beta=True)


def _of_dissipation(both: Fraction, last: Fraction) -> Fraction:
    """Return the bound of 1 - eps^2 where eps is off by at most both (1 - eps), and `last` is added by roundings."""
    return (1 + both * (1 + both / 2)) * (1 + last) - 1


def _of_speed(tier: str, form: Format) -> tuple[Fraction, Fraction]:
    """Return bounds for a kernel of speed: outside of its table, where v* is small."""
    given = entry("speed", tier, form)
    unit = Fraction(1, 2**form.precision)
    # In type float the result comes from type double and is rounded once more.
    bound = (1 + _of_dissipation(Fraction(given.outside), Fraction(given.loss))) * (1 + unit) - 1
    return bound, 2 * form.smallest


def _full(form: Format, name: str) -> Loss:
    return lambda v_star: float(last_place.evaluated_in(form, name, v_star))


def half_line(accuracy: str, form: Format, name: str = "one_minus_epsilon") -> Loss:
    """Return 1 - eps (or eps) of a half-line kernel for v* <= 1, as the header computes it."""
    return _at_one(exported.half_line_parts(accuracy, form, name)[0])


def _at_one(function: ExportedFunction) -> Loss:
    """Return the function of a number."""
    kind = type_of(function.form)
    return lambda x: float(function.computed(np.array([x], kind))[0])


def _compact(accuracy: str, form: Format) -> Loss:
    """Return 1 - eps^2 at speed 1 of a kernel without tables, as a function of beta."""
    program, results, numbers = exported.compact_parts(accuracy, form)
    name, given = "dissipation", numbers | {"speed": 1.0}
    parts = exported.half_line_parts(accuracy, form, "one_minus_epsilon")
    return _at_one(replace(parts[0], name=name, program=program, result=results[name], constants=given, given=_of_beta))


def _of_beta(x: Any) -> dict[str, Any]:
    return {"beta": x}


def _speed(tier: str, form: Format) -> Loss:
    """Return 1 - eps^2 at speed 1 as kernels of speed compute it outside of their table, in type double."""
    if tier in exported.HALF_LINE:
        loss, epsilon = half_line(tier, DOUBLE), half_line(tier, DOUBLE, "epsilon")
    else:
        loss, epsilon = _full(DOUBLE, "one_minus_epsilon"), _full(DOUBLE, "epsilon")

    def of(beta: float) -> float:
        v_star = spheres.v_star(1.0, beta)
        eps = epsilon(v_star)
        return float(type_of(form)(1.0 - eps * eps if eps < 0.5 else loss(v_star) * (1.0 + eps)))

    return of


# --- the naive difference ---------------------------------------------------------------------------------------------


def naive(form: Format) -> dict[str, Callable[[Array], Array]]:
    """Return functions that give eps, of arrays, whose difference from 1 is the naive 1 - eps."""

    def accurate(v_star: Array) -> Array:
        return np.asarray(last_place.evaluated_in(form, "epsilon", v_star))

    a, b = minimax_coefficients(3, 7, form)
    best = exported.of_quotient("best [3/7]", "epsilon", form, a, b, Fraction(5), Fraction(0))
    near = exported.half_line_parts("1e-5", form, "epsilon")[0]
    return {"full": accurate, "half-line 1e-5": near.computed, "best [3/7]": best.computed}


def naive_errors(form: Format, epsilon: Callable[[Array], Array], v_star: Array) -> Array:
    """Return the relative errors of the naive 1 - eps."""
    x = v_star.astype(type_of(form))
    difference = 1 - epsilon(x)
    return np.abs(difference.astype(float) / double.one_minus_epsilon(x.astype(float)) - 1)


class CancelledDigits(NamedTuple):
    """What the naive difference loses in each octave of 1 - eps.

    Attributes
    ----------
    v_star : Array
        Where it is worst.
    worst : Array
        The relative error there.
    share : Array
        The largest error in units of u/2.
    """

    v_star: Array
    worst: Array
    share: Array


@lru_cache(maxsize=2)
def lost(form: Format) -> CancelledDigits:
    """Return the errors of 1 - eps, eps being that of full accuracy, for the octaves from 1/4 to the last bit of eps.

    eps, between 1/2 and 1, is rounded to a multiple of u = 2^-p: it is off by up to u/2, and so is the difference.
    """
    epsilon, kind = naive(form)["full"], type_of(form)
    found = []
    for octave in range(2, form.precision):
        # 1 - eps is 1.1534 v*^2, nearly, so that the octaves meet, nearly.
        low, high = (math.log(2.0**-e / 1.1534) / 2 for e in (octave, octave - 1))
        x = np.exp(np.random.default_rng(octave).uniform(low, high, SWEEP)).astype(kind).astype(float)
        errors, loss = naive_errors(form, epsilon, x), double.one_minus_epsilon(x)
        found.append((x[np.argmax(errors)], errors.max(), np.max(errors * loss) * 2.0 ** (form.precision + 1)))
    return CancelledDigits(*(np.array(part) for part in zip(*found, strict=True)))


# --- quotients of polynomials, evaluated exactly ----------------------------------------------------------------------


class PlainQuotient(NamedTuple):
    """N/D with ascending coefficients; `error` is the largest one on the quotient's interval, if it is known."""

    name: str
    a: tuple[Fraction, ...]
    b: tuple[Fraction, ...]
    error: float = math.nan

    def loss_error(self, v_star: Fraction) -> float:
        """Return the relative error of 1 - N/D."""
        top, bottom = (sum((c * v_star**i for i, c in enumerate(part)), Fraction(0)) for part in (self.a, self.b))
        return float(abs((bottom - top) / bottom / exact_losses(v_star).loss - 1))


def printed_quotients(*, off: bool = False) -> Iterator[PlainQuotient]:
    """Yield the paper's approximants with printed coefficients; if `off`, a_1 is one more in its last digit."""
    for (m, n), (a, b) in TABLE.items():
        if m:
            first, *rest = (fraction(c) for c in a[1:])
            more = last_digit(a[1])
            top = fraction(a[0]), first + (Fraction(more) if off else 0), *rest
            end = f"a_1 + {more:f}" if off else "as printed"
            yield PlainQuotient(f"Padé [{m}/{n}], {end}", top, tuple(fraction(c) for c in b))


def best() -> Iterator[PlainQuotient]:
    """Yield best approximants with machine numbers."""
    for m, n in exported.MINIMAX[:2]:
        for form in FORMATS.values():
            found = exported.minimax_fit(m, n, form)
            yield PlainQuotient(f"best [{m}/{n}], {form.name}", *found.exact, found.error)


# --- the case ---------------------------------------------------------------------------------------------------------

ELASTIC = {DOUBLE: 5e-9, FLOAT: 1e-4}  # 1 - eps is less than half of the numbers' distance below 1

ErrorsByWay = dict[LossFunction, list[tuple[float, float]]]


def run(thorough: bool) -> Outcome:
    """Compare all functions with the exact ones."""
    exponents = EXPONENTS if thorough else EXPONENTS[::2]
    speeds = sorted({V_STAR, *(float(f"1e-{k}") for k in exponents)}, reverse=True)
    errors = {way: [way.error(v_star) for v_star in speeds] for way in ways()}
    here = {way: found[speeds.index(V_STAR)] for way, found in errors.items()}
    tables = (_at(here), _naive_table(), _formulas())
    return Outcome(_summary(here), tables, tuple(_charts(errors, speeds)), tuple(_checks(errors, here)))


def _checks(errors: ErrorsByWay, here: Mapping[LossFunction, tuple[float, float]]) -> Iterator[Check]:
    worst = max(ratio for _, ratio in here.values() if not math.isnan(ratio))
    statement = (
        f"at v* = {V_STAR:g} largest error of 1 - eps, relative to its bound (proven; sampled for the function on "
        "NumPy arrays)"
    )
    yield Check.within(statement, worst)
    worst = max(ratio for found in errors.values() for _, ratio in found if not math.isnan(ratio))
    yield Check.within("the same at all v* tried, from 0.1 to 1e-160", worst)
    for form in FORMATS.values():
        statement = (
            f"type {form.name}: in every octave of 1 - eps the subtraction of a correctly rounded eps from 1 errs by "
            "u/4 or more somewhere: least of the largest errors, in u/2"
        )
        yield Check(statement, float(np.min(lost(form).share)), ">=", 0.5)
        error = float(naive_errors(form, naive(form)["full"], np.array([ELASTIC[form]]))[0])
        statement = (
            f"type {form.name}: at v* = {ELASTIC[form]:g}, where 1 - eps < u/2, the subtraction returns 0: its "
            "relative error"
        )
        yield Check(statement, error, "==", 1)
    worst = max(q.loss_error(Fraction(V_STAR)) / q.error for q in best())
    statement = (
        f"machine coefficients keep a_1 = b_1: at v* = {V_STAR:g} error of 1 - eps of best quotients, evaluated "
        "exactly, relative to the largest sampled error on their interval (2 % for the sampling)"
    )
    yield Check(statement, worst, "<=", 1.02)


def _at(here: Mapping[LossFunction, tuple[float, float]]) -> ResultTable:
    rows = []
    for way, (error, ratio) in here.items():
        where = V_STAR
        if math.isnan(error):  # the least that is stated
            where = float(f"{way.low * 1.1:.1e}")
            error, ratio = way.error(where)
        numbers = f"{where:g}", f"{error:.2e}", f"{float(way.relative):.2e}", f"{ratio:.3f}"
        rows.append((way.kernel, way.form.name, way.gives, *numbers))
    header = ("kernel", "type", "gives", "v*", "relative error", "bound", "error/bound")
    return ResultTable("1 - eps of the kernels that return it", header, tuple(rows))


def _naive_table() -> ResultTable:
    rows = []
    for form in FORMATS.values():
        for name, epsilon in naive(form).items():
            for v_star in (1e-1, 1e-2, 1e-4, 1e-6, V_STAR, 1e-9):
                x = np.array([v_star]).astype(type_of(form))
                difference = float((1 - epsilon(x))[0])
                true = float(double.one_minus_epsilon(float(x[0])))
                numbers = f"{difference:.6e}", f"{true:.6e}", f"{abs(difference / true - 1):.1e}"
                rows.append((name, form.name, f"{v_star:g}", *numbers))
    header = ("eps by", "type", "v*", "1 - eps, naive", "1 - eps, exact", "relative error")
    return ResultTable("Cancellation in the subtraction 1 - eps(v*)", header, tuple(rows))


def _formulas() -> ResultTable:
    at = [Fraction(text) for text in ("1e-2", "1e-4", "1e-8", "1e-16")]
    rows = tuple(
        (q.name, *(f"{q.loss_error(v_star):.2e}" for v_star in at))
        for q in (*printed_quotients(), *printed_quotients(off=True), *best())
    )
    header = ("formula", *(f"v* = {float(v_star):g}" for v_star in at))
    return ResultTable("Relative error of 1 - N/D, evaluated exactly", header, rows)


_SHOWN = ("viscopade.one_minus_epsilon", "full", "half-line 1e-5", "half-line 1e-7")


def _charts(errors: ErrorsByWay, speeds: Sequence[float]) -> Iterator[Chart]:
    for form, least in ((DOUBLE, 1e-30), (FLOAT, 1e-19)):
        swept = lost(form)
        expected = 2.0 ** -(form.precision + 1) / double.one_minus_epsilon(swept.v_star)
        curves = [
            curve("1 - eps(v*), worst of an octave", swept.v_star, swept.worst, "points"),
            curve("u/2 over 1 - eps", swept.v_star, expected, "bound"),
        ]
        for way, found in errors.items():
            if way.kernel in _SHOWN and way.form == form:
                shown = [(v, e) for v, (e, _) in zip(speeds, found, strict=True) if e > 0 and v >= least]
                curves.append(curve(way.kernel, [v for v, _ in shown], [e for _, e in shown]))
        yield Chart(f"Relative error of 1 - eps, type {form.name}", r"$v_\ast$", "relative error", tuple(curves))
    at = [Fraction(10) ** -k for k in range(1, 13)]
    chosen = [
        q
        for q in (*printed_quotients(), *printed_quotients(off=True), *best())
        if q.name.startswith(("Padé [3/6]", "best [3/7]"))
    ]
    curves = [curve(q.name, at, [q.loss_error(v_star) for v_star in at]) for q in chosen]
    yield Chart("1 - N/D, evaluated exactly", r"$v_\ast$", "relative error of 1 - eps", tuple(curves))


def _summary(here: Mapping[LossFunction, tuple[float, float]]) -> str:
    stated = {way: found for way, found in here.items() if not math.isnan(found[0])}
    worst = max(stated, key=lambda way: stated[way][1])
    error = float(naive_errors(DOUBLE, naive(DOUBLE)["full"], np.array([V_STAR]))[0])
    off = list(printed_quotients(off=True))[-1]
    own = next(found[0] for way, found in here.items() if (way.kernel, way.form) == ("full", DOUBLE))
    return (
        f"At v* = {V_STAR:g}, where 1 - eps = {float(exact_losses(Fraction(V_STAR)).loss):.4g}, {len(stated)} "
        f"functions of 1 - eps or 1 - eps^2 state a bound; the nearest to it is {worst.kernel}, type "
        f"{worst.form.name}, with {stated[worst][1]:.3f} of it. The kernel of full accuracy errs by {own:.1e}. The "
        f"naive 1 - eps(v*) of a correctly rounded eps errs by {error:.1%} there, by {lost(DOUBLE).worst[-1]:.1%} for "
        f"a neighbour in its octave, and by 100% where 1 - eps < 2^-54. {off.name}, one more in the last printed "
        f"digit, errs by a factor of {off.loss_error(Fraction(V_STAR)):.3g} there even if it is evaluated exactly: 1 "
        "- eps ~ v*^2 needs a_1 = b_1, which the coefficients printed in the paper have, and ours in both types."
    )


CASE = Case(
    "near-elastic",
    "Nearly elastic collisions: digits of 1 - eps",
    "1 - eps at v* = 1e-8, and from 1e-1 down to 1e-160: no function that returns 1 - eps may lose digits to "
    "cancellation. The case also measures the digits that the subtraction of a computed eps from 1 loses.",
    run,
)
