"""The command `viscopade audit`."""

import csv
import io
import json
import shlex

import pytest
from click.testing import CliRunner

from viscopade.cli.main import command


def run(*words):
    return CliRunner().invoke(command, ["audit", *words])


def test_one_eps_as_json():
    rows = json.loads(run("lammps", "--epsilon", "0.5", "--format", "json").output)["rows"]
    keys = {"program", "formula", "asked", "delivered", "end", "time_step", "instead", "source"}
    assert all(keys <= {*row} for row in rows)
    limited = next(row for row in rows if row["formula"] == "hertz, coeff_restitution, limit_damping")
    assert limited["delivered"].startswith("0.550283")
    assert limited["end"] == "force"
    assert limited["instead"]["coefficient of restitution"] == pytest.approx(0.4363, abs=1e-4)


@pytest.mark.parametrize(
    ("program", "formula", "name", "settings"),
    [
        ("lammps", "hertz, viscoelastic", "eta_n0", "normal=hertz coefficients=3e8,{}"),
        ("liggghts", "hertz/stiffness", "gamman", "model=hertz/stiffness kn=3e8 gamman={}"),
        (
            "mercurydpm",
            "HertzianBSHPViscoelastic",
            "dissipation",
            "species=HertzianBSHPViscoelastic effectiveElasticModulus=2.25e8 dissipation={}",
        ),
    ],
)
def test_a_viscoelastic_row_names_the_programs_own_damping(program, formula, name, settings):
    rows = json.loads(run(program, "--epsilon", "0.5", "--format", "json").output)["rows"]
    ((parameter, value),) = next(row["instead"] for row in rows if row["formula"] == formula).items()
    numbers = {"m_eff": 2e-5, "k_n": 3e8, "kn": 3e8, "R_eff": 1e-3, "v": 0.3, "k": 3e8 * 1e-3**0.5, name: 1.0}
    damping = value / eval(parameter.replace(" ", "*").replace("^", "**"), numbers)
    options = (word for setting in settings.format(damping).split() for word in ("--set", setting.replace(",", " ")))
    words = (program, *options, "--mass", "2e-5", "--radius", "1e-3", "--speed", "0.3", "--format", "json")
    assert json.loads(run(*words).output)["delivered"] == pytest.approx(0.5, abs=1e-6)


@pytest.mark.parametrize(
    "words",
    [
        "newton --set ke=1e5 --set kd=100 --mass 2",
        "lammps --set units=si --set normal=hooke --set 'coefficients=1e5 2' --mass 1 --radius 1",
        "liggghts --set model=hertz/stiffness --set kn=1e5 --set gamman=1 --mass 1 --radius 1",
    ],
)
def test_an_option_that_only_some_contacts_need_is_accepted(words):
    assert run(*shlex.split(words), "--speed", "1").exit_code == 0


@pytest.mark.parametrize(
    ("words", "is_long"),
    [("solref='-1e8 -100'", True), ("solref='-1e8 -100' --time-step 1e-5", False), ("solref='-2500 -20'", False)],
)
def test_the_default_step_of_the_program_is_compared_with_the_contact(words, is_long):
    """1e8 1/s^2 is a contact of pi 1e-4 s; MuJoCo's step is 2 ms."""
    flat = ("--set", "solimp=0.9 0.9 0.001", "--speed", "1")
    text = " ".join(run("mujoco", *flat, "--set", *shlex.split(words)).output.split())
    assert (
        'MuJoCo\'s default step of 2 ms is 6.4 contacts long: --time-step "2 ms" computes its eps' in text
    ) == is_long


def test_seconds_need_a_contact_time():
    words = ("mercurydpm", "--epsilon", "0.5", "--format", "json")
    scaled, seconds = (
        json.loads(run(*words, *more).output)["rows"]
        for more in (("--time-step", "0.02"), ("--time-step", "1e-6", "--contact-time", "5e-5"))
    )
    for one, other in zip(scaled, seconds, strict=True):
        assert one["at_time_step"] == pytest.approx(other["at_time_step"])
        assert one["integrator"].startswith("semi-implicit Euler")
    assert "integrator: semi-implicit Euler" in run(*words[:3], "--time-step", "0.02").output


def test_integrators_to_choose_from_are_named():
    """One line has the integrator of this answer, another one those of the program."""
    words = ("mujoco", "--set", "solref=-2500 -100", "--speed", "1")
    choice = "integrators for --scheme: Euler (default), RK4, implicit, implicitfast\n"
    assert f"\ntime steps: infinitely fine\n{choice}" in run(*words).output
    assert f"\nintegrator: RK4\n{choice}" in run(*words, "--time-step", "3 ms", "--scheme", "RK4").output


def test_formulas_that_do_not_accept_an_eps_are_named():
    words = ("liggghts", "--epsilon", "0.04")
    whole = json.loads(run(*words, "--format", "json").output)
    assert {row["formula"] for row in whole["rows"]} == {"hertz/stiffness", "hertz/stiffness, limitForce on"}
    assert len(whole["refused"]) == 4
    assert "hooke would be given coefficientRestitution = 0.04, and accepts 0.05 to 1" in run(*words).output


def test_a_file_of_a_user_as_json():
    words = ("mujoco", "--set", "solref=-2500 -100", "--speed", "1 m/s", "--time-step", "3 ms", "--epsilon", "0.5")
    found = json.loads(run(*words, "--format", "json").output)
    assert (found["simulator"], found["scheme"], found["parts"], found["status"]) == (
        "mujoco",
        "Euler",
        True,
        "sampled",
    )
    assert found["delivered"] == pytest.approx(0.122181, abs=2e-6)
    assert (found["least"], found["largest"]) == pytest.approx((0.1027, 0.1435), abs=5e-5)  # 505 phases in MuJoCo 4.0.0
    assert found["depth"] == pytest.approx(0.0065, rel=0.01)
    assert found["units"] == {"length": "m", "time": "s"}
    assert found["errors"]["epsilon"] < 1e-3


def test_a_body_that_stays_down():
    words = ("mujoco", "--speed", "1", "--gravity", "9.81", "--time-step", "3 ms")
    assert run(*words).output.startswith("MuJoCo: eps = 0, as the bodies do not part, sampled\ndepth")
    light = run("mujoco", "--set", "solref=-2500 -100", "--speed", "1").output
    assert light.startswith("MuJoCo: eps = 0.135697 without weight; 0 for a body that falls on a plane, sampled")
    found = json.loads(run(*words, "--format", "json").output)
    assert (found["delivered"], found["duration"], found["parts"]) == (0, None, False)
    (row,) = csv.DictReader(io.StringIO(run(*words, "--format", "csv").output))
    assert (row["simulator"], row["delivered"], row["duration"]) == ("mujoco", "0.0", "")


def test_a_contact_time_without_its_unit_is_noticed():
    words = ("simulators", "mujoco", "--epsilon", "0.5", "--speed", "1", "--contact-time")
    assert "contact-time is 31 s: is a unit missing?" in CliRunner().invoke(command, [*words, "31"]).stderr
    assert not CliRunner().invoke(command, [*words, "31 ms"]).stderr


def test_any_force():
    words = ("--force", "1e5*x + 1e3*max(v, 0)", "--mass", "1", "--speed", "1", "--format", "json")
    coarse = json.loads(run(*words, "--time-step", "1 ms").output)
    assert (coarse["simulator"], coarse["least"]) == (None, 0)
    assert coarse["largest"] == pytest.approx(0.3202, abs=2e-4)
    heavy = json.loads(run(*words, "--time-step", "0.1 ms", "--gravity", "9.81").output)
    assert (heavy["delivered"], heavy["least"], heavy["largest"]) == pytest.approx((0.2248, 0.2116, 0.2380), abs=1e-3)
    pulls = ("--force", "1e5*x + 139*v", *words[2:], "--end")
    force, back = (json.loads(run(*pulls, end).output)["delivered"] for end in ("force", "return"))
    assert force > back


@pytest.mark.parametrize(
    ("force", "speed", "words", "printed"),
    [  # depth sqrt(2 E/k) or E/F from where the force begins; half of the period of a spring
        ("where(x<1e-3,1e5*x,0)", "0.1", "", "eps = 1, sampled depth 0.0003162 m, duration 0.009935 s"),
        ("where(x<1e-3,501,0)", "1", "", "eps = 1, sampled depth 0.000998 m, duration 0.003992 s"),
        ("1e5*max(x-0.1,0)", "1", "", "eps = 1, sampled depth 0.1032 m, duration 0.1099 s"),
        ("1e5*max(x-0.1,0)", "1", "--time-step 1e-3", "eps = 1.0000 ("),
        ("1e5*max(x-0.04,0)", "1", "--gravity 9.81", "eps = 1, sampled depth 0.04432 m, duration 0.04433 s"),
        ("1e5*x", "1", "", "eps = 1, sampled depth 0.003162 m, duration 0.009935 s"),
    ],
)
def test_a_force_without_damping_gives_1(force, speed, words, printed):
    text = " ".join(run("--force", force, "--mass", "1", "--speed", speed, *words.split()).output.split())
    assert text.startswith(printed)
    assert "Warning" not in text


def test_drakes_defaults():
    """A largest bounce of 1/d."""
    assert run("drake", "--mass", "1", "--speed", "1").output.startswith(
        "Drake: eps = 0.02 without weight; 0 for a body"
    )


@pytest.mark.parametrize(("gravity", "warnings"), [((), 1), (("--gravity", "0"), 0), (("--gravity", "9.81"), 0)])
def test_a_gravity_of_0_says_that_there_is_no_weight(gravity, warnings):
    words = ("newton", "--set", "ke=1e5", "--set", "kd=1e3", "--mass", "1", "--speed", "1", "--format", "json")
    assert len(json.loads(run(*words, *gravity).output)["warnings"]) == warnings


def test_restitution_that_is_off():
    words = ("newton", "--scheme", "SolverXPBD", "--set", "restitution=0.3", "--mass", "1", "--speed", "1")
    text = " ".join(run(*words, "--epsilon", "0.3").output.split())
    assert "for eps = 0.3 at 1 m/s write restitution = 0.3, enable_restitution = True" in text
    assert "Warning: enable_restitution is off" in text


def test_the_radius_of_a_body_that_stays_counts_for_what_to_write():
    words = ("box2d", "--speed", "5", "--radius", "0.1", "--gravity", "9.81", "--time-step", "1/60 s", "--epsilon")
    found = json.loads(run(*words, "0.5", "--format", "json").output)
    assert (found["parts"], float(found["instead"]["restitution"])) == (False, pytest.approx(0.5, abs=0.1))


def test_a_plain_fraction_is_in_si_units():
    words = ("physx", "--set", "restitution=0.8", "--speed", "1/2", "--gravity", "9.81", "--time-step")
    assert run(*words, "1/60").output == run(*words, "1/60 s").output
    for text in ("1/0", "1/s", "1/60/2", "-1/60", "1/1e3"):
        assert f"--time-step is '{text}': expected a time > 0" in str(run(*words, text).exception)


def test_an_impulse_has_no_depth_and_no_duration():
    words = ("rebound", "--set", "coefficient_of_restitution=0.5", "--speed", "1")
    assert "depth" not in run(*words).output
    found = json.loads(run(*words, "--format", "json").output)
    assert (found["delivered"], found["depth"], found["duration"]) == (0.5, None, None)


def test_bodies_that_part_in_some_phases_have_no_duration():
    words = ("newton", "--set", "ke=1e5", "--set", "kd=1e3", "--mass", "1", "--speed", "1", "--time-step", "1e-3")
    text = run(*words, "--gravity", "9.81").output
    assert "depth 0.0005064 m; if contact begins at some places in a step, the bodies do not part" in text
    assert "inf" not in text.replace("infinitely", "")
    found = json.loads(run(*words, "--gravity", "9.81", "--format", "json").output)
    assert (found["parts"], found["duration"]) == (True, None)
    assert " ".join(run(*words).output.split()).startswith(
        "Newton and Warp: eps = 0.1601 (0.0000 to 0.3202: where in a step contact begins) without weight; "
        "0.1248 (0.0000 to 0.2876) for a body that falls on a plane, sampled"
    )


def test_three_formulas_are_printed_unless_all_are_wanted():
    few, all_ = run("lammps", "--epsilon", "0.5").output, run("lammps", "--epsilon", "0.5", "--all").output
    rows = json.loads(run("lammps", "--epsilon", "0.5", "--format", "json").output)["rows"]
    errors = sorted((abs(float(row["delivered"]) - 0.5) for row in rows), reverse=True)
    printed = [float(line.split()[1]) for line in few.splitlines() if "delivered:" in line]
    assert sorted((abs(eps - 0.5) for eps in printed), reverse=True) == pytest.approx(errors[:3], abs=1e-6)
    assert f"--all prints {len(rows) - 3} more" in few
    assert all_.count("delivered:") == len(rows)
    assert "--all" not in all_


def test_a_longer_contact_is_suggested():
    words = ("mercurydpm", "--epsilon", "0.5", "--time-step")
    rows = json.loads(run(*words, "0.3", "--format", "json").output)["rows"]
    steps = rows[-1]["resolving_steps"]
    text = " ".join(run(*words, "3 ms", "--contact-time", "10 ms").output.split())
    assert f"unless an undamped contact lasts {steps} time steps ({steps * 0.003:.3g} s)." in text
    for number, resolved in ((steps, True), (steps / 2, False)):
        (row,) = [
            row
            for row in json.loads(run(*words, repr(1 / number), "--format", "json").output)["rows"]
            if row["formula"] == rows[-1]["formula"]
        ]
        assert (row["resolving_steps"] is None) == resolved


def test_two_bodies_are_mixed_and_the_rule_is_said():
    words = (*("drake", "--speed", "1", "--mass", "2", "--set", "point_stiffness=3e4 6e4"), "--set")
    found = run(*words, "hunt_crossley_dissipation=3 0")
    text = " ".join(found.output.split())
    rule = "hunt_crossley_dissipation = 2, the mean, weighted by the other body's stiffness, of 3 and 0 (GetCombined"
    assert rule in text
    mixed = json.loads(run(*words, "hunt_crossley_dissipation=1", "--format", "json").output)["mixed"]
    rule = {"value": 2e4, "rule": "half of the harmonic mean", "meaning": "", "bodies": [3e4, 6e4]}
    assert mixed == {"point_stiffness": rule | {"source": "GetCombinedPointContactStiffness"}}


@pytest.mark.parametrize("program", ["physx", "bullet", "rebound"])
def test_weight_does_nothing_to_an_impulse(program):
    assert "a body that falls" not in run(program, "--epsilon", "0.5").output


@pytest.mark.parametrize(("typed", "meant"), [("isaac", "physx"), ("pybulet", "bullet")])
def test_a_name_that_is_nearly_one_is_no_file(typed, meant):
    assert CliRunner().invoke(command, ["audit", typed]).stderr.endswith(f"did you mean {meant}?\n")
