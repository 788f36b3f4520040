"""Binary formats of IEEE 754: correctly rounded values of decimal strings, and literals of C."""

from __future__ import annotations

import math
import re
from collections.abc import Callable
from dataclasses import dataclass
from decimal import Context, Decimal
from fractions import Fraction

_HEXADECIMAL = re.compile(r"(?:\.?0+)?p([+-][0-9]+)")  # the end of a number as Python writes it
# A choice of four digits of the exponent at most: a fraction with 10^999999999 does not fit into memory, and doubles
# end at 10^308, so that three would do. [0-9], as \d matches the digits of other scripts, too; a digit before the
# point, as every coefficient of ours has one.
_DECIMAL = re.compile(r"[+-]?[0-9]+(?:\.[0-9]*)?(?:[eE]([+-]?[0-9]{1,4}))?")


def decimal_value(text: str) -> Fraction:
    """Return the exact value of a decimal string, such as a coefficient.

    Raises
    ------
    TypeError
        If `text` is not a string.
    ValueError
        If it is not a finite decimal number (with an exponent of at most four digits).
    """
    # A float is no decimal: it would be taken for 0.1000…0055….
    if not isinstance(text, str):
        raise TypeError(f"{text!r} is not a string: coefficients are decimal strings")
    if not _DECIMAL.fullmatch(text):
        raise ValueError(f"{text!r} is not a finite decimal number")
    return Fraction(text)


@dataclass(frozen=True)
class Format:
    """A binary interchange format of IEEE 754.

    Attributes
    ----------
    name : str
        C's name of the type.
    suffix : str
        The suffix of C for literals and names of mathematical functions.
    precision : int
        Bits of the significand.
    largest : int
        The exponent of the largest numbers: all finite values lie below 2^(largest + 1).
    digits : int
        Number of significant decimal digits that distinguishes all values.
    """

    name: str
    suffix: str
    precision: int
    largest: int
    digits: int

    @property
    def epsilon(self) -> float:
        """The distance from 1 to the next value."""
        return 2.0 ** (1 - self.precision)

    @property
    def bytes(self) -> int:
        """The size of a number in memory."""
        # The leading bit of the significand is not stored; the sign takes its place. The exponent has one bit more
        # than `largest`.
        return (self.precision + self.largest.bit_length() + 1) // 8

    @property
    def smallest(self) -> Fraction:
        """The smallest positive number, which is subnormal."""
        return Fraction(2) ** (2 - self.largest - self.precision)

    @property
    def least(self) -> Fraction:
        """The smallest positive normal number."""
        return Fraction(2) ** (1 - self.largest)

    def ulp(self, number: Fraction) -> Fraction:
        """Return the unit in the last place of a number, which may be subnormal, but not zero."""
        return _scaled(Fraction(1), self._place(number))

    def _place(self, number: Fraction) -> int:
        """Return the exponent of the unit in the last place."""
        return max(exponent(number), 1 - self.largest) - self.precision + 1

    def rounded(self, number: Fraction, to: Callable[[Fraction], int] = round) -> float:
        """Return the correctly rounded value of an exact number: nearest, ties to even, or by another rule.

        The rule `to`, such as `math.floor`, rounds to integers, as `round` does. The value may be subnormal or
        infinite.
        """
        if number == 0:
            return 0.0
        # The unit in the last place is 2^place: the number in this unit, rounded to an integer.
        place = self._place(number)
        units = to(_scaled(number, -place))
        # |units| 2^place >= 2^(largest + 1) overflows to infinity. This is asked after rounding, which may carry into
        # the next binade.
        if abs(units).bit_length() + place > self.largest + 1:
            return math.copysign(math.inf, units)
        return math.ldexp(units, place)

    def nearest(self, number: Fraction, to: Callable[[Fraction], int] = round) -> float:
        """Return the correctly rounded value of an exact number.

        Raises
        ------
        ValueError
            If it is neither zero nor a normal number.
        """
        value = self.rounded(number, to)
        if number and not 2.0 ** (1 - self.largest) <= abs(value) < math.inf:
            raise ValueError(f"{float_text(number)} is not a normal number in {self.name}")
        return value

    def hexadecimal(self, *values: float) -> str:
        """Return numbers as hexadecimal literals of C, which are exact, with commas between them."""
        return _HEXADECIMAL.sub(rf"p\1{self.suffix}", ", ".join(map(float.hex, values)))

    def decimal(self, value: float) -> str:
        """Return `value` as a decimal literal of C that a compiler rounds to the same value."""
        return self.literal(format(value, f".{self.digits}g"))

    def literal(self, number: str) -> str:
        """Return a decimal number as a literal of C, with the same digits."""
        return f"{number if set(number) & set('.e') else number + '.0'}{self.suffix}"


DOUBLE = Format("double", "", 53, 1023, 17)
FLOAT = Format("float", "f", 24, 127, 9)
FORMATS = {ieee.name: ieee for ieee in (DOUBLE, FLOAT)}


def float_text(number: Fraction) -> str:
    """Return six significant digits of `number`, of any size, for a message."""
    return str(Context(prec=6).divide(Decimal(number.numerator), Decimal(number.denominator))).lower()


def exponent(number: Fraction) -> int:
    """Return e with 2^e <= |number| < 2^(e + 1); the number is not zero."""
    # Lengths in bits give e, or e + 1 if the quotient of the significands is below 1.
    top, bottom = abs(number.numerator), number.denominator
    guess = top.bit_length() - bottom.bit_length()
    return guess if top << max(-guess, 0) >= bottom << max(guess, 0) else guess - 1


def _scaled(number: Fraction, power: int) -> Fraction:
    """Return a number times a power of 2; `Fraction(2) ** power` takes long."""
    return Fraction(number.numerator << max(power, 0), number.denominator << max(-power, 0))
