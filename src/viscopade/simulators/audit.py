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
"""The eps for which tables and figures audit a formula."""
# Relative difference of two eps that agree. Exact formulas are off by 1e-16, and the best approximate one by 2e-7.
_AGREES = 1e-9
# `largest_step` tries 64 time steps, of which neighbours differ by 10 %, in 8 groups of which one call computes all
# collisions: most searches end in the first groups. As the error does not rise evenly with the step, the answer depends
# on which steps are tried: 32 or 128 of them change it by up to a factor of 2 (measured for all laws and schemes).
_STEPS_TRIED, _STEP_GROUPS = 64, 8
# They go from 1000 steps in an undamped contact, below whose length the error is taken to be in proportion to the step,
# to 2 steps: with fewer eps depends mostly on where in a step contact begins.
_SHORTEST_STEP, _LONGEST_STEP = 1e-3, 0.5
# `step_slope` averages over 250 and 500 steps in a contact, 16 numbers of steps in a period and 512 phases. Half or
# twice as many of each change the slope by at most 0.001, its last decimal (measured for all laws and schemes).
_STEPS, _NUMBERS, _PHASES = 250, 16, 512
# Has no common divisor with _NUMBERS: so each number of steps has its own offset of the phases, in mixed order.
_OFFSET = 5


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
        How eps depends on the time step, if it was asked for.
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
        """The number of time steps in an undamped contact from which on eps depends little on the phase.

        The phase is the part of a step at which contact begins. Over it eps differs by at most `SPREAD` = 0.02, and the
        damping gives the wanted eps on average. None without a time step or damping, or if the time step is short
        enough.
        """
        law, scheme = self.formula.law, self.formula.scheme
        kappa_without_steps = float(kappa_for_epsilon(law, self.asked))
        if self.time_step is None or scheme is None or kappa_without_steps == 0:
            return None

        def scaled_contact(kappa: float) -> Contact:
            return Contact.of_law(law, kappa)

        # The factor by which contact has to last longer with the same time step; 1 if it lasts long enough.
        step, epsilon = self.time_step * law.contact_time, float(self.asked)
        factor = resolving_factor(scaled_contact, epsilon, kappa_without_steps, SPREAD, step=step, scheme=scheme)
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
    # The kappa that the program makes of the number that people write, and the eps of that contact.
    kappa, step = formula.damping(asked), None if formula.scheme is None else time_step
    delivered = formula.contact_epsilon(kappa)
    is_wrong = delivered is None or abs(delivered / mp.mpf(asked) - 1) > _AGREES
    reasons = [REASONS[formula.reason], *([formula.note] if formula.note else [])] if is_wrong else []

    # The kappa that gives the wanted eps: without time steps, or on average with them.
    right_kappa, stepped = kappa_for_epsilon(formula.law, asked), None
    if step is not None and formula.scheme is not None:
        stepped = stepped_collision(formula.law, float(kappa), step, formula.scheme)
        reasons.append(f"The time step adds {stepped.epsilon - float(delivered or 0):+.2g} on average.")
        try:
            right_kappa = kappa_in_steps(formula.law, float(asked), step, formula.scheme)
        except ValueError as error:
            right_kappa = None
            reasons.append(f"No damping gives it: {error}; expected a shorter step or a longer contact.")

    # The number to write instead is the one of which the program makes that kappa.
    instead = None if right_kappa is None else formula.parameter_of(right_kappa)
    if instead is None and right_kappa is not None:
        reasons.append(f"No {formula.parameter} in its range gives it.")
    with mp.workdps(DIGITS):
        written = float(formula.usual_parameter(mp.mpf(asked)))
    number = None if instead is None else float(instead)
    advice = None if step_error is None or delivered is None else step_advice(formula, kappa, delivered, step_error)
    return Audit(program, formula, asked, written, delivered, step, stepped, number, tuple(reasons), advice)


def step_advice(formula: DampingFormula, kappa: Any, delivered: Any, error: float) -> Advice | None:
    """Return how the eps of a formula's contact depends on the time step; None for a program without time steps.

    `kappa` is the damping of the contact, `delivered` its eps without time steps, and `error` the relative error of eps
    that the time step may cause.
    """
    if formula.scheme is None:
        return None
    largest = largest_step(formula.law, float(kappa), error, float(delivered), formula.scheme)
    return Advice(error, largest, step_slope(formula.law, float(kappa), float(delivered), formula.scheme))


@cache
def step_slope(law: Law, kappa: float, epsilon: float, scheme: Scheme) -> float:
    """Return d eps/d(step) at step 0, to three decimals, step in units of the undamped contact time.

    The mean eps of a program with a short time step is `epsilon` + slope step, where `epsilon` is the eps of the law
    with `kappa` without time steps, and `scheme` is the program's integrator.
    """
    contact, contact_time = Contact.of_law(law, kappa), law.contact_time

    # Over the phases, which are the parts of a step at which contact begins, eps jumps. Its mean oscillates with the
    # number of steps in an undamped contact, with the period of one more step in the damped contact.
    def mean_slope(steps: int) -> float:
        """Return the mean of (eps - epsilon)/step over a period that begins at `steps` in an undamped contact."""
        # One more step in the damped contact is contact_time/duration more in the undamped one.
        period = contact_time / stepped_collision(law, kappa, 1 / steps, scheme).duration
        slopes = 0.0
        for i in range(_NUMBERS):
            # The phases (k + offset)/_PHASES; over the loop the offset takes each (j + 1/2)/_NUMBERS in [0, 1) once.
            number, offset = steps + period * i / _NUMBERS, (_OFFSET * i + 0.5) / _NUMBERS % 1
            phases = (np.arange(_PHASES) + offset) / _PHASES
            rebounds = contact.rebounds(1.0, np.full(_PHASES, contact_time / number), phases, scheme)
            slopes += (float(rebounds.epsilon.mean()) - epsilon) * number
        return slopes / _NUMBERS

    # Richardson extrapolation: twice as many steps halve the error of the slope, so 2 s(2 n) - s(n) has none of first
    # order. Three decimals are what is known (see `_STEPS`), and + 0.0 makes 0.0 of -0.0.
    return round(2 * mean_slope(2 * _STEPS) - mean_slope(_STEPS), 3) + 0.0


@cache
def largest_step(law: Law, kappa: float, error: float, epsilon: float, scheme: Scheme) -> float:
    """Return the largest time step, in undamped contact times, up to which the error of eps is at most `error`.

    `epsilon` is the eps of the law with `kappa` without time steps. The error is the largest relative one over the
    phases, which are the parts of a step at which contact begins. It is computed for steps in a geometric sequence;
    below the shortest of them it is taken to be in proportion to the step.
    """
    longest, contact = 0.0, Contact.of_law(law, kappa)
    for steps in np.split(np.geomspace(_SHORTEST_STEP, _LONGEST_STEP, _STEPS_TRIED), _STEP_GROUPS):
        # One row a time step, one column a phase: contact begins at the midpoints of 64 equal parts of a step.
        epsilons = contact.rebounds(1.0, steps[:, None] * law.contact_time, PHASES, scheme).epsilon
        errors = np.abs(epsilons / epsilon - 1).max(axis=1)
        for step, error_at_64_phases in zip(steps.tolist(), errors.tolist(), strict=True):
            # The range over 64 phases is nearly that over all phases, which takes three times as long. So all phases
            # are computed only where the error at the 64 is not below half of what is allowed, or no number.
            if not error_at_64_phases < error / 2:
                all_phases = stepped_collision(law, kappa, step, scheme)
                error_at_all = max(abs(all_phases.least / epsilon - 1), abs(all_phases.largest / epsilon - 1))
                if error_at_all > error:
                    return longest or step * error / error_at_all
            longest = step
    return longest
