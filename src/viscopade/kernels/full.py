r"""Full accuracy: eps(v*) and 1 - eps(v*) to the last place, by a table of machine numbers, with proven bounds in ulp.

The table holds the smaller of the two functions, p <= 1/2 (nearly); the other is 1 - p. Panels are the halves of the
panels of `double`, 16 to an octave of v*. Their polynomials are the ones of `double` in the Chebyshev basis, truncated
after T_n. With t the distance from the panel's centre, which is exact,
p = s + (rest), where s = a_0 + a_1 t_1 is exact: a_0, a_1 and t_1 are cut to few bits, and what they lack is in the
rest. Below v* = 2^-4, 1 - eps = v*^2 (c + v*^2 (…)), with a product c v*^2 in two parts. From 2^FOLD on, v* is
divided by a power of 8 (`double`). The bounds hold with and without FMA contraction.

The bits of 2^e m, 1 <= m < 2, are the bits of e and of m; the leading ones are the number of a table's row.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from fractions import Fraction
from functools import cache
from itertools import pairwise, product
from typing import NamedTuple

from flint import arb, arb_poly, fmpq, fmpq_poly

from viscopade.arithmetic.balls import ball_of, exact_middle, interval_ball, magnitude, working
from viscopade.arithmetic.chebyshev import cut, greatest, to_fmpq, to_fraction
from viscopade.arithmetic.formats import DOUBLE
from viscopade.arrays.panels import CENTRES, FIRST, FOLD, HALF_WIDTHS, PANELS, PERIOD
from viscopade.arrays.panels import SPLIT as COARSE
from viscopade.collision import panel_proof
from viscopade.collision.panel_proof import PanelRow
from viscopade.kernels.bound import INFINITY, End, ErrorBound
from viscopade.kernels.enclosure import exact_polynomial
from viscopade.kernels.expressions import (
    Call,
    CodeBranch,
    Column,
    Exact,
    Expression,
    Literal,
    Name,
    Program,
    Select,
    Statement,
    TableRow,
    Word,
    in_pairs,
)
from viscopade.kernels.formulas import FRACTION, NOT_NEGATIVE, ONE, ZERO, bits, count, from_bits, power_of_two
from viscopade.kernels.kernel import Function, Kernel, Table
from viscopade.kernels.rounding import Rounded, half_unit, rounded_results
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
NORMAL: Mapping[str, tuple[Fraction, End]] = {
    "epsilon": (Fraction(0), Fraction(2 * 10**92)),
    "one_minus_epsilon": (Fraction(1, 2**511), INFINITY),
}
"""The v* at which a function is a normal number of type double."""

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


def _ratio() -> fmpq_poly:
    """Return (1 - eps)/v*^2 on [0, NEAR], a polynomial in z = v*/NEAR."""
    return _over_square(_polynomial("one_minus_epsilon", 0))


def _over_square(loss: fmpq_poly) -> fmpq_poly:
    """Return 1 - eps over v*^2, polynomials in z = v*/NEAR."""
    if loss[0] != 0 or loss[1] != 0:
        raise ValueError("1 - eps is not quadratic at 0")
    return fmpq_poly(loss.coeffs()[2:]) / to_fmpq(NEAR**2)


_UNIT = fmpq_poly([fmpq(1, 2), fmpq(1, 2)])  # [-1, 1] onto [0, 1]
_BACK = fmpq_poly([-1, 2])


def _cut_on_unit(p: fmpq_poly, degree: int) -> fmpq_poly:
    """Return the truncated Chebyshev expansion on [0, 1]."""
    return cut(p(_UNIT), degree)(_BACK)


def _greatest_on_unit(p: fmpq_poly) -> arb:
    """Return a bound of |p| on [0, 1]."""
    return arb(to_fmpq(greatest(p(_UNIT)))).abs_upper()


def _coefficients(p: fmpq_poly, half: Fraction, count: int) -> list[Fraction]:
    """Return the coefficients with respect to t = half z."""
    return [to_fraction(p[n]) / half**n for n in range(count)]


# --- the table --------------------------------------------------------------------------------------------------------

COLUMNS = ("centre", "a0_high", "a1_high", "a0_low", "a1_low", *(f"a{n}" for n in range(2, DEGREE + 1)))
"""Of a row: eps - base = a0_high + a1_high t_1 + (a0_low + a1_high t_2 + a1_low t + a2 t^2 + …).

t = t_1 + t_2 = v* - centre; base is 1 where the panel is elastic, 0 elsewhere.
"""


def _to_multiple(number: Fraction, unit: Fraction) -> float:
    return float(round(number / unit) * unit)


@recorded("full rows")
def panel_table() -> tuple[tuple[float, ...], ...]:
    """Return the table: a row for [0, NEAR], which only eps uses, then one for each panel."""
    near = _coefficients(-_cut_on_unit(_ratio(), DEGREE - 2), NEAR, DEGREE - 1)
    return (0.0, 0.0, 0.0, 0.0, 0.0, *map(DOUBLE.nearest, near)), *map(_row, smaller_panels())


def _row(panel: SmallerOnPanel) -> tuple[float, ...]:
    p = cut(-panel.p if panel.elastic else panel.p, DEGREE)
    a0, a1, *a = _coefficients(p, panel.half, DEGREE + 1)
    unit = DOUBLE.ulp(abs(a0) + abs(a1) * panel.half)
    high = _to_multiple(a0, unit)
    slope = _to_multiple(a1, unit / _step(panel))
    low, rest = DOUBLE.nearest(a0 - Fraction(high)), DOUBLE.nearest(a1 - Fraction(slope))
    return float(panel.centre), high, slope, low, rest, *map(DOUBLE.nearest, a)


def _step(panel: SmallerOnPanel) -> Fraction:
    """Return the distance of neighbouring values of t_1."""
    return DOUBLE.ulp(panel.centre) * Fraction(2) ** CLEARED


@cache
def near_constants() -> dict[str, float]:
    """Return the constants of `near_sums`: 1 - eps = v*^2 (c + v*^2 (d0 + d1 v* + …)), c = c_high + c_low."""
    ratio = _ratio()
    c = to_fraction(ratio[0])
    rest = fmpq_poly(ratio.coeffs()[2:])  # without z, whose coefficient is 0 except for the table's error
    quotient = _cut_on_unit(rest, NEAR_DEGREE) / to_fmpq(NEAR**2)
    a = map(DOUBLE.nearest, _coefficients(quotient, NEAR, NEAR_DEGREE + 1))
    high = _to_multiple(c, Fraction(2) ** (1 - FACTOR_BITS))
    return {"c_high": high, "c_low": DOUBLE.nearest(c - Fraction(high))} | {
        f"d{n}": number for n, number in enumerate(a)
    }


# --- the sequence of operations ---------------------------------------------------------------------------------------


def _cleared(number: Expression, last: int) -> Expression:
    """Return a positive number whose last bits, as many as `last`, are set to 0."""
    return from_bits(bits(number) & ~Word((1 << last) - 1))


def _smaller(word: Name, largest: Word) -> Expression:
    return Select(word < largest, word, largest)


@cache
def panel_sums(loss: bool) -> CodeBranch:
    """Return 1 - eps if `loss` is true, else eps, from a panel's row.

    t = t1 + t2 is the distance from the centre. `elastic` is true where 1 - eps is on the row.
    """
    a0_high, a1_high, a0_low, a1_low, t, t1, t2 = map(Name, (*COLUMNS[1:5], "t", "t1", "t2"))
    head, lost, rest, exact, elastic = map(Name, ("head", "lost", "rest", "exact", "elastic"))
    reason = "multiples of one unit, and below 2^53 of it"
    program = (
        Statement("tt", t * t),
        Statement("q", in_pairs("t", "tt", COLUMNS[5:])),
        Statement("rest", (a0_low + a1_high * t2) + t * (a1_low + t * Name("q"))),
        Statement("exact", Exact(a0_high + Exact(a1_high * t1, reason), reason)),
        Statement("sum", -exact if loss else exact),
        Statement("base", Select(elastic, ZERO, ONE) if loss else Select(elastic, ONE, ZERO)),
        *sum_with_error(Name("base"), Name("sum")),
    )
    return CodeBranch(None, program, {"result": head + (lost - rest if loss else lost + rest)})


def sum_with_error(base: Expression, part: Expression) -> Program:
    """Return the assignments of base + part, and of its rounding's loss: Fast2Sum, as base is 0 or the larger."""
    reason = "Fast2Sum"
    return (
        Statement("head", base + part),
        Statement("lost", Exact(Exact(base - Name("head"), reason) + part, reason)),
    )


@cache
def near_sums() -> CodeBranch:
    """Return 1 - eps near 0, times a power of 2: v*^2 (c + v*^2 (d0 + d1 v* + …)).

    w is v* times a power of 2, high its leading bits; c = c_high + c_low, and c_high high^2 is exact.
    """
    w, high, c_high = map(Name, ("w", "high", "c_high"))
    reason = "few bits"
    factor = Name("c_low") + Name("tt") * Name("q")
    program = (
        Statement("tt", Name("v_star") * Name("v_star")),
        Statement("q", in_pairs("v_star", "tt", [f"d{n}" for n in range(NEAR_DEGREE + 1)])),
        Statement("rest", c_high * (Exact(w - high, reason) * (w + high)) + w * w * factor),
    )
    leading = Exact(Exact(c_high * high, reason) * high, reason)
    return CodeBranch(None, program, {"factor": factor, "result": leading + Name("rest")})


def _panel(loss: bool) -> CodeBranch:
    """Return a result from `folded`, the bits of a number below 2^(FOLD + PERIOD)."""
    word, lead, index, centre = map(Name, ("folded", "lead", "index", "centre"))
    start = count(((DOUBLE.largest + FIRST) << SPLIT) - 1)  # before the leading bits of NEAR
    program: Program = (
        Statement("lead", word >> count(DOUBLE.precision - 1 - SPLIT)),
        Statement("index", Select(lead > start, Call("index", (lead - start,)), count(0))),
        Statement("row", TableRow("panels", index)),
        *(Statement(name, Column("row", n)) for n, name in enumerate(COLUMNS)),
        Statement("x", from_bits(word)),
        Statement("x1", _cleared(Name("x"), CLEARED)),
        Statement("t", Name("x") - centre),
        Statement("t1", Name("x1") - centre),
        Statement("t2", Name("x") - Name("x1")),
        Statement("elastic", index <= count(sum(panel.elastic for panel in smaller_panels()))),
    )
    sums = panel_sums(loss)
    return sums._replace(program=(*program, *sums.program))


def _fold() -> Program:
    """Return the assignments from `word`, the bits of x, to those of s = x 2^(-PERIOD n), and to eps(x)/eps(s).

    n >= 0 is the largest number with s >= 2^FOLD, or 0. There eps falls like x^(-10/3): the scale is a power of two.
    """
    word, n, exponent, start = Name("word"), Name("n"), Name("exponent"), count(DOUBLE.largest + FOLD)
    scale = Call("uint64", (count(DOUBLE.largest) - count(10 * PERIOD // 3) * n,)) << FRACTION
    return (
        Statement("exponent", Call("uint32", (word >> FRACTION,))),
        Statement("n", Select(exponent > start, (exponent - start) // count(PERIOD), count(0))),
        Statement("scale", from_bits(scale)),
        Statement("folded", word - (Call("uint64", (count(PERIOD) * n,)) << FRACTION)),
    )


def _epsilon() -> Function:
    start = (Statement("word", _smaller(Name("bits"), power_of_two(LARGEST))), *_fold())
    panel = _panel(loss=False)
    scaled = panel._replace(results={"epsilon": panel.results["result"] * Name("scale")})
    return Function("epsilon", ("v_star",), "eps", NOT_NEGATIVE, (_BITS_OF_V, *start), (scaled,), "epsilon")


def _one_minus_epsilon() -> Function:
    """1 - eps, which rounds to 1 from 2^FOLD on."""
    panel, near, tiny = _panel(loss=True), near_sums(), Name("tiny")
    folded = Statement("folded", _smaller(Name("bits"), power_of_two(FOLD)))
    start = (
        Statement("tiny", Name("v_star") < Literal(repr(2.0**TINY))),
        Statement("w", Name("v_star") * Select(tiny, Literal(repr(2.0**LIFT)), ONE)),
        Statement("high", _cleared(Name("w"), DOUBLE.precision - CENTRE_BITS)),
    )
    result = near.results["result"] * Select(tiny, Literal(repr(2.0 ** (-2 * LIFT))), ONE)
    name = "one_minus_epsilon"
    branches = (
        CodeBranch(Name("bits") < power_of_two(FIRST), (*start, *near.program), {name: result}),
        CodeBranch(None, (folded, *panel.program), {name: panel.results["result"]}),
    )
    return Function(name, ("v_star",), "1 - eps", NOT_NEGATIVE, (_BITS_OF_V,), branches, name)


_BITS_OF_V = Statement("bits", bits(Name("v_star")) & Word((1 << (8 * DOUBLE.bytes - 1)) - 1))  # those of |v*|


@cache
def full() -> Kernel:
    """Return the kernel of full accuracy."""
    return Kernel(
        "full",
        "full accuracy",
        "v_star",
        f"polynomials of degree {DEGREE} on {len(panel_table()):,} panels, summed with their rounding errors",
        "the proven polynomials of viscopade.epsilon, truncated",
        "all v* >= 0",
        (_epsilon(), _one_minus_epsilon()),
        {DOUBLE.name: near_constants()},
        tuple(bound for function in FUNCTIONS for bound in _bounds(function)),
        (Table("panels", DOUBLE.name, (len(panel_table()), len(panel_table()[0])), panel_table),),
        missing={"float": "full accuracy is to the last place of double"},
    )


# --- bounds of rounding errors ----------------------------------------------------------------------------------------


def _bounds(function: str) -> tuple[ErrorBound, ErrorBound]:
    """Return the bounds where a function is a normal number, and everywhere: subnormal numbers are rounded twice."""
    ulps, zero = largest_ulp(function), Fraction(0)
    rest = (1 + ulps) / 2 - ulps
    return (
        ErrorBound(function, *NORMAL[function], "value", zero, ulps=ulps),
        ErrorBound(function, zero, INFINITY, "value", zero, ulps=ulps, absolute=max(rest, zero)),
    )


def largest_ulp(function: str) -> Fraction:
    """Return the largest of the bounds of one of `FUNCTIONS`, of normal results, in ulp of the true value."""
    return max(bounds()[function])


@recorded("full bounds")
def bounds() -> Mapping[str, tuple[Fraction, ...]]:
    """Return bounds of the errors of both functions in ulp of the true value, on [0, NEAR] and panel by panel.

    Those from 2^FOLD on hold for all larger v*, too. The bounds are proven (docs/reference/full-kernels.md), and hold
    with and without FMA contraction.
    """
    check_panel_results()
    with working(_BITS):
        near = {"epsilon": _near_one_bound(), "one_minus_epsilon": _near_bound()}
        panels = range(len(smaller_panels()))
        return {
            name: (
                near[name],
                *(panel_bound(i, name == FUNCTIONS[1]) for i in track(panels, f"error bounds of {name}")),
            )
            for name in FUNCTIONS
        }


def check_panel_results() -> None:
    """Check that without rounding a panel's results are eps and 1 - eps, of which its row has the smaller one.

    Raises
    ------
    ArithmeticError
        If they are not.
    """
    t, numbers = fmpq_poly([0, 1]), {name: 1.375 + n for n, name in enumerate(COLUMNS)}  # any
    for elastic, loss in product((False, True), repeat=2):
        sums = panel_sums(loss)
        given: dict[str, fmpq_poly | bool] = {"t": t, "t1": t / 3, "t2": t * 2 / 3, "elastic": elastic}
        p = sum((exact_polynomial(sums, name, given, numbers) for name in ("exact", "rest")), fmpq_poly([]))
        eps = 1 + p if elastic else p
        given["head"] = t**7 - 3  # any, as the loss of this sum makes up for what it lacks
        if exact_polynomial(sums, "result", given, numbers) != (1 - eps if loss else eps):
            raise ArithmeticError("the results of a panel are not eps and 1 - eps")


def rounded_numbers(names: Sequence[str], values: Sequence[float], **inputs: arb) -> dict[str, Rounded]:
    """Return coefficients by name, and exact numbers of type double within balls."""
    given = dict(zip(names, map(arb, values), strict=True)) | inputs
    return {name: Rounded(value, DOUBLE) for name, value in given.items()}


def _in_ulp(error: arb, least: arb) -> Fraction:
    """Return the bound of a result of at least `least` that is rounded once after it had `error`.

    Where `error`, less than an ulp, moves it up across a power of 2, it is rounded to this power.
    """
    unit = ball_of(DOUBLE.ulp(exact_middle(least.lower())))
    return Fraction(1, 2) + magnitude(error.abs_upper() / unit)


def panel_bound(index: int, loss: bool) -> Fraction:
    """Return the bound in ulp on a panel: the largest of those of its parts."""
    panel, row = smaller_panels()[index], panel_table()[1 + index]
    _check_head(panel, row)
    machine = _exactly(row, fmpq_poly([0, to_fmpq(panel.half)]))
    difference = greatest(machine * (-1 if panel.elastic else 1) - panel.p)

    def bound(low: Fraction, high: Fraction) -> Fraction:
        p, t = arb_poly(panel.p)(interval_ball(low, high)), interval_ball(panel.half * low, panel.half * high)
        given = _given_error(panel, difference, p)
        numbers = rounded_numbers(COLUMNS, row, t=t, t2=interval_ball(Fraction(0), _step(panel)))
        rest = rounded_results(panel_sums(loss), ["rest"], numbers, DOUBLE)["rest"]
        if loss == panel.elastic:
            return _in_ulp(rest.absolute + given, p)
        # The leading part's sum with 1 leaves at most half an ulp of 1 to be added to the rest.
        lost = Rounded(arb(0, half_unit(arb(1), DOUBLE)), DOUBLE)
        return _in_ulp((lost + rest).absolute + given, 1 - p)

    return max(bound(*ends) for ends in pairwise(Fraction(2 * m - _PARTS, _PARTS) for m in range(_PARTS + 1)))


def _given_error(panel: SmallerOnPanel, difference: Fraction, values: arb) -> arb:
    """Return a bound of the machine polynomial's error: its own, and that of what it approximates."""
    relative = ball_of(TABLE_ERROR + (FOLD_ERROR if panel.centre > 2**FOLD else 0))
    return arb(to_fmpq(difference)).abs_upper() + values.abs_upper() * relative * (1 + 2 * relative)


def _exactly(row: Sequence[float], t: fmpq_poly) -> fmpq_poly:
    """Return what a row stands for, exactly, however t_1 and t_2 share t between them."""
    given, numbers = {"t": t, "t1": t / 3, "t2": t * 2 / 3}, dict(zip(COLUMNS, row, strict=True))
    return sum((exact_polynomial(panel_sums(False), name, given, numbers) for name in ("exact", "rest")), fmpq_poly([]))


def _check_head(panel: SmallerOnPanel, row: Sequence[float]) -> None:
    """Check that a0_high + a1_high t_1 and both its operations are exact: multiples of one unit below 2^53 of it."""
    high, slope, step = Fraction(row[1]), Fraction(row[2]), _step(panel)
    unit = DOUBLE.ulp(abs(high) + abs(slope) * panel.half)
    reach = abs(high) + abs(slope) * (panel.half + step)
    if (high / unit).denominator != 1 or (slope * step / unit).denominator != 1 or reach > 2**53 * unit:
        raise ArithmeticError(f"the leading part is not exact on the panel around {float(panel.centre)}")


def _near_bound() -> Fraction:
    """Bound the error of 1 - eps on [0, NEAR]."""
    ratio, sums, constants = _ratio(), near_sums(), near_constants()
    least = arb(ratio[0]) - _greatest_on_unit(ratio - ratio[0])
    given = (2 * arb(ratio[0]) - least).abs_upper() * ball_of(TABLE_ERROR)  # of the largest value
    x = fmpq_poly([0, to_fmpq(NEAR)])
    inputs = {"v_star": x, "w": 2 * x, "high": x / 3}  # w is v* times any power of 2, `high` any part of it
    machine = exact_polynomial(sums, "result", inputs, constants) / 4
    given += _greatest_on_unit(_over_square(machine) - ratio)
    numbers = rounded_numbers(list(constants), list(constants.values()), v_star=interval_ball(Fraction(0), NEAR))
    error = _product_error(constants["c_high"], rounded_results(sums, ["factor"], numbers, DOUBLE)["factor"]) + given
    lost: Fraction = magnitude(error.abs_upper() / least) * 2**DOUBLE.precision
    # Intermediate results that underflow are below 2^-60 ulp of a result of at least 2^(2 TINY).
    return Fraction(1, 2) + lost + Fraction(1, 2**60)


def _product_error(c_high: float, rest: Rounded) -> arb:
    """Bound the error of c_high (w^2 - high^2) + w^2 rest, with the rounding of this sum, in units of w^2."""
    u = ball_of(_U)
    tail = arb(c_high) * arb(2) ** (2 - CENTRE_BITS)
    other = rest.value.abs_upper() + rest.absolute
    error = tail * ((1 + u) ** 3 - 1) + rest.absolute + other * ((1 + u) ** 2 - 1)
    return error + u * (tail + other + error)


def _near_one_bound() -> Fraction:
    """Bound the error of eps on [0, NEAR], from the table's first row."""
    ratio, row = _ratio(), panel_table()[0]
    most = (arb(ratio[0]) + _greatest_on_unit(ratio - ratio[0])).abs_upper()
    machine = -_exactly(row, fmpq_poly([0, to_fmpq(NEAR)]))
    given = most * ball_of(TABLE_ERROR) + _greatest_on_unit(_over_square(machine) - ratio)
    x = interval_ball(Fraction(0), NEAR)
    rest = rounded_results(panel_sums(False), ["rest"], rounded_numbers(COLUMNS, row, t=x, t2=x), DOUBLE)["rest"]
    return _in_ulp(rest.absolute + given * ball_of(NEAR**2), 1 - rest.value.abs_upper() * 2)
