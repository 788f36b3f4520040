"""JaxDEM: the linear contact `cundallstrack` with a coefficient of restitution.

    material = jaxdem.Material.create("elasticfrict", density=2500, young=1e6, poisson=0.3, mu=0, e=0.9)
    system = jaxdem.System.create(..., force_model_type="cundallstrack", linear_integrator_type="verlet")

Read in jaxdem of cdelv/JaxDEM:

- `CundallStrackForce.force` of forces/cundall_strack.py (commit 02f0627): c from the damping ratio for contact that
  ends at x = 0; a force that would pull is 0. k is the harmonic mean of E R of both spheres, e the smaller one.
- integrators/velocity_verlet.py (commit 0d7bcb9): the force is computed after half of the kick. direct_euler.py (commit
  0352c82), "euler", kicks and then drifts.
- `System.create` of system.py (commit 01296bd): dt = 0.005.
"""

from __future__ import annotations

from viscopade.collision.schemes import SEMI_IMPLICIT
from viscopade.simulators import native
from viscopade.simulators.formula import LINEAR, formulas, linear_kappa
from viscopade.simulators.simulator import OwnLaw, Simulator

_USE = """\
JaxDEM, force model "cundallstrack": give both particles of a contact its material. Of two materials the program takes
the smaller e. Numbers are in {{ units.length }}, {{ units.mass }}, {{ units.time }}.
"""

_CODE = '''
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

_SOURCE, _FORCE = "jaxdem/forces/cundall_strack.py", "CundallStrackForce.force"


def _force(values: native.Values, impact: native.Impact) -> native.Power:
    """Return the force k x + c v of two spheres of one radius.

    `values` are the numbers of the user's file by their names, pairs where both bodies have one (SI units). `impact`
    has the effective mass and radius, in kg and m.
    """
    # k is the harmonic mean of E R of both spheres. Two spheres of one radius R have R = 2 R_eff.
    k = 2 * impact.effective_radius * values.mix("young", native.HARMONIC, _FORCE)
    e = values.mix("e", native.SMALLER, _FORCE)
    # c = kappa sqrt(k m), with the kappa that the formula makes of e.
    return native.power_force(SIMULATOR.formula("cundallstrack"), e, k, impact.effective_mass)


_NATIVE = native.Native(
    (native.positive("young", "Pa", per_body=True), native.restitution("e", per_body=True)),
    _force,
    _SOURCE,
    schemes={"verlet": SEMI_IMPLICIT, "euler": SEMI_IMPLICIT},
    integrator="linear_integrator_type",
    damping="e",
)

SIMULATOR = Simulator(
    "jaxdem",
    "JaxDEM",
    "commit 02f0627",
    formulas("e", ("1e-6", "1"), _SOURCE, ("cundallstrack", LINEAR, linear_kappa, "other end")),
    texts={"jaxdem": OwnLaw("cundallstrack", "restitution", "#", _USE, _CODE)},
    lines={"any": 'Material.create("elasticfrict", e={parameter}, …)'},
    native=_NATIVE,
    default_step=0.005,
)
