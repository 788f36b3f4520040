"""Proof readings of formulas with exact coefficients: in balls on power series, and exactly on polynomials."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from fractions import Fraction

from flint import arb, arb_poly, arb_series, fmpq_poly

from viscopade.arithmetic.balls import ball_of
from viscopade.arithmetic.chebyshev import to_fmpq
from viscopade.kernels.expressions import CodeBranch, Reading, Run, evaluate, read


@dataclass(frozen=True, eq=False)
class Formula:
    """A formula with exact coefficients, as the proofs read it.

    Attributes
    ----------
    power : int
        The r for which the formula is a smooth function of its root y = x^(1/r); x is v*.
    near : CodeBranch
        Its program for arguments near x = 0.
    far : CodeBranch or None
        That for arguments near infinity, whose result "limit" tends to a number.
    coefficients : mapping
        By name, exactly, or enclosed.
    """

    power: int
    near: CodeBranch
    far: CodeBranch | None
    coefficients: Mapping[str, Fraction | arb]

    def has(self, result: str) -> bool:
        """Return whether the formula's program near 0 has a result."""
        return result in self.near.results

    def near_zero(self, result: str, **inputs: arb_series) -> arb_series:
        """Return a result of the program near 0, given its inputs and roots by name (`y`, `v_star`).

        Raises
        ------
        ZeroDivisionError
            If a denominator may vanish.
        """
        return self._value(self.near, result, inputs)

    def limit(self, **inputs: arb_series) -> arb_series:
        """Return "limit", a result of the program near infinity, given its inputs and roots by name (`u` = 1/y, `w`).

        Raises
        ------
        ArithmeticError
            If the formula has no such program, or a denominator may vanish.
        """
        if self.far is None or "limit" not in self.far.results:
            raise ArithmeticError("the formula does not go like the exact one at infinity")
        return self._value(self.far, "limit", inputs)

    def _value(self, branch: CodeBranch, result: str, inputs: Mapping[str, arb_series]) -> arb_series:
        """Return a result of a branch, evaluated on power series with balls for coefficients."""
        exact = {name: c if isinstance(c, arb) else ball_of(c) for name, c in self.coefficients.items()}
        value: arb_series = evaluate(branch.results[result], Run(branch.program, {**exact, **inputs}, _SERIES), _SERIES)
        return value


def exact_polynomial(
    branch: CodeBranch, name: str, variables: Mapping[str, fmpq_poly | bool], coefficients: Mapping[str, float]
) -> fmpq_poly:
    """Return a result or a variable of a branch without quotients as a polynomial, every operation being exact.

    Parameters
    ----------
    branch : CodeBranch
        A program of sums and products.
    name : str
        That of the result or variable.
    variables : mapping
        The inputs by name, as polynomials in one variable, and conditions.
    coefficients : mapping
        Numbers by name.
    """
    constants = {name: fmpq_poly([to_fmpq(Fraction(c))]) for name, c in coefficients.items()}
    value: fmpq_poly = read(branch, [name], {**constants, **variables}, _POLYNOMIALS)[name]
    return value


def polynomial(coefficients: Sequence[arb], z: arb_series) -> arb_series:
    """Return the polynomial with these ascending coefficients of a power series z."""
    # z = m + (c - m) + rest, with c the constant term and m its middle. The shift by the exact m leaves balls narrow;
    # only the second one, by the small ball c - m, sees how wide c is. So balls grow least.
    constant, *rest = z.coeffs()
    middle = constant.mid()
    shifted = arb_poly(list(coefficients))(arb_poly([middle, 1]))(arb_poly([constant - middle, 1]))
    if not rest:  # which FLINT does not take for a series without a constant term
        return arb_series(shifted.coeffs()[:1])
    return arb_series(shifted.coeffs())(arb_series([arb(0), *rest]))


def quotient(numerator: arb_series, denominator: arb_series) -> arb_series:
    """Return the quotient of two series; a denominator that may vanish is refused, also for a numerator 0."""
    if not denominator.coeffs() or denominator.coeffs()[0].contains(0):
        raise ZeroDivisionError("the denominator may vanish")
    return numerator / denominator


def _lacunary(terms: Sequence[tuple[int, arb]], z: arb_series) -> arb_series:
    """Return the polynomial of a series whose terms are (exponent, coefficient), ascending; the others are 0."""
    coefficients = dict(terms)
    return polynomial([coefficients.get(i, arb(0)) for i in range(terms[-1][0] + 1)], z)


_SERIES = Reading(lambda text: arb_series([ball_of(Fraction(text))]), polynomial=_lacunary, operations={"/": quotient})
_POLYNOMIALS = Reading(lambda text: fmpq_poly([to_fmpq(Fraction(text))]))
