"""A source distribution and wheels of this tree, made by the build backend as pip calls it."""

import os
import shutil
import subprocess
import sys
import tarfile
import zipfile
from pathlib import Path

import pytest

ROOT = Path(__file__).parents[1]
MADE = ("*.so", "*.pyd", "__pycache__", "*.egg-info", "build", "dist")
FOLDERS = ("cmake", "examples", "exports", "src")
FILES = (
    "CHANGELOG.md",
    "CMakeLists.txt",
    "LICENSE",
    "MANIFEST.in",
    "Makefile",
    "README.md",
    "constraints.txt",
    "pyproject.toml",
    "setup.py",
)


def build(directory, what, **environment):
    """Call the build backend, as pip does; return the file that it makes."""
    code = f"import setuptools.build_meta as backend; backend.build_{what}('made')"
    variables = os.environ | environment
    run = subprocess.run([sys.executable, "-c", code], cwd=directory, capture_output=True, text=True, env=variables)
    assert run.returncode == 0, run.stdout + run.stderr
    (made,) = (directory / "made").iterdir()
    return made


def unpacked_source(copy):
    """Unpack a source distribution, made of a copy in this directory that has nothing else in it."""
    pytest.importorskip("setuptools", "77")
    for name in FOLDERS:
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
    return [path.name for path in (directory / "installed" / "viscopade").glob("_native.*") if path.suffix != ".pyi"]


def run_installed(directory, *words):
    """Run a Python program with the unpacked wheel, in an empty folder; return what it prints."""
    variables = {k: v for k, v in os.environ.items() if k != "VISCOPADE_BACKEND"}
    variables["PYTHONPATH"] = str(directory / "installed")
    here = directory / "empty"
    here.mkdir(exist_ok=True)
    run = subprocess.run([sys.executable, *words], cwd=here, capture_output=True, text=True, env=variables)
    assert run.returncode == 0, run.stderr
    return run.stdout
