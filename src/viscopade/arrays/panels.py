"""The table of panels (data/double.txt): its rows, the panels, and the index of a panel from the bits of v*."""

from __future__ import annotations

import math
import pkgutil
from functools import lru_cache
from typing import NamedTuple, cast

import numpy as np
import numpy.typing as npt

from viscopade.arrays.checked import FloatArray

IntArray = npt.NDArray[np.int64]

NAMES = ("epsilon", "one_minus_epsilon", "x_max", "tau_c")

FIRST, FOLD, SPLIT = -4, 20, 3

COEFFICIENTS = 14

DATA = "data/double.txt"

PERIOD = 3  # octaves after which the leading terms repeat themselves, as v*^(1/3) is a power of 2 there

_OCTAVES = 2.0 ** np.arange(FIRST, FOLD + PERIOD)

_IN_OCTAVE = 1 + np.arange(1, 2 << SPLIT, 2) / (2 << SPLIT)

CENTRES: FloatArray = np.concatenate([[0.0], np.outer(_OCTAVES, _IN_OCTAVE).ravel()])

HALF_WIDTHS: FloatArray = np.concatenate([[_OCTAVES[0]], np.repeat(_OCTAVES / (2 << SPLIT), 1 << SPLIT)])

PANELS = len(CENTRES)

_LARGEST = 2.0**1023  # there eps and x_max are 0 already


class Row(NamedTuple):
    """A row: a function on a panel is 2^exponent (a_0 + a_1 z + …), z = (v* - centre)/(half width), exactly."""

    exponent: int
    a: tuple[int, ...]


@lru_cache(maxsize=1)
def rows() -> dict[tuple[str, int], Row]:
    """Return all rows of the table, by function and panel.

    Raises
    ------
    OSError
        If the table is not whole.
    """
    text = cast(bytes, pkgutil.get_data("viscopade", DATA)).decode()
    lines = [line.split() for line in text.splitlines() if not line.startswith("#")]
    found = {(name, int(panel)): Row(int(e), tuple(map(int, a))) for name, panel, e, *a in lines}
    if len(found) != PANELS * len(NAMES):
        raise OSError(f"{DATA} has {len(found)} rows, not {PANELS * len(NAMES)}")
    return found


class Place(NamedTuple):
    """Place of v* = 8^folds s in the table."""

    s: FloatArray
    folds: IntArray
    panel: IntArray
    z: FloatArray


def place_of(v_star: FloatArray) -> Place:
    """Find the panel from the bits of v*: a double's exponent and leading mantissa bits are one integer."""
    bits = np.minimum(v_star + 0.0, _LARGEST).view(np.int64)  # -0.0 + 0.0 = 0.0
    folds = np.maximum((bits >> 52) - (1023 + FOLD), 0) // PERIOD
    bits = bits - (PERIOD * folds << 52)
    s = bits.view(np.float64)
    panel = np.maximum((bits >> (52 - SPLIT)) - ((1023 + FIRST << SPLIT) - 1), 0)
    return Place(s, folds, panel, (s - CENTRES[panel]) / HALF_WIDTHS[panel])


def index_of(v_star: float) -> tuple[int, int]:
    """Return the panel of one v* >= 0, and by how many powers of 8 the v* is divided, as `place_of` does."""
    mantissa, exponent = math.frexp(min(v_star, _LARGEST))
    folds = max(exponent - 1 - FOLD, 0) // PERIOD
    octave = exponent - 1 - PERIOD * folds - FIRST
    if octave < 0 or not v_star:
        return 0, 0
    return 1 + (octave << SPLIT) + int((2 * mantissa - 1) * (1 << SPLIT)), folds
