"""The collisions of the audit that every simulator runs: requested eps, time steps and phases; what was measured.

`python -m viscopade_lab.runs.simulators --write` runs the programs and writes the data.
"""

from __future__ import annotations

import csv
import io
import pkgutil
from collections.abc import Iterable, Iterator
from dataclasses import asdict, dataclass, fields
from functools import cache
from typing import cast

from mpmath import mp

from viscopade.collision.contact import Contact
from viscopade.simulators import simulator_of
from viscopade.simulators.audit import audited
from viscopade.simulators.formula import DampingFormula, same

DATA = "data/audit.csv"
ASKED = ("0.9", "0.5", "0.3")
TIME_STEPS = (0.1, 0.02, 0.001)
PHASES = (0.25, 0.75)
FINEST_PHASES = (0.5,)
WANTED = "0.5"
INSTEAD = ((0.001, (0.5,)), (0.02, tuple((i + 0.5) / 8 for i in range(8))))
"""Time steps and phases that test the value to set instead."""


@dataclass(frozen=True)
class AuditCase:
    """A collision of the audit: a formula, the requested eps, a time step in contact times, and a phase.

    `parameter` is the value that the formula gives for the requested eps.
    """

    formula: DampingFormula
    asked: str
    time_step: float
    phase: float
    parameter: float

    def seconds(self, k: float, mass: float = 1.0) -> float:
        """Return the time step of a contact with the elastic force k x^a and the impact speed 1."""
        law = self.formula.law
        return self.time_step * law.contact_time * law.time_scale(1.0, k=k, mass=mass)

    @property
    def number_of_steps(self) -> int:
        """The number of steps after which the bodies have separated."""
        return round(12 / self.time_step) + 10


def case(formula: DampingFormula, asked: str, time_step: float, phase: float) -> AuditCase:
    """Return a case with the parameter from the program's own formula."""
    with mp.workdps(20):
        return AuditCase(formula, asked, time_step, phase, float(formula.written(mp.mpf(asked))))


def cases(program: str, left_out: frozenset[str] = frozenset()) -> Iterator[AuditCase]:
    """Yield the cases of a program, except for the formulas in `left_out`."""
    for formula in simulator_of(program).formulas:
        if formula.name not in left_out:
            for asked in ASKED:
                for step in TIME_STEPS if formula.scheme else TIME_STEPS[-1:]:
                    for phase in FINEST_PHASES if step == min(TIME_STEPS) else PHASES:
                        yield case(formula, asked, step, phase)


def cases_instead(program: str, left_out: frozenset[str] = frozenset()) -> Iterator[AuditCase]:
    """Yield the cases that ask a program for the eps whose parameter gives `WANTED`.

    The first is for fine time steps; the others, over the phases, compensate for the time step.
    """
    found = simulator_of(program)
    for formula in found.formulas:
        if formula.name not in left_out and (formula.written is same or formula.reason != "exact"):
            for step, phases in INSTEAD if formula.scheme else INSTEAD[:1]:
                instead = audited(found, formula, WANTED, step).instead
                asked = None if instead is None else asked_for(formula, instead)
                for phase in () if asked is None else phases:
                    yield case(formula, f"{asked:.9g}", step, phase)


def asked_for(formula: DampingFormula, number: float) -> float | None:
    """Return the eps from 0.001 to 1 whose parameter is a number, or None."""
    with mp.workdps(20):
        low, high = mp.mpf("0.001"), mp.mpf(1)
        at_low, at_high = formula.written(low), formula.written(high)
        if not min(at_low, at_high) <= number <= max(at_low, at_high):
            return None
        for _ in range(40):
            middle = (low + high) / 2
            before = (formula.written(middle) < number) == (at_low < at_high)
            low, high = (middle, high) if before else (low, middle)
        return float(high)


@dataclass(frozen=True)
class Measurement:
    """A collision in a program.

    Attributes
    ----------
    program, formula : str
        Their names in `viscopade.simulators`.
    version : str
        What the program says of itself.
    asked : str
        The wanted eps, of which the formula made the damping.
    time_step : float
        In units of the undamped contact time.
    phase : float
        Where in the first step contact began, from 0 to 1.
    epsilon : float
        What came out.
    """

    program: str
    formula: str
    version: str
    asked: str
    time_step: float
    phase: float
    epsilon: float

    @property
    def of(self) -> DampingFormula:
        """The formula."""
        return simulator_of(self.program).formula(self.formula)

    @property
    def predicted(self) -> float:
        """Eps by the map of the program's steps, at this step and phase."""
        formula = self.of
        if formula.scheme is None:
            return float(formula.delivered(formula.damping(self.asked)))
        contact = Contact.of_law(formula.law, float(formula.damping(self.asked)))
        step = self.time_step * formula.law.contact_time
        return contact.collide(step=step, scheme=formula.scheme, phases=[self.phase]).epsilon


@cache
def measurements() -> tuple[Measurement, ...]:
    """Return what is stored."""
    text = cast(bytes, pkgutil.get_data("viscopade_lab", DATA)).decode()
    return tuple(
        Measurement(
            row["program"],
            row["formula"],
            row["version"],
            row["asked"],
            *(float(row[name]) for name in ("time_step", "phase", "epsilon")),
        )
        for row in csv.DictReader(io.StringIO(text))
    )


def finest(program: str, formula: str, asked: str) -> Measurement | None:
    """Return what was measured with the shortest time step, or None."""
    found = (each for each in measurements() if (each.program, each.formula, each.asked) == (program, formula, asked))
    return min(found, key=lambda each: each.time_step, default=None)


def csv_text(found: Iterable[Measurement]) -> str:
    """Return the text of the data file."""
    stream = io.StringIO()
    table = csv.DictWriter(stream, [field.name for field in fields(Measurement)], lineterminator="\n")
    table.writeheader()
    table.writerows(asdict(each) for each in found)
    return stream.getvalue()
