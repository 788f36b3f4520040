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

BITS = 160
STEPS = 60  # of Lawson's iteration
_GENTLE = 3  # number of first steps, in which weights change less
_FLOOR = 1e-10  # least of Lawson's weights
_LEAST = 1e-4  # least factor of a weight's change
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
    # N/target - D = design c - one. All is divided by (1 + y)^(degree of D), a first guess of D.
    shift, size = -powers.n * np.log1p(sample.y), len(powers.top)
    exponents = np.array([*powers.top, *powers.bottom[1:]])
    terms, one = np.exp(np.log(sample.y)[:, None] * exponents + shift[:, None]), np.exp(shift)
    design = np.concatenate([terms[:, :size] / sample.target[:, None], -terms[:, size:]], axis=1)
    denominator = moved = np.ones_like(one)
    best = Rough(np.inf, np.zeros(len(exponents)), np.zeros_like(one))
    for step in range(steps):
        scale = sample.weight / denominator * np.sqrt(moved)
        coefficients = _least_squares(design * scale[:, None], one * scale)
        new = one - design[:, size:] @ coefficients[size:]
        if not (np.isfinite(coefficients).all() and (new > 0).all()):
            denominator = np.fmax(new, _KEEP * denominator)
            continue
        deviation = sample.weight * (design @ coefficients - one) / new
        largest = float(np.abs(deviation).max())
        if largest < best.error:
            best = Rough(largest, coefficients, deviation)
        # Points with large errors get more weight.
        change = np.abs(deviation) / largest + _LEAST
        moved = moved * (change if step > _GENTLE else np.sqrt(change))
        moved = np.maximum(moved / moved.max(), _FLOOR)
        denominator = new
    return best


def _least_squares(design: FloatArray, right: FloatArray) -> FloatArray:
    """Solve a problem of least squares; NaN if it is singular."""
    length = np.sqrt((design * design).sum(axis=0))
    q, r = np.linalg.qr(design / length)
    if np.abs(np.diagonal(r)).min() < 1e-15:
        return np.full(len(length), np.nan)
    solution: FloatArray = np.linalg.solve(r, q.T @ right) / length
    return solution


def dense_speeds(slow: int, fast: int) -> FloatArray:
    """Return v* dense enough for rough fits for all v* >= 0; `slow` and `fast` are numbers of slow and fast ones."""
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
        target, weight = values(y)
        return 1 - target, weight / target

    problem = Problem(powers, relative, (0.0, y_max), coordinate=coordinate)
    start = None if sample is None else _alternating(sample, rough(powers, sample).deviation, problem.number_of_points)
    found = remez.solve(problem, start)
    with working(BITS):
        a = tuple(Fraction(float((found.a[k] * factor).mid())) for k in powers.top)
    b = tuple(Fraction(float(found.b[k])) for k in powers.bottom)
    return LacunaryFit(LacunaryQuotient(powers, a, b), found.error, found.points)


def _alternating(sample: Sample, deviation: FloatArray, number: int) -> list[float]:
    """Return up to `number` points with large errors of alternating signs."""
    parts = np.split(np.arange(len(deviation)), changes_of_sign(deviation)[1:])
    largest = [int(part[np.argmax(np.abs(deviation[part]))]) for part in parts]
    extrema = remez.alternating([(float(sample.y[i]), float(deviation[i])) for i in largest], number)
    # Rounded, because the last digits of roots differ from machine to machine.
    return [float(f"{y:.9g}") for y, _ in extrema]
