"""Tables of a file: CSV as programs write it, a ZIP archive of such, or the sheets of a spreadsheet."""

from __future__ import annotations

import csv
import re
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from pathlib import PurePath

from viscopade import files
from viscopade.fitting import spreadsheet

HEAD = re.compile(r"([^()\[\]]+)(?:[(\[]([^()\[\]]*)[)\]])?")
"""A name, with its unit."""
_BLANK_SEPARATED = re.compile(r"[^\s()\[\]]+(?:\s*[(\[][^()\[\]]*[)\]])?")
_XLS, _ZIP = b"\xd0\xcf\x11\xe0", b"PK\x03\x04"
_ABOVE, _LONGEST_HEADER = 20, 1 << 16  # rows among which a header is looked for, and its characters

IsHeader = Callable[[Sequence[str]], bool]


@dataclass(frozen=True)
class Sheet:
    """Cells below a header.

    Attributes
    ----------
    file, sheet : str
        Names; that of the sheet is empty if the file has no sheets.
    header : tuple of str
    rows : list
        The cells, texts.
    lines : sequence of int
        The number of each row's line in the file.
    comma : bool
        Whether numbers have decimal commas.
    """

    file: str
    sheet: str
    header: tuple[str, ...]
    rows: list[list[str]]
    lines: Sequence[int]
    comma: bool = False

    @property
    def source(self) -> str:
        """Its place, for messages."""
        return f"{self.file}, sheet {self.sheet}" if self.sheet else self.file

    @property
    def name(self) -> str:
        """Its place without folders."""
        return PurePath(self.file).name + f", sheet {self.sheet}" * bool(self.sheet)


def sheets(content: bytes, source: str, is_header: IsHeader) -> list[Sheet]:
    """Return the sheets of a file; empty ones are left out.

    A header is the first row for which `is_header` holds, else the first one of all. In a CSV file it may be a comment.

    Raises
    ------
    ValueError
        If the file is none of these, or empty.
    ModuleNotFoundError
        For a spreadsheet, if no package reads it.
    """
    suffix = source.lower().rpartition(".")[2]
    if content.startswith(_ZIP) and suffix not in ("xlsx", "ods"):
        parts = files.members(content, source).items()
        found = [
            _csv(part, source, name[:-4], is_header) for name, part in parts if re.fullmatch(r"(?i)[^/]*\.csv", name)
        ]
        if not found:
            raise ValueError(f"{source}: the ZIP archive has no CSV file: expected one with phyphox's CSV files")
        return found
    if not content.startswith((_XLS, _ZIP)):
        if suffix in ("xls", "xlsx", "ods", "zip"):
            raise ValueError(f"{source}: the file is no {suffix.upper()}: expected what its name says, or CSV")
        return [_csv(content, source, "", is_header)]
    found = []
    for name, rows in spreadsheet.worksheets(content, source):
        first = next((i for i, row in enumerate(rows[:_ABOVE]) if is_header(row)), 0)
        if len(rows) > first + 1:
            lines = range(first + 2, len(rows) + 1)
            found.append(Sheet(source, name, tuple(rows[first]), rows[first + 1 :], lines))
    if not found:
        raise ValueError(f"{source}: no sheet has rows below a header")
    return found


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
    kept: list[tuple[int, str]] = []
    said: list[tuple[int, str]] = []
    for number, line in enumerate(text.split("\n"), 1):
        if line.strip():
            (said if line.lstrip().startswith("#") else kept).append((number, line))
    header = next((each for each in kept[:_ABOVE] + said[:_ABOVE] if _is(each[1], is_header)), (kept or [(0, "")])[0])
    below = [each for each in kept if each[0] > header[0]]
    if not below:
        raise ValueError(f"{source}: the file has {len(kept)} lines with data: expected a header and rows below it")
    delimiter = _delimiter(header[1])
    count = (lambda line: line.count(delimiter) + 1) if delimiter else _cells_between_blanks
    files.require_cells(source, count(header[1]) + sum(count(line) for _, line in below))
    try:
        rows = _cells([line for _, line in below], delimiter)
        names = _cells([header[1].lstrip("# ")], delimiter)[0]
    except csv.Error as error:
        raise ValueError(f"{source}: the file is no CSV: {error}") from None
    if len(rows) != len(below):
        raise ValueError(f"{source}: a quoted cell extends over several lines: expected one line a row")
    return Sheet(file, sheet, tuple(names), rows, [number for number, _ in below], comma=delimiter != ",")


def _is(line: str, is_header: IsHeader) -> bool:
    try:
        cells = _cells([line.lstrip("# ")], _delimiter(line)) if len(line) < _LONGEST_HEADER else [[]]
    except csv.Error:
        return False
    return is_header(cells[0])


def _delimiter(line: str) -> str | None:
    return next((each for each in "\t;,|" if each in line), None)


def _cells_between_blanks(line: str) -> int:
    return sum(1 for _ in _BLANK_SEPARATED.finditer(line))


def _cells(lines: list[str], delimiter: str | None) -> list[list[str]]:
    """Return the cells of lines; a unit in parentheses belongs to the name before it."""
    if delimiter:
        return list(csv.reader(lines, delimiter=delimiter, strict=True))
    return [_BLANK_SEPARATED.findall(line) for line in lines]
