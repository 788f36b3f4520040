"""Hard cases: every bound holds in the quick run, and fails for a measurement that is wrong on purpose."""

from __future__ import annotations

import csv
import math
import re
import xml.etree.ElementTree as ET
from fractions import Fraction
from pathlib import Path

import numpy as np
import pytest
from flint import fmpq

from tests.cli import called
from viscopade.arithmetic.balls import working
from viscopade.arithmetic.formats import DOUBLE, FLOAT
from viscopade.collision.exact import collision
from viscopade.kernels.write.runners import ToolchainError
from viscopade.theory import paper
from viscopade.theory.series import series
from viscopade_lab import hard_cases
from viscopade_lab.hard_cases import compilers, extremes, pade_systems, rounded_data, rounding, truncated_series, worst
from viscopade_lab.hard_cases.case import Case, Finding, Row
from viscopade_lab.hard_cases.exact_pade import exact_solution, rational_pade

PAGE = Path(__file__).parents[2] / "docs" / "hard-cases"


def failing(finding):
    return [row.what for row in finding.rows if not row.holds]


# --- the frame --------------------------------------------------------------------------------------------------------


def test_every_bound_holds_in_the_quick_run(tmp_path):
    result = called("hardcases", "--out", tmp_path, "--format", "csv")
    assert_page_is_short(tmp_path)
    assert (result.returncode, result.stderr) == (0, "")
    rows = list(csv.DictReader(result.stdout.splitlines()))
    assert [row["case"] for row in rows] == [case.name for case in hard_cases.CASES]
    assert {row["holds"] for row in rows} == {"yes"}


def assert_page_is_short(folder):
    """Each case has a paragraph of short sentences, a picture as wide as a column with legible letters, and a table."""
    text = (folder / "hard-cases.md").read_text()
    sections = text.split('\n<a id="')[1:]
    assert [section.partition('"')[0] for section in sections] == [case.name for case in hard_cases.CASES]
    for case, section in zip(hard_cases.CASES, sections, strict=True):
        assert re.findall(r"!\[.*\]\((.*)\)", section) == [f"{case.name}.svg"]
        table = [line for line in section.splitlines() if line.startswith("| ")][2:]
        assert 2 <= len(table) <= 10
        assert all(line.endswith(("| yes |", "| – | – |")) for line in table)
        sentences = re.split(r"(?<=[.:]) ", " ".join(section.split("\n\n")[2].split()))
        assert max(len(sentence.split()) for sentence in sentences) <= 25
        assert 35 <= sum(len(sentence.split()) for sentence in sentences) <= 75
        picture = ET.parse(folder / f"{case.name}.svg").getroot()
        assert float(picture.get("width").removesuffix("pt")) == 244.8  # 3.4 inches
        sizes = re.findall(r"scale\(([\d.]+) ", (folder / f"{case.name}.svg").read_text())
        assert min(map(float, sizes)) >= 0.06  # of glyphs of 100 points


def test_the_committed_page_is_short():
    assert_page_is_short(PAGE)
    assert {path.name for path in PAGE.iterdir()} == {"hard-cases.md", *(f"{c.name}.svg" for c in hard_cases.CASES)}


def test_a_bound_that_fails_gives_exit_status_1(monkeypatch):
    broken = Finding((Row("a", 0.5, 1), Row("b", 2, 1)), "", lambda figure: None)
    monkeypatch.setattr(hard_cases, "CASES", (Case("c", "C", "Does it?", lambda thorough: broken),))
    result = called("hardcases")
    assert result.returncode == 1
    assert result.stdout.split()[-4:] == ["b", "2", "1", "NO"]


@pytest.mark.parametrize(
    ("measured", "ratio"), [(0.5, 0.25), (2, 1), (3, 1.5), (math.nan, math.inf), (math.inf, math.inf)]
)
def test_a_row_holds_up_to_its_bound(measured, ratio):
    row = Row("a", measured, 2)
    assert (row.ratio, row.holds) == (ratio, ratio <= 1)


def test_a_count_holds_if_it_is_zero():
    assert [Row("a", n, 0).ratio for n in (0, 1)] == [0, math.inf]


# --- truncated series -------------------------------------------------------------------------------------------------


@pytest.fixture(scope="module")
def truncated():
    series_h = truncated_series.coefficients(40)
    return series_h, truncated_series.first_failures(series_h)


@pytest.mark.parametrize("factor", [1.003, 0.997])
def test_a_place_that_is_off_is_noticed(truncated, factor):
    series_h, failures = truncated
    assert failing(truncated_series.make_finding(series_h, failures)) == []
    assert "round-off where the sum fails / its bound" in failing(
        truncated_series.make_finding(series_h, failures * factor)
    )


def test_a_place_far_off_is_noticed_by_the_remainder(truncated):
    series_h, failures = truncated
    assert any("upper bound" in what for what in failing(truncated_series.make_finding(series_h, failures * 1.2)))


# --- Padé -------------------------------------------------------------------------------------------------------------


def test_the_condition_number_is_that_of_finite_differences():
    """Each h_l moved by 2^-200 of itself, and the system solved in fractions."""
    m, step = 3, fmpq(1, 2**200)
    h = [fmpq(int(x.numerator), int(x.denominator)) for x in map(Fraction, series(9, 40).decimals())]
    exact = exact_solution(h, m, m + 3)[1]
    total = [0.0] * len(exact)
    for i, h_i in enumerate(h):
        moved = exact_solution([*h[:i], h_i * (1 + step), *h[i + 1 :]], m, m + 3)[1]
        for j, (x, y) in enumerate(zip(moved, exact, strict=True)):
            total[j] += float(abs((x / y - 1) / step)) if y != 0 else 0.0
    assert pade_systems.condition_number(h, exact, m, 200) == pytest.approx(max(total), rel=1e-9)


def test_too_few_digits_are_noticed():
    loss = pade_systems.lost_digits(7)
    assert failing(pade_systems.make_finding([loss, loss._replace(m=8)])) == []
    short = pade_systems.make_finding([loss, loss._replace(m=8, chosen=pade_systems.DIGITS + 5)])
    assert sum("digits lost" in what for what in failing(short)) >= 2
    assert len(failing(pade_systems.make_finding([loss, loss._replace(m=8, last=6.0)]))) == 1


def test_rounded_data_are_within_their_bounds_and_wrong_ones_are_not():
    """Six digits taken for nine."""
    h = [Fraction(text) for text in series(17, 80).decimals()]
    p = rational_pade(h, 7, 10, 64)
    short, u = rounded_data.roundings(h)["6 digits"]
    assert rounded_data.change(p, short, u).ratio < 1
    assert rounded_data.change(p, short, u / 1000).ratio > 1


def test_a_printed_digit_that_is_off_is_noticed():
    (m, n), (a, b) = list(paper.TABLE.items())[-1]
    assert rounded_data.printed(m, n, a, b) <= 1
    last = b[-1][:-1] + ("3" if b[-1][-1] in "12" else "1")
    assert rounded_data.printed(m, n, a, [*b[:-1], last]) > 1


# --- round-off --------------------------------------------------------------------------------------------------------


@pytest.fixture(scope="module")
def searched():
    return list(worst.functions(1))


def test_every_function_is_searched_and_finite_at_its_ends(searched):
    for function in searched:
        ends = np.array([function.low, function.high]).astype(worst.TYPES[function.form.name])
        assert all(math.isfinite(error) for error in function.errors(ends)), function.name
    assert {function.family for function in searched} == set(rounding.FAMILIES)
    assert len({(function.name, function.form.name) for function in searched}) > 30


def test_listed_arguments_are_bad_enough(searched):
    """A short search finds nothing that is much worse than what test vectors have."""
    from tools.hard_arguments import listed_arguments

    for function in searched[::3]:
        if function.family != "tables":
            listed = np.array(listed_arguments(function)).astype(worst.TYPES[function.form.name])
            assert worst.worst(function, 40, 0).error < 1.3 * max(function.errors(listed)), function.name


def test_a_search_is_the_same_again_and_better_than_chance(searched):
    function = searched[0]
    found = worst.worst(function, 100, 3)
    assert found == worst.worst(function, 100, 3)
    assert found.error > worst.worst(function, 100, 0).error
    assert function.errors(np.array([found.x]))[0] == found.error


@pytest.mark.parametrize("family", ["quotients", "compact", "full"])
def test_a_result_that_is_off_is_noticed(searched, family):
    """By a few times its bound: some units in the last place, but for roots."""
    function = next(f for f in searched if f.family == family and f.form == DOUBLE)
    off = 1 + 4 * float(function.bound) * (2.0**-52 if function.ulp else 1)
    wrong = function._replace(computed=lambda x: function.computed(x) * off)
    assert worst.worst(function, 40, 1).error < 1 < worst.worst(wrong, 40, 1).error


def test_a_float_that_is_double_is_noticed(searched):
    """It has no last rounding: a search that looked at the wrong type would find next to nothing."""
    function = next(f for f in searched if f.family == "tables" and f.form == FLOAT)
    assert worst.worst(function, 200, 2).error > 0.2
    exact = function._replace(computed=lambda x: np.array([float(function.exact(float(v))) for v in x]))
    with working(worst.BITS):
        assert worst.worst(exact, 20, 0).error < 1e-6


def test_bounds_that_fail_are_noticed():
    errors = {family: [0.5] for family in rounding.FAMILIES}
    good = errors, [rounding.FarQuotient("a", 0.5, 1e6)], [1.0] * 150, [1e-17] * 150
    assert failing(rounding.make_finding(*good)) == []
    for i, wrong in (
        (0, errors | {"inverse": [1.1]}),
        (1, [rounding.FarQuotient("a", math.inf, 1e6)]),
        (3, [1e-15] * 150),
    ):
        assert len(failing(rounding.make_finding(*good[:i], wrong, *good[i + 1 :]))) == 1


def test_a_difference_loses_what_is_said():
    """Of 1 - 1.1534e-16, 1 minus eps is 2^-53."""
    difference, direct = rounding.losses()
    assert difference[7] == pytest.approx(abs(2.0**-53 / 1.153449e-16 - 1), rel=1e-4)
    assert max(direct) < 1e-15


# --- extremes ---------------------------------------------------------------------------------------------------------


@pytest.mark.parametrize("wrong", [1, 1 + 1e-12])
def test_a_wrong_digit_is_noticed(wrong):
    elastic = extremes.expansions(extremes.QUICK)[extremes.NEAR]
    value = collision("1e-10", 40).one_minus_epsilon
    with working(256):
        found, last = extremes.differences(value * wrong, "1e-10", 40, elastic["one_minus_epsilon"])
    finding = extremes.make_finding({(extremes.NEAR, "one_minus_epsilon"): found}, last)
    assert finding.holds == (wrong == 1)


# --- compilers --------------------------------------------------------------------------------------------------------

FILE = "vectors_pade.json"


@pytest.fixture(scope="module")
def gcc():
    build = next((one for one in compilers.builds(False) if one.label == "gcc"), None)
    if build is None:
        pytest.skip("there is no gcc")
    return build, compilers.export_text(compilers.header_of(FILE))


@pytest.mark.parametrize(
    ("old", "new"),
    [
        ("const double a1 = VISCOPADE_CONSTANT(0x1.008e4", "const double a1 = VISCOPADE_CONSTANT(0x1.108e4"),
        ("v_star >= 0.0", "v_star >= 1e-30"),
    ],
)
def test_a_wrong_header_is_noticed(gcc, old, new):
    build, text = gcc
    assert old in text
    right, wrong = ({build: compilers.run(build, FILE, one)} for one in (text, text.replace(old, new)))
    assert (failing(compilers.make_finding(right)), failing(compilers.make_finding(wrong)) != []) == ([], True)


def test_a_warning_is_an_error(gcc):
    build, text = gcc
    with pytest.raises(ToolchainError, match="unused"):
        compilers.run(
            build, FILE, text.replace("const double u = 1.0 / v_star;", "const double u = 1.0 / v_star, v = u;")
        )


def test_errors_of_vectors():
    build = compilers.Build("rounding to nearest", (), "")
    vector = compilers.Vector("f", "double", (1.0,), Fraction(1, 3), Fraction(1, 2**50))
    assert compilers.error_over_bound(vector, 1 / 3 + 2.0**-49, build) == pytest.approx(2, abs=0.03)
    known = vector._replace(exact=Fraction(1), error=Fraction(0))
    assert [compilers.error_over_bound(known, x, build) for x in (1.0, 1 - 2.0**-53, math.nan)] == [
        0,
        math.inf,
        math.inf,
    ]
    assert compilers.error_over_bound(known, 1 - 2.0**-53, build._replace(mode="FE_DOWNWARD")) == 0
    refused = vector._replace(exact=math.nan, error=Fraction(0))
    assert [compilers.error_over_bound(refused, x, build) for x in (math.nan, 1.0)] == [0, math.inf]
