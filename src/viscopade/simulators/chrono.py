"""Chrono: smooth contacts (SMC) with a coefficient of restitution.

Read in src/chrono/physics/ChContactSMC.cpp of projectchrono/chrono at commit 2b57579, `CalculateForceTorque`:

- Hooke: c from the damping ratio for contact that ends at x = 0. Hertz: Tsuji's damping with the same ratio.
- A force that would pull is 0, without adhesion. Flores counts as Hooke.

The default time stepper is `ChTimestepperEulerImplicitLinearized` of src/chrono/timestepper/ChTimestepperImplicit.cpp
(commit 071a3d8). It takes contact forces from the start of the step, unless contacts are set to be stiff, and moves
with the new velocity: semi-implicit Euler's method.
"""

from __future__ import annotations

from viscopade.simulators.formula import LINEAR, TSUJI, DampingFormula, linear_kappa, tsuji_kappa
from viscopade.simulators.simulator import OwnLaw, Simulator

_E, _ACCEPTED, _SOURCE = "cr_eff", ("1e-15", "1"), "src/chrono/physics/ChContactSMC.cpp"

_TEXT = """\
// {{ marker }}
//
{{ opening | lines("// {}") }}
//
// Chrono, smooth contacts (SMC) with the Hertz model: give both bodies of a contact its material. Of two materials the
// program takes the smaller restitution. Numbers are in {{ units.length }}, {{ units.mass }}, {{ units.time }}.
//
{% for contact in contacts %}
{{ contact.lines | lines("// {}") }}
{% endfor %}
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

SIMULATOR = Simulator(
    "chrono",
    "Chrono",
    "commit 2b57579",
    (
        DampingFormula("SMC, Hertz", TSUJI, _E, tsuji_kappa, _ACCEPTED, "other end", _SOURCE),
        DampingFormula("SMC, Hooke", LINEAR, _E, linear_kappa, _ACCEPTED, "other end", _SOURCE),
    ),
    texts={"chrono": OwnLaw("SMC, Hertz", "restitution", _TEXT)},
    lines={"any": "material->SetRestitution({parameter}f);"},
)
