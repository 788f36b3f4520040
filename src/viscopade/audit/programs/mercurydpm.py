"""MercuryDPM: species with a coefficient of restitution.

Read in Kernel of kuwt/MercuryDPM_fork at commits 0841c35, 126c08f and 23b48a9:

- `LinearViscoelasticNormalSpecies::setCollisionTimeAndRestitutionCoefficient`, `setStiffnessAndRestitutionCoefficient`:
  stiffness and dissipation of a linear contact of two particles of the given mass that ends at x = 0, exactly.
- `LinearViscoelasticInteraction::computeNormalForce`: F = k x + dissipation v, not cut off. At a wall the same k and
  dissipation meet twice the m_eff.
- `HertzianViscoelasticNormalSpecies::setElasticModulusAndRestitutionCoefficient`: Tsuji's damping with the damping
  ratio for contact that ends at x = 0; the force is not cut off, and m_eff is the contact's own.
- `HertzianBSHPViscoelasticNormalSpecies` is the viscoelastic law (`viscopade.simulators.mercurydpm`), and its
  `setEffectiveElasticModulusAndRestitutionCoefficient` stops with an error.

`DPMBase::integrateBeforeForceComputation` is half of a velocity Verlet step: the damping takes the velocity half a step
before.
"""

from __future__ import annotations

from mpmath import mp

from viscopade.audit.program import DampingFormula, Program
from viscopade.audit.spring_dashpot import LINEAR_RETURN, TSUJI_RETURN, linear_kappa, tsuji_kappa, viscoelastic_kappa
from viscopade.theory.law import VISCOELASTIC

_ACCEPTED, _E = ("1e-6", "1"), "restitution coefficient"
_FOLDER = "Kernel/Species/NormalForceSpecies"
_LINEAR = f"{_FOLDER}/LinearViscoelasticNormalSpecies.cc"

PROGRAM = Program(
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
            "kappa",
            mp.mpf,
            ("0", "1e6"),
            "exact",
            f"{_FOLDER}/HertzianBSHPViscoelasticNormalSpecies.cc",
            written=viscoelastic_kappa,
            note="The dissipation is as `viscopade simulators mercurydpm` writes it.",
        ),
    ),
)
