"""Spheres of an input of LAMMPS or LIGGGHTS: radii and densities by type, as commands make and change them.

    create_atoms 1 region box                                # diameter 1, density 1
    fix ins all pour 500 1 4767 region above diam range 0.001 0.002 dens 2500 2500
    set type 1 diameter 0.002 density 2500

What the file does not say is None. Read in `AtomVecSphere`, `FixPour` and `Set` of LAMMPS, commit 07b704c, and in `Set`
and `FixTemplateSphere` of LIGGGHTS-PUBLIC, commit 25fc396.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Iterable, Mapping, Sequence
from typing import NamedTuple

Sphere = tuple[float | None, float | None]
"""Radius and density, in the units of the file; None for what the file does not say."""

SETTABLE = ("diameter", "density", "density/disc", "mass", "type", "type/fraction", "type/ratio", "type/subset")
"""Keywords of the command `set` that `Spheres.set` takes."""
# Limits, chosen by hand, for files that are hostile or large. Types of which nothing is known:
_MOST_TYPES = 1000
# Sizes of one type that make a row each; of more only the smallest and the largest are rows.
_MOST_SIZES = 6
# Grains of one type that are kept; of more only the smallest and the largest size.
_MOST_GRAINS = 50
_Number = Callable[[str], float]


class Grain(NamedTuple):
    """Spheres of one type and one size, or of all sizes between two.

    Attributes
    ----------
    ends : tuple of Sphere
        The sphere, or the smallest and the largest.
    selections : frozenset of tuple of str
        Those of `set region`, `set atom` and the like to which they belong: style and name.
    """

    ends: tuple[Sphere, ...]
    selections: frozenset[tuple[str, str]] = frozenset()


UNKNOWN = Grain(((None, None),))
DEFAULT = Grain(((0.5, 1.0),))  # diameter 1 and density 1: `AtomVecSphere::create_atom_post`


class Spheres:
    """The spheres of all types.

    Attributes
    ----------
    types : int
        The number of types.
    grains : dict of int to dict of Grain to None
        The grains of each type, in the order of the commands.
    """

    def __init__(self) -> None:
        """Begin without types."""
        self.types = 0
        self.grains: dict[int, dict[Grain, None]] = {}

    def add(self, number: int, *grains: Grain) -> None:
        """Add `grains` to the type called `number`.

        The number is 0 where a command does not say the type, as for molecules: then each type has spheres of which
        nothing is known.
        """
        if number < 1:
            if self.types > _MOST_TYPES:
                raise ValueError(f"there are {self.types} types: expected at most {_MOST_TYPES}")
            for any_type in range(1, self.types + 1):
                self.add(any_type, UNKNOWN)
        else:
            self.types = max(self.types, number)
            type_grains = self.grains.setdefault(number, {})
            type_grains.update(dict.fromkeys(grains))
            # Many grains become two: the smallest and the largest sphere.
            if len(type_grains) > _MOST_GRAINS:
                ends = extremes(end for grain in type_grains for end in grain.ends)
                self.grains[number] = {Grain((end,)): None for end in ends}

    def set(
        self,
        keyword: str,
        value: float | None,
        types: tuple[range, ...] | None,
        selection: tuple[str, str],
        *,
        keeps_density: bool,
    ) -> None:
        """Change radius, density or type of spheres, as a command `set STYLE NAME KEYWORD VALUE` does.

        Parameters
        ----------
        keyword : str
            One of `SETTABLE`.
        value : float or None
            In the units of the file; None if each sphere has its own.
        types : tuple of range or None
            The types that change. None for another selection: it is a part of the spheres of any type that no such
            command has changed, and is the same part in later commands.
        selection : tuple of str
            Style and name.
        keeps_density : bool
            Whether another diameter keeps the density, as in LIGGGHTS, or the mass, as in LAMMPS.
        """
        # All grains are taken out, and put back as they are after the command.
        old_grains, self.grains = self.grains, {}
        is_new = types is None and not any(
            selection in grain.selections for grains in old_grains.values() for grain in grains
        )
        for number, grain in ((number, grain) for number, grains in old_grains.items() for grain in grains):
            # A region, say, is a part of the spheres. Its first command splits each grain into spheres that change and
            # spheres that do not; later commands with this selection change the former.
            is_member = selection in grain.selections or (is_new and not grain.selections)
            if types is not None:
                is_member = any(number in numbers for numbers in types)
            # Spheres that do not change. type/fraction, type/ratio and type/subset change only some of the members.
            if not is_member or (is_new and types is None) or keyword.startswith("type/"):
                self.add(number, grain)
            # Spheres that change: their type, or their radius and density.
            if is_member and keyword.startswith("type"):
                self.add(int(value or number), grain)
            elif is_member:
                ends = tuple(_sphere_after_set(keyword, value, *end, keeps_density=keeps_density) for end in grain.ends)
                self.add(number, Grain(ends, grain.selections | ({selection} if types is None else set())))

    def sizes(self, number: int) -> list[Sphere]:
        """Return radius and density of spheres of the type `number`; of more than 6 the smallest and the largest."""
        return extremes(end for grain in self.grains.get(number) or {UNKNOWN: None} for end in grain.ends)


def _sphere_after_set(
    keyword: str, value: float | None, radius: float | None, density: float | None, *, keeps_density: bool
) -> Sphere:
    """Return a sphere with another number, `value`, after `set … keyword value`; None stands for what nothing says.

    `radius` and `density` are those before the command. `keeps_density` says whether another diameter keeps the
    density, or the mass.
    """
    if keyword == "density":
        return radius, value
    if keyword == "diameter":
        new_radius = value and value / 2
        # The mass 4/3 pi r^3 density stays.
        if new_radius and radius and density and not keeps_density:
            density *= (radius / new_radius) ** 3
        return new_radius, density
    # The keyword is mass, or density/disc: a disc has the mass pi r^2 density. The sphere has the density of that mass.
    if value is None or radius is None:
        return radius, None
    mass = value if keyword == "mass" else math.pi * radius**2 * value
    return radius, mass / (4 / 3 * math.pi * radius**3)


def extremes(spheres: Iterable[Sphere]) -> list[Sphere]:
    """Return the different ones of `spheres`; of more than 6 the smallest and the largest by radius, then density."""
    different = [*dict.fromkeys(spheres)]
    # None cannot be compared: spheres of which something is unknown all stay.
    if len(different) <= _MOST_SIZES or any(None in sphere for sphere in different):
        return different
    return [min(different), max(different)]


def inserted_grains(
    words: Sequence[str], fixes: Mapping[str, Sequence[str]], number: _Number
) -> list[tuple[int, Grain]]:
    """Return types and sizes of a line `fix … pour`, `deposit` or `insert/…`; bodies of several spheres are unknown.

    Parameters
    ----------
    words : sequence of str
        Those of the line, from "fix" on.
    fixes : mapping of str to sequence of str
        Words of all fixes by name.
    number : callable
        From a word to its number.
    """
    # LIGGGHTS: insert/… names a fix particledistribution/…, which names fixes particletemplate/…; each has a type.
    if "distributiontemplate" in words:
        distribution = fixes[words[words.index("distributiontemplate") + 1]]
        templates = [fixes[name] for name in distribution if name in fixes]
        return [
            (int(number(template[template.index("atom_type") + 1])), _template_grain(template, number))
            for template in templates
            if template[3].startswith("particletemplate/")
        ]
    # LAMMPS: molecules may have spheres of any type (0). Else "fix ID GROUP pour N TYPE …" has the type in its sixth
    # word. deposit has spheres as create_atoms has them.
    if "mol" in words:
        return [(0, UNKNOWN)]
    grains = _poured_grains(words, number) if words[3] == "pour" else [DEFAULT]
    return [(int(number(words[5])), grain) for grain in grains]


def _poured_grains(words: Sequence[str], number: _Number) -> list[Grain]:
    """Return the sizes of a line `fix … pour`: diam one D, diam range LOW HIGH, diam poly N D1 P1 …, dens LOW HIGH.

    Old lines have diam LOW HIGH. `words` are those of the line, and `number` returns the number that a word says.
    """
    # Without these words diameter and density are 1 (`FixPour::options`).
    place = words.index("diam") + 1 if "diam" in words else 0
    kind = words[place] if place else ""
    diameters = [(1.0, 1.0)]
    # poly: N diameters D1, D2, …, each followed by its share P1, P2, … of the spheres.
    if kind == "poly":
        count = int(number(words[place + 1]))
        diameters = [(number(word), number(word)) for word in words[place + 2 : place + 2 + 2 * count : 2]]
    elif kind:
        place += kind in ("one", "range")  # old lines have no such word
        low = number(words[place])
        diameters = [(low, low if kind == "one" else number(words[place + 1]))]
    place = words.index("dens") + 1 if "dens" in words else 0
    densities = (number(words[place]), number(words[place + 1])) if place else (1.0, 1.0)
    return [Grain(((low / 2, densities[0]), (high / 2, densities[1]))) for low, high in diameters]


def _template_grain(words: Sequence[str], number: _Number) -> Grain:
    """Return the sizes of a line `fix … particletemplate/sphere` of LIGGGHTS.

    They are `radius constant R`, `radius uniform LOW HIGH`, and the same for `density`; None stands for a number of
    another distribution. `words` are those of the line, and `number` returns the number that a word says.
    """

    def ends(name: str) -> list[float | None]:
        """Return the number, or the least and the largest, that follow "NAME constant" or "NAME uniform"."""
        place = words.index(name) + 1 if name in words else len(words)
        count = {"constant": 1, "uniform": 2}.get("".join(words[place : place + 1]), 0)
        return [number(word) for word in words[place + 1 : place + 1 + count]] or [None]

    # "fix ID GROUP STYLE …": other styles, such as multisphere, are bodies of several spheres.
    if words[3] != "particletemplate/sphere":
        return UNKNOWN
    radii, densities = ends("radius"), ends("density")
    return Grain(((radii[0], densities[0]), (radii[-1], densities[-1])))


def data_grains(text: str) -> tuple[int, dict[int, list[Grain]]]:
    """Return the number of types in `text`, a file of read_data, and by type the sizes of its spheres.

    The file has a line such as "2 atom types", and after the line "Atoms" rows of atom_style sphere: ID, type,
    diameter, density and place.
    """
    types, section = 0, ""
    # By type: radius and density of its spheres, each once.
    spheres: dict[int, dict[Sphere, None]] = {}
    for row in text.split("\n"):
        # Only the first four words are read; a limit makes the split of many rows faster.
        words = row.split(None, 5)
        if words and words[0][0].isalpha():
            section = words[0]
        elif words[1:4] == ["atom", "types"] and not section:
            types = int(words[0])
        elif section == "Atoms" and words and not words[0].startswith("#"):
            radius, density = float(words[2]) / 2, float(words[3])
            if radius > 0:  # others touch nothing
                spheres.setdefault(int(words[1]), {})[radius, density] = None
    return types, {number: [Grain((end,)) for end in extremes(ends)] for number, ends in spheres.items()}
