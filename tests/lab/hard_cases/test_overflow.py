"""Overflow and underflow: the quick run passes, its thresholds by fractions and by C, and that its checks can fail."""

import math
from dataclasses import replace
from fractions import Fraction

import numpy as np
import pytest
from flint import arb

from tests import compiled
from tests.lab.hard_cases.hard_case import assert_passes, assert_readable
from tests.lab.hard_cases.test_kernel_rounding import horner, library
from viscopade.arithmetic.formats import DOUBLE, FLOAT, FORMATS
from viscopade.kernels.expressions import Name
from viscopade.kernels.forms import last_place
from viscopade_lab.hard_cases import exported
from viscopade_lab.hard_cases import overflow as case


@pytest.fixture(scope="module")
def result():
    return case.CASE.run(False)


@pytest.fixture(scope="module")
def kernels():
    chosen = [*case.quotients(((1, 4), (3, 7))), *case.half_lines(("1e-5",))]
    return {(kernel.name, kernel.form): kernel for kernel in chosen}


def failing(kernels, **changes):
    """Return what fails for kernels with changes of `case`."""
    chosen = list(kernels)
    fails = [case.failure(kernel) for kernel in chosen]
    return [check.statement for check in case._checks(chosen, fails, False) if not check.holds]


def test_quick_run_passes(result):
    assert_passes(result)
    assert len(result.checks) == 7
    assert_readable(result)


@pytest.mark.slow
def test_thorough_run_passes():
    assert_passes(case.CASE.run(True))


def test_arguments_are_of_all_sizes():
    for form, kind in ((DOUBLE, np.float64), (FLOAT, np.float32)):
        x = case.all_sizes(form, 2)
        information = np.finfo(kind)
        assert x.dtype == kind
        assert {0.0, float(information.max), math.inf, float(information.smallest_subnormal)} <= set(x.tolist())
        assert not np.any(np.isnan(x) | (x < 0))
        assert np.count_nonzero((x > 0) & (x < information.tiny)) >= 3 * information.nmant
        assert set(np.frexp(x[np.isfinite(x) & (x > 0)])[1]) == set(
            range(3 - form.largest - form.precision, form.largest + 2)
        )


# --- thresholds -------------------------------------------------------------------------------------------------------


@pytest.mark.parametrize("form", [DOUBLE, FLOAT], ids=lambda form: form.name)
def test_where_plain_quotients_fail_by_fractions(kernels, form):
    """The denominator's exact value reaches 2^(largest + 1) there, but for roundings; likewise the numerator's."""
    kernel = kernels["best [3/7]", form]
    a, b = exported.minimax_coefficients(3, 7, form)
    fail = case.failure(kernel)
    for part, at in ((b, fail.zero), (a, fail.nan)):
        for factor, overflows in ((1 - 2.0**-20, False), (1 + 2.0**-20, True)):
            assert (horner(part, Fraction(at * factor)) >= Fraction(2) ** (form.largest + 1)) == overflows


def test_where_eps_is_too_small_to_be_lost(monkeypatch):
    """D = 1 + b_2 v*^2 overflows where 1/D is no number any more: the plain quotient's 0 is right then."""
    kernel = next(case.quotients(()))
    monkeypatch.setattr(exported.ExportedFunction, "exact", lambda self, x: arb(x) ** -20)
    assert case.failure(kernel) == (math.inf, math.inf)


def test_exported_forms_are_the_c_code(kernels, tmp_path):
    built = library(tmp_path)
    names = {
        "best [1/4]": "minimax_1_4_v5_9p87em4",
        "best [3/7]": "minimax_3_7_v5_2p84em6",
        "half-line 1e-5": "halfline_3p4em6",
    }
    names |= {f"Padé [{m}/{n}]": f"pade_{m}_{n}" for m, n in ((0, 3), (1, 4), (2, 5), (3, 6))}
    for (name, form), kernel in kernels.items():
        c = built[f"epsilon_{names[name]}{form.suffix}"]
        x = np.concatenate([case.all_sizes(form, 1), case._of_type(case.REFUSED, form)])
        found, expected = kernel.exported(x), np.array([c(v) for v in x.tolist()], x.dtype)
        if not kernel.near.roots:
            assert np.array_equal(found, expected, equal_nan=True), (name, form.name)
        else:
            smallest = float(form.smallest)
            assert np.allclose(found, expected, rtol=128 * 2.0**-form.precision, atol=64 * smallest, equal_nan=True)


def test_c_code_of_full_accuracy_and_speed_at_the_ends(tmp_path):
    texts = [
        (compiled.Path(__file__).parents[3] / "exports" / f"viscopade_{name}.h").read_text()
        for name in ("full", "speed_full")
    ]
    built = compiled.build(tmp_path, texts)
    x = [*case.all_sizes(DOUBLE, 0)[::5].tolist(), *case.REFUSED]
    for name in last_place.FUNCTIONS:
        assert np.array_equal(
            [built[f"{name}_full"](v) for v in x],
            last_place.evaluated_in(DOUBLE, name, x),
            equal_nan=True,
        )


# --- that the checks can fail -----------------------------------------------------------------------------------------


def test_an_export_in_powers_of_v_star_only_fails(kernels):
    for name in ("best [3/7]", "half-line 1e-5"):
        kernel = kernels[name, DOUBLE]
        assert failing([kernel, kernels["Padé [3/6]", DOUBLE]]) == []
        broken = failing([replace(kernel, change=math.inf), kernels["Padé [3/6]", DOUBLE]])
        assert any("finite number" in statement for statement in broken)
        assert any("at large v*" in statement for statement in broken)


def test_a_change_to_powers_of_one_over_v_star_that_is_too_late_fails(kernels):
    kernel = kernels["best [3/7]", DOUBLE]
    broken = failing([replace(kernel, change=kernel.change * 2.0**200)])
    assert any("finite number" in statement or "at large v*" in statement for statement in broken)


def test_a_missing_power_fails(kernels):
    kernel = kernels["best [3/7]", DOUBLE]
    far = replace(kernel.far, result=Name("numerator") / Name("denominator") * Name("u"))
    assert any("at large v*" in statement for statement in failing([replace(kernel, far=far)]))


def test_a_kernel_that_leaves_the_range_fails(kernels):
    kernel = kernels["half-line 1e-5", DOUBLE]
    far = replace(kernel.far, constants={**kernel.far.constants, "b15": -0.06})
    assert any(
        "within [0, 1]" in statement for statement in failing([replace(kernel, far=far), kernels["Padé [3/6]", DOUBLE]])
    )


def test_wrong_results_of_full_accuracy_are_counted(monkeypatch):
    assert case._full() == case._of_speed() == 0
    true = last_place.evaluated_in

    def wrong(form, name, x):
        return np.where(np.asarray(x) == math.inf, 0.5, true(form, name, x))

    monkeypatch.setattr(last_place, "evaluated_in", wrong)
    assert case._full() == 4
    assert case._of_speed() > 0  # beyond its table, eps is that of v*
    monkeypatch.setattr(case, "restitution", lambda speed, beta: np.where(speed >= 0, 0.5, np.nan))
    assert case._of_speed() > 100


@pytest.mark.parametrize("form", FORMATS.values(), ids=FORMATS)
def test_the_bound_of_products_covers_all_roundings(form):
    u = Fraction(1, 1 << form.precision)
    for number in (1, 2, 5, 16):
        found = max((1 + u) ** number - 1, 1 - (1 - u) ** number)
        assert found <= case.product_bound(number, form) < (number + Fraction(1, 999)) * u
