"""Checks of arguments in double precision: numbers and arrays are converted, or refused with one line."""

from __future__ import annotations

import math
import numbers
import reprlib
from collections.abc import Callable
from typing import Any, NamedTuple, SupportsFloat, SupportsIndex, TypeVar, cast

import numpy as np
import numpy.typing as npt

FloatArray = npt.NDArray[np.float64]

Number = SupportsFloat | SupportsIndex

Values = TypeVar("Values", float, FloatArray)

_OR_ARRAY = ", or an array of such numbers"


class Accepted(NamedTuple):
    """The accepted values of a quantity, in words and as a test of floats and arrays."""

    accepted: str
    holds: Callable[[Any], Any]


def refusal(name: str, value: object, accepted: str) -> str:
    """Return a refusal: one line with the name, the value and the accepted values."""
    return f"{name} is {' '.join(reprlib.repr(value).split())}: accepted is {accepted}"


def number(name: str, value: object, accepted: Accepted) -> float:
    """Return `value` as a float within the accepted range.

    Raises
    ------
    TypeError
        If it is not a real number (a bool or a string is not).
    ValueError
        If it lies outside the range.
    """
    try:
        result = float(cast(SupportsFloat, value)) if _is_real(value) else None
    except (OverflowError, ValueError):  # an integer beyond double precision, a signalling NaN
        result = math.nan
    except TypeError:  # a symbolic expression
        result = None
    if result is None:
        raise TypeError(refusal(name, value, accepted.accepted))
    if not accepted.holds(result):
        raise ValueError(refusal(name, value, accepted.accepted))
    return result


def _is_real(value: object) -> bool:
    """Whether float() of the value makes sense: a bool, a string or an array is not a number."""
    if isinstance(value, bool | np.bool_ | str | bytes | np.ndarray):
        return False
    if isinstance(value, numbers.Complex):
        return isinstance(value, numbers.Real)
    return hasattr(value, "__float__") or hasattr(value, "__index__")


def array(name: str, values: object, accepted: Accepted) -> FloatArray:
    """Return a number, an array or nested lists as a double-precision array within the accepted range.

    Raises
    ------
    TypeError
        If it is not made of real numbers.
    ValueError
        If one of them lies outside the range.
    """
    try:
        given = np.asarray(values)
    except ValueError:  # lists of different lengths
        raise TypeError(refusal(name, values, accepted.accepted + _OR_ARRAY)) from None
    if given.dtype.kind == "O":  # Fraction, Decimal, huge integers
        flat = [number(name, value, accepted) for value in given.flat]
        return np.array(flat, dtype=np.float64).reshape(given.shape)
    if given.dtype.kind not in "iuf":
        raise TypeError(refusal(name, values, accepted.accepted + _OR_ARRAY))
    with np.errstate(over="ignore"):  # a long double too large becomes inf
        result = given.astype(np.float64)
    refused = result[~accepted.holds(result)]
    if refused.size:
        raise ValueError(refusal(name, float(refused[0]), accepted.accepted))
    return result


def elementwise(function: Callable[[FloatArray], FloatArray], name: str, values: Values, accepted: Accepted) -> Values:
    """Apply `function` to checked values: a number gives a float, an array an array."""
    checked = array(name, values, accepted)
    with np.errstate(over="ignore", divide="ignore"):  # the result is then inf, as documented
        return cast(Values, float_if_scalar(function(checked)))


def float_if_scalar(result: FloatArray) -> float | FloatArray:
    """Return a float if the argument was a number, an array otherwise."""
    return float(result) if result.ndim == 0 else result
