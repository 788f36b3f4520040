"""Reader of measured data, from several files and sheets at once: columns that `forms` recognises become points.

    H (cm), h (cm), sigma_h, remark
    50.0,   32.1,   0.2,     first ball
    50.0,   31.8,   0.2,

Here H and h are a drop and its rebound, sigma_h has the standard errors of h in its unit, and the remark is not used.
Values become SI units, a row a point, and each refusal names the file, the line, the value and the expected one.
"""

from __future__ import annotations

import math
import re
from collections.abc import Callable, Mapping, Sequence
from contextlib import suppress
from dataclasses import dataclass, field, replace
from decimal import Decimal
from functools import cached_property
from itertools import chain, product
from pathlib import PurePath
from typing import Any, NamedTuple

import numpy as np

from viscopade.arrays.checked import FloatArray
from viscopade.fitting import bounces, forms, tracks
from viscopade.fitting.contacts import ContactTime
from viscopade.fitting.flight import Flight
from viscopade.fitting.points import Points
from viscopade.fitting.sheets import Sheet, cell_of, sheets
from viscopade.quantity import DIMENSIONS, quantity, unit_in_si
from viscopade.records import Node

SLOWEST, FAST, FASTEST = 1e-9, 100.0, 1e4
"""Range of speeds that is read, in m/s; those above the middle one need an explicit unit.

The limits were chosen by hand. Speeds in cm/s or mm/s read as m/s are often above 100; impacts above 10 km/s are no
bounces, and below 1 nm/s no measurement.
"""

IN_VACUUM = Flight()
_SAME_INSTANT = 6  # decimals of seconds in which equal instants in two sheets agree: no sound is timed to a microsecond
# Rows of units between the header and the numbers, at most, chosen by hand: programs write one or two; more rows
# without a number are data that cannot be read, and are refused as such.
_ROWS_OF_UNITS = 5
# A number in ASCII digits with a decimal point, such as "1", "-.5", "1.", "1e-3"
_NUMBER = re.compile(r"[+-]?(?:[0-9]+[.]?[0-9]*|[.][0-9]+)(?:[eE][+-]?[0-9]+)?")
# In a cell that is data, and so no unit: it begins with a number, "-1.2", or has a digit that begins a word, "t = 3",
# or is nan. Digits behind a letter, _, ^ or a minus sign may be the power of a unit: "m2", "s^2", "m s-1", "s⁻1".
_DATA = re.compile(r"^[+-]?[.]?[0-9]|(?<![\w^⁻-])[0-9]|^nan$", re.IGNORECASE)
# Columns in which each value follows the one in the row above it: an eps is the ratio of two, or its root. (For
# instants, `bounces.audible_bounces` finds those that are missing.)
_CHAINS = (("height",), ("interval",))
# "1,234": a comma that may separate thousands, or be a decimal sign
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
    read : tuple of mapping
        For each "sheet" that is read: the quantities, each with its "column", "unit", where this comes from, and the
        column of its "error"; the "rows" with the first and last of their "lines", and the "unused" columns.
    left_out : tuple
        Labels of rows and contacts that give no eps, each with the reason.
    warnings : tuple of str
        Sentences on what does not fit.
    flights : tuple of FreeFlight
        Of tracks.
    doubtful_scale : bool
        Whether the flights of a track contradict its scale.
    """

    points: Points
    kind: str
    sheets: tuple[tuple[str, int | str], ...]
    read: tuple[Mapping[str, Any], ...]
    left_out: tuple[tuple[str, str], ...]
    warnings: tuple[str, ...]
    flights: tuple[tracks.FreeFlight, ...]
    doubtful_scale: bool


def recording(contents: Sequence[tuple[bytes, str]], options: Options = PLAIN) -> Recording:
    """Return the points in files, given by their `contents` (bytes, and the name for messages) and the options.

    In each file, all sheets of the same kind as the first one are read: speeds, instants, heights, or positions. A
    sheet is skipped if all its instants are in other sheets.

    Raises
    ------
    ValueError
        One line that names the file, the line in it, the value and the expected one.
    """
    # A reader for each sheet with data; all of one kind, and every column that an option names is in one of them.
    unread: list[tuple[str, str]] = []  # name of a sheet, and the reason
    readers = [reader for content, source in contents for reader in _readers_of_file(content, source, options, unread)]
    first, kind = readers[0], readers[0].form.kind
    for reader in readers:
        if reader.form.kind != kind:
            kinds = f"{reader.form.kind}, but {first.sheet.file} has {kind}"
            raise ValueError(f"{reader.sheet.file}: the file has {kinds}: expected files of one kind")
    for name in {*options.columns, *options.units}:
        if options.columns.get(name) != "-" and not any(reader.has(name) for reader in readers):
            raise _no_column(first.sheet, options, name)
    cells = sum(reader.counted for reader in readers)
    if cells > bounces.MOST_INSTANTS and kind in ("instants", "heights"):
        raise ValueError(f"{first.sheet.file}: there are {cells} {kind}: expected up to {bounces.MOST_INSTANTS}")
    # Leave out sheets that repeat others, then lines that options name.
    for reader in _repeated_sheets(readers):
        unread.append((reader.sheet.name, "its instants are in other sheets"))
        readers.remove(reader)
    labels = _leave_out(readers, options.without)
    # Sheets with too few bounces are reported; any other fault ends the reading.
    points_by_reader: list[tuple[_Reader, Points]] = []
    for reader in readers:
        reader.prefix = f"{reader.sheet.name}, " * (len(readers) > 1)
        try:
            points_by_reader.append((reader, reader.points()))
        except bounces.TooFew as error:
            unread.append((reader.sheet.name, str(error)))
        except ValueError as error:
            place = "" if str(error).startswith(reader.sheet.file) else f"{reader.sheet.source}: "
            raise ValueError(f"{place}{error}") from None
    if not points_by_reader:
        raise ValueError(f"{readers[-1].sheet.source}: {unread[-1][1]}")
    used, tables = [reader for reader, _ in points_by_reader], [table for _, table in points_by_reader]
    points = bounces.concatenate(tables) if len(tables) > 1 else tables[0]
    points = points.without(labels) if labels else points
    points = points.without_scatter() if options.scatter is False else points
    return Recording(
        points,
        kind,
        (*((reader.sheet.name, len(table)) for reader, table in points_by_reader), *unread),
        tuple(reader.columns_read() for reader in used),
        tuple(chain.from_iterable(reader.left_out for reader in readers)),
        tuple(chain.from_iterable(reader.warnings for reader in used)),
        tuple(chain.from_iterable(reader.flights for reader in used)),
        any(reader.doubtful_scale for reader in used),
    )


def _readers_of_file(content: bytes, source: str, options: Options, unread: list[tuple[str, str]]) -> list[_Reader]:
    """Return the readers of a file's sheets; add sheets without data, or with another kind of it, to `unread`.

    `content` is that of the file, and `source` its name for messages; the options are those of the user.
    """
    # The sheets that --sheet names, or all of them
    all_sheets = sheets(content, source, lambda cells: forms.layout(cells, options.columns))
    chosen = [sheet for sheet in all_sheets if not options.sheets or sheet.sheet in options.sheets]
    if not chosen:
        names = ", ".join(repr(sheet.sheet) for sheet in all_sheets if sheet.sheet) or "none"
        raise ValueError(f"{source}: there is no sheet {options.sheets[0]!r}: its sheets are {names}")
    # Those with data of the kind of the first one
    readers: list[_Reader] = []
    for sheet in chosen:
        form = sheet.layout and sheet.layout.form
        if sheet.layout and form and (not readers or form.kind == readers[0].form.kind):
            readers.append(_Reader(sheet, sheet.layout, options))
        else:
            unread.append((sheet.name, f"{form.kind} beside others" if form else "no columns of data"))
    if not readers:
        raise _no_column(chosen[0], options)
    return readers


def _repeated_sheets(readers: Sequence[_Reader]) -> list[_Reader]:
    """Return the sheets whose instants are all in a larger sheet of their file; `readers` are those of all sheets.

    Errors in them are reported later.
    """
    # The rounded instants of each sheet with times of impacts (times of flight begin at 0 in every sheet)
    bounce_readers = [
        reader for reader in readers if reader.form.kind == "instants" and "flights" not in reader.form.needed
    ]
    sheet_instants: list[tuple[_Reader, set[float]]] = []
    for reader in bounce_readers if len(readers) > 1 else ():
        with suppress(ValueError):
            sheet_instants.append(
                (reader, {round(t, _SAME_INSTANT) for drop in reader.instants() for t in drop.values.tolist()})
            )
    # Sorted by size, each sheet is compared with the larger ones: a subset is a repetition.
    sheet_instants.sort(key=lambda entry: len(entry[1]))
    pairs = (
        (reader, instants, larger, larger_instants)
        for k, (reader, instants) in enumerate(sheet_instants)
        for larger, larger_instants in sheet_instants[k + 1 :]
    )
    repeated = {
        reader: None
        for reader, instants, larger, larger_instants in pairs
        if instants <= larger_instants and reader.sheet.file == larger.sheet.file
    }
    return [*repeated]


def _no_column(sheet: Sheet, options: Options, name: str = "") -> ValueError:
    """Return the error for a sheet that lacks the necessary columns, or one that an option names.

    `name` is the quantity for which an option asks, if it is that.
    """
    # The message shows up to 12 headers of up to 40 characters: a few lines of a terminal; chosen by hand.
    header = ", ".join(repr(cell.strip()[:40]) for cell in sheet.header[:12])
    absent = [text for text in options.columns.values() if text != "-" and not forms.places_of(sheet.header, text)]
    if absent:
        return ValueError(f"{sheet.source}: there is no column {absent[0]!r}: {header}")
    if name:
        return ValueError(f"{sheet.source}: there is no column {name!r}: expected one, because an option names it")
    # The only column whose header ends in a unit is suggested as a quantity of this unit. One of several may be a row
    # of rebounds: read alone, the releases of several drops would be the rebounds of one.
    units = {"time": "time", "length": "height", "speed": "speed"}
    pairs = product((cell.strip() for cell in sheet.header), units)
    suggested = [f"{units[dimension]}={cell!r}" for cell, dimension in pairs if forms.has_unit(cell, dimension)]
    example = (suggested or [f"speed={sheet.header[0].strip()[:40]!r}"])[0]
    how = f", such as --column {example}" if len(suggested) < 2 else ""
    accepted = "names such as time (s); height (cm); speed (m/s), epsilon"
    rows = "or H (cm), h1 (cm), h2 (cm) for a drop in a row"
    text = f"the columns are {header}: expected {accepted}; {rows}; or --column NAME=HEADER{how}"
    return ValueError(f"{sheet.source}: {text}; --unit NAME=UNIT gives a unit")


def _leave_out(readers: Sequence[_Reader], without: Sequence[str]) -> list[str]:
    """Leave lines out of the readers; return the labels of points among `without`, whose texts are as in `Options`."""
    labels = []
    for text in dict.fromkeys(without):
        # "NAME:7" or "7" is a line, of a file or a sheet; any other text is a label, such as "7, h2".
        name, _, line = text.rpartition(":")
        with_line = [reader for reader in readers if line.isdecimal() and int(line) in reader.lines]
        meant = [reader for reader in with_line if name in ("", reader.sheet.sheet, PurePath(reader.sheet.file).name)]
        if len(meant) > 1:
            raise ValueError(f"line {line} is in {len(meant)} sheets or files: expected NAME:{line}")
        if meant:
            k = meant[0].lines.index(int(line))
            del meant[0].lines[k], meant[0].rows[k]
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
    follows_gap: bool = False  # whether a value before the first one is missing

    def select(self, indices: Sequence[int]) -> Sequel:
        """Return the values at these indices, with their labels, errors and durations."""
        durations = None if self.durations is None else self.durations[indices]
        return Sequel(self.values[indices], [self.labels[i] for i in indices], self.sigma[indices], durations)

    def split_at_gaps(self, numbers: FloatArray | None = None) -> list[Sequel]:
        """Return the runs of values between missing ones; `numbers` of the values rise by 1, or by more at a gap."""
        finite = np.flatnonzero(np.isfinite(self.values))
        steps = np.diff(finite if numbers is None else numbers[finite])
        runs = np.split(finite, np.flatnonzero(steps > 1) + 1)
        return [replace(self.select(run.tolist()), follows_gap=k > 0) for k, run in enumerate(runs) if len(run)]

    def split_before(self, indices: Sequence[int]) -> list[Sequel]:
        """Return the runs of values that begin at these indices, and the one before them."""
        return [self.select(run.tolist()) for run in np.split(np.arange(len(self.values)), indices)]


class _Unit(NamedTuple):
    """A unit as written, its size in SI units, and where it comes from."""

    text: str
    size: float
    origin: str


class _Column(NamedTuple):
    """A column in SI units, with its unit as written and where this comes from, and its standard errors."""

    values: FloatArray
    unit: str
    origin: str
    sigma: FloatArray


class _Reader:
    """A sheet of one form, as numbers in SI units.

    Attributes
    ----------
    sheet, layout, options : Sheet, SheetLayout, Options
    rows, lines : list
        The rows with data, and their lines in the file.
    prefix : str
        Beginning of the labels of rows.
    left_out, warnings, flights, doubtful_scale
        As in `Recording`; the first three are lists.
    """

    def __init__(self, sheet: Sheet, layout: forms.SheetLayout, options: Options) -> None:
        """Take the rows with data of a sheet, and the units in rows between its header and the first number.

        `sheet` has the cells below the header, `layout` says which columns have which quantity, and `options` are those
        of the user.
        """
        self.sheet, self.layout, self.options, self.form, self.prefix = sheet, layout, options, layout.form, ""
        self.left_out: list[tuple[str, str]] = []
        self.warnings: list[str] = []
        self.flights: list[tracks.FreeFlight] = []
        self.doubtful_scale = False
        read_columns = [i for name, places in layout.places.items() if name != "drop" for i in places]
        filled_rows = [k for k, row in enumerate(sheet.rows) if any(cell_of(row, i) != "" for i in read_columns)]
        # Rows without data between the header and the first number have units, "m/s" or "(m/s)", or nothing, such as
        # lines of dashes. Those of all columns are taken, because some that are not read here may have errors.
        self._units_below: dict[int, str] = {}  # index of a column -> text
        rows_of_units = 0
        for k in filled_rows[:_ROWS_OF_UNITS]:
            texts = {
                i: str(cell_of(sheet.rows[k], i)).strip("()[] ") for i in {*read_columns, *range(len(sheet.header))}
            }
            # Beside a unit, 1 is the unit of a plain number. Units are of the dimensions that `forms.QUANTITIES` have.
            has_unit = any(
                unit_in_si(texts[i], dimension) for i in read_columns for dimension in ("speed", "length", "time")
            )
            if any(_DATA.search(texts[i]) and not (has_unit and texts[i] == "1") for i in read_columns):
                break
            self._units_below |= {i: text for i, text in texts.items() if any(c.isalpha() or c == "%" for c in text)}
            rows_of_units += 1
        data_rows = filled_rows[rows_of_units:]
        self.rows, self.lines = [sheet.rows[k] for k in data_rows], [sheet.lines[k] for k in data_rows]

    @property
    def labels(self) -> list[str]:
        """Labels of the rows, for messages."""
        return [f"{self.prefix}line {line}" for line in self.lines]

    @property
    def counted(self) -> int:
        """Number of cells with measured values, blank ones included."""
        return len(self.rows) * sum(len(self.layout.places[name]) for name in self.form.measured)

    # --- columns ------------------------------------------------------------------------------------------------------

    @cached_property
    def errors(self) -> dict[int, int]:
        """The column with the standard errors of each column that has them."""
        return self.layout.errors()

    def has(self, name: str) -> bool:
        """Return whether there is a column of a quantity, or of its errors."""
        indices = self.layout.places.get(name.removeprefix("sigma_"), ()) if name.startswith("sigma_") else ()
        return name in self.layout.places or any(i in self.errors for i in indices)

    def columns(self, name: str) -> list[_Column]:
        """Return the columns of a quantity; blank cells are NaN, and refused beside a speed."""
        return [self._column(i, name) for i in self.layout.columns(name)]

    def values(self, name: str) -> FloatArray:
        """Return the values of a quantity of one column."""
        return self.columns(name)[0].values

    def _column(self, i: int, name: str) -> _Column:
        """Return column i, which has the quantity of this name, in SI units, with its standard errors."""
        dimension, resolution = forms.measured_quantity(name).dimension, self.options.resolution
        # Values without a unit are in the SI unit, the first in `DIMENSIONS`, of the size 1; a plain number has none.
        values, sigma, j = self._numbers(i, name), np.zeros(len(self.rows)), self.errors.get(i)
        unit = self._unit(i, name) or _Unit(DIMENSIONS.get(dimension, ("",))[0], 1.0, "plain numbers")
        # Standard errors: --resolution for all rows, or a column, in its own unit or that of the quantity.
        if self.errors and resolution is not None:
            raise ValueError("there is a column of standard errors: expected no --resolution")
        if resolution is not None and name in self.form.measured:
            plain = float(resolution) if _NUMBER.fullmatch(resolution) else resolution
            sigma += quantity(Node(self.sheet.source, "resolution", plain), dimension)
        elif j is not None:
            error_unit = self._unit(j, f"sigma_{name}") or _Unit("", unit.size, "")
            if error_unit.text == "%" != unit.text:
                raise ValueError(f"the errors of {name} are in %, but {name} is not: expected one unit")
            sigma = self._numbers(j, f"sigma_{name}") * error_unit.size
            if (blank := np.isfinite(values) & np.isnan(sigma)).any():
                raise ValueError(f"{self.labels[int(np.argmax(blank))]}: sigma_{name} is '': expected a number >= 0")
        # Cells of a spreadsheet that show 90 % have the number 0.9, so that a unit % divides twice: eps of 1 % or less
        # at all points is hardly meant.
        if unit.text == "%" and name == "epsilon" and len(values) and (values <= 1).all():
            text = f"all numbers are {values.max():g} % or less: is the unit right?"
            raise ValueError(f"{self.layout.cells[i]!r}: {text} Expected numbers such as 90, or a header without %")
        return _Column(values * unit.size, unit.text, unit.origin, sigma)

    def _numbers(self, i: int, name: str) -> FloatArray:
        """Return the numbers of column i as written, NaN for blank cells; ValueError names the first bad cell."""
        cells, condition = [cell_of(row, i) for row in self.rows], forms.measured_quantity(name).condition
        condition = " >= 0" if name.startswith("sigma_") else condition
        may_be_blank = self.form.kind != "speeds" or condition == " >= 0"
        values = np.array([self._number(cell) for cell in cells])
        # Numbers out of range are bad, and so are blank cells beside a speed.
        bad = ~np.isfinite(values) | ((values < 0) if condition else False)
        bad |= (values == 0) if condition == " > 0" else False
        bad &= [not may_be_blank or str(cell).lower() not in ("", "nan") for cell in cells]
        if bad.any():
            k = int(np.argmax(bad))
            cell, accepted = str(cells[k]), f"expected a number{condition}" + ", or an empty cell" * may_be_blank
            if any(sign in cell for sign in ("±", "+-", "+/-")):
                accepted = "expected its error in a column +/- beside it"
            # "90 %" for a plain number: the message has the number, in hundredths.
            percent = self._number(cell.removesuffix("%").strip()) if cell.endswith("%") else math.nan
            if math.isfinite(percent) and not forms.measured_quantity(name).dimension:
                accepted = f"write {name} as {percent / 100:g}, or % in the header"
            raise ValueError(f"{self.labels[k]}: {name} is {cell!r}: {accepted}")
        return values

    def _number(self, cell: str | float) -> float:
        """Return the number in a cell; NaN if it has none."""
        text = str(cell).replace(",", ".") if self._decimal_comma else str(cell)
        return float(text) if _NUMBER.fullmatch(text) else math.nan

    @cached_property
    def _decimal_comma(self) -> bool:
        """Whether the decimal sign is a comma, by all texts that are read."""
        read_columns = {i for name, indices in self.layout.places.items() if name != "drop" for i in indices} | {
            *self.errors.values()
        }
        texts = [
            (k, str(cell))
            for k, row in enumerate(self.rows)
            for i in read_columns
            if isinstance(cell := cell_of(row, i), str)
        ]
        commas, points = ([(k, text) for k, text in texts if sign in text] for sign in ",.")
        # A comma before three digits may separate thousands: if that is so of all commas, the file is refused. But
        # programs separate cells by ; because numbers have decimal commas.
        thousands = self.sheet.separator != ";" and all(_THOUSANDS.fullmatch(text) for _, text in commas)
        if commas and (points or thousands):
            k, text = commas[0]
            contradiction = (
                f"{self.labels[points[0][0]]} has {points[0][1]!r}" if points else f"it may be {text.replace(',', '')}"
            )
            raise ValueError(
                f"{self.labels[k]}: {text!r} has a comma, {contradiction}: expected no thousands separators"
            )
        if ambiguous := [(k, text) for k, text in commas if _THOUSANDS.fullmatch(text) and self.sheet.separator != ";"]:
            k, text = ambiguous[0]
            reading = f"{text!r} is read as {text.replace(',', '.')}, as other numbers have decimal commas"
            self.warnings.append(f"{self.labels[k]}: {reading}")
        return bool(commas)

    def _unit(self, i: int, name: str) -> _Unit | None:
        """Return the unit of column i, which has the quantity of this name, or its errors; None if it has no unit."""
        head, dimension = self.layout.headers[i], forms.measured_quantity(name).dimension
        # --length-per-unit, such as metres of a pixel, goes before any unit that is written.
        if name == "position" and self.options.length_per_unit is not None:
            length = self.options.length_per_unit
            return _Unit(f"{length:g} m", length, "--length-per-unit")
        option = self.options.units.get(name, "")
        # Units in the header, below it, and in an option must agree. `unit_in_si` gives a unit's name and its size in
        # SI units, or None for a text that is no unit of this dimension. written: text -> where it is, the last of
        # these places if a text is in several; "" is no unit.
        written = {head.unit: "its header", self._units_below.get(i, ""): "the row below the header", option: "--unit"}
        units_by_text = {text: unit_in_si(text, dimension) for text in written if text}
        if option:  # a text that is no unit gives way to the option
            units_by_text = {text: unit for text, unit in units_by_text.items() if text == option or unit}
        if bad := [text for text, unit in units_by_text.items() if not unit]:
            # The units of a plain number, which has no dimension, are none and per cent.
            units = " or ".join(DIMENSIONS.get(dimension, ("none", "%"))) + ", or --length-per-unit" * (
                name == "position"
            )
            where = f"{self.layout.cells[i]!r}: the unit of {name} is {bad[0]!r}"
            raise ValueError(f"{where}: expected {units}, or --unit {name}=UNIT")
        # unit[1]: sizes in SI units, so that "mm" and "millimeter" agree
        if len({unit[1] for unit in units_by_text.values() if unit}) > 1:
            texts = " and ".join(f"{text!r} in {written[text]}" for text in units_by_text)
            raise ValueError(f"the column {name} has the units {texts}: expected one unit")
        return next((_Unit(*unit, written[text]) for text, unit in units_by_text.items() if unit), None)

    def last_digit(self, name: str) -> float:
        """Return the value of one unit in the last digit of the column of a quantity (`name`), in SI units."""
        i = self.layout.places[name][0]
        cells = [str(cell_of(row, i)).replace(",", ".") for row in self.rows]
        # The finest digit of all cells: a number has the exponent e of its last digit, 10^e, in a Decimal; without any
        # number, it is 10^0.
        exponents = [int(Decimal(cell).as_tuple().exponent) for cell in cells if _NUMBER.fullmatch(cell)]
        unit = self._unit(i, name)
        return float(10.0 ** min(exponents, default=0)) * (unit.size if unit else 1.0)

    def columns_read(self) -> dict[str, Any]:
        """Return what was read from which column, for `Recording.read`."""
        facts: dict[str, Any] = {}
        cells, read_columns = self.layout.cells, {*self.errors.values()}
        for name in (*self.form.needed, *self.form.optional):
            if places := self.layout.places.get(name, ()):
                read_columns |= {*places}
                # The headers of the values, and those of their errors, each once: a text, a list for a series, or None.
                headers = [cells[i] for i in places], [*{cells[self.errors[i]]: 0 for i in places if i in self.errors}]
                column, error = (texts if len(texts) > 1 else texts[0] if texts else None for texts in headers)
                # One unit, or one for each column of a series
                columns = [self._column(i, name) for i in places if name != "drop"]
                units, origins = [c.unit for c in columns], dict.fromkeys(c.origin for c in columns)
                unit = units if len({*units}) > 1 else "".join(units[:1])
                facts[name] = {"column": column, "unit": unit, "unit_from": " and ".join(origins), "error": error}
        if (i := self.number_column) is not None:
            facts["number"] = {"column": cells[i], "unit": "", "unit_from": "plain numbers", "error": None}
            read_columns.add(i)
        unused = [cell for i, cell in enumerate(cells) if cell and i not in read_columns]
        rows = {"rows": len(self.lines), "lines": [self.lines[0], self.lines[-1]], "unused": unused}
        return {"sheet": self.sheet.name, **facts, **rows}

    # --- checks -------------------------------------------------------------------------------------------------------

    def points(self) -> Points:
        """Return the points, after checks of the options and the columns; ValueError says what is wrong."""
        # Options without use
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
        self._refuse_missing_units()
        points = _POINTS[form.kind](self)
        # The user's unit in an option, or the flights of a track, which have an acceleration to compare with g, tell
        # that speeds above FAST are meant.
        fastest = FASTEST if {*options.units} & {*form.needed} or form.kind == "positions" else FAST
        for k, (speed, error) in enumerate(zip(points.speed, points.standard_errors, strict=True)):
            if not SLOWEST <= speed <= fastest:
                text = f"the speed is {speed:.3g} m/s: expected {SLOWEST:g} to {fastest:g} m/s"
                raise ValueError(f"{points.labels[k]}: {text}; is the unit right? (--unit {form.needed[0]}=UNIT)")
            if error >= 1:  # eps is 0 to 1: such a point tells nothing, and its unit is wrong
                raise ValueError(f"{points.labels[k]}: the standard error of eps is {error:.3g}: expected less than 1")
        if len(points) > 1 and (points.epsilon == 1).all():
            raise ValueError("eps is 1 at all points: are the columns and the units right?")
        return points

    def _refuse_surplus_cells(self) -> None:
        """Raise ValueError if a row has cells to the right of the last name: all its numbers may be shifted."""
        # "1,5" between commas is two cells.
        names, comma = len(self.sheet.header), self.sheet.separator == ","
        accepted = "a decimal comma needs another separator, such as ;" if comma else "expected at most as many"
        for row, label in zip(self.rows, self.labels, strict=True):
            if surplus := [i for i in range(names, len(row)) if cell_of(row, i) != ""]:
                raise ValueError(f"{label}: {surplus[-1] + 1} cells under {names} names: {accepted}")

    def _refuse_second_reading(self) -> None:
        """Raise ValueError if a column beside a list of heights or instants may give them another meaning."""
        name, read_columns = self.form.needed[0], {i for places in self.layout.places.values() for i in places}
        is_alone = self.form.needed in (("height",), ("time",), ("interval",)) and name not in self.options.columns
        for i, head in enumerate(self.layout.headers if is_alone else ()):
            # Any other measured quantity may tell that the list is something else, such as independent falls.
            rivals = {*head.quantities} & {"speed", "speed_out", "epsilon", "e", "energy"}
            # Heights are of several falls, perhaps, if anything else was measured beside them; other heights, and the
            # number of a drop or a frame, leave their meaning.
            if name == "height":
                rivals = {*head.quantities} - {"height", "position", "drop_height", "drop", "frame"}
                rivals |= {
                    dimension
                    for dimension in ("length", "time", "speed")
                    if head.unit and unit_in_si(head.unit, dimension)
                }
            eps = ["epsilon"] if {"e", "energy"} & {*head.quantities} else []
            omitted = any(self.options.columns.get(meaning) == "-" for meaning in (*head.quantities, *eps))
            if rivals and i not in read_columns and not omitted and head.error_of is None:
                cell, list_header = self.layout.cells[i], self.layout.cells[self.layout.places[name][0]]
                may_be_epsilon = rivals <= {"epsilon", "e", "energy"}
                how = "a column speed, if it is eps" if may_be_epsilon else f"--column NAME={i + 1} with its quantity"
                alone_too = f"or --column {name}={list_header!r} for the {name} alone"
                raise ValueError(f"the column {cell!r} is not read beside {list_header!r}: expected {how}, {alone_too}")

    def _refuse_missing_units(self) -> None:
        """Raise ValueError if one of two columns of values has a unit other than the SI unit, and the other one none.

        Both have the same dimension. A column without a unit is read in SI units: beside one in SI units it is no
        contradiction, but beside one in cm it was probably meant in cm.
        """
        # Columns with a unit of another size than the SI unit's, 1, and columns without a unit
        names = [name for name in (*self.form.needed, *self.form.optional) if name in self.layout.places]
        places = [(i, name) for name in names for i in self.layout.columns(name)]
        units = [(i, name, unit) for i, name in places if (unit := self._unit(i, name)) and unit.size != 1]
        bare = [(i, name) for i, name in places if self._unit(i, name) is None]
        for (i, name, unit), (j, bare_name) in product(units, bare):
            # Plain numbers and labels have no dimension of `DIMENSIONS`, and need no unit.
            dimension = forms.measured_quantity(name).dimension
            if dimension == forms.measured_quantity(bare_name).dimension and dimension in DIMENSIONS:
                text = f"{self.layout.cells[i]!r} is in {unit.text}, but {self.layout.cells[j]!r} has no unit"
                raise ValueError(f"{text}: expected one, such as --unit {bare_name}={unit.text}")

    def warn_of_unused(self) -> None:
        """Add a warning for each column of numbers that is not read, if it may have errors."""
        read_columns = {i for places in self.layout.places.values() for i in places} | {*self.errors.values()}
        bare = [
            name for name in self.form.measured
            if f"sigma_{name}" not in self.layout.places and self.layout.places[name][0] not in self.errors
        ]  # fmt: skip
        for i, head in enumerate(self.layout.headers if bare else ()):
            # All cells are numbers, and they do not just count the rows.
            values = np.array([self._number(cell) for row in self.rows if (cell := cell_of(row, i)) != ""])
            counts = len(values) > 1 and (np.diff(values) == 1).all()  # numbers of rows
            if (
                i not in read_columns
                and not head.quantities
                and len(values)
                and np.isfinite(values).all()
                and not counts
            ):
                cell = self.layout.cells[i]
                column = repr(cell) if cell and self.layout.cells.count(cell) == 1 else f"{i + 1}"
                option = f"--column sigma_{bare[-1]}={column} if it is an error"
                self.warnings.append(f"the column {cell or i + 1!r} is not used: {option}")

    # --- drops --------------------------------------------------------------------------------------------------------

    def drops(self) -> list[list[int]]:
        """Return the indices of the rows of each drop: those with one text in the column drop, or all rows."""
        # text in the column -> indices of rows
        rows: dict[str, list[int]] = {}
        places = self.layout.columns("drop") if self.has("drop") else ()
        for k, row in enumerate(self.rows):
            rows.setdefault("".join(str(cell_of(row, i)) for i in places), []).append(k)
        return list(rows.values())

    @cached_property
    def number_column(self) -> int | None:
        """The index of a column that counts the values of a chain: whole numbers that rise, most of them by 1."""
        taken = {i for places in self.layout.places.values() for i in places} | {*self.errors.values()}
        for i in range(len(self.layout.headers)) if self.form.needed in _CHAINS else ():
            numbers = self._plain_numbers(i)
            steps = np.concatenate([np.diff(numbers[rows]) for rows in self.drops()])
            rises_by_1 = (numbers == np.round(numbers)).all() and 2 * np.count_nonzero(steps == 1) > len(steps)
            if i not in taken and rises_by_1 and (steps >= 1).all():
                return i
        return None

    def _plain_numbers(self, i: int) -> FloatArray:
        """Return the numbers in column i, NaN where a cell has none."""
        return np.array([self._number(cell_of(row, i)) for row in self.rows])

    def _numbers_in(self, rows: list[int]) -> FloatArray | None:
        """Return numbers of the rows of a drop that skip one where a value is missing; None outside of chains."""
        if self.form.needed not in _CHAINS:
            return None
        if self.number_column is not None:
            return self._plain_numbers(self.number_column)[rows]
        # One more for each line above that has no value, and is not among the rows. Some files have an empty line after
        # each; the rows of other drops may stand between those of this one.
        lines = np.array(self.lines, dtype=np.float64)
        empty_above = lines / min(np.diff(lines), default=1.0) - np.arange(len(lines))
        return np.arange(len(rows), dtype=np.float64) + empty_above[rows]

    def sequels(self) -> list[Sequel]:
        """Return the values of each drop in succession: down a column, or along the rows of several columns."""
        columns = [column for name in self.form.needed for column in self.columns(name)]
        values, sigma = np.array([column.values for column in columns]), np.array([column.sigma for column in columns])
        # One column: a drop is the rows of one number in the column drop.
        if len(columns) == 1:
            column = Sequel(values[0], self.labels, sigma[0], self.durations())
            return [run for rows in self.drops() for run in column.select(rows).split_at_gaps(self._numbers_in(rows))]
        # Several columns: each row is a drop, and its values are labelled "line 7, h2".
        heads = [self.layout.headers[i].name for name in self.form.needed for i in self.layout.columns(name)]
        rows = zip(self.labels, values.T, sigma.T, strict=True)
        drops = (Sequel(row, [f"{label}, {head}" for head in heads], error) for label, row, error in rows)
        return [run for drop in drops for run in drop.split_at_gaps()]

    def durations(self) -> FloatArray | None:
        """Return the durations of contacts in s, from a column release_time or contact_time; None if there is none."""
        # A contact ends when the body is released: at release_time.
        if "release_time" not in self.layout.places:
            return self.values("contact_time") if "contact_time" in self.layout.places else None
        durations = self.values("release_time") - self.values("time")
        if (durations < 0).any():
            label = self.labels[int(np.argmax(durations < 0))]
            raise ValueError(f"{label}: the release_time is before the impact: expected a later one")
        return durations

    def instants(self) -> list[Sequel]:
        """Return the instants of each drop; those of flights begin at 0."""
        of_flights = self.form.needed[0] in ("interval", "flights")
        return [_instants_of_flights(run) if of_flights else run for run in self.sequels()]


def _instants_of_flights(flights: Sequel) -> Sequel:
    """Return the instants of the bounces between flights; each has the error of the flight before it."""
    # The first bounce is at 0, and the others at the sums of the times of flight.
    labels = [f"the bounce before {flights.labels[0]}", *flights.labels]
    return Sequel(np.append(0.0, np.cumsum(flights.values)), labels, np.append(flights.sigma[0], flights.sigma))


# --- from columns to points -------------------------------------------------------------------------------------------


def _points_of_speeds(reader: _Reader) -> Points:
    """Return the points of collisions in the sheet of a reader: of speeds and eps, or of speeds before and after."""
    if "epsilon" in reader.form.needed and reader.options.resolution is not None:
        raise ValueError("--resolution is for instants, heights or speeds: expected a column sigma_epsilon")
    speed, (after,) = reader.columns("speed")[0], reader.columns(reader.form.needed[1])
    reader.warn_of_unused()
    if "speed_out" in reader.form.needed:
        errors = {"sigma": speed.sigma, "sigma_after": after.sigma}
        return bounces.of_speeds(speed.values, after.values, **errors, labels=reader.labels)
    # A column E is eps only if its numbers can be that, 0 to 1; e beside evenly spaced times may be anything.
    if reader.form.epsilon == "energy" and (out_of_range := ~((after.values > 0) & (after.values <= 1))).any():
        k = int(np.argmax(out_of_range))
        raise ValueError(f"{reader.labels[k]}: 'E' is {after.values[k]:g}: expected 0 to 1, or --column epsilon=E")
    time_columns = [i for i, head in enumerate(reader.layout.headers) if "time" in head.quantities]
    if reader.form.epsilon == "e" and any(bounces.evenly_spaced(reader._numbers(i, "time")) for i in time_columns):
        raise ValueError("the times are evenly spaced, as in a recording: expected --column epsilon=e if 'e' is eps")
    return Points.measured(
        speed.values, after.values, sigma_speed=speed.sigma, contact_time=reader.durations(),
        sigma_epsilon=after.sigma if reader.layout.places["epsilon"][0] in reader.errors else None,
        scatter=reader.options.scatter, labels=reader.labels,
    )  # fmt: skip


def _points_of_instants(reader: _Reader) -> Points:
    """Return the points of the bounces among instants; add other sounds to the reader's `left_out`."""
    # Times of flight T0, T1, …: the bounces are between them. Flights get shorter: if the median of the ratios of
    # successive ones is above 1, they are none.
    of_flights, runs = "flights" in reader.form.needed, list[Sequel]()
    flights = _successive(reader) if reader.form.needed[0] in ("flights", "interval") else []
    drops = [_instants_of_flights(run) for run in flights] or reader.sequels()
    if of_flights:
        if np.median(np.concatenate([run.values[1:] / run.values[:-1] for run in flights])) > 1:
            text = "most times of flight are longer than the one before: are they instants of bounces?"
            raise ValueError(f"{text} Then expected the columns bounce 0, bounce 1, …")
        runs = drops
    # Instants: find the bounces among the sounds of each drop.
    for drop in () if of_flights else drops:
        bounces.require_ascending(drop.values, drop.labels)
        if bounces.evenly_spaced(drop.values, reader.last_digit(reader.form.needed[0])):
            text = "expected times of bounces, or a column position too"
            raise ValueError(f"the times are evenly spaced, as in a recording: {text}")
        # The mean of the standard errors of the instants, which is 0 without errors: then an assumed one, in s
        bounce_runs, left_out = bounces.audible_bounces(drop.values, float(np.mean(drop.sigma)) or bounces.HEARING)
        reader.left_out += [(drop.labels[i], why) for i, why in left_out]
        runs += [drop.select(indices) for indices in bounce_runs]
    if not runs:
        why = "".join(f"; {label}: {why}" for label, why in reader.left_out[:3])  # three are enough in one line
        raise bounces.TooFew(f"no drop has three bounces in succession: expected three or more, for one eps{why}")
    return bounces.of_times(
        [(run.values, run.labels) for run in runs],
        reader.options.flight,
        sigma=[run.sigma for run in runs],
        contact_time=reader.options.contact_time,
        durations=[run.durations for run in runs if run.durations is not None],
        of_flights=reader.form.needed[0] in ("flights", "interval") and bool(reader.errors),
    )


def _successive(reader: _Reader) -> list[Sequel]:
    """Return the sequels of two values or more; add others to the reader's `left_out`."""
    # An eps is the ratio of two successive times of flight, or the root of that of two heights.
    sequels = reader.sequels()
    reader.left_out += [
        (sequel.labels[0], "the one before it is missing" if sequel.follows_gap else "no value follows it")
        for sequel in sequels
        if sequel.follows_gap or len(sequel.values) < 2
    ]
    if not (successive := [sequel for sequel in sequels if len(sequel.values) > 1]):
        raise bounces.TooFew("no drop has two heights or flights in succession: expected two or more, for one eps")
    return successive


def _points_of_heights(reader: _Reader) -> Points:
    """Return the points of drops and rebounds in the sheet of a reader.

    ValueError: the heights do not fall as those of one body do.
    """
    # A column of heights may be of independent drops; several columns may be in another order.
    drops = _successive(reader)
    advice = bounces.INDEPENDENT if reader.form.needed == ("height",) else bounces.ORDER
    for drop in drops:
        bounces.require_falling(drop.values, drop.labels, drop.sigma, advice)
    bounces.require_successive([drop.values for drop in drops])
    # A rebound may be missing without a mark: drops of several rebounds are split there.
    chains = [k for k, drop in enumerate(drops) if len(drop.values) > 2]
    unseen = bounces.unseen_rebounds([(drops[k].values, drops[k].sigma) for k in chains]) if chains else []
    reader.left_out += [(drops[k].labels[i], why) for k, seen in zip(chains, unseen, strict=True) for i, why in seen]
    for k, indices in reversed([*zip(chains, unseen, strict=True)]):
        drops[k : k + 1] = drops[k].split_before([i for i, _ in indices])
    labelled_drops = [(drop.values, drop.labels) for drop in drops]
    if np.ptp(np.concatenate([values for values, _ in labelled_drops])) == 0:
        raise ValueError(f"all heights are {drops[0].values[0]:.6g} m: {advice}")
    sigma, contact = [drop.sigma for drop in drops], reader.options.contact_time
    return bounces.of_heights(labelled_drops, reader.options.flight, sigma=sigma, contact_time=contact)


def _points_of_positions(reader: _Reader) -> Points:
    """Return the points of the contacts in tracks; frames without a position are skipped.

    Add the flights, the contacts without eps and the warnings to those of the reader.
    """
    clock, options, labels, points_by_drop = reader.form.needed[0], reader.options, reader.labels, list[Points]()
    if clock == "frame" and options.rate is None:
        raise ValueError("frames have no times: expected --rate, the number of frames per second")
    # t = frame/rate, or the column time, in s, for which the divisor is 1; and its last digit, of all rows, also in s
    frames_per_second = options.rate or 1.0
    times, (position,) = reader.values(clock) / frames_per_second, reader.columns("position")
    digit = reader.last_digit(clock) / frames_per_second
    for rows in reader.drops():
        complete_rows = [i for i in rows if math.isfinite(times[i]) and math.isfinite(position.values[i])]
        row_labels = [labels[i] for i in complete_rows]
        # Times without the rounding to their last digit, if they are those of a fixed rate
        frames = tracks.frame_times(times[complete_rows], row_labels, digit)
        track = tracks.of_track(
            frames, position.values[complete_rows], row_labels, options.flight, sigma=position.sigma[complete_rows],
            contact_time=options.contact_time,
        )  # fmt: skip
        points_by_drop.append(track.points)
        reader.flights += track.flights
        reader.left_out += track.left_out
        if not track.agrees:
            # The warning names the length of one unit of the file in metres: 1 without a unit, in SI units.
            unit = reader._unit(reader.layout.places["position"][0], "position")
            reader.warnings.append(track.warning(options.flight.gravity, unit.size if unit else 1.0, options.rate))
            reader.doubtful_scale = True
    return bounces.concatenate(points_by_drop)


_POINTS: Mapping[str, Callable[[_Reader], Points]] = {
    "speeds": _points_of_speeds,
    "instants": _points_of_instants,
    "heights": _points_of_heights,
    "positions": _points_of_positions,
}
"""Kind of a form -> the function that makes points of a sheet of it."""
