"""Check headers with tables over the bits of w = beta^5 v by exact rational arithmetic, without the package or FLINT.

    python checkers/table_checker.py HEADER.h … [--points POINTS.json]

The table and the bounds are read from the header's text, without knowledge of their origin:

- a row's polynomial is evaluated exactly at a point w, and compared with an enclosure of eps there;
- the operations of the C code are repeated with rounding to nearest, with and without fused ones, and the results are
  compared with the bounds that include rounding;
- polynomials must decrease (the Bernstein coefficients of the derivative are negative), and any increase of eps from
  one row to the next is computed exactly, for all rows.

The JSON file has a list of {"w": …, "epsilon": …, "one_minus_epsilon": …}: w a fraction, the others correctly rounded
decimals (`viscopade.collision.exact` or an integration with mpmath).
"""

from __future__ import annotations

import json
import re
import struct
import sys
from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from fractions import Fraction
from math import comb
from pathlib import Path
from typing import NamedTuple

SWITCH = Fraction(1, 8)  # below this w, rows are those of eps - 1
PRECISION = {"double": 53, "float": 24}
LEAST = {"double": Fraction(1, 2**1022), "float": Fraction(1, 2**126)}

Row = tuple[Fraction, ...]


class Wrong(Exception):
    """The header violates its own statements."""


# --- statements of the header -----------------------------------------------------------------------------------------


@dataclass(frozen=True)
class Header:
    """A table, and the bounds that its comment states.

    `full`: rows are high, low, a_1, … in m - (the row's middle), else c_0, c_1, … in m, or from there if `centred`.
    """

    name: str
    full: bool
    centred: bool
    number: str
    first: int
    octaves: int
    to_an_octave: int
    rows: tuple[Row, ...]
    bounds: dict[str, Fraction]

    def interval(self, index: int) -> tuple[int, Fraction, Fraction]:
        """Return the exponent and the ends of a row in m."""
        octave, place = divmod(index, self.to_an_octave)
        return self.first + octave, 1 + Fraction(place, self.to_an_octave), 1 + Fraction(place + 1, self.to_an_octave)

    def base(self, index: int) -> int:
        """Return the offset of a row's polynomial: 1 if its values are those of eps - 1, else 0."""
        exponent, low, _ = self.interval(index)
        return int(low * Fraction(2) ** exponent < SWITCH)

    def place(self, w: Fraction) -> tuple[int, Fraction]:
        """Return the row's number and m."""
        exponent = exponent_of(w)
        m = w / Fraction(2) ** exponent
        index = (exponent - self.first) * self.to_an_octave + int((m - 1) * self.to_an_octave)
        if not 0 <= index < len(self.rows):
            raise Wrong(f"w = {float(w):g} is not in the table")
        return index, m

    def polynomial(self, index: int) -> tuple[Row, Fraction]:
        """Return coefficients, and the point in m from where their variable counts."""
        row = self.rows[index]
        _, low, high = self.interval(index)
        coefficients = (row[0] + row[1], *row[2:]) if self.full else row
        return coefficients, (low + high) / 2 if self.full or self.centred else Fraction(0)

    def p(self, index: int, m: Fraction) -> Fraction:
        """Return a row's eps - base, exactly."""
        coefficients, origin = self.polynomial(index)
        total = Fraction(0)
        for c in reversed(coefficients):
            total = total * (m - origin) + c
        return total


_NUMBER = r"([0-9.]+(?:e-?[0-9]+)?)"
_STATED = {
    "first": r"for each e from (-?[0-9]+) to",
    "last": r"for each e from -?[0-9]+ to (-?[0-9]+)",
    "rows": r"([0-9]+) rows of coefficients for each e",
}
_ROUGH = {
    "error": rf"\|formula - eps\| / min\(eps, 1 - eps\) <= {_NUMBER} in the table",
    "double": rf"rounding of restitution: adds at most {_NUMBER} min\(eps, 1 - eps\) in type double",
    "rise": rf"to the next it rises by at most {_NUMBER} min\(eps, 1 - eps\)",
}
_FULL = {
    "ulp": rf"eps is off by at most {_NUMBER} units in the last place",
    "ulp_of_w": rf"what the rounding of w = beta\^5 speed does is at most {_NUMBER} ulp",
    "relative": rf"relative errors of at most {_NUMBER} in the table",
    "relative_of_w": rf"what the rounding of w does,? (?:is )?at most {_NUMBER}",
}


def read(text: str) -> Header:
    """Read a header's text."""
    table = re.search(
        r"VISCOPADE_TABLE (double|float) viscopade_table_(\w+)\[([0-9]+)\]\[([0-9]+)\] = \{\n(.*?)\n\};", text, re.S
    )
    if not table:
        raise Wrong("there is no table in the header")
    comment = re.sub(r"\s*\n \* *", " ", text[: table.start()])
    number, name, size, width, body = table.groups()
    full = "units in the last place (ulp) of eps(w)" in comment
    stated = {key: int(_found(pattern, comment)) for key, pattern in _STATED.items()}
    bounds = {key: Fraction(_found(pattern, comment)) for key, pattern in (_FULL if full else _ROUGH).items()}
    native = re.search(rf"and {_NUMBER} min\(eps, 1 - eps\) in type float", comment)
    if native:
        bounds["float"] = Fraction(native[1])
    # Rows in braces, each with a comma after it, and nothing else: several may be on a line.
    if not re.fullmatch(r"(?:\s*\{[^{}]*\},)+\s*", body):
        raise Wrong("the table has something else than rows in braces, each with a comma after it")
    rows = tuple(tuple(map(_literal, row.split(","))) for row in re.findall(r"\{([^{}]*)\}", body))
    octaves = stated["last"] - stated["first"] + 1
    if len(rows) != int(size) or len(rows) != octaves * stated["rows"] or {len(row) for row in rows} != {int(width)}:
        raise Wrong(f"the table has not {octaves} octaves of {stated['rows']} rows of {width} numbers")
    halves = "whose last coefficient begins with the last 32 bits of the one before" in comment
    rows = tuple(map(unpacked, rows)) if halves else rows
    if any(_bits(c) > PRECISION[number] or 0 < abs(c) < LEAST[number] for row in rows for c in row):
        raise Wrong(f"a coefficient is no normal number of type {number}")
    return Header(name, full, halves, number, stated["first"], octaves, stated["rows"], rows, bounds)


def _bits(number: Fraction) -> int:
    """Return how many bits a sum of powers of 2 has."""
    return (number.numerator // (number.numerator & -number.numerator or 1)).bit_length()


def unpacked(row: Row) -> Row:
    """Return a row with one coefficient more: the double that begins with the last 32 bits of the last word."""
    (last,) = struct.unpack("<d", bytes(4) + struct.pack("<d", float(row[-1]))[:4])
    return (*row, Fraction(last))


def _found(pattern: str, comment: str) -> str:
    match = re.search(pattern, comment)
    if not match:
        raise Wrong(f"the comment has no {pattern!r}")
    return match[1]


def _literal(text: str) -> Fraction:
    """Return the value of a hexadecimal constant of C, exactly."""
    match = re.fullmatch(r"\s*(-?)0x([01])(?:\.([0-9a-f]+))?p([+-][0-9]+)f?\s*", text)
    if not match:
        raise Wrong(f"{text!r} is no hexadecimal constant")
    sign, whole, digits, exponent = match.groups()
    digits = digits or ""
    shift = int(exponent) - 4 * len(digits)
    value = int(sign + whole + digits, 16)
    return Fraction(value << shift) if shift >= 0 else Fraction(value, 1 << -shift)


# --- machine arithmetic -----------------------------------------------------------------------------------------------


def exponent_of(number: Fraction) -> int:
    """Return e with 2^e <= |number| < 2^(e + 1)."""
    e = abs(number.numerator).bit_length() - number.denominator.bit_length()
    return e if abs(number) >= Fraction(2) ** e else e - 1


def ulp(number: Fraction, precision: int) -> Fraction:
    """Return a unit in the last place."""
    return Fraction(2) ** (exponent_of(number) - precision + 1)


def rounded(number: Fraction, precision: int) -> Fraction:
    """Return the nearest number of this precision, ties to even; exponents have no limits."""
    if not number:
        return number
    unit = ulp(number, precision)
    return round(number / unit) * unit


class Machine(NamedTuple):
    """Arithmetic of a type; `fused`: every product that is added to something is not rounded by itself."""

    kind: str
    fused: bool

    def round(self, number: Fraction) -> Fraction:
        """Return the nearest number of the type."""
        value = rounded(number, PRECISION[self.kind])
        if value and abs(value) < LEAST[self.kind]:
            raise Wrong(f"{float(number):g} is subnormal")
        return value

    def times_plus(self, a: Fraction, b: Fraction, c: Fraction) -> Fraction:
        """Return a b + c."""
        return self.round((a * b if self.fused else self.round(a * b)) + c)

    def in_pairs(self, c: Sequence[Fraction], x: Fraction, square: Fraction) -> Fraction:
        """Return (c_0 + x c_1) + x^2 ((c_2 + x c_3) + …), the last pair perhaps one number."""
        pairs = [self.times_plus(x, c[n + 1], c[n]) if n + 1 < len(c) else c[n] for n in range(0, len(c), 2)]
        total = pairs.pop()
        for pair in reversed(pairs):
            total = self.times_plus(square, total, pair)
        return total


class Results(NamedTuple):
    """Results of the three functions, and the w that they use."""

    w: Fraction
    restitution: Fraction
    rebound: Fraction
    dissipation: Fraction


def evaluate(header: Header, machine: Machine, speed: Fraction, beta: Fraction) -> Results:
    """Repeat the operations of the C code, for w in the table; of a table in double they are in double."""
    result_type, machine = machine, Machine("double", machine.fused) if header.number == "double" else machine
    r = machine.round
    b2 = r(beta * beta)
    w = r(r(r(b2 * b2) * beta) * speed)
    index, m = header.place(w)
    base, row, t = Fraction(header.base(index)), header.rows[index], m - header.polynomial(index)[1]
    if r(t) != t:
        raise Wrong("t is not exact")
    if header.full:
        rest = machine.times_plus(t, machine.in_pairs(row[2:], t, r(t * t)), row[1])
        head = r(base + row[0])
        lost = r(r(base - head) + row[0])
        p, eps = r(row[0] + rest), r(head + r(lost + rest))
    else:
        p = machine.in_pairs(row, t, r(t * t))
        eps = r(base + p)
    doubled = r(2 * base + p)
    loss = r((1 - base) - (p * doubled if machine.fused else r(p * doubled)))
    return Results(w, *map(result_type.round, (eps, r(eps * speed), loss)))


# --- checks -----------------------------------------------------------------------------------------------------------


class Point(NamedTuple):
    """Enclosures of eps and 1 - eps at w, each to its own relative accuracy."""

    w: Fraction
    epsilon: tuple[Fraction, Fraction]
    loss: tuple[Fraction, Fraction]

    def error(self, p: Fraction, base: int) -> Fraction:
        """Return the most by which base + p may be off."""
        ends = (-self.loss[0], -self.loss[1]) if base else self.epsilon
        return max(abs(p - end) for end in ends)

    @property
    def smaller(self) -> Fraction:
        """A lower bound of min(eps, 1 - eps)."""
        return min(self.epsilon[0], self.loss[0])

    def dissipation(self) -> tuple[Fraction, Fraction]:
        """Return the ends of 1 - eps^2 = (1 - eps) (2 - (1 - eps)), which grows with 1 - eps."""
        low, high = (x * (2 - x) for x in self.loss)
        return low, high


def point(w: Fraction, epsilon: str, one_minus_epsilon: str) -> Point:
    """Return the enclosures that correctly rounded decimals stand for."""
    return Point(w, _around(epsilon), _around(one_minus_epsilon))


def _around(text: str) -> tuple[Fraction, Fraction]:
    mantissa, _, exponent = text.lower().partition("e")
    digits = len(mantissa.partition(".")[2])
    half = Fraction(10) ** (int(exponent or 0) - digits) / 2
    return Fraction(text) - half, Fraction(text) + half


def share_of_formula(header: Header, exact: Point) -> Fraction:
    """Return the error of the row's exact value at w, as a part of the bound."""
    index, m = header.place(exact.w)
    base = header.base(index)
    error = exact.error(header.p(index, m), base)
    if not header.full:
        return error / exact.smaller / header.bounds["error"]
    least = exact.epsilon[0]
    return error / ulp(least, 53) / (header.bounds["ulp"] - Fraction(1, 2))


def shares_of_results(header: Header, machine: Machine, speed: Fraction, beta: Fraction, exact: Point) -> Results:
    """Return the errors of the three functions as parts of their bounds; `exact` is for the exact beta^5 speed.

    The first number is the error of w as a part of (1 + u)^5 - 1.
    """
    if exact.w != beta**5 * speed:
        raise Wrong("the enclosure is for another w")
    computed, unit = evaluate(header, machine, speed, beta), Fraction(1, 2 ** PRECISION[machine.kind])
    epsilon = max(abs(computed.restitution - end) for end in exact.epsilon)
    rebound = max(abs(computed.rebound / speed / end - 1) for end in exact.epsilon)
    dissipation = max(abs(computed.dissipation / end - 1) for end in exact.dissipation())
    bounds = header.bounds
    if header.full:
        # The first part is in units of eps at the rounded w, which may be beyond a power of two.
        at_rounded_w = ulp(exact.epsilon[1] * (1 + bounds["relative_of_w"]), 53)
        of_epsilon = bounds["ulp"] * at_rounded_w + bounds["ulp_of_w"] * ulp(exact.epsilon[0], 53)
        of_rebound = of_dissipation = bounds["relative"] + bounds["relative_of_w"]
    else:
        relative = bounds["error"] + bounds[machine.kind]
        of_epsilon = relative * exact.smaller + ulp(computed.restitution, PRECISION[machine.kind]) / 2
        of_rebound = of_dissipation = relative + 3 * unit  # three ulp are at least that
        if of_rebound > Fraction(1, 2):
            raise Wrong("the bound says nothing")
    change = (1 + unit) ** 5 - 1
    return Results(
        abs(computed.w / exact.w - 1) / change, epsilon / of_epsilon, rebound / of_rebound, dissipation / of_dissipation
    )


def falls(header: Header, index: int) -> bool:
    """Whether the row's polynomial certainly falls on its interval: Bernstein's coefficients of the derivative."""
    coefficients, origin = header.polynomial(index)
    _, low, high = header.interval(index)
    derivative = [n * c for n, c in enumerate(coefficients)][1:]
    start, width = low - origin, high - low
    moved = [
        sum((derivative[k] * comb(k, n) * start ** (k - n) for k in range(n, len(derivative))), Fraction(0)) * width**n
        for n in range(len(derivative))
    ]
    last = len(moved) - 1
    return all(sum(Fraction(comb(i, k), comb(last, k)) * moved[k] for k in range(i + 1)) < 0 for i in range(last + 1))


def rises(header: Header) -> Iterator[Fraction]:
    """Yield by how much eps rises from each row to the next, relative to the smaller of eps and 1 - eps."""
    for index in range(len(header.rows) - 1):
        before = header.p(index, header.interval(index)[2])
        after = header.p(index + 1, header.interval(index + 1)[1]) + header.base(index + 1) - header.base(index)
        yield (after - before) / min(abs(before), 1 - abs(before))


def check_signs(header: Header) -> None:
    """Every row's p has its sign and is at most a little more than 1/2, at both ends."""
    for index in range(len(header.rows)):
        sign = -1 if header.base(index) else 1
        for m in header.interval(index)[1:]:
            if not 0 < sign * header.p(index, m) < Fraction(53, 100):
                raise Wrong(f"row {index} of {header.name} is not eps - base")


def check_shape(header: Header) -> None:
    """Check all that needs no enclosures: signs, and for rough tables that eps falls."""
    check_signs(header)
    if header.full:
        return
    for index in range(len(header.rows)):
        if not falls(header, index):
            raise Wrong(f"row {index} of {header.name} does not fall")
    worst = max(rises(header))
    if worst > header.bounds["rise"]:
        raise Wrong(f"eps rises by {float(worst):g}, {float(header.bounds['rise']):g} is stated")


def check_points(header: Header, points: Sequence[Point]) -> Fraction:
    """Check rows at points; return the largest error as a part of the bound."""
    shares = [share_of_formula(header, exact) for exact in points]
    worst = max(shares)
    if worst > 1:
        exact = points[shares.index(worst)]
        raise Wrong(f"{header.name} at w = {float(exact.w):g}: the error is {float(worst):g} of its bound")
    return worst


def main(arguments: Sequence[str]) -> int:
    """Check files, and print the results."""
    names = list(arguments)
    points: list[Point] = []
    if "--points" in names:
        position = names.index("--points")
        _, file = names[position : position + 2]
        del names[position : position + 2]
        entries = json.loads(Path(file).read_text())
        points = [point(Fraction(x["w"]), x["epsilon"], x["one_minus_epsilon"]) for x in entries]
    for name in names:
        header = read(Path(name).read_text())
        check_shape(header)
        low, high = (Fraction(2) ** e for e in (header.first, header.first + header.octaves))
        inside = [x for x in points if low <= x.w < high]
        worst = f", {len(inside)} points: {float(check_points(header, inside)):.3f} of the bound" if inside else ""
        print(f"{header.name}: {len(header.rows)} rows{worst}")
    return 0


if __name__ == "__main__":
    try:
        sys.exit(main(sys.argv[1:]))
    except Wrong as reason:
        sys.exit(f"wrong: {reason}")
