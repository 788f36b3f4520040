"""Collisions measured in real programs, as stored in the package, and what the map of their time steps predicts.

`python -m viscopade_lab.runs.simulators --write` runs the programs and writes the data.
"""

from __future__ import annotations

import csv
import io
import pkgutil
from collections.abc import Iterable
from dataclasses import asdict, dataclass, fields
from functools import cache
from typing import cast

from viscopade.collision.contact import Contact
from viscopade.simulators import simulator_of
from viscopade.simulators.formula import DampingFormula

DATA = "data/audit.csv"


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
    text = cast(bytes, pkgutil.get_data("viscopade", DATA)).decode()
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
