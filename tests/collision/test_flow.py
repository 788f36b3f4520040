"""The pieces of a branch: Taylor coefficients, steps and the end. Nothing here is proven; `validation` does that."""

from fractions import Fraction
from itertools import pairwise
from math import log, log2

import pytest
from hypothesis import assume, given
from hypothesis import strategies as st

from viscopade.arithmetic.balls import exact_middle, working
from viscopade.collision import flow
from viscopade.collision.flow import Dyadic, integrate

BITS = 400
ONE = 1 << BITS

numbers = st.builds(Dyadic, st.integers(-(2**70), 2**70), st.integers(-80, 80))


def fraction(number: Dyadic) -> Fraction:
    return number.mantissa * Fraction(2) ** number.exponent


def dyadic(value: float) -> Dyadic:
    top, bottom = value.as_integer_ratio()
    return Dyadic(top, 1 - bottom.bit_length())


# --- numbers ----------------------------------------------------------------------------------------------------------


@given(numbers, numbers)
def test_products_are_exact(a, b):
    assert fraction(a.product(b)) == fraction(a) * fraction(b)


@given(numbers, st.integers(-(2**100), 2**100))
def test_times_rounds_down(a, number):
    assert a.times(number) == fraction(a) * number // 1


@given(numbers, numbers, st.integers(-(2**100), 2**100))
def test_over_is_off_by_less_than_two_units(a, b, number):
    assume(b.mantissa)
    assert abs(fraction(a) * number / fraction(b) - a.over(b, number)) < 2


@given(numbers)
def test_size(a):
    if a.mantissa:
        assert Fraction(2) ** (a.size - 1) <= abs(fraction(a)) < Fraction(2) ** a.size


@given(numbers, st.integers(1, 90))
def test_nearest_keeps_the_leading_bits(a, bits):
    assume(a.mantissa)
    with working(200):
        rounded, ball = Dyadic.nearest(a.ball(), bits), a.ball()
    assert exact_middle(ball) == fraction(a)
    assert rounded.mantissa.bit_length() <= bits + 1  # of a negative number, rounded downwards
    assert abs(fraction(rounded) / fraction(a) - 1) < Fraction(2) ** (1 - bits)


@given(st.integers(1, 2**3000))
def test_logarithm_of_a_large_number(number):
    shift = max(number.bit_length() - 1000, 0)
    assert abs(flow._log2(number) - (log2(number >> shift) + shift)) < 1e-9


# --- Taylor coefficients ----------------------------------------------------------------------------------------------

# u, u' at the start, the step and k: turning point, half way, close to the end; k of either sign, large and small.
STARTS = [
    (0, 0, 0.2, 0.0),
    (0, 0, 0.2, 1.0),
    (0, 0, 0.2, -1e-30),
    (0, 0, 2.0**-10, 1000.0),
    (0, 0, 2.0**-10, -1000.0),
    (0.375, 0.25, 0.25, 3.0),
    (0.375, 0.25, 0.25, -3.0),
    (0.984375, 0.25, 0.25, 0.5),
    (0.5, 2.0**-13, 2.0**-10, -2000.0),
]


def coefficients(start, terms: int, bits: int = BITS) -> list[int]:
    u, slope, h, k = (dyadic(float(number)) for number in start)
    one = 1 << bits
    return flow.taylor(u.times(one), slope.times(one), h, k, bits, terms)


def exact_coefficients(start, terms: int) -> list[Fraction]:
    """From u'' = 2 h^2 R^4 + h k R^2 u' with R = 1 - u, all products written out."""
    u0, u1, h, k = (Fraction(number) for number in start)
    u = [u0, u1]
    for j in range(terms - 2):
        r = [1 - u[0], *(-c for c in u[1:])]
        square = [sum(r[i] * r[n - i] for i in range(n + 1)) for n in range(j + 1)]
        fourth = sum(square[i] * square[j - i] for i in range(j + 1))
        damping = sum(square[i] * (j - i + 1) * u[j - i + 1] for i in range(j + 1))
        u.append((2 * h * h * fourth + h * k * damping) / ((j + 1) * (j + 2)))
    return u


@pytest.mark.parametrize("start", STARTS)
def test_the_first_coefficients_against_exact_rational_arithmetic(start):
    for found, exact in zip(coefficients(start, 12), exact_coefficients(start, 12), strict=True):
        assert abs(found - exact * ONE) <= 12


@pytest.mark.parametrize("start", STARTS)
def test_one_by_one_against_newtons_iteration(start, monkeypatch):
    """Two routes to the same coefficients; both are short of the truth by at most a few units."""
    one_by_one = coefficients(start, 300)
    monkeypatch.setattr(flow, "NEWTON_FROM", 0)
    doubled = coefficients(start, 300)
    assert len(doubled) == 300
    assert max(abs(a - b) for a, b in zip(one_by_one, doubled, strict=True)) <= 60


# --- branches ---------------------------------------------------------------------------------------------------------

DAMPINGS = [0.0, 1e-300, 1e-9, 0.3, 1.0, 7.5, 200.0, 1e6]
SIGNED = [*DAMPINGS, *(-k for k in DAMPINGS[1:])]


def value(coefficients: list[int], z: Fraction) -> Fraction:
    total = Fraction(0)
    for c in reversed(coefficients):
        total = total * z + c
    return total


@pytest.mark.parametrize("k", SIGNED)
@pytest.mark.parametrize("accuracy", [20, 60, 250])
def test_the_last_piece_ends_where_the_force_or_the_compression_vanishes(k, accuracy):
    branch = integrate(dyadic(k), accuracy)
    one, last = 1 << branch.bits, branch.pieces[-1]
    assert 0 < branch.root <= one

    def excess(root: int) -> Fraction:
        """r^2 - |k| p in unloading, r in loading and where it is negative."""
        z = Fraction(root, one)
        r, p = 1 - value(last.u, z) / one, value(last.y, z) / one / (2 * fraction(last.h))
        return r if k >= 0 or r < 0 else r * r + Fraction(k) * p

    # A unit of du/dz is k/h units of the force, which falls as slowly as 1/k^2.
    width = 1 << 2 * len(last.u).bit_length() + 10 + (int(4 * log2(1 - k)) if k < 0 else 0)
    assert excess(max(branch.root - width, 0)) > 0 > excess(branch.root + width)


@pytest.mark.parametrize("k", SIGNED)
def test_steps_are_as_long_as_the_accuracy_allows(k):
    """Halved steps would need twice as many pieces; too long ones would leave large last coefficients."""
    branch = integrate(dyadic(k), 100)
    assert len(branch.pieces) <= 6 + 1.2 * log(1 + abs(k))
    for piece in branch.pieces:
        assert max(map(abs, piece.u[-3:])) < max(piece.u[1:3]) >> 95
    assert all(after.h.mantissa > 0 and after.u[1] > 0 for _, after in pairwise(branch.pieces))


@pytest.mark.parametrize("k", [30, -30])
def test_a_step_that_is_too_long_is_shortened_without_a_new_expansion(k, monkeypatch):
    expansions = []
    taylor = flow.taylor
    monkeypatch.setattr(flow, "taylor", lambda *given: expansions.append(given[2]) or taylor(*given))
    branch = integrate(Dyadic(k, 0), 100)
    assert len(expansions) == len(branch.pieces)
    assert [piece.h for piece in branch.pieces] != expansions  # some were too long


def test_no_end_is_an_error(monkeypatch):
    monkeypatch.setattr(flow, "MAX_PIECES", 3)
    with pytest.raises(ArithmeticError, match="not found"):
        integrate(dyadic(1e6), 60)


@pytest.mark.parametrize("k", [1e-5, 0.3, 7.5, 200.0, 1e5, -1e-5, -0.3, -7.5, -200.0, -1e5])
def test_sensitivity_against_a_difference(k):
    """d ln p/d ln k at the end, by the linearised flow and by integrating twice."""
    step = Fraction(1, 10**8)
    ends = []
    for factor in (1 + step, 1 - step):
        scaled = Fraction(k) * factor
        neighbour = integrate(Dyadic(int(scaled * 2**200), -200), 100)
        with working(300):
            ends.append(neighbour.p_end)
    sensitivity = integrate(dyadic(k), 100).sensitivity()
    with working(300):
        difference = (ends[0] / ends[1]).log() * 10**8 / 2
        # Its own error is of the order of 10^-16 of it; p_end has 100 bits, of which the difference loses 27.
        assert abs(float(sensitivity - difference)) < 1e-12 * abs(float(difference)) + 1e-19


@pytest.mark.parametrize("k", [0.3, -7.5, 1e6])
@pytest.mark.parametrize("precision", [2, 3000])
def test_branches_do_not_depend_on_flints_precision(k, precision):
    usual = integrate(dyadic(k), 300)
    with working(precision, 1):
        assert integrate(dyadic(k), 300) == usual
