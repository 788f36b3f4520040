"""Padé approximants of series with rational coefficients, solved in fractions."""

from __future__ import annotations

from collections.abc import Sequence
from numbers import Rational
from typing import SupportsIndex, cast

from flint import acb, arb, fmpq, fmpq_mat, fmpq_poly

from viscopade import arguments
from viscopade.arithmetic.balls import bits_for, working
from viscopade.theory.pade import (
    DegenerateError,
    Pade,
    Root,
    assembled,
    distance_from_origin,
    is_real,
    order_system,
)


def rational_pade(h: Sequence[Rational], m: SupportsIndex, n: SupportsIndex, digits: SupportsIndex = 30) -> Pade:
    """Return the Padé approximant [m/n] = a(x)/b(x), b_0 = 1, of any series sum h_k x^k with rational coefficients.

    a and b are solved in fractions, without error. It serves for experiments: functions in closed form, or h_k rounded
    to a few digits. Multiple poles and zeros are recognised.

    Parameters
    ----------
    h : sequence of int or Fraction
        h_0 … h_N with N >= m + n; h_0 > 0.
    m, n : int
        Degrees of a and b.
    digits : int
        Significant digits that the result prints; 30 by default, as for `pade`.

    Raises
    ------
    TypeError, ValueError
        If an argument has a wrong type or is out of range.
    DegenerateError
        If the linear system for the denominator is singular.

    Notes
    -----
    Coefficients are enclosed like those of `pade`. If one lies exactly half-way between two decimals of `digits`
    digits, `decimals` raises ArithmeticError; use one digit more.
    """
    m, n = arguments.integer("m", m, 0, arguments.MAX_DEGREE), arguments.integer("n", n, 0, arguments.MAX_DEGREE)
    digits = arguments.digits(digits)
    if not all(isinstance(h_k, Rational) for h_k in h):
        raise TypeError("h has an element that is not rational: expected integers and Fractions")
    if len(h) <= m + n or h[0] <= 0:
        raise ValueError(f"h has {len(h)} coefficients: expected h_0 … h_{m + n} with h_0 > 0 for [{m}/{n}]")
    # FLINT's fractions of the h_k, and a and b as such.
    exact = [fmpq(int(h_k.numerator), int(h_k.denominator)) for h_k in h]
    a, b = exact_solution(exact, m, n)
    # 64 bits (a machine word) more than the digits, so that turning fractions into balls costs none of them.
    with working(bits_for(digits) + 64):
        balls = tuple(arb(h_k) for h_k in exact)
        zeros, poles = (exact_roots(fmpq_poly(c)) for c in (a, b))
        # The first coefficient of b h - a beyond the order conditions 0 … m+n that is not 0 is that of h - a/b. It is
        # the product's, as a ends at m; in fractions it is certain which coefficients are 0.
        product = fmpq_poly(b) * fmpq_poly(exact)
        first = next((k for k in range(m + n + 1, len(exact)) if product[k] != 0), None)
        # The order up to which both agree, and the coefficient of the next; all of h if none differs.
        contact = (len(exact) - 1, arb(0)) if first is None else (first - 1, arb(product[first]))
        # 0: no digits are lost in fractions.
        return assembled(tuple(map(arb, a)), tuple(map(arb, b)), balls, m, n, digits, zeros, poles, 0, contact)


def exact_solution(h: Sequence[fmpq], m: int, n: int) -> tuple[list[fmpq], list[fmpq]]:
    """Return the coefficients a_0 … a_m and b_0 … b_n of [m/n] of the series sum h_k x^k, as exact fractions.

    `h` has at least h_0 … h_(m+n).

    Raises
    ------
    DegenerateError
        If [m/n] does not exist or is not unique.
    """
    b = [fmpq(1)]
    if n:
        # Order conditions m+1 … m+n, in which a does not occur: sum_(i>=1) b_i h_(k-i) = -h_k. The matrix is a list by
        # rows; fmpq(0) stands where k < i.
        matrix, right = order_system(h, m, n, fmpq(0))
        try:
            solution = fmpq_mat(n, n, matrix).solve(fmpq_mat(n, 1, right))
        except ZeroDivisionError:
            raise DegenerateError(f"[{m}/{n}] does not exist or is not unique: its linear system is singular") from None
        b += [solution[i, 0] for i in range(n)]
    # Order conditions 0 … m: a_k = sum_i b_i h_(k-i).
    a = [sum((b[i] * h[k - i] for i in range(min(k, n) + 1)), fmpq(0)) for k in range(m + 1)]
    return a, b


def exact_roots(polynomial: fmpq_poly) -> tuple[Root, ...]:
    """Return the roots of a polynomial with rational coefficients, nearest to 0 first, as proven enclosures."""
    # Pairs of a ball and a multiplicity, which FLINT's type stub lacks.
    balls = cast(list[tuple[acb, int]], polynomial.complex_roots())
    values = [value for value, _ in balls]
    # `is_real` compares a ball's mirror image with all balls: it is real if the image overlaps no other.
    roots = [Root(value, int(multiplicity), is_real(value, values)) for value, multiplicity in balls]
    return tuple(sorted(roots, key=distance_from_origin))
