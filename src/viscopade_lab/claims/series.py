"""The paper's statements about the series and its truncations."""

from __future__ import annotations

import math
from fractions import Fraction
from functools import lru_cache
from typing import Any

from flint import arb, arb_series

from viscopade.arithmetic.balls import ball_of, bits_for, decimal_string, working
from viscopade.arithmetic.decimals import at_most
from viscopade.arrays import double
from viscopade.collision import exact
from viscopade.collision.spheres import v_star
from viscopade.theory.paper import TABLE
from viscopade.theory.series import lambda_coefficients
from viscopade_lab import singularity
from viscopade_lab.claims.approximants import ORDER, SERIES_DIGITS, coefficients, departure, truncated
from viscopade_lab.claims.evidence import Claim, Evidence, claim, percent, verdict

# "Leaves the truth": a curve 1 % off is visibly beside it on a linear axis, one 10 % off at a glance.
VISIBLE, GROSS = 0.01, 0.1
# "v* is about 1" and "v is about 0.3 cm/s" are printed with one digit: v* within 10 % is meant.
ONE_DIGIT = 0.1
# Truncation orders of the paper's figures.
FIGURE_ORDERS = (20, 40)
# The two routes to the singularity must agree to 4 digits before the radius of convergence is used.
SINGULARITY_TOLERANCE = 1e-4
# The paper considers speeds up to 2.6 m/s for ice, v* = 2: a series with a smaller radius is useless there.
LARGEST_SPEED = 2.0

# More terms than this for 1e-3 is slow.
SLOW = 20

# Published with the older end of contact at x = 0, in eps0 = 1 - C_1 kappa + C_2 kappa^2 - C_3 kappa^3 + C_4 kappa^4.
OLDER = ("1.15344", "0.79826", "0.483582", "0.285279")


@claim(
    "coefficients-known",
    "abstract; text after eq:betadef",
    "all infinitely many coefficients h_k are known analytically",
)
def _known() -> Evidence:
    h = coefficients()
    digits = min(math.floor(h_k.rel_accuracy_bits() * math.log10(2)) for h_k in h.h if not h_k.is_exact())
    numbers = {"order": h.order, "digits": digits, "h": list(h.decimals(12)[:13])}
    summary = (
        f"h_0 … h_{h.order} are enclosed to {digits} digits or more here, and nothing limits order and digits but "
        "time; each is a polynomial with rational coefficients in constants that come from a recursion"
    )
    return Evidence(verdict(digits >= SERIES_DIGITS), summary, numbers, "proven")


@claim("sum-from-zero", "eq:epsSeriesAdvanced", "eps = 1 + sum of h_k v*^k, the sum starting at k = 0")
def _sum_from_zero() -> Evidence:
    eps_at_rest = exact.collision(0).epsilon
    h_0_in_the_sum = eps_at_rest - 1  # what the sum, as printed beside the 1, must contribute at v* = 0
    h_0 = coefficients().h[0]
    a_0 = {row[0][0] for row in TABLE.values()}
    numbers = {
        "epsilon_at_0": float(eps_at_rest),
        "h_0_that_the_printed_sum_needs": float(h_0_in_the_sum),
        "h_0_of_the_series": float(h_0),
        "printed_a_0": sorted(a_0),
        "printed_sum_with_h_0_of_the_series_at_0": float(1 + h_0),
    }
    summary = (
        "eps(0) = 1, so beside the leading 1 either h_0 is 0 or the sum starts at k = 1; with h_0 = 1, as a_0 = 1 of "
        f"the table has it, the printed line gives eps(0) = {float(1 + h_0):.0f}. A misprint without consequences"
    )
    return Evidence(verdict(bool(h_0 == h_0_in_the_sum), bool(h_0_in_the_sum == 0)), summary, numbers, "proven")


@claim("no-linear-term", "tab:padeCoeffs", "b_1 = 0 in [0/3], and a_1 = b_1 elsewhere")
def _no_linear_term() -> Evidence:
    h_1 = coefficients().h[1]
    pairs = [(a[1] if len(a) > 1 else "0", b[1]) for a, b in TABLE.values()]
    equal = all(a_1 == b_1 for a_1, b_1 in pairs)
    numbers = {"h_1": float(h_1), "h_3": float(coefficients().h[3]), "printed_a_1_b_1": [list(pair) for pair in pairs]}
    summary = "h_1 is exactly 0, so a_1 = b_1 in every [m/n], as printed; the loss starts with v*^2 = beta v^(1/5)"
    return Evidence(verdict(h_1.is_exact() and h_1.is_zero() and equal), summary, numbers, "proven")


@claim("twenty-terms", "text after eq:betadef", "20 terms of the series are needed for eps to quadratic order in v")
def _quadratic_order() -> Evidence:
    # v* grows by this power of beta and of v: measured, not assumed.
    beta, v = (math.log2(v_star(*doubled) / v_star(1.0, 1.0)) for doubled in ((1.0, 2.0), (2.0, 1.0)))
    order = round(2 / v)
    zero = [k for k in range(1, order + 1) if coefficients().h[k].is_zero()]
    numbers = {
        "power_of_v_in_v_star": v,
        "power_of_beta_in_v_star": beta,
        "order": order,
        "power_of_beta_at_v^2": order * beta,
        "terms_that_vanish": zero,
    }
    summary = (
        f"v*^k = beta^(k/2) v^(k/10), so v^2 is k = {order}, with beta^{order * beta:.0f}: {order} terms beyond the 1, "
        f"of which {len(zero)} (k = {' and '.join(map(str, zero))}) vanish"
    )
    return Evidence(verdict(order == 20), summary, numbers, "proven")


@claim("exact-solution", "text after eq:betadef", "the series is the exact solution of the problem")
def _exact_solution() -> Evidence:
    inside, outside = ("0.5", "0.7", "0.9"), ("1.2", "1.5")
    off = {v: _relative_error(v) for v in (*inside, *outside)}
    radius = radius_numbers()["radius"]
    bound = {v: (float(v) / radius) ** ORDER for v in inside}
    summary = (
        f"S_{ORDER} is within {at_most(off['0.5'], 1)} of eps at v* = 0.5, {at_most(off['0.7'], 1)} at 0.7 and "
        f"{at_most(off['0.9'], 1)} at 0.9 "
        f"(below (v*/R)^{ORDER}); at v* = 1.2 it is off by {off['1.2']:.0e} times eps: the series is the solution for "
        f"v* < R = {radius:.4f} only"
    )
    good = all(off[v] < bound[v] for v in inside)
    everywhere = all(off[v] < VISIBLE for v in outside)
    numbers = {f"relative_error_of_S_{ORDER}": off, "radius": radius}
    return Evidence(verdict(good and everywhere, good), summary, numbers, "sampled")


def _relative_error(at: str) -> float:
    """Return |S_120/eps - 1| from enclosures of both."""
    truth = exact.collision(at, SERIES_DIGITS).epsilon
    with working(bits_for(SERIES_DIGITS) + 64):
        total = arb(0)
        for h_k in reversed(coefficients().h):
            total = total * ball_of(Fraction(at)) + h_k
        return float(abs(total / truth - 1).mid())


@claim(
    "truncations-diverge",
    "text after eq:betadef; Conclusion",
    "truncated at any order, the series goes to plus or minus infinity, as the sign of h_k says",
)
def _truncations_diverge() -> Evidence:
    h = coefficients().h
    vanishing = [k for k, h_k in enumerate(h) if h_k.is_zero()]
    signs_known = all(k in vanishing or not h_k.contains(0) for k, h_k in enumerate(h))
    far = 1e6  # where the last term decides
    signs_agree = all(
        (truncated(k, far) > 0) == bool(h_k > 0) for k, h_k in enumerate(h[:41]) if k > 1 and k not in vanishing
    )
    numbers = {"order": ORDER, "orders_with_h_k_zero": vanishing, "sign_decides": signs_agree}
    summary = (
        f"true of every polynomial: the sign of h_k decides (h_k = 0 only for k = 1 and 3 up to {ORDER}). It says "
        "nothing about the infinite series, whose radius of convergence is another matter (claim slow-convergence)"
    )
    return Evidence(verdict(signs_agree and signs_known and vanishing == [1, 3]), summary, numbers, "proven")


@claim(
    "order-20-at-1",
    "text after fig:seriesDiverging",
    "truncated at k_c = 20 the series starts to deviate at about v* = 1",
)
def _order_20_at_1() -> Evidence:
    visible, gross = (departure(FIGURE_ORDERS[0], tolerance) for tolerance in (VISIBLE, GROSS))
    numbers = {"v_star_where_1_percent_off": visible, "v_star_where_10_percent_off": gross}
    summary = (
        f"S_20 is more than 1 % off from v* = {at_most(visible, 4)} on and more than 10 % off from v* = "
        f"{at_most(gross, 5)} on: about 1"
    )
    return Evidence(verdict(visible > 1 - ONE_DIGIT and gross < 1 + ONE_DIGIT), summary, numbers, "sampled")


@claim("slow-convergence", "text after eq:betadef", "the series converges extremely slowly")
def _slow_convergence() -> Evidence:
    numbers: dict[str, Any] = {**radius_numbers()}
    radius = numbers["radius"]
    below, above = (round(radius * factor, 2) for factor in (0.5, 0.9))
    terms = {v: _terms_needed(v, 1e-3) for v in (below, above)}
    numbers |= {"terms_for_1e-3": {str(v): count for v, count in terms.items()}}
    summary = (
        f"the series converges, geometrically like (v*/R)^k, for v* < R = {radius:.6f} (1e-3 takes "
        f"{terms[below]} terms at v* = {below}, {terms[above]} at {above}) and not at all beyond: eps has "
        f"branch points at v* = R exp(±{numbers['argument_over_pi']:.5f} pi i)"
    )
    return Evidence(verdict(radius > LARGEST_SPEED, max(terms.values()) > SLOW), summary, numbers, "sampled")


@lru_cache(maxsize=1)
def radius_numbers() -> dict[str, float]:
    """Return the radius of convergence by two routes."""
    flow, series = singularity.from_flow(), singularity.from_coefficients()
    difference = float(abs(series.v_star / flow.v_star - 1))
    if difference > SINGULARITY_TOLERANCE:
        raise ArithmeticError(f"two ways to the radius of convergence differ by {difference:.1e}")
    return {
        "radius": float(flow.radius),
        "argument_over_pi": float(flow.argument),
        "radius_from_coefficients": float(series.radius),
        "argument_over_pi_from_coefficients": float(series.argument),
        "relative_difference": difference,
    }


def _terms_needed(v_star: float, tolerance: float) -> int:
    """Return the order from which all known truncations are within `tolerance`."""
    truth = double.epsilon(v_star)
    off = [k for k in range(ORDER + 1) if abs(truncated(k, v_star) / truth - 1) > tolerance]
    return max(off) + 1


@claim(
    "older-coefficients",
    "not in the paper: values in wide use for the older end of contact",
    "eps0 = 1 - C_1 kappa + C_2 kappa^2 - C_3 kappa^3 + C_4 kappa^4 with C = " + ", ".join(OLDER),
)
def _older_coefficients() -> Evidence:
    ours = _eps0_coefficients(len(OLDER))
    digits = [decimal_string(abs(c), 12) for c in ours]
    units = [Fraction(1, 10 ** len(printed.partition(".")[2])) for printed in OLDER]
    agree = [
        bool(abs(abs(c) - ball_of(Fraction(printed))) < ball_of(unit))  # the last digit may have been cut, not rounded
        for c, printed, unit in zip(ours, OLDER, units, strict=True)
    ]
    off = [float(printed) / float(abs(c).mid()) - 1 for c, printed in zip(ours, OLDER, strict=True)]
    same = [h_k.overlaps(c) for h_k, c in zip(coefficients().h[2:9:2], ours, strict=True)]
    numbers = {
        "printed": list(OLDER),
        "ours": digits,
        "agree": agree,
        "relative_difference": off,
        "same_in_the_series_of_this_paper": same,
        "end_of_contact": "x = 0",
    }
    summary = (
        f"C_1 and C_2 hold; C_3 is {digits[2]} (the one in use differs by {percent(off[2])}) and C_4 is {digits[3]} "
        f"({percent(off[3])}). h_2, h_4, h_6, h_8 of this paper's end of contact are the same numbers, so neither end "
        "gives the ones in use"
    )
    return Evidence(verdict(all(agree)), summary, numbers, "proven")


def _eps0_coefficients(count: int) -> list[arb]:
    """Return the coefficients of kappa^1 … kappa^count in eps0, from ln eps0 = -Lambda(kappa eps0^(1/10))."""
    odd = lambda_coefficients((count + 1) // 2, 40)
    with working(200, count + 1):
        powers = [arb(0)] * (2 * len(odd) + 1)
        powers[1::2] = odd
        log_eps0 = arb_series([arb(0)], count + 1)
        for _ in range(count):
            nu = arb_series([arb(0), arb(1)], count + 1) * (log_eps0 / 10).exp()
            log_eps0 = -arb_series(powers, count + 1)(nu)
        return log_eps0.exp().coeffs()[1 : count + 1]


CLAIMS: tuple[Claim, ...] = (
    _known,
    _sum_from_zero,
    _exact_solution,
    _no_linear_term,
    _quadratic_order,
    _truncations_diverge,
    _order_20_at_1,
    _slow_convergence,
    _older_coefficients,
)
