r"""Half-line approximants of eps: lacunary quotients for every v* >= 0, with both limits right by structure.

With kappa = v*^2 and y = v*^(1/3),

    eps = D(y)/(D(y) + v*^2 N(y)),    that is    1/eps - 1 = v*^2 N(y)/D(y),

N and D lacunary polynomials, deg N = deg D + 4. Since 1/eps - 1 behaves like c v*^2 at 0 and like
(2/3)^(2/3) v*^(10/3) at infinity, N/D goes from c to (2/3)^(2/3) y^4. It needs no further root: code that computes
v* = w^(1/10), w = beta^5 v, gets y = w^(1/30) by the same operation; for a known v*, y is a cube root. A search among
these and many other forms gave the powers of y (docs/reference/kernels.md). If N/D has a relative error delta, then

    |d eps| = |delta| eps (1 - eps):    |d eps|/eps <= |delta| (1 - eps),    |d eps|/(1 - eps) <= |delta| eps,

to first order in delta, so that the error relative to the smaller of eps and 1 - eps is bounded. It is levelled and
stated to this order (sampled).
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
from viscopade.arrays import double

ROOT = Fraction(1, 3)  # y = v*^ROOT: the head says why a cube root
SHIFT = 6  # v*^2 = y^SHIFT
DEGREES_MORE = 4  # deg N - deg D, as N/D goes like y^4 to infinity

# Stands for infinity: N/(y^4 D) of the quotients below differs there, at v* = 8e9, by less than 1e-23 from its limit
# (measured), and their errors are above 1e-8.
_Y_MAX = 2000.0

# The best powers in the search for 4, 5, … coefficients (docs/reference/kernels.md: all powers up to 26 for five
# coefficients, a local search beyond).
BEST = (
    Powers((0, 6, 15), (0, 11)),
    Powers((0, 9, 19), (0, 6, 15)),
    Powers((0, 6, 8, 19), (0, 6, 15)),
    Powers((0, 4, 12, 19), (0, 4, 6, 8, 15)),
    Powers((0, 6, 12, 18, 25), (0, 9, 12, 14, 21)),
    Powers((0, 6, 12, 18, 19, 27), (0, 9, 12, 15, 23)),
    Powers((0, 6, 12, 13, 17, 18, 26), (0, 6, 8, 9, 10, 22)),
)


def require_half_line_degrees(powers: Powers) -> None:
    """Check that N/D with these powers has the right order at infinity; raise a ValueError otherwise."""
    if powers.m - powers.n != DEGREES_MORE:
        raise ValueError(
            f"powers are {powers.label}: expected deg N = deg D + {DEGREES_MORE}, because eps behaves like v*^(-10/3)"
        )


@lru_cache(maxsize=64)  # a choice, for searches over powers
def fit_half_line(powers: Powers) -> LacunaryFit:
    """Return the best N/D with given powers of y = v*^(1/3).

    Parameters
    ----------
    powers : Powers
        Exponents, deg N = deg D + 4.

    Raises
    ------
    ValueError
        If the degrees are wrong.
    remez.NoBest
        If the error cannot be levelled.
    """
    require_half_line_degrees(powers)

    def values(y: arb) -> tuple[arb, arb]:
        """Return the target (1/eps - 1)/(c v*^2), and the factor max(eps, 1 - eps).

        The factor leads from its relative error to that of the smaller one of eps and 1 - eps. c = `loss_limit()` makes
        the target 1 at 0.
        """
        epsilon, loss, loss_ratio = target(y * y * y)
        return loss_ratio / epsilon / loss_limit(), max(epsilon, loss)

    # The factor c = `loss_limit()` returns into N. The coordinate of the half-line is y/(1 + y), from 0 to nearly 1;
    # the sample gives the first guess.
    return lawson.best(powers, values, _Y_MAX, Coordinate(half_line=True), loss_limit(), half_line_sample())


@lru_cache(maxsize=1)
def half_line_sample() -> Sample:
    """Return target and weight at points dense enough for rough fits."""
    # v* from 0.004 to 1e5, with 12 slow and 22 fast ones, which are choices: measured for the powers above, the errors
    # on a grid 30 times finer are at most 4 % larger, and a first guess needs no more.
    v_star = lawson.dense_speeds(12, 22)
    epsilon, loss = double.epsilon(v_star), double.one_minus_epsilon(v_star)
    return Sample(np.cbrt(v_star), loss / epsilon / (float(loss_limit()) * v_star**2), np.maximum(epsilon, loss))
