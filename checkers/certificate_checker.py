"""Check certificates of kernels by exact rational arithmetic.

    python checkers/certificate_checker.py FILE.json …

Independent of the package: nothing but Python's fractions, the certificate, and the reference, a text file with exact
polynomials for eps and 1 - eps on panels of v* and a bound of their relative errors. On every part of a panel it is
shown that D > 0 and that

    bound' D q - |N - D q| > 0,    q = eps, or the same with D - N and 1 - eps where that is smaller,

by the sum of the absolute values of a polynomial's coefficients on -1 <= t <= 1; parts are halved as far as needed.
"""

from __future__ import annotations

import json
import math
import sys
from collections.abc import Iterable, Iterator, Sequence
from fractions import Fraction
from itertools import zip_longest
from pathlib import Path
from typing import Any, NamedTuple

Coefficients = list[Fraction]
DATA = Path(__file__).parents[1] / "src" / "viscopade"
FIRST, PER_OCTAVE = -4, 8  # panel 0 is [0, 2^-4]; then eight to each octave
LAST = 2**23
REFERENCE, ERROR = "data/double.txt", Fraction(1, 2**60)
DEEPEST = 12  # times that a part may be halved


class Wrong(Exception):
    """The certificate does not prove its bound."""


def rows(name: str) -> dict[tuple[str, int], Coefficients]:
    """Read the reference: polynomials in z, |z| <= 1 on a panel."""
    table = {}
    for line in (DATA / name).read_text().splitlines():
        if not line.startswith("#"):
            function, panel, exponent, *a = line.split()
            table[function, int(panel)] = [Fraction(2) ** int(exponent) * int(c) for c in a]
    return table


def panel_ends(panel: int) -> tuple[Fraction, Fraction, Fraction]:
    """Return the least v*, the centre (z = 0) and the half width of a panel."""
    if panel == 0:
        return Fraction(0), Fraction(0), Fraction(2) ** FIRST
    octave, place = divmod(panel - 1, PER_OCTAVE)
    width = Fraction(2) ** (FIRST + octave) / PER_OCTAVE
    low = Fraction(2) ** (FIRST + octave) + place * width
    return low, low + width / 2, width / 2


class Polynomial(NamedTuple):
    """Coefficients over one common denominator > 0: reducing fractions would take most of the time."""

    numerators: list[int]
    denominator: int


def polynomial(coefficients: Iterable[Fraction | int]) -> Polynomial:
    """Return the polynomial with these coefficients."""
    exact = [Fraction(c) for c in coefficients]
    denominator = math.lcm(*(c.denominator for c in exact))
    return Polynomial([int(c * denominator) for c in exact], denominator)


def times(p: Polynomial, q: Polynomial) -> Polynomial:
    """Return p q."""
    product = [0] * (len(p.numerators) + len(q.numerators) - 1)
    for i, x in enumerate(p.numerators):
        for j, y in enumerate(q.numerators):
            product[i + j] += x * y
    return Polynomial(product, p.denominator * q.denominator)


def scaled(p: Polynomial, factor: Fraction | int) -> Polynomial:
    """Return factor p."""
    return times(p, polynomial([factor]))


def plus(p: Polynomial, q: Polynomial, sign: int = 1) -> Polynomial:
    """Return p + sign q."""
    denominator = math.lcm(p.denominator, q.denominator)
    x, y = (denominator // r.denominator for r in (p, q))
    pairs = zip_longest(p.numerators, q.numerators, fillvalue=0)
    return Polynomial([x * a + sign * y * b for a, b in pairs], denominator)


def shifted(p: Polynomial, centre: Fraction, half: Fraction) -> Polynomial:
    """Return p(centre + half t) as a polynomial in t: Horner's rule in (c + h t)/d."""
    (c, h), d = polynomial([centre, half])
    result, power = [0], 1
    for a in reversed(p.numerators):
        result = [c * x + h * y for x, y in zip([*result, 0], [0, *result], strict=True)]
        result[0] += a * power
        power *= d
    return Polynomial(result, p.denominator * power // d)


def positive(p: Polynomial) -> bool:
    """Whether p > 0 for -1 <= t <= 1 is shown by the coefficients."""
    return p.numerators[0] > sum(map(abs, p.numerators[1:]))


def within(top: Polynomial, bottom: Polynomial, q: Polynomial, bound: Fraction) -> bool:
    """Whether |top - bottom q| < bound bottom q and bottom q > 0 are shown."""
    product = times(bottom, q)
    difference, allowed = plus(top, product, -1), scaled(product, bound)
    return all(positive(plus(allowed, difference, sign)) for sign in (1, -1))


class Checker:
    """A certificate of a rational function with exact coefficients."""

    def __init__(self, entry: dict[str, Any]) -> None:
        self.a, self.b = (polynomial(number(c) for c in entry[name]) for name in "ab")
        self.measure = entry["measure"]
        if entry["v_star_max"] is None:
            raise Wrong("it is a certificate without an end")
        self.low, self.high = Fraction(entry["v_star_min"]), Fraction(entry["v_star_max"])
        self.parts = [(int(panel), int(n)) for panel, n in entry["parts"]]
        if self.measure not in ("both", "relative"):
            raise Wrong(f"the measure is {self.measure!r}")
        if not 0 <= self.low < self.high <= LAST:
            raise Wrong(f"the interval is not within [0, {LAST}]")
        if entry["reference"] != REFERENCE or float.fromhex(entry["reference_error"]) != ERROR:
            raise Wrong("the reference is another one")
        if any(n < 1 for _, n in self.parts):
            raise Wrong("a panel must have a part")
        self.bound = Fraction(entry["bound"])
        self.rows = rows(REFERENCE)
        self.checked = 0

    def check(self) -> int:
        """Return the number of parts after all halving.

        Raises
        ------
        Wrong
            If something is not shown.
        """
        if list(self.panels()) != [panel for panel, _ in self.parts]:
            raise Wrong("the parts do not cover the interval")
        for panel, n in self.parts:
            low, centre, half = panel_ends(panel)
            start, end = (max(self.low, low) - centre) / half, (min(self.high, centre + half) - centre) / half
            width = (end - start) / (2 * n)
            for i in range(n):
                self.part(panel, start + (2 * i + 1) * width, width, 0)
        return self.checked

    def panels(self) -> Iterator[int]:
        """Yield the panels that the interval has a part of."""
        panel = 0
        while panel_ends(panel)[0] < self.high:
            low, centre, half = panel_ends(panel)
            if centre + half > self.low and low < self.high:
                yield panel
            panel += 1

    def part(self, panel: int, z: Fraction, width: Fraction, depth: int) -> None:
        """Show the bound on centre + half (z + width t), |t| <= 1, of a panel, on its halves if need be."""
        if all(self.shown(function, panel, z, width) for function in self.functions(panel, z, width)):
            self.checked += 1
        elif depth == DEEPEST:
            raise Wrong(f"the bound is not shown on panel {panel} at z = {float(z)}")
        else:
            for side in (-1, 1):
                self.part(panel, z + side * width / 2, width / 2, depth + 1)

    def functions(self, panel: int, z: Fraction, width: Fraction) -> list[str]:
        """Return the reference of the relative deviation: "epsilon" unless certainly the larger, or vice versa."""
        if self.measure == "relative":
            return ["epsilon"]
        slack = Fraction(1, 10**6)
        low, high = (polynomial([Fraction(1, 2) + sign * slack]) for sign in (-1, 1))
        eps = shifted(polynomial(self.rows["epsilon", panel]), z, width)
        names = ["one_minus_epsilon"] if not positive(plus(low, eps, -1)) else []
        return names + (["epsilon"] if not positive(plus(eps, high, -1)) else [])

    def shown(self, function: str, panel: int, z: Fraction, width: Fraction) -> bool:
        """Whether the bound is shown on a part of a panel, relatively to one function."""
        _, centre, half = panel_ends(panel)
        top, bottom, row = self.a, self.b, self.rows[function, panel]
        if function == "one_minus_epsilon":
            top = plus(self.b, self.a, -1)
            if panel == 0:  # both sides are divisible by v*^2 = (half z)^2
                if any(top.numerators[:2]) or any(row[:2]):
                    raise Wrong("1 - N/D does not vanish like v*^2")
                top, row = top._replace(numerators=top.numerators[2:]), [c / half**2 for c in row[2:]]
        top, bottom = (shifted(p, centre + half * z, half * width) for p in (top, bottom))
        bound = (self.bound - ERROR) / (1 + ERROR)
        return positive(bottom) and within(top, bottom, shifted(polynomial(row), z, width), bound)


def number(text: str) -> Fraction:
    """Return a decimal or a hexadecimal number."""
    return Fraction(float.fromhex(text)) if "0x" in text else Fraction(text)


def check_file(path: Path) -> list[str]:
    """Return one line for each certificate of a file, or raise `Wrong`."""
    lines = []
    for entry in json.loads(path.read_text())["certificates"]:
        parts = Checker(entry).check()
        span = f"[{float(Fraction(entry['v_star_min'])):g}, {float(Fraction(entry['v_star_max'])):g}]"
        lines.append(f"{entry['name']} ({entry['type']}): {entry['bound']} on {span} holds, {parts} parts")
    return lines


def main(arguments: Sequence[str]) -> None:
    """Check files, and print the results."""
    for argument in arguments:
        print("\n".join(check_file(Path(argument))))


if __name__ == "__main__":
    try:
        main(sys.argv[1:])
    except Wrong as reason:
        sys.exit(f"wrong: {reason}")
