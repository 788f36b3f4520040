r"""Remez exchange algorithm for best rational approximation with weights.

The problem: among N and D with given powers of v and N - D = O(v^k), D(0) = 1 and D > 0 on [x0, x1], find those that
minimise max |N/D - f|/w. k is the order of contact. The target f is given as g = (1 - f)/v^k and the weight as
p = v^k/w, so that the weighted error

    (N/D - f)/w = p (S/D + g),    S = (N - D)/v^k,

has no 0/0 at v = 0, where f - 1 and w vanish like v^k. k = 0 is the problem without contact. The algorithm uses the
powers and the contact only through a basis of the pairs (S, D).

The theorem behind it (elastic structure: k = 2, so a_0 = b_0 = 1 and a_1 = b_1; m + n - 1 free parameters):

    If R = N/D, D > 0 on the interval, has a weighted error of alternating signs at m + n points, then no other
    approximant of this kind has a smaller absolute weighted error at all of these points.

Proof: if N^/D^ were one, N D^ - N^ D = (N - D) D^ - (N^ - D^) D = v^2 q with q of degree m + n - 2 would have the signs
of the error of R at these points, hence m + n - 1 zeros in between: q = 0. So the smallest |error| at the points bounds
every approximant's error from below (de la Vallee-Poussin); it is reported beside the largest error of R. If both
agree, R is the best approximant, and the only one. (Without contact the number of points is m + n + 2.)

The algorithm: at m + n points, the points of reference, an eigenvalue problem gives the quotient whose errors there are
E, -E, E, … (`_level`; E is the level). Its extrema on the interval (`_extrema`) become the next points of reference
(`_exchange`), until the largest error is the level. Other first points are tried if that fails (`_references`).

Arithmetic: FLINT's, with many more bits than the values have; nothing here is proven.
"""

from __future__ import annotations

import math
from collections import Counter
from collections.abc import Callable, Iterable, Iterator, Sequence
from dataclasses import dataclass, field, replace
from functools import cached_property
from itertools import chain, pairwise
from typing import TypeVar

import numpy as np
from flint import acb_mat, arb, arb_mat, arb_poly

from viscopade.approximation.lacunary import Powers, full_powers
from viscopade.arithmetic.balls import bits_for, working
from viscopade.arrays.checked import FloatArray, Values

Number = TypeVar("Number")
Extremum = tuple[float, float]
"""A point and the weighted error there."""

# Nothing here is proven, and a constant that serves badly makes a fit slow, or refused. Measured for eps: all [m/n] up
# to [6/9] on [0, 1], [0, 5] and [0, 30], 175 fits with a result (with [0, 100]: 224).
# How far the errors are levelled, (error - lower bound)/error: two choices. Measured for the
# 224 fits: with 1e-6 errors change by up to 8e-7, with 1e-12 or 1e-14 by 7e-10, and no fit is gained or lost. The rough
# one serves in exchange number MAX_EXCHANGES alone, for values whose last digits allow no finer one; none of the 224
# comes so far.
TOLERANCE = 1e-9
ROUGH_TOLERANCE = 1e-6
MAX_EXCHANGES = 40  # measured: at most nine are needed; other first points follow if these fail
# A choice: 4 to 30 give the same 224 fits (measured). Some solutions take up to 18 steps; if it ends before, the next
# eigenvector or other first points serve.
MAX_NEWTON = 8
# Points between neighbours, on the fixed grid and again between the points of reference. Measured: with 32 the errors
# are the same to 1.5e-7, with 8 to 8e-5, with 4 to 1.2e-2.
GRID = 16
MAX_REFINEMENTS = 15  # measured: eleven are enough for all but 5 of 6,100 extrema
# Least width of a bracket's halves, over the distance between two changes of sign: grid points that are much closer
# have values that differ by rounding. Measured: with 0.002 and with 0.1 the errors are the same to 1.5e-7.
APART = 0.02
# Error of an extremum's place, over its bracket: the error of its value is quadratic in it, 1e-10.
CLOSE = 1e-5
# Scales of the coordinate for first points of reference, in the order of trial. Measured: with 1 alone 6 of 224 fits
# are lost, with the first three none; the last two are a margin.
SCALES = (1, 0.3, 3, 0.1, 10)
# Places of additional points, as parts of the distance to the nearest point. Measured: without them 5 of 224 fits are
# lost, with the first two none; the last two are a margin.
LAYERS = (0.3, 0.03, 1e-3, 1e-5)
# Digits of the values beyond the error's, a choice. The values of eps have 17 digits, so that errors from 10^-12 on
# have five.
GUARD = 5


class NoBest(ArithmeticError):
    """The exchange found no best approximant; the message is one line with the reason."""


class _NotFromHere(NoBest):
    """The exchange failed from some points of reference; other ones may succeed."""


class TooAccurate(NoBest):
    """The approximant's error is below the accuracy of the given values."""

    def __init__(self, error: float, digits: int) -> None:
        super().__init__(f"the error is about {error:.1e}, which is too small for values of {digits} digits")
        self.error = error


@dataclass(frozen=True)
class Coordinate:
    """Coordinate in which grids are uniform: t = ln(1 + v/scale), or for the half-line t = v/(scale + v)."""

    scale: float = 1.0
    half_line: bool = False

    def t(self, v: Values) -> Values:
        """Return the coordinate of points."""
        return v / (self.scale + v) if self.half_line else np.log1p(v / self.scale)

    def v(self, t: Values) -> Values:
        """Return the points at coordinates."""
        return self.scale * (t / (1 - t) if self.half_line else np.expm1(t))


class _Computed(dict[float, tuple[arb, arb]]):
    """g and p by point, as far as they have been computed."""

    level = 0.0
    """The largest of the smallest levelled errors at points of reference, which is tiny if the best error is."""


@dataclass(frozen=True)
class Problem:
    """An approximation problem: powers and contact, target, weight and interval.

    Attributes
    ----------
    powers : Powers
        Powers of v in N and in D; all powers up to the degrees if there is contact.
    values : callable
        Function that returns g = (1 - f)/v^k and p = v^k/w at v. Arguments and results are balls whose middles count;
        v is a double.
    interval : tuple of two floats
        0 <= x0 < x1; for the half-line, an x1 beyond which the error hardly changes.
    contact : int
        k; 0 for no contact.
    digits : int
        Decimal accuracy of g (relative to w/v^k) and of p. The default is that of the values of eps, `target.DIGITS`.
    coordinate : Coordinate
        In which grids are uniform. The default, ln(1 + v), serves v* from small to large.
    """

    powers: Powers
    values: Callable[[arb], tuple[arb, arb]]
    interval: tuple[float, float]
    contact: int = 0
    digits: int = 17
    coordinate: Coordinate = field(default_factory=Coordinate)
    computed: _Computed = field(default_factory=_Computed, repr=False, compare=False)

    def __post_init__(self) -> None:
        low, high = self.interval
        if not 0 <= low < high < math.inf:
            raise ValueError(f"interval is {self.interval}: expected two finite numbers, 0 <= x0 < x1")

    @property
    def bits(self) -> int:
        """Working precision: far more than the digits of the values, as linear systems lose some.

        Measured: 64 bits beyond the digits of the values give the same fits up to [6/9]. Four times the digits, and 16
        bits for each degree, are choices, and leave room for systems of higher degrees.
        """
        return 4 * bits_for(self.digits) + 16 * (self.powers.m + self.powers.n) + 64

    @property
    def least_error(self) -> float:
        """The smallest error that the accuracy of the values can resolve."""
        return 10.0 ** (GUARD - self.digits)

    @property
    def sees_zero(self) -> bool:
        """Whether the weighted error at v = 0 exists and depends on the approximant; within `working`."""
        if self.interval[0] > 0:
            return False
        # The weighted error is p (S/D + g) = p (S + g D)/D with D(0) = 1: what each coefficient adds to p (S + g D) at
        # 0, where g and p are finite (module head). Below the accuracy of the values it counts as 0. The fixed
        # coefficient D(0) is among them, which makes no difference: where p is not 0, free ones change the error, too.
        g, p = self.values_at(0.0)
        changes = (p * (s(arb(0)) + g * d(arb(0))) for s, d in self.directions)
        return any(abs(change) > arb(10) ** -self.digits for change in changes)

    def values_at(self, v: float) -> tuple[arb, arb]:
        """Return g and p at a point, which are computed once."""
        if v not in self.computed:
            g, p = self.values(arb(v))
            self.computed[v] = g.mid(), p.mid()
        return self.computed[v]

    @cached_property
    def places(self) -> tuple[tuple[int | None, int | None], ...]:
        """Powers in N and in D of each coefficient; below v^k, N and D have common coefficients."""
        top, bottom, k = self.powers.top, self.powers.bottom, self.contact
        shared = [(i, i) for i in range(k) if i in top and i in bottom]
        return (*shared, *((i, None) for i in top if i >= k), *((None, j) for j in bottom if j >= k))

    @cached_property
    def directions(self) -> tuple[tuple[arb_poly, arb_poly], ...]:
        """The pair (S, D) of each coefficient."""
        numbers = range(self.number_of_points)
        return tuple(self.pair(*self.placed([arb(int(i == k)) for i in numbers], arb(0))) for k in numbers)

    def pair(self, a: Sequence[arb], b: Sequence[arb]) -> tuple[arb_poly, arb_poly]:
        """Return (S, D) from the coefficients of N and D by ascending powers."""
        d = arb_poly(list(b))
        difference = [c.mid() for c in (arb_poly(list(a)) - d).coeffs()]
        return arb_poly(difference[self.contact :]), d

    def placed(self, values: Sequence[Number], zero: Number) -> tuple[list[Number], list[Number]]:
        """Return the coefficients of N and D by ascending powers, from the `values` of those of `places`.

        `zero` is the coefficient of powers that do not occur.
        """
        # A common coefficient (below the order of contact) has a place in both.
        a, b = ([zero] * (degree + 1) for degree in (self.powers.m, self.powers.n))
        for (i, j), c in zip(self.places, values, strict=True):
            if i is not None:
                a[i] = c
            if j is not None:
                b[j] = c
        return a, b

    @property
    def number_of_points(self) -> int:
        """Number of points at which the best approximant's error is largest, with alternating signs."""
        return len(self.places)


@dataclass(frozen=True)
class Approximation:
    """A levelled approximant: its error equioscillates.

    Attributes
    ----------
    a, b : list of flint.arb
        Coefficients by ascending powers, middles; b_0 = 1.
    error, lower_bound : float
        Largest weighted error (sampled), and a lower bound of that of every approximant.
    points, deviations : tuple of float
        Extrema of the weighted error, with alternating signs, and its values there.
    """

    a: list[arb]
    b: list[arb]
    error: float
    lower_bound: float
    points: tuple[float, ...]
    deviations: tuple[float, ...]


def solve(problem: Problem, start: Sequence[float] | None = None) -> Approximation:
    """Return the best approximant.

    Parameters
    ----------
    problem : Problem
    start : sequence of float, optional
        First points of reference, ascending: `problem.number_of_points` of them (as from a similar problem).

    Raises
    ------
    NoBest
        If none was found: the message says why.
    TooAccurate
        If the error is below 10^(GUARD - digits).
    """
    with working(problem.bits):
        return _first_success(problem, _references(problem, start))


# --- points of reference ----------------------------------------------------------------------------------------------


def _first_success(problem: Problem, references: Iterable[list[float]]) -> Approximation:
    """Return a problem's result from the first points of `references` that succeed.

    If none does, the error has the most frequent reason.
    """
    # `TooAccurate` is not caught: other points make the values no more accurate.
    reasons = Counter[str]()
    for reference in references:
        try:
            return _exchange(problem, reference)
        except _NotFromHere as reason:
            reasons[str(reason)] += 1
    raise _NotFromHere(reasons.most_common(1)[0][0])


def _references(problem: Problem, start: Sequence[float] | None) -> Iterator[list[float]]:
    """Yield first points of reference for a problem, the cheapest first: `start`, if it has the right number."""
    if start is not None and len(start) == problem.number_of_points:
        yield list(start)
    yield from _starts(problem)
    # Every start failed. If each of its references had a tiny levelled error, the values have too few digits.
    if problem.computed.level < problem.least_error:
        raise TooAccurate(problem.computed.level, problem.digits)
    # Other starts, from the best quotient [m-1/n-1], if all powers up to the degrees occur, and both are at least 1.
    powers = problem.powers
    if powers == full_powers(powers.m, powers.n) and min(powers.m, powers.n) >= 1:
        yield from _from_lower_degrees(problem, replace(problem, powers=full_powers(powers.m - 1, powers.n - 1)))


def _starts(problem: Problem) -> Iterator[list[float]]:
    """Yield the extrema of Chebyshev's polynomial in different coordinates, without a left end that does not count."""
    number = problem.number_of_points
    vanishing = int(problem.interval[0] == 0 and not problem.sees_zero)  # the error at the left end is 0
    # cos(pi i/(number - 1)) for i = number - 1 … 0, from -1 to 1. Without the left end they are those of one point
    # more, cos(pi i/number), without the first one, -1. (A single point would be 0/0, hence the 1.) The scale of the
    # coordinate decides where the points crowd.
    cosines = np.cos(np.pi * (np.arange(number - 1, -1, -1) / max(number - 1 + vanishing, 1)))
    for factor in SCALES:
        yield _spread(problem, cosines, replace(problem.coordinate, scale=factor * problem.coordinate.scale))


def _from_lower_degrees(problem: Problem, lower: Problem) -> Iterator[list[float]]:
    """Yield the points of the best [m-1/n-1], the problem `lower`, with two more: at the ends, or within a gap.

    Where the best [m/n] nearly has a common factor it differs little from that; but it is not known where.
    """
    # The lower degrees have two points fewer, and their first and last two are used below: so there must be two.
    if problem.number_of_points < 4:
        return
    try:
        points = _first_success(lower, _starts(lower)).points
    except _NotFromHere:
        return
    # In the coordinate: near the left end and at the right one, near both ends, or two that cut a gap into thirds. Two
    # in one gap fit into the alternation there, and where the error of [m/n] alternates twice more is not known. Thirds
    # are a choice: fifths between points find the same (measured); without these additions 3 of 224 fits are lost.
    t = problem.coordinate.t(np.array(points))
    low, high = problem.coordinate.t(np.array(problem.interval))
    additions = [(low + (t[1] - low) * part, high) for part in LAYERS]
    additions += [(low + (t[1] - low) * part, high - (high - t[-2]) * part) for part in LAYERS]
    additions += [(left + (right - left) / 3, right - (right - left) / 3) for left, right in pairwise([*t, high])]
    additions += [(low + (t[0] - low) / 3, t[0] - (t[0] - low) / 3)]
    for more in additions:
        merged = np.unique([*t, *more])
        if len(merged) == problem.number_of_points:
            yield _inside(problem, problem.coordinate.v(merged))


def _spread(problem: Problem, cosines: FloatArray, coordinate: Coordinate) -> list[float]:
    """Return the points of the interval at which a coordinate, scaled to [-1, 1], has given values."""
    low, high = coordinate.t(np.array(problem.interval))
    return _inside(problem, coordinate.v(low + (high - low) * (1 + cosines) / 2))


def _inside(problem: Problem, points: FloatArray) -> list[float]:
    """Return the points without repetitions, those beyond the ends moved to the ends."""
    return [float(v) for v in np.unique(np.clip(points, *problem.interval))]


def between(problem: Problem, points: Sequence[float], parts: int) -> list[float]:
    """Return the ends of the interval and some points, with points that cut the intervals between them into parts."""
    ends = np.unique([*problem.interval, *points])
    t = problem.coordinate.t(ends)
    finer = problem.coordinate.v((t[:-1, None] + np.diff(t)[:, None] * np.arange(1, parts) / parts).ravel())
    return _inside(problem, np.array([*ends, *finer]))


# --- the exchange -----------------------------------------------------------------------------------------------------


def _exchange(problem: Problem, reference: list[float]) -> Approximation:
    """Level and exchange until the largest error is the levelled one.

    Parameters
    ----------
    problem : Problem
    reference : list of float
        The first points at which the error is levelled, ascending.
    """
    solution: _Solution | None = None
    for step in range(1, MAX_EXCHANGES + 1):
        # Level: the quotient whose errors at the points of reference are E, -E, E, … (to 1e-9, a choice). Exchange
        # number MAX_EXCHANGES is the last, and accepts a rougher levelling: the values may not allow a finer one.
        tolerance = TOLERANCE if step < MAX_EXCHANGES else ROUGH_TOLERANCE
        solution = _level(problem, reference, solution)
        a, b = problem.placed(solution.vector, arb(0))
        # The extrema of its error on the interval; too few of them, where rounding of the values hides the error.
        extrema = _extrema(problem, a, b, reference)
        if len(extrema) < len(reference):
            if abs(solution.level) < problem.least_error:
                raise TooAccurate(abs(float(solution.level)), problem.digits)
            raise _NotFromHere(f"the error alternates {len(extrema)} times, not {len(reference)}")
        # Exchange: the extrema become the points of reference. The least of these errors bounds that of every quotient
        # from below (de la Vallee-Poussin), if no powers are left out. Where it is also the largest on the interval,
        # the quotient is the best.
        chosen = alternating(extrema, len(reference))
        largest, least = max(map(_size, extrema)), min(map(_size, chosen))
        if largest < problem.least_error:
            raise TooAccurate(largest, problem.digits)
        reference = [v for v, _ in chosen]
        if least >= (1 - tolerance) * largest:
            points, deviations = zip(*chosen, strict=True)
            return Approximation(a, b, largest, least, points, deviations)
    raise _NotFromHere(f"the error is not levelled after {MAX_EXCHANGES} exchanges")


def _size(extremum: Extremum) -> float:
    """Return the absolute value of the error."""
    return abs(extremum[1])


def _extrema(problem: Problem, a: Sequence[arb], b: Sequence[arb], reference: Sequence[float]) -> list[Extremum]:
    """Return the largest error between each two changes of sign, as points and values of alternating signs.

    They are looked for on a fixed grid, at the points of reference and at more between these.

    Parameters
    ----------
    a, b : sequence of flint.arb
        Coefficients of N and D by ascending powers.
    reference : sequence of float
        Points at which the error is levelled, near which extrema are expected.
    """
    s, d = problem.pair(a, b)

    def deviation(v: float) -> float:
        """Return the weighted error p (S/D + g); NaN where D is not positive."""
        x = arb(v)
        g, p = problem.values_at(v)
        denominator = d(x).mid()
        return float((p * (s(x).mid() / denominator + g)).mid()) if denominator > 0 else math.nan

    # Chebyshev's points in the coordinate, `GRID` = 16 (measured, above) for each extremum and one more, and half as
    # many between points of reference, a choice: with a quarter the errors are the same to 1e-10.
    number = GRID * (problem.number_of_points + 1)
    fixed = _spread(problem, np.cos(np.pi * np.arange(number, -1, -1) / number), problem.coordinate)
    grid = _inside(problem, np.array([*fixed, *between(problem, reference, GRID // 2)]))
    deviations = np.array([deviation(v) for v in grid])
    if np.isnan(deviations).any():
        raise _NotFromHere(f"the approximant has a pole near v* = {grid[int(np.argmax(np.isnan(deviations)))]:.3g}")
    t = problem.coordinate.t(np.array(grid))
    extrema: list[Extremum] = []
    # A part of one sign, grid points low … high - 1; a part in which the error is exactly 0 has no extremum.
    for low, high in pairwise([*changes_of_sign(deviations), len(grid)]):
        if not deviations[low]:
            continue
        top = low + int(np.argmax(np.abs(deviations[low:high])))
        # Within the interval, a bracket of three points around the largest one refines it: neighbours on the grid, but
        # not closer than `apart`.
        apart = APART * (t[min(high, len(t) - 1)] - t[max(low - 1, 0)])
        extremum = grid[top], float(deviations[top])
        if 0 < top < len(t) - 1:
            left, right = (int(np.searchsorted(t, t[top] + side)) for side in (-apart, apart))
            bracket = max(left - 1, 0), top, min(right, len(t) - 1)
            heights = [(float(t[i]), math.copysign(1.0, extremum[1]) * float(deviations[i])) for i in bracket]
            extremum = _refine(problem, deviation, extremum, heights)
        # Two parts of one sign, with an exact 0 between them, count as one.
        if extrema and extrema[-1][1] * extremum[1] > 0:
            extrema[-1] = max(extrema[-1], extremum, key=_size)
        else:
            extrema.append(extremum)
    return extrema


def changes_of_sign(deviations: FloatArray) -> list[int]:
    """Return where a part of one sign begins."""
    return [int(i) for i in np.flatnonzero(np.diff(np.sign(deviations), prepend=0))]


def _refine(
    problem: Problem, deviation: Callable[[float], float], best: Extremum, points: list[tuple[float, float]]
) -> Extremum:
    """Return the extremum within a bracket: parabolas through the three best points.

    Parameters
    ----------
    problem : Problem
    deviation : callable
        Function that returns the weighted error at a point.
    best : Extremum
        The largest error on the grid.
    points : list of three (place, height)
        The bracket, places in the coordinate; a height is the error, its sign changed where the extremum is negative.
    """
    coordinate, (low, high) = problem.coordinate, problem.interval
    sign = math.copysign(1.0, best[1])
    close = CLOSE * (points[2][0] - points[0][0])
    for _ in range(MAX_REFINEMENTS):
        t = _vertex(points)
        (t0, f0), (t1, f1), (t2, f2) = points
        if t == t1:
            break
        v = min(max(float(coordinate.v(t)), low), high)
        height = sign * deviation(v)
        best = max(best, (v, sign * height), key=_size)
        # The higher one of t and t1 is the bracket's new middle; the other one replaces the end on its side.
        if height > f1:
            points = [(t0, f0), (t, height), (t1, f1)] if t < t1 else [(t1, f1), (t, height), (t2, f2)]
        else:
            points = [(t, height), (t1, f1), (t2, f2)] if t < t1 else [(t0, f0), (t1, f1), (t, height)]
        if abs(t - t1) < close:
            break
    return best


def _vertex(points: list[tuple[float, float]]) -> float:
    """Return the place at which the parabola through three points is highest; a golden section if that is outside."""
    # Newton's form of the parabola has the slope 0 at t1 + (left (t2 - t1) - right (t1 - t0))/(2 (left + right)), where
    # left = (f1 - f0)(t2 - t1), right = (f1 - f2)(t1 - t0); left + right > 0 if it opens downwards.
    (t0, f0), (t1, f1), (t2, f2) = points
    left, right = (f1 - f0) * (t2 - t1), (f1 - f2) * (t1 - t0)
    if left + right > 0:
        t = t1 + (left * (t2 - t1) - right * (t1 - t0)) / (left + right) / 2
        if t0 < t < t2:
            return t
    # The golden section of the longer half: 0.382 = (3 - sqrt(5))/2.
    return t1 + 0.382 * (t2 - t1) if t2 - t1 > t1 - t0 else t1 - 0.382 * (t1 - t0)


def alternating(extrema: Sequence[Extremum], number: int) -> list[Extremum]:
    """Return at most `number` neighbours of some extrema of alternating signs, the largest among them."""
    chosen = list(extrema)
    while len(chosen) > number:
        # Without the smallest one: at an end, or if one too many is left, the smaller of both ends goes. In the middle
        # it goes with its smaller neighbour, so that the signs still alternate.
        sizes = [_size(extremum) for extremum in chosen]
        worst = sizes.index(min(sizes))
        if len(chosen) == number + 1 or worst in (0, len(chosen) - 1):
            chosen.pop(0 if sizes[0] < sizes[-1] else -1)
        else:
            first = worst - int(sizes[worst - 1] < sizes[worst + 1])
            del chosen[first : first + 2]
    return chosen


# --- levelling --------------------------------------------------------------------------------------------------------


@dataclass(frozen=True)
class _Solution:
    """A quotient whose weighted errors at points of reference are E, -E, E, …."""

    vector: tuple[arb, ...]
    """The coefficients c, in the order of `Problem.places`."""
    level: arb
    """E, with its sign."""


def _level(problem: Problem, reference: list[float], previous: _Solution | None) -> _Solution:
    """Return the quotient, D > 0, whose weighted errors at the points of reference are E, -E and so on.

    p (S/D + g) = ±E, times D, is linear in the coefficients c: (A - E B) c = 0 with A c = p (S + g D) and B c = ±D.

    Parameters
    ----------
    problem : Problem
    reference : list of float
        The points, as many as there are coefficients.
    previous : _Solution, optional
        A first guess, such as the solution at the points of the exchange before.
    """
    rows_a, rows_b = [], []
    for i, v in enumerate(reference):
        x = arb(v)
        g, p = problem.values_at(v)
        # S and D of each coefficient alone
        pairs = [(s(x).mid(), d(x).mid()) for s, d in problem.directions]
        rows_a.append([(p * (s + g * d)).mid() for s, d in pairs])
        rows_b.append([d if i % 2 == 0 else -d for _, d in pairs])
    a, b = arb_mat(rows_a), arb_mat(rows_b)
    # There are as many solutions as eigenvalues; with all powers up to the degrees, at most one has D > 0 at all
    # points.
    for guess in chain([] if previous is None else [previous], _eigenvectors(problem, a, b)):
        if (solution := _newton(problem, a, b, guess)) is not None:
            return solution
    raise _NotFromHere("no denominator is positive at all points of reference")


def _eigenvectors(problem: Problem, a: arb_mat, b: arb_mat) -> Iterator[_Solution]:
    """Yield the solutions of (A - E B) c = 0 with a real E: the eigenvectors of A^-1 B, with the eigenvalues 1/E."""
    product = a.solve(b, algorithm="approx", nonstop=True)  # A^-1 B
    number = problem.number_of_points
    # Coefficients of N alone have a column of zeros in B. The eigenvalues are those of the block of the others. The
    # columns of B are scaled to the size 1, so that powers of v of different size are balanced; this changes no
    # eigenvalue, and the eigenvectors by 1/scale (measured: no fit depends on it).
    active = [k for k, (_, j) in enumerate(problem.places) if j is not None]
    scale = [max((abs(b[i, k]) for i in range(number)), key=float) for k in range(number)]
    block = acb_mat([[product[j, k] * scale[j] / scale[k] for k in active] for j in active])
    eigenvalues, vectors = block.eig(algorithm="approx", right=True, nonstop=True)
    # The eigenvalues are 1/E, so the largest gives the smallest level at these points; 0 if FLINT gave up.
    sizes = [float(abs(eigenvalue)) for eigenvalue in eigenvalues]
    least = 0.0 if any(map(math.isnan, sizes)) else 1 / max(sizes)
    problem.computed.level = max(problem.computed.level, least)
    for index, eigenvalue in enumerate(eigenvalues):
        # Real but for rounding: an imaginary part of 2^-40 is more than rounding leaves. Any number between rounding
        # and 1 serves (measured: 2^-3 and 2^-100 give the same fits), as a complex one that passes costs `_newton` a
        # few steps, nothing else.
        real = eigenvalue.real.mid()
        if not real.is_finite() or real == 0 or abs(eigenvalue.imag) > abs(real) * arb(2) ** -40:
            continue
        # c = A^-1 B c E, for which the coefficients in D are enough.
        in_d = [[arb(0)] for _ in range(number)]
        for i, k in enumerate(active):
            in_d[k] = [(vectors[i, index].real / scale[k]).mid()]
        column = product * arb_mat(in_d) / real
        yield _Solution(tuple(column[i, 0].mid() for i in range(number)), (1 / real).mid())


def _newton(problem: Problem, a: arb_mat, b: arb_mat, guess: _Solution) -> _Solution | None:
    """Solve (A - E B) c = 0, D(0) = 1, from a guess of c and E; None if that fails, or gives a D that is not positive.

    Newton's method for both: (A - E B) c_new - (B c) dE = 0, and the coefficient of D(0) in c_new is 1.
    """
    number, first = problem.number_of_points, [j for _, j in problem.places].index(0)
    # The guess is scaled to D(0) = 1.
    d_at_0 = guess.vector[first]
    if not d_at_0.is_finite() or d_at_0 == 0:
        return None
    column, level = arb_mat([[(c / d_at_0).mid()] for c in guess.vector]), guess.level
    for _ in range(MAX_NEWTON):
        # The unknowns are c_new and dE; the last row is the condition D(0) = 1.
        a_minus_eb = (a - b * level).mid()
        b_c = (b * column).mid()
        matrix = [[*(a_minus_eb[i, k] for k in range(number)), -b_c[i, 0]] for i in range(number)]
        matrix.append([arb(int(k == first)) for k in range(number + 1)])
        right = arb_mat([[arb(int(i == number))] for i in range(number + 1)])
        *c_new, [step] = arb_mat(matrix).solve(right, algorithm="approx", nonstop=True).mid().tolist()
        if not all(c.is_finite() for c in (step, *(c for [c] in c_new))):
            return None
        column, level = arb_mat(c_new), (level + step).mid()
        # Convergence is quadratic: after a step of 10^-20 of E the error is far smaller (a choice: 10^-10 and 10^-30
        # give the same fits). Twice the digits of the values are enough for a tiny E, a choice.
        if abs(step) <= abs(level) * arb(10) ** -20 + arb(10) ** (-2 * problem.digits):
            # B c = ±D: D at the points of reference.
            denominators = [float((b * column)[i, 0].mid()) * (-1) ** i for i in range(number)]
            vector = tuple(arb(1) if i == first else column[i, 0].mid() for i in range(number))
            return _Solution(vector, level) if min(denominators) > 0 else None
    return None
