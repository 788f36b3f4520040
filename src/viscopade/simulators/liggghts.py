"""LIGGGHTS: the exact viscoelastic law by `hertz/stiffness`, or a constant eps by `hertz`.

Read in src of LIGGGHTS-PUBLIC 3.8.0 (CFDEMproject/LIGGGHTS-PUBLIC at commit 25fc396), with d the overlap, v_n the
speed of compression, and E_eff, R_eff, m_eff as in `Pair` (at a wall R_eff and m_eff are the sphere's:
`pair_gran_base.h`, `fix_wall_gran_base.h`):

`normal_model_hertz_stiffness.h`, `surfacesIntersect`:
    F = sqrt(R_eff d) (kn d + m_eff gamman v_n).
    This is eq:viscoelastic with kn = 4/3 E_eff and gamman = 3/2 A kn/m_eff = 2 A E_eff/m_eff. As gamman is given per
    pair of types and multiplied with each pair's own m_eff, particles of one type but different size differ in A.
`normal_model_hertz.h`, `surfacesIntersect`, with `createBetaEff` of `global_properties.cpp`:
    F = 4/3 E_eff sqrt(R_eff d) d - 2 sqrt(5/6) b sqrt(S m_eff) v_n, S = 2 E_eff sqrt(R_eff d) and
    b = ln e/sqrt(ln^2 e + pi^2) < 0, e being `coefficientRestitution`.
    As S = 3/2 k sqrt(d) with Hertz's k, this is `viscopade.collision.tsuji` with alpha = sqrt(5) |b|: |b| is the
    damping ratio, and e is its eps for the end at x = 0.
`normal_model_hooke.h`, `surfacesIntersect`:
    c = sqrt(4 m_eff k/(1 + (pi/ln e)^2)), a linear dashpot with that ratio.

All end where x = 0, with attraction before it, unless `limitForce on` clips the force at 0. Then `hertz/stiffness` has
this package's end condition, and `hertz` has a larger eps than `coefficientRestitution` says: 0.40 for 0.3. `hertz`
accepts 0.05 < coefficientRestitution <= 1 (`createCoeffRest`), so with `limitForce on` no eps below about 0.21.

`fix nve/sphere` steps as LAMMPS does: the damping takes the velocity half a step before.
"""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Literal

from mpmath import mp

from viscopade.collision.schemes import SEMI_IMPLICIT
from viscopade.collision.spheres import Pair
from viscopade.generated import harmless, written_template
from viscopade.simulators import native
from viscopade.simulators.formula import (
    LINEAR,
    LINEAR_RETURN,
    TSUJI,
    TSUJI_RETURN,
    DampingFormula,
    linear_kappa,
    tsuji_kappa,
    viscoelastic_kappa,
)
from viscopade.simulators.setup import SI, NamedContact, Setup
from viscopade.simulators.simulator import Simulator
from viscopade.simulators.stated import (
    ConstantEpsilon,
    ProgramErrors,
    common,
    constant_epsilon,
    facts,
    program_errors,
    program_number,
)
from viscopade.theory.law import VISCOELASTIC, Law, law_of

_LEAST_COEFFICIENT = "0.05"


Model = Literal["hertz/stiffness", "hertz"]

# createYoungsModulus refuses what is outside, without `soft_particles yes` or
# `hard_particles yes`.
SOFT, HARD = 5e6, 1e9


@dataclass(frozen=True)
class Stiffness:
    """Parameters of `hertz/stiffness` for a pair of types.

    Attributes
    ----------
    kn : float
        4/3 E_eff, a pressure.
    gamman : float
        2 A E_eff/m_eff, in 1/(length time).
    kt : float
        8 G_eff, a pressure: Mindlin's tangential stiffness as in `hertz`.
    """

    kn: float
    gamman: float
    kt: float


def stiffness(pair: Pair) -> Stiffness:
    """Return the parameters that make `hertz/stiffness` with `limitForce on` the viscoelastic law of a pair."""
    return Stiffness(4 / 3 * pair.E_eff, 2 * pair.A * (pair.E_eff / pair.m_eff), 8 * _shear_modulus(pair))


def _shear_modulus(pair: Pair) -> float:
    """Return Mindlin's effective shear modulus, a pressure."""
    softness = (2 * (2 - body.poisson_ratio) * (1 + body.poisson_ratio) for body in (pair.first, pair.second))
    return 1 / sum(s / body.young_modulus for s, body in zip(softness, (pair.first, pair.second), strict=True))


def stiffness_errors(contact: NamedContact) -> ProgramErrors:
    """Return the errors of `hertz/stiffness`: zero for the pair itself, not for other sizes of the same types."""
    gamman = stiffness(contact.pair).gamman

    def program(pair: Pair, speed: float) -> float:
        return pair.damped(gamman * pair.m_eff / (2 * pair.E_eff)).epsilon(speed)  # this size gets that A

    return program_errors(program, contact)


def coefficient_restitution(epsilon: float, limit_force: bool) -> float:
    """Return the `coefficientRestitution` that gives the wanted eps with `hertz`.

    Parameters
    ----------
    epsilon : float
        Wanted, > 0 and <= 1.
    limit_force : bool
        Whether `limitForce on` is set. Without it the result is eps itself.

    Raises
    ------
    ValueError
        If LIGGGHTS does not accept the value that it takes.

    Examples
    --------
    >>> f"{coefficient_restitution(0.9, True):.6f} {coefficient_restitution(0.3, True):.6f}"
    '0.897887 0.165219'
    """
    found = _hertz_formula(limit_force).instead(repr(epsilon))
    if found is None:
        raise ValueError(
            f"epsilon is {epsilon:.6g}: accepted by LIGGGHTS with limitForce {_switch(limit_force)} "
            f"is more than {least_epsilon(limit_force):.4g}"
        )
    return float(found)


def least_epsilon(limit_force: bool) -> float:
    """Return the lower limit of eps with `hertz`, as `coefficientRestitution` must be above 0.05."""
    formula = _hertz_formula(limit_force)
    return float(formula.delivered(formula.damping(_LEAST_COEFFICIENT)))


def _hertz_formula(limit_force: bool) -> DampingFormula:
    return SIMULATOR.formula("hertz, limitForce on" if limit_force else "hertz")


@dataclass(frozen=True)
class HertzRestitution:
    """Parameters of `hertz` for a contact.

    Attributes
    ----------
    constant : ConstantEpsilon
        Its eps, which is exact at the typical speed, and its errors.
    coefficient : float
        `coefficientRestitution` for that eps.
    balanced : float or None
        The same for the eps with the smallest largest error; None if the program does not accept it.
    """

    constant: ConstantEpsilon
    coefficient: float
    balanced: float | None


def hertz_restitution(contact: NamedContact, limit_force: bool) -> HertzRestitution:
    """Return the parameters of `hertz` for a contact.

    Raises
    ------
    ValueError
        As `coefficient_restitution` does.
    """
    found = constant_epsilon(contact)
    reachable = found.balanced > least_epsilon(limit_force)
    return HertzRestitution(
        found,
        coefficient_restitution(found.epsilon, limit_force),
        coefficient_restitution(found.balanced, limit_force) if reachable else None,
    )


def limits_force(contacts: Sequence[NamedContact]) -> bool:
    """Return whether `hertz` can have `limitForce on` for all these contacts: all pairs of types share the switch."""
    least = least_epsilon(True)
    return all(constant_epsilon(contact).epsilon > least for contact in contacts)


def render(setup: Setup, command: str, model: Model = "hertz/stiffness") -> str:
    """Return LIGGGHTS commands for the contacts, to be included after create_box.

    Parameters
    ----------
    setup : Setup
        Types are numbered in the order of its bodies, walls too.
    command : str
        What the first line says it was made with.
    model : {"hertz/stiffness", "hertz"}
        The exact law, or a constant eps.

    Raises
    ------
    ValueError
        If the model is not one of the two, or is `hertz` and it cannot have one of the contacts' eps.
    """
    if model not in ("hertz/stiffness", "hertz"):
        raise ValueError(f"model is {model!r}: expected 'hertz/stiffness' or 'hertz'")
    return written_template(_TEXT).render(
        **common(setup, command),
        types=list(enumerate(map(harmless, setup.bodies), 1)),
        si=setup.units == SI,
        facts=[facts(contact, setup.units) for contact in setup.contacts],
        model=model,
        stiffness_errors=[stiffness_errors(contact) for contact in setup.contacts],
        **(_stiffness_matrices(setup) if model == "hertz/stiffness" else {}),
        **_hertz(setup, model),
    )


def _stiffness_matrices(setup: Setup) -> dict[str, str]:
    """Return the values of the four properties for all pairs of types; two walls have 0."""
    found = {types: stiffness(pair) for types, pair in _pairs(setup).items()}
    return {
        "kn": _matrix(setup, {types: values.kn for types, values in found.items()}, 0),
        "gamman": _matrix(setup, {types: values.gamman for types, values in found.items()}, 0),
        "kt": _matrix(setup, {types: values.kt for types, values in found.items()}, 0),
        "gammat": _matrix(setup, {}, 0),
    }


def _hertz(setup: Setup, model: Model) -> dict[str, object]:
    """Return what the template needs on the model with a constant eps."""
    limit_force = limits_force(setup.contacts)
    try:
        found = [hertz_restitution(contact, limit_force) for contact in setup.contacts]
    except ValueError as error:
        if model == "hertz":
            raise
        return {"refused": str(error), "restitutions": [], "limit_force": "off"}
    values = {frozenset((c.first, c.second)): r.coefficient for c, r in zip(setup.contacts, found, strict=True)}
    moduli = [body.young_modulus for body in setup.bodies.values()]
    return {
        "refused": None,
        "restitutions": found,
        "limit_force": _switch(limit_force),
        "soft": min(moduli) < SOFT,
        "hard": max(moduli) > HARD,
        "young": " ".join(map(program_number, moduli)),
        "poisson": " ".join(program_number(body.poisson_ratio) for body in setup.bodies.values()),
        "coefficients": _matrix(setup, values, 1),
    }


def _pairs(setup: Setup) -> dict[frozenset[str], Pair]:
    """Return the pair of every two types that can meet; of the contacts those that they have."""
    pairs = {frozenset((a, b)): Pair(setup.bodies[a], setup.bodies[b]) for a in setup.spheres for b in setup.bodies}
    return pairs | {frozenset((contact.first, contact.second)): contact.pair for contact in setup.contacts}


def _matrix(setup: Setup, values: Mapping[frozenset[str], float], other: float) -> str:
    """Return the values for all ordered pairs of types, as `peratomtypepair` wants them."""
    names = list(setup.bodies)
    rows = (" ".join(program_number(values.get(frozenset((a, b)), other)) for b in names) for a in names)
    return " &\n    ".join([str(len(names)), *rows])


def _switch(on: bool) -> str:
    return "on" if on else "off"


_TEXT = """\
{{ marker | lines("# {}") }}
#
{{ opening | lines("# {}") }}
#
# LIGGGHTS: material and contact law. Include this file after create_box and before any fix wall/gran.
# Numbers are in {{ setup.units.length }}, {{ setup.units.mass }}, {{
setup.units.time }}: use "units si", which converts nothing.
# Types:{% for number, name in types %} {{ number }} = {{ name }}{{ "," if not loop.last }}{% endfor %}.
#
{% for lines in facts %}
{{ lines | lines("# {}") }}
{% endfor %}
#
{% if model == "hertz/stiffness" %}
# Law: hertz/stiffness, F = sqrt(R_eff d) (kn d + m_eff gamman v_n), clipped at 0 by limitForce on. With
# kn = 4/3 E_eff and gamman = 2 A E_eff/m_eff it is the viscoelastic law; contact ends when the force vanishes.
# The value of gamman belongs to the effective mass above: other sizes need types of their own.
{% for errors in stiffness_errors %}
# {{ setup.contacts[loop.index0].name }}:
{{ errors.lines | lines("#   {}") }}
{% endfor %}
{% if setup.contacts | length < types | length * (types | length + 1) // 2 %}
# Pairs of types without a contact above have the values of their bodies; two walls have 0.
{% endif %}
#
# Without kt and gammat the program does not start, though "tangential off" does not use them. For friction write
# "tangential history" and give coefficientFriction; kt is Mindlin's 8 G_eff.
fix viscopade_kn all property/global kn peratomtypepair {{ kn }}
fix viscopade_gamman all property/global gamman peratomtypepair {{ gamman }}
fix viscopade_kt all property/global kt peratomtypepair {{ kt }}
fix viscopade_gammat all property/global gammat peratomtypepair {{ gammat }}
pair_style gran model hertz/stiffness tangential off limitForce on
pair_coeff * *
{% else %}
# Law: hertz, damping with d^(1/4): one eps for all speeds, {{
"clipped at 0 by limitForce on" if limit_force == "on" else "with attraction before the overlap ends (limitForce off)"
}}.
{% if limit_force == "on" %}
# Contact ends when the force vanishes. coefficientRestitution is then not eps: it is the number that leads to it.
{% else %}
# An eps as small as here cannot be had with limitForce on. Contact ends when the overlap does.
{% endif %}
{% for r in restitutions %}
# {{ setup.contacts[loop.index0].name }}: coefficientRestitution {{ number(r.coefficient) }} gives eps = {{
number(r.constant.epsilon) }},
#   the exact one at the typical speed.
{{ r.constant.errors.lines | lines("#   {}") }}
{% if r.balanced is not none %}
#   The largest error is smallest, {{ "%.2e" % r.constant.balanced_errors.largest }}, with {{
number(r.balanced) }}, which gives eps = {{ number(r.constant.balanced) }}.
{% endif %}
{% endfor %}
{% if setup.contacts | length < types | length * (types | length + 1) // 2 %}
# Pairs of types without a contact above have 1, no dissipation.
{% endif %}
{% if soft %}
soft_particles yes
{% endif %}
{% if hard %}
hard_particles yes
{% endif %}
fix viscopade_young all property/global youngsModulus peratomtype {{ young }}
fix viscopade_poisson all property/global poissonsRatio peratomtype {{ poisson }}
fix viscopade_restitution all property/global coefficientRestitution peratomtypepair {{ coefficients }}
pair_style gran model hertz tangential off limitForce {{ limit_force }}
pair_coeff * *
{% endif %}
#
# Walls, for instance one of type N (limitForce comes last there):
# fix wall all wall/gran model {{ model }} tangential off primitive type N zplane 0 limitForce {{
"on" if model == "hertz/stiffness" else limit_force }}
# Time step: {{ steps }} steps in the shortest contact.
{% if model == "hertz/stiffness" %}
# With it eps is off by up to {{ step_error }} (computed with the program's scheme).
{% endif %}
# The error of eps falls in proportion to the step.
timestep {{ timestep }}
{% if model == "hertz/stiffness" %}
#
{% if refused %}
# The program's usual law, hertz with coefficientRestitution, cannot have this eps: {{ refused }}.
{% else %}
# The program's usual law, hertz with coefficientRestitution and limitForce {{
limit_force }}, has one eps for all speeds:
{% for r in restitutions %}
#   {{ setup.contacts[loop.index0].name }}: coefficientRestitution {{
number(r.coefficient) }} for the eps at the typical speed.
{{ r.constant.errors.lines | lines("#     {}") }}
{% endfor %}
{% endif %}
{% endif %}
"""

_E, _ACCEPTED, _KAPPA = "coefficientRestitution", (_LEAST_COEFFICIENT, "1"), ("0", "1e6")
_SCALED_GAMMAN = "gamman (m_eff/kn)^(3/5) (R_eff v)^(1/5)"
"""It is kappa of the scaled equation."""
_HERTZ, _HOOKE, _STIFFNESS = (f"src/normal_model_{name}.h" for name in ("hertz", "hooke", "hertz_stiffness"))


def _constants(values: native.Values, impact: native.Impact) -> tuple[Law, float, float]:
    """Return the law of a normal model, k and c."""
    model, mass, radius = values["model"], impact.effective_mass, impact.effective_radius
    end = "force" if values["limitForce"] == "on" else "return"
    if model == "hertz/stiffness":
        return law_of(VISCOELASTIC, end), values["kn"] * radius**0.5, values["gamman"] * mass * radius**0.5
    modulus = native.effective_modulus(values["youngsModulus"], values["poissonsRatio"])
    if model == "hertz":
        law, kappa, k = TSUJI, tsuji_kappa, 4 / 3 * modulus * radius**0.5
    else:
        law, kappa, whole = LINEAR, linear_kappa, 16 / 15 * modulus * radius**0.5
        k = whole * (mass * values["characteristicVelocity"] ** 2 / whole) ** 0.2
    return law_of(law, end), k, float(kappa(mp.mpf(values[_E]))) * (mass * k) ** 0.5


def _damped(values: native.Values, damping: float, impact: native.Impact) -> dict[str, float]:
    """Return another coefficientRestitution, or gamman."""
    if values["model"] != "hertz/stiffness":
        return {_E: max(math.exp(-damping), float(_LEAST_COEFFICIENT))}
    one = native.Values({**values, "gamman": 1.0})
    return {"gamman": native.number_for(damping, *_constants(one, impact), impact)}


_NATIVE = native.Native(
    (
        native.Parameter("model", words=("hertz", "hooke", "hertz/stiffness")),
        native.positive("youngsModulus", "Pa", both=True),
        native.poisson_ratios("poissonsRatio"),
        native.restitution(_E, float(_LEAST_COEFFICIENT)),
        native.positive("characteristicVelocity", "m/s"),
        native.positive("kn", "Pa"),
        native.Parameter("gamman", "m^-1 s^-1"),
        native.Parameter("limitForce", default="off", words=("off", "on")),
    ),
    lambda values, impact: native.law_contact(*_constants(values, impact), impact),
    _HERTZ,
    schemes={"verlet": SEMI_IMPLICIT},
    integrator="run_style",
    damped=_damped,
)

SIMULATOR = Simulator(
    "liggghts",
    "LIGGGHTS",
    "LIGGGHTS-PUBLIC 3.8.0, commit 25fc396",
    (
        DampingFormula("hertz", TSUJI_RETURN, _E, tsuji_kappa, _ACCEPTED, "exact", _HERTZ),
        DampingFormula("hertz, limitForce on", TSUJI, _E, tsuji_kappa, _ACCEPTED, "other end", _HERTZ),
        DampingFormula("hooke", LINEAR_RETURN, _E, linear_kappa, _ACCEPTED, "exact", _HOOKE),
        DampingFormula("hooke, limitForce on", LINEAR, _E, linear_kappa, _ACCEPTED, "other end", _HOOKE),
        DampingFormula(
            "hertz/stiffness, limitForce on",
            VISCOELASTIC,
            _SCALED_GAMMAN,
            mp.mpf,
            _KAPPA,
            "exact",
            _STIFFNESS,
            written=viscoelastic_kappa,
            note="gamman is as `viscopade simulators liggghts` writes it.",
        ),
        DampingFormula(
            "hertz/stiffness",
            law_of(VISCOELASTIC, "return"),
            _SCALED_GAMMAN,
            mp.mpf,
            _KAPPA,
            "other end",
            _STIFFNESS,
            written=viscoelastic_kappa,
            note="gamman is as `viscopade simulators liggghts` writes it, without its limitForce.",
        ),
    ),
    texts={"liggghts": render},
    native=_NATIVE,
)
