"""Draws a case's charts as one figure, from its finding alone.

Curves differ by colour, dashes and marks. A bound has the colour of the curve before it; further ones are black. The
same versions of Matplotlib and of this package make the same bytes; no display is needed.
"""

from __future__ import annotations

import io
import re
from typing import TYPE_CHECKING, Any

import numpy as np

from viscopade.generated import marker_line
from viscopade.plots.sheet import (
    BLACK,
    BLUE,
    DASH_DOT,
    DASHED,
    DOTTED,
    GREEN,
    LONG,
    PURPLE,
    SHORT,
    STYLE,
    VERMILION,
    metadata,
)
from viscopade.plots.sheet import SKY as LIGHT
from viscopade_lab.hard_cases.finding import Chart, ChartCurve, Finding

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure as Sheet

OCHRE = "#A87400"
COLORS = (BLUE, VERMILION, GREEN, PURPLE, OCHRE, LIGHT, "#555555", BLACK)
DASHES = ((), DASHED, DASH_DOT, SHORT, LONG, DOTTED)
MARKS = "os^Dvx+*"
PANEL = (3.4, 3.3)  # inches
PNG_DPI, PNG_COLORS = 100, 16
ACROSS = 3  # panels in a row
KEY_COLUMNS = 2
BOUND_DASHES = ((1.5, 1.5), (6, 1.5), (4, 1.2, 1.2, 1.2))  # of the first, second … bound in a row


def svg(finding: Finding) -> bytes:
    """Return the figure of a case as SVG, for the page.

    Raises
    ------
    ModuleNotFoundError
        Without Matplotlib.
    """
    made_by = marker_line(f"viscopade hardcases --only {finding.name}")
    return _saved(finding, format="svg", metadata=metadata(finding.title, made_by, "svg"))


def png(finding: Finding) -> bytes:
    """Return the figure of a case as PNG, for a notebook: in few colours, so that it is small.

    Raises
    ------
    ModuleNotFoundError
        Without Matplotlib.
    """
    from PIL import Image

    buffer = io.BytesIO()
    with Image.open(io.BytesIO(_saved(finding, format="png", dpi=PNG_DPI))) as image:
        image.convert("RGB").quantize(PNG_COLORS).save(buffer, "png", optimize=True)
    return buffer.getvalue()


def _saved(finding: Finding, **options: Any) -> bytes:
    from matplotlib import style

    buffer = io.BytesIO()
    with style.context(["default", dict(STYLE)]):
        drawn(finding).savefig(buffer, **options)
    return buffer.getvalue()


def drawn(finding: Finding) -> Sheet:
    """Return the figure of a case: its panels side by side, four in a square, each with its key below."""
    from matplotlib.figure import Figure as Sheet

    charts = finding.result.charts
    columns = len(charts) if len(charts) <= ACROSS else 2
    rows = -(-len(charts) // columns)
    sheet = Sheet(figsize=(PANEL[0] * columns, PANEL[1] * rows))
    panels = sheet.subplots(rows, columns, squeeze=False).ravel()
    for axes, chart in zip(panels, charts, strict=False):
        _draw(axes, chart)
    for axes in panels[len(charts) :]:
        axes.remove()
    return sheet


def _draw(axes: Axes, chart: Chart) -> None:
    axes.set(title=_symbols(chart.title), xlabel=_symbols(chart.x_label), ylabel=_symbols(chart.y_label))
    axes.set_xscale(chart.x_scale)
    axes.set_yscale(chart.y_scale)
    place, bounds = -1, 0
    for curve in chart.curves:
        bounds = bounds + 1 if curve.look == "bound" else 0
        place += not bounds or place < 0
        _draw_curve(axes, chart, curve, place, bounds)
    axes.legend(
        loc="upper center",
        bbox_to_anchor=(0.5, -0.17),
        ncols=min(KEY_COLUMNS, len(chart.curves)),
        fontsize=6.5,
        frameon=False,
        handlelength=3,
    )


def _draw_curve(axes: Axes, chart: Chart, curve: ChartCurve, place: int, bounds: int) -> None:
    """Draw a curve in the look of its place; it is the nth bound in a row, or 0."""
    x, y = _shown(chart, curve)
    color, label = COLORS[place % len(COLORS)], _symbols(curve.name)
    if curve.look == "points":
        mark = MARKS[place % len(MARKS)]
        axes.plot(x, y, mark, color=color, markersize=3, markerfacecolor="none", markeredgewidth=0.7, label=label)
        return
    (line,) = axes.plot(x, y, color=color if bounds < 2 else BLACK, linewidth=0.8 if bounds else 1.2, label=label)
    dashes = BOUND_DASHES[(bounds - 1) % len(BOUND_DASHES)] if bounds else DASHES[place % len(DASHES)]
    if dashes:
        line.set_dashes(dashes)


def _symbols(text: str) -> str:
    """Return a text with v* and eps as mathematics, unless it has some already."""
    return text if "$" in text else re.sub(r"\beps\b", r"$\\varepsilon$", text.replace("v*", "$v_*$"))


def _shown(chart: Chart, curve: ChartCurve) -> tuple[list[float], list[float]]:
    """Return what the axes can show; a curve that leaves a logarithmic axis has a gap there."""
    x, y = np.array(curve.x), np.array(curve.y)
    if chart.x_scale == "log":
        x = np.where(x > 0, x, np.nan)
    if chart.y_scale == "log":
        y = np.where(y > 0, y, np.nan)
    return list(x), list(y)
