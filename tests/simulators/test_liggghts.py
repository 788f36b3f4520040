"""LIGGGHTS: the numbers of all pairs of types, and collisions in the program where it is there."""

import math
import re
import shutil

import pytest

from tests.simulators.two_balls import GLASS, RUBBER, SETUP, flowing, matrix, run_of, setup
from viscopade import Pair
from viscopade.collision.contact import Contact
from viscopade.simulators.input_file import render
from viscopade_lab.runs import simulators

COMMAND = "viscopade simulators liggghts scene.toml"
PRESENT = pytest.mark.skipif(shutil.which("liggghts") is None, reason="the program liggghts is not installed")


def test_the_numbers_of_every_pair_of_types():
    text = render("liggghts", SETUP, COMMAND)
    bodies = list(SETUP.bodies.values())
    for i, first in enumerate(bodies):
        for j, second in enumerate(bodies):
            if first.is_wall and second.is_wall:
                assert matrix(text, "kn")[i][j] == matrix(text, "gamman")[i][j] == matrix(text, "kt")[i][j] == 0
                continue
            pair = Pair(first, second)
            wanted = pair.rho / math.sqrt(pair.R_eff)
            assert matrix(text, "kn")[i][j] == pytest.approx(wanted, rel=1e-11)
            assert matrix(text, "gamman")[i][j] == pytest.approx(1.5 * pair.A * wanted / pair.m_eff, rel=1e-11)
    shear = [b.young_modulus / (2 * (1 + b.poisson_ratio)) for b in (GLASS, RUBBER)]
    mindlin = 8 / sum((2 - b.poisson_ratio) / g for b, g in zip((GLASS, RUBBER), shear, strict=True))
    assert matrix(text, "kt")[0][2] == pytest.approx(mindlin, rel=1e-11)
    assert matrix(text, "gammat") == [[0.0] * 3] * 3
    assert re.findall(r"^#   (\d) (\w+)", text, re.MULTILINE) == [("1", "glass"), ("2", "floor"), ("3", "rubber")]


def collide(case, text, speed, steps):
    """Run two balls in the program, with generated commands."""
    ball = case.bodies["ball"]
    script = simulators.liggghts_spheres(
        "include contacts.in", *run_of(case, speed, steps), radius=ball.radius, mass=ball.mass, speed=speed
    )
    return simulators.liggghts(script, **{"contacts.in": text})


@PRESENT
@pytest.mark.parametrize("speed", [0.1, 1.0, 10.0])
def test_collisions_in_the_program(speed):
    case = setup(0.5)
    text = render("liggghts", case, COMMAND)
    exact = case.contacts[0].pair.epsilon(speed)
    coarse, fine = (collide(case, text, speed, steps) for steps in (400, 1600))
    pair = case.contacts[0].pair
    contact = Contact.of_law("viscoelastic", float(pair.v_star(speed)) ** 2)
    scheme = contact.rebounds(1.0, run_of(case, speed, 400)[0] / pair.time_scale(speed), 0.0).epsilon
    assert coarse == pytest.approx(float(scheme), rel=1e-7)  # the step error that the text states is computed with it
    assert coarse == pytest.approx(exact, rel=2e-3)
    assert fine == pytest.approx(exact, rel=3e-4)
    assert abs(fine - exact) < abs(coarse - exact) / 2
    assert fine + (fine - coarse) / 3 == pytest.approx(exact, rel=2e-5)


CONSTANT = """
fix young all property/global youngsModulus peratomtype {young!r}
fix poisson all property/global poissonsRatio peratomtype {poisson!r}
fix restitution all property/global coefficientRestitution peratomtypepair 1 {number}
pair_style gran model hertz tangential off limitForce {switch}
pair_coeff * *
"""


@PRESENT
@pytest.mark.parametrize("epsilon", [0.9, 0.3, 0.15])
def test_a_constant_eps_in_the_program(epsilon):
    """With the numbers that the comments state."""
    case = setup(epsilon)
    text, ball = flowing(render("liggghts", case, COMMAND)), case.bodies["ball"]
    (switch,) = re.findall(r"limitForce (\w+), has one eps", text)
    (number,) = re.findall(r"; coefficientRestitution (\S+) \(", text)
    constant = CONSTANT.format(young=ball.young_modulus, poisson=ball.poisson_ratio, number=number, switch=switch)
    for speed in (0.1, 1.0):
        assert collide(case, constant, speed, 1600) == pytest.approx(epsilon, rel=1e-3)


@PRESENT
def test_a_wall_and_the_time_step_of_the_text():
    contact = SETUP.contacts[1]
    text = render("liggghts", SETUP, COMMAND)
    (wall,) = re.findall(r"^# +(fix wall all wall/gran .*)$", text, re.MULTILINE)
    commands = simulators.liggghts_spheres(
        "include contacts.in",
        float(re.search(r"^timestep (\S+)", text, re.MULTILINE)[1]),
        60000,
        radius=RUBBER.radius,
        mass=RUBBER.mass,
        speed=2 * contact.typical,
    )
    for old, new in (
        ("create_box 1 box", "create_box 3 box"),
        ("create_atoms 1 single -0.02 0 0", "create_atoms 1 single -0.15 0 0"),
        ("create_atoms 1 single 0.02 0 0", "create_atoms 3 single 0.02 0 0"),
        (f"set atom 1 vx {contact.typical!r}", "set atom 1 vx 0"),
        (f"set atom 2 vx -{contact.typical!r}", f"set atom 2 vx {contact.typical!r}"),
        (f"/(2*{contact.typical!r})", f"/{contact.typical!r}"),
        ("fix move", wall.replace("type N zplane 0", "type 2 xplane 0.0400001") + "\nfix move"),
    ):
        assert old in commands
        commands = commands.replace(old, new)
    found = -simulators.liggghts(commands, **{"contacts.in": text})
    assert found == pytest.approx(contact.pair.epsilon(contact.typical), rel=2e-3)
