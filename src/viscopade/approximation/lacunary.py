"""Lacunary polynomials and their quotients N(y)/D(y), in which only some powers of y = x^(1/r) occur.

If a function behaves like different fractional powers at 0 and at infinity, as eps(v*) does, quotients with few powers
of a root of the argument are far better than quotients of full polynomials.
"""

from __future__ import annotations

from dataclasses import dataclass
from fractions import Fraction
from itertools import pairwise


@dataclass(frozen=True)
class Powers:
    """The powers of y that occur in N and in D.

    Attributes
    ----------
    top, bottom : tuple of int
        Exponents in N and D, ascending, each beginning with 0; the coefficient of y^0 in D is 1.
    """

    top: tuple[int, ...]
    bottom: tuple[int, ...]

    def __post_init__(self) -> None:
        """Refuse exponents that do not ascend from 0."""
        # Exponents ascend from 0: without y^0, N/D would be 0 or infinite at y = 0.
        for name, exponents in (("top", self.top), ("bottom", self.bottom)):
            if not exponents or exponents[0] != 0 or any(b <= a for a, b in pairwise(exponents)):
                raise ValueError(f"{name} is {exponents}: expected ascending exponents that begin with 0")

    @property
    def m(self) -> int:
        """Degree of N."""
        return self.top[-1]

    @property
    def n(self) -> int:
        """Degree of D."""
        return self.bottom[-1]

    @property
    def coefficients(self) -> int:
        """Number of free coefficients."""
        return len(self.top) + len(self.bottom) - 1

    @property
    def label(self) -> str:
        """The powers as text for tables, "0 4 8 / 0 4"."""
        return f"{' '.join(map(str, self.top))} / {' '.join(map(str, self.bottom))}"


def full_powers(m: int, n: int) -> Powers:
    """Return all powers up to degrees m and n, which must not be negative."""
    return Powers(tuple(range(m + 1)), tuple(range(n + 1)))


@dataclass(frozen=True)
class LacunaryQuotient:
    """A lacunary quotient N(y)/D(y) with exact coefficients.

    Attributes
    ----------
    powers : Powers
    a, b : tuple of Fraction
        Coefficients, in the order of the exponents; b_0 = 1.
    """

    powers: Powers
    a: tuple[Fraction, ...]
    b: tuple[Fraction, ...]

    def __post_init__(self) -> None:
        """Refuse coefficients that do not belong to the powers, or whose b_0 is not 1."""
        if (len(self.a), len(self.b)) != (len(self.powers.top), len(self.powers.bottom)):
            numbers = f"{len(self.a)} and {len(self.b)} coefficients"
            raise ValueError(f"{self.powers.label} cannot have {numbers}: expected one for each power")
        if self.b[0] != 1:
            raise ValueError(f"the coefficient of y^0 in D is {self.b[0]}: expected 1")
