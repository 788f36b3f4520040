"""CONTRIBUTING.md and its pages on a law and a simulator: what they tell readers to write works."""

import re
from fractions import Fraction
from pathlib import Path
from types import ModuleType

import pytest
from jinja2 import DictLoader, Environment, StrictUndefined

from viscopade.audit.program import audited
from viscopade.cli.generate import read_scene
from viscopade.collision import exact
from viscopade.generated import MARKER
from viscopade.scene import units
from viscopade.theory import law

ROOT = Path(__file__).parents[1]


def blocks(page):
    text = (ROOT / "docs" / "development" / f"{page}.md").read_text("utf-8")
    return re.findall(r"^```(\w+)\n(.*?)^```$", text, re.MULTILINE | re.DOTALL)


def executed(code):
    module = ModuleType("example")
    exec(code, module.__dict__)
    return module


def test_the_law(monkeypatch):
    """The row, with a closed form that the page does not need: kappa of its own constant, and eps of its exponents."""
    ((_, row),) = blocks("laws")
    rows = eval("{" + row + "}", {"Fraction": Fraction, "NamedLaw": law.NamedLaw})
    monkeypatch.setattr(law, "NAMED", law.NAMED | rows)
    (name,) = rows
    found = law.law_of(name)
    assert found == law.Law("3/2", 0)
    assert (rows[name].factor(Fraction(1)), rows[name].power) == (1, 0)  # c = constant mass
    assert exact.invert("0.5", 8, law=found).decimals() == exact.invert("0.5", 8, law="3/2,0").decimals()


def test_the_audited_program():
    code = blocks("simulators")[0][1]
    program = executed(code).PROGRAM
    (formula,) = program.formulas
    found = audited(program, formula, "0.5")
    assert float(found.delivered) == pytest.approx(0.550283, abs=1e-6)
    assert float(found.instead) == pytest.approx(0.436288, abs=1e-6)


def test_the_renderer_and_its_template():
    _, (_, code), (kind, text) = blocks("simulators")
    assert kind == "jinja"
    module = executed(code)
    environment = Environment(
        loader=DictLoader({"bounce.txt.jinja": text}), undefined=StrictUndefined, trim_blocks=True, lstrip_blocks=True
    )
    module.template = lambda package, name: environment.get_template(name)
    setup = units.setup(read_scene(ROOT / "examples" / "steel_balls.toml"))
    lines = module.render(setup, "viscopade simulators bounce").splitlines()
    assert MARKER in lines[0]
    assert [line.split()[:4] for line in lines if line.startswith("pair")] == [
        ["pair", '"ball"', '"ball"', "E"],
        ["pair", '"ball"', '"anvil"', "E"],
    ]


@pytest.mark.parametrize("page", ["laws", "simulators", "targets"])
def test_files_that_the_pages_name_exist(page):
    text = (ROOT / "docs" / "development" / f"{page}.md").read_text("utf-8")
    named = re.findall(r"`((?:src|tests|docs|paper)/[\w/]+(?:\.\w+)?)`", text)
    assert named
    assert [name for name in named if not (ROOT / name).exists()] == []
