"""Collisions in real programs against the map of their time steps: those stored, and a few run anew."""

import importlib.util
import shutil

import pytest

from tests import daily
from viscopade.audit import measured
from viscopade.audit.measured import csv_text, finest, measurements
from viscopade_lab.programs import audit, audit_cases, lammps_collisions, liggghts_collisions, rebound_collisions

PRESENT = {
    "lammps": lammps_collisions.program() is not None,
    "liggghts": shutil.which("liggghts") is not None,
    "rebound": importlib.util.find_spec("rebound") is not None,
}
RUN = {
    "lammps": lammps_collisions.audit_measurements,
    "liggghts": liggghts_collisions.audit_measurements,
    "rebound": rebound_collisions.audit_measurements,
}


def test_stored_collisions_are_what_the_map_predicts():
    worst = {}
    for program, _, difference in audit.differences(measurements()):
        worst[program] = max(worst.get(program, 0), difference)
    assert {"lammps", "liggghts"} <= {*worst}
    assert worst["lammps"] < 1e-10
    assert worst["liggghts"] < 1e-10
    assert max(worst.values()) < 1e-3


def test_programs_that_are_asked_for_the_number_instead_deliver_what_is_wanted():
    found = {}
    for each in measurements():
        if each.asked not in audit_cases.ASKED:
            found.setdefault((each.program, each.formula, each.time_step), []).append(each.epsilon)
    assert {program for program, _, _ in found} >= {"lammps", "liggghts"}
    for values in found.values():
        assert sum(values) / len(values) == pytest.approx(float(audit_cases.WANTED), abs=1e-3)


def test_the_file_is_what_is_read():
    text = (measured.pkgutil.get_data("viscopade", measured.DATA)).decode()
    assert csv_text(measurements()) == text


def test_the_finest_is_found():
    assert finest("lammps", "hertz, coeff_restitution", "0.5").time_step == min(audit_cases.TIME_STEPS)
    assert finest("lammps", "hertz, coeff_restitution", "0.51") is None


@pytest.mark.parametrize("program", sorted(RUN))
def test_programs_do_what_is_predicted(program):
    if not PRESENT[program]:
        pytest.skip(f"{program} is not installed")
    out = lammps_collisions.NEWER if program == "lammps" else frozenset()
    some = [case for case in audit_cases.cases(program, out) if case.asked == "0.5"]
    some = [case for case in some if case.formula.scheme is None or case.time_step == 0.02]
    some = [daily.chosen(some)] if program == "liggghts" else some  # a process each
    for found in RUN[program](some):
        assert found.epsilon == pytest.approx(found.predicted, abs=1e-10)


def test_programs_that_are_not_there_keep_what_is_stored(monkeypatch, capsys):
    def gone():
        raise RuntimeError("not there")

    monkeypatch.setattr(audit, "RUNNERS", {"lammps": gone})
    assert sorted(csv_text(audit.anew())) == sorted(csv_text(measurements()))
    assert "lammps is not run: not there" in capsys.readouterr().err
