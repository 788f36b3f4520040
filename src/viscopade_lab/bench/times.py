"""The times of a run: nanoseconds per collision in each round, and their statistics."""

from __future__ import annotations

from collections.abc import Iterator, Mapping

import numpy as np

from viscopade.arrays.checked import FloatArray
from viscopade_lab.bench.contender import Group
from viscopade_lab.bench.result import CALL, Key, Timing

Times = Mapping[Key, FloatArray]
"""Nanoseconds per collision, one number for each round."""


def ratio(times: Times, key: Key, other: str) -> float | None:
    """Return the median over the rounds of a contender's time over another's, or None if one was not measured."""
    reference = times.get(Key(other, key.format, key.speeds, key.measure))
    return None if reference is None or key not in times else float(np.median(times[key] / reference))


def rows(times: Times, names: Mapping[str, tuple[str, Group]], reference: str, copy: str) -> Iterator[Timing]:
    """Return the statistics of all times.

    Parameters
    ----------
    times : mapping of Key to array
    names : mapping of str to (str, str)
        By id, label and group.
    reference, copy : str
        Ids of pow + [3/6] and of the scaled copy.
    """
    for key, values in times.items():
        if key.measure == CALL:
            continue
        low, median, high = np.percentile(values, [25, 50, 75]).tolist()
        label, group = names[key.id]
        ratios = ratio(times, key, reference), ratio(times, key, copy)
        least, spread = float(values.min()), (high - low) / median
        yield Timing(key.id, label, group, key.format, key.speeds, key.measure, least, median, spread, *ratios)
