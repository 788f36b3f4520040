"""Search over degrees [m/n] of best approximants: the cheapest for an accuracy, the most accurate for a cost."""

from __future__ import annotations

from contextlib import suppress
from fractions import Fraction
from functools import lru_cache

from viscopade import arguments
from viscopade.approximation.machine_coefficients import MachineFit, machine
from viscopade.approximation.minimax import (
    MAX_M,
    MAX_N,
    SMALLEST_ERROR,
    Fit,
    Interval,
    _fit,
    _shown,
    cost,
    interval_of,
)
from viscopade.arithmetic.formats import DOUBLE, Format
from viscopade.collision.exact import Exact

CANDIDATES = [(m, n) for m in range(MAX_M + 1) for n in range(MAX_N + 1) if max(m, n) >= 2]
"""The degrees of the search, ascending in m."""


def cheapest_fit(
    accuracy: Exact,
    v_star_max: Exact,
    v_star_min: Exact = 0,
    form: Format = DOUBLE,
) -> MachineFit:
    """Return the cheapest approximant with the wanted accuracy and coefficients of a format.

    `cost` defines the cost. Among equally cheap approximants, the most accurate one is returned.

    Parameters
    ----------
    accuracy : str, int, float, Fraction, Decimal, mpmath.mpf or NumPy scalar
        Largest error, below 1, at least 1e-12 and four units of rounding of the format.
    v_star_max, v_star_min
        As for `fit`.
    form : Format
        `formats.DOUBLE` or `formats.FLOAT`.

    Raises
    ------
    TypeError, ValueError
        As for `fit`; or if no degrees up to [6/9] are accurate enough; the message has the accuracy that they reach.
    """
    interval = interval_of(v_star_min, v_star_max)
    least = max(Fraction(2) ** (2 - form.precision), SMALLEST_ERROR)
    accepted = f"a number below 1, and in {form.name} at least {float(least):.3g}"
    limit = float(arguments.exact_number("accuracy", accuracy, accepted, lambda x: least <= x < 1))

    prices = sorted({cost(*pair) for pair in CANDIDATES})
    rounded: list[MachineFit] = []
    for price in prices:
        new = [machine(fit, form) for fit in _fits(price, interval) if fit.error <= limit]
        best = min(new, key=lambda fit: fit.error, default=None)
        if best is not None and best.error <= limit:
            return best
        rounded += new
    m, n = CANDIDATES[-1]
    errors = [fit.error for fit in rounded] or [fit.error for price in prices for fit in _fits(price, interval)]
    raise ValueError(
        f"accuracy is {limit:g}: expected {1.01 * min(errors, default=1):.3g} or more, which [m/n] up to [{m}/{n}] "
        f"reach on {_shown(interval)} in {form.name}, or a shorter interval"
    )


def most_accurate(price: int, v_star_max: Exact, v_star_min: Exact = 0) -> Fit | None:
    """Return the best approximant among all degrees of a `cost`, or None if there is none; errors as for `fit`."""
    fits = _fits(price, interval_of(v_star_min, v_star_max))
    return min(fits, key=lambda fit: fit.error, default=None)


@lru_cache(maxsize=256)
def _fits(price: int, interval: Interval) -> tuple[Fit, ...]:
    """Return the best approximants of a cost, without degrees that have no good one."""
    found = list[Fit]()
    for m, n in CANDIDATES:
        if cost(m, n) == price:
            with suppress(ValueError):  # no best approximant, or no good one
                found.append(_fit(m, n, interval))
    return tuple(found)
