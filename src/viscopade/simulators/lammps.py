"""LAMMPS: an include file for `pair_style granular`, and the contacts of its input lines.

    pair_style granular
    pair_coeff 1 2 hertz/material 1e7 50 0.3 tangential linear_nohistory 0 0 damping viscoelastic limit_damping
    fix floor all wall/gran granular hertz 1e6 20 tangential linear_nohistory 0 0 zplane 0 NULL

The numbers after hertz/material are E (a pressure), the damping coefficient eta_n0 (1/(length time)) and nu; those
after hertz are k_n = 4/3 E_eff (a pressure) and eta_n0.

The correspondence, from the source of LAMMPS (src/GRANULAR of lammps/lammps, commits 58ee392 and 07b704c, which agree
in this; the tests run the release of 22 Jul 2025). With the compression d, its rate d' and the contact radius
a = sqrt(R_eff d) (`GranSubModNormal::calculate_contact_radius`):

- `GranSubModNormalHertz::calculate_forces`: the elastic force k a d, where k = 4/3 E_eff for hertz/material;
- `GranSubModNormalHertzMaterial::coeffs_to_local`: of an explicit line for a pair of types E_eff is
  `mix_stiffnessE(E, E, nu, nu)`, and for a wall `mix_stiffnessE_wall(E, nu)`; both are E/(2 (1 - nu^2));
- `GranSubModDampingViscoelastic::calculate_forces`: the damping eta_n0 m_eff a d';
- `GranularModel::calculate_forces`: their sum, set to 0 where it is attractive if there is limit_damping;
- `GranularModel::check_contact`, `PairGranular::compute`, `FixWallGran::post_force`: R_eff and m_eff are the paper's,
  with a wall those of the sphere.

So rho = 4/3 E_eff sqrt(R_eff), and rho 3/2 A = eta_n0 m_eff sqrt(R_eff) gives eta_n0 = 2 A E_eff/m_eff. From the end of
contact on, x + kappa x' = 0 in the scaled variables, the velocity is constant as long as the force is 0, so x falls and
x + kappa x' stays negative: the force remains cut off until the spheres part. This is the paper's end condition.

Velocities enter the force as they are half a step before (`Verlet::run`: `FixNVESphere::initial_integrate` adds half of
the kick, then forces are computed). This makes the scheme one of first order: x'' is multiplied by
1/(1 - kappa sqrt(x) h/2), up to higher orders of the time step h. `input_file.timestep_error` does the same steps.

Other dampings, at commit 07b704c, with the elastic force F:

- `GranSubModDampingCoeffRestitution::init`: c = damp sqrt(m_eff F/d), with damp = 2 zeta for `hooke` and
  sqrt(5) zeta for `hertz`, zeta the damping ratio for contact that ends at x = 0. Both are exact.
- `GranSubModDampingTsuji::init`: the same c, damp a polynomial in e of degree 6, which Marshall (2009) fitted to
  the figure of Tsuji, Tanaka and Ishida (1992). Since 2026 it is multiplied by sqrt(2), as Tsuji's mass is not m_eff.
  A file does not say its release: tsuji is taken to be that of 22 Jul 2025, the newest one that pip installs.
- `GranSubModDampingMassVelocity`: c = eta_n0 m_eff. People take eta_n0 from Silbert et al. (2001), which is the linear
  spring-dashpot contact that ends at x = 0.

With `limit_damping` a force that would pull is 0, with any of them; without, contact ends at x = 0. The normal models
that adhere are in `viscopade.simulators.adhesion`.
"""

from __future__ import annotations

import itertools
import math
import re
from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import dataclass
from fractions import Fraction
from itertools import combinations_with_replacement
from typing import Any, NamedTuple

from mpmath import mp

from viscopade import arguments
from viscopade.collision.contact import Contact
from viscopade.collision.schemes import SEMI_IMPLICIT
from viscopade.collision.spheres import Pair, Sphere
from viscopade.generated import harmless
from viscopade.simulators import native
from viscopade.simulators.adhesion import LAMMPS_NORMALS, lammps_contact
from viscopade.simulators.deck import TSUJI_2026
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
    same_damping_per_mass,
    size_errors,
    template_contact,
    time_step,
    type_rows,
)
from viscopade.simulators.own_law import Goal, OwnLawContact, Softness, constant_row
from viscopade.simulators.setup import NamedContact, Setup
from viscopade.simulators.simulator import InputFile, Simulator
from viscopade.theory.law import Law

_FRICTIONLESS = "tangential linear_nohistory 0.0 0.0"
_LAW = f"{_FRICTIONLESS} damping viscoelastic limit_damping"
STYLE = f"hertz/material {{E}} {{eta_n0}} {{nu}} {_LAW}"
"""The words after the types in pair_coeff, and after `granular` in fix wall/gran, with `HertzMaterial` in braces."""
_WALL = f'fix wall all wall/gran granular {STYLE} zplane 0.0 NULL  # for "zplane 0.0 NULL" put your wall'
# Times the stated time step, of which 100 are in a contact. If LAMMPS's own default step is longer, less than 10 are in
# a contact, and the text warns.
_TOO_LONG = 10
DEFAULT_STEPS = {"lj": 0.005, "si": 1e-8, "cgs": 1e-8, "micro": 2.0, "nano": 0.00045}
"""Time steps of scripts without `timestep`, by units (the manual's page on timestep; the tests ask the program)."""
# The units style whose units of length, mass and time these are.
_STYLES = {("m", "kg", "s"): "si", ("cm", "g", "s"): "cgs", ("um", "pg", "us"): "micro", ("nm", "ag", "ns"): "nano"}


@dataclass(frozen=True)
class HertzMaterial:
    """The numbers of `hertz/material E eta_n0 nu`, for one pair of bodies.

    Attributes
    ----------
    E : float
        Young modulus, a pressure.
    eta_n0 : float
        Damping constant, 1/(length time).
    nu : float
        Poisson ratio.
    """

    E: float
    eta_n0: float
    nu: float

    @property
    def k_n(self) -> float:
        """The stiffness with which `hertz k_n eta_n0` is the same law, a pressure: 4/3 E_eff."""
        # E_eff = E/(2 (1 - nu^2)) of two bodies of one material (and LAMMPS has the same for a wall)
        return self.E / (2 * (1 - self.nu) * (1 + self.nu)) * (4 / 3)

    @property
    def style(self) -> str:
        """`STYLE` with these numbers."""
        return STYLE.format(E=_number(self.E), eta_n0=_number(self.eta_n0), nu=_number(self.nu))


def hertz_material(pair: Pair) -> HertzMaterial:
    """Return the parameters of LAMMPS for a pair of bodies.

    Parameters
    ----------
    pair : Pair
        Two spheres, or a sphere and a wall.

    Returns
    -------
    HertzMaterial
        E and nu give E_eff and, in tangential models with NULL for the stiffness (`mix_stiffnessG`), the effective
        shear modulus of the pair. For equal materials they are the material's.

    Examples
    --------
    >>> from viscopade import Pair, Sphere
    >>> glass = {"density": 2500, "young_modulus": 7e10, "poisson_ratio": 0.25, "dissipative_constant": 1e-8}
    >>> hertz_material(Pair(Sphere(radius=1e-3, **glass), Sphere(radius=2e-3, **glass))).style.split()[:4]
    ['hertz/material', '70000000000', '80214091.3183153', '0.25']
    """
    # E = 2 (1 - nu^2) E_eff: from E and nu LAMMPS makes the pair's E_eff again.
    nu = _common_poisson_ratio(pair.first, pair.second)
    return HertzMaterial(E=2 * (1 - nu) * (1 + nu) * pair.E_eff, eta_n0=damping_per_mass(pair), nu=nu)


def _common_poisson_ratio(first: Sphere, second: Sphere) -> float:
    """Return the nu with which one material has the pair's E_eff and effective shear modulus both.

    1/E_eff is the sum of D_i = (1 - nu_i^2)/Y_i, and 1/G_eff that of 2 (2 - nu_i) (1 + nu_i)/Y_i, which is
    2 D_i (1 + 1/(1 - nu_i)). So 1/(1 - nu) is the mean of 1/(1 - nu_i) with the weights D_i.
    """
    if first.poisson_ratio == second.poisson_ratio:
        return first.poisson_ratio
    # The weight D_1/(D_1 + D_2); `plane_strain_modulus` is Y/(1 - nu^2) = 1/D.
    share = 1 / (1 + first.plane_strain_modulus / second.plane_strain_modulus)
    return 1 - 1 / (share / (1 - first.poisson_ratio) + (1 - share) / (1 - second.poisson_ratio))


def _constant_restitution(contact: NamedContact, setup: Setup) -> Row:
    """Return a column of the table of contacts: the number of `damping coeff_restitution` that gives a contact its eps.

    It has one eps for all sizes and speeds. `contact` is one of `setup`. rho is the factor of d^(3/2) in Hertz' force,
    4/3 E_eff sqrt(R_eff).
    """
    # The goal is the eps that the contact must have at its speeds, with weight if the user has set gravity.
    formula = SIMULATOR.formula("hertz, coeff_restitution, limit_damping")
    goal = Goal.from_contact(contact, setup.weighty)
    try:
        constant = OwnLawContact(formula, goal, Softness(contact.pair.rho), units=setup.units)
    except ValueError:
        return {("coeff_restitution", ""): "none has this eps"}
    return constant_row(constant, "coeff_restitution")


def _number(x: float) -> str:
    """Return a number for LAMMPS: 15 digits, which decide eps to as many."""
    return f"{x:.15g}"


def _values(setup: Setup) -> dict[str, Any]:
    """Return the values of the templates, by name; the spheres of `setup` become atom types in their order.

    Pairs that are not among the contacts get their lines, too, from the bodies' own numbers.
    """
    # A wall has a variable of LAMMPS, whose name has letters, digits and underscores only.
    spheres, walls = setup.spheres, [name for name, body in setup.bodies.items() if body.is_wall]
    variables = {wall: f"wall{number}_" + re.sub(r"[^A-Za-z0-9]", "_", wall) for number, wall in enumerate(walls, 1)}
    types, pairs = {name: number for number, name in enumerate(spheres, 1)}, setup.pairs()

    def line(first: str, second: str) -> str:
        """Return the command for a sphere, `first`, and a sphere or wall, `second`, by their names."""
        # A wall acts on one type alone: with several types each has a fix and a group of its own.
        style = hertz_material(pairs[frozenset((first, second))]).style
        if second in types:
            command = f"pair_coeff {types[first]} {types[second]} {style}"
        else:
            group = "all" if len(spheres) == 1 else f"viscopade_type{types[first]}"
            fix = f"fix {variables[second]}_type{types[first]} {group} wall/gran granular"
            command = f"{fix} {style} ${{{variables[second]}}}"
        return f"{command}  # {harmless(f'{first}-{second}')}"

    # The lines of contacts that are meant to occur stand before the others.
    meant = {frozenset((contact.first, contact.second)) for contact in setup.contacts}
    type_pairs = [*combinations_with_replacement(spheres, 2)]
    wall_pairs = [(sphere, wall) for wall in walls for sphere in spheres]
    lines = dict[str, list[str]]()
    for name, bodies in (("lines", type_pairs), ("wall_lines", wall_pairs)):
        lines[name] = [line(*pair) for pair in bodies if frozenset(pair) in meant]
        lines[f"other_{name}"] = [line(*pair) for pair in bodies if frozenset(pair) not in meant]
    # The stated time step, and the default of scripts without one, in the units style that has these units.
    steps, style = time_step(setup), _STYLES.get((setup.units.length, setup.units.mass, setup.units.time))
    default = DEFAULT_STEPS[style or "lj"]
    return {
        **steps,
        **lines,
        "default": f"{default:g}",
        "is_long": default > _TOO_LONG * float(steps["timestep"]),
        "contacts": [
            template_contact(
                contact,
                setup,
                size_errors(contact, same_damping_per_mass(contact.pair)),
                _constant_restitution(contact, setup),
            )
            for contact in setup.contacts
        ],
        "units_style": style,
        "types": type_rows(setup, "type", {name: f"{number} {name}" for name, number in types.items()}),
        "walls": {harmless(wall): name for wall, name in variables.items()},
        "groups": list(types.values()) if len(spheres) > 1 and walls else [],
    }


_USE = """\
For LAMMPS, pair_style granular. Include this file after create_box, or read_data; before it stand
units {{ units_style or "lj" }}, an atom_style with radii (sphere) and "comm_modify vel yes".
Units: {{ units.length }}, {{ units.mass }}, {{ units.time }}.
{% if not units_style %}
LAMMPS has no units style for these: units lj takes numbers as they are.
{% endif %}

{{ time_step }}
{{ "Warning: w" if is_long else "W" }}rite "timestep {{ timestep }}": a script without timestep has {{ default }} {{
units.time }}.

Law of hertz/material E eta_n0 nu, with the compression d and its rate d':
    F = 4/3 E_eff sqrt(R_eff) d^(3/2) + eta_n0 m_eff sqrt(R_eff d) d',    E_eff = E/(2 (1 - nu^2)),
which is the viscoelastic force, as eta_n0 = 2 A E_eff/m_eff (hertz k_n eta_n0 with k_n = 4/3 E_eff is the same).
E and nu are of one material; two bodies of it are as stiff as the pair, also in tangential direction.
With limit_damping contact ends when the force vanishes (x'' = 0); without it the force attracts, and eps is smaller.
eta_n0 holds the m_eff of the types' R: A of other sizes is in proportion to m_eff.

Keep a line for every pair of
types, as the mean that LAMMPS would take is not this law.
For friction replace "linear_nohistory 0.0 0.0", for example for a coefficient of 0.5 by "mindlin NULL 1.0 0.5".
For one eps at all speeds and sizes{{ " (without weight)" if setup.weighty }} put coeff_restitution, below, in place of
eta_n0, and write damping coeff_restitution.
"""

_CODE = """\

pair_style granular
{% for line in lines %}
{{ line }}
{% endfor %}
{% if other_lines %}
# Not among the contacts that are meant to occur:
{% for line in other_lines %}
{{ line }}
{% endfor %}
{% endif %}
{% if walls %}

# You set the position of a wall: define its variable before this file is included (that here is ignored then), as
# "zplane lo hi" (xplane, yplane; NULL is an open side), or as "region ID" with wall/gran/region for wall/gran.
{% for wall, variable in walls.items() %}
variable {{ variable }} index "zplane 0.0 NULL"  # {{ wall }}
{% endfor %}
{% if groups %}
# A wall acts on the group of a type, which has the atoms of now. Later atoms fall through: pour each type into its
# group, "fix ID viscopade_type1 pour N 1 ...", not into all; after create_atoms repeat the group lines.
{% endif %}
{% for number in groups %}
group viscopade_type{{ number }} type {{ number }}
{% endfor %}
{% for line in wall_lines %}
{{ line }}
{% endfor %}
{% if other_wall_lines %}
# Not among the contacts that are meant to occur:
{% for line in other_wall_lines %}
{{ line }}
{% endfor %}
{% endif %}
{% endif %}
"""

_SOURCE = "src/GRANULAR/gran_sub_mod_damping.cpp"
# Range of the number of coeff_restitution in the audit, whose logarithm must be finite, and its name.
_EPSILON, _E = ("1e-6", "1"), "coefficient of restitution"
# Marshall (2009), J. Comput. Phys. 228, 1541: alpha(e), coefficients of e^6, …, e^0, as in
# `GranSubModDampingTsuji::init`.
_MARSHALL = ("4.8218", "-18.022", "27.467", "-22.348", "11.087", "-4.2783", "1.2728")


def marshall(e: Any) -> Any:
    """Return Marshall's fit of Tsuji's alpha for eps = `e`: kappa if alpha is taken with the effective mass."""
    return mp.polyval([mp.mpf(c) for c in _MARSHALL], e)


def tsuji_fit(e: Any) -> Any:
    """Return kappa by Marshall's fit for eps = `e`: Tsuji's mass is not m_eff, which makes the factor sqrt(2)."""
    return mp.sqrt(2) * marshall(e)


_SCALED_ETA = "eta_n0 (m_eff/k_n)^(3/5) (R_eff v)^(1/5)"
_WRITTEN = "`k_n` is `4/3 E_eff` for hertz/material. `eta_n0` is as `viscopade simulators lammps` writes it"
# The units of each style: names of length, mass and time, and their sizes in m, kg and s; those of lj have none.
UNITS = {
    "lj": native.FileUnits("sigma", "m", "tau", unsized="units is lj: expected a plain number, or --set units=si"),
    "si": native.FileUnits(),
    "cgs": native.FileUnits("cm", "g", "s", 1e-2, 1e-3),
    "micro": native.FileUnits("um", "pg", "us", 1e-6, 1e-15, 1e-6),
    "nano": native.FileUnits("nm", "ag", "ns", 1e-9, 1e-21, 1e-9),
}
_KAPPA_FROM_EPSILON: Mapping[str, tuple[Callable[[Any], Any], ...]] = {
    "tsuji": (marshall,) * 2,
    TSUJI_2026: (tsuji_fit,) * 2,
    "coeff_restitution": (linear_kappa, tsuji_kappa),
}
"""Dampings that take an eps, and their kappa for hooke and hertz."""


_MATERIAL_MODELS = ("hertz/material", *LAMMPS_NORMALS)
"""Normal models with a modulus and a Poisson ratio."""


def mixed_coefficients(normal: str, first: Sequence[float], second: Sequence[float]) -> tuple[float, ...]:
    """Return the coefficients of a normal model that LAMMPS makes of those of two types (`GranSubMod::mix_coeffs`).

    `first` and `second` are the coefficients of both types, in the order of the line: for hertz/material E, eta_n0, nu.
    They become geometric means. Only the stiffness of hertz/material, dmt and jkr comes from both materials: the E and
    nu that are returned are those of one material which is as stiff as the two together.
    """
    means = [math.sqrt(x * y) for x, y in zip(first, second, strict=True)]
    if normal in _MATERIAL_MODELS:
        # 1/E_eff is the sum of (1 - nu^2)/E, and E = 2 (1 - nu^2) E_eff of equal materials; means[2] is their nu.
        E_eff = 1 / sum((1 - nu**2) / E for E, _, nu, *_ in (first, second))
        means[0] = 2 * (1 - means[2] ** 2) * E_eff
    return tuple(means)


def _coefficients(values: native.Values) -> tuple[float, ...]:
    """Return the coefficients of the normal model in the contact of two types, those of each mixed by LAMMPS's rule.

    `values` are those of the user's file. They remember the mixture, for a sentence on it.
    """
    # `values["coefficients"]` has a tuple of numbers for each body.
    first, second = values["coefficients"]
    if first == second:
        return tuple(first)
    if len(first) != len(second):
        raise ValueError(f"coefficients is {len(first)} numbers and {len(second)}: expected as many for both types")
    mixed = mixed_coefficients(values["normal"], first, second)
    rule = "the mixture" if values["normal"] in _MATERIAL_MODELS else "the geometric mean"
    values.mixed["coefficients"] = native.Mixed(mixed, rule, "", (first, second), "GranSubMod::mix_coeffs")
    return mixed


def _force(values: native.Values, impact: native.Impact) -> native.Power | Contact:
    """Return the force of a line of pair_coeff: a `Power`, k d^a + c d^b d' of the compression d, or one with adhesion.

    `values` are those of the user's file, `impact` has effective mass and radius in its units.

    Raises
    ------
    ValueError
        If there are other coefficients than the normal model has, or one is not accepted.
    """
    normal, damping, numbers = values["normal"], values["damping"], _coefficients(values)
    # The numbers that the normal model has, in words: hooke and hertz have two.
    words = {"hertz/material": "E, damping coefficient and nu"}.get(normal, "k_n and damping coefficient")
    if normal in LAMMPS_NORMALS:
        words = "E, damping coefficient, nu and gamma"
    # "E, damping coefficient and nu" has one comma and three numbers.
    if len(numbers) != words.count(",") + 2:
        raise ValueError(f"coefficients is {len(numbers)} numbers: expected for {normal} {words}")
    # A stiffness k > 0, nu up to 1/2 where there is one (the third number), and an eps from 0 to 1. A tuple without a
    # third number is empty, and not larger than (0.5,).
    k, coefficient = numbers[:2]
    if (
        k <= 0
        or numbers[2:3] > (0.5,)
        or (normal not in LAMMPS_NORMALS and damping in _KAPPA_FROM_EPSILON and not 0 < coefficient <= 1)
    ):
        accepted = "a stiffness > 0, a nu up to 1/2 and for tsuji and coeff_restitution an eps > 0 and <= 1"
        raise ValueError(f"coefficients is {' '.join(f'{x:g}' for x in numbers)}: expected {accepted}")
    # With adhesion: E_eff from k_n = 4/3 E_eff.
    if normal in LAMMPS_NORMALS:
        E_eff = HertzMaterial(k, coefficient, numbers[2]).k_n * (3 / 4)
        return lammps_contact(values, E_eff, coefficient, numbers[3], impact)
    # The elastic force: k_n d of hooke, and k_n sqrt(R_eff) d^(3/2) of hertz with k_n = 4/3 E_eff of hertz/material.
    mass, hertz = impact.effective_mass, normal != "hooke"
    if normal == "hertz/material":
        k = HertzMaterial(k, coefficient, numbers[2]).k_n
    if hertz:
        k *= math.sqrt(impact.effective_radius)
    # The damping c d^b d'.
    if damping in _KAPPA_FROM_EPSILON:
        # c = kappa sqrt(m k) with b = 0 of the linear spring and b = 1/4 of Hertz': both have kappa = c/sqrt(m k).
        b, c = (
            Fraction(int(hertz), 4),
            float(_KAPPA_FROM_EPSILON[damping][hertz](mp.mpf(coefficient))) * math.sqrt(mass * k),
        )
    elif damping == "viscoelastic":
        # eta_n0 m_eff sqrt(R_eff d) d'
        b, c = Fraction(1, 2), coefficient * mass * math.sqrt(impact.effective_radius)
    else:
        # mass_velocity: eta_n0 m_eff d'; velocity: eta_n0 d'
        b, c = Fraction(0), coefficient * (mass if damping == "mass_velocity" else 1)
    law = Law(Fraction(3, 2) if hertz else 1, b, "force" if values["limit_damping"] == "yes" else "return")
    return native.Power(law, k, c)


def _damped(values: native.Values, damping: float, impact: native.Impact) -> dict[str, tuple[tuple[float, ...], ...]]:
    """Return the "coefficients" of both bodies whose damping is the number `damping`, as `Native.with_damping`.

    It is -ln eps if the second coefficient is an eps, else kappa of the contact without adhesion. `values` are those of
    the user's file; `impact` is in its units.
    """
    # Only the second coefficient changes. An eps is 1e-6 at least, as in the formulas of the audit.
    stiffness, _, *rest = _coefficients(values)
    if values["damping"] in _KAPPA_FROM_EPSILON:
        return {"coefficients": ((stiffness, max(math.exp(-damping), float(_EPSILON[0])), *rest),) * 2}
    # kappa is in proportion to a damping coefficient: so the contact with the coefficient 1 says which one gives it.
    normal = "hertz/material" if values["normal"] in LAMMPS_NORMALS else values["normal"]
    unit_force = _force(
        native.Values({**values, "normal": normal, "coefficients": ((stiffness, 1.0, *rest[:1]),) * 2}), impact
    )
    assert isinstance(unit_force, native.Power)
    return {"coefficients": ((stiffness, unit_force.damping_number(damping, impact), *rest),) * 2}


def _warnings(values: native.Values, impact: native.Impact) -> Iterator[str]:
    if values["damping"] == "tsuji":
        newer = native.program_collision(_NATIVE, native.Values({**values, "damping": TSUJI_2026}), impact)
        release = "tsuji is that of LAMMPS 22 Jul 2025, which pip installs. Releases with the factor sqrt(2) of 2026"
        yield f'{release} give eps = {newer.epsilon:.4f}: --set "damping={TSUJI_2026}"'


# Lines of an input: the words of a contact, and how LAMMPS mixes those of two types.

# How many numbers each normal model has.
_COEFFICIENTS = {"hooke": 2, "hertz": 2, "hertz/material": 3, "dmt": 4, "jkr": 4, "mdr": 6}
_CLASSIC = {
    "hooke": ("hooke", "mass_velocity"),
    "hooke/history": ("hooke", "mass_velocity"),
    "hertz/history": ("hertz", "viscoelastic"),
}
"""Styles of `kn kt gamman gammat xmu dampflag`, and the models that `GranularModel::define_classic_model` makes."""
_SUBMODELS: Mapping[str, Mapping[str, int]] = {
    "damping": dict.fromkeys(("velocity", "mass_velocity", "viscoelastic", "tsuji", "coeff_restitution"), 0)
    | {"mdr": 1, "none": 0},
    "tangential": {"linear_nohistory": 2}
    | dict.fromkeys(("linear_history", "linear_history_classic", "mindlin_classic", "mindlin", "mindlin/force"), 3)
    | dict.fromkeys(("mindlin_rescale", "mindlin_rescale/force"), 3),
    "rolling": {"none": 0, "sds": 3},
    "twisting": {"none": 0, "marshall": 0, "sds": 3},
    "heat": {"none": 0, "radius": 1, "area": 1},
}
"""Models by keyword, and how many coefficients each has (`num_coeffs` in the constructors of src/GRANULAR)."""
# Words from which on a line says where a wall is.
WALL_SHAPES = ("xplane", "yplane", "zplane", "zcylinder", "region")


# Names of commands, and beginnings of the names of fixes.

_SIZES = ("units", "atom_style", "dimension", "create_box", "create_atoms", "read_data", "read_restart", "set", "clear")
# Commands that decide a contact, its sizes, the time step or gravity; and beginnings of the names of such fixes.
DECIDING = frozenset((*_SIZES, "timestep", "pair_style", "pair_coeff", "unfix", "run", "minimize"))
DECIDING_FIXES = (
    *("gravity", "wall/gran", "mesh/surface", "mesh/gran", "property/global", "pour", "deposit", "insert/"),
    *("particletemplate/", "particledistribution/"),
)
RIGID = "contacts of rigid bodies have the mass of the body, not of its sphere"
WARNED_FIXES = {
    "rigid": RIGID,
    "multisphere": RIGID,
    "freeze": "a contact with a frozen sphere has the mass of the other",
    "adapt": "it changes sizes or contacts during a run",
    "dt/reset": "it changes the time step during a run",
    "multicontact": "it changes the force of a contact by those of its neighbours",
    "bond": "bonds add forces",
}
# Fixes and commands that change no eps: a reader of a deck says nothing of them.
SILENT_FIXES = ("nve", "ave/", "print", "balance", "enforce2d", "property/atom", "heat/", "check/timestep", "halt")
SILENT = frozenset(
    (
        *("angle_style", "atom_modify", "balance", "bond_style", "boundary", "change_box", "comm_modify", "comm_style"),
        *("communicate", "compute", "compute_modify", "dump", "dump_modify", "echo", "info", "log", "neigh_modify"),
        *("neighbor", "newton", "package", "pair_modify", "print", "processors", "reset_timestep", "restart", "thermo"),
        *(
            "hard_particles",
            "soft_particles",
            "special_bonds",
            "suffix",
            "thermo_modify",
            "thermo_style",
            "timer",
            "uncompute",
            "undump",
        ),
        *("velocity", "write_data", "write_dump", "write_restart"),
    )
)


def decides(words: Sequence[str]) -> bool:
    """Return whether a command, by its words, decides a contact, its sizes, the time step or gravity."""
    # "fix ID GROUP STYLE …": the style is the fourth word.
    is_fix = words[0] == "fix" and len(words) > 3
    return words[0] in DECIDING or (is_fix and words[3].startswith(DECIDING_FIXES))


def type_range(word: str) -> range:
    """Return the types that a word such as 1, *, 2* or 1*3 says."""
    # Nine digits at most: 10^9, the end of a range without one, is above all of them.
    if not re.fullmatch(r"[0-9]{1,9}|[0-9]{0,9}[*][0-9]{0,9}", word):
        raise ValueError(f"the type is {word!r}: expected a number, or a range such as 1*3")
    low, star, high = word.partition("*")
    return range(int(low or 1), int(high or (10**9 if star else low)) + 1)


class OtherModel(ValueError):
    """A contact whose eps is not computed here."""


class GranularLine(NamedTuple):
    """A line that says what a contact is: of pair_coeff, of pair_style gran/…, or of fix wall/gran.

    Attributes
    ----------
    head : tuple of str
        Words before those of the normal model.
    models : mapping of str to tuple of str
        The words of each sub-model by its keyword; those of "normal", or of the style gran/…, come first.
    tail : tuple of str
        Other words, such as limit_damping and the shape of a wall.
    """

    head: tuple[str, ...]
    models: Mapping[str, tuple[str, ...]]
    tail: tuple[str, ...]

    @property
    def classic(self) -> tuple[str, str] | None:
        """Normal model and damping of a style gran/…; None for granular."""
        # A style gran/… has its name and six numbers: kn kt gamman gammat xmu dampflag.
        normal = self.models["normal"]
        return _CLASSIC.get(normal[0].removeprefix("gran/")) if len(normal) == 7 else None

    @property
    def coefficients(self) -> tuple[str, ...]:
        """The coefficients of the normal model; of a style gran/… they are kn and gamman, the first and the third."""
        numbers = self.models["normal"][1:]
        return (numbers[0], numbers[2]) if self.classic else numbers

    @property
    def settings(self) -> dict[str, str]:
        """The texts of the parameters of `_NATIVE`, by name, except for the units.

        Raises
        ------
        OtherModel
            If it is not computed here.
        """
        # A line without `damping` has viscoelastic damping (the manual's page on pair_style granular).
        normal = self.models["normal"][0]
        normal, damping = self.classic or (normal, self.models.get("damping", ("viscoelastic",))[0])
        for name, model in (("normal", normal), ("damping", damping)):
            if model not in _NATIVE.parameters_by_name[name].words:
                raise OtherModel(f"the {name} model {model} is not computed here")
        if "synchronized_verlet" in self.tail:
            raise OtherModel("the steps of synchronized_verlet are not computed here")
        limited = "yes" if "limit_damping" in self.tail else "no"
        texts = normal, " ".join(self.coefficients), damping, limited
        return dict(zip(("normal", "coefficients", "damping", "limit_damping"), texts, strict=True))

    @property
    def shape(self) -> tuple[str, ...]:
        """The words that say where a wall is."""
        return tuple(itertools.dropwhile(lambda word: word not in WALL_SHAPES, self.tail))

    def between(self, first: int, second: int) -> GranularLine:
        """Return the line pair_coeff of two types, words 1 and 2, in place of one of a range of types."""
        return self._replace(head=("pair_coeff", str(first), str(second), *self.head[3:]))

    def lines_with(self, settings: Mapping[str, str]) -> tuple[str, ...]:
        """Return the lines with other coefficients, a text in `settings`; none without such a text."""
        if "coefficients" not in settings:
            return ()
        normal, numbers = [*self.models["normal"]], settings["coefficients"].split()
        # Word 0 is the name of the model. A style gran/… has kn and gamman in words 1 and 3.
        places = (1, 3) if self.classic else range(1, 1 + len(numbers))
        for place, number in zip(places, numbers, strict=True):
            normal[place] = number
        others = (word for name, words in self.models.items() if name != "normal" for word in (name, *words))
        return (" ".join((*self.head, *normal, *others, *self.tail)),)


def granular_line(words: Sequence[str], first: int) -> GranularLine:
    """Return what the words of a line say, with the normal model, or the style gran/…, at the index `first`.

    Raises
    ------
    ValueError
        If a word is not accepted.
    """
    # The normal model, or an old style with the same name, which has six numbers: kn kt gamman gammat xmu dampflag.
    rest = [*words[first:]]
    name = rest[0].removeprefix("gran/") if rest else ""
    is_classic = name in _CLASSIC and words[first - 1] != "granular" and words[0] != "pair_coeff"
    count = 6 if is_classic else _COEFFICIENTS.get(name)
    if count is None:
        raise ValueError(f"{name!r} is no normal model: expected {', '.join(_COEFFICIENTS)}")
    # Its numbers end at the next keyword.
    keywords = {*_SUBMODELS, *WALL_SHAPES, "limit_damping", "cutoff"}
    numbers = [*itertools.takewhile(lambda word: word not in keywords, rest[1 : count + 1])]
    if len(numbers) < count:
        raise ValueError(f"{name} has {len(numbers)} numbers: expected {count}")

    # Then sub-models by keyword, each with as many words as `_SUBMODELS` says, and other words, up to the shape of a
    # wall.
    models, tail = {"normal": tuple(rest[: count + 1])}, []
    rest = rest[count + 1 :]
    while rest and rest[0] not in WALL_SHAPES:
        keyword, *rest = rest
        if keyword in ("limit_damping", "synchronized_verlet"):
            tail.append(keyword)
        elif keyword == "cutoff" and rest:
            tail += [keyword, rest.pop(0)]
        elif not is_classic and keyword in _SUBMODELS:
            model = rest[0] if rest else ""
            if model not in _SUBMODELS[keyword]:
                raise ValueError(f"{keyword} is {model!r}: expected {', '.join(_SUBMODELS[keyword])}")
            count = _SUBMODELS[keyword][model]
            numbers = [*itertools.takewhile(lambda word: word not in keywords, rest[1 : count + 1])]
            if len(numbers) < count:
                raise ValueError(f"{keyword} {model} has {len(numbers)} numbers: expected {count}")
            models[keyword] = (model, *numbers)
            rest = rest[1 + count :]
        else:
            accepted = "limit_damping" if is_classic else f"{', '.join(_SUBMODELS)}, limit_damping, cutoff"
            raise ValueError(f"{keyword!r} is not known after {name}: expected {accepted}, {', '.join(WALL_SHAPES)}")

    # Coefficients below 1e300, which is below the largest double, 1.8e308.
    line = GranularLine(tuple(words[:first]), models, (*tail, *rest))
    for number in line.coefficients:
        arguments.exact_number(f"a coefficient of {name}", number, "a number >= 0", lambda x: 0 <= x < 10**300)
    return line


def mixture(first: GranularLine, second: GranularLine, types: tuple[int, int]) -> GranularLine:
    """Return the line that LAMMPS makes for two types that have none (`PairGranular::init_one`).

    `first` and `second` are the lines of each type with itself, and `types` are their numbers.
    Those of the normal model are `mixed_coefficients`; all others are geometric means.

    Raises
    ------
    OtherModel
        If their models differ: LAMMPS does not start.
    """
    # Sub-model by sub-model. Its first word is the name; NULL stands for a number that LAMMPS computes.
    models = {}
    for keyword in ("normal", "tangential", "damping", "rolling", "twisting", "heat"):
        default = ("viscoelastic" if keyword == "damping" else "none",)
        first_words, second_words = first.models.get(keyword, default), second.models.get(keyword, default)
        if first_words[0] != second_words[0]:
            refusal = f"LAMMPS does not mix {first_words[0]} with {second_words[0]}"
            raise OtherModel(f"{refusal}: expected a line pair_coeff {types[0]} {types[1]}")
        pairs = zip(first_words[1:], second_words[1:], strict=True)
        means = ("NULL" if "NULL" in pair else _number(math.sqrt(float(pair[0]) * float(pair[1]))) for pair in pairs)
        if first_words != ("none",):
            models[keyword] = (first_words[0], *means)
    # A stiffness of hertz/material, dmt and jkr comes from both materials.
    name = models["normal"][0]
    if name in _MATERIAL_MODELS:
        numbers = mixed_coefficients(name, *(tuple(map(float, line.coefficients)) for line in (first, second)))
        models["normal"] = (name, *map(_number, numbers))
    limit = ("limit_damping",) if "limit_damping" in first.tail + second.tail else ()
    return GranularLine(first.head, models, limit).between(*types)


def gravity_direction(words: Sequence[str], number: Callable[[str], float], dimension: str) -> tuple[float, ...]:
    """Return the direction of gravity, x y z of any length, of a line `fix … gravity G vector|chute|spherical …`.

    `words` are those of the line, `number` returns the number that a word says, and `dimension` is "2" or "3".
    """
    # "fix ID GROUP gravity G STYLE ARGUMENTS": x y z of vector, one angle of chute, phi and theta of spherical, in
    # degrees.
    style, *angles = words[5:9]
    if style == "vector":
        return tuple(map(number, angles))
    # `FixGravity`: a chute at an angle is spherical with phi = 0 and theta = 180 - angle, so at 0 it points down (-z).
    phi, theta = (0.0, 180 - number(angles[0])) if style == "chute" else (number(angles[0]), number(angles[1]))
    phi, theta = math.radians(phi), math.radians(theta)
    # In two dimensions y takes the place of z (`FixGravity::set_acceleration`).
    if dimension == "2":
        return math.sin(theta), math.cos(theta), 0.0
    return math.sin(theta) * math.cos(phi), math.sin(theta) * math.sin(phi), math.cos(theta)


def wall_normal(
    words: Sequence[str], regions: Mapping[str, Sequence[str]], number: Callable[[str], float]
) -> tuple[float, ...] | None:
    """Return the normal of the plane wall in the words of a line, x y z of any length; None for other walls.

    `regions` has the words of each region from its style on, and `number` returns the number that a word says.
    """
    # A shape such as zplane has the axis as its first letter. A region "plane PX PY PZ NX NY NZ" has its normal in the
    # words 4 to 6.
    for shape, name in itertools.pairwise(words):
        if shape in ("xplane", "yplane", "zplane"):
            return tuple(float(shape[0] == axis) for axis in "xyz")
        if shape == "region" and regions.get(name, ("",))[0] == "plane":
            return tuple(map(number, regions[name][4:7]))
    return None


def wall_radius(
    shape: Sequence[str], regions: Mapping[str, Sequence[str]], number: Callable[[str], float], is_scaled: bool
) -> tuple[float, *tuple[str, ...]]:
    """Return the radius of a wall, < 0 if it is hollow, 0 for a plane; and what a reader of its row has to know.

    With it R_eff is R R_wall/(R + R_wall) (`GranularModel::check_contact`). A cylinder has twice its radius
    (`FixWallGran`, `RegCylinder::surface_interior`), a sphere its own.

    Parameters
    ----------
    shape : sequence of str
        The words of the wall, such as zplane 0 NULL.
    regions : mapping of str to sequence of str
        Words of each region from its style on.
    number : callable
        From a word to its number.
    is_scaled : bool
        Whether there is a lattice, which scales regions without `units box`.
    """
    curved = "R_eff is that of the curved wall"
    # zcylinder R: the particles are inside.
    if shape[0] == "zcylinder":
        return -2 * number(shape[1]), curved
    words = regions.get(shape[1], ("",)) if shape[0] == "region" else ("plane",)
    if words[0] in ("block", "plane", "prism"):
        return (0.0,)
    # "cylinder AXIS C1 C2 R LO HI" and "sphere X Y Z R": the radius is word 4. The wall of a cylinder is curved in one
    # direction only: LAMMPS doubles its radius.
    factor = {"cylinder": 2, "sphere": 1}.get(words[0])
    if factor is None or (is_scaled and "box" not in words):
        return 0.0, "R_eff is that of a plane, as the curvature of the wall is not computed"
    return factor * number(words[4]) * (1 if "out" in words else -1), curved


_NATIVE = native.Native(
    (
        native.Parameter("normal", words=("hooke", "hertz", "hertz/material", *LAMMPS_NORMALS)),
        native.Parameter(
            "coefficients",
            accepted="the numbers of the normal model, as in the line: k_n and damping coefficient, or for "
            "hertz/material E, damping coefficient and nu; jkr and dmt have gamma after these; with tsuji and "
            "coeff_restitution the coefficient is an eps",
            max_numbers=4,
            per_body=True,
        ),
        native.Parameter(
            "damping", default="viscoelastic", words=("velocity", "mass_velocity", "viscoelastic", *_KAPPA_FROM_EPSILON)
        ),
        native.Parameter("limit_damping", default="no", words=("no", "yes")),
        native.Parameter("units", default="lj", words=tuple(UNITS)),
    ),
    _force,
    _SOURCE,
    schemes={"verlet": SEMI_IMPLICIT},
    integrator="run_style",
    damped_values=_damped,
    warnings=_warnings,
    units=lambda values: UNITS[values["units"]],
)

SIMULATOR = Simulator(
    "lammps",
    "LAMMPS",
    "commit 07b704c",
    (
        *formulas(
            _E,
            _EPSILON,
            _SOURCE,
            ("hertz, coeff_restitution", TSUJI_RETURN, tsuji_kappa, "exact"),
            ("hertz, coeff_restitution, limit_damping", TSUJI, tsuji_kappa, "other end"),
            ("hooke, coeff_restitution", LINEAR_RETURN, linear_kappa, "exact"),
            ("hooke, coeff_restitution, limit_damping", LINEAR, linear_kappa, "other end"),
        ),
        *formulas(
            _E,
            ("0", "1"),
            _SOURCE,
            (
                "hertz, tsuji",
                TSUJI_RETURN,
                marshall,
                "normalisation",
                "Releases up to 22 Jul 2025 lack the factor √2 between Tsuji's mass and the effective mass.",
            ),
            ("hertz, tsuji (2026)", TSUJI_RETURN, tsuji_fit, "approximate formula"),
            ("hertz, tsuji (2026), limit_damping", TSUJI, tsuji_fit, "other end"),
        ),
        *formulas(
            "eta_n0 sqrt(m_eff/k)",
            ("0", "100"),  # kappa itself; eps, which tends to kappa^-2 if contact ends at zero force, is 1e-4 at 100
            _SOURCE,
            ("hooke, mass_velocity", LINEAR_RETURN, mp.mpf, "exact"),
            ("hooke, mass_velocity, limit_damping", LINEAR, mp.mpf, "other end"),
            usual_parameter=linear_kappa,
        ),
        viscoelastic_formula("hertz, viscoelastic, limit_damping", _SOURCE, f"{_WRITTEN}.", parameter=_SCALED_ETA),
        viscoelastic_formula(
            "hertz, viscoelastic",
            _SOURCE,
            f"{_WRITTEN}, without its `limit_damping`.",
            "return",
            parameter=_SCALED_ETA,
        ),
    ),
    texts={"lammps": InputFile("#", _USE, _CODE, _values, f"{WAY_OUT}, or take coeff_restitution")},
    lines={"pair": f"pair_coeff 1 1 {STYLE}", "wall": _WALL},
    native=_NATIVE,
    default_step=DEFAULT_STEPS["si"],
)
