r"""Best quotients of lacunary polynomials: first roughly, by Lawson's iteration, then levelled by Remez's algorithm.

`rough` solves iteratively reweighted least squares after Lawson, with Loeb's linearisation of the quotient. Where its
error is largest, `best` starts Remez's algorithm, which levels the error.

Lacunary powers are no Chebyshev system: a levelled error belongs to a local optimum (sampled), and a better one may
exist. No claim of the project depends on optimality; the proofs bound the error of the quotient itself.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from fractions import Fraction
from typing import NamedTuple

import numpy as np
from flint import arb

from viscopade.approximation import remez
from viscopade.approximation.lacunary import LacunaryQuotient, Powers
from viscopade.approximation.remez import Coordinate, Problem, changes_of_sign
from viscopade.arithmetic.balls import working
from viscopade.arrays.checked import FloatArray

BITS = 160  # of a coefficient's product with a factor: three times the 53 bits of the double to which it is rounded

# A rough fit only has to find where the error is largest, so that these numbers need no care. Measured for the 14
# powers of `half_line.BEST` and `inverse.BEST`: 20 steps leave errors up to 17 % larger than 60, and 120 make them at
# most 3 % smaller; the others change no error by more than 3 % when they are ten times larger or smaller, _KEEP = 0.3
# by 12 %.
STEPS = 60  # of Lawson's iteration
_GENTLE = 3  # the last step, counted from 0, in which weights change by the square root only
_FLOOR = 1e-10  # least of Lawson's weights, relative to the largest: a weight of 0 would remain 0
_LEAST = 1e-4  # added to the factor of a weight's change, which is its least, where the error is 0
_KEEP = 0.03  # share of the former denominator that replaces a new one that is not positive


class Sample(NamedTuple):
    """Samples of a target with weights: the error of an approximant R is weight |R/target - 1|."""

    y: FloatArray
    target: FloatArray
    weight: FloatArray


class Rough(NamedTuple):
    """Result of `rough`; the error is infinite if no quotient was found."""

    error: float
    coefficients: FloatArray
    """Coefficients of N, then of D without the first."""
    deviation: FloatArray
    """Weighted errors at the points."""


def rough(powers: Powers, sample: Sample, steps: int = STEPS) -> Rough:
    """Return a nearly best quotient: the largest weight |N/(target D) - 1| is nearly minimal.

    Parameters
    ----------
    powers : Powers
    sample : Sample
        Points, dense enough for the error to be smooth between them.
    steps : int
        Number of steps of Lawson's iteration.
    """
    # With the coefficients c of N, then of D without the first, which is 1: N/target - D = design c - one. All is
    # divided by (1 + y)^(degree of D), a first guess of D, so that high powers of y do not overflow.
    log_divisor, number_in_n = -powers.n * np.log1p(sample.y), len(powers.top)
    exponents = np.array([*powers.top, *powers.bottom[1:]])
    terms, one = np.exp(np.log(sample.y)[:, None] * exponents + log_divisor[:, None]), np.exp(log_divisor)
    design = np.concatenate([terms[:, :number_in_n] / sample.target[:, None], -terms[:, number_in_n:]], axis=1)
    denominator = lawson_weight = np.ones_like(one)
    best_so_far = Rough(np.inf, np.zeros(len(exponents)), np.zeros_like(one))
    for step in range(steps):
        # Loeb: weight |N/(target D) - 1| = weight |N/target - D|/D, with the D of the step before in the denominator,
        # is linear in c. Lawson: least squares with weights that approach those of the largest error.
        scale = sample.weight / denominator * np.sqrt(lawson_weight)
        coefficients = _least_squares(design * scale[:, None], one * scale)
        # D itself. If it is not positive at all points, the next step begins from D where that is, and elsewhere from a
        # small part of the old one (`fmax` ignores a NaN).
        new_denominator = one - design[:, number_in_n:] @ coefficients[number_in_n:]
        if not (np.isfinite(coefficients).all() and (new_denominator > 0).all()):
            denominator = np.fmax(new_denominator, _KEEP * denominator)
            continue
        deviation = sample.weight * (design @ coefficients - one) / new_denominator
        largest = float(np.abs(deviation).max())
        if largest < best_so_far.error:
            best_so_far = Rough(largest, coefficients, deviation)
        # Points with large errors get more weight: weight <- weight |error|/max |error|.
        change = np.abs(deviation) / largest + _LEAST
        lawson_weight = lawson_weight * (change if step > _GENTLE else np.sqrt(change))
        lawson_weight = np.maximum(lawson_weight / lawson_weight.max(), _FLOOR)
        denominator = new_denominator
    return best_so_far


def _least_squares(design: FloatArray, right: FloatArray) -> FloatArray:
    """Return the c that minimises |design c - right|; NaN if the columns of the design depend on each other."""
    # design/length = Q R with columns of length 1, so that powers of every size are compared alike below;
    # R (length c) = Q^T right.
    length = np.sqrt((design * design).sum(axis=0))
    q, r = np.linalg.qr(design / length)
    # R's diagonal is what a column has beyond the ones before: below 1e-15, the round-off of doubles, it is nothing.
    # Measured for the 14 powers of `BEST`: it is 1.4e-14 or more in all steps.
    if np.abs(np.diagonal(r)).min() < 1e-15:
        return np.full(len(length), np.nan)
    solution: FloatArray = np.linalg.solve(r, q.T @ right) / length
    return solution


def dense_speeds(slow: int, fast: int) -> FloatArray:
    """Return v* dense enough for rough fits for all v* >= 0; `slow` and `fast` are numbers of slow and fast ones."""
    # 37 for each of three decades from 0.04 to 40, where eps falls from 0.998 to 6e-6. Outside, where eps and 1 - eps
    # are nearly powers of v*, fewer serve: the caller's numbers for one decade below and for three and a half above.
    # The numbers and ends are choices; the callers say how much the errors on finer grids differ. The last point of
    # each range is left out, as the next one begins with it.
    ends = ((0.004, 0.04, slow), (0.04, 40.0, 111), (40.0, 1e5, fast))
    return np.concatenate([np.geomspace(low, high, number)[:-1] for low, high, number in ends])


# --- best quotients ---------------------------------------------------------------------------------------------------


@dataclass(frozen=True)
class LacunaryFit:
    """A best quotient with double coefficients.

    Attributes
    ----------
    quotient : LacunaryQuotient
        N/D with coefficients that are doubles.
    error : float
        The levelled error of the best N/D with these powers (sampled).
    points : tuple of float
        The y at which the error is largest, with alternating signs.
    """

    quotient: LacunaryQuotient
    error: float
    points: tuple[float, ...]


def best(
    powers: Powers,
    values: Callable[[arb], tuple[arb, arb]],
    y_max: float,
    coordinate: Coordinate,
    factor: arb,
    sample: Sample | None = None,
) -> LacunaryFit:
    """Return the quotient that minimises weight |N/(target D) - 1| on [0, y_max], times a factor.

    Parameters
    ----------
    powers : Powers
        The powers of y in N and in D.
    values : callable
        Function that returns target and weight at y.
    y_max, coordinate
        As for `remez.Problem`.
    factor : flint.arb
        Factor of N, before its coefficients are rounded to the nearest doubles.
    sample : Sample, optional
        Points whose rough fit is the first guess.

    Raises
    ------
    remez.NoBest
        If the error cannot be levelled.
    """

    def relative(y: arb) -> tuple[arb, arb]:
        """Return g = 1 - f and p = 1/w of `Problem`: its error (N/D - f)/w is that above with w = target/weight."""
        target, weight = values(y)
        return 1 - target, weight / target

    problem = Problem(powers, relative, (0.0, y_max), coordinate=coordinate)
    # Remez's algorithm starts where the error of a rough fit is largest.
    start = None if sample is None else _alternating(sample, rough(powers, sample).deviation, problem.number_of_points)
    levelled = remez.solve(problem, start)
    # The factor returns into N, with 160 bits (`BITS`: ample for a double), and coefficients become doubles.
    with working(BITS):
        a = tuple(Fraction(float((levelled.a[k] * factor).mid())) for k in powers.top)
    b = tuple(Fraction(float(levelled.b[k])) for k in powers.bottom)
    return LacunaryFit(LacunaryQuotient(powers, a, b), levelled.error, levelled.points)


def _alternating(sample: Sample, deviation: FloatArray, number: int) -> list[float]:
    """Return up to `number` points with large errors of alternating signs."""
    # The point with the largest error in each part of one sign.
    parts = np.split(np.arange(len(deviation)), changes_of_sign(deviation)[1:])
    largest = [int(part[np.argmax(np.abs(deviation[part]))]) for part in parts]
    extrema = remez.alternating([(float(sample.y[i]), float(deviation[i])) for i in largest], number)
    # Rounded to nine digits, because the last ones of roots differ from machine to machine. A first guess needs two
    # (measured for the 14 powers of `BEST`: with two digits the results are the same, with one four are lost).
    return [float(f"{y:.9g}") for y, _ in extrema]
