"""A pair at a speed: restitution, duration, compression; and the damping from a known restitution."""

import math

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from viscopade import Pair, Sphere
from viscopade.collision import exact
from viscopade.collision.spheres import beta_from_restitution

STEEL = {"young_modulus": 2.1e11, "poisson_ratio": 0.28, "dissipative_constant": 3e-7}
RUBBER = {"young_modulus": 1e7, "poisson_ratio": 0.49, "dissipative_constant": 2e-4}
PAIRS = {
    "equal": Pair(Sphere(radius=0.01, density=7800, **STEEL), Sphere(radius=0.01, density=7800, **STEEL)),
    "wall": Pair(Sphere(radius=0.02, density=1100, **RUBBER), Sphere.wall(**STEEL)),
    "unequal": Pair(Sphere(radius=0.02, density=1100, **RUBBER), Sphere(radius=0.003, mass=1e-3, **STEEL)),
}


@pytest.mark.parametrize("pair", PAIRS.values(), ids=PAIRS)
@pytest.mark.parametrize("speed", [1e-6, 0.01, 1.0, 100.0])
def test_agrees_with_the_exact_function_in_physical_units(pair, speed):
    truth = exact.collision(beta=pair.beta, speed=speed, digits=20).floats()
    rho_over_m = pair.rho / pair.m_eff
    assert pair.epsilon(speed) == pytest.approx(truth["epsilon"], rel=3e-15, abs=0)
    assert pair.one_minus_epsilon(speed) == pytest.approx(truth["one_minus_epsilon"], rel=3e-15, abs=0)
    assert pair.contact_time(speed) == pytest.approx(truth["tau_c"] * rho_over_m**-0.4 * speed**-0.2, rel=1e-14, abs=0)
    assert pair.max_compression(speed) == pytest.approx(
        truth["x_max"] * rho_over_m**-0.4 * speed**0.8, rel=1e-14, abs=0
    )


def test_arrays_and_the_limit_of_rest():
    pair = PAIRS["wall"]
    speeds = np.array([[0.0, 0.1], [1.0, 10.0]])
    assert pair.epsilon(speeds).shape == (2, 2)
    assert pair.epsilon(speeds)[1, 0] == pair.epsilon(1.0)
    assert (pair.epsilon(0.0), pair.max_compression(0.0), pair.contact_time(0.0)) == (1.0, 0.0, math.inf)
    assert isinstance(pair.epsilon(1.0), float)


def test_elastic_material():
    pair = Pair(
        Sphere(radius=1, density=1, **STEEL | {"dissipative_constant": 0}),
        Sphere.wall(**STEEL | {"dissipative_constant": 0}),
    )
    assert pair.epsilon(5.0) == 1
    # Hertz: 2.94 (m^2/(k^2 v))^(1/5), k = 16/15 E R^(1/2)
    k = 16 / 15 * pair.E_eff
    assert pair.contact_time(5.0) == pytest.approx(2.9432750 * (pair.m_eff**2 / (k**2 * 5.0)) ** 0.2, rel=1e-7)


@settings(max_examples=60)
@given(st.sampled_from(list(PAIRS.values())), st.floats(-8, 3), st.floats(1e-6, 1))
def test_calibration_gives_what_was_asked_for(pair, log_speed, epsilon):
    speed = 10**log_speed
    calibrated = pair.calibrated(speed, epsilon)
    assert calibrated.epsilon(speed) == pytest.approx(epsilon, rel=2e-14, abs=0)
    assert calibrated.first.dissipative_constant == calibrated.second.dissipative_constant == calibrated.A
    assert (calibrated.rho, calibrated.m_eff) == (pair.rho, pair.m_eff)


def test_calibration_of_nearly_elastic_collisions():
    pair = PAIRS["equal"].calibrated(0.5, one_minus_epsilon=1e-13)
    assert pair.one_minus_epsilon(0.5) == pytest.approx(1e-13, rel=1e-14, abs=0)
    assert PAIRS["equal"].calibrated(0.5, 1).A == 0


def test_beta_against_the_exact_inverse():
    for epsilon in (0.9, 0.5, 0.1, 0.01, 1e-8):
        truth = exact.invert(epsilon, 20, speed=0.7).floats()["beta"]
        assert beta_from_restitution(0.7, epsilon) == pytest.approx(truth, rel=2e-15, abs=0)
    speeds, restitutions = np.array([0.1, 1.0, 10.0]), np.array([[0.9], [0.5]])
    assert beta_from_restitution(speeds, restitutions).shape == (2, 3)


@pytest.mark.parametrize(
    ("arguments", "message"),
    [
        ({"speed": 0, "epsilon": 0.5}, "speed is 0"),
        ({"speed": -1, "epsilon": 0.5}, "speed is -1"),
        ({"speed": 1, "epsilon": 1.1}, "epsilon is 1.1"),
        ({"speed": 1, "epsilon": 0}, "epsilon is 0"),
        ({"speed": 1, "epsilon": math.nan}, "epsilon is nan"),
        ({"speed": 1, "one_minus_epsilon": 1}, "epsilon is 0"),
    ],
)
def test_refused_values(arguments, message):
    for function in (beta_from_restitution, PAIRS["equal"].calibrated):
        with pytest.raises(ValueError, match=message):
            function(**arguments)


def test_refused_combinations():
    for arguments in ({"speed": 1}, {"speed": 1, "epsilon": 0.5, "one_minus_epsilon": 0.5}):
        with pytest.raises(TypeError, match="expected exactly one of them"):
            PAIRS["equal"].calibrated(**arguments)
