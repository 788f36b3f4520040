"""One collision in time steps: the eps that a program's integrator computes, not that of the equation of motion.

Everything is in the units of `viscopade.theory.law`: x'' = -F, F = x^a + kappa x^b x' while x > 0. A law with the end
"force" has its attraction cut off, F = max(F, 0). With the end "return" F may pull, until x <= 0.

Semi-implicit Euler's method is the map

    x <- x + h u,    u <- u - h F(x, u).

Velocity Verlet and the leapfrog are the same map wherever the damping takes the velocity u between two steps: LAMMPS,
LIGGGHTS, MercuryDPM and YADE compute forces after half of the kick. Before and after contact both have the same
velocities. So the damping lags behind by half a step, and the error of eps is of first order in h.

Where in a step contact begins, the phase, is chance: a program's eps is a range, with a mean.
"""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass
from functools import cache

import numpy as np
from numpy.typing import ArrayLike, NDArray

from viscopade.theory.law import Law

Array = NDArray[np.float64]
Force = Callable[[Array, Array], Array]

PHASES = np.arange(0.5, 64) / 64
"""Where in a step contact begins: the midpoints of 64 parts of it."""
PATIENCE = 60  # undamped contact times, after which bodies that still touch do not part
_SECANTS, _SOLVED = 40, 4e-15  # to solve a step, at most, and up to which error
_NEARBY = 1e-6  # of the first secant
_STRETCH = 16  # steps between two looks at whether all bodies have parted
_LOOKED_AT = 64  # time steps
_TRIED, _CLOSE = 17, 1e-5  # dampings to look at, and how close two of them come
_REACH, _FARTHEST = 8, (1000, 8)  # how far: by e^(8 step), or if that is not enough by these factors
_SMALL = 4000  # steps in a contact whose error is in proportion to the step


@dataclass(frozen=True)
class Scheme:
    """An integrator of programs.

    Attributes
    ----------
    name : str
        What it is called.
    step : callable
        From x, u, h and the force, a function of x and u, to x and u after a step.
    """

    name: str
    step: Callable[[Array, Array, Array, Force], tuple[Array, Array]]


def _drift_then_kick(x: Array, u: Array, h: Array, force: Force) -> tuple[Array, Array]:
    x = x + h * u
    return x, u - h * force(x, u)


LAGGED = Scheme("semi-implicit Euler, or velocity Verlet whose damping lags by half a step", _drift_then_kick)
"""Semi-implicit Euler; velocity Verlet and leapfrog with the damping of the velocity between two steps."""


def _implicit(x: Array, u: Array, h: Array, force: Force) -> tuple[Array, Array]:
    """Solve w = u - h F(x + h w, w), which is convex in w, by secants from its right."""

    def missing(w: Array) -> Array:
        return w - u + h * force(x + h * w, w)

    was, w = u + _NEARBY * (1 + np.abs(u)), u
    before, now = missing(was), missing(w)
    for _ in range(_SECANTS):
        if np.all(np.abs(now) < _SOLVED):
            break
        slope = np.divide(now - before, w - was, out=np.ones_like(w), where=w != was)
        was, before, w = w, now, w - now / np.maximum(slope, 1)
        now = missing(w)
    w = np.where(x > 0, w, u)
    return x + h * w, w


IMPLICIT = Scheme("implicit Euler", _implicit)
"""Implicit Euler's method, in steps that begin in contact: laws with a, b = 1, 1 or 1, 0 and the end "force" only."""


def _runge_kutta(x: Array, u: Array, h: Array, force: Force) -> tuple[Array, Array]:
    after_x, after_u, slope_x, slope_u = x, u, u, -force(x, u)
    for part, weight in ((0.5, 1), (0.5, 2), (1, 2), (0, 1)):
        after_x, after_u = after_x + weight * h / 6 * slope_x, after_u + weight * h / 6 * slope_u
        at, speed = x + part * h * slope_x, u + part * h * slope_u
        slope_x, slope_u = speed, -force(at, speed)
    return after_x, after_u


RUNGE_KUTTA = Scheme("Runge-Kutta of fourth order", _runge_kutta)
"""The classical method, with steps that know nothing of where contact begins or ends."""


@dataclass(frozen=True)
class Stepped:
    """Eps at a time step, over the phases: NaN if bodies do not part.

    Attributes
    ----------
    mean, least, largest : float
        Of the eps over the phases.
    """

    mean: float
    least: float
    largest: float

    def error(self, epsilon: float) -> float:
        """Return the largest relative error against an eps; infinite if bodies do not part."""
        if math.isnan(self.mean):
            return math.inf
        return max(abs(self.least / epsilon - 1), abs(self.largest / epsilon - 1))


def contact_time(law: Law) -> float:
    """Return the duration of the undamped contact, tau_c at kappa = 0: pi for the linear spring, 3.218 for Hertz'."""
    power = float(law.elastic) + 1
    gammas = math.gamma(1 + 1 / power) / math.gamma(0.5 + 1 / power)
    return 2 * math.sqrt(math.pi) * float((power / 2) ** (1 / power)) * gammas


def force_of(law: Law, kappa: ArrayLike) -> Force:
    """Return the force of a law with its end, of x and u."""
    a, b, damping = float(law.elastic), float(law.damping), np.asarray(kappa, float)

    def force(x: Array, u: Array) -> Array:
        depth = np.maximum(x, 0)
        value = depth**a + damping * depth**b * u
        return np.where(x > 0, np.maximum(value, 0) if law.end == "force" else value, 0)

    return force


def rebound(force: Force, step: ArrayLike, phase: ArrayLike, *, longest: float, scheme: Scheme = LAGGED) -> Array:
    """Return eps for every step and phase, NaN where the bodies still touch after the time `longest`.

    Parameters
    ----------
    force : callable
        The acceleration -x'' as a function of x and u, 0 for x <= 0.
    step, phase : array_like
        Time steps h > 0, and where in the first step contact begins, from 0 to 1; shapes that fit together.
    longest : float
        A time.
    scheme : Scheme
    """
    h, begin = np.broadcast_arrays(np.asarray(step, float), np.asarray(phase, float))
    x, u = -begin * h, np.ones_like(h)
    with np.errstate(over="ignore", invalid="ignore"):  # steps that are far too long
        for i in range(math.ceil(longest / float(h.min())) + 2):
            x, u = scheme.step(x, u, h, force)
            if i % _STRETCH == 0 and not np.any((x > 0) | (u > 0)):
                break
    return np.where((x > 0) | ~(u <= 0), math.nan, -u)


def epsilons(law: Law, kappa: ArrayLike, step: ArrayLike, scheme: Scheme = LAGGED) -> Array:
    """Return eps over the `PHASES`, the last axis; kappa and step are numbers or arrays of one shape."""
    damping, h = np.asarray(kappa, float)[..., None], np.asarray(step, float)[..., None]
    longest = PATIENCE * contact_time(law)
    return rebound(force_of(law, damping), h + 0 * damping, PHASES, longest=longest, scheme=scheme)


@cache
def stepped(law: Law, kappa: float, step: float, scheme: Scheme = LAGGED) -> Stepped:
    """Return eps at a time step.

    Parameters
    ----------
    law : Law
    kappa : float
        Damping of the scaled equation.
    step : float
        Time step, in units of `contact_time`.
    scheme : Scheme
    """
    found = epsilons(law, kappa, step * contact_time(law), scheme)
    return Stepped(float(found.mean()), float(found.min()), float(found.max()))


@cache
def step_slope(law: Law, kappa: float, scheme: Scheme = LAGGED) -> float:
    """Return d eps/d(step) at step 0, step in units of `contact_time`: the mean eps is eps + slope step, about."""
    coarse, fine = (stepped(law, kappa, 1 / n, scheme).mean for n in (_SMALL // 4, _SMALL // 2))
    return (coarse - fine) / (4 / _SMALL - 2 / _SMALL)


@cache
def largest_step(law: Law, kappa: float, error: float, epsilon: float, scheme: Scheme = LAGGED) -> float:
    """Return the largest time step, in units of `contact_time`, up to which the error of eps is at most `error`.

    The error is the largest relative one over the phases, looked at for steps in a geometric sequence. Below the finest
    of them it is taken to be in proportion to the step.
    """
    steps = np.geomspace(0.5, 4 / _SMALL, _LOOKED_AT)
    found = epsilons(law, np.full(_LOOKED_AT, kappa), steps * contact_time(law), scheme)
    errors = np.nan_to_num(np.abs(found / epsilon - 1).max(-1), nan=math.inf)
    too_large = np.flatnonzero(errors > error)
    if not too_large.size:
        return float(steps[0])
    last = too_large[-1]
    return float(steps[last + 1]) if last + 1 < len(steps) else float(steps[-1] * error / errors[-1])


@cache
def compensated(law: Law, epsilon: float, step: float, near: float, scheme: Scheme = LAGGED) -> float:
    """Return the kappa whose mean eps at a time step is `epsilon`, among kappa from `near`/1000 to 8 `near`.

    Raises
    ------
    ValueError
        If none of them has it; the message has the smallest eps that they have.
    """
    if near == 0:
        return 0.0  # without damping no step changes eps
    reach = math.exp(_REACH * step)
    try:
        return _between(law, epsilon, step, (near / reach, near * reach), scheme)
    except ValueError:
        return _between(law, epsilon, step, (near / _FARTHEST[0], near * _FARTHEST[1]), scheme)


def _between(law: Law, epsilon: float, step: float, dampings: tuple[float, float], scheme: Scheme) -> float:
    """Return the kappa whose mean eps at a time step is `epsilon`, among those from a least to a largest one."""
    low, high = dampings
    while high > low * (1 + _CLOSE):
        kappas = np.geomspace(low, high, _TRIED)
        found = epsilons(law, kappas, np.full(_TRIED, step * contact_time(law)), scheme).mean(-1)
        below = np.flatnonzero(found <= epsilon)
        if not below.size or not below[0]:
            raise ValueError(
                f"epsilon is {epsilon:g}: with a time step of {step:g} contact times accepted is "
                f"{np.nanmin(found):.4g} to {np.nanmax(found):.4g}"
            )
        low, high = kappas[below[0] - 1], kappas[below[0]]
    return float((low + high) / 2)
