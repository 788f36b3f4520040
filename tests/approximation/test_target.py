"""The fits' target against the proven values, on panels of every kind and across their edges."""

import math
from fractions import Fraction

import pytest
from flint import arb

from viscopade.approximation.target import loss_limit, target
from viscopade.arithmetic.balls import working
from viscopade.arrays import panels
from viscopade.collision import exact
from viscopade.theory.series import series


@pytest.mark.parametrize("v_star", [1e-8, 0.03, 0.0625, 0.3, 0.99, 1.0, 7.3, 1234.5, 1.5e6])
def test_relative_errors_of_eps_and_of_1_minus_eps(v_star):
    true = exact.collision(Fraction(v_star), 22)
    with working(200):
        epsilon, loss, _ = target(arb(v_star))
        for value, right in ((epsilon, true.epsilon), (loss, true.one_minus_epsilon)):
            assert abs(float((value / right - 1).mid())) < 3e-19  # data/double.txt: 2^-61.9


def test_ratio_at_0_is_the_series_first_coefficient():
    with working(200):
        assert abs(loss_limit() / -series(2, 22).h[2] - 1) < arb(10) ** -17


@pytest.mark.parametrize("v_star", [1e-3, 0.2, 0.45])
def test_ratio_belongs_to_the_loss(v_star):
    with working(200):
        epsilon, loss, ratio = target(arb(v_star))
        assert abs(ratio * arb(v_star) ** 2 / loss - 1) < arb(10) ** -30
        assert abs(epsilon + loss - 1) < arb(10) ** -17


def test_edges_belong_together():
    edges = [float(c - h) for c, h in zip(panels.CENTRES[1::7], panels.HALF_WIDTHS[1::7], strict=True)]
    with working(128):
        for edge in edges:
            left, right = (target(arb(v)) for v in (math.nextafter(edge, 0), edge))
            for before, after in zip(left, right, strict=True):
                assert abs(before / after - 1) < 1e-15


@pytest.mark.parametrize("bad", [-1e-3, math.nan])
def test_negative_speeds_are_refused(bad):
    with pytest.raises(ValueError, match=r"^v_star is .*: expected a number >= 0"):
        target(arb(bad))
