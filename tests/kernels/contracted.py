"""Numbers of a program whose products are fused with the sums that they are added to, as with FMA contraction."""

from __future__ import annotations

from fractions import Fraction

import numpy as np

from viscopade.arithmetic.formats import DOUBLE, FLOAT


def fused(x, y, z):
    """Return x y + z, rounded once, by fractions."""
    x, y, z = np.broadcast_arrays(x, y, z)
    form = FLOAT if x.dtype == np.float32 else DOUBLE
    exact = (
        Fraction(a) * Fraction(b) + Fraction(c)
        for a, b, c in zip(*(u.ravel().tolist() for u in (x, y, z)), strict=True)
    )
    return np.array([form.nearest(value) for value in exact], x.dtype).reshape(x.shape)


class Contracted:
    """A number of a program; a product that is added to something is fused with the sum."""

    def __init__(self, value, factors=None):
        self.value, self.factors = value, factors

    def __add__(self, other):
        if other.factors is not None:
            return Contracted(fused(*other.factors, self.value))
        if self.factors is not None:
            return Contracted(fused(*self.factors, other.value))
        return Contracted(self.value + other.value)

    def __sub__(self, other):
        return self + Contracted(-other.value, other.factors and (-other.factors[0], other.factors[1]))

    def __mul__(self, other):
        return Contracted(self.value * other.value, (self.value, other.value))
