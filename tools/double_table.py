"""Make the table of `double` from proven values:  python -m tools.double_table > src/viscopade/data/double.txt .

A line holds a function's name, the panel, an exponent e and integers a_0, a_1, …: on the panel the function is

    2^e (a_0 + a_1 z + a_2 z^2 + …),    z = (v* - centre)/(half width).

The polynomials interpolate near Chebyshev's nodes, in exact arithmetic. The same on every machine, to the byte.
"""

from __future__ import annotations

import math
from collections.abc import Iterator, Sequence
from fractions import Fraction
from functools import lru_cache

from flint import fmpq, fmpq_poly

from viscopade.arithmetic.chebyshev import interpolated, to_fraction
from viscopade.arrays.panels import CENTRES, COEFFICIENTS, DATA, FIRST, FOLD, HALF_WIDTHS, NAMES, PANELS, SPLIT
from viscopade.collision import exact
from viscopade.collision.panel_proof import PanelRow
from viscopade.generated import MARKER
from viscopade.progress import track

DIGITS = 22
BITS = 66  # of a_0
NODE_BITS = 20  # nodes are short, so that the last bit of a cosine does not matter


def panel(index: int) -> dict[str, PanelRow]:
    """Return the rows of all functions on a panel."""
    if index == 0:
        return _lowest_panel()
    nodes = _nodes(COEFFICIENTS, -1)
    values = [_values(index, z) for z in nodes]
    return {name: rounded(interpolated(nodes, [value[name] for value in values]).coeffs(), BITS) for name in NAMES}


def _lowest_panel() -> dict[str, PanelRow]:
    """Return the rows of the panel around 0, where (1 - eps)/v*^2 is interpolated."""
    nodes = _nodes(COEFFICIENTS - 2, 0)
    values = [_values(0, z) for z in nodes]
    loss = interpolated(nodes, [value["one_minus_epsilon"] / z**2 for z, value in zip(nodes, values, strict=True)])
    loss *= fmpq_poly([0, 0, 1])
    polynomials = {"epsilon": 1 - loss, "one_minus_epsilon": loss}
    for name in ("x_max", "tau_c"):
        polynomials[name] = interpolated(nodes, [value[name] for value in values])
    return {name: rounded(polynomials[name].coeffs(), BITS, COEFFICIENTS) for name in NAMES}


def _nodes(number: int, low: int) -> list[Fraction]:
    """Return Chebyshev's nodes on [low, 1], nearly."""
    cosines = [math.cos((2 * i + 1) * math.pi / (2 * number)) for i in range(number)]
    nodes = [Fraction(round(c * 2**NODE_BITS), 2**NODE_BITS) for c in cosines]
    return [(z + 1) / 2 if low == 0 else z for z in nodes]


@lru_cache(maxsize=2 * COEFFICIENTS)
def _values(index: int, z: Fraction) -> dict[str, Fraction]:
    """Return the true values at a point of a panel, to `DIGITS` digits."""
    v_star = Fraction(CENTRES[index]) + Fraction(HALF_WIDTHS[index]) * z
    decimals = exact.collision(v_star, DIGITS).decimals()
    return {name: Fraction(decimals[name]) for name in NAMES}


def rounded(coefficients: Sequence[fmpq], bits: int, length: int = 0) -> PanelRow:
    """Round to integers in a unit that gives the first one that is not 0 `bits` bits; add zeros up to a length."""
    fractions = [*map(to_fraction, coefficients), *[Fraction(0)] * (length - len(coefficients))]
    first = abs(next(c for c in fractions if c))
    exponent = math.floor(math.log2(first)) - bits + 1
    return PanelRow(exponent, tuple(round(c / Fraction(2) ** exponent) for c in fractions))


def errors(index: int, rows: dict[str, PanelRow]) -> Iterator[Fraction]:
    """Yield relative errors at the ends of a panel, where an interpolation at Chebyshev's nodes is worst."""
    for z in (Fraction(-1), Fraction(1)) if index else (Fraction(1),):
        for name, value in _values(index, z).items():
            yield abs(rows[name](z) / value - 1)


def text() -> str:
    """Return the table."""
    panels = [panel(index) for index in track(range(PANELS), "table for double precision")]
    worst = max(error for index, rows in enumerate(panels) for error in errors(index, rows))
    lines = [
        f"# {MARKER}: python -m tools.double_table > src/viscopade/{DATA}",
        f"# Functions of v* on [0, 2^{FOLD + 3}): panel 0 is [0, 2^{FIRST}), then {2**SPLIT} panels to each octave.",
        "# End of contact: where the force vanishes (the paper's Eq. 6).",
        f"# Relative error of the polynomials: at most 2^{math.log2(worst):.1f} (sampled at the ends of all panels).",
        "# function panel e a_0 a_1 ... : the function is 2^e (a_0 + a_1 z + ...), z = (v* - centre)/(half width)",
    ]
    lines += [line(name, index, rows[name]) for name in NAMES for index, rows in enumerate(panels)]
    return "\n".join(lines) + "\n"


def line(name: str, index: int, row: PanelRow) -> str:
    """Return the table's line for a function on a panel."""
    return " ".join(map(str, (name, index, row.exponent, *row.a)))


if __name__ == "__main__":
    print(text(), end="")
