"""The answer for a scene as tables, sentences and JSON.

A Choice has the scene, its encounters (pairs of bodies with their ranges of beta, v* and eps), all kernels with their
costs and errors there as `offers`, and the chosen one.
"""

from __future__ import annotations

from collections.abc import Iterator
from typing import Any

from viscopade.arithmetic.decimals import at_most
from viscopade.scene.candidate import COSTS
from viscopade.scene.check import SceneCheck
from viscopade.scene.choice import Choice
from viscopade.scene.encounter import Encounter, mean_free_time
from viscopade.scene.render import error_sentences, file_name, tolerance_sentence
from viscopade.scene.tolerance import MEASURES

PAIRS = (
    "pair", "A (s)", "beta (s/m)^(1/5)", "speeds (m/s)", "v*", "eps", "contact lasts (s)", "overlap/radius",
)  # fmt: skip
KERNELS = ("kernel", "cost", "table (bytes)", "of eps", "of 1 - eps^2", "absolute", "enough")


def pairs(choice: Choice) -> Iterator[tuple[str, ...]]:
    """Yield a row for each pair of bodies, with the columns of `PAIRS`, in SI units."""
    # Four digits of A and of ranges; fewer of the contact time and the overlap, which are estimates.
    for encounter in choice.encounters:
        yield (
            encounter.name,
            f"{encounter.pair.A:.4g}",
            _span(float(encounter.weakest.beta), float(encounter.strongest.beta)),
            _span(encounter.speeds.slowest, encounter.speeds.fastest),
            _span(*map(float, encounter.v_star)),
            _span(*map(float, encounter.epsilon)),
            f"{encounter.contact_time:.3g}",
            f"{encounter.overlap:.2g}",
        )


def _span(low: float, high: float) -> str:
    """Return a range as a text, or one number if both ends agree in four digits."""
    return f"{low:.4g}" if f"{low:.4g}" == f"{high:.4g}" else f"{low:.4g} … {high:.4g}"


def kernel_rows(choice: Choice) -> Iterator[tuple[str, ...]]:
    """Yield a row for each kernel, the cheapest first."""
    for candidate in choice.offers:
        errors = map(at_most, candidate.errors.values())
        verdict = "chosen" if candidate is choice.chosen else "no" if candidate.failing else "yes"
        yield candidate.label, str(candidate.cost), f"{candidate.kernel.bytes:,}", *errors, verdict


def summary(choice: Choice) -> str:
    """Return the answer in one line."""
    candidate, limits = choice.chosen, choice.scene.tolerance.limits()
    errors = ", ".join(f"{MEASURES[name]} at most {at_most(candidate.errors[name])}" for name in limits)
    warned = f"; {len(choice.warnings)} warnings" if len(choice.warnings) > 1 else "; 1 warning" * len(choice.warnings)
    return f"{candidate.label}: {errors}{warned}"


def sentences(choice: Choice) -> Iterator[str]:
    """Yield the sentences of the answer of a choice: the question, the kernel, the cheaper ones, notes and warnings."""
    # The mean free time of each pair only in a gas.
    yield tolerance_sentence(choice.scene)
    yield f"Costs are {COSTS}."
    yield from error_sentences(choice)
    yield choice.against_cheaper
    for encounter in choice.encounters:
        free_time = mean_free_time(choice.scene, encounter)
        if free_time is not None:
            yield f"{encounter.name}: the mean free time is about {free_time:.3g} s."
    yield from (f"{text}." for text in choice.notes)
    yield from (f"Warning: {text}." for text in choice.warnings)


def check_sentence(check: SceneCheck) -> str:
    """Return the sentence on the result of a check: why it was not run, or its largest errors."""
    # Errors are sampled, and have three digits.
    if check.reason:
        how = f" ({check.how})" if check.how else ""
        return f"The file was {check.reason}{how}."
    largest = ", ".join(f"{MEASURES[name]} {value:.3g}" for name, value in check.errors.items())
    return f"Checked: largest {largest}, at {check.collisions:,} collisions. Run by {check.how}."


def to_json(choice: Choice, check: SceneCheck | None) -> dict[str, Any]:
    """Return the whole answer of a choice and of its check (None if it was not run) as JSON-able data.

    Errors are decimals that are rounded up, by the names of the tolerance.
    """
    # The keys are an interface (docs/reference/stability.md).
    scene, chosen = choice.scene, choice.chosen
    return {
        "scene": scene.name,
        "title": scene.title,
        "tolerance": scene.tolerance.limits(),
        "pairs": [_pair(choice, encounter) for encounter in choice.encounters],
        "kernels": [
            {
                "name": offer.kernel.name,
                "label": offer.label,
                "cost": offer.cost,
                "bytes": offer.kernel.bytes,
                "errors": {name: at_most(value) for name, value in offer.errors.items()},
                "failing": list(offer.failing),
                "chosen": offer is chosen,
            }
            for offer in choice.offers
        ],
        "chosen": chosen.kernel.name,
        "file": file_name(choice.scene),
        "reason": choice.reason,
        "notes": list(choice.notes),
        "warnings": list(choice.warnings),
        "check": None if check is None else vars(check) | {"errors": dict(check.errors)},
    }


def _pair(choice: Choice, encounter: Encounter) -> dict[str, Any]:
    """Return a pair as JSON-able data, in SI units: for beta and speeds the smallest, a typical and the largest one."""
    # v* and eps have only ends.
    speeds = encounter.speeds
    return {
        "pair": encounter.name,
        "dissipative_constant": encounter.pair.A,
        "beta": [encounter.weakest.beta, encounter.pair.beta, encounter.strongest.beta],
        "speed": [speeds.slowest, speeds.typical, speeds.fastest],
        "v_star": [float(v) for v in encounter.v_star],
        "epsilon": [float(e) for e in encounter.epsilon],
        "contact_time": encounter.contact_time,
        "overlap": encounter.overlap,
        "mean_free_time": mean_free_time(choice.scene, encounter),
    }
