"""The ratios that were aimed at, and what was measured of them."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import replace
from typing import Literal

from viscopade.scene.cost import PADE
from viscopade_lab.bench.contender import TimingMeasure
from viscopade_lab.bench.ours import tier_id
from viscopade_lab.bench.result import Goal, Key
from viscopade_lab.bench.rivals import COPY
from viscopade_lab.bench.speed_range import DISTRIBUTIONS, Distribution
from viscopade_lab.bench.times import Times, ratio

Sense = Literal["times faster", "times the time"]

_MAIN: Distribution = "log-uniform"
_FASTER: tuple[tuple[TimingMeasure, float], ...] = (("throughput", 8.0), ("latency", 3.0))
_OF_COPY = {"1e-5": 1.25, "1e-7": 1.6, "1e-10": 2.5}
_OF_C, _OF_DEVICE_COPY = 1.2, 1.1

LEAST_ELEMENTS = 8_000_000
NOT_MEASURED = "not measured"


def judged(times: Times, elements: int, restitution: float | None, cuda: float | None) -> Iterator[Goal]:
    """Return all goals.

    Parameters
    ----------
    times : mapping of Key to array
    elements : int
        Of an array from memory.
    restitution : float or None
        Time of `viscopade.restitution` over that of the C kernel for arrays, if measured.
    cuda : float or None
        Time on a GPU over that of a copy there, if it was measured elsewhere.
    """
    for measure, least in _FASTER:
        for tier in ("1e-5", "1e-7"):
            what = f"scalar {measure}, {tier} tier, against pow + [3/6], -O2"
            yield _goal(times, what, tier, measure, PADE, "times faster", least)
    for tier, most in _OF_COPY.items():
        what = f"batch from memory, {tier} tier, against a scaled copy"
        found = _goal(times, what, tier, "memory", COPY, "times the time", most)
        yield found if elements >= LEAST_ELEMENTS else replace(found, reached=None, note=f"only {elements} elements")
    for measure, _ in _FASTER:
        what = f"full double kernel against libm's pow alone, scalar {measure}"
        yield _goal(times, what, "full", measure, "pow", "times the time", 1.0)
    yield _given("vp.restitution on 1e6 doubles against the C kernel for arrays", restitution, _OF_C, NOT_MEASURED)
    what = "CUDA, float, 1e8 elements, against a copy on the device"
    yield _given(what, cuda, _OF_DEVICE_COPY, f"{NOT_MEASURED}: no GPU" if cuda is None else "measured elsewhere")


def _goal(times: Times, what: str, tier: str, measure: TimingMeasure, other: str, sense: Sense, limit: float) -> Goal:
    """Return a goal on the log-uniform speeds; the note says how it is on the others."""
    found = {speeds: _ratio(times, tier_id(tier), other, speeds, measure, sense) for speeds in DISTRIBUTIONS}
    value = found[_MAIN]
    faster = sense == "times faster"
    words = f"at least {limit:g} times faster" if faster else f"at most {limit:g} times the time"
    if value is None:
        return Goal(what, words, None, None, NOT_MEASURED)
    reached = value >= limit if faster else value <= limit
    others = (f"{speeds} {number:.3g}" for speeds, number in found.items() if speeds != _MAIN and number is not None)
    return Goal(what, words, value, reached, f"{_MAIN} speeds; " + ", ".join(others))


def _ratio(
    times: Times, ident: str, other: str, speeds: Distribution, measure: TimingMeasure, sense: Sense
) -> float | None:
    if sense == "times faster":
        return ratio(times, Key(other, "double", speeds, measure), ident)
    return ratio(times, Key(ident, "double", speeds, measure), other)


def _given(what: str, value: float | None, limit: float, note: str) -> Goal:
    words = f"at most {limit:g} times the time"
    if value is None:
        return Goal(what, words, None, None, note)
    return Goal(what, words, value, value <= limit, "" if note == NOT_MEASURED else note)
