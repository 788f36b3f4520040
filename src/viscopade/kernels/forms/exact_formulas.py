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


def half_line_formula(found: LacunaryQuotient) -> Formula:
    """Return eps = D/(D + v*^2 N), with N and D lacunary in y = v*^(1/3), deg N = deg D + 4."""
    require_half_line_degrees(found.powers)
    return Formula(3, *formulas.half_line_branches(found.powers), formulas.constants(found.powers, found.a, found.b))


def inverse_formula(found: LacunaryQuotient, form: InverseForm) -> Formula:
    """Return v* = y^k N/D, with N and D lacunary in y = ((1 - eps)/eps)^root; `power` is k."""
    near, *far = formulas.inverse_branches(found.powers, form)
    given = formulas.constants(found.powers, found.a, found.b)
    return Formula(form.shift, near, far[0] if far else None, given)
