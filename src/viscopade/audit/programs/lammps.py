"""LAMMPS: `pair_style granular` and `fix wall/gran granular`.

Read in src/GRANULAR of lammps/lammps at commit 07b704c, with the overlap d and the elastic force F:

- `GranSubModDampingCoeffRestitution::init`: c = damp sqrt(m_eff F/d), with damp = 2 zeta for `hooke` and
  sqrt(5) zeta for `hertz`, zeta the damping ratio for contact that ends at x = 0. Both are exact.
- `GranSubModDampingTsuji::init`: the same c, damp a polynomial in e of degree 6, which Marshall (2009) fitted to
  the figure of Tsuji, Tanaka and Ishida (1992). Since 2026 it is multiplied by sqrt(2), as Tsuji's mass is not m_eff.
- `GranSubModDampingMassVelocity`: c = eta_n0 m_eff. People take eta_n0 from Silbert et al. (2001), which is the linear
  spring-dashpot contact that ends at x = 0.
- `GranSubModDampingViscoelastic`: c = eta_n0 m_eff a, a the contact radius: the viscoelastic law.
- `GranularModel::calculate_forces`: with `limit_damping` a force that would pull is 0; without, contact ends at x = 0.

`Verlet::run` computes forces after half of the kick: the damping takes the velocity half a step before.
"""

from __future__ import annotations

from typing import Any

from mpmath import mp

from viscopade.audit.program import DampingFormula, Program
from viscopade.audit.spring_dashpot import (
    LINEAR,
    LINEAR_RETURN,
    TSUJI,
    TSUJI_RETURN,
    linear_kappa,
    tsuji_kappa,
    viscoelastic_kappa,
)
from viscopade.theory.law import VISCOELASTIC, law_of

_SOURCE = "src/GRANULAR/gran_sub_mod_damping.cpp"
_EPSILON, _E = ("1e-6", "1"), "coefficient of restitution"
_POLYNOMIAL = ("4.8218", "-18.022", "27.467", "-22.348", "11.087", "-4.2783", "1.2728")


def marshall(e: Any) -> Any:
    """Return Marshall's fit of Tsuji's alpha(e)."""
    return mp.polyval([mp.mpf(c) for c in _POLYNOMIAL], e)


PROGRAM = Program(
    "lammps",
    "LAMMPS",
    "commit 07b704c",
    (
        DampingFormula("hertz, coeff_restitution", TSUJI_RETURN, _E, tsuji_kappa, _EPSILON, "exact", _SOURCE),
        DampingFormula(
            "hertz, coeff_restitution, limit_damping", TSUJI, _E, tsuji_kappa, _EPSILON, "other end", _SOURCE
        ),
        DampingFormula("hooke, coeff_restitution", LINEAR_RETURN, _E, linear_kappa, _EPSILON, "exact", _SOURCE),
        DampingFormula(
            "hooke, coeff_restitution, limit_damping", LINEAR, _E, linear_kappa, _EPSILON, "other end", _SOURCE
        ),
        DampingFormula(
            "hertz, tsuji (22 Jul 2025)",
            TSUJI_RETURN,
            _E,
            marshall,
            ("0", "1"),
            "normalisation",
            _SOURCE,
            note="The damping lacks the factor √2 between the mass of Tsuji et al. and the effective mass.",
        ),
        DampingFormula(
            "hertz, tsuji",
            TSUJI_RETURN,
            _E,
            lambda e: mp.sqrt(2) * marshall(e),
            ("0", "1"),
            "approximate formula",
            _SOURCE,
        ),
        DampingFormula(
            "hertz, tsuji, limit_damping",
            TSUJI,
            _E,
            lambda e: mp.sqrt(2) * marshall(e),
            ("0", "1"),
            "other end",
            _SOURCE,
        ),
        DampingFormula(
            "hooke, mass_velocity",
            LINEAR_RETURN,
            "eta_n0 sqrt(m_eff/k)",
            mp.mpf,
            ("0", "100"),
            "exact",
            _SOURCE,
            written=linear_kappa,
        ),
        DampingFormula(
            "hooke, mass_velocity, limit_damping",
            LINEAR,
            "eta_n0 sqrt(m_eff/k)",
            mp.mpf,
            ("0", "100"),
            "other end",
            _SOURCE,
            written=linear_kappa,
        ),
        DampingFormula(
            "hertz, viscoelastic, limit_damping",
            VISCOELASTIC,
            "kappa",
            mp.mpf,
            ("0", "1e6"),
            "exact",
            _SOURCE,
            written=viscoelastic_kappa,
            note="`eta_n0` is as `viscopade simulators lammps` writes it.",
        ),
        DampingFormula(
            "hertz, viscoelastic",
            law_of("viscoelastic", "return"),
            "kappa",
            mp.mpf,
            ("0", "1e6"),
            "other end",
            _SOURCE,
            written=viscoelastic_kappa,
            note="`eta_n0` is as `viscopade simulators lammps` writes it, without its `limit_damping`.",
        ),
    ),
)
