"""Simbody and OpenSim: the dissipation c of `HuntCrossleyForce`.

Read in Simbody of simbody/simbody at commit f312d0d:

- `HuntCrossleyForceImpl::calcForce` of src/HuntCrossleyForce.cpp: f = f_Hertz (1 + 3/2 c x'), a value below 0 is 0,
  with c = s_1 c_1 + s_2 c_2 and s_1 = k_2/(k_1 + k_2).
- `ContactMaterial::calcDissipationFromObservedRestitution` of include/simbody/internal/ContactSurface.h: c = (1 - e)/v,
  which the file says is for small v.

OpenSim hands the `dissipation` of its `HuntCrossleyForce` to Simbody's. The integrators choose their own steps.
"""

from __future__ import annotations

from mpmath import mp

from viscopade.audit.program import DampingFormula, Program
from viscopade.theory.law import law_of

PROGRAM = Program(
    "simbody",
    "Simbody and OpenSim",
    "commit f312d0d",
    (
        DampingFormula(
            "HuntCrossleyForce, calcDissipationFromObservedRestitution",
            law_of("hunt-crossley:3/2"),
            "c v",
            lambda cv: mp.mpf(3) / 2 * cv,
            ("0", "1e6"),
            "approximate formula",
            "Simbody/src/HuntCrossleyForce.cpp",
            written=lambda e: 1 - e,
            scheme=None,
        ),
    ),
)
