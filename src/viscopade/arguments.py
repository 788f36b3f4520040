"""Checks of arguments; an error message is one line that names the value and the expected ones.

Quantities of other packages, such as Astropy and Pint, are recognised by their attributes; no package is imported.
"""

from __future__ import annotations

import numbers
import operator
import re
import reprlib
from collections.abc import Callable, Iterable
from decimal import Decimal
from difflib import get_close_matches
from fractions import Fraction
from typing import Any, SupportsIndex

# Largest requests. They are chosen by hand, so that a typing error is refused and not computed for hours.
MAX_ORDER = 1000  # highest power of v* in a series
MAX_DIGITS = 5000  # significant decimal digits
MAX_DEGREE = 200  # of numerator and denominator
MAX_CHARACTERS = 20_000  # of a number as text: four times the digits of MAX_DIGITS
MAX_EXPONENT = 100_000  # decimal; "1e999999999" would become an integer of 10^9 digits

UNITS = {
    "speed": "m/s",
    "sigma_speed": "m/s",
    "fastest": "m/s",
    "beta": "s^(1/5)/m^(1/5)",
    "radius": "m",
    "mass": "kg",
    "density": "kg/m^3",
    "young_modulus": "Pa",
    "yield_strength": "Pa",
    "dissipative_constant": "s",
    "contact_time": "s",
    "gravity": "m/s^2",
    "air_density": "kg/m^3",
    "terminal_speed": "m/s",
    "instants": "s",
    "heights": "m",
}
"""SI unit of each argument with a unit, in a form that Astropy and Pint both read."""

_MARKS = ("unit", "units", "dimensionality")  # attributes of quantities: Astropy's have the first, Pint's the others
_REPR = reprlib.Repr()
_REPR.maxstring = _REPR.maxother = _REPR.maxlong = 60  # characters of a value in a message of one line; a choice
# A decimal number; nine digits of an exponent are read, and refused if they exceed MAX_EXPONENT.
_DECIMAL = re.compile(r"[+-]?([0-9]+[.]?[0-9]*|[.][0-9]+)([eE][+-]?[0-9]{1,9})?")
_WITH_COMMA = re.compile(r"\s*[+-]?[0-9]*,[0-9]+([eE][+-]?[0-9]+)?(?![0-9,.])")  # such as "0,5" and "2,5 cm/s"
_PERCENTAGE = re.compile(r"\s*([+-]?[0-9]{1,9}(?:\.[0-9]{1,9})?) ?%\s*")  # such as "83.67 %"; 9 digits are a choice


def without_unit(name: str, value: Any, unit: str | None = None) -> Any:
    """Return an argument without its unit: a quantity of Astropy or Pint becomes its number in the SI unit.

    Parameters
    ----------
    name : str
        The argument's name, by which `UNITS` has its unit.
    value : object
        A value without a unit is returned unchanged, and a dimensionless quantity as its number.
    unit : str, optional
        The argument's unit, in place of the one in `UNITS`.

    Raises
    ------
    TypeError
        If the value has a different dimension, or its unit cannot be converted.
    """
    # A list of plain numbers has no unit; one of quantities is converted element by element.
    if isinstance(value, list | tuple):
        if all(issubclass(kind, numbers.Number | str) for kind in {*map(type, value)}):
            return value
        return [without_unit(name, part, unit) for part in value]
    if hasattr(value, "data_vars"):  # of xarray; the variables may have units
        raise TypeError(refusal(name, value, "one variable of the data set"))
    if _is_marked(data := getattr(value, "data", None)):  # a container of xarray
        return value.copy(data=without_unit(name, data, unit))
    if isinstance(value, type) or not _is_marked(value):
        return value
    si_unit = UNITS.get(name, "") if unit is None else unit
    attributes = getattr(value, "attrs", None)  # of xarray: a unit is a text among them
    if isinstance(attributes, dict) and {*map(attributes.get, _MARKS)} <= {None, "", "1", "dimensionless", si_unit}:
        bare = value.copy(deep=False)
        bare.attrs = {key: text for key, text in attributes.items() if key not in _MARKS}
        return bare
    # Convert to the SI unit, or else to a plain number, which a dimensionless quantity is. Astropy's result has
    # `value`, Pint's `magnitude`.
    for target_unit in (si_unit, ""):
        try:
            converted = value.to(target_unit)
            number = converted.magnitude if hasattr(converted, "magnitude") else converted.value
        except (AttributeError, TypeError, ValueError, ArithmeticError):  # bases of the packages' own errors
            continue
        if hasattr(value, "mask") and not hasattr(number, "mask"):  # a masked column of Astropy
            from numpy.ma import array

            return array(number, mask=value.mask)
        return number
    accepted = f"a quantity in {si_unit} or a like unit, or a number" if si_unit else "a number without a dimension"
    raise TypeError(refusal(name, value, accepted))


def _is_marked(value: object) -> bool:
    """Return whether a value is a quantity with a unit, of Astropy, Pint or xarray."""
    return any(getattr(value, mark, None) is not None for mark in _MARKS)


def refusal(name: str, value: object, accepted: str) -> str:
    """Return the error message for an argument: one line with its name, its value and the `accepted` ones."""
    try:
        text = " ".join(_REPR.repr(value).split())
    except ValueError:  # an integer with more digits than Python prints
        text = "an integer of thousands of digits"
    return f"{name} is {text}: expected {accepted}{spelling_advice(value)}"


def spelling_advice(value: object) -> str:
    """Return, as the end of a refusal, how to spell a number with a decimal comma, or a percentage; else ""."""
    if not isinstance(value, str):
        return ""
    if percentage := _PERCENTAGE.fullmatch(value):
        return f"; {value.strip()} is {Decimal(percentage[1]).scaleb(-2)}"
    return "; the decimal sign is a point" if _WITH_COMMA.match(value) else ""


def suggestion(word: str, names: Iterable[str]) -> str:
    """Return the names that look like a wrong word, or contain it, as the end of a refusal; "" if none does."""
    # Up to three names, whose similarity to the word is 0.6 or more: both are defaults of difflib. Or up to five that
    # contain it, if it is no mere syllable: a choice.
    choices = [*names]
    near = get_close_matches(word, choices, n=3, cutoff=0.6)
    near = near or [name for name in choices if word in name and len(word) > 2][:5]
    return f": did you mean {' or '.join(near)}?" if near else ""


def integer(name: str, value: SupportsIndex, low: int, high: int) -> int:
    """Return an integer argument, whose `name` is for the message, within [low, high] as an int.

    Raises
    ------
    TypeError
        If `value` is not an integer (a bool or a float is not).
    ValueError
        If it lies outside the range.
    """
    accepted = f"an integer from {low} to {high}"
    value = without_unit(name, value)
    # True is 1 for Python, and an order of True is a mistake.
    number = None if isinstance(value, bool) else _index(value)
    if number is None:
        raise TypeError(refusal(name, value, accepted))
    if not low <= number <= high:
        raise ValueError(refusal(name, number, accepted))
    return number


def order(value: SupportsIndex) -> int:
    """Return the order of a series as an int from 0 to `MAX_ORDER`."""
    return integer("order", value, 0, MAX_ORDER)


def digits(value: SupportsIndex) -> int:
    """Return a number of significant digits as an int from 1 to `MAX_DIGITS`."""
    return integer("digits", value, 1, MAX_DIGITS)


def exact_number(
    name: str, value: object, accepted: str, allowed: Callable[[Fraction], bool], unit: str | None = None
) -> Fraction:
    """Return a finite number as an exact fraction: a string is read as a decimal number, never through a float.

    Parameters
    ----------
    name, accepted : str
        The argument's name and the expected numbers in words, for the message.
    value : str, int, float, Fraction, Decimal, mpmath.mpf or NumPy scalar
        A number with an exponent beyond 10^±100000 raises ValueError.
    allowed : callable
        Condition that the number must meet.
    unit : str, optional
        As for `without_unit`. The number that the quantity's package returns in this unit is used exactly.

    Raises
    ------
    TypeError
        If `value` is not a real number.
    ValueError
        If it is not finite, not a number in a string, or not allowed.
    """
    # A wrong number is a ValueError, anything that is no number a TypeError.
    value = without_unit(name, value, unit)
    number = _fraction(value)
    if number is None:
        kind = ValueError if isinstance(value, str | float | Decimal) or _is_mpf(value) else TypeError
        raise kind(refusal(name, value, accepted))
    if not allowed(number):
        raise ValueError(refusal(name, value, accepted))
    return number


def _fraction(value: Any) -> Fraction | None:
    """Return a number `value` as a fraction, exactly; None if it is not a number, is infinite, or is far too large."""
    # A text of digits becomes a Decimal, which is exact.
    if isinstance(value, str):
        if len(value) > MAX_CHARACTERS or not _DECIMAL.fullmatch(value.strip()):
            return None
        value = Decimal(value.strip())
    if isinstance(value, Decimal):
        if not value.is_finite() or abs(value.adjusted()) > MAX_EXPONENT:
            return None
        return Fraction(value)
    # mpmath: (-1)^sign mantissa 2^exponent. Infinities and NaN have the mantissa 0 and an exponent. A binary exponent
    # is log2(10) = 3.3 times the decimal one: 4 is enough.
    if _is_mpf(value):
        sign, mantissa, exponent, _ = value._mpf_
        if (not mantissa and exponent) or abs(exponent) > 4 * MAX_EXPONENT:
            return None
        return int(-mantissa if sign else mantissa) * Fraction(2) ** int(exponent)
    # Integers of any type, then floats, fractions and NumPy's scalars, which know their exact ratio.
    if isinstance(value, bool | type):
        return None
    if (index := _index(value)) is not None:
        return Fraction(index)
    if not hasattr(value, "as_integer_ratio"):
        return None
    try:
        return Fraction(*value.as_integer_ratio())
    except (ValueError, OverflowError):  # NaN, infinity
        return None


def _index(value: Any) -> int | None:
    """Return an integer of any type as an int; None for everything else, such as an array or a masked number."""
    try:
        return operator.index(value)
    except TypeError:
        return None


def _is_mpf(value: object) -> bool:
    """Return whether a value is a real number of mpmath, which is not imported for this."""
    return hasattr(value, "_mpf_")
