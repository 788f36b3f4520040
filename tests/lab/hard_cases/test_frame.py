"""The frame of the hard cases: data that checks itself, JSON there and back, the page, the figures, the command."""

import csv
import io
import json
import math
import re
from dataclasses import replace
from pathlib import Path
from xml.etree import ElementTree

import click.testing
import numpy as np
import pytest

from tests import daily
from viscopade.cli import main
from viscopade_lab import hard_cases
from viscopade_lab.hard_cases import Case, Chart, ChartCurve, Check, Finding, Outcome, ResultTable, page, picture
from viscopade_lab.hard_cases.finding import curve

REPORT = Path(__file__).parents[3] / "docs" / "hard-cases"
X = np.geomspace(1e-3, 10, 20)


def result(*checks, **changes):
    chart = Chart(
        "errors",
        "$v_*$",
        "relative error",
        (curve("Horner", X, X * 1e-16), curve("bound", X, 2e-16 * X, "bound"), curve("found", X, X * 1e-17, "points")),
    )
    table = ResultTable("Sizes | of a*b_c", ("order", "v*"), ((20, 0.5), (40, "0.7 | <b>")))
    whole = Outcome(
        "It went well: 1.5*.", (table,), (chart,), checks or (Check("error stays below", 1e-16, "<=", 2e-16),)
    )
    return replace(whole, **changes)


def finding(name="fake", thorough=False, **changes):
    return Finding(name, f"The case {name}", "Does it break?", thorough, changes.pop("result", None) or result())


FAKE = Case("fake", "The case fake", "Does it break?", lambda thorough: result())
BROKEN = Case("broken", "Broken", "Does it?", lambda thorough: result(Check("nothing is lost", 1, "==", 0)))


@pytest.fixture
def few(monkeypatch):
    monkeypatch.setattr(hard_cases, "CASES", (FAKE, BROKEN))


def invoke(*arguments):
    return click.testing.CliRunner().invoke(main.command, ["hardcases", *map(str, arguments)])


@pytest.fixture
def refusal(monkeypatch, capsys):
    """Run what must be refused, and return the one line that says why."""

    def run(*arguments):
        monkeypatch.setattr("sys.argv", ["viscopade", "hardcases", *map(str, arguments)])
        with pytest.raises(SystemExit) as stop:
            main.main()
        out, line = capsys.readouterr()
        assert (stop.value.code, out) == (2, "")
        assert re.fullmatch(r"viscopade: [^\n]+\n", line)
        return line

    return run


@pytest.mark.parametrize(
    ("measured", "relation", "limit", "holds"),
    [
        (1, "<=", 1, True),
        (1.1, "<=", 1, False),
        (1, ">=", 1, True),
        (0.9, ">=", 1, False),
        (0, "==", 0, True),
        (1, "==", 0, False),
        (math.nan, "<=", 1, False),
        (math.nan, "==", 0, False),
        (math.inf, "<=", 1e300, False),
    ],
)
def test_a_check_compares_what_was_measured(measured, relation, limit, holds):
    assert Check("so", measured, relation, limit).holds == holds


@pytest.mark.parametrize(
    "make",
    [
        lambda: Check("so", 1, "<", 1),
        lambda: Check("so", 1, "<=", math.inf),
        lambda: Check("so", 1, "<=", math.nan),
        lambda: ResultTable("t", ("a", "b"), ((1,),)),
        lambda: ChartCurve("c", (1.0,), (1.0, 2.0)),
        lambda: ChartCurve("c", (), ()),
        lambda: ChartCurve("c", (1.0,), (math.nan,)),
        lambda: ChartCurve("c", (1.0,), (1.0,), "dots"),
        lambda: result(charts=()),
        lambda: replace(result(), checks=()),
    ],
)
def test_inconsistent_data_is_refused(make):
    with pytest.raises(ValueError, match=r"accepted|needs?|must"):
        make()


def test_a_curve_leaves_out_what_is_not_finite():
    assert curve("c", [1, 2, 3], [1, math.nan, 3]) == ChartCurve("c", (1.0, 3.0), (1.0, 3.0))


def test_one_failing_check_fails_the_case():
    good, bad = Check("so", 1, "<=", 2), Check("so", 3, "<=", 2)
    assert result(good, good).passes
    assert not result(good, bad).passes


def test_findings_go_to_json_and_back():
    findings = (finding(), finding("other", thorough=True))
    assert hard_cases.from_json(page.numbers(findings), "x.json") == findings


def test_numbers_stand_on_one_line_and_text_stays_as_it_is():
    table = ResultTable("[ 1,  2 ]", ("a",), (("[  3 ]",), (4.5,)))
    whole = (finding(result=result(tables=(table,))),)
    text = page.numbers(whole)
    assert hard_cases.from_json(text, "x") == whole
    assert all("," in line for line in text.splitlines() if line.strip().startswith('"x": ['))


def test_a_measured_nan_goes_to_json_and_back_as_a_failure():
    text = page.numbers((finding(result=result(Check("so", math.nan, "<=", 1))),))
    assert json.loads(text)["passes"] is False
    (back,) = hard_cases.from_json(text, "x.json")
    assert math.isnan(back.result.checks[0].measured)
    assert not back.result.passes


@pytest.mark.parametrize(
    ("change", "message"),
    [
        (lambda data: data.pop("cases"), "x.json: cases is missing"),
        (lambda data: data.update(cases=3), "x.json: cases is 3: accepted is a list"),
        (lambda data: data["cases"][0].pop("name"), r"cases\[0\].name is missing"),
        (lambda data: data["cases"][0].update(thorough=1), r"cases\[0\].thorough is 1: accepted is true or false"),
        (lambda data: data["cases"][0]["result"]["checks"][0].update(relation="<"), "relation is '<': accepted is <=,"),
        (lambda data: data["cases"][0]["result"]["checks"][0].update(limit="2"), "limit is '2': accepted is a number"),
        (lambda data: data["cases"][0]["result"]["charts"][0].update(x_scale="cubic"), "accepted is linear, log"),
        (lambda data: data["cases"][0]["result"]["tables"][0]["rows"][0].append([]), r"rows\[0\]\[2\] is \[\]"),
        (
            lambda data: data["cases"][0]["result"]["tables"][0]["rows"][0].append(float("nan")),
            r"rows\[0\]\[2\] is nan: accepted is text or a finite number",
        ),
        (
            lambda data: data["cases"][0]["result"]["tables"][0]["rows"][0].append(1),
            r"tables\[0\]: table .* 2 cells: acc",
        ),
        (
            lambda data: data["cases"][0]["result"].update(checks=[]),
            r"x.json: cases\[0\].result: a result needs .*: acc",
        ),
        (lambda data: data["cases"][0]["result"]["charts"][0]["curves"][0]["x"].pop(), r"curves\[0\]: .* same length"),
        (lambda data: data["cases"][0]["result"]["checks"][0].update(limit=float("nan")), r"checks\[0\]: limit is nan"),
    ],
)
def test_wrong_json_is_refused_with_its_place(change, message):
    data = json.loads(page.numbers((finding(),)))
    change(data)
    with pytest.raises(ValueError, match=message):
        hard_cases.from_json(json.dumps(data), "x.json")


@pytest.mark.parametrize("text", ["", "{", "[" * 100_000, b"\xff", "3"])
def test_what_is_no_report_is_refused(text):
    with pytest.raises(ValueError, match=r"^x.json: "):
        hard_cases.from_json(text, "x.json")


def test_the_command_names_what_was_run(few):
    assert hard_cases.command((finding("fake"), finding("broken"))) == "viscopade hardcases"
    assert hard_cases.command((finding("broken", thorough=True),)) == "viscopade hardcases --only broken --thorough"


def test_the_page_says_everything_and_escapes_what_markdown_would_take():
    text = page.markdown((finding(), finding("other", result=result(Check("none is lost", 2, "==", 0)))))
    assert "| [The case other](#other) | fails: 1 of 1 checks do not hold |" in text
    assert "| 40 | 0.7 \\| \\<b\\> |" in text
    assert "It went well: 1.5\\*." in text
    assert "![The case fake](fake.svg)" in text
    assert "| none is lost | 2 | == 0 | NO |" in text
    assert "| error stays below | 1e-16 | \\<= 2e-16 | yes |" in text


def test_tables_are_folded_unless_a_check_fails():
    text = page.markdown((finding(), finding("other", result=result(Check("none is lost", 2, "==", 0)))))
    assert text.count("<details>\n<summary>Tables and checks: all 1 checks hold</summary>\n\n") == 1
    assert text.count("<details open>\n<summary>Tables and checks: fails: 1 of 1 checks do not hold</summary>\n\n") == 1
    assert text.count("\n\n</details>\n") == 2


def test_no_line_breaks_within_a_code_span():
    span = "`viscopade hardcases --only one --only another`"
    shown = replace(finding(), question=" ".join(["word"] * 20) + " " + span)
    assert span in page.markdown((shown,))


@pytest.mark.parametrize(
    ("value", "text"),
    [(0, "0"), (123456, "123,456"), (1e-16, "1e-16"), (2.34567, "2.35"), (math.nan, "nan"), (1e20, "1e+20")],
)
def test_numbers_are_short(value, text):
    assert page.number(value) == text


def test_a_figure_has_every_curve_in_its_key_and_is_the_same_again():
    first = picture.svg(finding())
    assert first == picture.svg(finding())
    root = ElementTree.fromstring(first)
    assert root.tag.endswith("svg")
    sheet = picture.drawn(finding())
    (axes,) = sheet.axes
    assert [text.get_text() for text in axes.get_legend().get_texts()] == ["Horner", "bound", "found"]
    assert axes.get_xscale() == axes.get_yscale() == "log"


def test_a_figure_for_notebooks_is_small():
    picture_of = picture.png(finding())
    assert picture_of.startswith(b"\x89PNG")
    assert len(picture_of) < 30_000


@pytest.mark.parametrize(("panels", "shape"), [(1, (1, 1)), (3, (1, 3)), (4, (2, 2)), (5, (3, 2))])
def test_panels_stand_side_by_side_or_in_a_square(panels, shape):
    axes = picture.drawn(finding(result=result(charts=result().charts * panels))).axes
    assert len(axes) == panels
    assert axes[0].get_subplotspec().get_gridspec().get_geometry() == shape


def test_points_that_a_logarithmic_axis_cannot_show_are_left_out():
    chart = Chart("errors", "x", "y", (curve("c", [0.0, 1.0, 2.0], [1.0, 0.0, 3.0]),))
    (axes,) = picture.drawn(finding(result=result(charts=(chart,)))).axes
    x, y = axes.lines[0].get_data()
    assert np.isnan(x[0])
    assert np.isnan(y[1])
    assert (x[2], y[2]) == (2.0, 3.0)


@pytest.mark.parametrize(
    "error", [ArithmeticError("no digits left"), AssertionError(), OSError("disk"), ValueError("bad")]
)
def test_a_case_that_stops_in_an_exception_fails_and_the_others_are_run(monkeypatch, error):
    def stops(thorough):
        raise error

    monkeypatch.setattr(hard_cases, "CASES", (Case("stops", "Stops", "Does it?", stops), FAKE))
    stopped, fake = hard_cases.check()
    assert not stopped.result.passes
    assert type(error).__name__ in stopped.result.summary
    assert fake.result.passes
    text = page.numbers((stopped, fake))
    assert hard_cases.from_json(text, "x.json")[0] == stopped
    assert "![Stops]" not in page.markdown((stopped, fake))
    assert set(page.files((stopped, fake))) == {page.PAGE, page.NUMBERS, "fake.svg"}


def test_an_interruption_is_passed_on(monkeypatch):
    def interrupted(thorough):
        raise KeyboardInterrupt

    monkeypatch.setattr(hard_cases, "CASES", (Case("stops", "Stops", "Does it?", interrupted), FAKE))
    with pytest.raises(KeyboardInterrupt):
        hard_cases.check()


def test_unknown_names_are_refused(refusal):
    line = refusal("--only", "nonsense")
    assert line.startswith("viscopade: there is no hard case 'nonsense': accepted are ")


def test_the_command_shows_everything_and_fails_with_a_check(few):
    good, bad = invoke("--only", "fake"), invoke()
    assert good.exit_code == 0
    assert "fake: The case fake" in good.stdout
    assert "It went well" in good.stdout
    assert "fake: all 1 checks hold" in good.stdout
    assert bad.exit_code == 1
    assert "broken: fails: 1 of 1 checks do not hold" in bad.stdout


def test_json_is_one_object(few):
    run = invoke("--format", "json")
    data = json.loads(run.stdout)
    assert run.exit_code == 1
    assert data["passes"] is False
    assert [case["name"] for case in data["cases"]] == ["fake", "broken"]


def test_csv_and_latex_have_what_must_hold(few):
    run = invoke("--format", "csv")
    assert run.exit_code == 1
    assert list(csv.reader(io.StringIO(run.stdout))) == [
        ["case", "statement", "measured", "relation", "limit", "holds"],
        ["fake", "error stays below", "1e-16", "<=", "2e-16", "yes"],
        ["broken", "nothing is lost", "1", "==", "0", "NO"],
    ]
    latex = invoke("--format", "latex").stdout
    assert r"fake & error stays below & $1\times10^{-16}$ & $\leq$ & $2\times10^{-16}$ & yes \\" in latex
    assert r"broken & nothing is lost & 1 & == & 0 & NO \\" in latex


def test_the_report_is_written_and_can_be_shown_again(few, tmp_path):
    run = invoke("--only", "fake", "--out", tmp_path / "new")
    assert run.exit_code == 0
    written = {path.name for path in (tmp_path / "new").iterdir()}
    assert written == {"hard-cases.md", "hard-cases.json", "fake.svg"} == set(page.names(["fake"]))
    again = invoke("--from", tmp_path / "new" / "hard-cases.json", "--out", tmp_path / "again")
    assert again.exit_code == 0
    for name in written:
        assert (tmp_path / "new" / name).read_bytes() == (tmp_path / "again" / name).read_bytes()


def test_some_cases_are_run_again_and_put_in_their_place(monkeypatch, tmp_path):
    monkeypatch.setattr(hard_cases, "CASES", (FAKE, BROKEN))
    assert invoke("--out", tmp_path).exit_code == 1
    mended = replace(BROKEN, run=lambda thorough: result(Check("nothing is lost", 0, "==", 0)))
    monkeypatch.setattr(hard_cases, "CASES", (replace(FAKE, run=None), mended))
    report = tmp_path / "hard-cases.json"
    assert invoke("--from", report, "--only", "broken", "--thorough", "--out", tmp_path).exit_code == 0
    fake, broken = hard_cases.from_json(report.read_bytes(), "x")
    assert (fake.name, fake.thorough, fake.result.passes) == ("fake", False, True)
    assert (broken.name, broken.thorough, broken.result.passes) == ("broken", True, True)


def test_a_report_is_not_shown_thoroughly(few, tmp_path, refusal):
    assert invoke("--only", "fake", "--out", tmp_path).exit_code == 0
    assert "accepted with --from and --thorough is also --only" in refusal(
        "--from", tmp_path / "hard-cases.json", "--thorough"
    )


@pytest.mark.parametrize("name", ["../outside", "a/b", "", "A", "a" * 41, "a.svg"])
def test_a_name_that_is_no_file_name_is_refused(name):
    data = json.loads(page.numbers((finding(),)))
    data["cases"][0]["name"] = name
    with pytest.raises(ValueError, match=r"x.json: cases\[0\]"):
        hard_cases.from_json(json.dumps(data), "x.json")


def test_a_place_that_cannot_be_written_to_is_refused_before_anything_is_run(few, tmp_path, monkeypatch, refusal):
    (tmp_path / "hard-cases.md").write_text("mine")
    monkeypatch.setattr(hard_cases, "check", lambda *_, **__: pytest.fail("it was run"))
    assert "was not generated by viscopade" in refusal("--out", tmp_path)


@pytest.mark.parametrize(
    ("arguments", "message"),
    [
        (("--from", "missing.json"), "cannot read missing.json"),
        (("--from", "missing.json", "--only", "fake"), "cannot read missing.json"),
        (("--format", "xml"), "'xml' is not one of"),
    ],
)
def test_bad_options_get_one_line(refusal, arguments, message):
    assert message in refusal(*arguments)


def test_every_case_has_a_name_of_its_own_and_a_test():
    names = [case.name for case in hard_cases.CASES]
    assert len(set(names)) == len(names)
    tests = {path.stem.removeprefix("test_").replace("_", "-") for path in Path(__file__).parent.glob("test_*")}
    assert set(names) <= tests


@pytest.fixture(scope="module")
def committed():
    return hard_cases.from_json((REPORT / page.NUMBERS).read_bytes(), page.NUMBERS)


def test_the_committed_report_has_every_case_thoroughly_and_all_pass(committed):
    assert [finding.name for finding in committed] == [case.name for case in hard_cases.CASES]
    assert all(finding.thorough and finding.result.passes for finding in committed)
    assert [(finding.title, finding.question) for finding in committed] == [
        (case.title, case.question) for case in hard_cases.CASES
    ]


def test_the_committed_page_is_made_from_the_committed_numbers(committed):
    figures = {f"{finding.name}.svg" for finding in committed if finding.result.charts}
    assert {path.name for path in REPORT.iterdir()} == {page.PAGE, page.NUMBERS, *figures}
    assert (REPORT / page.PAGE).read_text() == page.markdown(committed)
    assert (REPORT / page.NUMBERS).read_text() == page.numbers(committed)


def assert_same_figure(finding):
    """Places in a figure may differ a little between machines."""
    words, places = split((REPORT / f"{finding.name}.svg").read_text())
    wanted, there = split(picture.svg(finding).decode())
    assert words == wanted, finding.name
    np.testing.assert_allclose(places, there, atol=0.1, err_msg=finding.name)


def test_a_committed_figure_is_made_from_the_committed_numbers(committed):
    """Another one every day."""
    assert_same_figure(daily.chosen([finding for finding in committed if finding.result.charts]))


@pytest.mark.slow
def test_the_committed_figures_are_made_from_the_committed_numbers(committed):
    for finding in committed:
        if finding.result.charts:
            assert_same_figure(finding)


def split(text):
    """The words of a text, and its numbers."""
    parts = re.split(r"(-?[0-9]+(?:[.][0-9]+)?)", text)
    return parts[::2], np.array(parts[1::2], dtype=float)
