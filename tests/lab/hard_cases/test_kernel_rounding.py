"""Rounding of the exported functions: the quick run passes, programs are the C code to the bit, its numbers hold."""

import json
import math
import random
import re
import subprocess
from dataclasses import replace
from fractions import Fraction
from pathlib import Path

import numpy as np
import pytest
from flint import arb
from mpmath import mp

from tests import compiled
from tests.lab.hard_cases.hard_case import assert_passes, assert_readable
from viscopade.arithmetic.balls import exact_middle, to_mpf, working
from viscopade.arithmetic.formats import DOUBLE, FLOAT
from viscopade.collision import exact
from viscopade.kernels import requests
from viscopade.kernels.expressions import Name
from viscopade.kernels.forms import last_place
from viscopade.kernels.forms.speed_kernel import HALF_LINE
from viscopade.kernels.names import TIERS
from viscopade_lab.hard_cases import exported, machine
from viscopade_lab.hard_cases import kernel_rounding as case

EXPORTS = Path(__file__).parents[3] / "exports"
each_form = pytest.mark.parametrize("form", [DOUBLE, FLOAT], ids=lambda form: form.name)


@pytest.fixture(scope="module")
def result():
    return case.CASE.run(False)


@pytest.fixture(scope="module")
def functions():
    """Return cheap functions of every kind, by kernel, name and type."""
    chosen = [*exported.of_pade(), *exported.of_minimax(((1, 4), (3, 7)))]
    chosen += [*exported.of_half_line(("1e-5",)), *exported.of_inverse(("1e-3",)), *exported.of_tables(("1e-3",), 2)]
    return chosen


def generator():
    return np.random.default_rng(1)


def points(function, number=400):
    kind = machine.type_of(function.form)
    x = np.geomspace(function.low, function.high, number) * generator().uniform(0.999, 1.001, number)
    return np.clip(x.astype(kind), kind(function.low), kind(function.high))


def test_quick_run_passes(result):
    assert_passes(result)
    assert len(result.checks) == 12
    assert len(result.charts) == 3
    assert_readable(result)


def test_a_search_is_the_same_again(functions):
    for function in functions[::5]:
        once, again = (case.largest_error(function, case.OFF, 50, 1, generator()) for _ in range(2))
        assert once == again


@pytest.mark.slow
def test_it_is_the_same_again(result):
    assert case.CASE.run(False) == result


@pytest.mark.slow
def test_thorough_run_passes():
    assert_passes(case.CASE.run(True))


# --- what is tried is what is exported --------------------------------------------------------------------------------


def certificates(name):
    return json.loads((EXPORTS / f"{name}_certificates.json").read_text())["certificates"]


def numbers(texts):
    return tuple(map(float.fromhex, texts))


def within_digits(header, size):
    """Whether a header's number is the size, rounded up to two digits."""
    return size <= Fraction(header) <= size * Fraction(11, 10)


def test_best_quotients_are_those_of_the_headers():
    functions = {(f.kernel, f.name, f.form.name): f for f in exported.of_minimax()}
    found = certificates("minimax")
    assert len(found) == len(functions)
    for stated in found:
        m, n = stated["name"].split("_")[1:3]
        of_slope = stated["measure"] == "derivative"
        function = functions[f"best [{m}/{n}]", "derivative" if of_slope else "epsilon", stated["type"]]
        top = numbers(stated["t" if of_slope else "a"])
        letters = ("t" if of_slope else "a", top), ("b", stated["b"])
        a, b = ([function.constants[f"{x}{i}"] for i in range(len(c))] for x, c in letters)
        assert (tuple(a), tuple(b)) == (top, numbers(stated["b"]))
        assert within_digits(stated["rounding"], function.relative * (1 + Fraction(stated["bound"])))
        assert function.high == float(stated["v_star_max"])


@pytest.mark.parametrize("which", [((), ("1e-3",)), (("1e-5",), ()), pytest.param(None, marks=pytest.mark.slow)])
def test_half_line_and_inverse_kernels_are_those_of_the_headers(which):
    half_line, inverse = (exported.HALF_LINE, exported.INVERSE) if which is None else which
    functions = [*exported.of_half_line(tuple(half_line)), *exported.of_inverse(tuple(inverse))]
    stated = {
        (c["type"], numbers(c["a"]), numbers(c["b"])): (tuple(c["top"]), tuple(c["bottom"]), c["rounding"])
        for c in [*certificates("half_line"), *certificates("inverse")]
    }
    assert len({(f.kernel, f.form) for f in functions}) == (len(stated) if which is None else 2)
    for function in functions:
        a, b = ({int(key[1:]): c for key, c in function.constants.items() if key[0] == letter} for letter in ("a", "b"))
        top, bottom, sizes = stated[function.form.name, tuple(a.values()), tuple(b.values())]
        assert (tuple(a), tuple(b)) == (top, bottom)
        size = sizes["v_star" if function.kernel.startswith("inverse") else function.name]
        assert function.relative == Fraction(size["relative"])
        assert function.underflow == Fraction(size["underflow"]) * function.form.smallest


def test_pade_approximants_are_those_of_the_header():
    text = " ".join(line.strip(" *") for line in (EXPORTS / "viscopade_pade.h").read_text().splitlines())
    functions = [f for f in exported.of_pade() if "too" in f.name]
    assert len(functions) == 8
    for function in functions:
        part = text[text.index(f" {function.kernel.removeprefix('Padé ')} source:") :]
        *_, (bound, end) = re.findall(r"(\S+) for v\* <= ([0-9.]+)", part[: part.index("rounding:")])
        assert function.high == float(end)
        sizes = dict(re.findall(r"(\S+) eps in type (double|float)", part[part.index("rounding:") :])[1::-1])
        sizes = {form: size for size, form in sizes.items()}
        assert within_digits(sizes[function.form.name], function.relative * (1 + Fraction(bound)))


def test_nothing_that_is_exported_is_left_out():
    assert requests.HALF_LINE.accuracy == HALF_LINE == tuple(exported.HALF_LINE) == case.THOROUGH.half_line
    assert requests.INVERSE.inverse == tuple(exported.INVERSE) == case.THOROUGH.inverse
    assert case.THOROUGH.compact == HALF_LINE
    assert (*case.THOROUGH.tables, "full") == TIERS
    degrees = {tuple(map(int, c["name"].split("_")[1:3])) for c in certificates("minimax")}
    assert tuple(sorted(degrees)) == case.THOROUGH.minimax
    assert sorted((form.name, name) for form, name in case.THOROUGH.full) == sorted(
        (form, name) for form in ("double", "float") for name in last_place.FUNCTIONS
    )


def c_name(function):
    """Return the beginning of the C function's name."""
    if function.kernel.startswith("inverse"):
        return "v_star_inverse_5p77em4" if function.name == "v*(eps)" else "v_star_from_loss_inverse_5p77em4"
    if function.kernel.startswith("half-line"):
        return f"{function.name}_halfline_3p4em6"
    kind, degrees = function.kernel.split(" ")
    m, n = degrees.strip("[]").split("/")
    if kind == "Padé":
        return f"epsilon_pade_{m}_{n}"
    ends = {"1": "minimax_1_4_v5_9p87em4", "3": "minimax_3_7_v5_2p84em6"}[m]
    return f"{'epsilon_derivative' if function.name == 'derivative' else 'epsilon'}_{ends}"


HEADERS = ("pade", "minimax", "half_line", "inverse")


def library(directory, *flags):
    texts = [(EXPORTS / f"viscopade_{name}.h").read_text(encoding="utf-8") for name in HEADERS]
    return compiled.build(directory, texts, flags=flags)


def in_c(functions, built):
    for function in functions:
        if not function.kernel.startswith("table"):
            yield function, built[c_name(function) + function.form.suffix]


def test_programs_are_the_c_code_to_the_bit(functions, tmp_path):
    for function, c in in_c(functions, library(tmp_path)):
        x = points(function)
        found, expected = function.computed(x), np.array([c(v) for v in x.tolist()], x.dtype)
        if function.roots:  # NumPy's root, and that of the C library in type float, may be another neighbour
            assert np.allclose(found, expected, rtol=64 * 2.0**-function.form.precision, atol=0), function
        else:
            assert np.array_equal(found, expected), (function.kernel, function.name, function.form.name)


def test_fused_programs_are_contracted_c_code(functions, tmp_path):
    source = 'int main(void) { return !__builtin_cpu_supports("fma"); }\n'
    (tmp_path / "fma.c").write_text(source)
    command = [*compiled.compiler("c11"), str(tmp_path / "fma.c"), "-o", str(tmp_path / "fma")]
    if subprocess.run(command, capture_output=True).returncode or subprocess.run([tmp_path / "fma"]).returncode:
        pytest.skip("the processor has no fused multiplication, or the compiler cannot tell")
    for function, c in in_c(functions, library(tmp_path, "-mfma", "-ffp-contract=fast")):
        if not function.roots:
            x = points(function)
            expected = np.array([c(v) for v in x.tolist()], x.dtype)
            assert np.array_equal(function.computed(x, contracted=True), expected), function.kernel


# --- numbers by another way -------------------------------------------------------------------------------------------


@each_form
def test_fused_rounds_once(form):
    draw, kind = random.Random(3), machine.type_of(form)
    for _ in range(3000):
        x, y = (float(kind(draw.uniform(-2, 2) * 2.0 ** draw.randint(-8, 8))) for _ in range(2))
        # Often near -x y, so that much cancels, or far smaller, so that the sum is nearly half-way.
        z = float(kind(-x * y * (1 + draw.choice((0, 1e-7, -1e-15))) if draw.random() < 0.5 else draw.uniform(-1, 1)))
        z *= 2.0 ** draw.choice((0, 0, -30, 30))
        true = Fraction(x) * Fraction(y) + Fraction(z)
        found = machine.fused(*(np.array([v], kind) for v in (x, y, z)))
        assert found.dtype == kind
        assert float(found[0]) == form.nearest(true)


@each_form
def test_fused_rounds_once_near_a_tie(form):
    """x y + z a little beside the middle of two numbers: where two roundings go wrong."""
    kind, p = machine.type_of(form), form.precision
    one, tiny = 1.0, 2.0 ** -(2 * p - 3)
    for sign in (-1, 1):
        x, y, z = 2.0**-p, one + sign * 2.0 ** (1 - p), one + 2.0 ** (1 - p)
        true = Fraction(x) * Fraction(y) + Fraction(z)
        assert float(machine.fused(*(np.array([v], kind) for v in (x, y, z)))[0]) == form.nearest(true)
        assert abs(true - Fraction(z) - Fraction(2) ** -p) > tiny / 16


def horner(c, x):
    total = Fraction(0)
    for number in reversed(c):
        total = total * x + Fraction(number)
    return total


def test_exact_values_by_fractions(functions):
    for function in functions:
        if function.roots or "too" in function.name or function.kernel.startswith("table"):
            continue
        x = Fraction(float(points(function, 7)[3]))
        top, bottom = (
            sum(Fraction(c) * x ** int(key[1:]) for key, c in function.constants.items() if key[0] in letters)
            for letters in ("at", "b")
        )
        true = x * top / bottom**2 if function.name == "derivative" else top / bottom
        with working(exported.BITS):
            found = function.exact(float(x))
            assert abs(exact_middle(found) / true - 1) < Fraction(1, 2**150)


def written_down(function, x):
    """The formulas with roots, written down apart from the programs, in mpmath."""
    c = {name: mp.mpf(number) for name, number in function.constants.items()}
    v_star = mp.mpf(x)

    def polynomial(letter, y):
        return sum(number * y ** int(name[1:]) for name, number in c.items() if name[0] == letter)

    if function.kernel.startswith("inverse"):
        y = ((1 / mp.mpf(x) - 1) ** (1 if function.name == "v*(eps)" else -1)) ** (mp.mpf(1) / 10)
        return y**5 * polynomial("a", y) / polynomial("b", y)
    y = mp.cbrt(v_star)
    elastic, lost = polynomial("b", y), v_star**2 * polynomial("a", y)
    return {"epsilon": elastic, "one_minus_epsilon": lost}[function.name] / (elastic + lost)


def test_exact_values_of_formulas_with_roots(functions):
    for function in functions:
        if function.roots and not function.kernel.startswith("compact"):
            for x in points(function, 5).tolist():
                with working(exported.BITS), mp.workprec(exported.BITS):
                    assert abs(to_mpf(function.exact(x)) / written_down(function, x) - 1) < mp.mpf(2) ** -150


def test_the_worst_error_found_by_fractions():
    (function,) = (f for f in exported.of_minimax(((3, 7),)) if (f.name, f.form) == ("epsilon", FLOAT))
    w = case.largest_error(function, case.SEPARATE, 300, 4, generator())
    a, b = exported.minimax_coefficients(3, 7, FLOAT)

    def computed(c):
        total = np.float32(c[-1])
        for number in c[-2::-1]:
            total = np.float32(number) + np.float32(w.x) * total
        return total

    true = horner(a, Fraction(w.x)) / horner(b, Fraction(w.x))
    error = float(abs(Fraction(float(computed(a) / computed(b))) / true - 1))
    assert w.relative == pytest.approx(error, rel=1e-9, abs=0)
    assert w.ratio == pytest.approx(error / float(function.relative), rel=1e-9)
    assert 2.0**-24 < error < float(function.relative)


def test_the_search_is_better_than_chance():
    (function,) = (f for f in exported.of_minimax(((3, 7),)) if (f.name, f.form) == ("epsilon", DOUBLE))
    found = [case.largest_error(function, case.SEPARATE, 200, rounds, generator()).ratio for rounds in (0, 12)]
    assert found[1] > 1.15 * found[0]


def test_truth_of_full_accuracy():
    for name in last_place.FUNCTIONS:
        for v_star in (2.0**-20, 0.01, 0.3, 1.0, 1.75, 40.0, 2.0**19):
            with working(exported.BITS):
                found = exact_middle(exported.true_value(name, arb(v_star)))
            true = Fraction(exact.collision(Fraction(v_star), 30).decimals()[name])
            assert abs(found / true - 1) < Fraction(1, 2**60)


# --- that the checks can fail -----------------------------------------------------------------------------------------


def of(functions, kernel, name, form):
    return next(f for f in functions if (f.kernel, f.name, f.form) == (kernel, name, form))


def ratio(function, way=case.SEPARATE, number=300):
    return case.largest_error(function, way, number, 3, generator()).ratio


@pytest.mark.parametrize("way", [case.SEPARATE, case.FUSED], ids=lambda way: way.name)
def test_a_wrong_last_bit_of_a_coefficient_is_noticed(functions, way):
    """In the code, but not in the formula: the constant 1 of the numerator is off by some units in the last place."""
    function = of(functions, "best [3/7]", "epsilon", DOUBLE)
    assert ratio(function, way) < 1
    off = dict(function.constants) | {"a0": 1 + 24 * 2.0**-52}
    assert ratio(replace(function, constants=off, exactly={"a0": Fraction(1)}), way) > 1


def test_an_order_of_evaluation_that_cancels_is_noticed(functions):
    """eps as 1 - (1 - eps), where eps is small."""
    far = next(f for f in functions if (f.kernel, f.name, f.form) == ("half-line 1e-5", "epsilon", FLOAT) and f.low > 1)
    assert ratio(far) < 1
    one, minus, elastic, lost = map(Name, ("one", "minus", "elastic", "lost"))
    constants = {**far.constants, "one": 1.0, "minus": -1.0}
    assert ratio(replace(far, result=one + minus * (lost / (elastic + lost)), constants=constants)) > 1


def test_a_root_that_is_too_bad_is_noticed(functions):
    function = of(functions, "inverse 1e-3", "v*(1 - eps)", FLOAT)
    assert ratio(function, case.OFF) < 1
    assert ratio(function, case.ArithmeticVariant("bad", steps=40)) > 1


def test_a_bound_that_is_too_small_is_noticed(functions):
    function = of(functions, "table 1e-3", next(f.name for f in functions if f.kernel == "table 1e-3"), FLOAT)
    assert ratio(function) < 1
    assert ratio(replace(function, relative=function.relative / 8)) > 1


def test_a_search_in_another_precision_is_noticed(functions, monkeypatch):
    """If type float were computed in type double, the search would find less than the last rounding does."""
    function = of(functions, "best [3/7]", "epsilon", FLOAT)
    assert case.largest_error(function, case.SEPARATE, 300, 2, generator()).roundings > 1

    class InDouble:
        def __init__(self, given):
            self.__dict__.update(vars(given))
            self.given_function = replace(given, form=DOUBLE)

        def computed(self, x, steps=0, contracted=False):
            return self.given_function.computed(x.astype(float), steps, contracted)

        exact, allowed = exported.ExportedFunction.exact, exported.ExportedFunction.allowed

    assert case.largest_error(InDouble(function), case.SEPARATE, 300, 2, generator()).roundings < 1


def test_nan_is_infinitely_wrong(functions):
    function = of(functions, "best [3/7]", "epsilon", DOUBLE)
    broken = replace(function, constants={**function.constants, "b0": math.nan})
    assert ratio(broken, number=20) == math.inf


def test_steps_move_roots_only(functions):
    x = np.array([0.3, 0.7], np.float32)
    polynomial = of(functions, "best [3/7]", "epsilon", FLOAT)
    assert np.array_equal(polynomial.computed(x, np.array([3, -3])), polynomial.computed(x))
    rooted = of(functions, "half-line 1e-5", "one_minus_epsilon", FLOAT)
    assert not np.array_equal(rooted.computed(x, np.array([3, -3])), rooted.computed(x))


def test_neighbours():
    x = np.array([1.0, 1.0, 0.5], np.float32)
    expected = np.nextafter(x, np.array([2, 0, 0], np.float32), dtype=np.float32)
    assert np.array_equal(machine.moved(x, np.array([1, -1, -1])), expected)


def test_bounds_for_one_argument_lie_between_the_error_and_the_bound_for_all(functions):
    for function in functions:
        if function.local is None:
            continue
        for x in points(function, 4).tolist():
            here = function.local(x)
            assert Fraction(1, 2**function.form.precision) < here <= function.relative * Fraction(1001, 1000), function
            (score,) = case._scores(function, case.SEPARATE, np.array([x], machine.type_of(function.form)), np.zeros(1))
            assert score.relative <= here


def test_a_root_whose_error_was_forgotten_is_noticed(functions, monkeypatch):
    """The bound for one argument, without what the root may be off."""
    function = of(functions, "inverse 1e-3", "v*(1 - eps)", FLOAT)
    w = case.largest_error(function, case.OFF, 300, 3, generator())
    assert w.local < 1
    monkeypatch.setattr(exported, "_of_root", lambda form: arb(0))
    assert case.largest_error(function, case.OFF, 300, 3, generator()).local > 1
