r"""Best rational approximants of eps(v*) on an interval, and their coefficients in the machine's formats (section 2.7).

Among N/D with a_0 = b_0 = 1 and a_1 = b_1, as eps = 1 - c v*^2 + … demands, `fit` finds the one whose largest error is
least, with the error measured as

    "both"       max(|d eps|/eps, |d eps|/(1 - eps)), so that slow and fast collisions come out right, or
    "relative"   |d eps|/eps.

`machine` goes on to coefficients that are doubles or floats: not the nearest to those of the best approximant, but a
combination whose error is small (a close point of a lattice, after fpminimax of Brisebarre and Chevillard). `choose`
finds the cheapest degrees for an accuracy. Errors are sampled, and those of exact evaluation.
"""

from __future__ import annotations

import math
from bisect import bisect_left
from collections.abc import Sequence
from dataclasses import dataclass
from fractions import Fraction
from functools import cached_property, lru_cache
from itertools import combinations, pairwise
from typing import TYPE_CHECKING, Literal, SupportsIndex, cast, get_args

import numpy as np
import numpy.typing as npt
from flint import arb, arb_mat, arb_poly, fmpz_mat, fmpz_poly

from viscopade import checks, remez
from viscopade.arrays import FloatArray
from viscopade.balls import ball_of, decimal_string, exact_middle, working
from viscopade.curve import STEP, TABLE_DIGITS, curve
from viscopade.exact import Exact
from viscopade.kernels.binary import DOUBLE, Format

if TYPE_CHECKING:
    from flint import acb

Measure = Literal["both", "relative"]

MAX_M, MAX_N = 6, 9
MAX_FIT_M, MAX_FIT_N = 12, 15  # what a single fit may ask for
LARGEST = 10**6  # v*
SMALLEST = Fraction(1, 10**6)  # v*, of an interval's end and length
COEFFICIENT_DIGITS = 30  # beyond those of the error
MAX_DIGITS = 150  # of eps
NARROW_DIGITS = 9  # of the values, beyond those of the error
SAMPLES = 12  # points from one extremum of the error to the next, in the search for machine coefficients
LATTICE_BITS = 48  # to which errors are known, in units of the best one, where lattices are reduced
MAX_STEPS = 200
MAX_ROUNDS = 3
LARGE_MOVES = (0.2, 100.0)  # relative, of a coefficient: cautious and bold
LEAST_GAIN = 1e-6

_DEGREES = "accepted are degrees of which the larger one is at least 2 (else a_1 = b_1 leaves only N/D = 1)"
_ENDS = f"0, or a number from {float(SMALLEST)} to {LARGEST}"


@dataclass(frozen=True)
class Fit:
    """A best approximant N/D = (1 + a_1 v* + … + a_m v*^m)/(1 + b_1 v* + … + b_n v*^n), a_1 = b_1.

    Attributes
    ----------
    m, n : int
        Degrees.
    interval : tuple of two Fractions
        Where v* is.
    measure : "both" or "relative"
        Of the error.
    a, b : tuple of str
        Coefficients, ascending, as decimal numbers.
    error, lower_bound : float
        Largest error in the measure (sampled), and what no approximant of these degrees can stay below (sampled).
    points, deviations : tuple of float, length m + n
        Where the error is largest, and its values there, of alternating signs.
    exchanges : int
        Steps of Remez's algorithm.
    digits : int
        Digits of eps that were used.

    Raises
    ------
    ValueError
        If the numbers contradict each other.
    """

    m: int
    n: int
    interval: tuple[Fraction, Fraction]
    measure: Measure
    a: tuple[str, ...]
    b: tuple[str, ...]
    error: float
    lower_bound: float
    points: tuple[float, ...]
    deviations: tuple[float, ...]
    exchanges: int
    digits: int

    def __post_init__(self) -> None:
        _check(*self.exact, self)
        if not len(self.points) == len(self.deviations) == self.m + self.n:
            raise ValueError(f"there must be {self.m + self.n} points, not {len(self.points)}")
        if any(left * right >= 0 for left, right in pairwise(self.deviations)):
            raise ValueError("the deviations must be of alternating signs")
        if not all(left < right for left, right in pairwise(self.points)):
            raise ValueError("the points must ascend")
        if not 0 < self.lower_bound <= min(map(abs, self.deviations)) <= max(map(abs, self.deviations)) <= self.error:
            raise ValueError("the deviations must lie between lower_bound and error")

    @cached_property
    def exact(self) -> tuple[tuple[Fraction, ...], tuple[Fraction, ...]]:
        """The coefficients a and b as fractions."""
        return tuple(map(Fraction, self.a)), tuple(map(Fraction, self.b))

    @property
    def label(self) -> str:
        """The paper's name, "[3/6]"."""
        return f"[{self.m}/{self.n}]"


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
        Coefficients, ascending: numbers of the format; a_0 = b_0 = 1, a_1 = b_1.
    error : float
        Largest error in the measure of `fit`, if it is evaluated without rounding (sampled).
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
            raise ValueError(f"a coefficient is not a number of type {self.form.name}")
        if not self.error <= self.rounded_error:
            raise ValueError("the error must not be larger than that of rounded coefficients")

    @cached_property
    def exact(self) -> tuple[tuple[Fraction, ...], tuple[Fraction, ...]]:
        """The coefficients a and b as fractions."""
        return tuple(map(Fraction, self.a)), tuple(map(Fraction, self.b))

    @property
    def cost(self) -> int:
        """Multiplications of both Horner's rules, and one division."""
        return cost(self.fit.m, self.fit.n)


def cost(m: int, n: int) -> int:
    """Return the cost of [m/n]: m + n multiplications (each with an addition), and a division if n > 0."""
    return m + n + (n > 0)


def _check(a: Sequence[Fraction], b: Sequence[Fraction], fit: Fit) -> None:
    """Raise if lengths, a_0 = b_0 = 1 or a_1 = b_1 are wrong, or the denominator has a zero on the interval."""
    if (len(a), len(b)) != (fit.m + 1, fit.n + 1):
        raise ValueError(f"{fit.label} has {fit.m + 1} and {fit.n + 1} coefficients, not {len(a)} and {len(b)}")
    if not a[0] == b[0] == 1:
        raise ValueError("a_0 and b_0 must be 1")
    if _at(a, 1) != _at(b, 1):
        raise ValueError("a_1 and b_1 must be the same number")
    scale = math.lcm(*(c.denominator for c in b))
    with working(128):
        roots = cast("list[tuple[acb, int]]", fmpz_poly([int(c * scale) for c in b]).complex_roots())
        for root, _ in roots:
            if root.imag == 0 and float(fit.interval[0]) <= float(root.real) <= float(fit.interval[1]):
                raise ValueError(f"the denominator of {fit.label} has a zero at v* = {float(root.real):.6g}")


def _at(values: Sequence[Fraction], i: int) -> Fraction:
    return values[i] if i < len(values) else Fraction(0)


# --- best approximants ------------------------------------------------------------------------------------------------


def fit(
    m: SupportsIndex,
    n: SupportsIndex,
    v_star_max: Exact,
    v_star_min: Exact = 0,
    measure: Measure = "both",
    digits: SupportsIndex = TABLE_DIGITS,
) -> Fit:
    """Return the best approximant [m/n] of eps on [v_star_min, v_star_max].

    Parameters
    ----------
    m, n : int
        Degrees of numerator and denominator, 0 to 12 and 0 to 15, not both below 2.
    v_star_max, v_star_min : str, int, float, Fraction, Decimal, mpmath.mpf or NumPy scalar
        Ends of the interval, taken exactly: 0 <= v_star_min < v_star_max <= 10^6.
    measure : "both" or "relative"
        Of the error: see the module.
    digits : int
        Digits of eps to begin with; more are taken if the error asks for it.

    Raises
    ------
    TypeError
        If something is not of the type stated.
    ValueError
        If something is out of range, the error is not below 100 %, or there is no best approximant: one line.
    """
    m = checks.integer("m", m, 0, MAX_FIT_M)
    n = checks.integer("n", n, 0, MAX_FIT_N)
    if max(m, n) < 2:
        raise ValueError(f"the degrees are [{m}/{n}]: {_DEGREES}")
    return _fit(m, n, _interval(v_star_min, v_star_max), _measure(measure), checks.digits(digits))


def _interval(v_star_min: Exact, v_star_max: Exact) -> tuple[Fraction, Fraction]:
    low = checks.exact("v_star_min", v_star_min, _ENDS, lambda v: v == 0 or SMALLEST <= v <= LARGEST)
    accepted = f"a number greater than v_star_min = {float(low):g}, at most {LARGEST}"
    high = checks.exact("v_star_max", v_star_max, accepted, lambda v: low < v <= LARGEST)
    if high - low < SMALLEST * max(low, Fraction(1)):
        raise ValueError(
            f"the interval [{float(low):g}, {float(high):g}] is too short: accepted is a length of "
            f"{float(SMALLEST):g} max(v_star_min, 1) or more"
        )
    return low, high


def _measure(measure: str) -> Measure:
    if measure not in get_args(Measure):
        raise ValueError(f"measure is {measure!r}: accepted is 'both' or 'relative'")
    return cast(Measure, measure)


@lru_cache(maxsize=1024)
def _fit(m: int, n: int, interval: tuple[Fraction, Fraction], measure: Measure, digits: int) -> Fit:
    start: tuple[float, ...] | None = None
    while digits <= MAX_DIGITS:
        try:
            found = remez.solve(problem(m, n, interval, measure, digits), start)
        except remez.TooAccurate as small:
            wanted = -math.log10(small.error) + NARROW_DIGITS if small.error > 0 else 0
            digits = STEP * math.ceil(max(digits + STEP, wanted) / STEP)
        except remez.NoBest as reason:
            raise ValueError(f"[{m}/{n}] on {_shown(interval)}: {reason}; accepted are other degrees") from None
        else:
            return _finished(m, n, interval, measure, digits, found)
    raise ValueError(f"[{m}/{n}] on {_shown(interval)} is off by less than 1e-{MAX_DIGITS}: accepted are lower degrees")


def problem(m: int, n: int, interval: tuple[Fraction, Fraction], measure: Measure, digits: int) -> remez.Problem:
    """Return the problem of `fit` for `remez.solve`."""
    eps = curve(digits)
    low, high = float(interval[0]), float(interval[1])
    inside = (low if low >= interval[0] else math.nextafter(low, math.inf),
              high if high <= interval[1] else math.nextafter(high, 0.0))  # fmt: skip

    def sharpness(v_star: arb) -> arb:
        epsilon, loss = eps.both(v_star)
        if measure == "both" and loss < epsilon:
            return 1 / eps.loss_ratio(v_star)
        return v_star * v_star / epsilon

    beyond = (min(3 * high, float(LARGEST)),) if 3 * high <= LARGEST else ()
    return remez.Problem(m, n, eps.loss_ratio, sharpness, inside, 2, digits=eps.digits, beyond=beyond)


def _finished(
    m: int, n: int, interval: tuple[Fraction, Fraction], measure: Measure, digits: int, found: remez.Approximation
) -> Fit:
    if not found.error < 1:
        raise ValueError(
            f"the best [{m}/{n}] on {_shown(interval)} is off by {found.error:.3g} (100 % is 1): accepted are degrees "
            "and intervals with an error below 1 (n = m + 3 suits long intervals)"
        )
    places = COEFFICIENT_DIGITS + math.ceil(-math.log10(found.error))
    a, b = ([_decimal(c, places) for c in values] for values in (found.a, found.b))
    if min(m, n) >= 1:
        a[1] = b[1]
    a[0] = b[0] = "1"
    if m == 0 and n >= 1:
        b[1] = "0"
    if n == 0 and m >= 1:
        a[1] = "0"
    levels = found.error, found.lower_bound, found.points, found.deviations, found.exchanges
    return Fit(m, n, interval, measure, tuple(a), tuple(b), *levels, digits)


def _decimal(number: arb, digits: int) -> str:
    text = decimal_string(number, digits)
    assert text is not None  # middles are exact
    return text


def _shown(interval: tuple[Fraction, Fraction]) -> str:
    return f"[{float(interval[0]):g}, {float(interval[1]):g}]"


# --- coefficients in the machine's formats ----------------------------------------------------------------------------


def machine(best: Fit, form: Format = DOUBLE) -> MachineFit:
    """Return coefficients of a binary format with a small error.

    The error is linear in small changes of the coefficients; so those that are numbers of the format are a lattice in
    the space of errors. From a close point of it (LLL reduction, Babai's nearest plane) single steps and pairs of steps
    along the reduced basis are taken as long as the largest error falls.

    Parameters
    ----------
    best : Fit
    form : Format
        kernels.binary.DOUBLE or FLOAT.

    Raises
    ------
    ValueError
        If a coefficient is not a normal number of the format.
    """
    task = problem(best.m, best.n, best.interval, best.measure, best.digits)
    with working(task.bits):
        start = _Grid(best, form)
        grids, nearest = [start], start.centre
        errors = {nearest: _error(task, start.placed(nearest), best.points)}
        for _ in range(MAX_ROUNDS):
            found = {shifted for grid in grids for shifted in _near(task, grid)}
            for free in sorted(found - errors.keys()):
                if start.holds(free):
                    errors[free] = _error(task, start.placed(free), best.points)
            # a coefficient that moved into another binade has other steps there
            moved = [_Grid(best, form, free) for free in found]
            known = [grid.steps for grid in grids]
            grids = [grid for grid in moved if grid.steps not in known]
        free = min(errors, key=errors.__getitem__)
        free = free if errors[free] < errors[nearest] else nearest
        a, b = start.placed(free)
    return MachineFit(best, form, tuple(map(float, a)), tuple(map(float, b)), errors[free], errors[nearest])


def _near(task: remez.Problem, grid: _Grid) -> set[tuple[Fraction, ...]]:
    """Return free coefficients with small errors."""
    candidates = set[tuple[int, ...]]().union(*(_Lattice.of(task, grid, move).candidates() for move in LARGE_MOVES))
    return {
        tuple(c + shift * step for c, step, shift in zip(grid.centre, grid.steps, shifts, strict=True))
        for shifts in candidates
    }


def _error(task: remez.Problem, coefficients: tuple[list[Fraction], list[Fraction]], near: Sequence[float]) -> float:
    """Return the largest error, infinite if the denominator is not positive."""
    a, b = ([ball_of(c) for c in values] for values in coefficients)
    try:
        return remez.sup_error(task, a, b, near)[0]
    except remez.NoBest:
        return math.inf


class _Grid:
    """The numbers of a format near given coefficients (the fit's own), as whole steps from the nearest ones."""

    def __init__(self, best: Fit, form: Format, near: Sequence[Fraction] | None = None) -> None:
        self.best, self.form = best, form
        shared = [(1, 1)] if min(best.m, best.n) >= 1 else []
        single = [*((i, None) for i in range(2, best.m + 1)), *((None, j) for j in range(2, best.n + 1))]
        self.places: list[tuple[int | None, int | None]] = [*shared, *single]
        """Indices in a and in b of each free coefficient."""
        a, b = best.exact
        self.exact = [a[i] if i is not None else b[j or 0] for i, j in self.places]
        pairs = zip(self.places, self.exact if near is None else near, strict=True)
        self.centre = tuple(self._nearest(place, c) for place, c in pairs)
        self.steps = [Fraction(2) ** (math.frexp(float(c))[1] - form.precision) for c in self.centre]

    def _nearest(self, place: tuple[int | None, int | None], number: Fraction) -> Fraction:
        i, j = place
        try:
            return Fraction(self.form.nearest(number))
        except ValueError as error:
            name = f"b_{j}" if i is None else f"a_{i}"
            raise ValueError(f"{self.best.label} on {_shown(self.best.interval)}: {name} = {error}") from None

    def placed(self, free: Sequence[Fraction]) -> tuple[list[Fraction], list[Fraction]]:
        """Return a and b with the given free coefficients."""
        a, b = ([Fraction(1), *[Fraction(0)] * degree] for degree in (self.best.m, self.best.n))
        for (i, j), c in zip(self.places, free, strict=True):
            if i is not None:
                a[i] = c
            if j is not None:
                b[j] = c
        return a, b

    def holds(self, free: Sequence[Fraction]) -> bool:
        """Whether all are numbers of the format: steps may lead out of a binade."""
        try:
            return all(self.form.nearest(c) == c for c in free)
        except ValueError:
            return False


@dataclass(frozen=True)
class _Lattice:
    """Errors at sampled points, in units of the least possible error, as far as they are linear in the steps.

    Attributes
    ----------
    start : array, shape (points,)
        Of the rounded coefficients.
    optimum : array, shape (points,)
        Of the best approximant.
    basis : array, shape (steps, points)
        What the vectors of a reduced basis add.
    moves : array, shape (steps, steps)
        How far those vectors lead from the coefficients, as relative changes, times what a large one may cost.
    transform : array of int, shape (steps, steps)
        Those vectors, as steps of the coefficients.
    """

    start: FloatArray
    optimum: FloatArray
    basis: FloatArray
    moves: FloatArray
    transform: npt.NDArray[np.object_]

    @classmethod
    def of(cls, task: remez.Problem, grid: _Grid, large_move: float) -> _Lattice:
        """Linearise about the fit; to be used within `working`."""
        points = _samples(task, grid.best.points)
        optimum, rows = _linearised(task, grid, points)
        effects = arb_mat(rows)
        offsets = [(r - c) / step for r, c, step in zip(grid.centre, grid.exact, grid.steps, strict=True)]
        start = optimum + _doubles(arb_mat([[ball_of(x) for x in offsets]]) * effects)[0]
        # Some combinations of coefficients hardly change the error: they must not leave where all is linear.
        price = max(abs(start).max(), 1.0) / large_move
        prices = [price * float(step / abs(c)) for c, step in zip(grid.centre, grid.steps, strict=True)]
        moves = arb_mat([[arb(p if i == j else 0) for j in range(len(prices))] for i, p in enumerate(prices)])
        rows = [[*row, *move] for row, move in zip(rows, moves.tolist(), strict=True)]
        whole = fmpz_mat([[round(exact_middle(x) * 2**LATTICE_BITS) for x in row] for row in rows])
        _, transform = whole.lll(True)
        integers = np.array([[int(x) for x in row] for row in transform.tolist()], dtype=object)
        basis, reduced = (_doubles(arb_mat(transform) * part) for part in (effects, moves))
        return cls(start, optimum, basis, reduced, integers)

    def candidates(self) -> set[tuple[int, ...]]:
        """Return steps with small errors: descents from the rounded coefficients and from two near points."""
        origins = (self._near(self.start), self._near(self.start - self.optimum), np.zeros(len(self.basis)))
        return {tuple(int(x) for x in self._descended(origin) @ self.transform) for origin in origins}

    def _near(self, target: FloatArray) -> FloatArray:
        """Return the vector of the basis whose effect nearly cancels the target (Babai's nearest plane)."""
        q, r = np.linalg.qr(np.hstack([self.basis, self.moves]).T)
        rest, steps = -(q[: len(target)].T @ target), np.zeros(len(self.basis))
        for k in range(len(steps) - 1, -1, -1):
            steps[k] = np.round(rest[k] / r[k, k])
            rest -= steps[k] * r[:, k]
        return steps

    def _descended(self, steps: FloatArray) -> npt.NDArray[np.object_]:
        """Take single and double steps along the basis while the largest error falls."""
        singles = np.concatenate([np.eye(len(steps)), -np.eye(len(steps))])
        sums = (left + right for left, right in combinations(singles, 2))
        moves = np.array([*singles, *(both for both in sums if both.any())])
        effects = moves @ self.basis
        error = self.start + steps @ self.basis
        for _ in range(MAX_STEPS):
            sizes = np.abs(error + effects).max(axis=1)
            move = int(np.argmin(sizes))
            if not sizes[move] < (1 - LEAST_GAIN) * np.abs(error).max():
                break
            steps, error = steps + moves[move], error + effects[move]
        return np.array([int(x) for x in steps], dtype=object)


def _samples(task: remez.Problem, points: Sequence[float]) -> list[float]:
    """Return the extrema with `SAMPLES` points between each two."""
    t = task.coordinate.t(np.unique([*task.interval, *points]))
    between = t[:-1, None] + np.diff(t)[:, None] * np.arange(1, SAMPLES) / SAMPLES
    inner = np.clip(task.coordinate.v(between.ravel()), *task.interval)
    return [float(v) for v in np.unique([*inner, *points, *task.interval])]


def _linearised(task: remez.Problem, grid: _Grid, points: Sequence[float]) -> tuple[FloatArray, list[list[arb]]]:
    """Return the fit's errors at points, and what a step of each coefficient adds, in units of the largest one."""
    a, b = (arb_poly([ball_of(c) for c in values]) for values in grid.best.exact)
    s = arb_poly([c.mid() for c in (a - b).coeffs()][task.contact :])
    optimum, rows = [], [[] for _ in grid.places]  # type: tuple[list[float], list[list[arb]]]
    for v in points:
        x = arb(v)
        d, unit = b(x).mid(), (task.sharpness(x) / grid.best.error).mid()
        ratio = (s(x) / d).mid()
        optimum.append(float((unit * (ratio + task.defect(x))).mid()))
        for row, (i, j), step in zip(rows, grid.places, grid.steps, strict=True):
            change = (x ** (i - 2) if i != 1 else 0) if i is not None else -(x ** ((j or 0) - 2))
            change = change - ratio * x**j if j is not None else change
            row.append((unit * change * ball_of(step) / d).mid())
    return np.array(optimum), rows


def _doubles(matrix: arb_mat) -> FloatArray:
    return np.array([[float(x.mid()) for x in row] for row in matrix.tolist()])


# --- the cheapest degrees ---------------------------------------------------------------------------------------------


def choose(
    accuracy: Exact,
    v_star_max: Exact,
    v_star_min: Exact = 0,
    form: Format = DOUBLE,
    measure: Measure = "both",
) -> MachineFit:
    """Return the cheapest approximant, with coefficients of a format, that is as accurate as wanted.

    The cost is that of `cost`; among equally cheap ones, the most accurate is returned.

    Parameters
    ----------
    accuracy : str, int, float, Fraction, Decimal, mpmath.mpf or NumPy scalar
        Largest error in the measure, below 1 and at least four units of rounding of the format.
    v_star_max, v_star_min, measure
        As for `fit`.
    form : Format
        kernels.binary.DOUBLE or FLOAT.

    Raises
    ------
    TypeError, ValueError
        As for `fit`; or if no degrees up to [6/9] are accurate enough: one line that says what would do.
    """
    interval, measure = _interval(v_star_min, v_star_max), _measure(measure)
    least = Fraction(2) ** (2 - form.precision)
    accepted = f"a number below 1, and for type {form.name} at least {float(least):.3g}"
    limit = float(checks.exact("accuracy", accuracy, accepted, lambda x: least <= x < 1))
    fits: dict[tuple[int, int], Fit | None] = {}

    def good(price: int) -> list[Fit]:
        for m, n in _degrees(price):
            if (m, n) not in fits:
                fits[m, n] = _fit_or_none(m, n, interval, measure)
        found = (fits[degrees] for degrees in _degrees(price))
        return [fit for fit in found if fit is not None and fit.error <= limit]

    prices = range(2, cost(MAX_M, MAX_N) + 1)
    rounded: list[MachineFit] = []
    for price in prices[bisect_left(prices, True, key=lambda price: bool(good(price))) :]:
        new = [machine(fit, form) for fit in good(price)]
        best = min(new, key=lambda fit: fit.error, default=None)
        if best is not None and best.error <= limit:
            return best
        rounded += new
    errors = [fit.error for fit in rounded] or [fit.error for fit in fits.values() if fit]
    raise ValueError(
        f"accuracy is {limit:g}: accepted on {_shown(interval)} for type {form.name} is"
        f" {1.01 * min(errors, default=1):.3g} or more (what [m/n] up to [{MAX_M}/{MAX_N}] reach), or a shorter"
        " interval"
    )


def most_accurate(price: int, v_star_max: Exact, v_star_min: Exact = 0, measure: Measure = "both") -> Fit | None:
    """Return the best approximant among all degrees of a `cost`, or None if there is none; errors as for `fit`."""
    interval, measure = _interval(v_star_min, v_star_max), _measure(measure)
    found = (_fit_or_none(m, n, interval, measure) for m, n in _degrees(price))
    return min((fit for fit in found if fit is not None), key=lambda fit: fit.error, default=None)


def _degrees(price: int) -> list[tuple[int, int]]:
    """Return the degrees of a cost."""
    pairs = ((m, n) for m in range(MAX_M + 1) for n in range(MAX_N + 1))
    return [(m, n) for m, n in pairs if max(m, n) >= 2 and cost(m, n) == price]


def _fit_or_none(m: int, n: int, interval: tuple[Fraction, Fraction], measure: Measure) -> Fit | None:
    try:
        return _fit(m, n, interval, measure, TABLE_DIGITS)
    except ValueError:  # no best approximant, or no good one
        return None
