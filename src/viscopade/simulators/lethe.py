"""Lethe: `restitution coefficient` of particles and walls.

Read in chaos-polymtl/lethe at commit 72f6c69, include/dem/particle_wall_contact_force.h, of which the contacts of two
particles are the like: beta = ln e/sqrt(ln^2 e + pi^2), in constants of five digits.

- `linear`: a spring and the dashpot 2 beta sqrt(m k); it may pull.
- `nonlinear`: Hertz' spring, and the dashpot sqrt(10/3) beta sqrt(2 E sqrt(R x) m), which is Tsuji's with
  kappa = sqrt(5) beta; it may pull.
"""

from __future__ import annotations

from viscopade.simulators.formula import LINEAR_RETURN, TSUJI_RETURN, formulas, linear_kappa, tsuji_kappa
from viscopade.simulators.simulator import Simulator

SIMULATOR = Simulator(
    "lethe",
    "Lethe",
    "commit 72f6c69",
    formulas(
        "restitution coefficient",
        ("1e-15", "1"),
        "include/dem/particle_wall_contact_force.h",
        ("nonlinear", TSUJI_RETURN, tsuji_kappa, "exact"),
        ("linear", LINEAR_RETURN, linear_kappa, "exact"),
    ),
)
