"""Balls that fall on a plane, soft and stiff: the fit has their weight during contacts, and their damping comes back.

The instants of the first ball are those of a report; those of the others are integrated here, by DOP853.
"""

import math

import numpy as np
import pytest
from scipy.integrate import solve_ivp

import viscopade as vp
from viscopade.fitting import bounces, read
from viscopade.fitting.flight import Flight
from viscopade.fitting.read import Options

G, SPEED, BOUNCES = 9.80665, 2.0, 9
REPORTED = [0, 0.2779073, 0.4703741, 0.6070903, 0.7064419, 0.7801611, 0.8359377, 0.8789381, 0.9127162]
IN_VACUUM = Flight(G)
BALLS = {2e6: 4e-4, 1e7: 2e-4, 1e9: 3e-5}
"""A in s, by Y in Pa."""


def pair_of(young_modulus):
    material = {
        "young_modulus": young_modulus,
        "poisson_ratio": 0.49,
        "dissipative_constant": BALLS[young_modulus],
    }
    return vp.Pair(vp.Sphere(radius=0.02, density=1100, **material), vp.Sphere.wall(**material))


def fallen(pair, flight=IN_VACUUM, number=BOUNCES):
    """Return instants of first contact, times during which the force acts, and speeds before and after contacts."""
    stiffness, damping = pair.rho / pair.m_eff, 1.5 * pair.A * pair.rho / pair.m_eff

    def force(state):
        x = max(state[0], 0.0)
        return stiffness * x**1.5 + damping * math.sqrt(x) * state[1]

    def rates(_, state):
        return state[1], flight.gravity - max(force(state), 0.0)

    instants, durations, speeds, after, speed = [0.0], [], [], [], SPEED
    for _ in range(number):
        begin = pair.time_scale(speed)

        def back(t, state, begin=begin):
            return state[0] if t > begin else 1.0

        def ends(t, state, begin=begin):
            return force(state) if t > begin else 1.0

        back.terminal = True
        run = solve_ivp(
            rates, (0, 30 * begin), (0.0, speed), events=(back, ends), rtol=1e-11, atol=1e-15, method="DOP853"
        )
        launch = -run.y[1, -1]
        durations.append(run.t_events[1][0])
        speeds.append(speed)
        after.append(launch)
        instants.append(instants[-1] + run.t[-1] + float(flight.duration(np.array([launch]))[0]))
        speed = float(flight.impact(np.array([launch]))[0])
    return np.array(instants[:-1]), np.array(durations), np.array(speeds), np.array(after)


def points_of(measured, instants, durations, speeds, pair):
    """Return the points that `fit` makes of instants, of instants with contact times, or of heights."""
    drop = (instants, [f"line {k}" for k in range(BOUNCES)])
    if measured == "heights":
        return bounces.of_heights([(speeds**2 / 2 / G, drop[1])], Flight(G), sigma=1e-9, contact_time=pair)
    if measured == "durations":
        return bounces.of_times([drop], Flight(G), sigma=1e-7, durations=[durations])
    return bounces.of_times([drop], Flight(G), sigma=1e-7, contact_time=pair)


@pytest.mark.parametrize("young_modulus", BALLS)
@pytest.mark.parametrize("measured", ["instants", "durations", "heights"])
def test_measured_epsilons_are_those_of_the_integration(young_modulus, measured):
    pair = pair_of(young_modulus)
    instants, durations, speeds, after = fallen(pair)
    points = points_of(measured, instants, durations, speeds, pair)
    # The first impact has no flight before it, so that instants give no speed for it. A height gives the speed itself.
    first = 0 if measured == "heights" else 1
    assert points.epsilon == pytest.approx((after / speeds)[first : first + len(points)], rel=1e-5)
    assert len(points) == BOUNCES - 1 - first  # the last flight has no end


@pytest.mark.parametrize("young_modulus", BALLS)
@pytest.mark.parametrize("measured", ["instants", "durations", "heights"])
def test_the_damping_of_a_falling_ball_comes_back(young_modulus, measured):
    pair = pair_of(young_modulus)
    instants, durations, speeds, _ = fallen(pair)
    fit = vp.fit(points_of(measured, instants, durations, speeds, pair).without_scatter())
    assert fit.verdict.word == "holds"
    assert fit.beta == pytest.approx(pair.beta, rel=2e-5)
    assert fit.betas == pytest.approx(pair.beta, rel=2e-4)


@pytest.mark.parametrize("young_modulus", BALLS)
def test_contact_times_give_youngs_modulus_and_the_damping_constant(young_modulus):
    pair = pair_of(young_modulus)
    instants, durations, speeds, _ = fallen(pair)
    fit = vp.fit(points_of("durations", instants, durations, speeds, pair).without_scatter())
    constant, young = fit.stiffness(pair.first, wall=True)
    assert young.value == pytest.approx(young_modulus, rel=1e-4)
    assert constant.value == pytest.approx(pair.A, rel=1e-4)


def test_the_reported_instants_are_those_of_the_integration():
    instants, *_ = fallen(pair_of(2e6))
    assert instants == pytest.approx(REPORTED, abs=6e-8)
    assert pair_of(2e6).beta == pytest.approx(0.32315, abs=5e-6)


def test_drag_and_weight_together():
    pair = pair_of(1e7)
    flight = Flight.of_sphere(0.02, 1100, air_density=1.2)
    instants, *_ = fallen(pair, flight)
    made = bounces.of_times([(instants, list(map(str, range(BOUNCES))))], flight, sigma=1e-7, contact_time=pair)
    assert vp.fit(made).beta == pytest.approx(pair.beta, rel=2e-5)


def test_without_weight_a_soft_ball_seems_to_follow_another_law():
    drop = (np.array(REPORTED), list(map(str, range(BOUNCES))))
    found = vp.fit(bounces.of_times([drop], Flight(G), sigma=1e-7).without_scatter())
    assert found.points.weight_speed == 0
    assert found.verdict.word != "holds"


def test_positions_have_weight_in_their_contacts():
    pair = pair_of(2e6)
    instants, _, speeds, after = fallen(pair, number=4)
    begins = np.append(instants[1:] - 2 * after[:-1] / G, instants[-1])  # of flights
    time = np.arange(-0.15, instants[-1], 1 / 2000)
    height = np.zeros_like(time)
    height[time < 0] = -(SPEED * time + G * time**2 / 2)[time < 0]
    for begin, end, launch in zip(begins, instants[1:], after, strict=False):
        flying = (time >= begin) & (time < end)
        height[flying] = (launch * (time - begin) - G * (time - begin) ** 2 / 2)[flying]
    rows = "\n".join(f"{t!r},{y!r}" for t, y in zip(time.tolist(), height.tolist(), strict=True))
    made = read.recording([(f"t,y\n{rows}".encode(), "track.csv")], Options(flight=Flight(G), contact_time=pair)).points
    assert made.weight_speed == pytest.approx((G * pair.time_scale(1.0)) ** (5 / 6))
    assert made.epsilon == pytest.approx((after / speeds)[: len(made)], abs=1e-4)


def test_together_the_load_is_the_mean_of_the_drops():
    instants, durations, *_ = fallen(pair_of(1e7))
    names = list(map(str, range(BOUNCES)))
    one = bounces.of_times([(instants, names)], Flight(G), durations=[durations])
    both = bounces.concatenate([one, one])
    assert both.weight_speed == pytest.approx(one.weight_speed)
    assert both.weight_speed == pytest.approx((G * pair_of(1e7).time_scale(1.0)) ** (5 / 6), rel=1e-5)
