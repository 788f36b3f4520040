"""LIGGGHTS: the text read back and its law integrated in time; and collisions in the program where it is there."""

import math
import re
import shutil
from dataclasses import replace

import pytest

from tests.simulators.two_balls import GLASS, RUBBER, SETUP, SMALL, elastic, integrated, run_of, setup
from viscopade import Pair
from viscopade.collision import tsuji
from viscopade.simulators import lammps, liggghts, stated
from viscopade.simulators.setup import NamedContact, Setup, Units
from viscopade_lab.runs import simulators

COMMAND = "viscopade simulators liggghts scene.toml"
PRESENT = pytest.mark.skipif(shutil.which("liggghts") is None, reason="the program liggghts is not installed")


def values(text, name):
    """Return the matrix or vector of a property."""
    found = re.search(rf"property/global {name} (peratomtype\w*) ((?:.*&\n)*.*)\n", text)
    numbers = [float(word) for word in found[2].replace("&", " ").split()]
    if found[1] == "peratomtype":
        return numbers
    n = int(numbers[0])
    assert len(numbers) == 1 + n * n
    return [numbers[1 + n * i : 1 + n * (i + 1)] for i in range(n)]


def stiffness_force(pair, text, i=0, j=0):
    """NormalModel<HERTZ_STIFFNESS>, without the clipping."""
    kn, gamman = (values(text, name)[i][j] for name in ("kn", "gamman"))
    return lambda x, u: math.sqrt(pair.R_eff * x) * (kn * x + pair.m_eff * gamman * u)


def hertz_force(pair, text, i=0, j=0):
    """NormalModel<HERTZ>, without the clipping."""
    e = values(text, "coefficientRestitution")[i][j]
    beta = math.log(e) / math.sqrt(math.log(e) ** 2 + math.pi**2)

    def force(x, u):
        root = math.sqrt(pair.R_eff * x)
        damping = -2 * 0.91287092917527685 * beta * math.sqrt(2 * pair.E_eff * root * pair.m_eff)
        return 4 / 3 * pair.E_eff * root * x + damping * u

    return force


def end_of(text):
    return "force" if re.search(r"^pair_style .* limitForce on$", text, re.MULTILINE) else "position"


@pytest.mark.parametrize("epsilon", [0.97, 0.6, 0.1])
def test_hertz_stiffness_is_the_viscoelastic_law(epsilon):
    case = setup(epsilon)
    (contact,) = case.contacts
    text = liggghts.render(case, COMMAND)
    assert end_of(text) == "force"
    for speed in (contact.slowest, contact.typical, contact.fastest):
        found = integrated(stiffness_force(contact.pair, text), case, speed, "force")
        assert found == pytest.approx(contact.pair.epsilon(speed), rel=1e-7)


@pytest.mark.parametrize("epsilon", [0.97, 0.6, 0.25, 0.15])
def test_hertz_has_the_wanted_eps_at_the_typical_speed(epsilon):
    case = setup(epsilon)
    text = liggghts.render(case, COMMAND, "hertz")
    assert end_of(text) == ("position" if epsilon == 0.15 else "force")
    force = hertz_force(case.contacts[0].pair, text)
    for speed in (0.1, 1.0):
        assert integrated(force, case, speed, end_of(text)) == pytest.approx(epsilon, rel=1e-7)


def test_the_numbers_of_every_pair_of_types():
    text = liggghts.render(SETUP, COMMAND)
    bodies = list(SETUP.bodies.values())
    for i, first in enumerate(bodies):
        for j, second in enumerate(bodies):
            if first.is_wall and second.is_wall:
                assert values(text, "kn")[i][j] == values(text, "gamman")[i][j] == values(text, "kt")[i][j] == 0
                continue
            pair = Pair(first, second)
            wanted = pair.rho / math.sqrt(pair.R_eff)
            assert values(text, "kn")[i][j] == pytest.approx(wanted, rel=1e-11)
            assert values(text, "gamman")[i][j] == pytest.approx(1.5 * pair.A * wanted / pair.m_eff, rel=1e-11)
    shear = [b.young_modulus / (2 * (1 + b.poisson_ratio)) for b in (GLASS, RUBBER)]
    mindlin = 8 / sum((2 - b.poisson_ratio) / g for b, g in zip((GLASS, RUBBER), shear, strict=True))
    assert values(text, "kt")[0][2] == pytest.approx(mindlin, rel=1e-11)
    assert values(text, "gammat") == [[0.0] * 3] * 3
    assert "1 = glass, 2 = floor 1, 3 = rubber" in text


def test_hertz_text():
    text = liggghts.render(SETUP, COMMAND, "hertz")
    assert values(text, "youngsModulus") == [2e9, 5e8, 1e6]
    assert values(text, "poissonsRatio") == [0.2, 0.3, 0.48]
    matrix = values(text, "coefficientRestitution")
    assert matrix == [list(row) for row in zip(*matrix, strict=True)]
    assert matrix[0][1] == matrix[0][2] == matrix[1][1] == matrix[2][2] == 1
    for contact, number in zip(SETUP.contacts, (matrix[0][0], matrix[1][2]), strict=True):
        ratio = tsuji.damping_ratio(number, end="position")
        assert tsuji.epsilon(ratio) == pytest.approx(contact.pair.epsilon(contact.typical), rel=1e-11)
    assert "soft_particles yes\nhard_particles yes\n" in text
    plain = liggghts.render(setup(0.9), COMMAND, "hertz")
    assert "particles yes" not in plain


def test_stated_errors_are_those_of_the_law():
    contact = SETUP.contacts[0]
    text = liggghts.render(SETUP, COMMAND)
    stated = re.findall(r"with the \w+ v\*: (\S+) at the slowest, (\S+) at", text)[:2]
    for (slow, fast), pair in zip(stated, contact.extremes, strict=True):
        case = Setup("t", {"a": pair.first}, (NamedContact("a", "a", pair, 0.01, 0.1, 1.0),))
        for speed, error in ((0.01, slow), (1.0, fast)):
            found = integrated(stiffness_force(pair, text), case, speed, "force")
            assert found / pair.epsilon(speed) - 1 == pytest.approx(float(error), rel=6e-3)
    assert "Error of eps: 0 at the slowest, 0 at the fastest speed" in text
    constant = liggghts.hertz_restitution(contact, True).constant
    assert f"{constant.errors.fastest:+.2e} at the fastest speed" in text


def test_the_text():
    for model in ("hertz/stiffness", "hertz"):
        text = liggghts.render(SETUP, COMMAND, model)
        assert f"timestep {float(Pair(SMALL, SMALL).contact_time(1.0)) / stated.STEPS:.6g}\n" in text
        timestep = float(re.search(r"timestep (\S+)", text)[1])
        step_error = max(lammps.timestep_error(contact, timestep) for contact in SETUP.contacts)
        assert (f"off by up to {step_error:.1e} " in text) == (model == "hertz/stiffness")
        assert f"pair_style gran model {model} tangential off limitForce on\n" in text
    assert "cm, g, s" in liggghts.render(replace(SETUP, units=Units("cm", "g", "s")), COMMAND)


def test_without_dissipation():
    assert values(liggghts.render(elastic(), COMMAND), "gamman") == [[0.0]]
    assert values(liggghts.render(elastic(), COMMAND, "hertz"), "coefficientRestitution") == [[1.0]]


def test_what_the_program_cannot_have():
    assert liggghts.least_epsilon(True) == pytest.approx(0.2137, abs=1e-4)
    with pytest.raises(ValueError, match=r"limitForce on is more than 0\.2137"):
        liggghts.coefficient_restitution(0.2, True)
    assert liggghts.coefficient_restitution(0.2, False) == 0.2
    almost = setup(0.22)  # the eps of the smallest largest error is below what the program can have
    assert liggghts.hertz_restitution(almost.contacts[0], True).balanced is None
    assert "The largest error is smallest" not in liggghts.render(almost, COMMAND, "hertz")
    assert "The largest error is smallest" in liggghts.render(setup(0.6), COMMAND, "hertz")
    case = setup(0.04)
    with pytest.raises(ValueError, match=r"epsilon is .*limitForce off is more than 0\.05"):
        liggghts.render(case, COMMAND, "hertz")
    assert "cannot have this eps: epsilon is" in liggghts.render(case, COMMAND)
    with pytest.raises(ValueError, match="model is 'hooke': expected 'hertz/stiffness' or 'hertz'"):
        liggghts.render(case, COMMAND, "hooke")


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
    text = liggghts.render(case, COMMAND)
    exact = case.contacts[0].pair.epsilon(speed)
    coarse, fine = (collide(case, text, speed, steps) for steps in (400, 1600))
    scheme = lammps.stepped_epsilon(case.contacts[0].pair, speed, run_of(case, speed, 400)[0], 0.0)
    assert coarse == pytest.approx(scheme, rel=1e-7)  # the step error that the text states is computed with it
    assert coarse == pytest.approx(exact, rel=2e-3)
    assert fine == pytest.approx(exact, rel=3e-4)
    assert abs(fine - exact) < abs(coarse - exact) / 2
    assert fine + (fine - coarse) / 3 == pytest.approx(exact, rel=2e-5)


@PRESENT
@pytest.mark.parametrize("epsilon", [0.9, 0.3, 0.15])
def test_a_constant_eps_in_the_program(epsilon):
    case = setup(epsilon)
    text = liggghts.render(case, COMMAND, "hertz")
    for speed in (0.1, 1.0):
        assert collide(case, text, speed, 1600) == pytest.approx(epsilon, rel=1e-3)


@PRESENT
@pytest.mark.parametrize("model", ["hertz/stiffness", "hertz"])
def test_a_wall_and_the_time_step_of_the_text(model):
    contact = SETUP.contacts[1]
    text = liggghts.render(SETUP, COMMAND, model)
    (wall,) = re.findall(r"^# (fix wall all wall/gran .*)$", text, re.MULTILINE)
    commands = simulators.liggghts_spheres(
        "include contacts.in",
        float(re.search(r"timestep (\S+)", text)[1]),
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
