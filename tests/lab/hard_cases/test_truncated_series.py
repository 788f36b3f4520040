"""The truncated series: the quick run passes, its numbers by mpmath and fractions, and that its checks can fail."""

import math
from fractions import Fraction
from functools import partial

import mpmath
import numpy as np
import pytest
from flint import arb

import viscopade as vp
from tests.lab.hard_cases.hard_case import assert_passes, assert_readable
from viscopade.arithmetic.balls import exact_middle, working
from viscopade.arithmetic.decimals import at_least
from viscopade.collision import exact
from viscopade.theory.pade import horner
from viscopade_lab import compensated, singularity
from viscopade_lab.hard_cases import truncated_series as case

close_to = partial(pytest.approx, abs=0)  # else all numbers below 1e-12 are equal

EARLIER, EARLIEST, DEFECT, CONTINUED, IN_DOUBLE, HORNER, TERMS, COMPENSATED, TWO_DOUBLES = range(9)


@pytest.fixture(scope="module")
def result():
    return case.CASE.run(False)


@pytest.fixture(scope="module")
def given():
    return case.truncations(case.ORDER[False])


@pytest.fixture(scope="module")
def left(given):
    return case.leaving(given)


def test_quick_run_passes(result):
    assert_passes(result)
    assert len(result.checks) == 9


@pytest.mark.slow
def test_thorough_run_passes():
    assert_passes(case.CASE.run(True))


def test_the_report_is_about_what_was_measured(result, left, given):
    assert f"k_c = {int(np.argmax(left.exact))} with {at_least(left.exact.max(), 4)}" in result.summary
    assert f"R = {given.radius:.6f}" in result.summary
    assert {len(chart.curves) for chart in result.charts} == {3, 8, 6}
    assert_readable(result)


# --- where sums leave: mpmath, without the polynomials and panels of the package --------------------------------------


@pytest.mark.parametrize("order", [0, 4, 7, 20, 41, 80])
def test_places_by_mpmath(left, order):
    mp = mpmath.mp.clone()
    mp.dps = 30
    h = [mp.mpf(text) for text in vp.series(order, 35).decimals()]
    place = left.exact[order]

    def off(v):
        return abs(mp.polyval(h[::-1], v) / mp.mpf(exact.collision(str(v), 25).decimals()["epsilon"]) - 1)

    low, high = (off(mp.mpf(place) * (1 + side * mp.mpf("1e-13"))) for side in (-1, 1))
    assert low < case.TOLERANCE < high


def test_no_order_is_off_before(left, given):
    """At other points than those of the search."""
    h = given.floats()
    for order, place in enumerate(left.exact):
        v = np.random.default_rng(order).uniform(1e-3, place * (1 - 1e-9), 400)
        assert abs(horner(h[: order + 1], v) / vp.epsilon(v) - 1).max() < case.TOLERANCE


def test_radius_of_convergence_from_the_coefficients_alone(given):
    """No equation of motion: the other route to the singularity."""
    other = singularity.from_coefficients(60)
    assert abs(given.v_s / complex(other.v_star) - 1) < min(float(other.uncertainty), 0.01)
    assert given.radius == close_to(abs(given.v_s), rel=1e-9)


def test_exact_epsilon_is_that_of_the_package(given):
    with working(case.BITS):
        for v in (0.03, 0.5, given.radius, 1.2):
            assert case.true_value("epsilon", arb(v)).overlaps(exact.collision(v, 25).epsilon)


def test_prediction_is_a_geometric_series(given):
    """Continued with its recursion, term by term, two coefficients give the closed form."""
    p, q = case._pair(given)
    h, v, order = given.floats(), 0.6, 30
    a, b, rest = h[order + 1], h[order + 2], 0.0
    for j in range(order + 1, order + 200):
        rest += a * v**j
        a, b = b, p * b - q * a
    grid = np.full((given.order + 1, 1), v)
    assert case._continued(given, grid)[order, 0] == close_to(rest, rel=1e-12)


def test_amplitudes_of_a_pair_of_poles(given):
    """Re(A v_s^-k) with a constant A: |A| comes out, and no defect."""
    pure = made(given, [(1 - 2j) * given.v_s**-k for k in range(given.order + 3)])
    assert case.amplitudes(pure) == close_to(math.sqrt(5), rel=1e-12)
    assert case.defects(pure).max() < 1e-12


def test_amplitudes_that_fall_like_ln_k_by_k_meet_the_limit_of_the_check(given):
    """What the theory says of the h_k: its defects are below the limit, and not far."""
    terms = [math.log(k + 1) / (k + 1) * given.v_s**-k for k in range(given.order + 3)]
    defect = case.defects(made(given, terms))
    assert 0.3 < defect.max() <= 1.0


def made(given, terms):
    with working(case.BITS):
        return given._replace(h=tuple(case.arb(complex(term).real) for term in terms))


# --- checks that fail -------------------------------------------------------------------------------------------------


def failing(given, left):
    return [i for i, check in enumerate(case._leaving_checks(given, left)) if not check.holds]


def test_a_place_too_far_is_noticed(given, left):
    assert EARLIER in failing(given, left._replace(exact=left.exact * 1.002))


def test_a_place_too_near_is_noticed(given, left):
    assert EARLIEST in failing(given, left._replace(exact=left.exact * 0.98))


@pytest.mark.parametrize("factor", [0.98, 1.05, np.exp(0.02j), np.exp(-0.02j)])
def test_another_singularity_is_noticed(given, left, factor):
    v_s = given.v_s * factor
    wrong = given._replace(v_s=v_s, radius=abs(v_s))
    assert failing(wrong, left) == [DEFECT]


def test_a_remainder_without_its_phase_is_noticed(given, left, monkeypatch):
    """The first neglected term alone, as if it were a geometric series."""
    h = given.floats()[1:-1, None]
    k = np.arange(given.order + 1)[:, None]
    monkeypatch.setattr(case, "_continued", lambda _, v: h * v ** (k + 1) / (1 - v / given.radius))
    assert failing(given, left._replace(surprise=case._surprise(given, left.exact))) == [CONTINUED]


def test_a_sum_in_less_than_double_is_noticed(given, left):
    assert failing(given, left._replace(in_double=left.in_double * (1 + 1e-11))) == [IN_DOUBLE]


def test_an_order_that_never_leaves_is_refused():
    with pytest.raises(ArithmeticError, match="nowhere"):
        case._first(np.zeros_like, 3)
    with pytest.raises(ArithmeticError, match="does not leave"), working(case.BITS):
        case._refined(tuple(vp.series(10, 20).h), 0.5)


# --- rounding ---------------------------------------------------------------------------------------------------------


@pytest.fixture(scope="module")
def hard(given):
    """Order 40 next to its zero and elsewhere."""
    (zero,) = case.zeros(given, 40)
    return case.sums(given, 40, [0.5, 1.2, *case.approaching(zero, 4)])


def test_zero_by_numpy(given):
    (zero,) = case.zeros(given, 40)
    roots = np.roots(given.floats()[40::-1])
    assert abs(roots - zero).min() < 1e-9


def test_errors_by_fractions(given, hard):
    c = given.floats()[:41]
    exactly = [sum(Fraction(x) * Fraction(v) ** k for k, x in enumerate(c.tolist())) for v in hard.v_star.tolist()]
    for row, computed in ((0, horner(c, hard.v_star)), (2, compensated.compensated_horner(c, hard.v_star))):
        for i, truth in enumerate(exactly):
            assert hard.errors[row, i] == close_to(float(abs(Fraction(float(computed[i])) / truth - 1)), rel=1e-9)
    sizes = [sum(abs(Fraction(x)) * Fraction(v) ** k for k, x in enumerate(c.tolist())) for v in hard.v_star.tolist()]
    assert hard.condition == close_to([float(s / abs(t)) for s, t in zip(sizes, exactly, strict=True)], rel=0.2)
    assert hard.bounds[0] == close_to([80 * 2**-53 * s / abs(t) for s, t in zip(sizes, exactly, strict=True)], rel=1e-9)


def test_errors_against_the_series_by_fractions(given, hard):
    h = [exact_middle(h_k) for h_k in given.h[:41]]
    c = np.array([float(h_k) for h_k in h])
    low = np.array([float(h_k - Fraction(float(h_k))) for h_k in h])
    computed = compensated.compensated_horner(c, hard.v_star, low)
    for i, v in enumerate(hard.v_star.tolist()):
        truth = sum(h_k * Fraction(v) ** k for k, h_k in enumerate(h))
        assert hard.errors[3, i] == close_to(float(abs(Fraction(float(computed[i])) / truth - 1)), rel=1e-6)


def test_next_to_a_zero_only_coefficients_in_two_doubles_help(hard):
    worst = np.argmax(hard.condition)
    assert hard.condition[worst] > 1e14
    assert hard.errors[0, worst] > 1e-3
    assert hard.errors[2, worst] < 2.3e-16 < 1e-3 < hard.of_series[2, worst]
    assert hard.errors[3, worst] < 2.3e-16


def sums_failing(found):
    return [i for i, check in enumerate(case._sums_checks(case._worst([found])), HORNER) if not check.holds]


def evaluated_with(monkeypatch, given, **changes):
    for name, function in changes.items():
        monkeypatch.setattr(case, name, function)
    (zero,) = case.zeros(given, 40)
    return sums_failing(case.sums(given, 40, case.approaching(zero, 4)))


def test_all_checks_of_rounding_hold_before_anything_is_broken(hard):
    assert sums_failing(hard) == []


def test_compensated_without_correction_is_noticed(given, monkeypatch):
    monkeypatch.setattr(compensated, "compensated_horner", lambda c, x, low=None: horner(c, x))
    assert evaluated_with(monkeypatch, given) == [COMPENSATED, TWO_DOUBLES]


def test_a_product_whose_error_is_not_split_is_noticed(given, monkeypatch):
    """Without Veltkamp's splitting the error of a product is lost."""
    monkeypatch.setattr(compensated, "split", lambda x: (x, np.zeros_like(x)))
    assert evaluated_with(monkeypatch, given) == [COMPENSATED, TWO_DOUBLES]


def test_low_parts_left_out_are_noticed(given, monkeypatch):
    whole = compensated.compensated_horner
    monkeypatch.setattr(compensated, "compensated_horner", lambda c, x, low=None: whole(c, x))
    assert evaluated_with(monkeypatch, given) == [TWO_DOUBLES]


def test_single_precision_is_noticed(given, monkeypatch):
    assert evaluated_with(monkeypatch, given, horner=lambda c, x: horner(c.astype(np.float32), x)) == [HORNER]


def test_powers_by_single_precision_are_noticed(given, monkeypatch):
    def terms(c, v):
        return np.array([math.fsum(c * np.float32(x) ** np.arange(len(c))) for x in v])

    assert evaluated_with(monkeypatch, given, _terms=terms) == [TERMS]
