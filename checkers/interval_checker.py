"""Check certificates of kernels in powers of a root by interval arithmetic of mpmath, without the package or FLINT.

    python checkers/interval_checker.py FILE.json …          (--every N: only each N-th part of the panels)

On a part of a panel, y = y_0 + h t, -1 <= t <= 1, the deviation is a power series in t with intervals for coefficients:
those of t^0 … at y_0, and the last one with y in its whole range (Lagrange's remainder). The reference is a text file
with polynomials for eps and 1 - eps and a bound of their relative errors, which is taken for granted.
"""

from __future__ import annotations

import json
import sys
from collections.abc import Sequence
from fractions import Fraction
from pathlib import Path
from typing import Any

from mpmath import iv

from certificate_checker import ERROR, LAST, REFERENCE, Wrong, number, panel_ends, rows

ORDER = 8
DEEPEST = 6
iv.prec = 160

Series = list[Any]  # ORDER + 1 coefficients


def interval(value: Fraction) -> Any:
    """Return an interval around a fraction."""
    return iv.mpf(value.numerator) / value.denominator


def constant(value: Any) -> Series:
    """Return the series of a constant."""
    return [iv.mpf(value), *[iv.mpf(0)] * ORDER]


def times(p: Series, q: Series) -> Series:
    """Return p q."""
    return [sum((p[i] * q[k - i] for i in range(k + 1)), iv.mpf(0)) for k in range(ORDER + 1)]


def over(p: Series, q: Series) -> Series:
    """Return p/q."""
    if 0 in q[0]:
        raise ZeroDivisionError
    result: Series = []
    for k in range(ORDER + 1):
        result.append((p[k] - sum((result[i] * q[k - i] for i in range(k)), iv.mpf(0))) / q[0])
    return result


def power(p: Series, exponent: Fraction) -> Series:
    """Return p^exponent: with f = p^e, p f' = e p' f."""
    if not p[0] > 0:
        raise ZeroDivisionError
    e = interval(exponent)
    result = [iv.exp(e * iv.log(p[0]))]
    for k in range(1, ORDER + 1):
        terms = (((e + 1) * i - k) * p[i] * result[k - i] for i in range(1, k + 1))
        result.append(sum(terms, iv.mpf(0)) / (k * p[0]))
    return result


def horner(coefficients: Sequence[Fraction], y: Series) -> Series:
    """Return the sum of a_i y^i."""
    total = constant(0)
    for c in reversed(coefficients):
        total = times(total, y)
        total[0] += interval(c)
    return total


def integer_power(y: Series, n: int) -> Series:
    """Return y^n."""
    result = constant(1)
    for _ in range(n):
        result = times(result, y)
    return result


class Checker:
    """A certificate of eps = D/(D + v*^2 N), or of v* = y^k N/D."""

    def __init__(self, entry: dict[str, Any]) -> None:
        self.kind, self.measure = entry["kind"], entry["measure"]
        self.root = Fraction(entry["root"])
        self.n, self.d = (self._dense(entry[e], entry[c]) for e, c in (("top", "a"), ("bottom", "b")))
        if entry["reference"] != REFERENCE or float.fromhex(entry["reference_error"]) != ERROR:
            raise Wrong("the reference is another one")
        if (self.kind, self.measure) not in {("halfline", "both"), ("inverse", "speed")}:
            raise Wrong(f"there is no measure {self.measure!r} of a kernel {self.kind!r}")
        self.bound, self.parts = Fraction(entry["bound"]), [(int(p), int(n)) for p, n in entry["parts"]]
        self.rows = rows(REFERENCE)
        self.end = LAST if entry["v_star_max"] is None else Fraction(entry["v_star_max"])
        self.r = 3 if self.kind == "halfline" else int(1 / (2 * self.root))

    @staticmethod
    def _dense(exponents: Sequence[int], coefficients: Sequence[str]) -> list[Fraction]:
        at_exponent = {e: number(c) for e, c in zip(exponents, coefficients, strict=True)}
        return [at_exponent.get(e, Fraction(0)) for e in range(max(exponents) + 1)]

    def check(self, spacing: int = 1, skipped: int = 0) -> int:
        """Check each `spacing`-th part after `skipped` ones. Return the number of all parts, or raise Wrong."""
        covered = [panel for panel, n in self.parts if n >= 1]
        needed = [p for p in range(217) if panel_ends(p)[0] < self.end]
        if covered != needed:
            raise Wrong("the parts do not cover the interval")
        checked = 0
        for panel, n in self.parts:
            low, centre, half = panel_ends(panel)
            high = min(self.end, centre + half)
            for i in range(n):
                if ((checked := checked + 1) - skipped) % spacing == 0:
                    start, width = low + (high - low) * Fraction(i, n), (high - low) / n
                    self.part(panel, start, start + width, 0)
        return checked

    def part(self, panel: int, low: Fraction, high: Fraction, depth: int) -> None:
        """Show the bound from `low` to `high` on a panel, on the halves if need be."""
        try:
            shown = all(bound <= interval(self.bound) for bound in self.deviations(panel, low, high))
        except ZeroDivisionError:
            shown = False
        if shown:
            return
        if depth == DEEPEST:
            raise Wrong(f"the bound is not shown at v* = {float(low):g}")
        middle = (low + high) / 2
        self.part(panel, low, middle, depth + 1)
        self.part(panel, middle, high, depth + 1)

    def deviations(self, panel: int, low: Fraction, high: Fraction) -> list[Any]:
        """Return the largest deviations there, one for each function that the measure has."""
        ends = [iv.exp(iv.log(interval(v)) / self.r) if v else iv.mpf(0) for v in (low, high)]
        whole = iv.mpf([ends[0].a, ends[1].b])
        centre = iv.mpf((whole.a + whole.b) / 2)
        half = iv.mpf(abs(whole - centre).b)
        at_centre, everywhere = ([y, half, *[iv.mpf(0)] * (ORDER - 1)] for y in (iv.mpf(centre.a), whole))
        bounds = []
        for function in self.functions(panel, low):
            terms = [*function(at_centre)[:ORDER], function(everywhere)[ORDER]]
            terms[0] -= 1
            largest = sum((abs(c) for c in terms), iv.mpf(0))
            bounds.append((largest + interval(ERROR)) / (1 - interval(ERROR)))
        return bounds

    def functions(self, panel: int, low: Fraction) -> list[Any]:
        """Return the quotients formula/truth, as functions of the series of y."""
        _, centre, half = panel_ends(panel)

        def row(name: str, y: Series, shift: int = 0) -> Series:
            z = integer_power(y, self.r)
            z[0] -= interval(centre)
            return horner(self.rows[name, panel][shift:], [c / interval(half) for c in z])

        def loss_ratio(y: Series) -> Series:
            if panel == 0:
                return [c / interval(half) ** 2 for c in row("one_minus_epsilon", y, 2)]
            return over(row("one_minus_epsilon", y), integer_power(y, 2 * self.r))

        def parts(y: Series) -> tuple[Series, Series]:
            d, n = horner(self.d, y), horner(self.n, y)
            return [a + b for a, b in zip(d, times(integer_power(y, 6), n), strict=True)], n

        def of_loss(y: Series) -> Series:
            total, n = parts(y)
            return over(over(n, total), loss_ratio(y))

        def of_epsilon(y: Series) -> Series:
            total, _ = parts(y)
            return over(over(horner(self.d, y), total), row("epsilon", y))

        def of_speed(y: Series) -> Series:
            uncertain = iv.mpf([1, 1]) + iv.mpf([-3, 3]) * interval(ERROR)
            ratio = [c * uncertain for c in over(loss_ratio(y), row("epsilon", y))]
            y_at_end = times(y, power(ratio, self.root))
            return times(power(ratio, Fraction(1, 2)), over(horner(self.n, y_at_end), horner(self.d, y_at_end)))

        if self.kind == "inverse":
            return [of_speed]
        return [of_epsilon, of_loss]


def check_file(path: Path, spacing: int = 1) -> list[str]:
    """Return one line for each certificate of a file, or raise `Wrong`."""
    lines = []
    for entry in json.loads(path.read_text())["certificates"]:
        parts = Checker(entry).check(spacing)
        checked = "all" if spacing == 1 else f"each {spacing}th"
        lines.append(f"{entry['name']} ({entry['type']}): {entry['bound']} holds, {checked} of {parts} parts")
    return lines


def main(arguments: list[str]) -> None:
    """Check files, and print the results."""
    spacing = int(arguments.pop(arguments.index("--every") + 1)) if "--every" in arguments else 1
    for argument in arguments:
        if argument != "--every":
            print("\n".join(check_file(Path(argument), spacing)), flush=True)


if __name__ == "__main__":
    try:
        main(sys.argv[1:])
    except Wrong as reason:
        sys.exit(f"wrong: {reason}")
