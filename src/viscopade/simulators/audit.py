"""The eps that a formula's contact gives, why it is not the one asked for, and what to write instead."""

from __future__ import annotations

import math
from dataclasses import dataclass
from functools import cache, cached_property
from typing import Any

import numpy as np
from mpmath import mp

from viscopade.collision.contact import PHASES, Contact, SampledCollision, resolving_factor
from viscopade.collision.schemes import Scheme
from viscopade.simulators.formula import (
    DIGITS,
    REASONS,
    DampingFormula,
    kappa_for_epsilon,
    kappa_in_steps,
    stepped_collision,
)
from viscopade.simulators.native import SPREAD
from viscopade.simulators.simulator import Simulator
from viscopade.theory.law import Law

ASKED = ("0.9", "0.75", "0.5", "0.3", "0.1")
_AGREES = 1e-9
_LOOKED_AT, _TOGETHER = 64, 8  # time steps, and in how many groups they are looked at
_SMALL = 4000  # steps in a contact whose error is in proportion to the step
_STEPS, _NUMBERS, _PHASES = 250, 16, 512  # steps in a contact, numbers of steps in a period, and phases, for the slope
_OFFSET = 5  # prime to _NUMBERS: phases move on in another order than numbers of steps do


@dataclass(frozen=True)
class Audit:
    """The eps that a formula gives, and what to write instead.

    Attributes
    ----------
    program : Simulator
    formula : DampingFormula
    asked : str
        The wanted eps, a decimal.
    written : float
        The parameter that people write for it.
    delivered : mpmath number or None
        Proven eps in the continuum, to `DIGITS` digits; None if the bodies never part.
    time_step : float or None
        In units of the undamped contact time; None for a program without time steps, too.
    stepped : SampledCollision or None
        Eps at that time step.
    instead : float or None
        The parameter that gives eps: in the continuum, or on average at the time step. None if there is none.
    reasons : tuple of str
        Why the delivered eps is not the one asked for, and why there is no parameter instead; sentences.
    advice : Advice or None
        How eps depends on the time step, if that was wanted.
    """

    program: Simulator
    formula: DampingFormula
    asked: str
    written: float
    delivered: Any
    time_step: float | None
    stepped: SampledCollision | None
    instead: float | None
    reasons: tuple[str, ...]
    advice: Advice | None = None

    @cached_property
    def resolving_steps(self) -> int | None:
        """The least number of time steps in a contact for which eps differs by at most `SPREAD` over the phases.

        The damping gives eps on average. None without a time step or damping, or if the time step is short enough.
        """
        law, scheme, near = (
            self.formula.law,
            self.formula.scheme,
            float(kappa_for_epsilon(self.formula.law, self.asked)),
        )
        if self.time_step is None or scheme is None or near == 0:
            return None

        def contact(kappa: float) -> Contact:
            return Contact.of_law(law, kappa)

        step = self.time_step * law.contact_time
        factor = resolving_factor(contact, float(self.asked), near, SPREAD, step=step, scheme=scheme)
        return None if factor is None or factor == 1 else math.ceil(factor / self.time_step)


@dataclass(frozen=True)
class Advice:
    """How the eps of a formula depends on the time step, which is in units of the undamped contact time.

    Attributes
    ----------
    error : float
        The wanted relative error of eps.
    largest_step : float
        The largest time step with at most this error, wherever in a step contact begins.
    slope : float
        The mean eps is that of the continuum plus slope times the time step, to first order.
    """

    error: float
    largest_step: float
    slope: float


def audit_formula(
    program: Simulator,
    formula: DampingFormula,
    asked: str,
    time_step: float | None = None,
    step_error: float | None = None,
) -> Audit:
    """Return what a formula gives for a wanted eps, in the continuum and at a time step.

    Parameters
    ----------
    program : Simulator
    formula : DampingFormula
        One of its formulas.
    asked : str
        The wanted eps, a decimal > 0 and <= 1.
    time_step : float, optional
        In units of the undamped contact time (`Law.contact_time`).
    step_error : float, optional
        Wanted relative error of eps by the time step, for the advice.

    Raises
    ------
    ValueError
        If the program does not accept what people would write for this eps.
    """
    kappa, step = formula.damping(asked), None if formula.scheme is None else time_step
    delivered = formula.contact_epsilon(kappa)
    wrong = delivered is None or abs(delivered / mp.mpf(asked) - 1) > _AGREES
    reasons = [REASONS[formula.reason], *([formula.note] if formula.note else [])] if wrong else []
    wanted, stepped = kappa_for_epsilon(formula.law, asked), None
    if step is not None and formula.scheme is not None:
        stepped = stepped_collision(formula.law, float(kappa), step, formula.scheme)
        reasons.append(f"The time step adds {stepped.epsilon - float(delivered or 0):+.2g} on average.")
        try:
            wanted = kappa_in_steps(formula.law, float(asked), step, formula.scheme)
        except ValueError as error:
            wanted = None
            reasons.append(f"No damping gives it: {error}; expected a shorter step or a longer contact.")
    instead = None if wanted is None else formula.parameter_of(wanted)
    if instead is None and wanted is not None:
        reasons.append(f"No {formula.parameter} in its range gives it.")
    with mp.workdps(DIGITS):
        written = float(formula.usual_parameter(mp.mpf(asked)))
    number = None if instead is None else float(instead)
    advice = None if step_error is None or delivered is None else step_advice(formula, kappa, delivered, step_error)
    return Audit(program, formula, asked, written, delivered, step, stepped, number, tuple(reasons), advice)


def step_advice(formula: DampingFormula, kappa: Any, delivered: Any, error: float) -> Advice | None:
    """Return how eps depends on the time step; None for a program without time steps."""
    if formula.scheme is None:
        return None
    largest = largest_step(formula.law, float(kappa), error, float(delivered), formula.scheme)
    return Advice(error, largest, step_slope(formula.law, float(kappa), float(delivered), formula.scheme))


@cache
def step_slope(law: Law, kappa: float, epsilon: float, scheme: Scheme) -> float:
    """Return d eps/d(step) at step 0, step in units of the contact time: the mean eps is eps + slope step, about.

    Over the phases eps jumps, and its mean oscillates with the number of steps in a contact. So phases are many, and
    the mean is taken over a whole period. What is of second order is extrapolated; three decimals are known.
    """
    contact, unit = Contact.of_law(law, kappa), law.contact_time

    def mean(steps: int) -> float:
        """Return the mean of (eps - epsilon)/step over a period that begins at some steps in an undamped contact."""
        period = unit / stepped_collision(law, kappa, 1 / steps, scheme).duration
        total = 0.0
        for i in range(_NUMBERS):
            number, offset = steps + period * i / _NUMBERS, (_OFFSET * i + 0.5) / _NUMBERS % 1
            phases = (np.arange(_PHASES) + offset) / _PHASES
            found = contact.rebounds(1.0, np.full(_PHASES, unit / number), phases, scheme)
            total += (float(found.epsilon.mean()) - epsilon) * number
        return total / _NUMBERS

    return round(2 * mean(2 * _STEPS) - mean(_STEPS), 3) + 0.0  # no -0.0


@cache
def largest_step(law: Law, kappa: float, error: float, epsilon: float, scheme: Scheme) -> float:
    """Return the largest time step, in units of the contact time, up to which the error of eps is at most `error`.

    The error is the largest relative one over the phases, looked at for steps in a geometric sequence. Below the finest
    of them it is taken to be in proportion to the step.
    """
    longest, contact = 0.0, Contact.of_law(law, kappa)
    for steps in np.split(np.geomspace(4 / _SMALL, 0.5, _LOOKED_AT), _TOGETHER):
        found = contact.rebounds(1.0, steps[:, None] * law.contact_time, PHASES, scheme).epsilon
        for step, near in zip(steps.tolist(), np.abs(found / epsilon - 1).max(axis=1).tolist(), strict=True):
            # The range over `PHASES` is nearly that over all phases, which takes three times as long.
            if not near < error / 2:
                all_phases = stepped_collision(law, kappa, step, scheme)
                off = max(abs(all_phases.least / epsilon - 1), abs(all_phases.largest / epsilon - 1))
                if off > error:
                    return longest or step * error / off
            longest = step
    return longest
