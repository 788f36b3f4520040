"""Integrators of simulation programs as maps of a time step, and the collisions that they compute.

Semi-implicit Euler's method is the map

    x <- x + h v,    v <- v + h a(x, v),    a = (load - F)/m.

Velocity Verlet, which carries its force from one step to the next, and the leapfrog are the same map if the damping
uses the velocity v between two steps: LAMMPS, LIGGGHTS, MercuryDPM and YADE compute forces after half of the kick. So
the damping lags behind by half a step, and the error of eps is of first order in h.

The phase, the place in a step at which contact begins, is random: a program's eps has a range and a mean.
"""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from viscopade.arrays.checked import FloatArray

Acceleration = Callable[[FloatArray, FloatArray], FloatArray]
State = tuple[FloatArray, FloatArray, FloatArray]

_SECANTS, _SOLVED = 60, 4e-15  # largest number of secants that solve an implicit step, and its error
_NEARBY = 1e-6  # length of the first secant
_TURNS = 3  # a body that turns more often stays; one turn back before x = 0 may be due to the scheme's errors
_CREEP = 1e-10  # share of the speed of impact: a body that is slower in two steps stays
_PATH = np.linspace(0, 1, 65)


@dataclass(frozen=True)
class Scheme:
    """An integrator of programs.

    Attributes
    ----------
    name : str
    step : callable
        Function of x, v, the time step h and the acceleration, which is a function of x and v. It returns x and v after
        the step, and the newest acceleration.
    lead : float
        Number of steps by which the velocity is ahead of the position in free flight: 1/2 for the velocity of the next
        drift.
    """

    name: str
    step: Callable[[FloatArray, FloatArray, FloatArray, Acceleration], State]
    lead: float


def _drift_then_kick(x: FloatArray, v: FloatArray, h: FloatArray, acceleration: Acceleration) -> State:
    x = x + h * v
    newest = acceleration(x, v)
    return x, v + h * newest, newest


def _forward(x: FloatArray, v: FloatArray, h: FloatArray, acceleration: Acceleration) -> State:
    newest = acceleration(x, v)
    return x + h * v, v + h * newest, newest


def _taylor(x: FloatArray, v: FloatArray, h: FloatArray, acceleration: Acceleration) -> State:
    newest = acceleration(x, v)
    return x + h * v + h * h / 2 * newest, v + h * newest, newest


def _implicit(x: FloatArray, v: FloatArray, h: FloatArray, acceleration: Acceleration) -> State:
    """Solve w = v + h acceleration(x + h w, w) by secants from its right, which converge for convex forces."""

    def missing(w: FloatArray) -> FloatArray:
        return w - v - h * acceleration(x + h * w, w)

    free = v + h * acceleration(np.minimum(x, 0), v)  # the load alone
    was, w = free + _NEARBY * (1 + np.abs(v)), free
    before, now = missing(was), missing(w)
    for _ in range(_SECANTS):
        if np.all(np.abs(now) < _SOLVED * (1 + np.abs(v))):
            break
        slope = np.divide(now - before, w - was, out=np.ones_like(w), where=w != was)
        was, before, w = w, now, w - now / np.maximum(slope, 1)
        now = missing(w)
    w = np.where(x > 0, w, free)
    return x + h * w, w, acceleration(x + h * w, w)


def _runge_kutta(x: FloatArray, v: FloatArray, h: FloatArray, acceleration: Acceleration) -> State:
    after_x, after_v, slope_x, slope_v = x, v, v, acceleration(x, v)
    for part, weight in ((0.5, 1), (0.5, 2), (1, 2), (0, 1)):
        after_x, after_v = after_x + weight * h / 6 * slope_x, after_v + weight * h / 6 * slope_v
        at, speed = x + part * h * slope_x, v + part * h * slope_v
        slope_x, slope_v = speed, acceleration(at, speed)
    return after_x, after_v, slope_v


SEMI_IMPLICIT = Scheme(
    "semi-implicit Euler, or velocity Verlet whose damping lags by half a step", _drift_then_kick, 0.5
)
"""x <- x + h v, v <- v + h a(x, v), from either half on. Velocity Verlet, which carries its force from one step to the
next, and the leapfrog are the same map wherever the damping takes the velocity between two steps."""
FORWARD = Scheme("forward Euler", _forward, 0.5)
"""The force, the position and the velocity all use the old position and velocity."""
TAYLOR = Scheme("Taylor's method of second order in the position", _taylor, 0.0)
"""The force of the old position and velocity: x <- x + h v + h^2 a/2, v <- v + h a."""
IMPLICIT = Scheme("implicit Euler", _implicit, -0.5)
"""The force at the end of the step, in steps that begin in contact."""
RUNGE_KUTTA = Scheme("Runge-Kutta of fourth order", _runge_kutta, 0.0)
"""The classical method, whose steps ignore the beginning and the end of contact."""

SCHEMES = {
    "semi-implicit-euler": SEMI_IMPLICIT,
    "velocity-verlet": SEMI_IMPLICIT,
    "forward-euler": FORWARD,
    "taylor": TAYLOR,
    "implicit-euler": IMPLICIT,
    "runge-kutta": RUNGE_KUTTA,
}


class Rebounds(NamedTuple):
    """Collisions in time steps, one for each step and phase.

    Attributes
    ----------
    epsilon : array
        0 for bodies that do not part.
    depth : array
        Largest compression at the end of a step.
    duration : array
        Time from first contact to the end of the step in which the force vanishes; infinite for bodies that do not
        part.
    """

    epsilon: FloatArray
    depth: FloatArray
    duration: FloatArray


def _flies(acceleration: Acceleration, g: float, x: FloatArray, v: FloatArray) -> NDArray[np.bool_]:
    """Return whether a force that has vanished is 0 at all places of `_PATH` on the way to x = 0."""
    places = np.multiply.outer(_PATH, x)
    squares = v * v - 2 * g * (x - places)
    free = (squares > 0) & (acceleration(places, -np.sqrt(np.maximum(squares, 0))) == g)
    return np.asarray((x <= 0) | free.all(0))


def rebounds(
    scheme: Scheme, acceleration: Acceleration, g: float, speed: float, h: FloatArray, phase: FloatArray, longest: float
) -> Rebounds:
    """Return the collisions of a map; arrays have one shape.

    Parameters
    ----------
    scheme : Scheme
    acceleration : callable
        A function of x and v; it is g for x <= 0.
    g : float
        Acceleration in free flight, towards the contact.
    speed : float
        Speed of impact > 0.
    h, phase : array
        Time steps, and the part of the first step at which contact begins, from 0 to 1.
    longest : float
        Time after which bodies that still touch are said not to part, like those that turn back twice, or creep.
    """
    before = phase * h if g <= 0 else np.minimum(phase * h, speed / g)  # the time in free flight, before first contact
    x, v = -before * speed + g / 2 * before**2, speed - g * before + scheme.lead * g * h
    epsilon, deepest, depth = np.zeros_like(h), np.zeros_like(h), np.zeros_like(h)
    duration, touches = np.full_like(h, math.inf), np.ones(h.shape, bool)
    turns, stays = np.zeros(h.shape, int), np.zeros(h.shape, bool)
    with np.errstate(over="ignore", invalid="ignore"):  # steps that are far too long
        for i in range(1, math.ceil(longest / float(h.min())) + 3):
            was = v
            x, v, newest = scheme.step(x, v, h, acceleration)
            turns += was * v < 0
            stays |= (turns > _TURNS) | (np.maximum(np.abs(was), np.abs(v)) < _CREEP * speed)
            deepest = np.maximum(deepest, x)
            left = touches & ~stays & (newest == g) & (v < 0)
            if left.any():
                left &= _flies(acceleration, g, x, v)
                at = v - scheme.lead * g * h  # at the end of this step; between it and x = 0 the flight is free
                epsilon = np.where(left, np.sqrt(np.maximum(at * at - 2 * g * x, 0)) / speed, epsilon)
                depth, duration = np.where(left, deepest, depth), np.where(left, i * h - before, duration)
                touches &= ~left
            if not (touches & ~stays).any():
                break
    return Rebounds(epsilon, np.where(touches, deepest, depth), duration)
