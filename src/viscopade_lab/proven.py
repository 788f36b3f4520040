"""What is proven of the errors of the exported kernels, as numbers: headers say the same in words.

To prove the kernels takes a minute; the record of their fields is made by
python -m tools.proven_errors > src/viscopade_lab/data/proven.csv .

The quantities of a kernel in a type:

    formula                     largest error of the formula, relative to the smaller of eps and 1 - eps (of v*, for an
                                inverse), up to each `end` in v* if there is one; of a table, in the table
    rounding of FUNCTION        what rounding adds, relative to the function
    derivative                  relative error of the formula's slope
    underflow                   what is added where results are subnormal, in the type's smallest numbers
    ulps of FUNCTION            largest error, in units in the last place: all of it

and of one from speed to eps, which has a table over w = beta^5 speed = v*^10:

    low, high                   the v* of the table
    elsewhere                   the kernel that serves other speeds
    rounding                    what rounding adds to eps, relative to the smaller of eps and 1 - eps; half a unit in
                                the last place comes on top
    of v*                       what the rounding of v* does to eps elsewhere, relative to the smaller of the two
    ulps, ulps of w             largest error of eps(w), and what the rounding of w adds
    ulps elsewhere              largest error beyond the table: all of it
    relative, relative of w     the same of dissipation and rebound in the table, relatively

A type without quantities of its own is computed in type double, and then rounded.
"""

from __future__ import annotations

import csv
import pkgutil
from dataclasses import dataclass
from functools import lru_cache
from typing import NamedTuple, cast

DATA = "data/proven.csv"


class ProvenNumber(NamedTuple):
    """A line of the record."""

    kernel: str
    format: str
    quantity: str
    end: str
    value: str


COLUMNS = ProvenNumber._fields


@dataclass(frozen=True)
class Proven:
    """What is proven of a kernel in a type; an instance without numbers is false."""

    kernel: str
    numbers: tuple[ProvenNumber, ...]

    def __bool__(self) -> bool:
        return bool(self.numbers)

    def has(self, quantity: str) -> bool:
        """Return whether there is such a quantity."""
        return any(number.quantity == quantity for number in self.numbers)

    def text(self, quantity: str) -> str:
        """Return a quantity as it is written; one of several ends is the last."""
        found = [number.value for number in self.numbers if number.quantity == quantity]
        if not found:
            raise KeyError(f"{self.kernel}: nothing is recorded of {quantity!r}")
        return found[-1]

    def number(self, quantity: str) -> float:
        """Return a quantity."""
        return float(self.text(quantity))

    @property
    def up_to(self) -> tuple[tuple[float, float], ...]:
        """The v* up to which errors of the formula are proven, ascending, with these errors."""
        return tuple((float(n.end), float(n.value)) for n in self.numbers if n.quantity == "formula")


@lru_cache(maxsize=1)
def recorded() -> tuple[ProvenNumber, ...]:
    """Return all of the record."""
    text = cast(bytes, pkgutil.get_data(__name__, DATA)).decode()
    rows = csv.reader(line for line in text.splitlines() if not line.startswith("#"))
    if tuple(next(rows)) != COLUMNS:
        raise OSError(f"{DATA} has not the columns {', '.join(COLUMNS)}")
    return tuple(ProvenNumber(*row) for row in rows)


def of(kernel: str, form: str) -> Proven:
    """Return what is proven of a kernel, by the end of its functions' names, in type "double" or "float"."""
    return Proven(kernel, tuple(n for n in recorded() if (n.kernel, n.format) == (kernel, form)))
