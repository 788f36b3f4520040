"""Limits of the model in a scene: assumptions on pairs of bodies, instantaneous collisions, measured damping."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import replace

from viscopade.collision import limits
from viscopade.collision.spheres import restitution_error
from viscopade.collision.weight import COUNTS, EARTH
from viscopade.quantity import uncertain
from viscopade.scene.description import Scene
from viscopade.scene.encounter import Encounter, encounters, mean_free_time
from viscopade.scene.tolerance import in_eps
from viscopade.simulators.setup import Setup

# Contact time over mean free time, up to which collisions count as instantaneous; a choice, of a few per cent.
LONGEST_CONTACT = 0.05
NEEDLESS = 0.1  # error of a kernel over the standard error of eps, below which it does not matter; a choice


def warnings(scene: Scene, encounter: Encounter) -> Iterator[str]:
    """Yield a sentence for each assumption of the model that the scene violates."""
    bodies = (scene.bodies[name] for name in (encounter.meeting.first, encounter.meeting.second))
    strengths = (scene.materials[body.material].yield_strength for body in bodies)
    yield_strength = min((strength for strength in strengths if strength is not None), default=None)
    pair, fastest = encounter.pair, encounter.speeds.fastest
    # Assumptions on the two bodies alone, then on the third one that may arrive during a contact.
    texts = [*limits.violations(pair, fastest, strongest=encounter.strongest, yield_strength=yield_strength)]
    free = mean_free_time(scene, encounter)
    if free is not None and (share := encounter.contact_time / free) > LONGEST_CONTACT:
        texts.insert(
            0,
            f"contacts last {share:.2g} of the mean free time ({free:.2g} s), more than {LONGEST_CONTACT:g}: "
            "instantaneous collisions of two bodies are not a good model",
        )
    yield from (f"{encounter.name}: {text}" for text in texts)


def notes(scene: Scene, encounter: Encounter) -> Iterator[str]:
    """Yield sentences on the uncertainty of eps, if that of A is known, and on a needlessly small tolerance."""
    relative = scene.relative_error(encounter.meeting)
    if relative is None:
        return
    speed = encounter.contact().typical
    value, error = (
        float(encounter.pair.epsilon(speed)),
        restitution_error(float(encounter.pair.v_star(speed)), relative),
    )
    yield (
        f"{encounter.name}: eps at {speed:.3g} m/s is {uncertain(value, error)} (standard "
        f"error), because A is known to {100 * relative:.2g} %"
    )
    # The tolerance that allows the smallest error of eps. The sentence comes only below half of what is enough.
    tightest = min(scene.tolerance.limits().items(), key=lambda limit: limit[1] * in_eps(limit[0], value, 1 - value))
    allowed = tightest[1] * in_eps(tightest[0], value, 1 - value)
    if 0 < allowed < NEEDLESS * error / 2:
        yield (
            f"{encounter.name}: the tolerance is needlessly small: it allows an error of eps of {allowed:.2g}, but the "
            f"standard error of eps is {error / allowed:.2g} times larger; absolute = {NEEDLESS * error:.1g} is enough"
        )


def weight(encounter: Encounter) -> tuple[str, str | None] | None:
    """Return a note on the weight of a body that falls on a wall, and a warning if it matters; None for two spheres."""
    contact = encounter.contact()
    if not contact.falls:
        return None
    share, slowest = contact.falling.share(contact.slowest), contact.slowest
    note, matters = contact.falling.note(slowest, contact.fastest), f"g t_c/v is {share:.2g} at {slowest:.4g} m/s"
    warning = f"a body that falls on a plane gets a lower eps, as {matters}: `viscopade table` with --gravity prints it"
    return f"{encounter.name}: {note}", f"{encounter.name}: {warning}" if share >= COUNTS else None


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
    met, scale, g = encounters(scene), scene.scale, EARTH if gravity is None else gravity
    typed = scene.by_classes() if classes else scene
    divisions = (
        f"{name}_1 to {name}_{body.sizes.classes} are the classes of sizes of {name}: the ends of each have one ratio, "
        "and R is their geometric mean"
        for name, body in scene.bodies.items()
        if classes and body.sizes is not None and body.sizes.classes > 1
    )
    sizes = {name: body.sizes for name, body in typed.bodies.items() if body.sizes is not None and body.sizes.spread}
    return Setup(
        scene.title,
        {name: scale.sphere(typed.sphere(name)) for name in typed.bodies},
        tuple(scale.contact(replace(encounter.contact(), gravity=g)) for encounter in encounters(typed)),
        scene.units,
        tuple(text for encounter in met for text in warnings(scene, encounter)),
        (*(text for encounter in met for text in notes(scene, encounter)), *divisions),
        gravity is not None,
        {name: (size.least / scale.length, size.largest / scale.length) for name, size in sizes.items()},
    )
