"""The collision in physical units, eq:newton with eq:viscoelastic, by Runge and Kutta's method: a light third route.

Nothing is scaled: rho, A, m_eff and v enter as they are. With s = sqrt(xi) and dt = 2 s dtheta the motion

    ds/dtheta = u,    du/dtheta = -2 (rho/m_eff) s^2 (s^2 + 3/2 A u),    u = dxi/dt,

is polynomial, so the square root of the compression causes no error.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import NamedTuple

from viscopade.collision.spheres import Pair

# Steps per inverse rate of change; the error is about its fourth power.
FINENESS = 200
MAX_STEPS = 200_000


@dataclass(frozen=True)
class Motion:
    """One collision.

    Attributes
    ----------
    epsilon : float
        Coefficient of restitution (eq:force2COR).
    duration : float
        t_c, a time.
    largest_force : float
        Largest modulus of the force up to t_c, over m_eff: an acceleration.
    """

    epsilon: float
    duration: float
    largest_force: float


@dataclass(frozen=True)
class Tail:
    """The motion after t_c without the min(…) of eq:viscoelastic, until xi = 0.

    Attributes
    ----------
    epsilon_0 : float
        Speed at xi = 0 over impact speed: the coefficient of restitution for the older end of contact.
    attraction : float
        Largest attractive force over the largest force before.
    """

    epsilon_0: float
    attraction: float


class _State(NamedTuple):
    s: float
    u: float
    t: float


class _Law(NamedTuple):
    """rho/m_eff and 3/2 A."""

    stiffness: float
    damping: float

    def rates(self, y: _State) -> _State:
        return _State(y.u, -2 * self.stiffness * y.s * y.s * self.pull(y), 2 * y.s)

    def pull(self, y: _State) -> float:
        """Return xi + 3/2 A xi', whose zero is that of the force."""
        return y.s * y.s + self.damping * y.u

    def force(self, y: _State) -> float:
        """Return F/m_eff without the min(…)."""
        return -self.stiffness * y.s * self.pull(y)

    def step(self, y: _State, h: float) -> _State:
        k_1 = self.rates(y)
        k_2 = self.rates(_moved(y, k_1, h / 2))
        k_3 = self.rates(_moved(y, k_2, h / 2))
        k_4 = self.rates(_moved(y, k_3, h))
        return _State(
            *(x + h / 6 * (a + 2 * b + 2 * c + d) for x, a, b, c, d in zip(y, k_1, k_2, k_3, k_4, strict=True))
        )

    def length(self, y: _State) -> float:
        """Return a step, from the rates of the elastic, the viscous and the free motion."""
        elastic = math.sqrt(2 * self.stiffness * abs(y.s) ** 3)
        viscous = 2 * self.stiffness * self.damping * y.s * y.s
        free = math.pow(self.stiffness * abs(y.u) ** 3, 0.2)
        return 1 / (FINENESS * (elastic + viscous + free))


def _moved(y: _State, rates: _State, h: float) -> _State:
    return _State(y.s + h * rates.s, y.u + h * rates.u, y.t + h * rates.t)


def collide(pair: Pair, speed: float) -> Motion:
    """Follow a collision from first contact until the force vanishes.

    Parameters
    ----------
    pair : Pair
    speed : float
        Impact speed, > 0, in the pair's units.
    """
    law, path, end = _until_the_end(pair, speed)
    return Motion(-end.u / speed, end.t, -min(law.force(y) for y in path))


def tail(pair: Pair, speed: float) -> Tail:
    """Follow the motion after t_c as if the force could attract; it takes very long for v* above 2."""
    law, path, end = _until_the_end(pair, speed)
    after = [end]
    while after[-1].s > 0:
        _advance(law, after)
    before, beyond = after[-2:]
    at_0 = before.u + (beyond.u - before.u) * before.s / (before.s - beyond.s)
    largest = -min(law.force(y) for y in path)
    return Tail(-at_0 / speed, max(law.force(y) for y in after[:-1]) / largest)


def _until_the_end(pair: Pair, speed: float) -> tuple[_Law, list[_State], _State]:
    """Return the law, the states up to t_c, and the one at t_c."""
    law = _Law(pair.rho / pair.m_eff, 1.5 * pair.A)
    path = [_State(0.0, speed, 0.0)]
    while path[-1].u > 0 or law.pull(path[-1]) > 0:
        _advance(law, path)
    return law, path[:-1], _zero(law, path[-2])


def _advance(law: _Law, path: list[_State]) -> None:
    if len(path) > MAX_STEPS:
        raise ArithmeticError("the end of the collision was not found")
    path.append(law.step(path[-1], law.length(path[-1])))


def _zero(law: _Law, before: _State) -> _State:
    """Return where the force vanishes within the next step."""
    low, high = 0.0, law.length(before)
    for _ in range(60):
        middle = (low + high) / 2
        low, high = (middle, high) if law.pull(law.step(before, middle)) > 0 else (low, middle)
    return law.step(before, high)
