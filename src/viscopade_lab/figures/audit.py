"""Figures of the audit: the eps that programs give, with time steps, over the speed, and with weight."""

from __future__ import annotations

from collections.abc import Mapping
from typing import TYPE_CHECKING

import numpy as np
from mpmath import mp

from viscopade import restitution
from viscopade.arrays.checked import FloatArray
from viscopade.collision.contact import PHASES, Contact
from viscopade.collision.spheres import beta_from_restitution
from viscopade.collision.weight import loss_slope
from viscopade.plots.sheet import (
    BLACK,
    BLUE,
    DASH_DOT,
    DASHED,
    EPSILON,
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
    new_sheet,
)
from viscopade.simulators import simulator_of
from viscopade.simulators.formula import DampingFormula, kappa_for_epsilon
from viscopade.theory.law import law_of
from viscopade_lab.figures.paper import Figure, figure
from viscopade_lab.runs.simulators import measurements

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure as Sheet

ASKED = np.linspace(0.05, 1, 20)
CURVES: Mapping[str, tuple[str, str, str, Look]] = {
    "other-end": (
        "made for end $x = 0$",
        "lammps",
        "hooke, coeff_restitution, limit_damping",
        Look(BLUE),
    ),
    "half-mass": ("made for half the mass", "lammps", "hertz, tsuji (22 Jul 2025)", Look(ORANGE, DASHED)),
    "both": ("both", "yade", "ViscElPhys, tc, en, et, at a wall", Look(VERMILION, DASH_DOT)),
    "reverse": ("made for end force 0", "lammps", "hertz, viscoelastic", Look(PURPLE)),
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
"""Formulas of LAMMPS that are correct for fine time steps."""


@figure("the eps that programs give against the eps they are asked for, and against the time step")
def _audit() -> Sheet:
    sheet, (top, bottom) = new_sheet(5.6, (1.2, 1))
    label_axes(top, f"{EPSILON} asked for", EPSILON, (0, 1), (0, 1), "")
    label_axes(bottom, "time step / contact time", EPSILON, (0.001, 0.1), (0.44, 0.58), "x")
    top.plot([0, 1], [0, 1], color=GREY, linewidth=3.4, gid="exact")
    for gid, (_, program, name, look) in CURVES.items():
        _draw_curve(top, simulator_of(program).formula(name), look, gid)
    _mark_measured(top)
    named = [(words, look) for words, _, _, look in CURVES.values()]
    key_of(top, [*named, ("as asked for", Look(GREY, width=3.4)), ("measured", POINT)], "upper left", 1)
    for name, (_, look) in STEPPED.items():
        _draw_stepped(bottom, simulator_of("lammps").formula(name), look)
    names = [
        *((f"{name}: mean", look) for name, look in STEPPED.values()),
        ("range", Look(GREY, width=5)),
        ("measured", POINT),
    ]
    key_of(bottom, names, "upper left", 2)
    return sheet


def _draw_curve(axes: Axes, formula: DampingFormula, look: Look, gid: str) -> None:
    values = [float(formula.contact_epsilon(formula.damping(f"{asked:.4g}"))) for asked in ASKED.tolist()]
    draw_look(axes, look, ASKED, np.array(values), gid)


def _mark_measured(axes: Axes) -> None:
    found = [each for each in measurements() if each.program in MEASURED and each.time_step == STEPS[0]]
    axes.plot(
        [float(each.asked) for each in found],
        [each.epsilon for each in found],
        "o",
        color=POINT.color,
        markersize=POINT_SIZE,
        gid="measured",
    )


def _draw_stepped(axes: Axes, formula: DampingFormula, look: Look) -> None:
    """Draw the mean eps over the time step, its range, and the measured values."""
    kappa, gid = float(kappa_for_epsilon(formula.law, str(CHOSEN))), formula.name.replace(", ", "-")
    times = STEPS * formula.law.contact_time
    found = np.array([Contact.of_law(formula.law, kappa).rebounds(1.0, step, PHASES).epsilon for step in times])
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
    (points,) = axes.plot(at, epsilon, "o", color=look.color, markersize=POINT_SIZE, gid=f"{gid}-points")
    points.set_clip_on(False)


SPEEDS = np.geomspace(0.01, 10, 31)
OVER_SPEED: Mapping[str, tuple[str, str, str, bool, Look]] = {
    "constant": (
        "MuJoCo, Chrono, JaxDEM, …: number from viscopade",
        "mujoco",
        "solref = -stiffness -damping",
        True,
        Look(BLUE),
    ),
    "constant-asked": (
        "MuJoCo, Chrono, JaxDEM, …: number from the manual",
        "mujoco",
        "solref = -stiffness -damping",
        False,
        Look(BLUE, DASHED),
    ),
    "hunt-crossley": (
        "Drake, Simbody: number from viscopade",
        "drake",
        "continuous, d = 3 (1 - e)/(2 v)",
        True,
        Look(ORANGE),
    ),
    "hunt-crossley-asked": (
        "Drake, Simbody: number from the manual",
        "drake",
        "continuous, d = 3 (1 - e)/(2 v)",
        False,
        Look(ORANGE, DASHED),
    ),
    "no-limit": ("LAMMPS without limit_damping", "lammps", "hertz, viscoelastic", False, Look(PURPLE, DASH_DOT)),
}
"""For each curve its name, a formula that stands for others, and whether the damping gives 0.5 at 1 m/s."""


@figure("eps against speed of contacts that are made for 0.5 at 1 m/s, in programs of three kinds")
def _over_speed() -> Sheet:
    sheet, (top, bottom) = new_sheet(6.2, (1.2, 1))
    label_axes(top, "impact speed (m/s)", EPSILON, (0.01, 10), (0, 1), "x")
    label_axes(bottom, "impact speed (m/s)", "relative difference", (0.01, 10), (-1, 1), "x")
    exact = restitution(SPEEDS, float(beta_from_restitution(1.0, CHOSEN)))
    top.plot(SPEEDS, exact, color=GREY, linewidth=3.4, gid="viscoelastic")
    bottom.axhline(0, color=GREY, linewidth=3.4, gid="viscoelastic-difference")
    for gid, (_, program, name, instead, look) in OVER_SPEED.items():
        found = _at_speeds(simulator_of(program).formula(name), instead)
        draw_look(top, look, SPEEDS, found, gid)
        draw_look(bottom, look, SPEEDS, found / exact - 1, f"{gid}-difference")
    named = [(words, look) for words, *_, look in OVER_SPEED.values()]
    whole = ("viscoelastic law: LAMMPS, YADE, REBOUND, …", Look(GREY, width=3.4))
    key_of(sheet, [whole, *named], "outside lower center", 1)
    return sheet


def _at_speeds(formula: DampingFormula, instead: bool) -> FloatArray:
    """Return eps at `SPEEDS`; kappa at 1 m/s is that of the formula, or the one that gives `CHOSEN`."""
    kappa = kappa_for_epsilon(formula.law, str(CHOSEN)) if instead else formula.damping(str(CHOSEN))
    power = float(2 / formula.law.nu - 1)
    return np.array([float(formula.contact_epsilon(mp.mpf(float(kappa) * speed**power))) for speed in SPEEDS.tolist()])


SHARES = np.concatenate([np.geomspace(0.01, 0.4, 25), np.linspace(0.44, 1.4, 49)])
"""g t_c/v, with the duration t_c of contact without damping."""
WITH_WEIGHT: Mapping[str, tuple[str, str]] = {
    "linear": ("linear", ORANGE),
    "tsuji": ("Tsuji", BLUE),
    "viscoelastic": ("viscoelastic", PURPLE),
    "hunt-crossley:1": ("Hunt-Crossley", VERMILION),
}


@figure("eps with weight over g t_c/v, of four laws of contact that are made for 0.5 without weight")
def _weight() -> Sheet:
    sheet, (axes,) = new_sheet(3.2)
    label_axes(axes, "weight: $g t_c / v$", EPSILON, (SHARES[0], SHARES[-1]), (0, CHOSEN + 0.02), "x")
    rule = 1 - (1 - CHOSEN) * (1 + loss_slope(law_of("viscoelastic")) * SHARES)
    draw_look(axes, Look(BLACK, DASH_DOT, 0.9), SHARES, rule, "rule")
    for name, (_, color) in WITH_WEIGHT.items():
        for end, look in (("force", Look(color)), ("return", Look(color, DASHED))):
            law = law_of(name, end)
            if end == "return" and law.nu <= 1:
                continue
            kappa = float(kappa_for_epsilon(law, str(CHOSEN)))
            values = []
            for share in SHARES.tolist():
                values.append(Contact.of_law(law, kappa, share / law.contact_time).collide().epsilon)
                if values[-1] == 0:
                    break
            draw_look(axes, look, SHARES[: len(values)], np.array(values), f"{name}-{end}")
    named = [(words, Look(color)) for words, color in WITH_WEIGHT.values()]
    others = [
        ("ends at force 0", Look(BLACK)),
        ("ends at $x = 0$", Look(BLACK, DASHED)),
        ("$1 - 0.5 (1 + 0.539 g t_c/v)$", Look(BLACK, DASH_DOT, 0.9)),
    ]
    key_of(axes, [*named, *others], "lower left", 1)
    return sheet


FIGURES: Mapping[str, Figure] = {"audit": _audit, "eps-over-speed": _over_speed, "weight": _weight}
