"""Quotient kernels [m/n]: rational approximants of eps in v*, Padé and best ones, with proofs."""

from __future__ import annotations

from functools import lru_cache
from typing import SupportsIndex

from viscopade.approximation.measure import Measure
from viscopade.collision.exact import Exact
from viscopade.kernels import build, prove_rational
from viscopade.kernels.kernel import Kernel
from viscopade.theory.law import VISCOELASTIC, Law


@lru_cache(maxsize=256)
def pade(m: int, n: int, law: Law = VISCOELASTIC) -> Kernel:
    """Return the kernel of a Padé approximant; of another law than the paper's with sampled errors."""
    made = prove_rational.of_pade(m, n) if law == VISCOELASTIC else prove_rational.sampled_pade(m, n, law)
    return build.quotient(made)


def best(
    m: SupportsIndex, n: SupportsIndex, v_star_max: Exact, v_star_min: Exact = 0, measure: Measure = "both"
) -> Kernel:
    """Return the kernel of the best approximant [m/n] on an interval; arguments and errors as for `minimax.fit`."""
    return build.quotient(prove_rational.of_minimax(m, n, v_star_max, v_star_min, measure))


def accurate(accuracy: Exact, v_star_max: Exact, v_star_min: Exact = 0, measure: Measure = "both") -> Kernel:
    """Return the cheapest kernel whose proven errors sum to at most `accuracy` in type double."""
    return build.quotient(prove_rational.accurate(accuracy, v_star_max, v_star_min, measure))
