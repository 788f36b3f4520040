"""How many digits the linear system of [m/m+3] loses, by which algorithm, and whether enough were there to be lost.

Ways to the denominator b of an approximant: two solve the linear system, three only add, multiply and divide. Those
three are written once, for floating-point numbers, balls and fractions alike.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from fractions import Fraction
from functools import partial
from typing import Any, Literal

import numpy as np
from flint import arb, arb_mat, fmpq

from viscopade.arithmetic.balls import BITS_PER_DIGIT, bits_for, context, exact_middle, relative_digits, working
from viscopade.arithmetic.decimals import at_least, at_most
from viscopade.theory.pade import DegenerateError, Pade, exact_solution, order_system, pade
from viscopade_lab.hard_cases.finding import Case, Cell, Chart, Check, Outcome, ResultTable, curve, signed

DIGITS = 30
QUICK = (0, 1, 2, 3, 5, 7, 10, 13, 16, 20, 25)
THOROUGH = tuple(range(61))
EXACT_UP_TO = 7  # degrees m up to which the algorithms are compared in fractions
LU_EXTRA_BITS = 10  # mpmath's lu_solve works with so many more than its context has
# Where a low precision is compared with the full one, it has so many digits more than the system is to lose.
SPARE = 10
# To a bound of first order, terms of second order add a part of about 10^-SPARE; this is far more.
SECOND_ORDER = 1.01

Solver = Callable[[Sequence[Any], int, Any], list[Any]]
"""From h_0 … h_(2m+3), m and the number 1 to b_0 … b_(m+3)."""


# --- the algorithms ---------------------------------------------------------------------------------------------------


def euclid(h: Sequence[Any], m: int, one: Any) -> list[Any]:
    """Divide v*^(2m+4) and the series by one another until the remainder, a, has degree m; b is its cofactor.

    On the way lie the approximants with the same m + n. A step of more than one degree leaps over a block of equal
    ones: leading coefficients that are zero are no obstacle.
    """
    zero = one - one
    before, remainder = [*[zero] * (2 * m + 4), one], _trimmed(h[: 2 * m + 4])
    earlier, cofactor = [zero], [one]
    while len(remainder) > m + 1:
        quotient, rest = _divided(before, remainder)
        earlier, cofactor = cofactor, _plus(earlier, [-x for x in _times(quotient, cofactor)])
        before, remainder = remainder, _trimmed(rest)
    return _padded([x / cofactor[0] for x in cofactor], m + 4, zero)


def berlekamp_massey(h: Sequence[Any], m: int, one: Any) -> list[Any]:
    """Find the shortest linear recurrence of 0, 0, h_0, h_1, …, h_(2m+3); b are its coefficients.

    On the way lie the approximants with the same n - m. The length of the recurrence leaps over a block.
    """
    zero = one - one
    s = [zero, zero, *h[: 2 * m + 4]]
    b, spare, length, gap, last = [one], [one], 0, 1, one
    for k in range(len(s)):
        discrepancy = sum((b[i] * s[k - i] for i in range(1, min(length + 1, len(b)))), s[k])
        if not _vanishes(discrepancy):
            factor = -discrepancy / last
            corrected = _plus(b, [*[zero] * gap, *(factor * x for x in spare)])
            if 2 * length <= k:
                length, spare, last, gap = k + 1 - length, b, discrepancy, 0
            b = corrected
        gap += 1
    return _padded(b, m + 4, zero)


def quotient_difference(h: Sequence[Any], m: int, one: Any) -> list[Any]:
    """Find [m/m+3] by the quotient-difference algorithm, from the series of 1/eps.

    Directly it divides by h_1 = 0. But 1/eps = 1 - h_2 v*^2 + v*^4 c(v*), and [m/m+3] is the reciprocal of
    1 - h_2 v*^2 + v*^4 [m-1/m] of c, whose table has no such gaps.
    """
    zero = one - one
    f = reciprocal(h[: 2 * m + 4], one)
    numerator, denominator = _convergent(partial_quotients(f[4:], one), one) if m else ([zero], [one])
    return _padded(_plus(_times([f[0], zero, f[2]], denominator), [*[zero] * 4, *numerator]), m + 4, zero)


def reciprocal(h: Sequence[Any], one: Any) -> list[Any]:
    """Return the power series 1/h."""
    f = [one / h[0]]
    for k in range(1, len(h)):
        f.append(-sum((h[i] * f[k - i] for i in range(1, k + 1)), one - one) / h[0])
    return f


def partial_quotients(c: Sequence[Any], one: Any) -> list[Any]:
    """Return c_0, q_1, e_1, q_2, …: c = c_0/(1 - q_1 z/(1 - e_1 z/(1 - …))), by the rules of the rhombus."""
    quotients = [c[0]]
    q, e = [c[i + 1] / c[i] for i in range(len(c) - 1)], [one - one] * len(c)
    while q:
        quotients.append(q[0])
        e = [q[i + 1] - q[i] + e[i + 1] for i in range(len(q) - 1)]
        quotients += e[:1]
        q = [q[i + 1] * e[i + 1] / e[i] for i in range(len(e) - 1)]
    return quotients


def _convergent(quotients: Sequence[Any], one: Any) -> tuple[list[Any], list[Any]]:
    """Return numerator and denominator of c_0/(1 - q_1 z/(1 - e_1 z/…)), cut after the last quotient."""
    zero = one - one
    earlier, now = ([zero], [one]), ([quotients[0]], [one])
    for x in quotients[1:]:
        top, bottom = (_plus(new, [zero, *(-x * y for y in old)]) for new, old in zip(now, earlier, strict=True))
        earlier, now = now, (top, bottom)
    return now


def lu(h: Sequence[Any], m: int, one: Any) -> list[Any]:
    """Solve the linear system by mpmath's LU decomposition, without the ten bits that it adds to the precision."""
    n, ctx = m + 3, one.context
    entries, right = order_system(h, m, n, one - one)
    rows = [list(entries[i * n : (i + 1) * n]) for i in range(n)]
    ctx.prec -= LU_EXTRA_BITS
    try:
        return [one, *ctx.lu_solve(ctx.matrix(rows), ctx.matrix(right))]
    finally:
        ctx.prec += LU_EXTRA_BITS


def balls_solved(algorithm: Literal["lu", "precond"], h: Sequence[arb], m: int, one: arb) -> list[arb]:
    """Solve the linear system in balls by FLINT alone: LU decomposition ("lu"), or with a preconditioner ("precond").

    `pade` proves mpmath's solution with a preconditioner, too; what its enclosures lose is what it states.
    """
    n = m + 3
    entries, right = order_system(h, m, n, one - one)
    return [one, *arb_mat(n, n, entries).solve(arb_mat(n, 1, right), algorithm=algorithm).entries()]


FLOATING: dict[str, Solver] = {
    "LU": lu,
    "Euclid": euclid,
    "Berlekamp-Massey": berlekamp_massey,
    "QD": quotient_difference,
}
BALLS: dict[str, Solver] = {
    "preconditioned": partial(balls_solved, "precond"),
    "LU": partial(balls_solved, "lu"),
    "Euclid": euclid,
    "Berlekamp-Massey": berlekamp_massey,
    "QD": quotient_difference,
}


def _vanishes(number: Any) -> bool:
    """Whether a number is zero; of a ball, for certain (its `!=` asks whether it certainly is not)."""
    return bool(number == 0)


def _trimmed(c: Sequence[Any]) -> list[Any]:
    """Drop leading coefficients that are zero."""
    length = len(c)
    while length > 1 and _vanishes(c[length - 1]):
        length -= 1
    return list(c[:length])


def _padded(c: list[Any], length: int, zero: Any) -> list[Any]:
    return c[:length] + [zero] * (length - len(c))


def _plus(c: Sequence[Any], d: Sequence[Any]) -> list[Any]:
    if len(c) < len(d):
        c, d = d, c
    return [*(x + y for x, y in zip(c, d, strict=False)), *c[len(d) :]]


def _times(c: Sequence[Any], d: Sequence[Any]) -> list[Any]:
    product = [c[0] - c[0]] * (len(c) + len(d) - 1)
    for i, x in enumerate(c):
        for j, y in enumerate(d):
            product[i + j] = product[i + j] + x * y
    return product


def _divided(c: Sequence[Any], d: Sequence[Any]) -> tuple[list[Any], list[Any]]:
    """Return quotient and remainder of polynomials."""
    rest = list(c)
    quotient = []
    for shift in range(len(c) - len(d), -1, -1):
        quotient.append(rest.pop() / d[-1])
        for i, x in enumerate(d[:-1]):
            rest[shift + i] = rest[shift + i] - quotient[-1] * x
    return quotient[::-1], rest


# --- what is measured of one approximant ------------------------------------------------------------------------------


@dataclass(frozen=True)
class LostDigits:
    """Decimal digits that [m/m+3] loses, in its worst coefficient of b.

    Attributes
    ----------
    m, chosen : int
        Degree of the numerator; digits of the series that `pade` chose to derive.
    stated : int
        What `pade` says was lost.
    condition : float
        log10 of the condition number: what rounding h_k can cost at most, to first order.
    low : float
        Lost by LU decomposition at a low precision, against the b of `pade`.
    over_condition : float
        Error of the exact solution for h_k rounded to that low precision, in parts of what the condition allows.
    floating, balls : dict
        Lost by each algorithm at the chosen precision, against the exact solution; in balls by their own account,
        None if nothing was left.
    missed : int
        Balls that do not contain the exact number.
    unit_error : float
        Worst error of a printed coefficient, relative and in units of 10^-DIGITS, by Berlekamp-Massey.
    fraction_digits : int
        Digits of the longest numerator or denominator in the exact solution.
    """

    m: int
    chosen: int
    stated: int
    condition: float
    low: float
    over_condition: float
    floating: dict[str, float]
    balls: dict[str, float | None]
    missed: int
    unit_error: float
    fraction_digits: int


def lost_digits(m: int) -> LostDigits:
    """Measure everything for one m.

    Raises
    ------
    DegenerateError
        If [m/m+3] does not exist.
    """
    p = pade(m, m + 3, DIGITS)
    chosen = relative_digits(p.h)
    h = [rounded(h_k, bits_for(chosen)) for h_k in p.h[: 2 * m + 4]]
    exact = exact_solution(h, m, m + 3)[1]
    condition = condition_number(h, exact, m, bits_for(chosen))
    low, over_condition = _low_precision(p, condition)
    balls, missed = _in_balls(h, exact, bits_for(chosen))
    return LostDigits(
        m,
        chosen,
        p.digits_lost,
        math.log10(condition),
        low,
        over_condition,
        {name: digits_lost_by(solver, h, exact, bits_for(chosen)) for name, solver in FLOATING.items()},
        balls,
        missed,
        _unit_error(p, chosen),
        max(len(str(abs(part))) for b_i in exact for part in (b_i.p, b_i.q)),
    )


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


def digits_lost_by(solver: Solver, h: Sequence[fmpq], exact: Sequence[fmpq], bits: int) -> float:
    """Return the digits that an algorithm loses in floating-point numbers of so many bits, h being exact in them."""
    ctx = context(bits)
    b = solver([_number(ctx, h_k) for h_k in h], len(exact) - 4, ctx.mpf(1))
    return _digits_gone(_worst_error(b, exact, bits), bits)


def _digits_gone(error: float, bits: int) -> float:
    """Return the digits lost: those of the precision less those that are right; not below 0."""
    return max(bits / BITS_PER_DIGIT + math.log10(error), 0.0) if error else 0.0


def _worst_error(b: Sequence[Any], exact: Sequence[fmpq], bits: int) -> float:
    """Return the largest relative error of the coefficients that are not zero."""
    ctx = context(bits + 200)
    pairs = [(ctx.mpf(x), _number(ctx, y)) for x, y in zip(b, exact, strict=True) if y != 0]
    return float(max(abs(x / y - 1) for x, y in pairs))


def _number(ctx: Any, fraction: fmpq) -> Any:
    return ctx.mpf(int(fraction.p)) / int(fraction.q)


def _low_precision(p: Pade, condition: float) -> tuple[float, float]:
    """Return the digits that LU loses with SPARE digits more than the condition's, and what rounding h_k alone did."""
    bits = bits_for(math.ceil(math.log10(condition)) + SPARE)
    h = [rounded(h_k, bits) for h_k in p.h[: 2 * p.m + 4]]
    true = [_fraction(b_i) for b_i in p.b]
    ctx = context(bits)
    b = lu([_number(ctx, h_k) for h_k in h], p.m, ctx.mpf(1))
    by_rounding = _worst_error([_number(context(4 * bits), x) for x in exact_solution(h, p.m, p.n)[1]], true, bits)
    return _digits_gone(_worst_error(b, true, bits), bits), by_rounding / (condition * 2.0**-bits)


def _fraction(ball: arb) -> fmpq:
    middle = exact_middle(ball)
    return fmpq(middle.numerator, middle.denominator)


def _in_balls(h: Sequence[fmpq], exact: Sequence[fmpq], bits: int) -> tuple[dict[str, float | None], int]:
    """Return the digits that each algorithm loses in balls, and how many of them miss the exact number."""
    found: dict[str, float | None] = {}
    missed = 0
    for name, solver in BALLS.items():
        with working(bits):
            try:
                b = solver([arb(h_k) for h_k in h], len(exact) - 4, arb(1))
            except ZeroDivisionError:
                found[name] = None
                continue
        found[name] = _ball_digits_gone(b, exact, bits)
        with working(bits + 200):
            missed += sum(not x.contains(arb(y)) for x, y in zip(b, exact, strict=True))
    return found, missed


def _ball_digits_gone(b: Sequence[arb], exact: Sequence[fmpq], bits: int) -> float | None:
    left = min(
        (x.rel_accuracy_bits() for x, y in zip(b, exact, strict=True) if y != 0 and not x.is_exact()), default=bits
    )
    return max((bits - left) / BITS_PER_DIGIT, 0.0) if left > 0 else None


def _unit_error(p: Pade, chosen: int) -> float:
    """Return the worst relative error of the decimals of b, in units of 10^-DIGITS, by another algorithm."""
    ctx = context(2 * bits_for(chosen))
    b = berlekamp_massey([_number(ctx, _fraction(h_k)) for h_k in p.h[: 2 * p.m + 4]], p.m, ctx.mpf(1))
    pairs = [(ctx.mpf(x), y) for x, y in zip(p.decimals()[1], b, strict=True) if float(x) != 0]
    return float(max(abs(x / y - 1) for x, y in pairs) * 10**DIGITS)


def disagreements(m: int, h: Sequence[fmpq]) -> int:
    """Count the algorithms that, in fractions, do not give exactly the solution of the linear system."""
    exact = exact_solution(h, m, m + 3)[1]
    return sum(solver(h, m, fmpq(1)) != exact for solver in (euclid, berlekamp_massey, quotient_difference))


def breaks_down(h: Sequence[fmpq]) -> bool:
    """Whether the quotient-difference algorithm divides by zero if it is given the series itself."""
    try:
        partial_quotients(h, fmpq(1))
    except ZeroDivisionError:
        return True
    return False


# --- the case ---------------------------------------------------------------------------------------------------------


def _run(thorough: bool) -> Outcome:
    losses, refused = [], []
    for m in THOROUGH if thorough else QUICK:
        try:
            losses.append(lost_digits(m))
        except DegenerateError:
            refused.append(m)
    few = [_fraction(h_k) for h_k in pade(EXACT_UP_TO, EXACT_UP_TO + 3, DIGITS).h]
    different = sum(disagreements(m, few) for m in range(EXACT_UP_TO + 1))
    return Outcome(
        _summary(losses, refused, breaks_down(few)),
        (_needed(losses), _by_algorithm(losses)),
        (_floating_chart(losses), _ball_chart(losses)),
        _checks(losses, different),
    )


def slope(losses: Sequence[LostDigits]) -> tuple[float, float]:
    """Return c and d of the fitted loss c m + d."""
    c, d = np.polyfit([x.m for x in losses], [x.condition for x in losses], 1)
    return float(c), float(d)


def _summary(losses: Sequence[LostDigits], refused: Sequence[int], direct_fails: bool) -> str:
    last = losses[-1]
    c, d = slope(losses)
    least = min(losses, key=_reserve)
    excess = max(value - x.condition for x in losses for value in x.floating.values())
    least_lost, *_, most_lost = sorted(last.floating.items(), key=lambda item: item[1])
    first_without = {
        name: next((x.m for x in losses if x.balls[name] is None), None) for name in BALLS if name != "preconditioned"
    }
    others = min(last.chosen if x is None else x for name, x in last.balls.items() if name != "preconditioned")
    given_up = [f"{name} from m = {m} on" for name, m in first_without.items() if m is not None]
    return (
        f"The linear system of [m/m+3] can lose about {c:.2f} m {signed(d)} digits, {last.condition:.1f} at m = "
        f"{last.m}, where the series is derived to {last.chosen} digits for {DIGITS} that are asked for. The narrowest "
        f"reserve beyond both is {at_least(_reserve(least))} digits, at m = {least.m}. {_existence(refused)} In "
        f"floating point, from {least_lost[1]:.1f} ({least_lost[0]}) to {most_lost[1]:.1f} digits ({most_lost[0]}) are "
        f"lost at m = {last.m}, and at no m more than {at_most(excess, 2)} beyond the condition: the data decide, not "
        "the algorithm. In balls the algorithm decides: with exact data, FLINT's preconditioned solver "
        f"proves all but {at_most(max(x.balls['preconditioned'] or 0 for x in losses), 2)} digits at every m, while "
        f"the others lose at least {at_least(others)} at m = {last.m}; no digit is left by "
        f"{', '.join(given_up) or 'none of them'}. {_direct(direct_fails)} Fractions lose nothing, but at m = {last.m} "
        f"have up to {last.fraction_digits} digits."
    )


def _direct(fails: bool) -> str:
    if fails:
        return (
            "QD divides by h_1 = 0 if given the series itself; it is run on what remains of 1/eps after its first four "
            "terms, where nothing vanishes. The other two recursions leap over the gaps that h_1 = h_3 = 0 make."
        )
    return "QD takes the series itself."


def _existence(refused: Sequence[int]) -> str:
    if refused:
        return f"[m/m+3] does not exist for m = {', '.join(map(str, refused))}."
    return "Every [m/m+3] tried exists."


def _reserve(loss: LostDigits) -> float:
    return loss.chosen - DIGITS - loss.condition


def _cell(value: float | None) -> str:
    return "all" if value is None else f"{value:.1f}"


def _shown(losses: Sequence[LostDigits]) -> list[LostDigits]:
    """Return the rows that a table has room for."""
    return [x for x in losses if x.m <= 10 or x.m % 5 == 0] if len(losses) > 40 else list(losses)


def _needed(losses: Sequence[LostDigits]) -> ResultTable:
    header = (
        "m",
        "digits chosen",
        "condition",
        "reserve",
        "lost in balls, as pade says",
        "lost by LU at low precision",
    )
    rows = [
        (x.m, x.chosen, f"{x.condition:.1f}", f"{_reserve(x):.1f}", x.stated, f"{x.low:.1f}") for x in _shown(losses)
    ]
    return ResultTable(
        f"[m/m+3] to {DIGITS} digits: digits of the series, and digits that can be lost", header, tuple(rows)
    )


def _by_algorithm(losses: Sequence[LostDigits]) -> ResultTable:
    header = ("m", *FLOATING, *(f"balls: {name}" for name in BALLS), "digits of the fractions")
    rows: list[tuple[Cell, ...]] = [
        (
            x.m,
            *(_cell(x.floating[name]) for name in FLOATING),
            *(_cell(x.balls[name]) for name in BALLS),
            x.fraction_digits,
        )
        for x in _shown(losses)
    ]
    return ResultTable(
        "Digits lost by each algorithm at the precision chosen; balls by their own account", header, tuple(rows)
    )


def _floating_chart(losses: Sequence[LostDigits]) -> Chart:
    m = [x.m for x in losses]
    return Chart(
        "Floating point",
        "m of [m/m+3]",
        "digits lost",
        (
            *(curve(name, m, [x.floating[name] for x in losses], "points") for name in FLOATING),
            curve("condition: worst case", m, [x.condition for x in losses], "bound"),
            curve(f"chosen, less {DIGITS} asked for", m, [x.chosen - DIGITS for x in losses], "bound"),
        ),
        "linear",
        "linear",
    )


def _ball_chart(losses: Sequence[LostDigits]) -> Chart:
    m = [x.m for x in losses]
    proven = {name: [(x.m, x.balls[name]) for x in losses if x.balls[name] is not None] for name in BALLS}
    return Chart(
        "Balls: a curve ends where no digit is left",
        "m of [m/m+3]",
        "digits lost",
        (
            *(curve(name, [p for p, _ in points], [q for _, q in points]) for name, points in proven.items()),
            curve("digits chosen", m, [x.chosen for x in losses], "bound"),
        ),
        "linear",
        "linear",
    )


def _checks(losses: Sequence[LostDigits], different: int) -> tuple[Check, ...]:
    left = [x.chosen - value for x in losses for value in x.floating.values()]
    proven = [x.chosen - (math.inf if x.balls["preconditioned"] is None else x.balls["preconditioned"]) for x in losses]
    return (
        Check(
            "digits that `pade` chose, less those that the condition number allows to be lost: at least those "
            "asked for",
            min(x.chosen - x.condition for x in losses),
            ">=",
            DIGITS,
        ),
        Check("digits that `pade` chose, less those that each floating-point algorithm lost", min(left), ">=", DIGITS),
        Check(
            "digits that `pade` chose, less those that FLINT's preconditioned solver loses in ball arithmetic",
            min(proven),
            ">=",
            DIGITS,
        ),
        Check(
            f"largest relative error of the printed b_i, in units of 10^-{DIGITS}, where correct rounding allows 5",
            max(x.unit_error for x in losses),
            "<=",
            5.0,
        ),
        Check(
            "rounding h_k to a low precision changes b by no more than the condition number says (a bound of first "
            "order; 1 % covers the second)",
            max(x.over_condition for x in losses),
            "<=",
            SECOND_ORDER,
        ),
        Check.never("balls of any algorithm that do not contain the exact number", sum(x.missed for x in losses)),
        Check.never(
            f"algorithms that, in fractions, do not give the solution of the linear system, for m up to {EXACT_UP_TO}",
            different,
        ),
    )


CASE = Case(
    "pade-systems",
    "Padé systems up to [60/63]",
    "The linear system for the denominator of [m/m+3] becomes ill-conditioned as m grows. Does the working precision "
    "always cover the lost digits, and which algorithm loses fewest?",
    _run,
)
