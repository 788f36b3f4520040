"""Tables of the ready laws for the calculator's page: those of `viscopade.collision.curve` with fewer digits.

They are package data, made by  python -m tools.calculator_tables > src/viscopade/data/calculator.json  in a minute.
"""

from __future__ import annotations

import json
import math
import pkgutil
from collections.abc import Iterator, Sequence
from functools import lru_cache
from typing import Any, cast

from viscopade.collision.curve import curve, curve_tables
from viscopade.generated import MARKER
from viscopade.theory.law import ENDS, Law, law_of

DATA = "data/calculator.json"
ERROR = 1e-11
"""Largest relative error of eps, 1 - eps, x_max, tau_c and kappa from the tables (tests/calculator/test_numbers.py)."""
LAWS = ("viscoelastic", "linear", "tsuji", "hunt-crossley", "hunt-crossley:1", "kelvin-voigt:1", "3/2,0")
"""The ready laws, by the names that `law_of` takes; the first is the paper's."""

_DROPPED = 1e-12  # sum of the coefficients that a panel's polynomial is cut off by: the error that this makes
_DECIMALS = 14

Table = dict[str, Any]
"""A table as JSON: ends of panels, coefficients by function (L, X, T) and panel, slopes, largest kappas, decay."""


def laws() -> Iterator[tuple[str, Law]]:
    """Yield names and laws: with both ends of contact, where these differ."""
    for name in LAWS:
        for end in ENDS:
            law = law_of(name, end)
            if end == "force" or law.nu > 1:
                yield name, law


def made(law: Law) -> Table:
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
    """Return the leading coefficients of a Chebyshev series; what is left out sums up to `_DROPPED` at most."""
    number, left = len(coefficients), 0.0
    while number > 1 and left + abs(coefficients[number - 1]) <= _DROPPED:
        number -= 1
        left += abs(coefficients[number])
    return [round(c, _DECIMALS) for c in coefficients[:number]]


def _number(value: float) -> float | None:
    return None if math.isinf(value) else value


def data_file() -> str:
    """Return the content of the data file."""
    head = f"{MARKER}: python -m tools.calculator_tables > src/viscopade/{DATA}"
    rows = [f"{json.dumps(key(law))}: {json.dumps(made(law), separators=(',', ':'))}" for _, law in laws()]
    return "".join(("{\n", f'"command": {json.dumps(head)},\n', ",\n".join(rows), "\n}\n"))


def key(law: Law) -> str:
    """Return the name of a law's table in the data file."""
    return f"{law} {law.end}"


@lru_cache(maxsize=1)
def stored() -> dict[str, Table]:
    """Return the tables of the data file by `key`."""
    whole = json.loads(cast(bytes, pkgutil.get_data("viscopade", DATA)))
    return {key(law): whole[key(law)] for _, law in laws()}
