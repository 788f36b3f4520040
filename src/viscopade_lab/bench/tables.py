"""What the benchmark found, as tables to read."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from typing import NamedTuple

from viscopade.arithmetic.formats import FORMATS
from viscopade_lab.bench.contender import MEASURES, TimingMeasure
from viscopade_lab.bench.result import Error, Goal, Key, Result, Timing
from viscopade_lab.bench.speed_range import DISTRIBUTIONS, Distribution

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
_COLUMNS: dict[TimingMeasure, str] = {
    "latency": "latency",
    "throughput": "throughput",
    "cache": "array in cache",
    "memory": "array from memory",
}


class TitledTable(NamedTuple):
    """A table with a title."""

    title: str
    header: Sequence[str]
    rows: list[Sequence[str]]


def long(result: Result) -> list[Sequence[str]]:
    """Return one line for each row, with `HEADER`."""
    errors = {(error.id, error.format): error for error in result.errors}
    return [_line(row, errors[row.id, row.format]) for row in result.rows]


def tables(result: Result) -> Iterator[TitledTable]:
    """Return tables of all times with the errors beside them, and one of the targets."""
    rows = {row.key: row for row in result.rows}
    for form in FORMATS:
        for speeds in DISTRIBUTIONS:
            yield _times(result, rows, form, speeds)
    yield _goals(result.goals)


def introduction(result: Result) -> list[str]:
    """Return what the reader must know of the numbers."""
    machine, settings = result.machine, result.conditions
    speeds = settings.range
    return [
        f"{machine.cpu}; {machine.compiler}; {machine.system}; Python {machine.python}, NumPy {machine.numpy}",
        f"scalar: {settings.flags_scalar}; arrays: {settings.flags_array}, {settings.cache_elements} elements in "
        f"the cache, {settings.memory_elements} from memory; {settings.rounds} rounds",
        f"beta = {speeds.beta:g}, speeds from {speeds.speed_min:g} to {speeds.speed_max:g} {speeds.unit}",
        "Times are nanoseconds per collision: median/least ± distance of the quartiles. Ratios are medians of those in "
        "one round; below 1 is faster. Errors are sampled on these speeds; a proven one is that of "
        "|d eps|/min(eps, 1 - eps), an ulp is a unit in the last place of eps.",
    ]


def notes(result: Result) -> list[str]:
    """Return the remarks on single kernels."""
    remarks: dict[str, list[str]] = {}
    for error in result.errors:
        ids = remarks.setdefault(error.note, [])
        if error.id not in ids:
            ids.append(error.id)
    remarks.pop("", None)
    return [f"{', '.join(ids)}: {note}" for note, ids in remarks.items()]


def _times(result: Result, rows: dict[Key, Timing], form: str, speeds: Distribution) -> TitledTable:
    header = ["id", "kernel", *_COLUMNS.values(), "throughput/[3/6]", "latency/[3/6]", "memory/copy", *HEADER[-3:]]
    lines: list[Sequence[str]] = []
    for error in result.errors:
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
    return TitledTable(f"type {form}, {speeds} speeds", header, lines)


def _goals(found: Sequence[Goal]) -> TitledTable:
    words = {True: "yes", False: "NO", None: _NONE}
    lines = [(t.what, t.target, _measured(t), words[t.reached], t.note) for t in found]
    return TitledTable("targets", ("what", "target", "measured", "reached", "note"), list(lines))


def _line(row: Timing, error: Error) -> Sequence[str]:
    times = (_number(row.min), _number(row.median), f"{row.spread:.3f}")
    ratios = (_number(row.ratio_to_3_6), _number(row.ratio_to_copy))
    return (row.id, row.group, row.format, row.speeds, row.measure, *times, *ratios, *_errors(error))


def _errors(error: Error) -> tuple[str, str, str]:
    return _scientific(error.relative), _scientific(error.loss), error.proven or _NONE


def _time(row: Timing | None) -> str:
    return _NONE if row is None else f"{_number(row.median)}/{_number(row.min)} ±{100 * row.spread:.0f}%"


def _measured(goal: Goal) -> str:
    return goal.measured if isinstance(goal.measured, str) else _number(goal.measured)


def _number(value: float | None) -> str:
    """Return three digits, without an exponent."""
    if value is None:
        return _NONE
    text = f"{value:.3g}"
    return text if "e" not in text else f"{float(text):f}".rstrip("0").rstrip(".")


def _scientific(value: float | None) -> str:
    return _NONE if value is None else f"{value:.1e}"
