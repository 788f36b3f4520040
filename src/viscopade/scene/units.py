"""Conversion from SI units to the units of a scene, for simulators and generated files.

A quantity of the dimension length^a mass^b time^c is divided by the units' product of these powers.
"""

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
        """Return a beta, from SI units: its dimension is (time/length)^(1/5), so it grows with the unit of speed."""
        return beta * math.pow(self.speed, 0.2)

    def sphere(self, sphere: Sphere) -> Sphere:
        """Return a body in the scene's units, from SI units; A is a time."""
        # A mass instead of a density: it needs no power of the unit of length.
        return Sphere(
            radius=sphere.radius / self.length,
            mass=sphere.mass / self.mass,
            young_modulus=self._pressure(sphere.young_modulus),
            poisson_ratio=sphere.poisson_ratio,
            dissipative_constant=sphere.dissipative_constant / self.time,
        )

    def _pressure(self, pressure: float) -> float:
        """Return a pressure, from SI units, mass/(length time^2); only the result may overflow or underflow."""
        # Fractions are exact in between, where a factor alone, such as time^2, may be out of the range of doubles.
        p, length, mass, time = map(Fraction, (pressure, self.length, self.mass, self.time))
        try:
            return float(p * length * time**2 / mass)
        except OverflowError:
            return math.inf

    def pair(self, pair: Pair) -> Pair:
        """Return a pair, from SI units."""
        return Pair(self.sphere(pair.first), self.sphere(pair.second))

    def contact(self, contact: NamedContact) -> NamedContact:
        """Return a contact for simulators, from SI units: pairs, speeds and gravity, length/time^2."""
        # `extremes` are pairs of other radii.
        return replace(
            contact,
            pair=self.pair(contact.pair),
            slowest=contact.slowest / self.speed,
            typical=contact.typical / self.speed,
            fastest=contact.fastest / self.speed,
            extremes=tuple(map(self.pair, contact.extremes)),
            gravity=contact.gravity * self.time**2 / self.length,
        )
