"""The report's pictures: time against error, and error over v*.

They are drawn for paper (white) and, for the page, in the colours that its style sheet sets; wide for a screen, narrow
for a phone. The same versions of Matplotlib and of this package make the same bytes. Matplotlib is loaded only by
drawing, and its settings are left as they were.
"""

from __future__ import annotations

import io
import math
import re
import warnings
from collections.abc import Callable, Iterator, Mapping, Sequence
from contextlib import contextmanager
from dataclasses import dataclass
from html import escape
from itertools import pairwise
from textwrap import fill, wrap
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from viscopade.collision import spheres
from viscopade.generated import marker_line
from viscopade.plots.sheet import PNG_DPI
from viscopade_lab.bench.result import ErrorCurve
from viscopade_lab.bench.speed_range import SpeedRange
from viscopade_lab.report.choice import PicturePanel, Point, frontier
from viscopade_lab.report.labels import Box, Segment, place, shortened

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure as Sheet
    from matplotlib.text import Text

Floats = NDArray[np.float64]

# Each colour on paper, and the name that the page's style sheet gives it.
INK, MUTED, GRID, PAPER, BAND = "#1b1b1f", "#5c5f66", "#e3e3e6", "#ffffff", "#f1f1f4"
_GROUP_COLOR = {"ours": "#0068a8", "rival": "#bd4b00", "limit": "#00755a"}
_GROUP_MARKER = {"ours": "o", "rival": "D", "limit": "^"}
_CURVES = ("#0068a9", "#bd4b01", "#00755b", "#94417a", "#8a6500", "#5c5f67")
_DASHES = ((), (5, 1.6), (1.4, 1.4), (6, 1.6, 1.2, 1.6))
COLOR_NAMES: Mapping[str, str] = {
    INK: "ink",
    MUTED: "muted",
    GRID: "grid",
    PAPER: "paper",
    BAND: "band",
    **{color: group for group, color in _GROUP_COLOR.items()},
    **{color: f"curve-{i}" for i, color in enumerate(_CURVES, 1)},
}

GROUP_NAMES = {"ours": "this package", "rival": "other methods", "limit": "limits, such as a copy"}

_STYLE: Mapping[str, Any] = {
    "svg.hashsalt": "viscopade",  # ids in SVG files would be random otherwise
    "text.color": INK,
    "axes.edgecolor": MUTED,
    "axes.labelcolor": INK,
    "xtick.color": MUTED,
    "ytick.color": MUTED,
    "xtick.labelcolor": INK,
    "ytick.labelcolor": INK,
    "axes.linewidth": 0.7,
    "axes.spines.top": False,
    "axes.spines.right": False,
    "axes.facecolor": "none",
    "axes.axisbelow": True,
    "grid.color": GRID,
    "grid.linewidth": 0.7,
    "xtick.major.width": 0.7,
    "ytick.major.width": 0.7,
    "text.hinting": "none",
    "text.parse_math": False,
    "lines.scale_dashes": False,
    "lines.dash_capstyle": "butt",
}

_POINT = 72  # points in an inch; sheets have so many dots, so that a dot is a point
_TICK = 0.22  # room for the name of a tick, in inches
_MARK = 6.5  # a mark's size in points
_FLOOR = 1e-18  # where an error of 0 is drawn
_CEILING = 100.0  # where larger errors are drawn, with an arrow: they are useless, whatever their size
_SLOWEST = (
    1000.0  # times as slow as the fastest: slower ones are drawn there, with an arrow, to leave room for the rest
)
_STRIPS = 400  # of a curve with more points the largest error in each of so many strips is drawn


@dataclass(frozen=True)
class SheetLayout:
    """Lengths in inches, sizes of letters in points."""

    width: float
    stacked: bool
    font: float
    panel: float  # a panel's least height
    line: float  # height that each point needs
    room: float  # the factor from the slowest point to the right edge
    columns: int  # of the legend
    wrap: int  # longest line of a label, in characters
    beside: int  # longest line of a curve's name, in characters


WIDE = SheetLayout(width=10.4, stacked=False, font=8.6, panel=4.7, line=0.19, room=2.5, columns=6, wrap=20, beside=26)
NARROW = SheetLayout(width=3.7, stacked=True, font=7.8, panel=4.5, line=0.24, room=4.0, columns=2, wrap=21, beside=14)

_LEFT, _RIGHT, _BOTTOM, _GAP = 0.68, 0.24, 0.52, 0.25


@contextmanager
def drawn_panels(panels: Sequence[PicturePanel], layout: SheetLayout) -> Iterator[Sheet]:
    """Draw time against error, and keep Matplotlib's settings as they must be for saving within a `with` block."""
    with _style(layout):
        yield _panels(panels, layout)


@contextmanager
def drawn_curves(curves: Sequence[ErrorCurve], speeds: SpeedRange, layout: SheetLayout) -> Iterator[Sheet]:
    """Draw error over v*, likewise."""
    with _style(layout):
        yield _curves(curves, speeds, layout)


def content(sheet: Sheet, kind: str, title: str) -> bytes:
    """Return a drawn sheet as a file's content, on white."""
    buffer = io.BytesIO()
    metadata: dict[str, str | None] = {"Title": title, "Description": marker_line("viscopade report")}
    if kind == "svg":
        metadata["Date"] = None
    sheet.savefig(buffer, format=kind, dpi=PNG_DPI, facecolor=PAPER, metadata=metadata)
    return buffer.getvalue()


def inline(sheet: Sheet, size: str, name: str, alternative: str, titles: Mapping[str, str]) -> str:
    """Return a drawn sheet as an element of a page.

    Parameters
    ----------
    sheet : matplotlib.figure.Figure
        What was drawn.
    size : str
        Its class on the page, "wide" or "narrow".
    name : str
        Begins, with `size`, the ids of its parts, so that several pictures can stand on one page.
    alternative : str
        What it shows, for those who cannot see it.
    titles : mapping of str to str
        What is shown when the pointer rests on a part, for the part's gid.
    """
    name = f"{size}-{name}"
    buffer = io.StringIO()
    sheet.savefig(buffer, format="svg", facecolor="none", metadata={"Date": None})
    text = buffer.getvalue()
    view = re.search(r'viewBox="[^"]*"', text)
    assert view is not None
    body = text[text.index("<defs>", view.end()) :]  # after the metadata
    body = re.sub(r"<metadata>.*?</metadata>|<style.*?</style>", "", body, flags=re.DOTALL)
    body = re.sub(r'(id="|url\(#|xlink:href="#)', rf"\g<1>{name}-", body).replace("xlink:href", "href")
    for color, variable in COLOR_NAMES.items():
        body = body.replace(color, f"var(--{variable})")
    for gid, title in titles.items():
        opening = f'<g id="{name}-{gid}">'
        body = body.replace(opening, f"{opening}<title>{escape(title)}</title>")
    return f'<svg class="{size}" {view[0]} role="img" aria-label="{escape(alternative)}">\n{body}'


@contextmanager
def _style(layout: SheetLayout) -> Iterator[None]:
    from matplotlib import style

    sizes = dict.fromkeys(("font.size", "axes.labelsize", "xtick.labelsize", "ytick.labelsize"), layout.font)
    with style.context(["default", {**_STYLE, **sizes}]), warnings.catch_warnings():
        # Labels come from the result: a letter that the font lacks is drawn as a box.
        warnings.filterwarnings("ignore", message="Glyph .* missing")
        yield


# --- time against error -----------------------------------------------------------------------------------------------


def _panels(panels: Sequence[PicturePanel], layout: SheetLayout) -> Sheet:
    height = max(layout.panel, *(layout.line * len(panel.points) + 1 for panel in panels))
    sheet, axes = _sheet(len(panels), height, layout)
    errors = [_shown(point.error) for panel in panels for point in panel.points if point.error is not None]
    low, high = min(errors, default=1e-16), max(errors, default=1)
    for each, panel, number in zip(axes, panels, range(len(panels)), strict=True):
        _time_axis(each, panel, layout)
        _error_axis(each, low / 60, high * 12)
        each.set_title(panel.title, fontsize=layout.font + 0.6, fontweight="bold", loc="left", pad=7)
        if layout.stacked or number == 0:
            each.set_ylabel("largest error of ε  (relative to ε or to 1 − ε)")
        else:
            each.tick_params(axis="y", labelleft=False)
    sheet.draw_without_rendering()
    names = shortened(point.row.label for panel in panels for point in panel.points)
    for number, (each, panel) in enumerate(zip(axes, panels, strict=True)):
        _draw_panel(each, panel, names, number, layout)
    _legend(sheet, panels, layout)
    return sheet


def _sheet(count: int, height: float, layout: SheetLayout, top: float = 0.0) -> tuple[Sheet, list[Axes]]:
    """Return a sheet with panels side by side or stacked, each `height` inches high, below a legend."""
    from matplotlib.figure import Figure as Sheet

    lines = 1 if layout.columns > 2 else 3
    top = top or 0.38 + 0.17 * lines
    rows, columns = (count, 1) if layout.stacked else (1, count)
    width = (layout.width - _LEFT - _RIGHT - _GAP * (columns - 1)) / columns
    step = height + _BOTTOM + 0.32
    whole = top + rows * step - 0.32
    sheet = Sheet(figsize=(layout.width, whole), dpi=_POINT)
    axes = []
    for i in range(count):
        row, column = (i, 0) if layout.stacked else (0, i)
        left, bottom = _LEFT + column * (width + _GAP), whole - top - row * step - height
        axes.append(sheet.add_axes((left / layout.width, bottom / whole, width / layout.width, height / whole)))
    return sheet, axes


def _shown(error: float) -> float:
    """Return an error as it can be shown on a logarithmic axis."""
    return min(max(error, _FLOOR), _CEILING)


def _shown_time(panel: PicturePanel, point: Point) -> float:
    """Return the time at which a point is drawn."""
    return min(point.time, _SLOWEST * min(other.time for other in panel.points))


def _time_axis(axes: Axes, panel: PicturePanel, layout: SheetLayout) -> None:
    times = [_shown_time(panel, point) for point in panel.points]
    low, high = min(times) / 1.7, max(times) * layout.room
    high = max(high, low * 300)  # room for labels
    axes.set(xscale="log", xlim=(low, high), xlabel="time per collision")
    _decades(axes, (1, 2, 5), duration)
    axes.grid(axis="x")


def duration(ns: float) -> str:
    """Return a time in the unit that suits it: 0.5 ns, 20 ns, 1 µs."""
    for factor, unit in ((1e9, "s"), (1e6, "ms"), (1e3, "µs")):
        if ns >= factor * 0.999999:
            return f"{ns / factor:g} {unit}"
    return f"{ns:g} ns"


def _error_axis(axes: Axes, low: float, high: float) -> None:
    first, last = math.ceil(math.log10(low)), math.floor(math.log10(high))
    step = 1 if last - first < 9 else 2
    ticks = [n for n in range(first, last + 1) if n % step == 0]
    axes.set(yscale="log", ylim=(low, high))
    # Mathematics is parsed in these labels alone, which are ours.
    axes.set_yticks([10.0**n for n in ticks], [rf"$10^{{{n}}}$" for n in ticks], parse_math=True)
    axes.set_yticks([], minor=True)
    axes.grid(axis="y")


def _draw_panel(axes: Axes, panel: PicturePanel, names: Mapping[str, str], number: int, layout: SheetLayout) -> None:
    """Draw frontier, marks, and labels; a `gid` ends with the number of the panel and of the point."""
    low, high = axes.get_ylim()
    steps = _frontier_line(axes, panel, number)
    anchors, lines = [], steps
    for i, point in enumerate(panel.points):
        x = _shown_time(panel, point)
        if point.error is None:
            y = low * (high / low) ** 0.035
            axes.plot([x, x], [low, high], color=_color(point), linewidth=1, dashes=(4, 2.5), zorder=1.5)
            (x_bottom, x_top) = (_position(axes, x, value) for value in (low, high))
            lines.append((x_bottom, x_top))
        else:
            y = _shown(point.error)
        marker = _GROUP_MARKER[point.row.group]
        (mark,) = axes.plot([x], [y], marker, color=_color(point), markersize=_size(point))
        mark.set(markerfacecolor=_color(point) if _filled(point) else PAPER, markeredgewidth=1.3, zorder=4)
        mark.set_gid(f"point-{number}-{i}")
        anchors.append(_position(axes, x, y))
    _draw_labels(axes, panel, names, anchors, lines, number, layout)


def _label(names: Mapping[str, str], panel: PicturePanel, point: Point, layout: SheetLayout) -> str:
    """Return a point's label, with what is off the scale."""
    beyond = []
    if point.error is not None and point.error > _CEILING:
        beyond.append(f"error {point.error:.0e} ↑".replace("e+0", "e").replace("e+", "e"))
    if point.time > _shown_time(panel, point):
        beyond.append(f"{duration(float(f'{point.time:.2g}'))} →")
    remark = f" ({', '.join(beyond)})".replace(" ", "\N{NO-BREAK SPACE}") if beyond else ""
    return _wrapped(names[point.row.label] + remark.replace("\N{NO-BREAK SPACE}", " ", 1), layout.wrap)


def _wrapped(text: str, width: int) -> str:
    """Break a text into lines of at most `width` characters, all about as long, but no formula such as k_c = 20."""
    text = text.replace(" = ", "\N{NO-BREAK SPACE}=\N{NO-BREAK SPACE}").replace("+ ", "+\N{NO-BREAK SPACE}")
    lines = len(wrap(text, width))
    return fill(text, next(w for w in range(1, width + 1) if len(wrap(text, w)) <= lines))


def _color(point: Point) -> str:
    return _GROUP_COLOR[point.row.group]


def _size(point: Point) -> float:
    return _MARK - 1 if point.row.group == "rival" else _MARK


def _filled(point: Point) -> bool:
    return point.proven or point.error is None


def _position(axes: Axes, x: float, y: float) -> tuple[float, float]:
    """Return where a point lies on the sheet, in points."""
    found = axes.transData.transform((x, y))
    return float(found[0]), float(found[1])


def _frontier_line(axes: Axes, panel: PicturePanel, number: int) -> list[Segment]:
    """Draw the frontier as steps, and return its parts in points."""
    best = frontier(panel.points)
    if not best:
        return []
    (_, right), (_, top) = axes.get_xlim(), axes.get_ylim()
    x, y = [best[0].time], [top]  # the fastest is never off the scale
    for point in best:
        error = _shown(point.error or 0)
        x += [_shown_time(panel, point)] * 2
        y += [y[-1], error]
    x, y = [*x[1:], right], [*y[1:], y[-1]]
    axes.plot(x, y, color=MUTED, linewidth=1.6, alpha=0.55, zorder=2, gid=f"frontier-{number}", solid_joinstyle="miter")
    corners = [_position(axes, *corner) for corner in zip(x, y, strict=True)]
    return list(pairwise(corners))


def _draw_labels(
    axes: Axes,
    panel: PicturePanel,
    names: Mapping[str, str],
    anchors: Sequence[tuple[float, float]],
    lines: Sequence[Segment],
    number: int,
    layout: SheetLayout,
) -> None:
    sheet = axes.get_figure(root=True)
    assert sheet is not None
    texts: list[Text] = []
    for i, point in enumerate(panel.points):
        text = axes.text(0, 0, _label(names, panel, point, layout), color=_color(point), fontsize=layout.font - 0.6)
        text.set(transform=sheet.dpi_scale_trans, gid=f"label-{number}-{i}", zorder=5, linespacing=1.05)
        text.set(va="bottom", ha="left", bbox={"facecolor": PAPER, "edgecolor": "none", "pad": 0.6})
        texts.append(text)
    sizes = []
    for text in texts:
        extent = text.get_window_extent()
        sizes.append((float(extent.width) + 3, float(extent.height) + 2))
    area = axes.get_window_extent()
    frame = Box(float(area.x0) + 1, float(area.y0) + 1, float(area.x1) - 1, float(area.y1) + 4)
    boxes = place(anchors, sizes, frame, radius=_MARK / 2 + 0.7, lines=lines)
    for text, box, anchor, point in zip(texts, boxes, anchors, panel.points, strict=True):
        text.set_position(((box.left + 1.5) / _POINT, (box.bottom + 1) / _POINT))
        end = box.nearest(*anchor)
        length = math.dist(anchor, end)
        if length > _MARK / 2 + 3.5:
            start = tuple(a + (e - a) * (_MARK / 2 + 0.7) / length for a, e in zip(anchor, end, strict=True))
            x, y = ([part / _POINT for part in pair] for pair in zip(start, end, strict=True))
            leader = axes.plot(x, y, color=_color(point), linewidth=0.6, zorder=3, scalex=False, scaley=False)[0]
            leader.set_transform(sheet.dpi_scale_trans)
            leader.set_clip_on(False)


def _legend(sheet: Sheet, panels: Sequence[PicturePanel], layout: SheetLayout) -> None:
    from matplotlib.lines import Line2D

    points = [point for panel in panels for point in panel.points]
    groups = [group for group in _GROUP_MARKER if any(point.row.group == group for point in points)]

    def entry(label: str, color: str, marker: str, filled: bool = True) -> Line2D:
        face = color if filled else PAPER
        size = _MARK - (marker == "D")
        return Line2D(
            [], [], color=color, marker=marker, linestyle="", label=label, markerfacecolor=face, markersize=size
        )

    entries = [entry(GROUP_NAMES[group], _GROUP_COLOR[group], _GROUP_MARKER[group]) for group in groups]
    entries += [entry("error proven", MUTED, "o"), entry("error sampled", MUTED, "o", False)]
    entries.append(Line2D([], [], color=MUTED, linewidth=1.6, alpha=0.55, label="Pareto frontier"))
    left = _LEFT / layout.width if not layout.stacked else 0.02
    sheet.legend(
        handles=entries, loc="upper left", bbox_to_anchor=(left, 1), ncols=layout.columns, frameon=False,
        borderaxespad=0.3, borderpad=0.2, columnspacing=1.4, handletextpad=0.3, fontsize=layout.font - 0.4,
        handlelength=1.6,
    )  # fmt: skip


# --- error over v* ----------------------------------------------------------------------------------------------------


def _curves(curves: Sequence[ErrorCurve], speeds: SpeedRange, layout: SheetLayout) -> Sheet:
    sheet, (axes,) = _sheet(1, layout.panel - 0.6, layout, top=0.55)
    names = _names(axes, curves, layout)
    room = (max(float(name.get_window_extent().width) for name in names) + 14) / _POINT / layout.width
    place = axes.get_position()
    axes.set_position((place.x0, place.y0, place.width - room, place.height))
    _v_star_axis(axes, curves)
    errors = [error for curve in curves for error in curve.error if error > 0]
    _error_axis(axes, max(min(errors, default=1e-16), _FLOOR) / 3, max(errors, default=1) * 3)
    axes.set_ylabel("relative error of ε")
    _speed_axis(axes, speeds)
    sheet.draw_without_rendering()
    heights = []
    for i, curve in enumerate(curves):
        v_star, error = _thinned(curve)
        color = _CURVES[i % len(_CURVES)]
        (line,) = axes.plot(v_star, np.where(error > 0, error, np.nan), color=color, linewidth=1.2, gid=f"curve-{i}")
        if _DASHES[i // len(_CURVES) % len(_DASHES)]:
            line.set_dashes(_DASHES[i // len(_CURVES) % len(_DASHES)])
        heights.append(_position(axes, float(v_star[-1]), _end(error))[1])
    _beside(axes, names, heights)
    return sheet


def _thinned(curve: ErrorCurve) -> tuple[Floats, Floats]:
    """Return v* and error of a curve, sorted; of too many points the largest error in each strip."""
    order = np.argsort(curve.v_star, kind="stable")
    v_star, error = np.array(curve.v_star)[order], np.array(curve.error)[order]
    if len(v_star) <= _STRIPS:
        return v_star, error
    strips = np.array_split(np.arange(len(v_star)), _STRIPS)
    largest = np.array([strip[np.argmax(error[strip])] for strip in strips])
    return v_star[largest], error[largest]


def _v_star_axis(axes: Axes, curves: Sequence[ErrorCurve]) -> None:
    low, high = min(x for c in curves for x in c.v_star), max(x for c in curves for x in c.v_star)
    low, high = (low, high) if low < high else (low / 2, high * 2)
    axes.set(xscale="log", xlim=(low, high), xlabel="v*")
    _decades(axes, (1, 2, 5))
    axes.grid(axis="x")


def _decades(axes: Axes, factors: Sequence[int], name: Callable[[float], str] = "{:g}".format) -> None:
    """Name the factors of powers of ten on the horizontal axis, if there is room, and mark the other digits."""
    low, high = axes.get_xlim()
    if float(axes.get_window_extent().width) / math.log10(high / low) < 8 * _POINT * _TICK:
        factors = (1,)
    powers = range(math.floor(math.log10(low)), math.ceil(math.log10(high)) + 1)
    digits = {k: [float(f"{k}e{n}") for n in powers if low <= float(f"{k}e{n}") <= high] for k in range(1, 10)}
    ticks = sorted(tick for factor in factors for tick in digits.pop(factor))
    axes.set_xticks(ticks, [name(tick) for tick in ticks])
    axes.set_xticks(sorted(tick for found in digits.values() for tick in found), minor=True)
    axes.xaxis.set_minor_formatter("")


def _end(error: Floats) -> float:
    """Return a typical error at a curve's end: errors pass through 0 often."""
    last = error[-max(1, len(error) // 8) :]
    last = last[last > 0]
    return float(np.exp(np.mean(np.log(last)))) if last.size else _FLOOR


def _speed_axis(axes: Axes, speeds: SpeedRange) -> None:
    """Show the speeds above, and shade the v* that they make."""
    low, high = axes.get_xlim()
    axes.axvspan(speeds.v_star(speeds.speed_min), speeds.v_star(speeds.speed_max), color=BAND, zorder=0, linewidth=0)
    axes.set_xlim(low, high)
    above = axes.twiny()
    above.set(xscale="log", xlim=(low, high), facecolor="none")
    above.spines["top"].set_visible(True)
    first, last = (math.log10(spheres.speed_from_v_star(x, speeds.beta)) for x in (low, high))
    step = max(1, math.ceil((last - first) / 7))
    powers = [n for n in range(math.ceil(first), math.floor(last) + 1) if n % step == 0]
    above.set_xticks([speeds.v_star(10.0**n) for n in powers], [rf"$10^{{{n}}}$" for n in powers], parse_math=True)
    above.set_xticks([], minor=True)
    above.set_xlabel(f"speed in {speeds.unit}, for beta = {speeds.beta:g}")


def _names(axes: Axes, curves: Sequence[ErrorCurve], layout: SheetLayout) -> list[Text]:
    """Write the curves' names, for now anywhere."""
    sheet = axes.get_figure(root=True)
    assert sheet is not None
    texts = []
    for i, curve in enumerate(curves):
        name = _wrapped(curve.label, layout.beside)
        text = axes.text(0, 0, name, color=_CURVES[i % len(_CURVES)], fontsize=layout.font - 0.4, gid=f"name-{i}")
        text.set(transform=sheet.dpi_scale_trans, va="center", ha="left", linespacing=1.05)
        texts.append(text)
    return texts


def _beside(axes: Axes, names: Sequence[Text], heights: Sequence[float]) -> None:
    """Move names beside their curves' ends, apart where they would overlap."""
    sheet = axes.get_figure(root=True)
    assert sheet is not None
    area = axes.get_window_extent()
    sizes = [float(name.get_window_extent().height) + 3 for name in names]
    moved = spread(heights, sizes, float(area.y0), float(area.y1))
    x = float(area.x1)
    for name, wanted, found in zip(names, heights, moved, strict=True):
        name.set_position(((x + 12) / _POINT, found / _POINT))
        ends = ([(x + 1) / _POINT, (x + 10) / _POINT], [min(max(wanted, area.y0), area.y1) / _POINT, found / _POINT])
        (leader,) = axes.plot(*ends, color=str(name.get_color()), linewidth=0.7, scalex=False, scaley=False)
        leader.set(transform=sheet.dpi_scale_trans, clip_on=False)


def spread(wanted: Sequence[float], sizes: Sequence[float], low: float, high: float) -> list[float]:
    """Return positions near those wanted, in the same order, so that what has these sizes does not overlap.

    Positions stay between `low` and `high` if there is room.
    """
    order = sorted(range(len(wanted)), key=lambda i: (wanted[i], i))
    found = [0.0] * len(wanted)
    edge = low
    for i in order:
        found[i] = max(wanted[i], edge + sizes[i] / 2)
        edge = found[i] + sizes[i] / 2
    edge = max(high, low + sum(sizes))
    for i in reversed(order):
        found[i] = min(found[i], edge - sizes[i] / 2)
        edge = found[i] - sizes[i] / 2
    return found
