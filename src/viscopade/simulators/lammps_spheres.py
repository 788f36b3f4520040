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
"""Radius and density."""

SETTABLE = ("diameter", "density", "density/disc", "mass", "type", "type/fraction", "type/ratio", "type/subset")
"""Keywords of the command `set` that `Spheres.set` takes."""
_MOST_TYPES = 1000
_MOST_SIZES = 6  # of one type that make a row each; more make a range
_MOST_GRAINS = 50  # of one type, before only the smallest and the largest are kept
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
DEFAULT = Grain(((0.5, 1.0),))  # `AtomVecSphere::create_atom_post`


class Spheres:
    """The spheres of all types.

    Attributes
    ----------
    types : int
        The number of types.
    grains : dict of int to dict of Grain to None
        By type.
    """

    def __init__(self) -> None:
        self.types = 0
        self.grains: dict[int, dict[Grain, None]] = {}

    def add(self, number: int, *grains: Grain) -> None:
        """Add spheres of a type; of type 0, as for molecules, spheres of all types of which nothing is known."""
        if number < 1:
            if self.types > _MOST_TYPES:
                raise ValueError(f"there are {self.types} types: expected at most {_MOST_TYPES}")
            for unknown in range(1, self.types + 1):
                self.add(unknown, UNKNOWN)
        else:
            self.types = max(self.types, number)
            several = self.grains.setdefault(number, {})
            several.update(dict.fromkeys(grains))
            if len(several) > _MOST_GRAINS:
                ends = extremes(end for grain in several for end in grain.ends)
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
        """Change spheres.

        Parameters
        ----------
        keyword : str
            One of `SETTABLE`.
        value : float or None
            None if each sphere has its own.
        types : tuple of range or None
            The types that change. None for another selection: it is a part of the spheres of any type that no such
            command has changed, and is the same part in later commands.
        selection : tuple of str
            Style and name.
        keeps_density : bool
            Whether another diameter keeps the density, as in LIGGGHTS, or the mass, as in LAMMPS.
        """
        before, self.grains = self.grains, {}
        is_new = types is None and not any(
            selection in grain.selections for grains in before.values() for grain in grains
        )
        for number, grain in ((number, grain) for number, grains in before.items() for grain in grains):
            is_member = selection in grain.selections or (is_new and not grain.selections)
            if types is not None:
                is_member = any(number in numbers for numbers in types)
            if not is_member or (is_new and types is None) or keyword.startswith("type/"):
                self.add(number, grain)
            if is_member and keyword.startswith("type"):
                self.add(int(value or number), grain)
            elif is_member:
                ends = tuple(_changed(keyword, value, *end, keeps_density=keeps_density) for end in grain.ends)
                self.add(number, Grain(ends, grain.selections | ({selection} if types is None else set())))

    def sizes(self, number: int) -> list[Sphere]:
        """Return the sizes of a type; of many sizes the smallest and the largest."""
        return extremes(end for grain in self.grains.get(number) or {UNKNOWN: None} for end in grain.ends)


def _changed(
    keyword: str, value: float | None, radius: float | None, density: float | None, *, keeps_density: bool
) -> Sphere:
    """Return a sphere after a command `set`."""
    if keyword == "density":
        return radius, value
    if keyword == "diameter":
        size = value and value / 2
        # mass = 4/3 pi r^3 density stays
        if size and radius and density and not keeps_density:
            density *= (radius / size) ** 3
        return size, density
    if value is None or radius is None:
        return radius, None
    # The mass of a disc is pi r^2 density.
    mass = value if keyword == "mass" else math.pi * radius**2 * value
    return radius, mass / (4 / 3 * math.pi * radius**3)


def extremes(spheres: Iterable[Sphere]) -> list[Sphere]:
    """Return different spheres, of many the smallest and the largest."""
    several = [*dict.fromkeys(spheres)]
    if len(several) <= _MOST_SIZES or any(None in sphere for sphere in several):
        return several
    return [min(several), max(several)]


def inserted_grains(
    words: Sequence[str], fixes: Mapping[str, Sequence[str]], number: _Number
) -> list[tuple[int, Grain]]:
    """Return types and sizes of a line `fix … pour`, `deposit` or `insert/…`; bodies of several spheres are unknown.

    Parameters
    ----------
    words : sequence of str
    fixes : mapping of str to sequence of str
        Words of all fixes by name.
    number : callable
        From a word to its number.
    """
    if "distributiontemplate" in words:
        distribution = fixes[words[words.index("distributiontemplate") + 1]]
        templates = [fixes[name] for name in distribution if name in fixes]
        return [
            (int(number(template[template.index("atom_type") + 1])), _template_grain(template, number))
            for template in templates
            if template[3].startswith("particletemplate/")
        ]
    if "mol" in words:
        return [(0, UNKNOWN)]
    grains = _poured_grains(words, number) if words[3] == "pour" else [DEFAULT]
    return [(int(number(words[5])), grain) for grain in grains]


def _poured_grains(words: Sequence[str], number: _Number) -> list[Grain]:
    """Return the sizes of a line `fix … pour`: diam one D, diam range LOW HIGH, diam poly N D1 P1 …, dens LOW HIGH.

    Old lines have diam LOW HIGH.
    """
    place = words.index("diam") + 1 if "diam" in words else 0
    kind = words[place] if place else ""
    diameters = [(1.0, 1.0)]
    if kind == "poly":
        count = int(number(words[place + 1]))
        diameters = [(number(word), number(word)) for word in words[place + 2 : place + 2 + 2 * count : 2]]
    elif kind:
        place += kind in ("one", "range")
        low = number(words[place])
        diameters = [(low, low if kind == "one" else number(words[place + 1]))]
    place = words.index("dens") + 1 if "dens" in words else 0
    densities = (number(words[place]), number(words[place + 1])) if place else (1.0, 1.0)
    return [Grain(((low / 2, densities[0]), (high / 2, densities[1]))) for low, high in diameters]


def _template_grain(words: Sequence[str], number: _Number) -> Grain:
    """Return the sizes of a line `fix … particletemplate/sphere`; None for other distributions than these two.

    They are `radius constant R`, `radius uniform LOW HIGH`, and the same for `density`.
    """

    def ends(name: str) -> list[float | None]:
        place = words.index(name) + 1 if name in words else len(words)
        count = {"constant": 1, "uniform": 2}.get("".join(words[place : place + 1]), 0)
        return [number(word) for word in words[place + 1 : place + 1 + count]] or [None]

    if words[3] != "particletemplate/sphere":
        return UNKNOWN
    radii, densities = ends("radius"), ends("density")
    return Grain(((radii[0], densities[0]), (radii[-1], densities[-1])))


def data_grains(text: str) -> tuple[int, dict[int, list[Grain]]]:
    """Return the number of types in a file of read_data, and by type the sizes of its spheres."""
    types, section = 0, ""
    spheres: dict[int, dict[Sphere, None]] = {}
    for row in text.split("\n"):
        part = row.split(None, 5)
        if part and part[0][0].isalpha():
            section = part[0]
        elif part[1:4] == ["atom", "types"] and not section:
            types = int(part[0])
        elif section == "Atoms" and part and not part[0].startswith("#"):
            radius, density = float(part[2]) / 2, float(part[3])
            if radius > 0:  # others touch nothing
                spheres.setdefault(int(part[1]), {})[radius, density] = None
    return types, {number: [Grain((end,)) for end in extremes(ends)] for number, ends in spheres.items()}
