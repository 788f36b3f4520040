"""Claims and their evidence: a verdict derived from numbers that running code computes."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass
from fractions import Fraction
from typing import Any, Literal

from viscopade.arithmetic.decimals import at_most

Verdict = Literal["holds", "holds with a limit", "does not hold"]
Kind = Literal["proven", "sampled"]


@dataclass(frozen=True)
class Evidence:
    """Evidence for or against a claim.

    Attributes
    ----------
    verdict : str
        "holds", "holds with a limit" or "does not hold".
    summary : str
        One or two sentences with the numbers that decide.
    numbers : mapping
        All numbers, ready for JSON.
    kind : str
        "proven" if the verdict rests on enclosures or exact arithmetic, "sampled" if on values at many points or on
        arithmetic whose error is estimated.
    """

    verdict: Verdict
    summary: str
    numbers: Mapping[str, Any]
    kind: Kind


@dataclass(frozen=True)
class Claim:
    """A statement of the paper that can be checked.

    Attributes
    ----------
    name : str
        Unique, such as "table-entries".
    place : str
        Number of the equation, table or figure, or the text around it.
    statement : str
        The statement, in our words.
    check : callable
        Computes the evidence.
    """

    name: str
    place: str
    statement: str
    check: Callable[[], Evidence]


def claim(name: str, place: str, statement: str) -> Callable[[Callable[[], Evidence]], Claim]:
    """Return a decorator that makes a claim of the function that checks it."""
    return lambda check: Claim(name, place, statement, check)


@dataclass(frozen=True)
class CheckedClaim:
    """A claim with its evidence."""

    claim: Claim
    evidence: Evidence

    def to_json(self) -> dict[str, Any]:
        """Return the claim and its evidence as one dictionary of text and numbers: a row of `viscopade claims`."""
        claim, evidence = self.claim, self.evidence
        return {
            "name": claim.name,
            "place": claim.place,
            "statement": claim.statement,
            "verdict": evidence.verdict,
            "summary": evidence.summary,
            "kind": evidence.kind,
            "numbers": dict(evidence.numbers),
        }


def verdict(holds: bool, within_limits: bool = False) -> Verdict:
    """Return the verdict that the numbers support: the statement `holds`, or only `within_limits`, or neither."""
    if holds:
        return "holds"
    return "holds with a limit" if within_limits else "does not hold"


def percent(fraction: float) -> str:
    """Return a fraction as text in per cent, to two digits: 0.0123 is "1.2 %"."""
    value = 100 * fraction
    # Two digits as "1.2"; from 99.5 on ".2g" would write 1e+02, so whole per cents are shown; from 10,000 on 1e+04.
    return f"{value:.0f} %" if 99.5 <= abs(value) < 1e4 else f"{value:.2g} %"


def percent_at_most(fraction: float) -> str:
    """Return an upper bound as text in per cent, rounded up to two digits: 0.0122 is "1.3 %"."""
    # A fraction, so that 100 times it is exact before `at_most` rounds it up to 2 digits.
    return f"{at_most(100 * Fraction(fraction), 2)} %"
