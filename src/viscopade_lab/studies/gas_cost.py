"""What a collision of the cooling gas costs, and how much of that is eps.

The same gas cools with each function from speed to eps. Measured are the whole run per collision, the calls for eps in
it per collision (some hundred speeds at a time), and eps alone for a million of the run's speeds at once. Rounds are
interleaved, times are the best of them, on one core. "C" are functions of exports/, compiled here; without a compiler
they are left out.

Run as `python -m viscopade_lab.studies.gas_cost`, or with `--format json`.
"""

from __future__ import annotations

import ctypes
import time
from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import click
import numpy as np
from rich.table import Table

import viscopade as vp
from viscopade.arrays.checked import FloatArray
from viscopade.collision.spheres import v_star
from viscopade.kernels import registry, toolchain
from viscopade.kernels.forms.speed_kernel import file_of
from viscopade.kernels.names import FAST
from viscopade.simulators import gas
from viscopade_lab.figures import cooling as figure
from viscopade_lab.script import command, console, rounds

EXPORTS = Path(__file__).parents[3] / "exports"
BETA = figure.BETA
TIERS = ("1e-3", "1e-5", "full")
TIME = 100.0  # of the run: some twenty collisions per particle
AT_ONCE = 1_000_000

_C = """
#include <stddef.h>
{includes}
{loops}
"""
_ARRAY = """
void run_{i}(size_t n, const double *speed, double beta, double *out);
void run_{i}(size_t n, const double *speed, double beta, double *out) {{ {name}(n, speed, beta, out); }}
"""
_LOOP = """
void run_{i}(size_t n, const double *speed, double beta, double *out);
void run_{i}(size_t n, const double *speed, double beta, double *out)
{{
    size_t k;

    for (k = 0; k < n; ++k) {{
        out[k] = {name}(speed[k], beta);
    }}
}}
"""


def in_python() -> dict[str, gas.RestitutionFunction]:
    """Return the functions that NumPy evaluates, and viscopade's own."""
    return {
        "constant": figure.constant_restitution(),
        "[1/4], NumPy": figure.pade_restitution(1, 4),
        "[3/6], NumPy": figure.pade_restitution(3, 6),
        "exact, vp.epsilon(v*)": lambda speed: vp.epsilon(v_star(speed, BETA)),
        f"exact, vp.restitution ({vp.backend()})": figure.exact_restitution,
    }


def in_c() -> dict[str, gas.RestitutionFunction]:
    """Return functions of exports/, compiled; none without a compiler."""
    try:
        compiler = toolchain.find_compiler()
    except toolchain.ToolchainError:
        return {}
    headers = {name: (EXPORTS / name).read_text() for name in (*map(file_of, TIERS), "viscopade_pade.h")}
    names = {entry.tier: entry.name for entry in registry.entries() if (entry.kind, entry.size) == ("speed", FAST)}
    loops = {
        f"kernel {tier}, C": _ARRAY.format(i=i, name=f"viscopade_restitution_array_{names[tier]}")
        for i, tier in enumerate(TIERS)
    }
    for label, degrees in (("[1/4], C", "1_4"), ("[3/6], C", "3_6")):
        loops[label] = _LOOP.format(i=len(loops), name=f"viscopade_restitution_pade_{degrees}")
    includes = "\n".join(f'#include "{name}"' for name in headers)
    source = _C.format(includes=includes, loops="".join(loops.values()))
    library = toolchain.build(compiler, {"array": {"gas.c": source}}, headers)["array"]
    return {label: _call(library, i) for i, label in enumerate(loops)}


def _call(library: ctypes.CDLL, index: int) -> gas.RestitutionFunction:
    function = library[f"run_{index}"]
    function.restype = None

    def restitution(speed: FloatArray) -> FloatArray:
        out = np.empty_like(speed)
        function(
            ctypes.c_size_t(speed.size),
            ctypes.c_void_p(speed.ctypes.data),
            ctypes.c_double(BETA),
            ctypes.c_void_p(out.ctypes.data),
        )
        return out

    return restitution


@dataclass
class Watch:
    """A function from speed to eps that adds up the time spent in it."""

    restitution: gas.RestitutionFunction
    seconds: float = 0.0

    def __call__(self, speed: FloatArray) -> FloatArray:
        """Return eps."""
        start = time.perf_counter()
        epsilon = self.restitution(speed)
        self.seconds += time.perf_counter() - start
        return epsilon


def measure(particles: int, rounds: int) -> dict[str, Any]:
    """Return nanoseconds per collision."""
    functions = in_python() | in_c()
    speeds = gas.cool(figure.exact_restitution, particles=particles, time=TIME).impact_speeds
    speeds = np.random.default_rng(1).choice(speeds, AT_ONCE)
    best = {name: {"run": np.inf, "eps_in_run": np.inf, "eps_at_once": np.inf} for name in functions}
    for _ in range(rounds):
        for name, restitution in functions.items():
            for key, found in _round(restitution, particles, speeds).items():
                best[name][key] = min(best[name][key], found)
    rows = [{"name": name, **times} for name, times in best.items()]
    return {"particles": particles, "time": TIME, "nanoseconds_per_collision": rows}


def _round(restitution: gas.RestitutionFunction, particles: int, speeds: FloatArray) -> Mapping[str, float]:
    watch = Watch(restitution)
    start = time.perf_counter()
    collisions = len(gas.cool(watch, particles=particles, time=TIME).impact_speeds)
    run = time.perf_counter() - start
    start = time.perf_counter()
    restitution(speeds)
    at_once = time.perf_counter() - start
    return {
        "run": 1e9 * run / collisions,
        "eps_in_run": 1e9 * watch.seconds / collisions,
        "eps_at_once": 1e9 * at_once / len(speeds),
    }


def show(result: dict[str, Any]) -> None:
    """Print the result for people."""
    table = Table("ns per collision", "run", "eps in it", "share", "eps, a million at once")
    for row in result["nanoseconds_per_collision"]:
        share = row["eps_in_run"] / row["run"]
        numbers = (f"{row['run']:.0f}", f"{row['eps_in_run']:.0f}", f"{share:.1%}", f"{row['eps_at_once']:.1f}")
        table.add_row(row["name"], *numbers)
    console().print(table)


PARTICLES = click.option("--particles", type=click.IntRange(gas.LEAST_PARTICLES), default=4000, show_default=True)
main = command(measure, show, rounds(5), PARTICLES)


if __name__ == "__main__":
    main()
