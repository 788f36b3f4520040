"""Frontier of accuracy against coefficients, as a table: best and Padé approximants [m/n] of eps on [0, V].

The table is made by  python -m tools.frontier > src/viscopade/data/frontier.csv ; the queries read it, and run no
fit. Errors are the largest max(|d eps|/eps, |d eps|/(1 - eps)) on the interval, of exact evaluation (sampled), rounded
up to `PLACES` significant digits. [m/n] has m + n coefficients besides a_0 = b_0 = 1, and takes as many
multiplications.
"""

from __future__ import annotations

import csv
import math
import pkgutil
from bisect import bisect_left
from collections.abc import Iterable, Sequence
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
ACCURACIES = tuple(float(f"1e-{k}") for k in range(2, 13))
PADE_MAX_M = 25  # of [m/m+3], which the paper recommends and goes on to where no fit is wanted


_WHAT_ELSE = f"what [m/n] up to [{MAX_M}/{MAX_N}] reach"


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


@dataclass(frozen=True)
class Smallest:
    """The smallest approximants for an accuracy on [0, v_star_max].

    Attributes
    ----------
    v_star_max, accuracy : float
    best : Record or None
        Of the cheapest best approximant; None if up to [6/9] none is as accurate.
    pade : Record or None
        Of Padé's [m/m+3] with the smallest m; None if up to m = 25 none is as accurate.
    """

    v_star_max: float
    accuracy: float
    best: Record | None
    pade: Record | None


# --- queries ----------------------------------------------------------------------------------------------------------


@lru_cache(maxsize=1)
def table() -> tuple[Record, ...]:
    """Return all records, ascending in v_star_max, m and n."""
    text = cast(bytes, pkgutil.get_data("viscopade", DATA)).decode()
    rows = csv.DictReader(line for line in text.splitlines() if not line.startswith("#"))
    if tuple(rows.fieldnames or ()) != COLUMNS:
        raise OSError(f"{DATA} has the columns {rows.fieldnames}, not {COLUMNS}")
    return tuple(
        Record(
            float(row["v_star_max"]),
            int(row["m"]),
            int(row["n"]),
            float(row["error"] or math.inf),
            float(row["pade_error"] or math.inf),
        )
        for row in rows
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
    found = _cheapest(_on(grid_end), limit)
    if found is None:
        least = min(record.error for record in _on(grid_end))
        raise ValueError(
            f"accuracy is {limit:g}: accepted on [0, {grid_end:g}] is {least:g} or more ({_WHAT_ELSE}), or a"
            " shorter interval"
        )
    return found


def smallest_degrees(
    v_star_max: Sequence[float] = GRID, accuracy: Sequence[float] = ACCURACIES
) -> tuple[Smallest, ...]:
    """Return the smallest approximants for each accuracy and interval [0, v_star_max], for reports.

    Parameters
    ----------
    v_star_max : sequence of float
        Some of `GRID`.
    accuracy : sequence of float

    Raises
    ------
    ValueError
        If a v_star_max is not on the grid.
    """
    for v in v_star_max:
        if v not in GRID:
            raise ValueError(f"v_star_max is {v}: accepted are {', '.join(f'{x:g}' for x in GRID)}")
    return tuple(
        Smallest(v, limit, _cheapest(_on(v), limit), _smallest_pade(_on(v), limit))
        for v in v_star_max
        for limit in accuracy
    )


def markdown(v_star_max: Sequence[float] = GRID, accuracy: Sequence[float] = ACCURACIES) -> str:
    """Return `smallest_degrees` as a table in Markdown; arguments and errors as there.

    A cell holds the degrees of the best approximant, and in parentheses those of Padé's.
    """
    cells = {(entry.v_star_max, entry.accuracy): _cell(entry) for entry in smallest_degrees(v_star_max, accuracy)}
    lines = ["| V | " + " | ".join(f"{limit:.0e}" for limit in accuracy) + " |", "|--:" * (len(accuracy) + 1) + "|"]
    lines += [f"| {v:g} | " + " | ".join(cells[v, limit] for limit in accuracy) + " |" for v in v_star_max]
    return "\n".join(lines) + "\n"


def _cell(entry: Smallest) -> str:
    best, other = ("–" if r is None else f"{r.m}/{r.n}" for r in (entry.best, entry.pade))
    return f"{best} ({other})"


@lru_cache(maxsize=len(GRID))
def _on(v_star_max: float) -> tuple[Record, ...]:
    return tuple(record for record in table() if record.v_star_max == v_star_max)


def _cheapest(records: Iterable[Record], limit: float) -> Record | None:
    good = (record for record in records if record.error <= limit)
    return min(good, key=lambda record: (record.cost, record.error), default=None)


def _smallest_pade(records: Iterable[Record], limit: float) -> Record | None:
    good = (record for record in records if record.n == record.m + 3 and record.pade_error <= limit)
    return min(good, key=lambda record: record.m, default=None)
