"""Write the calculator's tables:  python -m tools.calculator_tables > src/viscopade/data/calculator.json ."""

from __future__ import annotations

import argparse
import json
import math
from collections.abc import Sequence

from viscopade.calculator import tables
from viscopade.collision.curve import curve, curve_tables
from viscopade.generated import MARKER
from viscopade.theory.law import Law

_DROPPED = 1e-12  # sum of the coefficients that a panel's polynomial is cut off by: the error that this makes
_DECIMALS = 14


def made(law: Law) -> tables.Table:
    """Return the table of a law, from the exact collision on."""
    whole, table = curve(law), curve_tables(law).of_s
    return {
        "ends": list(table.ends),
        "coefficients": [[_shortened(panel) for panel in function] for function in table.coefficients],
        "slopes": list(table.slopes),
        "largest": _number(whole.kappa_max),
        "largest_of_course": _number(whole.kappa_max_of_course),
        "decay": None if law.decay is None else float(law.decay),
    }


def _shortened(coefficients: Sequence[float]) -> list[float]:
    """Return the leading coefficients of a Chebyshev series; the others add up to at most `_DROPPED`."""
    number, left = len(coefficients), 0.0
    while number > 1 and left + abs(coefficients[number - 1]) <= _DROPPED:
        number -= 1
        left += abs(coefficients[number])
    return [round(c, _DECIMALS) for c in coefficients[:number]]


def _number(value: float) -> float | None:
    return None if math.isinf(value) else value


def data_file() -> str:
    """Return the content of the data file."""
    head = f"{MARKER}: python -m tools.calculator_tables > src/viscopade/{tables.DATA}"
    rows = [
        f"{json.dumps(tables.key(law))}: {json.dumps(made(law), separators=(',', ':'))}" for _, law in tables.laws()
    ]
    return "".join(("{\n", f'"command": {json.dumps(head)},\n', ",\n".join(rows), "\n}\n"))


if __name__ == "__main__":
    argparse.ArgumentParser(description=__doc__).parse_args()
    print(data_file(), end="")
