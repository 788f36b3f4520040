"""The commands fit, plot and table as a user meets them: what is printed and written, and what is refused."""

import re
from pathlib import Path

import numpy as np
import pytest

from tests.cli import called, json_of, printed, said
from tests.fitting.test_contacts import REPORTED, fallen
from viscopade import Pair, Sphere, pade
from viscopade.arrays import double
from viscopade.fitting.flight import Flight
from viscopade.scene.read import from_toml

DATA = Path(__file__).parents[1] / "fitting" / "data"
SPEED = np.geomspace(0.05, 3, 12)
BALL = Sphere(radius=0.005, density=2500, young_modulus=7e10, poisson_ratio=0.22, dissipative_constant=5e-7)
PAIR = Pair(BALL, BALL)
MATERIAL = ("--radius", "5 mm", "--density", "2.5 g/cm^3", "--young-modulus", "70 GPa", "--poisson-ratio", 0.22)


@pytest.fixture
def data(tmp_path):
    epsilon = PAIR.epsilon(SPEED) + 0.005 * np.random.default_rng(1).standard_normal(12)
    rows = [f"{100 * v:.6g},{e:.5f},0.005" for v, e in zip(SPEED, epsilon, strict=True)]
    file = tmp_path / "data.csv"
    file.write_text("speed (cm/s),epsilon,sigma_epsilon\n" + "\n".join(rows) + "\n")
    return file


# --- fit ------------------------------------------------------------------------------------------------------------


def test_json_has_the_keys_that_others_rely_on(data):
    found = json_of("fit", data, *MATERIAL)
    assert abs(found["beta"] - PAIR.beta) < 3 * found["beta_standard_error"]
    low, high = found["interval_95"]
    assert low < found["interval_68"][0] < found["beta"] < found["interval_68"][1] < high
    assert found["dof"] == 11
    assert found["verdict"] == "holds"
    assert {law["law"] for law in found["laws"]} == {"viscoelastic", "constant", "hunt-crossley", "free exponent"}
    assert all({"chi2", "aic"} <= set(law) for law in found["laws"])
    assert abs(found["dissipative_constant"]["value"] - 5e-7) < 3 * found["dissipative_constant"]["standard_error"]
    assert len(found["points"]) == 12
    assert found["points"][0]["point"] == "line 2"


def test_text_says_what_is_missing_for_a_constant_and_has_the_scatter_that_is_fitted(data):
    assert "A also needs --radius, --density or --mass, --poisson-ratio, and --young-modulus or" in said("fit", data)
    # A fitted scatter makes chi^2 the number of degrees of freedom, whatever the law.
    assert re.search(r"law +p +scatter of eps +AIC\n", printed("fit", data, "--scatter"))


def test_fit_offers_no_yield_strength(data):
    assert "No such option" in called("fit", data, *MATERIAL, "--yield-strength", "1 MPa").stderr


def test_a_csv_becomes_a_line_for_lammps_with_an_error_bar_in_two_commands(data, tmp_path):
    scene, picture = tmp_path / "ball.toml", tmp_path / "fit.svg"
    printed("fit", data, *MATERIAL, "--scene", scene, "--plot", picture)
    text = printed("simulators", "lammps", scene)
    assert re.search(
        r"# ball-ball: eps at 0\.387 m/s is 0\.\d+ \+- 0\.00\d+ \(standard error\), because A is known", text
    )
    assert re.search(r"^pair_coeff", text, re.MULTILINE)
    assert picture.read_text().count('id="band"') == 1
    found = from_toml(scene.read_bytes(), str(scene))
    speed = json_of("fit", data)["epsilon"]["speed"]
    value = json_of("fit", data)["epsilon"]["value"]
    assert found.pair(found.meetings[0]).epsilon(speed) == pytest.approx(value, abs=1e-5)


def test_a_tolerance_finer_than_the_data_is_called_needless(data, tmp_path):
    scene = tmp_path / "ball.toml"
    printed("fit", data, *MATERIAL, "--scene", scene)
    scene.write_text(re.sub("absolute = .*", "epsilon = 1e-6", scene.read_text()))
    text = said("scene", scene, "--no-check")
    assert re.search(r"times larger; absolute = 0\.000\d+ is enough", text)


def test_contact_times_give_the_young_modulus(data, tmp_path):
    rows = [f"{v!r},{e!r},{t!r}" for v, e, t in zip(*(x.tolist() for x in (
        SPEED, PAIR.epsilon(SPEED), PAIR.contact_time(SPEED))), strict=True)]  # fmt: skip
    data.write_text("speed,epsilon,contact_time\n" + "\n".join(rows))
    words = ("--radius", "5 mm", "--density", "2500", "--poisson-ratio", "0.22")
    found = json_of("fit", data, *words)
    assert found["young_modulus"]["value"] == pytest.approx(7e10, rel=1e-6)
    assert found["dissipative_constant"]["value"] == pytest.approx(5e-7, rel=1e-6)


def test_a_law_that_does_not_hold_is_named_in_every_file(data, tmp_path):
    scene = tmp_path / "ball.toml"
    data.write_text("speed,epsilon,sigma_epsilon\n" + "\n".join(f"{v!r},0.9,0.003" for v in SPEED.tolist()))
    assert "does not hold" in printed("fit", data, *MATERIAL, "--scene", scene)
    assert "(the viscoelastic law does not hold)" in printed("simulators", "lammps", scene)


def test_the_best_law_goes_on_to_other_commands(data, tmp_path):
    file, scene = tmp_path / "constant.csv", tmp_path / "ball.toml"
    file.write_text("speed,epsilon,sigma_epsilon\n" + "\n".join(f"{v!r},0.9,0.003" for v in SPEED.tolist()))
    text = said("fit", file, *MATERIAL, "--scene", scene)
    assert "ball.toml has the viscoelastic law: scenes have no other law" in text
    options = re.search(r"`viscopade simulators`: (--law linear --epsilon \S+ --speed \S+)", text)[1].split()
    assert json_of("fit", file)["contact_law"] == pytest.approx({"law": "linear", "epsilon": 0.9, "speed": 0.387298})
    assert float(json_of("invert", *options)["epsilon"]) == 0.9
    soft = printed("simulators", "mujoco", *options, "--speeds", "0.05:3", "--contact-time", "10 ms")
    assert "of the law 1,0 0.9 and 0.9" in soft
    assert "relative error of eps over the speeds: 0 %\n" in soft
    assert "of the law 1,0 0.9 and 0.9" in printed("simulators", "drake", *options, "--speeds", "0.05:3")
    refused = called("simulators", "lammps", *options).stderr
    assert refused.startswith("viscopade: --law is given for lammps: expected mujoco, drake")
    assert "expected --law with --epsilon" in called("simulators", "mujoco", *options, *MATERIAL).stderr
    assert "Best law" not in printed("fit", data)


def test_an_outlier_is_named_beside_the_verdict(data):
    rows = data.read_text().splitlines()
    rows[6] = rows[6].split(",")[0] + ",0.82,0.005"
    data.write_text("\n".join(rows))
    text = printed("fit", data)
    assert text.index("line 7 is") < text.index("quantity")
    assert "--robust" not in printed("fit", data, "--robust", "--scatter").partition("quantity")[0]


def test_the_advice_on_an_outlier_among_heights(tmp_path):
    drop = tmp_path / "drop.csv"
    rows = ["600,216,82,33,14", "500,183,70,28,12", "400,149,95,37,16", "300,114,46,19,8"]  # 95 for 58
    drop.write_text("\n".join(["h0 (mm),h1 (mm),h2 (mm),h3 (mm),h4 (mm)", *rows]))
    text = " ".join(printed("fit", drop).split())
    assert "off if low bounces are as exact as high ones; else --resolution gives the error of readings; --with" in text
    with_errors = printed("fit", drop, "--resolution", "1 mm")
    assert "line 4, h2 is" in with_errors
    assert "--robust" not in with_errors
    assert "as exact as" not in with_errors
    assert "speeds " in with_errors.partition("\n\n")[0]


def test_several_files_of_which_one_has_an_echo(tmp_path):
    clean, echo = tmp_path / "clean.csv", tmp_path / "echo.csv"
    instants = np.append(0, np.cumsum(0.6 * 0.85 ** np.arange(6))).tolist()
    clean.write_text("\n".join(["time (s)", *map(repr, instants)]))
    echo.write_text("\n".join(["time (s)", *map(repr, sorted([*instants, instants[2] + 0.08]))]))
    found = json_of("fit", clean, echo)
    assert found["sheets"] == [{"sheet": "clean.csv", "points": 5}, {"sheet": "echo.csv", "points": 5}]
    assert found["left_out"] == [{"line": "echo.csv, line 5", "why": "an echo or another sound"}]
    text = printed("fit", clean, echo, "--without", "echo.csv:5")
    assert "echo.csv: 5 points" in text
    assert "line 5 is left out" not in text


@pytest.mark.parametrize(
    ("text", "why"),
    [
        (
            "time\n0\n1\n1.9\n2\n",
            "1 point has a speed and an eps: expected 3 or more; line 4 is left out: an echo",
        ),
        (
            "H (cm),h (cm)\n100,70\n",
            "3 or more; `viscopade invert --epsilon 0.8367 --speed 4.429` gives beta for",
        ),
        (
            "H (cm),h (cm)\n92,67\n92,66\n92,68\n",
            "all speeds are 4.248 m/s: .*`viscopade invert --epsilon 0.8534`.* of 0.853, 0.847, 0.860",
        ),
        (
            "height\n400\n300\n220\n160\n",
            "few.csv: line 3: in air drag would change eps by .*: are the units of heights or times right",
        ),
    ],
)
def test_data_that_give_no_fit_are_refused_with_the_file_and_the_reason(text, why, tmp_path):
    file = tmp_path / "few.csv"
    file.write_text(text)
    run = called("fit", file)
    assert run.returncode == 2
    assert re.search(why, " ".join(run.stderr.split()))


def test_a_long_record_is_cut_in_text_and_whole_in_json(tmp_path):
    file = tmp_path / "long.csv"
    file.write_text("v,COR\n" + "".join(f"{1 + k / 10},{0.9 - k / 1000}\n" for k in range(30)))
    text = printed("fit", file)
    assert "line 21" in text
    assert "line 22 " not in text
    assert "and 10 more points; --format json lists all" in text
    assert len(json_of("fit", file)["points"]) == 30


def test_flights_of_a_track_are_printed_with_their_acceleration():
    held = DATA / "held_then_dropped_synthetic.csv"
    assert re.search(r"flight from line 53 to line 67: acceleration 9\.\d+ \+- 0\.0\d+ m/s\^2", said("fit", held))
    found = json_of("fit", held)
    assert [each["first"] for each in found["flights"]][1] == "line 53"
    assert found["left_out"] == [{"line": "line 90", "why": "no free flight of 5 frames or more after it"}]


def test_json_has_what_was_read_from_each_file(tmp_path):
    one, two = tmp_path / "one.csv", tmp_path / "two.csv"
    one.write_text("v,e\n1,.9\n2,.88\n3,.87\n")
    two.write_text("v (cm/s),COR,remark\n150,.89,\n250,.875,\n")
    first, second = json_of("fit", one, two)["read"]["files"]
    assert (first["sheet"], first["speed"]["unit"], first["rows"]) == ("one.csv", "m/s", 3)
    assert (second["sheet"], second["speed"]["unit"], second["unused"]) == ("two.csv", "cm/s", ["remark"])
    alone = json_of("fit", one)["read"]
    assert alone == {**first, "files": [first]}


def test_a_wrong_scale_of_a_track_is_a_condition_in_the_sentence_to_quote(tmp_path):
    """A ball that rises and falls with 9.80665 m/s^2 and eps of 0.9, in mm under a header in m."""
    file, speed, rows = tmp_path / "mm.csv", 4.0, []
    for noise in (np.random.default_rng(k) for k in range(5)):
        for t in np.arange(0, 2 * speed / 9.80665, 0.005):
            y = 1000 * (speed * t - 9.80665 * t**2 / 2) + 0.3 * noise.standard_normal()
            rows.append(f"{0.005 * len(rows):.3f},{y:.3f}")
        speed *= 0.9
    table = "\n".join(rows)
    file.write_text(f"t (s),y (m)\n{table}\n")
    condition = "points), if the scale were right, which the warning above doubts: "
    text = said("fit", file)
    assert "--length-per-unit '1 mm' gives this" in text
    assert condition in text
    assert "if the scale" not in said("fit", file, "--length-per-unit", "1 mm")


def test_an_eps_of_0_has_no_beta_in_json(tmp_path):
    file = tmp_path / "stuck.csv"
    file.write_text("speed,epsilon\n.1,.6\n1,.4\n10,.2\n100,0\n")
    assert [point["beta"] is None for point in json_of("fit", file)["points"]] == [False, False, False, True]


@pytest.mark.parametrize(
    ("number", "others"), [(1, "; it is in the fit"), (3, ", and 2 more eps are; they are in the fit"), (0, "")]
)
def test_an_eps_above_1_is_named(number, others, tmp_path):
    file = tmp_path / "above.csv"
    file.write_text("speed,eps,sigma_eps\n.1,.97,.01\n1,.96,.01\n10,.92,.01\n" + number * "2,1.005,.01\n")
    warning = f"line 5: eps = 1.005 is above 1, by 0.5 standard errors{others}"
    assert json_of("fit", file)["warnings"] == [warning] * (number > 0)


def test_bounces_in_air_with_their_contacts(tmp_path):
    """A ball's instants on the Moon, from flights in air and the law; the true beta comes back."""
    wall = Pair(BALL, Sphere.wall(young_modulus=7e10, poisson_ratio=0.22, dissipative_constant=5e-7))
    instants = fallen(wall, Flight.of_sphere(0.005, 2500, air_density=1.2, gravity=1.62))[0]
    file = tmp_path / "drop.csv"
    file.write_text("time (ms)\n" + "\n".join(f"{1000 * t:.9f}" for t in instants))
    found = json_of("fit", file, *MATERIAL, "--wall", "--gravity", "1.62", "--air-density", "1.2")
    assert found["beta"] == pytest.approx(wall.beta, rel=1e-5)


OVERLAP = "the overlap reaches 0.11 of the radius, more than 0.03: Hertz's theory is for small contacts"
SOFT = ("--radius", "2 cm", "--density", 1100, "--young-modulus", "2 MPa", "--poisson-ratio", 0.49)


def test_weight_of_a_soft_ball_is_in_the_fit_or_said_to_be_left_out(tmp_path):
    """Exact instants of `tests/fitting/test_contacts.py`: A is 4e-4 s."""
    file = tmp_path / "drop.csv"
    file.write_text("time (s)\n" + "\n".join(map(str, REPORTED)))
    words = ("fit", file, "--no-scatter", "--resolution", "1e-7 s")
    found = json_of(*words, *SOFT, "--wall")
    assert found["beta"] == pytest.approx(0.32315, abs=2e-6)
    assert found["dissipative_constant"]["value"] == pytest.approx(4e-4, rel=1e-5)
    assert found["verdict"] == "holds"
    assert found["warnings"] == [OVERLAP]
    assert found["weight"]["fitted"]
    assert found["weight"]["g_t_c_over_v"] == pytest.approx([0.0414, 0.498], abs=1e-3)
    assert "Weight in contacts is in the fit: g t_c/v is 0.041 to 0.5." in said(*words, *SOFT, "--wall")
    assert json_of(*words, *SOFT) == found  # what bounces does so on a plane
    text = said(*words)
    assert (
        "Weight in contacts is neglected: it matters if the contact of the slowest bounce lasts 0.43 ms or more" in text
    )
    assert json_of(*words)["weight"] == {"fitted": False, "g_t_c_over_v": None}


def test_eps_at_a_speed_has_weight_only_if_the_sphere_fell(data):
    soft = ("--radius", "2 cm", "--density", 1100, "--young-modulus", "0.1 MPa", "--poisson-ratio", 0.49, "--wall")
    assert "if the sphere fell on the wall, g t_c/v is" in json_of("fit", data, *soft)["warnings"][-1]
    assert json_of("fit", data, *MATERIAL)["weight"] is None


# Heights in mm of a rubber ball (5 MPa, A = 8e-5 s) on a rigid plate: each collision with the weight was integrated
# with SciPy, apart from this package, and errors of 1 mm were added.
GRANITE = "height (mm)\n300\n195.6\n131\n87.4\n58.4\n40.9\n28\n20.8\n"
RUBBER = ("--radius", "1.5 cm", "--density", 1100, "--young-modulus", "5 MPa", "--poisson-ratio", 0.45)
PLATE = ("--wall-young-modulus", "60 GPa", "--wall-poisson-ratio", 0.25)


def test_a_plate_of_another_material(tmp_path):
    file, scene = tmp_path / "granite.csv", tmp_path / "granite.toml"
    file.write_text(GRANITE)
    constant = json_of("fit", file, *RUBBER, *PLATE)["dissipative_constant"]
    assert abs(constant["value"] - 8e-5) < constant["standard_error"] < 3e-6
    own = json_of("fit", file, *RUBBER)["dissipative_constant"]  # 9 errors off, and so this is said
    assert own["value"] == pytest.approx(1.04e-4, rel=0.01)
    assert "A is that of a sphere on a plane of its own material; --wall-young" in said("fit", file, *RUBBER)
    text = said("fit", file, *RUBBER, *PLATE, "--scene", scene)
    assert "the sphere's A has the weight 0.9999; if the plane has A = 0, that of the sphere is (7.92 +- 0.20)" in text
    written = from_toml(scene.read_bytes(), str(scene))
    for meeting in written.meetings:  # two balls, and one on the plate
        a_of_scene = written.pair(meeting).A
        assert a_of_scene == pytest.approx(constant["value"], rel=1e-3)
    assert [meeting.name for meeting in written.meetings] == ["ball-ball", "ball-plane"]
    # A plate as stiff as the sphere: its share of the pair's A is that of its compliance.
    glass = ("--radius", "1 cm", "--density", 2500, "--young-modulus", "70 GPa", "--poisson-ratio", 0.2)
    bodies = json_of("fit", file, *glass, "--wall-young-modulus", "210 GPa", "--wall-poisson-ratio", 0.3)["bodies"]
    compliances = (1 - 0.2**2) / 70, (1 - 0.3**2) / 210
    assert f"the weight {compliances[0] / sum(compliances):.4g};" in bodies


def test_a_is_said_to_be_of_two_spheres_or_of_one_on_a_plane(data):
    assert "A is that of two equal spheres; --wall gives that of a sphere on a plane." in said("fit", data, *MATERIAL)
    assert "A is that of a sphere on a plane of its own material" in said("fit", data, *MATERIAL, "--wall")
    assert json_of("fit", data)["bodies"] is None


def test_a_soft_material_is_warned_of(data):
    words = ("--radius", 1.5, "--density", 1.1, "--young-modulus", 5, "--poisson-ratio", 0.45)
    assert any("Hertz's theory is for small contacts" in text for text in json_of("fit", data, *words)["warnings"])


def test_all_results_have_the_scatter_that_the_verdict_needs(data, tmp_path):
    file, picture = tmp_path / "small.csv", tmp_path / "fit.svg"
    file.write_text(data.read_text().replace(",0.005", ",0.0005"))
    found, scattered = json_of("fit", file), json_of("fit", file, "--scatter")
    assert found["verdict"] == "holds with a limit"
    assert "all results are those with --scatter" in found["reasons"][0]
    assert found["chi2"] is found["laws"][0]["chi2"] is None
    same = ("beta", "beta_standard_error", "interval_95", "laws", "scatter", "exponent")
    assert {name: found[name] for name in same} == {name: scattered[name] for name in same}
    assert found["beta_standard_error"] > 3 * json_of("fit", data)["beta_standard_error"] / 10
    printed("fit", file, "--plot", picture)
    assert picture.exists()


HEIGHTS = "\n".join(["height (cm)", *(f"{30 * 0.9 ** (2 * k):.4f}" for k in range(7))])


def test_a_light_ball_is_told_of_drag(tmp_path):
    file = tmp_path / "heights.csv"
    file.write_text(HEIGHTS)
    (unknown,) = json_of("fit", file)["warnings"]
    assert re.fullmatch(
        r"drag is neglected: in air it would change eps of a table-tennis ball \(2.7 g, 4 cm\) by up to \+0\.0\d+; "
        "--air-density with --radius and --mass includes it",
        unknown,
    )
    ball = ("--radius", "2 cm", "--mass", "2.7 g")
    (known,) = json_of("fit", file, *ball)["warnings"]
    change = float(re.search(r"by up to ([+0-9.]+); --air-density includes it", known)[1])
    with_drag, without = (json_of("fit", file, *ball, *air)["points"] for air in (("--air-density", 1.2), ()))
    moved = [a["epsilon"] - b["epsilon"] for a, b in zip(with_drag, without, strict=True)]
    assert change == pytest.approx(max(moved), rel=0.05)
    assert json_of("fit", file, "--radius", "2 cm", "--mass", "0.26 kg")["warnings"] == []
    assert json_of("fit", file, *ball, "--air-density", 1.2)["warnings"] == []
    density = json_of("fit", file, "--radius", "2 cm", "--density", 80.572, "--air-density", 1.2)
    assert density["beta"] == pytest.approx(json_of("fit", file, *ball, "--air-density", 1.2)["beta"], rel=1e-5)


def test_a_constant_eps_of_a_light_ball_is_constant_with_drag(tmp_path):
    """Bounces from 30 to 5 cm, with eps of 0.93 and the drag of a ball of 2.7 g and 4 cm."""
    flight = Flight.of_sphere(0.02, 80.572, air_density=1.2)
    heights, launch = [], flight.launch_to(np.array([0.3]))
    while not heights or heights[-1] > 0.05:
        top = flight.terminal_speed**2 / (2 * flight.gravity) * np.log1p((launch / flight.terminal_speed) ** 2)
        heights.append(float(top[0]))
        launch = 0.93 * flight.impact(launch)
    file = tmp_path / "heights.csv"
    file.write_text("height (m)\n" + "\n".join(f"{h:.5f}" for h in heights))
    words = ("fit", file, "--radius", "2 cm", "--mass", "2.7 g", "--resolution", "0.2 mm", "--no-scatter")
    found = json_of(*words, "--air-density", 1.2)
    assert found["verdict"] == "does not hold"
    assert min(found["laws"], key=lambda law: law["aic"])["law"] == "constant"
    assert any("a constant eps" in reason for reason in found["reasons"])
    without = json_of(*words)
    assert min(without["laws"], key=lambda law: law["aic"])["law"] != "constant"


# --- table and plot -------------------------------------------------------------------------------------------------


def test_a_table_has_three_rows_in_a_decade():
    assert json_of("table", "--from", "1e-3", "--to", "10")["v_star"] == pytest.approx(np.geomspace(1e-3, 10, 13))


def test_a_table_of_a_material_has_its_contacts():
    words = ("--epsilon", "0.9", "--speed", "1 m/s", "--from", "1 cm/s", "--to", "1", "--points", "3")
    found = json_of("table", *MATERIAL, *words)
    pair = PAIR.calibrated(1.0, 0.9)
    assert found["speed"] == pytest.approx([0.01, 0.1, 1.0])
    assert found["curves"][0]["epsilon"] == pytest.approx(pair.epsilon(np.array([0.01, 0.1, 1.0])).tolist())
    assert found["contact_time"] == pytest.approx(pair.contact_time(np.array([0.01, 0.1, 1.0])).tolist())
    assert found["max_compression"] == pytest.approx(pair.max_compression(np.array([0.01, 0.1, 1.0])).tolist())


def test_all_curves_have_one_eps_at_the_speed():
    words = ("--epsilon", "0.6", "--speed", "1", "--from", "0.1", "--to", "10", "--points", "3")
    found = json_of("table", *words, "--law", "1,1", "--pade", "3/6", "--program", "liggghts")
    curves = {each["name"]: each["epsilon"] for each in found["curves"]}
    assert curves["viscoelastic"][1] == pytest.approx(0.6)
    assert curves["law 1,1"][1] == pytest.approx(0.6)
    assert curves["LIGGGHTS: hooke"] == pytest.approx([0.6] * 3)  # nu = 2, and the end for which its formula is made
    assert curves["[3/6]"] == pytest.approx(curves["viscoelastic"], rel=0.02)


def test_an_approximant_has_a_column_of_its_error():
    """Also where it is far below the last digit of a double; the first term of its series is known there."""
    words = ("table", "--epsilon", "0.9", "--speed", "1", "--pade", "3/6", "--points", "5", "--law", "linear")
    exact_curve, _, approximant = json_of(*words)["curves"]
    assert approximant["name"] == "[3/6]"
    quotients = np.divide(approximant["epsilon"], exact_curve["epsilon"]) - 1
    assert approximant["error"] == pytest.approx(quotients, abs=1e-15)
    header, *rows = printed(*words, "--format", "csv").splitlines()
    assert header == "speed (m/s),viscoelastic,linear,[3/6],error of [3/6]"
    assert [row.split(",")[-1] for row in rows] == [f"{error:.3g}" for error in approximant["error"]]
    over_v_star = json_of("table", "--pade", "3/6", "--pade", "60/63", "--from", "0.001", "--to", "1", "--points", "2")
    (_, first, second) = over_v_star["curves"]
    p = pade(3, 6, 30)
    assert first["error"][0] == pytest.approx(-float(p.next_term.mid()) * 0.001**p.contact_order * 0.001, rel=1e-2)
    assert second["error"] == [0, 0]


def test_a_table_has_the_digits_asked_for():
    words = ("table", "--epsilon", "0.9", "--speed", "1", "--points", "2")
    (eps, _) = json_of(*words)["curves"][0]["epsilon"]
    assert f"0.001,{eps:.6g}\n" in printed(*words, "--format", "csv")
    assert f"0.001,{eps:.17g}\n" in printed(*words, "--format", "csv", "--digits", "17")


def test_beta_has_its_unit():
    words = ("table", "--from", "1 cm/s", "--to", "2 cm/s", "--points", "2", "--beta")
    found = json_of(*words, "1.307 (s/cm)^(1/5)")["curves"][0]["epsilon"]
    assert found[0] == pytest.approx(double.epsilon(np.sqrt(1.307)))


def test_the_axis_has_the_unit_of_its_ends(tmp_path):
    """Matplotlib writes each text of a picture as a comment of the SVG file."""
    file = tmp_path / "ice.svg"
    words = ("plot", "--beta", "1.307 (s/cm)^(1/5)", "--pade", "3/6", "-o", file)
    printed(*words, "--from", "0.01 cm/s", "--to", "5 m/s", "--name", "ice")
    texts = re.findall("<!-- (.*?) -->", file.read_text())
    assert {"impact speed in cm/s", "ice", "[3/6]"} <= {*texts}
    assert "viscoelastic" not in texts
    printed(*words)
    assert {"impact speed in m/s", "viscoelastic"} <= {*re.findall("<!-- (.*?) -->", file.read_text())}


def test_a_picture_has_each_curve_and_the_data(data, tmp_path):
    file = tmp_path / "p.svg"
    printed("plot", "--epsilon", "0.9", "--speed", "1", "--law", "1,1", "--pade", "0/3", "--data", data, "-o", file)
    text = file.read_text()
    assert [f'id="curve-{i}"' in text for i in (1, 2, 3, 4)] == [True, True, True, False]
    assert 'id="data"' in text
    printed("plot", "--pade", "3/6", "-o", tmp_path / "v.png")
    assert (tmp_path / "v.png").read_bytes().startswith(b"\x89PNG")
