"""Reader of measured data: CSV as programs write it, or a spreadsheet (XLS, XLSX, ODS), with units in the header.

A file has one of these sets of columns, and may have others besides:

- `speed`, `epsilon`, and if known `sigma_epsilon`, `sigma_speed` (standard errors) and `contact_time`;
- `time`: the instants at which the body hits the plane;
- `height`: the height of release, then those of the rebounds; or `drop_height` and `rebound_height`;
- `bounce 0`, `bounce 1`, …: the instants of one drop in a row, as phyphox exports its "(In)elastic collision".

A column `drop` tells the drops apart in a file with several. The column `sigma` has the standard errors of instants or
heights.
"""

from __future__ import annotations

import csv
import math
import re
from collections.abc import Callable, Iterable, Mapping, Sequence
from dataclasses import dataclass

import numpy as np

from viscopade import files
from viscopade.arrays.checked import FloatArray
from viscopade.fitting import bounces, spreadsheet
from viscopade.fitting.bounces import ContactTime
from viscopade.fitting.flight import Flight
from viscopade.fitting.points import Points
from viscopade.quantity import factor, quantity
from viscopade.records import Node

COLUMNS: Mapping[str, tuple[str, tuple[str, ...]]] = {
    "speed": ("speed", ("speed", "v", "velocity", "impact_speed", "impact_velocity")),
    "epsilon": ("", ("epsilon", "eps", "e", "cor", "restitution", "coefficient_of_restitution")),
    "sigma_epsilon": ("", ("sigma_epsilon", "epsilon_error", "eps_error", "sigma_eps", "e_error", "cor_error")),
    "sigma_speed": ("speed", ("sigma_speed", "speed_error", "v_error", "sigma_v")),
    "contact_time": ("time", ("contact_time", "t_c", "tc")),
    "time": ("time", ("time", "t", "bounce_time", "instant")),
    "height": ("length", ("height", "h")),
    "drop_height": ("length", ("drop_height", "release_height")),
    "rebound_height": ("length", ("rebound_height",)),
    "sigma": ("", ("sigma", "error", "sigma_time", "sigma_height", "time_error", "height_error")),
    "drop": ("", ("drop", "run", "series")),
}
"""By column, its dimension and the names in a header that stand for it, in small letters with _ for other signs."""

ACCEPTED = (
    "speed and epsilon; or time, the instants of bounces; or height, of release and rebounds; or drop_height and "
    "rebound_height; or phyphox's bounce 0, bounce 1, …"
)
SLOWEST, FASTEST, FASTEST_FLIGHT = 1e-9, 1e4, 100.0
"""Speeds that are read, and of bodies that fall, in m/s."""

_HEAD = re.compile(r"([^()\[\]]+)(?:[(\[]([^()\[\]]*)[)\]])?")
_BOUNCE = re.compile(r"bounce_([0-9]{1,3})")
_BLANK_SEPARATED = re.compile(r"[^\s()\[\]]+(?:\s*[(\[][^()\[\]]*[)\]])?")
_XLS, _ZIP = b"\xd0\xcf\x11\xe0", b"PK\x03\x04"


@dataclass(frozen=True)
class Cells:
    """Cells of a file.

    Attributes
    ----------
    source : str
        The file's name, for messages.
    header : tuple of str
    rows : list
        The cells, texts or numbers.
    lines : list of int
        The number of each row's line in the file.
    comma : bool
        Whether numbers have decimal commas.
    """

    source: str
    header: tuple[str, ...]
    rows: list[list[str]]
    lines: list[int]
    comma: bool = False


def sheets(content: bytes, source: str) -> list[Cells]:
    """Return the sheets in a file: one of a CSV, one for each sheet of a spreadsheet or file in a ZIP archive.

    Raises
    ------
    ValueError
        If the file is none of these, or empty.
    ModuleNotFoundError
        For a spreadsheet, if no package reads it.
    """
    if content.startswith(_ZIP) and not source.lower().endswith((".xlsx", ".ods")):
        return _archive(content, source)
    if content.startswith((_XLS, _ZIP)):
        return _sheets(content, source)
    if source.lower().endswith((".xls", ".xlsx", ".ods", ".zip")):
        raise ValueError(
            f"{source}: the file is no {source.rsplit('.', 1)[1].upper()}: accepted is what its name says, or CSV"
        )
    return [_csv(content, source)]


def _archive(content: bytes, source: str) -> list[Cells]:
    parts = files.members(content, source).items()
    found = [_csv(part, f"{source}/{name}") for name, part in parts if re.fullmatch(r"(?i)[^/]*\.csv", name)]
    if not found:
        raise ValueError(f"{source}: the ZIP archive has no CSV file: accepted is one with phyphox's CSV files")
    return found


def _sheets(content: bytes, source: str) -> list[Cells]:
    found = [
        Cells(f"{source}, sheet {name}", tuple(rows[0]), rows[1:], list(range(2, len(rows) + 1)))
        for name, rows in spreadsheet.worksheets(content, source)
        if len(rows) > 1
    ]
    if not found:
        raise ValueError(f"{source}: no sheet has rows below a header")
    return found


def _csv(content: bytes, source: str) -> Cells:
    try:
        text = content.decode("utf-8-sig")
    except UnicodeDecodeError:
        try:
            text = content.decode("utf-16") if content[:2] in (b"\xff\xfe", b"\xfe\xff") else content.decode("cp1252")
        except UnicodeDecodeError:
            raise ValueError(f"{source}: the file is not text: accepted is CSV or a spreadsheet") from None
    if "\0" in text:
        raise ValueError(f"{source}: the file is not text: accepted is CSV or a spreadsheet")
    text = text.replace("\r\n", "\n").replace("\r", "\n")
    files.require_cells(source, text.count("\n"))
    lines = ((number, line) for number, line in enumerate(text.split("\n"), 1))
    lines = ((number, line) for number, line in lines if line.strip() and not line.lstrip().startswith("#"))
    numbers, kept = [], []
    for number, line in lines:
        numbers.append(number)
        kept.append(line)
    if len(kept) < 2:
        raise ValueError(f"{source}: the file has {len(kept)} lines with data: accepted is a header and rows below it")
    delimiter = next((each for each in "\t;,|" if each in kept[0]), None)
    files.require_cells(source, sum(map(_cells_in(delimiter), kept)))
    try:
        rows = list(csv.reader(kept, delimiter=delimiter, strict=True)) if delimiter else list(map(_split, kept))
    except csv.Error as error:
        raise ValueError(f"{source}: the file is no CSV: {error}") from None
    if len(rows) != len(kept):
        raise ValueError(f"{source}: a quoted cell extends over several lines: accepted is one line a row")
    return Cells(source, tuple(rows[0]), rows[1:], numbers[1:], comma=delimiter != ",")


def _cells_in(delimiter: str | None) -> Callable[[str], int]:
    """Return the function that counts the cells in a line."""
    if delimiter:
        return lambda line: line.count(delimiter) + 1
    return lambda line: sum(1 for _ in _BLANK_SEPARATED.finditer(line))


def _split(line: str) -> list[str]:
    """Return the cells of a line without delimiters; a unit in parentheses belongs to the name before it."""
    return _BLANK_SEPARATED.findall(line)


# --- from cells to points ---------------------------------------------------------------------------------------------


_IN_VACUUM = Flight()


@dataclass(frozen=True)
class Options:
    """How a file is read.

    Attributes
    ----------
    columns : mapping
        Names of columns in the file by those of `COLUMNS`, where they differ.
    units : mapping
        Units by name of `COLUMNS`, for columns without one in the header.
    flight : Flight
        In SI units.
    resolution : str or None
        Standard error of instants or heights, with a unit or in SI units, unless the file has a column of them.
    contact_time : float or callable
        Duration of contacts between bounces, as for `bounces.of_times`.
    scatter : bool or None
        As for `Points.measured`.
    """

    columns: Mapping[str, str]
    units: Mapping[str, str]
    flight: Flight = _IN_VACUUM
    resolution: str | None = None
    contact_time: ContactTime = 0.0
    scatter: bool | None = None


PLAIN = Options({}, {})


def points(content: bytes, source: str, options: Options = PLAIN) -> Points:
    """Return the points in a file, in SI units.

    Raises
    ------
    ValueError
        One line that names the file, the line in it, what is there and what is accepted.
    """
    found = sheets(content, source)
    chosen = next((table for table in found if _kind(_known(table, options))), found[0])
    known = _known(chosen, options)
    kind = _kind(known)
    if kind is None:
        header = ", ".join(repr(name.strip()) for name in chosen.header[:12])
        raise ValueError(
            f"{chosen.source}: the columns are {header}: accepted are {ACCEPTED}; --column NAME=HEADER names others"
        )
    for name in options.units:
        if name not in known:
            raise ValueError(f"{chosen.source}: there is no column {name!r}, for which a unit is given")
    try:
        reader = _Reader(chosen, known, options)
        _require_options(reader, kind)
        made = kind(reader)
        _require_sense(made, kind is not _pairs)
        return made.without_scatter() if options.scatter is False else made
    except ValueError as error:
        message = str(error)
        raise ValueError(message if message.startswith(source) else f"{chosen.source}: {message}") from None


def _require_options(reader: _Reader, kind: Kind) -> None:
    """Refuse options that a kind of data has no use for, and numbers with points and with commas."""
    options = reader.options
    if kind is _pairs and options.flight != _IN_VACUUM:
        raise ValueError("gravity or drag is given: accepted with speed and epsilon are no options of a flight")
    if kind in (_pairs, _heights, _height_pairs) and not callable(options.contact_time) and options.contact_time:
        raise ValueError("a contact time is given: accepted is it with instants of bounces")
    if not callable(options.contact_time) and not options.contact_time >= 0:
        raise ValueError(f"contact-time is {options.contact_time:g}: accepted is a time >= 0")
    if reader.table.comma:
        cells = [
            row[i] for row in reader.table.rows for name, i in reader.known.items() if name != "drop" and i < len(row)
        ]
        if any("," in cell for cell in cells) and any("." in cell for cell in cells):
            raise ValueError(
                "numbers have decimal commas and decimal points: accepted is one of them, and no thousands"
            )


def _require_sense(made: Points, flight: bool) -> None:
    """Refuse speeds of a wrong unit, and errors as large as eps."""
    fastest = FASTEST_FLIGHT if flight else FASTEST
    if (bad := ~((made.speed >= SLOWEST) & (made.speed <= fastest))).any():
        i = int(np.argmax(bad))
        raise ValueError(
            f"{made.labels[i]}: the speed is {made.speed[i]:.3g} m/s: accepted is {SLOWEST:g} to {fastest:g} m/s; is "
            "the unit right? (--unit NAME=UNIT)"
        )
    errors = np.sqrt(np.asarray(made.epsilon_errors.multiply(made.epsilon_errors).sum(axis=1)))
    if (errors >= 1).any():
        i = int(np.argmax(errors >= 1))
        raise ValueError(f"{made.labels[i]}: the standard error of eps is {errors[i]:.3g}: accepted is less than 1")


def _plain(name: str) -> str:
    return re.sub(r"[^a-z0-9]+", "_", name.strip().lower().replace("ε", "epsilon").replace("σ", "sigma")).strip("_")


def _known(table: Cells, options: Options) -> dict[str, int]:
    """Return the indices of the columns that are known, by their names in `COLUMNS` or "bounce K"."""
    given = {header: name for name, header in options.columns.items()}
    if missing := [header for header in given if header not in {cell.strip() for cell in table.header}]:
        raise ValueError(
            f"{table.source}: there is no column {missing[0]!r}: {', '.join(map(repr, table.header[:12]))}"
        )
    names = {also: name for name, (_, every) in COLUMNS.items() for also in every}
    found: dict[str, int] = {}
    for i, header in enumerate(table.header):
        match = _HEAD.fullmatch(header.strip())
        plain = _plain(match[1] if match else header)
        name = given.get(header.strip()) or (plain if _BOUNCE.fullmatch(plain) else names.get(plain))
        if name is None or (name in options.columns and header.strip() not in given):
            continue
        if name in found:
            raise ValueError(
                f"{table.source}: the columns {table.header[found[name]].strip()!r} and {header.strip()!r} both are "
                f"{name}: accepted is one, chosen by --column {name}=HEADER if the headers differ"
            )
        found[name] = i
    return found


class _Reader:
    """The columns of a table, as numbers in SI units."""

    def __init__(self, table: Cells, known: dict[str, int], options: Options) -> None:
        self.table, self.known, self.options = table, known, options

    @property
    def labels(self) -> list[str]:
        return [f"line {line}" for line in self.table.lines]

    def numbers(self, name: str, dimension: str | None = None, *, blank: bool = False) -> FloatArray:
        """Return a column; a blank cell is NaN if that is accepted."""
        column = self.known[name]
        cells = [row[column].strip() if column < len(row) else "" for row in self.table.rows]
        if self.table.comma:
            cells = [cell.replace(",", ".") for cell in cells]
        try:
            found = np.array(cells, dtype=np.float64)
        except ValueError:
            found = np.array([self._number(cell) for cell in cells])
        bad = ~np.isfinite(found)
        if blank:
            bad &= np.array([cell.lower() not in ("", "nan") for cell in cells])
        if bad.any():
            i = int(np.argmax(bad))
            raise ValueError(f"{self.labels[i]}: {name} is {cells[i]!r}: accepted is a number")
        return found * self._unit(name, COLUMNS[name][0] if dimension is None else dimension)

    @staticmethod
    def _number(cell: str) -> float:
        try:
            return float(cell)
        except ValueError:
            return math.nan

    def _unit(self, name: str, dimension: str) -> float:
        match = _HEAD.fullmatch(self.table.header[self.known[name]].strip())
        written = (match[2] or "").strip() if match else None
        unit = self.options.units.get(name) or written
        if written and name in self.options.units:
            raise ValueError(f"the column {name} has the unit {written!r} in its header: accepted is no other one")
        if not unit:
            return 1.0
        if not dimension:
            if unit in ("%", "-", "1"):
                return 0.01 if unit == "%" else 1.0
            raise ValueError(f"the unit of {name} is {unit!r}: accepted is none, or %")
        return factor(Node(self.table.source, f"the unit of {name}", unit), dimension)[1]

    def sigma(self, dimension: str) -> FloatArray | float:
        """Return the standard errors of instants or heights; 0 if they are not known."""
        given = self.options.resolution
        if "sigma" in self.known:
            if given is not None:
                raise ValueError("there is a column of standard errors: accepted is no --resolution besides")
            found = self.numbers("sigma", dimension)
            if (found < 0).any():
                i = int(np.argmax(found < 0))
                raise ValueError(f"{self.labels[i]}: sigma is {found[i]:g}: accepted is a number >= 0")
            return found
        if given is None:
            return 0.0
        plain = self._number(given)
        return quantity(Node(self.table.source, "resolution", given if math.isnan(plain) else plain), dimension)

    def drops(
        self, values: FloatArray, sigma: FloatArray | float
    ) -> tuple[list[tuple[FloatArray, list[str]]], list[FloatArray]]:
        """Return values and labels by drop, and their standard errors."""
        if len(values) > bounces.MOST_INSTANTS:
            raise ValueError(f"there are {len(values)} rows: accepted are up to {bounces.MOST_INSTANTS} bounces")
        column = self.known.get("drop")
        keys = (
            [""] * len(values)
            if column is None
            else [row[column].strip() if column < len(row) else "" for row in self.table.rows]
        )
        rows: dict[str, list[int]] = {}
        for i, key in enumerate(keys):
            rows.setdefault(key, []).append(i)
        every = np.broadcast_to(sigma, values.shape)
        parts = [(values[of], [self.labels[i] for i in of]) for of in rows.values()]
        errors = [every[of] for of in rows.values()]
        return parts, errors


Kind = Callable[[_Reader], Points]


def _kind(known: Mapping[str, int]) -> Kind | None:
    for needed, kind in _KINDS:
        if all(name in known for name in needed):
            return kind
    return None


def _pairs(reader: _Reader) -> Points:
    known, options = reader.known, reader.options
    if options.resolution is not None:
        raise ValueError("--resolution is given: accepted with speed and epsilon is a column sigma_epsilon")
    speed, epsilon = reader.numbers("speed"), reader.numbers("epsilon")
    for name, values, accepted, bad in (
        ("speed", speed, "a number > 0", speed <= 0),
        ("epsilon", epsilon, "a number > 0 and <= 1", (epsilon <= 0) | (epsilon > 1)),
    ):
        if bad.any():
            i = int(np.argmax(bad))
            raise ValueError(f"{reader.labels[i]}: {name} is {values[i]:.6g}: accepted is {accepted}")
    return Points.measured(
        speed,
        epsilon,
        sigma_epsilon=reader.numbers("sigma_epsilon") if "sigma_epsilon" in known else None,
        sigma_speed=reader.numbers("sigma_speed") if "sigma_speed" in known else 0.0,
        contact_time=reader.numbers("contact_time") if "contact_time" in known else None,
        scatter=options.scatter,
        labels=reader.labels,
    )


def _times(reader: _Reader) -> Points:
    drops, errors = reader.drops(reader.numbers("time"), reader.sigma("time"))
    return bounces.of_times(drops, reader.options.flight, sigma=errors, contact_time=reader.options.contact_time)


def _heights(reader: _Reader) -> Points:
    drops, errors = reader.drops(reader.numbers("height"), reader.sigma("length"))
    return bounces.of_heights(drops, reader.options.flight, sigma=errors)


def _height_pairs(reader: _Reader) -> Points:
    first, second = reader.numbers("drop_height"), reader.numbers("rebound_height")
    if len(first) > bounces.MOST_INSTANTS:
        raise ValueError(f"there are {len(first)} rows: accepted are up to {bounces.MOST_INSTANTS} drops")
    sigma = np.broadcast_to(reader.sigma("length"), first.shape)
    drops = [(np.array(pair), [label] * 2) for *pair, label in zip(first, second, reader.labels, strict=True)]
    return bounces.of_heights(drops, reader.options.flight, sigma=[np.array([s, s]) for s in sigma])


def _phyphox(reader: _Reader) -> Points:
    names = sorted((name for name in reader.known if _BOUNCE.fullmatch(name)), key=lambda name: int(name[7:]))
    instants = np.array([reader.numbers(name, "time", blank=True) for name in names]).T
    drops = []
    for row, label in zip(instants, reader.labels, strict=True):
        seen = row[: int(np.argmin(np.isfinite(row)))] if not np.isfinite(row).all() else row
        drops.append((seen, [f"{label}, {name.replace('_', ' ')}" for name in names[: len(seen)]]))
    sigma = reader.sigma("time")
    assert isinstance(sigma, float)  # phyphox has no column of errors
    return bounces.of_times(drops, reader.options.flight, sigma=sigma, contact_time=reader.options.contact_time)


_KINDS: Sequence[tuple[Iterable[str], Kind]] = (
    (("speed", "epsilon"), _pairs),
    (("bounce_0", "bounce_1", "bounce_2"), _phyphox),
    (("drop_height", "rebound_height"), _height_pairs),
    (("height",), _heights),
    (("time",), _times),
)
