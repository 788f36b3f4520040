r"""Sup-norm certificates: proof of a bound of |R(v*) - eps(v*)| in a measure, for every v* of an interval.

The exact function is known on panels of v*, as polynomials with a proven error from validated integrations of the
equation of motion (`reference`, `collision.panel_proof`); the series in v* diverges beyond v* = 1.047. Each panel is
cut into equal parts; on a part the deviation is a Taylor polynomial in -1 <= t <= 1 whose last coefficient is enclosed
for the whole part (Lagrange's remainder), so that the sum of the absolute values is a bound. Parts are halved until the
bound is as small as wanted. Beyond the panels the kernel's limit is compared with the limit of eps, in the same way.

What is bounded is the kernel's formula (`enclosure.Formula`): its branches' expressions, evaluated on power series by
`expressions.evaluate`. There is no quotient by a series that may vanish, nor a root of one, so a bound is also a proof
that there is no pole. Rounding is not included (`rounding_bounds`).
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
End = Fraction | float
"""An end of an interval of v*; the float is infinity."""
Functions = Callable[[arb_series], list[arb_series]]
"""From y as a power series in t to the deviations that count, as power series in t."""

ORDER = 12
"""Of the remainder of Taylor polynomials on a part. With 6 the compact kernel to 1e-7 needs four times as many parts,
with 20 three quarters of them; no bound changes by more than 1 % (measured)."""
FEWEST_PARTS = 4
"""Of a panel, at first. 1 to 16 give the same bounds; 16 needs twice to three times as many parts (measured)."""
MOST_PARTS = 1 << 9
"""Of a panel: where halving ends without a tight bound. Without a pole at most 64 are needed (measured)."""
TIGHT = 0.999
"""A bound that halving the parts lowers by less than this factor is tight: 0.1 %, below what rounding up to three
digits costs. With 0.99 bounds are up to 1 % larger, with 0.9999 it takes up to 2.4 times as many parts (measured)."""
DECAY = Fraction(10, 3)
"""eps goes like v*^-(10/3) for large v*: docs/theory/exact-function.md, step 8."""


@dataclass(frozen=True)
class Certificate:
    """Sup-norm certificate: a proven bound of the deviation of a formula from eps.

    Attributes
    ----------
    measure : str
        "both", relative to the smaller of eps and 1 - eps, "relative" to eps, or "speed", of v*(eps) relative to v*.
    low, high : Fraction, or infinity as a float
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
        R(v*), with exact or enclosed coefficients.
    low, high : Fraction, or infinity as a float
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
    # ORDER + 1 coefficients: those of a Taylor polynomial, and its remainder's.
    with working(reference.BITS, ORDER + 1):
        if high != math.inf:
            return proof.on_panels(low, Fraction(high))
        if low >= panel_proof.END:
            raise ValueError(f"low is {low}: expected a number below {panel_proof.END} for an interval without an end")
        return proof.and_beyond(proof.on_panels(low, panel_proof.END))


def prove_inverse(formula: Formula) -> Certificate:
    """Prove a bound of the relative error of v* = y^k N/D for 0 < eps <= 1; errors as for `prove`.

    y = ((1 - eps)/eps)^(1/(2 k)), and k is the formula's `power`.
    """
    proof = _Proof(formula, "speed")
    with working(reference.BITS, ORDER + 1):
        return proof.and_beyond(proof.on_panels(Fraction(0), panel_proof.END))


@dataclass(frozen=True)
class _Proof:
    """The proof for a formula in a measure. To be used within `working`, for series of `ORDER` + 1 terms."""

    formula: Formula
    measure: AnyMeasure

    def on_panels(self, low: Fraction, high: Fraction) -> Certificate:
        """Prove a bound on low <= v* <= high, up to the end of the panels."""
        stretches = reference.stretches(low, high)  # of each panel the part within the interval

        def bound(i: int, number: int) -> arb:
            return max(self.deviation(stretches[i].panel, *part) for part in stretches[i].parts(number))

        def message(i: int) -> str:
            return f"no bound was found near v* = {float(reference.v_star_at(stretches[i].panel)):.6g} (a pole?)"

        largest, numbers = self._halve_parts(len(stretches), bound, message)
        parts = tuple((stretch.panel, number) for stretch, number in zip(stretches, numbers, strict=True))
        return Certificate(self.measure, low, high, rounded_up(largest), parts)

    def _halve_parts(
        self, size: int, bound: Callable[[int, int], arb], message: Callable[[int], str]
    ) -> tuple[arb, list[int]]:
        """Return the largest bound of `size` stretches, and into how many parts each was cut.

        The parts of the worst stretch are halved until that lowers its bound no more. `bound` is given a stretch and
        its number of parts, `message` the stretch that has no bound.
        """
        numbers = [FEWEST_PARTS] * size
        bounds = [bound(i, FEWEST_PARTS) for i in track(range(size), "proof")]
        while True:
            worst = max(range(size), key=lambda i: float(bounds[i]))
            finer, no_more = bound(worst, 2 * numbers[worst]), numbers[worst] >= MOST_PARTS
            # An infinite bound at the largest number of parts: the formula may have a pole there.
            if no_more and not (finer.is_finite() and bounds[worst].is_finite()):
                raise ArithmeticError(message(worst))
            # Twice as many parts lower the worst bound by less than 0.1 %: it is tight.
            if no_more or (finer.is_finite() and finer > bounds[worst] * TIGHT):
                return max(bounds), numbers
            bounds[worst], numbers[worst] = finer, 2 * numbers[worst]

    def deviation(self, panel: int, start: Fraction, end: Fraction) -> arb:
        """Bound the deviation on a part of a panel; infinity if it may be infinite.

        `start` and `end` are in the panel's coordinate z, v* = centre + z (half width).
        """
        # On the part the formula and the panel's rows are functions of y = v*^(1/power).
        low, high = (reference.y_at(panel, z, self.formula.power) for z in (start, end))
        results = self._counting_results(panel, low.union(high))
        bound = _largest(lambda y: [self._ratio(result, panel, y) - 1 for result in results], low, high)
        # The rows q are off, too: |q/f - 1| <= error with the true f, so |R/f - 1| <= (|R/q - 1| + error)/(1 - error).
        error = arb(panel_proof.proven_error())
        return ((bound + error) / (1 - error)).abs_upper()

    def _counting_results(self, panel: int, y: arb) -> list[str]:
        """Return which results of the formula count for the y of a ball on a panel, by name.

        In the measure "both" they are relative to the smaller one of eps and 1 - eps: "epsilon", or "loss_ratio", which
        is (1 - R)/v*^2.
        """
        if self.measure != "both":
            return [{"relative": "epsilon", "speed": "ratio"}[self.measure]]
        epsilon = Rows(panel, arb_series([y]), self.formula.power).epsilon[0]
        # Rows are not exact: where eps is within 2^-20 of 1/2, far more than their error of 2^-60, both count.
        half = arb(0.5, 2.0**-20)
        return [*([] if epsilon > half else ["epsilon"]), *([] if epsilon < half else ["loss_ratio"])]

    def _ratio(self, result: str, panel: int, y: arb_series) -> arb_series:
        """Return a result of the formula over the true one, as a function of y on a panel."""
        rows = Rows(panel, y, self.formula.power)
        if result == "ratio":
            # v*(eps) of the formula over v*, for an inverse kernel v* = y^k N/D.
            return rows.inverse_ratio(self.formula)
        ratio: arb_series = self.formula.near_zero(result, y=y, v_star=rows.v_star) / getattr(rows, result)
        return ratio

    def and_beyond(self, on_panels: Certificate) -> Certificate:
        """Return the certificate without an end, given the one up to the end of the panels."""
        # The variable is u = 1/y, from 0 at infinity to `largest_u` at the end of the panels: u = v*^(-1/power).
        power, end = self.formula.power, ball_of(panel_proof.END)
        true_limit = reference.limit(end)  # encloses eps v*^(10/3) for all v* beyond the end
        largest_u = rational_power(1 / end, Fraction(1, power))
        if self.measure == "speed":
            # For an inverse kernel u = (eps/(1 - eps))^(1/(2 power)), which grows with eps; the largest eps is at the
            # end of the panels.
            largest_eps = arb((true_limit / rational_power(end, DECAY)).abs_upper())
            largest_u = rational_power(largest_eps / (1 - largest_eps), Fraction(1, 2 * power))
        message = "no bound was found for large v*: does the formula have the right limit?"

        def bound(_: int, number: int) -> arb:
            ends = [largest_u * ball_of(Fraction(i, number)) for i in range(number + 1)]
            return max(_largest(self._limit_deviation(true_limit), *part) for part in pairwise(ends))

        # A deviation of 1 or more is that of a formula which does not go like eps.
        beyond, _ = self._halve_parts(1, bound, lambda _: message)
        if not beyond < 1:
            raise ArithmeticError(message)
        return replace(on_panels, high=math.inf, bound=max(on_panels.bound, rounded_up(beyond)))

    def _limit_deviation(self, true_limit: arb) -> Functions:
        """Return the deviation for large v* as a function of u = 1/y, where eps v*^(10/3) is `true_limit`."""
        power, limit = self.formula.power, self.formula.limit
        if self.measure != "speed":
            # eps v*^(10/3) of the formula, in u and w = u^power = 1/v*, over the true one.
            return lambda u: [limit(u=u, w=u**power) / true_limit - 1]

        def of_speed(u: arb_series) -> list[arb_series]:
            """Return V(eps)/v* - 1, with the formula's V = (eps/(1 - eps))^(-3/10) limit(u)."""
            # u^(2 power) = eps/(1 - eps), hence 1 - eps = 1/(1 + u^(2 power)); v* = (eps/true_limit)^(-3/10).
            one_minus_epsilon = 1 / (1 + u ** (2 * power))
            return [limit(u=u) * power_of_series(one_minus_epsilon / true_limit, 1 / DECAY) - 1]

        return of_speed


def _largest(functions: Functions, low: arb, high: arb) -> arb:
    """Bound the absolute values of functions of y for low <= y <= high; infinity if they may be infinite.

    Each is a Taylor polynomial in t, y = centre + half t, -1 <= t <= 1, whose last coefficient is enclosed for the
    whole part (Lagrange's remainder).
    """
    centre = ((low + high) / 2).mid()
    half = (high - centre).abs_upper().max((centre - low).abs_upper())  # covers the part
    bound = arb(0)
    try:
        # Around t = 0, for the coefficients; and around every t of the part at once, for the remainder's.
        at_centre, everywhere = (functions(arb_series([start, half])) for start in (centre, arb(centre, half)))
    except (ZeroDivisionError, ValueError):  # a denominator, or the base of a root, may vanish
        return arb.pos_inf()
    for taylor, enclosure in zip(at_centre, everywhere, strict=True):
        if min(taylor.prec, enclosure.prec) <= ORDER:
            raise TypeError("the formula loses coefficients of a series")
        # |g(t)| <= |g_0| + … + |g_11| + |B|, and B contains g^(12)(t)/12! for all t.
        terms = [*taylor.coeffs()[:ORDER], *enclosure.coeffs()[ORDER:]]
        bound = bound.max(coefficient_sum(terms))
    return bound if bound.is_finite() else arb.pos_inf()
