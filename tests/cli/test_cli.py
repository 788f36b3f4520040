"""The command line as a user meets it: output shapes, exit codes, one-line errors, nothing half-written.

Most commands are called in this process; those whose streams, environment or imports matter get one of their own.
"""

import csv
import io
import json
import os
import pty
import re
import shutil
import subprocess
import sys
import tomllib
from pathlib import Path

import pytest

from tests.cli import VISCOPADE, called, started
from tests.patience import HANGS
from viscopade import Pair, Points, Sphere, fit, pade, series
from viscopade.cli.main import command
from viscopade.collision import exact
from viscopade.extras import EXTRAS
from viscopade.kernels import requests
from viscopade.theory.paper import TABLE
from viscopade_lab import bench, hard_cases
from viscopade_lab.figures import registry as figures


def json_of(*words):
    result = called(*words, "--format", "json")
    assert result.returncode == 0, result.stderr
    assert result.stderr == ""
    return json.loads(result.stdout)


# --- what is printed ----------------------------------------------------------------------------------------------


COMMANDS = (
    "reproduce",
    "coefficients",
    "pade",
    "epsilon",
    "invert",
    "audit",
    "claims",
    "figures",
    "hardcases",
    "export",
    "bench",
    "scene",
    "simulators",
    "verification",
    "fit",
    "plot",
    "table",
    "calculator",
)


def test_help_lists_the_commands_that_work_and_no_others():
    listed = called("--help").stdout.partition("Commands:")[2].split("\n")
    names = {line.split()[0] for line in listed if line.strip()}
    assert names == set(COMMANDS)
    for name in names:
        result = called(name, "--help")
        assert result.returncode == 0
        assert "Usage: viscopade" in result.stdout


@pytest.mark.parametrize(
    "name", sorted({*COMMANDS} - {"figures", "export", "simulators", "verification", "plot", "calculator"})
)
def test_commands_that_print_numbers_have_four_formats(name):
    (style,) = [option for option in command.commands[name].params if option.name == "style"]
    assert style.type.choices == ("text", "json", "csv", "latex")


def test_coefficients_json_has_the_shape_of_the_design():
    whole = json_of("coefficients", "--order", 60, "--digits", 50)
    assert set(whole) == {"order", "digits", "h"}
    assert (whole["order"], whole["digits"], len(whole["h"])) == (60, 50, 61)
    assert whole["h"] == list(series(60, 50).decimals())


def test_coefficients_csv_and_latex():
    rows = list(csv.reader(io.StringIO(called("coefficients", "--order", 4, "--digits", 8, "--format", "csv").stdout)))
    assert rows == [["k", "h_k"], ["0", "1"], ["1", "0"], ["2", "-1.1534489"], ["3", "0"], ["4", "0.79826656"]]
    text = called("coefficients", "--order", 4, "--digits", 8, "--format", "latex").stdout
    assert text.startswith(r"\begin{tabular}{ll}")
    assert r"$k$ & $h_k$ \\" in text
    assert r"2 & $-1.1534489$ \\" in text


@pytest.mark.parametrize("words", [["reproduce"], ["claims", "--only", "3-6-almost-perfect"], ["pade", "3", "6"]])
def test_latex_escapes_what_is_special(words, tmp_path):
    table = called(*words, "--format", "latex").stdout
    assert not re.search(r"^\[", table, re.MULTILINE)  # it would be an argument of the line's end before
    assert not re.search(r"(?<!\\)[%#$_]|\^", re.sub(r"(?<!\\)\$[^$]*\$", "", table))
    if shutil.which("pdflatex") is None:
        pytest.skip("no pdflatex to set it")
    document = "\\documentclass{article}\\usepackage[T1]{fontenc}\n\\begin{document}\n" + table + "\\end{document}\n"
    (tmp_path / "table.tex").write_text(document)
    words = ["pdflatex", "-halt-on-error", "-interaction=nonstopmode", "table.tex"]
    assert subprocess.run(words, cwd=tmp_path, capture_output=True, timeout=HANGS).returncode == 0


def test_text_in_a_pipe_never_folds_a_number():
    assert series(2, 300).decimals()[2] in called("coefficients", "--order", 2, "--digits", 300).stdout


def test_pade_json_has_the_shape_of_the_design():
    whole = json_of("pade", 2, 5, "--digits", 20)
    ours = pade(2, 5, 20)
    assert (whole["m"], whole["n"]) == (2, 5)
    assert (tuple(whole["a"]), tuple(whole["b"])) == ours.decimals()
    assert len(whole["poles"]) == 5
    assert [(z["re"][:7], z["im"]) for z in whole["zeros"] if z["positive"]] == [("5.68011", "0")]
    assert not any(p["positive"] for p in whole["poles"])
    assert whole["usable"] is False
    assert whole["contact_order"] == 7


def test_pade_text_says_what_it_is_good_for():
    assert "[3/6] usable for all v* >= 0" in called("pade", 3, 6).stdout
    text = called("pade", 7, 10, "--digits", 15).stdout
    assert "a zero at v* = 0.279952 and a pole at v* = 0.279952" in text
    assert "Froissart doublet" in text


BALL = ("--radius", 0.01, "--density", 2500, "--young-modulus", 1e7, "--poisson-ratio", 0.3)


def test_epsilon_json_has_the_shape_of_the_design():
    whole = json_of("epsilon", "--v-star", "1.5", "--digits", 40)
    assert set(whole) == {"digits", "v_star", "epsilon", "one_minus_epsilon", "x_max", "tau_c"}
    assert whole == {"digits": 40, **exact.collision("1.5", 40).decimals()}


def test_laws_of_contact():
    """The shape of the design: with a law, JSON has kappa, too."""
    found = json_of("epsilon", "--law", "hunt-crossley", "--kappa", "1", "--digits", "15")
    assert found["epsilon"] == "0.593624260040040"  # Lambert W: tests/collision/test_laws.py
    assert (found["kappa"], found["law"], found["nu"], found["end"], found["d"]) == ("1", "3/2,3/2", "1", "force", 1)
    back = json_of("invert", "--law", "1,0", "--end", "return", "--epsilon", "0.5", "--digits", "12", "--speed", "7")
    assert back["kappa"] == back["beta"] == "0.430907523932"  # 2 zeta, as many tables have it
    series = json_of("coefficients", "--law", "3/2,0", "--order", "5", "--digits", "5")
    assert series["h"][:5] == ["1", "0", "0", "-1.7878", "0"]
    assert (series["nu"], series["d"]) == ("5/2", 3)
    assert json_of("pade", "3", "--digits", "5")["n"] == 6
    assert json_of("pade", "3", "--law", "hunt-crossley", "--digits", "5")["n"] == 4
    text = called("coefficients", "--law", "kelvin-voigt:1", "--order", "2").stdout
    assert "law 2,1: x'' + x^2 + kappa x x' = 0, nu = 3/2; v* = kappa; contact ends where the force vanishes" in text
    assert "law" not in json_of("coefficients", "--order", "2")


def test_epsilon_at_beta_and_speed():
    whole = json_of("epsilon", "--beta", "1.307", "--speed", "0.2622")
    assert whole["epsilon"] == exact.collision(beta="1.307", speed="0.2622").decimals()["epsilon"]
    assert whole["beta"] == "1.307"


def test_epsilon_of_a_material():
    ball = Sphere(radius=0.01, density=2500, young_modulus=1e7, poisson_ratio=0.3, dissipative_constant=4e-5)
    whole = json_of("epsilon", *BALL, "--dissipative-constant", 4e-5, "--speed", 0.5)
    pair = Pair(ball, ball)
    assert float(whole["epsilon"]) == pair.epsilon(0.5)
    assert float(whole["contact_time"]) == pair.contact_time(0.5)
    assert float(whole["max_compression"]) == pair.max_compression(0.5)
    wall = json_of("epsilon", *BALL, "--dissipative-constant", 4e-5, "--speed", 0.5, "--wall")
    assert float(wall["beta"]) != float(whole["beta"])
    unequal = json_of("epsilon", *BALL, "--radius", 0.02, "--dissipative-constant", 4e-5, "--speed", 0.5)
    assert float(unequal["beta"]) < float(whole["beta"])


def test_quantities_have_units():
    """A number with a unit is the number in SI units, exactly; both commands print the same names and units."""
    units = ("--radius", "1 cm", "--density", "2.5 g/cm^3", "--young-modulus", "10 MPa", "--poisson-ratio", 0.3)
    plain = json_of("epsilon", *BALL, "--dissipative-constant", 4e-5, "--speed", 0.5)
    assert json_of("epsilon", *units, "--dissipative-constant", "40 us", "--speed", "50 cm/s") == plain
    assert plain["units"] == {
        "beta": "(s/m)^(1/5)",
        "dissipative_constant": "s",
        "max_compression": "m",
        "contact_time": "s",
    }
    assert set(json_of("invert", "--epsilon", 0.9, *units, "--speed", 1)) == {*plain, "digits"}
    of_beta = json_of("epsilon", "--beta", "1.307 (s/cm)^(1/5)", "--speed", "10 mm/s", "--digits", 60)
    same = json_of("epsilon", "--beta", "1.307", "--speed", "1", "--digits", 60)  # 10 mm/s is 1 cm/s
    assert of_beta.pop("units") == {"beta": "(s/cm)^(1/5)"}
    assert same.pop("units") == {"beta": "(s/m)^(1/5)"}
    assert of_beta == same
    assert (
        "  beta                   0.2" in called("epsilon", *BALL, "--dissipative-constant", 1e-4, "--speed", 1).stdout
    )


def test_where_the_model_does_not_hold():
    """A material of 10 Pa: it was a compression of 693 radii without a word."""
    words = ("--radius", 0.01, "--density", 2500, "--young-modulus", "10 Pa", "--poisson-ratio", 0.3, "--speed", 1)
    for first in (("epsilon", "--dissipative-constant", 1e-6), ("invert", "--epsilon", "0.9")):
        found = json_of(*first, *words)
        assert [text.split()[1] for text in found["warnings"]] == ["overlap", "1"]
        assert all(f"Warning: {text}." in called(*first, *words).stdout for text in found["warnings"])
    hard = ("--radius", "1 cm", "--density", 2500, "--young-modulus", "70 GPa", "--poisson-ratio", 0.22)
    hard = ("epsilon", *hard, "--dissipative-constant", "1 us", "--speed", "1 m/s")
    assert json_of(*hard)["warnings"] == []
    assert "yield_strength is -1.0: accepted is a number > 0" in called(*hard, "--yield-strength", -1).stderr
    (warning,) = json_of(*hard, "--yield-strength", "1 MPa")["warnings"]
    assert warning.startswith("1 m/s is beyond the ")


def test_invert_with_and_without_a_material():
    assert json_of("invert", "--epsilon", "0.9")["v_star"] == exact.invert("0.9").decimals()["v_star"]
    tiny = json_of("invert", "--one-minus-epsilon", "1e-30", "--digits", 20)
    assert tiny["v_star"].startswith("9.3110965127930")
    whole = json_of("invert", "--epsilon", "0.9", "--speed", 0.5, *BALL, "--digits", 3)
    assert whole["beta"] == exact.invert("0.9", 3, speed="0.5").decimals()["beta"]
    back = json_of("epsilon", *BALL, "--dissipative-constant", whole["dissipative_constant"], "--speed", 0.5)
    assert float(back["epsilon"]) == pytest.approx(0.9, rel=1e-14, abs=0)


def test_claims():
    whole = json_of("claims", "--only", "twenty-terms", "--only", "no-linear-term")
    assert [claim["name"] for claim in whole["claims"]] == ["twenty-terms", "no-linear-term"]
    assert whole["verdicts"] == {"holds": 2}
    text = called("claims", "--only", "twenty-terms").stdout
    assert "verdict:  holds (proven)" in text
    assert text.endswith("\nholds: 1\n")


def test_figures_are_written_and_replaced(tmp_path):
    words = ("figures", "--out", tmp_path / "new", "--only", "localSlope", "--format", "svg", "--format", "png")
    for _ in range(2):
        result = called(*words)
        assert (result.returncode, result.stderr) == (0, "")
    assert {path.name for path in (tmp_path / "new").iterdir()} == {"localSlope.svg", "localSlope.png"}
    (tmp_path / "new" / "localSlope.png").write_bytes(b"somebody's picture")
    result = called(*words)
    assert result.returncode == 2
    assert "was not generated by viscopade" in result.stderr


def test_export_goes_to_stdout_or_to_a_file(tmp_path):
    target = tmp_path / "eps.h"
    words = ("export", "c", "--pade", "3/6", "--pade", "1/4")
    written = called(*words, "-o", target)
    assert (written.returncode, written.stdout, written.stderr) == (0, "", "")
    assert target.read_text() == called(*words).stdout == requests.render("c", [(3, 6), (1, 4)])
    assert "viscopade export c --pade 3/6 --pade 1/4\n" in target.read_text()


def test_a_generated_file_is_replaced(tmp_path):
    for _ in range(2):
        assert called("export", "c", "-o", tmp_path / "eps.h").returncode == 0
    assert [p.name for p in tmp_path.iterdir()] == ["eps.h"]


def test_reproduce_as_json():
    whole = json_of("reproduce")
    assert whole["agreeing"] == len(whole["entries"]) == 32


def test_reproduce_fails_on_a_mismatch_and_writes_nothing(tmp_path, monkeypatch):
    """The comparison can fail: with a digit of the printed table changed, it does."""
    a, b = TABLE[3, 6]
    monkeypatch.setitem(TABLE, (3, 6), (a, (*b[:-1], "0.235586")))
    result = called("reproduce", "--out", tmp_path / "out")
    assert result.returncode == 1
    assert "31 of 32 printed numbers agree" in result.stdout
    assert "NO" in result.stdout
    assert result.stderr == "viscopade: no file is written, because a printed number disagrees\n"
    assert not (tmp_path / "out").exists()


@pytest.mark.parametrize(
    ("arguments", "shown_words"),
    [
        (["coefficients", "--order", "60", "--digits", "60"], "perturbation orders"),
        (["epsilon", "--v-star", "2", "--digits", "100"], "Newton's method"),
        (["claims", "--only", "table-entries"], "claims"),
    ],
)
def test_progress_is_shown_on_a_terminal_only(arguments, shown_words):
    master, slave = pty.openpty()
    words = [*VISCOPADE, *arguments]
    process = subprocess.Popen(words, stdout=subprocess.PIPE, stderr=slave, env=os.environ | {"TERM": "xterm"})
    os.close(slave)
    shown = b""
    while True:
        try:
            part = os.read(master, 4096)
        except OSError:  # the other side is closed
            break
        if not part:
            break
        shown += part
    process.communicate(timeout=HANGS)
    os.close(master)
    assert shown_words.encode() in shown
    plain, forced = called(*arguments), started(*arguments, environment={"FORCE_COLOR": "1"})  # which Jupyter sets
    assert plain.stderr == forced.stderr == ""
    assert plain.stdout == forced.stdout


def test_a_home_that_cannot_be_written_to_is_not_mentioned(tmp_path):
    (tmp_path / "file").write_text("")
    nowhere = dict.fromkeys(("HOME", "XDG_CONFIG_HOME", "XDG_CACHE_HOME"), str(tmp_path / "file" / "home"))
    result = started(
        "figures", "--out", tmp_path / "new", "--only", "localSlope", environment=nowhere | {"MPLCONFIGDIR": ""}
    )
    assert (result.returncode, result.stderr) == (0, "")
    assert (tmp_path / "new" / "localSlope.svg").exists()


def test_output_cut_off_by_the_reader():
    """`viscopade … | head -1` ends quietly."""
    producer = subprocess.Popen(
        [*VISCOPADE, "coefficients", "--order", "20", "--digits", "5"],
        stdout=subprocess.PIPE,
        stderr=subprocess.PIPE,
    )
    assert producer.stdout is not None
    assert producer.stderr is not None
    producer.stdout.close()
    assert producer.stderr.read() == b""
    producer.stderr.close()
    producer.wait(timeout=HANGS)


@pytest.mark.skipif(not os.path.exists("/dev/full"), reason="there is no full disk")
@pytest.mark.parametrize(
    ("arguments", "to", "status", "said"),
    [
        ((), "stdout", 1, b"viscopade: cannot print: "),  # the help
        (("epsilon", "--v-star", "1"), "stdout", 1, b"viscopade: cannot print: "),
        (("epsilon", "--v-star", "1,5"), "stderr", 2, None),
    ],
)
def test_output_to_a_full_disk(arguments, to, status, said):
    """One line, or, where that cannot be printed either, the exit status."""
    streams = {"stdout": subprocess.PIPE, "stderr": subprocess.PIPE}
    with open("/dev/full", "wb") as full:
        ended = subprocess.run([*VISCOPADE, *arguments], **{**streams, to: full})
    assert ended.returncode == status
    if said is not None:
        assert ended.stderr.startswith(said)
        assert ended.stderr.count(b"\n") == 1


@pytest.mark.parametrize("environment", [{"LC_ALL": "C"}, {"PYTHONIOENCODING": "ascii"}, {"COLUMNS": "20"}])
def test_other_environments(environment):
    result = started("reproduce", environment=environment)
    assert result.returncode == 0, result.stderr
    assert "32 of 32" in result.stdout


# --- what is not installed -------------------------------------------------------------------------------------------


@pytest.mark.parametrize(
    ("words", "user", "packages", "extras"),
    [
        (["figures", "--out"], "figures", "matplotlib, which is", "figures"),
        (["bench", "--picture"], "bench --picture", "matplotlib, which is", "figures"),
        (["hardcases", "--out"], "hardcases --out", "matplotlib, which is", "figures"),
        (["plot", "-o"], "plot", "matplotlib, which is", "figures"),
        (["plot", "--data", "data.csv", "-o"], "plot", "matplotlib and scipy, which are", "figures,fit"),
        (["fit", "data.csv", "--scene"], "fit", "scipy, which is", "fit"),
        (["fit", "data.ods", "--plot"], "fit", "scipy and python_calamine and matplotlib, which are", "figures,fit"),
    ],
    ids=["figures", "bench", "hardcases", "plot", "plot-data", "fit", "fit-plot"],
)
def test_what_to_install_is_said_before_any_work(words, user, packages, extras, tmp_path, monkeypatch):
    for package in EXTRAS:
        monkeypatch.setitem(sys.modules, package, None)  # importing it fails, as if it were not there
    for module, work in ((bench, "run"), (hard_cases, "measured"), (figures, "render")):
        monkeypatch.setattr(module, work, lambda *_, **__: print("computed"))
    result = called(*words, tmp_path / "new")
    assert (result.returncode, result.stdout) == (2, "")
    assert result.stderr.startswith(f"viscopade: {user} needs {packages} not installed")
    assert result.stderr.endswith(f"{sys.executable} -m pip install 'viscopade[{extras}]'\n")
    assert result.stderr.count("\n") == 1
    assert not list(tmp_path.iterdir())


def test_public_functions_say_what_to_install(monkeypatch):
    points = Points.measured([0.1, 0.3, 1, 3], [0.938, 0.918, 0.901, 0.874])
    monkeypatch.setitem(sys.modules, "scipy", None)
    for call in (lambda: fit(points), lambda: Points.measured([0.1], [0.9])):
        with pytest.raises(ModuleNotFoundError, match=r"needs scipy, which is .*-m pip install 'viscopade\[fit\]'$"):
            call()


def test_extras_bring_what_they_are_said_to():
    project = tomllib.loads((Path(__file__).parents[2] / "pyproject.toml").read_text("utf-8"))["project"]
    for package, extra in EXTRAS.items():
        brought = project["optional-dependencies"][extra]
        assert any(line.startswith(f"{package.replace('_', '-')}>=") for line in brought), package


# --- what is refused ----------------------------------------------------------------------------------------------

BAD = [
    (["coefficients", "--order", "-1"], "order is -1: accepted is an integer from 0 to 1000"),
    (["coefficients", "--order", "2.5"], "order is '2.5': accepted is an integer from 0 to 1000"),
    (["coefficients", "--order", "1" * 5000], "accepted is an integer from 0 to 1000"),
    (["coefficients", "--digits", "0"], "digits is 0: accepted is an integer from 1 to 5000"),
    (["coefficients", "--digits", "1000000"], "digits is 1000000: accepted is an integer from 1 to 5000"),
    (["coefficients", "--digits", "٣"], "accepted is an integer"),
    (["coefficients", "--digits", ""], "accepted is an integer"),
    (["coefficients", "--format", "xml"], "'xml' is not one of 'text', 'json', 'csv', 'latex'"),
    (["coefficients", "extra"], "extra"),
    (["pade", "-1", "3"], "m is -1: accepted is an integer from 0 to 200"),
    (["pade", "3", "-6"], "n is -6: accepted is an integer from 0 to 200"),
    (["pade", "three", "6"], "m is 'three': accepted is an integer from 0 to 200"),
    (["pade", "3", "1e3"], "n is '1e3'"),
    (["pade"], "Missing argument 'M'"),
    (["pade", "3", "--law", "hertz"], "law is 'hertz': accepted is viscoelastic, linear, tsuji, hunt-crossley[:n]"),
    (
        ["coefficients", "--law", "1.37,0.1"],
        "the exponents 137/100,1/10 have too large denominators: accepted are a, b",
    ),
    (["coefficients", "--end", "top"], "'top' is not one of 'force', 'return'"),
    (["epsilon", "--law", "linear", "--end", "return", "--kappa", "2"], "accepted is a smaller kappa, or end 'force'"),
    (["invert", "--law", "tsuji", "--end", "return", "--epsilon", "1e-30"], "accepted is a larger epsilon, or end"),
    (
        ["epsilon", "--law", "hunt-crossley:1", "--beta", "1 s/m", "--speed", "1"],
        "beta is '1 s/m': accepted is a plain",
    ),
    (["epsilon", "--law", "linear", "--beta", "1 s", "--speed", "1"], "accepted is a plain number, for the law 1,0"),
    (["epsilon", "--kappa", "1", "--v-star", "1"], "the options do not give one v*: accepted is --v-star, --kappa"),
    (["epsilon", "--law", "1,-1", "--kappa", "1"], "b is '-1': accepted is a rational number such as 3/2 or 0.25"),
    (["epsilon", *BALL, "--dissipative-constant", "1", "--speed", "1", "--law", "tsuji"], "and none of --v-star"),
    (
        ["invert", "--epsilon", "0.5", *BALL, "--speed", "1", "--law", "tsuji"],
        "accepted with it is the law viscoelastic",
    ),
    (["pade", "1", "3"], "[1/3] does not exist"),
    (["pade", "3", "6", "--digits", "-5"], "digits is -5"),
    (["epsilon"], "accepted is --v-star, --kappa, --beta with --speed, or a material with --speed"),
    (["epsilon", "--v-star", "-1"], "v_star is '-1': accepted is 0, infinity, or a number from 1e-1000 to 1e100"),
    (["epsilon", "--v-star", "one"], "v_star is 'one'"),
    (["epsilon", "--v-star", "nan"], "v_star is 'nan'"),
    (["epsilon", "--v-star", "1e300"], "v_star is '1e300'"),
    (["epsilon", "--v-star", "1" * 30000], "v_star is '1111"),
    (["epsilon", "--v-star", "1", "--digits", "5001"], "digits is 5001"),
    (["epsilon", "--v-star", "1", "--speed", "1"], "the options do not give one v*: accepted is --v-star"),
    (["epsilon", "--beta", "1", "--speed", "-1"], "speed is '-1'"),
    (["epsilon", "--radius", "1", "--speed", "1"], "a material also needs --young-modulus, --poisson-ratio, --density"),
    (["epsilon", "--wall", "--v-star", "1"], "a material also needs"),
    (["epsilon", *BALL, "--dissipative-constant", "1e-5"], "a material is given: accepted with it is --speed"),
    (["epsilon", *BALL, "--dissipative-constant", "-1", "--speed", "1"], "dissipative_constant is -1.0"),
    (["epsilon", *BALL, "--dissipative-constant", "1", "--speed", "1", "--digits", "30"], "none of --v-star"),
    (["epsilon", *BALL, "--dissipative-constant", "1", "--speed", "x"], "speed is 'x'"),
    (["invert"], "--epsilon and --one-minus-epsilon: neither given, accepted is exactly one"),
    (["invert", "--epsilon", "0"], "epsilon is '0': accepted is 1, or a number from 1e-330 to 1 - 1e-1990"),
    (["invert", "--epsilon", "1.01"], "epsilon is '1.01'"),
    (["invert", "--epsilon", "-0.5"], "epsilon is '-0.5'"),
    (["invert", "--epsilon", "0.5", "--one-minus-epsilon", "0.5"], "accepted is exactly one"),
    (["invert", "--epsilon", "0.5", "--speed", "0"], "speed is '0'"),
    (["invert", "--epsilon", "0.5", *BALL], "a material also needs --speed"),
    (["claims", "--only", "everything"], "there is no claim 'everything': accepted are"),
    (["figures"], "Missing option '--out'"),
    (["figures", "--out", "x", "--only", "nothing"], "'nothing' is not one of 'seriesDiverging'"),
    (["figures", "--out", "x", "--end", "return"], "accepted is --end with --law"),
    (["figures", "--out", "x", "--law", "1,1", "--only", "audit"], "accepted is one of them"),
    (["figures", "--out", "x", "--law", "nothing"], "law is 'nothing': accepted is viscoelastic"),
    (["figures", "--out", "x", "--format", "gif"], "'gif' is not one of 'svg', 'pdf', 'png'"),
    (["export", "cobol"], "'cobol' is not one of 'c', 'python', 'cuda', 'glsl', 'wgsl'"),
    (["export", "c", "--pade", "3-6"], "degrees are '3-6': accepted is M/N"),
    (["export", "c", "--pade", "-3/6"], "accepted is M/N"),
    (["export", "c", "--pade", "300/1"], "accepted is M/N"),
    (["export", "c", "--pade", "1/1"], "[1/1] does not exist"),
    (["export", "c", "--pade", "0/1"], "pade is 0/1: accepted is m + n >= 2"),
    (["export", "c", "--pade", "3/6", "--pade", "3/6"], "asked for twice"),
    (["export", "c", "--minimax", "1/4"], "minimax is given without an interval: accepted is minimax with v_star_max"),
    (
        ["export", "c", "--v-star-max", "5"],
        "v_star_max is given without minimax or accuracy: accepted is v_star_max with minimax or accuracy (--minimax, ",
    ),
    (["export", "c", "--minimax", "1/4", "--v-star-max", "-3"], "accepted is a number greater than v_star_min = 0"),
    (["export", "c", "--minimax", "1/4", "--v-star-max", "nan"], "accepted is a number greater than v_star_min = 0"),
    (
        ["export", "c", "--minimax", "1/4", "--v-star-max", "1e9"],
        "accepted is a number greater than v_star_min = 0, at",
    ),
    (["export", "c", "--minimax", "1/4", "--v-star-min", "3", "--v-star-max", "2"], "greater than v_star_min = 3"),
    (
        ["export", "c", "--minimax", "1/1", "--v-star-max", "1"],
        "accepted is at least",
    ),
    (["export", "c", "--minimax", "1/40", "--v-star-max", "1"], "n is 40: accepted is an integer from 0 to 15"),
    (["export", "c", "--minimax", "2/0", "--v-star-max", "1000"], "100 % is 1): accepted are degrees and intervals"),
    (["export", "c", "--accuracy", "1e-17", "--v-star-max", "5"], "accepted is a number from 1e-15 to 0.99"),
    (["export", "c", "--accuracy", "abc", "--v-star-max", "5"], "accepted is a number from 1e-15 to 0.99"),
    (["export", "c", "--accuracy", "1e-12", "--v-star-max", "1000"], "or a shorter interval"),
    (["export", "c", "--minimax", "3/6", "--v-star-max", "5", "--measure", "relative"], "accepted are other degrees"),
    (
        ["export", "rust", "--law", "4,1/3", "--accuracy", "1e-3", "--kappa-max", "2"],
        "the law 4,1/3 needs a degree of at least 11, which no [m/n] tried for an accuracy has: accepted is a law with",
    ),
    (
        ["export", "c", "--law", "4,0", "--accuracy", "1e-3", "--kappa-max", "inf"],
        "accepted is a finite end of the interval",
    ),
    (["export", "python", "--full"], "accepted for kernels of full accuracy is c"),
    (["export", "python", "--from-speed", "1e-3"], "accepted for kernels of speed is c"),
    (["export", "c", "--from-speed", "1e-6"], "'1e-6' is not one of '1e-3', '1e-5', '1e-7', '1e-10', 'full'"),
    (
        ["export", "c", "--from-speed", "1e-3", "--from-speed", "1e-5"],
        "accepted is one accuracy, as a file holds one kernel",
    ),
    (["export", "c", "--from-speed", "1e-3", "--size", "small"], "asked for is 1e-3 (small): accepted are 1e-3 (fast)"),
    (["export", "c", "--from-speed", "full", "--size", "small"], "asked for is full (small): accepted are"),
    (["export", "c", "--size", "small"], "size is given without from_speed: accepted is size with from_speed"),
    (["export", "c", "--from-speed", "1e-3", "--full"], "accepted is one kind of kernels in a file"),
    (["export", "c", "--full", "--pade", "3/6"], "accepted is one kind of kernels in a file"),
    (["export", "c", "--accuracy", "1e-3", "--pade", "3/6"], "accepted is one kind of kernels in a file"),
    (["export", "latex", "--accuracy", "1e-3"], "accepted for half-line and inverse kernels is c, python, cuda, glsl"),
    (["export", "c", "--accuracy", "1e-9"], "accepted is a number >"),
    (["export", "c", "--inverse", "1e-14"], "accepted is a number >"),
    (["export", "c", "--inverse", "1e-5", "--epsilon-min", "2"], "accepted is 0, or a number from 2e-4 to 0.99"),
    (["export", "c", "--epsilon-min", "0.5"], "accepted is epsilon_min with inverse (--inverse)"),
    (
        ["export", "c", "--accuracy", "1e-3", "--v-star-min", "1"],
        "accepted is an interval with both ends (--v-star-max)",
    ),
    *(
        (["export", "c", *kind, "--measure", "relative"], "measure is given without minimax or accuracy: accepted is")
        for kind in ([], ["--pade", "3/6"], ["--inverse", "1e-3"], ["--full"], ["--from-speed", "1e-3"])
    ),
    *(
        (["export", target, *words], f"{words[0]} changes nothing in {target}: accepted with it{accepted}")
        for target, words, accepted in (
            ("version-header", ["--accuracy", "1e-3"], ": --output"),
            ("version-header", ["--from-speed", "1e-3"], ": --output"),
            ("version-header", ["--digits", "50"], ": --output"),
            ("series-json", ["--accuracy", "1e-3"], ": --order, --digits, --output"),
            ("series-csv", ["--full"], ": --order, --digits, --output"),
            ("c", ["--digits", "40"], ": --pade, --minimax, --accuracy"),
            ("vectors", ["--order", "40"], ": --pade, --minimax, --accuracy"),
        )
    ),
    (["scene"], "accepted is a scene: either FILE, or --example NAME"),
    (["scene", "x.toml", "--example", "ice_rings"], "accepted is a scene: either FILE, or --example NAME"),
    (
        ["scene", "--example", "../x"],
        "there is no example scene '../x': accepted are acetate, boulders, glass_beads, ice_",
    ),
    (["nonsense"], "No such command 'nonsense'"),
    (["--nonsense"], "No such option"),
]


@pytest.mark.parametrize(
    ("words", "message"), BAD, ids=lambda x: " ".join(map(str, x))[:60] if isinstance(x, list) else ""
)
def test_bad_input_is_one_line_and_status_two(words, message):
    result = called(*words)
    assert result.returncode == 2
    assert result.stdout == ""
    assert result.stderr.startswith("viscopade: ")
    assert result.stderr.count("\n") == 1
    assert message in result.stderr
    assert len(result.stderr) < 5300


@pytest.mark.parametrize(
    "words", [(), ("--help",), ("pade", "1", "4"), ("pade", "1", "3"), ("epsilon", "--v-star", "1,5")]
)
def test_a_process_of_its_own_prints_the_same(words):
    here, there = called(*words, environment={"COLUMNS": "80"}), started(*words, environment={"COLUMNS": "80"})
    assert (here.returncode, here.stdout, here.stderr) == (there.returncode, there.stdout, there.stderr)


def test_no_command_shows_the_help():
    result = called()
    assert result.returncode == 2
    assert "Commands:" in result.stdout + result.stderr


def test_a_file_that_is_not_ours_is_left_alone(tmp_path):
    for words in (["export", "c", "-o", tmp_path / "viscopade_pade.h"], ["reproduce", "--out", tmp_path]):
        (tmp_path / "viscopade_pade.h").write_text("somebody's work\n")
        result = called(*words)
        assert result.returncode == 2
        assert "was not generated by viscopade" in result.stderr
        assert {p.name: p.read_text() for p in tmp_path.iterdir()} == {"viscopade_pade.h": "somebody's work\n"}


def test_where_nothing_can_be_written(tmp_path):
    (tmp_path / "file").write_text("")
    for target in (tmp_path, tmp_path / "missing" / "x.h", tmp_path / "file" / "x.h", tmp_path / "file" / "y" / "x.h"):
        result = called("export", "c", "-o", target)
        assert result.returncode == 2
        assert result.stderr.count("\n") == 1
        assert result.stderr.startswith("viscopade: ")
    result = called("reproduce", "--out", tmp_path / "file")
    assert result.returncode == 2
    assert [p.name for p in tmp_path.iterdir()] == ["file"]


@pytest.mark.skipif(os.geteuid() == 0, reason="root may write everywhere")
def test_unwritable_directory(tmp_path):
    tmp_path.chmod(0o500)
    result = called("export", "c", "-o", tmp_path / "x.h")
    assert result.returncode == 2
    assert list(tmp_path.iterdir()) == []


def test_pade_proves_its_error_up_to_a_v_star():
    words = ["pade", "2", "--law", "hunt-crossley", "--digits", "8", "--v-star-max", "1"]
    bound = json_of(*words)["proven_error"]
    assert 1.8e-4 < float(bound) < 2e-4
    assert f"proven: |[2/3] - eps| <= {bound} min(eps, 1 - eps) for 0 <= v* <= 1" in called(*words).stdout


SOFT = ["simulators", "mujoco", "--epsilon", "0.5", "--speed", "1", "--stiffness", "1000", "--mass", "1"]


@pytest.mark.parametrize(
    ("words", "flags"), [(["export", "c"], ("-o", "--output")), (SOFT, ("-o", "--output")), (["calculator"], ["--out"])]
)
def test_a_minus_is_the_standard_output(words, flags, tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    found = [called(*words, *more) for more in ([], *([flag, "-"] for flag in flags))]
    assert {(ran.returncode, ran.stderr) for ran in found} == {(0, "")}
    assert len({ran.stdout for ran in found}) == 1
    assert not list(tmp_path.iterdir())


@pytest.mark.parametrize("name", ["mine.h", "locked/x.h"])
def test_a_file_that_cannot_be_written_is_refused_before_the_work(name, tmp_path, monkeypatch):
    (tmp_path / "mine.h").write_text("mine")
    (tmp_path / "locked").mkdir()
    may = os.access
    monkeypatch.setattr(os, "access", lambda path, mode: Path(path).name != "locked" and may(path, mode))
    monkeypatch.setattr(requests.Request, "render", lambda *_: pytest.fail("it was made"))
    ran = called("export", "c", "--pade", "100/100", "-o", tmp_path / name)
    assert (ran.returncode, ran.stdout, ran.stderr.count("\n")) == (2, "", 1)
    assert name in ran.stderr
