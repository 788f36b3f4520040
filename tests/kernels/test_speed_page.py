"""The numbers of docs/reference/speed.md are those of the code and of the exported headers."""

import re
from pathlib import Path

from viscopade.arithmetic.decimals import at_most
from viscopade.collision import panel_proof
from viscopade.kernels import prove_lacunary
from viscopade.kernels.forms import speed_kernel, speed_table_last_place
from viscopade.kernels.forms.speed_kernel import TABLES
from viscopade.kernels.names import FAST

ROOT = Path(__file__).parents[2]
PAGE = (ROOT / "docs" / "reference" / "speed.md").read_text()
WORDS = " ".join(PAGE.split())
ROWS = [
    [cell.strip() for cell in line.strip("|").split("|")]
    for line in PAGE.splitlines()
    if line.startswith(("| `", "| (`"))
]


def header(name):
    return re.sub(r"[\s*]+", " ", (ROOT / "exports" / name.strip("`")).read_text())


def test_the_table_has_the_tables_and_their_bounds():
    assert {row[0].strip("`") for row in ROWS if ".h" in row[0]} == {f.name for f in ROOT.glob("exports/*speed*.h")}
    rows = {(speed_kernel.file_of(tier), tier, size): prove_lacunary.speed_kernel(tier, size) for tier, size in TABLES}
    for row, ((file, tier, size), kernel) in zip(ROWS, rows.items(), strict=False):
        name = f"`{file}`" if size == FAST else f"(`--from-speed {tier} --size {size}`)"
        table, rise = kernel.table, at_most(kernel.table.rise * (1 + kernel.table.proven.error))
        numbers = [str(table.degree), str(1 << table.split), table.form.name, f"{table.bytes:,}", kernel.bound, rise]
        assert row == [name, *numbers]


def test_step_7_has_the_bounds_of_full_accuracy():
    sentence = r"is within ([\d.]+) ulp of its value at .*? The roundings of \$w\$ itself cost up to ([\d.]+) ulp"
    of_table, of_w = re.search(sentence, WORDS).groups()
    assert of_w == at_most(speed_table_last_place.ulp_of_w())
    text = header("viscopade_speed_full.h")
    assert f"off by at most {of_table} units in the last place (ulp) of eps(w)" in text
    assert f"what the rounding of w = beta^5 speed does is at most {of_w} ulp" in text
    assert [row[5] for row in ROWS if "speed_full" in row[0]] == [rf"{of_table} ulp of $\varepsilon(w)$"]


def test_step_4_has_the_steepest_slope():
    (slope,) = re.findall(r"are at most ([\d.]+) for the proven polynomials", WORDS)
    assert slope == at_most(panel_proof.steepest() / 10)
