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
_BETA = re.compile(r"([^(]*)\(([^()]*)\) ?(?:\^|\*\*) ?\(1/5\)")
_SUPERSCRIPTS = str.maketrans({"⁻": "-", "−": "-", "¹": "1", "²": "2", "³": "3", "μ": "µ"})
_PER_SECOND = re.compile(r"([kcm]?m)[\s_/.·*]?s(?:\^?[({]?-1[)}]?)?")  # m/s, m s^-1, ms-1, m_s, and ms of a speed
_LONGEST = 60
_EXACT = 200  # digits: of a product of a short number and a unit
_SHORT = 8  # characters of a factor that is a round number

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
    unit = DIMENSIONS[dimension][0]
    value = _in_si(node.value, unit) if isinstance(node.value, str) else _plain(node.value)
    if value is None or not (0 < value < math.inf or (zero and value == 0)):
        raise node.refuse(words(dimension, zero=zero))
    return value


def words(dimension: str, *, zero: bool = False) -> str:
    """Return the expected quantity in words, for a message."""
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
    match = _BETA.fullmatch(text.strip()) if len(text) <= _LONGEST else None
    number = None if match is None else _NUMBER.fullmatch(match[1])
    slowness = match and [part.strip() for part in match[2].split("/")]
    if match is None or number is None or number[2] or slowness is None or len(slowness) != 2:
        return None
    speed = si_decimal(f"1 {slowness[1]}/{slowness[0]}", "speed")
    return None if speed is None else (number[1], f"({match[2].strip()})^(1/5)", speed)


def uncertain(value: float, error: float) -> str:
    """Return a value and its standard error, both to the second digit of the error, such as "0.873 +- 0.0040"."""
    if not 0 < error < math.inf:
        return f"{value:.6g}"
    decimals = 1 - math.floor(math.log10(error))
    power = math.floor(math.log10(max(abs(value), error)))
    scaled = (decimals > 6 and power < -2) or decimals < -1 or abs(value) >= 1e6
    unit = 10.0**power if scaled else 1.0
    places = max(min(decimals + (power if scaled else 0), 15), 0)
    text = f"{value / unit:.{places}f} +- {error / unit:.{places}f}"
    return f"({text})e{power:+03d}" if scaled else text


def factor(node: Node, dimension: str) -> tuple[str, float]:
    """Return a unit's name, and its factor to SI units.

    Raises
    ------
    ValueError
        As `quantity` does.
    """
    unit, example = DIMENSIONS[dimension]
    name = node.value if isinstance(node.value, str) else ""
    size = _in_si(f"1 {name}", unit)
    if size is None:
        raise node.refuse(f'a unit of {dimension}, such as "{unit}" or "{example}"')
    return name.strip(), size


def unit_in_si(unit: str, dimension: str) -> tuple[str, float] | None:
    """Return a unit's name and its size in SI units, from a header: "cm s⁻¹", "ms-1"; None for any other text.

    A plain number, with the dimension "", may be in %.
    """
    name = unit.translate(_SUPERSCRIPTS).strip()
    if dimension not in DIMENSIONS:
        return (name, 0.01 if name == "%" else 1.0) if name in ("%", "-", "1") else None
    if dimension == "speed" and (match := _PER_SECOND.fullmatch(name)):
        name = f"{match[1]}/s"
    tried = () if name.lower() in PIXELS else (name, name.lower())
    return next(((each, size) for each in tried if (size := _in_si(f"1 {each}", DIMENSIONS[dimension][0]))), None)


def _plain(value: object) -> float | None:
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


def decimal_in(text: str, unit: str | None) -> Decimal | None:
    """Return a number with a unit in another unit, exactly, or None; without another one in SI base units."""
    match = (_FRACTION.fullmatch(text) or _NUMBER.fullmatch(text)) if len(text) <= _LONGEST else None
    if match is None:
        return None
    number, *denominator, name = match.groups()
    if not _UNIT.fullmatch(name.strip().removeprefix("1/")):  # such as 1/s^2
        return None
    try:
        size = _size_of_unit(_BARE_EXPONENT.sub("^", name.strip().replace("μ", "µ")), unit)
    except (ArithmeticError, AttributeError, AssertionError, TypeError, ValueError, KeyError, SyntaxError):
        return None  # what Pint raises for a name it does not know, or one that cannot be a factor
    with localcontext(prec=_EXACT):  # as decimals: 2.5 mm is 0.0025 m, to the last bit
        return Decimal(number) * size / Decimal(*denominator or (1,))


@lru_cache(maxsize=256)
def _size_of_unit(name: str, unit: str | None) -> Decimal:
    """Return a unit in terms of another one, or of SI base units."""
    registry = _registry()
    one = registry.Quantity(1.0, registry.Unit(name))
    size = float((one.to_base_units() if unit is None else one.to(unit)).magnitude)
    if not 0 < size < math.inf:
        raise ValueError(f"{name} is not a positive number of {unit}")
    # Pint multiplies in double precision: 1 g/cm^3 is 1000 kg/m^3, not the neighbour.
    short = f"{size:.15g}"
    return Decimal(short if len(short) <= _SHORT else repr(size))
