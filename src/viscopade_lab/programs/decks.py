"""Decks in LAMMPS and REBOUND: boxes of soft spheres that cool, beside the granular gas.

`viscopade simulators lammps SCENE.toml --deck` and its like are run as they stand, LAMMPS with one and with two
processes. Columns: T/T_0 at a time in mean collision times of the start; by quadrature for Maxwellian velocities
(`gas.maxwellian`) with the dilute gas's collisions, Enskog's factor included in the unit of time; and T/T_0 of the
programs, means over seeds with their standard errors.

Run as `python -m viscopade_lab.programs.decks`; it needs `lmp` and `mpirun`, and the Python package `rebound`.
"""

from __future__ import annotations

import math
import os
import re
import runpy
import shutil
import statistics
import subprocess
import sys
import tempfile
from collections.abc import Mapping, Sequence
from pathlib import Path

import click
import numpy as np

from viscopade.scene import units
from viscopade.scene.read import from_toml
from viscopade.simulators import gas
from viscopade.simulators.deck import Box, Deck, deck_text
from viscopade.simulators.setup import Setup
from viscopade_lab.programs import lammps_collisions
from viscopade_lab.studies.laws import markdown

SCENE = """
title = "Soft spheres"
tolerance = { epsilon = 1e-3 }
[material.rubber]
young_modulus = "10 MPa"
poisson_ratio = 0.45
density = "1000 kg/m^3"
restitution = { epsilon = 0.7, speed = "10 cm/s", radius = "1 mm" }
[body.ball]
material = "rubber"
radius = "1 mm"
[speed]
min = "1 mm/s"
max = "50 cm/s"
[gas]
volume_fraction = 0.05
"""
TIMES = (1.0, 2.0, 5.0)
PARTICLES = 512
SEEDS = (1, 2, 3, 4)
MORE = 16  # seeds of the programs that are quick
SETTLING = 3.0
_BETWEEN = 20  # steps
_CELL = re.compile(r"^ *\d+ +([\d.e+-]+) +([\d.e+-]+) *$", re.MULTILINE)
_PAIR = re.compile(r"^([\d.e+-]+) ([\d.e+-]+)$", re.MULTILINE)

Curve = tuple[np.ndarray, np.ndarray]


def setups() -> tuple[Setup, Setup]:
    """Return the setup of the scene, and that with classes of sizes."""
    scene = from_toml(SCENE, "soft.toml")
    return units.setup(scene), units.sized_setup(scene)


def text(target: str, deck: Deck) -> str:
    """Return a deck of the scene."""
    return deck_text(target, *setups(), f"viscopade simulators {target} soft.toml --deck", deck)


def of_lammps(deck: Deck, processes: int = 1) -> Curve:
    """Return times and temperatures of LAMMPS, or raise RuntimeError if it is not there or fails."""
    program = lammps_collisions.program()
    if program is None:
        raise RuntimeError(lammps_collisions.MISSING)
    words = [program, "-in", "deck.in", "-log", "none"]
    if processes > 1:
        launcher = shutil.which("mpirun", path=str(Path(program).parent)) or shutil.which("mpirun")
        if launcher is None:
            raise RuntimeError("there is no program mpirun")
        words = [launcher, "-np", str(processes), *words]
    printed = _run(words, "deck.in", text("lammps", deck))
    if f" on {processes} procs " not in printed:  # an mpirun of another MPI starts several runs of one process
        raise RuntimeError(f"lmp has not run with {processes} processes")
    return _curve(_CELL.findall(printed)[1:])  # the first is before the velocities are scaled


def of_rebound(deck: Deck) -> Curve:
    """Return times and temperatures of REBOUND, or raise RuntimeError if it is not there or fails."""
    return _curve(_PAIR.findall(_run([sys.executable, "deck.py"], "deck.py", text("rebound-python", deck))))


def settled(deck: Deck) -> Curve:
    """Return times and temperatures of REBOUND after `SETTLING` collision times without loss: the lattice is gone."""
    with tempfile.TemporaryDirectory() as folder:
        path = Path(folder) / "deck.py"
        path.write_text(text("rebound-python", deck), "utf-8")
        names = runpy.run_path(str(path))
    sim, step, start = names["box"](), names["STEP"], names["TEMPERATURE"]
    sim.collision_resolve = "hardsphere"  # eps = 1
    sim.steps(math.ceil(SETTLING * Box(setups()[1], deck).collision_time / step))
    factor = math.sqrt(start / names["temperature"](sim))
    for particle in sim.particles:
        particle.vx, particle.vy, particle.vz = (factor * v for v in (particle.vx, particle.vy, particle.vz))
    names["install"](sim)
    begin, found = sim.t, [(0.0, 1.0)]
    for _ in range(math.ceil(names["STEPS"] / _BETWEEN)):
        sim.steps(_BETWEEN)
        found.append((sim.t - begin, names["temperature"](sim) / start))
    times, temperatures = np.array(found).T
    return times, temperatures


def of_gas(deck: Deck) -> Curve:
    """Return times and temperatures of the simulated granular gas, which has no volume."""
    plain, sized = setups()
    box = Box(sized, deck)
    found = gas.cool(
        plain.contacts[0].pair.epsilon,
        particles=box.number,
        temperature=box.temperature,
        time=deck.collisions,
        seed=deck.seed,
    )
    return found.times * box.collision_time, found.temperatures / box.temperature


def _run(words: Sequence[str], name: str, content: str) -> str:
    with tempfile.TemporaryDirectory() as folder:
        (Path(folder) / name).write_text(content, "utf-8")
        settings = {**os.environ, "OMP_NUM_THREADS": "1"}
        done = subprocess.run(words, cwd=folder, env=settings, capture_output=True, text=True, check=False)
    if done.returncode:
        raise RuntimeError(f"{words[0]}: {(done.stdout + done.stderr)[-500:]}")
    return done.stdout


def _curve(rows: Sequence[tuple[str, str]]) -> Curve:
    times, temperatures = np.array(rows, float).T
    return times, temperatures / temperatures[0]


def predicted(times: Sequence[float], deck: Deck) -> list[float]:
    """Return T/T_0 by quadrature, at times in mean collision times of the start."""
    plain, sized = setups()
    pair, start = plain.contacts[0].pair, Box(sized, deck).temperature
    found = gas.maxwellian(pair.epsilon, np.array(times), temperature=start)
    return [float(value) for value in found / start]


def at(curve: Curve, times: Sequence[float], deck: Deck) -> list[float]:
    """Return T/T_0 of a program at times in mean collision times of the start."""
    unit = Box(setups()[1], deck).collision_time
    found = np.interp(np.array(times) * unit, *curve)
    return [float(value) for value in found]


def table(curves: Mapping[str, Sequence[Curve]], deck: Deck) -> str:
    """Return the table in Markdown: one row a program, means and standard errors over seeds."""
    rows = [["quadrature", *(f"{value:.4f}" for value in predicted(TIMES, deck))]]
    for name, runs in curves.items():
        columns = zip(*(at(curve, TIMES, deck) for curve in runs), strict=True)
        rows.append([name, *(_mean(values) for values in columns)])
    return markdown(["$T/T_0$ at t =", *(f"{time:g}" for time in TIMES)], rows)


def _mean(values: Sequence[float]) -> str:
    error = statistics.stdev(values) / math.sqrt(len(values)) if len(values) > 1 else 0.0
    return f"{statistics.fmean(values):.4f} +- {error:.4f}"


@click.command()
def main() -> None:
    """Run the decks with several seeds, and print the table."""
    decks = [Deck(PARTICLES, 0.05, seed, TIMES[-1]) for seed in SEEDS]
    more = [Deck(PARTICLES, 0.05, seed, TIMES[-1]) for seed in range(1, MORE + 1)]
    try:
        curves = {
            "LAMMPS": [of_lammps(deck) for deck in decks],
            "LAMMPS, two processes": [of_lammps(deck, 2) for deck in decks],
            "REBOUND": [of_rebound(deck) for deck in more],
            "REBOUND, without the lattice": [settled(deck) for deck in more],
            "gas, simulated": [of_gas(deck) for deck in more],
        }
    except RuntimeError as error:
        raise click.ClickException(str(error)) from None
    click.echo(table(curves, decks[0]))


if __name__ == "__main__":
    main()
