"""Extremes.

Does the exact function agree with asymptotic expansions from v* = 1e-1000 to 1e100, and to 1,000 digits?

The expansions for v* -> 0 and v* -> infinity share nothing with the exact function. With S_n the sum of the first n
terms, (exact - S_n)/t_(n+1) = 1 + t_(n+2)/t_(n+1) + … . At v* <= 1e-3 and v* >= 1e3 the following terms are small. So
the quotient lies between 1/2 and 2, and over a range of v* the difference has the power and the logarithms of the
first omitted term. After the last term the requested digits are the limit.
"""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from decimal import Decimal
from fractions import Fraction
from itertools import pairwise
from typing import TYPE_CHECKING, NamedTuple

from flint import arb

from viscopade.arithmetic.balls import ball_of, bits_for, working
from viscopade.collision import exact
from viscopade.plots.sheet import BLUE, GREEN, V_STAR, VERMILION
from viscopade_lab import asymptotics
from viscopade_lab.hard_cases.case import Finding, Row

if TYPE_CHECKING:
    from matplotlib.figure import Figure

    from viscopade_lab.asymptotics import Expansion

RESOLVED = 100  # times smaller than the term an enclosure must be for a difference to be measured
NEAR, FAR = "v* -> 0", "v* -> infinity"
Points = Sequence[tuple[str, int]]  # v* as text, and the digits asked for


class Plan(NamedTuple):
    """The v* at both ends, and to which order and digits the expansions are computed."""

    near: Points
    far: Points
    order: int
    coefficient_digits: int


QUICK = Plan(
    near=(("1e-3", 40), ("1e-6", 40), ("1e-10", 40), ("1e-1000", 20)),
    far=(("1e3", 45), ("1e6", 30), ("1e10", 30), ("1e30", 12)),
    order=5,
    coefficient_digits=50,
)
THOROUGH = Plan(
    near=(*((f"1e-{n}", 100) for n in (3, 4, 5, 6, 8, 10, 15, 20)), ("1e-30", 300), ("1e-300", 1000), ("1e-1000", 300)),
    far=(*((f"1e{n}", 100) for n in (3, 4, 5, 6, 8, 10, 15, 20)), ("1e30", 220), ("1e60", 20), ("1e100", 12)),
    order=8,
    coefficient_digits=220,
)


def expansions(plan: Plan) -> dict[str, Mapping[str, Expansion]]:
    """Return the expansions of both ends; the first terms for v* -> 0 have closed forms to 1,000 digits."""
    elastic = asymptotics.elastic(plan.order, plan.coefficient_digits)
    first = asymptotics.elastic_in_closed_form(1000)
    sharp = {
        name: asymptotics.PowerExpansion(
            tuple((n, dict(first[name].coefficients).get(n, c)) for n, c in found.coefficients)
        )
        for name, found in elastic.items()
    }
    return {NEAR: sharp, FAR: asymptotics.viscous(plan.order, plan.coefficient_digits)}


class Difference(NamedTuple):
    """The exact value minus the first n terms.

    `size` is its log10, relative to the value; `factor` its quotient by term n + 1, or the inverse if that is larger.
    """

    at: float
    terms: int
    size: float
    factor: float


def differences(value: arb, at: str, digits: int, expansion: Expansion) -> tuple[list[Difference], float]:
    """Return the resolved differences after each number of terms, and the last difference divided by its bound."""
    with working(bits_for(digits) + 128):
        terms = expansion.terms(ball_of(Fraction(at)))
        total, found = arb(0), []
        for n, (term, omitted) in enumerate(pairwise(terms), 1):
            total += term
            left = value - total
            if arb(left.rad()) * RESOLVED < abs(omitted) and left != 0:
                quotient = float((left / omitted).mid())
                factor = max(quotient, 1 / quotient) if quotient > 0 else math.inf
                size = float((abs(left / value).mid()).log() / arb(10).log())
                found.append(Difference(float(Decimal(at).log10()), n, size, factor))
        allowed = 2 * abs(terms[-1]) + abs(value) * arb(10) ** (1 - digits)
        return found, float(abs(value - total).abs_upper() / allowed)


def measure(thorough: bool) -> Finding:
    """Compare at both ends."""
    plan = THOROUGH if thorough else QUICK
    found: dict[tuple[str, str], list[Difference]] = {}
    excess = 0.0
    for end, expansions_there in expansions(plan).items():
        for at, digits in plan.near if end == NEAR else plan.far:
            collision = exact.collision(at, digits)
            for name, expansion in expansions_there.items():
                more, last = differences(getattr(collision, name), at, digits, expansion)
                found.setdefault((end, name), []).extend(one for one in more if one.terms <= 4)
                excess = max(excess, last)
    return judged(found, excess)


def judged(found: Mapping[tuple[str, str], Sequence[Difference]], excess: float) -> Finding:
    """Compare all differences with the first omitted terms; keys of `found` are end and name of the function."""
    worst = {
        end: max(one.factor for (there, _), differences in found.items() if there == end for one in differences)
        for end in dict.fromkeys(end for end, _ in found)
    }
    rows = (
        *(
            Row(f"{end}: difference after n terms / term n + 1, or its inverse", factor, 2)
            for end, factor in worst.items()
        ),
        Row("last difference / (twice the last term + a unit of the last digit)", excess, 1),
    )
    summary = (
        "The exact function agrees with independent asymptotic expansions in all digits that both have. This holds for "
        "eps or 1 - eps, the duration and the largest compression. After one to four terms the difference is the next "
        "term. It falls with the right power: by v* a term for v* -> 0, by v*^(-10/3) and a logarithm for v* -> "
        "infinity."
    )

    def draw(figure: Figure) -> None:
        axes = figure.subplots()
        for n, color, mark in zip((1, 2, 3), (BLUE, VERMILION, GREEN), "os^", strict=True):
            for end, name in ((NEAR, "one_minus_epsilon"), (FAR, "epsilon")):
                points = sorted((o.at, o.size) for o in found[end, name] if o.terms == n and abs(o.at) <= 30)
                label = f"after {n} term{'s' * (n > 1)}" if end == NEAR else None
                axes.plot(*zip(*points, strict=True), color=color, marker=mark, markersize=4, label=label)
        axes.set(
            title=r"$1 - \varepsilon$ for $v_\ast \to 0$, $\varepsilon$ for $v_\ast \to \infty$",
            xlabel=rf"$\log_{{10}}$ {V_STAR}",
            ylabel=r"$\log_{10}$ of the relative difference",
        )
        axes.legend()

    return Finding(rows, summary, draw)
