"""Collisions in programs for the audit: it runs those that are installed, and keeps the stored values of the others.

Run as `python -m viscopade_lab.programs.audit`, which prints the largest differences between what is measured and what
the map of time steps predicts, or with `--write`, which writes the package's data file as well.
"""

from __future__ import annotations

from collections.abc import Iterable, Iterator
from pathlib import Path

import click

import viscopade
from viscopade.audit import measured
from viscopade.audit.measured import Measurement
from viscopade_lab.programs import (
    drake_collisions,
    kratos_collisions,
    lammps_collisions,
    liggghts_collisions,
    mujoco_collisions,
    opensim_collisions,
    rebound_collisions,
)

RUNNERS = {
    "lammps": lammps_collisions.audit_measurements,
    "liggghts": liggghts_collisions.audit_measurements,
    "mujoco": mujoco_collisions.audit_measurements,
    "drake": drake_collisions.audit_measurements,
    "kratos": kratos_collisions.audit_measurements,
    "rebound": rebound_collisions.audit_measurements,
    "simbody": opensim_collisions.audit_measurements,
}
"""For each program a function that yields its measurements, and raises RuntimeError if the program is not there."""


def anew() -> Iterator[Measurement]:
    """Yield all measurements: of programs that are installed anew, of others as they are stored."""
    for name in sorted({*RUNNERS, *(each.program for each in measured.measurements())}):
        try:
            found = list(RUNNERS[name]()) if name in RUNNERS else None
        except RuntimeError as error:
            click.echo(f"{name} is not run: {error}", err=True)
            found = None
        yield from found if found is not None else (e for e in measured.measurements() if e.program == name)


def differences(found: Iterable[Measurement]) -> Iterator[tuple[str, str, float]]:
    """Yield program, formula and the largest |measured - predicted|."""
    worst: dict[tuple[str, str], float] = {}
    for each in found:
        key = each.program, each.formula
        worst[key] = max(worst.get(key, 0.0), abs(each.epsilon - each.predicted))
    yield from ((*key, value) for key, value in worst.items())


@click.command()
@click.option("--write", is_flag=True, help="Write the data file of the package.")
def main(write: bool) -> None:
    """Run the programs; print the largest difference between measured and predicted eps for each formula."""
    found = list(anew())
    for program, formula, difference in differences(found):
        click.echo(f"{program:10} {formula:50} {difference:.1e}")
    if write:
        file = Path(viscopade.__file__).parent / measured.DATA
        file.write_text(measured.csv_text(found), encoding="utf-8")
        click.echo(f"wrote {len(found)} collisions to {file.name}")


if __name__ == "__main__":
    main()
