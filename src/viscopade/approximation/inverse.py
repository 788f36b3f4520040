r"""Minimax approximants of the inverse, eps -> v*, on [eps_min, 1] or on all of (0, 1].

The variable is q = (1 - eps)/eps, from 0 at eps = 1 to infinity at eps = 0, which needs 1 - eps where eps is near 1.
v* is sqrt(q) times a smooth function of sqrt(q) near 0, and goes like q^(3/10) at infinity (section 2.5). So

    on [eps_min, 1]:    v* = y N(y)/D(y),      y = q^(1/2), full polynomials;
    on (0, 1]:          v* = y^5 N(y)/D(y),    y = q^(1/10), lacunary polynomials, deg D = deg N + 2.

For other laws of contact v* = kappa^(1/d) goes like q^(1/d) near 0, and like q^(n_b/(n_a d)) at infinity
(`inverse_form`). On all of (0, 1] full polynomials serve where v* goes like q or q^(1/2) there: for nu = 1 and 2.

The relative error of v* is levelled, down to v* = 0; kappa = v*^2, beta = v*^2/v^(1/5) and the dissipative constant A
have twice that error. In the variable sqrt(1 - eps) the same accuracy takes one to four coefficients more
(docs/reference/half-line.md). Errors are sampled.
"""

from __future__ import annotations

from collections.abc import Callable
from fractions import Fraction
from functools import lru_cache
from typing import NamedTuple

import numpy as np
from flint import arb

from viscopade import arguments
from viscopade.approximation import lawson
from viscopade.approximation.lacunary import Powers, full_powers
from viscopade.approximation.lawson import LacunaryFit, Sample
from viscopade.approximation.remez import Coordinate, TooAccurate
from viscopade.approximation.target import TABLE_DIGITS, exact_target
from viscopade.arithmetic.balls import ball_of, working
from viscopade.arrays import double
from viscopade.collision.exact import Exact
from viscopade.theory.law import VISCOELASTIC, Law

MORE_DIGITS = 25
MAX_DEGREE = 9
MAX_WHOLE_DEGREE = 15  # of N, for laws whose polynomials on (0, 1] are full

_Y_MAX = 2000.0  # of q^(1/10): q up to 1e33
_Y_MAX_OF_LAWS = 1e6  # of q, or of q^(1/2)
_STEP = 1e-4  # of ln kappa, in a difference that stands for a derivative
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


def fit_interval(m: int, n: int, epsilon_min: Exact, law: Law = VISCOELASTIC) -> LacunaryFit:
    """Return the best N(y)/D(y) of v* = y N/D, y = ((1 - eps)/eps)^(1/d), on [epsilon_min, 1].

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
    form = inverse_form(law, whole=False)
    return _fit(full_powers(m, n), form, float(1 / low - 1) ** float(form.root), Coordinate(), law)


def whole_powers(law: Law) -> tuple[Powers, ...]:
    """Return the powers to try for a law on (0, 1]; none if no quotient of full polynomials goes like v*."""
    if law == VISCOELASTIC:
        return WHOLE
    form = inverse_form(law, whole=True)
    if form.root < Fraction(1, 2) or law.whole_decay is None:
        return ()
    return tuple(full_powers(m, m + form.degrees_less) for m in range(1, MAX_WHOLE_DEGREE + 1))


def fit_whole(powers: Powers, law: Law = VISCOELASTIC) -> LacunaryFit:
    """Return the best N(y)/D(y) of v* = y^k N/D on all of (0, 1], with k and y from `inverse_form`.

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
    form = inverse_form(law, whole=True)
    if powers.n - powers.m != form.degrees_less:
        raise ValueError(
            f"powers are {powers.label}: deg D must be deg N + {form.degrees_less}, as v* goes like "
            f"q^({form.rest * form.root})"
        )
    return _fit(powers, form, _Y_MAX if law == VISCOELASTIC else _Y_MAX_OF_LAWS, Coordinate(half_line=True), law)


@lru_cache(maxsize=256)
def _fit(powers: Powers, form: InverseForm, y_max: float, coordinate: Coordinate, law: Law) -> LacunaryFit:
    """Return the best quotient, from values with more digits if need be."""
    with working(lawson.BITS):
        factor = 1 / exact_target(law=law).c.root(law.d)
    sample = inverse_sample() if form == WHOLE_FORM else None

    def best(digits: int) -> LacunaryFit:
        return lawson.best(powers, _values(form, digits, law), y_max, coordinate, factor, digits, sample)

    try:
        return best(TABLE_DIGITS)
    except TooAccurate:
        return best(MORE_DIGITS)


def _values(form: InverseForm, digits: int, law: Law) -> Callable[[arb], tuple[arb, arb]]:
    """Return v* (c/q)^(1/d), 1 at 0, as a function of y = q^root, with the weight 1; c = (1 - eps)/v*^d at 0."""
    c = exact_target(digits, law).c

    def values(y: arb) -> tuple[arb, arb]:
        if y == 0:
            return arb(1), arb(1)
        q = y ** (form.shift * law.d)
        return _v_star(q.mid(), digits, law) * (c / q).root(law.d), arb(1)

    return values


def _v_star(q: arb, digits: int, law: Law) -> arb:
    """Return v* at (1 - eps)/eps = q: double precision, then Newton's method on ln q, with a slope of 7 digits."""
    v_star, slope = _roughly(float(q), law)
    for _ in range(1 if digits <= MORE_DIGITS and law == VISCOELASTIC else 2):
        epsilon, loss, _ = exact_target(digits, law).at(v_star)
        v_star = (v_star * (1 + (q * epsilon / loss).log() / slope)).mid()
    return v_star


def _roughly(q: float, law: Law) -> tuple[arb, float]:
    """Return v* at (1 - eps)/eps = q, and d ln q/d ln v*, in double precision."""
    epsilon, loss = 1 / (1 + q), q / (1 + q)
    if law == VISCOELASTIC:
        v_star = double.v_star_from(epsilon) if q > 1 else double.v_star_from(one_minus_epsilon=loss)
        return arb(v_star), -double.slope(float(v_star)) / float(double.one_minus_epsilon(v_star))
    from viscopade.collision.curve import curve

    of = curve(law)
    kappa = float(of.kappa_from(epsilon) if q > 1 else of.kappa_from(one_minus_epsilon=loss))
    ends = kappa * np.exp(_STEP * np.array([-1.0, 1.0]))
    log_q = np.log(of.one_minus_epsilon(ends)) - np.log(of.epsilon(ends))
    return ball_of(Fraction(kappa)).root(law.d).mid(), law.d * float(log_q[1] - log_q[0]) / (2 * _STEP)


@lru_cache(maxsize=1)
def inverse_sample() -> Sample:
    """Return the target at points dense enough for rough fits on all of (0, 1]."""
    v_star = lawson.dense_speeds(15, 18)
    q = double.one_minus_epsilon(v_star) / double.epsilon(v_star)
    return Sample(q**0.1, v_star * np.sqrt(float(exact_target().c) / q), np.ones_like(q))
