"""The numbers of docs/reference/speed.md are those of the code and of the exported headers."""

import re
from pathlib import Path

from viscopade.arithmetic.decimals import at_most
from viscopade.arithmetic.formats import DOUBLE
from viscopade.collision import panel_proof
from viscopade.kernels.catalogue import TIERS
from viscopade.kernels.speed_table import TABLES, eps_error_from_w_rounding, speed_table, table_bounds

ROOT = Path(__file__).parents[2]
PAGE = (ROOT / "docs" / "reference" / "speed.md").read_text()
WORDS = " ".join(PAGE.split())
ROWS = [
    [cell.strip() for cell in line.strip("|").split("|")]
    for line in PAGE.splitlines()
    if line.startswith(("| `", "| (`"))
]


def test_the_table_has_the_tables_and_their_bounds():
    assert {row[0].strip("`") for row in ROWS if ".h" in row[0]} == {f.name for f in ROOT.glob("exports/*speed*.h")}
    rough = {key: table for key, table in TABLES.items() if "rise" in table_bounds(table)}
    for row, (tier, table) in zip(ROWS, rough.items(), strict=False):
        file = f"viscopade_speed_{tier.replace('-', 'm')}.h"
        name = f"`{file}`" if tier in TIERS else f"(`--from-speed {tier}`)"
        kernel, proven = speed_table(tier), table_bounds(table)
        error = at_most(max(bound.formula for bound in kernel.bounds if bound.result == "restitution"))
        rise = at_most(proven["rise"] * (1 + proven["error"]))
        numbers = [str(table.degree), str(1 << table.split), table.form.name, f"{kernel.bytes:,}", error, rise]
        assert row == [name, *numbers]


def test_step_7_has_the_bounds_of_full_accuracy():
    sentence = r"is within ([\d.]+) ulp of its value at .*? The roundings of \$w\$ itself cost up to ([\d.]+) ulp"
    of_table, rounding = re.search(sentence, WORDS).groups()
    assert rounding == at_most(eps_error_from_w_rounding(DOUBLE) * 2**53)
    assert of_table == at_most(speed_table("full").table_bound("restitution", "double").ulps)
    assert [row[5] for row in ROWS if "speed_full" in row[0]] == [rf"{of_table} ulp of $\varepsilon(w)$"]


def test_step_4_has_the_steepest_slope():
    (slope,) = re.findall(r"are at most ([\d.]+) for the proven polynomials", WORDS)
    assert slope == at_most(panel_proof.steepest() / 10)
