"""The hard case of rounding modes: it passes, the mode is really another one, and a wrong header is found."""

import shutil

import pytest

from tests.lab.hard_cases.hard_case import (
    assert_goes_to_json_and_back,
    assert_passes,
    assert_readable,
    assert_same_checks,
)
from viscopade_lab.hard_cases import compilers, million, rounding_modes
from viscopade_lab.hard_cases.rounding_modes import BUILDS, CASE, MODES, NEAREST, measured, outcome

NEEDED = pytest.mark.skipif(
    shutil.which("gcc") is None or not million.enough(), reason="there is no gcc, or long double is too short here"
)
FULL = "viscopade_full.h"


@pytest.fixture
def few(monkeypatch):
    """Let the case take some headers and few arguments."""

    def take(*headers, number=400):
        monkeypatch.setattr(rounding_modes, "QUICK", headers)
        monkeypatch.setattr(rounding_modes, "NUMBER", {False: number, True: number})

    return take


@NEEDED
def test_quick_run_passes_and_is_readable():
    result = CASE.run(False)
    assert_passes(result)
    assert_readable(result)
    assert_goes_to_json_and_back(CASE, result)


def test_without_a_compiler_it_says_so_with_the_same_checks(monkeypatch):
    monkeypatch.setattr(compilers.shutil, "which", lambda name: None)
    result = CASE.run(False)
    assert_passes(result)
    assert result.summary.startswith("Not run")
    assert_same_checks(outcome([]), result)


@NEEDED
def test_each_mode_is_another_one(few):
    """Full accuracy has little but the last rounding: up to half an ulp to nearest, up to one in the other modes."""
    few(FULL)
    found = measured(False)
    assert len(found) == len(MODES) * len(BUILDS) * 2
    for one in found:
        assert (one.mode == NEAREST) == (one.moved == 0), one
        assert (one.mode == NEAREST) == (one.part <= 1), one
        assert one.doubled <= 1


@NEEDED
def test_results_of_directed_modes_lie_on_their_side(few, monkeypatch):
    few(FULL)
    sides = {}

    def kept(limit, mode, build, result, nearest):
        values = result[: len(limit.truth)] - limit.truth
        sides.setdefault((limit.function.form, mode), []).append((values > limit.unknown).mean())
        return error(limit, mode, build, result, nearest)

    error = rounding_modes._error
    monkeypatch.setattr(rounding_modes, "_error", kept)
    measured(False)
    above = {key: sum(shares) / len(shares) for key, shares in sides.items()}
    assert above["float", "upward"] > 0.9 > above["float", NEAREST] > 0.1 > above["float", "downward"]


@NEEDED
@pytest.mark.parametrize(
    ("old", "new", "number"),
    [
        ("tiny ? 0x1p-400", "tiny ? 0x1p-399", 0),
        ("const double a0 = -0x1.98b665097f1f3p-1", "const double a0 = -0x1.98c665097f1f3p-1", 1),
        ("if (!(v_star >= 0.0)) {", "if (v_star < 0.0) {", 2),
    ],
)
def test_a_wrong_header_is_found(few, old, new, number):
    few(FULL)
    text = compilers.header(FULL)
    assert old in text
    found = measured(False, lambda name: text.replace(old, new) if name == FULL else compilers.header(name))
    assert not outcome(found).checks[number].holds
