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
from contextlib import contextmanager, suppress
from dataclasses import dataclass, field, replace
from functools import lru_cache, partial
from pathlib import Path
from typing import NamedTuple

from viscopade import files
from viscopade.simulators import lammps, lammps_spheres, liggghts
from viscopade.simulators.deck import (
    INCLINED,
    TSUJI_2026,
    Deck,
    DeckContact,
    DeckOptions,
    DeckRun,
    Line,
    LinesWith,
    Size,
)
from viscopade.simulators.lammps import GranularLine, OtherModel, granular_line, type_range
from viscopade.simulators.lammps_spheres import UNKNOWN, Spheres
from viscopade.simulators.lammps_variables import MissingValue, Variables, commands
from viscopade.simulators.liggghts import MaterialLine, ModelLine, model_line

# Limits, chosen by hand, for files that are hostile: types with spheres, of which 5050 pairs touch, and runs that
# differ.
_MOST_TYPES = 100
_MOST_RUNS = 1000

# Densities of solids, in kg/m^3, with some room: aerogel has 1, and osmium 22,600.
_LIGHTEST, _HEAVIEST = 1, 3e4

_ACCELERATED = re.compile("/(gpu|intel|kk|omp|opt)$")  # in names of styles, which compute the same
_NO_STYLES = ("NULL", "limit_damping")  # words of a pair_style hybrid that are no names of sub-styles

AnyLine = GranularLine | ModelLine


class _Coefficients(NamedTuple):
    """A line pair_coeff, and its contact; None if its sub-style has none."""

    style: str
    line: Line
    contact: AnyLine | None


class _Fix(NamedTuple):
    """A command fix: its line and words, and the contact with a wall; None if the fix is no wall."""

    line: Line
    words: list[str]
    contact: AnyLine | None


@dataclass
class _State:
    """What the program has after a line; the command `clear` makes a new one.

    `styles` are the contacts of a pair_style by its name, or by the names of its sub-styles; None for one that is no
    contact of spheres. `coefficients` are lines by the types of both bodies, and by the style for hybrid/overlay. A
    group is the types that it has, or None if they are not known; the program changes the atoms of a dynamic one. A
    region is the words of its line from its style on. `box_types` is the number of types in create_box.
    """

    units: str = "lj"
    has_units: bool = False
    step: float | None = None
    atom_style: str = ""
    dimension: str = "3"
    pair_style: str = ""
    styles: dict[str, AnyLine | None] = field(default_factory=dict)
    style_line: Line | None = None
    coefficients: dict[tuple[range, range, str], _Coefficients] = field(default_factory=dict)
    fixes: dict[str, _Fix] = field(default_factory=dict)
    groups: dict[str, tuple[range, ...] | None] = field(default_factory=lambda: {"all": (type_range("*"),)})
    dynamic_groups: set[str] = field(default_factory=set)
    regions: dict[str, list[str]] = field(default_factory=dict)
    has_lattice: bool = False
    box_types: int | None = None
    spheres: Spheres = field(default_factory=Spheres)

    @property
    def fix_words(self) -> dict[str, list[str]]:
        """The words of all fixes by name."""
        return {name: fix.words for name, fix in self.fixes.items()}


def read_input(path: Path, options: DeckOptions) -> Deck:
    """Return what an input of LAMMPS or LIGGGHTS says of its contacts.

    Parameters
    ----------
    path : Path
    options : DeckOptions
        What the command line says. A variable of it replaces all definitions in the file, and a radius or density all
        those of its type.

    Raises
    ------
    ValueError
        If the file cannot be read, has a word or number that is not accepted, has no contact, or if what decides a
        contact depends on a command that is not run here. One line with file and number.
    """
    # Read all commands. A file without a run has its contacts at its end.
    reader = _Reader(path, options)
    reader.read(path)
    types = dict[str, int]()
    with reader.errors_with_place("run"):
        if not reader.runs:
            reader.take_run(None)
        types = {str(number): number for number in reader.types_with_spheres()}
        if reader.missing:  # a variable: with the sizes that are missing, too, the message has all
            for number in types.values():
                reader.sizes(number)

    # Options must be of variables and types that the file has; a message names at most ten of these.
    type_names = {**options.radii, **options.densities}
    names = ("variable", options.variables, reader.variables.names), ("type", type_names, types)
    for kind, option_names, present in names:
        for name in option_names:
            if name not in present:
                raise ValueError(f"{path} has no {kind} {name}: expected {', '.join(sorted(present)[:10]) or 'none'}")
    if not reader.missing and not reader.runs:
        commands_of_contacts = "pair_style granular, gran/… or gran, or fix wall/gran"
        raise ValueError(f"{path} has no contact: expected an input of LAMMPS or LIGGGHTS with {commands_of_contacts}")
    simulator, units = liggghts.SIMULATOR if reader.is_liggghts else lammps.SIMULATOR, lammps.UNITS[reader.state.units]
    unread, warnings = tuple(reader.unread.values()), tuple(reader.warnings)
    missing = tuple("".join(words_and_place) for words_and_place in reader.missing.items())
    return Deck(simulator, path, units, tuple(reader.runs), missing, unread, warnings)


def line_settings(text: str) -> dict[str, str]:
    """Return the texts of parameters, by name, that the one line `text` of an input says, except for its units.

    They are those of the `Native` of LAMMPS or LIGGGHTS. Lines of LAMMPS are `pair_coeff` and `fix … wall/gran granular
    …` of granular contacts, and `pair_style gran/…` and `fix … wall/gran` with a style such as `hertz/history`; those
    of LIGGGHTS are `pair_style gran model …` and `fix … wall/gran model …`, whose materials stand in other lines.

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
    # `commands` yields line numbers and commands: the first command is read.
    ((_, command), *_) = commands(text.strip())
    variables = Variables({})
    words = variables.words(command)
    try:
        variables.require_values(*words)
    except MissingValue as missing:
        # The text ends with the option that says the value, in parentheses; here there is no such option.
        name = missing.args[0].partition(" (")[0]
        raise ValueError(f"{name} is missing: expected a line without variables") from None
    return contact_line(tuple(words)).settings


# Lines of one text are read once, such as in several runs of a file. 1000 is chosen by hand.
@lru_cache(maxsize=1000)
def contact_line(words: Sequence[str]) -> AnyLine:
    """Return what the words of a line say of a contact.

    Raises
    ------
    ValueError
        If it is no line that says what a contact is.
    """
    # The functions take the index of the word at which the model begins. Styles "model …" and such as hertz/history
    # with two numbers are those of LIGGGHTS.
    command = words[0] if words else ""
    # "pair_coeff I J MODEL …"
    if command == "pair_coeff" and len(words) > 3:
        # A hybrid style has the name of its sub-style before the coefficients.
        return granular_line(words, 4 if words[3] == "granular" else 3)
    if command == "pair_style" and len(words) > 2 and words[1] == "gran":
        return model_line(words, 2)
    if command == "pair_style" and len(words) > 1 and words[1].startswith("gran/"):
        # "pair_style STYLE NUMBERS": LIGGGHTS has one or two numbers here, LAMMPS six, so more than seven words.
        return granular_line(words, 1) if len(words) > 7 else model_line(words, 1)
    # "fix NAME GROUP wall/gran granular MODEL …" or "… wall/gran STYLE …"; LIGGGHTS has the style in the name of the
    # fix, wall/gran/hertz/history, or the word model.
    if command == "fix" and len(words) > 4 and words[3].startswith("wall/gran"):
        if words[3] not in ("wall/gran", "wall/gran/region"):
            return model_line(words, 3)
        return model_line(words, 4) if words[4] == "model" else granular_line(words, 5 if words[4] == "granular" else 4)
    accepted = "pair_coeff 1 1 hertz …, pair_style gran/…, pair_style gran model … or fix … wall/gran …"
    raise ValueError(f"{' '.join(words)!r} is no line of a contact: expected {accepted}")


class _Reader:
    """The reader of a file: a method `do_…` takes the words of a command, its name among them, as word 0."""

    def __init__(self, file: Path, options: DeckOptions) -> None:
        """Begin before the first line of `file`; `options` are those of the command line."""
        self.file, self.options, self.state = file, options, _State()
        self.variables = Variables(options.variables)
        self.number = self.variables.number
        self.line = Line(file, 0, "")
        self.open_files: list[Path] = []
        self.is_liggghts = self.has_ended = False
        self.lines_by_variable: dict[str, str] = {}  # "line 5" of a command that decides a contact, by its variables
        self.labels: set[str] = set()
        self.jump: tuple[str, str] | None = None  # a label that is not passed yet, and where the jump stands
        self.missing: dict[str, str] = {}  # what the file does not say, in words, and where, ", needed in in.x:5"
        self.warnings: dict[str, None] = {}
        self.unread: dict[str, Line] = {}  # the first line of each kind of commands that are not read
        self.contacts_changed = True  # since the last run
        self.gravity: list[_Fix] = []
        self.last_run: object = None  # time step, gravity and contacts of the last run
        self.runs: list[DeckRun] = []

    def read(self, path: Path) -> None:
        """Read the commands of the file `path`, an included one too."""
        if path in self.open_files:
            raise ValueError(f"{path.name} includes itself")
        self.open_files.append(path)
        text = files.content(path, "an input of LAMMPS or LIGGGHTS").decode("utf-8-sig", "replace")
        # One command that LAMMPS does not have makes it a file of LIGGGHTS.
        self.is_liggghts = self.is_liggghts or liggghts.LIGGGHTS_COMMANDS.search(text) is not None
        for number, command in commands(text):
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
        """Take the command `text`, which stands in `self.line`: call its method, or note that it is not read."""
        # The first word decides; a line of no words is a comment.
        line, (name, *_) = self.line, text.split(None, 1) or ("#",)
        if name.startswith("#"):
            return
        with self.errors_with_place(name):
            name = self.variables.words(name)[0] if "$" in name else name
            method = getattr(self, f"do_{name}", None)
            if method is None:
                if name not in lammps.SILENT:
                    self.unread.setdefault(name, line)
                return
            # Only the words of commands that are read are computed: others may have anything in them.
            words = self.variables.words(text)
            if name in ("pair_style", "pair_coeff", "fix"):
                words = [_ACCELERATED.sub("", word) for word in words]
            # The mark of a variable that nothing says (NUL) is printed as a question mark.
            self.line = line = line._replace(text=" ".join(words).replace("\0", "?"))
            decides = lammps.decides(words)
            if decides and self.jump is not None:
                raise ValueError(f"the jump in {self.jump[1]}, which is not done here, decides whether {name} is read")
            method(words)
            if decides:
                self.contacts_changed = self.contacts_changed or name not in ("run", "minimize")
                self.lines_by_variable.update(dict.fromkeys(self.variables.used, f"line {line.number}"))

    @contextmanager
    def errors_with_place(self, name: str) -> Iterator[None]:
        """Note what the command `name` needs and the file does not say; begin errors with the place of the command."""
        # Methods take words by their index: one that is not there is too few words.
        line = self.line
        try:
            yield
        except MissingValue as missing:
            for text in missing.args:
                self.missing.setdefault(text, "" if name == "run" else f", needed in {line.file.name}:{line.number}")
        except IndexError:
            raise ValueError(f"{line.file.name}:{line.number}: {name} has too few words") from None
        except (ValueError, ArithmeticError) as error:
            raise ValueError(f"{line.file.name}:{line.number}: {error}") from None

    # The flow of commands: nothing is repeated or skipped here.

    def do_variable(self, words: list[str]) -> None:
        self.variables.define(words[1], words[2], "".join(words[3:4]), self.line.number)

    def do_include(self, words: list[str]) -> None:
        self.variables.require_values(words[1])
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
        """Forget the values of variables, which change here; refuse one that has decided a contact before."""
        # "next NAME NAME …"; an option of the command line says a value for all of the file.
        self.unread.setdefault("next", self.line)
        for name in words[1:]:
            if name in self.lines_by_variable and name not in self.options.variables:
                place = self.lines_by_variable[name]
                raise ValueError(f"next changes {name} of {place}: expected --variable {name}=VALUE")
            self.variables.define(name, "next", "", self.line.number)

    def do_if(self, words: list[str]) -> None:
        """Take an if that is not computed: its variables have no value, and it must not decide a contact."""
        # if "CONDITION" then "COMMAND" … else "COMMAND" …: each command is one word.
        self.unread.setdefault("if", self.line)
        if "then" not in words:
            raise ValueError('an if without then: expected if "CONDITION" then "COMMAND" …')
        for command in map(str.split, words[words.index("then") + 1 :]):
            if len(command) > 2 and command[0] == "variable":
                self.variables.define(command[1], "if", "", self.line.number)
            elif len(command) > 1 and command[0] == "jump":
                self.do_jump(command)
            elif command[:1] == ["run"]:
                self.take_run(self.line)  # it may happen: its contacts are shown, as those of any run
            elif command[:1] == ["include"] or (command and lammps.decides(command)):
                raise ValueError(f"an if, which is not computed here, decides whether {command[0]} is read")

    def do_quit(self, _: list[str]) -> None:
        self.has_ended = True

    def do_clear(self, _: list[str]) -> None:
        self.state = _State()

    def do_run(self, words: list[str]) -> None:
        if "every" in words:
            self.warnings[f"run … every ({self.place}): its commands are not read"] = None
        self.take_run(self.line)

    do_minimize = do_run

    # Settings.

    def do_units(self, words: list[str]) -> None:
        if words[1] not in lammps.UNITS:
            raise ValueError(f"units is {words[1]!r}: expected {', '.join(lammps.UNITS)}")
        self.state.units, self.state.has_units, self.state.step = words[1], True, None

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
        self.contacts_changed = True  # a wall may be there

    def do_group(self, words: list[str]) -> None:
        """Take `group NAME STYLE …`: the types that a group has, or None if the file does not say them."""
        name, style, rest = words[1], words[2], words[3:]
        # A second command adds to a group; None is a group of which nothing is known.
        old_types, types = self.state.groups.get(name, ()), None
        if old_types is not None and style == "type" and re.fullmatch(r"[0-9* ]+", " ".join(rest)):
            types = (*old_types, *map(type_range, rest))
        self.state.groups[name] = types
        self.state.dynamic_groups |= {name} if style == "dynamic" else set()

    # Contacts.

    def contact(self, words: Sequence[str]) -> AnyLine:
        """Return what the words of a line say of a contact; where a wall stands does not matter."""
        self.variables.require_values(*itertools.takewhile(lambda word: word not in lammps.WALL_SHAPES, words))
        return contact_line(tuple(words))

    def do_pair_style(self, words: list[str]) -> None:
        """Take `pair_style STYLE …`: the contact that the style says itself, or those of its sub-styles."""
        # The same style again keeps the lines pair_coeff (`Input::pair_style`); another one, or a hybrid one, does not.
        state, style = self.state, words[1]
        if style != state.pair_style or style.startswith("hybrid"):
            state.coefficients.clear()
        state.pair_style, state.style_line, state.styles = style, self.line, {}
        # A sub-style begins with its name; what follows `gran` is a list of models.
        starts = [1]
        if style.startswith("hybrid"):
            names = (i for i in range(2, len(words)) if words[i][0].isalpha() and words[i] not in _NO_STYLES)
            starts = [i for i in names if "gran" not in words[2:i]]
        styles = [words[start] for start in starts]
        # Each sub-style has the words from its start to the next one. The contact keeps those before and after it, so
        # that the whole line can be written anew.
        for i, (start, end) in enumerate(zip(starts, [*starts[1:], len(words)], strict=False)):
            contact, name = None, words[start]
            if name.startswith("gran") and name != "granular":
                contact = self.contact(["pair_style", *words[start:end]])
                if isinstance(contact, GranularLine):
                    contact = contact._replace(head=(*words[:start],), tail=(*contact.tail, *words[end:]))
            # Several equal sub-styles are numbered: gran/hooke 2.
            state.styles[f"{name} {styles[: i + 1].count(name)}" if styles.count(name) > 1 else name] = contact

    def do_pair_coeff(self, words: list[str]) -> None:
        """Take `pair_coeff I J …`: the contact of all types in the ranges I and J."""
        # A hybrid style has the name of its sub-style in word 3, and its number in word 4 if there are several.
        state, first, second = self.state, type_range(words[1]), type_range(words[2])
        if not state.pair_style:
            stops = "it is read as granular; LAMMPS stops, except after read_restart"
            self.warnings[f"pair_coeff ({self.place}) has no pair_style before it: {stops}"] = None
        style = words[3] if state.pair_style.startswith("hybrid") else state.pair_style or "granular"
        style = " ".join(words[3:5]) if " ".join(words[3:5]) in state.styles else style
        # The pair 2 1 is the pair 1 2; of ranges only pairs I <= J are meant.
        if first.start > second.start and len(first) == len(second) == 1:
            first, second = second, first
        # A number of a type says that there are as many types; an open range, or a hostile number, says nothing.
        for types in (first, second):
            state.spheres.types = max(state.spheres.types, types.stop - 1 if types.stop <= _MOST_TYPES else 0)
        contact = self.contact(words) if style == "granular" else state.styles.get(style)
        key = first, second, style if state.pair_style == "hybrid/overlay" else ""
        state.coefficients.pop(key, None)  # so that the newest stands last
        state.coefficients[key] = _Coefficients(style, self.line, contact)

    def do_fix(self, words: list[str]) -> None:
        """Take `fix NAME GROUP STYLE …`: gravity, walls, properties, and spheres that are inserted."""
        # A fix replaces one of its name. A fix that changes eps in a way that is not computed makes a warning.
        name, style = words[1], words[3]
        self.state.fixes.pop(name, None)
        warning = next((text for beginning, text in lammps.WARNED_FIXES.items() if style.startswith(beginning)), None)
        if warning is not None:
            self.warnings[f"fix {style} ({self.place}): {warning}"] = None
        elif style.startswith(lammps.DECIDING_FIXES):
            # Of an old wall the word after wall/gran is a number: it has the style of its pairs.
            if style == "wall/gran" and words[4][0] in "0123456789." and self.state.pair_style.startswith("gran/"):
                words = [*words[:4], self.state.pair_style.removeprefix("gran/"), *words[4:]]
            contact = self.contact(words) if style.startswith("wall/gran") else None
            # "fix ID GROUP property/global NAME KIND NUMBERS": words that are no numbers are refused.
            for word in words[6:] if style == "property/global" else ():
                self.number(word)
            self.state.fixes[name] = _Fix(self.line, words, contact)
            if style.startswith(("pour", "deposit", "insert/")):
                for number, grain in lammps_spheres.inserted_grains(words, self.state.fix_words, self.number):
                    self.state.spheres.add(number, grain)
                    if grain == UNKNOWN:
                        self.warnings[f"fix {style} ({self.place}): its sizes are not read; {lammps.RIGID}"] = None
                    elif style == "pour" and "dens" not in words and str(number) not in self.options.densities:
                        self.warnings[f"fix pour ({self.place}) has no dens: the default density is 1"] = None
        elif not style.startswith(lammps.SILENT_FIXES):
            self.unread.setdefault(f"fix {style}", self.line)

    def do_unfix(self, words: list[str]) -> None:
        self.state.fixes.pop(words[1], None)

    # Spheres.

    def do_create_box(self, words: list[str]) -> None:
        self.state.spheres.types = self.state.box_types = int(self.number(words[1]))

    def do_create_atoms(self, words: list[str]) -> None:
        self.state.spheres.add(int(self.number(words[1])), lammps_spheres.DEFAULT)

    def do_read_restart(self, _: list[str]) -> None:
        self.state.spheres.add(0)

    def do_read_data(self, words: list[str]) -> None:
        """Take `read_data FILE …`: the number of types and the sizes of the spheres in a file beside the input."""
        self.variables.require_values(words[1])
        spheres, path = self.state.spheres, self.file.parent / words[1]
        text = files.content(path, "data of LAMMPS").decode("utf-8-sig", "replace") if path.exists() else ""
        if not text:
            self.warnings[f"read_data ({self.place}): there is no file {words[1]}"] = None
        # Atoms of other styles have other columns: then only the lines before them are read.
        is_sphere = self.state.atom_style in ("sphere", "granular")
        types, grains = lammps_spheres.data_grains(text if is_sphere else text.partition("Atoms")[0])
        spheres.types = max(spheres.types, types)
        # Without sizes, all types have spheres of which nothing is known (type 0).
        for number in grains or (0,):
            spheres.add(number, *grains.get(number, ()))

    def do_set(self, words: list[str]) -> None:
        """Take `set STYLE NAME KEYWORD VALUE …`: another radius, density or type of a type, a group or other atoms."""
        # None: the types of the selection are not known.
        style, name = words[1:3]
        types = (type_range(name),) if style == "type" else self.state.groups.get(name) if style == "group" else None
        spheres = self.state.spheres
        if not spheres.grains:
            spheres.add(0)
        # Keywords take different numbers of words: each word that is a keyword is read with the one after it.
        for keyword, word in itertools.pairwise(words[3:]):
            if keyword in lammps_spheres.SETTABLE:
                value = None  # unless all atoms have one number
                with suppress(MissingValue):
                    value = self.number(word)
                spheres.set(keyword, value, types, (style, name), keeps_density=self.is_liggghts)

    def types_with_spheres(self) -> list[int]:
        """Return the numbers of types that have spheres; of a file without spheres all, except those of walls.

        Raises
        ------
        ValueError
            If there are more than `_MOST_TYPES`.
        """
        # A file that says no number of types has one. Where it says a very large one, the first 101 are enough to
        # refuse it.
        numbers = {number for number, grains in self.state.spheres.grains.items() if grains}
        if not numbers:
            numbers = {*range(1, min(max(self.state.spheres.types, 1), _MOST_TYPES + 1) + 1)}
            walls = [fix.words for fix in self.state.fixes.values() if isinstance(fix.contact, ModelLine)]
            types = (liggghts.surfaces(words, self.state.fix_words).values() for words in walls)
            numbers = numbers.difference(*types) or numbers
        if len(numbers) > _MOST_TYPES:
            raise ValueError(f"there are more than {_MOST_TYPES} types with spheres: expected fewer")
        return sorted(numbers)

    def sizes(self, number: int) -> list[Size]:
        """Return radius and mass of spheres of the type `number`, in units of the file; note what is missing."""
        # Radius and density of each sphere, None if the file does not say it. Options replace them; they are in SI
        # units.
        units, name, spheres = lammps.UNITS[self.state.units], str(number), self.state.spheres.sizes(number)
        if name in self.options.radii:
            spheres = [(radius / units.metres, spheres[0][1]) for radius in self.options.radii[name]]
        if name in self.options.densities:
            density = self.options.densities[name] * units.metres**3 / units.kilograms
            spheres = [*dict.fromkeys((radius, density) for radius, _ in spheres)]
        for i, option in enumerate((f"radius {name}=0.5mm", f"density {name}=2500")):
            if any(sphere[i] is None for sphere in spheres):
                self.missing[f"the {option.split()[0]} of type {name} (--{option})"] = ""
        for density in {rho * units.kilograms / units.metres**3 for _, rho in spheres if rho and not units.unsized}:
            if not _LIGHTEST <= density <= _HEAVIEST:
                self.warnings[f"spheres of type {name} have {density:.3g} kg/m^3: check density and units"] = None
        # The mass is 4/3 pi r^3 rho; in two dimensions LIGGGHTS has discs, pi r^2 rho.
        is_disc = self.state.dimension == "2" and self.is_liggghts
        complete = [(r, rho) for r, rho in spheres if r is not None and rho is not None]
        if any(r <= 0 or rho <= 0 for r, rho in complete):
            raise ValueError(f"a sphere of type {name} has no size or no mass: expected a radius and a density > 0")
        return [Size(r, math.pi * r**2 * (1 if is_disc else 4 / 3 * r) * rho) for r, rho in complete]

    # Runs.

    def take_run(self, line: Line | None) -> None:
        """Add the run of the command `line`, or None at the end of a file without runs, if its contacts are new."""
        # Nothing that decides a contact, the time step or gravity stands between this run and the one before.
        if not self.contacts_changed and line is not None:
            return
        self.contacts_changed, state = False, self.state
        # Time step and gravity: "fix ID GROUP gravity G …", of which the last counts.
        step = lammps.DEFAULT_STEPS[state.units] if state.step is None else state.step
        self.gravity = [fix for fix in state.fixes.values() if fix.words[3].startswith("gravity")]
        acceleration = abs(self.number(self.gravity[-1].words[4])) if self.gravity else 0.0
        # The contacts. A run that has what the one before has is none of its own.
        contacts = self.merge_walls(self.contacts())
        facts = [(c.name, tuple(c.settings.items()), c.sizes, c.falls, c.reason, c.marks) for c in contacts]
        if contacts and (step, acceleration, facts) != self.last_run:
            self.last_run = step, acceleration, facts
            self.runs.append(DeckRun(line, step, acceleration, contacts))
        if len(self.runs) > _MOST_RUNS:
            raise ValueError(f"more than {_MOST_RUNS} runs differ: expected fewer")
        if not state.has_units:
            self.warnings["the file has no units: the default is lj"] = None
        if state.step is None:
            self.warnings[f"the file has no timestep: the default of units {state.units} is {step:g}"] = None
        for number, grains in state.spheres.grains.items():
            if lammps_spheres.DEFAULT in grains and str(number) not in self.options.densities:
                diameter = "diameter 1 and " * (str(number) not in self.options.radii)
                self.warnings[f"spheres of type {number} have the default {diameter}density 1"] = None
        if state.box_types and state.spheres.types > state.box_types:
            last = f"create_box has types up to {state.box_types}"
            self.warnings[f"there is a type {state.spheres.types}, and {last}: LAMMPS stops"] = None
        if len(self.gravity) > 1:
            self.warnings[f"of {len(self.gravity)} fixes gravity the last counts"] = None

    def contacts(self) -> Iterator[tuple[tuple[int, int], DeckContact]]:
        """Yield the contacts of two types, and of a type and a wall, each with the types of both bodies.

        The type of a wall of LAMMPS is 0.
        """
        # Sphere with sphere.
        state, numbers = self.state, self.types_with_spheres()
        for i, j in itertools.combinations_with_replacement(numbers, 2):
            line, contact, reason, *marks = self.pair_line(i, j)
            if line is not None:
                yield (i, j), self.deck_contact(f"type {i} - type {j}", line, contact, (i, j), marks, reason)
        # Sphere with wall: a fix acts on a group, whose types it touches; all, if its types are not known.
        for name, fix in state.fixes.items():
            ranges = state.groups.get(fix.words[2]) or (type_range("*"),)
            touching = [number for number in numbers if any(number in types for types in ranges)]
            walls = {name: 0} if isinstance(fix.contact, GranularLine) else {}
            if isinstance(fix.contact, ModelLine):
                walls = liggghts.surfaces(fix.words, state.fix_words)
            if walls:
                self.warn_of_holes(fix, name, touching)
            for number, (wall, wall_type) in itertools.product(touching, walls.items()):
                types = number, wall_type
                yield types, self.deck_contact(f"type {number} - wall {wall}", fix.line, fix.contact, types, [])

    def warn_of_holes(self, wall: _Fix, name: str, touching: Sequence[int]) -> None:
        """Warn of spheres that are poured into another group than that of a wall: they fall through it.

        The wall is the fix called `name`, and `touching` are the types in its group.
        """
        group = wall.words[2]
        if group == "all" or group in self.state.dynamic_groups:
            return
        for line, words, _ in self.state.fixes.values():
            if words[3].startswith(("pour", "deposit", "insert/")) and words[2] != group:
                grains = lammps_spheres.inserted_grains(words, self.state.fix_words, self.number)
                types = sorted({number for number, _ in grains} & {0, *touching})
                place = f"fix {words[1]} ({line.file.name}:{line.number}) pours into {words[2]}"
                for number in types:
                    spheres = f"spheres{f' of type {number}' * bool(number)} that come after the command group {group}"
                    self.warnings[f"{place}: {spheres} fall through the wall {name}"] = None

    @staticmethod
    def merge_walls(contacts: Iterable[tuple[tuple[int, int], DeckContact]]) -> tuple[DeckContact, ...]:
        """Return the contacts, those of a type with like walls as one: a box has six walls.

        `contacts` are pairs of the types of both bodies and their contact.
        """
        # Names are "type 1 - type 2" and "type 1 - wall floor". Contacts with walls are alike if the types and all that
        # decides eps are; other contacts stand alone.
        groups: dict[object, list[DeckContact]] = {}
        for types, contact in contacts:
            _, is_wall, _ = contact.name.partition(" - wall ")
            facts = (*sorted(contact.settings.items()),), contact.sizes, contact.falls, contact.reason, contact.marks
            groups.setdefault((types, facts) if is_wall else contact.name, []).append(contact)

        def lines_with(functions: list[LinesWith], settings: Mapping[str, str]) -> tuple[str, ...]:
            """Return the lines of all walls with other parameters, each line once."""
            return tuple(dict.fromkeys(line for function in functions for line in function(settings)))

        return tuple(
            replace(
                first,
                name=", ".join((first.name, *(wall.name.partition(" - wall ")[2] for wall in others))),
                count=1 + len(others),
                lines_with=partial(lines_with, [wall.lines_with for wall in (first, *others)]),
            )
            if others
            else first
            for first, *others in groups.values()
        )

    def pair_line(self, i: int, j: int) -> tuple[Line | None, AnyLine | None, str, *tuple[str, ...]]:
        """Return the line that decides the contact of the types i and j, the contact, why it has no number, and marks.

        The line is None if the types have no contact.
        """
        # A style such as gran/hertz/history says the contact of all types itself.
        style = self.state.styles.get(self.state.pair_style)
        if style is not None:
            return self.state.style_line, style, ""
        # The lines of i with itself, of j with itself, and of both; several with hybrid/overlay, whose forces add.
        first, second, lines = (self.pair_coefficients(*types) for types in ((i, i), (j, j), (i, j)))
        if len(lines) > 1:
            return lines[0].line, None, f"{' and '.join(line.style for line in lines)} add their forces"
        # A line of its own.
        if lines:
            name, line, contact = lines[0]
            if isinstance(contact, GranularLine) and name == "granular":
                contact = contact.between(i, j)
            reason = "" if contact else f"{name} is no contact of spheres"
            return (None, None, "") if name == "none" else (line, contact, reason)
        # Two types without a line have a mixture of those of each.
        line_i, line_j = (line[0].contact if line else None for line in (first, second))
        if not isinstance(line_i, GranularLine) or not isinstance(line_j, GranularLine):
            return self.state.style_line, None, "it has no pair_coeff"
        if line_i == line_j:  # both have the line of a style gran/…
            return second[0].line, line_i, ""
        try:
            return second[0].line, lammps.mixture(line_i, line_j, (i, j)), "", "mixed from the lines of each type"
        except OtherModel as error:
            return second[0].line, None, str(error)

    def pair_coefficients(self, i: int, j: int) -> list[_Coefficients]:
        """Return the newest lines pair_coeff of the types i and j: one, or of hybrid/overlay one of each style."""
        # The newest lines stand last; of each style (one, "", without hybrid/overlay) the first one seen counts.
        lines: dict[str, _Coefficients] = {}
        for (first, second, style), line in reversed(self.state.coefficients.items()):
            if i in first and j in second:
                lines.setdefault(style, line)
        return [*lines.values()]

    def deck_contact(
        self, name: str, line: Line, contact: AnyLine | None, types: tuple[int, int], marks: list[str], reason: str = ""
    ) -> DeckContact:
        """Return the contact called `name`, or the reason why it has no number.

        Parameters
        ----------
        name : str
            "type 1 - type 2", or "type 1 - wall floor".
        line : Line
            The command that decides the contact.
        contact : GranularLine, ModelLine or None
            What its words say.
        types : tuple of int
            Those of both bodies.
        marks : list of str
            What a reader of the row has to know; others are added.
        reason : str
            Why there is no number, if this is known before.
        """
        # The parameters of the contact: those of a line of LIGGGHTS stand in other lines, of materials.
        state, (first, second), settings = self.state, types, dict[str, str]()
        is_wall = " - wall " in name
        falls = float(is_wall)
        full_line: GranularLine | MaterialLine | None = contact if isinstance(contact, GranularLine) else None
        if isinstance(contact, ModelLine):
            fixes = (words for words in state.fix_words.values() if words[3] == "property/global")
            full_line = MaterialLine(contact, types, {words[4]: words for words in fixes}, lammps.UNITS[state.units])
        try:
            settings = full_line.settings if full_line else {}
            if isinstance(full_line, GranularLine):
                settings["units"] = state.units
                if self.options.tsuji_is_new and settings["damping"] == "tsuji":
                    settings["damping"] = TSUJI_2026
                if self.is_liggghts:
                    raise OtherModel("its style is one of LAMMPS")
        except OtherModel as error:
            reason = str(error)

        # The pairs of sizes: of one type each size with each, once.
        spheres = [] if reason else self.sizes(first)
        sizes: Iterable[tuple[Size, Size | None]] = itertools.combinations_with_replacement(spheres, 2)
        if is_wall:
            # The radius of the wall, 0 for a plane, and marks.
            R_wall = 0.0
            if isinstance(contact, GranularLine):
                R_wall, *more = lammps.wall_radius(contact.shape, state.regions, self.number, state.has_lattice)
                marks += ["the line of the wall alone decides", *more]
            # On a plane the part of the weight along its normal presses: the cosine of the angle between gravity and
            # normal. Nine decimals remove the round-off of the two roots, so that a vertical normal has 1 and no mark.
            normal = lammps.wall_normal(line.text.split(), state.regions, self.number)
            if normal and self.gravity:
                down = lammps.gravity_direction(self.gravity[-1].words, self.number, state.dimension)
                product = sum(x * y for x, y in zip(normal, down, strict=True))
                falls = round(abs(product) / math.hypot(*normal) / math.hypot(*down), 9)
                marks += [INCLINED] * (0 < falls < 1)
            # R_eff = R R_wall/(R + R_wall)
            radii = [r * R_wall / (r + R_wall) if R_wall and r else r for r, _ in spheres]
            sizes = ((Size(r, size.mass), None) for r, size in zip(radii, spheres, strict=True))
        # Of two types each size with each; equal sizes of both types make a pair once.
        elif first != second and not reason:
            sizes = {frozenset(pair): pair for pair in itertools.product(spheres, self.sizes(second))}.values()
        lines_with = full_line.lines_with if full_line else lambda texts: ()
        return DeckContact(name, line, settings, tuple(sizes), falls, 1, reason, tuple(marks), lines_with)
