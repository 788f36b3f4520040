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

POINTS_PER_DECADE = 500
FIRST, LAST = 0.01, 1000.0
# Ends of the ranges of the largest errors; they are on the grid, because most errors are largest there.
RANGES = (1.0, 2.0, 5.0, 10.0, 100.0)
SUITED_UP_TO = 10**0.3  # what the paper gives [2/5]
LARGEST_M = 25  # the paper looked at [m/m+3] up to [25/28]
PADE_DIGITS = 20
# The series that truncations are taken from, and that the singularity is found with.
ORDER, SERIES_DIGITS = 120, 60


class ExactGrid(NamedTuple):
    """The exact function on a grid of equal steps in ln v*, and at `RANGES` and `SUITED_UP_TO`."""

    v_star: Array
    epsilon: Array
    loss: Array
    """1 - eps, with its own relative accuracy."""


@lru_cache(maxsize=1)
def curve() -> ExactGrid:
    """Return the exact function from v* = 0.01 to 1000."""
    decades = round(math.log10(LAST / FIRST))
    steps = np.arange(decades * POINTS_PER_DECADE + 1) / POINTS_PER_DECADE
    special = (*RANGES, SUITED_UP_TO)
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
    value, own_loss = values(approximant(m, n), v)
    return ApproximantErrors(abs(value / epsilon - 1), abs(own_loss / loss - 1), abs(own_loss - loss))


def values(p: Pade, v_star: Array) -> tuple[Array, Array]:
    """Return an approximant and 1 - it; the latter from b - a, so that it loses no digits at small v*."""
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
    p, truth = pade(m, m + 3, 2 * PADE_DIGITS), exact.collision(v_star, 2 * PADE_DIGITS).epsilon
    with working(256):
        a, b = (sum((c * arb(v_star) ** i for i, c in enumerate(side)), arb(0)) for side in (p.a, p.b))
        return a / b / truth - 1


def proven_error(m: int, up_to: int) -> float:
    """Return a proven bound of |[m/m+3]/eps - 1| on 0 <= v* <= up_to."""
    p = pade(m, m + 3, 2 * PADE_DIGITS)
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
    around = slice(max(above[0] - 1, 0), above[0] + 1)
    return float(np.exp(np.interp(np.log(tolerance), np.log(error[around]), np.log(curve().v_star[around]))))


def at(error: Array, v_star: float) -> float:
    """Return an error at the grid's point nearest to v*."""
    return float(error[np.argmin(abs(curve().v_star - v_star))])


def family() -> dict[int, Pade]:
    """Return [m/m+3] for m = 0 … 25."""
    return {m: approximant(m, m + 3) for m in track(range(LARGEST_M + 1), "Padé approximants")}


# --- the truncated series ---------------------------------------------------------------------------------------------


@lru_cache(maxsize=1)
def coefficients() -> Series:
    """Return h_0 … h_120."""
    return series(ORDER, SERIES_DIGITS)


def truncated(order: int, v_star: float) -> float:
    """Return 1 + sum h_k v*^k up to k = order."""
    h = coefficients().floats()[: order + 1]
    return float(horner(h, np.array(float(v_star))))


def departure(order: int, tolerance: float) -> float:
    """Return the first v* where the truncated series is off by `tolerance`, relatively, to 12 digits."""
    v, epsilon, _ = curve()
    off = abs(horner(coefficients().floats()[: order + 1], v) / epsilon - 1)
    beyond = int(np.argmax(off > tolerance))
    return bisect(
        lambda x: abs(truncated(order, x) / double.epsilon(x) - 1) - tolerance, float(v[beyond - 1]), float(v[beyond])
    )


def bisect(function: Callable[[float], float], low: float, high: float) -> float:
    """Return where a function changes its sign between `low` and `high`."""
    rising = function(high) > 0
    for _ in range(60):
        middle = (low + high) / 2
        low, high = (low, middle) if (function(middle) > 0) == rising else (middle, high)
    return (low + high) / 2


# --- the slope --------------------------------------------------------------------------------------------------------

SLOPE_STEP = 1e-8
SLOPE_DIGITS = 30


@lru_cache(maxsize=64)
def slope(v_star: float) -> float:
    """Return d ln eps/d ln v*, from two proven values close by; the error is about the step's square, 10^-16."""
    low, high = (exact.collision(v_star * (1 + sign * SLOPE_STEP), SLOPE_DIGITS).balls() for sign in (-1, 1))
    with working(200):
        ratio: arb = (high["epsilon"] / low["epsilon"]).log() / (high["v_star"] / low["v_star"]).log()
        return float(ratio.mid())
