r"""Full accuracy: eps(v*) and 1 - eps(v*) to the last place, by a table of machine numbers, with proven bounds in ulp.

The table holds the smaller of the two functions, p <= 1/2 (nearly); the other is 1 - p. Panels are the halves of the
panels of `double`, 16 to an octave of v*. Their polynomials are the ones of `double` in the Chebyshev basis, truncated
after T_10. With t the distance from the panel's centre, which is exact,
p = s + (rest), where s = a_0 + a_1 t_1 is exact: a_0, a_1 and t_1 are cut to few bits, and what they lack is in the
rest. Below v* = 2^-4, 1 - eps = v*^2 (c + v*^2 (…)), with a product c v*^2 in two parts. From 2^FOLD on, v* is
divided by a power of 8 (`double`). The bounds hold with and without FMA contraction.

The bits of 2^e m, 1 <= m < 2, are the bits of e and of m; the leading ones are the number of a table's row.

The panels of `double` (arrays.panels): panel 0 is [0, 2^FIRST), FIRST = -4, on which z = v*/2^-4; each octave from
there to 2^(FOLD + PERIOD) has 2^COARSE = 8, FOLD = 20, PERIOD = 3. At 2^20 eps v*^(10/3) is so close to its limit that
eps(8 s) = 2^-10 eps(s) holds to 2^-59. `double`'s rows are polynomials with a proven relative error of 2^-60
(`panel_proof`).

Words: a panel is elastic where its p is 1 - eps, at small v*; z in [-1, 1] is its coordinate, t = (half width) z. An
argument `loss` is true for 1 - eps and false for eps. Errors are in ulp of the true value.
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
"""Bound of the relative error of eps(8^n s) = 2^(-10 n) eps(s), s >= 2^FOLD.

|ln(eps v*^(10/3)) - ln of its limit| is at most `panel_proof.tail`: 2^-59.8 at s = 2^FOLD, and a thousandth of that at
8^n s, n >= 1. The sum of both is below 2^-59.
"""

SPLIT = COARSE + 1
"""2^SPLIT panels to an octave, 16: twice those of `double`. Eight would need two degrees more, and 0.63 ulp."""
NEAR = Fraction(2) ** FIRST
"""Where the panels begin, 2^-4; below, the functions are expanded around 0."""
ZERO_EXPONENT = 324
"""v* is cut off at 2^324. There eps = 1.31 v*^(-10/3) = 2^-1079.6 is below 2^-1075, half the smallest number: 0."""
CLEARED = 26
"""The last bits of v*, half of 53, that t_1 lacks; a_1 is cut to as many bits as leave a_1 t_1 exact.

The bound hardly depends on it: with 22 to 30 it changes by less than 1e-5 ulp (measured).
"""
CENTRE_BITS = 16
"""Leading bits of v* in the leading product c v*^2 of 1 - eps below NEAR.

The bound is 0.5280, 0.5273 and 0.5271 ulp with 14, 16 and 18 bits (measured).
"""
FACTOR_BITS = 21
"""Leading bits of c in that product, which is exact: 2 CENTRE_BITS + FACTOR_BITS = 53, the digits of a double."""
TINY, LIFT = -400, 200
"""v* < 2^TINY is multiplied by 2^LIFT before it is squared, so that only the last product, by 2^(-2 LIFT), underflows.

1 - eps = 1.15 v*^2 is not 0 from v* = 2^-538 on: 2^-338 after the lift, whose square 2^-676 is far from underflow. From
2^TINY on squares are above 2^-800, and need no lift.
"""
NORMAL: Mapping[str, tuple[Fraction, End]] = {
    "epsilon": (Fraction(0), Fraction(2 * 10**92)),
    "one_minus_epsilon": (Fraction(1, 2**511), INFINITY),
}
"""The v* at which a function is a normal number of type double, at least 2^-1022 = 2.2e-308.

eps = 1.31 v*^(-10/3) is 2.8e-308 at v* = 2e92, and 1 - eps = 1.15 v*^2 is 1.15 2^-1022 at v* = 2^-511.
"""

DEGREE = 10
"""Of the panels' polynomials: truncation costs 1.2 ulp for degree 9, 0.022 for 10, 0.0004 for 11 (measured)."""
NEAR_DEGREE = 8
"""Of the polynomial that v*^4 is multiplied by; with 7 the bound is 0.537 ulp instead of 0.527 (measured)."""

_BITS = 128  # of ball arithmetic: 75 more than a double has, so that widths of balls do not show
_PARTS = 4  # of a panel, where errors are bounded; 1 to 16 change the bound by less than 0.005 ulp (measured)
_U = Fraction(1, 2**53)  # unit roundoff of type double


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


def _polynomial(function: str, index: int) -> fmpq_poly:
    """Return a row's polynomial in z on one of the panels of `double`, of one of `FUNCTIONS`, exactly."""
    row = table_row(function, index)
    return fmpq_poly(list(row.a)) * fmpq(2) ** row.exponent


@cache
def smaller_panels() -> tuple[SmallerOnPanel, ...]:
    """Return the panels from `NEAR` to 2^(FOLD + PERIOD); panels where 1 - eps is smaller than eps come first."""
    panels = []
    for index in range(1, PANELS):  # panel 0 is [0, NEAR]
        loss = _polynomial("one_minus_epsilon", index)
        # At the centre, z = 0: 1 - eps < 1/2 < eps.
        elastic = bool(loss[0] < fmpq(1, 2))
        p = loss if elastic else _polynomial("epsilon", index)
        centre, half = Fraction(CENTRES[index]), Fraction(HALF_WIDTHS[index])
        # The left half and the right one: z of the panel is side/2 + (z of its half)/2.
        for side in (-1, 1):
            z_of_panel = fmpq_poly([fmpq(side, 2), fmpq(1, 2)])
            panels.append(SmallerOnPanel(centre + side * half / 2, half / 2, elastic, p(z_of_panel)))
    return tuple(panels)


def _ratio() -> fmpq_poly:
    """Return (1 - eps)/v*^2 on [0, NEAR], a polynomial in z = v*/NEAR."""
    return _over_square(_polynomial("one_minus_epsilon", 0))


def _over_square(loss: fmpq_poly) -> fmpq_poly:
    """Return 1 - eps over v*^2, polynomials in z = v*/NEAR."""
    if loss[0] != 0 or loss[1] != 0:
        raise ValueError("1 - eps is not quadratic at 0")
    return fmpq_poly(loss.coeffs()[2:]) / to_fmpq(NEAR**2)


# x in [-1, 1] as (1 + x)/2 in [0, 1], and back: Chebyshev expansions are on [-1, 1], z on panel 0 is in [0, 1].
_UNIT = fmpq_poly([fmpq(1, 2), fmpq(1, 2)])
_BACK = fmpq_poly([-1, 2])


def _cut_on_unit(p: fmpq_poly, degree: int) -> fmpq_poly:
    """Return the Chebyshev expansion of p on [0, 1], truncated after T_degree."""
    return cut(p(_UNIT), degree)(_BACK)


def _greatest_on_unit(p: fmpq_poly) -> arb:
    """Return a bound of |p| on [0, 1]."""
    return arb(to_fmpq(greatest(p(_UNIT)))).abs_upper()


def _coefficients(p: fmpq_poly, half: Fraction, count: int) -> list[Fraction]:
    """Return the first `count` coefficients with respect to t = half z, given p as a polynomial in z."""
    # p_n z^n = (p_n/half^n) t^n
    return [to_fraction(p[n]) / half**n for n in range(count)]


# --- the table --------------------------------------------------------------------------------------------------------

COLUMNS = ("centre", "a0_high", "a1_high", "a0_low", "a1_low", *(f"a{n}" for n in range(2, DEGREE + 1)))
"""Of a row: eps - base = a0_high + a1_high t_1 + (a0_low + a1_high t_2 + a1_low t + a2 t^2 + …).

t = t_1 + t_2 = v* - centre; base is 1 where the panel is elastic, 0 elsewhere.
"""


def _to_multiple(number: Fraction, unit: Fraction) -> float:
    """Return the multiple of a unit that is nearest to a number."""
    return float(round(number / unit) * unit)


@recorded("full rows")
def panel_table() -> tuple[tuple[float, ...], ...]:
    """Return the table: a row for [0, NEAR], which only eps uses, then one for each panel; `COLUMNS` says of what."""
    # eps - 1 = -v*^2 ratio on [0, NEAR]: the ratio's coefficients are those of t^2 to t^DEGREE, and centre, a0 and a1
    # (five columns) are 0.
    near = _coefficients(-_cut_on_unit(_ratio(), DEGREE - 2), NEAR, DEGREE - 1)
    rows: list[tuple[float, ...]] = [(0.0, 0.0, 0.0, 0.0, 0.0, *map(DOUBLE.nearest, near))]
    for panel in smaller_panels():
        # eps - base is -(1 - eps) or eps.
        p = cut(-panel.p if panel.elastic else panel.p, DEGREE)
        a0, a1, *a = _coefficients(p, panel.half, DEGREE + 1)
        # The unit in the last place of the largest |a0 + a1 t_1|. a0_high and a1_high t_1 are multiples of it, as t_1
        # is one of `step`, so that their sum has at most 53 bits: it is exact (`_check_head`).
        unit = DOUBLE.ulp(abs(a0) + abs(a1) * panel.half)
        a0_high = _to_multiple(a0, unit)
        a1_high = _to_multiple(a1, unit / _step(panel))
        # What they lack, rounded to doubles.
        a0_low, a1_low = DOUBLE.nearest(a0 - Fraction(a0_high)), DOUBLE.nearest(a1 - Fraction(a1_high))
        rows.append((float(panel.centre), a0_high, a1_high, a0_low, a1_low, *map(DOUBLE.nearest, a)))
    return tuple(rows)


def _step(panel: SmallerOnPanel) -> Fraction:
    """Return the distance of neighbouring values of t_1: an ulp of v*, times 2^CLEARED for the bits that t_1 lacks."""
    return DOUBLE.ulp(panel.centre) * Fraction(2) ** CLEARED


@cache
def near_constants() -> dict[str, float]:
    """Return the constants of `near_sums` by name: 1 - eps = v*^2 (c + v*^2 (d0 + d1 v* + …)), c = c_high + c_low."""
    ratio = _ratio()
    c = to_fraction(ratio[0])
    # (ratio - c)/z^2; the coefficient of z is 0 in the true function, and below the table's error in this polynomial.
    rest = fmpq_poly(ratio.coeffs()[2:])
    # z^2 = v*^2/NEAR^2
    quotient = _cut_on_unit(rest, NEAR_DEGREE) / to_fmpq(NEAR**2)
    d = map(DOUBLE.nearest, _coefficients(quotient, NEAR, NEAR_DEGREE + 1))
    # c = 1.15… has its leading bit at 2^0: FACTOR_BITS bits are multiples of 2^(1 - FACTOR_BITS).
    c_high = _to_multiple(c, Fraction(2) ** (1 - FACTOR_BITS))
    return {"c_high": c_high, "c_low": DOUBLE.nearest(c - Fraction(c_high))} | {
        f"d{n}": number for n, number in enumerate(d)
    }


# --- the sequence of operations ---------------------------------------------------------------------------------------


def _cleared(number: Expression, last: int) -> Expression:
    """Return a positive number whose last bits, as many as `last`, are set to 0."""
    return from_bits(bits(number) & ~Word((1 << last) - 1))


def _smaller(word: Name, largest: Word) -> Expression:
    """Return the smaller of two words."""
    return Select(word < largest, word, largest)


@cache
def panel_sums(loss: bool) -> CodeBranch:
    """Return the program from a panel's row to "result": 1 - eps if `loss` is true, else eps.

    t = t1 + t2 is the distance from the centre. `elastic` is true where 1 - eps is on the row.
    """
    # The columns after the centre; the last ones, from 5 on, are a2, a3, …
    a0_high, a1_high, a0_low, a1_low, t, t1, t2 = map(Name, (*COLUMNS[1:5], "t", "t1", "t2"))
    head, lost, rest, exact, elastic = map(Name, ("head", "lost", "rest", "exact", "elastic"))
    reason = "multiples of one unit, and below 2^53 of it"
    program = (
        # rest = a0_low + a1_high t_2 + a1_low t + t^2 q, q = a2 + a3 t + …, at most some per cent of eps - base
        Statement("tt", t * t),
        Statement("q", in_pairs("t", "tt", COLUMNS[5:])),
        Statement("rest", (a0_low + a1_high * t2) + t * (a1_low + t * Name("q"))),
        # exact = a0_high + a1_high t_1, so that eps - base = exact + rest
        Statement("exact", Exact(a0_high + Exact(a1_high * t1, reason), reason)),
        # 1 - eps = (1 - base) - exact - rest and eps = base + exact + rest; base is 1 where elastic, else 0.
        Statement("sum", -exact if loss else exact),
        Statement("base", Select(elastic, ZERO, ONE) if loss else Select(elastic, ONE, ZERO)),
        *sum_with_error(Name("base"), Name("sum")),
    )
    # The rounding error of the leading sum, and the rest, are added in one last rounding.
    return CodeBranch(None, program, {"result": head + (lost - rest if loss else lost + rest)})


def sum_with_error(base: Expression, summand: Expression) -> Program:
    """Return the assignments of `head`, base + summand rounded, and of `lost`, by which it is too small, exactly.

    This is Fast2Sum (Dekker 1971), which is exact if the first number is 0 or not the smaller one; base is 0 or 1.
    """
    # head = fl(base + summand), lost = (base - head) + summand; neither operation of the latter rounds.
    reason = "Fast2Sum"
    return (
        Statement("head", base + summand),
        Statement("lost", Exact(Exact(base - Name("head"), reason) + summand, reason)),
    )


@cache
def near_sums() -> CodeBranch:
    """Return the program of 1 - eps near 0, times a power of 2: v*^2 (c + v*^2 (d0 + d1 v* + …)).

    w is v* times a power of 2, high its leading bits; c = c_high + c_low, and c_high high^2 is exact.
    """
    w, high, c_high = map(Name, ("w", "high", "c_high"))
    reason = "few bits"
    # factor = c_low + v*^2 (d0 + d1 v* + …)
    factor = Name("c_low") + Name("tt") * Name("q")
    program = (
        Statement("tt", Name("v_star") * Name("v_star")),
        Statement("q", in_pairs("v_star", "tt", [f"d{n}" for n in range(NEAR_DEGREE + 1)])),
        # w^2 (c_high + factor) = c_high high^2 + rest,    rest = c_high (w^2 - high^2) + w^2 factor
        Statement("rest", c_high * (Exact(w - high, reason) * (w + high)) + w * w * factor),
    )
    # 16 + 16 + 21 bits: both products are exact.
    leading = Exact(Exact(c_high * high, reason) * high, reason)
    return CodeBranch(None, program, {"factor": factor, "result": leading + Name("rest")})


def _panel(loss: bool) -> CodeBranch:
    """Return the program from `folded`, the bits of an x < 2^(FOLD + PERIOD), to eps(x), or to 1 - eps for `loss`."""
    word, lead, index, centre = map(Name, ("folded", "lead", "index", "centre"))
    # Exponent and first SPLIT bits of the fraction count panels from v* = 2^-1023 on. The first panel, at NEAR, has row
    # 1: so one is subtracted less. All that lies before has row 0.
    before_first = count(((DOUBLE.largest + FIRST) << SPLIT) - 1)
    program: Program = (
        Statement("lead", word >> count(DOUBLE.precision - 1 - SPLIT)),
        Statement("index", Select(lead > before_first, Call("index", (lead - before_first,)), count(0))),
        Statement("row", TableRow("panels", index)),
        *(Statement(name, Column("row", n)) for n, name in enumerate(COLUMNS)),
        # t = x - centre, exactly; t_1 = (x without its last CLEARED bits) - centre, and t_2 is those bits.
        Statement("x", from_bits(word)),
        Statement("x1", _cleared(Name("x"), CLEARED)),
        Statement("t", Name("x") - centre),
        Statement("t1", Name("x1") - centre),
        Statement("t2", Name("x") - Name("x1")),
        # Elastic panels come first, and so does row 0.
        Statement("elastic", index <= count(sum(panel.elastic for panel in smaller_panels()))),
    )
    sums = panel_sums(loss)
    return sums._replace(program=(*program, *sums.program))


def _epsilon() -> Function:
    """Return the function eps(v*): x = |v*|, s = x 8^-n on a panel, eps(x) = 2^(-10 n) eps(s)."""
    word, n, exponent = Name("word"), Name("n"), Name("exponent")
    fold_exponent = count(DOUBLE.largest + FOLD)  # of 2^FOLD, as the bits of a number have it
    # eps falls like x^(-10/3), so by 2^-10 in PERIOD = 3 octaves: the bits of 2^(-10 n).
    scale = Call("uint64", (count(DOUBLE.largest) - count(10 * PERIOD // 3) * n,)) << FRACTION
    start = (
        Statement("word", _smaller(Name("bits"), power_of_two(ZERO_EXPONENT))),
        # n >= 0 is the largest number with s = x 2^(-PERIOD n) >= 2^FOLD, or 0.
        Statement("exponent", Call("uint32", (word >> FRACTION,))),
        Statement("n", Select(exponent > fold_exponent, (exponent - fold_exponent) // count(PERIOD), count(0))),
        Statement("scale", from_bits(scale)),
        # The bits of s: PERIOD n is subtracted from the exponent.
        Statement("folded", word - (Call("uint64", (count(PERIOD) * n,)) << FRACTION)),
    )
    panel = _panel(loss=False)
    scaled = panel._replace(results={"epsilon": panel.results["result"] * Name("scale")})
    return Function("epsilon", ("v_star",), "eps", NOT_NEGATIVE, (_BITS_OF_V, *start), (scaled,), "epsilon")


def _one_minus_epsilon() -> Function:
    """Return the function 1 - eps of v*, which is a series below NEAR, and rounds to 1 from 2^FOLD on."""
    panel, near, tiny = _panel(loss=True), near_sums(), Name("tiny")
    # On a panel; 1 - eps > 1 - 2^-66 from 2^FOLD on, so that v* is cut off there.
    folded = Statement("folded", _smaller(Name("bits"), power_of_two(FOLD)))
    # Near 0: w = v*, or v* 2^LIFT for a tiny one; `high` is w without all but its leading CENTRE_BITS bits.
    start = (
        Statement("tiny", Name("v_star") < Literal(repr(2.0**TINY))),
        Statement("w", Name("v_star") * Select(tiny, Literal(repr(2.0**LIFT)), ONE)),
        Statement("high", _cleared(Name("w"), DOUBLE.precision - CENTRE_BITS)),
    )
    # The result has w^2 = v*^2 2^(2 LIFT): divided by that.
    result = near.results["result"] * Select(tiny, Literal(repr(2.0 ** (-2 * LIFT))), ONE)
    name = "one_minus_epsilon"
    branches = (
        CodeBranch(Name("bits") < power_of_two(FIRST), (*start, *near.program), {name: result}),
        CodeBranch(None, (folded, *panel.program), {name: panel.results["result"]}),
    )
    return Function(name, ("v_star",), "1 - eps", NOT_NEGATIVE, (_BITS_OF_V,), branches, name)


# All bits of v* but its first, the sign, of 8 bytes: those of |v*|, so that -0 is 0.
_BITS_OF_V = Statement("bits", bits(Name("v_star")) & Word((1 << (8 * DOUBLE.bytes - 1)) - 1))


@cache
def full() -> Kernel:
    """Return the kernel of full accuracy: functions of v* in type double, with one table."""
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
    # Where the last product, by a power of 2, is subnormal, it rounds a normal number that is off by `ulps`. The ulp of
    # a subnormal number, the smallest number, is then at least two ulps of that one times the power. So the error is at
    # most 1/2 + ulps/2 smallest numbers: `ulps` and so many more.
    more = (1 + ulps) / 2 - ulps
    return (
        ErrorBound(function, *NORMAL[function], "value", zero, ulps=ulps),
        ErrorBound(function, zero, INFINITY, "value", zero, ulps=ulps, absolute=max(more, zero)),
    )


def largest_ulp(function: str) -> Fraction:
    """Return the largest of the bounds of one of `FUNCTIONS`, of normal results, in ulp of the true value."""
    return max(bounds()[function])


@recorded("full bounds")
def bounds() -> Mapping[str, tuple[Fraction, ...]]:
    """Return bounds of the errors of both functions in ulp of the true value: first on [0, NEAR], then panel by panel.

    Keys are `FUNCTIONS`; the panels' order is that of `smaller_panels`. Those from 2^FOLD on hold for all larger v*,
    too. The bounds are proven (docs/reference/full-kernels.md), and hold with and without FMA contraction.
    """
    check_panel_results()
    with working(_BITS):
        # On [0, NEAR] eps comes from the table's first row, 1 - eps from `near_sums`.
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
    # Polynomials in t, with any numbers for the row that differ, so that an exchange is seen: here 1.375, 2.375, …
    t, row = fmpq_poly([0, 1]), {name: 1.375 + n for n, name in enumerate(COLUMNS)}
    for elastic, loss in product((False, True), repeat=2):
        sums = panel_sums(loss)
        # Any t_1 and t_2 with the sum t: a third and two.
        inputs: dict[str, fmpq_poly | bool] = {"t": t, "t1": t / 3, "t2": t * 2 / 3, "elastic": elastic}
        # p = eps - base
        p = sum((exact_polynomial(sums, name, inputs, row) for name in ("exact", "rest")), fmpq_poly([]))
        eps = 1 + p if elastic else p
        # Any leading sum, here t^7 - 3, as `lost` makes up for what it lacks.
        inputs["head"] = t**7 - 3
        if exact_polynomial(sums, "result", inputs, row) != (1 - eps if loss else eps):
            raise ArithmeticError("the results of a panel are not eps and 1 - eps")


def rounded_numbers(names: Sequence[str], values: Sequence[float], **inputs: arb) -> dict[str, Rounded]:
    """Return coefficients by name, and exact inputs of type double within balls, as numbers that bound their errors."""
    numbers = dict(zip(names, map(arb, values), strict=True)) | inputs
    return {name: Rounded(value, DOUBLE) for name, value in numbers.items()}


def _in_ulp(error: arb, least: arb) -> Fraction:
    """Return the bound of a result of at least `least` that is rounded once after it had `error`, in ulp.

    Where `error`, less than an ulp, moves it up across a power of 2, it is rounded to this power.
    """
    unit = ball_of(DOUBLE.ulp(exact_middle(least.lower())))
    # Half an ulp for the last rounding.
    return Fraction(1, 2) + magnitude(error.abs_upper() / unit)


def panel_bound(index: int, loss: bool) -> Fraction:
    """Return the bound in ulp of 1 - eps (`loss`) or eps on a panel by its index: the largest of those of its parts."""
    panel, row = smaller_panels()[index], panel_table()[1 + index]  # row 0 is that of [0, NEAR]
    _check_head(panel, row)
    # The machine polynomial, which is eps - base, exactly in z, and how far it is from the proven one.
    machine = _row_polynomial(row, fmpq_poly([0, to_fmpq(panel.half)]))
    difference = greatest(machine * (-1 if panel.elastic else 1) - panel.p)
    # The proven one is off by a relative error of its own, and beyond 2^FOLD by that of folding.
    relative = ball_of(TABLE_ERROR + (FOLD_ERROR if panel.centre > 2**FOLD else 0))

    def bound(low: Fraction, high: Fraction) -> Fraction:
        """Return the bound for low <= z <= high."""
        p, t = arb_poly(panel.p)(interval_ball(low, high)), interval_ball(panel.half * low, panel.half * high)
        # |p - true| <= relative |true| <= relative/(1 - relative) |p|, which relative (1 + 2 relative) |p| exceeds.
        approximation_error = arb(to_fmpq(difference)).abs_upper() + p.abs_upper() * relative * (1 + 2 * relative)
        # t_2 is below the step of t_1.
        numbers = rounded_numbers(COLUMNS, row, t=t, t2=interval_ball(Fraction(0), _step(panel)))
        rest = rounded_results(panel_sums(loss), ["rest"], numbers, DOUBLE)["rest"]
        # The function that is on the row: base is 0, and the leading sum exact. (p is this function, the smaller one.)
        if loss == panel.elastic:
            return _in_ulp(rest.absolute + approximation_error, p)
        # The leading part's sum with 1 leaves at most half an ulp of 1 to be added to the rest.
        lost = Rounded(arb(0, half_unit(arb(1), DOUBLE)), DOUBLE)
        return _in_ulp((lost + rest).absolute + approximation_error, 1 - p)

    # Ends of equal parts of [-1, 1]: (2 m - n)/n for m = 0 … n.
    return max(bound(*ends) for ends in pairwise(Fraction(2 * m - _PARTS, _PARTS) for m in range(_PARTS + 1)))


def _row_polynomial(row: Sequence[float], t: fmpq_poly) -> fmpq_poly:
    """Return what a row stands for at t, exactly: eps - base, however t_1 and t_2 (here a third and two) share t."""
    inputs, numbers = {"t": t, "t1": t / 3, "t2": t * 2 / 3}, dict(zip(COLUMNS, row, strict=True))
    return sum(
        (exact_polynomial(panel_sums(False), name, inputs, numbers) for name in ("exact", "rest")), fmpq_poly([])
    )


def _check_head(panel: SmallerOnPanel, row: Sequence[float]) -> None:
    """Check that a0_high + a1_high t_1 of a panel and its row is exact, the product as well.

    Both are multiples of one unit, and below 2^53 of it, the numbers that a double holds exactly.
    """
    a0_high, a1_high, step = Fraction(row[1]), Fraction(row[2]), _step(panel)
    unit = DOUBLE.ulp(abs(a0_high) + abs(a1_high) * panel.half)
    # |t_1| is at most half a panel, and a step more as it is rounded.
    largest = abs(a0_high) + abs(a1_high) * (panel.half + step)
    if (a0_high / unit).denominator != 1 or (a1_high * step / unit).denominator != 1 or largest > 2**53 * unit:
        raise ArithmeticError(f"the leading part is not exact on the panel around {float(panel.centre)}")


def _near_bound() -> Fraction:
    """Bound the error of 1 - eps on [0, NEAR], in ulp; errors are relative to v*^2 until the last line but one."""
    ratio, sums, constants = _ratio(), near_sums(), near_constants()
    # (1 - eps)/v*^2 is between c - d and c + d, with c at v* = 0 and the largest difference d.
    least = arb(ratio[0]) - _greatest_on_unit(ratio - ratio[0])
    most = (2 * arb(ratio[0]) - least).abs_upper()
    approximation_error = most * ball_of(TABLE_ERROR)
    # The machine polynomial over v*^2: w is v* times any power of 2, here 2, whose square 4 is divided out, and `high`
    # any part of it, here a third.
    x = fmpq_poly([0, to_fmpq(NEAR)])
    inputs = {"v_star": x, "w": 2 * x, "high": x / 3}
    machine = exact_polynomial(sums, "result", inputs, constants) / 4
    approximation_error += _greatest_on_unit(_over_square(machine) - ratio)
    # Rounding errors, all v* in one interval.
    numbers = rounded_numbers(list(constants), list(constants.values()), v_star=interval_ball(Fraction(0), NEAR))
    factor = rounded_results(sums, ["factor"], numbers, DOUBLE)["factor"]
    error = _product_error(constants["c_high"], factor) + approximation_error
    # A relative error e is at most 2^53 e ulp: an ulp is above 2^-53 of the number.
    in_ulp: Fraction = magnitude(error.abs_upper() / least) * 2**DOUBLE.precision
    # Half an ulp for the last rounding. Underflow of intermediate results, 2^-1075 at most each, is below 2^-60 ulp of
    # a result of at least 2^(2 TINY) = 2^-800.
    return Fraction(1, 2) + in_ulp + Fraction(1, 2**60)


def _product_error(c_high: float, factor: Rounded) -> arb:
    """Bound the error of c_high (w^2 - high^2) + w^2 factor, with the rounding of this sum, in units of w^2."""
    u = ball_of(_U)
    # w - high < 2^(1 - CENTRE_BITS) w and w + high <= 2 w. That product has three roundings: the sum w + high, and two
    # products; w - high is exact.
    first = arb(c_high) * arb(2) ** (2 - CENTRE_BITS)
    # w^2 factor has two, besides the error of `factor`.
    second = factor.value.abs_upper() + factor.absolute
    error = first * ((1 + u) ** 3 - 1) + factor.absolute + second * ((1 + u) ** 2 - 1)
    # The sum of both rounds once more.
    return error + u * (first + second + error)


def _near_one_bound() -> Fraction:
    """Bound the error of eps on [0, NEAR] in ulp, from the table's first row, which has 1 - eps there."""
    ratio, row = _ratio(), panel_table()[0]
    # Errors over v*^2: of the proven polynomial, relative to the largest value, and the distance of the row from it.
    most = (arb(ratio[0]) + _greatest_on_unit(ratio - ratio[0])).abs_upper()
    machine = -_row_polynomial(row, fmpq_poly([0, to_fmpq(NEAR)]))
    approximation_error = most * ball_of(TABLE_ERROR) + _greatest_on_unit(_over_square(machine) - ratio)
    # The row has no leading part, so that eps = 1 + rest, however t = t_1 + t_2 is shared; t_2 = t is the largest.
    x = interval_ball(Fraction(0), NEAR)
    rest = rounded_results(panel_sums(False), ["rest"], rounded_numbers(COLUMNS, row, t=x, t2=x), DOUBLE)["rest"]
    # eps = 1 + rest >= 1 - max |rest|, but for errors of 2^-53; twice |rest| is ample, and leaves eps above 1/2.
    return _in_ulp(rest.absolute + approximation_error * ball_of(NEAR**2), 1 - rest.value.abs_upper() * 2)
