r"""The exact functions eps(v*), x_max(v*), tau_c(v*) and v*(eps) in double precision, on NumPy arrays.

eps is the coefficient of restitution of two viscoelastic spheres, the ratio of their speeds after and before impact;
v* = beta^(1/2) v^(1/10) is the scaled speed of impact, x_max the largest compression and tau_c the duration of contact.

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
from typing import NamedTuple

import numpy as np
import numpy.typing as npt

from viscopade.arrays import checked, panels
from viscopade.arrays.checked import Accepted, FloatArray, Values
from viscopade.arrays.panels import CENTRES, FOLD, HALF_WIDTHS, NAMES, PANELS, IntArray, Place, place_of
from viscopade.compiled import extension

# Largest error in units in the last place, sampled at more than 10,000 points that include the hard ends.
ULP = {"epsilon": 1.0, "one_minus_epsilon": 3.0, "x_max": 1.0, "tau_c": 2.5, "v_star_from": 2.5}


_EPSILON, _LOSS, _X_MAX, _TAU_C = range(len(NAMES))  # the functions, in the order of the table
_POWERS = (-10, 0, -4, -4)  # of 2 in each function for each fold, as above; 1 - eps does not fold (`_in_numpy`)

# L of tau_c, in tau_c(8 s) = 2^(-4) (tau_c(s) + L x_max(s)). For large v*, tau_c/x_max = (4/3) lambda + a constant, and
# lambda = (10/3) ln v* + … (derivations/10_large_v_star.py): (4/3)(10/3) = 40/9 of ln 8 for each fold.
_LOG_PERIOD = 40 / 9 * math.log(8)
# Values at once, so that all that belongs to them stays in the cache: measured for `epsilon` without the extension, 24
# to 27 ns a value with blocks of 2^12 to 2^18, 52 ns with one block of 2^21.
_BLOCK = 1 << 13
# The first guess has three digits, and each step doubles them. Measured: relative errors of 1e-3, 5e-7, 1e-13, 2e-16.
_NEWTON_STEPS = 3
# How far in ln v* the first guess goes beyond the table. A choice: `_inverse` needs ln v* from -234 to 141.
_FAR = 300.0
# eps or 1 - eps below it is a power of v*, and may be scaled. A choice, far above the subnormal numbers from 2^-1022
# on.
_TINY = 2.0**-500

_SPEEDS = Accepted("a number >= 0, or inf", lambda x: x >= 0)
_PORTIONS = Accepted("a number >= 0 and <= 1", lambda x: (x >= 0) & (x <= 1))


def epsilon(v_star: Values) -> Values:
    """Return the coefficient of restitution eps(v*) (the paper's Eq. 5).

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
    return _function_of_v_star(_EPSILON, v_star)


def one_minus_epsilon(v_star: Values) -> Values:
    """Return 1 - eps(v*), without the cancellation at small v*; arguments and errors as for `epsilon`."""
    return _function_of_v_star(_LOSS, v_star)


def x_max(v_star: Values) -> Values:
    """Return the maximal compression in units of `Pair.length_scale`; arguments and errors as for `epsilon`."""
    return _function_of_v_star(_X_MAX, v_star)


def tau_c(v_star: Values) -> Values:
    """Return the contact's duration in units of `Pair.time_scale`; arguments and errors as for `epsilon`.

    The contact ends where the force vanishes (the paper's Eq. 6).
    """
    return _function_of_v_star(_TAU_C, v_star)


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
    # `_inverse` takes the smaller of eps and 1 - eps, and whether that is 1 - eps (eps > 0.5). 1 - x is exact for
    # 1/2 <= x <= 1 (Sterbenz), so the smaller one is exact, too.
    if epsilon is not None and one_minus_epsilon is None:
        return _elementwise(lambda e: _inverse(np.minimum(e, 1 - e), e > 0.5), "epsilon", epsilon, _PORTIONS)
    if one_minus_epsilon is not None and epsilon is None:
        return _elementwise(
            lambda d: _inverse(np.minimum(d, 1 - d), d <= 0.5), "one_minus_epsilon", one_minus_epsilon, _PORTIONS
        )
    number = "neither" if epsilon is None else "both"
    raise TypeError(f"epsilon and one_minus_epsilon: {number} given, expected exactly one of them")


# --- polynomials ------------------------------------------------------------------------------------------------------


@lru_cache(maxsize=1)
def _rows() -> FloatArray:
    """Return the rows of all functions on all panels, number panel + PANELS (index in NAMES).

    The first two columns, high and low, together are the coefficient of z^0; those of z, z^2, … follow.
    """
    rows = [panels.rows()[name, panel] for name in NAMES for panel in range(PANELS)]
    # a_0 is an integer of up to 66 bits: the nearest double, and what remains.
    integers = [(float(row.a[0]), row.a[0] - int(float(row.a[0])), *row.a[1:]) for row in rows]
    return np.ldexp(np.array(integers, dtype=np.float64), [[row.exponent] for row in rows])


@lru_cache(maxsize=1)
def _columns() -> tuple[FloatArray, ...]:
    """Return the columns of `_rows`: high, low and the coefficients of z, z^2, …, each an array over rows."""
    return tuple(np.ascontiguousarray(_rows().T))


def _value(function: int, place: Place) -> FloatArray:
    """Return a function of the table, by its index, at the s of a place: not yet at v* = 8^folds s."""
    row = place.panel + PANELS * function
    high, low, *powers = _columns()
    # f = high + (low + z p(z)), p(z) = a_1 + a_2 z + … by Horner's rule. The part in brackets is much smaller than high
    # (or high is 0), so that only the last sum rounds the result.
    p = powers[-1][row]
    for coefficient in powers[-2::-1]:
        p = p * place.z + coefficient[row]
    return high[row] + (low[row] + place.z * p)


class _Expansion(NamedTuple):
    """A function's value at s, as a sum that is not rounded, and its derivative with respect to ln v*."""

    high: FloatArray
    rest: FloatArray
    """What the value has beyond `high`, much smaller."""
    log_derivative: FloatArray


def _expansion(row: IntArray, place: Place) -> _Expansion:
    """Return functions of the table, given by their rows, at the s of a place: not yet at v* = 8^folds s."""
    (high, low, *powers), z = _columns(), place.z
    # f = high + (low + z p(z)); Horner's rule for p = a_1 + a_2 z + … gives its derivative dp on the way.
    p, dp = powers[-1][row], np.zeros_like(z)
    for coefficient in powers[-2::-1]:
        dp = dp * z + p
        p = p * z + coefficient[row]
    # df/d ln v* = df/d ln s = s df/dz dz/ds, df/dz = p + z dp, dz/ds = 1/(half width)
    return _Expansion(high[row], low[row] + z * p, (p + z * dp) * (place.s / HALF_WIDTHS[place.panel]))


def _function_of_v_star(function: int, v_star: Values) -> Values:
    """Evaluate a function of the table: by the extension or by NumPy, which operate in the same order."""
    if extension is None:
        return _elementwise(lambda v: _in_numpy(function, v), "v_star", v_star, _SPEEDS)
    return checked.elementwise(lambda v: _compiled(function, v), "v_star", v_star, _SPEEDS)


def _compiled(function: int, v_star: FloatArray) -> FloatArray:
    """Return a function of the table at v*, by the extension."""
    result = np.empty(v_star.shape)
    extension.panels(function, _rows(), np.require(v_star, requirements=["C", "A"]), result)
    return result


def _in_numpy(function: int, v_star: FloatArray) -> FloatArray:
    """Return a function of the table, by its index, at v* >= 0 or inf, by NumPy.

    eps and 1 - eps are pure numbers, x_max and tau_c in units of `Pair.length_scale` and `Pair.time_scale`.
    """
    # 1 - eps is 1 to double precision from 2^FOLD on: there eps is below 2^-66.
    place = place_of(np.minimum(v_star, 2.0**FOLD) if function == _LOSS else v_star)
    value = _value(function, place)
    # With v* = 8^n s: tau_c(v*) = 2^(-4 n) (tau_c(s) + n L x_max(s)), and the others are 2^(power n) f(s).
    if function == _TAU_C:
        value += _LOG_PERIOD * place.folds * _value(_X_MAX, place)
    return np.ldexp(value, _POWERS[function] * place.folds)


def _slope(v_star: FloatArray) -> FloatArray:
    """Return d ln eps/d ln v*."""
    place = place_of(v_star)
    # d ln eps/d ln v* = (d eps/d ln v*)/eps = -(d (1 - eps)/d ln v*)/eps. For large v* the row of 1 - eps has lost the
    # digits of the derivative; up to v* = 5 both rows give the same (measured: to 5e-16), so any end below serves.
    elastic = place.s < 0.5
    # 0 - x, because -x would be -0.0 at v* = 0.
    derivative = _expansion(place.panel + PANELS * np.where(elastic, _LOSS, _EPSILON), place).log_derivative
    return np.where(elastic, 0 - derivative, derivative) / _value(_EPSILON, place)


# --- inverse ----------------------------------------------------------------------------------------------------------


def _inverse(small: FloatArray, elastic: npt.NDArray[np.bool_]) -> FloatArray:
    """Return v*, given the smaller of 1 - eps (where elastic) and eps, which is at most 1/2."""
    # If `small` is tiny, v* is a power of it: 1 - eps ~ v*^2, eps ~ v*^(-10/3). So 2^400 `small`, which is no subnormal
    # number (400 is a choice: a multiple of 2 and of 10/3), belongs to 2^200 v*, or to 2^-120 v*. Even 2^400 _TINY =
    # 2^-100 belongs to v* < 2^-49, or to v* > 2^29, where the powers hold to double precision.
    tiny = small < _TINY
    scale = np.where(tiny, np.where(elastic, 2.0**-200, 2.0**120), 1.0)
    # At 0, where v* is 0 or infinite, any number will do for the computation, such as 0.25.
    portion = np.where(small == 0, 0.25, np.where(tiny, small * 2.0**400, small))

    # Newton's method, in the extension or here.
    v_star = _first_guess(portion, elastic)
    if extension is not None:
        extension.inverse(_rows(), portion, elastic, v_star)
    else:
        for _ in range(_NEWTON_STEPS):
            v_star = _newton(v_star, portion, elastic)
    limit = np.where(elastic, 0.0, np.inf)
    return np.where(small == 0, limit, scale * v_star)


def _first_guess(small: FloatArray, elastic: npt.NDArray[np.bool_]) -> FloatArray:
    """Interpolate ln v* between the panels' centres, to three digits; arguments as for `_inverse`."""
    # log_odds = ln(small/(1 - small)) is ln((1 - eps)/eps), or where not elastic its negative.
    log_odds = np.log(small) - np.log1p(-small)
    return np.exp(np.interp(np.where(elastic, log_odds, -log_odds), *_nodes()))


@lru_cache(maxsize=1)
def _nodes() -> tuple[FloatArray, FloatArray]:
    """Return ln((1 - eps)/eps) and ln v* at the panels' centres and at two points far away."""
    # At a panel's centre, z = 0, `high` is the function's value. Panel 0 is left out: ln v* is infinite there.
    high = _rows()[:, 0].reshape(len(NAMES), PANELS)[:, 1:]
    log_odds, log_v = np.log(high[_LOSS] / high[_EPSILON]), np.log(CENTRES[1:])
    # Beyond the ends of the table ln((1 - eps)/eps) is linear in ln v*, with the slopes 2 and 10/3.
    log_odds = np.concatenate([log_odds[:1] - 2 * _FAR, log_odds, log_odds[-1:] + 10 / 3 * _FAR])
    return log_odds, np.concatenate([log_v[:1] - _FAR, log_v, log_v[-1:] + _FAR])


def _newton(v_star: FloatArray, portion: FloatArray, elastic: npt.NDArray[np.bool_]) -> FloatArray:
    """Return v* after a step of Newton's method for f(v*) = portion, f being 1 - eps where elastic, and else eps.

    `v_star` is the guess, and `portion` between 0 and 1/2.
    """
    place = place_of(v_star)
    row = place.panel + PANELS * np.where(elastic, _LOSS, _EPSILON)
    # f(v*) = scale (high + rest), with v* = 8^n s and eps(v*) = 2^(-10 n) eps(s); n = 0 where elastic.
    scale = np.ldexp(1.0, -10 * place.folds)
    high, rest, log_derivative = _expansion(row, place)
    # The first difference is exact near the solution, as both numbers are nearly equal.
    residual = (portion - scale * high) - scale * rest
    # d v* = v* d ln v* = v* residual/(df/d ln v*)
    return v_star + v_star * (residual / (scale * log_derivative))


# --- arrays -----------------------------------------------------------------------------------------------------------


def _elementwise(function: Callable[[FloatArray], FloatArray], name: str, values: Values, accepted: Accepted) -> Values:
    """Apply `function` block by block to checked values: a number gives a float, an array an array."""
    return checked.elementwise(lambda array: _in_blocks(function, array), name, values, accepted)


def _in_blocks(function: Callable[[FloatArray], FloatArray], array: FloatArray) -> FloatArray:
    """Apply a function to `_BLOCK` numbers at a time; the result has the array's shape."""
    flat = array.ravel()
    result = np.empty_like(flat)
    with np.errstate(under="ignore"):  # results below the smallest double are 0, as documented
        for start in range(0, flat.size, _BLOCK):
            result[start : start + _BLOCK] = function(flat[start : start + _BLOCK])
    return result.reshape(array.shape)


def exact_of_speed(speed: FloatArray, beta: FloatArray) -> tuple[FloatArray, FloatArray]:
    """Return eps and 1 - eps at speeds and betas, to 1 and 3 units in the last place (sampled).

    v* is computed in long double where that is wider than double; the slope of eps corrects for its rounding to double.

    Parameters
    ----------
    speed, beta : array
        Speeds of impact v, and beta of v* = beta^(1/2) v^(1/10), in a unit of v^(-1/5); both positive.
    """
    # v* = beta^(1/2) v^(1/10), where a long double has 64 bits or more in place of 53 (or the same)
    wide = np.sqrt(beta.astype(np.longdouble)) * np.power(speed.astype(np.longdouble), np.longdouble(1) / 10)
    v_star = wide.astype(np.float64)
    # The relative change of eps from v* to the wide v*: d ln eps = slope d ln v*. 1 - eps changes by -eps d ln eps.
    change = ((wide - v_star) / v_star).astype(np.float64) * np.asarray(slope(v_star))
    eps = np.asarray(epsilon(v_star))
    return eps * (1 + change), np.asarray(one_minus_epsilon(v_star)) - eps * change
