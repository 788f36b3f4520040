"""Files around the functions: heads, names, versions, and what compilers say of the headers."""

import re
import shutil
import subprocess
from fractions import Fraction
from importlib.metadata import version
from itertools import product
from pathlib import Path

import numpy as np
import pytest

from tests import compiled, daily
from viscopade.generated import END_CONDITION, MARKER
from viscopade.kernels import catalogue, requests
from viscopade.kernels.catalogue import Request
from viscopade.kernels.requests import render
from viscopade.kernels.write import file
from viscopade.kernels.write.languages import NAMES, language

EXPORTS = Path(__file__).parents[2] / "exports"
HEADERS = {path.name: path.read_text() for path in sorted(EXPORTS.glob("*.h"))} | {
    "viscopade.cuh": (EXPORTS / "viscopade.cuh").read_text()
}
TIERS = ("1em5", "1em10", "full")
TABLES = ("viscopade_full.h", *(f"viscopade_speed_{tier}.h" for tier in TIERS))
OF_KERNELS = [name for name in HEADERS if name != "viscopade_version.h"]
WITHOUT_TABLES = [name for name in OF_KERNELS if name not in TABLES]
CODE = [name for name in requests.NAMES if name.startswith("viscopade") and name not in TABLES]
GROUPS = ("pade", "minimax", "compact", "inverse")


def kernels():
    return [entry.kernel for group in GROUPS for entry in catalogue.group(group)]


def checked(names, code, *words):
    """What a compiler says of headers with some code after them."""
    text = "".join(f'#include "{name}"\n' for name in names) + f"{code}\n"
    return subprocess.run([*words, "-fsyntax-only", "-I", EXPORTS, "-"], input=text, capture_output=True, text=True)


def errors_of(run):
    return [line for line in run.stderr.splitlines() if " error: " in line]


# --- what a file says -------------------------------------------------------------------------------------------------


def comments(text, mark):
    """Return the lines of a file before the first one that is no comment."""
    lines = text.splitlines()
    first = next(i for i, line in enumerate(lines) if not line.startswith((mark, "/*", " *")))
    return lines[:first]


@pytest.mark.parametrize("name", [name for name in CODE if name != "viscopade_version.h"])
def test_a_file_begins_with_what_a_user_needs(name):
    text = (EXPORTS / name).read_text()
    (target,) = re.findall(rf"^\W*{MARKER} {version('viscopade')}: viscopade export (\w+) --", text)
    written = language(target)
    lines = comments(text, written.comment)
    head = lines[: next((i for i, line in enumerate(lines) if "doi:" in line), len(lines)) + 2]
    words = " ".join(" ".join(line.lstrip(" *#!/") for line in head).split())
    assert len(head) <= file.HEAD
    assert text.isascii()
    assert text.endswith("\n")
    for part in (END_CONDITION, "SPDX-License-Identifier: MIT", "beta = 3/2 A (rho/m_eff)^(2/5)", file.PAGE, "Example"):
        assert part in words
    assert f"{version('viscopade')}" in words
    for kernel in kernels():
        if kernel.name in text and file.numbers_of(kernel, written):
            assert kernel.name in words
    if not name.endswith(".csv"):
        assert re.search(rf"(?i)version_?number\b.*\b{file.version_number()}\b", text)


def test_a_head_is_no_longer_for_many_kernels():
    """It has fewer rows, and says so."""
    many = 2 * kernels()
    for target in NAMES:
        of = language(target)
        lines = file.head([k for k in many if file.numbers_of(k, of)], of, "viscopade", of.stem)
        assert len(lines) <= file.HEAD - 2
        assert "(and others, see below)" in lines


# What a user may call: all that is not defined as private by its name (words of bits, parts of speed tables), or by the
# comment before it.
PRIVATE = re.compile(
    r"viscopade_((from_)?bits|scale|place|bases?|inside|elsewhere|one|block|many|columns|log2|divide|apply|pack|all|called"
    r"|beta_of_(all|pair|each))(_?[0-9]\w*|_full|f)*"
)
DEFINED = re.compile(r"^(?:VISCOPADE_\w+ )*(?:double|float|uint\d+_t|void) (viscopade_\w+)\(", re.MULTILINE)
OF_ARRAYS = re.compile(r"^(?:VISCOPADE_VECTORS )?VISCOPADE_ARRAYS\((viscopade_\w+),", re.MULTILINE)


@pytest.mark.parametrize("name", OF_KERNELS)
def test_the_head_of_a_header_lists_every_public_function(name):
    """A line each; functions of type float have the same line, and names that end in f."""
    head, code = HEADERS[name].split(" */\n", 1)
    private = set(
        re.findall(r"Private in this file.*?\n \*/\n(?:#define [^\n]*\n)?\w+ double (viscopade_\w+)", code, re.DOTALL)
    )
    functions = {f for f in (*DEFINED.findall(code), *OF_ARRAYS.findall(code)) if not PRIVATE.fullmatch(f)} - private
    listed = re.findall(r"^ \* (viscopade_\w+)\(.*\)  .*(?:\d|not proven)", head, re.MULTILINE)
    assert functions
    assert {f for f in functions if f not in listed and f.removesuffix("f") not in listed} == set()
    assert set(listed) <= functions
    assert len(listed) == len(set(listed))
    assert not private & set(listed)
    for pair in ("R_eff = R1 R2/(R1 + R2)", "E_eff = 1/(D1 + D2)", "(A1 D1 + A2 D2)/(D1 + D2)", "are private"):
        assert pair in " ".join(head.replace("\n *", " ").split())


def test_errors_are_rounded_up():
    """What is printed of a bound is no smaller, and its range is no wider."""
    for bound in (bound for kernel in kernels() for bound in kernel.bounds):
        parts = [(unit, Fraction(number)) for number, unit in file.error_parts(bound)]
        sizes = {name: sum(size for unit, size in parts if unit == name) for name in ("min", "r", "ulp")}
        assert sizes["r" if bound.relative_to == "value" else "min"] >= bound.formula
        assert sizes["min"] + sizes["r"] >= bound.relative + bound.last  # what min lacks, r has
        assert sizes["ulp"] >= bound.ulps
        text = file.range_text(bound).partition(",")[0]
        low, high = re.search(r"(\S+) <= v", text), re.search(r"v\* <= (\S+)", text)
        assert low is None or Fraction(low[1]) >= bound.low
        assert high is None or Fraction(high[1]) <= bound.high


def test_bounds_are_macros():
    """The macro is the error of the widest range."""
    text = "".join(HEADERS[name] for name in WITHOUT_TABLES)
    macros = dict(re.findall(r"^#define VISCOPADE_(\w+)_ERROR(?:F?) (\S+) /\*", text, re.MULTILINE))
    for kernel in kernels():
        for function in kernel.functions:
            widest = kernel.bound(function.name, "host", "double")[-1]
            assert Fraction(macros[f"{function.name}_{kernel.name}".upper()]) >= widest.formula


def test_a_name_is_the_accuracy_that_formula_and_rounding_meet():
    for kernel in kernels():
        if kernel.name.startswith("pade"):
            continue
        limit = Fraction(kernel.name.rpartition("_")[2].replace("m", "-"))
        total = min(b.formula + b.rounding + b.last for b in kernel.bound(kernel.functions[0].name, "host", "double"))
        assert limit / 10 < total <= limit


@pytest.mark.parametrize(
    ("asked", "name"),
    [
        (Request(minimax=((1, 4),), v_star_max="5"), "minimax_1_4_v5"),
        (Request(accuracy=("1e-5",), v_star_max="5"), "minimax_v5_1em5"),
        (Request(accuracy=("1e-3",), v_star_min="0.5", v_star_max="3"), "minimax_v0p5to3_1em3"),
        (Request(accuracy=("0.00035",)), "compact_3p5em4"),
    ],
)  # fmt: skip
def test_a_name_says_what_was_asked_for(asked, name):
    (kernel,) = asked.kernels()
    assert kernel.name == name


def test_requests_that_are_refused():
    with pytest.raises(ValueError, match="the kernel minimax_v5_1em3 is asked for twice: expected each kernel once"):
        render(Request(accuracy=("1e-3", "1e-3"), v_star_max="5"), "c")
    with pytest.raises(ValueError, match="target is 'cobol': expected c, "):
        render(Request(pade=((3, 6),)), "cobol")
    with pytest.raises(ValueError, match="compact_1em3 is no quotient of polynomials in v"):
        render(Request(accuracy=("1e-3",)), "csv")


def test_a_file_holds_kernels_of_every_kind():
    text = render(Request(pade=((3, 6),), accuracy=("1e-3",), inverse=("1e-3",)), "c")
    for name in ("epsilon_pade_3_6", "rebound_compact_1em3", "beta_inverse_1em3"):
        assert f"viscopade_{name}(" in text


def test_a_module_of_another_name_in_fortran():
    text = render(Request(pade=((3, 6),)), "fortran", "of_a_scene")
    assert "\nmodule of_a_scene\n" in text
    assert "module viscopade" not in text


# --- compilers --------------------------------------------------------------------------------------------------------


def of_one_name():
    """Return a header with another kernel of the name of the one for 1e-5."""
    text = render(Request(from_speed=("5e-6",)), "c")
    return text.replace("5em6", "1em5").replace("5EM6", "1EM5")


def test_two_kernels_of_one_name_are_refused(tmp_path):
    """The same header twice, and kernels of two headers, are fine."""
    (tmp_path / "other.h").write_text(of_one_name())
    (tmp_path / "pade.h").write_text(render(Request(pade=((3, 6),)), "c"))
    for others, refused in ((("other.h",), True), (("viscopade_speed_1em5.h", "viscopade_pade.h", "pade.h"), False)):
        text = "".join(f'#include "{name}"\n' for name in ("viscopade_speed_1em5.h", *others)) + "int unused;\n"
        words = [*compiled.compiler("c99"), "-fsyntax-only", "-I", EXPORTS, "-I", tmp_path, "-"]
        run = subprocess.run(words, input=text, capture_output=True, text=True)
        assert bool(run.returncode) == refused, run.stderr[:500]
        assert ("two headers have different kernels of one name" in run.stderr) == refused


def test_two_kernels_of_one_name_can_be_linked(tmp_path):
    """In C++17 functions of one name are merged: each translation unit keeps its own table all the same."""
    for name, text in (("fast", HEADERS["viscopade_speed_1em5.h"]), ("small", of_one_name())):
        (tmp_path / f"{name}.h").write_text(text)
        code = f'#include "{name}.h"\ndouble {name}(double v) {{ return viscopade_restitution_1em5(v, 1.307); }}\n'
        (tmp_path / f"{name}.cpp").write_text(code)
    (tmp_path / "main.cpp").write_text(
        "double fast(double), small(double);\nint main() { return fast(2.0) == small(2.0); }\n"
    )
    words = [*compiled.compiler("c++17"), "-O0", "fast.cpp", "small.cpp", "main.cpp", "-o", "main", "-lm"]
    subprocess.run(words, cwd=tmp_path, check=True)
    assert subprocess.run([tmp_path / "main"]).returncode == 0


MODULE = """module;
#include "{header}"
export module restitution;
export template <class T> T restitution(T speed) {{ return viscopade_restitution_{name}(speed, T(1.307)); }}
"""


@pytest.mark.parametrize(
    ("header", "name"),
    [
        *((f"viscopade_speed_{tier}.h", tier) for tier in TIERS),
        ("viscopade_pade.h", "pade_3_6"),
        ("viscopade.cuh", "compact_1em5"),
    ],
)
def test_a_module_exports_a_template_that_calls_a_kernel(tmp_path, header, name):
    clang = compiled.compiler("c++20", "clang")
    (tmp_path / "restitution.cppm").write_text(MODULE.format(header=header, name=name))
    main = "import restitution;\nint main() { const double e = restitution(2.0); return e > 0.0 && e < 1.0; }\n"
    (tmp_path / "main.cpp").write_text(main)
    program = [clang[0], "-std=c++20", "-I", EXPORTS, "-fmodule-file=restitution=restitution.pcm"]
    for words in (
        [*program[:4], "--precompile", "restitution.cppm", "-o", "restitution.pcm"],
        [*program, "restitution.pcm", "main.cpp", "-o", "main", "-lm"],
    ):
        ran = subprocess.run(words, cwd=tmp_path, capture_output=True, text=True)
        assert ran.returncode == 0, ran.stderr[:1000]
    assert subprocess.run([tmp_path / "main"]).returncode == 1


def test_headers_tell_their_version():
    major, minor, patch = map(int, version("viscopade").split(".")[:3])
    number = 10000 * major + 100 * minor + patch
    for text in HEADERS.values():
        assert re.findall(r'VISCOPADE_VERSION "(.*)"', text)[0] == version("viscopade")
        assert re.findall(r"VISCOPADE_VERSION_NUMBER (\d+)", text)[0] == str(number)
    code = f"#if VISCOPADE_VERSION_NUMBER != {number}\n#error other\n#endif"
    assert checked(["viscopade_version.h"], code, *compiled.compiler("c99")).returncode == 0


REFUSED = {
    "c89": "C99 or later",
    **{
        f"{standard} -fsingle-precision-constant": "viscopade: expected no -fsingle-precision-constant, which breaks"
        for standard in ("c99", "gnu99", "gnu++11", "c++17")
    },
    "gnu++98 -fsingle-precision-constant": "expected_no_fsingle_precision_constant",
    "c99 -U__SIZEOF_DOUBLE__ -D__SIZEOF_DOUBLE__=4": "a double of 64 bits",  # as avr-gcc has it
    "c++17 -U__SIZEOF_DOUBLE__ -D__SIZEOF_DOUBLE__=4": "a double of 64 bits",
}


@pytest.mark.parametrize("options", REFUSED)
@pytest.mark.parametrize("name", ["viscopade.cuh", daily.chosen(OF_KERNELS)])
def test_a_compiler_that_would_break_bounds_gets_one_line(name, options):
    """Every day another header: all begin with one prelude, but for that of devices."""
    standard, *flags = options.split()
    run = checked([name], "int unused;", *compiled.compiler(standard), *flags)
    if "unknown argument" in run.stderr:
        pytest.skip(f"the compiler does not know {flags}")
    assert run.returncode != 0
    (line,) = errors_of(run)
    assert REFUSED[options] in line


@pytest.mark.parametrize(
    "names", [*([name] for name in TABLES), [*TABLES[:2], WITHOUT_TABLES[0]]], ids=lambda names: ", ".join(names)
)
def test_an_old_standard_gets_one_line(names):
    """Also of several headers, the first of which is refused."""
    words = compiled.compiler("c++14")
    if "clang" in subprocess.run([words[0], "--version"], capture_output=True, text=True).stdout:
        pytest.skip("Clang reads hexadecimal constants in every standard")
    run = checked(names, "int unused;", *words)
    assert run.returncode != 0
    (line,) = errors_of(run)
    assert "C99, C++17, " in line


ALL = ("c99", "c2x", "c++98", "c++11", "c++14", "c++17", "c++20", "c++23")
OF_GCC = ("c99", "c2x", "gnu++11", "gnu++14", "c++17", "c++20", "c++23")  # without hexadecimal constants before C++17
TOGETHER = [
    *((WITHOUT_TABLES, standard, maker) for standard, maker in product(ALL, ("cc", "clang"))),
    *((TABLES, standard, "cc") for standard in OF_GCC),
    *((TABLES, standard, "clang") for standard in ALL if standard != "c++98"),  # no long long
]
ALONE = [([name], standard, "cc") for name, standard in product(OF_KERNELS, ("c99", "c++17"))]


@pytest.mark.parametrize(("names", "standard", "maker"), [*TOGETHER, *ALONE])
def test_headers_compile_without_warnings(names, standard, maker):
    """Each needs no other one."""
    # Not in the list for all tests, whose own code has declarations after statements.
    more = ("-Wold-style-cast", "-Wuseless-cast") if "++" in standard else ("-Wdeclaration-after-statement",)
    if maker == "clang":
        more = more[:1]  # which has no -Wuseless-cast
    strict = (*compiled.WARNINGS, "-Wfloat-equal", *more)
    run = checked(names, "int used(void);\nint used(void) { return 0; }", *compiled.compiler(standard, maker), *strict)
    assert run.returncode == 0, run.stderr[:1000]


@pytest.mark.parametrize("standard", compiled.STANDARDS)
def test_all_headers_in_one_program(tmp_path, standard):
    """Each twice, in one order and in the other; by every standard with the same bits."""
    headers = [HEADERS[name] for name in WITHOUT_TABLES]
    headers = headers[::-1] if "++" in standard else headers
    library = compiled.build(tmp_path, [*headers, *headers], standard, ["-O0"])
    first = compiled.build(tmp_path, headers[:2])
    for name, function in first.items():
        numbers = (0.5, 1.25, 0.0, 3.0)[: len(function.argtypes)]
        np.testing.assert_equal(library[name](*numbers), function(*numbers))


# --- Rust -------------------------------------------------------------------------------------------------------------

# In place of the crate num-traits with its feature libm, which this test does not have.
WITHOUT_STD = """//! A crate without the standard library.
#![no_std]
#![deny(warnings, missing_docs)]

/// What `num_traits::Float` has of functions.
pub trait Float: Copy {
FUNCTIONS
}
/// The functions.
pub mod viscopade { use crate::Float; include!("viscopade.rs"); }
"""


def test_the_file_for_rust_needs_no_std_and_every_public_item_has_a_comment(tmp_path):
    """As its head says: a trait gives what the type f64 has in std alone."""
    rustc = shutil.which("rustc")
    if rustc is None:
        pytest.skip("there is no rustc")
    text = (EXPORTS / "viscopade.rs").read_text()
    assert 'mod viscopade { use num_traits::Float; include!("viscopade.rs"); }' in text
    names = {"log2": "", "exp2": "", "sqrt": "", "cbrt": "", "powf": "_: Self"}
    lines = [f"    /// {n}\n    fn {n}(self{', ' * bool(given)}{given}) -> Self;" for n, given in names.items()]
    bodies = [line.partition("\n    ")[2].replace(";", " { self }") for line in lines]
    crate = WITHOUT_STD.replace("FUNCTIONS", "\n".join(lines))
    crate += "".join(f"impl Float for {kind} {{ {' '.join(bodies)} }}\n" for kind in ("f32", "f64"))
    (tmp_path / "viscopade.rs").write_text(text)
    (tmp_path / "crate.rs").write_text(crate)
    words = [rustc, "--edition", "2021", "--crate-type", "lib", "--crate-name", "without", "--emit", "metadata"]
    ran = subprocess.run([*words, "crate.rs"], cwd=tmp_path, capture_output=True, text=True)
    assert ran.returncode == 0, ran.stderr
