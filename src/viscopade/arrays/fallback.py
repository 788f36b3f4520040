"""eps at a speed in NumPy: the operations of the C kernel `lookup_full` in the same order, with identical bits.

See exports/viscopade_speed_full.h for what is computed (`targets.speed` writes it), and exports/viscopade_full.h for
what is computed where w = beta^5 speed is outside the table.
"""

from __future__ import annotations

import math
import pkgutil
from collections.abc import Sequence
from functools import lru_cache
from typing import Any, NamedTuple, cast

import numpy as np
import numpy.typing as npt

from viscopade.arrays.panels import FIRST, FOLD

Array = npt.NDArray[Any]

DATA = "data/restitution.txt"

_FRACTION, _BIAS, _SMALLEST = 52, 1023, 2.0**-1022  # of type double
_OCTAVES = 128
_PERIOD = 3  # octaves of v* after which the leading terms repeat themselves
_SPLIT = 4  # 2^_SPLIT rows to an octave of v*
_LARGEST = 2.0**324  # at this v* eps is 0
_CLEARED = 26  # bits of v* that t_1 lacks


class _Tables(NamedTuple):
    first: int
    split: int
    switch: int
    """The first row with base = 0."""
    columns: Array
    """Coefficient k of row i is [k, i]."""
    full_switch: int
    """The last row with base = 1."""
    full: Array


@lru_cache(maxsize=1)
def _tables() -> _Tables:
    text = cast(bytes, pkgutil.get_data("viscopade", DATA)).decode()
    lines = [line.split() for line in text.splitlines() if not line.startswith("#")]
    middle = next(n for n, line in enumerate(lines) if line[0] == "full")
    first, split, switch = map(int, lines[0][1:])
    return _Tables(
        first, split, switch, _columns(lines[1:middle]), int(lines[middle][1]), _columns(lines[middle + 1 :])
    )


def _columns(lines: Sequence[Sequence[str]]) -> Array:
    return np.array([[float.fromhex(number) for number in line] for line in lines]).T.copy()


def restitution(speed: Array, beta: Array) -> Array:
    """Return eps, for arrays of one shape and one type, float or double; float is computed in double and rounded."""
    result = _restitution(speed.astype(np.float64, copy=False), beta.astype(np.float64, copy=False))
    return result.astype(speed.dtype, copy=False)


def _restitution(speed: Array, beta: Array) -> Array:
    b2 = beta * beta
    scale = b2 * b2 * beta
    place = (scale * speed).view(np.uint64) - np.uint64(_BIAS + _tables().first << _FRACTION)
    usual = (place < np.uint64(_OCTAVES << _FRACTION)) & (scale >= _SMALLEST)
    result = _looked_up(np.where(usual, place, np.uint64(0)))
    if not usual.all():
        rare = ~usual
        result[rare] = _elsewhere(speed[rare], beta[rare])
    return result


def _looked_up(place: Array) -> Array:
    """Return eps where w's bits are `place` beyond those of 2^first."""
    table = _tables()
    shift = _FRACTION - table.split
    index = (place >> np.uint64(shift)).astype(np.intp)
    in_octave = place & np.uint64((1 << _FRACTION) - 1)
    row_start = in_octave >> np.uint64(shift) << np.uint64(shift)
    m = (in_octave | np.uint64(_BIAS << _FRACTION)).view(np.float64)
    middle = (row_start | np.uint64(_BIAS << _FRACTION | 1 << (shift - 1))).view(np.float64)
    t = m - middle
    high, low, *a = (column.take(index, mode="clip") for column in table.columns)  # clip: without a check
    rest = low + t * _pairs(a, t, t * t)
    base = np.where(index < table.switch, 1.0, 0.0)
    head = base + high
    lost = (base - head) + high
    return cast(Array, head + (lost + rest))


def _pairs(a: Sequence[Array], t: Array, tt: Array) -> Array:
    """Return (a_0 + t a_1) + t^2 ((a_2 + t a_3) + t^2 (…))."""
    groups = [a[n] + t * a[n + 1] if n + 1 < len(a) else a[n] for n in range(0, len(a), 2)]
    total = groups.pop()
    for group in reversed(groups):
        total = group + tt * total
    return total


def _elsewhere(speed: Array, beta: Array) -> Array:
    """Return eps by way of v*. The power is the C library's, as NumPy's own differs in the last bit."""
    power = np.array([math.pow(v, 0.1) if v >= 0 else math.nan for v in speed.tolist()])
    return _epsilon(np.sqrt(beta) * power)


def _epsilon(v_star: Array) -> Array:
    """Return what viscopade_epsilon_full does."""
    table = _tables()
    bits = np.minimum(np.abs(np.where(v_star >= 0, v_star, 0.0)), _LARGEST).view(np.int64)
    folds = np.maximum((bits >> _FRACTION) - (_BIAS + FOLD), 0) // _PERIOD
    scale = (_BIAS - 10 * folds << _FRACTION).view(np.float64)
    bits = bits - (_PERIOD * folds << _FRACTION)
    x, x1 = bits.view(np.float64), (bits >> _CLEARED << _CLEARED).view(np.float64)
    index = np.maximum((bits >> (_FRACTION - _SPLIT)) - ((_BIAS + FIRST << _SPLIT) - 1), 0)
    centre, high, slope, low, *a = (column[index] for column in table.full)
    t, t1, t2 = x - centre, x1 - centre, x - x1
    rest = (low + slope * t2) + t * (a[0] + t * _pairs(a[1:], t, t * t))
    exact = high + slope * t1
    base = np.where(index <= table.full_switch, 1.0, 0.0)
    head = base + exact
    lost = (base - head) + exact
    return np.where(v_star >= 0, (head + (lost + rest)) * scale, math.nan)
