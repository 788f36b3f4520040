r"""Kernels of eps(v*) and 1 - eps(v*) to the last place: tables of machine numbers, and proof of a bound in ulp.

The tables hold the smaller of the two functions, p <= 1/2 (nearly); the other is 1 - p. Panels are the halves of the
panels of `double`, 16 to an octave of v*. Their polynomials are those of `double` in the Chebyshev basis, truncated
after T_n. With t the distance from the panel's centre, which is exact,
p = s + (rest), where s = a_0 + a_1 t_1 is exact: a_0, a_1 and t_1 are cut to few bits, and what they lack is in the
rest. Below v* = 2^-4, 1 - eps = v*^2 (c + v*^2 (…)), with a product c v*^2 in two parts. From 2^FOLD on, v* is
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
from viscopade.arithmetic.formats import DOUBLE
from viscopade.arrays.panels import CENTRES, FIRST, FOLD, HALF_WIDTHS, PANELS, PERIOD
from viscopade.arrays.panels import SPLIT as COARSE
from viscopade.collision import panel_proof
from viscopade.collision.panel_proof import PanelRow
from viscopade.kernels.enclosure import exactly
from viscopade.kernels.expressions import (
    Call,
    CodeBranch,
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
from viscopade.kernels.machine import computed, machine_arithmetic, run_on_row
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
LARGEST = 324  # at 2^this and beyond eps rounds to 0
CLEARED = 26  # bits of v* that t_1 lacks
CENTRE_BITS = 16  # of v* in the leading product of (1 - eps) below NEAR
FACTOR_BITS = 21  # of c in that product; 2 CENTRE_BITS + FACTOR_BITS = 53
TINY, LIFT = -400, 200  # v* < 2^TINY is multiplied by 2^LIFT before it is squared

DEGREE = 10
NEAR_DEGREE = 8  # of the polynomial that v*^4 is multiplied by

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
    if loss[0] != 0 or loss[1] != 0:
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
    """A row: eps - base = a0_high + a1_high t_1 + (a0_low + a1_high t_2 + a1_low t + a_2 t^2 + …).

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
    """Return the table: a row for [0, NEAR], which only eps uses, then one for each panel."""
    return (_double_row_near(), *(_double_row(panel) for panel in smaller_panels()))


def _double_row_near() -> DoubleRow:
    a = _coefficients(-_cut_on_unit(_ratio(), DEGREE - 2), NEAR, DEGREE - 1)
    return DoubleRow(0.0, 0.0, 0.0, 0.0, 0.0, tuple(map(DOUBLE.nearest, a)))


def _double_row(panel: SmallerOnPanel) -> DoubleRow:
    p = cut(-panel.p if panel.elastic else panel.p, DEGREE)
    a0, a1, *a = _coefficients(p, panel.half, DEGREE + 1)
    unit = DOUBLE.ulp(abs(a0) + abs(a1) * panel.half)
    high = _to_multiple(a0, unit)
    slope = _to_multiple(a1, unit / _step(panel))
    low, rest = DOUBLE.nearest(a0 - Fraction(high)), DOUBLE.nearest(a1 - Fraction(slope))
    return DoubleRow(float(panel.centre), high, slope, low, rest, tuple(map(DOUBLE.nearest, a)))


def _step(panel: SmallerOnPanel) -> Fraction:
    """Return the distance of neighbouring values of t_1."""
    return DOUBLE.ulp(panel.centre) * Fraction(2) ** CLEARED


@cache
def near_constants() -> dict[str, float]:
    """Return the constants of `near_branch`: 1 - eps = v*^2 (c + v*^2 (a0 + a1 v* + …)), c = c_high + c_low."""
    ratio = _ratio()
    c = to_fraction(ratio[0])
    rest = fmpq_poly(ratio.coeffs()[2:])  # without z, whose coefficient is 0 but for the table's error
    quotient = _cut_on_unit(rest, NEAR_DEGREE) / to_fmpq(NEAR**2)
    a = map(DOUBLE.nearest, _coefficients(quotient, NEAR, NEAR_DEGREE + 1))
    high = _to_multiple(c, Fraction(2) ** (1 - FACTOR_BITS))
    return {"c_high": high, "c_low": DOUBLE.nearest(c - Fraction(high))} | {
        f"a{n}": number for n, number in enumerate(a)
    }


# --- the sequence of operations ---------------------------------------------------------------------------------------

NAMES = tuple(f"a[{n}]" for n in range(DEGREE + 4))
TABLE = "viscopade_full_table"
_ONE = Literal("1.0")
_NEAR_NAMES = [f"a{n}" for n in range(NEAR_DEGREE + 1)]


def largest_bits(function: str) -> Word:
    """Return the bits that larger ones are replaced by: there the function rounds to its limit."""
    return power_of_two(DOUBLE, FOLD if function == "one_minus_epsilon" else LARGEST)


def near_bits() -> Word:
    """Return the bits of `NEAR`."""
    return power_of_two(DOUBLE, FIRST)


def fold_program() -> Program:
    """Return the assignments from the bits of v* to those of s, and to eps(v*)/eps(s)."""
    return folded(FOLD, PERIOD)


def panel_branch() -> CodeBranch:
    """Return what the code computes from `bits`, below those of 2^(FOLD + PERIOD), and a panel's row.

    The result is 1 - eps if `loss` is true, else eps.
    """
    word, lead, index = map(Name, ("bits", "lead", "index"))
    shift = count(DOUBLE.precision - 1 - SPLIT)
    start, centre = count(((DOUBLE.largest + FIRST) << SPLIT) - 1), Name("a[0]")  # before the leading bits of NEAR
    program: Program = (
        Statement("lead", word >> shift),
        Statement("index", Select(lead > start, Call("index", (lead - start,)), count(0))),
        Statement("row", TableRow(TABLE, index)),
        Statement("x", from_bits(DOUBLE, word)),
        Statement("x1", from_bits(DOUBLE, word & ~mask(CLEARED))),
        Statement("t", Name("x") - centre),
        Statement("t1", Name("x1") - centre),
        Statement("t2", Name("x") - Name("x1")),
        Statement("elastic", index <= count(switch())),
    )
    sums = formulas.full_panel_branch(NAMES)
    return sums._replace(program=(*program, *sums.program))


def near_branch() -> CodeBranch:
    """Return what the code computes of 1 - eps below `NEAR`."""
    sums = formulas.full_near_branch(_NEAR_NAMES)
    tiny, lift, lower = Name("tiny"), 2.0**LIFT, 2.0 ** (-2 * LIFT)
    start = (
        Statement("tiny", Name("v_star") < Literal(repr(2.0**TINY))),
        Statement("w", Name("v_star") * Select(tiny, Literal(repr(lift)), _ONE)),
        Statement("high", cut_to(Name("w"), DOUBLE.precision - CENTRE_BITS)),
    )
    result = sums.results["result"] * Select(tiny, Literal(repr(lower)), _ONE)
    return sums._replace(program=(*start, *sums.program), results={**sums.results, "result": result})


def evaluated(function: str, v_star: Any) -> Any:
    """Return the results of one of `FUNCTIONS` without FMA contraction."""
    loss = function == "one_minus_epsilon"
    by, (start, branch) = machine_arithmetic(DOUBLE), _prepared(function)
    with np.errstate(all="ignore"):
        x = np.abs(np.asarray(v_star, np.float64))
        first = read(start, start.results, {"x": x}, by)
        given = {"bits": first["folded"], "loss": loss, TABLE: _numbers_of_rows()}
        result = evaluate(branch.results["result"], run_on_row(branch, NAMES, given, by), by)
        if not loss:  # the table's first row is for [0, NEAR]
            result = result * first["scale"]
        elif first["near"].any():
            near = computed(near_branch(), "result", {"v_star": x, **near_constants()}, DOUBLE)
            result = np.where(first["near"], near, result)
        accepted = evaluate(formulas.NOT_NEGATIVE, {"v_star": np.asarray(v_star)}, by)
        return np.where(accepted, result, math.nan)[()]


def branches(function: str) -> tuple[CodeBranch, CodeBranch]:
    """Return what the code computes from x = v*, and from the bits of its panel, of one of `FUNCTIONS`.

    1 - eps of v* <= 2^FOLD is not divided, as `folded` leaves these as they are.
    """
    word, near = Name("word"), Name("near")
    least = count(0) if function == "epsilon" else near_bits()  # eps has the table's first row near 0
    start = (
        Statement("word", bits(DOUBLE, Name("x"))),
        Statement("near", word < least),
        Statement("bits", Select(near, least, smaller_word(word, largest_bits(function)))),
        *fold_program(),
    )
    return CodeBranch(None, start, {name: Name(name) for name in ("near", "folded", "scale")}), panel_branch()


@cache
def _prepared(function: str) -> tuple[CodeBranch, CodeBranch]:
    """Return `branches`, prepared for machine numbers."""
    by = machine_arithmetic(DOUBLE)
    start, panel = branches(function)
    return prepared(start, by), prepared(panel, by)


@cache
def _numbers_of_rows() -> Any:
    return np.array([row.numbers for row in double_rows()])


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
def ulp_bounds(function: str) -> tuple[UlpBound, ...]:
    """Return bounds of the error for all v* >= 0 with a result in the normal range, panel by panel.

    Those from 2^FOLD on hold for all larger v*, too. The bounds are proven (docs/reference/full-kernels.md), and hold
    with and without FMA contraction.
    """
    loss = function == "one_minus_epsilon"
    check_panel_results()
    with working(_BITS):
        found = [UlpBound(Fraction(0), NEAR, _near_bound() if loss else _near_one_bound())]
        for index in track(range(len(smaller_panels())), "error bounds of full accuracy"):
            panel = smaller_panels()[index]
            found.append(UlpBound(panel.centre - panel.half, panel.centre + panel.half, _panel_bound(index, loss)))
    return tuple(found)


def check_panel_results() -> None:
    """Check that without rounding a panel's results are eps and 1 - eps, of which its row has the smaller one.

    Raises
    ------
    ArithmeticError
        If they are not.
    """
    t, sums = fmpq_poly([0, 1]), formulas.full_panel_branch(NAMES)
    numbers: dict[str, float] = {name: 1.375 + n for n, name in enumerate(NAMES)}  # any
    for elastic, loss in product((False, True), repeat=2):
        given: dict[str, fmpq_poly | bool] = {"t": t, "t1": t / 3, "t2": t * 2 / 3, "elastic": elastic, "loss": loss}
        p = sum((exactly(sums, name, given, numbers) for name in ("exact", "rest")), fmpq_poly([]))
        eps = 1 + p if elastic else p
        given["head"] = t**7 - 3  # any, as the loss of this sum makes up for what it lacks
        if exactly(sums, "result", given, numbers) != (1 - eps if loss else eps):
            raise ArithmeticError("the results of a panel are not eps and 1 - eps")


def largest_ulp(function: str | None = None) -> Fraction:
    """Return the largest of the bounds, of one of `FUNCTIONS` or of both."""
    return max(bound.ulp for name in ([function] if function else FUNCTIONS) for bound in ulp_bounds(name))


def largest_subnormal(function: str | None = None) -> Fraction:
    """Return the same for subnormal results, which are rounded twice, in the smallest numbers."""
    return (1 + largest_ulp(function)) / 2


def _in_ulp(error: arb, least: arb) -> Fraction:
    """Return the bound of a result of at least `least` that is rounded once after it had `error`.

    Where `error`, less than an ulp, moves it up across a power of 2, it is rounded to this power.
    """
    unit = ball_of(DOUBLE.ulp(exact_middle(arb(least.lower()))))
    return Fraction(1, 2) + exact_middle(_above(_above(error) / unit))


def _worst_part(panel: SmallerOnPanel, loss: bool, errors: Callable[[arb, arb], tuple[arb, arb]]) -> Fraction:
    """Return the largest bound of the panel's parts; `errors` are those of p and of 1 - p, given enclosed t and p."""

    def bound(low: Fraction, high: Fraction) -> Fraction:
        p = arb_poly(panel.p)(_between(low, high))
        of_p, of_other = errors(_between(panel.half * low, panel.half * high), p)
        return _in_ulp(of_p, p) if loss == panel.elastic else _in_ulp(of_other, 1 - p)

    return max(bound(*ends) for ends in pairwise(Fraction(2 * m - _PARTS, _PARTS) for m in range(_PARTS + 1)))


def _given_error(panel: SmallerOnPanel, difference: Fraction, values: arb) -> arb:
    """Return a bound of the machine polynomial's error: its own, and that of what it approximates."""
    relative = ball_of(TABLE_ERROR + (FOLD_ERROR if panel.centre > 2**FOLD else 0))
    return _above(arb(to_fmpq(difference))) + _magnitude(values) * relative * (1 + 2 * relative)


def _panel_bound(index: int, loss: bool) -> Fraction:
    panel, row = smaller_panels()[index], double_rows()[1 + index]
    sign = -1 if panel.elastic else 1
    _check_head(panel, row)
    machine = _exact_double(row, fmpq_poly([0, to_fmpq(panel.half)]))
    difference = greatest(machine * sign - panel.p)

    def errors(t: arb, values: arb) -> tuple[arb, arb]:
        given = _given_error(panel, difference, values)
        numbers = _numbers(NAMES, row.numbers, t=t, t2=_between(Fraction(0), _step(panel)))
        rest = of_branch(panel_branch(), ["rest"], numbers, DOUBLE)["rest"]
        # The leading part's sum with 1 leaves at most half an ulp of 1 to be added to the rest.
        lost = Rounded(arb(0, half_unit(arb(1), DOUBLE)), DOUBLE)
        return rest.absolute + given, (lost + rest).absolute + given

    return _worst_part(panel, loss, errors)


def _exact_double(row: DoubleRow, t: fmpq_poly) -> fmpq_poly:
    """Return what a row stands for, exactly, however t_1 and t_2 share t between them."""
    given, numbers = {"t": t, "t1": t / 3, "t2": t * 2 / 3}, dict(zip(NAMES, row.numbers, strict=True))
    sums = formulas.full_panel_branch(NAMES)
    return sum((exactly(sums, name, given, numbers) for name in ("exact", "rest")), fmpq_poly([]))


def _check_head(panel: SmallerOnPanel, row: DoubleRow) -> None:
    """Check that a0_high + a1_high t_1 and both its operations are exact: multiples of one unit below 2^53 of it."""
    high, slope, step = Fraction(row.a0_high), Fraction(row.a1_high), _step(panel)
    unit = DOUBLE.ulp(abs(high) + abs(slope) * panel.half)
    reach = abs(high) + abs(slope) * (panel.half + step)
    if (high / unit).denominator != 1 or (slope * step / unit).denominator != 1 or reach > 2**53 * unit:
        raise ArithmeticError(f"the leading part is not exact on the panel around {float(panel.centre)}")


def _near_bound() -> Fraction:
    """Bound the error of 1 - eps on [0, NEAR]."""
    ratio = _ratio()
    least = arb(ratio[0]) - _greatest_on_unit(ratio - ratio[0])
    given = _above(2 * arb(ratio[0]) - least) * ball_of(TABLE_ERROR)  # of the largest value
    constants = near_constants()
    x = fmpq_poly([0, to_fmpq(NEAR)])
    inputs = {"v_star": x, "w": 2 * x, "high": x / 3}  # w is v* times any power of 2, `high` any part of it
    machine = exactly(formulas.full_near_branch(_NEAR_NAMES), "result", inputs, constants) / 4
    given += _greatest_on_unit(_over_square(machine) - ratio)
    numbers = _numbers(list(constants), list(constants.values()), v_star=_between(Fraction(0), NEAR))
    factor = of_branch(near_branch(), ["factor"], numbers, DOUBLE)["factor"]
    error = _product_error(constants["c_high"], factor) + given
    lost: Fraction = exact_middle(_above(_above(error) / least)) * 2**DOUBLE.precision
    # Intermediate results that underflow are below 2^-60 ulp of a result of at least 2^(2 TINY).
    return Fraction(1, 2) + lost + Fraction(1, 2**60)


def _product_error(c_high: float, rest: Rounded) -> arb:
    """Bound the error of c_high (w^2 - high^2) + w^2 rest, with the rounding of this sum, in units of w^2."""
    u = ball_of(_U)
    tail = arb(c_high) * arb(2) ** (2 - CENTRE_BITS)
    other = _magnitude(rest.value) + rest.absolute
    error = tail * ((1 + u) ** 3 - 1) + rest.absolute + other * ((1 + u) ** 2 - 1)
    return error + u * (tail + other + error)


def _near_one_bound() -> Fraction:
    """Bound the error of eps on [0, NEAR], from the table's first row."""
    ratio, row = _ratio(), double_rows()[0]
    most = _above(arb(ratio[0]) + _greatest_on_unit(ratio - ratio[0]))
    machine = -_exact_double(row, fmpq_poly([0, to_fmpq(NEAR)]))
    given = most * ball_of(TABLE_ERROR) + _greatest_on_unit(_over_square(machine) - ratio)
    x = _between(Fraction(0), NEAR)
    rest = of_branch(panel_branch(), ["rest"], _numbers(NAMES, row.numbers, t=x, t2=x), DOUBLE)["rest"]
    return _in_ulp(rest.absolute + given * ball_of(NEAR**2), 1 - _magnitude(rest.value) * 2)
