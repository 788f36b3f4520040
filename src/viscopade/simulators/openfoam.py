"""OpenFOAM, particles of `collidingCloud` (DPMFoam and others): `alpha` of `pairSpringSliderDashpot`.

    pairSpringSliderDashpotCoeffs
    {
        alpha 0.12;    b 1.5;    collisionResolutionSteps 12;

Read in OpenFOAM/OpenFOAM-dev at commit 43d66b5, src/lagrangian/parcel/submodels/Momentum/CollisionModel/PairCollision:

- `evaluatePair` of PairSpringSliderDashpot.C: kN x^b + alpha sqrt(M kN) x^(1/4) x', kN = 4/3 sqrt(R) E*, M and R
  being effective; it may pull. With b = 3/2 this is Tsuji's damping, and alpha is kappa.
- WallSpringSliderDashpot.C has the same for a wall, with the wall's own alpha and b. E* is Hertz' E_eff of the cloud's
  `youngsModulus` and `poissonsRatio`, which all particles share, and of those of the wall.
- A cohesion, `cohesionEnergyDensity`, is not computed.

The cloud moves in `nSubCycles` = ceil(deltaT/deltaT_c) steps of a time step deltaT,
deltaT_c = 5.429675 R_min (rho_max/(E* sqrt(U)))^(2/5)/`collisionResolutionSteps`. They are a leapfrog
(`CollidingParcel::move`, parcels/Templates/CollidingParcel at commit 06e29c4): forces are computed after half of the
kick, so the damping lags behind by half a step.
"""

from __future__ import annotations

import math

import numpy as np
from mpmath import mp

from viscopade.collision.contact import Contact
from viscopade.collision.schemes import SEMI_IMPLICIT
from viscopade.simulators import native
from viscopade.simulators.formula import TSUJI_RETURN, formulas, tsuji_kappa
from viscopade.simulators.simulator import Simulator

_SOURCE = (
    "src/lagrangian/parcel/submodels/Momentum/CollisionModel/PairCollision/PairModel/"
    "PairSpringSliderDashpot/PairSpringSliderDashpot.C"
)


def _contact(values: native.Values, impact: native.Impact) -> Contact:
    """Return the contact of two particles, or of one and the wall.

    `values` are the numbers of the user's file by their names, pairs where both bodies have one (SI units). `impact`
    has the effective mass and radius, in kg and m.
    """
    modulus = native.effective_modulus(
        values, values["youngsModulus"], values["poissonsRatio"], "WallSpringSliderDashpot"
    )
    mass, power = impact.effective_mass, values["b"]
    # kN = 4/3 sqrt(R) E*
    k = 4 / 3 * modulus * math.sqrt(impact.effective_radius)
    c = values["alpha"] * math.sqrt(mass * k)
    # kN x^b + alpha sqrt(M kN) x^(1/4) x', up to x = 0
    return Contact(lambda x, v: k * x**power + c * np.sqrt(np.sqrt(x)) * v, mass, mass * impact.gravity, "return")


_NATIVE = native.Native(
    (
        native.positive("youngsModulus", "Pa", per_body=True),
        native.poisson_ratios("poissonsRatio"),
        native.Parameter("alpha"),
        native.positive("b", ""),
    ),
    _contact,
    _SOURCE,
    schemes={"leapfrog": SEMI_IMPLICIT},
    damped_values=lambda values, c, impact: {"alpha": c},
)

SIMULATOR = Simulator(
    "openfoam",
    "OpenFOAM",
    "OpenFOAM-dev, commit 43d66b5",
    formulas(
        "alpha",
        ("0", "1e3"),
        _SOURCE,
        ("pairSpringSliderDashpot, alpha", TSUJI_RETURN, mp.mpf, "exact"),
        usual_parameter=tsuji_kappa,
    ),
    native=_NATIVE,
)
