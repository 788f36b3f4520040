"""Registry of the ready kernels with their proven errors: speed tables, compact and full kernels.

To prove them takes a minute; the table is made by  python -m tools.registry > src/viscopade/data/registry.csv
and read by `entries`. An error is stated as

    |d eps| <= both min(eps, 1 - eps) + rounding eps,    and 1 - eps^2 is off by what `both` does to it, and loss,

`both` being that of the formula and of what is rounded before the last sum and quotient. That it is relative to the
smaller one follows so: those roundings change lost/elastic by a factor 1 + eta, which changes eps by eps (1 - eps) eta.
The bound r_0 of eps's relative error holds this below r_0 eps; that of 1 - eps, r_1, below r_1 (1 - eps). From a bound
r_2 of 1 - eps^2 it is below r_2 (1 - eps^2)/(2 eps), which is at most 3/2 r_2 (1 - eps) for eps >= 1/2. (These bounds
hold whatever the single roundings are, so also if the last ones are none.) All numbers are rounded up.
"""

from __future__ import annotations

import csv
import pkgutil
from collections.abc import Mapping
from dataclasses import dataclass
from fractions import Fraction
from functools import lru_cache
from typing import Any, Literal, cast

from viscopade.arithmetic.formats import FORMATS
from viscopade.kernels.forms.table_free import LARGEST

DATA = "data/registry.csv"
_NUMBERS = ("bytes", "operations")


Kind = Literal["speed", "compact", "full", "v*"]

HOST = "host"


@dataclass(frozen=True)
class Entry:
    """An entry of the registry: a kernel in one format.

    Attributes
    ----------
    kind : str
        "speed" and "compact" take speed and beta; "full" takes v*. "v*" is no kernel, but what the
        rounding of v* = sqrt(beta) pow(speed, 0.1) adds to these.
    tier, size : str
        As `prove_lacunary.speed_kernel` takes them; for compact kernels, the accuracy asked for.
    name : str
        The end of the functions' names.
    place, format : str
        "host", "device" (CUDA) or "shader"; "double" or "float".
    bytes : int
        Size of the table.
    operations : int
        Sums, products, and those on bits that find the row of the table; without roots, powers and divisions.
    v_star_min, v_star_max : str
        The range in which the error is at most `inside`.
    inside, outside : str
        Proven bounds of `both`.
    rounding, loss : str
        What the last roundings of eps, and those of 1 - eps^2, add, relative to these.
    formula : str
        Proven bound of the formula alone, as in the name; empty for full accuracy.
    """

    kind: Kind
    tier: str
    size: str
    name: str
    place: str
    format: str
    bytes: int
    operations: int
    v_star_min: str
    v_star_max: str
    inside: str
    outside: str
    rounding: str
    loss: str
    formula: str

    def error(self, low: Fraction, high: Fraction) -> Fraction:
        """Return the proven bound on a range of v*."""
        end = Fraction(10) ** 1000 if self.v_star_max == "inf" else Fraction(self.v_star_max)
        within = Fraction(self.v_star_min) <= low and high <= end
        return Fraction(self.inside if within else self.outside)


def limits(form: str) -> tuple[Fraction, Fraction]:
    """Return the least and the largest v* of compact kernels in a type, rounded inwards."""
    least = 1 - FORMATS[form].largest
    return Fraction(f"{1.01 * 2.0 ** (least / 10):.3g}"), Fraction(f"{0.99 * 2.0 ** (LARGEST[form] / 10):.3g}")


@lru_cache(maxsize=1)
def entries() -> tuple[Entry, ...]:
    """Return all entries of the data file."""
    text = cast(bytes, pkgutil.get_data("viscopade", DATA)).decode()
    rows = csv.DictReader(line for line in text.splitlines() if not line.startswith("#"))
    return tuple(_entry(row) for row in rows)


def _entry(row: Mapping[str, str]) -> Entry:
    values: dict[str, Any] = {name: int(text) if name in _NUMBERS else text for name, text in row.items()}
    return Entry(**values)
