"""Columns of a sheet that are recognised by their headers, and their numbers in SI units."""

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
"""Dimension of each column, and the header names that stand for it, in lower case with _ for other characters."""

_NAMES = {also: name for name, (_, every) in COLUMNS.items() for also in every}
_NAMES |= {"start": "bounce_0", "stop": "bounce_1"}  # phyphox writes these, and bounce_K and stop_K
_BOUNCE = re.compile(r"(?:bounce|stop)_([0-9]{1,3})")
IN_VACUUM = Flight()


@dataclass(frozen=True)
class Options:
    """Options for reading files.

    Attributes
    ----------
    columns : mapping
        Key: a name of `COLUMNS`. Value: the column's header in the file, with or without its unit, or its number,
        counted from 1.
    units : mapping
        Units of columns whose header has none, by their names in `COLUMNS`.
    flight : Flight
        In SI units.
    resolution : str or None
        Standard error of instants, heights or speeds, with a unit or in SI units, if the file has no such column.
    contact_time : float or Pair
        Duration of contacts between flights, or the bodies, as for `bounces.of_times`.
    scatter : bool or None
        As for `Points.measured`.
    rate : float or None
        Frames per second.
    length_per_unit : float or None
        Length in metres of one unit of the positions, such as a pixel.
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
    """Return a header without its unit, in lower case with _ for other characters."""
    match = HEAD.fullmatch(name.strip())
    bare = (match[1] if match else name).lower().replace("ε", "epsilon").replace("σ", "sigma")
    return re.sub(r"[^a-z0-9]+", "_", bare).strip("_")


def places_of(header: Sequence[str], text: str) -> list[int]:
    """Return the indices of the columns that an option names: by their header, without its unit, or by their number."""
    exact = [i for i, cell in enumerate(header) if cell.strip() == text]
    same = exact or [i for i, cell in enumerate(header) if _plain(cell) == _plain(text) != ""]
    return same or ([int(text) - 1] if text.isdecimal() and 0 < int(text) <= len(header) else [])


def known_columns(header: Sequence[str], options: Options) -> dict[str, list[int]]:
    """Return the indices of the recognised columns, by their names in `COLUMNS` or "bounce_K"."""
    chosen = {name: places for name, text in options.columns.items() if (places := places_of(header, text))}
    taken = {i for places in chosen.values() for i in places}
    recognised: dict[str, list[int]] = {}
    for i, cell in enumerate(header):
        plain = _plain(cell)
        match = _BOUNCE.fullmatch(plain)
        name = f"bounce_{int(match[1])}" if match else _NAMES.get(plain)
        if name and name not in options.columns and i not in taken:
            recognised.setdefault(name, []).append(i)
    return recognised | chosen


class Columns:
    """Recognised columns of a sheet, as numbers in SI units.

    Attributes
    ----------
    sheet : Sheet
    options : Options
    known : dict
        Indices of columns, from `known_columns`.
    rows, lines : list
        The rows with data, and their lines in the file.
    prefix : str
        Beginning of the labels of rows.
    """

    def __init__(self, sheet: Sheet, options: Options, first: str) -> None:
        self.sheet, self.options = sheet, options
        self.known = known_columns(sheet.header, options)
        self.rows, self.lines = sheet.rows, list(sheet.lines)
        self.prefix = ""
        self._second: dict[str, str] = {}  # cells of a second line of headers, such as units
        try:
            np.array([row[self.known[first][0]] for row in self.rows], dtype=np.float64)
        except (ValueError, IndexError):
            self._skip_rows_without_data()

    def _skip_rows_without_data(self) -> None:
        """Skip rows that are blank in all recognised columns, and lines between the header and the first number."""
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

    def refuse_surplus_cells(self) -> None:
        """Raise ValueError if a row has cells to the right of the last name: all its numbers may be shifted."""
        names = len(self.sheet.header)
        for row, label in zip(self.rows, self.labels, strict=True):
            if any(cell.strip() for cell in row[names:]):
                cells = max(i for i, cell in enumerate(row, 1) if cell.strip())
                accepted = (
                    "expected at most as many"
                    if self.sheet.comma
                    else "a decimal comma needs another separator, such as ;"
                )
                raise ValueError(f"{label}: {cells} cells under {names} names: {accepted}")

    def leave_out(self, line: int) -> None:
        """Leave out a line of the file."""
        k = self.lines.index(line)
        self.rows, self.lines = self.rows[:k] + self.rows[k + 1 :], self.lines[:k] + self.lines[k + 1 :]

    @property
    def labels(self) -> list[str]:
        """Labels of the rows, for messages."""
        return [f"{self.prefix}line {line}" for line in self.lines]

    def column(self, name: str) -> int:
        """Return the index of a column."""
        places = self.known[name]
        if len(places) > 1:
            first, second = (f"{self.sheet.header[i].strip()!r} (column {i + 1})" for i in places[:2])
            raise ValueError(f"{first} and {second} are both {name}: expected one; choose with --column {name}=NUMBER")
        return places[0]

    def cells(self, name: str) -> list[str]:
        """Return the texts in a column."""
        column = self.column(name)
        return [row[column].strip() if column < len(row) else "" for row in self.rows]

    def numbers(self, name: str, dimension: str = "", *, blank: bool = False, least: str = "") -> FloatArray:
        """Return a column in SI units.

        With `blank`, a blank cell gives NaN. `least` is a condition on the numbers: " > 0" or " >= 0".
        """
        cells = self.cells(name)
        try:
            values = np.array(cells, dtype=np.float64)
        except ValueError:
            values = np.array([self._number(cell) for cell in cells])
        bad = ~np.isfinite(values) | ((values < 0) if least else False) | ((values == 0) if least == " > 0" else False)
        if blank:
            bad &= np.array([cell.lower() not in ("", "nan") for cell in cells], dtype=bool)
        if bad.any():
            i = int(np.argmax(bad))
            accepted = f"expected a number{least}"
            percent = self._number(cells[i].removesuffix("%")) if cells[i].endswith("%") else math.nan
            if math.isfinite(percent) and not COLUMNS[name][0]:
                accepted = f"write {name} as {percent / 100:g}, or % in the header"
            raise ValueError(f"{self.labels[i]}: {name} is {cells[i]!r}: {accepted}")
        return values * self._unit(name, dimension or COLUMNS[name][0])

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
            raise ValueError(f"the column {name} has the unit {written!r} in its header: expected no --unit for it")
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
        resolution = self.options.resolution
        if "sigma" in self.known:
            if resolution is not None:
                raise ValueError("there is a column of standard errors: expected no --resolution")
            return self.numbers("sigma", dimension, least=" >= 0")
        if resolution is None:
            return np.zeros(len(self.rows))
        plain = self._number(resolution)
        node = Node(self.sheet.source, "resolution", resolution if math.isnan(plain) else plain)
        return np.full(len(self.rows), quantity(node, dimension))

    def drops(self) -> list[list[int]]:
        """Return the rows of each drop."""
        rows: dict[str, list[int]] = {}
        for i, key in enumerate(self.cells("drop") if "drop" in self.known else [""] * len(self.rows)):
            rows.setdefault(key, []).append(i)
        return list(rows.values())
