"""Long sweeps: the suite runs a share of each, every day another one; `make test-slow` runs them whole."""

import os
from datetime import date

DAY = int(os.environ.get("VISCOPADE_DAY", date.today().toordinal()))


def place(number: int, parts: int) -> int:
    """Return the index of today's item among the `parts` ones from number * parts on."""
    return number * parts + DAY % parts


def chosen(items):
    """Return today's item."""
    return items[DAY % len(items)]
