"""The scaled equation of motion and its end of contact in SymPy (the paper's Eqs. 9 and 6)."""

from __future__ import annotations

from fractions import Fraction
from typing import TYPE_CHECKING, NamedTuple

from viscopade.theory.law import VISCOELASTIC, Law, law_of

if TYPE_CHECKING:
    import sympy


class ScaledEquation(NamedTuple):
    """The scaled equation of motion, lhs = 0, with x(0) = 0 and x'(0) = 1, as SymPy objects."""

    lhs: sympy.Expr
    x: sympy.Expr
    """The compression as a function applied to time, x(tau); `x.func` is the bare function."""
    tau: sympy.Symbol
    kappa: sympy.Symbol
    """Damping, positive; v*^2 = beta v^(1/5) for the paper's law."""


def rational(number: Fraction) -> sympy.Rational:
    """Return a fraction as a SymPy number."""
    import sympy

    return sympy.Rational(number.numerator, number.denominator)


def scaled_equation(law: Law | str = VISCOELASTIC) -> ScaledEquation:
    """Return x'' + x^a + kappa x' x^b with its symbols.

    The paper's law is x'' + x^(3/2) + kappa x' sqrt(x) (the paper's Eq. 9). x and tau are pure numbers,
    compression and time in units of `Law.length_scale` and `Law.time_scale`. The equation holds during contact, up to
    `end_of_contact`. `derivations/01_scaling.py` and `15_laws.py` derive it.
    """
    import sympy

    # x is not negative during contact, and kappa is positive: without these assumptions SymPy does not simplify powers.
    tau, kappa = sympy.Symbol("tau", real=True), sympy.Symbol("kappa", positive=True)
    x = sympy.Function("x", nonnegative=True)(tau)
    a, b = law_of(law).elastic, law_of(law).damping
    lhs = x.diff(tau, 2) + x ** rational(a) + kappa * x.diff(tau) * x ** rational(b)
    return ScaledEquation(lhs, x, tau, kappa)


def exponents(equation: ScaledEquation) -> tuple[Fraction, Fraction]:
    """Return the exponents a and b of x^a and kappa x^b x', as they stand in a scaled equation.

    Raises
    ------
    ValueError
        If the equation has other terms, or an exponent is no rational number.
    """
    import sympy

    # The forces are what is left without x'': the elastic one without kappa, the damping in proportion to kappa x'.
    x, speed = equation.x, equation.x.diff(equation.tau)
    elastic = equation.lhs.subs(equation.kappa, 0) - speed.diff(equation.tau)
    damping = equation.lhs.diff(equation.kappa) / speed
    # The exponent of a power F(x) is x F'(x)/F(x).
    a, b = (sympy.simplify(x * force.diff(x) / force) for force in (elastic, damping))
    # A factor of x^a or a further term does not change these quotients or is lost in them. So the equation is compared
    # with the one that the exponents make.
    powers = x**a + speed.diff(equation.tau) + equation.kappa * speed * x**b
    if not (a.is_Rational and b.is_Rational) or sympy.simplify(equation.lhs - powers) != 0:
        raise ValueError(f"the equation is {equation.lhs} = 0: expected x'' + x^a + kappa x^b x' = 0")
    return Fraction(int(a.p), int(a.q)), Fraction(int(b.p), int(b.q))


def end_of_contact(law: Law | str = VISCOELASTIC) -> sympy.Eq:
    """Return the condition that ends the contact as SymPy equality: x'' = 0 (the paper's Eq. 6), or x = 0.

    Its symbols are those of `scaled_equation`. With delayed recovery (`Law.delayed`: nu > 1 and the end "force") the
    force vanishes while the spheres are still compressed: x = kappa eps for the paper's law.
    `derivations/01_scaling.py` and notebook 02 read this condition. The series have it as the rational series H
    (`symbolic.delayed_recovery_series`, `series.end_series`), and a collision as the end of its flow.
    """
    import sympy

    equation = scaled_equation(law)
    return sympy.Eq(equation.x.diff(equation.tau, 2) if law_of(law).delayed else equation.x, 0)
