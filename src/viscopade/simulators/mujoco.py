"""MuJoCo: `solref` of contacts, in both forms.

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
    """Return the formula of a negative solref."""
    parameter, accepted = "damping/sqrt(stiffness)", ("0", "1e3")
    return DampingFormula(name, LINEAR, parameter, mp.mpf, accepted, "other end", _SOURCE, linear_kappa, scheme=scheme)


_LONGEST = 10.0  # timeconst, in s, that is meant as one
_LEAST, _LARGEST = 1e-4, 0.9999  # impedance, and its midpoint: mjMINIMP and mjMAXIMP
_LEAST_FRICTION = 1e-5  # mjMINMU
_LEAST_SOLMIX = 1e-15  # mjMINVAL


def impedance(solimp: tuple[float, ...], x: FloatArray) -> FloatArray:
    """Return d(r) of `solimp` = d_0 d_width width midpoint power, as `getimpedance` does."""
    first, last, width, midpoint, power = solimp
    first, last, midpoint = (min(max(part, _LEAST), _LARGEST) for part in (first, last, midpoint))
    if first == last or width <= 0:
        return np.full_like(x, (first + last) / 2)
    power, part = max(power, 1), np.minimum(x / width, 1)
    rising = part**power / midpoint ** (power - 1)
    falling = 1 - (1 - part) ** power / (1 - midpoint) ** (power - 1)
    return np.asarray(first + (last - first) * np.where(part <= midpoint, rising, falling))


class Surface(NamedTuple):
    """What a geom says of its contacts, or what a contact has of both geoms; fields as in MJCF."""

    priority: float
    solmix: float
    condim: float
    solref: tuple[float, ...]
    solimp: tuple[float, ...]
    friction: tuple[float, ...]


def rules(first: Surface, second: Surface) -> dict[str, Rule]:
    """Return the rule of each number that a contact has of both geoms (`mj_contactParam`)."""
    if first.priority != second.priority:
        decides = first.priority > second.priority
        higher = Rule("that of the higher priority", lambda one, other: one if decides else other)
        return dict.fromkeys(("condim", "solref", "solimp", "friction"), higher)
    # The weights are solmix, and equal if both are 0.
    weights = [solmix if solmix >= _LEAST_SOLMIX else 0.0 for solmix in (first.solmix, second.solmix)]
    mean = weighted_mean((weights[0], weights[1]), "solmix") if any(weights) else MEAN
    # Stiffness and damping, which are negative in the file, have no mean: the larger one of each counts.
    times = first.solref[0] > 0 and second.solref[0] > 0
    return {"condim": LARGER, "solref": mean if times else SMALLER, "solimp": mean, "friction": LARGER}


def mixed_surface(first: Surface, second: Surface) -> tuple[Surface, str]:
    """Return what a contact has of both geoms, and in words the rules of numbers that differ."""
    numbers, words = {}, []
    for name, rule in rules(first, second).items():
        one, other = getattr(first, name), getattr(second, name)
        numbers[name] = rule.mix(one, other)
        words += [f"{name} is {rule.words.removesuffix(',')}"] if one != other else []
    return first._replace(priority=max(first.priority, second.priority), **numbers), ", ".join(words)


def _surface(values: Values) -> Surface:
    """Return what a contact has of both geoms."""
    first, second = (Surface(*(values[name][geom] for name in Surface._fields)) for geom in (0, 1))
    return first._replace(
        **{name: values.mix(name, rule, "mj_contactParam") for name, rule in rules(first, second).items()}
    )


def stiffness_and_damping(solref: tuple[float, ...], values: Values, impact: Impact) -> tuple[float, float]:
    """Return stiffness and damping of the `solref` of a contact, per mass, in either form."""
    one, other = solref
    if one <= 0:
        return -one, -other
    if values["refsafe"] == "enable" and impact.step is not None:
        one = max(one, 2 * impact.step)
    return 1 / (one * other) ** 2, 2 / one


def _contact(values: Values, impact: Impact) -> Contact:
    """Return the contact per effective mass."""
    surface, g = _surface(values), impact.gravity
    stiffness, damping = stiffness_and_damping(surface.solref, values, impact)
    width, edges = min(max(surface.solimp[1], _LEAST), _LARGEST), int(surface.condim) - 1
    mu, q = max(surface.friction[0], _LEAST_FRICTION), 1.0
    if edges and values["cone"] == "pyramidal":
        q = mu**2 * (1 + mu**2) / (values["impratio"] * edges)

    def force(x: FloatArray, v: FloatArray) -> FloatArray:
        d = impedance(surface.solimp, x)
        shared = d / (d + q * (1 - d))
        return np.asarray(shared * (g + damping / width * v + d * stiffness / width**2 * x))

    return Contact(force, 1.0, g)


def _damped(values: Values, c: float, impact: Impact) -> dict[str, Any]:
    """Return the `solref` of both geoms, of the same stiffness with the damping c sqrt(stiffness)."""
    solref = _surface(values).solref
    root = math.sqrt(stiffness_and_damping(solref, values, impact)[0])
    solref = (2 / (c * root), c / 2) if solref[0] > 0 else (-(root**2), -c * root)
    return {"solref": (solref, solref)}


def _warnings(values: Values, impact: Impact) -> Iterator[str]:
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
            lambda ratio: 2 * ratio,
            ("1e-9", "1e3"),
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
    default_step=0.002,
)
