"""Programs read with machine numbers: operation by operation as code computes, without FMA contraction."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

import numpy as np

from viscopade.arithmetic.formats import DOUBLE, FLOAT, Format
from viscopade.kernels.expressions import Arithmetic, CodeBranch, read

TYPES: Mapping[str, Any] = {DOUBLE.name: float, FLOAT.name: np.float32}
"""Python's or NumPy's type of numbers by the name of a format."""
_ARITHMETIC = {name: Arithmetic(kind) for name, kind in TYPES.items()}


def computed(branch: CodeBranch, result: str, given: Mapping[str, Any], form: Format) -> Any:
    """Return a result of a branch, or one of its variables, for inputs and constants: numbers or arrays of a format."""
    return read(branch, [result], given, _ARITHMETIC[form.name])[result]


def row_of(x: Any, first: int, split: int) -> tuple[Any, Any]:
    """Return the row of x = 2^e m, 1 <= m < 2, in a table with 2^split rows to an octave, the first at 2^first; and m.

    x is a positive number of any type, or an array.
    """
    fraction, exponent = np.frexp(x)
    m = 2 * fraction
    part = ((m - 1) * (1 << split)).astype(np.int64)
    return ((exponent.astype(np.int64) - 1 - first) << split) + part, m


def cleared(x: float, bits: int) -> float:
    """Return a double with the last bits of its significand set to 0."""
    return float((np.float64(x).view(np.int64) >> bits << bits).view(np.float64))
