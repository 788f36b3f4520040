"""Ball arithmetic with FLINT (`flint.arb`), and correctly rounded decimals, mpf and doubles from balls.

A ball is an interval middle ± radius that is proven to contain a real number. Every operation of FLINT rounds the
radius up, so that the result's ball contains the true result.

FLINT's working precision is global; `working` sets it for a `with` block and restores it. A lock makes other threads
that use `working` wait, so that the precision does not change within the block.

This module also makes FLINT's balls picklable.
"""

from __future__ import annotations

import copyreg
from collections.abc import Hashable, Iterable, Iterator
from contextlib import contextmanager
from decimal import ROUND_HALF_EVEN, Context, Decimal
from fractions import Fraction
from threading import RLock
from typing import TYPE_CHECKING, Any

from flint import acb, arb, arb_series, ctx

if TYPE_CHECKING:
    from mpmath import mp

_turn = RLock()

BITS_PER_DIGIT = 3.3219280948873626  # log2(10), rounded up in the last place
# Of a decimal number: Decimal's default of 999999 would turn larger ones into infinity. A choice, beyond all numbers
# here.
_LARGEST_EXPONENT = 10**9
# More digits than the caller asks for, a choice: FLINT adds up to a unit of the last digit to the radius, which is then
# less than 10^-14 of a unit of the caller's last digit.
_GUARD_DIGITS = 15


def bits_for(digits: int) -> int:
    """Return the number of bits that hold `digits` decimal digits."""
    return int(digits * BITS_PER_DIGIT) + 1


@contextmanager
def working(bits: int, length: int | None = None) -> Iterator[None]:
    """Set FLINT's precision (`ctx.prec`) and the truncation length of power series (`ctx.cap`) for a `with` block.

    Parameters
    ----------
    bits : int
        Bits of the middles of balls.
    length : int, optional
        Number of coefficients of a power series; by default FLINT's present one remains.
    """
    with _turn:  # one thread at a time: FLINT has one context for all threads
        saved = ctx.prec, ctx.cap
        ctx.prec = bits
        if length is not None:
            ctx.cap = length
        try:
            yield
        finally:
            ctx.prec, ctx.cap = saved


def context(bits: int) -> Any:
    """Return a separate mpmath context with this precision in bits; the global one stays unchanged."""
    from mpmath import mp  # imported here, because ready kernels do not need it

    separate = mp.clone()
    separate.prec = bits
    return separate


def fixed_point(value: int, error: int, bits: int) -> arb:
    """Return the ball value/2^bits ± error/2^bits; exact if FLINT's precision holds `value`."""
    return arb(value, error) * arb(2) ** (-bits)


def ball_of(number: Fraction) -> arb:
    """Return the ball of a fraction; exact if FLINT's precision holds it."""
    return arb(number.numerator) / number.denominator


def rational_power(base: arb, exponent: Fraction) -> arb:
    """Return a power of a positive ball."""
    # base^(p/q) is the q-th root of base^p.
    power: arb = (base**exponent.numerator).root(exponent.denominator)
    return power


def power_of_series(series: arb_series, exponent: Fraction) -> arb_series:
    """Return a power of a series with a positive constant term."""
    if exponent.denominator == 1:
        return series ** int(exponent)
    return (series.log() * ball_of(exponent)).exp()


def decimal_string(ball: arb, digits: int) -> str | None:
    """Return the number that `ball` encloses, correctly rounded to `digits` significant digits.

    Returns
    -------
    str or None
        None if the ball is too wide; "0" or all digits of an integer if the ball is exactly an integer.
    """
    # An exact integer has all its digits.
    if ball.is_exact() and ball.is_integer():
        return str(ball.unique_fmpz())
    if not ball.is_finite():
        return None
    # The ball in decimals: it lies within (middle ± radius) 10^exponent.
    middle, radius, exponent = _in_powers_of_10(ball, digits)

    # Rounding is monotone: if both ends of the ball round to one decimal number, so does every number between them.
    decimal_context = Context(prec=digits, rounding=ROUND_HALF_EVEN, Emin=-_LARGEST_EXPONENT, Emax=_LARGEST_EXPONENT)
    rounded_ends = {
        decimal_context.create_decimal(Decimal((int(end < 0), Decimal(abs(end)).as_tuple().digits, exponent)))
        for end in (middle - radius, middle + radius)
    }
    if len(rounded_ends) != 1:
        return None
    (number,) = rounded_ends
    return str(number).lower() if number else None


def _in_powers_of_10(ball: arb, digits: int) -> tuple[int, int, int]:
    """Return integers: the ball lies within (middle ± radius) 10^exponent, of `digits` digits or more."""
    # All digits that the ball determines, as it may lie much closer to a boundary of rounding than the guard digits.
    # An exact ball has all bits of its middle; of another one log2(|middle|/radius) bits are certain.
    accurate_bits = ball.bits() if ball.is_exact() else ball.rel_accuracy_bits()
    count = max(digits, int(accurate_bits / BITS_PER_DIGIT)) + _GUARD_DIGITS
    # FLINT multiplies by a power of 10 and rounds to an integer: 64 bits (a machine word) more than the digits need.
    with working(bits_for(count) + 64):
        middle, radius, exponent = (int(part) for part in ball.mid_rad_10exp(count))
    return middle, radius, exponent


def to_mpf(ball: arb) -> mp.mpf:
    """Return the ball's middle as an mpmath number, exactly."""
    from mpmath import mp

    mantissa, exponent = ball.mid().man_exp()
    return mp.make_mpf((int(mantissa < 0), abs(int(mantissa)), int(exponent), int(abs(mantissa)).bit_length()))


def decimal_at(ball: arb, size: arb, digits: int) -> str | None:
    """Return the number in `ball`, correctly rounded at the decimal place of the `digits`-th digit of `size`.

    Real and imaginary part of a complex number are rounded in this way at one place, `size` being the modulus.

    Returns None if the ball is too wide, and "0" if the number rounds to 0 at that place.
    """
    # The first digit of `size` has the place _exponent(size), the digit number `digits` the place below.
    place = _exponent(size) - digits + 1
    # The ball in decimals: it lies within (middle ± radius) 10^exponent.
    middle, radius, exponent = _in_powers_of_10(ball, digits)

    # Both ends of the ball, rounded to integers in units of 10^place: if they agree, so does every number between them.
    units_of_place = Fraction(10) ** (exponent - place)
    rounded_ends = {round(end * units_of_place) for end in (middle - radius, middle + radius)}
    if len(rounded_ends) != 1:
        return None
    # integer 10^place: a part is no larger than the modulus, so `digits` digits hold it, and one that a carry may add;
    # five, a choice, allow for numbers up to 10^5 times `size`.
    decimal_context = Context(prec=digits + 5, Emin=-_LARGEST_EXPONENT, Emax=_LARGEST_EXPONENT)
    number = Decimal(rounded_ends.pop()).scaleb(place, decimal_context)
    return str(number).lower() if number else "0"


def _exponent(size: arb) -> int:
    """Return the decimal exponent of a positive ball's middle."""
    # The integer has five digits (any number serves) or more; its length and the exponent of its last digit give that
    # of the first one.
    middle, _, exponent = (int(part) for part in size.mid().mid_rad_10exp(5))
    return exponent + len(str(middle)) - 1


def relative_digits(balls: Iterable[arb]) -> int:
    """Return the least number of accurate decimal digits among the inexact balls."""
    # If all are exact, 10^9 bits: more than anybody asks for.
    bits = min((ball.rel_accuracy_bits() for ball in balls if not ball.is_exact()), default=10**9)
    return int(bits / BITS_PER_DIGIT)


def exact_middle(ball: arb) -> Fraction:
    """Return the ball's middle as a fraction."""
    mantissa, exponent = (int(part) for part in ball.mid().man_exp())
    return Fraction(mantissa << exponent) if exponent >= 0 else Fraction(mantissa, 1 << -exponent)


def magnitude(ball: arb) -> Fraction:
    """Return an upper bound of the absolute value, as a fraction."""
    return exact_middle(ball.abs_upper())


def interval_ball(low: Fraction, high: Fraction) -> arb:
    """Return a ball that contains the interval [low, high]."""
    return ball_of(low).union(ball_of(high))


def coefficient_sum(coefficients: Iterable[arb]) -> arb:
    """Return an upper bound of |p(z)| for |z| <= 1, given the coefficients of p."""
    return sum((abs(c) for c in coefficients), arb(0)).abs_upper()


def known_decimal(ball: arb, digits: int) -> str:
    """Return the number that `ball` encloses, rounded to `digits` digits, or to fewer if the ball determines fewer.

    Raises
    ------
    ArithmeticError
        If it determines none.
    """
    # The first number of digits, from the largest, at which both ends of the ball round to one decimal number.
    for count in range(digits, 0, -1):
        text = decimal_string(ball, count)
        if text is not None:
            return text
    raise ArithmeticError(f"the enclosure {ball} determines no digit")


class Determined:
    """A record of enclosures. Two records of one class are equal if they prove the same decimals."""

    def proven(self) -> Hashable:
        """Return the proven decimals."""
        raise NotImplementedError

    def __eq__(self, other: object) -> bool:
        """Whether the other record proves the same."""
        return self.proven() == other.proven() if isinstance(other, type(self)) else NotImplemented

    def __hash__(self) -> int:
        """Return the same number for equal records."""
        return hash(self.proven())


def parts_of(ball: arb) -> tuple[Any, ...]:
    """Return a function and its arguments whose result is exactly this ball: what `pickle` stores."""
    # Infinities and NaN have no mantissa. Text serves for them, except for +infinity, which FLINT writes as [+/- inf].
    if not ball.is_finite():
        return (arb.pos_inf, ()) if ball > 0 else (arb, (str(ball),))
    # arb((m, e), (r, f)) is the ball m 2^e ± r 2^f.
    middle, (mantissa, exponent) = ball.mid().man_exp(), map(int, ball.rad().man_exp())
    # A radius has 30 bits, and the constructor rounds it up. If all 30 are needed, it adds a unit even to an exact
    # radius; (2 r - 1) 2^(f-1), half a unit less, is then rounded up to r 2^f.
    radii = (mantissa, exponent), (2 * mantissa - 1, exponent - 1)
    return arb, (
        (int(middle[0]), int(middle[1])),
        next(radius for radius in radii if arb(middle, radius).rad() == ball.rad()),
    )


copyreg.pickle(arb, parts_of)
copyreg.pickle(acb, lambda ball: (acb, (ball.real, ball.imag)))
