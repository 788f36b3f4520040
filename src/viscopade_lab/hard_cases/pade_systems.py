"""Padé systems.

Does the working precision cover the digits that the linear system of [m/m+3] loses, whatever the algorithm?

The denominator b solves a linear system in the h_k that becomes ill-conditioned as m grows. Its condition number says
how many digits rounding the h_k can cost. LU decomposition and the Berlekamp-Massey recursion, which only adds,
multiplies and divides, are run in floating point at the precision that `pade` chose, against the solution in fractions.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from fractions import Fraction
from typing import TYPE_CHECKING, Any, NamedTuple

import numpy as np
from flint import arb, arb_mat, fmpq

from viscopade.arithmetic.balls import BITS_PER_DIGIT, bits_for, context, exact_middle, relative_digits, working
from viscopade.plots.sheet import BLACK, BLUE, GREEN, VERMILION
from viscopade.theory.pade import exact_solution, order_system, pade
from viscopade_lab.hard_cases.case import Finding, Row

if TYPE_CHECKING:
    from matplotlib.figure import Figure

DIGITS = 30
QUICK, THOROUGH = (0, 1, 2, 3, 5, 7, 10, 13, 16, 20, 25), (*range(21), *range(25, 61, 5))
LU_EXTRA_BITS = 10  # mpmath's lu_solve works with so many more than its context has


class Lost(NamedTuple):
    """Decimal digits of [m/m+3] in its worst coefficient of b: chosen by `pade` to derive, and lost in several ways.

    `stated` is what the enclosures of `pade` lost, `last` the error of its printed coefficients in units of
    10^-DIGITS.
    """

    m: int
    chosen: int
    condition: float
    lu: float
    recursion: float
    stated: float
    last: float

    @property
    def spare(self) -> int:
        """The digits that may be lost."""
        return self.chosen - DIGITS


def lost(m: int) -> Lost:
    """Measure one m."""
    p = pade(m, m + 3, DIGITS)
    chosen = relative_digits(p.h)
    bits = bits_for(chosen)
    h = [rounded(h_k, bits) for h_k in p.h[: 2 * m + 4]]
    exact, ctx = exact_solution(h, m, m + 3)[1], context(bits)
    numbers = [ctx.mpf(int(h_k.p)) / int(h_k.q) for h_k in h]
    by_lu, by_recursion = (solve(numbers, m, ctx.mpf(1)) for solve in (lu, berlekamp_massey))
    decimals = [context(2 * bits).mpf(text) for text in p.decimals()[1]]
    fine = berlekamp_massey([_mpf(context(2 * bits), h_k) for h_k in p.h[: 2 * m + 4]], m, context(2 * bits).mpf(1))
    last = max((float(abs(x / y - 1)) for x, y in zip(decimals, fine, strict=True) if x), default=0.0)
    condition = math.log10(condition_number(h, exact, m, bits))
    lu_lost, recursion_lost = (_digits_gone(b, exact, bits) for b in (by_lu, by_recursion))
    return Lost(m, chosen, condition, lu_lost, recursion_lost, float(p.digits_lost), last * 10**DIGITS)


def _mpf(ctx: Any, ball: arb) -> Any:
    middle = exact_middle(ball)
    return ctx.mpf(middle.numerator) / middle.denominator


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


def lu(h: Sequence[Any], m: int, one: Any) -> list[Any]:
    """Solve the linear system by mpmath's LU decomposition, without the ten bits that it adds to the precision."""
    n, ctx = m + 3, one.context
    entries, right = order_system(h, m, n, one - one)
    ctx.prec -= LU_EXTRA_BITS
    try:
        return [
            one,
            *ctx.lu_solve(ctx.matrix([list(entries[i * n : (i + 1) * n]) for i in range(n)]), ctx.matrix(right)),
        ]
    finally:
        ctx.prec += LU_EXTRA_BITS


def berlekamp_massey(h: Sequence[Any], m: int, one: Any) -> list[Any]:
    """Find the shortest linear recurrence of 0, 0, h_0, h_1, …, h_(2m+3); b are its coefficients."""
    zero = one - one
    s = [zero, zero, *h[: 2 * m + 4]]
    b, spare, length, gap, last = [one], [one], 0, 1, one
    for k in range(len(s)):
        discrepancy = sum((b[i] * s[k - i] for i in range(1, min(length + 1, len(b)))), s[k])
        if discrepancy != 0:
            shift = [*[zero] * gap, *(-discrepancy / last * x for x in spare)]
            size = max(len(b), len(shift))
            pairs = zip(*([*c, *[zero] * (size - len(c))] for c in (b, shift)), strict=True)
            if 2 * length <= k:
                length, spare, last, gap = k + 1 - length, b, discrepancy, 0
            b = [x + y for x, y in pairs]
        gap += 1
    return b[: m + 4] + [zero] * (m + 4 - len(b))


def _digits_gone(b: Sequence[Any], exact: Sequence[fmpq], bits: int) -> float:
    """Return the digits of the precision less those that are right in the worst coefficient."""
    ctx = context(bits + 200)
    pairs = [(ctx.mpf(x), ctx.mpf(int(y.p)) / int(y.q)) for x, y in zip(b, exact, strict=True) if y != 0]
    error = float(max(abs(x / y - 1) for x, y in pairs))
    return max(bits / BITS_PER_DIGIT + math.log10(error), 0.0) if error else 0.0


def measure(thorough: bool) -> Finding:
    """Measure all m."""
    return judged([lost(m) for m in (THOROUGH if thorough else QUICK)])


def judged(found: Sequence[Lost]) -> Finding:
    """Hold what is lost to what `pade` has to spare."""
    ways = {
        "condition": "condition number of the system",
        "lu": "LU decomposition, in floating point",
        "recursion": "Berlekamp-Massey, in floating point",
        "stated": "enclosures of `pade`",
    }
    rows = []
    for way, words in ways.items():
        worst = max(found, key=lambda one: getattr(one, way) / one.spare)
        rows.append(Row(f"digits lost at m = {worst.m}: {words} / digits to spare", getattr(worst, way), worst.spare))
    last = max(one.last for one in found)
    rows.append(Row(f"error of the printed b_i, in units of 1e-{DIGITS} (correct rounding: 5)", last, 5))
    m, lost_digits = [one.m for one in found], [one.condition for one in found]
    slope, start = np.polyfit(m, lost_digits, 1)
    end = found[-1]
    summary = (
        f"The system of [m/m+3] can lose about {slope:.2f} m {'-' if start < 0 else '+'} {abs(start):.1f} digits, "
        f"{end.condition:.1f} at m = {end.m}. There `pade` derives the series to {end.chosen} digits for {DIGITS} that "
        f"are asked for. The data decide, not the algorithm: at m = {end.m} LU decomposition loses {end.lu:.1f} "
        f"digits, and the Berlekamp-Massey recursion {end.recursion:.1f}."
    )

    def draw(figure: Figure) -> None:
        axes = figure.subplots()
        axes.plot(m, [one.spare for one in found], color=BLACK, label=f"digits to spare, beyond {DIGITS}")
        axes.plot(m, lost_digits, color=VERMILION, label="condition number")
        axes.plot(m, [one.lu for one in found], "o", color=BLUE, markersize=4, label="lost by LU")
        axes.plot(m, [one.recursion for one in found], "x", color=GREEN, markersize=5, label="lost by Berlekamp-Massey")
        axes.set(xlabel="$m$ of $[m/m+3]$", ylabel="decimal digits")
        axes.legend(loc="upper left", frameon=False, fontsize=9)

    return Finding(tuple(rows), summary, draw)
