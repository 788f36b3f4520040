"""Choice of the cheapest kernel within a scene's tolerance, with the reasons against cheaper ones."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from fractions import Fraction

from viscopade.arithmetic.decimals import at_most
from viscopade.progress import track
from viscopade.scene import sense
from viscopade.scene.candidate import BestApproximant, Candidate, candidates, cheaper_polynomial, uncovered
from viscopade.scene.description import Scene
from viscopade.scene.encounter import Encounter, encounters

AS_CHEAP = 1.05  # costs that differ by less are equal: the smaller table decides, then the error
WORDS = {"epsilon": "relative error of eps", "dissipation": "relative error of 1 - eps^2", "absolute": "error of eps"}
_CHEAPEST = "no kernel is cheaper"


@dataclass(frozen=True)
class Offer:
    """An offer: a candidate, and the names of the tolerances that it exceeds."""

    candidate: Candidate
    failing: tuple[str, ...]

    @property
    def cost(self) -> int:
        """The weighted number of operations."""
        return self.candidate.operations.count

    @property
    def suffices(self) -> bool:
        """Whether the candidate keeps the tolerance."""
        return not self.failing

    @property
    def rank(self) -> tuple[float, int, Fraction]:
        """The key for comparison: cost, size of the table, error."""
        return self.cost, self.candidate.bytes, self.candidate.errors.epsilon


@dataclass(frozen=True)
class Choice:
    """The choice for a scene: the kernel and the offers against it.

    Attributes
    ----------
    scene : Scene
    encounters : sequence of Encounter
    offers : sequence of Offer
        All candidates, the cheapest first.
    chosen : Offer
    reason : str
        Why the next cheaper one does not suffice.
    warnings : sequence of str
        Where the scene leaves what the model assumes.
    notes : sequence of str
        Sentences on the uncertainty of eps, without their full stops.
    """

    scene: Scene
    encounters: Sequence[Encounter]
    offers: Sequence[Offer]
    chosen: Offer
    reason: str
    warnings: Sequence[str]
    notes: Sequence[str] = ()

    @property
    def against_cheaper(self) -> str:
        """The sentence on the next cheaper kernels."""
        return "No kernel is cheaper." if self.reason == _CHEAPEST else f"Cheaper, but rejected: {self.reason}."


def choose(scene: Scene) -> Choice:
    """Return the choice of the cheapest kernel within the tolerance.

    Raises
    ------
    ValueError
        If there is none: one line that says what the best one reaches.
    """
    met = encounters(scene)
    for i in track(range(len(met)), "pairs"):
        met[i].epsilon  # noqa: B018  computed once, and kept
    found = list(candidates(scene, met))
    offers = []
    for i in track(range(len(found)), "errors on the scene"):
        offers.append(Offer(found[i], tuple(found[i].errors.failing(scene.tolerance))))
    offers.sort(key=lambda offer: offer.rank)
    enough = [offer for offer in offers if offer.suffices]
    if not enough:
        raise _nothing(scene, met, offers)
    as_cheap = [offer for offer in enough if offer.cost <= AS_CHEAP * enough[0].cost]
    chosen = min(as_cheap, key=lambda offer: (offer.candidate.bytes, offer.rank))
    warnings = [text for encounter in met for text in sense.warnings(scene, encounter)]
    notes = [text for encounter in met for text in sense.notes(scene, encounter)]
    for weight in filter(None, map(sense.weight, met)):
        notes.append(weight.note)
        warnings += [] if weight.fall is None else [weight.fall]
    return Choice(scene, met, offers, chosen, _reason(scene, offers, chosen), warnings, notes)


def _excess(scene: Scene, offer: Offer) -> tuple[Fraction, str]:
    """Return the largest ratio of an error to its tolerance, and which tolerance that is."""
    given, errors = scene.tolerance.given(), offer.candidate.errors
    return max((getattr(errors, name) / Fraction(repr(limit)), name) for name, limit in given.items())


def _nothing(scene: Scene, met: Sequence[Encounter], offers: Sequence[Offer]) -> ValueError:
    """Return the refusal of a tolerance that no kernel keeps."""
    reason = uncovered(scene, met)
    if reason is not None:
        return ValueError(f"{scene.source}: a constant does not suffice, and {reason}")
    best = min(offers, key=lambda offer: _excess(scene, offer))
    given, name = scene.tolerance.given(), _excess(scene, best)[1]
    reached = at_most(getattr(best.candidate.errors, name))
    code = scene.code
    return ValueError(
        f"{scene.source}: tolerance.{name} is {given[name]:g}: accepted is {reached} "
        f"or more, which the best kernel in {code.language} ({code.format}"
        + (f", tables of at most {code.largest_table} bytes" if code.largest_table is not None else "")
        + ") reaches on this scene"
    )


def _reason(scene: Scene, offers: Sequence[Offer], chosen: Offer) -> str:
    """Return why the next cheaper kernel fails: of those that cost less, the one that misses the tolerance by least."""
    texts = []
    if isinstance(chosen.candidate, BestApproximant):
        cheaper = cheaper_polynomial(chosen.candidate)
        if cheaper is not None:
            label, error, unit = cheaper
            texts.append(f"the best of the kind with fewer operations, {label}, is off by {error:.3g} {unit} (sampled)")
    # At the same cost, a smaller table would be preferred.
    less = [offer for offer in offers if offer.rank[:2] < chosen.rank[:2]]
    failing = [offer for offer in less if not offer.suffices]
    if failing:
        texts.append(_failure(scene, min(failing, key=lambda offer: _excess(scene, offer))))
    larger = [offer for offer in less if offer.suffices]
    if larger:
        names = " and ".join(offer.candidate.label for offer in larger)
        texts.append(f"{names}: hardly cheaper, with more than {chosen.candidate.bytes:,} bytes of a table")
    return "; ".join(texts) or _CHEAPEST


def _failure(scene: Scene, offer: Offer) -> str:
    candidate, name = offer.candidate, _excess(scene, offer)[1]
    limit = scene.tolerance.given()[name]
    off, v_star, pair = candidate.sampled(name)
    if off > limit:
        return f"{candidate.label}: {WORDS[name]} {off:.3g} at v* = {v_star:.4g} ({pair}), more than {limit:g}"
    bound = at_most(getattr(candidate.errors, name))
    return f"{candidate.label}: {WORDS[name]} is proven to be at most {bound}, which is more than {limit:g}"
