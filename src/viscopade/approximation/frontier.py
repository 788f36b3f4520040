"""Frontier of accuracy against coefficients, as a table: best and Padé approximants [m/n] of eps on [0, V].

The table is made by  python -m tools.frontier > src/viscopade/data/frontier.csv ; the queries read it, and run no
fit. Errors are the largest max(|d eps|/eps, |d eps|/(1 - eps)) on the interval, of exact evaluation (sampled), rounded
up to `PLACES` significant digits. [m/n] has m + n coefficients besides a_0 = b_0 = 1, and takes as many
multiplications.
"""

from __future__ import annotations

import csv
import pkgutil
from bisect import bisect_left
from dataclasses import dataclass
from functools import lru_cache
from typing import cast

from viscopade import arguments
from viscopade.approximation import minimax
from viscopade.approximation.minimax import MAX_M, MAX_N
from viscopade.collision.exact import Exact

DATA = "data/frontier.csv"
COLUMNS = ("v_star_max", "m", "n", "error", "pade_error")

GRID = (0.1, 0.2, 0.5, 1.0, 1.5, 2.0, 3.0, 5.0, 7.0, 10.0, 20.0, 50.0, 100.0, 1000.0)
"""V, as doubles: what the table has been made for."""
PADE_MAX_M = 25  # of [m/m+3], which the paper recommends and goes on to where no fit is wanted


@dataclass(frozen=True)
class Record:
    """Errors of approximants [m/n] on [0, v_star_max].

    Attributes
    ----------
    v_star_max : float
        One of `GRID`.
    m, n : int
        Degrees.
    error : float
        Of the best approximant (sampled); infinite if it is not below 1, or if the degrees are beyond [6/9], for which
        only Padé's approximants have been looked at.
    pade_error : float
        Of Padé's approximant (sampled); infinite if that does not exist, or has a pole in the interval (proven).
    """

    v_star_max: float
    m: int
    n: int
    error: float
    pade_error: float

    @property
    def label(self) -> str:
        """The paper's name, "[3/6]"."""
        return f"[{self.m}/{self.n}]"

    @property
    def coefficients(self) -> int:
        """Number of coefficients besides a_0 = b_0 = 1, which is also the number of multiplications."""
        return self.m + self.n

    @property
    def cost(self) -> int:
        """Number of multiplications and divisions."""
        return minimax.cost(self.m, self.n)


# --- queries ----------------------------------------------------------------------------------------------------------


@lru_cache(maxsize=1)
def table() -> tuple[Record, ...]:
    """Return all records, ascending in v_star_max, m and n."""
    text = cast(bytes, pkgutil.get_data("viscopade", DATA)).decode()
    names, *rows = csv.reader(line for line in text.splitlines() if not line.startswith("#"))
    if tuple(names) != COLUMNS:
        raise OSError(f"{DATA} has the columns {names}, not {COLUMNS}")
    return tuple(
        Record(float(v_star_max), int(m), int(n), *(float(error or "inf") for error in errors))
        for v_star_max, m, n, *errors in rows
    )


def cheapest(accuracy: Exact, v_star_max: Exact) -> Record:
    """Return the cheapest degrees whose best approximant has the wanted accuracy on [0, v_star_max].

    The cost is that of `minimax.cost`; among equally cheap ones, the most accurate is returned. Between two numbers of
    `GRID` the larger one stands for v_star_max (the record says which): there may be cheaper degrees for the shorter
    interval, as `cheapest.cheapest_fit` finds them.

    Parameters
    ----------
    accuracy : str, int, float, Fraction, Decimal, mpmath.mpf or NumPy scalar
        Largest error, above 0 and below 1.
    v_star_max : the same types
        End of the interval, above 0 and at most the largest of `GRID`.

    Raises
    ------
    TypeError
        If something is not a number.
    ValueError
        If something is out of range, or no degrees of the table are accurate enough: one line that says what is.
    """
    limit = float(arguments.exact_number("accuracy", accuracy, "a number above 0 and below 1", lambda x: 0 < x < 1))
    accepted = f"a number above 0, at most {GRID[-1]:g} (where the table ends; cheapest.cheapest_fit goes further)"
    end = arguments.exact_number("v_star_max", v_star_max, accepted, lambda v: 0 < v <= GRID[-1])
    grid_end = GRID[bisect_left(GRID, end)]
    found = best_within(limit, grid_end)
    if found is None:
        least = min(record.error for record in _on(grid_end))
        raise ValueError(
            f"accuracy is {limit:g}: accepted on [0, {grid_end:g}] is {least:g} or more "
            f"(what [m/n] up to [{MAX_M}/{MAX_N}] reach), or a shorter interval"
        )
    return found


def best_within(accuracy: float, v_star_max: float) -> Record | None:
    """Return the record of the cheapest best approximant for an accuracy on an interval of `GRID`, if there is one."""
    good = (record for record in _on(v_star_max) if record.error <= accuracy)
    return min(good, key=lambda record: (record.cost, record.error), default=None)


def pade_within(accuracy: float, v_star_max: float) -> Record | None:
    """Return the record of Padé's [m/m+3] with the smallest m for an accuracy, if one up to m = 25 is as accurate."""
    good = (record for record in _on(v_star_max) if record.n == record.m + 3 and record.pade_error <= accuracy)
    return min(good, key=lambda record: record.m, default=None)


@lru_cache(maxsize=len(GRID))
def _on(v_star_max: float) -> tuple[Record, ...]:
    return tuple(record for record in table() if record.v_star_max == v_star_max)
