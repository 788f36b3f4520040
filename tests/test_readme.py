"""The README's examples run, and print what it says they print."""

import doctest
import json
import re
import shutil
import subprocess
import sys
from itertools import pairwise
from pathlib import Path

import pytest

import viscopade
from viscopade.model import beta_si_from_cgs

ROOT = Path(__file__).parents[1]
README = (ROOT / "README.md").read_text()
BLOCKS = re.findall(r"^```(\w+)\n(.*?)^```$", README, re.MULTILINE | re.DOTALL)


def followed_by_output(language):
    pairs = pairwise(BLOCKS)
    return [(code, out) for (kind, code), (following, out) in pairs if (kind, following) == (language, "text")]


def output_of(words, directory):
    run = subprocess.run(words, cwd=directory, capture_output=True, text=True, timeout=60)
    assert run.returncode == 0, run.stderr
    return run.stdout


def test_there_are_examples_of_each_kind():
    assert len(followed_by_output("c")) == len(followed_by_output("python")) == 1
    assert sum(kind == "console" for kind, _ in BLOCKS) >= 3


def test_c_example(tmp_path):
    compiler = shutil.which("cc")
    if compiler is None:
        pytest.skip("no C compiler")
    ((code, expected),) = followed_by_output("c")
    (tmp_path / "example.c").write_text(code)
    assert "cc -O2 -I exports example.c -lm && ./a.out" in README
    output_of([compiler, "-O2", "-I", str(ROOT / "exports"), "example.c", "-lm"], tmp_path)
    assert output_of(["./a.out"], tmp_path) == expected


def test_python_example(tmp_path):
    ((code, expected),) = followed_by_output("python")
    assert output_of([sys.executable, "-c", code], tmp_path) == expected


@pytest.mark.parametrize("block", [code for kind, code in BLOCKS if kind == "console"])
def test_console_examples(block, tmp_path):
    first, _, expected = block.partition("\n")
    words = first.removeprefix("$ viscopade ").split()
    assert output_of([sys.executable, "-m", "viscopade", *words], tmp_path) == expected


def test_measured_ratios_are_those_of_the_result():
    result = json.loads((ROOT / "docs" / "bench" / "result.json").read_text())
    measured = [target["measured"] for target in result["targets"] if target["measured"] is not None]
    assert len(measured) == 10
    section = README.partition("## Speed against error")[2].partition("## ")[0]
    assert [f"{ratio:.3g}" for ratio in measured if f"{ratio:.3g}" not in section] == []


def test_ice_in_si_units():
    assert f"{beta_si_from_cgs(1.307):.3f} (s/m)^(1/5)" in README


def test_the_example_in_the_package():
    assert doctest.testmod(viscopade).failed == 0
    assert doctest.testmod(viscopade).attempted >= 4
