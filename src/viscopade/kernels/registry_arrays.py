"""Formulas of the registry's kernels on NumPy arrays, without the compiled code's rounding."""

from __future__ import annotations

from collections.abc import Sequence
from functools import lru_cache

import numpy as np

from viscopade.approximation.lacunary import Powers
from viscopade.arithmetic.formats import DOUBLE
from viscopade.arrays import double
from viscopade.arrays.checked import FloatArray
from viscopade.kernels import prove_lacunary
from viscopade.kernels.expressions import Arithmetic, CodeBranch, Run, evaluate
from viscopade.kernels.forms import formulas
from viscopade.kernels.forms.speed_kernel import HALF_LINE, TABLES
from viscopade.kernels.forms.speed_table import OCTAVES, SWITCH, Table
from viscopade.kernels.names import FULL
from viscopade.kernels.registry import Entry

_ARRAYS = Arithmetic(float, {"cbrt": np.cbrt})


def entry_epsilon(entry: Entry, v_star: FloatArray) -> FloatArray:
    """Return eps by an entry's formula.

    Tables end at some v*; beyond, as in the code, the formula of the half-line holds. Full accuracy is the exact eps,
    but for rounding, where it is used beyond a table as well.
    """
    if entry.tier == FULL:
        return np.asarray(double.epsilon(v_star))
    key = entry.tier, entry.size
    table = TABLES.get(key) if entry.kind == "speed" else None
    if table is None:
        return _of_half_line(entry.tier, v_star)
    beyond = _of_half_line(entry.tier, v_star) if entry.tier in HALF_LINE else double.epsilon(v_star)
    return np.where(_inside(table, v_star), _of_table(table, _rows(*key), v_star), beyond)


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

    def values(branch: CodeBranch, v_star: FloatArray) -> list[FloatArray]:
        run = Run(branch.program, {"v_star": v_star, **constants}, _ARRAYS)
        return [evaluate(branch.results[name], run, _ARRAYS) for name in ("epsilon", "one_minus_epsilon")]

    pairs = zip(values(near, np.minimum(v_star, 1)), values(far, np.maximum(v_star, 1)), strict=True)
    epsilon, loss = (np.where(v_star <= 1, small, large) for small, large in pairs)
    return epsilon, loss


def _inside(table: Table, v_star: FloatArray) -> FloatArray:
    exponent = np.frexp(v_star**10)[1] - 1
    return np.asarray((table.first <= exponent) & (exponent < table.first + OCTAVES))


@lru_cache(maxsize=len(TABLES))
def _rows(tier: str, size: str) -> FloatArray:
    return np.array(TABLES[tier, size].rows)


def _of_table(table: Table, rows: FloatArray, v_star: FloatArray) -> FloatArray:
    """Return base + p, p being the polynomial in the mantissa of w = v*^10 of its row."""
    mantissa, exponent = np.frexp(v_star**10)
    m, e = 2 * mantissa, exponent - 1
    e = np.clip(e, table.first, table.first + OCTAVES - 1)
    row = ((e - table.first) << table.split) + ((m - 1) * (1 << table.split)).astype(np.int64)
    p = np.zeros_like(m)
    for c in rows[row].T[::-1]:
        p = c + m * p
    return np.asarray(np.where(e < SWITCH, 1.0, 0.0) + p)
