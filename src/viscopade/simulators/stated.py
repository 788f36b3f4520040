"""Statements of the generated files about a contact: its numbers, and the error of a program's eps over its speeds."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from typing import Any

from viscopade.collision.spheres import Pair
from viscopade.generated import marker_lines
from viscopade.simulators.lammps import shortest_contact, timestep_error
from viscopade.simulators.setup import NamedContact, Setup, Units

_ROUNDING = 1e-13

STEPS = 100
"""Time steps in the shortest contact; the texts state the error of eps that they leave."""


@dataclass(frozen=True)
class ProgramErrors:
    """Relative errors of a program's eps against the viscoelastic one, eps_program/eps - 1.

    Attributes
    ----------
    slowest, fastest : float
        At the ends of the contact's range of speeds.
    extremes : tuple of tuple of float
        The same two numbers for each of the contact's extreme sizes.
    """

    slowest: float
    fastest: float
    extremes: tuple[tuple[float, float], ...] = ()

    @property
    def largest(self) -> float:
        """The largest error in absolute value."""
        return max(abs(error) for row in ((self.slowest, self.fastest), *self.extremes) for error in row)

    @property
    def lines(self) -> list[str]:
        """The errors as lines of text, to be indented after the first."""
        sizes = zip(("least", "largest"), self.extremes, strict=False)
        return [
            f"Error of eps: {_ends(self.slowest, self.fastest)}",
            *(f"  sizes with the {which} v*: {_ends(*both)}" for which, both in sizes),
        ]


def program_errors(program: Callable[[Pair, float], float], contact: NamedContact) -> ProgramErrors:
    """Return the errors of a program's eps for a pair at a speed."""

    def ends(pair: Pair) -> tuple[float, float]:
        slowest, fastest = (program(pair, v) / pair.epsilon(v) - 1 for v in (contact.slowest, contact.fastest))
        return slowest, fastest

    return ProgramErrors(*ends(contact.pair), tuple(ends(pair) for pair in contact.extremes))


@dataclass(frozen=True)
class ConstantEpsilon:
    """Constant eps for a contact: the exact one at the typical speed, and the one with the smallest maximal error.

    Attributes
    ----------
    epsilon : float
        The exact eps at the typical speed.
    errors : ProgramErrors
        What taking it at all speeds costs.
    balanced : float
        The harmonic mean of the largest and the smallest eps of the contact, extreme sizes too: no constant has a
        smaller largest relative error.
    balanced_errors : ProgramErrors
        Its errors.
    """

    epsilon: float
    errors: ProgramErrors
    balanced: float
    balanced_errors: ProgramErrors


def constant_epsilon(contact: NamedContact) -> ConstantEpsilon:
    """Return the constants for a contact."""
    typical = contact.pair.epsilon(contact.typical)
    pairs = (contact.pair, *contact.extremes)
    most = max(pair.epsilon(contact.slowest) for pair in pairs)
    least = min(pair.epsilon(contact.fastest) for pair in pairs)
    balanced = 2 * least / (1 + least / most)
    return ConstantEpsilon(
        typical,
        program_errors(lambda pair, speed: typical, contact),
        balanced,
        program_errors(lambda pair, speed: balanced, contact),
    )


def common(setup: Setup, command: str) -> dict[str, Any]:
    """Return the values that all templates need."""
    timestep = shortest_contact(setup) / STEPS
    return {
        "marker": marker_lines(command),
        "opening": setup.opening,
        "setup": setup,
        "timestep": f"{timestep:.6g}",
        "step_error": f"{largest_step_error(setup, timestep):.1e}",
        "steps": STEPS,
        "number": program_number,
    }


def facts(contact: NamedContact, units: Units) -> list[str]:
    """Return lines on a contact, without comment marks: effective numbers, speeds and eps, and how long it lasts."""
    pair = contact.pair
    speeds = (contact.slowest, contact.typical, contact.fastest)
    return [
        f"{contact.name}: m_eff {pair.m_eff:.6g} {units.mass}, R_eff {pair.R_eff:.6g} {units.length},",
        f"  E_eff {pair.E_eff:.6g} {units.mass}/({units.length} {units.time}^2), A {pair.A:.6g} {units.time}, "
        f"beta {pair.beta:.6g} {units.beta}",
        f"  speeds (slowest, typical, fastest): {', '.join(f'{v:.6g}' for v in speeds)} {units.speed}",
        f"  exact eps at them: {', '.join(f'{pair.epsilon(v):.8f}' for v in speeds)}",
        f"  the fastest contact lasts {pair.contact_time(contact.fastest):.6g} {units.time}",
    ]


def largest_step_error(setup: Setup, timestep: float) -> float:
    """Return the largest error of the viscoelastic law's eps by a time step, over all contacts.

    LIGGGHTS, YADE and MercuryDPM step as LAMMPS does: what they compute agrees with its scheme to all digits.
    """
    return max(timestep_error(contact, timestep) for contact in setup.contacts)


def _ends(slowest: float, fastest: float) -> str:
    return f"{_signed(slowest)} at the slowest, {_signed(fastest)} at the fastest speed"


def _signed(error: float) -> str:
    """Return an error as text; what is left of the same law twice is rounding."""
    return "0" if abs(error) < _ROUNDING else f"{error:+.2e}"


def program_number(number: float) -> str:
    """Return a number as a program reads it: 12 digits, which do not depend on the last bit of a math library."""
    return f"{number:.12g}"
