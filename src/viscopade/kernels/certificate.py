r"""Sup-norm certificates: proof of a bound of |R(v*) - eps(v*)| in a measure, for every v* of an interval.

The exact function is known on panels, as power series with a proven error (`reference`). Each panel is cut into equal
parts; on a part the deviation is a Taylor polynomial in -1 <= t <= 1 whose last coefficient is enclosed for the whole
part (Lagrange's remainder), so that the sum of the absolute values is a bound. Parts are halved until the bound is as
small as wanted. Beyond the panels the kernel's limit is compared with the limit of eps, in the same way.

What is bounded is the kernel's formula (`enclosure.Formula`), evaluated on power series. There is no quotient by a
series that may vanish, nor a root of one, so a bound is also a proof that there is no pole.
"""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass, replace
from fractions import Fraction
from itertools import pairwise
from typing import Literal

from flint import arb, arb_series

from viscopade.arithmetic.balls import ball_of, coefficient_sum, power_of_series, rational_power, working
from viscopade.arithmetic.decimals import at_most, rounded_up
from viscopade.collision import panel_proof
from viscopade.kernels import reference
from viscopade.kernels.enclosure import Formula
from viscopade.kernels.reference import Rows
from viscopade.progress import track

AnyMeasure = Literal["both", "relative", "speed"]
End = Fraction | float  # of an interval; the float is infinity
Functions = Callable[[arb_series], list[arb_series]]

ORDER = 12  # of the Taylor polynomials on a part
FEWEST_PARTS = 4
MOST_PARTS = 1 << 9  # of a panel
TIGHT = 0.999  # a bound that halving the parts lowers by less than this factor is tight
DECAY = Fraction(10, 3)  # eps goes like v*^-DECAY


@dataclass(frozen=True)
class Certificate:
    """Sup-norm certificate: a proven bound of the deviation of a formula from eps.

    Attributes
    ----------
    measure : str
        "both", relative to the smaller of eps and 1 - eps, "relative" to eps, or "speed", of v*(eps) relative to v*.
    low : Fraction
    high : Fraction, or infinity as a float
        Interval of v*.
    bound : Fraction
        |R - eps| <= bound times what it is relative to; rounded up to few decimal digits.
    parts : tuple of (int, int)
        The panels that meet the interval, and into how many equal parts each was cut for the proof.
    """

    measure: AnyMeasure
    low: Fraction
    high: End
    bound: Fraction
    parts: tuple[tuple[int, int], ...]

    def record(self) -> dict[str, object]:
        """Return the certificate as JSON-able data; ends of the interval as exact fractions "p/q"."""
        return {
            "measure": self.measure,
            "v_star_min": str(self.low),
            "v_star_max": None if self.high == math.inf else str(self.high),
            "bound": at_most(self.bound),
            **reference.record(),
            "parts": self.parts,
        }


def prove(formula: Formula, low: Fraction, high: End, measure: AnyMeasure = "both") -> Certificate:
    """Prove a bound of the deviation on low <= v* <= high that is tight, unless a pole is near.

    Parameters
    ----------
    formula : Formula
    low : Fraction
    high : Fraction, or infinity as a float
        Interval of v*; infinity for a formula with a limit.
    measure : str
        As in `Certificate`, but not "speed": see `prove_inverse`.

    Raises
    ------
    ValueError
        If the interval is invalid.
    ArithmeticError
        If there is no bound: the formula has a pole in the interval. Close to a pole the bound may be large, and not
        tight.
    """
    if measure == "both" and not formula.has("loss_ratio"):
        raise ValueError("1 - R must vanish like v*^2 where the deviation is measured relative to 1 - eps")
    proof = _Proof(formula, measure)
    with working(reference.BITS, ORDER + 1):
        if high != math.inf:
            return proof.on_panels(low, Fraction(high))
        if low >= panel_proof.END:
            raise ValueError(f"low is {low}: expected a number below {panel_proof.END} for an interval without an end")
        return proof.and_beyond(proof.on_panels(low, panel_proof.END))


def prove_inverse(formula: Formula) -> Certificate:
    """Prove a bound of the relative error of v* = y^k N/D for 0 < eps <= 1; errors as for `prove`."""
    proof = _Proof(formula, "speed")
    with working(reference.BITS, ORDER + 1):
        return proof.and_beyond(proof.on_panels(Fraction(0), panel_proof.END))


@dataclass(frozen=True)
class _Proof:
    """The proof for a formula in a measure. To be used within `working`, for series of `ORDER` + 1 terms."""

    formula: Formula
    measure: AnyMeasure

    def on_panels(self, low: Fraction, high: Fraction) -> Certificate:
        """Prove a bound on an interval."""
        stretches = reference.stretches(low, high)

        def bound(i: int, number: int) -> arb:
            return max(self.deviation(stretches[i].panel, *part) for part in stretches[i].parts(number))

        def message(i: int) -> str:
            return f"no bound was found near v* = {float(reference.v_star_at(stretches[i].panel)):.6g} (a pole?)"

        most, numbers = self._halved(len(stretches), bound, message)
        parts = tuple((stretch.panel, number) for stretch, number in zip(stretches, numbers, strict=True))
        return Certificate(self.measure, low, high, rounded_up(most), parts)

    def _halved(
        self, size: int, bound: Callable[[int, int], arb], message: Callable[[int], str]
    ) -> tuple[arb, list[int]]:
        """Return the largest bound of some stretches, and into how many parts each was cut.

        The parts of the worst stretch are halved until that lowers its bound no more. `bound` is given a stretch and
        its number of parts, `message` the stretch that has no bound.
        """
        numbers = [FEWEST_PARTS] * size
        bounds = [bound(i, FEWEST_PARTS) for i in track(range(size), "proof")]
        while True:
            worst = max(range(size), key=lambda i: float(bounds[i]))
            finer, most = bound(worst, 2 * numbers[worst]), numbers[worst] >= MOST_PARTS
            if most and not (finer.is_finite() and bounds[worst].is_finite()):
                raise ArithmeticError(message(worst))
            if most or (finer.is_finite() and finer > bounds[worst] * TIGHT):
                return max(bounds), numbers
            bounds[worst], numbers[worst] = finer, 2 * numbers[worst]

    def deviation(self, panel: int, start: Fraction, end: Fraction) -> arb:
        """Bound the deviation on a part of a panel; infinity if it may be infinite."""
        low, high = (reference.y_at(panel, z, self.formula.power) for z in (start, end))
        results = self._results(panel, low.union(high))
        bound = _largest(lambda y: [self._ratio(result, panel, y) - 1 for result in results], low, high)
        error = arb(panel_proof.proven_error())
        return ((bound + error) / (1 - error)).abs_upper()

    def _results(self, panel: int, y: arb) -> list[str]:
        """Return which results of the formula count on a part: relative to the smaller one of eps and 1 - eps."""
        if self.measure != "both":
            return [{"relative": "epsilon", "speed": "ratio"}[self.measure]]
        epsilon = Rows(panel, arb_series([y]), self.formula.power).epsilon[0]
        half = arb(0.5, 2.0**-20)  # rows are not exact
        return [*([] if epsilon > half else ["epsilon"]), *([] if epsilon < half else ["loss_ratio"])]

    def _ratio(self, result: str, panel: int, y: arb_series) -> arb_series:
        """Return a result of the formula over the true one, as a function of y on a panel."""
        rows = Rows(panel, y, self.formula.power)
        if result == "ratio":
            return rows.inverse_ratio(self.formula)
        found: arb_series = self.formula.near_zero(result, y=y, v_star=rows.v_star) / getattr(rows, result)
        return found

    def and_beyond(self, found: Certificate) -> Certificate:
        """Return the certificate without an end, given the one up to the end of the panels."""
        power, end = self.formula.power, ball_of(panel_proof.END)
        true = reference.limit(end)
        last = rational_power(1 / end, Fraction(1, power))
        if self.measure == "speed":
            most = arb((true / rational_power(end, DECAY)).abs_upper())  # of eps
            last = rational_power(most / (1 - most), Fraction(1, 2 * power))
        message = "no bound was found for large v*: does the formula have the right limit?"

        def bound(_: int, number: int) -> arb:
            ends = [last * ball_of(Fraction(i, number)) for i in range(number + 1)]
            return max(_largest(self._limit_ratio(true), *part) for part in pairwise(ends))

        beyond, _ = self._halved(1, bound, lambda _: message)
        if not beyond < 1:
            raise ArithmeticError(message)
        return replace(found, high=math.inf, bound=max(found.bound, rounded_up(beyond)))

    def _limit_ratio(self, true: arb) -> Functions:
        """Return the deviation for large v* as a function of u = 1/y, where eps v*^(10/3) is `true`."""
        power, limit = self.formula.power, self.formula.limit
        if self.measure != "speed":
            return lambda u: [limit(u=u, w=u**power) / true - 1]

        def of_speed(u: arb_series) -> list[arb_series]:
            survives = 1 / (1 + u ** (2 * power))  # 1 - eps
            return [limit(u=u) * power_of_series(survives / true, 1 / DECAY) - 1]

        return of_speed


def _largest(functions: Functions, low: arb, high: arb) -> arb:
    """Bound functions of y for low <= y <= high by Taylor polynomials; infinity if they may be infinite."""
    centre = ((low + high) / 2).mid()
    half = (high - centre).abs_upper().max((centre - low).abs_upper())  # covers the part
    bound = arb(0)
    try:
        middle, whole = (functions(arb_series([start, half])) for start in (centre, arb(centre, half)))
    except (ZeroDivisionError, ValueError):
        return arb.pos_inf()
    for at_centre, everywhere in zip(middle, whole, strict=True):
        if min(at_centre.prec, everywhere.prec) <= ORDER:
            raise TypeError("the formula loses coefficients of a series")
        terms = [*at_centre.coeffs()[:ORDER], *everywhere.coeffs()[ORDER:]]
        bound = bound.max(coefficient_sum(terms))
    return bound if bound.is_finite() else arb.pos_inf()
