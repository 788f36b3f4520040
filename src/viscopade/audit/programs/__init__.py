"""Programs with a formula from a wanted eps to damping: one module a program, with one object, PROGRAM."""

from __future__ import annotations

from viscopade.audit.program import Program
from viscopade.audit.programs import (
    chrono,
    drake,
    jaxdem,
    kratos,
    lammps,
    liggghts,
    mercurydpm,
    mujoco,
    rebound,
    simbody,
    textbook,
    yade,
)

__all__ = ["liggghts"]

PROGRAMS: tuple[Program, ...] = tuple(
    module.PROGRAM
    for module in (
        lammps,
        liggghts,
        yade,
        mercurydpm,
        rebound,
        mujoco,
        drake,
        simbody,
        chrono,
        kratos,
        jaxdem,
        textbook,
    )
)


def program_of(name: str) -> Program:
    """Return the program of a name.

    Raises
    ------
    ValueError
        If there is none.
    """
    found = {program.name: program for program in PROGRAMS}
    if name not in found:
        raise ValueError(f"program is {name!r}: accepted is {', '.join(found)}")
    return found[name]
