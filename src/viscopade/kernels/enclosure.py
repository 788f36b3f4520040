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
        The r for which the formula is a smooth function of its root y = x^(1/r).
    near : CodeBranch
        Its program for arguments near x = 0.
    far : CodeBranch or None
        That for arguments near infinity.
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

    def near_zero(self, result: str, **given: arb_series) -> arb_series:
        """Return a result of the program near 0, given its inputs and roots.

        Raises
        ------
        ZeroDivisionError
            If a denominator may vanish.
        """
        return self._evaluated(self.near, result, given)

    def limit(self, **given: arb_series) -> arb_series:
        """Return "limit", a result of the program near infinity, given its inputs and roots.

        Raises
        ------
        ArithmeticError
            If the formula has no such program, or a denominator may vanish.
        """
        if self.far is None or "limit" not in self.far.results:
            raise ArithmeticError("the formula does not go like the exact one at infinity")
        return self._evaluated(self.far, "limit", given)

    def _evaluated(self, branch: CodeBranch, result: str, given: Mapping[str, arb_series]) -> arb_series:
        found: arb_series = evaluate(branch.results[result], self._run(branch, given), _SERIES)
        return found

    def _run(self, branch: CodeBranch, given: Mapping[str, arb_series]) -> Run:
        exact = {name: c if isinstance(c, arb) else ball_of(c) for name, c in self.coefficients.items()}
        return Run(branch.program, {**exact, **given}, _SERIES)


def exact_polynomial(
    branch: CodeBranch, name: str, variables: Mapping[str, fmpq_poly | bool], coefficients: Mapping[str, float]
) -> fmpq_poly:
    """Return a result or a variable of a branch without quotients as a polynomial, every operation being exact.

    Parameters
    ----------
    branch : CodeBranch
    name : str
    variables : mapping
        The inputs by name, as polynomials in one variable, and conditions.
    coefficients : mapping
        Numbers by name.
    """
    constants = {name: fmpq_poly([to_fmpq(Fraction(c))]) for name, c in coefficients.items()}
    found: fmpq_poly = read(branch, [name], {**constants, **variables}, _POLYNOMIALS)[name]
    return found


def polynomial(coefficients: Sequence[arb], z: arb_series) -> arb_series:
    """Return the polynomial of a series: shifted to z's constant term, by its middle first so that balls grow least."""
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


def _of_series(terms: Sequence[tuple[int, arb]], z: arb_series) -> arb_series:
    by_exponent = dict(terms)
    return polynomial([by_exponent.get(i, arb(0)) for i in range(terms[-1][0] + 1)], z)


def _literal(text: str) -> arb_series:
    return arb_series([ball_of(Fraction(text))])


_SERIES = Reading(_literal, polynomial=_of_series, operations={"/": quotient})
_POLYNOMIALS = Reading(lambda text: fmpq_poly([to_fmpq(Fraction(text))]))
