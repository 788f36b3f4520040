r"""The paper's printed digits: what rounding the coefficients of tab:padeCoeffs does to eps, 1 - eps, poles and zeros.

Let a' = a + da and b' = b + db be the polynomials as printed. With eps = a/b,

    a'/b' - a/b = (da - eps db)/b'    exactly,

a sum over coefficients. Half a unit of the last printed digit of each, and b' from below by the same, bound it. a_0,
b_0 and the zeros in the table are exact. Where a_1 = b_1 as printed, both are rounded alike and count as one: (1 - eps)
v* times the error of a_1. Were they not equal, 1 - eps, which is of order v*^2, would be wrong by a multiple of v*.

A root r of b moves by n |b'(r)|/|slope of b' at r| at most, n being the degree: so near to any r a polynomial of degree
n has a zero.
"""

from __future__ import annotations

import math
from collections.abc import Iterator, Mapping, Sequence
from decimal import Decimal
from fractions import Fraction
from functools import lru_cache
from typing import NamedTuple

from flint import acb, acb_poly, arb, arb_poly, fmpq, fmpq_poly

from viscopade.arithmetic.balls import ball_of, bits_for, working
from viscopade.arithmetic.decimals import at_most
from viscopade.collision import exact
from viscopade.progress import track
from viscopade.theory import paper
from viscopade.theory.pade import Pade, Root, exact_roots, pade
from viscopade_lab.hard_cases.finding import Case, Cell, Chart, ChartCurve, Check, Outcome, ResultTable, curve

DIGITS = 120  # [3/6] itself is off by 1e-80 at v* = 1e-8, of 1 - eps = 1e-16
BITS = bits_for(DIGITS) + 64
DECADES = (-8, 3)
A_DECADE = {False: 2, True: 16}
TABLE_SPEEDS = ("1e-8", "1e-4", "0.01", "0.1", "0.5", "1", "2", "10", "100", "1000")
RANKED_SPEEDS = ("1e-4", "0.1", "1", "3", "10", "1000")
EXAMPLE = "[3/6]"


class PrintedPade(NamedTuple):
    """An approximant as printed beside the full one."""

    full: Pade
    a: tuple[Fraction, ...]
    b: tuple[Fraction, ...]
    half_a: tuple[Fraction, ...]
    """Half a unit of the last digit printed; 0 where the number is exact."""
    half_b: tuple[Fraction, ...]

    @property
    def a_1(self) -> Fraction:
        """Coefficient a_1, which [0/n] does not have."""
        return self.a[1] if len(self.a) > 1 else Fraction(0)


@lru_cache(maxsize=1)
def approximants() -> tuple[PrintedPade, ...]:
    """Return all of the paper's table."""
    return tuple(printed_pade(pade(m, n, DIGITS), *rows) for (m, n), rows in paper.TABLE.items())


def printed_pade(full: Pade, a: Sequence[str], b: Sequence[str]) -> PrintedPade:
    """Return an approximant with these decimals as its coefficients."""
    half_a, half_b = (
        tuple(Fraction(0) if exactly.is_exact() else _half_unit(text) for text, exactly in zip(row, own, strict=True))
        for row, own in ((a, full.a), (b, full.b))
    )
    return PrintedPade(full, tuple(map(Fraction, a)), tuple(map(Fraction, b)), half_a, half_b)


def _half_unit(text: str) -> Fraction:
    return Fraction(paper.last_digit(text)) / 2


# --- errors at one v* -------------------------------------------------------------------------------------------------


class PrintingErrors(NamedTuple):
    """What printing changes at one v*, and the full approximant's own errors; all relative."""

    epsilon: float
    loss: float
    """Of 1 - eps."""
    epsilon_bound: float
    loss_bound: float
    own_epsilon: float
    own_loss: float
    used: float
    """The change as a part of its bound, rounded up."""
    loss_if_unequal: float
    """The change of 1 - eps, were a_1 printed one unit greater and b_1 not."""
    parts: Mapping[str, float]
    """What half a unit of each coefficient changes in eps, by name."""


@lru_cache(maxsize=4096)
def _exactly(v_star: str) -> tuple[arb, arb]:
    """Return eps and 1 - eps: the smaller v*, the more digits, as own errors of 1 - eps fall like v*^8."""
    found = exact.collision(v_star, 20 + 10 * max(-Decimal(v_star).adjusted(), 0))
    return found.epsilon, found.one_minus_epsilon


def errors(given: PrintedPade, v_star: str) -> PrintingErrors:
    """Compare the printed approximant with the full one, and that with the exact function."""
    truth = _exactly(v_star)
    full = given.full
    with working(BITS):
        v = ball_of(Fraction(v_star))
        a, b = ([ball_of(c) for c in row] for row in (given.a, given.b))
        bottom, own_bottom = _at(b, v), _at(full.b, v)
        loss, own_loss = _at(_difference(b, a), v) / bottom, _at(_difference(full.b, full.a), v) / own_bottom
        own = _at(full.a, v) / own_bottom
        change, parts, size = abs(loss - own_loss), _parts(given, v, own), abs(own)
        bound = sum(parts.values(), arb(0)) / (own_bottom - _at([ball_of(c) for c in given.half_b], v))
        unequal = abs(loss - ball_of(_one_unit(given)) * v / bottom - own_loss)
        return PrintingErrors(
            _middle(change / size),
            _middle(change / own_loss),
            _middle(bound / size),
            _middle(bound / own_loss),
            _middle(abs(own / truth[0] - 1)),
            _middle(abs(own_loss / truth[1] - 1)),
            float((change / bound).upper()),
            _middle(unequal / own_loss),
            {name: _middle(part / own_bottom / size) for name, part in parts.items()},
        )


def _middle(ball: arb) -> float:
    return float(ball.mid())


def _at(c: Sequence[arb], v: arb) -> arb:
    return arb_poly(list(c))(v)


def _difference(b: Sequence[arb], a: Sequence[arb]) -> list[arb]:
    return [b_k - (a[k] if k < len(a) else 0) for k, b_k in enumerate(b)]


def _one_unit(given: PrintedPade) -> Fraction:
    return 2 * given.half_a[1] if len(given.a) > 1 else Fraction(0)


def _parts(given: PrintedPade, v: arb, eps: arb) -> dict[str, arb]:
    """Return how much half a unit of each printed coefficient may change da - eps db."""
    alike = given.a_1 == given.b[1]
    parts = {}
    for symbol, halves, factor in (("a", given.half_a, arb(1)), ("b", given.half_b, abs(eps))):
        for k, half in enumerate(halves):
            if half and not (alike and k == 1):
                parts[f"{symbol}_{k}"] = ball_of(half) * factor * v**k
    if alike and given.half_b[1]:
        parts["a_1 = b_1"] = ball_of(given.half_b[1]) * (1 - eps) * v
    return parts


# --- poles and zeros --------------------------------------------------------------------------------------------------


class MovedRoot(NamedTuple):
    """A pole or zero of the full approximant, and the nearest one of the printed; moduli of their distance."""

    label: str
    kind: str
    root: Root
    by: float
    bound: float
    used: float


def moved_roots(given: PrintedPade) -> Iterator[MovedRoot]:
    """Yield all poles and zeros in the closed upper half-plane."""
    sides = (
        ("zero", given.full.zeros, given.a, given.full.a, given.half_a),
        ("pole", given.full.poles, given.b, given.full.b, given.half_b),
    )
    with working(BITS):
        for kind, roots, c, own, halves in sides:
            there = [root.value for root in _roots(c)]
            for root in roots:
                if root.real or root.value.imag > 0:
                    distance = min((abs(root.value - value) for value in there), key=lambda x: float(x.mid()))
                    bound = _shift_bound(root.value, own, halves, len(there))
                    part = float((distance / bound).upper())
                    yield MovedRoot(given.full.label, kind, root, float(distance.mid()), float(bound.mid()), part)


def _roots(c: Sequence[Fraction]) -> tuple[Root, ...]:
    polynomial = fmpq_poly([fmpq(c_k.numerator, c_k.denominator) for c_k in c])
    return exact_roots(polynomial) if polynomial.degree() > 0 else ()


def _shift_bound(root: acb, own: Sequence[arb], halves: Sequence[Fraction], degree: int) -> arb:
    size = abs(root)
    value = sum((ball_of(half) * size**k for k, half in enumerate(halves)), arb(0))
    slope = sum((k * ball_of(half) * size ** (k - 1) for k, half in enumerate(halves) if k), arb(0))
    return degree * value / (abs(acb_poly(list(own)).derivative()(root)) - slope)


def positive(given: PrintedPade) -> tuple[tuple[int, int], tuple[int, int]]:
    """Return how many positive real zeros and poles the full and the printed approximant have."""
    with working(BITS):
        as_printed = [sum(root.positive for root in _roots(c)) for c in (given.a, given.b)]
    full = [sum(root.positive for root in roots) for roots in (given.full.zeros, given.full.poles)]
    return (full[0], full[1]), (as_printed[0], as_printed[1])


# --- the finding ------------------------------------------------------------------------------------------------------


def v_star_grid(a_decade: int) -> list[str]:
    """Return decimals, evenly spaced in their logarithms."""
    first, last = DECADES
    return [f"{10 ** (first + i / a_decade):.6g}" for i in range((last - first) * a_decade + 1)]


def run(thorough: bool) -> Outcome:
    """Compare all four approximants over eleven decades of v*."""
    grid = v_star_grid(A_DECADE[thorough])
    found: dict[str, dict[str, PrintingErrors]] = {p.full.label: {} for p in approximants()}
    wanted = sorted({*grid, *TABLE_SPEEDS, *RANKED_SPEEDS}, key=float)
    for i in track(range(len(wanted)), "speeds"):
        for p in approximants():
            found[p.full.label][wanted[i]] = errors(p, wanted[i])
    roots = [m for p in approximants() for m in moved_roots(p)]
    return Outcome(
        _summary(found, grid, roots),
        (_error_table(found), _part_table(found), _root_table(roots)),
        tuple(_charts(found, grid)),
        _checks(found, roots),
    )


def _checks(found: dict[str, dict[str, PrintingErrors]], roots: Sequence[MovedRoot]) -> tuple[Check, ...]:
    entries = paper.compare(p.full for p in approximants())
    unequal = sum(p.a_1 != p.b[1] for p in approximants())
    changed = sum(full != as_printed for full, as_printed in map(positive, approximants()))
    used = max(error.used for row in found.values() for error in row.values())
    return (
        Check.never(
            f"of {len(entries)} printed numbers, those that differ from our correctly rounded ones: the bounds "
            "assume that none does",
            sum(not entry.agrees for entry in entries),
        ),
        Check.never(
            "approximants printed with a_1 different from b_1: the error of their 1 - eps would grow like 1/v*", unequal
        ),
        Check.within(
            "largest change of eps and 1 - eps by printing, relative to the proven bound from half a unit of the last "
            "digit of each coefficient",
            used,
        ),
        Check.within(
            "largest displacement of a pole or zero by printing, relative to the proven bound from the same half units",
            max(root.used for root in roots),
        ),
        Check.never("approximants whose number of poles or zeros on v* > 0 changes by printing", changed),
    )


def equal_errors_at(v_star: Sequence[float], by_printing: Sequence[float], own: Sequence[float]) -> float:
    """Return the v* from which on the own error is the larger one, interpolated between points."""
    logs = [math.log(mine / its) for mine, its in zip(own, by_printing, strict=True)]
    i = max((i for i, log in enumerate(logs[:-1]) if log <= 0), default=-1)
    if i < 0:
        return v_star[0]
    part = logs[i] / (logs[i] - logs[i + 1])
    return float(v_star[i] * (v_star[i + 1] / v_star[i]) ** part)


def _crossing(row: Mapping[str, PrintingErrors], grid: Sequence[str]) -> float:
    at = [row[v] for v in grid]
    return equal_errors_at([float(v) for v in grid], [e.epsilon for e in at], [e.own_epsilon for e in at])


def _summary(found: dict[str, dict[str, PrintingErrors]], grid: Sequence[str], roots: Sequence[MovedRoot]) -> str:
    usable = sorted(p.full.label for p in approximants() if p.full.usable)
    places = _listed([f"{_crossing(row, grid):.2g} for {label}" for label, row in found.items()])
    eps, label, v_star = max((e.epsilon, label, float(v)) for label in usable for v, e in found[label].items())
    loss, other = max((e.loss, label) for label, row in found.items() for e in row.values())
    zero = next(m for m in roots if m.kind == "zero" and m.root.positive)
    example = found[EXAMPLE]
    ratio = example["1"].own_epsilon / example["1"].epsilon
    return (
        f"Printing changes eps of {_listed(usable)} by {at_most(eps, 2)} of it at most ({label} at v* = "
        f"{v_star:.2g}), and 1 - eps of all by {at_most(loss, 2)} ({other}). That is more than the approximant's own "
        f"error only up to v* = {places}; at v* = 1 the own error of {EXAMPLE} in eps is {ratio:.0f} times as large "
        "as that by printing. 1 - eps keeps its accuracy at small v* because the printed a_1 and b_1 are equal: with "
        f"one unit between them 1 - eps of {EXAMPLE} would be off by {example[grid[0]].loss_if_unequal:.2g} times "
        f"itself at v* = {float(grid[0]):g}. The zero of {zero.label} at v* = {zero.root.decimals(12)[0]} moves by "
        f"{zero.by:.1e}: there its eps loses all digits"
    )


def _listed(labels: Sequence[str]) -> str:
    return f"{', '.join(labels[:-1])} and {labels[-1]}"


def _cell(number: float) -> str:
    return f"{number:.1e}"


def _error_table(found: dict[str, dict[str, PrintingErrors]]) -> ResultTable:
    rows = tuple(
        (label, v, *map(_cell, (e.epsilon, e.epsilon_bound, e.own_epsilon, e.loss, e.own_loss)))
        for label, row in found.items()
        for v, e in ((v, row[v]) for v in TABLE_SPEEDS)
    )
    header = ("approximant", "v*", "eps, by printing", "bound", "eps, own", "1 - eps, by printing", "1 - eps, own")
    return ResultTable("Relative errors by printing, and of the full approximants", header, rows)


def _part_table(found: dict[str, dict[str, PrintingErrors]]) -> ResultTable:
    rows = tuple((label, *(_ranked(row[v].parts) for v in RANKED_SPEEDS)) for label, row in found.items())
    header = ("approximant", *(f"v* = {v}" for v in RANKED_SPEEDS))
    return ResultTable("The coefficient whose printed digits matter most, with its part of the bound", header, rows)


def _ranked(parts: Mapping[str, float]) -> str:
    name = max(parts, key=lambda key: parts[key])
    return f"{name}: {parts[name] / sum(parts.values()):.0%}"


def _root_table(roots: Sequence[MovedRoot]) -> ResultTable:
    rows: list[tuple[Cell, ...]] = []
    for m in roots:
        real, imaginary = m.root.decimals(12)
        where = real if m.root.real else f"{real} ± {imaginary} i" if real != "0" else f"± {imaginary} i"
        rows.append((m.label, m.kind, where, _cell(m.by), _cell(m.bound)))
    header = ("approximant", "kind", "at v*", "moved by", "bound")
    return ResultTable("Poles and zeros, and how far printing moves them", header, tuple(rows))


def _charts(found: dict[str, dict[str, PrintingErrors]], grid: Sequence[str]) -> Iterator[Chart]:
    v_star = [float(v) for v in grid]

    def line(name: str, label: str, field: str, bound: bool = False) -> ChartCurve:
        values = [getattr(found[label][v], field) for v in grid]
        return curve(name, v_star, values, "bound" if bound else "line")

    for field, name in (("epsilon", r"\varepsilon"), ("loss", r"1 - \varepsilon")):
        curves = []
        for label in found:
            curves += [line(label, label, field), line(f"{label}, own error", label, f"own_{field}", bound=True)]
        yield _chart(f"${name}$: by printing, and own error", curves)
    yield _chart(
        rf"$1 - \varepsilon$ of {EXAMPLE}",
        [
            line("by printing", EXAMPLE, "loss"),
            line("proven bound", EXAMPLE, "loss_bound", bound=True),
            line("own error", EXAMPLE, "own_loss"),
            line("one unit between $a_1$ and $b_1$", EXAMPLE, "loss_if_unequal"),
        ],
    )


def _chart(title: str, curves: Sequence[ChartCurve]) -> Chart:
    visible = tuple(ChartCurve(c.name, *_above(c), c.look) for c in curves)
    return Chart(title, r"$v_\ast$", "relative error", visible)


def _above(c: ChartCurve) -> tuple[tuple[float, ...], tuple[float, ...]]:
    """Leave out what is so small that nothing else could be seen beside it."""
    kept = [(x, y) for x, y in zip(c.x, c.y, strict=True) if y > 1e-20]
    return tuple(x for x, _ in kept), tuple(y for _, y in kept)


CASE = Case(
    "printed-digits",
    "The paper's printed digits",
    "How large is the error that rounding the printed coefficients makes, and where does it exceed the "
    "approximants' own error?",
    run,
)
