"""The command `viscopade audit FILE`, and pasted lines."""

import csv
import io
import json
import math
import os
import re
import shlex
from pathlib import Path

import pytest
from click.testing import CliRunner

from viscopade.cli.main import command
from viscopade.simulators import simulator_of
from viscopade.simulators.deck import Deck, DeckContact, DeckRun, Line, Size
from viscopade.simulators.native import FileUnits

PLAIN = FileUnits("sigma", "m", "tau", unsized="units is lj: expected a plain number, or --set units=si")


def run(*words):
    return CliRunner().invoke(command, ["audit", *words])


def text_of(*words):
    return " ".join(run(*words).output.split())


def hooke(e, units="si"):
    damping = {"damping": "coeff_restitution", "limit_damping": "yes"}
    return {"normal": "hooke", "coefficients": f"1e5 {e}", "units": units} | damping


@pytest.fixture
def deck(tmp_path, monkeypatch):
    """A file, and what a reader makes of it: types 1 and 2, type 2 and a wall; the pair changes in a later run.

    The radius of type 2, and the variable e, come from options.
    """
    file = tmp_path / "in.box"
    file.write_text("units si\n")
    changes = {}

    def read(path, said):
        def line(number, text):
            return Line(path, number, text)

        def pair(number, e):
            def lines(texts):
                return (f"pair_coeff 1 2 hooke {texts['coefficients']}",)

            name = "type 1 - type 2"
            return DeckContact(name, line(number, "pair_coeff"), hooke(e, units), sizes, marks=mixed, lines_with=lines)

        units, mixed = changes.get("units", "si"), ("mixed from 1 1 and 2 2",)
        small, large = Size(1e-3, 1e-5), Size(said.radii.get("2", (2e-3,))[-1], 8e-5)
        sizes = ((small, small), (small, large))
        wall = DeckContact(
            "type 1 - wall", Line(Path("in.wall"), 2, "fix"), hooke(0.5, units), ((large, None),), falls=True
        )
        jkr = DeckContact("type 1 - type 3", line(5, "pair_coeff"), {}, (), reason="jkr is not computed here")
        first = DeckRun(line(8, "run 10"), 2e-6, 9.81, (pair(4, said.variables.get("e", "0.5")), wall, jkr))
        second = DeckRun(line(12, "run 20"), 2e-6, 9.81, (pair(11, "0.9"), wall, jkr))
        unread = (line(3, "thermo 10"), line(7, "fix 1 all move linear 0 0 1"))
        file_units = {"si": FileUnits(), "lj": PLAIN}[units]
        missing = changes.get("missing", ())
        return Deck(simulator_of("lammps"), path, file_units, (first, second), missing, unread, ("bonds are not read",))

    monkeypatch.setattr("viscopade.simulators.lammps_deck.read_input", read)
    return str(file), changes


def eps_of(asked):
    """Design 2.9, nu = 2: exp(-pi zeta/w) is asked for, and exp(-zeta (pi - 2 asin zeta)/w) is delivered."""
    zeta = -math.log(asked) / math.hypot(math.pi, math.log(asked))
    return math.exp(-zeta * (math.pi - 2 * math.asin(zeta)) / math.sqrt(1 - zeta**2))


def test_a_table_for_each_run(deck):
    """In the later run the wall is the same, and the contact without a number is, too."""
    text = run(deck[0]).output
    flat = " ".join(text.split())
    assert "in.box: LAMMPS in m, kg and s; 2 runs, 3 contacts; eps at 1 m/s, as --speed is not given, sampled" in flat
    first, second = text.split("run 10, line 8: time step 2e-06 s, gravity 9.81 m/s^2")[1].split(
        "run 20, line 12: time"
    )
    assert re.findall(r"^ (\d)  ", first, re.MULTILINE) == ["1", "2", "3", "4"]
    assert re.findall(r"^ *(\d)  ", second, re.MULTILINE) == ["5", "6"]
    assert "falling" in first
    assert "falling" not in second
    for sentence in (
        "row 4: no number: jkr is not computed here.",
        "rows 1, 2, 5, 6: mixed from 1 1 and 2 2.",
        "Warning: bonds are not read.",
        "not read: thermo (line 3), fix move (line 7)",
    ):
        assert sentence in flat


def test_json(deck):
    whole = json.loads(run(deck[0], "--format", "json", "--speed", "2 m/s", "--time-step", "1 ns").output)
    assert [whole[key] for key in ("file", "program", "speed", "units")] == [
        *(deck[0], "lammps", 2.0),
        {"length": "m", "mass": "kg", "time": "s"},
    ]
    assert [line["number"] for line in whole["unread"]] == [3, 7]
    # 1 ns is less than 1/5000 of a contact: as good as no step.
    assert whole["warnings"][0] == "bonds are not read"
    assert all("infinitely many" in text for text in whole["warnings"][1:])
    small, large, wall, jkr, *later = whole["contacts"]
    assert (small["name"], small["line"]["number"], small["run"]["text"]) == ("type 1 - type 2", 4, "run 10")
    assert (small["radius"], large["radius"], wall["radius"]) == ([1e-3, 1e-3], [1e-3, 2e-3], [2e-3])
    assert (small["mass"], large["mass"], wall["mass"]) == pytest.approx((5e-6, 80e-6 / 9, 8e-5))
    assert [row["delivered"] for row in (small, large, wall, *later)] == pytest.approx(
        [eps_of(0.5)] * 3 + [eps_of(0.9)] * 2
    )
    # The loss of a linear contact grows by the factor 1 + 0.405 g t_c/v, to first order: design 2.11.
    assert wall["g_t_c_over_v"] == pytest.approx(9.81 * math.pi * math.sqrt(8e-5 / 1e5) / 2, rel=1e-6)
    assert small["g_t_c_over_v"] is None
    assert (1 - wall["falling"]) / (1 - wall["delivered"]) == pytest.approx(1 + 0.405 * wall["g_t_c_over_v"], rel=1e-4)
    assert (jkr["delivered"], jkr["reason"], jkr["run"]["number"]) == (None, "jkr is not computed here", 8)
    assert [row["run"]["number"] for row in later] == [12, 12]
    assert small["steps"] == pytest.approx(math.pi * math.sqrt(5e-6 / 1e5) / 1e-9)


def test_csv_has_the_same_rows(deck):
    rows = json.loads(run(deck[0], "--format", "json").output)["contacts"]
    table = list(csv.DictReader(io.StringIO(run(deck[0], "--format", "csv").output)))
    assert [[*row] for row in table] == [[*row] for row in rows]
    for key in ("name", "delivered", "least", "largest", "falling", "mass", "steps", "reason"):
        assert [row[key] for row in table] == ["" if row[key] is None else str(row[key]) for row in rows]
    assert (table[2]["line"], table[2]["radius"], table[0]["radius"]) == ("in.wall:2", "0.002", "0.001\n0.001")


def test_lines_to_write_instead(deck):
    """At no time step the number to write is the e with eps_of(e) = 0.6."""
    words = (deck[0], "--epsilon", "0.6", "--time-step", "1 ns")
    row, *_ = json.loads(run(*words, "--format", "json").output)["contacts"]
    (line,) = row["instead"]
    assert eps_of(float(line.split()[-1])) == pytest.approx(0.6, abs=1e-7)
    assert f"for eps = 0.6 in rows 1, 2 write after line 4\n    {line}\n" in run(*words).output


def test_a_warning_stands_once(deck):
    """Each row has its own range, and its own step that makes it shorter; JSON has all."""
    words = (deck[0], "--epsilon", "0.6", "--time-step", "4 us")
    flat = text_of(*words)
    assert flat.count("With 0.6 on average, eps is") == 1
    assert re.search(r"Warning, rows 1, 2, 5, 6: With 0.6 on .* is below 0.02 \(the numbers of row 1\)\.", flat)
    rows = json.loads(run(*words, "--format", "json").output)["contacts"]
    assert len({row["warnings"][-1] for row in rows if row["warnings"]}) == 3


def test_numbers_of_options(deck):
    def rows(*words):
        return json.loads(run(deck[0], *words, "--format", "json").output)["contacts"]

    assert rows("--radius", "2=1mm:3 mm")[1]["radius"] == [1e-3, 3e-3]
    assert rows("--variable", "e=0.7", "--time-step", "1 ns")[0]["delivered"] == pytest.approx(eps_of(0.7))
    fine, heavy = rows("--gravity", "0")[2], rows("--gravity", "98.1 m/s^2")[2]
    assert (fine["falling"], fine["g_t_c_over_v"]) == (None, None)
    assert heavy["g_t_c_over_v"] == pytest.approx(10 * rows()[2]["g_t_c_over_v"], rel=1e-9)


def test_units_without_a_size(deck):
    file, changes = deck
    changes["units"] = "lj"
    whole = json.loads(run(file, "--format", "json").output)
    assert whole["speed"] == 1
    assert "eps at 1 sigma/tau, as --speed is not given" in text_of(file)
    assert run(file, "--time-step", "1/1000").exit_code == 0  # a plain fraction has no unit
    refused = run(file, "--speed", "1 m/s")
    assert refused.exit_code == 2
    assert refused.stderr.endswith("--speed has a unit, and units is lj: expected a plain number\n")


@pytest.mark.parametrize(
    ("words", "message"),
    [
        ("--density 2500", "--density is '2500': expected NAME=VALUE, such as \"1=2500\""),
        ("--density 1=-2", "--density is '-2': expected a density > 0"),
        ("--density 1=2500 --density 1=2500", "1 is set twice"),
        ("--radius 2=3:2", "--radius is 2=3:2: expected one radius, or the least and the largest"),
        ("--radius 2=1:2:3", "expected one radius, or the least and the largest"),
        ("--radius 2=1kg", "--radius is '1kg': expected a length > 0"),
        ("--speed 0", "--speed is '0': expected a speed > 0"),
        ("--epsilon 1", "epsilon is '1': expected a number > 0 and < 1"),
        ("--set solref=1", '--set is given with a file: expected --set "damping=tsuji (2026)", or the file with other'),
        ('--set "damping=tsuji (2026)"', "in.box has no damping tsuji"),
        ("--step-error 0.01", "--step-error is given with a file: expected --time-step with a tenth of your step"),
        ("--radius 1=1mm,2=1.6mm", "--radius is 1=1mm,2=1.6mm: expected one type, and --radius again for another"),
        ("--epsilon wall=0.6", "--epsilon is 'wall=0.6': expected one number, and a command for each eps"),
        ("--mass 1", "--mass is given with a file: expected a command without it"),
        ("--all", "--all is given with a file"),
        ("--scheme verlet", "--scheme is given with a file"),
    ],
)
def test_refusals(deck, words, message):
    refused = run(deck[0], *shlex.split(words))
    assert refused.exit_code in (1, 2)
    assert message in (refused.stderr or str(refused.exception)).replace("\n", " ")


def test_all_that_is_missing_is_one_message(deck):
    file, changes = deck
    changes["missing"] = ("the density of type 1 (--density 1=2500)", "the radius of type 2 (--radius 2=1mm)")
    message = "does not say the density of type 1 (--density 1=2500); the radius of type 2 (--radius 2=1mm)"
    assert f"{message}. bonds are not read" in " ".join(run(file).stderr.split())


def test_a_file_without_a_number_is_refused(deck):
    """m v^2 is beyond double precision; each reason stands once."""
    refused = run(deck[0], "--speed", "1e200")
    assert refused.exit_code == 2
    message = " ".join(refused.stderr.split())
    assert "has no contact with a number: speed is 1e+200" in message
    assert message.count("jkr is not computed here") == 1


def test_a_terminal_obeys_nothing_of_a_file(monkeypatch, deck):
    """Names, lines and warnings with the sequence that clears a terminal."""
    clear = "\x1b[2J"
    line = Line(Path("in.x"), 1, f"run {clear}")
    size = Size(1e-3, 1e-5)
    free = DeckContact(
        clear, line, hooke(0.5), ((size, size),), marks=(clear,), lines_with=lambda texts: (f"pair_coeff {clear}",)
    )
    whole = Deck(
        simulator_of("lammps"), Path("in.x"), FileUnits(), (DeckRun(line, None, 0.0, (free,)),), (), (line,), (clear,)
    )
    monkeypatch.setattr("viscopade.simulators.lammps_deck.read_input", lambda path, said: whole)
    output = CliRunner().invoke(command, ["audit", deck[0], "--epsilon", "0.5"], color=True).output
    assert "\x1b" not in output
    assert output.count(r"\x1b[2J") == 5


def test_gravity_needs_a_wall(deck, monkeypatch):
    settings, size = hooke(0.5), Size(1e-3, 1e-5)
    free = DeckContact("type 1 - type 1", Line(Path("in.x"), 1, ""), settings, ((size, size),))
    whole = Deck(simulator_of("lammps"), Path("in.x"), FileUnits(), (DeckRun(None, None, 0.0, (free,)),))
    monkeypatch.setattr("viscopade.simulators.lammps_deck.read_input", lambda path, said: whole)
    assert "--gravity has no effect: " in run(deck[0], "--gravity", "9.81").stderr
    assert "no time step, gravity 0 m/s^2" in run(deck[0]).output


# --- both readers -----------------------------------------------------------------------------------------------------

EXAMPLES = Path(__file__).parents[2] / "examples"


def test_an_input_of_lammps():
    """Without a step eps is that of design 2.9, whatever the sizes; LAMMPS mixes to the geometric mean."""
    words = (str(EXAMPLES / "in.hopper"), "--time-step", "1 ns", "--format", "json")
    rows = json.loads(run(*words).output)["contacts"]
    asked = {"type 1 - type 1": 0.6, "type 1 - type 2": math.sqrt(0.54), "type 2 - type 2": 0.9}
    walls = dict.fromkeys(("type 1 - wall floor", "type 2 - wall floor"), 0.6)
    assert {row["name"]: row["delivered"] for row in rows} == pytest.approx(
        {name: eps_of(e) for name, e in (asked | walls).items()}, rel=1e-6
    )
    assert [row["falling"] is not None for row in rows] == [False, False, False, True, True]
    assert rows[-1]["mass"] == pytest.approx(4 / 3 * math.pi * 1.5e-3**3 * 7800)


def test_where_the_lines_belong():
    """A later pair_coeff replaces an earlier one; a wall that stays has a second force."""
    words = (str(EXAMPLES / "in.hopper"), "--epsilon", "0.6", "--time-step", "1 ns")
    text = text_of(*words)
    text = text.replace("with weight, the column falling, ", "")
    places = re.findall(r"in (rows? [0-9, ]+) write (\w+(?: of)? line \d+)", text)
    assert dict(places) == {
        "row 1": "after line 12",
        "row 2": "after line 13",
        "row 3": "after line 13",
        "rows 4, 5": "instead of line 14",
    }
    assert "begin alike" not in text


def test_sizes_of_one_contact(tmp_path):
    """The damping of `viscoelastic` belongs to a mass: sizes of one line share a number, and have a range of eps."""
    file = tmp_path / "in.sizes"
    text = (EXAMPLES / "in.hopper").read_text("utf-8").replace("coeff_restitution", "viscoelastic")
    file.write_text(text.replace(" diam one 0.002 ", " diam range 0.002 0.004 "))
    flat = text_of(str(file), "--epsilon", "0.6", "--time-step", "1 ns")
    pairs = [line.split()[1:3] for line in re.findall("pair_coeff [0-9] [0-9]", flat)]
    assert pairs == [["1", "1"], ["1", "2"], ["2", "2"]]
    assert (
        "For closer eps give sizes types of their own. For a number of its own at a wall a type needs a group" in flat
    )
    # The range is that of the eps which the rows get.
    rows = json.loads(run(str(file), "--epsilon", "0.6", "--time-step", "1 ns", "--format", "json").output)["contacts"]
    reached = [row["reached"] for row in rows if row["name"] == "type 1 - type 1"]
    assert f"for eps = 0.6 ({min(reached):.4f} to {max(reached):.4f}) in rows 1 to 3 write" in flat


def test_a_narrow_terminal(monkeypatch):
    """The table fits into 80 columns without the lines and the masses."""
    for module in ("audit_deck", "console"):
        monkeypatch.setattr(f"viscopade.cli.{module}.text_width", lambda: 80)
    lines = run(str(EXAMPLES / "in.hopper"), "--time-step", "1 ns").output.splitlines()
    assert [line.split() for line in lines if line.startswith(" row")] == [
        ["row", "types", "radius", "(m)", "eps", "from", "to", "falling", "t_c/step"]
    ]
    assert all(len(line) <= 80 for line in lines)


def test_a_model_of_mujoco(tmp_path):
    pytest.importorskip("mujoco")
    file = tmp_path / "marked.xml"  # with a mark of the byte order
    file.write_bytes(b"\xef\xbb\xbf\n" + (EXAMPLES / "balls.xml").read_bytes())
    text = text_of(str(file))
    assert "MuJoCo in m, kg and s; 6 pairs, 5 contacts; eps at 1 m/s" in text
    assert "time step 0.002 s, gravity 9.81 m/s^2" in text
    assert "rubber - foam (2 pairs)" in text


PAIR = '<pair geom1="b{}" geom2="floor" solref="0.02 {}"/>'


def test_where_a_pair_of_mujoco_is_written(tmp_path):
    """One that is there is replaced; two equal ones make a row without a line."""
    pytest.importorskip("mujoco")
    geoms = "".join(f'<body><freejoint/><geom name="b{i}" size="1"/></body>' for i in range(4))
    pairs = "\n".join((PAIR.format(0, 0.3), PAIR.format(1, 0.2), PAIR.format(2, 0.2)))
    file = tmp_path / "balls.xml"
    file.write_text(
        f'<mujoco><worldbody><geom name="floor" type="plane" size="1 1 1" contype="2"/>\n{geoms}</worldbody>\n'
        f"<contact>\n{pairs}\n</contact></mujoco>"
    )
    text = text_of(str(file), "--epsilon", "0.5")
    weight = "for eps = 0.5 with weight, the column falling, in row"
    assert f"{weight} 1 write instead of the <pair> in line 4 <pair " in text
    assert f"{weight} 2 write in <contact> instead of the <pair> of the same geoms <pair " in text
    assert f"{weight} 3 write in <contact> <pair " in text
    assert re.search(r"for eps = 0\.5 in row 4 write in <contact> <pair ", text)


def test_a_row_whose_body_stays_down_says_so(tmp_path):
    pytest.importorskip("mujoco")
    file = tmp_path / "ball.xml"
    file.write_text(
        '<mujoco><worldbody><geom name="floor" type="plane" size="1 1 1" solref="0.02 0.65"/>\n'
        '<body><freejoint/><geom name="ball" size="1" solref="0.02 0.65"/></body></worldbody></mujoco>'
    )
    text = text_of(str(file), "--speed", "0.1")
    assert "row 1: with its weight the body stays down below 0.462 m/s, and falling is 0." in text
    assert "sticks below" not in text
    assert "stays down" not in text_of(str(file), "--speed", "0.5")
    (row,) = json.loads(run(str(file), "--speed", "0.1", "--format", "json").output)["contacts"]
    assert (row["falling"], row["sticking_speed"]) == (0, pytest.approx(0.462, abs=1e-3))


def test_a_file_of_another_program_is_refused(tmp_path):
    file = tmp_path / "robot.sdf"
    file.write_text('<?xml version="1.0"?>\n<sdf version="1.7"><model name="a"/></sdf>\n')
    refused = run(str(file))
    assert refused.exit_code == 2
    accepted = "expected an input of LAMMPS or LIGGGHTS, or a model of MuJoCo"
    assert f"robot.sdf is a file of another program: {accepted}" in " ".join(refused.stderr.split())


INPUT = """\
units si
atom_style sphere
region box block 0 1 0 1 0 1
create_box 2 box
pair_style granular
pair_coeff * * hooke ${k} 0.5 tangential linear_nohistory 1 0.5 damping coeff_restitution
fix 1 all nve/sphere
timestep 1e-6
run 1
"""


def test_lines_that_replace_each_other(tmp_path):
    """A line serves two runs with other time steps, whose eps differ: of two numbers the last one counts."""
    file = tmp_path / "in.two"
    text = "create_atoms 1 b\ncreate_atoms 2 b\nset type 2 diameter 2 density 1\ntimestep 1e-3\n"
    text += "fix w all wall/gran hooke 1e4 NULL 9 NULL 0 0 zplane 0 NULL\n"
    text += "pair_style gran/hooke 1e4 NULL 9 NULL 0 0\npair_coeff * *\nrun 1\n"
    sentence = "Of lines that begin alike the last one counts: each is for its rows alone."
    file.write_text(text)
    assert sentence not in text_of(str(file), "--epsilon", "0.6")
    file.write_text(f"{text}timestep 2e-3\nrun 1\n")
    assert sentence in text_of(str(file), "--epsilon", "0.6")


def test_a_default_stands_before_the_warnings_that_it_causes(tmp_path):
    """Spheres without dens have 1 kg/m^3, and so contacts of two time steps, in which they gain energy."""
    file = tmp_path / "in.light"
    file.write_text((EXAMPLES / "in.hopper").read_text("utf-8").replace(" dens 7800 7800", ""))
    text = text_of(str(file), "--speed", "1")
    assert 0 < text.index("has no dens: the default density is 1.") < text.index("the bodies gain energy")
    # Such steel beads get no eps of 0.8; the line that is written for glass at the wall counts for them, too.
    text = text_of(str(file), "--speed", "1", "--epsilon", "0.8")
    assert "in row 4 write instead of line 14" in text
    assert "A line has one number for all its rows." in text


def test_the_release_of_tsuji(tmp_path):
    """LAMMPS 22 Jul 2025 takes Marshall's alpha for kappa, and later releases sqrt(2) times that."""
    file = tmp_path / "in.tsuji"
    line = "pair_coeff 1 1 hertz/material 1e7 0.5 0.3 tangential linear_nohistory 0 0 damping tsuji"
    file.write_text(f"units si\natom_style sphere\ncreate_atoms 1 box\npair_style granular\n{line}\ntimestep 1e-9\n")
    sizes, newer = ("--radius", "1=1mm", "--density", "1=2500"), ("--set", "damping=tsuji (2026)")
    pasted = ("lammps", "--set", line, "--radius", "1 mm", "--density", "2500", "--speed", "1")
    for words in ((str(file), *sizes), pasted):
        old, new = (json.loads(run(*words, *more, "--format", "json").output) for more in ((), newer))
        eps = [whole.get("delivered") or whole["contacts"][0]["delivered"] for whole in (old, new)]
        assert eps == pytest.approx([0.6161, 0.4999], abs=5e-5)  # docs/results/audit.md
        (text,) = (text for text in old["warnings"] if "tsuji" in text)
        assert text.endswith('give eps = 0.4999: --set "damping=tsuji (2026)"')
        assert not any("tsuji" in text for text in new["warnings"])
    # The line to write has the word of the program, and the number of its release.
    for more, number in (((), "0.36665136"), (newer, "0.50008274")):
        text = run(str(file), *sizes, "--epsilon", "0.5", *more).output
        assert f"hertz/material 10000000 {number} 0.3 tangential linear_nohistory 0 0 damping tsuji\n" in text


def test_a_file_that_is_not_there_has_names_like_it(tmp_path):
    (tmp_path / "in.mix").touch()
    assert run(str(tmp_path / "in.mixx")).stderr.endswith("in.mixx': did you mean in.mix?\n")


def test_the_name_of_a_simulator_is_no_file(tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    Path("mujoco").touch()
    assert run("mujoco", "--epsilon", "0.5").output.startswith("eps = 0.5 is asked for")
    assert "mujoco has no contact" in str(run("./mujoco").exception)


def test_a_pipe_is_refused(tmp_path):
    os.mkfifo(tmp_path / "pipe")
    assert "is a pipe: expected a file" in " ".join(run(str(tmp_path / "pipe")).stderr.split())


def test_all_that_an_input_lacks_is_one_message(tmp_path):
    file = tmp_path / "in.two"
    file.write_text(INPUT)
    message = " ".join(run(str(file), "--variable", "k=1e5").stderr.split())
    for option in ("--radius 1=", "--radius 2=", "--density 1=", "--density 2="):
        assert option in message
    sizes = [word for i in (1, 2) for word in ("--radius", f"{i}=1mm", "--density", f"{i}=2500")]
    rows = json.loads(run(str(file), "--variable", "k=1e5", *sizes, "--format", "json").output)["contacts"]
    assert [row["mass"] for row in rows] == pytest.approx([2 / 3 * math.pi * 1e-9 * 2500] * 3)


@pytest.mark.parametrize(
    ("words", "message"),
    [
        ("--density 3=1", "no type 3: expected 1, 2"),
        ("--radius x=1mm", "no type x"),
        ("--variable n=3", "no variable n"),
    ],
)
def test_names_that_a_file_does_not_have(words, message):
    refused = run(str(EXAMPLES / "in.hopper"), *shlex.split(words))
    assert refused.exit_code in (1, 2)
    assert message in (refused.stderr or str(refused.exception))


# --- pasted lines -----------------------------------------------------------------------------------------------------

MATERIAL = "hertz/material 1e6 0.8 0.4 tangential linear_nohistory 1 0.5 damping coeff_restitution limit_damping"
LINE = f"pair_coeff 1 1 {MATERIAL}"
WALL = f"fix 1 all wall/gran granular {MATERIAL} zplane 0 NULL"


@pytest.mark.parametrize(
    ("line", "radius", "density", "mass", "effective_radius"),
    [  # m = 4/3 pi R^3 rho, in units of pi 1e-6 kg; x y/(x + y)
        (LINE, "1 mm", "3000", 2, 0.5e-3),
        (LINE, "1 mm, 2 mm", "3000", 4 * 32 / 36, 2e-3 / 3),
        (LINE, "1 mm, 2 mm", "3000, 1500", 4 * 16 / 20, 2e-3 / 3),
        (LINE, "1 mm, wall", "3000", 4, 1e-3),
        (WALL, "1 mm", "3 g/cm^3", 4, 1e-3),
    ],
)
def test_a_pasted_line_with_bodies(line, radius, density, mass, effective_radius):
    words = ("--set", line, "--speed", "1", "--format", "json", "--time-step", "2 us")
    bodies = json.loads(run("lammps", *words, "--radius", radius, "--density", density).output)
    effective = ("--mass", repr(mass * math.pi * 1e-6), "--radius", repr(effective_radius), "--set", "units=si")
    names = ("normal=hertz/material", "coefficients=1e6 0.8 0.4", "damping=coeff_restitution", "limit_damping=yes")
    settings = [word for name in names for word in ("--set", name)]
    other = json.loads(run("lammps", *settings, *words[2:], *effective).output)
    assert bodies["delivered"] == pytest.approx(other["delivered"], rel=1e-6)
    assert bodies["duration"] == pytest.approx(other["duration"], rel=1e-6)
    assert "units is not set, and taken to be si because" in bodies["warnings"][-1]


def test_bodies_of_other_programs():
    """Hertz in Kratos or YADE; a linear contact lasts pi sqrt(m_eff/k) without damping."""
    words = (
        "newton",
        "--set",
        "ke=1e5",
        "--set",
        "kd=0",
        "--radius",
        "1 cm, wall",
        "--density",
        "1000",
        "--speed",
        "1",
    )
    duration = json.loads(run(*words, "--format", "json").output)["duration"]
    assert duration == pytest.approx(math.pi * math.sqrt(4 / 3 * math.pi * 1e-3 / 1e5), rel=1e-6)
    assert "effective mass 0.00418879 kg, effective radius 0.01 m" in text_of(*words)


@pytest.mark.parametrize(
    ("words", "message"),
    [
        (f"--set '{LINE}' --radius 1mm --density 2500 --mass 1 --speed 1", "--density is given: expected --radius"),
        (
            f"--set '{LINE}' --density 2500 --speed 1",
            "--density is given: expected --radius, the radius of the spheres",
        ),
        (f"--set '{LINE}' --radius 1,2,3 --density 2500 --speed 1", "expected those of one sphere, or two"),
        (f"--set '{WALL}' --radius 1,2 --density 2500 --speed 1", "expected those of one sphere"),
        (f"--set '{LINE}' --radius 1 --density 2500,2,2 --speed 1", "expected those of one sphere, or two"),
        (f"--set '{LINE}' --radius 1 --radius 2 --density 1 --speed 1", "--radius is given 2 times: expected once"),
        (f"--set '{LINE}' --radius 'wall, 1' --density 1 --speed 1", "--radius is 'wall': expected a length > 0"),
        (f"--set '{LINE}' --set damping=velocity --radius 1 --mass 1 --speed 1", "damping is set twice"),
        (f"--set '{LINE}' --set units=lj --radius 1mm --density 1 --speed 1", "--radius has a unit, and units is lj"),
        ("--set 'pair_coeff 1 1' --speed 1", "expected pair_coeff"),
        ("--set 'pair_coeff 1 1 mdr 5e6 0.4 1.9e5 2 0.5 0.5 damping mdr 1' --speed 1", "mdr"),
        ("--set 'fix' --speed 1", "is no line of a contact"),
    ],
)
def test_pasted_lines_that_are_refused(words, message):
    refused = run("lammps", *shlex.split(words))
    assert refused.exit_code in (1, 2)
    assert message in (refused.stderr or str(refused.exception)).replace("\n", " ")


@pytest.mark.parametrize("head", ["pair_coeff 1 1", "pair_coeff * * granular", "fix 1 all wall/gran granular"])
def test_the_line_to_write_is_pasted_again(head):
    """Its numbers after the model change, and no others: those of the types are equal to them here."""
    text = f"{head} hooke 1 1 tangential linear_nohistory 1 1 damping mass_velocity zplane 0 NULL"
    text = text if head.startswith("fix") else text.partition(" zplane")[0]
    words = ("--set", "units=si", "--mass", "1", "--speed", "1")
    output = run("lammps", "--set", text, *words, "--epsilon", "0.5").output
    line = output.partition("write\n    ")[2].split("\n")[0]
    number = line.split(" hooke 1 ")[1].split()[0]
    assert line == text.replace("hooke 1 1", f"hooke 1 {number}")
    answer = json.loads(run("lammps", "--set", line, *words, "--format", "json").output)
    assert answer["delivered"] == pytest.approx(0.5, abs=1e-7)


@pytest.mark.parametrize(
    ("words", "message"),
    [
        ("mujoco --radius 1 --density 2500 --speed 1", "--density has no effect on this contact"),
        ("mujoco --variable x=1", "--variable is given without a file"),
        ("mujoco --density 2500", "--density is given without --speed"),
        (f"mujoco --set '{LINE}' --speed 1", "expected NAME=VALUE"),
    ],
)
def test_options_that_need_another_command(words, message):
    refused = run(*shlex.split(words))
    assert refused.exit_code in (1, 2)
    assert message in (refused.stderr or str(refused.exception)).replace("\n", " ")
