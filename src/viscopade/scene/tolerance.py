"""The largest errors of a kernel on a scene, in the measures of a tolerance, from its proven bounds.

An error |d eps| of eps has three measures: relative to eps, relative to the lost energy 1 - eps^2, and absolute. All
numbers are fractions, so that no rounding touches a proof.
"""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Mapping, Sequence
from fractions import Fraction
from typing import NamedTuple, TypeVar

from viscopade.arrays.checked import FloatArray
from viscopade.kernels.arithmetic import Arithmetic
from viscopade.kernels.bound import ErrorBound
from viscopade.kernels.kernel import Kernel
from viscopade.scene.description import Tolerance
from viscopade.scene.encounter import Interval

MEASURES = {
    "epsilon": "relative error of eps",
    "dissipation": "relative error of 1 - eps^2",
    "absolute": "error of eps",
}
"""The quantity that each tolerance limits, in words."""
HOPELESS = Fraction(10) ** 30  # stands for an error without a proven bound: any number above all tolerances would do

Errors = Mapping[str, Fraction]
"""The largest error in each of `MEASURES`."""

Value = TypeVar("Value", float, FloatArray)
_HALF, _ONE = Fraction(1, 2), Fraction(1)


class Range(NamedTuple):
    """Ranges in which a kernel is used: of v*, of eps, and of impact speeds in the units of the file."""

    v_star: Interval
    epsilon: Interval
    speeds: Interval


def product_rounding(arithmetic: Arithmetic) -> Fraction:
    """Return the relative error by the three roundings of (1 - eps) (1 + eps); loss (2 - loss) has one less."""
    # 2^-precision for each rounding. Their products are of second order: three of 2^-24 in float, the coarsest format,
    # add at most 3 2^-24 of the sum, which is less than the share 2^-20.
    return 3 * Fraction(2) ** -arithmetic.form.precision * (1 + Fraction(1, 1 << 20))


def errors_on(kernel: Kernel, result: str, arithmetics: Sequence[Arithmetic], ranges: Iterable[Range]) -> Errors | None:
    """Return the largest errors of a kernel's result, "epsilon" or "restitution", and of its 1 - eps^2.

    None: the kernel has no proven error on one of the ranges. The errors hold in all `arithmetics` of the code's
    language, such as host and device, and on all ranges.
    """
    errors_by_range = list[Errors]()
    for arithmetic in arithmetics:
        for where in ranges:
            proven = [errors_of(bound, where.epsilon) for bound in _bounds_on(kernel, result, arithmetic, where)]
            if not proven:
                return None
            # Each bound that holds on the range is proven, so the smallest of them holds, too.
            smallest = {name: min(errors[name] for errors in proven) for name in MEASURES}
            smallest["dissipation"] = min([smallest["dissipation"], *_dissipation_errors(kernel, arithmetic, where)])
            errors_by_range.append(smallest)
    return worst_errors(errors_by_range)


def _bounds_on(kernel: Kernel, result: str, arithmetic: Arithmetic, where: Range) -> Iterator[ErrorBound]:
    """Yield the bounds of a kernel's result that hold in an arithmetic on the whole range of v* and of speeds."""
    for bound in kernel.bound(result, arithmetic.place, arithmetic.form.name):
        slow, fast = bound.speeds or where.speeds
        if bound.covers(*where.v_star) and slow <= where.speeds[0] <= where.speeds[1] <= fast:
            yield bound


def _dissipation_errors(kernel: Kernel, arithmetic: Arithmetic, where: Range) -> Iterator[Fraction]:
    """Yield bounds of the relative error of 1 - eps^2 on a range, for kernels that do not compute it from eps."""
    low, high = where.epsilon
    # The smallest 1 - eps on the range: 1 - high, or v*^2, because 1 - eps = 1.15 v*^2 - … > v*^2 for v* <= 1/10.
    smallest_loss = max(1 - high, min(where.v_star[0], Fraction(1, 10)) ** 2)
    for result, one_plus_eps in (("dissipation", 1 + low), ("one_minus_epsilon", _ONE)):
        # The largest 1 - eps^2, or 1 - eps
        largest = 1 - low ** (1 + (result == "dissipation"))
        for bound in _bounds_on(kernel, result, arithmetic, where):
            # The relative error is that of the smallest value, which is at least the smallest 1 - eps.
            terms = _bound_terms(bound, (smallest_loss * one_plus_eps, largest))
            error = terms.of_smaller + terms.relative + terms.absolute / smallest_loss
            # A bound of 1 - eps^2, or of l = 1 - eps. The second becomes 1 - eps^2 by l (2 - l), whose relative error
            # is at most d (1 + d) for an error d of l, and the roundings.
            yield error if result == "dissipation" else error * (1 + error) + product_rounding(arithmetic)


class _BoundTerms(NamedTuple):
    """|d value| <= of_smaller min(eps, 1 - eps) + relative |value| + absolute."""

    of_smaller: Fraction
    relative: Fraction
    absolute: Fraction


def _bound_terms(bound: ErrorBound, values: Interval) -> _BoundTerms:
    """Return the terms of a bound for results with values in a range."""
    # `bound.relative` is the error of the formula and of rounding; `last`, `ulps` and `absolute` are those of the last
    # rounding, in shares of the value, in ulp, and in smallest numbers of the format.
    of_smaller, relative = (
        (bound.relative, Fraction(0)) if bound.relative_to == "smaller" else (Fraction(0), bound.relative)
    )
    arithmetic, (low, high) = bound.arithmetic, values
    # An ulp relative to a value: at most that of the format, or the ulp of the largest value over the smallest value.
    ulp = min(arithmetic.ulp, arithmetic.form.ulp(high) / low)
    return _BoundTerms(of_smaller, relative + bound.last + bound.ulps * ulp, bound.absolute * arithmetic.form.smallest)


def errors_of(bound: ErrorBound, epsilon: Interval) -> Errors:
    """Return the largest errors of eps, and of (1 - eps) (1 + eps), on a range of eps, by a proven bound of eps.

    The relative error of 1 - eps^2 is |d eps| (2 eps + |d eps|)/((1 - eps) (1 + eps)), which is largest at the largest
    eps. If d eps is relative to min(eps, 1 - eps), the factor 1 - eps cancels for eps >= 1/2.
    """
    (low, high), terms = epsilon, _bound_terms(bound, epsilon)
    # The largest min(eps, 1 - eps) on the range: 1/2 if this is in it, and else at an end.
    smaller = _HALF if low <= _HALF <= high else max(min(e, 1 - e) for e in epsilon)
    # min(eps, 1 - eps)/eps = min(1, (1 - eps)/eps) is largest at the smallest eps.
    errors = {
        "epsilon": terms.of_smaller * min(_ONE, (1 - low) / low) + terms.relative + terms.absolute / low,
        "dissipation": HOPELESS,
        "absolute": terms.of_smaller * smaller + terms.relative * high + terms.absolute,
    }
    if high < 1 or not terms.relative + terms.absolute:  # else eps is 1 to as many digits as it is known
        # d = |d eps|/(1 - eps): the part relative to min(eps, 1 - eps) is over it eps/(1 - eps) below 1/2, and else 1.
        rest = (terms.relative * high + terms.absolute) / (1 - high) if high < 1 else Fraction(0)
        over_loss = terms.of_smaller * (high / (1 - high) if high < _HALF else 1) + rest
        # The error is then d (2 eps + d (1 - eps))/(1 + eps); and the roundings of the product are added.
        error = over_loss * (2 * high + over_loss * (1 - high)) / (1 + high)
        errors["dissipation"] = error + product_rounding(bound.arithmetic) * (1 + error)
    return errors


def in_eps(measure: str, epsilon: Value, loss: Value) -> Value:
    """Return the error of eps, to first order, that corresponds to an error of 1 in a measure; `loss` is 1 - eps."""
    # d eps/eps; d(1 - eps^2)/(1 - eps^2) = 2 eps d eps/((1 - eps) (1 + eps)); and for the absolute error 1, written as
    # eps + loss so that it has the shape of both.
    factors = {"absolute": epsilon + loss, "epsilon": epsilon, "dissipation": loss * (1 + epsilon) / (2 * epsilon)}
    return factors[measure]


def worst_errors(errors_by_range: Iterable[Errors]) -> Errors:
    """Return the largest error in each measure."""
    listed = list(errors_by_range)
    return {name: max(errors[name] for errors in listed) for name in MEASURES}


def excess(errors: Errors, tolerance: Tolerance) -> tuple[Fraction, str]:
    """Return the largest ratio of an error to its tolerance, and the measure; above 1 the tolerance is exceeded."""
    return max((errors[name] / _decimal_of(limit), name) for name, limit in tolerance.limits().items())


def failing(errors: Errors, tolerance: Tolerance) -> tuple[str, ...]:
    """Return the measures in which errors exceed the tolerance."""
    return tuple(name for name, limit in tolerance.limits().items() if errors[name] > _decimal_of(limit))


def allowed(tolerance: Tolerance, ranges: Iterable[Interval]) -> Fraction:
    """Return the largest error relative to min(eps, 1 - eps) within the tolerance, to first order, on ranges of eps.

    All errors are nearly proportional to it; the factors are computed for an error of 2^-30.
    """
    # 2^-30 is so small that terms of second order are below 1e-9 of the first, and exact as a fraction. The bound is on
    # v* from 0 to 1 in name only: `errors_of` uses the ranges of eps.
    unit = Fraction(1, 1 << 30)
    bound = ErrorBound("epsilon", Fraction(0), _ONE, "smaller", unit)
    largest = worst_errors(errors_of(bound, epsilon) for epsilon in ranges)
    return min(_decimal_of(limit) / (largest[name] / unit) for name, limit in tolerance.limits().items())


def _decimal_of(number: float) -> Fraction:
    """Return the shortest decimal of a double, as the user wrote it."""
    return Fraction(repr(number))
