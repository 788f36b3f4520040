r"""The rounding analysis of all kernels: numbers that carry bounds of their own rounding errors, in ball arithmetic.

Run with `Rounded` numbers, a program (`expressions`) encloses its results and bounds their errors:

    computed = exact (1 + theta) + alpha,    |theta| <= relative,    |alpha| <= underflow,
    |computed - exact| <= absolute.

Both hold; each operation carries both on and takes the smaller where one follows from the other. The relative bound is
good for quotients and products, and holds down to 0, where alpha comes from results that underflow. The absolute one is
good for sums that nearly vanish, and counts in units in the last place: half of the unit of the largest number that an
operation's result can be. Operations round to nearest. That a product and a sum may be fused to one operation only
makes errors smaller, and so does a wider format.

The model of one operation is docs/theory/certificates.md, step 3: fl(x) = x (1 + d) + e, |d| <= u = 2^-p with p the
bits of the significand, and |e| at most half of the smallest positive number.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from fractions import Fraction
from functools import cache, lru_cache

from flint import arb

from viscopade.arithmetic.balls import ball_of
from viscopade.arithmetic.formats import Format
from viscopade.kernels.expressions import CodeBranch, Reading, read

_ZERO, _INFINITE = arb(0), arb.pos_inf()


class Rounded:
    """A rounded number of a type: an enclosure of its exact value, bounds of its error, and its slope.

    To be used within `balls.working`.

    Attributes
    ----------
    value : flint.arb
        Encloses the exact values.
    form : Format
        The type, double or float.
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
        """Make an input from its exact value, its relative error, and d ln|value|/d ln y; nothing has underflowed."""
        self.value, self.form = value, form
        self.relative, self.underflow = arb(relative), arb(0)
        # |computed - exact| = |exact theta|
        self.absolute = value.abs_upper() * self.relative
        self.slope = arb(slope)
        # d value/d ln y = value d ln|value|/d ln y
        self.change = value * self.slope

    def __add__(self, other: Rounded) -> Rounded:
        # A sum or difference of numbers of a type that is subnormal is exact: nothing is lost to underflow.
        return self.exact_sum(other)._rounded(_ZERO)

    def __sub__(self, other: Rounded) -> Rounded:
        return self + -other

    def __neg__(self) -> Rounded:
        return self._with(-self.value, self.relative, self.underflow, self.absolute, -self.change, self.slope)

    def __mul__(self, other: Rounded) -> Rounded:
        return self.exact_product(other)._rounded(_half_smallest(self.form))

    def __truediv__(self, other: Rounded) -> Rounded:
        return self.exact_quotient(other)._rounded(_half_smallest(self.form))

    # Operations that are exact, so that only the errors of their operands count.

    def exact_sum(self, other: Rounded) -> Rounded:
        """Return the sum with `other` if the operation is exact: only the errors of the two terms count."""
        value, change = self.value + other.value, self.change + other.change
        absolute = self.absolute + other.absolute
        smallest_sum = value.abs_lower()
        # A sum that may vanish has no relative error and no slope of its logarithm.
        if not smallest_sum > 0:
            return self._with(value, _INFINITE, _ZERO, absolute, change, _INFINITE)

        # With the portions p = x/(x + y) and q = y/(x + y) the sum's relative error is p theta_x + q theta_y.
        self_portion, other_portion = _portion(self.value, other.value), _portion(other.value, self.value)
        self_relative, self_underflow = self._in_sum(self_portion, smallest_sum)
        other_relative, other_underflow = other._in_sum(other_portion, smallest_sum)
        relative, underflow = self_relative + other_relative, self_underflow + other_underflow

        # Of terms >= 0 the portions are >= 0 and p + q = 1: the error is a mean, at most the larger of both.
        if self.value >= 0 and other.value >= 0:
            larger = max(self.relative, other.relative)
            if larger < relative:
                relative, underflow = larger, self.underflow + other.underflow

        # d ln|x + y| = p d ln|x| + q d ln|y|, written with one portion, as a ball that occurs twice widens the result.
        # Where a term's slope is not known, or that ball is wide: (dx + dy)/(x + y).
        from_slopes, from_changes = self.slope + (other.slope - self.slope) * other_portion, change / value
        narrower = from_slopes.is_finite() and from_slopes.rad() < from_changes.rad()
        return self._with(value, relative, underflow, absolute, change, from_slopes if narrower else from_changes)

    def exact_product(self, other: Rounded) -> Rounded:
        """Return the product with `other` if the operation is exact: only the errors of the two factors count."""
        # d(x y) = y dx + x dy and d ln|x y| = d ln|x| + d ln|y|, or d(x y)/(x y) where one of them is not known.
        value, change = self.value * other.value, self.change * other.value + self.value * other.change
        slope = self.slope + other.slope
        if not slope.is_finite() and not value.contains(0):
            slope = change / value

        # |(x + dx)(y + dy) - x y| <= |x| |dy| + |y| |dx| + |dx| |dy|
        size, other_size = self.value.abs_upper(), other.value.abs_upper()
        absolute = size * other.absolute + other_size * self.absolute + self.absolute * other.absolute
        if not (self.relative.is_finite() and other.relative.is_finite()):
            return self._with(value, _INFINITE, _ZERO, absolute, change, slope)

        # (x (1 + theta_x) + alpha_x)(y (1 + theta_y) + alpha_y): what has no alpha is relative, the rest underflow.
        relative = (1 + self.relative) * (1 + other.relative) - 1
        largest, other_largest = size * (1 + self.relative), other_size * (1 + other.relative)
        underflow = self.underflow * other_largest + other.underflow * (largest + self.underflow)
        return self._with(value, relative, underflow, absolute, change, slope)

    def exact_quotient(self, other: Rounded) -> Rounded:
        """Return the quotient by `other` if the operation is exact: only the errors of numerator and denominator count.

        Raises
        ------
        ArithmeticError
            If the denominator may vanish within its rounding error.
        """
        least_denominator = other.value.abs_lower()
        if not least_denominator > 0:
            raise ArithmeticError("a denominator may vanish within its rounding error")
        # The least |computed y|/|y|: 1 minus the relative error, of the two bounds the one that leaves more.
        from_absolute = 1 - other.absolute / least_denominator
        from_relative = 1 - other.relative - other.underflow / least_denominator
        remaining = from_absolute.lower()
        if from_relative.is_finite():
            remaining = max(remaining, from_relative.lower())
        remaining = arb(remaining)
        if not remaining > 0:
            raise ArithmeticError("a denominator may vanish within its rounding error")

        # d(x/y) = (dx - (x/y) dy)/y; as an error, with the computed y, which is at least |y| remaining, below the line.
        value = self.value / other.value
        change = (self.change - value * other.change) / other.value
        absolute = (self.absolute + value.abs_upper() * other.absolute) / (least_denominator * remaining)
        slope = self.slope - other.slope
        if not self.relative.is_finite():
            return self._with(value, _INFINITE, _ZERO, absolute, change, slope)

        # (x (1 + theta_x) + alpha_x)/(y remaining): the least y makes the quotient larger by a factor 1/remaining, and
        # the largest one makes it smaller by less.
        relative, underflow = (1 + self.relative) / remaining - 1, self.underflow / (least_denominator * remaining)
        return self._with(value, relative, underflow, absolute, change, slope)

    def _in_sum(self, portion: arb, smallest_sum: arb) -> tuple[arb, arb]:
        """Return what this term adds to a sum's error: a relative error, and an absolute one by underflow.

        `portion` encloses term/sum, and `smallest_sum` is a lower bound of |sum|. Of portion times the term's relative
        error, and of the term's absolute error over the sum (which includes underflow), the smaller is taken.
        """
        from_absolute = self.absolute / smallest_sum
        if self.relative.is_finite():
            from_relative = portion.abs_upper() * self.relative
            if from_relative <= from_absolute:
                return from_relative, self.underflow
        return from_absolute, _ZERO

    def _with(self, value: arb, relative: arb, underflow: arb, absolute: arb, change: arb, slope: arb) -> Rounded:
        """Return a number of the same type with these attributes; bounds become upper bounds of their balls."""
        result = object.__new__(Rounded)
        result.value, result.form, result.change, result.slope = value, self.form, change, slope
        result.relative, result.underflow = relative.abs_upper(), underflow.abs_upper()
        result.absolute = absolute.abs_upper()
        return result._settled()

    def _settled(self) -> Rounded:
        """Return this number after each of its two bounds was made at most what follows from the other."""
        # |error| <= absolute <= (absolute/least |value|) |value|; this contains what underflow did.
        least = self.value.abs_lower()
        if least > 0 and (from_absolute := self.absolute / least) < self.relative:
            self.relative, self.underflow = from_absolute.abs_upper(), _ZERO
        # |error| = |value theta + alpha|
        if self.relative.is_finite():
            from_relative = self.value.abs_upper() * self.relative + self.underflow
            self.absolute = min(self.absolute, from_relative).abs_upper()
        return self

    def _rounded(self, underflow_of_result: arb) -> Rounded:
        """Return this number after the rounding of an operation was added to its errors.

        `underflow_of_result` is what the operation may lose to underflow: half of the smallest positive number, or 0.
        """
        # The computed number before rounding is at most |value| + absolute: half a unit of that bounds the rounding.
        half_ulp = half_unit(self.value.abs_upper() + self.absolute, self.form)
        least = self.value.abs_lower()
        self.absolute = (self.absolute + half_ulp).abs_upper()

        if self.relative.is_finite():
            # fl(x) = x (1 + d) + e with x = value (1 + theta) + alpha: d adds u (1 + theta) to theta, and u alpha to
            # alpha. Half a unit over the least value may be smaller, and contains e: it is never below half of the
            # smallest number.
            unit_roundoff = _power_of_two(-self.form.precision)
            from_unit = unit_roundoff * (1 + self.relative)
            if least > 0 and half_ulp < from_unit * least:
                self.relative = (self.relative + half_ulp / least).abs_upper()
            else:
                self.relative = (self.relative + from_unit).abs_upper()
                self.underflow = (self.underflow * (1 + unit_roundoff) + underflow_of_result).abs_upper()
        return self._settled()

    def with_error(self, relative: arb) -> Rounded:
        """Return an exact operation's result with the operation's own relative error instead of a rounding's.

        `relative` bounds the error of, for example, a library's cbrt. A result that underflows is off by as many units
        of the last place more, which are the smallest positive number there, and by half of one at least.
        """
        units = (relative / _power_of_two(1 - self.form.precision)).max(arb("0.5"))
        subnormal = 2 * units * _half_smallest(self.form)
        # computed (1 + r) + e, with computed = value (1 + theta) + alpha
        total_relative = (1 + self.relative) * (1 + relative) - 1
        underflow = self.underflow * (1 + relative) + subnormal
        absolute = self.absolute * (1 + relative) + self.value.abs_upper() * relative + subnormal
        return self._with(self.value, total_relative, underflow, absolute, self.change, self.slope)

    def with_absolute_error(self, absolute: arb) -> Rounded:
        """Return the number with a further error of at most `absolute`; its relative bound follows from the sum."""
        return self._with(self.value, _INFINITE, _ZERO, self.absolute + absolute, self.change, self.slope)

    def with_error_of_y(self, error: arb) -> Rounded:
        """Return the number with the further error, by its slope, of an error of at most `error` in ln y.

        Raises
        ------
        ArithmeticError
            If the number is the result of a sum that may vanish.
        """
        if not (self.relative.is_finite() and self.slope.is_finite()):
            raise ArithmeticError("a sum may vanish")
        # ln|value| changes by at most |slope| error, so the value by at most this factor.
        factor = (self.slope.abs_upper() * error).exp()
        relative = (1 + self.relative) * factor - 1
        absolute = self.absolute + self.value.abs_upper() * (factor - 1)
        return self._with(self.value, relative, self.underflow, absolute, self.change, self.slope)


def half_unit(largest: arb, form: Format) -> arb:
    """Return half a unit in the last place of numbers up to `largest`, which bounds the rounding of an operation."""
    if largest == 0:
        return _ZERO
    # mantissa 2^exponent, whose leading bit is 2^(exponent + bits - 1). The last of p bits is p - 1 places below, half
    # of it p places.
    upper = largest.abs_upper()
    place = int(upper.man_exp()[1]) + upper.bits() - 1 - form.precision
    # Subnormal numbers all have one unit, the smallest number 2^(2 - largest exponent - p); this is half of it.
    return _power_of_two(max(place, 1 - form.largest - form.precision))


def _portion(part: arb, rest: arb) -> arb:
    """Enclose part/(part + rest), and closely where one of the two is much smaller than the other."""
    # Each ball occurs once in 1/(1 + rest/part); where `part` may be 0 this fails, and the plain quotient holds.
    enclosure = 1 / (1 + rest / part)
    return enclosure if enclosure.is_finite() else part / (part + rest)


# 16: there are two formats, each of which is a key once.
@lru_cache(maxsize=16)
def _half_smallest(form: Format) -> arb:
    """Return half of the smallest positive number of a type: what rounding to nearest may lose to underflow."""
    return ball_of(form.smallest) / 2


# 2^12: more than the 2,098 binary exponents of doubles, so that no power is made twice.
@lru_cache(maxsize=1 << 12)
def _power_of_two(exponent: int) -> arb:
    return arb(2) ** exponent


# --- programs ---------------------------------------------------------------------------------------------------------


# 16: the two formats without functions are asked for again and again; functions are mostly closures, which come once.
@lru_cache(maxsize=16)
def rounded_reading(form: Format, **functions: Callable[..., Rounded]) -> Reading:
    """Return how programs are read with rounded numbers of a type.

    `functions` are those that the programs call, by name, on `Rounded` numbers. Literals are rounded to the type, and
    the formula counts with the rounded number: a literal has no error.
    """

    @cache
    def literal(text: str) -> Rounded:
        return Rounded(arb(form.nearest(Fraction(text))), form)

    # Operations that a program marks as exact (`expressions.Exact`) add no rounding.
    exactly = {"+": Rounded.exact_sum, "*": Rounded.exact_product, "/": Rounded.exact_quotient}
    return Reading(literal, functions, exactly=exactly)


def rounded_results(
    branch: CodeBranch, names: Sequence[str], inputs: Mapping[str, Rounded], form: Format
) -> dict[str, Rounded]:
    """Return results or variables of a branch that calls no function, by name.

    `inputs` are the branch's inputs, constants and roots by name, with their errors.
    """
    return read(branch, names, inputs, rounded_reading(form))
