"""PhasicFlow: `en` of the models `linear` and `nonLinear`, and `etha_n` of `nonLinearMod`.

    contactForceModel  nonLinearLimited;
    Yeff (1.0e6);  Geff (0.8e6);  nu (0.25);  en (0.7);  mu (0.3);

Read in PhasicFlow/phasicFlow at commit 1258cb19, src/Interaction/Models/contactForce:

- The damping of an eps has the masses 3 pi/4 R^3 rho, which are 9/16 of those of the spheres: it is 3/4 of what its
  formula means. So it is in linearCF.hpp and nonLinearCF.hpp, and in the models of grains. At a wall the other radius
  is 10000 m (sphereInteractionKernels.hpp): the mass is 9/16 of the sphere's.
- `linear`: k x + 2 zeta sqrt(k m) v, zeta = -ln e/sqrt(ln^2 e + pi^2). `nonLinear`: Hertz' spring, and Tsuji's damping
  2.2664 zeta sqrt(k m) x^(1/4) v, where sqrt(5) = 2.2361 would be right. `nonLinearMod`: Hertz' spring and
  etha_n sqrt(x) v. All may pull; `Limited` and `NonLimited` differ along the surface.
- A number belongs to a pair of materials.
- Time steps are those of Adams' methods (src/Integration), which keep older accelerations: they are not computed here.
"""

from __future__ import annotations

import math
from typing import Any

from viscopade.collision.schemes import SEMI_IMPLICIT
from viscopade.simulators import native
from viscopade.simulators.formula import LINEAR_RETURN, TSUJI_RETURN, formulas, linear_kappa, ratio_for_return
from viscopade.simulators.simulator import Simulator
from viscopade.theory.law import VISCOELASTIC, law_of

_SOURCE = "src/Interaction/Models/contactForce/nonLinearCF.hpp"


def _linear_kappa(e: Any) -> Any:
    """Return kappa of `linear` for en = e: damping grows like the root of the mass, of which it has 9/16."""
    return linear_kappa(e) * 3 / 4


def _tsuji_kappa(e: Any) -> Any:
    """Return kappa of `nonLinear` for en = e: 2.2664 zeta, the source's number, and 3/4 as in `linear`."""
    return ratio_for_return(e) * 22664 / 10000 * 3 / 4


def _force(values: native.Values, impact: native.Impact) -> native.Power:
    """Return the force k x^a + c x^b v between two materials.

    `values` are the numbers of the pair of materials by their names in the user's file, in SI units. `impact` has the
    effective mass and radius, in kg and m.
    """
    if impact.step is not None:
        raise ValueError("time-step is given: expected none, as the steps of Adams' methods are not computed here")
    model, mass = values["contactForceModel"], impact.effective_mass
    # c = kappa sqrt(k m), with the kappa that the formula makes of en.
    if model == "linear":
        return native.power_force(SIMULATOR.formula(model), values["en"], values["kn"], mass)
    # Hertz: k = 4/3 Yeff sqrt(R_eff)
    k = 4 / 3 * values["Yeff"] * math.sqrt(impact.effective_radius)
    if model == "nonLinear":
        return native.power_force(SIMULATOR.formula(model), values["en"], k, mass)
    # nonLinearMod: etha_n sqrt(x) v, the viscoelastic law up to x = 0
    return native.Power(law_of(VISCOELASTIC, "return"), k, values["etha_n"])


SIMULATOR = Simulator(
    "phasicflow",
    "PhasicFlow",
    "commit 1258cb19; from the source, not run",
    formulas(
        "en",
        ("1e-15", "1"),  # the least one by hand: ln 0 is no damping
        _SOURCE,
        ("linear", LINEAR_RETURN, _linear_kappa, "normalisation"),
        ("nonLinear", TSUJI_RETURN, _tsuji_kappa, "normalisation"),
        scheme=None,
    ),
    native=native.Native(
        (
            native.Parameter("contactForceModel", default="nonLinear", words=("linear", "nonLinear", "nonLinearMod")),
            native.positive("kn", "N/m"),
            native.positive("Yeff", "Pa"),
            native.restitution("en"),
            native.Parameter("etha_n", "kg/m^0.5/s"),
        ),
        _force,
        _SOURCE,
        schemes={"AdamsBashforth2": SEMI_IMPLICIT},
        integrator="integrationMethod",
        damping=lambda values: "etha_n" if values["contactForceModel"] == "nonLinearMod" else "en",
    ),
)
