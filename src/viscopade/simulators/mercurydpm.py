"""MercuryDPM: the exact viscoelastic law, or a constant eps for older versions of the program.

Read in the source of MercuryDPM 1.0 (trunk of July 2024, `Kernel/`), with d the overlap, v_n the speed of compression,
and E_eff, R_eff, m_eff as in `Pair` (`BaseInteraction::getEffectiveRadius` and `getEffectiveMass`, at walls too):

`HertzianBSHPViscoelasticInteraction::computeNormalForce` (in the program since September 2022):
    F = max(0, k d + 3/2 A k v_n), k = 4/3 E_eff sqrt(R_eff d).
    This is eq:viscoelastic with this package's end condition, for all sizes: `setEffectiveElasticModulus` takes E_eff,
    `setDissipation` takes A.
`HertzianViscoelasticInteraction::computeNormalForce`:
    F = k d + D sqrt(m_eff k) v_n, not clipped.
    This is `viscopade.collision.tsuji` with alpha = D, `setDissipation`'s argument, for contact that ends at x = 0.
    `setEffectiveElasticModulusAndRestitutionCoefficient` inverts that correctly.

A pair of different species has a mixed species. Its E_eff is right by itself, as the program's harmonic mean of the two
E_eff is Hertz's; its A would be the harmonic mean too, which is not that of `Pair.A`. Both are set.

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
from dataclasses import dataclass

from mpmath import mp

from viscopade.collision.schemes import SEMI_IMPLICIT
from viscopade.collision.spheres import Sphere
from viscopade.generated import written_template
from viscopade.simulators import native
from viscopade.simulators.formula import (
    LINEAR_RETURN,
    TSUJI_RETURN,
    DampingFormula,
    linear_kappa,
    tsuji_kappa,
    viscoelastic_kappa,
)
from viscopade.simulators.setup import NamedContact, Setup
from viscopade.simulators.simulator import Simulator
from viscopade.simulators.stated import ConstantEpsilon, common, constant_epsilon, facts
from viscopade.theory.law import VISCOELASTIC, Law


@dataclass(frozen=True)
class SpeciesParameters:
    """Parameters of the species of a pair.

    Attributes
    ----------
    elastic_modulus : float
        E_eff, for `setEffectiveElasticModulus`, a pressure.
    dissipation : float
        A, for `setDissipation` of the species with BSHP in their names, a time.
    constant : ConstantEpsilon
        The eps that species without BSHP can have, and its errors.
    constant_dissipation : float
        `setDissipation` of these for it.
    """

    elastic_modulus: float
    dissipation: float
    constant: ConstantEpsilon
    constant_dissipation: float


def species_parameters(contact: NamedContact) -> SpeciesParameters:
    """Return the parameters for a contact."""
    found = constant_epsilon(contact)
    return SpeciesParameters(contact.pair.E_eff, contact.pair.A, found, float(tsuji_kappa(found.epsilon)))


def render(setup: Setup, command: str) -> str:
    """Return a C++ header for MercuryDPM that adds the species and mixed species.

    Parameters
    ----------
    setup : Setup
        Bodies become species, walls too; contacts of two different bodies set the mixed species.
    command : str
        What the first line says it was made with.

    Raises
    ------
    ValueError
        If two bodies' names differ only in characters that a C++ name cannot have.
    """
    names = identifiers(list(setup.bodies))
    of_contacts = {frozenset((c.first, c.second)): species_parameters(c) for c in setup.contacts}
    return written_template(_TEXT).render(
        **common(setup, command),
        contacts=[(contact, facts(contact, setup.units), species_parameters(contact)) for contact in setup.contacts],
        species=[
            (names[name], *_own(body, of_contacts.get(frozenset((name,))))) for name, body in setup.bodies.items()
        ],
        mixed=[
            (names[contact.first], names[contact.second], species_parameters(contact))
            for contact in setup.contacts
            if contact.first != contact.second
        ],
    )


def _own(body: Sphere, like: SpeciesParameters | None) -> tuple[Sphere, float, float]:
    """Return a body with E_eff and A of contacts with its like."""
    if like is not None:
        return body, like.elastic_modulus, like.dissipation
    return body, body.plane_strain_modulus / 2, body.dissipative_constant


def identifiers(names: list[str]) -> dict[str, str]:
    """Return a C++ name for each name: other characters become underscores.

    Raises
    ------
    ValueError
        If two become the same.
    """
    found = {name: re.sub(r"\W", "_", f"{name}_species", flags=re.ASCII) for name in names}
    found = {name: f"_{identifier}" if identifier[0].isdigit() else identifier for name, identifier in found.items()}
    for name, identifier in found.items():
        others = [other for other in names if other != name and found[other] == identifier]
        if others:
            same = f"bodies {name!r} and {others[0]!r} get the same C++ name"
            raise ValueError(f"{same}: expected names that differ in letters or digits")
    return found


_TEXT = """\
{{ marker | lines("// {}") }}
//
{{ opening | lines("// {}") }}
//
// MercuryDPM 1.0: viscopade::addSpecies(speciesHandler) adds the species below, in this order.
// Numbers are in {{ setup.units.length }}, {{ setup.units.mass }}, {{ setup.units.time }}.
//
// Law: HertzianBSHPViscoelasticSpecies, F = max(0, k d + 3/2 A k v_n) with k = 4/3 E_eff sqrt(R_eff d). It is the
// viscoelastic law, for all sizes; contact ends when the force vanishes.
//
{% for contact, lines, p in contacts %}
{{ lines | lines("// {}") }}
//   Error of eps: none, but for the time step.
//   Older versions have only HertzianViscoelasticSpecies, one eps for all speeds, with attraction before the overlap
//   ends: setDissipation({{ number(p.constant_dissipation) }}) gives eps = {{
number(p.constant.epsilon) }}, exact at the typical speed.
{{ p.constant.errors.lines | lines("//     {}") }}
{% endfor %}
//
// Time step: setTimeStep({{ timestep }}) is {{ steps }} steps in the shortest contact. With it eps is off by up to {{
step_error }}
// (computed with the program's scheme). The error of eps falls in proportion to the step.

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
{% for name, body, modulus, dissipation in species %}
{% if not body.is_wall %}
    one.setDensity({{ number(body.density) }});
{% endif %}
    one.setEffectiveElasticModulus({{ number(modulus) }});
    one.setDissipation({{ number(dissipation) }});
    species.{{ name }} = handler.copyAndAddObject(one);
{% endfor %}
{% for first, second, p in mixed %}
    auto* mixed{{ loop.index }} = handler.getMixedObject(species.{{ first }}, species.{{ second }});
    mixed{{ loop.index }}->setEffectiveElasticModulus({{ number(p.elastic_modulus) }});
    mixed{{ loop.index }}->setDissipation({{ number(p.dissipation) }});
{% endfor %}
    return species;
}

} // namespace viscopade

#endif
"""

_ACCEPTED, _E = ("1e-6", "1"), "restitution coefficient"
_FOLDER = "Kernel/Species/NormalForceSpecies"
_LINEAR = f"{_FOLDER}/LinearViscoelasticNormalSpecies.cc"


_SPECIES = "LinearViscoelastic", "HertzianViscoelastic", "HertzianBSHPViscoelastic"


def _constants(values: native.Values, impact: native.Impact) -> tuple[Law, float, float]:
    """Return the law of a species, k and c.

    Raises
    ------
    ValueError
        If both dissipation and restitutionCoefficient are given.
    """
    linear, hertz, _ = _SPECIES
    given = "dissipation" in values
    if given and "restitutionCoefficient" in values:
        raise ValueError("dissipation and restitutionCoefficient: expected one of them")
    if values["species"] == linear:
        if given:
            return LINEAR_RETURN, values["stiffness"], values["dissipation"]
        e, half = values["restitutionCoefficient"], values["particleMass"] / 2
        by_time = "stiffness" not in values
        k = half * (math.pi**2 + math.log(e) ** 2) / values["collisionTime"] ** 2 if by_time else values["stiffness"]
        return LINEAR_RETURN, k, float(linear_kappa(mp.mpf(e))) * math.sqrt(half * k)
    k = 4 / 3 * values["effectiveElasticModulus"] * math.sqrt(impact.effective_radius)
    if values["species"] == hertz:
        kappa = values["dissipation"] if given else float(tsuji_kappa(mp.mpf(values["restitutionCoefficient"])))
        return TSUJI_RETURN, k, kappa * math.sqrt(impact.effective_mass * k)
    return VISCOELASTIC, k, 1.5 * values["dissipation"] * k


def _damped(values: native.Values, damping: float, impact: native.Impact) -> dict[str, float]:
    """Return another dissipation, or restitutionCoefficient."""
    if "restitutionCoefficient" in values:
        return {"restitutionCoefficient": max(math.exp(-damping), float(_ACCEPTED[0]))}
    one = native.Values({**values, "dissipation": 1.0})
    return {"dissipation": native.number_for(damping, *_constants(one, impact), impact)}


_NATIVE = native.Native(
    (
        native.Parameter("species", words=_SPECIES),
        native.positive("stiffness", "N/m"),
        native.Parameter(
            "dissipation",
            accepted=f"a number >= 0: in N s/m if {_SPECIES[0]}, without unit if {_SPECIES[1]}, in s if {_SPECIES[2]}",
        ),
        native.positive("effectiveElasticModulus", "Pa"),
        native.positive("collisionTime", "s"),
        native.restitution("restitutionCoefficient"),
        native.positive("particleMass", "kg"),
    ),
    lambda values, impact: native.law_contact(*_constants(values, impact), impact),
    _LINEAR,
    schemes={"velocity Verlet": SEMI_IMPLICIT},
    damped=_damped,
)

SIMULATOR = Simulator(
    "mercurydpm",
    "MercuryDPM",
    "kuwt/MercuryDPM_fork, commits 0841c35, 126c08f and 23b48a9",
    (
        DampingFormula(
            "LinearViscoelastic, setCollisionTimeAndRestitutionCoefficient",
            LINEAR_RETURN,
            _E,
            linear_kappa,
            _ACCEPTED,
            "exact",
            _LINEAR,
        ),
        DampingFormula(
            "LinearViscoelastic, setCollisionTimeAndRestitutionCoefficient, at a wall",
            LINEAR_RETURN,
            _E,
            lambda e: linear_kappa(e) / mp.sqrt(2),
            _ACCEPTED,
            "normalisation",
            _LINEAR,
            note="The effective mass is taken to be that of two particles of one mass; at a wall it is twice as large.",
        ),
        DampingFormula(
            "HertzianViscoelastic, setElasticModulusAndRestitutionCoefficient",
            TSUJI_RETURN,
            _E,
            tsuji_kappa,
            _ACCEPTED,
            "exact",
            f"{_FOLDER}/HertzianViscoelasticNormalSpecies.cc",
        ),
        DampingFormula(
            "HertzianBSHPViscoelastic",
            VISCOELASTIC,
            "3/2 dissipation (k/m_eff)^(2/5) v^(1/5)",
            mp.mpf,
            ("0", "1e6"),
            "exact",
            f"{_FOLDER}/HertzianBSHPViscoelasticNormalSpecies.cc",
            written=viscoelastic_kappa,
            note="`k` is `4/3 E_eff sqrt(R_eff)`. The dissipation is as `viscopade simulators mercurydpm` writes it.",
        ),
    ),
    texts={"mercurydpm": render},
    lines={
        "pair": "HertzianBSHPViscoelasticSpecies species;\n"
        "species.setDensity({density});\n"
        "species.setEffectiveElasticModulus({E_eff});\n"
        "species.setDissipation({A});"
    },
    native=_NATIVE,
)
