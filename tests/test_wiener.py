"""The ball arithmetic of functions: every bound holds, and none is vacuous."""

from fractions import Fraction

import pytest
from flint import fmpq_poly, fmpz_poly
from hypothesis import given, settings
from hypothesis import strategies as st

from viscopade.wiener import Element, Wiener, divided_up, shifted_up

BITS, TERMS = 40, 8
ALGEBRA = Wiener(BITS, TERMS)

coefficients = st.lists(st.integers(-(2**45), 2**45), min_size=1, max_size=TERMS)
elements = st.builds(ALGEBRA.element, coefficients, st.integers(0, 2**20))


def exact_norm(polynomial):
    return sum(abs(Fraction(int(c.p), int(c.q))) for c in polynomial.coeffs())


def as_polynomial(element):
    return fmpq_poly(element.polynomial.coeffs()) / (1 << BITS)


@st.composite
def members(draw):
    """A ball of functions, and a function on its boundary: all of the error in one coefficient."""
    element = draw(elements)
    index = draw(st.integers(0, 2 * TERMS))
    error = fmpq_poly([0] * index + [draw(st.sampled_from([-1, 1])) * element.error]) / (1 << BITS)
    return element, as_polynomial(element) + error


def assert_encloses(element: Element, function):
    distance = exact_norm(as_polynomial(element) - function)
    assert distance * (1 << BITS) <= element.error


@given(members(), members())
def test_product_encloses_the_product_of_any_members(first, second):
    (f_ball, f), (g_ball, g) = first, second
    assert_encloses(ALGEBRA.product(f_ball, g_ball), f * g)


@given(st.lists(members(), min_size=2, max_size=6))
def test_self_convolution_encloses_the_sum_of_products(pairs):
    n = len(pairs)
    f = [None, *(ball for ball, _ in pairs)]  # f_0 does not enter
    exact = [None, *(member for _, member in pairs)]
    total, error = ALGEBRA.self_convolution(f, n)
    truth = sum((exact[i] * exact[n - i] for i in range(1, n)), fmpq_poly())
    distance = exact_norm(fmpq_poly(total.coeffs()) / (1 << 2 * BITS) - truth)
    assert distance * (1 << 2 * BITS) <= error


@given(st.integers(-(2**80), 2**80), st.integers(0, 40), st.integers(1, 2**30))
def test_rounding_upwards(value, shift, divisor):
    assert 0 <= shifted_up(value, shift) - Fraction(value, 1 << shift) < 1
    assert 0 <= divided_up(value, divisor) - Fraction(value, divisor) < 1


@settings(max_examples=30)
@given(st.lists(st.fractions(-1, 1, max_denominator=8), min_size=1, max_size=5), st.integers(5, 40))
def test_square_root_and_inverse_enclose_the_truth(tail, terms):
    square = [Fraction(6), *tail]  # no zero in |y| <= 1, because 6 > 5
    algebra = Wiener(100, terms)
    try:
        f, w = algebra.root_and_half_inverse(square)
    except ArithmeticError:
        assert terms < 20  # too few terms are refused, never answered wrongly
        return
    # The squares of the members of the ball around f must meet the square, and 2 f w = 1.
    one = Fraction(1, 1 << 100)
    f_exact = fmpq_poly(f.polynomial.coeffs()) / (1 << 100)
    w_exact = fmpq_poly(w.polynomial.coeffs()) / (1 << 100)
    distance = exact_norm(f_exact * f_exact - fmpq_poly([_fmpq(c) for c in square]))
    assert distance <= (2 * f.norm + f.error) * f.error * one * one
    assert exact_norm(2 * f_exact * w_exact - 1) <= 2 * (f.bound * w.error + w.bound * f.error) * one * one + one
    assert f.polynomial[0] > 0


def _fmpq(fraction):
    from flint import fmpq

    return fmpq(fraction.numerator, fraction.denominator)


@pytest.mark.parametrize("square", [[Fraction(1), Fraction(-1)], [Fraction(1), Fraction(-5)]])
def test_square_root_of_a_polynomial_with_a_zero_in_the_disc_is_refused(square):
    with pytest.raises(ArithmeticError):
        Wiener(60, 30).root_and_half_inverse(square)


def test_what_is_cut_off_is_in_the_error():
    algebra = Wiener(10, 2)
    product = algebra.rounded(fmpz_poly([0, 0, -5 << 10, 7 << 10]), 0)
    assert product.error >= 12
    assert product.norm == 0
