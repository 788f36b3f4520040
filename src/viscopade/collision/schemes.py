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
Touching = NDArray[np.bool_]
State = tuple[FloatArray, FloatArray, FloatArray]

# Largest number of secants that solve an implicit step, and its error, about 20 roundings of a speed. Measured for
# three contacts with short and long steps: 3 secants, or an error of 4e-14, give the same eps to 12 digits. 60 are for
# steep forces, where a secant gains less.
_SECANTS, _SOLVED = 60, 4e-15
_NEARBY = 1e-6  # length of the first secant, over 1 + speed; measured: 1e-8 to 1e-4 give the same eps
_TURNS = 3  # a body that turns more often stays; one turn back before x = 0 may be due to the scheme's errors
_CREEP = 1e-10  # share of the speed of impact: a body that is slower in two steps stays; a choice
_FEWEST_STEPS = 100  # after which a body may be said to stay, however long a step is; a choice
_PATH = np.linspace(0, 1, 65)  # parts of the way back to x = 0 at which the force is looked at; 65 is a choice


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


def semi_implicit_euler(x: FloatArray, v: FloatArray, h: FloatArray, acceleration: Acceleration) -> State:
    """Return x, v and the acceleration after a drift and a kick: x <- x + h v, v <- v + h a(x, v)."""
    # The kick takes the new x, but the old v: damping lags behind.
    x = x + h * v
    newest = acceleration(x, v)
    return x, v + h * newest, newest


def forward_euler(x: FloatArray, v: FloatArray, h: FloatArray, acceleration: Acceleration) -> State:
    """Return x + h v, v + h a(x, v) and a(x, v): nothing uses the newest position or rate."""
    oldest = acceleration(x, v)
    return x + h * v, v + h * oldest, oldest


def explicit_taylor(x: FloatArray, v: FloatArray, h: FloatArray, acceleration: Acceleration) -> State:
    """Return x + h v + h^2 a/2, v + h a and a = a(x, v)."""
    oldest = acceleration(x, v)
    return x + h * v + h * h / 2 * oldest, v + h * oldest, oldest


def implicit_euler(x: FloatArray, v: FloatArray, h: FloatArray, acceleration: Acceleration) -> State:
    """Return x, v and the acceleration after a step of implicit Euler's method.

    The new rate w solves w = v + h a(x + h w, w).
    """

    def residual(w: FloatArray) -> tuple[FloatArray, FloatArray]:
        """Return w - v - h a(x + h w, w), which is 0 for the new rate, and that acceleration."""
        newest = acceleration(x + h * w, w)
        return w - v - h * newest, newest

    # Start from free flight, which only the load accelerates. A force that pushes makes w smaller, so the start lies to
    # the right of the solution, and secants of a convex residual converge from there without crossing it.
    free_flight = v + h * acceleration(np.minimum(x, 0), v)
    w_last, w = free_flight + _NEARBY * (1 + np.abs(v)), free_flight
    (residual_last, residual_w), (_, newest) = residual(np.stack([w_last, w]))
    for _ in range(_SECANTS):
        if np.all(np.abs(residual_w) < _SOLVED * (1 + np.abs(v))):
            break
        slope = np.divide(residual_w - residual_last, w - w_last, out=np.ones_like(w), where=w != w_last)
        w_last, residual_last = w, residual_w
        # d residual/dw = 1 - h (h da/dx + da/dv) is at least 1 where the force grows with x and v.
        w = w - residual_w / np.maximum(slope, 1)
        residual_w, newest = residual(w)

    # Bodies that did not touch before the step do not feel the force in it.
    if not (x > 0).all():
        w = np.where(x > 0, w, free_flight)
        newest = acceleration(x + h * w, w)
    return x + h * w, w, newest


def runge_kutta(x: FloatArray, v: FloatArray, h: FloatArray, acceleration: Acceleration) -> State:
    """Return x, v and the acceleration after a step of the classical Runge-Kutta method of fourth order.

    y + h (k_1 + 2 k_2 + 2 k_3 + k_4)/6 for y = (x, v), with k_1 at y, k_2 at y + h k_1/2, k_3 at y + h k_2/2 and k_4 at
    y + h k_3.
    """
    next_x, next_v, slope_x, slope_v = x, v, v, acceleration(x, v)
    # Each stage adds its slopes with its weight, in sixths; `part` is the place in the step of the next stage. The last
    # stage is that of the result, where the acceleration is the newest one.
    for weight, part in ((1, 0.5), (2, 0.5), (2, 1.0), (1, None)):
        next_x, next_v = next_x + weight * h / 6 * slope_x, next_v + weight * h / 6 * slope_v
        if part is not None:
            stage_x, stage_v = x + part * h * slope_x, v + part * h * slope_v
            slope_x, slope_v = stage_v, acceleration(stage_x, stage_v)
    return next_x, next_v, slope_v


SEMI_IMPLICIT = Scheme(
    "semi-implicit Euler, or velocity Verlet whose damping lags by half a step", semi_implicit_euler, 0.5
)
"""x <- x + h v, v <- v + h a(x, v), from either half on. Velocity Verlet, which carries its force from one step to the
next, and the leapfrog are the same map wherever the damping takes the velocity between two steps."""
FORWARD = Scheme("forward Euler", forward_euler, 0.5)
"""The force, the position and the velocity all use the old position and velocity."""
TAYLOR = Scheme("Taylor's method of second order in the position", explicit_taylor, 0.0)
"""The force of the old position and velocity: x <- x + h v + h^2 a/2, v <- v + h a."""
IMPLICIT = Scheme("implicit Euler", implicit_euler, -0.5)
"""The force at the end of the step, in steps that begin in contact."""
RUNGE_KUTTA = Scheme("Runge-Kutta of fourth order", runge_kutta, 0.0)
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
    """Return whether a force that has vanished at x, v is 0 at all places of `_PATH` on the way to x = 0.

    `g` is the acceleration in free flight.
    """
    # In free flight v^2/2 - g x is constant. The body must get there (squares > 0), and only the load may act on it.
    places = np.multiply.outer(_PATH, x)
    squares = v * v - 2 * g * (x - places)
    free = (squares > 0) & (acceleration(places, -np.sqrt(np.maximum(squares, 0))) == g)
    return np.asarray(free.all(0))


def rebounds(
    scheme: Scheme,
    contact_acceleration: Callable[[FloatArray, FloatArray, Touching], FloatArray],
    touches: Callable[[FloatArray, FloatArray, Touching], Touching],
    begin: float,
    g: float,
    speed: float,
    h: FloatArray,
    phase: FloatArray,
    longest: float,
) -> Rebounds:
    """Return the collisions of a map; arrays have one shape.

    Parameters
    ----------
    scheme : Scheme
    contact_acceleration, touches : callable
        Functions of x, v and whether the force acted after the step before: the acceleration, which is g where the
        force does not act, and whether it acts.
    begin : float
        Compression at which contact begins.
    g : float
        Acceleration in free flight, towards the contact.
    speed : float
        Speed of impact > 0.
    h, phase : array
        Time steps, and the part of the first step at which contact begins, from 0 to 1.
    longest : float
        Time after which bodies that still touch are said not to part, like those that turn back twice, or creep.
    """
    # Free flight before first contact lasts for `flight`. Under a load, a body has been at rest speed/g before, and its
    # speed at the start of the first step is less by g `flight`; a scheme's v may be ahead by `lead` steps.
    flight = phase * h if g <= 0 else np.minimum(phase * h, speed / g)
    x, v = begin - flight * speed + g / 2 * flight**2, speed - g * flight + scheme.lead * g * h
    # For each step and phase: the results, the largest x so far, whether the bodies are still together, how often they
    # have turned, whether they stay, and whether the force acted after the last step.
    epsilon, deepest, depth = np.zeros_like(h), np.zeros_like(h), np.zeros_like(h)
    duration, together = np.full_like(h, math.inf), np.ones(h.shape, bool)
    turns, stuck, formed = np.zeros(h.shape, int), np.zeros(h.shape, bool), np.zeros(h.shape, bool)

    def acceleration(x: FloatArray, v: FloatArray) -> FloatArray:
        """Return the acceleration where bodies are in contact as after the last step."""
        return contact_acceleration(x, v, formed)

    approach = bool(v.min() >= _CREEP * speed)
    with np.errstate(over="ignore", invalid="ignore"):  # steps that are far too long
        for i in range(1, math.ceil(longest / float(h.min())) + _FEWEST_STEPS):
            v_last = v
            x, v, newest = scheme.step(x, v, h, acceleration)
            deepest, formed = np.maximum(deepest, x), touches(x, v, formed)

            # While all bodies approach, none turns back, creeps or leaves.
            approached, approach = approach, bool(v.min() >= _CREEP * speed)
            if approached and approach:
                continue

            # Bodies that turn back and forth, or creep, stay together.
            turns += v_last * v < 0
            stuck |= (turns > _TURNS) | (np.maximum(np.abs(v_last), np.abs(v)) < _CREEP * speed)

            # Bodies have left where only the load acts, up to x = 0; where there is a neck, they leave when it breaks.
            # From there v^2/2 - g x is constant, and eps is the speed where contact begins; the velocity at the end of
            # the step lacks the lead of the scheme.
            at_end = v - scheme.lead * g * h
            left = together & ~stuck & (newest == g) & (at_end < 0)
            if left.any():
                left &= ~formed | ((x > 0) & _flies(acceleration, g, x, v))
                square = at_end * at_end - 2 * g * (x - begin)
                epsilon = np.where(left, np.sqrt(np.maximum(square, 0)) / speed, epsilon)
                depth, duration = np.where(left, deepest, depth), np.where(left, i * h - flight, duration)
                together &= ~left
            if not (together & ~stuck).any():
                break
    return Rebounds(epsilon, np.where(together, deepest, depth), duration)
