"""Checks of arguments: a refusal is one line that names the value and the accepted ones."""

from __future__ import annotations

import operator
import re
from collections.abc import Callable
from decimal import Decimal
from fractions import Fraction
from typing import Any, SupportsIndex

MAX_ORDER = 1000
MAX_DIGITS = 5000
MAX_DEGREE = 200  # of numerator and denominator
MAX_CHARACTERS = 20_000
MAX_EXPONENT = 100_000

_DECIMAL = re.compile(r"[+-]?([0-9]+[.]?[0-9]*|[.][0-9]+)([eE][+-]?[0-9]{1,9})?")


def integer(name: str, value: SupportsIndex, low: int, high: int) -> int:
    """Return an integer argument within [low, high] as an int.

    Raises
    ------
    TypeError
        If `value` is not an integer (a bool or a float is not).
    ValueError
        If it lies outside the range.
    """
    accepted = f"accepted is an integer from {low} to {high}"
    if isinstance(value, bool) or not hasattr(value, "__index__"):
        raise TypeError(f"{name} is {value!r}: {accepted}")
    number = operator.index(value)
    if not low <= number <= high:
        raise ValueError(f"{name} is {number}: {accepted}")
    return number


def order(value: SupportsIndex) -> int:
    """Return the order of a series as an int from 0 to `MAX_ORDER`."""
    return integer("order", value, 0, MAX_ORDER)


def digits(value: SupportsIndex) -> int:
    """Return a number of significant digits as an int from 1 to `MAX_DIGITS`."""
    return integer("digits", value, 1, MAX_DIGITS)


def exact_number(name: str, value: object, accepted: str, allowed: Callable[[Fraction], bool]) -> Fraction:
    """Return a finite number as an exact fraction: a string is read as a decimal number, never through a float.

    Parameters
    ----------
    name, accepted : str
        For the message: what the number is, and which numbers are accepted, in words.
    value : str, int, float, Fraction, Decimal, mpmath.mpf or NumPy scalar
        Exponents beyond 10^±100000 are refused.
    allowed : callable
        Whether a number is accepted.

    Raises
    ------
    TypeError
        If `value` is not a real number.
    ValueError
        If it is not finite, not a number in a string, or not allowed.
    """
    number = _fraction(value)
    if number is None:
        kind = ValueError if isinstance(value, str | float | Decimal) or _is_mpf(value) else TypeError
        raise kind(f"{name} is {_short(value)}: accepted is {accepted}")
    if not allowed(number):
        raise ValueError(f"{name} is {_short(value)}: accepted is {accepted}")
    return number


def _fraction(value: Any) -> Fraction | None:
    """Return the number, or None if it is none (or is infinite, or far too large)."""
    if isinstance(value, str):
        if len(value) > MAX_CHARACTERS or not _DECIMAL.fullmatch(value.strip()):
            return None
        value = Decimal(value.strip())
    if isinstance(value, Decimal):
        if not value.is_finite() or abs(value.adjusted()) > MAX_EXPONENT:
            return None
        return Fraction(value)
    if _is_mpf(value):
        sign, mantissa, exponent, _ = value._mpf_
        if (not mantissa and exponent) or abs(exponent) > 4 * MAX_EXPONENT:
            return None
        return int(-mantissa if sign else mantissa) * Fraction(2) ** int(exponent)
    if isinstance(value, bool | type):
        return None
    if hasattr(value, "__index__") and not getattr(value, "ndim", 0):
        return Fraction(operator.index(value))
    if not hasattr(value, "as_integer_ratio"):
        return None
    try:
        return Fraction(*value.as_integer_ratio())
    except (ValueError, OverflowError):  # NaN, infinity
        return None


def _is_mpf(value: object) -> bool:
    return hasattr(value, "_mpf_")


def _short(value: object) -> str:
    text = repr(value)
    return text if len(text) <= 60 else text[:40] + "…" + text[-10:]
