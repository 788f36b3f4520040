"""What is installed: from an unpacked source distribution, with a C compiler and without one."""

import re
import shutil
import subprocess
import tomllib
from pathlib import Path

import pytest

import viscopade as vp
from tests.built import FILES, FOLDERS, ROOT, run_installed, wheel
from viscopade.generated import __version__
from viscopade.kernels import native, requests

PACKAGE = ROOT / "src" / "viscopade"


def shown(directory):
    """Return what the installed package says: its backend, a value, and where it is."""
    code = "import viscopade as vp; print(vp.backend(), vp.restitution(0.1, 1.307).hex(), vp.__file__)"
    backend, value, path = run_installed(directory, "-c", code).split()
    assert Path(path).is_relative_to(directory / "installed")
    assert value == native.numpy_restitution(0.1, 1.307).hex()
    return backend


def files_in(directory):
    return {
        path.relative_to(directory).as_posix()
        for path in directory.rglob("*")
        if path.is_file() and "__pycache__" not in path.parts and path.suffix not in (".so", ".pyd")
    }


def test_the_source_distribution_has_all_that_the_extension_needs(source):
    assert files_in(source / "src" / "viscopade") == files_in(PACKAGE)
    for name in FOLDERS[:-1]:
        assert files_in(source / name) == files_in(ROOT / name)
    assert all((source / name).is_file() for name in FILES)


def test_a_wheel_has_all_files_of_the_package_and_no_sources_in_c(source, tmp_path):
    """And the flags of its user do not change results."""
    extensions = wheel(source, tmp_path, CFLAGS="-Ofast -ffp-contract=fast")
    headers = {f"include/{file.name}" for kind in ("*.h", "*.cuh") for file in (ROOT / "exports").glob(kind)}
    kinds = ("*.toml", "*.csv", "in.*", "*.xml")
    examples = {f"examples/{file.name}" for kind in kinds for file in (ROOT / "examples").glob(kind)}
    cmake = {f"share/cmake/viscopade/{file.name}" for file in (ROOT / "cmake").glob("*.cmake")}
    shipped = {*headers, *examples, *cmake, "share/pkgconfig/viscopade.pc"}
    assert min(map(len, (headers, examples, cmake))) > 0
    assert files_in(tmp_path / "installed" / "viscopade") == files_in(PACKAGE) | shipped
    lab = files_in(ROOT / "src" / "viscopade_lab") - {"data/decks.csv"}  # which is for tests
    assert files_in(tmp_path / "installed" / "viscopade_lab") == lab
    if shutil.which("cc") is None:
        pytest.skip("no C compiler")
    assert len(extensions) == 1
    assert shown(tmp_path) == "compiled"
    assert run_installed(tmp_path, ROOT / "tools" / "installed.py").endswith("compiled: as it should be\n")
    code = """
import numpy as np
from viscopade.kernels import native
speed = 10 ** np.random.default_rng(1).uniform(-40, 40, 100_000)
assert np.array_equal(native.compiled_restitution()(speed, 1.2), native.numpy_restitution(speed, 1.2))
"""
    run_installed(tmp_path, "-c", code)


def test_without_a_compiler_numpy_computes(without_extension):
    assert shown(without_extension) == "numpy"


def test_a_header_that_does_not_compile_is_no_obstacle(source, tmp_path):
    broken = tmp_path / "broken"
    shutil.copytree(source, broken)
    (broken / "exports" / "viscopade_speed_full.h").write_text("#error\n")
    assert wheel(broken, tmp_path) == []
    assert shown(tmp_path) == "numpy"


def test_the_conda_recipe_asks_for_what_the_package_asks_for():
    whole = tomllib.loads((ROOT / "pyproject.toml").read_text("utf-8"))
    recipe = (ROOT / "conda" / "recipe.yaml").read_text("utf-8")
    assert re.search(r'^  version: "(.*)"$', recipe, re.MULTILINE)[1] == __version__
    run = re.search(r"^  run:\n((?:    - .*\n)+)", recipe, re.MULTILINE)[1].replace("    - ", "").splitlines()
    assert [line.replace(" ", "") for line in run] == ["python", *whole["project"]["dependencies"]]
    host = re.search(r"^  host:\n((?:    - .*\n)+)", recipe, re.MULTILINE)[1]
    assert all(name.partition(">")[0] in host for name in whole["build-system"]["requires"])


@pytest.mark.slow
def test_a_frozen_program_has_the_data_of_the_package(tmp_path):
    """The entry point names the folder of the hook; here it is given, whatever is installed."""
    freezer = pytest.importorskip("PyInstaller.__main__")
    program = tmp_path / "frozen.py"
    program.write_text(
        "import viscopade as vp\nfrom viscopade.kernels import requests\n"
        "print(vp.epsilon(1.5).hex(), vp.exact.collision('1.5', digits=20).decimals()['epsilon'], "
        "len(requests.file('viscopade.mjs')))\n"
    )
    folders = {f"--{name}path": tmp_path / name for name in ("dist", "work", "spec")}
    words = [word for flag, folder in folders.items() for word in (flag, str(folder))]
    freezer.run([*words, "--log-level", "ERROR", "--additional-hooks-dir", str(PACKAGE / "pyinstaller"), str(program)])
    done = subprocess.run([tmp_path / "dist/frozen/frozen"], capture_output=True, text=True, check=True)
    exact = vp.exact.collision("1.5", digits=20).decimals()["epsilon"]
    assert done.stdout.split() == [vp.epsilon(1.5).hex(), exact, str(len(requests.file("viscopade.mjs")))]
