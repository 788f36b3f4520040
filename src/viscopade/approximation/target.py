"""Target of fits: eps(v*) and 1 - eps(v*) at many points, to any number of digits (sampled; `exact` is proven).

The function is cut into panels, each with polynomials in z = (v* - centre)/(half width). Up to 17 digits they are the
exact rows of `double`'s table. For more digits they are made when they are first needed: for v* <= 1/2 from the proven
series (eq:epsSeriesAdvanced), which converges like (v*/1.047)^k, and above, for each octave, by interpolation of proven
values at Chebyshev's nodes. Both are checked between the nodes.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from fractions import Fraction
from functools import cached_property, lru_cache
from typing import NamedTuple, SupportsIndex

from flint import arb, arb_mat, arb_poly

from viscopade import arguments
from viscopade.arithmetic.balls import ball_of, bits_for, working
from viscopade.arrays import panels
from viscopade.arrays.panels import CENTRES, HALF_WIDTHS, PANELS, PERIOD, Row
from viscopade.collision import exact
from viscopade.progress import track
from viscopade.theory.series import series

TABLE_DIGITS = 17
RADIUS = 1.0471  # of convergence, rounded up (`derivations/09_singularity.py`)
SERIES_ENDS = (Fraction(1, 16), Fraction(1, 8), Fraction(1, 4), Fraction(1, 2))
ELLIPSES = {0: 8.5, 1: 5.9}  # on the octave up to 2^key, interpolation at n nodes has an error of about this to the -n
ELLIPSE = 4.6  # the same number for all other octaves
STEP = 5  # panels are made for multiples of this number of digits
GUARD_DIGITS = 3
MAX_ATTEMPTS = 6
LARGEST = Fraction(10) ** 7  # v* for more digits than the table has


class TargetValues(NamedTuple):
    """Values of eps, 1 - eps and (1 - eps)/v*^2, which at v* = 0 is the limit -h_2."""

    epsilon: arb
    loss: arb
    loss_ratio: arb


@dataclass(frozen=True)
class _ExactPanel:
    """Polynomials in z = (v* - centre)/(half width): eps and 1 - eps, or near 0 only (1 - eps)/v*^2."""

    centre: Fraction
    half_width: Fraction
    polynomials: tuple[arb_poly, ...]

    def at(self, v_star: arb, folds: int = 0) -> TargetValues:
        """Return the values at v*, from those at v*/8^folds on the panel, where eps is 2^(10 folds) larger."""
        z = (v_star * arb(2) ** (-PERIOD * folds) - ball_of(self.centre)) / ball_of(self.half_width)
        values = [polynomial(z).mid() for polynomial in self.polynomials]
        if len(values) == 1:
            (loss_ratio,) = values
            loss = (loss_ratio * v_star**2).mid()
            return TargetValues((1 - loss).mid(), loss, loss_ratio)
        epsilon, loss = values
        if folds:
            epsilon = (epsilon * arb(2) ** (-10 * folds)).mid()
            loss = (1 - epsilon).mid()
        return TargetValues(epsilon, loss, (loss / v_star**2).mid())


@dataclass(frozen=True)
class ExactEpsilon:
    """The exact function, to `digits` digits: relative error of eps and of 1 - eps below 10^-digits (sampled).

    `at` takes v* >= 0 as the middle of a ball and works at FLINT's present precision (`balls.working`), which must
    exceed `bits_for(digits)`. Its results are middles without a radius.
    """

    digits: int

    @cached_property
    def c(self) -> arb:
        """The limit of (1 - eps)/v*^2 at v* = 0, which is -h_2."""
        with working(bits_for(self.digits) + 64):
            return self.at(arb(0)).loss_ratio

    def at(self, v_star: arb) -> TargetValues:
        """Return eps, 1 - eps and (1 - eps)/v*^2."""
        near = float(v_star)
        if not near >= 0:
            raise ValueError(f"v_star is {near!r}: expected a number >= 0")
        if self.digits <= TABLE_DIGITS:
            index, folds = panels.index_of(near)
            return _table_panel(index).at(v_star, folds)
        return _made_panel(near, self.digits).at(v_star)


def exact_target(digits: SupportsIndex = TABLE_DIGITS) -> ExactEpsilon:
    """Return the exact curve to a number of digits, at least 1; panels are cached.

    Raises
    ------
    TypeError, ValueError
        If digits is not an integer, or out of range.
    """
    return ExactEpsilon(max(arguments.digits(digits), TABLE_DIGITS))


# --- the table of `double` --------------------------------------------------------------------------------------------


@lru_cache(maxsize=PANELS)
def _table_panel(index: int) -> _ExactPanel:
    epsilon, loss = (panels.rows()[name, index] for name in ("epsilon", "one_minus_epsilon"))
    centre, half_width = Fraction(CENTRES[index]), Fraction(HALF_WIDTHS[index])
    if index:
        return _ExactPanel(centre, half_width, (_exact_row(epsilon), _exact_row(loss)))
    exponent = loss.exponent - 2 * int(math.log2(half_width))
    return _ExactPanel(centre, half_width, (_exact_row(Row(exponent, loss.a[2:])),))


def _exact_row(row: Row) -> arb_poly:
    """Return 2^e (a_0 + a_1 z + …), exactly: integers of up to 70 bits."""
    with working(128):
        return arb_poly([arb(a) * arb(2) ** row.exponent for a in row.a])


# --- more digits ------------------------------------------------------------------------------------------------------


def _made_panel(v_star: float, digits: int) -> _ExactPanel:
    rounded = STEP * math.ceil(digits / STEP)
    for end in SERIES_ENDS:
        if v_star <= end:
            return _series_panel(end, rounded)
    if v_star > LARGEST:
        raise ValueError(f"v_star is {v_star!r}: expected at most {float(LARGEST):g} for more than 17 digits")
    return _octave_panel(math.ceil(math.log2(v_star)), rounded)


@lru_cache(maxsize=64)
def _series_panel(end: Fraction, digits: int) -> _ExactPanel:
    """Return (1 - eps)/v*^2 on [0, end] from the series."""

    def summed(order: int) -> _ExactPanel:
        with working(bits_for(digits) + 32):
            h = series(order, digits + GUARD_DIGITS).h
            return _ExactPanel(Fraction(0), Fraction(1), (arb_poly([-h_k.mid() for h_k in h[2:]]),))

    order = math.ceil((digits + GUARD_DIGITS) / math.log10(RADIUS / float(end))) + 2
    return _checked(summed, order, (end,), digits)


@lru_cache(maxsize=256)
def _octave_panel(exponent: int, digits: int) -> _ExactPanel:
    """Return the panel [2^(exponent - 1), 2^exponent]: interpolated, and compared with proven values in between."""
    centre, half_width = Fraction(3, 4) * Fraction(2) ** exponent, Fraction(1, 4) * Fraction(2) ** exponent
    number = math.ceil((digits + GUARD_DIGITS) / math.log10(ELLIPSES.get(exponent, ELLIPSE)))
    places = tuple(centre + half_width * z for z in (Fraction(-1), Fraction(1, 7), Fraction(1)))
    return _checked(lambda n: _interpolated(centre, half_width, n, digits), number, places, digits)


def _checked(made: Callable[[int], _ExactPanel], number: int, places: Sequence[Fraction], digits: int) -> _ExactPanel:
    """Return a panel of `number` terms, or more, that agrees with proven values at places."""
    for _ in range(MAX_ATTEMPTS):
        panel = made(number)
        if all(_agrees(panel, v_star, digits) for v_star in places):
            return panel
        number += 1 + number // 4
    raise ArithmeticError(f"{number} terms do not give {digits} digits of eps at v* = {float(places[-1]):g}")


def _interpolated(centre: Fraction, half_width: Fraction, number: int, digits: int) -> _ExactPanel:
    cosines = [math.cos((2 * i + 1) * math.pi / (2 * number)) for i in range(number)]
    nodes = [Fraction(round(c * 2**30), 2**30) for c in cosines]
    values = [
        exact.collision(centre + half_width * nodes[i], digits + GUARD_DIGITS)
        for i in track(range(number), f"eps to {digits} digits")
    ]
    with working(bits_for(digits) + 4 * number + 64):  # Vandermonde's matrix has a condition below 2.5^number
        powers = arb_mat([[ball_of(z) ** n for n in range(number)] for z in nodes])
        columns = powers.solve(arb_mat([[v.epsilon.mid(), v.one_minus_epsilon.mid()] for v in values]))
        polynomials = tuple(arb_poly([columns[i, k].mid() for i in range(number)]) for k in (0, 1))
    return _ExactPanel(centre, half_width, polynomials)


def _agrees(panel: _ExactPanel, v_star: Fraction, digits: int) -> bool:
    """Whether a panel is right to `digits` digits at a point."""
    true = exact.collision(v_star, digits + GUARD_DIGITS)
    with working(bits_for(digits) + 64):
        found = panel.at(ball_of(v_star))
        pairs = ((found.epsilon, true.epsilon), (found.loss, true.one_minus_epsilon))
        return all(abs((value / right - 1).mid()) < arb(10) ** -digits for value, right in pairs)
