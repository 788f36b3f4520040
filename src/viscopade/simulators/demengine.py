"""DEM-Engine, of Project Chrono: `CoR` of materials.

    mat = DEMSim.LoadMaterial({{"E", 1e9}, {"nu", 0.3}, {"CoR", 0.8}, {"mu", 0.3}, {"Crr", 0.01}});
    DEMSim.SetMaterialPropertyPair("CoR", mat_ball, mat_wall, 0.5);

Read in projectchrono/DEM-Engine at commit a1dc2312, src/kernel:

- DEMCustomizablePolicies/FullHertzianForceModel.cu, and FrictionlessHertzianForceModel.cu, in single precision: Hertz'
  spring, and Tsuji's damping 2 sqrt(5/6) |beta| sqrt(2 E sqrt(R x) m) v with beta = ln e/sqrt(ln^2 e + pi^2) and e not
  below 1e-12. It is exact, and may pull.
- m is the effective mass, also with a wall, which does not move but has a mass: 1e6 kg for planes, and 1 kg for meshes
  unless SetMass has set it (`DEMExternObj` and `DEMMesh` of DEM/BdrsAndObjs.h).
- `matProxy2ContactParam` of DEMHelperKernels.cuh: E is Hertz' E_eff. `equipMaterials` of DEM/APIPrivate.cpp:
  CoR of two materials is their mean, unless SetMaterialPropertyPair has set it.
- DEMIntegrationKernels.cu moves a body by the speed before the kick, after it, or their mean, which is the default.
"""

from __future__ import annotations

import math

from viscopade.collision.schemes import FORWARD, SEMI_IMPLICIT, TAYLOR
from viscopade.simulators import native
from viscopade.simulators.formula import TSUJI_RETURN, formulas, tsuji_kappa
from viscopade.simulators.simulator import Simulator

_SOURCE = "src/kernel/DEMCustomizablePolicies/FullHertzianForceModel.cu"


def _force(values: native.Values, impact: native.Impact) -> native.Power:
    """Return the force k x^(3/2) + c x^(1/4) v between two materials.

    `values` are the numbers of the user's file by their names, pairs where both bodies have one (SI units). `impact`
    has the effective mass and radius, in kg and m.
    """
    modulus = native.effective_modulus(values, values["E"], values["nu"], "matProxy2ContactParam")
    # Hertz: k = 4/3 E_eff sqrt(R_eff)
    k = 4 / 3 * modulus * math.sqrt(impact.effective_radius)
    e = values.mix("CoR", native.MEAN, "equipMaterials")
    mass = impact.effective_mass
    # A wall has the mass M of SetMass: m M/(m + M).
    if "SetMass" in values:
        mass *= values["SetMass"] / (mass + values["SetMass"])
    # c = kappa sqrt(k m), with the kappa that the formula makes of e.
    return native.power_force(SIMULATOR.formula("Hertzian"), e, k, mass)


SIMULATOR = Simulator(
    "demengine",
    "DEM-Engine",
    "commit a1dc2312; from the source, not run",
    # The source does not let CoR be below 1e-12.
    formulas("CoR", ("1e-12", "1"), _SOURCE, ("Hertzian", TSUJI_RETURN, tsuji_kappa, "exact"), scheme=TAYLOR),
    native=native.Native(
        (
            native.positive("E", "Pa", per_body=True),
            native.poisson_ratios("nu"),
            native.restitution("CoR", least_epsilon=1e-12, per_body=True),
            native.positive("SetMass", "kg"),
        ),
        _force,
        _SOURCE,
        schemes={"EXTENDED_TAYLOR": TAYLOR, "CENTERED_DIFFERENCE": SEMI_IMPLICIT, "FORWARD_EULER": FORWARD},
        integrator="integrator",
        damping="CoR",
    ),
)
