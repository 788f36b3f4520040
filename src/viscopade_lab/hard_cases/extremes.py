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
    from matplotlib.axes import Axes

    from viscopade_lab.asymptotics import Expansion

RESOLVED = 100
"""A difference counts where its enclosure is this many times narrower than the next term, so that it has two digits.

10 and 10,000 change the largest quotients by less than 2e-5 (measured).
"""
GUARD_BITS = 128
"""Bits beyond the digits, so that sums of terms are as accurate as the exact value; 64 and 512 change nothing."""
NEAR, FAR = "v* -> 0", "v* -> infinity"
Points = Sequence[tuple[str, int]]
"""Pairs of v* as text, and the digits that the exact function is asked for."""


class Plan(NamedTuple):
    """The v* at both ends, and to which order and digits the expansions are computed.

    Expansions for v* -> 0 go to v*^(2 order), those for v* -> infinity to the power -order of W = 12^(1/3) v*^(10/3).
    """

    near: Points
    far: Points
    order: int
    coefficient_digits: int


# Chosen by hand: the quick plan takes a second, the thorough one a minute (1,000 digits alone take 14 s). From term to
# term the size falls by about v* for v* -> 0 and by v*^(-10/3) for v* -> infinity: digits are so many that some terms
# are resolved, except at the outermost v*, where the digits themselves are compared.
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
    """Return the expansions by end (`NEAR`, `FAR`), and for each end by quantity.

    Quantities are "one_minus_epsilon" or "epsilon", "x_max" and "tau_c". Near v* = 0 the first coefficients have 1,000
    digits, from closed forms; the others have those of the plan.
    """
    elastic = asymptotics.elastic(plan.order, plan.coefficient_digits)
    # 1,000 digits are the most that `THOROUGH` asks for.
    closed_forms = asymptotics.elastic_in_closed_form(1000)
    # Each coefficient from its closed form if it has one (the first terms), else from the recursion.
    sharp = {
        name: asymptotics.PowerExpansion(
            tuple((n, dict(closed_forms[name].coefficients).get(n, c)) for n, c in expansion.coefficients)
        )
        for name, expansion in elastic.items()
    }
    return {NEAR: sharp, FAR: asymptotics.viscous(plan.order, plan.coefficient_digits)}


class Difference(NamedTuple):
    """The exact value minus the first n terms of its expansion.

    Attributes
    ----------
    log_v_star : float
        log10 of v*.
    terms : int
        n.
    size : float
        log10 of |difference/value|.
    ratio : float
        The difference divided by term n + 1, or the inverse if that is larger; infinite if the sign is wrong.
    """

    log_v_star: float
    terms: int
    size: float
    ratio: float


def differences(value: arb, v_star: str, digits: int, expansion: Expansion) -> tuple[list[Difference], float]:
    """Return the resolved differences after 1, 2, … terms, and the difference after the last term over its bound.

    `value` is the exact value at `v_star` (a decimal number), enclosed to `digits` significant digits. `expansion`
    has the terms that approximate it, in the order of their powers.
    """
    with working(bits_for(digits) + GUARD_BITS):
        terms = expansion.terms(ball_of(Fraction(v_star)))
        partial_sum, resolved = arb(0), list[Difference]()
        # After n terms, term n + 1 is the first that is omitted; after the loop the sum lacks the last term.
        for n, (term, omitted) in enumerate(pairwise(terms), 1):
            partial_sum += term
            difference = value - partial_sum
            if arb(difference.rad()) * RESOLVED < abs(omitted) and difference != 0:
                quotient = float((difference / omitted).mid())
                ratio = max(quotient, 1 / quotient) if quotient > 0 else math.inf
                size = float((abs(difference / value).mid()).log() / arb(10).log())
                resolved.append(Difference(float(Decimal(v_star).log10()), n, size, ratio))
        # The sum lacks the last term t and what follows it: at most 2 |t|, as the quotient is below 2. A unit of the
        # last of `digits` significant digits is at most 10^(1 - digits) of the value.
        allowed = 2 * abs(terms[-1]) + abs(value) * arb(10) ** (1 - digits)
        return resolved, float(abs(value - partial_sum).abs_upper() / allowed)


def measure(thorough: bool) -> Finding:
    """Return the rows, words and picture of this case, from the plan `THOROUGH` (if `thorough`) or `QUICK`."""
    plan = THOROUGH if thorough else QUICK
    # (end, quantity) -> its differences at all v* of that end
    resolved: dict[tuple[str, str], list[Difference]] = {}
    excess = 0.0
    for end, expansion_by_name in expansions(plan).items():
        for v_star, digits in plan.near if end == NEAR else plan.far:
            collision = exact.collision(v_star, digits)
            for name, expansion in expansion_by_name.items():
                # The exact quantity is the collision's field of the same name.
                at_point, last = differences(getattr(collision, name), v_star, digits, expansion)
                # Up to four terms, a choice: with all of them the quick run has the same result.
                resolved.setdefault((end, name), []).extend(d for d in at_point if d.terms <= 4)
                excess = max(excess, last)
    return make_finding(resolved, excess)


def make_finding(resolved: Mapping[tuple[str, str], Sequence[Difference]], excess: float) -> Finding:
    """Return the rows, words and picture.

    `resolved` maps (end, quantity) to differences; `excess` is the largest difference after a last term / its bound.
    """
    # For each end the largest ratio of any quantity.
    worst = {
        end: max(d.ratio for (side, _), differences in resolved.items() if side == end for d in differences)
        for end in dict.fromkeys(end for end, _ in resolved)
    }
    rows = (
        # 2: the next terms change the quotient by less than a half (head of this file).
        *(
            Row(f"{end}: difference after n terms / term n + 1, or its inverse", ratio, 2)
            for end, ratio in worst.items()
        ),
        Row("last difference / (twice the last term + a unit of the last digit)", excess, 1),
    )
    summary = (
        "The exact function agrees with independent asymptotic expansions in all digits that both have. This holds for "
        "eps or 1 - eps, the duration and the largest compression. After one to four terms the difference is the next "
        "term. It falls with the right power: by v* a term for v* -> 0, by v*^(-10/3) and a logarithm for v* -> "
        "infinity."
    )

    def draw(axes: Axes) -> None:
        """Draw log10 of the differences over log10 of v*: after n = 1, 2, 3 terms, at both ends.

        eps -> 1 for v* -> 0 and eps -> 0 for v* -> infinity, so that 1 - eps and eps have terms there. v* beyond 1e±30
        are single points, which would squeeze the rest.
        """
        for n, color, mark in zip((1, 2, 3), (BLUE, VERMILION, GREEN), "os^", strict=True):
            for end, name in ((NEAR, "one_minus_epsilon"), (FAR, "epsilon")):
                chosen = (d for d in resolved[end, name] if d.terms == n and abs(d.log_v_star) <= 30)
                points = sorted((d.log_v_star, d.size) for d in chosen)
                # The legend names a curve once, not at both ends.
                label = f"after {n} term{'s' * (n > 1)}" if end == NEAR else None
                axes.plot(*zip(*points, strict=True), color=color, marker=mark, markersize=4, label=label)
        axes.set(
            title=r"$1 - \varepsilon$ for $v_* \to 0$, $\varepsilon$ for $v_* \to \infty$",
            xlabel=rf"$\log_{{10}}$ {V_STAR}",
            ylabel=r"$\log_{10}$ of the relative difference",
        )
        axes.legend()

    return Finding(rows, summary, draw)
