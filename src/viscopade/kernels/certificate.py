r"""Sup-norm certificates: proof of a bound of |R(v*) - eps(v*)| in a measure, for every v* of an interval.

The exact function is known on panels as polynomials with a proven error (`panel_proof`). Each panel is cut into equal
parts; on a part the deviation is a Taylor polynomial in -1 <= t <= 1 whose last coefficient is enclosed for the whole
part (Lagrange's remainder), so that the sum of the absolute values is a bound. Parts are halved until the bound is as
small as wanted. Beyond the panels the kernel's limit is compared with that of eps.

What is bounded is the kernel's formula (`enclosure.Formula`), evaluated on power series. There is no quotient by a
series that may vanish, nor a root of one, so a bound is also a proof that there is no pole.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator
from dataclasses import dataclass, replace
from fractions import Fraction
from functools import lru_cache
from typing import Literal

from flint import arb, arb_series

from viscopade.approximation.measure import Measure
from viscopade.arithmetic.balls import ball_of, working
from viscopade.arithmetic.decimals import rounded_up
from viscopade.arrays import double
from viscopade.arrays.panels import CENTRES, DATA, HALF_WIDTHS, PANELS
from viscopade.collision import panel_proof
from viscopade.kernels.enclosure import Formula, polynomial
from viscopade.progress import track
from viscopade.theory.law import VISCOELASTIC, Law

AnyMeasure = Literal["both", "relative", "speed", "derivative"]

BITS = 192
ORDER = 12  # of the Taylor polynomials on a part
FEWEST_PARTS = 4
MOST_PARTS = 1 << 9
TIGHT = 0.999  # a bound that halving the parts lowers by less than this factor is tight


@dataclass(frozen=True)
class Part:
    """A piece of a panel: centre and half width in the panel's z, |z| <= 1."""

    panel: int
    centre: Fraction
    half: Fraction


def _v_star(panel: int, z: Fraction) -> Fraction:
    return Fraction(float(CENTRES[panel])) + Fraction(float(HALF_WIDTHS[panel])) * z


@dataclass(frozen=True)
class Certificate:
    """Sup-norm certificate: a proven bound of the deviation of a formula from eps.

    Attributes
    ----------
    measure : str
        "both", relative to the smaller of eps and 1 - eps, "relative" to eps, "speed", of v*(eps) relative to v*,
        or "derivative", of d eps/d v* relative to it.
    low : Fraction
    high : Fraction or None
        Interval of v*; None is infinity.
    bound : str
        |R - eps| <= bound times what it is relative to; decimal, rounded up.
    parts : tuple of (int, int)
        The panels that meet the interval, and into how many equal parts each was cut for the proof.
    law : Law
        Of contact. The panels of a law other than the paper's are those of `law_panels`, made anew.
    """

    measure: AnyMeasure
    low: Fraction
    high: Fraction | None
    bound: str
    parts: tuple[tuple[int, int], ...]
    law: Law = VISCOELASTIC

    def record(self) -> dict[str, object]:
        """Return the certificate as JSON-able data; ends of the interval as exact fractions "p/q"."""
        slopes = [rounded_up(_slope_error(panel)) for panel, _ in self.parts] if self.measure == "derivative" else None
        if self.law == VISCOELASTIC:
            reference: dict[str, object] = {"reference": DATA, "reference_error": panel_proof.proven_error().hex()}
        else:
            reference = {"law": str(self.law), "end": self.law.end, "reference": "viscopade.collision.law_panels"}
        return {
            "measure": self.measure,
            "v_star_min": str(self.low),
            "v_star_max": None if self.high is None else str(self.high),
            "bound": self.bound,
            **reference,
            **({"slope_errors": slopes} if slopes else {}),
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
    if measure == "both" and low == 0 and not formula.has("loss_ratio"):
        raise ValueError("1 - R must vanish like v*^2 where the deviation is measured relative to 1 - eps")
    return _prove(formula, low, high, measure)


def _prove(formula: Formula, low: Fraction, high: Fraction, measure: AnyMeasure) -> Certificate:
    limits = list(panels_of(low, high))
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


def prove_to_infinity(formula: Formula, measure: Measure = "both") -> Certificate:
    """Prove a bound of the deviation for all v* >= 0; errors as for `prove`."""
    on_panels = prove(formula, Fraction(0), panel_proof.END, measure)
    with working(BITS):
        end = ball_of(panel_proof.END)
        u = _from_zero((1 / end).root(formula.power))
        ratio = formula.limit(u=u, w=u**formula.power) / panel_proof.asymptotic_factor()
        return _and_beyond(on_panels, ratio * arb(0, panel_proof.tail(end)).exp())


def prove_inverse(formula: Formula, epsilon_min: Fraction = Fraction(0)) -> Certificate:
    """Prove a bound of the relative error of v*(eps) for epsilon_min <= eps <= 1 (0: for 0 < eps <= 1).

    Errors as for `prove`. The certificate's interval is one of v*, which covers that of eps.
    """
    if epsilon_min:
        return _prove(formula, Fraction(0), _speed_beyond(epsilon_min), "speed")
    on_panels = _prove(formula, Fraction(0), panel_proof.END, "speed")
    with working(BITS):
        end = ball_of(panel_proof.END)
        largest = (
            2 * panel_proof.asymptotic_factor() / (end**10).root(3)
        ).abs_upper()  # of eps, as `tail` is below ln 2
        survives = 1 - arb(largest / 2, (largest / 2).abs_upper())
        u = _from_zero((largest / (1 - largest)).root(2 * formula.power))
        ratio = formula.limit(u=u) * (survives / panel_proof.asymptotic_factor()) ** (arb(3) / 10)
        return _and_beyond(on_panels, ratio * arb(0, panel_proof.tail(end)).exp())


def prove_derivative(formula: Formula, low: Fraction, high: Fraction) -> Certificate:
    """Prove a bound of the relative error of d eps/d v* on low <= v* <= high; errors as for `prove`."""
    return _prove(formula, low, high, "derivative")


def _speed_beyond(epsilon_min: Fraction) -> Fraction:
    """Return a v* whose eps is certainly below epsilon_min, by a little."""
    v_star = Fraction(float(double.v_star_from(float(epsilon_min)))) * (1 + Fraction(1, 2**40))
    *_, (panel, _, end) = panels_of(Fraction(0), v_star)
    if panel_proof.panel_rows()["epsilon", panel](end) * (1 + Fraction(1, 2**50)) > epsilon_min:
        raise ArithmeticError(f"no v* with eps = {float(epsilon_min):g} was found")
    return v_star


def _and_beyond(on_panels: Certificate, ratio: arb) -> Certificate:
    """Return the certificate for the half-line, given an enclosure of formula/truth beyond the panels."""
    beyond = abs(ratio - 1).abs_upper()
    if not beyond < 1:
        raise ArithmeticError("no bound was found for large v*: does the formula have the right limit?")
    return replace(on_panels, high=None, bound=max(on_panels.bound, rounded_up(beyond), key=Fraction))


@lru_cache(maxsize=1 << 14)  # intervals share panels
def _on_panel(formula: Formula, limit: tuple[int, Fraction, Fraction], number: int, measure: AnyMeasure) -> arb:
    """Bound the deviation on the panel's part of the interval; infinity if FLINT finds that R may be infinite."""
    try:
        return max(deviation(formula, part, measure) for part in parts_of(*limit, number))
    except (ZeroDivisionError, ValueError):
        return arb.pos_inf()


def panels_of(low: Fraction, high: Fraction) -> Iterator[tuple[int, Fraction, Fraction]]:
    """Yield the panels that meet [low, high], with the ends of the common part in z.

    Raises
    ------
    ValueError
        Unless 0 <= low < high <= the end of the last panel.
    """
    if not 0 <= low < high <= panel_proof.END:
        raise ValueError(f"the interval is [{low}, {high}]: accepted is 0 <= low < high <= {panel_proof.END}")
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
            start, end = (ball_of(_v_star(part.panel, z)) for z in (part.centre - part.half, part.centre + part.half))
            yield arb((start + end) / 2, ((end - start) / 2).abs_upper())


def deviation(formula: Formula, part: Part, measure: AnyMeasure) -> arb:
    """Bound the deviation on a part: relative to eps, in measure "both" to the smaller of eps and 1 - eps, or to v*."""
    with working(BITS, ORDER + 1):
        bounds = [_sum(_taylor(function, part, formula.power)) for function in _functions(formula, part.panel, measure)]
        error = (
            ball_of(Fraction(rounded_up(_slope_error(part.panel))))
            if measure == "derivative"
            else arb(panel_proof.proven_error())
        )
        return ((max(bounds) + error) / (1 - error)).abs_upper()


def _functions(formula: Formula, panel: int, measure: AnyMeasure) -> Iterator[Callable[[arb_series], arb_series]]:
    """Yield the deviations to be bounded on a panel, as functions of y = v*^(1/power)."""
    power = formula.power

    def of(result: str) -> Callable[[arb_series], arb_series]:
        return lambda y: formula.at(result, y=y, v_star=y**power)

    if measure == "speed":
        yield lambda y: _inverse_ratio(formula, y, _odds_ratio(panel, y**power)) - 1
    elif measure == "derivative":
        yield lambda y: of("slope_ratio")(y) / _slope_ratio(panel, y**power) - 1
    elif measure == "both" and panel == 0:
        yield lambda y: of("loss_ratio")(y) / _loss_ratio(0, y**power) - 1
    else:
        if measure == "relative" or _may_be(panel, "epsilon"):
            yield lambda y: of("epsilon")(y) / _row("epsilon", panel, y**power) - 1
        if measure == "both" and _may_be(panel, "one_minus_epsilon"):
            yield lambda y: (1 - of("epsilon")(y)) / _row("one_minus_epsilon", panel, y**power) - 1


def _inverse_ratio(formula: Formula, y: arb_series, odds_ratio: arb_series) -> arb_series:
    """Return the formula's v* over the true one, y^power, given ((1 - eps)/eps)/v*^2; its own y is a root of the odds.

    The root's exponent is 1/(2 power), so that the own y is y times a smooth function.
    """
    log_odds = odds_ratio.log()
    own = y * (log_odds / (2 * formula.power)).exp()
    return (log_odds / 2).exp() * formula.at("ratio", y=own)


def _from_zero(upper: arb) -> arb:
    """Return a ball that contains [0, upper]."""
    half = upper.abs_upper() / 2
    return arb(half.mid(), half.abs_upper())


def _may_be(panel: int, name: str) -> bool:
    """Whether the function may be the smaller one of eps and 1 - eps somewhere on the panel.

    Both are monotonic (docs/theory/exact-function.md, step 5), so each is least at an end.
    """
    row = panel_proof.panel_rows()[name, panel]
    return min(row(Fraction(-1)), row(Fraction(1))) <= Fraction(1, 2) + Fraction(1, 10**6)


def _row(name: str, panel: int, v_star: arb_series) -> arb_series:
    """Return the reference's eps or 1 - eps."""
    return polynomial(panel_proof.panel_rows()[name, panel].poly().coeffs(), _place(panel, v_star))


def _loss_ratio(panel: int, v_star: arb_series) -> arb_series:
    """Return the reference's (1 - eps)/v*^2; on the panel at 0 its polynomial is divisible by v*^2."""
    if panel > 0:
        return _row("one_minus_epsilon", panel, v_star) / (v_star * v_star)
    first, second, *loss = panel_proof.panel_rows()["one_minus_epsilon", 0].poly().coeffs()
    if not (first.is_zero() and second.is_zero()):
        raise ArithmeticError("1 - eps must be divisible by v*^2")
    return polynomial(loss, _place(0, v_star)) / arb(float(HALF_WIDTHS[0])) ** 2


def _smaller(panel: int) -> str:
    """Return which row tells most of the derivative: that of the smaller function."""
    return (
        "one_minus_epsilon" if panel_proof.panel_rows()["epsilon", panel](Fraction(0)) > Fraction(1, 2) else "epsilon"
    )


def _slope_ratio(panel: int, v_star: arb_series) -> arb_series:
    """Return the reference's (d eps/d v*)/v*, from the derivative of a row."""
    name = _smaller(panel)
    slope = [i * c for i, c in enumerate(panel_proof.panel_rows()[name, panel].poly().coeffs())][1:]
    scale = arb(float(HALF_WIDTHS[panel])) * (-1 if name == "one_minus_epsilon" else 1)
    if panel == 0:  # the row begins with z^2
        return polynomial(slope[1:], _place(0, v_star)) / (scale * arb(float(HALF_WIDTHS[0])))
    return polynomial(slope, _place(panel, v_star)) / (scale * v_star)


@lru_cache(maxsize=PANELS)
def _slope_error(panel: int) -> arb:
    """Bound the relative error of `_slope_ratio` (docs/theory/exact-function.md, step 9).

    With x = ln v*, g = ln(true/row) has |g| <= G = 2^-60 and |g''| <= M, so |g'| <= 2 sqrt(G M) (Landau).
    """
    with working(BITS, 3):
        centre, half = arb(float(CENTRES[panel])), arb(float(HALF_WIDTHS[panel]))
        middle, reach = (half / 2, half / 2) if panel == 0 else (centre, half)
        v_star = arb_series([arb(middle, reach), arb(1)])
        power = 2 if panel == 0 else 0  # the row is v*^2 times a polynomial on the panel at 0
        smooth = _loss_ratio(0, v_star) if panel == 0 else _row(_smaller(panel), panel, v_star)
        ratio = (smooth / smooth.coeffs()[0]).coeffs()
        v = v_star.coeffs()[0]
        slope = power + v * ratio[1]
        own = v * (ratio[1] + v * (2 * ratio[2] - ratio[1] ** 2))
        error = arb(panel_proof.proven_error())
        uncertain = 2 * (arb(1.01) * error * (panel_proof.CURVATURE + abs(own))).sqrt()
        return (error + uncertain * (1 + error) / abs(slope).lower()).abs_upper()


def _odds_ratio(panel: int, v_star: arb_series) -> arb_series:
    """Enclose ((1 - eps)/eps)/v*^2: the true value at every v*, as it is within the rows' errors."""
    uncertain = arb(1, arb(3 * panel_proof.proven_error()))
    return _loss_ratio(panel, v_star) / _row("epsilon", panel, v_star) * uncertain


def _place(panel: int, v_star: arb_series) -> arb_series:
    """Return the panel's z."""
    return (v_star - arb(float(CENTRES[panel]))) / arb(float(HALF_WIDTHS[panel]))


def _taylor(function: Callable[[arb_series], arb_series], part: Part, power: int) -> list[arb]:
    """Return coefficients c_0 … c_ORDER with function = sum c_j t^j on the part; the last one is a ball for all t."""
    ends = (_v_star(part.panel, z) for z in (part.centre - part.half, part.centre + part.half))
    low, high = (ball_of(v_star).root(power) if v_star else arb(0) for v_star in ends)
    centre = ((low + high) / 2).mid()
    half = (high - centre).abs_upper().max((centre - low).abs_upper())  # covers the part
    at_centre = function(arb_series([centre, half]))
    whole = function(arb_series([arb(centre, half), half]))
    if min(at_centre.prec, whole.prec) <= ORDER:
        raise TypeError("the formula loses coefficients of a series")
    first = at_centre.coeffs()[:ORDER]
    return [*first, *[arb(0)] * (ORDER - len(first)), *whole.coeffs()[ORDER:]]


def _sum(coefficients: list[arb]) -> arb:
    return sum((abs(c) for c in coefficients), arb(0)).abs_upper()
