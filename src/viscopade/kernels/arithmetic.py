"""What is assumed of a machine's arithmetic in a format: operations, and the functions of its library.

A rounding bound holds for one `Arithmetic`. Errors are in units in the last place (ulp) of the result.
"""

from __future__ import annotations

from dataclasses import dataclass
from fractions import Fraction

from viscopade import store
from viscopade.arithmetic.formats import DOUBLE, FLOAT, Format

ULPS = Fraction(4)
"""Assumed of log2, exp2, cbrt and pow on a host: glibc's manual knows of no larger error, in type float neither."""


@dataclass(frozen=True)
class Arithmetic:
    """Arithmetic of a machine in a format.

    Attributes
    ----------
    place : str
        "host" or "device" (CUDA).
    form : Format
        The type of all numbers.
    functions : Fraction
        Largest error of log2, exp2 and cbrt, in ulp.
    quotient, root : Fraction
        Largest errors of a division, and of sqrt, in ulp; 1/2 is the correctly rounded result.
    power : Fraction
        Largest error of pow, in ulp.
    log2_absolute : Fraction
        An additional absolute error of log2.
    """

    place: str
    form: Format
    functions: Fraction = ULPS
    quotient: Fraction = Fraction(1, 2)
    root: Fraction = Fraction(1, 2)
    power: Fraction = ULPS
    log2_absolute: Fraction = Fraction(0)

    @property
    def name(self) -> str:
        """The key of its bounds, "host double"."""
        return f"{self.place} {self.form.name}"

    @property
    def ulp(self) -> Fraction:
        """The largest size of a unit in the last place, relative to the number."""
        # Of 1 it is 2^(1 - p), with p bits of the significand; of a number just below 2 half of that.
        return Fraction(2) ** (1 - self.form.precision)


HOST = Arithmetic("host", DOUBLE)
HOST_FLOAT = Arithmetic("host", FLOAT)
"""Arithmetic of IEEE 754 with the usual library of functions; logarithm and exponential may have any one base."""

# The CUDA programming guide counts from the correctly rounded result, which adds half an ulp to its 2 ulp of __log2f,
# exp2f and __fdividef (5/2), to its 4 ulp of powf (9/2), and to its 2^-22 of __log2f in [1/2, 2]: there |log2| <= 1,
# and half an ulp of floats up to 1 is 2^-25.
DEVICE = Arithmetic(
    "device", FLOAT, Fraction(5, 2), Fraction(5, 2), power=Fraction(9, 2),
    log2_absolute=Fraction(1, 2**22) + Fraction(1, 2**25),
)  # fmt: skip
"""CUDA's __log2f, exp2f, powf and __fdividef, and arithmetic of IEEE 754 (sqrtf rounds correctly)."""

HOSTS = {machine.form.name: machine for machine in (HOST, HOST_FLOAT)}
"""By the name of a format."""
ARITHMETICS = {machine.name: machine for machine in (HOST, HOST_FLOAT, DEVICE)}
"""By "place format", as records name them."""
store.by_name(Arithmetic, ARITHMETICS)
