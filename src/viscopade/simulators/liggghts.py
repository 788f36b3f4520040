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
    As S = 3/2 k sqrt(d) with Hertz's k, this is Tsuji's damping (`derivations/12_tsuji.py`) with alpha = sqrt(5) |b|:
    |b| is the damping ratio, and e is its eps for the end at x = 0.
`normal_model_hooke.h`, `surfacesIntersect`:
    c = sqrt(4 m_eff k/(1 + (pi/ln e)^2)), a linear dashpot with that ratio.

All end where x = 0, with attraction before it, unless `limitForce on` clips the force at 0. Then `hertz/stiffness` has
this package's end condition, and `hertz` has a larger eps than `coefficientRestitution` says: 0.40 for 0.3. `hertz`
accepts 0.05 < coefficientRestitution <= 1 (`createCoeffRest`), so with `limitForce on` no eps below about 0.21.

`fix nve/sphere` steps as LAMMPS does: the damping takes the velocity half a step before.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from typing import Any, NamedTuple

from viscopade.collision.schemes import SEMI_IMPLICIT
from viscopade.collision.spheres import Pair
from viscopade.simulators import native
from viscopade.simulators.formula import (
    LINEAR,
    LINEAR_RETURN,
    TSUJI,
    TSUJI_RETURN,
    formulas,
    linear_kappa,
    tsuji_kappa,
    viscoelastic_formula,
)
from viscopade.simulators.input_file import (
    WAY_OUT,
    Row,
    damping_per_mass,
    described,
    program_number,
    same_damping_per_mass,
    size_errors,
    time_step,
    type_rows,
)
from viscopade.simulators.lammps import Ends, OtherModel
from viscopade.simulators.own_law import OwnLawContact, Softness, Wanted, best_row, constant_row
from viscopade.simulators.setup import Setup
from viscopade.simulators.simulator import InputFile, Simulator

_LEAST_COEFFICIENT = "0.05"


def _shear_modulus(pair: Pair) -> float:
    """Return Mindlin's effective shear modulus, a pressure."""
    softness = (2 * (2 - body.poisson_ratio) * (1 + body.poisson_ratio) for body in (pair.first, pair.second))
    return 1 / sum(s / body.young_modulus for s, body in zip(softness, (pair.first, pair.second), strict=True))


def _values(setup: Setup) -> dict[str, Any]:
    """Return what the templates have; bodies become types in their order, walls too."""
    names = list(setup.bodies)

    def matrix(of: Callable[[Pair], float]) -> str:
        """Return a number for all ordered pairs of types, as `peratomtypepair` wants them; two walls have 0."""
        values = {types: of(pair) for types, pair in setup.pairs().items()}
        rows = (" ".join(program_number(values.get(frozenset((a, b)), 0)) for b in names) for a in names)
        return " &\n    ".join([str(len(names)), *rows])

    switch, usual = _usual_law(setup)
    return {
        **time_step(setup),
        "contacts": [
            described(contact, setup, size_errors(contact, same_damping_per_mass(contact.pair)), row)
            for contact, row in zip(setup.contacts, usual, strict=True)
        ],
        "types": type_rows(setup, "type", {name: f"{number} {name}" for number, name in enumerate(names, 1)}),
        "all_meet": len(setup.contacts) == len(names) * (len(names) + 1) // 2,
        "properties": {
            "kn": matrix(lambda pair: 4 / 3 * pair.E_eff),
            "gamman": matrix(damping_per_mass),
            "kt": matrix(lambda pair: 8 * _shear_modulus(pair)),
            "gammat": matrix(lambda pair: 0),
        },
        "usual": switch,
    }


def _usual_law(setup: Setup) -> tuple[str, list[Row]]:
    """Return a sentence on the model `hertz` and a column of each contact.

    All contacts share the switch `limitForce`. It is off if one of them cannot have its eps with it.
    """
    weight = " (without weight)" if setup.weighty else ""
    for name, switch in (("hertz, limitForce on", "on"), ("hertz", "off")):
        try:
            contacts = [
                OwnLawContact(
                    SIMULATOR.formula(name),
                    Wanted.of(contact, setup.weighty),
                    Softness(contact.pair.rho),
                    units=setup.units,
                )
                for contact in setup.contacts
            ]
        except ValueError as error:
            reason = str(error)
            continue
        rows: list[Row] = [{**constant_row(contact, _E), **best_row(contact, _E)} for contact in contacts]
        words = f"The usual law, hertz with {_E} below and limitForce {switch}, has one eps for all speeds{weight}."
        return words, rows
    return f"The usual law, hertz with {_E}, cannot have this eps: {reason}.", [{} for _ in setup.contacts]


_USE = """\
LIGGGHTS: material and contact law. Include this file after create_box and before any fix wall/gran. Numbers are in
{{ units.length }}, {{ units.mass }}, {{ units.time }}: use "units si", which converts nothing.

{{ time_step }}

Law: hertz/stiffness, F = sqrt(R_eff d) (kn d + m_eff gamman v_n), clipped at 0 by limitForce on. With kn = 4/3 E_eff
and gamman = 2 A E_eff/m_eff it is the viscoelastic law; contact ends when the force vanishes. gamman holds the m_eff
of the types' R: A of other sizes is in proportion to m_eff.
{% if not all_meet %}
Pairs of types without a contact below have the values of their bodies; two walls have 0.
{% endif %}

Without kt and gammat the program does not start, though "tangential off" does not use them. For friction write
"tangential history" and give coefficientFriction; kt is Mindlin's 8 G_eff.

{{ usual }}

Walls, for instance one of type N (limitForce comes last there):
    fix wall all wall/gran model hertz/stiffness tangential off primitive type N zplane 0 limitForce on
"""

_CODE = """\
{% for name, values in properties.items() %}
fix viscopade_{{ name }} all property/global {{ name }} peratomtypepair {{ values }}
{% endfor %}
pair_style gran model hertz/stiffness tangential off limitForce on
pair_coeff * *
timestep {{ timestep }}
"""

_E, _ACCEPTED = "coefficientRestitution", (_LEAST_COEFFICIENT, "1")
_HERTZ, _HOOKE, _STIFFNESS = (f"src/normal_model_{name}.h" for name in ("hertz", "hooke", "hertz_stiffness"))


def _force(values: native.Values, impact: native.Impact) -> native.Power:
    """Return the force of a normal model."""
    model, mass, radius = values["model"], impact.effective_mass, impact.effective_radius
    formula = SIMULATOR.formula(f"{model}, limitForce on" if values["limitForce"] == "on" else model)
    if model == "hertz/stiffness":
        return native.Power(formula.law, values["kn"] * radius**0.5, values["gamman"] * mass * radius**0.5)
    modulus = native.effective_modulus(values, values["youngsModulus"], values["poissonsRatio"], "createYeff")
    if model == "hertz":
        k = 4 / 3 * modulus * radius**0.5
    else:
        whole = 16 / 15 * modulus * radius**0.5
        k = whole * (mass * values["characteristicVelocity"] ** 2 / whole) ** 0.2
    return native.power_of(formula, values[_E], k, mass)


PROPERTIES = {
    "hertz": ("youngsModulus", "poissonsRatio", _E),
    "hooke": ("youngsModulus", "poissonsRatio", _E, "characteristicVelocity"),
    "hertz/stiffness": ("kn", "gamman"),
}
"""Properties of materials by normal model."""


class ModelLine(NamedTuple):
    """A line that says which models a contact has: of pair_style gran, or of fix wall/gran.

    Attributes
    ----------
    model : str
        The normal model.
    options : mapping of str to str
        What follows it in pairs, such as "limitForce" and "on".
    """

    model: str
    options: Mapping[str, str]

    @property
    def settings(self) -> dict[str, str]:
        """The parameters that the line says; those of the materials stand in other lines.

        Raises
        ------
        OtherModel
            If the contact is not computed here.
        """
        others = [f"model {self.model}"] if self.model not in PROPERTIES else []
        harmless_words = {"cohesion": ("off",), "surface": ("default",), "viscous": ("off",)}
        for name, words in harmless_words.items():
            others += [f"{name} {word}" for word in [self.options.get(name, words[0])] if word not in words]
        if others:
            raise OtherModel(f"{' and '.join(others)}: not computed here")
        return {"model": self.model, "limitForce": self.options.get("limitForce", "off")}


def model_line(words: Sequence[str], first: int) -> ModelLine:
    """Return what a line says, with "model" at the place `first`, or an old style such as gran/hertz/history.

    Numbers of an old style say whether there is damping along the surface, and whether there is cohesion.
    """
    if words[first] != "model":
        model = words[first].removeprefix("wall/").removeprefix("gran/").removesuffix("/history")
        cohesive = words[first + 2 : first + 3] == ["1"]
        return ModelLine(model, {"cohesion": "sjkr" if cohesive else "off"})
    if len(words) < first + 2:
        raise ValueError(f"the model is missing: expected {', '.join(PROPERTIES)}")
    names = "tangential", "cohesion", "surface", "rolling_friction", "limitForce", "viscous"
    rest = words[first + 2 :]
    return ModelLine(words[first + 1], {name: rest[i + 1] for i, name in enumerate(rest[:-1]) if name in names})


Property = Sequence[str]
"""Words of a line `fix … property/global NAME KIND …`."""


def _places(words: Property, types: tuple[int, int]) -> list[int]:
    """Return where a property has the numbers of two types: one number of the pair, or one of each."""
    kind = words[5].removeprefix("per")
    if kind == "atomtype":
        return [5 + number for number in types]
    return [6 + int(words[6]) * (types[0] - 1) + types[1]] if kind == "atomtypepair" else [6]


def _size(name: str, units: native.FileUnits) -> float:
    """Return the SI size of the unit that a property has in a file."""
    pressure = units.kilograms / units.metres / units.seconds**2
    sizes = {"youngsModulus": pressure, "kn": pressure, "gamman": 1 / units.metres / units.seconds}
    return (sizes | {"characteristicVelocity": units.metres / units.seconds}).get(name, 1.0)


def material(
    model: str,
    types: tuple[int, int],
    properties: Mapping[str, Property],
    number: Callable[[str], float],
    units: native.FileUnits,
) -> dict[str, str]:
    """Return the properties of two types that a normal model has, in SI units.

    Raises
    ------
    OtherModel
        If one is missing: LIGGGHTS does not start.
    """
    texts = {}
    for name in PROPERTIES[model]:
        words = properties.get(name, ())
        try:
            numbers = [number(words[place]) * _size(name, units) for place in _places(words, types)]
        except IndexError:
            raise OtherModel(f"types {types[0]} and {types[1]} have no property/global {name}") from None
        texts[name] = " ".join(map(program_number, numbers))
    return texts


def with_property(words: Property, text: str, types: tuple[int, int], units: native.FileUnits) -> str:
    """Return the line of a property with another number, in SI units, for two types in both orders."""
    numbers = [*words]
    for place in (*_places(words, types), *_places(words, types[::-1])):
        numbers[place] = f"{float(text) / _size(words[4], units):.8g}"
    return " ".join(numbers)


def template_spheres(words: Sequence[str], number: Callable[[str], float]) -> Ends:
    """Return the sizes of a line `fix … particletemplate/sphere`; None for other distributions than these two.

    They are `radius constant R`, `radius uniform LOW HIGH`, and the same for `density`.
    """

    def ends(name: str) -> list[float | None]:
        place = words.index(name) + 1 if name in words else len(words)
        count = {"constant": 1, "uniform": 2}.get("".join(words[place : place + 1]), 0)
        return [number(word) for word in words[place + 1 : place + 1 + count]] or [None]

    radii, densities = ends("radius"), ends("density")
    return (radii[0], densities[0]), (radii[-1], densities[-1])


_NATIVE = native.Native(
    (
        native.Parameter("model", words=("hertz", "hooke", "hertz/stiffness")),
        native.positive("youngsModulus", "Pa", both=True),
        native.poisson_ratios("poissonsRatio"),
        native.restitution(_E, above=float(_LEAST_COEFFICIENT), least_written=float(_LEAST_COEFFICIENT)),
        native.positive("characteristicVelocity", "m/s"),
        native.positive("kn", "Pa"),
        native.Parameter("gamman", "m^-1 s^-1"),
        native.Parameter("limitForce", default="off", words=("off", "on")),
    ),
    _force,
    _HERTZ,
    schemes={"verlet": SEMI_IMPLICIT},
    integrator="run_style",
    damping=lambda values: "gamman" if values["model"] == "hertz/stiffness" else _E,
)

_SCALED_GAMMAN = "gamman (m_eff/kn)^(3/5) (R_eff v)^(1/5)"
_WRITTEN = "gamman is as `viscopade simulators liggghts` writes it"

SIMULATOR = Simulator(
    "liggghts",
    "LIGGGHTS",
    "LIGGGHTS-PUBLIC 3.8.0, commit 25fc396",
    (
        *formulas(
            _E,
            _ACCEPTED,
            _HERTZ,
            ("hertz", TSUJI_RETURN, tsuji_kappa, "exact"),
            ("hertz, limitForce on", TSUJI, tsuji_kappa, "other end"),
        ),
        *formulas(
            _E,
            _ACCEPTED,
            _HOOKE,
            ("hooke", LINEAR_RETURN, linear_kappa, "exact"),
            ("hooke, limitForce on", LINEAR, linear_kappa, "other end"),
        ),
        viscoelastic_formula("hertz/stiffness, limitForce on", _STIFFNESS, f"{_WRITTEN}.", parameter=_SCALED_GAMMAN),
        viscoelastic_formula(
            "hertz/stiffness", _STIFFNESS, f"{_WRITTEN}, without its limitForce.", "return", parameter=_SCALED_GAMMAN
        ),
    ),
    texts={"liggghts": InputFile("#", _USE, _CODE, _values, f"{WAY_OUT}, or take the usual law")},
    native=_NATIVE,
)
