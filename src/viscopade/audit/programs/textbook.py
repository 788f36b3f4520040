"""Formulas of textbooks and papers, for contacts that you program yourself: linear, Tsuji's, and Hunt-Crossley's.

Their time steps are those of semi-implicit Euler's method.
"""

from __future__ import annotations

from mpmath import mp

from viscopade.audit.program import DampingFormula, Program, Reason, same
from viscopade.audit.spring_dashpot import (
    LINEAR,
    LINEAR_RETURN,
    TSUJI,
    TSUJI_RETURN,
    ratio_at_force_end,
    ratio_for_return,
)
from viscopade.audit.textbook import HUNT_CROSSLEY, LAW
from viscopade.theory.law import Law, law_of

_RATIO = ("0", "1e3")
_ANY = ("0", "1e6")


def _with_ratio(name: str, law: Law, other: Law, factor: str, citations: tuple[str, str]) -> tuple[DampingFormula, ...]:
    """Return the two formulas for the damping ratio, each with the two ends of a contact."""

    def kappa(zeta: mp.mpf) -> mp.mpf:
        return mp.sqrt(mp.mpf(factor)) * zeta

    def formula(at: str, contact: Law) -> DampingFormula:
        reason: Reason = "exact" if at == contact.end else "other end"
        written = ratio_for_return if at == "return" else ratio_at_force_end
        place = {"return": "x = 0", "force": "force 0"}
        words = f"{name}, zeta for the end at {place[at]}; contact ends at {place[contact.end]}"
        source = citations[at == "force"]
        return DampingFormula(words, contact, "damping ratio", kappa, _RATIO, reason, source, written=written)

    return tuple(formula(at, contact) for at in ("return", "force") for contact in (other, law))


PROGRAM = Program(
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
                same,
                _ANY,
                "approximate formula",
                formula.citation,
                written=formula.z,
            )
            for formula in HUNT_CROSSLEY
        ),
    ),
)
