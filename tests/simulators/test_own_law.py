"""Programs with contacts of their own law: what `viscopade simulators` writes for them, run in them where they are."""

import math
import re
from dataclasses import replace
from functools import cache
from pathlib import Path
from xml.etree import ElementTree

import click
import numpy as np
import pytest
from click.testing import CliRunner
from mpmath import mp
from scipy.optimize import brentq

import viscopade as vp
from tests.closed_forms import nu_1, nu_2
from tests.simulators.two_balls import fallen
from viscopade.cli.main import command
from viscopade.simulators import simulator_with
from viscopade.simulators.own_law import Goal, OwnLawContact, Softness

PROGRAMS = ("mujoco", "drake", "simbody", "chrono", "jaxdem")
ASKED = ("--epsilon", "0.5", "--speed", "1")
SOFT = ("--contact-time", "31 ms")
BALL = ("--radius", "1 cm", "--density", "2.5 g/cm^3", "--young-modulus", "70 GPa", "--poisson-ratio", "0.22")


@cache
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
    goal = Goal.from_epsilon(epsilon, 1.0, speeds, mass=2.0)
    return OwnLawContact(formula_of(name), goal, Softness(**softness), time_step)


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
    assert found.least == pytest.approx(min(expected), rel=1e-9)


@pytest.mark.parametrize("name", ["mujoco", "drake"])
def test_the_largest_error_over_the_speeds(name):
    """At 400 speeds by the closed form: for Hunt-Crossley contacts it is not at an end."""
    made = contact(name, 0.5, (0.01, 1.5), contact_time=0.02)
    power = 1 if made.formula.law.nu == 1 else 0
    speeds = np.geomspace(0.01, 1.5, 400)
    own = np.array([float(own_epsilon(name, made.kappa * v**power)) for v in speeds.tolist()])
    errors = own / vp.restitution(speeds, made.goal.beta) - 1
    (found,) = made.errors()
    assert found.greatest == pytest.approx(errors.max(), rel=1e-2)
    assert found.least == pytest.approx(errors.min(), rel=1e-2)
    assert (found.largest > 1.001 * max(abs(errors[0]), abs(errors[-1]))) == (name == "drake")


@pytest.mark.parametrize("name", ["mujoco", "drake"])
@pytest.mark.parametrize("sizes", [(), (0.5, 1.5)])
def test_no_other_damping_has_a_smaller_largest_error(name, sizes):
    """Over the speeds, and over sizes with the least and the largest beta."""
    made = contact(name, 0.7, (0.1, 3.0), contact_time=0.02)
    made = replace(made, goal=replace(made.goal, extremes=tuple(size * made.goal.beta for size in sizes)))
    parameter, error = made.best_parameter()
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
        contact(name, stiffness_over_mass=made.stiffness_over_mass),
        contact(name, stiffness=made.stiffness),
    ]
    for other in same:
        assert other.contact_time == pytest.approx(0.02, rel=1e-9)
        assert other.stiffness == pytest.approx(made.stiffness, rel=1e-9)


def solref(*words):
    return [float(x) for x in re.search(r'<geom solref="-(\S+) -(\S+)"', text_of("mujoco", *ASKED, *words)).groups()]


def test_a_stiffness_is_over_the_mass_or_is_not():
    """MuJoCo has k/m and c/m: 10 N/m of 2 kg is 5 1/s^2; Drake has k.

    So soft that default steps need no advice.
    """
    by_mass = solref("--stiffness", "10 N/m", "--mass", 2)
    assert by_mass == solref("--stiffness", "5 1/s^2") == solref("--stiffness", 5)
    assert by_mass[0] == 5
    for words in (("10 N/m",), (10,), ("0.01 N/mm", "--mass", 2), ("5 1/s^2", "--mass", 2)):
        text = text_of("drake", *ASKED, "--stiffness", *words)
        assert number_of(text, '"point_stiffness"') == 10
        assert "stiffness 10 N/m, not per mass" in text
    text = text_of("mujoco", *ASKED, "--stiffness", "10 N/m", "--mass", "2 kg")
    assert "stiffness 5 1/s^2, which is per effective mass: k = 10 N/m of the effective mass 2 kg" in text


@pytest.mark.parametrize(
    ("words", "warning"),
    [
        # A contact of 61.5 us is 0.031 of 2 ms; with 10 steps or more in a contact the damping can adapt.
        ((*BALL, "--wall"), 'of 2 ms is 33 contacts long; the option contact-time "40 ms" makes a contact that it'),
        (("--contact-time", "19 ms"), 'of 2 ms is 0.11 contacts long; the option contact-time "40 ms" makes a'),
        (("--contact-time", "31 ms"), 'the option time-step "2 ms" adapts the damping'),
        (("--contact-time", "31 ms", "--time-step", "2 ms"), None),
        (("--contact-time", "10 s"), None),
    ],
)
def test_the_default_step_of_the_program_is_compared_with_the_contact(words, warning):
    text = " ".join(text_of("mujoco", *ASKED, *words).split())
    assert ("MuJoCo's default step" in text) == (warning is not None)
    assert warning is None or warning in text
    ElementTree.fromstring(text)  # a comment has no "--"
    assert r"-\-" not in text.partition("?>")[2]


def test_mujoco_with_its_default_step_gives_what_the_warning_says():
    text = text_of("mujoco", *ASKED, *SOFT)
    drops = np.array(list(mujoco_drops(text, 2e-3, phases=1024)))[:, 0]
    said = re.search(r"eps is (\S+) on average, (\S+) to (\S+) in single", " ".join(text.split())).groups()
    assert [drops.mean(), drops.min(), drops.max()] == pytest.approx([float(x) for x in said], abs=1e-4)


def test_what_no_damping_makes_up_for():
    """An implicit step damps by itself: in Drake eps is 0.73 without dissipation."""
    text = " ".join(text_of("drake", "--epsilon", 1, "--speed", 1, *SOFT, "--time-step", "2 ms").split())
    assert "with the time step 0.002 s, for which no damping makes up: eps = 0.734" in text


@pytest.mark.parametrize(
    ("epsilon", "duration", "gravity"),
    [(0.5, "31 ms", 0), (0.9, "40 ms", 9.81), (0.9, "50 ms", 9.81), (0.5, "10 ms", 9.81), (0.5, "82 ms", 9.81)],
)
def test_a_longer_contact_narrows_the_range_of_single_collisions(epsilon, duration, gravity):
    """In MuJoCo, with 2 ms steps: 0.045 for eps = 0.5 and 31 ms."""
    words = ("mujoco", "--epsilon", epsilon, "--speed", 1, "--time-step", "2 ms")
    words += ("--gravity", gravity) if gravity else ()
    longer = re.search(
        r'with the option contact-time "(\S+ ms)" single collisions differ by 0.02',
        " ".join(text_of(*words, "--contact-time", duration).split()),
    )[1]
    drops = [
        np.array(list(mujoco_drops(text_of(*words, "--contact-time", each), 2e-3, phases=1024 // 4, gravity=gravity)))[
            :, 0
        ]
        for each in (duration, longer)
    ]
    assert [each.mean() for each in drops] == pytest.approx([epsilon] * 2, abs=1e-3)
    assert np.ptp(drops[0]) > 0.02 > np.ptp(drops[1])


def options_of(message):
    """The options that a message ends with, as words of a command."""
    ways = re.search(r"expected (--.*)$", message)[1].split(" or ")
    return [re.findall(r'(--[-a-z]+) "([^"]+)"', way) for way in ways]


@pytest.mark.parametrize(
    ("program", "words"),
    [
        ("drake", ("--speed", 1, "--mass", 1)),
        ("drake", ("--speed", 1, "--mass", 1, "--contact-time", "45 ms")),
        ("drake", ("--speed", 1, "--mass", 1, "--contact-time", "1 s")),
        ("drake", ("--speed", 2, "--mass", 1, "--contact-time", "45 ms")),
        ("mujoco", ("--speed", 0.01)),
    ],
)
def test_what_a_refusal_of_a_step_advises_works(program, words):
    """Eps is 0.9 of a body that falls, by an integration with the steps that the message names, or in MuJoCo."""
    asked = (program, "--epsilon", 0.9, *words, "--gravity", 9.81)
    with pytest.raises(click.UsageError, match=r"no damping gives eps = 0\.9 with so few steps") as caught:
        text_of(*asked, "--time-step", "2 ms")
    speed = words[1]
    assert ("only shorter steps help" in caught.value.message) == (speed < 9.81 * 2e-3)
    # At 1 m/s no contact in Drake's steps of 2 ms has eps = 0.9, at 2 m/s there is one.
    ways = options_of(caught.value.message)
    assert ("--contact-time" in dict(ways[0]) and "--time-step" not in dict(ways[0])) == (speed == 2)
    for way in ways:
        given = {**dict(zip(asked[1::2], asked[2::2], strict=True)), "--time-step": "2 ms", **dict(way)}
        text = text_of(program, *(word for option in given.items() for word in option))
        number, unit = given["--time-step"].split()
        step = float(number) * {"ms": 1e-3, "us": 1e-6}[unit]
        if program == "drake":
            eps = np.array(list(implicit_falls(force_of("drake", text), 1.0, 9.81, speed, step, 32)))[:, 0]
        else:
            eps = np.array(list(mujoco_drops(text, step, speed, 256, 9.81)))[:, 0]
        assert eps.mean() == pytest.approx(0.9, abs=2e-3 if program == "drake" else 0.02)


@pytest.mark.parametrize(
    ("epsilon", "words"),
    [(0.9, (*BALL, "--wall", "--gravity", 9.81)), (0.5, (*SOFT, "--mass", 1, "--gravity", 9.81))],
)
def test_the_advice_on_a_default_step_works(epsilon, words):
    """Drake's step is 1 ms; what its file names is then accepted with that step, and has eps on average."""
    asked = ("drake", "--epsilon", epsilon, "--speed", 1, *words)
    text = " ".join(text_of(*asked).replace("\n#", " ").split())
    way = dict(re.findall(r'(--contact-time|--time-step) "([^"]+)"', text.split("Warning: ")[-1]))
    given = [word for word in words if word not in SOFT] if "--contact-time" in way else words
    text = text_of(
        "drake", *asked[1:5], *given, *(word for pair in {"--time-step": "1 ms", **way}.items() for word in pair)
    )
    mass = 1.0 if "--mass" in words else 2500 * 4 / 3 * math.pi * 0.01**3
    step = 1e-3 * (1 if way.get("--time-step", "1 ms").endswith(" ms") else 1e-3)
    step *= float(way.get("--time-step", "1 ms").split()[0])
    eps = np.array(list(implicit_falls(force_of("drake", text), mass, 9.81, 1.0, step, 32)))[:, 0]
    assert eps.mean() == pytest.approx(epsilon, abs=2e-3)


# --- with weight ------------------------------------------------------------------------------------------------------


def number_of(text, name):
    """The number after a name of the code, such as "dissipation": 1.04."""
    return float(re.search(rf"{name}\W+(?:2 \* )?([-+.e\d]+)", text)[1])


def force_of(name, text):
    """The force that a program makes of its file, by its source."""
    if name == "drake":
        k, d = number_of(text, '"point_stiffness"'), number_of(text, '"dissipation"')
        return lambda x, u: k * x * (1 + d * u)
    if name == "simbody":
        k, c = number_of(text, r'STIFFNESS = {\n    "contact"'), number_of(text, r'DISSIPATION = {\n    "contact"')
        return lambda x, u: k * x**1.5 * (1 + 1.5 * c * u)
    e, k = re.search(
        r"made\((\S+), (\S+)\);" if name == "chrono" else r'"contact": ([\d.]+),[^"]+"contact": ([\d.]+),', text
    ).groups()
    k, loss = float(k), -math.log(float(e))
    zeta = loss / math.hypot(math.pi, loss)
    if name == "chrono":  # Hertz' spring and Tsuji's damping
        return lambda x, u: k * x**1.5 + math.sqrt(5) * zeta * math.sqrt(2 * k) * x**0.25 * u
    return lambda x, u: k * x + 2 * zeta * math.sqrt(2 * k) * u


def test_eps_over_the_speeds_is_with_the_weight():
    text = text_of("drake", *ASKED, *SOFT, "--mass", 2, "--gravity", 9.81, "--speeds", "0.3:2")
    force = force_of("drake", text)
    slow, fast = (fallen(force, 2.0, 9.81, speed, 0.031)[0] for speed in (0.3, 2.0))
    assert f"with weight eps at 0.3 and 2 m/s: {slow:.4f} and {fast:.4f}" in " ".join(text.replace("\n#", " ").split())


@pytest.mark.parametrize(
    ("name", "asked"),
    [
        ("drake", ("--penetration", "7 mm")),
        ("simbody", ("--contact-time", "31 ms")),
        ("chrono", ("--penetration", "7 mm")),
        ("jaxdem", ("--contact-time", "31 ms")),
    ],
)
def test_eps_duration_and_depth_are_with_the_weight(name, asked):
    """2 kg fall on a plane at 1 m/s: by an integration of the force that the program makes of its file."""
    text = text_of(name, *ASKED, *asked, "--mass", 2, "--gravity", 9.81)
    epsilon, depth, duration = fallen(force_of(name, text), 2.0, 9.81, 1.0, 0.031)
    assert epsilon == pytest.approx(0.5, abs=1e-6)
    assert stated(text, "contact lasts") == pytest.approx(duration, rel=1e-5)
    assert stated(text, "the penetration reaches") == pytest.approx(depth, rel=2e-4)
    assert (duration if asked[0] == "--contact-time" else depth) == pytest.approx(
        {"31 ms": 0.031, "7 mm": 0.007}[asked[1]], rel=1e-6
    )


def implicit_falls(force, mass, gravity, speed, h, phases=64):
    """Eps and largest depth of a body in steps of implicit Euler's method; steps that begin apart have no force."""
    for i in range(phases):
        before = (i + 0.5) / phases * h
        x, u = gravity / 2 * before**2 - speed * before, speed - gravity * before - gravity * h / 2
        deepest = 0.0
        while u > 0 or x > 0:

            def missed(w, x=x, u=u):
                at = x + h * w
                return w - u - h * (gravity - (max(force(at, w), 0.0) / mass if x > 0 and at > 0 else 0.0))

            u = brentq(missed, -10 * speed, 10 * speed, xtol=1e-14)
            x += h * u
            deepest = max(deepest, x)
        yield math.sqrt((u + gravity * h / 2) ** 2 - 2 * gravity * x) / speed, deepest


def test_drake_s_implicit_steps_and_the_weight_are_made_up_for_together():
    text = text_of("drake", *ASKED, *SOFT, "--mass", 2, "--gravity", 9.81, "--time-step", "1 ms")
    epsilon, depth = np.array(list(implicit_falls(force_of("drake", text), 2.0, 9.81, 1.0, 1e-3))).T
    assert epsilon.mean() == pytest.approx(0.5, abs=1e-4)
    assert depth.mean() == pytest.approx(stated(text, "the penetration reaches"), rel=1e-3)
    assert stated(text, "contact lasts") == pytest.approx(0.031, rel=1e-3)


# --- in the programs --------------------------------------------------------------------------------------------------

MODEL = """
<mujoco>
  <include file="contact.xml"/>
  <option timestep="{step!r}" gravity="0 0 -{gravity}"/>
  <worldbody>
    <geom class="contact" type="plane" size="1 1 .1" condim="1"/>
    <body><freejoint/><geom class="contact" type="sphere" size="0.1" mass="3" condim="1"/></body>
  </worldbody>
</mujoco>
"""


def mujoco_drops(text, step, speed=1.0, phases=8, gravity=0.0):
    """Eps, penetrations and durations of a sphere that hits a plane; both have the class of the text."""
    mujoco = pytest.importorskip("mujoco", reason="there is no Python package mujoco")
    model = mujoco.MjModel.from_xml_string(MODEL.format(step=step, gravity=gravity), {"contact.xml": text.encode()})
    for i in range(phases):
        data, before = mujoco.MjData(model), (i + 0.5) / phases * step
        # mj_step kicks, then drifts: half a step earlier than the sphere's path the speed is that of the path.
        data.qpos[2] = 0.1 + before * speed - gravity / 2 * before**2
        data.qvel[2] = gravity * before - speed + gravity * step / 2
        deepest, last = 0.0, 0.0
        while data.qvel[2] <= 0 or data.qpos[2] <= 0.1:
            mujoco.mj_step(model, data)
            deepest = max(deepest, 0.1 - data.qpos[2])
            pushes = data.nefc > 0 and data.efc_force[0] > 0  # at the start of the step
            last = data.time - before if pushes else last
            assert data.time < 1
        squared = (data.qvel[2] - gravity * step / 2) ** 2 + 2 * gravity * (data.qpos[2] - 0.1)
        yield math.sqrt(squared) / speed, deepest, last


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


def test_the_page_has_the_numbers_of_the_file():
    page = (Path(__file__).parents[2] / "docs" / "usage" / "simulators" / "mujoco.md").read_text("utf-8")
    for words in ((), ("--gravity", 9.81)):
        assert "`solref=" + re.search(r'solref=("\S+ \S+")', text_of("mujoco", *ASKED, *SOFT, *words))[1] in page


@pytest.mark.parametrize("asked", [("--contact-time", "31 ms"), ("--penetration", "7 mm")])
def test_mujoco_has_eps_duration_and_depth_with_the_weight(asked):
    text = text_of("mujoco", *ASKED, *asked, "--gravity", 9.81)
    epsilon, depth, duration = np.array(list(mujoco_drops(text, 1e-5, gravity=9.81))).T
    assert epsilon.mean() == pytest.approx(0.5, abs=2e-4)
    assert depth.max() == pytest.approx(stated(text, "the penetration reaches"), rel=1e-3)
    assert duration.mean() == pytest.approx(stated(text, "contact lasts"), rel=1e-3)
    assert {"31 ms": duration.mean() / 0.031, "7 mm": depth.max() / 0.007}[asked[1]] == pytest.approx(1, rel=1e-3)


@pytest.mark.parametrize("softness", [SOFT, ("--penetration", "7 mm"), ()])
def test_mujoco_makes_up_for_its_weight_and_its_time_step_together(softness):
    """Without a stiffness the contact lasts 20 time steps."""
    text = text_of("mujoco", *ASKED, *softness, "--gravity", 9.81, "--time-step", "2 ms")
    epsilon, depth, duration = np.array(list(mujoco_drops(text, 2e-3, phases=512, gravity=9.81))).T
    assert epsilon.mean() == pytest.approx(0.5, abs=1e-3)
    assert epsilon.max() - epsilon.min() == pytest.approx(
        stated(text, "average, " + str(stated(text, "average,")) + " to") - stated(text, "average,"), abs=1e-3
    )
    assert depth.mean() == pytest.approx(stated(text, "the penetration reaches"), rel=1e-3)
    assert duration.mean() == pytest.approx(stated(text, "contact lasts"), rel=1e-2)  # a step more in a few phases
    if not softness:
        assert stated(text, "contact lasts") == pytest.approx(0.04, rel=1e-3)
        assert "0.04 s (20 time steps, as nothing else says how long)" in " ".join(text.split())


def test_a_warning_of_weight_has_the_time_step():
    text = " ".join(text_of("mujoco", *ASKED, *SOFT, "--time-step", "2 ms").split())
    epsilon = np.array(list(mujoco_drops(text, 2e-3, phases=512, gravity=9.81)))[:, 0]
    said = re.search(
        r"Warning: a body that falls on a plane at 1 m/s rebounds with eps = (\S+) \(mean, sampled\), without", text
    )
    assert epsilon.mean() == pytest.approx(float(said[1]), abs=1e-3)


def test_mujoco_makes_up_for_its_time_step():
    text = text_of("mujoco", *ASKED, *SOFT, "--time-step", "2 ms")
    drops = np.array(list(mujoco_drops(text, 2e-3, phases=1024)))[:, 0]
    assert drops.mean() == pytest.approx(0.5, abs=1e-4)
    assert 0 <= drops.min() - stated(text, "on average,") < 5e-4  # the range is that of all phases


def test_mujoco_error_over_speeds():
    text = text_of("mujoco", *ASKED, *SOFT, "--speeds", "10:200 cm/s")
    slow = next(mujoco_drops(text, 1e-5, 0.1))[0]
    beta = vp.exact.invert("0.5", 20, speed="1").floats()["beta"]
    assert slow / vp.restitution(0.1, beta) - 1 == pytest.approx(
        stated(text, "error of eps over the speeds: ") / 100, abs=2e-3
    )


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
        (("mujoco", *ASKED), "MuJoCo needs a stiffness: expected --stiffness, --contact-time, --penetration"),
        (("mujoco", *ASKED, *SOFT, "--stiffness", 1), "--stiffness and --contact-time are given: expected one of them"),
        (
            ("drake", *ASKED, "--penetration", "1 mm", "--stiffness", 1),
            "--stiffness and --penetration are given: expected one",
        ),
        (("simbody", *ASKED, *SOFT, "--step-error", 0.1), "--step-error has no effect for simbody, which chooses its"),
        (("drake", *ASKED, "--step-error", 0.1), "--step-error has no effect, as nothing says how long contact lasts"),
        (
            ("drake", *ASKED, "--step-error", 0.1, "--stiffness", 1),
            "--step-error has no effect, as nothing says how long contact lasts",
        ),
        (("simbody", *ASKED, "--gravity", 9.81), "gravity needs the contact's duration: expected a contact time"),
        (
            ("mujoco", "--epsilon", 0.05, "--speed", 1, *SOFT, "--gravity", 9.81),
            "contact-time is 0.031: no contact with eps = 0.05, weight and time steps is like that",
        ),
        (("drake", *ASKED, "--gravity", 9.81), "gravity needs the contact's duration: expected a contact time, or a"),
        (("simbody", *ASKED, *SOFT, "--time-step", "1 ms"), "expected none, as the program chooses its own"),
        (("mujoco", "--epsilon", 0.5), "a material also needs --speed"),
        (("mujoco", "--epsilon", 0, "--speed", 1, *SOFT), "epsilon is 0: expected a number > 0 and <= 1"),
        (
            ("mujoco", *ASKED, *SOFT, "--time-step", "40 ms"),
            'time-step is 1.115 contact times: expected --contact-time "800 ms" or --time-step "1.5 ms"',
        ),
        (("mujoco", *ASKED, *SOFT, "--time-step", "20 ms"), "time-step is 0.5576 of the contact time"),
        (("mujoco", *ASKED, "--contact-time", "1e-200"), "contact-time is 1e-200: expected a number from 1e-30"),
        (("drake", *ASKED, *SOFT, "--speeds", "1e-9:1"), "expected 1e-12 to 1e+12, and at most 1e+06 times"),
        (("mujoco", *ASKED, *SOFT, "--step-error", 0.1, "--time-step", 1e-3), "--step-error has no effect with --time"),
        (("mujoco", *ASKED, *SOFT, "--step-error", 3), "step-error is 3: expected 1e-08 to 1"),
        (("mujoco", *ASKED, *SOFT, "--speeds", "2:3"), "--speeds is 2:3 m/s: expected 0 < MIN <= 1 <= MAX"),
        (("mujoco", *ASKED, "--penetration", "-1 mm"), "expected"),
        (("mujoco", *BALL, *ASKED, "--mass", 1), "--mass and bodies with masses are given"),
        (("jaxdem", "--epsilon", 0.1, "--speed", 1), "epsilon is 0.1: expected 0.1399 to 1, which e from 1e-6 to 1"),
        (("lethe", *ASKED), "there is no file for lethe; viscopade audit lethe prints the number to write"),
        (
            ("mujoco", *BALL, *ASKED, "--time-step", "2 ms"),
            'expected --contact-time "40 ms" or --time-step "2.6 us"',
        ),
        (
            ("mujoco", *ASKED, "--stiffness", 1e5, "--mass", 2),
            'per mass (1/s^2) and needs no mass; write "100000.0 N/m"',
        ),
        (("mujoco", *ASKED, "--stiffness", "1e5 N/m"), "MuJoCo has the stiffness in 1/s^2: expected --mass with it"),
        (("drake", *ASKED, "--stiffness", "1e5 1/s^2"), "Drake has the stiffness in N/m: expected --mass with it"),
        (("chrono", *ASKED, "--stiffness", "1e5 N/m"), 'expected k, such as "1e5 N/m^(3/2)", or k over the effective'),
        (("mujoco", *ASKED, *SOFT, "--mass", 2), '--mass has no effect: expected --stiffness, such as "1e5 N/m" with'),
        (("drake", *ASKED, "--mass", 2), "--mass has no effect: expected --contact-time, --penetration or"),
        (("lammps", *ASKED), "lammps needs a material: expected a scene, or --radius"),
        (("yade", *BALL, *ASKED, *SOFT), "--contact-time is given for yade: expected mujoco, drake"),
    ],
)
def test_bad_input(words, message):
    with pytest.raises(Exception, match=r".") as caught:
        text_of(*words)
    assert isinstance(caught.value, ValueError) or hasattr(caught.value, "format_message")
    assert message in (getattr(caught.value, "message", None) or str(caught.value))
