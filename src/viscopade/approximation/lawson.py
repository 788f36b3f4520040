r"""Best quotients of lacunary polynomials: first roughly, by Lawson's iteration, then levelled by Remez's algorithm.

A search finds the powers of a quotient (`rough`, many choices at once: iteratively reweighted least squares after
Lawson, with Loeb's linearisation of the quotient). `best` then levels the error by Remez's algorithm.

Lacunary powers are no Chebyshev system: a levelled error belongs to a local optimum (sampled), and a better one may
exist. No claim of the project depends on optimality; the proofs bound the error of the quotient itself.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
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
    """Results of `rough`, a row for each choice of powers; the error is infinite where no quotient was found."""

    error: FloatArray
    coefficients: FloatArray
    """Coefficients of N, then of D without the first."""
    deviation: FloatArray
    """Weighted errors at the points."""


def rough(choices: Sequence[Powers], sample: Sample, steps: int = STEPS) -> Rough:
    """Return nearly best quotients for many choices of powers, all with the same number of exponents.

    Parameters
    ----------
    choices : sequence of Powers
    sample : Sample
        Points, dense enough for the error to be smooth between them.
    steps : int
        Number of steps of Lawson's iteration.
    """
    log_y = np.log(sample.y)
    top = np.array([powers.top for powers in choices], dtype=float)
    bottom = np.array([powers.bottom[1:] for powers in choices], dtype=float).reshape(len(choices), -1)
    degree = bottom.max(axis=1) if bottom.shape[1] else np.zeros(len(choices))
    # Everything is divided by (1 + y)^(degree of D), a first guess of D.
    shift = -degree[:, None] * np.log1p(sample.y)
    terms = np.exp(log_y[:, None] * np.concatenate([top, bottom], axis=1)[:, None, :] + shift[:, :, None])
    one = np.exp(shift)
    design = np.concatenate(
        [terms[:, :, : top.shape[1]] / sample.target[:, None], -terms[:, :, top.shape[1] :]], axis=2
    )
    return _lawson(design, one, sample.weight, top.shape[1], steps)


def _lawson(design: FloatArray, one: FloatArray, weight: FloatArray, size: int, steps: int) -> Rough:
    """Minimise the largest weight |N/(target D) - 1|, where N/target - D = design c - one."""
    choices, points, parameters = design.shape
    denominator = np.ones_like(one)
    moved = np.ones_like(one)
    best = Rough(np.full(choices, np.inf), np.zeros((choices, parameters)), np.zeros((choices, points)))
    for step in range(steps):
        scale = weight / denominator * np.sqrt(moved)
        coefficients = _least_squares(design * scale[:, :, None], one * scale)
        residual = np.einsum("cpk,ck->cp", design, coefficients) - one
        new = one - np.einsum("cpk,ck->cp", design[:, :, size:], coefficients[:, size:])
        good = (new > 0).all(axis=1) & np.isfinite(coefficients).all(axis=1)
        deviation = weight * residual / np.where(new > 0, new, 1)
        largest = np.where(good, np.abs(deviation).max(axis=1), np.inf)
        better = largest < best.error
        best.error[better], best.coefficients[better] = largest[better], coefficients[better]
        best.deviation[better] = deviation[better]
        change = np.abs(deviation) / np.where(good, largest, 1)[:, None] + _LEAST
        moved = np.where(good[:, None], moved * (change if step > _GENTLE else np.sqrt(change)), moved)
        moved = np.maximum(moved / moved.max(axis=1, keepdims=True), _FLOOR)
        denominator = np.where(good[:, None], new, np.fmax(new, _KEEP * denominator))
    return best


def _least_squares(design: FloatArray, right: FloatArray) -> FloatArray:
    """Solve many problems of least squares at once."""
    length = np.sqrt((design * design).sum(axis=1))
    q, r = np.linalg.qr(design / length[:, None, :])
    diagonal = np.einsum("ckk->ck", r)
    singular = np.abs(diagonal).min(axis=1) < 1e-15
    r[singular] = np.eye(r.shape[1])
    solution: FloatArray = np.linalg.solve(r, np.einsum("cpk,cp->ck", q, right)[:, :, None])[:, :, 0] / length
    solution[singular] = np.nan
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
    digits: int = 17,
    sample: Sample | None = None,
) -> LacunaryFit:
    """Return the quotient that minimises weight |N/(target D) - 1| on [0, y_max], times a factor.

    Parameters
    ----------
    powers : Powers
    values : callable
        Function that returns target and weight at y.
    y_max, coordinate, digits
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

    problem = Problem(powers, relative, (0.0, y_max), digits=digits, coordinate=coordinate)
    start = None if sample is None else _alternating(sample, rough([powers], sample), problem.number_of_points)
    found = remez.solve(problem, start)
    with working(BITS):
        a = tuple(Fraction(float((found.a[k] * factor).mid())) for k in powers.top)
    b = tuple(Fraction(float(found.b[k])) for k in powers.bottom)
    return LacunaryFit(LacunaryQuotient(powers, a, b), found.error, found.points)


def _alternating(sample: Sample, found: Rough, number: int) -> list[float]:
    """Return up to `number` points with large errors of alternating signs."""
    (deviation,) = found.deviation
    parts = np.split(np.arange(len(deviation)), changes_of_sign(deviation)[1:])
    largest = [int(part[np.argmax(np.abs(deviation[part]))]) for part in parts]
    extrema = remez.alternating([(float(sample.y[i]), float(deviation[i])) for i in largest], number)
    # Rounded, because the last digits of roots differ from machine to machine.
    return [float(f"{y:.9g}") for y, _ in extrema]
