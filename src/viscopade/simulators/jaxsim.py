"""JaxSim: `K`, `D`, `p` and `q` of its soft contacts.

    SoftContactsParams.build(K=1e6, D=2000, mu=0.5, p=0.5, q=0.5)

Read in ami-iit/jaxsim at commit 98939044 (run: 0.8.2):

- `SoftContacts.hunt_crossley_contact_model` of src/jaxsim/rbda/contacts/soft.py: the force of each collidable point,
  max(0, K x^(1 + p) + D x^q x'). With p = q = 1/2, the defaults, this is the viscoelastic law.
- src/jaxsim/api/integrators.py: semi-implicit Euler's method, the default, and the classical Runge-Kutta method.
  `JaxSimModel` of api/model.py has a time step of 1 ms. Its default contact is RelaxedRigidContacts, which is not
  computed here.
"""

from __future__ import annotations

import numpy as np

from viscopade.arrays.checked import FloatArray
from viscopade.collision.contact import Contact
from viscopade.collision.schemes import RUNGE_KUTTA, SEMI_IMPLICIT
from viscopade.simulators import native
from viscopade.simulators.formula import viscoelastic_formula
from viscopade.simulators.simulator import Simulator

_SOURCE = "src/jaxsim/rbda/contacts/soft.py"


def _contact(values: native.Values, impact: native.Impact) -> Contact:
    """Return the contact of one collidable point, K x^(1 + p) + D x^q x', with the mass and weight of an impact.

    `values` are the numbers of the user's file by their names, in SI units.
    """
    K, D, p, q = (values[name] for name in ("K", "D", "p", "q"))
    mass = impact.effective_mass

    def force(x: FloatArray, v: FloatArray) -> FloatArray:
        return np.asarray(K * x ** (1 + p) + D * x**q * v)

    return Contact(force, mass, mass * impact.gravity)


def _damping_values(values: native.Values, c: float, impact: native.Impact) -> dict[str, float]:
    """Return D, by name, for a damping c, a number without unit: the share of the momentum that the damper takes."""
    K, p, q, mass, speed = values["K"], values["p"], values["q"], impact.effective_mass, impact.speed
    # K depth^(2 + p)/(2 + p) = m v^2/2, the depth without damping. A damper D depth^q v over this way takes about the
    # momentum D depth^q depth, which is to be c m v.
    depth = ((2 + p) / 2 * mass * speed**2 / K) ** (1 / (2 + p))
    return {"D": c * mass * speed / depth ** (1 + q)}


SIMULATOR = Simulator(
    "jaxsim",
    "JaxSim",
    "commit 98939044; 0.8.2 was run",
    (viscoelastic_formula("p = q = 1/2", _SOURCE, "D follows from kappa, K, the mass and the speed."),),
    native=native.Native(
        (
            native.positive("K", "", "1e6"),
            native.Parameter("D", "", "2000"),
            native.Parameter("p", "", "0.5"),
            native.Parameter("q", "", "0.5"),
        ),
        _contact,
        _SOURCE,
        schemes={"SemiImplicitEuler": SEMI_IMPLICIT, "RungeKutta4": RUNGE_KUTTA},
        integrator="integrator",
        damped_values=_damping_values,
        warnings=lambda values, impact: ("This is SoftContacts; RelaxedRigidContacts is JaxSim's default",),
    ),
    default_step=0.001,
)
