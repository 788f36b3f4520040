"""Figures of the audit: the eps that programs give, with time steps, over the speed, and with weight."""

from __future__ import annotations

from collections.abc import Mapping
from typing import TYPE_CHECKING

import numpy as np
from mpmath import mp

from viscopade import restitution
from viscopade.collision.contact import PHASES, Contact
from viscopade.collision.spheres import beta_from_restitution
from viscopade.collision.weight import loss_slope
from viscopade.plots.sheet import (
    BAND_OPACITY,
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

POINTS = 200  # of a curve: 70 to an inch of the axis, closer than a line is wide (1.3 points, 55 to an inch)
ASKED = np.linspace(0.05, 1, POINTS)  # eps asked for
CURVES: Mapping[str, tuple[str, str, str, Look]] = {
    "other-end": (
        "made for end $x = 0$",
        "lammps",
        "hooke, coeff_restitution, limit_damping",
        Look(BLUE),
    ),
    "half-mass": ("made for half the mass", "lammps", "hertz, tsuji", Look(ORANGE, DASHED)),
    "both": ("both", "yade", "ViscElPhys, tc, en, et, at a wall", Look(VERMILION, DASH_DOT)),
    "reverse": ("made for end force 0", "lammps", "hertz, viscoelastic", Look(PURPLE)),
}
"""Name in the file -> its name in the figure, program, formula that stands for others with the same eps, and look."""

MEASURED = ("lammps", "liggghts")  # programs whose formulas the curves of the upper part are
CHOSEN = 0.5  # eps of all other pictures: the audit's runs, `viscopade_lab.runs.simulators.WANTED`, ask for it
STEPS = np.geomspace(0.001, 0.1, POINTS)  # in contact times: from the shortest to the longest step of the runs
STEPPED: Mapping[str, tuple[str, str]] = {
    "hooke, coeff_restitution": ("linear", ORANGE),
    "hertz, coeff_restitution": ("Tsuji", BLUE),
    "hertz, viscoelastic, limit_damping": ("viscoelastic", PURPLE),
}
"""Formulas of LAMMPS that are correct for fine time steps -> their names and colours in the figure."""

# The range of eps is sampled at 8 steps to a decade, from 10 to 200 steps in a contact: beyond, it is proportional to
# the step. eps depends also on the part of a step that is left when contact ends, and so is periodic in the number of
# steps in a contact: the range is that over 97 neighbours, up to 0.6 steps more or fewer, a little more than a period.
NUMBERS = np.geomspace(10, 200, 11)
NEIGHBOURS = np.linspace(-0.6, 0.6, 97)


@figure("the eps that programs give against the eps they are asked for, and against the time step")
def _audit() -> Sheet:
    """Return the figure: above, the eps that programs give over the one asked for; below, over the time step."""
    sheet, (top, bottom) = new_sheet(5.6, (1.2, 1))  # height in inches, ratio of heights: chosen by eye
    label_axes(top, f"{EPSILON} asked for", EPSILON, (0, 1), (0, 1), "")
    # With steps of 0.1 contact times eps lies between 0.42 and 0.57.
    label_axes(bottom, "time step / contact time", EPSILON, (0.001, 0.1), (0.42, 0.58), "x")
    # eps as asked for is broad (3.4 points) and pale, so that curves on top of it stay visible.
    top.plot([0, 1], [0, 1], color=GREY, linewidth=3.4, gid="exact")
    for gid, (_, program, name, look) in CURVES.items():
        # Each point: the eps that a contact with the damping of the program's formula delivers, exactly.
        formula = simulator_of(program).formula(name)
        values = [float(formula.contact_epsilon(formula.damping(f"{asked:.4g}"))) for asked in ASKED.tolist()]
        draw_look(top, look, ASKED, np.array(values), gid)
    # What the programs gave, with the finest of the time steps that were run.
    runs = [run for run in measurements() if run.program in MEASURED and run.time_step == STEPS[0]]
    top.plot(
        [float(run.asked) for run in runs],
        [run.epsilon for run in runs],
        "o",
        color=POINT.color,
        markersize=POINT_SIZE,
        gid="measured",
    )
    named = [(words, look) for words, _, _, look in CURVES.values()]
    key_of(top, [*named, ("as asked for", Look(GREY, width=3.4)), ("measured", POINT)], "upper left", 1)
    for name, (_, color) in STEPPED.items():
        _draw_stepped(bottom, simulator_of("lammps").formula(name), color)
    bands = [(f"{name}: range", Look(color, width=0, band=True)) for name, color in STEPPED.values()]
    key_of(bottom, [*bands, ("measured", POINT)], "upper left", 1)
    return sheet


def _draw_stepped(axes: Axes, formula: DampingFormula, color: str) -> None:
    """Draw the range of eps over the time step, and the values measured in LAMMPS.

    The damping is the one that gives `CHOSEN` in continuous time. The range is that over phases, the parts of a step
    after which contact begins, and over steps nearby.
    """
    kappa, gid = float(kappa_for_epsilon(formula.law, str(CHOSEN))), formula.name.replace(", ", "-")
    contact = Contact.of_law(formula.law, kappa)
    # (eps - CHOSEN)/step changes slowly with the step: its extremes over the neighbours make smooth edges. Rows: steps
    # of `NUMBERS`; columns: neighbours; eps at the scaled impact speed 1 for all phases.
    neighbours = 1 / (NUMBERS[:, None] + NEIGHBOURS)
    slopes = np.array(
        [
            [(contact.rebounds(1.0, step * formula.law.contact_time, PHASES).epsilon - CHOSEN) / step for step in row]
            for row in neighbours.tolist()
        ]
    )
    # Edges at all `STEPS`; `interp` keeps the last value beyond `NUMBERS`.
    low, high = (
        CHOSEN + STEPS * np.interp(-np.log(STEPS), np.log(NUMBERS), extreme)
        for extreme in (slopes.min((1, 2)), slopes.max((1, 2)))
    )
    band = axes.fill_between(STEPS, low, high, gid=f"{gid}-range")
    band.set(facecolor=(color, BAND_OPACITY), edgecolor=color, linewidth=0.6)  # points, as in the legend
    runs = [
        (run.time_step, run.epsilon)
        for run in measurements()
        if (run.program, run.formula, run.asked) == ("lammps", formula.name, str(CHOSEN))
    ]
    steps, epsilon = zip(*runs, strict=True)
    (points,) = axes.plot(steps, epsilon, "o", color=color, markersize=POINT_SIZE, gid=f"{gid}-points")
    points.set_clip_on(False)  # those on the frame are drawn whole


SPEEDS = np.geomspace(0.01, 10, POINTS)  # m/s, around the 1 m/s of the numbers
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
"""Name in the file -> its name in the figure, program, formula that stands for others, whether the damping gives 0.5 at
1 m/s (else it is the formula's), and look."""


@figure("eps against speed of contacts that are made for 0.5 at 1 m/s, in programs of three kinds")
def _over_speed() -> Sheet:
    """Return the figure: eps over the speed of contacts of three laws, and its difference from the viscoelastic law.

    All are made for eps = 0.5 at 1 m/s.
    """
    sheet, (top, bottom) = new_sheet(6.2, (1.2, 1))  # height in inches, ratio of heights: chosen by eye
    label_axes(top, "impact speed (m/s)", EPSILON, (0.01, 10), (0, 1), "x")
    # Relative differences from -1, eps = 0, to 1, twice the viscoelastic eps.
    label_axes(bottom, "impact speed (m/s)", "relative difference", (0.01, 10), (-1, 1), "x")
    exact = restitution(SPEEDS, float(beta_from_restitution(1.0, CHOSEN)))
    # The viscoelastic law is broad (3.4 points) and pale, so that curves on top of it stay visible.
    top.plot(SPEEDS, exact, color=GREY, linewidth=3.4, gid="viscoelastic")
    bottom.axhline(0, color=GREY, linewidth=3.4, gid="viscoelastic-difference")
    for gid, (_, program, name, instead, look) in OVER_SPEED.items():
        formula = simulator_of(program).formula(name)
        # kappa at 1 m/s, the one that gives CHOSEN or the formula's; it is proportional to v^(2/nu - 1).
        kappa = kappa_for_epsilon(formula.law, str(CHOSEN)) if instead else formula.damping(str(CHOSEN))
        power = float(2 / formula.law.nu - 1)
        dampings = [mp.mpf(float(kappa) * speed**power) for speed in SPEEDS.tolist()]
        delivered = np.array([float(formula.contact_epsilon(damping)) for damping in dampings])
        draw_look(top, look, SPEEDS, delivered, gid)
        draw_look(bottom, look, SPEEDS, delivered / exact - 1, f"{gid}-difference")
    named = [(words, look) for words, *_, look in OVER_SPEED.values()]
    whole = ("viscoelastic law: LAMMPS, YADE, REBOUND, …", Look(GREY, width=3.4))
    key_of(sheet, [whole, *named], "outside lower center", 1)
    return sheet


SHARES = np.linspace(0, 1.2, POINTS)
"""g t_c/v, with the duration t_c of contact without damping: from no weight to beyond where all bodies stay down."""
WITH_WEIGHT: Mapping[str, tuple[str, str]] = {
    "linear": ("linear", ORANGE),
    "tsuji": ("Tsuji", BLUE),
    "viscoelastic": ("viscoelastic", PURPLE),
    "hunt-crossley:1": ("Hunt-Crossley", VERMILION),
}


@figure("eps with weight over g t_c/v, of four laws of contact that are made for 0.5 without weight")
def _weight() -> Sheet:
    """Return the figure: eps with weight over g t_c/v for four laws and both ends, and the rule of its first order."""
    sheet, (axes,) = new_sheet(3.2)  # height in inches, chosen by eye
    # 0.02: a margin above the curves, which begin at 0.5.
    label_axes(axes, "weight: $g t_c / v$", EPSILON, (SHARES[0], SHARES[-1]), (0, CHOSEN + 0.02), "")
    # First order of a small weight: 1 - eps grows by the factor 1 + s g t_c/v, s = 0.539 for the viscoelastic law.
    rule = 1 - (1 - CHOSEN) * (1 + loss_slope(law_of("viscoelastic")) * SHARES)
    draw_look(axes, Look(BLACK, DASH_DOT, 0.9), SHARES, rule, "rule")
    for name, (_, color) in WITH_WEIGHT.items():
        for end, look in (("force", Look(color)), ("return", Look(color, DASHED))):
            law = law_of(name, end)
            # For nu = 1 the force vanishes at x = 0: both ends are one. Tsuji's curve lies on the solid one of the
            # linear law: they differ by 0.003 at most.
            if end == "return" and (law.nu <= 1 or name == "tsuji"):
                continue
            kappa = float(kappa_for_epsilon(law, str(CHOSEN)))
            values = []
            for share in SHARES.tolist():
                # In scaled units v = 1, and the load is g = share/t_c.
                values.append(Contact.of_law(law, kappa, share / law.contact_time).collide().epsilon)
                if values[-1] == 0:  # the bodies stay together, with any larger weight, too
                    break
            draw_look(axes, look, SHARES[: len(values)], np.array(values), f"{name}-{end}")
    named = [(words, Look(color)) for words, color in WITH_WEIGHT.values()]
    others = [
        ("ends at force 0", Look(BLACK)),
        ("ends at $x = 0$", Look(BLACK, DASHED)),
        (r"$1 - 0.5\,(1 + 0.539\, g t_c/v)$", Look(BLACK, DASH_DOT, 0.9)),
    ]
    key_of(axes, [*named, *others], "lower left", 1)
    return sheet


FIGURES: Mapping[str, Figure] = {"audit": _audit, "eps-over-speed": _over_speed, "weight": _weight}
