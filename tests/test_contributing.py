"""The page on extending viscopade: what it tells readers to write works."""

import json
import os
import re
import shutil
import subprocess
import sys
from fractions import Fraction
from pathlib import Path

import pytest

from tests.patience import HANGS
from viscopade.collision import exact
from viscopade.generated import MARKER
from viscopade.theory import law

ROOT = Path(__file__).parents[1]


PAGE = (ROOT / "docs" / "development" / "extending.md").read_text("utf-8")
SECTIONS = {text.partition("\n")[0]: text for text in PAGE.split("\n## ")[1:]}


def blocks(section):
    return re.findall(r"^```(\w+)\n(.*?)^```$", SECTIONS[section], re.MULTILINE | re.DOTALL)


def test_the_law(monkeypatch):
    """The row, with a closed form that the page does not need: eps of its exponents."""
    ((_, row),) = blocks("A law of contact")
    rows = eval("{" + row + "}", {"Fraction": Fraction, "NamedLaw": law.NamedLaw})
    monkeypatch.setattr(law, "NAMED", law.NAMED | rows)
    (name,) = rows
    found = law.law_of(name)
    assert found == law.Law("3/2", 0)
    assert exact.invert("0.5", 8, law=found).decimals() == exact.invert("0.5", 8, law="3/2,0").decimals()


@pytest.fixture(scope="module")
def with_a_simulator(tmp_path_factory):
    """A copy of the package with what the page says: a module, and its line of the list."""
    source = tmp_path_factory.mktemp("source")
    shutil.copytree(ROOT / "src" / "viscopade", source / "viscopade", ignore=shutil.ignore_patterns("__pycache__"))
    folder = source / "viscopade" / "simulators"
    lines = re.findall(r'`("\w+": \("\w+",\),)`', SECTIONS["A simulator"])
    for (_, code), line in zip(blocks("A simulator"), lines, strict=True):
        (folder / f"{line.split(chr(34))[1]}.py").write_text(code, "utf-8")
    known = (folder / "__init__.py").read_text("utf-8")
    before, mark, after = known.partition('    "textbook": (),\n')
    assert mark
    after = after.replace("OWN_LAW = (", 'OWN_LAW = ("bounce", ')
    (folder / "__init__.py").write_text("".join([before, *(f"    {line}\n" for line in lines), mark, after]), "utf-8")

    def run(*words):
        found = subprocess.run(
            [sys.executable, "-m", "viscopade", *map(str, words)],
            env={**os.environ, "PYTHONPATH": str(source)},
            capture_output=True,
            text=True,
            timeout=HANGS,
        )
        assert found.returncode == 0, found.stderr
        return found.stdout

    return run


def test_an_added_simulator_is_audited(with_a_simulator):
    words = ("audit", "bounce", "--epsilon", "0.5", "--format", "json")
    (row,) = json.loads(with_a_simulator(*words))["rows"]
    assert float(row["delivered"]) == pytest.approx(0.550283, abs=1e-6)
    assert row["instead"]["restitution"] == pytest.approx(0.436288, abs=1e-6)
    assert [*row["why"]] == ["The formula is made for the other end of contact."]


def test_an_added_simulator_takes_the_file_of_a_user(with_a_simulator):
    words = ("audit", "bounce", "--set", "stiffness=10 kN/m", "--set", "restitution=0.5", "--mass", "1", "--speed", "1")
    found = json.loads(with_a_simulator(*words, "--epsilon", "0.5", "--format", "json"))
    assert found["delivered"] == pytest.approx(0.550283, abs=1e-6)
    assert float(found["instead"]["restitution"]) == pytest.approx(0.436288, abs=1e-6)
    stepped = json.loads(with_a_simulator(*words, "--time-step", "1 ms", "--scheme", "rk4", "--format", "json"))
    assert (stepped["scheme"], stepped["least"] < stepped["delivered"]) == ("rk4", True)


def test_an_added_simulator_with_its_own_law_has_its_text(with_a_simulator):
    words = ("simulators", "bounce", "--epsilon", "0.5", "--speed", "1", "--stiffness", "1000", "--mass", "2")
    lines = with_a_simulator(*words).splitlines()
    assert MARKER in lines[0]
    assert lines[-1].split()[:3] == ["contact", '"contact"', "restitution"]
    assert float(lines[-1].split()[3]) == pytest.approx(0.436288, abs=1e-6)
    assert lines[-1].split()[4:] == ["stiffness", "1000"]


def test_an_added_simulator_is_in_the_calculator(with_a_simulator):
    page = with_a_simulator("calculator", "-o", "-")
    assert '{"name":"bounce","title":"Bounce","texts":{"any":"restitution {parameter}"},"walls":true' in page


@pytest.mark.parametrize("section", ["A language", "A simulator"])
def test_the_sections_begin_with_a_table_of_files(section):
    assert SECTIONS[section].splitlines()[2] == "| file | why |"


@pytest.mark.parametrize("section", ["A language", "A simulator", "A law of contact"])
def test_files_that_the_sections_name_exist(section):
    named = re.findall(r"`((?:src|tests|docs|paper)/[\w/]+(?:\.\w+)?)`", SECTIONS[section])
    assert named
    assert [name for name in named if not (ROOT / name).exists()] == []
