"""Formulas of textbooks and papers, for contacts that you program yourself: linear, Tsuji's, and Hunt-Crossley's.

    force = k*x**1.5*(1 + 3/2*(1 - e)/v*xdot)                            in your own code: Hunt and Crossley
    zeta = -log(e)/sqrt(pi**2 + log(e)**2);  c = 2*zeta*sqrt(k*m)        linear spring and dashpot

A contact with the force k x^n + lambda x^n x' is nu = 1 of section 2.9, for every n: its eps depends on z = lambda v/k
alone, v being the impact speed. A damping formula gives lambda for a wanted eps = e, in the literature as
lambda = chi(e) k/v, so its z is chi(e). Almost all are approximations of the same exact relation,

    ln((1 + z)/(1 - z eps)) = z (1 + eps),

and therefore give a different eps from the one asked for. For small losses the exact z is 3 (1 - eps)/2.

docs/results/laws.md names formulas that are left out, and says why.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from typing import Any

from mpmath import mp

from viscopade.collision import exact
from viscopade.simulators.formula import (
    LINEAR,
    LINEAR_RETURN,
    TSUJI,
    TSUJI_RETURN,
    DampingFormula,
    Reason,
    identity,
    ratio_at_force_end,
    ratio_for_return,
)
from viscopade.simulators.simulator import Simulator
from viscopade.theory.law import Law, law_of

DIGITS = 20  # of proven eps and z: more than a double has
LAW = "hunt-crossley:1"  # n = 1, the quickest; the z of every n is the same


@dataclass(frozen=True)
class HuntCrossleyFormula:
    """A damping formula from the literature.

    Attributes
    ----------
    name : str
        Its authors, short.
    citation : str
        Authors, journal, volume, pages and year.
    text : str
        The formula for z, in LaTeX.
    z : callable
        From e to z = lambda v/k, both mpmath numbers.
    source : str
        Where its form was read.
    """

    name: str
    citation: str
    text: str
    z: Callable[[Any], Any]
    source: str


# The originals were not at hand: each form is that of a program, of public code that follows the review by Machado,
# Moreira, Flores and Lankarani (Mech. Mach. Theory 53, 99-121, 2012), or of a review as we remember it.
CODE, REVIEW = "public code after a review", "a review, from memory"

HUNT_CROSSLEY = (
    HuntCrossleyFormula(
        "Hunt and Crossley",
        "K. H. Hunt and F. R. E. Crossley, J. Appl. Mech. 42, 440-445 (1975)",
        r"\tfrac{3}{2} (1 - e)",
        lambda e: 3 * (1 - e) / 2,
        "manual of Simbody, code of MBDyn",
    ),
    HuntCrossleyFormula(
        "Herbert and McWhannell",
        "R. G. Herbert and D. C. McWhannell, J. Eng. Ind. 99, 513-518 (1977)",
        r"6 (1 - e) / ((2 e - 1)^2 + 3)",
        lambda e: 6 * (1 - e) / ((2 * e - 1) ** 2 + 3),
        CODE,
    ),
    HuntCrossleyFormula(
        "Lee and Wang",
        "T. W. Lee and A. C. Wang, J. Mech. Transm. Autom. Des. 105, 534-540 (1983)",
        r"\tfrac{3}{4} (1 - e)",
        lambda e: 3 * (1 - e) / 4,
        CODE,
    ),
    HuntCrossleyFormula(
        "Lankarani and Nikravesh",
        "H. M. Lankarani and P. E. Nikravesh, J. Mech. Des. 112, 369-376 (1990)",
        r"\tfrac{3}{4} (1 - e^2)",
        lambda e: 3 * (1 - e**2) / 4,
        "code of MBDyn",
    ),
    HuntCrossleyFormula(
        "Gonthier et al.",
        "Y. Gonthier, J. McPhee, C. Lange and J.-C. Piedboeuf, Multibody Syst. Dyn. 11, 209-233 (2004)",
        r"(1 - e^2) / e",
        lambda e: (1 - e**2) / e,
        CODE,
    ),
    HuntCrossleyFormula(
        "Qin and Lu",  # also cited by their given names, as Zhiying and Qishao
        "Qin Zhiying and Lu Qishao, J. Dyn. Control 4, 294-298 (2006)",
        r"\tfrac{3}{4} (1 - e^2) \exp(2 (1 - e))",
        lambda e: 3 * (1 - e**2) * mp.exp(2 * (1 - e)) / 4,
        CODE,
    ),
    HuntCrossleyFormula(
        "Ye et al.; Flores et al.",
        "K. Ye, L. Li and H. Zhu, Earthq. Eng. Struct. Dyn. 38, 1135-1142 (2009); "
        "P. Flores, M. Machado, M. T. Silva and J. M. Martins, Multibody Syst. Dyn. 25, 357-375 (2011)",
        r"\tfrac{8}{5} (1 - e) / e",
        lambda e: 8 * (1 - e) / (5 * e),
        "manual of OpenSees, code of MBDyn",
    ),
    HuntCrossleyFormula(
        "Gharib and Hurmuzlu",
        "M. Gharib and Y. Hurmuzlu, J. Appl. Mech. 79, 064506 (2012)",
        r"1 / e",
        lambda e: 1 / e,
        REVIEW,
    ),
    HuntCrossleyFormula(
        "Hu and Guo",
        "S. Hu and X. Guo, Multibody Syst. Dyn. 35, 131-151 (2015)",
        r"\tfrac{3}{2} (1 - e) / e",
        lambda e: 3 * (1 - e) / (2 * e),
        "a review, from memory; public code after a review has half of it, which is wrong by a factor of 2 for small "
        "losses",
    ),
    HuntCrossleyFormula(
        "Safaeifar and Farshidianfar",
        "H. Safaeifar and A. Farshidianfar, Multibody Syst. Dyn. 50, 233-257 (2020)",
        r"\tfrac{5}{4} (1 - e) / e",
        lambda e: 5 * (1 - e) / (4 * e),
        REVIEW,
    ),
)


def delivered_epsilon(formula: HuntCrossleyFormula, e: str, digits: int = DIGITS) -> Any:
    """Return the proven eps of a Hunt-Crossley contact, to `digits` digits, if a formula is asked for e, a decimal."""
    # kappa of the law k x + lambda x x' is z = lambda v/k. Ten more digits are for the rounding of the formula.
    with mp.workdps(digits + 10):
        z = formula.z(mp.mpf(e))
    return exact.collision(kappa=z, law=LAW, digits=digits).mpf()["epsilon"]


def exact_z(e: str) -> Any:
    """Return the z = lambda v/k that gives eps = e, a decimal, to `DIGITS` digits."""
    return exact.invert(e, law=LAW, digits=DIGITS).mpf()["kappa"]


# Ranges of the numbers that people write, by hand: with the largest ones eps is about 1e-6.
_RATIO = ("0", "1e3")  # damping ratio
_ANY = ("0", "1e6")  # z


def _with_ratio(name: str, law: Law, other: Law, factor: str, citations: tuple[str, str]) -> tuple[DampingFormula, ...]:
    """Return the two formulas for the damping ratio zeta, each with the two ends of a contact.

    Parameters
    ----------
    name : str
        Of the law.
    law, other : Law
        With the end where the force vanishes ("force"), and with the end at x = 0 ("return").
    factor : str
        Its root is kappa/zeta: sqrt(4) of the linear spring, sqrt(5) of Tsuji's damping.
    citations : tuple of str
        Of the formula for the end at x = 0, and of that for the end at force 0.
    """

    def kappa(zeta: mp.mpf) -> mp.mpf:
        return mp.sqrt(mp.mpf(factor)) * zeta

    def formula(formula_end: str, contact: Law) -> DampingFormula:
        """Return the formula that is made for an end, in a contact that may have the other one."""
        reason: Reason = "exact" if formula_end == contact.end else "other end"
        # zeta = -ln e/sqrt(pi^2 + ln^2 e) for the end at x = 0; for that at force 0 a root is computed.
        written = ratio_for_return if formula_end == "return" else ratio_at_force_end
        place = {"return": "x = 0", "force": "force 0"}
        words = f"{name}, zeta for the end at {place[formula_end]}; contact ends at {place[contact.end]}"
        source = citations[formula_end == "force"]
        return DampingFormula(words, contact, "damping ratio", kappa, _RATIO, reason, source, usual_parameter=written)

    return tuple(formula(end, contact) for end in ("return", "force") for contact in (other, law))


SIMULATOR = Simulator(
    "textbook",
    "Textbook",
    "as published",
    (
        *_with_ratio(
            "linear",
            LINEAR,
            LINEAR_RETURN,
            "4",
            ("any textbook", "T. Schwager and T. Poeschel, Granul. Matter 9, 465-469 (2007)"),
        ),
        *_with_ratio(
            "Tsuji",
            TSUJI,
            TSUJI_RETURN,
            "5",
            ("D. Antypov and J. A. Elliott, EPL 94, 50004 (2011)", "`derivations/12_tsuji.py`"),
        ),
        *(
            DampingFormula(
                f"Hunt-Crossley, {formula.name}",
                law_of(LAW),
                "d v",
                identity,
                _ANY,
                "approximate formula",
                formula.citation,
                usual_parameter=formula.z,
            )
            for formula in HUNT_CROSSLEY
        ),
    ),
)
