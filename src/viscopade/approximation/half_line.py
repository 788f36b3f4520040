r"""Half-line approximants of eps: lacunary quotients for every v* >= 0, with both limits right by structure.

With kappa = v*^2 and y = v*^(1/3),

    eps = D(y)/(D(y) + v*^2 N(y)),    that is    1/eps - 1 = v*^2 N(y)/D(y),

N and D lacunary polynomials, deg N = deg D + 4. As 1/eps - 1 goes like c v*^2 at 0 and like (2/3)^(2/3) v*^(10/3) at
infinity (section 2.5), N/D only has to go from c to (2/3)^(2/3) y^4. No further root is taken: code that computes
v* = w^(1/10), w = beta^5 v, gets y = w^(1/30) by the same operation; given v*, y is a cube root. The powers of y were
found by a search among these and many other forms (src/viscopade_lab/studies/half_line_search.py). If N/D has a
relative error delta, then

    |d eps| = |delta| eps (1 - eps):    |d eps|/eps <= |delta| (1 - eps),    |d eps|/(1 - eps) <= |delta| eps,

to first order in delta, so that both measures of section 2.7 are finite. In this order the errors are levelled.
Errors here are sampled, in double precision, for coefficients that are doubles.
"""

from __future__ import annotations

from dataclasses import dataclass
from fractions import Fraction
from functools import lru_cache
from typing import get_args

import numpy as np
from flint import arb

from viscopade.approximation import lacunary, remez
from viscopade.approximation.lacunary import (
    LacunaryQuotient,
    Powers,
    Sample,
    Terms,
    evaluated,
    mirrored,
    terms,
)
from viscopade.approximation.measure import Measure
from viscopade.approximation.target import TABLE_DIGITS, exact_target
from viscopade.arithmetic.balls import working
from viscopade.arrays import checked, double
from viscopade.arrays.checked import Accepted, FloatArray, Values

ROOT = Fraction(1, 3)  # y = v*^ROOT
SHIFT = 6  # v*^2 = y^SHIFT
DEGREES_MORE = 4  # deg N - deg D
LIMIT = Fraction(10, 3)  # eps ~ v*^-LIMIT

_Y_MAX = 2000.0  # beyond, v* > 8e9, the error is that at infinity but for 1e-30
_COORDINATE = remez.Coordinate(1.0, True)
_BITS = 128
_SPEEDS = Accepted("a number >= 0, or inf", lambda x: x >= 0)

# The best powers found for 4, 5, … coefficients.
RELATIVE = (
    Powers((0, 4, 8), (0, 4)),
    Powers((0, 5, 7, 16), (0, 12)),
    Powers((0, 3, 4, 16), (0, 3, 12)),
    Powers((0, 5, 6, 11, 20), (0, 5, 6, 16)),
    Powers((0, 5, 7, 11, 12, 20), (0, 5, 6, 16)),
    Powers((0, 6, 7, 11, 13, 21), (0, 5, 6, 8, 17)),
)
BOTH = (
    Powers((0, 6, 15), (0, 11)),
    Powers((0, 9, 19), (0, 6, 15)),
    Powers((0, 6, 8, 19), (0, 6, 15)),
    Powers((0, 4, 12, 19), (0, 4, 6, 8, 15)),
    Powers((0, 6, 12, 18, 25), (0, 9, 12, 14, 21)),
    Powers((0, 6, 12, 18, 19, 27), (0, 9, 12, 15, 23)),
    Powers((0, 6, 12, 13, 17, 18, 26), (0, 6, 8, 9, 10, 22)),
)
BEST: dict[Measure, tuple[Powers, ...]] = {"relative": RELATIVE, "both": BOTH}


@dataclass(frozen=True)
class HalfLine:
    """Half-line approximant eps = D/(D + v*^2 N) for every v* >= 0, with polynomials N, D in y = v*^(1/3).

    Attributes
    ----------
    quotient : LacunaryQuotient
        N/D with coefficients that are doubles.
    measure : "relative" or "both"
        The error that was made small: |d eps|/eps, or the larger one of that and |d eps|/(1 - eps).
    level : float
        The levelled error of the best N/D with these powers, to first order (sampled).
    relative_error, both_error : float
        Largest errors of this kernel in the two measures, over all v* >= 0 (sampled; exact evaluation).
    points : tuple of float
        v* where the error is largest, with alternating signs.

    Raises
    ------
    ValueError
        If N/D is not of the structure that both limits ask for.
    """

    quotient: LacunaryQuotient
    measure: Measure
    level: float
    relative_error: float
    both_error: float
    points: tuple[float, ...]

    def __post_init__(self) -> None:
        require_half_line_degrees(self.powers)

    @property
    def powers(self) -> Powers:
        """The powers of y that occur."""
        return self.quotient.powers

    @property
    def error(self) -> float:
        """The largest error in the approximant's own measure (sampled)."""
        return self.relative_error if self.measure == "relative" else self.both_error

    def epsilon(self, v_star: Values) -> Values:
        """Return eps(v*) in double precision; v_star is a number >= 0, infinity, or an array.

        Raises
        ------
        TypeError
            If a v* is not a real number.
        ValueError
            If a v* is negative or NaN.
        """
        return checked.elementwise(lambda v: portions(self.quotient, v)[0], "v_star", v_star, _SPEEDS)

    def one_minus_epsilon(self, v_star: Values) -> Values:
        """Return 1 - eps(v*) without cancellation; arguments and errors as for `epsilon`."""
        return checked.elementwise(lambda v: portions(self.quotient, v)[1], "v_star", v_star, _SPEEDS)


def portions(quotient: LacunaryQuotient, v_star: FloatArray) -> tuple[FloatArray, FloatArray]:
    """Return eps and 1 - eps: D and v*^2 N, divided by the sum of both."""
    of_loss = terms(quotient.powers.top, quotient.a, SHIFT)  # y^6 N
    y, degree = np.cbrt(v_star), of_loss[-1][0]
    bottom, top = _evaluated(quotient.bottom, y, degree), _evaluated(of_loss, y, degree)
    return bottom / (bottom + top), top / (bottom + top)


def _evaluated(polynomial: Terms, y: FloatArray, degree: int) -> FloatArray:
    """Return a polynomial, for y > 1 divided by y^degree."""
    with np.errstate(divide="ignore"):
        inverse = np.minimum(1 / y, 1)
    upper = evaluated(mirrored(polynomial, degree), inverse)
    return np.where(y <= 1, evaluated(polynomial, np.minimum(y, 1)), upper)


def require_half_line_degrees(powers: Powers) -> None:
    """Check that N/D with these powers has the right order at infinity; raise a ValueError otherwise."""
    if powers.top[-1] - powers.bottom[-1] != DEGREES_MORE:
        raise ValueError(
            f"powers are {powers.label}: deg N must be deg D + {DEGREES_MORE}, as eps goes like v*^(-10/3)"
        )


def fit_half_line(powers: Powers, measure: Measure = "relative") -> HalfLine:
    """Return the best approximant with given powers of y = v*^(1/3).

    Parameters
    ----------
    powers : Powers
        Exponents, deg N = deg D + 4.
    measure : "relative" or "both"
        The error to be made small.

    Raises
    ------
    ValueError
        If degrees or measure are not accepted.
    remez.NoBest
        If the error cannot be levelled.
    """
    require_half_line_degrees(powers)
    if measure not in get_args(Measure):
        raise ValueError(f"measure is {measure!r}: accepted is one of {', '.join(get_args(Measure))}")
    return _fit(powers, measure)


@lru_cache(maxsize=64)
def _fit(powers: Powers, measure: Measure) -> HalfLine:
    with working(_BITS):
        c = exact_target(TABLE_DIGITS).loss_ratio(arb(0))
    stated = lacunary.lacunary_problem(powers, lambda y: _target(y) / c, _weight(measure), _Y_MAX, _COORDINATE)
    found = lacunary.best(powers, stated, half_line_sample(measure))
    with working(_BITS):
        quotient = lacunary.rounded(powers, found, c)
    points = tuple(y**3 for y in found.points)
    errors = _errors(HalfLine(quotient, measure, found.error, 0.0, 0.0, points))
    return HalfLine(quotient, measure, found.error, *errors, points)


def _target(y: arb) -> arb:
    """Return (1/eps - 1)/v*^2."""
    exact = exact_target(TABLE_DIGITS)
    v_star = y * y * y
    return (exact.loss_ratio(v_star) / exact.epsilon(v_star)).mid()


def _weight(measure: Measure) -> lacunary.Function:
    """Return by how much a relative error of N/D is an error in the measure, to first order."""

    def weight(y: arb) -> arb:
        epsilon, loss = exact_target(TABLE_DIGITS).both(y * y * y)
        return epsilon if measure == "both" and epsilon > loss else loss

    return weight


@lru_cache(maxsize=2)
def half_line_sample(measure: Measure) -> Sample:
    """Return target and weight at points dense enough for rough fits."""
    ends = ((0.004, 0.04, 12), (0.04, 40.0, 111), (40.0, 1e5, 22))
    v_star = np.concatenate([np.geomspace(low, high, number)[:-1] for low, high, number in ends])
    epsilon, loss = double.epsilon(v_star), double.one_minus_epsilon(v_star)
    weight = np.maximum(epsilon, loss) if measure == "both" else loss
    with working(_BITS):
        c = float(exact_target(TABLE_DIGITS).loss_ratio(arb(0)))
    return Sample(np.cbrt(v_star), loss / epsilon / (c * v_star**2), weight)


def _errors(given: HalfLine) -> tuple[float, float]:
    """Return the largest errors in both measures, at many points and in both limits (sampled)."""
    v_star = np.geomspace(1e-9, 1e12, 200_001)
    epsilon, loss = double.epsilon(v_star), double.one_minus_epsilon(v_star)
    of_epsilon = np.abs(given.epsilon(v_star) / epsilon - 1)
    of_loss = np.abs(given.one_minus_epsilon(v_star) / loss - 1)
    # The absolute error is known best from the smaller portion.
    relative = np.where(loss < epsilon, of_loss * loss / epsilon, of_epsilon)
    elastic = np.where(loss < epsilon, of_loss, of_epsilon * epsilon / loss)
    return float(relative.max()), float(np.maximum(relative, elastic).max())
