"""Limits of the model in a scene: hard spheres, Hertz's theory, slow impacts, elastic material."""

from __future__ import annotations

import math
from collections.abc import Iterator

from viscopade.collision.spheres import Pair
from viscopade.scene.description import Scene
from viscopade.scene.encounter import Encounter, mean_free_time

LONGEST_CONTACT = 0.05  # of the mean free time
LARGEST_OVERLAP = 0.03  # of the smaller radius
NEAR_YIELD = 0.5  # of the speed at which the material yields
SOUND_CROSSINGS = 5  # of the smaller sphere, that a contact should last at least
LONGEST_RELAXATION = 0.3  # A over the contact time
YIELD_PRESSURE = 1.6  # largest pressure in the contact at first yield, over the yield strength (Hertz, von Mises)


def warnings(scene: Scene, encounter: Encounter) -> Iterator[str]:
    """Yield a sentence for each assumption of the model that the scene violates."""
    for check in (_hardness, _depth, _yielding, _slowness, _relaxation):
        yield from (f"{encounter.name}: {text}" for text in check(scene, encounter))


def _hardness(scene: Scene, encounter: Encounter) -> Iterator[str]:
    free = mean_free_time(scene, encounter)
    if free is None:
        return
    share = encounter.contact_time / free
    if share > LONGEST_CONTACT:
        yield (
            f"contacts last {share:.2g} of the mean free time ({free:.2g} s), more than {LONGEST_CONTACT:g}: "
            "the model of instantaneous collisions of two bodies does not hold"
        )


def _depth(scene: Scene, encounter: Encounter) -> Iterator[str]:
    if encounter.overlap > LARGEST_OVERLAP:
        yield (
            f"the overlap reaches {encounter.overlap:.2g} of the radius, more than {LARGEST_OVERLAP:g}: Hertz's theory "
            "is for small contacts"
        )


def _yielding(scene: Scene, encounter: Encounter) -> Iterator[str]:
    strengths = [
        strength
        for name in (encounter.meeting.first, encounter.meeting.second)
        if (strength := scene.materials[scene.bodies[name].material].yield_strength) is not None
    ]
    if not strengths:
        return
    limit = yield_speed(encounter.pair, min(strengths))
    if encounter.speeds[2] > NEAR_YIELD * limit:
        beyond = "beyond" if encounter.speeds[2] > limit else "near"
        yield (
            f"{encounter.speeds[2]:.3g} m/s is {beyond} the {limit:.3g} m/s at which the material begins to yield: eps "
            "then falls faster, as plastic work is not in the model"
        )


def yield_speed(pair: Pair, strength: float) -> float:
    """Return the impact speed at which the Hertzian pressure reaches `YIELD_PRESSURE` times the strength.

    p = 2 E_eff/pi sqrt(xi/R_eff), and m_eff v^2/2 = 8/15 E_eff R_eff^(1/2) xi^(5/2) without dissipation.
    """
    try:
        xi = pair.R_eff * (YIELD_PRESSURE * strength * math.pi / (2 * pair.E_eff)) ** 2
        return math.sqrt(16 / 15 * pair.E_eff * math.sqrt(pair.R_eff) * xi**2.5 / pair.m_eff)
    except OverflowError:  # stronger than any impact
        return math.inf


def _slowness(scene: Scene, encounter: Encounter) -> Iterator[str]:
    pair, fastest = encounter.pair, encounter.speeds[2]
    crossing = min(
        2 * s.radius / math.sqrt(s.young_modulus / s.density) for s in (pair.first, pair.second) if not s.is_wall
    )
    duration = float(pair.contact_time(fastest))
    if duration < SOUND_CROSSINGS * crossing:
        yield (
            f"at {fastest:.3g} m/s the contact lasts {duration / crossing:.2g} times as long as sound takes through "
            f"the sphere, less than {SOUND_CROSSINGS} times: waves carry energy away, the theory is quasi-static"
        )


def _relaxation(scene: Scene, encounter: Encounter) -> Iterator[str]:
    pair = encounter.strongest
    share = pair.A / float(pair.contact_time(encounter.speeds[2]))
    if share > LONGEST_RELAXATION:
        yield (
            f"A is {share:.2g} of the contact time at {encounter.speeds[2]:.3g} m/s, more than {LONGEST_RELAXATION:g}: "
            "the law of force is the first order in A over the duration"
        )
