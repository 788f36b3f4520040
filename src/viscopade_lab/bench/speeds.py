"""The speeds and the material of the benchmark: ice in cm/s, over six decades."""

from __future__ import annotations

from typing import Literal, get_args

import numpy as np

from viscopade.arrays.checked import FloatArray
from viscopade.theory.paper import BETA_ICE_CGS

Distribution = Literal["log-uniform", "maxwell", "equal"]
DISTRIBUTIONS: tuple[Distribution, ...] = get_args(Distribution)

BETA = float(BETA_ICE_CGS)
SPEED_MIN, SPEED_MAX = 1e-3, 1e3
TYPICAL = 1.0
"""The geometric mean of the ends: the only speed of `equal`, and the most frequent speed of `maxwell`."""
_SEED = 20110705  # of all random numbers: every run has the same inputs


def speeds(kind: Distribution, size: int) -> FloatArray:
    """Return impact speeds, the same ones at every call; a shorter array is the beginning of a longer one.

    `log-uniform`: the logarithm is uniform over the range. `maxwell`: the normal component of the impact velocity in a
    gas in equilibrium, whose density is v exp(-v^2/(2 s^2)) with s = TYPICAL (faster pairs meet more often, hence the
    factor v), cut at the ends of the range. `equal`: all are TYPICAL.
    """
    if kind == "equal":
        return np.full(size, TYPICAL)
    uniform = np.random.default_rng((_SEED, DISTRIBUTIONS.index(kind))).random(size)
    if kind == "maxwell":
        values = TYPICAL * np.sqrt(-2 * np.log1p(-uniform))
    else:
        low, high = np.log([SPEED_MIN, SPEED_MAX])
        values = np.exp(low + (high - low) * uniform)
    return np.asarray(np.clip(values, SPEED_MIN, SPEED_MAX), dtype=np.float64)
