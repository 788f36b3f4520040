"""Style and common parts of all pictures; Matplotlib is loaded only when something is drawn.

The same versions of Matplotlib and of this package give the same bytes, and no display is needed. Curves differ by
colour (Okabe and Ito's palette, for colour-blind readers) and by dashes, and have names.
"""

from __future__ import annotations

import io
from collections.abc import Callable, Mapping, Sequence
from contextlib import AbstractContextManager
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

from viscopade.arrays.checked import FloatArray
from viscopade.generated import marker_lines

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure as Sheet

FORMATS = ("svg", "pdf", "png")
PNG_DPI = 300  # dots an inch, as journals ask for
WIDTH = 3.4  # inches: one column of a journal

# Sizes are in points (1/72 inch) and chosen by eye for a picture of one column: letters of 6 to 8.5 points, as in a
# caption, and thin frames.
STYLE: Mapping[str, Any] = {
    "svg.hashsalt": "viscopade",  # ids in SVG files would be random otherwise
    "pdf.fonttype": 42,  # TrueType: editors can change the text, and journals accept it
    "figure.constrained_layout.use": True,
    "font.size": 7.5,
    "axes.labelsize": 8.5,
    "axes.linewidth": 0.6,
    "axes.titlesize": 8,
    "axes.titlepad": 3,
    "legend.fontsize": 6,
    "legend.frameon": False,
    "figure.titlesize": 8.5,
    "xtick.labelsize": 7,
    "ytick.labelsize": 7,
    "xtick.direction": "in",
    "ytick.direction": "in",
    "xtick.top": True,
    "ytick.right": True,
    "xtick.major.width": 0.6,
    "ytick.major.width": 0.6,
    "xtick.minor.width": 0.4,
    "ytick.minor.width": 0.4,
    "lines.scale_dashes": False,
    "lines.dash_capstyle": "butt",
}

BLACK, ORANGE, SKY, GREEN = "#000000", "#E69F00", "#56B4E9", "#009E73"
BLUE, VERMILION, PURPLE, GREY = "#0072B2", "#D55E00", "#CC79A7", "#BDBDBD"

# Lengths of dashes and gaps in turn, in points.
DOTTED, DASHED, DASH_DOT = (1.2, 1.2), (4.5, 1.8), (6, 1.6, 1.2, 1.6)
SHORT, DASH_DOT_DOT, LONG = (2.6, 1.3), (6, 1.4, 1.2, 1.4, 1.2, 1.4), (9, 2)


@dataclass(frozen=True)
class Look:
    """Style of a curve or a point, and the colour of its name; without dashes the line is solid.

    The width of the line is in points, and `dashes` has lengths of dashes and gaps in turn, in points. A legend shows
    a `band` of the colour behind the line; a band without a line (width 0) has edges.
    """

    color: str
    dashes: tuple[float, ...] = ()
    width: float = 1.3
    text: str = BLACK
    marker: str = ""
    band: bool = False


POINT = Look(BLACK, width=0, marker="o")
POINT_SIZE = 2.4  # points of diameter; by eye
BAND_OPACITY = 0.25  # of a band behind a curve: three that overlap leave each other visible; by eye


# An ASCII asterisk: Matplotlib sets it beside the foot of v. Its \ast stands below the line, with a gap.
V_STAR = "$v_*$"
EPSILON = r"$\varepsilon$"


def metadata(title: str, command: str, kind: str) -> dict[str, str | None]:
    """Return the metadata of a figure's file: title, command, licence and citation, and no date.

    `kind` is the format of the file, one of `FORMATS`. None takes out what Matplotlib would write: with a date no two
    runs would give the same bytes.
    """
    # Each format has its own name for a description.
    made_by = "\n".join(marker_lines(command))
    origin: dict[str, dict[str, str | None]] = {
        "svg": {"Description": made_by, "Date": None},
        "pdf": {"Subject": made_by, "CreationDate": None},
        "png": {"Description": made_by},
    }
    return {"Title": title, **origin[kind]}


def new_sheet(height: float, ratios: Sequence[float] = (1,)) -> tuple[Sheet, list[Axes]]:
    """Return a figure of one column's width, `height` inches high, with axes one below the other.

    `ratios` are those of the heights of the axes. Several axes have the letters (a), (b), … that captions name.
    The size of a user's page (`style_context`) replaces that of the figure.
    """
    from matplotlib import rcParams
    from matplotlib.figure import Figure as Sheet

    page_width, page_height = rcParams["figure.figsize"]
    sheet = Sheet(figsize=(page_width, page_height or height))
    panels = list(sheet.subplots(len(ratios), 1, squeeze=False, height_ratios=ratios)[:, 0])
    if len(panels) > 1:
        for letter, axes in zip("abcdef", panels, strict=False):  # no figure has more than six panels
            axes.set_title(f"({letter})", loc="left")
    return sheet, panels


def page_height() -> float:
    """Return the height of a user's page in inches; 0 for the drawing's own height. Within `style_context`."""
    from matplotlib import rcParams

    return float(rcParams["figure.figsize"][1])


def label_axes(
    axes: Axes, x_label: str, y_label: str, x: tuple[float, float], y: tuple[float, float], scales: str
) -> None:
    """Set labels, limits (low, high) and scales of `axes`; `scales` has "x" or "y" for each that is logarithmic."""
    # Limits come last: a change of the scale would change them.
    axes.set(xlabel=x_label, ylabel=y_label)
    if "x" in scales:
        axes.set_xscale("log")
    if "y" in scales:
        axes.set_yscale("log")
    axes.set(xlim=x, ylim=y)


def plain_ticks(axes: Axes) -> None:
    """Write numbers at a logarithmic horizontal axis of less than two decades, that of `axes`.

    Powers of ten are too few there, and Matplotlib's labels between them overlap. All numbers are chosen so that three
    or more labels stand at the axis and none overlap, which a test of the package checks for many ranges.
    """
    from matplotlib.ticker import LogLocator, MaxNLocator, NullFormatter, NullLocator

    # Two decades, a ratio of 100, have three powers of ten or two.
    low, high = axes.get_xlim()
    if high >= 100 * low:
        return
    # For a ratio of the ends above 10: 1, 2 and 5 of each decade; above 5 also 3; below, up to 5 equal steps.
    axis = axes.xaxis
    if high > 5 * low:
        axis.set_major_locator(LogLocator(subs=(1, 2, 5) if high > 10 * low else (1, 2, 3, 5)))
        axis.set_minor_formatter(NullFormatter())
    else:
        axis.set_major_locator(MaxNLocator(5, steps=[1, 2, 5, 10], min_n_ticks=3))
        axis.set_minor_locator(NullLocator())
    # 10 digits show every such number, and no digit of its rounding error.
    axis.set_major_formatter("{x:.10g}")


def draw_look(axes: Axes, look: Look, x: FloatArray, y: FloatArray, gid: str) -> None:
    """Draw the curve y(x); `gid` names it in an SVG file."""
    (line,) = axes.plot(x, y, color=look.color, linewidth=look.width, gid=gid)
    if look.dashes:
        line.set_dashes(look.dashes)


def key_of(where: Axes | Sheet, names: Sequence[tuple[str, Look]], place: Any, columns: int) -> None:
    """Draw a legend of `names`, texts with the looks of their curves, into a figure or axes (`where`).

    `place` is a place that Matplotlib knows, and `columns` the number of columns.
    """
    from matplotlib.legend_handler import HandlerTuple
    from matplotlib.lines import Line2D
    from matplotlib.patches import Patch

    # Lines of no length, which only lend their looks: 2.6 letters long, so that two periods of most dashes show.
    lines = [
        Line2D(
            *([], []),
            color=look.color,
            linewidth=look.width,
            linestyle=(0, look.dashes) if look.dashes else "-",
            marker=look.marker,
            markersize=POINT_SIZE,
        )
        for _, look in names
    ]
    # A tuple of a band and a line, drawn over each other (ndivide 1). Edges of bands are 0.6 points wide, as frames.
    handles: list[Any] = []
    for line, (_, look) in zip(lines, names, strict=True):
        edge = 0 if look.width else 0.6
        band = Patch(facecolor=(look.color, BAND_OPACITY), edgecolor=look.color, linewidth=edge)
        handles.append((band, line) if look.band else line)
    looks: Any = {"handlelength": 2.6, "columnspacing": 1}
    looks["handler_map"] = {tuple: HandlerTuple(ndivide=1)}
    sheet = where.get_figure(root=True)
    assert sheet is not None
    # One that is wider than the figure, as with large letters, is drawn again with a column less.
    while True:
        legend = where.legend(handles, [text for text, _ in names], loc=place, ncols=columns, **looks)
        if columns == 1 or legend.get_window_extent().width <= sheet.bbox.width:
            return
        legend.remove()
        columns -= 1


def letters(points: float) -> float:
    """Return the size of letters that have `points` where a picture has its usual 7.5; within `style_context`."""
    from matplotlib import rcParams

    return points * float(rcParams["font.size"]) / float(STYLE["font.size"])


@dataclass(frozen=True)
class Page:
    """A user's settings of a picture: a title above it, width and height in inches, and a font size in points.

    The font size is that of the axes' labels; the letters of titles, ticks and legends follow in proportion.
    """

    title: str | None = None
    size: tuple[float, float] | None = None
    font_size: float = STYLE["axes.labelsize"]


def style_context(page: Page | None = None) -> AbstractContextManager[None]:
    """Return a context with Matplotlib's settings for all pictures, with the size and the letters of a user's page."""
    from matplotlib import style

    # A page without a size has one column's width, and the height 0, for which `new_sheet` has the drawing's own.
    page = page or Page()
    scale = page.font_size / STYLE["axes.labelsize"]
    sizes = {name: scale * value for name, value in STYLE.items() if name.endswith("size")}
    return style.context(["default", {**STYLE, **sizes, "figure.figsize": page.size or (WIDTH, 0)}])


def file_content(sheet: Sheet, title: str, command: str, kind: str) -> bytes:
    """Return a drawn picture as a file's content; to be called within `style_context`."""
    buffer = io.BytesIO()
    sheet.savefig(buffer, format=kind, dpi=PNG_DPI, metadata=metadata(title, command, kind))
    return buffer.getvalue()


def picture(draw: Callable[[], Sheet], title: str, command: str, kind: str, page: Page | None = None) -> bytes:
    """Draw a picture, and return it as a file's content.

    Parameters
    ----------
    draw : callable
        Returns the drawn sheet.
    title, command : str
        For the file's metadata.
    kind : str
        One of `FORMATS`.
    page : Page or None

    Raises
    ------
    ModuleNotFoundError
        Without Matplotlib.
    """
    page = page or Page()
    with style_context(page):
        sheet = draw()
        if page.title:
            sheet.suptitle(page.title)
        return file_content(sheet, page.title or title, command, kind)
