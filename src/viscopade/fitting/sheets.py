"""Tables of a file: CSV as programs write it, a ZIP archive of CSV files, or the sheets of a spreadsheet."""

from __future__ import annotations

import csv
import re
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from pathlib import PurePath

from viscopade import files
from viscopade.fitting import spreadsheet

HEAD = re.compile(r"([^()\[\]]+)(?:[(\[]([^()\[\]]*)[)\]])?")
"""A column's name, with its unit in parentheses or brackets."""
_BLANK_SEPARATED = re.compile(r"[^\s()\[\]]+(?:\s*[(\[][^()\[\]]*[)\]])?")
_CSV_NAME = re.compile(r"(?i)[^/]*\.csv")
_XLS, _ZIP = b"\xd0\xcf\x11\xe0", b"PK\x03\x04"
_ABOVE, _LONGEST_HEADER = 20, 1 << 16  # number of rows that are searched for a header, and its longest length

IsHeader = Callable[[Sequence[str]], bool]


@dataclass(frozen=True)
class Sheet:
    """Cells below a header.

    Attributes
    ----------
    file, sheet : str
        Names; `sheet` is empty if the file has no sheets.
    header : tuple of str
    rows : list
        The cells as texts.
    lines : sequence of int
        Line number of each row in the file.
    comma : bool
        Whether numbers may have decimal commas.
    """

    file: str
    sheet: str
    header: tuple[str, ...]
    rows: list[list[str]]
    lines: Sequence[int]
    comma: bool = False

    @property
    def source(self) -> str:
        """File and sheet, for messages."""
        return f"{self.file}, sheet {self.sheet}" if self.sheet else self.file

    @property
    def name(self) -> str:
        """File without its folders, and sheet."""
        return PurePath(self.file).name + f", sheet {self.sheet}" * bool(self.sheet)


def sheets(content: bytes, source: str, is_header: IsHeader) -> list[Sheet]:
    """Return the sheets of a file that are not empty.

    The header is the first row for which `is_header` holds, or else the first row. In a CSV file it may be a comment.

    Raises
    ------
    ValueError
        If the file is neither CSV nor a spreadsheet, or is empty.
    ModuleNotFoundError
        If python-calamine, which reads spreadsheets, is not installed.
    """
    suffix = source.lower().rpartition(".")[2]
    if content.startswith(_ZIP) and suffix not in ("xlsx", "ods"):
        parts = files.members(content, source).items()
        tables = [_csv(part, source, name[:-4], is_header) for name, part in parts if _CSV_NAME.fullmatch(name)]
        if not tables:
            raise ValueError(f"{source}: the ZIP archive has no CSV file: expected one with phyphox's CSV files")
        return tables
    if not content.startswith((_XLS, _ZIP)):
        if suffix in ("xls", "xlsx", "ods", "zip"):
            raise ValueError(f"{source}: the content is not {suffix.upper()}: expected a file of the type in its name")
        return [_csv(content, source, "", is_header)]
    tables = []
    for name, rows in spreadsheet.worksheets(content, source):
        first = next((i for i, row in enumerate(rows[:_ABOVE]) if is_header(row)), 0)
        if len(rows) > first + 1:
            lines = range(first + 2, len(rows) + 1)
            tables.append(Sheet(source, name, tuple(rows[first]), rows[first + 1 :], lines))
    if not tables:
        raise ValueError(f"{source}: no sheet has rows below a header: expected one")
    return tables


def _csv(content: bytes, file: str, sheet: str, is_header: IsHeader) -> Sheet:
    source = Sheet(file, sheet, (), [], []).source
    wide = content[:2] in (b"\xff\xfe", b"\xfe\xff")
    for encoding in ("utf-16",) if wide else ("utf-8-sig", "cp1252"):
        try:
            text = content.decode(encoding)
            break
        except UnicodeDecodeError:
            text = "\0"
    if "\0" in text:
        raise ValueError(f"{source}: the file is not text: expected CSV or a spreadsheet")
    text = text.replace("\r\n", "\n").replace("\r", "\n")
    files.require_cells(source, text.count("\n"))
    data: list[tuple[int, str]] = []
    comments: list[tuple[int, str]] = []
    for number, line in enumerate(text.split("\n"), 1):
        if line.strip():
            (comments if line.lstrip().startswith("#") else data).append((number, line))
    header = next((row for row in data[:_ABOVE] + comments[:_ABOVE] if _is(row[1], is_header)), (data or [(0, "")])[0])
    below = [row for row in data if row[0] > header[0]]
    if not below:
        raise ValueError(f"{source}: the file has {len(data)} lines with data: expected a header and rows below it")
    delimiter = _delimiter(header[1])
    lines = [header[1], *(line for _, line in below)]
    if delimiter:
        cells = sum(line.count(delimiter) + 1 for line in lines)
    else:
        cells = sum(1 for line in lines for _ in _BLANK_SEPARATED.finditer(line))
    files.require_cells(source, cells)
    try:
        rows = _cells(lines[1:], delimiter)
        names = _cells([header[1].lstrip("# ")], delimiter)[0]
    except csv.Error as error:
        raise ValueError(f"{source}: the file is not CSV: {error}") from None
    if len(rows) != len(below):
        raise ValueError(f"{source}: a quoted cell extends over several lines: expected one line for each row")
    return Sheet(file, sheet, tuple(names), rows, [number for number, _ in below], comma=delimiter != ",")


def _is(line: str, is_header: IsHeader) -> bool:
    try:
        cells = _cells([line.lstrip("# ")], _delimiter(line)) if len(line) < _LONGEST_HEADER else [[]]
    except csv.Error:
        return False
    return is_header(cells[0])


def _delimiter(line: str) -> str | None:
    return next((each for each in "\t;,|" if each in line), None)


def _cells(lines: list[str], delimiter: str | None) -> list[list[str]]:
    """Return the cells of lines; a unit in parentheses belongs to the name before it."""
    if delimiter:
        return list(csv.reader(lines, delimiter=delimiter, strict=True))
    return [_BLANK_SEPARATED.findall(line) for line in lines]
