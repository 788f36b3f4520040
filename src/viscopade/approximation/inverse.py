r"""Minimax approximants of the inverse, eps -> v*, on [eps_min, 1] or on all of (0, 1].

The variable is q = (1 - eps)/eps, from 0 at eps = 1 to infinity at eps = 0, which needs 1 - eps where eps is near 1.
v* is sqrt(q) times a smooth function of sqrt(q) near 0, and goes like q^(3/10) at infinity (section 2.5). So

    on [eps_min, 1]:    v* = y N(y)/D(y),      y = q^(1/2), full polynomials;
    on (0, 1]:          v* = y^5 N(y)/D(y),    y = q^(1/10), lacunary polynomials, deg D = deg N + 2.

For other laws of contact v* = kappa^(1/d) goes like q^(1/d) near 0, and like q^(n_b/(n_a d)) at infinity
(`inverse_form`). On all of (0, 1] full polynomials serve where v* goes like q or q^(1/2) there: for nu = 1 and 2.

The relative error of v* is levelled, down to v* = 0; kappa = v*^2, beta = v*^2/v^(1/5) and the dissipative constant A
have twice that error. In the variable sqrt(1 - eps) the same accuracy takes one to four coefficients more
(src/viscopade_lab/studies/half_line_search.py). Errors are sampled, in double precision, for coefficients that are
doubles.
"""

from __future__ import annotations

from dataclasses import dataclass
from fractions import Fraction
from functools import lru_cache
from typing import NamedTuple

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
from viscopade.arithmetic.balls import ball_of, working
from viscopade.arrays import double
from viscopade.arrays.checked import FloatArray
from viscopade.collision.curve import curve
from viscopade.collision.exact import Exact
from viscopade.theory.law import VISCOELASTIC, Law

MORE_DIGITS = 25
MAX_DEGREE = 9
MAX_WHOLE_DEGREE = 15  # of N, for laws whose polynomials on (0, 1] are full

_Y_MAX = 2000.0  # of q^(1/10): q up to 1e33
_Y_MAX_OF_LAWS = 1e6  # of q, or of q^(1/2)
_STEP = 1e-4  # of ln kappa, in a difference that stands for a derivative
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


class InverseForm(NamedTuple):
    """Form of the inverse of a law: v* = y^shift N(y)/D(y), y = ((1 - eps)/eps)^root, and v* ~ y^rest at infinity.

    `whole` says whether it is one for all 0 < eps <= 1.
    """

    root: Fraction
    shift: int
    rest: int
    whole: bool

    @property
    def linear(self) -> bool:
        """Whether v* goes like 1 - eps near 0, which may be as small as the smallest number of a type."""
        return self.root * self.shift == 1

    @property
    def degrees_less(self) -> int:
        """Deg D - deg N on (0, 1]."""
        return self.shift - self.rest


def inverse_form(law: Law, whole: bool) -> InverseForm:
    """Return the form whose powers of y are those of v* at 0, and on all of (0, 1] those at infinity, too."""
    shift = law.n_a if whole else 1
    return InverseForm(Fraction(1, shift * law.d), shift, law.n_b, whole)


WHOLE_FORM = inverse_form(VISCOELASTIC, True)


@dataclass(frozen=True)
class Inverse:
    """Approximant of the inverse: v* = y^k N(y)/D(y) with y = q^root, q = (1 - eps)/eps, for eps_min <= eps <= 1.

    Attributes
    ----------
    quotient : LacunaryQuotient
        N/D with coefficients that are doubles.
    form : InverseForm
        Root and k; the polynomials are full on an interval.
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
    form: InverseForm
    epsilon_min: Fraction
    level: float
    error: float
    points: tuple[float, ...]

    def __post_init__(self) -> None:
        if self.form.whole:
            _require_degrees(self.quotient.powers, self.form)

    def v_star_at(self, q: FloatArray) -> FloatArray:
        """Return v* at q = (1 - eps)/eps in double precision, beyond y = 1 in powers of 1/y."""
        root, shift = self.form.root, self.form.shift
        y = np.sqrt(q) if root == Fraction(1, 2) else q ** float(root)
        top, bottom = self.quotient.top, self.quotient.bottom
        small = np.minimum(y, 1)
        with np.errstate(divide="ignore"):
            inverse = np.minimum(1 / y, 1)
        lower = small**shift * evaluated(top, small) / evaluated(bottom, small)
        high, low = (evaluated(mirrored(part, part[-1][0]), inverse) for part in (top, bottom))
        large = np.maximum(y, 1) ** float(shift + top[-1][0] - bottom[-1][0])
        return np.where(y <= 1, lower, large * high / low)


def _require_degrees(powers: Powers, form: InverseForm) -> None:
    """Raise a ValueError unless N/D with these powers has the right order at infinity."""
    if powers.bottom[-1] - powers.top[-1] != form.degrees_less:
        raise ValueError(
            f"powers are {powers.label}: deg D must be deg N + {form.degrees_less}, as v* goes like "
            f"q^({form.rest * form.root})"
        )


def fit_interval(m: int, n: int, epsilon_min: Exact, law: Law = VISCOELASTIC) -> Inverse:
    """Return the best v* = y N(y)/D(y), y = ((1 - eps)/eps)^(1/d), on [epsilon_min, 1].

    Parameters
    ----------
    m, n : int
        Degrees of N and D, 0 to 9.
    epsilon_min : str, int, float, Fraction, Decimal, mpmath.mpf or NumPy scalar
        From 1e-4 to less than 1, taken exactly.
    law : Law
        Of contact; v* = kappa^(1/d).

    Raises
    ------
    TypeError, ValueError
        If an argument is not accepted.
    remez.NoBest
        If there is no best approximant, or the error is too small for double precision.
    """
    m, n = arguments.integer("m", m, 0, MAX_DEGREE), arguments.integer("n", n, 0, MAX_DEGREE)
    low = arguments.exact_number("epsilon_min", epsilon_min, "a number >= 1e-4 and < 1", lambda e: _SMALLEST <= e < 1)
    return _fit_interval(m, n, low, law)


@lru_cache(maxsize=256)
def _fit_interval(m: int, n: int, low: Fraction, law: Law) -> Inverse:
    form = inverse_form(law, whole=False)
    y_max = float(1 / low - 1) ** float(form.root)
    return _full(_full_powers(m, n), form, low, y_max, remez.Coordinate(1.0), law)


def _full(
    powers: Powers, form: InverseForm, low: Fraction, y_max: float, coordinate: remez.Coordinate, law: Law
) -> Inverse:
    """Return the best quotient of full polynomials, from values with more digits if need be."""
    for digits in (TABLE_DIGITS, MORE_DIGITS):
        try:
            target = _target(form, digits, law)
            stated = lacunary.lacunary_problem(powers, target, _one, y_max, coordinate, digits)
            return _kernel(powers, form, low, remez.solve(stated), law)
        except remez.TooAccurate as reason:
            refused = reason
    raise refused


def _full_powers(m: int, n: int) -> Powers:
    return Powers(tuple(range(m + 1)), tuple(range(n + 1)))


def whole_powers(law: Law) -> tuple[Powers, ...]:
    """Return the powers to try for a law on (0, 1]; none if no quotient of full polynomials goes like v*."""
    if law == VISCOELASTIC:
        return WHOLE
    form = inverse_form(law, whole=True)
    if form.root < Fraction(1, 2) or law.whole_decay is None:
        return ()
    return tuple(_full_powers(m, m + form.degrees_less) for m in range(1, MAX_WHOLE_DEGREE + 1))


def fit_whole(powers: Powers, law: Law = VISCOELASTIC) -> Inverse:
    """Return the best v* = y^k N(y)/D(y) on all of (0, 1]; for the paper's law k = 5, y = ((1 - eps)/eps)^(1/10).

    Parameters
    ----------
    powers : Powers
        Exponents, deg D = deg N + 2; for another law, some of `whole_powers`.
    law : Law
        Of contact, with `whole_powers`.

    Raises
    ------
    ValueError
        If the degrees are not accepted.
    remez.NoBest
        If the error cannot be levelled.
    """
    _require_degrees(powers, inverse_form(law, whole=True))
    return _fit_whole(powers, law)


@lru_cache(maxsize=64)
def _fit_whole(powers: Powers, law: Law) -> Inverse:
    form, coordinate = inverse_form(law, whole=True), remez.Coordinate(1.0, True)
    if law != VISCOELASTIC:
        return _full(powers, form, Fraction(0), _Y_MAX_OF_LAWS, coordinate, law)
    stated = lacunary.lacunary_problem(powers, _target(form, TABLE_DIGITS, law), _one, _Y_MAX, coordinate)
    return _kernel(powers, form, Fraction(0), lacunary.best(powers, stated, inverse_sample()), law)


def _one(_: arb) -> arb:
    return arb(1)


def _target(form: InverseForm, digits: int, law: Law) -> lacunary.Function:
    """Return v* (c/q)^(1/d) as a function of y = q^root, c = (1 - eps)/v*^d at 0; 1 at y = 0."""

    def target(y: arb) -> arb:
        if y == 0:
            return arb(1)
        q = y ** (form.shift * law.d)
        c = exact_target(digits, law).loss_ratio(arb(0))
        return (_v_star(q.mid(), digits, law) * (c / q).root(law.d)).mid()

    return target


def _v_star(q: arb, digits: int, law: Law) -> arb:
    """Return v* at (1 - eps)/eps = q: double precision, then Newton's method on ln q, with a slope of 7 digits."""
    v_star, slope = _roughly(float(q), law)
    for _ in range(1 if digits <= MORE_DIGITS and law == VISCOELASTIC else 2):
        epsilon, loss = exact_target(digits, law).both(v_star)
        v_star = (v_star * (1 + (q * epsilon / loss).log() / slope)).mid()
    return v_star


def _roughly(q: float, law: Law) -> tuple[arb, float]:
    """Return v* at (1 - eps)/eps = q, and d ln q/d ln v*, in double precision."""
    epsilon, loss = 1 / (1 + q), q / (1 + q)
    if law == VISCOELASTIC:
        v_star = double.v_star_from(epsilon) if q > 1 else double.v_star_from(one_minus_epsilon=loss)
        return arb(v_star), -double.slope(float(v_star)) / float(double.one_minus_epsilon(v_star))
    of = curve(law)
    kappa = float(of.kappa_from(epsilon) if q > 1 else of.kappa_from(one_minus_epsilon=loss))
    ends = kappa * np.exp(_STEP * np.array([-1.0, 1.0]))
    log_q = np.log(of.one_minus_epsilon(ends)) - np.log(of.epsilon(ends))
    return ball_of(Fraction(kappa)).root(law.d).mid(), law.d * float(log_q[1] - log_q[0]) / (2 * _STEP)


def _kernel(powers: Powers, form: InverseForm, low: Fraction, found: remez.Approximation, law: Law) -> Inverse:
    with working(_BITS):
        c = exact_target(TABLE_DIGITS, law).loss_ratio(arb(0))
        quotient = lacunary.rounded(powers, found, 1 / c.root(law.d))
    points = tuple(float(y) ** float(1 / form.root) for y in found.points)
    if law != VISCOELASTIC:
        return Inverse(quotient, form, low, found.error, found.error, points)
    bare = Inverse(quotient, form, low, found.error, 0.0, points)
    return Inverse(quotient, form, low, found.error, _error(bare), points)


def _error(given: Inverse) -> float:
    """Return the largest relative error of v* at many points (sampled), for the paper's law."""
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
