r"""Proof of a kernel's error: a bound of |R(v*) - eps(v*)| in a measure, for every v* of an interval.

The exact function is known on panels as polynomials with a proven error (`reference`). Each panel is cut into equal
parts; on a part the deviation is a Taylor polynomial in -1 <= t <= 1 whose last coefficient is enclosed for the whole
part (Lagrange's remainder), so that the sum of the absolute values is a bound. Parts are halved until the bound is as
small as wanted. Beyond the panels the kernel's limit is compared with that of eps.

A kernel is anything that can be evaluated on power series (`Formula`): FLINT refuses to divide by a series that may
vanish, or to take its root, so a bound is also a proof that there is no pole.
"""

from __future__ import annotations

from collections.abc import Callable, Hashable, Iterator
from dataclasses import dataclass, replace
from decimal import ROUND_CEILING, Context, Decimal
from fractions import Fraction
from functools import lru_cache
from typing import Literal, Protocol

from flint import arb, arb_poly, arb_series

from viscopade import reference
from viscopade.balls import working
from viscopade.double import CENTRES, DATA, HALF_WIDTHS, PANELS
from viscopade.progress import track

Measure = Literal["both", "relative"]

BITS = 192
ORDER = 12  # of the Taylor polynomials on a part
FEWEST_PARTS = 4
MOST_PARTS = 1 << 9
TIGHT = 0.999  # a bound that halving the parts lowers by less than this factor is tight
DIGITS = 3  # of a printed bound


class Formula(Hashable, Protocol):
    """What is to be proven of: R(v*) as power-series arithmetic, in the formula's exact coefficients."""

    def epsilon(self, v_star: arb_series) -> arb_series:
        """Return R(v*)."""

    def loss_ratio(self, v_star: arb_series) -> arb_series:
        """Return (1 - R(v*))/v*^2, also around v* = 0."""


@dataclass(frozen=True)
class Part:
    """A piece of a panel: centre and half width in the panel's z, |z| <= 1."""

    panel: int
    centre: Fraction
    half: Fraction


def _v_star(panel: int, z: Fraction) -> Fraction:
    return Fraction(float(CENTRES[panel])) + Fraction(float(HALF_WIDTHS[panel])) * z


@dataclass(frozen=True)
class Rational:
    """The quotient of two polynomials, with exact coefficients in ascending order."""

    a: tuple[Fraction, ...]
    b: tuple[Fraction, ...]

    def loss_ratio(self, v_star: arb_series) -> arb_series:
        """Return (1 - N/D)/v*^2.

        Raises
        ------
        ValueError
            Unless a_0 = b_0 and a_1 = b_1.
        """
        size = max(len(self.a), len(self.b))
        a, b = ([*values, *[Fraction(0)] * (size - len(values))] for values in (self.a, self.b))
        if a[:2] != b[:2]:
            raise ValueError("1 - R must vanish like v*^2 where the deviation is measured relative to 1 - eps")
        difference = [_ball(d - c) for c, d in zip(a[2:], b[2:], strict=True)]
        return _quotient(_polynomial(difference, v_star), _polynomial([_ball(c) for c in b], v_star))

    def epsilon(self, v_star: arb_series) -> arb_series:
        """Return the quotient."""
        a, b = ([_ball(c) for c in values] for values in (self.a, self.b))
        return _quotient(_polynomial(a, v_star), _polynomial(b, v_star))


class FormulaToInfinity(Formula, Protocol):
    """A formula for all v* >= 0."""

    def limit(self, u: arb) -> arb:
        """Return R v*^(10/3) at u = 1/v*, for a ball of u that contains 0."""


@dataclass(frozen=True)
class Certificate:
    """A proven bound of the deviation of a formula from eps.

    Attributes
    ----------
    measure : str
        "both", relative to the smaller of eps and 1 - eps, or "relative" to eps.
    low : Fraction
    high : Fraction or None
        Interval of v*; None is infinity.
    bound : str
        |R - eps| <= bound times what it is relative to; decimal, rounded up.
    parts : tuple of (int, int)
        The panels that meet the interval, and into how many equal parts each was cut for the proof.
    """

    measure: Measure
    low: Fraction
    high: Fraction | None
    bound: str
    parts: tuple[tuple[int, int], ...]

    def record(self) -> dict[str, object]:
        """Return the certificate as JSON-able data; ends of the interval as exact fractions "p/q"."""
        return {
            "measure": self.measure,
            "v_star_min": str(self.low),
            "v_star_max": None if self.high is None else str(self.high),
            "bound": self.bound,
            "reference": DATA,
            "reference_error": reference.ERROR.hex(),
            "parts": self.parts,
        }


def prove(formula: Formula, low: Fraction, high: Fraction, measure: Measure = "both") -> Certificate:
    """Prove a bound of the deviation on low <= v* <= high that is tight to about its printed digits.

    Raises
    ------
    ValueError
        If the interval is no such thing.
    ArithmeticError
        If there is no bound: the formula has a pole in the interval, or comes too close to one.
    """
    limits = list(panels_of(low, high))
    if measure == "both" and limits[0][0] == 0:
        with working(BITS, ORDER + 1):
            formula.loss_ratio(arb_series([arb(0), arb(1)]))  # refuses here, if at all, what is no such formula
    number = [FEWEST_PARTS] * len(limits)
    bounds = [_on_panel(formula, limits[i], FEWEST_PARTS, measure) for i in track(range(len(limits)), "proof")]
    while True:
        worst = max(range(len(limits)), key=lambda i: float(bounds[i]))
        finer = _on_panel(formula, limits[worst], 2 * number[worst], measure)
        if finer > bounds[worst] * TIGHT and finer.is_finite():
            break
        if number[worst] >= MOST_PARTS:
            panel = limits[worst][0]
            raise ArithmeticError(
                f"no bound was found near v* = {float(_v_star(panel, Fraction(0))):.6g}: is it a pole?"
            )
        bounds[worst], number[worst] = finer, 2 * number[worst]
    parts = tuple((panel, n) for (panel, _, _), n in zip(limits, number, strict=True))
    return Certificate(measure, low, high, max((rounded_up(bound) for bound in bounds), key=Fraction), parts)


def prove_to_infinity(formula: FormulaToInfinity, measure: Measure = "both") -> Certificate:
    """Prove a bound of the deviation for all v* >= 0; errors as for `prove`."""
    on_panels = prove(formula, Fraction(0), reference.END, measure)
    with working(BITS):
        u = 1 / _ball(reference.END)
        ratio = formula.limit(arb(u / 2, (u / 2).abs_upper())) / reference.limit()
        beyond = abs(ratio * arb(0, reference.tail(_ball(reference.END))).exp() - 1)
        if not beyond.is_finite():
            raise ArithmeticError("no bound was found for large v*: does the formula have the right limit?")
        return replace(on_panels, high=None, bound=max(on_panels.bound, rounded_up(beyond), key=Fraction))


@lru_cache(maxsize=1 << 14)  # intervals share panels
def _on_panel(formula: Formula, limit: tuple[int, Fraction, Fraction], number: int, measure: Measure) -> arb:
    """Bound the deviation on the panel's part of the interval; infinity if FLINT finds that R may be infinite."""
    try:
        return max(deviation(formula, part, measure) for part in parts_of(*limit, number))
    except (ZeroDivisionError, ValueError):
        return arb.pos_inf()


def rounded_up(bound: arb, digits: int = DIGITS) -> str:
    """Return a positive upper bound as a short decimal number that is not smaller."""
    upper = bound.abs_upper()
    middle, radius, exponent = (int(part) for part in upper.mid_rad_10exp(digits + 20))
    context = Context(prec=digits, rounding=ROUND_CEILING)
    number = context.create_decimal(Decimal(f"{middle + radius}e{exponent}")).normalize(context)
    return f"{number:e}" if number.adjusted() < -3 else f"{number:f}"


def panels_of(low: Fraction, high: Fraction) -> Iterator[tuple[int, Fraction, Fraction]]:
    """Yield the panels that meet [low, high], with the ends of the common part in z.

    Raises
    ------
    ValueError
        Unless 0 <= low < high <= the end of the last panel.
    """
    if not 0 <= low < high <= reference.END:
        raise ValueError(f"the interval is [{low}, {high}]: accepted is 0 <= low < high <= {reference.END}")
    for panel in range(PANELS):
        first = Fraction(0) if panel == 0 else Fraction(-1)
        centre, half = _v_star(panel, Fraction(0)), Fraction(float(HALF_WIDTHS[panel]))
        start, end = max(first, (low - centre) / half), min(Fraction(1), (high - centre) / half)
        if start < end:
            yield panel, start, end


def parts_of(panel: int, start: Fraction, end: Fraction, number: int) -> Iterator[Part]:
    """Yield equal parts of a panel."""
    half = (end - start) / (2 * number)
    for i in range(number):
        yield Part(panel, start + (2 * i + 1) * half, half)


def speeds(low: Fraction, high: Fraction, number: int) -> Iterator[arb]:
    """Yield balls of v* that cover the interval, `number` to a panel. To be called within `working`."""
    for limit in panels_of(low, high):
        for part in parts_of(*limit, number):
            start, end = (_ball(_v_star(part.panel, z)) for z in (part.centre - part.half, part.centre + part.half))
            yield arb((start + end) / 2, ((end - start) / 2).abs_upper())


def deviation(formula: Formula, part: Part, measure: Measure) -> arb:
    """Bound the deviation on a part: relative to eps, or in measure "both" to the smaller of eps and 1 - eps."""
    with working(BITS, ORDER + 1):
        if measure == "both" and part.panel == 0:
            return _with_reference(_sum(_taylor(lambda z: _near_origin(formula, z), part)))
        bounds = []
        if measure == "relative" or _may_be(part.panel, "epsilon"):
            bounds.append(_sum(_taylor(lambda z: _relative(formula, part.panel, z), part)))
        if measure == "both" and _may_be(part.panel, "one_minus_epsilon"):
            bounds.append(_sum(_taylor(lambda z: _relative_loss(formula, part.panel, z), part)))
        return _with_reference(max(bounds))


def _may_be(panel: int, name: str) -> bool:
    """Whether the function may be the smaller one of eps and 1 - eps somewhere on the panel."""
    row = reference.rows()[name, panel]
    return min(row(Fraction(-1)), row(Fraction(1))) <= Fraction(1, 2) + Fraction(1, 10**6)


def _with_reference(bound: arb) -> arb:
    """Add what the reference may be off."""
    error = arb(reference.ERROR)
    return ((bound + error) / (1 - error)).abs_upper()


def _series(name: str, panel: int, z: arb_series) -> arb_series:
    return _polynomial(reference.rows()[name, panel].poly().coeffs(), z)


def _polynomial(coefficients: list[arb], z: arb_series) -> arb_series:
    """Return the polynomial of a series, by Horner's rule around the middle of z's constant term: balls grow least."""
    middle = z.coeffs()[0].mid()
    z = z - middle
    total = arb_series([arb(0)])
    for c in reversed(arb_poly(coefficients)(arb_poly([middle, 1])).coeffs()):
        total = total * z + c
    return total


def _speed(panel: int, z: arb_series) -> arb_series:
    return z * arb(float(HALF_WIDTHS[panel])) + arb(float(CENTRES[panel]))


def _relative(formula: Formula, panel: int, z: arb_series) -> arb_series:
    return formula.epsilon(_speed(panel, z)) / _series("epsilon", panel, z) - 1


def _relative_loss(formula: Formula, panel: int, z: arb_series) -> arb_series:
    return (1 - formula.epsilon(_speed(panel, z))) / _series("one_minus_epsilon", panel, z) - 1


def _taylor(function: Callable[[arb_series], arb_series], part: Part) -> list[arb]:
    """Return coefficients c_0 … c_ORDER with function = sum c_j t^j on the part; the last one is a ball for all t."""
    centre, half = _ball(part.centre), _ball(part.half)
    at_centre = function(arb_series([centre, half]))
    whole = function(arb_series([arb(centre.mid(), half.abs_upper() + centre.rad()), half]))
    if min(at_centre.prec, whole.prec) <= ORDER:
        raise TypeError("the formula loses coefficients of a series")
    first = at_centre.coeffs()[:ORDER]
    return [*first, *[arb(0)] * (ORDER - len(first)), *whole.coeffs()[ORDER:]]


def _near_origin(formula: Formula, z: arb_series) -> arb_series:
    """Return the deviation relative to 1 - eps on the panel at 0, where both 1 - R and 1 - eps are O(v*^2)."""
    first, second, *loss = reference.rows()["one_minus_epsilon", 0].poly().coeffs()
    if not (first.is_zero() and second.is_zero()):
        raise ArithmeticError("1 - eps must be divisible by v*^2")
    half = arb(float(HALF_WIDTHS[0]))
    return formula.loss_ratio(_speed(0, z)) * half**2 / _polynomial(loss, z) - 1


def _quotient(numerator: arb_series, denominator: arb_series) -> arb_series:
    """Return the quotient; unlike FLINT, also refuse 0 by what may vanish."""
    if not denominator.coeffs() or denominator.coeffs()[0].contains(0):
        raise ZeroDivisionError("the denominator may vanish")
    return numerator / denominator


def _sum(coefficients: list[arb]) -> arb:
    return sum((abs(c) for c in coefficients), arb(0)).abs_upper()


def _ball(number: Fraction) -> arb:
    return arb(number.numerator) / number.denominator
