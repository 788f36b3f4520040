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

DIGITS = 8  # more than a figure shows

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

DAMPINGS = np.concatenate([np.linspace(0.02, 0.5, 9), np.linspace(0.58, 3, 26), np.geomspace(3.4, 100, 12)])
LEAST_SHOWN = 1e-6  # of eps
# Close to the largest K of the end x = 0, eps falls to 0 steeply; this many bisections show it.
HALVINGS = 12


def law_with(nu: Fraction, end: End = "force") -> Law:
    """Return a law of this nu for which kappa is K."""
    return Law(nu - 1, Fraction(0), end) if nu > 1 else Law(Fraction(1), Fraction(1), end)


def epsilon(law: Law, kappa: float) -> float:
    """Return eps; nan if contact never ends."""
    try:
        return float(exact.collision(kappa=kappa, law=law, digits=DIGITS).floats()["epsilon"])
    except ValueError:
        if law.bounded:
            return np.nan
        raise


def curve(law: Law) -> tuple[Floats, Floats]:
    """Return kappa and eps along the curve of a law, as far as it is shown or exists."""
    points: list[tuple[float, float]] = []
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
    """Yield points between a kappa where contact ends and one where it never does."""
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
    sheet, (top, bottom) = new_sheet(5.0, (1, 1.25))
    label_axes(top, "$K$", EPSILON, (0, 3), (0, 1.02), "")
    label_axes(bottom, "$K$", EPSILON, (0.05, 100), (LEAST_SHOWN, 1.5), "xy")
    for nu, color in COLORS.items():
        for end, dashes in ENDS.items():
            if nu > 1 or end == "force":
                kappa, value = curve(law_with(nu, end))
                for axes, where in ((top, "linear"), (bottom, "logarithmic")):
                    name = f"{end}-{nu}-{where}".replace("/", "-")
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

ASKED = np.linspace(0.04, 1, 33)
LARGEST_SHOWN = 0.07  # of the errors in the lower part

FORMULAS: Mapping[str, tuple[Look, tuple[float, str] | Beside]] = {
    "Lee and Wang": (Look(ORANGE, DASHED, text="#A87400"), (0.45, "below")),
    "Lankarani and Nikravesh": (Look(VERMILION, text=VERMILION), (0.25, "below")),
    "Hunt and Crossley": (Look(BLUE, text=BLUE), (0.45, "below")),
    "Herbert and McWhannell": (Look(GREEN, DASH_DOT, text=GREEN), (0.25, "below")),
    "Qin and Lu": (Look(PURPLE, text="#A04578"), (0.3, -4, 0)),
    "Safaeifar and Farshidianfar": (Look(GREEN, DOTTED, text=GREEN), (0.53, 0, -8)),
    "Gonthier et al.": (Look(BLACK, SHORT), (0.77, 0, -4)),
    "Hu and Guo": (Look(BLUE, DASHED, text=BLUE), (0.21, 0, 9)),
    "Ye et al.; Flores et al.": (Look(VERMILION, DOTTED, text=VERMILION), (0.205, 0, -5)),
    "Gharib and Hurmuzlu": (Look(SKY, text="#2277AA"), (0.78, "above")),
}
"""The curve of each formula, and where its name stands: along it in the upper part, or beside it in the lower part."""


@figure("the eps that damping formulas in wide use give, against the eps they are asked for")
def _damping_formulas() -> Sheet:
    sheet, (top, bottom) = new_sheet(6.0, (1.2, 1))
    label_axes(top, "$e$ asked for", EPSILON, (0, 1), (0, 1), "")
    label_axes(bottom, "$e$ asked for", r"$\varepsilon - e$", (0, 1), (-LARGEST_SHOWN, LARGEST_SHOWN), "")
    top.plot([0, 1], [0, 1], color=GREY, linewidth=3.4, gid="exact")
    bottom.axhline(0, color=GREY, linewidth=3.4, gid="exact-error")
    formulas = {formula.name: formula for formula in textbook.HUNT_CROSSLEY}
    write_text(bottom, r"as asked for: $\varepsilon = e$", (0.57, 0), (0, 3))
    for name, (look, place) in FORMULAS.items():
        given = np.array([float(textbook.delivered_epsilon(formulas[name], str(e), DIGITS)) for e in ASKED.tolist()])
        gid = re.sub(r"\W+", "-", name.lower()).strip("-")
        draw_look(top, look, ASKED, given, gid)
        draw_look(bottom, look, ASKED, given - ASKED, f"{gid}-error")
        if len(place) == 2:
            write_along(top, name, ASKED, given, *place, look.text)
        else:
            at, right, above = place
            text = name.replace("and F", "and\nF")
            write_text(bottom, text, (at, np.interp(at, ASKED, given - ASKED)), (right, above), look.text, 6)
    return sheet


FIGURES: Mapping[str, Figure] = {"universal-curves": _universal_curves, "damping-formulas": _damping_formulas}
