"""Conversion of a scene from SI units to its own units, for simulators and generated files."""

from __future__ import annotations

import math
from dataclasses import dataclass, replace

from viscopade.collision.spheres import Pair, Sphere
from viscopade.collision.weight import EARTH
from viscopade.scene import sense
from viscopade.scene.description import Scene
from viscopade.scene.encounter import encounters
from viscopade.simulators.setup import NamedContact, Setup


@dataclass(frozen=True)
class Scale:
    """Units of length, mass and time, in SI units."""

    length: float
    mass: float
    time: float

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
        """Return a pressure, from SI units: nothing but the result overflows or underflows."""
        numbers = pressure, self.length, self.time, self.mass
        (p, p2), (length, length2), (time, time2), (mass, mass2) = map(math.frexp, numbers)
        try:
            return math.ldexp(p * length * (time * time) / mass, p2 + length2 + 2 * time2 - mass2)
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


def setup(scene: Scene, gravity: float | None = None) -> Setup:
    """Return the bodies and contacts of a scene in its units, with the warnings on it; gravity in SI units."""
    scale = Scale(*scene.scale)
    bodies = {name: scale.sphere(scene.sphere(name)) for name in scene.bodies}
    met = encounters(scene)
    g = EARTH if gravity is None else gravity
    contacts = tuple(scale.contact(replace(encounter.contact(), gravity=g)) for encounter in met)
    warnings = tuple(text for encounter in met for text in sense.warnings(scene, encounter))
    notes = tuple(text for encounter in met for text in sense.notes(scene, encounter))
    return Setup(scene.title, bodies, contacts, scene.units, warnings, notes, gravity is not None)
