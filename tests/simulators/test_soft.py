"""Programs with contacts of their own law: what `viscopade simulators` writes for them, run in them where they are."""

import math
from dataclasses import replace

import numpy as np
import pytest
from click.testing import CliRunner
from mpmath import mp

import viscopade as vp
from tests.closed_forms import nu_1, nu_2
from viscopade.cli.main import command
from viscopade.simulators import simulator_with
from viscopade.simulators.soft import SoftContact, Softness, Wanted

PROGRAMS = ("mujoco", "drake", "simbody", "chrono", "jaxdem")
ASKED = ("--epsilon", "0.5", "--speed", "1")
SOFT = ("--contact-time", "31 ms")


def text_of(*words):
    result = CliRunner().invoke(command, ["simulators", *map(str, words)], standalone_mode=False)
    if result.exception is not None:
        raise result.exception
    return result.output


def text_with_own_law(name):
    (text,) = simulator_with(name).texts.values()
    return text


def formula_of(name):
    return simulator_with(name).formula(text_with_own_law(name).formula)


def contact(name, epsilon=0.5, speeds=(1.0, 1.0), time_step=None, **softness):
    wanted = Wanted.at(epsilon, 1.0, speeds, mass=2.0)
    return SoftContact(formula_of(name), wanted, Softness(**softness), text_with_own_law(name).per_mass, time_step)


def own_epsilon(name, kappa):
    """Eps of the program's law by its closed form."""
    law = formula_of(name).law
    if law.nu == 1:
        return nu_1(mp.mpf(kappa))
    return nu_2(mp.mpf(kappa / (2 if law.elastic == 1 else math.sqrt(5))), "force")


@pytest.mark.parametrize("name", PROGRAMS)
@pytest.mark.parametrize("epsilon", [0.95, 0.5, 0.2])
def test_the_damping_is_exact_at_one_speed_and_errors_elsewhere_are_stated(name, epsilon):
    """Closed forms of both laws; the viscoelastic eps at another speed by the public array function."""
    made = contact(name, epsilon, (0.1, 3.0), contact_time=0.02)
    assert float(own_epsilon(name, made.kappa)) == pytest.approx(epsilon, rel=1e-12)
    beta = vp.exact.invert(str(epsilon), 20, speed="1").floats()["beta"]
    power = 1 if made.formula.law.nu == 1 else 0  # kappa is d v, or does not depend on the speed
    own = [float(own_epsilon(name, made.kappa * v**power)) for v in (0.1, 3.0)]
    expected = [mine / vp.restitution(v, beta) - 1 for mine, v in zip(own, (0.1, 3.0), strict=True)]
    (found,) = made.errors()
    assert [found.slowest, found.fastest] == pytest.approx(expected, rel=1e-9)


@pytest.mark.parametrize("name", ["mujoco", "drake"])
def test_the_largest_error_over_the_speeds(name):
    """At 400 speeds by the closed form: for Hunt-Crossley contacts it is not at an end."""
    made = contact(name, 0.5, (0.01, 1.5), contact_time=0.02)
    power = 1 if made.formula.law.nu == 1 else 0
    speeds = np.geomspace(0.01, 1.5, 400)
    own = np.array([float(own_epsilon(name, made.kappa * v**power)) for v in speeds.tolist()])
    errors = own / vp.restitution(speeds, made.wanted.beta) - 1
    (found,) = made.errors()
    assert found.greatest == pytest.approx(errors.max(), rel=1e-2)
    assert found.least == pytest.approx(errors.min(), rel=1e-2)
    assert (found.largest > max(abs(found.slowest), abs(found.fastest))) == (name == "drake")


@pytest.mark.parametrize("name", ["mujoco", "drake"])
@pytest.mark.parametrize("sizes", [(), (0.5, 1.5)])
def test_no_other_damping_has_a_smaller_largest_error(name, sizes):
    """Over the speeds, and over sizes with the least and the largest beta."""
    made = contact(name, 0.7, (0.1, 3.0), contact_time=0.02)
    made = replace(made, wanted=replace(made.wanted, extremes=tuple(size * made.wanted.beta for size in sizes)))
    parameter, error = made.balanced()
    kappa = float(made.formula.kappa(mp.mpf(parameter)))
    found = made.errors(kappa)
    greatest, least = max(each.greatest for each in found), min(each.least for each in found)
    assert greatest == pytest.approx(-least, rel=1e-4)
    assert max(greatest, -least) == pytest.approx(error, rel=1e-4)
    for factor in (0.99, 1.01):
        assert max(other.largest for other in made.errors(kappa * factor)) > error


def moved(name, made):
    """Contact time and largest penetration by the equation of motion, m x'' = -force, in steps of time."""
    law, k = made.formula.law, made.stiffness_over_mass
    a, b = float(law.elastic), float(law.damping)
    c = made.kappa * k ** float((law.damping + 1) / (law.elastic + 1))  # kappa at the speed 1

    def slope(x, u):
        return u, -(k * max(x, 0) ** a + c * max(x, 0) ** b * u) if x > 0 else 0.0

    x, u, h, deepest, t = 0.0, 1.0, 1e-6, 0.0, 0.0
    while True:
        k1 = slope(x, u)
        if u < 0 and k1[1] >= 0:  # the force pushes no more
            return t, deepest
        k2 = slope(x + h / 2 * k1[0], u + h / 2 * k1[1])
        x, u, t = x + h * k2[0], u + h * k2[1], t + h
        deepest = max(deepest, x)


@pytest.mark.parametrize("name", ["mujoco", "simbody", "chrono"])
def test_contact_lasts_and_reaches_as_stated(name):
    made = contact(name, contact_time=0.02)
    assert made.contact_time == pytest.approx(0.02, rel=1e-9)
    time, depth = moved(name, made)
    assert time == pytest.approx(0.02, abs=3e-6)
    assert made.penetration == pytest.approx(depth, rel=1e-4)
    same = [
        contact(name, penetration=made.penetration),
        contact(name, stiffness=made.stiffness_over_mass if name == "mujoco" else made.stiffness),
    ]
    for other in same:
        assert other.contact_time == pytest.approx(0.02, rel=1e-9)
        assert other.stiffness == pytest.approx(made.stiffness, rel=1e-9)


# --- in the programs --------------------------------------------------------------------------------------------------

MODEL = """
<mujoco>
  <include file="contact.xml"/>
  <option timestep="{step!r}" gravity="0 0 0"/>
  <worldbody>
    <geom class="contact" type="plane" size="1 1 .1" condim="1"/>
    <body><freejoint/><geom class="contact" type="sphere" size="0.1" mass="3" condim="1"/></body>
  </worldbody>
</mujoco>
"""


def mujoco_drops(text, step, speed=1.0, phases=8):
    """Eps and penetrations of a sphere that hits a plane; both have the class of the text."""
    mujoco = pytest.importorskip("mujoco", reason="there is no Python package mujoco")
    model = mujoco.MjModel.from_xml_string(MODEL.format(step=step), {"contact.xml": text.encode()})
    for i in range(phases):
        data = mujoco.MjData(model)
        data.qpos[2], data.qvel[2] = 0.1 + (i + 0.5) / phases * step * speed, -speed
        deepest = 0.0
        while data.qvel[2] <= 0 or data.qpos[2] <= 0.1:
            mujoco.mj_step(model, data)
            deepest = max(deepest, 0.1 - data.qpos[2])
            assert data.time < 1
        yield data.qvel[2] / speed, deepest


def stated(text, pattern):
    """The number after words of the text."""
    return float(" ".join(text.split()).split(pattern, 1)[1].split()[0].rstrip(",:"))


def test_mujoco_delivers_what_was_asked_for():
    text = text_of("mujoco", *ASKED, *SOFT)
    found = np.array(list(mujoco_drops(text, 2e-5)))
    assert found[:, 0].mean() == pytest.approx(0.5, abs=2e-4)
    assert found[:, 1].max() == pytest.approx(stated(text, "the penetration reaches"), rel=1e-3)
    longest = stated(text, "Time steps up to")
    worst = [np.abs(np.array(list(mujoco_drops(text, f * longest)))[:, 0] / 0.5 - 1).max() for f in (1, 2)]
    assert worst[0] < 0.01 < worst[1]


def test_mujoco_makes_up_for_its_time_step():
    text = text_of("mujoco", *ASKED, *SOFT, "--time-step", "2 ms")
    drops = np.array(list(mujoco_drops(text, 2e-3, phases=64)))[:, 0]
    assert drops.mean() == pytest.approx(0.5, abs=1e-4)
    assert drops.min() == pytest.approx(stated(text, "on average,"), abs=1e-5)


def test_mujoco_error_over_speeds():
    text = text_of("mujoco", *ASKED, *SOFT, "--speeds", "10:200 cm/s")
    slow = next(mujoco_drops(text, 1e-5, 0.1))[0]
    beta = vp.exact.invert("0.5", 20, speed="1").floats()["beta"]
    assert slow / vp.restitution(0.1, beta) - 1 == pytest.approx(stated(text, "error of eps: "), abs=2e-3)


# --- scenes, materials, bad input -------------------------------------------------------------------------------------

SCENE = """
tolerance = { epsilon = 1e-3 }
speed = { min = "1 cm/s", max = "1 m/s" }
[material.glass]
young_modulus = "70 GPa"
poisson_ratio = 0.22
density = "2500 kg/m^3"
dissipative_constant = "1 us"
[body.bead]
material = "glass"
radius = "1 mm"
"""
BALL = ("--radius", "1 cm", "--density", "2.5 g/cm^3", "--young-modulus", "70 GPa", "--poisson-ratio", "0.22")


@pytest.mark.parametrize("name", ["mujoco", "chrono"])
def test_a_material_gives_its_own_contact_time_and_its_warnings(name):
    text = text_of(name, *BALL, *ASKED, "--speeds", "0.5:2 m/s", "--yield-strength", "50 MPa")
    ball = vp.Sphere(radius=0.01, density=2500, young_modulus=70e9, poisson_ratio=0.22, dissipative_constant=0)
    pair = vp.Pair(ball, ball).calibrated(1.0, 0.5)
    assert stated(text, "contact lasts") == pytest.approx(pair.contact_time(1.0), rel=1e-5)
    assert "Warning: 2 m/s is beyond the" in text


def test_a_scene_in_other_units(tmp_path):
    """What the options say in SI units is the same contact in the scene's units, here cm, g and ms."""
    (tmp_path / "si.toml").write_text(SCENE)
    (tmp_path / "cm.toml").write_text(SCENE + '[units]\nlength = "cm"\nmass = "g"\ntime = "ms"\n')
    options = ("--contact-time", "20 ms", "--time-step", "1 ms")
    si, cm = (text_of("mujoco", tmp_path / name, *options).split('solref="')[1] for name in ("si.toml", "cm.toml"))
    (k, b), (k_cm, b_cm) = ([float(number) for number in text.split('"')[0].split()] for text in (si, cm))
    assert (k_cm, b_cm) == pytest.approx((k / 1e6, b / 1e3), rel=1e-9)
    with pytest.raises(Exception, match=r".") as caught:
        text_of("mujoco", tmp_path / "cm.toml", "--stiffness", 1)
    assert "--stiffness is in SI units and the scene is not" in caught.value.message


@pytest.mark.parametrize(
    ("words", "message"),
    [
        (("mujoco", *ASKED), "MuJoCo needs a stiffness: expected --stiffness, --contact-time or --penetration"),
        (("mujoco", *ASKED, *SOFT, "--stiffness", 1), "stiffness and contact_time are given: expected one of them"),
        (("drake", *ASKED, "--time-step", "1 ms"), "a time step needs the contact's duration"),
        (("simbody", *ASKED, *SOFT, "--time-step", "1 ms"), "expected none, as the program chooses its own"),
        (("mujoco", "--epsilon", 0.5), "a material also needs --speed"),
        (("mujoco", "--epsilon", 0, "--speed", 1, *SOFT), "epsilon is 0: expected a number > 0 and <= 1"),
        (("mujoco", *ASKED, *SOFT, "--time-step", "40 ms"), "time-step is 1.115 contact times: expected 0.001 to 1"),
        (("mujoco", *ASKED, *SOFT, "--time-step", "20 ms"), "time-step is 0.5576 of the contact time"),
        (("mujoco", *ASKED, "--contact-time", "1e-200"), "contact-time is 1e-200: expected a number from 1e-30"),
        (("drake", *ASKED, *SOFT, "--speeds", "1e-9:1"), "expected 1e-12 to 1e+12, and at most 1e+06 times"),
        (("mujoco", *ASKED, *SOFT, "--step-error", 3), "step-error is 3: expected 1e-08 to 1"),
        (("mujoco", *ASKED, *SOFT, "--speeds", "2:3"), "--speeds is 2:3 m/s: expected 0 < MIN <= 1 <= MAX"),
        (("mujoco", *ASKED, "--penetration", "-1 mm"), "expected"),
        (("mujoco", *BALL, *ASKED, "--mass", 1), "--mass and bodies with masses are given"),
        (("jaxdem", "--epsilon", 0.1, "--speed", 1), "epsilon is 0.1: expected 0.1399 to 1, which e from 1e-6 to 1"),
        (("lammps", *ASKED), "lammps needs a material: expected a scene, or --radius"),
        (("yade", *BALL, *ASKED, *SOFT), "--contact-time is given for yade: expected mujoco, drake"),
    ],
)
def test_bad_input(words, message):
    with pytest.raises(Exception, match=r".") as caught:
        text_of(*words)
    assert isinstance(caught.value, ValueError) or hasattr(caught.value, "format_message")
    assert message in (getattr(caught.value, "message", None) or str(caught.value))
