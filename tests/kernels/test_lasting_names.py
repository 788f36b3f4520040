"""Names and version of the exported files: what users hold on to when a kernel is replaced by a better one."""

import re
import subprocess
from fractions import Fraction
from functools import cache
from importlib.metadata import version
from pathlib import Path

import pytest
from hypothesis import given
from hypothesis import strategies as st

import viscopade as vp
from tests import compiled
from tests.kernels.speed_headers import named_compiler
from viscopade.arithmetic.decimals import power_of_ten
from viscopade.kernels import requests

EXPORTS = Path(__file__).parents[2] / "exports"
HEADERS = {path.stem: path.read_text() for path in sorted(EXPORTS.glob("*.h"))}
TIERS = ("1em5", "1em10", "full")
TABLES = ("viscopade_full", *(f"viscopade_speed_{tier}" for tier in TIERS))
LASTING = re.compile(r"^#define (viscopade_\w+) (viscopade_\w+)$", re.MULTILINE)

CODE = {name: requests.file(name) for name in requests.NAMES if not name.endswith((".h", ".json", ".csv", ".tex"))}
COMPACT = ["compact_1em3", "compact_1em5", "compact_1em7"]
OF_V_STAR = {
    "viscopade_inverse.py": ["inverse_1em3", "inverse_1em5"],
    "viscopade_minimax.py": ["minimax_v5_1em3", "minimax_v5_1em5", "minimax_v5_1em8"],
    "viscopade_pade.py": [],
}
SHADERS = (".glsl", ".wgsl")  # of type float only, and without texts

every_header = pytest.mark.parametrize("name", HEADERS)


@cache
def lasting(name):
    return LASTING.findall(HEADERS[name])


def checked(name, code, *words):
    """What a compiler says of a header with some code after it."""
    text = f'#include "{name}.h"\n{code}\n'
    return subprocess.run([*words, "-fsyntax-only", "-I", EXPORTS, "-"], input=text, capture_output=True, text=True)


@every_header
@pytest.mark.parametrize("standard", ["c99", "c++17"])
def test_every_lasting_name_is_a_function_of_the_header(name, standard):
    checks = "".join(f"    if ({one} != {other}) return 1;\n" for one, other in lasting(name))
    code = f"int check(void);\nint check(void)\n{{\n{checks}    return 0;\n}}"
    run = checked(name, code, *compiled.compiler(standard), *compiled.WARNINGS)
    assert run.returncode == 0, run.stderr[:500]
    assert bool(lasting(name)) == (name not in ("viscopade_pade", "viscopade_full", "viscopade_version"))


def test_headers_do_not_share_a_lasting_name():
    names = [one for name in HEADERS for one, _ in lasting(name)]
    assert len(names) == len(set(names)) > 70


@pytest.mark.parametrize("tier", TIERS[:-1])
def test_a_tier_of_speed_says_how_accurate_it_is(tmp_path, tier):
    wrapper = (
        f"static inline double viscopade_lasting(double speed, double beta)\n"
        f"{{ return viscopade_restitution_{tier}(speed, beta); }}\n"
    )
    function = compiled.build(tmp_path, [HEADERS[f"viscopade_speed_{tier}"] + wrapper])["lasting"]
    for speed in (1e-9, 0.01, 2.0, 300.0, 1e6):
        true = vp.restitution(speed, 1.307)
        assert abs(function(speed, 1.307) - true) <= float(tier.replace("m", "-")) * min(true, 1 - true)


@pytest.mark.parametrize("made", [requests.RECOMMENDED.quotients, requests.INVERSE.inverse_kernels])
def test_the_power_of_ten_bounds_what_is_proven(made):
    for kernel in made():
        limit = Fraction(kernel.lasting_name.rpartition("_")[2].replace("m", "-"))
        bound = Fraction(kernel.variants[0].certificate.bound)
        assert limit / 10 < bound < limit
        assert kernel.lasting_name.startswith(kernel.name.partition("_")[0])


@given(st.fractions(min_value=Fraction(1, 10**20), max_value=10**3))
def test_power_of_ten(number):
    limit = Fraction(power_of_ten(number).replace("m", "-"))
    assert limit / 10 < number <= limit


def test_powers_of_ten_are_their_own():
    for exponent in range(-18, 3):
        assert power_of_ten(Fraction(10) ** exponent) == f"1e{exponent}".replace("-", "m")


@every_header
def test_a_header_tells_its_version(name):
    major, minor, patch = map(int, version("viscopade").split("."))
    number = 10000 * major + 100 * minor + patch
    assert re.findall(r'VISCOPADE_VERSION "(.*)"', HEADERS[name])[0] == version("viscopade")
    code = f"#if VISCOPADE_VERSION_NUMBER != {number}\n#error other\n#endif"
    assert checked(name, code, *compiled.compiler("c99")).returncode == 0


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
def test_every_language_has_names_that_last_and_the_version(name):
    text = CODE[name]
    expected = OF_V_STAR.get(name, COMPACT[: 2 if name.endswith(SHADERS) else 3])
    stated = re.search(r"NAME may also be (.*?): a name that stays", re.sub(r"\n *(?:\*|#|//|!) *", " ", text))
    found = re.findall(r"(\w+) \(now (\w+)\)", stated.group(1)) if stated else []
    assert [lasting for lasting, _ in found] == expected
    code = re.sub(r"^ *(?:\*|# |//|! ).*", "", text, flags=re.MULTILINE)
    for lasting, today in found:
        names = [set(re.findall(rf"\b(\w*){one}(\w*)\b", code)) for one in (lasting, today)]
        assert names[0]
        assert names[0] <= names[1]
    number = "".join(f"{int(part):02}" for part in version("viscopade").split(".")).lstrip("0")
    assert re.search(rf"viscopade_version_number\b.*\b{number}\b", text, re.IGNORECASE)
    if not name.endswith(SHADERS):
        assert re.search(rf'viscopade_version\b.*"{version("viscopade")}"', text, re.IGNORECASE)
