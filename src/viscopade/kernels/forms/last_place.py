r"""Kernels of eps(v*) and 1 - eps(v*) to the last place: tables of machine numbers, and proof of a bound in ulp.

The tables hold the smaller of the two functions, p <= 1/2 (nearly); the other is 1 - p. Panels are the halves of the
panels of `double`, 16 to an octave of v*. Their polynomials are those of `double` in the Chebyshev basis, truncated
after T_n. With t the distance from the panel's centre, which is exact:

- type float evaluates p = a_0 + t (a_1 + …) in type double and rounds once more;
- type double evaluates s + (rest), where s = a_0 + a_1 t_1 is exact: a_0, a_1 and t_1 are cut to few bits, and what
  they lack is in the rest.

Below v* = 2^-4, 1 - eps = v*^2 (c + v*^2 (…)), in type double with a product c v*^2 in two parts. From 2^FOLD on, v* is
divided by a power of 8 (`double`). The bounds hold with and without FMA contraction.

`evaluated_in` returns in Python, bit by bit, the results of the C code without FMA contraction. `ulp_bounds` are, over
every panel, of the error of the table it is made from, the exact difference of the polynomials, and all rounding
errors of that sequence of operations, in ball arithmetic.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from fractions import Fraction
from functools import cache
from itertools import pairwise, product
from typing import Any, NamedTuple

import numpy as np
from flint import arb, arb_poly, fmpq, fmpq_poly

from viscopade.arithmetic.balls import ball_of, exact_middle, working
from viscopade.arithmetic.chebyshev import cut, greatest, to_fmpq, to_fraction
from viscopade.arithmetic.formats import DOUBLE, FLOAT, Format
from viscopade.arrays.panels import CENTRES, FIRST, FOLD, HALF_WIDTHS, PANELS, PERIOD
from viscopade.arrays.panels import SPLIT as COARSE
from viscopade.collision import panel_proof
from viscopade.collision.panel_proof import PanelRow
from viscopade.kernels.enclosure import exactly
from viscopade.kernels.expressions import (
    Call,
    CodeBranch,
    Expression,
    Literal,
    Name,
    Program,
    Select,
    Statement,
    TableRow,
    Word,
    evaluate,
    prepared,
    read,
)
from viscopade.kernels.forms import formulas
from viscopade.kernels.forms.bits import bits, count, cut_to, folded, from_bits, mask, power_of_two, smaller_word
from viscopade.kernels.machine import TYPES, computed, machine_arithmetic, run_on_row
from viscopade.kernels.rounding import Rounded, half_unit, of_branch
from viscopade.progress import track
from viscopade.store import recorded

FUNCTIONS = ("epsilon", "one_minus_epsilon")

TABLE_ERROR = Fraction(panel_proof.proven_error())
"""Proven bound of the relative error of the polynomials of `double` for eps and 1 - eps."""
FOLD_ERROR = Fraction(1, 2**59)
"""Bound of the relative error of eps(8^n s) = 2^(-10 n) eps(s), s >= 2^FOLD: twice `panel_proof.tail` there is less."""

SPLIT = COARSE + 1  # 2^SPLIT panels to an octave
NEAR = Fraction(2) ** FIRST  # below, the functions are expanded around 0
LARGEST = {DOUBLE: 324, FLOAT: 46}  # at 2^this and beyond eps rounds to 0
CLEARED = 26  # bits of v* that t_1 lacks
CENTRE_BITS = 16  # of v* in the leading product of (1 - eps) below NEAR
FACTOR_BITS = 21  # of c in that product; 2 CENTRE_BITS + FACTOR_BITS = 53
TINY, LIFT = -400, 200  # v* < 2^TINY is multiplied by 2^LIFT before it is squared

DEGREES = {DOUBLE: 10, FLOAT: 9}
NEAR_DEGREES = {DOUBLE: 8, FLOAT: 7}  # of the polynomial that v*^4 is multiplied by

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


@cache
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


@cache
def switch() -> int:
    """Return the number of elastic panels, where 1 - eps is smaller than eps; they come first."""
    return sum(panel.elastic for panel in smaller_panels())


def _ratio() -> fmpq_poly:
    """Return (1 - eps)/v*^2 on [0, NEAR], a polynomial in z = v*/NEAR."""
    return _over_square(_polynomial("one_minus_epsilon", 0))


def _over_square(loss: fmpq_poly) -> fmpq_poly:
    """Return 1 - eps over v*^2, polynomials in z = v*/NEAR."""
    if loss[0] or loss[1]:
        raise ValueError("1 - eps is not quadratic at 0")
    return fmpq_poly(loss.coeffs()[2:]) / to_fmpq(NEAR**2)


# --- polynomials ------------------------------------------------------------------------------------------------------

_UNIT = fmpq_poly([fmpq(1, 2), fmpq(1, 2)])  # [-1, 1] onto [0, 1]
_BACK = fmpq_poly([-1, 2])


def _cut_on_unit(p: fmpq_poly, degree: int) -> fmpq_poly:
    """Return the truncated Chebyshev expansion on [0, 1]."""
    return cut(p(_UNIT), degree)(_BACK)


def _greatest_on_unit(p: fmpq_poly) -> arb:
    """Return a bound of |p| on [0, 1]."""
    return _above(arb(to_fmpq(greatest(p(_UNIT)))))


def _coefficients(p: fmpq_poly, half: Fraction, count: int) -> list[Fraction]:
    """Return the coefficients with respect to t = half z."""
    return [to_fraction(p[n]) / half**n for n in range(count)]


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


def _to_multiple(number: Fraction, unit: Fraction) -> float:
    return float(round(number / unit) * unit)


@recorded("double_rows")
def double_rows() -> tuple[DoubleRow, ...]:
    """Return the table of type double: a row for [0, NEAR], which only eps uses, then one for each panel."""
    return (_double_row_near(), *(_double_row(panel) for panel in smaller_panels()))


def _double_row_near() -> DoubleRow:
    a = _coefficients(-_cut_on_unit(_ratio(), DEGREES[DOUBLE] - 2), NEAR, DEGREES[DOUBLE] - 1)
    return DoubleRow(0.0, 0.0, 0.0, 0.0, 0.0, tuple(map(DOUBLE.nearest, a)))


def _double_row(panel: SmallerOnPanel) -> DoubleRow:
    p = cut(-panel.p if panel.elastic else panel.p, DEGREES[DOUBLE])
    a0, a1, *a = _coefficients(p, panel.half, DEGREES[DOUBLE] + 1)
    unit = DOUBLE.ulp(abs(a0) + abs(a1) * panel.half)
    high = _to_multiple(a0, unit)
    slope = _to_multiple(a1, unit / _step(panel))
    low, rest = DOUBLE.nearest(a0 - Fraction(high)), DOUBLE.nearest(a1 - Fraction(slope))
    return DoubleRow(float(panel.centre), high, slope, low, rest, tuple(map(DOUBLE.nearest, a)))


def _step(panel: SmallerOnPanel) -> Fraction:
    """Return the distance of neighbouring values of t_1."""
    return DOUBLE.ulp(panel.centre) * Fraction(2) ** CLEARED


@recorded("float_rows")
def float_rows() -> tuple[tuple[float, ...], ...]:
    """Return a_0, a_1, … of p in powers of t = v* - centre for every panel, for type float."""
    degree = DEGREES[FLOAT]
    rows = (_coefficients(cut(panel.p, degree), panel.half, degree + 1) for panel in smaller_panels())
    return tuple(tuple(map(DOUBLE.nearest, row)) for row in rows)


@cache
def near_constants(form: Format) -> dict[str, float]:
    """Return the constants of `near_branch`: 1 - eps = v*^2 (c + v*^2 (a0 + a1 v* + …)), c = c_high + c_low."""
    ratio, degree = _ratio(), NEAR_DEGREES[form]
    c = to_fraction(ratio[0])
    rest = fmpq_poly(ratio.coeffs()[2:])  # without z, whose coefficient is 0 but for the table's error
    a = map(DOUBLE.nearest, _coefficients(_cut_on_unit(rest, degree) / to_fmpq(NEAR**2), NEAR, degree + 1))
    leading = {"c": DOUBLE.nearest(c)}
    if form == DOUBLE:
        high = _to_multiple(c, Fraction(2) ** (1 - FACTOR_BITS))
        leading = {"c_high": high, "c_low": DOUBLE.nearest(c - Fraction(high))}
    return leading | {f"a{n}": number for n, number in enumerate(a)}


# --- the sequence of operations ---------------------------------------------------------------------------------------

DOUBLE_NAMES = tuple(f"a[{n}]" for n in range(DEGREES[DOUBLE] + 4))
FLOAT_NAMES = tuple(f"a[{n}]" for n in range(DEGREES[FLOAT] + 1))
TABLE = {DOUBLE: "viscopade_full_table", FLOAT: "viscopade_full_tablef"}
_ONE = Literal("1.0")


def largest_bits(form: Format, function: str) -> Word:
    """Return the bits that larger ones are replaced by: there the function rounds to its limit."""
    return power_of_two(form, FOLD if function == "one_minus_epsilon" else LARGEST[form])


def near_bits(form: Format) -> Word:
    """Return the bits of `NEAR`."""
    return power_of_two(form, FIRST)


def fold_program(form: Format) -> Program:
    """Return the assignments from the bits of v* to those of s, and to eps(v*)/eps(s)."""
    return folded(form, FOLD, PERIOD)


def sums(form: Format) -> CodeBranch:
    """Return what the code of a type computes from the numbers of a panel's row."""
    if form == DOUBLE:
        return formulas.full_panel_branch(DOUBLE_NAMES)
    return formulas.full_panel_float_branch(FLOAT_NAMES)


def panel_branch(form: Format) -> CodeBranch:
    """Return what the code of a type computes from `bits`, below those of 2^(FOLD + PERIOD), and a panel's row.

    The result is 1 - eps if `loss` is true, else eps; for type float not yet rounded to it.
    """
    word, lead, index = map(Name, ("bits", "lead", "index"))
    shift = count(form.precision - 1 - SPLIT)
    first = (form.largest + FIRST) << SPLIT  # the leading bits of NEAR
    x = from_bits(form, word)
    if form == DOUBLE:
        start, centre = count(first - 1), Name("a[0]")
        row: Program = (
            Statement("index", Select(lead > start, Call("index", (lead - start,)), count(0))),
            Statement("row", TableRow(TABLE[form], index)),
            Statement("x", x),
            Statement("x1", from_bits(DOUBLE, word & ~mask(CLEARED))),
            Statement("t", Name("x") - centre),
            Statement("t1", Name("x1") - centre),
            Statement("t2", Name("x") - Name("x1")),
            Statement("elastic", index <= count(switch())),
        )
    else:
        half = Word(1 << (form.precision - SPLIT - 2))
        row = (
            Statement("index", lead - count(first)),
            Statement("row", TableRow(TABLE[form], index)),
            Statement("centre", from_bits(form, (lead << shift) | half)),
            Statement("t", Call("double", (x - Name("centre"),))),
            Statement("elastic", index < count(switch())),
        )
    found = sums(form)
    return found._replace(program=(Statement("lead", word >> shift), *row, *found.program))


def _near_sums(form: Format) -> CodeBranch:
    names = [f"a{n}" for n in range(NEAR_DEGREES[form] + 1)]
    return formulas.full_near_branch(names) if form == DOUBLE else formulas.full_near_float_branch(names)


def near_branch(form: Format) -> CodeBranch:
    """Return what the code of a type computes of 1 - eps below `NEAR`."""
    found = _near_sums(form)
    if form != DOUBLE:
        return found
    tiny, lift, lower = Name("tiny"), 2.0**LIFT, 2.0 ** (-2 * LIFT)
    start = (
        Statement("tiny", Name("v_star") < Literal(repr(2.0**TINY))),
        Statement("w", Name("v_star") * Select(tiny, Literal(repr(lift)), _ONE)),
        Statement("high", cut_to(Name("w"), DOUBLE.precision - CENTRE_BITS)),
    )
    result = found.results["result"] * Select(tiny, Literal(repr(lower)), _ONE)
    return found._replace(program=(*start, *found.program), results={**found.results, "result": result})


def assembled(function: str, near: Expression, panel: Expression) -> tuple[Expression, Expression]:
    """Return one of `FUNCTIONS` below `NEAR` and beyond it, given the results of `near_branch` and `panel_branch`.

    eps of type double needs the second alone, as the table's first row is for [0, `NEAR`].
    """
    return (near, panel) if function == "one_minus_epsilon" else (_ONE - near, panel * Name("scale"))


def evaluated_in(form: Format, function: str, v_star: Any) -> Any:
    """Return the results of one of `FUNCTIONS` in this type without FMA contraction; v* are numbers of that type."""
    loss, kind = function == "one_minus_epsilon", TYPES[form.name]
    by, (start, branch) = machine_arithmetic(DOUBLE, words=form), _prepared(form, function)
    names = DOUBLE_NAMES if form == DOUBLE else FLOAT_NAMES
    with np.errstate(all="ignore"):
        x = np.abs(np.asarray(v_star, kind))
        first = read(start, start.results, {"x": x}, by)
        given = {"bits": first["folded"], "loss": loss, TABLE[form]: _numbers_of_rows(form)}
        panel = evaluate(branch.results["result"], run_on_row(branch, names, given, by), by)
        below, beyond = assembled(function, Name("of_near"), Name("panel"))
        result = evaluate(beyond, {"panel": panel, "scale": first["scale"]}, by)
        if first["near"].any():
            given = {"v_star": x, "t": np.float64(x), **near_constants(form)}
            of_near = computed(near_branch(form), "result", given, DOUBLE)
            result = np.where(first["near"], evaluate(below, {"of_near": of_near}, by), result)
        accepted = evaluate(formulas.NOT_NEGATIVE, {"v_star": np.asarray(v_star)}, by)
        return np.where(accepted, result, math.nan).astype(kind)[()]


def branches(form: Format, function: str) -> tuple[CodeBranch, CodeBranch]:
    """Return what the code of a type computes from x = v*, and from the bits of its panel, of one of `FUNCTIONS`.

    1 - eps of v* <= 2^FOLD is not divided, as `folded` leaves these as they are.
    """
    word, near = Name("word"), Name("near")
    # eps of type double has the table's first row near 0.
    least = count(0) if (form, function) == (DOUBLE, "epsilon") else near_bits(form)
    start = (
        Statement("word", bits(form, Name("x"))),
        Statement("near", word < least),
        Statement("bits", Select(near, least, smaller_word(word, largest_bits(form, function)))),
        *fold_program(form),
    )
    return CodeBranch(None, start, {name: Name(name) for name in ("near", "folded", "scale")}), panel_branch(form)


@cache
def _prepared(form: Format, function: str) -> tuple[CodeBranch, CodeBranch]:
    """Return `branches`, prepared for machine numbers."""
    by = machine_arithmetic(DOUBLE, words=form)
    start, panel = branches(form, function)
    return prepared(start, by), prepared(panel, by)


@cache
def _numbers_of_rows(form: Format) -> Any:
    return np.array([row.numbers for row in double_rows()] if form == DOUBLE else float_rows())


# --- bounds of rounding errors ----------------------------------------------------------------------------------------


def _numbers(names: Sequence[str], values: Sequence[float], **inputs: arb) -> dict[str, Rounded]:
    """Return coefficients by name, and exact numbers of type double within balls."""
    given = dict(zip(names, map(arb, values), strict=True)) | inputs
    return {name: Rounded(value, DOUBLE) for name, value in given.items()}


def _between(low: Fraction, high: Fraction) -> arb:
    return ball_of(low).union(ball_of(high))


def _above(ball: arb) -> arb:
    """Return an exact upper bound."""
    return arb(ball.upper())


def _magnitude(ball: arb) -> arb:
    return arb(ball.abs_upper())


class UlpBound(NamedTuple):
    """A bound of the error over a part of the half-line, in ulp (units in the last place) of the true value."""

    low: Fraction
    high: Fraction
    ulp: Fraction


@recorded("ulp_bounds")
def ulp_bounds(form: Format, function: str) -> tuple[UlpBound, ...]:
    """Return bounds of the error for all v* >= 0 with a result in the normal range, panel by panel.

    Those from 2^FOLD on hold for all larger v*, too. The bounds are proven (docs/reference/full-kernels.md), and hold
    with and without FMA contraction.
    """
    loss = function == "one_minus_epsilon"
    check_panel_results(form)
    bound = _double_bound if form == DOUBLE else _float_bound
    with working(_BITS):
        found = [UlpBound(Fraction(0), NEAR, _near_bound(form, loss))]
        for index in track(range(len(smaller_panels())), f"error bounds of type {form.name}"):
            panel = smaller_panels()[index]
            found.append(UlpBound(panel.centre - panel.half, panel.centre + panel.half, bound(index, loss)))
    return tuple(found)


def check_panel_results(form: Format) -> None:
    """Check that without rounding a panel's results are eps and 1 - eps, of which its row has the smaller one.

    Raises
    ------
    ArithmeticError
        If they are not.
    """
    names, t = DOUBLE_NAMES if form == DOUBLE else FLOAT_NAMES, fmpq_poly([0, 1])
    numbers: dict[str, float] = {name: 1.375 + n for n, name in enumerate(names)}  # any
    for elastic, loss in product((False, True), repeat=2):
        given: dict[str, fmpq_poly | bool] = {"t": t, "t1": t / 3, "t2": t * 2 / 3, "elastic": elastic, "loss": loss}
        parts = [
            exactly(sums(form), name, given, numbers) for name in (("exact", "rest") if form == DOUBLE else ("p",))
        ]
        p = sum(parts, fmpq_poly([]))
        # Rows of type double have -(1 - eps) where those of type float have 1 - eps.
        eps = (1 + p if form == DOUBLE else 1 - p) if elastic else p
        given["head"] = t**7 - 3  # any, as the loss of this sum makes up for what it lacks
        if exactly(sums(form), "result", given, numbers) != (1 - eps if loss else eps):
            raise ArithmeticError(f"the results of a panel in type {form.name} are not eps and 1 - eps")


def largest_ulp(form: Format, function: str | None = None) -> Fraction:
    """Return the largest of the bounds, of one of `FUNCTIONS` or of both."""
    return max(bound.ulp for name in ([function] if function else FUNCTIONS) for bound in ulp_bounds(form, name))


def largest_subnormal(form: Format, function: str | None = None) -> Fraction:
    """Return the same for subnormal results, in the smallest numbers; those of type double are rounded twice."""
    largest = largest_ulp(form, function)
    return (1 + largest) / 2 if form == DOUBLE else largest


def _in_ulp(error: arb, least: arb, form: Format) -> Fraction:
    """Return the bound of a result of at least `least` that is rounded once after it had `error`.

    Where `error`, less than an ulp, moves it up across a power of 2, it is rounded to this power.
    """
    unit = ball_of(form.ulp(exact_middle(arb(least.lower()))))
    return Fraction(1, 2) + exact_middle(_above(_above(error) / unit))


def _worst_part(
    panel: SmallerOnPanel, loss: bool, form: Format, errors: Callable[[arb, arb], tuple[arb, arb]]
) -> Fraction:
    """Return the largest bound of the panel's parts; `errors` are those of p and of 1 - p, given enclosed t and p."""

    def bound(low: Fraction, high: Fraction) -> Fraction:
        p = arb_poly(panel.p)(_between(low, high))
        of_p, of_other = errors(_between(panel.half * low, panel.half * high), p)
        return _in_ulp(of_p, p, form) if loss == panel.elastic else _in_ulp(of_other, 1 - p, form)

    return max(bound(*ends) for ends in pairwise(Fraction(2 * m - _PARTS, _PARTS) for m in range(_PARTS + 1)))


def _given_error(panel: SmallerOnPanel, difference: Fraction, values: arb) -> arb:
    """Return a bound of the machine polynomial's error: its own, and that of what it approximates."""
    relative = ball_of(TABLE_ERROR + (FOLD_ERROR if panel.centre > 2**FOLD else 0))
    return _above(arb(to_fmpq(difference))) + _magnitude(values) * relative * (1 + 2 * relative)


def _double_bound(index: int, loss: bool) -> Fraction:
    panel, row = smaller_panels()[index], double_rows()[1 + index]
    sign = -1 if panel.elastic else 1
    _check_head(panel, row)
    machine = _exact_double(row, fmpq_poly([0, to_fmpq(panel.half)]))
    difference = greatest(machine * sign - panel.p)

    def errors(t: arb, values: arb) -> tuple[arb, arb]:
        given = _given_error(panel, difference, values)
        numbers = _numbers(DOUBLE_NAMES, row.numbers, t=t, t2=_between(Fraction(0), _step(panel)))
        rest = of_branch(panel_branch(DOUBLE), ["rest"], numbers, DOUBLE)["rest"]
        # The leading part's sum with 1 leaves at most half an ulp of 1 to be added to the rest.
        lost = Rounded(arb(0, half_unit(arb(1), DOUBLE)), DOUBLE)
        return rest.absolute + given, (lost + rest).absolute + given

    return _worst_part(panel, loss, DOUBLE, errors)


def _exact_double(row: DoubleRow, t: fmpq_poly) -> fmpq_poly:
    """Return what a row stands for, exactly, however t_1 and t_2 share t between them."""
    given, numbers = {"t": t, "t1": t / 3, "t2": t * 2 / 3}, dict(zip(DOUBLE_NAMES, row.numbers, strict=True))
    return sum((exactly(sums(DOUBLE), name, given, numbers) for name in ("exact", "rest")), fmpq_poly([]))


def _check_head(panel: SmallerOnPanel, row: DoubleRow) -> None:
    """Check that a0_high + a1_high t_1 and both its operations are exact: multiples of one unit below 2^53 of it."""
    high, slope, step = Fraction(row.a0_high), Fraction(row.a1_high), _step(panel)
    unit = DOUBLE.ulp(abs(high) + abs(slope) * panel.half)
    reach = abs(high) + abs(slope) * (panel.half + step)
    if (high / unit).denominator != 1 or (slope * step / unit).denominator != 1 or reach > 2**53 * unit:
        raise ArithmeticError(f"the leading part is not exact on the panel around {float(panel.centre)}")


def _float_bound(index: int, loss: bool) -> Fraction:
    panel, a = smaller_panels()[index], float_rows()[index]
    t = fmpq_poly([0, to_fmpq(panel.half)])
    difference = greatest(exactly(sums(FLOAT), "p", {"t": t}, dict(zip(FLOAT_NAMES, a, strict=True))) - panel.p)

    def errors(t: arb, values: arb) -> tuple[arb, arb]:
        p = of_branch(panel_branch(FLOAT), ["p"], _numbers(FLOAT_NAMES, a, t=t), DOUBLE)["p"]
        error = p.absolute + _given_error(panel, difference, values)
        return error, error + half_unit(arb(1), DOUBLE)

    return _worst_part(panel, loss, FLOAT, errors)


def _near_bound(form: Format, loss: bool) -> Fraction:
    """Bound the error on [0, NEAR], relative to v*^2 where 1 - eps is wanted."""
    ratio = _ratio()
    least = arb(ratio[0]) - _greatest_on_unit(ratio - ratio[0])
    most = _above(2 * arb(ratio[0]) - least)
    given = most * ball_of(TABLE_ERROR)
    if form == DOUBLE and not loss:
        return _double_bound_near_one(given)
    constants = near_constants(form)
    x = fmpq_poly([0, to_fmpq(NEAR)])
    inputs = {"v_star": x, "t": x, "w": 2 * x, "high": x / 3}  # w is v* times any power of 2, `high` any part of it
    machine = exactly(_near_sums(form), "result", inputs, constants) / (4 if form == DOUBLE else 1)
    given += _greatest_on_unit(_over_square(machine) - ratio)
    variable = {"v_star" if form == DOUBLE else "t": _between(Fraction(0), NEAR)}
    numbers = _numbers(list(constants), list(constants.values()), **variable)
    factor = of_branch(near_branch(form), ["factor"], numbers, DOUBLE)["factor"]
    if form == DOUBLE:
        return _relative_in_ulp(_product_error(constants["c_high"], factor) + given, least, DOUBLE)
    error = factor.absolute + ball_of(_U) * (_magnitude(factor.value) + factor.absolute) + given  # v*^2 has 48 bits
    if loss:
        return _relative_in_ulp(error, least, FLOAT)
    absolute = error * ball_of(NEAR**2) + half_unit(arb(1), DOUBLE)
    return _in_ulp(absolute, 1 - most * ball_of(NEAR**2), FLOAT)


def _relative_in_ulp(error: arb, least: arb, form: Format) -> Fraction:
    """Like `_in_ulp`, for errors in units of v*^2, of which `least` is the smallest value."""
    lost: Fraction = exact_middle(_above(_above(error) / least)) * 2**form.precision
    # Intermediate results that underflow are below 2^-60 ulp of a result of at least 2^(2 TINY).
    return Fraction(1, 2) + lost + Fraction(1, 2**60)


def _product_error(c_high: float, rest: Rounded) -> arb:
    """Bound the error of c_high (w^2 - high^2) + w^2 rest, with the rounding of this sum, in units of w^2."""
    u = ball_of(_U)
    tail = arb(c_high) * arb(2) ** (2 - CENTRE_BITS)
    other = _magnitude(rest.value) + rest.absolute
    error = tail * ((1 + u) ** 3 - 1) + rest.absolute + other * ((1 + u) ** 2 - 1)
    return error + u * (tail + other + error)


def _double_bound_near_one(given: arb) -> Fraction:
    """Bound the error of eps on [0, NEAR], from the table's first row."""
    row = double_rows()[0]
    machine = -_exact_double(row, fmpq_poly([0, to_fmpq(NEAR)]))
    given = (given + _greatest_on_unit(_over_square(machine) - _ratio())) * ball_of(NEAR**2)
    x = _between(Fraction(0), NEAR)
    rest = of_branch(panel_branch(DOUBLE), ["rest"], _numbers(DOUBLE_NAMES, row.numbers, t=x, t2=x), DOUBLE)["rest"]
    return _in_ulp(rest.absolute + given, 1 - _magnitude(rest.value) * 2, DOUBLE)
