"""Adhesion on the command line: eps of a material, curves, and refusals."""

import math
from pathlib import Path

import numpy as np
import pytest
from scipy.integrate import solve_ivp

from tests.cli import json_of, printed, refused, said

YOUNG, NU, DENSITY, RADIUS, A, WORK = 5e7, 0.3, 2500.0, 1e-4, 1e-6, 0.07
MATERIAL = (
    *("--radius", RADIUS, "--density", DENSITY, "--young-modulus", YOUNG, "--poisson-ratio", NU),
    *("--dissipative-constant", A, "--wall"),
)
E, MASS = YOUNG / (2 * (1 - NU**2)), 4 / 3 * math.pi * RADIUS**3 * DENSITY


def adhesive_epsilon(speed, gravity=0.0):
    """Return eps by SciPy, in z = (a/a_0)^(1/2) and a time tau, dt = (4 z^3 - 1) dtau, in which all is a polynomial.

    x = z^4 - z, F = z^6 - 3/2 z^3 + kappa z^2 v and z' = v; 0 if v turns before the neck breaks at z^3 = 1/4.
    """
    a_0 = (2 * math.pi * WORK * RADIUS**2 / E) ** (1 / 3)
    length, force = a_0**2 / RADIUS, 4 * E * a_0**3 / (3 * RADIUS)
    unit = math.sqrt(length * force / MASS)  # of speed
    kappa, load = 2 * A * E * a_0 * unit / force, MASS * gravity / force

    def rates(_, state):
        z, v = state
        return v, (load - (z**6 - 1.5 * z**3 + kappa * z**2 * v)) * (4 * z**3 - 1)

    def breaks(_, state):
        return 4 * state[0] ** 3 - 1

    def turns_back(_, state):
        return state[1]

    for event, direction in ((breaks, -1), (turns_back, 1)):
        event.terminal, event.direction = True, direction
    run = solve_ivp(
        rates, (0, 1e9), (1, speed / unit), method="DOP853", rtol=1e-12, atol=1e-14, events=(breaks, turns_back)
    )
    if run.t_events[1].size:
        return 0.0
    z, v = run.y[:, -1]
    return math.sqrt(v * v - 2 * load * (z**4 - z)) / (speed / unit)


@pytest.mark.parametrize(("work", "warns"), [("70 mJ/m^2", False), ("1 kJ/m^2", True)])
def test_adhesion_alone_may_make_the_overlap_too_large(work, warns):
    """For 1 kJ/m^2 a_0^2/R, the unit of compressions, is 1.7 radii; without adhesion the overlap is 0.003 radii."""
    for words in (("epsilon", "--speed", 0.1), ("table", "--from", 0.01, "--to", 0.1, "--points", 2)):
        sentences = json_of(*words, *MATERIAL, "--adhesion", work)["warnings"]
        assert any("the overlap reaches" in sentence for sentence in sentences) == warns


@pytest.mark.parametrize(("speed", "gravity"), [(0.08, None), (0.3, None), (3.0, None), (0.08, 500), (0.05, None)])
def test_epsilon_of_a_material(speed, gravity):
    falls = () if gravity is None else ("--gravity", gravity)
    words = ("epsilon", *MATERIAL, "--speed", speed, "--adhesion", "70 mJ/m^2", *falls)
    document = json_of(*words)
    theirs = adhesive_epsilon(speed, gravity or 0.0)
    assert float(document["epsilon"]) == pytest.approx(theirs, abs=1e-9)
    assert (document["parts"], document["status"]) == (theirs > 0, "sampled")
    assert document["errors"]["epsilon"] < 1e-8
    slowest = float(document["sticking_speed"])
    assert adhesive_epsilon(0.999 * slowest, gravity or 0.0) == 0 < adhesive_epsilon(1.001 * slowest, gravity or 0.0)
    energy = 7.09220 * (WORK**5 * RADIUS**4 / E**2) ** (1 / 3)
    assert float(document["neck_energy"]) == pytest.approx(energy, rel=1e-6)
    assert float(document["pull_off_force"]) == pytest.approx(1.5 * math.pi * WORK * RADIUS, rel=1e-11)
    text = said(*words)
    assert ("Sampled, with an error below 1e-12: eps with" if theirs else "bodies stay together, eps is 0") in text


def test_tables_and_pictures_fall_to_0_at_the_sticking_speed(tmp_path):
    curve = (*MATERIAL, "--adhesion", WORK, "--from", 0.05, "--to", 5)
    document = json_of("table", *curve, "--points", 5)
    theirs = [adhesive_epsilon(speed) for speed in document["speed"]]
    assert theirs[0] == 0 < theirs[1]
    assert document["curves"][0]["epsilon"] == pytest.approx(theirs, abs=1e-9)
    assert (document["adhesion"], document["gravity"], document["status"]) == (WORK, None, "sampled")
    slowest = document["sticking_speed"]
    text = said("table", *curve)
    assert f"With adhesion (sampled): below {slowest:.4g} m/s the bodies stay together, eps = 0." in text
    picture = tmp_path / "adhesion.svg"
    printed("plot", *curve, "-o", picture)
    assert 'id="curve-1"' in picture.read_text()


def test_a_scene_adheres():
    scene = Path(__file__).parents[2] / "examples" / "ice_rings.toml"
    sticky, alone = (json_of("table", scene, "--points", 2, *words)["curves"] for words in (("--adhesion", 0.05), ()))
    pairs = [(one["epsilon"], other["epsilon"]) for one, other in zip(sticky, alone, strict=True)]
    assert np.all(np.array(pairs)[:, 0] < np.array(pairs)[:, 1])


@pytest.mark.parametrize(
    ("words", "message"),
    [
        (("epsilon", "--v-star", 1, "--adhesion", 1), "--adhesion needs surfaces: expected a material with --speed"),
        (("epsilon", *MATERIAL, "--speed", 1, "--adhesion", 0), "--adhesion is '0': expected an energy per area > 0"),
        (("epsilon", *MATERIAL, "--speed", 1, "--adhesion", "1 J"), 'such as "2.5 mJ/m^2", or a number in J/m^2'),
        (("table", "--adhesion", 1), "--adhesion needs surfaces: expected a material with --dissipative-constant"),
        (("table", "--beta", 1, "--adhesion", 1), "--adhesion needs surfaces"),
        (("table", *MATERIAL, "--adhesion", 1, "--pade", "3/6"), "--pade and --adhesion are given: expected one of"),
        (("table", *MATERIAL, "--adhesion", 1, "--speed", 1, "--law", "linear"), "--law and --adhesion are given"),
        (("table", *MATERIAL, "--adhesion", 1, "--points", 101), "expected at most 100 with --adhesion"),
        (("table", *MATERIAL[:-1], "--adhesion", 1, "--gravity", 1), "--gravity needs a sphere and a plane"),
    ],
)
def test_refusals(words, message):
    assert message in refused(*words)
