"""The examples in docstrings run, and print what they show."""

import doctest
from importlib import import_module
from pathlib import Path

import pytest

from viscopade.kernels import native

SOURCE = Path(__file__).parents[1] / "src"
MODULES = [
    ".".join(path.relative_to(SOURCE).with_suffix("").parts).removesuffix(".__init__")
    for path in sorted(SOURCE.rglob("*.py"))
    if ">>> " in path.read_text("utf-8")
]


@pytest.mark.parametrize("name", MODULES)
def test_examples(name):
    module = import_module(name)
    extra = [native.DOC] if module is native else []  # of an object that doctest does not look at
    runner, finder, parser = doctest.DocTestRunner(), doctest.DocTestFinder(), doctest.DocTestParser()
    tests = [test for test in finder.find(module) if test.examples]
    tests += [parser.get_doctest(text, {}, name, None, 0) for text in extra]
    assert tests
    for test in tests:
        runner.run(test)
    assert runner.summarize(verbose=False).failed == 0
