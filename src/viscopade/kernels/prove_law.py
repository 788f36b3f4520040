r"""Proof of a bound of |N/D - eps| for any law of contact, for every v* from 0 to an end.

`law_panels` encloses eps and v* as functions of one parameter. Each panel is cut into equal parts; on a part the
deviation is a Taylor polynomial in -1 <= t <= 1 whose last coefficient is enclosed for the whole part, so that the sum
of the absolute values is a bound, as in `certificate`. Parts are halved until that does not help any more.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from fractions import Fraction

from flint import arb, arb_series

from viscopade import arguments
from viscopade.approximation.measure import Measure
from viscopade.arithmetic.balls import ball_of, rational_power, working
from viscopade.arithmetic.decimals import rounded_up
from viscopade.collision.exact import Exact
from viscopade.collision.law_panels import Course, LawPanel, law_panels, limit, series_at
from viscopade.kernels.certificate import Certificate
from viscopade.theory.law import Law

LARGEST, SMALLEST = 100, Fraction(1, 10**3)  # v*
BITS, ORDER = 160, 12
FEWEST_PARTS, MOST_PARTS = 4, 1 << 10
BISECTIONS = 40
ENDS = (60, 10**3, 10**4, 10**5, 10**6, 10**7)  # v* of panels before the limit for large v* takes over
NEGLIGIBLE = 2.0**-7  # what is not known of the limit, relative to the formula's error
TIGHT = 0.99  # a bound that halving the parts lowers by less than this factor is tight


def error_up_to(a: Sequence[arb], b: Sequence[arb], law: Law, v_star_max: Exact) -> str:
    """Return a bound of |N/D - eps|/min(eps, 1 - eps) for 0 <= v* <= v_star_max, as a decimal string.

    Arguments are those of `prove_by_panels`, but for v_star_max, which may be whatever `exact.collision` takes.

    Raises
    ------
    TypeError, ValueError
        If v_star_max is no number from 1e-3 to 100, the force of the law is attractive, or nothing was proven up to
        there, as for an N/D with a pole.
    """
    accepted = f"a number from {float(SMALLEST):g} to {LARGEST}"
    high = arguments.exact_number("v_star_max", v_star_max, accepted, lambda v: SMALLEST <= v <= LARGEST)
    try:
        return prove_by_panels(a, b, law, Fraction(0), high).bound
    except ArithmeticError as error:
        raise ValueError(f"v_star_max is {v_star_max}: {error}; accepted is a smaller number") from None


def prove_by_panels(
    a: Sequence[arb], b: Sequence[arb], law: Law, low: Fraction, high: Fraction | None, measure: Measure = "both"
) -> Certificate:
    """Prove a bound of the deviation on low <= v* <= high that is tight to about its printed digits.

    Parameters
    ----------
    a, b : sequence of flint.arb
        Coefficients of N and D, ascending in v* = kappa^(1/law.d); a_i = b_i for i < law.d.
    law : Law
        With no attractive force.
    low, high : Fraction
        0 <= low < high <= 100; None is infinity, for a law with a whole power of v* as limit, and n = m + that power.
    measure : "both" or "relative"
        Relative to the smaller of eps and 1 - eps, or to eps.

    Raises
    ------
    ValueError
        If the force of the law is attractive.
    ArithmeticError
        If there is no bound: the formula has a pole in the interval, or the law's panels do not reach so far.
    """
    if high is None:
        end = _end(a, b, law)
        found = prove_by_panels(a, b, law, low, end, measure)
        bound = max(found.bound, _beyond(a, b, law, end), key=Fraction)
        return replace(found, high=None, bound=bound)
    if high > max(ENDS):
        raise ArithmeticError(f"proofs for the law {law} end at v* = {max(ENDS)}")
    try:
        panels = law_panels(law, high)
    except ArithmeticError:
        raise ArithmeticError(f"no proof was found for the law {law} up to v* = {float(high):g}") from None
    task = _Task(a, b, law, measure)
    with working(BITS, ORDER + 1):
        starts = [
            (i, _start(panel, low)) for i, panel in enumerate(panels) if _v_star(panel, Fraction(1)) > ball_of(low)
        ]
        bounds = [task.bound(panels[i], start, FEWEST_PARTS) for i, start in starts]
        number = [FEWEST_PARTS] * len(starts)
        while True:
            worst = max(range(len(starts)), key=lambda k: float(bounds[k]))
            i, start = starts[worst]
            finer = task.bound(panels[i], start, 2 * number[worst])
            most = number[worst] >= MOST_PARTS
            if finer.is_finite() and (most or finer > bounds[worst] * TIGHT):
                parts = tuple((i, n) for (i, _), n in zip(starts, number, strict=True))
                bound = max((rounded_up(bound) for bound in bounds), key=Fraction)
                return Certificate(measure, low, high, bound, parts, law)
            if most:
                near = float(_v_star(panels[i], Fraction(0)))
                raise ArithmeticError(f"no bound was found near v* = {near:.3g} (a pole?)")
            bounds[worst], number[worst] = finer, 2 * number[worst]


def _end(a: Sequence[arb], b: Sequence[arb], law: Law) -> Fraction:
    """Return a v* from which the limit of eps is known well in comparison with the formula's error there."""
    with working(BITS):
        factor = rational_power(ball_of(law.damping + 1), law.nu - 1)
        error = abs(a[-1] / b[-1] / factor - 1)
        return Fraction(next((end for end in ENDS if limit(law, arb(end)).rad() < NEGLIGIBLE * error), ENDS[-1]))


def _beyond(a: Sequence[arb], b: Sequence[arb], law: Law, end: Fraction) -> str:
    """Bound the deviation relative to eps for all v* >= end, in u = 1/v*."""
    if len(b) - len(a) != law.whole_decay:
        raise ArithmeticError("no bound was found for large v*: does the formula have the right limit?")
    with working(BITS):
        true = limit(law, ball_of(end)) * rational_power(ball_of(law.damping + 1), law.nu - 1)

    def deviation(u: arb_series) -> list[arb_series]:
        return [series_at(a[::-1], u) / series_at(b[::-1], u) / true - 1]

    number, bound = FEWEST_PARTS, arb.pos_inf()
    with working(BITS, ORDER + 1):
        while number <= MOST_PARTS:
            half = 1 / ball_of(2 * number * end)
            finer = max(_largest(deviation, (2 * i + 1) * half, half) for i in range(number))
            if finer > bound * TIGHT:
                break
            bound, number = finer, 2 * number
    if not bound < 1:
        raise ArithmeticError("no bound was found for large v*: is there a pole?")
    return rounded_up(bound)


def _largest(functions: Callable[[arb_series], list[arb_series]], centre: arb, half: arb) -> arb:
    """Bound the absolute values of functions of z for |z - centre| <= half by their Taylor series, with remainder."""
    middle, whole = (functions(arb_series([start, half])) for start in (centre, arb(centre, half.upper())))
    bound = arb(0)
    for at_centre, everywhere in zip(middle, whole, strict=True):
        if min(at_centre.prec, everywhere.prec) <= ORDER:
            raise TypeError("a series loses coefficients")
        terms = [*at_centre.coeffs()[:ORDER], *everywhere.coeffs()[ORDER:]]
        bound = bound.max(sum((abs(c) for c in terms), arb(0)).abs_upper())
    return bound


def _v_star(panel: LawPanel, z: Fraction) -> arb:
    return panel.course(arb_series([ball_of(z)])).v_star.coeffs()[0]


def _start(panel: LawPanel, low: Fraction) -> Fraction:
    """Return a z of the panel before which v* < low, or where the panel begins."""
    start, end = panel.start, Fraction(1)
    for _ in range(BISECTIONS if low else 0):
        middle = (start + end) / 2
        start, end = (middle, end) if _v_star(panel, middle) < ball_of(low) else (start, middle)
    return start


@dataclass(frozen=True)
class _Task:
    """A formula N/D, the law that it stands for, and the measure of its deviation."""

    a: Sequence[arb]
    b: Sequence[arb]
    law: Law
    measure: Measure

    def bound(self, panel: LawPanel, start: Fraction, number: int) -> arb:
        """Bound the deviation for start <= z <= 1, cut into parts; infinity if FLINT finds that it may be infinite."""
        half = (1 - start) / (2 * number)
        centres = (start + (2 * i + 1) * half for i in range(number))
        try:
            bounds = [_largest(lambda z: self._deviations(panel.course(z)), ball_of(z), ball_of(half)) for z in centres]
        except (ZeroDivisionError, ValueError):
            return arb.pos_inf()
        return max(bounds) if all(bound.is_finite() for bound in bounds) else arb.pos_inf()

    def _deviations(self, course: Course) -> list[arb_series]:
        """Return (N/D)/eps - 1 and, in measure "both", (1 - N/D)/(1 - eps) - 1: 1 - N/D = v*^d S/D."""
        top, bottom = series_at(self.a, course.v_star), series_at(self.b, course.v_star)
        of_epsilon = top / (bottom * course.epsilon) - 1
        if self.measure == "relative":
            return [of_epsilon]
        size = max(len(self.a), len(self.b))
        a, b = ([*values, *[arb(0)] * (size - len(values))] for values in (self.a, self.b))
        s = [b[i] - a[i] for i in range(self.law.d, size)]
        return [of_epsilon, series_at(s, course.v_star) / (bottom * course.loss_ratio) - 1]
