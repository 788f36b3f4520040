"""The speeds and the material of the benchmark: ice in cm/s, over six decades."""

from __future__ import annotations

import numpy as np

from viscopade.arrays.checked import FloatArray
from viscopade.theory.paper import BETA_ICE_CGS

BETA = float(BETA_ICE_CGS)
"""beta of the paper's ice, 1.307 (s/cm)^(1/5)."""
SPEED_MIN, SPEED_MAX = 1e-3, 1e3
"""In cm/s: v* from 0.57 to 2.3, eps from 0.7 to 0.07. A choice, wider than the measured 0.015 to 2 cm/s."""
_SEED = 20110705  # of the random speeds; any would do


def speeds(size: int) -> FloatArray:
    """Return `size` impact speeds in cm/s, random, whose logarithm is uniform over the range.

    They are the same ones at every call; a shorter array is the beginning of a longer one.
    """
    low, high = np.log([SPEED_MIN, SPEED_MAX])
    uniform = np.random.default_rng(_SEED).random(size)
    # Rounding of exp and log may lead beyond the ends.
    return np.asarray(np.clip(np.exp(low + (high - low) * uniform), SPEED_MIN, SPEED_MAX), dtype=np.float64)
