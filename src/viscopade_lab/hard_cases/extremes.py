"""Extremes.

Does the exact function agree with asymptotic expansions from v* = 1e-1000 to 1e100, and to 1,000 digits, and does its
inverse lead back?

The expansions for v* -> 0 and v* -> infinity share nothing with the exact function. With S_n the sum of the first n
terms, (exact - S_n)/t_(n+1) = 1 + t_(n+2)/t_(n+1) + … . At v* <= 1e-3 and v* >= 1e3 the terms that follow are small, so
that the quotient lies between 1/2 and 2, and over a range of v* the difference has the power and the logarithms of the
first omitted term. After the last term the digits asked for are the limit.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping, Sequence
from decimal import ROUND_HALF_EVEN, Context, Decimal
from fractions import Fraction
from functools import lru_cache
from itertools import pairwise
from typing import TYPE_CHECKING, Any, NamedTuple

import numpy as np
from flint import arb

from viscopade.arithmetic.balls import ball_of, bits_for, working
from viscopade.arrays import double
from viscopade.collision import exact
from viscopade.plots.sheet import BLUE, GREEN, V_STAR, VERMILION
from viscopade_lab import asymptotics
from viscopade_lab.hard_cases.case import Finding, Row

if TYPE_CHECKING:
    from matplotlib.figure import Figure

    from viscopade_lab.asymptotics import Expansion

RESOLVED = 100  # times smaller than the term an enclosure must be for a difference to be measured
COEFFICIENT_DIGITS = {False: 50, True: 220}
NAMES = {"one_minus_epsilon": "1 - eps", "epsilon": "eps", "x_max": "x_max", "tau_c": "tau_c"}
Points = Sequence[tuple[str, int]]  # a number as text, and the digits asked for


class Plan(NamedTuple):
    """What is computed: v* at both ends, 1 - eps and eps of which v* is found, and digits that extend each other."""

    near: Points
    far: Points
    losses: Points
    epsilons: Points
    nested: Sequence[tuple[str, Sequence[int]]]


QUICK = Plan(
    near=(("1e-3", 40), ("1e-4", 40), ("1e-6", 40), ("1e-10", 40), ("1e-30", 100), ("1e-1000", 20)),
    far=(("1e3", 45), ("1e4", 45), ("1e6", 30), ("1e10", 30), ("1e30", 12)),
    losses=(("1e-6", 40), ("1e-8", 40), ("1e-30", 60)),
    epsilons=(("1e-10", 40), ("1e-12", 40), ("1e-100", 6)),
    nested=(("1e-30", (20, 50, 100)), ("1", (20, 50, 100)), ("1e6", (20, 30))),
)
THOROUGH = Plan(
    near=(*((f"1e-{n}", 100) for n in (3, 4, 5, 6, 8, 10, 15, 20)), ("1e-30", 300), ("1e-300", 1000), ("1e-1000", 300)),
    far=(*((f"1e{n}", 100) for n in (3, 4, 5, 6, 8, 10, 15, 20)), ("1e30", 220), ("1e60", 20), ("1e100", 12)),
    losses=tuple((f"1e-{n}", 100) for n in (6, 9, 12, 30, 100, 1990)),
    epsilons=(*((f"1e-{n}", 80) for n in (10, 13, 20, 50)), ("1e-100", 20), ("1e-330", 6)),
    nested=(
        ("1e-30", (20, 50, 100, 300)),
        ("1", (20, 50, 100, 300, 1000)),
        ("1e6", (20, 50, 100)),
        ("1e30", (12, 220)),
    ),
)
OUTSIDE: tuple[Callable[[], object], ...] = (
    lambda: exact.collision("1e-1001"),
    lambda: exact.collision("1.0001e100"),
    lambda: exact.invert("0.9e-330"),
    lambda: exact.invert(one_minus_epsilon="0.9e-1990"),
)


@lru_cache(maxsize=128)
def collision(given: str, at: str, digits: int) -> exact.Collision:
    """Return the exact numbers where v*, eps or 1 - eps is given."""
    if given == "v_star":
        return exact.collision(at, digits)
    return exact.invert(at, digits) if given == "epsilon" else exact.invert(one_minus_epsilon=at, digits=digits)


@lru_cache(maxsize=2)
def expansions(thorough: bool) -> tuple[Mapping[str, Expansion], Mapping[str, Expansion]]:
    """Return the expansions for v* -> 0, whose first terms have closed forms to 1,000 digits, and v* -> infinity."""
    order, digits = (8 if thorough else 5), COEFFICIENT_DIGITS[thorough]
    elastic, first = asymptotics.elastic(order, digits), asymptotics.elastic_in_closed_form(1000)
    sharp = {
        name: asymptotics.PowerExpansion(
            tuple((n, dict(first[name].coefficients).get(n, c)) for n, c in found.coefficients)
        )
        for name, found in elastic.items()
    }
    return sharp, asymptotics.viscous(order, digits)


class Difference(NamedTuple):
    """The exact value less the first n terms at a place: log10 of it, and it in units of term n + 1, either way."""

    at: float
    terms: int
    size: float
    factor: float


def differences(value: arb, at: str, digits: int, expansion: Expansion) -> tuple[list[Difference], float]:
    """Return what is resolved after each number of terms, and the last in units of what it may be."""
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


def faults(plan: Plan) -> int:
    """Count decimals that are not the rounded longer ones, enclosures that do not meet, and ways that do not lead back.

    Two digits less than were asked for must come back: errors grow at most by the exponent, 10/3.
    """
    wrong = 0
    for at, lengths in plan.nested:
        for short, long in pairwise(collision("v_star", at, n) for n in lengths):
            for name in short.balls():
                same = Decimal(short.decimals()[name]) == _to(long.decimals()[name], short.digits)
                wrong += not (same and short.balls()[name].overlaps(long.balls()[name]))
    for given, points in (("one_minus_epsilon", plan.losses), ("epsilon", plan.epsilons)):
        for at, digits in points:
            known = 48 if digits > 50 else digits - 2
            back = collision("v_star", collision(given, at, digits).decimals()["v_star"], known)
            wrong += _to(back.decimals()[given], known - 1) != Decimal(at)
    return wrong


def _to(text: str, digits: int) -> Decimal:
    return Decimal(text).normalize(Context(prec=digits, rounding=ROUND_HALF_EVEN, Emin=-(10**6), Emax=10**6))


def accepted_outside() -> int:
    """Count numbers just beyond the ends that are not refused."""
    accepted = 0
    for call in OUTSIDE:
        try:
            call()
            accepted += 1
        except ValueError:
            pass
    return accepted


def ulps(name: str, low: float, high: float, truth: Callable[[arb], arb], number: int) -> float:
    """Return the largest error of double precision, relative to what is stated, from 10^low to 10^high."""
    at = 10.0 ** np.array([low, high, *np.random.default_rng(7).uniform(low, high, number)])
    values: Any = getattr(double, name)(at)
    worst = 0.0
    with working(192):
        for x, value in zip(at.tolist(), values.tolist(), strict=True):
            true = truth(arb(x))
            unit = arb(math.ulp(float(true.mid())))
            error = float(abs(arb(value) - true).abs_upper() / unit) if 0 <= value < math.inf else math.inf
            worst = max(worst, error / double.ULP[name])
    return worst


def measure(thorough: bool) -> Finding:
    """Compare at both ends."""
    plan = THOROUGH if thorough else QUICK
    elastic, viscous = expansions(thorough)
    near, far = "v* -> 0", "v* -> infinity"
    found: dict[tuple[str, str], list[Difference]] = {}
    excess = 0.0
    for end, expansions_there, points in ((near, elastic, plan.near), (far, viscous, plan.far)):
        for name, expansion in expansions_there.items():
            for at, digits in points:
                more, last = differences(getattr(collision("v_star", at, digits), name), at, digits, expansion)
                found.setdefault((end, name), []).extend(one for one in more if one.terms <= 4)
                excess = max(excess, last)
    number = 5000 if thorough else 300
    machine = max(
        ulps("one_minus_epsilon", -300, -3, lambda x: sum(elastic["one_minus_epsilon"].terms(x), arb(0)), number),
        ulps("epsilon", 3, 300, lambda x: sum(viscous["epsilon"].terms(x), arb(0)), number),
        ulps("epsilon", -300, -3, lambda x: 1 - sum(elastic["one_minus_epsilon"].terms(x), arb(0)), number),
    )
    return judged(found, excess, faults(plan), accepted_outside(), machine)


def judged(
    found: Mapping[tuple[str, str], Sequence[Difference]], excess: float, wrong: int, accepted: int, machine: float
) -> Finding:
    """Hold all differences to the first omitted terms."""
    rows = (
        *(
            Row(
                f"{NAMES[name]}, {end}: difference after n terms / term n + 1, either way", max(o.factor for o in of), 2
            )
            for (end, name), of in found.items()
        ),
        Row("last difference / twice the last term and a unit of the last digit", excess, 1),
        Row("digits or enclosures that do not extend each other, or do not come back", wrong, 0),
        Row("double precision, v* = 1e-300 to 1e300: error / stated error", machine, 1),
        Row("numbers just beyond the accepted range that are not refused", accepted, 0),
    )
    worst = max(one.factor for of in found.values() for one in of)
    summary = (
        "In all digits that both have, the exact function agrees with expansions that share nothing with it, and its "
        "inverse leads back. After n = 1 to 4 terms the difference is the next term, within a factor of "
        f"{worst:.4g}: relatively, "
        "the difference falls like v*^2, v*^3, … for v* -> 0, and like v*^(-10/3) and a logarithm for each term for "
        "v* -> infinity."
    )

    def draw(figure: Figure) -> None:
        panels = figure.subplots(1, 2)
        for axes, (end, name) in zip(
            panels, (("v* -> 0", "one_minus_epsilon"), ("v* -> infinity", "epsilon")), strict=True
        ):
            for n, color, mark in zip((1, 2, 3), (BLUE, VERMILION, GREEN), "os^", strict=True):
                points = sorted((o.at, o.size) for o in found[end, name] if o.terms == n and abs(o.at) <= 30)
                axes.plot(*zip(*points, strict=True), color=color, marker=mark, markersize=4, label=f"{n} terms")
            axes.set(xlabel=rf"$\log_{{10}}$ {V_STAR}", ylabel=r"$\log_{10}$ of the relative difference")
        panels[0].set_title(r"$1 - \varepsilon$ for $v_\ast \to 0$")
        panels[1].set_title(r"$\varepsilon$ for $v_\ast \to \infty$")
        panels[0].legend(frameon=False, fontsize=9)

    return Finding(rows, summary, draw)
