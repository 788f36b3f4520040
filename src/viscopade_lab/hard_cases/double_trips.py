r"""Trips between v* and eps, or 1 - eps, in double precision, with the limits of their errors.

With q = (1 - eps)/eps,

    kappa = d ln v*/d ln q    lies between 3/10 (v* -> infinity) and 1/2 (v* -> 0),

so that an error of eps or of 1 - eps changes v* by kappa times what it does to ln q, and an error of v* changes eps by
(1 - eps)/kappa times as much and 1 - eps by eps/kappa. Where an error of eps reaches 0 or 1, nothing is known of v*:
there the limit is infinite, and no error is counted.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping
from typing import NamedTuple

import numpy as np

from viscopade.arrays import double, panels
from viscopade.arrays.checked import FloatArray
from viscopade.arrays.double import ULP

UNIT = 2.0**-53
TINIEST = 5e-324
LEAST_CONDITION, LARGEST_CONDITION = 0.3, 0.5
_NEAR = 1 / 8  # of ln q: farther away, the largest condition is taken
_KNOWN = (1e-150, 1e90)  # of v*: there eps, 1 - eps and the slope are normal numbers


class Trip(NamedTuple):
    """Relative errors of a trip from many starts, and their limits; inf where nothing can be known."""

    start: FloatArray
    error: FloatArray
    limit: FloatArray

    @property
    def worst(self) -> float:
        """The largest error in terms of its limit."""
        return float(np.max(_share(self.error, self.limit), initial=0.0))


def _share(error: FloatArray, limit: FloatArray) -> FloatArray:
    """Return error/limit; a NaN counts as infinite, and where the limit is infinite nothing counts."""
    error = np.where(np.isnan(error), np.inf, error)
    with np.errstate(all="ignore"):
        return np.where(np.isinf(limit), 0.0, np.where(error == 0, 0.0, error / limit))


def relative(back: FloatArray, start: FloatArray) -> FloatArray:
    """Return |back/start - 1|: 0 where both are the same, also 0 or infinite."""
    with np.errstate(all="ignore"):
        return np.where(back == start, 0.0, np.abs(back - start) / start)


# --- eps and v* in double precision -----------------------------------------------------------------------------------


def condition(v_star: FloatArray) -> FloatArray:
    """Return kappa = d ln v*/d ln q at v*."""
    v = np.clip(v_star, *_KNOWN)
    return np.asarray(double.one_minus_epsilon(v) / -double.slope(v))


def change_of_odds(portion: FloatArray, error: FloatArray) -> FloatArray:
    """Return by how much ln q may change where eps or 1 - eps changes by `error`; inf if it may reach 0 or 1."""
    with np.errstate(all="ignore"):
        rest = 1 - portion
        change = -np.log1p(-error / rest) - np.log1p(-error / portion)
        return np.where(error < np.minimum(portion, rest), change, np.inf)


def change_of_v_star(v_star: FloatArray, change: FloatArray) -> FloatArray:
    """Return by how much v* may change, relatively, where ln q changes by `change`.

    kappa itself changes by less than a factor 1 + change, and is never above its limit for small v*.
    """
    near = condition(v_star) * change * (1 + change)
    with np.errstate(over="ignore", invalid="ignore"):
        return np.expm1(np.where(change <= _NEAR, near, LARGEST_CONDITION * change))


def change_of_portion(v_star: FloatArray, rest: FloatArray, log_error: FloatArray | float) -> FloatArray:
    """Return by how much eps (rest = 1 - eps) or 1 - eps (rest = eps) may change where ln v* does by `log_error`."""
    change = log_error / condition(v_star)
    change = change * (1 + change)
    return np.expm1(rest * change * (1 + change))


def ulp_of(name: str, value: FloatArray) -> FloatArray:
    """Return the error that a function of `double` may have at a true value near `value`."""
    return ULP[name] * np.spacing(np.nextafter(value, 2))


def _relative_ulp(name: str, value: FloatArray) -> FloatArray:
    with np.errstate(all="ignore"):
        return ULP[name] * np.maximum(2 * UNIT, TINIEST / value)


def v_star_by(name: str, v_star: FloatArray) -> Trip:
    """Go from v* to the portion (eps or 1 - eps) and back."""
    portion = getattr(double, name)(v_star)
    back = double.v_star_from(**{name: portion})
    moved = change_of_v_star(v_star, change_of_odds(portion, ulp_of(name, portion)))
    limit = moved + _relative_ulp("v_star_from", v_star) * (1 + moved)
    return Trip(v_star, relative(back, v_star), limit)


def portion_by_v_star(name: str, portion: FloatArray) -> Trip:
    """Go from eps or 1 - eps to v* and back."""
    v_star = double.v_star_from(**{name: portion})
    back = getattr(double, name)(v_star)
    log_error = -np.log1p(-np.minimum(_relative_ulp("v_star_from", v_star), 0.5))
    with np.errstate(all="ignore"):
        limit = change_of_portion(v_star, 1 - portion, log_error) + ulp_of(name, portion) / portion
    return Trip(portion, relative(back, portion), limit)


DOUBLE_TRIPS: Mapping[str, Callable[[FloatArray], Trip]] = {
    "v* -> eps -> v*": lambda v: v_star_by("epsilon", v),
    "v* -> 1 - eps -> v*": lambda v: v_star_by("one_minus_epsilon", v),
    "eps -> v* -> eps": lambda e: portion_by_v_star("epsilon", e),
    "1 - eps -> v* -> 1 - eps": lambda d: portion_by_v_star("one_minus_epsilon", d),
}


def log_uniform(generator: np.random.Generator, low: float, high: float, number: int) -> FloatArray:
    """Return numbers with logarithms uniform between two."""
    return np.exp(generator.uniform(math.log(low), math.log(high), number))


def v_star_of_all_sizes(generator: np.random.Generator, number: int) -> FloatArray:
    """Return v* from all of double's range, half of them near 1, with its ends, the table's edges and neighbours."""
    edges = np.concatenate([(panels.CENTRES - panels.HALF_WIDTHS)[1:], 2.0 ** np.arange(-1074, 1024, 13)])
    special = [0.0, TINIEST, 2.2250738585072014e-308, np.nextafter(2.2250738585072014e-308, 0), 1.7976931348623157e308]
    return np.concatenate(
        [
            log_uniform(generator, TINIEST, 1.7e308, number // 2),
            log_uniform(generator, 1e-3, 1e3, number - number // 2),
            special,
            edges,
            np.nextafter(edges, 0),
            np.nextafter(edges, np.inf),
        ]
    )


def portions(generator: np.random.Generator, number: int) -> FloatArray:
    """Return numbers from 0 to 1, small ones, ones near 1, and those in between."""
    third = number // 3
    small = log_uniform(generator, TINIEST, 1.0, third)
    near = 1 - log_uniform(generator, 1e-16, 1.0, third)
    special = [0.0, TINIEST, 2.2250738585072014e-308, 0.5, np.nextafter(0.5, 0), np.nextafter(1, 0), 1.0]
    return np.concatenate([small, near, generator.uniform(0, 1, number - 2 * third), special])


def all_trips(generator: np.random.Generator, number: int) -> dict[str, Trip]:
    """Take every trip from about so many starts."""
    starts = {
        "v*": v_star_of_all_sizes(generator, number),
        "ep": portions(generator, number),
        "1 ": portions(generator, number),
    }
    return {name: trip(starts[name[:2]]) for name, trip in DOUBLE_TRIPS.items()}


def conditions() -> tuple[float, float]:
    """Return the least and the largest kappa found from v* = 1e-150 to 1e90."""
    found = condition(np.geomspace(*_KNOWN, 100_001))
    return float(found.min()), float(found.max())
