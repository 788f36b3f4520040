r"""Straight-line programs: one source for the text of exported code and for the bound of its rounding errors.

A program is a sequence of assignments. `targets.syntax` writes an expression in the syntax of a language; `run_program`
evaluates the program with any numbers that can be added, multiplied and divided. Run with `Rounded` numbers, the same
sequence of operations gives a bound of what rounding does to the result:

    computed = exact (1 + theta) + alpha,    |theta| <= relative,    |alpha| <= absolute,

where alpha comes from results that underflow and is a few of the smallest numbers of the type. The relative part does
not depend on the size of the numbers, so that it holds down to 0 (other than in `last_place`, where errors are counted
in units of the last place of the largest number). Powers of y and lacunary polynomials are made here, too.
"""

from __future__ import annotations

from collections.abc import Callable, Iterable, Mapping, Sequence
from dataclasses import dataclass
from fractions import Fraction
from functools import lru_cache
from itertools import count, pairwise
from typing import Any, NamedTuple

from flint import arb

from viscopade.arithmetic.balls import ball_of
from viscopade.arithmetic.formats import Format

# --- expressions ------------------------------------------------------------------------------------------------------


class Expression:
    """An expression, the right-hand side of an assignment."""

    def __add__(self, other: Expression) -> Expression:
        return Operation("+", self, other)

    def __mul__(self, other: Expression) -> Expression:
        return Operation("*", self, other)

    def __truediv__(self, other: Expression) -> Expression:
        return Operation("/", self, other)


@dataclass(frozen=True)
class Name(Expression):
    """A name in a program: an input, a constant, or an assigned variable."""

    name: str


@dataclass(frozen=True)
class Literal(Expression):
    """A decimal number, rounded to the type."""

    text: str


@dataclass(frozen=True)
class Operation(Expression):
    """One operation, which rounds once."""

    symbol: str
    left: Expression
    right: Expression


@dataclass(frozen=True)
class Call(Expression):
    """A call of a function of math.h."""

    function: str
    arguments: tuple[Expression, ...]


class Statement(NamedTuple):
    """An assignment."""

    name: str
    expression: Expression


Program = tuple[Statement, ...]


def run_program(
    program: Program,
    given: Mapping[str, Any],
    literal: Callable[[str], Any],
    functions: Mapping[str, Callable[..., Any]] | None = None,
) -> dict[str, Any]:
    """Evaluate a program with any kind of numbers and return all values by name.

    Parameters
    ----------
    program : Program
    given : mapping
        Inputs and constants, and those of the assigned names that shall not be computed.
    literal : callable
        From a literal's text to a number.
    functions : mapping, optional
        The functions called, by name.
    """
    values = dict(given)
    for name, expression in program:
        if name not in given:
            values[name] = evaluate(expression, values, literal, functions)
    return values


def evaluate(
    expression: Expression,
    values: Mapping[str, Any],
    literal: Callable[[str], Any],
    functions: Mapping[str, Callable[..., Any]] | None = None,
) -> Any:
    """Evaluate an expression; parameters as for `run_program`."""
    match expression:
        case Name(name):
            return values[name]
        case Literal(number):
            return literal(number)
        case Call(function, arguments):
            return (functions or {})[function](*(evaluate(part, values, literal, functions) for part in arguments))
        case Operation(symbol, left, right):
            x, y = (evaluate(part, values, literal, functions) for part in (left, right))
            return x + y if symbol == "+" else x * y if symbol == "*" else x / y
    raise TypeError(f"{expression!r} is no expression")


# --- powers and lacunary polynomials ----------------------------------------------------------------------------------


class Step(NamedTuple):
    """One multiplication: y^power = y^left y^right."""

    power: int
    left: int
    right: int


@lru_cache(maxsize=256)
def chain(wanted: frozenset[int]) -> tuple[Step, ...]:
    """Return a shortest sequence of multiplications, in ascending order, that ends with all wanted powers.

    Raises
    ------
    ValueError
        If a power is below 1.
    """
    if any(power < 1 for power in wanted):
        raise ValueError(f"powers are {sorted(wanted)}: accepted are whole numbers >= 1")
    rest = tuple(sorted(wanted - {1}))
    return next(found for steps in count(len(rest)) if (found := _chain((1,), rest, steps)) is not None)


def _chain(have: tuple[int, ...], missing: tuple[int, ...], steps: int) -> tuple[Step, ...] | None:
    """Return at most `steps` multiplications that lead to the missing powers, or None."""
    if not missing:
        return ()
    if len(missing) > steps or have[-1] << steps < missing[-1]:
        return None
    sums = {x + y: (y, x) for x in have for y in have if x <= y and have[-1] < x + y <= missing[0]}
    for power in sorted(sums, reverse=True):
        left = missing[1:] if power == missing[0] else missing
        found = _chain((*have, power), left, steps - 1)
        if found is not None:
            return (Step(power, *sums[power]), *found)
    return None


def powers(variable: str, wanted: Iterable[int]) -> Program:
    """Return the assignments that make the wanted powers of a variable: y2 = y * y, …."""
    return tuple(
        Statement(f"{variable}{step.power}", power(variable, step.left) * power(variable, step.right))
        for step in chain(frozenset(wanted))
    )


def power(variable: str, exponent: int) -> Name:
    """Return the name of a power of a variable."""
    return Name(variable if exponent == 1 else f"{variable}{exponent}")


def gaps(exponents: Sequence[int]) -> set[int]:
    """Return the powers of y that Horner's rule for a lacunary polynomial needs."""
    return {high - low for low, high in pairwise(exponents)}


def horner_expression(exponents: Sequence[int], names: Sequence[str], variable: str) -> Expression:
    """Return a lacunary polynomial by Horner's rule as an expression: a0 + y4 * (a4 + y4 * a8).

    Parameters
    ----------
    exponents : sequence of int
        Ascending, beginning with 0.
    names : sequence of str
        Those of the coefficients.
    variable : str
    """
    total: Expression = Name(names[-1])
    for i in range(len(exponents) - 2, -1, -1):
        total = Name(names[i]) + power(variable, exponents[i + 1] - exponents[i]) * total
    return total


# --- bounds of rounding errors ----------------------------------------------------------------------------------------


_WIDE = 4  # where a sum varies by more, its error is not brought into relation to it: the least size says too little


def smallest_number(form: Format) -> Fraction:
    """Return the smallest positive number of a type, which is subnormal."""
    return Fraction(2) ** (2 - form.largest - form.precision)


class Rounded:
    """A rounded number of a type: an enclosure of its exact value, bounds of its error, and its slope.

    An operation rounds to nearest, with a relative error of at most 2^-precision or, where a product or a quotient
    underflows, an absolute one of half the smallest number. That holds all the more where a product and a sum are
    fused. To be used within `balls.working`.

    Attributes
    ----------
    value : flint.arb
        Encloses the exact values.
    form : Format
    relative, underflow : flint.arb
        Bounds of the error: relative, and absolute where it comes from results that underflow.
    spread : flint.arb
        A bound of the absolute error that a sum has which may vanish, or nearly; 0 again in sums that cannot.
    change, slope : flint.arb
        Enclose d value/d ln y and d ln|value|/d ln y, where y is the number whose slope was given as 1. The slope is
        infinite where it is not known.
    """

    def __init__(self, value: arb, form: Format, relative: arb | int = 0, slope: arb | int = 0) -> None:
        self.value, self.form = value, form
        self.relative, self.underflow, self.spread = arb(relative), arb(0), arb(0)
        self.slope = arb(slope)
        self.change = self.value * self.slope

    def __add__(self, other: Rounded) -> Rounded:
        """Return the sum, whose error is in relation to it unless it may vanish, or nearly."""
        value, change = self.value + other.value, self.change + other.change
        spread, of_parts = self.spread + other.spread, self._error() + other._error()
        least, relative, slope = arb(value.abs_lower()), arb.pos_inf(), arb.pos_inf()
        if least > 0:
            of_self, of_other = _portion(self.value, other.value), _portion(other.value, self.value)
            relative = min(_above(of_self) * self.relative + _above(of_other) * other.relative, of_parts / least)
            if self.value >= 0 and other.value >= 0:
                relative = min(relative, max(self.relative, other.relative))
            relative += spread / least
            slope = _narrower(self.slope + (other.slope - self.slope) * of_other, change / value)
        spread += of_parts
        if relative * _above(value) <= _WIDE * spread:
            spread = arb(0)
        else:
            relative, slope = arb(0), arb.pos_inf()
        result = self._with(value, relative, spread, change, slope)
        return result._rounded(self.underflow + other.underflow, arb(0))

    def __mul__(self, other: Rounded) -> Rounded:
        value, change = self.value * other.value, self.change * other.value + self.value * other.change
        slope = self.slope + other.slope
        if not slope.is_finite() and not value.contains(0):
            slope = change / value
        relative = (1 + self.relative) * (1 + other.relative) - 1
        of_self, of_other = (_above(x.value) * (1 + x.relative) + x.spread for x in (self, other))
        spread = self.spread * of_other + other.spread * of_self
        underflow = self.underflow * of_other + other.underflow * (of_self + self.underflow)
        return self._with(value, relative, spread, change, slope)._rounded(underflow, _half(self.form))

    def __truediv__(self, other: Rounded) -> Rounded:
        least = arb(other.value.abs_lower())
        left = 1 - other.relative - (other.spread + other.underflow) / least if least > 0 else arb(0)
        if not left > 0:
            raise ArithmeticError("a denominator may vanish within its rounding error")
        value = self.value / other.value
        change = (self.change - value * other.change) / other.value
        relative, spread = (1 + self.relative) / left - 1, self.spread / (least * left)
        result = self._with(value, relative, spread, change, self.slope - other.slope)
        return result._rounded(self.underflow / (least * left), _half(self.form))

    def _error(self) -> arb:
        return _above(self.value) * self.relative

    def _with(self, value: arb, relative: arb, spread: arb, change: arb, slope: arb) -> Rounded:
        result = Rounded(value, self.form)
        result.relative, result.spread, result.change, result.slope = relative, spread, change, slope
        return result

    def _rounded(self, underflow: arb, half: arb) -> Rounded:
        """Add the rounding of the operation whose result this is, and what underflow did before and does now."""
        unit = arb(2) ** -self.form.precision
        self.relative = _above((1 + self.relative) * (1 + unit) - 1)
        self.spread, self.underflow = _above(self.spread * (1 + unit)), _above(underflow * (1 + unit) + half)
        return self

    def with_error_of_y(self, error: arb) -> Rounded:
        """Return the number with the further error, by its slope, of an error of at most `error` in ln y.

        Raises
        ------
        ArithmeticError
            If the number is the result of a sum that may vanish.
        """
        if self.spread > 0 or not self.slope.is_finite():
            raise ArithmeticError("a sum may vanish")
        relative = (1 + self.relative) * (_above(self.slope) * error).exp() - 1
        result = self._with(self.value, _above(relative), self.spread, self.change, self.slope)
        result.underflow = self.underflow
        return result


def _portion(part: arb, rest: arb) -> arb:
    """Enclose part/(part + rest), and closely where one of the two is much smaller than the other."""
    found = 1 / (1 + rest / part)
    return found if found.is_finite() else part / (part + rest)


def _narrower(one: arb, other: arb) -> arb:
    return one if one.is_finite() and one.rad() < other.rad() else other


@lru_cache(maxsize=16)
def _half(form: Format) -> arb:
    return ball_of(smallest_number(form)) / 2


def _above(ball: arb) -> arb:
    """Return an upper bound of the absolute value, exactly."""
    return arb(ball.abs_upper())
