"""The text with our parameters for a simulator: of one that has the viscoelastic law, and of one with its own law."""

from __future__ import annotations

import sys
from collections.abc import Sequence
from math import sqrt

from viscopade.collision.weight import loss_slope
from viscopade.generated import harmless, marker_lines, written_template
from viscopade.simulators import simulator_with
from viscopade.simulators.setup import NO_WEIGHT, SI, Setup, Units
from viscopade.simulators.simulator import OwnLaw
from viscopade.simulators.soft import STEP_ERROR, SoftContact, Softness, SpeedErrors, Wanted
from viscopade.simulators.stated import program_number
from viscopade.theory.law import VISCOELASTIC

VISCOELASTIC_TIME = Softness()


def render(target: str, setup: Setup, command: str, **options: str) -> str:
    """Return the text for a simulator that has the viscoelastic law, or what is nearest to it.

    Parameters
    ----------
    target : str
        Its target.
    setup : Setup
        Bodies, contacts and speeds.
    command : str
        The command line that makes the text.
    **options : str
        Those of the simulator's own function, such as the tier of REBOUND's kernel.

    Raises
    ------
    ValueError
        For contacts that the simulator cannot have.
    """
    for contact in setup.contacts:
        for pair in (contact.pair, *contact.extremes):
            # Where eps is no normal number, errors relative to it would be infinite.
            if float(pair.epsilon(contact.fastest)) < sys.float_info.min:
                raise ValueError(
                    f"{contact.name}: eps is too small for double precision at the fastest impact, with v* = "
                    f"{float(pair.v_star(contact.fastest)):.3g}: expected less damping, or slower impacts"
                )
    made = simulator_with(target).texts[target]
    assert not isinstance(made, OwnLaw)
    return made(setup, command, **options)


def render_own_law(
    target: str,
    wanted: Sequence[Wanted],
    command: str,
    *,
    opening: Sequence[str],
    softness: Softness = VISCOELASTIC_TIME,
    time_step: float | None = None,
    step_error: float = STEP_ERROR,
    units: Units = SI,
) -> str:
    """Return the text for a simulator whose contacts have a law of their own.

    Parameters
    ----------
    target : str
        Its target.
    wanted : sequence of Wanted
        Its contacts.
    command : str
        The command line that makes the text.
    opening : sequence of str
        Lines at its beginning.
    softness : Softness
        Of all contacts.
    time_step : float, optional
        The damping makes up for it.
    step_error : float
        Relative error of eps for which the text states the longest time step.
    units : Units
        Of all numbers.

    Raises
    ------
    ValueError
        If a contact cannot be had.
    """
    simulator = simulator_with(target)
    own = simulator.texts[target]
    assert isinstance(own, OwnLaw)
    contacts = []
    for each in wanted:
        contact = SoftContact(simulator.formula(own.formula), each, softness, own.per_mass, time_step, own.carried)
        stiffness = contact.stiffness_over_mass if own.per_mass else contact.stiffness
        if own.per_mass and stiffness is None:
            raise ValueError(
                f"{simulator.title} needs a stiffness: expected --stiffness, --contact-time or --penetration"
            )
        assert contact.parameter is not None  # a contact without one is refused
        contacts.append(
            {
                "name": each.name,
                "lines": [harmless(line) for line in _facts(contact, own, units, step_error)],
                "stiffness": None if stiffness is None else program_number(stiffness),
                own.number: program_number(_number(contact, own, contact.parameter)),
            }
        )
    return written_template(own.template).render(
        marker=marker_lines(command),
        opening=[harmless(line) for line in opening],
        contacts=contacts,
        units=units,
        time_step=time_step,
    )


def _number(contact: SoftContact, own: OwnLaw, parameter: float) -> float:
    """Return the number that the text has for a parameter of the formula."""
    if own.per_mass:
        assert contact.stiffness_over_mass is not None
        return parameter * sqrt(contact.stiffness_over_mass)
    return parameter / contact.wanted.typical if own.per_speed else parameter


def _facts(contact: SoftContact, own: OwnLaw, units: Units, step_error: float) -> list[str]:
    """Return lines on a contact: its eps over the speeds, how long and deep it is, and its time step."""
    wanted, law = contact.wanted, contact.formula.law
    of = "without weight" if wanted.with_weight is None else "of a body that falls on a plane"
    lines = [
        f"{wanted.name}: eps = {contact.epsilon:.6g} at {wanted.typical:.6g} {units.speed} {of}; the law is "
        f"{law.equation}, kappa = {contact.kappa:.10g},",
        "  and contact ends where the force vanishes",
    ]
    if wanted.with_weight is None and wanted.slowest < wanted.fastest:
        lines += list(_over_speeds(contact, own, units))
    elif wanted.with_weight is None and law.nu != 2:
        lines.append("  at other speeds eps is another one: --speeds MIN:MAX states its error")
    if contact.contact_time is not None and contact.penetration is not None:
        lines.append(
            f"  contact lasts {contact.contact_time:.6g} {units.time} at the typical speed, the penetration reaches "
            f"{contact.penetration:.4g} {units.length} at the fastest"
        )
    return [*lines, *_on_weight(contact, units), *_on_steps(contact, units, step_error)]


def _on_weight(contact: SoftContact, units: Units) -> list[str]:
    """Return lines on the weight of a body that falls on a plane."""
    wanted, falling = contact.wanted, contact.falling
    if not wanted.gravity:
        return [f"  {NO_WEIGHT}"]
    if falling is None:
        factor = f"1 + {loss_slope(contact.formula.law):.3f} g t_c/v"
        return [f"  weight multiplies the loss 1 - eps by about {factor}; nothing says how long contact lasts"]
    note, fall = falling.sentences(wanted.slowest, wanted.fastest, units.speed, wanted.with_weight is not None)
    warning = "Warning: " if wanted.with_weight is None else ""
    return [f"  {note}", *([] if fall is None else [f"  {warning}{fall}"])]


def _over_speeds(contact: SoftContact, own: OwnLaw, units: Units) -> list[str]:
    wanted = contact.wanted
    ends = wanted.slowest, wanted.fastest
    own_values, others = ([f"{value:.6g}" for value in map(eps, ends)] for eps in (contact.delivered, wanted.epsilon))
    of = "viscoelastic spheres" if wanted.law == VISCOELASTIC else f"the law {wanted.law}"
    lines = [
        f"  eps at {ends[0]:.6g} and {ends[1]:.6g} {units.speed}: {' and '.join(own_values)}; of {of} "
        f"{' and '.join(others)}"
    ]
    labels = ("", "sizes with the least v*: ", "sizes with the largest v*: ")
    for label, found in zip(labels, contact.errors(), strict=False):
        between = f", up to {found.largest:.2e} between" if found.largest > max(map(abs, _ends(found))) else ""
        slow, fast = (f"{error:+.2e}" for error in _ends(found))
        lines.append(f"  {label}error of eps: {slow} at the slowest, {fast} at the fastest speed{between}")
    best = contact.balanced()
    if best is not None:
        number = _number(contact, own, best[0])
        lines.append(f"  the largest error is smallest, {best[1]:.2e}, with the {own.number} {number:.6g}")
    return lines


def _ends(found: SpeedErrors) -> tuple[float, float]:
    return found.slowest, found.fastest


def _on_steps(contact: SoftContact, units: Units, step_error: float) -> list[str]:
    found, advice = contact.range, contact.advice(step_error)
    if found is not None:
        return [
            f"  with the time step {contact.time_step:.6g} {units.time}, for which the damping makes up: eps = "
            f"{found.epsilon:.6g} on average, {found.least:.6g} to {found.largest:.6g} in single collisions"
        ]
    if contact.formula.scheme is None:
        return []
    if advice is None:
        return ["  the longest time step is not known, as nothing says how long contact lasts"]
    return [
        f"  time steps up to {advice.largest_step:.4g} {units.time} keep eps within {step_error:g} of itself; with "
        "longer ones --time-step makes the damping fit"
    ]
