"""Free flight between bounces, vertical, in air or in vacuum: speeds from durations and heights.

In air a sphere has a constant drag coefficient: drag is proportional to the square of the speed. Let v_t be the
terminal speed. A body that starts upward at a speed u = s v_t rises to the height v_t^2/(2 g) ln(1 + s^2), comes back
at u/sqrt(1 + s^2), and flies for v_t/g (arctan s + arsinh s). Buoyancy reduces g. The mass of air that moves with the
sphere is neglected.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import NamedTuple

import numpy as np

from viscopade.arrays.checked import Accepted, FloatArray, number

STANDARD_GRAVITY = 9.80665
"""In m/s^2."""
DRAG_COEFFICIENT = 0.47
"""Drag coefficient of a smooth sphere at Reynolds numbers from about 1000 to 200000 (Newton's range)."""

_POSITIVE = Accepted("a finite number > 0", lambda x: 0 < x < math.inf)
_NON_NEGATIVE = Accepted("a finite number >= 0", lambda x: 0 <= x < math.inf)
_POSITIVE_OR_INFINITE = Accepted("a number > 0, or inf", lambda x: x > 0)
# Steps of Newton's method, at most. It needs up to six for durations up to 300 v_t/g; some above 3 v_t/g then still
# move by more than the tolerance at round-off, and end here. By hand: 10 to 100 give the same speeds to 1e-15
# (measured).
_STEPS = 60
_STEEPEST = 1.55  # g t/v_t, at most, of a rising body: tan is infinite at pi/2 = 1.571, and 48 v_t are faster than any


class Fall(NamedTuple):
    """The distance from the apex of a flight, the speed and the acceleration, both downward."""

    distance: FloatArray
    speed: FloatArray
    acceleration: FloatArray


@dataclass(frozen=True)
class Flight:
    """Vertical free flight.

    Attributes
    ----------
    gravity : float
        Acceleration of the falling body at rest, less its buoyancy.
    terminal_speed : float
        Speed at which drag balances gravity; infinite without drag.
    """

    gravity: float = STANDARD_GRAVITY
    terminal_speed: float = math.inf

    def __post_init__(self) -> None:
        for name, accepted in (("gravity", _POSITIVE), ("terminal_speed", _POSITIVE_OR_INFINITE)):
            object.__setattr__(self, name, number(name, getattr(self, name), accepted))  # the class is frozen

    @classmethod
    def of_sphere(
        cls,
        radius: float,
        density: float,
        *,
        air_density: float,
        gravity: float = STANDARD_GRAVITY,
        drag_coefficient: float = DRAG_COEFFICIENT,
    ) -> Flight:
        """Return the flight of a sphere in air.

        Parameters
        ----------
        radius, density : float
        air_density : float
            In the unit of `density`.
        gravity : float
            Acceleration without air, in the units of the radius and the time.
        drag_coefficient : float
            Drag over (1/2) d_air v^2 times the cross section.

        Raises
        ------
        TypeError, ValueError
            If a value is not a positive number (air density and drag coefficient may be 0), or the air is not lighter
            than the sphere.
        """
        r, d, g = (
            number(name, value, _POSITIVE)
            for name, value in (("radius", radius), ("density", density), ("gravity", gravity))
        )
        air = number("air_density", air_density, _NON_NEGATIVE)
        drag = number("drag_coefficient", drag_coefficient, _NON_NEGATIVE)
        if air >= d:
            raise ValueError(f"air_density is {air:g}: expected less than the sphere's density, {d:g}")
        # g' = g (1 - d_air/d). At v_t drag, c (1/2) d_air v_t^2 pi r^2, balances the weight less buoyancy,
        # 4/3 pi r^3 d g': v_t^2 = 8/3 r g' d/(d_air c).
        falling = g * (1 - air / d)
        return cls(falling, math.sqrt(8 / 3 * r * falling * d / (air * drag)) if air * drag else math.inf)

    def launch(self, duration: FloatArray) -> FloatArray:
        """Return the speeds u at the starts of flights of given durations, upward: the inverse of `duration`."""
        # In vacuum u = g t/2; in air the start is faster, so this is a lower bound.
        speed = self.gravity * duration / 2
        # t = v_t/g (arctan s + arsinh s) <= v_t/g (pi/2 + arsinh s) is another lower bound: s >= sinh(g t/v_t - pi/2).
        # A flight longer than 300 v_t/g counts as that long: it would start at 2e129 v_t, so no flight is meant. sinh
        # overflows at 710, and the square of s at 355.
        if self.terminal_speed < math.inf:
            duration = np.minimum(duration, 300 * self.terminal_speed / self.gravity)
            arsinh_bound = duration * self.gravity / self.terminal_speed - math.pi / 2
            speed = np.maximum(speed, self.terminal_speed * np.sinh(arsinh_bound))
        # The duration is a concave function of the speed: Newton's method rises to the root, and ends at a relative
        # step of 1e-15, nine times the rounding error 2^-53, or after _STEPS.
        for _ in range(_STEPS):
            last_speed, speed = speed, speed + (duration - self.duration(speed)) * self.launch_slope(speed)
            if np.all(np.abs(speed - last_speed) <= 1e-15 * speed):
                break
        return speed

    def duration(self, launch: FloatArray) -> FloatArray:
        """Return the durations of flights that start upward at given speeds (`launch`) and end at the same height."""
        if self.terminal_speed == math.inf:
            return 2 * launch / self.gravity
        s = launch / self.terminal_speed
        # t = v_t/g (arctan s + arsinh s)
        return self.terminal_speed / self.gravity * (np.arctan(s) + np.arcsinh(s))

    def launch_slope(self, launch: FloatArray) -> FloatArray:
        """Return the derivative du/dt of the launch speed u with respect to the duration t."""
        s = launch / self.terminal_speed
        # du/dt = g/(1/(1 + s^2) + 1/sqrt(1 + s^2))
        return self.gravity / (1 / (1 + s**2) + 1 / np.sqrt(1 + s**2))

    def impact(self, launch: FloatArray) -> FloatArray:
        """Return the speeds, downward, at the ends of flights that start upward at given speeds (`launch`)."""
        # v = u/sqrt(1 + s^2) with s = u/v_t
        return launch / np.sqrt(1 + (launch / self.terminal_speed) ** 2)

    def impact_slope(self, launch: FloatArray) -> FloatArray:
        """Return the derivative dv/du of the impact speed v by the launch speed u (`launch`)."""
        # dv/du = (1 + s^2)^(-3/2)
        return np.asarray((1 + (launch / self.terminal_speed) ** 2) ** -1.5)

    def launch_to(self, height: FloatArray) -> FloatArray:
        """Return the speeds at the starts of flights that rise to given heights."""
        if self.terminal_speed == math.inf:
            return np.sqrt(2 * self.gravity * height)
        # h = v_t^2/(2 g) ln(1 + s^2), so s^2 = exp(2 g h/v_t^2) - 1
        return self.terminal_speed * np.sqrt(np.expm1(self._fallen(height)))

    def launch_to_slope(self, height: FloatArray) -> FloatArray:
        """Return the derivative du/dh of the launch speed u of flights that rise to given heights h."""
        # u^2 = v_t^2 (exp(2 g h/v_t^2) - 1), so u du/dh = g exp(2 g h/v_t^2)
        growth = np.exp(self._fallen(height))
        return np.asarray(self.gravity * growth / self.launch_to(height))

    def fall(self, time: FloatArray) -> Fall:
        """Return the distance from the apex, the speed and the acceleration at times since the apex.

        Before it, times and speeds are negative.
        """
        g, v = self.gravity, self.terminal_speed
        if v == math.inf:
            return Fall(g * time**2 / 2, g * time, np.full_like(time, g))
        # With s = g t/v_t, in units of v_t^2/g and v_t: rising, the distance is -ln cos s, the speed tan s; falling,
        # ln cosh s, tanh s. ln cosh s = ln(exp(s) + exp(-s)) - ln 2 does not overflow as logaddexp.
        s = np.maximum(g * time / v, -_STEEPEST)
        rising = np.minimum(s, 0.0)
        distance = np.where(s < 0, -np.log(np.cos(rising)), np.logaddexp(s, -s) - math.log(2))
        speed = np.where(s < 0, np.tan(rising), np.tanh(s))
        # a = g (1 - v |v|/v_t^2)
        return Fall(v * v / g * distance, v * speed, g * (1 - speed * np.abs(speed)))

    def _fallen(self, height: FloatArray) -> FloatArray:
        """Return 2 g h/v_t^2, at most 600: from this height on, a body lands at v_t to the last digit.

        exp overflows at 710, and from 37 on exp(-x) is below the last digit of 1; 600 lies between.
        """
        return np.minimum(2 * self.gravity * height / self.terminal_speed**2, 600.0)
