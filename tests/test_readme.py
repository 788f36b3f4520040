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
from tests.patience import HANGS
from viscopade.model import beta_si_from_cgs

ROOT = Path(__file__).parents[1]
README = (ROOT / "README.md").read_text()
BLOCKS = re.findall(r"^```(\w+)\n(.*?)^```$", README, re.MULTILINE | re.DOTALL)


def followed_by_output(language):
    pairs = pairwise(BLOCKS)
    return [(code, out) for (kind, code), (following, out) in pairs if (kind, following) == (language, "text")]


def output_of(words, directory):
    run = subprocess.run(words, cwd=directory, capture_output=True, text=True, timeout=HANGS)
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
    if "examples/" in first:
        shutil.copytree(ROOT / "examples", tmp_path / "examples")
    assert output_of([sys.executable, "-m", "viscopade", *words], tmp_path) == expected


def test_measured_ratios_are_those_of_the_result():
    result = json.loads((ROOT / "docs" / "bench" / "result.json").read_text())
    measured = [target["measured"] for target in result["targets"] if target["measured"] is not None]
    assert len(measured) == 10
    section = README.partition("## Speed against error")[2].partition("## ")[0]
    assert [f"{ratio:.3g}" for ratio in measured if f"{ratio:.3g}" not in section] == []


def test_the_table_of_lammps_is_that_of_its_page():
    rows = [line for line in README.splitlines() if line.startswith("| v* = ")]
    page = (ROOT / "docs" / "usage" / "simulators-lammps.md").read_text().splitlines()
    assert len(rows) == 10
    assert [row for row in rows if row not in page] == []


def test_the_number_to_write_into_liggghts():
    from viscopade.simulators import tsuji

    sentence = r"`coefficientRestitution 0.3` with.*?gives eps = ([0-9.]+); the number to write is ([0-9.]+)"
    naive, right = (number.rstrip(".") for number in re.search(sentence, README, re.DOTALL).groups())
    assert naive == f"{tsuji.epsilon(tsuji.damping_ratio(0.3, end='position'), end='force'):.3f}"
    assert right == f"{tsuji.epsilon(tsuji.damping_ratio(0.3, end='force'), end='position'):.6f}"


def test_ice_in_si_units():
    assert f"{beta_si_from_cgs(1.307):.3f} (s/m)^(1/5)" in README


def test_the_example_in_the_package():
    assert doctest.testmod(viscopade).failed == 0
    assert doctest.testmod(viscopade).attempted >= 4
