"""Tables of the ready laws for the calculator's page: the tables of `viscopade.collision.curve` with fewer digits.

`python -m tools.calculator_tables > src/viscopade/data/calculator.json` makes this file of the package in a minute.
"""

from __future__ import annotations

import json
import pkgutil
from collections.abc import Iterator
from functools import lru_cache
from typing import Any, cast

from viscopade.theory.law import ENDS, Law, law_of

DATA = "data/calculator.json"
ERROR = 1e-11
"""Largest relative error of eps, 1 - eps, x_max, tau_c and kappa from the tables (tests/calculator/test_numbers.py)."""
LAWS = ("viscoelastic", "linear", "tsuji", "hunt-crossley", "hunt-crossley:1", "kelvin-voigt:1", "3/2,0")
"""The ready laws, by the names that `law_of` takes; the first is the paper's."""

Table = dict[str, Any]
"""A table as JSON: ends of panels, coefficients by function (L, X, T) and panel, slopes, largest kappas, decay."""


def laws() -> Iterator[tuple[str, Law]]:
    """Yield names and laws: with both ends of contact, where these differ."""
    # For nu = (a + 1)/(b + 1) <= 1 the force vanishes only where x = 0 again.
    for name in LAWS:
        for end in ENDS:
            law = law_of(name, end)
            if end == "force" or law.nu > 1:
                yield name, law


def key(law: Law) -> str:
    """Return the name of a law's table in the data file."""
    return f"{law} {law.end}"


@lru_cache(maxsize=1)
def stored_tables() -> dict[str, Table]:
    """Return the tables of the data file by `key`."""
    tables_of_file = json.loads(cast(bytes, pkgutil.get_data("viscopade", DATA)))
    return {key(law): tables_of_file[key(law)] for _, law in laws()}
