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
    from matplotlib.figure import Figure

QUICK, THOROUGH = (1, 3, 5, 7, 10, 13, 20), tuple(range(41))
V_STARS = tuple(Fraction(k, 5) for k in range(1, 26))
DIGITS, DIGITS_PER_M = 50, 2  # a doublet at v* = p has a residue as small as about p^(2m + 3)
PRINTED_SPEEDS = tuple(Fraction(10) ** k for k in range(-8, 4))


def roundings(h: Sequence[Fraction]) -> dict[str, tuple[list[Fraction], Fraction]]:
    """Return the series rounded to few digits and to double, with the unit roundoff u: |dh_l| <= u |h_l|."""
    to = Context(prec=6, rounding=ROUND_HALF_EVEN)
    return {
        "6 digits": ([Fraction(to.divide(h_k.numerator, h_k.denominator)) for h_k in h], Fraction(1, 2 * 10**5)),
        "double": ([Fraction(float(h_k)) for h_k in h], Fraction(1, 2**53)),
    }


class Change(NamedTuple):
    """Effect of rounding h_k: the largest relative shift of a pole, and the largest change / its bound."""

    pole: float
    part: float


def change(p: Pade, h: Sequence[Fraction], u: Fraction) -> Change:
    """Compare [m/m+3] of rounded data with [m/m+3] of the exact series."""
    digits = DIGITS + DIGITS_PER_M * p.m
    q = rational_pade(h[: 2 * p.m + 4], p.m, p.n, digits)
    with working(2 * bits_for(digits)):
        (a, b), (_, b_q) = ((acb_poly(list(one.a)), acb_poly(list(one.b))) for one in (p, q))
        a_q = acb_poly(list(q.a))
        parts = []
        for v_star in V_STARS:
            v = acb(ball_of(v_star))
            error = _middle(abs(a_q(v) * b(v) / (b_q(v) * a(v)) - 1))
            parts.append(error / _middle(ball_of(u) * _weight(b * b_q, p.h, v) / abs(a(v) * b_q(v))))
        moved = [nearest(pole, q.poles) for pole in p.poles]
        for pole, distance in zip(p.poles, moved, strict=True):
            x = pole.value
            at_pole = ball_of(u) * _weight(b * b_q, p.h, x) / abs(a(x))
            reach = p.n * at_pole / abs(b_q.derivative()(x)) / abs(x)
            parts.append(distance / float(reach.upper()) if reach.is_finite() else 0.0)
    return Change(max(moved), max(parts))


def _middle(ball: arb) -> float:
    return float(ball.mid())


def _weight(product: acb_poly, h: Sequence[arb], x: acb) -> arb:
    """Return sum_l |h_l x^l [product]_(N-l)(x)|: u times that bounds [product dh]_N(x)."""
    sums, total, power = [], acb(0), acb(1)
    for k in range(len(h)):
        total += product[k] * power
        sums.append(total)
        power *= x
    sizes = (abs(h_l) * abs(x) ** k for k, h_l in enumerate(h))
    return sum((size * abs(term) for size, term in zip(sizes, reversed(sums), strict=True)), arb(0))


def nearest(pole: Root, others: Iterable[Root]) -> float:
    """Return the distance to the nearest of the others, divided by the pole's modulus."""
    place = complex(pole.value)
    # In double precision the conjugate of the nearest, or its close neighbour, may seem as near.
    candidates = sorted(others, key=lambda other: abs(complex(other.value) - place))[:2]
    return min(_middle(abs(other.value - pole.value) / abs(pole.value)) for other in candidates)


def printed(m: int, n: int, a: Sequence[str], b: Sequence[str]) -> float:
    """Return the largest change of eps by printing, divided by its bound.

    The coefficients a_0, b_0 and zeros are exact: they have no last digit.
    """
    full = pade(m, n, 120)
    with working(bits_for(120) + 64):
        halves = [
            [
                arb(0) if c.is_exact() else ball_of(Fraction(paper.last_digit(text)) / 2)
                for text, c in zip(*pair, strict=True)
            ]
            for pair in ((a, full.a), (b, full.b))
        ]
        tops, bottoms = ([ball_of(Fraction(text)) for text in row] for row in (a, b))
        alike = m > 0 and Fraction(a[1]) == Fraction(b[1])
        part = 0.0
        for v_star in PRINTED_SPEEDS:
            v = ball_of(v_star)
            own = arb_poly(list(full.a))(v) / arb_poly(list(full.b))(v)
            allowed = arb_poly(halves[0])(v) + abs(own) * arb_poly(halves[1])(v)
            if alike:  # both are rounded alike: (1 - eps) v* times the error of one
                allowed += halves[1][1] * v * ((1 - own) - 1 - abs(own))
            bottom = arb_poly(bottoms)(v)
            difference = abs(arb_poly(tops)(v) / bottom - own)
            part = max(part, float((difference * abs(bottom) / allowed).upper()))
    return part


def measure(thorough: bool) -> Finding:
    """Round the series and the paper's table."""
    degrees = THOROUGH if thorough else QUICK
    h = [Fraction(h_k) for h_k in series(2 * max(degrees) + 3, DIGITS + DIGITS_PER_M * max(degrees)).decimals()]
    exact = {m: rational_pade(h[: 2 * m + 4], m, m + 3, DIGITS + DIGITS_PER_M * m) for m in degrees}
    found = {name: {m: change(exact[m], *data) for m in degrees} for name, data in roundings(h).items()}
    return judged(found, max(printed(m, n, *rows) for (m, n), rows in paper.TABLE.items()))


def judged(found: dict[str, dict[int, Change]], table: float) -> Finding:
    """Compare all changes with their bounds."""
    rows = [
        Row(f"h_k to {name}: change of eps and poles / its bound", max(one.part for one in changes.values()), 1)
        for name, changes in found.items()
    ]
    rows.append(Row("the paper's table as printed: change of eps / its bound", table, 1))
    trusted = {
        name: max(
            (m for m in changes if all(changes[k].pole <= DOUBLET_TOLERANCE for k in changes if k <= m)), default=-1
        )
        for name, changes in found.items()
    }
    shift = f"largest m up to which all poles stay within {DOUBLET_TOLERANCE:.0%}"
    rows += [Row(f"h_k to {name}: {shift}", m) for name, m in trusted.items()]
    summary = (
        "High degrees need many digits: rounded coefficients h_k create spurious poles (Froissart doublets). Six "
        "digits suffice for a few degrees only, double precision for more. The paper's printed table is accurate "
        "enough: half a unit of each last digit accounts for the whole change of eps."
    )

    def draw(figure: Figure) -> None:
        axes = figure.subplots()
        for (name, changes), color, mark in zip(found.items(), (VERMILION, BLUE), "os", strict=True):
            moved = [max(one.pole, 1e-18) for one in changes.values()]
            axes.semilogy(list(changes), moved, color=color, marker=mark, markersize=3, label=f"$h_k$ to {name}")
        axes.axhline(DOUBLET_TOLERANCE, color=BLACK, linewidth=0.8, label=f"{DOUBLET_TOLERANCE:.0%}")
        axes.set(xlabel="$m$ of $[m/m+3]$", ylabel="largest relative shift of a pole")
        axes.legend(loc="lower right")

    return Finding(tuple(rows), summary, draw)
