"""Collisions in real simulators against the map of their time steps: those stored, and a few run anew."""

import math
import statistics
from dataclasses import replace

import pytest

from tests import daily
from tests.simulators.two_balls import need
from viscopade.simulators import simulator_of
from viscopade.simulators.audit import audited
from viscopade_lab.runs import cases, simulators
from viscopade_lab.runs.cases import csv_text, measurements
from viscopade_lab.runs.simulators import FREQUENCY, SIMULATORS, mujoco_rebound, mujoco_solref

WANTED = "0.5"


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
        if each.asked not in cases.ASKED:
            found.setdefault((each.program, each.formula, each.time_step), []).append(each.epsilon)
    assert {program for program, _, _ in found} >= {"lammps", "liggghts"}
    for values in found.values():
        assert sum(values) / len(values) == pytest.approx(float(cases.WANTED), abs=1e-3)


def test_the_file_is_what_is_read():
    text = cases.pkgutil.get_data("viscopade_lab", cases.DATA).decode()
    assert csv_text(measurements()) == text


def some(name, *time_steps):
    found = (case for case in cases.cases(name, SIMULATORS[name].newer) if case.asked == WANTED)
    return [case for case in found if case.formula.scheme is None or case.time_step in time_steps]


@pytest.mark.parametrize("name", SIMULATORS)
def test_simulators_do_what_is_predicted(name):
    need(name)
    chosen = some(name, 0.1, 0.02) if name == "mujoco" else some(name, 0.02)
    chosen = [daily.chosen(chosen)] if name == "liggghts" else chosen  # a process each
    for found in simulators.measurements(name, chosen):
        assert found.epsilon == pytest.approx(found.predicted, abs=1e-6 if name == "mujoco" else 1e-10)


def test_simulators_that_are_not_there_keep_what_is_stored(monkeypatch, capsys):
    def gone():
        raise RuntimeError("not there")

    monkeypatch.setattr(simulators, "SIMULATORS", {"lammps": replace(SIMULATORS["lammps"], version=gone)})
    assert sorted(csv_text(simulators.all_measurements())) == sorted(csv_text(measurements()))
    assert "lammps is not run: not there" in capsys.readouterr().err


# --- MuJoCo -----------------------------------------------------------------------------------------------------------


def test_the_number_instead_delivers():
    """On average over where in a step of a fiftieth of the contact time the contact begins."""
    need("mujoco")
    for case in some("mujoco", 0.02):
        number = audited(simulator_of("mujoco"), case.formula, WANTED, case.time_step).instead
        mean, before = (
            statistics.fmean(
                SIMULATORS["mujoco"].epsilons(
                    [replace(case, phase=(i + 0.5) / 8, parameter=parameter) for i in range(8)]
                )
            )
            for parameter in (number, case.parameter)
        )
        assert mean == pytest.approx(0.5, abs=1e-3)
        assert abs(before - 0.5) > 0.01


SOLREF = mujoco_solref("solref = -stiffness -damping", 0.43)


@pytest.mark.parametrize("integrator", ["implicit", "implicitfast"])
def test_implicit_integrators_are_euler_in_contact(integrator):
    need("mujoco")
    assert mujoco_rebound(SOLREF, 1e-3, integrator=integrator) == pytest.approx(mujoco_rebound(SOLREF, 1e-3), abs=1e-12)


def test_the_default_solimp_changes_little():
    """Largest where the penetration is about the width of the impedance, 1 mm; 10 mm is the first here."""
    need("mujoco")
    step = math.pi / FREQUENCY / 500
    flat = mujoco_rebound(SOLREF, step)
    changes = [
        abs(mujoco_rebound(SOLREF, step, speed=speed, solimp="0.9 0.95 0.001 0.5 2") - flat)
        for speed in (1, 0.3, 0.1, 0.01, 0.001)
    ]
    assert 2e-3 < max(changes) < 5e-3
    assert max(changes[0], changes[-1]) < 1e-3


@pytest.mark.parametrize(("condim", "changed"), [(3, False), (4, True), (6, True)])
def test_pyramids_with_torsion_have_another_eps(condim, changed):
    need("mujoco")
    difference = mujoco_rebound(SOLREF, 1e-4) - mujoco_rebound(SOLREF, 1e-4, condim=condim)
    assert (difference > 1e-3) == changed


def test_the_time_constant_is_two_steps_at_least():
    need("mujoco")
    clipped, honest = (mujoco_rebound(f"{timeconst} 0.3", 0.01) for timeconst in (0.001, 0.02))
    assert clipped == pytest.approx(honest, abs=1e-12)
