"""The formulas of kernels (`formulas`) with exact coefficients, for the proofs."""

from __future__ import annotations

from collections.abc import Sequence
from fractions import Fraction

from flint import arb

from viscopade.approximation.half_line import require_half_line_degrees
from viscopade.approximation.inverse import InverseForm
from viscopade.approximation.lacunary import LacunaryQuotient
from viscopade.kernels.enclosure import Formula
from viscopade.kernels.forms import formulas
from viscopade.theory.law import VISCOELASTIC, Law

Coefficients = Sequence[Fraction | arb]


def quotient_formula(a: Coefficients, b: Coefficients, law: Law = VISCOELASTIC) -> Formula:
    """Return a law's eps = N/D with coefficients in ascending order; with a limit if N/D goes like eps at infinity."""
    given = formulas.dense(a=a, b=b) | formulas.losses(a, b, law.d)
    near, far = formulas.epsilon_branches(given)
    follows = len(b) - len(a) == law.whole_decay and a[-1] != 0 != b[-1]
    return Formula(1, near, far if follows else None, given)


def derivative_formula(t: Sequence[Fraction], b: Sequence[Fraction]) -> Formula:
    """Return d eps/d v* = v* T/D^2 with coefficients in ascending order."""
    given = formulas.dense(t=t, b=b)
    return Formula(1, *formulas.derivative_branches(given), given)


def half_line_formula(found: LacunaryQuotient) -> Formula:
    """Return eps = D/(D + v*^2 N), with N and D lacunary in y = v*^(1/3), deg N = deg D + 4."""
    require_half_line_degrees(found.powers)
    return Formula(3, *formulas.half_line_branches(found.powers), formulas.constants(found.powers, found.a, found.b))


def inverse_formula(found: LacunaryQuotient, form: InverseForm) -> Formula:
    """Return v* = y^k N/D, with N and D lacunary in y = ((1 - eps)/eps)^root; `power` is k."""
    near, *far = formulas.inverse_branches(found.powers, form)
    given = formulas.constants(found.powers, found.a, found.b)
    return Formula(form.shift, near, far[0] if far else None, given)


def slope_numerator(a: Sequence[Fraction], b: Sequence[Fraction]) -> tuple[Fraction, ...]:
    """Return the coefficients of T = (N' D - N D')/v*, d/d v* of N/D being v* T/D^2.

    Raises
    ------
    ValueError
        Unless a_0 b_1 = a_1 b_0.
    """
    t = [Fraction(0)] * (len(a) + len(b) - 2)
    for i, top in enumerate(a):
        for j, bottom in enumerate(b):
            if i != j:
                t[i + j - 1] += (i - j) * top * bottom
    if t and t[0]:
        raise ValueError("1 - N/D must vanish like v*^2")
    return tuple(t[1:])
