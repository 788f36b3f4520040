"""Make the table of how many coefficients an accuracy takes, and that of the cheapest degrees in the documentation."""

from __future__ import annotations

import math
from collections.abc import Iterator
from decimal import Decimal
from fractions import Fraction

from viscopade.approximation import minimax, remez
from viscopade.approximation.frontier import COLUMNS, DATA, GRID, PADE_MAX_M, best_within, pade_within
from viscopade.approximation.minimax import MAX_M, MAX_N
from viscopade.approximation.target import TABLE_DIGITS
from viscopade.arithmetic.decimals import at_most
from viscopade.generated import MARKER
from viscopade.progress import track
from viscopade.theory.pade import DegenerateError, Pade, pade

PLACES = 4
ACCURACIES = tuple(float(f"1e-{k}") for k in range(2, 13))
DEGREES = (
    *((m, n) for m in range(MAX_M + 1) for n in range(MAX_N + 1) if max(m, n) >= 2),
    *((m, m + 3) for m in range(MAX_M + 1, PADE_MAX_M + 1)),
)
# Of Padé's coefficients, beyond those of the values: more than the cancellation within a and b takes away.
EXTRA_DIGITS = 40


def best_error(m: int, n: int, v_star_max: float) -> float:
    """Return the error of the best [m/n] on [0, v_star_max]; infinite if it is not below 1."""
    if m > MAX_M or n > MAX_N:
        return math.inf
    try:
        return minimax.fit(m, n, v_star_max).error
    except minimax.TooCoarse:
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
        task = minimax.minimax_problem(m, n, (Fraction(0), Fraction(v_star_max)), "both", digits)
        a, b = ([c.mid() for c in side] for side in (approximant.a, approximant.b))
        error = remez.sup_error(task, a, b, _near_poles(approximant, v_star_max))
        if error >= task.least_error:
            return error
        digits *= 2


def _near_poles(approximant: Pade, v_star_max: float) -> list[float]:
    """Return the points of the interval next to complex poles, where the error may have a peak."""
    return sorted({v for pole in approximant.poles if 0 < (v := float(pole.value.real.mid())) < v_star_max})


def error_cell(number: float) -> str:
    """Return a decimal of `PLACES` significant digits that is not smaller; nothing for infinity."""
    if math.isinf(number):
        return ""
    return f"{Decimal(at_most(number, PLACES)):.{PLACES - 1}e}"


def _lines() -> Iterator[str]:
    yield f"# {MARKER}: python -m tools.frontier > src/viscopade/{DATA}"
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
        yield ",".join([f"{v:g}", str(m), str(n), *map(error_cell, errors)])


def text() -> str:
    """Return the table."""
    return "\n".join(_lines()) + "\n"


def markdown() -> str:
    """Return the degrees of the cheapest best approximant for each accuracy and V, and in parentheses Padé's."""
    header = "| V | " + " | ".join(f"{limit:.0e}" for limit in ACCURACIES) + " |"
    rows = (f"| {v:g} | " + " | ".join(_degrees(limit, v) for limit in ACCURACIES) + " |" for v in GRID)
    return "\n".join([header, "|--:" * (len(ACCURACIES) + 1) + "|", *rows]) + "\n"


def _degrees(limit: float, v_star_max: float) -> str:
    found = best_within(limit, v_star_max), pade_within(limit, v_star_max)
    best, other = ("–" if record is None else f"{record.m}/{record.n}" for record in found)
    return f"{best} ({other})"


if __name__ == "__main__":
    print(text(), end="")
