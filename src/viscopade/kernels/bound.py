"""The one type of a proven error: how far a computed result may be from the exact one."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass, replace
from fractions import Fraction
from operator import attrgetter
from typing import Literal

from viscopade.kernels.arithmetic import HOST, Arithmetic

End = Fraction | float
"""The end of a range; the float is infinity."""
RelativeTo = Literal["smaller", "value"]


@dataclass(frozen=True)
class ErrorBound:
    """Bound of the error of one result on one range, in one arithmetic.

    With smaller = min(eps, 1 - eps) and value = the exact result,

        |computed - exact| <= (formula + rounding) * reference + last * |value| + ulps * ulp(value) + absolute * tiny,

    where the reference is `smaller` or |value|, and tiny the smallest positive number of the format (for rebound, times
    a speed above 1). The ulp is taken at the result before its last rounding, which may be beyond a power
    of two that the exact one is below. The bound holds without `absolute` where the numbers of `normal` are normal
    ones; files state it so. All numbers are exact; a file rounds them up.

    Attributes
    ----------
    result : str
        The name of a function of the kernel: "epsilon", "restitution", "rebound", "dissipation", "v_star", …
    low, high : Fraction, or infinity as a float
        The range of the exact v*.
    relative_to : str
        What `formula` and `rounding` are relative to: "smaller" or "value". (For rebound both are times the speed.)
    formula : Fraction
        The error of the formula with its coefficients, evaluated exactly.
    rounding, last, ulps : Fraction
        What rounding adds.
    absolute : Fraction
        What underflow adds to results, or to the eps of rebound, that are no normal numbers.
    arithmetic : Arithmetic
        The machine and the type: what is assumed of its operations.
    speeds : pair of Fraction, or None
        The range of speeds, if the bound is only for some.
    branch : int or None
        The branch of the function (`machine.values_and_branches`), if the bound is only for arguments that lead to it.
    """

    result: str
    low: Fraction
    high: End
    relative_to: RelativeTo
    formula: Fraction
    rounding: Fraction = Fraction(0)
    last: Fraction = Fraction(0)
    ulps: Fraction = Fraction(0)
    absolute: Fraction = Fraction(0)
    arithmetic: Arithmetic = HOST
    speeds: tuple[Fraction, Fraction] | None = None
    branch: int | None = None

    def __post_init__(self) -> None:
        """Refuse numbers that no bound can have."""
        # Records and callers write bounds: an empty range, or a float among the exact numbers, is a mistake.
        if not 0 <= self.low < self.high:
            raise ValueError(f"the range is [{self.low}, {self.high}]: expected 0 <= low < high")
        sizes = self.formula, self.rounding, self.last, self.ulps, self.absolute
        if {*map(type, sizes)} != {Fraction} or min(sizes) < 0:
            raise ValueError("the parts of a bound must be fractions >= 0")

    @property
    def relative(self) -> Fraction:
        """What the error is relative to the reference, without `last`, `ulps` and `absolute`."""
        return self.formula + self.rounding

    @property
    def normal(self) -> tuple[str, ...]:
        """What must be a normal number, so that the bound holds without `absolute`."""
        return (*["eps"] * (self.result == "rebound"), "the result") if self.absolute else ()

    def holds_at(self, v_star: Fraction, speed: Fraction | None = None) -> bool:
        """Return whether the bound is stated for this v*, and for this speed if it is only for some speeds."""
        fast = self.speeds is None or (speed is not None and self.speeds[0] <= speed <= self.speeds[1])
        return self.low <= v_star <= self.high and fast

    def allowed(self, value: Fraction, smaller: Fraction, speed: Fraction | None = None) -> Fraction:
        """Return the largest error, given upper bounds of |exact result| and of min(eps, 1 - eps).

        `speed` is that of a rebound, whose result is eps speed.
        """
        form = self.arithmetic.form
        reference = value if self.relative_to == "value" else smaller
        # An eps that underflows is off by at most `absolute` smallest numbers, which rebound multiplies by the speed; a
        # product below 1 may underflow itself.
        tiny = form.smallest * (max(speed or Fraction(1), Fraction(1)) if self.result == "rebound" else 1)
        # The class's formula. The ulp is that of the result before its last rounding, at most value + before_rounding.
        before_rounding = (self.formula + self.rounding) * reference + self.last * value + self.absolute * tiny
        if not self.ulps or not value + before_rounding:
            return before_rounding
        return before_rounding + self.ulps * form.ulp(value + before_rounding)

    def covers(self, low: Fraction, high: End) -> bool:
        """Return whether the bound covers low <= v* <= high."""
        return self.low <= low and high <= self.high


INFINITY = math.inf


def weakest(bounds: Sequence[ErrorBound]) -> ErrorBound:
    """Return a bound on the range of the first one that holds wherever one of the bounds does."""
    sizes = "formula", "rounding", "last", "ulps", "absolute"
    return replace(bounds[0], **{name: max(map(attrgetter(name), bounds)) for name in sizes})
