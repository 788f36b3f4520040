"""Sheets of a spreadsheet (XLS, XLSX, ODS), read by python-calamine in a process of its own.

A file of a few bytes may describe a table that fills the memory, or one that takes hours: a cell far from the others, a
repeated row, a shared text. So the process has limits of time and, on Linux, of memory. This file as a program, with
the largest numbers as JSON, reads a spreadsheet from standard input and prints its sheets as JSON.
"""

import io
import json
import sys

MEMORY, SECONDS = 1 << 30, 30
"""Limits of the process: bytes of its address space (1 GiB), and its duration.

Both were chosen by hand: 8 million numbers, the largest admissible table, take about 0.3 GB in Python, and a user may
wait for half a minute. A file that was made to fill the memory or to take hours ends here.
"""

Row = tuple[int, list[str | float]]
"""Number of a row in its sheet, and its cells."""


def worksheets(content: bytes, cells: int, characters: int) -> list[tuple[str, list[Row]]]:
    """Return the names of all sheets and their rows that are not blank.

    Parameters
    ----------
    content : bytes
    cells, characters : int
        Largest numbers in all sheets, empty cells between others included.

    Raises
    ------
    ValueError
        If the file is no spreadsheet, or is too large.
    """
    from viscopade import files  # which the process does not need

    if getattr(sys, "frozen", False):
        return sheets_of(content, cells, characters)
    printed = files.isolated_output(__file__, [cells, characters], content, MEMORY, SECONDS, "smaller tables")
    return [(name, rows) for name, rows in json.loads(printed)]


def sheets_of(content: bytes, cells: int, characters: int) -> list[tuple[str, list[Row]]]:
    """Return the same as `worksheets`, in this process; Booleans, dates and times become texts.

    `content` is that of the file; `cells` and `characters` are the largest numbers in all sheets.
    """
    from python_calamine import CalamineWorkbook

    tables = []
    with CalamineWorkbook.from_filelike(io.BytesIO(content)) as book:
        for name in book.sheet_names:
            sheet = book.get_sheet_by_name(name)
            # Count cells before they are made: a repeated row may have millions.
            cells -= sheet.total_height * sheet.total_width
            if cells < 0:
                raise ValueError("it has too many cells: expected smaller tables")
            # Rows with a cell that is not empty, by their numbers from 1; whole numbers become floats.
            rows: list[Row] = []
            for number, row in enumerate(sheet.to_python(skip_empty_area=False), 1):
                if any(cell != "" for cell in row):
                    number_or_text = (float(x) if type(x) is int else x if type(x) is float else str(x) for x in row)
                    rows.append((number, [*number_or_text]))
            characters -= sum(len(cell) for _, row in rows for cell in row if isinstance(cell, str))
            if characters < 0:
                raise ValueError("it has too many characters: expected smaller tables")
            tables.append((name, rows))
    return tables


if __name__ == "__main__":
    json.dump(sheets_of(sys.stdin.buffer.read(), *json.loads(sys.argv[1])), sys.stdout)
