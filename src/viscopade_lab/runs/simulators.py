"""Two spheres, or a sphere and a plane, collide in real simulators: LAMMPS, LIGGGHTS, MuJoCo, REBOUND.

Run as `python -m viscopade_lab.runs.simulators`, which runs the collisions of the audit in the simulators that are
installed, and prints the largest differences between measured and predicted eps. With
`--write` it also writes the data file; measurements of other programs stay unchanged.
"""

from __future__ import annotations

import importlib
import math
import os
import re
import runpy
import shutil
import subprocess
import sys
import tempfile
from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import click
import numpy as np

import viscopade_lab
from viscopade import Pair, Sphere
from viscopade.arrays.checked import FloatArray
from viscopade.extras import install_command
from viscopade.simulators.input_file import render
from viscopade.simulators.setup import of_pair
from viscopade_lab.runs import cases as audit
from viscopade_lab.runs.cases import AuditCase, Measurement, cases, cases_instead


def run_program(words: Sequence[str], files: Mapping[str, str]) -> str:
    """Run a program in a folder of these files, and return what it prints.

    Raises
    ------
    RuntimeError
        If it is not installed, or fails.
    """
    beside = Path(sys.executable).parent  # a package of Python installs its programs there
    path = shutil.which(words[0], path=os.pathsep.join([str(beside), os.environ.get("PATH", "")]))
    if path is None:
        raise RuntimeError(f"there is no program {words[0]}")
    with tempfile.TemporaryDirectory() as folder:
        for name, content in files.items():
            Path(folder, name).write_text(content)
        done = subprocess.run(
            [path, *words[1:]],
            cwd=folder,
            env={**os.environ, "HOME": folder, "OMP_NUM_THREADS": "1"},
            capture_output=True,
            encoding="utf-8",
            errors="replace",  # a program's messages can contain anything
            timeout=3600,
            check=False,
        )
    failed = re.search(r"^ERROR.*", done.stdout, re.MULTILINE)
    if done.returncode or failed:
        raise RuntimeError(f"{words[0]}: {failed[0] if failed else (done.stdout + done.stderr)[-500:]}")
    return done.stdout


def package(name: str) -> Any:
    """Return a simulator's Python package.

    Raises
    ------
    RuntimeError
        If it is not installed.
    """
    try:
        return importlib.import_module(name)
    except ImportError as error:
        raise RuntimeError(f"there is no Python package {name}: {install_command(name)}") from error


# --- LAMMPS -----------------------------------------------------------------------------------------------------------

_LAMMPS = """
clear
units si
atom_style sphere
atom_modify map array
boundary f f f
newton off
comm_modify vel yes
region box block {box}
create_box 1 box
{atoms}
set group all diameter {diameter}
set group all mass {mass}
neighbor {diameter} bin
pair_style granular
pair_coeff * * {style}
fix move all nve/sphere
timestep {step}
{commands}
thermo_style custom step {columns}
thermo_modify format float %.15g
thermo {every}
run {run}
"""
_SPHERES = """
set atom 1 vz {half_speed}
set atom 2 vz -{half_speed}
variable force equal abs(fz[2])
variable rebound equal (vz[2]-vz[1])/(2*{half_speed})
variable gap equal z[2]-z[1]-{diameter}
"""
_FALL = """
set atom 1 vz {velocity!r}
fix fall all gravity {gravity} vector 0 0 -1
fix floor all wall/gran granular {contact} zplane 0 NULL
variable gap equal z[1]-{radius!r}
variable speed equal vz[1]
"""
LINE = re.compile(r"^\s*[0-9]+\s+(\S+)\s+(\S+)\s*$", re.MULTILINE)
_COLLISION = re.compile(r"^collision (\S+) (\S+)$", re.MULTILINE)
FRICTIONLESS = "tangential linear_nohistory 0 0"


def lammps(script: str, **files: str) -> str:
    """Return the output of LAMMPS for a script; raise RuntimeError if it is not installed or fails."""
    return run_program(["lmp", "-in", "in.lammps", "-log", "none"], {"in.lammps": script, **files})


def lammps_version() -> str:
    """Return the version that LAMMPS prints."""
    found = re.search(r"^LAMMPS \((.*)\)$", lammps("info config\n"), re.MULTILINE)
    if found is None:
        raise RuntimeError("lmp does not say which version it is")
    return found[1]


def lammps_script(
    heights: Sequence[float],
    commands: str,
    columns: str,
    *,
    style: str,
    box: str,
    diameter: float,
    mass: float,
    step: float,
    run: int,
    every: int,
) -> str:
    """Return an input with equal spheres above each other; `every` is the number of steps between outputs."""
    atoms = "\n".join(f"create_atoms 1 single 0 0 {height!r}" for height in heights)
    numbers = {"diameter": repr(diameter), "mass": repr(mass), "step": repr(step), "run": run, "every": every}
    return _LAMMPS.format(atoms=atoms, commands=commands, columns=columns, style=style, box=box, **numbers)


def lammps_spheres(
    style: str,
    step: float,
    run: int,
    *,
    diameter: float,
    mass: float,
    speed: float = 1.0,
    phase: float = 0.5,
    every: int = 10**9,
) -> str:
    """Return the commands of one head-on collision of equal spheres; `every` is the number of steps between outputs."""
    apart, size = diameter / 2 + phase * speed * step / 2, 5 * diameter
    script = lammps_script(
        (-apart, apart),
        _SPHERES.format(half_speed=repr(speed / 2), diameter=repr(diameter)),
        "v_force v_rebound",
        style=style,
        box=f"-{size} {size} -{size} {size} -{size} {size}",
        diameter=diameter,
        mass=mass,
        step=step,
        run=run,
        every=every,
    )
    return f'{script}print "collision $(v_rebound:%.15g) $(v_gap:%.15g)"\n'


def lammps_falls(
    starts: Iterable[tuple[float, float]],
    contact: str,
    *,
    radius: float,
    mass: float,
    gravity: float,
    step: float,
    run: int,
    every: int,
) -> Iterator[tuple[FloatArray, FloatArray]]:
    """Yield gap and velocity, after `every` steps, of a sphere that falls on a plane from each gap and velocity."""
    script = "".join(
        lammps_script(
            (radius + gap,),
            _FALL.format(velocity=velocity, gravity=gravity, contact=contact, radius=radius),
            "v_gap v_speed",
            style=f"hertz 1 0 {FRICTIONLESS}",  # for pairs of spheres; there is only one sphere
            box="-0.1 0.1 -0.1 0.1 -0.1 1",
            diameter=2 * radius,
            mass=mass,
            step=step,
            run=run,
            every=every,
        )
        + 'print "end of the fall"\n'
        for gap, velocity in starts
    )
    for part in lammps(script).split("\nend of the fall")[:-1]:
        gaps, velocities = np.array(LINE.findall(part), dtype=float).T
        yield gaps, velocities


def _lammps_script(case: AuditCase) -> str:
    """Return the commands of one collision of the audit; R_eff is 1/4, m_eff 1, and the impact speed 1."""
    stiffness = 1e8
    normal, damping, *limited = case.formula.name.removesuffix(" (22 Jul 2025)").split(", ")
    k = stiffness * (0.5 if normal == "hertz" else 1)  # of k x^a, where Hertz' force is stiffness sqrt(R_eff) x^(3/2)
    number = {
        "mass_velocity": case.parameter * math.sqrt(k),
        "viscoelastic": case.parameter * k**0.6 / 0.5,
    }.get(damping, case.parameter)
    style = " ".join([normal, f"{stiffness} {number!r}", FRICTIONLESS, "damping", damping, *limited])
    return lammps_spheres(style, case.seconds(k), case.number_of_steps, diameter=1.0, mass=2.0, phase=case.phase)


def lammps_epsilons(some: Sequence[AuditCase]) -> Iterator[float]:
    """Yield the eps of cases, all in one run."""
    found = _COLLISION.findall(lammps("".join(map(_lammps_script, some))))
    if len(found) != len(some) or any(float(gap) <= 0 for _, gap in found):
        raise RuntimeError("collisions have not ended in LAMMPS")
    yield from (float(rebound) for rebound, _ in found)


# --- LIGGGHTS ---------------------------------------------------------------------------------------------------------

_LIGGGHTS_SPHERES = """
atom_style granular
atom_modify map array
boundary f f f
newton off
communicate single vel yes
units si
region box block -{box} {box} -{box} {box} -{box} {box} units box
create_box 1 box
neighbor {radius} bin
neigh_modify delay 0
{contact}
create_atoms 1 single -{apart} 0 0
create_atoms 1 single {apart} 0 0
set group all diameter {diameter} mass {mass}
set atom 1 vx {half_speed}
set atom 2 vx -{half_speed}
fix move all nve/sphere
timestep {step}
thermo {run}
run {run}
variable rebound equal (vx[2]-vx[1])/(2*{half_speed})
variable gap equal x[2]-x[1]-{diameter}
print "collision ${{rebound}} ${{gap}}"
"""
_LIGGGHTS_CONTACT = """
fix young all property/global youngsModulus peratomtype {young}
fix poisson all property/global poissonsRatio peratomtype 0
fix restitution all property/global coefficientRestitution peratomtypepair 1 {number}
fix speed all property/global characteristicVelocity scalar {characteristic}
fix kn all property/global kn peratomtypepair 1 {young}
fix kt all property/global kt peratomtypepair 1 0
fix gamman all property/global gamman peratomtypepair 1 {number}
fix gammat all property/global gammat peratomtypepair 1 0
pair_style gran model {model} tangential off limitForce {limit}
pair_coeff * *
"""


def liggghts_version() -> str:
    """Return the version that LIGGGHTS prints."""
    printed = run_program(["liggghts", "-in", "in.nothing", "-log", "none"], {"in.nothing": ""})
    found = re.search(r"Version (\S+ \S+),", printed)
    return "unknown" if found is None else found[1]


def liggghts_spheres(
    contact: str, step: float, run: int, *, radius: float, mass: float, speed: float = 1.0, phase: float = 0.0
) -> str:
    """Return an input in which two equal spheres collide, with the commands of their contact."""
    return _LIGGGHTS_SPHERES.format(
        contact=contact,
        step=repr(step),
        run=run,
        radius=repr(radius),
        diameter=repr(2 * radius),
        mass=repr(mass),
        half_speed=repr(speed / 2),
        apart=repr(radius + phase * speed * step / 2),
        box=repr(10 * radius),
    )


def liggghts(script: str, **files: str) -> float:
    """Return the eps of an input in LIGGGHTS; raise RuntimeError if it is not installed or fails."""
    printed = run_program(["liggghts", "-in", "in.collision", "-log", "none"], {"in.collision": script, **files})
    found = _COLLISION.search(printed)
    if found is None or float(found[2]) <= 0:
        raise RuntimeError("a collision has not ended in LIGGGHTS")
    return float(found[1])


def liggghts_epsilons(some: Sequence[AuditCase]) -> Iterator[float]:
    """Yield the eps of cases; R_eff is 1/4, m_eff 1, the impact speed 1, and E_eff half of `young`."""
    young, characteristic = 1e8, 2.0
    stiffness = {
        "hertz": 4 / 3 * young / 2 * 0.5,
        "hertz/stiffness": young * 0.5,
        "hooke": 16 / 15 * 0.5 * young / 2 * (15 * characteristic**2 / (16 * 0.5 * young / 2)) ** 0.2,
    }
    for case in some:
        model, *limited = case.formula.name.split(", ")
        k = stiffness[model]
        contact = _LIGGGHTS_CONTACT.format(
            model=model,
            limit="on" if limited else "off",
            young=young,
            characteristic=characteristic,
            number=repr(case.parameter * k**0.6 / 0.5 if model == "hertz/stiffness" else case.parameter),
        )
        step, run = case.seconds(k), case.number_of_steps
        yield liggghts(liggghts_spheres(contact, step, run, radius=0.5, mass=2.0, phase=case.phase))


# --- MuJoCo -----------------------------------------------------------------------------------------------------------

FREQUENCY = 100.0  # rad/s: of the undamped contact
FLAT = "0.9 0.9 0.001"
"""A `solimp` with constant impedance."""
_MUJOCO_MODEL = """
<mujoco>
  <option timestep="{step!r}" gravity="0 0 -{gravity!r}" integrator="{integrator}" cone="{cone}" impratio="{impratio}"/>
  <default><geom solref="{solref}" solimp="{solimp}" condim="{condim}" friction="{friction}"/></default>
  <worldbody>
    <geom type="plane" size="1 1 .1"/>
    <body><freejoint/><geom type="sphere" size="{radius!r}" mass="{mass!r}"/></body>
  </worldbody>
</mujoco>
"""


def mujoco_model(
    solref: str,
    step: float,
    *,
    radius: float = 0.1,
    mass: float = 3.0,
    gravity: float = 0.0,
    integrator: str = "Euler",
    solimp: str = FLAT,
    condim: int | str = 1,
    friction: str = "1 0.005 0.0001",
    cone: str = "pyramidal",
    impratio: float | str = 1,
) -> tuple[Any, Any]:
    """Return model and data of a sphere over a plane."""
    mujoco = package("mujoco")
    text = _MUJOCO_MODEL.format(
        solref=solref,
        step=step,
        radius=radius,
        mass=mass,
        gravity=gravity,
        integrator=integrator,
        solimp=solimp,
        condim=condim,
        friction=friction,
        cone=cone,
        impratio=impratio,
    )
    model = mujoco.MjModel.from_xml_string(text)
    return model, mujoco.MjData(model)


def mujoco_rebound(solref: str, step: float, phase: float = 0.5, *, speed: float = 1.0, **options: Any) -> float:
    """Return eps of a sphere that hits a plane at a speed, after a part `phase` of the first step."""
    mujoco = package("mujoco")
    model, data = mujoco_model(solref, step, **options)
    data.qpos[2], data.qvel[2] = 0.1 + phase * step * speed, -speed
    longest = data.time + 60 / FREQUENCY
    while data.qvel[2] <= 0 or data.qpos[2] <= 0.1:
        mujoco.mj_step(model, data)
        if data.time > longest:
            raise RuntimeError("a collision has not ended in MuJoCo")
    return float(data.qvel[2]) / speed


def mujoco_solref(name: str, parameter: float) -> str:
    """Return the attribute `solref` of a formula of the audit, for its parameter."""
    if name.startswith("solref = timeconst"):
        return f"{1 / (FREQUENCY * parameter)!r} {parameter!r}"
    return f"{-(FREQUENCY**2)!r} {-FREQUENCY * parameter!r}"


def mujoco_epsilons(some: Sequence[AuditCase]) -> Iterator[float]:
    """Yield the eps of cases: a sphere flies against a plane, without gravity."""
    for case in some:
        solref = mujoco_solref(case.formula.name, case.parameter)
        integrator = "RK4" if "RK4" in case.formula.name else "Euler"
        yield mujoco_rebound(solref, case.seconds(FREQUENCY**2), case.phase, integrator=integrator)


# --- REBOUND ----------------------------------------------------------------------------------------------------------

BALL = Sphere(radius=0.1, density=1000, young_modulus=1e7, poisson_ratio=0.3, dissipative_constant=0)


def rebound_epsilons(some: Sequence[AuditCase]) -> Iterator[float]:
    """Yield the eps of cases: two spheres meet at the speed 1, with a constant eps or with our Python callback."""
    rebound = package("rebound")
    for case in some:
        sim = rebound.Simulation()
        sim.integrator, sim.gravity, sim.collision, sim.dt = "leapfrog", "none", "direct", 0.01
        for side in (-1, 1):
            sim.add(m=BALL.mass, r=BALL.radius, x=1.2 * side * BALL.radius, vx=-side / 2)
        if case.formula.parameter == "kappa":
            _install_callback(sim, case.parameter)
        else:
            sim.collision_resolve = "hardsphere"
            sim.coefficient_of_restitution = lambda _, v, epsilon=case.parameter: epsilon
        for _ in range(100):
            sim.steps(1)
            speed = float(sim.particles[1].vx - sim.particles[0].vx)
            if speed > 0:
                break
        else:
            raise RuntimeError("a collision has not ended in REBOUND")
        yield speed


def _install_callback(sim: Any, beta: float) -> None:
    """Give a simulation the callback of the generated Python module, without a compiled kernel."""
    pair = Pair(BALL, BALL)
    setup = of_pair(pair.damped(float(pair.dissipative_constant(beta))), 1.0)
    with tempfile.TemporaryDirectory() as folder:
        path = Path(folder) / "audit.py"
        path.write_text(render("rebound-python", setup, "audit"), "utf-8")
        runpy.run_path(str(path))["install"](sim)


# --- all --------------------------------------------------------------------------------------------------------------


@dataclass(frozen=True)
class Simulator:
    """A simulator that runs the audit.

    Attributes
    ----------
    version : callable
        Returns the program's version; raises RuntimeError if it is not installed.
    epsilons : callable
        From cases to their eps; raises RuntimeError if a collision has not ended.
    newer : frozenset of str
        Formulas that this release does not have yet.
    """

    version: Callable[[], str]
    epsilons: Callable[[Sequence[AuditCase]], Iterator[float]]
    newer: frozenset[str] = frozenset()


SIMULATORS = {
    "lammps": Simulator(lammps_version, lammps_epsilons, frozenset({"hertz, tsuji", "hertz, tsuji, limit_damping"})),
    "liggghts": Simulator(liggghts_version, liggghts_epsilons),
    "mujoco": Simulator(lambda: str(package("mujoco").__version__), mujoco_epsilons),
    "rebound": Simulator(lambda: f"REBOUND {package('rebound').__version__}", rebound_epsilons),
}


def measurements(name: str, some: Sequence[AuditCase] | None = None) -> Iterator[Measurement]:
    """Yield the collisions of the audit in a simulator, or some of them; raise RuntimeError if it is not installed."""
    simulator = SIMULATORS[name]
    version = simulator.version()
    wanted = some or [*cases(name, simulator.newer), *cases_instead(name, simulator.newer)]
    for case, epsilon in zip(wanted, simulator.epsilons(wanted), strict=True):
        yield Measurement(name, case.formula.name, version, case.asked, case.time_step, case.phase, round(epsilon, 12))


def all_measurements() -> Iterator[Measurement]:
    """Yield all measurements: new ones of installed simulators, stored ones of others."""
    stored = audit.measurements()
    for name in sorted({each.program for each in stored}):
        anew = None
        if name in SIMULATORS:
            try:
                anew = list(measurements(name))
            except RuntimeError as error:
                click.echo(f"{name} is not run: {error}", err=True)
        yield from anew if anew is not None else (each for each in stored if each.program == name)


def differences(some: Iterable[Measurement]) -> Iterator[tuple[str, str, float]]:
    """Yield program, formula and the largest |measured - predicted|."""
    worst: dict[tuple[str, str], float] = {}
    for each in some:
        key = each.program, each.formula
        worst[key] = max(worst.get(key, 0.0), abs(each.epsilon - each.predicted))
    yield from ((*key, value) for key, value in worst.items())


@click.command()
@click.option("--write", is_flag=True, help="Write the data file.")
def main(write: bool) -> None:
    """Run the simulators; print the largest difference between measured and predicted eps for each formula."""
    found = list(all_measurements())
    for program, formula, difference in differences(found):
        click.echo(f"{program:10} {formula:50} {difference:.1e}")
    if write:
        file = Path(viscopade_lab.__file__).parent / audit.DATA
        file.write_text(audit.csv_text(found), encoding="utf-8")
        click.echo(f"wrote {len(found)} collisions to {file.name}")


if __name__ == "__main__":
    main()
