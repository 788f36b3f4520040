"""Inverse kernels: v* and beta of eps, by a lacunary quotient in a root of (1 - eps)/eps, with proofs."""

from __future__ import annotations

from viscopade.collision.exact import Exact
from viscopade.kernels import build, prove_lacunary
from viscopade.kernels.kernel import Kernel


def inverse(accuracy: Exact, epsilon_min: Exact = 0) -> Kernel:
    """Return the kernel for epsilon_min <= eps <= 1 with the fewest coefficients and a proven error of v*."""
    return build.inverse(prove_lacunary.inverse_kernel(accuracy, epsilon_min))
