"""Printed digits: the quick run passes, its numbers by fractions and closed forms, and that its checks can fail."""

from fractions import Fraction
from functools import partial
from math import sqrt

import pytest

from tests.lab.hard_cases.hard_case import assert_passes
from viscopade.arithmetic.balls import exact_middle, working
from viscopade.theory import paper, symbolic
from viscopade_lab.claims.approximants import error_at
from viscopade_lab.hard_cases import printed_digits as case

near = partial(pytest.approx, abs=0)  # else all numbers below 1e-12 are equal

ROUNDED, UNEQUAL, BOUND, ROOTS, POSITIVE = range(5)


@pytest.fixture(scope="module")
def result():
    return case.CASE.run(False)


@pytest.fixture(scope="module")
def found():
    return {p.full.label: {v: case.errors(p, v) for v in ("1e-8", "0.1", "1", "10", "1000")} for p in table()}


def table():
    return case.approximants()


def by_label(label):
    return next(p for p in table() if p.full.label == label)


LABELS = ("[0/3]", "[1/4]", "[2/5]", "[3/6]")


def test_quick_run_passes(result):
    assert_passes(result)
    assert len(result.checks) == 5


@pytest.mark.slow
def test_thorough_run_passes():
    assert_passes(case.CASE.run(True))


def test_report_has_all_approximants(result):
    errors, parts, roots = result.tables
    assert len(errors.rows) == 40
    assert [row[0] for row in parts.rows] == list(LABELS)
    assert ("[2/5]", "zero", "5.68011758332") in [row[:3] for row in roots.rows]
    assert "5.68011758332" in result.summary


# --- second routes ----------------------------------------------------------------------------------------------------


@pytest.mark.parametrize("label", LABELS)
@pytest.mark.parametrize("v_star", ["0.1", "1", "10", "1000"])
def test_errors_by_fractions(found, label, v_star):
    """Quotients of fractions, subtracted: nothing of the identity that the case rests on."""
    p, v = by_label(label), Fraction(v_star)
    full = [[exact_middle(c) for c in row] for row in (p.full.a, p.full.b)]

    def quotient(a, b):
        return sum(c * v**k for k, c in enumerate(a)) / sum(c * v**k for k, c in enumerate(b))

    as_printed, own = quotient(p.a, p.b), quotient(*full)
    error = found[label][v_star]
    assert error.epsilon == near(float(abs(as_printed / own - 1)), rel=1e-9)
    assert error.loss == near(float(abs((1 - as_printed) / (1 - own) - 1)), rel=1e-9)


@pytest.mark.parametrize("label", LABELS)
def test_small_speeds_by_the_first_coefficient(found, label):
    """1 - eps = (b_2 - a_2) v*^2 + …, and b_2 - a_2 is lambda_1 in closed form."""
    p = by_label(label)
    printed = p.b[2] - (p.a[2] if len(p.a) > 2 else 0)
    expected = float(printed / Fraction(str(symbolic.lambda_1().evalf(30)))) - 1
    assert found[label]["1e-8"].loss == near(abs(expected), rel=1e-6)


@pytest.mark.parametrize("label", ["[1/4]", "[2/5]", "[3/6]"])
def test_large_speeds_by_the_last_coefficients(found, label):
    p = by_label(label)
    expected = p.a[-1] / p.b[-1] / (exact_middle(p.full.a[-1]) / exact_middle(p.full.b[-1])) - 1
    assert case.errors(p, "1e9").epsilon == near(abs(float(expected)), rel=1e-3)


@pytest.mark.parametrize("m", range(4))
def test_own_error_is_that_of_the_claims(found, m):
    assert found[LABELS[m]]["1"].own_epsilon == near(abs(error_at(m, 1)), rel=1e-9)


@pytest.mark.parametrize("label", LABELS)
def test_own_error_at_small_speeds_is_the_next_term(found, label):
    p = by_label(label)
    power = p.full.contact_order + 1
    expected = abs(float(p.full.next_term.mid())) * 1e-8**power
    assert found[label]["1e-8"].own_epsilon == near(expected, rel=1e-6)


def test_zero_of_two_five_by_the_quadratic_formula():
    (moved_roots,) = (m for m in case.moved_roots(by_label("[2/5]")) if m.kind == "zero" and m.root.positive)
    _, b, c = map(float, by_label("[2/5]").a)
    printed = (-b - sqrt(b * b - 4 * c)) / (2 * c)
    assert moved_roots.by == near(abs(printed - float(moved_roots.root.value.real.mid())), rel=1e-6)


def test_poles_of_zero_three_in_closed_form():
    (moved_roots,) = case.moved_roots(by_label("[0/3]"))
    lambda_1 = float(symbolic.lambda_1())
    assert moved_roots.by == near(1.15345**-0.5 * (1.15345 / lambda_1 - 1) / 2, rel=1e-4)


@pytest.mark.parametrize("label", LABELS)
@pytest.mark.parametrize("v_star", ["0.01", "1", "10"])
def test_bound_is_reached_by_the_worst_digits(label, v_star):
    """Every coefficient half a unit off to the worse side: no smaller bound would be one."""
    p = by_label(label)
    a = [exact_middle(c) + half for c, half in zip(p.full.a, p.half_a, strict=True)]
    side = 1 if numerator(p, v_star) > 0 else -1  # the sign of eps
    b = [exact_middle(c) - side * half for c, half in zip(p.full.b, p.half_b, strict=True)]
    if len(a) > 1:
        a[1] = b[1] = exact_middle(p.full.b[1]) + p.half_b[1]  # alike
    assert 0.999 < case.errors(p._replace(a=tuple(a), b=tuple(b)), v_star).used <= 1


def numerator(p, v_star):
    v = Fraction(v_star)
    return sum(exact_middle(c) * v**k for k, c in enumerate(p.full.a))


def test_halves_are_of_the_last_digit_printed():
    p = by_label("[2/5]")
    assert p.half_b == (0, *map(Fraction, ("5e-7", "5e-6", "5e-7", "5e-7", "5e-7")))
    assert by_label("[0/3]").half_b == (0, 0, Fraction("5e-6"), 0)


def test_crossing_of_two_power_laws():
    v = [0.01, 0.1, 1.0, 10.0]
    assert case.equal_errors_at(v, [1e-3] * 4, [x**2 for x in v]) == near(1e-3**0.5, rel=1e-12)
    assert case.equal_errors_at(v, [1e-9] * 4, v) == v[0]


# --- checks that fail -------------------------------------------------------------------------------------------------


def failing(monkeypatch, label, symbol, index, text):
    """Run the checks on one printed number that is another."""
    rows = {key: [list(row) for row in value] for key, value in paper.TABLE.items()}
    key = next(key for key in rows if f"[{key[0]}/{key[1]}]" == label)
    rows[key]["ab".index(symbol)][index] = text
    monkeypatch.setattr(paper, "TABLE", {k: tuple(map(tuple, value)) for k, value in rows.items()})
    case.approximants.cache_clear()
    try:
        changed = table()
        found = {p.full.label: {v: case.errors(p, v) for v in ("0.01", "1", "10", "1000")} for p in changed}
        checks = case._checks(found, [m for p in changed for m in case.moved_roots(p)])
    finally:
        case.approximants.cache_clear()
    return [i for i, check in enumerate(checks) if not check.holds]


def test_nothing_fails_as_printed(monkeypatch):
    assert failing(monkeypatch, "[2/5]", "b", 2, "1.025") == []


def test_a_digit_that_is_off_is_noticed(monkeypatch):
    assert failing(monkeypatch, "[2/5]", "b", 2, "1.02502") == [ROUNDED, BOUND]
    assert failing(monkeypatch, "[3/6]", "a", 3, "0.141562") == [ROUNDED, BOUND, ROOTS]
    assert failing(monkeypatch, "[2/5]", "a", 2, "-0.128448") == [ROUNDED, BOUND, ROOTS]


def test_unequal_first_coefficients_are_noticed(monkeypatch):
    assert UNEQUAL in failing(monkeypatch, "[3/6]", "a", 1, "1.07233")


def test_a_sign_lost_is_noticed(monkeypatch):
    assert POSITIVE in failing(monkeypatch, "[2/5]", "a", 2, "0.128445")


def test_unequal_first_coefficients_spoil_the_loss(found):
    """1e-5 v* in the numerator, against lambda_1 v*^2."""
    expected = 1e-5 * 1e8 / float(symbolic.lambda_1())
    assert found["[3/6]"]["1e-8"].loss_if_unequal == near(expected, rel=1e-5)


def test_a_bound_without_eps_below_zero_is_not_used(found):
    """Beyond the zero of [2/5] eps < 0; the parts of the bound stay positive."""
    assert all(part > 0 for error in found["[2/5]"].values() for part in error.parts.values())


def test_parts_add_up_to_the_bound_of_first_order(found):
    for row in found.values():
        for error in row.values():
            assert sum(error.parts.values()) == near(error.epsilon_bound, rel=1e-3)


def test_working_precision_is_left_alone():
    from flint import ctx

    before = ctx.prec
    case.errors(by_label("[0/3]"), "0.1")
    with working(77):
        case.errors(by_label("[0/3]"), "0.1")
        assert ctx.prec == 77
    assert ctx.prec == before
