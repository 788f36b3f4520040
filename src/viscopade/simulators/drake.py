"""Drake: compliant point contact, with `hunt_crossley_dissipation` d or, in the approximation SAP, `relaxation_time`.

    <drake:point_contact_stiffness>1e6</drake:point_contact_stiffness>
    <drake:hunt_crossley_dissipation>0.5</drake:hunt_crossley_dissipation>        in a collision of SDFormat or URDF
    AddContactMaterial(dissipation=0.5, point_stiffness=1e6, friction=…, properties=…)        in Python

Read in multibody of Drake (RobotLocomotion/drake at commit be259df):

- plant/multibody_plant.cc and contact_model_doxygen.h: with time step 0 the force is k x (1 + d x'), a value below 0
  is 0: Hunt-Crossley with n = 1.
- plant/contact_properties.cc (commit 0bf2525): two materials combine to k = k_A k_B/(k_A + k_B), to
  d = (k_B d_A + k_A d_B)/(k_A + k_B), and to the sum tau of both `relaxation_time`.
- contact_solvers/sap/sap_hunt_crossley_constraint.cc (approximations Lagged, the default, and Similar) and
  plant/tamsi_solver.cc (Tamsi): in head-on collisions all three have the impulse h k (x + h w) (1 + d w), w being the
  rate of compression at the step's end.
- contact_solvers/sap/sap_friction_cone_constraint.cc (Sap): the impulse is h k (x + (h + tau) w), a linear dashpot
  with c = k tau. Stiff contacts, h k (h + tau) > 39 m, are softened, which
  needs steps of nearly a contact time and is not computed here. d is not used.
- plant/contact_defaults_doxygen.h: "the inverse of the dissipation parameter, d, is the maximum bounce speed", with a
  reference to Hunt and Crossley (1975), whose d is 3 (1 - e)/(2 v).

A step that begins without contact has no force. `MultibodyPlantConfig` (plant/multibody_plant_config.h, commit 007f5fc)
has a time step of 0.001 s.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Iterator
from typing import Any

from mpmath import mp

from viscopade.collision.schemes import IMPLICIT, Scheme
from viscopade.simulators.formula import LINEAR, DampingFormula, linear_kappa
from viscopade.simulators.native import SERIES, SUM, Impact, Native, Parameter, Power, Values, weighted_mean
from viscopade.simulators.simulator import OwnLaw, Simulator
from viscopade.theory.law import law_of

_LAW = law_of("hunt-crossley:1")  # k x + c x x', with the end at force 0


def _hunt_crossley(
    name: str, written: Callable[[Any], Any], source: str, scheme: Scheme | None = None
) -> DampingFormula:
    """Return a formula of the audit for the dissipation d, in s/m, whose parameter is d v; v is the impact speed.

    Parameters
    ----------
    name : str
        Its row in the audit.
    written : callable
        From an eps to the d v that people write for it, both mpmath numbers.
    source : str
        File in Drake's folder `multibody`.
    scheme : Scheme, optional
        Integrator of a discrete approximation; None for the continuous one.
    """
    # kappa of k x (1 + d x') is d v. The largest one, 1e6, is chosen by hand: eps is then about 1e-6.
    accepted = ("0", "1e6")
    return DampingFormula(
        name, _LAW, "d v", mp.mpf, accepted, "approximate formula", f"multibody/{source}", written, scheme=scheme
    )


def first_order(e: Any) -> Any:
    """Return d v for eps = e by Hunt and Crossley, right for small losses; both are mpmath numbers."""
    # 1 - eps = 2/3 d v to first order in d v
    return 3 * (1 - e) / 2


def largest_bounce(e: Any) -> Any:
    """Return d v for a largest bounce of e v, an mpmath number: 1/d is the "maximum bounce speed" of Drake's manual."""
    return 1 / e


_CONTINUOUS, _DISCRETE = "plant/contact_defaults_doxygen.h", "contact_solvers/sap/sap_hunt_crossley_constraint.cc"

# h k (h + tau)/m from which on the approximation sap takes a contact for rigid: its regularization 1/(h k (h + tau)) is
# at least beta^2/(4 pi^2 m), with beta = 1.
_RIGID = 4 * math.pi**2


def _force(values: Values, _: Impact) -> Power:
    """Return the force k x^a + c x^b v of an approximation; `values` are pairs of numbers of two materials (SI units).

    `values.mix` makes one number of both by a rule, and remembers it for the answer.
    """
    # k = k_A k_B/(k_A + k_B), and d = (k_B d_A + k_A d_B)/(k_A + k_B): the stiffer body is compressed less, and
    # dissipates less. In sap c = k tau.
    stiffness_A, stiffness_B = values["point_stiffness"]
    by_compression = weighted_mean((stiffness_B, stiffness_A), "the other body's stiffness")
    k = values.mix("point_stiffness", SERIES, "GetCombinedPointContactStiffness")
    if values["discrete_contact_approximation"] == "sap":
        return Power(LINEAR, k, k * values.mix("relaxation_time", SUM, "GetCombinedDissipationTimeConstant"))
    # k x (1 + d x'): c = k d
    d = values.mix("hunt_crossley_dissipation", by_compression, "GetCombinedHuntCrossleyDissipation")
    return Power(_LAW, k, k * d)


def _damping(values: Values) -> str:
    """Return the parameter that is the damping in an approximation."""
    sap = values["discrete_contact_approximation"] == "sap"
    return "relaxation_time" if sap else "hunt_crossley_dissipation"


def _warnings(values: Values, impact: Impact) -> Iterator[str]:
    """Yield a warning that the approximation sap softens the contact, with h k (h + tau) > 4 pi^2 m."""
    if impact.step is not None and values["discrete_contact_approximation"] == "sap":
        _, k, k_tau = _force(values, impact)
        if impact.step * (impact.step * k + k_tau) > _RIGID * impact.effective_mass:
            yield "So stiff a contact is softened by Drake's approximation sap, which is not computed here"


_NATIVE = Native(
    (
        Parameter("point_stiffness", "N/m", "1e6", "a number > 0", lambda pair: min(pair) > 0, per_body=True),
        Parameter("hunt_crossley_dissipation", "s/m", "50", per_body=True),
        Parameter("relaxation_time", "s", "0.1", per_body=True),
    ),
    _force,
    f"multibody/{_DISCRETE}",
    schemes={"lagged": IMPLICIT, "similar": IMPLICIT, "tamsi": IMPLICIT, "sap": IMPLICIT, "continuous": None},
    integrator="discrete_contact_approximation",
    damping=_damping,
    warnings=_warnings,
    hints={
        "point_contact_stiffness": "point_stiffness, its name in AddContactMaterial",
        "hydroelastic_modulus": "point contact, as hydroelastic contact is not computed here",
    },
)

_USE = """\
Drake, compliant point contact: give both bodies of a contact its properties, properties("...").
In SDFormat and URDF the tags are drake:hunt_crossley_dissipation and drake:point_contact_stiffness.
{% if time_step is none %}
The dissipation is for continuous contact, or for short time steps of the discrete approximations lagged, similar and
tamsi. The approximation sap does not use it.
{% else %}
The dissipation is for the discrete approximations lagged, similar and tamsi with this time step. sap does not use it.
{% endif %}
Two bodies in contact have half of the stiffness that both have.
Numbers are in {{ units.length }}, {{ units.mass }}, {{ units.time }}.
"""

_CODE = '''
from pydrake.geometry import AddContactMaterial, ProximityProperties

CONTACTS = {
{% for contact in contacts %}
    {{ contact.name | string }}: {"dissipation": {{ contact.dissipation }}{% if contact.stiffness is not none
%}, "point_stiffness": 2 * {{ contact.stiffness }}{% endif %}},
{% endfor %}
}


def properties(contact, friction=None):
    """Return the ProximityProperties of both bodies of a contact; friction is a CoulombFriction."""
    found = ProximityProperties()
    AddContactMaterial(friction=friction, properties=found, **CONTACTS[contact])
    return found
'''

SIMULATOR = Simulator(
    "drake",
    "Drake",
    "commit be259df",
    (
        _hunt_crossley("continuous, d = 3 (1 - e)/(2 v)", first_order, _CONTINUOUS),
        _hunt_crossley("continuous, d = 1/(e v)", largest_bounce, _CONTINUOUS),
        _hunt_crossley("lagged, similar or tamsi, d = 3 (1 - e)/(2 v)", first_order, _DISCRETE, IMPLICIT),
        _hunt_crossley("lagged, similar or tamsi, d = 1/(e v)", largest_bounce, _DISCRETE, IMPLICIT),
        DampingFormula(
            "sap, relaxation_time",
            LINEAR,
            "tau sqrt(k/m)",
            mp.mpf,
            ("0", "1e3"),
            "other end",
            "multibody/contact_solvers/sap/sap_friction_cone_constraint.cc",
            linear_kappa,
            note="tau is the sum of both materials' relaxation_time, and m the effective mass.",
            scheme=IMPLICIT,
        ),
    ),
    texts={
        "drake": OwnLaw(
            "lagged, similar or tamsi, d = 3 (1 - e)/(2 v)", "dissipation", "#", _USE, _CODE, per_speed=True
        )
    },
    lines={"any": "AddContactMaterial(dissipation={parameter}, properties=properties)  # exact at {speed} m/s"},
    native=_NATIVE,
    default_step=0.001,
)
