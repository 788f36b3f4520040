"""Every file of derivations/ runs, without a warning, to its end."""

import runpy
from pathlib import Path

import pytest

FILES = sorted((Path(__file__).parents[1] / "derivations").glob("[0-9]*.py"))


@pytest.mark.parametrize("file", FILES, ids=lambda file: file.stem)
def test_derivation(file, tmp_path, monkeypatch, capsys):
    """In this process, which has imported SymPy already; a warning is an error here (pyproject.toml)."""
    monkeypatch.chdir(tmp_path)
    runpy.run_path(str(file), run_name="__main__")
    out, err = capsys.readouterr()
    assert err == ""
    assert not list(tmp_path.iterdir())
    assert out.splitlines()[-1].startswith("derived: ")
