r"""Proof of the table of panels: eps(v*) and 1 - eps(v*) as polynomials on panels of v*, with bounds of their errors.

The polynomials are the rows of `double`'s table. The proof assumes nothing about their origin: `prove_panel` compares
them, on a whole panel at once, with a `parametric_flow` of collisions whose error is proven
(docs/theory/exact-function.md, step 7).

`data/proven.txt` records the proven errors of each panel, with the digest of the table; `proven_error` reads them.

For the two ends a few lines of estimates suffice: below `ELASTIC` (`elastic_error`), and beyond the panels, where eps
is close to its limit (`tail`; step 8).
"""

from __future__ import annotations

import hashlib
import math
import pkgutil
from collections.abc import Iterator
from fractions import Fraction
from functools import lru_cache
from itertools import pairwise
from typing import NamedTuple, cast

from flint import arb, arb_poly, arb_series, fmpq, fmpq_poly, fmpz_poly

from viscopade.arithmetic.balls import coefficient_sum, exact_middle, magnitude, working
from viscopade.arrays import panels
from viscopade.arrays.panels import CENTRES, DATA, HALF_WIDTHS, PANELS
from viscopade.collision.flow import integrate
from viscopade.collision.parametric_flow import ParametricBranch, ParametricEnds, Scaled, integrated, parametric_ends

ACCURACY = 80
DEGREE = 24  # of polynomials in z
MORE_ACCURACY, MORE_DEGREE = 12, 6  # where the bounds are larger than
WANTED = 1.1 * 2.0**-62
ELASTIC = Fraction(1, 2**36)  # below, v* is so small that the first term of the series is enough
ELASTIC_ACCURACY = 160  # bits for the panel that begins there, where 1 - eps is small
ELASTIC_DEGREE = 38
PARTS = 64
RECORD = "data/proven.txt"
RECORD_BITS = 80  # recorded bounds are in units of 2^-80

END = Fraction(float(CENTRES[-1] + HALF_WIDTHS[-1]))
"""Where the panels end; beyond, see `tail`."""


class PanelRow(NamedTuple):
    """A row of the table: a function on a panel is 2^exponent (a_0 + a_1 z + …), z = (v* - centre)/(half width)."""

    exponent: int
    a: tuple[int, ...]

    def __call__(self, z: Fraction) -> Fraction:
        """Return the polynomial's value, exactly."""
        value = fmpq_poly(list(self.a))(fmpq(z.numerator, z.denominator))
        return Fraction(2) ** self.exponent * Fraction(int(value.p), int(value.q))

    def poly(self) -> arb_poly:
        """Return the polynomial, exactly if FLINT's precision holds it."""
        return arb_poly(fmpz_poly(list(self.a))) * arb(2) ** self.exponent


def _text(name: str) -> str:
    return cast(bytes, pkgutil.get_data("viscopade", name)).decode()


@lru_cache(maxsize=1)
def panel_rows() -> dict[tuple[str, int], PanelRow]:
    """Return all rows of the table, by function and panel."""
    return {place: PanelRow(*row) for place, row in panels.rows().items()}


class PanelBounds(NamedTuple):
    """Bounds of the relative errors of a panel's rows."""

    epsilon: arb
    one_minus_epsilon: arb

    def recorded(self) -> list[int]:
        """Return the bounds in the record's units, rounded up."""
        return [math.ceil(magnitude(bound) * 2**RECORD_BITS) for bound in self]


# --- the record -------------------------------------------------------------------------------------------------------


def proven() -> dict[int, list[int]]:
    """Return the recorded bounds of the rows for eps and 1 - eps on each panel, in units of 2^-80.

    Raises
    ------
    OSError
        If the record is not that of the table.
    """
    digest, *lines = [line for line in _text(RECORD).splitlines() if not line.startswith("#")]
    recorded = {panel: bounds for panel, *bounds in (map(int, line.split()) for line in lines)}
    if digest != digest_of_rows() or list(recorded) != list(range(PANELS)):
        raise OSError(f"{RECORD} does not belong to {DATA}: run python -m tools.panel_bounds > src/viscopade/{RECORD}")
    return recorded


def digest_of_rows() -> str:
    """Return the digest of the table, the record's line that names its table."""
    rows_only = "\n".join(line for line in _text(DATA).splitlines() if not line.startswith("#"))
    return f"sha256 {hashlib.sha256(rows_only.encode()).hexdigest()}"


@lru_cache(maxsize=1)
def proven_error() -> float:
    """Return the proven bound of the relative errors of all rows for eps and 1 - eps.

    It is the least power of 2 that leaves all recorded bounds a margin of one bit. A record out of date is found out
    here and not on import: it must not stop the command that renews it.

    Raises
    ------
    OSError
        If the record is not that of the table.
    """
    worst = max(max(bounds) for bounds in proven().values())
    return math.ldexp(1.0, worst.bit_length() + 1 - RECORD_BITS)


# --- proof ------------------------------------------------------------------------------------------------------------


def prove_panel(index: int) -> PanelBounds:
    """Bound the relative errors of a panel's rows for eps and 1 - eps, on the whole panel.

    Raises
    ------
    ValueError
        If there is no such panel.
    ArithmeticError
        If the bounds are not small.
    """
    if index not in range(PANELS):
        raise ValueError(f"panel is {index}: expected 0 to {PANELS - 1}")
    bounds = _PanelProof(index).bounds()
    if max(bounds) > WANTED:
        bounds = _PanelProof(index, MORE_ACCURACY, MORE_DEGREE).bounds()
    return PanelBounds(*map(max, bounds, elastic_error())) if index == 0 else bounds


class _PanelProof:
    """The proof for one panel.

    With `power` 1, for panel 0 from ELASTIC on, v* = z (half width), and k is divisible by z^2.
    """

    def __init__(self, index: int, more_accuracy: int = 0, more_degree: int = 0) -> None:
        self.index = index
        self.power = 1 if index == 0 else 0
        accuracy, degree = (ELASTIC_ACCURACY, ELASTIC_DEGREE) if index == 0 else (ACCURACY, DEGREE)
        self.accuracy, self.degree = accuracy + more_accuracy, degree + more_degree
        self.bits = self.accuracy + 40

    def v_star(self) -> arb_poly:
        """Return v* / z^power."""
        centre, half = _ball(CENTRES[self.index]), _ball(HALF_WIDTHS[self.index])
        return arb_poly([half] if self.power else [centre, half])

    def bounds(self) -> PanelBounds:
        """Integrate and compare."""
        k = self._k()
        loading, unloading = (parametric_ends(self._integrated(k, half), self.power > 0) for half in (False, True))
        with working(2 * self.bits):
            return self._compared(k, loading, unloading)

    def _integrated(self, k: Scaled, unloading: bool) -> ParametricBranch:
        gap = self.accuracy // 2 - 6 * self.power + max(_size(k), 0) if unloading else self.accuracy // 3 + 4
        return integrated(k, unloading, self.accuracy, self.degree, gap)

    def _k(self) -> Scaled:
        """Return k(z) for which v* is nearly linear in z: from x_max of the table, with one step of Newton's method."""
        length = self.degree + 1
        with working(self.bits, length):
            v_star = arb_series(self.v_star(), length)
            x_max = arb_series(panel_rows()["x_max", self.index].poly(), length)
            first = 2 * v_star * v_star * x_max.sqrt().sqrt()
        trial = self._scaled(first)
        with working(self.bits, length):
            slope, step = self._integrated(trial, False).roughly()
            wanted = 16 * arb_series(step, length) * v_star**10
            excess = (arb_series(slope, length) * first**5 / wanted).log() / 5
            change = (-excess / (1 + self._sensitivity(trial) / 5)).exp()
            return self._scaled(arb_series([c.mid() for c in (first * change).coeffs()], length))

    def _scaled(self, k: arb_series) -> Scaled:
        """Return k z^(2 power) with integer coefficients."""
        scaled = Scaled.nearest(k, self.bits)
        return Scaled(fmpz_poly([*[0] * (2 * self.power), *scaled.polynomial.coeffs()]), scaled.exponent)

    def _sensitivity(self, k: Scaled) -> arb:
        """Return d ln F/d ln k in the middle of the panel."""
        if self.power:
            return arb(0)
        branch = integrate(k.at(0), self.accuracy)
        return branch.sensitivity().mid()

    def _compared(self, k: Scaled, loading: ParametricEnds, unloading: ParametricEnds) -> PanelBounds:
        """Return how far the rows are from the true functions.

        F = slope/step of loading, m likewise; kappa^5 = k^5 F/16 = v*^10 up to a factor e^(5 delta).
        """
        reduced = arb_poly(k.poly().coeffs()[2 * self.power :])
        wanted = 16 * loading.step * self.v_star() ** 10
        kappa = self._relative(reduced**5 * loading.slope - wanted, wanted) + 2 * loading.error
        delta = kappa / 4  # |ln(1 + x)| <= 5/4 |x| for |x| <= 1/5
        f, m = loading.slope * unloading.step, unloading.slope * loading.step
        epsilon = panel_rows()["epsilon", self.index].poly()
        loss = panel_rows()["one_minus_epsilon", self.index].poly()
        from_ends = 2 * (loading.error + unloading.error)
        return PanelBounds(
            _small(self._relative(epsilon * f - m, m) + from_ends + 3 * delta),
            _small(self._loss_error(loss, f, m, from_ends) + 4 * delta),
        )

    def _loss_error(self, loss: arb_poly, f: arb_poly, m: arb_poly, from_ends: arb) -> arb:
        """Bound the relative error of 1 - eps, whose row is divisible by z^(2 power)."""
        least_f = _least(f)
        difference = loss * f - (f - m)
        coefficients = difference.coeffs()
        size = loss.coeffs()[2 * self.power :]
        least_loss = _least(arb_poly(size))
        if not self.power:
            return (self._most(difference) / least_f + from_ends) / least_loss
        start = arb(ELASTIC.numerator) / ELASTIC.denominator / _ball(HALF_WIDTHS[0])  # the least z
        low = (abs(coefficients[0]) / least_f + from_ends) / start**2 + abs(coefficients[1]) / least_f / start
        return (low + self._most(arb_poly(coefficients[2:])) / least_f) / least_loss

    def _relative(self, difference: arb_poly, whole: arb_poly) -> arb:
        """Return an upper bound of |difference/whole| on the panel: the largest one of its parts."""
        shifts = list(self._parts())
        return max(coefficient_sum(difference(shift).coeffs()) / _least(whole(shift)) for shift in shifts)

    def _most(self, polynomial: arb_poly) -> arb:
        """Return an upper bound of the absolute value on the panel."""
        return max(coefficient_sum(polynomial(shift).coeffs()) for shift in self._parts())

    def _parts(self) -> Iterator[arb_poly]:
        """Yield z on each part of the panel as a polynomial in t, |t| <= 1.

        The parts are shorter towards the ends, where a polynomial that is bounded by 1 can be steepest.
        """
        ends = [arb(round(-math.cos(i * math.pi / PARTS) * 2**20)) / 2**20 for i in range(PARTS + 1)]
        for low, high in pairwise((z + 1) / 2 if self.power else z for z in ends):
            yield arb_poly([(low + high) / 2, (high - low) / 2])


def _small(bound: arb) -> arb:
    upper = bound.abs_upper()
    if not upper < arb(2) ** -40:
        raise ArithmeticError(f"the bound is only {upper}")
    return upper


def _ball(value: float) -> arb:
    return arb(float(value))


def _size(k: Scaled) -> int:
    return k.at(0).size


def _least(polynomial: arb_poly) -> arb:
    """Return a positive lower bound for |t| <= 1."""
    first, *rest = polynomial.coeffs()
    bound = (first - sum((abs(c) for c in rest), arb(0))).lower()
    if not bound > 0:
        raise ArithmeticError("the polynomial may vanish")
    return bound


def elastic_error() -> PanelBounds:
    """Bound the relative errors of the rows of panel 0 for v* <= ELASTIC, where 1 - eps is about lambda_1 v*^2."""
    with working(256):
        z = arb(ELASTIC.numerator) / ELASTIC.denominator / _ball(HALF_WIDTHS[0])
        v_star = z * _ball(HALF_WIDTHS[0])
        beyond = 8 * v_star**2  # section 8: |(1 - eps)/(lambda_1 kappa) - 1| <= 8 kappa for kappa <= 2^-20
        first = lambda_1_ball() * _ball(HALF_WIDTHS[0]) ** 2
        loss = [c / first for c in panel_rows()["one_minus_epsilon", 0].poly().coeffs()]
        if not (loss[0].is_zero() and loss[1].is_zero()):
            raise ArithmeticError("the row of 1 - eps must begin with z^2")
        rest = sum((abs(c) * z ** (i - 2) for i, c in enumerate(loss) if i > 2), arb(0))
        one_minus_epsilon = (abs(loss[2] - 1) + rest + beyond) / (1 - beyond)
        row = panel_rows()["epsilon", 0].poly().coeffs()
        change = abs(row[0] - 1) + sum((abs(c) * z**i for i, c in enumerate(row) if i > 0), arb(0))
        loss_at_end = 2 * lambda_1_ball() * v_star**2
        return PanelBounds(_small((change + loss_at_end) / (1 - loss_at_end)), _small(one_minus_epsilon))


def lambda_1_ball() -> arb:
    """Return lambda_1; 1 - eps = lambda_1 v*^2 + … . To be called within `working`."""
    return arb.pi().sqrt() * (arb(3) / 5).gamma() / (arb(5) ** (arb(2) / 5) * arb(2).root(5) * (arb(21) / 10).gamma())


def asymptotic_factor() -> arb:
    """Return (3/2)^(2/3), the limit of eps v*^(10/3). To be called within `working`."""
    return (arb(9) / 4).root(3)


def tail(v_star: arb) -> arb:
    """Bound |ln(eps v*^(10/3)) - ln limit| for all larger v* (section 8). To be called within `working`.

    Raises
    ------
    ValueError
        If v* is below 4.
    """
    if not v_star >= 4:
        raise ValueError(f"v_star is {v_star}: expected 4 or more")
    k = (96 * v_star**10 / (arb(10) / 9)).root(6)
    return ((21 * k.log() + 8) / k**2).abs_upper()


@lru_cache(maxsize=1)
def steepest() -> Fraction:
    """Return a bound of |d ln eps/d ln v*| and |d ln(1 - eps)/d ln v*| of all rows, and beyond the last row."""
    with working(128):
        found = [_slope(index, name) for index in range(PANELS) for name in ("epsilon", "one_minus_epsilon")]
        return max(exact_middle(max(found)), Fraction(10, 3))


def _slope(index: int, name: str) -> arb:
    """Bound |v* row'/row| on a panel; on panel 0 the row of 1 - eps is divisible by z^2."""
    row = panel_rows()[name, index].poly().coeffs()
    power = 2 if index == 0 and name == "one_minus_epsilon" else 0
    smooth = arb_poly(row[power:])
    centre, half = _ball(CENTRES[index]), _ball(HALF_WIDTHS[index])
    start = arb(0) if index == 0 else arb(-1)
    width = (1 - start) / PARTS
    parts = (arb(start + (2 * i + 1) * width / 2, (width / 2).abs_upper()) for i in range(PARTS))
    return max(abs(power + (centre / half + z) * smooth.derivative()(z) / smooth(z)).abs_upper() for z in parts)
