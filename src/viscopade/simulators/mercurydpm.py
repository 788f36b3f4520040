"""MercuryDPM: the exact viscoelastic law, or a constant eps for older versions of the program.

    HertzianBSHPViscoelasticSpecies species;
    species.setEffectiveElasticModulus(3.68e10);
    species.setDissipation(1.2e-6);

Read in the source of MercuryDPM 1.0 (trunk of July 2024, `Kernel/`), with d the overlap, v_n the speed of compression,
and E_eff, R_eff, m_eff as in `Pair` (`BaseInteraction::getEffectiveRadius` and `getEffectiveMass`, at walls too):

`HertzianBSHPViscoelasticInteraction::computeNormalForce` (in the program since September 2022):
    F = max(0, k d + 3/2 A k v_n), k = 4/3 E_eff sqrt(R_eff d).
    This is the paper's Eq. 2 with our end condition, for all sizes. `setEffectiveElasticModulus` takes E_eff,
    `setDissipation` takes A.
`HertzianViscoelasticInteraction::computeNormalForce`:
    F = k d + D sqrt(m_eff k) v_n, not clipped.
    This is Tsuji's damping (`derivations/12_tsuji.py`) with alpha = D, `setDissipation`'s argument, for contact that
    ends at x = 0.
    `setEffectiveElasticModulusAndRestitutionCoefficient` inverts that correctly.

A pair of different species has a mixed species, `MixedSpecies::mixAll`: `mix` of each normal species takes the harmonic
means (`BaseSpecies::average`) of the numbers that the setters left, stiffness or effective modulus and dissipation. So
E_eff is right by itself, as the harmonic mean of the two E_eff is Hertz's; A would be the harmonic mean too, which is
not that of `Pair.A`. The header sets both.

From a coefficient of restitution, read in Kernel of kuwt/MercuryDPM_fork at commits 0841c35, 126c08f and 23b48a9:

- `LinearViscoelasticNormalSpecies::setCollisionTimeAndRestitutionCoefficient`, `setStiffnessAndRestitutionCoefficient`:
  stiffness and dissipation of a linear contact of two particles of the given mass that ends at x = 0, exactly.
- `LinearViscoelasticInteraction::computeNormalForce`: F = k x + dissipation v, not cut off. At a wall the same k and
  dissipation meet twice the m_eff.
- `HertzianViscoelasticNormalSpecies::setElasticModulusAndRestitutionCoefficient`: Tsuji's damping with the damping
  ratio for contact that ends at x = 0; the force is not cut off, and m_eff is the contact's own.
- `HertzianBSHPViscoelasticNormalSpecies::setEffectiveElasticModulusAndRestitutionCoefficient` stops with an error.

`DPMBase::integrateBeforeForceComputation` is half of a velocity Verlet step: the damping takes the velocity half a step
before.
"""

from __future__ import annotations

import math
import re
from typing import Any

from mpmath import mp

from viscopade.collision.schemes import SEMI_IMPLICIT
from viscopade.collision.spheres import Sphere
from viscopade.simulators import native
from viscopade.simulators.formula import (
    LINEAR_RETURN,
    TSUJI_RETURN,
    formulas,
    half_mass_kappa,
    linear_kappa,
    tsuji_kappa,
    viscoelastic_formula,
)
from viscopade.simulators.input_file import Row, template_contact, time_step, type_rows
from viscopade.simulators.own_law import Goal, OwnLawContact, Softness, best_row, constant_row
from viscopade.simulators.setup import NamedContact, Setup
from viscopade.simulators.simulator import InputFile, Simulator


def _values(setup: Setup) -> dict[str, Any]:
    """Return what the templates have, by name: bodies become species, walls too.

    Contacts of two different bodies set the mixed species.

    Raises
    ------
    ValueError
        If two bodies' names differ only in characters that a C++ name cannot have.
    """
    names = identifiers(list(setup.bodies))
    contacts_with_alike = {contact.first: contact.pair for contact in setup.contacts if contact.first == contact.second}

    def species_row(name: str) -> tuple[str, Sphere, float, float]:
        """Return the C++ name, the body, and E_eff and A of its contacts with bodies of the same kind."""
        body, pair = setup.bodies[name], contacts_with_alike.get(name)
        if pair is not None:
            return names[name], body, pair.E_eff, pair.A
        # 1/E_eff = (1 - nu^2)/Y twice: half of the plane-strain modulus.
        return names[name], body, body.plane_strain_modulus / 2, body.dissipative_constant

    def constant_eps_columns(contact: NamedContact) -> Row:
        """Return the columns on the species that all versions have, whose eps is the same at all speeds."""
        formula = SIMULATOR.formula(_SPECIES["HertzianViscoelastic"])
        goal = Goal.from_contact(contact, setup.weighty)
        constant = OwnLawContact(formula, goal, Softness(contact.pair.rho), units=setup.units)
        # setDissipation takes alpha, which is kappa.
        columns = constant, "setDissipation", lambda e: float(formula.kappa(mp.mpf(e)))
        return {**constant_row(*columns), **best_row(*columns)}

    return {
        **time_step(setup),
        "contacts": [template_contact(contact, setup, row=constant_eps_columns(contact)) for contact in setup.contacts],
        "types": type_rows(setup, "species", names),
        "species": [species_row(name) for name in setup.bodies],
        "mixed": [
            (names[contact.first], names[contact.second], contact.pair)
            for contact in setup.contacts
            if contact.first != contact.second
        ],
    }


def identifiers(names: list[str]) -> dict[str, str]:
    """Return the C++ name of the species for each of the names of bodies: other characters become underscores.

    Raises
    ------
    ValueError
        If two become the same.
    """
    # Other characters than letters, digits and _ become _, and a digit cannot come first.
    cpp = {name: re.sub(r"\W", "_", f"{name}_species", flags=re.ASCII) for name in names}
    cpp = {name: f"_{identifier}" if identifier[0].isdigit() else identifier for name, identifier in cpp.items()}
    for name, identifier in cpp.items():
        others = [other for other in names if other != name and cpp[other] == identifier]
        if others:
            same = f"bodies {name!r} and {others[0]!r} get the same C++ name"
            raise ValueError(f"{same}: expected names that differ in letters or digits")
    return cpp


_USE = """\
MercuryDPM 1.0: viscopade::addSpecies(speciesHandler) adds the species below, in this order.
Numbers are in {{ units.length }}, {{ units.mass }}, {{ units.time }}.

{{ time_step }} Write setTimeStep({{ timestep }}).

Law: HertzianBSHPViscoelasticSpecies,
    F = max(0, k d + 3/2 A k v_n) with k = 4/3 E_eff sqrt(R_eff d).
It is the viscoelastic law, for all sizes; contact ends when the force vanishes. There is no error of eps except for
that of the time step.

Older versions have HertzianViscoelasticSpecies: with setDissipation below it has one eps for
all speeds{{ " (without weight)" if setup.weighty }}, and the force may attract.
"""

_CODE = """\

#ifndef VISCOPADE_MERCURYDPM_H
#define VISCOPADE_MERCURYDPM_H

#include "SpeciesHandler.h"
#include "Species/HertzianBSHPViscoelasticSpecies.h"

namespace viscopade
{

struct Species
{
{% for name, body, modulus, dissipation in species %}
    HertzianBSHPViscoelasticSpecies* {{ name }};
{% endfor %}
};

inline Species addSpecies(SpeciesHandler& handler)
{
    Species species{};
    HertzianBSHPViscoelasticSpecies one;
    const auto set = [](HertzianBSHPViscoelasticSpecies& some, double modulus, double dissipation) {
        some.setEffectiveElasticModulus(modulus);
        some.setDissipation(dissipation);
    };
{% for name, body, modulus, dissipation in species %}
{% if not body.is_wall %}
    one.setDensity({{ number(body.density) }});
{% endif %}
    set(one, {{ number(modulus) }}, {{ number(dissipation) }});
    species.{{ name }} = handler.copyAndAddObject(one);
{% endfor %}
{% for first, second, pair in mixed %}
    set(*handler.getMixedObject(species.{{ first }}, species.{{ second }}), {{ number(pair.E_eff) }}, {{
number(pair.A) }});
{% endfor %}
    return species;
}

} // namespace viscopade

#endif
"""

# The audit asks for eps from 1e-6 to 1; the least one is chosen by hand.
_ACCEPTED, _E = ("1e-6", "1"), "restitution coefficient"
_FOLDER = "Kernel/Species/NormalForceSpecies"
_LINEAR = f"{_FOLDER}/LinearViscoelasticNormalSpecies.cc"
_SPECIES = {
    "LinearViscoelastic": "LinearViscoelastic, setCollisionTimeAndRestitutionCoefficient",
    "HertzianViscoelastic": "HertzianViscoelastic, setElasticModulusAndRestitutionCoefficient",
    "HertzianBSHPViscoelastic": "HertzianBSHPViscoelastic",
}
"""The formula of each species, whose law is the species'."""


def _force(values: native.Values, impact: native.Impact) -> native.Power:
    """Return the force k x^a + c x^b v of a species.

    `values` are the numbers of the user's file by their names, pairs where both bodies have one (SI units), and
    `impact` has the effective mass and radius, in kg and m. `values.mix` makes one number of both by a rule, and
    remembers it for the answer. The damping of an eps is c = kappa sqrt(k m), with the kappa that the program's formula
    makes of it.

    Raises
    ------
    ValueError
        If both dissipation and restitutionCoefficient are given.
    """
    species, has_dissipation = values["species"], "dissipation" in values
    formula, mixed = SIMULATOR.formula(_SPECIES[species]), f"{species}NormalSpecies::mix"
    if has_dissipation and "restitutionCoefficient" in values:
        raise ValueError("dissipation and restitutionCoefficient: expected one of them")

    if species == "LinearViscoelastic":

        def spring_and_dashpot(body: int) -> tuple[float, float]:
            """Return k and c that the setters leave to the species of a body, 0 or 1."""
            if has_dissipation:
                return values["stiffness"][body], values["dissipation"][body]
            # The setters mean two particles of the given mass, whose effective mass is half of it.
            e, half_mass = values["restitutionCoefficient"][body], values["particleMass"][body] / 2
            if "stiffness" in values:
                k = values["stiffness"][body]
            else:
                # A linear contact that ends at x = 0 lasts t_c if k = m/2 (pi^2 + ln^2 e)/t_c^2.
                k = half_mass * (math.pi**2 + math.log(e) ** 2) / values["collisionTime"][body] ** 2
            return k, native.power_force(formula, e, k, half_mass).c

        stiffnesses, dissipations = zip(spring_and_dashpot(0), spring_and_dashpot(1), strict=True)
        k = values.mix("stiffness", native.HARMONIC, mixed, stiffnesses)
        return native.Power(formula.law, k, values.mix("dissipation", native.HARMONIC, mixed, dissipations))

    # k = 4/3 E_eff sqrt(R_eff) of k x^(3/2)
    k = 4 / 3 * values.mix("effectiveElasticModulus", native.HARMONIC, mixed) * math.sqrt(impact.effective_radius)
    if species == "HertzianBSHPViscoelastic":
        # c = 3/2 A k
        return native.Power(formula.law, k, 1.5 * values.mix("dissipation", native.HARMONIC, mixed) * k)
    # The dissipation D of both bodies, which is kappa, is given or follows from their eps; c = D sqrt(m k).
    first, second = (
        values["dissipation"]
        if has_dissipation
        else (float(formula.kappa(mp.mpf(e))) for e in values["restitutionCoefficient"])
    )
    dissipation = values.mix("dissipation", native.HARMONIC, mixed, (first, second))
    return native.Power(formula.law, k, dissipation * math.sqrt(impact.effective_mass * k))


_NATIVE = native.Native(
    (
        native.Parameter("species", words=tuple(_SPECIES)),
        native.positive("stiffness", "N/m", per_body=True),
        native.Parameter(
            "dissipation",
            accepted="a number >= 0: in N s/m if {}, without unit if {}, in s if {}".format(*_SPECIES),
            per_body=True,
        ),
        native.positive("effectiveElasticModulus", "Pa", per_body=True),
        native.positive("collisionTime", "s", per_body=True),
        native.restitution("restitutionCoefficient", per_body=True),
        native.positive("particleMass", "kg", per_body=True),
    ),
    _force,
    _LINEAR,
    schemes={"velocity Verlet": SEMI_IMPLICIT},
    damping=lambda values: "restitutionCoefficient" if "restitutionCoefficient" in values else "dissipation",
)

SIMULATOR = Simulator(
    "mercurydpm",
    "MercuryDPM",
    "kuwt/MercuryDPM_fork, commits 0841c35, 126c08f and 23b48a9",
    (
        *formulas(
            _E,
            _ACCEPTED,
            _LINEAR,
            (_SPECIES["LinearViscoelastic"], LINEAR_RETURN, linear_kappa, "exact"),
            (
                f"{_SPECIES['LinearViscoelastic']}, at a wall",
                LINEAR_RETURN,
                half_mass_kappa,
                "normalisation",
                "The effective mass is taken to be that of two particles of one mass; at a wall it is twice as large.",
            ),
        ),
        *formulas(
            _E,
            _ACCEPTED,
            f"{_FOLDER}/HertzianViscoelasticNormalSpecies.cc",
            (_SPECIES["HertzianViscoelastic"], TSUJI_RETURN, tsuji_kappa, "exact"),
        ),
        viscoelastic_formula(
            _SPECIES["HertzianBSHPViscoelastic"],
            f"{_FOLDER}/HertzianBSHPViscoelasticNormalSpecies.cc",
            "`k` is `4/3 E_eff sqrt(R_eff)`. The dissipation is as `viscopade simulators mercurydpm` writes it.",
            parameter="3/2 dissipation (k/m_eff)^(2/5) v^(1/5)",
        ),
    ),
    texts={"mercurydpm": InputFile("//", _USE, _CODE, _values)},
    lines={
        "pair": "HertzianBSHPViscoelasticSpecies species;\n"
        "species.setDensity({density});\n"
        "species.setEffectiveElasticModulus({E_eff});\n"
        "species.setDissipation({A});"
    },
    native=_NATIVE,
)
