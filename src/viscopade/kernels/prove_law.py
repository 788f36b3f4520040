r"""Proof of a bound of |N/D - eps| for any law of contact, for every v* from 0 to an end.

`law_panels` encloses eps and v* as functions of one parameter. Each panel is cut into equal parts; on a part the
deviation is a Taylor polynomial in -1 <= t <= 1 whose last coefficient is enclosed for the whole part, so that the sum
of the absolute values is a bound, as in `certificate`. Parts are halved until that does not help any more.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from fractions import Fraction
from typing import Protocol

from flint import arb, arb_series

from viscopade import arguments
from viscopade.approximation.inverse import InverseForm
from viscopade.approximation.measure import Measure
from viscopade.arithmetic.balls import ball_of, rational_power, working
from viscopade.arithmetic.decimals import rounded_up
from viscopade.collision import exact
from viscopade.collision.exact import Exact
from viscopade.collision.law_panels import Course, LawPanel, law_panels, limit, power_of_series, series_at
from viscopade.kernels.certificate import AnyMeasure, Certificate
from viscopade.kernels.enclosure import Formula
from viscopade.theory.law import Law

LARGEST, SMALLEST = 100, Fraction(1, 10**3)  # v*
BITS, ORDER = 160, 12
FEWEST_PARTS, MOST_PARTS = 4, 1 << 10
BISECTIONS = 40
DIGITS_OF_END = 25
EXACT = 2.0**-60  # a formula whose limit is off by less has the right one
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
    task = _Task(a, b, law, measure)
    if high is None:
        end = _end(a, b, law)
        return _and_beyond(_on_panels(task, law, low, end, measure), _beyond(a, b, law, end))
    return _on_panels(task, law, low, high, measure)


def prove_inverse_by_panels(formula: Formula, form: InverseForm, law: Law, epsilon_min: Fraction) -> Certificate:
    """Prove a bound of the relative error of v* = y^k N/D for epsilon_min <= eps <= 1 (0: for 0 < eps <= 1).

    The certificate's interval is one of v*, which covers that of eps.

    Parameters
    ----------
    formula : Formula
        With the results "ratio", which is N/D, and for an epsilon_min of 0 "limit".
    form : InverseForm
        Of the law.
    law : Law
        With no attractive force.
    epsilon_min : Fraction
        From 0 to less than 1.

    Raises
    ------
    ValueError, ArithmeticError
        As for `prove_by_panels`.
    """
    task = _InverseTask(formula, form, law)
    high = _v_star_beyond(law, epsilon_min) if epsilon_min else None
    if high is not None and not (law.nu == 1 and high > ENDS[0]):
        return _on_panels(task, law, Fraction(0), high, "speed")
    with working(BITS):
        end = Fraction(ENDS[0])  # for nu = 1, the limit is sharp from there on
        if high is None:
            error = abs(formula.limit(u=arb(0)) / rational_power(_limit_factor(law), form.rest * form.root) - 1) + EXACT
            end = Fraction(next((end for end in ENDS if limit(law, arb(end)).rad() < NEGLIGIBLE * error), ENDS[-1]))
    found = _on_panels(task, law, Fraction(0), end, "speed")
    return _and_beyond(found, _inverse_beyond(formula, form, law, end, epsilon_min), high)


def _and_beyond(found: Certificate, beyond: str, high: Fraction | None = None) -> Certificate:
    """Return the certificate up to another end, None for infinity, given the bound beyond the panels."""
    return replace(found, high=high, bound=max(found.bound, beyond, key=Fraction))


def _on_panels(task: _Deviation, law: Law, low: Fraction, high: Fraction, measure: AnyMeasure) -> Certificate:
    """Prove a bound for low <= v* <= high; errors as for `prove_by_panels`."""
    if high > max(ENDS):
        raise ArithmeticError(f"proofs for the law {law} end at v* = {max(ENDS)}")
    try:
        panels = law_panels(law, high)
    except ArithmeticError:
        raise ArithmeticError(f"no proof was found for the law {law} up to v* = {float(high):g}") from None
    with working(BITS, ORDER + 1):
        starts = [
            (i, _start(panel, low)) for i, panel in enumerate(panels) if _v_star(panel, Fraction(1)) > ball_of(low)
        ]
        bounds = [_bound(task, panels[i], start, FEWEST_PARTS) for i, start in starts]
        number = [FEWEST_PARTS] * len(starts)
        while True:
            worst = max(range(len(starts)), key=lambda k: float(bounds[k]))
            i, start = starts[worst]
            finer = _bound(task, panels[i], start, 2 * number[worst])
            most = number[worst] >= MOST_PARTS
            if finer.is_finite() and (most or finer > bounds[worst] * TIGHT):
                parts = tuple((i, n) for (i, _), n in zip(starts, number, strict=True))
                bound = max((rounded_up(bound) for bound in bounds), key=Fraction)
                return Certificate(measure, low, high, bound, parts, law)
            if most:
                near = float(_v_star(panels[i], Fraction(0)))
                raise ArithmeticError(f"no bound was found near v* = {near:.3g} (a pole?)")
            bounds[worst], number[worst] = finer, 2 * number[worst]


def _limit_factor(law: Law) -> arb:
    """Return (b + 1)^(nu-1), the limit of eps kappa^nu. To be called within `working`."""
    return rational_power(ball_of(law.damping + 1), law.nu - 1)


def _end(a: Sequence[arb], b: Sequence[arb], law: Law) -> Fraction:
    """Return a v* from which the limit of eps is known well in comparison with the formula's error there."""
    with working(BITS):
        error = abs(a[-1] / b[-1] / _limit_factor(law) - 1)
        return Fraction(next((end for end in ENDS if limit(law, arb(end)).rad() < NEGLIGIBLE * error), ENDS[-1]))


def _beyond(a: Sequence[arb], b: Sequence[arb], law: Law, end: Fraction) -> str:
    """Bound the deviation relative to eps for all v* >= end, in u = 1/v*."""
    if len(b) - len(a) != law.whole_decay:
        raise ArithmeticError("no bound was found for large v*: does the formula have the right limit?")
    with working(BITS):
        true, width = limit(law, ball_of(end)) * _limit_factor(law), 1 / ball_of(end)

    def deviation(u: arb_series) -> list[arb_series]:
        return [series_at(a[::-1], u) / series_at(b[::-1], u) / true - 1]

    return _from_infinity(deviation, width)


def _inverse_beyond(formula: Formula, form: InverseForm, law: Law, end: Fraction, epsilon_min: Fraction) -> str:
    """Bound the relative error of v* for all v* >= end with eps >= epsilon_min, in u = 1/y; on an interval, for nu = 1.

    1 - eps is 1/(1 + u^(k d)).
    """
    with working(BITS):
        true = limit(law, ball_of(end)) * _limit_factor(law)  # of eps kappa^nu
        largest = (true / rational_power(ball_of(end) ** law.d, law.nu)).abs_upper()  # of eps
        last = arb(rational_power(largest / (1 - largest), form.root).abs_upper())
        first = ball_of(epsilon_min / (1 - epsilon_min))

    def deviation(u: arb_series) -> list[arb_series]:
        survives = 1 / (1 + u ** int(1 / form.root))
        left = formula.limit(u=u) if form.whole else formula.at("ratio", y=1 / u)
        return [left * power_of_series(survives / true, 1 / (law.nu * law.d)) - 1]

    return _from_infinity(deviation, last, first)


def _from_infinity(functions: Callable[[arb_series], list[arb_series]], last: arb, first: arb | int = 0) -> str:
    """Bound the absolute values of functions of u for first <= u <= last, on parts."""
    number, bound = FEWEST_PARTS, arb.pos_inf()
    with working(BITS, ORDER + 1):
        while number <= MOST_PARTS:
            half = (last - first) / (2 * number)
            try:
                finer = max(_largest(functions, first + (2 * i + 1) * half, half) for i in range(number))
            except ZeroDivisionError:
                break
            if finer > bound * TIGHT:
                break
            bound, number = finer, 2 * number
    if not bound < 1:
        raise ArithmeticError("no bound was found for large v*: is there a pole?")
    return rounded_up(bound)


def _v_star_beyond(law: Law, epsilon_min: Fraction) -> Fraction:
    """Return a v* whose eps is certainly below epsilon_min, by a little."""
    with working(BITS):
        near = exact.invert(epsilon_min, DIGITS_OF_END, law=law).v_star
        v_star = Fraction(float(near.mid())) * (1 + Fraction(1, 2**40))
        if not exact.collision(v_star, DIGITS_OF_END, law=law).epsilon < ball_of(epsilon_min):
            raise ArithmeticError(f"no v* with eps = {float(epsilon_min):g} was found")
    return v_star


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


class _Deviation(Protocol):
    """A deviation that is to be bounded on panels."""

    def at(self, panel: LawPanel, z: arb_series) -> list[arb_series]:
        """Return functions of the panel's parameter, the largest of which is the deviation."""


def _bound(task: _Deviation, panel: LawPanel, start: Fraction, number: int) -> arb:
    """Bound the deviation for start <= z <= 1, cut into parts; infinity if FLINT finds that it may be infinite."""
    half = (1 - start) / (2 * number)
    centres = (start + (2 * i + 1) * half for i in range(number))
    try:
        bounds = [_largest(lambda z: task.at(panel, z), ball_of(z), ball_of(half)) for z in centres]
    except (ZeroDivisionError, ValueError):
        return arb.pos_inf()
    return max(bounds) if all(bound.is_finite() for bound in bounds) else arb.pos_inf()


@dataclass(frozen=True)
class _Task:
    """A formula N/D, the law that it stands for, and the measure of its deviation."""

    a: Sequence[arb]
    b: Sequence[arb]
    law: Law
    measure: Measure

    def at(self, panel: LawPanel, z: arb_series) -> list[arb_series]:
        """Return (N/D)/eps - 1 and, in measure "both", (1 - N/D)/(1 - eps) - 1: 1 - N/D = v*^d S/D."""
        course = panel.course(z)
        top, bottom = series_at(self.a, course.v_star), series_at(self.b, course.v_star)
        of_epsilon = top / (bottom * course.epsilon) - 1
        if self.measure == "relative":
            return [of_epsilon]
        size = max(len(self.a), len(self.b))
        a, b = ([*values, *[arb(0)] * (size - len(values))] for values in (self.a, self.b))
        s = [b[i] - a[i] for i in range(self.law.d, size)]
        return [of_epsilon, series_at(s, course.v_star) / (bottom * course.loss_ratio) - 1]


@dataclass(frozen=True)
class _InverseTask:
    """A formula y^k N/D of the inverse, and the law that it stands for."""

    formula: Formula
    form: InverseForm
    law: Law

    def at(self, panel: LawPanel, t: arb_series) -> list[arb_series]:
        """Return the formula's v* over the true one, less 1; w = (q/v*^d)^(1/d) is y^k/v*.

        On the panel at the origin z = t^k, so that y = t (w root)^(1/k) is a smooth function of t.
        """
        z = t**self.form.shift if panel.origin else t
        course = panel.course(z)
        w = power_of_series(course.loss_ratio / course.epsilon, Fraction(1, self.law.d))
        y = self._y(course)
        if panel.work:
            return [w * self.formula.at("ratio", y=y * t if panel.origin else y) - 1]
        # Where y is known less well N and D would each multiply its error by their degrees: it counts by the slope.
        start = y.coeffs()[0]
        value, slope = self.formula.at("ratio", y=arb_series([start, start])).coeffs()[:2]
        # q = F/P - 1, and eps is at most 1/2 but for the error.
        error = 3 * panel.error * ball_of(self.form.root) * abs(slope / value)
        ratio = self.formula.at("ratio", y=self._y(panel.course(z, true=False)))
        return [w * ratio * arb(0, error.abs_upper()).exp() - 1]

    def _y(self, course: Course) -> arb_series:
        """Return y, on the panel at the origin divided by t."""
        w = power_of_series(course.loss_ratio / course.epsilon, Fraction(1, self.law.d))
        return power_of_series(w * course.root, Fraction(1, self.form.shift))
