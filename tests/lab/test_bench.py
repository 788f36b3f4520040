"""The benchmark: what it computes is right, what it finds is told truly. No times are asserted."""

import json
import math
import os
import re
import shutil
import subprocess
from dataclasses import replace
from fractions import Fraction
from functools import cache
from pathlib import Path

import numpy as np
import pytest

from tests.cli import called
from viscopade.arithmetic.formats import DOUBLE, FLOAT
from viscopade.arrays.double import exact_of_speed as exact_at
from viscopade.collision import exact
from viscopade.kernels.write.runners import ToolchainError
from viscopade_lab import bench
from viscopade_lab.bench import libraries, ours, picture, rivals
from viscopade_lab.bench.contender import ARRAY, MEASURES, SCALAR
from viscopade_lab.bench.harness import RUNS, BenchError, Harness, Key, Sizes, Task, c_file, in_rounds, proven_error
from viscopade_lab.bench.result import COLUMNS, HEADER, Row, from_csv, table, to_csv
from viscopade_lab.bench.speeds import BETA, SPEED_MAX, SPEED_MIN, speeds

EXPORTS = Path(__file__).parents[2] / "exports"
BENCH = Path(__file__).parents[2] / "docs" / "bench"
RUN = "epyc.csv"
TINY = Sizes(memory=1 << 12, scalar=256, duration=1.0, sampled=1 << 12)


@pytest.fixture(scope="module")
def _compiler():
    if shutil.which(os.environ.get("CC", "cc")) is None:
        pytest.skip("no C compiler: CC is not set and there is no cc")


needs_compiler = pytest.mark.usefixtures("_compiler")


def of_exports(name):
    return libraries.read_from(EXPORTS, name)


def harness_of(*kernels, headers=None):
    return Harness(kernels, headers or {}, libraries.find_compiler(), TINY)


def errors_of(kernel, form=DOUBLE):
    return harness_of(kernel).errors(kernel, form)


@cache
def rival(ident):
    return next(kernel for kernel in rivals.contenders() if kernel.id == ident)


# --- the speeds ---------------------------------------------------------------------------------------------------


def test_speeds_are_the_same_at_every_call_and_log_uniform():
    values = speeds(100_000)
    assert np.array_equal(values[:100], speeds(100))
    assert SPEED_MIN <= values.min() <= values.max() <= SPEED_MAX
    assert np.quantile(np.log10(values), [0.25, 0.5, 0.75]) == pytest.approx([-1.5, 0, 1.5], abs=0.03)


def test_the_exact_values_are_those_of_the_proven_function():
    speed = speeds(12)
    eps, loss = exact_at(speed, np.full(12, BETA))
    for i, v in enumerate(speed.tolist()):
        true = exact.collision(None, 25, beta=BETA, speed=v).floats()
        assert eps[i] == pytest.approx(true["epsilon"], rel=3e-16, abs=0)
        assert loss[i] == pytest.approx(true["one_minus_epsilon"], rel=9e-16, abs=0)


# --- what is measured computes what it should ---------------------------------------------------------------------


@needs_compiler
def test_every_rival_computes_what_it_should():
    kernels = rivals.contenders()
    harness = harness_of(*kernels)
    for kernel in kernels:
        for form in kernel.formats:
            harness.errors(kernel, form)


def test_a_vector_library_that_is_not_installed_is_left_out_with_a_reason(monkeypatch):
    (sleef, _) = rivals.VECTOR_LIBRARIES
    monkeypatch.setattr(rivals, "VECTOR_LIBRARIES", (replace(sleef, files=("libnone.so",)),))
    assert "pow+[3/6]-sleef" not in {kernel.id for kernel in rivals.contenders()}
    assert rivals.absent() == ["left out: pow+[3/6]-sleef; SLEEF is not installed: apt-get install libsleef3"]


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
def test_a_wrong_kernel_is_refused(wrong):
    kernel = replace(wrong(), id="wrong")
    harness = harness_of(rival("copy"), kernel)
    harness.errors(rival("copy"), DOUBLE)  # its results must not stand in for those that are not written
    with pytest.raises(BenchError, match=r"^wrong .* computes rubbish: .* at speed .* where it should be "):
        [harness.errors(kernel, form) for form in kernel.formats]


@pytest.fixture(scope="module")
def exported(_compiler):
    """A harness of all exported kernels."""
    kernels = list(ours.contenders())
    return harness_of(
        *kernels, headers={kernel.header: of_exports(kernel.header) for kernel in kernels if kernel.header}
    )


def test_all_exported_kernels_meet_what_is_proven_of_them(exported):
    for kernel in exported.contenders:
        for form in kernel.formats:
            assert form.name in kernel.proven
            exported.errors(kernel, form)


def test_an_error_beyond_its_proof_is_refused(exported):
    (kernel,) = (kernel for kernel in exported.contenders if kernel.id == "speed-1e-10")
    largest = max(exported.errors(kernel, DOUBLE))
    smaller = replace(
        kernel.proven["double"],
        formula=Fraction(0.9 * largest),
        rounding=Fraction(0),
        last=Fraction(0),
        ulps=Fraction(0),
    )
    wrong = replace(kernel, proven={"double": smaller})
    with pytest.raises(BenchError, match=r"^speed-1e-10 \(double, latency\) contradicts its proof: "):
        exported.errors(wrong, DOUBLE)


def test_an_error_relative_to_eps_is_larger_relative_to_one_minus_eps():
    (kernel,) = (kernel for kernel in ours.contenders() if kernel.id == "minimax-2.84e-6")
    bound = kernel.proven["float"]
    (eps,), (loss,) = exact_at(np.array([SPEED_MIN]), np.array([BETA]))
    error = float(bound.relative) * loss + float(bound.last) * eps  # what the bound allows at the lowest speed
    assert error == pytest.approx(float(proven_error(bound, FLOAT)) * loss, rel=1e-12)
    assert error > 1.2 * loss * float(bound.relative + bound.last)


def test_what_is_proven_is_what_the_headers_state():
    proven = {kernel.id: kernel.proven for kernel in ours.contenders()}
    for ident, name in (
        ("speed-1e-5", "restitution_1em5"),
        ("speed-1e-10", "restitution_1em10"),
        ("full", "epsilon_full"),
    ):
        header = of_exports(f"viscopade_{'full' if ident == 'full' else name.replace('restitution', 'speed')}.h")
        stated = float(re.search(rf"VISCOPADE_{name.upper()}_ERROR (\S+) ", header)[1])
        error = proven[ident]["double"].relative or proven[ident]["double"].ulps
        assert 0.9 * stated < error <= stated  # rounded up to a few digits
    assert proven["full"]["double"].result == "epsilon"  # the rounding of v* comes on top
    assert proven["speed-full"]["double"].result == "restitution"


@needs_compiler
def test_errors_are_seen_where_they_are():
    """A kernel that is off by 1 % of eps, one without a speed for which an error makes sense, and a limit."""
    table = rival("log-table")
    off = replace(table, source=table.source.replace("return table", "return 1.01 * table"), slack=1e14)
    relative, loss = errors_of(off)
    eps, one_minus_eps = exact_at(speeds(TINY.sampled), np.full(TINY.sampled, BETA))
    assert relative == pytest.approx(0.01, rel=1e-2)
    assert loss == pytest.approx(0.01 * (eps / one_minus_eps).max(), rel=1e-2)
    assert errors_of(replace(off, valid=(math.inf, math.inf))) is None
    assert errors_of(rival("copy")) is None


# --- how it is measured -------------------------------------------------------------------------------------------


def counting(log, key, duration=lambda: 1.0):
    def run(passes):
        log.append((key, passes))
        return passes * duration()

    return Task(key, run, 10, 4)


def test_every_round_measures_everything_once_and_the_order_changes():
    log = []
    keys = [Key(name, form, measure) for name in "abcd" for form in ("double", "float") for measure in MEASURES]
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
        assert len({(key.format, key.measure) for key in block}) == 1
    assert len({tuple((part[0].format, part[0].measure) for part in of_round) for of_round in blocks}) == 5
    assert len({tuple(key.id for key in block) for block in every}) > 10


def test_all_but_arrays_from_memory_are_warmed_up():
    for measure in MEASURES:
        log = []
        counting(log, Key("a", "double", measure)).measure()
        assert [passes for _, passes in log] == ([4] * RUNS if measure == "memory" else [1] + [4] * RUNS)


def test_ratios_are_medians_of_the_ratios_of_a_round():
    def key(ident):
        return Key(ident, "double", "cache")

    times = {key("pow+[3/6]"): [30.0, 60.0, 10.0], key("copy"): [1.0, 2.0, 4.0], key("fit"): [3.0, 3.0, 5.0]}
    times = {key: np.array(values) for key, values in times.items()} | {Key("fit", "float", "cache"): np.ones(3)}
    (row,) = bench._rows(times, rival("fit"), DOUBLE, (1e-3, 1e-2))
    assert (row.min_ns, row.median_ns, row.spread) == (3.0, 3.0, pytest.approx(1 / 3))
    assert row.ratio_to_3_6 == pytest.approx(0.1)  # of 0.1, 0.05, 0.5; the ratio of the medians is the same by chance
    assert row.ratio_to_copy == pytest.approx(1.5)  # of 3, 1.5, 1.25
    (row,) = bench._rows(times, rival("copy"), DOUBLE, None)
    assert row.ratio_to_copy == 1
    (row,) = bench._rows(times, rival("fit"), FLOAT, None)
    assert row.ratio_to_3_6 is None
    assert row.ratio_to_copy is None


def test_the_fastest_of_some_runs_counts():
    durations = iter([9.0, 3.0, 1.0, 2.0])  # the first one is to warm up
    task = counting([], Key("a", "double", "cache"), lambda: next(durations))
    assert task.measure() == pytest.approx(1.0 / 10)


# --- the compiler -------------------------------------------------------------------------------------------------


def test_without_a_compiler_there_is_one_clear_line(monkeypatch):
    monkeypatch.setenv("CC", "no-such-compiler")
    with pytest.raises(
        ToolchainError, match=r"^there is no compiler 'no-such-compiler' that starts: expected"
    ) as named:
        libraries.find_compiler()
    monkeypatch.delenv("CC")
    monkeypatch.setenv("PATH", "")
    with pytest.raises(ToolchainError, match=r"^there is no cc or gcc or clang: expected") as unnamed:
        libraries.find_compiler()
    assert [isinstance(error.value, ValueError) for error in (named, unnamed)] == [True, False]  # bad input, or not


@needs_compiler
def test_the_first_error_of_the_compiler_is_told(tmp_path, monkeypatch):
    monkeypatch.setenv("TMPDIR", str(tmp_path))
    kernel = replace(rival("copy"), source="#warning beware\ndouble broken(double v { return v; }\ndouble worse(")
    with pytest.raises(
        ToolchainError, match=r"^the benchmark is not built: \S+: (?:\S*bench\.c:)\d+:\d+: error: "
    ) as caught:
        harness_of(kernel)
    assert "\n" not in str(caught.value)
    assert str(tmp_path) not in str(caught.value)


@needs_compiler
def test_a_compiler_with_arguments_may_be_named():
    words = os.environ.get("CC", "cc")
    assert libraries.find_compiler(f"{words} -DVISCOPADE_TEST").words[-1] == "-DVISCOPADE_TEST"
    with pytest.raises(ToolchainError, match=r"is not built: .*no_such_header"):
        libraries.find_compiler(f"{words} -include no_such_header.h")


@needs_compiler
def test_fast_math_does_not_change_the_process():
    """Linked with -ffast-math, a library makes the whole process flush subnormal numbers to 0."""
    kernel = rival("pow+[3/6]-fast")
    harness = harness_of(kernel)
    harness.run(kernel, DOUBLE, "cache", 16)
    assert np.float64(5e-324) * 1.0 > 0


@needs_compiler
def test_the_scalar_loop_is_not_made_of_vector_instructions(tmp_path):
    """What would be a vector loop otherwise (the array is one, at -O3) stays a loop over single speeds."""
    if np.dtype(np.intp).itemsize != 8 or "x86" not in os.uname().machine:
        pytest.skip("the instructions looked for are those of x86")
    (tmp_path / "bench.c").write_text(c_file([rival("copy")]))
    code = {}
    for library in ("scalar", "array"):
        part = f"-DBENCH_LIBRARY_{library.upper()}"
        command = [*libraries.find_compiler().words, "-O3", part, "-S", "-o", "-", "bench.c"]
        code[library] = subprocess.run(command, cwd=tmp_path, capture_output=True, text=True, check=True).stdout
    assert "mulpd" in code["array"]
    assert "mulpd" not in code["scalar"]
    assert "mulsd" in code["scalar"]


# --- end to end ---------------------------------------------------------------------------------------------------


@pytest.fixture(scope="module")
def quick(_compiler):
    return bench.run(bench.contenders(("full", "table", "verlet", "fit")), of_exports, 2, TINY)


def test_all_that_was_asked_for_is_measured_and_the_two_references(quick):
    _, rows = quick
    found = {(row.id, row.format, row.measure) for row in rows}
    assert len(found) == len(rows)
    for ident in ("table", "fit", "copy", "pow+[3/6]"):
        for form in ("double", "float"):
            assert {(ident, form, measure) for measure in MEASURES} <= found
    assert {measure for ident, _, measure in found if ident == "verlet"} == {*SCALAR, "cache"}
    assert "adaptive" not in {ident for ident, *_ in found}
    for row in rows:
        assert row.ratio_to_3_6 == 1 or row.id != "pow+[3/6]"
        assert 0 < row.min_ns <= row.median_ns


def test_unknown_names_and_missing_headers_are_told(tmp_path):
    with pytest.raises(ValueError, match=r"there is no kernel 'minimax-5e-6': expected one of speed-1e-5, "):
        bench.contenders(("minimax-5e-6",))
    with pytest.raises(ValueError, match=r"cannot read .*viscopade_full.h: No such file or directory; expected"):
        bench.run(bench.contenders(("full",)), lambda name: libraries.read_from(tmp_path, name), 1, TINY)


# --- the file, the table and the picture --------------------------------------------------------------------------


def a_row(ident="a", time=1.0, relative=1e-3, proven=None, **changes):
    names = {"label": ident, "group": "ours", "format": "double", "measure": "throughput"}
    return Row(ident, **names | changes, min_ns=time, median_ns=time, spread=0.1, ratio_to_3_6=None, ratio_to_copy=2.0,
               relative=relative, loss=0.0, proven=proven)  # fmt: skip


def test_what_is_written_is_read(quick):
    comments, rows = quick
    text = to_csv(comments, rows)
    assert text.startswith("# Generated by viscopade ")
    again = from_csv(text.encode(), "a.csv")
    assert [(row.id, row.measure) for row in again] == [(row.id, row.measure) for row in rows]
    assert [row.median_ns for row in again] == pytest.approx([row.median_ns for row in rows], rel=1e-3)
    assert to_csv(comments, again) == text


@pytest.mark.parametrize(
    ("old", "new", "words"),
    [
        (",1,1,", ",1,inf,", "a.csv, row 1: median_ns is 'inf': expected a number that is not negative"),
        (",0.001,", ",x,", "a.csv, row 1: relative is 'x': expected a number that is not negative"),
        (",0.1,", ",,", "a.csv, row 1: spread is '': expected a number that is not negative"),
        (",0.1,", ",0.1,1,", "a.csv, row 1: expected 13 cells, not 14"),
        ("min_ns", "ns", "a.csv: expected the columns id,label,group,"),
        ("a,a", "\xff", "a.csv is not readable: expected what"),
        ("\n", "\n#", "a.csv: expected the columns id,label,group,"),
    ],
)
def test_a_wrong_file_is_refused_in_one_line(old, new, words):
    text = to_csv([], [a_row()])
    assert old in text
    with pytest.raises(ValueError) as caught:
        from_csv(text.replace(old, new).encode("latin-1"), "a.csv")
    assert str(caught.value).startswith(words)
    assert "\n" not in str(caught.value)


def test_the_table_has_a_line_for_each_type_and_digits_without_exponents(quick):
    lines = list(table(quick[1]))
    assert all(len(line) == len(HEADER) for line in lines)
    assert len(lines) == len({(row.id, row.format) for row in quick[1]})
    rows = [a_row(time=0.001234), a_row("b", 4.16e6)]
    assert [line[3] for line in table(rows)] == ["0.00123", "4160000"]


def test_the_error_shown_is_the_proven_one_unless_a_sampled_one_is_larger():
    assert a_row(relative=1e-3, proven=2e-3).error == 2e-3
    assert a_row(relative=1e-3, proven=9e-4).error == 1e-3
    assert not a_row(relative=1e-3, proven=9e-4).is_proven
    assert a_row(relative=1e-3).error == 1e-3


def test_the_frontier_has_what_nothing_beats():
    rows = [
        a_row("fast", 1, 0.1),
        a_row("beaten", 2, 0.2),
        a_row("better", 3, 1e-3),
        a_row("same", 4, 1e-3),
        a_row("best", 5, 0.0, 1e-9),
    ]
    assert [row.id for row in picture.frontier(rows)] == ["fast", "better", "best"]
    assert picture.points([a_row(format="float"), a_row("b", 2.0), a_row("a", 1.0)], "throughput")[0].id == "a"


def test_the_picture_is_drawn():
    """The same one every time; `test_the_command_prints_and_writes` draws one in another format."""
    pytest.importorskip("matplotlib")
    rows = [a_row("fast"), a_row("useless", 2e4, 1e7, group="rival"), a_row("copy", 0.5, None, group="limit")]
    content = picture.draw(rows, "svg")
    assert content == picture.draw(rows, "svg")
    assert b"Generated by viscopade" in content
    for label in ("fast", "copy", "useless", "(error 1e7 ↑, 20 µs →)"):
        assert f"<!-- {label} -->".encode() in content
    with pytest.raises(ValueError, match="no times in type double"):
        picture.draw([a_row(format="float")], "svg")


def test_the_committed_results_are_readable_and_the_picture_has_their_labels():
    text = (BENCH / "speed_against_error.svg").read_text("utf-8")
    rows = from_csv((BENCH / RUN).read_bytes(), RUN)
    assert {"copy", "pow", "pow+[3/6]", "speed-1e-5", "speed-full", "full"} <= {row.id for row in rows}
    assert "<!-- (proven for rounded v*) -->" in text
    shown = picture.points(rows, "throughput")
    assert [row.label for row in shown if f"<!-- {row.label}" not in text] == []


def test_the_pages_ratios_are_those_of_the_file():
    page = (BENCH.parent / "results" / "benchmark.md").read_text("utf-8")
    lines = [line.split(" | ")[1] for line in page.partition("| what | AMD")[2].splitlines()[2:10]]
    rows = (row for row in from_csv((BENCH / RUN).read_bytes(), RUN) if row.format == "double")
    of = {(row.id, row.measure): row for row in rows}
    full, power = (
        [of[ident, measure].median_ns for measure in ("throughput", "latency")] for ident in ("speed-full", "pow")
    )
    expected = [
        [1 / of["speed-1e-5", "throughput"].ratio_to_3_6],
        [1 / of["speed-1e-5", "latency"].ratio_to_3_6],
        [of["speed-1e-5", "memory"].ratio_to_copy],
        [of["speed-1e-10", "memory"].ratio_to_copy],
        [a / b for a, b in zip(full, power, strict=True)],
        [of["pow+[3/6]-fast", "memory"].ratio_to_copy],
        [of["exp-log+[3/6]-fast", "memory"].ratio_to_copy],
        [of["speed-1e-5", "cache"].ratio_to_copy],
    ]
    for line, numbers in zip(lines, expected, strict=True):
        assert [float(x) for x in re.findall(r"[\d.]+", line)] == pytest.approx(numbers, rel=0.008)


def test_the_pages_times_of_vector_pows_are_those_of_the_file():
    page = (BENCH.parent / "results" / "benchmark.md").read_text("utf-8")
    lines = [line.split(" | ") for line in page.partition("| array of doubles")[2].splitlines()[2:10]]
    rows = from_csv((BENCH / RUN).read_bytes(), RUN)
    ids = ("speed-1e-5", "speed-1e-10", "speed-full", "exp-log+[3/6]-fast", "pow+[3/6]-fast", "pow+[3/6]-sleef",
           "pow+[3/6]-mkl", "pow+[3/6]")  # fmt: skip
    chosen = (row for row in rows if (row.format, row.measure) == ("double", "cache"))
    times = {row.id: row.median_ns for row in chosen}
    assert [float(line[1]) for line in lines] == pytest.approx([times[ident] for ident in ids], rel=0.005)
    ratios = [float(line[2].rstrip(" |")) for line in lines]
    assert ratios == pytest.approx([times[ident] / times[ids[0]] for ident in ids], rel=0.05)


# --- the command line ---------------------------------------------------------------------------------------------


@needs_compiler
def test_the_command_prints_and_writes(tmp_path):
    out, drawn = tmp_path / "bench.csv", tmp_path / "bench.png"
    words = ("--quick", "--rounds", "1", "--only", "table", "--output", out, "--picture", drawn)
    result = called("bench", *words, "--format", "csv")
    assert result.returncode == 0, result.stderr
    assert result.stderr == ""
    assert result.stdout.splitlines()[0] == ",".join(COLUMNS)
    rows = from_csv(out.read_bytes(), "bench.csv")
    assert {row.id for row in rows} == {"table", "copy", "pow+[3/6]"}
    assert drawn.read_bytes().startswith(b"\x89PNG")
    again = called("bench", "--from", out, "--format", "json")
    assert len(json.loads(again.stdout)["rows"]) == len(rows)
