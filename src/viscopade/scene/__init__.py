"""From a description of a simulation to the cheapest kernel that is good enough for it.

>>> from viscopade import scene
>>> found = scene.choose(scene.from_toml(open("examples/acetate.toml", "rb").read(), "acetate.toml"))  # doctest: +SKIP
>>> found.chosen.candidate.label  # doctest: +SKIP
'a constant'
"""

from viscopade.scene.choice import Choice, choose
from viscopade.scene.description import Scene
from viscopade.scene.read import scene as from_toml

__all__ = ["Choice", "Scene", "choose", "from_toml"]
