"""Every file of derivations/ runs, without a warning, to its end."""

import os
import subprocess
import sys
from pathlib import Path

import pytest

from tests.patience import HANGS

FILES = sorted((Path(__file__).parents[1] / "derivations").glob("[0-9]*.py"))


def test_the_derivations_are_numbered_without_a_gap():
    assert [file.name[:3] for file in FILES] == [f"{n:02}_" for n in range(1, len(FILES) + 1)]
    assert len(FILES) >= 8


@pytest.mark.parametrize("file", FILES, ids=lambda file: file.stem)
def test_derivation(file, tmp_path):
    run = subprocess.run(
        [sys.executable, "-W", "error", str(file)],
        cwd=tmp_path,
        env=os.environ | {"PYTHONUTF8": "1"},
        capture_output=True,
        encoding="utf-8",
        timeout=HANGS,
    )
    assert run.returncode == 0, run.stderr
    assert run.stderr == ""
    assert not list(tmp_path.iterdir())
    assert run.stdout.splitlines()[-1].startswith("derived: ")
