"""LIGGGHTS: `pair_style gran` and `fix wall/gran` with the models hertz, hooke and hertz/stiffness.

Read in src of LIGGGHTS-PUBLIC 3.8.0 (CFDEMproject/LIGGGHTS-PUBLIC at commit 25fc396):

- `createBetaEff` of global_properties.cpp: betaeff = ln e/sqrt(ln^2 e + pi^2), minus the damping ratio for contact that
  ends at x = 0.
- `surfacesIntersect` of normal_model_hertz.h: c = -2 sqrt(5/6) betaeff sqrt(S m_eff), S the tangent stiffness: Tsuji's
  damping with that ratio. Of normal_model_hooke.h: c = sqrt(4 m_eff k/(1 + (pi/ln e)^2)), a linear dashpot with it.
- Both: with `limitForce on` a force that would pull is 0; without, contact ends at x = 0.
- `createCoeffRest`: 0.05 < coefficientRestitution <= 1.
- normal_model_hertz_stiffness.h is the viscoelastic law (`viscopade.simulators.liggghts`).

`fix nve/sphere` steps as LAMMPS does: the damping takes the velocity half a step before.
"""

from __future__ import annotations

from mpmath import mp

from viscopade.audit.program import DampingFormula, Program
from viscopade.audit.spring_dashpot import (
    LINEAR,
    LINEAR_RETURN,
    TSUJI,
    TSUJI_RETURN,
    linear_kappa,
    tsuji_kappa,
    viscoelastic_kappa,
)
from viscopade.theory.law import VISCOELASTIC, law_of

LEAST_COEFFICIENT = 0.05

_E, _ACCEPTED, _KAPPA = "coefficientRestitution", (str(LEAST_COEFFICIENT), "1"), ("0", "1e6")
_HERTZ, _HOOKE, _STIFFNESS = (f"src/normal_model_{name}.h" for name in ("hertz", "hooke", "hertz_stiffness"))

PROGRAM = Program(
    "liggghts",
    "LIGGGHTS",
    "LIGGGHTS-PUBLIC 3.8.0, commit 25fc396",
    (
        DampingFormula("hertz", TSUJI_RETURN, _E, tsuji_kappa, _ACCEPTED, "exact", _HERTZ),
        DampingFormula("hertz, limitForce on", TSUJI, _E, tsuji_kappa, _ACCEPTED, "other end", _HERTZ),
        DampingFormula("hooke", LINEAR_RETURN, _E, linear_kappa, _ACCEPTED, "exact", _HOOKE),
        DampingFormula("hooke, limitForce on", LINEAR, _E, linear_kappa, _ACCEPTED, "other end", _HOOKE),
        DampingFormula(
            "hertz/stiffness, limitForce on",
            VISCOELASTIC,
            "kappa",
            mp.mpf,
            _KAPPA,
            "exact",
            _STIFFNESS,
            written=viscoelastic_kappa,
            note="gamman is as `viscopade simulators liggghts` writes it.",
        ),
        DampingFormula(
            "hertz/stiffness",
            law_of(VISCOELASTIC, "return"),
            "kappa",
            mp.mpf,
            _KAPPA,
            "other end",
            _STIFFNESS,
            written=viscoelastic_kappa,
            note="gamman is as `viscopade simulators liggghts` writes it, without its limitForce.",
        ),
    ),
)
