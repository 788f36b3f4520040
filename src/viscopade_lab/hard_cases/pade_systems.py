"""Padé systems.

Does the working precision cover the digits that the linear system of [m/m+3] loses?

The denominator b solves a linear system in the h_k that becomes ill-conditioned as m grows. Its condition number bounds
the digits that rounding the h_k can cost, with any algorithm. LU decomposition runs in floating point at the precision
that `pade` chose, and is compared with the solution in fractions.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from fractions import Fraction
from typing import TYPE_CHECKING, Any, NamedTuple

import numpy as np
from flint import arb, arb_mat, fmpq

from viscopade.arithmetic.balls import BITS_PER_DIGIT, bits_for, context, exact_middle, relative_digits, working
from viscopade.plots.sheet import BLACK, BLUE, VERMILION
from viscopade.theory.pade import order_system, pade
from viscopade_lab.hard_cases.case import Finding, Row
from viscopade_lab.hard_cases.exact_pade import exact_solution

if TYPE_CHECKING:
    from matplotlib.figure import Figure

DIGITS = 30
QUICK, THOROUGH = (0, 1, 2, 3, 5, 7, 10, 13, 16, 20, 25), (*range(21), *range(25, 61, 5))
LU_EXTRA_BITS = 10  # mpmath's lu_solve works with so many more than its context has


class Lost(NamedTuple):
    """Decimal digits of the worst coefficient b_i of [m/m+3]: those that `pade` derives, and those lost.

    `stated` is the loss of the enclosures of `pade`, `last` the error of its printed coefficients in units of
    10^-DIGITS.
    """

    m: int
    chosen: int
    condition: float
    lu: float
    stated: float
    last: float

    @property
    def spare(self) -> int:
        """The digits that can be lost."""
        return self.chosen - DIGITS


def lost(m: int) -> Lost:
    """Measure one m."""
    p = pade(m, m + 3, DIGITS)
    chosen = relative_digits(p.h)
    bits = bits_for(chosen)
    h = [rounded(h_k, bits) for h_k in p.h[: 2 * m + 4]]
    exact = exact_solution(h, m, m + 3)[1]
    by_lu = lu([Fraction(int(h_k.p), int(h_k.q)) for h_k in h], m, bits)
    fine = lu([exact_middle(h_k) for h_k in p.h[: 2 * m + 4]], m, 2 * bits)
    pairs = zip(map(Fraction, p.decimals()[1]), fine, strict=True)
    last = max(
        (float(abs(context(2 * bits).mpf(x.numerator) / x.denominator / y - 1)) for x, y in pairs if x), default=0.0
    )
    ctx = context(bits + 200)
    right = zip(by_lu, exact, strict=True)
    error = float(max(abs(x * int(y.q) / ctx.mpf(int(y.p)) - 1) for x, y in right if y != 0))
    gone = max(bits / BITS_PER_DIGIT + math.log10(error), 0.0) if error else 0.0
    condition = math.log10(condition_number(h, exact, m, bits))
    return Lost(m, chosen, condition, gone, float(p.digits_lost), last * 10**DIGITS)


def rounded(ball: arb, bits: int) -> fmpq:
    """Return the ball's middle, rounded to the nearest number of `bits` bits (FLINT would round towards zero)."""
    middle = exact_middle(ball)
    exponent = middle.numerator.bit_length() - middle.denominator.bit_length()  # exact: it is a binary number
    scale = Fraction(2) ** (bits - 1 - exponent)
    nearest = round(middle * scale) / scale
    return fmpq(nearest.numerator, nearest.denominator)


def condition_number(h: Sequence[fmpq], b: Sequence[fmpq], m: int, bits: int) -> float:
    """Return the largest sum_l |h_l/b_i db_i/dh_l| over the coefficients b_i that are not zero.

    With A the matrix of the order conditions, A db = -sum_l dh_l (b_(k-l))_k, k = m+1 … 2m+3.
    """
    n = m + 3
    with working(4 * bits + 200):
        matrix, _ = order_system([arb(h_k) for h_k in h], m, n, arb(0))
        shifted = [
            arb(b[k - j]) if 0 <= k - j <= n else arb(0) for k in range(m + 1, m + n + 1) for j in range(m + n + 1)
        ]
        derivatives = arb_mat(n, n, matrix).solve(arb_mat(n, m + n + 1, shifted), algorithm="precond")
        changes = [sum((abs(derivatives[i, j] * h[j]) for j in range(m + n + 1)), arb(0)) for i in range(n)]
        return max(float((changes[i] / abs(arb(b[i + 1]))).upper()) for i in range(n) if b[i + 1] != 0)


def lu(h: Sequence[Fraction], m: int, bits: int) -> list[Any]:
    """Solve the linear system by mpmath's LU decomposition, without the ten bits that it adds to the precision."""
    n, ctx = m + 3, context(bits - LU_EXTRA_BITS)
    numbers = [context(bits).mpf(h_k.numerator) / h_k.denominator for h_k in h]
    entries, right = order_system(numbers, m, n, ctx.mpf(0))
    rows = [list(entries[i * n : (i + 1) * n]) for i in range(n)]
    return [ctx.mpf(1), *ctx.lu_solve(ctx.matrix(rows), ctx.matrix(right))]


def measure(thorough: bool) -> Finding:
    """Measure all m."""
    return judged([lost(m) for m in (THOROUGH if thorough else QUICK)])


def judged(found: Sequence[Lost]) -> Finding:
    """Compare the digits lost with the digits that `pade` has to spare."""
    ways = {
        "condition": "condition number of the system",
        "lu": "LU decomposition, in floating point",
        "stated": "enclosures of `pade`",
    }
    rows = []
    for way, words in ways.items():
        worst = max(found, key=lambda one: getattr(one, way) / one.spare)
        rows.append(Row(f"digits lost at m = {worst.m}: {words} / digits to spare", getattr(worst, way), worst.spare))
    last = max(one.last for one in found)
    rows.append(Row(f"error of the printed b_i, in units of 1e-{DIGITS} (correct rounding: 5)", last, 5))
    m, lost_digits = [one.m for one in found], [one.condition for one in found]
    slope, end = np.polyfit(m, lost_digits, 1)[0], found[-1]
    rows.append(Row("digits lost for each m (line through the condition numbers)", slope))
    rows.append(Row(f"digits of the series that `pade` derives at m = {end.m}, for {DIGITS} requested", end.chosen))
    summary = (
        "`pade` always has digits to spare. The linear system loses digits in proportion to m, as its condition number "
        "predicts. `pade` therefore derives the series with more digits than it prints. LU decomposition in floating "
        "point loses about as many digits, so no other algorithm would help."
    )

    def draw(figure: Figure) -> None:
        axes = figure.subplots()
        axes.plot(m, [one.spare for one in found], color=BLACK, label=f"digits to spare, beyond the {DIGITS} requested")
        axes.plot(m, lost_digits, color=VERMILION, label="digits lost by the condition number")
        axes.plot(m, [one.lu for one in found], "o", color=BLUE, markersize=4, label="digits lost by LU decomposition")
        axes.set(xlabel="$m$ of $[m/m+3]$", ylabel="decimal digits")
        axes.legend(loc="upper left")

    return Finding(tuple(rows), summary, draw)
