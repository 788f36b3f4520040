"""Setup for a simulator: the bodies, their contacts and the impact speeds."""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping
from dataclasses import dataclass, field

from viscopade.collision.spheres import Pair, Sphere
from viscopade.collision.weight import EARTH, FallingContact, falling
from viscopade.generated import harmless


@dataclass(frozen=True)
class Units:
    """Names of the units of all numbers in a `Setup`."""

    length: str = "m"
    mass: str = "kg"
    time: str = "s"

    @property
    def speed(self) -> str:
        """Unit of speeds."""
        return f"{self.length}/{self.time}"

    @property
    def beta(self) -> str:
        """Unit of beta: v*^2 = beta v^(1/5) has none."""
        return f"({self.time}/{self.length})^(1/5)"

    def time_text(self, time: float) -> str:
        """Return a time, in this unit of time, as an option has it: "2 ms" instead of "0.002 s", "0.5 tau" as it is."""
        # Six digits; of seconds the largest prefix that leaves a number >= 1, and ns for shorter times.
        if self.time != "s":
            return f"{time:.6g} {self.time}"
        name, unit = next((prefix for prefix in _PREFIXES if time >= prefix[1]), _PREFIXES[-1])
        return f"{time / unit:.6g} {name}"


SI = Units()
_PREFIXES = (("s", 1.0), ("ms", 1e-3), ("us", 1e-6), ("ns", 1e-9))  # units of time, from the longest on, in seconds
NO_WEIGHT = "Weight does not change eps when both bodies fall"


@dataclass(frozen=True)
class NamedContact:
    """Bodies of two kinds that collide.

    Attributes
    ----------
    first, second : str
        Names of the bodies; the second may be a wall, the first is not.
    pair : Pair
        With the radii that are typical of them.
    slowest, typical, fastest : float
        Impact speeds.
    extremes : tuple of Pair
        The same bodies at the ends of their sizes, from the least to the largest v* at a speed; empty for one size.
    gravity : float
        Acceleration of a body that falls.

    Raises
    ------
    ValueError
        If the speeds are not positive, finite and in order, or the first body is a wall.
    """

    first: str
    second: str
    pair: Pair
    slowest: float
    typical: float
    fastest: float
    extremes: tuple[Pair, ...] = ()
    gravity: float = EARTH

    def __post_init__(self) -> None:
        """Refuse speeds that are not in order, and a wall as the first body."""
        # NaN fails the comparison, too.
        if not 0 < self.slowest <= self.typical <= self.fastest < math.inf:
            raise ValueError(
                f"speeds of {self.name} are {self.slowest!r}, {self.typical!r} and {self.fastest!r}: "
                "expected finite numbers > 0 in order"
            )
        if self.pair.first.is_wall:
            raise ValueError(f"the first body, {self.first}, is a wall: expected a wall as the second body")

    @property
    def name(self) -> str:
        """Both names, as comments may have them."""
        return harmless(f"{self.first}-{self.second}")

    @property
    def falls(self) -> bool:
        """Whether a weight presses the bodies together: two that both fall have none."""
        return self.pair.second.is_wall

    @property
    def falling(self) -> FallingContact:
        """The contact with the weight of a body that falls."""
        return falling(self.pair, self.typical, self.gravity if self.falls else 0.0)


@dataclass(frozen=True)
class Setup:
    """Bodies and contacts, in consistent units.

    Attributes
    ----------
    title : str
        One line.
    bodies : mapping of str to Sphere
        By name, walls too; in the order in which types are numbered.
    contacts : tuple of NamedContact
        All that are meant to occur.
    units : Units
        Of all numbers.
    warnings : tuple of str
        Sentences on assumptions of the model that the contacts violate, without their full stops.
    notes : tuple of str
        Sentences on the uncertainty of the damping and on classes of sizes, without their full stops.
    weighty : bool
        Whether the user has set gravity: then eps at the typical speed is that of a body that falls.
    radii : mapping of str to pair of float
        The least and the largest radius of bodies whose sizes are distributed.

    Raises
    ------
    ValueError
        If a contact is between bodies that are not there, or there is none.
    """

    title: str
    bodies: Mapping[str, Sphere]
    contacts: tuple[NamedContact, ...]
    units: Units = SI
    warnings: tuple[str, ...] = ()
    notes: tuple[str, ...] = ()
    weighty: bool = False
    radii: Mapping[str, tuple[float, float]] = field(default_factory=dict)

    def __post_init__(self) -> None:
        """Refuse a setup without a contact, or with one of a body that is missing."""
        # `bodies` has a Sphere, or a wall, by its name; each contact names two of them.
        if not self.contacts:
            raise ValueError("contacts is empty: expected at least one")
        for contact in self.contacts:
            for name in (contact.first, contact.second):
                if name not in self.bodies:
                    raise ValueError(f"there is no body {name!r}: expected {', '.join(self.bodies)}")

    @property
    def heading(self) -> list[str]:
        """First lines of a generated file, without comment marks: the title, one line, then notes and warnings."""
        # A warning is a name, a fact and a reason. What one reason says of several contacts is one warning.
        facts: dict[str, list[str]] = {}
        for text in self.warnings:
            fact, _, reason = text.rpartition(": ")
            facts.setdefault(reason, []).append(fact)
        warnings = (
            f"Warning: {fact[0]}: {reason}." if len(fact) == 1 else f"Warning: {reason}. {'; '.join(fact)}."
            for reason, fact in facts.items()
        )
        return [harmless(self.title), *(f"{text}." for text in self.notes), *warnings]

    @property
    def opening(self) -> list[str]:
        """The heading, and what weight does in the viscoelastic contact on which it acts most."""
        falling_contacts = [contact for contact in self.contacts if contact.falls]
        if not falling_contacts:
            return [*self.heading, f"{NO_WEIGHT}."]
        # `share` is g t_c/v, the part of the impact speed that gravity adds in an undamped contact; it falls with v.
        contact = max(falling_contacts, key=lambda contact: contact.falling.share(contact.slowest))
        # A note on what weight does at these speeds, and a sentence with eps, None where weight does not count.
        speeds = contact.slowest, contact.fastest
        note, fall = contact.falling.sentences(*speeds, self.units.speed, self.weighty)
        name = f"{contact.name}, on which weight acts most" if len(falling_contacts) > 1 else contact.name
        warning = "" if self.weighty else "Warning: "
        return [*self.heading, f"{name}: {note}.", *([] if fall is None else [f"{warning}{contact.name}: {fall}."])]

    def pairs(self) -> dict[frozenset[str], Pair]:
        """Return the pair of every two bodies that can meet, a sphere and a sphere or wall, by the set of their names.

        The pair of a contact, which may have a damping of its own, replaces that of its bodies.
        """
        made = {frozenset((a, b)): Pair(self.bodies[a], self.bodies[b]) for a in self.spheres for b in self.bodies}
        return made | {frozenset((contact.first, contact.second)): contact.pair for contact in self.contacts}

    @property
    def spheres(self) -> list[str]:
        """Names of the spheres."""
        return [name for name, body in self.bodies.items() if not body.is_wall]


def with_two_digits(number: float, rounded: Callable[[float], int] = math.ceil) -> float:
    """Return the next larger number with two significant digits, or with `math.floor` the next smaller one."""
    # The unit of the second digit: number/unit is from 10 to 100. 1e-12 is above the rounding error of log10, so that
    # 1000 has four digits although its logarithm may be 2.9999999999999996.
    unit = 10.0 ** (math.floor(math.log10(number) + 1e-12) - 1)
    # 1e-9 is above the error with which a duration is computed, about 1e-12: 31.00000000001 is 31, not 32.
    slack = -1e-9 if rounded is math.ceil else 1e-9
    return rounded(number / unit * (1 + slack)) * unit


def pair_setup(
    pair: Pair,
    speed: float,
    speeds: tuple[float, float] | None = None,
    warnings: tuple[str, ...] = (),
    gravity: float | None = None,
) -> Setup:
    """Return the setup of one pair of bodies, in SI units.

    Parameters
    ----------
    pair : Pair
        Two spheres, or a sphere and a wall.
    speed : float
        Typical impact speed, in m/s.
    speeds : tuple of float, optional
        Slowest and fastest impact, in m/s; `speed` alone by default.
    warnings : tuple of str
        Sentences on assumptions of the model that the contact violates.
    gravity : float, optional
        Acceleration of a body that falls, in m/s^2, if the user has set it; else sentences on weight take 9.81.
    """
    # Two equal spheres are one type of bodies.
    if pair.second.is_wall:
        bodies = {"ball": pair.first, "wall": pair.second}
    elif pair.first == pair.second:
        bodies = {"ball": pair.first}
    else:
        bodies = {"first": pair.first, "second": pair.second}
    names = list(bodies)
    slowest, fastest = (speed, speed) if speeds is None else speeds
    g = EARTH if gravity is None else gravity
    contact = NamedContact(names[0], names[-1], pair, slowest, speed, fastest, gravity=g)
    title = "Two spheres" if len(bodies) == 1 or not pair.second.is_wall else "A ball and a wall"
    return Setup(title, bodies, (contact,), warnings=warnings, weighty=gravity is not None)
