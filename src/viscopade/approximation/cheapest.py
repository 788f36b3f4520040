"""Search over degrees [m/n] of best approximants: the cheapest for an accuracy, the most accurate for a cost.

[m/n] is a quotient of polynomials in v* (the scaled speed of impact) of degrees m and n, and approximates the
coefficient of restitution eps(v*) on an interval (`minimax.fit`). Its cost is its number of operations.
"""

from __future__ import annotations

from contextlib import suppress
from functools import lru_cache

from viscopade import arguments
from viscopade.approximation.minimax import (
    MAX_M,
    MAX_N,
    SMALLEST_ERROR,
    Fit,
    Interval,
    cost,
    fit,
    interval_of,
    interval_text,
)
from viscopade.collision.exact import Exact

# Not both degrees below 2: a_0 = b_0 = 1 and a_1 = b_1 leave N/D = 1 alone.
# The largest degrees, [6/9], are a choice of `minimax`.
CANDIDATES = [(m, n) for m in range(MAX_M + 1) for n in range(MAX_N + 1) if max(m, n) >= 2]
"""The degrees of the search, ascending in m."""


def cheapest_fit(accuracy: Exact, v_star_max: Exact, v_star_min: Exact = 0) -> Fit:
    """Return the cheapest approximant with the wanted accuracy.

    `cost` defines the cost. Among equally cheap approximants, the most accurate one is returned.

    Parameters
    ----------
    accuracy : str, int, float, Fraction, Decimal, mpmath.mpf or NumPy scalar
        Largest error, below 1, at least 1e-12.
    v_star_max, v_star_min
        As for `fit`.

    Raises
    ------
    TypeError, ValueError
        As for `fit`; or if no degrees up to [6/9] are accurate enough; the message has the accuracy that they reach.
    """
    # The smallest accuracy, 1e-12, is what the values of eps allow (`minimax`). At 1 and above, N/D = 0 would be as
    # good.
    interval = interval_of(v_star_min, v_star_max)
    accepted = f"a number below 1, and at least {float(SMALLEST_ERROR):g}"
    limit = float(arguments.exact_number("accuracy", accuracy, accepted, lambda x: SMALLEST_ERROR <= x < 1))

    # From the lowest cost upwards, the first best approximant that is accurate enough.
    reached = 1.0  # the smallest error so far, for the message; 1, that of N/D = 0, before the first one
    for price in sorted({cost(*pair) for pair in CANDIDATES}):
        best = min(_fits(price, interval), key=lambda candidate: candidate.error, default=None)
        if best is not None and best.error <= limit:
            return best
        reached = min(reached, best.error if best is not None else reached)
    # The message proposes 1 % more than was reached: rounding to three digits takes off half a percent at most.
    m, n = CANDIDATES[-1]
    raise ValueError(
        f"accuracy is {limit:g}: expected {1.01 * reached:.3g} or more, which [m/n] up to [{m}/{n}] "
        f"reach on {interval_text(interval)}, or a shorter interval, or tables (--from-speed, --full)"
    )


def most_accurate(price: int, v_star_max: Exact, v_star_min: Exact = 0) -> Fit | None:
    """Return the best approximant among all degrees of a `cost`, or None if there is none; errors as for `fit`."""
    fits = _fits(price, interval_of(v_star_min, v_star_max))
    return min(fits, key=lambda candidate: candidate.error, default=None)


@lru_cache(maxsize=256)  # a choice: more than the costs of a dozen intervals
def _fits(price: int, interval: Interval) -> tuple[Fit, ...]:
    """Return the best approximants of the cost `price` on an interval, without degrees that have no good one."""
    low, high = interval
    fits = list[Fit]()
    for m, n in CANDIDATES:
        if cost(m, n) == price:
            with suppress(ValueError):  # no best approximant, an error of 100 %, or one below 1e-12
                fits.append(fit(m, n, high, low))
    return tuple(fits)
