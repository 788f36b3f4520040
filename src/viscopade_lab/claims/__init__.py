"""Every statement of the paper that can be checked, with our evidence and verdict.

The other modules have the claims by subject. The check of a claim computes its numbers and derives the verdict from
them. Statements that cannot be checked are listed with the reason (`UNCHECKED`).
"""

from __future__ import annotations

from collections.abc import Iterable
from typing import NamedTuple

from viscopade.arguments import suggestion
from viscopade.progress import quietly, track
from viscopade_lab.claims import asymptotics, pade, physics, series
from viscopade_lab.claims.evidence import CheckedClaim, Claim, Evidence

__all__ = ["CLAIMS", "UNCHECKED", "CheckedClaim", "Claim", "Evidence", "Unchecked", "check", "claims"]


class Unchecked(NamedTuple):
    """A statement of the paper that we cannot check."""

    place: str
    statement: str
    reason: str


CLAIMS: tuple[Claim, ...] = (*physics.CLAIMS, *series.CLAIMS, *asymptotics.CLAIMS, *pade.CLAIMS)

UNCHECKED = (
    Unchecked(
        "Fig. 4",
        "the measured values for ice deviate slightly from the theory",
        "the measurements are not public, only a power law fitted to them is",
    ),
    Unchecked(
        "text after Fig. 1",
        "beta = 1.307 (s/cm)^(1/5) belongs to the ice of those measurements",
        "it was fitted to the same measurements; no A of ice is given",
    ),
    Unchecked(
        "text after Eq. 10; text after Eq. 8",
        "the exponent and the h_k agree with an earlier paper",
        "the earlier paper is not at hand; the exponent itself is the claim asymptotic-law",
    ),
    Unchecked(
        "text after Eq. 3",
        "who derived the dissipative force first, and who rigorously",
        "a matter of literature, not of numbers",
    ),
)


def claims() -> tuple[CheckedClaim, ...]:
    """Check every claim, in the order of `CLAIMS`; it takes about 20 s."""
    return check()


def check(names: Iterable[str] | None = None) -> tuple[CheckedClaim, ...]:
    """Return the claims of these names with their evidence, in the order of the names; None means all.

    Raises
    ------
    ValueError
        If there is no claim of a name.
    """
    by_name = {claim.name: claim for claim in CLAIMS}
    chosen = list(by_name) if names is None else list(names)
    for name in chosen:
        if name not in by_name:
            # `suggestion` returns ": did you mean …?" for a name that resembles one of the claims, else "".
            expected = f": expected a name such as {CLAIMS[0].name}; `viscopade claims` prints all"
            raise ValueError(f"there is no claim {name!r}{suggestion(name, by_name) or expected}")

    checked = []
    for i in track(range(len(chosen)), "claims"):  # a progress bar over all claims
        with quietly():  # without the bars of a check's own loops, which would overwrite it
            checked.append(CheckedClaim(by_name[chosen[i]], by_name[chosen[i]].check()))
    return tuple(checked)
