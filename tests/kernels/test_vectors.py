"""Test vectors: exported code in C, Rust and JavaScript passes them; a wrong constant fails; exact values are exact."""

import json
import random
import re
import subprocess
from fractions import Fraction
from functools import cache
from itertools import product
from pathlib import Path

import pytest
from mpmath import mp, mpf

from tests import compiled, daily
from tests.kernels.languages import tool
from tests.patience import HANGS
from viscopade.arithmetic.formats import DOUBLE, FLOAT, FORMATS
from viscopade.collision import exact
from viscopade.kernels import catalogue, machine, requests
from viscopade.kernels.write import vectors
from viscopade.kernels.write.vectors import COLUMNS, hard_arguments, hexadecimal

ROOT = Path(__file__).parents[2]
EXPORTS, RUNNERS = ROOT / "exports", ROOT / "examples" / "vectors"
NAMES = [name for name in requests.NAMES if name.startswith("vectors_")]
EVERY = pytest.mark.parametrize("name", NAMES)
COMPACT, TABLE = "vectors_compact.json", "vectors_speed_1em5.json"


@cache
def rows(name):
    """Return all vectors of a file."""
    found = json.loads((EXPORTS / name).read_text())["vectors"]
    return [dict(zip(COLUMNS, row, strict=True)) for row in found]


def run(*words):
    done = subprocess.run(list(map(str, words)), capture_output=True, text=True, timeout=HANGS)
    assert done.stderr == ""
    return done.returncode, done.stdout


def in_c(folder, header, name, *flags, words=()):
    """Compile the runner with a header's functions that have vectors, and run it."""
    wanted = sorted({(row["y"] == "-", row["type"] == "float", row["function"]) for row in rows(name)})
    calls = [f"{'ONE' if one else 'TWO'}{'F' * in_float}({function})" for one, in_float, function in wanted]
    program = folder / "check"
    run(
        *(compiled.compiler("c99")[0], "-std=c99", "-Wall", "-Wextra", "-Werror", "-Wno-unused-function", *flags),
        *(f"-I{header.parent}", f'-DHEADER="{header.name}"', f"-DFUNCTIONS={' '.join(calls)}"),
        *(RUNNERS / "check.c", "-lm", "-o", program),
    )
    return run(program, EXPORTS / name, *words)


def passing(name, types=("double", "float")):
    """Return what a runner prints."""
    number = sum(row["type"] in types for row in rows(name))
    return 0, f"{number} of {number} pass\n"


def header_of(name):
    """Return the header with the functions of vectors; that of compact kernels is for the host, too."""
    header = name.replace("vectors_", "viscopade_").replace(".json", ".h")
    return EXPORTS / ("viscopade.cuh" if name == COMPACT else header)


# --- code passes ------------------------------------------------------------------------------------------------------


@EVERY
def test_headers_pass_bit_for_bit_without_contraction(tmp_path, name):
    assert in_c(tmp_path, header_of(name), name, "-O2", "-ffp-contract=off", words=["bits"]) == passing(name)


def test_the_runner_in_c_as_it_says(tmp_path):
    source = RUNNERS / "check.c"
    run(compiled.compiler("c99")[0], "-std=c99", f"-I{EXPORTS}", source, "-lm", "-o", tmp_path / "check")
    status, printed = run(tmp_path / "check", EXPORTS / TABLE)
    number = sum(row["function"].partition("_")[0] in ("restitution", "rebound", "dissipation") for row in rows(TABLE))
    assert (status, printed) == (0, f"{number} of {number} pass\n")


def in_javascript(folder, module):
    """Run the runner with a copy of the module; by default it takes the module of exports."""
    (folder / "module.mjs").write_text(module)
    status, printed = run(tool("node"), RUNNERS / "check.mjs", EXPORTS / COMPACT, folder / "module.mjs")
    assert status or (0, printed) == run(tool("node"), RUNNERS / "check.mjs", EXPORTS / COMPACT)
    return status, printed


def in_rust(folder, module):
    """Compile the runner beside a copy of the module, and run it."""
    for path, text in (
        (folder / "exports" / "viscopade.rs", module),
        (folder / "examples" / "vectors" / "check.rs", (RUNNERS / "check.rs").read_text()),
    ):
        path.parent.mkdir(parents=True, exist_ok=True)
        path.write_text(text)
    run(tool("rustc"), "-O", folder / "examples" / "vectors" / "check.rs", "-o", folder / "check")
    return run(folder / "check", EXPORTS / COMPACT)


OTHERS = {"viscopade.mjs": (in_javascript, ["double"]), "viscopade.rs": (in_rust, ["double", "float"])}


@pytest.mark.parametrize("file", OTHERS)
def test_modules_of_other_languages_pass_and_fail_with_a_wrong_constant(tmp_path, file):
    (within, types), module = OTHERS[file], (EXPORTS / file).read_text()
    assert within(tmp_path, module) == passing(COMPACT, types)
    status, printed = within(tmp_path, changed(module))
    assert status == 1
    assert printed.count("\n") > 10


def test_a_file_that_is_missing_or_cut_or_of_other_functions_is_named(tmp_path):
    compiler = compiled.compiler("c99")[0]
    (tmp_path / "cut.json").write_text((EXPORTS / COMPACT).read_text()[:60_000])
    (tmp_path / "folder.json").mkdir()
    run(compiler, "-std=c99", f"-I{EXPORTS}", RUNNERS / "check.c", "-lm", "-o", tmp_path / "in_c")
    run(tool("rustc"), RUNNERS / "check.rs", "-o", tmp_path / "in_rust")
    for words in ([tmp_path / "in_c"], [tmp_path / "in_rust"], [tool("node"), RUNNERS / "check.mjs"]):
        for name in ("none.json", "cut.json", "folder.json"):
            done = subprocess.run([*words, tmp_path / name], capture_output=True, text=True, timeout=HANGS)
            assert (done.returncode, done.stderr.count("\n")) == (2, 1)
            assert re.match(rf"cannot read {tmp_path}/{name}\b.*\n", done.stderr)
    # Vectors of other functions: a line says what to give.
    in_node = [tool("node"), RUNNERS / "check.mjs"]
    for words, name in (([tmp_path / "in_c"], COMPACT), ([tmp_path / "in_rust"], TABLE), (in_node, TABLE)):
        done = subprocess.run([*words, EXPORTS / name], capture_output=True, text=True, timeout=HANGS)
        assert (done.returncode, done.stdout) == (1, "0 of 0 pass\n")
        assert re.match(r"no vector is of a function .*: (give|change) .*\n$", done.stderr)
    for words in (["bit"], ["bits", "bits"], []):
        paths = [EXPORTS / COMPACT] * bool(words)
        done = subprocess.run([tmp_path / "in_c", *paths, *words], capture_output=True, text=True, timeout=HANGS)
        assert (done.returncode, done.stderr) == (2, f"usage: {tmp_path}/in_c VECTORS.json [bits]\n")
    module = subprocess.run(
        [tool("node"), RUNNERS / "check.mjs", EXPORTS / COMPACT, "none.mjs"], capture_output=True, text=True
    )
    assert (module.returncode, module.stderr.count("\n")) == (2, 1)


# --- wrong code does not ----------------------------------------------------------------------------------------------


COEFFICIENT = re.compile(r"[ab][1-9]\d*(?:: f64)? = (?:VISCOPADE_CONSTANT\(-?0x1\.|-?[0-9]\.)(\w)")


def changed(text):
    """Return code with one wrong coefficient: of a formula, or of a row whose first number is among the vectors."""
    first = -64 if "viscopade_table_full" in text else -96
    in_table = (-33 - first) / 128  # there is a vector at w = 2^-33, and one at v* = 2^-4
    for table, share in (("viscopade_table_", in_table), ("double viscopade_panels_", 1 / 433)):
        if table in text:
            start, end = text.index("{\n", text.index(table)), text.index("};", text.index(table))
            lines = text[start:end].split("\n")
            at = 1 + round(len(lines[1:-1]) * share)
            lines[at] = re.sub(r"0x1\.(\w)", lambda m: f"0x1.{int(m[1], 16) ^ 8:x}", lines[at], count=1)
            return text[:start] + "\n".join(lines) + text[end:]
    at = COEFFICIENT.search(text).start(1)
    return text[:at] + ("9" if text[at] < "5" else "0") + text[at + 1 :]


@pytest.mark.parametrize("name", ["vectors_pade.json", TABLE, "vectors_full.json"])
def test_a_wrong_constant_in_c_fails(tmp_path, name):
    text = header_of(name).read_text()
    wrong = changed(text)
    assert wrong != text
    header = tmp_path / header_of(name).name
    header.write_text(wrong)
    status, printed = in_c(tmp_path, header, name, "-O2")
    assert status == 1
    assert re.fullmatch(r"(?s)-?(0x|nan).*\n\d+ of \d+ pass\n", printed)


# --- the files --------------------------------------------------------------------------------------------------------


@EVERY
def test_files_are_small_and_sscanf_can_read_their_lines(name):
    lines = [line for line in (EXPORTS / name).read_text().splitlines() if line.startswith('["')]
    assert len(lines) == len(rows(name))
    assert all(line.count('"') == 20 and len(line) < 300 for line in lines)
    assert sum((EXPORTS / other).stat().st_size for other in NAMES) < 800_000


@EVERY
def test_every_function_has_its_hard_cases(name):
    functions = {}
    for row in rows(name):
        functions.setdefault((row["function"], row["type"]), set()).add(row["x"])
    for (function, kind), x in functions.items():
        assert {"0x0p+0", "-0x0p+0", "nan", "-0x1p+0"} <= x or function.startswith("beta_")
        if function.startswith(("epsilon", "one_minus")):
            form = FORMATS[kind]
            half = [v for v in x if v.startswith("0x1.abc52")]
            assert len(half) >= 3, "both sides of eps = 1/2"
            assert {"inf", hexadecimal(2.0 ** (1 - form.largest))} <= x
        hard = hard_arguments().get((function, kind), [])
        assert {hexadecimal(point[0]) for point in hard} <= x
        assert (
            hard or function.startswith(("restitution_", "rebound_", "dissipation_", "beta_")) or "halfline" in function
        )


def test_hard_arguments_are_those_of_functions_that_there_are():
    there = {(row["function"], row["type"]) for name in NAMES for row in rows(name)}
    assert set(hard_arguments()) <= there


@EVERY
def test_exact_values_are_those_of_the_integration(name):
    """A sample of each file, another one every day, against 25 digits of the equation of motion."""
    sample = [row for row in rows(name) if row["least"] not in ("-", "nan", row["most"])]
    sample = [row for row in sample if 1e-90 < float.fromhex(row["x"]) < 1e30][daily.DAY % 23 :: 23]
    assert sample
    for row in sample:
        value = from_motion(row)
        with mp.workdps(40):
            digits = len(row["exact"].split("e")[0].replace("-", "").replace(".", "").lstrip("0"))
            assert abs(mpf(row["exact"]) / value - 1) <= mpf(10) ** (1 - digits), row
            form = FORMATS[row["type"]]
            text = mp.nstr(value, 35)
            low, high = (Fraction(float.fromhex(row[key])) for key in ("least", "most"))
            nearest = form.rounded(Fraction(text))
            assert row["nearest"] in ("-", hexadecimal(nearest))
            assert low <= Fraction(nearest) <= high
            # least and most are the exact value and the error, which is printed rounded up to three digits.
            unit = max(
                abs(Fraction(nearest)) * Fraction(form.epsilon), Fraction(2) ** (2 - form.largest - form.precision)
            )
            assert abs((high - low) / 2 / Fraction(row["error"]) - 1) <= Fraction(2, 100) + 2 * unit / Fraction(
                row["error"]
            )


def from_motion(row):
    """Return the exact result by `exact`, which integrates the equation of motion."""
    x, y = (None if row[key] == "-" else Fraction(float.fromhex(row[key])) for key in "xy")
    kind = row["function"]
    with mp.workdps(40):
        if kind.startswith(("v_star", "beta")):
            given = {"one_minus_epsilon" if "loss" in kind else "epsilon": x}
            v_star = exact.invert(**given, digits=30).mpf()["v_star"]
            return v_star if y is None else v_star**2 / mp.root(mpf(y.numerator) / y.denominator, 5)
        given = {"v_star": x} if y is None else {"speed": x, "beta": y}
        found = exact.collision(**given, digits=30).mpf()
        if kind.startswith("one_minus"):
            return found["one_minus_epsilon"]
        if kind.startswith("dissipation"):
            return found["one_minus_epsilon"] * (1 + found["epsilon"])
        return found["epsilon"] * (mpf(x.numerator) / x.denominator if kind.startswith("rebound") else 1)


# --- where rounding decides -------------------------------------------------------------------------------------------

BESIDE = {
    "a power of two": (
        (float.fromhex("0x1.1541d56f95b7dp31"), float.fromhex("0x1.00aed821bbca0p0")),
        (float.fromhex("0x1.196d68f35283bp37"), float.fromhex("0x1.00cccb4c21621p0")),
        (float.fromhex("0x1.1d8e6201de2ffp61"), float.fromhex("0x1.006f215405c76p0")),
    ),
    "the table's end": ((float.fromhex("0x1.f82291e73dcf2p63"), float.fromhex("0x1.00cb384b5b4dfp0")),),
    "the least normal beta^5": ((float.fromhex("0x1.3bfd1d2622c48p1022"), float.fromhex("0x1.42650651a0072p-210")),),
}


@pytest.mark.parametrize("beside", BESIDE)
def test_limits_hold_where_a_rounding_of_w_decides(tmp_path, beside):
    """Eps of the rounded w is beyond a power of two, where units are larger; or code reads no row for the exact w."""
    kernel = catalogue.kernel("speed full")
    built = compiled.build(tmp_path, [(EXPORTS / "viscopade_speed_full.h").read_text()])
    found = vectors.vectors(kernel, kernel.function("restitution"), DOUBLE, BESIDE[beside])
    for given, line in zip(BESIDE[beside], found, strict=True):
        row = dict(zip(COLUMNS, line, strict=True))
        computed = built["restitution_full"](*given)
        assert float.fromhex(row["least"]) <= computed <= float.fromhex(row["most"])
        assert (row["bits"] == "-") == (beside != "a power of two")
        assert row["bits"] in ("-", hexadecimal(computed))


def test_nothing_is_stated_of_compact_kernels_where_the_computed_w_is_subnormal():
    """The exact w is normal."""
    kernel = catalogue.kernel("compact 1e-3")
    speed, beta = float.fromhex("0x1.f32a2ep-122"), float.fromhex("0x1.014d9ep-1")
    assert Fraction(beta) ** 5 * Fraction(speed) > FLOAT.least
    for function in kernel.functions:
        assert not [*vectors.vectors(kernel, function, FLOAT, [(speed, beta)])]
        assert len([*vectors.vectors(kernel, function, FLOAT, [(speed * 2, beta)])]) == 1


@pytest.mark.parametrize("entry", [e for e in catalogue.CATALOGUE.values() if e.kernel.tables], ids=lambda e: e.key)
def test_programs_of_tables_are_within_the_limits_at_random_arguments(entry):
    """Other ones every day; computed as code does, without a compiler. Other kernels: test_languages.py."""
    kernel, generator = entry.kernel, random.Random(f"{entry.key} {daily.DAY}")
    ends = {"v_star": (-60, 60), "speed": (-90, 60), "beta": (-6, 6)}
    for form, function in product(map(FORMATS.get, kernel.formats), kernel.functions):
        powers = [[generator.uniform(*ends.get(name, (-90, 0))) for name in function.arguments] for _ in range(8)]
        given = [[2.0**power for power in one] for one in powers]
        for row in vectors.vectors(kernel, function, form, given):
            x, y, least, most = (float.fromhex(word) if word != "-" else None for word in (*row[2:4], *row[7:9]))
            arguments = [number for number in (x, y) if number is not None]
            computed = float(machine.function_values(kernel, function.name, *arguments, form=form))
            assert least is None or least <= computed <= most or (computed != computed and least != least), row
