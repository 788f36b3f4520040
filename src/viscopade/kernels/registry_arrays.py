"""Formulas of the registry's kernels on NumPy arrays, without the compiled code's rounding."""

from __future__ import annotations

from collections.abc import Iterable, Sequence

import numpy as np

from viscopade.approximation.lacunary import Powers
from viscopade.arithmetic.formats import DOUBLE
from viscopade.arrays import double
from viscopade.arrays.checked import FloatArray
from viscopade.kernels import catalogue, formulas, prove_lacunary
from viscopade.kernels.expressions import CodeBranch, read
from viscopade.kernels.machine import located, machine_arithmetic
from viscopade.kernels.registry import Entry
from viscopade.kernels.speed_table import speed_table

COMPACT, FULL = [entry.key.split()[1] for entry in catalogue.group("compact")], "full"


def entry_epsilon(entry: Entry, v_star: FloatArray) -> FloatArray:
    """Return eps by an entry's formula.

    Tables end at some v*; beyond, as in the code, the formula of the half-line holds. Full accuracy is the exact eps,
    but for rounding, where it is used beyond a table as well.
    """
    found = np.asarray(_of_half_line(entry.tier, v_star) if entry.tier in COMPACT else double.epsilon(v_star))
    return _of_table(entry, v_star, found) if entry.kind == "speed" and entry.tier != FULL else found


def _of_half_line(tier: str, v_star: FloatArray) -> FloatArray:
    kernel = prove_lacunary.half_line_kernel(tier)
    variant = kernel.variant(DOUBLE)
    return half_line_values(kernel.powers, variant.a, variant.b, v_star)[0]


def half_line_values(
    powers: Powers, a: Sequence[float], b: Sequence[float], v_star: FloatArray
) -> tuple[FloatArray, FloatArray]:
    """Return eps and 1 - eps of a half-line kernel with coefficients that are doubles, for all v* >= 0."""
    near, far = formulas.half_line_branches(powers)
    constants = formulas.constants(powers, a, b)

    def values(branch: CodeBranch, v_star: FloatArray) -> Iterable[FloatArray]:
        return read(
            branch, ("epsilon", "one_minus_epsilon"), {"v_star": v_star, **constants}, machine_arithmetic(DOUBLE)
        ).values()

    pairs = zip(values(near, np.minimum(v_star, 1)), values(far, np.maximum(v_star, 1)), strict=True)
    epsilon, loss = (np.where(v_star <= 1, small, large) for small, large in pairs)
    return epsilon, loss


def _of_table(entry: Entry, v_star: FloatArray, beyond: FloatArray) -> FloatArray:
    """Return base + p of the row of w = v*^10; `beyond` where w is not in the table."""
    with np.errstate(over="ignore"):
        found, branch = located(speed_table(entry.tier, entry.size), "restitution", v_star**10, 1.0)
    return np.where(branch == 0, found, beyond)
