"""The table of panels, data/double.txt: where they lie, and how one is found from the bits of v*."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
import numpy.typing as npt

from viscopade.arrays.checked import FloatArray

IntArray = npt.NDArray[np.int64]

NAMES = ("epsilon", "one_minus_epsilon", "x_max", "tau_c")

FIRST, FOLD, SPLIT = -4, 20, 3

COEFFICIENTS = 14

DATA = "data/double.txt"

_PERIOD = 3  # octaves after which the leading terms repeat themselves, as v*^(1/3) is a power of 2 there

_OCTAVES = 2.0 ** np.arange(FIRST, FOLD + _PERIOD)

_IN_OCTAVE = 1 + np.arange(1, 2 << SPLIT, 2) / (2 << SPLIT)

CENTRES: FloatArray = np.concatenate([[0.0], np.outer(_OCTAVES, _IN_OCTAVE).ravel()])

HALF_WIDTHS: FloatArray = np.concatenate([[_OCTAVES[0]], np.repeat(_OCTAVES / (2 << SPLIT), 1 << SPLIT)])

PANELS = len(CENTRES)

_LARGEST = 2.0**1023  # there eps and x_max are 0 already


class Place(NamedTuple):
    """Where v* = 8^folds s lies in the table."""

    s: FloatArray
    folds: IntArray
    panel: IntArray
    z: FloatArray


def place_of(v_star: FloatArray) -> Place:
    """Find the panel from the bits of v*: a double's exponent and leading mantissa bits are one integer."""
    bits = np.minimum(v_star + 0.0, _LARGEST).view(np.int64)  # -0.0 + 0.0 = 0.0
    folds = np.maximum((bits >> 52) - (1023 + FOLD), 0) // _PERIOD
    bits = bits - (_PERIOD * folds << 52)
    s = bits.view(np.float64)
    panel = np.maximum((bits >> (52 - SPLIT)) - ((1023 + FIRST << SPLIT) - 1), 0)
    return Place(s, folds, panel, (s - CENTRES[panel]) / HALF_WIDTHS[panel])
