"""What is installed: from an unpacked source distribution, with a C compiler and without one."""

import os
import shutil
import subprocess
import sys
import tarfile
import zipfile
from pathlib import Path

import pytest

from viscopade.arrays import native

ROOT = Path(__file__).parents[1]
PACKAGE = ROOT / "src" / "viscopade"
MADE = ("*.so", "*.pyd", "__pycache__", "*.egg-info", "build", "dist")
FILES = (
    "CHANGELOG.md",
    "LICENSE",
    "MANIFEST.in",
    "Makefile",
    "README.md",
    "constraints.txt",
    "pyproject.toml",
    "setup.py",
)

pytest.importorskip("setuptools", "77")


def build(directory, what, **environment):
    """Call the build backend, as pip does; return the file that it makes."""
    code = f"import setuptools.build_meta as backend; backend.build_{what}('made')"
    variables = os.environ | environment
    run = subprocess.run([sys.executable, "-c", code], cwd=directory, capture_output=True, text=True, env=variables)
    assert run.returncode == 0, run.stdout + run.stderr
    (made,) = (directory / "made").iterdir()
    return made


@pytest.fixture(scope="module")
def source(tmp_path_factory):
    """Unpack a source distribution, made of a copy that has nothing else in it."""
    copy = tmp_path_factory.mktemp("copy")
    for name in ("src", "exports"):
        shutil.copytree(ROOT / name, copy / name, ignore=shutil.ignore_patterns(*MADE))
    for name in FILES:
        shutil.copy(ROOT / name, copy)
    with tarfile.open(build(copy, "sdist")) as archive:
        archive.extractall(copy / "unpacked", **({"filter": "data"} if hasattr(tarfile, "data_filter") else {}))
    (directory,) = (copy / "unpacked").iterdir()
    return directory


def wheel(source, directory, **environment):
    """Build a wheel, and unpack it where it can be imported from; return the names of the extensions in it."""
    shutil.copytree(source, directory / "source")
    made = build(directory / "source", "wheel", **environment)
    with zipfile.ZipFile(made) as archive:
        archive.extractall(directory / "installed")
    return [
        path.name
        for path in (directory / "installed" / "viscopade" / "arrays").glob("_native.*")
        if path.suffix != ".pyi"
    ]


def shown(directory):
    """Return what the installed package says: its backend, a value, and where it is."""
    code = "import viscopade as vp; print(vp.backend(), vp.restitution(0.1, 1.307).hex(), vp.__file__)"
    variables = {k: v for k, v in os.environ.items() if k != native.VARIABLE}
    variables["PYTHONPATH"] = str(directory / "installed")
    run = subprocess.run([sys.executable, "-c", code], cwd=directory, capture_output=True, text=True, env=variables)
    assert run.returncode == 0, run.stderr
    backend, value, path = run.stdout.split()
    assert Path(path).is_relative_to(directory / "installed")
    assert value == native.numpy_restitution()(0.1, 1.307).hex()
    return backend


def files_in(directory):
    return {
        path.relative_to(directory).as_posix()
        for path in directory.rglob("*")
        if path.is_file() and "__pycache__" not in path.parts and path.suffix not in (".so", ".pyd")
    }


def test_the_source_distribution_has_all_that_the_extension_needs(source):
    assert files_in(source / "src" / "viscopade") == files_in(PACKAGE)
    assert files_in(source / "exports") == files_in(ROOT / "exports")
    assert all((source / name).is_file() for name in FILES)


def test_a_wheel_has_all_files_of_the_package_and_no_sources_in_c(source, tmp_path):
    extensions = wheel(source, tmp_path)
    assert files_in(tmp_path / "installed" / "viscopade") == files_in(PACKAGE) - {"arrays/_native.c"}
    assert files_in(tmp_path / "installed" / "viscopade_lab") == files_in(ROOT / "src" / "viscopade_lab")
    if shutil.which("cc") is None:
        pytest.skip("no C compiler")
    assert len(extensions) == 1
    assert shown(tmp_path) == "compiled"


@pytest.mark.parametrize("compiler", ["false", "no-such-compiler"])
def test_without_a_compiler_numpy_computes(source, tmp_path, compiler):
    assert wheel(source, tmp_path, CC=compiler) == []
    assert shown(tmp_path) == "numpy"


def test_a_header_that_does_not_compile_is_no_obstacle(source, tmp_path):
    broken = tmp_path / "broken"
    shutil.copytree(source, broken)
    (broken / "exports" / "viscopade_speed_full.h").write_text("#error\n")
    assert wheel(broken, tmp_path) == []
    assert shown(tmp_path) == "numpy"


def test_the_users_flags_do_not_change_results(source, tmp_path):
    if shutil.which("cc") is None:
        pytest.skip("no C compiler")
    wheel(source, tmp_path, CFLAGS="-Ofast -ffp-contract=fast")
    assert shown(tmp_path) == "compiled"
    code = """
import numpy as np
from viscopade.arrays import native
speed = 10 ** np.random.default_rng(1).uniform(-40, 40, 100_000)
assert np.array_equal(native.compiled_restitution()(speed, 1.2), native.numpy_restitution()(speed, 1.2))
"""
    variables = os.environ | {"PYTHONPATH": str(tmp_path / "installed")}
    run = subprocess.run([sys.executable, "-c", code], cwd=tmp_path, capture_output=True, text=True, env=variables)
    assert run.returncode == 0, run.stderr
