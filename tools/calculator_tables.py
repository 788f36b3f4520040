"""Write the calculator's tables:  python -m tools.calculator_tables > src/viscopade/data/calculator.json ."""

from __future__ import annotations

import argparse

from viscopade.calculator import tables

if __name__ == "__main__":
    argparse.ArgumentParser(description=__doc__).parse_args()
    print(tables.data_file(), end="")
