"""Files for programs with the viscoelastic law: their numbers, read back, in the force of each program.

The forces are written as the programs' sources have them, and integrated in time.
"""

import itertools
import math
import re
from types import SimpleNamespace

import pytest

from tests.simulators.two_balls import (
    RUBBER,
    SETUP,
    SMALL,
    elastic,
    fallen,
    flowing,
    integrated,
    matrix,
    setup,
    yade_names,
)
from viscopade import Pair, Sphere
from viscopade.collision.weight import calibrated
from viscopade.simulators import TARGETS, input_file, simulator_with
from viscopade.simulators.input_file import render
from viscopade.simulators.setup import NamedContact, Setup, pair_setup
from viscopade.simulators.simulator import InputFile

COMMAND = "viscopade simulators PROGRAM scene.toml"
FILES = [name for name in TARGETS if isinstance(simulator_with(name).texts[name], InputFile)]


def lammps(text, pair):
    """GranSubModNormalHertzMaterial and GranSubModDampingViscoelastic."""
    e, eta, nu = map(
        float, re.search(r"^pair_coeff 1 1 hertz/material (\S+) (\S+) (\S+) ", text, re.MULTILINE).groups()
    )
    k = 4 / 3 * e / (2 * (1 - nu**2))
    return lambda x, u: math.sqrt(pair.R_eff * x) * (k * x + eta * pair.m_eff * u)


def liggghts(text, pair):
    """NormalModel<HERTZ_STIFFNESS>."""
    kn, gamman = (matrix(text, name)[0][0] for name in ("kn", "gamman"))
    return lambda x, u: math.sqrt(pair.R_eff * x) * (kn * x + pair.m_eff * gamman * u)


def mercurydpm(text, pair):
    """HertzianBSHPViscoelasticInteraction::computeNormalForce."""
    modulus, dissipation = map(float, re.search(r"set\(one, (\S+), (\S+)\);", text).groups())
    return lambda x, u: 4 / 3 * modulus * math.sqrt(pair.R_eff * x) * (x + 3 / 2 * dissipation * u)


def solved(en):
    """v* at which [3/6] with the printed coefficients is en, by halving."""
    a = (1.0, 1.07232, 0.574198, 0.141552)
    b = (1.0, 1.07232, 1.72765, 1.37842, 1.19449, 0.467273, 0.235585)
    low, high = 0.0, 100.0
    for _ in range(100):
        v = (low + high) / 2
        quotient = sum(c * v**i for i, c in enumerate(a)) / sum(c * v**i for i, c in enumerate(b))
        low, high = (v, high) if quotient > en else (low, v)
    return low


def yade(text, pair, types=(0, 0)):
    """Law2_ScGeom_MindlinPhys_Mindlin with beta."""
    en, vn = (yade_names(text, vn=True)["physics"].values[name][types] for name in ("en", "vn"))
    kno = 4 / 3 * pair.E_eff * math.sqrt(pair.R_eff)
    a = 2 / 3 * solved(en) ** 2 * vn**-0.2 * (kno / pair.m_eff) ** -0.4
    return lambda x, u: kno * x**1.5 + a * 3 / 2 * kno * math.sqrt(x) * u


FORCES = {force.__name__: force for force in (lammps, liggghts, mercurydpm, yade)}
programs = pytest.mark.parametrize("program", FORCES)


@programs
@pytest.mark.parametrize("epsilon", [0.999, 0.6, 0.1])
def test_the_force_is_the_viscoelastic_one(program, epsilon):
    case = setup(epsilon)
    (contact,) = case.contacts
    force = FORCES[program](render(program, case, COMMAND), contact.pair)
    for speed in (contact.slowest, contact.typical, contact.fastest):
        found = integrated(force, case, speed, "force")
        assert found == pytest.approx(contact.pair.epsilon(speed), rel=1e-7)


@programs
def test_without_dissipation(program):
    case = elastic()
    pair = case.contacts[0].pair
    force = FORCES[program](render(program, case, COMMAND), pair)
    assert force(1e-4, 1.0) == pytest.approx(pair.rho * 1e-6, rel=1e-11)


# --- a constant eps, which the comments state -------------------------------------------------------------------------


def hertz(number, pair):
    """NormalModel<HERTZ> of LIGGGHTS."""
    beta = math.log(number) / math.sqrt(math.log(number) ** 2 + math.pi**2)

    def force(x, u):
        root = math.sqrt(pair.R_eff * x)
        damping = -2 * 0.91287092917527685 * beta * math.sqrt(2 * pair.E_eff * root * pair.m_eff)
        return 4 / 3 * pair.E_eff * root * x + damping * u

    return force


def hertzian_viscoelastic(number, pair):
    """HertzianViscoelasticInteraction::computeNormalForce of MercuryDPM."""

    def force(x, u):
        stiffness = 4 / 3 * pair.E_eff * math.sqrt(pair.R_eff * x)
        return stiffness * x + number * math.sqrt(pair.m_eff * stiffness) * u

    return force


def mindlin(number, pair):
    """Law2_ScGeom_MindlinPhys_Mindlin of YADE with betan."""
    kno = 4 / 3 * pair.E_eff * math.sqrt(pair.R_eff)
    return lambda x, u: kno * x**1.5 + 2 * math.sqrt(pair.m_eff * 3 / 2 * kno * math.sqrt(x)) * number * u


CONSTANT = {
    "liggghts": ("coefficientRestitution", hertz),
    "mercurydpm": ("setDissipation", hertzian_viscoelastic),
    "yade": ("betan", mindlin),
}


def end_of(program, text):
    clipped = program == "yade" or "limitForce on, has one eps" in flowing(text)
    return "force" if clipped else "position"


@pytest.mark.parametrize("program", CONSTANT)
@pytest.mark.parametrize("epsilon", [0.97, 0.6, 0.25, 0.15])
def test_the_constant_eps(program, epsilon):
    case = setup(epsilon)
    (contact,), text = case.contacts, render(program, case, COMMAND)
    name, force = CONSTANT[program]
    number, *errors = map(float, re.search(rf"; {name} (\S+) \((\S+) to (\S+) %\)", flowing(text)).groups())
    stated_epsilon = float(re.search(r"exact eps at them \S+ (\S+) ", flowing(text))[1])
    assert stated_epsilon == pytest.approx(epsilon, rel=1e-6)
    if program == "liggghts":  # no eps below 0.2137 with limitForce on
        assert end_of(program, text) == ("force" if epsilon > 0.2137 else "position")
    for speed in (0.1, 1.0):
        found = integrated(force(number, contact.pair), case, speed, end_of(program, text))
        assert found == pytest.approx(epsilon, rel=1e-7)
    ends = [100 * (epsilon / contact.pair.epsilon(speed) - 1) for speed in (contact.slowest, contact.fastest)]
    assert errors == pytest.approx(ends, rel=6e-3)
    best, largest = map(float, re.search(rf"best {name} (\S+) \((\S+) %\)", flowing(text)).groups())
    balanced = integrated(force(best, contact.pair), case, 1.0, end_of(program, text))
    ends = [balanced / contact.pair.epsilon(speed) - 1 for speed in (contact.slowest, contact.fastest)]
    assert sum(ends) == pytest.approx(0, abs=1e-4)
    assert 100 * ends[1] == pytest.approx(largest, rel=6e-3)


FALL = pair_setup(
    calibrated(
        Pair(
            Sphere(radius=0.01, density=2500, young_modulus=5e6, poisson_ratio=0.22, dissipative_constant=0),
            Sphere.wall(young_modulus=5e6, poisson_ratio=0.22, dissipative_constant=0),
        ),
        0.1,
        0.5,
        9.81,
    ),
    0.1,
    (0.05, 1.0),
    gravity=9.81,
)
"""A ball that falls on a wall: eps is 0.5 at 0.1 m/s with its weight, 0.63 without; g t_c/v is 0.49."""


@pytest.mark.parametrize("program", CONSTANT)
def test_the_constant_eps_is_with_the_weight(program):
    """YADE takes R/2 for R_eff at a wall."""
    (contact,), text = FALL.contacts, render(program, FALL, COMMAND)
    name, force = CONSTANT[program]
    pair = SimpleNamespace(
        E_eff=contact.pair.E_eff, m_eff=contact.pair.m_eff, R_eff=0.005 if program == "yade" else 0.01
    )
    stated = re.search(rf"; {name} (\S+); {name}: eps with weight (\S+) (\S+) (\S+?);? ", flowing(text)).groups()
    number, *epsilons = map(float, stated)
    end = end_of(program, text)
    found = {v: fallen(force(number, pair), pair.m_eff, 9.81, v, 0.005 * v**-0.2, end)[0] for v in (0.1, 1.0)}
    assert found[0.1] == pytest.approx(0.5, abs=1e-6)
    assert epsilons[1:] == pytest.approx([0.5, found[1.0]], abs=1e-4)


def test_yade_has_the_viscoelastic_eps_with_the_weight():
    (contact,), text = FALL.contacts, render("yade", FALL, COMMAND)
    pair = SimpleNamespace(E_eff=contact.pair.E_eff, m_eff=contact.pair.m_eff, R_eff=0.005)
    assert fallen(yade(text, pair, (0, 1)), pair.m_eff, 9.81, 0.1, 0.007)[0] == pytest.approx(0.5, abs=1e-6)
    facet = SimpleNamespace(E_eff=contact.pair.E_eff, m_eff=contact.pair.m_eff, R_eff=0.02 / 3)
    stated_epsilon = float(re.search(r"at a Facet \(2/3 R\): eps of betan, of en \S+ (\S+)", flowing(text))[1])
    assert fallen(yade(text, facet, (0, 1)), pair.m_eff, 9.81, 0.1, 0.007)[0] == pytest.approx(stated_epsilon, abs=1e-4)


@pytest.mark.parametrize("law", ["viscoelastic", "betan"])
def test_all_numbers_of_yade_s_file_are_those_of_its_own_contact_at_a_wall(law):
    """Half of the radius: eps without weight, the speed below which the body stays down, durations, the step."""
    (contact,), text = FALL.contacts, flowing(render("yade", FALL, COMMAND))
    pair = SimpleNamespace(E_eff=contact.pair.E_eff, m_eff=contact.pair.m_eff, R_eff=0.005)
    if law == "betan":
        force = mindlin(float(re.search(r"; betan (\S+);", text)[1]), pair)
        said = re.search(r"betan: eps without weight (\S+); betan: stays down below (\S+) m/s", text)
    else:
        force = yade(render("yade", FALL, COMMAND), pair, (0, 1))
        said = re.search(r"exact eps at them \S+ (\S+) ", text), re.search(r"below (\S+) m/s it", text)
        said = (None, said[0][1], said[1][1])
        a, step, lasts = (float(re.search(rf"{name} (\S+) s", text)[1]) for name in ("; A", "Time step:", "; lasts"))
        duration = fallen(force, pair.m_eff, 0.0, 1.0, 0.005)[2]
        assert [lasts, 100 * step] == pytest.approx([duration] * 2, rel=1e-5)
        # F = k x^(3/2) + 3/2 A k sqrt(x) u
        damping = force(1e-4, 1.0) - force(1e-4, 0.0)
        assert a == pytest.approx(damping / (1.5e4 * force(1e-4, 0.0)), rel=1e-5)
    light, stays = (float(number) for number in (said[1], said[2]))
    assert light == pytest.approx(fallen(force, pair.m_eff, 0.0, 0.1, 0.007)[0], abs=1e-6)
    assert fallen(force, pair.m_eff, 9.81, 1.01 * stays, 0.008)[0] > 0
    with pytest.raises(ValueError, match="math domain error"):  # the energy does not suffice to reach x = 0
        fallen(force, pair.m_eff, 9.81, 0.99 * stays, 0.008)


def test_what_liggghts_cannot_have():
    assert "cannot have this eps: epsilon is" in render("liggghts", setup(0.04), COMMAND)


# --- errors -----------------------------------------------------------------------------------------------------------


@pytest.mark.parametrize("program", ["lammps", "liggghts", "yade", "rebound-c"])
def test_stated_errors_of_other_sizes_are_those_of_the_force(program):
    contact = SETUP.contacts[0]
    text = render(program, SETUP, COMMAND)
    warning = r"Warning: at the ends of the sizes eps is off by (\S+) to (\S+) % \(glass-glass\); "
    stated = [*map(float, re.search(warning, flowing(text)).groups())]
    errors = []
    for pair, speed in itertools.product(contact.extremes, (contact.slowest, contact.fastest)):
        case = Setup("t", {"a": pair.first}, (NamedContact("a", "a", pair, 0.01, 0.1, 1.0),))
        if program == "rebound-c":
            own = pair.damped(float(pair.dissipative_constant(contact.pair.beta))).epsilon(speed)
        else:
            own = integrated(FORCES[program](text, pair), case, speed, "force")
        errors.append(100 * (own / pair.epsilon(speed) - 1))
    assert stated == pytest.approx([min(errors), max(errors)], rel=6e-3)
    assert flowing(text).count("Warning: at the ends of the sizes") == 1


@programs
def test_the_time_step(program):
    text = flowing(render(program, SETUP, COMMAND))
    step = float(Pair(SMALL, SMALL).contact_time(1.0)) / input_file.STEPS
    error = max(input_file.timestep_error(contact, step) for contact in SETUP.contacts)
    assert f"Time step: {step:.6g} s is 100 steps in the shortest contact" in text
    assert f"eps is off by up to {error:.1e} " in text


def test_a_long_contact_does_not_take_long():
    """Of 10^9 steps to the contact only 2000 are done, for a bound."""
    contact = SETUP.contacts[1]
    duration = Pair(RUBBER, contact.pair.second).contact_time(2.0)
    error = input_file.timestep_error(contact, duration / 1e9)
    assert input_file.timestep_error(contact, duration / 1e5) == error < 1e-3
