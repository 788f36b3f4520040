"""The table of falls against the collision of `Contact`, which solves the equation of motion another way."""

import numpy as np
import pytest

from viscopade import store
from viscopade.arrays import double
from viscopade.collision.weight import loaded
from viscopade.fitting import weight_table
from viscopade.theory.law import VISCOELASTIC

KAPPA, PART = np.geomspace(1e-3, 6, 8), np.array([1e-4, 0.01, 0.2, 0.7, 0.97])


def sticking(kappa):
    """Return the largest load with which the sphere leaves the plane, by bisection in the table."""
    low, high = 0.0, 100.0
    for _ in range(60):
        middle = (low + high) / 2
        low, high = (middle, high) if weight_table.epsilon(kappa, np.array(middle)) > 0 else (low, middle)
    return low


@pytest.mark.parametrize("kappa", KAPPA)
def test_numbers_are_those_of_a_collision(kappa):
    """The largest error of eps is 1e-8, but at the load that keeps the sphere down, where eps is a square root."""
    limit = sticking(kappa)
    for part in PART:
        load = np.array(part * limit)
        true = loaded(VISCOELASTIC, kappa, float(load)).collide()
        epsilon = float(weight_table.epsilon(np.array(kappa), load))
        assert epsilon == pytest.approx(true.epsilon, abs=1e-8)
        assert float(weight_table.duration(np.array(kappa), load)) == pytest.approx(true.duration, abs=3e-5)
        assert float(weight_table.kappa_from(np.array(epsilon), load)) == pytest.approx(kappa, rel=1e-9)
    above, below = (loaded(VISCOELASTIC, kappa, limit * factor).collide() for factor in (1 + 1e-5, 1 - 1e-5))
    assert below.parts
    assert not above.parts
    assert weight_table.epsilon(np.array(kappa), np.array(limit * (1 + 1e-5))) == 0


def test_the_record_is_what_is_made():
    stored = weight_table.collisions_at_nodes()
    with store.fresh_records():
        made = weight_table.collisions_at_nodes()
    for one, other in zip(made, stored, strict=True):
        np.testing.assert_allclose(one, other, rtol=1e-12)


def test_without_load_it_is_the_law_inside_and_beyond_the_table():
    kappa = np.geomspace(1e-5, 50, 40)
    found = weight_table.epsilon(kappa, np.zeros(40))
    assert found == pytest.approx(double.epsilon(np.sqrt(kappa)), abs=4e-7)
    assert weight_table.kappa_from(found, np.zeros(40)) == pytest.approx(kappa, rel=2e-3)


@pytest.mark.parametrize(("kappa", "load"), [(1e-4, 0.3), (8.0, 0.001)])
def test_beyond_the_table_it_is_close(kappa, load):
    true = loaded(VISCOELASTIC, kappa, load).collide().epsilon
    assert float(weight_table.epsilon(np.array(kappa), np.array(load))) == pytest.approx(true, abs=5e-3)


def test_an_eps_of_1_needs_no_damping_and_one_of_0_any():
    load = np.array([0.0, 0.1])
    assert weight_table.kappa_from(np.ones(2), load).tolist() == [0, 0]
    assert weight_table.kappa_from(np.zeros(2), load).tolist() == [np.inf, np.inf]


def test_the_body_is_back_when_an_integration_has_it_at_the_height_of_first_contact():
    from scipy.integrate import solve_ivp

    kappa, load = 0.37, 0.05

    def rates(_, state):
        x, v = state
        pressed = max(x, 0.0)
        return v, load - max(pressed**1.5 + kappa * pressed**0.5 * v, 0.0)

    def back(t, state):
        return state[0] if t > 1 else 1.0

    back.terminal = True
    run = solve_ivp(rates, (0, 20), (0.0, 1.0), events=back, rtol=1e-10, atol=1e-13, method="DOP853")
    assert float(weight_table.return_time(np.array(kappa), np.array(load))) == pytest.approx(run.t[-1], rel=1e-7)
    assert float(weight_table.epsilon(np.array(kappa), np.array(load))) == pytest.approx(-run.y[1, -1], rel=1e-7)
