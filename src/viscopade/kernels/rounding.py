r"""Rounding bounds of quotients: running error bounds for the exported code, in ball arithmetic.

The code evaluates numerator and denominator by Horner's rule and divides once, rounding to nearest:

    s_i = fl(c_i + fl(v* s_{i+1})),    |fl(x) - x| <= u |x| + eta,

u = 2^-precision; eta is half the smallest subnormal number. Where a compiler contracts a product and a sum to one
operation (FMA), one of the two roundings is gone, and the bound holds as well. So it does in any wider format.
"""

from __future__ import annotations

from collections.abc import Sequence
from fractions import Fraction

from flint import arb

from viscopade.arithmetic.balls import ball_of, working
from viscopade.arithmetic.formats import Format
from viscopade.kernels.certificate import speeds

BITS = 128
PARTS = 4  # of a panel
MORE_PARTS = (PARTS, 16, 64)  # the more, the less do enclosures of alternating sums exceed what they enclose


def quotient_rounding(
    a: Sequence[Fraction],
    b: Sequence[Fraction],
    form: Format,
    low: Fraction,
    high: Fraction,
    coefficients: bool = False,
) -> arb:
    """Bound the relative rounding error of the computed quotient for low <= v* <= high.

    Parameters
    ----------
    a, b : sequence of Fraction
        Coefficients in ascending order, numbers of the format.
    form : Format
    low, high : Fraction
        Interval of v*, of which every number of the format is meant.
    coefficients : bool
        Whether the coefficients are rounded to the format, too.

    Raises
    ------
    ArithmeticError
        If numerator or denominator may vanish.
    """
    with working(BITS):
        bounds = [_on_part(a, b, form, v_star, coefficients) for v_star in speeds(low, high, PARTS)]
        return max(bounds).abs_upper()


def derivative(t: Sequence[Fraction], b: Sequence[Fraction], form: Format, low: Fraction, high: Fraction) -> arb:
    """Bound the relative rounding error of the computed v* T/(D D), where nothing underflows.

    Arguments and errors as for `quotient_rounding`.
    """
    with working(BITS):
        for parts in MORE_PARTS:
            try:
                bounds = [_derivative_on_part(t, b, form, v_star) for v_star in speeds(low, high, parts)]
            except ArithmeticError:
                continue
            return max(bounds).abs_upper()
    raise ArithmeticError("the derivative may vanish within its rounding error")


def _derivative_on_part(t: Sequence[Fraction], b: Sequence[Fraction], form: Format, v_star: arb) -> arb:
    unit = arb(2) ** -form.precision
    above, below = _relative(t, form, v_star), _relative(b, form, v_star)
    # v* T, D D and their quotient are rounded once each.
    return ((1 + above) * (1 + unit) ** 2 / ((1 - below) ** 2 * (1 - unit)) - 1).abs_upper()


def _relative(coefficients: Sequence[Fraction], form: Format, v_star: arb) -> arb:
    """Bound the relative error of Horner's rule."""
    value, error = horner_with_error(coefficients, form, v_star)
    if not abs(value) > 2 * error:
        raise ArithmeticError("the polynomial may vanish within its rounding error")
    return (error / abs(value)).abs_upper()


def _on_part(a: Sequence[Fraction], b: Sequence[Fraction], form: Format, v_star: arb, rounded: bool) -> arb:
    unit = arb(2) ** -form.precision
    (numerator, numerator_error), (denominator, denominator_error) = (
        horner_with_error(c, form, v_star, rounded) for c in (a, b)
    )
    for value, error in ((numerator, numerator_error), (denominator, denominator_error)):
        if not abs(value) > 2 * error:
            raise ArithmeticError("numerator or denominator may vanish within its rounding error")
    above = 1 + numerator_error / abs(numerator)
    below = 1 - denominator_error / abs(denominator)
    return (above / below * (1 + unit) - 1).abs_upper()


def horner_with_error(
    coefficients: Sequence[Fraction], form: Format, v_star: arb, rounded: bool = False
) -> tuple[arb, arb]:
    """Return an enclosure of the polynomial, and a bound of the rounding error of Horner's rule and coefficients."""
    unit, eta = arb(2) ** -form.precision, arb(2) ** (1 - form.largest - form.precision)
    speed = abs(v_star).abs_upper()
    own = unit if rounded else arb(0)
    total = ball_of(coefficients[-1])
    error = own * abs(total)
    for c in reversed(coefficients[:-1]):
        product = speed * (abs(total).abs_upper() + error)
        exact = v_star * total + ball_of(c)
        error = speed * error + unit * product + eta + own * abs(ball_of(c))
        error += unit * (abs(exact).abs_upper() + error) + eta
        total = exact
    return total, error.abs_upper()
