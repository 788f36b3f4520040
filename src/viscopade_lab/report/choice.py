"""Which kernel to take: points of time and error, their Pareto frontier, the fastest that is accurate enough."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

from viscopade_lab.bench.result import Result, Timing
from viscopade_lab.bench.speed_range import DISTRIBUTIONS

# What each panel of the picture shows: the first that was measured.
PANELS = (("throughput", "latency"), ("memory", "cache"))

# Errors that a simulation may be content with.
NEEDS = (1e-3, 1e-5, 1e-7, 1e-10)

# Up to so many times the smallest error, errors count as the smallest: one may be a bound, and the other sampled.
_AS_SMALL = 4


@dataclass(frozen=True)
class Point:
    """A kernel in the picture: `error` is None for what only sets a limit to the time, such as a copy."""

    row: Timing
    time: float
    error: float | None
    proven: bool


@dataclass(frozen=True)
class PicturePanel:
    """The points of one way of measuring."""

    measure: str
    speeds: str
    title: str
    points: list[Point]


@dataclass(frozen=True)
class Recommendation:
    """For an error of at most `need` (None: about the smallest there is) the fastest point of each measure, if any."""

    need: float | None
    fastest: tuple[Point | None, ...]


def panel(result: Result, form: str, measure: str) -> PicturePanel | None:
    """Return the points of one format and measure, for the first distribution that was measured, the fastest first."""
    measured = [row for row in result.rows if (row.format, row.measure) == (form, measure)]
    speeds = next((s for s in DISTRIBUTIONS if any(row.speeds == s for row in measured)), None)
    if speeds is None:
        return None
    points = []
    for row in measured:
        if row.speeds == speeds:
            error = result.error(row)
            value = None if error is None else error.value
            points.append(Point(row, row.median, value, error is not None and error.is_proven))
    points.sort(key=lambda point: (point.time, point.row.id))
    return PicturePanel(measure, speeds, title(result, measure), points)


def panels(result: Result, form: str) -> list[PicturePanel]:
    """Return what the picture of one format shows."""
    found = ([panel(result, form, measure) for measure in measures] for measures in PANELS)
    return [first for first in (next(filter(None, each), None) for each in found) if first is not None]


def title(result: Result, measure: str) -> str:
    """Return a measure's name as a title."""
    settings = result.conditions
    return {
        "latency": "One collision after another",
        "throughput": "One call per collision",
        "cache": f"Arrays in cache ({settings.cache_elements:,} numbers)",
        "memory": f"Arrays from memory ({settings.memory_elements:,} numbers)",
    }[measure]


def frontier(given: Sequence[Point]) -> list[Point]:
    """Return the points that no other beats in time or error without losing in the other, the fastest first.

    Points without an error do not take part.
    """
    rated = sorted((p.time, p.error, i) for i, p in enumerate(given) if p.error is not None)
    best: list[tuple[float, float, int]] = []
    for time, error, i in rated:
        if not best or error < best[-1][1] or (time, error) == best[-1][:2]:
            best.append((time, error, i))
    return [given[i] for _, _, i in best]


def choices(panels: Sequence[PicturePanel]) -> list[Recommendation]:
    """Return the fastest kernels, for each of `NEEDS` that one meets and for the smallest error."""
    found = [Recommendation(need, tuple(_fastest(panel, need) for panel in panels)) for need in NEEDS]
    errors = (point.error for panel in panels for point in panel.points if point.error is not None)
    smallest = min(errors, default=0.0)
    found.append(Recommendation(None, tuple(_fastest(panel, _AS_SMALL * smallest) for panel in panels)))
    return [choice for choice in found if any(choice.fastest)]


def _fastest(panel: PicturePanel, need: float) -> Point | None:
    enough = (point for point in panel.points if point.error is not None and point.error <= need)
    return min(enough, key=lambda point: (point.time, point.error), default=None)
