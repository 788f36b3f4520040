"""Binary formats: numbers are rounded once, and literals read back."""

from __future__ import annotations

import ctypes
from fractions import Fraction

import pytest
from hypothesis import given
from hypothesis import strategies as st

from viscopade.arithmetic.formats import DOUBLE, FLOAT, Format, decimal_value

each_form = pytest.mark.parametrize("form", [DOUBLE, FLOAT], ids=["double", "float"])

normal = st.floats(allow_nan=False, allow_infinity=False).filter(lambda x: not x or abs(x) > 1e-300)


@given(
    st.integers(-(10**40), 10**40).filter(bool),
    st.integers(-300, 260),
)
def test_doubles_are_rounded_as_by_the_interpreter(mantissa: int, exponent: int) -> None:
    text = f"{mantissa}e{exponent}"
    assert DOUBLE.nearest(decimal_value(text)) == float(text)


@given(st.integers(-(10**40), 10**40).filter(bool), st.integers(-37, -3))
def test_floats_are_rounded_as_by_the_c_library(mantissa: int, exponent: int) -> None:
    strtof = getattr(ctypes.CDLL(None), "strtof", None)
    if strtof is None:
        pytest.skip("the C library's strtof cannot be reached")
    strtof.restype, strtof.argtypes = ctypes.c_float, [ctypes.c_char_p, ctypes.c_void_p]
    text = f"{mantissa}e{exponent}"
    assert FLOAT.nearest(decimal_value(text)) == strtof(text.encode(), None)


def test_a_float_is_rounded_once() -> None:
    number = 1 + Fraction(2) ** -24 + Fraction(2) ** -70
    assert float(number) == 1 + 2.0**-24, "by way of a double it is a tie, and goes down to 1"
    assert FLOAT.nearest(number) == 1 + 2.0**-23


@each_form
def test_rounding_at_the_ends_of_the_range(form: Format) -> None:
    largest = Fraction(2) ** (form.largest + 1)
    smallest = Fraction(2) ** (1 - form.largest)
    assert form.nearest(largest * (1 - Fraction(2) ** -form.precision)) == largest * (
        1 - Fraction(2) ** -form.precision
    )
    assert form.nearest(smallest) == smallest
    for number in (
        largest,
        largest * (1 - Fraction(2) ** (-form.precision - 1)),
        smallest / 2,
        -smallest / 3,
    ):
        with pytest.raises(ValueError, match=f"is not a normal number in {form.name}"):
            form.nearest(number)


@given(normal)
def test_literals_of_doubles_read_back(x: float) -> None:
    assert float.fromhex(DOUBLE.hexadecimal(x)) == x
    assert float(DOUBLE.decimal(x)) == x


@given(st.floats(width=32, allow_nan=False, allow_infinity=False, allow_subnormal=False))
def test_literals_of_floats_read_back(x: float) -> None:
    assert float.fromhex(FLOAT.hexadecimal(x).removesuffix("f")) == x
    assert FLOAT.nearest(decimal_value(FLOAT.decimal(x).removesuffix("f"))) == x


@each_form
def test_subnormal_and_infinite_numbers(form: Format) -> None:
    smallest = form.smallest
    largest = (2 - Fraction(form.epsilon)) * Fraction(2) ** form.largest
    assert smallest == Fraction(2) ** (2 - form.largest - form.precision) == form.ulp(smallest)
    assert form.rounded(smallest / 2) == 0
    assert form.rounded(smallest * 3 / 4) == form.rounded(smallest) == smallest
    assert form.rounded(largest) == largest
    assert form.rounded(2 * largest) == float("inf") == -form.rounded(-2 * largest)
