"""The page of the audit is what its command prints: the text, and the tables of one program, another every day."""

from pathlib import Path

import pytest
from click.testing import CliRunner

from tests import daily
from viscopade.simulators import simulators
from viscopade_lab.studies import audit

PAGE = (Path(__file__).parents[2] / "docs" / "results" / "audit.md").read_text("utf-8")


@pytest.mark.parametrize(
    "program",
    [daily.chosen([each for each in simulators() if each.name != "textbook"])],
    ids=lambda program: program.name,
)
def test_tables_of_a_program(program):
    assert audit.markdown(audit.SUMMARY, audit.summary(program)).splitlines()[2:] == [
        line for line in PAGE.splitlines() if f"](../usage/simulators/{program.name}.md) |" in line
    ]
    own = (Path(__file__).parents[2] / "docs" / "usage" / "simulators" / f"{program.name}.md").read_text("utf-8")
    assert audit.with_section(own, program) == own


def test_other_tables():
    assert audit.sources_table() in PAGE
    assert audit.runs_table() in PAGE
    assert audit.instead_table() in PAGE


def test_the_text(monkeypatch):
    """Without the tables, which take their time."""
    monkeypatch.setattr(audit, "summary", lambda program: [])
    printed = CliRunner().invoke(audit.main).output
    assert printed.startswith("# The")
    rows = {line for line in PAGE.splitlines() if line.startswith("|")}
    assert [line for line in printed.splitlines() if line and line[0] != "|"] == [
        line for line in PAGE.splitlines() if line and line not in rows
    ]
