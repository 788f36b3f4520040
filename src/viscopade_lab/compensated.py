r"""Compensated Horner rule: a polynomial in double precision with the accuracy of twice the precision, and its bound.

A sum and a product of two doubles differ from the rounded result by a double, which six and seventeen operations find
(`two_sum`, after Knuth, and `two_product`, after Dekker and Veltkamp: no FMA is needed). Horner's rule
that adds up these differences as a second polynomial is compensated Horner (Graillat, Langlois, Louvet). With

    u = 2^-53,    gamma_k = k u/(1 - k u),    size = sum |c_k| |x|^k    (degree n),

and as long as nothing overflows or underflows,

    Horner:                                      |computed - p(x)| <= gamma_{2n} size,
    compensated:                                 |computed - p(x)| <= u |p(x)| + gamma_{2n}^2 size,
    compensated, coefficients in two doubles:    |computed - p(x)| <= u |p(x)| + gamma_{2n+2}^2 size.

The third is the second with c_k = high_k + low_k (1 + delta), |low_k| <= u |high_k|, |delta| <= u. The second
polynomial then has the coefficients pi_k + sigma_k + low_k, whose sizes add up to gamma_{2n} size + u size, at most
gamma_{2n+1} size. Two additions make each of them, and Horner's rule adds 2 n - 1 roundings at most, so the second
polynomial is wrong by gamma_{2n+1}^2 size; the last addition rounds once, and low_k leaves u^2 size of c_k.
"""

from __future__ import annotations

from fractions import Fraction

import numpy as np
import numpy.typing as npt
from flint import arb

from viscopade.arithmetic.balls import ball_of

FloatArray = npt.NDArray[np.float64]

UNIT = Fraction(1, 2**53)
SPLITTER = 2.0**27 + 1


def two_sum(x: FloatArray, y: FloatArray) -> tuple[FloatArray, FloatArray]:
    """Return the rounded sum s = fl(x + y) and its error e, with s + e = x + y exactly."""
    s = x + y
    part = s - x
    return s, (x - (s - part)) + (y - part)


def split(x: FloatArray) -> tuple[FloatArray, FloatArray]:
    """Return the halves of x = high + low, short enough that their products are exact; |x| < 2^996."""
    scaled = SPLITTER * x
    high = scaled - (scaled - x)
    return high, x - high


def two_product(x: FloatArray, y: FloatArray) -> tuple[FloatArray, FloatArray]:
    """Return the rounded product p = fl(x y) and its error e: p + e = x y exactly, but for overflow and underflow."""
    p = x * y
    (x_high, x_low), (y_high, y_low) = split(x), split(y)
    return p, x_low * y_low - (((p - x_high * y_high) - x_low * y_high) - x_high * y_low)


def compensated_horner(c: FloatArray, x: FloatArray, low: FloatArray | None = None) -> FloatArray:
    """Return sum c_k x^k for ascending coefficients c, with an error as in the module's bounds.

    Parameters
    ----------
    c : array
        At least one coefficient.
    x : array
    low : array like c, optional
        What the coefficients have beyond double precision, rounded to double.
    """
    value = np.full_like(x, c[-1])
    correction = np.full_like(x, 0.0 if low is None else low[-1])
    for k in range(len(c) - 2, -1, -1):
        product, lost = two_product(value, x)
        value, also_lost = two_sum(product, np.full_like(x, c[k]))
        lost = lost + also_lost
        correction = correction * x + (lost if low is None else lost + low[k])
    return value + correction


def gamma(k: int) -> Fraction:
    """Return gamma_k = k u/(1 - k u), the bound of k successive relative errors; u is the unit roundoff."""
    return k * UNIT / (1 - k * UNIT)


def plain_bound(degree: int, size: arb) -> arb:
    """Bound the error of Horner's rule; `size` is sum |c_k| |x|^k."""
    return ball_of(gamma(2 * degree)) * size


def bound(degree: int, value: arb, size: arb, *, two_doubles: bool = False) -> arb:
    """Bound the error of `compensated_horner`, p(x) being `value`; `two_doubles` where coefficients had low parts."""
    operations = 2 * degree + (2 if two_doubles else 0)
    return ball_of(UNIT) * abs(value) + ball_of(gamma(operations) ** 2) * size
