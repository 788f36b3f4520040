"""The hard case of compilers: it passes, its truth is right, and it fails for headers that are wrong."""

import shutil
from fractions import Fraction

import numpy as np
import pytest

from tests.lab.hard_cases.hard_case import assert_passes
from viscopade.arrays import double
from viscopade.theory.paper import TABLE
from viscopade.theory.series import series
from viscopade_lab.hard_cases import compilers
from viscopade_lab.hard_cases.compilers import Build, StatedError

NEEDS_GCC = pytest.mark.skipif(shutil.which("gcc") is None, reason="there is no gcc")
PADE = "viscopade_pade.h"


@pytest.fixture(scope="module")
def given():
    return compilers.reference_points(False)


def one_build(monkeypatch, flags=("-O2",), rules="bits", headers=(PADE,)):
    """Let the case take one compiler, one set of flags and some headers."""
    monkeypatch.setattr(compilers, "tools", lambda thorough: {"gcc": (shutil.which("gcc"), False)})
    monkeypatch.setattr(compilers, "builds", lambda thorough, cpp: [Build(flags, rules, headers=headers)])


def failing(given, made):
    """Return the numbers of the checks that do not hold."""
    return [i for i, check in enumerate(compilers.outcome(given, made).checks) if not check.holds]


def test_quick_run_passes():
    result = compilers.CASE.run(False)
    assert_passes(result)


@pytest.mark.slow
def test_thorough_run_passes():
    result = compilers.CASE.run(True)
    assert_passes(result)


def test_without_a_compiler_it_says_so(monkeypatch):
    monkeypatch.setattr(compilers.shutil, "which", lambda name: None)
    result = compilers.CASE.run(False)
    assert result.passes
    assert result.summary.startswith("Not run")


def test_the_chart_sets_builds_with_fast_math_apart():
    """They are promised no bound, so the mark that stands above it must say why."""
    builds = [Build(("-O2",), "bits"), Build(("-O2", "-ffast-math"), "fast"), Build(("-O3",), "bits")]
    made = [compilers.BuildResult("gcc", build, (), (), "") for build in builds]
    errors = [compilers.BuildErrors(part, 0.0, 0, 0) for part in (0.5, 1.8, 0.6)]
    curves = {c.name: (c.x, c.y) for c in compilers._chart(list(zip(made, errors, strict=True))).curves}
    assert curves.pop("proven") == ((1, 3), (1, 1))
    assert curves == {"gcc": ((1, 3), (0.5, 0.6)), "-ffast-math: no bound promised": ((2,), (1.8,))}


def test_truth_is_that_of_another_computation(given):
    v_star, speed, epsilon = (given.arguments[over] for over in compilers.OVER)
    for kind, expected in {
        "epsilon": double.epsilon(v_star),
        "one_minus_epsilon": double.one_minus_epsilon(v_star),
        "restitution": double.epsilon(speed**0.1),
        "v_star": double.v_star_from(epsilon),
    }.items():
        truth = given.truth[kind]
        assert np.all(np.abs(expected - truth.high) <= 4e-15 * truth.high)
        assert np.all(np.abs(truth.low) <= np.spacing(truth.high) / 2)


@NEEDS_GCC
def test_compiled_values_are_those_of_the_formula(given, monkeypatch):
    """[1/4] with Fractions, from the series: what is left is rounding."""
    one_build(monkeypatch)
    given, (made,) = compilers.run_builds(False)
    h = [Fraction(text) for text in series(5, 40).decimals()]
    index = next(i for i, f in enumerate(made.functions) if (f.name, f.form) == ("pade_1_4", "double"))
    assert (1, 4) in TABLE
    # b from sum_j b_j h_(k-j) = 0 for k = 2 .. 5, a from k = 0, 1 (h_1 = h_3 = 0 makes b_1 = 1.07... solvable by hand).
    matrix = [[h[k - j] if k >= j else Fraction(0) for j in range(1, 5)] for k in range(2, 6)]
    b = [Fraction(1), *solved(matrix, [-h[k] for k in range(2, 6)])]
    a = [sum(b[j] * h[k - j] for j in range(k + 1)) for k in range(2)]
    for v, value in zip(given.arguments["v_star"], made.results[index], strict=False):
        x = Fraction(float(v))
        true = sum(c * x**k for k, c in enumerate(a)) / sum(c * x**k for k, c in enumerate(b))
        assert abs(Fraction(float(value)) / true - 1) <= Fraction(2, 10**15)


def solved(matrix, right):
    """Return the solution of a small linear system, by Gauss."""
    rows = [[*row, r] for row, r in zip(matrix, right, strict=True)]
    for i in range(len(rows)):
        pivot = next(k for k in range(i, len(rows)) if rows[k][i])
        rows[i], rows[pivot] = rows[pivot], rows[i]
        rows[i] = [x / rows[i][i] for x in rows[i]]
        for k in range(len(rows)):
            if k != i:
                rows[k] = [x - rows[k][i] * y for x, y in zip(rows[k], rows[i], strict=True)]
    return [row[-1] for row in rows]


@NEEDS_GCC
@pytest.mark.parametrize(
    ("header", "old", "new", "check"),
    [
        (PADE, "#define VISCOPADE_COMMON\n", "#define VISCOPADE_COMMON\nstatic void unused(int x) {}\n", 0),
        (PADE, "return numerator / denominator;", "return numerator / denominator + (v_star > 1 ? 0.3 : 0);", 1),
        ("viscopade_full.h", "return head + (loss ? lost - rest", "return head + (loss ? -rest", 1),
        ("viscopade_full.h", "if (!(v_star >= 0.0)) {", "if (v_star < 0.0) {", 3),
    ],
)
def test_a_wrong_header_is_found(monkeypatch, header, old, new, check):
    one_build(monkeypatch, headers=(header,))
    assert old in compilers.header(header)
    assert check in failing(*compilers.run_builds(False, lambda name: compilers.header(name).replace(old, new)))


@NEEDS_GCC
def test_more_than_a_few_ulp_with_fast_math_are_found(monkeypatch):
    one_build(monkeypatch, ("-O2", "-ffast-math"), "fast", ("viscopade_full.h",))
    assert failing(*compilers.run_builds(False)) == []
    wrong = ("return head + (", "return head * (1 + 0x1p-48) + (")
    assert failing(*compilers.run_builds(False, lambda name: compilers.header(name).replace(*wrong))) == [4, 5]


@NEEDS_GCC
def test_builds_that_differ_in_a_bit_are_found(monkeypatch):
    one_build(monkeypatch)
    given, (made,) = compilers.run_builds(False)
    changed = [np.array(r) for r in made.results]
    changed[0][0] = np.nextafter(changed[0][0], 2)
    assert failing(given, [made, made._replace(results=tuple(changed))]) == [2]


def test_flags_that_a_compiler_does_not_know_are_left_out():
    made = compilers.BuildResult("gcc", Build(("-m32",), "bits"), (), (), "gcc: unrecognized option '-mabc'")
    assert compilers.missing(made)
    assert not compilers.missing(made._replace(reason="viscopade-check.c:3: error: unused variable 'x'"))


def test_what_is_proven_is_taken_from_the_record():
    assert compilers.stated_error("epsilon", "pade_3_6", "float") == StatedError(
        ((0.5, 5.47e-6), (1.0, 2.6e-4), (2.0, 0.00659), (5.0, 0.064)), 1.1e-6, high=5.0
    )
    with pytest.raises(KeyError, match="nothing is proven"):
        compilers.stated_error("epsilon", "no_such_kernel", "double")
