"""The kernels of full accuracy: proven bounds, compiled C where rounding is hardest, and no undefined behaviour.

Compiled code at all other arguments is checked by test_vectors.py and test_every_kernel.py.
"""

import ctypes
import math
import random
import subprocess
from fractions import Fraction
from functools import cache
from itertools import pairwise

import numpy as np
import pytest
from flint import fmpz

from tests.compiled import WARNINGS, compiler
from tests.kernels.speed_headers import compilers, named_compiler
from viscopade.arithmetic.balls import working
from viscopade.arithmetic.formats import DOUBLE, exponent
from viscopade.arrays import panels
from viscopade.collision import exact
from viscopade.generated import END_CONDITION
from viscopade.kernels.expressions import Arithmetic, Name, Run, Statement, evaluate, in_pairs
from viscopade.kernels.forms import last_place
from viscopade.kernels.rounding import arithmetic
from viscopade.kernels.targets import last_place as header
from viscopade.theory.series import series
from viscopade_lab.studies import exhaustive

COMMAND = "viscopade export c --full"
BUILDS = {
    "plain": ("-O3", "-ffp-contract=off"),
    "fused": ("-O3", "-march=native", "-ffp-contract=fast"),
    "clang": ("-O3", "-march=native", "-ffp-contract=fast"),
}
ALL_STANDARDS = ("c99", "c2x", "c++17", "c++20")

INTERFACE = "".join(
    f"""
void all_{function}(const double *v_star, double *result, long count)
{{
    for (long i = 0; i < count; i++) {{
        result[i] = viscopade_{function}_full(v_star[i]);
    }}
}}
"""
    for function in last_place.FUNCTIONS
)


@pytest.fixture(scope="module")
def text():
    return header.render(COMMAND)


@pytest.fixture(scope="module")
def library(text, tmp_path_factory):
    """Return a function that runs a kernel on an array, by build and function."""
    folder = tmp_path_factory.mktemp("full")
    (folder / "full.h").write_text(text)
    (folder / "interface.c").write_text(f'#include "full.h"\n{INTERFACE}')

    @cache
    def built(build):
        target = folder / f"{build}.so"
        arguments = named_compiler("clang" if build == "clang" else "cc", "c99")
        command = [*arguments, *WARNINGS, "-Wno-missing-prototypes", *BUILDS[build], "-fPIC"]
        subprocess.run([*command, "-c", str(folder / "interface.c"), "-o", str(target.with_suffix(".o"))], check=True)
        subprocess.run([command[0], "-shared", str(target.with_suffix(".o")), "-o", str(target), "-lm"], check=True)
        return ctypes.CDLL(str(target))

    def run(build, function, values):
        v_star = np.ascontiguousarray(values)
        result = np.empty_like(v_star)
        pointers = (ctypes.c_void_p(array.ctypes.data) for array in (v_star, result))
        built(build)[f"all_{function}"](*pointers, ctypes.c_long(len(v_star)))
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
    return power_law(v_star) if v_star > 2.0**22 else Fraction(exact.collision(v_star, 35).decimals()["epsilon"])


def power_law(v_star):
    """Return (3/2)^(2/3) v*^(-10/3) to more than 100 bits."""
    cube = Fraction(9, 4) / Fraction(v_star) ** 10
    shift = 128 - exponent(cube) // 3
    return Fraction(int(fmpz(int(cube * Fraction(8) ** shift)).root(3))) / Fraction(2) ** shift


def ulps(result, true):
    return abs(Fraction(float(result)) - true) / DOUBLE.ulp(true)


# --- certificate ----------------------------------------------------------------------------------------------------


@pytest.mark.parametrize("function", last_place.FUNCTIONS)
def test_certificate_covers_the_half_line(function):
    bounds = last_place.ulp_bounds(function)
    assert (bounds[0].low, bounds[-1].high) == (0, 2 ** (last_place.FOLD + last_place.PERIOD))
    assert all(one.high == other.low for one, other in pairwise(bounds))
    largest = last_place.largest_ulp(function)
    assert largest == max(bound.ulp for bound in bounds)
    assert 0.5 < largest < 0.6
    assert last_place.largest_subnormal(function) < 0.8
    assert last_place.largest_ulp() == max(map(last_place.largest_ulp, last_place.FUNCTIONS))


def table_value(function, v_star):
    """Return the value of the polynomials of `viscopade.arrays.double`, exactly."""
    index = int(np.searchsorted(panels.CENTRES + panels.HALF_WIDTHS, v_star, side="right"))
    z = (Fraction(v_star) - Fraction(panels.CENTRES[index])) / Fraction(panels.HALF_WIDTHS[index])
    return last_place.table_row(function, index)(z)


@pytest.mark.parametrize("function", last_place.FUNCTIONS)
def test_errors_are_below_the_bounds_and_not_far_below(library, function):
    """Sampled on every panel against the polynomials: the bound holds, and the largest error comes near it."""
    generator = np.random.default_rng(3)
    worst = Fraction(0)
    for low, high, bound in last_place.ulp_bounds(function):
        values = generator.uniform(float(low), float(high), 12)
        values = values[(values >= low) & (values < high) & (values > 0)]
        for v_star, result in zip(values, library("fused", function, values), strict=True):
            error = ulps(result, table_value(function, v_star))
            assert error <= bound, float(v_star).hex()
            worst = max(worst, error)
    assert worst > Fraction(49, 100)


def with_row(monkeypatch, name, index, change):
    """Change one row of a table."""
    rows = list(getattr(last_place, name)())
    rows[index] = change(rows[index])
    monkeypatch.setattr(last_place, name, lambda: tuple(rows))


@pytest.mark.parametrize("place", ["a0_high", "a0_low", "a1_low"])
def test_certificate_sees_a_wrong_coefficient(monkeypatch, place):
    change = math.ulp(last_place.double_rows()[200].a0_high) * 4
    if place == "a1_low":
        change /= float(last_place.smaller_panels()[199].half)
    with_row(monkeypatch, "double_rows", 200, lambda row: row._replace(**{place: getattr(row, place) + change}))
    with working(128):
        assert last_place._panel_bound(199, loss=False) > 2


def test_certificate_refuses_a_leading_part_that_is_not_exact(monkeypatch):
    with_row(monkeypatch, "double_rows", 200, lambda row: row._replace(a1_high=row.a1_high * (1 + 2.0**-40)))
    with working(128), pytest.raises(ArithmeticError, match="not exact"):
        last_place._panel_bound(199, loss=False)


def test_certificate_sees_a_wrong_coefficient_near_0(monkeypatch):
    right = last_place.near_constants()
    monkeypatch.setattr(last_place, "near_constants", lambda: right | {"a0": right["a0"] * (1 + 2.0**-20)})
    with working(128):
        assert last_place._near_bound() > 1


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
            rounding, numbers = arithmetic(DOUBLE), last_place._numbers(names, a, t=last_place._between(low, high))
            rounded = evaluate(total, Run(program, numbers, rounding), rounding)
            error = Fraction(last_place.exact_middle(rounded.absolute))
        values = Run(program, dict(zip(names, a, strict=True)) | {"t": t}, Arithmetic(float))
        found = abs(Fraction(evaluate(total, values, Arithmetic(float))) - exactly)
        assert found <= error
        largest = max(largest, float(found / error) if error else 0.0)
    assert largest > 0.1


# --- the header -----------------------------------------------------------------------------------------------------


def test_header_says_what_it_holds(text):
    lines = text.splitlines()
    assert lines[1].startswith(" * Generated by viscopade")
    assert lines[1].endswith(COMMAND)
    assert END_CONDITION.split(",")[0] in " ".join(line.removeprefix(" * ") for line in lines)
    head = text.split("*/")[0]
    for function in last_place.FUNCTIONS:
        (line,) = (line for line in head.splitlines() if line.startswith(f" *     {function}:"))
        stated, proven = float(line.split()[-1]), last_place.largest_ulp(function)
        assert proven <= stated
        assert stated - 0.5 < 1.2 * float(proven - Fraction(1, 2))
    assert text.isascii()
    assert text == header.render(COMMAND)


def test_header_states_the_size_of_its_table(text, tmp_path):
    program = tmp_path / "size.c"
    program.write_text(
        f'{text}\n#include <stdio.h>\nint main(void) {{ printf("table: %d bytes", '
        "(int)sizeof viscopade_full_table); return 0; }\n"
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
    for command in compilers(standard).values():
        subprocess.run([*command, *WARNINGS, "-fsyntax-only", str(source)], check=True)


PATTERNS = """
#include <stdio.h>
int main(void)
{
    uint64_t z = 1;
    double sum = 0.0;
    for (long n = 0; n < 400000; n++) {
        z = z * UINT64_C(6364136223846793005) + UINT64_C(1442695040888963407);
        uint64_t bits = n < 4096 ? (uint64_t)n << 52 : n < 8192 ? ((uint64_t)(n - 4096) << 52) - 1 : z;
        double v_star;
        memcpy(&v_star, &bits, sizeof bits);
        const double found[] = {viscopade_epsilon_full(v_star), viscopade_one_minus_epsilon_full(v_star)};
        for (int i = 0; i < 2; i++) {
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
        assert 410_000 > int(done.stdout) > 350_000  # about half of all patterns have no sign and are no NaN


# --- the checks themselves ------------------------------------------------------------------------------------------


def test_reference_of_the_checks_is_right(text):
    """The reference in long double against exact values: errors of the kernel agree to 0.01 ulp."""
    compiler("c11")
    values = [*np.geomspace(1e-3, 1e6, 30).tolist(), 1e-170, 3e-5, 1e60, 1e94]
    bits = np.array(values).view(np.uint64).tolist()
    with exhaustive.compiled("exhaustive_double", "plain", exhaustive.double_files(text)) as program:
        for number, function in enumerate(last_place.FUNCTIONS):
            lines = exhaustive.outputs(program, [(number, at, at + 1, 1, 1) for at in bits])
            for v_star, (_, error, at, result) in zip(values, lines, strict=True):
                assert float.fromhex(at) == v_star
                exactly = ulps(float.fromhex(result), truth(function, v_star))
                assert abs(float(exactly) - float(error)) < exhaustive.REFERENCE_ULP, v_star


def test_random_doubles_meet_their_bound(text):
    compiler("c11")
    with exhaustive.compiled("exhaustive_double", "fused", exhaustive.double_files(text)) as program:
        rows = [row for function in last_place.FUNCTIONS for row in exhaustive.doubles(program, function, 4000, 1)]
    assert all(0.49 < row.largest <= row.bound + exhaustive.REFERENCE_ULP for row in rows)
    assert all(row.total == 4000 and row.noted < 80 for row in rows)
