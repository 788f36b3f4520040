"""What the benchmark found, as tables to read."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from typing import NamedTuple

from viscopade_lab.bench.kernel import FORMATS, MEASURES, Measure
from viscopade_lab.bench.measured import Error, Key, Measured, Row, Target
from viscopade_lab.bench.scene import SPEEDS, Speeds

HEADER = (
    "id",
    "group",
    "format",
    "speeds",
    "measure",
    "min ns",
    "median ns",
    "spread",
    "time/[3/6]",
    "time/copy",
    "|d eps|/eps",
    "|d eps|/(1-eps)",
    "proven",
)

_NONE = "–"
_COLUMNS: dict[Measure, str] = {
    "latency": "latency",
    "throughput": "throughput",
    "cache": "array in cache",
    "memory": "array from memory",
}


class Table(NamedTuple):
    """A table with a title."""

    title: str
    header: Sequence[str]
    rows: list[Sequence[str]]


def long(measured: Measured) -> list[Sequence[str]]:
    """Return one line for each row, with `HEADER`."""
    errors = {(error.id, error.format): error for error in measured.errors}
    return [_line(row, errors[row.key.id, row.key.format]) for row in measured.rows]


def tables(measured: Measured) -> Iterator[Table]:
    """Return tables of all times with the errors beside them, and one of the targets."""
    rows = {row.key: row for row in measured.rows}
    for form in FORMATS:
        for speeds in SPEEDS:
            yield _times(measured, rows, form, speeds)
    yield _targets(measured.targets)


def introduction(measured: Measured) -> list[str]:
    """Return what the reader must know of the numbers."""
    machine, scene = measured.machine, measured.scene
    return [
        f"{machine.cpu}; {machine.compiler}; {machine.system}; Python {machine.python}, NumPy {machine.numpy}",
        f"scalar: {measured.flags['scalar']}; arrays: {measured.flags['array']}, {measured.cache_elements} elements in "
        f"the cache, {measured.memory_elements} from memory; {measured.rounds} rounds",
        f"beta = {scene.beta:g}, speeds from {scene.speed_min:g} to {scene.speed_max:g} {scene.unit}",
        "Times are nanoseconds per collision: median/least ± distance of the quartiles. Ratios are medians of those in "
        "one round; below 1 is faster. Errors are sampled on these speeds; a proven one is that of "
        "|d eps|/min(eps, 1 - eps), an ulp is a unit in the last place of eps.",
    ]


def notes(measured: Measured) -> list[str]:
    """Return the remarks on single kernels."""
    remarks: dict[str, list[str]] = {}
    for error in measured.errors:
        ids = remarks.setdefault(error.note, [])
        if error.id not in ids:
            ids.append(error.id)
    remarks.pop("", None)
    return [f"{', '.join(ids)}: {note}" for note, ids in remarks.items()]


def _times(measured: Measured, rows: dict[Key, Row], form: str, speeds: Speeds) -> Table:
    header = ["id", "kernel", *_COLUMNS.values(), "throughput/[3/6]", "latency/[3/6]", "memory/copy", *HEADER[-3:]]
    lines: list[Sequence[str]] = []
    for error in measured.errors:
        found = {measure: rows.get(Key(error.id, form, speeds, measure)) for measure in MEASURES}
        if error.format != form or not any(found.values()):
            continue
        fast, slow, memory = found["throughput"], found["latency"], found["memory"]
        ratios = [
            _number(fast.ratio_to_3_6 if fast else None),
            _number(slow.ratio_to_3_6 if slow else None),
            _number(memory.ratio_to_copy if memory else None),
        ]
        times = [_time(found[measure]) for measure in MEASURES]
        lines.append([error.id, error.label, *times, *ratios, *_errors(error)])
    return Table(f"type {form}, {speeds} speeds", header, lines)


def _targets(found: Sequence[Target]) -> Table:
    words = {True: "yes", False: "NO", None: _NONE}
    lines = [(t.what, t.target, _number(t.measured), words[t.reached], t.note) for t in found]
    return Table("targets", ("what", "target", "measured", "reached", "note"), list(lines))


def _line(row: Row, error: Error) -> Sequence[str]:
    key = row.key
    times = (_number(row.min), _number(row.median), f"{row.spread:.3f}")
    ratios = (_number(row.ratio_to_3_6), _number(row.ratio_to_copy))
    return (key.id, row.group, key.format, key.speeds, key.measure, *times, *ratios, *_errors(error))


def _errors(error: Error) -> tuple[str, str, str]:
    return _scientific(error.relative), _scientific(error.loss), error.proven or _NONE


def _time(row: Row | None) -> str:
    return _NONE if row is None else f"{_number(row.median)}/{_number(row.min)} ±{100 * row.spread:.0f}%"


def _number(value: float | None) -> str:
    """Return three digits, without an exponent."""
    if value is None:
        return _NONE
    text = f"{value:.3g}"
    return text if "e" not in text else f"{float(text):f}".rstrip("0").rstrip(".")


def _scientific(value: float | None) -> str:
    return _NONE if value is None else f"{value:.1e}"
