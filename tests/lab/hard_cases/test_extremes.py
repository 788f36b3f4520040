"""The hard case "extremes": it passes, headline numbers by another way, and what is broken is noticed."""

from dataclasses import replace
from decimal import Decimal
from types import SimpleNamespace

import mpmath
import numpy as np
import pytest
from flint import arb

from tests.lab.hard_cases.hard_case import assert_passes
from viscopade.collision import exact
from viscopade_lab.hard_cases import extremes
from viscopade_lab.hard_cases.extremes import CASE, FAR, NEAR, QUICK

SMALL = replace(
    QUICK,
    near=(("1e-3", 20), ("1e-10", 20)),
    far=(("1e3", 20), ("1e6", 20)),
    losses=(("1e-6", 20),),
    epsilons=(("1e-12", 20),),
    nested=(("1e-3", (20, 30)),),
    longest=("1e-30", 30),
    doubles=20,
)


@pytest.fixture(scope="module")
def result():
    return CASE.run(False)


def test_it_passes(result):
    assert_passes(result)
    assert CASE.name == "extremes"
    assert [len(chart.curves) for chart in result.charts] == [8, 8, 8]


@pytest.mark.slow
def test_the_thorough_run_passes_the_same_checks(result):
    thorough = CASE.run(True)
    assert thorough.passes
    assert len(thorough.checks) == len(result.checks)


# --- headline numbers by another way ----------------------------------------------------------------------------------


def test_a_hundred_digits_at_1e_30_by_gamma_functions():
    """1 - eps = lambda_1 v*^2 - 3/5 lambda_1^2 v*^4 - 4/15 v*^5 + O(v*^6), in mpmath."""
    with mpmath.workdps(120):
        v = mpmath.mpf("1e-30")
        powers = mpmath.power(5, mpmath.mpf(2) / 5) * mpmath.power(2, mpmath.mpf(1) / 5)
        lambda_1 = mpmath.sqrt(mpmath.pi) * mpmath.gamma(mpmath.mpf(3) / 5) / powers / mpmath.gamma(mpmath.mpf(21) / 10)
        loss = lambda_1 * v**2 - 3 * lambda_1**2 * v**4 / 5 - 4 * v**5 / 15
        ours = mpmath.mpf(exact.collision("1e-30", 100).decimals()["one_minus_epsilon"])
        assert abs(ours / loss - 1) < mpmath.mpf(10) ** -99


def test_fifteen_digits_at_eps_1e_12_by_the_equation_for_the_turning_point():
    """Derivation 10: W = 3/eps (z_e/W)^2, z_e/W = 1 - S/W + U/W^2, solved numerically."""
    with mpmath.workdps(40):
        a = mpmath.log(3) / 2 - mpmath.pi / mpmath.sqrt(12) - mpmath.mpf(3) / 2
        b = 7 * (mpmath.log(3) + mpmath.pi / mpmath.sqrt(3)) / 2 - mpmath.mpf(93) / 4

        def ratio(w):
            s = 2 * mpmath.log(w) + a - 1 - mpmath.log(2)
            u = -10 * mpmath.log(w) + 2 * a - b + 5 * mpmath.log(2) + 5
            return 1 - s / w + u / w**2

        epsilon = mpmath.mpf("1e-12")
        w = mpmath.findroot(lambda w: 3 * ratio(w) ** 2 / w / epsilon - 1, 3 / epsilon)
        v_star = mpmath.power(w**3 / 12, mpmath.mpf(1) / 10)
        ours = mpmath.mpf(exact.invert("1e-12", 40).decimals()["v_star"])
        assert abs(ours / v_star - 1) < 1e-33  # (ln W/W)^3


def test_charts_have_the_slopes_of_the_theory(result):
    """1 - eps: v*^2, v*^3, v*^4, v*^5; eps: v*^(-10/3) for each term, and logarithms; points on the lines."""
    near, far, inverse = result.charts
    for chart, slopes, tolerance in (
        (near, [2, 3, 4, 5], 0.01),
        (far, [-10 / 3, -20 / 3, -10, -40 / 3], 0.5),
        (inverse, [1, 3 / 2, 1, 2], 0.1),
    ):
        lines = [c for c in chart.curves if c.look == "bound"]
        for line, slope in zip(lines, slopes, strict=True):
            (x_0, y_0), (x_1, y_1) = sorted(zip(line.x, line.y, strict=True))[:: len(line.x) - 1]
            assert (y_1 - y_0) / (x_1 - x_0) == pytest.approx(slope, abs=tolerance)
        for points, line in zip((c for c in chart.curves if c.look == "points"), lines, strict=True):
            expected = dict(zip(line.x, line.y, strict=True))
            assert all(abs(y - expected[x]) < 0.01 for x, y in zip(points.x, points.y, strict=True))


# --- what is broken is noticed ----------------------------------------------------------------------------------------


def comparison(end, name, at, digits, factor=None):
    """Compare an exact value, perhaps multiplied by a factor."""
    expansions = extremes._near(SMALL) if end == NEAR else extremes._far(SMALL)
    value = getattr(extremes._collision(at, digits), name)
    with extremes.working(300):
        value = value if factor is None else value * factor
    return extremes.compared(end, name, at, digits, value, expansions[name])


@pytest.mark.parametrize(("end", "name", "at"), [(NEAR, "tau_c", "1e-10"), (FAR, "x_max", "1e6")])
def test_a_wrong_digit_is_noticed(end, name, at):
    assert comparison(end, name, at, 20).excess < 0.6
    assert comparison(end, name, at, 20, 1 + arb("3e-19")).excess > 1


def test_a_wrong_coefficient_is_noticed(monkeypatch):
    """The last term used is off by a thousandth: the difference is no longer the first omitted term."""
    far = extremes._far(SMALL)
    polynomials = list(far["epsilon"].polynomials)
    polynomials[2] = polynomials[2] * (1 + arb("0.001"))
    wrong = {**far, "epsilon": replace(far["epsilon"], polynomials=tuple(polynomials))}
    monkeypatch.setattr(extremes, "_far", lambda plan: wrong)
    points = [comparison(FAR, "epsilon", at, 45) for at in ("1e3", "1e4")]
    found = {slope.terms: slope for slope in extremes.slopes(points)}
    assert found[2].worst < extremes.FACTOR < found[3].worst
    assert abs(found[3].measured - found[3].expected) > found[3].limit


def test_a_wrong_power_is_noticed():
    """eps times (1 + v*^-4): the second difference falls too slowly."""
    points = []
    for at in ("1e3", "1e4"):
        with extremes.working(300):
            factor = 1 + arb(at) ** -4
        points.append(comparison(FAR, "epsilon", at, 45, factor))
    found = {slope.terms: slope for slope in extremes.slopes(points)}
    assert found[2].worst > extremes.FACTOR
    assert abs(found[2].measured - found[2].expected) > found[2].limit


def test_digits_that_do_not_extend_each_other_are_noticed(monkeypatch):
    assert extremes.nesting_faults(SMALL) == 0
    other = {20: exact.collision("1.0000000000000000002e-3", 20), 30: exact.collision("1e-3", 30)}
    monkeypatch.setattr(extremes, "_collision", lambda v_star, digits: other[digits])
    assert (
        extremes.nesting_faults(replace(SMALL, near=(), far=())) == 3
    )  # v*, 1 - eps, and eps, whose enclosure is 1 - (1 - eps)


def test_an_enclosure_without_what_was_given_is_noticed(monkeypatch):
    right = extremes._collision
    monkeypatch.setattr(extremes, "_collision", lambda v_star, digits: right("2e-10", digits))
    assert extremes.nesting_faults(replace(SMALL, nested=())) == 4


def test_a_wrong_inverse_is_noticed(monkeypatch):
    assert extremes.round_trip_faults(SMALL) == []
    right = extremes._inverse

    def wrong(name, portion, digits):
        found = right(name, portion, digits).decimals()["v_star"]
        return SimpleNamespace(decimals=lambda: {"v_star": str(Decimal(found) * (1 + Decimal("1e-16")))})

    monkeypatch.setattr(extremes, "_inverse", wrong)
    assert len(extremes.round_trip_faults(SMALL)) == 6


def test_a_rise_is_noticed(monkeypatch):
    assert extremes.order_faults(SMALL) == 0
    right = extremes._collision
    swapped = {"1e3": "1e6", "1e6": "1e3"}
    monkeypatch.setattr(extremes, "_collision", lambda v_star, digits: right(swapped.get(v_star, v_star), digits))
    assert extremes.order_faults(SMALL) == 4


def test_what_is_not_refused_is_noticed(monkeypatch):
    assert extremes.accepted_outside() == 0
    monkeypatch.setattr(extremes, "OUTSIDE", (*extremes.OUTSIDE, lambda: exact.collision("1", 5)))
    assert extremes.accepted_outside() == 1


@pytest.mark.parametrize("name", extremes.double.NAMES)
def test_a_wrong_double_is_noticed(name, monkeypatch):
    right = getattr(extremes.double, name)
    factor = 1 + 4 * np.finfo(float).eps
    monkeypatch.setattr(extremes.double, name, lambda v: right(v) * factor)
    found = [d for d in extremes.doubles(SMALL) if d.function == name]
    assert max(d.worst for d in found) > extremes.double.ULP[name]
    monkeypatch.setattr(extremes.double, name, lambda v: np.where(v > 1e250, np.inf, right(v)))
    assert sum(d.wrong for d in extremes.doubles(SMALL)) > 0
