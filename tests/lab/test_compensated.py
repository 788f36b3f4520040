"""Compensated Horner: its parts are exact, its bounds hold against fractions, and fail without the correction."""

from fractions import Fraction
from functools import partial

import numpy as np
import pytest
from flint import arb
from hypothesis import given, settings
from hypothesis import strategies as st

from viscopade.arithmetic.balls import ball_of, exact_middle, working
from viscopade.theory.pade import horner
from viscopade_lab import compensated

near = partial(pytest.approx, abs=0)  # else all numbers below 1e-12 are equal

MODERATE = st.floats(-1e30, 1e30, allow_subnormal=False).filter(lambda x: x == 0 or abs(x) > 1e-30)


def as_arrays(*numbers):
    return tuple(np.array([float(x)]) for x in numbers)


@settings(max_examples=200)
@given(MODERATE, MODERATE)
def test_sums_and_products_with_their_errors_are_exact(x, y):
    for function, truth in ((compensated.two_sum, Fraction(x) + Fraction(y)),
                            (compensated.two_product, Fraction(x) * Fraction(y))):  # fmt: skip
        result, error = (float(part[0]) for part in function(*as_arrays(x, y)))
        assert Fraction(result) + Fraction(error) == truth
        assert result == float(truth)


@settings(max_examples=100)
@given(MODERATE)
def test_parts_are_short_enough_for_exact_products(x):
    high, low = (float(part[0]) for part in compensated.split(*as_arrays(x)))
    assert Fraction(high) + Fraction(low) == Fraction(x)
    assert Fraction(high * high) == Fraction(high) ** 2
    assert Fraction(low * low) == Fraction(low) ** 2
    assert Fraction(high * low) == Fraction(high) * Fraction(low)


def exactly(c, x):
    return sum(Fraction(c_k) * Fraction(x) ** k for k, c_k in enumerate(c))


def size(c, x):
    return sum(abs(Fraction(c_k)) * abs(Fraction(x)) ** k for k, c_k in enumerate(c))


def part_of_bound(computed, truth, bound):
    return abs(Fraction(float(computed)) - truth) / exact_middle(bound.mid())


def measured(c, x, low=None):
    """Largest parts of the bounds that plain and compensated Horner use up."""
    used = []
    whole = c if low is None else [Fraction(a) + Fraction(b) for a, b in zip(c.tolist(), low.tolist(), strict=True)]
    with working(400):
        for i, v in enumerate(x.tolist()):
            n, total = len(c) - 1, ball_of(size(c.tolist(), v))
            plain = compensated.plain_bound(n, total)
            truth = exactly(whole, v)
            bound = compensated.bound(n, ball_of(truth), total, two_doubles=low is not None)
            used.append((
                part_of_bound(horner(c, x)[i], exactly(c.tolist(), v), plain),
                part_of_bound(compensated.compensated_horner(c, x, low)[i], truth, bound),
                part_of_bound(horner(c, x)[i], truth, bound),
            ))  # fmt: skip
    return [max(column) for column in zip(*used, strict=True)]


def expanded(n):
    """(x - 1)^n."""
    c = [1]
    for _ in range(n):
        c = [a - b for a, b in zip([0, *c], [*c, 0], strict=True)]
    return np.array(c, dtype=float)


@pytest.mark.parametrize("n", [1, 5, 12, 20])
def test_next_to_a_multiple_zero(n):
    """The hardest case of the literature: condition numbers up to 1e16 and far beyond."""
    x = 1 + np.linspace(-0.4, 0.37, 51) / n
    plain, compensated_part, without = measured(expanded(n), x)
    assert plain <= 1
    assert compensated_part <= 1
    assert n < 5 or without > 100  # plain Horner does not meet the compensated one's bound


def test_accurate_where_nothing_is_left_of_horner():
    c, x = expanded(7), np.array([1.0079])
    truth = float((Fraction(1.0079) - 1) ** 7)
    assert abs(horner(c, x) / truth - 1) > 0.01
    assert abs(compensated.compensated_horner(c, x) / truth - 1) < 1e-15


def test_coefficients_in_two_doubles():
    """p = sum (x/3)^k (-1)^k …: coefficients that no double holds, and a sum that cancels."""
    rng = np.random.default_rng(7)
    exact = [Fraction(int(rng.integers(-(10**12), 10**12)), 10**12 + 39) for _ in range(25)]
    exact[0] -= exactly(exact, Fraction(3, 4)) + Fraction(1, 10**17)  # a zero next to 3/4
    c = np.array([float(q) for q in exact])
    low = np.array([float(q - Fraction(float(q))) for q in exact])
    x = np.array([0.75, 0.25, 1.5, -0.9])
    with working(400):
        for i, v in enumerate(x.tolist()):
            truth, total = exactly(exact, v), ball_of(size(exact, v))
            bound = compensated.bound(24, ball_of(truth), total, two_doubles=True)
            assert part_of_bound(compensated.compensated_horner(c, x, low)[i], truth, bound) <= 1
            if i == 0:  # rounding the coefficients alone spoils every digit
                assert part_of_bound(compensated.compensated_horner(c, x)[i], truth, bound) > 1e10
    assert measured(c, x, low)[1] <= 1


@settings(max_examples=60)
@given(st.lists(st.floats(-10, 10, allow_subnormal=False, width=32), min_size=1, max_size=30), st.integers(1, 2**20))
def test_bounds_hold_for_any_polynomial(c, place):
    plain, part, _ = measured(np.array([*c, 1.0]), np.array([place / 2**19, -place / 2**19]))
    assert plain <= 1
    assert part <= 1


def test_a_constant():
    assert compensated.compensated_horner(np.array([0.1]), np.array([3.0, 4.0])).tolist() == [0.1, 0.1]
    low = np.array([1e-18])
    assert compensated.compensated_horner(np.array([0.1]), np.array([3.0]), low).tolist() == [0.1]


def test_bounds_are_those_of_the_docstring():
    u = Fraction(1, 2**53)
    assert compensated.gamma(1) == u / (1 - u)
    assert compensated.gamma(6) == 6 * u / (1 - 6 * u)
    with working(200):
        assert exact_middle(compensated.plain_bound(3, arb(2))) == near(2 * compensated.gamma(6), rel=1e-30)
        for two_doubles, operations in ((False, 6), (True, 8)):
            found = compensated.bound(3, arb(-5), arb(2), two_doubles=two_doubles)
            assert exact_middle(found) == near(5 * u + 2 * compensated.gamma(operations) ** 2, rel=1e-30)
