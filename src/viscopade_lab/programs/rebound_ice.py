"""A box of ice particles in REBOUND with our coefficient of restitution: what bounced how, and what it cost.

1000 spheres of ice, radii from 2.5 cm to 25 cm (their number falls with R^-3), fly through a periodic box without
gravity and cool down. beta is the paper's for a ball of 2.75 cm at a wall (its measured ice), so A follows, and from A
and the sizes beta of each pair. Three things are measured:

1. what happened: every collision's speed before and after, from the particles' velocities, against `Pair.epsilon` of
   these two particles, with REBOUND's callback (one beta) and with the `collision_resolve` of the generated file;
2. the box's kinetic energy, and whether the collisions account for what is lost;
3. the cost: the time in `collision_resolve` (which calls the callback) during runs, as a share of them, with several
   ways to have a coefficient of restitution, in turn.

Needs the Python package `rebound` and a C compiler. Run as `python -m viscopade_lab.programs.rebound_ice`, or with
`--format json`.
"""

from __future__ import annotations

import ctypes
import importlib
import importlib.util
import os
import shutil
import statistics
import subprocess
import tempfile
import time
from collections.abc import Callable
from pathlib import Path
from typing import Any

import click
import numpy as np
from rich.table import Table

from viscopade import restitution
from viscopade.arrays import double
from viscopade.arrays.checked import FloatArray
from viscopade.collision.spheres import Pair, Sphere, beta_si_from_cgs, v_star
from viscopade.simulators import rebound as ours
from viscopade.simulators.setup import Contact, Setup
from viscopade.theory.paper import BETA_ICE_CGS
from viscopade_lab.script import command, console, rounds

MATERIAL = {"young_modulus": 1e10, "poisson_ratio": 0.3}
DENSITY = 917.0
MEASURED_RADIUS = 0.0275  # m: the ball of the measurements that the paper's beta is for
SMALLEST, LARGEST = 0.025, 0.25  # m
FRACTION = 0.25  # of the box that is filled
SPREAD = 0.01  # m/s: standard deviation of each component of the velocities
STEP = 0.05  # s
CLOCK_CALLS = 10_000
SAVED = 10  # times at which the energy is looked at
NAME = "ice"

DRIVER = Path(__file__).with_name("rebound_driver.c")

Installer = Callable[[Any], None]


def ball(radius: float) -> Sphere:
    """Return a ball of ice with the A that the paper's beta gives."""
    wall = Sphere.wall(**MATERIAL, dissipative_constant=0.0)
    measured = Sphere(radius=MEASURED_RADIUS, density=DENSITY, **MATERIAL, dissipative_constant=0.0)
    a = Pair(measured, wall).dissipative_constant(float(beta_si_from_cgs(float(BETA_ICE_CGS))))
    return Sphere(radius=radius, density=DENSITY, **MATERIAL, dissipative_constant=float(a))


def setup() -> Setup:
    """Return the ice with the median particle as the typical one."""
    median = float(np.median(radii(1001)))
    typical, small, large = (Pair(ball(r), ball(r)) for r in (median, SMALLEST, LARGEST))
    contact = Contact("ice", "ice", typical, 1e-4, 5e-3, 5e-2, (large, small))
    return Setup("a box of ice particles", {"ice": ball(median)}, (contact,))


def radii(n: int) -> FloatArray:
    """Return radii whose number falls with R^-3, the largest first."""
    share = (np.arange(n) + 0.5) / n
    found: FloatArray = np.sort((SMALLEST**-2 - share * (SMALLEST**-2 - LARGEST**-2)) ** -0.5)[::-1]
    return found


def places(sizes: FloatArray, box: float, rng: np.random.Generator) -> FloatArray:
    """Return random places in a periodic box where no spheres overlap, one after the other."""
    found = np.empty((len(sizes), 3))
    for i, size in enumerate(sizes):
        while True:
            candidate = rng.uniform(-box / 2, box / 2, 3)
            apart = np.abs(found[:i] - candidate)
            apart = np.minimum(apart, box - apart)
            if ((apart**2).sum(axis=1) > (sizes[:i] + size) ** 2).all():
                found[i] = candidate
                break
    return found


class ParticleBox:
    """The same box of particles at the start of every run."""

    def __init__(self, program: Any, number: int) -> None:
        rng = np.random.default_rng(1)
        self._program = program
        self._radii = radii(number)
        self._masses = ball(1.0).mass * self._radii**3
        self._box = float((4 / 3 * np.pi * (self._radii**3).sum() / FRACTION) ** (1 / 3))
        self._places = places(self._radii, self._box, rng)
        self._velocities = rng.normal(scale=SPREAD, size=(number, 3))
        self._velocities -= self._masses @ self._velocities / self._masses.sum()

    def simulation(self) -> Any:
        """Return a simulation."""
        sim = self._program.Simulation()
        sim.integrator, sim.gravity, sim.collision, sim.boundary = "leapfrog", "none", "tree", "periodic"
        sim.root_size, sim.dt, sim.rand_seed = self._box, STEP, 1
        sim.N_ghost_x = sim.N_ghost_y = sim.N_ghost_z = 1
        for m, r, place, velocity in zip(self._masses, self._radii, self._places, self._velocities, strict=True):
            x, y, z = place
            vx, vy, vz = velocity
            sim.add(m=m, r=r, x=x, y=y, z=z, vx=vx, vy=vy, vz=vz)
        return sim


def energy(sim: Any) -> float:
    """Return the kinetic energy, in J."""
    return float(sum(p.m * (p.vx**2 + p.vy**2 + p.vz**2) / 2 for p in sim.particles))


def address(function: Any) -> int:
    """Return where a compiled function is: REBOUND takes that for the function itself."""
    return int(ctypes.cast(function, ctypes.c_void_p).value or 0)


class Files:
    """The generated files in a directory, compiled together with the driver."""

    def __init__(self, directory: Path, program: Any) -> None:
        compiler = shutil.which(os.environ.get("CC", "cc"))
        if compiler is None:
            raise click.ClickException("there is no C compiler: CC is not set and there is no cc")
        for language, end in (("c", "c"), ("python", "py")):
            text = ours.render(setup(), "python -m viscopade_lab.programs.rebound_ice", language)
            (directory / f"{NAME}.{end}").write_text(text, encoding="utf-8")
        (directory / "driver.c").write_text(DRIVER.read_text(encoding="utf-8"), encoding="utf-8")
        header = Path(program.__path__[0]).parent / "src"
        library = directory / "driver.so"
        flags = ["-std=gnu99", "-O3", "-march=native", "-shared", "-fPIC", "-isystem", str(header)]
        subprocess.run([compiler, *flags, "-o", library, directory / "driver.c", "-lm"], check=True)
        self.driver = ctypes.CDLL(str(library))
        self.driver.of_clock.restype = ctypes.c_double
        self._library = library
        self._program = program
        spec = importlib.util.spec_from_file_location(NAME, directory / f"{NAME}.py")
        if spec is None or spec.loader is None:
            raise click.ClickException("the generated module cannot be loaded")
        self._module = importlib.util.module_from_spec(spec)
        spec.loader.exec_module(self._module)

    def compiled(self, by_pair: bool) -> Installer:
        """Return what gives a simulation our compiled functions."""
        return lambda sim: self._module.install(sim, by_pair=by_pair, library=self._library)

    def python(self, by_pair: bool) -> Installer:
        """Return what gives a simulation our Python functions."""
        return lambda sim: self._module.install(sim, by_pair=by_pair)

    def constant(self, eps: float) -> Installer:
        """Return what gives a simulation a constant eps, in C."""
        ctypes.c_double.in_dll(self.driver, "constant_eps").value = eps

        def install(sim: Any) -> None:
            sim.collision_resolve = address(self._program.clibrebound.reb_collision_resolve_hardsphere)
            sim.coefficient_of_restitution = address(self.driver.constant)

        return install

    def as_documented(self) -> Installer:
        """Return what gives a simulation a Python callback, and hard spheres by their name."""
        beta = setup().contacts[0].pair.beta

        def install(sim: Any) -> None:
            # What the name "hardsphere" does; but this way the reference to it can be kept.
            sim.collision_resolve = self._program.clibrebound.reb_collision_resolve_hardsphere
            sim.coefficient_of_restitution = lambda _, v: float(restitution(abs(v), beta))

        return install

    def logged(self, sim: Any, size: int) -> FloatArray:
        """Record a simulation's collisions from now on; return the table that is filled."""
        table = np.full((size, 6), np.nan)
        ctypes.c_void_p.in_dll(self.driver, "bounces").value = table.ctypes.data
        ctypes.c_size_t.in_dll(self.driver, "bounces_n").value = 0
        ctypes.c_size_t.in_dll(self.driver, "bounces_size").value = size
        self._around(sim, self.driver.logged)
        return table

    def timed(self, sim: Any) -> None:
        """Time a simulation's collisions from now on."""
        for name in ("spent", "calls"):
            ctypes.c_int64.in_dll(self.driver, name).value = 0
        self._around(sim, self.driver.timed)

    def spent(self) -> float:
        """Return the seconds in `collision_resolve`, without those for looking at the clock."""
        spent, calls = (ctypes.c_int64.in_dll(self.driver, name).value for name in ("spent", "calls"))
        return (spent - calls * float(self.driver.of_clock(CLOCK_CALLS))) * 1e-9

    def _around(self, sim: Any, outer: Any) -> None:
        """Put a function of the driver around the one that resolves collisions."""
        ctypes.c_void_p.in_dll(self.driver, "inner").value = address(sim._collision_resolve)
        self._kept = getattr(sim, "_colrfp", None)  # a Python callback is freed when REBOUND drops its reference
        sim.collision_resolve = address(outer)


# --- what happened ----------------------------------------------------------------------------------------------------


def happened(files: Files, box: ParticleBox, install: Installer, steps: int) -> dict[str, Any]:
    """Run, and compare every collision with the exact eps, of its pair and of the typical pair."""
    sim = box.simulation()
    install(sim)
    table = files.logged(sim, 200 * len(sim.particles))
    energies = [energy(sim)]
    for _ in range(SAVED):
        sim.steps(steps // SAVED)
        energies.append(energy(sim))
    number = int(sim.collisions_log_n)
    if number > len(table):
        raise click.ClickException(f"{number} collisions, more than could be recorded")
    before, after, r1, r2, m1, m2 = table[:number].T
    reduced = m1 * m2 / (m1 + m2)
    lost = float((reduced / 2 * (before**2 - after**2)).sum())
    eps = after / before
    of_pair = double.epsilon(v_star(before, betas(r1, r2)))
    typical = setup().contacts[0].pair.epsilon(before)
    return {
        "collisions": number,
        "speeds": [float(q) for q in np.quantile(before, [0, 0.05, 0.5, 0.95, 1])],
        "epsilon": [float(eps.min()), float(eps.mean()), float(eps.max())],
        "from_typical": float((np.abs(eps - typical) / np.minimum(typical, 1 - typical)).max()),
        "from_pair": float((np.abs(eps - of_pair) / np.minimum(of_pair, 1 - of_pair)).max()),
        "from_pair_absolute": float(np.abs(eps - of_pair).max()),
        "from_pair_median": float(np.median(np.abs(eps - of_pair))),
        "energy_per_particle": [e / len(sim.particles) for e in energies],
        "energy_unaccounted": abs(energies[0] - energies[-1] - lost) / lost,
    }


def betas(r1: FloatArray, r2: FloatArray) -> FloatArray:
    """Return beta of each pair, from `Pair`."""
    spheres = {r: ball(r) for r in {*r1.tolist(), *r2.tolist()}}
    return np.array([Pair(spheres[a], spheres[b]).beta for a, b in zip(r1.tolist(), r2.tolist(), strict=True)])


# --- cost -------------------------------------------------------------------------------------------------------------


def run(files: Files, box: ParticleBox, install: Installer, steps: int) -> tuple[float, float, int]:
    """Return the seconds of a run, those in `collision_resolve`, and the number of collisions."""
    sim = box.simulation()
    install(sim)
    files.timed(sim)
    begin = time.perf_counter()
    sim.steps(steps)
    seconds = time.perf_counter() - begin
    return seconds, files.spent(), int(sim.collisions_log_n)


def costs(
    files: Files, box: ParticleBox, ways: dict[str, Installer], steps: int, rounds: int
) -> dict[str, dict[str, float]]:
    """Return times by way: the run's median; the least time for collisions, as interruptions only add; its share."""
    runs: dict[str, list[tuple[float, float, int]]] = {way: [] for way in ways}
    for _ in range(rounds):
        for way, install in ways.items():
            runs[way].append(run(files, box, install, steps))
    return {way: _cost(found) for way, found in runs.items()}


def _cost(runs: list[tuple[float, float, int]]) -> dict[str, float]:
    seconds, spent = statistics.median(row[0] for row in runs), min(row[1] for row in runs)
    number = runs[0][2]
    return {"run_s": seconds, "collisions": number, "collision_ns": spent / number * 1e9, "share": spent / seconds}


# --- all --------------------------------------------------------------------------------------------------------------


def measure(particles: int, steps: int, rounds: int) -> dict[str, Any]:
    """Return everything as JSON-able data."""
    program = importlib.import_module("rebound")
    box = ParticleBox(program, particles)
    with tempfile.TemporaryDirectory() as directory:
        files = Files(Path(directory), program)
        one, by_pair = (happened(files, box, files.compiled(which), steps) for which in (False, True))
        ways = {
            "constant eps, in C": files.constant(by_pair["epsilon"][1]),
            "callback, compiled (one beta)": files.compiled(False),
            "resolve, compiled (by pair)": files.compiled(True),
            "callback, Python (one beta)": files.python(False),
            "resolve, Python (by pair)": files.python(True),
            '"hardsphere", Python callback': files.as_documented(),
        }
        return {
            "rebound": program.__version__,
            "particles": particles,
            "steps": steps,
            "rounds": rounds,
            "kernel": ours.callback_kernel("1e-5").name,
            "stated": float(ours.callback_kernel("1e-5").bound),
            "callback": one,
            "resolve": by_pair,
            "cost": costs(files, box, ways, steps, rounds),
        }


def show(result: dict[str, Any]) -> None:
    """Print the result for people."""
    accuracy = Table("", "callback (one beta)", "resolve (by pair)", title="what happened")
    both = [result["callback"], result["resolve"]]
    accuracy.add_row("collisions", *(f"{one['collisions']}" for one in both))
    accuracy.add_row("speeds, mm/s: 5 %, median, 95 %", *(_three(one["speeds"][1:4], 1e3) for one in both))
    accuracy.add_row("eps: least, mean, largest", *(_three(one["epsilon"], 1) for one in both))
    for key, text in (
        ("from_typical", "|eps - exact, typical pair| / min(eps, 1 - eps), largest"),
        ("from_pair", "|eps - exact, this pair| / min(eps, 1 - eps), largest"),
        ("from_pair_absolute", "|eps - exact, this pair|, largest"),
        ("from_pair_median", "|eps - exact, this pair|, median"),
        ("energy_unaccounted", "energy that is lost elsewhere, as a share of what is lost"),
    ):
        accuracy.add_row(text, *(f"{one[key]:.2g}" for one in both))
    kinetic = Table("time, s", "callback (one beta)", "resolve (by pair)", title="kinetic energy per particle, J")
    pairs = zip(*(one["energy_per_particle"] for one in both), strict=True)
    for i, values in enumerate(pairs):
        kinetic.add_row(f"{i * (result['steps'] // SAVED) * STEP:g}", *(f"{value:.4g}" for value in values))
    cost = Table("way", "a collision, ns", "collisions", "run, s", "share of the run", title="cost")
    for way, row in result["cost"].items():
        nanoseconds, seconds = f"{row['collision_ns']:.0f}", f"{row['run_s']:.3f}"
        cost.add_row(way, nanoseconds, f"{row['collisions']}", seconds, f"{row['share']:.3%}")
    head = f"REBOUND {result['rebound']}, {result['particles']} particles, {result['steps']} steps of {STEP} s"
    console().print(f"{head}; {result['kernel']} states {result['stated']:.3g}", accuracy, kinetic, cost, sep="\n")


def _three(values: list[float], scale: float) -> str:
    return ", ".join(f"{value * scale:.3g}" for value in values)


PARTICLES = click.option("--particles", type=click.IntRange(10), default=1000, show_default=True)
STEPS = click.option("--steps", type=click.IntRange(SAVED), default=500, show_default=True, help=f"Of {STEP} s.")
main = command(measure, show, PARTICLES, STEPS, rounds(3, "Runs of each way, in turn."), needs="rebound")


if __name__ == "__main__":
    main()
