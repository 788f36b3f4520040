r"""Proof of two tables: eps(v*) and 1 - eps(v*) as polynomials on panels of v*, with bounds of their errors.

The rows of `data/exact.txt` have 39 digits; `tools.exact_table` makes them. `prove_row` compares a row, on a
whole panel at once, with a `parametric_flow` of collisions whose error is proven, and assumes nothing about the row's
origin (docs/theory/exact-function.md, step 7). The rows of `double`'s table are compared with these (`double_bounds`).

Both tables' bounds are records with digests: `exact_rows` reads the one, `proven_error` the other.

For the two ends a few lines of estimates suffice: below `ELASTIC` (`elastic_error`), and beyond the panels, where eps
is close to its limit (`tail`; step 8).

`working(bits)` sets the precision of FLINT's balls within a block; `coefficient_sum` is the sum of |coefficients|.
"""

from __future__ import annotations

import hashlib
import math
import pkgutil
from collections.abc import Iterable, Iterator, Sequence
from fractions import Fraction
from functools import lru_cache
from itertools import pairwise
from typing import NamedTuple, cast

from flint import arb, arb_poly, arb_series, fmpq, fmpq_poly, fmpz_poly

from viscopade.arithmetic.balls import coefficient_sum, exact_middle, magnitude, working
from viscopade.arrays import panels
from viscopade.arrays.panels import CENTRES, DATA, HALF_WIDTHS, PANELS
from viscopade.collision.parametric_flow import ParametricBranch, Scaled, integrated, parametric_ends

# ACCURACY, DEGREE and PARTS are choices: with smaller numbers the bounds are larger, but no less proven.
ACCURACY = 150  # bits of the collisions: a row has 39 digits, 130 bits
DEGREE = 50  # of polynomials in z
# Below, v* is so small that the first term of the series is enough for doubles: it is right to 8 v*^2 = 2^-69 (step 8).
ELASTIC = Fraction(1, 2**36)
# Bits for the panel that begins there: 1 - eps is about v*^2 = 2^-72, so as many bits of it are lost.
ELASTIC_ACCURACY = 220
ELASTIC_DEGREE = 60
PARTS = 64  # of a panel, on each of which a difference is bounded: its bound is a few per cent above the maximum
EXACT = "data/exact.txt"
EXACT_BITS = 160  # bounds in this table are in units of 2^-160; they are about 2^-130, so that 30 bits of them remain
RECORD = "data/proven.txt"
RECORD_BITS = 80  # recorded bounds are in units of 2^-80; they are below 2^-61

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


@lru_cache(maxsize=1)
def panel_rows() -> dict[tuple[str, int], PanelRow]:
    """Return all rows of `double`'s table, by function and panel."""
    return {place: PanelRow(*row) for place, row in panels.rows().items()}


class PanelBounds(NamedTuple):
    """Bounds of the relative errors of a panel's rows in `double`'s table."""

    epsilon: arb
    one_minus_epsilon: arb

    def recorded(self) -> list[int]:
        """Return the bounds in the record's units, rounded up."""
        return [math.ceil(magnitude(bound) * 2**RECORD_BITS) for bound in self]


# --- the records ------------------------------------------------------------------------------------------------------


def _text(name: str) -> str:
    """Return the text of a file of the package."""
    return cast(bytes, pkgutil.get_data("viscopade", name)).decode()


def lines_of(name: str) -> list[str]:
    """Return the lines of a file of the package that are no comments."""
    return [line for line in _text(name).splitlines() if not line.startswith("#")]


def digest(lines: Iterable[str]) -> str:
    """Return the line of a record that names the lines it belongs to."""
    return f"sha256 {hashlib.sha256(chr(10).join(lines).encode()).hexdigest()}"


class ExactRow(NamedTuple):
    """The smaller of eps and 1 - eps on a panel, with the proven bound of its relative error in units of 2^-160."""

    name: str
    bound: int
    row: PanelRow

    @property
    def error(self) -> arb:
        """The bound as a number."""
        return arb(self.bound) * arb(2) ** -EXACT_BITS

    def polys(self) -> tuple[arb_poly, arb_poly]:
        """Return the polynomials of eps and of 1 - eps. To be called within `working`."""
        smaller = self.row.poly()
        return (smaller, 1 - smaller) if self.name == "epsilon" else (1 - smaller, smaller)


@lru_cache(maxsize=1)
def exact_rows() -> dict[int, ExactRow]:
    """Return the rows to 39 digits by panel; while `tools.exact_table` makes the table, some are missing.

    Raises
    ------
    OSError
        If a row or a bound was changed.
    """
    # The first line is the digest of the others: function, panel, bound, exponent, a_0, a_1, …
    try:
        digest_line, *lines = lines_of(EXACT) or [""]
    except FileNotFoundError:
        return {}
    if digest_line != digest(lines):
        raise OSError(f"{EXACT} was changed after its proof: run python -m tools.exact_table")
    rows = (line.split() for line in lines)
    return {
        int(panel): ExactRow(name, int(bound), PanelRow(int(e), (*map(int, a),))) for name, panel, bound, e, *a in rows
    }


def proven() -> dict[int, list[int]]:
    """Return the recorded bounds of `double`'s rows for eps and 1 - eps on each panel, in units of 2^-80.

    Raises
    ------
    OSError
        If the record is not that of the table.
    """
    # The first line is the digest of the doubles' table, the others: panel, bound for eps, bound for 1 - eps.
    digest_line, *lines = lines_of(RECORD) or [""]
    recorded = {panel: bounds for panel, *bounds in (map(int, line.split()) for line in lines)}
    if digest_line != digest(lines_of(DATA)) or list(recorded) != list(range(PANELS)):
        raise OSError(f"{RECORD} does not belong to {DATA}: run python -m tools.panel_bounds > src/viscopade/{RECORD}")
    return recorded


@lru_cache(maxsize=1)
def proven_error() -> float:
    """Return the proven bound of the relative errors of all of `double`'s rows for eps and 1 - eps.

    It is the least power of 2 that leaves all recorded bounds a margin of one bit. A record out of date is found out
    here and not on import: it must not stop the command that renews it.

    Raises
    ------
    OSError
        If the record is not that of the table.
    """
    # A bound below 2^(bit length - 80); twice that leaves one bit.
    worst = max(max(bounds) for bounds in proven().values())
    return math.ldexp(1.0, worst.bit_length() + 1 - RECORD_BITS)


# --- proof ------------------------------------------------------------------------------------------------------------


def prove_row(index: int, name: str, row: PanelRow, k: Sequence[fmpq]) -> arb:
    """Bound the relative error of a row for eps or 1 - eps on the whole panel; on panel 0 from ELASTIC on.

    Parameters
    ----------
    index : int
        Panel.
    name : str
        "epsilon" or "one_minus_epsilon".
    row : PanelRow
    k : sequence of fmpq
        Coefficients of a polynomial in z near the k of the collision at v*(z); on panel 0, of k/z^2. Nothing is assumed
        of it: how far it is off is part of the bound.

    Raises
    ------
    ArithmeticError
        If the bound is not small.
    """
    return PanelProof(index, k).bound(name, row)


class PanelProof:
    """The proof for one panel: loading and unloading for all z, with which rows are compared."""

    def __init__(self, index: int, k: Sequence[fmpq]) -> None:
        """Integrate both halves for all z of panel `index`; k has the coefficients of k(z), on panel 0 of k(z)/z^2."""
        self.panel = _Panel(index)
        self.accuracy, self.degree = (ACCURACY, DEGREE) if index else (ELASTIC_ACCURACY, ELASTIC_DEGREE)
        self.bits = self.accuracy + 40  # 40 bits for rounding in sums of some thousand products; a choice
        with working(self.bits):
            reduced = Scaled.nearest(arb_series([arb(c) for c in k], len(k)), self.bits)
        zeros = [0] * (2 * self.panel.power)
        self.k = Scaled(fmpz_poly([*zeros, *reduced.polynomial.coeffs()]), reduced.exponent)
        self.loading, self.unloading = (
            parametric_ends(self._integrated(half), self.panel.power > 0) for half in (False, True)
        )

    def _integrated(self, unloading: bool) -> ParametricBranch:
        """Return loading or unloading, up to where r is 2^-gap larger than at the end."""
        # What is left makes p^2 grow (step 4): in unloading by r D^2 with D about 2^-gap, so that half of the bits do,
        # and more for large k, because D counts against 1/k^2; in loading by about r^3, so that a third does. The 4
        # and, on panel 0, the 6 are by hand. Measured: the bound is the same without the 4, loses 10 bits with 10 less,
        # and gains nothing by larger gaps; a third in unloading leaves 2^-98; on panel 0, 0 is as good as 6, and 12
        # loses 7 bits.
        size = max(self.k.value(0).size, 0)
        gap = self.accuracy // 2 - 6 * self.panel.power + size if unloading else self.accuracy // 3 + 4
        return integrated(self.k, unloading, self.accuracy, self.degree, gap)

    def bound(self, name: str, row: PanelRow) -> arb:
        """Bound the relative error of a row of eps or 1 - eps (`name`) on the panel.

        F = slope/step of loading, m likewise; kappa^5 = k^5 F/16 = v*^10 up to a factor e^(5 delta).
        """
        # `slope` is 2 H c p at the end, `step` 2 H c, as polynomials in z; `error` bounds the relative error of p.
        loading, unloading, panel = self.loading, self.unloading, self.panel
        with working(2 * self.bits):  # so that products of the polynomials are nearly exact
            # k^5 F - 16 v*^10 over 16 v*^10, times step; on panel 0 both are divided by z^10. 2: F is off by its error,
            # and (1 + d)(1 + error) - 1 <= d + 2 error for d <= 1.
            k = panel.reduced(self.k.poly(), 2)
            power_of_v_star = 16 * loading.step * panel.v_star() ** 10
            kappa = panel.relative(k**5 * loading.slope - power_of_v_star, power_of_v_star) + 2 * loading.error
            # 5 |ln kappa - ln v*^2| <= (5/4) of that, as |ln(1 + x)| <= (5/4) |x| for |x| <= 1/5.
            delta = kappa / 4
            # eps = m/F = (unloading.slope/unloading.step)/(loading.slope/loading.step), without quotients. m and F have
            # errors of their own, added up with a factor 2 for products of errors.
            f, m = loading.slope * unloading.step, unloading.slope * loading.step
            ends_error = 2 * (loading.error + unloading.error)
            # ln eps changes by at most 2 times ln k's delta, ln(1 - eps) by 3 times (step 5): 3 and 4 instead cover
            # e^x - 1 > x.
            if name == "epsilon":
                return _small(panel.relative(row.poly() * f - m, m) + ends_error + 3 * delta)
            return _small(self._loss_error(row.poly(), f, m, ends_error) + 4 * delta)

    def _loss_error(self, loss: arb_poly, f: arb_poly, m: arb_poly, ends_error: arb) -> arb:
        """Bound the relative error of 1 - eps, whose row is divisible by z^2 on panel 0.

        `loss` is the row, F and m are the ends' polynomials times one step, `ends_error` bounds the errors of m/F.
        """
        # 1 - eps = (F - m)/F: |loss - (F - m)/F| <= |loss F - (F - m)|/F, relative to the least loss.
        least_f, least_loss = _least(f), _least(self.panel.reduced(loss, 2))
        difference = loss * f - (f - m)
        if not self.panel.power:
            return (self.panel.most(difference) / least_f + ends_error) / least_loss
        # On panel 0 all is divided by z^2. The coefficients of 1 and z, which are only nearly 0, count most at the
        # least z, where v* = ELASTIC; v* = z (half width).
        first, second, *rest = difference.coeffs()
        start = arb(ELASTIC.numerator) / ELASTIC.denominator / _ball(HALF_WIDTHS[0])  # the least z
        low = (abs(first) / least_f + ends_error) / start**2 + abs(second) / least_f / start
        return (low + self.panel.most(arb_poly(rest)) / least_f) / least_loss


def double_bounds(index: int) -> PanelBounds:
    """Bound the relative errors of a panel's rows in `double`'s table, by their distance from the row proven here.

    Raises
    ------
    ValueError
        If there is no such panel, or it has no proven row.
    """
    if index not in exact_rows():
        raise ValueError(f"panel is {index}: expected one of 0 to {PANELS - 1} that {EXACT} has")
    panel, row = _Panel(index), exact_rows()[index]
    # The coefficients of a row have up to 140 bits, in units down to 2^-216 (those of 1 - q, q the smaller function):
    # 256 bits hold them and their differences exactly.
    with working(256):
        epsilon, loss = row.polys()
        # With q_s the row, the smaller function is q_s (1 ± error), and the larger one 1 - q_s ± error q_s.
        smaller, larger = (epsilon, loss) if row.name == "epsilon" else (loss, epsilon)
        row_error = row.error * (1 + panel.most(smaller) / _least(larger))
        # |d/q - 1| <= c and |q/f - 1| <= b give |d/f - 1| <= c (1 + b) + b, with the double row d, the proven one q and
        # the function f. b = 2 row_error: the row's error is relative to q, and 1/(1 - error) <= 1 + 2 error.
        bounds = []
        for name, exact, power in (("epsilon", epsilon, 0), ("one_minus_epsilon", loss, 2)):
            proven_row = panel.reduced(exact, power)
            double_row = panel.reduced(panel_rows()[name, index].poly(), power)
            relative = panel.relative(double_row - proven_row, proven_row)
            bounds.append(_small(relative * (1 + 2 * row_error) + 2 * row_error))
    return PanelBounds(*map(max, bounds, elastic_error())) if index == 0 else PanelBounds(*bounds)


class _Panel:
    """Polynomials in z on a panel: |z| <= 1, or for panel 0, where v* = z (half width), 0 <= z <= 1."""

    def __init__(self, index: int) -> None:
        # `power` is 1 on panel 0: there functions are divided by powers of z.
        self.index, self.power = index, 0 if index else 1

    def v_star(self) -> arb_poly:
        """Return v*; on panel 0 v*/z."""
        centre, half = _ball(CENTRES[self.index]), _ball(HALF_WIDTHS[self.index])
        return arb_poly([half] if self.power else [centre, half])

    def reduced(self, polynomial: arb_poly, power: int) -> arb_poly:
        """Return a polynomial; on panel 0 the quotient by z^power."""
        return arb_poly(polynomial.coeffs()[power * self.power :])

    def relative(self, difference: arb_poly, divisor: arb_poly) -> arb:
        """Return an upper bound of |difference/divisor| on the panel: the largest one of its parts."""
        return max(coefficient_sum(difference(part).coeffs()) / _least(divisor(part)) for part in self._parts())

    def most(self, polynomial: arb_poly) -> arb:
        """Return an upper bound of the absolute value on the panel."""
        return max(coefficient_sum(polynomial(part).coeffs()) for part in self._parts())

    def _parts(self) -> Iterator[arb_poly]:
        """Yield z on each part of the panel as a polynomial in t, |t| <= 1.

        The parts are shorter towards the ends, where a polynomial that is bounded by 1 can be steepest.
        """
        # -cos(i pi/PARTS), as fractions of 20 bits, from -1 to 1; on panel 0 from 0 to 1.
        ends = [arb(round(-math.cos(i * math.pi / PARTS) * 2**20)) / 2**20 for i in range(PARTS + 1)]
        for low, high in pairwise((z + 1) / 2 if self.power else z for z in ends):
            yield arb_poly([(low + high) / 2, (high - low) / 2])


def _small(bound: arb) -> arb:
    """Return an upper bound of a bound, which must be below 2^-40."""
    # The steps drop products of errors: x y is far below the spare factors if all are below 2^-40. Bounds are below
    # 2^-61, or 2^-130 for the rows of 39 digits.
    upper = bound.abs_upper()
    if not upper < arb(2) ** -40:
        raise ArithmeticError(f"the bound is only {upper}")
    return upper


def _ball(value: float) -> arb:
    """Return a double (or NumPy's) as an exact ball."""
    return arb(float(value))


def _least(polynomial: arb_poly) -> arb:
    """Return a positive lower bound of a polynomial for |t| <= 1: c_0 - sum of |c_i|, i >= 1."""
    # It must be positive, because bounds are divided by it.
    first, *rest = polynomial.coeffs()
    bound = (first - sum((abs(c) for c in rest), arb(0))).lower()
    if not bound > 0:
        raise ArithmeticError("the polynomial may vanish")
    return bound


def elastic_error() -> PanelBounds:
    """Bound the relative errors of the rows of panel 0 for v* <= ELASTIC, where 1 - eps is about lambda_1 v*^2."""
    with working(256):  # far more than the bits of doubles; a choice
        # The largest z, v* = z (half width), which has the largest error.
        z = arb(ELASTIC.numerator) / ELASTIC.denominator / _ball(HALF_WIDTHS[0])
        v_star = z * _ball(HALF_WIDTHS[0])
        beyond = 8 * v_star**2  # step 8: |(1 - eps)/(lambda_1 kappa) - 1| <= 8 kappa for kappa <= 2^-20
        # The row over lambda_1 v*^2 = first z^2 is z^-2 (loss_2 z^2 + loss_3 z^3 + …) with loss_2 nearly 1. The true
        # function over the same is 1 ± beyond.
        first = lambda_1_ball() * _ball(HALF_WIDTHS[0]) ** 2
        loss = [c / first for c in panel_rows()["one_minus_epsilon", 0].poly().coeffs()]
        if not (loss[0].is_zero() and loss[1].is_zero()):
            raise ArithmeticError("the row of 1 - eps must begin with z^2")
        rest = sum((abs(c) * z ** (i - 2) for i, c in enumerate(loss) if i > 2), arb(0))
        one_minus_epsilon = (abs(loss[2] - 1) + rest + beyond) / (1 - beyond)
        # eps: the row differs from 1 by at most `change`, the function by at most 2 lambda_1 v*^2, twice its first
        # term.
        row = panel_rows()["epsilon", 0].poly().coeffs()
        change = abs(row[0] - 1) + sum((abs(c) * z**i for i, c in enumerate(row) if i > 0), arb(0))
        loss_at_end = 2 * lambda_1_ball() * v_star**2
        return PanelBounds(_small((change + loss_at_end) / (1 - loss_at_end)), _small(one_minus_epsilon))


def lambda_1_ball() -> arb:
    """Return lambda_1; 1 - eps = lambda_1 v*^2 + … . To be called within `working`."""
    # B(3/5, 3/2) (4/5)^(2/5) = sqrt(pi) Gamma(3/5)/(5^(2/5) 2^(1/5) Gamma(21/10)) = 1.153…, the paper's C_1.
    return arb.pi().sqrt() * (arb(3) / 5).gamma() / (arb(5) ** (arb(2) / 5) * arb(2).root(5) * (arb(21) / 10).gamma())


def asymptotic_factor() -> arb:
    """Return (3/2)^(2/3), the limit of eps v*^(10/3). To be called within `working`."""
    return (arb(9) / 4).root(3)


def tail(v_star: arb) -> arb:
    """Bound |ln(eps v*^(10/3)) - ln limit| for all larger v* (step 8). To be called within `working`.

    Raises
    ------
    ValueError
        If v* is below 4.
    """
    if not v_star >= 4:
        raise ValueError(f"v_star is {v_star}: expected 4 or more")
    # With L = ln k, F is k/6 times 1 to 1 + (12 L + 6)/k^2, and k m is 1 down to 1 - (8 L + 1)/k^2. So ln F and ln(k m)
    # are off by (12 L + 6)/k^2 and 1.067 (8 L + 1)/k^2 at most, in all by less than (21 L + 8)/k^2, which falls with k.
    # And v*^10 = k^5 F/16 <= (10/9) k^6/96 gives the least k. All this holds for k >= 20, and v* < 3.9 at k = 20.
    k = (96 * v_star**10 / (arb(10) / 9)).root(6)
    return ((21 * k.log() + 8) / k**2).abs_upper()


@lru_cache(maxsize=1)
def steepest() -> Fraction:
    """Return a bound of |d ln eps/d ln v*| and |d ln(1 - eps)/d ln v*| of all rows, and beyond the last row."""
    with working(128):  # a choice: more than a double has
        # Beyond, eps = (3/2)^(2/3) v*^(-10/3), of slope -10/3.
        slopes = [_slope(index, name) for index in range(PANELS) for name in ("epsilon", "one_minus_epsilon")]
        return max(exact_middle(max(slopes)), Fraction(10, 3))


def _slope(index: int, name: str) -> arb:
    """Bound |v* row'/row| on panel `index` for the row of a function (`name`); on panel 0, 1 - eps has a factor z^2."""
    # With row = z^power smooth(z) and v* = centre + half z: power + (centre/half + z) smooth'/smooth, in balls that
    # cover PARTS equal parts of the panel. (On panel 0 the centre is 0, so that v* row'/row = z row'/row.)
    row = panel_rows()[name, index].poly().coeffs()
    power = 2 if index == 0 and name == "one_minus_epsilon" else 0
    smooth = arb_poly(row[power:])
    centre, half = _ball(CENTRES[index]), _ball(HALF_WIDTHS[index])
    start = arb(0) if index == 0 else arb(-1)
    width = (1 - start) / PARTS
    parts = (arb(start + (2 * i + 1) * width / 2, (width / 2).abs_upper()) for i in range(PARTS))
    return max(abs(power + (centre / half + z) * smooth.derivative()(z) / smooth(z)).abs_upper() for z in parts)
