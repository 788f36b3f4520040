"""Weight during a contact: it presses a body that falls on a plane against the plane, which increases the loss.

The scaled equation then has a load, x'' + x^a + kappa x^b x' = G with G = g T/v, where T is the unit of time and v the
speed of impact. Between two bodies that both fall there is no load. For weak damping 1 - eps = kappa lambda(G), and
`loss_slope` is lambda'(0)/lambda(0) over the undamped contact time: the loss grows by the factor 1 + slope g t_c/v.
`derivations/16_load.py` derives it.
"""

from __future__ import annotations

import math
from collections.abc import Iterable
from dataclasses import dataclass, replace
from functools import lru_cache
from typing import NamedTuple

import numpy as np
from numpy.typing import ArrayLike

from viscopade.arrays.checked import FloatArray
from viscopade.collision.contact import Contact, damping_factor, sticking_speed
from viscopade.collision.spheres import Pair
from viscopade.theory.law import VISCOELASTIC, Law

EARTH = 9.81
"""Default acceleration of a body that falls, in m/s^2."""
# Texts warn from this g t_c/v on: the loss is then larger by about 2 per cent (times `loss_slope`); a choice.
COUNTS = 0.02


def loss_slope(law: Law) -> float:
    """Return s of the factor 1 + s g t_c/v by which weight multiplies a small loss; t_c is without damping."""
    # With G the load, lambda(G) = 2 times the integral of x^b |x'| dx over loading, x'^2 = 1 + 2 G x - 2 x^(a+1)/(a+1).
    # With x = ((a+1) u/2)^(1/(a+1)): lambda(0) ~ B((b+1)/(a+1), 3/2), and lambda'(0) ~ B((b+2)/(a+1), 1/2), whose
    # integrand has one x more (derivations/16_load.py).
    a, b = float(law.elastic), float(law.damping)
    with_load, without = _beta((b + 2) / (a + 1), 0.5), _beta((b + 1) / (a + 1), 1.5)
    return float(((a + 1) / 2) ** (1 / (a + 1)) * with_load / without / law.contact_time)


def rule(laws: Iterable[Law]) -> str:
    """Return the rule of thumb for laws of contact as a sentence, without its full stop."""
    # Each law once, and three decimals of s, more than a rule of thumb needs.
    slopes = dict.fromkeys(f"{loss_slope(law):.3f} (law {law})" for law in laws)
    return (
        "without weight: for a body that falls on a plane the loss 1 - eps is larger by a factor of about "
        f"1 + s g t_c/v, with s = {', '.join(slopes)}, which matters from g t_c/v = {COUNTS:g} on"
    )


def loaded(law: Law, kappa: float, load: float, carried: float = 0.0) -> Contact:
    """Return the scaled contact x'' + x^a + kappa x^b x' = load.

    Its force carries the part `carried` of the load without a compression, at x = 0.
    """
    free = Contact.of_law(law, kappa, load)
    return free if not carried else replace(free, force=lambda x, v: np.asarray(free.force(x, v)) + carried * load)


def falling(pair: Pair, speed: float, gravity: float) -> FallingContact:
    """Return the contact of a sphere that falls on a wall at a speed of impact, under gravity (length/time^2)."""
    return FallingContact(VISCOELASTIC, float(pair.v_star(speed)) ** 2, float(pair.time_scale(speed)), speed, gravity)


def calibrated(pair: Pair, speed: float, epsilon: float, gravity: float) -> Pair:
    """Return the pair with the A that gives an eps at a speed, for a sphere that falls on a wall."""
    # The A without weight is a good start: weight only adds to the loss.
    alone = pair.calibrated(speed, epsilon)
    if alone.A == 0:
        return alone
    return pair.damped(damping_factor(lambda a: pair.damped(a).contact(gravity), epsilon, alone.A, speed=speed))


def _beta(x: float, y: float) -> float:
    """Return Euler's beta function."""
    return math.gamma(x) * math.gamma(y) / math.gamma(x + y)


class Sentences(NamedTuple):
    """Sentences on weight, without full stops: a note, and eps of a body that falls (None if weight hardly matters)."""

    note: str
    fall: str | None


@dataclass(frozen=True)
class FallingContact:
    """Power-law contact of a body that falls on a plane; the direction of impact is normal to the plane.

    Attributes
    ----------
    law : Law
    kappa, time : float
        Damping and unit of time of the scaled equation at `speed`.
    speed : float
    gravity : float
        Acceleration g >= 0.
    carried : float
        The part of the weight that the contact carries without a compression, as in MuJoCo.
    """

    law: Law
    kappa: float
    time: float
    speed: float
    gravity: float
    carried: float = 0.0

    def contact(self, speed: float) -> Contact:
        """Return the scaled contact at another speed, for collisions at speed 1."""
        return loaded(self.law, self._kappa(speed), self.gravity * self._time(speed) / speed, self.carried)

    def epsilon(self, speeds: ArrayLike) -> FloatArray:
        """Return eps at speeds; 0 if the body does not leave the plane."""
        return np.array([self.contact(speed).collide().epsilon for speed in np.asarray(speeds, float).tolist()])

    def share(self, speed: float) -> float:
        """Return g t_c/v, with the contact time without damping and weight."""
        return self.gravity * self.law.contact_time * self._time(speed) / speed

    @property
    def sticking_speed(self) -> float | None:
        """Speed below which the body does not leave the plane, or None."""
        if self.kappa == 0 or self.gravity == 0:
            return None
        # G = g T/v with T ~ v^(2/(a+1) - 1) falls like v^(-2 a/(a+1)): it is 1 at the speed v (g T/v)^((a+1)/(2 a)).
        power = (float(self.law.elastic) + 1) / (2 * float(self.law.elastic))
        unit = self.speed * (self.gravity * self.time / self.speed) ** power
        multiple = _sticking(self.law, self._kappa(unit), self.carried)
        return None if multiple is None else unit * multiple

    def note(self, slowest: float, fastest: float, units: str = "m/s") -> str:
        """Return the size of the effect of weight at two speeds of impact, as a sentence, without an integration.

        These are `slowest` and `fastest`. `units` is the unit of speeds; with "^2" appended, "m/s" is that of g.
        """
        # Two digits of g t_c/v; the factor is 1 + s g t_c/v of `loss_slope`. A load that is carried does not press.
        speeds = [fastest, slowest] if slowest < fastest else [fastest]
        shares, speeds_text = _and(map(self.share, speeds), ".2g"), " and ".join(f"{v:.4g}" for v in speeds)
        note = f"weight: g t_c/v = {shares} at {speeds_text} {units} with g = {self.gravity:.4g} {units}^2"
        if self.carried:
            return note
        factor = f"1 + {loss_slope(self.law):.3f} g t_c/v"
        return f"{note}; the loss 1 - eps of a body that falls on a plane grows by about the factor {factor}"

    def sentences(
        self, slowest: float, fastest: float, units: str = "m/s", user_set_gravity: bool = False
    ) -> Sentences:
        """Return sentences on the effect of weight at two speeds.

        Parameters
        ----------
        slowest, fastest : float
            Speeds of impact.
        units : str
            Unit of speeds.
        user_set_gravity : bool
            Whether the user set the gravity, so that eps of a body that falls is no warning.
        """
        # Without the user's own gravity nothing is said where weight is below `COUNTS`, as its effect is largest for
        # the slowest impact.
        speeds = [fastest, slowest] if slowest < fastest else [fastest]
        speeds_text, note = " and ".join(f"{v:.4g}" for v in speeds), self.note(slowest, fastest, units)
        if not user_set_gravity and self.share(slowest) < COUNTS:
            return Sentences(note, None)
        try:
            light, heavy = (_and(body.epsilon(speeds), ".4f") for body in (replace(self, gravity=0.0), self))
            sticking = self.sticking_speed
        except ValueError:  # damping is too strong for an integration
            return Sentences(note, None)
        fall = f"a body that falls on a plane at {speeds_text} {units} rebounds with eps = {heavy} (sampled)"
        words = "" if sticking is None else f"; below {sticking:.3g} {units} it stays down, eps = 0"
        return Sentences(note, f"{fall}, without weight {light}{words}")

    def _kappa(self, speed: float) -> float:
        """Return kappa at another speed: it is proportional to v^(2 c), v^(1/5) for the paper's law."""
        return float(self.kappa * (speed / self.speed) ** float(2 * self.law.c))

    def _time(self, speed: float) -> float:
        """Return the unit of time at another speed: T ~ v^(2/(a+1) - 1), v^(-1/5) for the paper's law."""
        return float(self.time * (speed / self.speed) ** (2 / (float(self.law.elastic) + 1) - 1))


@lru_cache(maxsize=256)  # more than the contacts of a file
def _sticking(law: Law, kappa: float, carried: float) -> float | None:
    """Return the sticking speed over the speed at which G is 1 and the damping is kappa, or None.

    `law` is that of contact, `carried` the part of the weight that needs no compression.
    """
    a = float(law.elastic)

    def parts(speed: float) -> bool:
        """Return whether the body leaves the plane at a speed in this unit."""
        # G = speed^(-2 a/(a+1)) and kappa ~ speed^(2 c), with the unit of speed at which G is 1.
        load = speed ** (-2 * a / (a + 1))
        return loaded(law, kappa * speed ** float(2 * law.c), load, carried).collide().parts

    return sticking_speed(parts, 1.0)


def _and(numbers: Iterable[float], figures: str) -> str:
    """Return numbers joined by "and"; `figures` is their format, and 0 is "0"."""
    return " and ".join(format(number, figures) if number else "0" for number in numbers)
