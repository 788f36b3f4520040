"""The paper's statements about the series eps = 1 + sum h_k v*^k and its truncations S_k (sums up to h_k v*^k).

Each function below `@claim(name, place in the paper, statement)` returns `Evidence`: the verdict, a summary, its
numbers, and "proven" or "sampled". `verdict(holds, limited)` is "holds", "holds with a limit" or "does not hold".
Summaries print bounds: `at_most(x, n)` is x rounded up to n digits as text, `at_least` rounded down, `percent` to two.
"""

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
# The two routes to the singularity must agree to 4 digits before the radius of convergence is used: claims print it
# with 4 to 6 digits, and the coefficients give it to about 5.
SINGULARITY_TOLERANCE = 1e-4
# The paper considers speeds up to 2.6 m/s for ice, v* = 10^0.3 = 2: a series with a smaller radius is useless there.
LARGEST_SPEED = 2.0

# "Extremely slowly" is the paper's word without a number. More terms than this for three digits count as slow: exp(1)
# takes 6 terms for them.
SLOW = 20

# Published with the older end of contact at x = 0, in eps0 = 1 - C_1 kappa + C_2 kappa^2 - C_3 kappa^3 + C_4 kappa^4.
OLDER = ("1.15344", "0.79826", "0.483582", "0.285279")


@claim(
    "coefficients-known",
    "abstract; text after Eq. 8",
    "all infinitely many coefficients h_k are known analytically",
)
def _known() -> Evidence:
    """Return the evidence: the digits of the proven enclosures of h_0 … h_120."""
    h = coefficients()
    # Digits that the worst enclosure has: a ball of b correct bits has b log10(2) decimal digits. h_0 and the
    # vanishing h_1, h_3 are exact integers.
    digits = min(math.floor(h_k.rel_accuracy_bits() * math.log10(2)) for h_k in h.h if not h_k.is_exact())
    # Listed: h_0 … h_12, all that the table's largest approximant [3/6] is made of (h_9) and some more, to 12 digits.
    numbers = {"order": h.order, "digits": digits, "h": list(h.decimals(12)[:13])}
    summary = (
        f"h_0 … h_{h.order} are enclosed to {digits} digits or more here, and nothing limits order and digits but "
        "time; each is a polynomial with rational coefficients in constants that come from a recursion"
    )
    return Evidence(verdict(digits >= SERIES_DIGITS), summary, numbers, "proven")


@claim("sum-from-zero", "Eq. 7", "eps = 1 + sum of h_k v*^k, the sum starting at k = 0")
def _sum_from_zero() -> Evidence:
    """Return the evidence: beside the printed 1 the sum can start at k = 0 only if h_0 = 0; a_0 = 1 says h_0 = 1."""
    eps_at_rest = exact.collision(0).epsilon  # eps(v* = 0) = 1: a collision without damping
    h_0_in_the_sum = eps_at_rest - 1  # what the sum, as printed beside the 1, must contribute at v* = 0
    h_0 = coefficients().h[0]
    # TABLE: (m, n) -> (a_0 … a_m, b_0 … b_n) as printed. [m/n](0) = a_0/b_0 = a_0 is the h_0 that the table uses.
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


@claim("no-linear-term", "Table I", "b_1 = 0 in [0/3], and a_1 = b_1 elsewhere")
def _no_linear_term() -> Evidence:
    """Return the evidence: h_1 = 0 exactly, and the printed a_1 and b_1 are the same decimals."""
    h_1 = coefficients().h[1]
    # Order v* of b eps - a = O(v*^(m+n+1)) is b_1 + h_1 - a_1 = 0. TABLE: (m, n) -> (a_0 … a_m, b_0 … b_n) as printed.
    pairs = [(a[1] if len(a) > 1 else "0", b[1]) for a, b in TABLE.values()]
    equal = all(a_1 == b_1 for a_1, b_1 in pairs)
    numbers = {"h_1": float(h_1), "h_3": float(coefficients().h[3]), "printed_a_1_b_1": [list(pair) for pair in pairs]}
    summary = "h_1 is exactly 0, so a_1 = b_1 in every [m/n], as printed; the loss starts with v*^2 = beta v^(1/5)"
    return Evidence(verdict(h_1.is_exact() and h_1.is_zero() and equal), summary, numbers, "proven")


@claim("twenty-terms", "text after Eq. 8", "20 terms of the series are needed for eps to quadratic order in v")
def _quadratic_order() -> Evidence:
    """Return the evidence: the k for which v*^k is proportional to v^2, and the h_k up to there that vanish."""
    # v* is proportional to beta^(1/2) v^(1/10): the powers are measured by doubling beta or v, not assumed.
    # `v_star(speed, beta)`; any speed and beta would do instead of 1.
    beta, v = (math.log2(v_star(*doubled) / v_star(1.0, 1.0)) for doubled in ((1.0, 2.0), (2.0, 1.0)))
    order = round(2 / v)  # v*^k contains v^(k/10), which is v^2 for k = 2/(1/10)
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
    return Evidence(verdict(order == 20), summary, numbers, "proven")  # 20 is the paper's number of terms


@claim("exact-solution", "text after Eq. 8", "the series is the exact solution of the problem")
def _exact_solution() -> Evidence:
    """Return the evidence: |S_120/eps - 1| at five v*, three inside the radius of convergence R = 1.047, two beyond."""
    # At 0.5 the error is already below (0.5/R)^120 = 3e-39; beyond 1.5 it only grows.
    inside, outside = ("0.5", "0.7", "0.9"), ("1.2", "1.5")
    off = {}
    for v in (*inside, *outside):
        truth = exact.collision(v, SERIES_DIGITS).epsilon  # an enclosure
        # 64 bits more than the enclosures of h_k have: rounding in Horner's scheme, some 120 units, does not show.
        with working(bits_for(SERIES_DIGITS) + 64):
            partial_sum = arb(0)
            for h_k in reversed(coefficients().h):  # Horner's scheme for S_120
                partial_sum = partial_sum * ball_of(Fraction(v)) + h_k
            off[v] = float(abs(partial_sum / truth - 1).mid())
    radius = radius_numbers()["radius"]
    # |h_k| R^k < 0.4 for k from 10 to 120, so the rest, h_121 v*^121 + …, should be below (v*/R)^120 at v* = 0.5 and
    # 0.7; the verdict checks it, and at 0.9, too.
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


@claim(
    "truncations-diverge",
    "text after Eq. 8; Conclusion",
    "truncated at any order, the series goes to plus or minus infinity, as the sign of h_k says",
)
def _truncations_diverge() -> Evidence:
    """Return the evidence: S_k has the sign of h_k at large v*, and h_k = 0 for k = 1 and 3 only, up to k = 120."""
    h = coefficients().h
    vanishing = [k for k, h_k in enumerate(h) if h_k.is_zero()]
    signs_known = all(k in vanishing or not h_k.contains(0) for k, h_k in enumerate(h))
    # Where the last term decides: neighbouring |h_k| that are not 0 differ by less than a factor of 10. A double holds
    # (10^6)^40 = 10^240, but not (10^6)^52; 40 is the largest order that the paper's figures show.
    far = 1e6
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
    "text after Fig. 1",
    "truncated at k_c = 20 the series starts to deviate at about v* = 1",
)
def _order_20_at_1() -> Evidence:
    """Return the evidence: the v* from which S_20 is 1 % off, and 10 % off; both within 10 % of 1 means "about 1"."""
    # departure(order, tolerance): the first v* where |S_order/eps - 1| reaches the tolerance.
    visible, gross = (departure(FIGURE_ORDERS[0], tolerance) for tolerance in (VISIBLE, GROSS))
    numbers = {"v_star_where_1_percent_off": visible, "v_star_where_10_percent_off": gross}
    summary = (
        f"S_20 is more than 1 % off from v* = {at_most(visible, 4)} on and more than 10 % off from v* = "
        f"{at_most(gross, 5)} on: about 1"
    )
    return Evidence(verdict(visible > 1 - ONE_DIGIT and gross < 1 + ONE_DIGIT), summary, numbers, "sampled")


@claim("slow-convergence", "text after Eq. 8", "the series converges extremely slowly")
def _slow_convergence() -> Evidence:
    """Return the evidence: the radius of convergence, and the orders that three digits take at half and 0.9 of it."""
    numbers: dict[str, Any] = {**radius_numbers()}
    radius = numbers["radius"]
    # Half of the radius is a place well inside, 0.9 one where slow convergence shows: 0.9^k falls by 10 in 22 terms.
    below, above = (round(radius * share, 2) for share in (0.5, 0.9))
    terms = {}
    for v in (below, above):
        truth = double.epsilon(v)
        # The order from which all truncations up to S_120 are within 1e-3, three digits: what a plot or a fit needs.
        off = [k for k in range(ORDER + 1) if abs(truncated(k, v) / truth - 1) > 1e-3]
        terms[v] = max(off) + 1
    numbers |= {"terms_for_1e-3": {str(v): count for v, count in terms.items()}}
    summary = (
        f"the series converges, geometrically like (v*/R)^k, for v* < R = {radius:.6f} (1e-3 takes "
        f"{terms[below]} terms at v* = {below}, {terms[above]} at {above}) and not at all beyond: eps has "
        f"branch points at v* = R exp(±{numbers['argument_over_pi']:.5f} pi i)"
    )
    return Evidence(verdict(radius > LARGEST_SPEED, max(terms.values()) > SLOW), summary, numbers, "sampled")


@lru_cache(maxsize=1)  # two claims and a figure's text need it; it takes a second
def radius_numbers() -> dict[str, float]:
    """Return the radius of convergence R and the argument/pi of the singularity R exp(i argument), by two routes.

    The keys without "_from_coefficients" are by the equation of motion in complex time, which has more digits.

    Raises
    ------
    ArithmeticError
        If the singularities of both routes differ by more than `SINGULARITY_TOLERANCE`, relatively.
    """
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


@claim(
    "older-coefficients",
    "not in the paper: values in wide use for the older end of contact",
    "eps0 = 1 - C_1 kappa + C_2 kappa^2 - C_3 kappa^3 + C_4 kappa^4 with C = " + ", ".join(OLDER),
)
def _older_coefficients() -> Evidence:
    """Return the evidence: the published C_1 … C_4 beside the proven ones of the older end of contact, x = 0.

    The coefficients come from Lambda, which is odd: ln eps0 = -Lambda(nu), nu = kappa eps0^(1/10), Lambda(nu) =
    lambda_1 nu + lambda_3 nu^3 + … (docs/theory/mathematics.md, section 4).
    """
    count = len(OLDER)
    # lambda_1, lambda_3 suffice for kappa^4. 40 digits and 200 bits (60 digits) leave many more than the 12 shown.
    odd = lambda_coefficients((count + 1) // 2, 40)
    with working(200, count + 1):  # power series in kappa up to kappa^count
        powers = [arb(0)] * (2 * len(odd) + 1)
        powers[1::2] = odd
        log_eps0 = arb_series([arb(0)], count + 1)
        # Fixed-point iteration: nu = kappa exp(ln eps0/10) has a factor kappa, so each turn corrects one more order.
        for _ in range(count):
            nu = arb_series([arb(0), arb(1)], count + 1) * (log_eps0 / 10).exp()
            log_eps0 = -arb_series(powers, count + 1)(nu)
        ours = log_eps0.exp().coeffs()[1 : count + 1]  # of kappa^1 … kappa^4; C_k without their signs

    digits = [decimal_string(abs(c), 12) for c in ours]  # twice the digits in use
    # One unit of each printed number's last decimal place.
    units = [Fraction(1, 10 ** len(printed.partition(".")[2])) for printed in OLDER]
    agree = [
        bool(abs(abs(c) - ball_of(Fraction(printed))) < ball_of(unit))  # the last digit may have been cut, not rounded
        for c, printed, unit in zip(ours, OLDER, units, strict=True)
    ]
    off = [float(printed) / float(abs(c).mid()) - 1 for c, printed in zip(ours, OLDER, strict=True)]
    # kappa = v*^2: C_1 … C_4 belong to h_2, h_4, h_6, h_8. eps/eps0 = H(delta) = 1 + (4/15) v*^5 + …, so the ends of
    # contact differ in odd powers from v*^5 on, and in even ones only from v*^10 on: these four are the same for both.
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
