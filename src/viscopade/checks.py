"""Refuse bad arguments with one clear line: what was wrong, and what is accepted."""

from __future__ import annotations

import operator
from typing import SupportsIndex

MAX_ORDER = 1000
MAX_DIGITS = 5000


def integer(name: str, value: SupportsIndex, low: int, high: int) -> int:
    """Return `value` as an int within [low, high].

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
