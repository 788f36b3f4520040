"""Make the table of `exact`: eps or 1 - eps on panels of v*, with proven bounds of the errors.

    python -m tools.exact_table

takes half an hour of one core. It saves src/viscopade/data/exact.txt after each panel, and keeps the panels that are
there. With numbers of panels, it makes and proves these only, and prints log2 of the bounds.

The polynomials interpolate values to 42 digits at Chebyshev's nodes, in exact arithmetic.
"""

from __future__ import annotations

import argparse
import math
from fractions import Fraction
from pathlib import Path

from flint import fmpq, fmpq_poly

from tools.double_table import rounded
from viscopade.arithmetic.balls import ball_of, exact_middle, magnitude, working
from viscopade.arithmetic.chebyshev import interpolated, nodes
from viscopade.arrays.panels import CENTRES, HALF_WIDTHS, PANELS
from viscopade.collision import exact
from viscopade.collision.panel_proof import EXACT, EXACT_BITS, ExactRow, PanelRow, digest, exact_rows, prove_row
from viscopade.generated import MARKER
from viscopade.progress import track

FILE = Path(__file__).parents[1] / "src/viscopade" / EXACT
COEFFICIENTS = 28
DIGITS = 42
BITS = 140  # of a_0


def candidate(index: int) -> tuple[str, PanelRow, list[fmpq]]:
    """Return the smaller of eps and 1 - eps on a panel, its name and its row, and the k of `prove_row`."""
    # On panel 0, where 0 <= z <= 1, (1 - eps)/z^2 and k/z^2 are interpolated.
    places, power = (nodes(COEFFICIENTS), 0) if index else (tuple((z + 1) / 2 for z in nodes(COEFFICIENTS)), 2)
    centre, half = (Fraction(float(values[index])) for values in (CENTRES, HALF_WIDTHS))
    speeds = [centre + half * z for z in places]
    collisions = [exact.collision(v_star, DIGITS) for v_star in speeds]
    middle = collisions[COEFFICIENTS // 2]
    name = "epsilon" if middle.epsilon < middle.one_minus_epsilon else "one_minus_epsilon"
    values = [Fraction(c.decimals()[name]) / z**power for c, z in zip(collisions, places, strict=True)]
    row = rounded((fmpq_poly([0] * power + [1]) * interpolated(places, values)).coeffs(), BITS)
    # k = 2 v*^2 x_max^(1/4)
    with working(BITS + 40):
        scales = [2 * ball_of(v_star**2 / z**power) for v_star, z in zip(speeds, places, strict=True)]
        k = [exact_middle(scale * c.x_max.root(4)) for scale, c in zip(scales, collisions, strict=True)]
    return name, row, interpolated(places, k).coeffs()


def row_of(index: int) -> ExactRow:
    """Return a panel's row, with the proven bound."""
    name, row, k = candidate(index)
    bound = prove_row(index, name, row, k)
    return ExactRow(name, math.ceil(magnitude(bound) * 2**EXACT_BITS), row)


def text(rows: dict[int, ExactRow]) -> str:
    """Return the file with these rows."""
    lines = [
        " ".join(map(str, (name, index, bound, row.exponent, *row.a)))
        for index, (name, bound, row) in sorted(rows.items())
    ]
    return "\n".join((
        f"# {MARKER}: python -m tools.exact_table",
        "# The smaller of eps and 1 - eps on the panels of double.txt; end of contact: where the force vanishes.",
        "# function panel bound e a_0 a_1 ...: "
        "the function is 2^e (a_0 + a_1 z + ...), z = (v* - centre)/(half width);",
        f"# the relative error is at most bound/2^{EXACT_BITS}, which is proven; on panel 0 from v* = 2^-36 on",
        digest(lines),
        *lines,
        "",
    ))  # fmt: skip


def save(rows: dict[int, ExactRow]) -> None:
    """Put a file with these rows in the place of the package's."""
    whole = FILE.with_suffix(".new")
    whole.write_text(text(rows), encoding="utf-8")
    whole.replace(FILE)


def main() -> None:
    """Complete the table, or print log2 of the bounds of the panels given on the command line."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("panels", nargs="*", type=int)
    panels = parser.parse_args().panels
    for index in panels:
        print(index, f"2^{math.log2(row_of(index).bound) - EXACT_BITS:.2f}", flush=True)
    if not panels:
        rows = dict(exact_rows())
        for index in track([index for index in range(PANELS) if index not in rows], "panels"):
            rows[index] = row_of(index)
            save(rows)


if __name__ == "__main__":
    main()
