"""Each step of the hierarchy's recursion maps balls of functions to balls that enclose the image of every member.

`test_series.py` compares the whole recursion with the truth; but there one forgotten error term hides behind the
others. Here each operation gets members on the boundary of its arguments, so that every term is needed.
"""

from fractions import Fraction
from functools import cache

import pytest
from flint import fmpq, fmpq_poly
from hypothesis import given
from hypothesis import strategies as st

from tests.arithmetic.function_balls import ALGEBRA, BITS, TERMS, assert_encloses, elements, members
from viscopade.arithmetic.function_balls import Orders
from viscopade.theory.series import MeetingPoint, _Inner, _next_order, _Outer

UNIT = fmpq(1, 1 << BITS)
# Errors as large as the functions, or none: then single terms of the bounds decide.
extreme = st.builds(
    ALGEBRA.element, st.lists(st.integers(-1, 1), min_size=1, max_size=TERMS), st.sampled_from([0, 2**30])
)
any_member = members(elements) | members(extreme)
orders = st.integers(2, 60)


def rational(fraction: Fraction) -> fmpq:
    return fmpq(fraction.numerator, fraction.denominator)


@given(st.lists(any_member, min_size=1, max_size=5), any_member, any_member)
def test_next_order(pairs, p_pair, inverse_pair):
    n = len(pairs) + 1
    balls = Orders([None, *(ball for ball, _ in pairs)])  # f_0 enters by its inverse only
    exact = [None, *(member for _, member in pairs)]
    (p_ball, p), (inverse_ball, inverse) = p_pair, inverse_pair
    image = (p - sum((exact[i] * exact[n - i] for i in range(1, n)), fmpq_poly())) * inverse
    assert_encloses(_next_order(ALGEBRA, balls, inverse_ball, p_ball), image)


POWERS = [(5, 3), (2, 1), (1, 1), (5, 2), (2, 3)]  # n_a, n_b
of_laws = pytest.mark.parametrize(("n_a", "n_b"), POWERS)


@cache
def without_root(kind, n_a, n_b):
    """An instance without its constructor's square root, which needs more terms than this algebra has."""
    instance = kind(type(ALGEBRA)(60, 60), MeetingPoint.balanced(n_a).r, n_a, n_b)
    instance.algebra = ALGEBRA
    return instance


@of_laws
@given(pair=any_member, n=orders)
def test_outer_integral_and_its_value_at_the_meeting_point(n_a, n_b, pair, n):
    outer = without_root(_Outer, n_a, n_b)
    ball, member = pair
    outer.f = [None] * (n - 1) + [ball]
    a = rational(1 - MeetingPoint.balanced(n_a).r)
    integrand = member * fmpq_poly([1, -a]) ** (n_b - 1)
    image = fmpq_poly([2 * n_a * a * c / (n + 2 + 2 * j) for j, c in enumerate(integrand.coeffs())])
    p = outer._integral(n)
    assert_encloses(p, image)
    value = sum(p.polynomial.coeffs())
    assert abs(image(fmpq(1)) - value * UNIT) <= p.error * UNIT


@given(st.lists(any_member, min_size=2, max_size=4))
def test_outer_advance_returns_value_and_error_of_the_integral(pairs):
    outer, n = without_root(_Outer, 5, 3), len(pairs)
    outer.f = Orders(ball for ball, _ in pairs)
    expected = outer._integral(n)
    value, error = outer.advance(n)
    assert (value, error) == (sum(expected.polynomial.coeffs()), expected.error)


@of_laws
@given(
    pair=any_member,
    n=orders,
    p_meeting=st.integers(-(2**45), 2**45),
    p_error=st.integers(0, 2**31),
    sign=st.sampled_from([-1, 1]),
)
def test_inner_right_side(n_a, n_b, pair, n, p_meeting, p_error, sign):
    inner = without_root(_Inner, n_a, n_b)
    ball, member = pair
    inner.g = [None] * (n - 1) + [ball]
    b = rational(MeetingPoint.balanced(n_a).r)
    integral = n_a * b**n_b * (member * fmpq_poly([*(n_b - 1) * [0], 1])).integral()
    p_at_zero = (p_meeting + sign * p_error) * UNIT + integral(fmpq(1))
    assert_encloses(inner._p(n, p_meeting, p_error), p_at_zero - integral)


@given(st.lists(any_member, min_size=2, max_size=4), st.integers(-(2**45), 2**45), st.integers(0, 2**31))
def test_inner_advance_returns_value_and_error_of_the_new_function(pairs, p_meeting, p_error):
    inner, n = without_root(_Inner, 5, 3), len(pairs)
    inner.g = Orders(ball for ball, _ in pairs)
    expected = _next_order(ALGEBRA, inner.g, inner.half_inverse, inner._p(n, p_meeting, p_error))
    assert inner.advance(n, p_meeting, p_error) == (expected.polynomial[0], expected.error)
