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
    from matplotlib.axes import Axes

TOLERANCE = 1e-3
"""Largest |S_k/eps - 1|: a choice, three digits of eps."""
SERIES_DIGITS = 40
"""Of the h_k as balls: 24 more than a double has, so that their radius does not show (25 or 80 give the same)."""
BITS = 320
"""Of ball arithmetic. A sum may lose 16 digits next to its zeros, 53 bits; 96 to 640 bits give the same (measured)."""
GRID: FloatArray = np.arange(64.0, 5120.0) / 4096
"""v* at which each sum is tested, from 1/64 to 1.25; between two of them `bisected` finds the first failure.

Every sum fails inside: S_0 = 1 does at 0.029, and the best sum at 1.03. With 256 to 16384 points to a unit instead of
4096 the failures are the same (measured for 80 orders).
"""


class Coefficients(NamedTuple):
    """h_0, h_1, … up to an order: as balls that enclose them, and as the doubles nearest to the middles."""

    balls: tuple[arb, ...]
    h: FloatArray


def coefficients(order: int) -> Coefficients:
    """Return the coefficients h_0 … h_order of eps = sum h_k v*^k."""
    balls = series(order, SERIES_DIGITS).h
    return Coefficients(balls, np.array([float(exact_middle(h_k)) for h_k in balls]))


def bisected(beyond: Callable[[FloatArray], Any], low: FloatArray, high: FloatArray) -> FloatArray:
    """Return for every order k the v* at which a condition becomes true, by bisection.

    `low` and `high` have a v* for each k, the condition being false at the first and true at the second. `beyond` takes
    a column of v*, row k for order k, and returns for each whether the condition is true.
    """
    low, high = low[:, None], high[:, None]
    # Intervals of `GRID`, 2^-12 long, become 2^-68, below the distance 2^-58 of doubles at the least v*, 0.029: low and
    # high end as neighbours. The widest interval, of `failure_bounds`, is 2 long; 2^-55 is far below the digits shown.
    for _ in range(56):
        middle = (low + high) / 2
        is_beyond = beyond(middle)
        low, high = np.where(is_beyond, low, middle), np.where(is_beyond, middle, high)
    v_star: FloatArray = high[:, 0]
    return v_star


def first_failures(series_h: Coefficients) -> FloatArray:
    """Return for every order k the first v* at which S_k, summed in double precision, is off by `TOLERANCE`.

    `series_h` are the coefficients h_k; S_k = h_0 + … + h_k v*^k.
    """
    # Row k of the matrix has h_0 … h_k, then zeros: the coefficients of S_k.
    order_count = len(series_h.h)
    h = np.tril(np.ones((order_count, order_count))) * series_h.h

    def is_off(v: FloatArray) -> Any:
        # |S_k/eps - 1| > TOLERANCE; `horner` takes coefficients along the first axis, for every k (second) at once.
        return abs(horner(h.T[:, :, None], v) / double.epsilon(v) - 1) > TOLERANCE

    # The first point of the grid at which S_k is off; S_k failed between it and the point before.
    first = np.argmax(is_off(np.broadcast_to(GRID, (order_count, len(GRID)))), axis=1)
    return bisected(is_off, GRID[first - 1], GRID[first])


def distance(series_h: Coefficients, k: int, v_star: float) -> float:
    """Return the distance of the exact |S_k/eps - 1| from `TOLERANCE`, divided by the bound of round-off.

    `series_h` are the coefficients h_k, and `v_star` is where S_k in double precision reaches the tolerance. A result
    up to 1 says that round-off explains the distance.
    """
    with working(BITS):
        v, polynomial = arb(v_star), arb_poly(list(series_h.balls[: k + 1]))
        # u is the unit roundoff of double; 1 ulp is at most 2 u of the value.
        eps, u = truth.exact_portions(v).epsilon, arb(2) ** -53
        # Horner's rule with 2 k operations, and the rounding of the h_k: at most (2 k + 1) u (1 + 2 k u) sum |h_i| v^i
        # (Higham, Accuracy and Stability of Numerical Algorithms, section 5.1).
        absolute_sum = arb_poly([abs(h_i) for h_i in series_h.balls[: k + 1]])(v)
        noise = (2 * k + 1) * u * (1 + 2 * k * u) * absolute_sum / eps
        # eps in double precision is off by ULP ulp (sampled); 3 u: the quotient, its difference from 1, TOLERANCE.
        noise += (2 * double.ULP["epsilon"] + 3) * u
        # d(S_k/eps)/dv = S_k'/eps - (S_k/eps) (d ln eps/d ln v)/v; `double.slope` is the last factor.
        s_k = polynomial(v)
        slope = polynomial.derivative()(v) / eps - s_k / eps * arb(float(double.slope(v_star))) / v
        # Bisection ends with neighbouring doubles: v* is off by an ulp, 2 u v; 4 u v leave another one.
        return float(abs(abs(s_k / eps - 1) - TOLERANCE) / (noise + 4 * u * v * abs(slope)))


def failure_bounds(series_h: Coefficients) -> FloatArray:
    """Return for every order k an upper bound of the smaller of the first failures of S_(k-1) and S_k, in v*.

    It is the v* at which |h_k| v*^k = 2 TOLERANCE eps (see the head of this file); infinite where h_k = 0 or k = 0.
    """
    h, k = abs(series_h.h[:, None]), np.arange(len(series_h.h))[:, None]
    # The bounds lie between the grid's first point and 2, twice the radius of convergence 1.05 or nearly so.
    low, high = np.full(len(h), GRID[0]), np.full(len(h), 2.0)
    v_star = bisected(lambda v: h * v**k > 2 * TOLERANCE * double.epsilon(v), low, high)
    return np.where((h[:, 0] > 0) & (k[:, 0] > 0), v_star, np.inf)


def measure(thorough: bool) -> Finding:
    """Return the rows, words and picture of this case; `thorough` goes to order 160 instead of 80.

    Both orders are choices: the failures approach the radius of convergence like 1/k, so that more orders add little.
    """
    series_h = coefficients(160 if thorough else 80)
    return make_finding(series_h, first_failures(series_h))


def make_finding(series_h: Coefficients, failures: FloatArray) -> Finding:
    """Return the rows, words and picture of this case.

    `series_h` are the coefficients h_k, `failures` the first v* at which each S_k is off by `TOLERANCE`.
    """
    order, limits, best = len(failures) - 1, failure_bounds(series_h), int(np.argmax(failures))
    # Ten digits of the singularity of eps(v*) next to 0: the table shows four.
    radius = abs(complex(singularity.from_flow(10).v_star))
    # Rows with a 1 are a quotient and its bound; the others are only stated.
    rows = (
        Row(
            "smaller v* of two neighbouring orders / its upper bound",
            max(np.minimum(failures[1:], failures[:-1]) / limits[1:]),
            1,
        ),
        Row(
            "round-off where the sum fails / its bound",
            max(distance(series_h, k, v) for k, v in enumerate(failures)),
            1,
        ),
        # Order 20 is a choice; the benchmark times the same sum.
        Row(f"S_20 is within {TOLERANCE:g} of eps up to v*", failures[20]),
        Row(f"S_{order} is within {TOLERANCE:g} of eps up to v*", failures[order]),
        Row(f"S_{best}, the best sum up to order {order}: up to v*", failures[best]),
        Row("radius of convergence R of the series", radius),
        # It tends to a constant if failures approach R like 1/k.
        Row(f"k (1 - v*/R) at k = {order}", order * (1 - failures[order] / radius)),
    )
    summary = (
        "The series is accurate up to about v* = 0.8; near v* = 1 it fails at every order. No sum reaches the "
        "radius of convergence R, which the limit approaches only like 1/k. More digits do not help: sums in double"
        " precision fail at the same v* as exact sums. S_k is the sum of the terms up to v*^k."
    )

    def draw(axes: Axes) -> None:
        """Draw the failures and their bounds over the order k, with the radius of convergence as a line."""
        k = np.arange(order + 1)
        axes.plot(k, failures, "o", color=BLUE, markersize=3, label="$v_*$ from which $S_k$ is off by $10^{-3}$")
        axes.plot(
            k,
            np.where(np.isfinite(limits), limits, np.nan),
            "_",
            color=VERMILION,
            label="upper bound for the smaller of $k-1$ and $k$",
        )
        axes.axhline(radius, color="black", linewidth=0.8, label="radius of convergence $R$")
        # Failures and bounds lie between 0.03 and R = 1.05; the rest is room above.
        axes.set(xlabel="order $k$", ylabel=V_STAR, ylim=(0, 1.2))
        axes.legend(loc="lower right")

    return Finding(rows, summary, draw)
