"""Round trips: the quick run passes; hypothesis looks for worse starts; and a trip that loses something is seen."""

import csv
import io
import json
import math
from decimal import Decimal
from fractions import Fraction

import mpmath
import numpy as np
import pytest
from hypothesis import HealthCheck, example, given, settings
from hypothesis import strategies as st

from tests.lab.hard_cases.hard_case import (
    assert_goes_to_json_and_back,
    assert_passes,
    assert_readable,
    assert_same_checks,
)
from viscopade.arithmetic.formats import DOUBLE, FLOAT
from viscopade.arrays import double
from viscopade.cli import console
from viscopade.collision import exact, spheres
from viscopade.collision.spheres import Pair, Sphere
from viscopade.kernels import requests, toolchain
from viscopade.scene.units import Scale
from viscopade_lab.hard_cases import compiled_text, double_trips, material_trips, round_trips, tables_read_back

CASE = round_trips.CASE
moderate = settings(max_examples=100, derandomize=True, suppress_health_check=list(HealthCheck))
few = settings(moderate, max_examples=4)
many = settings(moderate, max_examples=50_000)


@pytest.fixture(scope="module")
def quick():
    return CASE.run(False)


def test_the_quick_run_passes(quick):
    assert_passes(quick)
    assert len(quick.charts) == 3
    assert_readable(quick)


def test_the_result_goes_to_json_and_back(quick):
    assert_goes_to_json_and_back(CASE, quick)


@pytest.mark.slow
def test_the_thorough_run_passes(quick):
    result = CASE.run(True)
    assert_passes(result)
    assert_same_checks(result, quick)


# --- eps and v* in double precision -----------------------------------------------------------------------------------


def assert_double_trips(v_star, portion):
    for name, trip in double_trips.DOUBLE_TRIPS.items():
        found = trip(np.array([v_star if name.startswith("v*") else portion]))
        assert found.worst <= 1, (name, found)


speeds, portions = st.floats(0, 1.7976931348623157e308), st.floats(0, 1)


@moderate
@given(speeds, portions)
@example(0.0, 0.0)
@example(5e-324, 5e-324)
@example(1.7976931348623157e308, 1.0)
@example(1.0640e97, 1 - 2.0**-53)
def test_trips_in_double_precision(v_star, portion):
    assert_double_trips(v_star, portion)


@pytest.mark.slow
@many
@given(speeds, portions)
def test_many_trips_in_double_precision(v_star, portion):
    assert_double_trips(v_star, portion)


@pytest.mark.parametrize("v_star", [1e-6, 0.05, 0.5, 1.5, 30.0, 1e5])
def test_the_condition_against_differences_of_the_exact_function(v_star):
    step = Fraction(1, 10**9)
    ends = [exact.collision(Fraction(v_star) * (1 + sign * step), 40).mpf() for sign in (1, -1)]
    with mpmath.workdps(40):
        first, second = (mpmath.log(end["one_minus_epsilon"] / end["epsilon"]) for end in ends)
        distance = mpmath.log(mpmath.mpf(10**9 + 1) / (10**9 - 1))
        assert double_trips.condition(np.array(v_star)) == pytest.approx(float(distance / (first - second)), rel=1e-10)


def test_the_limits_of_the_condition_follow_from_the_leading_terms():
    """1 - eps ~ v*^2 and eps ~ v*^(-10/3)."""
    assert double_trips.condition(np.array([1e-100, 1e80])) == pytest.approx([1 / 2, 3 / 10], rel=1e-10)


def test_the_change_of_odds_in_many_digits():
    for portion, error in ((0.3, 1e-3), (0.3, 0.2), (1e-200, 3e-201), (0.999, 5e-4)):
        with mpmath.workdps(250):
            e, d = mpmath.mpf(portion), mpmath.mpf(error)
            odds = mpmath.log((1 - e) / e)
            moved = max(abs(mpmath.log((1 - x) / x) - odds) for x in (e + d, e - d))
        found = float(double_trips.change_of_odds(np.array(portion), np.array(error)))
        assert float(moved) * (1 - 1e-14) <= found <= 2 * float(moved)
    assert double_trips.change_of_odds(np.array(0.999), np.array(1e-3 + 1e-9)) == math.inf


@pytest.mark.parametrize(("function", "factor"), [("v_star_from", 1 + 2.0**-49), ("epsilon", 1 - 2.0**-50)])
def test_a_worse_function_is_seen(monkeypatch, function, factor):
    good = getattr(double, function)
    monkeypatch.setattr(double, function, lambda *args, **kwargs: good(*args, **kwargs) * factor)
    trips = double_trips.all_trips(np.random.default_rng(1), 3000)
    assert max(trip.worst for trip in trips.values()) > 1


def test_an_infinite_or_missing_result_is_seen():
    start = np.array([1.0])
    for back in (math.inf, math.nan):
        error = double_trips.relative(np.array([back]), start)
        assert double_trips.Trip(start, error, np.array([1e-3])).worst == math.inf


# --- proven digits ----------------------------------------------------------------------------------------------------


@few
@given(st.integers(3, 15), st.floats(1, 9.99), st.integers(-30, 10))
def test_trips_with_proven_digits(digits, mantissa, exponent):
    assert round_trips.exact_there_and_back(f"{mantissa:.{digits}f}e{exponent}", digits).contains
    assert round_trips.exact_back_and_there("epsilon", f"{mantissa / 2:.{digits}f}e{exponent - 31}", digits).contains


@pytest.mark.slow
@settings(moderate, max_examples=100)
@given(st.integers(3, 60), st.floats(1, 9.99), st.integers(-100, 30))
def test_many_trips_with_proven_digits(digits, mantissa, exponent):
    hull = round_trips.exact_there_and_back(f"{mantissa:.{digits}f}e{exponent}", digits)
    assert hull.contains
    assert hull.width == pytest.approx(hull.expected, rel=0.01, abs=0)


def test_a_start_outside_is_seen():
    there = exact.invert("0.25", 20).v_star
    ends = [there, there * (1 + there * 1e-9)]
    assert not round_trips._hull(ends, Fraction(2), 2.0, 20, 1e-9).contains
    assert round_trips._hull(ends, Fraction(exact.invert("0.25", 30).decimals()["v_star"]), 1.0, 20, 1e-9).contains


@given(st.decimals(allow_nan=False, allow_infinity=False, min_value="1e-99", max_value="1e99", places=None))
def test_the_interval_of_rounding(number):
    rounded = exact.Context(prec=5).create_decimal(number)
    if rounded:
        low, high = round_trips.rounding_interval(str(rounded), 5)
        assert low <= Fraction(number) <= high


# --- exported kernels -------------------------------------------------------------------------------------------------


@pytest.fixture(scope="module")
def kernel():
    (found,) = round_trips.inverse_texts(round_trips._inverse_request(False))
    return found


@moderate
@given(v_star=st.floats(-150, 90).map(lambda x: 10**x), portion=st.floats(1e-300, 1 - 2.0**-53))
def test_trips_by_an_exported_kernel(kernel, v_star, portion):
    assert round_trips.v_star_by_text(kernel, np.array([v_star])).worst <= 1
    for loss in (False, True):
        assert round_trips.portion_by_text(kernel, np.array([portion]), loss=loss).worst <= 1


def test_a_kernel_that_is_off_is_seen(kernel):
    worse = kernel._replace(v_star=lambda e: kernel.v_star(e) * (1 + kernel.error))
    trips = round_trips._text_trips(worse, np.random.default_rng(1), 2000)
    assert max(trip.worst for trip in trips.values()) > 1


# --- materials --------------------------------------------------------------------------------------------------------

seeds = st.integers(0, 2**32 - 1).map(np.random.default_rng)


def assert_material_trips(generator):
    for name, tally in material_trips.all_trips(generator, 1).items():
        assert not tally.steps or tally.worst <= 1, name


@moderate
@given(seeds)
def test_trips_through_materials(generator):
    assert_material_trips(generator)


@pytest.mark.slow
@settings(moderate, max_examples=5000)
@given(seeds)
def test_many_trips_through_materials(generator):
    assert_material_trips(generator)


def test_one_constant_is_the_pairs_to_the_bit():
    generator = np.random.default_rng(2)
    for _ in range(50):
        pair = material_trips.random_pair(generator).calibrated(0.5, 0.7)
        assert pair.first.dissipative_constant == pair.A


def test_a_pressure_in_any_units_is_right_where_it_is_a_double():
    """It was not: Y L T^2 underflowed on the way, or T^2 overflowed."""
    ball = Sphere(radius=0.01, mass=1e-3, young_modulus=1e9, poisson_ratio=0.25, dissipative_constant=1e-5)
    for length, mass, time in ((1e-60, 1e-200, 1e-125), (3e9, 7e-8, 8e-159), (1e100, 1e250, 1e160), (1e-2, 1e-3, 1.0)):
        exact_value = Fraction(10) ** 9 * Fraction(length) * Fraction(time) ** 2 / Fraction(mass)
        assert Scale(length, mass, time)._pressure(1e9) == pytest.approx(float(exact_value), rel=1e-15, abs=0)
    with pytest.raises(ValueError, match="young_modulus is inf"):
        Scale(1.0, 1.0, 1e200).sphere(ball)


def test_a_wrong_factor_is_seen(monkeypatch):
    monkeypatch.setattr(spheres, "_BETA_SI_PER_CGS", spheres._BETA_SI_PER_CGS)
    monkeypatch.setattr(spheres, "beta_cgs_from_si", lambda beta: beta / (100**0.2 * (1 + 2.0**-51)))
    assert material_trips.tally(lambda: material_trips.units_of_beta(1.307), 1).worst > 1


def test_units_that_lose_digits_are_seen(monkeypatch):
    """What `Scale` did before."""
    monkeypatch.setattr(Scale, "_pressure", lambda self, p: p * self.length * (self.time * self.time) / self.mass)
    pair = material_trips.random_pair(np.random.default_rng(3))
    error, limit = material_trips.other_units(pair, 1.0, Scale(3e9, 7e-8, 8e-159))
    assert error > 100 * limit


def test_quantities_that_change_are_seen():
    assert material_trips.text_and_back(0.1 + 0.2, "length", "mm")
    assert not math.isclose(float(Decimal(f"{0.1 + 0.2:.16g}")), 0.1 + 0.2, rel_tol=0)  # 16 digits are not enough


# --- tables -----------------------------------------------------------------------------------------------------------

cells = st.lists(st.sampled_from(tables_read_back.HOSTILE), max_size=5).map(
    lambda parts: " ".join("".join(parts).split())
)
tables = st.integers(1, 4).flatmap(lambda n: st.lists(st.lists(cells, min_size=n, max_size=n), min_size=1, max_size=4))


@moderate
@given(tables)
def test_tables_read_back(rows):
    for style in ("latex", "csv", "json"):
        assert tables_read_back.shown_and_back(style, rows)[1] == 0


@pytest.mark.slow
@settings(moderate, max_examples=5000)
@given(tables)
def test_many_tables_read_back(rows):
    for style in ("latex", "csv", "json"):
        assert tables_read_back.shown_and_back(style, rows)[1] == 0


@moderate
@given(st.lists(st.lists(st.text(alphabet='ab,"\n #'), min_size=2, max_size=2), min_size=1, max_size=5))
def test_the_reader_of_csv_agrees_with_pythons(rows):
    buffer = io.StringIO()
    csv.writer(buffer, lineterminator="\n").writerows(rows)
    assert tables_read_back.read_csv(buffer.getvalue()) == rows


def tabular(body):
    return f"% a comment\n\\begin{{tabular}}{{ll}}\n{body}\n\\end{{tabular}}\n"


def test_the_reader_of_latex_does_what_latex_does():
    read = tables_read_back.read_latex
    assert read(tabular("a & b \\\\\n\\hline\n1 &  \\& \\\\")) == [["a", "b"], ["1", "&"]]
    assert read(tabular("a & b \\\\\n[1] & 2 \\\\")) == [["a", "b"], ["", "2"]]  # an argument
    assert read(tabular("a & b \\\\\n* & 2 \\\\")) == [["a", "b"], ["", "2"]]
    assert read(tabular("a & b \\\\\n{}[1] & {}* \\\\")) == [["a", "b"], ["[1]", "*"]]
    assert read(tabular("a & 100\\% % b\n\\\\")) == [["a", "100%"]]
    for bad in ("a & b", "a \\\\", "a_0 & b \\\\", "a & \\alpha \\\\", "a & # \\\\"):
        with pytest.raises(ValueError):
            read(tabular(bad))


@pytest.mark.parametrize("without", ["{}", "\\&", "\\textbackslash{}", "\\_"])
def test_a_missing_escape_is_seen(monkeypatch, without):
    good = console.latex_cell
    plain = {"{}": "", "\\&": "&", "\\textbackslash{}": "\\", "\\_": "_"}[without]
    monkeypatch.setattr(console, "latex_cell", lambda cell: good(cell).replace(without, plain, 1))
    found = list(tables_read_back.hostile(np.random.default_rng(1), 60))
    assert next(one for one in found if one.form == "latex").changed > 0


def test_a_star_after_a_lines_end_is_protected():
    r"""A cell "*" that follows "\\" was taken for its star."""
    printed = tables_read_back.shown("latex", [["a", "b"], ["*", "1"]])
    assert "\n{}*" in printed


def test_a_changed_digit_is_seen():
    assert tables_read_back.changed([["1", "1.50"]], [["1", "1.5"]]) == (2, 1)
    assert tables_read_back.changed([["1"]], [["1"], ["2"]]) == (2, 2)
    assert tables_read_back.changed([["1"]], [["1", "2"]]) == (2, 2)


# --- compiled ---------------------------------------------------------------------------------------------------------


def has_compiler():
    try:
        toolchain.find_compiler()
    except toolchain.ToolchainError:
        return False
    return True


@pytest.mark.parametrize("v_star", ["1e-300", "0.3", "4.5", "1e20", "1e200"])
@pytest.mark.parametrize("form", [DOUBLE, FLOAT])
def test_the_exact_quotient_in_mpmath(v_star, form):
    (kernel,) = requests.Request(pade=[(3, 6)]).quotients()
    a, b = ([Fraction(c) for c in part] for part in kernel.rounded(form))
    found = compiled_text.allowed(a, b, form, Fraction(v_star), kernel.threshold(form))
    with mpmath.workdps(60):
        v = mpmath.mpf(Fraction(v_star).numerator) / Fraction(v_star).denominator
        top, bottom = (mpmath.polyval([mpmath.mpf(float(c)) for c in part[::-1]], v) for part in (a, b))
        value = mpmath.mpf(found.value.numerator) / found.value.denominator
        assert abs(value * bottom / top - 1) < mpmath.mpf(10) ** -50
    unit = 2.0**-form.precision
    assert unit * float(found.value) <= found.error <= 60 * unit * float(found.value) + 2.0 ** (5 - form.largest)


@pytest.mark.parametrize(
    ("old", "new"), [("a2 + v_star * a3", "a2 + v_star * a3 * 1.0000000000000002"), ("u * u", "u")]
)
def test_a_header_that_computes_something_else_is_seen(old, new):
    if not has_compiler():
        pytest.skip("there is no C compiler")
    request = requests.Request(pade=[(3, 6)])
    header = request.render("c")
    assert old in header
    good, bad = (compiled_text.compiled(text)["epsilon_pade_3_6"] for text in (header, header.replace(old, new)))
    reference = compiled_text.python(request.render("python"))["epsilon_pade_3_6"]
    x = compiled_text.v_star_samples(np.random.default_rng(1), 500, DOUBLE)
    assert compiled_text.same(good, reference, x) == (len(x), 0)
    assert compiled_text.same(bad, reference, x)[1] > 0


def test_a_rounding_error_beyond_the_bound_is_seen():
    (kernel,) = requests.Request(pade=[(3, 6)]).quotients()
    (record,) = json.loads(requests.Request(pade=[(3, 6)]).render("json"))["approximants"]
    function = compiled_text.python(requests.Request(pade=[(3, 6)]).render("python"))["epsilon_pade_3_6"]
    found = compiled_text.TextComparison()
    x = np.geomspace(1e-3, 1e20, 40)
    for factor in (1, 1 + 2.0**-48):
        values = np.array([function(v) * factor for v in x.tolist()])
        compiled_text._compare_with_exact(kernel, record, DOUBLE, x, lambda _, values=values: values, found)
    good, bad = found.rows
    assert max(good[3:]) <= 1 < min(bad[3:])


@pytest.mark.parametrize("value", [math.nan, math.inf])
def test_an_export_that_gives_no_number_is_seen(value):
    request = requests.Request(pade=[(3, 6)])
    (kernel,), (record,) = request.quotients(), json.loads(request.render("json"))["approximants"]
    found = compiled_text.TextComparison()
    x = np.array([0.5, 1.0])
    compiled_text._compare_with_exact(kernel, record, DOUBLE, x, lambda _: np.array([value, value]), found)
    assert found.rows[0][3] == math.inf


def test_a_changed_coefficient_in_a_table_is_seen():
    text = "def epsilon_k(v_star: float) -> float:\n    a0 = 1.0\n    a1 = 0.5\n    b0 = 1.0\n    return a0\n"
    module, found = f"{text}\n\n{text.replace('_k', '_j').replace('0.5', '0.25')}", compiled_text.TextComparison()
    compare = compiled_text._compare_coefficients
    compare(((Fraction(1), Fraction(1, 2)), (Fraction(1), Fraction(0))), module, "epsilon_k", found)
    assert (found.coefficients, found.changed) == (4, 0)
    for a in ((Fraction(1), Fraction("0.50000000000001")), (Fraction(1),)):
        compare((a, (Fraction(1),)), module, "epsilon_k", found)
    assert found.changed == 2


def test_without_a_compiler_it_is_said(monkeypatch):
    def none(command=None):
        raise toolchain.ToolchainError("there is no C compiler 'cc'")

    monkeypatch.setattr(toolchain, "find_compiler", none)
    found = compiled_text.TextComparison()
    compiled_text.compare_quotients(requests.Request(pade=[(3, 6)]), np.random.default_rng(1), 20, found)
    assert found.compared == 0
    assert found.rows[0][2] > 10  # Python against exact values
    assert compiled_text.table(found).rows[-1][3] == "not run: no compiler"
    assert all(check.holds for check in compiled_text.checks(found))


def test_pairs_are_spheres_and_walls():
    generator = np.random.default_rng(4)
    pairs = [material_trips.random_pair(generator) for _ in range(60)]
    assert all(isinstance(pair, Pair) for pair in pairs)
    assert 5 < sum(pair.second.is_wall for pair in pairs) < 40
