"""Prove the rows of `double`'s table for eps and 1 - eps on all panels, and record the bounds of their errors.

    python -m tools.panel_bounds > src/viscopade/data/proven.txt

They are compared with those of data/exact.txt, which `tools.exact_table` proves. With numbers of panels, prove these
only, and print log2 of the bounds.
"""

from __future__ import annotations

import argparse
import math
from collections.abc import Iterator

from viscopade.arrays.panels import DATA, PANELS
from viscopade.collision.panel_proof import RECORD, RECORD_BITS, digest, double_bounds, lines_of
from viscopade.generated import MARKER


def record() -> Iterator[str]:
    """Prove all panels, and yield the record's lines."""
    yield f"# {MARKER}: python -m tools.panel_bounds > src/viscopade/{RECORD}"
    yield f"# Proven bounds of the relative errors of the rows for eps and for 1 - eps in {DATA}, whose digest follows."
    yield f"# panel and bounds, in units of 2^-{RECORD_BITS}, rounded up"
    yield digest(lines_of(DATA))
    for index in range(PANELS):
        yield " ".join(map(str, (index, *double_bounds(index).recorded())))


def main() -> None:
    """Print the record, or log2 of the bounds of the panels given on the command line."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("panels", nargs="*", type=int)
    panels = parser.parse_args().panels
    if not panels:
        for line in record():
            print(line, flush=True)
    for index in panels:
        bounds = double_bounds(index)
        print(index, *(f"{name} 2^{math.log2(float(bound)):.2f}" for name, bound in bounds._asdict().items()))


if __name__ == "__main__":
    main()
