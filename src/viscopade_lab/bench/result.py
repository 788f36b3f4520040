"""Result of the benchmark: rows, as a CSV file and as the table on the terminal."""

from __future__ import annotations

import csv
import io
import math
from collections.abc import Iterator, Sequence
from dataclasses import astuple, dataclass, fields
from typing import Any

from viscopade_lab.bench.contender import MEASURES, Measure

HEADER = (
    *("id", "format", *(f"{measure} ns" for measure in MEASURES)),
    *("throughput/[3/6]", "latency/[3/6]", "memory/copy", "|d eps|/eps", "|d eps|/(1-eps)", "proven"),
)


@dataclass(frozen=True)
class Row:
    """The times of a contender in nanoseconds per collision, for a format and a measure; its errors.

    Attributes
    ----------
    id, label, group : str
        Of the contender.
    format, measure : str
    min_ns, median_ns : float
    spread : float
        Distance of the quartiles, relative to the median.
    ratio_to_3_6, ratio_to_copy : float or None
        Median over the rounds of the time over that of pow + [3/6], or of a scaled copy, in the same round, of the
        same type and measure.
    relative, loss : float or None
        Sampled maximum of |d eps|/eps, and of |d eps|/(1 - eps), over all speeds.
    proven : float or None
        A proven bound of both; for a kernel of v* without the rounding of v*.
    """

    id: str
    label: str
    group: str
    format: str
    measure: str
    min_ns: float
    median_ns: float
    spread: float
    ratio_to_3_6: float | None
    ratio_to_copy: float | None
    relative: float | None
    loss: float | None
    proven: float | None

    @property
    def is_proven(self) -> bool:
        """Whether `error` is the proven bound; a sampled error may exceed a bound without the rounding of v*."""
        return self.proven is not None and self.proven >= max(self.relative or 0, self.loss or 0)

    @property
    def error(self) -> float | None:
        """The proven bound, or the larger sampled error where there is no bound or where it exceeds the bound."""
        if self.is_proven:
            return self.proven
        return None if self.relative is None else max(self.relative, self.loss or 0)


COLUMNS = tuple(field.name for field in fields(Row))
# The first five fields, id to measure, are texts; the last five, the ratios and the errors, may be None: an empty cell.
_TEXTS, _OPTIONAL = 5, COLUMNS[-5:]


def to_csv(comments: Sequence[str], rows: Sequence[Row]) -> str:
    """Return a CSV file's text: comments on machine and conditions, names of columns, and a line for each of `rows`.

    Numbers have four digits, a choice: more than times repeat to.
    """
    buffer = io.StringIO()
    buffer.writelines(f"# {comment}\n" for comment in comments)
    cells = (["" if x is None else f"{x:.4g}" if isinstance(x, float) else x for x in astuple(row)] for row in rows)
    csv.writer(buffer, lineterminator="\n").writerows([COLUMNS, *cells])
    return buffer.getvalue()


def from_csv(content: bytes, source: str) -> list[Row]:
    """Return the rows of a CSV file with this content; `source` names it, for messages.

    Raises
    ------
    ValueError
        One line that names the file, and the row and what is wrong with it.
    """
    try:
        text = content.decode()
        lines = [line for line in csv.reader(io.StringIO(text)) if line and not line[0].startswith("#")]
    except (UnicodeDecodeError, csv.Error):
        raise ValueError(f"{source} is not readable: expected what `viscopade bench --output` wrote") from None
    # The line with the names of the columns, and at least one row.
    if len(lines) < 2 or tuple(lines[0]) != COLUMNS:
        raise ValueError(f"{source}: expected the columns {','.join(COLUMNS)}, and at least one row")
    rows = []
    for number, cells in enumerate(lines[1:], 1):
        if len(cells) != len(COLUMNS):
            raise ValueError(f"{source}, row {number}: expected {len(COLUMNS)} cells, not {len(cells)}")
        values: list[Any] = list(cells[:_TEXTS])
        for name, cell in zip(COLUMNS[_TEXTS:], cells[_TEXTS:], strict=True):
            # An empty cell is None where that may be; what is no number becomes NaN, which is refused like a negative
            # one.
            try:
                value = None if name in _OPTIONAL and not cell else float(cell)
            except ValueError:
                value = math.nan
            if value is not None and not 0 <= value < math.inf:
                # 40 characters of a cell keep the message on a line.
                raise ValueError(
                    f"{source}, row {number}: {name} is {cell[:40]!r}: expected a number that is not negative"
                )
            values.append(value)
        rows.append(Row(*values))
    return rows


def table(rows: Sequence[Row]) -> Iterator[list[str]]:
    """Yield the cells of the table with `HEADER`, a line for each contender and format of `rows`."""
    # (id, format) -> measure -> row
    lines: dict[tuple[str, str], dict[str, Row]] = {}
    for row in rows:
        lines.setdefault((row.id, row.format), {})[row.measure] = row

    def cell(measured: dict[str, Row], measure: Measure, column: str) -> str:
        """Return a number of a measure, the field `column` of its row: three digits, no exponent; or a dash."""
        number = getattr(measured[measure], column) if measure in measured else None
        if number is None:
            return "–"
        text = f"{number:.3g}"
        return text if "e" not in text else f"{float(text):f}".rstrip("0").rstrip(".")

    for (ident, form), measured in lines.items():
        # Errors are those of the function, the same for each measure.
        any_row = next(iter(measured.values()))
        errors = ("–" if x is None else f"{x:.1e}" for x in (any_row.relative, any_row.loss, any_row.proven))
        yield [
            *(ident, form, *(cell(measured, measure, "median_ns") for measure in MEASURES)),
            *(cell(measured, measure, "ratio_to_3_6") for measure in ("throughput", "latency")),
            *(cell(measured, "memory", "ratio_to_copy"), *errors),
        ]
