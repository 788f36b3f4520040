"""Our answer in the parameters of simulators: LAMMPS, REBOUND, MercuryDPM, YADE and LIGGGHTS."""

from __future__ import annotations

import sys
from collections.abc import Callable, Mapping

from viscopade.model import Pair
from viscopade.simulators import lammps, liggghts, mercurydpm, rebound, yade
from viscopade.simulators.setup import Contact, Setup

__all__ = ["TARGETS", "of_pair", "render"]

_RENDERERS: Mapping[str, Callable[[Setup, str, str], str]] = {
    "lammps": lambda setup, command, tier: lammps.render(setup, command),
    "rebound-c": lambda setup, command, tier: rebound.render(setup, command, "c", tier),
    "rebound-python": lambda setup, command, tier: rebound.render(setup, command, "python", tier),
    "mercurydpm": lambda setup, command, tier: mercurydpm.render(setup, command),
    "yade": lambda setup, command, tier: yade.render(setup, command),
    "liggghts": lambda setup, command, tier: liggghts.render(setup, command),
}

TARGETS = tuple(_RENDERERS)


def render(target: str, setup: Setup, command: str, tier: str = "1e-5") -> str:
    """Return the text for a simulator.

    Parameters
    ----------
    target : str
        One of `TARGETS`.
    setup : Setup
        Bodies, contacts and speeds.
    command : str
        The command line that makes the text.
    tier : str
        Accuracy of the kernel that REBOUND gets, one of `kernels.speed.TIERS`.

    Raises
    ------
    ValueError
        For an unknown target, or contacts that the simulator cannot have.
    """
    if target not in TARGETS:
        raise ValueError(f"target is {target!r}: accepted are {', '.join(TARGETS)}")
    for contact in setup.contacts:
        for pair in (contact.pair, *contact.extremes):
            # Where eps is no normal number, errors relative to it would be infinite.
            if float(pair.epsilon(contact.fastest)) < sys.float_info.min:
                raise ValueError(
                    f"{contact.name}: eps is too small for double precision at the fastest impact, with v* = "
                    f"{float(pair.v_star(contact.fastest)):.3g}: accepted is less damping, or slower impacts"
                )
    return _RENDERERS[target](setup, command, tier)


def of_pair(pair: Pair, speed: float) -> Setup:
    """Return the setup of one pair at one speed, in SI units."""
    if pair.second.is_wall:
        bodies = {"ball": pair.first, "wall": pair.second}
    elif pair.first == pair.second:
        bodies = {"ball": pair.first}
    else:
        bodies = {"first": pair.first, "second": pair.second}
    names = list(bodies)
    contact = Contact(names[0], names[-1], pair, speed, speed, speed)
    return Setup(
        "Two spheres" if len(bodies) == 1 or not pair.second.is_wall else "A ball and a wall", bodies, (contact,)
    )
