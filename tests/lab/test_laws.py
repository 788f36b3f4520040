"""Damping formulas and the page of laws: against Lambert's function, and orbits that are integrated here."""

import doctest
import re
from fractions import Fraction
from pathlib import Path

import pytest
from mpmath import mp, mpf

from tests.closed_forms import nu_1
from viscopade.simulators import textbook
from viscopade.simulators.audit import ASKED
from viscopade.simulators.textbook import HUNT_CROSSLEY
from viscopade.theory.law import Law
from viscopade_lab.figures.laws import COLORS, law_with
from viscopade_lab.studies import laws

PAGE = (Path(__file__).parents[2] / "docs" / "results" / "laws.md").read_text("utf-8")
NAMED = {formula.name: formula for formula in HUNT_CROSSLEY}

# Formulas that are right to first order in 1 - e: theirs is the 3/2 of Hunt and Crossley.
FIRST_ORDER = [
    "Hunt and Crossley",
    "Herbert and McWhannell",
    "Lankarani and Nikravesh",
    "Qin and Lu",
    "Hu and Guo",
]


# --- damping formulas -------------------------------------------------------------------------------------------------


def test_every_formula_is_normalised_to_z():
    """For e -> 1 the exact z is 3 (1 - e)/2; the others are known to be wrong there by a constant factor."""
    with mp.workdps(30):
        loss = mpf("1e-9")
        slopes = {formula.name: float(formula.z(1 - loss) / loss) for formula in HUNT_CROSSLEY}
        slopes.pop("Gharib and Hurmuzlu")  # made for small e: its z does not vanish
        assert {name for name, slope in slopes.items() if slope == pytest.approx(1.5, rel=1e-6)} == set(FIRST_ORDER)
        assert slopes["Lee and Wang"] == pytest.approx(0.75)
        assert slopes["Gonthier et al."] == pytest.approx(2)
        exactly = textbook.exact_z("0.999999")
    assert float(exactly) == pytest.approx(1.5e-6, rel=1e-5)


@pytest.mark.parametrize("name", NAMED)
def test_delivered_eps_is_that_of_lamberts_function(name):
    for e in ASKED:
        with mp.workdps(30):
            expected = nu_1(NAMED[name].z(mpf(e)))
            assert abs(textbook.delivered_epsilon(NAMED[name], e) / expected - 1) < mpf("1e-18")


@pytest.mark.parametrize("e", ASKED)
def test_the_exact_z(e):
    with mp.workdps(30):
        z, e = textbook.exact_z(e), mpf(e)
        assert abs(mp.log((1 + z) / (1 - z * e)) / (z * (1 + e)) - 1) < mpf("1e-16")
        assert abs(nu_1(z) / e - 1) < mpf("1e-16")


# --- the page ---------------------------------------------------------------------------------------------------------


@pytest.fixture(scope="module")
def tables():
    return list(laws.tables())


def cells(table):
    return [line.strip("| ").split(" | ") for line in table.splitlines()[2:]]


def test_the_tables_are_those_that_the_command_prints(tables):
    assert [table.splitlines()[0] for table in tables if table not in PAGE] == []


def test_the_examples_of_the_page_run():
    found = doctest.DocTestParser().get_doctest(PAGE, {}, "laws.md", None, 0)
    assert found.examples
    assert doctest.DocTestRunner().run(found).failed == 0


def test_common_laws_have_these_parameters():
    rows = {name: (Fraction(a), Fraction(b)) for name, a, b in laws.COMMON}
    assert len(rows) == len(laws.COMMON)
    assert {Law(a, b).nu for a, b in rows.values()} == set(COLORS)


def midpoint(rates, y, u, step, over):
    while not over(y, u):
        dy, du = rates(y, u)
        dy, du = rates(y + step / 2 * dy, u + step / 2 * du)
        y, u = y + step * dy, u + step * du
    return y, u


def test_the_powers_of_large_dampings(tables):
    """Without engine: eps = C K^(-nu/(2 - nu)) at x = 0, where C belongs to an orbit that has forgotten the impact."""
    rows = {row[0].strip("$"): row for row in cells(tables[2])}
    for nu in (Fraction(5, 4), Fraction(3, 2), Fraction(5, 3)):
        *_, power, factor = rows[str(nu)]
        assert power == f"$K^{{{-nu / (2 - nu)}}}$"
        a = float(nu) - 1
        start, over = (1e3, 1e3**a), lambda y, u: y <= 0
        _, creeping = midpoint(lambda y, u, a=a: (-u, max(y, 0.0) ** a - u), *start, 1e-3, over)
        assert float(factor) == pytest.approx(creeping, rel=2e-3)
    assert all(abs(float(row[2]) - 1) < 0.01 for row in rows.values())
    assert re.search(r"(\d\.\d{3})\$", rows["2"][3])[1] == "2.000"


def test_the_damping_from_which_on_contact_never_ends():
    """nu = 5/2, without engine: the orbit that arrives at Y = 0, u = 0 along u = K Y, followed backward for K = 1."""
    nu, step, y = 2.5, 1e-3, 1e-8
    u = y - y ** (nu - 1) / (nu - 1)
    y, u = midpoint(lambda y, u: (u, u - max(y, 0.0) ** (nu - 1)), y, u, step, lambda y, u: u <= 0)
    y, u = midpoint(lambda y, u: (-u, max(y, 0.0) ** (nu - 1) + u), y, 0.0, step, lambda y, u: y <= 0)
    expected = u ** (2 / nu - 1)
    assert laws.largest_damping(law_with(Fraction(5, 2), "return")) == pytest.approx(expected, rel=1e-3)


def test_the_formulas_named_as_extreme_are_so():
    """The page says which formulas give how many times the eps that they are asked for."""
    stated = dict(re.findall(r"^- \*\*(.+?)(?<!al)\.?\*\* The formula gives ([\d.]+) times", PAGE, re.MULTILINE))
    assert len(stated) == 4
    for name, times in stated.items():
        assert f"{float(textbook.delivered_epsilon(NAMED[name], '0.1')) / 0.1:.1f}" == times


def test_the_other_numbers_of_the_text(tables):
    with mp.workdps(30):
        assert f"no less than {mp.nstr(nu_1(NAMED['Lankarani and Nikravesh'].z(mpf(0))), 2)} " in PAGE
        for name in ("Gonthier et al.", "Hu and Guo"):
            asked = [mpf(i) / 200 for i in range(1, 200)]
            worst = max(abs(nu_1(NAMED[name].z(e)) - e) for e in asked)
            assert 0.032 < worst < mpf(re.search(r"are within ([\d.]+) of \$e\$ for all", PAGE)[1])
    (row,) = [row for row in cells(tables[1]) if row[0] == "0.5"]
    least, most = re.search(r"gives (\d+) % to (\d+) % less", PAGE).groups()
    assert [f"{200 * (0.5 - float(row[i])):.0f}" for i in (1, -1)] == [least, most]
