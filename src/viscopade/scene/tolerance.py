"""The largest errors of a kernel on a scene, in the measures of a tolerance, from its proven bounds."""

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
HOPELESS = Fraction(10) ** 30  # an error without a proven bound, above all tolerances; a choice

Errors = Mapping[str, Fraction]
"""The largest error in each of `MEASURES`."""

Value = TypeVar("Value", float, FloatArray)
_HALF, _ONE = Fraction(1, 2), Fraction(1)


class Range(NamedTuple):
    """Ranges in which a kernel is used: of v*, of eps, and of impact speeds in the units of the file."""

    v_star: Interval
    epsilon: Interval
    speeds: Interval


def last_of_product(arithmetic: Arithmetic) -> Fraction:
    """Return the relative error by the three roundings of (1 - eps) (1 + eps); loss (2 - loss) has one less."""
    # 2^-precision for each rounding; the share 2^-20 is more than their products, which are of second order.
    return 3 * Fraction(2) ** -arithmetic.form.precision * (1 + Fraction(1, 1 << 20))


def errors_on(kernel: Kernel, result: str, arithmetics: Sequence[Arithmetic], ranges: Iterable[Range]) -> Errors | None:
    """Return the largest errors of a kernel's result, "epsilon" or "restitution", and of its 1 - eps^2.

    None: the kernel has no proven error on one of the ranges.
    """
    worst = list[Errors]()
    for arithmetic in arithmetics:
        for where in ranges:
            proven = [errors_of(bound, where.epsilon) for bound in _on(kernel, result, arithmetic, where)]
            if not proven:
                return None
            # Each bound that holds on the range is proven, so the smallest of them holds, too.
            least = {name: min(errors[name] for errors in proven) for name in MEASURES}
            least["dissipation"] = min([least["dissipation"], *_dissipation(kernel, arithmetic, where)])
            worst.append(least)
    return worst_errors(worst)


def _on(kernel: Kernel, result: str, arithmetic: Arithmetic, where: Range) -> Iterator[ErrorBound]:
    for bound in kernel.bound(result, arithmetic.place, arithmetic.form.name):
        slow, fast = bound.speeds or where.speeds
        if bound.covers(*where.v_star) and slow <= where.speeds[0] <= where.speeds[1] <= fast:
            yield bound


def _dissipation(kernel: Kernel, arithmetic: Arithmetic, where: Range) -> Iterator[Fraction]:
    """Yield bounds of the relative error of 1 - eps^2, for kernels that do not compute it from eps."""
    low, high = where.epsilon
    least = max(1 - high, min(where.v_star[0], Fraction(1, 10)) ** 2)  # 1 - eps > v*^2 for v* <= 1/10
    for result, factor in (("dissipation", 1 + low), ("one_minus_epsilon", _ONE)):
        for bound in _on(kernel, result, arithmetic, where):
            # A bound of 1 - eps^2 or of 1 - eps; the second becomes 1 - eps^2 by (1 - eps) (2 - (1 - eps)).
            share, relative, tiny = _parts(bound, (least * factor, 1 - low ** (1 + (result == "dissipation"))))
            off = share + relative + tiny / least
            yield off if result == "dissipation" else off * (1 + off) + last_of_product(arithmetic)


def _parts(bound: ErrorBound, values: Interval) -> tuple[Fraction, Fraction, Fraction]:
    """Return the parts of a bound: relative to min(eps, 1 - eps), relative to values in a range, and absolute."""
    share, relative = (bound.relative, Fraction(0)) if bound.relative_to == "smaller" else (Fraction(0), bound.relative)
    arithmetic, (low, high) = bound.arithmetic, values
    # An ulp relative to a value: at most that of the format, or the ulp of the largest value over the smallest value.
    ulp = min(arithmetic.ulp, arithmetic.form.ulp(high) / low)
    return share, relative + bound.last + bound.ulps * ulp, bound.absolute * arithmetic.form.smallest


def errors_of(bound: ErrorBound, epsilon: Interval) -> Errors:
    """Return the largest errors of eps, and of (1 - eps) (1 + eps), on a range of eps.

    The relative error of 1 - eps^2 is |d eps| (2 eps + |d eps|)/((1 - eps) (1 + eps)), which is largest at the largest
    eps. If d eps is relative to min(eps, 1 - eps), the factor 1 - eps cancels for eps >= 1/2.
    """
    (low, high), (share, relative, tiny) = epsilon, _parts(bound, epsilon)
    # The largest min(eps, 1 - eps) on the range.
    smaller = _HALF if low <= _HALF <= high else max(min(e, 1 - e) for e in epsilon)
    errors = {
        "epsilon": share * min(_ONE, (1 - low) / low) + relative + tiny / low,
        "dissipation": HOPELESS,
        "absolute": share * smaller + relative * high + tiny,
    }
    if high < 1 or not relative + tiny:  # else eps is 1 to as many digits as it is known
        # |d eps|/(1 - eps): the part relative to min(eps, 1 - eps) is over it eps/(1 - eps) below 1/2, and else 1.
        rest = (relative * high + tiny) / (1 - high) if high < 1 else Fraction(0)
        over_loss = share * (high / (1 - high) if high < _HALF else 1) + rest
        # With d = |d eps|/(1 - eps), the error is d (2 eps + d (1 - eps))/(1 + eps); then the roundings of the product.
        off = over_loss * (2 * high + over_loss * (1 - high)) / (1 + high)
        errors["dissipation"] = off + last_of_product(bound.arithmetic) * (1 + off)
    return errors


def in_eps(measure: str, epsilon: Value, loss: Value) -> Value:
    """Return the error of eps, to first order, that corresponds to an error of 1 in a measure."""
    # d(1 - eps^2)/(1 - eps^2) = 2 eps d eps/((1 - eps) (1 + eps)), with 1 = eps + loss for the absolute error.
    factors = {"absolute": epsilon + loss, "epsilon": epsilon, "dissipation": loss * (1 + epsilon) / (2 * epsilon)}
    return factors[measure]


def worst_errors(errors_by_range: Iterable[Errors]) -> Errors:
    """Return the largest error in each measure."""
    listed = list(errors_by_range)
    return {name: max(errors[name] for errors in listed) for name in MEASURES}


def excess(errors: Errors, tolerance: Tolerance) -> tuple[Fraction, str]:
    """Return the largest ratio of an error to its tolerance, and the measure; above 1 the tolerance is exceeded."""
    return max((errors[name] / _exact(limit), name) for name, limit in tolerance.limits().items())


def failing(errors: Errors, tolerance: Tolerance) -> tuple[str, ...]:
    """Return the measures in which errors exceed the tolerance."""
    return tuple(name for name, limit in tolerance.limits().items() if errors[name] > _exact(limit))


def allowed(tolerance: Tolerance, ranges: Iterable[Interval]) -> Fraction:
    """Return the largest error relative to min(eps, 1 - eps) within the tolerance, to first order, on ranges of eps.

    All errors are nearly proportional to it; the factors are computed for an error of 2^-30.
    """
    unit = Fraction(1, 1 << 30)
    bound = ErrorBound("epsilon", Fraction(0), _ONE, "smaller", unit)
    largest = worst_errors(errors_of(bound, epsilon) for epsilon in ranges)
    return min(_exact(limit) / (largest[name] / unit) for name, limit in tolerance.limits().items())


def _exact(number: float) -> Fraction:
    """Return the shortest decimal of a double, as the user wrote it."""
    return Fraction(repr(number))
