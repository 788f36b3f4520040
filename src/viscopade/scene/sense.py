"""Limits of the model in a scene: those of a pair of bodies, and hard spheres."""

from __future__ import annotations

from collections.abc import Iterator

from viscopade.collision import limits
from viscopade.scene.description import Scene
from viscopade.scene.encounter import Encounter, mean_free_time

LONGEST_CONTACT = 0.05  # of the mean free time


def warnings(scene: Scene, encounter: Encounter) -> Iterator[str]:
    """Yield a sentence for each assumption of the model that the scene violates."""
    bodies = (scene.bodies[name] for name in (encounter.meeting.first, encounter.meeting.second))
    strengths = (scene.materials[body.material].yield_strength for body in bodies)
    known = min((strength for strength in strengths if strength is not None), default=None)
    found = limits.violations(encounter.pair, encounter.speeds[2], strongest=encounter.strongest, yield_strength=known)
    yield from (f"{encounter.name}: {text}" for text in (*_hardness(scene, encounter), *found))


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
