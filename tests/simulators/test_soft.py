"""Soft contacts, which an implicit step solves: runs of the real engines, and loops that share no code with ours."""

import math

import numpy as np
import pytest

from tests.simulators.test_impulse import PHASES, measured, package
from viscopade.simulators import simulator_of
from viscopade.simulators.native import Impact, delivery

STEPS = 400  # after which a body that has not left stays


def bullet(settings, mass, radius, gravity, step, both):
    """Return a run of PyBullet: a ball on a plane, or two balls; numbers are those of both bodies."""
    own = package("pybullet")
    own.isConnected() or own.connect(own.DIRECT)
    numbers = {name: tuple(map(float, text.split())) for name, text in settings.items() if name != "body"}

    def run(gap, rate):
        own.resetSimulation()
        own.setGravity(0, 0, -gravity)
        own.setTimeStep(step)
        kind = {"useMaximalCoordinates": settings.get("body") == "btRigidBody"}
        sphere = own.createCollisionShape(own.GEOM_SPHERE, radius=radius)
        upper = own.createMultiBody(mass, sphere, basePosition=[0, 0, radius + gap], **kind)
        if both:
            lower = own.createMultiBody(mass, sphere, basePosition=[0, 0, -radius], **kind)
        else:
            lower = own.createMultiBody(0, own.createCollisionShape(own.GEOM_PLANE), **kind)
        for i, speed in enumerate((rate / 2, -rate / 2) if both else (rate, 0)):
            body = (upper, lower)[i]
            surface = {name: pair[i] for name, pair in numbers.items() if name != "contactBreakingThreshold"}
            own.changeDynamics(body, -1, linearDamping=0, angularDamping=0, **surface)
            own.resetBaseVelocity(body, [0, 0, speed])
        for _ in range(STEPS):
            own.stepSimulation()
            places = [own.getBasePositionAndOrientation(body)[0][2] for body in (upper, lower)]
            rates = [own.getBaseVelocity(body)[0][2] for body in (upper, lower)]
            yield places[0] - places[1] - (2 if both else 1) * radius, rates[0] - rates[1]

    return run


BULLET = [  # contactStiffness, contactDamping, restitution, speed, gravity, step, whether both are balls, body
    ("1e4 1e5", "1 3", "0 0", 1.0, 9.81, 1 / 240, False, "btMultiBody"),
    ("1e3 1e18", "5 0.1", "0 0", 2.0, 0.0, 1 / 240, False, "btMultiBody"),
    ("1e4 1e5", "1 3", "0.5 0.8", 1.0, 9.81, 1 / 240, False, "btMultiBody"),
    ("1e4 1e4", "2 2", "0 0", 1.0, 9.81, 1 / 1000, False, "btRigidBody"),
    ("1e5 1e5", "0 0", "0 0", 3.0, 0.0, 1 / 1000, True, "btMultiBody"),
    ("2e4 1e5", "7 0", "0 0", 1.0, 0.0, 1 / 240, True, "btRigidBody"),
]


@pytest.mark.parametrize(("stiffness", "damping", "restitution", "speed", "gravity", "step", "both", "body"), BULLET)
def test_a_ball_in_bullet(stiffness, damping, restitution, speed, gravity, step, both, body):
    mass, radius = 0.7, 0.2
    given = {"contactStiffness": stiffness, "contactDamping": damping, "restitution": restitution, "body": body}
    if both:  # btSphereSphereCollisionAlgorithm has no margin
        given["contactBreakingThreshold"] = "0"
    real = measured(bullet(given, mass, radius, gravity, step, both), speed, gravity, step)
    native = simulator_of("bullet").native
    impact = Impact(speed, mass / 2 if both else mass, radius, gravity, step)
    found = native.contact(native.values(given), impact).epsilon(PHASES)
    assert found == pytest.approx(real, abs=1e-5)
    assert found.max() > 0.1


def linear_epsilon(stiffness, damping, mass):
    """Return eps of m x'' + c x' + k x = 0 up to where the force vanishes, for a damping ratio below 1."""
    zeta = damping / 2 / math.sqrt(stiffness * mass)
    return math.exp(-2 * zeta * math.acos(zeta) / math.sqrt(1 - zeta**2))


def test_bullet_with_short_steps_is_a_linear_spring():
    """1/k = 1/1e4 + 1/1e5, c = 1 + 3; a restitution of both makes the damper act on v + e v."""
    native = simulator_of("bullet").native
    given = {"contactStiffness": "1e4 1e5", "contactDamping": "1 3"}
    exact = linear_epsilon(1e9 / 1.1e5, 4, 0.7)
    assert delivery(native, given, Impact(1.0, 0.7)).collision.epsilon == pytest.approx(exact, abs=1e-8)
    # In steps of h implicit Euler damps by a factor exp(-pi h/2 sqrt(k/m)) more, which is 0.998.
    given["restitution"] = "0.5 0.8"
    limit = delivery(native, given, Impact(1.0, 0.7)).collision.epsilon
    stepped = delivery(native, given, Impact(1.0, 0.7, 0.2, 0.0, 1e-5)).collision.epsilon
    assert limit != pytest.approx(exact, abs=0.01)
    assert stepped == pytest.approx(limit, abs=3e-3)


def test_what_is_written_gives_the_wanted_eps_in_bullet():
    native = simulator_of("bullet").native
    given = {"contactStiffness": "2e3"}
    written = delivery(native, given, Impact(1.0, 0.7, 0.2, 9.81, 1 / 1000), 0.5).instead
    pairs = {name: f"{value} {value}" for name, value in (given | written).items()}
    run = bullet(pairs, 0.7, 0.2, 9.81, 1 / 1000, False)
    assert measured(run, 1.0, 9.81, 1 / 1000, (np.arange(64) + 0.5) / 64).mean() == pytest.approx(0.5, abs=1e-3)


def test_a_stiffness_of_bullet_needs_a_mass():
    native = simulator_of("bullet").native
    with pytest.raises(ValueError, match="mass is missing: expected --mass"):
        delivery(native, {"contactStiffness": "2e3"}, Impact(1.0, None, 0.2, 9.81, 1 / 240))
