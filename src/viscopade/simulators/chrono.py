"""Chrono: smooth contacts (SMC) with a coefficient of restitution.

    auto material = chrono_types::make_shared<ChContactMaterialSMC>();
    material->SetYoungModulus(2e5f);
    material->SetRestitution(0.4f);

Read in src/chrono/physics/ChContactSMC.cpp of projectchrono/chrono at commit 2b57579, `CalculateForceTorque`:

- Hooke: c from the damping ratio for contact that ends at x = 0. Hertz: Tsuji's damping with the same ratio.
- A force that would pull is 0, without adhesion. Flores counts as Hooke. PlainCoulomb is Hertz with the radius 1.
- Without material properties: k = kn and c = m_eff gn (Hooke), with R_eff sqrt(x) times both (Hertz), or k = kn and
  c = gn times sqrt(x) (PlainCoulomb).
- m_eff counts the mass of a fixed body, too. Forces are computed once in a step, when collisions are found.

Two materials, `ChContactMaterialCompositeSMC` of ChContactMaterialSMC.cpp (commit 4352b5f) with the default strategy of
ChContactMaterial.h (commit 2415f3e): Hertz' E_eff, the smaller restitution, the means of kn and of gn.

The default time stepper is `ChTimestepperEulerImplicitLinearized` of src/chrono/timestepper/ChTimestepperImplicit.cpp
(commit 071a3d8). It takes contact forces from the start of the step, unless contacts are set to be stiff, and moves
with the new velocity: semi-implicit Euler's method. In ChTimestepperExplicit.cpp (commit 071a3d8) EULER_EXPLICIT moves
with the old velocity, HEUN and RUNGEKUTTA45 with the mean of both: the contact force is the same in all their stages.
"""

from __future__ import annotations

import math

from viscopade.collision.schemes import FORWARD, SEMI_IMPLICIT, TAYLOR
from viscopade.simulators import native
from viscopade.simulators.formula import LINEAR, TSUJI, formulas, linear_kappa, tsuji_kappa
from viscopade.simulators.simulator import OwnLaw, Simulator
from viscopade.theory.law import VISCOELASTIC

_LINEAR = "Hooke", "Flores"
_KN = "N/m if Hooke or Flores, N/m^(5/2) if Hertz, N/m^(3/2) if PlainCoulomb"
_GN = "1/s if Hooke or Flores, 1/(s m^(3/2)) if Hertz, N s/m^(3/2) if PlainCoulomb"
# The least eps, 1e-15, stands for 0, of which no damping ratio can be computed: ln 0.
_ACCEPTED, _SOURCE = ("1e-15", "1"), "src/chrono/physics/ChContactSMC.cpp"
_MIXED = "ChContactMaterialCompositeSMC"

_USE = """\
Chrono, smooth contacts (SMC) with the Hertz model: give both bodies of a contact its material. Of two materials the
program takes the smaller restitution. Numbers are in {{ units.length }}, {{ units.mass }}, {{ units.time }}.
"""

_CODE = """\
#pragma once

#include <cmath>
#include <memory>
#include <stdexcept>
#include <string>

#include "chrono/physics/ChContactMaterialSMC.h"

namespace viscopade {

/// Return the material of both bodies of a contact; the radius is the effective one.
inline std::shared_ptr<chrono::ChContactMaterialSMC> material(const std::string& contact, double radius) {
  const double poisson = 0.3;
  const auto made = [&](double restitution, double stiffness) {
    auto found = std::make_shared<chrono::ChContactMaterialSMC>();
    found->SetRestitution(static_cast<float>(restitution));
    found->SetPoissonRatio(static_cast<float>(poisson));
    if (stiffness > 0)  // stiffness is 4/3 E_eff sqrt(radius)
      found->SetYoungModulus(static_cast<float>(1.5 * (1 - poisson * poisson) * stiffness / std::sqrt(radius)));
    return found;
  };
{% for contact in contacts %}
  if (contact == {{ contact.name | string }}) return made({{ contact.restitution }}, {{
contact.stiffness if contact.stiffness is not none else 0 }});
{% endfor %}
  throw std::invalid_argument("no contact is named " + contact);
}

}  // namespace viscopade
"""


def _force(values: native.Values, impact: native.Impact) -> native.Power:
    """Return the force k x^a + c x^b v of a force model; `values` are those of both materials, in SI units.

    The effective mass and radius of the impact, in kg and m, count as the program takes them: a fixed body has a mass,
    too, and PlainCoulomb has the radius 1.
    """
    model, radius, mass = values["contact_force_model"], 1.0, impact.effective_mass
    formula = SIMULATOR.formula("SMC, Hooke" if model in _LINEAR else "SMC, Hertz")
    if "fixed_body_mass" in values:
        mass = 1 / (1 / mass + 1 / values["fixed_body_mass"])
    if model == "Hertz" or (model in _LINEAR and values["use_material_properties"] == "true"):
        radius = impact.effective_radius
    if values["use_material_properties"] == "false":
        # Hooke: kn x + m_eff gn v. Hertz: R_eff sqrt(x) times both. PlainCoulomb: sqrt(x) times both, and gn without
        # m_eff. With sqrt(x) these are viscoelastic laws, k x^(3/2) + c x^(1/2) v.
        k, c = values.mix("kn", native.MEAN, _MIXED), values.mix("gn", native.MEAN, _MIXED)
        c *= mass if model != "PlainCoulomb" else 1.0
        return native.Power(formula.law if model in _LINEAR else VISCOELASTIC, k * radius, c * radius)
    # Hertz: k = 4/3 E_eff sqrt(R_eff). Hooke: with k_H = 16/15 E_eff sqrt(R_eff) and the characteristic velocity u,
    # k = k_H (m u^2/k_H)^(1/5).
    modulus = native.effective_modulus(values, values["young_modulus"], values["poisson_ratio"], _MIXED)
    k = (16 / 15 if model in _LINEAR else 4 / 3) * modulus * math.sqrt(radius)
    if model in _LINEAR:
        k *= (mass * values["characteristic_velocity"] ** 2 / k) ** 0.2
    # c = kappa sqrt(k m), with the kappa of the formula for this eps, or for the least one that it accepts.
    restitution = values.mix("restitution", native.SMALLER, _MIXED)
    return native.power_force(formula, max(restitution, float(_ACCEPTED[0])), k, mass)


_NATIVE = native.Native(
    (
        native.Parameter("contact_force_model", default="Hertz", words=("Hertz", *_LINEAR, "PlainCoulomb")),
        native.Parameter("use_material_properties", default="true", words=("true", "false")),
        native.positive("young_modulus", "Pa", "2e5", per_body=True),
        native.poisson_ratios("poisson_ratio", "0.3"),
        native.restitution("restitution", "0.4", per_body=True),
        native.positive("characteristic_velocity", "m/s", "1"),
        native.Parameter("kn", "", "2e5", f"a number > 0: in {_KN}", lambda pair: min(pair) > 0, per_body=True),
        native.Parameter("gn", "", "40", f"a number >= 0: in {_GN}", per_body=True),
        native.positive("fixed_body_mass", "kg"),
    ),
    _force,
    _SOURCE,
    schemes={
        **dict.fromkeys(("EULER_IMPLICIT_LINEARIZED", "EULER_IMPLICIT_PROJECTED", "EULER_IMPLICIT"), SEMI_IMPLICIT),
        "EULER_EXPLICIT": FORWARD,
        **dict.fromkeys(("HEUN", "RUNGEKUTTA45"), TAYLOR),
    },
    integrator="timestepper",
    damping=lambda values: "restitution" if values["use_material_properties"] == "true" else "gn",
)

SIMULATOR = Simulator(
    "chrono",
    "Chrono",
    "commit 2b57579",
    formulas(
        "cr_eff",
        _ACCEPTED,
        _SOURCE,
        ("SMC, Hertz", TSUJI, tsuji_kappa, "other end"),
        ("SMC, Hooke", LINEAR, linear_kappa, "other end"),
    ),
    texts={"chrono": OwnLaw("SMC, Hertz", "restitution", "//", _USE, _CODE)},
    lines={"any": "material->SetRestitution({parameter}f);"},
    native=_NATIVE,
)
