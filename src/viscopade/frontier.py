"""How many coefficients an accuracy takes: best and Padé approximants [m/n] of eps on [0, V], as a table.

The table is made by  python -m viscopade.frontier > src/viscopade/data/frontier.csv ; the queries read it, and run no
fit. Errors are the largest max(|d eps|/eps, |d eps|/(1 - eps)) on the interval, of exact evaluation (sampled), rounded
up to `PLACES` significant digits. [m/n] has m + n coefficients besides a_0 = b_0 = 1, and takes as many
multiplications.
"""

from __future__ import annotations

import csv
import math
import pkgutil
from bisect import bisect_left
from collections.abc import Iterable, Iterator, Sequence
from dataclasses import dataclass
from decimal import Decimal
from fractions import Fraction
from functools import lru_cache
from typing import cast

from viscopade import checks, minimax, remez
from viscopade.certificate import at_most
from viscopade.curve import TABLE_DIGITS
from viscopade.exact import Exact
from viscopade.kernels import MARKER
from viscopade.minimax import MAX_M, MAX_N
from viscopade.pade import DegenerateError, Pade, pade
from viscopade.progress import track

DATA = "data/frontier.csv"
COLUMNS = ("v_star_max", "m", "n", "error", "pade_error")
PLACES = 4

GRID = (0.1, 0.2, 0.5, 1.0, 1.5, 2.0, 3.0, 5.0, 7.0, 10.0, 20.0, 50.0, 100.0, 1000.0)
"""V, as doubles: what the table has been made for."""
ACCURACIES = tuple(float(f"1e-{k}") for k in range(2, 13))
PADE_MAX_M = 25  # of [m/m+3], which the paper recommends and goes on to where no fit is wanted
DEGREES = (
    *((m, n) for m in range(MAX_M + 1) for n in range(MAX_N + 1) if max(m, n) >= 2),
    *((m, m + 3) for m in range(MAX_M + 1, PADE_MAX_M + 1)),
)

# Of Padé's coefficients, beyond those of the values: more than the cancellation within a and b takes away.
EXTRA_DIGITS = 40

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
        """Coefficients besides a_0 = b_0 = 1, and multiplications."""
        return self.m + self.n

    @property
    def cost(self) -> int:
        """Multiplications and division."""
        return minimax.cost(self.m, self.n)


@dataclass(frozen=True)
class Smallest:
    """What an accuracy takes on [0, v_star_max].

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
    """Return the cheapest degrees whose best approximant is as accurate as wanted on [0, v_star_max].

    The cost is that of `minimax.cost`; among equally cheap ones, the most accurate is returned. Between two numbers of
    `GRID` the larger one stands for v_star_max (the record says which): there may be cheaper degrees for the shorter
    interval, as `minimax.choose` finds them.

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
    limit = float(checks.exact("accuracy", accuracy, "a number above 0 and below 1", lambda x: 0 < x < 1))
    accepted = f"a number above 0, at most {GRID[-1]:g} (where the table ends; minimax.choose goes further)"
    end = checks.exact("v_star_max", v_star_max, accepted, lambda v: 0 < v <= GRID[-1])
    grid_end = GRID[bisect_left(GRID, end)]
    found = _cheapest(_on(grid_end), limit)
    if found is None:
        least = min(record.error for record in _on(grid_end))
        raise ValueError(
            f"accuracy is {limit:g}: accepted on [0, {grid_end:g}] is {least:g} or more ({_WHAT_ELSE}), or a"
            " shorter interval"
        )
    return found


def smallest(v_star_max: Sequence[float] = GRID, accuracy: Sequence[float] = ACCURACIES) -> tuple[Smallest, ...]:
    """Return what each accuracy takes on each interval [0, v_star_max], for reports.

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
    """Return `smallest` as a table in Markdown; arguments and errors as there.

    A cell holds the degrees of the best approximant, and in parentheses those of Padé's.
    """
    cells = {(entry.v_star_max, entry.accuracy): _cell(entry) for entry in smallest(v_star_max, accuracy)}
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


# --- how the table is made --------------------------------------------------------------------------------------------


def best_error(m: int, n: int, v_star_max: float) -> float:
    """Return the error of the best [m/n] on [0, v_star_max]; infinite if it is not below 1."""
    if m > MAX_M or n > MAX_N:
        return math.inf
    try:
        return minimax.fit(m, n, v_star_max).error
    except ValueError as reason:
        if "accepted are degrees and intervals with an error below 1" not in str(reason):
            raise
        return math.inf


def pade_error(m: int, n: int, v_star_max: float) -> float:
    """Return the error of Padé's [m/n] on [0, v_star_max]; infinite if it does not exist or has a pole there."""
    digits = TABLE_DIGITS
    while True:
        try:
            approximant = pade(m, n, digits + EXTRA_DIGITS)
        except DegenerateError:
            return math.inf
        if approximant.positive_pole is not None and not approximant.positive_pole.value.real > v_star_max:
            return math.inf
        task = minimax.problem(m, n, (Fraction(0), Fraction(v_star_max)), "both", digits)
        a, b = ([c.mid() for c in side] for side in (approximant.a, approximant.b))
        error, _ = remez.sup_error(task, a, b, _near_poles(approximant, v_star_max))
        if error >= task.least_error:
            return error
        digits *= 2


def _near_poles(approximant: Pade, v_star_max: float) -> list[float]:
    """Return the points of the interval next to complex poles, where the error may have a peak."""
    return sorted({v for pole in approximant.poles if 0 < (v := float(pole.value.real.mid())) < v_star_max})


def rounded_up(number: float) -> str:
    """Return a decimal of `PLACES` significant digits that is not smaller; nothing for infinity."""
    if math.isinf(number):
        return ""
    return f"{Decimal(at_most(number, PLACES)):.{PLACES - 1}e}"


def _lines() -> Iterator[str]:
    yield f"# {MARKER}: python -m viscopade.frontier > src/viscopade/{DATA}"
    yield "# Approximants [m/n] of eps(v*) for 0 <= v* <= v_star_max."
    yield "# End of contact: where the force vanishes (eq:tEndAdvanced)."
    yield "# Errors: largest max(|d eps|/eps, |d eps|/(1 - eps)) of exact evaluation, sampled."
    yield f"# Rounded up to {PLACES} digits."
    yield f"# error: of the best [m/n], a_0 = b_0 = 1, a_1 = b_1; empty if not below 1, or m > {MAX_M} (not computed)."
    yield "# pade_error: of Padé's [m/n]; empty if it does not exist or has a pole in the interval (proven)."
    yield ",".join(COLUMNS)
    rows = [
        (v, m, n, best_error(m, n, v), pade_error(m, n, v))
        for m, n in (DEGREES[i] for i in track(range(len(DEGREES)), "frontier"))
        for v in GRID
    ]
    for v, m, n, *errors in sorted(rows):
        yield ",".join([f"{v:g}", str(m), str(n), *map(rounded_up, errors)])


def text() -> str:
    """Return the table."""
    return "\n".join(_lines()) + "\n"


if __name__ == "__main__":
    print(text(), end="")
