"""No test depends on the machine's speed: one profile of Hypothesis, and one time after which a process hangs."""

import ast
from pathlib import Path

import pytest

from tests.conftest import FIRST, QUICK

HERE = Path(__file__).parent
FILES = sorted(path for path in HERE.rglob("*.py") if path.name != "conftest.py")


def keywords(path):
    """Every keyword argument in a file, with its value."""
    for node in ast.walk(ast.parse(path.read_text(encoding="utf-8"))):
        if isinstance(node, ast.keyword):
            yield node.arg, node.value


def test_the_lists_of_quick_and_of_long_files_name_files():
    assert {name for name in QUICK | {*FIRST} if not (HERE / name).is_file()} == set()


@pytest.mark.parametrize("path", FILES, ids=lambda path: path.stem)
def test_a_file_has_neither_deadlines_nor_times_of_its_own(path):
    limits = {(name, ast.unparse(value)) for name, value in keywords(path) if name in ("deadline", "timeout")}
    assert limits <= {("deadline", "None"), ("timeout", "HANGS")}
