r"""The truncated series at every order: where it leaves the exact eps, and what rounding does to its sum.

Where S_k = h_0 + … + h_k v*^k leaves eps is a matter of the remainder, not of rounding. Three things are known of it:

1. S_k - S_{k-1} = h_k v*^k. Where both are within 1e-3 of eps, |h_k| v*^k <= 2e-3 eps; so the earlier of two
   neighbouring orders leaves before equality (`_latest`).
2. With M the largest |h_j| R^j from j = k - 4 on and x = v*/R, |remainder| <= M x^(k+1)/(1 - x); so no order leaves
   before that is 1e-3 eps (`_earliest`). R is not taken from the coefficients. That those beyond the last one computed
   are no larger is assumed: they fall as in 3.
3. eps ~ (ln(1 - v*/v_s))^2 makes h_k = Re(A_k v_s^-k) with an amplitude A_k ~ (ln k)/k, which changes by less than 1/k
   an order. With a constant one, h_k = p h_{k-1} - q h_{k-2}, p = 2 Re(1/v_s), q = 1/R^2; what is missing is at most
   2 sin(arg v_s) |A_k| R^-k/k. The remainder that two coefficients continue so is a pair of simple poles, and tells
   where S_k leaves, with the sign's period (`_continued`).
"""

from __future__ import annotations

import cmath
import math
from collections.abc import Callable, Iterable
from functools import lru_cache
from typing import Any, NamedTuple

import numpy as np
from flint import arb, arb_poly

from viscopade.arithmetic.balls import ball_of, exact_middle, working
from viscopade.arithmetic.decimals import at_least, at_most
from viscopade.arrays import double
from viscopade.arrays.checked import FloatArray
from viscopade.theory.pade import horner
from viscopade.theory.series import series
from viscopade_lab import compensated, singularity
from viscopade_lab.hard_cases.exported import true_value
from viscopade_lab.hard_cases.finding import Case, Cell, Chart, Check, Outcome, ResultTable, curve

TOLERANCE = 1e-3
ORDER = {False: 80, True: 160}
SHOWN = (20, 40, 80, 160)
DIGITS = 40
BITS = 320  # a sum loses 16 digits next to its zeros, and terms are as large as 2^160
FLOW_DIGITS = 10
PERIOD = 5  # orders after which the signs repeat, nearly: 2/0.42888 = 4.66
GRID: FloatArray = np.arange(64.0, 5120.0) / 4096
"""Where it is looked for the first v* that is off, 0.0156 to 1.25; between neighbours the place is bisected."""
LAST = 2.0  # of the sums' v*
SPEEDS = (0.5, 0.9, 1.2, LAST)
TABLE_EVERY = 10

METHODS = ("Horner", "powers, terms summed exactly", "compensated Horner", "compensated, coefficients in two doubles")


class Truncations(NamedTuple):
    """The coefficients up to two orders more than are truncated at, and where the series stops to converge."""

    order: int
    h: tuple[arb, ...]
    v_s: complex
    radius: float

    def floats(self) -> FloatArray:
        """Return the coefficients, each rounded to the nearest double."""
        return np.array([float(exact_middle(h_k)) for h_k in self.h])

    def scaled(self) -> FloatArray:
        """Return h_k R^k."""
        return np.array([h_k * self.radius**k for k, h_k in enumerate(self.floats())])


@lru_cache(maxsize=2)
def truncations(order: int) -> Truncations:
    """Return what is needed for all orders up to this one."""
    found = singularity.from_flow(FLOW_DIGITS)
    return Truncations(order, series(order + 2, DIGITS).h, complex(found.v_star), float(found.radius))


# --- where the sums leave eps -----------------------------------------------------------------------------------------


class Leaving(NamedTuple):
    """For every order 0 … order: where S_k is off by 1e-3 for the first time, and what is known of it."""

    exact: FloatArray
    in_double: FloatArray
    allowed: FloatArray
    """How far rounding may move `in_double`."""
    latest: FloatArray
    """The proven limit of the earlier one of the orders k - 1 and k; infinite where h_k = 0."""
    earliest: FloatArray
    continued: FloatArray
    """From the next two coefficients and v_s."""
    surprise: FloatArray
    """What the continued remainder misses at `exact`, as a part of what changing amplitudes may make of it."""


def leaving(given: Truncations) -> Leaving:
    """Find where every S_k leaves, in double and exactly, with bounds and the prediction."""
    h = given.floats()
    padded = np.tril(np.ones((given.order + 1, given.order + 1))) * h[: given.order + 1]  # a row an order

    def off(v: FloatArray) -> FloatArray:
        return abs(horner(padded.T[:, :, None], v) / double.epsilon(v) - 1)

    def predicted(v: FloatArray) -> FloatArray:
        return abs(_continued(given, v)) / double.epsilon(v)

    in_double = _first(off, given.order + 1)
    with working(BITS):
        exact = np.array([_refined(given.h[: k + 1], start) for k, start in enumerate(in_double)])
        allowed = np.array([_allowed(given.h[: k + 1], v) for k, v in enumerate(exact)])
    return Leaving(
        exact,
        in_double,
        allowed,
        _latest(given),
        _earliest(given),
        _first(predicted, given.order + 1),
        _surprise(given, exact),
    )


def _first(error: Callable[[FloatArray], FloatArray], orders: int) -> FloatArray:
    """Return, for each order (first axis), the first v* at which an error exceeds the tolerance."""
    above = np.argmax(error(np.broadcast_to(GRID, (orders, len(GRID)))) > TOLERANCE, axis=1)
    if not np.all(above > 0):
        raise ArithmeticError("an order is off at the first point, or nowhere")
    return _bisected(lambda v: error(v) > TOLERANCE, GRID[above - 1], GRID[above])


def _bisected(beyond: Callable[[FloatArray], Any], low: FloatArray, high: FloatArray) -> FloatArray:
    """Return where `beyond` becomes true, for one v* an order (first axis; the second has length 1)."""
    low, high = low[:, None], high[:, None]
    for _ in range(56):
        middle = (low + high) / 2
        there = beyond(middle)
        low, high = np.where(there, low, middle), np.where(there, middle, high)
    place: FloatArray = high[:, 0]
    return place


def _off(polynomial: arb_poly, v_star: float) -> arb:
    return abs(polynomial(arb(v_star)) / true_value("epsilon", arb(v_star)) - 1)


def _refined(h: tuple[arb, ...], start: float) -> float:
    """Return the double where an exactly summed S_k is off by 1e-3, near where the sum in double is."""
    polynomial = arb_poly(list(h))
    low, high = start * (1 - 1e-9), start * (1 + 1e-9)
    if not (_off(polynomial, low) < TOLERANCE < _off(polynomial, high)):
        raise ArithmeticError(f"S_{len(h) - 1} does not leave at v* = {start}, where its sum in double does")
    while True:
        middle = (low + high) / 2
        error = _off(polynomial, middle)
        if not low < middle < high or error.contains(TOLERANCE):
            return middle
        low, high = (middle, high) if error < TOLERANCE else (low, middle)


def _allowed(h: tuple[arb, ...], v_star: float) -> float:
    """Return how far rounding moves the place where S_k leaves: the bound of the errors by the slope.

    Errors: of Horner's rule, of the coefficients, of eps in double and of three operations with them, and of the
    place itself. Twice, for what is not linear.
    """
    n = len(h) - 1
    polynomial, v = arb_poly(list(h)), arb(v_star)
    value, eps = polynomial(v), true_value("epsilon", v)
    size = arb_poly([abs(h_k) for h_k in h])(v)
    unit = ball_of(compensated.UNIT)
    noise = (compensated.plain_bound(n, size) + unit * size) / eps + (2 * double.ULP["epsilon"] + 3) * unit
    slope = polynomial.derivative()(v) / eps - value / eps * arb(float(double.slope(v_star))) / v
    return float((2 * (noise / abs(slope) + 4 * unit * v)).mid())


def _latest(given: Truncations) -> FloatArray:
    h = abs(given.floats()[: given.order + 1, None])
    k = np.arange(given.order + 1)[:, None]
    low, high = np.full(len(h), GRID[0]), np.full(len(h), LAST)
    found = _bisected(lambda v: h * v**k > 2 * TOLERANCE * double.epsilon(v), low, high)
    return np.where((h[:, 0] > 0) & (k[:, 0] > 0), found, np.inf)


def _earliest(given: Truncations) -> FloatArray:
    k = np.arange(given.order + 1)
    largest = np.array([abs(given.scaled())[max(j - PERIOD + 1, 0) :].max() for j in k])[:, None]

    def beyond(x: FloatArray) -> Any:
        return largest * x ** (k[:, None] + 1) > TOLERANCE * double.epsilon(x * given.radius) * (1 - x)

    return given.radius * _bisected(beyond, np.zeros(len(k)), np.ones(len(k)))


def _pair(given: Truncations) -> tuple[float, float]:
    """Return p and q of h_k = p h_{k-1} - q h_{k-2}."""
    return 2 * (1 / given.v_s).real, 1 / abs(given.v_s) ** 2


def _continued(given: Truncations, v: FloatArray) -> FloatArray:
    """Return the remainder of every order (first axis) as h_{k+1} and h_{k+2} continue it."""
    h, (p, q) = given.floats(), _pair(given)
    k = np.arange(given.order + 1)[:, None]
    first, second = h[1:-1, None], (h[2:] - p * h[1:-1])[:, None]
    rest: FloatArray = v ** (k + 1) * (first + second * v) / (1 - p * v + q * v * v)
    return rest


def amplitudes(given: Truncations) -> FloatArray:
    """Return |A| of every two successive h_k R^k = Re(A exp(-i k arg))."""
    scaled, angle = given.scaled(), cmath.phase(given.v_s)
    quadrature = (scaled[1:] - scaled[:-1] * math.cos(angle)) / math.sin(angle)
    return np.hypot(scaled[:-1], quadrature)


def _surprise(given: Truncations, v: FloatArray) -> FloatArray:
    """Return |continued remainder| - 1e-3 eps by what amplitudes falling like 1/k may add to it."""
    p, q = _pair(given)
    k, x = np.arange(given.order + 1), v / abs(given.v_s)
    sine = math.sin(cmath.phase(given.v_s))
    missing = 2 * sine * amplitudes(given)[1:] / (k + 3) * x ** (k + 3) / abs(1 - x)
    found = abs(_continued(given, v[:, None])[:, 0]) - TOLERANCE * double.epsilon(v)
    surprise: FloatArray = abs(found) * (1 - p * v + q * v * v) / missing
    return surprise


def defects(given: Truncations) -> FloatArray:
    """Return |h_k - p h_{k-1} + q h_{k-2}| by 2 sin(arg) |A_k| R^-k/k for the upper half of the orders."""
    scaled, angle = given.scaled(), cmath.phase(given.v_s)
    k = np.arange(2, len(scaled))
    missing = abs(scaled[2:] - 2 * math.cos(angle) * scaled[1:-1] + scaled[:-2])
    allowed = 2 * math.sin(angle) * amplitudes(given)[:-1] / k
    ratio: FloatArray = missing / allowed
    return ratio[given.order // 2 - 2 :]


# --- rounding ---------------------------------------------------------------------------------------------------------


class SeriesSums(NamedTuple):
    """S_k in double at some v*: errors relative to |S_k|, and what bounds them."""

    order: int
    v_star: FloatArray
    value: FloatArray
    largest_term: FloatArray
    condition: FloatArray
    """sum |h_j| v*^j / |S_k|."""
    errors: FloatArray
    """A row for each of METHODS: against the polynomial with double coefficients, the last against the series."""
    bounds: FloatArray
    of_series: FloatArray
    """As `errors`, all against the series."""


def sums(given: Truncations, order: int, v_star: Iterable[float]) -> SeriesSums:
    """Evaluate S_k by all methods."""
    h = given.h[: order + 1]
    c = given.floats()[: order + 1]
    v = np.array(sorted(set(v_star)))
    with working(BITS):
        low = np.array([float((exact - arb(near)).mid()) for exact, near in zip(h, c.tolist(), strict=True)])
        computed = np.array(
            [
                horner(c, v),
                _terms(c, v),
                compensated.compensated_horner(c, v),
                compensated.compensated_horner(c, v, low),
            ]
        )
        rows = [_row(h, c, float(v[i]), computed[:, i]) for i in range(len(v))]
    value, largest, condition, errors, bounds, of_series = (np.array(part) for part in zip(*rows, strict=True))
    return SeriesSums(order, v, value, largest, condition, errors.T, bounds.T, of_series.T)


def _terms(c: FloatArray, v: FloatArray) -> FloatArray:
    """Add up c_k v^k without rounding, but for the sum; the powers come from multiplying on."""
    powers = np.vstack([np.ones_like(v), np.multiply.accumulate(np.tile(v, (len(c) - 1, 1)), axis=0)])
    return np.array([math.fsum(column) for column in (c[:, None] * powers).T])


Row = tuple[float, float, float, list[float], list[float], list[float]]


def _row(h: tuple[arb, ...], c: FloatArray, v_star: float, computed: FloatArray) -> Row:
    v, n = arb(v_star), len(h) - 1
    doubles = [arb(c_k) for c_k in c.tolist()]
    rounded, value = arb_poly(doubles)(v), arb_poly(list(h))(v)
    size, exact_size = (arb_poly([abs(c_k) for c_k in side])(v) for side in (doubles, h))
    unit = ball_of(compensated.UNIT)
    bounds = (
        compensated.plain_bound(n, size),
        unit * abs(rounded) + ball_of(compensated.gamma(n + 1)) * size,
        compensated.bound(n, rounded, size),
        compensated.bound(n, value, exact_size, two_doubles=True),
    )
    targets = (rounded, rounded, rounded, value)
    results = [arb(x) for x in computed.tolist()]
    errors = [float((abs(x - target) / abs(target)).upper()) for x, target in zip(results, targets, strict=True)]
    relative = [float((b / abs(target)).lower()) for b, target in zip(bounds, targets, strict=True)]
    of_series = [float((abs(x - value) / abs(value)).mid()) for x in results]
    largest = max(float((abs(h_k) * v**k).mid()) for k, h_k in enumerate(h))
    return float(value.mid()), largest, float((exact_size / abs(value)).mid()), errors, relative, of_series


def zeros(given: Truncations, order: int) -> list[float]:
    """Return the zeros of S_k up to LAST, where everything cancels, to double precision."""
    c = given.floats()[: order + 1]
    grid = np.linspace(0.5, LAST, 3001)
    change = np.flatnonzero(np.diff(np.sign(horner(c, grid))))
    if not len(change):
        return []
    with working(BITS):
        return [_zero(arb_poly(list(given.h[: order + 1])), *grid[i : i + 2].tolist()) for i in change]


def _zero(polynomial: arb_poly, low: float, high: float) -> float:
    falls = polynomial(arb(low)) > 0
    while low < (middle := (low + high) / 2) < high:
        low, high = (middle, high) if (polynomial(arb(middle)) > 0) == falls else (low, middle)
    return low


def approaching(place: float, step: int) -> list[float]:
    """Return doubles on both sides of a place, ever nearer: 2^-4, … to its neighbours."""
    distances = [2.0**-j for j in range(4, 53, step)]
    return [place * (1 + sign * d) for d in distances for sign in (-1, 1)]


# --- the finding ------------------------------------------------------------------------------------------------------


def run(thorough: bool) -> Outcome:
    """Find where all orders leave, and evaluate all of them in double."""
    given = truncations(ORDER[thorough])
    left = leaving(given)
    shown = [k for k in SHOWN if k <= given.order]
    grid = np.geomspace(0.25, LAST, 240 if thorough else 90).tolist()
    every = [0.5, 0.9, given.radius, 1.2, LAST]
    coarse = [
        sums(given, k, every + [v for z in zeros(given, k) for v in approaching(z, 6 if thorough else 12)])
        for k in range(1, given.order + 1)
    ]
    fine = [
        sums(given, k, [*grid, given.radius, *SPEEDS, *(v for z in zeros(given, k) for v in approaching(z, 2))])
        for k in shown
    ]
    worst = _worst([*coarse, *fine])
    return Outcome(
        _summary(given, left, fine),
        (_leaving_table(given, left), _sums_table(given, fine)),
        (_leaving_chart(given, left), _sums_chart(given, _most_cancelled(fine).order), _horner_chart(fine)),
        (*_leaving_checks(given, left), *_sums_checks(worst)),
    )


def _worst(all_sums: list[SeriesSums]) -> list[float]:
    """Return each method's largest error as a part of its bound."""
    return [max(float((s.errors[i] / s.bounds[i]).max()) for s in all_sums) for i in range(len(METHODS))]


def _leaving_checks(given: Truncations, left: Leaving) -> tuple[Check, ...]:
    earlier = np.minimum(left.exact[1:], left.exact[:-1]) / left.latest[1:]
    moved = abs(left.in_double - left.exact) / left.allowed
    return (
        Check.within(
            "of two neighbouring orders one deviates by 1e-3 before |h_k| v*^k = 2e-3 eps (triangle inequality): "
            "largest v* relative to this limit",
            float(earlier.max()),
        ),
        Check(
            "no order deviates by 1e-3 before the geometric series of the largest |h_j| R^j reaches 1e-3 eps: least v* "
            "relative to this limit",
            float((left.exact / left.earliest).min()),
            ">=",
            1.0,
        ),
        Check.within(
            f"h_k = p h_(k-1) - q h_(k-2) of a pair of poles at the singularity, for k >= {given.order // 2}, up to "
            "the contribution of an amplitude that changes by 1/k an order: largest residual relative to it",
            float(defects(given).max()),
        ),
        Check.within(
            "where S_k deviates by 1e-3, the remainder continued from two coefficients is 1e-3 eps, up to the same "
            f"contribution: largest residual relative to it, k >= {PERIOD}",
            float(left.surprise[PERIOD:].max()),
        ),
        Check.within(
            "the sum in double deviates by 1e-3 at the v* of the exact sum, up to the proven bound of its round-off: "
            "largest distance relative to it",
            float(moved.max()),
        ),
    )


def _sums_checks(worst: list[float]) -> tuple[Check, ...]:
    proven = (
        "gamma_2n sum |c_j| v*^j",
        "u |S_k| + gamma_(n+1) sum |c_j| v*^j",
        "u |S_k| + gamma_2n^2 sum |c_j| v*^j, as in twice the precision",
        "u |S_k| + gamma_(2n+2)^2 sum |h_j| v*^j, against the series itself",
    )
    return tuple(
        Check.within(f"error of {method} by its proven bound {text}: largest", measured)
        for method, text, measured in zip(METHODS, proven, worst, strict=True)
    )


def _summary(given: Truncations, left: Leaving, fine: list[SeriesSums]) -> str:
    last, half = left.exact[-PERIOD:], given.order // 2
    best = int(np.argmax(left.exact))
    beyond = int((left.exact >= given.radius).sum())
    distance = abs(left.continued / left.exact - 1)[half:]
    up_to_radius = fine[-1].condition[fine[-1].v_star <= given.radius]
    cancelled = _most_cancelled(fine)
    worst = [_cell(float(e.max())) for e in cancelled.errors]
    at_radius = max(_off_at_radius(given, k) for k in range(given.order - PERIOD + 1, given.order + 1))
    zero = cancelled.v_star[np.argmax(cancelled.condition)]
    turn = cmath.phase(given.v_s) / math.pi
    moved = abs(left.in_double / left.exact - 1).max()
    return (
        f"S_k stays within 1e-3 of eps up to v* = {at_least(left.exact[20], 4)} at k_c = 20, and up to "
        f"{at_least(last.min(), 4)} to {at_least(last.max(), 4)} at the last {PERIOD} orders up to {given.order}; the "
        f"best of all is k_c = {best} with {at_least(left.exact[best], 4)}. {beyond or 'None'} of the "
        f"{len(left.exact)} orders reaches R = {given.radius:.6f}, which is approached like 1/k_c: k_c (1 - v*/R) is "
        f"{at_most(_slow(given, left, half))} at worst around k_c = {half} and "
        f"{at_most(_slow(given, left, given.order))} around {given.order}. At R itself the last {PERIOD} orders are "
        f"off by up to {at_most(100 * at_radius, 2)}%. Orders differ as the remainder's phase turns by {turn:.4f} pi "
        f"an order: two more coefficients and the singularity predict where an order from {half} on leaves, to "
        f"{at_most(distance.max(), 1)}. Round-off does not matter: in double these v* move by {at_most(moved, 1)} at "
        f"most. Up to R the sum of k_c = {given.order} loses {at_most(math.log10(up_to_radius.max()), 2)} digits, as "
        f"its terms stay small ({at_most(_largest(given, fine[-1]), 2)} at most); beyond R the sum is wrong, but as "
        "large as its terms, and loses few digits. It loses all digits only next to a zero of S_k: for k_c = "
        f"{cancelled.order} at v* = {zero:.6f} Horner is off by {worst[0]}, compensated Horner by {worst[2]} of the "
        "polynomial with its coefficients. Of the series the latter is off by "
        f"{_cell(float(cancelled.of_series[2].max()))}, for the coefficients are rounded, too; with coefficients in "
        f"two doubles it is {worst[3]}"
    )


def _largest(given: Truncations, found: SeriesSums) -> float:
    return float(found.largest_term[found.v_star <= given.radius].max())


def _most_cancelled(fine: list[SeriesSums]) -> SeriesSums:
    """Return the highest order that has a zero, or the highest."""
    return max(fine, key=lambda found: (found.condition.max() > 1 / TOLERANCE**2, found.order))


def _off_at_radius(given: Truncations, order: int) -> float:
    with working(BITS):
        return float(_off(arb_poly(list(given.h[: order + 1])), given.radius).mid())


def _slow(given: Truncations, left: Leaving, order: int) -> float:
    """Return the largest k (1 - v*/R) within a period that ends at an order."""
    k = np.arange(order - PERIOD + 1, order + 1)
    return float((k * (1 - left.exact[k] / given.radius)).max())


def _at(found: SeriesSums, v_star: float) -> int:
    return int(np.argmin(abs(found.v_star - v_star)))


def _cell(number: float) -> str:
    return f"{number:.1e}"


def _leaving_table(given: Truncations, left: Leaving) -> ResultTable:
    orders = sorted({*range(TABLE_EVERY, given.order + 1, TABLE_EVERY), *range(given.order - PERIOD, given.order)})
    scaled = given.scaled()
    rows = tuple(
        (
            k,
            f"{left.exact[k]:.6f}",
            f"{left.exact[k] / given.radius:.4f}",
            f"{left.continued[k]:.6f}",
            f"{left.earliest[k]:.4f}",
            f"{scaled[k]:.4f}",
            _cell(_off_at_radius(given, k)),
        )
        for k in orders
    )
    header = ("k_c", "v* where off by 1e-3", "by R", "predicted", "not before", "h_k R^k", "off at R by")
    return ResultTable("Where the truncated series leaves eps", header, rows)


def _sums_table(given: Truncations, fine: list[SeriesSums]) -> ResultTable:
    rows: list[tuple[Cell, ...]] = []
    for found in fine:
        special = [*SPEEDS[:2], given.radius, *SPEEDS[2:], float(found.v_star[np.argmax(found.condition)])]
        for i in sorted({_at(found, v) for v in special}):
            rows.append(
                (
                    found.order,
                    f"{found.v_star[i]:.6f}",
                    f"{found.value[i]:.3g}",
                    f"{found.largest_term[i]:.2g}",
                    f"{math.log10(found.condition[i]):.1f}",
                    *(_cell(error) for error in found.errors[:, i]),
                    _cell(found.of_series[2, i]),
                )
            )
    header = ("k_c", "v*", "S_k", "largest term", "digits lost", *METHODS, "compensated, of the series")
    return ResultTable("Relative errors of S_k in double", header, tuple(rows))


def _leaving_chart(given: Truncations, left: Leaving) -> Chart:
    k = np.arange(given.order + 1)
    short = [1 - v / given.radius for v in (left.exact, left.earliest, left.continued)]
    return Chart(
        "where $S_{k_c}$ is off by $10^{-3}$",
        "$k_c$",
        r"$1 - v_\ast/R$",
        (
            curve("truncated series", k, short[0], "points"),
            curve("no order farther", k, short[1], "bound"),
            curve("predicted from two coefficients", k[PERIOD:], short[2][PERIOD:]),
        ),
    )


def _sums_chart(given: Truncations, order: int) -> Chart:
    """Show what is left of S_k ever nearer to its first zero."""
    zero = min(zeros(given, order))
    found = sums(given, order, approaching(zero, 1))
    distance = abs(found.v_star / zero - 1)
    nearer = np.argsort(distance)
    curves = []
    for i, name in enumerate(("Horner", "terms summed exactly", "compensated", "two doubles")):
        curves.append(curve(name, distance[nearer], found.errors[i][nearer], "points"))
        curves.append(curve(f"bound, {name}", distance[nearer], found.bounds[i][nearer], "bound"))
    title = f"$S_{{{order}}}$ in double, next to its zero $z = {zero:.4f}$"
    return Chart(title, r"$|v_\ast/z - 1|$", "relative error", tuple(curves))


def _horner_chart(fine: list[SeriesSums]) -> Chart:
    """Show what cancels, order by order: the bound is the condition number times 2 k_c u."""
    curves = []
    for found in fine:
        curves.append(curve(f"$k_c = {found.order}$", found.v_star, found.errors[0], "points"))
        curves.append(curve(f"bound, $k_c = {found.order}$", found.v_star, found.bounds[0], "bound"))
    return Chart("Horner's rule in double", r"$v_\ast$", "relative error", tuple(curves), "linear")


CASE = Case(
    "truncated-series",
    "The truncated series at every order",
    "At which v* does each truncation deviate from eps by 1e-3, does higher precision help, and is every sum "
    "in double precision within its proven bound?",
    run,
)
