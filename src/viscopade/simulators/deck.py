"""A deck: the file that a person runs, with all its contacts.

A reader makes a `Deck` of a file: `lammps_deck.read_input` of an input of LAMMPS or LIGGGHTS,
`mujoco_model.read_model` of a model of MuJoCo. A deck says of each contact which parameters of the program's `Native`
it has; the collisions are computed as those of `viscopade audit SIMULATOR --set`.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass, field
from pathlib import Path
from typing import NamedTuple

from viscopade.simulators.native import FileUnits
from viscopade.simulators.simulator import Simulator


class Line(NamedTuple):
    """Where a command stands: the file, the number of its first line, and its text after substitution."""

    file: Path
    number: int
    text: str


class Size(NamedTuple):
    """Radius and mass of a sphere, in the units of the file; a radius of None where no law needs it."""

    radius: float | None
    mass: float


TSUJI_2026 = "tsuji (2026)"
"""Our name for LAMMPS's `damping tsuji` in releases that multiply it by sqrt(2)."""
LinesWith = Callable[[Mapping[str, str]], tuple[str, ...]]
# A mark of contacts with a plane that gravity does not meet along its normal.
INCLINED = "on an inclined plane only the part of the weight along its normal presses"


@dataclass(frozen=True)
class DeckContact:
    """A contact of two kinds of bodies, or of one and a wall.

    Attributes
    ----------
    name : str
        Both bodies, as the file calls them: "type 1 - type 2", "type 1 - wall floor", "ball - table".
    line : Line
        The command that decides the contact.
    settings : mapping of str to str
        Texts of the parameters of the program's `Native`, without those of the run.
    sizes : tuple of (Size, Size or None)
        The pairs of sizes that touch; None for a wall, or the ground, which does not move. Of a range of sizes they are
        smallest-smallest, smallest-largest and largest-largest.
    falls : float
        The part of the weight that presses the bodies together: 1 if one of them is a wall or the ground, the cosine on
        an inclined plane, 0 if both fall.
    count : int
        How many pairs of bodies of the file have this contact.
    reason : str
        Why there is no number; "" if there is one.
    marks : tuple of str
        What a reader of the row has to know, such as "mixed from the lines of each type" or "geom on a jointed body".
    lines_with : callable
        From texts of parameters, by name, to the lines of this file that have them.
    """

    name: str
    line: Line
    settings: Mapping[str, str]
    sizes: tuple[tuple[Size, Size | None], ...]
    falls: float = 0.0
    count: int = 1
    reason: str = ""
    marks: tuple[str, ...] = ()
    lines_with: LinesWith = field(default=lambda settings: (), compare=False)


@dataclass(frozen=True)
class DeckRun:
    """A part of the file in which contacts, time step and gravity stay the same.

    Attributes
    ----------
    line : Line or None
        The command `run`, or `minimize`; None if the file has none, or needs none.
    step : float or None
        Time step, in the units of the file.
    gravity : float
        Acceleration, in the units of the file; 0 without one.
    contacts : tuple of DeckContact
    """

    line: Line | None
    step: float | None
    gravity: float
    contacts: tuple[DeckContact, ...]


@dataclass(frozen=True)
class Deck:
    """What a file says of contacts.

    Attributes
    ----------
    program : Simulator
    file : Path
    units : FileUnits
    runs : tuple of DeckRun
        Those whose contacts, time step or gravity differ from the one before.
    missing : tuple of str
        What the file does not say, each with the option that says it: "the density of type 1 (--density 1=2500)".
    unread : tuple of Line
        Other commands that were not read, each kind once.
    warnings : tuple of str
        Sentences, without their full stops, such as on commands of cohesion that change eps.
    """

    program: Simulator
    file: Path
    units: FileUnits
    runs: tuple[DeckRun, ...]
    missing: tuple[str, ...] = ()
    unread: tuple[Line, ...] = ()
    warnings: tuple[str, ...] = ()


@dataclass(frozen=True)
class DeckOptions:
    """What the command line says of a deck, beside its file.

    Attributes
    ----------
    variables : mapping of str to str
        Texts by the name of a variable, as LAMMPS's `-var NAME VALUE`.
    radii : mapping of str to tuple of float
        By the name of a type: one radius, or the least and the largest, in metres.
    densities : mapping of str to float
        By the name of a type, in kg/m^3.
    tsuji_is_new : bool
        Whether `damping tsuji` is that of a release of LAMMPS with the factor sqrt(2).
    """

    variables: Mapping[str, str] = field(default_factory=dict)
    radii: Mapping[str, tuple[float, ...]] = field(default_factory=dict)
    densities: Mapping[str, float] = field(default_factory=dict)
    tsuji_is_new: bool = False
