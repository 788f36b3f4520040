"""Write the calculator's tables:  python -m tools.calculator_tables > src/viscopade/data/calculator.json ."""

from __future__ import annotations

from viscopade.calculator import tables

if __name__ == "__main__":
    print(tables.data_file(), end="")
