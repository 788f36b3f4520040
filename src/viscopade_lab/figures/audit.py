"""The figure of the audit: what programs deliver, and what their time steps add, with the values measured in them."""

from __future__ import annotations

from collections.abc import Mapping
from typing import TYPE_CHECKING

import numpy as np

from viscopade.audit.measured import measurements
from viscopade.audit.program import DampingFormula, wanted_kappa
from viscopade.audit.programs import program_of
from viscopade.collision import steps
from viscopade_lab.figures.laws import draw_look, key_of
from viscopade_lab.figures.paper import (
    BLUE,
    DASH_DOT,
    DASHED,
    EPSILON,
    GREY,
    ORANGE,
    PURPLE,
    VERMILION,
    Figure,
    Look,
    figure,
    label_axes,
    new_sheet,
)

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure as Sheet

ASKED = np.linspace(0.05, 1, 20)
CURVES: Mapping[str, tuple[str, str, str, Look]] = {
    "other-end": ("made for $x = 0$, ends at force 0", "lammps", "hooke, coeff_restitution, limit_damping", Look(BLUE)),
    "half-mass": ("half of the mass", "lammps", "hertz, tsuji (22 Jul 2025)", Look(ORANGE, DASHED)),
    "both": ("both of them", "yade", "ViscElPhys, tc, en, et, at a wall", Look(VERMILION, DASH_DOT)),
    "reverse": ("made for force 0, ends at $x = 0$", "lammps", "hertz, viscoelastic", Look(PURPLE)),
}
"""For each curve its name, and a formula that stands for others with the same eps."""

MEASURED = ("lammps", "liggghts")
CHOSEN = 0.5
STEPS = np.geomspace(0.001, 0.1, 81)
STEPPED: Mapping[str, tuple[str, Look]] = {
    "hooke, coeff_restitution": ("linear", Look(ORANGE)),
    "hertz, coeff_restitution": ("Tsuji", Look(BLUE)),
    "hertz, viscoelastic, limit_damping": ("viscoelastic", Look(PURPLE)),
}
"""Formulas of LAMMPS that deliver eps at fine time steps."""


@figure(
    "the eps that programs deliver against the eps they are asked for, and against the time step",
    r"""Top: $\varepsilon$ that contacts deliver over the $\varepsilon$ asked for, if the damping is made for another
    end of contact or for half of the mass; what is right lies on the broad grey line. Circles are measured in LAMMPS
    and LIGGGHTS with a time step of a thousandth of the contact time. Bottom: $\varepsilon$ over the time step in
    units of the undamped contact time, where 0.5 is asked for: mean (lines) and range (bands) over where in a step
    contact begins, and collisions in LAMMPS (circles).""",
)
def _audit() -> Sheet:
    sheet, (top, bottom) = new_sheet(5.6, (1.2, 1))
    label_axes(top, f"asked {EPSILON}", f"delivered {EPSILON}", (0, 1), (0, 1), "")
    label_axes(bottom, "time step / contact time", EPSILON, (0.001, 0.1), (0.44, 0.56), "x")
    top.plot([0, 1], [0, 1], color=GREY, linewidth=3.4, gid="exact")
    for gid, (_, program, name, look) in CURVES.items():
        _draw_delivered(top, _formula(program, name), look, gid)
    _mark_measured(top)
    key_of(top, [(words, look) for words, _, _, look in CURVES.values()], "upper left", 1)
    for name, (_, look) in STEPPED.items():
        _draw_stepped(bottom, _formula("lammps", name), look)
    key_of(bottom, list(STEPPED.values()), "upper left", 3)
    return sheet


def _formula(program: str, name: str) -> DampingFormula:
    return next(each for each in program_of(program).formulas if each.name == name)


def _draw_delivered(axes: Axes, formula: DampingFormula, look: Look, gid: str) -> None:
    values = [float(formula.delivered(formula.damping(f"{asked:.4g}"))) for asked in ASKED.tolist()]
    draw_look(axes, look, ASKED, np.array(values), gid)


def _mark_measured(axes: Axes) -> None:
    found = [each for each in measurements() if each.program in MEASURED and each.time_step == STEPS[0]]
    axes.plot(
        [float(each.asked) for each in found],
        [each.epsilon for each in found],
        "o",
        color="black",
        markersize=3,
        markerfacecolor="none",
        gid="measured",
    )


def _draw_stepped(axes: Axes, formula: DampingFormula, look: Look) -> None:
    """Draw the mean eps over the time step, its range, and what was measured."""
    kappa, gid = np.full(len(STEPS), float(wanted_kappa(formula.law, str(CHOSEN)))), formula.name.replace(", ", "-")
    found = steps.epsilons(formula.law, kappa, STEPS * steps.contact_time(formula.law))
    axes.fill_between(
        STEPS, found.min(-1), found.max(-1), color=look.color, alpha=0.25, linewidth=0, gid=f"{gid}-range"
    )
    draw_look(axes, look, STEPS, found.mean(-1), f"{gid}-mean")
    run = [
        (each.time_step, each.epsilon)
        for each in measurements()
        if (each.program, each.formula, each.asked) == ("lammps", formula.name, str(CHOSEN))
    ]
    at, epsilon = zip(*run, strict=True)
    (points,) = axes.plot(at, epsilon, "o", color=look.color, markersize=3, markerfacecolor="none", gid=f"{gid}-points")
    points.set_clip_on(False)


FIGURES: Mapping[str, Figure] = {"audit": _audit}
