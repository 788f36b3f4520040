"""Nearly elastic collisions: the quick run passes, numbers by the series and fractions, and that checks can fail."""

import math
import re
from dataclasses import replace
from fractions import Fraction
from pathlib import Path

import mpmath
import numpy as np
import pytest

import viscopade as vp
from tests.lab.hard_cases.hard_case import assert_passes, assert_readable
from viscopade.arithmetic.formats import DOUBLE, FLOAT
from viscopade.kernels import registry
from viscopade.kernels.forms import last_place, speed_table_last_place
from viscopade.theory.paper import TABLE
from viscopade_lab.hard_cases import exported
from viscopade_lab.hard_cases import near_elastic as case

EXPORTS = Path(__file__).parents[3] / "exports"
each_form = pytest.mark.parametrize("form", [DOUBLE, FLOAT], ids=lambda form: form.name)


@pytest.fixture(scope="module")
def result():
    return case.CASE.run(False)


@pytest.fixture(scope="module")
def ways():
    return {(way.kernel, way.form): way for way in case.ways()}


def test_quick_run_passes(result):
    assert_passes(result)
    assert len(result.checks) == 7
    assert_readable(result)


@pytest.mark.slow
def test_thorough_run_passes():
    assert_passes(case.CASE.run(True))


# --- by other ways ----------------------------------------------------------------------------------------------------


def by_series(v_star):
    """Return 1 - eps by the series, to 25 digits for v* <= 1e-2."""
    h = vp.series(24, 40).decimals()
    return -sum(Fraction(c) * v_star**k for k, c in enumerate(h) if k)


@pytest.mark.parametrize("v_star", ["1e-2", "1e-4", "1e-8", "1e-20", "1e-160"])
def test_truth_by_the_series(v_star):
    true = by_series(Fraction(v_star))
    found = case.exact_losses(Fraction(v_star))
    assert abs(found.loss / true - 1) < Fraction(1, 10**24)
    assert abs(found.dissipation / (1 - (1 - true) ** 2) - 1) < Fraction(1, 10**24)


def test_truth_at_a_beta():
    beta = 1e-16
    mp = mpmath.mp.clone()
    mp.dps = 40
    root = Fraction(str(mp.sqrt(mp.mpf(beta))))
    assert abs(case.exact_losses(Fraction(0), beta).loss / by_series(root) - 1) < Fraction(1, 10**24)


def test_headline_numbers(result):
    """The naive 1 - eps of 1 - 1.1534e-16 is 2^-53, and an a_1 off by 1e-5 adds -1e-5 v* to the formula's 1 - eps."""
    true = by_series(Fraction(1, 10**8))
    nearest = DOUBLE.nearest(1 - true)
    assert nearest == 1 - 2.0**-53
    assert f"{float(abs(Fraction(1 - nearest) / true - 1)):.1%} there" in result.summary
    assert f"by a factor of {float(Fraction(1, 10**13) / true):.3g} there" in result.summary
    assert 1 - vp.epsilon(1e-8) == 2.0**-53
    assert 1 - vp.epsilon(5e-9) == 0


def test_the_paper_keeps_a_1_equal_b_1():
    assert all(a[1] == b[1] for (m, _), (a, b) in TABLE.items() if m)


@each_form
def test_best_quotients_at_0(form):
    """1 - N/D = (b_2 - a_2) v*^2 + …, against lambda_1 v*^2."""
    a, b = exported.minimax_coefficients(3, 7, form)
    assert a[1] == b[1]
    limit = abs((Fraction(b[2]) - Fraction(a[2])) / -Fraction(vp.series(2, 40).decimals()[2]) - 1)
    found = next(q for q in case.best() if q.name == f"best [3/7], {form.name}").loss_error(Fraction(1, 10**12))
    assert found == pytest.approx(float(limit), rel=1e-4)


def test_bounds_are_those_of_the_headers(ways):
    half_line = (EXPORTS / "viscopade_half_line.h").read_text()
    words = " ".join(line.strip(" *") for line in half_line.splitlines())
    assert max(map(int, re.findall(r"underflow: adds at most (\d+) of", words))) == case.UNDERFLOW
    stated = re.findall(
        r"halfline_\w+ source:.*?<= (\S+) (?:in type double and \S+ in type float )?rounding of epsilon: .*?"
        r"rounding of one_minus_epsilon: adds at most (\S+) \(1 - eps\) in type double",
        words,
    )
    assert len(stated) == 3
    for (bound, rounding), accuracy in zip(stated, exported.HALF_LINE, strict=True):
        relative = ways[f"half-line {accuracy}", DOUBLE].relative
        assert (
            Fraction(bound) + Fraction(rounding)
            <= relative
            <= (Fraction(bound) + Fraction("5e-14")) * Fraction(102, 100)
        )


def test_every_exported_function_is_there(ways):
    kernels = {kernel for kernel, _ in ways}
    for entry in registry.entries():
        if entry.kind != "v*" and entry.size == "fast":
            name = {"speed": "table", "full": ""}.get(entry.kind, entry.kind)
            assert f"{name} {entry.tier}".strip() in kernels


def test_the_functions_are_the_exported_ones(ways):
    v_star = 1e-8
    assert ways["full", DOUBLE].of(v_star) == last_place.evaluated_in(DOUBLE, "one_minus_epsilon", v_star)
    # eps of the table's kernel at speed 1: where it is no longer 1, 1 - eps^2 is that of it.
    beta = np.array([1e-4])
    eps = float(speed_table_last_place.restitution(np.ones(1), beta)[0])
    assert ways["table full", DOUBLE].of(1e-4) == pytest.approx(1 - eps**2, rel=1e-10, abs=0)


def test_the_python_module_gives_the_same(ways):
    found = {}
    exec((EXPORTS / "viscopade_half_line.py").read_text(), found)
    names = [name for name in found if name.startswith("one_minus_epsilon_")]
    assert len(names) == 6  # with those that last
    for name, accuracy in zip(names, 2 * list(exported.HALF_LINE), strict=True):
        for v_star in (0.5, 1e-3, 1e-8, 1e-100, 1e-160):
            assert ways[f"half-line {accuracy}", DOUBLE].of(v_star) == pytest.approx(
                found[name](v_star), rel=1e-15, abs=0
            )


# --- that the checks can fail -----------------------------------------------------------------------------------------


def failing(way):
    errors = {way: [way.error(v_star) for v_star in (1e-3, 1e-8, 1e-20)]}
    return [check.holds for check in case._checks(errors, {way: way.error(case.V_STAR)})][:2] != [True, True]


@pytest.mark.parametrize(
    "key",
    [
        ("full", DOUBLE),
        ("half-line 1e-5", DOUBLE),
        ("half-line 1e-5", FLOAT),
        ("table 1e-7", DOUBLE),
        ("table full", FLOAT),
    ],
)
def test_a_naive_difference_would_fail(ways, key):
    way = ways[key]
    assert not failing(way)

    def naive(x):
        # Of the eps that belongs to what the function returns, rounded to the type.
        kind = np.float32 if way.form == FLOAT else np.float64
        eps = kind(1) - kind(way.of(x) / (2 if way.gives == "1 - eps^2" else 1))
        return float((kind(1) - eps) * (kind(1) + eps) if way.gives == "1 - eps^2" else kind(1) - eps)

    assert failing(replace(way, of=naive))


def test_a_wrong_coefficient_would_fail(ways):
    way = ways["half-line 1e-5", DOUBLE]
    assert failing(replace(way, of=lambda x: way.of(x) * (1 + 1e-5)))
    exact = ways["full", DOUBLE]
    assert failing(replace(exact, of=lambda x: math.nextafter(exact.of(x), math.inf)))


def test_coefficients_rounded_apart_would_fail(monkeypatch):
    """a_1 one unit in the last place from b_1: 1 - N/D is then wrong by u v*."""
    true = list(case.best())
    assert all(q.loss_error(Fraction(1, 10**8)) <= 1.02 * q.error for q in true)
    off = [q._replace(a=(q.a[0], q.a[1] + Fraction(1, 2**24), *q.a[2:])) for q in true]
    monkeypatch.setattr(case, "best", lambda: iter(off))
    way = next(case.ways())
    checks = list(case._checks({way: [way.error(1e-8)]}, {way: way.error(1e-8)}))
    assert [check.holds for check in checks] == [True] * 6 + [False]


def test_eps_with_more_digits_would_not_be_lost(monkeypatch):
    """If eps were computed in more than the type, the naive difference would not be off by u/4."""
    monkeypatch.setattr(
        case, "naive", lambda form: {"full": lambda x: 1 - vp.double.one_minus_epsilon(x.astype(float))}
    )
    case.lost.cache_clear()
    assert float(np.min(case.lost(FLOAT).share)) < 0.5
    case.lost.cache_clear()


@each_form
def test_nothing_is_said_where_nothing_is_stated(ways, form):
    way = ways["compact 1e-3", form]
    assert all(map(math.isnan, way.error(float(way.low) / 2)))
    assert not math.isnan(way.error(float(way.low) * 1.1)[0])
    assert all(map(math.isnan, ways["table full", form].error(0.5)))


def test_one_more_in_the_last_printed_digit():
    """The table prints 1.07232 and 0.553528. A unit d of the former makes 1 - eps of [3/6] smaller by d v*."""
    off = {q.name: q for q in case.printed_quotients(off=True)}
    assert set(off) == {
        f"Padé [{m}/{n}], a_1 + {d}" for m, n, d in ((1, 4, "0.000001"), (2, 5, "0.000001"), (3, 6, "0.00001"))
    }
    for quotient, (m, n) in zip(off.values(), ((1, 4), (2, 5), (3, 6)), strict=True):
        a_1 = TABLE[m, n][0][1]
        assert quotient.a[1] - Fraction(a_1) == Fraction(10) ** -len(a_1.partition(".")[2])
    error = off["Padé [3/6], a_1 + 0.00001"].loss_error(Fraction(1, 10**8))
    assert error == pytest.approx(1e-5 * 1e-8 / (1.1534488580 * 1e-16), rel=1e-6)
