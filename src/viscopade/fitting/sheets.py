"""Tables of a file: CSV as programs write it, a ZIP archive of CSV files, or the sheets of a spreadsheet.

    # Tracker, 2024-05-03
    mass_A
    t	y
    (s)	(m)
    0.000	1.203
    0.033	1.198

The header of this table is its third line: lines above it are settings or comments, the line below it has units, and
the numbers follow.
"""

from __future__ import annotations

import csv
import re
from collections.abc import Callable, Iterable, Sequence
from dataclasses import dataclass
from functools import cache
from pathlib import PurePath
from typing import NamedTuple

from viscopade import files
from viscopade.extras import require
from viscopade.fitting import spreadsheet
from viscopade.fitting.forms import SheetLayout
from viscopade.quantity import unit_in_si

# A cell between blanks: a text in quotes, or a word with a unit in brackets behind it: time (s) is one cell.
_BLANK_SEPARATED = re.compile(r'"[^"]*"|[^\s()\[\]]+(?:\s*[(\[][^()\[\]]*[)\]])?')
# A cell that is a number and nothing else, with a decimal point or comma, or nan: "1,203", "-.5", "1e-3"
_NUMBER = re.compile(r"[-+]?(?:[0-9]+[.,]?[0-9]*|[.,][0-9]+)(?:e[-+]?[0-9]+)?|nan", re.IGNORECASE)
# The beginning of a measured value, behind signs and before a unit: "< 0.5 mm", "±2", "12:30:01"
_VALUE = re.compile(r"\W*[0-9][0-9.,:]*(?:e[-+]?[0-9]+)?|nan", re.IGNORECASE)
# A line whose commas may be decimal signs
_WHOLE_NUMBERS = re.compile(r"[0-9,\s+-]*")
_CSV_NAME = re.compile(r"(?i)[^/]*\.csv")
# First bytes of an XLS (a compound file of OLE), and of a ZIP archive, which XLSX and ODS are, too
_XLS, _ZIP = b"\xd0\xcf\x11\xe0", b"PK\x03\x04"
# Number of rows that are searched for a header, and the largest number of characters of one. Chosen by hand: programs
# write some ten lines above a table, and each row that is tried as a header takes time.
_ABOVE, _LONGEST_HEADER = 100, 1 << 16
# Bytes of a spreadsheet, also when unpacked, on systems that do not limit memory: 16 MiB, chosen by hand; Python's
# objects take some ten times as much.
_ELSEWHERE = 1 << 24

LayoutOf = Callable[[Sequence[str]], SheetLayout | None]
"""The columns that are read below a row of headers; None if no form fits."""


@dataclass(frozen=True)
class Sheet:
    """Cells below a header.

    Attributes
    ----------
    file, sheet : str
        Names; `sheet` is empty if the file has no sheets.
    header : tuple of str
    rows : list
        The cells: texts, or numbers of a spreadsheet.
    lines : sequence of int
        Line number of each row in the file.
    separator : str
        The character between cells; empty for blanks, and in a spreadsheet.
    layout : SheetLayout or None
        The columns that are read.
    """

    file: str
    sheet: str
    header: tuple[str, ...]
    rows: Sequence[Sequence[str | float]]
    lines: Sequence[int]
    separator: str = ""
    layout: SheetLayout | None = None

    @property
    def source(self) -> str:
        """File and sheet, for messages."""
        return f"{self.file}, sheet {self.sheet}" if self.sheet else self.file

    @property
    def name(self) -> str:
        """File without its folders, and sheet."""
        return PurePath(self.file).name + f", sheet {self.sheet}" * bool(self.sheet)


def sheets(content: bytes, source: str, layout_of: LayoutOf) -> list[Sheet]:
    """Return the sheets of a file that are not empty.

    `content` is that of the file, `source` its name, and `layout_of` gives the columns that are read below headers. The
    header is the best row above the first values, among the first hundred rows; see `_header`. In a CSV file it may
    be a comment. Without a header, which only options allow, the columns are called "column 1", "column 2", …

    Raises
    ------
    ValueError
        If the file is neither CSV nor a spreadsheet, or is empty.
    MissingPackage
        If python-calamine, which reads spreadsheets, is not installed.
    """
    # By content: an archive of CSV files, one CSV file, or a spreadsheet. The name tells XLSX and ODS from an archive.
    suffix = source.lower().rpartition(".")[2]
    if content.startswith(_ZIP) and suffix not in ("xlsx", "ods"):
        members = files.members(content, source).items()
        # The name of a sheet is that of its file without ".csv", four characters.
        tables = [_csv(text, source, name[:-4], layout_of) for name, text in members if _CSV_NAME.fullmatch(name)]
        if not tables:
            raise ValueError(f"{source}: the ZIP archive has no CSV file: expected one with phyphox's CSV files")
        return tables
    if not content.startswith((_XLS, _ZIP)):
        if suffix in ("xls", "xlsx", "ods", "zip"):
            raise ValueError(f"{source}: the content is not {suffix.upper()}: expected a file of the type in its name")
        return [_csv(content, source, "", layout_of)]
    require("fit", "python_calamine")
    # Limits of memory, which a small file may exceed when it is unpacked.
    largest = files.LONGEST if files.LIMITED else _ELSEWHERE
    files.require_size(source, len(content), largest)
    if content.startswith(_ZIP):
        files.require_size(source, sum(map(len, files.members(content, source).values())), largest)
    try:
        worksheets = spreadsheet.worksheets(content, files.MOST_CELLS, files.LONGEST)
    except ValueError as error:
        raise ValueError(f"{source}: the spreadsheet cannot be read: {error}") from None
    # The header of each worksheet, and the rows below it; a row is its number and its cells.
    tables = []
    for name, rows in worksheets:
        texts = [(i, list(map(str, cells)), False) for i, (_, cells) in enumerate(rows[:_ABOVE])]
        head = _header(texts, len(rows[-1][1]) if rows else 0, layout_of)
        if below := rows[head.below :]:
            lines, cells = zip(*below, strict=True)
            tables.append(Sheet(source, name, tuple(head.names), cells, lines, "", head.layout))
    if not tables:
        raise ValueError(f"{source}: no sheet has rows below a header: expected one")
    return tables


def _csv(content: bytes, file: str, sheet: str, layout_of: LayoutOf) -> Sheet:
    """Return the table in a CSV file of this content; `file` and `sheet` are its names, `layout_of` as in `sheets`."""
    source = Sheet(file, sheet, (), [], []).source
    try:
        # UTF-16 with its mark (the first two bytes, FF FE or FE FF), or UTF-8, or else the code page of Windows.
        text = content.decode("utf-16" if content[:2] in (b"\xff\xfe", b"\xfe\xff") else "utf-8-sig")
    except UnicodeDecodeError:
        text = content.decode("cp1252", "replace")
    if "\0" in text:
        raise ValueError(f"{source}: the file is not text: expected CSV or a spreadsheet")
    text = text.replace("\r\n", "\n").replace("\r", "\n")
    files.require_cells(source, text.count("\n"))
    # Lines with their numbers; a comment may be the header.
    data: list[tuple[int, str]] = []
    comments: list[tuple[int, str]] = []
    for number, line in enumerate(text.split("\n"), 1):
        if line.strip():
            (comments if line.lstrip().startswith("#") else data).append((number, line))
    # Without a separator, a line is one name with blanks in it if the rows below it have one cell: the last row has, if
    # it does not split into two at a blank.
    last_line = data[-1][1] if data else ""
    one_cell = len(last_line.split(None, 1)) == 1
    data_numbers = {number for number, _ in data}
    texts = dict(sorted(data[:_ABOVE] + comments[:_ABOVE]))
    rows_above = [(k, _names(line, one_cell), k not in data_numbers) for k, line in texts.items()]
    head = _header(rows_above, len(_names(last_line, one_cell)), layout_of)
    numbers_below, lines = [k for k, _ in data if k >= head.below], [line for k, line in data if k >= head.below]
    if not lines:
        raise ValueError(f"{source}: the file has {len(data)} lines with data: expected a header and rows below it")
    # All lines have the separator of the header. "1,5" without a header may be one number.
    delimiter = _delimiter(texts[head.number])
    if head.number == head.below and delimiter == "," and all(map(_WHOLE_NUMBERS.fullmatch, lines)):
        raise ValueError(f"{source}: without a header, commas between digits may be decimal signs: expected a header")
    files.require_cells(source, sum(line.count(delimiter or " ") + 1 for line in (texts[head.number], *lines)))
    try:
        rows = _cells(lines, delimiter)
    except csv.Error as error:
        raise ValueError(f"{source}: the file is not CSV: {error}") from None
    if len(rows) != len(lines):
        raise ValueError(f"{source}: a quoted cell extends over several lines: expected one line for each row")
    return Sheet(file, sheet, tuple(head.names), rows, numbers_below, delimiter or "", head.layout)


class _Header(NamedTuple):
    """The number of the header's row, that of the first row below it (the same without a header), and the names.

    `layout` has the columns that are read below it.
    """

    number: int
    below: int
    names: list[str]
    layout: SheetLayout | None


class _Ranked(NamedTuple):
    """A row that may be the header, with its rank: the larger one wins."""

    rank: tuple[int, ...]
    header: _Header


def _header(rows: Iterable[tuple[int, list[str], bool]], width: int, layout_of: LayoutOf) -> _Header:
    """Return the header among rows, each with its number, its cells, and whether it is a comment.

    `width` is the number of cells of a row of values, and `layout_of` gives the columns that are read below a row.
    Without a recognised row, the header is that of this width with the most names that is no comment, for a message.
    """

    @cache
    def without_header(columns: int) -> tuple[list[str], SheetLayout | None]:
        """Return the names "column 1", … that a table without a header has, and the columns that are read there."""
        names = [f"column {i + 1}" for i in range(columns)]
        return names, layout_of(names)

    ranked: list[_Ranked] = []
    unrecognised: list[_Header] = []
    for number, cells, is_comment in rows:
        filled = [cell.strip() for cell in cells if cell.strip()]
        is_number = [_NUMBER.fullmatch(cell) is not None for cell in filled]
        layout = layout_of(cells)
        names, numbered_layout = without_header(len(cells)) if any(map(_VALUE.match, filled)) else ([""], None)
        # The table begins where a column has a value that is read by its name here, by its number, or by the best
        # header above; or where all cells are numbers.
        best = max(ranked, key=lambda candidate: candidate.rank).header if ranked else None
        begins = any(_is_value(cells[i]) for i in {*_value_columns(layout), *_value_columns(numbered_layout)})
        continues = any(
            _NUMBER.fullmatch(cells[i].strip()) for i in _value_columns(best and best.layout) if i < len(cells)
        )
        all_numbers = bool(filled) and all(is_number) and (best or len(cells) == width)
        if not is_comment and (begins or continues or all_numbers):
            if numbered_layout or not unrecognised:
                unrecognised = [_Header(number, number, names, numbered_layout)]
            break
        header = _Header(number, number + 1, cells, layout)
        if layout and not begins:
            # A row of names has names, not only units; no number beside them, as a setting above the table has; as many
            # cells as the values; and the most recognised columns and units. It is the lowest such row.
            heads = [layout.headers[i] for i in _value_columns(layout)]
            has_names = any(head.quantities or not _is_unit(head.name) for head in heads)
            units = sum(bool(head.unit) for head in heads)
            rank = has_names, not any(is_number), len(cells) == width, len(layout), units, number
            ranked.append(_Ranked(rank, header))
        elif not is_comment:
            unrecognised.append(header)
    if ranked:
        return max(ranked, key=lambda candidate: candidate.rank).header
    # Rows of a spreadsheet all have its width: a title is a row with one name. Of equal rows, the first one.
    return max(
        unrecognised,
        key=lambda candidate: (len(candidate.names) == width, sum(map(bool, map(str.strip, candidate.names)))),
        default=_Header(0, 1, [""], None),
    )


def _value_columns(layout: SheetLayout | None) -> list[int]:
    """Return the indices of the columns of values that are read, without the number of the drop."""
    return [i for name, places in layout.places.items() if name != "drop" for i in places] if layout else []


def _is_value(cell: str) -> bool:
    """Return whether a cell has a number, or another value without letters; it may have a unit."""
    cell = cell.strip()
    rest = cell[match.end() :].strip() if (match := _VALUE.match(cell)) else "?"
    return match is not None and (not any(letter.isalpha() for letter in rest) or _is_unit(rest))


def _is_unit(text: str) -> bool:
    """Return whether a text is a unit of time, length or speed, or a sign for none, maybe in brackets."""
    text = text.strip("()[] ")
    return text in ("", "-", "%") or any(unit_in_si(text, dimension) for dimension in ("time", "length", "speed"))


def _names(line: str, one_cell: bool) -> list[str]:
    """Return the names in a line, which may be a comment; without a separator and with `one_cell`, it is one name."""
    text = line.lstrip("# ")
    if len(line) > _LONGEST_HEADER:
        return [text]
    # A comma that the line does not have makes one cell of it.
    delimiter = _delimiter(line)
    return _cells([text], delimiter or ("," if one_cell else None), strict=False)[0]


def _delimiter(line: str) -> str | None:
    """Return the separator in a line: a tab, a semicolon, a comma or |, the first of these in it; None for blanks."""
    return next((separator for separator in "\t;,|" if separator in line), None)


def _cells(lines: list[str], delimiter: str | None, strict: bool = True) -> list[list[str]]:
    """Return the cells of lines; between blanks, a unit in parentheses belongs to the name before it."""
    if delimiter:
        return list(csv.reader(lines, delimiter=delimiter, strict=strict))
    return [[cell.strip('"') for cell in _BLANK_SEPARATED.findall(line)] for line in lines]


def cell_of(row: Sequence[str | float], i: int) -> str | float:
    """Return a cell of a row without blanks around it; "" if the row is too short."""
    cell = row[i] if i < len(row) else ""
    return cell.strip() if isinstance(cell, str) else cell
