"""Simulators: the eps that other programs give, and our answer in their own parameters; one module for each.

To add one is to write its module here, with one object SIMULATOR, and to list it.
"""

from __future__ import annotations

from collections.abc import Mapping
from importlib import import_module
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from viscopade.simulators.simulator import Simulator

__all__ = [
    "audit",
    "deck",
    "deck_rows",
    "formula",
    "input_file",
    "lammps_deck",
    "mujoco_model",
    "native",
    "own_law",
    "setup",
    "simulator",
    "textbook",
    "typed_force",
]

SIMULATORS: Mapping[str, tuple[str, ...]] = {
    "lammps": ("lammps",),
    "liggghts": ("liggghts",),
    "yade": ("yade",),
    "mercurydpm": ("mercurydpm",),
    "rebound": ("rebound-c", "rebound-python"),
    "mujoco": ("mujoco",),
    "drake": ("drake",),
    "simbody": ("simbody",),
    "chrono": ("chrono",),
    "kratos": (),
    "jaxdem": ("jaxdem",),
    "newton": (),
    "openfoam": (),
    "lethe": (),
    "mfix": (),
    "trixi": (),
    "physx": (),
    "bullet": (),
    "jolt": (),
    "box2d": (),
    "ode": (),
    "gazebo": (),
    "bepu": (),
    "phasicflow": (),
    "demengine": (),
    "jaxsim": (),
    "textbook": (),
}
"""Names, which are those of the modules except for `SEVERAL`, and the targets for which `viscopade simulators` writes
each one's text."""
TARGETS = tuple(target for targets in SIMULATORS.values() for target in targets)
SEVERAL = {
    **dict.fromkeys(("physx", "bullet", "jolt", "box2d"), "impulse"),
    **dict.fromkeys(("ode", "gazebo", "bepu"), "soft"),
}
"""Modules with several simulators, by the simulators' names."""
OTHER_NAMES: Mapping[str, str] = {
    "physx": "isaac isaacsim isaaclab isaacgym omniverse sapien maniskill unity",
    "jolt": "godot joltphysics",
    "box2d": "planck liquidfun",
    "bullet": "pybullet",
    "gazebo": "gazebo-classic gzserver",
    "gazebo or bullet": "ignition gz-sim",
    "ode": "opende ode4j pyode open-dynamics-engine",
    "mujoco": "mjx dm_control gymnasium",
    "simbody": "opensim",
    "newton": "warp newton-physics",
    "phasicflow": "pflow phasic-flow",
    "bepu": "bepuphysics bepuphysics2 stride",
    "demengine": "dem-engine dem_engine deme pydeme",
}
"""Programs, and what people type who mean them."""
OWN_LAW = ("mujoco", "drake", "simbody", "chrono", "jaxdem")
"""Targets whose contacts have a law of their own; those of the others are viscoelastic."""
TYPED = ("lammps", "liggghts", "yade", "mercurydpm")
"""Targets whose bodies are types, materials or species: one for each class of sizes."""


def simulator_of(name: str) -> Simulator:
    """Return the simulator called `name`, a key of `SIMULATORS`; its module is imported here.

    Raises
    ------
    ValueError
        If there is none.
    """
    if name not in SIMULATORS:
        raise ValueError(f"program is {name!r}: expected {', '.join(SIMULATORS)}")
    # A module of several simulators has them by name in SIMULATORS; any other has its one in SIMULATOR.
    module = import_module(f"{__name__}.{SEVERAL.get(name, name)}")
    simulator: Simulator = module.SIMULATORS[name] if name in SEVERAL else module.SIMULATOR
    return simulator


def simulators() -> tuple[Simulator, ...]:
    """Return all simulators, in the order of `SIMULATORS`."""
    return tuple(map(simulator_of, SIMULATORS))


def simulator_with(target: str) -> Simulator:
    """Return the simulator that has the target, such as "rebound-c" for REBOUND."""
    return simulator_of(next(name for name, targets in SIMULATORS.items() if target in targets))
