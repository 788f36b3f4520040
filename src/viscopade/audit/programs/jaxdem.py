"""JaxDEM: the linear contact `cundallstrack` with a coefficient of restitution.

Read in jaxdem of cdelv/JaxDEM:

- `CundallStrackForce.force` of forces/cundall_strack.py (commit 02f0627): c from the damping ratio for contact that
  ends at x = 0; a force that would pull is 0.
- integrators/velocity_verlet.py (commit 0d7bcb9): the force is computed after half of the kick.
"""

from __future__ import annotations

from viscopade.audit.program import DampingFormula, Program
from viscopade.audit.spring_dashpot import LINEAR, linear_kappa

PROGRAM = Program(
    "jaxdem",
    "JaxDEM",
    "commit 02f0627",
    (
        DampingFormula(
            "cundallstrack", LINEAR, "e", linear_kappa, ("1e-6", "1"), "other end", "jaxdem/forces/cundall_strack.py"
        ),
    ),
)
