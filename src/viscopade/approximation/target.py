"""Target of fits: eps(v*) and 1 - eps(v*) at many points, to 17 digits (sampled; `exact` is proven).

eps is the coefficient of restitution and v* the scaled speed of impact.
The values are those of the exact rows of `double`'s table: on each panel, polynomials in z = (v* - centre)/(half
width). Their arguments are the middles of balls, and their results middles without a radius, at FLINT's present
precision (`balls.working`), which must exceed `bits_for(DIGITS)`.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from fractions import Fraction
from functools import lru_cache
from typing import NamedTuple

from flint import arb, arb_poly

from viscopade.arithmetic.balls import ball_of, bits_for, working
from viscopade.arrays import panels
from viscopade.arrays.panels import CENTRES, HALF_WIDTHS, PANELS, PERIOD, Row

DIGITS = 17
"""Of eps and of 1 - eps, relative (sampled)."""


class TargetValues(NamedTuple):
    """Values of eps, 1 - eps and (1 - eps)/v*^2, which at v* = 0 is the limit -h_2."""

    epsilon: arb
    loss: arb
    loss_ratio: arb


def target(v_star: arb) -> TargetValues:
    """Return eps, 1 - eps and (1 - eps)/v*^2; ValueError if v* is negative or NaN."""
    # The double next to v* tells the panel; at the joint of two panels either one serves. `index_of` returns its
    # number, and how many times v* is divided by 8 to come onto it.
    near = float(v_star)
    if not near >= 0:
        raise ValueError(f"v_star is {near!r}: expected a number >= 0")
    index, folds = panels.index_of(near)
    return _panel(index).values(v_star, folds)


@lru_cache(maxsize=1)
def loss_limit() -> arb:
    """Return c, the limit of (1 - eps)/v*^2 at v* = 0, which is -h_2."""
    with working(bits_for(DIGITS) + 64):  # 64 bits (a machine word) more, so that rounding does not count
        return target(arb(0)).loss_ratio


# --- the table of `double` --------------------------------------------------------------------------------------------


@dataclass(frozen=True)
class _Panel:
    """Polynomials in z = (v* - centre)/(half width): eps and 1 - eps, or near 0 only (1 - eps)/v*^2."""

    centre: Fraction
    half_width: Fraction
    polynomials: tuple[arb_poly, ...]

    def values(self, v_star: arb, folds: int = 0) -> TargetValues:
        """Return the values at v*, from those at s = v*/8^folds on the panel, where eps is 2^(10 folds) larger.

        For large v* eps ~ v*^(-10/3) (derivations/10_large_v_star.py), and 8^(10/3) = 2^10; PERIOD = 3 is the exponent
        of 8 = 2^3. v* is divided from 2^20 on only, where the next terms are below the 17 digits.
        """
        # z = (s - centre)/(half width), s = v*/2^(3 folds)
        z = (v_star * arb(2) ** (-PERIOD * folds) - ball_of(self.centre)) / ball_of(self.half_width)
        values = [polynomial(z).mid() for polynomial in self.polynomials]
        # On panel 0, (1 - eps)/v*^2 gives the others.
        if len(values) == 1:
            (loss_ratio,) = values
            loss = (loss_ratio * v_star**2).mid()
            return TargetValues((1 - loss).mid(), loss, loss_ratio)
        # Elsewhere eps and 1 - eps have a polynomial each, beyond 2^FOLD eps alone.
        epsilon, loss = values
        if folds:
            epsilon = (epsilon * arb(2) ** (-10 * folds)).mid()
            loss = (1 - epsilon).mid()
        return TargetValues(epsilon, loss, (loss / v_star**2).mid())


@lru_cache(maxsize=PANELS)  # all of them
def _panel(index: int) -> _Panel:
    """Return the panel of an index, 0 to PANELS - 1, from the table of `double`."""
    epsilon, loss = (panels.rows()[name, index] for name in ("epsilon", "one_minus_epsilon"))
    centre, half_width = Fraction(CENTRES[index]), Fraction(HALF_WIDTHS[index])
    if index:
        return _Panel(centre, half_width, (_exact_row(epsilon), _exact_row(loss)))
    # Panel 0: 1 - eps = 2^e (a_2 z^2 + a_3 z^3 + …), v* = z half_width, and half_width is a power of 2. So
    # (1 - eps)/v*^2 = 2^e (a_2 + a_3 z + …)/half_width^2.
    exponent = loss.exponent - 2 * int(math.log2(half_width))
    return _Panel(centre, half_width, (_exact_row(Row(exponent, loss.a[2:])),))


def _exact_row(row: Row) -> arb_poly:
    """Return 2^e (a_0 + a_1 z + …), exactly: integers of up to 66 bits."""
    with working(128):  # more than the 66 bits of the integers, so that the products are exact
        return arb_poly([arb(a) * arb(2) ** row.exponent for a in row.a])
