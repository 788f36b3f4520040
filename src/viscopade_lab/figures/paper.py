"""The paper's four figures, and further figures of series and approximants.

Every curve is computed when its figure is drawn; only the ranges of the axes and the places of labels are typed in.
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
    new_sheet,
)
from viscopade.theory.pade import Pade, Root, horner, pade
from viscopade.theory.paper import BETA_ICE_CGS, TABLE
from viscopade.theory.series import series
from viscopade_lab import singularity

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.colors import ListedColormap
    from matplotlib.figure import Figure as Sheet
    from matplotlib.lines import Line2D

Floats = NDArray[np.float64]

# Digits of the coefficients of series and approximants; more than a double holds.
DIGITS = 18
SERIES_ORDER = 40
MAX_M = 25

# The fit eps = 0.32 v^-0.234 (v in cm/s) by Bridges, Hatzes & Lin (1984), and the speeds it is drawn for,
# roughly those of the experiment (the original was not available). The measurements are not publicly available, and
# are not in our figures.
FIT_FACTOR, FIT_EXPONENT = 0.32, -0.234
FIT_SPEEDS = (0.015, 2.0)
FIT_LABEL = "fit of Bridges et al."

# eq:asymp, and the true limit (derivations/10_large_v_star.py).
PAPER_EXPONENT = -3.2
LIMIT_EXPONENT, LIMIT_FACTOR = -10 / 3, 1.5 ** (2 / 3)

SHOWN = ((0, 3), (1, 4), (2, 5), (3, 6), (15, 18))

# The exact curve is broad and pale, so that coinciding curves stay visible on top.
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


# Marker and size in points of what is marked.
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
    """Return d ln [m/n]/d ln v*, to about 8 digits."""
    step = 1e-4
    above, below = (_pade(degrees, v_star * math.exp(sign * step)) for sign in (1, -1))
    slope: Floats = np.log(above / below) / (2 * step)
    return slope


def _truncated(v_star: Floats, order: int) -> Floats:
    """Return the series up to h_order v*^order."""
    return horner(series(SERIES_ORDER, DIGITS).floats()[: order + 1], v_star)


def _pade(degrees: tuple[int, int], v_star: Floats) -> Floats:
    return pade(*degrees, DIGITS)(v_star)


def _label(degrees: tuple[int, int]) -> str:
    return "[{}/{}]".format(*degrees)


def _ice(speed: Floats) -> Floats:
    """Return v* for ice, of a speed in cm/s."""
    return spheres.v_star(speed, float(BETA_ICE_CGS))


def _fit(speed: Floats) -> Floats:
    value: Floats = FIT_FACTOR * speed**FIT_EXPONENT
    return value


@lru_cache(maxsize=1)
def _singularity() -> complex:
    """Return the singularity in the upper half plane that ends the convergence of the series."""
    return complex(singularity.from_flow(DIGITS).v_star)


# Abscissas of curves, dense enough to look smooth.
LINEAR = np.linspace(0, 3, 601)
LOGARITHMIC = np.geomspace(0.1, 100, 601)
SPEEDS = np.geomspace(1e-3, 1e2, 501)
# Relative distances of additional points on both sides of a pole or zero.
APPROACH = np.geomspace(1e-11, 0.03, 50)


def _with_approach(v_star: Floats, root: float) -> Floats:
    """Return v* with points close to `root` added."""
    return np.sort(np.concatenate([v_star, root * (1 - APPROACH), root * (1 + APPROACH)]))


def _positive_root(degrees: tuple[int, int], kind: str) -> float:
    """Return an approximant's first positive "pole" or "zero"."""
    p = pade(*degrees, DIGITS)
    return next(_complex(root).real for root in _roots(p, kind) if root.positive)


def _upper(root: Root) -> bool:
    """Whether a root lies on the real axis or above."""
    return root.real or bool(root.value.imag > 0)


def _roots(p: Pade, kind: str) -> tuple[Root, ...]:
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
    """Draw a curve in the look of its name, and write its text beside the point nearest to an abscissa."""
    look = LOOKS[name]
    (line,) = axes.plot(x, y, color=look.color, linewidth=look.width, gid=identifier(gid or name))
    if look.dashes:
        line.set_dashes(look.dashes)
    if beside is not None:
        at, right, above = beside
        write_text(axes, text or name, (at, float(np.interp(at, x, y))), (right, above), look.text)
    return line


def identifier(name: str) -> str:
    """Return a name without characters that SVG does not accept: "pade-3-6" for [3/6], "series-40" for k_c=40."""
    return name.replace("[", "pade-").replace("/", "-").replace("]", "").replace("k_c=", "series-")


def write_text(
    axes: Axes, text: str, point: tuple[float, float], shift: tuple[float, float], color: str = BLACK, size: float = 7
) -> None:
    """Write beside a point, with a line to it if it is far; without a shift the text covers the point."""
    from matplotlib.patheffects import withStroke

    horizontal, vertical = ("right", "center", "left"), ("top", "center", "bottom")
    leader = {"arrowstyle": "-", "linewidth": 0.4, "shrinkA": 0, "shrinkB": 0}
    axes.annotate(
        text,
        point,
        shift,
        textcoords="offset points",
        color=color,
        fontsize=size,
        ha=horizontal[int(np.sign(shift[0])) + 1],
        va=vertical[int(np.sign(shift[1])) + 1],
        arrowprops=leader if math.hypot(*shift) > 9 else None,
        path_effects=[withStroke(linewidth=1.8, foreground="white")],
        bbox=None if any(shift) else {"facecolor": "white", "edgecolor": "none", "pad": 0.5},
    )


def write_along(axes: Axes, text: str, x: Floats, y: Floats, at: float, side: str, color: str) -> None:
    """Write "above" or "below" a curve, turned into its direction at an abscissa."""
    from matplotlib.transforms import ScaledTranslation

    ends, away = np.interp([at - 0.01, at, at + 0.01], x, y), 1.5 if side == "above" else -1.5
    axes.text(
        *(at, ends[1], text),
        transform=axes.transData + ScaledTranslation(0, away / 72, axes.figure.dpi_scale_trans),
        rotation=math.degrees(math.atan((ends[2] - ends[0]) / 0.02)),
        rotation_mode="anchor",
        transform_rotates_text=True,
        ha="center",
        va="bottom" if side == "above" else "top",
        color=color,
        fontsize=6,
    )


def _until_out(y: Floats, low: float, high: float) -> Floats:
    """Cut a curve after the first point outside low … high, where a series diverges."""
    outside = np.flatnonzero((y < low) | (y > high))
    cut = y.copy()
    if outside.size:
        cut[outside[0] + 1 :] = np.nan
    return cut


def _positive(y: Floats) -> Floats:
    """Remove values that a logarithmic axis cannot show."""
    return np.where(y > 0, y, np.nan)


def _mark(
    axes: Axes, kind: str, x: Any, y: Any, color: str, gid: str, *, label: str = "", on_frame: bool = False
) -> Line2D:
    """Mark points: `kind` is a key of `MARKS`, and their name in a legend if there is no label."""
    marker, size = MARKS[kind]
    face = {"zero": "white", "doublet": "none"}.get(kind, color)
    # A mark on the frame is drawn whole.
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
    sheet, (axes,) = new_sheet(2.6)
    ends = 1e-4, 10.0
    label_axes(axes, "impact speed (m/s)", EPSILON, ends, (0, 1.06), "x")
    speeds = np.geomspace(*ends, 401)
    for name, (epsilon, speed, place) in MATERIALS.items():
        v_star = float(double.v_star_from(epsilon)) * (speeds / speed) ** 0.1
        draw_curve(axes, "exact", speeds, double.epsilon(v_star), gid=f"exact-{name}")
        draw_curve(axes, "k_c=20", speeds, _until_out(_truncated(v_star, 20), -0.1, 1.1), gid=f"series-{name}")
        draw_curve(axes, "[3/6]", speeds, _pade((3, 6), v_star), place, gid=f"pade-{name}", text=name)
    axes.legend(
        axes.lines[:3], ("exact", "series to order 20", "[3/6] of the paper"), loc="center right", frameon=False
    )
    return sheet


@figure("eps, its series cut off at several orders, and [1/4]", "fig:seriesDiverging")
def _truncated_series_diverge() -> Sheet:
    sheet, (axes,) = new_sheet(2.6)
    label_axes(axes, V_STAR, EPSILON, (0, 2), (0, 1.02), "")
    v_star = LINEAR[LINEAR <= 2]
    draw_curve(axes, "exact", v_star, double.epsilon(v_star), (0.4, -5, -3))
    places = {5: (0.99, -5, 0), 10: (1.1, 5, 0), 15: (1.29, 5, 0), 20: (1.08, 5, 0), 40: (1.04, -5, 0)}
    for order, place in places.items():
        text = f"$k_c={order}$" if order in (5, 40) else str(order)
        draw_curve(axes, f"k_c={order}", v_star, _until_out(_truncated(v_star, order), -0.1, 1.2), place, text=text)
    draw_curve(axes, "[1/4]", v_star, _pade((1, 4), v_star), (1.55, 3, 3))
    return sheet


@figure("eps and its approximants for large v*, with two power laws", "fig:tryingDifferentPade")
def _pade_at_large_v_star() -> Sheet:
    sheet, (axes, scaled) = new_sheet(4.8, (1.5, 1))
    label_axes(axes, V_STAR, EPSILON, (0.1, 100), (1e-7, 2), "xy")
    label_axes(scaled, V_STAR, EPSILON + r" $v_\ast^{10/3}$", (0.1, 100), (1e-3, 30), "xy")
    zero = _positive_root((2, 5), "zero")
    v_star = _with_approach(LOGARITHMIC, zero)
    large = LOGARITHMIC[LOGARITHMIC >= 1]
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
    _mark(axes, "zero", zero, 1e-7, VERMILION, "zero-[2/5]", label="zero of [2/5]", on_frame=True)
    # The other curves lie too close together for labels: the legend has them in the order of their right ends.
    key = {"[1/4]": "[1/4]", "[3/6]": "[3/6]", "[15/18]": "[15/18]", "paper-power": r"$v_\ast^{-3.2}$"}
    key |= {"limit-power": r"$(3/2)^{2/3}\,v_\ast^{-10/3}$", "exact": "exact"}
    lines, names = [*(curves[name] for name in key), axes.lines[-1]], [*key.values(), "zero of [2/5]"]
    axes.legend(lines, names, loc="lower left", handlelength=3.6, frameon=False)
    return sheet


@figure("the local exponent of eps, and where -3.2 comes from")
def _local_exponent() -> Sheet:
    sheet, (axes,) = new_sheet(2.6)
    inset = axes.inset_axes((0.52, 0.37, 0.42, 0.6))
    places: dict[tuple[int, int], Beside] = {(1, 4): (20, 0, 3), (3, 6): (8, 0, 7), (15, 18): (24, 4, -4)}
    for plane, suffix in ((axes, ""), (inset, "-inset")):
        exact_place = (30, 0, -4) if suffix else (0.5, -5, -2)
        draw_curve(plane, "exact", LOGARITHMIC, double.slope(LOGARITHMIC), exact_place, gid="exact" + suffix)
        for degrees, place in places.items():
            name, beside = _label(degrees), place if suffix else None
            draw_curve(plane, name, LOGARITHMIC, _pade_slope(degrees, LOGARITHMIC), beside, gid=name + suffix)
        for name, exponent in (("limit-power", LIMIT_EXPONENT), ("paper-power", PAPER_EXPONENT)):
            draw_curve(plane, name, np.array([0.1, 100]), np.full(2, exponent), gid=name + suffix)
    y_label = r"$\mathrm{d}\,\ln\varepsilon\,/\,\mathrm{d}\,\ln v_\ast$"
    label_axes(axes, V_STAR, y_label, (0.1, 100), (-3.6, 0.05), "x")
    label_axes(inset, "", "", (2, 100), (-3.43, -2.9), "x")
    inset.set_yticks([LIMIT_EXPONENT, PAPER_EXPONENT, -3], ["$-10/3$", "$-3.2$", "$-3$"])
    write_text(axes, "limit $-10/3$", (0.12, LIMIT_EXPONENT), (3, -2))
    write_text(axes, "the paper's $-3.2$", (0.12, PAPER_EXPONENT), (3, 2))
    inset.tick_params(labelsize=6)
    return sheet


@figure("eps and the first four approximants on linear axes", "fig:tryingDifferentPadeLin")
def _pade_on_linear_axes() -> Sheet:
    sheet, (axes,) = new_sheet(2.6)
    inset = axes.inset_axes((0.49, 0.42, 0.45, 0.55))
    places = {(0, 3): (2.6, 3, 3), (1, 4): (2.4, 4, 3), (2, 5): (2.3, -3, -3), (3, 6): (2.75, -4, -13)}
    for plane, suffix in ((axes, ""), (inset, "-inset")):
        draw_curve(
            plane, "exact", LINEAR, double.epsilon(LINEAR), None if suffix else (0.4, -5, -3), gid="exact" + suffix
        )
        for degrees, place in places.items():
            name, beside = _label(degrees), place if suffix else None
            draw_curve(plane, name, LINEAR, _pade(degrees, LINEAR), beside, gid=name + suffix)
    label_axes(axes, V_STAR, EPSILON, (0, 3), (0, 1.02), "")
    label_axes(inset, "", "", (2, 3), (0, 0.14), "")
    inset.set(xticks=(2.25, 2.5, 2.75), yticks=(0, 0.05, 0.1))
    inset.tick_params(labelsize=6)
    axes.indicate_inset_zoom(inset, edgecolor=BLACK, linewidth=0.5)
    return sheet


@figure("relative errors of eps and of 1 - eps of the approximants")
def _pade_errors() -> Sheet:
    sheet, planes = new_sheet(4.6, (1, 1))
    low, high = 1e-12, 1e2
    zero, pole = _positive_root((2, 5), "zero"), _positive_root((25, 28), "pole")
    v_star = _with_approach(LOGARITHMIC, pole)
    epsilon, loss = double.epsilon(v_star), double.one_minus_epsilon(v_star)
    places = dict.fromkeys(TABLE, (0.25, 0, 0)) | {(15, 18): (1.3, -5, 0), (25, 28): (1.9, 5, 0)}
    for plane, size, suffix in ((planes[0], epsilon, "-epsilon"), (planes[1], loss, "-loss")):
        for degrees, place in places.items():
            error = np.abs(_pade(degrees, v_star) - epsilon) / size
            # Values below the frame are round-off, which differs between machines; a margin lets curves reach the edge.
            error = np.where(error < low / 10, np.nan, error)
            draw_curve(plane, _label(degrees), v_star, error, place, gid=_label(degrees) + suffix)
            if degrees == (2, 5):
                at_zero = float(np.interp(zero, v_star, error))
                mark = _mark(plane, "zero", zero, at_zero, VERMILION, "zero-[2/5]" + suffix, label="zero of [2/5]")
        other = _mark(plane, "pole", pole, 100, SKY, "pole-[25/28]" + suffix, label="pole of [25/28]", on_frame=True)
        plane.legend(handles=[mark, other], loc="lower right", frameon=False)
    label_axes(planes[0], V_STAR, "relative error of " + EPSILON, (0.1, 100), (low, high), "xy")
    label_axes(planes[1], V_STAR, r"relative error of $1-\varepsilon$", (0.1, 100), (low, high), "xy")
    return sheet


def _shades(count: int) -> ListedColormap:
    """Return colours from pale to dark, monotonic in grey, too."""
    from matplotlib import colormaps
    from matplotlib.colors import ListedColormap

    return ListedColormap(colormaps["cividis"](np.linspace(0.8, 0, count)))


def _convergence(axes: Axes) -> None:
    """Draw the upper half of the circle of convergence, and the singularity on it."""
    end = _singularity()
    circle = abs(end) * np.exp(1j * np.linspace(0, np.pi, 361))
    label = "circle of\nconvergence"
    axes.plot(circle.real, circle.imag, color=BLACK, linewidth=0.7, dashes=DASHED, gid="circle", label=label)
    _mark(axes, "singularity", end.real, end.imag, VERMILION, "singularity")


@figure("poles and zeros of [m/m+3], m = 0 to 25, in the complex plane and on the positive axis")
def _poles_and_zeros() -> Sheet:
    from matplotlib.cm import ScalarMappable
    from matplotlib.colors import Normalize
    from matplotlib.markers import MarkerStyle

    sheet, (plane, line) = new_sheet(4.7, (1.65, 1))
    approximants = [pade(m, m + 3, DIGITS) for m in range(MAX_M + 1)]
    colors = _shades(MAX_M + 1)
    for kind in ("zero", "pole"):
        roots = [(_complex(root), p.m) for p in approximants for root in _roots(p, kind) if _upper(root)]
        z, m = (np.array(column) for column in zip(*roots, strict=True))
        marker = MarkerStyle(MARKS[kind][0], fillstyle="none")
        points = plane.scatter(z.real, z.imag, s=8, marker=marker, linewidth=0.7, color=colors(m), label=kind)
        points.set_gid(f"{kind}s")
        positive = (z.imag == 0) & (z.real > 0)
        _mark(line, kind, z.real[positive], m[positive], BLACK, f"{kind}s-positive")
    pairs = np.array([_complex(pair.pole) for p in approximants for pair in p.doublets() if _upper(pair.pole)])
    _mark(plane, "doublet", pairs.real, pairs.imag, PURPLE, "doublets")
    _convergence(plane)
    label_axes(plane, r"Re $v_\ast$", r"Im $v_\ast$", (-2.5, 1.5), (-0.12, 2.4), "")
    plane.set_aspect("equal")
    scale = ScalarMappable(Normalize(-0.5, MAX_M + 0.5), colors)
    sheet.colorbar(scale, ax=plane, label="$m$", ticks=range(0, MAX_M + 1, 5), location="top", aspect=40)
    label_axes(line, V_STAR, "$m$", (0.1, 200), (-1, MAX_M + 1), "x")
    plane.legend(loc="upper right", frameon=False, handletextpad=0.2)
    line.legend(loc="upper left", frameon=False, handletextpad=0.2)
    return sheet


@figure("eps of ice over the impact speed: exact, [3/6], series, and the published fit", "fig:expVsAnaVsNum")
def _ice_pade_and_measured_fit() -> Sheet:
    sheet, (axes,) = new_sheet(2.6)
    label_axes(axes, "$v$ (cm/s)", EPSILON, (1e-3, 1e2), (0, 1), "x")
    draw_curve(axes, "exact", SPEEDS, double.epsilon(_ice(SPEEDS)), (2e-2, -3, -4))
    diverging = _until_out(_truncated(_ice(SPEEDS), 40), -0.1, 1.1)
    draw_curve(axes, "k_c=40", SPEEDS, diverging, (0.43, -5, 0), text="series, $k_c=40$")
    draw_curve(axes, "[3/6]", SPEEDS, _pade((3, 6), _ice(SPEEDS)), (6, 3, 3))
    measured = np.geomspace(*FIT_SPEEDS, 201)
    draw_curve(axes, "fit", measured, _fit(measured), (0.03, 5, 3), text=FIT_LABEL)
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
