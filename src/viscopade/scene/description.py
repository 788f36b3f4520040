"""Description of a scene in SI units: materials, bodies, contacts with speeds, the tolerance, the wanted code."""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass, field, replace
from itertools import combinations_with_replacement, pairwise, product
from typing import Literal

from viscopade.collision.spheres import Pair, Sphere
from viscopade.kernels.write.language import Language, Number
from viscopade.kernels.write.languages import NAMES, language
from viscopade.scene.units import Scale
from viscopade.simulators.setup import SI, Units

FormatName = Literal["double", "float"]
Use = Literal["scalar", "batch"]
Argument = Literal["speed", "v_star"]
MOST_TYPES = 64
"""Bodies and classes of sizes, at most; the number of contacts, each with numbers of its own, grows with the square.

64 types have 2080 contacts. Chosen by hand.
"""


@dataclass(frozen=True)
class Material:
    """The material of a body.

    Attributes
    ----------
    young_modulus, poisson_ratio : float
    density : float or None
        None if only walls are made of it.
    dissipative_constant : float or None
        A; None if each contact has its own.
    yield_strength : float or None
        Stress at which plastic flow (or breakage) begins, for a warning.
    relative_error : float or None
        Relative standard error of A, if known.
    """

    young_modulus: float
    poisson_ratio: float
    density: float | None
    dissipative_constant: float | None
    yield_strength: float | None = None
    relative_error: float | None = None


@dataclass(frozen=True)
class Sizes:
    """Radii of a kind of body: the least, the typical and the largest; and the number of their classes."""

    least: float
    typical: float
    largest: float
    classes: int = 1

    @property
    def ends(self) -> tuple[float, float]:
        """The least and the largest."""
        return self.least, self.largest

    @property
    def spread(self) -> bool:
        """Whether the radii differ."""
        return self.least < self.largest

    def split_classes(self) -> list[Sizes]:
        """Return the classes of sizes, from the smallest on; one class has all sizes.

        The ends of all classes have one ratio q, and the geometric mean of its ends is typical of a class. A program
        whose damping holds the effective mass of typical bodies is off by a power of m_eff: at most q^(3/2) up and
        down, in each class. No other division has a smaller largest ratio.
        """
        if self.classes == 1:
            return [self]
        # The ends R_i = R_least^(1 - t) R_largest^t with t = i/classes: ln R is divided evenly.
        exponents = (i / self.classes for i in range(1, self.classes))
        ends = [self.least, *(self.least ** (1 - t) * self.largest**t for t in exponents), self.largest]
        return [Sizes(low, geometric_mean(low, high), high) for low, high in pairwise(ends)]


@dataclass(frozen=True)
class Body:
    """A kind of sphere, or a wall (without sizes)."""

    material: str
    sizes: Sizes | None

    @property
    def is_wall(self) -> bool:
        """Whether the body is a wall."""
        return self.sizes is None


def geometric_mean(low: float, high: float) -> float:
    """Return the geometric mean sqrt(low high), which rounding does not move out of the interval."""
    return min(max(math.sqrt(low) * math.sqrt(high), low), high)


@dataclass(frozen=True)
class Speeds:
    """Impact speeds: the slowest, a typical and the fastest.

    Attributes
    ----------
    slowest, typical, fastest : float
    temperature : float or None
        Granular temperature, the variance of a component of a particle's velocity, if it determines the speeds.
    """

    slowest: float
    typical: float
    fastest: float
    temperature: float | None = None

    @classmethod
    def between(cls, slowest: float, fastest: float) -> Speeds:
        """Return a range of speeds, whose geometric mean is typical."""
        return cls(slowest, geometric_mean(slowest, fastest), fastest)

    @classmethod
    def thermal(cls, temperature: float, tail: float, wall: bool) -> Speeds:
        """Return the speeds in a gas in equilibrium, except for the slowest and fastest impacts, a share `tail` each.

        `temperature` is the granular temperature T, and `wall` whether the spheres hit a wall.

        The normal component of the impact velocity has the density v exp(-v^2/(2 s^2)), because faster pairs collide
        more often. s^2 is the variance of a component of the relative velocity.
        """
        # The relative velocity of two particles has the variance 2 T, that of one and a wall T. The probability of an
        # impact faster than v is exp(-v^2/(2 s^2)): 1 - tail at the slowest, tail at the fastest. The mean is
        # s sqrt(pi/2).
        s = math.sqrt(temperature * (1 if wall else 2))
        # v = s (-2 ln P)^(1/2), with the probability P of a faster impact
        slowest, fastest = (s * math.sqrt(-2 * log_p) for log_p in (math.log1p(-tail), math.log(tail)))
        return cls(slowest, s * math.sqrt(math.pi / 2), fastest, temperature)


@dataclass(frozen=True)
class Meeting:
    """A meeting: two kinds of bodies that collide.

    Attributes
    ----------
    first, second : str
        The second may be a wall.
    speeds : Speeds
    dissipative_constant : float or None
        A of this pair, if it does not follow from the materials.
    known_at : float or None
        The speed at which eps is known.
    relative_error : float or None
        Relative standard error of this pair's own A, if known.
    """

    first: str
    second: str
    speeds: Speeds
    dissipative_constant: float | None = None
    known_at: float | None = None
    relative_error: float | None = None

    @property
    def name(self) -> str:
        """Both names."""
        return f"{self.first}-{self.second}"


@dataclass(frozen=True)
class Tolerance:
    """Tolerance of the simulation: the largest admissible errors. A kernel needs at least one; a picture needs none.

    Attributes
    ----------
    epsilon, dissipation : float or None
        Relative errors of eps and of 1 - eps^2.
    absolute : float or None
        Absolute error of eps.
    """

    epsilon: float | None = None
    dissipation: float | None = None
    absolute: float | None = None

    def limits(self) -> dict[str, float]:
        """Return the limits of the errors that have one, by the name of the tolerance."""
        return {name: value for name, value in vars(self).items() if value is not None}


@dataclass(frozen=True)
class Code:
    """The wanted code: language, format and argument.

    Attributes
    ----------
    language : str
    format : "double" or "float"
    use : "scalar" or "batch"
        One collision at a time, or many.
    argument : "speed" or "v_star"
        The quantity that the simulation knows.
    largest_table : int or None
        Largest size of a table, in bytes.
    """

    language: str = NAMES[0]
    format: FormatName = "double"
    use: Use = "scalar"
    argument: Argument = "speed"
    largest_table: int | None = None

    @property
    def spoken(self) -> Language:
        """The language, with numbers of the wanted format only."""
        whole = language(self.language)
        return replace(whole, numbers=(whole.number(self.format),))

    @property
    def number(self) -> Number:
        """The language's numbers of the format."""
        return self.spoken.numbers[0]

    @property
    def function(self) -> str:
        """The function of kernels that gives eps."""
        return "restitution" if self.argument == "speed" else "epsilon"


@dataclass(frozen=True)
class Scene:
    """A scene.

    Attributes
    ----------
    source : str
        The file's name, for messages.
    name : str
        An identifier, for the names of functions and files.
    title : str
    materials : mapping of str to Material
    bodies : mapping of str to Body
    meetings : tuple of Meeting
    tolerance : Tolerance
    code : Code
    volume_fraction : float or None
        Volume fraction of all spheres.
    units : Units
        Units of the numbers in generated files.
    scale : Scale
        Sizes of these units in SI units.
    toml : str
        The text of the scene's file, for the generated file; "" for a scene that was not read.
    """

    source: str
    name: str
    title: str
    materials: Mapping[str, Material]
    bodies: Mapping[str, Body]
    meetings: tuple[Meeting, ...]
    tolerance: Tolerance
    code: Code
    volume_fraction: float | None = None
    units: Units = SI
    scale: Scale = field(default_factory=Scale)
    toml: str = field(default="", compare=False)

    def sphere(self, name: str, radius: float | None = None) -> Sphere:
        """Return the body of this name; a sphere has its typical radius, or the one that is given."""
        # A material without damping has A = 0 at first; a wall needs no density, and has no radius.
        body = self.bodies[name]
        material = self.materials[body.material]
        law = {
            "young_modulus": material.young_modulus,
            "poisson_ratio": material.poisson_ratio,
            "dissipative_constant": material.dissipative_constant or 0.0,
        }
        if body.sizes is None:
            return Sphere.wall(**law)
        size = body.sizes.typical if radius is None else radius
        return Sphere(radius=size, density=material.density or math.nan, **law)

    def pair(self, meeting: Meeting, radii: tuple[float | None, float | None] = (None, None)) -> Pair:
        """Return the pair of bodies that meet, with their typical radii unless radii are given."""
        spheres = [self.sphere(name, r) for name, r in zip((meeting.first, meeting.second), radii, strict=True)]
        pair, constant = Pair(*spheres), meeting.dissipative_constant
        return pair if constant is None else pair.damped(constant)

    def by_classes(self) -> Scene:
        """Return the scene with a body, NAME_1 and so on, for each class of sizes, and with a meeting of each pair."""
        # Name of a body -> its classes, by their names; these must be new.
        classes: dict[str, dict[str, Body]] = {}
        for name, body in self.bodies.items():
            if body.sizes is None or body.sizes.classes == 1:
                classes[name] = {name: body}
            else:
                numbered = enumerate(body.sizes.split_classes(), 1)
                classes[name] = {f"{name}_{number}": Body(body.material, sizes) for number, sizes in numbered}
                for taken in classes[name].keys() & self.bodies.keys():
                    raise ValueError(
                        f"{self.source}: body.{taken} has the name of a class of body.{name}: expected another name"
                    )
        bodies = {name: body for classes_of_body in classes.values() for name, body in classes_of_body.items()}
        if len(bodies) > max(MOST_TYPES, len(self.bodies)):
            raise ValueError(f"{self.source}: classes make {len(bodies)} types: expected at most {MOST_TYPES}")

        # Two bodies of one kind meet in each pair of classes once. A of a contact is that of all its classes.
        meetings = []
        for meeting in self.meetings:
            first, second = classes[meeting.first], classes[meeting.second]
            pairs = combinations_with_replacement(first, 2) if first is second else product(first, second)
            meetings += [replace(meeting, first=a, second=b) for a, b in pairs]
        return replace(self, bodies=bodies, meetings=tuple(meetings))

    def relative_error(self, meeting: Meeting) -> float | None:
        """Return the relative standard error of a pair's A, or None if none is known; the pair is that of a `meeting`.

        A of a pair is the mean of A of both materials, weighted with their compliances; errors of different materials
        are independent.
        """
        if meeting.dissipative_constant is not None:
            return meeting.relative_error
        # The share of a material in the mean: A/E* of its bodies, E* = Y/(1 - nu^2) the plane strain modulus.
        shares: dict[str, float] = {}
        for name in (meeting.first, meeting.second):
            sphere, material = self.sphere(name), self.bodies[name].material
            share = sphere.dissipative_constant / sphere.plane_strain_modulus
            shares[material] = shares.get(material, 0.0) + share
        # Independent errors add in squares: sigma_A/A = sqrt(sum (error share)^2)/sum share.
        errors = [(self.materials[name].relative_error, share) for name, share in shares.items()]
        if all(error is None for error, _ in errors):
            return None
        return math.hypot(*((error or 0.0) * share for error, share in errors)) / sum(shares.values())
