"""Reader of measured data, from several files and sheets at once: columns that `forms` recognises become points."""

from __future__ import annotations

import math
import re
from collections.abc import Callable, Mapping, Sequence
from contextlib import suppress
from dataclasses import dataclass, field
from decimal import Decimal
from functools import cached_property
from pathlib import PurePath

import numpy as np

from viscopade.arrays.checked import FloatArray
from viscopade.fitting import bounces, forms, tracks
from viscopade.fitting.contacts import ContactTime
from viscopade.fitting.flight import Flight
from viscopade.fitting.points import Points
from viscopade.fitting.sheets import Sheet, sheets
from viscopade.quantity import DIMENSIONS, quantity, uncertain
from viscopade.records import Node

SLOWEST, FAST, FASTEST = 1e-9, 100.0, 1e4
"""Range of speeds that is read, in m/s; those above the middle one need an explicit unit."""

IN_VACUUM = Flight()
_EVEN = 4, 0.4, 1e-3  # more intervals, within this relative range, are no bounces if they shorten by less than this
_JITTER = 0.1  # of the time from frame to frame, besides the last digit
_SAME = 6  # decimals, in seconds, to which equal instants in two sheets agree
_ROWS_OF_UNITS = 5  # at most, between the header and the numbers
_RISE = 3.0  # standard errors by which a rebound may be higher than the height before it
_NUMBER = re.compile(r"[+-]?(?:[0-9]+[.]?[0-9]*|[.][0-9]+)(?:[eE][+-]?[0-9]+)?")
_THOUSANDS = re.compile(r"[+-]?[1-9][0-9]{0,2}(?:,[0-9]{3})+")


@dataclass(frozen=True)
class Options:
    """Options for reading files.

    Attributes
    ----------
    columns : mapping
        Key: a name in `forms.QUANTITIES`, or "sigma_" and such a name, for its standard errors. Value: the column's
        header in the file, with or without its unit, or its number, counted from 1; "-" if it is not to be read.
    units : mapping
        Units of columns by these names.
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


PLAIN = Options()


@dataclass(frozen=True)
class ColumnRead:
    """Columns of a quantity as they were read: their headers, their unit and its origin, and those of their errors."""

    columns: tuple[str, ...]
    unit: str
    unit_from: str
    errors: tuple[str, ...]


@dataclass(frozen=True)
class SheetRead:
    """What was read in a sheet.

    Attributes
    ----------
    name : str
    lines : tuple of int
        The rows with data, by their lines.
    quantities : mapping
        By the names in `forms.QUANTITIES` and `forms.SERIES`.
    unused : tuple of str
        Headers of columns that were not read.
    """

    name: str
    lines: tuple[int, ...]
    quantities: Mapping[str, ColumnRead]
    unused: tuple[str, ...]


@dataclass(frozen=True)
class Recording:
    """Measured points, with a report on the sheets they come from.

    Attributes
    ----------
    points : Points
        In SI units.
    kind : str
        "speeds", "instants", "heights" or "positions".
    sheets : tuple
        Name of each sheet with its number of points, or with the reason why it is not read.
    left_out : tuple
        Labels of rows and contacts that give no eps, each with the reason.
    read : tuple of SheetRead
        The columns that were read, and those that were not.
    warnings : tuple of str
        Sentences on what does not fit.
    flights : tuple of FreeFlight
        Of tracks.
    """

    points: Points
    kind: str
    sheets: tuple[tuple[str, int | str], ...]
    left_out: tuple[tuple[str, str], ...]
    read: tuple[SheetRead, ...]
    warnings: tuple[str, ...]
    flights: tuple[tracks.FreeFlight, ...]


def recording(contents: Sequence[tuple[bytes, str]], options: Options = PLAIN) -> Recording:
    """Return the points in files, given by their contents and names.

    In each file, all sheets of the same kind as the first one are read: speeds, instants, heights, or positions. A
    sheet is skipped if all its instants are in other sheets.

    Raises
    ------
    ValueError
        One line that names the file, the line in it, the value and the expected one.
    """
    readers: list[_Reader] = []
    unread: list[tuple[str, str]] = []
    for content, source in contents:
        readers += _of_file(content, source, options, unread)
    first = readers[0]
    for reader in readers:
        if reader.form.kind != first.form.kind:
            kinds = f"{reader.form.kind}, but {first.sheet.file} has {first.form.kind}"
            raise ValueError(f"{reader.sheet.file}: the file has {kinds}: expected files of one kind")
    for name in (*options.columns, *options.units):
        if options.columns.get(name) != "-" and not any(reader.known(name) for reader in readers):
            raise _no_column(first.sheet, options, name)
    if (cells := sum(reader.counted for reader in readers)) > bounces.MOST_INSTANTS:
        text = f"there are {cells} {first.form.kind}: expected up to {bounces.MOST_INSTANTS}"
        raise ValueError(f"{first.sheet.file}: {text}")
    for reader in _twice(readers):
        unread.append((reader.sheet.name, "its instants are in other sheets"))
        readers.remove(reader)
    labels = _leave_out(readers, options.without)
    read: list[tuple[str, int]] = []
    parts: list[Points] = []
    described: list[SheetRead] = []
    for reader in readers:
        reader.prefix = f"{reader.sheet.name}, " * (len(readers) > 1)
        try:
            parts.append(reader.points())
            read.append((reader.sheet.name, len(parts[-1])))
            described.append(reader.described())
        except bounces.TooFew as error:
            unread.append((reader.sheet.name, str(error)))
        except ValueError as error:
            message = str(error)
            named = message.startswith(reader.sheet.file)
            raise ValueError(message if named else f"{reader.sheet.source}: {message}") from None
    if not parts:
        raise ValueError(f"{readers[-1].sheet.source}: {unread[-1][1]}")
    points = parts[0] if len(parts) == 1 else bounces.together(parts)
    points = points.without(labels) if labels else points
    points = points.without_scatter() if options.scatter is False else points
    left_out = tuple(each for reader in readers for each in reader.left_out)
    warnings = tuple(each for reader in readers for each in reader.warnings)
    flights = tuple(each for reader in readers for each in reader.flights)
    return Recording(points, first.form.kind, (*read, *unread), left_out, tuple(described), warnings, flights)


def _of_file(content: bytes, source: str, options: Options, unread: list[tuple[str, str]]) -> list[_Reader]:
    """Return the readers of a file's sheets; add sheets without data, or with another kind of it, to `unread`."""

    def recognised(header: Sequence[str]) -> int:
        layout = forms.layout(header, options.columns)
        return sum(map(len, layout.places.values())) if layout else 0

    readers: list[_Reader] = []
    every = sheets(content, source, recognised)
    chosen = [sheet for sheet in every if not options.sheets or sheet.sheet in options.sheets]
    if not chosen:
        names = ", ".join(repr(sheet.sheet) for sheet in every if sheet.sheet) or "none"
        raise ValueError(f"{source}: there is no sheet {options.sheets[0]!r}: its sheets are {names}")
    for sheet in chosen:
        layout = forms.layout(sheet.header, options.columns)
        if layout and (not readers or layout.form.kind == readers[0].form.kind):
            readers.append(_Reader(sheet, layout, options))
        else:
            unread.append((sheet.name, f"{layout.form.kind} beside others" if layout else "no columns of data"))
    if not readers:
        raise _no_column(chosen[0], options)
    return readers


def _twice(readers: Sequence[_Reader]) -> list[_Reader]:
    """Return the sheets whose instants are all in larger sheets of their file; errors in them are reported later."""
    every: list[tuple[_Reader, set[float]]] = []
    for reader in readers if len(readers) > 1 else ():
        with suppress(ValueError):
            if reader.form.kind == "instants" and "flights" not in reader.form.needed:
                every.append((reader, {round(t, _SAME) for drop in reader.instants() for t in drop.values.tolist()}))
    seen: dict[str, set[float]] = {}
    twice = []
    for reader, mine in sorted(every, key=lambda each: -len(each[1])):
        others = seen.setdefault(reader.sheet.file, set())
        twice += [reader] if mine <= others else []
        others |= mine
    return twice


def _no_column(sheet: Sheet, options: Options, name: str = "") -> ValueError:
    """Return the error for a sheet that lacks the necessary columns, or one that an option names."""
    header = ", ".join(repr(cell.strip()[:40]) for cell in sheet.header[:12])
    missing = [text for text in options.columns.values() if text != "-" and not forms.places_of(sheet.header, text)]
    if missing:
        return ValueError(f"{sheet.source}: there is no column {missing[0]!r}: {header}")
    if name:
        return ValueError(f"{sheet.source}: there is no column {name!r}: expected one, because an option names it")
    accepted = "; or ".join(form.header for form in forms.FORMS if form.epsilon == "epsilon")
    how = "--column NAME=HEADER gives the name of a column, and --unit NAME=UNIT its unit"
    return ValueError(f"{sheet.source}: the columns are {header}: expected {accepted}; {how}")


def _leave_out(readers: Sequence[_Reader], without: Sequence[str]) -> list[str]:
    """Leave lines out of the readers; return the labels of points among `without`."""
    labels = []
    for text in dict.fromkeys(without):
        name, _, line = text.rpartition(":")
        with_line = [reader for reader in readers if line.isdecimal() and int(line) in reader.lines]
        places = [each for each in with_line if name in ("", each.sheet.sheet, PurePath(each.sheet.file).name)]
        if len(places) > 1:
            raise ValueError(f"line {line} is in {len(places)} sheets or files: expected NAME:{line}")
        if places:
            k = places[0].lines.index(int(line))
            del places[0].lines[k], places[0].rows[k]
        elif line.isdecimal():
            ends = " to ".join(map(str, readers[0].lines[:1] + readers[0].lines[-1:])) or "none"
            raise ValueError(f"{readers[0].sheet.source}: there is no line {text} with data: expected {ends}")
        else:
            labels.append("line " + text.removeprefix("line "))
    return labels


@dataclass(frozen=True)
class Sequel:
    """Values of one drop in succession, with their labels and standard errors, and durations of contacts if known."""

    values: FloatArray
    labels: list[str]
    sigma: FloatArray
    durations: FloatArray | None = None

    def part(self, places: Sequence[int]) -> Sequel:
        """Return the values at these indices."""
        durations = None if self.durations is None else self.durations[places]
        return Sequel(self.values[places], [self.labels[i] for i in places], self.sigma[places], durations)

    def unbroken(self) -> list[Sequel]:
        """Return the parts between missing values."""
        seen = np.flatnonzero(np.isfinite(self.values))
        parts = np.split(seen, np.flatnonzero(np.diff(seen) > 1) + 1)
        return [self.part(part.tolist()) for part in parts if len(part)]


class _Reader:
    """A sheet of one form, as numbers in SI units.

    Attributes
    ----------
    sheet, layout, options : Sheet, SheetLayout, Options
    rows, lines : list
        The rows with data, and their lines in the file.
    prefix : str
        Beginning of the labels of rows.
    left_out, warnings, flights : list
        As in `Recording`.
    """

    def __init__(self, sheet: Sheet, layout: forms.SheetLayout, options: Options) -> None:
        self.sheet, self.layout, self.options, self.form = sheet, layout, options, layout.form
        self.prefix = ""
        self.left_out: list[tuple[str, str]] = []
        self.warnings: list[str] = []
        self.flights: list[tracks.FreeFlight] = []
        self._below: dict[int, str] = {}  # units in rows below the header
        used = [i for name, places in layout.places.items() if name != "drop" for i in places]
        full = [k for k, row in enumerate(sheet.rows) if any(_cell(row, i) != "" for i in used)]
        # Rows without a digit between the header and the first number have units, or nothing.
        first = 0
        while first < min(len(full), _ROWS_OF_UNITS) and all(
            self._is_unit(_cell(sheet.rows[full[first]], i), i) for i in used
        ):
            row = sheet.rows[full[first]]
            texts = {i: str(cell).strip("()[] ") for i, cell in enumerate(row)}
            self._below |= {i: text for i, text in texts.items() if any(c.isalpha() or c == "%" for c in text)}
            first += 1
        self.rows, self.lines = [sheet.rows[k] for k in full[first:]], [sheet.lines[k] for k in full[first:]]

    def _is_unit(self, cell: str | float, i: int) -> bool:
        if not isinstance(cell, str) or cell.lower() == "nan":
            return False
        dimensions = {forms.measured_quantity(name).dimension for name in self.layout.headers[i].quantities}
        unit = any(forms.size(cell.strip("()[] "), each) is not None for each in dimensions)
        return (unit and not _NUMBER.fullmatch(cell)) or not any(letter.isdigit() for letter in cell)

    @property
    def labels(self) -> list[str]:
        """Labels of the rows, for messages."""
        return [f"{self.prefix}line {line}" for line in self.lines]

    @property
    def counted(self) -> int:
        """Number of instants or heights in the sheet, blank cells included."""
        each = sum(len(self.layout.places[name]) for name in self.form.measured)
        return len(self.rows) * each if self.form.kind in ("instants", "heights") else 0

    # --- columns ---

    @cached_property
    def errors(self) -> dict[int, int]:
        """The column with the standard errors of each column that has them."""
        return self.layout.errors()

    def numbers(self, name: str, *, blank: bool = False) -> FloatArray:
        """Return the values of a quantity in SI units, with NaN for blank cells if these are allowed."""
        columns = self.layout.columns(name)
        each = [
            self._column(i, name, forms.measured_quantity(name).least, blank) * self._unit(i, name)[1] for i in columns
        ]
        return each[0] if name in forms.QUANTITIES else np.array(each).T

    def sigma(self, name: str) -> FloatArray:
        """Return the standard errors of a quantity in the same shape; 0 if they are not known."""
        resolution, each = self.options.resolution, []
        if self.errors and resolution is not None:
            raise ValueError("there is a column of standard errors: expected no --resolution")
        for i in self.layout.columns(name):
            if i in self.errors:
                j = self.errors[i]
                value, error = self._column(i, name, "", True), self._column(j, f"sigma_{name}", " >= 0", True)
                if (missing := np.isfinite(value) & np.isnan(error)).any():
                    label = self.labels[int(np.argmax(missing))]
                    raise ValueError(f"{label}: sigma_{name} is '': expected a number >= 0")
                each.append(error * self._unit(j, name, error_of=i)[1])
            elif resolution is not None:
                plain = float(resolution) if _NUMBER.fullmatch(resolution) else resolution
                node = Node(self.sheet.source, "resolution", plain)
                each.append(np.full(len(self.rows), quantity(node, forms.measured_quantity(name).dimension)))
            else:
                each.append(np.zeros(len(self.rows)))
        return each[0] if name in forms.QUANTITIES else np.array(each).T

    def last_digit(self, name: str) -> float:
        """Return the value of one unit in the last digit of a column, in SI units."""
        i = self.layout.places[name][0]
        cells = [str(_cell(row, i)).replace(",", ".") for row in self.rows]
        digits = [int(Decimal(cell).as_tuple().exponent) for cell in cells if _NUMBER.fullmatch(cell)]
        return float(10.0 ** min(digits, default=0)) * self._unit(i, name)[1]

    def evenly_spaced(self, times: FloatArray) -> bool:
        """Return whether times are those of a recording: the spans of bounces get shorter."""
        spans = np.diff(times)
        if len(spans) <= _EVEN[0] or np.ptp(spans) > _EVEN[1] * abs(spans.mean()):
            return False
        half = len(spans) // 2
        change = abs(float(spans[half:].mean() / spans[:half].mean()) - 1)
        digit = self.last_digit("time") if "time" in self.layout.places else 0.0
        return change <= _EVEN[2] * half + 2 * digit / half / float(spans.mean())

    def known(self, name: str) -> bool:
        """Return whether there is a column of a quantity, or of its errors."""
        of = self.layout.places.get(name.removeprefix("sigma_"), ())
        return name in self.layout.places or any(i in self.errors for i in of)

    def _column(self, i: int, name: str, least: str, blank: bool) -> FloatArray:
        cells = [_cell(row, i) for row in self.rows]
        values = np.array([self._number(cell) for cell in cells])
        bad = ~np.isfinite(values) | ((values < 0) if least else False) | ((values == 0) if least == " > 0" else False)
        if blank:
            bad &= np.array([str(cell).lower() not in ("", "nan") for cell in cells], dtype=bool)
        if bad.any():
            k = int(np.argmax(bad))
            cell, accepted = str(cells[k]), f"expected a number{least}"
            percent = self._number(cell.removesuffix("%").strip()) if cell.endswith("%") else math.nan
            if math.isfinite(percent) and not forms.measured_quantity(name.removeprefix("sigma_")).dimension:
                accepted = f"write {name} as {percent / 100:g}, or % in the header"
            raise ValueError(f"{self.labels[k]}: {name} is {cell!r}: {accepted}")
        return values

    def _number(self, cell: str | float) -> float:
        if isinstance(cell, str):
            text = cell.replace(",", ".") if self._decimal_comma else cell
            return float(text) if _NUMBER.fullmatch(text) else math.nan
        return float(cell)

    @cached_property
    def _decimal_comma(self) -> bool:
        """Whether the decimal sign is a comma, by all cells that are read."""
        used = {i for name, places in self.layout.places.items() if name != "drop" for i in places} | {
            *self.errors.values()
        }
        texts = [(k, cell) for k, row in enumerate(self.rows) for i in used if isinstance(cell := _cell(row, i), str)]
        with_comma, with_point = ([(k, cell) for k, cell in texts if sign in cell] for sign in (",", "."))
        if with_comma and with_point:
            shown = " and ".join(f"{cell!r} in {self.labels[k]}" for k, cell in (with_comma[0], with_point[0]))
            raise ValueError(
                f"numbers have both commas and points, {shown}: expected one decimal sign, and no thousands separators"
            )
        # Programs separate cells by ; because numbers have decimal commas.
        if with_comma and self.sheet.separator != ";" and all(_THOUSANDS.fullmatch(cell) for _, cell in with_comma):
            k, cell = with_comma[0]
            shown = f"{cell.replace(',', '.')} or {cell.replace(',', '')}"
            raise ValueError(f"{self.labels[k]}: {cell!r} may be {shown}: expected no thousands separators")
        return bool(with_comma)

    def _unit(self, i: int, name: str, error_of: int | None = None) -> tuple[str, float, str]:
        """Return the unit of a column as written, its size and its origin."""
        head, dimension = self.layout.headers[i], forms.measured_quantity(name).dimension
        option = name if error_of is None else f"sigma_{name}"
        if name == "position" and self.options.length_per_unit is not None:
            return f"{self.options.length_per_unit:g} m", self.options.length_per_unit, "--length-per-unit"
        written = {"its header": "" if head.doubtful else head.unit, "the row below the header": self._below.get(i, "")}
        if option in self.options.units:  # a text that is no unit gives way to the option
            written = {key: text for key, text in written.items() if forms.size(text, dimension) is not None}
            written["--unit"] = self.options.units[option]
        elif head.doubtful:
            cell = self.layout.cells[i].strip()
            raise ValueError(f"{cell!r} ends in {head.unit!r}, no unit of {name}: expected --unit {option}=UNIT")
        sizes = {text: (forms.size(text, dimension), origin) for origin, text in written.items() if text}
        for text, (size, _) in sizes.items():
            if size is None:
                units = " or ".join(DIMENSIONS.get(dimension, ("none", "%")))
                how = " or --length-per-unit" * (name == "position")
                raise ValueError(f"the unit of {option} is {text!r}: expected {units}, or --unit {option}=UNIT{how}")
        if len({size for size, _ in sizes.values()}) > 1:
            texts = " and ".join(f"{text!r} in {origin}" for text, (_, origin) in sizes.items())
            raise ValueError(f"the column {option} has the units {texts}: expected one unit")
        if error_of is not None:
            own = self._unit(error_of, name)
            if not sizes:
                return own[0], own[1], f"that of {name}"
            if not dimension and "%" in sizes and own[0] != "%":
                raise ValueError(f"the errors of {name} are in %, but {name} is not: expected one unit")
        for text, (size, origin) in sizes.items():
            assert size is not None
            return text, size, origin
        return DIMENSIONS.get(dimension, ("",))[0], 1.0, "plain numbers"

    def described(self) -> SheetRead:
        """Return the columns that were read."""
        cells, found, used = [cell.strip() for cell in self.layout.cells], {}, {*self.errors.values()}
        for name in (*self.form.needed, *self.form.optional):
            places = self.layout.places.get(name, ())
            used |= {*places}
            if places:
                unit, _, origin = self._unit(places[0], name) if name not in ("drop", "frame") else ("", 1.0, "")
                errors = dict.fromkeys(cells[self.errors[i]] for i in places if i in self.errors)
                found[name] = ColumnRead(tuple(cells[i] for i in places), unit, origin, tuple(errors))
        unused = tuple(cell for i, cell in enumerate(cells) if cell and i not in used)
        return SheetRead(self.sheet.name, tuple(self.lines), found, unused)

    # --- checks ---

    def points(self) -> Points:
        """Check the options against the columns, and return the points."""
        options, form = self.options, self.form
        if form.kind == "speeds" and options.flight != IN_VACUUM:
            raise ValueError("columns speed and epsilon need no flight: expected no gravity and no drag")
        if form.kind == "speeds" and options.contact_time and isinstance(options.contact_time, float):
            raise ValueError("--contact-time is for bounces: expected a column contact_time beside speed and epsilon")
        for name, column in (("rate", "frame"), ("length_per_unit", "position")):
            value, flag = getattr(options, name), "--" + name.replace("_", "-")
            if value is not None and column not in form.needed:
                raise ValueError(f"{flag} is given: expected a column {column} with it")
            if value is not None and not 0 < value < math.inf:
                raise ValueError(f"{flag} is {value:g}: expected a number > 0")
        if not self.rows:
            raise bounces.TooFew("there are no rows with data")
        self._refuse_surplus_cells()
        self._refuse_second_reading()
        points = _POINTS[form.kind](self)
        # The flights of a track tell whether its units are right.
        fastest = FASTEST if {*options.units} & {*form.needed} or form.kind == "positions" else FAST
        if (bad := ~((points.speed >= SLOWEST) & (points.speed <= fastest))).any():
            i = int(np.argmax(bad))
            raise ValueError(
                f"{points.labels[i]}: the speed is {points.speed[i]:.3g} m/s: expected {SLOWEST:g} to {fastest:g} m/s; "
                f"is the unit right? (--unit {form.needed[0]}=UNIT)"
            )
        if ((errors := points.standard_errors) >= 1).any():
            i = int(np.argmax(errors >= 1))
            raise ValueError(f"{points.labels[i]}: the standard error of eps is {errors[i]:.3g}: expected less than 1")
        if (points.epsilon == 1).all():
            raise ValueError("eps is 1 at all points: are the columns and the units right?")
        return points

    def _refuse_surplus_cells(self) -> None:
        """Raise ValueError if a row has cells to the right of the last name: all its numbers may be shifted."""
        names = len(self.sheet.header)
        for row, label in zip(self.rows, self.labels, strict=True):
            if len(row) > names and any(_cell(row, i) != "" for i in range(names, len(row))):
                cells = max(i for i in range(len(row)) if _cell(row, i) != "") + 1
                comma = self.sheet.separator == ","
                accepted = "a decimal comma needs another separator, such as ;" if comma else "expected at most as many"
                raise ValueError(f"{label}: {cells} cells under {names} names: {accepted}")

    def _refuse_second_reading(self) -> None:
        """Raise ValueError if a column beside a list of heights or instants may give them another meaning."""
        (name, *more), read = self.form.needed, {i for places in self.layout.places.values() for i in places}
        for i, head in enumerate(self.layout.headers):
            rivals = {*head.quantities} & {"speed", "speed_out", "epsilon"}
            if name == "height":  # of several falls, perhaps, if anything else was measured beside it
                rivals = {*head.quantities} - {"height", "position", "drop_height", "drop", "frame", "energy", "e"}
                rivals |= {each for each in ("length", "time", "speed") if head.unit and forms.size(head.unit, each)}
            listed = not more and name in ("height", "time", "interval") and name not in self.options.columns
            omitted = any(self.options.columns.get(each) == "-" for each in head.quantities)
            if listed and i not in read and not omitted and head.error_of is None and rivals:
                text = f"the column {self.layout.cells[i].strip()!r} is not read beside {self._header(name)!r}"
                raise ValueError(
                    f"{text}: expected --column NAME={i + 1} with the name of its quantity, or "
                    f"--column {name}={self._header(name)!r} for the {name} alone"
                )

    def _header(self, name: str) -> str:
        return self.layout.cells[self.layout.places[name][0]].strip()

    # --- drops ---

    def drops(self) -> list[list[int]]:
        """Return the rows of each drop."""
        rows: dict[str, list[int]] = {}
        places = self.layout.columns("drop") if "drop" in self.layout.places else ()
        for k, row in enumerate(self.rows):
            rows.setdefault("".join(str(_cell(row, i)) for i in places), []).append(k)
        return list(rows.values())

    def sequels(self, *names: str) -> list[Sequel]:
        """Return the values of each drop in succession: down a column, or along the rows of several columns."""
        values, sigma = ([np.atleast_2d(read(name).T) for name in names] for read in (self._blank, self.sigma))
        every, errors = np.concatenate(values), np.concatenate(sigma)
        labels = self.labels
        if len(every) == 1:
            return [Sequel(every[0, of], [labels[k] for k in of], errors[0, of]) for of in self.drops()]
        heads = [self.layout.headers[i].name for name in names for i in self.layout.columns(name)]
        return [
            Sequel(every[:, k], [f"{label}, {head}" for head in heads], errors[:, k]) for k, label in enumerate(labels)
        ]

    def _blank(self, name: str) -> FloatArray:
        return self.numbers(name, blank=True)

    def instants(self) -> list[Sequel]:
        """Return the instants of each drop."""
        name = self.form.needed[0]
        drops = self.sequels(name)
        if name == "bounces":
            return [drop.part(np.flatnonzero(np.isfinite(drop.values)).tolist()) for drop in drops]
        if name == "interval":
            return [_summed(run) for drop in drops for run in drop.unbroken()]
        times = self.numbers("time")
        lasting = self.numbers("contact_time") if "contact_time" in self.layout.places else None
        if "release_time" in self.layout.places:
            lasting = self.numbers("release_time") - times
            if (lasting < 0).any():
                label = self.labels[int(np.argmax(lasting < 0))]
                raise ValueError(f"{label}: the release_time is before the impact: expected a later one")
        return [
            Sequel(drop.values, drop.labels, drop.sigma, None if lasting is None else lasting[of])
            for drop, of in zip(drops, self.drops(), strict=True)
        ]


def _cell(row: Sequence[str | float], i: int) -> str | float:
    """Return a cell of a row without blanks around it; "" if the row is too short."""
    cell = row[i] if i < len(row) else ""
    return cell.strip() if isinstance(cell, str) else cell


# --- from columns to points -------------------------------------------------------------------------------------------


def _speeds(reader: _Reader) -> Points:
    if "epsilon" in reader.form.needed and reader.options.resolution is not None:
        raise ValueError("--resolution is for instants, heights or speeds: expected a column sigma_epsilon")
    speed, sigma_speed = reader.numbers("speed"), reader.sigma("speed")
    if "epsilon" not in reader.form.needed:
        after, sigma = reader.numbers("speed_out"), reader.sigma("speed_out")
        sigma = sigma if sigma.any() else sigma_speed
        return bounces.of_speeds(speed, after, sigma=sigma_speed, sigma_after=sigma, labels=reader.labels)
    epsilon, times = reader.numbers("epsilon"), None
    if reader.form.epsilon == "energy" and not ((epsilon > 0) & (epsilon <= 1)).all():
        k = int(np.argmin((epsilon > 0) & (epsilon <= 1)))
        header = reader._header("epsilon")
        raise ValueError(
            f"{reader.labels[k]}: {header!r} is {epsilon[k]:g}: expected 0 to 1, or --column epsilon={header}"
        )
    beside = [i for i, head in enumerate(reader.layout.headers) if "time" in head.quantities]
    if reader.form.epsilon == "e" and any(reader.evenly_spaced(reader._column(i, "time", "", True)) for i in beside):
        raise ValueError("the times are evenly spaced, as in a recording: expected --column epsilon=e if 'e' is eps")
    if "contact_time" in reader.layout.places:
        times = reader.numbers("contact_time")
    return Points.measured(
        speed,
        epsilon,
        sigma_epsilon=reader.sigma("epsilon") if reader.layout.places["epsilon"][0] in reader.errors else None,
        sigma_speed=sigma_speed,
        contact_time=times,
        scatter=reader.options.scatter,
        labels=reader.labels,
    )


def _instants(reader: _Reader) -> Points:
    """Return the points of the bounces among instants; add other sounds to the reader's `left_out`."""
    if "flights" in reader.form.needed:
        return _flights(reader)
    runs: list[Sequel] = []
    for drop in reader.instants():
        if not len(drop.values):
            continue
        bounces.require_ascending(drop.values, drop.labels)
        if reader.evenly_spaced(drop.values):
            raise ValueError(
                "the times are evenly spaced, as in a recording: expected times of bounces, or a column position too"
            )
        sigma = float(np.mean(drop.sigma)) or bounces.HEARING
        heard, left_out = bounces.heard(drop.values, sigma)
        reader.left_out += [(drop.labels[i], why) for i, why in left_out]
        runs += [drop.part(places) for places in heard]
    if not runs:
        why = "".join(f"; {label}: {why}" for label, why in reader.left_out[:3])
        raise bounces.TooFew(f"no drop has three bounces in succession: expected three or more, for one eps{why}")
    return bounces.of_times(
        [(run.values, run.labels) for run in runs],
        reader.options.flight,
        sigma=[run.sigma for run in runs],
        contact_time=reader.options.contact_time,
        durations=[run.durations for run in runs if run.durations is not None],
        of_flights="interval" in reader.form.needed and bool(reader.errors),
    )


def _flights(reader: _Reader) -> Points:
    """Return the points of rows with successive times of flight."""
    runs = _pairs_or_more(reader, reader.sequels("flights"))
    if np.median(np.concatenate([run.values[1:] / run.values[:-1] for run in runs])) > 1:
        raise ValueError(
            "most times of flight are longer than the one before: are they instants of bounces? "
            "Then expected the columns bounce 0, bounce 1, …"
        )
    drops = [_summed(run) for run in runs]
    return bounces.of_times(
        [(drop.values, drop.labels) for drop in drops],
        reader.options.flight,
        sigma=[drop.sigma for drop in drops],
        contact_time=reader.options.contact_time,
        of_flights=bool(reader.errors),
    )


def _summed(flights: Sequel) -> Sequel:
    """Return the instants of the bounces between flights; each has the error of the flight before it."""
    return Sequel(
        np.append(0.0, np.cumsum(flights.values)),
        [f"the bounce before {flights.labels[0]}", *flights.labels],
        np.append(flights.sigma[0], flights.sigma),
    )


def _pairs_or_more(reader: _Reader, drops: Sequence[Sequel]) -> list[Sequel]:
    """Return the unbroken parts of drops with two values or more; add drops without one to the reader's `left_out`."""
    runs = []
    for drop in drops:
        found = [run for run in drop.unbroken() if len(run.values) > 1]
        runs += found
        if not found and len(drops) > 1:
            reader.left_out.append((drop.labels[0], "no two successive values"))
    if not runs:
        raise bounces.TooFew("no drop has two heights or flights in succession: expected two or more, for one eps")
    return runs


def _heights(reader: _Reader) -> Points:
    drops = _pairs_or_more(reader, reader.sequels(*reader.form.needed))
    independent = (
        "are these independent drops? Then expected drop_height and rebound_height, or a column drop with their numbers"
    )
    # A body cannot rise above the height that it fell from.
    for drop in drops:
        rise = np.diff(drop.values)
        high = rise > _RISE * np.hypot(drop.sigma[1:], drop.sigma[:-1])
        if high.any():
            k = int(np.argmax(high))
            before, after = drop.values[k : k + 2]
            raise ValueError(
                f"{drop.labels[k + 1]}: the height {after:.6g} m is above the one before it, {before:.6g} m: "
                f"{independent}; --resolution gives the error of the heights"
            )
    every = np.concatenate([drop.values for drop in drops])
    if np.ptp(every) == 0:
        raise ValueError(f"all heights are {every[0]:.6g} m: {independent}")
    return bounces.of_heights(
        [(drop.values, drop.labels) for drop in drops],
        reader.options.flight,
        sigma=[drop.sigma for drop in drops],
        contact_time=reader.options.contact_time,
    )


def _positions(reader: _Reader) -> Points:
    """Return the points of the contacts in tracks; frames without a position are skipped."""
    first, options = reader.form.needed[0], reader.options
    if first == "frame" and options.rate is None:
        raise ValueError("frames have no times: expected --rate, the number of frames per second")
    times = reader.numbers(first, blank=True) / (options.rate if first == "frame" and options.rate else 1.0)
    positions, sigma, labels = reader.numbers("position", blank=True), reader.sigma("position"), reader.labels
    made = []
    for rows in reader.drops():
        of = [i for i in rows if math.isfinite(times[i]) and math.isfinite(positions[i])]
        # Frames follow each other evenly, up to the last digit of their times, or after gaps of whole frames.
        spans = np.diff(times[of])
        frame = float(np.median(spans)) if len(spans) else 0.0
        digit = reader.last_digit(first)
        off = np.abs(spans - frame * np.maximum(np.round(spans / frame), 1)) if frame > 0 else np.ones_like(spans)
        uneven, reason = np.flatnonzero(off > digit + _JITTER * frame), f"there are {len(of)} frames"
        if len(uneven):
            k = int(uneven[0])
            reason = f"{labels[of[k + 1]]} is {spans[k]:.3g} s after the one before, usually it is {frame:.3g} s"
        if len(uneven) or len(of) < 2 * tracks.FEWEST:
            raise ValueError(
                f"{reason}: expected {2 * tracks.FEWEST} or more evenly spaced frames of a track; --column position=- "
                "reads the times of bounces alone, and --column time=- the heights alone"
            )
        kept = [labels[i] for i in of]
        track = tracks.of_track(
            times[of], positions[of], kept, options.flight, sigma=sigma[of], contact_time=options.contact_time
        )
        made.append(track.points)
        reader.flights += track.flights
        reader.left_out += track.left_out
        if not track.agrees:
            length = reader._unit(reader.layout.columns("position")[0], "position")[1]
            reader.warnings.append(_wrong_unit(track, options.flight.gravity, length))
    return bounces.together(made)


def _wrong_unit(track: tracks.Track, gravity: float, length: float) -> str:
    """Return the warning that the flights have another acceleration than g, with the length of a unit that gives g."""
    milli = f"{1000 * length * gravity / track.acceleration:.3g} mm"
    return (
        f"the flights accelerate with {uncertain(track.acceleration, track.standard_error)} m/s^2, not {gravity:.4g}: "
        f"--length-per-unit {milli!r} gives this, if the times are right; eps is fitted with their own acceleration"
    )


_POINTS: Mapping[str, Callable[[_Reader], Points]] = {
    "speeds": _speeds, "instants": _instants, "heights": _heights, "positions": _positions,
}  # fmt: skip
