"""The pages have the tables that the audit's command writes: those of one program, another every day."""

from pathlib import Path

import pytest

import viscopade as vp
from tests import daily
from tests.simulators.two_balls import fallen
from viscopade.simulators import simulators
from viscopade.theory.law import law_of
from viscopade_lab.studies import audit

PAGE = (Path(__file__).parents[2] / "docs" / "results" / "audit.md").read_text("utf-8")


@pytest.mark.parametrize(
    "program",
    [daily.chosen([each for each in simulators() if each.name != "textbook"])],
    ids=lambda program: program.name,
)
def test_tables_of_a_program(program):
    rows = audit.markdown(audit.SUMMARY, audit.summary(program)).splitlines()[2:]
    link = f"[{program.title}](../usage/simulators/{program.page}.md) |"
    assert rows == [line for line in PAGE.splitlines() if link in line]
    if program.page != program.name:
        return
    own = (Path(__file__).parents[2] / "docs" / "usage" / "simulators" / f"{program.name}.md").read_text("utf-8")
    assert audit.filled(own, audit.blocks_of(program)) == own


def test_the_page_has_what_its_command_writes(monkeypatch):
    """Without the table of all programs, whose rows the test above has, and the slow ones."""
    for name in ("summary", "steps_table", "weight_table"):
        monkeypatch.setattr(audit, name, lambda *_: "")
    slow = "summary", "time steps", "weight"
    quick = {name: text for name, text in audit.blocks().items() if name not in slow}
    assert len(quick) == 5
    assert audit.filled(PAGE, quick) == PAGE
    with pytest.raises(ValueError, match="the page lacks a mark"):
        audit.filled("", quick)


WEIGHT = PAGE.partition("stays down from |")[2].partition("\n<!--")[0].splitlines()[2:]


@pytest.mark.parametrize("row", WEIGHT)
def test_the_table_of_weight_names_its_laws(row):
    """By an integration in time at g t_c/v = 0.1, of the law that the row names."""
    name, contact_ends, _, _, stated, *_ = row.strip("| ").split(" | ")
    law = law_of(name, "return" if contact_ends == "$x = 0$" else "force")
    a, b, kappa = float(law.elastic), float(law.damping), vp.exact.invert("0.5", law=law).floats()["v_star"] ** law.d
    end = "position" if law.end == "return" else "force"
    found, *_ = fallen(lambda x, u: x**a + kappa * x**b * u, 1.0, 0.1 / law.contact_time, 1.0, 1.0, end)
    assert found == pytest.approx(float(stated), abs=5e-5)
