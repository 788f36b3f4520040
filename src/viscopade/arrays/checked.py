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
    """The expected values of a quantity, such as a speed: in words for messages, and as a condition."""

    words: str
    """As in "expected a number >= 0"."""
    holds: Callable[[Any], Any]
    """Takes a float or an array, and returns whether each number is expected."""


def number(name: str, value: object, accepted: Accepted) -> float:
    """Return `value` as a float in the expected range.

    Parameters
    ----------
    name : str
        The argument's name, for messages; it tells in which SI unit a quantity (of Astropy or Pint) is converted, such
        as "speed" in m/s.
    value : object
    accepted : Accepted

    Raises
    ------
    TypeError
        If it is not a real number (a bool or a string is not).
    ValueError
        If it lies outside the range.
    """
    value = without_unit(name, value)
    # `refusal` returns the message: the name, the value and the expected ones. None stands for what is no real number,
    # NaN for a number without a double: no range holds NaN.
    try:
        result = float(cast(SupportsFloat, value)) if _is_real(value) else None
    except (OverflowError, ValueError):  # an integer beyond double precision, a signalling NaN
        result = math.nan
    except TypeError:  # a symbolic expression
        result = None
    if result is None:
        raise TypeError(refusal(name, value, accepted.words))
    if not accepted.holds(result):
        raise ValueError(refusal(name, value, accepted.words))
    return result


def _is_real(value: object) -> bool:
    """Whether float() of the value makes sense: a bool, a string or an array is not a number."""
    # float() takes these, too, but a speed "3" or True is a mistake.
    if isinstance(value, bool | np.bool_ | str | bytes | np.ndarray):
        return False
    # Python's and NumPy's numbers are registered as real or complex.
    if isinstance(value, numbers.Complex):
        return isinstance(value, numbers.Real)
    # Decimal and SymPy's expressions, such as sqrt(2), are not; they convert themselves.
    return hasattr(value, "__float__") or hasattr(value, "__index__")


def array(name: str, values: object, accepted: Accepted) -> FloatArray:
    """Return a number, an array or nested lists as a double-precision array in the expected range.

    The arguments are those of `number`: a name for messages, the values, and those that are `accepted`. Quantities are
    converted in the same way.

    Raises
    ------
    TypeError
        If it is not made of real numbers.
    ValueError
        If one of them lies outside the range.
    """
    values = without_unit(name, values)
    if np.ma.is_masked(values):  # `Elementwise` takes the masks off before
        raise TypeError(refusal(name, values, accepted.words + _OR_ARRAY + ", none of them masked"))
    try:
        numpy_array = np.asarray(values)
    except (ValueError, TypeError):  # lists of different lengths, objects that are no arrays
        raise TypeError(refusal(name, values, accepted.words + _OR_ARRAY)) from None

    # Python's objects are checked one by one: Fraction, Decimal, huge integers, quantities.
    if numpy_array.dtype.kind == "O":
        flat = [number(name, value, accepted) for value in numpy_array.flat]
        return np.array(flat, dtype=np.float64).reshape(numpy_array.shape)

    # Of NumPy's own types integers (i), unsigned ones (u) and floats (f) are real numbers; bool, complex and text are
    # not.
    if numpy_array.dtype.kind not in "iuf":
        raise TypeError(refusal(name, values, accepted.words + _OR_ARRAY))
    with np.errstate(over="ignore"):  # a long double too large becomes inf; doubles are not copied
        doubles = numpy_array.astype(np.float64, copy=False)
    holds = accepted.holds(doubles)
    if not np.all(holds):
        raise ValueError(refusal(name, float(doubles[~holds].flat[0]), accepted.words))
    return doubles


def unmasked(values: Iterable[Any]) -> tuple[list[Any], npt.NDArray[np.bool_] | None]:
    """Return the data of arrays, and the mask of all in their common shape; None if no array is masked.

    `values` are arrays or numbers, masked or not; True in a mask marks a masked element.
    """
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
    # An element of the result is masked if it is in any argument, once all have the common shape.
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
        # A container (pandas, xarray, Dask) calls this function again, with its arrays. `map` ends with the arguments:
        # one that is missing is refused by the function itself, which also brings arrays to a common shape.
        plain = list(map(without_unit, self.accepted, arguments))
        contained = by_container(self, plain)
        if contained is not NotImplemented:
            return contained

        # Only values that are not masked are checked and computed, as a flat array.
        values, mask = unmasked(plain)
        if mask is not None:
            values = [np.broadcast_to(value, mask.shape)[~mask] for value in values]
        checked = map(array, self.accepted, values, self.accepted.values())
        with np.errstate(over="ignore", divide="ignore"):  # the result is then inf, as documented
            result = self.function(*checked)
        if mask is None:
            return float(result) if result.ndim == 0 else result

        # They return to their places; [()] makes a masked number from a masked array without axes.
        whole = np.ones(mask.shape)  # any number will do under the mask
        whole[~mask] = result
        return np.ma.array(whole, mask=mask)[()]


def by_container(function: Any, values: Sequence[Any], **keywords: Any) -> Any:
    """Return the result of the first container that applies the function itself; `NotImplemented` if there is none.

    Parameters
    ----------
    function : Elementwise or numpy.ufunc
    values : sequence
        The function's arguments; `keywords` are those of the call.
    """
    # NumPy's protocol: container.__array_ufunc__(function, "__call__", *arguments), which returns `NotImplemented` if
    # the container declines; the first one that does not, from the left. Arrays and NumPy's numbers have it, too, but
    # only for true ufuncs, which the caller then calls itself.
    for value in values:
        protocol = None if isinstance(value, np.ndarray | np.generic) else getattr(value, "__array_ufunc__", None)
        result = NotImplemented if protocol is None else protocol(function, "__call__", *values, **keywords)
        if result is not NotImplemented:
            return result
    return NotImplemented


def elementwise(function: Callable[[FloatArray], FloatArray], name: str, values: Values, accepted: Accepted) -> Values:
    """Apply `function` to checked values: a number gives a float, an array an array."""
    # A float needs nothing of what `Elementwise` does, which takes longer than many a function.
    if type(values) is float and accepted.holds(values):
        with np.errstate(over="ignore", divide="ignore"):
            return float(function(np.array(values)))
    return cast(Values, Elementwise(function, {name: accepted})(values))
