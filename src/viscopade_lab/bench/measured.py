"""What the benchmark found: times, errors, and the targets. Its JSON form is read by the report."""

from __future__ import annotations

import math
from collections.abc import Iterable, Mapping
from dataclasses import dataclass
from typing import Any, Literal

import numpy as np

from viscopade.arrays.checked import FloatArray
from viscopade_lab.bench.kernel import Group, Measure, ProvenOf
from viscopade_lab.bench.scene import Scene, Speeds


@dataclass(frozen=True)
class Key:
    """What a row of times is about; `measure` is one of `MEASURES`, or `CALL`."""

    id: str
    format: str
    speeds: Speeds
    measure: Measure | Literal["call"]


CALL: Literal["call"] = "call"
"""An array as Python hands it over: only for the ratio of the two that are compared so."""


Times = Mapping[Key, FloatArray]
"""Nanoseconds per collision, one number for each round."""


@dataclass(frozen=True)
class Row:
    """The times of a kernel in nanoseconds per collision.

    Attributes
    ----------
    spread : float
        Distance of the quartiles, relative to the median.
    ratio_to_3_6, ratio_to_copy : float or None
        Median over the rounds of the time over that of pow + [3/6], or of a scaled copy, in the same round, of the
        same type, speeds and measure.
    """

    key: Key
    label: str
    group: Group
    min: float
    median: float
    spread: float
    ratio_to_3_6: float | None
    ratio_to_copy: float | None

    def to_json(self) -> dict[str, Any]:
        """Return the row as JSON-able data."""
        return {
            "id": self.key.id,
            "label": self.label,
            "group": self.group,
            "format": self.key.format,
            "speeds": self.key.speeds,
            "measure": self.key.measure,
            "ns": {"min": _digits(self.min), "median": _digits(self.median), "spread": _digits(self.spread)},
            "ratio_to_3_6": _digits(self.ratio_to_3_6),
            "ratio_to_copy": _digits(self.ratio_to_copy),
        }


@dataclass(frozen=True)
class Error:
    """The largest errors of a kernel, sampled on the scene's speeds.

    Attributes
    ----------
    relative, loss : float or None
        |d eps|/eps and |d eps|/(1 - eps).
    proven : str or None
        Bound of |d eps|/min(eps, 1 - eps).
    proven_of : "speed" or "v_star"
        Whether that is a bound for eps of the speed, or for eps of v*: then the rounding of v* comes on top.
    """

    id: str
    label: str
    group: Group
    format: str
    relative: float | None
    loss: float | None
    proven: str | None
    proven_of: ProvenOf
    note: str

    def to_json(self) -> dict[str, Any]:
        """Return the errors as JSON-able data."""
        return {**vars(self), "relative": _digits(self.relative), "loss": _digits(self.loss)}


@dataclass(frozen=True)
class Curve:
    """|d eps|/eps of a kernel in double over v*: the largest in each of many strips of the scene's speeds."""

    id: str
    label: str
    v_star: FloatArray
    error: FloatArray

    def to_json(self) -> dict[str, Any]:
        """Return the curve as JSON-able data."""
        points = {"v_star": self.v_star.tolist(), "error": self.error.tolist()}
        return {"id": self.id, "label": self.label} | {
            name: [_digits(value) for value in values] for name, values in points.items()
        }


@dataclass(frozen=True)
class Target:
    """A ratio that was aimed at."""

    what: str
    target: str
    measured: float | None
    reached: bool | None
    note: str

    def to_json(self) -> dict[str, Any]:
        """Return the target as JSON-able data."""
        return {**vars(self), "measured": _digits(self.measured)}


@dataclass(frozen=True)
class Machine:
    """Where the benchmark ran; no host names or paths."""

    cpu: str
    compiler: str
    system: str
    python: str
    numpy: str


@dataclass(frozen=True)
class Measured:
    """All of a run.

    Attributes
    ----------
    command : str
        The marker of generated files, and the command line.
    flags : mapping of str to str
        Of the scalar and of the array functions.
    """

    command: str
    machine: Machine
    rounds: int
    scene: Scene
    memory_elements: int
    cache_elements: int
    flags: Mapping[str, str]
    rows: tuple[Row, ...]
    errors: tuple[Error, ...]
    targets: tuple[Target, ...]
    curves: tuple[Curve, ...]

    def to_json(self) -> dict[str, Any]:
        """Return one object with everything."""
        return {
            "command": self.command,
            "machine": vars(self.machine),
            "settings": {
                "rounds": self.rounds,
                "scene": vars(self.scene),
                "memory_elements": self.memory_elements,
                "cache_elements": self.cache_elements,
                "flags": dict(self.flags),
            },
            "rows": [row.to_json() for row in self.rows],
            "errors": [error.to_json() for error in self.errors],
            "targets": [target.to_json() for target in self.targets],
            "curves": [curve.to_json() for curve in self.curves],
        }


def ratio(times: Times, key: Key, other: str) -> float | None:
    """Return the median over the rounds of a kernel's time over another's, or None if one was not measured."""
    reference = times.get(Key(other, key.format, key.speeds, key.measure))
    return None if reference is None or key not in times else float(np.median(times[key] / reference))


def rows(times: Times, names: Mapping[str, tuple[str, Group]], reference: str, copy: str) -> Iterable[Row]:
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
        yield Row(key, label, group, float(values.min()), median, (high - low) / median, *ratios)


def _digits(value: float | None) -> float | None:
    """Return a number to four digits, more are noise, or None if it is infinite or NaN: JSON knows neither."""
    return None if value is None or not math.isfinite(value) else float(f"{value:.4g}")
