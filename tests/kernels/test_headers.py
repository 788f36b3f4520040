"""Names and version of the exported files: what users hold on to when a kernel is replaced by a better one."""

import re
import subprocess
from fractions import Fraction
from importlib.metadata import version
from pathlib import Path

import pytest

from tests import compiled
from tests.kernels.speed_headers import named_compiler
from viscopade.arithmetic.formats import DOUBLE
from viscopade.kernels import names, prove_lacunary, requests
from viscopade.kernels.forms.minimax import MinimaxKernel
from viscopade.kernels.prove_lacunary import speed_kernel
from viscopade.kernels.requests import Request

EXPORTS = Path(__file__).parents[2] / "exports"
HEADERS = {path.stem: path.read_text() for path in sorted(EXPORTS.glob("*.h"))}
TIERS = ("1em5", "1em10", "full")
TABLES = ("viscopade_full", *(f"viscopade_speed_{tier}" for tier in TIERS))
CODE = {name: requests.file(name) for name in requests.NAMES if not name.endswith((".h", ".json", ".csv", ".tex"))}
SHADERS = (".glsl", ".wgsl")  # of type float only, and without texts

every_header = pytest.mark.parametrize("name", HEADERS)


def checked(name, code, *words):
    """What a compiler says of a header with some code after it."""
    text = f'#include "{name}.h"\n{code}\n'
    return subprocess.run([*words, "-fsyntax-only", "-I", EXPORTS, "-"], input=text, capture_output=True, text=True)


def kernels():
    """Return all fitted kernels, and those with an own name in languages without tables."""
    return [
        *requests.RECOMMENDED.quotients(),
        *requests.WITHOUT_TABLES.half_line_kernels(),
        *requests.INVERSE.inverse_kernels(),
    ]


def test_a_name_is_the_accuracy_that_formula_and_rounding_meet():
    for kernel in kernels():
        limit = Fraction(kernel.name.rpartition("_")[2].replace("m", "-"))
        first = kernel.variants[0]
        total = first.total if isinstance(kernel, MinimaxKernel) else first.total(kernel.checked)
        assert limit / 10 < total <= limit == kernel.accuracy


@pytest.mark.parametrize(
    ("asked", "name"),
    [
        (Request(minimax=((1, 4),), v_star_max="5"), "minimax_1_4_v5"),
        (Request(accuracy=("3e-6",), v_star_max="5"), "minimax_v5_3em6"),
        (
            Request(accuracy=("1e-3",), v_star_min="0.5", v_star_max="3", measure="relative"),
            "minimax_v0p5to3_1em3_relative",
        ),
        (Request(accuracy=("0.00035",), measure="relative"), "halfline_3p5em4_relative"),
        (Request(inverse=("1e-3",), epsilon_min="0.3"), "inverse_e0p3_1em3"),
        (Request(from_speed=("1e-5",), size="small"), "1em5"),
    ],
)  # fmt: skip
def test_a_name_says_what_was_asked_for(asked, name):
    (kernel,) = asked.prove()
    assert kernel.name == name


def test_two_kernels_of_one_name_are_refused(tmp_path):
    """The small and the fast table for 1e-5; the same header twice, and kernels of two headers, are fine."""
    (tmp_path / "small.h").write_text(Request(from_speed=("1e-5",), size="small").render("c"))
    (tmp_path / "pade.h").write_text(Request(pade=((3, 6),)).render("c"))
    for others, refused in ((("small.h",), True), (("viscopade_speed_1em5.h", "viscopade_pade.h", "pade.h"), False)):
        text = "".join(f'#include "{name}"\n' for name in ("viscopade_speed_1em5.h", *others)) + "int unused;\n"
        words = [*compiled.compiler("c99"), "-fsyntax-only", "-I", EXPORTS, "-I", tmp_path, "-"]
        run = subprocess.run(words, input=text, capture_output=True, text=True)
        assert bool(run.returncode) == refused, run.stderr[:500]
        assert ("two headers have different kernels of one name" in run.stderr) == refused


def test_two_kernels_of_one_name_can_be_linked(tmp_path):
    """In C++17 functions of one name are merged: each translation unit keeps its own table all the same."""
    fast, small = tmp_path / "fast.h", tmp_path / "small.h"
    fast.write_text(HEADERS["viscopade_speed_1em5"])
    small.write_text(Request(from_speed=("1e-5",), size="small").render("c"))
    for name in ("fast", "small"):
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
    clang = named_compiler("clang", "c++20")
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


def test_a_kernel_that_is_asked_for_twice_is_refused():
    with pytest.raises(ValueError, match="the kernel minimax_v5_1em3 is asked for twice"):
        Request(accuracy=("1e-3", "1e-3"), v_star_max="5").render("c")


def test_bounds_are_macros():
    errors = {}
    for text in HEADERS.values():
        errors |= dict(re.findall(r"^#define VISCOPADE_(\w+)_ERROR (\S+) /\*", text, re.MULTILINE))
    fitted = {f"{'V_STAR' if k.kind == 'inverse' else 'EPSILON'}_{k.name}".upper(): k.bound.bound for k in kernels()}
    tables = {
        f"RESTITUTION_{tier.upper()}": speed_kernel(given).bound for tier, given in zip(TIERS, names.TIERS, strict=True)
    }
    fitted["EPSILON_HALFLINE_1EM5"] = prove_lacunary.half_line_kernel("1e-5").variant(DOUBLE).certificate.bound
    assert errors.items() <= (fitted | tables).items()
    assert len(errors) == 3 + 2 + 1 + len(TIERS)


@every_header
def test_a_header_tells_its_version(name):
    major, minor, patch = map(int, version("viscopade").split("."))
    number = 10000 * major + 100 * minor + patch
    assert re.findall(r'VISCOPADE_VERSION "(.*)"', HEADERS[name])[0] == version("viscopade")
    code = f"#if VISCOPADE_VERSION_NUMBER != {number}\n#error other\n#endif"
    assert checked(name, code, *compiled.compiler("c99")).returncode == 0


REFUSED = {
    "c89": "C99 or later is needed",
    "gnu99 -fsingle-precision-constant": "viscopade_needs_constants_of_type_double",
    "c99 -U__SIZEOF_DOUBLE__ -D__SIZEOF_DOUBLE__=4": "the bounds are for a double of 64 bits",  # as avr-gcc has it
    "c++17 -U__SIZEOF_DOUBLE__ -D__SIZEOF_DOUBLE__=4": "the bounds are for a double of 64 bits",
}


@pytest.mark.parametrize("options", REFUSED)
@pytest.mark.parametrize("name", [*(f"{name}.h" for name in HEADERS if name != "viscopade_version"), "viscopade.cuh"])
def test_a_compiler_that_would_break_bounds_gets_one_line(name, options):
    standard, *flags = options.split()
    words = [*compiled.compiler(standard), *flags, "-fsyntax-only", "-I", EXPORTS, "-"]
    run = subprocess.run(words, input=f'#include "{name}"\nint unused;\n', capture_output=True, text=True)
    if "unknown argument" in run.stderr:
        pytest.skip(f"the compiler does not know {flags}")
    assert run.returncode != 0
    (line,) = [line for line in run.stderr.splitlines() if " error: " in line]
    assert REFUSED[options] in line


@pytest.mark.parametrize("name", TABLES)
def test_an_old_standard_gets_one_line(name):
    words = compiled.compiler("c++14")
    if "clang" in subprocess.run([words[0], "--version"], capture_output=True, text=True).stdout:
        pytest.skip("Clang reads hexadecimal constants in every standard")
    run = checked(name, "int unused;", *words)
    assert run.returncode != 0
    (line,) = [line for line in run.stderr.splitlines() if " error: " in line]
    assert "accepted are C99, C++17, and the older C++ of GNU" in line


@pytest.mark.parametrize("name", TABLES)
@pytest.mark.parametrize("standard", ["c++98", "c++14", "c++17"])
def test_clang_reads_the_tables_by_every_standard_without_warnings(name, standard):
    run = checked(name, "int unused;", *named_compiler("clang", standard), "-Werror")
    assert run.returncode == 0, run.stderr[:500]


@pytest.mark.parametrize("name", TABLES)
@pytest.mark.parametrize("standard", ["c++17", "gnu++11", "gnu++14"])
def test_other_standards_read_the_tables(name, standard):
    run = checked(name, "int unused;", *compiled.compiler(standard), "-Werror")
    assert run.returncode == 0, run.stderr[:500]


@pytest.mark.parametrize("name", CODE)
def test_every_language_has_the_version(name):
    number = "".join(f"{int(part):02}" for part in version("viscopade").split(".")).lstrip("0")
    assert re.search(rf"viscopade_version_number\b.*\b{number}\b", CODE[name], re.IGNORECASE)
    if not name.endswith(SHADERS):
        assert re.search(rf'viscopade_version\b.*"{version("viscopade")}"', CODE[name], re.IGNORECASE)
