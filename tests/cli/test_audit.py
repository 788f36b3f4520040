"""The command `viscopade audit`."""

import csv
import io
import json

import pytest
from click.testing import CliRunner

from viscopade.cli.main import command


def run(*words):
    return CliRunner().invoke(command, ["audit", *words])


def test_one_eps_as_json():
    rows = json.loads(run("--program", "lammps", "--epsilon", "0.5", "--format", "json").output)["rows"]
    keys = {"program", "formula", "asked", "delivered", "end", "time_step", "instead", "measured", "source"}
    assert all(keys <= {*row} for row in rows)
    limited = next(row for row in rows if row["formula"] == "hertz, coeff_restitution, limit_damping")
    assert limited["delivered"].startswith("0.550283")
    assert limited["end"] == "force"
    assert limited["instead"]["coefficient of restitution"] == pytest.approx(0.4363, abs=1e-4)


def test_the_table_has_a_column_for_each_eps():
    rows = list(csv.DictReader(io.StringIO(run("--program", "mercurydpm", "--format", "csv").output)))
    assert [*rows[0]] == ["program", "formula", *(f"eps = {e}" for e in ("0.9", "0.75", "0.5", "0.3", "0.1"))]
    assert rows[0]["eps = 0.1"] == "0.1"


def test_seconds_need_a_contact_time():
    words = ("--program", "mercurydpm", "--epsilon", "0.5", "--format", "json")
    scaled, seconds = (
        json.loads(run(*words, *more).output)["rows"]
        for more in (("--time-step", "0.02"), ("--time-step", "1e-6", "--contact-time", "5e-5"))
    )
    for one, other in zip(scaled, seconds, strict=True):
        assert one["at_time_step"] == pytest.approx(other["at_time_step"])
        assert one["integrator"].startswith("semi-implicit Euler")
    assert "integrator: semi-implicit Euler" in run(*words[:4], "--time-step", "0.02").output


def test_the_largest_time_step_has_the_wanted_error():
    words = ("--program", "mercurydpm", "--epsilon", "0.5", "--format", "json")
    (row, *_) = json.loads(run(*words, "--step-error", "0.01").output)["rows"]
    assert row["advice"]["error"] == 0.01
    (again, *_) = json.loads(run(*words, "--time-step", repr(row["advice"]["largest_step"])).output)["rows"]
    ends = (again["at_time_step"][name] for name in ("least", "largest"))
    assert 0.005 < max(abs(end / float(row["delivered"]) - 1) for end in ends) < 0.011


def test_formulas_that_do_not_accept_an_eps_are_named():
    words = ("--program", "liggghts", "--epsilon", "0.04")
    whole = json.loads(run(*words, "--format", "json").output)
    assert {row["formula"] for row in whole["rows"]} == {"hertz/stiffness", "hertz/stiffness, limitForce on"}
    assert len(whole["refused"]) == 4
    assert "hooke would be given coefficientRestitution = 0.04, and accepts 0.05 to 1" in run(*words).output
