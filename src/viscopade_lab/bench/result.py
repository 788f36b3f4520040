"""What the benchmark measured: rows, as a CSV file and as the table on the terminal."""

from __future__ import annotations

import csv
import io
import math
from collections.abc import Callable, Iterator, Sequence
from dataclasses import astuple, dataclass, fields

from viscopade.arithmetic.formats import FORMATS
from viscopade_lab.bench.contender import GROUPS, MEASURES
from viscopade_lab.bench.speed_range import DISTRIBUTIONS

HEADER = (
    *("id", "format", *(f"{measure} ns" for measure in MEASURES)),
    *("throughput/[3/6]", "latency/[3/6]", "memory/copy", "|d eps|/eps", "|d eps|/(1-eps)", "proven"),
)


@dataclass(frozen=True)
class Row:
    """The times of a contender in nanoseconds per collision, in a type, on some speeds, by a measure; its errors.

    Attributes
    ----------
    id, label, group : str
        Of the contender.
    format, speeds, measure : str
    min_ns, median_ns : float
    spread : float
        Distance of the quartiles, relative to the median.
    ratio_to_3_6, ratio_to_copy : float or None
        Median over the rounds of the time over that of pow + [3/6], or of a scaled copy, in the same round, of the
        same type, speeds and measure.
    relative, loss : float or None
        Sampled maximum of |d eps|/eps, and of |d eps|/(1 - eps), over all speeds.
    proven : float or None
        A proven bound of both; of a kernel of v* without the rounding of v*.
    """

    id: str
    label: str
    group: str
    format: str
    speeds: str
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
    def sampled(self) -> float | None:
        """The larger of the two sampled errors; None if there is none."""
        return max((value for value in (self.relative, self.loss) if value is not None), default=None)

    @property
    def is_proven(self) -> bool:
        """Whether `error` is the proven bound: a sampled error may exceed one that is without the rounding of v*."""
        return self.proven is not None and (self.sampled is None or self.sampled <= self.proven)

    @property
    def error(self) -> float | None:
        """The proven bound, or the sampled error where there is no bound or where it exceeds the bound."""
        return self.proven if self.is_proven else self.sampled


COLUMNS = tuple(field.name for field in fields(Row))
_CHOICES = {"group": GROUPS, "format": tuple(FORMATS), "speeds": DISTRIBUTIONS, "measure": MEASURES}
_TEXTS = ("id", "label", *_CHOICES)
_OPTIONAL = COLUMNS[-5:]


def to_csv(comments: Sequence[str], rows: Sequence[Row]) -> str:
    """Return the file's text: comments on machine and conditions, and one line for each row."""
    buffer = io.StringIO()
    buffer.writelines(f"# {comment}\n" for comment in comments)
    cells = (["" if x is None else f"{x:.4g}" if isinstance(x, float) else x for x in astuple(row)] for row in rows)
    csv.writer(buffer, lineterminator="\n").writerows([COLUMNS, *cells])
    return buffer.getvalue()


def from_csv(content: bytes, source: str) -> list[Row]:
    """Return the rows of a file, checked; `source` names it, for messages.

    Raises
    ------
    ValueError
        One line that names the file, the line, the column, the value and what was expected.
    """
    try:
        text = content.decode()
        lines = [line for line in csv.reader(io.StringIO(text)) if line and not line[0].startswith("#")]
    except (UnicodeDecodeError, csv.Error):
        raise ValueError(f"{source} is not readable: expected what `viscopade bench --out` wrote") from None
    if not lines or tuple(lines[0]) != COLUMNS:
        raise ValueError(f"{source}: expected the columns {','.join(COLUMNS)}")
    rows: dict[tuple[str, ...], Row] = {}
    for number, cells in enumerate(lines[1:], 1):
        where = f"{source}, row {number}"
        if len(cells) != len(COLUMNS):
            raise ValueError(f"{where}: expected {len(COLUMNS)} cells, not {len(cells)}")
        values = {name: _value(where, name, cell) for name, cell in zip(COLUMNS, cells, strict=True)}
        row = Row(**values)  # type: ignore[arg-type]
        if rows.setdefault((row.id, row.format, row.speeds, row.measure), row) is not row:
            raise ValueError(f"{where}: repeats {row.id}, {row.format}, {row.speeds}, {row.measure}")
    if not rows:
        raise ValueError(f"{source}: expected at least one row")
    return list(rows.values())


def _value(where: str, name: str, cell: str) -> str | float | None:
    """Return the value in a column."""
    expected: str
    if name in _TEXTS:
        choices = _CHOICES.get(name)
        if (cell in choices) if choices else (cell.isprintable() and 0 < len(cell) <= 100):
            return cell
        expected = " or ".join(choices) if choices else "1 to 100 printable characters"
    else:
        if cell == "" and name in _OPTIONAL:
            return None
        try:
            value = float(cell)
        except ValueError:
            value = math.nan
        if 0 <= value < math.inf and (value > 0 or not name.endswith("_ns")):
            return value
        expected = "a positive number" if name.endswith("_ns") else "a number that is not negative"
    raise ValueError(f"{where}: {name} is {cell[:40]!r}: expected {expected}")


def table(rows: Sequence[Row]) -> Iterator[list[str]]:
    """Yield a line with `HEADER` for each contender and type, on the log-uniform speeds."""
    lines: dict[tuple[str, str], dict[str, Row]] = {}
    for row in rows:
        if row.speeds == "log-uniform":
            lines.setdefault((row.id, row.format), {})[row.measure] = row
    for (ident, form), measured in lines.items():
        any_row = next(iter(measured.values()))
        ratios = (
            _cell(measured, "throughput", lambda row: row.ratio_to_3_6),
            _cell(measured, "latency", lambda row: row.ratio_to_3_6),
            _cell(measured, "memory", lambda row: row.ratio_to_copy),
        )
        errors = ("–" if x is None else f"{x:.1e}" for x in (any_row.relative, any_row.loss, any_row.proven))
        yield [ident, form, *(_cell(measured, m, lambda row: row.median_ns) for m in MEASURES), *ratios, *errors]


def _cell(measured: dict[str, Row], measure: str, value: Callable[[Row], float | None]) -> str:
    """Return three digits without an exponent, or a dash for what was not measured."""
    number = value(measured[measure]) if measure in measured else None
    if number is None:
        return "–"
    text = f"{number:.3g}"
    return text if "e" not in text else f"{float(text):f}".rstrip("0").rstrip(".")
