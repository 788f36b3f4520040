"""TrixiParticles.jl: `damping_coefficient` of a `DEMSystem`, a damping ratio.

Read in trixi-framework/TrixiParticles.jl at commit 1d57f11, src/schemes/structure/discrete_element_method:

- `collision_force_normal` of contact_models.jl: k x + 2 C sqrt(m k) x', which may pull; in `HertzContactModel` with
  k = 4/3 E* sqrt(R x). So kappa is 2 C in both, and C is the damping ratio of the linear contact only: that of Hertz'
  spring is 2 C/sqrt(5).
- rhs.jl moves a particle that touches a boundary out by half of its overlap, at each evaluation: that is not computed
  here.

Users choose the integrator.
"""

from __future__ import annotations

from viscopade.simulators.formula import LINEAR_RETURN, TSUJI_RETURN, formulas, ratio_for_return, twice
from viscopade.simulators.simulator import Simulator

SIMULATOR = Simulator(
    "trixi",
    "TrixiParticles.jl",
    "commit 1d57f11",
    formulas(
        "damping_coefficient",
        ("0", "1e3"),
        "src/schemes/structure/discrete_element_method/contact_models.jl",
        ("LinearContactModel", LINEAR_RETURN, twice, "exact"),
        ("HertzContactModel", TSUJI_RETURN, twice, "other law"),
        written=ratio_for_return,
        scheme=None,
    ),
)
