"""Kratos: the discontinuum laws of its DEMApplication with COEFFICIENT_OF_RESTITUTION.

Read in DEMApplication of KratosMultiphysics 10.4.4 and in its repository (KratosMultiphysics/Kratos):

- `ModifySubProperties` of sphere_strategy.py: DAMPING_GAMMA, the damping ratio, is from a bisection, to 1e-4, of the
  formula for the end at zero force (Linear), or by the fit of Thornton, Cummins and Cleary (2013) (Hertz).
- DEM_D_Hertz_viscous_Coulomb_CL.cpp (commit 03f57bf): c = 2 gamma sqrt(m_eff kn), kn = 3/2 k sqrt(x), so kappa =
  sqrt(6) gamma. DEM_D_Linear_viscous_Coulomb_CL.cpp (commit 013f925): c = 2 gamma sqrt(m_eff k). Both: a force that
  would pull is 0. At a wall m_eff is the particle's mass.

`SymplecticEulerScheme`, the default, kicks and then drifts: semi-implicit Euler's method.
"""

from __future__ import annotations

from mpmath import mp

from viscopade.simulators.formula import LINEAR, TSUJI, DampingFormula, ratio_at_force_end, thornton_betan
from viscopade.simulators.simulator import Simulator

_E, _FOLDER = "COEFFICIENT_OF_RESTITUTION", "applications/DEMApplication/custom_constitutive"

SIMULATOR = Simulator(
    "kratos",
    "Kratos DEM",
    "10.4.4; repository at commits 03f57bf and 013f925",
    (
        DampingFormula(
            "DEM_D_Hertz_viscous_Coulomb",
            TSUJI,
            _E,
            lambda e: mp.sqrt(6) * thornton_betan(e),
            ("0.001", "0.999"),
            "approximate formula",
            f"{_FOLDER}/DEM_D_Hertz_viscous_Coulomb_CL.cpp",
        ),
        DampingFormula(
            "DEM_D_Linear_viscous_Coulomb",
            LINEAR,
            _E,
            lambda e: 2 * ratio_at_force_end(e),
            ("0.001", "0.999"),
            "exact",
            f"{_FOLDER}/DEM_D_Linear_viscous_Coulomb_CL.cpp",
            note="The program solves the formula to 1e-4 of the damping ratio only.",
        ),
    ),
)
