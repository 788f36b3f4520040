"""LIGGGHTS: the exact viscoelastic law by `hertz/stiffness`, or a constant eps by `hertz`.

    fix e all property/global coefficientRestitution peratomtypepair 2 0.9 0.5 0.5 0.3
    pair_style gran model hertz tangential history limitForce on
    fix floor all wall/gran model hertz tangential history primitive type 2 zplane 0 limitForce on

Read in src of LIGGGHTS-PUBLIC 3.8.0 (CFDEMproject/LIGGGHTS-PUBLIC at commit 25fc396), with d the overlap, v_n the
speed of compression, and E_eff, R_eff, m_eff as in `Pair` (at a wall R_eff and m_eff are the sphere's:
`pair_gran_base.h`, `fix_wall_gran_base.h`):

`normal_model_hertz_stiffness.h`, `surfacesIntersect`:
    F = sqrt(R_eff d) (kn d + m_eff gamman v_n).
    This is the paper's Eq. 2 with kn = 4/3 E_eff and gamman = 3/2 A kn/m_eff = 2 A E_eff/m_eff. As gamman is given per
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

import re
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
    program_number,
    same_damping_per_mass,
    size_errors,
    template_contact,
    time_step,
    type_rows,
)
from viscopade.simulators.lammps import OtherModel
from viscopade.simulators.own_law import Goal, OwnLawContact, Softness, best_row, constant_row
from viscopade.simulators.setup import Setup
from viscopade.simulators.simulator import InputFile, Simulator

_LEAST_COEFFICIENT = "0.05"  # of coefficientRestitution, not accepted itself (`createCoeffRest`)


def _shear_modulus(pair: Pair) -> float:
    """Return Mindlin's effective shear modulus G_eff of a pair, a pressure."""
    # 1/G_eff is the sum of (2 - nu)/G = 2 (2 - nu) (1 + nu)/Y, as G = Y/(2 (1 + nu))
    softness = (2 * (2 - body.poisson_ratio) * (1 + body.poisson_ratio) for body in (pair.first, pair.second))
    return 1 / sum(s / body.young_modulus for s, body in zip(softness, (pair.first, pair.second), strict=True))


def _values(setup: Setup) -> dict[str, Any]:
    """Return the values of the templates, by name; the bodies of `setup` become types in their order, walls too."""
    names = list(setup.bodies)

    def matrix(number: Callable[[Pair], float]) -> str:
        """Return the numbers of all ordered pairs of types, as `peratomtypepair` wants them; two walls have 0."""
        values = {names_of_pair: number(pair) for names_of_pair, pair in setup.pairs().items()}
        # First the number of types, then one row for each type.
        rows = (" ".join(program_number(values.get(frozenset((a, b)), 0)) for b in names) for a in names)
        return " &\n    ".join([str(len(names)), *rows])

    # A sentence on the usual law, hertz, and its columns of the table of contacts.
    usual_sentence, usual_columns = _usual_law(setup)
    return {
        **time_step(setup),
        "contacts": [
            template_contact(contact, setup, size_errors(contact, same_damping_per_mass(contact.pair)), row)
            for contact, row in zip(setup.contacts, usual_columns, strict=True)
        ],
        "types": type_rows(setup, "type", {name: f"{number} {name}" for number, name in enumerate(names, 1)}),
        # n types have n (n + 1)/2 pairs.
        "all_meet": len(setup.contacts) == len(names) * (len(names) + 1) // 2,
        # F = sqrt(R_eff d) (kn d + m_eff gamman v_n) with kn = 4/3 E_eff and gamman = 2 A E_eff/m_eff; kt is Mindlin's
        # 8 G_eff. No friction is damped.
        "properties": {
            "kn": matrix(lambda pair: 4 / 3 * pair.E_eff),
            "gamman": matrix(damping_per_mass),
            "kt": matrix(lambda pair: 8 * _shear_modulus(pair)),
            "gammat": matrix(lambda pair: 0),
        },
        "usual": usual_sentence,
    }


def _usual_law(setup: Setup) -> tuple[str, list[Row]]:
    """Return a sentence on the model `hertz`, with one eps for all speeds, and columns for each contact of `setup`.

    All contacts share the switch `limitForce`. It is off if one of them cannot have its eps with it.
    """
    weight = " (without weight)" if setup.weighty else ""
    # The goal of a contact is the eps that it must have, with weight if the user has set gravity. rho is the factor of
    # d^(3/2) in Hertz' force. A contact that cannot have its eps raises a ValueError.
    for name, switch in (("hertz, limitForce on", "on"), ("hertz", "off")):
        try:
            contacts = [
                OwnLawContact(
                    SIMULATOR.formula(name),
                    Goal.from_contact(contact, setup.weighty),
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
    """Return the force k d^a + c d^b v_n of a normal model, with the overlap d and its rate v_n.

    `values` are those of the user's file, `impact` has effective mass and radius, all in SI units.
    """
    model, mass, radius = values["model"], impact.effective_mass, impact.effective_radius
    formula = SIMULATOR.formula(f"{model}, limitForce on" if values["limitForce"] == "on" else model)
    # normal_model_hertz_stiffness.h: kn sqrt(R_eff) d^(3/2) + gamman m_eff sqrt(R_eff d) v_n
    if model == "hertz/stiffness":
        return native.Power(formula.law, values["kn"] * radius**0.5, values["gamman"] * mass * radius**0.5)
    # Hertz: k d^(3/2) with k = 4/3 E_eff sqrt(R_eff)
    modulus = native.effective_modulus(values, values["youngsModulus"], values["poissonsRatio"], "createYeff")
    if model == "hertz":
        k = 4 / 3 * modulus * radius**0.5
    else:
        # hooke: k d with k = s (m V^2/s)^(1/5), s = 16/15 E_eff sqrt(R_eff) and the characteristic velocity V. At the
        # speed V the spring stores as much energy at its largest overlap as Hertz' force at the same overlap.
        s = 16 / 15 * modulus * radius**0.5
        k = s * (mass * values["characteristicVelocity"] ** 2 / s) ** 0.2
    # The damping is that of coefficientRestitution (see the head of this module).
    return native.power_force(formula, values[_E], k, mass)


LIGGGHTS_COMMANDS = re.compile(
    r"^[ \t]*(?:pair_style\s+(?:hybrid\s.*)?gran\s|soft_particles\s"
    r"|fix\s.*\s(?:property/global|particletemplate/|insert/|mesh/|wall/gran\s+model|wall/gran/h))",
    re.MULTILINE,
)
"""Commands that LAMMPS does not have."""
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
        """The texts of "model" and "limitForce"; the properties of the materials stand in other lines.

        Raises
        ------
        OtherModel
            If the contact is not computed here.
        """
        # Options that change no eps have one of these words; the first one is the default.
        others = [f"model {self.model}"] if self.model not in PROPERTIES else []
        harmless_words = {"cohesion": ("off",), "surface": ("default",), "viscous": ("off",)}
        for name, words in harmless_words.items():
            others += [f"{name} {word}" for word in [self.options.get(name, words[0])] if word not in words]
        if others:
            raise OtherModel(f"{' and '.join(others)}: not computed here")
        return {"model": self.model, "limitForce": self.options.get("limitForce", "off")}


def model_line(words: Sequence[str], first: int) -> ModelLine:
    """Return what the words of a line say; word `first` is "model", or a style such as gran/hertz/history."""
    # Two numbers after such an old style say, by 0 or 1, whether there is damping along the surface, and cohesion.
    if words[first] != "model":
        model = words[first].removeprefix("wall/").removeprefix("gran/").removesuffix("/history")
        cohesive = [*words[first + 2 : first + 3]] == ["1"]
        return ModelLine(model, {"cohesion": "sjkr" if cohesive else "off"})
    if len(words) < first + 2:
        raise ValueError(f"the model is missing: expected {', '.join(PROPERTIES)}")
    # "model NAME OPTION WORD OPTION WORD …", for a wall with other words between.
    names = "tangential", "cohesion", "surface", "rolling_friction", "limitForce", "viscous"
    rest = words[first + 2 :]
    return ModelLine(words[first + 1], {name: rest[i + 1] for i, name in enumerate(rest[:-1]) if name in names})


class MaterialLine(NamedTuple):
    """A line of models, and the properties of two types in lines `fix … property/global NAME KIND …`.

    Attributes
    ----------
    line : ModelLine
    types : tuple of int
        Those of both bodies; a wall has one.
    properties : mapping of str to sequence of str
        Words of the lines by the name of the property.
    units : FileUnits
        Those of the file; settings are in SI units.
    """

    line: ModelLine
    types: tuple[int, int]
    properties: Mapping[str, Sequence[str]]
    units: native.FileUnits

    @property
    def settings(self) -> dict[str, str]:
        """The texts of the parameters of `_NATIVE`, in SI units; OtherModel if the contact is not computed here.

        It is also raised if a property of the types is missing, with which LIGGGHTS does not start.
        """
        settings = self.line.settings
        for name in PROPERTIES[self.line.model]:
            words = self.properties.get(name, ())
            try:
                numbers = [float(words[place]) * self._unit(name) for place in _places(words, self.types)]
            except IndexError:
                both = " and ".join(map(str, self.types))
                raise OtherModel(f"types {both} have no property/global {name}") from None
            settings[name] = " ".join(map(program_number, numbers))
        return settings

    def lines_with(self, settings: Mapping[str, str]) -> tuple[str, ...]:
        """Return the lines of properties with other numbers of both types: `settings`, texts by name in SI units."""
        lines = []
        for name, text in settings.items():
            words = [*self.properties.get(name, ())]
            # A matrix has the number of the types i and j twice, as i j and j i. Eight digits, as in other files.
            for place in (*_places(words, self.types), *_places(words, self.types[::-1])) if words else ():
                words[place] = f"{float(text) / self._unit(name):.8g}"
            lines += [" ".join(words)] if words else []
        return tuple(lines)

    def _unit(self, name: str) -> float:
        """Return the size of the unit of a property in the file, in SI units: kg/(m s^2) of a modulus, for example."""
        metres, kilograms, seconds = self.units.metres, self.units.kilograms, self.units.seconds
        if name in ("youngsModulus", "kn"):
            return kilograms / metres / seconds**2
        return {"gamman": 1 / metres / seconds, "characteristicVelocity": metres / seconds}.get(name, 1.0)


def _places(words: Sequence[str], types: tuple[int, int]) -> list[int]:
    """Return the indices of the words of a property that are numbers of two types: one of the pair, or one of each."""
    # fix ID GROUP property/global NAME peratomtype X1 X2 …        the number of type i is word 5 + i
    # fix ID GROUP property/global NAME peratomtypepair N X11 …    that of i and j is word 6 + N (i - 1) + j
    # fix ID GROUP property/global NAME scalar X                   one for all is word 6
    kind = words[5].removeprefix("per")
    if kind == "atomtype":
        return [5 + number for number in types]
    return [6 + int(words[6]) * (types[0] - 1) + types[1]] if kind == "atomtypepair" else [6]


def surfaces(words: Sequence[str], fixes: Mapping[str, Sequence[str]]) -> dict[str, int]:
    """Return the types of the walls of a line `fix … wall/gran …`, by name: of a primitive or of meshes.

    Parameters
    ----------
    words : sequence of str
        Those of the line, from "fix" on.
    fixes : mapping of str to sequence of str
        Words of all fixes by name.
    """
    # "primitive type N zplane …"
    if "primitive" in words:
        return {words[1]: int(words[words.index("primitive") + 2])}
    start = next((i for i, word in enumerate(words) if word in ("meshes", "mesh/gran")), None)
    if start is None:  # as of old
        return {words[1]: int(words[-1])}
    # "mesh n_meshes M meshes NAME …" names fixes "fix NAME GROUP mesh/surface file FILE type N …". Of an old style
    # "fix NAME GROUP mesh/gran FILE N …" the type N is word 5.
    meshes = {name: fixes[name] for name in words[start:] if name in fixes and fixes[name][3].startswith("mesh/")}
    return {name: int(mesh[mesh.index("type") + 1 if "type" in mesh else 5]) for name, mesh in meshes.items()}


_NATIVE = native.Native(
    (
        native.Parameter("model", words=("hertz", "hooke", "hertz/stiffness")),
        native.positive("youngsModulus", "Pa", per_body=True),
        native.poisson_ratios("poissonsRatio"),
        native.restitution(_E, above=float(_LEAST_COEFFICIENT), least_epsilon=float(_LEAST_COEFFICIENT)),
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
