"""The paper's statements about large v*, where eps -> (3/2)^(2/3) v*^(-10/3).

Each function below `@claim(name, place in the paper, statement)` returns `Evidence`: the verdict, a summary, its
numbers, and "proven" or "sampled". `verdict(holds, limited)` is "holds", "holds with a limit" or "does not hold".
Summaries print bounds: `at_most(x, n)` is x rounded up to n digits as text, `at_least` rounded down, `percent` to two.
The local slope is d ln eps/d ln v*.
"""

from __future__ import annotations

import math

import numpy as np
from flint import arb

from viscopade.arithmetic.balls import working
from viscopade.arithmetic.decimals import at_least, at_most
from viscopade.arrays import double
from viscopade.collision.exact import collision
from viscopade.collision.panel_proof import asymptotic_factor, tail
from viscopade.theory.paper import TABLE
from viscopade_lab.claims.approximants import approximant, curve, slope
from viscopade_lab.claims.evidence import Claim, Evidence, claim, percent, percent_at_most, verdict

PRINTED_EXPONENT = -3.2  # Eq. 10
# The damping stops the bodies at x_max = (3/(2 kappa))^(2/3); then the elastic force x^(3/2) pushes against the viscous
# one kappa sqrt(x) eps, eps = x_max/kappa with kappa = v*^2 (derivations/10_large_v_star.py).
TRUE_EXPONENT = -10 / 3
PREFACTOR = 1.5 ** (2 / 3)
# The exponent is printed with two digits: the limit must be within half a unit of the second.
EXPONENT_TOLERANCE = 0.05
# Two lines closer than this, relatively, coincide on the logarithmic axis of a column-wide figure.
LINE_WIDTH = 0.05
# Where eps is proven to be within 2e-18 of its limit, relatively: the local slope is -10/3 to all digits of a double.
FAR = 1e6
FIRST_BOUNDED = 5.0  # of `SPEEDS`: `panel_proof.tail` holds from v* = 4 on
SPEEDS = (2.0, 5.0, 10.0, 100.0, 1000.0)  # v* of the table: where the paper's speeds for ice end, then powers of ten
# v* between which a straight line is fitted: the decade in which the slope passes -3.2; the fitted exponent is -3.23.
FITTED = (2.0, 20.0)


@claim("asymptotic-law", "Eq. 10", "eps tends to v*^-3.2 for v* to infinity")
def _asymptotic_law() -> Evidence:
    """Return the evidence: proven distances of eps from (3/2)^(2/3) v*^(-10/3), and the errors of v*^-3.2."""
    slopes = {v: slope(v) for v in (*SPEEDS, FAR)}
    # 20 digits of eps: more than the double that the error becomes.
    law = {v: v**PRINTED_EXPONENT / float(collision(v, 20).epsilon) - 1 for v in (*SPEEDS, FAR)}
    crossing = _where_slope_is(PRINTED_EXPONENT)
    prefactor, distance = _proven_limit()
    numbers = {
        "slope": _keyed(slopes),
        "limit_exponent": TRUE_EXPONENT,
        "limit_prefactor": prefactor,
        "limit_prefactor_theory": PREFACTOR,
        "proof": "docs/theory/exact-function.md, step 8, as viscopade.collision.panel_proof.tail",
        "bound_of_ln(eps v_star^(10/3)/limit)_beyond": _keyed(distance),
        "v_star_where_slope_is_-3.2": crossing,
        "relative_error_of_the_law": _keyed(law),
        "fitted_exponent_2_to_20": _fitted_exponent(*FITTED),
    }
    # v* = 10 and FAR in words, and the errors of the law at the v* of `SPEEDS`.
    summary = (
        "the limit is (3/2)^(2/3) v*^(-10/3): proven is that eps is within "
        f"{percent_at_most(math.expm1(distance[10.0]))} of it for all v* >= 10, and within "
        f"{at_most(math.expm1(distance[FAR]), 2)} for all v* >= {FAR:g}. The local slope is -3.2 at v* = "
        f"{crossing:.4f} only (sampled). v*^-3.2 is off by {percent(law[2.0])} at v* = 2, {percent(law[5.0])} at 5, "
        f"{percent(law[10.0])} at 10, {percent(law[100.0])} at 100, {percent(law[1000.0])} at 1000"
    )
    return Evidence(verdict(abs(TRUE_EXPONENT - PRINTED_EXPONENT) < EXPONENT_TOLERANCE), summary, numbers, "proven")


def _proven_limit() -> tuple[float, dict[float, float]]:
    """Return eps v*^(10/3) at `FAR`, and for each v* a bound of |ln(eps v*^(10/3)/limit)| for all larger ones.

    Against any other power of v* eps would grow or vanish; as the logarithm stays bounded, the exponent is -10/3.

    Raises
    ------
    ArithmeticError
        If an enclosure of eps contradicts the proof.
    """
    distance = {}
    for v in (*SPEEDS, FAR):
        if v < FIRST_BOUNDED:
            continue
        epsilon = collision(v, 20).epsilon  # an enclosure of 20 digits, narrower than the smallest bound, 1e-18
        with working(128):  # bits: 38 digits, so that rounding does not widen it
            # `tail` bounds |ln(eps v*^(10/3)/limit)| for this v* and all larger ones; scaled is eps v*^(10/3).
            bound, scaled = tail(arb(v)), epsilon * (arb(v) ** 10).root(3)
            if not abs((scaled / asymptotic_factor()).log()) <= bound:
                raise ArithmeticError(f"eps at v* = {v:g} is farther from its limit than is proven")
            distance[v] = float(bound.upper())
    return float(scaled.mid()), distance


@claim("dotted-line", "Fig. 2", "the numerical solution for large v* shows the behaviour eps = v*^-3.2")
def _dotted_line() -> Evidence:
    """Return the evidence: the range of v* in which the drawn v*^-3.2 is closer than a line's width to eps."""
    v, epsilon, _ = curve()  # eps on a grid, 500 points a decade, v* = 0.01 to 1000
    close = abs(v**PRINTED_EXPONENT / epsilon - 1) < LINE_WIDTH
    first, last = float(v[close].min()), float(v[close].max())
    unbroken = bool(close[(v >= first) & (v <= last)].all())
    decades = float(np.log10(last / first))
    numbers = {"tolerance": LINE_WIDTH, "from": first, "to": last, "unbroken": unbroken, "decades": decades}
    summary = (
        f"v*^-3.2 is within {percent(LINE_WIDTH)} of eps from v* = {at_most(first)} to {at_least(last)}, at least "
        f"{at_least(decades, 2)} decades of v*; beyond, the two separate for good"
    )
    reaches_far = last >= curve().v_star[-1]
    # With a limit: the line coincides with eps over half a decade at least, a length that a reader of the figure sees.
    return Evidence(verdict(reaches_far, unbroken and decades > 0.5), summary, numbers, "sampled")


@claim(
    "exponent-about-3",
    "text after Eq. 11",
    "eps behaves like a power of v* of about -3, so [m/m+3] is the family to take",
)
def _exponent_about_3() -> Evidence:
    """Return the evidence: the slope at v* = 10^6, and the integer next to it; [m/n] has the exponent m - n."""
    exponent = slope(FAR)
    nearest = round(exponent)
    growth = nearest - exponent
    numbers = {"limit_exponent": exponent, "nearest_integer": nearest, "relative_error_grows_like_v_star^": growth}
    summary = (
        f"the exponent is {exponent:.4f}; {nearest} is the nearest that a rational function can have, so the choice "
        f"is right, but no [m/n] has the true one: its relative error grows like v*^{growth:.4f}"
    )
    # -3 is the paper's choice, [m/m+3].
    return Evidence(verdict(abs(growth) < EXPONENT_TOLERANCE, nearest == -3), summary, numbers, "sampled")


@claim("pade-power", "text after Eq. 11", "[m/n] behaves like v*^(m-n) for large v*")
def _pade_power() -> Evidence:
    """Return the evidence: the power of v* and its factor at large v*, of each [m/n] in the paper's table."""
    powers, ratios = {}, {}
    for m, n in TABLE:
        p = approximant(m, n)
        # a_top v*^top/(b_bottom v*^bottom), the last coefficients that are not 0, is all that is left at large v*.
        top, bottom = (max(i for i, c in enumerate(side) if not c.contains(0)) for side in (p.a, p.b))
        powers[p.label] = top - bottom
        with working(128):  # bits, more than the 20 digits of the coefficients
            ratios[p.label] = float((p.a[top] / p.b[bottom]).mid()) / PREFACTOR
    exceptions = [label for (m, n), label in zip(TABLE, powers, strict=True) if powers[label] != m - n]
    numbers = {
        "power": powers,
        "relative_to_eps": {label: f"{ratios[label]:.4g} v*^({powers[label]} + 10/3)" for label in powers},
        "exceptions": exceptions,
        "b_3_of_0_3_is_zero": approximant(0, 3).b[3].is_zero(),
    }
    summary = (
        f"the powers are {', '.join(f'{power} for {label}' for label, power in powers.items())}: b_3 of [0/3] is "
        "exactly 0, it is [0/2]. Against the true -10/3 the ratio to eps grows like v*^(1/3): "
        f"[3/6] is {ratios['[3/6]']:.3f} v*^(1/3) eps"
    )
    return Evidence(verdict(not exceptions, exceptions == ["[0/3]"]), summary, numbers, "proven")


def _where_slope_is(value: float) -> float:
    """Return the v* where d ln eps/d ln v* is `value`.

    Raises
    ------
    ArithmeticError
        If the sampled slope passes the value not at all, or more than once, between v* = 0.01 and 1000.
    """
    v = curve().v_star
    slopes = double.slope(v)
    if np.count_nonzero(np.diff(slopes < value)) != 1:
        raise ArithmeticError(f"the slope is not {value} once and only once")
    first_beyond = int(np.argmax(slopes < value))

    # Secants of the accurate slope (16 digits). They start two points of the grid, 1 %, from the place on both sides:
    # far enough that their difference is not round-off, and close enough that 5 steps end with all digits (the
    # distance goes 1e-2, 1e-4, 1e-6, 1e-10, 1e-16).
    low, high = float(v[first_beyond - 2]), float(v[first_beyond + 2])
    f_low, f_high = slope(low) - value, slope(high) - value
    for _ in range(5):
        if f_high == f_low:  # both at the solution
            break
        low, high, f_low = high, high - f_high * (high - low) / (f_high - f_low), f_high
        f_high = slope(high) - value
    return high


def _fitted_exponent(first: float, last: float) -> float:
    """Return the slope of the straight line of least squares through ln eps over ln v*, v* from `first` to `last`."""
    v, epsilon, _ = curve()
    inside = (v >= first) & (v <= last)
    return float(np.polyfit(np.log(v[inside]), np.log(epsilon[inside]), 1)[0])  # degree 1: [slope, offset]


def _keyed(values: dict[float, float]) -> dict[str, float]:
    """Return the values by texts like "5" or "1e+06", as JSON needs them."""
    return {f"{v:g}": value for v, value in values.items()}


CLAIMS: tuple[Claim, ...] = (_asymptotic_law, _dotted_line, _exponent_about_3, _pade_power)
