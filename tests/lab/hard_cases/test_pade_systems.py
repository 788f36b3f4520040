"""The digits that Padé systems lose: the quick run, second routes to its numbers, and checks that can fail."""

import math
from dataclasses import replace
from fractions import Fraction
from types import SimpleNamespace

import numpy as np
import pytest
from flint import fmpq

from tests.lab.hard_cases.hard_case import assert_passes, assert_readable
from viscopade.arithmetic.balls import exact_middle
from viscopade.theory.pade import pade, rational_pade
from viscopade.theory.series import series
from viscopade_lab.hard_cases import pade_systems
from viscopade_lab.hard_cases.pade_systems import (
    CASE,
    berlekamp_massey,
    breaks_down,
    condition_number,
    disagreements,
    euclid,
    lost_digits,
    partial_quotients,
    quotient_difference,
    reciprocal,
    rounded,
)


@pytest.fixture(scope="module")
def result():
    return CASE.run(False)


def rational_series(order: int, digits: int = 25) -> list[fmpq]:
    return [fmpq(x.numerator, x.denominator) for x in map(Fraction, series(order, digits).decimals())]


def fractions(numbers: list[fmpq]) -> list[Fraction]:
    return [Fraction(int(x.p), int(x.q)) for x in numbers]


def holding(losses: list, different: int = 0) -> list[bool]:
    return [check.holds for check in pade_systems._checks(losses, different)]


def test_the_quick_run_passes(result):
    assert_passes(result)


def test_what_is_reported_can_be_read(result):
    assert_readable(result)
    assert "Every [m/m+3] tried exists" in result.summary
    assert "QD divides by h_1 = 0" in result.summary


@pytest.mark.slow
def test_the_thorough_run_passes():
    assert_passes(CASE.run(True))


# --- the algorithms, by other means -----------------------------------------------------------------------------------


@pytest.mark.parametrize("m", range(8))
def test_all_algorithms_solve_the_order_conditions_exactly(m):
    h = rational_series(2 * m + 3)
    for solver in (euclid, berlekamp_massey, quotient_difference):
        b = solver(h, m, fmpq(1))
        assert b[0] == 1
        for k in range(m + 1, 2 * m + 4):
            assert sum((b[i] * h[k - i] for i in range(min(k, m + 3) + 1)), fmpq(0)) == 0


def test_two_algorithms_find_the_closed_form_of_the_exponential():
    m, n = 4, 7
    h = [fmpq(1, math.factorial(k)) for k in range(m + n + 1)]
    exact = [
        Fraction(math.comb(n, j) * math.factorial(m + n - j), math.factorial(m + n)) * (-1) ** j for j in range(n + 1)
    ]
    assert fractions(euclid(h, m, fmpq(1))) == exact
    assert fractions(berlekamp_massey(h, m, fmpq(1))) == exact


def test_quotients_of_the_exponential():
    """e^z = 1/(1 - z/(1 + (1/2) z/(1 - (1/6) z/(1 + (1/6) z/(1 - (1/10) z/…))))) (Gauss)."""
    h = [fmpq(1, math.factorial(k)) for k in range(6)]
    expected = [Fraction(1), Fraction(1), -Fraction(1, 2), Fraction(1, 6), -Fraction(1, 6), Fraction(1, 10)]
    assert fractions(partial_quotients(h, fmpq(1))) == expected


def test_reciprocal_series():
    h = rational_series(9)
    f = reciprocal(h, fmpq(1))
    assert [sum((h[i] * f[k - i] for i in range(k + 1)), fmpq(0)) for k in range(10)] == [1, *9 * [0]]
    assert (f[1], f[3]) == (0, 0)


def test_only_the_series_itself_stops_quotient_difference():
    h = rational_series(13)
    assert breaks_down(h)
    assert not breaks_down(reciprocal(h, fmpq(1))[4:])


def test_berlekamp_massey_gives_the_printed_coefficients():
    h = rational_series(23, 60)
    b = berlekamp_massey(h, 10, fmpq(1))
    for ours, theirs in zip(fractions(b), pade(10, 13, 30).decimals()[1], strict=True):
        assert abs(ours / Fraction(theirs) - 1) <= Fraction(5, 10**30)


# --- the condition number, by other means -----------------------------------------------------------------------------


@pytest.mark.parametrize("m", [1, 3, 5])
def test_the_condition_number_is_that_of_finite_differences(m):
    h = rational_series(2 * m + 3)
    step = fmpq(1, 10**15)
    b = berlekamp_massey(h, m, fmpq(1))
    total = [Fraction(0)] * len(b)
    for k in range(len(h)):
        other = berlekamp_massey([x * (1 + step) if j == k else x for j, x in enumerate(h)], m, fmpq(1))
        for i, (x, y) in enumerate(zip(other, b, strict=True)):
            total[i] += abs(fractions([(x / y - 1) / step])[0]) if y != 0 else 0
    assert condition_number(h, b, m, 100) == pytest.approx(float(max(total)), rel=1e-9)


@pytest.mark.parametrize("m", [3, 7, 13])
def test_numpy_in_double_loses_no_more_either(m):
    h = [float(x) for x in series(2 * m + 3, 20).decimals()]
    matrix = [[h[m + j - i] if m + j >= i else 0.0 for i in range(m + 3)] for j in range(m + 3)]
    b = np.linalg.solve(matrix, [-h[m + j + 1] for j in range(m + 3)])
    true = pade(m, m + 3, 30).decimals()[1][1:]
    digits_lost = math.log10(max(abs(x / float(y) - 1) for x, y in zip(b, true, strict=True)) * 2.0**53)
    assert 0.5 < digits_lost < lost_digits(m).condition + 1


def test_rounding_keeps_sign_and_exponent():
    h = series(11, 40)
    for h_k in h.h:
        number, true = fractions([rounded(h_k, 30)])[0], exact_middle(h_k)
        assert abs(number - true) <= abs(true) / 2**30
        assert number.numerator.bit_length() <= 30


# --- checks that can fail ---------------------------------------------------------------------------------------------


def test_too_few_digits_are_noticed(monkeypatch):
    monkeypatch.setattr(pade_systems, "pade", lambda m, n, digits: pade(m, n, 8))
    covered, seen, proven, printed, *_ = holding([lost_digits(5)])
    assert (covered, seen, proven, printed) == (False, False, False, False)


def test_a_series_with_more_widths_than_digits_is_noticed():
    good = lost_digits(10)
    assert all(holding([good]))
    bad = replace(good, chosen=good.chosen - 24)
    assert holding([bad])[:2] == [False, False]
    assert not holding([replace(good, balls={**good.balls, "preconditioned": None})])[2]


def test_a_condition_number_that_is_too_small_is_noticed(monkeypatch):
    monkeypatch.setattr(pade_systems, "condition_number", lambda *given: condition_number(*given) / 1000)
    assert [i for i, holds in enumerate(holding([lost_digits(5)])) if not holds] == [4]


def test_balls_that_take_what_may_be_zero_for_zero_are_noticed(monkeypatch):
    monkeypatch.setattr(pade_systems, "_vanishes", lambda number: (number != 0) is False)
    assert lost_digits(16).missed > 0


def test_a_wrong_recursion_is_noticed(monkeypatch):
    assert disagreements(3, rational_series(9)) == 0
    monkeypatch.setattr(pade_systems, "reciprocal", lambda h, one: [*reciprocal(h, one)[:-1], one])
    assert disagreements(3, rational_series(9)) == 1
    assert not all(holding([lost_digits(3)], 1))


def test_a_wrong_digit_is_noticed(monkeypatch):
    """One approximant is made from 29 digits only."""
    true = pade(5, 8, 30)
    h = [Fraction(x) for x in series(13, 29).decimals()]
    assert pade_systems._unit_error(true, 54) <= 5
    wrong = rational_pade(h, 5, 8, 30)
    assert pade_systems._unit_error(SimpleNamespace(m=5, h=true.h, decimals=wrong.decimals), 54) > 5
