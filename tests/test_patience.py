"""No test depends on the machine's speed: one profile of Hypothesis, and one time after which a process hangs."""

import ast
import time
from pathlib import Path

import pytest
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st

from tests.conftest import FIRST, QUICK

HERE = Path(__file__).parent
FILES = sorted(path for path in HERE.rglob("*.py") if path.name != "conftest.py")


def keywords(path):
    """Every keyword argument in a file, with its value."""
    for node in ast.walk(ast.parse(path.read_text(encoding="utf-8"))):
        if isinstance(node, ast.keyword):
            yield node.arg, node.value


def test_the_profile_is_in_force():
    assert settings.default.deadline is None
    assert HealthCheck.too_slow in settings.default.suppress_health_check


def test_the_lists_of_quick_and_of_long_files_name_files():
    assert {name for name in QUICK | {*FIRST} if not (HERE / name).is_file()} == set()


@settings(max_examples=1)
@given(st.just(0.3))
def test_an_example_may_take_its_time(seconds):
    time.sleep(seconds)  # Hypothesis's own deadline is 0.2 s


@pytest.mark.parametrize("path", FILES, ids=lambda path: path.stem)
def test_a_file_has_neither_deadlines_nor_times_of_its_own(path):
    limits = {(name, ast.unparse(value)) for name, value in keywords(path) if name in ("deadline", "timeout")}
    assert limits <= {("deadline", "None"), ("timeout", "HANGS")}
