"""Physical quantities with units of Pint, such as "70 GPa", converted to SI units."""

from __future__ import annotations

import math
import re
import warnings
from decimal import Decimal, localcontext
from functools import lru_cache
from typing import TYPE_CHECKING, Any

from viscopade.records import Node

if TYPE_CHECKING:
    import pint

_NUMBER = re.compile(r"\s*([+-]?(?:[0-9]+[.]?[0-9]*|[.][0-9]+)(?:[eE][+-]?[0-9]{1,3})?)\s*(.*)")
_FRACTION = re.compile(r"\s*([0-9]+)/([1-9][0-9]*)(?![0-9.eE])\s*(.*)")  # such as 1/60 s
# A product of powers of names, with small exponents, so that Pint evaluates no other expression; cm3 is cm^3.
_POWER = r"[A-Za-zµμ°%]+(?:(?:\^|\*\*)(?:-?[1-9]|\([1-9]/[1-9]\))|-?[1-9]|[²³])?"
_BARE_EXPONENT = re.compile(r"(?<=[A-Za-zµ])(?=-?[1-9])")
_UNIT = re.compile(rf"{_POWER}(?:(?: ?[*/·] ?| ){_POWER})*")
_BETA = re.compile(r"([^(]*)\(([^()]*)\) ?(?:\^|\*\*) ?(?:\(1/5\)|0\.2)")
_SUPERSCRIPTS = str.maketrans({"⁻": "-", "−": "-", "¹": "1", "²": "2", "³": "3", "μ": "µ"})
_PER_SECOND = re.compile(r"([kcm]?m)[\s_/.·*]?s(?:\^?[({]?-1[)}]?)?")  # m/s, m s^-1, ms-1, m_s, and ms of a speed
_LONGEST = 60  # characters of a quantity, number and unit; a choice, longer than any that people write
# Digits that hold a product exactly: a number of 60 characters times a size of a unit, a double of 17 digits, with
# exponents of 3 digits that only move the point. A quotient, such as 1/60, is rounded to so many digits.
_EXACT = 200
# Characters of a size that is a round number, such as 1000.0 or 1e-06: 15 significant digits of any other double make
# a longer text. A choice.
_SHORT = 8

DIMENSIONS = {
    "length": ("m", "mm"),
    "speed": ("m/s", "cm/s"),
    "pressure": ("Pa", "GPa"),
    "density": ("kg/m^3", "g/cm^3"),
    "time": ("s", "us"),
    "squared speed": ("m^2/s^2", "cm^2/s^2"),
    "mass": ("kg", "g"),
    "acceleration": ("m/s^2", "cm/s^2"),
    "energy per area": ("J/m^2", "mJ/m^2"),
}
"""SI unit of each dimension, and another common unit."""


PIXELS = ("px", "pixel", "pixels")
"""No units of length: Pint has a pixel of a fixed length."""


@lru_cache(maxsize=1)
def _registry() -> pint.UnitRegistry[Any]:
    """Return Pint's units, which take a part of a second to read: once a process, and only if a unit is used."""
    with warnings.catch_warnings():
        warnings.simplefilter("ignore")
        import pint

        return pint.UnitRegistry()


def quantity(node: Node, dimension: str, *, zero: bool = False) -> float:
    """Return a quantity in SI units.

    Parameters
    ----------
    node : Node
        A text such as "70 GPa", or a plain number in SI units.
    dimension : str
        One of `DIMENSIONS`.
    zero : bool
        Whether 0 is allowed.

    Raises
    ------
    ValueError
        One line that names the file, the key and the expected quantity.
    """
    # None stands for anything that is no such quantity.
    unit = DIMENSIONS[dimension][0]
    value = _in_si(node.value, unit) if isinstance(node.value, str) else _plain(node.value)
    if value is None or not (0 < value < math.inf or (zero and value == 0)):
        raise node.refuse(words(dimension, zero=zero))
    return value


def words(dimension: str, *, zero: bool = False) -> str:
    """Return the expected quantity in words, for a message: "a length > 0, such as …"; `zero`: 0 is allowed."""
    unit, example = DIMENSIONS[dimension]
    return f'a {dimension} {">=" if zero else ">"} 0, such as "2.5 {example}", or a number in {unit}'


def si_decimal(text: str, dimension: str) -> str | None:
    """Return a number with a unit of a dimension in SI units, as an exact decimal; None for any other text."""
    value = decimal_in(text, DIMENSIONS[dimension][0])
    return None if value is None else str(value)


def beta_decimal(text: str) -> tuple[str, str, str] | None:
    """Return the parts of a beta with its unit, such as "1.307 (s/cm)^(1/5)"; None for any other text.

    Returns
    -------
    tuple of str
        The number, the unit, and the speed of 1 in that unit's lengths and times, in m/s: 0.01 for (s/cm)^(1/5).
    """
    # A number without a unit of its own, and in brackets a time over a length, "s/cm".
    match = _BETA.fullmatch(text.strip()) if len(text) <= _LONGEST else None
    number = None if match is None else _NUMBER.fullmatch(match[1])
    slowness = match and [part.strip() for part in match[2].split("/")]
    if match is None or number is None or number[2] or slowness is None or len(slowness) != 2:
        return None
    # The reciprocal, "cm/s", is a unit of speed, or else this is no beta.
    speed = si_decimal(f"1 {slowness[1]}/{slowness[0]}", "speed")
    return None if speed is None else (number[1], f"({match[2].strip()})^(1/5)", speed)


def uncertain(value: float, error: float) -> str:
    """Return a value and its standard error, both to the second digit of the error, such as "0.8730 +- 0.0040".

    Errors of measured quantities are not known to more than two digits.
    Where this would be long, both have one power of ten: "(1.230 +- 0.010)e-07". An error that is 0, infinite or NaN
    is left out, and the value then has six digits.
    """
    if not 0 < error < math.inf:
        return f"{value:.6g}"
    # The second digit of the error is this decimal place; negative for an error of 100 or more.
    decimals = 1 - math.floor(math.log10(error))
    power = math.floor(math.log10(max(abs(value), error)))
    # A power of ten, that of the larger number: if there are more than 6 decimals and both numbers are below 0.01, for
    # an error of 1000 or more, of which only two digits are known, and from a million on. 6, 0.01 and 1e6 are choices.
    scaled = (decimals > 6 and power < -2) or decimals < -1 or abs(value) >= 1e6
    unit = 10.0**power if scaled else 1.0
    # A double has 15 digits in any case; more decimals would show its rounding.
    places = max(min(decimals + (power if scaled else 0), 15), 0)
    text = f"{value / unit:.{places}f} +- {error / unit:.{places}f}"
    return f"({text})e{power:+03d}" if scaled else text


def factor(node: Node, dimension: str) -> tuple[str, float]:
    """Return a unit's name, and its factor to SI units.

    `node` has the name, such as "cm", and `dimension` is a key of `DIMENSIONS`.

    Raises
    ------
    ValueError
        As `quantity` does.
    """
    # The factor is the size of 1 unit.
    unit, example = DIMENSIONS[dimension]
    name = node.value if isinstance(node.value, str) else ""
    size = _in_si(f"1 {name}", unit)
    if size is None:
        raise node.refuse(f'a unit of {dimension}, such as "{unit}" or "{example}"')
    return name.strip(), size


def unit_in_si(unit: str, dimension: str) -> tuple[str, float] | None:
    """Return a unit's name and its size in SI units, from a header: "cm s⁻¹", "ms-1"; None for any other text.

    `unit` is the text, and `dimension` a key of `DIMENSIONS`, or "" for a plain number, which may be in % (0.01).
    """
    name = unit.translate(_SUPERSCRIPTS).strip()
    if dimension not in DIMENSIONS:
        return (name, 0.01 if name == "%" else 1.0) if name in ("%", "-", "1") else None
    # "ms" in a column of speeds is m/s; for Pint it is a millisecond.
    if dimension == "speed" and (match := _PER_SECOND.fullmatch(name)):
        name = f"{match[1]}/s"
    # A pixel has no fixed size. Headers may have "CM" for cm: the first spelling that is a unit of the dimension.
    spellings = () if name.lower() in PIXELS else (name, name.lower())
    si_unit = DIMENSIONS[dimension][0]
    return next(((spelling, size) for spelling in spellings if (size := _in_si(f"1 {spelling}", si_unit))), None)


def _plain(value: object) -> float | None:
    """Return a number of TOML or JSON as a double; None for another value, or an integer beyond the doubles."""
    if isinstance(value, bool) or not isinstance(value, int | float):
        return None
    try:
        return float(value)
    except OverflowError:
        return None


def _in_si(text: str, unit: str) -> float | None:
    """Return a number with a unit in another unit, or None."""
    value = decimal_in(text, unit)
    return None if value is None else float(value)


def unit_of(text: str) -> str:
    """Return the unit of a typed quantity as it was typed, such as "cm/s"; "" for a plain number."""
    match = _FRACTION.fullmatch(text) or _NUMBER.fullmatch(text)
    return "" if match is None else match.groups()[-1].strip()


def decimal_in(text: str, unit: str | None) -> Decimal | None:
    """Return the number of a `text` with a unit in another `unit`, or None; without another one in SI base units.

    It is exact, except for a fraction such as "1/60 s", which has 200 digits.
    """
    # A fraction or a number, and behind it the unit: a product of powers, and of nothing that Pint would evaluate.
    match = (_FRACTION.fullmatch(text) or _NUMBER.fullmatch(text)) if len(text) <= _LONGEST else None
    if match is None:
        return None
    number, *denominator, name = match.groups()
    if not _UNIT.fullmatch(name.strip().removeprefix("1/")):  # such as 1/s^2
        return None
    # "cm3" becomes "cm^3", and the two characters for micro become one.
    try:
        size = _size_of_unit(_BARE_EXPONENT.sub("^", name.strip().replace("μ", "µ")), unit)
    except (ArithmeticError, AttributeError, AssertionError, TypeError, ValueError, KeyError, SyntaxError):
        return None  # what Pint raises for a name it does not know, or one that cannot be a factor
    with localcontext(prec=_EXACT):  # as decimals: 2.5 mm is 0.0025 m, to the last bit
        return Decimal(number) * size / Decimal(*denominator or (1,))


# 256: more units than a table or a scene has; a choice.
@lru_cache(maxsize=256)
def _size_of_unit(name: str, unit: str | None) -> Decimal:
    """Return the unit `name` in terms of another `unit`, or of SI base units: 0.01 for cm in m."""
    registry = _registry()
    one = registry.Quantity(1.0, registry.Unit(name))
    size = float((one.to_base_units() if unit is None else one.to(unit)).magnitude)
    if not 0 < size < math.inf:
        raise ValueError(f"{name} is not a positive number of {unit}")
    # Pint multiplies in double precision, and makes 999.9999999999999 kg/m^3 of 1 g/cm^3. 15 digits, which a double
    # always keeps, give 1000; where they are no round number, as for lb/ft^3, take the double itself.
    short = f"{size:.15g}"
    return Decimal(short if len(short) <= _SHORT else repr(size))
