"""The command line as a user meets it: output shapes, exit codes, one-line errors, nothing half-written.

Most commands are called in this process; those whose streams, environment or imports matter get one of their own.
"""

import csv
import io
import math
import re
import shlex
from pathlib import Path
from xml.etree import ElementTree

import click
import pytest
from mpmath import mp

from tests.cli import called, json_of, printed, said
from viscopade import Pair, Sphere, pade, series
from viscopade.cli import console
from viscopade.cli.console import figures
from viscopade.cli.main import command
from viscopade.collision import exact
from viscopade.collision.contact import Contact
from viscopade.kernels.catalogue import Request
from viscopade.kernels.requests import render
from viscopade.theory.law import ENDS, law_of

# --- what is printed ----------------------------------------------------------------------------------------------


def test_every_command_that_prints_results_has_all_formats():
    for name in command.list_commands(click.Context(command)):
        one = command.get_command(click.Context(command), name)
        styles = [option.type.choices for option in one.params if option.name == "style"]
        further = ("latex",) if name in ("coefficients", "table") else ()
        assert styles in ([], [("text", "json", "csv", *further)]) or name == "figures"


PAPER_LAW = {"law": "3/2,1/2", "end": "force", "nu": "5/3", "d": 2}


def test_coefficients_json_has_the_shape_of_the_design():
    whole = json_of("coefficients", "--order", 60, "--digits", 50)
    assert set(whole) == {"order", "digits", "law", "end", "nu", "d", "h"}
    assert (whole["order"], whole["digits"], len(whole["h"])) == (60, 50, 61)
    assert whole["h"] == list(series(60, 50).decimals())


def test_coefficients_csv():
    rows = list(csv.reader(io.StringIO(printed("coefficients", "--order", 4, "--digits", 8, "--format", "csv"))))
    assert rows == [["k", "h_k"], ["0", "1"], ["1", "0"], ["2", "-1.1534489"], ["3", "0"], ["4", "0.79826656"]]


def test_coefficients_as_rows_of_latex():
    rows = [r"$0$ & $1$ \\", r"$1$ & $0$ \\", r"$2$ & $-1.15345$ \\"]
    heads = [r"\begin{tabular}{rr}", r"$k$ & $h_k$ \\", r"\hline"]
    words = ("coefficients", "--order", 2, "--format", "latex")
    assert printed(*words).splitlines() == [*heads, *rows, r"\end{tabular}"]
    assert r"$2$ & $-1.15344886$ \\" in printed(*words, "--digits", 9)
    law = printed(*words, "--law", "linear").splitlines()[-1]
    assert law.startswith("% law 1,0: x'' + x + kappa x' = 0")


def test_polynomials_in_latex_and_their_closed_forms():
    """The closed forms as they are printed, evaluated, are the lambdas."""
    words = ("coefficients", "--order", 6, "--symbolic", "--digits", 9)
    lines = printed(*words, "--format", "latex").splitlines()
    equations = lines[lines.index(r"\begin{align*}") + 1 : lines.index(r"\end{align*}")]
    assert equations[-2:] == [
        r"h_{5} &= \frac{4}{15} = 0.266666667 \\",
        r"h_{6} &= - \frac{169 \lambda_{1}^{3}}{600} - \lambda_{3} = -0.522882568",
    ]
    forms = re.findall(r"(lambda_[13]) = (\S*(?: \(4/5\)\S+)? B\(.*?\)(?: - lambda_1\^3/600)?)", said(*words))
    assert [name for name, _ in forms] == ["lambda_1", "lambda_3"]
    found = {"B": mp.beta}
    for (name, form), value in zip(forms, ("1.15344886", "0.0906370642"), strict=True):
        found[name] = eval(form.replace("^", "**").replace(" (", " * (").replace(" B", " * B"), found)
        assert mp.nstr(found[name], 9) == value
        assert rf"\{name[:7]}{{{name[7:]}}} &= {value} \\" in equations
    assert "B(" not in printed(*words, "--law", "linear")


def test_epsilon_has_approximants_and_their_errors():
    """The errors were also found by an independent integration: 1.97e-8, 2.60e-4 and 2.18e-2."""
    for v_star, error in (("0.3", 1.97106e-8), ("1", 2.598669e-4), ("3", 2.17821e-2)):
        found = json_of("epsilon", "--v-star", v_star, "--pade", "3/6", "--pade", "1/4", "--digits", 12)
        assert float(found["error of [3/6]"]) == pytest.approx(error, rel=1e-5)
        with mp.workdps(40):
            p = pade(1, 4, 40)
            a, b = ([mp.mpf(c) for c in reversed(row)] for row in p.decimals())
            value = mp.polyval(a, mp.mpf(v_star)) / mp.polyval(b, mp.mpf(v_star))
            expected = value, value / exact.epsilon(v_star, 40) - 1
            for name, number in zip(("[1/4]", "error of [1/4]"), expected, strict=True):
                assert mp.mpf(found[name]) == mp.mpf(mp.nstr(number, 12))
    tiny = json_of("epsilon", "--v-star", "1e-9", "--pade", "3/6")  # v*^10 times the first coefficient
    assert float(tiny["error of [3/6]"]) == pytest.approx(float(pade(3, 6).next_term.mid()) * -1e-90, rel=1e-8)
    assert json_of("epsilon", "--v-star", "0", "--pade", "3/6")["error of [3/6]"] == "0"
    of_beta = ("--beta", "1.307 (s/cm)^(1/5)", "--speed", "1 cm/s", "--pade", "3/6")
    assert float(json_of("epsilon", *of_beta)["error of [3/6]"]) == pytest.approx(5.5961e-4, rel=1e-4)


def test_a_table_in_latex_has_formulas_and_escapes(capsys):
    cells = [("0.1", "1.2e-20"), ("-3.40e+06", "50 % of a_b & {c} \\ ~^$#"), ("", "eps")]
    console.show("latex", ("v*", "[3/6]"), cells, {})
    lines = capsys.readouterr().out.splitlines()
    assert lines[1] == r"$v_\ast$ & [3/6] \\"
    assert lines[3:-1] == [
        r"$0.1$ & $1.2\times10^{-20}$ \\",
        r"$-3.40\times10^{6}$ & 50 \% of a\_b \& \{c\} \textbackslash{} \textasciitilde{}\textasciicircum{}\$\# \\",
        r" & $\varepsilon$ \\",
    ]


def test_table_in_latex_has_the_numbers_of_the_text():
    words = ("table", *BALL, "--dissipative-constant", "4e-5", "--pade", "3/6", "--points", "3")
    number = r"-?[0-9.]+(?:e-?[0-9]+)?"
    text = re.findall(rf"^  ({number}.*)$", printed(*words), re.MULTILINE)
    rows = re.findall(r"^(\$.*) \\\\$", printed(*words, "--format", "latex"), re.MULTILINE)
    plain = [re.sub(r"\\times10\^\{(-?\d+)\}", r"e\1", row).replace("$", "").split(" & ") for row in rows]
    assert [[float(cell) for cell in row] for row in plain] == [[float(cell) for cell in row.split()] for row in text]
    assert "\n% Warning: " in printed(*words, "--to", "1 km/s", "--format", "latex")


def test_a_table_may_have_even_steps_and_digits():
    words = ("table", "--beta", "0.1182545", "--from", "0.5", "--to", "5", "--speed-axis", "linear")
    assert json_of(*words)["speed"] == pytest.approx([0.5 + 0.45 * i for i in range(11)])
    rows = printed(*words, "--points", 4, "--digits", 3, "--format", "latex").splitlines()[3:7]
    assert rows == [
        rf"${v}$ & ${e}$ \\" for v, e in (("0.500", "0.890"), ("2.00", "0.858"), ("3.50", "0.843"), ("5.00", "0.833"))
    ]


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
    text = called("pade", 7, 10, "--digits", 15).stdout
    assert "a zero at v* = 0.279952 and a pole at v* = 0.279952" in text
    assert "Froissart doublet" in text


BALL = ("--radius", 0.01, "--density", 2500, "--young-modulus", 1e7, "--poisson-ratio", 0.3)


def test_text_has_six_digits_or_those_asked_for():
    """Where a person reads; JSON and CSV have 30 digits, or all of a double."""
    words = ("epsilon", "--v-star", "1.5")
    assert "epsilon             0.186490\n" in printed(*words)
    assert "epsilon             0.1864896747317786\n" in printed(*words, "--digits", 16)
    assert "epsilon,0.186489674731778582393261094922\n" in printed(*words, "--format", "csv")
    text = printed("pade", "1/4")
    assert "a      1   0.501086\n" in text
    assert "pole   4   -0.754874            1.06541\n" in text
    assert "eps - [1/4] = -0.0823398 v*^6" in text
    assert "2   -1.15345\n" in printed("coefficients", "--order", 2)
    assert "h_2 = lambda_1^2/2 + 1/2 = 1.73370\n" in printed(
        "coefficients", "--order", 2, "--law", "linear", "--symbolic"
    )
    words = ("epsilon", *BALL, "--dissipative-constant", 4e-5, "--speed", 0.5)
    whole = json_of(*words)
    eps, a = (float(whole[name]) for name in ("epsilon", "dissipative_constant"))
    assert f"epsilon                {eps:.6g}\n" in printed(*words)
    assert f"epsilon                {eps!r}\n" in printed(*words, "--digits", 17)
    assert a == 4e-5
    assert "dissipative_constant   4e-5 " in printed(*words, "--digits", 1)


@pytest.mark.parametrize(
    ("text", "digits", "shown"),
    [
        ("0.0928381064", 3, "0.0928"),
        ("1.1566967733126489e-06", 5, "1.1567e-6"),
        ("9.9996e-06", 4, "1.000e-5"),
        ("-123456.789", 6, "-123457"),
        ("1234567.8", 6, "1.23457e+6"),
        ("1e-1000", 6, "1e-1000"),
        ("1e-06", 6, "1e-6"),
        ("100000000000000000000", 21, "100000000000000000000"),
        ("80000.0", 6, "80000.0"),
        ("0.5", 6, "0.5"),
        ("inf", 1, "inf"),
        ("", 1, ""),
        ("yes", 1, "yes"),
    ],
)
def test_figures(text, digits, shown):
    assert figures(text, digits) == shown


def test_errors_of_high_degrees_have_enough_digits():
    """p(1)/eps(1) - 1 of [45/48] by mpmath, from 60 digits of both, is beyond the 30 digits of low degrees."""
    with mp.workdps(60):
        a, b = (sum(map(mp.mpf, side)) for side in pade(45, 48, 60).decimals())
        expected = a / b / mp.mpf(str(exact.epsilon(1, 60))) - 1
    (first, *_) = json_of("pade", 45, 48, "--digits", 8)["errors"]
    assert first == {"v_star": 1, "relative": pytest.approx(float(expected), rel=1e-3)}


def test_epsilon_json_has_the_shape_of_the_design():
    whole = json_of("epsilon", "--v-star", "1.5", "--digits", 40)
    assert set(whole) == {*PAPER_LAW, "digits", "v_star", "epsilon", "one_minus_epsilon", "x_max", "tau_c"}
    assert whole == {"digits": 40, **PAPER_LAW, **exact.collision("1.5", 40).decimals()}


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
    material = ("--radius", "1", "--density", "1", "--young-modulus", "1", "--poisson-ratio", "0")
    for words in (
        ("coefficients", "--order", "2"),
        ("pade", "1", "4"),
        ("invert", "--epsilon", "0.5"),
        ("invert", "--epsilon", "0.5", "--speed", "1", *material),
        ("epsilon", "--speed", "1", *material, "--dissipative-constant", "1"),
    ):
        assert json_of(*words).items() >= PAPER_LAW.items()


@pytest.mark.parametrize("end", ENDS)
@pytest.mark.parametrize("law", ["linear", "tsuji", "hunt-crossley", "viscoelastic", "3/2,0"])
def test_damping_in_units(law, end):
    """A collision with the printed c, integrated in SI units, has the eps, the depth and the duration; and back."""
    of = ("--law", law, "--end", end, "--stiffness", "5e4", "--mass", "10.9", "--speed", "2.8")
    found = json_of("invert", "--epsilon", "0.6", "--digits", 10, *of)
    a, b, c = float(law_of(law).elastic), float(law_of(law).damping), float(found["damping"])
    run = Contact(lambda x, v: 5e4 * x**a + c * x**b * v, mass=10.9, end=end).collide(2.8)
    assert run.epsilon == pytest.approx(0.6, rel=1e-9)
    printed = float(found["max_compression"]), float(found["contact_time"])
    assert (run.depth, run.duration) == pytest.approx(printed, rel=1e-9)
    back = json_of("epsilon", "--damping", found["damping"], *of)
    assert float(back["epsilon"]) == pytest.approx(0.6, rel=1e-12)
    assert float(back["damping"]) == pytest.approx(c, rel=1e-14)


def test_a_linear_contact_in_units_needs_no_speed():
    """c = 2 zeta sqrt(k m) with the zeta of textbooks, and half a period of the damped oscillation."""
    of = ("--law", "linear", "--end", "return", "--stiffness", "50 N/mm", "--mass", "10900 g")
    found = json_of("invert", "--epsilon", "0.5", "--digits", 15, *of)
    decay, omega = math.log(2) / math.hypot(math.pi, math.log(2)), math.sqrt(5e4 / 10.9)
    assert float(found["damping"]) == pytest.approx(2 * decay * omega * 10.9, rel=1e-14)
    assert float(found["contact_time"]) == pytest.approx(math.pi / omega / math.sqrt(1 - decay**2), rel=1e-14)
    assert "max_compression" not in found


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
    assert same["epsilon"] == exact.collision(beta="1.307", speed="1", digits=60).decimals()["epsilon"]
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
        assert all(f"Warning: {text}." in said(*first, *words) for text in found["warnings"])
    hard = ("--radius", "1 cm", "--density", 2500, "--young-modulus", "70 GPa", "--poisson-ratio", 0.22)
    hard = ("epsilon", *hard, "--dissipative-constant", "1 us", "--speed", "1 m/s")
    assert json_of(*hard)["warnings"] == []
    assert "--yield-strength is -1.0: expected a number > 0" in called(*hard, "--yield-strength", -1).stderr
    (warning,) = json_of(*hard, "--yield-strength", "1 MPa")["warnings"]
    assert warning.startswith("1 m/s is beyond the ")
    across = ("table", *hard[1:-2], "--to", "1 m/s", "--yield-strength", "1 MPa")
    assert json_of(*across)["warnings"] == [warning]
    assert f"Warning: {warning}." in said(*across)


def test_invert_with_and_without_a_material():
    assert json_of("invert", "--epsilon", "0.9")["v_star"] == exact.invert("0.9").decimals()["v_star"]
    tiny = json_of("invert", "--one-minus-epsilon", "1e-30", "--digits", 20)
    assert tiny["v_star"].startswith("9.3110965127930")
    whole = json_of("invert", "--epsilon", "0.9", "--speed", 0.5, *BALL, "--digits", 3)
    assert whole["beta"] == exact.invert("0.9", 3, speed="0.5").decimals()["beta"]
    back = json_of("epsilon", *BALL, "--dissipative-constant", whole["dissipative_constant"], "--speed", 0.5)
    assert float(back["epsilon"]) == pytest.approx(0.9, rel=1e-14, abs=0)


def test_epsilon_takes_the_damping_from_an_eps_at_a_speed():
    """As `plot` and `table` do: the collision is the one that `invert` has."""
    spring = ("--law", "linear", "--stiffness", "1e5", "--mass", "0.1")
    for more in ((), BALL, (*BALL, "--wall", "--gravity", 9.81), spring):
        words = ("--epsilon", "0.9", "--speed", "0.5", *more)
        assert json_of("epsilon", *words) == json_of("invert", *words)
    assert printed("epsilon", "--epsilon", "0.9", "--speed", 1) == printed("invert", "--epsilon", "0.9", "--speed", 1)


def test_numbers_that_are_not_proven_are_marked():
    """Of a material A and the SI units are doubles; with weight more of them, and eps is sampled."""

    def kinds(*words):
        """Return the number's name and the words at the end of each row, in the order of the rows."""
        rows = re.findall(r"^  (\w+) .*  (proven|in double precision|sampled)$", printed(*words), re.MULTILINE)
        return dict(rows)

    words = ("invert", "--epsilon", "0.9", "--speed", 0.5, *BALL)
    of_speed = dict.fromkeys(("v_star", "epsilon", "one_minus_epsilon", "x_max", "tau_c", "beta"), "proven")
    of_body = dict.fromkeys(("dissipative_constant", "max_compression", "contact_time"), "in double precision")
    assert kinds(*words) == of_speed | of_body
    with_weight = kinds(*words, "--wall", "--gravity", 9.81)
    assert [with_weight[name] for name in ("v_star", "epsilon", "contact_time", "epsilon_without_weight")] == [
        "in double precision",
        "sampled",
        "sampled",
        "in double precision",
    ]
    forced = kinds("invert", "--law", "linear", "--epsilon", "0.5", "--stiffness", "1e5", "--mass", "0.1")
    assert (forced["kappa"], forced["damping"]) == ("proven", "in double precision")
    assert kinds("invert", "--epsilon", "0.9") == {}
    material = ("epsilon", *BALL, "--dissipative-constant", 4e-5, "--speed", 0.5)
    assert "\nAll numbers are in double precision.\n" in printed(*material)
    assert printed(*words, "--format", "csv").startswith("quantity,value,unit\n")


def test_weight():
    """With a load in the scaled equation, or with gravity for a sphere and a wall; and the damping for it."""
    whole = json_of("epsilon", "--law", "linear", "--kappa", "0.5105512753", "--load", "0.1")
    assert (whole["status"], whole["parts"]) == ("sampled", True)
    assert float(whole["epsilon"]) == pytest.approx(0.4114, abs=1e-4)
    assert float(whole["epsilon_without_load"]) == pytest.approx(0.5, abs=1e-9)
    assert whole["errors"]["epsilon"] < 1e-11
    assert json_of("epsilon", "--law", "linear", "--kappa", "0.5105512753", "--load", "0.1", "--digits", 2) == whole
    back = json_of("invert", "--law", "linear", "--epsilon", whole["epsilon"], "--load", "0.1")
    assert float(back["kappa"]) == pytest.approx(0.5105512753, rel=1e-9)
    words = (*BALL, "--speed", 0.1, "--wall", "--gravity", "981 cm/s^2")
    fallen = json_of("epsilon", *words, "--dissipative-constant", 4e-4)
    ball, wall = (
        {"young_modulus": 1e7, "poisson_ratio": 0.3, "dissipative_constant": 4e-4} | more
        for more in ({"radius": 0.01, "density": 2500}, {})
    )
    pair = Pair(Sphere(**ball), Sphere.wall(**wall))
    assert float(fallen["epsilon"]) == pytest.approx(pair.epsilon(0.1, gravity=9.81), rel=1e-11)
    assert float(fallen["epsilon_without_weight"]) == pytest.approx(pair.epsilon(0.1), rel=1e-11)
    again = json_of("invert", *words, "--epsilon", fallen["epsilon"])
    assert float(again["dissipative_constant"]) == pytest.approx(4e-4, rel=1e-9)
    drop = ("--law", "linear", "--end", "return", "--stiffness", 5e4, "--mass", 10.9, "--gravity", 9.81)
    c = json_of("invert", *drop[:-2], "--epsilon", 0.5)["damping"]
    dropped = [json_of("epsilon", *drop, "--damping", c, "--speed", speed) for speed in (2.8, 0.2)]
    assert [float(each["epsilon"]) for each in dropped] == pytest.approx([0.4644, 0], abs=1e-4)
    assert [each["parts"] for each in dropped] == [True, False]
    c = json_of("invert", *drop, "--epsilon", 0.5, "--speed", 2.8)["damping"]
    assert float(json_of("epsilon", *drop, "--damping", c, "--speed", 2.8)["epsilon"]) == pytest.approx(0.5, rel=1e-9)
    down = called("epsilon", "--kappa", 1, "--load", 5).stdout
    assert "with the weight the bodies do not part, eps is 0; without it eps is 0.393931" in down


def test_claims():
    whole = json_of("claims", "--only", "twenty-terms", "--only", "no-linear-term")
    assert [claim["name"] for claim in whole["claims"]] == ["twenty-terms", "no-linear-term"]
    assert whole["verdicts"] == {"holds": 2}
    both = ("claims", "--only", "twenty-terms", "--only", "older-coefficients")
    text = called(*both).stdout
    assert "verdict:  holds (proven)" in text
    assert text.endswith("\nthe paper's own statements: holds 1\n")  # the other one is of older work
    false = called(*both, "--verdict", "does not hold").stdout
    assert "older-coefficients" in false
    assert "twenty-terms" not in false


def test_figures_are_written_and_replaced(tmp_path):
    words = ("figures", "--out", tmp_path / "new", "--only", "local-exponent", "--format", "svg", "--format", "png")
    for _ in range(2):
        result = called(*words)
        assert (result.returncode, result.stderr) == (0, "")
    assert {path.name for path in (tmp_path / "new").iterdir()} == {"local-exponent.svg", "local-exponent.png"}


def test_export_prints_the_kernels_that_are_asked_for_or_writes_them(tmp_path):
    words, file = ("export", "c", "--pade", "3/6", "--pade", "1/4"), tmp_path / "eps.h"
    assert printed(*words) == render(Request(pade=[(3, 6), (1, 4)]), "c")
    assert printed(*words, "-o", file) == ""
    assert file.read_text() == printed(*words)


def test_reproduce_as_json():
    whole = json_of("reproduce")
    assert whole["agreeing"] == len(whole["entries"]) == 32


def test_the_papers_table_in_latex_has_the_digits_asked_for():
    """They are those of `viscopade pade`, which proves each of them."""
    text = printed("export", "latex", "--digits", "20")
    assert " --digits 20\n" in text.splitlines(keepends=True)[0]
    found = re.findall(r"\$([ab]_\{\d\})?=?([-.\d]+)\$", text)
    for m, n in ("03", "14", "25", "36"):
        proven = json_of("pade", m, n, "--digits", "20")
        numbers = {f"{symbol}_{{{i}}}": x for symbol in "ab" for i, x in enumerate(proven[symbol])}
        begin = found.index(("", n)) + 1
        assert dict(found[begin : begin + len(numbers)]) == numbers


def test_pade_states_its_error_up_to_a_v_star():
    bound = json_of("pade", "3", "--digits", "8", "--v-star-max", "1")["proven_error"]
    assert bound == "2.6e-4"
    assert (
        f"proven: |[3/6] - eps| <= {bound} min(eps, 1 - eps) for 0 <= v* <= 1"
        in called("pade", "3", "--digits", "8", "--v-star-max", "1").stdout
    )
    (sampled,) = json_of("pade", "2", "--law", "hunt-crossley", "--digits", "8", "--v-star-max", "1")["sampled"]
    assert sampled["v_star_max"] == "1"
    assert 1.8e-4 < float(sampled["error"]) < 2e-4
    text = called("pade", "2", "--law", "hunt-crossley", "--digits", "8").stdout
    assert f"sampled, not proven: |[2/3] - eps| <= {sampled['error']} min(eps, 1 - eps) for 0 <= v* <= 1\n" in text
    assert "for 0 <= v* <= 5" in text
    last = json_of("pade", 3, 6, "--v-star-max", 20)["errors"][-1]
    assert last == pytest.approx({"v_star": 20, "relative": pade(3, 6)(20.0) / float(exact.epsilon(20)) - 1})


BODY = ("--radius", "1 cm", "--density", "2500", "--young-modulus", "10 MPa", "--poisson-ratio", "0.3")
WRITING = (
    ("simulators", "mujoco", "--epsilon", "0.5", "--speed", "1 m/s", "--contact-time", "10 ms", "-o", "folder/out"),
    ("simulators", "lammps", "--epsilon", "0.5", "--speed", "50 cm/s", *BODY, "--wall", "-o", "folder/out"),
    ("simulators", "yade", "a scene.toml", "-o", "folder/out"),
    ("scene", "a scene.toml", "--no-check", "--out", "folder"),
    ("fit", "examples/collisions.csv", *BODY, "--no-scatter", "--law", "linear", "--scene", "folder/ball.toml"),
    ("fit", "examples/collisions.csv", "--empirical", "folder/ball.py", "--form", "table"),
    ("plot", "a scene.toml", "--law", "tsuji", "--size", "8 cm", "6 cm", "-o", "folder/picture.svg"),
    ("export", "latex", "--digits", "5", "-o", "folder/out"),
    ("calculator", "-o", "folder/out"),
)


@pytest.mark.parametrize("words", WRITING, ids=" ".join)
def test_the_command_in_a_file_makes_the_same_file(words, tmp_path, monkeypatch):
    """It is found in the file as a reader finds it, and pasted into a shell, beside the files that it reads."""
    examples = Path(__file__).parents[2] / "examples"
    (tmp_path / "examples").symlink_to(examples)
    (tmp_path / "folder").mkdir()
    for place in (tmp_path, tmp_path / "folder"):
        (place / "a scene.toml").write_text((examples / "glass_beads.toml").read_text())
    (tmp_path / "folder" / "collisions.csv").write_text((examples / "collisions.csv").read_text())
    monkeypatch.chdir(tmp_path)
    printed(*words)
    monkeypatch.chdir("folder")
    for path, text in [(path, path.read_text()) for path in Path().iterdir() if path.is_file()]:
        if path.suffix == ".svg":
            (written,) = ElementTree.fromstring(text).iterfind(".//{http://purl.org/dc/elements/1.1/}description")
            found = written.text
        else:
            found = text
        pasted = re.search(r"(?:viscopade [\d.]+: |^<\?)(viscopade .*?)(?:\?>)?$", found, re.MULTILINE)
        if pasted and path.suffix != ".json":
            path.unlink()
            shown = printed(*shlex.split(pasted[1])[1:])
            assert text == (shown if path.name == "out" else path.read_text())


SOFT = ["simulators", "mujoco", "--epsilon", "0.5", "--speed", "1", "--stiffness", "1000 N/m", "--mass", "1"]


@pytest.mark.parametrize(("words", "ways"), [(["export", "c"], 3), (SOFT, 3), (["calculator"], 2)])
def test_a_minus_is_the_standard_output(words, ways, tmp_path, monkeypatch):
    """It is the default, too, of two of the commands."""
    monkeypatch.chdir(tmp_path)
    found = [called(*words, *more) for more in (["-o", "-"], ["--output", "-"], [])[:ways]]
    assert {(ran.returncode, ran.stderr) for ran in found} == {(0, "")}
    assert len({ran.stdout for ran in found}) == 1
    assert not list(tmp_path.iterdir())


def test_the_calculator_is_a_file(tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    ran = called("calculator")
    assert (ran.returncode, ran.stdout) == (0, "wrote calculator.html\n")
    assert (tmp_path / "calculator.html").read_text("utf-8").startswith("<!DOCTYPE html>")
