"""Coefficients of restitution against impact speed: of materials, laws, approximants and programs, as curves."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING, NamedTuple

import numpy as np
from mpmath import mp

from viscopade.arrays import double
from viscopade.arrays.checked import FloatArray
from viscopade.collision import exact
from viscopade.collision.adhesion import adhesive
from viscopade.collision.curve import curve
from viscopade.collision.spheres import Pair, beta_from_restitution
from viscopade.collision.weight import FallingContact
from viscopade.fitting.points import Points
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
    POINT,
    POINT_SIZE,
    PURPLE,
    SKY,
    VERMILION,
    Look,
    draw_look,
    key_of,
    label_axes,
    new_sheet,
    plain_ticks,
)
from viscopade.simulators import simulator_of
from viscopade.simulators.formula import DampingFormula
from viscopade.theory.law import VISCOELASTIC, law_of
from viscopade.theory.pade import pade

if TYPE_CHECKING:
    from matplotlib.figure import Figure as Sheet

    from viscopade.theory.law import Law

MOST = 24
"""Largest number of curves in a picture; a choice."""
PADE_DIGITS = 18  # of coefficients: more than a double has
_ERROR_DIGITS = 30  # of what the errors are computed from; up to 39 digits eps comes from a table, in 0.2 ms. A choice
_DIGITS = 15  # of the contact time: those of a double

_COLORS = (BLUE, ORANGE, GREEN, VERMILION, PURPLE, SKY, BLACK)
_DASHES = ((), DASHED, DASH_DOT, DOTTED)
BESIDE_APPROXIMANTS = Look(GREY, width=3.4)
"""Style of the first curve beside its approximants only: broad and pale, so that those on top of it stay visible."""
BESIDE_OTHERS = Look(BLACK, width=2.2)
"""Style of the first curve beside other laws and programs: the main curve is the darkest, and broader than theirs."""

Restitution = Callable[[FloatArray], FloatArray]


class Weight(NamedTuple):
    """Weight of bodies that fall on a plane; their contact time at a speed is that of the viscoelastic law.

    `gravity` is in m/s^2, `speed` in m/s, and `contact_time`, without weight, in s.
    """

    gravity: float
    speed: float
    contact_time: float

    def epsilon(self, law: Law, kappa: float) -> Restitution:
        """Return eps as a function of the impact speed, for a law with its kappa at `speed`; sampled."""
        # The unit of time is t_c/tau_c: all laws have the same contact time at this speed.
        tau_c = exact.collision(kappa=repr(kappa), law=law, digits=_DIGITS).floats()["tau_c"]
        return FallingContact(law, kappa, self.contact_time / tau_c, self.speed, self.gravity).epsilon


@dataclass(frozen=True)
class SpeedCurve:
    """A curve eps(v).

    Attributes
    ----------
    name : str
    epsilon : callable
        Takes and returns an array.
    error : function, optional
        The relative error of an approximant of eps as a function of the impact speed in m/s, or of v*.
    """

    name: str
    epsilon: Restitution
    error: Restitution | None = None


def viscoelastic(name: str, beta: float, weight: Weight | None = None) -> SpeedCurve:
    """Return the curve of viscoelastic spheres with a beta in (s/m)^(1/5), and with a weight if there is one."""
    # kappa = beta v^(1/5), and v* is its root, beta^(1/2) v^(1/10).
    if weight is not None:
        return SpeedCurve(name, weight.epsilon(VISCOELASTIC, beta * weight.speed**0.2))
    return SpeedCurve(name, lambda v: np.asarray(double.epsilon(np.sqrt(beta) * v**0.1)))


def adhesive_spheres(name: str, pair: Pair, work: float, gravity: float) -> SpeedCurve:
    """Return the curve of viscoelastic spheres that adhere, with a weight if gravity (m/s^2) is not 0; sampled.

    `work` is the work of adhesion in J/m^2.
    """
    contact = adhesive(pair, work, gravity)
    return SpeedCurve(name, lambda v: np.array([contact.collide(speed).epsilon for speed in v.tolist()]))


def of_law(law: Law | str, epsilon: float, speed: float, weight: Weight | None = None) -> SpeedCurve:
    """Return the curve of a law of contact that has, without weight, `epsilon` at a speed in m/s.

    Its name is that of the law, such as "linear"; exponents such as "3/2,1/4" are "law 3/2,1/4".
    """
    # kappa at this speed gives eps there; at other speeds kappa grows as v^(2 c), where 2 c = 2/nu - 1 and, for the
    # exponents a and b of the law, nu = (a + 1)/(b + 1).
    contact = law_of(law)
    functions, power = curve(contact), float(2 * contact.c)
    kappa = float(functions.kappa_from(epsilon))
    name = f"law {law}" if "," in str(law) else str(law)
    if weight is not None:
        return SpeedCurve(name, weight.epsilon(contact, kappa))
    return SpeedCurve(name, lambda v: functions.epsilon(kappa * (v / speed) ** power))


def over_v_star() -> SpeedCurve:
    """Return the curve of viscoelastic spheres over v*."""
    return SpeedCurve("exact", lambda v_star: np.asarray(double.epsilon(v_star)))


def approximant(m: int, n: int, beta: float | None) -> SpeedCurve:
    """Return the curve of the approximant [m/n] of viscoelastic spheres; over v* if beta is None."""
    from viscopade.kernels.quotient import relative_errors

    quotient = pade(m, n, PADE_DIGITS)

    def v_star(v: FloatArray) -> FloatArray:
        """Return v* = beta^(1/2) v^(1/10)."""
        return v if beta is None else np.sqrt(beta) * v**0.1

    def error(v: FloatArray) -> FloatArray:
        """Return the relative error of the approximant, 0 where it is too small to be computed."""
        errors = relative_errors(pade(m, n, _ERROR_DIGITS), v_star(v).tolist(), _ERROR_DIGITS)
        return np.array([0.0 if ball.contains(0) else float(ball.mid()) for ball in errors])

    return SpeedCurve(f"[{m}/{n}]", lambda v: np.asarray(quotient(v_star(v))), error)


def of_program(name: str, epsilon: float, speed: float, weight: Weight | None = None) -> list[SpeedCurve]:
    """Return the curves of the formulas of the program `name`, set to `epsilon` at a speed in m/s.

    Each formula turns eps into a parameter of the program, and so into a damping kappa, as its manual says; the eps
    that this gives may be another one. With `weight` bodies fall on a plane. A formula for which this eps is out of
    range has no curve.
    """
    curves = []
    program = simulator_of(name)
    for formula in program.formulas:
        try:
            # A decimal of 15 digits, all that a double has.
            kappa = formula.damping(f"{epsilon:.15g}")
        except ValueError:
            continue
        alone = _of_formula(formula, float(kappa), speed)
        restitution = alone if weight is None else weight.epsilon(formula.law, float(kappa))
        curves.append(SpeedCurve(f"{program.title}: {formula.name}", restitution))
    return curves


def _of_formula(formula: DampingFormula, kappa: float, speed: float) -> Restitution:
    """Return eps as a function of the impact speed, for a formula's law with the damping `kappa` at a speed in m/s."""
    # kappa grows as v^(2 c), where 2 c = 2/nu - 1. Bodies that never part have no eps (NaN).
    power = float(2 * formula.law.c)

    def epsilon(v: float) -> float:
        value = formula.contact_epsilon(mp.mpf(kappa * (v / speed) ** power))
        return np.nan if value is None else float(value)

    return lambda v: np.array([epsilon(v_i) for v_i in v.tolist()])


def beta_of(epsilon: float, speed: float) -> float:
    """Return the beta of viscoelastic spheres that have an eps at a speed."""
    return float(beta_from_restitution(speed, epsilon))


def draw_speeds(
    curves: Sequence[SpeedCurve],
    speeds: FloatArray,
    data: Points | None = None,
    *,
    over: str = "impact speed in m/s",
    unit: float = 1.0,
    linear: bool = False,
) -> Sheet:
    """Draw curves, and measured points if there are any; `over` is the label of the horizontal axis.

    `speeds` are those at which curves are computed, ascending, in m/s or v*; `data` has measured speeds and eps. The
    axis of speeds has a `unit` of so many m/s, and is logarithmic unless it is to be `linear`.
    """
    # 2.6 inches (by eye), and 0.13 for each curve's line in the legend, whose letters have 6 points (0.083 inches).
    sheet, (axes,) = new_sheet(2.6 + 0.13 * len(curves))
    # The axis of eps: all finite values between 0 and 1, with a margin of 5 % on both sides (a choice).
    values = [speed_curve.epsilon(speeds) for speed_curve in curves]
    shown = np.concatenate([*(v[np.isfinite(v)] for v in values), *([] if data is None else [data.epsilon])])
    shown = np.clip(shown, 0, 1)
    low, high = (float(shown.min()), float(shown.max())) if shown.size else (0.0, 1.0)
    # Curves that are constant get a range of 1e-3. The axis ends at 0, and at 1.02 so that a line at eps = 1 shows.
    margin = 0.05 * max(high - low, 1e-3)
    label_axes(
        axes,
        over,
        EPSILON,
        (speeds[0] / unit, speeds[-1] / unit),
        (max(low - margin, 0), min(high + margin, 1.02)),
        "" if linear else "x",
    )
    if not linear:
        plain_ticks(axes)
    # 7 colours and 4 kinds of dashes change together, so that no two of the first 28 curves look alike.
    names = []
    for i, (speed_curve, value) in enumerate(zip(curves, values, strict=True)):
        look = Look(_COLORS[i % len(_COLORS)], _DASHES[i % len(_DASHES)])
        if i == 0 and len(curves) > 1:
            approximants_only = all(other.error is not None for other in curves[1:])
            look = BESIDE_APPROXIMANTS if approximants_only else BESIDE_OTHERS
        draw_look(axes, look, speeds / unit, value, f"curve-{i + 1}")
        names.append((speed_curve.name, look))
    if data is not None:
        axes.plot(data.speed / unit, data.epsilon, "o", color=POINT.color, markersize=POINT_SIZE, gid="data")
        names.append(("measured", POINT))
    # Two columns of the legend have room for 30 characters each (by eye); longer names stand in one.
    key_of(sheet, names, "outside lower center", 1 if max(len(name) for name, _ in names) > 30 else 2)
    return sheet
