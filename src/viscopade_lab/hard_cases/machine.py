"""Numbers of type float and double in NumPy, operation by operation as C has them, with and without fused ones.

A fused multiplication and sum rounds once; NumPy has none. `fused` makes it of exact transformations of sums and
products (Boldo and Melquiond 2008), `Contracted` lets a `program` use it wherever a product is added.
"""

from __future__ import annotations

from typing import Any, cast

import numpy as np
import numpy.typing as npt

from viscopade.arithmetic.formats import FLOAT, Format
from viscopade_lab.compensated import two_product, two_sum

Array = npt.NDArray[Any]


def type_of(form: Format) -> type[Any]:
    """Return NumPy's type."""
    return np.float32 if form == FLOAT else np.float64


def moved(x: Array, steps: Array) -> Array:
    """Return the numbers that lie so many numbers of the type beyond positive x; towards 0 for negative steps."""
    bits = np.int32 if x.dtype == np.float32 else np.int64
    return cast(Array, (x.view(bits) + steps.astype(bits)).view(x.dtype))


def fused(x: Array, y: Array, z: Array) -> Array:
    """Return x y + z, rounded once; in type double where nothing over- or underflows."""
    x, y, z = np.broadcast_arrays(x, y, z)
    if x.dtype == np.float32:
        total = _to_odd(x.astype(np.float64) * y.astype(np.float64), z.astype(np.float64))
        return total.astype(np.float32)
    high, low = two_product(x, y)
    first, rest = two_sum(z, low)
    first, more = two_sum(high, first)
    return first + _to_odd(rest, more)


def _to_odd(x: Array, y: Array) -> Array:
    """Return x + y, if it is no number the one beside it whose last bit is 1: another rounding does no harm then."""
    total, lacks = two_sum(x, y)
    even = (total.view(np.int64) & 1) == 0
    beside = np.nextafter(total, np.where(lacks > 0, np.inf, -np.inf))
    return np.where((lacks != 0) & even, beside, total)


class Contracted:
    """A number of a program; a product that is added to something is fused with the sum."""

    def __init__(self, value: Any, factors: tuple[Any, Any] | None = None) -> None:
        self.value, self.factors = value, factors

    def __add__(self, other: Contracted) -> Contracted:
        if other.factors is not None:
            return Contracted(fused(*other.factors, self.value))
        if self.factors is not None:
            return Contracted(fused(*self.factors, other.value))
        return Contracted(self.value + other.value)

    def __sub__(self, other: Contracted) -> Contracted:
        minus = Contracted(-other.value, None if other.factors is None else (-other.factors[0], other.factors[1]))
        return self + minus

    def __mul__(self, other: Contracted) -> Contracted:
        return Contracted(self.value * other.value, (self.value, other.value))

    def __truediv__(self, other: Contracted) -> Contracted:
        return Contracted(self.value / other.value)
