"""Collisions in real programs: what is stored, against the map of their time steps; and a few run anew."""

import math
from dataclasses import replace

import pytest

from tests import daily
from tests.simulators.two_balls import need
from viscopade_lab.runs import simulators
from viscopade_lab.runs.simulators import (
    EARTH,
    FLAT,
    FREQUENCY,
    PROGRAMS,
    REQUESTED,
    WANTED,
    Deck,
    Fall,
    Measurement,
    csv_text,
    falls,
    measurements,
    mujoco_epsilons,
)


@pytest.mark.parametrize(("kind", "read"), [(Fall, falls), (Measurement, measurements)])
def test_the_file_is_what_is_read(kind, read):
    assert csv_text(read()) == simulators.path(kind).read_text(encoding="utf-8")


# --- the audit --------------------------------------------------------------------------------------------------------


def test_stored_collisions_are_what_the_map_predicts():
    worst = {}
    for program, _, difference in simulators.differences(measurements()):
        worst[program] = max(worst.get(program, 0), difference)
    assert {"lammps", "liggghts"} <= {*worst}
    assert worst["lammps"] < 1e-10
    assert worst["liggghts"] < 1e-10
    assert max(worst.values()) < 1e-3


def test_programs_that_are_asked_for_the_number_instead_deliver_what_is_wanted():
    found = {}
    for each in measurements():
        if each.asked not in REQUESTED:
            found.setdefault((each.program, each.formula, each.time_step), []).append(each.epsilon)
    assert {program for program, _, _ in found} >= {"lammps", "liggghts"}
    for values in found.values():
        assert sum(values) / len(values) == pytest.approx(float(WANTED), abs=1e-3)


@pytest.mark.parametrize("name", [name for name, program in PROGRAMS.items() if program.written])
def test_programs_do_what_is_predicted(name):
    need(name)
    steps = (0.1, 0.02) if name == "mujoco" else (0.02,)
    chosen = [
        case
        for case in simulators.cases(name)
        if case.asked == WANTED and (case.formula.scheme is None or case.time_step in steps)
    ]
    chosen = [daily.chosen(chosen)] if name == "liggghts" else chosen  # a process each
    for found in simulators.measure(chosen):
        assert found.epsilon == pytest.approx(found.predicted, abs=1e-10)


def test_mujoco_delivers_the_number_instead():
    """On average over where in a step of a fiftieth of the contact time the contact begins."""
    need("mujoco")
    instead = [case for case in simulators.cases("mujoco") if case.asked not in REQUESTED and case.time_step == 0.02]
    assert len(instead) == 3
    for case in instead:
        before = simulators.case("mujoco", case.formula, WANTED, case.time_step, case.deck.phases)
        means = [sum(mujoco_epsilons(each.deck)) / each.deck.phases for each in (case, before)]
        assert means[0] == pytest.approx(0.5, abs=1e-3)
        assert abs(means[1] - 0.5) > 0.01


def test_programs_that_are_not_there_keep_what_is_stored(monkeypatch, capsys):
    def gone():
        raise RuntimeError("not there")

    before = simulators.path(Measurement).read_text("utf-8")
    monkeypatch.setattr(simulators, "PROGRAMS", {"lammps": replace(PROGRAMS["lammps"], version=gone)})
    for falls_too in (False, True):
        simulators.main.callback((), falls_too, True)
        assert "lammps is not run: not there" in capsys.readouterr().err
    assert simulators.path(Measurement).read_text("utf-8") == before


# --- falls ------------------------------------------------------------------------------------------------------------


def test_every_fall_is_stored():
    for program, of in PROGRAMS.items():
        stored = [each for each in falls() if each.program == program]
        names = ("scheme", "parameters", "mass", "speed", "gravity", "time_step", "phases")
        assert [[getattr(each, name) for name in names] for each in stored] == [
            [getattr(each, name) for name in names] for each in (of.falls() if of.falls else ())
        ]
        assert len({each.version for each in stored}) == bool(of.falls)
    assert all(0 <= each.least <= each.mean <= each.largest for each in falls())
    assert {each.scheme for each in falls() if each.largest > 1} == {"Forward_Euler", "Taylor_Scheme"}


SOFT = f"solref={simulators._SOFT[0]}; solimp={FLAT}; condim=1"
DEFAULT = f"solref=-2500 -100; solimp={simulators._DEFAULT}; condim=1"


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
        for each in falls()
        if (each.program, each.parameters, each.speed, each.gravity, each.time_step) == words and each.scheme != "RK4"
    ]
    assert found
    assert [each.mean for each in found] == pytest.approx([epsilon] * len(found), abs=within)


# In MuJoCo: implicitfast, the default impedance with Euler's method and Runge and Kutta's, pyramids with torsion.
@pytest.mark.parametrize(
    ("program", "which"),
    [*(("mujoco", i) for i in (1, 36, 41, 65)), ("lammps", 0), ("lammps", 19), ("liggghts", 4)],
)
def test_programs_do_it_again(program, which):
    need(program)
    stored = [each for each in falls() if each.program == program][which]
    if PROGRAMS[program].version() != stored.version:
        pytest.skip(f"{program} has another version than the measured one")
    again = simulators.fall([*PROGRAMS[program].falls()][which], stored.version)
    assert (again.mean, again.least, again.largest) == pytest.approx(
        (stored.mean, stored.least, stored.largest), abs=1e-8
    )


# --- MuJoCo -----------------------------------------------------------------------------------------------------------


def rebound(step, solref=f"{-(FREQUENCY**2)} {-0.43 * FREQUENCY}", speed=1.0, solimp=FLAT):
    """Return eps in MuJoCo of a ball whose contact begins in the middle of a step."""
    need("mujoco")
    parameters = f"solref={solref}; solimp={solimp}; condim=1"
    (epsilon,) = mujoco_epsilons(Deck("mujoco", "Euler", parameters, 3.0, speed, 0.0, step, math.pi / FREQUENCY, 1))
    return epsilon


def test_the_default_solimp_changes_little():
    """Largest where the penetration is about the width of the impedance, 1 mm; 10 mm is the first here."""
    step = math.pi / FREQUENCY / 500
    flat = rebound(step)
    changes = [
        abs(rebound(step, speed=speed, solimp="0.9 0.95 0.001 0.5 2") - flat) for speed in (1, 0.3, 0.1, 0.01, 0.001)
    ]
    assert 2e-3 < max(changes) < 5e-3
    assert max(changes[0], changes[-1]) < 1e-3


def test_the_time_constant_is_two_steps_at_least():
    clipped, honest = (rebound(0.01, f"{timeconst} 0.3") for timeconst in (0.001, 0.02))
    assert clipped == pytest.approx(honest, abs=1e-12)
