"""Tables of a file: CSV as programs write it, a ZIP archive of CSV files, or the sheets of a spreadsheet."""

from __future__ import annotations

import csv
import re
from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass
from pathlib import PurePath

from viscopade import files
from viscopade.extras import require
from viscopade.fitting import spreadsheet
from viscopade.fitting.forms import SheetLayout

_BLANK_SEPARATED = re.compile(r"[^\s()\[\]]+(?:\s*[(\[][^()\[\]]*[)\]])?")
_NUMBER = re.compile(r"\s*(?:[-+]?[0-9.,]+(?:[eE][-+]?[0-9]+)?|nan)?\s*", re.IGNORECASE)
_CSV_NAME = re.compile(r"(?i)[^/]*\.csv")
_XLS, _ZIP = b"\xd0\xcf\x11\xe0", b"PK\x03\x04"
_ABOVE, _LONGEST_HEADER = 100, 1 << 16  # number of rows that are searched for a header, and its longest length
_ELSEWHERE = 1 << 24  # bytes of a spreadsheet, also when unpacked, on systems that do not limit memory

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

    The header is the row with the most recognised columns above the first numbers, among the first hundred rows, or
    else the first row. In a CSV file it may be a comment.

    Raises
    ------
    ValueError
        If the file is neither CSV nor a spreadsheet, or is empty.
    MissingPackage
        If python-calamine, which reads spreadsheets, is not installed.
    """
    suffix = source.lower().rpartition(".")[2]
    if content.startswith(_ZIP) and suffix not in ("xlsx", "ods"):
        parts = files.members(content, source).items()
        tables = [_csv(part, source, name[:-4], layout_of) for name, part in parts if _CSV_NAME.fullmatch(name)]
        if not tables:
            raise ValueError(f"{source}: the ZIP archive has no CSV file: expected one with phyphox's CSV files")
        return tables
    if not content.startswith((_XLS, _ZIP)):
        if suffix in ("xls", "xlsx", "ods", "zip"):
            raise ValueError(f"{source}: the content is not {suffix.upper()}: expected a file of the type in its name")
        return [_csv(content, source, "", layout_of)]
    require("fit", "python_calamine")
    largest = files.LONGEST if spreadsheet.LIMITED else _ELSEWHERE
    files.require_size(source, len(content), largest)
    if content.startswith(_ZIP):
        files.require_size(source, sum(map(len, files.members(content, source).values())), largest)
    try:
        read = spreadsheet.worksheets(content, files.MOST_CELLS, files.LONGEST)
    except ValueError as error:
        raise ValueError(f"{source}: the spreadsheet cannot be read: {error}") from None
    tables = []
    for name, rows in read:
        texts = [list(map(str, cells)) for _, cells in rows[:_ABOVE]]
        first, layout = _header((i, cells, layout_of(cells)) for i, cells in enumerate(texts))
        if below := rows[first + 1 :]:
            lines, cells = zip(*below, strict=True)
            tables.append(Sheet(source, name, tuple(texts[first]), cells, lines, "", layout))
    if not tables:
        raise ValueError(f"{source}: no sheet has rows below a header: expected one")
    return tables


def _csv(content: bytes, file: str, sheet: str, layout_of: LayoutOf) -> Sheet:
    source = Sheet(file, sheet, (), [], []).source
    try:
        text = content.decode("utf-16" if content[:2] in (b"\xff\xfe", b"\xfe\xff") else "utf-8-sig")
    except UnicodeDecodeError:
        text = content.decode("cp1252", "replace")
    if "\0" in text:
        raise ValueError(f"{source}: the file is not text: expected CSV or a spreadsheet")
    text = text.replace("\r\n", "\n").replace("\r", "\n")
    files.require_cells(source, text.count("\n"))
    data: list[tuple[int, str]] = []
    comments: list[tuple[int, str]] = []
    for number, line in enumerate(text.split("\n"), 1):
        if line.strip():
            (comments if line.lstrip().startswith("#") else data).append((number, line))
    heads = dict(sorted(data[:_ABOVE] + comments[:_ABOVE])) or {0: ""}
    place, layout = _header((number, *_names(line, layout_of)) for number, line in heads.items())
    place, header = (place, heads[place]) if layout or not data else data[0]
    below = [row for row in data if row[0] > place]
    if not below:
        raise ValueError(f"{source}: the file has {len(data)} lines with data: expected a header and rows below it")
    delimiter = _delimiter(header)
    lines = [line for _, line in below]
    files.require_cells(source, sum(line.count(delimiter or " ") + 1 for line in (header, *lines)))
    try:
        rows = _cells(lines, delimiter)
        names = _names(header, layout_of)[0]
    except csv.Error as error:
        raise ValueError(f"{source}: the file is not CSV: {error}") from None
    if len(rows) != len(below):
        raise ValueError(f"{source}: a quoted cell extends over several lines: expected one line for each row")
    return Sheet(file, sheet, tuple(names), rows, [number for number, _ in below], delimiter or "", layout)


def _header(rows: Iterator[tuple[int, list[str], SheetLayout | None]]) -> tuple[int, SheetLayout | None]:
    """Return the number of the header, and its layout: the most recognised columns above the first numbers."""
    best: tuple[int, SheetLayout | None] = (0, None)
    for number, names, layout in rows:
        if best[1] and all(_NUMBER.fullmatch(name) for name in names):
            break
        best = (number, layout) if len(layout or ()) > len(best[1] or ()) else best
    return best


def _names(line: str, layout_of: LayoutOf) -> tuple[list[str], SheetLayout | None]:
    """Return the names in a line, which may be a comment, and their layout; without separators it may be one name."""
    whole = line.lstrip("# ")
    if len(line) > _LONGEST_HEADER:
        return [whole], None
    if not _delimiter(line) and (layout := layout_of([whole])):
        return [whole], layout
    names = _cells([whole], _delimiter(line), strict=False)[0]
    return names, layout_of(names)


def _delimiter(line: str) -> str | None:
    return next((each for each in "\t;,|" if each in line), None)


def _cells(lines: list[str], delimiter: str | None, strict: bool = True) -> list[list[str]]:
    """Return the cells of lines; a unit in parentheses belongs to the name before it."""
    if delimiter:
        return list(csv.reader(lines, delimiter=delimiter, strict=strict))
    return [_BLANK_SEPARATED.findall(line) for line in lines]


def cell_of(row: Sequence[str | float], i: int) -> str | float:
    """Return a cell of a row without blanks around it; "" if the row is too short."""
    cell = row[i] if i < len(row) else ""
    return cell.strip() if isinstance(cell, str) else cell
