"""The table of panels (data/double.txt): its rows, the panels, and the index of a panel from the bits of v*.

The functions of v* are the coefficient of restitution eps, 1 - eps, the maximal compression x_max and the duration
tau_c of the contact, in the units `Pair.length_scale` and `Pair.time_scale`. A panel is an interval of v*, on which
each of them is a polynomial in

    z = (v* - centre)/(half width),    -1 <= z < 1    (0 <= z < 1 on panel 0, whose centre is 0).

Panel 0 is [0, 2^FIRST). Each octave [2^k, 2^(k+1)), k = FIRST … FOLD + PERIOD - 1, has 2^SPLIT panels of equal width.
From 2^FOLD on v* is divided by a power of 8 that brings it into the last PERIOD octaves.
"""

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

# FIRST, SPLIT and COEFFICIENTS are choices: other panels with fewer or more coefficients would serve.
# 14 coefficients on these panels have relative errors up to 2^-61.9, as the table's head says: below the 2^-53 of a
# double. From 2^20 on the leading terms for large v* are exact to double precision: the next ones are smaller by
# factors like 1/W, W = 12^(1/3) v*^(10/3) > 2^67 (derivations/10_large_v_star.py).
FIRST, FOLD, SPLIT = -4, 20, 3
COEFFICIENTS = 14
DATA = "data/double.txt"

PERIOD = 3  # octaves after which the leading terms repeat themselves, as v*^(1/3) is a power of 2 there

_OCTAVES = 2.0 ** np.arange(FIRST, FOLD + PERIOD)  # where they begin

# Panel j of an octave [o, 2 o) is o [1 + j/2^SPLIT, 1 + (j + 1)/2^SPLIT): its half width is w = o/2^(SPLIT + 1), and
# its centre o + (2 j + 1) w.
_CENTRES_IN_OCTAVE = 1 + np.arange(1, 2 << SPLIT, 2) / (2 << SPLIT)
CENTRES: FloatArray = np.concatenate([[0.0], np.outer(_OCTAVES, _CENTRES_IN_OCTAVE).ravel()])
HALF_WIDTHS: FloatArray = np.concatenate([[_OCTAVES[0]], np.repeat(_OCTAVES / (2 << SPLIT), 1 << SPLIT)])

PANELS = len(CENTRES)

# Stands for all larger v*, also inf: eps, x_max and tau_c, like 2^-3410, 2^-1364 and 2^-1364 times a logarithm, are 0
# there already.
_LARGEST = 2.0**1023

# A double is sign, exponent + 1023 (BIAS) and the 52 bits of the significand behind its leading 1.
_MANTISSA_BITS, _BIAS = 52, 1023


class Row(NamedTuple):
    """A row: a function on a panel is 2^exponent (a_0 + a_1 z + …), z = (v* - centre)/(half width), exactly."""

    exponent: int
    a: tuple[int, ...]


@lru_cache(maxsize=1)  # read once
def rows() -> dict[tuple[str, int], Row]:
    """Return all rows of the table, by function and panel.

    Raises
    ------
    OSError
        If the table is not whole, as after a broken installation.
    """
    text = cast(bytes, pkgutil.get_data("viscopade", DATA)).decode()
    # Lines with # are the head. A line is "epsilon 17 -66 a_0 a_1 …": function, panel, exponent and 14 integers. A file
    # that was cut lacks rows.
    lines = [line.split() for line in text.splitlines() if not line.startswith("#")]
    table = {(name, int(panel)): Row(int(e), tuple(map(int, a))) for name, panel, e, *a in lines}
    if len(table) != PANELS * len(NAMES):
        raise OSError(f"{DATA} has {len(table)} rows, not {PANELS * len(NAMES)}")
    return table


class Place(NamedTuple):
    """Place of v* = 8^folds s in the table: s < 2^(FOLD + PERIOD) lies on a panel, at z from its centre."""

    s: FloatArray
    folds: IntArray
    panel: IntArray
    z: FloatArray
    """(s - centre)/(half width)."""


def place_of(v_star: FloatArray) -> Place:
    """Find the panel from the bits of v*: a double's exponent and leading mantissa bits are one integer.

    `v_star` is an array of doubles >= 0 or inf, which the callers have checked.
    """
    bits = np.minimum(v_star + 0.0, _LARGEST).view(np.int64)  # -0.0 + 0.0 = 0.0, which has no bit of a sign
    # From 2^FOLD on, the exponent is lowered by PERIOD octaves as often as that leaves it at FOLD or above: v*/8^folds.
    folds = np.maximum((bits >> _MANTISSA_BITS) - (_BIAS + FOLD), 0) // PERIOD
    bits = bits - (PERIOD * folds << _MANTISSA_BITS)
    s = bits.view(np.float64)
    # The exponent and the SPLIT leading bits of the significand count the panels; the first one after panel 0 begins at
    # 2^FIRST, (BIAS + FIRST) 2^SPLIT as such a number (+ binds before <<), and all below is panel 0.
    panel = np.maximum((bits >> (_MANTISSA_BITS - SPLIT)) - ((_BIAS + FIRST << SPLIT) - 1), 0)
    return Place(s, folds, panel, (s - CENTRES[panel]) / HALF_WIDTHS[panel])


def index_of(v_star: float) -> tuple[int, int]:
    """Return the panel of one v* >= 0, and by how many powers of 8 the v* is divided, as `place_of` does."""
    # v* = mantissa 2^exponent, 1/2 <= mantissa < 1: it lies in the octave that begins at 2^(exponent - 1).
    mantissa, exponent = math.frexp(min(v_star, _LARGEST))
    folds = max(exponent - 1 - FOLD, 0) // PERIOD
    octave = exponent - 1 - PERIOD * folds - FIRST
    if octave < 0 or not v_star:  # 0 has the mantissa 0 and the exponent 0, which is no octave
        return 0, 0
    # Before the panel lie panel 0, 2^SPLIT panels for each lower octave, and those below it in its own octave.
    return 1 + (octave << SPLIT) + int((2 * mantissa - 1) * (1 << SPLIT)), folds
