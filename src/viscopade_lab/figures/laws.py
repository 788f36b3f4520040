"""Figures of the family of contact laws: the universal curves E_nu(K), and the eps of damping formulas."""

from __future__ import annotations

import re
from collections.abc import Iterator, Mapping
from fractions import Fraction
from typing import TYPE_CHECKING

import numpy as np

from viscopade.collision import exact
from viscopade.plots.sheet import (
    BLACK,
    BLUE,
    DASH_DOT,
    DASHED,
    DOTTED,
    EPSILON,
    GREEN,
    GREY,
    ORANGE,
    PURPLE,
    SHORT,
    SKY,
    VERMILION,
    Look,
    draw_look,
    key_of,
    label_axes,
    new_sheet,
)
from viscopade.simulators import textbook
from viscopade.theory.law import End, Law
from viscopade_lab.figures.paper import Beside, Figure, Floats, figure, write_along, write_text

if TYPE_CHECKING:
    from matplotlib.figure import Figure as Sheet

DIGITS = 8  # more than the three that a figure shows

# --- universal curves -------------------------------------------------------------------------------------------------

COLORS: Mapping[Fraction, str] = {
    Fraction(1): BLACK,
    Fraction(5, 4): SKY,
    Fraction(3, 2): GREEN,
    Fraction(5, 3): BLUE,
    Fraction(2): ORANGE,
    Fraction(5, 2): VERMILION,
}
"""Each nu in the figure, and its colour."""

ENDS: Mapping[End, tuple[float, ...]] = {"force": (), "return": SHORT}
"""The ends of contact, and the dashes of their curves."""

# K of the 200 points of a curve: most on the linear axis, which ends at 3, where they are closer (50 to an inch) than a
# line is wide; beyond, curves are nearly straight on logarithmic axes. Each point is an exact collision.
DAMPINGS = np.concatenate([np.linspace(0.02, 3, 150), np.geomspace(3.1, 100, 50)])
LEAST_SHOWN = 1e-6  # of eps: the frame's lower end. At K = 100, eps = K^-nu is 1e-5 for nu = 5/2 and more for others
# Close to the largest K of the end x = 0, eps falls to 0 steeply; this many bisections show it: 0.02/2^20 is 2e-8 in K.
HALVINGS = 20


def law_with(nu: Fraction, end: End = "force") -> Law:
    """Return a law of this nu for which kappa is K.

    K = kappa (b+1)^(-(a-b)/(a+1)) is kappa for b = 0, where nu = a + 1, and for a = b = 1, where nu = 1. The first
    needs a > 0, so nu > 1. Figures have no nu below 1.
    """
    return Law(nu - 1, Fraction(0), end) if nu > 1 else Law(Fraction(1), Fraction(1), end)


def epsilon(law: Law, kappa: float) -> float:
    """Return eps of a law at a damping kappa; nan if contact never ends (end x = 0, nu >= 2, too much damping)."""
    try:
        return float(exact.collision(kappa=kappa, law=law, digits=DIGITS).floats()["epsilon"])
    except ValueError:
        if law.bounded:
            return np.nan
        raise


def curve(law: Law) -> tuple[Floats, Floats]:
    """Return kappa and eps along the curve of a law, as far as it is shown or exists."""
    points: list[tuple[float, float]] = []
    # Up to where eps is too small to be shown, or, if contact does not end any more, with points close to that kappa.
    for damping in DAMPINGS.tolist():
        value = epsilon(law, damping)
        if np.isnan(value):
            points += _approach(law, points[-1][0], damping)
            break
        points.append((damping, value))
        if value < LEAST_SHOWN:
            break
    kappa, values = np.array(points).T
    return kappa, values


def _approach(law: Law, inside: float, outside: float) -> Iterator[tuple[float, float]]:
    """Yield points (kappa, eps) between a kappa `inside`, where contact ends, and one `outside`, where it never does.

    They come by bisection, nearer and nearer to the largest kappa, until eps is too small to be shown.
    """
    for _ in range(HALVINGS):
        middle = (inside + outside) / 2
        value = epsilon(law, middle)
        if np.isnan(value):
            outside = middle
        else:
            inside = middle
            yield middle, value
            if value < LEAST_SHOWN:
                return


@figure("eps of the contact laws of one family over their only parameter, for both ends of contact")
def _universal_curves() -> Sheet:
    """Return the figure: eps = E_nu(K) for six nu and both ends, on linear and on logarithmic axes."""
    sheet, (top, bottom) = new_sheet(5.0, (1, 1.25))  # height in inches, ratio of heights: chosen by eye
    # Linear: to K = 3, where most curves are near 0; 1.02 is a margin above 1. Logarithmic: to 100, for the power laws.
    label_axes(top, "$K$", EPSILON, (0, 3), (0, 1.02), "")
    label_axes(bottom, "$K$", EPSILON, (0.05, 100), (LEAST_SHOWN, 1.5), "xy")
    for nu, color in COLORS.items():
        for end, dashes in ENDS.items():
            # For nu = 1 the force vanishes at x = 0: both ends are one. The curve of nu = 5/4 and the end x = 0 lies on
            # the solid ones: on that of 5/4 at small K, and on that of 5/3 at large K.
            if nu > Fraction(5, 4) or end == "force":
                kappa, value = curve(law_with(nu, end))
                for axes, where in ((top, "linear"), (bottom, "logarithmic")):
                    name = f"{end}-{nu}-{where}".replace("/", "-")
                    # Widths in points: dashed curves, which lie beside the solid ones of their colour, are thinner.
                    draw_look(axes, Look(color, dashes, 1.0 if dashes else 1.2), kappa, value, name)
    key_of(top, [(rf"$\nu = {nu}$", Look(color)) for nu, color in COLORS.items()], "upper right", 2)
    key_of(
        bottom,
        [("ends at force 0", Look(BLACK)), ("ends at $x = 0$", Look(BLACK, SHORT))],
        "lower left",
        1,
    )
    return sheet


# --- damping formulas -------------------------------------------------------------------------------------------------

ASKED = np.linspace(0.04, 1, 200)  # eps asked for: 75 to an inch of the axis, closer than a line is wide
LARGEST_SHOWN = 0.07  # of the errors in the lower part: those of the good formulas; the bad ones leave it

FORMULAS: Mapping[str, tuple[Look, tuple[float, str] | None, Beside | None]] = {
    "Lee and Wang": (Look(ORANGE, DASHED, text="#A87400"), (0.45, "below"), None),
    "Lankarani and Nikravesh": (Look(VERMILION, text=VERMILION), (0.25, "below"), None),
    "Hunt and Crossley": (Look(BLUE, text=BLUE), (0.45, "below"), None),
    "Herbert and McWhannell": (Look(GREEN, DASH_DOT, text=GREEN), (0.25, "below"), None),
    "Qin and Lu": (Look(PURPLE, text="#A04578"), (0.13, "above"), (0.3, -4, 0)),
    "Gharib and Hurmuzlu": (Look(SKY, text="#2277AA"), (0.78, "above"), None),
    "Safaeifar and Farshidianfar": (Look(GREEN, DOTTED, text=GREEN), None, (0.53, 0, -8)),
    "Gonthier et al.": (Look(BLACK, SHORT), None, (0.77, 0, -4)),
    "Hu and Guo": (Look(BLUE, DASHED, text=BLUE), None, (0.21, 0, 9)),
    "Ye et al.; Flores et al.": (Look(VERMILION, DOTTED, text=VERMILION), None, (0.205, 0, -5)),
}
"""The curve of each formula, and where its name stands along it in the upper part, and beside it in the lower part.

(e, "below" or "above"), and (e, points to the right, points upwards); chosen by eye, so that no name covers a curve. A
curve is drawn where it has a name: those that lie together in the upper part are in the lower one.
"""


@figure("the eps that damping formulas in wide use give, against the eps they are asked for")
def _damping_formulas() -> Sheet:
    """Return the figure: the eps of Hunt-Crossley contacts by ten formulas for the damping, and its error."""
    sheet, (top, bottom) = new_sheet(6.0, (1.2, 1))  # height in inches, ratio of heights: chosen by eye
    label_axes(top, "$e$ asked for", EPSILON, (0, 1), (0, 1), "")
    label_axes(bottom, "$e$ asked for", r"$\varepsilon - e$", (0, 1), (-LARGEST_SHOWN, LARGEST_SHOWN), "")
    # The correct eps = e is broad (3.4 points) and pale, so that curves on top of it stay visible.
    top.plot([0, 1], [0, 1], color=GREY, linewidth=3.4, gid="exact")
    bottom.axhline(0, color=GREY, linewidth=3.4, gid="exact-error")
    formulas = {formula.name: formula for formula in textbook.HUNT_CROSSLEY}
    write_text(bottom, r"as asked for: $\varepsilon = e$", (0.78, 0), (0, 3))  # 3 points above a free part of the line
    for name, (look, along, beside) in FORMULAS.items():
        # The eps that contacts with the damping of this formula have, by the exact function.
        delivered = np.array(
            [float(textbook.delivered_epsilon(formulas[name], f"{e:.6g}", DIGITS)) for e in ASKED.tolist()]
        )
        gid = re.sub(r"\W+", "-", name.lower()).strip("-")
        if along is not None:
            draw_look(top, look, ASKED, delivered, gid)
            write_along(top, name, ASKED, delivered, *along, look.text)
        if beside is not None:
            draw_look(bottom, look, ASKED, delivered - ASKED, f"{gid}-error")
            x_text, right, above = beside
            text = name.replace("and F", "and\nF")  # the longest name takes two lines
            point = x_text, np.interp(x_text, ASKED, delivered - ASKED)
            write_text(bottom, text, point, (right, above), look.text, 6)  # 6 points, as `write_along` has
    return sheet


FIGURES: Mapping[str, Figure] = {"universal-curves": _universal_curves, "damping-formulas": _damping_formulas}
