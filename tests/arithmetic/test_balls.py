"""From enclosures to decimals: what is printed is the correct rounding of every number in the ball, or nothing."""

import copy
import pickle
from decimal import ROUND_HALF_EVEN, Context, Decimal
from fractions import Fraction

import pytest
from flint import arb, ctx
from hypothesis import given
from hypothesis import strategies as st
from mpmath import mp, mpf

from viscopade.arithmetic.balls import (
    bits_for,
    coefficient_sum,
    decimal_at,
    decimal_string,
    fixed_point,
    interval_ball,
    known_decimal,
    magnitude,
    relative_digits,
    to_mpf,
    working,
)
from viscopade.collision import exact
from viscopade.theory.pade import pade
from viscopade.theory.series import series
from viscopade_lab.hard_cases.exact_pade import rational_pade

mantissas = st.integers(-(10**30), 10**30)
exponents = st.integers(-60, 60)
digit_counts = st.integers(1, 25)


def ball_of(mantissa, error, exponent):
    """The ball (mantissa ± error) 2^exponent and its true ends, which the ball encloses."""
    with working(400):
        ball = arb(mantissa, error) * arb(2) ** exponent
    scale = Fraction(2) ** exponent
    return ball, ((mantissa - error) * scale, (mantissa + error) * scale)


def rounded(number: Fraction, digits: int) -> Decimal:
    """Correct rounding of an exact number, by the decimal module's own division."""
    wide = Context(prec=200).divide(Decimal(number.numerator), Decimal(number.denominator))
    return Context(prec=digits, rounding=ROUND_HALF_EVEN).create_decimal(wide)


@given(mantissas, st.integers(0, 10**28) | st.integers(0, 100), exponents, digit_counts)
def test_decimal_string_is_the_rounding_of_both_ends(mantissa, error, exponent, digits):
    ball, ends = ball_of(mantissa, error, exponent)
    text = decimal_string(ball, digits)
    if ball.is_exact() and ball.is_integer():
        assert text == str(mantissa * 2**exponent if exponent >= 0 else Fraction(mantissa) * Fraction(2) ** exponent)
    elif text is not None:
        assert {Decimal(text)} == {rounded(end, digits) for end in ends}
        assert "E" not in text
    else:
        # Refused with reason: a rounding boundary lies within the ball widened by the conversion's own 1e-14.
        slack = max(map(abs, ends)) * Fraction(1, 10 ** (digits + 12)) + (ends[1] - ends[0]) / 10**6
        assert rounded(ends[0] - slack, digits) != rounded(ends[1] + slack, digits) or ball.contains(0)


@given(mantissas.filter(bool), st.integers(0, 10**25) | st.integers(0, 100), exponents, digit_counts)
def test_decimal_at_rounds_at_the_place_of_the_size(mantissa, error, exponent, digits):
    ball, ends = ball_of(mantissa, error, exponent)
    size = abs(ball) * 7 + 1
    place = Fraction(10) ** (len(str(int(size.mid().floor().unique_fmpz()))) - digits)
    text = decimal_at(ball, size, digits)
    if text is not None:
        assert all(abs(Fraction(text) - end) <= place / 2 for end in ends)
        assert (Fraction(text) / place).denominator == 1
    else:
        slack = max(map(abs, ends)) / 10 ** (digits + 12) + (ends[1] - ends[0]) / 10**6
        assert round((ends[0] - slack) / place) != round((ends[1] + slack) / place)


@pytest.mark.parametrize("size", ["1", "10", "9.9999", "0.1", "1000000"])
def test_decimal_at_powers_of_ten(size):
    with working(200):
        ball = arb(1) / 3
        text = decimal_at(ball, arb(size), 5)
    places = 5 - len(size.partition(".")[0]) if not size.startswith("0") else 5
    assert text == f"{1 / 3:.{places}f}" if places > 0 else text == "0"


@pytest.mark.parametrize("ball", [arb("nan"), arb("inf"), arb("-inf"), arb(0, 1), arb(1, 2)])
def test_what_determines_no_digit(ball):
    assert decimal_string(ball, 3) is None
    with pytest.raises(ArithmeticError, match="determines no digit"):
        known_decimal(ball, 5)


def test_exact_integers_are_printed_whole():
    assert decimal_string(arb(0), 5) == "0"
    assert decimal_string(arb(-12), 5) == "-12"
    assert decimal_string(arb(3, 1e-30), 5) == "3.0000"


def test_ties_go_to_even_and_both_ends_count():
    assert decimal_string(arb(0.125), 2) in {"0.12", None}  # never 0.13
    assert decimal_string(arb("1.2501") + arb(0, "0.0002"), 2) is None


@pytest.mark.parametrize(("side", "text"), [(1, "0.12346"), (-1, "0.12345")])
def test_a_ball_is_rounded_however_close_to_a_tie_it_is(side, text):
    with working(300):
        ball = arb("0.123455") + side * arb(10) ** -50 + arb(0, 1e-60)
        assert decimal_string(ball, 5) == decimal_at(ball, arb("0.5"), 5) == text


def test_known_decimal_gives_what_is_known():
    assert known_decimal(arb("0.123456789 +/- 1e-6"), 8) == "0.12346"
    assert known_decimal(arb("0.123456789 +/- 1e-12"), 8) == "0.12345679"


@given(mantissas, st.integers(0, 10**40), st.integers(0, 200))
def test_fixed_point_encloses(value, error, bits):
    with working(53):
        ball = fixed_point(value, error, bits)
    with working(600):
        for end in (value - error, value, value + error):
            assert ball.contains(arb(end) * arb(2) ** -bits)


def test_relative_digits_ignores_exact_balls():
    assert relative_digits([arb(0), arb("1 +/- 1e-20"), arb("1 +/- 1e-10")]) in {9, 10}
    assert bits_for(10) == 34


def test_to_mpf_is_exact():
    with working(200):
        ball = -arb(1) / 3
    with mp.workdps(80):
        assert abs(to_mpf(ball) + mpf(1) / 3) < mpf(2) ** -199
    assert to_mpf(arb(0)) == 0


def test_working_puts_everything_back_after_an_error():
    saved = ctx.prec, ctx.cap
    with pytest.raises(RuntimeError), working(1000, 77):
        raise RuntimeError
    assert (ctx.prec, ctx.cap) == saved


# --- records of balls -------------------------------------------------------------------------------------------------

RECORDS = {
    "series": lambda: series(6, 30),
    "pade": lambda: pade(3, 6, 30),
    "exact and half-way": lambda: rational_pade([Fraction(1), Fraction(1, 2), Fraction(5, 4)], 1, 1, 1),
    "collision": lambda: exact.collision("1.5", 30),
    "elastic": lambda: exact.collision(0, 30),
    "infinite": lambda: exact.collision("inf", 30),
    "of another law": lambda: exact.collision(kappa="1.5", law="linear"),
}


@pytest.mark.parametrize("record", RECORDS)
@pytest.mark.parametrize("copied", [lambda x: pickle.loads(pickle.dumps(x)), copy.copy, copy.deepcopy])
def test_records_are_pickled_copied_and_compared(record, copied):
    original = RECORDS[record]()
    found = copied(original)
    assert found == original
    assert hash(found) == hash(original)
    assert repr(found) == repr(original)
    assert len({found, original}) == 1


@pytest.mark.parametrize("precision", [53, 5000])
def test_pickled_balls_are_the_same_to_the_last_bit(precision):
    with working(400):
        balls = [arb(n).sqrt().exp() for n in range(200)]
        balls += [arb(0, 1), arb(-3), arb.pos_inf(), arb(0), arb(2) ** -100_000 + arb(0, 1), arb("nan")]
    with working(precision):
        for ball in balls:
            found = pickle.loads(pickle.dumps(ball))
            assert str(found) == str(ball)
            assert not ball.is_finite() or (found.mid() == ball.mid() and found.rad() == ball.rad())


def test_records_that_prove_something_else_differ():
    assert series(3, 10) != series(3, 11)
    assert series(3, 10) != series(3, 10, "tsuji")
    assert pade(3, 6, 10) != pade(2, 5, 10)
    assert exact.collision(1, 10) != exact.collision(2, 10)
    assert exact.collision(1, 10) != series(3, 10)
    assert exact.collision("1.5", 20) == exact.collision(1.5, 20)


def test_bounds_of_balls():
    """By plain arithmetic: |x| <= 7/2 for x in -3 ± 1/2; 1 - 2 z + z^2/2 is 7/2 at z = -1."""
    with working(64):
        assert 0 <= magnitude(arb(-3, 0.5)) - Fraction(7, 2) < Fraction(1, 10**6)
        assert coefficient_sum([arb(1), arb(-2), arb(0.5)]) == 3.5
        both = interval_ball(Fraction(1, 3), Fraction(5, 2))
        assert both.contains(arb(1) / 3)
        assert both.contains(arb(2.5))
        assert float(both.rad()) == pytest.approx(13 / 12)
