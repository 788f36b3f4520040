"""`make lint` judges the files that git knows, and no scratch file beside them."""

import shutil
import subprocess
import sys
from pathlib import Path

import pytest

from tests.patience import HANGS

ROOT = Path(__file__).parents[1]
TOOLS = Path(sys.executable).parent
GOOD = '"""A module."""\n\nONE = 1\n'
SCRATCH = ("scratch.py", "src/scratch.py", "tools/scratch.py", "notebooks/scratch.ipynb")

pytestmark = pytest.mark.skipif(
    not all(map(shutil.which, ("git", "make", TOOLS / "ruff", TOOLS / "mypy"))), reason="there is no git, make or ruff"
)


@pytest.fixture
def tree(tmp_path):
    """A small tree with this one's Makefile and settings, and an environment that is ready."""
    for name in ("src", "tools", "checkers", "notebooks", "exports", ".venv/bin"):
        (tmp_path / name).mkdir(parents=True)
    for name in ("Makefile", "pyproject.toml", "constraints.txt", "setup.py", "MANIFEST.in"):
        shutil.copy(ROOT / name, tmp_path)
    for name in ("src/good.py", "tools/good_too.py", "tools/removed.py", "checkers/good_as_well.py"):
        (tmp_path / name).write_text(GOOD)
    (tmp_path / "exports" / "generated.py").write_text("x=1 # nobody formats what was generated\n")
    for tool in ("ruff", "mypy"):
        (tmp_path / ".venv" / "bin" / tool).symlink_to(TOOLS / tool)
    (tmp_path / ".venv" / ".ready").touch()
    (tmp_path / ".venv" / ".tools").touch()
    return tmp_path


def git(tree, *words):
    subprocess.run(["git", *words], cwd=tree, check=True, capture_output=True)


def lint(tree):
    """Return whether the files pass."""
    return subprocess.run(["make", "lint"], cwd=tree, capture_output=True, timeout=HANGS).returncode == 0


def spoil(tree):
    for name in SCRATCH:
        (tree / name).write_text("def f(x: return 1\n")


def test_scratch_files_are_not_judged_and_tracked_files_are(tree):
    git(tree, "init")
    git(tree, "add", "src", "tools", "checkers", "exports", "setup.py")
    spoil(tree)
    (tree / "tools" / "removed.py").unlink()  # and git is not told
    assert lint(tree)
    for name, bad in (
        ("src/good.py", GOOD + "import os\n"),  # ruff check
        ("tools/good_too.py", GOOD.replace(" = ", "=")),  # ruff format
        ("src/good.py", GOOD.replace("ONE", "ONE: str")),  # mypy
    ):
        (tree / name).write_text(bad)
        assert not lint(tree)
        (tree / name).write_text(GOOD)


def test_without_git_all_files_are_judged(tree):
    assert lint(tree)
    spoil(tree)
    assert not lint(tree)
