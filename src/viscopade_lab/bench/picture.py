"""The picture of the benchmark: error over time for kernels, rivals and limits, with the Pareto frontier."""

from __future__ import annotations

import io
from collections.abc import Sequence
from itertools import pairwise
from typing import TYPE_CHECKING

from viscopade.plots import sheet
from viscopade_lab.bench.contender import Measure
from viscopade_lab.bench.result import Row

if TYPE_CHECKING:
    from matplotlib.axes import Axes

PANELS: tuple[tuple[str, Measure], ...] = (("One call per collision", "throughput"), ("Arrays from memory", "memory"))

LOOKS = {
    "ours": ("#0068a8", "o", "this package"),
    "rival": ("#bd4b00", "D", "other methods"),
    "limit": ("#00755a", "^", "limits, such as a copy"),
}
"""By group: colour, marker and words of the legend."""
GREY = "#5c5f66"
# Both ends are chosen by hand.
_CEILING = 100.0  # larger errors are drawn here: they are useless, whatever their size
_SLOWEST = 500.0  # times the fastest: slower functions are drawn here, to leave room for the rest

# Offsets of a label from its mark, in points, with its side next to the mark: beside it first, then above and below,
# farther and farther away. Chosen by hand: a label is 8 points high, and a line of letters needs some 10.
_OFFSETS = [(8.0, 0.0, "left"), (-8.0, 0.0, "right")] + [
    (dx, sign * dy, side)
    for dy in (8, 12, 18, 25, 33, 42)
    for sign in (1, -1)
    for dx, side in ((5.0, "left"), (0.0, "center"), (-5.0, "right"))
]

_STYLE = {
    "svg.hashsalt": "viscopade",  # ids in SVG files would be random otherwise
    "font.size": 9,
    "axes.grid": True,
    "axes.axisbelow": True,
    "axes.spines.top": False,
    "axes.spines.right": False,
    "grid.color": "#e3e3e6",
}


def points(rows: Sequence[Row], measure: Measure) -> list[Row]:
    """Return the rows of one panel: those of a measure in double, the fastest first."""
    shown = [row for row in rows if (row.format, row.measure) == ("double", measure)]
    return sorted(shown, key=lambda row: (row.median_ns, row.id))


def frontier(panel: Sequence[Row]) -> list[Row]:
    """Return the Pareto frontier, the fastest first: no other point is better in both time and error."""
    # From the fastest on, a point belongs to it if its error is below that of all faster ones.
    best: list[Row] = []
    for row in sorted((row for row in panel if row.error is not None), key=lambda row: (row.median_ns, row.error)):
        if not best or (row.error or 0) < (best[-1].error or 0):
            best.append(row)
    return best


def draw(rows: Sequence[Row], kind: str) -> bytes:
    """Return the picture of the rows of a run as a file's content; `kind` is "svg", "pdf" or "png".

    Sizes are chosen by hand, for a page 7.6 inches wide.
    """
    from matplotlib import style
    from matplotlib.figure import Figure
    from matplotlib.lines import Line2D

    panels = [(title, shown) for title, measure in PANELS if (shown := points(rows, measure))]
    if not panels:
        raise ValueError("the result has no times in type double: expected the result of a whole run")
    with style.context(["default", _STYLE]):
        # 4.9 inches for each panel, 0.4 for the legend.
        figure = Figure(figsize=(7.6, 0.4 + 4.9 * len(panels)), layout="constrained")
        planes = figure.subplots(len(panels), squeeze=False).ravel()
        corners = []
        for axes, (title, panel) in zip(planes, panels, strict=True):
            axes.set_title(title, loc="left", fontweight="bold", fontsize=10)
            corners.append(_draw_panel(axes, panel))
        # The legend: colours and markers of groups, filled and empty marks, and the frontier.
        entries = [Line2D([], [], color=c, marker=m, linestyle="", label=label) for c, m, label in LOOKS.values()]
        entries += [
            Line2D([], [], color=GREY, marker="o", linestyle="", label="error proven"),
            Line2D([], [], color=GREY, marker="o", linestyle="", markerfacecolor="white", label="error sampled"),
            Line2D([], [], color=GREY, alpha=0.55, linewidth=1.6, label="Pareto frontier"),
        ]
        figure.legend(handles=entries, loc="outside upper left", ncols=3, frameon=False, fontsize=8.5)
        figure.draw_without_rendering()  # fixes the places of the axes
        for axes, (_, panel), line in zip(planes, panels, corners, strict=True):
            _write_labels(axes, panel, line)
        buffer = io.BytesIO()
        title = "Time and error of kernels from speed to eps"
        data = sheet.metadata(title, "viscopade bench --picture", kind)
        figure.savefig(buffer, format=kind, dpi=sheet.PNG_DPI, metadata=data)
    return buffer.getvalue()


def _draw_panel(axes: Axes, panel: Sequence[Row]) -> list[tuple[float, float]]:
    """Draw a panel's marks and frontier into `axes`; return the corners of the frontier, (time in ns, error).

    `panel` has the rows, the fastest first. Sizes of marks and lines are in points, chosen by hand.
    """
    # The axis of errors leaves room below the smallest, for points without an error (a thirtieth of it) and labels, and
    # above the largest; that of times for labels at the right. If no row has an error: 1e-16 to 1.
    errors = [min(row.error, _CEILING) for row in panel if row.error]
    low, high = min(errors, default=1e-16) / 100, max(errors, default=1.0) * 20
    right = 2.5 * _place(panel[-1], panel)[0]
    axes.set(xscale="log", yscale="log", xlim=(panel[0].median_ns / 1.5, right), ylim=(low, high))
    axes.set(xlabel="time per collision in ns", ylabel="largest error of ε (relative to ε or to 1 − ε)")
    axes.xaxis.set_major_formatter("{x:g}")
    for row in panel:
        color, marker, _ = LOOKS[row.group]
        x, y = _place(row, panel)
        # A limit has a time alone: a dashed line.
        if row.error is None:
            axes.axvline(x, color=color, linewidth=1, dashes=(4, 2.5), zorder=1.5)
        face = color if row.is_proven or row.error is None else "white"
        axes.plot([x], [y], marker, color=color, markerfacecolor=face, markersize=6, markeredgewidth=1.3, zorder=4)
    # The frontier is a staircase: at the time of each of its points down from the error of the point before, then to
    # the right at the point's own error.
    best = [_place(row, panel) for row in frontier(panel)]
    corners = []
    if best:
        heights = [high, *(y for _, y in best)]
        corners = [(x, y) for (x, _), pair in zip(best, pairwise(heights), strict=True) for y in pair]
        corners.append((right, best[-1][1]))
        axes.plot(*zip(*corners, strict=True), color=GREY, linewidth=1.6, alpha=0.55, zorder=2)
    return corners


def _place(row: Row, panel: Sequence[Row]) -> tuple[float, float]:
    """Return the time and the error at which a point is drawn; points without an error stand below all others."""
    # A thirtieth of the smallest error, inside the axes, which end at a hundredth.
    below = min((other.error for other in panel if other.error), default=1e-16) / 30
    return min(row.median_ns, _SLOWEST * panel[0].median_ns), min(row.error or below, _CEILING)


def _write_labels(axes: Axes, panel: Sequence[Row], line: Sequence[tuple[float, float]]) -> None:
    """Write each label at the first place beside its mark where it covers no mark, no label and no line.

    `panel` has the rows, the fastest first, and `line` the corners of the frontier.
    """
    from matplotlib.transforms import Bbox

    # The transform gives pixels at 100 dots per inch; a mark of 6 points (8 pixels) with its edge fills a square of 12.
    centres = [axes.transData.transform(_place(row, panel)) for row in panel]
    taken = [Bbox.from_bounds(x - 6, y - 6, 12, 12) for x, y in centres]
    # Lines of the frontier and the dashed ones of limits, with two pixels on either side.
    taken += (Bbox([a, b]).padded(2) for a, b in pairwise(map(axes.transData.transform, line)))
    frame = axes.get_window_extent()
    limits = [x for row, (x, _) in zip(panel, centres, strict=True) if row.error is None]
    taken += [Bbox.from_extents(x - 2, frame.y0, x + 2, frame.y1) for x in limits]
    for row in panel:
        mark, color = _place(row, panel), LOOKS[row.group][0]
        text = _label(row, _SLOWEST * panel[0].median_ns)
        label = axes.annotate(text, mark, (0, 0), textcoords="offset points", color=color, fontsize=8, zorder=5)
        label.set_in_layout(False)
        for dx, dy, side in _OFFSETS:
            label.set(position=(dx, dy), ha=side, va="center")
            box = label.get_window_extent()
            # Labels may reach 8 pixels beyond the right end of the axes. If no place is free the last one is taken.
            if frame.x0 < box.x0 and box.x1 < frame.x1 + 8 and not any(map(box.overlaps, taken)):
                break
        label.set_bbox({"facecolor": "white", "edgecolor": "none", "pad": 0.4, "alpha": 0.8})
        taken.append(box)
        # A label more than 12 points away has a thin line to its mark.
        if abs(dy) > 12:
            leader = {"arrowstyle": "-", "color": color, "linewidth": 0.6, "shrinkA": 0, "shrinkB": 4}
            axes.annotate("", mark, (dx, dy), textcoords="offset points", arrowprops=leader)


def _label(row: Row, slowest: float) -> str:
    """Return a point's label, with its error and time if they are off the scale; `slowest` is the last time in ns."""
    beyond = ["proven for rounded v*"] if row.proven is not None and not row.is_proven else []
    # One digit of the error, as 1e7, and two of the time in microseconds.
    if row.error is not None and row.error > _CEILING:
        beyond.append(f"error {row.error:.0e} ↑".replace("e+0", "e").replace("e+", "e"))
    if row.median_ns > slowest:
        beyond.append(f"{float(f'{row.median_ns / 1000:.2g}'):g} µs →")
    return f"{row.label}\n({', '.join(beyond)})" if beyond else row.label
