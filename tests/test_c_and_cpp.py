"""docs/usage/c-and-cpp.md, done as it says: the headers in projects of C and C++, by CMake and by pkg-config."""

import os
import platform
import re
import shlex
import shutil
import subprocess
import sys
from fractions import Fraction
from pathlib import Path

import numpy as np
import pytest

import viscopade as vp
from tests import compiled
from tests.built import ROOT
from tests.patience import HANGS
from tests.test_readme import blocks
from viscopade.arithmetic.decimals import at_most
from viscopade.arithmetic.formats import DOUBLE, FLOAT
from viscopade.collision import panel_proof
from viscopade.kernels import catalogue

PAGE = (ROOT / "docs" / "usage" / "c-and-cpp.md").read_text("utf-8")
BLOCKS = blocks(PAGE)
MAIN_C, MATERIAL_C, HASH_C, NEEDS_VERSION = (code for kind, code in BLOCKS if kind == "c")
FIND, FETCH = (code for kind, code in BLOCKS if kind == "cmake")
PRINTED, OF_MATERIAL, HASH = (code for kind, code in BLOCKS if kind == "text")
FETCHING = re.sub(r"find_package.*\n", FETCH, FIND)
COPIED, OF_THE_PACKAGE, CMAKE_OF_THE_PACKAGE, CMAKE_INSTALLED, PKG_CONFIG = (code for kind, code in BLOCKS if not kind)
INSTALL = "".join(CMAKE_INSTALLED.splitlines(keepends=True)[:2])
BUILD = "cmake -B build {}\ncmake --build build\n./build/collisions\n"

EXACT = """
#include <cstdio>
#include <viscopade_speed_full.h>
int main() { std::printf("%.17g\\n", viscopade_restitution_full(0.1, 1.307)); }
"""

pytestmark = pytest.mark.skipif(os.name != "posix", reason="the page's commands are those of a Unix shell")


def needs(*programs):
    missing = [program for program in programs if shutil.which(program) is None]
    return pytest.mark.skipif(bool(missing), reason=f"there is no {', '.join(missing)}")


with_cmake = needs("cmake", "cc", "c++")


@pytest.fixture(scope="module")
def installed(without_extension):
    """A folder with the wheel, and a command `viscopade` that runs it from anywhere; headers need no extension."""
    folder = without_extension
    command = folder / "bin" / "viscopade"
    command.parent.mkdir()
    words = shlex.join([sys.executable, "-m", "viscopade"])
    command.write_text(f'#!/bin/sh\nPYTHONPATH={shlex.quote(str(folder / "installed"))} exec {words} "$@"\n')
    command.chmod(0o755)
    return folder


@pytest.fixture(scope="module")
def home(source, tmp_path_factory):
    """A home directory into whose .local `cmake --install` has put a checkout."""
    folder = tmp_path_factory.mktemp("home")
    (folder / "viscopade").symlink_to(source)
    run(INSTALL, folder, HOME=str(folder))
    return folder


def run(script, directory, **variables):
    """Run lines of a shell; return what the last of them prints."""
    ended = subprocess.run(
        ["sh", "-e"],
        input=script,
        cwd=directory,
        capture_output=True,
        text=True,
        env=os.environ | variables,
        timeout=HANGS,
    )
    assert ended.returncode == 0, ended.stdout + ended.stderr
    return (ended.stdout.splitlines(keepends=True) or [""])[-1]


def of_package(installed):
    return {"PATH": f"{installed / 'bin'}{os.pathsep}{os.environ['PATH']}"}


def project(directory, listed, **files):
    (directory / "CMakeLists.txt").write_text(listed)
    for name, text in files.items():
        (directory / name.replace("_", ".")).write_text(text)
    return directory


def test_folders_of_the_wheel(installed, tmp_path):
    def shown(words):
        return run(f"viscopade {words}", tmp_path, **of_package(installed)).strip()

    here = installed / "installed" / "viscopade"
    folders = {"--include-dir": "include", "--cmake-dir": "share/cmake/viscopade", "--examples-dir": "examples"}
    assert {option: shown(option) for option in folders} == {o: str(here / name) for o, name in folders.items()}
    assert shown("scene --example steel_balls --out . --no-check") == "wrote steel_balls_scene.h to ."


def test_what_the_page_prints_is_eps():
    assert f"eps = {vp.restitution(0.1, 1.307):.6f}\n" == PRINTED


@needs("cc")
@pytest.mark.parametrize("script", [COPIED, OF_THE_PACKAGE], ids=["copied", "package"])
def test_without_a_build_system(installed, tmp_path, script):
    project(tmp_path, "", main_c=MAIN_C)
    assert run(script, tmp_path, **of_package(installed)) == PRINTED


@needs("cc")
def test_from_a_material_to_beta(tmp_path):
    rubber = {"young_modulus": 1e7, "poisson_ratio": 0.45, "dissipative_constant": 1e-4}
    ice = {"young_modulus": 1e10, "poisson_ratio": 0.3, "dissipative_constant": 1e-6}
    pair = vp.Pair(vp.Sphere(radius=0.025, mass=0.060, **rubber), vp.Sphere.wall(**ice))
    assert f"beta = {pair.beta:.6f} (s/m)^(1/5), eps = {pair.epsilon(0.5):.6f}\n" == OF_MATERIAL
    project(tmp_path, "", material_c=MATERIAL_C)
    words = f"cc -std=c99 -Wall -Werror -I {shlex.quote(str(ROOT / 'exports'))} material.c -o material -lm\n./material"
    assert run(words, tmp_path) == OF_MATERIAL


def hash_of(tmp_path, words, run_by=""):
    """Return what the page's hash.c prints, compiled with these words, a compiler and its options."""
    compiler, *options = words.split()
    if shutil.which(compiler) is None or (run_by and shutil.which(run_by) is None):
        pytest.skip(f"there is no {compiler} {run_by}")
    if not compiled.works(compiler, "-xc++" if "++" in compiler else "-xc", *options):
        pytest.skip(f"{compiler} does not know {options}")
    # A processor without FMA cannot run the program; this machine may be another one than x86-64.
    flags = Path("/proc/cpuinfo")
    if "-mfma" in options and not (flags.exists() and " fma " in flags.read_text()):
        pytest.skip("this processor has no FMA, or does not tell")
    name = "hash.cpp" if "++" in compiler else "hash.c"
    (tmp_path / name).write_text(HASH_C)
    words = f"{words} -I {shlex.quote(str(ROOT / 'exports'))} {name} -o hash -lm\n{run_by} ./hash"
    printed = run(words, tmp_path)
    assert len(printed) == len(HASH)
    return printed


STAY = [
    "cc -O0 -ffp-contract=off",
    "cc -O2 -ffp-contract=off",
    "cc -O3 -ffp-contract=off -march=native",
    "c++ -O2 -ffp-contract=off",
    "g++ -std=c++17 -O2 -mfma -ffp-contract=off",
    "gcc -std=c99 -O2 -mfma",
    "gcc -std=c17 -O2 -mfma",
    *["cc -O2", "c++ -O2"] * (platform.machine() == "x86_64"),
]
CHANGE = ["gcc -O2 -mfma", "g++ -std=c++17 -O2 -mfma", "clang -std=c99 -O2 -mfma", "cc -O2 -ffast-math"]


@pytest.mark.parametrize("words", STAY)
def test_bits_stay(tmp_path, words):
    assert hash_of(tmp_path, words) == HASH


@pytest.mark.parametrize("words", CHANGE)
def test_bits_change(tmp_path, words):
    """By options of which the page says it; on a processor that has fused operations."""
    assert hash_of(tmp_path, words) != HASH


@pytest.mark.parametrize("processor", ["aarch64", "riscv64", "s390x"])
def test_bits_on_other_processors(tmp_path, processor):
    """GCC fuses there without a further option."""
    words, emulator = f"{processor}-linux-gnu-gcc -static -O2", f"qemu-{processor}"
    assert hash_of(tmp_path, words, emulator) != HASH
    assert hash_of(tmp_path, f"{words} -ffp-contract=off", emulator) == HASH


def test_errors_to_quote():
    """The page's table has the bounds with all their parts; an ulp is at most 2^-52 or 2^-23 of a number."""
    kernel = catalogue.kernel("speed 1e-5")
    rows = re.findall(r"^\| (`viscopade_\w+_1em5`.*) \| (\S+) \| (\S+) \|$", PAGE, re.MULTILINE)
    assert len(rows) == 2
    for names, *errors in rows:
        for name in re.findall(r"viscopade_(\w+)_1em5", names):
            for form, error in zip((DOUBLE, FLOAT), errors, strict=True):
                bound = kernel.bound(name, "host", form.name)[-1]
                whole = bound.relative + bound.last
                assert at_most(whole + bound.ulps * form.ulp(Fraction(1)) * (1 + whole), 3) == error


@needs("cc")
def test_one_minus_eps_in_float(tmp_path):
    """As the page says, d / (1 + eps) is within 1e-5; the difference is not, for nearly elastic collisions."""
    assert "`d / (1 + eps)`, with an error below 1e-5" in PAGE
    header = (ROOT / "exports" / "viscopade_speed_1em5.h").read_text("utf-8")
    library = compiled.build(tmp_path, [header])
    beta = np.float32(1.307)
    speeds = np.geomspace(1e-24, 1e6, 3001, dtype=np.float32)
    eps, d = (
        np.array([library[f"{name}_1em5f"](speed, beta) for speed in speeds], dtype=np.float32)
        for name in ("restitution", "dissipation")
    )
    exact = vp.one_minus_epsilon(np.sqrt(np.float64(beta)) * speeds.astype(np.float64) ** 0.1)
    assert np.max(np.abs(d / (1 + eps) / exact - 1)) < 1e-5
    assert np.max(np.abs((1 - eps) / exact - 1)) > 1e-3


def test_the_share_of_beta():
    """The numbers of the page: proven slope, 2e-6 of viscopade_betaf, and half an ulp of a float."""
    (slope,) = re.findall(r"at most (\S+) times as much", PAGE)
    # v* goes like the root of beta.
    assert 0 < Fraction(slope) - panel_proof.steepest() / 2 < Fraction(1, 100)
    share, rounded = map(Fraction, re.search(r"adds up to (\S+)\. .* it adds (\S+)\.", PAGE).groups())
    assert Fraction(slope) * Fraction("2e-6") <= share
    assert Fraction(slope) / 2**24 <= rounded


THREE_NUMBERS = ".".join(vp.__version__.split(".")[:3])  # all that CMake knows of a version


@needs("cmake", "cc", "pkg-config")
def test_pkg_config(home, installed, tmp_path):
    project(tmp_path, "", main_c=MAIN_C)
    assert run(PKG_CONFIG, tmp_path, HOME=str(home)) == PRINTED
    asked = "pkg-config --modversion viscopade"
    assert run(asked, tmp_path, PKG_CONFIG_PATH=f"{home}/.local/share/pkgconfig") == f"{THREE_NUMBERS}\n"
    share = 'export PKG_CONFIG_PATH="$(viscopade --include-dir)/../share/pkgconfig"\n'
    assert run(share + asked, tmp_path, **of_package(installed)) == f"{vp.__version__}\n"
    again = share + PKG_CONFIG.partition("\n")[2]
    assert run(again, tmp_path, **of_package(installed)) == PRINTED


@with_cmake
def test_find_package_in_the_python_package(installed, tmp_path):
    project(tmp_path, FIND, main_c=MAIN_C)
    assert run(CMAKE_OF_THE_PACKAGE, tmp_path, **of_package(installed)) == PRINTED


@with_cmake
def test_find_package_in_an_installation(source, tmp_path):
    project(tmp_path, FIND, main_c=MAIN_C)
    (tmp_path / "viscopade").symlink_to(source)
    assert run(CMAKE_INSTALLED, tmp_path, HOME=str(tmp_path / "home")) == PRINTED


@with_cmake
def test_fetch_content(source, tmp_path):
    project(tmp_path, FETCHING, main_c=MAIN_C)
    (tmp_path / "viscopade").symlink_to(source)
    assert run(BUILD.format(""), tmp_path) == PRINTED


@with_cmake
def test_a_project_in_cpp(installed, tmp_path):
    """One program is the page's; the other's eps is that of vp.restitution to the last place or two."""
    given = f"-D viscopade_DIR={shlex.quote(str(installed / 'installed/viscopade/share/cmake/viscopade'))}"
    listed = FIND.replace("LANGUAGES C)", "LANGUAGES CXX)").replace("main.c)", "main.cpp)")
    more = (
        listed.replace("add_exec", "set(CMAKE_CXX_STANDARD 17)\nadd_exec")
        + "add_executable(exact exact.cpp)\ntarget_link_libraries(exact PRIVATE viscopade::viscopade)\n"
    )
    project(tmp_path, more, main_cpp=MAIN_C, exact_cpp=EXACT)
    assert run(BUILD.format(given), tmp_path) == PRINTED
    assert float(run("./build/exact", tmp_path)) == pytest.approx(vp.restitution(0.1, 1.307), rel=4e-16, abs=0)


@needs("cmake")
@pytest.mark.parametrize("version", ["2.3.4", "2.3.4.dev0"])
def test_versions_that_are_asked_for(tmp_path, version):
    """Of a checkout that has version 2.3.4, or is on the way to it; no compiler is looked for."""
    known = re.search(r"(\d+)\.(\d+)", subprocess.run(["cmake", "--version"], capture_output=True, text=True).stdout)
    if tuple(map(int, known.groups())) < (3, 19):
        pytest.skip("CMake is older than 3.19: it has no ranges of versions")
    shutil.copytree(ROOT / "cmake", tmp_path / "cmake")
    (tmp_path / "exports").mkdir()
    header = (ROOT / "exports" / "viscopade_version.h").read_text("utf-8")
    (tmp_path / "exports" / "viscopade_version.h").write_text(header.replace(f'"{vp.__version__}"', f'"{version}"'))
    tried = {
        "": True,
        "2": True,
        "2.3.4 EXACT": True,
        "2.3 EXACT": False,
        "2.3.5": False,
        "1.9": False,
        "3": False,
        "2.0...<3": True,
        "2.0...2.3.4": True,
        "2.0...<2.3.4": False,
        "2.4...3": False,
        "1.0...3": False,
    }
    asked = "\n".join(
        f'set(viscopade_DIR "${{HERE}}")\nfind_package(viscopade {version} CONFIG QUIET)\n'
        f'message(STATUS "asked {version}: ${{viscopade_FOUND}}")\nunset(viscopade_DIR CACHE)'
        for version in tried
    )
    project(tmp_path, f"cmake_minimum_required(VERSION 3.19)\nproject(x LANGUAGES NONE)\n{asked}\n")
    words = ["cmake", "-B", "build", f"-DHERE={tmp_path / 'cmake'}"]
    ended = subprocess.run(words, cwd=tmp_path, capture_output=True, text=True, timeout=HANGS)
    assert ended.returncode == 0, ended.stderr
    assert dict(re.findall(r"asked (.*): (\d)", ended.stdout)) == {v: str(int(found)) for v, found in tried.items()}


@needs("cc")
def test_the_version_header(tmp_path):
    words = ["cc", "-x", "c", "-fsyntax-only", "-I", vp.get_include(), "-"]
    for program, fits in ((NEEDS_VERSION, True), (NEEDS_VERSION.replace("< 10000", "< 999999"), False)):
        ended = subprocess.run(words, input=program, capture_output=True, text=True, cwd=tmp_path)
        assert (ended.returncode == 0) is fits, ended.stderr
