r"""Remez exchange algorithm for best rational approximation with weights and linear constraints.

The problem: among N of degree m and D of degree n that fulfil homogeneous linear conditions, D(0) = 1 and D > 0 on
[x0, x1], find those that minimise max |N/D - f|/w. The target f is given as g = (1 - f)/v^k and the weight as
p = v^k/w, with k the order of contact (N - D = O(v^k) is one of the conditions), so that the weighted error

    (N/D - f)/w = p (S/D + g),    S = (N - D)/v^k,

has no 0/0 at v = 0 where f - 1 and w vanish like v^k. Without contact, k = 0, this is every other problem.

The theorem behind it (elastic structure: k = 2, so a_0 = b_0 = 1 and a_1 = b_1; m + n - 1 free parameters):

    If R = N/D, D > 0 on the interval, has m + n points where the weighted error is of alternating signs, then no
    other such approximant has a weighted error that is smaller in absolute value at all of these points.

For if N^/D^ were one, N D^ - N^ D = (N - D) D^ - (N^ - D^) D = v^2 q with q of degree m + n - 2 would have the signs of
the error of R at these points, hence m + n - 1 zeros in between: q = 0. So the least of the |errors| at the points
bounds every approximant's error from below (de la Vallee-Poussin); it is reported beside the error attained. If both
agree, R is the best, and the only one. Without constraints it is m + n + 2 points, and one less for every condition.

Arithmetic: FLINT's, with many more bits than the values have; nothing here is proven.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass, field, replace
from functools import cached_property, partial
from itertools import pairwise

import numpy as np
from flint import acb_mat, arb, arb_mat, arb_poly

from viscopade.arithmetic.balls import bits_for, working
from viscopade.arrays.checked import FloatArray, Values

Function = Callable[[arb], arb]

TOLERANCE = 1e-9  # of levelling: (error - lower bound)/error
ROUGH_TOLERANCE = 1e-6  # where the last digits of the values are needed
MAX_EXCHANGES = 40
MAX_NEWTON = 8
GRID = 16  # points between neighbours, on the fixed grid and again between the points of reference
MAX_REFINEMENTS = 15
APART = 0.02  # of the distance between two changes of sign: the least width of a bracket's halves
CLOSE = 1e-5  # of a bracket: how well extrema are found (their values better by far)
CONTINUATION = (0.03, 0.1, 0.2, 0.4, 0.7)
LEAST_STEP = 1e-3
SCALES = (1, 0.3, 3, 0.1, 10)
LAYERS = (0.3, 0.03, 1e-3, 1e-5)
GUARD = 5  # digits of the values beyond the error's


class NoBest(ArithmeticError):
    """Error: the exchange found no best approximant; the message is one line with the reason."""


class TooAccurate(NoBest):
    """Error: the approximant's error is below the accuracy of the given values."""

    def __init__(self, error: float, digits: int) -> None:
        super().__init__(f"the error is about {error:.1e}: that is too small for values of {digits} digits")
        self.error = error


class NotAttained(NoBest):
    """Error: no best approximant exists; the infimum is only approached, by approximants with a pole towards 0."""

    def __init__(self, infimum: float) -> None:
        super().__init__(
            f"no best approximant exists: the error's infimum {infimum:.3e} is not attained, only approached with a "
            "Froissart doublet (a pole and a zero that nearly cancel) that tends to 0"
        )
        self.infimum = infimum


@dataclass(frozen=True)
class Coordinate:
    """Coordinate with uniform grids: t = ln(1 + v/scale), or, for the half-line, t = v/(scale + v)."""

    scale: float = 1.0
    half_line: bool = False

    def t(self, v: Values) -> Values:
        """Return the coordinate of points."""
        return v / (self.scale + v) if self.half_line else np.log1p(v / self.scale)

    def v(self, t: Values) -> Values:
        """Return the points at coordinates."""
        return self.scale * (t / (1 - t) if self.half_line else np.expm1(t))

    def scaled(self, factor: float) -> Coordinate:
        """Return the coordinate with another scale."""
        return replace(self, scale=factor * self.scale)


@dataclass(frozen=True)
class Condition:
    """A linear condition sum a_i A_i + sum b_j B_j = 0 with given A and B, of any length."""

    a: tuple[arb, ...]
    b: tuple[arb, ...]


def contact(order: int) -> tuple[Condition, ...]:
    """Return the conditions a_i = b_i for i < order: N - D = O(v^order)."""
    units = [tuple(arb(int(i == j)) for j in range(i + 1)) for i in range(order)]
    return tuple(Condition(unit, tuple(-x for x in unit)) for unit in units)


@dataclass(frozen=True)
class Problem:
    """An approximation problem: target, weight, degrees, interval and conditions.

    Attributes
    ----------
    m, n : int
        Degrees of N and D.
    defect, sharpness : callable
        g = (1 - f)/v^k and p = v^k/w of v, taken and returned as balls whose middles count. v is a double.
    interval : tuple of two floats
        0 <= x0 < x1; for the half-line, an x1 beyond which nothing happens.
    contact : int
        k; 0 for no contact.
    conditions : tuple of Condition
        Further conditions.
    digits : int
        Accuracy of g (relative to w/v^k) and of p.
    coordinate : Coordinate
        Where grids are uniform.
    beyond : tuple of float
        At most one number > x1 up to which g and p are known too: helps to find a first guess.
    """

    m: int
    n: int
    defect: Function
    sharpness: Function
    interval: tuple[float, float]
    contact: int = 0
    conditions: tuple[Condition, ...] = ()
    digits: int = 17
    coordinate: Coordinate = field(default_factory=Coordinate)
    beyond: tuple[float, ...] = ()

    def __post_init__(self) -> None:
        low, high = self.interval
        if not 0 <= low < high < math.inf:
            raise ValueError(f"interval is {self.interval}: accepted are two finite numbers, 0 <= x0 < x1")
        if min(self.m, self.n, self.contact) < 0:
            raise ValueError("m, n and contact must not be negative")

    @property
    def bits(self) -> int:
        """Working precision."""
        return 4 * bits_for(self.digits) + 16 * (self.m + self.n) + 64

    @property
    def least_error(self) -> float:
        """The smallest error that the accuracy of the values can resolve."""
        return 10.0 ** (GUARD - self.digits)

    @property
    def sees_zero(self) -> bool:
        """Whether the weighted error at v = 0 exists and depends on the approximant; within `working`."""
        x = arb(0)
        if self.interval[0] > 0 or self.sharpness(x) == 0:
            return False
        changes = (self.sharpness(x) * (s(x) + self.defect(x) * d(x)) for s, d in self.directions)
        return any(abs(change) > arb(10) ** -self.digits for change in changes)

    @property
    def only_limits(self) -> bool:
        """Return whether the further conditions bind a_m and b_n only."""
        tops = ((condition.a[: self.m], condition.b[: self.n]) for condition in self.conditions)
        return all(x == 0 for a, b in tops for x in (*a, *b))

    def lower(self) -> Problem:
        """Return the problem of degrees [m-1/n-1], whose approximants lack the common factor v."""
        conditions = tuple(Condition(condition.a[1:], condition.b[1:]) for condition in self.conditions)
        return replace(self, m=self.m - 1, n=self.n - 1, conditions=conditions)

    @cached_property
    def directions(self) -> tuple[tuple[arb_poly, arb_poly], ...]:
        """Pairs (S, D) that span the solutions of the conditions; to be used within `working`."""
        vectors = _null_space((*contact(self.contact), *self.conditions), self.m + 1, self.n + 1)
        return tuple(self._pair(vector) for vector in vectors)

    def _pair(self, vector: Sequence[arb]) -> tuple[arb_poly, arb_poly]:
        numerator, denominator = arb_poly(list(vector[: self.m + 1])), arb_poly(list(vector[self.m + 1 :]))
        difference = [c.mid() for c in (numerator - denominator).coeffs()]
        return arb_poly(difference[self.contact :]), denominator

    @property
    def number_of_points(self) -> int:
        """Number of alternations: points where the best approximant's error is largest, with alternating signs."""
        return len(self.directions)


def _null_space(conditions: Sequence[Condition], rows_a: int, rows_b: int) -> list[list[arb]]:
    """Return a basis of the vectors (a, b) that fulfil the conditions, by elimination."""
    size = rows_a + rows_b
    pivots: dict[int, list[arb]] = {}
    for condition in conditions:
        row = [*_padded(condition.a, rows_a), *_padded(condition.b, rows_b)]
        for column, other in pivots.items():
            row = [(x - row[column] * y).mid() for x, y in zip(row, other, strict=True)]
        column = max(range(size), key=lambda i: abs(float(row[i])))
        if row[column] == 0:
            continue
        row = [(x / row[column]).mid() for x in row]
        pivots = {
            c: [(x - other[column] * y).mid() for x, y in zip(other, row, strict=True)] for c, other in pivots.items()
        }
        pivots[column] = row
    free = [i for i in range(size) if i not in pivots]
    return [[arb(1) if i == j else -pivots[i][j] if i in pivots else arb(0) for i in range(size)] for j in free]


def _padded(values: Sequence[arb], size: int) -> list[arb]:
    """Cut to `size` (coefficients that a polynomial of lower degree does not have are 0) or fill with 0."""
    return [*values[:size], *[arb(0)] * (size - len(values))]


@dataclass(frozen=True)
class Approximation:
    """A levelled approximant: its error equioscillates.

    Attributes
    ----------
    a, b : tuple of flint.arb
        Coefficients, ascending, middles; b_0 = 1.
    error, lower_bound : float
        Largest weighted error (sampled), and what no approximant can stay below.
    points, deviations : tuple of float
        Where the weighted error has extrema of alternating signs, and its values there.
    exchanges : int
        Number of steps.
    """

    a: tuple[arb, ...]
    b: tuple[arb, ...]
    error: float
    lower_bound: float
    points: tuple[float, ...]
    deviations: tuple[float, ...]
    exchanges: int


class _Values:
    """g and p where they are needed, each once."""

    def __init__(self, problem: Problem) -> None:
        self.problem = problem
        self.known: dict[float, tuple[arb, arb]] = {}
        self.largest_level = 0.0  # of the least levels at first references: tiny if that is what the error is

    def __call__(self, v: float) -> tuple[arb, arb]:
        found = self.known.get(v)
        if found is None:
            x = arb(v)
            found = self.known[v] = self.problem.defect(x).mid(), self.problem.sharpness(x).mid()
        return found


@dataclass(frozen=True)
class _Rational:
    """(S, D) with its levelled error (with sign)."""

    s: arb_poly
    d: arb_poly
    level: arb
    vector: tuple[arb, ...]

    def deviation(self, v: float, values: _Values) -> float:
        """Return the weighted error; NaN where D is not positive."""
        x = arb(v)
        g, p = values(v)
        d = self.d(x).mid()
        return float((p * (self.s(x).mid() / d + g)).mid()) if d > 0 else math.nan


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
        values = _Values(problem)
        reasons = []
        for attempt in _attempts(problem, values, start):
            try:
                return attempt()
            except (TooAccurate, NotAttained):
                raise
            except NoBest as reason:
                reasons.append(str(reason))
        raise NoBest(max(set(reasons), key=reasons.count))


def _attempts(
    problem: Problem, values: _Values, start: Sequence[float] | None
) -> Iterator[Callable[[], Approximation]]:
    """Yield ways to the best approximant, the cheapest first."""
    for reference in _starts(problem, start):
        yield partial(_exchanged, problem, values, reference)
    if values.largest_level < problem.least_error:
        raise TooAccurate(values.largest_level, problem.digits)
    yield partial(_refuse_if_not_attained, problem)
    yield partial(_from_lower_degrees, problem, values)
    for towards in (problem.interval[0], *problem.beyond):
        yield partial(_continued, problem, values, towards)


def _refuse_if_not_attained(problem: Problem) -> Approximation:
    """Raise NotAttained if there is no best approximant, and that can be shown; NoBest otherwise.

    Let R = N/D of degrees [m-1/n-1], with N - D = O(v^(k-1)) only, level its error at m + n - k + 1 points, x the first
    of them. If N^/D^ of degrees [m/n], with N^ - D^ = O(v^k), were as good, N^ D - N D^ = v^(k-1) q would have a q of
    degree m + n - k with as many zeros between the points, and q(0) = -(a_(k-1) - b_(k-1)). If
    this is of the other sign than q(x), there is one more zero: none is as good. But [m/n] with the common factor
    v + delta in D and nearly in N approach R for delta -> 0.
    """
    if problem.contact < 1 or not problem.only_limits or min(problem.m, problem.n) < 1 or problem.sees_zero:
        raise NoBest("the condition at 0 holds the error up")

    def sharpness(v: arb) -> arb:
        return arb(0) if v == 0 else problem.sharpness(v) / v

    relaxed = replace(
        problem.lower(),
        contact=problem.contact - 1,
        defect=lambda v: v * problem.defect(v),
        sharpness=sharpness,
    )
    found = _first_of_starts(relaxed, _Values(relaxed))
    k = problem.contact - 1
    slope = float((found.a[k] if k <= relaxed.m else arb(0)) - (found.b[k] if k <= relaxed.n else arb(0)))
    if slope * found.deviations[0] < 0:
        raise NotAttained(found.error)
    raise NoBest("the search failed, though a best approximant may exist")


def _first_of_starts(problem: Problem, values: _Values) -> Approximation:
    """Return what the first good start leads to."""
    reason = NoBest("no start")
    for reference in _starts(problem, None):
        try:
            return _exchanged(problem, values, reference)
        except TooAccurate:
            raise
        except NoBest as found:
            reason = found
    raise reason


def _starts(problem: Problem, start: Sequence[float] | None) -> Iterator[list[float]]:
    """Yield first points of reference, the most promising first."""
    number = problem.number_of_points
    if start is not None and len(start) == number:
        yield list(start)
    for factor in SCALES:
        yield _chebyshev(problem, problem.coordinate.scaled(factor), number)


def _from_lower_degrees(problem: Problem, values: _Values) -> Approximation:
    """Start from the best [m-1/n-1], with two more points of reference.

    Where the best [m/n] nearly has a common factor it differs little from that; but it is not known where.
    """
    if not problem.only_limits or min(problem.m, problem.n) < 1 or problem.number_of_points < 4:
        raise NoBest("there are no lower degrees to start from")
    lower = problem.lower()
    for reference in _with_two_more(problem, _first_of_starts(lower, values).points):
        try:
            return _exchanged(problem, values, reference)
        except TooAccurate:
            raise
        except NoBest:
            continue
    raise NoBest(f"nothing leads from the best [{lower.m}/{lower.n}] to [{problem.m}/{problem.n}]")


def _with_two_more(problem: Problem, points: Sequence[float]) -> Iterator[list[float]]:
    """Yield references with two more points: at the ends, or within a gap."""
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


def _continued(problem: Problem, values: _Values, towards: float) -> Approximation:
    """Solve on an interval that ends at a place nearer to `towards`, then move its end back step by step.

    Best approximants depend continuously on the interval, but where they nearly have a common factor their extrema
    move fast, and no first guess would find them.
    """
    goal, far = problem.coordinate.t(problem.interval[1]), problem.coordinate.t(towards)
    for fraction in CONTINUATION:
        begin = goal + fraction * (far - goal)
        try:
            found = _exchanged(_ending(problem, begin), values, None)
        except NoBest:
            continue
        at, step = begin, (goal - begin) / 2
        while at != goal and abs(step) > LEAST_STEP * abs(goal - begin):
            end = goal if abs(step) >= abs(goal - at) else at + step
            moved = _ending(problem, end)
            try:
                found = _exchanged(moved, values, _stretched(found.points, moved))
                at, step = end, 2 * step
            except NoBest:
                step /= 4
        if at == goal:
            return found
    raise NoBest(f"no approximant on nearby intervals leads to one on [{problem.interval[0]}, {problem.interval[1]}]")


def _ending(problem: Problem, t: float) -> Problem:
    """Return the problem on an interval with another right end."""
    if t == problem.coordinate.t(problem.interval[1]):
        return problem
    return replace(problem, interval=(problem.interval[0], float(problem.coordinate.v(t))))


def _stretched(points: Sequence[float], problem: Problem) -> list[float]:
    """Return points of reference for a slightly different interval."""
    return [min(v, problem.interval[1]) for v in points[:-1]] + [problem.interval[1]]


def _chebyshev(problem: Problem, coordinate: Coordinate, number: int) -> list[float]:
    """Return the extrema of Chebyshev's polynomial, without the left end if the error vanishes there."""
    low, high = coordinate.t(np.array(problem.interval))
    vanishing = int(problem.interval[0] == 0 and not problem.sees_zero)  # the error at the left end is 0
    steps = np.arange(number - 1, -1, -1) / max(number - 1 + vanishing, 1)
    return _inside(problem, coordinate.v(low + (high - low) * (1 + np.cos(np.pi * steps)) / 2))


def _inside(problem: Problem, points: FloatArray) -> list[float]:
    return [float(v) for v in np.unique(np.clip(points, *problem.interval))]


def _grid(problem: Problem, *points: Sequence[float] | FloatArray) -> list[float]:
    return _inside(problem, np.concatenate([problem.interval, *points]))


def sup_error(problem: Problem, a: Sequence[arb], b: Sequence[arb], near: Sequence[float] = ()) -> tuple[float, float]:
    """Return the largest weighted error of any N/D that fulfils the condition of contact, and where (sampled).

    Parameters
    ----------
    problem : Problem
    a, b : sequence of flint.arb
        Coefficients, ascending.
    near : sequence of float
        Points that are added to the grid, with more between them, as those of the best approximant.

    Raises
    ------
    NoBest
        If D is not positive.
    """
    with working(problem.bits):
        denominator = arb_poly(list(b))
        difference = [c.mid() for c in (arb_poly(list(a)) - denominator).coeffs()]
        rational = _Rational(arb_poly(difference[problem.contact :]), denominator, arb(0), ())
        grid = _between(problem, list(near), _fixed_grid(problem))
        at, deviation = max(_extrema(problem, _Values(problem), rational, grid), key=lambda pair: abs(pair[1]))
        return abs(deviation), at


# --- the exchange -----------------------------------------------------------------------------------------------------


def _exchanged(problem: Problem, values: _Values, reference: list[float] | None) -> Approximation:
    """Level and exchange until the largest error is the levelled one."""
    fixed = _fixed_grid(problem)
    if reference is None:
        reference = _chebyshev(problem, problem.coordinate, problem.number_of_points)
    rational: _Rational | None = None
    tolerance = TOLERANCE
    for step in range(1, MAX_EXCHANGES + 1):
        if step == MAX_EXCHANGES:
            tolerance = ROUGH_TOLERANCE
        rational = _levelled(problem, values, reference, rational)
        extrema = _extrema(problem, values, rational, _between(problem, reference, fixed))
        if len(extrema) < len(reference) and abs(rational.level) < problem.least_error:
            raise TooAccurate(abs(float(rational.level)), problem.digits)
        chosen = _alternating(extrema, len(reference))
        sizes = [abs(deviation) for _, deviation in chosen]
        largest = max(abs(deviation) for _, deviation in extrema)
        if largest < problem.least_error:
            raise TooAccurate(largest, problem.digits)
        reference = [v for v, _ in chosen]
        if min(sizes) >= (1 - tolerance) * largest:
            return _approximation(problem, rational, chosen, largest, step)
    raise NoBest(f"the error is not levelled after {MAX_EXCHANGES} exchanges")


def _approximation(
    problem: Problem, rational: _Rational, chosen: list[tuple[float, float]], largest: float, step: int
) -> Approximation:
    b = [c.mid() for c in rational.d.coeffs()]
    b += [arb(0)] * (problem.n + 1 - len(b))
    difference = rational.s * arb_poly([*[0] * problem.contact, 1]) + rational.d
    a = [c.mid() for c in difference.coeffs()][: problem.m + 1]
    a += [arb(0)] * (problem.m + 1 - len(a))
    points, deviations = zip(*chosen, strict=True)
    least = min(abs(deviation) for deviation in deviations)
    return Approximation(tuple(a), tuple(b), largest, least, points, deviations, step)


def _fixed_grid(problem: Problem) -> list[float]:
    low, high = problem.coordinate.t(np.array(problem.interval))
    number = GRID * (problem.number_of_points + 1)
    cosines = np.cos(np.pi * np.arange(number, -1, -1) / number)
    return _grid(problem, problem.coordinate.v(low + (high - low) * (1 + cosines) / 2))


def _between(problem: Problem, reference: list[float], fixed: list[float]) -> list[float]:
    """Return the fixed grid with points of reference and more between them."""
    ends = problem.coordinate.t(np.unique([problem.interval[0], *reference, problem.interval[1]]))
    steps = np.arange(1, GRID // 2) / (GRID // 2)
    finer = problem.coordinate.v((ends[:-1, None] + np.diff(ends)[:, None] * steps).ravel())
    return _grid(problem, fixed, finer, reference)


def _extrema(problem: Problem, values: _Values, rational: _Rational, grid: list[float]) -> list[tuple[float, float]]:
    """Return the largest error between each two changes of sign, as points and values of alternating signs."""
    deviations = np.array([rational.deviation(v, values) for v in grid])
    if np.isnan(deviations).any():
        raise NoBest(f"the approximant has a pole near v* = {grid[int(np.argmax(np.isnan(deviations)))]:.3g}")
    starts = np.flatnonzero(np.diff(np.sign(deviations), prepend=0))
    t = problem.coordinate.t(np.array(grid))
    extrema: list[tuple[float, float]] = []
    for low, high in pairwise([*map(int, starts), len(grid)]):
        if not deviations[low]:
            continue
        top = low + int(np.argmax(np.abs(deviations[low:high])))
        apart = APART * (t[min(high, len(t) - 1)] - t[max(low - 1, 0)])
        extremum = grid[top], float(deviations[top])
        if 0 < top < len(t) - 1:
            left, right = (int(np.searchsorted(t, t[top] + side)) for side in (-apart, apart))
            bracket = max(left - 1, 0), top, min(right, len(t) - 1)
            heights = [(float(t[i]), math.copysign(1.0, extremum[1]) * float(deviations[i])) for i in bracket]
            extremum = _refined(problem, values, rational, extremum, heights)
        if extrema and extrema[-1][1] * extremum[1] > 0:
            extrema[-1] = max(extrema[-1], extremum, key=lambda pair: abs(pair[1]))
        else:
            extrema.append(extremum)
    return extrema


def _refined(
    problem: Problem,
    values: _Values,
    rational: _Rational,
    best: tuple[float, float],
    points: list[tuple[float, float]],
) -> tuple[float, float]:
    """Return the extremum within a bracket, given as places and heights: parabolas through the three best points."""
    size = math.copysign(1.0, best[1])
    close = CLOSE * (points[2][0] - points[0][0])
    for _ in range(MAX_REFINEMENTS):
        t = _vertex(points)
        (t0, f0), (t1, f1), (t2, f2) = points
        if t == t1:
            break
        v = min(max(float(problem.coordinate.v(t)), problem.interval[0]), problem.interval[1])
        value = size * rational.deviation(v, values)
        best = max(best, (v, size * value), key=lambda pair: abs(pair[1]))
        if value > f1:
            points = [(t0, f0), (t, value), (t1, f1)] if t < t1 else [(t1, f1), (t, value), (t2, f2)]
        else:
            points = [(t, value), (t1, f1), (t2, f2)] if t < t1 else [(t0, f0), (t1, f1), (t, value)]
        if abs(t - t1) < close:
            break
    return best


def _vertex(points: list[tuple[float, float]]) -> float:
    """Return where the parabola through three points is highest; a golden section if that is outside."""
    (t0, f0), (t1, f1), (t2, f2) = points
    left, right = (f1 - f0) * (t2 - t1), (f1 - f2) * (t1 - t0)
    if left + right > 0:
        t = t1 + (left * (t2 - t1) - right * (t1 - t0)) / (left + right) / 2
        if t0 < t < t2:
            return t
    return t1 + 0.382 * (t2 - t1) if t2 - t1 > t1 - t0 else t1 - 0.382 * (t1 - t0)


def _alternating(extrema: list[tuple[float, float]], number: int) -> list[tuple[float, float]]:
    """Return `number` neighbouring extrema, the largest among them."""
    if len(extrema) < number:
        raise NoBest(f"the error alternates {len(extrema)} times, not {number}")
    chosen = list(extrema)
    while len(chosen) > number:
        sizes = [abs(deviation) for _, deviation in chosen]
        if len(chosen) == number + 1:
            chosen.pop(0 if sizes[0] < sizes[-1] else -1)
            continue
        worst = sizes.index(min(sizes))
        if worst in (0, len(chosen) - 1):
            chosen.pop(worst)
        else:
            other = worst - 1 if sizes[worst - 1] < sizes[worst + 1] else worst + 1
            del chosen[min(worst, other) : max(worst, other) + 1]
    return chosen


# --- levelling --------------------------------------------------------------------------------------------------------


def _levelled(problem: Problem, values: _Values, reference: list[float], previous: _Rational | None) -> _Rational:
    """Return the D > 0 whose weighted errors at the points of reference are E, -E and so on."""
    a, b = _matrices(problem, values, reference)
    if previous is not None:
        found = _newton(problem, a, b, reference, previous.vector, previous.level)
        if found is not None:
            return found
    for vector, level in _by_eigenvalues(problem, values, a, b):
        found = _newton(problem, a, b, reference, vector, level)
        if found is not None:
            return found
    raise NoBest("no denominator is positive at all points of reference")


def _matrices(problem: Problem, values: _Values, reference: list[float]) -> tuple[arb_mat, arb_mat]:
    """Return A and B: the coefficients c of the directions fulfil (A - E B) c = 0."""
    rows_a, rows_b = [], []
    for i, v in enumerate(reference):
        x = arb(v)
        g, p = values(v)
        pairs = [(s(x).mid(), d(x).mid()) for s, d in problem.directions]
        rows_a.append([(p * (s + g * d)).mid() for s, d in pairs])
        rows_b.append([d if i % 2 == 0 else -d for _, d in pairs])
    return arb_mat(rows_a), arb_mat(rows_b)


def _by_eigenvalues(problem: Problem, values: _Values, a: arb_mat, b: arb_mat) -> Iterator[tuple[tuple[arb, ...], arb]]:
    """Yield the vectors whose denominators have one sign at all points of reference, and their levels."""
    inverse = a.solve(b, algorithm="approx", nonstop=True)
    size = len(problem.directions)
    active = [k for k, (_, d) in enumerate(problem.directions) if d]
    scale = [max((abs(b[i, k]) for i in range(size)), key=float) for k in range(size)]
    block = acb_mat([[inverse[j, k] * scale[j] / scale[k] for k in active] for j in active])
    eigenvalues, vectors = block.eig(algorithm="approx", right=True, nonstop=True)
    sizes = [float(abs(eigenvalue)) for eigenvalue in eigenvalues]
    least = 0.0 if any(map(math.isnan, sizes)) else 1 / max(sizes)
    values.largest_level = max(values.largest_level, least)
    for index, eigenvalue in enumerate(eigenvalues):
        real = eigenvalue.real.mid()
        if not real.is_finite() or real == 0 or abs(eigenvalue.imag) > abs(real) * arb(2) ** -40:
            continue
        part = [(vectors[j, index].real / scale[k]).mid() for j, k in enumerate(active)]
        level = (1 / real).mid()
        vector = [
            (level * sum((inverse[i, k] * c for k, c in zip(active, part, strict=True)), arb(0))).mid()
            for i in range(size)
        ]
        yield tuple(vector), level


def _newton(
    problem: Problem, a: arb_mat, b: arb_mat, reference: list[float], vector: Sequence[arb], level: arb
) -> _Rational | None:
    """Solve (A - E B) c = 0, D(0) = 1; None if that does not converge, or to a D that is not positive."""
    size = len(vector)
    firsts = [d[0] for _, d in problem.directions]
    total = sum((f * c for f, c in zip(firsts, vector, strict=True)), arb(0)).mid()
    if not total.is_finite() or total == 0:
        return None
    column = arb_mat([[(c / total).mid()] for c in vector])
    for _ in range(MAX_NEWTON):
        pencil = (a - b * level).mid()
        residual, change = (pencil * column).mid(), (b * column).mid()
        matrix = [[*(pencil[i, k] for k in range(size)), -change[i, 0]] for i in range(size)]
        matrix.append([*firsts, arb(0)])
        right = arb_mat([*[[-residual[i, 0]] for i in range(size)], [arb(0)]])
        step = arb_mat(matrix).solve(right, algorithm="approx", nonstop=True)
        if not all(step[i, 0].is_finite() for i in range(size + 1)):
            return None
        column = arb_mat([[(column[i, 0] + step[i, 0]).mid()] for i in range(size)])
        level, moved = (level + step[size, 0]).mid(), abs(step[size, 0])
        signs = [float((b * column)[i, 0].mid()) * (-1) ** i for i in range(size)]
        if moved <= abs(level) * arb(10) ** -20 + arb(10) ** (-2 * problem.digits):
            return _rational(problem, column, level) if min(signs) > 0 else None
    return None


def _rational(problem: Problem, column: arb_mat, level: arb) -> _Rational:
    vector = tuple(column[i, 0].mid() for i in range(column.nrows()))
    s = sum((pair[0] * c for pair, c in zip(problem.directions, vector, strict=True)), arb_poly([]))
    d = sum((pair[1] * c for pair, c in zip(problem.directions, vector, strict=True)), arb_poly([]))
    return _Rational(_middles(s), _middles(d), level, vector)


def _middles(polynomial: arb_poly) -> arb_poly:
    return arb_poly([c.mid() for c in polynomial.coeffs()])
