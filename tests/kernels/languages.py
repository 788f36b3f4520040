"""Runners of exported code: its functions called in each language, with bits in and bits out.

C and C++ become shared objects. Of the other languages, a program reads lines of arguments as hexadecimal bits and
writes the results of all functions. Where the tool of a language is missing, the test is skipped. GLSL and WGSL
run translated to C++, and Julia translated to Python, so that their numbers and expressions are checked everywhere.
Nothing here has run on a GPU.
"""

from __future__ import annotations

import ctypes
import math
import re
import shutil
import subprocess
import sys
from collections.abc import Callable, Iterable, Mapping, Sequence
from dataclasses import dataclass, replace
from functools import cache
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import NamedTuple

import numpy as np
import pytest

from tests import compiled
from viscopade.arithmetic.formats import DOUBLE, FLOAT
from viscopade.kernels.targets.languages import target as target_of
from viscopade.scene.runners import find_tool

FORMS = {"double": DOUBLE, "float": FLOAT}
TYPES = {"double": np.float64, "float": np.float32}
BITS = {"double": np.uint64, "float": np.uint32}
NAMES = ("x", "y")  # of arguments

Results = Mapping[str, np.ndarray]
Compute = Callable[..., Results]
"""From a column for each argument to a column for each function."""


@dataclass(frozen=True)
class Code:
    """A file's text, and its functions of one type with the same number of arguments, without prefix and suffix."""

    text: str
    functions: tuple[str, ...]
    form: str
    arity: int

    @property
    def kind(self) -> type[np.floating]:
        """The type of NumPy."""
        return TYPES[self.form]

    def calls(self, pattern: str, arguments: str = "{}") -> list[str]:
        """Return calls of all functions, whose names take the place of {} in the pattern."""
        given = ", ".join(map(arguments.format, NAMES[: self.arity]))
        return [f"{pattern.format(function)}({given})" for function in self.functions]

    def by_name(self, columns: np.ndarray) -> Results:
        """Return a table of results by function."""
        assert columns.shape[1] == len(self.functions)
        return {function: columns[:, i] for i, function in enumerate(self.functions)}

    def suffix(self, language: str, of_one: bool = False) -> str:
        """Return the end of functions' names; "" for two arguments where the language chooses by their type."""
        return "" if of_one and self.arity > 1 else target_of(language).number(self.form).suffix


def tool(name: str) -> str:
    """Return the command's path, or skip the test."""
    command = shutil.which(name)
    if command is None:
        pytest.skip(f"{name} is not installed")
    return command


def computed(command: Sequence[str], code: Code) -> Compute:
    """Return the functions of a program."""

    def compute(*columns: np.ndarray) -> Results:
        bits, digits = BITS[code.form], 2 * np.dtype(code.kind).itemsize
        rows = zip(*(code.kind(column).view(bits) for column in columns), strict=True)
        lines = "".join(" ".join(f"{word:0{digits}x}" for word in row) + "\n" for row in rows)
        ran = subprocess.run(command, input=lines, check=True, capture_output=True, text=True)
        words = np.array([int(word, 16) for word in ran.stdout.split()], dtype=bits)
        return code.by_name(words.view(code.kind).reshape(len(columns[0]), -1))

    return compute


def built(directory: Path, *command: str) -> None:
    """Run a compiler in a directory."""
    done = subprocess.run(command, cwd=directory, capture_output=True, text=True)
    assert not done.returncode, done.stdout + done.stderr


# --- C and C++ --------------------------------------------------------------------------------------------------------

_DEFINITION = re.compile(
    r"^(?:VISCOPADE_INLINE|VISCOPADE_FUNCTION) (double|float) viscopade_(\w+)\(\1 \w+(, \1 \w+)?\)$", re.MULTILINE
)


def functions_of_c(text: str) -> dict[str, tuple[str, int]]:
    """Return type and number of arguments of a header's functions by name."""
    return {name: (form, 2 if second else 1) for form, name, second in _DEFINITION.findall(text)}


def entries(functions: Iterable[tuple[str, str, int, str]]) -> str:
    """Return C text of functions of arrays for the linker, from names, types, numbers of arguments and calls."""
    lines = ["#ifdef __cplusplus", 'extern "C" {', "#endif"]
    for name, form, arity, call in functions:
        pointers = "".join(f"const {form} *all_{x}, " for x in NAMES[:arity])
        given = " ".join(f"const {form} {x} = all_{x}[i];" for x in NAMES[:arity])
        lines += [
            f"void call_{name}(int n, {pointers}{form} *out)",
            f"{{ int i; for (i = 0; i < n; i++) {{ {given} out[i] = {call}; }} }}",
        ]
    return "\n".join([*lines, "#ifdef __cplusplus", "}", "#endif", ""])


@cache
def library(headers: Sequence[str], source: str, command: Sequence[str]) -> ctypes.CDLL:
    """Return a shared object with headers, each a file, and a source text."""
    with TemporaryDirectory() as folder:
        directory, names = Path(folder), [f"header{i}.h" for i in range(len(headers))]
        for name, header in zip(names, headers, strict=True):
            (directory / name).write_text(header)
        (directory / "source.src").write_text("".join(f'#include "{name}"\n' for name in names) + source)
        built(directory, *command, "source.src", "-o", "source.so", "-lm")
        return ctypes.CDLL(str(directory / "source.so"))


def called(of: ctypes.CDLL, code: Code, suffix: str = "") -> Compute:
    """Return the functions of a shared object."""

    def compute(*columns: np.ndarray) -> Results:
        given = [np.ascontiguousarray(column, code.kind) for column in columns]
        found = {function: np.empty_like(given[0]) for function in code.functions}
        for function, out in found.items():
            entry = of[f"call_{function}{suffix}"]
            entry.restype = None
            entry(len(out), *(ctypes.c_void_p(array.ctypes.data) for array in (*given, out)))
        return found

    return compute


def c_command(standard: str, flags: Sequence[str] = ()) -> tuple[str, ...]:
    """Return the command that compiles shared objects, with warnings as errors."""
    own = ("-O2", "-ffp-contract=off", *flags, "-fPIC", "-shared")
    return (*compiled.compiler(standard), *compiled.WARNINGS, *own)


def c_library(headers: Sequence[str], command: Sequence[str]) -> ctypes.CDLL:
    """Return a shared object with all functions of headers."""
    functions = {name: found for header in headers for name, found in functions_of_c(header).items()}
    calls = ((name, *found, f"viscopade_{name}({', '.join(NAMES[: found[1]])})") for name, found in functions.items())
    return library(tuple(headers), entries(calls), tuple(command))


def of_c(_: Path, code: Code, standard: str = "c99") -> Compute:
    """Run a header for C; that of CUDA is one on the host."""
    return called(c_library([code.text], c_command(standard)), code, FORMS[code.form].suffix)


def of_cxx(directory: Path, code: Code) -> Compute:
    return of_c(directory, code, "c++98")


def of_nvcc(_: Path, code: Code) -> Compute:
    flags = ("-x", "cu", "-arch=sm_75", "-Werror", "all-warnings", "-shared", "-Xcompiler", "-fPIC")
    return called(c_library([code.text], [tool("nvcc"), *flags]), code, FORMS[code.form].suffix)


def of_calls(code: Code, calls: Sequence[str], standard: str, flags: Sequence[str]) -> Compute:
    """Run functions of C++ by the text of their calls."""
    made = [(function, code.form, code.arity, call) for function, call in zip(code.functions, calls, strict=True)]
    return called(library((code.text,), entries(made), c_command(standard, flags)), code)


# --- other compiled languages, and JavaScript -------------------------------------------------------------------------


def of_javascript(directory: Path, code: Code) -> Compute:
    (directory / "viscopade.mjs").write_text(code.text)
    (directory / "driver.mjs").write_text(
        f"""import * as m from "./viscopade.mjs";
import {{ readFileSync }} from "node:fs";
const view = new DataView(new ArrayBuffer(8));
const number = (h) => {{ view.setBigUint64(0, BigInt("0x" + h)); return view.getFloat64(0); }};
const bits = (x) => {{ view.setFloat64(0, x); return view.getBigUint64(0).toString(16); }};
const lines = readFileSync(0, "utf8").trim().split("\\n");
console.log(lines.map((line) => {{
    const [{", ".join(NAMES)}] = line.split(" ").map(number);
    return [{", ".join(code.calls("m.{}"))}].map(bits).join(" ");
}}).join("\\n"));
"""
    )
    return computed([tool("node"), str(directory / "driver.mjs")], code)


def of_fortran(directory: Path, code: Code) -> Compute:
    (directory / "viscopade.f90").write_text(code.text)
    kind, digits = ("real64", 16) if code.form == "double" else ("real32", 8)
    integer = kind.replace("real", "int")
    calls = code.calls("{}" + code.suffix("fortran", of_one=True))
    body = "\n".join(f"r({i + 1}) = {call}" for i, call in enumerate(calls))
    names, integers = NAMES[: code.arity], [f"i{name}" for name in NAMES[: code.arity]]
    moved = "\n".join(f"{name} = transfer(i{name}, {name})" for name in names)
    (directory / "driver.f90").write_text(
        f"""program driver
use, intrinsic :: iso_fortran_env
use viscopade
implicit none
integer({integer}) :: {", ".join(integers)}
real({kind}) :: {", ".join(names)}, r({len(calls)})
integer :: status, i
do
read (*, '(*(z{digits}, 1x))', iostat=status) {", ".join(integers)}
if (status /= 0) exit
{moved}
{body}
write (*, '(*(z{digits}, 1x))') (transfer(r(i), ix), i = 1, size(r))
end do
end program
"""
    )
    flags = ["-std=f2018", "-Wall", "-Wextra", "-Wpedantic", "-Wconversion", "-Werror", "-O2", "-ffp-contract=off"]
    built(directory, tool("gfortran"), *flags, "viscopade.f90", "driver.f90", "-o", "driver")
    return computed([str(directory / "driver")], code)


def of_rust(directory: Path, code: Code) -> Compute:
    (directory / "viscopade.rs").write_text(code.text)
    kind, integer = ("f64", "u64") if code.form == "double" else ("f32", "u32")
    arguments = ", ".join(f"{kind}::from_bits(bits({i}))" for i in range(code.arity))
    (directory / "main.rs").write_text(
        f"""#[allow(dead_code)]
mod viscopade;
fn main() {{
    for line in std::io::stdin().lines() {{
        let line = line.unwrap();
        let bits = |i: usize| {integer}::from_str_radix(line.split(' ').nth(i).unwrap(), 16).unwrap();
        let ({", ".join(NAMES[: code.arity])},) = ({arguments},);
        for r in [{", ".join(code.calls("viscopade::{}" + code.suffix("rust")))}] {{
            print!("{{:x}} ", r.to_bits());
        }}
        println!();
    }}
}}
"""
    )
    built(directory, tool("rustc"), "--edition", "2021", "-D", "warnings", "-O", "main.rs", "-o", "driver")
    return computed([str(directory / "driver")], code)


def of_julia(directory: Path, code: Code) -> Compute:
    (directory / "viscopade.jl").write_text(code.text)
    kind, integer = ("Float64", "UInt64") if code.form == "double" else ("Float32", "UInt32")
    names, calls = ", ".join(NAMES[: code.arity]), ", ".join(code.calls("Viscopade.{}"))
    (directory / "driver.jl").write_text(
        f"""include("viscopade.jl")
for line in eachline()
    {names}, = (reinterpret({kind}, parse({integer}, word, base = 16)) for word in split(line))
    println(join((string(reinterpret({integer}, r), base = 16) for r in ({calls},)), " "))
end
"""
    )
    return computed([tool("julia"), str(directory / "driver.jl")], code)


def of_julia_translated(_: Path, code: Code) -> Compute:
    """Run the functions of a Julia module, line by line as Python, with NumPy's numbers of one type."""
    number, kind = code.kind, "Float64" if code.form == "double" else "Float32"
    text = re.sub(r"\n {12,}", " ", re.sub(r"#.*", "", code.text))  # lines of one expression
    text = re.sub(r"(?<=\d)f(-?\d+)\b", r"e\1", text)
    text = text.replace(")^", ")**")
    text = re.sub(r"(return|y =) (w > \w+) \? (.*) : w", r"\1 \3 if \2 else w", text)
    text = re.sub(r"if !\((.*)\)", r"if not (\1):", text.replace("&&", "and"))
    text = re.sub(r"(\w+ = )(-?\d[\d.e+-]*)$", r"\1number(\2)", text, flags=re.M)
    blocks = re.findall(rf"function (\w+)\(([^)]*::{kind})\)\n(.*?)^end", text, re.M | re.S)
    lines = [
        f"def {name}({arguments.replace(f'::{kind}', '')}):\n{body.replace('    end', '')}"
        for name, arguments, body in blocks
    ]
    names = {"number": number, "NaN": math.nan, kind: number, "log2": np.log2, "exp2": np.exp2, "sqrt": np.sqrt}
    exec("\n".join(lines), names)

    def compute(*columns: np.ndarray) -> Results:
        rows = list(zip(*map(number, columns), strict=True))
        with np.errstate(all="ignore"):
            return code.by_name(np.array([[names[function](*row) for function in code.functions] for row in rows]))

    return compute


# --- Python and its packages ------------------------------------------------------------------------------------------

PYTHON = """
import sys
import numpy as np
words = [[int(word, 16) for word in line.split()] for line in sys.stdin]
{arguments}, = np.array(words, dtype="{bits}").view("{kind}").T.copy()
{body}
for row in np.stack(columns, 1).view("{bits}"):
    print(*(f"{{value:x}}" for value in row))
"""


def in_python(directory: Path, code: Code, language: str, body: str) -> Compute:
    """Run a program in Python with the target's package, or skip without it."""
    found = target_of(language)
    if find_tool(found.runner) is None:
        pytest.skip(f"the Python package {found.runner.package} is not installed")
    (directory / f"{found.stem}.py").write_text(code.text)
    driver = directory / "driver.py"
    words = {"kind": code.kind.__name__, "bits": BITS[code.form].__name__, "arguments": ", ".join(NAMES[: code.arity])}
    driver.write_text(PYTHON.format(**words, body=body))
    return computed([sys.executable, str(driver)], code)


def of_python(directory: Path, code: Code) -> Compute:
    """NaN stands for a refusal."""
    given = ", ".join(NAMES[: code.arity])
    functions = ", ".join(f"v.{function}" for function in code.functions)
    body = f"""import viscopade as v  # the file beside the program
def result(function, *given):
    try:
        return function(*given)
    except ValueError:
        return np.nan
columns = [np.array([result(f, *map(float, row)) for row in zip({given})]) for f in ({functions},)]
"""
    return in_python(directory, code, "python", body)


def of_jax(directory: Path, code: Code) -> Compute:
    given = ", ".join(NAMES[: code.arity])
    functions = ", ".join(f"v.{function}{code.suffix('jax', of_one=True)}" for function in code.functions)
    body = "\n".join(
        [
            "import jax",
            f"jax.config.update('jax_enable_x64', {code.form == 'double'})",
            "import viscopade_jax as v",
            f"columns = [jax.jit(f)({given}) for f in ({functions},)]",
        ]
    )
    return in_python(directory, code, "jax", body)


def of_numba(directory: Path, code: Code) -> Compute:
    """Called for numbers and, where there are functions of arrays, for arrays, with the same bits."""
    given = ", ".join(NAMES[: code.arity])
    numbers = ", ".join(f"v.{function}{code.suffix('numba')}" for function in code.functions)
    body = f"""import viscopade_numba as v
columns = [np.array([f(*row) for row in zip({given})], x.dtype) for f in ({numbers},)]
"""
    if code.arity == 2:
        body += f"""for f, column in zip(({numbers.replace("_compact", "_array_compact")},), columns):
    np.testing.assert_array_equal(f({given}), column, strict=True)
"""
    return in_python(directory, code, "numba", body)


def of_warp(directory: Path, code: Code) -> Compute:
    calls, kind = code.calls("v.{}", "{}[i]"), target_of("warp").number(code.form).type
    store = "\n".join(f"    out[i, {j}] = {call}" for j, call in enumerate(calls))
    arrays = ", ".join(f"{name}: wp.array(dtype={kind})" for name in NAMES[: code.arity])
    given = ", ".join(f"wp.array({name})" for name in NAMES[: code.arity])
    body = f"""import contextlib
import warp as wp
import viscopade_warp as v
wp.config.kernel_cache_dir = "{directory}"
@wp.kernel
def compute({arrays}, out: wp.array2d(dtype={kind})):
    i = wp.tid()
{store}
with contextlib.redirect_stdout(sys.stderr), wp.ScopedDevice("cpu"):
    out = wp.zeros((len(x), {len(calls)}), dtype={kind})
    wp.launch(compute, len(x), [{given}, out])
    columns = list(out.numpy().T)
"""
    return in_python(directory, code, "warp", body)


# --- shaders ----------------------------------------------------------------------------------------------------------

SHIMS = """
#include <math.h>
#define precise const
struct vec2 { float x, y; vec2(float a, float b) : x(a), y(b) {} };
static inline float min(float a, float b) { return b < a ? b : a; }
static inline float max(float a, float b) { return a < b ? b : a; }
static inline float clamp(float x, float a, float b) { return min(max(x, a), b); }
static inline float select(float a, float b, bool c) { return c ? b : a; }
"""
# Implicit conversions of constants are the language's own; all else is compiled with warnings as errors.
SHIM_FLAGS = ("-Wno-unused-function", "-Wno-conversion")


def translated(code: Code, text: str) -> Compute:
    """Run a shader's text that was translated to C++."""
    translated = replace(code, text=SHIMS + text)
    return of_calls(translated, code.calls("viscopade_{}"), "c++17", SHIM_FLAGS)


def of_glsl_translated(_: Path, code: Code) -> Compute:
    text = re.sub(r"\b(\d+\.\d*(?:e[+-]?\d+)?)(?![\w.])", r"\1f", re.sub(r"//.*", "", code.text))
    return translated(code, re.sub(r"^(float|vec2) ", r"static inline \1 ", text, flags=re.MULTILINE))


def of_wgsl_translated(_: Path, code: Code) -> Compute:
    text = re.sub(r"//.*", "", code.text).replace("vec2<f32>", "vec2")
    text = re.sub(r"^fn (\w+)\((.*)\) -> (\w+) {", r"static inline \3 \1(\2) {", text, flags=re.M)
    text = re.sub(r"(\w+): f32([,)])", r"f32 \1\2", text)
    text = re.sub(r"(?:let|const) (\w+)(?:: [fi]32)? =", r"const auto \1 =", text)
    text = re.sub(r"\b(\d+\.\d+)(?![\w.])", r"\1f", text)
    assert "fn " not in text
    assert "let " not in text
    return translated(code, f"typedef float f32;\n{text}")


def compile_glsl(directory: Path, code: Code) -> None:
    calls = code.calls("viscopade_{}", "{}[i]")
    body = "\n".join(f"    r[{len(calls)}u * i + {j}u] = {call};" for j, call in enumerate(calls))
    buffers = "\n".join(
        f"layout(std430, set = 0, binding = {i}) readonly buffer B{i} {{ float {name}[]; }};"
        for i, name in enumerate(NAMES[: code.arity])
    )
    (directory / "t.comp").write_text(
        f"""#version 450
{code.text}
layout(local_size_x = 1) in;
{buffers}
layout(std430, set = 0, binding = 2) buffer R {{ float r[]; }};
void main() {{
    uint i = gl_GlobalInvocationID.x;
{body}
}}
"""
    )
    built(directory, tool("glslangValidator"), "-V", "t.comp", "-o", "t.spv")


# --- all --------------------------------------------------------------------------------------------------------------


class Language(NamedTuple):
    """A way to run the files of a target."""

    target: str
    run: Callable[[Path, Code], Compute]

    @property
    def forms(self) -> tuple[str, ...]:
        """The names of its types."""
        return target_of(self.target).formats

    @property
    def is_shader(self) -> bool:
        """Whether its arithmetic is that of shaders."""
        return target_of(self.target).place == "shader"


LANGUAGES = {
    "C": Language("c", of_c),
    "Python": Language("python", of_python),
    "CUDA, host": Language("cuda", of_c),
    "CUDA, host, C++": Language("cuda", of_cxx),
    "CUDA, host, nvcc": Language("cuda", of_nvcc),
    "JavaScript": Language("javascript", of_javascript),
    "Fortran": Language("fortran", of_fortran),
    "Rust": Language("rust", of_rust),
    "Julia": Language("julia", of_julia),
    "Julia as Python": Language("julia", of_julia_translated),
    "JAX": Language("jax", of_jax),
    "Numba": Language("numba", of_numba),
    "Warp": Language("warp", of_warp),
    "GLSL as C++": Language("glsl", of_glsl_translated),
    "WGSL as C++": Language("wgsl", of_wgsl_translated),
}
COMPACT = {name: language for name, language in LANGUAGES.items() if target_of(language.target).compact}
