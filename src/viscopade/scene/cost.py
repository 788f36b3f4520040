"""Costs of kernels: nanoseconds that `viscopade bench` measured, or a weighted count of operations."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass

from viscopade.kernels.names import FAST
from viscopade.kernels.registry import Entry
from viscopade.records import Node
from viscopade.scene.description import Code

# In multiplications: about what these take on processors of our days (docs/bench/result.json).
DIVISION, POWER, CUBE_ROOT = 4, 50, 50
LEAST_SHARE = 0.01  # of pow that [3/6] takes at least, should a measurement say less

POW, PADE = "pow", "pow+[3/6]"
"""Ids in the benchmark of what all other times are related to."""
_FULL, _HALF_LINE = "full", "half-line-"
_BY_POW = (_FULL, _HALF_LINE)


@dataclass(frozen=True)
class Operations:
    """Operations of one evaluation.

    Attributes
    ----------
    simple : int
        Sums, products, and those on bits that find the row of a table.
    divisions, powers, cube_roots : int
    """

    simple: int = 0
    divisions: int = 0
    powers: int = 0
    cube_roots: int = 0

    @property
    def count(self) -> int:
        """The weighted number of operations."""
        return self.simple + DIVISION * self.divisions + POWER * self.powers + CUBE_ROOT * self.cube_roots


_OF_PADE = Operations(simple=18, divisions=1)  # [3/6], besides the power


@dataclass(frozen=True)
class Price:
    """Price of an evaluation in the unit of `Costs`; `how` is the source of the number."""

    value: float
    how: str


@dataclass(frozen=True)
class Costs:
    """Costs by the weighted count of operations.

    Attributes
    ----------
    unit : str
    source : str
        Where the costs are from, for the reader.
    """

    unit: str = "operations"
    source: str = (
        f"a count of operations (a division counts {DIVISION}, a power {POWER}, a cube root {CUBE_ROOT}); "
        "--costs takes what `viscopade bench --out` measured on your machine"
    )

    def of(self, bench_id: str | None, operations: Operations) -> Price:
        """Return the cost of a kernel, by its id in the benchmark and its operations."""
        return Price(operations.count, "counted")


COUNTED = Costs()


@dataclass(frozen=True)
class MeasuredCosts(Costs):
    """Costs by measured time.

    Attributes
    ----------
    times : mapping of str to float
        By id in the benchmark, nanoseconds.
    """

    times: Mapping[str, float] | None = None

    def of(self, bench_id: str | None, operations: Operations) -> Price:
        """Return the measured time; without one, the time of pow plus a proportional time of the other operations.

        A measured time less that of pow counts as measured, too.
        """
        times = self.times or {}
        if operations.count == 0:
            return Price(0.0, "nothing to compute")
        if bench_id is not None and bench_id in times:
            # All are measured from the speed on; a kernel that is given v* is spared pow.
            spared = times[POW] if bench_id.startswith(_BY_POW) and operations.powers == 0 else 0.0
            if times[bench_id] > spared:
                return Price(times[bench_id] - spared, "measured")
        each = max(times[PADE] - times[POW], LEAST_SHARE * times[POW]) / _OF_PADE.count
        return Price(
            operations.powers * times[POW] + each * (operations.count - POWER * operations.powers), "estimated"
        )


@dataclass(frozen=True)
class Time:
    """A measured time: nanoseconds per collision of a kernel (`id`), in a type, on some speeds, by one measure."""

    id: str
    format: str
    speeds: str
    measure: str
    median: float


@dataclass(frozen=True)
class MeasuredTimes:
    """Measured times from `viscopade bench`, with the machine and its compiler."""

    cpu: str
    compiler: str
    rows: tuple[Time, ...]

    @classmethod
    def from_json(cls, text: str | bytes, source: str) -> MeasuredTimes:
        """Return the times in a result of `viscopade bench --out`.

        Raises
        ------
        ValueError
            One line that names the file, the key, what is there and what is accepted.
        """
        whole = Node.of_json(text, source)
        machine = whole["machine"]
        return cls(machine["cpu"].text(), machine["compiler"].text(), tuple(map(_time, whole["rows"].items())))


def _time(row: Node) -> Time:
    identity = {name: row[name].text() for name in ("id", "format", "speeds", "measure")}
    return Time(**identity, median=row["ns"]["median"].number(positive=True))


def measured(result: MeasuredTimes, code: Code, processor: str) -> Costs:
    """Return the costs by a benchmark's times.

    Parameters
    ----------
    result : MeasuredTimes
    code : Code
        The wanted code, which decides on the measurements that count.
    processor : str
        That of this machine: the result says on which one it was measured.

    Raises
    ------
    ValueError
        If the result lacks pow or pow + [3/6], which all is related to, or the code takes v*.
    """
    measures = ("memory", "cache") if code.use == "batch" else ("throughput", "latency")
    for measure in measures:
        rows = [row for row in result.rows if (row.format, row.measure) == (code.format, measure)]
        speeds = rows[0].speeds if rows else ""
        times = {row.id: row.median for row in rows if row.speeds == speeds}
        if {PADE, POW} <= times.keys():
            machine = result.cpu
            elsewhere = "" if machine == processor else f", which is not this machine ({processor})"
            of_c = "" if code.target.measured else " for the code in C"
            source = f"nanoseconds, {measure}, measured{of_c} with {result.compiler} on {machine}{elsewhere}"
            return MeasuredCosts("ns", source, times)
    raise ValueError(
        f"the benchmark has no times of pow and {PADE} in type {code.format} ({' or '.join(measures)}): "
        "accepted is the result of `viscopade bench` without --only"
    )


def id_of(entry: Entry) -> str | None:
    """Return the benchmark's id of a kernel; None for small tables and compact kernels, which it does not measure."""
    if entry.kind == "speed":
        return f"speed-{entry.tier}" if entry.size == FAST else None
    return {"full": _FULL, "half-line": f"{_HALF_LINE}{entry.formula}"}.get(entry.kind)
