"""Compact kernels: eps for all speeds by a lacunary quotient in a root of v*, without a table, with proofs."""

from __future__ import annotations

from viscopade.approximation.measure import Measure
from viscopade.collision.exact import Exact
from viscopade.kernels import build, prove_lacunary
from viscopade.kernels.kernel import Kernel


def compact(accuracy: Exact, measure: Measure = "both") -> Kernel:
    """Return the kernel of speed and beta with the fewest coefficients and a proven error within the accuracy."""
    return build.compact(prove_lacunary.half_line_kernel(accuracy, measure))


def half_line(accuracy: Exact, measure: Measure = "both") -> Kernel:
    """Return the kernel of v*, by cbrt, with the coefficients of the compact one."""
    return build.half_line(prove_lacunary.half_line_kernel(accuracy, measure))
