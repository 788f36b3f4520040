"""Padé from rounded data.

How wrong are eps and the poles of [m/m+3] if the coefficients h_k, or the printed a_i and b_i, have few digits?

Let a/b be the approximant of h and a~/b~ that of h + dh, N = 2m + 3, and [p]_N the terms of a polynomial up to v*^N.
Both meet the order conditions, so a~ b - a b~ = [b b~ dh]_N exactly. With |dh_l| <= u |h_l| this bounds the change of
eps, and of b~ at a pole of a/b; a polynomial of degree n has a root within n |b~/b~'| of any point. For the printed
digits a'/b' - a/b = (da - eps db)/b' exactly, with half a unit of the last digit of each coefficient; a_1 = b_1 as
printed count as one. Every system is solved in fractions, so the data have the only error.
"""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from decimal import ROUND_HALF_EVEN, Context
from fractions import Fraction
from typing import TYPE_CHECKING, NamedTuple

from flint import acb, acb_poly, arb, arb_poly

from viscopade.arithmetic.balls import ball_of, bits_for, working
from viscopade.plots.sheet import BLACK, BLUE, VERMILION
from viscopade.theory import paper
from viscopade.theory.pade import DOUBLET_TOLERANCE, Pade, Root, pade
from viscopade.theory.series import series
from viscopade_lab.hard_cases.case import Finding, Row
from viscopade_lab.hard_cases.exact_pade import rational_pade

if TYPE_CHECKING:
    from matplotlib.axes import Axes

QUICK, THOROUGH = (1, 3, 5, 7, 10, 13, 20), tuple(range(41))
"""The m of [m/m+3] in either run, chosen by hand; doublets appear at m = 6 (6 digits) and m = 23 (double)."""
V_STARS = tuple(Fraction(k, 5) for k in range(1, 26))
"""Where changes of eps are compared: 0.2 to 5 in steps of 0.2, chosen by hand around eps = 1/2 at v* = 0.8."""
DIGITS, DIGITS_PER_M = 50, 2
"""Digits of [m/m+3] are DIGITS + DIGITS_PER_M m: a doublet at v* = p has a residue as small as about p^(2m + 3).

30 digits for all m <= 20 change the 13th digit of the results (measured).
"""
PRINTED_SPEEDS = tuple(Fraction(10) ** k for k in range(-8, 4))
"""v* from 1e-8 to 1e3 for the printed table.

Beyond 1e-4 and 1e2 the results stay as they are (measured): only the lowest, or the highest, coefficients count there.
"""
PRINTED_DIGITS = 120
"""Of the approximant that the printed digits are compared with; 40 to 200 give the same result (measured)."""


def roundings(h: Sequence[Fraction]) -> dict[str, tuple[list[Fraction], Fraction]]:
    """Return the coefficients h_k rounded to 6 digits and to double, with the unit roundoff u: |dh_k| <= u |h_k|.

    Keys are the names that the table shows; values are (rounded h_k, u).
    """
    # Six digits are as many as the paper's table has. Half a unit of the last digit of 1.00000 is 5 10^-6 of it.
    six_digits = Context(prec=6, rounding=ROUND_HALF_EVEN)
    return {
        "6 digits": (
            [Fraction(six_digits.divide(h_k.numerator, h_k.denominator)) for h_k in h],
            Fraction(1, 2 * 10**5),
        ),
        # A double has 53 bits, and half a unit of the last is 2^-53 of a power of two.
        "double": ([Fraction(float(h_k)) for h_k in h], Fraction(1, 2**53)),
    }


class Change(NamedTuple):
    """Effect of rounding the h_k on [m/m+3].

    `pole` is the largest shift of a pole, relative to its modulus; `ratio` the largest quotient of a change of eps, or
    of a shift, by its bound.
    """

    pole: float
    ratio: float


def change(p: Pade, h: Sequence[Fraction], u: Fraction) -> Change:
    """Return how [m/m+3] of rounded data differs from `p`, that of the exact series.

    `h` are the rounded h_k, h_0 … h_(2m+3) or more, and `u` their unit roundoff. The bounds are those of the head of
    this file.
    """
    digits = DIGITS + DIGITS_PER_M * p.m
    q = rational_pade(h[: 2 * p.m + 4], p.m, p.n, digits)  # a~/b~ of the rounded series
    # Twice the bits of the digits are a choice; once and four times as many give the same numbers (measured).
    with working(2 * bits_for(digits)):
        (a, b), (a_q, b_q) = ((acb_poly(list(approximant.a)), acb_poly(list(approximant.b))) for approximant in (p, q))
        ratios = []
        for v_star in V_STARS:
            v = acb(ball_of(v_star))
            # eps~/eps - 1 = (a~ b - a b~)/(a b~), and |a~ b - a b~| = |[b b~ dh]_N| <= u sum_l |h_l v^l [b b~]_(N-l)|.
            error = _middle(abs(a_q(v) * b(v) / (b_q(v) * a(v)) - 1))
            ratios.append(error / _middle(ball_of(u) * _weight(b * b_q, p.h, v) / abs(a(v) * b_q(v))))
        shifts = [distance_to_nearest(pole, q.poles) for pole in p.poles]
        for pole, shift in zip(p.poles, shifts, strict=True):
            # At a pole b = 0, so that a b~ = -[b b~ dh]_N: this bounds |b~| there.
            x = pole.value
            b_q_bound = ball_of(u) * _weight(b * b_q, p.h, x) / abs(a(x))
            # b~ has a root within n |b~/b~'| of x; relative to |x|. Without a bound (b~' may be 0) nothing is compared.
            reach = p.n * b_q_bound / abs(b_q.derivative()(x)) / abs(x)
            ratios.append(shift / float(reach.upper()) if reach.is_finite() else 0.0)
    return Change(max(shifts), max(ratios))


def _middle(ball: arb) -> float:
    """Return the middle of a ball as a double."""
    return float(ball.mid())


def _weight(product: acb_poly, h: Sequence[arb], x: acb) -> arb:
    """Return sum_l |h_l x^l [product]_(N-l)(x)|, l = 0 … N, for h_0 … h_N; u times that bounds [product dh]_N(x).

    `product` is a polynomial, and [product]_k its terms up to x^k.
    """
    # truncations[k] = [product]_k(x)
    truncations, truncation, power = [], acb(0), acb(1)
    for k in range(len(h)):
        truncation += product[k] * power
        truncations.append(truncation)
        power *= x
    # Reversed, because h_l goes with N - l.
    sizes = (abs(h_l) * abs(x) ** k for k, h_l in enumerate(h))
    return sum((size * abs(value) for size, value in zip(sizes, reversed(truncations), strict=True)), arb(0))


def distance_to_nearest(pole: Root, roots: Iterable[Root]) -> float:
    """Return the distance from a pole to the nearest of some roots, divided by the pole's modulus."""
    centre = complex(pole.value)
    # In double precision the conjugate of the nearest, or its close neighbour, may seem as near: both are compared with
    # all digits.
    candidates = sorted(roots, key=lambda root: abs(complex(root.value) - centre))[:2]
    return min(_middle(abs(root.value - pole.value) / abs(pole.value)) for root in candidates)


def printed(m: int, n: int, a: Sequence[str], b: Sequence[str]) -> float:
    """Return the largest change of eps that printing the coefficients of [m/n] causes, divided by its bound.

    `a` and `b` are the printed decimals a_0 … a_m and b_0 … b_n. a_0, b_0 and zeros are exact: they have no last digit.
    """
    full = pade(m, n, PRINTED_DIGITS)
    # 64 bits (a machine word) more, for rounding.
    with working(bits_for(PRINTED_DIGITS) + 64):
        # Bounds of |da_i| and |db_i|: half a unit of the last printed digit, and 0 for exact coefficients.
        half_a, half_b = (
            [
                arb(0) if c.is_exact() else ball_of(Fraction(paper.last_digit(text)) / 2)
                for text, c in zip(decimals, coefficients, strict=True)
            ]
            for decimals, coefficients in ((a, full.a), (b, full.b))
        )
        printed_a, printed_b = ([ball_of(Fraction(text)) for text in decimals] for decimals in (a, b))
        # h_1 = 0 makes a_1 = b_1: as printed they have one error, da_1 = db_1.
        same_error = m > 0 and Fraction(a[1]) == Fraction(b[1])
        ratio = 0.0
        for v_star in PRINTED_SPEEDS:
            v = ball_of(v_star)
            eps = arb_poly(list(full.a))(v) / arb_poly(list(full.b))(v)
            # |b' (a'/b' - a/b)| = |da - eps db| <= sum |da_i| v^i + |eps| sum |db_i| v^i
            allowed = arb_poly(half_a)(v) + abs(eps) * arb_poly(half_b)(v)
            if same_error:
                # |da_1 - eps db_1| v <= (1 - eps) |db_1| v, instead of (1 + |eps|) |db_1| v
                allowed += half_b[1] * v * ((1 - eps) - 1 - abs(eps))
            denominator = arb_poly(printed_b)(v)
            difference = abs(arb_poly(printed_a)(v) / denominator - eps)
            ratio = max(ratio, float((difference * abs(denominator) / allowed).upper()))
    return ratio


def measure(thorough: bool) -> Finding:
    """Return the rows, words and picture of this case, for the m of `THOROUGH` or `QUICK` and the paper's table."""
    degrees = THOROUGH if thorough else QUICK
    # [m/m+3] takes h_0 … h_(2m+3); the series has the digits of the largest m.
    h = [Fraction(h_k) for h_k in series(2 * max(degrees) + 3, DIGITS + DIGITS_PER_M * max(degrees)).decimals()]
    exact = {m: rational_pade(h[: 2 * m + 4], m, m + 3, DIGITS + DIGITS_PER_M * m) for m in degrees}
    # "6 digits" or "double" -> m -> the change by this rounding
    changes = {name: {m: change(exact[m], *data) for m in degrees} for name, data in roundings(h).items()}
    return make_finding(changes, max(printed(m, n, *rows) for (m, n), rows in paper.TABLE.items()))


def make_finding(changes_by_rounding: dict[str, dict[int, Change]], table: float) -> Finding:
    """Return the rows, words and picture.

    `changes_by_rounding` maps "6 digits" or "double" to the change at each m; `table` is the largest change / its bound
    of the paper's printed table.
    """
    rows = [
        Row(f"h_k to {name}: change of eps and poles / its bound", max(c.ratio for c in changes.values()), 1)
        for name, changes in changes_by_rounding.items()
    ]
    rows.append(Row("the paper's table as printed: change of eps / its bound", table, 1))
    # The largest m such that no pole of this or a lower m moves by more than 1 %; -1 if the first does.
    trusted = {
        name: max(
            (m for m in changes if all(changes[k].pole <= DOUBLET_TOLERANCE for k in changes if k <= m)), default=-1
        )
        for name, changes in changes_by_rounding.items()
    }
    shift = f"largest m up to which all poles stay within {DOUBLET_TOLERANCE:.0%}"
    rows += [Row(f"h_k to {name}: {shift}", m) for name, m in trusted.items()]
    summary = (
        "High degrees need many digits: rounded coefficients h_k create spurious poles (Froissart doublets). Six "
        "digits suffice for a few degrees only, double precision for more. The paper's printed table is accurate "
        "enough: half a unit of each last digit accounts for the whole change of eps."
    )

    def draw(axes: Axes) -> None:
        """Draw the largest shift of a pole over m, a curve for each rounding, and the tolerance as a line."""
        for (name, changes), color, mark in zip(changes_by_rounding.items(), (VERMILION, BLUE), "os", strict=True):
            # Below u = 1e-16 of double shifts would only stretch the logarithmic axis; 0 has no place on it.
            shifts = [max(c.pole, 1e-18) for c in changes.values()]
            axes.semilogy(list(changes), shifts, color=color, marker=mark, markersize=3, label=f"$h_k$ to {name}")
        axes.axhline(DOUBLET_TOLERANCE, color=BLACK, linewidth=0.8, label=f"{DOUBLET_TOLERANCE:.0%}")
        axes.set(xlabel="$m$ of $[m/m+3]$", ylabel="largest relative shift of a pole")
        axes.legend(loc="lower right")

    return Finding(tuple(rows), summary, draw)
