"""Padé approximants of rounded coefficients: the quick run, second routes to its numbers, and checks that can fail."""

import cmath
from dataclasses import replace
from fractions import Fraction
from itertools import pairwise

import pytest
from mpmath import mp, mpf

from tests.lab.hard_cases.hard_case import assert_passes, assert_readable
from viscopade.arithmetic.balls import exact_middle
from viscopade.theory.pade import pade, rational_pade
from viscopade.theory.series import series
from viscopade_lab.hard_cases import data_precision
from viscopade_lab.hard_cases.data_precision import (
    CASE,
    KEPT,
    V_STARS,
    RoundedSeries,
    exact_data,
    lasting,
    nearest,
    pade_of_rounded,
    rounded_series,
    sensitive_pade,
    slope,
    trusted,
)

LARGEST_M = 13


@pytest.fixture(scope="module")
def result():
    return CASE.run(False)


@pytest.fixture(scope="module")
def h():
    return exact_data(LARGEST_M)


@pytest.fixture(scope="module")
def data(h):
    return rounded_series(h)


def failing(found) -> list[int]:
    return [i for i, check in enumerate(data_precision._checks(found)) if not check.holds]


def test_the_quick_run_passes(result):
    assert_passes(result)


def test_what_is_reported_can_be_read(result):
    assert_readable(result)


@pytest.mark.slow
def test_the_thorough_run_passes():
    assert_passes(CASE.run(True))


# --- second routes ----------------------------------------------------------------------------------------------------


def test_rounded_data_are_the_printed_decimals(data):
    for one, digits in zip(data, data_precision.DECIMALS, strict=False):
        assert one.h == tuple(map(Fraction, series(2 * LARGEST_M + 3, digits).decimals()))
    assert [float(x) for x in data[-1].h] == series(2 * LARGEST_M + 3, 30).floats().tolist()


def test_rounding_errors_are_within_the_unit_roundoff(h, data):
    for one in data:
        largest = max(abs(x / y - 1) for x, y in zip(one.h, h, strict=True) if y)
        assert one.u / 10 < largest <= one.u


@pytest.mark.parametrize("m", [3, 7, 10])
def test_the_exact_approximant_is_that_of_pade(h, m):
    ours, theirs = sensitive_pade(h, m).p, pade(m, m + 3, 25)
    for one, other in ((ours.poles, theirs.poles), (ours.zeros, theirs.zeros)):
        assert [root.decimals(20) for root in one] == [root.decimals(20) for root in other]


@pytest.mark.parametrize("m", [2, 5])
def test_kappa_and_amplification_are_those_of_finite_differences(h, m):
    exact = sensitive_pade(h, m)
    step = Fraction(1, 10**20)
    moved = [0.0] * len(exact.upper)
    changed = [0.0] * len(V_STARS)
    for k in range(2 * m + 4):
        other = rational_pade([x * (1 + step) if j == k else x for j, x in enumerate(h)][: 2 * m + 4], m, m + 3, 50)
        moved = [x + nearest(pole, other.poles) for x, pole in zip(moved, exact.upper, strict=True)]
        values = zip(values_of(other), values_of(exact.p), strict=True)
        changed = [x + abs(float(y / z - 1)) for x, (y, z) in zip(changed, values, strict=True)]
    assert [x / float(step) for x in moved] == pytest.approx(exact.kappa, rel=1e-6)
    assert [x / float(step) for x in changed] == pytest.approx(exact.amplification, rel=1e-6)


def values_of(p) -> list[Fraction]:
    """The approximant at all v*, from the middles of its coefficients, in rational arithmetic."""
    a, b = ([exact_middle(x) for x in side] for side in (p.a, p.b))
    return [
        sum(x * v**k for k, x in enumerate(a)) / sum(x * v**k for k, x in enumerate(b))
        for v in V_STARS
    ]  # fmt: skip


def test_errors_of_eps_against_lu_decomposition(h, data):
    """With the same rounded h_k, solved by mpmath with ample digits."""
    m, n, exact = 7, 10, sensitive_pade(h, 7)
    with mp.workdps(80):
        rough = [mpf(x.numerator) / x.denominator for x in data[0].h]
        matrix = mp.matrix([[rough[m + j - i] if m + j >= i else 0 for i in range(n)] for j in range(n)])
        b = [mpf(1), *mp.lu_solve(matrix, mp.matrix([-rough[m + j + 1] for j in range(n)]))]
        a = [mp.fsum(b[i] * rough[k - i] for i in range(min(k, n) + 1)) for k in range(m + 1)]
        true = [mpf(x.numerator) / x.denominator for x in values_of(exact.p)]
        points = [mpf(v.numerator) / v.denominator for v in V_STARS]
        errors = [
            float(abs(mp.polyval(a[::-1], v) / mp.polyval(b[::-1], v) / x - 1))
            for v, x in zip(points, true, strict=True)
        ]
    assert pade_of_rounded(data[0], exact).error == pytest.approx(errors, rel=1e-9, abs=0)


def windings(p, centre: complex, radius: float, points: int = 400) -> int:
    """How often b goes around 0 while v* goes around the circle: the number of poles in it."""
    b = [exact_middle(x) for x in p.b]
    with mp.workdps(50):
        coefficients = [mpf(x.numerator) / x.denominator for x in b[::-1]]
        circle = [centre + radius * cmath.exp(2j * cmath.pi * k / points) for k in range(points + 1)]
        values = [mp.polyval(coefficients, v) for v in circle]
        return round(float(mp.fsum(mp.arg(y / x) for x, y in pairwise(values)) / (2 * mp.pi)))


def test_the_argument_principle_finds_the_doublets_of_rounding(h, data):
    """Around each there is one pole of the approximant of rounded data, and none of the exact one."""
    exact = sensitive_pade(h, LARGEST_M)
    row = pade_of_rounded(data[0], exact)
    assert row.spurious
    for pair in row.spurious:
        place = complex(pair.pole.value)
        assert windings(row.p, place, KEPT / 2 * abs(place)) == 1
        assert windings(exact.p, place, KEPT / 2 * abs(place)) == 0


def test_true_poles_stay(h, data):
    """The doublet that the exact series has in [7/10] is at its place with ten digits, by the argument principle."""
    exact = sensitive_pade(h, 7)
    row = pade_of_rounded(data[1], exact)
    assert row.spurious == ()
    assert windings(row.p, 0.279952, 1e-3) == windings(exact.p, 0.279952, 1e-3) == 1


def test_the_singularity_is_about_where_the_flow_has_it(h):
    there = cmath.rect(1.04702431222, 0.428884641576 * cmath.pi)  # as `viscopade_lab.singularity` finds it
    found = {LARGEST_M: (sensitive_pade(h, LARGEST_M), ())}
    assert data_precision.singularity(found) == pytest.approx(there, rel=0.03)


def test_the_fit_is_a_straight_line(h):
    found = {m: (replace(sensitive_pade(h, m), kappa=(10.0 ** (0.5 * m + 1),) * 3), ()) for m in (3, 5, 7)}
    assert slope(found) == pytest.approx((0.5, 1.0))


def test_trust_ends_with_the_first_pole_that_left(h, data):
    rows = {m: pade_of_rounded(data[0], sensitive_pade(h, m)) for m in (1, 3, 5, 7)}
    assert trusted(rows) == 5
    assert trusted({7: rows[7]}) == -1


# --- checks that can fail ---------------------------------------------------------------------------------------------


def test_errors_larger_than_said_are_noticed(h, data):
    """Six digits taken for nine."""
    exact = sensitive_pade(h, 10)
    honest = tuple(pade_of_rounded(one, exact) for one in data)
    assert failing({10: (exact, honest)}) == []
    wrong = RoundedSeries("9 digits", data[0].h, data[0].u / 1000)
    assert {0, 1, 2} <= set(failing({10: (exact, (*honest, pade_of_rounded(wrong, exact)))}))


def test_a_system_that_is_not_solved_is_noticed(monkeypatch, h, data):
    exact = sensitive_pade(h, 5)

    def careless(coefficients, m, n, digits):
        return rational_pade(
            [x if k != 9 else x * Fraction(1001, 1000) for k, x in enumerate(coefficients)], m, n, digits
        )

    monkeypatch.setattr(data_precision, "rational_pade", careless)
    assert {0, 1} <= set(failing({5: (exact, tuple(pade_of_rounded(one, exact) for one in data))}))


def test_doublets_that_do_not_leave_are_noticed(h, data):
    exact = sensitive_pade(h, LARGEST_M)
    row = pade_of_rounded(data[0], exact)
    assert lasting((row, pade_of_rounded(data[1], exact))) == 0
    assert lasting((row, replace(row, spurious=()))) == len(row.spurious) > 0


def test_that_there_is_nothing_to_see_is_noticed(h, data):
    exact = sensitive_pade(h, 1)
    assert failing({1: (exact, tuple(pade_of_rounded(one, exact) for one in data))}) == [3]
