"""Kratos: the discontinuum laws of its DEMApplication with COEFFICIENT_OF_RESTITUTION.

    "material_relations": [{"material_names_list": ["ball", "ball"],
        "Variables": {"COEFFICIENT_OF_RESTITUTION": 0.9,
            "DEM_DISCONTINUUM_CONSTITUTIVE_LAW_NAME": "DEM_D_Hertz_viscous_Coulomb"}}]

Read in DEMApplication of KratosMultiphysics 10.4.4 and in its repository (KratosMultiphysics/Kratos):

- `ModifySubProperties` of sphere_strategy.py: DAMPING_GAMMA, the damping ratio, is from a bisection, to 1e-4, of the
  formula for the end at zero force (Linear), or by the fit of Thornton, Cummins and Cleary (2013) (Hertz).
- DEM_D_Hertz_viscous_Coulomb_CL.cpp (commit 03f57bf): c = 2 gamma sqrt(m_eff kn), kn = 3/2 k sqrt(x), so kappa =
  sqrt(6) gamma. DEM_D_Linear_viscous_Coulomb_CL.cpp (commit 013f925): c = 2 gamma sqrt(m_eff k). Both: a force that
  would pull is 0. At a wall m_eff is the particle's mass.

COEFFICIENT_OF_RESTITUTION belongs to a pair of materials ("material_relations"): two materials share one. Both laws
mix the moduli to Hertz' E_eff (`InitializeContact`, and with a wall `InitializeContactWithFEM`).

The linear k is 1.432 pi 0.31225 E_eff R_eff, at a wall without the factor 1.432.

`SymplecticEulerScheme`, the default, kicks and then drifts: semi-implicit Euler's method. `VelocityVerletScheme` is the
same map, as the damping takes the velocity in between. `ForwardEulerScheme` and `TaylorScheme` take the force of the
old state, and move with the old velocity, or with half of the kick.
"""

from __future__ import annotations

import math

from viscopade.collision.schemes import FORWARD, SEMI_IMPLICIT, TAYLOR
from viscopade.simulators import native
from viscopade.simulators.formula import LINEAR, TSUJI, force_end_kappa, formulas, thornton_kappa
from viscopade.simulators.simulator import Simulator

# Numbers of the linear law's stiffness, as in DEM_D_Linear_viscous_Coulomb_CL.cpp; the first is for two particles only.
_PAIR, _CHORD = 1.432, 0.31225
_E, _FOLDER = "COEFFICIENT_OF_RESTITUTION", "applications/DEMApplication/custom_constitutive"

# `GammaForHertzThornton` of sphere_strategy.py takes a smaller eps for 0.001, and does not damp above 0.999.
_NEARLY_ALL = ("0.001", "0.999")
_LAWS = "DEM_D_Hertz_viscous_Coulomb", "DEM_D_Linear_viscous_Coulomb"


def _force(values: native.Values, impact: native.Impact) -> native.Power:
    """Return the force k x^a + c x^b v of a law.

    `values` are the numbers of the user's file by their names, pairs where both bodies have one (SI units). `impact`
    has the effective mass and radius, in kg and m.
    """
    formula, radius = SIMULATOR.formula(values["law"]), impact.effective_radius
    modulus = native.effective_modulus(
        values, values["YOUNG_MODULUS"], values["POISSON_RATIO"], f"{values['law']}::InitializeContact"
    )
    # Hertz: k = 4/3 E_eff sqrt(R_eff). Linear: k = 1.432 pi 0.31225 E_eff R_eff, at a wall without 1.432.
    if formula.law == TSUJI:
        k = 4 / 3 * modulus * math.sqrt(radius)
    else:
        k = (_PAIR if values["other"] == "sphere" else 1.0) * math.pi * _CHORD * modulus * radius
    # c = kappa sqrt(k m), with the kappa that the formula makes of the restitution.
    return native.power_force(formula, values[_E], k, impact.effective_mass)


_NATIVE = native.Native(
    (
        native.Parameter("law", words=_LAWS),
        native.positive("YOUNG_MODULUS", "Pa", per_body=True),
        native.poisson_ratios("POISSON_RATIO"),
        native.restitution(_E, least_epsilon=0.001),  # the least eps that the source tells apart
        native.Parameter("other", default="sphere", words=("sphere", "wall")),
    ),
    _force,
    f"{_FOLDER}/{_LAWS[0]}_CL.cpp",
    schemes={
        "Symplectic_Euler": SEMI_IMPLICIT,
        "Forward_Euler": FORWARD,
        "Velocity_Verlet": SEMI_IMPLICIT,
        "Taylor_Scheme": TAYLOR,
    },
    integrator="TranslationalIntegrationScheme",
    damping=_E,
)

SIMULATOR = Simulator(
    "kratos",
    "Kratos DEM",
    "10.4.4; repository at commits 03f57bf and 013f925",
    (
        *formulas(
            _E, _NEARLY_ALL, f"{_FOLDER}/{_LAWS[0]}_CL.cpp", (_LAWS[0], TSUJI, thornton_kappa, "approximate formula")
        ),
        *formulas(
            _E,
            _NEARLY_ALL,
            f"{_FOLDER}/{_LAWS[1]}_CL.cpp",
            (
                _LAWS[1],
                LINEAR,
                force_end_kappa,
                "exact",
                "The program solves the formula to 1e-4 of the damping ratio only.",
            ),
        ),
    ),
    native=_NATIVE,
)
