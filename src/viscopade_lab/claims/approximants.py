"""The exact eps(v*) in double precision, and the errors of truncated series and approximants."""

from __future__ import annotations

import math
from collections.abc import Callable
from fractions import Fraction
from functools import lru_cache
from typing import NamedTuple

import numpy as np
from flint import arb
from numpy.typing import NDArray

from viscopade.arithmetic.balls import working
from viscopade.arrays import double
from viscopade.collision import exact
from viscopade.kernels import quotient
from viscopade.kernels.certificate import prove
from viscopade.progress import track
from viscopade.theory.pade import Pade, horner, pade
from viscopade.theory.series import Series, series

Array = NDArray[np.float64]

# Points are 0.5 % apart. An error's maximum between two of them exceeds theirs by some 1e-5 of itself, as it is flat
# there and changes over factors of v*: two digits do not show it.
POINTS_PER_DECADE = 500
# v* from where 1 - eps is 1e-4 to where eps is 1e-10: a decade more on both sides than the paper's logarithmic figure.
FIRST, LAST = 0.01, 1000.0
# Ends of the ranges of the largest errors; they are on the grid, because most errors are largest there.
RANGES = (1.0, 2.0, 5.0, 10.0, 100.0)
SUITED_UP_TO = 10**0.3  # what the paper gives [2/5]
LARGEST_M = 25  # the paper looked at [m/m+3] up to [25/28]
PADE_DIGITS = 20  # more than a double holds
# The series that truncations are taken from, and that the singularity is found with (its order gives R to 5 digits).
# 60 digits: the smallest error that is shown is 9e-41, of the sum to h_120 at v* = 0.5.
ORDER, SERIES_DIGITS = 120, 60


class ExactGrid(NamedTuple):
    """The exact function on a grid of equal steps in ln v*, and at `RANGES` and `SUITED_UP_TO`."""

    v_star: Array
    epsilon: Array
    loss: Array
    """1 - eps, with its own relative accuracy."""


@lru_cache(maxsize=1)
def curve() -> ExactGrid:
    """Return eps and 1 - eps from v* = 0.01 to 1000, at 500 points a decade and at the ends of ranges."""
    decades = round(math.log10(LAST / FIRST))
    steps = np.arange(decades * POINTS_PER_DECADE + 1) / POINTS_PER_DECADE  # log10(v*/FIRST)
    special = (*RANGES, SUITED_UP_TO)
    # Points of the grid that are a special one but for rounding (1e-9 is far more than rounding and far less than the
    # grid's 0.5 %) are left out, so that no v* stands twice.
    v = np.sort([*special, *(x for x in FIRST * 10**steps if min(abs(x / y - 1) for y in special) > 1e-9)])
    return ExactGrid(v, double.epsilon(v), double.one_minus_epsilon(v))


class ApproximantErrors(NamedTuple):
    """An approximant against the exact function on the grid of `curve`."""

    epsilon: Array
    """|[m/n]/eps - 1|."""
    loss: Array
    """|(1 - [m/n])/(1 - eps) - 1|."""
    absolute: Array
    """|[m/n] - eps|."""


@lru_cache(maxsize=64)
def approximant(m: int, n: int) -> Pade:
    """Return [m/n], proven to 20 digits."""
    return pade(m, n, PADE_DIGITS)


@lru_cache(maxsize=64)
def errors(m: int, n: int) -> ApproximantErrors:
    """Return the errors of [m/n]."""
    v, epsilon, loss = curve()
    approximation, loss_of_it = values(approximant(m, n), v)
    return ApproximantErrors(abs(approximation / epsilon - 1), abs(loss_of_it / loss - 1), abs(loss_of_it - loss))


def values(p: Pade, v_star: Array) -> tuple[Array, Array]:
    """Return [m/n] = a/b and 1 - [m/n] = (b - a)/b at each v*; the difference b - a loses no digits at small v*."""
    # 256 bits, 77 digits: the balls a_i and b_i have about 20 digits, whose difference is not rounded noticeably.
    with working(256):
        difference = [b - (p.a[i] if i < len(p.a) else 0) for i, b in enumerate(p.b)]
    a, b, d = (np.array([float(c.mid()) for c in side]) for side in (p.a, p.b, difference))
    bottom = horner(b, v_star)
    return horner(a, v_star) / bottom, horner(d, v_star) / bottom


def error_at(m: int, v_star: int) -> float:
    """Return [m/m+3]/eps - 1 at one v*, from enclosures that also hold errors far below double precision."""
    return float(enclosed_error(m, v_star).mid())


def enclosed_error(m: int, v_star: int) -> arb:
    """Enclose [m/m+3]/eps - 1 at one v*."""
    # 40 digits: errors down to 1e-30 keep ten of them. 256 bits, 77 digits, so that Horner's sums lose nothing.
    p, truth = pade(m, m + 3, 2 * PADE_DIGITS), exact.collision(v_star, 2 * PADE_DIGITS).epsilon
    with working(256):
        a, b = (sum((c * arb(v_star) ** i for i, c in enumerate(side)), arb(0)) for side in (p.a, p.b))
        return a / b / truth - 1


def proven_error(m: int, up_to: int) -> float:
    """Return a proven bound of |[m/m+3]/eps - 1| on 0 <= v* <= up_to."""
    p = pade(m, m + 3, 2 * PADE_DIGITS)  # 40 digits: the enclosures of the coefficients add nothing to the bound
    # `prove` returns a certificate; its `bound` holds on the whole interval, not only at sampled points.
    return float(prove(quotient.quotient_formula(p.a, p.b), Fraction(0), Fraction(up_to), "relative").bound)


def largest(error: Array, up_to: float) -> float:
    """Return the largest of the sampled errors on (0, up_to]."""
    return float(error[curve().v_star <= up_to].max())


def first_above(error: Array, tolerance: float) -> float | None:
    """Return the first v* where an error exceeds `tolerance`, None if it never does.

    Between the points of the grid it is interpolated, logarithmically.
    """
    above = np.flatnonzero(error > tolerance)
    if not len(above):
        return None
    # The last point below and the first above; only the latter if it is the first of the grid.
    around = slice(max(above[0] - 1, 0), above[0] + 1)
    return float(np.exp(np.interp(np.log(tolerance), np.log(error[around]), np.log(curve().v_star[around]))))


def error_near(error: Array, v_star: float) -> float:
    """Return an error at the grid's point nearest to v*."""
    return float(error[np.argmin(abs(curve().v_star - v_star))])


def family() -> dict[int, Pade]:
    """Return [m/m+3] for m = 0 … 25, by m; with a progress bar, as it takes seconds."""
    return {m: approximant(m, m + 3) for m in track(range(LARGEST_M + 1), "Padé approximants")}


# --- the truncated series ---------------------------------------------------------------------------------------------


@lru_cache(maxsize=1)
def coefficients() -> Series:
    """Return h_0 … h_120."""
    return series(ORDER, SERIES_DIGITS)


def truncated(order: int, v_star: float) -> float:
    """Return the sum h_k v*^k from h_0 = 1 up to k = order."""
    h = coefficients().floats()[: order + 1]
    return float(horner(h, np.array(float(v_star))))


def departure(order: int, tolerance: float) -> float:
    """Return the first v* where the series up to h_order v*^order is off by `tolerance`, relatively, to 12 digits."""
    v, epsilon, _ = curve()
    # The grid shows between which points; there the error is followed to the tolerance.
    off = abs(horner(coefficients().floats()[: order + 1], v) / epsilon - 1)
    beyond = int(np.argmax(off > tolerance))
    return bisect(
        lambda x: abs(truncated(order, x) / double.epsilon(x) - 1) - tolerance, float(v[beyond - 1]), float(v[beyond])
    )


def bisect(function: Callable[[float], float], low: float, high: float) -> float:
    """Return where a function changes its sign between `low` and `high`, to the last digits of a double."""
    rising = function(high) > 0
    for _ in range(60):  # halvings: 2^-60 of the first interval is below the 53 bits of a double
        middle = (low + high) / 2
        low, high = (low, middle) if (function(middle) > 0) == rising else (middle, high)
    return (low + high) / 2


# --- the slope --------------------------------------------------------------------------------------------------------

SLOPE_STEP = 1e-8  # of v*, relative: its square is the error, 1e-16, the rounding of the double that is returned
SLOPE_DIGITS = 30  # of eps: the difference quotient loses 8 of them, 22 remain


@lru_cache(maxsize=64)
def slope(v_star: float) -> float:
    """Return d ln eps/d ln v*, from two proven values close by; the error is about the step's square, 10^-16."""
    low, high = (exact.collision(v_star * (1 + sign * SLOPE_STEP), SLOPE_DIGITS).balls() for sign in (-1, 1))
    with working(200):  # bits, 60 digits: all of the enclosures' 30
        ratio: arb = (high["epsilon"] / low["epsilon"]).log() / (high["v_star"] / low["v_star"]).log()
        return float(ratio.mid())
