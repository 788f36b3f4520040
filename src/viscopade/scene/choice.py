"""Choice of the cheapest kernel that meets a scene's tolerance, with the reasons against cheaper ones.

Names in all functions: a `Scene` has the question, its `encounters` are the pairs of bodies that collide, with their
ranges of v* and eps, and `offers` are the candidates: kernels with their cost and their errors on these ranges.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

from viscopade.arithmetic.decimals import at_most
from viscopade.progress import track
from viscopade.scene import model_limits
from viscopade.scene.candidate import (
    AS_CHEAP,
    Candidate,
    best_quotient,
    candidates,
    fewer_operations,
    too_rough,
    uncovered,
)
from viscopade.scene.description import Scene
from viscopade.scene.encounter import Encounter, scene_encounters
from viscopade.scene.tolerance import MEASURES, excess

LARGE = 8192
"""Bytes of a table above which the answer says how to get a smaller one: a quarter of a level-1 cache of 32 KB.

Chosen by hand: the simulation needs the rest of the cache for its own data.
"""


@dataclass(frozen=True)
class Choice:
    """The chosen kernel for a scene, with the other candidates.

    Attributes
    ----------
    scene : Scene
    encounters : sequence of Encounter
    offers : sequence of Candidate
        All candidates, the cheapest first.
    chosen : Candidate
    reason : str
        Why the next cheaper ones are rejected; "" if there are none.
    warnings : sequence of str
        Sentences on assumptions of the model that the scene violates.
    notes : sequence of str
        Sentences on the uncertainty of eps and on smaller tables, without their full stops.
    """

    scene: Scene
    encounters: Sequence[Encounter]
    offers: Sequence[Candidate]
    chosen: Candidate
    reason: str
    warnings: Sequence[str]
    notes: Sequence[str] = ()

    @property
    def against_cheaper(self) -> str:
        """The sentence on the next cheaper kernels."""
        return f"Cheaper, but rejected: {self.reason}." if self.reason else "No kernel is cheaper."


def choose(scene: Scene) -> Choice:
    """Return the choice of the cheapest kernel that meets the tolerance.

    Raises
    ------
    ValueError
        If there is none; the message has the error of the best kernel. If the scene has no tolerance.
    """
    if not scene.tolerance.limits():
        raise ValueError(
            f"{scene.source}: tolerance is missing: expected a table with epsilon, dissipation or absolute"
        )
    # The encounters of all pairs, with their ranges of eps; then all kernels, by cost, size and error.
    encounters = scene_encounters(scene)
    for i in track(range(len(encounters)), "pairs"):
        encounters[i].epsilon  # noqa: B018  computed here, with a progress bar, and cached
    offers = sorted(candidates(scene, encounters), key=lambda offer: offer.rank)
    within_tolerance = [offer for offer in offers if not offer.failing]
    if not within_tolerance:
        raise _no_kernel(scene, encounters, offers)
    # Of the kernels within the tolerance, those that cost hardly more than the cheapest count as equal. Of these the
    # one with the smallest table wins, then one for all speeds, which is no quotient for the scene, then the cheapest.
    as_cheap = [offer for offer in within_tolerance if offer.cost <= AS_CHEAP * within_tolerance[0].cost]
    chosen = min(as_cheap, key=lambda offer: (offer.kernel.bytes, offer.degrees is not None, offer.rank))
    # What the answer says besides: limits of the model, uncertainty, weight, and a smaller table if this one is large.
    warnings = [text for encounter in encounters for text in model_limits.warnings(scene, encounter)]
    notes = [text for encounter in encounters for text in model_limits.notes(scene, encounter)]
    for effect in filter(None, map(model_limits.weight, encounters)):
        notes.append(effect.note)
        warnings += [] if effect.warning is None else [effect.warning]
    smaller = [offer for offer in within_tolerance if offer.kernel.bytes < chosen.kernel.bytes]
    if chosen.kernel.bytes > LARGE and smaller:
        size, cost = smaller[0].kernel.bytes, smaller[0].cost
        # The scene's key admits integers from 1 on.
        notes.append(f"For a smaller table ({size:,} bytes, cost {cost}): code.largest_table = {max(size, 1)}")
    return Choice(
        scene, encounters, offers, chosen, "; ".join(_reasons(scene, encounters, offers, chosen)), warnings, notes
    )


def _no_kernel(scene: Scene, encounters: Sequence[Encounter], offers: Sequence[Candidate]) -> ValueError:
    """Return the error for a tolerance that no kernel meets; `offers` are all candidates for these encounters."""
    # A language without tables has the compact kernels only, which need v* and beta in their range.
    reason = None if scene.code.spoken.table or scene.code.argument == "v_star" else uncovered(scene, encounters)
    if reason is not None:
        return ValueError(f"{scene.source}: a constant does not meet the tolerance, and {reason}")
    # The message names the best error of all kernels, even if rounding alone exceeds the tolerance.
    quotient = best_quotient(scene, encounters) if too_rough(scene, encounters) else None
    best = min(filter(None, (*offers, quotient)), key=lambda offer: excess(offer.errors, scene.tolerance))
    name, code = excess(best.errors, scene.tolerance)[1], scene.code
    small = "" if code.largest_table is None else f", tables of at most {code.largest_table} bytes"
    return ValueError(
        f"{scene.source}: tolerance.{name} is {scene.tolerance.limits()[name]:g}: expected "
        f"{at_most(best.errors[name])} or more, which the best kernel in {code.language} ({code.format}{small}) "
        "reaches on this scene"
    )


def _reasons(
    scene: Scene, encounters: Sequence[Encounter], offers: Sequence[Candidate], chosen: Candidate
) -> list[str]:
    """Return the reasons against cheaper kernels, including the one that comes closest to the tolerance.

    `offers` are all candidates for these encounters, and `chosen` is one of them.
    """
    texts = list[str]()
    # Of best quotients, the one with an operation less.
    if chosen.degrees is not None:
        fit = fewer_operations(chosen)
        if fit is not None:
            error = f"{fit.error:.3g} min(eps, 1 - eps)"
            texts.append(f"the best quotient with fewer operations, {fit.label}, has an error of {error} (sampled)")
    # Cheaper kernels, by cost and then by size (the first two of a rank), that fail and that meet the tolerance
    cheaper = [offer for offer in offers if offer.rank[:2] < chosen.rank[:2]]
    failing, meeting = ([offer for offer in cheaper if bool(offer.failing) == fails] for fails in (True, False))
    # Of cheaper kernels outside the tolerance, the one that comes closest; of those within it, why they are not chosen.
    rough = too_rough(scene, encounters)
    if rough is not None and not chosen.is_constant:
        texts.append(rough)
    elif failing:
        closest = min(failing, key=lambda offer: excess(offer.errors, scene.tolerance))
        texts.append(_failure(scene, encounters, closest))
    for why, rejected in (
        ("with a larger table", [offer for offer in meeting if offer.kernel.bytes]),
        ("for the speeds of the scene only", [offer for offer in meeting if offer.degrees is not None]),
    ):
        if rejected:
            texts.append(f"{' and '.join(offer.label for offer in rejected)}: hardly cheaper, {why}")
    return texts


def _failure(scene: Scene, encounters: Sequence[Encounter], candidate: Candidate) -> str:
    """Return the sentence on a candidate that does not meet the tolerance: its largest error, in the worst measure.

    It names an impact at which a sample exceeds the tolerance, or else the proven bound.
    """
    # The measure in which the tolerance is exceeded most
    name = excess(candidate.errors, scene.tolerance)[1]
    limit = scene.tolerance.limits()[name]
    error, v_star, pair = candidate.sampled(encounters, name)
    if error > limit:
        return f"{candidate.label}: {MEASURES[name]} {error:.3g} at v* = {v_star:.4g} ({pair}), more than {limit:g}"
    bound = at_most(candidate.errors[name])
    return f"{candidate.label}: {MEASURES[name]} is proven to be at most {bound}, which is more than {limit:g}"
