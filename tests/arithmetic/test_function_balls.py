"""The ball arithmetic of functions: every bound holds, and none is vacuous."""

from fractions import Fraction

import pytest
from flint import fmpq, fmpq_poly, fmpz_poly
from hypothesis import given, settings
from hypothesis import strategies as st

from tests.arithmetic.function_balls import ALGEBRA, BITS, assert_encloses, exact_norm, members
from viscopade.arithmetic.function_balls import Orders, Wiener, divided_up, shifted_up


@given(members(), members())
def test_product_encloses_the_product_of_any_members(first, second):
    (f_ball, f), (g_ball, g) = first, second
    assert_encloses(ALGEBRA.product(f_ball, g_ball), f * g)


@given(st.lists(members(), min_size=2, max_size=6))
def test_convolution_encloses_the_sum_of_products(pairs):
    n = len(pairs)
    f = Orders([None, *(ball for ball, _ in pairs)][:n])  # f_0 does not enter, nor does f_n
    exact = [None, *(member for _, member in pairs)]
    total, error = f.convolution()
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
    return fmpq(fraction.numerator, fraction.denominator)


@pytest.mark.parametrize("terms", [12, 20, 30])
@pytest.mark.parametrize("bits", [40, 100])
def test_square_root_and_inverse_lie_within_their_errors(bits, terms):
    """Against many more terms and bits; nearly all of the inverse's error comes from that of the root."""
    square = [Fraction(6), Fraction(-4), Fraction(1)]
    for rough, fine in zip(
        Wiener(bits, terms).root_and_half_inverse(square), Wiener(300, 200).root_and_half_inverse(square), strict=True
    ):
        ours = fmpq_poly(rough.polynomial.coeffs()) / (1 << bits)
        truth = fmpq_poly(fine.polynomial.coeffs()) / (1 << 300)
        distance = exact_norm(ours - truth) - Fraction(fine.error, 1 << 300)
        assert distance <= Fraction(rough.error, 1 << bits) <= 20 * distance + Fraction(40 * terms, 1 << bits)


def test_an_inverse_of_the_wrong_root_is_noticed(monkeypatch):
    """With an exact inverse of a coarse root the whole error of 1/(2 f) is the root's."""
    square = [Fraction(6), Fraction(-4), Fraction(1)]
    coarse = Wiener(80, 6)._approximate_root(square)[0]
    with monkeypatch.context() as patch:
        inverse = fmpz_poly([c >> 1 for c in _inverse(coarse, 80, 60)])
        patch.setattr(Wiener, "_approximate_root", lambda self, square: (coarse, inverse))
        _, rough = Wiener(80, 60).root_and_half_inverse(square)
    _, fine = Wiener(300, 200).root_and_half_inverse(square)
    difference = fmpq_poly(rough.polynomial.coeffs()) / (1 << 80) - fmpq_poly(fine.polynomial.coeffs()) / (1 << 300)
    assert exact_norm(difference) <= Fraction(rough.error, 1 << 80) + Fraction(fine.error, 1 << 300)


def _inverse(polynomial, bits, terms):
    """Coefficients of 1/polynomial, both in units of 2^-bits."""
    from flint import fmpq_series

    from viscopade.arithmetic.balls import working

    with working(64, terms):
        series = fmpq_series([fmpq(int(c), 1 << bits) for c in polynomial.coeffs()], prec=terms).inv()
        return [int(c.p * (1 << bits)) // int(c.q) for c in series.coeffs()]


@pytest.mark.parametrize("signs", [(-1, -1), (1, -1), (-1, 1), (1, 0)])
def test_a_wrong_branch_or_inverse_is_refused(monkeypatch, signs):
    """-f and -1/(2 f) satisfy all equations, but are another function's."""
    square = [Fraction(6), Fraction(-4), Fraction(1)]
    right = Wiener(80, 60)._approximate_root(square)
    wrong = tuple(sign * polynomial for sign, polynomial in zip(signs, right, strict=True))
    monkeypatch.setattr(Wiener, "_approximate_root", lambda self, square: wrong)
    with pytest.raises(ArithmeticError):
        Wiener(80, 60).root_and_half_inverse(square)


@pytest.mark.parametrize(("bits", "f", "w", "square"), [(3, 12, 12, Fraction(7, 5)), (4, 12, 3, Fraction(1))])
def test_conditions_without_which_errors_would_be_negative(monkeypatch, bits, f, w, square):
    monkeypatch.setattr(Wiener, "_approximate_root", lambda self, square: (fmpz_poly([f]), fmpz_poly([w])))
    with pytest.raises(ArithmeticError):
        Wiener(bits, 3).root_and_half_inverse([square])


@pytest.mark.parametrize("square", [[Fraction(1), Fraction(-1)], [Fraction(1), Fraction(-5)]])
def test_square_root_of_a_polynomial_with_a_zero_in_the_disc_is_refused(square):
    with pytest.raises(ArithmeticError):
        Wiener(60, 30).root_and_half_inverse(square)


def test_what_is_cut_off_is_in_the_error():
    algebra = Wiener(10, 2)
    product = algebra.rounded(fmpz_poly([0, 0, -5 << 10, 7 << 10]), 0)
    assert product.error >= 12
    assert product.norm == 0


def test_the_error_of_a_root_far_from_its_approximation(monkeypatch):
    """sqrt(1/10) from the approximation 1: to first order the error is 0.45, in truth it is 0.68."""
    one = 1 << 60
    constants = fmpz_poly([one]), fmpz_poly([one >> 1])
    monkeypatch.setattr(Wiener, "_approximate_root", lambda self, square: constants)
    f, w = Wiener(60, 4).root_and_half_inverse([Fraction(1, 10)])
    assert f.error / one >= 1 - 0.1**0.5
    assert w.error / one >= 0.5 / 0.1**0.5 - 0.5
