"""Compare the package's table of 39 digits with collisions integrated in time, without the package or FLINT.

    python checkers/exact_checker.py src/viscopade/data/exact.txt [--points 2000] [--start 0] [--panel P]

Each row of the table is a polynomial on a panel of v* for eps or 1 - eps, whichever is smaller, with a bound of its
relative error. At random v* the polynomial is evaluated exactly, and compared with another route: the scaled equation
x'' + x^(3/2) + v*^2 x' sqrt(x) = 0 from first contact, x = 0 and x' = 1, to the end of contact, x'' = 0. With
R = sqrt(x), W = x' and a time s, dtau = 2 R ds, it is a polynomial flow,

    R' = W,    W' = -2 R^2 D,    D = R^2 + v*^2 W,    eps = -W where D = 0 after the turning point,

which is followed by Taylor polynomials in integer arithmetic. (The package's proof follows the motion from the turning
point, for given values of another parameter, and in balls.) The table must agree to 35 digits, and its bounds must be
smaller. Where panels lie follows from the page on the exact function: [0, 2^-4), then eight in each of 27 octaves;
panel 0 holds from 2^-36 on.
"""

from __future__ import annotations

import argparse
import hashlib
import random
from collections.abc import Sequence
from fractions import Fraction
from operator import mul
from pathlib import Path
from typing import NamedTuple

FIRST, TO_AN_OCTAVE, LEAST = Fraction(1, 16), 8, Fraction(1, 2**36)
PANELS = 1 + 8 * 27
BOUND_UNIT = Fraction(1, 2**160)
AGREED = Fraction(1, 10**35)
BITS = 140  # of the smaller of eps and 1 - eps
SPARE = 20  # bits for errors of a step, and again for their sum
TERMS = 56


class Wrong(Exception):
    """The table violates its own statements."""


class Row(NamedTuple):
    """A polynomial 2^exponent sum_i a_i z^i."""

    name: str
    exponent: int
    a: tuple[int, ...]

    def __call__(self, z: Fraction) -> Fraction:
        """Return the value, exactly."""
        total = Fraction(0)
        for c in reversed(self.a):
            total = total * z + c
        scaled: Fraction = total * Fraction(2) ** self.exponent
        return scaled


def rows_of(file: Path) -> list[Row]:
    """Read the table, and check its digest and that no panel is left out."""
    named, *lines = [line for line in file.read_text(encoding="utf-8").splitlines() if not line.startswith("#")]
    if named != f"sha256 {hashlib.sha256(chr(10).join(lines).encode()).hexdigest()}":
        raise Wrong("the digest is not that of the rows")
    rows = []
    for number, line in enumerate(lines):
        name, panel, bound, exponent, *a = line.split()
        if int(panel) != number or name not in ("epsilon", "one_minus_epsilon"):
            raise Wrong(f"line {number + 1} is not that of panel {number}")
        if int(bound) * BOUND_UNIT > AGREED:
            raise Wrong(f"the bound of panel {panel} is more than {float(AGREED):g}")
        rows.append(Row(name, int(exponent), tuple(map(int, a))))
    if len(rows) != PANELS:
        raise Wrong(f"there are {len(rows)} rows: expected {PANELS}")
    return rows


def v_star_at(panel: int, z: Fraction) -> Fraction:
    """Return v* at a place of a panel, z = (v* - centre)/(half width)."""
    if panel == 0:
        return FIRST * z
    octave, part = divmod(panel - 1, TO_AN_OCTAVE)
    return FIRST * (1 << octave) * (1 + (2 * part + 1 + z) / (2 * TO_AN_OCTAVE))


# --- integration in time ----------------------------------------------------------------------------------------------


class Collision:
    """A collision in units of 2^-bits; all numbers are integers."""

    def __init__(self, v_star: Fraction) -> None:
        kappa = v_star**2
        # 1 - eps is about kappa if that is small, and eps about kappa^(-5/3) if it is large.
        self.bits = BITS + 2 * SPARE + 2 * (max(kappa, 1 / kappa).__floor__()).bit_length()
        self.one = 1 << self.bits
        self.kappa = round(kappa * self.one)

    def product(self, a: Sequence[int], b: Sequence[int]) -> int:
        """Return the last coefficient of the product of two polynomials of the same length."""
        return int(sum(map(mul, a, reversed(b)))) >> self.bits

    def series(self, r: int, w: int, step: int) -> tuple[list[int], list[int], list[int]]:
        """Return the Taylor coefficients of R, W and D in z, for s = s_0 + step z."""
        rs, ws, squares, ds = [r], [w], list[int](), list[int]()
        for n in range(TERMS):
            squares.append(self.product(rs, rs))
            ds.append(squares[n] + (self.kappa * ws[n] >> self.bits))
            change = self.product(squares, ds) * step >> self.bits
            rs.append((ws[n] * step >> self.bits) // (n + 1))
            ws.append(-2 * change // (n + 1))
        return rs, ws, ds

    def value(self, coefficients: Sequence[int], z: int) -> int:
        """Return a polynomial's value."""
        total = 0
        for c in reversed(coefficients):
            total = (total * z >> self.bits) + c
        return total

    def epsilon(self) -> Fraction:
        """Follow the collision to its end."""
        r, w = 0, self.one
        step = self.one >> max(self.kappa.bit_length() - self.bits, 0) // 3 + 2
        while True:
            rs, ws, ds = self.series(r, w, step)
            # |c_n| z^n < 2^SPARE units for the last coefficients of both series, so that steps may also grow.
            exponents = [(SPARE - abs(c).bit_length()) / n for series in (rs, ws) for n, c in [*enumerate(series)][-2:]]
            length = int(2.0 ** min(exponents) * 2**20)  # of z, in units of 2^-20
            z = length << self.bits - 20
            if self.is_over(rs, ws, ds, z):
                return self.at_end(rs, ws, ds, z)
            r, w = self.value(rs, z), self.value(ws, z)
            step = step * length >> 20

    def is_over(self, rs: Sequence[int], ws: Sequence[int], ds: Sequence[int], z: int) -> bool:
        """Return whether D = 0 lies behind: D < 0 after the turning point, and from R = 0 on perhaps no longer."""
        return self.value(ws, z) < 0 and (self.value(ds, z) < 0 or self.value(rs, z) < 0)

    def at_end(self, rs: Sequence[int], ws: Sequence[int], ds: Sequence[int], high: int) -> Fraction:
        """Return eps, given a z behind the end, by bisection."""
        low = 0
        while high - low > 1:
            middle = (low + high) // 2
            low, high = (low, middle) if self.is_over(rs, ws, ds, middle) else (middle, high)
        return Fraction(-self.value(ws, high), self.one)


def check(rows: Sequence[Row], points: int, start: int, only: int | None) -> Fraction:
    """Compare at random v* of random panels, or of one panel, and return the largest relative difference."""
    draw, worst = random.Random(start), Fraction(0)
    for _ in range(points):
        panel = draw.randrange(len(rows)) if only is None else only
        z = Fraction(draw.randint(-(2**52), 2**52), 2**52)
        if panel == 0:  # evenly in the logarithm of v*
            z = max(Fraction(2.0 ** draw.uniform(-32, 0)), LEAST / FIRST)
        v_star, row = v_star_at(panel, z), rows[panel]
        epsilon = Collision(v_star).epsilon()
        true = epsilon if row.name == "epsilon" else 1 - epsilon
        if true > Fraction(2, 3):
            raise Wrong(f"panel {panel}: {row.name} is not the smaller function")
        difference = abs(row(z) / true - 1)
        worst = max(worst, difference)
        if difference > AGREED:
            raise Wrong(f"panel {panel}, v* = {float(v_star)!r}: {row.name} differs by {float(difference):.2e}")
    return worst


def main() -> None:
    """Check the table given on the command line."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("file", type=Path)
    parser.add_argument("--points", type=int, default=2000, help="number of random v* (2000)")
    parser.add_argument("--start", type=int, default=0, help="of the random numbers (0)")
    parser.add_argument("--panel", type=int, help="the only panel (random ones)")
    options = parser.parse_args()
    try:
        rows = rows_of(options.file)
        worst = check(rows, options.points, options.start, options.panel)
    except Wrong as error:
        raise SystemExit(f"wrong: {options.file}: {error}") from None
    print(f"{options.file}: {len(rows)} panels, {options.points} collisions agree, the worst to {float(worst):.1e}")


if __name__ == "__main__":
    main()
