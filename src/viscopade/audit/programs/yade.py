"""YADE: the functors of MindlinPhys and ViscElPhys.

Read in pkg/dem of YADE 2025.2.0 (c61292558/yade4deepin at commit f1486c0) and of an older trunk (Togekey/yade_trunk at
commit a6084d6):

- `Ip2_FrictMat_FrictMat_MindlinPhys::go` of HertzMindlin.cpp: from `en` (or `es`) the program takes betan, by (B6) and
  (B7) of Thornton, Cummins and Cleary (2013), a fit of degree 10. In the older trunk `en` goes through Tsuji's damping
  ratio for contact that ends at x = 0.
- `Law2_ScGeom_MindlinPhys_Mindlin::go`: c = 2 betan sqrt(m_eff kn), kn = 3/2 k sqrt(x): Tsuji's damping with
  kappa = sqrt(6) betan. A force that would pull is 0, in all versions.
- `en` with `vn`: beta = v*^2 vn^(-1/5), v* from the paper's printed [3/6]: the viscoelastic law.
- Ip2_ViscElMat_ViscElMat_ViscElPhys of ViscoelasticPM.cpp: k and c from `tc`, `en`, `et` are those of a linear
  contact that ends at x = 0 (Pournin et al. 2001), but a force that would pull is 0. From `en` and Young's modulus
  find_cn_from_en solves the formula for the end that the contact has (Schwager and Poeschel 2007), to 1 %.
- For both, a body of mass 0 counts as one of the other's mass: half of m_eff at a wall or a facet.

`NewtonIntegrator` is a leapfrog: the damping takes the velocity half a step before.
"""

from __future__ import annotations

from typing import Any

import numpy as np
from mpmath import mp

from viscopade.audit.program import DampingFormula, Program
from viscopade.audit.spring_dashpot import LINEAR, TSUJI, linear_kappa, ratio_at_force_end, tsuji_kappa
from viscopade.theory.law import VISCOELASTIC
from viscopade.theory.paper import TABLE

_MINDLIN, _LINEAR = "pkg/dem/HertzMindlin.cpp", "pkg/dem/ViscoelasticPM.cpp"
_EN, _NEARLY_ALL = "en", ("0.01", "1")
_THORNTON = (
    *("-1489.915", "6276.757", "-11342.18", "11494.29", "-7206.864", "2928.711"),
    *("-796.4559", "146.8049", "-16.41105", "-6.918798", "0"),
)


def thornton_betan(en: Any) -> Any:
    """Return betan by the fit of Thornton, Cummins and Cleary (2013), an mpmath number."""
    if en == 1:
        return mp.mpf(0)
    exponent = mp.polyval([mp.mpf(c) for c in _THORNTON], en)
    return mp.sqrt(1 / (1 - (1 + en) ** 2 * mp.exp(exponent)) - 1)


def _of_printed_pade(en: Any) -> Any:
    """Return the kappa = v*^2 at which the printed [3/6], which falls, is en, to 13 digits."""
    a, b = ([float(c) for c in row] for row in TABLE[3, 6])
    wanted = np.polynomial.Polynomial(a) - float(en) * np.polynomial.Polynomial(b)
    roots = (complex(root) for root in wanted.roots().tolist())
    return mp.mpf(min((root.real for root in roots if root.real > 1e9 * abs(root.imag)), default=0)) ** 2


PROGRAM = Program(
    "yade",
    "YADE",
    "2025.2.0, commit f1486c0 of c61292558/yade4deepin",
    (
        DampingFormula(
            "MindlinPhys, en",
            TSUJI,
            _EN,
            lambda en: mp.sqrt(6) * thornton_betan(en),
            _NEARLY_ALL,
            "approximate formula",
            _MINDLIN,
        ),
        DampingFormula(
            "MindlinPhys, en (trunk before the fit)",
            TSUJI,
            _EN,
            tsuji_kappa,
            _NEARLY_ALL,
            "other end",
            f"{_MINDLIN} at commit a6084d6 of Togekey/yade_trunk",
        ),
        DampingFormula(
            "MindlinPhys, betan",
            TSUJI,
            "betan",
            lambda betan: mp.sqrt(6) * betan,
            ("0", "100"),
            "exact",
            _MINDLIN,
            written=lambda e: mp.sqrt(mp.mpf(5) / 6) * ratio_at_force_end(e),
            note="betan is as `viscopade simulators yade` writes it.",
        ),
        DampingFormula(
            "MindlinPhys, en and vn",
            VISCOELASTIC,
            _EN,
            _of_printed_pade,
            _NEARLY_ALL,
            "approximate formula",
            _MINDLIN,
            note="The printed [3/6] of the paper stands for the exact function; this is at the speed vn.",
        ),
        DampingFormula("ViscElPhys, tc, en, et", LINEAR, _EN, linear_kappa, _NEARLY_ALL, "other end", _LINEAR),
        DampingFormula(
            "ViscElPhys, tc, en, et, at a wall",
            LINEAR,
            _EN,
            lambda e: linear_kappa(e) / mp.sqrt(2),
            _NEARLY_ALL,
            "normalisation",
            _LINEAR,
            note="Stiffness and damping are made with half of the mass that the sphere has.",
        ),
        DampingFormula(
            "ViscElPhys, young, en, et",
            LINEAR,
            _EN,
            lambda e: 2 * ratio_at_force_end(e),
            _NEARLY_ALL,
            "exact",
            _LINEAR,
            note="The program solves the formula to 1 % of en only.",
        ),
    ),
)
