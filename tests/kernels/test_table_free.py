"""Compact kernels in other languages: bounds of rounding, and every text run where its toolchain is present."""

from __future__ import annotations

import ctypes
import ctypes.util
import importlib.util
import itertools
import math
import re
import subprocess
from dataclasses import replace
from fractions import Fraction
from functools import cache
from pathlib import Path

import numpy as np
import pytest

from tests.kernels import languages
from tests.kernels.languages import BITS, COMPACT, FORMS, TYPES, Code, tool
from viscopade.approximation.lacunary import Powers
from viscopade.arithmetic.balls import working
from viscopade.arithmetic.formats import DOUBLE, FLOAT
from viscopade.kernels import expressions, formulas, prove_lacunary, requests
from viscopade.kernels.forms import table_free
from viscopade.kernels.forms.table_free import DEVICE, FUNCTIONS, LARGEST, LIBRARY, SHADER
from viscopade.kernels.targets.languages import target as target_of
from viscopade.kernels.targets.table_free import name_of
from viscopade.kernels.targets.table_free import render as render_target

COMMAND = "viscopade export TARGET --accuracy 1e-3 --accuracy 1e-5 --accuracy 1e-7"
EXPORTS = Path(__file__).parents[2] / "exports"
BENCHMARK = Path(__file__).parents[2] / "src" / "viscopade_lab" / "gpu" / "bench.cu"


@cache
def kernels():
    return tuple(prove_lacunary.half_line_kernel(accuracy) for accuracy in ("1e-3", "1e-5", "1e-7"))


def render(target, *given):
    return render_target(target_of(target), *given)


@cache
def made(target):
    return render(target, kernels(), COMMAND.replace("TARGET", target))


def having(form):
    return [kernel for kernel in kernels() if any(v.form == FORMS[form] for v in kernel.variants)]


# --- programs and bounds ----------------------------------------------------------------------------------------------


def test_the_program_is_the_formula():
    y, speed = Fraction(3, 5), Fraction(7, 2)
    for kernel in kernels():
        variant = kernel.variants[0]
        parts = ((kernel.powers.top, variant.a), (kernel.powers.bottom, variant.b))
        n, d = (sum(Fraction(c) * y**k for k, c in zip(*part, strict=True)) for part in parts)
        eps = d / (d + y**6 * n)
        own = table_free.table_free_program(kernel.powers)
        given = {k: Fraction(c) for k, c in table_free.numbers(kernel.powers, variant.a, variant.b, DOUBLE).items()}
        exactly = expressions.Reading(Fraction)
        values = expressions.Run((*own.common, own.inverse), given | {"y": y, "speed": speed}, exactly)
        found = {name: expressions.evaluate(e, values, exactly) for name, e in own.results.items()}
        assert found == {"restitution": eps, "rebound": eps * speed, "dissipation": 1 - eps**2}


def test_w():
    given = {"beta": Fraction(3), "speed": Fraction(5, 2)}
    values = expressions.Run(formulas.w_program(), given, expressions.Reading(Fraction))
    assert values["w"] == 3**5 * Fraction(5, 2)


def test_powers_of_another_kind_are_refused():
    with pytest.raises(ValueError, match="deg N must be deg D"):
        table_free.table_free_program(Powers((0, 4), (0, 4)))


def emulated(kernel, machine, generator, w):
    """The program in type float, with functions whose results are moved by random errors within their bounds."""
    variant = kernel.variant(FLOAT)
    f32 = np.float32

    def moved(exact, ulps, absolute=0.0):
        steps = generator.uniform(-1, 1, len(w)) * np.asarray(ulps, dtype=float)
        near = np.abs(exact) <= 1
        error = np.where(near & (absolute > 0), generator.uniform(-absolute, absolute, len(w)), steps * spacing(exact))
        # A little less, as the result is rounded to a number of the type.
        return (exact + error * (1 - 2**-2)).astype(f32)

    def spacing(exact):
        return np.ldexp(1.0, np.frexp(exact)[1] - 24)

    functions = {
        "log2": lambda x: moved(np.log2(x.astype(float)), float(machine.log2), float(machine.log2_absolute)),
        "exp2": lambda x: moved(
            np.exp2(x.astype(float)), float(machine.exp2) + float(machine.exp2_slope) * np.abs(x.astype(float))
        ),
        "divide": lambda a, b: moved(np.divide(a, b, dtype=float), max(float(machine.quotient) - 0.5, 0)),
    }
    own = table_free.table_free_program(kernel.powers, table_free.called)
    given = {k: f32(c) for k, c in table_free.numbers(kernel.powers, variant.a, variant.b, FLOAT).items()}
    given |= {"w": w, "speed": np.ones(len(w), f32)}
    machine_numbers = expressions.Reading(f32, functions)
    values = expressions.Run((*own.common, own.inverse), given, machine_numbers)
    return {name: expressions.evaluate(e, values, machine_numbers) for name, e in own.results.items()}


def formula(kernel, form, w):
    """The formula with the coefficients of a type, in double precision, with few roundings."""
    variant = kernel.variant(form)
    y = np.longdouble(w) ** (np.longdouble(1) / 30)
    n, d = (
        sum(np.longdouble(c) * y**k for k, c in zip(exponents, numbers, strict=True))
        for exponents, numbers in ((kernel.powers.top, variant.a), (kernel.powers.bottom, variant.b))
    )
    eps, loss = d / (d + y**6 * n), y**6 * n / (d + y**6 * n)
    return {"restitution": eps, "rebound": eps, "dissipation": loss * (1 + eps)}


@pytest.mark.parametrize(
    "machine", [LIBRARY["float"], DEVICE, SHADER], ids=["library", "device", "shader"]
)  # fmt: skip
@pytest.mark.parametrize("which", [0, 1])
def test_bounds_hold_for_machines_as_bad_as_assumed(machine, which):
    kernel, generator = kernels()[which], np.random.default_rng(5)
    variant = kernel.variant(FLOAT)
    w = np.exp2(generator.uniform(-126, 120, 60_000)).astype(np.float32)
    common = (w >= 1e-30) & (w <= 1e10)
    found, true = emulated(kernel, machine, generator, w), formula(kernel, FLOAT, w)
    bounds = table_free.rounding_bounds(kernel.powers, variant.a, variant.b, machine)
    for function in FUNCTIONS:
        error = np.abs(found[function] / true[function] - 1)
        for bound, part in ((bounds[function].everywhere, error), (bounds[function].common, error[common])):
            assert 0.05 * float(bound) < part.max() <= float(bound)


@pytest.mark.parametrize("machine", [LIBRARY["double"], LIBRARY["float"], SHADER], ids=["double", "float", "shader"])
def test_bounds_for_all_arguments_are_nearly_the_largest_for_one(machine):
    kernel = kernels()[1]
    variant, form = kernel.variant(machine.type), machine.type
    given = kernel.powers, variant.a, variant.b, machine
    w = np.linspace(1 - form.largest, LARGEST[form.name], 150)
    with working(128):
        parts = [Fraction(2.0**e) for e in (*(w / 30), *np.log2(np.linspace(0.1, 10 ** (1 / 3), 20)))]
        alone = [(y**3, table_free._on_part(*given, y, y)) for y in parts]
    for function, bound in table_free.rounding_bounds(*given).items():
        everywhere = max(float(found[function]) for _, found in alone)
        common = max(float(found[function]) for v, found in alone if table_free.COMMON[0] <= v <= table_free.COMMON[1])
        assert 0.85 * float(bound.everywhere) < everywhere <= float(bound.everywhere)
        assert 0.85 * float(bound.common) < common <= float(bound.common)


def test_common_speeds_are_covered():
    low, high = table_free._COMMON_Y
    assert low**3 <= table_free.COMMON[0]
    assert table_free.COMMON[1] <= high**3 < table_free.COMMON[1] * Fraction(101, 100)
    for form in FORMS.values():
        for ends in (table_free._COMMON_Y, table_free._ends(form)):
            parts = list(table_free._parts(form, *ends))
            assert (parts[0][0], parts[-1][1]) == ends
            assert all(left[1] == right[0] for left, right in itertools.pairwise(parts))
        low, high = table_free._ends(form)
        assert low**30 <= Fraction(2) ** (1 - form.largest)
        assert high**30 >= Fraction(2) ** LARGEST[form.name]


BAD = {
    "log2": replace(LIBRARY["float"], log2=Fraction(3000)),
    "log2, absolute": replace(LIBRARY["float"], log2_absolute=Fraction(1, 100)),
    "exp2": replace(LIBRARY["float"], exp2=Fraction(1000)),
    "exp2, slope": replace(LIBRARY["float"], exp2_slope=Fraction(1000)),
    "quotient": replace(LIBRARY["float"], quotient=Fraction(1000)),
}


@pytest.mark.parametrize("machine", BAD.values(), ids=BAD)
def test_every_error_of_a_machine_counts(machine):
    """One that is far larger than all others: results come close to the bound, and not beyond it."""
    kernel, generator = kernels()[1], np.random.default_rng(6)
    variant = kernel.variant(FLOAT)
    ends = (-1, 1) if machine.log2_absolute else (-126, 120)
    w = np.exp2(generator.uniform(*ends, 20_000)).astype(np.float32)
    bound = table_free.rounding_bounds(kernel.powers, variant.a, variant.b, machine)
    found, true = emulated(kernel, machine, generator, w), formula(kernel, FLOAT, w)
    ratio = {f: np.abs(found[f] / true[f] - 1).max() / float(bound[f].everywhere) for f in FUNCTIONS}
    assert max(ratio.values()) <= 1
    assert ratio["restitution"] > (0.1 if machine.log2_absolute else 0.2)


def test_powers_that_overflow_are_refused(monkeypatch):
    kernel = kernels()[0]
    variant = kernel.variant(FLOAT)
    monkeypatch.setitem(LARGEST, "float", 150)
    with pytest.raises(ArithmeticError, match="may overflow in type float"):
        table_free.rounding_bounds.__wrapped__(kernel.powers, variant.a, variant.b, DEVICE)


def test_requests_that_are_refused():
    with pytest.raises(ValueError, match="target is 'cobol': accepted are c, python"):
        render("cobol", kernels(), COMMAND)
    with pytest.raises(ValueError, match="no type float for"):
        render("glsl", kernels()[2:], COMMAND)


def test_a_module_of_another_name_in_fortran():
    text = render("fortran", kernels(), COMMAND.replace("TARGET", "fortran"), "of_a_scene")
    renamed = ("\nmodule viscopade\n", "\nmodule of_a_scene\n"), ("use viscopade\n", "use of_a_scene\n")
    expected = made("fortran")
    for old, new in renamed:
        assert expected.count(old) == 1
        expected = expected.replace(old, new)
    assert text == expected


def test_relative_kernels_claim_nothing_of_the_loss():
    text = render("javascript", [prove_lacunary.half_line_kernel("1e-3", "relative")], COMMAND)
    assert "(1 - eps^2) <=" not in text
    assert "relative to of the formula's" not in text
    assert "relative to the formula's 1 - eps^2" in text.replace("\n//         ", " ")


# --- running the texts ------------------------------------------------------------------------------------------------

EACH = [(name, form) for name, language in COMPACT.items() for form in language.forms]


def of_kernel(kernel, function):
    return f"{function}_{name_of(kernel)}"


def code(target, form):
    """Return the file of a target with all functions for a form."""
    functions = tuple(of_kernel(*pair) for pair in itertools.product(having(form), FUNCTIONS))
    return Code(made(target), functions, form, 2)


@pytest.fixture(scope="module")
def runner(tmp_path_factory):
    """Return a function from the name of a language and a type to one from speeds and betas to results."""

    @cache
    def ready(name, form):
        language = COMPACT[name]
        return language.run(tmp_path_factory.mktemp("language"), code(language.target, form))

    return ready


@pytest.mark.parametrize(("name", "form"), EACH)
def test_beyond_the_largest_w_results_are_those_of_the_cut_off(runner, name, form):
    """The vectors state nothing of these speeds."""
    cut = 2.0 ** LARGEST[form]
    pairs = [(cut, 1.0), (cut * 2, 1.0), (math.inf, 1.0)]
    if not COMPACT[name].is_shader:
        pairs += [(float(np.finfo(TYPES[form]).max), 1e10), (1.0, math.inf), (math.inf, math.inf)]
    found = runner(name, form)(*np.array(pairs, dtype=TYPES[form]).T)
    for kernel in having(form):
        eps, loss = (found[of_kernel(kernel, function)] for function in ("restitution", "dissipation"))
        assert (eps == eps[0]).all()
        assert 0 < eps[0] < (1e-89 if form == "double" else 2e-12)
        assert (loss == 1).all()


@pytest.mark.parametrize("form", FORMS)
def test_eps_is_never_beyond_its_range(runner, form):
    """In C, for speeds of all sizes: in (0, 1], and 1 - eps^2 beyond 1 by two units at most."""
    bits = np.random.default_rng(9).integers(0, 2 ** (63 if form == "double" else 31), 20_000).astype(BITS[form])
    speed = bits.view(TYPES[form])
    speed = speed[speed >= 0]
    found = runner("CUDA, host", form)(speed, np.full(len(speed), 1.3))
    for kernel in having(form):
        eps, loss = (found[of_kernel(kernel, function)] for function in ("restitution", "dissipation"))
        assert ((eps > 0) & (eps <= 1)).all()
        assert ((loss >= 0) & (loss <= 1 + 2 * np.finfo(TYPES[form]).eps)).all()


# --- compilers only ---------------------------------------------------------------------------------------------------


LAUNCHES = """
#include "viscopade.cuh"
#define FOR(NAME, T, BETA) \\
    template cudaError_t viscopade_launch<viscopade_##NAME>(size_t, const T *, BETA<T>, T *, cudaStream_t);
FOR(compact_1em3::restitution, float, viscopade_beta_of_all)
FOR(compact_1em5::rebound, float, viscopade_beta_of_pair)
FOR(compact_1em5::dissipation, double, viscopade_beta_of_each)
FOR(compact_1em7::restitution, double, viscopade_beta_of_all)
FOR(compact_1em7::restitution, float, viscopade_beta_of_all)
"""


@pytest.mark.parametrize("architecture", ["sm_75", "sm_90"])
def test_device_code_compiles(tmp_path, architecture):
    (tmp_path / "viscopade.cuh").write_text(made("cuda"))
    (tmp_path / "launches.cu").write_text(LAUNCHES)
    command = [tool("nvcc"), f"-arch={architecture}", "-std=c++17", "-Werror", "all-warnings", "-O3", "-Xptxas", "-v"]
    ran = subprocess.run(
        [*command, "-cubin", "launches.cu", "-o", "launches.cubin"], cwd=tmp_path, capture_output=True, text=True
    )
    assert ran.returncode == 0, ran.stderr
    registers = [int(n) for n in re.findall(r"Used (\d+) registers", ran.stderr)]
    assert len(registers) == 5
    assert max(registers) <= 64  # so that 1024 threads fit on a multiprocessor
    assert "bytes spill" not in ran.stderr or set(re.findall(r"(\d+) bytes spill", ran.stderr)) == {"0"}


def test_the_header_compiles_at_run_time():
    """By NVRTC, as CuPy's RawModule does it: without headers, and for the device alone."""
    found = importlib.util.find_spec("nvidia")
    wheels = (
        [library for path in found.submodule_search_locations for library in Path(path).glob("**/libnvrtc.so*")]
        if found
        else []
    )
    library = next(iter(wheels), None) or ctypes.util.find_library("nvrtc")
    if library is None:
        pytest.skip("there is no NVRTC: the package nvidia-cuda-nvrtc-cu12 has it")
    compiler, program, size = ctypes.CDLL(str(library)), ctypes.c_void_p(), ctypes.c_size_t()
    names = [
        f"viscopade_apply<viscopade_{name_of(kernel)}::{function}, double, viscopade_beta_of_all<double>>"
        for kernel in kernels()
        for function in FUNCTIONS
    ]
    assert (
        compiler.nvrtcCreateProgram(ctypes.byref(program), made("cuda").encode(), b"viscopade.cu", 0, None, None) == 0
    )
    for name in names:
        assert compiler.nvrtcAddNameExpression(program, name.encode()) == 0
    failed = compiler.nvrtcCompileProgram(program, 1, (ctypes.c_char_p * 1)(b"--gpu-architecture=compute_75"))
    compiler.nvrtcGetProgramLogSize(program, ctypes.byref(size))
    said = ctypes.create_string_buffer(size.value)
    compiler.nvrtcGetProgramLog(program, said)
    assert not failed, said.value.decode()
    compiler.nvrtcGetPTXSize(program, ctypes.byref(size))
    code = ctypes.create_string_buffer(size.value)
    compiler.nvrtcGetPTX(program, code)
    assert code.value.count(b".entry") == len(names)


RUNTIME_OF_HIP = """
typedef __SIZE_TYPE__ size_t;
#define __host__ __attribute__((host))
#define __device__ __attribute__((device))
#define __global__ __attribute__((global))
enum hipError_t { hipSuccess };
typedef struct ihipStream_t *hipStream_t;
struct dim3 { unsigned x, y, z; dim3(unsigned a, unsigned b = 1, unsigned c = 1) : x(a), y(b), z(c) {} };
extern const __device__ dim3 threadIdx, blockIdx, blockDim, gridDim;
hipError_t hipGetLastError();
extern "C" unsigned __hipPushCallConfiguration(dim3 blocks, dim3 threads, size_t shared = 0, hipStream_t stream = 0);
extern "C" hipError_t hipLaunchKernel(const void *, dim3, dim3, void **, size_t, hipStream_t);
extern "C" __host__ __device__ double log2(double);
extern "C" __host__ __device__ double exp2(double);
extern "C" __host__ __device__ float log2f(float);
extern "C" __host__ __device__ float exp2f(float);
extern "C" __host__ __device__ double nan(const char *);
extern "C" __host__ __device__ float nanf(const char *);
"""


@pytest.mark.parametrize("half", ["host", "device"])
def test_the_header_compiles_for_hip(tmp_path, half):
    """By Clang, with what the header needs of HIP's runtime in place of it. It has not been run."""
    (tmp_path / "viscopade.cuh").write_text(made("cuda"))
    (tmp_path / "hip").mkdir()
    (tmp_path / "hip" / "hip_runtime.h").write_text(RUNTIME_OF_HIP)
    for name in ("math.h", "stddef.h"):
        (tmp_path / name).write_text("")
    (tmp_path / "launches.hip").write_text(LAUNCHES.replace("cuda", "hip"))
    command = [tool("clang++"), "-x", "hip", f"--cuda-{half}-only", "--offload-arch=gfx90a", "-nogpuinc", "-nogpulib"]
    flags = ["-std=c++17", "-Wall", "-Wextra", "-Werror", "-I.", "-emit-llvm", "-S", "-O2"]
    ran = subprocess.run(
        [*command, *flags, "launches.hip", "-o", "launches.ll"], cwd=tmp_path, capture_output=True, text=True
    )
    assert ran.returncode == 0, ran.stderr
    assert (tmp_path / "launches.ll").read_text().count("amdgpu_kernel void") == (5 if half == "device" else 0)


def test_the_gpu_benchmark_compiles(tmp_path):
    command = [
        tool("nvcc"),
        "-arch=sm_75",
        "-std=c++17",
        "-Werror",
        "all-warnings",
        "-I",
        str(EXPORTS),
        str(BENCHMARK),
    ]
    subprocess.run([*command, "-o", str(tmp_path / "bench")], check=True, capture_output=True)


def test_glsl_compiles(tmp_path):
    languages.compile_glsl(tmp_path, code("glsl", "float"))


def test_null_is_no_speed_of_0(tmp_path):
    """JavaScript's arithmetic takes null for 0."""
    (tmp_path / "compact.mjs").write_text(made("javascript"))
    (tmp_path / "quotients.mjs").write_text(requests.render("javascript"))
    calls = [f"c.{name}_compact_1em5({pair})" for name in FUNCTIONS for pair in ("null, 1", "1, null", "undefined, 1")]
    imports = 'import * as c from "./compact.mjs"; import * as q from "./quotients.mjs"; '
    (tmp_path / "main.mjs").write_text(f"{imports}console.log({', '.join(calls)}, q.epsilon_pade_3_6(null))")
    ran = subprocess.run([tool("node"), tmp_path / "main.mjs"], capture_output=True, text=True, check=True)
    assert set(ran.stdout.split()) == {"NaN"}
