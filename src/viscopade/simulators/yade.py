"""YADE: the viscoelastic law in versions after 2023.02a; a constant eps in 2023.02a and before.

    O.materials.append(FrictMat(young=70e9, poisson=0.22, density=2500, frictionAngle=0))
    Ip2_FrictMat_FrictMat_MindlinPhys(en=0.9, vn=1)
    NewtonIntegrator(damping=0)

Read in `pkg/dem/HertzMindlin.cpp` of YADE, `Ip2_FrictMat_FrictMat_MindlinPhys::go` and
`Law2_ScGeom_MindlinPhys_Mindlin::go`, with u the overlap and v_n the speed of compression:

    F = kno u^(3/2) + c v_n, clipped at 0 (without adhesion), kno = 4/3 E_eff sqrt(R_eff), kn = 3/2 kno sqrt(u).

In all versions: c = 2 betan sqrt(m_eff kn). This is Tsuji's damping (`derivations/12_tsuji.py`) with alpha = sqrt(6)
betan, a damping ratio of zeta = sqrt(6/5) betan: eps does not depend on the speed. `betan` may be given, or `en`, from
which the program takes betan by a fit of Thornton, Cummins and Cleary for the clipped force (2023.02a; older versions
use Tsuji's formula for the end at x = 0 and are off by more). `betan` from here needs no fit.

After 2023.02a (merge request 977): with `en` and `vn` together c = A kn and A = 2/3 beta (kno/m_eff)^(-2/5), which is
the paper's Eq. 2, with our end of contact. beta = v*^2 vn^(-1/5), and v* solves [3/6](v*) = en with the paper's
printed coefficients. So `en` is not given as eps but as the value of the printed [3/6] at the exact v*: then beta is
exact. The program has the same beta, not A, for all sizes of one pair of materials.

At a wall R_eff is R/2, and at a facet 2/3 R, instead of R: `Ig2_Wall_Sphere_ScGeom` and `Ig2_Facet_Sphere_ScGeom` give
them the sphere's radius and twice that. Without weight eps does not feel it in either law, as betan and beta fix it.
The duration of contact does, and with it the effect of weight and of time steps: a file's numbers are for R/2. m_eff is
the sphere's if the other body is not dynamic.

With betan = A/2 sqrt(kn/m_eff), set for every contact at every step, c = A kn in all versions. The generated code has
that as a function to be run by the program: exact, and slow, as it is Python. At walls and facets it uses the A that
gives the right beta with the program's R_eff.

For the audit, read in pkg/dem of YADE 2025.2.0 (c61292558/yade4deepin at commit f1486c0) and of an older trunk
(Togekey/yade_trunk at commit a6084d6):

- From `en` (or `es`) `Ip2_FrictMat_FrictMat_MindlinPhys::go` takes betan by (B6) and (B7) of Thornton, Cummins and
  Cleary (2013), a fit of degree 10. In the older trunk `en` goes through Tsuji's damping ratio for the end at x = 0.
  `en`, `vn` and `betan` are numbers of the functor, `MatchMaker`s with one for a pair of materials; the moduli of both
  materials make Hertz' E_eff.
- Ip2_ViscElMat_ViscElMat_ViscElPhys of ViscoelasticPM.cpp: k and c from `tc`, `en`, `et` are those of a linear
  contact that ends at x = 0 (Pournin et al. 2001), but a force that would pull is 0. `tc` and `en` are the means of
  both materials'. Without `tc` k = kn_1 kn_2/(kn_1 + kn_2), kn = 2 `young` R, with the radii of both bodies, and
  `find_cn_from_en` solves the formula for the end that the contact has (Schwager and Poeschel 2007) by Newton's
  method, until eps is within 1 % of `en`: it comes from above.
- For both, a body of mass 0 counts as one of the other's mass: half of m_eff at a wall or a facet.

`NewtonIntegrator` is a leapfrog: the damping takes the velocity half a step before. Its own damping D, 0.2 unless set,
multiplies an acceleration a, that of gravity too, by 1 - D sign(a v). `O.dt` is 1e-8 unless set (core/Scene.hpp).
"""

from __future__ import annotations

import math
from collections.abc import Iterator
from dataclasses import replace
from fractions import Fraction
from typing import Any

import numpy as np
from mpmath import mp

from viscopade.arrays.checked import FloatArray
from viscopade.collision.contact import Contact
from viscopade.collision.schemes import SEMI_IMPLICIT
from viscopade.collision.spheres import Pair
from viscopade.collision.weight import FallingContact, calibrated
from viscopade.simulators import native
from viscopade.simulators.formula import (
    LINEAR,
    TSUJI,
    formulas,
    half_mass_kappa,
    linear_kappa,
    ratio_at_force_end,
    thornton_kappa,
    tsuji_kappa,
)
from viscopade.simulators.input_file import WAY_OUT, same_beta, size_errors, template_contact, time_step, type_rows
from viscopade.simulators.own_law import Goal, OwnLawContact, Softness, best_row, constant_row
from viscopade.simulators.setup import NamedContact, Setup
from viscopade.simulators.simulator import InputFile, Simulator
from viscopade.theory.law import VISCOELASTIC
from viscopade.theory.paper import TABLE


def betan(epsilon: Any) -> Any:
    """Return the `betan` that gives an eps in a contact that ends at force 0; both are mpmath numbers.

    Examples
    --------
    >>> f"{float(betan(0.9)):.6f} {float(betan(0.3)):.6f}"
    '0.031280 0.453915'
    """
    # betan = sqrt(5/6) zeta, with the damping ratio zeta of a linear contact with this eps
    return mp.sqrt(mp.mpf(5) / 6) * ratio_at_force_end(epsilon)


def printed_pade(v_star: float) -> float:
    """Return the paper's [3/6] approximant of eps at v* with its printed coefficients, which the program inverts."""
    # TABLE[3, 6]: the decimals of numerator and denominator, from the power 0 of v* on
    a, b = (sum(Fraction(c) * Fraction(v_star) ** i for i, c in enumerate(row)) for row in TABLE[3, 6])
    return float(a / b)


def _values(setup: Setup) -> dict[str, Any]:
    """Return what the templates have of a setup, by name: bodies become materials, contacts pairs that may meet."""
    contacts_in_program = tuple(program_contact(contact, setup.weighty) for contact in setup.contacts)
    program_setup = replace(setup, contacts=contacts_in_program)
    contacts = []
    for real, contact in zip(setup.contacts, contacts_in_program, strict=True):
        pair, vn, goal = contact.pair, contact.typical, Goal.from_contact(real, setup.weighty)
        # Both laws with the stiffness that the program has. Its contact at a wall lasts longer than that of the bodies,
        # so the weight acts longer.
        constant, viscoelastic = (
            OwnLawContact(SIMULATOR.formula(f"MindlinPhys, {name}"), goal, Softness(pair.rho), units=setup.units)
            for name in ("betan", "en and vn")
        )

        # Columns of the table: the betan of older versions, and what weight does with it.
        row = {**constant_row(constant, "betan"), **best_row(constant, "betan")}
        if goal.epsilon_with_weight is not None:
            light_eps = constant.delivered(vn, falls=False)
            sticking_speed = constant.falling and constant.falling.sticking_speed
            facets = (f"{facet_contact(law).epsilon([vn])[0]:.4f}" for law in (constant, viscoelastic))
            row["betan: eps without weight", ""] = f"{light_eps:.6f}"
            if sticking_speed is not None:
                row["betan: stays down below", setup.units.speed] = f"{sticking_speed:.3g}"
            row["with weight at a Facet (2/3 R): eps of betan, of en", ""] = " ".join(facets)
        numbers = {"betan": constant.parameter, "en": printed_pade(pair.v_star(vn)), "vn": vn, "A": pair.A}
        contacts.append(
            template_contact(contact, program_setup, size_errors(real, same_beta(real.pair)), row, **numbers)
        )
    return {
        **time_step(program_setup),
        "setup": program_setup,
        "contacts": contacts,
        "types": type_rows(setup, "material", {name: name for name in setup.bodies}),
    }


def program_contact(contact: NamedContact, weighty: bool) -> NamedContact:
    """Return a contact as the program has it: at a Wall with half of the radius, and the same mass.

    Its beta is that of the bodies, or if `weighty` the one that has their eps with weight at the typical speed.
    """
    if not contact.falls:
        return contact

    def at_wall(pair: Pair) -> Pair:
        """Return a pair with the program's R_eff at a Wall, and the A that keeps beta."""
        halved = replace(pair, first=replace(pair.first, radius=_RADII["wall"] * pair.first.radius))
        return halved.damped(float(halved.dissipative_constant(pair.beta)))

    pair = at_wall(contact.pair)
    epsilon = float(contact.falling.epsilon([contact.typical])[0]) if weighty else 0.0
    if epsilon:  # no damping makes a contact that has eps = 0
        pair = calibrated(pair, contact.typical, epsilon, contact.gravity)
    return replace(contact, pair=pair, extremes=tuple(map(at_wall, contact.extremes)))


def facet_contact(contact: OwnLawContact) -> FallingContact:
    """Return the contact of a body that falls on a wall, with the R_eff that the program has at a facet."""
    assert contact.falling is not None
    # T ~ (k/m)^(-2/5) and k ~ sqrt(R_eff): times are in proportion to R_eff^(-1/5).
    return replace(contact.falling, time=contact.falling.time * (_RADII["wall"] / _RADII["facet"]) ** 0.2)


_USE = """\
YADE: materials and contact law. Say exec(open("this file").read()) first, give bodies material=materials["..."], and
use
    InteractionLoop([Ig2_Sphere_Sphere_ScGeom()], [physics], [Law2_ScGeom_MindlinPhys_Mindlin()])
    NewtonIntegrator(damping=0)    # its own damping, 0.2 unless set, comes on top of the contact's
Numbers are in {{ units.length }}, {{ units.mass }}, {{ units.time }}. Contact ends when the force vanishes: the program
clips it at 0.

{{ time_step }} That is for en and vn; with viscoelastic() the error is larger, as its kn is a step old.

After 2023.02a the law is viscoelastic: en is the printed [3/6] at the exact v*, which the program inverts; eps itself
would leave its error. A pair of materials has one beta. Older versions have one eps for all speeds, by betan.
{% if contacts | selectattr("contact.falls") | list %}
R_eff, A, times and weight of a contact with a wall are those at a Wall, where the program takes R/2 for R_eff.
{% endif %}
"""

_CODE = '''\

materials = {
{% for name, body in setup.bodies.items() %}
    {{ name | string }}: FrictMat(young={{ number(body.young_modulus) }}, poisson={{ number(body.poisson_ratio) }},{{
"" if body.is_wall else " density=" ~ number(body.density) ~ "," }} frictionAngle=0),
{% endfor %}
}
materials = {name: O.materials.append(material) for name, material in materials.items()}

# (betan, en, vn, A) of each pair of materials. A pair that is not listed is refused when it meets.
pairs = {
{% for pair in contacts %}
    ({{ pair.contact.first | string }}, {{ pair.contact.second | string }}): ({{ number(pair.betan) }}, {{
number(pair.en) }}, {{ number(pair.vn) }}, {{ number(pair.A) }}),
{% endfor %}
}
betan, en, vn, A = ({pair: numbers[i] for pair, numbers in pairs.items()} for i in range(4))


def matches(values):
    """Return a MatchMaker for pairs of materials."""
    return MatchMaker(matches=[(materials[a], materials[b], value) for (a, b), value in values.items()])


def viscoelastic():
    """Make the force of every contact viscoelastic in this step; exact in all versions, but slow.

    To use it, put PyRunner(iterPeriod=1, command="viscoelastic()") before the InteractionLoop.
    """
    for contact in O.interactions:
        first, second = O.bodies[contact.id1], O.bodies[contact.id2]
        mobility = sum(1 / body.state.mass for body in (first, second) if body.dynamic)
        constant = A_of_materials[frozenset((first.material.id, second.material.id))]
        # A of a sphere and a Wall is for R_eff = R/2, which the program has there. At a Facet it has another R_eff: an
        # A that makes up for it leaves beta as it is.
        radii = [body.shape.radius for body in (first, second) if isinstance(body.shape, Sphere)]
        curvature = 2 / radii[0] if len(radii) == 1 else 1 / radii[0] + 1 / radii[1]
        constant *= ((1 / contact.geom.refR1 + 1 / contact.geom.refR2) / curvature) ** 0.2
        contact.phys.betan = constant / 2 * (contact.phys.kn * mobility) ** 0.5


A_of_materials = {frozenset((materials[a], materials[b])): value for (a, b), value in A.items()}

# After 2023.02a the functor has vn and with it the viscoelastic law; until then it has one eps for all speeds.
if "vn" in Ip2_FrictMat_FrictMat_MindlinPhys().dict():
    physics = Ip2_FrictMat_FrictMat_MindlinPhys(en=matches(en), vn=matches(vn))
else:
    physics = Ip2_FrictMat_FrictMat_MindlinPhys(betan=matches(betan))
    print("viscopade: this YADE has one eps for all speeds; see viscoelastic() above for the exact law")

O.dt = {{ timestep }}
'''

_MINDLIN, _LINEAR = "pkg/dem/HertzMindlin.cpp", "pkg/dem/ViscoelasticPM.cpp"
_VISC_EL = "Ip2_ViscElMat_ViscElMat_ViscElPhys"
# The least eps of the audit, 0.01, is chosen by hand: all formulas of `en` fall further, down to 1e-9 (sampled).
_EN, _NEARLY_ALL = "en", ("0.01", "1")


def _betan_kappa(betan: Any) -> Any:
    """Return the kappa of a betan, an mpmath number."""
    # c v = 2 betan sqrt(m kn) v with kn = 3/2 kno sqrt(u) is sqrt(6) betan sqrt(m kno) u^(1/4) v.
    return mp.sqrt(6) * betan


def _printed_pade_kappa(en: Any) -> Any:
    """Return the kappa = v*^2 at which the printed [3/6], which falls from 1, is en; both are mpmath numbers."""
    # [3/6]: numerator of degree 3, denominator of degree 6, from the power 0 on
    numerator, denominator = ([*map(mp.mpf, row)] for row in TABLE[3, 6])
    # numerator - en denominator = 0 in double precision, with 13 digits of its roots. A real one has an imaginary part
    # by rounding only, below 1e-9 of it. The least positive one is v*; Newton's method then finds all digits.
    rough = np.polynomial.Polynomial([*map(float, numerator)])
    rough -= float(en) * np.polynomial.Polynomial([*map(float, denominator)])
    roots = map(complex, rough.roots().tolist())
    v_star = min((root.real for root in roots if root.real > 1e9 * abs(root.imag)), default=0)
    return mp.findroot(lambda v: mp.polyval(numerator[::-1], v) - en * mp.polyval(denominator[::-1], v), v_star) ** 2


def _newton_kappa(en: Any) -> Any:
    """Return kappa of the linear spring by `find_cn_from_en`: Newton's method until eps is within 1 % of en."""
    # It begins at zeta = 0, with eps = 1; kappa = 2 zeta.
    zeta, epsilon = mp.mpf(0), mp.mpf(1)
    while abs(epsilon - en) > en / 100:
        # eps = exp(-2 zeta acos(zeta)/w), w^2 = 1 - zeta^2, and d eps/d zeta = -2 eps (acos(zeta)/w - zeta)/w^2. From
        # zeta = 1 on acos and w are imaginary, and their ratio is real.
        w_squared = (1 - zeta) * (1 + zeta)
        angle_over_w = mp.re(mp.acos(zeta) / mp.sqrt(w_squared))
        zeta += (epsilon - en) * w_squared / (2 * epsilon * (angle_over_w - zeta))
        epsilon = mp.exp(-2 * zeta * mp.re(mp.acos(zeta) / mp.sqrt((1 - zeta) * (1 + zeta))))
    return 2 * zeta


_BODIES = {"sphere": (2, 2), "wall": (1, 1), "facet": (1, 2)}
"""Radii of a sphere and of what it hits as the program counts them, over R_eff; two spheres are taken to be alike."""
_RADII = {other: first * second / (first + second) for other, (first, second) in _BODIES.items()}
"""What the program takes for R_eff, over R_eff: 1, at a wall 1/2, and at a facet 2/3."""


def _force(values: native.Values, impact: native.Impact) -> native.Power:
    """Return the force k x^a + c x^b v of a functor.

    `values` are the numbers of the user's file by their names, pairs where both bodies have one (SI units), and
    `impact` has the effective mass and radius, in kg and m. `values.mix` makes one number of both by a rule, and
    remembers it for the answer. The damping of an eps is c = kappa sqrt(k m), with the kappa that the program's formula
    makes of it.

    Raises
    ------
    ValueError
        If neither or both of en and betan are given, neither of tc and young, or MindlinPhys is to mix en.
    """
    mass, other = impact.effective_mass, values["other"]
    if values["physics"] == "ViscElPhys":
        e = values.mix("en", native.MEAN, _VISC_EL)
        # A wall's mass counts as that of the sphere: m_eff is half of it.
        counted = mass if other == "sphere" else mass / 2
        if "tc" in values:
            # k = m (pi^2 + ln^2 e)/t_c^2
            k = counted / values.mix("tc", native.MEAN, _VISC_EL) ** 2 * (math.pi**2 + math.log(e) ** 2)
            formula = SIMULATOR.formula("ViscElPhys, tc, en, et" + ("" if other == "sphere" else ", at a wall"))
            return native.power_force(formula, e, k, mass)
        if "young" not in values:
            raise ValueError("tc and young: expected one of them")
        # kn = 2 young R of each body, and both springs are in series
        first, second = (
            2 * young * radius * impact.effective_radius
            for young, radius in zip(values["young"], _BODIES[other], strict=True)
        )
        k = values.mix("kn", native.SERIES, "contactParameterCalculation", (first, second), "2 young R")
        return native.power_force(SIMULATOR.formula("ViscElPhys, young, en, et"), e, k, counted)

    modulus = native.effective_modulus(values, values["young"], values["poisson"], "Ip2_FrictMat_FrictMat_MindlinPhys")
    # kno = 4/3 E_eff sqrt(R_eff), with the program's R_eff
    k = 4 / 3 * modulus * math.sqrt(impact.effective_radius * _RADII[other])
    if ("en" in values) == ("betan" in values):
        raise ValueError("en and betan: expected one of them")
    if "betan" in values:
        return native.power_force(SIMULATOR.formula("MindlinPhys, betan"), values["betan"], k, mass)
    e = values.single("en", "as MindlinPhys has one for a pair of materials")
    if "vn" not in values:
        return native.power_force(SIMULATOR.formula("MindlinPhys, en"), e, k, mass)
    # The viscoelastic law: kappa follows from en, and c from kappa at the speed vn.
    formula = SIMULATOR.formula("MindlinPhys, en and vn")
    kappa = float(formula.kappa(mp.mpf(e)))
    return native.Power(formula.law, k, formula.law.damping_constant(kappa, values["vn"], k=k, mass=mass))


def _with_integrator_damping(contact: Contact, values: native.Values) -> Contact:
    """Return the contact with the damping D of `NewtonIntegrator` (values["damping"]), if it has one."""
    damping = values["damping"]

    def force(x: FloatArray, v: FloatArray) -> FloatArray:
        # a -> a (1 - D sign(a u)), u being the velocity. With the compression's rate v = -u and m a = F - load, the
        # force is F + D |F - load| sign(v). It may pull, so contact ends at x = 0.
        pushes = np.maximum(contact.force(x, v), 0)
        return np.asarray(pushes + damping * np.abs(pushes - contact.load) * np.sign(v))

    return replace(contact, force=force, end="return") if damping else contact


def _warnings(values: native.Values, _: native.Impact) -> Iterator[str]:
    """Yield warnings: two spheres are taken to be alike, and the integrator damps, too."""
    if "kn" in values.mixed and values["other"] == "sphere":
        yield "Two spheres with different young are taken to have one radius, as kn is 2 young times the radius of each"
    if values["damping"]:
        yield f"NewtonIntegrator(damping={values['damping']:g}) takes a part of eps, and slows down free flight, too"


_NATIVE = native.Native(
    (
        native.Parameter("physics", words=("MindlinPhys", "ViscElPhys")),
        native.positive("young", "Pa", per_body=True),
        native.poisson_ratios("poisson"),
        native.restitution("en", least_epsilon=float(_NEARLY_ALL[0]), per_body=True),
        native.Parameter("betan"),
        native.positive("vn", "m/s"),
        native.positive("tc", "s", per_body=True),
        native.Parameter("other", default="sphere", words=tuple(_RADII)),
        native.Parameter("damping", "", "0.2", "a number >= 0 and < 1", lambda part: 0 <= part[0] < 1),
    ),
    _force,
    _MINDLIN,
    schemes={"NewtonIntegrator": SEMI_IMPLICIT},
    integrator="engine",
    damping=lambda values: "betan" if "betan" in values else "en",
    integrator_contact=_with_integrator_damping,
    warnings=_warnings,
)

SIMULATOR = Simulator(
    "yade",
    "YADE",
    "2025.2.0, commit f1486c0 of c61292558/yade4deepin",
    (
        *formulas(_EN, _NEARLY_ALL, _MINDLIN, ("MindlinPhys, en", TSUJI, thornton_kappa, "approximate formula")),
        *formulas(
            _EN,
            _NEARLY_ALL,
            f"{_MINDLIN} at commit a6084d6 of Togekey/yade_trunk",
            ("MindlinPhys, en (trunk before the fit)", TSUJI, tsuji_kappa, "other end"),
        ),
        *formulas(
            "betan",
            ("0", "100"),
            _MINDLIN,
            ("MindlinPhys, betan", TSUJI, _betan_kappa, "exact", "betan is as `viscopade simulators yade` writes it."),
            usual_parameter=betan,
        ),
        *formulas(
            _EN,
            _NEARLY_ALL,
            _MINDLIN,
            (
                "MindlinPhys, en and vn",
                VISCOELASTIC,
                _printed_pade_kappa,
                "approximate formula",
                "The printed [3/6] of the paper stands for the exact function; this is at the speed vn.",
            ),
        ),
        *formulas(
            _EN,
            _NEARLY_ALL,
            _LINEAR,
            ("ViscElPhys, tc, en, et", LINEAR, linear_kappa, "other end"),
            (
                "ViscElPhys, tc, en, et, at a wall",
                LINEAR,
                half_mass_kappa,
                "normalisation",
                "Stiffness and damping are made with half of the mass that the sphere has.",
            ),
            (
                "ViscElPhys, young, en, et",
                LINEAR,
                _newton_kappa,
                "approximate formula",
                "The program's iteration stops within 1 % of en.",
            ),
        ),
    ),
    texts={"yade": InputFile("#", _USE, _CODE, _values, f"{WAY_OUT}, or use viscoelastic()")},
    lines={
        "pair": "FrictMat(young={young}, poisson={poisson}, density={density}, frictionAngle=0)\n"
        "Ip2_FrictMat_FrictMat_MindlinPhys(en={en}, vn={speed})  # versions after 2023.02a"
    },
    native=_NATIVE,
    default_step=1e-8,
)
