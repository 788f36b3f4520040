"""The cooling gas: what must be conserved, what is known exactly, and simulation and quadrature against each other."""

import math
from functools import cache

import numpy as np
import pytest

import viscopade as vp
from viscopade.collision.spheres import v_star
from viscopade_lab import gas

BETA = 1.307


def exact(speed):
    return vp.restitution(speed, BETA)


@cache
def constant(epsilon):
    return lambda speed: np.full_like(speed, epsilon)


@cache
def cooled(restitution, time, seed=0, particles=2000):
    return gas.cool(restitution, particles=particles, time=time, seed=seed)


def mean_and_error(values):
    return np.mean(values), np.std(values, ddof=1) / math.sqrt(len(values))


def test_the_energy_lost_is_that_of_the_collisions():
    found = cooled(constant(0.7), 20.0)
    lost = (1 - 0.7**2) / 4 * np.sum(found.impact_speeds**2)
    assert 1.5 * 2000 * (1 - found.temperatures[-1]) == pytest.approx(lost, rel=1e-12)
    assert found.times[-1] == 20


def test_an_elastic_gas_collides_once_per_mean_collision_time():
    found = cooled(constant(1.0), 20.0, particles=4000)
    assert np.all(np.abs(found.temperatures - 1) < 1e-12)
    assert found.collisions[-1] == pytest.approx(20, rel=0.02)
    assert np.mean(found.impact_speeds**2) == pytest.approx(4, rel=0.02)  # of v exp(-v^2/(4 T))


def sonine_of(epsilon):
    """a_2 of the cooling state (van Noije & Ernst 1998)."""
    return 16 * (1 - epsilon) * (1 - 2 * epsilon**2) / (81 - 17 * epsilon + 30 * epsilon**2 * (1 - epsilon))


@pytest.mark.parametrize("epsilon", [0.3, 0.9])
def test_haffs_law(epsilon):
    runs = [cooled(constant(epsilon), 300.0, seed=seed) for seed in range(4)]
    rates = []
    for run in runs:
        root = run.temperature_at([60.0, 300.0]) ** -0.5
        rates.append((root[1] - root[0]) / 240 / ((1 - epsilon**2) / 6))
    rate, error = mean_and_error(rates)
    assert error < 0.015
    assert rate == pytest.approx(1 + 3 / 16 * sonine_of(epsilon), abs=4 * error)
    late = [np.mean(run.sonine[run.collisions > 8]) for run in runs]
    assert np.mean(late) == pytest.approx(sonine_of(epsilon), abs=0.02)


@pytest.mark.parametrize("epsilon", [0.0, 0.9, 1.0])
def test_quadrature_gives_haffs_law(epsilon):
    times = np.array([0.0, 0.0, 0.01, 3.0, 3.0, 1e3, 1e9])
    found = gas.maxwellian(constant(epsilon), times, temperature=7.0)
    assert found == pytest.approx(7.0 / (1 + times * (1 - epsilon**2) / 6) ** 2, rel=1e-8, abs=0)


@pytest.mark.parametrize("temperature", [1e-12, 1.0, 50.0])
def test_loss_by_another_quadrature(temperature):
    u, h = np.linspace(-80, 5, 85001, retstep=True)
    u = np.exp(u)
    star = v_star(np.sqrt(4 * temperature * u), BETA)
    terms = vp.one_minus_epsilon(star) * (1 + vp.epsilon(star)) * u**2 * np.exp(-u)
    assert gas.loss(exact, temperature) == pytest.approx(h * terms.sum(), rel=1e-12, abs=0)


@pytest.mark.parametrize("time", [1.0, 100.0])
def test_simulation_and_quadrature_agree(time):
    expected = gas.maxwellian(exact, np.array([time]))[0]
    ratio, error = mean_and_error([cooled(exact, 100.0, seed).temperature_at(time) / expected for seed in range(6)])
    assert error < 0.012
    assert ratio == pytest.approx(1, abs=4 * error + 0.005)  # velocities are not quite Maxwellian


def test_waves_are_disjoint_complete_and_in_order():
    random = np.random.default_rng(1)
    first, second = random.integers(20, size=(2, 300))
    second = (first + 1 + second % 19) % 20
    last, seen = np.full(20, -1), []
    for wave in gas.waves(first, second, 20):
        members = np.concatenate([first[wave], second[wave]])
        assert len(set(members)) == len(members)
        assert np.all(last[members] < np.concatenate([wave, wave]))
        last[members] = np.concatenate([wave, wave])
        seen += wave.tolist()
    assert sorted(seen) == list(range(300))
