"""REBOUND: hard spheres, with `coefficient_of_restitution` or a `collision_resolve` function.

Read in `reb_collision_resolve_hardsphere` of src/collision.c of REBOUND 5.2.2: the normal component of the relative
velocity is multiplied by -eps, whatever eps is. There is no force, and no time step in a collision.

A constant eps is that of a law with nu = 2; the files of `viscopade.simulators.rebound` have the viscoelastic one.
"""

from __future__ import annotations

from mpmath import mp

from viscopade.audit.program import DampingFormula, Program, wanted_kappa
from viscopade.audit.spring_dashpot import LINEAR, viscoelastic_kappa
from viscopade.theory.law import VISCOELASTIC

_SOURCE = "src/collision.c"

PROGRAM = Program(
    "rebound",
    "REBOUND",
    "5.2.2",
    (
        DampingFormula(
            "coefficient_of_restitution, a constant",
            LINEAR,
            "eps",
            lambda e: wanted_kappa(LINEAR, mp.nstr(e, 20)),
            ("0.001", "1"),
            "exact",
            _SOURCE,
            note="There is no contact: eps is applied, the same at all speeds.",
            scheme=None,
        ),
        DampingFormula(
            "collision_resolve of viscopade simulators",
            VISCOELASTIC,
            "kappa",
            mp.mpf,
            ("0", "1e6"),
            "exact",
            _SOURCE,
            written=viscoelastic_kappa,
            note="eps is that of viscoelastic spheres at each speed, by the kernel or by viscopade.restitution.",
            scheme=None,
        ),
    ),
)
