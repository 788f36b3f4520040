"""OpenFOAM, particles of `collidingCloud` (DPMFoam and others): `alpha` of `pairSpringSliderDashpot`.

Read in OpenFOAM/OpenFOAM-dev at commit 43d66b5, src/lagrangian/parcel/submodels/Momentum/CollisionModel/PairCollision:

- `evaluatePair` of PairSpringSliderDashpot.C: kN x^b + alpha sqrt(M kN) x^(1/4) x', kN = 4/3 sqrt(R) E*, M and R
  being effective; it may pull. With b = 3/2 this is Tsuji's damping, and alpha is kappa.
- WallSpringSliderDashpot.C has the same for a wall.
"""

from __future__ import annotations

from mpmath import mp

from viscopade.simulators.formula import TSUJI_RETURN, formulas, tsuji_kappa
from viscopade.simulators.simulator import Simulator

SIMULATOR = Simulator(
    "openfoam",
    "OpenFOAM",
    "OpenFOAM-dev, commit 43d66b5",
    formulas(
        "alpha",
        ("0", "1e3"),
        "src/lagrangian/parcel/submodels/Momentum/CollisionModel/PairCollision/PairModel/"
        "PairSpringSliderDashpot/PairSpringSliderDashpot.C",
        ("pairSpringSliderDashpot, alpha", TSUJI_RETURN, mp.mpf, "exact"),
        written=tsuji_kappa,
    ),
)
