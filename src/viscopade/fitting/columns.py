"""Columns of a sheet: which are known by their headers, and their numbers in SI units."""

from __future__ import annotations

import math
import re
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field

import numpy as np

from viscopade.arrays.checked import FloatArray
from viscopade.fitting.contacts import ContactTime
from viscopade.fitting.flight import Flight
from viscopade.fitting.sheets import HEAD, Sheet
from viscopade.quantity import factor, quantity
from viscopade.records import Node

COLUMNS: Mapping[str, tuple[str, tuple[str, ...]]] = {
    "speed": ("speed", ("speed", "v", "velocity", "impact_speed", "impact_velocity", "speed_in", "v_in")),
    "speed_out": ("speed", ("speed_out", "v_out", "rebound_speed", "rebound_velocity")),
    "epsilon": ("", ("epsilon", "eps", "e", "cor", "restitution", "coefficient_of_restitution")),
    "sigma_epsilon": ("", ("sigma_epsilon", "epsilon_error", "eps_error", "sigma_eps", "e_error", "cor_error")),
    "sigma_speed": ("speed", ("sigma_speed", "speed_error", "v_error", "sigma_v")),
    "contact_time": ("time", ("contact_time", "t_c", "tc")),
    "time": ("time", ("time", "t", "bounce_time", "instant", "event_time", "impact_time")),
    "release_time": ("time", ("release_time",)),
    "interval": ("time", ("interval",)),
    "height": ("length", ("height", "h")),
    "drop_height": ("length", ("drop_height", "release_height", "h0")),
    "rebound_height": ("length", ("rebound_height", "h1")),
    "sigma": ("", ("sigma", "error", "sigma_time", "sigma_height", "time_error", "height_error")),
    "position": ("length", ("position", "y", "z", "y_position", "position_y")),
    "frame": ("", ("frame", "slice", "image")),
    "drop": ("", ("drop", "run", "series")),
}
"""By column, its dimension and the names in a header that stand for it, in small letters with _ for other signs."""

_NAMES = {also: name for name, (_, every) in COLUMNS.items() for also in every}
_NAMES |= {"start": "bounce_0", "stop": "bounce_1"}  # of phyphox, as are bounce_K and stop_K
_BOUNCE = re.compile(r"(?:bounce|stop)_([0-9]{1,3})")
IN_VACUUM = Flight()


@dataclass(frozen=True)
class Options:
    """How files are read.

    Attributes
    ----------
    columns : mapping
        By name of `COLUMNS`, a column's header in the file, with or without its unit, or its number from 1 on.
    units : mapping
        Units by name of `COLUMNS`, for columns without one in the header.
    flight : Flight
        In SI units.
    resolution : str or None
        Standard error of instants, heights or speeds, with a unit or in SI units, unless the file has a column of them.
    contact_time : float or Pair
        Duration of contacts between flights, or the bodies, as for `bounces.of_times`.
    scatter : bool or None
        As for `Points.measured`.
    rate : float or None
        Frames per second.
    length_per_unit : float or None
        Of positions without a unit of length, in metres.
    sheets : sequence of str
        Names of the sheets to read; all if there are none.
    without : sequence of str
        Lines to leave out: "7", or "drop.csv:7" with the name of a file or a sheet; or labels of points.
    """

    columns: Mapping[str, str] = field(default_factory=dict)
    units: Mapping[str, str] = field(default_factory=dict)
    flight: Flight = IN_VACUUM
    resolution: str | None = None
    contact_time: ContactTime = 0.0
    scatter: bool | None = None
    rate: float | None = None
    length_per_unit: float | None = None
    sheets: Sequence[str] = ()
    without: Sequence[str] = ()


def _plain(name: str) -> str:
    """Return a header without its unit, in small letters with _ for other signs."""
    match = HEAD.fullmatch(name.strip())
    bare = (match[1] if match else name).lower().replace("ε", "epsilon").replace("σ", "sigma")
    return re.sub(r"[^a-z0-9]+", "_", bare).strip("_")


def places_of(header: Sequence[str], text: str) -> list[int]:
    """Return the indices of the columns that an option names: by their header, without its unit, or by their number."""
    exact = [i for i, cell in enumerate(header) if cell.strip() == text]
    same = exact or [i for i, cell in enumerate(header) if _plain(cell) == _plain(text) != ""]
    return same or ([int(text) - 1] if text.isdecimal() and 0 < int(text) <= len(header) else [])


def known_columns(header: Sequence[str], options: Options) -> dict[str, list[int]]:
    """Return the indices of the columns that are known, by their names in `COLUMNS` or "bounce_K"."""
    given = {name: places for name, text in options.columns.items() if (places := places_of(header, text))}
    taken = {i for places in given.values() for i in places}
    found: dict[str, list[int]] = {}
    for i, cell in enumerate(header):
        plain = _plain(cell)
        match = _BOUNCE.fullmatch(plain)
        name = f"bounce_{int(match[1])}" if match else _NAMES.get(plain)
        if name and name not in options.columns and i not in taken:
            found.setdefault(name, []).append(i)
    return found | given


class Columns:
    """Columns of a sheet that are known, as numbers in SI units.

    Attributes
    ----------
    sheet : Sheet
    options : Options
    known : dict
        As `known_columns` returns them.
    rows, lines : list
        The rows with data, and their lines in the file.
    prefix : str
        What labels of rows begin with.
    """

    def __init__(self, sheet: Sheet, options: Options, first: str) -> None:
        self.sheet, self.options = sheet, options
        self.known = known_columns(sheet.header, options)
        self.rows, self.lines = sheet.rows, list(sheet.lines)
        self.prefix = ""
        self._second: dict[str, str] = {}  # what a second line of headers has
        try:
            np.array([row[self.known[first][0]] for row in self.rows], dtype=np.float64)
        except (ValueError, IndexError):
            self._skip_what_is_no_data()

    def _skip_what_is_no_data(self) -> None:
        """Skip rows that are blank in all known columns, and lines between the header and the first number."""
        every = {name: i for name, places in self.known.items() if name != "drop" for i in places}
        full = [k for k, row in enumerate(self.rows) if any(i < len(row) and row[i].strip() for i in every.values())]
        while full:
            first = {
                name: self.rows[full[0]][i].strip("()[] ") for name, i in every.items() if i < len(self.rows[full[0]])
            }
            if any(cell.lower() == "nan" or not math.isnan(self._number(cell)) for cell in first.values()):
                break
            self._second |= first
            full.pop(0)
        self.rows, self.lines = [self.rows[k] for k in full], [self.lines[k] for k in full]

    def leave_out(self, line: int) -> None:
        """Take out a line of the file."""
        k = self.lines.index(line)
        self.rows, self.lines = self.rows[:k] + self.rows[k + 1 :], self.lines[:k] + self.lines[k + 1 :]

    @property
    def labels(self) -> list[str]:
        """Names of the rows."""
        return [f"{self.prefix}line {line}" for line in self.lines]

    def column(self, name: str) -> int:
        """Return the index of a column."""
        places = self.known[name]
        if len(places) > 1:
            first, second = (f"{self.sheet.header[i].strip()!r} (column {i + 1})" for i in places[:2])
            raise ValueError(f"{first} and {second} both are {name}: expected one, chosen by --column {name}=NUMBER")
        return places[0]

    def cells(self, name: str) -> list[str]:
        """Return the texts in a column."""
        column = self.column(name)
        return [row[column].strip() if column < len(row) else "" for row in self.rows]

    def numbers(self, name: str, dimension: str = "", *, blank: bool = False, least: str = "") -> FloatArray:
        """Return a column; a blank cell is NaN if that is accepted, and `least` is the condition > 0 or >= 0."""
        cells = self.cells(name)
        try:
            found = np.array(cells, dtype=np.float64)
        except ValueError:
            found = np.array([self._number(cell) for cell in cells])
        bad = ~np.isfinite(found) | ((found < 0) if least else False) | ((found == 0) if least == " > 0" else False)
        if blank:
            bad &= np.array([cell.lower() not in ("", "nan") for cell in cells], dtype=bool)
        if bad.any():
            i = int(np.argmax(bad))
            raise ValueError(f"{self.labels[i]}: {name} is {cells[i]!r}: expected a number{least}")
        return found * self._unit(name, dimension or COLUMNS[name][0])

    def _number(self, cell: str) -> float:
        try:
            return float(cell.replace(",", ".") if self.sheet.comma else cell)
        except ValueError:
            return math.nan

    def _unit(self, name: str, dimension: str) -> float:
        match = HEAD.fullmatch(self.sheet.header[self.column(name)].strip())
        written = ((match[2] if match else "") or self._second.get(name, "")).strip()
        unit = self.options.units.get(name) or written
        if written and name in self.options.units:
            raise ValueError(f"the column {name} has the unit {written!r} in its header: expected no other one")
        if name == "position" and self.options.length_per_unit is not None:
            return self.options.length_per_unit
        if not unit:
            return 1.0
        if not dimension:
            if unit in ("%", "-", "1"):
                return 0.01 if unit == "%" else 1.0
            raise ValueError(f"the unit of {name} is {unit!r}: expected none, or %")
        return factor(Node(self.sheet.source, f"the unit of {name}", unit), dimension)[1]

    def sigma(self, dimension: str) -> FloatArray:
        """Return the standard errors of the rows; 0 if they are not known."""
        given = self.options.resolution
        if "sigma" in self.known:
            if given is not None:
                raise ValueError("there is a column of standard errors: expected no --resolution besides")
            return self.numbers("sigma", dimension, least=" >= 0")
        plain = math.nan if given is None else self._number(given)
        node = Node(self.sheet.source, "resolution", given if math.isnan(plain) else plain)
        return np.full(len(self.rows), 0.0 if given is None else quantity(node, dimension))

    def drops(self) -> list[list[int]]:
        """Return the rows of each drop."""
        rows: dict[str, list[int]] = {}
        for i, key in enumerate(self.cells("drop") if "drop" in self.known else [""] * len(self.rows)):
            rows.setdefault(key, []).append(i)
        return list(rows.values())
