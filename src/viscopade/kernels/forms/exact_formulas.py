"""The formulas of kernels (`formulas`) with exact coefficients, for the proofs."""

from __future__ import annotations

from collections.abc import Sequence
from fractions import Fraction

from flint import arb

from viscopade.approximation.half_line import require_half_line_degrees
from viscopade.approximation.inverse import InverseForm
from viscopade.approximation.lacunary import LacunaryQuotient
from viscopade.kernels import formulas
from viscopade.kernels.enclosure import Formula

Coefficients = Sequence[Fraction | arb]


def quotient_formula(a: Coefficients, b: Coefficients) -> Formula:
    """Return eps = N/D with coefficients in ascending order."""
    given = formulas.dense(a=a, b=b) | formulas.losses(a, b)
    near, _ = formulas.epsilon_branches(given)
    return Formula(1, near, None, given)


def half_line_formula(found: LacunaryQuotient) -> Formula:
    """Return eps = D/(D + v*^2 N), with N and D lacunary in y = v*^(1/3), deg N = deg D + 4."""
    require_half_line_degrees(found.powers)
    return Formula(3, *formulas.half_line_branches(found.powers), formulas.constants(found.powers, found.a, found.b))


def inverse_formula(found: LacunaryQuotient, form: InverseForm) -> Formula:
    """Return v* = y^k N/D, with N and D lacunary in y = ((1 - eps)/eps)^root; `power` is k."""
    near, *far = formulas.inverse_branches(found.powers, form)
    given = formulas.constants(found.powers, found.a, found.b)
    return Formula(form.shift, near, far[0] if far else None, given)
