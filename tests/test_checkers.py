"""The checkers stand alone: they know nothing of the package, and run as their README says."""

import ast
import hashlib
import json
import re
import subprocess
import sys
from pathlib import Path

import pytest

from tests.daily import DAY
from tests.patience import HANGS

ROOT = Path(__file__).parents[1]
FOLDER = ROOT / "checkers"
PROGRAMS = sorted(path.name for path in FOLDER.glob("*.py"))
README = (FOLDER / "README.md").read_text(encoding="utf-8")


def run(name, *words):
    """Run a checker where the package cannot be imported."""
    code = (
        "import runpy, sys\n"
        "sys.modules['viscopade'] = sys.modules['flint'] = None\n"
        f"sys.path[0] = {str(FOLDER)!r}\n"
        f"runpy.run_path({str(FOLDER / name)!r}, run_name='__main__')"
    )
    words = [sys.executable, "-c", code, *map(str, words)]
    return subprocess.run(words, cwd=ROOT, capture_output=True, text=True, timeout=HANGS)


@pytest.mark.parametrize("name", PROGRAMS)
def test_a_checker_imports_nothing_of_the_package(name):
    nodes = [node for node in ast.walk(ast.parse((FOLDER / name).read_text())) if hasattr(node, "names")]
    found = {node.module for node in nodes if isinstance(node, ast.ImportFrom)}
    found |= {alias.name for node in nodes if isinstance(node, ast.Import) for alias in node.names}
    assert {module.split(".")[0] for module in found} <= sys.stdlib_module_names | {
        "mpmath",
        *(program.removesuffix(".py") for program in PROGRAMS),
    }


def test_the_readme_names_programs_and_files_that_are_there():
    assert re.findall(r"^\| `(\w+\.py)` \|", README, re.MULTILINE) == PROGRAMS
    named = re.findall(r"(?:checkers|exports|src|docs)/[\w/.]+\w", README)
    assert [name for name in named if not (ROOT / name).exists()] == []


@pytest.mark.parametrize("name", ["certificate_checker.py", "interval_checker.py"])
def test_a_checker_of_certificates_says_what_holds_and_what_is_wrong(name, tmp_path):
    exported = {"certificate_checker.py": "minimax", "interval_checker.py": "inverse"}[name]
    whole = json.loads((ROOT / "exports" / f"{exported}_certificates.json").read_text())
    entry = whole["certificates"][0]
    every = ("--every", "200") if name == "interval_checker.py" else ()
    for change, status, printed, said in (
        ({}, 0, f"{entry['name']} (", ""),
        ({"parts": entry["parts"][1:]}, 1, "", "wrong: "),
    ):
        path = tmp_path / "one.json"
        path.write_text(json.dumps({"certificates": [entry | change]}))
        done = run(name, path, *every)
        assert done.returncode == status, done.stderr
        assert done.stdout.startswith(printed)
        assert done.stderr.startswith(said)
        assert done.stderr.count("\n") == status


EXACT = ROOT / "src/viscopade/data/exact.txt"


def test_the_checker_of_the_exact_table_says_what_holds():
    done = run("exact_checker.py", EXACT, "--points", "12", "--start", str(DAY))
    assert (done.returncode, done.stderr) == (0, "")
    assert "12 collisions agree" in done.stdout


@pytest.mark.slow
def test_the_exact_table_agrees_with_2000_collisions():
    assert "2000 collisions agree" in run("exact_checker.py", EXACT, "--start", str(DAY)).stdout


def test_the_checker_of_the_exact_table_finds_wrong_rows(tmp_path):
    """By the digest; with the digest of the wrong rows by the order of panels, or by a collision."""
    digest, *rows = [line for line in EXACT.read_text(encoding="utf-8").splitlines() if not line.startswith("#")]
    name, panel, bound, exponent, first, *others = rows[5].split()
    wrong = " ".join((name, panel, bound, exponent, str(int(first) + 2**30), *others))  # by 2^-109
    path = tmp_path / "exact.txt"
    for lines, known, said in (
        ([*rows[:5], wrong, *rows[6:]], True, "the digest is not that of the rows"),
        (rows[1:], False, "line 1 is not that of panel 0"),
        (rows[:-1], False, "there are 216 rows: expected 217"),
        ([*rows[:5], wrong, *rows[6:]], False, "panel 5, v* = "),
    ):
        own = digest if known else f"sha256 {hashlib.sha256(chr(10).join(lines).encode()).hexdigest()}"
        path.write_text("\n".join((own, *lines)), encoding="utf-8")
        done = run("exact_checker.py", path, "--panel", "5", "--points", "1")
        assert (done.returncode, done.stdout) == (1, "")
        assert said in done.stderr


def test_the_checker_of_tables_says_what_holds():
    done = run("table_checker.py", "exports/viscopade_speed_1em5.h")
    assert (done.returncode, done.stderr) == (0, "")
    assert " rows" in done.stdout


def test_the_checker_of_records_says_what_holds_and_what_is_wrong(tmp_path):
    name = "pade-0-3.json"
    text = (ROOT / "src" / "viscopade" / "data" / "kernels" / name).read_text()
    for given, status, printed, said in (
        (text, 0, "pade 0 3 holds\n", ""),
        (
            text.replace('"pade"', '"x_pade"'),
            1,
            "",
            f"wrong: {name}: no check knows a record of 'x_pade'\n",
        ),
    ):
        (tmp_path / name).write_text(given)
        done = run("record_checker.py", tmp_path, "--every", "10", "--start", "3")
        assert (done.returncode, done.stdout, done.stderr) == (status, printed, said)
