"""Maker of the package's own records, from the equation of motion on: the kernels of the catalogue are made anew.

So are the array tables of the named laws, and the table of falls that fits use.

python -m tools.kernel_records
"""

from __future__ import annotations

import argparse
from itertools import product
from pathlib import Path

from viscopade import store
from viscopade.collision.curve import curve_tables
from viscopade.fitting import weight_table
from viscopade.kernels.catalogue import CATALOGUE
from viscopade.theory.law import ENDS, NAMED, law_of

TARGET = Path(__file__).parents[1] / "src" / "viscopade" / store.FOLDER


def main() -> None:
    """Replace the records in the folder of the package."""
    with store.fresh_records() as records:
        for entry in CATALOGUE.values():
            entry.request.kernels()
        for name, end in product(NAMED, ENDS):
            curve_tables(law_of(name, end))
        weight_table.collisions_at_nodes()
    TARGET.mkdir(exist_ok=True)
    for old in TARGET.glob("*.json"):
        old.unlink()
    for name, text in records.items():
        (TARGET / name).write_text(text, "utf-8")


if __name__ == "__main__":
    argparse.ArgumentParser(description=__doc__).parse_args()
    main()
