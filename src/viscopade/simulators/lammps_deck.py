"""The reader of inputs of LAMMPS and LIGGGHTS: what each run of a file says of its contacts.

    units           si
    variable        e index 0.5
    pair_style      granular
    pair_coeff      * * hertz/material 1e7 ${e} 0.3 tangential mindlin NULL 1 0.5 damping coeff_restitution
    fix             floor all wall/gran granular hertz 1e7 20 tangential mindlin 1e6 1 0.5 zplane 0 NULL
    fix             ins all pour 1000 1 4767 region above diam range 0.001 0.002 dens 2500 2500
    run             10000

Commands are taken in their order, as LAMMPS does (`Input::execute_command` of commit 07b704c): a later one replaces an
earlier one, and a run has what holds in its line. Files are sought beside the input. Nothing of the file is run: no
shell, no Python, no jump, if or loop.
"""

from __future__ import annotations

import itertools
import math
import re
from collections.abc import Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass, field
from pathlib import Path
from typing import NamedTuple

from viscopade import files
from viscopade.simulators import lammps, liggghts
from viscopade.simulators.deck import Deck, DeckContact, Line, Run, Said, Size
from viscopade.simulators.lammps import Ends, GranularLine, OtherModel, granular_line
from viscopade.simulators.lammps_variables import Unsaid, Variables
from viscopade.simulators.liggghts import ModelLine, model_line

_MOST_SIZES = 6  # of one type that make a row each; more make a range
_MOST_TYPES = 100  # with spheres
_MOST_RUNS = 1000  # that differ
_UNKNOWN: Ends = ((None, None),)
_DEFAULT_SPHERE: Ends = ((0.5, 1.0),)  # `AtomVecSphere::create_atom_post`

_LIGGGHTS = re.compile(
    r"^[ \t]*(?:pair_style\s+(?:hybrid\s.*)?gran\s|soft_particles\s"
    r"|fix\s.*\s(?:property/global|particletemplate/|insert/|mesh/|wall/gran\s+model|wall/gran/h))",
    re.MULTILINE,
)
"""Commands that LAMMPS does not have."""
_SIZES = ("units", "atom_style", "dimension", "create_box", "create_atoms", "read_data", "read_restart", "set", "clear")
_DECIDING = frozenset((*_SIZES, "timestep", "pair_style", "pair_coeff", "unfix", "run", "minimize"))
_DECIDING_FIXES = (
    *("gravity", "wall/gran", "mesh/surface", "mesh/gran", "property/global", "pour", "deposit", "insert/"),
    *("particletemplate/", "particledistribution/"),
)
_RIGID = "contacts of rigid bodies have the mass of the body, not of its sphere"
_WARNED_FIXES = {
    "rigid": _RIGID,
    "multisphere": _RIGID,
    "freeze": "a contact with a frozen sphere has the mass of the other",
    "adapt": "it changes sizes or contacts during a run",
    "dt/reset": "it changes the time step during a run",
    "multicontact": "it changes the force of a contact by those of its neighbours",
    "bond": "bonds add forces",
}
_SILENT_FIXES = ("nve", "ave/", "print", "balance", "enforce2d", "property/atom", "heat/", "check/timestep", "halt")
_SILENT = frozenset(
    (
        *("angle_style", "atom_modify", "balance", "bond_style", "boundary", "change_box", "comm_modify", "comm_style"),
        *("communicate", "compute", "compute_modify", "dump", "dump_modify", "echo", "info", "log", "neigh_modify"),
        *("neighbor", "newton", "package", "pair_modify", "print", "processors", "reset_timestep", "restart", "thermo"),
        *("soft_particles", "special_bonds", "suffix", "thermo_modify", "thermo_style", "timer", "uncompute", "undump"),
        *("velocity", "write_data", "write_dump", "write_restart"),
    )
)
_NO_STYLES = ("NULL", "limit_damping")  # words of a pair_style hybrid that are no names of sub-styles
_SET = ("diameter", "density", "density/disc", "mass", "type", "type/fraction", "type/ratio", "type/subset")

AnyLine = GranularLine | ModelLine


class _Grain(NamedTuple):
    """Spheres of one type, and the selections of `set region`, `set atom` and the like to which they belong."""

    ends: Ends
    selections: frozenset[tuple[str, str]] = frozenset()


class _Coefficients(NamedTuple):
    """A line pair_coeff, and its contact; None if its sub-style has none."""

    style: str
    line: Line
    contact: AnyLine | None


class _Fix(NamedTuple):
    line: Line
    words: list[str]
    contact: AnyLine | None


@dataclass
class _State:
    """What the program has after a line; the command `clear` makes a new one."""

    units: str = "lj"
    step: float | None = None
    atom_style: str = ""
    dimension: str = "3"
    types: int = 0
    pair_style: str = ""
    styles: dict[str, AnyLine | None] = field(default_factory=dict)
    style_line: Line | None = None
    coefficients: dict[tuple[range, range, str], _Coefficients] = field(default_factory=dict)
    fixes: dict[str, _Fix] = field(default_factory=dict)
    groups: dict[str, tuple[range, ...]] = field(default_factory=lambda: {"all": (_types("*"),)})
    regions: dict[str, list[str]] = field(default_factory=dict)
    has_lattice: bool = False
    grains: dict[int, dict[_Grain, None]] = field(default_factory=dict)


def read(path: Path, said: Said) -> Deck:
    """Return what an input of LAMMPS or LIGGGHTS says of its contacts.

    Parameters
    ----------
    path : Path
    said : Said
        A variable of it replaces all definitions in the file, and a radius or density all those of its type.

    Raises
    ------
    ValueError
        If the file cannot be read, has a word or number that is not accepted, has no contact, or if what decides a
        contact depends on a command that is not run here. One line with file and number.
    """
    reader = _Reader(path, said)
    reader.read(path)
    if not reader.runs:
        reader.changed = True
        reader.take_run(None)
    unknown = [name for name in said.variables if name not in reader.variables.names]
    if unknown:
        raise ValueError(f"{path} has no variable {unknown[0]}: expected one of the file")
    numbers = [*map(str, reader.numbers())]
    unknown = [name for name in (*said.radii, *said.densities) if name not in numbers]
    if unknown:
        raise ValueError(f"{path} has no type {unknown[0]}: expected {', '.join(numbers)}")
    if not reader.missing and not reader.runs:
        raise ValueError(f"{path} has no contact: expected pair_style granular, gran/… or gran, or fix wall/gran")
    return Deck(
        liggghts.SIMULATOR if reader.is_liggghts else lammps.SIMULATOR,
        path,
        lammps.UNITS[reader.state.units],
        tuple(reader.runs),
        tuple(reader.missing),
        tuple(reader.unread.values()),
        tuple(reader.warnings),
    )


def line_settings(text: str) -> dict[str, str]:
    """Return the parameters of the program's `Native` that one line of an input says, but for its units.

    Lines of LAMMPS are `pair_coeff` and `fix … wall/gran granular …` of granular contacts, and `pair_style gran/…` and
    `fix … wall/gran` with a style such as `hertz/history`; those of LIGGGHTS are `pair_style gran model …` and
    `fix … wall/gran model …`, whose materials stand in other lines.

    Raises
    ------
    OtherModel
        If the contact has a model that is not computed here; a ValueError.
    ValueError
        If it is no such line, or has a variable.

    Examples
    --------
    >>> line_settings("pair_coeff 1 1 hertz/material 1e6 0.8 0.4 tangential mindlin NULL 1 0.5 damping tsuji")
    {'normal': 'hertz/material', 'coefficients': '1e6 0.8 0.4', 'damping': 'tsuji', 'limit_damping': 'no'}
    """
    ((_, command), *_) = _commands(text.strip())
    variables = Variables({})
    words = variables.words(command)
    try:
        variables.require_said(*words)
    except Unsaid as unsaid:
        raise ValueError(f"{unsaid.args[0].partition(' (')[0]} is missing: expected a line without variables") from None
    return contact_line(words).settings


def contact_line(words: Sequence[str]) -> AnyLine:
    """Return what the words of a line say of a contact.

    Raises
    ------
    ValueError
        If it is no line that says what a contact is.
    """
    command = words[0] if words else ""
    if command == "pair_coeff" and len(words) > 3:
        # A hybrid style has the name of its sub-style before the coefficients.
        return granular_line(words, 4 if words[3] == "granular" else 3)
    if command == "pair_style" and words[1:2] == ["gran"]:
        return model_line(words, 2)
    if command == "pair_style" and len(words) > 1 and words[1].startswith("gran/"):
        # LIGGGHTS has one or two numbers here, LAMMPS six.
        return granular_line(words, 1) if len(words) > 7 else model_line(words, 1)
    if command == "fix" and len(words) > 4 and words[3].startswith("wall/gran"):
        if words[3] not in ("wall/gran", "wall/gran/region"):
            return model_line(words, 3)
        return model_line(words, 4) if words[4] == "model" else granular_line(words, 5 if words[4] == "granular" else 4)
    accepted = "pair_coeff 1 1 hertz …, pair_style gran/…, pair_style gran model … or fix … wall/gran …"
    raise ValueError(f"{' '.join(words)!r} is no line of a contact: expected {accepted}")


class _Reader:
    """The commands of a file: a method `do_…` takes the words of each."""

    def __init__(self, file: Path, said: Said) -> None:
        self.file, self.said, self.state = file, said, _State()
        self.variables = Variables(said.variables)
        self.number = self.variables.number
        self.line = Line(file, 0, "")
        self.open_files: list[Path] = []
        self.is_liggghts = self.has_ended = False
        self.deciding: dict[str, Line] = {}  # by variables: a line that decides a contact
        self.labels: set[str] = set()
        self.jump: tuple[str, str] | None = None  # a label that is not passed yet, and where the jump stands
        self.missing: dict[str, None] = {}
        self.warnings: dict[str, None] = {}
        self.unread: dict[str, Line] = {}
        self.changed = True  # since the last run
        self.last: object = None  # what the last run has
        self.runs: list[Run] = []

    def read(self, path: Path) -> None:
        """Read the commands of a file."""
        if path in self.open_files:
            raise ValueError(f"{path.name} includes itself")
        self.open_files.append(path)
        text = files.content(path, "an input of LAMMPS or LIGGGHTS").decode(errors="replace")
        self.is_liggghts = self.is_liggghts or _LIGGGHTS.search(text) is not None
        for number, command in _commands(text):
            self.line = Line(path, number, command)
            self.execute(command)
            if self.has_ended:
                break
        self.open_files.pop()

    @property
    def place(self) -> str:
        """File and number of the line that is read."""
        return f"{self.line.file.name}:{self.line.number}"

    def execute(self, text: str) -> None:
        """Take a command."""
        line, (name, *_) = self.line, text.split(None, 1) or ("#",)
        if name.startswith("#"):
            return
        try:
            name = self.variables.words(name)[0] if "$" in name else name
            method = getattr(self, f"do_{name}", None)
            if method is None:
                if name not in _SILENT:
                    self.unread.setdefault(name, line)
                return
            words = self.variables.words(text)
            self.line = line = line._replace(text=" ".join(words))
            decides = _decides(words)
            if decides and self.jump is not None:
                raise ValueError(f"the jump in {self.jump[1]}, which is not done here, decides whether {name} is read")
            method(words)
            if decides:
                self.changed = self.changed or name not in ("run", "minimize")
                self.deciding.update(dict.fromkeys(self.variables.used, line))
        except Unsaid as unsaid:
            self.missing.update(dict.fromkeys(unsaid.args))
        except IndexError:
            raise ValueError(f"{line.file.name}:{line.number}: {name} has too few words") from None
        except (ValueError, ArithmeticError) as error:
            raise ValueError(f"{line.file.name}:{line.number}: {error}") from None

    # The flow of commands: nothing is repeated or skipped here.

    def do_variable(self, words: list[str]) -> None:
        self.variables.define(words[1], words[2], "".join(words[3:4]), self.line.number)

    def do_include(self, words: list[str]) -> None:
        self.variables.require_said(words[1])
        self.read(self.file.parent / words[1])

    def do_label(self, words: list[str]) -> None:
        self.labels.add(words[1])
        if self.jump is not None and self.jump[0] == words[1]:
            self.jump = None

    def do_jump(self, words: list[str]) -> None:
        self.unread.setdefault("jump", self.line)
        # What follows the end of a loop is read in any case.
        if words[-1] not in self.labels and words[1:] != ["SELF"]:
            self.jump = words[-1], self.place

    def do_next(self, words: list[str]) -> None:
        self.unread.setdefault("next", self.line)
        for name in words[1:]:
            if name in self.deciding and name not in self.said.variables:
                line = self.deciding[name].number
                raise ValueError(f"next changes {name}, which decides line {line}: expected --variable {name}=VALUE")
            self.variables.define(name, "next", "", self.line.number)

    def do_if(self, words: list[str]) -> None:
        self.unread.setdefault("if", self.line)
        for command in map(str.split, words[words.index("then") + 1 :]):
            if len(command) > 2 and command[0] == "variable":
                self.variables.define(command[1], "if", "", self.line.number)
            elif len(command) > 1 and command[0] == "jump":
                self.do_jump(command)
            elif command[:1] == ["include"] or (command and _decides(command) and command[0] != "run"):
                raise ValueError(f"an if, which is not computed here, decides whether {command[0]} is read")

    def do_quit(self, _: list[str]) -> None:
        self.has_ended = True

    def do_clear(self, _: list[str]) -> None:
        self.state = _State()

    def do_run(self, _: list[str]) -> None:
        self.take_run(self.line)

    do_minimize = do_run

    # Settings.

    def do_units(self, words: list[str]) -> None:
        if words[1] not in lammps.UNITS:
            raise ValueError(f"units is {words[1]!r}: expected {', '.join(lammps.UNITS)}")
        self.state.units, self.state.step = words[1], None

    def do_timestep(self, words: list[str]) -> None:
        self.state.step = self.number(words[1])
        if self.state.step <= 0:
            raise ValueError(f"timestep is {words[1]}: expected a number > 0")

    def do_dimension(self, words: list[str]) -> None:
        self.state.dimension = words[1]

    def do_atom_style(self, words: list[str]) -> None:
        self.state.atom_style = words[1]

    def do_lattice(self, _: list[str]) -> None:
        self.state.has_lattice = True

    def do_region(self, words: list[str]) -> None:
        self.state.regions[words[1]] = words[2:]

    def do_create_box(self, words: list[str]) -> None:
        self.state.types = int(self.number(words[1]))

    def do_group(self, words: list[str]) -> None:
        name, style, *rest = words[1:]
        if style == "type" and all(re.fullmatch(r"[0-9*]+", word) for word in rest):
            self.state.groups[name] = tuple(map(_types, rest))
        else:
            self.state.groups.pop(name, None)

    # Contacts.

    def contact(self, words: Sequence[str]) -> AnyLine:
        """Return what the words of a line say of a contact; where a wall stands does not matter."""
        self.variables.require_said(*itertools.takewhile(lambda word: word not in lammps.WALL_SHAPES, words))
        return contact_line(words)

    def do_pair_style(self, words: list[str]) -> None:
        state, style = self.state, words[1]
        if style != state.pair_style or style.startswith("hybrid"):
            state.coefficients.clear()
        state.pair_style, state.style_line, state.styles = style, self.line, {}
        # A sub-style begins with its name; what follows `gran` is a list of models.
        starts = [1]
        if style.startswith("hybrid"):
            names = (i for i in range(2, len(words)) if words[i][0].isalpha() and words[i] not in _NO_STYLES)
            starts = [i for i in names if "gran" not in words[2:i]]
        for start, end in zip(starts, [*starts[1:], len(words)], strict=True):
            contact = None
            if words[start].startswith("gran") and words[start] != "granular":
                contact = self.contact(["pair_style", *words[start:end]])
                if isinstance(contact, GranularLine):
                    contact = contact._replace(head=(*words[:start],), tail=(*contact.tail, *words[end:]))
            state.styles[words[start]] = contact

    def do_pair_coeff(self, words: list[str]) -> None:
        state, first, second = self.state, _types(words[1]), _types(words[2])
        is_hybrid = state.pair_style.startswith("hybrid")
        style = words[3] if is_hybrid else state.pair_style or "granular"
        contact = self.contact(words) if style == "granular" else state.styles.get(style)
        if first.start > second.start and len(first) == len(second) == 1:
            first, second = second, first
        key = first, second, style if state.pair_style == "hybrid/overlay" else ""
        state.coefficients.pop(key, None)  # so that the newest stands last
        state.coefficients[key] = _Coefficients(style, self.line, contact)

    def do_fix(self, words: list[str]) -> None:
        name, style = words[1], words[3]
        self.state.fixes.pop(name, None)
        warning = next((text for beginning, text in _WARNED_FIXES.items() if style.startswith(beginning)), None)
        if warning is not None:
            self.warnings[f"fix {style} ({self.place}): {warning}"] = None
        elif style.startswith(_DECIDING_FIXES):
            # An old wall has the style of its pairs.
            if style == "wall/gran" and words[4][0] in "0123456789." and self.state.pair_style.startswith("gran/"):
                words = [*words[:4], self.state.pair_style.removeprefix("gran/"), *words[4:]]
            contact = self.contact(words) if style.startswith("wall/gran") else None
            self.state.fixes[name] = _Fix(self.line, words, contact)
            if style.startswith(("pour", "deposit", "insert/")):
                self.insert(words)
        elif not style.startswith(_SILENT_FIXES):
            self.unread.setdefault(f"fix {style}", self.line)

    def do_unfix(self, words: list[str]) -> None:
        self.state.fixes.pop(words[1], None)

    # Spheres.

    def add(self, number: int, *grains: _Grain) -> None:
        """Add spheres of a type."""
        self.state.types = max(self.state.types, number)
        self.state.grains.setdefault(number, {}).update(dict.fromkeys(grains))

    def add_unknown(self) -> None:
        """Add spheres of all types of which nothing is known."""
        for number in range(1, self.state.types + 1):
            self.add(number, _Grain(_UNKNOWN))

    def insert(self, words: list[str]) -> None:
        """Add the spheres of fix pour, deposit and insert/…."""
        if "distributiontemplate" in words:
            distribution = self.state.fixes[words[words.index("distributiontemplate") + 1]]
            fixes = (self.state.fixes[name].words for name in distribution.words if name in self.state.fixes)
            for template in (fix for fix in fixes if fix[3].startswith("particletemplate/")):
                ends = liggghts.template_spheres(template, self.number)
                if template[3] != "particletemplate/sphere":
                    self.warnings[f"fix {template[3]}: {_RIGID}"] = None
                    ends = _UNKNOWN
                self.add(int(template[template.index("atom_type") + 1]), _Grain(ends))
        elif "mol" in words:
            self.warnings[f"fix {words[3]} ({self.place}): {_RIGID}"] = None
            self.add_unknown()
        else:
            spheres = lammps.poured_spheres(words, self.number) if words[3] == "pour" else [_DEFAULT_SPHERE]
            self.add(int(self.number(words[5])), *map(_Grain, spheres))

    def do_create_atoms(self, words: list[str]) -> None:
        number = int(self.number(words[1]))
        if number:
            self.add(number, _Grain(_DEFAULT_SPHERE))
        else:  # molecules
            self.add_unknown()

    def do_read_restart(self, _: list[str]) -> None:
        self.add_unknown()

    def do_read_data(self, words: list[str]) -> None:
        self.variables.require_said(words[1])
        path = self.file.parent / words[1]
        if not path.exists():
            self.warnings[f"read_data ({self.place}): there is no file {words[1]}"] = None
            self.add_unknown()
            return
        text = files.content(path, "data of LAMMPS").decode(errors="replace")
        if self.state.atom_style not in ("sphere", "granular"):
            text = text.partition("Atoms")[0]
        types, spheres = lammps.data_spheres(text)
        self.state.types = max(self.state.types, types)
        for number, points in spheres.items():
            self.add(number, *(_Grain((point,)) for point in _extremes(points)))
        if not spheres:
            self.add_unknown()

    def do_set(self, words: list[str]) -> None:
        style, name = words[1:3]
        types = (_types(name),) if style == "type" else self.state.groups.get(name) if style == "group" else None
        if not self.state.grains:
            self.add_unknown()
        for keyword, word in itertools.pairwise(words[3:]):
            if keyword in _SET:
                try:
                    value: float | None = self.number(word)
                except Unsaid:  # a number for each atom
                    value = None
                self.set(keyword, value, types, (style, name))

    def set(self, keyword: str, value: float | None, types: tuple[range, ...] | None, name: tuple[str, str]) -> None:
        """Change spheres; a selection that is none of types may be a part of any, and the same part later on."""
        before, self.state.grains = self.state.grains, {}
        is_new = types is None and not any(name in grain.selections for grains in before.values() for grain in grains)
        for number, grain in ((number, grain) for number, grains in before.items() for grain in grains):
            is_member = is_new or name in grain.selections
            if types is not None:
                is_member = any(number in numbers for numbers in types)
            if not is_member or is_new or keyword.startswith("type/"):
                self.add(number, grain)
            if is_member and keyword.startswith("type"):
                self.add(int(value or number), grain)
            elif is_member:
                ends = tuple(self.changed_sphere(keyword, value, *end) for end in grain.ends)
                self.add(number, _Grain(ends, grain.selections | ({name} if types is None else set())))

    def changed_sphere(
        self, keyword: str, value: float | None, radius: float | None, density: float | None
    ) -> tuple[float | None, float | None]:
        """Return radius and density of a sphere after a command `set`."""
        if keyword == "density":
            return radius, value
        if keyword == "diameter":
            size = value and value / 2
            # LAMMPS leaves the mass as it is, LIGGGHTS the density.
            if size and radius and density and not self.is_liggghts:
                density *= (radius / size) ** 3
            return size, density
        if value is None or radius is None:
            return radius, None
        # mass = 4/3 pi r^3 density; a disc has pi r^2 density.
        mass = value if keyword == "mass" else math.pi * radius**2 * value
        return radius, mass / (4 / 3 * math.pi * radius**3)

    def numbers(self) -> list[int]:
        """Return the types that have spheres; all, but those of walls, if the file has no spheres."""
        numbers = {number for number, grains in self.state.grains.items() if grains}
        if not numbers:
            numbers = {*range(1, max(self.state.types, 1) + 1)}
            of_walls = {number for fix in self.state.fixes.values() for _, number in self.surfaces(fix)}
            numbers = numbers - of_walls or numbers
        if len(numbers) > _MOST_TYPES:
            raise ValueError(f"{self.file} has {len(numbers)} types: expected at most {_MOST_TYPES}")
        return sorted(numbers)

    def spheres(self, number: int) -> list[Size]:
        """Return the sizes of a type; what is missing is noted."""
        units, name = lammps.UNITS[self.state.units], str(number)
        points = [end for grain in self.state.grains.get(number, {_Grain(_UNKNOWN): None}) for end in grain.ends]
        if name in self.said.radii:
            points = [(radius / units.metres, points[0][1]) for radius in self.said.radii[name]]
        if name in self.said.densities:
            density = self.said.densities[name] * units.metres**3 / units.kilograms
            points = [(radius, density) for radius, _ in points]
        sizes = []
        for r, rho in _extremes(dict.fromkeys(points)):
            if r is None:
                self.missing[f"the radius of type {number} (--radius {number}=0.5mm)"] = None
            if rho is None:
                self.missing[f"the density of type {number} (--density {number}=2500)"] = None
            if r is not None and rho is not None:
                is_disc = self.state.dimension == "2" and self.is_liggghts
                sizes.append(Size(r, math.pi * r**2 * (1 if is_disc else 4 / 3 * r) * rho))
        return sizes

    # Runs.

    def take_run(self, line: Line | None) -> None:
        """Note what a run has, if it differs from the one before."""
        if not self.changed:
            return
        self.changed, state = False, self.state
        step = lammps.DEFAULT_STEPS[state.units] if state.step is None else state.step
        gravity = [fix for fix in state.fixes.values() if fix.words[3] == "gravity"]
        acceleration = self.number(gravity[-1].words[4]) if gravity else 0.0
        contacts = (*self.pairs(), *self.walls())
        facts = [(c.name, c.line, tuple(c.settings.items()), c.sizes, c.reason, c.marks) for c in contacts]
        if contacts and (step, acceleration, facts) != self.last:
            self.last = step, acceleration, facts
            self.runs.append(Run(line, step, acceleration, contacts))
        if len(self.runs) > _MOST_RUNS:
            raise ValueError(f"more than {_MOST_RUNS} runs differ: expected fewer")
        if state.step is None:
            self.warnings[f"the file has no timestep: the default of units {state.units} is {step:g}"] = None
        if len(gravity) > 1:
            self.warnings[f"of {len(gravity)} fixes gravity that in line {gravity[-1].line.number} counts"] = None

    def pairs(self) -> Iterator[DeckContact]:
        """Yield the contacts of two types."""
        for i, j in itertools.combinations_with_replacement(self.numbers(), 2):
            lines = self.coefficients(i, j)
            line = lines[0].line if lines else self.state.style_line
            if line is None or [entry.style for entry in lines] == ["none"]:
                continue
            contact, reason = None, ""
            marks: list[str] = []
            try:
                line, contact, *marks = self.pair(i, j, lines)
            except OtherModel as error:
                reason = str(error)
            spheres, others = self.spheres(i), self.spheres(j)
            if i == j:
                sizes = tuple(itertools.combinations_with_replacement(spheres, 2))
            else:
                sizes = tuple(itertools.product(spheres, others))
            yield self.deck_contact(f"type {i} - type {j}", line, contact, sizes, (i, j), tuple(marks), reason)

    def coefficients(self, i: int, j: int) -> list[_Coefficients]:
        """Return the newest lines pair_coeff of two types: one, or of hybrid/overlay one of each style."""
        lines: dict[str, _Coefficients] = {}
        for (first, second, style), line in reversed(self.state.coefficients.items()):
            if i in first and j in second and style not in lines:
                lines[style] = line
        return [*lines.values()]

    def pair(self, i: int, j: int, lines: Sequence[_Coefficients]) -> tuple[Line, AnyLine, *tuple[str, ...]]:
        """Return the line and the contact of two types, and marks; OtherModel if there is none."""
        style = self.state.styles.get(self.state.pair_style)
        if style is not None and self.state.style_line is not None:
            return self.state.style_line, style
        if len(lines) > 1:
            raise OtherModel(f"{' and '.join(line.style for line in lines)} add their forces")
        if lines:
            contact = lines[0].contact
            if contact is None:
                raise OtherModel(f"{lines[0].style} is no contact of spheres")
            if isinstance(contact, GranularLine) and lines[0].style == "granular":
                contact = contact._replace(head=("pair_coeff", str(i), str(j), *contact.head[3:]))
            return lines[0].line, contact
        # Two types without a line have a mixture of those of each.
        entries = [*self.coefficients(i, i)[:1], *self.coefficients(j, j)[:1]]
        contacts = [entry.contact for entry in entries if isinstance(entry.contact, GranularLine)]
        if len(contacts) < 2 or i == j:
            raise OtherModel("it has no pair_coeff")
        mixture = lammps.mixed(contacts[0], contacts[1], (str(i), str(j)))
        return entries[1].line, mixture, f"mixed from {i} {i} and {j} {j}"

    def walls(self) -> Iterator[DeckContact]:
        """Yield the contacts of a type and a wall."""
        for name, fix in self.state.fixes.items():
            ranges = self.state.groups.get(fix.words[2], (_types("*"),))
            numbers = [number for number in self.numbers() if any(number in types for types in ranges)]
            for number, (wall, wall_type) in itertools.product(numbers, self.surfaces(fix)):
                contact, spheres, marks, group = fix.contact, self.spheres(number), [], ""
                if isinstance(contact, GranularLine):
                    marks = ["the line of the wall alone decides"]
                    shape = [*itertools.dropwhile(lambda word: word not in lammps.WALL_SHAPES, contact.tail)]
                    regions = self.state.regions
                    curvature = lammps.wall_curvature(shape, regions, self.number, self.state.has_lattice)
                    if curvature is None:
                        marks.append("R_eff is that of a plane, as the curvature of the wall is not computed")
                    elif curvature:
                        marks.append("R_eff is that of the curved wall")
                        spheres = [Size(r * curvature / (r + curvature), mass) for r, mass in spheres if r is not None]
                    if len(numbers) > 1:
                        # Other coefficients for one of several types need a fix of their own.
                        group = f"viscopade_type{number}"
                        contact = contact._replace(head=("fix", f"{name}_type{number}", group, *contact.head[3:]))
                sizes, title = tuple((size, None) for size in spheres), f"type {number} - wall {wall}"
                yield self.deck_contact(
                    title, fix.line, contact, sizes, (number, wall_type), tuple(marks), group=group, falls=True
                )

    def surfaces(self, fix: _Fix) -> list[tuple[str, int]]:
        """Return name and type of each wall of a fix; type 0 in LAMMPS, whose walls have none."""
        words, fixes = fix.words, self.state.fixes
        if fix.contact is None:
            return []
        if isinstance(fix.contact, GranularLine):
            return [(words[1], 0)]
        if "primitive" in words:
            return [(words[1], int(words[words.index("primitive") + 2]))]
        if "meshes" not in words and "mesh/gran" not in words:
            return [(words[1], int(words[-1]))]
        start = words.index("meshes") if "meshes" in words else words.index("mesh/gran")
        meshes = {name: fixes[name].words for name in words[start:] if name in fixes}
        return [(name, int(mesh[mesh.index("type") + 1 if "type" in mesh else 5])) for name, mesh in meshes.items()]

    def deck_contact(
        self,
        name: str,
        line: Line,
        contact: AnyLine | None,
        sizes: tuple[tuple[Size, Size | None], ...],
        types: tuple[int, int],
        marks: tuple[str, ...],
        reason: str = "",
        *,
        group: str = "",
        falls: bool = False,
    ) -> DeckContact:
        """Return a contact, or the reason why it has no number."""
        units, number, settings = lammps.UNITS[self.state.units], self.number, dict[str, str]()
        properties = {fix.words[4]: fix.words for fix in self.state.fixes.values() if fix.words[3] == "property/global"}
        try:
            if isinstance(contact, ModelLine):
                settings = contact.settings
                settings |= liggghts.material(contact.model, types, properties, number, units)
            elif contact is not None:
                settings = contact.settings | {"units": self.state.units}
                if self.is_liggghts:
                    raise OtherModel("its style is one of LAMMPS")
        except OtherModel as error:
            reason = str(error)

        def rewritten(texts: Mapping[str, str]) -> tuple[str, ...]:
            if isinstance(contact, GranularLine) and "coefficients" in texts:
                # Spheres of one of several types at a wall have a group of their own.
                before = (f"group {group} type {types[0]}",) if group else ()
                return (*before, contact.written(texts["coefficients"]))
            known = ((properties[key], text) for key, text in texts.items() if key in properties)
            return tuple(liggghts.with_property(words, text, types, units) for words, text in known)

        return DeckContact(name, line, settings, sizes, falls, 1, reason, marks, rewritten)


def _extremes(points: Iterable[tuple[float | None, float | None]]) -> list[tuple[float | None, float | None]]:
    """Return radii and densities, of many the smallest and the largest sphere."""
    points = [*points]
    if len(points) <= _MOST_SIZES or any(None in point for point in points):
        return points
    return [min(points), max(points)]


def _types(word: str) -> range:
    """Return the types that a word such as 1, *, 2* or 1*3 says."""
    if not re.fullmatch(r"[0-9]{1,9}|[0-9]{0,9}[*][0-9]{0,9}", word):
        raise ValueError(f"the type is {word!r}: expected a number, or a range such as 1*3")
    low, star, high = word.partition("*")
    return range(int(low or 1), int(high or (10**9 if star else low)) + 1)


def _decides(words: Sequence[str]) -> bool:
    """Return whether a command decides a contact, its sizes, the time step or gravity."""
    return words[0] in _DECIDING or (words[0] == "fix" and len(words) > 3 and words[3].startswith(_DECIDING_FIXES))


def _commands(text: str) -> Iterator[tuple[int, str]]:
    """Yield number and text of each command, which & and triple quotes continue in the next line."""
    lines = enumerate(text.split("\n"), 1)
    for number, line in lines:
        if "&" not in line and '"""' not in line:
            yield number, line
            continue
        parts, quotes = [line], line.count('"""')
        while quotes % 2 or parts[-1].rstrip().endswith("&"):
            _, following = next(lines, (0, None))
            if following is None:
                break
            if not quotes % 2:
                parts[-1] = parts[-1].rstrip()[:-1]
            parts.append(following)
            quotes += following.count('"""')
        yield number, " ".join(parts)
