"""Decks: rendered, run as they stand in LAMMPS and REBOUND, and cooled as the granular gas does."""

import math
import re

import numpy as np
import pytest
from click.testing import CliRunner

from viscopade.cli.main import command
from viscopade.scene import units
from viscopade.scene.read import from_toml
from viscopade.simulators import gas
from viscopade.simulators.deck import Box, Deck, deck_text
from viscopade_lab.programs import decks, lammps_collisions

SMALL = Deck(particles=216, volume_fraction=0.05, seed=3, collisions=1.0)
WALLED = """
tolerance = { epsilon = 1e-3 }
[material.rubber]
young_modulus = "1 MPa"
poisson_ratio = 0.45
density = "1000 kg/m^3"
dissipative_constant = "10 us"
[body.small]
material = "rubber"
radius = { min = "0.8 mm", max = "1.2 mm" }
[body.large]
material = "rubber"
radius = "2 mm"
[body.floor]
material = "rubber"
wall = true
[speed]
min = "1 cm/s"
max = "1 m/s"
[units]
length = "cm"
mass = "g"
"""


def needs(run):
    def skipping(*arguments):
        try:
            return run(*arguments)
        except RuntimeError as error:
            if "there is no" in str(error):
                pytest.skip(str(error))
            raise

    return skipping


def output_of(*words):
    result = CliRunner().invoke(command, ["simulators", *map(str, words)], standalone_mode=False)
    if result.exception is not None:
        raise result.exception
    return result.output


def test_the_box_is_what_it_says():
    """Volume fraction, number and temperature, from the numbers of the text alone."""
    text = decks.text("lammps", SMALL)
    edge = float(re.search(r"region box block 0 (\S+)", text)[1])
    diameter, mass = (float(re.search(rf"set type 1 {name} (\S+)", text)[1]) for name in ("diameter", "mass"))
    assert 216 * math.pi / 6 * diameter**3 / edge**3 == pytest.approx(0.05, rel=1e-10)
    speed = math.sqrt(1e-3 * 0.5)  # the typical one of the scene
    energy = float(re.search(r"sqrt\((\S+)/c_energy\)", text)[1])
    assert energy == pytest.approx(1.5 * 216 * mass * speed**2 / math.pi, rel=1e-10)
    time = gas.mean_collision_time(speed**2 / math.pi, 216 / edge**3 * (1 - 0.025) / 0.95**3, diameter)
    steps, step = int(re.findall(r"^run (\d+)", text, re.MULTILINE)[-1]), float(re.search(r"timestep (\S+)", text)[1])
    assert steps * step == pytest.approx(time, rel=1e-3)


@pytest.mark.parametrize("run", [needs(decks.of_lammps), needs(decks.of_rebound)], ids=["lammps", "rebound"])
def test_it_cools_as_the_gas_does(run):
    """216 spheres for one collision time: the loss of energy is that of the gas, to the noise of 216 collisions."""
    times, ratio = run(SMALL)
    assert ratio[0] == 1
    assert np.all(np.diff(times) > 0)
    (expected,) = decks.predicted([1.0], SMALL)
    (found,) = decks.at((times, ratio), [1.0], SMALL)
    assert 1 - found == pytest.approx(1 - expected, rel=0.35)


@pytest.mark.slow
def test_two_processes_and_seeds():
    """Means over three seeds; the same seed has the same velocities at the start, so the same first outputs."""
    some = [Deck(512, 0.05, seed, 3.0) for seed in (1, 2, 3)]
    one, two, other = ([needs(run)(deck) for deck in some] for run in (decks.of_lammps, _two, decks.of_rebound))
    (expected,) = decks.predicted([3.0], some[0])
    for runs in (one, two, other):
        found = np.mean([decks.at(curve, [3.0], some[0])[0] for curve in runs])
        assert 1 - found == pytest.approx(1 - expected, rel=0.08)
    for alone, together in zip(one, two, strict=True):
        assert alone[1][:3] == pytest.approx(together[1][:3], rel=1e-3)


def _two(deck):
    return decks.of_lammps(deck, 2)


def test_walls_and_several_kinds_keep_their_spheres(tmp_path):
    """Classes of sizes, another kind, a wall on both sides, CGS units: no atom is lost, and all pairs have lines."""
    scene = from_toml(WALLED, "walled.toml")
    sized = units.sized_setup(scene)
    assert list(sized.bodies) == ["small_least", "small", "small_largest", "large", "floor"]
    text = deck_text("lammps", units.setup(scene), sized, "test", Deck(64, 0.1, 1, 1.0))
    assert len(re.findall(r"^pair_coeff ", text, re.MULTILINE)) == 10
    assert 'variable wall1_floor index "zplane 0.0 ' in text
    box = Box(sized, Deck(64, 0.1, 1, 1.0))
    assert sum(box.counts) == 64
    if lammps_collisions.program() is None:
        pytest.skip(lammps_collisions.MISSING)
    text = re.sub(r"^run \d+$", "run 20000", text, flags=re.MULTILINE)
    printed = lammps_collisions.printed(text)
    assert "Loop time" in printed
    assert "20000 steps with 64 atoms" in printed


@pytest.mark.parametrize(
    ("words", "message"),
    [
        (("yade", "SCENE", "--deck"), "--deck is given for yade: accepted is a scene for lammps or rebound-python"),
        (("lammps", "--deck"), "--deck is given for no scene"),
        (("lammps", "SCENE", "--seed", 1), "--seed is given: accepted with it is --deck"),
        (("lammps", "SCENE", "--deck", "--particles", 2), "particles is 2: accepted is 8 to 10000000"),
        (("lammps", "SCENE", "--deck", "--particles", 9.5), "particles is 9.5: accepted is an integer"),
        (
            ("lammps", "SCENE", "--deck", "--volume-fraction", 0.6),
            "volume-fraction is 0.6: accepted is > 0 and <= 0.45",
        ),
        (("lammps", "SCENE", "--deck", "--seed", 0), "seed is 0: accepted is 1 to 900000000"),
        (("lammps", "SCENE", "--deck", "--collisions", -1), "collisions is -1.0: accepted is a number > 0"),
        (("lammps", "SCENE", "--deck", "--collisions", 1e6), "time steps, accepted is at most "),
        (("lammps", "SCENE", "--deck", "--volume-fraction", 0.4), "accepted for these sizes is below 0."),
        (("rebound-python", "SCENE", "--deck"), "there are several contacts of spheres: accepted for a deck is one"),
    ],
)
def test_bad_input(words, message, tmp_path):
    path = tmp_path / "walled.toml"
    path.write_text(WALLED)
    with pytest.raises(Exception, match=r".") as caught:
        output_of(*(path if word == "SCENE" else word for word in words))
    assert isinstance(caught.value, ValueError) or hasattr(caught.value, "format_message")
    assert message in (getattr(caught.value, "message", None) or str(caught.value))


def test_the_scene_says_how_dense_it_is(tmp_path):
    path = tmp_path / "soft.toml"
    path.write_text(decks.SCENE)
    assert "volume fraction 0.05:" in output_of("lammps", path, "--deck")
    assert "volume fraction 0.2:" in output_of("lammps", path, "--deck", "--volume-fraction", 0.2)
    assert output_of("rebound-python", path, "--deck").startswith("# Generated by viscopade")
