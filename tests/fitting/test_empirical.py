"""Empirical functions of measured points: what they follow, their range, and what they say of themselves."""

import math
import shutil
import subprocess
from typing import Any

import numpy as np
import pytest

from viscopade.fitting.empirical import MOST_NODES, of_points
from viscopade.fitting.points import Points

SPEED = np.geomspace(1e-3, 0.1, 24)
ICE = np.minimum(1, 0.32 * (100 * SPEED) ** -0.234)  # the published curve of Bridges et al., v in cm/s


@pytest.mark.parametrize("errors", [{}, {"sigma_epsilon": 0.01}])
def test_a_capped_power_comes_back(errors):
    found = of_points(Points.measured(SPEED, ICE, **errors))
    assert found.power == pytest.approx(0.234, rel=1e-6)
    assert found.factor == pytest.approx(0.32 * 100**-0.234, rel=1e-6)
    assert found.largest < 1e-9
    assert found.epsilon(SPEED) == pytest.approx(ICE)


def test_the_cap_is_part_of_the_fit():
    speed = np.geomspace(1e-5, 0.1, 40)
    capped = np.minimum(1, 0.32 * (100 * speed) ** -0.234)
    assert capped[:9].tolist() == [1] * 9
    found = of_points(Points.measured(speed, capped))
    assert (found.factor, found.power) == pytest.approx((0.32 * 100**-0.234, 0.234), rel=1e-6)


@pytest.mark.parametrize("form", ["power", "table"])
def test_outside_the_speeds_the_ends_hold(form):
    found = of_points(Points.measured(SPEED, ICE), form)
    ends = found.epsilon([SPEED[0], SPEED[-1]])
    assert found.epsilon([0, 1e-9, np.inf, 7]) == pytest.approx([ends[0], ends[0], ends[1], ends[1]])
    with pytest.raises(ValueError, match="expected a number >= 0"):
        found.epsilon([-1])
    with pytest.raises(ValueError, match="expected a number >= 0"):
        found.epsilon(np.nan)


@pytest.mark.parametrize("sign", [1, -1])
def test_a_table_is_monotone_and_near_the_points(sign):
    noisy = 0.6 + sign * 0.05 * np.log10(SPEED) + 0.02 * np.random.default_rng(1).standard_normal(24)
    found = of_points(Points.measured(SPEED, noisy), "table")
    values = np.array(found.nodes)[:, 1]
    assert (sign * np.diff(values) >= 0).all()
    assert found.residual < 0.02
    assert found.largest == pytest.approx(np.abs(noisy - found.epsilon(SPEED)).max())
    exact = of_points(Points.measured(SPEED, ICE), "table")
    assert exact.epsilon(SPEED) == pytest.approx(ICE, abs=1e-12)


def test_errors_weigh_and_equal_speeds_are_one_node():
    points = Points.measured([1, 1, 2, 2], [0.9, 0.8, 0.7, 0.6], sigma_epsilon=[0.01, 0.1, 0.1, 0.01])
    at_1, at_2 = np.average([0.9, 0.8], weights=[100, 1]), np.average([0.7, 0.6], weights=[1, 100])
    assert np.array(of_points(points, "table").nodes) == pytest.approx(np.array([[1, at_1], [2, at_2]]))


def test_many_points_make_a_short_table():
    speed = np.geomspace(0.01, 1, 5000)
    found = of_points(Points.measured(speed, 0.9 - 0.1 * speed), "table")
    assert len(found.nodes) <= MOST_NODES
    assert found.largest < 0.02


def test_what_is_said_has_range_and_residual():
    text = " ".join(of_points(Points.measured(SPEED, ICE)).head_sentences())
    assert "EMPIRICAL fit of measured data, no law of contact: eps = min(1, 0.108931 v^-0.234)" in text
    assert "Speeds from 0.001 to 0.1 m/s; outside, eps has its value at the nearer end." in text


def test_bad_points_and_forms_are_refused():
    with pytest.raises(ValueError, match="all speeds are equal"):
        of_points(Points.measured([1, 1, 1], [0.9, 0.8, 0.7]))
    with pytest.raises(ValueError, match="all eps are 0"):
        of_points(Points.measured([1, 2, 3], [0, 0, 0]))
    with pytest.raises(ValueError, match="expected 'power' or 'table'"):
        of_points(Points.measured(SPEED, ICE), "cubic")


@pytest.mark.parametrize("form", ["power", "table"])
def test_the_code_says_that_it_is_empirical_and_computes_the_function(tmp_path, form):
    found = of_points(Points.measured([0.1, 0.3, 0.5, 1.0, 2.0], [1.0, 0.9, 0.85, 0.8, 0.7]), form)
    speeds = [0.0, 0.05, 0.1, 0.2, 0.31, 0.7, 1.0, 2.0, 5.0, math.inf]
    text = found.text("python", "ball", "viscopade fit ball.csv")
    assert "EMPIRICAL" in text
    assert "Speeds from 0.1 to 2 m/s" in text
    module: dict[str, Any] = {}
    exec(text, module)
    function = module["epsilon_empirical_ball"]
    assert [function(speed) for speed in speeds] == pytest.approx(found.epsilon(np.array(speeds)), rel=1e-14)
    assert math.isnan(function(-1.0))
    if shutil.which("cc") is None:
        pytest.skip("no C compiler")
    (tmp_path / "ball.h").write_text(found.text("c", "ball", "viscopade fit ball.csv"))
    calls = "".join(f'printf("%.17g\\n", viscopade_epsilon_empirical_ball({speed!r}));' for speed in speeds[:-1])
    (tmp_path / "ball.c").write_text(f'#include <stdio.h>\n#include "ball.h"\nint main(void) {{ {calls} }}\n')
    subprocess.run(["cc", "-o", "ball", "ball.c", "-lm"], cwd=tmp_path, check=True)
    printed = subprocess.run(["./ball"], cwd=tmp_path, capture_output=True, text=True, check=True).stdout.split()
    assert list(map(float, printed)) == pytest.approx(found.epsilon(np.array(speeds[:-1])), rel=1e-14)
