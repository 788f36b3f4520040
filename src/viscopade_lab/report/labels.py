"""Where labels stand beside their points: near, within the frame, and on nothing else.

Each label has candidate places around its point, ever farther away. The places of all labels together are improved one
label at a time until nothing changes. Nothing is random: the same points get the same places.
"""

from __future__ import annotations

import math
from collections.abc import Iterable, Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

Floats = NDArray[np.float64]
Segment = tuple[tuple[float, float], tuple[float, float]]

_DISTANCES = (5, 9, 14, 20, 28, 38, 50, 64, 80, 100, 125, 155, 190, 230, 280)
_DIRECTIONS = 16
_SHIFTS = (0.5, 0.3, 0.7, 0.1, 0.9)
_SWEEPS = 40
_FAR = 60.0  # cost of a label alone from which on others are moved for it

# What is wrong with a place, per occurrence; a point of distance counts 1.
_OVERLAP, _OUTSIDE, _ON_MARK, _THROUGH_LABEL = 1e5, 1e5, 1e4, 3e3
_ON_LINE, _THROUGH_MARK, _CROSSING, _AMBIGUOUS, _THROUGH_LINE = 600.0, 400.0, 150.0, 40.0, 4.0


@dataclass(frozen=True)
class Box:
    """A rectangle, in points (1/72 inch)."""

    left: float
    bottom: float
    right: float
    top: float

    def overlaps(self, other: Box) -> bool:
        """Whether the two have an area in common."""
        apart = self.right <= other.left or other.right <= self.left
        return not (apart or self.top <= other.bottom or other.top <= self.bottom)

    def nearest(self, x: float, y: float) -> tuple[float, float]:
        """Return the box's point nearest to a point."""
        return min(max(x, self.left), self.right), min(max(y, self.bottom), self.top)


def shortened(labels: Iterable[str]) -> dict[str, str]:
    """Return labels up to the first comma from which on no two of them are the same."""
    parts = {label: label.split(", ") for label in labels}
    short = {}
    for label, words in parts.items():
        others = [other for name, other in parts.items() if name != label]
        lengths = range(1, len(words) + 1)
        unique = (n for n in lengths if all(other[:n] != words[:n] for other in others))
        short[label] = ", ".join(words[: next(unique, len(words))])
    return short


def place(
    points: Sequence[tuple[float, float]],
    sizes: Sequence[tuple[float, float]],
    frame: Box,
    *,
    radius: float,
    lines: Sequence[Segment] = (),
    blocked: Sequence[Box] = (),
) -> list[Box]:
    """Return a box for the label of each point.

    Parameters
    ----------
    points : sequence of (x, y)
        Where the marks are, in points.
    sizes : sequence of (width, height)
        Of the labels.
    frame : Box
        What labels may not leave.
    radius : float
        Of the marks.
    lines : sequence of segments
        Lines that labels had better not lie on.
    blocked : sequence of Box
        Where no label may stand.
    """
    if not points:
        return []
    marks = np.array([(x - radius, y - radius, x + radius, y + radius) for x, y in points])
    obstacles = [Box(*map(float, mark)) for mark in marks]
    places = [_Places(p, size, radius) for p, size in zip(points, sizes, strict=True)]
    own = [
        each.cost_alone(frame, [o for j, o in enumerate(obstacles) if j != i], lines, blocked)
        for i, each in enumerate(places)
    ]
    return min((_settled(places, own, order) for order in _orders(points)), key=lambda found: found[0])[1]


def _orders(points: Sequence[tuple[float, float]]) -> list[list[int]]:
    """Return orders to place labels in: the crowded ones first, and from each side."""
    crowd = [sum(1 / (1 + math.dist(p, q)) for q in points) for p in points]
    indices = range(len(points))
    rising = sorted(indices, key=lambda i: (points[i][1], points[i][0]))
    across = sorted(indices, key=lambda i: (points[i][0], points[i][1]))
    return [sorted(indices, key=lambda i: (-crowd[i], i)), rising, rising[::-1], across, across[::-1]]


def _settled(places: Sequence[_Places], own: Sequence[Floats], order: Sequence[int]) -> tuple[float, list[Box]]:
    """Choose places one by one, then improve until nothing changes; return the total cost and the boxes."""
    chosen: dict[int, int] = {}
    for sweep in range(_SWEEPS):
        before = dict(chosen)
        for i in order:
            others = [(places[j], k) for j, k in chosen.items() if j != i]
            chosen[i] = int(np.argmin(own[i] + sum(places[i].cost_beside(other, k) for other, k in others)))
        if sweep and before == chosen and not _untangle(places, own, chosen):
            break
    total = sum(float(own[i][k]) for i, k in chosen.items())
    total += sum(
        float(places[i].cost_beside(places[j], chosen[j])[k]) for i, k in chosen.items() for j in chosen if j < i
    )
    return total, [places[i].box(chosen[i]) for i in range(len(places))]


def _untangle(places: Sequence[_Places], own: Sequence[Floats], chosen: dict[int, int]) -> bool:
    """Move pairs of labels, both at once, of which one is far off or in the other's way; return whether that helped."""
    helped = False
    for i in chosen:
        for j in chosen:
            in_the_way = i < j and places[i].cost_beside(places[j], chosen[j])[chosen[i]] >= _CROSSING
            if in_the_way or (i != j and own[i][chosen[i]] >= _FAR):
                helped |= _move_both(places, own, chosen, i, j)
    return helped


def _move_both(places: Sequence[_Places], own: Sequence[Floats], chosen: dict[int, int], i: int, j: int) -> bool:
    """Give two labels the places that are best together; return whether they differ from those they had."""
    alone = []
    for one in (i, j):
        others = [(places[k], at) for k, at in chosen.items() if k not in (i, j)]
        alone.append(own[one] + sum(places[one].cost_beside(other, at) for other, at in others))
    # A place that is much worse alone than the present ones are together need not be tried.
    present = float(alone[0][chosen[i]] + alone[1][chosen[j]] + places[i].cost_beside(places[j], chosen[j])[chosen[i]])
    best, found = present - 1e-6, None
    for k in np.flatnonzero(alone[1] + alone[0].min() < best).tolist():
        together = alone[0] + alone[1][k] + places[i].fresh_cost_beside(places[j], k)
        at = int(np.argmin(together))
        if together[at] < best:
            best, found = float(together[at]), (at, k)
    if found is not None:
        chosen[i], chosen[j] = found
    return found is not None


def _sides() -> list[tuple[float, float, float, float]]:
    """Return directions from a point, and which part of a box lies left of and below where it touches a circle."""
    found = []
    for step in range(_DIRECTIONS):
        angle = 2 * math.pi * step / _DIRECTIONS
        c, s = round(math.cos(angle), 9), round(math.sin(angle), 9)
        # The box touches with its corner, or right above and below with any part of its side.
        shifts = _SHIFTS if c == 0 else (float(c < 0),)
        found += [(c, s, shift, 0.5 if s == 0 else float(s < 0)) for shift in shifts]
    return found


_SIDES = _sides()


class _Places:
    """The candidate places of one label: boxes and leaders, one row for each."""

    def __init__(self, point: tuple[float, float], size: tuple[float, float], radius: float) -> None:
        self._beside: dict[tuple[int, int], Floats] = {}
        self.boxes, self.distances = _candidates(point, size, radius)
        x, y = point
        near_x = np.clip(x, self.boxes[:, 0], self.boxes[:, 2])
        near_y = np.clip(y, self.boxes[:, 1], self.boxes[:, 3])
        self.near = self._gaps(x, y) + 2
        self.leaders = np.column_stack([np.full_like(near_x, x), np.full_like(near_y, y), near_x, near_y])

    def _gaps(self, x: float, y: float) -> Floats:
        """Return how far the boxes are from a point."""
        left, bottom, right, top = self.boxes.T
        gaps: Floats = np.hypot(x - np.clip(x, left, right), y - np.clip(y, bottom, top))
        return gaps

    def box(self, k: int) -> Box:
        """Return candidate k."""
        return Box(*map(float, self.boxes[k]))

    def cost_alone(self, frame: Box, marks: list[Box], lines: Sequence[Segment], blocked: Sequence[Box]) -> Floats:
        """Return what each candidate costs whatever the other labels do."""
        left, bottom, right, top = self.boxes.T
        outside = np.maximum(0, frame.left - left) + np.maximum(0, frame.bottom - bottom)
        outside += np.maximum(0, right - frame.right) + np.maximum(0, top - frame.top)
        cost = self.distances + np.where(outside > 0, _OUTSIDE + outside, 0)
        for mark in marks:
            box = np.array([[mark.left, mark.bottom, mark.right, mark.top]])
            cost += _ON_MARK * _overlapping(self.boxes, box) + _THROUGH_MARK * _through(self.leaders, box)
            cost += _AMBIGUOUS * (self._gaps((mark.left + mark.right) / 2, (mark.bottom + mark.top) / 2) < self.near)
        for area in blocked:
            box = np.array([[area.left, area.bottom, area.right, area.top]])
            cost += _OVERLAP * _overlapping(self.boxes, box) + _THROUGH_MARK * _through(self.leaders, box)
        for (x, y), (x_end, y_end) in lines:
            line = np.array([[x, y, x_end, y_end]])
            cost += _ON_LINE * _through(line, self.boxes) + _THROUGH_LINE * _crossing(line, self.leaders)
        return cost

    def cost_beside(self, other: _Places, k: int) -> Floats:
        """Return what each candidate costs beside candidate k of another label."""
        key = id(other), k
        if key not in self._beside:
            self._beside[key] = self.fresh_cost_beside(other, k)
        return self._beside[key]

    def fresh_cost_beside(self, other: _Places, k: int) -> Floats:
        """Return the same without keeping it: all together would need much memory."""
        box, leader = other.boxes[k : k + 1], other.leaders[k : k + 1]
        cost = _OVERLAP * _overlapping(self.boxes, box)
        cost += _THROUGH_LABEL * (_through(self.leaders, box) + _through(leader, self.boxes))
        return cost + _CROSSING * _crossing(leader, self.leaders)


def _candidates(point: tuple[float, float], size: tuple[float, float], radius: float) -> tuple[Floats, Floats]:
    """Return boxes (rows of left, bottom, right, top) around a point, and what their distance costs."""
    (x, y), (width, height) = point, size
    boxes, costs = [], []
    for distance in _DISTANCES:
        near = (radius + distance) if distance > _DISTANCES[0] else radius + 2
        for c, s, shift_x, shift_y in _SIDES:
            left, bottom = x + near * c - shift_x * width, y + near * s - shift_y * height
            boxes.append((left, bottom, left + width, bottom + height))
            # To the right reads best, then the left, then above and below.
            costs.append(distance + 3 * (1 - c) + 2 * abs(s))
    return np.array(boxes), np.array(costs)


def _overlapping(a: Floats, b: Floats) -> NDArray[np.bool_]:
    """Return which boxes of one array overlap those of the other (one of them has one row)."""
    apart = (a[:, 2] <= b[:, 0]) | (b[:, 2] <= a[:, 0]) | (a[:, 3] <= b[:, 1]) | (b[:, 3] <= a[:, 1])
    return ~apart


def _through(segments: Floats, boxes: Floats) -> NDArray[np.bool_]:
    """Return which segments meet which boxes (Liang and Barsky's clipping; one array may have one row)."""
    count = max(len(segments), len(boxes))
    enter, leave = np.zeros(count), np.ones(count)
    for axis in (0, 1):
        start, step = segments[:, axis], segments[:, axis + 2] - segments[:, axis]
        low, high = boxes[:, axis] - start, boxes[:, axis + 2] - start
        with np.errstate(divide="ignore", invalid="ignore"):
            first, last = np.minimum(low / step, high / step), np.maximum(low / step, high / step)
        inside = (low < 0) & (high > 0)
        enter = np.maximum(enter, np.where(step == 0, np.where(inside, 0.0, np.inf), first))
        leave = np.minimum(leave, np.where(step == 0, np.where(inside, 1.0, -np.inf), last))
    return enter < leave


def _crossing(one: Floats, many: Floats) -> NDArray[np.bool_]:
    """Return which segments of the second array cross the one of the first."""

    def side(a: Floats, b: Floats, p: Floats) -> Floats:
        value: Floats = np.sign((b[:, 0] - a[:, 0]) * (p[:, 1] - a[:, 1]) - (b[:, 1] - a[:, 1]) * (p[:, 0] - a[:, 0]))
        return value

    a, b, p, q = one[:, :2], one[:, 2:], many[:, :2], many[:, 2:]
    crossing: NDArray[np.bool_] = (side(a, b, p) * side(a, b, q) < 0) & (side(p, q, a) * side(p, q, b) < 0)
    return crossing
