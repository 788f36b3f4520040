"""MuJoCo: `solref` of contacts, in both forms.

    <geom solref="0.02 1" solimp="0.9 0.95 0.001 0.5 2" priority="1"/>     timeconst in s, dampratio
    <geom solref="-2500 -100" solimp="0.9 0.9 0.001"/>                     -stiffness in 1/s^2, -damping in 1/s
    <option timestep="0.002" cone="pyramidal" integrator="Euler"/>

Read in src/engine of MuJoCo 3.12.1 (google-deepmind/mujoco at commit a725507):

- `mj_referenceConstraint` and `mj_makeImpedance` of engine_core_constraint.c, at penetration r, with d = d(r) of
  `solimp` = d_0 d_width width midpoint power: one body is accelerated by d (B r' + K d r), a value below 0 is 0. With
  `solref` = timeconst dampratio: K = 1/(d_width timeconst dampratio)^2, B = 2/(d_width timeconst). With `solref` =
  -stiffness -damping: K = stiffness/d_width^2, B = damping/d_width.
- So d^2 multiplies the spring and d the dashpot: a constant d leaves the damping ratio. With d_0 = d_width the contact
  is x'' + damping x' + stiffness x = 0, exactly. The default `solimp` changes eps by less than 0.005.
- All are per effective mass: eps depends on no mass. That of free bodies is exact.
- With friction in the pyramidal cone, the default, 2 (condim - 1) edges share the force, and the impedance becomes d'
  with (1 - d')/d' = q (1 - d)/d, q = mu^2 (1 + mu^2)/(impratio (condim - 1)); q = 1 in the elliptic cone and without
  friction. The force per mass is max(0, d' (g + B x' + d K x)): d' multiplies a part of the weight as well (g).
- `timeconst` counts as two time steps at least (flag `refsafe`).
- `mj_contactParam` of engine_collision_driver.c mixes the numbers of two geoms (`rules` below).

`mj_defaultOption` of engine_init.c has a time step of 0.002. `mj_Euler` and `mj_implicit` kick with the force at the
start of a step and then drift, which is semi-implicit Euler's method: implicitfast takes no derivative of contact
forces. `mj_RungeKutta` is the classical method.
"""

from __future__ import annotations

import math
from collections.abc import Iterator
from typing import Any, NamedTuple

import numpy as np
from mpmath import mp

from viscopade.arrays.checked import FloatArray
from viscopade.collision.contact import Contact
from viscopade.collision.schemes import RUNGE_KUTTA, SEMI_IMPLICIT, Scheme
from viscopade.simulators.formula import LINEAR, DampingFormula, linear_kappa, ratio_for_return
from viscopade.simulators.native import (
    LARGER,
    MEAN,
    SMALLER,
    Impact,
    Native,
    Parameter,
    Rule,
    Values,
    weighted_mean,
)
from viscopade.simulators.simulator import OwnLaw, Simulator

_SOURCE = "src/engine/engine_core_constraint.c"


def _direct(name: str, scheme: Scheme) -> DampingFormula:
    """Return the formula called `name` of a negative solref: people take exp(-pi zeta/w) for its eps."""
    # kappa of x'' + damping x' + stiffness x = 0 is the parameter itself. eps -> kappa^-2 is 1e-6 at the largest one.
    parameter, accepted = "damping/sqrt(stiffness)", ("0", "1e3")
    return DampingFormula(name, LINEAR, parameter, mp.mpf, accepted, "other end", _SOURCE, linear_kappa, scheme=scheme)


# Longest timeconst, in s, of which no warning says that stiffness and damping need minus signs; chosen by hand between
# time constants of contacts, below 1 s, and stiffnesses, such as 2500.
_LONGEST = 10.0
_LEAST, _LARGEST = 1e-4, 0.9999  # impedance, and its midpoint: mjMINIMP and mjMAXIMP
_LEAST_FRICTION = 1e-5  # mjMINMU
_LEAST_SOLMIX = 1e-15  # mjMINVAL


def impedance(solimp: tuple[float, ...], x: FloatArray) -> FloatArray:
    """Return the impedance d at penetrations `x`, a length, as `getimpedance` does; it has no unit.

    `solimp` is d_0 d_width width midpoint power: d rises from d_0 at x = 0 to d_width at the width.
    """
    # mjMINIMP = 1e-4 and mjMAXIMP = 0.9999 limit both impedances and the midpoint. Equal impedances, or no width, make
    # d constant.
    d_0, d_width, width, midpoint, power = solimp
    d_0, d_width, midpoint = (min(max(number, _LEAST), _LARGEST) for number in (d_0, d_width, midpoint))
    if d_0 == d_width or width <= 0:
        return np.full_like(x, (d_0 + d_width) / 2)
    # With s = x/width, the midpoint m and the power p: (d - d_0)/(d_width - d_0) is s^p/m^(p-1) for s <= m, and
    # 1 - (1 - s)^p/(1 - m)^(p-1) above.
    power, s = max(power, 1), np.minimum(x / width, 1)
    below_midpoint = s**power / midpoint ** (power - 1)
    above_midpoint = 1 - (1 - s) ** power / (1 - midpoint) ** (power - 1)
    return np.asarray(d_0 + (d_width - d_0) * np.where(s <= midpoint, below_midpoint, above_midpoint))


class Surface(NamedTuple):
    """What a geom says of its contacts, or what a contact has of both geoms; fields as in MJCF."""

    priority: float
    solmix: float
    condim: float
    solref: tuple[float, ...]
    solimp: tuple[float, ...]
    friction: tuple[float, ...]


def rules(first: Surface, second: Surface) -> dict[str, Rule]:
    """Return the rules, by the name of a number, by which a contact has it of two geoms (`mj_contactParam`)."""
    # A geom with a higher priority decides all.
    if first.priority != second.priority:
        first_decides = first.priority > second.priority
        higher = Rule("that of the higher priority", lambda x, y: x if first_decides else y)
        return dict.fromkeys(("condim", "solref", "solimp", "friction"), higher)
    # The weights are solmix, which counts as 0 below mjMINVAL = 1e-15, and equal if both are 0.
    weights = [solmix if solmix >= _LEAST_SOLMIX else 0.0 for solmix in (first.solmix, second.solmix)]
    mean = weighted_mean((weights[0], weights[1]), "solmix") if any(weights) else MEAN
    # Stiffness and damping, which are negative in the file, have no mean: the larger one of each counts, which is the
    # smaller number. Times, of which both are > 0, have one.
    times = first.solref[0] > 0 and second.solref[0] > 0
    return {"condim": LARGER, "solref": mean if times else SMALLER, "solimp": mean, "friction": LARGER}


def mixed_surface(first: Surface, second: Surface) -> tuple[Surface, str]:
    """Return the surface of the contact of two geoms, and in words the rules of the numbers that differ."""
    numbers, words = {}, []
    for name, rule in rules(first, second).items():
        first_value, second_value = getattr(first, name), getattr(second, name)
        numbers[name] = rule.mix(first_value, second_value)
        words += [f"{name} is {rule.words.removesuffix(',')}"] if first_value != second_value else []
    # The priority has no rule: the higher one is that of the contact.
    return first._replace(priority=max(first.priority, second.priority), **numbers), ", ".join(words)


def _surface(values: Values) -> Surface:
    """Return the surface of the contact of both geoms of a user's file, whose `values` remember the rules."""
    # Each parameter has a value for each geom, 0 and 1.
    first, second = (Surface(*(values[name][geom] for name in Surface._fields)) for geom in (0, 1))
    return first._replace(
        **{name: values.mix(name, rule, "mj_contactParam") for name, rule in rules(first, second).items()}
    )


def stiffness_and_damping(solref: tuple[float, ...], values: Values, impact: Impact) -> tuple[float, float]:
    """Return stiffness (1/s^2) and damping (1/s) per effective mass of the `solref` of a contact, in either form.

    `values` are those of the user's file; of `impact` the time step counts, in s.
    """
    # -stiffness -damping
    if solref[0] <= 0:
        return -solref[0], -solref[1]
    # timeconst dampratio; with refsafe timeconst counts as two time steps at least (`mj_referenceConstraint`).
    timeconst, dampratio = solref
    if values["refsafe"] == "enable" and impact.step is not None:
        timeconst = max(timeconst, 2 * impact.step)
    return 1 / (timeconst * dampratio) ** 2, 2 / timeconst


def _contact(values: Values, impact: Impact) -> Contact:
    """Return the contact per effective mass: d' (g + B x' + d K x) at the penetration x, with the load g of weight.

    `values` are those of the user's file, and `impact` has gravity and time step, in SI units.
    """
    surface, g = _surface(values), impact.gravity
    stiffness, damping = stiffness_and_damping(surface.solref, values, impact)
    # d_width, the second number of solimp, and the number of directions in which a contact of this condim has friction.
    d_width, friction_directions = min(max(surface.solimp[1], _LEAST), _LARGEST), int(surface.condim) - 1
    # In the pyramidal cone q = mu^2 (1 + mu^2)/(impratio (condim - 1)), else 1 (see the head of this module).
    mu, q = max(surface.friction[0], _LEAST_FRICTION), 1.0
    if friction_directions and values["cone"] == "pyramidal":
        q = mu**2 * (1 + mu**2) / (values["impratio"] * friction_directions)

    def force(x: FloatArray, v: FloatArray) -> FloatArray:
        # (1 - d')/d' = q (1 - d)/d, solved for d'; B = damping/d_width, K = stiffness/d_width^2
        d = impedance(surface.solimp, x)
        d_of_cone = d / (d + q * (1 - d))
        return np.asarray(d_of_cone * (g + damping / d_width * v + d * stiffness / d_width**2 * x))

    return Contact(force, 1.0, g)


def _damped(values: Values, c: float, impact: Impact) -> dict[str, Any]:
    """Return the `solref` of both geoms, of the same stiffness with the damping c sqrt(stiffness), where c has no unit.

    `values` are those of the user's file; of `impact` the time step counts, in s.
    """
    # With root = sqrt(stiffness): damping = 2/timeconst = c root, and stiffness = 1/(timeconst dampratio)^2 gives
    # dampratio = c/2.
    solref = _surface(values).solref
    root = math.sqrt(stiffness_and_damping(solref, values, impact)[0])
    solref = (2 / (c * root), c / 2) if solref[0] > 0 else (-(root**2), -c * root)
    return {"solref": (solref, solref)}


def _warnings(values: Values, impact: Impact) -> Iterator[str]:
    """Yield warnings about a `solref` that lacks its minus signs, or whose timeconst is below two time steps.

    `values` are those of the user's file; of `impact` the time step counts, in s.
    """
    # Of the negative form both conditions are false.
    timeconst, ratio = _surface(values).solref
    if timeconst > _LONGEST:
        yield (
            f"Positive numbers are timeconst, {timeconst:g} s, and dampratio; for stiffness and damping write "
            f"solref = {-timeconst:g} {-ratio:g}"
        )
    if impact.step is not None and 0 < timeconst < 2 * impact.step and values["refsafe"] == "enable":
        yield f"timeconst is {timeconst:g} s, and counts as two time steps, {2 * impact.step:g} s (refsafe)"


NATIVE = Native(
    (
        Parameter(
            "solref",
            default="0.02 1",
            accepted="timeconst (in s) and dampratio > 0, or -stiffness (in 1/s^2) and -damping (in 1/s) <= 0",
            allowed=lambda pair: min(pair) > 0 or (max(pair) <= 0 and pair[0] < 0),
            max_numbers=2,
            per_body=True,
        ),
        Parameter(
            "solimp",
            default="0.9 0.95 0.001 0.5 2",
            accepted="d_0, d_width, width (a length), midpoint and power, numbers >= 0",
            max_numbers=5,
            per_body=True,
        ),
        Parameter(
            "friction",
            default="1 0.005 0.0001",
            accepted="sliding, torsion and rolling, numbers >= 0",
            max_numbers=3,
            per_body=True,
        ),
        Parameter("condim", "", "3", "1, 3, 4 or 6", lambda pair: {*pair} <= {1, 3, 4, 6}, per_body=True),
        Parameter("priority", "", "0", "an integer", lambda pair: all(x == round(x) for x in pair), per_body=True),
        Parameter("solmix", default="1", per_body=True),
        Parameter("cone", default="pyramidal", words=("pyramidal", "elliptic")),
        Parameter("impratio", default="1", accepted="a number > 0", allowed=lambda ratio: ratio[0] > 0),
        Parameter("refsafe", default="enable", words=("enable", "disable")),
    ),
    _contact,
    _SOURCE,
    schemes={"Euler": SEMI_IMPLICIT, "RK4": RUNGE_KUTTA, "implicit": SEMI_IMPLICIT, "implicitfast": SEMI_IMPLICIT},
    integrator="integrator",
    damped_values=_damped,
    warnings=_warnings,
)

_USE = """\
MuJoCo: <include file="..."/> this file in a model and give geoms, or pairs, class="...". Of two geoms in contact both
must have the class; a pair needs it alone. The numbers are per mass: eps depends on no mass. They are in
{{ units.length }} and {{ units.time }}. solimp has a constant impedance: with another one eps is off by up to 0.005.
Friction changes eps in the pyramidal cone, the default, for any condim except 1: <option cone="elliptic"/> does not.
"""

_CODE = """\
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
            lambda ratio: 2 * ratio,  # kappa of the linear spring is 2 zeta
            ("1e-9", "1e3"),  # dampratio is > 0, and at 1e3 eps, which tends to kappa^-2, is 2.5e-7
            "other end",
            _SOURCE,
            usual_parameter=ratio_for_return,
            note="The first two numbers of solimp are equal.",
        ),
        _direct("solref = -stiffness -damping", SEMI_IMPLICIT),
        _direct("solref = -stiffness -damping, RK4", RUNGE_KUTTA),
    ),
    texts={
        "mujoco": OwnLaw("solref = -stiffness -damping", "damping", "<!--", _USE, _CODE, per_mass=True, carried=0.9)
    },
    lines={"any": '<geom solref="-{stiffness} -{parameter}" solimp="0.9 0.9 0.001"/>'},
    native=NATIVE,
    default_step=0.002,  # in s: `mj_defaultOption`
)
