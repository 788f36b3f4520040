r"""Best quotients of lacunary polynomials: N(y)/D(y), in which only some powers of y = x^(1/r) occur.

Where a function behaves like different fractional powers at 0 and at infinity, as eps(v*) does, quotients with few
powers of a root of the argument are far better than quotients of full polynomials. A search finds these powers
(`rough`, many choices at once: iteratively reweighted least squares after Lawson, with Loeb's linearisation of the
quotient). `best` then levels the error by Remez's algorithm.

Lacunary powers are no Chebyshev system: a levelled error is that of a local optimum (sampled), and a better one may
exist. No claim of the project rests on optimality: the proofs bound the error attained.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from fractions import Fraction
from itertools import pairwise
from typing import NamedTuple, TypeVar

import numpy as np
from flint import arb

from viscopade.approximation import remez
from viscopade.arrays.checked import FloatArray

Function = Callable[[arb], arb]
Coefficient = TypeVar("Coefficient")

STEPS = 60  # of Lawson's iteration
_GENTLE = 3  # first steps, with weights changed less
_FLOOR = 1e-10  # of Lawson's weights
_LEAST = 1e-4  # of a weight's change
_KEEP = 0.03  # of the former denominator, where the new one is not positive


@dataclass(frozen=True)
class Powers:
    """The powers of y that occur in N and in D.

    Attributes
    ----------
    top, bottom : tuple of int
        Exponents in N and D, ascending, each beginning with 0; the coefficient of y^0 in D is 1.
    """

    top: tuple[int, ...]
    bottom: tuple[int, ...]

    def __post_init__(self) -> None:
        for name, exponents in (("top", self.top), ("bottom", self.bottom)):
            if not exponents or exponents[0] != 0 or any(b <= a for a, b in pairwise(exponents)):
                raise ValueError(f"{name} is {exponents}: accepted are ascending exponents that begin with 0")

    @property
    def coefficients(self) -> int:
        """Number of free coefficients."""
        return len(self.top) + len(self.bottom) - 1

    @property
    def label(self) -> str:
        """The powers as text for tables, "0 4 8 / 0 4"."""
        return f"{' '.join(map(str, self.top))} / {' '.join(map(str, self.bottom))}"


@dataclass(frozen=True)
class LacunaryQuotient:
    """A lacunary quotient N(y)/D(y) with exact coefficients.

    Attributes
    ----------
    powers : Powers
    a, b : tuple of Fraction
        Coefficients, in the order of the exponents; b_0 = 1.
    """

    powers: Powers
    a: tuple[Fraction, ...]
    b: tuple[Fraction, ...]

    def __post_init__(self) -> None:
        if (len(self.a), len(self.b)) != (len(self.powers.top), len(self.powers.bottom)):
            numbers = f"{len(self.a)} and {len(self.b)} coefficients"
            raise ValueError(f"{self.powers.label} cannot have {numbers}: accepted is one for each power")
        if self.b[0] != 1:
            raise ValueError(f"the coefficient of y^0 in D is {self.b[0]}, it must be 1")

    def parts(self, y: FloatArray) -> tuple[FloatArray, FloatArray]:
        """Return N and D in double precision."""
        return evaluated(self.top, y), evaluated(self.bottom, y)

    @property
    def top(self) -> Terms:
        """N."""
        return terms(self.powers.top, self.a)

    @property
    def bottom(self) -> Terms:
        """D."""
        return terms(self.powers.bottom, self.b)


Terms = tuple[tuple[int, Fraction], ...]
"""A lacunary polynomial: exponents, ascending, and coefficients."""


def evaluated(polynomial: Terms, y: FloatArray) -> FloatArray:
    """Return the value of a lacunary polynomial by Horner's rule, in double precision."""
    total = np.zeros_like(y)
    below = (0, *(exponent for exponent, _ in polynomial[:-1]))
    for (exponent, coefficient), lower in reversed(list(zip(polynomial, below, strict=True))):
        total = (total + float(coefficient)) * y ** (exponent - lower)
    return total


def terms(exponents: Sequence[int], coefficients: Sequence[Fraction], shift: int = 0) -> Terms:
    """Return y^shift times a polynomial."""
    return tuple((exponent + shift, c) for exponent, c in zip(exponents, coefficients, strict=True))


def mirrored(polynomial: Sequence[tuple[int, Coefficient]], degree: int) -> tuple[tuple[int, Coefficient], ...]:
    """Return y^degree times the polynomial of 1/y; coefficients may be numbers or names."""
    return tuple((degree - exponent, c) for exponent, c in reversed(polynomial))


# --- rough fits -------------------------------------------------------------------------------------------------------


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
        Of Lawson's iteration.
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


def alternating(sample: Sample, deviation: FloatArray, number: int) -> list[float]:
    """Return up to `number` points with large errors of alternating signs."""
    starts = np.flatnonzero(np.diff(np.sign(deviation), prepend=0))
    parts = np.split(np.arange(len(deviation)), starts[1:])
    chosen = [int(part[np.argmax(np.abs(deviation[part]))]) for part in parts]
    while len(chosen) > number:
        sizes = np.abs(deviation[chosen])
        worst = int(np.argmin(sizes))
        if len(chosen) == number + 1 or worst in (0, len(chosen) - 1):
            chosen.pop(0 if sizes[0] < sizes[-1] else -1)
        else:
            first = worst - int(sizes[worst - 1] < sizes[worst + 1])
            del chosen[first : first + 2]
    # The last digits of roots differ from machine to machine; the result must not.
    return [float(f"{sample.y[i]:.9g}") for i in chosen]


# --- best quotients ---------------------------------------------------------------------------------------------------


def lacunary_problem(
    powers: Powers, target: Function, weight: Function, y_max: float, coordinate: remez.Coordinate, digits: int = 17
) -> remez.Problem:
    """Return the problem of minimising weight |N/(target D) - 1| on [0, y_max]."""
    gaps = []
    for i in range(max(powers.top[-1], powers.bottom[-1])):
        unit = tuple(arb(int(i == j)) for j in range(i + 1))
        gaps += [remez.Condition(unit, ())] if i < powers.top[-1] and i not in powers.top else []
        gaps += [remez.Condition((), unit)] if i < powers.bottom[-1] and i not in powers.bottom else []
    return remez.Problem(
        powers.top[-1],
        powers.bottom[-1],
        lambda y: 1 - target(y),
        lambda y: weight(y) / target(y),
        (0.0, y_max),
        conditions=tuple(gaps),
        digits=digits,
        coordinate=coordinate,
    )


def best(powers: Powers, stated: remez.Problem, sample: Sample) -> remez.Approximation:
    """Return the levelled quotient near the best rough one.

    Raises
    ------
    remez.NoBest
        If the error cannot be levelled.
    """
    found = rough([powers], sample)
    return remez.solve(stated, start=alternating(sample, found.deviation[0], stated.number_of_points))


def rounded(powers: Powers, found: remez.Approximation, factor: arb) -> LacunaryQuotient:
    """Return the quotient times a factor (in N), with the nearest doubles as coefficients."""
    a = [(found.a[k] if k < len(found.a) else arb(0)) * factor for k in powers.top]
    b = [found.b[k] if k < len(found.b) else arb(0) for k in powers.bottom]
    return LacunaryQuotient(powers, *(tuple(Fraction(float(c.mid())) for c in part) for part in (a, b)))
