r"""Truncated series.

Up to which v* is the truncated series within 1e-3 of eps, and does round-off matter?

With S_k = h_0 + … + h_k v*^k, S_k - S_(k-1) = h_k v*^k. Where both sums are within 1e-3 of eps, |h_k| v*^k <= 2e-3 eps:
the smaller v* of two neighbouring orders lies below equality. The sum in double precision fails where the exact sum
does, within the error bound of Horner's rule.
"""

from __future__ import annotations

from collections.abc import Callable
from typing import TYPE_CHECKING, Any, NamedTuple

import numpy as np
from flint import arb, arb_poly

from viscopade.arithmetic.balls import exact_middle, working
from viscopade.arrays import double
from viscopade.arrays.checked import FloatArray
from viscopade.kernels import truth
from viscopade.plots.sheet import BLUE, V_STAR, VERMILION
from viscopade.theory.pade import horner
from viscopade.theory.series import series
from viscopade_lab import singularity
from viscopade_lab.hard_cases.case import Finding, Row

if TYPE_CHECKING:
    from matplotlib.figure import Figure

TOLERANCE = 1e-3
BITS = 320  # a sum loses 16 digits next to its zeros
GRID: FloatArray = np.arange(64.0, 5120.0) / 4096  # of v*; between its points the place is bisected


class Coefficients(NamedTuple):
    """h_0, h_1, … as balls and as doubles, up to an order."""

    balls: tuple[arb, ...]
    h: FloatArray


def coefficients(order: int) -> Coefficients:
    """Return what is needed for all orders up to this one."""
    balls = series(order, 40).h
    return Coefficients(balls, np.array([float(exact_middle(h_k)) for h_k in balls]))


def bisected(beyond: Callable[[FloatArray], Any], low: FloatArray, high: FloatArray) -> FloatArray:
    """Return for every order (first axis) the v* between low and high at which `beyond` becomes true."""
    low, high = low[:, None], high[:, None]
    for _ in range(56):
        middle = (low + high) / 2
        there = beyond(middle)
        low, high = np.where(there, low, middle), np.where(there, middle, high)
    place: FloatArray = high[:, 0]
    return place


def places(given: Coefficients) -> FloatArray:
    """Return for every order the first v* at which the sum in double precision is off by 1e-3."""
    h = np.tril(np.ones((len(given.h), len(given.h)))) * given.h

    def off(v: FloatArray) -> Any:
        return abs(horner(h.T[:, :, None], v) / double.epsilon(v) - 1) > TOLERANCE

    first = np.argmax(off(np.broadcast_to(GRID, (len(given.h), len(GRID)))), axis=1)
    return bisected(off, GRID[first - 1], GRID[first])


def distance(given: Coefficients, k: int, place: float) -> float:
    """Return the distance of the exact |S_k/eps - 1| from the tolerance at a v*, relative to the bound of round-off.

    Errors: of Horner's rule and the coefficients, of eps in double precision, of three operations, and of the place.
    """
    with working(BITS):
        v, polynomial = arb(place), arb_poly(list(given.balls[: k + 1]))
        eps, unit = truth.exact_portions(v).epsilon, arb(2) ** -53
        size = arb_poly([abs(h_k) for h_k in given.balls[: k + 1]])(v)
        noise = (2 * k + 1) * unit * (1 + 2 * k * unit) * size / eps + (2 * double.ULP["epsilon"] + 3) * unit
        value = polynomial(v)
        slope = polynomial.derivative()(v) / eps - value / eps * arb(float(double.slope(place))) / v
        return float(abs(abs(value / eps - 1) - TOLERANCE) / (noise + 4 * unit * v * abs(slope)))


def latest(given: Coefficients) -> FloatArray:
    """Return the upper bound for the smaller v* of the orders k - 1 and k; infinite where h_k = 0."""
    h, k = abs(given.h[:, None]), np.arange(len(given.h))[:, None]
    low, high = np.full(len(h), GRID[0]), np.full(len(h), 2.0)
    place = bisected(lambda v: h * v**k > 2 * TOLERANCE * double.epsilon(v), low, high)
    return np.where((h[:, 0] > 0) & (k[:, 0] > 0), place, np.inf)


def measure(thorough: bool) -> Finding:
    """Find the v* at which every sum fails, and compare with the bound of the remainder."""
    return judged(given := coefficients(160 if thorough else 80), places(given))


def judged(given: Coefficients, found: FloatArray) -> Finding:
    """Compare the v* at which sums fail with the bound of the remainder."""
    order, limits, best = len(found) - 1, latest(given), int(np.argmax(found))
    radius = abs(complex(singularity.from_flow(10).v_star))
    rows = (
        Row(
            "smaller v* of two neighbouring orders / its upper bound",
            max(np.minimum(found[1:], found[:-1]) / limits[1:]),
            1,
        ),
        Row("round-off where the sum fails / its bound", max(distance(given, k, v) for k, v in enumerate(found)), 1),
        Row(f"S_20 is within {TOLERANCE:g} of eps up to v*", found[20]),
        Row(f"S_{order} is within {TOLERANCE:g} of eps up to v*", found[order]),
        Row(f"S_{best}, the best sum up to order {order}: up to v*", found[best]),
        Row("radius of convergence R of the series", radius),
        Row(f"k (1 - v*/R) at k = {order}", order * (1 - found[order] / radius)),
    )
    summary = (
        "The series is accurate up to about v* = 0.8; near v* = 1 it fails at every order. No sum reaches the "
        "radius of convergence R, which the limit approaches only like 1/k. More digits do not help: sums in double"
        " precision fail at the same v* as exact sums. S_k is the sum of the terms up to v*^k."
    )

    def draw(figure: Figure) -> None:
        axes = figure.subplots()
        k = np.arange(order + 1)
        axes.plot(k, found, "o", color=BLUE, markersize=3, label=r"$v_\ast$ from which $S_k$ is off by $10^{-3}$")
        axes.plot(
            k,
            np.where(np.isfinite(limits), limits, np.nan),
            "_",
            color=VERMILION,
            label="upper bound for the smaller of $k-1$ and $k$",
        )
        axes.axhline(radius, color="black", linewidth=0.8, label="radius of convergence $R$")
        axes.set(xlabel="order $k$", ylabel=V_STAR, ylim=(0, 1.2))
        axes.legend(loc="lower right")

    return Finding(rows, summary, draw)
