"""A ball that falls on a plane in real programs: what is stored, and a few falls anew."""

import pytest

from tests.simulators.two_balls import need
from viscopade_lab.runs import decks
from viscopade_lab.runs.decks import EARTH

FALLS = decks.falls()


def test_the_file_is_what_is_read_and_has_every_case():
    assert decks.csv_text(FALLS) == decks.path().read_text(encoding="utf-8")
    for program, (cases, _, _) in decks.PROGRAMS.items():
        stored = [each for each in FALLS if each.program == program]
        names = ("scheme", "parameters", "mass", "speed", "gravity", "time_step", "phases")
        assert [[getattr(each, name) for name in names] for each in stored] == [
            [getattr(each, name) for name in names] for each in cases()
        ]
        assert len({each.version for each in stored}) == 1
    assert all(0 <= each.least <= each.mean <= each.largest for each in FALLS)
    assert {each.scheme for each in FALLS if each.largest > 1} == {"Forward_Euler", "Taylor_Scheme"}


SOFT = f"solref={decks._SOFT[0]}; solimp={decks._FLAT}; condim=1"
DEFAULT = f"solref=-2500 -100; solimp={decks._DEFAULT}; condim=1"


@pytest.mark.parametrize(
    ("program", "parameters", "speed", "gravity", "time_step", "epsilon", "within"),
    [
        ("mujoco", SOFT, 1.0, 0.0, 1.55e-5, 0.5, 1e-4),
        ("mujoco", SOFT, 1.0, EARTH, 1.55e-5, 0.4482, 1e-4),
        ("mujoco", SOFT, 0.3, EARTH, 1.55e-5, 0.4075, 1e-4),
        ("mujoco", SOFT, 0.1, EARTH, 1.55e-5, 0.3399, 1e-4),
        ("mujoco", DEFAULT, 1.0, 0.0, 0.003, 0.1222, 1e-4),
        ("mujoco", DEFAULT, 1.0, EARTH, 0.003, 0.0, 0.0),
        ("newton", "ke=1e5; kd=1e3", 1.0, 0.0, 1e-4, 0.2522, 1e-4),
        ("newton", "ke=1e5; kd=1e3", 1.0, EARTH, 1e-4, 0.2242, 1e-4),
        ("newton", "ke=1e5; kd=378", 1.0, 0.0, 1e-4, 0.4927, 1e-4),
        ("yade", "tc=0.01; en=0.5", 1.0, 0.0, 1e-5, 0.6459, 1e-4),  # at a wall half of the mass counts
    ],
)
def test_what_users_get(program, parameters, speed, gravity, time_step, epsilon, within):
    """The numbers that the documentation names."""
    words = (program, parameters, speed, gravity, time_step)
    found = [
        each
        for each in FALLS
        if (each.program, each.parameters, each.speed, each.gravity, each.time_step) == words and each.scheme != "RK4"
    ]
    assert found
    assert [each.mean for each in found] == pytest.approx([epsilon] * len(found), abs=within)


@pytest.mark.parametrize(("program", "which"), [("mujoco", 36), ("mujoco", 41), ("lammps", 0), ("lammps", 19)])
def test_programs_do_it_again(program, which):
    need(program)
    stored = [each for each in FALLS if each.program == program][which]
    if decks.PROGRAMS[program][2]() != stored.version:
        pytest.skip(f"{program} has another version than the measured one")
    again = decks.fall(list(decks.PROGRAMS[program][0]())[which], stored.version)
    assert (again.mean, again.least, again.largest) == pytest.approx(
        (stored.mean, stored.least, stored.largest), abs=1e-8
    )
