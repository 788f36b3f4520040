"""Picture of measured points with the fitted law, its confidence band, other laws, and the residuals below."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import numpy as np

from viscopade.fitting.damping import DampingFit
from viscopade.plots.sheet import (
    BAND_OPACITY,
    BLACK,
    BLUE,
    DASH_DOT,
    DASHED,
    DOTTED,
    EPSILON,
    GREEN,
    GREY,
    ORANGE,
    POINT,
    POINT_SIZE,
    PURPLE,
    VERMILION,
    Look,
    draw_look,
    key_of,
    label_axes,
    letters,
    new_sheet,
    page_height,
    plain_ticks,
)
from viscopade.quantity import uncertain

if TYPE_CHECKING:
    from matplotlib.figure import Figure as Sheet

MOST_MARKED = 2000  # points that are drawn, with their error bars; a choice by eye, as are all sizes in this file
_LEVEL = 0.95  # of the confidence band
_MARGIN = 0.15  # of the picture's width and height, around the points
_CURVE = 200  # points of a curve
# Inches: lower pages, with the usual letters, have no room for residuals.
_LEAST_HEIGHT = 3.2
_EDGE = 4.5  # of the axis of residuals
_MOST_NUMBERS = 5  # beside residuals beyond it
_BARS = "#7F7F7F"  # lighter than the points, which many bars would hide
_LOOKS = (
    Look(ORANGE, DASHED),
    Look(GREEN, DASH_DOT),
    Look(PURPLE, DOTTED),
    Look(VERMILION, DASHED),
    Look(BLACK, DOTTED),
)


def draw_fit(damping_fit: DampingFit, with_result: bool = True) -> Sheet:
    """Return a picture, Matplotlib's figure, of a fit: above eps over speed with the laws, below the residuals.

    A low page has no residuals.

    Parameters
    ----------
    damping_fit : DampingFit
        The points (speed in m/s, eps and its errors), the fitted laws, the viscoelastic one (`main`) first, and the
        verdict.
    with_result : bool
        Whether beta and the verdict stand above the picture.
    """
    points = damping_fit.points
    # 4.6 inches high, with room for a legend of several lines; eps has two thirds of the height.
    is_low = 0 < page_height() < letters(_LEAST_HEIGHT)
    sheet, (top, *below_top) = new_sheet(4.6, (1,) if is_low else (2, 1))
    bottom = below_top[-1] if below_top else None
    low, high = points.speed.min(), points.speed.max()
    # The points, with a margin on both sides: equal on the logarithmic axis of speeds, of eps twice as large.
    wider = (high / low) ** _MARGIN
    ends = (low / wider, high * wider)
    speed = np.geomspace(*ends, _CURVE)
    # Standard error of a point, with the scatter of the fit: sigma^2 = sum of squares of its errors + scatter^2.
    errors = np.sqrt(points.epsilon_errors.multiply(points.epsilon_errors).sum(axis=1) + damping_fit.main.scatter**2)
    # 1e-6: points that all have one eps, without errors, still need an axis with two ends.
    reach = max(float(np.ptp(points.epsilon)), float(errors.max()), 1e-6) * (_MARGIN * 2)
    label_axes(
        top,
        "",
        EPSILON,
        ends,
        (points.epsilon.min() - errors.max() - reach, points.epsilon.max() + errors.max() + reach),
        "x",
    )
    plain_ticks(top)
    speed_label = "impact speed in m/s"
    if bottom is None:
        top.set_xlabel(speed_label)
    else:
        # Residuals of a law that holds lie within 3 standard errors but for one in 370; 4.5 leaves a margin.
        label_axes(bottom, speed_label, "residual /\nstandard error", ends, (-_EDGE, _EDGE), "x")
        top.tick_params(labelbottom=False)
        plain_ticks(bottom)
        bottom.set_yticks([-3, 0, 3])
    # The viscoelastic law with its confidence band, then the other laws.
    names = [(f"viscoelastic, {100 * _LEVEL:.0f} %" + " confidence" * (not is_low), Look(BLUE, band=True))]
    above, below = (damping_fit.main.epsilon(speed, np.array([end])) for end in damping_fit.main.interval(_LEVEL))
    top.fill_between(speed, below, above, color=BLUE, alpha=BAND_OPACITY, linewidth=0, gid="band")
    draw_look(top, Look(BLUE), speed, damping_fit.main.epsilon(speed), "viscoelastic")
    for fit, look in zip(damping_fit.laws[1:], _LOOKS, strict=False):
        name = f"{fit.model.name}, p = {fit.exponent:.2g}" if fit.model.exponent is None else fit.model.name
        # A constant eps falls at slow speeds with the body's weight, which all curves include.
        name += ", and weight" * (fit.model.exponent == 0 and points.weight_speed > 0)
        draw_look(top, look, speed, fit.epsilon(speed), fit.model.name.replace(" ", "-"))
        names.append((name, look))
    # Of many points only some are drawn, at equal steps; -(-a // b) is a/b rounded up.
    some = slice(None, None, -(-len(points) // MOST_MARKED))
    marks: Any = {"color": POINT.color, "markersize": POINT_SIZE, "elinewidth": 0.6, "ecolor": _BARS, "zorder": 1}
    top.errorbar(points.speed[some], points.epsilon[some], errors[some], fmt="o", **marks)
    names.append(("measured" + ", standard error" * (not is_low), POINT))
    if bottom is not None:
        # Residuals of a law that holds lie within one standard error for 68 of 100 points: a pale band, with a line.
        bottom.axhspan(-1, 1, color=GREY, alpha=0.5, linewidth=0, gid="one-standard-error")
        bottom.axhline(0, color=BLACK, linewidth=0.6)
        names.append(("within one standard error", Look(GREY, width=5)))  # points: a stripe in the legend
        off = (damping_fit.main.residuals / damping_fit.main.standard_errors)[some]
        within = np.abs(off) <= _EDGE
        mark: Any = {"color": POINT.color, "markersize": POINT_SIZE, "linestyle": ""}
        bottom.plot(points.speed[some][within], off[within], marker="o", gid="residuals", **mark)
        # Residuals beyond the axis: arrowheads at its edge, with the numbers beside them if they are few.
        mark |= {"color": VERMILION, "markersize": 2 * POINT_SIZE}
        for head, sign in (("^", 1), ("v", -1)):
            beyond, edge = off * sign > _EDGE, sign * (_EDGE - 0.6)
            bottom.plot(points.speed[some][beyond], np.full(beyond.sum(), edge), marker=head, gid="beyond", **mark)
            for x, y in [*zip(points.speed[some][beyond], off[beyond], strict=True)][:_MOST_NUMBERS]:
                bottom.annotate(f"{y:.0f}", (x, edge), (3, 0), textcoords="offset points", va="center", size="x-small")
    # As many columns of the legend as fit into the width
    key_of(sheet, names, "outside lower center", 3 if is_low else 2)
    if not with_result:
        return sheet
    # beta with its standard error, such as "0.8730 +- 0.0040", stands beside the letter of the upper part.
    beta = uncertain(damping_fit.beta, damping_fit.beta_standard_error).replace("+-", "±")
    unit = r"$(\mathrm{s/m})^{1/5}$"
    letter = "" if is_low else "(a)  "
    top.set_title(rf"{letter}$\beta$ = {beta} {unit}" + f"\nviscoelastic law: {damping_fit.verdict.word}", loc="left")
    return sheet
