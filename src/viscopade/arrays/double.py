r"""The exact functions eps(v*), x_max(v*), tau_c(v*) and v*(eps) in double precision, on NumPy arrays.

Every function takes numbers, lists or arrays, and is within `ULP` units in the last place of the true value (sampled:
tests/arrays/test_double.py). Results that underflow become subnormal, then 0, to within one subnormal unit. Because of
these errors a decreasing function may rise by a unit from a number to the next: eps does at
v* = 0.06045712713593428.

[0, 2^FOLD) is cut into panels: one below 2^FIRST, then 2^SPLIT of them to each octave. On every panel each function is
a polynomial in z = (v* - centre)/(half width), which is exact; `tools.double_table` makes them from proven values.
Beyond, the leading terms for large v* are exact to double precision. They are self-similar: with v* = 8^n s,

    eps(v*) = 2^(-10 n) eps(s),    x_max(v*) = 2^(-4 n) x_max(s),    tau_c(v*) = 2^(-4 n) (tau_c(s) + n L x_max(s)),

L = 40/9 ln 8; so the panels of three more octaves serve all larger v*. The inverse is Newton's method on the
polynomials, whose value has two parts, so that the last residual is not rounded.

The extension (native/panels.c) evaluates the polynomials, or NumPy does, with the same bits.
"""

from __future__ import annotations

import math
from collections.abc import Callable
from functools import lru_cache

import numpy as np
import numpy.typing as npt

from viscopade.arrays import checked, panels
from viscopade.arrays.checked import Accepted, FloatArray, Values
from viscopade.arrays.panels import CENTRES, FOLD, HALF_WIDTHS, NAMES, PANELS, IntArray, Place, place_of
from viscopade.compiled import extension

# Largest error in units in the last place, sampled at more than 10,000 points that include the hard ends.
ULP = {"epsilon": 1.0, "one_minus_epsilon": 3.0, "x_max": 1.0, "tau_c": 2.5, "v_star_from": 2.5}


_EPSILON, _LOSS, _X_MAX, _TAU_C = range(len(NAMES))
_POWERS = (-10, 0, -4, -4)  # of 2, for each fold

_LOG_PERIOD = 40 / 9 * math.log(8)
_BLOCK = 1 << 13  # values at once: all that belongs to them stays in the cache
_NEWTON_STEPS = 3
# Beyond the ends of the table ln v* is linear in the logarithm of (1 - eps)/eps.
_FAR = 300.0
_TINY = 2.0**-500

_SPEEDS = Accepted("a number >= 0, or inf", lambda x: x >= 0)
_PORTIONS = Accepted("a number >= 0 and <= 1", lambda x: (x >= 0) & (x <= 1))


def epsilon(v_star: Values) -> Values:
    """Return the coefficient of restitution eps(v*) (eq:force2COR).

    Parameters
    ----------
    v_star : float or array
        v* = beta^(1/2) v^(1/10), >= 0; may be infinite.

    Returns
    -------
    float or array
        From 1 at v* = 0 to 0.

    Raises
    ------
    TypeError
        If a v* is not a real number.
    ValueError
        If a v* is negative or NaN.
    """
    return _of_v_star(_EPSILON, v_star)


def one_minus_epsilon(v_star: Values) -> Values:
    """Return 1 - eps(v*), without the cancellation at small v*; arguments and errors as for `epsilon`."""
    return _of_v_star(_LOSS, v_star)


def x_max(v_star: Values) -> Values:
    """Return the maximal compression in units of `Pair.length_scale`; arguments and errors as for `epsilon`."""
    return _of_v_star(_X_MAX, v_star)


def tau_c(v_star: Values) -> Values:
    """Return the contact's duration in units of `Pair.time_scale`; arguments and errors as for `epsilon`.

    The contact ends where the force vanishes (eq:tEndAdvanced).
    """
    return _of_v_star(_TAU_C, v_star)


def slope(v_star: Values) -> Values:
    """Return d ln eps/d ln v*, from 0 at v* = 0 to -10/3, to 12 digits or more.

    Arguments and errors are those of `epsilon`.
    """
    return _elementwise(_slope, "v_star", v_star, _SPEEDS)


def v_star_from(epsilon: Values | None = None, *, one_minus_epsilon: Values | None = None) -> Values:
    """Return the v* whose coefficient of restitution is `epsilon`.

    Parameters
    ----------
    epsilon : float or array
        From 0, where v* is infinite, to 1.
    one_minus_epsilon : float or array
        In place of epsilon, because a double near 1 has few digits of 1 - epsilon.

    Returns
    -------
    float or array

    Raises
    ------
    TypeError
        If not exactly one of the two is given, or it is not made of real numbers.
    ValueError
        If a number is below 0, above 1 or NaN.
    """
    # 1 - x is exact for x >= 1/2; so the smaller of eps and 1 - eps is always known exactly.
    if epsilon is not None and one_minus_epsilon is None:
        return _elementwise(lambda e: _inverse(np.minimum(e, 1 - e), e > 0.5), "epsilon", epsilon, _PORTIONS)
    if one_minus_epsilon is not None and epsilon is None:
        return _elementwise(
            lambda d: _inverse(np.minimum(d, 1 - d), d <= 0.5), "one_minus_epsilon", one_minus_epsilon, _PORTIONS
        )
    given = "neither" if epsilon is None else "both"
    raise TypeError(f"epsilon and one_minus_epsilon: {given} given, expected exactly one of them")


# --- polynomials ------------------------------------------------------------------------------------------------------


@lru_cache(maxsize=1)
def _rows() -> FloatArray:
    """Return the rows of all functions on all panels, number panel + PANELS (index in NAMES).

    The first two columns together are the coefficient of z^0; those of z, z^2, … follow.
    """
    found = [panels.rows()[name, panel] for name in NAMES for panel in range(PANELS)]
    numbers = [(float(row.a[0]), row.a[0] - int(float(row.a[0])), *row.a[1:]) for row in found]
    return np.ldexp(np.array(numbers, dtype=np.float64), [[row.exponent] for row in found])


@lru_cache(maxsize=1)
def _columns() -> tuple[FloatArray, ...]:
    return tuple(np.ascontiguousarray(_rows().T))


def _parts(row: IntArray, z: FloatArray) -> tuple[FloatArray, FloatArray]:
    """Return polynomials' values as unrounded sums of two parts; the second is much smaller, or the first is 0."""
    high, low, *powers = _columns()
    total = powers[-1][row]
    for coefficient in powers[-2::-1]:
        total = total * z + coefficient[row]
    return high[row], low[row] + z * total


def _log_derivative(row: IntArray, place: Place) -> tuple[FloatArray, FloatArray, FloatArray]:
    """Return the two parts of `_parts`, and the derivative with respect to ln v*."""
    (high, low, *powers), z = _columns(), place.z
    total, change = powers[-1][row], np.zeros_like(z)
    for coefficient in powers[-2::-1]:
        change = change * z + total
        total = total * z + coefficient[row]
    return high[row], low[row] + z * total, (total + z * change) * (place.s / HALF_WIDTHS[place.panel])


def _value(function: int, place: Place) -> FloatArray:
    high, rest = _parts(place.panel + PANELS * function, place.z)
    return high + rest


def _of_v_star(function: int, v_star: Values) -> Values:
    """Evaluate a function of the table: by the extension or by NumPy, which operate in the same order."""
    if extension is None:
        return _elementwise(lambda v: _by_numpy(function, v), "v_star", v_star, _SPEEDS)
    return checked.elementwise(lambda v: _compiled(function, v), "v_star", v_star, _SPEEDS)


def _compiled(function: int, v_star: FloatArray) -> FloatArray:
    result = np.empty(v_star.shape)
    extension.panels(function, _rows(), np.require(v_star, requirements=["C", "A"]), result)
    return result


def _by_numpy(function: int, v_star: FloatArray) -> FloatArray:
    place = place_of(np.minimum(v_star, 2.0**FOLD) if function == _LOSS else v_star)
    value = _value(function, place)
    if function == _TAU_C:
        value += _LOG_PERIOD * place.folds * _value(_X_MAX, place)
    return np.ldexp(value, _POWERS[function] * place.folds)


def _slope(v_star: FloatArray) -> FloatArray:
    place = place_of(v_star)
    elastic = place.s < 0.5
    *_, change = _log_derivative(place.panel + PANELS * np.where(elastic, _LOSS, _EPSILON), place)
    return np.where(elastic, 0 - change, change) / _value(_EPSILON, place)


# --- inverse ----------------------------------------------------------------------------------------------------------


def _inverse(small: FloatArray, elastic: npt.NDArray[np.bool_]) -> FloatArray:
    """Return v*, given the smaller of 1 - eps (where elastic) and eps, which is at most 1/2."""
    limit = np.where(elastic, 0.0, np.inf)
    # If `small` is tiny, v* is a power of it: it is scaled out of the range of subnormal numbers, and back.
    tiny = small < _TINY
    scale = np.where(tiny, np.where(elastic, 2.0**-200, 2.0**120), 1.0)
    wanted = np.where(small == 0, 0.25, np.where(tiny, small * 2.0**400, small))
    v_star = _first_guess(wanted, elastic)
    if extension is not None:
        extension.inverse(_rows(), wanted, elastic, v_star)
    else:
        for _ in range(_NEWTON_STEPS):
            v_star = _newton(v_star, wanted, elastic)
    return np.where(small == 0, limit, scale * v_star)


def _first_guess(small: FloatArray, elastic: npt.NDArray[np.bool_]) -> FloatArray:
    """Interpolate ln v* between the panels' centres, to three digits."""
    log_odds = np.log(small) - np.log1p(-small)
    return np.exp(np.interp(np.where(elastic, log_odds, -log_odds), *_nodes()))


@lru_cache(maxsize=1)
def _nodes() -> tuple[FloatArray, FloatArray]:
    """Return ln((1 - eps)/eps) and ln v* at the panels' centres and at two points far away."""
    high = _rows()[:, 0].reshape(len(NAMES), PANELS)[:, 1:]
    log_odds, log_v = np.log(high[_LOSS] / high[_EPSILON]), np.log(CENTRES[1:])
    log_odds = np.concatenate([log_odds[:1] - 2 * _FAR, log_odds, log_odds[-1:] + 10 / 3 * _FAR])
    return log_odds, np.concatenate([log_v[:1] - _FAR, log_v, log_v[-1:] + _FAR])


def _newton(v_star: FloatArray, wanted: FloatArray, elastic: npt.NDArray[np.bool_]) -> FloatArray:
    place = place_of(v_star)
    row = place.panel + PANELS * np.where(elastic, _LOSS, _EPSILON)
    scale = np.ldexp(1.0, -10 * place.folds)  # 1 where elastic
    high, rest, change = _log_derivative(row, place)
    residual = (wanted - scale * high) - scale * rest
    return v_star + v_star * (residual / (scale * change))


# --- arrays -----------------------------------------------------------------------------------------------------------


def _elementwise(function: Callable[[FloatArray], FloatArray], name: str, values: Values, accepted: Accepted) -> Values:
    """Apply `function` block by block to checked values: a number gives a float, an array an array."""
    return checked.elementwise(lambda array: _in_blocks(function, array), name, values, accepted)


def _in_blocks(function: Callable[[FloatArray], FloatArray], array: FloatArray) -> FloatArray:
    flat = array.ravel()
    result = np.empty_like(flat)
    with np.errstate(under="ignore"):
        for start in range(0, flat.size, _BLOCK):
            result[start : start + _BLOCK] = function(flat[start : start + _BLOCK])
    return result.reshape(array.shape)


def exact_of_speed(speed: FloatArray, beta: FloatArray) -> tuple[FloatArray, FloatArray]:
    """Return eps and 1 - eps at speeds and betas, to 1 and 3 units in the last place (sampled).

    v* is computed in long double where that is wider than double; the slope of eps corrects for its rounding to double.
    """
    wide = np.sqrt(beta.astype(np.longdouble)) * np.power(speed.astype(np.longdouble), np.longdouble(1) / 10)
    v_star = wide.astype(np.float64)
    change = ((wide - v_star) / v_star).astype(np.float64) * np.asarray(slope(v_star))
    eps = np.asarray(epsilon(v_star))
    return eps * (1 + change), np.asarray(one_minus_epsilon(v_star)) - eps * change
