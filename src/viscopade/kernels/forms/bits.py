"""Bits of numbers as words in expressions.

The bits of 2^e m, 1 <= m < 2, are those of e and of m; the leading ones are the number of a table's row.
"""

from __future__ import annotations

from viscopade.arithmetic.formats import DOUBLE, Format
from viscopade.kernels.expressions import Call, Expression, Name, Program, Select, Statement, Word


def bits(form: Format, number: Expression) -> Expression:
    """Return the bits of a number."""
    return Call(f"bits{8 * form.bytes}", (number,))


def from_bits(form: Format, word: Expression) -> Expression:
    """Return the number with these bits."""
    return Call(f"from_bits{8 * form.bytes}", (word,))


def power_of_two(form: Format, exponent: int) -> Word:
    """Return the bits of 2^exponent, a normal number."""
    return octaves(form, form.largest + exponent)


def octaves(form: Format, number: int) -> Word:
    """Return the distance of the bits of 2^(e + number) and of 2^e."""
    return Word(number << (form.precision - 1))


def mask(number: int) -> Word:
    """Return the word whose last bits, as many as `number`, are 1."""
    return Word((1 << number) - 1)


def count(number: int) -> Word:
    """Return a word that counts."""
    return Word(number, pattern=False)


def cut_to(number: Expression, last: int) -> Expression:
    """Return a positive double whose last bits, as many as `last`, are set to 0."""
    return from_bits(DOUBLE, bits(DOUBLE, number) & ~mask(last))


def smaller_word(word: Name, largest: Expression) -> Expression:
    """Return the smaller of two words."""
    return Select(word < largest, word, largest)


def folded(fold: int, period: int) -> Program:
    """Return the assignments from `bits` of x to those of s = x 2^(-period n), "folded", and to eps(x)/eps(s), "scale".

    n >= 0 is the largest number with s >= 2^fold, or 0. There eps falls like x^(-10/3), so that the scale is a power of
    two if `period` is a multiple of 3.
    """
    word, fraction, n, exponent = Name("bits"), count(DOUBLE.precision - 1), Name("n"), Name("exponent")
    start = count(DOUBLE.largest + fold)
    scale = Call("uint64", (count(DOUBLE.largest) - count(10 * period // 3) * n,)) << fraction
    return (
        Statement("exponent", Call("uint32", (word >> fraction,))),
        Statement("n", Select(exponent > start, (exponent - start) // count(period), count(0))),
        Statement("scale", from_bits(DOUBLE, scale)),
        Statement("folded", word - (Call("uint64", (count(period) * n,)) << fraction)),
    )
