r"""Kernels of eps(v*) and 1 - eps(v*) to the last place: tables of machine numbers, and proof of a bound in ulp.

The tables hold the smaller of the two functions, p <= 1/2 (nearly); the other is 1 - p. Panels are the halves of the
panels of `double`, 16 to an octave of v*. Their polynomials are those of `double` in the Chebyshev basis, truncated
after T_n. With t the distance from the panel's centre, which is exact:

- type float evaluates p = a_0 + t (a_1 + …) in type double and rounds once more;
- type double evaluates s + (rest), where s = a_0 + a_1 t_1 is exact: a_0, a_1 and t_1 are cut to few bits, and what
  they lack is in the rest.

Below v* = 2^-4, 1 - eps = v*^2 (c + v*^2 (…)), in type double with a product c v*^2 in two parts. From 2^FOLD on, v* is
divided by a power of 8 (`double`). The bounds hold with and without FMA contraction.

`evaluated_in` returns in Python, bit by bit, the result of the C code without FMA contraction. `certificate` bounds,
over every panel, the error of the table it is made from, the exact difference of the polynomials, and all rounding
errors of that sequence of operations, in ball arithmetic.
"""

from __future__ import annotations

import math
import struct
from collections.abc import Iterator, Sequence
from fractions import Fraction
from functools import cache, lru_cache
from typing import Any, NamedTuple

import numpy as np
from flint import arb, fmpq, fmpq_poly

from viscopade.arithmetic.balls import exact_middle, working
from viscopade.arithmetic.chebyshev import cut, greatest, to_fmpq, to_fraction
from viscopade.arithmetic.formats import DOUBLE, FLOAT, FORMATS, Format
from viscopade.arrays.panels import CENTRES, DATA, FIRST, FOLD, HALF_WIDTHS, PANELS
from viscopade.arrays.panels import SPLIT as COARSE
from viscopade.collision import panel_proof
from viscopade.collision.panel_proof import PanelRow
from viscopade.kernels.expressions import Arithmetic, CodeBranch, Run, evaluate
from viscopade.kernels.forms import formulas
from viscopade.kernels.rounding import Rounded, arithmetic, half_unit
from viscopade.progress import track
from viscopade.store import recorded

FUNCTIONS = ("epsilon", "one_minus_epsilon")

TABLE_ERROR = Fraction(panel_proof.proven_error())
"""Proven bound of the relative error of the polynomials of `double` for eps and 1 - eps."""
FOLD_ERROR = Fraction(1, 2**59)
"""Bound of the relative error of eps(8^n s) = 2^(-10 n) eps(s), s >= 2^FOLD: twice `panel_proof.tail` there is less."""

PERIOD = 3  # octaves
SPLIT = COARSE + 1  # 2^SPLIT panels to an octave
OCTAVES = FOLD + PERIOD - FIRST
NEAR = Fraction(2) ** FIRST  # below, the functions are expanded around 0
LARGEST = {"double": 324, "float": 46}  # at 2^this and beyond eps rounds to 0
CLEARED = 26  # bits of v* that t_1 lacks
CENTRE_BITS = 16  # of v* in the leading product of (1 - eps) below NEAR
FACTOR_BITS = 21  # of c in that product; 2 CENTRE_BITS + FACTOR_BITS = 53
TINY, LIFT = -400, 200  # v* < 2^TINY is multiplied by 2^LIFT before it is squared

DEGREES = {"double": 10, "float": 9}
NEAR_DEGREES = {"double": 8, "float": 7}  # of the polynomial that v*^4 is multiplied by

_BITS = 128  # of ball arithmetic
_PARTS = 4  # a panel is cut into, where errors are bounded
_U = Fraction(1, 2**53)


# --- the functions to approximate -------------------------------------------------------------------------------------


class SmallerOnPanel(NamedTuple):
    """The smaller of eps and 1 - eps on a panel centre ± half, as a polynomial in z = (v* - centre)/half."""

    centre: Fraction
    half: Fraction
    elastic: bool
    """Whether it is 1 - eps that is the smaller one, at the centre."""
    p: fmpq_poly


def table_row(function: str, index: int) -> PanelRow:
    """Return the row of the table of `double` for one of `FUNCTIONS` on one of its panels."""
    return panel_proof.panel_rows()[function, index]


def _polynomial(name: str, index: int) -> fmpq_poly:
    row = table_row(name, index)
    return fmpq_poly(list(row.a)) * fmpq(2) ** row.exponent


@lru_cache(maxsize=1)
def smaller_panels() -> tuple[SmallerOnPanel, ...]:
    """Return the panels from `NEAR` to 2^(FOLD + PERIOD); panels where 1 - eps is smaller than eps come first."""
    found = []
    for index in range(1, PANELS):
        loss = _polynomial("one_minus_epsilon", index)
        elastic = bool(loss[0] < fmpq(1, 2))
        p = loss if elastic else _polynomial("epsilon", index)
        centre, half = Fraction(CENTRES[index]), Fraction(HALF_WIDTHS[index])
        for side in (-1, 1):
            part = fmpq_poly([fmpq(side, 2), fmpq(1, 2)])
            found.append(SmallerOnPanel(centre + side * half / 2, half / 2, elastic, p(part)))
    return tuple(found)


@lru_cache(maxsize=1)
def switch() -> int:
    """Return the number of elastic panels, where 1 - eps is smaller than eps; they come first."""
    return sum(panel.elastic for panel in smaller_panels())


def _ratio() -> fmpq_poly:
    """Return (1 - eps)/v*^2 on [0, NEAR], a polynomial in z = v*/NEAR."""
    loss = _polynomial("one_minus_epsilon", 0)
    if loss[0] or loss[1]:
        raise ValueError(f"{DATA}: 1 - eps is not quadratic at 0")
    return fmpq_poly(loss.coeffs()[2:]) / to_fmpq(NEAR**2)


# --- polynomials ------------------------------------------------------------------------------------------------------

_UNIT = fmpq_poly([fmpq(1, 2), fmpq(1, 2)])  # [-1, 1] onto [0, 1]
_BACK = fmpq_poly([-1, 2])


def _coefficients(p: fmpq_poly, half: Fraction, count: int) -> list[Fraction]:
    """Return the coefficients with respect to t = half z."""
    return [to_fraction(p[n]) / half**n for n in range(count)]


def _scaled(coefficients: Sequence[float], half: Fraction) -> fmpq_poly:
    """Return the polynomial in z whose coefficients with respect to t = half z are given."""
    return fmpq_poly([to_fmpq(Fraction(c) * half**n) for n, c in enumerate(coefficients)])


# --- tables of machine numbers ----------------------------------------------------------------------------------------


class DoubleRow(NamedTuple):
    """A row for type double: eps - base = a0_high + a1_high t_1 + (a0_low + a1_high t_2 + a1_low t + a_2 t^2 + …).

    t = t_1 + t_2 = v* - centre; base is 1 where the panel is elastic, 0 elsewhere.
    """

    centre: float
    a0_high: float
    a1_high: float
    a0_low: float
    a1_low: float
    a: tuple[float, ...]

    @property
    def numbers(self) -> tuple[float, ...]:
        """The numbers of the row."""
        return (*self[:-1], *self.a)


class Near(NamedTuple):
    """Expansion below `NEAR`: 1 - eps = v*^2 (c + v*^2 (a_0 + a_1 v* + …)), c = c_high + c_low."""

    c_high: float
    c_low: float
    a: tuple[float, ...]


def exponent(number: Fraction) -> int:
    """Return e with 2^e <= |number| < 2^(e + 1)."""
    e = abs(number.numerator).bit_length() - number.denominator.bit_length()
    return e if abs(number) >= Fraction(2) ** e else e - 1


def _to_multiple(number: Fraction, unit: Fraction) -> float:
    return float(round(number / unit) * unit)


@recorded
def double_rows() -> tuple[DoubleRow, ...]:
    """Return the table of type double: a row for [0, NEAR], which only eps uses, then one for each panel."""
    return (_double_row_near(), *(_double_row(panel) for panel in smaller_panels()))


def _double_row_near() -> DoubleRow:
    ratio = cut(_ratio()(_UNIT), DEGREES["double"] - 2)(_BACK)
    a = _coefficients(-ratio, NEAR, DEGREES["double"] - 1)
    return DoubleRow(0.0, 0.0, 0.0, 0.0, 0.0, tuple(map(DOUBLE.nearest, a)))


def _double_row(panel: SmallerOnPanel) -> DoubleRow:
    p = cut(-panel.p if panel.elastic else panel.p, DEGREES["double"])
    a0, a1, *a = _coefficients(p, panel.half, DEGREES["double"] + 1)
    unit = Fraction(2) ** (exponent(abs(a0) + abs(a1) * panel.half) - 52)
    high = _to_multiple(a0, unit)
    slope = _to_multiple(a1, unit / _step(panel))
    low, rest = DOUBLE.nearest(a0 - Fraction(high)), DOUBLE.nearest(a1 - Fraction(slope))
    return DoubleRow(float(panel.centre), high, slope, low, rest, tuple(map(DOUBLE.nearest, a)))


def _step(panel: SmallerOnPanel) -> Fraction:
    """Return the distance of neighbouring values of t_1."""
    return Fraction(2) ** (exponent(panel.centre) - 52 + CLEARED)


@recorded
def float_rows() -> tuple[tuple[float, ...], ...]:
    """Return a_0, a_1, … of p in powers of t = v* - centre for every panel, for type float."""
    return tuple(map(_float_row, smaller_panels()))


def _float_row(panel: SmallerOnPanel) -> tuple[float, ...]:
    degree = DEGREES["float"]
    return tuple(map(DOUBLE.nearest, _coefficients(cut(panel.p, degree), panel.half, degree + 1)))


@cache
def near(form: str) -> Near:
    """Return the expansion around v* = 0 for type "double" or "float" (there c_low is 0)."""
    ratio = _ratio()
    c = to_fraction(ratio[0])
    rest = fmpq_poly(ratio.coeffs()[2:])  # without z, whose coefficient is 0 but for the table's error
    degree = NEAR_DEGREES[form]
    shortened = cut(rest(_UNIT), degree)(_BACK) / to_fmpq(NEAR**2)
    a = tuple(map(DOUBLE.nearest, _coefficients(shortened, NEAR, degree + 1)))
    if form == "float":
        return Near(DOUBLE.nearest(c), 0.0, a)
    high = _to_multiple(c, Fraction(2) ** (1 - FACTOR_BITS))
    return Near(high, DOUBLE.nearest(c - Fraction(high)), a)


# --- the sequence of operations ---------------------------------------------------------------------------------------

DOUBLE_NAMES = tuple(f"a[{n}]" for n in range(DEGREES["double"] + 4))
FLOAT_NAMES = tuple(f"a[{n}]" for n in range(DEGREES["float"] + 1))


def panel_branch(form: str) -> CodeBranch:
    """Return what the code of a type computes on a panel."""
    return (
        formulas.full_panel_branch(DOUBLE_NAMES) if form == "double" else formulas.full_panel_float_branch(FLOAT_NAMES)
    )


def near_branch(form: str) -> CodeBranch:
    """Return what the code of a type computes of 1 - eps below `NEAR`."""
    names = [f"a{n}" for n in range(NEAR_DEGREES[form] + 1)]
    return formulas.full_near_branch(names) if form == "double" else formulas.full_near_float_branch(names)


def near_constants(form: str) -> dict[str, float]:
    """Return the constants of `near_branch` by name."""
    at = near(form)
    leading = {"c_high": at.c_high, "c_low": at.c_low} if form == "double" else {"c": at.c_high}
    return leading | {f"a{n}": c for n, c in enumerate(at.a)}


_FLOATS = Arithmetic(float)


def _in_double(branch: CodeBranch, result: str, **given: Any) -> float:
    """Return what a branch gives in type double, without FMA contraction."""
    found: float = evaluate(branch.results[result], Run(branch.program, given, _FLOATS), _FLOATS)
    return found


def _near_double(v_star: float) -> float:
    tiny = v_star < 2.0**TINY
    w = v_star * (2.0**LIFT if tiny else 1.0)
    inputs = {"v_star": v_star, "w": w, "high": _cleared(w, 53 - CENTRE_BITS)}
    value = _in_double(near_branch("double"), "result", **inputs, **near_constants("double"))
    return value * (2.0 ** (-2 * LIFT) if tiny else 1.0)


def _cleared(x: float, bits: int) -> float:
    """Return x with the last bits of its significand set to 0."""
    (pattern,) = struct.unpack("<q", struct.pack("<d", x))
    (cleared,) = struct.unpack("<d", struct.pack("<q", pattern >> bits << bits))
    return float(cleared)


def evaluated_in(form: str, function: str, v_star: float) -> float:
    """Return the kernel's result in this type without FMA contraction.

    Parameters
    ----------
    form : str
        "double" or "float".
    function : str
        One of `FUNCTIONS`.
    v_star : float
        Of that type.
    """
    _check(form, function)
    if not v_star >= 0.0:
        return math.nan
    x, loss = abs(v_star), function == "one_minus_epsilon"
    largest = FOLD if loss else LARGEST[form]
    x = min(x, 2.0**largest)
    folds = max(math.frexp(x)[1] - 1 - FOLD, 0) // PERIOD
    value = (_double if form == "double" else _float)(loss, math.ldexp(x, -PERIOD * folds))
    value *= 2.0 ** (-10 * folds)
    return value if form == "double" else float(np.float32(value))


def _double(loss: bool, x: float) -> float:
    if loss and x < NEAR:
        return _near_double(x)
    index = 1 + _panel(x) if x >= NEAR else 0
    row, first = double_rows()[index], _cleared(x, CLEARED)
    inputs = dict(zip(DOUBLE_NAMES, row.numbers, strict=True))
    inputs |= {"t": x - row.centre, "t1": first - row.centre, "t2": x - first}
    values = Run(panel_branch("double").program, inputs, _FLOATS)
    sign, base = (-1.0 if loss else 1.0), float((index <= switch()) != loss)
    signed = {"base": base, "sum": sign * values["exact"], "rest": sign * values["rest"]}
    return _in_double(panel_branch("double"), "result", **signed)


def _float(loss: bool, x: float) -> float:
    if x < NEAR:
        p, elastic = _in_double(near_branch("float"), "result", t=x, **near_constants("float")), True
    else:
        index = _panel(x)
        elastic = index < switch()
        inputs = dict(zip(FLOAT_NAMES, float_rows()[index], strict=True))
        p = _in_double(panel_branch("float"), "p", t=x - float(smaller_panels()[index].centre), **inputs)
    return p if loss == elastic else 1.0 - p


def _panel(x: float) -> int:
    """Return the index of the panel that NEAR <= x < 2^(FOLD + PERIOD) is on."""
    fraction, exponent = math.frexp(x)
    return ((exponent - 1 - FIRST) << SPLIT) + int((2 * fraction - 1) * 2**SPLIT)


def _check(form: str, function: str) -> None:
    if form not in FORMATS:
        raise ValueError(f"form is {form!r}: accepted are {', '.join(FORMATS)}")
    if function not in FUNCTIONS:
        raise ValueError(f"function is {function!r}: accepted are {', '.join(FUNCTIONS)}")


# --- bounds of rounding errors ----------------------------------------------------------------------------------------


def _between(low: Fraction, high: Fraction) -> Rounded:
    """Return an exact number of type double between two bounds."""
    return Rounded(_arb(low).union(_arb(high)), DOUBLE)


def _numbers(names: Sequence[str], values: Sequence[float]) -> dict[str, Rounded]:
    return {name: Rounded(arb(c), DOUBLE) for name, c in zip(names, values, strict=True)}


def _run(branch: CodeBranch, given: dict[str, Rounded]) -> Run:
    return Run(branch.program, given, arithmetic(DOUBLE))


def _arb(number: Fraction) -> arb:
    """Return a fraction whose denominator is a power of 2."""
    return arb(number.numerator) / arb(number.denominator)


def _above(ball: arb) -> arb:
    """Return an exact upper bound."""
    return arb(ball.upper())


def _magnitude(ball: arb) -> arb:
    return arb(ball.abs_upper())


def _ulp(least: arb, form: Format) -> arb:
    """Return the unit in the last place of numbers from `least` on (in the normal range)."""
    return arb(2) ** (exponent(exact_middle(arb(least.lower()))) - form.precision + 1)


class UlpBound(NamedTuple):
    """A bound of the error over a part of the half-line, in ulp (units in the last place) of the true value."""

    low: Fraction
    high: Fraction
    ulp: Fraction


@recorded
def ulp_bounds(form: str, function: str) -> tuple[UlpBound, ...]:
    """Return bounds of the error for all v* >= 0 with a result in the normal range, panel by panel.

    Those from 2^FOLD on hold for all larger v*, too. The bounds are proven (docs/reference/full-kernels.md).
    """
    _check(form, function)
    loss = function == "one_minus_epsilon"
    bound = _double_bound if form == "double" else _float_bound
    with working(_BITS):
        found = [UlpBound(Fraction(0), NEAR, _near_bound(form, loss))]
        for index in track(range(len(smaller_panels())), f"error bounds of type {form}"):
            panel = smaller_panels()[index]
            found.append(UlpBound(panel.centre - panel.half, panel.centre + panel.half, bound(index, loss)))
    return tuple(found)


def _in_ulp(error: arb, least: arb, form: Format) -> Fraction:
    """Return the bound of a result that is rounded once after it had `error`.

    Where `error`, less than an ulp, moves it up across a power of 2, it is rounded to this power.
    """
    return Fraction(1, 2) + exact_middle(_above(_above(error) / _ulp(least, form)))


def _parts(panel: SmallerOnPanel) -> Iterator[tuple[Fraction, Fraction]]:
    for n in range(_PARTS):
        low, high = (panel.half * Fraction(2 * m - _PARTS, _PARTS) for m in (n, n + 1))
        yield low, high


def _values(panel: SmallerOnPanel, low: Fraction, high: Fraction) -> arb:
    """Enclose p for t between two bounds."""
    z = _arb(low / panel.half).union(_arb(high / panel.half))
    total = arb(0)
    for c in reversed(panel.p.coeffs()):
        total = total * z + arb(c)
    return total


def _given_error(panel: SmallerOnPanel, difference: Fraction, values: arb) -> arb:
    """Return a bound of the machine polynomial's error: its own, and that of what it approximates."""
    relative = TABLE_ERROR + (FOLD_ERROR if panel.centre > 2**FOLD else 0)
    return _arb_above(difference) + _magnitude(values) * _arb(relative) * (1 + 2 * _arb(relative))


def _arb_above(number: Fraction) -> arb:
    return _above(arb(to_fmpq(number)))


def _double_bound(index: int, loss: bool) -> Fraction:
    panel, row = smaller_panels()[index], double_rows()[1 + index]
    sign = -1 if panel.elastic else 1
    _check_head(panel, row)
    low_part = [row.a0_low, row.a1_low]
    machine = _scaled([row.a0_high, row.a1_high], panel.half) + _scaled([*low_part, *row.a], panel.half)
    difference = greatest(machine * sign - panel.p)
    return max(_double_part(panel, row, difference, loss, *part) for part in _parts(panel))


def _check_head(panel: SmallerOnPanel, row: DoubleRow) -> None:
    """Check that a0_high + a1_high t_1 and both its operations are exact: multiples of one unit below 2^53 of it."""
    high, slope, step = Fraction(row.a0_high), Fraction(row.a1_high), _step(panel)
    unit = Fraction(2) ** (exponent(abs(high) + abs(slope) * panel.half) - 52)
    reach = abs(high) + abs(slope) * (panel.half + step)
    if (high / unit).denominator != 1 or (slope * step / unit).denominator != 1 or reach > 2**53 * unit:
        raise ArithmeticError(f"the leading part is not exact on the panel around {float(panel.centre)}")


def _double_part(
    panel: SmallerOnPanel, row: DoubleRow, difference: Fraction, loss: bool, low: Fraction, high: Fraction
) -> Fraction:
    values = _values(panel, low, high)
    given = _given_error(panel, difference, values)
    numbers = _numbers(DOUBLE_NAMES, row.numbers) | {
        "t": _between(low, high),
        "t2": _between(Fraction(0), _step(panel)),
    }
    if loss == panel.elastic:
        return _in_ulp(_run(panel_branch("double"), numbers)["rest"].absolute + given, values, DOUBLE)
    # The leading part's sum with 1 leaves at most half an ulp of 1 to be added to the rest.
    numbers["lost"] = Rounded(arb(0, half_unit(arb(1), DOUBLE)), DOUBLE)
    added = _run(panel_branch("double"), numbers)
    return _in_ulp((added["lost"] + added["rest"]).absolute + given, 1 - values, DOUBLE)


def _float_bound(index: int, loss: bool) -> Fraction:
    panel, a = smaller_panels()[index], float_rows()[index]
    difference = greatest(_scaled(a, panel.half) - panel.p)
    return max(_float_part(panel, a, difference, loss, *part) for part in _parts(panel))


def _float_part(
    panel: SmallerOnPanel, a: Sequence[float], difference: Fraction, loss: bool, low: Fraction, high: Fraction
) -> Fraction:
    branch, numbers = panel_branch("float"), _numbers(FLOAT_NAMES, a) | {"t": _between(low, high)}
    p = evaluate(branch.results["p"], _run(branch, numbers), arithmetic(DOUBLE))
    values = _values(panel, low, high)
    error = p.absolute + _given_error(panel, difference, values)
    if loss == panel.elastic:
        return _in_ulp(error, values, FLOAT)
    return _in_ulp(error + half_unit(arb(1), DOUBLE), 1 - values, FLOAT)


def _near_bound(form: str, loss: bool) -> Fraction:
    """Bound the error on [0, NEAR], relative to v*^2 where 1 - eps is wanted."""
    ratio = _ratio()
    least = arb(ratio[0]) - _arb_above(greatest((ratio - ratio[0])(_UNIT)))
    most = _above(2 * arb(ratio[0]) - least)
    given = most * _arb(TABLE_ERROR)
    if form == "double" and not loss:
        return _double_bound_near_one(given)
    at = near(form)
    c = Fraction(at.c_high) + Fraction(at.c_low)
    machine = fmpq_poly([to_fmpq(c), 0, *(_scaled(at.a, NEAR) * to_fmpq(NEAR**2)).coeffs()])
    given += _arb_above(greatest((machine - ratio)(_UNIT)))
    x, constants = _between(Fraction(0), NEAR), near_constants(form)
    variable = "v_star" if form == "double" else "t"
    numbers = _numbers(list(constants), list(constants.values())) | {variable: x}
    branch = near_branch(form)
    factor = evaluate(branch.results["factor"], _run(branch, numbers), arithmetic(DOUBLE))
    if form == "double":
        return _relative_in_ulp(_product_error(at, factor) + given, least, DOUBLE)
    error = factor.absolute + _arb(_U) * (_magnitude(factor.value) + factor.absolute) + given  # v*^2 has 48 bits
    if loss:
        return _relative_in_ulp(error, least, FLOAT)
    absolute = error * _arb(NEAR**2) + half_unit(arb(1), DOUBLE)
    return _in_ulp(absolute, 1 - most * _arb(NEAR**2), FLOAT)


def _relative_in_ulp(error: arb, least: arb, form: Format) -> Fraction:
    """Like `_in_ulp`, for errors in units of v*^2, of which `least` is the smallest value."""
    lost: Fraction = exact_middle(_above(_above(error) / least)) * 2**form.precision
    # Intermediate results that underflow are below 2^-60 ulp of a result of at least 2^(2 TINY).
    return Fraction(1, 2) + lost + Fraction(1, 2**60)


def _product_error(at: Near, rest: Rounded) -> arb:
    """Bound the error of c_high (w^2 - high^2) + w^2 rest, with the rounding of this sum, in units of w^2."""
    u = _arb(_U)
    tail = _arb(Fraction(at.c_high)) * arb(2) ** (2 - CENTRE_BITS)
    other = _magnitude(rest.value) + rest.absolute
    error = tail * ((1 + u) ** 3 - 1) + rest.absolute + other * ((1 + u) ** 2 - 1)
    return error + u * (tail + other + error)


def _double_bound_near_one(given: arb) -> Fraction:
    """Bound the error of eps on [0, NEAR], from the table's first row."""
    row = double_rows()[0]
    machine = fmpq_poly([to_fmpq(-Fraction(c) * NEAR**n) for n, c in enumerate(row.a)])
    given = (given + _arb_above(greatest((machine - _ratio())(_UNIT)))) * _arb(NEAR**2)
    x = _between(Fraction(0), NEAR)
    numbers = _numbers(DOUBLE_NAMES, row.numbers) | {"t": x, "t2": x}
    rest = _run(panel_branch("double"), numbers)["rest"]
    return _in_ulp(rest.absolute + given, 1 - _magnitude(rest.value) * 2, DOUBLE)


def certificate(form: str, function: str) -> dict[str, Any]:
    """Return the proven bounds of the error, as data for JSON.

    Parameters
    ----------
    form : str
        "double" or "float".
    function : str
        One of `FUNCTIONS`.

    Returns
    -------
    dict
        "panels" with "low", "high" and "ulp" (a bound in units in the last place of the true value, rounded up to a
        double); "maximum", the largest; "underflow", the bound in the smallest unit where results are denormal.

    Raises
    ------
    ValueError
        For an unknown form or function.
    """
    found = [(bound, _float_above(bound.ulp)) for bound in ulp_bounds(form, function)]
    maximum = max(ulp for _, ulp in found)
    return {
        "form": form,
        "function": function,
        "unit": "ulp of the true value",
        "claim": "proven",
        "table_error": str(TABLE_ERROR),
        "fold_error": str(FOLD_ERROR),
        "contraction": "holds with and without fused multiplications",
        "maximum": maximum,
        "underflow": _float_above(Fraction(1, 2) + Fraction(maximum) / 2) if form == "double" else maximum,
        "panels": [{"low": float(bound.low), "high": float(bound.high), "ulp": ulp} for bound, ulp in found],
    }


def _float_above(number: Fraction) -> float:
    nearest = float(number)
    return nearest if Fraction(nearest) >= number else math.nextafter(nearest, math.inf)
