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
from tests.kernels.speed_headers import named_compiler
from viscopade.arithmetic.balls import working
from viscopade.arithmetic.formats import DOUBLE, exponent
from viscopade.arrays import panels
from viscopade.collision import exact
from viscopade.generated import END_CONDITION
from viscopade.kernels.expressions import Name, Reading, Run, Statement, evaluate, in_pairs
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
        values = Run(program, dict(zip(names, a, strict=True)) | {"t": t}, Reading(float))
        found = abs(Fraction(evaluate(total, values, Reading(float))) - exactly)
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
