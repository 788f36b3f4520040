"""Limits of the model in a scene: assumptions on pairs of bodies, instantaneous collisions, measured damping."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import replace
from typing import NamedTuple

from viscopade.collision import limits
from viscopade.collision.spheres import restitution_error
from viscopade.collision.weight import COUNTS, EARTH
from viscopade.quantity import uncertain
from viscopade.scene.description import Meeting, Scene
from viscopade.scene.encounter import Encounter, mean_free_time, scene_encounters
from viscopade.scene.tolerance import in_eps
from viscopade.simulators.setup import Setup

# Contact time over mean free time, up to which collisions count as instantaneous. The share is about the probability
# that a third body arrives during a contact; 5 % of them were chosen by hand.
LONGEST_CONTACT = 0.05
# Error of a kernel over the standard error of eps, below which it does not matter: errors add in squares, and a tenth
# makes the error of eps 0.5 % larger.
NEEDLESS = 0.1
# A of a contact over that of the damped one of its two materials, from which the other one, without damping, does not
# matter: 1 - eps is smaller by a tenth. Chosen by hand.
_NEARLY_ALL = 0.9


class WeightEffect(NamedTuple):
    """A note on the weight of a body that falls on a wall, and a warning if it matters."""

    note: str
    warning: str | None


def warnings(scene: Scene, encounter: Encounter) -> Iterator[str]:
    """Yield a sentence for each assumption of the model that the scene violates for the bodies of an encounter."""
    # The lower of the two yield strengths; below None stands for none that is known.
    bodies = (scene.bodies[name] for name in (encounter.meeting.first, encounter.meeting.second))
    strengths = (scene.materials[body.material].yield_strength for body in bodies)
    yield_strength = min((strength for strength in strengths if strength is not None), default=None)
    pair, fastest = encounter.pair, encounter.speeds.fastest
    # Assumptions on the two bodies alone; before them, the one on a third body that may arrive during a contact.
    texts = [*limits.violations(pair, fastest, strongest=encounter.strongest, yield_strength=yield_strength)]
    free_time = mean_free_time(scene, encounter)
    if free_time is not None and (share := encounter.contact_time / free_time) > LONGEST_CONTACT:
        texts.insert(
            0,
            f"contacts last {share:.2g} of the mean free time ({free_time:.2g} s), more than {LONGEST_CONTACT:g}: "
            "instantaneous collisions of two bodies are not a good model",
        )
    yield from (f"{encounter.name}: {text}" for text in texts)
    yield from undamped(scene, encounter.meeting)


def undamped(scene: Scene, meeting: Meeting) -> Iterator[str]:
    """Yield a sentence if one of two materials has A = 0 and makes A of their contact much smaller than the other's."""
    names = [scene.bodies[name].material for name in (meeting.first, meeting.second)]
    # A of a contact with its own does not follow from the materials.
    no_damping, damped = sorted(names, key=lambda name: scene.materials[name].dissipative_constant or 0.0)
    largest = scene.materials[damped].dissipative_constant
    if meeting.dissipative_constant is not None or scene.materials[no_damping].dissipative_constant or not largest:
        return
    share = scene.pair(meeting).A / largest
    if share < _NEARLY_ALL:
        yield (
            f"{meeting.name}: {no_damping} has A = 0, so that A of this contact is {100 * share:.2g} % of that of "
            f"{damped}, and eps is larger; an eps measured at this contact belongs in [[contact]]"
        )


def notes(scene: Scene, encounter: Encounter) -> Iterator[str]:
    """Yield sentences on the uncertainty of eps of an encounter, if that of A is known, and on a needless tolerance."""
    relative = scene.relative_error(encounter.meeting)
    if relative is None:
        return
    # eps of the typical pair at the typical speed, and its standard error |d eps/d ln A| sigma_A/A
    speed = encounter.contact().typical
    epsilon = float(encounter.pair.epsilon(speed))
    error = restitution_error(float(encounter.pair.v_star(speed)), relative)
    percent = 100 * relative
    yield (
        f"{encounter.name}: eps at {speed:.3g} m/s is {uncertain(epsilon, error)} (standard "
        f"error), because A is known to {percent:.2g} %"
    )
    # The smallest error of eps that a tolerance allows, if there is one. The sentence comes only below half of what is
    # enough, so that whoever follows it does not read it again after rounding.
    limits_of_eps = (limit * in_eps(name, epsilon, 1 - epsilon) for name, limit in scene.tolerance.limits().items())
    allowed = min(limits_of_eps, default=0.0)
    if 0 < allowed < NEEDLESS * error / 2:
        yield (
            f"{encounter.name}: the tolerance is needlessly small: it allows an error of eps of {allowed:.2g}, but the "
            f"standard error of eps is {error / allowed:.2g} times larger; absolute = {NEEDLESS * error:.1g} is enough"
        )


def weight(encounter: Encounter) -> WeightEffect | None:
    """Return what the weight of a body that falls on a wall does; None for two spheres."""
    # It matters if g t_c/v at the slowest impact is COUNTS or more.
    contact = encounter.contact()
    if not contact.falls:
        return None
    share, slowest = contact.falling.share(contact.slowest), contact.slowest
    note, matters = contact.falling.note(slowest, contact.fastest), f"g t_c/v is {share:.2g} at {slowest:.4g} m/s"
    warning = f"a body that falls on a plane gets a lower eps, as {matters}: `viscopade table` with --gravity prints it"
    return WeightEffect(f"{encounter.name}: {note}", f"{encounter.name}: {warning}" if share >= COUNTS else None)


def setup(scene: Scene, gravity: float | None = None, *, classes: bool = False) -> Setup:
    """Return bodies and contacts for simulators, in the scene's units, and the warnings.

    Parameters
    ----------
    scene : Scene
    gravity : float, optional
        In SI units.
    classes : bool
        Whether each class of sizes becomes a body. Warnings and notes are those of all sizes together in any case.
    """
    encounters, scale, g = scene_encounters(scene), scene.scale, EARTH if gravity is None else gravity
    # Bodies of simulators are types: with classes, each class is a type of its own, and a note says what it is.
    typed = scene.by_classes() if classes else scene
    class_notes = (
        f"{name}_1 to {name}_{body.sizes.classes} are the classes of sizes of {name}: the ends of each have one ratio, "
        "and R is their geometric mean"
        for name, body in scene.bodies.items()
        if classes and body.sizes is not None and body.sizes.classes > 1
    )
    sizes = {name: body.sizes for name, body in typed.bodies.items() if body.sizes is not None and body.sizes.spread}
    return Setup(
        scene.title,
        {name: scale.sphere(typed.sphere(name)) for name in typed.bodies},
        tuple(scale.contact(replace(encounter.contact(), gravity=g)) for encounter in scene_encounters(typed)),
        scene.units,
        tuple(text for encounter in encounters for text in warnings(scene, encounter)),
        (*(text for encounter in encounters for text in notes(scene, encounter)), *class_notes),
        gravity is not None,
        {name: (size.least / scale.length, size.largest / scale.length) for name, size in sizes.items()},
    )
