"""eps(v*), 1 - eps(v*) and v*(eps) of the paper's law in microseconds, from the rows that `panel_proof` proves.

All are enclosures (balls `arb`: a middle and a radius), of 39 digits. There are none below `START`, beyond the panels,
and where a ball of v* contains an end of a panel. Functions are to be called within `balls.working(BITS)`.
"""

from __future__ import annotations

from bisect import bisect_left
from fractions import Fraction
from functools import lru_cache
from typing import NamedTuple

from flint import arb, arb_poly

from viscopade.arithmetic.balls import ball_of
from viscopade.arrays import panels
from viscopade.arrays.panels import CENTRES, HALF_WIDTHS, PANELS
from viscopade.collision import panel_proof
from viscopade.collision.panel_proof import EXACT, exact_rows

BITS = 170  # 39 digits are 130 bits; the others are for rounding in polynomials of 28 coefficients
DIGITS = 39  # the worst row's bound is 10^-39.3; with more digits, ever more collisions are integrated after all
START, END = float(panel_proof.ELASTIC), float(panel_proof.END)  # powers of 2
# In a panel's coordinate the first guess is off by at most 1, and the curve bends by a few per cent: each step doubles
# the right bits, from 4 on.
NEWTON_STEPS = 6


class Portions(NamedTuple):
    """eps and 1 - eps, each to its own relative accuracy."""

    epsilon: arb
    loss: arb


class _Row(NamedTuple):
    """A panel's polynomial in z = (v* - centre)/half for the smaller of eps and 1 - eps, with its bound."""

    is_epsilon: bool
    centre: arb
    half: arb
    polynomial: arb_poly
    slope: arb_poly
    error: arb
    factor: arb  # of the true function, 1/(1 ± error)


@lru_cache(maxsize=PANELS)
def _row(index: int) -> _Row:
    """Return the row of panel `index`; an OSError says that it is missing."""
    # 1/(1 ± error): the row q and the function f obey |q/f - 1| <= error, so f lies in the ball q/(1 ± error).
    if index not in exact_rows():
        raise OSError(f"{EXACT} has no row of panel {index}: run python -m tools.exact_table")
    exact_row = exact_rows()[index]
    centre, half = (arb(float(values[index])) for values in (CENTRES, HALF_WIDTHS))
    polynomial, error = exact_row.row.poly(), exact_row.error
    is_epsilon = exact_row.name == "epsilon"
    return _Row(is_epsilon, centre, half, polynomial, polynomial.derivative(), error, 1 / arb(1, error))


def portions(v_star: arb) -> Portions | None:
    """Enclose eps and 1 - eps for every v* of the ball `v_star`; None where the table does not tell.

    The smaller one comes from the row, the other one is 1 minus that.
    """
    if not START <= v_star < END:
        return None
    index, _ = panels.index_of(float(v_star))
    # v* may lie just below the end that a float rounds it to.
    for row in map(_row, range(index, max(index - 2, -1), -1)):
        if -1 <= (z := (v_star - row.centre) / row.half) <= 1:
            smaller = row.polynomial(z) * row.factor
            return Portions(smaller, 1 - smaller) if row.is_epsilon else Portions(1 - smaller, smaller)
    return None


def v_star_of(epsilon: Fraction) -> arb | None:
    """Enclose the v* with a coefficient of restitution `epsilon` in (0, 1); None where the table does not tell."""
    # The panel follows from (1 - eps)/eps, which grows with v*.
    eps, loss = ball_of(epsilon), ball_of(1 - epsilon)
    index = bisect_left(range(PANELS), float(loss / eps), key=_odds_at_end)
    if index == PANELS:
        return None
    row = _row(index)
    # Newton's method for the row, whose first term on panel 0 is c z^2.
    smaller = eps if row.is_epsilon else loss
    z = arb(0) if index else (smaller / row.polynomial[2]).sqrt().mid()
    for _ in range(NEWTON_STEPS):
        z = (z - (row.polynomial(z) - smaller) / row.slope(z)).mid()
    v_star = row.centre + row.half * z
    # eps falls strictly with v* (docs/theory/exact-function.md, step 5): v* lies between two speeds, one with a larger
    # and one with a smaller eps. The row is off by smaller * error at most, that is smaller * error/|slope| in z: four
    # times that to either side is so much that the row's error does not matter.
    width = 4 * smaller * row.error * row.half / abs(row.slope(z))
    low, high = (v_star - width).mid(), (v_star + width).mid()
    low_portions, high_portions = portions(low), portions(high)
    if low_portions is None or high_portions is None:
        return None
    falls = (
        low_portions.epsilon > smaller > high_portions.epsilon
        if row.is_epsilon
        else low_portions.loss < smaller < high_portions.loss
    )
    return low.union(high) if falls else None


@lru_cache(maxsize=PANELS)
def _odds_at_end(index: int) -> float:
    """Return (1 - eps)/eps at the end of a panel, nearly."""
    row = _row(index)
    smaller = row.polynomial(arb(1))
    return float((1 - smaller) / smaller if row.is_epsilon else smaller / (1 - smaller))
