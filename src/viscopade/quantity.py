"""Physical quantities with units of Pint, such as "70 GPa", converted to SI units."""

from __future__ import annotations

import math
import re
import warnings
from decimal import Decimal
from functools import lru_cache
from typing import TYPE_CHECKING, Any

from viscopade.records import Node

if TYPE_CHECKING:
    import pint

_NUMBER = re.compile(r"\s*([+-]?(?:[0-9]+[.]?[0-9]*|[.][0-9]+)(?:[eE][+-]?[0-9]{1,3})?)\s*(.*)")
# A product of powers of names, with small exponents: nothing that Pint would have to compute.
_POWER = r"[A-Za-zµμ°%]+(?:(?:\^|\*\*)-?[1-9]|[²³])?"
_UNIT = re.compile(rf"{_POWER}(?:(?: ?[*/·] ?| ){_POWER})*")
_LONGEST = 60
_SHORT = 8  # characters of a factor that is a round number

DIMENSIONS = {
    "length": ("m", "mm"),
    "speed": ("m/s", "cm/s"),
    "pressure": ("Pa", "GPa"),
    "density": ("kg/m^3", "g/cm^3"),
    "time": ("s", "us"),
    "squared speed": ("m^2/s^2", "cm^2/s^2"),
    "mass": ("kg", "g"),
}
"""By quantity, its SI unit and one that is often used."""


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
        Whether 0 is accepted.

    Raises
    ------
    ValueError
        One line that names the file, the key and what is accepted.
    """
    unit = DIMENSIONS[dimension][0]
    value = _in_si(node.value, unit) if isinstance(node.value, str) else _plain(node.value)
    if value is None or not (0 < value < math.inf or (zero and value == 0)):
        raise node.refuse(words(dimension, zero=zero))
    return value


def words(dimension: str, *, zero: bool = False) -> str:
    """Return the accepted quantities in words, for a message."""
    unit, example = DIMENSIONS[dimension]
    return f'a {dimension} {">=" if zero else ">"} 0, such as "2.5 {example}", or a number in {unit}'


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


def _plain(value: object) -> float | None:
    if isinstance(value, bool) or not isinstance(value, int | float):
        return None
    try:
        return float(value)
    except OverflowError:
        return None


def _in_si(text: str, unit: str) -> float | None:
    """Return a number with a unit in another unit, or None."""
    match = _NUMBER.fullmatch(text) if len(text) <= _LONGEST else None
    if match is None or not _UNIT.fullmatch(match[2].strip()):
        return None
    size = _size(match[2].strip(), unit)
    # As decimals: 2.5 mm is 0.0025 m, to the last bit.
    return None if size is None else float(Decimal(match[1]) * size)


@lru_cache(maxsize=256)
def _size(name: str, unit: str) -> Decimal | None:
    """Return a unit in terms of another one of the same dimension, or None."""
    registry = _registry()
    try:
        asked = registry.Unit(name.replace("μ", "µ"))
        if asked.dimensionality != registry.Unit(unit).dimensionality:
            return None
        size = float(registry.Quantity(1.0, asked).to(unit).magnitude)
    except (ArithmeticError, AttributeError, AssertionError, TypeError, ValueError, KeyError, SyntaxError):
        return None  # what Pint raises for a name it does not know, or one that cannot be a factor
    if not 0 < size < math.inf:
        return None
    # Pint multiplies in double precision: 1 g/cm^3 is 1000 kg/m^3, not the neighbour.
    short = f"{size:.15g}"
    return Decimal(short if len(short) <= _SHORT else repr(size))
