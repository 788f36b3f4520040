"""MuJoCo: `solref` of contacts, in both forms.

Read in src/engine of MuJoCo 3.12.1 (google-deepmind/mujoco at commit a725507):

- `mj_referenceConstraint` and `mj_makeImpedance` of engine_core_constraint.c, at penetration r, with d = d(r) of
  `solimp` = d_0 d_width width midpoint power: one body is accelerated by d (B r' + K d r), a value below 0 is 0. With
  `solref` = timeconst dampratio: K = 1/(d_width timeconst dampratio)^2, B = 2/(d_width timeconst). With `solref` =
  -stiffness -damping: K = stiffness/d_width^2, B = damping/d_width.
- So d^2 multiplies the spring and d the dashpot: a constant d leaves the damping ratio. With d_0 = d_width the contact
  is x'' + damping x' + stiffness x = 0, exactly. The default `solimp` changes eps by less than 0.005.
- All are per effective mass: eps depends on no mass. That of free bodies is exact. A contact whose friction resists
  torsion or rolling (`condim` 4 or 6) in the default pyramidal cone has another, smaller eps.
- `timeconst` counts as two time steps at least (flag `refsafe`), which is not computed here: it matters from
  1/(2 pi dampratio) contact times a step on.

`mj_Euler` and `mj_implicit` kick with the force at the start of a step and then drift, which is semi-implicit Euler's
method: implicitfast takes no derivative of contact forces. `mj_RungeKutta` is the classical method.
"""

from __future__ import annotations

from mpmath import mp

from viscopade.collision.schemes import RUNGE_KUTTA, SEMI_IMPLICIT, Scheme
from viscopade.simulators.formula import LINEAR, DampingFormula, linear_kappa, ratio_for_return
from viscopade.simulators.simulator import OwnLaw, Simulator

_SOURCE = "src/engine/engine_core_constraint.c"


def _direct(name: str, scheme: Scheme) -> DampingFormula:
    """Return the formula of a negative solref."""
    parameter, accepted = "damping/sqrt(stiffness)", ("0", "1e3")
    return DampingFormula(name, LINEAR, parameter, mp.mpf, accepted, "other end", _SOURCE, linear_kappa, scheme=scheme)


_TEXT = """\
<!--
    {{ marker | xml_comment }}

{{ opening | lines("    {}") | xml_comment }}

    MuJoCo: <include file="..."/> this file in a model and give geoms, or pairs, class="...". Of two geoms in contact
    both must have the class; a pair needs it alone. The numbers are per mass: eps depends on no mass.
    They are in {{ units.length }} and {{ units.time
}}. solimp has a constant impedance: with another one eps is off by up to 0.005.
    A condim of 4 or 6 needs <option cone="elliptic"/>.
    A comment may not contain two hyphens: a shell reads -\\- as these.

{% for contact in contacts %}
{{ contact.lines | lines("    {}") | xml_comment }}
{% endfor %}
-->
<mujocoinclude>
  <default>
{% for contact in contacts %}
    <default class="{{ contact.name | e }}">
      <geom solref="-{{ contact.stiffness }} -{{ contact.damping }}" solimp="0.9 0.9 0.001"/>
      <pair solref="-{{ contact.stiffness }} -{{ contact.damping }}" solimp="0.9 0.9 0.001"/>
    </default>
{% endfor %}
  </default>
</mujocoinclude>
"""

SIMULATOR = Simulator(
    "mujoco",
    "MuJoCo",
    "MuJoCo 3.12.1, commit a725507",
    (
        DampingFormula(
            "solref = timeconst dampratio",
            LINEAR,
            "dampratio",
            lambda ratio: 2 * ratio,
            ("1e-9", "1e3"),
            "other end",
            _SOURCE,
            written=ratio_for_return,
            note="The first two numbers of solimp are equal.",
        ),
        _direct("solref = -stiffness -damping", SEMI_IMPLICIT),
        _direct("solref = -stiffness -damping, RK4", RUNGE_KUTTA),
    ),
    texts={"mujoco": OwnLaw("solref = -stiffness -damping", "damping", _TEXT, per_mass=True)},
    lines={"any": '<geom solref="-{stiffness} -{parameter}" solimp="0.9 0.9 0.001"/>'},
)
