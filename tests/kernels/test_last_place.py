"""The kernels of full accuracy: compiled C against exact values, the certificate, and no undefined behaviour."""

import ctypes
import json
import math
import random
import shutil
import struct
import subprocess
from fractions import Fraction
from functools import cache
from itertools import pairwise

import numpy as np
import pytest
from flint import fmpz

from tests.compiled import WARNINGS, compiler
from viscopade.arithmetic.balls import working
from viscopade.arithmetic.formats import DOUBLE
from viscopade.arrays import panels
from viscopade.generated import END_CONDITION
from viscopade.kernels.expressions import Arithmetic, Name, Run, Statement, evaluate, in_pairs
from viscopade.kernels.forms import last_place
from viscopade.kernels.rounding import arithmetic
from viscopade.kernels.targets import last_place as header
from viscopade.theory.series import series
from viscopade_lab import exhaustive
from viscopade_lab.exhaustive import doubles, floats

COMMAND = "viscopade export c --full"
TYPES = {"double": (np.float64, 53, -1022), "float": (np.float32, 24, -126)}
CASES = [(form, function) for form in last_place.FORMATS for function in last_place.FUNCTIONS]
BUILDS = {
    "O0": ("-O0",),
    "plain": ("-O3", "-ffp-contract=off"),
    "fused": ("-O3", "-march=native", "-ffp-contract=fast"),
    "fast-math": ("-O3", "-march=native", "-ffast-math"),
    "clang": ("-O3", "-march=native", "-ffp-contract=fast"),
}
EXACT_BUILDS = [name for name in BUILDS if name not in ("fast-math", "clang")]
ALL_STANDARDS = ("c99", "c2x", "c++17", "c++20")

INTERFACE = "".join(
    f"""
void {form}_{function}(const {form} *v_star, {form} *result, long count)
{{
    for (long i = 0; i < count; i++) {{
        result[i] = viscopade_{function}_full{"f" if form == "float" else ""}(v_star[i]);
    }}
}}
"""
    for form, function in CASES
)


@pytest.fixture(scope="module")
def text():
    return header.render(COMMAND)


@pytest.fixture(scope="module")
def library(text, tmp_path_factory):
    """Return a function that runs a kernel on an array, by build, form and function."""
    folder = tmp_path_factory.mktemp("full")
    (folder / "full.h").write_text(text)
    (folder / "interface.c").write_text(f'#include "full.h"\n{INTERFACE}')

    @cache
    def built(build):
        target = folder / f"{build}.so"
        arguments = compilers("c99")[-1] if build == "clang" else compiler("c99")
        command = [*arguments, *WARNINGS, "-Wno-missing-prototypes", *BUILDS[build], "-fPIC"]
        subprocess.run([*command, "-c", str(folder / "interface.c"), "-o", str(target.with_suffix(".o"))], check=True)
        # Linked without -ffast-math, which would set denormal numbers to 0 in this process.
        subprocess.run([command[0], "-shared", str(target.with_suffix(".o")), "-o", str(target), "-lm"], check=True)
        return ctypes.CDLL(str(target))

    def run(build, form, function, values):
        v_star = np.ascontiguousarray(values, dtype=TYPES[form][0])
        result = np.empty_like(v_star)
        pointers = (ctypes.c_void_p(array.ctypes.data) for array in (v_star, result))
        built(build)[f"{form}_{function}"](*pointers, ctypes.c_long(len(v_star)))
        return result

    return run


# --- the truth ------------------------------------------------------------------------------------------------------


@cache
def expansion():
    return [Fraction(h) for h in series(5, 40).decimals()]


@cache
def truth(function, v_star):
    """From `exact`; where the series or the power law for large v* (section 2.5) is good to 2^-64, from those."""
    if v_star < 2.0**-17:
        loss = -sum(h * Fraction(v_star) ** k for k, h in enumerate(expansion()[1:], 1))
        return loss if function == "one_minus_epsilon" else 1 - loss
    if function == "one_minus_epsilon":
        return 1 - truth("epsilon", v_star)
    return power_law(v_star) if v_star > 2.0**22 else exhaustive.exact_value("epsilon", v_star, 35)


def power_law(v_star):
    """Return (3/2)^(2/3) v*^(-10/3) to more than 100 bits."""
    cube = Fraction(9, 4) / Fraction(v_star) ** 10
    shift = 128 - last_place.exponent(cube) // 3
    return Fraction(int(fmpz(int(cube * Fraction(8) ** shift)).root(3))) / Fraction(2) ** shift


def ulps(form, result, true):
    _, precision, least = TYPES[form]
    return abs(Fraction(float(result)) - true) / exhaustive.ulp(true, precision, least)


def nearest(form, true):
    return floats.rounded(true) if form == "float" else float(true)


def bound(form, function, v_star, true):
    """Return what is proven at this point."""
    proven = certificate(form, function)
    if true < Fraction(2) ** TYPES[form][2]:
        return proven["underflow"]
    x = v_star
    while x >= 2.0**23:
        x /= 8
    return next(panel["ulp"] for panel in proven["panels"] if panel["low"] <= x < panel["high"])


@cache
def certificate(form, function):
    return last_place.certificate(form, function)


def at_exponents(form, generator):
    """Return numbers of all exponents of type float; of type double, where something changes, and some others."""
    if form == "float":
        exponents = range(-149, 128)
    else:
        exponents = [*range(-1074, 1024, 41), *range(-540, -505), *range(-402, -397), *range(-60, 60), *range(300, 328)]
    for e in exponents:
        yield math.ldexp(1 + generator.getrandbits(51) / 2**51, e)


@cache
def points(form):
    """Return inputs of the type: all the tests' exact values take some ten seconds."""
    generator = random.Random(1)
    found = {float(TYPES[form][0](x)) for x in at_exponents(form, generator)}
    found |= {math.ldexp(1 + k / 16, e) for e in (-5, -4, -1, 0) for k in (0, 7, 15)}
    found |= {float(np.nextafter(TYPES[form][0](x), TYPES[form][0](0))) for x in (2**-4, 1, 2**20, 2**23, 2**26)}
    found |= {float(np.finfo(TYPES[form][0]).max), float(np.finfo(TYPES[form][0]).smallest_subnormal)}
    return sorted(found)


# --- compiled code against the truth --------------------------------------------------------------------------------


@pytest.mark.parametrize("function", last_place.FUNCTIONS)
@pytest.mark.parametrize("build", EXACT_BUILDS)
def test_double_is_within_the_proven_bounds(library, build, function):
    values = points("double")
    for v_star, result in zip(values, library(build, "double", function, values), strict=True):
        true = truth(function, v_star)
        assert ulps("double", result, true) <= bound("double", function, v_star, true), v_star.hex()


@pytest.mark.parametrize("function", last_place.FUNCTIONS)
@pytest.mark.parametrize("build", EXACT_BUILDS)
def test_float_is_rounded_correctly(library, build, function):
    values = points("float")
    for v_star, result in zip(values, library(build, "float", function, values), strict=True):
        true = truth(function, v_star)
        assert result == nearest("float", true), v_star.hex()
        assert ulps("float", result, true) <= bound("float", function, v_star, true)


def test_points_reach_denormal_results_and_both_limits():
    for form, function in CASES:
        least = Fraction(2) ** TYPES[form][2]
        true = [truth(function, v_star) for v_star in points(form)]
        assert any(0 < t < least for t in true)
        assert {0.0, 1.0} <= {nearest(form, t) for t in true}


@pytest.mark.parametrize(("form", "function"), CASES)
def test_fast_math_stays_near(library, form, function):
    """Nothing is promised there; but no constant is lost."""
    values = [v for v in points(form) if truth(function, v) > Fraction(2) ** (TYPES[form][2] + 1) and v < 1e30]
    for v_star, result in zip(values, library("fast-math", form, function, values), strict=True):
        assert ulps(form, result, truth(function, v_star)) < 2, v_star.hex()


@pytest.mark.parametrize(("form", "function"), CASES)
@pytest.mark.parametrize("build", EXACT_BUILDS)
def test_special_values(library, build, form, function):
    at_zero, at_infinity = (1.0, 0.0) if function == "epsilon" else (0.0, 1.0)
    kind = TYPES[form][0]
    tiny, largest = np.finfo(kind).smallest_subnormal, np.finfo(kind).max
    results = library(build, form, function, [0.0, -0.0, tiny, np.inf, largest])
    assert results.tolist() == [at_zero, at_zero, at_zero, at_infinity, at_infinity]
    assert not np.signbit(results).any()
    assert np.isnan(library(build, form, function, [np.nan, -np.nan, -tiny, -1.0, -largest, -np.inf])).all()


@pytest.mark.parametrize(("form", "function"), CASES)
def test_c_does_the_operations_that_the_certificate_is_about(library, form, function):
    generator = random.Random(2)
    kind = TYPES[form][0]
    values = [float(kind(2.0 ** generator.uniform(-6, 24))) for _ in range(3000)]
    values += [*points(form), 0.0, math.inf, 2.0**-400, 2.0**-401, *map(float, panels.CENTRES)]
    found = library("plain", form, function, values)
    expected = [last_place.evaluated_in(form, function, float(kind(v_star))) for v_star in values]
    assert found.astype(float).tolist() == expected


@pytest.mark.parametrize("function", last_place.FUNCTIONS)
@pytest.mark.parametrize("build", [*EXACT_BUILDS, "clang"])
def test_floats_that_are_hardest_to_round(library, build, function):
    """Those nearer to a boundary than the proven error before the last rounding: the others are proven to be right."""
    values = [float.fromhex(v) for v in json.loads((exhaustive.HERE / "close_floats.json").read_text())[function]]
    assert certificate("float", function)["maximum"] - 0.5 < 2.0**-27
    for v_star, result in zip(values, library(build, "float", function, values), strict=True):
        true = truth(function, v_star)
        assert result == nearest("float", true), v_star.hex()
        other = np.nextafter(result, result.dtype.type(2 if true > Fraction(float(result)) else 0))
        assert ulps("float", other, true) - ulps("float", result, true) < 2.0**-26


@pytest.mark.parametrize("step", [9973, pytest.param(1, marks=pytest.mark.slow)])
@pytest.mark.parametrize("mode", exhaustive.MODES)
@pytest.mark.parametrize("function", last_place.FUNCTIONS)
def test_all_floats(text, function, mode, step):
    compiler("c11")  # or skip
    result = floats.check(function, mode, step, text=text)
    assert result["inputs"] == -(-(2**31) // step)
    assert result["not_correctly_rounded"] == 0, result
    assert 0.49 < result["largest_error_ulp"] <= certificate("float", function)["maximum"]


def test_the_check_of_floats_finds_a_wrong_coefficient(text):
    compiler("c11")
    right = last_place.DOUBLE.hexadecimal(last_place.float_rows()[100][1])
    value = float.fromhex(right)
    assert text.count(right) == 1
    wrong = text.replace(right, last_place.DOUBLE.hexadecimal(value * (1 + 2.0**-20)))
    result = floats.check("epsilon", "plain", 997, text=wrong)
    assert 0 < result["not_correctly_rounded"] < 1000
    panel = last_place.smaller_panels()[100]
    low, high = float(panel.centre - panel.half), float(panel.centre + panel.half)
    assert all(low <= float.fromhex(at) < high for at in result["wrong_at"])


# --- certificate ----------------------------------------------------------------------------------------------------


@pytest.mark.parametrize(("form", "function"), CASES)
def test_certificate_covers_the_half_line(form, function):
    proven = certificate(form, function)
    panels = proven["panels"]
    assert (panels[0]["low"], panels[-1]["high"]) == (0, 2.0 ** (last_place.FOLD + last_place.PERIOD))
    assert all(one["high"] == other["low"] for one, other in pairwise(panels))
    assert proven["maximum"] == max(panel["ulp"] for panel in panels)
    assert 0.5 < proven["maximum"] < (0.5 + 2**-20 if form == "float" else 0.6)
    assert proven["underflow"] < 0.8


def table_value(function, v_star):
    """Return the value of the polynomials of `viscopade.arrays.double`, exactly."""
    index = int(np.searchsorted(panels.CENTRES + panels.HALF_WIDTHS, v_star, side="right"))
    z = (Fraction(v_star) - Fraction(panels.CENTRES[index])) / Fraction(panels.HALF_WIDTHS[index])
    return last_place.table_row(function, index)(z)


@pytest.mark.parametrize(("form", "function"), CASES)
def test_errors_are_below_the_bounds_and_not_far_below(library, form, function):
    """Sampled on every panel against the polynomials: the bound holds, and the largest error comes near it."""
    generator = np.random.default_rng(3)
    worst = Fraction(0)
    for panel in certificate(form, function)["panels"]:
        values = generator.uniform(panel["low"], panel["high"], 12).astype(TYPES[form][0]).astype(float)
        values = values[(values >= panel["low"]) & (values < panel["high"]) & (values > 0)]
        for v_star, result in zip(values, library("fused", form, function, values), strict=True):
            error = ulps(form, result, table_value(function, v_star))
            assert error <= panel["ulp"], float(v_star).hex()
            worst = max(worst, error)
    assert worst > Fraction(49, 100)


@pytest.mark.parametrize("place", ["a0_high", "a0_low", "a1_low"])
def test_certificate_sees_a_wrong_coefficient(monkeypatch, place):
    rows = list(last_place.double_rows())
    row = rows[200]
    size = Fraction(math.ulp(row.a0_high)) * 4
    change = size / last_place.smaller_panels()[199].half if place == "a1_low" else size
    rows[200] = row._replace(**{place: getattr(row, place) + float(change)})
    monkeypatch.setattr(last_place, "double_rows", lambda: tuple(rows))
    with working(128):
        assert last_place._double_bound(199, loss=False) > 2


def test_certificate_refuses_a_leading_part_that_is_not_exact(monkeypatch):
    rows = list(last_place.double_rows())
    rows[200] = rows[200]._replace(a1_high=rows[200].a1_high * (1 + 2.0**-40))
    monkeypatch.setattr(last_place, "double_rows", lambda: tuple(rows))
    with working(128), pytest.raises(ArithmeticError, match="not exact"):
        last_place._double_bound(199, loss=False)


def test_certificate_sees_a_wrong_coefficient_of_type_float(monkeypatch):
    rows = list(last_place.float_rows())
    rows[199] = (rows[199][0] * (1 + 2.0**-30), *rows[199][1:])
    monkeypatch.setattr(last_place, "float_rows", lambda: tuple(rows))
    with working(128):
        assert last_place._float_bound(199, loss=False) > Fraction(1, 2) + Fraction(1, 2**8)


@pytest.mark.parametrize("form", last_place.FORMATS)
def test_certificate_sees_a_wrong_coefficient_near_0(monkeypatch, form):
    proven = last_place.near(form)
    wrong = proven._replace(a=(proven.a[0] * (1 + 2.0**-20), *proven.a[1:]))
    monkeypatch.setattr(last_place, "near", lambda _: wrong)
    least = 1 if form == "double" else Fraction(1, 2) + Fraction(1, 2**10)
    with working(128):
        assert last_place._near_bound(form, loss=True) > least


def test_bounds_of_rounding_errors_hold():
    """Sums in pairs with random coefficients: the rounding error is bounded, and the bound is not idle."""
    generator = random.Random(4)
    largest = 0.0
    for _ in range(300):
        a = [generator.uniform(-1, 1) * 2.0 ** generator.randint(-9, 9) for _ in range(generator.randint(1, 9))]
        t = generator.uniform(-1, 1)
        low, high = sorted((Fraction(t), Fraction(t) * Fraction(9, 8)))
        exactly = sum(Fraction(c) * Fraction(t) ** n for n, c in enumerate(a))
        names = [f"a{n}" for n in range(len(a))]
        program, total = (Statement("tt", Name("t") * Name("t")),), in_pairs("t", "tt", names)
        with working(128):
            rounding, numbers = arithmetic(DOUBLE), last_place._numbers(names, a)
            rounded = evaluate(total, Run(program, numbers | {"t": last_place._between(low, high)}, rounding), rounding)
            error = Fraction(last_place.exact_middle(rounded.absolute))
        values = Run(program, dict(zip(names, a, strict=True)) | {"t": t}, Arithmetic(float))
        found = abs(Fraction(evaluate(total, values, Arithmetic(float))) - exactly)
        assert found <= error
        largest = max(largest, float(found / error) if error else 0.0)
    assert largest > 0.1


def test_bad_forms_and_functions_are_refused():
    with pytest.raises(ValueError, match="form is 'half': accepted are double, float"):
        last_place.certificate("half", "epsilon")
    with pytest.raises(ValueError, match="function is 'x_max': accepted are epsilon, one_minus_epsilon"):
        last_place.evaluated_in("double", "x_max", 1.0)
    assert math.isnan(last_place.evaluated_in("double", "epsilon", -1.0))


# --- the header -----------------------------------------------------------------------------------------------------


def test_header_says_what_it_holds(text):
    lines = text.splitlines()
    assert lines[1].startswith(" * Generated by viscopade")
    assert lines[1].endswith(COMMAND)
    assert END_CONDITION.split(",")[0] in " ".join(line.removeprefix(" * ") for line in lines)
    head = text.split("*/")[0]
    for form, function in CASES:
        (line,) = (line for line in head.splitlines() if line.startswith(f" *     {form},") and f" {function}:" in line)
        stated, proven = float(line.split()[-1]), certificate(form, function)["maximum"]
        assert proven <= stated
        assert stated - 0.5 < 1.2 * (proven - 0.5)
    assert text.isascii()
    assert text == header.render(COMMAND)


def test_header_states_the_size_of_its_tables(text, tmp_path):
    program = tmp_path / "size.c"
    program.write_text(
        f'{text}\n#include <stdio.h>\nint main(void) {{ printf("%d bytes for double, %d bytes for float", '
        "(int)sizeof viscopade_full_table, (int)sizeof viscopade_full_tablef); return 0; }\n"
    )
    subprocess.run([*compiler("c99"), str(program), "-o", str(tmp_path / "size"), "-lm"], check=True)
    assert subprocess.run([str(tmp_path / "size")], capture_output=True, text=True).stdout in text


def test_a_command_of_two_lines_is_refused():
    with pytest.raises(ValueError, match="one printable line"):
        header.render("two\nlines")


@pytest.mark.parametrize("standard", ALL_STANDARDS)
def test_header_compiles_without_warnings(text, tmp_path, standard):
    source = tmp_path / "source.c"
    source.write_text(text + INTERFACE)
    for command in compilers(standard):
        subprocess.run([*command, *WARNINGS, "-fsyntax-only", str(source)], check=True)


def compilers(standard):
    """Return the usual compiler for a standard (or skip), and Clang if it is there and knows it."""
    usual = compiler(standard)
    clang = shutil.which("clang++" if "++" in standard else "clang")
    if clang is None:
        return [usual]
    other = [clang, *usual[1:]]
    probe = subprocess.run([*other, "-fsyntax-only", "-"], input="", text=True, capture_output=True)
    return [usual] if probe.returncode else [usual, other]


PATTERNS = """
#include <stdio.h>
int main(void)
{
    uint64_t z = 1;
    double sum = 0.0;
    for (long n = 0; n < 400000; n++) {
        z = z * UINT64_C(6364136223846793005) + UINT64_C(1442695040888963407);
        uint64_t bits = n < 4096 ? (uint64_t)n << 52 : n < 8192 ? ((uint64_t)(n - 4096) << 52) - 1 : z;
        uint32_t bitsf = (uint32_t)(n < 8192 ? (uint64_t)n << 20 : z >> 32);
        double v_star;
        float v_starf;
        memcpy(&v_star, &bits, sizeof bits);
        memcpy(&v_starf, &bitsf, sizeof bitsf);
        const double found[] = {viscopade_epsilon_full(v_star), viscopade_one_minus_epsilon_full(v_star),
                                (double)viscopade_epsilon_fullf(v_starf),
                                (double)viscopade_one_minus_epsilon_fullf(v_starf)};
        for (int i = 0; i < 4; i++) {
            sum += found[i] >= 0.0 && found[i] <= 1.0;
        }
    }
    printf("%.0f", sum);
    return 0;
}
"""


@pytest.mark.parametrize("math_flag", ["-fno-fast-math", "-ffast-math"])
def test_no_undefined_behaviour_for_any_bits(text, tmp_path, math_flag):
    source, program = tmp_path / "patterns.c", tmp_path / "patterns"
    source.write_text(text + PATTERNS)
    flags = ["-O1", math_flag, "-fsanitize=undefined,address", "-fno-sanitize-recover=all", "-o", str(program)]
    built = subprocess.run([*compiler("c99"), *flags, str(source), "-lm"], capture_output=True, text=True)
    if built.returncode:
        pytest.skip("the compiler has no sanitizers")
    done = subprocess.run([str(program)], capture_output=True, text=True)
    assert done.returncode == 0, done.stderr
    if math_flag == "-fno-fast-math":
        assert 800_000 > int(done.stdout) > 700_000  # about half of all patterns have no sign and are no NaN


# --- the checks themselves ------------------------------------------------------------------------------------------


def test_reference_of_the_checks_is_right(text):
    """The reference in long double against exact values: errors of the kernel agree to 0.01 ulp."""
    compiler("c11")
    values = [v for v in points("double") if 1e-3 < v < 1e6] + [1e-170, 3e-5, 1e60, 1e94]
    with exhaustive.compiled("check_double", "plain", text) as program:
        for function in last_place.FUNCTIONS:
            bits = np.array([doubles.bits_of(v) for v in values], dtype=np.uint64)
            found, results = doubles.errors(program, function, bits)
            for v_star, error, result in zip(values, found, results, strict=True):
                exactly = ulps("double", float.fromhex(result), truth(function, v_star))
                assert abs(float(exactly) - error) < 0.01, v_star


def test_rounding_of_fractions_to_float():
    generator = random.Random(5)
    for _ in range(2000):
        number = Fraction(generator.getrandbits(80), 2**80) * Fraction(2) ** generator.randint(-155, 0)
        number = (
            number if generator.random() < 0.5 else Fraction(float(np.float32(float(number)))) + Fraction(1, 2**170)
        )
        packed = struct.unpack("<f", struct.pack("<f", floats.rounded(number)))[0]
        assert packed == floats.rounded(number)
        other = np.float32(packed)
        for neighbour in (np.nextafter(other, np.float32(0)), np.nextafter(other, np.float32(2))):
            assert abs(Fraction(packed) - number) <= abs(Fraction(float(neighbour)) - number)
