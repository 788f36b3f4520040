"""Rational polynomials on [-1, 1] in exact arithmetic: Chebyshev expansion, truncation, interpolation, bounds."""

from __future__ import annotations

from collections.abc import Sequence
from fractions import Fraction
from functools import cache

from flint import arb, fmpq, fmpq_mat, fmpq_poly

from viscopade.arithmetic.balls import exact_middle, working


def to_fmpq(number: Fraction) -> fmpq:
    """Return a Python fraction as a FLINT fraction."""
    return fmpq(number.numerator, number.denominator)


def to_fraction(number: fmpq) -> Fraction:
    """Return a FLINT fraction as a Python fraction."""
    return Fraction(int(number.p), int(number.q))


@cache
def chebyshev(n: int) -> fmpq_poly:
    """Return the Chebyshev polynomial T_n."""
    if n < 2:
        return fmpq_poly([0, 1] if n else [1])
    # T_n = 2 x T_(n-1) - T_(n-2)
    return fmpq_poly([0, 2]) * chebyshev(n - 1) - chebyshev(n - 2)


@cache
def _from_powers(size: int) -> fmpq_mat:
    """Return the matrix that leads from coefficients of powers of x to those of Chebyshev polynomials."""
    return fmpq_mat(size, size, [chebyshev(n)[k] for k in range(size) for n in range(size)]).inv()


def in_chebyshev(p: fmpq_poly) -> list[fmpq]:
    """Return the Chebyshev coefficients of a polynomial, in ascending order."""
    size = len(p.coeffs())
    coefficients: list[fmpq] = (_from_powers(size) * fmpq_mat(size, 1, p.coeffs())).entries()
    return coefficients


def cut(p: fmpq_poly, degree: int) -> fmpq_poly:
    """Return the truncated Chebyshev expansion of this degree, nearly the best approximation on [-1, 1]."""
    return sum((chebyshev(n) * c for n, c in enumerate(in_chebyshev(p)[: degree + 1])), fmpq_poly([]))


def greatest(p: fmpq_poly, parts: int = 1) -> Fraction:
    """Return a bound of |p| on [-1, 1]: the largest sum of |Chebyshev coefficients| on any of `parts` equal parts.

    One part is enough if p is nearly a multiple of a Chebyshev polynomial.
    """
    # Part i of [-1, 1] is mapped to [-1, 1] by x = (2 i + 1) / parts - 1 + y / parts, with half of its width 1/parts.
    half = fmpq(1, parts)
    on_parts = (p(fmpq_poly([(2 * i + 1) * half - 1, half])) for i in range(parts)) if parts > 1 else (p,)
    # |T_n| <= 1 on [-1, 1], so |p| <= sum |c_n|.
    return to_fraction(max(sum(map(abs, in_chebyshev(part)), fmpq(0)) for part in on_parts))


@cache
def nodes(number: int) -> tuple[Fraction, ...]:
    """Return the zeros of T_number, to 40 bits: any points close to the zeros serve as nodes.

    Fractions of 40 bits, a choice, keep the exact interpolation at these nodes short.
    """
    with working(64):  # FLINT's cosines are then right to more than 40 bits, so that rounding them is reproducible
        # cos(pi (2 i + 1) / (2 n))
        angles = (arb.pi() * (2 * i + 1) / (2 * number) for i in range(number))
        return tuple(Fraction(round(exact_middle(angle.cos()) * 2**40), 2**40) for angle in angles)


def interpolated(points: Sequence[Fraction], values: Sequence[Fraction]) -> fmpq_poly:
    """Return the polynomial p with p(points[i]) = values[i], of degree len(points) - 1, exactly.

    The points are numbers that all differ, such as `nodes`; Newton's divided differences need no linear system.
    """
    # Divided differences, each in the place of the value that is no longer needed:
    # f[x_(i-k) … x_i] = (f[x_(i-k+1) … x_i] - f[x_(i-k) … x_(i-1)]) / (x_i - x_(i-k)).
    x = [to_fmpq(point) for point in points]
    differences = [to_fmpq(value) for value in values]
    for k in range(1, len(x)):
        for i in range(len(x) - 1, k - 1, -1):
            differences[i] = (differences[i] - differences[i - 1]) / (x[i] - x[i - k])

    # Newton's form by Horner's rule, from the last node: p = f[x_0 … x_i] + (x - x_i) p.
    polynomial = fmpq_poly([])
    for node, difference in zip(reversed(x), reversed(differences), strict=True):
        polynomial = polynomial * fmpq_poly([-node, 1]) + difference
    return polynomial
