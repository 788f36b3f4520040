"""Material constants, their errors, and scenes with them; fits of published curves, which are no data."""

import math

import numpy as np
import pytest

import viscopade as vp
from tests.titles import HARD
from viscopade.arrays import double
from viscopade.collision import exact
from viscopade.collision.spheres import restitution_error
from viscopade.fitting.damping import DampingFit
from viscopade.fitting.likelihood import fit_law
from viscopade.fitting.points import Points
from viscopade.fitting.scene_text import scene_text
from viscopade.fitting.verdict import MODELS, Verdict
from viscopade.quantity import uncertain
from viscopade.scene import read
from viscopade.scene.model_limits import setup

BALL = vp.Sphere(radius=0.005, density=2500, young_modulus=7e10, poisson_ratio=0.22, dissipative_constant=5e-7)
PAIR = vp.Pair(BALL, BALL)
SPEED = np.geomspace(0.05, 3, 12)


def fitted(sigma=0.005, seed=1, contact=0.0):
    random = np.random.default_rng(seed)
    epsilon = PAIR.epsilon(SPEED) + sigma * random.standard_normal(12)
    times = PAIR.contact_time(SPEED) * (1 + contact * random.standard_normal(12)) if contact else None
    return vp.fit(Points.measured(SPEED, epsilon, sigma_epsilon=sigma, contact_time=times))


def test_beta_of_each_point_is_that_of_the_inverse():
    found = fitted()
    for beta, speed, epsilon in list(zip(found.betas, found.points.speed, found.points.epsilon, strict=True))[::11]:
        wanted = exact.invert(repr(float(epsilon)), 20, speed=repr(float(speed))).decimals()["beta"]
        assert beta == pytest.approx(float(wanted), rel=1e-12)


def test_the_constant_of_the_material_comes_back():
    found = fitted()
    constant = found.dissipative_constant(PAIR.damped(0.0))
    assert abs(constant.value - 5e-7) < 3 * constant.standard_error
    assert constant.standard_error / constant.value == pytest.approx(found.beta_standard_error / found.beta)


@pytest.mark.parametrize("wall", [True, False])
def test_contact_times_give_the_young_modulus(wall):
    material = {"young_modulus": 7e10, "poisson_ratio": 0.22, "dissipative_constant": 5e-7}
    pair = vp.Pair(BALL, vp.Sphere.wall(**material) if wall else BALL)
    points = Points.measured(SPEED, pair.epsilon(SPEED), contact_time=pair.contact_time(SPEED))
    constant, young = vp.fit(points).stiffness(vp.Sphere(**{**vars_of(BALL), "young_modulus": 1.0}), wall)
    assert young.value == pytest.approx(7e10, rel=1e-6)
    assert constant.value == pytest.approx(5e-7, rel=1e-6)


def vars_of(sphere):
    names = ("radius", "density", "young_modulus", "poisson_ratio", "dissipative_constant")
    return {name: getattr(sphere, name) for name in names}


def test_errors_of_both_constants_are_the_scatter_of_many_sets():
    values, errors = [], []
    random = np.random.default_rng(4)
    for _ in range(200):
        epsilon = PAIR.epsilon(SPEED) + 0.01 * random.standard_normal(12)
        times = PAIR.contact_time(SPEED) * (1 + 0.05 * random.standard_normal(12))
        main = fit_law(Points.measured(SPEED, epsilon, contact_time=times), MODELS[0])
        found = DampingFit(main.points, (main,), Verdict("holds", ()), ())
        constant, young = found.stiffness(BALL, False)
        values.append([constant.value, young.value])
        errors.append([constant.standard_error, young.standard_error])
    assert np.std(values, axis=0) == pytest.approx(np.mean(errors, axis=0), rel=0.2)
    assert np.mean(values, axis=0) == pytest.approx([5e-7, 7e10], rel=0.02)


def test_the_error_of_beta_is_that_of_least_squares():
    """sigma/sqrt(sum (d eps/d beta)^2), for points with one standard error."""
    found = fitted(sigma=0.005)
    low, high = (vp.epsilon(np.sqrt(beta) * SPEED**0.1) for beta in (0.999 * found.beta, 1.001 * found.beta))
    slopes = (high - low) / (0.002 * found.beta)
    assert found.beta_standard_error == pytest.approx(0.005 / np.linalg.norm(slopes), rel=1e-5)


@pytest.mark.parametrize("contact", [1e-4, 0.05])
def test_errors_of_both_constants_are_propagated(contact):
    """With Q = tau_c(v*) v^(-1/5)/t_c: A ~ beta/Q and Y ~ Q^(5/2); beta and the mean of ln Q have errors."""
    found = fitted(contact=contact)
    constant, young = found.stiffness(BALL, False)
    relative = found.beta_standard_error / found.beta

    def logs(beta):
        return np.log(double.tau_c(np.sqrt(beta) * SPEED**0.1) * SPEED**-0.2 / found.points.contact_time)

    scatter = np.std(logs(found.beta), ddof=1) / math.sqrt(12)
    moved = np.mean(logs(found.beta * math.exp(relative)) - logs(found.beta))
    of_constants = math.hypot(relative - moved, scatter), 2.5 * math.hypot(moved, scatter)
    found_errors = constant.standard_error / constant.value, young.standard_error / young.value
    assert found_errors == pytest.approx(of_constants, rel=0.01)


def test_without_contact_times_there_is_no_stiffness():
    with pytest.raises(ValueError, match="expected a column contact_time"):
        fitted().stiffness(BALL, False)


def test_error_of_eps_is_the_change_of_eps():
    v_star, relative = 0.5, 1e-5
    change = double.epsilon(v_star) - double.epsilon(v_star * math.sqrt(1 + relative))
    assert restitution_error(v_star, relative) == pytest.approx(change, rel=1e-4)


@pytest.mark.parametrize("wall", [True, False])
def test_a_scene_has_the_fit_back(wall):
    found = fitted()
    material = {"young_modulus": BALL.young_modulus, "poisson_ratio": BALL.poisson_ratio, "dissipative_constant": 0}
    pair = vp.Pair(BALL, vp.Sphere.wall(**material) if wall else BALL)
    for title in HARD:
        text = scene_text(found, pair, f"viscopade fit {title}", title)
        scene = read.from_toml(text, "ball.toml")
    assert scene.title == HARD[-1] + " ."
    meeting = scene.meetings[-1]
    epsilon, error = found.epsilon(found.main.middle)
    speed = float(f"{found.main.middle:.4g}")
    assert scene.pair(meeting).epsilon(speed) == pytest.approx(found.epsilon(speed)[0], rel=1e-9)
    assert scene.relative_error(meeting) == pytest.approx(found.beta_standard_error / found.beta, rel=1e-2)
    assert scene.tolerance.absolute == pytest.approx(error / 10, rel=0.5)
    notes = setup(scene).notes
    assert f"eps at {speed:.3g} m/s is {uncertain(epsilon, error)}" in notes[-1]
    assert not any("is enough" in note for note in notes)


@pytest.mark.parametrize(
    ("value", "error", "text"),
    [
        (0.87346, 0.0041, "0.8735 +- 0.0041"),
        (5.52e-7, 1.1e-8, "(5.52 +- 0.11)e-07"),
        (7.0123e10, 2.2e8, "(7.012 +- 0.022)e+10"),
        (0.5, 0.0, "0.5"),
        (123.4, 25.0, "123 +- 25"),
        (0.9, 5e-10, "0.90000000000 +- 0.00000000050"),
        (1e-17, 1e-18, "(1.00 +- 0.10)e-17"),
        (1e5, 3e4, "(1.00 +- 0.30)e+05"),
    ],
)
def test_values_are_written_to_the_second_digit_of_their_error(value, error, text):
    assert uncertain(value, error) == text
