"""The speeds and the material of the benchmark: ice in cm/s, over six decades."""

from __future__ import annotations

import numpy as np

from viscopade.arrays.checked import FloatArray
from viscopade.theory.paper import BETA_ICE_CGS

BETA = float(BETA_ICE_CGS)
SPEED_MIN, SPEED_MAX = 1e-3, 1e3
_SEED = 20110705


def speeds(size: int) -> FloatArray:
    """Return impact speeds whose logarithm is uniform over the range.

    They are the same ones at every call; a shorter array is the beginning of a longer one.
    """
    low, high = np.log([SPEED_MIN, SPEED_MAX])
    uniform = np.random.default_rng(_SEED).random(size)
    return np.asarray(np.clip(np.exp(low + (high - low) * uniform), SPEED_MIN, SPEED_MAX), dtype=np.float64)
