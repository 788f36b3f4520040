"""Every notebook runs with the installed package, without a warning, and shows what its committed copy shows.

Text is compared, images are not: numbers may differ by one unit in the last printed place, as the C library's rounding
does between machines; everything else has to be the same, but for the width of white space.
"""

from __future__ import annotations

import ast
import os
import re
import shutil
import sys
import tempfile
from collections.abc import Iterator
from decimal import Decimal
from functools import lru_cache
from itertools import groupby
from pathlib import Path

import nbformat
import numpy
import pytest
from jupyter_client import AsyncKernelManager
from nbclient import NotebookClient

from tests.patience import HANGS

FOLDER = Path(__file__).parents[1] / "notebooks"
NOTEBOOKS = sorted(FOLDER.glob("*.ipynb"))

NEEDS_COMPILER = "needs-c-compiler"
NO_COMPILER = "There is no C compiler on this machine"
ALLOWED = {"IPython", "matplotlib", "numpy", "sympy", "viscopade", "viscopade_lab"} | sys.stdlib_module_names
METADATA = {
    "kernelspec": {"display_name": "Python 3", "language": "python", "name": "python3"},
    "language_info": {"name": "python"},
}

NUMBER = re.compile(r"([-+]?\d+(?:\.\d+)?(?:e[-+]?\d+)?)")
PATH = re.compile(r"(?<![\w./])/(?:\w[\w.-]*/)+\w|\b[A-Z]:\\\w")
IMAGES = ("image/png",)

every_notebook = pytest.mark.parametrize("path", NOTEBOOKS, ids=lambda path: path.stem)


@lru_cache(maxsize=len(NOTEBOOKS))
def committed(path: Path):
    return nbformat.read(path, as_version=4)


@pytest.fixture(scope="module")
def executed():
    """Run copies of all notebooks, with new outputs; one kernel, whose names are taken away before each notebook."""
    reset = nbformat.v4.new_code_cell("%reset -f")
    notebooks = {path: nbformat.read(path, as_version=4) for path in NOTEBOOKS}
    whole = nbformat.v4.new_notebook(metadata=METADATA)
    for notebook in notebooks.values():
        whole.cells += [reset, *notebook.cells]
        for cell in notebook.cells:
            if cell.cell_type == "code":
                cell.outputs, cell.execution_count = [], None
    # A short name: the path of a Unix socket, which unlike a TCP port nobody else can reach, must be short.
    with tempfile.TemporaryDirectory(prefix="nb") as folder:
        here = Path(folder)
        for name in ("work", "ipython", "jupyter"):
            (here / name).mkdir()
        (here / "docs").symlink_to(FOLDER.parent / "docs")  # records that notebooks read
        kernel = AsyncKernelManager(
            kernel_name="python3",
            transport="ipc",
            ip=str(here / "kernel"),
            connection_file=str(here / "jupyter" / "kernel.json"),
        )
        own = {"IPYTHONDIR": str(here / "ipython"), "JUPYTER_RUNTIME_DIR": str(here / "jupyter")}
        resources = {"metadata": {"path": str(here / "work")}}
        client = NotebookClient(whole, km=kernel, timeout=HANGS, allow_errors=True, resources=resources)
        client.execute(env=os.environ | own, cleanup_kc=True)
    assert reset.outputs == []
    return notebooks


def outputs(notebook) -> Iterator[tuple[str, str, str]]:
    """Yield cell, kind and text of every output; images without their content."""
    for cell in notebook.cells:
        for stream, group in groupby(cell.get("outputs", []), key=lambda output: output.get("name", "")):
            if stream:  # what a cell prints may come in pieces
                yield cell.id, stream, "".join(output.text for output in group)
                continue
            for output in group:
                assert output.output_type in ("display_data", "execute_result"), f"{cell.id}: {output}"
                for kind, content in sorted(output.data.items()):
                    yield cell.id, kind, "" if kind in IMAGES else content


def place(number: str) -> Decimal:
    """Return one unit in the last printed place; 0 for a plain integer."""
    plain = number.lstrip("+-").isdigit()
    return Decimal(0) if plain else Decimal(1).scaleb(int(Decimal(number).as_tuple().exponent))


def same(shown: str, expected: str) -> bool:
    """Whether two texts agree, numbers to one unit in the last printed place."""
    ours, theirs = NUMBER.split(shown), NUMBER.split(expected)
    if len(ours) != len(theirs):
        return False
    words = all(a.split() == b.split() for a, b in zip(ours[::2], theirs[::2], strict=True))
    return words and all(
        a == b or abs(Decimal(a) - Decimal(b)) <= max(place(a), place(b))
        for a, b in zip(ours[1::2], theirs[1::2], strict=True)
    )


def needs_compiler(notebook) -> set[str]:
    return {cell.id for cell in notebook.cells if NEEDS_COMPILER in cell.metadata.get("tags", [])}


def code_of(path: Path) -> Iterator[ast.AST]:
    for cell in committed(path).cells:
        if cell.cell_type == "code":
            yield from ast.walk(ast.parse(cell.source))


@every_notebook
def test_runs_and_shows_what_is_committed(executed, path):
    notebook = executed[path]
    shown, expected = list(outputs(notebook)), list(outputs(committed(path)))
    assert [where for *where, _ in shown] == [where for *where, _ in expected]
    assert not [text for _, kind, text in shown if kind == "stderr"]
    if shutil.which(os.environ.get("CC", "cc")) is None:
        left_out = needs_compiler(notebook)
        assert all(NO_COMPILER in text for cell, _, text in shown if cell in left_out)
        expected = [(cell, kind, "" if cell in left_out else text) for cell, kind, text in expected]
        shown = [(cell, kind, "" if cell in left_out else text) for cell, kind, text in shown]
    for (cell, kind, text), (*_, committed_text) in zip(shown, expected, strict=True):
        assert same(text, committed_text), f"{cell} shows as {kind}:\n{text}\ncommitted is:\n{committed_text}"


def test_the_tour_does_without_a_c_compiler(monkeypatch, capsys):
    """The cell that compiles, and the one that needs what it compiled."""
    monkeypatch.setenv("CC", "no-such-compiler")
    tour = committed(FOLDER / "01_tour.ipynb")
    (cell,) = needs_compiler(tour)
    sources = [c.source for c in tour.cells if c.cell_type == "code" and c.id <= cell]
    names = {"np": numpy, "header": ""}
    for source in sources[-2:]:
        exec(source, names)
    assert capsys.readouterr().out.startswith(NO_COMPILER)


@every_notebook
def test_committed_with_outputs(path):
    shown = list(outputs(committed(path)))
    kinds = {kind for _, kind, _ in shown}
    assert {"image/png", "stdout", "text/markdown"} <= kinds
    assert "stderr" not in kinds
    assert not any(NO_COMPILER in text for *_, text in shown)
    counts = [cell.execution_count for cell in committed(path).cells if cell.cell_type == "code"]
    assert counts == list(range(1, len(counts) + 1))


@every_notebook
def test_metadata_say_nothing_about_the_machine(path):
    notebook = committed(path)
    assert notebook.metadata == METADATA
    for number, cell in enumerate(notebook.cells, 1):
        assert cell.id == f"cell-{number:02}"
        assert set(cell.metadata) <= {"tags"}
        assert not any(output.get("metadata") for output in cell.get("outputs", []))


@every_notebook
def test_no_absolute_paths(path):
    notebook = committed(path)
    texts = [cell.source for cell in notebook.cells] + [text for *_, text in outputs(notebook)]
    assert not [match.group() for text in texts for match in PATH.finditer(text)]


@every_notebook
def test_only_the_public_interface_is_used(path):
    for node in code_of(path):
        if isinstance(node, ast.Attribute):
            assert not node.attr.startswith("_"), node.attr
        if isinstance(node, ast.Import | ast.ImportFrom):
            module = [node.module] if isinstance(node, ast.ImportFrom) else []
            names = [part for name in [*module, *(a.name for a in node.names)] for part in name.split(".")]
            assert not [name for name in names if name.startswith("_")]
            top = module or [alias.name for alias in node.names]
            assert {name.split(".")[0] for name in top} <= ALLOWED


def test_the_comparison_allows_one_unit_and_no_more():
    assert same("eps = 0.1235, m  = 3", "eps = 0.1234, m = 3")
    assert same("1.0e-04", "1.1e-04")
    assert same("-1.5e-12 ", "-1.5e-12")
    assert not same("0.1236", "0.1234")
    assert not same("[3/6]", "[3/7]")
    assert not same("0.1234 a", "0.1234 b")
    assert not same("0.1234", "0.1234 0.1")
