"""Conversion from SI units to the units of a scene, for simulators and generated files."""

from __future__ import annotations

import math
from dataclasses import dataclass, replace
from fractions import Fraction

from viscopade.collision.spheres import Pair, Sphere
from viscopade.simulators.setup import NamedContact


@dataclass(frozen=True)
class Scale:
    """Sizes of the units of length, mass and time in SI units."""

    length: float = 1.0
    mass: float = 1.0
    time: float = 1.0

    @property
    def speed(self) -> float:
        """The unit of speed."""
        return self.length / self.time

    def beta(self, beta: float) -> float:
        """Return a beta, from SI units: it is a (time/length)^(1/5)."""
        return beta * math.pow(self.speed, 0.2)

    def sphere(self, sphere: Sphere) -> Sphere:
        """Return a body, from SI units."""
        return Sphere(
            radius=sphere.radius / self.length,
            mass=sphere.mass / self.mass,
            young_modulus=self._pressure(sphere.young_modulus),
            poisson_ratio=sphere.poisson_ratio,
            dissipative_constant=sphere.dissipative_constant / self.time,
        )

    def _pressure(self, pressure: float) -> float:
        """Return a pressure, from SI units; only the result may overflow or underflow."""
        p, length, mass, time = map(Fraction, (pressure, self.length, self.mass, self.time))
        try:
            return float(p * length * time**2 / mass)
        except OverflowError:
            return math.inf

    def pair(self, pair: Pair) -> Pair:
        """Return a pair, from SI units."""
        return Pair(self.sphere(pair.first), self.sphere(pair.second))

    def contact(self, contact: NamedContact) -> NamedContact:
        """Return a contact, from SI units."""
        return replace(
            contact,
            pair=self.pair(contact.pair),
            slowest=contact.slowest / self.speed,
            typical=contact.typical / self.speed,
            fastest=contact.fastest / self.speed,
            extremes=tuple(map(self.pair, contact.extremes)),
            gravity=contact.gravity * self.time**2 / self.length,
        )
