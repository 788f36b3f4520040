"""What simulators get of a scene: its bodies and contacts in its units, with the warnings on it."""

from __future__ import annotations

from dataclasses import replace

from viscopade.collision.weight import EARTH
from viscopade.scene import sense
from viscopade.scene.description import Scene
from viscopade.scene.encounter import encounters
from viscopade.simulators.setup import Setup


def setup(scene: Scene, gravity: float | None = None) -> Setup:
    """Return the bodies and contacts of a scene in its units; gravity in SI units."""
    met, scale, g = encounters(scene), scene.scale, EARTH if gravity is None else gravity
    return Setup(
        scene.title,
        {name: scale.sphere(scene.sphere(name)) for name in scene.bodies},
        tuple(scale.contact(replace(encounter.contact(), gravity=g)) for encounter in met),
        scene.units,
        tuple(text for encounter in met for text in sense.warnings(scene, encounter)),
        tuple(text for encounter in met for text in sense.notes(scene, encounter)),
        gravity is not None,
    )
