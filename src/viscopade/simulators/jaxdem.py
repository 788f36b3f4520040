"""JaxDEM: the linear contact `cundallstrack` with a coefficient of restitution.

Read in jaxdem of cdelv/JaxDEM:

- `CundallStrackForce.force` of forces/cundall_strack.py (commit 02f0627): c from the damping ratio for contact that
  ends at x = 0; a force that would pull is 0. k is the harmonic mean of E R of both spheres.
- integrators/velocity_verlet.py (commit 0d7bcb9): the force is computed after half of the kick. direct_euler.py (commit
  0352c82), "euler", kicks and then drifts.
"""

from __future__ import annotations

import math

from mpmath import mp

from viscopade.collision.contact import Contact
from viscopade.collision.schemes import SEMI_IMPLICIT
from viscopade.simulators import native
from viscopade.simulators.formula import LINEAR, DampingFormula, linear_kappa
from viscopade.simulators.simulator import OwnLaw, Simulator

_TEXT = '''\
{{ marker | lines("# {}") }}
#
{{ opening | lines("# {}") }}
#
# JaxDEM, force model "cundallstrack": give both particles of a contact its material. Of two materials the program takes
# the smaller e. Numbers are in {{ units.length }}, {{ units.mass }}, {{ units.time }}.
#
{% for contact in contacts %}
{{ contact.lines | lines("# {}") }}
{% endfor %}

RESTITUTION = {
{% for contact in contacts %}
    {{ contact.name | string }}: {{ contact.restitution }},
{% endfor %}
}
# k of the force k x; None if nothing says how stiff the contact is.
STIFFNESS = {
{% for contact in contacts %}
    {{ contact.name | string }}: {{ contact.stiffness if contact.stiffness is not none else "None" }},
{% endfor %}
}


def material(contact, radius, density, poisson=0.3, mu=0.0):
    """Return the material of both particles of a contact, which have the same radius."""
    import jaxdem

    young = STIFFNESS[contact] / radius
    return jaxdem.Material.create(
        "elasticfrict", density=density, young=young, poisson=poisson, mu=mu, e=RESTITUTION[contact]
    )
'''

_SOURCE = "jaxdem/forces/cundall_strack.py"


def _contact(values: native.Values, impact: native.Impact) -> Contact:
    """Return the contact of two spheres of one radius."""
    (one, other), mass, e = values["young"], impact.effective_mass, min(values["e"])
    k = 4 * impact.effective_radius * one * other / (one + other)
    return native.law_contact(LINEAR, k, float(linear_kappa(mp.mpf(e))) * math.sqrt(k * mass), impact)


_NATIVE = native.Native(
    (native.positive("young", "Pa", both=True), native.restitution("e", both=True)),
    _contact,
    _SOURCE,
    schemes={"verlet": SEMI_IMPLICIT, "euler": SEMI_IMPLICIT},
    integrator="linear_integrator_type",
    damped=lambda values, damping, impact: {"e": (max(math.exp(-damping), 1e-6),) * 2},
)

SIMULATOR = Simulator(
    "jaxdem",
    "JaxDEM",
    "commit 02f0627",
    (DampingFormula("cundallstrack", LINEAR, "e", linear_kappa, ("1e-6", "1"), "other end", _SOURCE),),
    texts={"jaxdem": OwnLaw("cundallstrack", "restitution", _TEXT)},
    lines={"any": 'Material.create("elasticfrict", e={parameter}, …)'},
    native=_NATIVE,
)
