"""Decks: inputs that run as they stand, a box of a scene's bodies that cools, for LAMMPS and REBOUND.

The spheres begin on a cubic lattice with Gaussian velocities of a stated seed; nothing drives them. A thermodynamic
output has the granular temperature T = <m c^2>/(3 <m>), for equal spheres the variance of a velocity component. With
equal spheres it follows `viscopade.simulators.gas`.

Time is stated in mean collision times of the start, 1/(4 sqrt(pi T) n d^2 g) with Carnahan and Starling's pair
correlation at contact g = (1 - phi/2)/(1 - phi)^3. T at the start makes the mean impact speed, sqrt(pi T) in a
Maxwellian gas, the contact's typical speed.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import Any

from viscopade.collision.spheres import Sphere
from viscopade.generated import marker_line, one_line, template
from viscopade.simulators import DECKS, lammps, rebound
from viscopade.simulators.gas import mean_collision_time, pair_correlation
from viscopade.simulators.render import render
from viscopade.simulators.setup import Contact, Setup
from viscopade.simulators.stated import STEPS, largest_step_error, program_number

MOST_PARTICLES = 10_000_000
DENSEST = 0.45
MANY_STEPS, MOST_STEPS = 100_000_000, 2**31 - 1  # LAMMPS takes no more in a run
OUTPUTS = 50  # of the temperature
_WALLS = 2
_FLIGHT = 0.03  # of the smallest radius, that a particle of thermal speed flies in a step of REBOUND


@dataclass(frozen=True)
class Deck:
    """What a deck needs beside a setup.

    Attributes
    ----------
    particles : int
        Number of spheres wanted, 8 to 10,000,000; the deck has the cube of an integer.
    volume_fraction : float
        Of the spheres, > 0 and <= 0.45.
    seed : int
        Of the velocities, 1 to 900,000,000.
    collisions : float
        Duration in mean collision times of the start, > 0.

    Raises
    ------
    ValueError
        If a value is out of range.
    """

    particles: int = 1000
    volume_fraction: float = 0.1
    seed: int = 1
    collisions: float = 5.0

    def __post_init__(self) -> None:
        for name, value, accepted, good in (
            ("particles", self.particles, f"8 to {MOST_PARTICLES}", 8 <= self.particles <= MOST_PARTICLES),
            ("volume-fraction", self.volume_fraction, f"> 0 and <= {DENSEST}", 0 < self.volume_fraction <= DENSEST),
            ("seed", self.seed, "1 to 900000000", 1 <= self.seed <= 900_000_000),
            ("collisions", self.collisions, "a number > 0 and <= 1e6", 0 < self.collisions <= 1e6),
        ):
            if not good:
                raise ValueError(f"{name} is {value!r}: accepted is {accepted}")


@dataclass(frozen=True)
class Box:
    """A box of spheres of a setup: each kind is as frequent as every other.

    Attributes
    ----------
    setup : Setup
    deck : Deck
    """

    setup: Setup
    deck: Deck

    def __post_init__(self) -> None:
        if self.first is None:
            raise ValueError(
                f"{self.setup.title}: all contacts are with walls: accepted for a deck is a contact of two spheres"
            )
        largest = max(sphere.radius for sphere in self.spheres)
        if self.spacing <= 2 * largest:
            densest = self.deck.volume_fraction * (self.spacing / (2 * largest)) ** 3
            raise ValueError(
                f"volume-fraction is {self.deck.volume_fraction:g}: accepted for these sizes is below {densest:.3g}"
            )

    @property
    def first(self) -> Contact | None:
        """The first contact of two spheres: its typical speed sets the temperature."""
        return next((contact for contact in self.setup.contacts if not contact.pair.second.is_wall), None)

    @property
    def spheres(self) -> list[Sphere]:
        """The kinds of spheres."""
        return [self.setup.bodies[name] for name in self.setup.spheres]

    @property
    def side(self) -> int:
        """Spheres along an edge of the box."""
        return round(math.cbrt(self.deck.particles))

    @property
    def number(self) -> int:
        """Number of spheres."""
        return self.side**3

    @property
    def counts(self) -> list[int]:
        """Number of spheres of each kind, which take turns."""
        kinds = len(self.spheres)
        return [(self.number - kind + kinds - 1) // kinds for kind in range(kinds)]

    @property
    def spacing(self) -> float:
        """Distance of neighbours on the lattice."""
        volumes = (sphere.mass / sphere.density for sphere in self.spheres)
        whole = sum(n * volume for n, volume in zip(self.counts, volumes, strict=True))
        return float((whole / self.deck.volume_fraction) ** (1 / 3) / self.side)

    @property
    def edge(self) -> float:
        """Edge of the box."""
        return self.side * self.spacing

    @property
    def mass(self) -> float:
        """Mass of all spheres."""
        return sum(n * sphere.mass for n, sphere in zip(self.counts, self.spheres, strict=True))

    @property
    def temperature(self) -> float:
        """T at the start."""
        assert self.first is not None  # checked when made
        return self.first.typical**2 / math.pi

    @property
    def collision_time(self) -> float:
        """Mean collision time at the start, with the mean radius."""
        radius = sum(n * sphere.radius for n, sphere in zip(self.counts, self.spheres, strict=True)) / self.number
        phi = self.deck.volume_fraction
        density = self.number / self.edge**3 * pair_correlation(phi)
        return mean_collision_time(self.temperature, density, 2 * radius)

    @property
    def duration(self) -> float:
        """Of the run."""
        return self.deck.collisions * self.collision_time

    def lines(self) -> list[str]:
        """Return what a file says of the box."""
        units = self.setup.units
        kinds = zip(self.setup.spheres, self.counts, self.spheres, strict=True)
        return [
            f"{self.number} spheres on a lattice in a cube of edge {self.edge:.6g} {units.length}, volume fraction "
            f"{self.deck.volume_fraction:g}:",
            *(f"  {n} {one_line('name', name)} of radius {s.radius:.6g} {units.length}" for name, n, s in kinds),
            f"Velocities: Gaussian, seed {self.deck.seed}, granular temperature T = {self.temperature:.6g} "
            f"({units.speed})^2;",
            f"  the mean impact speed is the typical one, {math.sqrt(math.pi * self.temperature):.6g} {units.speed}.",
            f"Duration: {self.deck.collisions:g} mean collision times of the start, {self.collision_time:.6g} "
            f"{units.time} each.",
        ]


def deck_text(target: str, setup: Setup, sized: Setup, command: str, deck: Deck, tier: str = "1e-5") -> str:
    """Return the deck for a program.

    Parameters
    ----------
    target : str
        One of `simulators.DECKS`.
    setup, sized : Setup
        Bodies, contacts and speeds; the second has a body for each class of sizes.
    command : str
        The command line that makes the text.
    deck : Deck
    tier : str
        Accuracy of the kernel for REBOUND.

    Raises
    ------
    ValueError
        For an unknown target, or a box that cannot be had.
    """
    if target not in DECKS:
        raise ValueError(f"target is {target!r}: accepted for a deck are {', '.join(DECKS)}")
    box = Box(sized, deck)
    return _lammps(box, command) if target == "lammps" else _rebound(setup, box, command, tier)


def _lammps(box: Box, command: str) -> str:
    setup = box.setup
    walls = [name for name, body in setup.bodies.items() if body.is_wall]
    if len(walls) > _WALLS:
        raise ValueError(f"{setup.title}: there are {len(walls)} walls: accepted for a deck are at most {_WALLS}")
    places = {1: ["zplane 0.0 {}"], 2: ["zplane 0.0 NULL", "zplane NULL {}"]}.get(len(walls), [])
    timestep = lammps.shortest_contact(setup) / STEPS
    steps = math.ceil(box.duration / timestep)
    if steps > MOST_STEPS:
        raise ValueError(
            f"collisions is {box.deck.collisions:g}: the run would have {steps:.3g} time steps, accepted is at most "
            f"{box.deck.collisions * MOST_STEPS / steps:.3g}"
        )
    units = lammps.units_command(setup.units)
    radii = [sphere.radius for sphere in box.spheres]
    return template(__name__, "lammps_deck.in.jinja").render(
        marker=marker_line(command),
        opening=setup.opening,
        lines=[*box.lines(), *_step_lines(setup, timestep, steps)],
        units=units,
        walls=[
            (lammps.wall_variable(setup, name), place.format(program_number(box.edge)))
            for name, place in zip(walls, places, strict=True)
        ],
        lattice=program_number(box.spacing**-3 if units.endswith("lj") else box.spacing),
        edge=program_number(box.edge),
        kinds=[(program_number(2 * s.radius), program_number(s.mass)) for s in box.spheres],
        skin=program_number(0.5 * min(radii)),
        contacts=render("lammps", setup, command),
        energy=program_number(1.5 * box.mass * box.temperature),
        mass=program_number(box.mass),
        seed=box.deck.seed,
        timestep=f"{timestep:.6g}",
        steps=steps,
        every=max(steps // OUTPUTS, 1),
    )


def _step_lines(setup: Setup, timestep: float, steps: int) -> list[str]:
    return [
        f"Time step: {STEPS} in the shortest contact; the error of eps by it is at most "
        f"{largest_step_error(setup, timestep):.1e}.",
        f"The run has {steps:,} time steps."
        + (" REBOUND follows no contacts and needs far fewer." if steps > MANY_STEPS else ""),
    ]


def _rebound(setup: Setup, box: Box, command: str, tier: str) -> str:
    if len(rebound.contacts(setup)) > 1:
        raise ValueError(f"{setup.title}: there are several contacts of spheres: accepted for a deck is one")
    step = _FLIGHT * min(sphere.radius for sphere in box.spheres) / math.sqrt(box.temperature)
    numbers: dict[str, Any] = {
        "side": box.side,
        "spacing": box.spacing,
        "kinds": [(sphere.mass, sphere.radius) for sphere in box.spheres],
        "temperature": box.temperature,
        "seed": box.deck.seed,
        "step": step,
        "steps": math.ceil(box.duration / step),
        "every": max(math.ceil(box.duration / step) // OUTPUTS, 1),
    }
    module = render("rebound-python", setup, command, tier)
    return module + template(__name__, "rebound_deck.py.jinja").render(lines=box.lines(), **numbers)
