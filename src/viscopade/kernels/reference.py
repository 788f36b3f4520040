"""Reference of proofs: the stored table of panels as power series, with which a formula is compared.

The table has polynomials in v* for eps and 1 - eps with a proven error (`panel_proof`). On a panel all is a power
series in y, v* = y^power. Functions are to be used within `balls.working(BITS)`.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from fractions import Fraction
from functools import lru_cache
from typing import NamedTuple

from flint import arb, arb_series

from viscopade.arithmetic.balls import ball_of, power_of_series
from viscopade.arrays.panels import CENTRES, DATA, HALF_WIDTHS, PANELS
from viscopade.collision import panel_proof
from viscopade.kernels.enclosure import Formula, polynomial

BITS = 192
"""Bits of the middles of balls in proofs. Rows are proven to 2^-60; 64 to 384 bits give the same certificates of
kernels (measured), so that these leave room for formulas that lose many."""


class Stretch(NamedTuple):
    """The part of a panel in an interval: start <= z <= end in the panel's own coordinate."""

    panel: int
    start: Fraction
    end: Fraction

    def parts(self, number: int) -> Iterator[tuple[Fraction, Fraction]]:
        """Yield the ends in z of `number` equal parts."""
        width = (self.end - self.start) / number
        for i in range(number):
            yield self.start + i * width, self.start + (i + 1) * width


def stretches(low: Fraction, high: Fraction) -> list[Stretch]:
    """Return the stretches of panels that cover low <= v* <= high; errors as for `certificate.prove`."""
    if not 0 <= low < high <= panel_proof.END:
        raise ValueError(f"the interval is [{low}, {high}]: expected 0 <= low < high <= {panel_proof.END}")
    covering = []
    for panel in range(PANELS):
        centre, half = (Fraction(float(values[panel])) for values in (CENTRES, HALF_WIDTHS))
        # v* = centre + half z, -1 <= z <= 1; panel 0 has its centre at v* = 0, and 0 <= z <= 1.
        start = max(Fraction(-1 if panel else 0), (low - centre) / half)
        end = min(Fraction(1), (high - centre) / half)
        if start < end:
            covering.append(Stretch(panel, start, end))
    return covering


def v_star_at(panel: int, z: Fraction = Fraction(0)) -> arb:
    """Enclose v* at z in a panel, by default at its centre: v* = centre + (half width) z."""
    return ball_of(Fraction(float(CENTRES[panel])) + Fraction(float(HALF_WIDTHS[panel])) * z)


def y_at(panel: int, z: Fraction, power: int) -> arb:
    """Enclose y = v*^(1/power) at z in a panel."""
    v_star = v_star_at(panel, z)
    # v* is 0 only at z = 0 of panel 0; FLINT has no root of a ball there.
    return v_star.root(power) if v_star > 0 else arb(0)


class Rows:
    """The table's rows on a panel as functions of y = v*^(1/power), with their names in formulas."""

    def __init__(self, panel: int, y: arb_series, power: int) -> None:
        self.panel, self.y, self.power, self.v_star = panel, y, power, y**power
        self.half = arb(float(HALF_WIDTHS[panel]))

    @property
    def epsilon(self) -> arb_series:
        """The row of eps."""
        return self._on_panel(_coefficients("epsilon", self.panel))

    @property
    def loss_ratio(self) -> arb_series:
        """(1 - eps)/v*^2; on the panel at 0 the row of 1 - eps is divisible by v*^2."""
        row = _coefficients("one_minus_epsilon", self.panel)
        if self.panel > 0:
            return self._on_panel(row) / (self.v_star * self.v_star)
        # On panel 0 v* = half z, so that row/v*^2 = (c_2 + c_3 z + …)/half^2, if c_0 = c_1 = 0.
        if not (row[0].is_zero() and row[1].is_zero()):
            raise ArithmeticError("1 - eps must be divisible by v*^2")
        return self._on_panel(row[2:]) / self.half**2

    def inverse_ratio(self, formula: Formula) -> arb_series:
        """Return the v* of an inverse kernel over the true one, for every eps on the panel.

        The kernel is q^(1/2) N/D in the kernel's own y = q^(1/(2 power)), with q = (1 - eps)/eps; the formula's "ratio"
        is N/D.
        """
        # q/v*^2 of the true function: each row has a relative error of at most d = 2^-60; (1 + d)/(1 - d) < 1 + 3 d.
        odds_ratio = self.loss_ratio / self.epsilon * arb(1, 3 * panel_proof.proven_error())
        # q^(1/(2 power)) = v*^(1/power) (q/v*^2)^(1/(2 power)), and q^(1/2)/v* = (q/v*^2)^(1/2).
        kernel_y = self.y * power_of_series(odds_ratio, Fraction(1, 2 * self.power))
        return power_of_series(odds_ratio, Fraction(1, 2)) * formula.near_zero("ratio", y=kernel_y)

    def _on_panel(self, coefficients: Sequence[arb]) -> arb_series:
        """Return a polynomial in z = (v* - centre)/(half width) as a series in the variable of y."""
        return polynomial(coefficients, (self.v_star - arb(float(CENTRES[self.panel]))) / self.half)


@lru_cache(maxsize=2 * PANELS)  # two rows on each panel
def _coefficients(name: str, panel: int) -> list[arb]:
    return panel_proof.panel_rows()[name, panel].poly().coeffs()


def limit(v_star: arb) -> arb:
    """Enclose eps v*^(10/3) for all v* from `v_star` on."""
    # (3/2)^(2/3) up to a factor e^(±tail): docs/theory/exact-function.md, step 8.
    return panel_proof.asymptotic_factor() * arb(0, panel_proof.tail(v_star)).exp()


def record() -> dict[str, object]:
    """Return what a certificate says of the reference, as JSON-able data."""
    return {"reference": DATA, "reference_error": panel_proof.proven_error().hex()}
