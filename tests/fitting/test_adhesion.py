"""Slow points that fall as those of adhering bodies: data made with SciPy, and data of other laws."""

import numpy as np
import pytest

from tests.cli import json_of
from tests.cli.test_adhesion import adhesive_epsilon
from viscopade.arrays import double

SPEEDS = np.geomspace(0.08, 3, 16)


def said_of_adhesion(tmp_path, seed, epsilon, noise=0.01):
    """Return the warning of a fit to points that scatter."""
    epsilon = epsilon + noise * np.random.default_rng(seed).standard_normal(len(epsilon))
    table = tmp_path / "points.csv"
    rows = (f"{speed},{value}" for speed, value in zip(SPEEDS, epsilon, strict=True))
    table.write_text("\n".join(["speed,epsilon", *rows]))
    return [text for text in json_of("fit", table)["warnings"] if "adhered" in text]


@pytest.mark.parametrize("seed", range(3))
def test_points_of_adhering_spheres(tmp_path, seed):
    """Their sticking speed is 0.0678 m/s (tests/cli/test_adhesion.py, by SciPy)."""
    (text,) = said_of_adhesion(tmp_path, seed, np.array([adhesive_epsilon(speed) for speed in SPEEDS]))
    assert text.startswith("slow points fall below the law as if the bodies adhered: eps^2 = E^2 - (v_0/v)^2")
    assert float(text.split("below about ")[1].split()[0]) == pytest.approx(0.0678, rel=0.1)


@pytest.mark.parametrize("seed", range(4))
def test_points_of_other_laws(tmp_path, seed):
    """The viscoelastic law, a constant eps, and an eps that rises with the speed."""
    laws = double.epsilon(np.sqrt(0.39) * SPEEDS**0.1), 0.7 + 0 * SPEEDS, double.epsilon(np.sqrt(0.2) * SPEEDS**-0.1)
    assert [said_of_adhesion(tmp_path, seed, np.asarray(epsilon)) for epsilon in laws] == [[], [], []]


def test_points_of_bodies_that_all_stay(tmp_path):
    """No speed is known at which they part."""
    assert said_of_adhesion(tmp_path, 0, 0 * SPEEDS, noise=0) == []
