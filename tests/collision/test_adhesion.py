"""JKR's contact: NumPy's roots of the quartic, and SciPy's integration in the contact radius, which needs no root."""

import math

import numpy as np
import pytest
from scipy.integrate import solve_ivp

from viscopade.collision.adhesion import JKR, LARGEST_PULL, TURN_OF_COMPRESSION

MODULUS, RADIUS, WORK, MASS = 3.5e6, 2e-4, 0.07, 4e-8


@pytest.mark.parametrize("x", [-5.9e-7, -1e-7, 0.0, 1e-9, 1e-6, 1e-4, 1e-1])
def test_the_contact_radius_is_the_largest_root(x):
    """a^4 - 2 R x a^2 - (2 pi w R^2/E) a + R^2 x^2 = 0, which is x = a^2/R - (2 pi w a/E)^(1/2) without the root."""
    first = (2 * math.pi * WORK * RADIUS**2 / MODULUS) ** (1 / 3)
    b = 2 * RADIUS * x / first**2  # with a in units of a_0
    roots = np.roots([1, 0, -b, -1, b * b / 4])
    largest = max(root.real for root in roots if abs(root.imag) < 1e-6)
    assert float(JKR(MODULUS, RADIUS, WORK).contact_radius(x)) == pytest.approx(first * largest, rel=1e-9)


def test_without_adhesion_it_is_hertz_contact():
    spheres, x = JKR(MODULUS, RADIUS, 1e-20), np.array([1e-9, 1e-5])
    a = spheres.contact_radius(x)
    assert a == pytest.approx(np.sqrt(RADIUS * x), rel=1e-6)
    assert spheres.force(a) == pytest.approx(4 / 3 * MODULUS * math.sqrt(RADIUS) * x**1.5, rel=1e-5)


def in_the_contact_radius(damping, speed):
    """Return eps: a' = v/(dx/da), m v' = -F(a) - c(a) v, from a_0 to the largest pull, a^3 = 9/16 a_0^3."""
    first = (2 * math.pi * WORK * RADIUS**2 / MODULUS) ** (1 / 3)
    unit = RADIUS * math.sqrt(MASS / (MODULUS * RADIUS**3))  # of time, roughly

    def rates(_, state):
        a, v = state[0] * first, state[1] * speed
        slope = 2 * a / RADIUS - math.sqrt(math.pi * WORK / (2 * MODULUS * a))
        force = 4 * MODULUS * a**3 / (3 * RADIUS) - math.sqrt(8 * math.pi * WORK * MODULUS * a**3) + damping(a) * v
        return v / slope / first * unit, -force / MASS / speed * unit

    def breaks(_, state):
        return state[0] - (9 / 16) ** (1 / 3)

    breaks.terminal, breaks.direction = True, -1
    run = solve_ivp(rates, (0, 1e6), (1, 1), method="DOP853", rtol=1e-12, atol=1e-14, events=breaks)
    return -run.y[1, -1]


@pytest.mark.parametrize("speed", [0.05, 0.3, 5.0])
@pytest.mark.parametrize("power", [0, 1])
def test_damped_spheres_agree_with_an_integration_in_the_contact_radius(power, speed):
    def damping(a):
        return 1e-3 * (a * 20) ** power * 0.1

    spheres = JKR(MODULUS, RADIUS, WORK, LARGEST_PULL)
    collision = spheres.contact(MASS, damping).collide(speed)
    assert collision.epsilon == pytest.approx(in_the_contact_radius(damping, speed), abs=1e-9)
    assert collision.errors["epsilon"] < 1e-8


@pytest.mark.parametrize(("neck", "k"), [(TURN_OF_COMPRESSION, 7.09220), (LARGEST_PULL, 3.50260)])
def test_elastic_spheres_lose_the_energy_of_the_neck(neck, k):
    """The constants are those that the literature has, and that a run of LAMMPS gave (3.500)."""
    spheres = JKR(MODULUS, RADIUS, WORK, neck)
    energy = k * (WORK**5 * RADIUS**4 / MODULUS**2) ** (1 / 3)
    assert spheres.neck_energy == pytest.approx(energy, rel=1e-6)
    assert spheres.sticking_speed(MASS) == pytest.approx(math.sqrt(2 * energy / MASS), rel=1e-6)
    collision = spheres.contact(MASS, lambda a: 0 * a).collide(0.1)
    assert MASS * 0.1**2 / 2 * (1 - collision.epsilon**2) == pytest.approx(energy, rel=2e-6)


def test_the_largest_pull():
    spheres = JKR(MODULUS, RADIUS, WORK)
    a = np.linspace(0.3, 1, 100_001) * spheres.first_radius
    assert -spheres.force(a).min() == pytest.approx(spheres.pull_off_force, rel=1e-7)
    assert spheres.pull_off_force == pytest.approx(1.5 * math.pi * WORK * RADIUS, rel=1e-15)
    x = a**2 / RADIUS - np.sqrt(2 * math.pi * WORK * a / MODULUS)
    assert x.min() == pytest.approx(spheres.break_at, rel=1e-7)
