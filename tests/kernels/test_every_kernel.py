"""Every ready kernel, in every target that writes it: what a file says, what its code returns, and what is refused.

Arguments are those of the test vectors, and random ones, others every day; exact values and bounds come from the module
that makes the vectors (test_vectors.py compares it with the equation of motion).
"""

import ctypes
import inspect
import json
import math
import random
import re
import subprocess
from decimal import Decimal
from fractions import Fraction
from functools import cache, partial
from itertools import product

import numpy as np
import pytest

import viscopade as vp
from tests import compiled, daily
from tests.kernels import languages
from tests.kernels.languages import (
    FORMS,
    LANGUAGES,
    TYPES,
    Code,
    c_command,
    c_library,
    called,
)
from tests.kernels.speed_headers import machine_flags, named_compiler
from tests.titles import HARD
from viscopade.arithmetic.balls import working
from viscopade.arrays import double
from viscopade.generated import END_CONDITION, MARKER
from viscopade.kernels import requests, truth
from viscopade.kernels.forms.lacunary_kernels import HalfLineKernel
from viscopade.kernels.forms.quotient import PadeKernel, Quotient
from viscopade.kernels.forms.speed_kernel import SpeedKernel
from viscopade.kernels.names import TIERS
from viscopade.kernels.requests import KINDS, Request
from viscopade.kernels.targets import quotients, vectors
from viscopade.kernels.targets.languages import target as target_of
from viscopade.kernels.targets.languages import targets
from viscopade.kernels.targets.table_free import name_of

OTHERS = {
    "minimax-relative": Request(minimax=((2, 3),), v_star_min="0.5", v_star_max="3", measure="relative"),
    "inverse-interval": Request(inverse=("1e-3",), epsilon_min="0.3"),
}
"""Their results are tested in C, and those of Python against C."""
REQUESTS = {
    "pade": requests.PAPER,
    "minimax": requests.RECOMMENDED,
    "compact": requests.WITHOUT_TABLES,
    "compact-relative": Request(accuracy=("1e-3",), measure="relative"),
    "inverse": requests.INVERSE,
    "full": Request(full=True),
    **{f"speed-{tier}": Request(from_speed=(tier,)) for tier in TIERS},
    **OTHERS,
}
COMPACT = {target.name for target in targets() if target.compact}
SHADERS = {target.name for target in targets() if target.place == "shader"}
# Shaders have type float alone, which does not hold the most accurate kernels; of the paper's inverses, with roots of
# an order above 2, only C and Python have functions.
UNWRITTEN = {
    "minimax": SHADERS,
    "inverse": COMPACT,
    "inverse-interval": COMPACT,
}


def kind(request):
    return next(found for found in KINDS if found.wanted(request))


CASES = [
    (name, language)
    for name, request in REQUESTS.items()
    for language, how in LANGUAGES.items()
    if how.target in set(kind(request).targets) - UNWRITTEN.get(name, set()) and (name not in OTHERS or language == "C")
]


def written(name):
    """Return the targets of a request."""
    return [target for target in kind(REQUESTS[name]).targets if target not in UNWRITTEN.get(name, ())]


@cache
def text(name, target):
    """Return the text of a file."""
    return REQUESTS[name].render(target)


def read(lines):
    """Return rows of arguments and least and greatest result by function and type."""
    found = {}
    for function, form, x, y, _, _, _, least, most, _ in lines:
        if least != "-":
            row = [float.fromhex(word) for word in (x, y, least, most) if word != "-"]
            found.setdefault((function, form), []).append(row)
    return {key: np.array(rows) for key, rows in found.items()}


@cache
def rows_of(name):
    """Return the rows of the test vectors, and some at random arguments."""
    found = json.loads(text(name, "vectors"))
    return read([*found["vectors"], *found.get("beyond", []), *random_lines(name, 6)])


def random_lines(name, number):
    """Return vectors at random arguments, where anything is stated of the result."""
    generator = random.Random(f"{name} {daily.DAY}")
    with working(truth.BITS), np.errstate(all="ignore"):
        lines = [
            vectors._line(function, given)
            for kernel in REQUESTS[name].prove()
            for function in vectors._functions(kernel)
            for given in arguments(function.name, function.form.name, number, generator)
        ]
    return [json.loads(line) for line in lines if line is not None]


WHOLE = {"double": (-1074, 1023), "float": (-149, 127)}  # exponents of all numbers
OF_V_STAR = ("epsilon_", "one_minus_epsilon_")
OF_EPSILON = ("v_star_", "beta_")


def arguments(function, form, number, generator):
    """Return random arguments, numbers of the type: portions of any size, and speeds of usual size or any."""

    def portion():
        near_one = 1 - 10 ** -generator.uniform(1, 6)
        return generator.choice([generator.random(), 2.0 ** generator.uniform(WHOLE[form][0], 0), near_one])

    def size(least=-14, most=14):
        return 2.0 ** generator.uniform(*generator.choice([(least, most), (least, most), WHOLE[form]]))

    for _ in range(number):
        if function.startswith(OF_V_STAR):
            given = [generator.choice([size(), generator.uniform(0.5, 3)])]
        elif function.startswith(OF_EPSILON):
            given = [portion(), *[size()] * function.startswith("beta")]
        else:
            given = [size(-90, 60), size(-6, 6)]
        yield tuple(float(TYPES[form](x)) for x in given)


@cache
def domains(name):
    """Return the ends of the domain of functions of one variable, by function and type."""
    request = REQUESTS[name]
    found = {}
    for kernel in request.prove() if kind(request).id == "quotient" else ():
        for form in FORMS.values():
            try:
                found[f"epsilon_{kernel.name}", form.name] = quotients.function_of_v_star(kernel, form).ends
            except ValueError:
                continue
    return found


@cache
def ending(name):
    """Return the names of kernels with an interval, a pole or a zero, beyond which Python refuses arguments."""
    found = [kernel for kernel in REQUESTS[name].prove() if isinstance(kernel, Quotient)]
    return tuple(kernel.name for kernel in found if kernel.end or kernel.interval)


def has(how, written, function, form):
    """Whether a file has a function."""
    suffix = target_of(how.target).number(form).suffix
    return re.search(rf"\b(viscopade_)?{function}({suffix})?\b", written) is not None


@cache
def functions_of(name, language, form, arity):
    """Return the functions of a file that have vectors."""
    how = LANGUAGES[language]
    return tuple(
        function
        for (function, of_form), rows in rows_of(name).items()
        if of_form == form and rows.shape[1] == arity + 2 and has(how, text(name, how.target), function, form)
    )


def code_of(name, language, form, arity):
    """Return a file and all functions of a type that take so many arguments."""
    return Code(text(name, LANGUAGES[language].target), functions_of(name, language, form, arity), form, arity)


@pytest.fixture(scope="module")
def run(tmp_path_factory):
    """Return a function from a request, a language, a type and a number of arguments to the results of its file."""

    @cache
    def ready(name, language, form, arity):
        return LANGUAGES[language].run(tmp_path_factory.mktemp("language"), code_of(name, language, form, arity))

    return ready


# --- texts ------------------------------------------------------------------------------------------------------------

FILES = [(name, target) for name in REQUESTS for target in written(name)]
JSON = {"json", "certificates", "vectors"}
CODE = {how.target for how in LANGUAGES.values()}
NUMBER = re.compile(r"(?<![\w.])-?(?:0x1(?:\.[0-9a-f]+)?p[+-]\d+|\d+\.\d+(?:[ef]-?\d+)?)")
IS_TABLE = ("full", "speed")  # kinds whose coefficients are rows of a table


def words_of(written):
    """Return a text without marks of comments and breaks of lines."""
    return " ".join(" ".join(re.sub(r'^[ *#%!/"]+', "", line) for line in written.splitlines()).split())


@pytest.mark.parametrize("name", UNWRITTEN)
def test_what_cannot_be_written_is_refused(name):
    for target in UNWRITTEN[name]:
        with pytest.raises(
            ValueError, match=f"cannot be written in {target}: .*|accepted for inverse kernels is c, python"
        ):
            REQUESTS[name].render(target)


@pytest.mark.parametrize(("name", "target"), FILES)
def test_a_file_says_what_it_is(name, target):
    of, found = REQUESTS[name], text(name, target)
    kernels = [kernel for kernel in of.prove() if kernel is not None]
    lines, words = found.splitlines(), words_of(found)
    assert re.search(rf"{MARKER} {re.escape(vp.__version__)}", found[:1000])
    assert of.command(target) in found[:1000]
    assert END_CONDITION in words
    assert found.isascii()
    assert found.endswith("\n")
    assert not found.endswith("\n\n")
    assert "\r" not in found
    assert not [line for line in lines if line != line.rstrip()]
    if target in ("c", "cuda") and kind(of).id not in IS_TABLE:
        assert "\n\n\n" not in found
    if name not in OTHERS and kind(of).id not in IS_TABLE and target not in JSON:
        assert max(map(len, lines)) <= (120 if target == "c" else 132)
    for kernel in kernels:
        if name.startswith("compact") and target in CODE:
            stated = [v.certificate.bound for v in kernel.variants if v.form.name in target_of(target).formats]
            assert all(part in words for part in (name_of(kernel), "domain: 2^-", "proven:", "assumed:"))
            assert stated or f"{name_of(kernel)} is left out" in words
            assert all(f"<= {bound}" in words or f"and {bound}" in words for bound in stated)
            continue
        called = name_of(kernel) if name.startswith("compact") and target == "vectors" else kernel.name
        assert called in found or getattr(kernel, "label", called) in found
        if target not in JSON and kind(of).id not in IS_TABLE:
            assert kernel.proven
            assert all(fact in words for fact in kernel.facts)


CONSTANT = re.compile(r"VISCOPADE_CONSTANT\((-?0x[^,]+), ([^)]+)\)")


def numbers_in(written, form):
    """Return the sizes of all numbers in a text, rounded to a type."""
    words = (word.lstrip("-") for word in NUMBER.findall(written))
    exact = (Fraction(float.fromhex(w) if "0x" in w else w.removesuffix("f").replace("f", "e")) for w in words)
    return {float(form.rounded(number)) for number in exact}


@pytest.mark.parametrize(
    ("name", "target"), [(n, t) for n, t in FILES if t in CODE and kind(REQUESTS[n]).id not in IS_TABLE]
)
def test_coefficients_read_back(name, target):
    """Every coefficient is in the text of its type to the last bit; the hexadecimal of a pair is the decimal's."""
    found, checked = text(name, target), 0
    for form in map(FORMS.get, target_of(target).formats):
        numbers = numbers_in(found, form)
        for kernel in REQUESTS[name].prove():
            if isinstance(kernel, PadeKernel):
                coefficients = [form.nearest(c) for values in kernel.reduced for c in values]
            else:
                coefficients = [c for v in kernel.variants if v.form == form for c in (*v.a, *v.b)]
            assert {abs(c) for c in coefficients} - {0.0, 1.0} <= numbers
            checked += len(coefficients)
    assert checked
    for pair in CONSTANT.findall(found):
        form = FORMS["float" if pair[1].endswith("f") else "double"]
        hexadecimal, decimal = (literal.removesuffix("f") for literal in pair)
        assert float.fromhex(hexadecimal) == form.nearest(Fraction(decimal))


# --- results ----------------------------------------------------------------------------------------------------------


@pytest.mark.parametrize(("name", "language"), CASES, ids=lambda word: word.replace(", ", "-").replace(" ", "-"))
def test_results_are_within_the_proven_bounds(run, name, language):
    checked = 0
    for form in LANGUAGES[language].forms:
        for arity in (1, 2):
            if functions_of(name, language, form, arity):
                checked += check(run(name, language, form, arity), language, name, form, arity)
    assert checked


SIZES = {
    "double": (0.0, 5e-324, 1e-310, 1e-300, 1e-20, 0.3, 1.0, 1e20, 1e300),
    "float": (0.0, 1e-45, 1e-40, 1e-37, 1e-20, 0.3, 1.0, 1e20, 1e37),
}
TRAPS = """#define _GNU_SOURCE
#include <fenv.h>
#include <stdlib.h>
int traps(void) { return FE_DIVBYZERO | FE_INVALID | FE_OVERFLOW; }
int clear(void) { return feclearexcept(traps()); }
int raised(void) { return fetestexcept(traps()); }
__attribute__((constructor)) static void trap(void) { if (getenv("TRAP")) feenableexcept(traps()); }
"""
# JavaScript and Julia have no exceptions of floating-point numbers, nor have shaders.
IN_PROCESS, PROGRAMS, PYTHON = ("c", "cuda"), ("fortran", "rust"), ("python", "jax", "numba", "warp")
RAISING = [case for case in CASES if LANGUAGES[case[1]].target in (*IN_PROCESS, *PROGRAMS, *PYTHON)]


@pytest.fixture(scope="module")
def traps(tmp_path_factory):
    """Return a library that tells which exceptions were raised, and that lets a program stop at each."""
    source = tmp_path_factory.mktemp("traps") / "traps.c"
    source.write_text(TRAPS)
    library = source.with_suffix(".so")
    command = [*compiled.compiler("gnu99"), source, "-shared", "-fPIC", "-o", library, "-lm"]
    if subprocess.run(command, capture_output=True).returncode:
        pytest.skip("the C library does not trap exceptions")
    return library


@pytest.mark.parametrize(("name", "language"), RAISING, ids=lambda word: word.replace(", ", "-").replace(" ", "-"))
def test_no_exception_is_raised_that_programs_trap(run, traps, monkeypatch, name, language):
    """No division by zero, invalid operation or overflow, at which OpenFOAM stops; in Python no warning."""
    how, found = LANGUAGES[language], ctypes.CDLL(str(traps))
    if how.target in PROGRAMS:
        monkeypatch.setenv("TRAP", "1")
        monkeypatch.setenv("LD_PRELOAD", str(traps))
    if how.target in PYTHON:
        monkeypatch.setenv("PYTHONWARNINGS", "error::RuntimeWarning")
    for form, arity in product(how.forms, (1, 2)):
        functions = functions_of(name, language, form, arity)
        if not functions or (language, arity) == ("Rust", 1):  # it also computes what a branch leaves out
            continue
        sizes = [size for size in SIZES[form] if size <= 1 or not functions[0].startswith(OF_EPSILON)]
        rows = product(sizes, (0.0, 1e-40, 0.01, 1.307)) if arity == 2 else ((size,) for size in sizes)
        columns, compute = np.array(list(rows), TYPES[form]).T, run(name, language, form, arity)
        found.clear()
        compute(*columns)
        assert how.target not in IN_PROCESS or not found.raised()


def check(compute, language, name, form, arity):
    """Compare the results of all functions, each with its own rows; return how many there are."""
    how, functions, of = LANGUAGES[language], functions_of(name, language, form, arity), rows_of(name)
    everything = np.concatenate([of[function, form] for function in functions])
    found = compute(*everything.T[:arity].astype(TYPES[form]))
    smallest = np.finfo(TYPES[form]).tiny
    start = 0
    for function in functions:
        rows = of[function, form]
        result = np.float64(found[function][start : start + len(rows)])
        start += len(rows)
        *arguments, least, most = rows.T
        good = np.where(np.isnan(least), np.isnan(result), (least <= result) & (result <= most))
        low, high = domains(name).get((function, form), (0.0, math.inf))
        inside = (arguments[0] >= low) & (arguments[0] <= high)
        if target_of(how.target).functions is not None and (function, form) in domains(name):
            # Functions of one variable in compact languages: NaN outside the domain, or in shaders nothing.
            good = np.where(inside, good, how.is_shader | np.isnan(result))
        elif language == "Python":
            ends = function.endswith(ending(name))
            good |= np.isnan(result) & (~inside | (ends & np.isinf(arguments).any(axis=0)))
        if how.is_shader:  # NaN is not promised
            good |= np.isnan(least)
        if how.is_shader or language == "JAX":
            good |= (np.abs([*arguments, least]) < smallest).any(axis=0)
        assert good.all(), (function, form, rows[~good][:5], result[~good][:5])
    return len(functions)


# --- C and C++ --------------------------------------------------------------------------------------------------------

IN_C = [name for name in REQUESTS if "c" in written(name)]
OLD = ("c++98", "c++14")  # headers with tables take C99 or C++17
BUILDS = {
    **{standard: (standard, ("-O0",)) for standard in compiled.STANDARDS},
    "clang": ("c99", ("-O0",)),
    "clang++": ("c++17", ("-O0",)),
    "fused": ("c99", ("-O3", "-ffp-contract=fast", *machine_flags())),
}


def command_of(build):
    """Return the command of a build, or skip the test."""
    standard, flags = BUILDS[build]
    command = c_command(standard, flags)
    if "clang" in build:
        return (*named_compiler("clang", standard), *command[len(compiled.compiler(standard)) :])
    return command


def headers_for(build):
    """Return the headers of a standard by request and language."""
    old = BUILDS[build][0] in OLD
    languages = [(name, "C") for name in IN_C if not old or kind(REQUESTS[name]).id not in IS_TABLE]
    languages.append(("compact", "CUDA, host"))
    return {(name, language): text(name, LANGUAGES[language].target) for name, language in languages}


@pytest.mark.parametrize("build", [build for build in BUILDS if build != "fused"])
def test_every_header_alone_compiles_without_warnings(tmp_path, build):
    files = []
    for i, header in enumerate(headers_for(build).values()):
        files.append(tmp_path / f"{i}.src")
        files[-1].write_text(header)
    command = [word for word in command_of(build) if word != "-shared"]
    languages.built(tmp_path, *command, "-Wno-unused-function", "-fsyntax-only", *map(str, files))


@pytest.mark.parametrize("build", BUILDS)
def test_all_headers_in_one_program(run, build):
    """Each twice, in one order and in the other; by every standard with the same bits, and fused within the bounds."""
    command, found = command_of(build), headers_for(build)
    headers = [*found.values(), Request(pade=((3, 6),)).render("c")]
    headers = headers[::-1] if "++" in build else headers
    library = c_library(headers * 2, command)
    for name, language in found:
        for form, arity in product(FORMS, (1, 2)):
            if not functions_of(name, language, form, arity):
                continue
            code = code_of(name, language, form, arity)
            compute = called(library, code, FORMS[form].suffix)
            if build == "fused":
                check(compute, language, name, form, arity)
                continue
            rows = np.concatenate(
                [rows_of(name)[function, form] for function in functions_of(name, language, form, arity)]
            )
            given = rows.T[:arity].astype(TYPES[form])
            for function, same in run(name, language, form, arity)(*given).items():
                np.testing.assert_array_equal(compute(*given)[function], same)


def claims(kernel, form):
    """Return what is stated of eps: ends, bound and measure, and the rounding of eps and of 1 - eps."""
    if isinstance(kernel, HalfLineKernel):
        variant = kernel.variant(form)
        return [(variant.certificate, {kind_: variant.rounding(kind_) for kind_ in kernel.checked})]
    if isinstance(kernel, PadeKernel):
        return [(bound, {"epsilon": dict(kernel.rounding)[form.name]}) for bound in kernel.bounds]
    variant = kernel.variant(form)
    return [(variant.certificate, {"epsilon": variant.rounding})]


@pytest.mark.parametrize("name", ["pade", "minimax", "minimax-relative", "speed-1e-5"])
@pytest.mark.parametrize("form", FORMS)
def test_many_points_against_double(run, name, form):
    """The error is nearly as large as the bound says, and no larger but for rounding, with FMA contraction or without.

    `double` is within one unit in the last place.
    """
    fused = called(c_library([text(name, "c")], command_of("fused")), code_of(name, "C", form, 1), FORMS[form].suffix)
    for kernel in REQUESTS[name].prove():
        kernel = kernel.slow if isinstance(kernel, SpeedKernel) else kernel
        if f"epsilon_{kernel.name}" not in functions_of(name, "C", form, 1):
            continue
        for proven, rounding in claims(kernel, FORMS[form]):
            low, high, bound = float(proven.low), min(float(proven.high), 1e8), float(proven.bound)
            points = [np.linspace(low, min(high, 10), 10_001), np.geomspace(max(low, 1e-15), high, 10_001)]
            v_star = np.concatenate(points).astype(TYPES[form]).astype(float)
            v_star = v_star[(v_star >= low) & (v_star <= high)]
            eps, loss = double.epsilon(v_star), double.one_minus_epsilon(v_star)
            measure, far = np.minimum(eps, loss) if proven.measure == "both" else eps, v_star > 0.01
            for compute in (run(name, "C", form, 1), fused):
                found, reached = compute(v_star), 0.0
                for function, size in rounding.items():
                    true = eps if function == "epsilon" else loss
                    error = np.abs(found[f"{function}_{kernel.name}"].astype(float) - true)
                    allowed = bound * measure * (1 + 1e-9) + (float(size) + 3e-16) * true
                    assert (error <= allowed).all(), (function, v_star[error > allowed])
                    reached = max(reached, (error[far] / measure[far]).max())
                assert reached > 0.97 * bound


PATTERNS = """
#include <stdint.h>
#include <stdio.h>
#include <string.h>
static int usual[NUMBER], infinite[NUMBER];
static void judge(int i, double x, double found)
{
    usual[i] += found >= 0.0 && found < INFINITY;
    infinite[i] += isfinite(x) && isinf(found);
}
int main(void)
{
    uint64_t z = 1;
    for (long n = 0; n < 40000; n++) {
        z = z * UINT64_C(6364136223846793005) + UINT64_C(1442695040888963407);
        uint64_t bits = n < 4096 ? (uint64_t)n << 52 : n < 8192 ? ((uint64_t)(n - 4096) << 52) - 1 : z;
        uint32_t bitsf = (uint32_t)(n < 8192 ? (uint64_t)n << 20 : z >> 32);
        double x, y = (double)(z >> 40);
        float xf, yf = (float)(z >> 40);
        memcpy(&x, &bits, sizeof bits);
        memcpy(&xf, &bitsf, sizeof bitsf);
        CALLS
    }
    for (int i = 0; i < NUMBER; i++) printf("%d %d\\n", usual[i], infinite[i]);
    return 0;
}
"""
ARRAYS = """
static void arrays_NAMEEND(size_t n)
{
    static uint64_t z = 1;
    TYPE *speed = malloc(n * sizeof *speed), *beta = malloc(n * sizeof *beta), *out = malloc(n * sizeof *out);
    int *pair = malloc(n * sizeof *pair);
    for (size_t i = 0; i < n; i++) {
        z = z * UINT64_C(6364136223846793005) + UINT64_C(1442695040888963407);
        pair[i] = (int)((z >> 40) % n);
        beta[i] = (TYPE)(z >> 60);
        memcpy(&speed[i], (const char *)&z + sizeof z - sizeof *speed, sizeof *speed);
        speed[i] = n % 3 ? speed[i] : (TYPE)(z >> 40);
    }
    CALLS
    free(speed), free(beta), free(out), free(pair);
}
"""
"""Memory is as large as needed, so that the sanitizer sees every access beyond it."""
SANITIZERS = ["-fsanitize=undefined,address", "-fno-sanitize-recover=all"]


def sanitized(folder, source, *flags):
    """Compile and run a program that the sanitizers watch; return what it prints."""
    (folder / "patterns.c").write_text(source)
    command = [*compiled.compiler("c99"), "-O1", *flags, "-o", str(folder / "patterns"), str(folder / "patterns.c")]
    if subprocess.run([*command, *SANITIZERS, "-lm"], capture_output=True, text=True).returncode:
        pytest.skip("the compiler has no sanitizers")
    done = subprocess.run([str(folder / "patterns")], capture_output=True, text=True)
    assert done.returncode == 0, done.stderr
    return done.stdout


def test_no_undefined_behaviour_and_no_overflow_for_any_bits(tmp_path):
    """No finite input gives an infinity, nor a division by 0 (of which the sanitizer would tell)."""
    headers = headers_for("c99")
    functions = [
        (form, arity, function)
        for form, arity in product(FORMS, (1, 2))
        for name, language in headers
        for function in functions_of(name, language, form, arity)
    ]
    calls = []
    for i, (form, arity, function) in enumerate(functions):
        end = FORMS[form].suffix
        given = ", ".join(f"{x}{end}" for x in "xy"[:arity])
        calls.append(f"judge({i}, (double)x{end}, (double)viscopade_{function}{end}({given}));")
    body = PATTERNS.replace("CALLS", "\n".join(calls)).replace("NUMBER", str(len(calls)))
    printed = sanitized(tmp_path, "\n".join([*headers.values(), body]), "-fsanitize=float-divide-by-zero")
    assert len(functions) > 60
    for (_, _, function), line in zip(functions, printed.splitlines(), strict=True):
        usual, infinite = map(int, line.split())
        # Half of all numbers are positive, and half of these are below 1. Intervals of eps are short, some formulas
        # have a zero, and v* of Hunt and Crossley is about 1/eps, which has no number of the type if eps is subnormal.
        least = 0.3 if function.startswith((*OF_V_STAR, "restitution", "rebound", "dissipation")) else 0.2
        least = 0.09 if re.search("pade_2_5|_relative", function) else least
        assert 0.6 * 40_000 > usual >= (0 if "_e0p" in function else least * 40_000), function
        assert not infinite or ("v_star" in function and "_a" in function), function


@pytest.mark.parametrize("math_flag", ["-fno-fast-math", "-ffast-math"])
def test_no_undefined_behaviour_of_array_functions(tmp_path, math_flag):
    """For any speeds and lengths, with the rules of IEEE and without them."""
    body, runs = ["#include <stdlib.h>"], []
    for name, (form, number) in product([tier.replace("-", "m") for tier in TIERS], FORMS.items()):
        end = f"{name}{number.suffix}"
        calls = "\n    ".join(
            f"viscopade_{function}_{kind_}_{end}(n, speed, {beta}, out);"
            for function in ("restitution", "rebound", "dissipation")
            for kind_, beta in (("each", "beta"), ("by_pair", "pair, beta"), ("array", "(TYPE)1.3"))
        )
        made = ARRAYS.replace("CALLS", calls).replace("NAME", name).replace("END", number.suffix)
        body.append(made.replace("TYPE", form))
        runs.append(f"arrays_{end}(n);")
    main = f"int main(void) {{ for (size_t n = 0; n < 300; n++) {{ {' '.join(runs)} }} return 0; }}"
    headers = [text(f"speed-{tier}", "c") for tier in TIERS]
    sanitized(tmp_path, "\n".join([*headers, *body, main]), math_flag)


# --- Python -----------------------------------------------------------------------------------------------------------


@cache
def module(name):
    """Return the names of a module."""
    made = {"__name__": "generated"}
    exec(text(name, "python"), made)
    return made


def with_one(call, number, i, x):
    """Return a result with one argument x, the others being 1/2."""
    return call(*(x if j == i else 0.5 for j in range(number)))


IN_PYTHON = [name for name in REQUESTS if "python" in written(name)]


@pytest.mark.parametrize("name", IN_PYTHON)
def test_python_takes_real_numbers_and_refuses_others(name):
    """Integers, fractions, decimals, NumPy's numbers; NaN gives NaN, and what is not in the domain has a message."""
    for function in (f for arity in (1, 2) for f in functions_of(name, "Python", "double", arity)):
        call = module(name)[function]
        parameters = [*inspect.signature(call).parameters]
        asked = REQUESTS[name].epsilon_min
        least = math.floor(float(asked) * 2**24) / 2**24  # in both types
        rounded = "" if least == float(asked) else f" ({asked} rounded down to a multiple of 2^-24)"
        domain = "0 < eps <= 1" if asked == "0" else f"{least} <= eps <= 1{rounded}"
        for i, parameter in enumerate(parameters):
            at = partial(with_one, call, len(parameters), i)
            expected = at(0.5)
            assert type(expected) is float
            for x in (Fraction(1, 2), Decimal("0.5"), np.float32(0.5), np.float64(0.5)):
                assert at(x) == expected
                assert type(at(x)) is float
            if parameter != "one_minus_epsilon":
                assert at(1) == at(1.0)
            assert math.isnan(at(math.nan))
            for x in ("1", None, 1j, [1.0], b"1"):
                with pytest.raises(TypeError, match=r"must be (a )?real number"):
                    at(x)
            with pytest.raises(ValueError, match=f"^{parameter} must not be an integer beyond the largest double$"):
                at(10**400)
            if parameter in ("epsilon", "one_minus_epsilon"):
                for x in (0.0 if parameter == "epsilon" else 1.0, 1.5):
                    with pytest.raises(ValueError, match=f"^{re.escape(f'{parameter} is {x}: accepted is {domain}')}$"):
                        at(x)
            for x in (-1, -5e-324, -math.inf):
                with pytest.raises(ValueError, match=rf"^{parameter} (must (not be negative|be positive), but )?is -"):
                    at(x)


@pytest.mark.parametrize("name", IN_PYTHON)
def test_python_is_c_to_the_last_bit(run, name):
    generator = random.Random(f"{name} {daily.DAY}")
    for arity in (1, 2):
        functions = functions_of(name, "Python", "double", arity)
        points = [given for f in functions for given in arguments(f, "double", 200, generator)]
        if points:
            here, there = (run(name, language, "double", arity)(*np.array(points).T) for language in ("Python", "C"))
            for f in functions:
                assert ((here[f] == there[f]) | np.isnan(here[f])).all(), f


# --- what is refused --------------------------------------------------------------------------------------------------


CHOSEN = [(name, target) for name in ("pade", "compact", "inverse") for target in written(name)]


@pytest.mark.parametrize("target", sorted(JSON))
@pytest.mark.parametrize("name", ["pade", "compact"])
def test_an_empty_list_is_refused_in_json(name, target):
    with pytest.raises(ValueError, match="no kernel is asked for: accepted is at least one"):
        kind(REQUESTS[name]).tables[target]([], "viscopade export")


@pytest.mark.parametrize(
    ("name", "target"), [(n, t) for n, t in CHOSEN if t in CODE or (n == "pade" and t not in JSON)]
)
def test_bad_lists_of_kernels_and_commands_are_refused(name, target):
    of, kernels = kind(REQUESTS[name]), REQUESTS[name].prove()
    render = of.tables.get(target) or target_of(target).renderers.get(of.id) or partial(of.compact, target_of(target))
    given = (REQUESTS[name].command(target), *["viscopade"] * (isinstance(render, partial)))
    with pytest.raises(ValueError, match="no kernel is asked for"):
        render([], *given)
    with pytest.raises(ValueError, match="is asked for twice"):
        render([*kernels, kernels[0]], *given)
    for command in HARD:
        hard = render(kernels, command, *given[1:])
        assert len(hard.split("\n")) == len(text(name, target).split("\n"))
        assert hard.isprintable() or hard.replace("\n", "").isprintable()
    assert render(kernels, *given) == text(name, target)
