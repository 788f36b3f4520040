"""The paper's statements about the Padé approximants [m/m+3]: table, poles, accuracy, figures.

Each function below `@claim(name, place in the paper, statement)` returns `Evidence`: the verdict, a summary, its
numbers, and "proven" or "sampled". `verdict(holds, limited)` is "holds", "holds with a limit" or "does not hold".
Summaries print bounds: `at_most(x, n)` is x rounded up to n digits as text, `at_least` rounded down, `percent` to two.

`errors(m, n)` has three arrays over the v* of `curve()`, 0.01 to 1000: `epsilon`, |[m/n]/eps - 1|; `loss`, the
relative error of 1 - eps; `absolute`, |[m/n] - eps|. `largest(error, V)` is the largest of them up to V,
`error_near(error, V)` the one at V, and `first_above(error, tolerance)` the first v* where it exceeds the tolerance, or
None. `RANGES` are the V = 1, 2, 5, 10, 100 of the tables; `_accuracy(m)` has the largest errors up to each.
"""

from __future__ import annotations

import math
from collections.abc import Iterable
from decimal import ROUND_HALF_EVEN, Decimal
from functools import lru_cache
from typing import Any

from viscopade.arithmetic.decimals import at_least, at_most
from viscopade.theory.pade import Pade
from viscopade.theory.paper import TABLE, approximants, compare
from viscopade_lab.claims.approximants import (
    LARGEST_M,
    PADE_DIGITS,
    RANGES,
    SUITED_UP_TO,
    approximant,
    curve,
    enclosed_error,
    error_at,
    error_near,
    errors,
    family,
    first_above,
    largest,
    proven_error,
    values,
)
from viscopade_lab.claims.evidence import Claim, Evidence, claim, percent, percent_at_most, verdict

# The paper's words have no numbers. These bounds are chosen, once for all claims.
# An approximant with a larger error of eps than 10 % is no longer "suitable": a curve that is off at a glance.
SUITABLE = 0.1
# "Acceptable" allows 10 %: in the loss 1 - eps at v* <= 1, where collisions of hard materials are, and in eps up to
# v* = 10, a range chosen by hand, where eps has fallen to 6e-4.
ACCEPTABLE = 0.1
# "Good tradeoff": 1 - eps, what a simulation's cooling depends on, within 2 % up to v* = 100, chosen for "all".
TRADEOFF = 0.02
# "Almost perfect", "virtually identical", "coincides" in a figure: closer than a line's width, which in a column-wide
# figure is about half a per cent of a linear axis; 5 % is as little on a logarithmic axis of several decades.
LINE_LINEAR, LINE_LOG = 0.005, 0.05
# [1/4] "almost coincides" with the solution in a figure: a few line widths.
ALMOST_COINCIDES = 0.02
# [m/m+3] that the paper recommends or shows, except for [2/5] and [25/28], the end of its search.
NAMED = (0, 1, 3, 15)
# A "significant improvement" is one by a factor of ten.
SIGNIFICANT = 10.0
# Errors of 1e-15 are round-off of eps, [m/n] and their quotient, each some units of 2.2e-16: 18 of them in all.
ROUNDING = 4e-15


@claim("table-entries", "Table I", "the coefficients a_i, b_i of [0/3], [1/4], [2/5] and [3/6]")
def _table_entries() -> Evidence:
    """Return the evidence: each printed coefficient beside ours, rounded to as many digits."""
    entries = compare(approximants(PADE_DIGITS))  # 20 digits; the table has 6 at most
    wrong = [f"[{e.m}/{e.n}] {e.name}" for e in entries if not e.agrees]
    numbers = {
        "entries": len(entries),
        "disagree": wrong,
        "ours": {f"[{e.m}/{e.n}] {e.name}": e.rounded for e in entries},
    }
    summary = f"{len(entries) - len(wrong)} of {len(entries)} printed numbers are ours, correctly rounded"
    return Evidence(verdict(not wrong), summary, numbers, "proven")


@claim("order-conditions", "text after Eq. 11", "[m/n] has the Maclaurin series of eps up to order m + n")
def _order_conditions() -> Evidence:
    """Return the evidence: the order k up to which the series of each [m/n] in the table agrees with that of eps."""
    # contact_order: the largest k with [m/n] - eps = O(v*^(k+1)), proven; Padé's definition demands m + n.
    contact = {approximant(m, n).label: approximant(m, n).contact_order for m, n in TABLE}
    met = all(order >= m + n for (m, n), order in zip(TABLE, contact.values(), strict=True))
    summary = "the series of " + ", ".join(f"{label} agrees up to v*^{order}" for label, order in contact.items())
    return Evidence(verdict(met), summary, {"agrees_up_to_order": contact}, "proven")


@claim("pole-of-2-5", "text after Eq. 11; Table I", "[2/5] has a pole at v* = 5.68")
def _pole_of_two_five() -> Evidence:
    """Return the evidence: [2/5] has no pole on v* > 0 but a zero there, at 5.68, where the numerator changes sign."""
    p = approximant(2, 5)
    positive_b = all(b > 0 for b in p.b)  # then b_0 + b_1 v* + … has no zero for v* > 0
    # The real part, with 12 digits: more than are printed.
    zero = next(root for root in p.zeros if root.positive).decimals(12)[0]
    # The value at some place beyond, to show the sign: the numerator has no second positive zero.
    beyond = float(p(2 * float(zero)))
    numbers = {
        "all_b_positive": positive_b,
        "positive_poles": _positive(p)["poles"],
        "zero": zero,
        "value_at_twice_the_zero": beyond,
    }
    summary = (
        f"all b_i are positive: there is no pole on v* > 0. At v* = {zero} the numerator vanishes: [2/5] passes "
        f"through 0 and is negative beyond ({beyond:.2g} at twice that v*)"
    )
    return Evidence(verdict(p.positive_pole is not None), summary, numbers, "proven")


@claim("digits-of-the-pole", "Table I", "the place is 5.68, or 5.6801")
def _digits_of_the_pole() -> Evidence:
    """Return the evidence: the positive zero of [2/5], rounded to the digits of the two printed numbers."""
    printed = ("5.68", "5.6801")
    # The real part, with 12 digits: more than are printed.
    zero = next(root for root in approximant(2, 5).zeros if root.positive).decimals(12)[0]
    agree = [Decimal(text) == Decimal(zero).quantize(Decimal(text), ROUND_HALF_EVEN) for text in printed]
    numbers = {"printed": list(printed), "ours": zero, "agree": agree}
    summary = f"the zero is at v* = {zero}; both printed values are correct roundings of it"
    return Evidence(verdict(all(agree)), summary, numbers, "proven")


@claim("2-5-for-small-v", "text after Eq. 11", "[2/5] is suitable only for v* up to about 10^0.3")
def _two_five_suitable() -> Evidence:
    """Return the evidence: the errors of [2/5], where they exceed 10 %, and from which v* on [1/4] is closer to eps."""
    error, error_of_1_4 = errors(2, 5).epsilon, errors(1, 4).epsilon
    limit, up_to = first_above(error, SUITABLE), largest(error, SUITED_UP_TO)  # SUITED_UP_TO: the printed 10^0.3
    v = curve().v_star
    # Below v* = 1 both are far better than needed, and an error that passes 0 would make the other "closer" there.
    worse = [float(x) for x in v[(error > error_of_1_4) & (v > 1)]][:1]
    numbers = {
        "largest_error_up_to_10^0.3": up_to,
        "v_star_where_10_percent_off": limit,
        "v_star_where_worse_than_1_4": worse[0] if worse else None,
    }
    crossing = f"from v* = {_from(worse[0])} on [1/4] is closer" if worse else "[1/4] is never closer"
    summary = (
        f"[2/5] is off by {percent_at_most(up_to)} at most up to v* = 10^0.3 = {SUITED_UP_TO:.3f} and by more than "
        f"10 % from v* = {_from(limit)} on; {crossing}"
    )
    # "About 10^0.3": good up to there, no longer good at twice that v*.
    good_up_to = limit is not None and SUITED_UP_TO < limit < 2 * SUITED_UP_TO
    return Evidence(verdict(good_up_to), summary, numbers, "sampled")


@claim("0-3-not-acceptable", "text after Eq. 11", "[0/3] is certainly not acceptable")
def _zero_three() -> Evidence:
    """Return the evidence: the errors of [0/3] at v* = 1 and 2, and b_3 = 0, which makes it [0/2]."""
    numbers = _accuracy(0)
    loss, eps = numbers["1-eps"], numbers["eps"]
    b_3 = approximant(0, 3).b[3]  # -h_3 + …: b_1 = 0, and h_1 = h_3 = 0
    summary = (
        f"eps is off by {percent(eps['1'])} at v* = 1 and {percent(eps['2'])} at 2, 1 - eps by {percent(loss['1'])}; "
        f"as b_3 is exactly {float(b_3):.0f}, [0/3] is [0/2] and decays like v*^-2"
    )
    return Evidence(verdict(max(loss["1"], eps["1"]) > ACCEPTABLE), summary, numbers, "sampled")


@claim("1-4-tradeoff", "text after Eq. 11", "[1/4] is a good compromise of simplicity and accuracy")
def _one_four() -> Evidence:
    """Return the evidence: the errors of [1/4] in eps and in 1 - eps up to several v*.

    It is a good compromise if 1 - eps is within 2 %, eps positive everywhere, and eps within 10 % up to v* = 10; with a
    limit, if only the first two hold.
    """
    numbers = _accuracy(1)
    loss, eps, absolute = numbers["1-eps"], numbers["eps"], numbers["largest_absolute_error"]
    summary = (
        f"1 - eps is within {percent_at_most(loss['100'])} up to v* = 100, eps within {percent_at_most(eps['1'])} up "
        f"to v* = 1 and {percent_at_most(eps['2'])} up to 2, then {percent_at_most(eps['10'])} up to 10 (absolutely "
        f"{at_most(absolute, 2)} at most)"
    )
    good = loss["100"] < TRADEOFF and approximant(1, 4).usable
    return Evidence(verdict(good and eps["10"] < ACCEPTABLE, good), summary, numbers, "sampled")


@claim(
    "3-6-almost-perfect",
    "text after Eq. 11; Fig. 2",
    "[3/6] agrees almost perfectly with the numerical solution, also at large v*",
)
def _three_six() -> Evidence:
    """Return the evidence: the errors of [3/6] in eps and 1 - eps, and the v* from which eps is 1 % and 10 % off.

    "Also at large v*": closer than a line on a logarithmic axis up to v* = 100. With a limit: only on
    a linear axis, which shows the absolute error.
    """
    numbers = _accuracy(3)
    loss, eps, absolute = numbers["1-eps"], numbers["eps"], numbers["largest_absolute_error"]
    error = errors(3, 6).epsilon
    # A curve 1 % off is visibly beside the other one, one 10 % off at a glance.
    limits = {"1_percent": first_above(error, 0.01), "10_percent": first_above(error, 0.1)}
    numbers["v_star_where_off_by"] = limits
    summary = (
        f"absolutely it is within {at_most(absolute, 2)} everywhere and 1 - eps within {percent_at_most(loss['100'])} "
        f"up to v* = 100; but eps itself is more than 1 % off from v* = {_from(limits['1_percent'])} on, more than "
        f"10 % from {_from(limits['10_percent'])} on, "
        f"{percent(eps['10'])} at 10 and {percent(eps['100'])} at 100"
    )
    everywhere = eps["100"] < LINE_LOG
    return Evidence(verdict(everywhere, absolute < LINE_LINEAR), summary, numbers, "sampled")


@claim("15-18-identical", "Fig. 2", "[3/6] and [15/18] are virtually identical")
def _virtually_identical() -> Evidence:
    """Return the evidence: the relative difference of [3/6] and [15/18], and where it exceeds a line's width."""
    v = curve().v_star
    three_six, fifteen_eighteen = (values(approximant(m, m + 3), v)[0] for m in (3, 15))
    difference = abs(three_six / fifteen_eighteen - 1)
    limit = first_above(difference, LINE_LOG)
    apart = {_key(V): largest(difference, V) for V in RANGES}
    numbers = {"largest_relative_difference": apart, "v_star_where_5_percent_apart": limit}
    summary = (
        f"the two differ by at most {percent_at_most(apart['2'])} up to v* = 2, {percent_at_most(apart['5'])} up to 5, "
        f"{percent_at_most(apart['10'])} up to 10 and {percent_at_most(apart['100'])} up to 100: closer than 5 % up to "
        f"v* = {_up_to(limit)}"
    )
    # With a limit: identical at least up to v* = 2, the paper's largest speed for ice.
    return Evidence(verdict(limit is None, apart["2"] < LINE_LOG), summary, numbers, "sampled")


@claim(
    "15-18-almost-perfect",
    "Fig. 2",
    "[15/18] agrees almost perfectly with the exact solution, also at large v*",
)
def _fifteen_eighteen() -> Evidence:
    """Return the evidence: a proven bound of the error of [15/18] for v* <= 10, and enclosed errors at 10 and 100."""
    near, far = 10, 100  # the decade in which it still is a line's width from eps, and the largest v* of `RANGES`
    bound = proven_error(15, near)
    off = {v: enclosed_error(15, v) for v in (near, far)}
    numbers = {
        f"proven_bound_up_to_{near}": bound,
        "relative_error_at": {str(v): float(error.mid()) for v, error in off.items()},
        "line_width": LINE_LOG,
    }
    summary = (
        f"[15/18] is {percent(float(off[near].mid()))} above eps at v* = {near} and {percent(float(off[far].mid()))} "
        f"at v* = {far}; it is proven to be within {percent_at_most(bound)} of eps for all v* <= {near}. Beyond, v*^-3 "
        "falls too slowly"
    )
    return Evidence(verdict(bool(abs(off[far]) < LINE_LOG), bound < LINE_LOG), summary, numbers, "proven")


@claim(
    "convergent-if-m-below-n",
    "text after Eq. 11",
    '[m/n] behaves like a power law for large v*, "thus, convergent if m<n"',
)
def _convergent() -> Evidence:
    """Return the evidence: the positive poles of all [m/m+3] up to [25/28]; at a pole it is not convergent.

    The pole must be one: a residue that is not 0 proves that no zero of the numerator cancels it.
    """
    # A residue that is not 0 proves that no zero of the numerator cancels the pole.
    poles = {
        p.label: pole
        for p in family().values()
        if (pole := p.positive_pole) is not None and pole.residue is not None and not pole.residue.contains(0)
    }
    numbers = {
        "tried": f"[m/m+3], m = 0 … {LARGEST_M}",
        "smallest_positive_pole": {label: pole.decimals(12)[0] for label, pole in poles.items()},  # 12 digits
    }
    shown = "; ".join(f"{label} at v* = {pole.decimals(4)[0]}" for label, pole in poles.items())
    summary = (
        f"m < n makes [m/n] vanish for v* to infinity, but not finite before: of the [m/m+3] up to m = {LARGEST_M}, "
        f"{len(poles)} have poles on v* > 0 ({shown or 'none'})"
    )
    return Evidence(verdict(not poles), summary, numbers, "proven")


@claim("no-improvement", "text after Eq. 11", "no order up to [25/28] is significantly better than [3/6]")
def _no_improvement() -> Evidence:
    """Return the evidence: the largest errors of [3/6] and of the best higher [m/m+3], up to v* = 1, 2, 5, 10, 100."""
    table = accuracy_table()
    # Orders beyond [3/6], m = 3, that are finite and positive for all v*.
    usable = [m for m in range(4, LARGEST_M + 1) if approximant(m, m + 3).usable]
    # Range -> m -> largest error; below ROUNDING only round-off is compared.
    seen = {_key(V): {m: max(table[m]["eps"][_key(V)], ROUNDING) for m in (3, *usable)} for V in RANGES}
    best = {key: min(usable, key=lambda m, row=row: row[m]) for key, row in seen.items()}  # type: ignore[misc]
    gain = {key: row[3] / row[best[key]] for key, row in seen.items()}
    numbers = {
        "errors": {f"[{m}/{m + 3}]": row for m, row in table.items()},
        "best_m": best,
        "improvement": gain,
        # From enclosures, because at v* = 1 errors of high orders are below round-off.
        "error_at_1": {f"[{m}/{m + 3}]": error_at(m, 1) for m in (3, best["10"])},
    }

    def or_less(error: float) -> str:
        """Return a bound of an error as text, to two digits; "less than 4e-15" if it is round-off."""
        return at_most(error, 2) if error > ROUNDING else f"less than {error:.0e}"

    comparisons = (
        f"{at_most(seen[key][3], 2)} for [3/6] against {or_less(seen[key][m])} for [{m}/{m + 3}] up to v* = {key}"
        for key, m in best.items()
    )
    summary = "relative errors of eps, at most: " + "; ".join(comparisons)
    better = [g > SIGNIFICANT for g in gain.values()]
    # With a limit: significantly better in one of the five ranges only.
    return Evidence(verdict(not any(better), sum(better) <= 1), summary, numbers, "sampled")


@claim(
    "higher-orders-usable",
    "text after Eq. 11",
    "[2/5] is the order that is spoilt by a pole (no other up to [25/28] is mentioned)",
)
def _higher_poles() -> Evidence:
    """Return the evidence: the m up to 25 for which [m/m+3] has a pole, or only a zero, on v* > 0."""
    positive_roots = {m: _positive(p) for m, p in family().items()}
    poles = {m: roots["poles"] for m, roots in positive_roots.items() if roots["poles"]}
    zeros = {m: roots["zeros"] for m, roots in positive_roots.items() if roots["zeros"] and m not in poles}
    numbers = {
        "positive_poles": {str(m): p for m, p in poles.items()},
        "only_zeros": {str(m): z for m, z in zeros.items()},
    }
    clean = [m for m in NAMED if m not in poles and m not in zeros]
    summary = (
        f"[m/m+3] up to m = {LARGEST_M} has poles on v* > 0 for m = {_listed(poles)}, and a zero there, with eps < 0 "
        f"beyond, for m = {_listed(zeros)}; of the others that the paper names, m = {_listed(clean)} have neither"
    )
    only_that_one = set(poles) | set(zeros) == {2}  # m of [2/5], the only one that the paper mentions
    return Evidence(verdict(only_that_one, clean == list(NAMED)), summary, numbers, "proven")


def _listed(numbers: Iterable[int]) -> str:
    """Return numbers as "2, 5, 7"."""
    return ", ".join(map(str, numbers))


@claim(
    "no-divergence",
    "requirement c) before the numerical solution",
    "unlike truncated series, [1/4] and [3/6] diverge nowhere",
)
def _no_divergence() -> Evidence:
    """Return the evidence: [1/4] and [3/6] are proven finite and positive for all v*, and tend to 0."""
    recommended = [approximant(1, 4), approximant(3, 6)]
    summary = "; ".join(f"{p.label}: {p.verdict}" for p in recommended)
    numbers = {"usable": {p.label: p.usable for p in recommended}}
    return Evidence(verdict(all(p.usable for p in recommended)), summary, numbers, "proven")


@claim(
    "entire-range",
    "text before Eq. 11; Conclusion",
    "[1/4] and [3/6] represent eps at all speeds, asymptotic behaviour included, with excellent accuracy",
)
def _entire_range() -> Evidence:
    """Return the evidence: errors of [1/4] and [3/6], absolute and of 1 - eps anywhere, relative of eps at large v*.

    They represent the asymptotic behaviour if the relative error of eps is small at v* = 1000, the last point of the
    grid; with a limit, if only the absolute errors are.
    """
    # v* of three decades show that the relative error grows like v*^(1/3), by a factor of 2.15 each.
    relative = {
        label: {f"{v:g}": error_near(errors(m, m + 3).epsilon, v) for v in (10.0, 100.0, 1000.0)}
        for m, label in _RECOMMENDED
    }
    absolute = {label: float(errors(m, m + 3).absolute.max()) for m, label in _RECOMMENDED}
    loss = {label: float(errors(m, m + 3).loss.max()) for m, label in _RECOMMENDED}
    numbers = {"relative_error_at": relative, "largest_absolute_error": absolute, "largest_error_of_1-eps": loss}
    summary = (
        f"absolutely and in 1 - eps they are ({at_most(absolute['[1/4]'], 2)} and {percent_at_most(loss['[1/4]'])} at "
        f"most for [1/4], {at_most(absolute['[3/6]'], 2)} and {percent_at_most(loss['[3/6]'])} for [3/6]); the "
        "relative error of eps is not bounded: "
        f"{percent(relative['[1/4]']['1000'])} and {percent(relative['[3/6]']['1000'])} at v* = 1000"
    )
    bounded = all(row["1000"] < LINE_LOG for row in relative.values())
    return Evidence(verdict(bounded, max(absolute.values()) < ALMOST_COINCIDES), summary, numbers, "sampled")


_RECOMMENDED = ((1, "[1/4]"), (3, "[3/6]"))


@claim("figure-of-truncations", "Fig. 1", "[1/4] almost coincides with the numerical solution")
def _figure_of_truncations() -> Evidence:
    """Return the evidence: the largest distance of [1/4] from eps in the figure, which ends at v* = 1.5 or 2.

    The text does not say where; these are the two likely ends of an axis that shows the divergence of S_40 and S_5.
    """
    error = errors(1, 4)
    near = {f"{V:g}": largest(error.absolute, V) for V in (1.5, 2.0)}
    numbers = {
        "largest_absolute_error": near,
        "anywhere": float(error.absolute.max()),
        "assumed_range": "v* <= 1.5 or 2",
    }
    summary = (
        f"on the linear axis from 0 to 1 the curves are {at_most(near['1.5'], 2)} apart at most up to v* = 1.5 and "
        f"{at_most(near['2'], 2)} up to 2, wherever between the figure ended: one to two line widths"
    )
    return Evidence(verdict(near["2"] < ALMOST_COINCIDES), summary, numbers, "sampled")


@claim(
    "figure-linear",
    "Fig. 3",
    "[3/6] coincides almost perfectly with the solution in the entire range, on a linear axis",
)
def _figure_linear() -> Evidence:
    """Return the evidence: the largest |[3/6] - eps|, its v*, and the width of a line on the axis from 0 to 1."""
    absolute = float(errors(3, 6).absolute.max())
    v = float(curve().v_star[errors(3, 6).absolute.argmax()])
    summary = (
        f"[3/6] is within {at_most(absolute, 2)} of eps at every v* (worst at v* = {v:.2f}): invisible on a linear axis"
    )
    numbers = {"largest_absolute_error": absolute, "at_v_star": v, "line_width": LINE_LINEAR}
    return Evidence(verdict(absolute < LINE_LINEAR), summary, numbers, "sampled")


# --- numbers ----------------------------------------------------------------------------------------------------------


def _positive(p: Pade) -> dict[str, list[str]]:
    """Return the positive real "poles" and "zeros" of an approximant, with 12 digits: more than are printed."""
    roots_by_kind = {"poles": p.poles, "zeros": p.zeros}
    return {kind: [root.decimals(12)[0] for root in roots if root.positive] for kind, roots in roots_by_kind.items()}


def _accuracy(m: int) -> dict[str, Any]:
    """Return the largest errors of [m/m+3] on (0, V]; None if a pole is there, which sampling may miss.

    "eps" -> V of `RANGES` as text -> relative error of eps; "1-eps" -> V -> relative error of 1 - eps;
    "largest_absolute_error" -> that of eps at any v*.
    """
    error, pole = errors(m, m + 3), approximant(m, m + 3).positive_pole
    end = math.inf if pole is None else float(pole.value.real)
    return {
        "eps": {_key(V): largest(error.epsilon, V) if end > V else None for V in RANGES},
        "1-eps": {_key(V): largest(error.loss, V) if end > V else None for V in RANGES},
        "largest_absolute_error": float(error.absolute.max()) if pole is None else None,
    }


@lru_cache(maxsize=1)
def accuracy_table() -> dict[int, dict[str, Any]]:
    """Return the largest errors of all [m/m+3] up to [25/28]."""
    return {m: _accuracy(m) for m in family()}


def _from(v_star: float | None) -> str:
    """Return the beginning of a range of v*, rounded into it."""
    return "infinity" if v_star is None else at_most(v_star)


def _up_to(v_star: float | None) -> str:
    """Return the end of a range of v*, rounded into it."""
    return "infinity" if v_star is None else at_least(v_star)


def _key(v_star: float) -> str:
    """Return a v* as a key for JSON: "1", "2.5"."""
    return f"{v_star:g}"


CLAIMS: tuple[Claim, ...] = (
    _table_entries,
    _order_conditions,
    _convergent,
    _pole_of_two_five,
    _digits_of_the_pole,
    _two_five_suitable,
    _zero_three,
    _one_four,
    _three_six,
    _virtually_identical,
    _fifteen_eighteen,
    _no_improvement,
    _higher_poles,
    _no_divergence,
    _entire_range,
    _figure_of_truncations,
    _figure_linear,
)
