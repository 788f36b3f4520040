"""The numbers of docs/reference/speed.md are those of the code and of the exported headers."""

import csv
import re
from pathlib import Path

import pytest

from viscopade.arithmetic.decimals import at_most
from viscopade.collision import panel_proof
from viscopade.kernels import registry
from viscopade.kernels.forms import speed_table_last_place
from viscopade.kernels.targets import speed

ROOT = Path(__file__).parents[2]
PAGE = (ROOT / "docs" / "reference" / "speed.md").read_text()
WORDS = " ".join(PAGE.split())
ROWS = [
    [cell.strip() for cell in line.strip("|").split("|")]
    for line in PAGE.splitlines()
    if line.startswith(("| `", "| (`"))
]
EXPORTED = [row for row in ROWS if not row[0].startswith("`(") and ".h" in row[0] and "full" not in row[0]]


def header(name):
    return re.sub(r"[\s*]+", " ", (ROOT / "exports" / name.strip("`")).read_text())


def test_the_table_lists_all_headers():
    assert len(EXPORTED) == 4
    assert {row[0].strip("`") for row in ROWS if ".h" in row[0]} == {f.name for f in ROOT.glob("exports/*speed*.h")}


@pytest.mark.parametrize("row", EXPORTED, ids=lambda row: row[0].strip("`"))
def test_rows_of_exported_headers(row):
    name, degree, split, numbers, size, error, rise = row
    text = header(name)
    for words in (
        f"degree {degree} in m, {split} rows",
        f"{size} bytes",
        f"by at most {rise} min(eps, 1 - eps) (proven",
        f"static const {numbers} viscopade_table_",
    ):
        assert words in text
    (bounds,) = re.findall(
        r"min\(eps, 1 - eps\) <= (\S+) in the table, (?:(\S+) elsewhere|that of viscopade_full)", text
    )
    assert error == max(filter(None, bounds), key=float)


def test_rows_of_the_registry():
    """The small tables are not exported; what needs no proof of a minute is in the registry."""
    lines = [line for line in registry_lines() if not line.startswith("#")]
    kernels = {(row["tier"], row["size"]): row for row in csv.DictReader(lines) if row["kind"] == "speed"}
    small = [row for row in ROWS if "--size small" in row[0]]
    assert len(small) == 3
    for name, degree, split, _, size, error, _ in small:
        found = kernels[re.search(r"--from-speed (\S+)", name)[1], "small"]
        assert f"lookup_{degree}_{split}_{error.replace('.', 'p').replace('-', 'm')}" == found["name"]
        assert int(size.replace(",", "")) == int(found["bytes"])


def registry_lines():
    return (Path(registry.__file__).parents[1] / "data" / "registry.csv").read_text().splitlines()


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


@pytest.mark.slow
def test_the_table_is_what_its_command_prints(capsys):
    speed.main()
    printed = [[cell.strip() for cell in line.strip("|").split("|")] for line in capsys.readouterr().out.splitlines()]
    assert [[row[1], row[2], *row[4:]] for row in ROWS if len(row) > 4] == [row[1:] for row in printed]
