"""The benchmark: what it computes is right, what it finds is told truly. No times are asserted."""

import json
import math
import os
import shutil
import subprocess
import sys
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from tests import terminal
from tests.patience import HANGS
from viscopade.arithmetic.formats import DOUBLE, FLOAT
from viscopade.arrays.double import exact_of_speed as exact_at
from viscopade.collision import exact
from viscopade.kernels import requests, toolchain
from viscopade.kernels.toolchain import ToolchainError
from viscopade_lab import bench
from viscopade_lab.bench import calls, ours, rivals, tables
from viscopade_lab.bench.contender import ARRAY, MEASURES, SCALAR, Contender
from viscopade_lab.bench.goals import judged
from viscopade_lab.bench.harness import RUNS, ArraySizes, BenchError, Harness, Task, in_rounds
from viscopade_lab.bench.result import CALL, Key, _digits
from viscopade_lab.bench.speed_range import DISTRIBUTIONS, SpeedRange
from viscopade_lab.bench.times import rows as statistics

EXPORTS = Path(__file__).parents[2] / "exports"
TINY = ArraySizes(memory=1 << 12, cache=256, scalar=256, duration=1.0, sampled=1 << 10)
ICE = SpeedRange()

needs_compiler = pytest.mark.skipif(
    shutil.which(os.environ.get("CC", "cc")) is None, reason="no C compiler: CC is not set and there is no cc"
)


def of_exports(name):
    return toolchain.read_from(EXPORTS, name)


def harness_of(*kernels, speeds=ICE, headers=None):
    return Harness(kernels, headers or {}, toolchain.find_compiler(), speeds, TINY)


def rival(ident, speeds=ICE):
    return next(kernel for kernel in rivals.contenders(speeds) if kernel.id == ident)


# --- the speeds ---------------------------------------------------------------------------------------------------


@pytest.mark.parametrize("kind", DISTRIBUTIONS)
def test_speeds_are_the_same_at_every_call_and_within_the_range(kind):
    speeds = ICE.speeds(kind, 5000)
    assert np.array_equal(speeds[:100], ICE.speeds(kind, 100))
    assert ICE.speed_min <= speeds.min() <= speeds.max() <= ICE.speed_max


def test_speeds_are_distributed_as_they_are_called():
    size = 100_000
    logs = np.log10(ICE.speeds("log-uniform", size))
    assert np.quantile(logs, [0.25, 0.5, 0.75]) == pytest.approx([-1.5, 0, 1.5], abs=0.03)
    # Rayleigh's distribution: P(v > x) = exp(-x^2/2).
    thermal = ICE.speeds("maxwell", size) / ICE.typical
    assert thermal.mean() == pytest.approx(math.sqrt(math.pi / 2), rel=0.01)
    assert (thermal > 2).mean() == pytest.approx(math.exp(-2), rel=0.03)
    assert set(ICE.speeds("equal", 10)) == {ICE.typical}


def test_the_exact_values_are_those_of_the_proven_function():
    speed = ICE.speeds("log-uniform", 12)
    eps, loss = exact_at(speed, np.full(12, ICE.beta))
    for i, v in enumerate(speed.tolist()):
        true = exact.collision(None, 25, beta=ICE.beta, speed=v).floats()
        assert eps[i] == pytest.approx(true["epsilon"], rel=3e-16, abs=0)
        assert loss[i] == pytest.approx(true["one_minus_epsilon"], rel=9e-16, abs=0)


@pytest.mark.parametrize(
    ("options", "words"),
    [
        ({"beta": 0.0}, "beta is 0.0"),
        ({"beta": math.nan}, "beta is nan"),
        ({"speed_min": 2.0, "speed_max": 1.0}, "speed_min is 2.0: accepted is less than speed_max, 1.0"),
        ({"speed_min": -1.0}, "speed_min is -1.0"),
        ({"beta": 1e5}, "v\\* at speed_max is"),
        ({"unit": ""}, "unit is ''"),
        ({"unit": "a\nb"}, "unit is"),
    ],
)
def test_a_bad_range_is_refused_in_one_line(options, words):
    with pytest.raises(ValueError, match=words) as caught:
        bench.Settings(range=SpeedRange(**options))
    assert "accepted" in str(caught.value)
    assert "\n" not in str(caught.value)


@pytest.mark.parametrize(
    ("options", "words"),
    [
        ({"rounds": 0}, "rounds is 0"),
        ({"memory_elements": 10}, "memory_elements is 10"),
        ({"cuda": -1.0}, "cuda is -1.0"),
        ({"only": ("no-such",)}, "there is no kernel 'no-such': accepted are speed-1e-3, "),
    ],
)
def test_bad_settings_are_refused_in_one_line(options, words):
    with pytest.raises(ValueError, match=words) as caught:
        bench.Settings(**options)
    assert "\n" not in str(caught.value)


def test_the_command_has_what_was_asked_for():
    speeds = SpeedRange(beta=0.5, unit="m/s")
    settings = bench.Settings(rounds=7, range=speeds, only=("table", "full"), quick=True)
    assert settings.command == "viscopade bench --quick --rounds 7 --beta 0.5 --unit m/s --only table --only full"
    assert bench.Settings().command == "viscopade bench"


# --- what is measured computes what it should ---------------------------------------------------------------------


@needs_compiler
def test_every_rival_computes_what_it_should():
    kernels = rivals.contenders(ICE)
    harness = harness_of(*(kernel for kernel in kernels if kernel.id != "scipy"))
    harness.check()


@needs_compiler
@pytest.mark.parametrize("speeds", [SpeedRange(0.2, 1e-6, 1e-2, "m/s"), SpeedRange(1.0, 1.0, 1e6, "furlongs")])
def test_the_rivals_are_right_in_other_ranges(speeds):
    harness_of(*(kernel for kernel in rivals.contenders(speeds) if kernel.id != "scipy"), speeds=speeds).check()


def wrong_coefficient():
    kernel = rival("pow+[3/6]")
    assert "1.37842f" in kernel.source
    return replace(kernel, source=kernel.source.replace("1.37842", "1.37843"))


def only_float_wrong():
    kernel = rival("pow+[1/4]")
    return replace(kernel, source=kernel.source.replace("0.577977f", "0.587977f"))


def last_left_out():
    source = "static inline void leave(size_t n, const double *v, double b, double *out)\n"
    source += "{ for (size_t i = 0; i + 1 < n; i++) out[i] = b * v[i]; }"
    return replace(rival("copy"), source=source, scalar="", array="leave", formats=(DOUBLE,), measures=ARRAY)


def not_a_number():
    source = "static inline double nothing(double v, double b) { return v > 1.0 ? sqrt(-v) : b * v; }"
    return replace(rival("copy"), source=source, scalar="nothing", formats=(DOUBLE,))


def state_kept():
    """Right when called in order, wrong when the last result is not there: the latency's loop gives it the same."""
    source = "static inline double drift(double v, double b) { static double s; s += 1e-9; return b * v + s; }"
    return replace(rival("copy"), source=source, scalar="drift", formats=(DOUBLE,))


@needs_compiler
@pytest.mark.parametrize("wrong", [wrong_coefficient, only_float_wrong, last_left_out, not_a_number, state_kept])
def test_a_wrong_kernel_is_found(wrong):
    kernel = wrong()
    with pytest.raises(BenchError, match=r"computes rubbish: .* at speed .* where it should be ") as caught:
        harness_of(kernel).check()
    assert str(caught.value).startswith(kernel.id)


@needs_compiler
def test_results_of_another_kernel_do_not_help():
    with pytest.raises(BenchError, match=r"wrong .* computes rubbish: nan at speed"):
        harness_of(rival("copy"), replace(last_left_out(), id="wrong")).check()


@needs_compiler
def test_a_kernel_is_held_to_its_bound():
    file = "viscopade_minimax.h"
    text = (EXPORTS / file).read_text()
    kernel = next(kernel for kernel in ours.contenders({file: text}, ICE) if kernel.id == "minimax-2.84e-6")
    harness_of(kernel, headers={file: text}).check()
    with pytest.raises(BenchError, match="computes rubbish"):
        harness_of(replace(kernel, bound=1e-6, formats=(DOUBLE,)), headers={file: text}).check()


@needs_compiler
def test_all_exported_kernels_are_right():
    texts = {file: (EXPORTS / file).read_text() for file in ours.FILES.values()}
    kernels = ours.contenders(texts, ICE)
    harness = harness_of(*kernels, headers=texts)
    harness.check()
    assert {f"speed-{tier}" for tier in ours.TIERS} | {"full"} <= {kernel.id for kernel in kernels}
    for kernel in kernels:
        assert set(kernel.proven) == {form.name for form in kernel.formats}
        for form in kernel.formats:
            proven, (relative, loss) = kernel.proven[form.name], harness.largest_errors(kernel, form)
            assert proven, f"{kernel.id}: nothing is proven for {form.name}"
            # Where pow makes v*, its rounding is not in the proven number.
            pow_adds = 10 * form.epsilon if kernel.group == "ours" and not kernel.array else 0
            assert max(relative, loss) <= largest(proven, form) + pow_adds, kernel.id


def largest(proven, form):
    """A proven error as a number: an ulp is at most epsilon relative to eps, and eps/(1 - eps) < 3 on these speeds."""
    number, _, rest = proven.partition(" + ")
    if number.endswith("ulp"):
        number, rest = "0", number
    return float(number) + float(rest.removesuffix(" ulp") or 0) * form.epsilon * 3


def test_the_headers_are_exported():
    assert set(ours.FILES.values()) <= set(requests.NAMES)


def test_minimax_kernels_are_left_out_where_they_are_not_meant_for():
    file = "viscopade_minimax.h"
    texts = {file: (EXPORTS / file).read_text()}
    assert len(ours.contenders(texts, ICE)) == 3
    assert ours.contenders(texts, SpeedRange(beta=50.0)) == []


def test_what_is_proven_of_kernels_of_v_star():
    name = "minimax_3_7_v5_2p84em6"
    assert ours.named(name) == "2.84e-6"
    assert ours.proven_of_v_star(name, DOUBLE) == "2.85e-6"  # rounded up
    assert ours.proven_of_v_star(name, FLOAT) == "3.72e-6"
    assert ours.proven_of_v_star("halfline_3p4em6", DOUBLE) == "3.37e-6"
    assert ours.proven_of_v_star("halfline_3p4em6", FLOAT) == "6.70e-6"
    with pytest.raises(KeyError, match="no_such_kernel"):
        ours.proven_of_v_star("no_such_kernel", DOUBLE)


def test_what_is_proven_of_kernels_of_speed():
    name = "lookup_1_64_6p69em6"
    assert ours.proven_of_speed(name, DOUBLE, 2.0) == "6.70e-6 + 0.5 ulp"
    assert ours.proven_of_speed(name, FLOAT, 2.0) == "6.87e-6 + 0.5 ulp"
    assert ours.proven_of_speed(name, DOUBLE, 9.5) == ""  # not in the table only
    assert ours.proven_of_speed("lookup_5_16_3p79em12", FLOAT, 2.0).endswith(" + 0.501 ulp")
    assert ours.proven_of_speed("lookup_full", FLOAT, 2.0) == "0.501 ulp"


def test_the_rivals_have_the_papers_numbers():
    source = rival("pow+[3/6]").source
    for number in ("1.07232", "0.574198", "0.141552", "1.72765", "1.37842", "1.19449", "0.467273", "0.235585"):
        assert f"{number} " in source.replace(")", " ") or f"{number})" in source
    assert "-1.1534488580952888" in rival("pow+series20").source


def test_the_fit_has_an_error_for_ice_only():
    assert rival("fit").valid == (0.015, 2.0)
    low, high = rival("fit", SpeedRange(beta=1.0)).valid
    assert not low <= 1.0 <= high


@needs_compiler
def test_errors_are_found_where_they_are():
    """A kernel that is off by 1 % of eps, and one that is off by 1 % of 1 - eps, at fast speeds only."""
    table = rival("log-table")
    off = replace(table, id="off", source=table.source.replace("return table", "return 1.01 * table"), slack=1e14)
    fit = replace(off, id="fit", valid=(math.inf, math.inf))
    harness = harness_of(off, fit, replace(rival("copy")))
    relative, loss = harness.largest_errors(off, DOUBLE)
    eps, one_minus_eps = exact_at(harness.speeds(DOUBLE, "log-uniform", TINY.sampled), np.full(TINY.sampled, ICE.beta))
    assert relative == pytest.approx(0.01, rel=1e-2)
    assert loss == pytest.approx(0.01 * (eps / one_minus_eps).max(), rel=1e-2)
    assert harness.largest_errors(fit, DOUBLE) is None
    assert harness.largest_errors(rival("copy"), DOUBLE) is None


@needs_compiler
def test_a_kernel_gets_the_beta_of_its_pair():
    """With the other's beta, the check fails: the betas are not all the same."""
    source = "static inline void by_pair(size_t n, const double *v, const int *pair, const double *beta, double *out)\n"
    source += "{ for (size_t i = 0; i < n; i++) out[i] = beta[INDEX] * v[i]; }"
    right = replace(
        rival("copy"), source=source.replace("INDEX", "pair[i]"), scalar="", array="by_pair", beta="pair",
        formats=(DOUBLE,), measures=ARRAY,
    )  # fmt: skip
    harness_of(right).check()
    with pytest.raises(BenchError, match="computes rubbish"):
        harness_of(replace(right, source=source.replace("INDEX", "pair[0]"))).check()


# --- how it is measured -------------------------------------------------------------------------------------------


def counting(log, key, duration=lambda: 1.0):
    def run(passes):
        log.append((key, passes))
        return passes * duration()

    return Task(key, run, 10, 4)


def test_every_round_measures_everything_once_and_the_order_changes():
    log = []
    keys = [Key(name, "double", speeds, measure) for name in "abcd" for speeds in DISTRIBUTIONS for measure in MEASURES]
    times = in_rounds([counting(log, key) for key in keys], 5)
    assert set(times) == set(keys)
    assert all(len(values) == 5 for values in times.values())
    assert all((values == 0.1).all() for values in times.values())
    order = [key for key, passes in log if passes == 4][::RUNS]
    rounds = [order[i : i + len(keys)] for i in range(0, len(order), len(keys))]
    assert all(set(part) == set(keys) for part in rounds)
    blocks = [[part[i : i + 4] for i in range(0, len(part), 4)] for part in rounds]
    every = [block for of_round in blocks for block in of_round]
    for block in every:  # what is compared follows each other
        assert len({(key.speeds, key.measure) for key in block}) == 1
    assert len({tuple((part[0].speeds, part[0].measure) for part in of_round) for of_round in blocks}) == 5
    assert len({tuple(key.id for key in block) for block in every}) > 10


def test_all_but_arrays_from_memory_are_warmed_up():
    for measure in MEASURES:
        log = []
        counting(log, Key("a", "double", "equal", measure)).measure()
        assert [passes for _, passes in log] == ([4] * RUNS if measure == "memory" else [1] + [4] * RUNS)


def synthetic(changes):
    """Times of three rounds: pow + [3/6] takes 30, 60, 10 ns, the copy 1, 2, 4 ns, pow 20 ns, ours as given."""
    times = {}
    for speeds in DISTRIBUTIONS:
        for measure in MEASURES:
            times[Key("pow+[3/6]", "double", speeds, measure)] = np.array([30.0, 60.0, 10.0])
            times[Key("copy", "double", speeds, measure)] = np.array([1.0, 2.0, 4.0])
            times[Key("pow", "double", speeds, measure)] = np.array([20.0, 20.0, 20.0])
            for ident, values in changes.items():
                times[Key(ident, "double", speeds, measure)] = np.array(values)
    return times


def test_ratios_are_medians_of_the_ratios_of_a_round():
    times = synthetic({"speed-1e-5": [3.0, 3.0, 5.0]})
    names = {key.id: (key.id, "ours") for key in times}
    rows = {row.key: row for row in statistics(times, names, "pow+[3/6]", "copy")}
    row = rows[Key("speed-1e-5", "double", "equal", "cache")]
    assert (row.min, row.median, row.spread) == (3.0, 3.0, pytest.approx(1 / 3))
    assert row.ratio_to_3_6 == pytest.approx(0.1)  # of 0.1, 0.05, 0.5; the ratio of the medians is the same by chance
    assert row.ratio_to_copy == pytest.approx(1.5)  # of 3, 1.5, 1.25
    assert rows[Key("copy", "double", "equal", "cache")].ratio_to_copy == 1


def test_the_ratio_of_a_type_without_the_other_is_missing():
    times = {Key("a", "float", "equal", "cache"): np.ones(3)}
    (row,) = statistics(times, {"a": ("a", "ours")}, "pow+[3/6]", "copy")
    assert row.ratio_to_3_6 is None
    assert row.ratio_to_copy is None


def test_targets_are_reached_or_not():
    times = synthetic({"speed-1e-5": [3.0, 6.0, 1.0], "speed-1e-7": [4.0, 8.0, 1.0], "speed-full": [21.0, 22.0, 23.0]})
    found = list(judged(times, 8_000_000, restitution=1.25, cuda=None))
    assert [(target.measured, target.reached) for target in found] == [
        (pytest.approx(10.0), True),  # throughput, 1e-5: 8 times
        (pytest.approx(7.5), False),
        (pytest.approx(10.0), True),  # latency: 3 times
        (pytest.approx(7.5), True),
        (pytest.approx(3.0), False),  # memory: 1.25 times the copy
        (pytest.approx(4.0), False),
        (None, None),  # 1e-10 was not measured
        (pytest.approx(1.1), False),  # pow
        (pytest.approx(1.1), False),
        (1.25, False),
        (None, None),
    ]
    assert found[-1].note == "not measured: no GPU"
    assert found[6].note == "not measured"
    small = list(judged(times, 1000, None, cuda=1.05))
    assert [target.reached for target in small[4:6]] == [None, None]
    assert small[-1].reached is True


def test_the_fastest_of_some_runs_counts():
    durations = iter([9.0, 3.0, 1.0, 2.0])  # the first one is to warm up
    task = counting([], Key("a", "double", "equal", "cache"), lambda: next(durations))
    assert task.measure() == pytest.approx(1.0 / 10)


# --- the compiler -------------------------------------------------------------------------------------------------


def test_without_a_compiler_there_is_one_clear_line(monkeypatch):
    monkeypatch.setenv("CC", "no-such-compiler")
    with pytest.raises(ToolchainError, match=r"^there is no C compiler 'no-such-compiler': accepted is") as named:
        toolchain.find_compiler()
    monkeypatch.delenv("CC")
    monkeypatch.setenv("PATH", "")
    with pytest.raises(ToolchainError, match=r"^there is no C compiler 'cc': accepted is") as unnamed:
        toolchain.find_compiler()
    assert [isinstance(error.value, ValueError) for error in (named, unnamed)] == [True, False]  # bad input, or not


@needs_compiler
def test_the_first_error_of_the_compiler_is_told(tmp_path, monkeypatch):
    monkeypatch.setenv("TMPDIR", str(tmp_path))
    kernel = replace(rival("copy"), source="#warning beware\ndouble broken(double v { return v; }\ndouble worse(")
    with pytest.raises(ToolchainError, match=r"^\S+ fails: kernel0\.c:\d+:\d+: error: ") as caught:
        harness_of(kernel)
    assert "\n" not in str(caught.value)
    assert str(tmp_path) not in str(caught.value)


@needs_compiler
def test_missing_functions_are_told():
    with pytest.raises(ToolchainError, match="not_there"):
        harness_of(replace(rival("copy"), source="double not_there(double, double);", scalar="not_there"))


@needs_compiler
def test_a_compiler_with_arguments_may_be_named():
    words = os.environ.get("CC", "cc")
    assert toolchain.find_compiler(f"{words} -DVISCOPADE_TEST").words[-1] == "-DVISCOPADE_TEST"
    with pytest.raises(ToolchainError, match=r"fails: .*no_such_header"):
        toolchain.find_compiler(f"{words} -include no_such_header.h")


@needs_compiler
def test_fast_math_does_not_change_the_process():
    """Linked with -ffast-math, a library makes the whole process flush subnormal numbers to 0."""
    kernel = rival("pow+[3/6]-fast")
    harness = harness_of(kernel)
    harness.run(kernel, DOUBLE, "equal", "cache", 16)
    assert np.float64(5e-324) * 1.0 > 0


@needs_compiler
def test_the_scalar_loop_is_not_made_of_vector_instructions(tmp_path):
    """What would be a vector loop otherwise (the array is one, at -O3) stays a loop over single speeds."""
    if np.dtype(np.intp).itemsize != 8 or "x86" not in os.uname().machine:
        pytest.skip("the instructions looked for are those of x86")
    from viscopade_lab.bench.sources import frame, unit

    (tmp_path / "bench.h").write_text(frame())
    code = {}
    for library in ("scalar", "array"):
        (tmp_path / "unit.c").write_text(unit(rival("copy"), library))
        command = [*toolchain.find_compiler().words, "-O3", "-S", "-o", "-", "unit.c"]
        code[library] = subprocess.run(command, cwd=tmp_path, capture_output=True, text=True, check=True).stdout
    assert "mulpd" in code["array"]
    assert "mulpd" not in code["scalar"]
    assert "mulsd" in code["scalar"]


# --- end to end ---------------------------------------------------------------------------------------------------


ROW = {"id", "label", "group", "format", "speeds", "measure", "ns", "ratio_to_3_6", "ratio_to_copy"}
ERROR = {"id", "label", "group", "format", "relative", "loss", "proven", "proven_of", "note"}


@pytest.fixture(scope="module")
def quick():
    if shutil.which(os.environ.get("CC", "cc")) is None:
        pytest.skip("no C compiler: CC is not set and there is no cc")
    settings = bench.Settings(quick=True, only=("full", "table", "verlet", "fit"))
    return bench.run(settings, read=of_exports)


def test_the_result_has_the_shape_that_the_report_reads(quick):
    whole = json.loads(json.dumps(quick.to_json()))
    assert list(whole) == ["command", "machine", "settings", "rows", "errors", "targets", "curves"]
    assert whole["command"].startswith("Generated by viscopade ")
    assert whole["command"].endswith(": viscopade bench --quick --only full --only table --only verlet --only fit")
    assert set(whole["machine"]) == {"cpu", "compiler", "system", "python", "numpy"}
    assert all(isinstance(value, str) and value for value in whole["machine"].values())
    settings = whole["settings"]
    assert set(settings) == {"rounds", "scene", "memory_elements", "cache_elements", "flags"}
    assert settings["scene"] == {"beta": 1.307, "speed_min": 0.001, "speed_max": 1000.0, "unit": "cm/s"}
    assert settings["flags"]["scalar"] == "-O2"
    assert settings["flags"]["array"].startswith("-O3")
    for row in whole["rows"]:
        assert set(row) == ROW
        assert set(row["ns"]) == {"min", "median", "spread"}
        assert 0 < row["ns"]["min"] <= row["ns"]["median"] * 1.001
        assert row["speeds"] in DISTRIBUTIONS
        assert row["measure"] in MEASURES
        assert row["group"] in ("ours", "rival", "limit")
    assert all(set(error) == ERROR for error in whole["errors"])
    assert all(set(target) == {"what", "target", "measured", "reached", "note"} for target in whole["targets"])
    assert {error["id"] for error in whole["errors"]} == {row["id"] for row in whole["rows"]}


def test_all_that_was_asked_for_is_measured_and_the_two_references(quick):
    found = {(row.id, row.format, row.speeds, row.measure) for row in quick.rows}
    assert len(found) == len(quick.rows)
    for ident in ("full", "table", "fit", "copy", "pow+[3/6]"):
        for form in ("double", "float"):
            assert {(ident, form, speeds, measure) for speeds in DISTRIBUTIONS for measure in MEASURES} <= found
    assert {measure for ident, _, _, measure in found if ident == "verlet"} == {*SCALAR, "cache"}
    assert "adaptive" not in {ident for ident, *_ in found}


def test_the_references_are_1_of_themselves(quick):
    for row in quick.rows:
        assert (row.ratio_to_3_6 == 1) == (row.id == "pow+[3/6]") or row.ratio_to_3_6 is not None
        if row.id == "pow+[3/6]":
            assert row.ratio_to_3_6 == 1
        if row.id == "copy":
            assert row.ratio_to_copy == 1


def test_errors_are_those_that_are_known(quick):
    errors = {(error.id, error.format): error for error in quick.errors}
    assert errors["full", "double"].relative < 2e-15
    assert errors["full", "double"].proven == "0.571 ulp"
    assert {i for (i, _), error in errors.items() if error.proven_of == "v_star"} == {
        i for i, _ in errors if i == "full" or i.startswith(("half-line", "minimax"))
    }
    assert 0.005 < errors["pow+[3/6]", "double"].relative < 0.02
    assert errors["copy", "double"].relative is None
    assert "Bridges" in errors["fit", "double"].note
    assert 0.1 < errors["fit", "double"].relative < 1


def test_curves_are_those_of_our_kernels(quick):
    assert [curve.id for curve in quick.curves] == ["full"]
    (curve,) = quick.curves
    assert len(curve.v_star) == len(curve.error) == 400
    assert (np.diff(curve.v_star) > 0).all()
    assert curve.v_star[-1] <= ICE.v_star_max
    assert 1e-17 < max(curve.error) < 2e-15


@needs_compiler
def test_a_curve_shows_the_error_where_it_is():
    kernel = rival("log-table")
    curve = harness_of(kernel).error_curve(kernel)
    v_star, error = np.array(curve.v_star), np.array(curve.error)
    speed = (v_star / math.sqrt(ICE.beta)) ** 10
    eps, _ = exact_at(speed, np.full(len(speed), ICE.beta))
    assert error == pytest.approx(np.abs(kernel.expected(speed, np.array(ICE.beta)) - eps) / eps, rel=1e-3, abs=1e-9)


def test_labels_are_short_enough_for_a_picture():
    assert max(len(kernel.label) for kernel in rivals.contenders(ICE)) <= 40


def test_what_json_does_not_know_is_missing():
    assert [_digits(x) for x in (math.inf, math.nan, None, 1.23456)] == [None, None, None, 1.235]


def test_tables_show_every_number(quick):
    lines = tables.long(quick)
    assert len(lines) == len(quick.rows)
    assert all(len(line) == len(tables.HEADER) for line in lines)
    shown = list(tables.tables(quick))
    assert [table.title for table in shown[:3]] == [f"type double, {speeds} speeds" for speeds in DISTRIBUTIONS]
    assert shown[-1].title == "targets"
    for table in shown:
        assert all(len(row) == len(table.header) for row in table.rows)
        assert all(isinstance(cell, str) for row in table.rows for cell in row)
    assert any("Bridges" in line for line in tables.notes(quick))
    assert any("0.001 to 1000 cm/s" in line for line in tables.introduction(quick))


def test_numbers_keep_their_digits():
    assert [tables._number(x) for x in (None, 0.001234, 1.25, 30.04, 4.16e6)] == [
        "–",
        "0.00123",
        "1.25",
        "30",
        "4160000",
    ]


def test_an_unknown_part_of_a_known_name_is_refused():
    with pytest.raises(ValueError, match=r"there is no kernel 'minimax-5e-6': accepted are minimax-9\.87e-4, "):
        bench.run(bench.Settings(quick=True, only=("minimax-5e-6",)), read=of_exports)


def test_missing_headers_are_told(tmp_path):
    with pytest.raises(ValueError, match=r"cannot read .*viscopade_full.h: No such file or directory; accepted is"):
        bench.run(bench.Settings(quick=True, only=("full",)), read=lambda name: toolchain.read_from(tmp_path, name))


@needs_compiler
def test_the_call_from_python_is_compared_with_the_c_kernel(monkeypatch):
    c = replace(rival("copy"), id=calls.C)
    kernels = [c]
    monkeypatch.setattr(calls.viscopade, "restitution", lambda speed, beta: beta * speed)
    both = calls.tasks(harness_of(c), kernels)
    times = in_rounds(both, 3)
    assert {key.measure for key in times} == {CALL}
    assert calls.ratio(times) > 0
    assert list(statistics(times, {}, "pow+[3/6]", "copy")) == []
    monkeypatch.setattr(calls.viscopade, "restitution", lambda speed, beta: beta * speed * 1.0001)
    with pytest.raises(BenchError, match="return different results"):
        calls.tasks(harness_of(c), kernels)
    assert calls.tasks(harness_of(c), []) == []
    assert calls.ratio({}) is None


def test_scipy_integrates_the_same_collision():
    pytest.importorskip("scipy")
    kernel = rival("scipy")
    speed = ICE.speeds("log-uniform", 3)
    taken, eps = kernel.python(speed, ICE.beta)
    assert taken > 0
    assert eps == pytest.approx(exact_at(speed, np.full(3, ICE.beta))[0], rel=1e-5)


def test_a_contender_needs_a_function_for_each_measure():
    with pytest.raises(ValueError, match="needs a C function"):
        Contender("a", "a", "ours", lambda speed, beta: speed, array="f")


# --- the command line ---------------------------------------------------------------------------------------------


def command(*words, **environment):
    return subprocess.run(
        [sys.executable, "-m", "viscopade", "bench", *words],
        capture_output=True, text=True, timeout=HANGS, env=os.environ | environment,
    )  # fmt: skip


@needs_compiler
def test_the_command_prints_and_writes(tmp_path):
    out = tmp_path / "bench.json"
    result = command("--quick", "--rounds", "2", "--only", "table", "--out", str(out), "--format", "json")
    assert result.returncode == 0, result.stderr
    assert result.stderr == ""
    whole = json.loads(result.stdout)
    assert whole == json.loads(out.read_text())
    assert whole["settings"]["rounds"] == 2
    again = command("--quick", "--rounds", "1", "--only", "table", "--out", str(out))
    assert again.returncode == 0, again.stderr
    assert "type float, equal speeds" in again.stdout
    assert "targets" in again.stdout
    assert json.loads(out.read_text())["settings"]["rounds"] == 1


@pytest.mark.parametrize("width", terminal.WIDTHS)
def test_no_number_is_cut_on_a_terminal(quick, width, monkeypatch):
    monkeypatch.setattr(bench, "run", lambda *_: quick)
    shown = terminal.on_terminal(monkeypatch, ["bench"], width)
    terminal.assert_nothing_is_cut(terminal.run(["bench"]), shown, width)


@pytest.mark.parametrize(
    ("words", "status", "line"),
    [
        (["--rounds", "0"], 2, "rounds"),
        (["--only", "nothing"], 2, "viscopade: there is no kernel 'nothing': accepted are"),
        (["--speed-min", "10", "--speed-max", "1"], 2, "viscopade: speed_min is 10.0"),
        (["--beta", "x"], 2, "beta is 'x'"),
        (["--cc", "no-such-compiler"], 2, "viscopade: there is no C compiler 'no-such-compiler'"),
    ],
)
def test_bad_options_get_one_line(words, status, line):
    result = command("--quick", *words)
    assert result.returncode == status
    assert line in result.stderr
    assert result.stderr.count("\n") == 1
    assert result.stdout == ""
