"""Text of expressions: how languages write functions, literals and constants."""

from __future__ import annotations

from collections.abc import Callable
from contextlib import suppress
from fractions import Fraction
from typing import NamedTuple

from viscopade.arithmetic.formats import Format
from viscopade.kernels.expressions import (
    AND,
    Call,
    Expression,
    Literal,
    Name,
    Negation,
    Operation,
    Select,
    TableRow,
    Word,
    bare,
)


def _as_it_is(text: str) -> str:
    return text


class Syntax(NamedTuple):
    """Syntax of a language: its functions and literals, and patterns.

    `power` is x^p if pow is no function, of {base} and {p}; `select` is of {condition}, {met} and {otherwise}.
    """

    function: Callable[[str], str] = _as_it_is
    literal: Callable[[str], str] = _as_it_is
    power: str = ""
    word: Callable[[int], str] = hex
    both: str = "&&"  # "&" stands between conditions in parentheses
    select: str = "{condition} ? {met} : {otherwise}"


MATH_MODULE = Syntax(lambda name: f"math.{name}", both="and", select="{met} if {condition} else {otherwise}")
"""The syntax of Python, with the functions of its module `math`."""


def of_c(form: Format) -> Syntax:
    """Return the syntax of C for functions and literals of this type."""
    return Syntax(
        lambda name: f"{name}{form.suffix}",
        lambda text: f"{text}{form.suffix}",
        word=lambda value: f"UINT{8 * form.bytes}_C({value:#x})",
    )


_COMPARISON, _BITS, _SUM, _PRODUCT = 2, 3, 4, 5
_BINDING = {
    AND: 1,
    **dict.fromkeys(("<", "<=", ">", ">=", "==", "!="), _COMPARISON),
    **dict.fromkeys(("&", "|", "^", "<<", ">>"), _BITS),
    **dict.fromkeys("+-", _SUM),
    **dict.fromkeys(("*", "/", "//"), _PRODUCT),
}


def text(expression: Expression, syntax: Syntax) -> str:
    """Return the expression as text, with the same order of evaluation."""
    match bare(expression):
        case Name(name):
            return name
        case Literal(number):
            return syntax.literal(number)
        case Call("pow", (base, p)) if syntax.power:
            return syntax.power.format(base=text(base, syntax), p=text(p, syntax))
        case Call(function, arguments):
            return f"{syntax.function(function)}({', '.join(text(part, syntax) for part in arguments)})"
        case Word(value, pattern):
            assert isinstance(value, int)
            return syntax.word(value) if pattern else str(value)
        case Negation(symbol, operand):
            return f"{symbol}{_in_parentheses(operand, syntax)}"
        case Select(condition, met, otherwise):
            chosen, if_met = (
                _in_parentheses(part, syntax) if isinstance(part, Select) else text(part, syntax)
                for part in (condition, met)
            )
            return syntax.select.format(condition=chosen, met=if_met, otherwise=text(otherwise, syntax))
        case TableRow(table, index):
            return f"{table}[{text(index, syntax)}]"
        case Operation(symbol, left, right):
            written = {AND: syntax.both, "//": "/"}.get(symbol, symbol)
            return f"{_operand(left, symbol, 0, syntax)} {written} {_operand(right, symbol, 1, syntax)}"
    raise TypeError(f"{expression!r} is no expression")


def _operand(expression: Expression, symbol: str, side: int, syntax: Syntax) -> str:
    own = bare(expression)
    if not isinstance(own, Operation):
        return _in_parentheses(expression, syntax) if isinstance(own, Select) else text(expression, syntax)
    # A sum within a sum is in parentheses on either side: some languages let compilers reorder what is in none.
    # Operations on bits have all of theirs in parentheses, and comparisons those on bits and other comparisons:
    # languages differ in which of them bind more tightly.
    binding, outer = _BINDING[own.symbol], _BINDING[symbol]
    loose = outer == _BITS or (symbol, syntax.both) == (AND, "&") or (outer == _COMPARISON and binding <= _BITS)
    loose = loose or binding < outer + (side or binding == _SUM)
    written = text(expression, syntax)  # no deeper than needed: polynomials may be of degree 200
    return f"({written})" if loose else written


def _in_parentheses(expression: Expression, syntax: Syntax) -> str:
    """Return the text of an operand, in parentheses if it has operands of its own."""
    written = text(expression, syntax)
    own = isinstance(bare(expression), Operation | Select | Negation) or written.startswith("-")
    return f"({written})" if own else written


def shortest(value: float, form: Format) -> str:
    """Return the shortest decimal that rounds to a number of the format, always with a point."""
    for digits in range(1, form.digits + 1):
        written = format(value, f".{digits}g")
        with suppress(ValueError):  # below the smallest normal number
            if form.nearest(Fraction(written)) == value:
                break
    mantissa, e, exponent = written.replace("e+", "e").partition("e")
    return f"{mantissa if '.' in mantissa else mantissa + '.0'}{e}{exponent}"


PRELUDE = """\
#ifndef VISCOPADE_INLINE
#if !defined(__cplusplus) && defined(__STRICT_ANSI__) && (!defined(__STDC_VERSION__) || __STDC_VERSION__ < 199901L)
#error "viscopade: C99 or later is needed; accepted is GNU's C89, too (-std=gnu89)"
#elif defined(__SIZEOF_DOUBLE__) && __SIZEOF_DOUBLE__ != 8
#error "viscopade: the bounds are for a double of 64 bits (on AVR, with -mdouble=64)"
#else
/* Not with -fsingle-precision-constant: it would break the bounds. */
typedef char viscopade_needs_constants_of_type_double[sizeof(0.0) == 8 ? 1 : -1];

/*
 * External linkage from C++17 on: templates that a module exports may call the functions. So, as with all inline
 * functions of C++, one option (-march, -ffast-math) must be that of all files. Kernels of one name that differ are
 * in namespaces of their own, as two translation units may have one each.
 */
#if defined(__cplusplus) && __cplusplus >= 201703L
#define VISCOPADE_INLINE inline
#define VISCOPADE_TABLE inline const
#define VISCOPADE_KERNEL(identity) inline namespace viscopade_##identity {
#define VISCOPADE_KERNEL_END }
#else
#define VISCOPADE_INLINE static inline
#define VISCOPADE_TABLE static const
#define VISCOPADE_KERNEL(identity)
#define VISCOPADE_KERNEL_END
#endif

/* C++ before C++17 has no hexadecimal constants; the decimal is rounded to the same number. */
#if defined(__cplusplus) && __cplusplus < 201703L
#define VISCOPADE_CONSTANT(hexadecimal, decimal) (decimal)
#else
#define VISCOPADE_CONSTANT(hexadecimal, decimal) (hexadecimal)
#endif
#endif
#endif"""
"""What every header of C begins with; what follows is for compilers that accept it: those with VISCOPADE_INLINE."""

PRELUDE_OF_CUDA = f"""\
{PRELUDE}

#ifndef VISCOPADE_FUNCTION
/* Compilers at run time (NVRTC, HIPRTC) have no headers, and compile for the device only. */
#if !defined(__CUDACC_RTC__) && !defined(__HIPCC_RTC__)
#include <math.h>
#include <stddef.h>
#define VISCOPADE_HAS_HOST 1
#else
#define VISCOPADE_HAS_HOST 0
#endif

#if defined(__HIPCC__)
#if VISCOPADE_HAS_HOST
#include <hip/hip_runtime.h>
#endif
#define VISCOPADE_RUNTIME(name) hip##name
#define VISCOPADE_FUNCTION VISCOPADE_INLINE __host__ __device__
#elif defined(__CUDACC__)
#define VISCOPADE_RUNTIME(name) cuda##name
#define VISCOPADE_FUNCTION VISCOPADE_INLINE __host__ __device__
#else
#define VISCOPADE_FUNCTION VISCOPADE_INLINE
#endif
#endif"""
"""The same for headers that are for devices as well; VISCOPADE_RUNTIME names the functions and types of the runtime."""


def constant_of_c(value: float, form: Format) -> str:
    """Return a constant of C and C++, hexadecimal where the standard has such, else decimal."""
    return f"VISCOPADE_CONSTANT({form.hexadecimal(value)}, {form.decimal(value)})"
