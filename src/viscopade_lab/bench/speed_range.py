"""The speeds and the material of a benchmark."""

from __future__ import annotations

import math
from dataclasses import dataclass
from functools import lru_cache
from typing import Literal, get_args

import numpy as np
import numpy.typing as npt

from viscopade.arrays import double
from viscopade.arrays.checked import FloatArray
from viscopade.collision import spheres
from viscopade.theory.paper import BETA_ICE_CGS

Distribution = Literal["log-uniform", "maxwell", "equal"]
DISTRIBUTIONS: tuple[Distribution, ...] = get_args(Distribution)

MAX_V_STAR = 50.0
PAIRS = 8
_SEED = 20110705  # of all random numbers: every run has the same inputs


@dataclass(frozen=True)
class SpeedRange:
    """How fast the contenders' spheres collide, and their material.

    Attributes
    ----------
    beta : float
        Of the material, in (time/length)^(1/5).
    speed_min, speed_max : float
        Impact speeds, in length/time.
    """

    beta: float = float(BETA_ICE_CGS)
    speed_min: float = 1e-3
    speed_max: float = 1e3

    def __post_init__(self) -> None:
        """Refuse what the benchmark cannot measure: v* beyond what the rivals can do, for one."""
        for name in ("beta", "speed_min", "speed_max"):
            value = getattr(self, name)
            if not 1e-30 <= value <= 1e30:  # also for float, and the fifth power of beta
                raise ValueError(f"{name} is {value!r}: expected a number from 1e-30 to 1e30")
        if self.speed_min >= self.speed_max:
            raise ValueError(f"speed_min is {self.speed_min!r}: expected less than speed_max, {self.speed_max!r}")
        if self.v_star_max > MAX_V_STAR:
            raise ValueError(f"v* at speed_max is {self.v_star_max:.4g}: expected at most {MAX_V_STAR:g}")

    def v_star(self, speed: float) -> float:
        """Return v* of a speed."""
        return spheres.v_star(speed, self.beta)

    @property
    def v_star_max(self) -> float:
        """v* at the highest speed."""
        return self.v_star(self.speed_max)

    @property
    def typical(self) -> float:
        """The geometric mean of the ends: the one speed of `equal`, and the most frequent one of `maxwell`."""
        return math.sqrt(self.speed_min) * math.sqrt(self.speed_max)

    @property
    def is_ice(self) -> bool:
        """Whether the published fit for ice in cm/s is meant for this material."""
        return self.beta == float(BETA_ICE_CGS)

    def speeds(self, kind: Distribution, size: int) -> FloatArray:
        """Return impact speeds, the same ones at every call; a shorter array is the beginning of a longer one.

        `log-uniform`: the logarithm is uniform over the range. `maxwell`: the normal component of the impact velocity
        in a gas in equilibrium, whose density is v exp(-v^2/(2 s^2)) with s = `typical` (faster pairs meet more often,
        hence the factor v), cut at the ends of the range. `equal`: all are `typical`.
        """
        if kind == "equal":
            return np.full(size, self.typical)
        uniform = np.random.default_rng((_SEED, DISTRIBUTIONS.index(kind))).random(size)
        if kind == "maxwell":
            values = self.typical * np.sqrt(-2 * np.log1p(-uniform))
        else:
            low, high = math.log(self.speed_min), math.log(self.speed_max)
            values = np.exp(low + (high - low) * uniform)
        return np.asarray(np.clip(values, self.speed_min, self.speed_max), dtype=np.float64)

    def pairs(self, size: int) -> npt.NDArray[np.intc]:
        """Return for each collision which pair of materials meets."""
        return np.random.default_rng((_SEED, 10)).integers(PAIRS, size=size, dtype=np.intc)

    @property
    def beta_of_pairs(self) -> FloatArray:
        """The betas of these pairs: from half of `beta` to twice that."""
        return self.beta * np.exp2(np.linspace(-1, 1, PAIRS))


@lru_cache(maxsize=1)
def elastic_contact_time() -> float:
    """Contact time of an elastic collision in the paper's scaling (v* = 0)."""
    return float(double.tau_c(0.0))
