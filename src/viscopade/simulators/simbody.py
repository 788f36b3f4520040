"""Simbody and OpenSim: the dissipation c of `HuntCrossleyForce`.

    force.setStiffness(1e9); force.setDissipation(0.5);                  OpenSim: HuntCrossleyForce
    force.setBodyParameters(surface, 1e9, 0.5, 0, 0, 0);                 Simbody, C++: stiffness, dissipation, friction

Read in Simbody of simbody/simbody at commit f312d0d:

- `HuntCrossleyForceImpl::calcForce` of src/HuntCrossleyForce.cpp: f = f_Hertz (1 + 3/2 c x'), a value below 0 is 0,
  f_Hertz = 4/3 sqrt(R_eff) (k x)^(3/2). With k_i the stiffness^(2/3) of each body (HuntCrossleyForceImpl.h, commit
  178eb21), k = k_1 k_2/(k_1 + k_2) and c = s_1 c_1 + s_2 c_2, s_1 = k_2/(k_1 + k_2).
- `ContactMaterial::calcDissipationFromObservedRestitution` of include/simbody/internal/ContactSurface.h: c = (1 - e)/v,
  which the file says is for small v.

OpenSim hands the `dissipation` of its `HuntCrossleyForce` to Simbody's. The integrators choose their own steps.
"""

from __future__ import annotations

import math

from mpmath import mp

from viscopade.simulators.formula import DampingFormula
from viscopade.simulators.native import SERIES, Impact, Native, Parameter, Power, Values, weighted_mean
from viscopade.simulators.simulator import OwnLaw, Simulator
from viscopade.theory.law import law_of

_LAW = law_of("hunt-crossley:3/2")  # k x^(3/2) + c x^(3/2) x', with the end at force 0
_CALC_FORCE = "HuntCrossleyForceImpl::calcForce"
_FORMULA = "HuntCrossleyForce, calcDissipationFromObservedRestitution"


def _force(values: Values, impact: Impact) -> Power:
    """Return the force k x^a + c x^b v of two materials: springs in series, and dissipation by their compressions.

    `values` are pairs of numbers of both bodies, stiffness in Pa and dissipation in s/m. `values.mix` makes one number
    of both by a rule, and remembers it for the answer.
    """
    # k_i = stiffness^(2/3), k = k_1 k_2/(k_1 + k_2), and c = s_1 c_1 + s_2 c_2 with s_1 = k_2/(k_1 + k_2)
    first, second = (stiffness ** (2 / 3) for stiffness in values["stiffness"])
    spring = values.mix("stiffness^(2/3)", SERIES, _CALC_FORCE, (first, second))
    by_compression = weighted_mean((second, first), "the other body's stiffness^(2/3)")
    # f_Hertz = 4/3 sqrt(R_eff) (k x)^(3/2), times 1 + 3/2 c x'
    k = 4 / 3 * math.sqrt(impact.effective_radius) * spring**1.5
    return Power(_LAW, k, 1.5 * k * values.mix("dissipation", by_compression, _CALC_FORCE))


_NATIVE = Native(
    (
        Parameter("stiffness", "Pa", None, "a number > 0", lambda pair: min(pair) > 0, per_body=True),
        Parameter("dissipation", "s/m", "0", per_body=True),
    ),
    _force,
    "Simbody/src/HuntCrossleyForce.cpp",
    schemes={"RungeKuttaMerson": None},
    integrator="integrator",
    damping="dissipation",
)

_USE = """\
OpenSim and Simbody, HuntCrossleyForce: give both bodies of a contact its dissipation and its stiffness.
    force.setDissipation(DISSIPATION["..."]), force.setStiffness(stiffness("...", radius))    in OpenSim
    force.setBodyParameters(surface, stiffness, dissipation, 0, 0, 0)                         in Simbody, C++
Numbers are in {{ units.length }}, {{ units.mass }}, {{ units.time }}.
"""

_CODE = '''
DISSIPATION = {
{% for contact in contacts %}
    {{ contact.name | string }}: {{ contact.dissipation }},
{% endfor %}
}
# k of the force k x^(3/2) (1 + 3/2 dissipation x'); None if nothing says how stiff the contact is.
STIFFNESS = {
{% for contact in contacts %}
    {{ contact.name | string }}: {{ contact.stiffness if contact.stiffness is not none else "None" }},
{% endfor %}
}


def stiffness(contact, radius):
    """Return the stiffness of both materials of a contact, with its effective radius: of two springs in series."""
    return 2**1.5 * 0.75 * STIFFNESS[contact] / radius**0.5
'''

SIMULATOR = Simulator(
    "simbody",
    "Simbody and OpenSim",
    "commit f312d0d",
    (
        DampingFormula(
            _FORMULA,
            _LAW,
            "c v",
            lambda cv: mp.mpf(3) / 2 * cv,  # kappa of f_Hertz (1 + 3/2 c x')
            ("0", "1e6"),  # by hand; eps is then about 1e-6
            "approximate formula",
            "Simbody/src/HuntCrossleyForce.cpp",
            usual_parameter=lambda e: 1 - e,
            scheme=None,
        ),
    ),
    texts={"simbody": OwnLaw(_FORMULA, "dissipation", "#", _USE, _CODE, per_speed=True)},
    lines={"any": "force.setDissipation({parameter})  # exact at {speed} m/s"},
    native=_NATIVE,
)
