"""Sheets of a spreadsheet (XLS, XLSX, ODS), whose size is checked first.

The parser makes a table that reaches from the first cell to the last one, even if all cells between them are empty,
and copies shared texts. So a small file could fill the memory.
"""

from __future__ import annotations

import io
import re
import struct
import zipfile
from collections.abc import Iterator
from typing import NamedTuple
from xml.parsers import expat

from viscopade import files

_REFERENCE = re.compile(r"([A-Za-z]{1,9})([0-9]{1,9})")
_WITH_COMMA, _WITH_POINT = (re.compile(rf"[+-]?[0-9]*{sign}[0-9]+(?:[eE][+-]?[0-9]+)?") for sign in (",", "[.]"))
_NUMBER, _LABEL, _BOOLEAN, _RK, _LABEL_SST, _MUL_RK, _FORMULA = 0x203, 0x204, 0x205, 0x27E, 0xFD, 0xBD, 0x6
_CELLS = {_NUMBER, _LABEL, _BOOLEAN, _RK, _LABEL_SST, _MUL_RK, _FORMULA}
_DIMENSIONS, _SHEET, _END = 0x200, 0x85, 0xA
_SHORT_STREAM = 4096  # bytes: shorter ones lie in sectors of 64 bytes


def worksheets(content: bytes, source: str) -> Iterator[tuple[str, list[list[str]]]]:
    """Yield the names and the rows of cells of all sheets.

    Raises
    ------
    ValueError
        If the file is no spreadsheet, or its tables are too large.
    ModuleNotFoundError
        If python-calamine is not installed.
    """
    from python_calamine import CalamineError, CalamineWorkbook

    if content.startswith(b"PK"):
        content = _checked_archive(content, source)
    else:
        files.require_cells(source, _reach_of_xls(content, source))
    try:
        with CalamineWorkbook.from_filelike(io.BytesIO(content)) as book:
            cells = 0
            for name in book.sheet_names:
                sheet = book.get_sheet_by_name(name)
                files.require_cells(source, cells := cells + sheet.total_height * sheet.total_width)
                rows = sheet.to_python()
                texts = [cell.strip() for row in rows for cell in row if isinstance(cell, str)]
                comma = not any(map(_WITH_POINT.fullmatch, texts))
                yield name, [[_text(cell, comma) for cell in row] for row in rows]
    except BaseException as error:
        if isinstance(error, CalamineError | OSError) or type(error).__name__ == "PanicException":  # of Rust
            raise ValueError(f"{source}: the spreadsheet cannot be read: {str(error).splitlines()[0]}") from None
        raise


def _text(cell: object, comma: bool) -> str:
    """Return a cell as text; if a sheet's texts may have decimal commas, a number with one gets a point."""
    text = repr(cell) if isinstance(cell, float) else str(cell)
    return text.replace(",", ".") if comma and _WITH_COMMA.fullmatch(text.strip()) else text


def _checked_archive(content: bytes, source: str) -> bytes:
    """Return an archive of the XML in an XLSX or ODS, after a check of the size that it unpacks to."""
    members = files.members(content, source).items()
    parts = {name: part for name, part in members if name.endswith((".xml", ".rels")) or name == "mimetype"}
    try:
        extents = [_extent_of_xml(part) for name, part in parts.items() if name != "mimetype"]
    except (expat.ExpatError, ValueError) as error:
        raise ValueError(f"{source}: the spreadsheet cannot be read: {error}") from None
    files.require_cells(source, sum(extent.cells for extent in extents))
    longest = max((extent.longest for extent in extents), default=0)
    files.require_size(source, sum(extent.characters + extent.sharing * longest for extent in extents))
    packed = io.BytesIO()
    with zipfile.ZipFile(packed, "w") as archive:
        for name, part in parts.items():
            archive.writestr(name, part)
    return packed.getvalue()


class _Extent(NamedTuple):
    """Size of the tables in an XML file after they are unpacked.

    Attributes
    ----------
    cells : int
        Number of cells from the first one to the last one, empty ones included, of all tables.
    characters : int
        Number of characters in these cells, without those of shared texts.
    sharing : int
        Number of cells that refer to a shared text.
    longest : int
        Number of characters of the longest shared text.
    """

    cells: int
    characters: int
    sharing: int
    longest: int


def _extent_of_xml(text: bytes) -> _Extent:
    cells = row = column = rows = columns = characters = sharing = longest = length = across = down = 0

    def start(tag: str, attributes: dict[str, str]) -> None:
        nonlocal cells, row, column, rows, columns, sharing, length, across, down
        kind = tag.rpartition(":")[2]
        if kind in ("worksheet", "table"):
            cells, row, rows, columns = cells + rows * columns, 0, 0, 0
        elif kind == "row":  # XLSX has "row", "c" and "si"
            row, column = int(attributes.get("r", row + 1)), 0
        elif kind == "c":
            column += 1
            if reference := _REFERENCE.fullmatch(attributes.get("r", "")):
                row, column = int(reference[2]), 0
                for letter in reference[1].upper():
                    column = 26 * column + ord(letter) - 64
            rows, columns = max(rows, row), max(columns, column)
            sharing, length, across, down = sharing + (attributes.get("t") == "s"), 0, 1, 1
        elif kind == "si":
            length = 0
        elif kind == "table-row":  # ODS has "table-row", "table-cell" and "s"
            down, column = int(attributes.get("table:number-rows-repeated", 1)), 0
            row += down
        elif kind in ("table-cell", "covered-table-cell"):
            length, across = 0, int(attributes.get("table:number-columns-repeated", 1))
            column += across
            if any(name.startswith("office:") for name in attributes):  # it has a value
                rows, columns = max(rows, row), max(columns, column)
            else:
                across = 0
        elif kind == "s":  # blanks
            length += int(attributes.get("text:c", 1))

    def data(piece: str) -> None:
        nonlocal length
        length += len(piece)

    def end(tag: str) -> None:
        nonlocal characters, longest
        kind = tag.rpartition(":")[2]
        if kind in ("c", "table-cell", "covered-table-cell"):
            characters += length * across * down
        elif kind == "si":
            longest = max(longest, length)

    parser = expat.ParserCreate()
    parser.buffer_text = True
    parser.StartElementHandler, parser.CharacterDataHandler, parser.EndElementHandler = start, data, end
    parser.Parse(text, True)
    return _Extent(cells + rows * columns, characters, sharing, longest)


def _reach_of_xls(content: bytes, source: str) -> int:
    """Return the number of cells from the first one to the last one, of all sheets in an XLS."""
    try:
        records = _records_of_xls(content)
        starts = [struct.unpack_from("<I", body)[0] for kind, body in _records(records, 0) if kind == _SHEET]
        reach = {start: _reach_of_sheet(records, start) for start in set(starts[: files.MOST_MEMBERS])}
        return sum(reach[start] for start in starts)
    except (struct.error, LookupError, ValueError):
        raise ValueError(f"{source}: the spreadsheet cannot be read: expected XLS") from None


def _records(stream: bytes, start: int) -> Iterator[tuple[int, bytes]]:
    """Yield kind and body of each record, up to the end of a sheet or of the workbook's head."""
    kind = -1
    while kind != _END and start + 4 <= len(stream):
        kind, length = struct.unpack_from("<HH", stream, start)
        yield kind, stream[start + 4 : start + 4 + length]
        start += 4 + length


def _reach_of_sheet(stream: bytes, start: int) -> int:
    rows = columns = stated = 0
    for kind, body in _records(stream, start):
        if kind in _CELLS:
            row, column = struct.unpack_from("<HH", body)
            last = struct.unpack("<H", body[-2:])[0] if kind == _MUL_RK else column
            rows, columns = max(rows, row + 1), max(columns, last + 1, column + 1)
        elif kind == _DIMENSIONS:  # the parser reserves memory for the stated size
            first, last, left, right = struct.unpack_from("<IIHH" if len(body) > 10 else "<HHHH", body)
            stated = max(stated, (last - first) % (1 << 32) * ((right - left) % (1 << 32)))
    return max(rows * columns, stated)


def _records_of_xls(content: bytes) -> bytes:
    """Return the stream of records: a compound file chains its sectors by tables."""

    def sector(number: int) -> bytes:
        return content[(number + 1) * size : (number + 2) * size]

    def numbers(data: bytes) -> list[int]:
        return [number for (number,) in struct.iter_unpack("<I", data)]

    def chain(number: int, table: list[int], data: bytes, size: int) -> bytes:
        pieces: list[bytes] = []
        while number < len(table) and len(pieces) < len(table):
            pieces.append(data[number * size : (number + 1) * size])
            number = table[number]
        return b"".join(pieces)

    size = 1 << min(content[30], 12)
    directory, short_table, more = (struct.unpack_from("<I", content, place)[0] for place in (48, 60, 68))
    tables = numbers(content[76:512])
    for _ in range(len(content) // size):
        if not (listed := numbers(sector(more))):
            break
        tables, more = tables + listed[:-1], listed[-1]
    table = numbers(b"".join(map(sector, tables)))
    streams: dict[str, tuple[int, int]] = {}
    entries = chain(directory, table, content[size:], size)
    for place in range(0, len(entries) - 127, 128):
        name = entries[place : place + 64].decode("utf-16-le", errors="replace").partition("\0")[0]
        streams.setdefault(name if place else "root", struct.unpack_from("<II", entries, place + 116))
    first, length = streams["Workbook" if "Workbook" in streams else "Book"]
    if length >= _SHORT_STREAM:
        return chain(first, table, content[size:], size)
    short = chain(streams["root"][0], table, content[size:], size)
    return chain(first, numbers(chain(short_table, table, content[size:], size)), short, 64)
