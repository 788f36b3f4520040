"""The scaled equation of motion and its end of contact in SymPy (eq:equationOfMotionNatUnit, eq:tEndAdvanced)."""

from __future__ import annotations

from typing import TYPE_CHECKING, NamedTuple

if TYPE_CHECKING:
    import sympy


class ScaledEquation(NamedTuple):
    """The scaled equation of motion, lhs = 0, with x(0) = 0 and x'(0) = 1, as SymPy objects."""

    lhs: sympy.Expr
    x: sympy.Expr
    """The compression as a function applied to time, x(tau); `x.func` is the bare function."""
    tau: sympy.Symbol
    kappa: sympy.Symbol
    """v*^2 = beta v^(1/5) (section 2.1), positive."""


def scaled_equation() -> ScaledEquation:
    """Return x'' + x^(3/2) + kappa x' sqrt(x) with its symbols (eq:equationOfMotionNatUnit, section 2.1).

    x and tau are pure numbers, compression and time in units of `Pair.length_scale` and `Pair.time_scale`.
    The equation holds during contact, which ends as `end_of_contact` says. `derivations/01_scaling.py`
    derives it.
    """
    import sympy

    tau, kappa = sympy.Symbol("tau", real=True), sympy.Symbol("kappa", positive=True)
    x = sympy.Function("x", nonnegative=True)(tau)
    lhs = x.diff(tau, 2) + sympy.sqrt(x) ** 3 + kappa * x.diff(tau) * sympy.sqrt(x)
    return ScaledEquation(lhs, x, tau, kappa)


def end_of_contact() -> sympy.Eq:
    """Return the condition x'' = 0 that ends the contact (eq:tEndAdvanced), as SymPy equality.

    Its symbols are those of `scaled_equation`. The force vanishes there while the spheres are still
    compressed: x = kappa eps (section 2.1).
    """
    import sympy

    equation = scaled_equation()
    return sympy.Eq(equation.x.diff(equation.tau, 2), 0)
