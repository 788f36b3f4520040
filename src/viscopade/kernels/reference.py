r"""References of proofs: the exact collision on panels, as power series with which a formula is compared.

There are two: the stored table for the paper's law, polynomials in v* with a proven error (`panel_proof`), and panels
that enclose v*, eps and 1 - eps of any law as functions of one parameter, proven anew (`law_panels`).
"""

from __future__ import annotations

from abc import ABC, abstractmethod
from collections.abc import Iterator, Sequence
from fractions import Fraction
from typing import Any, NamedTuple

from flint import arb, arb_series

from viscopade.arithmetic.balls import ball_of, rational_power, working
from viscopade.arrays.panels import CENTRES, DATA, HALF_WIDTHS, PANELS
from viscopade.collision import law_panels, panel_proof
from viscopade.collision.law_panels import Course, LawPanel, power_of_series
from viscopade.kernels.enclosure import Formula, polynomial, quotient
from viscopade.theory.law import VISCOELASTIC, Law

ENDS = (60, 10**3, 10**4, 10**5, 10**6, 10**7)  # v* where the panels of other laws may end
BISECTIONS = 40
NEGLIGIBLE = 2.0**-7  # what is not known of the limit of eps, relative to the formula's error


class Stretch(NamedTuple):
    """The part of a panel in an interval: start <= z <= end in the panel's own coordinate."""

    place: int
    panel: Any
    start: Fraction
    end: Fraction

    def parts(self, number: int) -> Iterator[tuple[Fraction, Fraction]]:
        """Yield the ends in z of equal parts."""
        width = (self.end - self.start) / number
        for i in range(number):
            yield self.start + i * width, self.start + (i + 1) * width


class Reference(ABC):
    """The exact collision of a law on panels, and its limit beyond them; to be used within `balls.working(bits)`.

    On a panel all is a power series in y: with v* = root y^power on the panel at v* = 0, as the table's are everywhere.
    """

    law: Law
    bits: int  # of the proof
    tight: float  # a bound that halving the parts lowers by less than this factor is tight
    most_parts: int  # of a panel
    one_division: bool  # for a formula over the true function; the stored numbers of parts depend on it

    @abstractmethod
    def stretches(self, low: Fraction, high: Fraction) -> list[Stretch]:
        """Return the stretches of panels that cover an interval of v*; errors as for `certificate.prove`."""

    @abstractmethod
    def v_star(self, panel: Any, z: Fraction = Fraction(0)) -> arb:
        """Enclose v* at z."""

    @abstractmethod
    def y(self, panel: Any, z: Fraction, power: int) -> arb:
        """Enclose y at z."""

    @abstractmethod
    def course(self, panel: Any, y: arb_series, power: int) -> Course | Rows:
        """Return the collision at y."""

    @abstractmethod
    def error(self, panel: Any, measure: str) -> arb:
        """Bound the relative error of a course, as far as it does not enclose the true values."""

    @abstractmethod
    def end(self, error: arb) -> Fraction:
        """Return a v* from which the limit of eps is known well in comparison with a formula's error there."""

    @abstractmethod
    def limit(self, v_star: arb) -> arb:
        """Enclose eps v*^(nu d) for all larger v*."""

    @abstractmethod
    def record(self, measure: str, panels: Sequence[int]) -> dict[str, object]:
        """Return what a certificate for these panels says of the reference, as JSON-able data."""

    @property
    def factor(self) -> arb:
        """(b + 1)^(nu-1), the limit of eps v*^(nu d)."""
        return rational_power(ball_of(self.law.damping + 1), self.law.nu - 1)

    def inverse_ratio(self, formula: Formula, panel: Any, y: arb_series) -> arb_series:
        """Return the v* of an inverse kernel over the true one, for every eps on the panel."""
        course = self.course(panel, y, formula.power)
        scaled, own = self._own(course, formula.power, self.error(panel, "speed"))
        return scaled * formula.at("ratio", y=own)

    def _own(self, course: Course | Rows, power: int, error: arb | int = 0) -> tuple[arb_series, arb_series]:
        """Return own^power/v*, and own = ((1 - eps)/eps)^(1/(power d)), in which inverse kernels are N/D."""
        odds_ratio, d = course.loss_ratio / course.epsilon * arb(1, 3 * error), self.law.d
        own = course.stem * power_of_series(odds_ratio * course.root**d, Fraction(1, d * power))
        return power_of_series(odds_ratio, Fraction(1, d)), own


# --- the stored table -------------------------------------------------------------------------------------------------


class Rows:
    """The table's rows on a panel as functions of y = v*^(1/power), with their names in formulas."""

    def __init__(self, panel: int, y: arb_series, power: int) -> None:
        self.panel, self.stem, self.root, self.v_star = panel, y, arb_series([1]), y**power
        self.half = arb(float(HALF_WIDTHS[panel]))

    @property
    def epsilon(self) -> arb_series:
        """The row of eps."""
        return self.row("epsilon")

    @property
    def loss_ratio(self) -> arb_series:
        """(1 - eps)/v*^2; on the panel at 0 the row of 1 - eps is divisible by v*^2."""
        if self.panel > 0:
            return self.row("one_minus_epsilon") / (self.v_star * self.v_star)
        row = _coefficients("one_minus_epsilon", 0)
        if not (row[0].is_zero() and row[1].is_zero()):
            raise ArithmeticError("1 - eps must be divisible by v*^2")
        return self._on_panel(row[2:]) / self.half**2

    def row(self, name: str) -> arb_series:
        """Return the row of a function."""
        return self._on_panel(_coefficients(name, self.panel))

    def _on_panel(self, coefficients: Sequence[arb]) -> arb_series:
        return polynomial(coefficients, (self.v_star - arb(float(CENTRES[self.panel]))) / self.half)


def _coefficients(name: str, panel: int) -> list[arb]:
    return panel_proof.panel_rows()[name, panel].poly().coeffs()


class _Table(Reference):
    """The stored table. Panels are their indices, and y = v*^(1/power)."""

    law, bits, tight, most_parts, one_division = VISCOELASTIC, 192, 0.999, 1 << 9, False

    def stretches(self, low: Fraction, high: Fraction) -> list[Stretch]:
        if not 0 <= low < high <= panel_proof.END:
            raise ValueError(f"the interval is [{low}, {high}]: accepted is 0 <= low < high <= {panel_proof.END}")
        found = []
        for panel in range(PANELS):
            centre, half = (Fraction(float(values[panel])) for values in (CENTRES, HALF_WIDTHS))
            start = max(Fraction(-1 if panel else 0), (low - centre) / half)
            end = min(Fraction(1), (high - centre) / half)
            if start < end:
                found.append(Stretch(panel, panel, start, end))
        return found

    def v_star(self, panel: int, z: Fraction = Fraction(0)) -> arb:
        return ball_of(Fraction(float(CENTRES[panel])) + Fraction(float(HALF_WIDTHS[panel])) * z)

    def y(self, panel: int, z: Fraction, power: int) -> arb:
        v_star = self.v_star(panel, z)
        return v_star.root(power) if v_star > 0 else arb(0)

    def course(self, panel: int, y: arb_series, power: int) -> Rows:
        return Rows(panel, y, power)

    def error(self, panel: int, measure: str) -> arb:
        return arb(panel_proof.proven_error())

    def end(self, error: arb) -> Fraction:
        return panel_proof.END

    def limit(self, v_star: arb) -> arb:
        return self.factor * arb(0, panel_proof.tail(v_star)).exp()

    def record(self, measure: str, panels: Sequence[int]) -> dict[str, object]:
        return {"reference": DATA, "reference_error": panel_proof.proven_error().hex()}


TABLE = _Table()
"""The stored table of panels, for the paper's law."""


def speeds(low: Fraction, high: Fraction, number: int) -> Iterator[arb]:
    """Yield balls of v* that cover the interval, `number` to a panel of the table. To be called within `working`."""
    for stretch in TABLE.stretches(low, high):
        for ends in stretch.parts(number):
            start, end = (TABLE.v_star(stretch.panel, z) for z in ends)
            yield arb((start + end) / 2, ((end - start) / 2).abs_upper())


# --- panels of any law ------------------------------------------------------------------------------------------------


class _LawPanels(Reference):
    """Panels of a law with no attractive force, proven anew; y is z, but on the panel at the origin z = y^power."""

    bits, tight, most_parts, one_division = 160, 0.99, 1 << 10, True

    def __init__(self, law: Law) -> None:
        self.law = law

    def stretches(self, low: Fraction, high: Fraction) -> list[Stretch]:
        if not 0 <= low < high:
            raise ValueError(f"the interval is [{low}, {high}]: accepted is 0 <= low < high")
        if high > max(ENDS):
            raise ArithmeticError(f"proofs for the law {self.law} end at v* = {max(ENDS)}")
        try:
            panels = law_panels.law_panels(self.law, high)
        except ArithmeticError:
            raise ArithmeticError(f"no proof was found for the law {self.law} up to v* = {float(high):g}") from None
        whole = (Stretch(place, panel, panel.start, Fraction(1)) for place, panel in enumerate(panels))
        return [
            self._from(low, stretch) for stretch in whole if not self.v_star(stretch.panel, stretch.end) < ball_of(low)
        ]

    def _from(self, low: Fraction, stretch: Stretch) -> Stretch:
        """Return the stretch without a part where v* < low."""
        start, end = stretch.start, stretch.end
        for _ in range(BISECTIONS if low else 0):
            middle = (start + end) / 2
            start, end = (middle, end) if self.v_star(stretch.panel, middle) < ball_of(low) else (start, middle)
        return stretch._replace(start=start)

    def v_star(self, panel: LawPanel, z: Fraction = Fraction(0)) -> arb:
        return panel.course(arb_series([ball_of(z)])).v_star.coeffs()[0]

    def y(self, panel: LawPanel, z: Fraction, power: int) -> arb:
        return ball_of(z)

    def course(self, panel: LawPanel, y: arb_series, power: int) -> Course:
        return panel.course(y, power)

    def error(self, panel: LawPanel, measure: str) -> arb:
        return arb(0)  # courses enclose the true values

    def inverse_ratio(self, formula: Formula, panel: LawPanel, y: arb_series) -> arb_series:
        if panel.work:
            return super().inverse_ratio(formula, panel, y)
        # Where y is known less well N and D would each multiply its error by their degrees. It counts by the slope
        # d ln(N/D)/d ln y, for the true y or one between it and the approximate one.
        # (1 - eps)/eps is 1/eps - 1, and eps is at most 1/2 but for the error.
        error = arb(0, (3 * panel.error / (formula.power * self.law.d)).abs_upper())
        scaled, own = self._own(panel.course(y), formula.power)
        start, *rest = own.coeffs()
        with working(self.bits, y.prec + 1):  # as a derivative has a term less
            near = arb_series([start, arb(1)])
            ratio = formula.at("ratio", y=near)
            slope = quotient(near * ratio.derivative(), ratio)
        slope = slope(arb_series([arb(0), *rest]))
        _, rough = self._own(panel.course(y, true=False), formula.power)
        return scaled * formula.at("ratio", y=rough) * (slope * error).exp()

    def end(self, error: arb) -> Fraction:
        sharp = (end for end in ENDS if law_panels.limit(self.law, arb(end)).rad() < NEGLIGIBLE * error)
        return Fraction(next(sharp, ENDS[-1]))

    def limit(self, v_star: arb) -> arb:
        return law_panels.limit(self.law, v_star) * self.factor

    def record(self, measure: str, panels: Sequence[int]) -> dict[str, object]:
        return {"law": str(self.law), "end": self.law.end, "reference": "viscopade.collision.law_panels"}


def reference_of(law: Law, stored: bool = True) -> Reference:
    """Return the stored table, if wanted and for the paper's law, or else panels that are made anew."""
    return TABLE if stored and law == VISCOELASTIC else _LawPanels(law)
