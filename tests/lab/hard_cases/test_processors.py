"""The hard case of processors: it passes, its truth and limits are right, and it fails for what is wrong."""

import shutil
from dataclasses import replace

import mpmath
import numpy as np
import pytest

from tests.lab.hard_cases.hard_case import (
    assert_goes_to_json_and_back,
    assert_passes,
    assert_readable,
    assert_same_checks,
)
from viscopade.arithmetic.balls import to_mpf
from viscopade.collision import exact
from viscopade_lab.hard_cases import compilers, million, processors
from viscopade_lab.hard_cases.compilers import HEADERS, TYPES
from viscopade_lab.hard_cases.processors import HERE, TARGETS

NEEDS_GCC = pytest.mark.skipif(shutil.which("gcc") is None, reason="there is no gcc")
NEEDS_LONG_DOUBLE = pytest.mark.skipif(not million.enough(), reason="long double is too short here for the truth")
FULL, HALF_LINE = "viscopade_full.h", "viscopade_half_line.h"
SPEED = "viscopade_speed_1em5.h"


def named(name):
    """Return a processor, or skip the test where its tools are missing."""
    target = next(target for target in TARGETS if target.name == name)
    if target.missing():
        pytest.skip(f"{target.missing()} is missing: apt-get install {target.packages}")
    return replace(target, builds=target.builds[:1])


@pytest.fixture
def few(monkeypatch):
    """Let the case take some headers and few arguments."""

    def take(*headers, number=400):
        monkeypatch.setattr(processors, "QUICK", headers)
        monkeypatch.setattr(processors, "NUMBER", {False: number})

    return take


def failing(found):
    """Return the numbers of the checks that do not hold."""
    return [i for i, check in enumerate(processors.outcome(found).checks) if not check.holds]


@NEEDS_GCC
@NEEDS_LONG_DOUBLE
def test_quick_run_passes_and_is_readable():
    result = processors.CASE.run(False)
    assert_passes(result)
    assert_readable(result)
    assert_goes_to_json_and_back(processors.CASE, result)


def test_without_a_compiler_it_says_so_with_the_same_checks(monkeypatch):
    monkeypatch.setattr(processors.shutil, "which", lambda name: None)
    result = processors.CASE.run(False)
    assert_passes(result)
    assert result.summary.startswith("Not run")
    assert "apt-get install" in result.summary
    assert_same_checks(processors.outcome([]), result)


def test_a_processor_without_its_emulator_is_left_out_and_named(monkeypatch):
    there = {"gcc", "s390x-linux-gnu-gcc"}
    monkeypatch.setattr(processors.shutil, "which", lambda name: name if name in there else None)
    assert processors.present() == (HERE,)
    assert next(target for target in TARGETS if target.order == ">").missing() == "qemu-s390x"
    assert all(target.packages in processors.INSTALL for target in TARGETS)


@NEEDS_LONG_DOUBLE
@pytest.mark.parametrize(
    ("over", "arguments"),
    [("v_star", (1e-30, 2e-4, 0.07, 0.9, 6.5, 3e5, 1e25)), ("speed", (1e-250, 1e-20, 0.3, 70.0, 1e12, 1e80))],
)
def test_truth_is_that_of_the_exact_computation(over, arguments):
    found = million.long_double_values(over, np.array(arguments))
    with mpmath.workdps(40):
        for i, x in enumerate(arguments):
            true = exact.collision(**({"v_star": x} if over == "v_star" else {"beta": 1, "speed": x}))
            for got, value in ((found.epsilon[i], true.epsilon), (found.loss[i], true.one_minus_epsilon)):
                assert abs(exactly(got) / to_mpf(value) - 1) <= million.UNCERTAINTY


@NEEDS_LONG_DOUBLE
@pytest.mark.parametrize("of_loss", [False, True])
def test_inverse_is_that_of_the_truth(of_loss):
    x = np.concatenate([10 ** np.random.default_rng(3).uniform(-300, 0, 200), np.linspace(0.01, 0.99, 99), [5e-324]])
    found = million.long_double_inverse(x, of_loss)
    back = million.long_double_values("v_star", found.v_star)
    smaller = np.minimum(found.epsilon, found.loss)
    assert np.all(np.abs(back.smaller / smaller - 1) <= 4 * million.UNCERTAINTY)
    with mpmath.workdps(40):
        true = exact.invert(**{"one_minus_epsilon" if of_loss else "epsilon": 0.375}).v_star
        assert (
            abs(exactly(million.long_double_inverse(np.array([0.375]), of_loss).v_star[0]) / to_mpf(true) - 1) < 1e-17
        )


def exactly(number):
    """Return a long double as a number of mpmath."""
    high = np.float64(number) if abs(number) > 1e-290 else np.ldexp(number, 1200).astype(np.float64)
    shift = 0 if abs(number) > 1e-290 else -1200
    low = np.float64(np.ldexp(number, -shift) - np.longdouble(high))
    return mpmath.ldexp(mpmath.mpf(float(high)) + mpmath.mpf(float(low)), shift)


@NEEDS_LONG_DOUBLE
def test_derivative_is_the_slope_of_eps():
    x = np.array([1e-20, 1e-3, 0.3, 1.7, 4.9], dtype=np.longdouble)
    h = x * np.longdouble(2) ** -18
    ends = [million.long_double_values("v_star", x + sign * h).loss for sign in (1, -1)]
    slope = -(ends[0] - ends[1]) / (2 * h)
    assert np.all(np.abs(million.long_double_values("v_star", x).of("epsilon_derivative") / slope - 1) < 1e-9)


@NEEDS_LONG_DOUBLE
def test_every_header_states_its_functions_and_every_argument_of_the_speed_is_judged():
    claims = million.stated_bounds({name: compilers.header(name) for name in HEADERS})
    assert set(claims) == set(HEADERS)
    assert all(claims.values())
    truth = processors.ReferenceValues(processors.arguments(300))
    for name in HEADERS:
        for claim in claims[name]:
            limits = truth.limits(claim)
            everywhere = claim.elsewhere is not None or claim.function.name.startswith(("full", "halfline", "inverse"))
            assert np.all(limits.allowed > 0)
            assert np.all(np.isfinite(limits.allowed)) == everywhere


def test_arguments_are_of_all_sizes_and_at_ends_of_rows():
    given = processors.arguments(40_000)
    for (over, form), x in given.arguments.items():
        tiny = np.finfo(TYPES[form]).tiny
        assert (x.dtype, len(x)) == (TYPES[form], 40_000)
        assert np.all((x > 0) & np.isfinite(x))
        assert np.any(x < tiny)
        assert over == "epsilon" or np.any(np.log2(x) % 1 == 0)
        assert over != "epsilon" or np.all(x < 1)
    assert len(given.first(10).given("speed", "float")) == 10 + len(processors.SPECIAL["speed"])


@NEEDS_GCC
@NEEDS_LONG_DOUBLE
@pytest.mark.parametrize(
    ("header", "old", "new", "check"),
    [
        (FULL, "#define VISCOPADE_FULL_DOUBLE\n", "#define VISCOPADE_FULL_DOUBLE\nstatic void unused(int x) {}\n", 0),
        (FULL, "return head + (loss ? lost - rest", "return head + (loss ? -rest", 1),
        (FULL, "tiny ? 0x1p-400", "tiny ? 0x1p-399", 1),
        (HALF_LINE, "return loss ? lost", "return loss ? 1.001 * lost", 1),
        (SPEED, "return what == VISCOPADE_REBOUND ? eps * speed", "return what == VISCOPADE_REBOUND ? speed", 1),
        (FULL, "if (!(v_star >= 0.0)) {", "if (v_star < 0.0) {", 3),
    ],
)
def test_a_wrong_header_is_found(few, header, old, new, check):
    few(header)
    text = compilers.header(header)
    assert old in text
    texts = {header: text.replace(old, new)}
    found = processors.run_programs(False, lambda name: texts.get(name) or compilers.header(name), [HERE])
    assert check in failing(found)


@NEEDS_GCC
@NEEDS_LONG_DOUBLE
def test_a_processor_that_computes_otherwise_is_found(few):
    """A build that claims the same bits, but is of another order of sums."""
    few(SPEED, number=2000)
    other = replace(
        HERE, name="other", builds=(("-O2 -fassociative-math -fno-signed-zeros -fno-trapping-math", "bits", "c99"),)
    )
    found = processors.run_programs(False, targets=[HERE, other])
    assert found[0].differ == 0 < found[1].differ_plain
    assert 4 in failing(found)


@NEEDS_LONG_DOUBLE
def test_numbers_of_a_big_endian_processor_are_read_as_such(few):
    few(SPEED)
    target = named("s390x")
    right, wrong = processors.run_programs(False, targets=[target, replace(target, name="wrong", order="<")])
    assert right.part <= 1 < wrong.part


@NEEDS_GCC
@NEEDS_LONG_DOUBLE
@pytest.mark.slow
@pytest.mark.parametrize("name", [target.name for target in TARGETS])
def test_every_header_keeps_its_bounds(few, name, monkeypatch):
    few(*HEADERS, number=20_000)
    target = named(name)
    monkeypatch.setattr(processors, "NUMBER", {True: 20_000})
    assert failing(processors.run_programs(True, targets=[HERE, *([target] if target != HERE else [])])) == []
