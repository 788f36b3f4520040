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
    from matplotlib.axes import Axes

DIGITS = 30
"""Significant digits that `pade` is asked for: its default."""
QUICK, THOROUGH = (0, 1, 2, 3, 5, 7, 10, 13, 16, 20, 25), (*range(21), *range(25, 61, 5))
"""The m of [m/m+3] in either run, chosen by hand: dense where systems are small and fast, up to 25 or 60."""
LU_EXTRA_BITS = 10
"""Bits that mpmath's lu_solve adds to the precision of its context (its source: `ctx.prec += 10`)."""
GUARD_BITS = 200
"""Further bits where digits are counted, so that counting costs none; 0 to 200 give the same numbers at m = 25."""


class Lost(NamedTuple):
    """Decimal digits of the worst coefficient b_i of [m/m+3]: those that the series has, and those lost.

    Attributes
    ----------
    m : int
    chosen : int
        Digits of the least accurate h_k of the series that `pade` derived.
    condition : float
        Digits that rounding the h_k to `chosen` digits may cost: log10 of the condition number.
    lu : float
        Digits that LU decomposition in floating point loses.
    stated : float
        Digits by which the enclosures of `pade` are wider than those of the h_k.
    last : float
        Largest relative error of the b_i that `pade` prints to DIGITS digits, in units of 10^-DIGITS.
    """

    m: int
    chosen: int
    condition: float
    lu: float
    stated: float
    last: float

    @property
    def spare(self) -> int:
        """The digits that may be lost: those of the series beyond the DIGITS that are asked for."""
        return self.chosen - DIGITS


def lost_digits(m: int) -> Lost:
    """Return the digits that the linear system of [m/m+3] loses, measured in four ways."""
    # The system has the 2 m + 4 coefficients h_0 … h_(2m+3). As exact data they are rounded to `bits` bits.
    p = pade(m, m + 3, DIGITS)
    coefficient_count = 2 * m + 4
    chosen = relative_digits(p.h)
    bits = bits_for(chosen)
    h = [rounded(h_k, bits) for h_k in p.h[:coefficient_count]]
    # The solution of the same rounded system in fractions (first a, then b), and by LU decomposition of `bits` bits.
    exact_b = exact_solution(h, m, m + 3)[1]
    lu_b = lu([Fraction(int(h_k.p), int(h_k.q)) for h_k in h], m, bits)

    # The printed b_i against b_i of twice as many bits: the system loses a third of them (42 of 134 digits at m = 60),
    # so that more than `bits` remain.
    fine_b = lu([exact_middle(h_k) for h_k in p.h[:coefficient_count]], m, 2 * bits)
    printed_and_fine = zip(map(Fraction, p.decimals()[1]), fine_b, strict=True)
    fine_numbers = context(2 * bits)
    last = max(
        (float(abs(fine_numbers.mpf(x.numerator) / x.denominator / y - 1)) for x, y in printed_and_fine if x),
        default=0.0,
    )

    # Largest relative error of LU's b_i, and its digits: log10(error/2^-bits), or 0 if the error is below 2^-bits.
    ctx = context(bits + GUARD_BITS)
    lu_and_exact = zip(lu_b, exact_b, strict=True)
    error = float(max(abs(x * int(y.q) / ctx.mpf(int(y.p)) - 1) for x, y in lu_and_exact if y != 0))
    lu_loss = max(bits / BITS_PER_DIGIT + math.log10(error), 0.0) if error else 0.0
    condition = math.log10(condition_number(h, exact_b, m, bits))
    return Lost(m, chosen, condition, lu_loss, float(p.digits_lost), last * 10**DIGITS)


def rounded(ball: arb, bits: int) -> fmpq:
    """Return the ball's middle, rounded to the nearest number of `bits` bits (FLINT would round towards zero)."""
    middle = exact_middle(ball)
    # middle = n/2^k or n 2^k, so that this is the exponent e of 2^e <= |middle| < 2^(e+1), exactly.
    exponent = middle.numerator.bit_length() - middle.denominator.bit_length()
    # middle 2^(bits - 1 - e) has `bits` bits before its binary point.
    scale = Fraction(2) ** (bits - 1 - exponent)
    nearest = round(middle * scale) / scale
    return fmpq(nearest.numerator, nearest.denominator)


def condition_number(h: Sequence[fmpq], b: Sequence[fmpq], m: int, bits: int) -> float:
    """Return the largest sum_l |h_l/b_i db_i/dh_l| over the coefficients b_i of [m/m+3] that are not zero.

    `h` are h_0 … h_(2m+3), `b` the exact solution b_0 … b_(m+3), and `bits` those that h has. With A the matrix of the
    order conditions, A db = -sum_l dh_l (b_(k-l))_k, k = m+1 … 2m+3. Signs do not matter for sizes.
    """
    n = m + 3  # [m/m+3]
    # Four times the bits of h are a choice, as balls widen while the system is solved: at m = 25 bits + 64 to 8 bits
    # give the same.
    with working(4 * bits + GUARD_BITS):
        # Entries of A by rows; the last argument is the zero for h_k with k < 0.
        matrix, _ = order_system([arb(h_k) for h_k in h], m, n, arb(0))
        # Row k, column l: b_(k-l), or 0 outside b_0 … b_n.
        shifted = [
            arb(b[k - j]) if 0 <= k - j <= n else arb(0) for k in range(m + 1, m + n + 1) for j in range(m + n + 1)
        ]
        # Row i, column l: -db_(i+1)/dh_l; then sum_l |h_l db_(i+1)/dh_l|. b_0 = 1 does not change. "precond" multiplies
        # by an approximate inverse first, so that balls stay narrow.
        derivatives = arb_mat(n, n, matrix).solve(arb_mat(n, m + n + 1, shifted), algorithm="precond")
        changes = [sum((abs(derivatives[i, j] * h[j]) for j in range(m + n + 1)), arb(0)) for i in range(n)]
        return max(float((changes[i] / abs(arb(b[i + 1]))).upper()) for i in range(n) if b[i + 1] != 0)


def lu(h: Sequence[Fraction], m: int, bits: int) -> list[Any]:
    """Return b_0 … b_(m+3) of [m/m+3] as mpmath numbers, by LU decomposition in floating point of `bits` bits.

    `h` are h_0 … h_(2m+3).
    """
    # lu_solve adds LU_EXTRA_BITS to the precision: a context of fewer bits makes it work with `bits`.
    n, ctx = m + 3, context(bits - LU_EXTRA_BITS)
    numbers = [context(bits).mpf(h_k.numerator) / h_k.denominator for h_k in h]
    # Matrix (n n entries, row by row) and right side of the order conditions m+1 … 2m+3; b_0 = 1 is not unknown.
    entries, right = order_system(numbers, m, n, ctx.mpf(0))
    rows = [list(entries[i * n : (i + 1) * n]) for i in range(n)]
    return [ctx.mpf(1), *ctx.lu_solve(ctx.matrix(rows), ctx.matrix(right))]


def measure(thorough: bool) -> Finding:
    """Return the rows, words and picture of this case, for the m of `THOROUGH` or `QUICK`."""
    return make_finding([lost_digits(m) for m in (THOROUGH if thorough else QUICK)])


def make_finding(losses: Sequence[Lost]) -> Finding:
    """Return the rows, words and picture, from the digits lost at each m, ascending."""
    # Fields of `Lost` and how a row calls them: for each the m that comes closest to the digits to spare.
    ways = {
        "condition": "condition number of the system",
        "lu": "LU decomposition, in floating point",
        "stated": "enclosures of `pade`",
    }
    rows = []
    for way, words in ways.items():
        worst = max(losses, key=lambda loss: getattr(loss, way) / loss.spare)
        rows.append(Row(f"digits lost at m = {worst.m}: {words} / digits to spare", getattr(worst, way), worst.spare))
    # Correct rounding to DIGITS digits is half a unit of the last: relative to 1.000… that is 5 10^-DIGITS.
    last = max(loss.last for loss in losses)
    rows.append(Row(f"error of the printed b_i, in units of 1e-{DIGITS} (correct rounding: 5)", last, 5))
    m, condition_digits = [loss.m for loss in losses], [loss.condition for loss in losses]
    slope, end = np.polyfit(m, condition_digits, 1)[0], losses[-1]
    rows.append(Row("digits lost for each m (line through the condition numbers)", slope))
    rows.append(Row(f"digits of the series that `pade` derives at m = {end.m}, for {DIGITS} requested", end.chosen))
    summary = (
        "`pade` always has digits to spare. The linear system loses digits in proportion to m, as its condition number "
        "predicts. `pade` therefore derives the series with more digits than it prints. LU decomposition in floating "
        "point loses about as many digits, so no other algorithm would help."
    )

    def draw(axes: Axes) -> None:
        """Draw the digits to spare and those lost over m: condition number as a line, LU decomposition as points."""
        # Points have a size of 4, chosen by hand.
        spare, lu_digits = [loss.spare for loss in losses], [loss.lu for loss in losses]
        axes.plot(m, spare, color=BLACK, label=f"digits to spare, beyond the {DIGITS} requested")
        axes.plot(m, condition_digits, color=VERMILION, label="digits lost by the condition number")
        axes.plot(m, lu_digits, "o", color=BLUE, markersize=4, label="digits lost by LU decomposition")
        axes.set(xlabel="$m$ of $[m/m+3]$", ylabel="decimal digits")
        axes.legend(loc="upper left")

    return Finding(tuple(rows), summary, draw)
