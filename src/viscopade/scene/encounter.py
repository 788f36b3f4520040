"""Encounters of a scene's bodies: ranges of beta, v* and eps, duration and depth of contact."""

from __future__ import annotations

import math
from collections.abc import Iterable, Iterator
from dataclasses import dataclass
from fractions import Fraction
from functools import cached_property, lru_cache
from typing import TypeVar

import numpy as np

from viscopade.collision import exact, limits
from viscopade.collision.spheres import Pair
from viscopade.scene.description import Meeting, Scene, Speeds
from viscopade.simulators.setup import NamedContact

DIGITS = 20  # of the ends of the range of eps: three more than a double has; more only cost time
# More than the relative error of beta and v* in double precision: some ten roundings and powers, 1e-15 each.
_PADDING = Fraction(1, 10**12)
# More than the relative error of a decimal of this many significant digits, 10^-19 of a number from 1 to 10.
_LAST_DIGIT = Fraction(1, 10 ** (DIGITS - 2))

Interval = tuple[Fraction, Fraction]
Real = TypeVar("Real", Fraction, float)


def hull(intervals: Iterable[tuple[Real, Real]]) -> tuple[Real, Real]:
    """Return the smallest interval that contains the others."""
    lows, highs = zip(*intervals, strict=True)
    return min(lows), max(highs)


@dataclass(frozen=True)
class Encounter:
    """Two kinds of bodies that collide, with their ranges of beta, v* and eps.

    Attributes
    ----------
    meeting : Meeting
    pair : Pair
        The pair with typical radii.
    sizes : tuple of Pair
        The pairs with the radii at the ends of both ranges, and those with the smallest and the largest v* at a speed,
        in the order of v*.
    """

    meeting: Meeting
    pair: Pair
    sizes: tuple[Pair, ...]

    @property
    def name(self) -> str:
        """Names of both bodies."""
        return self.meeting.name

    @property
    def weakest(self) -> Pair:
        """The pair with the smallest v* at a speed."""
        return self.sizes[0]

    @property
    def strongest(self) -> Pair:
        """The pair with the largest v* at a speed."""
        return self.sizes[-1]

    @property
    def speeds(self) -> Speeds:
        """The impact speeds."""
        return self.meeting.speeds

    @cached_property
    def v_star(self) -> Interval:
        """The range of v*, rounded outwards."""
        low = Fraction(self.weakest.v_star(self.speeds.slowest))
        high = Fraction(self.strongest.v_star(self.speeds.fastest))
        return low * (1 - _PADDING), high * (1 + _PADDING)

    @cached_property
    def epsilon(self) -> Interval:
        """The range of eps, proven: eps falls with v*."""
        low, high = self.v_star
        return proven_epsilon(high)[0], proven_epsilon(low)[1]

    @property
    def contact_time(self) -> float:
        """Duration of a typical contact."""
        return float(self.pair.contact_time(self.speeds.typical))

    @property
    def overlap(self) -> float:
        """Maximal compression of typical bodies at the fastest impact, over the smaller radius."""
        return limits.overlap(self.pair, self.speeds.fastest)

    def contact(self) -> NamedContact:
        """Return the contact for simulators: the pair, its speeds, and the pairs of other sizes."""
        slowest, fastest = self.speeds.slowest, self.speeds.fastest
        extremes = () if len(self.sizes) == 1 else self.sizes
        # The typical speed is that of the measured eps, moved into the range of the scene.
        measured_speed = self.meeting.known_at
        typical = self.speeds.typical if measured_speed is None else min(max(measured_speed, slowest), fastest)
        return NamedContact(self.meeting.first, self.meeting.second, self.pair, slowest, typical, fastest, extremes)


@lru_cache(maxsize=256)  # results for 128 pairs: few scenes have more, and each takes 30 ms
def proven_epsilon(v_star: Fraction) -> Interval:
    """Return proven bounds of eps at a v*."""
    value = Fraction(exact.collision(v_star, DIGITS).decimals()["epsilon"])
    return value * (1 - _LAST_DIGIT), min(value * (1 + _LAST_DIGIT), Fraction(1))


def scene_encounters(scene: Scene) -> list[Encounter]:
    """Return the encounters of all pairs that meet in a scene.

    Raises
    ------
    ValueError
        If physical properties of a pair are beyond double precision.
    """
    return [_encounter(scene, meeting) for meeting in scene.meetings]


def _encounter(scene: Scene, meeting: Meeting) -> Encounter:
    """Return the encounter of a meeting; ValueError names it if its numbers are out of range."""
    # The pairs with extreme radii, in the order of beta, and so of v*; mass and radius order pairs of equal beta.
    try:
        pair = scene.pair(meeting)
        pairs = {scene.pair(meeting, radii) for radii in _extreme_radii(scene, meeting)}
    except ValueError as error:
        raise ValueError(f"{scene.source}: {meeting.name}: {error}") from None
    encounter = Encounter(meeting, pair, tuple(sorted(pairs, key=lambda p: (p.beta, p.m_eff, p.first.radius))))
    # Ice in Saturn's rings has v* from 0.03 to 2; beyond 30 powers of ten a unit is wrong. Up to there v*^10, which
    # speed tables use, is a double.
    low, high = encounter.v_star
    if not 1e-30 <= low <= high <= 1e30:
        raise ValueError(
            f"{scene.source}: v* of {encounter.name} ranges from {float(low):.3g} to {float(high):.3g}: expected 1e-30 "
            "to 1e30 (are the units of the material and of the speeds right?)"
        )
    return encounter


def _extreme_radii(scene: Scene, meeting: Meeting) -> Iterator[tuple[float, float | None]]:
    """Yield radii of the two bodies of a meeting, among them those of the smallest and the largest beta.

    beta^(5/2) is proportional to sqrt(R_eff)/m_eff. As one radius grows and the other is fixed, it falls and then
    rises. So it is largest at a corner of both ranges. If both radii grow by the same factor it falls. So it is
    smallest where one radius is largest, and the other is at an end or where the derivative vanishes.
    """
    first, second = (scene.bodies[name] for name in (meeting.first, meeting.second))
    if first.sizes is None:
        raise ValueError(f"{meeting.first} is a wall: expected a sphere as the first body")
    if second.sizes is None:
        yield from ((radius, None) for radius in first.sizes.ends)
        return
    yield from ((a, b) for a in first.sizes.ends for b in second.sizes.ends)
    # The radius at which the derivative vanishes, if the other body has its largest one: R = R_fixed/s. The ratio of
    # densities is that of the other body to this one.
    density = [scene.sphere(name).density for name in (meeting.first, meeting.second)]
    a = second.sizes.largest / _stationary(density[1] / density[0])
    b = first.sizes.largest / _stationary(density[0] / density[1])
    if first.sizes.least < a < first.sizes.largest:
        yield a, second.sizes.largest
    if second.sizes.least < b < second.sizes.largest:
        yield first.sizes.largest, b


def _stationary(density_ratio: float) -> float:
    """Return s = R_fixed/R at which d ln(sqrt(R_eff)/m_eff)/d ln R = 0: 1/2 = c s^2 (3 + 5/2 s), c = density_ratio."""
    # R_eff = R R_f/(R + R_f) and 1/m_eff ~ 1/R^3 + 1/(c R_f^3) give this equation. 5/2 c s^3 + 3 c s^2 - 1/2 = 0 has
    # one positive root; the others are negative or complex. A computed root counts as real if its imaginary part is
    # below 1e-9 of it: round-off is 1e-16.
    c = density_ratio
    roots = np.roots([2.5 * c, 3 * c, 0, -0.5])
    return float(max(root.real for root in roots if abs(root.imag) < 1e-9 * abs(root)))


def mean_free_time(scene: Scene, encounter: Encounter) -> float | None:
    """Return the mean free time in a gas of these spheres (Enskog), or None without a volume fraction or at a wall.

    The gas is that of the scene, and its spheres are those of the encounter. With the granular temperature T it is
    1/(4 n d^2 g sqrt(pi T)), and else 1/(n pi d^2 g v) with the fastest speed v. g is Carnahan and Starling's pair
    correlation at contact.
    """
    phi = scene.volume_fraction
    if phi is None or encounter.pair.second.is_wall:
        return None
    # The radius r of equal spheres with this R_eff = r/2: the harmonic mean of both radii.
    radius = encounter.pair.R_eff * 2
    # g = (1 - phi/2)/(1 - phi)^3, and the volume for each sphere is 1/n = (4/3) pi r^3/phi.
    g = (1 - phi / 2) / (1 - phi) ** 3
    volume = 4 / 3 * math.pi * radius**3 / phi
    temperature, fastest = encounter.speeds.temperature, encounter.speeds.fastest
    # The free time is 1/(n d^2 g rate), d = 2 r, with the rate pi v, or 4 sqrt(pi T) in a gas of temperature T.
    rate = math.pi * fastest if temperature is None else 4 * math.sqrt(math.pi * temperature)
    return volume / ((2 * radius) ** 2 * g * rate)
