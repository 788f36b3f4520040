"""Machine coefficients: doubles or floats as coefficients of an approximant, chosen together by lattice reduction.

A combination with a small error is better than the nearest numbers: a close point of a lattice, as in fpminimax of
Brisebarre and Chevillard.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from contextlib import suppress
from dataclasses import dataclass
from fractions import Fraction
from functools import cached_property
from itertools import combinations

import numpy as np
import numpy.typing as npt
from flint import arb, arb_mat, fmpz_mat

from viscopade.approximation import remez
from viscopade.approximation.minimax import Fit, _check, _shown, minimax_problem
from viscopade.arithmetic.balls import ball_of, exact_middle, working
from viscopade.arithmetic.formats import DOUBLE, Format
from viscopade.arrays.checked import FloatArray

SAMPLES = 12  # points from one extremum of the error to the next, in the search for machine coefficients
LATTICE_BITS = 48  # bits of errors, in units of the best one, in the reduction of lattices
MAX_STEPS = 200
MAX_ROUNDS = 3
LARGE_MOVES = (0.2, 100.0)  # relative changes of a coefficient: cautious and bold
LEAST_GAIN = 1e-6


@dataclass(frozen=True)
class MachineFit:
    """An approximant whose coefficients are numbers of a binary format.

    Attributes
    ----------
    fit : Fit
        The best approximant.
    form : Format
        The format.
    a, b : tuple of float
        Coefficients, ascending: numbers of the format; a_0 = b_0 = 1, a_i = b_i for i < d.
    error : float
        Largest error, if it is evaluated without rounding (sampled).
    rounded_error : float
        The same if each coefficient of `fit` were rounded to the nearest number.
    """

    fit: Fit
    form: Format
    a: tuple[float, ...]
    b: tuple[float, ...]
    error: float
    rounded_error: float

    def __post_init__(self) -> None:
        a, b = self.exact
        _check(a, b, self.fit)
        if any(self.form.nearest(c) != c for c in (*a, *b)):
            raise ValueError(f"a coefficient is not a number in {self.form.name}")
        if not self.error <= self.rounded_error:
            raise ValueError("the error is larger than that of rounded coefficients")

    @cached_property
    def exact(self) -> tuple[tuple[Fraction, ...], tuple[Fraction, ...]]:
        """The coefficients a and b as fractions."""
        return tuple(map(Fraction, self.a)), tuple(map(Fraction, self.b))


def machine(best: Fit, form: Format = DOUBLE) -> MachineFit:
    """Return an approximant with coefficients of a binary format and a small error.

    The error is linear in small changes of the coefficients, so the numbers of the format form a lattice in the space
    of errors. From a close point of it (LLL reduction, Babai's nearest plane), single steps and pairs of steps along
    the reduced basis follow as long as the largest error decreases.

    Parameters
    ----------
    best : Fit
    form : Format
        `formats.DOUBLE` or `formats.FLOAT`.

    Raises
    ------
    ValueError
        If a coefficient is not a normal number of the format.
    """
    task = minimax_problem(best.m, best.n, best.interval)
    with working(task.bits):
        start = _Grid(task, best, form)
        grids, nearest = [start], start.centre
        errors = {nearest: start.error(nearest)}
        for _ in range(MAX_ROUNDS):
            found = {shifted for grid in grids for shifted in grid.near()}
            for free in sorted(found - errors.keys()):
                if start.holds(free):
                    errors[free] = start.error(free)
            # a coefficient that moved into another binade has other steps there
            moved = [_Grid(task, best, form, free) for free in found]
            known = [grid.steps for grid in grids]
            grids = [grid for grid in moved if grid.steps not in known]
        free = min(errors, key=errors.__getitem__)  # of equal ones the first, which is the nearest
        a, b = task.placed([1.0, *map(float, free)], 0.0)
    return MachineFit(best, form, tuple(a), tuple(b), errors[free], errors[nearest])


class _Grid:
    """The numbers of a format near given coefficients (the fit's own), as whole steps from the nearest ones."""

    def __init__(self, task: remez.Problem, best: Fit, form: Format, near: Sequence[Fraction] | None = None) -> None:
        self.task, self.best, self.form = task, best, form
        self.places = task.places[1:]  # of the free coefficients
        a, b = best.exact
        self.exact = [a[i] if i is not None else b[j or 0] for i, j in self.places]
        pairs = zip(self.places, self.exact if near is None else near, strict=True)
        self.centre = tuple(self._nearest(place, c) for place, c in pairs)
        self.steps = [Fraction(2) ** (math.frexp(float(c))[1] - form.precision) for c in self.centre]

    def _nearest(self, place: tuple[int | None, int | None], number: Fraction) -> Fraction:
        try:
            return Fraction(self.form.nearest(number))
        except ValueError as error:
            i, j = place
            name = f"b_{j}" if i is None else f"a_{i}"
            raise ValueError(f"{self.best.label} on {_shown(self.best.interval)}: {name} = {error}") from None

    def error(self, free: Sequence[Fraction]) -> float:
        """Return the largest error with given free coefficients, infinite if the denominator is not positive."""
        a, b = self.task.placed([arb(1), *map(ball_of, free)], arb(0))
        try:
            return remez.sup_error(self.task, a, b, self.best.points)
        except remez.NoBest:
            return math.inf

    def holds(self, free: Sequence[Fraction]) -> bool:
        """Return whether all coefficients are numbers of the format: steps may lead out of a binade."""
        with suppress(ValueError):
            return all(self.form.nearest(c) == c for c in free)
        return False

    def near(self) -> set[tuple[Fraction, ...]]:
        """Return free coefficients with small errors."""
        candidates = set[tuple[int, ...]]().union(*(_candidates(self, move) for move in LARGE_MOVES))
        return {
            tuple(c + shift * step for c, step, shift in zip(self.centre, self.steps, shifts, strict=True))
            for shifts in candidates
        }


def _candidates(grid: _Grid, large_move: float) -> set[tuple[int, ...]]:
    """Return steps of the coefficients with small errors, as far as errors are linear in the steps.

    Errors are sampled, in units of the smallest possible error. The reduced basis of the lattice of steps depends on
    their effects on the errors, and on relative changes of the coefficients, weighted with the cost of a large one.
    Descents begin at the rounded coefficients and at two points near the best ones. To be used within `working`.
    """
    optimum, rows = _linearised(grid)
    effects = arb_mat(rows)
    offsets = [(r - c) / step for r, c, step in zip(grid.centre, grid.exact, grid.steps, strict=True)]
    start = optimum + _doubles(arb_mat([[ball_of(x) for x in offsets]]) * effects)[0]
    # Some combinations of coefficients hardly change the error: they must not leave the region where it is linear.
    price = max(abs(start).max(), 1.0) / large_move
    prices = [price * float(step / abs(c)) for c, step in zip(grid.centre, grid.steps, strict=True)]
    moves = arb_mat([[arb(p if i == j else 0) for j in range(len(prices))] for i, p in enumerate(prices)])
    rows = [[*row, *move] for row, move in zip(rows, moves.tolist(), strict=True)]
    whole = fmpz_mat([[round(exact_middle(x) * 2**LATTICE_BITS) for x in row] for row in rows])
    _, transform = whole.lll(True)
    integers = np.array([[int(x) for x in row] for row in transform.tolist()], dtype=object)
    basis, reduced = (_doubles(arb_mat(transform) * part) for part in (effects, moves))
    whole_basis = np.hstack([basis, reduced])
    origins = (*(_nearest_plane(whole_basis, error) for error in (start, start - optimum)), np.zeros(len(basis)))
    return {tuple(int(x) for x in _descended(origin, start, basis) @ integers) for origin in origins}


def _nearest_plane(basis: FloatArray, target: FloatArray) -> FloatArray:
    """Return the vector of the basis whose first components nearly cancel the target (Babai's nearest plane)."""
    q, r = np.linalg.qr(basis.T)
    rest, steps = -(q[: len(target)].T @ target), np.zeros(len(basis))
    for k in range(len(steps) - 1, -1, -1):
        steps[k] = np.round(rest[k] / r[k, k])
        rest -= steps[k] * r[:, k]
    return steps


def _descended(steps: FloatArray, start: FloatArray, basis: FloatArray) -> npt.NDArray[np.object_]:
    """Take single and double steps along the basis while the largest error falls."""
    singles = np.concatenate([np.eye(len(steps)), -np.eye(len(steps))])
    sums = (left + right for left, right in combinations(singles, 2))
    moves = np.array([*singles, *(both for both in sums if both.any())])
    effects = moves @ basis
    error = start + steps @ basis
    for _ in range(MAX_STEPS):
        sizes = np.abs(error + effects).max(axis=1)
        move = int(np.argmin(sizes))
        if not sizes[move] < (1 - LEAST_GAIN) * np.abs(error).max():
            break
        steps, error = steps + moves[move], error + effects[move]
    return np.array([int(x) for x in steps], dtype=object)


def _linearised(grid: _Grid) -> tuple[FloatArray, list[list[arb]]]:
    """Return the fit's errors at points and their changes by a step of each coefficient, over the largest error."""
    task = grid.task
    s, d = task.pair(*([ball_of(c) for c in values] for values in grid.best.exact))
    optimum, rows = [], [[] for _ in grid.places]  # type: tuple[list[float], list[list[arb]]]
    for v in remez.between(task, grid.best.points, SAMPLES):
        x = arb(v)
        g, p = task.at(v)
        below, unit = d(x).mid(), (p / grid.best.error).mid()
        ratio = (s(x) / below).mid()
        optimum.append(float((unit * (ratio + g)).mid()))
        for row, (s_k, d_k), step in zip(rows, task.directions[1:], grid.steps, strict=True):
            row.append((unit * (s_k(x) - ratio * d_k(x)) * ball_of(step) / below).mid())
    return np.array(optimum), rows


def _doubles(matrix: arb_mat) -> FloatArray:
    return np.array([[float(x.mid()) for x in row] for row in matrix.tolist()])
