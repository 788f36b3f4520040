"""The paper's four figures, and further figures of series and approximants.

Every curve is computed when its figure is drawn; only the ranges of the axes and the places of labels are typed in.
Places are chosen by eye, so that a name stands beside its curve and covers no other. Heights of figures, in inches, and
the ratios of their parts' heights are chosen by eye, too; the width is one column, 3.4 inches.
A curve's `gid` is its name, in SVG the id of its group. Captions are in docs/figures/README.md.

Curves differ by colour (Okabe and Ito's, which colour-blind readers can tell apart), by dashes, and carry their names.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping
from dataclasses import dataclass
from functools import lru_cache
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from viscopade.arrays import double
from viscopade.collision import spheres
from viscopade.plots.sheet import (
    BLACK,
    BLUE,
    DASH_DOT,
    DASH_DOT_DOT,
    DASHED,
    DOTTED,
    EPSILON,
    GREEN,
    GREY,
    LONG,
    ORANGE,
    PURPLE,
    SHORT,
    SKY,
    V_STAR,
    VERMILION,
    Look,
    label_axes,
    letters,
    new_sheet,
)
from viscopade.theory.pade import Pade, Root, horner, pade
from viscopade.theory.paper import BETA_ICE_CGS, TABLE
from viscopade.theory.series import series
from viscopade_lab import singularity

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure as Sheet
    from matplotlib.lines import Line2D

Floats = NDArray[np.float64]

# Digits of the coefficients of series and approximants; more than the 16 that a double holds.
DIGITS = 18
SERIES_ORDER = 40  # the highest truncation order that the paper shows
MAX_M = 25  # the paper looked at [m/m+3] up to [25/28]

# The fit eps = 0.32 v^-0.234 (v in cm/s) by Bridges, Hatzes & Lin (1984), and the speeds it is drawn for,
# roughly those of the experiment (the original was not available). The measurements are not publicly available, and
# are not in our figures.
FIT_FACTOR, FIT_EXPONENT = 0.32, -0.234
FIT_SPEEDS = (0.015, 2.0)
FIT_LABEL = "fit of Bridges et al."

# Eq. 10, and the true limit (derivations/10_large_v_star.py).
PAPER_EXPONENT = -3.2
LIMIT_EXPONENT, LIMIT_FACTOR = -10 / 3, 1.5 ** (2 / 3)

SHOWN = ((0, 3), (1, 4), (2, 5), (3, 6), (15, 18))  # [m/n] in the paper's figure

# The exact curve is broad and pale, so that coinciding curves stay visible on top. Widths are in points: 3.4 is 2 to 3
# times that of a curve, 1.3 by default; dots need some more, straight lines of reference some less. Texts of pale
# colours are darker, to be read on white.
LOOKS: Mapping[str, Look] = {
    "exact": Look(GREY, width=3.4, text="#555555"),
    "[0/3]": Look(ORANGE, DASHED, text="#A87400"),
    "[1/4]": Look(GREEN, DASH_DOT, text=GREEN),
    "[2/5]": Look(VERMILION, SHORT, text=VERMILION),
    "[3/6]": Look(BLUE, DOTTED, 1.6, BLUE),
    "[15/18]": Look(PURPLE, DASH_DOT_DOT, text="#A04578"),
    "[25/28]": Look(SKY, width=1.0, text="#2277AA"),
    "k_c=5": Look(VERMILION, DOTTED, text=VERMILION),
    "k_c=10": Look(VERMILION, SHORT, text=VERMILION),
    "k_c=15": Look(VERMILION, DASHED, text=VERMILION),
    "k_c=20": Look(VERMILION, DASH_DOT_DOT, text=VERMILION),
    "k_c=40": Look(VERMILION, text=VERMILION),
    "k_c=80": Look(VERMILION, LONG, text=VERMILION),
    "fit": Look(BLACK, LONG, 1.0),
    "paper-power": Look(BLACK, DOTTED, 0.9),
    "limit-power": Look(BLACK, (), 0.5),
    "best": Look(VERMILION, text=VERMILION),
}


# Marker and size in points of what is marked: hardly larger than 4 points, so that neighbours in the plane stay apart.
MARKS = {"pole": ("x", 4.5), "zero": ("o", 4.0), "doublet": ("s", 5.5), "singularity": ("*", 7.0)}


@dataclass(frozen=True)
class Figure:
    """A figure that can be drawn.

    Attributes
    ----------
    description : str
        One line for the file's metadata.
    draw : callable
        Returns it, drawn, as a `matplotlib.figure.Figure`. To be called through `registry.drawn`, which sets the style.
    paper_label : str or None
        The label of the paper's figure that this one repeats.
    """

    description: str
    draw: Callable[[], Sheet]
    paper_label: str | None = None


def figure(description: str, paper_label: str | None = None) -> Callable[[Callable[[], Sheet]], Figure]:
    """Return a decorator that makes a figure of the function that draws it."""
    return lambda draw: Figure(description, draw, paper_label)


# --- what is drawn ----------------------------------------------------------------------------------------------------


def _pade_slope(degrees: tuple[int, int], v_star: Floats) -> Floats:
    """Return d ln [m/n]/d ln v*, to about 8 digits, by the central difference."""
    step = 1e-4  # of ln v*: its square, 1e-8, is the relative error, and rounding, 1e-16/1e-4, is less
    above, below = (_pade(degrees, v_star * math.exp(sign * step)) for sign in (1, -1))
    slope: Floats = np.log(above / below) / (2 * step)
    return slope


def _truncated(v_star: Floats, order: int) -> Floats:
    """Return the sum of h_k v*^k from h_0 = 1 to h_order v*^order."""
    return horner(series(SERIES_ORDER, DIGITS).floats()[: order + 1], v_star)


def _pade(degrees: tuple[int, int], v_star: Floats) -> Floats:
    """Return [m/n] at v*, for degrees (m, n)."""
    return pade(*degrees, DIGITS)(v_star)


def _label(degrees: tuple[int, int]) -> str:
    """Return "[m/n]" for degrees (m, n)."""
    return "[{}/{}]".format(*degrees)


def _ice(speed: Floats) -> Floats:
    """Return v* for ice, of a speed in cm/s."""
    return spheres.v_star(speed, float(BETA_ICE_CGS))


@lru_cache(maxsize=1)
def _singularity() -> complex:
    """Return the singularity in the upper half plane that ends the convergence of the series."""
    return complex(singularity.from_flow(DIGITS).v_star)


# Abscissas of curves: 500 to 600 intervals over the 3 inches of an axis are 0.4 points each, less than a line's width,
# so that curves look smooth. v* on linear axes goes on to 3, where eps is 0.03; on logarithmic axes from nearly elastic
# collisions to where power laws hold. Speeds of ice are in cm/s: from 0.01 mm/s to 1 m/s.
LINEAR = np.linspace(0, 3, 601)
LOGARITHMIC = np.geomspace(0.1, 100, 601)
SPEEDS = np.geomspace(1e-3, 1e2, 501)
# Relative distances of additional points on both sides of a pole or zero: from some spacings of LOGARITHMIC, 0.012,
# down to where errors of 1e-12 to 1e2 leave the frame; 5 points to a decade.
APPROACH = np.geomspace(1e-11, 0.03, 50)


def _with_approach(v_star: Floats, root: float) -> Floats:
    """Return v* with points close to `root` added."""
    return np.sort(np.concatenate([v_star, root * (1 - APPROACH), root * (1 + APPROACH)]))


def _positive_root(degrees: tuple[int, int], kind: str) -> float:
    """Return an approximant's first positive "pole" or "zero"."""
    p = pade(*degrees, DIGITS)
    return next(_complex(root).real for root in _roots(p, kind) if root.positive)


def _upper(root: Root) -> bool:
    """Return whether a root lies on the real axis or above: the lower half plane is its mirror image."""
    return root.real or bool(root.value.imag > 0)


def _roots(p: Pade, kind: str) -> tuple[Root, ...]:
    """Return the poles or the zeros of an approximant, for the kind "pole" or "zero"."""
    return {"pole": p.poles, "zero": p.zeros}[kind]


def _complex(root: Root) -> complex:
    """Return a root in double precision; the imaginary part of a real one is 0."""
    real, imaginary = (float(part) for part in root.decimals(DIGITS))
    return complex(real, imaginary)


# --- how it is drawn --------------------------------------------------------------------------------------------------


Beside = tuple[float, float, float]
"""The place of a curve's name: x of a point on the curve, and the offset to the right and upwards in points."""


def draw_curve(
    axes: Axes, name: str, x: Floats, y: Floats, beside: Beside | None = None, *, gid: str = "", text: str = ""
) -> Line2D:
    """Draw a curve in the look of its name, and return its line.

    `name` is a key of `LOOKS`. Its text, or `text`, stands beside a point of the curve if there is a place for it.
    `gid` is the name in the file, if it differs.
    """
    look = LOOKS[name]
    (line,) = axes.plot(x, y, color=look.color, linewidth=look.width, gid=identifier(gid or name))
    if look.dashes:
        line.set_dashes(look.dashes)
    if beside is not None:
        x_text, right, above = beside
        write_text(axes, text or name, (x_text, float(np.interp(x_text, x, y))), (right, above), look.text)
    return line


def identifier(name: str) -> str:
    """Return a name without characters that SVG does not accept: "pade-3-6" for [3/6], "series-40" for k_c=40."""
    return name.replace("[", "pade-").replace("/", "-").replace("]", "").replace("k_c=", "series-")


def write_text(
    axes: Axes, text: str, point: tuple[float, float], shift: tuple[float, float], color: str = BLACK, size: float = 7
) -> None:
    """Write beside a point, with a line to it if it is far; without a shift the text covers the point.

    `point` is in the coordinates of the axes' data, `shift` to the right and upwards in points, as `size` of the text,
    which grows with the letters of a user's page.
    """
    from matplotlib.patheffects import withStroke

    # The text's edge next to the point stays there: by the signs -1, 0 and 1 of the shift.
    horizontal, vertical = ("right", "center", "left"), ("top", "center", "bottom")
    # A thin line (0.4 points) from text to point, if they are more than a line of text, 9 points, apart. A white rim of
    # 1.8 points, or a white box, separates letters from curves behind them.
    leader = {"arrowstyle": "-", "linewidth": 0.4, "shrinkA": 0, "shrinkB": 0}
    axes.annotate(
        text,
        point,
        shift,
        textcoords="offset points",
        color=color,
        fontsize=letters(size),
        ha=horizontal[int(np.sign(shift[0])) + 1],
        va=vertical[int(np.sign(shift[1])) + 1],
        arrowprops=leader if math.hypot(*shift) > 9 else None,
        path_effects=[withStroke(linewidth=1.8, foreground="white")],
        bbox=None if any(shift) else {"facecolor": "white", "edgecolor": "none", "pad": 0.5},
    )


def write_along(axes: Axes, text: str, x: Floats, y: Floats, x_text: float, side: str, color: str) -> None:
    """Write "above" or "below" the curve y(x), turned into its direction at the abscissa x_text."""
    from matplotlib.transforms import ScaledTranslation

    # y left of the text's middle, there, and right: its slope over 0.02, a fiftieth of axes from 0 to 1.
    ends = np.interp([x_text - 0.01, x_text, x_text + 0.01], x, y)
    away = 1.5 if side == "above" else -1.5  # points between curve and text: 72 to an inch
    axes.text(
        *(x_text, ends[1], text),
        transform=axes.transData + ScaledTranslation(0, away / 72, axes.figure.dpi_scale_trans),
        rotation=math.degrees(math.atan((ends[2] - ends[0]) / 0.02)),
        rotation_mode="anchor",
        transform_rotates_text=True,
        ha="center",
        va="bottom" if side == "above" else "top",
        color=color,
        fontsize=letters(6),  # points; smaller than the axes' 7.5, because many names stand along curves
    )


def _until_out(y: Floats, low: float, high: float) -> Floats:
    """Return a curve without what follows its first point outside low … high, where a series diverges.

    The point itself stays, so that the curve leaves the frame; low and high are a little beyond it.
    """
    outside = np.flatnonzero((y < low) | (y > high))
    cut = y.copy()
    if outside.size:
        cut[outside[0] + 1 :] = np.nan
    return cut


def _positive(y: Floats) -> Floats:
    """Return a curve without the values that a logarithmic axis cannot show."""
    return np.where(y > 0, y, np.nan)


def _mark(
    axes: Axes, kind: str, x: Any, y: Any, color: str, gid: str, *, label: str = "", on_frame: bool = False
) -> Line2D:
    """Mark points at x, y (numbers or arrays), and return them.

    `kind` is a key of `MARKS`, and their name in a legend if there is no label. Marks that lie on the frame are drawn
    whole with `on_frame`.
    """
    marker, size = MARKS[kind]
    # Zeros are open, doublets are frames around a pole and a zero, the others are full.
    face = {"zero": "white", "doublet": "none"}.get(kind, color)
    (points,) = axes.plot(x, y, marker, color=color, markersize=size, markerfacecolor=face, label=label or kind)
    points.set(gid=identifier(gid), clip_on=not on_frame)
    return points


# --- the figures ------------------------------------------------------------------------------------------------------


MATERIALS: Mapping[str, tuple[float, float, Beside]] = {
    "steel": (0.97, 0.1, (1.0, 4, 4)),
    "rubber": (0.837, 4.4, (0.1, -4, -4)),
    "ice": (0.32, 0.01, (0.03, 4, 4)),
}
"""By name, eps at a speed in m/s (as in examples/), and where the name stands."""


@figure("eps over the impact speed for three materials: exact, [3/6], and the truncated series")
def _materials() -> Sheet:
    """Return the figure: eps from 0.1 mm/s to 10 m/s of three materials, by the exact function, S_20 and [3/6]."""
    sheet, (axes,) = new_sheet(2.6)
    ends = 1e-4, 10.0
    label_axes(axes, "impact speed (m/s)", EPSILON, ends, (0, 1.06), "x")  # 1.06: a margin above the broad curve at 1
    speeds = np.geomspace(*ends, 401)  # 80 to a decade: curves look smooth
    # The series is cut off at k_c = 20, as in the paper's text, and drawn to just beyond the frame: -0.1 … 1.1. Those
    # of steel and rubber, v* < 1, lie on the exact curves and are not drawn.
    for name, (epsilon, speed, place) in MATERIALS.items():
        v_star = float(double.v_star_from(epsilon)) * (speeds / speed) ** 0.1  # v* ~ v^(1/10)
        draw_curve(axes, "exact", speeds, double.epsilon(v_star), gid=f"exact-{name}")
        if v_star[-1] > 1:
            draw_curve(axes, "k_c=20", speeds, _until_out(_truncated(v_star, 20), -0.1, 1.1), gid=f"series-{name}")
        draw_curve(axes, "[3/6]", speeds, _pade((3, 6), v_star), place, gid=f"pade-{name}", text=name)
    axes.legend(axes.lines[-3:], ("exact", "series to order 20", "[3/6] of the paper"), loc="center right")
    return sheet


@figure("eps, its series cut off at several orders, and [1/4]", "Fig. 1")
def _truncated_series_diverge() -> Sheet:
    """Return the figure: eps, S_5 to S_40 and [1/4] over v* = 0 to 2, where all sums have diverged."""
    sheet, (axes,) = new_sheet(2.6)
    label_axes(axes, V_STAR, EPSILON, (0, 2), (0, 1.02), "")  # 1.02: a margin above the broad curve at 1
    v_star = LINEAR[LINEAR <= 2]
    draw_curve(axes, "exact", v_star, double.epsilon(v_star), (0.4, -5, -3))
    # The paper's k_c: order -> place of its name. On both sides of the bundle the number has "k_c =", inside no room.
    places = {5: (0.99, -5, 0), 10: (1.1, 5, 0), 15: (1.29, 5, 0), 20: (1.08, 5, 0), 40: (1.04, -5, 0)}
    for order, place in places.items():
        text = f"$k_c={order}$" if order in (5, 40) else str(order)
        # -0.1 and 1.2 are beyond the frame, 0 to 1.02.
        draw_curve(axes, f"k_c={order}", v_star, _until_out(_truncated(v_star, order), -0.1, 1.2), place, text=text)
    draw_curve(axes, "[1/4]", v_star, _pade((1, 4), v_star), (1.55, 3, 3))
    return sheet


@figure("eps and its approximants for large v*, with two power laws", "Fig. 2")
def _pade_at_large_v_star() -> Sheet:
    """Return the figure: eps, five [m/n] and two power laws, above as they are and below times v*^(10/3)."""
    sheet, (axes, scaled) = new_sheet(4.8, (1.5, 1))
    # eps falls from 1 to 2.8e-7 at v* = 100. Times v*^(10/3) it tends to 1.31, and [1/4] reaches 4.5 at v* = 100: on a
    # linear axis to 5 the curves are apart; [0/3] ~ v*^-2 leaves it upwards.
    label_axes(axes, V_STAR, EPSILON, (0.1, 100), (1e-7, 2), "xy")
    label_axes(scaled, V_STAR, EPSILON + " $v_*^{10/3}$", (0.1, 100), (0, 5), "x")
    zero = _positive_root((2, 5), "zero")
    v_star = _with_approach(LOGARITHMIC, zero)
    large = LOGARITHMIC[LOGARITHMIC >= 1]  # power laws below v* = 1 would exceed eps = 1
    curves = {"exact": draw_curve(axes, "exact", LOGARITHMIC, double.epsilon(LOGARITHMIC))}
    curves["limit-power"] = draw_curve(axes, "limit-power", large, LIMIT_FACTOR * large**LIMIT_EXPONENT)
    curves["paper-power"] = draw_curve(axes, "paper-power", large, large**PAPER_EXPONENT)
    places = {(0, 3): (20, 3, 3), (2, 5): (5.4, -5, 0)}
    for degrees in SHOWN:
        name, value = _label(degrees), _pade(degrees, v_star)
        curves[name] = draw_curve(axes, name, v_star, _positive(value), places.get(degrees))
    for name, line in curves.items():
        x, y = map(np.asarray, line.get_data())
        draw_curve(scaled, name, x, y * x**-LIMIT_EXPONENT, gid=f"{name}-scaled")
    # The zero of [2/5] is a mark on the lower frame.
    _mark(axes, "zero", zero, 1e-7, VERMILION, "zero-[2/5]", label="zero of [2/5]", on_frame=True)
    # The other curves lie too close together for labels: the legend has them in the order of their right ends.
    key = {"[1/4]": "[1/4]", "[3/6]": "[3/6]", "[15/18]": "[15/18]", "paper-power": "$v_*^{-3.2}$"}
    key |= {"limit-power": r"$(3/2)^{2/3}\,v_*^{-10/3}$", "exact": "exact"}
    lines, names = [*(curves[name] for name in key), axes.lines[-1]], [*key.values(), "zero of [2/5]"]
    axes.legend(lines, names, loc="lower left", handlelength=3.6)  # 3.6 letters: room for all dashes
    return sheet


@figure("the local exponent of eps, and where -3.2 comes from")
def _local_exponent() -> Sheet:
    """Return the figure: d ln eps/d ln v* over v*, and an inset of where -3, -3.2 and -10/3 differ visibly."""
    sheet, (axes,) = new_sheet(2.6)
    inset = axes.inset_axes((0.52, 0.37, 0.42, 0.6))  # left, bottom, width, height of the axes: the part without curves
    places: dict[tuple[int, int], Beside] = {(1, 4): (20, 0, 3), (3, 6): (8, 0, 7), (15, 18): (24, 4, -4)}
    for plane, suffix in ((axes, ""), (inset, "-inset")):
        exact_place = (30, 0, -4) if suffix else (0.5, -5, -2)
        draw_curve(plane, "exact", LOGARITHMIC, double.slope(LOGARITHMIC), exact_place, gid="exact" + suffix)
        for degrees, place in places.items():
            name, beside = _label(degrees), place if suffix else None
            draw_curve(plane, name, LOGARITHMIC, _pade_slope(degrees, LOGARITHMIC), beside, gid=name + suffix)
        for name, exponent in (("limit-power", LIMIT_EXPONENT), ("paper-power", PAPER_EXPONENT)):
            draw_curve(plane, name, np.array([0.1, 100]), np.full(2, exponent), gid=name + suffix)  # horizontal lines
    y_label = r"$\mathrm{d}\,\ln\varepsilon\,/\,\mathrm{d}\,\ln v_*$"
    # From above 0, the exponent at v* = 0, to below the limit -10/3; the inset from above -3 to below -10/3, v* from
    # where the exponent is in that range.
    label_axes(axes, V_STAR, y_label, (0.1, 100), (-3.6, 0.05), "x")
    label_axes(inset, "", "", (2, 100), (-3.43, -2.9), "x")
    inset.set_yticks([LIMIT_EXPONENT, PAPER_EXPONENT, -3], ["$-10/3$", "$-3.2$", "$-3$"])
    write_text(axes, "limit $-10/3$", (0.12, LIMIT_EXPONENT), (3, -2))
    write_text(axes, "the paper's $-3.2$", (0.12, PAPER_EXPONENT), (3, 2))
    inset.tick_params(labelsize=letters(6))  # points, one less than the axes' own
    return sheet


@figure("eps and the first four approximants on linear axes", "Fig. 3")
def _pade_on_linear_axes() -> Sheet:
    """Return the figure: eps and the table's [m/n] over v* = 0 to 3, and an inset of 2 to 3, where they separate."""
    sheet, (axes,) = new_sheet(2.6)
    # Left, bottom, width and height in parts of the axes: where there are no curves.
    inset = axes.inset_axes((0.49, 0.42, 0.45, 0.55))
    places = {(0, 3): (2.6, 3, 3), (1, 4): (2.4, 4, 3), (2, 5): (2.3, -3, -3), (3, 6): (2.75, -4, -13)}
    for plane, suffix in ((axes, ""), (inset, "-inset")):
        draw_curve(
            plane, "exact", LINEAR, double.epsilon(LINEAR), None if suffix else (0.4, -5, -3), gid="exact" + suffix
        )
        for degrees, place in places.items():
            name, beside = _label(degrees), place if suffix else None
            draw_curve(plane, name, LINEAR, _pade(degrees, LINEAR), beside, gid=name + suffix)
    label_axes(axes, V_STAR, EPSILON, (0, 3), (0, 1.02), "")  # 1.02: a margin above the broad curve at 1
    label_axes(inset, "", "", (2, 3), (0, 0.14), "")  # [1/4], 0.10 at v* = 2, fits; [0/3] enters from above
    inset.set(xticks=(2.25, 2.5, 2.75), yticks=(0, 0.05, 0.1))
    inset.tick_params(labelsize=letters(6))  # points, one less than the axes' own
    axes.indicate_inset_zoom(inset, edgecolor=BLACK, linewidth=0.5)
    return sheet


@figure("relative errors of eps and of 1 - eps of the approximants")
def _pade_errors() -> Sheet:
    """Return the figure: relative errors of eps and of 1 - eps over v*, of the table's four [m/n], [15/18], [25/28]."""
    sheet, planes = new_sheet(4.6, (1, 1))
    low, high = 1e-12, 1e2  # above round-off (eps has 15 digits, 1 - eps at v* = 0.1 loses two), and to 100 times eps
    zero, pole = _positive_root((2, 5), "zero"), _positive_root((25, 28), "pole")
    v_star = _with_approach(LOGARITHMIC, pole)
    epsilon, loss = double.epsilon(v_star), double.one_minus_epsilon(v_star)
    # Names stand on their curves at v* = 0.25 where these are far apart, those of high orders beside them.
    places = dict.fromkeys(TABLE, (0.25, 0, 0)) | {(15, 18): (1.3, -5, 0), (25, 28): (1.9, 5, 0)}
    for plane, size, suffix in ((planes[0], epsilon, "-epsilon"), (planes[1], loss, "-loss")):
        for degrees, place in places.items():
            error = np.abs(_pade(degrees, v_star) - epsilon) / size
            # Values below the frame are round-off, which differs between machines; a margin of a decade lets curves
            # reach the edge.
            error = np.where(error < low / 10, np.nan, error)
            draw_curve(plane, _label(degrees), v_star, error, place, gid=_label(degrees) + suffix)
            if degrees == (2, 5):
                at_zero = float(np.interp(zero, v_star, error))
                mark = _mark(plane, "zero", zero, at_zero, VERMILION, "zero-[2/5]" + suffix, label="zero of [2/5]")
        # The error is infinite at the pole: a mark on the upper frame, 100.
        pole_mark = _mark(
            plane, "pole", pole, 100, SKY, "pole-[25/28]" + suffix, label="pole of [25/28]", on_frame=True
        )
        plane.legend(handles=[mark, pole_mark], loc="lower right")
    label_axes(planes[0], V_STAR, "relative error of " + EPSILON, (0.1, 100), (low, high), "xy")
    label_axes(planes[1], V_STAR, r"relative error of $1-\varepsilon$", (0.1, 100), (low, high), "xy")
    return sheet


@figure("poles and zeros of [m/m+3], m = 0 to 25, in the complex plane and on the positive axis")
def _poles_and_zeros() -> Sheet:
    """Return the figure: above, poles and zeros in the v* plane, coloured by m; below, the positive ones over m.

    Marked are also Froissart doublets, pairs of a pole and a zero that nearly cancel, and the circle of convergence.
    """
    from matplotlib import colormaps
    from matplotlib.cm import ScalarMappable
    from matplotlib.colors import ListedColormap, Normalize
    from matplotlib.markers import MarkerStyle

    sheet, (plane, line) = new_sheet(4.7, (1.65, 1))
    approximants = [pade(m, m + 3, DIGITS) for m in range(MAX_M + 1)]
    # From pale to dark with m, monotonic in grey, too; the palest fifth of the colour map is hard to see on white.
    colors = ListedColormap(colormaps["cividis"](np.linspace(0.8, 0, MAX_M + 1)))
    for kind in ("zero", "pole"):
        roots = [(_complex(root), p.m) for p in approximants for root in _roots(p, kind) if _upper(root)]
        z, m = (np.array(column) for column in zip(*roots, strict=True))
        marker = MarkerStyle(MARKS[kind][0], fillstyle="none")
        # Area 8 square points: 2.8 points wide, small enough for some hundred roots.
        points = plane.scatter(z.real, z.imag, s=8, marker=marker, linewidth=0.7, color=colors(m), label=kind)
        points.set_gid(f"{kind}s")
        positive = (z.imag == 0) & (z.real > 0)
        _mark(line, kind, z.real[positive], m[positive], BLACK, f"{kind}s-positive")
    pairs = np.array([_complex(pair.pole) for p in approximants for pair in p.doublets() if _upper(pair.pole)])
    _mark(plane, "doublet", pairs.real, pairs.imag, PURPLE, "doublets")
    # Upper half of the circle of convergence, in steps of half a degree, and the singularity on it.
    end = _singularity()
    circle = abs(end) * np.exp(1j * np.linspace(0, np.pi, 361))
    label = "circle of\nconvergence"
    plane.plot(circle.real, circle.imag, color=BLACK, linewidth=0.7, dashes=DASHED, gid="circle", label=label)
    _mark(plane, "singularity", end.real, end.imag, VERMILION, "singularity")
    # The part of the plane that has 360 of the 404 roots with Im v* >= 0; -0.12 leaves room for marks on the real axis.
    label_axes(plane, "Re $v_*$", "Im $v_*$", (-2.5, 1.5), (-0.12, 2.4), "")
    plane.set_aspect("equal")
    # A colour for each whole m, from m - 0.5 to m + 0.5; every fifth has a number. The bar is 40 times as long as wide.
    scale = ScalarMappable(Normalize(-0.5, MAX_M + 0.5), colors)
    sheet.colorbar(scale, ax=plane, label="$m$", ticks=range(0, MAX_M + 1, 5), location="top", aspect=40)
    label_axes(line, V_STAR, "$m$", (0.1, 200), (-1, MAX_M + 1), "x")  # the positive roots lie between 0.28 and 97
    plane.legend(loc="upper right", handletextpad=0.2)
    line.legend(loc="upper left", handletextpad=0.2)
    return sheet


@figure("eps of ice over the impact speed: exact, [3/6], series, and the published fit", "Fig. 4")
def _ice_pade_and_measured_fit() -> Sheet:
    """Return the figure: eps of ice from 0.01 mm/s to 1 m/s, exact, [3/6], S_40, and the published fit."""
    sheet, (axes,) = new_sheet(2.6)
    label_axes(axes, "$v$ (cm/s)", EPSILON, (1e-3, 1e2), (0, 1), "x")  # the range of SPEEDS
    draw_curve(axes, "exact", SPEEDS, double.epsilon(_ice(SPEEDS)), (2e-2, -3, -4))
    diverging = _until_out(_truncated(_ice(SPEEDS), 40), -0.1, 1.1)  # the paper's k_c, to beyond the frame 0 … 1
    draw_curve(axes, "k_c=40", SPEEDS, diverging, (0.43, -5, 0), text="series, $k_c=40$")
    draw_curve(axes, "[3/6]", SPEEDS, _pade((3, 6), _ice(SPEEDS)), (6, 3, 3))
    measured = np.geomspace(*FIT_SPEEDS, 201)  # 100 points to a decade: the curve looks smooth
    draw_curve(axes, "fit", measured, FIT_FACTOR * measured**FIT_EXPONENT, (0.03, 5, 3), text=FIT_LABEL)
    return sheet


FIGURES: Mapping[str, Figure] = {
    "materials": _materials,
    "truncated-series-diverge": _truncated_series_diverge,
    "pade-at-large-v-star": _pade_at_large_v_star,
    "local-exponent": _local_exponent,
    "pade-on-linear-axes": _pade_on_linear_axes,
    "pade-errors": _pade_errors,
    "poles-and-zeros": _poles_and_zeros,
    "ice-pade-and-measured-fit": _ice_pade_and_measured_fit,
}
