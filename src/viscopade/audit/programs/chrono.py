"""Chrono: smooth contacts (SMC) with a coefficient of restitution.

Read in src/chrono/physics/ChContactSMC.cpp of projectchrono/chrono at commit 2b57579, `CalculateForceTorque`:

- Hooke: c from the damping ratio for contact that ends at x = 0. Hertz: Tsuji's damping with the same ratio.
- A force that would pull is 0, without adhesion. Flores counts as Hooke.

The default time stepper is `ChTimestepperEulerImplicitLinearized` of src/chrono/timestepper/ChTimestepperImplicit.cpp
(commit 071a3d8). It takes contact forces from the start of the step, unless contacts are set to be stiff, and moves
with the new velocity: semi-implicit Euler's method.
"""

from __future__ import annotations

from viscopade.audit.program import DampingFormula, Program
from viscopade.audit.spring_dashpot import LINEAR, TSUJI, linear_kappa, tsuji_kappa

_E, _ACCEPTED, _SOURCE = "cr_eff", ("1e-15", "1"), "src/chrono/physics/ChContactSMC.cpp"

PROGRAM = Program(
    "chrono",
    "Chrono",
    "commit 2b57579",
    (
        DampingFormula("SMC, Hertz", TSUJI, _E, tsuji_kappa, _ACCEPTED, "other end", _SOURCE),
        DampingFormula("SMC, Hooke", LINEAR, _E, linear_kappa, _ACCEPTED, "other end", _SOURCE),
    ),
)
