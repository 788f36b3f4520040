"""Contacts that adhere: LAMMPS itself, SciPy for Lethe's force, and what the command prints."""

import json
import math

import numpy as np
import pytest
from click.testing import CliRunner
from scipy.integrate import solve_ivp

from tests.simulators.two_balls import need
from viscopade.cli import main
from viscopade.simulators import simulator_of
from viscopade.simulators.native import Impact, delivery
from viscopade_lab.runs import simulators

DIAMETER, MASS = 1e-3, 2500 * math.pi / 6 * 1e-9
YOUNG, NU, GAMMA = 5e6, 0.3, 0.035
E_EFF, R_EFF, M_EFF = YOUNG / (2 * (1 - NU**2)), DIAMETER / 4, MASS / 2
ENERGY = ((2 * GAMMA) ** 5 * R_EFF**4 / E_EFF**2) ** (1 / 3)
DAMPINGS = {"velocity": 2e-4, "mass_velocity": 300.0, "viscoelastic": 3e6}


def line(normal, damping="velocity", coefficient=0.0):
    """Return the parameters of a line, and the line."""
    numbers = f"{YOUNG} {coefficient} {NU} {GAMMA}"
    settings = {"units": "si", "normal": normal, "coefficients": numbers, "damping": damping}
    return settings, f"{normal} {numbers} {simulators.FRICTIONLESS} damping {damping}"


def contact_of(settings, gravity=0.0, radius=R_EFF, mass=M_EFF):
    native = simulator_of("lammps").native
    return native.contact(native.values(settings), Impact(1.0, mass, radius, gravity))


def in_lammps(style, speed, step, run):
    """Return eps of two equal spheres, which touch first in the middle of a step."""
    spheres = simulators.lammps_spheres(style, speed=speed, diameter=DIAMETER, step=step, mass=MASS, run=run, every=run)
    return float(simulators._COLLISION.search(simulators.lammps(spheres))[1])


HERTZ = "particle particle contact force method"


@pytest.fixture(scope="module")
def program():
    need("lammps")


@pytest.mark.parametrize("normal", ["jkr", "dmt"])
@pytest.mark.parametrize("damping", DAMPINGS)
@pytest.mark.parametrize("speed", [0.03, 0.5])
def test_lammps_gives_this_eps(program, normal, damping, speed):
    settings, style = line(normal, damping, DAMPINGS[damping])
    contact = contact_of(settings)
    fine = contact.collide(speed)
    step = math.pi * fine.depth / speed / 2000
    measured = in_lammps(style, speed, step, 6000)
    assert measured == pytest.approx(float(contact.rebounds(speed, step, 0.5).epsilon), abs=1e-10)
    # The force jumps where contact begins, so eps of a phase has an error of first order in the step.
    assert measured == pytest.approx(fine.epsilon, abs=1e-3)
    assert fine.errors["epsilon"] < 1e-8


def test_elastic_spheres_in_lammps_lose_the_energy_of_the_neck_to_the_largest_pull(program):
    _, style = line("jkr")
    speed, period = 0.015, 1.5e-3
    lost = [M_EFF * speed**2 / 2 * (1 - in_lammps(style, speed, h, round(period / h)) ** 2) for h in (4e-8, 2e-8)]
    assert 2 * lost[1] - lost[0] == pytest.approx(3.5026 * ENERGY, rel=2e-4)
    assert delivery(
        simulator_of("lammps").native, line("jkr")[0], Impact(speed, M_EFF, R_EFF)
    ).sticking.neck_energy == pytest.approx(3.50260 * ENERGY, rel=1e-6)


@pytest.mark.parametrize("normal", ["jkr", "dmt"])
def test_spheres_stick_in_lammps_below_the_sticking_speed(program, normal):
    settings, style = line(normal, "viscoelastic", 3e7)
    slowest = delivery(simulator_of("lammps").native, settings, Impact(0.1, M_EFF, R_EFF)).sticking.speed
    contact = contact_of(settings)
    for factor, parts in ((0.98, False), (1.02, True)):
        step, run = 1e-7, 30_000
        spheres = simulators.lammps_spheres(
            style, speed=factor * slowest, diameter=DIAMETER, step=step, mass=MASS, run=run, every=run
        )
        gap = float(simulators._COLLISION.search(simulators.lammps(spheres))[2])
        assert (gap > 1e-6) == parts == contact.collide(factor * slowest).parts


@pytest.mark.parametrize(("normal", "speed"), [("jkr", 0.02), ("dmt", 0.02), ("jkr", 0.2)])
def test_a_sphere_that_falls_on_a_wall_in_lammps(program, normal, speed):
    """With its weight; both path and eps at the level of first contact."""
    settings, style = line(normal, "viscoelastic", 3e6)
    radius, step, gravity, phase = DIAMETER / 2, 2e-7, 9.81, 0.3
    contact = contact_of(settings, gravity, radius, MASS)
    flight = phase * step
    start = flight * speed - gravity / 2 * flight**2, -(speed - gravity * flight)
    run = round(4 * contact.contact_time(0.2) / step) if speed < 0.1 else 6000
    ((gaps, velocities),) = simulators.lammps_falls(
        [start], style, radius=radius, gravity=gravity, mass=MASS, step=step, run=run, every=run
    )
    measured = math.sqrt(velocities[-1] ** 2 + 2 * gravity * gaps[-1]) / speed
    assert measured == pytest.approx(float(contact.rebounds(speed, step, phase).epsilon), abs=1e-9)
    assert measured == pytest.approx(contact.collide(speed).epsilon, abs=1e-3)


@pytest.mark.parametrize(
    ("changes", "words", "message", "theirs"),
    [
        ({"damping": "tsuji"}, "tsuji", "damping is tsuji: expected velocity, mass_velocity, visco", "cohesive normal"),
        ({"limit_damping": "yes"}, "velocity limit_damping", "limit_damping is yes: expected no", "cohesive normal"),
        ({"coefficients": "5e6 0 0.3 0"}, "", "gamma 0: expected a number > 0", ""),
        ({"coefficients": "5e6 0 0.3"}, "", "3 numbers: expected for jkr E, damping coefficient, nu and gamma", ""),
        ({"coefficients": "5e6 0 0.6 1"}, "", "a nu up to 1/2", ""),
    ],
)
def test_what_lammps_refuses_is_refused(program, changes, words, message, theirs):
    with pytest.raises(ValueError, match=message):
        contact_of(line("jkr")[0] | changes)
    if theirs:
        with pytest.raises(RuntimeError, match=theirs):
            in_lammps(line("jkr")[1].replace("damping velocity", f"damping {words}"), 0.1, 1e-6, 1)


@pytest.mark.parametrize("speed", [0.05, 0.4])
def test_lethe_pulls_while_there_is_an_overlap(speed):
    """The wall of the source: the largest root of its quartic by NumPy, Hertz' damping, and no force at x <= 0."""
    mass, R, g1, g2, e1, e2 = 1e-6, 5e-4, 0.02, 0.05, 0.8, 0.6
    E = 1 / ((1 - 0.3**2) / 2e6 + (1 - 0.2**2) / 9e6)
    w = g1 + g2 - (math.sqrt(g1) - math.sqrt(g2)) ** 2
    e = 2 * e1 * e2 / (e1 + e2)
    beta = -math.log(e) / math.sqrt(math.log(e) ** 2 + math.pi**2)
    scale = (2 * math.pi * w * R**2 / E) ** (1 / 3)

    def rates(_, state):
        x, v = state * (scale**2 / R, speed)
        roots = np.roots([1, 0, -2 * R * x / scale**2, -1, (R * x / scale**2) ** 2])
        a = scale * max(root.real for root in roots if abs(root.imag) < 1e-6)
        damping = 2 * math.sqrt(5 / 6) * beta * math.sqrt(2 * E * math.sqrt(R * max(x, 0)) * mass)
        force = 4 * E * a**3 / (3 * R) - math.sqrt(8 * math.pi * w * E * a**3) + damping * v
        return v / scale**2 * R * 1e-4, -force / mass / speed * 1e-4

    def over(_, state):
        return state[0]

    over.terminal, over.direction = True, -1
    run = solve_ivp(rates, (0, 99), (0, 1), method="DOP853", rtol=1e-11, atol=1e-13, events=over)
    pairs = {"young modulus": "2e6 9e6", "poisson ratio": "0.3 0.2"}
    pairs |= {"restitution coefficient": "0.8 0.6", "surface energy": "0.02 0.05"}
    settings = {f"{name} particles": pair for name, pair in pairs.items()} | {HERTZ: "hertz_JKR"}
    collision = delivery(simulator_of("lethe").native, settings, Impact(speed, mass, R)).collision
    assert collision.epsilon == pytest.approx(-run.y[1, -1], abs=1e-8)


def test_lethe_without_adhesion_is_its_formula():
    settings = {HERTZ: "hertz", "restitution coefficient particles": "0.5"}
    collision = delivery(simulator_of("lethe").native, settings, Impact(1.0, 0.01, 0.01))
    assert collision.collision.epsilon == pytest.approx(0.5, abs=1e-12)  # exact for this contact
    assert collision.sticking is None
    with pytest.raises(ValueError, match="surface energy is 0 0: expected numbers > 0, or a contact force"):
        delivery(simulator_of("lethe").native, {HERTZ: "hertz_JKR"}, Impact(1.0, 0.01, 0.01))


def printed(*words):
    result = CliRunner().invoke(main.command, ["audit", *words])
    assert result.exit_code == 0, result.output
    return result.stdout


def test_the_command_says_what_adhesion_does():
    settings = line("jkr", "viscoelastic", 3e6)[0]
    words = ["lammps", f"--mass={M_EFF}", f"--radius={R_EFF}", "--speed=0.05", "--epsilon=0.5"]
    words += [f"--set={name}={value}" for name, value in settings.items()]
    document = json.loads(printed(*words, "--format=json"))
    energy, slowest = document["neck_energy"], document["sticking_speed"]
    assert energy == pytest.approx(3.50260 * ENERGY, rel=1e-6)
    assert [contact_of(settings).collide(factor * slowest).parts for factor in (0.999, 1.001)] == [False, True]
    assert contact_of({**settings, **document["instead"]}).collide(0.05).epsilon == pytest.approx(0.5, abs=1e-7)
    text = " ".join(printed(*words).split())
    assert f"below {slowest:.4g} m/s the bodies stay together; without damping the neck costs" in text
    assert f" {energy:.4g} J " in text
    settings = ["--set=normal=hertz", "--set=coefficients=1e5 1"]
    assert "adhesion" not in printed("lammps", *settings, "--mass=1", "--radius=1", "--speed=1")


def test_elastic_dmt_spheres_part_at_every_speed():
    found = delivery(simulator_of("lammps").native, line("dmt")[0], Impact(0.01, M_EFF, R_EFF))
    assert found.collision.epsilon == pytest.approx(1, abs=1e-11)
    assert found.sticking == (None, 0.0)
