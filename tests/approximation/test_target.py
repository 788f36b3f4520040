"""The fits' target against the proven values, on panels of every kind and across their edges."""

import math
from fractions import Fraction

import numpy as np
import pytest
from flint import arb

from viscopade.approximation.target import exact_target
from viscopade.arithmetic.balls import bits_for, working
from viscopade.arrays import double, panels
from viscopade.collision import exact
from viscopade.theory.series import series


def errors(digits: int, v_star: float) -> tuple[float, float]:
    """Relative errors of eps and 1 - eps."""
    true = exact.collision(Fraction(v_star), digits + 5)
    with working(bits_for(digits) + 64):
        epsilon, loss, _ = exact_target(digits).at(arb(v_star))
        pairs = ((epsilon, true.epsilon), (loss, true.one_minus_epsilon))
        return tuple(abs(float((value / right - 1).mid())) for value, right in pairs)


@pytest.mark.parametrize("v_star", [1e-8, 0.03, 0.0625, 0.3, 0.99, 1.0, 7.3, 1234.5, 1.5e6])
def test_table(v_star):
    assert max(errors(17, v_star)) < 3e-19  # data/double.txt: 2^-61.9


@pytest.mark.parametrize("digits", [25, 35])
@pytest.mark.parametrize("v_star", [1e-8, 0.01, 0.0625, 0.1, 0.125, 0.2, 0.25, 0.3, 0.5])
def test_series(digits, v_star):
    assert max(errors(digits, v_star)) < 10.0**-digits


@pytest.mark.parametrize("v_star", [0.51, 0.77, 1.0])
def test_interpolated_octave(v_star):
    assert max(errors(20, v_star)) < 1e-20


@pytest.mark.slow
@pytest.mark.parametrize("digits", [20, 30, 40])
@pytest.mark.parametrize("v_star", [0.6, 1.0, 1.9, 3.0, 12.0])
def test_interpolated_octaves(digits, v_star):
    assert max(errors(digits, v_star)) < 10.0**-digits


@pytest.mark.parametrize("digits", [17, 30])
def test_ratio_at_0_is_the_series_first_coefficient(digits):
    with working(200):
        h_2 = series(2, digits + 5).h[2]
        assert abs(exact_target(digits).c / -h_2 - 1) < arb(10) ** -digits


@pytest.mark.parametrize("digits", [17, 30])
@pytest.mark.parametrize("v_star", [1e-3, 0.2, 0.45])
def test_ratio_belongs_to_the_loss(digits, v_star):
    with working(200):
        epsilon, loss, ratio = exact_target(digits).at(arb(v_star))
        assert abs(ratio * arb(v_star) ** 2 / loss - 1) < arb(10) ** -30
        assert abs(epsilon + loss - 1) < arb(10) ** -digits


def test_doubles_are_the_same():
    v_star = np.geomspace(1e-4, 1e9, 200)
    with working(128):
        values = [float(exact_target().at(arb(v)).epsilon) for v in v_star]
    np.testing.assert_allclose(values, double.epsilon(v_star), rtol=4 * math.ulp(1))


def test_edges_belong_together():
    edges = [float(c - h) for c, h in zip(panels.CENTRES[1::7], panels.HALF_WIDTHS[1::7], strict=True)]
    with working(128):
        target = exact_target()
        for edge in edges:
            left, right = (target.at(arb(v)) for v in (math.nextafter(edge, 0), edge))
            for before, after in zip(left, right, strict=True):
                assert abs(before / after - 1) < 1e-15


@pytest.mark.parametrize("bad", [-1e-3, math.nan])
def test_negative_speeds_are_refused(bad):
    with pytest.raises(ValueError, match=r"^v_star is .*: expected a number >= 0"):
        exact_target().at(arb(bad))


def test_too_large_speeds_are_refused():
    with pytest.raises(ValueError, match=r"expected at most 1e\+07"):
        exact_target(30).at(arb(2e7))


@pytest.mark.parametrize("digits", [0, -3, 10**6])
def test_digits_out_of_range(digits):
    with pytest.raises(ValueError, match="digits is"):
        exact_target(digits)
