"""Directed rounding of bounds to short decimal numbers."""

from __future__ import annotations

import math
from decimal import ROUND_CEILING, ROUND_FLOOR, Context, Decimal
from fractions import Fraction

from flint import arb

DIGITS = 3  # of a printed bound, a choice: rounding to three digits widens it by at most 1 %


def above(number: Fraction) -> str:
    """Return a number as text, rounded up to 15 digits."""
    return _decimal(number, ROUND_CEILING)


def below(number: Fraction) -> str:
    """Return a number as text, rounded down to 15 digits."""
    return _decimal(number, ROUND_FLOOR)


def _decimal(number: Fraction, rounding: str) -> str:
    """Return a number as text, rounded to 15 digits, which every double holds; `rounding` is a rule of `decimal`."""
    context = Context(prec=15, rounding=rounding)
    value = context.divide(Decimal(number.numerator), Decimal(number.denominator)).normalize(context)
    # A choice of layout: 0.0001 … 10^16 in positional notation, which shows 15 digits with at most four zeros more.
    return f"{value:f}" if -5 < value.adjusted() < 16 else f"{value:e}"


def rounded_up(bound: arb, digits: int = DIGITS) -> Fraction:
    """Return a positive upper bound, rounded up to a short decimal number, which it is as a fraction.

    Raises
    ------
    ArithmeticError
        If it is infinite or NaN, for which FLINT's decimals are 0.
    """
    if not bound.is_finite():
        raise ArithmeticError(f"the bound is {bound}, which is no number")
    # Twenty digits more than are kept, a choice: the conversion to decimals then adds less than 10^-19 of the bound.
    middle, radius, exponent = (int(part) for part in bound.abs_upper().mid_rad_10exp(digits + 20))
    return Fraction(_rounded((middle + radius) * Fraction(10) ** exponent, digits, ROUND_CEILING))


def at_most(number: Fraction | float, digits: int = DIGITS) -> str:
    """Return a positive number as text, rounded up to a short decimal number: an upper bound for print."""
    return _short(number, digits, ROUND_CEILING)


def at_least(number: Fraction | float, digits: int = DIGITS) -> str:
    """Return a positive number as text, rounded down to a short decimal number: a lower bound for print."""
    return _short(number, digits, ROUND_FLOOR)


def _short(number: Fraction | float, digits: int, rounding: str) -> str:
    """Return a number as text, rounded to `digits` digits; below 0.001 with an exponent."""
    if number == math.inf:
        return "inf"
    decimal = _rounded(Fraction(number), digits, rounding)
    return f"{decimal:e}" if decimal.adjusted() < -3 else f"{decimal:f}"


def _rounded(number: Fraction, digits: int, rounding: str) -> Decimal:
    """Return a number rounded to `digits` digits, without zeros at the end."""
    context = Context(prec=digits, rounding=rounding)
    return context.divide(Decimal(number.numerator), Decimal(number.denominator)).normalize(context)


def identifier(number: str) -> str:
    """Return a decimal number as a part of a name: "." becomes p, "-" m."""
    return number.replace(".", "p").replace("-", "m").replace("+", "")
