r"""Minimax approximants of the inverse, eps -> v*, on [eps_min, 1] or on all of (0, 1].

The variable is q = (1 - eps)/eps, from 0 at eps = 1 to infinity at eps = 0, which needs 1 - eps where eps is near 1.
v* is sqrt(q) times a smooth function of sqrt(q) near 0, and goes like q^(3/10) at infinity (section 2.5). So

    on [eps_min, 1]:    v* = y N(y)/D(y),      y = q^(1/2), full polynomials;
    on (0, 1]:          v* = y^5 N(y)/D(y),    y = q^(1/10), lacunary polynomials, deg D = deg N + 2.

The relative error of v* is levelled, down to v* = 0; kappa = v*^2, beta = v*^2/v^(1/5) and the dissipative constant A
have twice that error. In the variable sqrt(1 - eps) the same accuracy takes one to four coefficients more
(src/viscopade_lab/studies/half_line_search.py). Errors are sampled, in double precision, for coefficients that are
doubles.
"""

from __future__ import annotations

from dataclasses import dataclass
from fractions import Fraction
from functools import lru_cache

import numpy as np
from flint import arb

from viscopade import arguments
from viscopade.approximation import lacunary, remez
from viscopade.approximation.lacunary import (
    LacunaryQuotient,
    Powers,
    Sample,
    evaluated,
    mirrored,
)
from viscopade.approximation.target import TABLE_DIGITS, exact_target
from viscopade.arithmetic.balls import working
from viscopade.arrays import double
from viscopade.arrays.checked import FloatArray
from viscopade.collision.exact import Exact

HALF = Fraction(1, 2)  # v* ~ q^HALF near 0
INTERVAL_ROOT, WHOLE_ROOT = Fraction(1, 2), Fraction(1, 10)
DEGREES_LESS = 2  # deg D - deg N on (0, 1]: v* ~ y^5 y^-2 = q^(3/10)
MORE_DIGITS = 25
MAX_DEGREE = 9

_Y_MAX = 2000.0  # of q^(1/10): q up to 1e33
_Q_GRID = (1e-60, 1e60)
_BITS = 160
_SMALLEST = Fraction(1, 10**4)

# The best powers of q^(1/10) found for 4, 5, … coefficients, on all of (0, 1].
WHOLE = (
    Powers((0, 16), (0, 10, 18)),
    Powers((0, 10, 16), (0, 11, 18)),
    Powers((0, 24), (0, 11, 15, 17, 26)),
    Powers((0, 13, 15, 22), (0, 10, 13, 16, 24)),
    Powers((0, 12, 13, 14, 22), (0, 10, 14, 15, 24)),
    Powers((0, 15, 18, 23, 27), (0, 10, 17, 18, 20, 25, 29)),
    Powers((0, 9, 12, 20, 23, 27), (0, 10, 12, 18, 20, 22, 25, 29)),
)


@dataclass(frozen=True)
class Inverse:
    """Approximant of the inverse: v* = y^k N(y)/D(y) with y = q^root, q = (1 - eps)/eps, for eps_min <= eps <= 1.

    Attributes
    ----------
    quotient : LacunaryQuotient
        N/D with coefficients that are doubles.
    root : Fraction
        1/2 (full polynomials) or 1/10 (all of (0, 1]); k = 1/(2 root).
    epsilon_min : Fraction
        Where the kernel may be used; 0 for all of (0, 1].
    level : float
        The levelled relative error of the best N/D with these powers (sampled).
    error : float
        The largest relative error of v* (sampled, in double precision).
    points : tuple of float
        The q where the error is largest, with alternating signs.
    """

    quotient: LacunaryQuotient
    root: Fraction
    epsilon_min: Fraction
    level: float
    error: float
    points: tuple[float, ...]

    def __post_init__(self) -> None:
        if self.root not in (INTERVAL_ROOT, WHOLE_ROOT):
            raise ValueError(f"root is {self.root}: accepted is {INTERVAL_ROOT} or {WHOLE_ROOT}")
        if self.epsilon_min == 0:
            require_inverse_degrees(self.quotient.powers)

    @property
    def shift(self) -> int:
        """The exponent k of sqrt(q) = y^k."""
        return int(HALF / self.root)

    def v_star_at(self, q: FloatArray) -> FloatArray:
        """Return v* at q = (1 - eps)/eps in double precision, beyond y = 1 in powers of 1/y."""
        y = np.sqrt(q) if self.root == HALF else q ** float(self.root)
        top, bottom = self.quotient.top, self.quotient.bottom
        small = np.minimum(y, 1)
        with np.errstate(divide="ignore"):
            inverse = np.minimum(1 / y, 1)
        lower = small**self.shift * evaluated(top, small) / evaluated(bottom, small)
        high, low = (evaluated(mirrored(part, part[-1][0]), inverse) for part in (top, bottom))
        large = np.maximum(y, 1) ** float(self.shift + top[-1][0] - bottom[-1][0])
        return np.where(y <= 1, lower, large * high / low)


def require_inverse_degrees(powers: Powers) -> None:
    """Check that N/D with these powers of q^(1/10) has the right order at infinity; raise a ValueError otherwise."""
    if powers.bottom[-1] - powers.top[-1] != DEGREES_LESS:
        raise ValueError(f"powers are {powers.label}: deg D must be deg N + {DEGREES_LESS}, as v* goes like q^(3/10)")


def fit_interval(m: int, n: int, epsilon_min: Exact) -> Inverse:
    """Return the best v* = y N(y)/D(y), y = sqrt((1 - eps)/eps), on [epsilon_min, 1].

    Parameters
    ----------
    m, n : int
        Degrees of N and D, 0 to 9.
    epsilon_min : str, int, float, Fraction, Decimal, mpmath.mpf or NumPy scalar
        From 1e-4 to less than 1, taken exactly.

    Raises
    ------
    TypeError, ValueError
        If an argument is not accepted.
    remez.NoBest
        If there is no best approximant, or the error is too small for double precision.
    """
    m, n = arguments.integer("m", m, 0, MAX_DEGREE), arguments.integer("n", n, 0, MAX_DEGREE)
    low = arguments.exact_number("epsilon_min", epsilon_min, "a number >= 1e-4 and < 1", lambda e: _SMALLEST <= e < 1)
    return _fit_interval(m, n, low)


@lru_cache(maxsize=256)
def _fit_interval(m: int, n: int, low: Fraction) -> Inverse:
    powers = Powers(tuple(range(m + 1)), tuple(range(n + 1)))
    y_max = float(1 / low - 1) ** 0.5
    for digits in (TABLE_DIGITS, MORE_DIGITS):
        try:
            stated = lacunary.lacunary_problem(powers, _target(2, digits), _one, y_max, remez.Coordinate(1.0), digits)
            return _kernel(powers, INTERVAL_ROOT, low, remez.solve(stated))
        except remez.TooAccurate as reason:
            refused = reason
    raise refused


def fit_whole(powers: Powers) -> Inverse:
    """Return the best v* = y^5 N(y)/D(y), y = ((1 - eps)/eps)^(1/10), on all of (0, 1].

    Parameters
    ----------
    powers : Powers
        Exponents, deg D = deg N + 2.

    Raises
    ------
    ValueError
        If the degrees are not accepted.
    remez.NoBest
        If the error cannot be levelled.
    """
    require_inverse_degrees(powers)
    return _fit_whole(powers)


@lru_cache(maxsize=64)
def _fit_whole(powers: Powers) -> Inverse:
    stated = lacunary.lacunary_problem(powers, _target(10, TABLE_DIGITS), _one, _Y_MAX, remez.Coordinate(1.0, True))
    return _kernel(powers, WHOLE_ROOT, Fraction(0), lacunary.best(powers, stated, inverse_sample()))


def _one(_: arb) -> arb:
    return arb(1)


def _target(root: int, digits: int) -> lacunary.Function:
    """Return v* sqrt(c)/sqrt(q) as a function of y = q^(1/root), c = lambda_1; 1 at y = 0."""

    def target(y: arb) -> arb:
        if y == 0:
            return arb(1)
        q = y**root
        c = exact_target(digits).loss_ratio(arb(0))
        return (_v_star(q.mid(), digits) * (c / q).sqrt()).mid()

    return target


def _v_star(q: arb, digits: int) -> arb:
    """Return v* at (1 - eps)/eps = q: double precision, then Newton's method on ln q, with a slope of 12 digits."""
    near = float(q)
    v_star = arb(
        double.v_star_from(1 / (1 + near)) if near > 1 else double.v_star_from(one_minus_epsilon=near / (1 + near))
    )
    for _ in range(1 if digits <= MORE_DIGITS else 2):
        epsilon, loss = exact_target(digits).both(v_star)
        slope = -double.slope(float(v_star)) / float(loss)  # d ln q/d ln v*
        v_star = (v_star * (1 + (q * epsilon / loss).log() / slope)).mid()
    return v_star


def _kernel(powers: Powers, root: Fraction, low: Fraction, found: remez.Approximation) -> Inverse:
    with working(_BITS):
        c = exact_target(TABLE_DIGITS).loss_ratio(arb(0))
        quotient = lacunary.rounded(powers, found, 1 / c.sqrt())
    points = tuple(float(y) ** float(1 / root) for y in found.points)
    bare = Inverse(quotient, root, low, found.error, 0.0, points)
    return Inverse(quotient, root, low, found.error, _error(bare), points)


def _error(given: Inverse) -> float:
    """Return the largest relative error of v* at many points (sampled)."""
    end = float(1 / given.epsilon_min - 1) if given.epsilon_min else _Q_GRID[1]
    q = np.geomspace(_Q_GRID[0], end, 200_001)
    small = q < 1
    v_star = np.empty_like(q)
    v_star[small] = double.v_star_from(one_minus_epsilon=q[small] / (1 + q[small]))
    v_star[~small] = double.v_star_from(1 / (1 + q[~small]))
    return float(np.abs(given.v_star_at(q) / v_star - 1).max())


@lru_cache(maxsize=1)
def inverse_sample() -> Sample:
    """Return the target at points dense enough for rough fits on all of (0, 1]."""
    ends = ((0.004, 0.04, 15), (0.04, 40.0, 111), (40.0, 1e5, 18))
    v_star = np.concatenate([np.geomspace(low, high, number)[:-1] for low, high, number in ends])
    q = double.one_minus_epsilon(v_star) / double.epsilon(v_star)
    with working(_BITS):
        c = float(exact_target(TABLE_DIGITS).loss_ratio(arb(0)))
    return Sample(q**0.1, v_star * np.sqrt(c / q), np.ones_like(q))
