"""Collisions in REBOUND for the audit: two spheres meet head-on, with a constant eps or with our callback.

The Python package `rebound` is needed. `python -m viscopade_lab.programs.audit` runs all collisions.
"""

from __future__ import annotations

import runpy
import tempfile
from collections.abc import Iterator, Sequence
from functools import partial
from pathlib import Path
from typing import Any

from viscopade import Pair, Sphere
from viscopade.audit.measured import Measurement
from viscopade.simulators import rebound as ours
from viscopade.simulators.setup import of_pair
from viscopade_lab.programs import audit_cases
from viscopade_lab.programs.audit_cases import AuditCase

BALL = Sphere(radius=0.1, density=1000, young_modulus=1e7, poisson_ratio=0.3, dissipative_constant=0)
SPEED = 1.0
_STEP, _MOST = 0.01, 100

program = partial(audit_cases.package, "rebound", "rebound")
"""Return the package, or raise RuntimeError if it is not installed."""


def measured(case: AuditCase, parameter: float) -> float:
    """Return the eps with a parameter."""
    rebound = program()
    sim = rebound.Simulation()
    sim.integrator, sim.gravity, sim.collision, sim.dt = "leapfrog", "none", "direct", _STEP
    for side in (-1, 1):
        sim.add(m=BALL.mass, r=BALL.radius, x=1.2 * side * BALL.radius, vx=-side * SPEED / 2)
    if case.formula.parameter == "kappa":
        _install(sim, parameter)
    else:
        sim.collision_resolve = "hardsphere"
        sim.coefficient_of_restitution = lambda _, v: parameter
    for _ in range(_MOST):
        sim.steps(1)
        speed = sim.particles[1].vx - sim.particles[0].vx
        if speed > 0:
            return float(speed) / SPEED
    raise RuntimeError("a collision of the audit has not ended in REBOUND")


def _install(sim: Any, kappa: float) -> None:
    """Give a simulation the callback of the generated Python module, without a compiled kernel."""
    pair = Pair(BALL, BALL)
    beta = kappa * SPEED**-0.2
    text = ours.render(of_pair(pair.damped(float(pair.dissipative_constant(beta))), SPEED), "audit", "python")
    with tempfile.TemporaryDirectory() as folder:
        path = Path(folder) / "audit.py"
        path.write_text(text, "utf-8")
        runpy.run_path(str(path))["install"](sim)


def audit_measurements(some: Sequence[AuditCase] | None = None) -> Iterator[Measurement]:
    """Yield the collisions of the audit, or some of them.

    Raises
    ------
    RuntimeError
        If REBOUND is not there, or a collision has not ended.
    """
    version = f"REBOUND {program().__version__}"
    for case in some or audit_cases.all_cases("rebound"):
        yield case.measured(version, measured(case, case.parameter))
