"""TrixiParticles.jl: `damping_coefficient` of a `DEMSystem`, a damping ratio.

    DEMSystem(particles, HertzContactModel(1e7, 0.3); damping_coefficient=0.1)

Read in trixi-framework/TrixiParticles.jl at commit 1d57f11, src/schemes/structure/discrete_element_method:

- `collision_force_normal` of contact_models.jl: k x + 2 C sqrt(m k) x', which may pull; in `HertzContactModel` with
  k = 4/3 E* sqrt(R x). So kappa is 2 C in both, and C is the damping ratio of the linear contact only: that of Hertz'
  spring is 2 C/sqrt(5). E* is Hertz' E_eff of both systems.
- Each system's particles feel a force with their own system's `normal_stiffness` and C: those of two systems have to be
  equal, or action is not reaction.
- rhs.jl moves a particle that touches a boundary out by half of its overlap, at each evaluation: that is not computed
  here.
- system.jl (commit 0371960): `damping_coefficient` is 0.0001 unless it is set.

Users choose the integrator; the examples have `RDPK3SpFSAL49`, which chooses its own steps.
"""

from __future__ import annotations

import math

from viscopade.simulators import native
from viscopade.simulators.formula import LINEAR_RETURN, TSUJI_RETURN, formulas, kappa_from_ratio, ratio_for_return
from viscopade.simulators.simulator import Simulator

_SOURCE = "src/schemes/structure/discrete_element_method/contact_models.jl"
_LAWS = "LinearContactModel", "HertzContactModel"


def _force(values: native.Values, impact: native.Impact) -> native.Power:
    """Return the force k x^a + c x^b v of a contact model.

    `values` are the numbers of the user's file by their names, pairs where both bodies have one (SI units). `impact`
    has the effective mass and radius, in kg and m.
    """
    model = values["contact_model"]
    if model == "LinearContactModel":
        k = values["normal_stiffness"]
    else:
        modulus = native.effective_modulus(
            values, values["elastic_modulus"], values["poissons_ratio"], "collision_force_normal"
        )
        # k = 4/3 E* sqrt(R)
        k = 4 / 3 * modulus * math.sqrt(impact.effective_radius)
    # c = kappa sqrt(k m), with the kappa 2 C.
    return native.power_force(SIMULATOR.formula(model), values["damping_coefficient"], k, impact.effective_mass)


_NATIVE = native.Native(
    (
        native.Parameter("contact_model", words=_LAWS),
        native.positive("normal_stiffness", "N/m"),
        native.positive("elastic_modulus", "Pa", per_body=True),
        native.poisson_ratios("poissons_ratio"),
        native.Parameter("damping_coefficient", default="0.0001"),
    ),
    _force,
    _SOURCE,
    schemes={"RDPK3SpFSAL49": None},
    integrator="solve",
    damping="damping_coefficient",
)

SIMULATOR = Simulator(
    "trixi",
    "TrixiParticles.jl",
    "commit 1d57f11",
    formulas(
        "damping_coefficient",
        ("0", "1e3"),
        _SOURCE,
        ("LinearContactModel", LINEAR_RETURN, kappa_from_ratio, "exact"),
        ("HertzContactModel", TSUJI_RETURN, kappa_from_ratio, "other law"),
        usual_parameter=ratio_for_return,
        scheme=None,
    ),
    native=_NATIVE,
)
