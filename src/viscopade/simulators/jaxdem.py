"""JaxDEM: the linear contact `cundallstrack` with a coefficient of restitution.

Read in jaxdem of cdelv/JaxDEM:

- `CundallStrackForce.force` of forces/cundall_strack.py (commit 02f0627): c from the damping ratio for contact that
  ends at x = 0; a force that would pull is 0.
- integrators/velocity_verlet.py (commit 0d7bcb9): the force is computed after half of the kick.
"""

from __future__ import annotations

from viscopade.simulators.formula import LINEAR, DampingFormula, linear_kappa
from viscopade.simulators.simulator import OwnLaw, Simulator

_TEXT = '''\
# {{ marker }}
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

SIMULATOR = Simulator(
    "jaxdem",
    "JaxDEM",
    "commit 02f0627",
    (
        DampingFormula(
            "cundallstrack", LINEAR, "e", linear_kappa, ("1e-6", "1"), "other end", "jaxdem/forces/cundall_strack.py"
        ),
    ),
    texts={"jaxdem": OwnLaw("cundallstrack", "restitution", _TEXT)},
    lines={"any": 'Material.create("elasticfrict", e={parameter}, …)'},
)
