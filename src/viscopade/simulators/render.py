"""The text for a simulator, by its name."""

from __future__ import annotations

import sys
from collections.abc import Callable, Mapping

from viscopade.simulators import TARGETS, lammps, liggghts, mercurydpm, rebound, yade
from viscopade.simulators.setup import Setup

_RENDERERS: Mapping[str, Callable[[Setup, str, str], str]] = {
    "lammps": lambda setup, command, tier: lammps.render(setup, command),
    "rebound-c": lambda setup, command, tier: rebound.render(setup, command, "c", tier),
    "rebound-python": lambda setup, command, tier: rebound.render(setup, command, "python", tier),
    "mercurydpm": lambda setup, command, tier: mercurydpm.render(setup, command),
    "yade": lambda setup, command, tier: yade.render(setup, command),
    "liggghts": lambda setup, command, tier: liggghts.render(setup, command),
}


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
        Accuracy of the kernel that REBOUND gets, one of `names.TIERS`.

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
