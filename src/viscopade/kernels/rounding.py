r"""The rounding analysis of all kernels: numbers that carry bounds of their own rounding errors, in ball arithmetic.

Run with `Rounded` numbers, a program (`expressions`) encloses its results and bounds their errors:

    computed = exact (1 + theta) + alpha,    |theta| <= relative,    |alpha| <= underflow,
    |computed - exact| <= absolute.

Both hold; each operation carries both on and takes the smaller where one follows from the other. The relative bound is
good for quotients and products, and holds down to 0, where alpha comes from results that underflow. The absolute one is
good for sums that nearly vanish, and counts in units in the last place: half of the unit of the largest number that an
operation's result can be. Operations round to nearest. That a product and a sum may be fused to one operation only
makes errors smaller, and so does a wider format.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from fractions import Fraction
from functools import cache, lru_cache

from flint import arb

from viscopade.arithmetic.balls import ball_of
from viscopade.arithmetic.formats import Format
from viscopade.kernels.expressions import CodeBranch, Reading, read

_NOTHING, _INFINITE = arb(0), arb.pos_inf()


class Rounded:
    """A rounded number of a type: an enclosure of its exact value, bounds of its error, and its slope.

    To be used within `balls.working`.

    Attributes
    ----------
    value : flint.arb
        Encloses the exact values.
    form : Format
    relative, underflow : flint.arb
        Bounds of the error: relative, and absolute where it comes from results that underflow. `relative` is infinite
        where the value may vanish.
    absolute : flint.arb
        A bound of the whole error.
    change, slope : flint.arb
        Enclose d value/d ln y and d ln|value|/d ln y, where y is the number whose slope was given as 1. The slope is
        infinite where it is not known.
    """

    def __init__(self, value: arb, form: Format, relative: arb | int = 0, slope: arb | int = 0) -> None:
        self.value, self.form = value, form
        self.relative, self.underflow = arb(relative), arb(0)
        self.absolute = value.abs_upper() * self.relative
        self.slope = arb(slope)
        self.change = value * self.slope

    def __add__(self, other: Rounded) -> Rounded:
        return self.exact_sum(other)._rounded(_NOTHING)

    def __sub__(self, other: Rounded) -> Rounded:
        return self + -other

    def __neg__(self) -> Rounded:
        return self._with(-self.value, self.relative, self.underflow, self.absolute, -self.change, self.slope)

    def __mul__(self, other: Rounded) -> Rounded:
        return self.exact_product(other)._rounded(_half(self.form))

    def __truediv__(self, other: Rounded) -> Rounded:
        return self.exact_quotient(other)._rounded(_half(self.form))

    # Operations that are exact, so that only the errors of their operands count.

    def exact_sum(self, other: Rounded) -> Rounded:
        """Return the sum if it is exact."""
        value, change = self.value + other.value, self.change + other.change
        absolute = self.absolute + other.absolute
        least = value.abs_lower()
        if not least > 0:
            return self._with(value, _INFINITE, _NOTHING, absolute, change, _INFINITE)
        of_self, of_other = _portion(self.value, other.value), _portion(other.value, self.value)
        relative, underflow = self._in_sum(of_self, least)
        more, more_underflow = other._in_sum(of_other, least)
        relative, underflow = relative + more, underflow + more_underflow
        if self.value >= 0 and other.value >= 0:
            larger, of_both = max(self.relative, other.relative), self.underflow + other.underflow
            if larger < relative:
                relative, underflow = larger, of_both
        slope = _narrower(self.slope + (other.slope - self.slope) * of_other, change / value)
        return self._with(value, relative, underflow, absolute, change, slope)

    def exact_product(self, other: Rounded) -> Rounded:
        """Return the product if it is exact."""
        value, change = self.value * other.value, self.change * other.value + self.value * other.change
        slope = self.slope + other.slope
        if not slope.is_finite() and not value.contains(0):
            slope = change / value
        size, other_size = self.value.abs_upper(), other.value.abs_upper()
        absolute = size * other.absolute + other_size * self.absolute + self.absolute * other.absolute
        if not (self.relative.is_finite() and other.relative.is_finite()):
            return self._with(value, _INFINITE, _NOTHING, absolute, change, slope)
        relative = (1 + self.relative) * (1 + other.relative) - 1
        of_self, of_other = size * (1 + self.relative), other_size * (1 + other.relative)
        underflow = self.underflow * of_other + other.underflow * (of_self + self.underflow)
        return self._with(value, relative, underflow, absolute, change, slope)

    def exact_quotient(self, other: Rounded) -> Rounded:
        """Return the quotient if it is exact.

        Raises
        ------
        ArithmeticError
            If the denominator may vanish within its rounding error.
        """
        least = other.value.abs_lower()
        if not least > 0:
            raise ArithmeticError("a denominator may vanish within its rounding error")
        # What is left of the least denominator: of the two bounds, the one that leaves more.
        by_size = 1 - other.absolute / least
        by_ratio = 1 - other.relative - other.underflow / least
        left = arb(max(by_size.lower(), by_ratio.lower()) if by_ratio.is_finite() else by_size.lower())
        if not left > 0:
            raise ArithmeticError("a denominator may vanish within its rounding error")
        value = self.value / other.value
        change = (self.change - value * other.change) / other.value
        absolute = (self.absolute + value.abs_upper() * other.absolute) / (least * left)
        slope = self.slope - other.slope
        if not self.relative.is_finite():
            return self._with(value, _INFINITE, _NOTHING, absolute, change, slope)
        relative, underflow = (1 + self.relative) / left - 1, self.underflow / (least * left)
        return self._with(value, relative, underflow, absolute, change, slope)

    def _in_sum(self, portion: arb, least: arb) -> tuple[arb, arb]:
        """Return what the number's error is in relation to a sum: a relative error and one by underflow."""
        by_size = self.absolute / least
        if self.relative.is_finite():
            by_ratio = portion.abs_upper() * self.relative
            if by_ratio <= by_size:
                return by_ratio, self.underflow
        return by_size, _NOTHING

    def _with(self, value: arb, relative: arb, underflow: arb, absolute: arb, change: arb, slope: arb) -> Rounded:
        result = object.__new__(Rounded)
        result.value, result.form, result.change, result.slope = value, self.form, change, slope
        result.relative, result.underflow = relative.abs_upper(), underflow.abs_upper()
        result.absolute = absolute.abs_upper()
        return result._settled()

    def _settled(self) -> Rounded:
        """Make each of the two bounds at most what follows from the other."""
        least = self.value.abs_lower()
        if least > 0 and (by_size := self.absolute / least) < self.relative:
            self.relative, self.underflow = by_size.abs_upper(), _NOTHING
        if self.relative.is_finite():
            self.absolute = min(self.absolute, self.value.abs_upper() * self.relative + self.underflow).abs_upper()
        return self

    def _rounded(self, half: arb) -> Rounded:
        """Add the rounding of an operation; `half` is what it may lose to underflow."""
        unit = _power_of_two(-self.form.precision)
        most = half_unit(self.value.abs_upper() + self.absolute, self.form)
        least = self.value.abs_lower()
        self.absolute = (self.absolute + most).abs_upper()
        if self.relative.is_finite():
            by_ratio = unit * (1 + self.relative)
            if least > 0 and most < by_ratio * least:
                self.relative = (self.relative + most / least).abs_upper()
            else:
                self.relative = (self.relative + by_ratio).abs_upper()
                self.underflow = (self.underflow * (1 + unit) + half).abs_upper()
        return self._settled()

    def with_error(self, relative: arb) -> Rounded:
        """Return the exact result of an operation with the error of that operation instead of a rounding's."""
        more = (1 + self.relative) * (1 + relative) - 1
        underflow = self.underflow * (1 + relative) + _half(self.form)
        absolute = self.absolute * (1 + relative) + self.value.abs_upper() * relative + _half(self.form)
        return self._with(self.value, more, underflow, absolute, self.change, self.slope)

    def with_absolute_error(self, absolute: arb) -> Rounded:
        """Return the number with a further error."""
        return self._with(self.value, _INFINITE, _NOTHING, self.absolute + absolute, self.change, self.slope)

    def with_error_of_y(self, error: arb) -> Rounded:
        """Return the number with the further error, by its slope, of an error of at most `error` in ln y.

        Raises
        ------
        ArithmeticError
            If the number is the result of a sum that may vanish.
        """
        if not (self.relative.is_finite() and self.slope.is_finite()):
            raise ArithmeticError("a sum may vanish")
        moved = (self.slope.abs_upper() * error).exp()
        relative = (1 + self.relative) * moved - 1
        absolute = self.absolute + self.value.abs_upper() * (moved - 1)
        return self._with(self.value, relative, self.underflow, absolute, self.change, self.slope)


def half_unit(largest: arb, form: Format) -> arb:
    """Return half a unit in the last place of numbers up to `largest`, which bounds the rounding of an operation."""
    if largest == 0:
        return _NOTHING
    upper = largest.abs_upper()
    place = int(upper.man_exp()[1]) + upper.bits() - 1 - form.precision
    return _power_of_two(max(place, 1 - form.largest - form.precision))


def _portion(part: arb, rest: arb) -> arb:
    """Enclose part/(part + rest), and closely where one of the two is much smaller than the other."""
    found = 1 / (1 + rest / part)
    return found if found.is_finite() else part / (part + rest)


def _narrower(one: arb, other: arb) -> arb:
    return one if one.is_finite() and one.rad() < other.rad() else other


@lru_cache(maxsize=16)
def _half(form: Format) -> arb:
    return ball_of(form.smallest) / 2


@lru_cache(maxsize=1 << 12)
def _power_of_two(exponent: int) -> arb:
    return arb(2) ** exponent


# --- programs ---------------------------------------------------------------------------------------------------------


@lru_cache(maxsize=16)
def rounded_reading(form: Format, **functions: Callable[..., Rounded]) -> Reading:
    """Return how programs are read with rounded numbers of a type; `functions` are those that they call."""

    @cache
    def literal(text: str) -> Rounded:
        return Rounded(arb(form.nearest(Fraction(text))), form)

    exactly = {"+": Rounded.exact_sum, "*": Rounded.exact_product, "/": Rounded.exact_quotient}
    return Reading(literal, functions, exactly=exactly)


def rounded_results(
    branch: CodeBranch, names: Sequence[str], given: Mapping[str, Rounded], form: Format
) -> dict[str, Rounded]:
    """Return results or variables of a branch that calls no function, given its inputs, constants and roots."""
    return read(branch, names, given, rounded_reading(form))
