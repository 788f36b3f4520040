"""The text for programs whose contacts have a law of their own, by their names."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from math import sqrt

from viscopade.audit.program import DampingFormula
from viscopade.audit.programs import program_of
from viscopade.generated import marker_line, one_line, template
from viscopade.simulators.setup import SI, Units
from viscopade.simulators.soft import STEP_ERROR, SoftContact, Softness, SpeedErrors, Wanted
from viscopade.simulators.stated import program_number

VISCOELASTIC_TIME = Softness()
Numbers = dict[str, float | None]


@dataclass(frozen=True)
class SoftProgram:
    """A program whose contacts have a law of their own.

    Attributes
    ----------
    formula : str
        Name of its formula in `viscopade.audit.programs`.
    template : str
        File of the text.
    numbers : callable
        From a contact and a parameter of its formula to what the text writes.
    per_mass : bool
        Whether its stiffness is one over a mass.
    """

    formula: str
    template: str
    numbers: Callable[[SoftContact, float], Numbers]
    per_mass: bool = False

    def formula_of(self, name: str) -> DampingFormula:
        """Return the formula, of the program with a name in the audit."""
        return next(formula for formula in program_of(name).formulas if formula.name == self.formula)


def _mujoco(contact: SoftContact, parameter: float) -> Numbers:
    stiffness = contact.stiffness_over_mass
    if stiffness is None:
        raise ValueError("MuJoCo needs a stiffness: accepted is --stiffness, --contact-time or --penetration")
    return {"stiffness": stiffness, "damping": parameter * sqrt(stiffness)}


def _per_speed(contact: SoftContact, parameter: float) -> Numbers:
    return {"dissipation": parameter / contact.wanted.typical, "stiffness": contact.stiffness}


def _restitution(contact: SoftContact, parameter: float) -> Numbers:
    return {"restitution": parameter, "stiffness": contact.stiffness}


_DRAKE = "lagged, similar or tamsi, d = 3 (1 - e)/(2 v)"
_SIMBODY = "HuntCrossleyForce, calcDissipationFromObservedRestitution"
PROGRAMS = {
    "mujoco": SoftProgram("solref = -stiffness -damping", "mujoco.xml.jinja", _mujoco, per_mass=True),
    "drake": SoftProgram(_DRAKE, "drake.py.jinja", _per_speed),
    "simbody": SoftProgram(_SIMBODY, "opensim.py.jinja", _per_speed),
    "chrono": SoftProgram("SMC, Hertz", "chrono.h.jinja", _restitution),
    "jaxdem": SoftProgram("cundallstrack", "jaxdem.py.jinja", _restitution),
}
"""By name, as `viscopade.audit.programs` and the command line have it."""


def render(
    name: str,
    wanted: Sequence[Wanted],
    command: str,
    *,
    opening: Sequence[str],
    softness: Softness = VISCOELASTIC_TIME,
    time_step: float | None = None,
    step_error: float = STEP_ERROR,
    units: Units = SI,
) -> str:
    """Return the text for a program.

    Parameters
    ----------
    name : str
        One of `PROGRAMS`.
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
    program = PROGRAMS[name]
    formula = program.formula_of(name)
    contacts = []
    for each in wanted:
        contact = SoftContact(formula, each, softness, program.per_mass, time_step)
        lines = [_harmless(program, line) for line in _facts(contact, program, units, step_error)]
        contacts.append({"name": each.name, "lines": lines} | _texts(program, contact, contact.parameter))
    return template(__name__, program.template).render(
        marker=_harmless(program, marker_line(command)),
        opening=[_harmless(program, one_line("title", line)) for line in opening],
        contacts=contacts,
        units=units,
        time_step=time_step,
    )


def _harmless(program: SoftProgram, line: str) -> str:
    """Return a line that may stand in the program's comments: those of XML have no two hyphens."""
    return line.replace("--", "- -") if program.template.endswith(".xml.jinja") else line


def _texts(program: SoftProgram, contact: SoftContact, parameter: float | None) -> dict[str, str | None]:
    """Return the numbers of a contact as a program reads them."""
    numbers = {} if parameter is None else program.numbers(contact, parameter)
    return {name: None if value is None else program_number(value) for name, value in numbers.items()}


def _facts(contact: SoftContact, program: SoftProgram, units: Units, step_error: float) -> list[str]:
    """Return lines on a contact: its eps over the speeds, how long and deep it is, and its time step."""
    wanted, law = contact.wanted, contact.formula.law
    lines = [
        f"{wanted.name}: eps = {contact.epsilon:.6g} at {wanted.typical:.6g} {units.speed}, exactly; the law is "
        f"{law.equation}, kappa = {contact.kappa:.10g},",
        "  and contact ends where the force vanishes",
    ]
    if wanted.slowest < wanted.fastest:
        lines += list(_over_speeds(contact, program, units))
    elif law.nu != 2:
        lines.append("  at other speeds eps is another one: --speeds MIN:MAX states its error")
    if contact.contact_time is not None and contact.penetration is not None:
        lines.append(
            f"  contact lasts {contact.contact_time:.6g} {units.time} at the typical speed, the penetration reaches "
            f"{contact.penetration:.4g} {units.length} at the fastest"
        )
    return [*lines, *_on_steps(contact, units, step_error)]


def _over_speeds(contact: SoftContact, program: SoftProgram, units: Units) -> list[str]:
    wanted = contact.wanted
    ends = wanted.slowest, wanted.fastest
    own, theirs = ([f"{value:.6g}" for value in map(eps, ends)] for eps in (contact.delivered, wanted.epsilon))
    lines = [
        f"  eps at {ends[0]:.6g} and {ends[1]:.6g} {units.speed}: {' and '.join(own)}; of viscoelastic spheres "
        f"{' and '.join(theirs)}"
    ]
    labels = ("", "sizes with the least v*: ", "sizes with the largest v*: ")
    for label, found in zip(labels, contact.errors(), strict=False):
        between = f", up to {found.largest:.2e} between" if found.largest > max(map(abs, _ends(found))) else ""
        slow, fast = (f"{error:+.2e}" for error in _ends(found))
        lines.append(f"  {label}error of eps: {slow} at the slowest, {fast} at the fastest speed{between}")
    best = contact.balanced()
    if best is not None:
        other = {name: value for name, value in program.numbers(contact, best[0]).items() if name != "stiffness"}
        ((name, value),) = other.items()
        lines.append(f"  the largest error is smallest, {best[1]:.2e}, with the {name} {value:.6g}")
    return lines


def _ends(found: SpeedErrors) -> tuple[float, float]:
    return found.slowest, found.fastest


def _on_steps(contact: SoftContact, units: Units, step_error: float) -> list[str]:
    found, advice = contact.range, contact.advice(step_error)
    if found is not None:
        return [
            f"  with the time step {contact.time_step:.6g} {units.time}, for which the damping makes up: eps = "
            f"{found.mean:.6g} on average, {found.least:.6g} to {found.largest:.6g} in single collisions"
        ]
    if contact.formula.scheme is None:
        return []
    if advice is None:
        return ["  the longest time step is not known, as nothing says how long contact lasts"]
    return [
        f"  time steps up to {advice.largest_step:.4g} {units.time} keep eps within {step_error:g} of itself; with "
        "longer ones --time-step makes the damping fit"
    ]
