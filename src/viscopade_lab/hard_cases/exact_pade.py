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
    """Return the Padé approximant [m/n] of any series with rational coefficients, solved exactly.

    It serves for experiments: known functions, or h_k rounded to a few digits. Multiple poles and zeros are recognised.

    Parameters
    ----------
    h : sequence of int or Fraction
        h_0 … h_N with N >= m + n; h_0 > 0.

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
    exact = [fmpq(int(h_k.numerator), int(h_k.denominator)) for h_k in h]
    a, b = exact_solution(exact, m, n)
    with working(bits_for(digits) + 64):
        balls = tuple(arb(h_k) for h_k in exact)
        zeros, poles = (exact_roots(fmpq_poly(c)) for c in (a, b))
        contact = _exact_contact(b, exact, m + n)
        return assembled(tuple(map(arb, a)), tuple(map(arb, b)), balls, m, n, digits, zeros, poles, 0, contact)


def exact_solution(h: Sequence[fmpq], m: int, n: int) -> tuple[list[fmpq], list[fmpq]]:
    """Return a and b of [m/n] as exact fractions.

    Raises
    ------
    DegenerateError
        If [m/n] does not exist or is not unique.
    """
    b = [fmpq(1)]
    if n:
        matrix, right = order_system(h, m, n, fmpq(0))
        try:
            solution = fmpq_mat(n, n, matrix).solve(fmpq_mat(n, 1, right))
        except ZeroDivisionError:
            raise DegenerateError(f"[{m}/{n}] does not exist or is not unique: its linear system is singular") from None
        b += [solution[i, 0] for i in range(n)]
    a = [sum((b[i] * h[k - i] for i in range(min(k, n) + 1)), fmpq(0)) for k in range(m + 1)]
    return a, b


def _exact_contact(b: Sequence[fmpq], h: Sequence[fmpq], conditions: int) -> tuple[int, arb]:
    """Return the result of `_contact` from exact numbers, for which it is decidable whether they are 0."""
    product = fmpq_poly(list(b)) * fmpq_poly(list(h))
    for k in range(conditions + 1, len(h)):
        if product[k] != 0:
            return k - 1, arb(product[k])
    return len(h) - 1, arb(0)


def exact_roots(polynomial: fmpq_poly) -> tuple[Root, ...]:
    """Return the roots of a polynomial with rational coefficients, nearest to v* = 0 first."""
    found = cast(list[tuple[acb, int]], polynomial.complex_roots())  # the stub lacks the multiplicities
    values = [value for value, _ in found]
    roots = [Root(value, int(multiplicity), is_real(value, values)) for value, multiplicity in found]
    return tuple(sorted(roots, key=distance_from_origin))
