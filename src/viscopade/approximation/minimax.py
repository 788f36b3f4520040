r"""Best rational approximants of eps(v*), the coefficient of restitution at the scaled speed v*, on an interval.

Among N/D with a_0 = b_0 = 1 and a_1 = b_1, which eps = 1 - c v*^2 + … requires, `fit` finds the one with the smallest
largest error, max(|d eps|/eps, |d eps|/(1 - eps)), so that slow and fast collisions are accurate.

`cheapest` finds the cheapest degrees for an accuracy. Errors are sampled, for evaluation without rounding.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from fractions import Fraction
from functools import cached_property, lru_cache
from itertools import pairwise
from typing import Any, SupportsIndex

from flint import arb, fmpz_poly

from viscopade import arguments
from viscopade.approximation import remez
from viscopade.approximation.lacunary import full_powers
from viscopade.approximation.target import target
from viscopade.arithmetic.balls import decimal_string, working
from viscopade.collision.exact import Exact

# What is accepted is a choice, against typing errors; the theory has no such limits. Both pairs of degrees have n = m +
# 3, as the paper's [3/6]. Larger degrees are of little use: on [0, 1] the best [5/9] already has an error below 1e-12,
# on [0, 100] the best [9/12] has 3e-9.
MAX_M, MAX_N = 6, 9  # largest degrees in the search of `cheapest`
MAX_FIT_M, MAX_FIT_N = 12, 15  # largest degrees of a single fit
LARGEST = 10**6  # v*, where eps is 1e-20
SMALLEST = Fraction(1, 10**6)  # end v* > 0 (a choice, too) and length of an interval (`interval_of` has the reason)
# Digits of coefficients beyond those of the error: more than enough, as kernels round them to doubles
# (docs/theory/minimax.md).
COEFFICIENT_DIGITS = 30
# Which the values of eps allow: they have 17 digits, and five of them have to resolve the error (`remez.GUARD`).
SMALLEST_ERROR = Fraction(1, 10**12)


Interval = tuple[Fraction, Fraction]
"""Ends of an interval of v*."""


class TooCoarse(ValueError):
    """The best approximant has a relative error of 100 % or more."""


@dataclass(frozen=True)
class Fit:
    """A best approximant N/D = (1 + a_1 v* + … + a_m v*^m)/(1 + b_1 v* + … + b_n v*^n), a_1 = b_1.

    Attributes
    ----------
    m, n : int
        Degrees.
    interval : tuple of two Fractions
        Ends of the interval of v*.
    a, b : tuple of str
        Coefficients, ascending, as decimal numbers.
    error, lower_bound : float
        Largest error, and a lower bound of the largest error of every approximant of these degrees
        (both sampled).
    points, deviations : tuple of float, length m + n
        The v* at which the error is largest, and its values there, of alternating signs.

    Raises
    ------
    ValueError
        If the numbers contradict each other.
    """

    m: int
    n: int
    interval: Interval
    a: tuple[str, ...]
    b: tuple[str, ...]
    error: float
    lower_bound: float
    points: tuple[float, ...]
    deviations: tuple[float, ...]

    def __post_init__(self) -> None:
        """Refuse numbers that contradict each other."""
        # The coefficients: their number, a_0 = b_0 = 1, and a_1 = b_1, which is 0 if a degree is 0.
        a, b = self.exact
        if (len(a), len(b)) != (self.m + 1, self.n + 1):
            raise ValueError(f"{self.label} has {self.m + 1} and {self.n + 1} coefficients, not {len(a)} and {len(b)}")
        if not a[0] == b[0] == 1:
            raise ValueError("a_0 and b_0 must be 1")
        if (*a, 0)[1] != (*b, 0)[1]:
            raise ValueError("a_1 and b_1 must be the same number")
        # D has no zero on the interval. Multiplied by the common denominator it has integer coefficients, whose roots
        # FLINT isolates, to 128 bits (a choice: more than twice a double's 53). The doubles nearest to the root and to
        # the ends are compared. Rounding to them is monotone, so no root on the interval is missed; one beyond an end
        # by less than rounding is refused, too. The message has six digits of it.
        low, high = map(float, self.interval)
        scale = math.lcm(*(c.denominator for c in b))
        with working(128):
            roots: list[Any] = fmpz_poly([int(c * scale) for c in b]).complex_roots()  # with their multiplicities
            for root, _ in roots:
                if root.imag == 0 and low <= float(root.real) <= high:
                    raise ValueError(f"the denominator of {self.label} has a zero at v* = {float(root.real):.6g}")
        # The error alternates at m + n points, one more than there are free coefficients (`remez`), between its two
        # bounds.
        number = self.m + self.n
        if not len(self.points) == len(self.deviations) == number:
            raise ValueError(f"there are {len(self.points)} points: expected {number}")
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


def cost(m: int, n: int) -> int:
    """Return the cost of [m/n]: m + n multiplications (each with an addition), and a division if n > 0."""
    return m + n + (n > 0)


# --- best approximants ------------------------------------------------------------------------------------------------


def fit(
    m: SupportsIndex,
    n: SupportsIndex,
    v_star_max: Exact,
    v_star_min: Exact = 0,
) -> Fit:
    """Return the best approximant [m/n] of eps on [v_star_min, v_star_max].

    Parameters
    ----------
    m, n : int
        Degrees of numerator and denominator, 0 to 12 and 0 to 15, not both below 2.
    v_star_max, v_star_min : str, int, float, Fraction, Decimal, mpmath.mpf or NumPy scalar
        Ends of the interval, taken exactly: 0 <= v_star_min < v_star_max <= 10^6.

    Raises
    ------
    TypeError
        If an argument has a wrong type.
    ValueError
        If an argument is out of range, the error is not below 100 % (`TooCoarse`) or below 1e-12, or no best
        approximant was found.
    """
    # The limits of degrees and v* are choices, against typing errors (`MAX_FIT_M`, `LARGEST`). Of an error below 1e-12
    # the values of eps have too few digits. By default the interval begins at rest, v* = 0; its upper end comes first
    # here, as it is often the only one, and second in `interval_of`.
    return _fit(*degrees_of(m, n), interval_of(v_star_min, v_star_max))


def degrees_of(m: SupportsIndex, n: SupportsIndex) -> tuple[int, int]:
    """Return checked degrees m and n; errors as for `fit`."""
    # The largest degrees are a choice (above). The free coefficients are a_1 = b_1, a_2 …, b_2 …
    m = arguments.integer("m", m, 0, MAX_FIT_M)
    n = arguments.integer("n", n, 0, MAX_FIT_N)
    if max(m, n) < 2:
        raise ValueError(
            f"the degrees are [{m}/{n}]: expected at least 2 for one of them, because a_1 = b_1 leaves only N/D = 1 "
            "for smaller ones"
        )
    return m, n


def interval_of(v_star_min: Exact, v_star_max: Exact) -> Interval:
    """Return the ends `v_star_min` and `v_star_max` of an interval, checked and exact; errors as for `fit`."""
    # `exact_number` returns the argument as a fraction, or raises with the `accepted` numbers in the message. The
    # largest and the smallest end are choices.
    accepted = f"0, or a number from {float(SMALLEST)} to {LARGEST}"
    low = arguments.exact_number("v_star_min", v_star_min, accepted, lambda v: v == 0 or SMALLEST <= v <= LARGEST)
    accepted = f"a number greater than v_star_min = {float(low):g}, at most {LARGEST}"
    high = arguments.exact_number("v_star_max", v_star_max, accepted, lambda v: low < v <= LARGEST)
    # On shorter intervals the errors of nearly all degrees are below `SMALLEST_ERROR`: measured, from [2/1] on for
    # [1, 1.000001], and from [2/0] on for [0, 0.000001]. Above v* = 1 the length counts relative to v*.
    if high - low < SMALLEST * max(low, Fraction(1)):
        raise ValueError(
            f"the interval [{float(low):g}, {float(high):g}] is too short: expected a length of "
            f"{float(SMALLEST):g} max(v_star_min, 1) or more"
        )
    return low, high


@lru_cache(maxsize=1024)  # a choice: a search has up to 66 pairs of degrees on each interval
def _fit(m: int, n: int, interval: Interval) -> Fit:
    """Return the best approximant [m/n] on an interval; ValueError if there is none that serves."""
    name = f"[{m}/{n}] on {interval_text(interval)}"
    try:
        best = remez.solve(minimax_problem(m, n, interval))
    except remez.TooAccurate:
        raise ValueError(
            f"the best {name} has an error below {float(SMALLEST_ERROR):g}: expected lower degrees, or the kernel of "
            "full accuracy"
        ) from None
    except remez.NoBest as reason:
        raise ValueError(f"{name}: {reason}; expected other degrees") from None
    # From an error of 100 % on, N/D = 0 would be as good. n = m + 3 decays like v*^-3, nearly as eps ~ v*^(-10/3) does.
    if not best.error < 1:
        raise TooCoarse(
            f"the best {name} has a relative error of {best.error:.3g}: expected an error below 1, as with a shorter "
            "interval or with n = m + 3"
        )
    # The coefficients to 30 digits (`COEFFICIENT_DIGITS`, a choice) more than the error has zeros behind the point.
    digits = COEFFICIENT_DIGITS + math.ceil(-math.log10(best.error))
    # Middles are exact, so every one has a decimal.
    a, b = (tuple(str(decimal_string(c, digits)) for c in coefficients) for coefficients in (best.a, best.b))
    levels = best.error, best.lower_bound, best.points, best.deviations
    return Fit(m, n, interval, a, b, *levels)


def minimax_problem(m: int, n: int, interval: Interval) -> remez.Problem:
    """Return the approximation problem of `fit` on an interval for `remez.solve`."""
    # The doubles nearest to the ends that lie inside.
    low, high = map(float, interval)
    inside = (low if low >= interval[0] else math.nextafter(low, math.inf),
              high if high <= interval[1] else math.nextafter(high, 0.0))  # fmt: skip

    def values(v_star: arb) -> tuple[arb, arb]:
        """Return g = (1 - eps)/v*^2 and p = v*^2/w, w = min(eps, 1 - eps): the error is the larger relative one."""
        # eps, 1 - eps and (1 - eps)/v*^2, to the 17 digits that `Problem` takes for granted
        epsilon, loss, loss_ratio = target(v_star)
        # Where 1 - eps is the smaller one, v*^2/w is 1/g, at v* = 0, too.
        return loss_ratio, 1 / loss_ratio if loss < epsilon else v_star**2 / epsilon

    # Contact of order 2, N - D = O(v*^2): a_0 = b_0 and a_1 = b_1. `full_powers` are all up to the degrees.
    return remez.Problem(full_powers(m, n), values, inside, contact=2)


def interval_text(interval: Interval) -> str:
    """Return an interval as text, "[0, 5]"."""
    low, high = map(float, interval)
    return f"[{low:g}, {high:g}]"
