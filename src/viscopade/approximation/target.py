"""Target of fits: eps(v*) and 1 - eps(v*) at many points, to any number of digits (sampled; `exact` is proven).

The function is cut into panels, each with polynomials in z = (v* - centre)/(half width). Up to 17 digits they are the
rows of `double`'s table, taken exactly. For more digits they are made when they are first needed: from the proven
series (eq:epsSeriesAdvanced) for v* <= 1/2, where it converges like (v*/1.047)^k, and from there on, an octave each, by
interpolation of proven values at Chebyshev's nodes. Both are checked between the nodes. Laws of contact other than the
paper's have no table: their panels are made likewise, as v* = kappa^(1/d) has singularities at similar distances.
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
from viscopade.arithmetic.balls import ball_of, bits_for, rational_power, working
from viscopade.arrays import panels
from viscopade.arrays.panels import CENTRES, HALF_WIDTHS, PANELS, PERIOD, Row
from viscopade.collision import exact
from viscopade.collision.law_panels import limit
from viscopade.progress import track
from viscopade.theory.law import VISCOELASTIC, Law
from viscopade.theory.series import series

TABLE_DIGITS = 17
RADIUS = (
    1.0471  # of convergence for the paper's law, rounded up (`derivations/09_singularity.py`); elsewhere a first guess
)
SERIES_ENDS = (Fraction(1, 16), Fraction(1, 8), Fraction(1, 4), Fraction(1, 2))
ELLIPSES = {0: 8.5, 1: 5.9}  # on the octave up to 2^key, interpolation at n nodes is off by about this to the -n
ELLIPSE = 4.6  # on all others
FAR = 40  # v* from which limits are looked at
STEP = 5  # panels are made for multiples of so many digits
GUARD_DIGITS = 3
MAX_ATTEMPTS = 6
LARGEST = Fraction(10) ** 7  # v* for more digits than the table has


class TargetValues(NamedTuple):
    """Values of eps, 1 - eps and (1 - eps)/v*^d, which at v* = 0 is the limit -h_d."""

    epsilon: arb
    loss: arb
    loss_ratio: arb


@dataclass(frozen=True)
class _ExactPanel:
    """Polynomials in z = (v* - centre)/(half width): eps and 1 - eps, or near 0 (1 - eps)/v*^d alone."""

    centre: Fraction
    half_width: Fraction
    polynomials: tuple[arb_poly, ...]

    def at(self, v_star: arb, d: int, folds: int = 0) -> TargetValues:
        """Return the values at v*; 8^folds times smaller v* are on the panel, for which eps is 2^(10 folds) larger."""
        z = (v_star * arb(2) ** (-PERIOD * folds) - ball_of(self.centre)) / ball_of(self.half_width)
        values = [polynomial(z).mid() for polynomial in self.polynomials]
        if len(values) == 1:
            (loss_ratio,) = values
            loss = (loss_ratio * v_star**d).mid()
            return TargetValues((1 - loss).mid(), loss, loss_ratio)
        epsilon, loss = values
        if folds:
            epsilon = (epsilon * arb(2) ** (-10 * folds)).mid()
            loss = (1 - epsilon).mid()
        return TargetValues(epsilon, loss, (loss / v_star**d).mid())


@dataclass(frozen=True)
class ExactEpsilon:
    """The exact function of a law, to `digits` digits: relative error of eps and of 1 - eps below 10^-digits (sampled).

    `at` takes v* >= 0 as the middle of a ball and works at FLINT's present precision (`balls.working`), of which it
    needs `bits_for(digits)` and some more. Its results are middles: what encloses nothing.
    """

    digits: int
    law: Law = VISCOELASTIC

    @cached_property
    def c(self) -> arb:
        """The limit of (1 - eps)/v*^d at v* = 0, which is -h_d."""
        with working(bits_for(self.digits) + 64):
            return self.at(arb(0)).loss_ratio

    def at(self, v_star: arb) -> TargetValues:
        """Return eps, 1 - eps and (1 - eps)/v*^d."""
        near = float(v_star)
        if not near >= 0:
            raise ValueError(f"v_star is {near!r}: accepted is a number >= 0")
        if self.digits <= TABLE_DIGITS and self.law == VISCOELASTIC:
            index, folds = panels.index_of(near)
            return _table_panel(index).at(v_star, self.law.d, folds)
        if (far := _far_epsilon(v_star, self.digits, self.law)) is not None:
            return TargetValues(far, (1 - far).mid(), ((1 - far) / v_star**self.law.d).mid())
        return _made_panel(near, self.digits, self.law).at(v_star, self.law.d)


def exact_target(digits: SupportsIndex = TABLE_DIGITS, law: Law = VISCOELASTIC) -> ExactEpsilon:
    """Return the exact curve of a law to a number of digits, at least 1; it keeps its panels for later calls.

    Raises
    ------
    TypeError, ValueError
        If digits is not an integer, or out of range.
    """
    return ExactEpsilon(max(arguments.digits(digits), TABLE_DIGITS), law)


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


def _far_epsilon(v_star: arb, digits: int, law: Law) -> arb | None:
    """Return eps of a law without a table where its limit for large v* gives all digits, else None."""
    if not law.whole_decay or not v_star > FAR:
        return None
    try:
        factor = limit(law, v_star)
    except ValueError:
        return None
    if not factor.rad() < arb(10) ** (-digits - GUARD_DIGITS):
        return None
    return (factor * rational_power(ball_of(law.damping + 1), law.nu - 1) / v_star**law.whole_decay).mid()


def _made_panel(v_star: float, digits: int, law: Law) -> _ExactPanel:
    rounded = STEP * math.ceil(digits / STEP)
    for end in SERIES_ENDS:
        if v_star <= end:
            return _series_panel(end, rounded, law)
    if v_star > LARGEST:
        raise ValueError(f"v_star is {v_star!r}: accepted where there is no table is at most {float(LARGEST):g}")
    return _octave_panel(math.ceil(math.log2(v_star)), rounded, law)


@lru_cache(maxsize=64)
def _series_panel(end: Fraction, digits: int, law: Law) -> _ExactPanel:
    """Return (1 - eps)/v*^d on [0, end] from the series."""

    def summed(order: int) -> _ExactPanel:
        with working(bits_for(digits) + 32):
            h = series(order, digits + GUARD_DIGITS, law=law).h
            return _ExactPanel(Fraction(0), Fraction(1), (arb_poly([-h_k.mid() for h_k in h[law.d :]]),))

    order = math.ceil((digits + GUARD_DIGITS) / math.log10(RADIUS / float(end))) + law.d
    return _checked(summed, order, (end,), digits, law)


@lru_cache(maxsize=256)
def _octave_panel(exponent: int, digits: int, law: Law) -> _ExactPanel:
    """Return the panel [2^(exponent - 1), 2^exponent]: interpolated, and compared with proven values in between."""
    centre, half_width = Fraction(3, 4) * Fraction(2) ** exponent, Fraction(1, 4) * Fraction(2) ** exponent
    number = math.ceil((digits + GUARD_DIGITS) / math.log10(ELLIPSES.get(exponent, ELLIPSE)))
    places = tuple(centre + half_width * z for z in (Fraction(-1), Fraction(1, 7), Fraction(1)))
    return _checked(lambda n: _interpolated(centre, half_width, n, digits, law), number, places, digits, law)


def _checked(
    made: Callable[[int], _ExactPanel], number: int, places: Sequence[Fraction], digits: int, law: Law
) -> _ExactPanel:
    """Return a panel of so many terms, or more, that agrees with proven values at places."""
    for _ in range(MAX_ATTEMPTS):
        panel = made(number)
        if all(_agrees(panel, v_star, digits, law) for v_star in places):
            return panel
        number += 1 + number // 4
    raise ArithmeticError(f"{number} terms do not give {digits} digits of eps at v* = {float(places[-1]):g}")


def _interpolated(centre: Fraction, half_width: Fraction, number: int, digits: int, law: Law) -> _ExactPanel:
    cosines = [math.cos((2 * i + 1) * math.pi / (2 * number)) for i in range(number)]
    nodes = [Fraction(round(c * 2**30), 2**30) for c in cosines]
    values = [
        exact.collision(centre + half_width * nodes[i], digits + GUARD_DIGITS, law=law)
        for i in track(range(number), f"eps to {digits} digits")
    ]
    with working(bits_for(digits) + 4 * number + 64):  # Vandermonde's matrix has a condition below 2.5^number
        powers = arb_mat([[ball_of(z) ** n for n in range(number)] for z in nodes])
        columns = powers.solve(arb_mat([[v.epsilon.mid(), v.one_minus_epsilon.mid()] for v in values]))
        polynomials = tuple(arb_poly([columns[i, k].mid() for i in range(number)]) for k in (0, 1))
    return _ExactPanel(centre, half_width, polynomials)


def _agrees(panel: _ExactPanel, v_star: Fraction, digits: int, law: Law) -> bool:
    """Whether a panel is right to `digits` digits at a point."""
    true = exact.collision(v_star, digits + GUARD_DIGITS, law=law)
    with working(bits_for(digits) + 64):
        found = panel.at(ball_of(v_star), law.d)
        pairs = ((found.epsilon, true.epsilon), (found.loss, true.one_minus_epsilon))
        return all(abs((value / right - 1).mid()) < arb(10) ** -digits for value, right in pairs)
