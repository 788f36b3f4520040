"""Bodies and contacts for the texts of simulators, and a force law between two balls integrated in time."""

import math
import re
from dataclasses import replace
from types import SimpleNamespace

import pytest
from scipy.integrate import solve_ivp

from viscopade import Pair, Sphere
from viscopade.simulators.setup import NamedContact, Setup
from viscopade_lab.runs.simulators import PROGRAMS

GLASS = Sphere(radius=0.01, density=2500, young_modulus=2e9, poisson_ratio=0.2, dissipative_constant=2e-5)
RUBBER = Sphere(radius=0.02, density=1100, young_modulus=1e6, poisson_ratio=0.48, dissipative_constant=1e-4)
FLOOR = Sphere.wall(young_modulus=5e8, poisson_ratio=0.3, dissipative_constant=1e-5)
SMALL, LARGE = (replace(GLASS, radius=0.01 * s, mass=GLASS.mass * s**3) for s in (0.8, 1.25))
SOFT = 'rubber "soft"'
SETUP = Setup(
    "Glass and rubber",
    {"glass": GLASS, "floor 1": FLOOR, SOFT: RUBBER},
    (
        NamedContact("glass", "glass", Pair(GLASS, GLASS), 0.01, 0.1, 1.0, (Pair(LARGE, LARGE), Pair(SMALL, SMALL))),
        NamedContact(SOFT, "floor 1", Pair(RUBBER, FLOOR), 0.1, 0.2, 2.0),
    ),
)


def elastic():
    """Return the setup of two balls without dissipation."""
    ball = replace(GLASS, dissipative_constant=0)
    return Setup("t", {"a": ball}, (NamedContact("a", "a", Pair(ball, ball), 0.1, 0.2, 0.3),))


def need(name):
    """Skip the test if a simulator is not there or does not run at all."""
    try:
        PROGRAMS[name].version()
    except RuntimeError as error:
        pytest.skip(str(error))


def setup(epsilon, speed=1.0):
    """Return two equal balls with the wanted eps at a speed, slower and faster ones by a factor of 10."""
    ball = Sphere(radius=0.01, density=2500, young_modulus=1e8, poisson_ratio=0.25, dissipative_constant=0)
    pair = Pair(ball, ball).calibrated(speed, epsilon)
    contact = NamedContact("ball", "ball", pair, speed / 10, speed, speed * 10)
    return Setup(f"two balls, eps = {epsilon} at {speed} m/s", {"ball": pair.first}, (contact,))


def run_of(case, speed, steps):
    """Return the time step for so many to a contact, and a number of steps after which the balls have parted."""
    pair = case.contacts[0].pair
    return pair.contact_time(speed) / steps, steps * math.ceil(3 + 2 / pair.epsilon(speed))


def integrated(force, case, speed, end):
    """Return the eps of a law F(x, x'), the repulsion at a compression and its rate, integrated in time.

    Contact ends where the force vanishes on the way out, or where the compression does. A second route to what a
    program's law should give: Runge-Kutta steps in the compression itself, accurate to about 1e-7.
    """
    pair = case.contacts[0].pair
    length, time = pair.length_scale(speed), pair.time_scale(speed)

    def rates(_, state):
        x, u = max(state[0], 0.0), state[1]
        return u, -force(x * length, u * speed) / pair.m_eff * time / speed

    def over(_, state):
        x, u = state
        if u >= 0:
            return 1.0  # on the way in
        return x if end == "position" else force(max(x, 0.0) * length, u * speed) / force(length, 0)

    over.terminal, over.direction = True, -1
    run = solve_ivp(rates, (0, 1000), (0.0, 1.0), method="DOP853", rtol=1e-10, atol=1e-12, events=over)
    return -run.y[1, -1]


def fallen(force, mass, gravity, speed, time, end="force"):
    """Return eps, the depth and the duration of a body that falls on a plane with a law F(x, x'), integrated in time.

    Contact ends where the force vanishes, from where the body flies on, or where the compression does. `time` is a
    typical time, for the scale.
    """

    def rates(_, state):
        x, u = max(state[0], 0.0), state[1]
        return u, (gravity - force(x * speed * time, u * speed) / mass) * time / speed

    def turn(_, state):
        return state[1]

    def over(_, state):
        x, u = state
        return x if end == "position" or x <= 0 else force(x * speed * time, u * speed) / force(speed * time, 0)

    turn.terminal = over.terminal = True
    down = solve_ivp(rates, (0, 100), (0.0, 1.0), method="DOP853", rtol=1e-11, atol=1e-13, events=turn)
    up = solve_ivp(rates, (0, 100), (down.y[0, -1], 0.0), method="DOP853", rtol=1e-11, atol=1e-13, events=over)
    x, u = up.y[:, -1]
    rebound = math.sqrt(u * u - 2 * gravity * time / speed * x)
    return rebound, down.y[0, -1] * speed * time, (down.t[-1] + up.t[-1]) * time


def flowing(text):
    """Return a text without comment marks and ends of lines."""
    return " ".join(re.sub(r"^ *(?:#|//|\*)", " ", text, flags=re.MULTILINE).split())


def matrix(text, name):
    """Return the matrix of a property in a file of LIGGGHTS."""
    found = re.search(rf"property/global {name} peratomtypepair ((?:.*&\n)*.*)\n", text)
    n, *numbers = (float(word) for word in found[1].replace("&", " ").split())
    assert len(numbers) == n * n
    return [numbers[i : i + int(n)] for i in range(0, len(numbers), int(n))]


class Functor:
    """Stands in for the functor of YADE, of a version with vn or without."""

    attributes = frozenset()

    def __init__(self, **values):
        self.values = values

    def dict(self):
        return dict.fromkeys(self.attributes)


def yade_names(text, *, vn):
    """Execute a file as YADE would, with stand-ins for its names; return them."""
    materials = []

    def append(material):
        materials.append(material)
        return len(materials) - 1

    names = {
        "O": SimpleNamespace(
            materials=SimpleNamespace(append=append, all=materials), interactions=[], bodies=[], dt=None
        ),
        "FrictMat": dict,
        "Sphere": type("Ball", (), {"__init__": lambda self, radius: setattr(self, "radius", radius)}),
        "MatchMaker": lambda matches: {(a, b): value for a, b, value in matches},
        "Ip2_FrictMat_FrictMat_MindlinPhys": type(
            "Versioned", (Functor,), {"attributes": frozenset({"en", "betan"} | ({"vn"} if vn else set()))}
        ),
    }
    exec(compile(text, "generated", "exec"), names)
    return names
