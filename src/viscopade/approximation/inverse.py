r"""Minimax approximants of the inverse, eps -> v*, on (0, 1].

eps is the coefficient of restitution and v* the scaled speed of impact at which it occurs.
The variable is q = (1 - eps)/eps, from 0 at eps = 1 to infinity at eps = 0, which needs 1 - eps for eps near 1.
v* is sqrt(q) times a smooth function of sqrt(q) near 0, and behaves like q^(3/10) at infinity. So

    v* = y^5 N(y)/D(y),    y = q^(1/10), lacunary polynomials, deg D = deg N + 2.

The relative error of v* is levelled, down to v* = 0; kappa = v*^2, beta = v*^2/v^(1/5) and the dissipative constant A
have twice that error. In the variable sqrt(1 - eps) the same accuracy takes one to four coefficients more
(docs/reference/kernels.md). Errors are sampled.
"""

from __future__ import annotations

from fractions import Fraction
from functools import lru_cache

import numpy as np
from flint import arb

from viscopade.approximation import lawson
from viscopade.approximation.lacunary import Powers
from viscopade.approximation.lawson import LacunaryFit, Sample
from viscopade.approximation.remez import Coordinate
from viscopade.approximation.target import loss_limit, target
from viscopade.arithmetic.balls import working
from viscopade.arrays import double

# Stands for infinity: y^2 N/D of the quotients below differs there, at q = 1e33, by less than 1e-16 from its limit
# (measured), and their errors are above 1e-8.
_Y_MAX = 2000.0

# The best powers of q^(1/10) in a search for 4, 5, … coefficients.
BEST = (
    Powers((0, 16), (0, 10, 18)),
    Powers((0, 10, 16), (0, 11, 18)),
    Powers((0, 24), (0, 11, 15, 17, 26)),
    Powers((0, 13, 15, 22), (0, 10, 13, 16, 24)),
    Powers((0, 12, 13, 14, 22), (0, 10, 14, 15, 24)),
    Powers((0, 15, 18, 23, 27), (0, 10, 17, 18, 20, 25, 29)),
    Powers((0, 9, 12, 20, 23, 27), (0, 10, 12, 18, 20, 22, 25, 29)),
)


ROOT, SHIFT = Fraction(1, 10), 5
"""v* = y^SHIFT N(y)/D(y), y = ((1 - eps)/eps)^ROOT."""
DEGREES_LESS = 2
"""Deg D - deg N, because v* goes like y^3 for large y."""


@lru_cache(maxsize=256)  # a choice, for searches over powers
def fit_inverse(powers: Powers) -> LacunaryFit:
    """Return the best N(y)/D(y) of v* = y^5 N/D, y = ((1 - eps)/eps)^(1/10).

    Parameters
    ----------
    powers : Powers
        Exponents, deg D = deg N + 2.

    Raises
    ------
    ValueError
        If the degrees are wrong.
    remez.NoBest
        If the error cannot be levelled.
    """
    if powers.n - powers.m != DEGREES_LESS:
        raise ValueError(
            f"powers are {powers.label}: expected deg D = deg N + {DEGREES_LESS}, because v* behaves like q^(3/10)"
        )
    # `loss_limit` is c, the limit of (1 - eps)/v*^2 at 0. v* = (q/c)^(1/2) (1 + …), and q^(1/2) = y^5: the factor
    # c^(-1/2) leaves a target that is 1 at 0.
    with working(lawson.BITS):
        factor = 1 / loss_limit().root(2)
    return lawson.best(powers, _values, _Y_MAX, Coordinate(half_line=True), factor, inverse_sample())


def _values(y: arb) -> tuple[arb, arb]:
    """Return v* (c/q)^(1/2), 1 at 0, with the weight 1; c = (1 - eps)/v*^2 at 0."""
    if y == 0:
        return arb(1), arb(1)
    q = y ** (SHIFT * 2)  # q^(1/2) = y^SHIFT
    return _v_star(q.mid()) * (loss_limit() / q).root(2), arb(1)


def _v_star(q: arb) -> arb:
    """Return v* at (1 - eps)/eps = q: double precision, then a step of Newton's method on ln q."""
    # eps = 1/(1 + q) and 1 - eps = q/(1 + q): the smaller one has all digits.
    near = float(q)  # q > 1 where eps < 1/2
    start = double.v_star_from(1 / (1 + near)) if near > 1 else double.v_star_from(one_minus_epsilon=near / (1 + near))
    # ln q = ln(1 - eps) - ln eps has the slope d ln q/d ln v* = -(d ln eps/d ln v*)/(1 - eps). With the 16 digits of
    # the start, one step has as many as `target`.
    slope = -double.slope(float(start)) / float(double.one_minus_epsilon(start))
    epsilon, loss, _ = target(arb(start))
    # ln v* = ln start + (ln q - ln(loss/eps))/slope. The difference of the logarithms is about 1e-16, so that 1 + x is
    # its exponential to 30 digits.
    return (arb(start) * (1 + (q * epsilon / loss).log() / slope)).mid()


@lru_cache(maxsize=1)
def inverse_sample() -> Sample:
    """Return the target at points dense enough for rough fits."""
    # v* from 0.004 to 1e5, with 15 slow and 18 fast ones, which are choices: measured for the powers above, the errors
    # on a grid 30 times finer are at most 6 % larger, and a first guess needs no more.
    v_star = lawson.dense_speeds(15, 18)
    q = double.one_minus_epsilon(v_star) / double.epsilon(v_star)
    # y = q^ROOT, the target v* (c/q)^(1/2), and the weight 1
    return Sample(q**0.1, v_star * np.sqrt(float(loss_limit()) / q), np.ones_like(q))
