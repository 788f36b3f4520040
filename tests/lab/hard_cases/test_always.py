"""What always holds: the quick run passes, hypothesis looks for exceptions, and what is broken is seen."""

import dataclasses
import math
from fractions import Fraction

import mpmath
import numpy as np
import pytest
from flint import acb, arb
from hypothesis import HealthCheck, example, given, settings
from hypothesis import strategies as st
from hypothesis.extra import numpy as hnp

from tests.lab.hard_cases.hard_case import (
    assert_goes_to_json_and_back,
    assert_passes,
    assert_readable,
    assert_same_checks,
)
from viscopade.arithmetic.balls import working
from viscopade.arrays import double
from viscopade.collision import exact
from viscopade.kernels import native
from viscopade.theory.pade import pade
from viscopade_lab.hard_cases import always

CASE = always.CASE
moderate = settings(max_examples=100, derandomize=True, suppress_health_check=list(HealthCheck))
few = settings(moderate, max_examples=4)
many = settings(moderate, max_examples=50_000)

everywhere = st.floats(0, 1.7976931348623157e308)
normal = st.floats(1e-150, 1e90)


@pytest.fixture(scope="module")
def quick():
    return CASE.run(False)


def test_the_quick_run_passes(quick):
    assert_passes(quick)
    assert len(quick.charts) == 3
    assert_readable(quick)


def test_the_result_goes_to_json_and_back(quick):
    assert_goes_to_json_and_back(CASE, quick)


@pytest.mark.slow
def test_the_thorough_run_passes(quick):
    result = CASE.run(True)
    assert_passes(result)
    assert_same_checks(result, quick)


# --- 0 < eps <= 1, and the sum ----------------------------------------------------------------------------------------


def assert_properties(v_star, beta):
    x = np.array([v_star])
    assert always.out_of_range(double.epsilon(x), x) == 0
    assert always.out_of_range(native.restitution(x, beta), np.sqrt(beta) * x**0.1) == 0
    assert always.sum_off(x)[0] <= 1
    assert double.x_max(x)[0] >= double.x_max(2 * x if v_star < 1e300 else x)[0]


@moderate
@given(everywhere, st.floats(1e-300, 1e300))
@example(0.0, 1.0)
@example(5e-324, 5e-324)
@example(always.LAST_POSITIVE, 1.0)
@example(always.FIRST_ZERO, 1.0)
def test_eps_is_in_range(v_star, beta):
    assert_properties(v_star, beta)


@pytest.mark.slow
@many
@given(everywhere, st.floats(1e-300, 1e300))
def test_eps_is_in_range_at_many(v_star, beta):
    assert_properties(v_star, beta)


def test_where_eps_underflows():
    """The leading term (section 2.5) at the two ends, in many digits; and eps in double precision."""
    with mpmath.workdps(40):
        for v_star, power in ((always.LAST_POSITIVE, 1074), (always.FIRST_ZERO, 1075)):
            leading = (mpmath.mpf(3) / 2) ** (mpmath.mpf(2) / 3) * mpmath.mpf(v_star) ** (-mpmath.mpf(10) / 3)
            assert abs(leading * 2**power - 1) < 1e-8
    assert double.epsilon(always.LAST_POSITIVE) == 5e-324
    assert double.epsilon(always.FIRST_ZERO) == 0


def test_an_eps_out_of_range_is_seen():
    v_star = np.array([1e-3, 1.0, 1e80, 2e97])
    good = double.epsilon(v_star)
    assert always.out_of_range(good, v_star) == 0
    for i, bad in ((0, 1 + 2.0**-52), (1, 0.0), (2, math.nan), (3, 5e-324), (1, -0.1)):
        changed = good.copy()
        changed[i] = bad
        assert always.out_of_range(changed, v_star) == 1


def test_a_sum_that_is_off_is_seen(monkeypatch):
    good = double.one_minus_epsilon
    monkeypatch.setattr(double, "one_minus_epsilon", lambda v: good(v) * (1 + 2.0**-49))
    assert always.sum_off(np.geomspace(0.1, 10, 500)).max() > 1


def test_eps_at_rest_is_one(monkeypatch):
    count, wrong = always.wrong_at_rest()
    assert wrong == 0
    assert count > 20
    monkeypatch.setattr(native, "restitution", lambda speed, beta: np.float64(1 - 2.0**-53))
    assert always.wrong_at_rest()[1] == 16


# --- from one number to the next --------------------------------------------------------------------------------------


def test_a_computed_eps_rises_once():
    """By one unit in the last place, where the exact function falls by less than that."""
    before = always.RISES
    after = math.nextafter(before, 1)
    assert double.epsilon(after) == double.epsilon(before) + 2.0**-53
    first, second = (exact.collision(v, 30).epsilon for v in (before, after))
    assert second < first
    assert first - second < 2.0**-53


@moderate
@given(normal, st.integers(1, 1000))
def test_steps_in_the_wrong_direction(v_star, places):
    x = np.array([v_star])
    for name, direction in always.OF_V_STAR.items():
        wrong = -direction * always.steps(getattr(double, name), x, places)[0]
        assert wrong <= 2 * double.ULP[name]


@pytest.mark.slow
@many
@given(normal, st.integers(1, 1000))
def test_many_steps_in_the_wrong_direction(v_star, places):
    x = np.array([v_star])
    for name, direction in always.OF_V_STAR.items():
        assert -direction * always.steps(getattr(double, name), x, places)[0] <= 2 * double.ULP[name]


def test_a_function_that_rises_is_seen():
    x = np.geomspace(1e-3, 1e3, 1000)
    found = always.wrong_steps("mutant", lambda v: double.epsilon(v) * (1 + (v > 1) * 2.0**-50), -1, np.array([1.0]), 2)
    assert found.worst > found.limit
    assert found.wrong == 1
    assert always.wrong_steps("nan", lambda v: v * math.nan, -1, x, 2).worst == math.inf


# --- proven -----------------------------------------------------------------------------------------------------------


@few
@given(st.floats(1, 9.99), st.integers(-4, 8), st.integers(1, 9))
def test_order_is_proven(mantissa, exponent, power):
    assert always.monotone_pair(f"{mantissa:.6f}e{exponent}", power).holds


@pytest.mark.slow
@settings(moderate, max_examples=100)
@given(st.floats(1, 9.99), st.integers(-8, 25), st.integers(1, 20))
def test_order_is_proven_for_many(mantissa, exponent, power):
    assert always.monotone_pair(f"{mantissa:.6f}e{exponent}", power).holds


def test_an_order_that_is_not_proven_is_seen(monkeypatch):
    good = exact.collision
    monkeypatch.setattr(exact, "collision", lambda v, digits: good(v, 6))
    assert not always.monotone_pair("2.5", 9).holds


@few
@given(st.floats(1, 9.99), st.integers(-20, 6))
def test_enclosures_are_nested(mantissa, exponent):
    assert always.nested_enclosures(f"{mantissa:.6f}e{exponent}", (6, 13, 27))[2:] == (0, 0)


def test_enclosures_that_are_not_nested_are_seen(monkeypatch):
    good = exact.collision

    def shifted(v_star, digits):
        found = good(v_star, digits)
        if digits < 20:
            return found
        with working(200):
            return dataclasses.replace(found, x_max=found.x_max * (1 + arb("1e-11")))

    monkeypatch.setattr(exact, "collision", shifted)
    found = always.nested_enclosures("1.5", (10, 20, 30))
    assert found.not_nested == 1
    assert found.not_rounded <= 1


# --- scaling ----------------------------------------------------------------------------------------------------------


@moderate
@given(st.floats(-60, 60), st.floats(-30, 30), st.integers(-40, 40), st.floats(1e-6, 1e6))
def test_eps_depends_on_beta_to_the_fifth_times_speed(w, beta, power, factor):
    w, beta = 2.0**w, 2.0**beta
    speed, beta = np.array([w / beta**5]), np.array([beta])
    assert always.scaled_by_powers_of_two(speed, beta, np.array([power])) == 0
    _, change, limit = always.scaled(float(speed[0]), float(beta[0]), factor)
    assert change <= limit


def test_a_function_of_something_else_is_seen(monkeypatch):
    good = native.restitution
    monkeypatch.setattr(native, "restitution", lambda speed, beta: good(speed, beta * (1 + 1e-13 * np.log(beta))))
    speed, beta = np.geomspace(0.1, 10, 50), np.geomspace(0.2, 5, 50)
    assert always.scaled_by_powers_of_two(speed, beta, np.full(50, 4)) > 20
    change, limit = always.scaled(1.0, 1.3, 1000.0)[1:]
    assert change > limit


# --- arrays -----------------------------------------------------------------------------------------------------------

arrays = hnp.arrays(np.float64, st.integers(1, 40).map(lambda n: 2 * n), elements=st.floats(0, 1))


@moderate
@given(st.sampled_from(list(always.FUNCTIONS)), arrays)
def test_the_layout_does_not_matter(name, x):
    assert always.changed_by_layout(name, x) == 0


def test_results_that_depend_on_the_layout_are_seen(monkeypatch):
    def careless(x):
        x = np.asarray(x)
        return double.epsilon(np.where(x.strides == (8,), x, np.nextafter(x, 2)) if x.ndim == 1 else x)

    monkeypatch.setitem(always.FUNCTIONS, "careless", careless)
    assert always.changed_by_layout("careless", np.linspace(0.1, 0.9, 50)) > 0


# --- Padé approximants ------------------------------------------------------------------------------------------------


def test_division_of_series():
    """1/(1 + x) (1 + 2 x) and the geometric series, in fractions."""
    with working(128):
        found = always.divided([arb(1), arb(2)], [arb(1), arb(1)], 5)
        assert [float(c) for c in found] == [1, 1, -1, 1, -1, 1]
        assert [float(c) for c in always.divided([arb(1)], [arb(1), arb(-3)], 4)] == [1, 3, 9, 27, 81]


@few
@given(st.integers(0, 8), st.integers(0, 8))
@example(0, 3)
@example(3, 6)
def test_approximants_expand_to_the_series(m, n):
    try:
        found = always.expanded(m, n, 40)
    except always.DegenerateError:
        return
    assert (found.outside, found.without_conjugate, found.missing) == (0, 0, 0)
    assert found.width < 1e-20


def test_the_expansion_in_mpmath():
    """The Maclaurin series of the quotient by mpmath's numerical derivatives."""
    with mpmath.workdps(60):
        texts = pade(2, 5, 50).decimals()
        a, b = ([mpmath.mpf(c) for c in part] for part in texts)
        taylor = mpmath.taylor(lambda v: mpmath.polyval(a[::-1], v) / mpmath.polyval(b[::-1], v), 0, 7)
    with working(200):
        ours = always.divided(*([arb(c) for c in part] for part in texts), 7)
    assert [float(c) for c in ours] == pytest.approx([float(c) for c in taylor], rel=1e-12, abs=1e-20)


def test_a_coefficient_that_is_off_is_seen(monkeypatch):
    good = always.pade

    class WrongSteps:
        def __init__(self, approximant):
            self._approximant = approximant

        def __getattr__(self, name):
            return getattr(self._approximant, name)

        def decimals(self):
            a, b = self._approximant.decimals()
            return a, (*b[:-1], b[-1][:-10] + ("0" if b[-1][-10] != "0" else "1") + b[-1][-9:])

    monkeypatch.setattr(always, "pade", lambda *arguments: WrongSteps(good(*arguments)))
    assert always.expanded(3, 6, 40).outside > 0


def test_roots_without_partners_are_seen():
    poles = pade(3, 6, 30).poles
    assert any(not pole.real for pole in poles)
    assert always.without_conjugate(poles) == 0
    rest = [pole for pole in poles if pole is not next(p for p in poles if not p.real)]
    assert always.without_conjugate(rest) == 1
    with working(200):
        moved = [dataclasses.replace(poles[0], value=poles[0].value + acb(0, "1e-9")), *poles[1:]]
    assert always.without_conjugate(moved) == (0 if poles[0].real else 2)


def test_roots_that_are_missing_are_seen():
    approximant = pade(3, 6, 30)
    assert always._missing(approximant, 30) == 0
    fewer = dataclasses.replace(approximant, poles=approximant.poles[:-1])
    assert always._missing(fewer, 30) == 2


def test_the_limits_are_those_that_are_proven():
    low, high = (Fraction(2) ** Fraction(e) for e in (-6, 6))
    both, last = always.proven_restitution(low, high)
    assert always._restitution_limit("double") == 2 * (both + last) * 2.0**53
