"""Functions of checked numbers and arrays in double precision; an error message is one line.

A function of arrays treats containers as NumPy's ufuncs do. A masked array stays masked, and masked values are never
checked. Other containers (pandas, xarray, Dask) apply the function to their arrays themselves, by NumPy's protocol
`__array_ufunc__`, and so preserve their index or coordinates.
"""

from __future__ import annotations

import math
import numbers
from collections.abc import Callable, Iterable, Sequence
from dataclasses import dataclass
from typing import Any, ClassVar, NamedTuple, SupportsFloat, SupportsIndex, TypeVar, cast

import numpy as np
import numpy.typing as npt

from viscopade.arguments import refusal, without_unit

FloatArray = npt.NDArray[np.float64]

Number = SupportsFloat | SupportsIndex

Values = TypeVar("Values", float, FloatArray)

_OR_ARRAY = ", or an array of such numbers"


class Accepted(NamedTuple):
    """The expected values of a quantity, in words and as a condition for floats and arrays."""

    accepted: str
    holds: Callable[[Any], Any]


def number(name: str, value: object, accepted: Accepted) -> float:
    """Return `value` as a float in the expected range.

    Raises
    ------
    TypeError
        If it is not a real number (a bool or a string is not).
    ValueError
        If it lies outside the range.
    """
    value = without_unit(name, value)
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
    """Return a number, an array or nested lists as a double-precision array in the expected range.

    Raises
    ------
    TypeError
        If it is not made of real numbers.
    ValueError
        If one of them lies outside the range.
    """
    values = without_unit(name, values)
    if np.ma.is_masked(values):
        raise TypeError(refusal(name, values, accepted.accepted + _OR_ARRAY + ", none of them masked"))
    try:
        given = np.asarray(values)
    except (ValueError, TypeError):  # lists of different lengths, objects that are no arrays
        raise TypeError(refusal(name, values, accepted.accepted + _OR_ARRAY)) from None
    if given.dtype.kind == "O":  # Fraction, Decimal, huge integers, quantities
        flat = [number(name, value, accepted) for value in given.flat]
        return np.array(flat, dtype=np.float64).reshape(given.shape)
    if given.dtype.kind not in "iuf":
        raise TypeError(refusal(name, values, accepted.accepted + _OR_ARRAY))
    with np.errstate(over="ignore"):  # a long double too large becomes inf
        result = given.astype(np.float64, copy=False)
    holds = accepted.holds(result)
    if not np.all(holds):
        raise ValueError(refusal(name, float(result[~holds].flat[0]), accepted.accepted))
    return result


def unmasked(values: Iterable[Any]) -> tuple[list[Any], npt.NDArray[np.bool_] | None]:
    """Return the data of arrays, and the mask of all in their common shape; None if no array is masked."""
    data, masks = [], []
    for value in values:
        if hasattr(value, "unmasked"):  # a masked array of Astropy
            masks.append(np.asarray(value.mask))
            data.append(np.asarray(value.unmasked))
        else:
            masks += [np.ma.getmaskarray(value)] if isinstance(value, np.ma.MaskedArray) else []
            data.append(np.ma.getdata(value) if isinstance(value, np.ma.MaskedArray) else value)
    if not masks:
        return data, None
    shape = np.broadcast_shapes(*map(np.shape, data))
    return data, np.logical_or.reduce([np.broadcast_to(mask, shape) for mask in masks])


@dataclass(frozen=True, eq=False)
class Elementwise:
    """A function of numbers and arrays that checks them; it has the attributes of a ufunc that containers need.

    Attributes
    ----------
    function : callable
        A function of double-precision arrays.
    accepted : dict
        The expected values of each argument, by its name.
    """

    function: Callable[..., FloatArray]
    accepted: dict[str, Accepted]

    __name__: ClassVar[str] = "elementwise"
    nout: ClassVar[int] = 1
    signature: ClassVar[None] = None

    @property
    def nin(self) -> int:
        """Number of arguments."""
        return len(self.accepted)

    def __call__(self, *arguments: Any) -> Any:
        """Return a float for numbers, an array for arrays, and a container for containers."""
        given = list(map(without_unit, self.accepted, arguments))
        contained = by_container(self, given)
        if contained is not NotImplemented:
            return contained
        values, hidden = unmasked(given)
        if hidden is not None:
            values = [np.broadcast_to(value, hidden.shape)[~hidden] for value in values]
        checked = map(array, self.accepted, values, self.accepted.values())
        with np.errstate(over="ignore", divide="ignore"):  # the result is then inf, as documented
            result = self.function(*checked)
        if hidden is None:
            return float(result) if result.ndim == 0 else result
        whole = np.ones(hidden.shape)
        whole[~hidden] = result
        return np.ma.array(whole, mask=hidden)[()]


def by_container(function: Any, values: Sequence[Any], **keywords: Any) -> Any:
    """Return the result of the first container that applies the function itself; `NotImplemented` if there is none."""
    for value in values:
        protocol = None if isinstance(value, np.ndarray | np.generic) else getattr(value, "__array_ufunc__", None)
        result = NotImplemented if protocol is None else protocol(function, "__call__", *values, **keywords)
        if result is not NotImplemented:
            return result
    return NotImplemented


def elementwise(function: Callable[[FloatArray], FloatArray], name: str, values: Values, accepted: Accepted) -> Values:
    """Apply `function` to checked values: a number gives a float, an array an array."""
    # All that `Elementwise` does takes longer than many a function.
    if type(values) is float and accepted.holds(values):
        with np.errstate(over="ignore", divide="ignore"):
            return float(function(np.array(values)))
    return cast(Values, Elementwise(function, {name: accepted})(values))
