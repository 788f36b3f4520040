"""The paper's statements about the Padé approximants [m/m+3]: table, poles, accuracy, figures."""

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
    at,
    curve,
    enclosed_error,
    error_at,
    errors,
    family,
    first_above,
    largest,
    proven_error,
    values,
)
from viscopade_lab.claims.evidence import Claim, Evidence, claim, percent, percent_at_most, verdict

# An approximant with a larger error of eps is no longer "suitable".
SUITABLE = 0.1
# "Acceptable" allows 10 % in the loss 1 - eps at v* <= 1, where collisions of hard materials are.
ACCEPTABLE = 0.1
# "Good tradeoff": 1 - eps, what a simulation's cooling depends on, within 2 % at every speed.
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
# Errors of 1e-15 are round-off.
ROUNDING = 4e-15


@claim("table-entries", "tab:padeCoeffs", "the coefficients a_i, b_i of [0/3], [1/4], [2/5] and [3/6]")
def _table_entries() -> Evidence:
    entries = compare(approximants(PADE_DIGITS))
    wrong = [f"[{e.m}/{e.n}] {e.name}" for e in entries if not e.agrees]
    numbers = {
        "entries": len(entries),
        "disagree": wrong,
        "ours": {f"[{e.m}/{e.n}] {e.name}": e.rounded for e in entries},
    }
    summary = f"{len(entries) - len(wrong)} of {len(entries)} printed numbers are ours, correctly rounded"
    return Evidence(verdict(not wrong), summary, numbers, "proven")


@claim("order-conditions", "text after eq:padeDef", "[m/n] has the Maclaurin series of eps up to order m + n")
def _order_conditions() -> Evidence:
    contact = {approximant(m, n).label: approximant(m, n).contact_order for m, n in TABLE}
    met = all(order >= m + n for (m, n), order in zip(TABLE, contact.values(), strict=True))
    summary = "the series of " + ", ".join(f"{label} agrees up to v*^{order}" for label, order in contact.items())
    return Evidence(verdict(met), summary, {"agrees_up_to_order": contact}, "proven")


@claim("pole-of-2-5", "text after eq:padeDef; tab:padeCoeffs", "[2/5] has a pole at v* = 5.68")
def _pole_of_two_five() -> Evidence:
    p = approximant(2, 5)
    positive_b = all(b > 0 for b in p.b)
    zero = next(root for root in p.zeros if root.positive).decimals(12)[0]
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


@claim("digits-of-the-pole", "tab:padeCoeffs", "the place is 5.68, or 5.6801")
def _digits_of_the_pole() -> Evidence:
    printed = ("5.68", "5.6801")
    zero = next(root for root in approximant(2, 5).zeros if root.positive).decimals(12)[0]
    agree = [Decimal(text) == Decimal(zero).quantize(Decimal(text), ROUND_HALF_EVEN) for text in printed]
    numbers = {"printed": list(printed), "ours": zero, "agree": agree}
    summary = f"the zero is at v* = {zero}; both printed values are correct roundings of it"
    return Evidence(verdict(all(agree)), summary, numbers, "proven")


@claim("2-5-for-small-v", "text after eq:padeDef", "[2/5] is suitable only for v* up to about 10^0.3")
def _two_five_suitable() -> Evidence:
    error, other = errors(2, 5).epsilon, errors(1, 4).epsilon
    limit, up_to = first_above(error, SUITABLE), largest(error, SUITED_UP_TO)
    v = curve().v_star
    worse = [float(x) for x in v[(error > other) & (v > 1)]][:1]
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
    good_up_to = limit is not None and SUITED_UP_TO < limit < 2 * SUITED_UP_TO
    return Evidence(verdict(good_up_to), summary, numbers, "sampled")


@claim("0-3-not-acceptable", "text after eq:padeDef", "[0/3] is certainly not acceptable")
def _zero_three() -> Evidence:
    numbers = _accuracy(0)
    loss, eps = numbers["1-eps"], numbers["eps"]
    b_3 = approximant(0, 3).b[3]
    summary = (
        f"eps is off by {percent(eps['1'])} at v* = 1 and {percent(eps['2'])} at 2, 1 - eps by {percent(loss['1'])}; "
        f"as b_3 is exactly {float(b_3):.0f}, [0/3] is [0/2] and decays like v*^-2"
    )
    return Evidence(verdict(max(loss["1"], eps["1"]) > ACCEPTABLE), summary, numbers, "sampled")


@claim("1-4-tradeoff", "text after eq:padeDef", "[1/4] is a good compromise of simplicity and accuracy")
def _one_four() -> Evidence:
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
    "text after eq:padeDef; fig:tryingDifferentPade",
    "[3/6] agrees almost perfectly with the numerical solution, also at large v*",
)
def _three_six() -> Evidence:
    numbers = _accuracy(3)
    loss, eps, absolute = numbers["1-eps"], numbers["eps"], numbers["largest_absolute_error"]
    error = errors(3, 6).epsilon
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


@claim("15-18-identical", "fig:tryingDifferentPade", "[3/6] and [15/18] are virtually identical")
def _virtually_identical() -> Evidence:
    v = curve().v_star
    low, high = (values(approximant(m, m + 3), v)[0] for m in (3, 15))
    difference = abs(low / high - 1)
    limit = first_above(difference, LINE_LOG)
    apart = {_key(V): largest(difference, V) for V in RANGES}
    numbers = {"largest_relative_difference": apart, "v_star_where_5_percent_apart": limit}
    summary = (
        f"the two differ by at most {percent_at_most(apart['2'])} up to v* = 2, {percent_at_most(apart['5'])} up to 5, "
        f"{percent_at_most(apart['10'])} up to 10 and {percent_at_most(apart['100'])} up to 100: closer than 5 % up to "
        f"v* = {_up_to(limit)}"
    )
    return Evidence(verdict(limit is None, apart["2"] < LINE_LOG), summary, numbers, "sampled")


@claim(
    "15-18-almost-perfect",
    "fig:tryingDifferentPade",
    "[15/18] agrees almost perfectly with the exact solution, also at large v*",
)
def _fifteen_eighteen() -> Evidence:
    near, far = 10, 100
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
    "text after eq:padeDef",
    '[m/n] behaves like a power law for large v*, "thus, convergent if m<n"',
)
def _convergent() -> Evidence:
    # A residue that is not 0 proves that no zero of the numerator cancels the pole.
    poles = {
        p.label: pole
        for p in family().values()
        if (pole := p.positive_pole) is not None and pole.residue is not None and not pole.residue.contains(0)
    }
    numbers = {
        "tried": f"[m/m+3], m = 0 … {LARGEST_M}",
        "smallest_positive_pole": {label: pole.decimals(12)[0] for label, pole in poles.items()},
    }
    shown = "; ".join(f"{label} at v* = {pole.decimals(4)[0]}" for label, pole in poles.items())
    summary = (
        f"m < n makes [m/n] vanish for v* to infinity, but not finite before: of the [m/m+3] up to m = {LARGEST_M}, "
        f"{len(poles)} have poles on v* > 0 ({shown or 'none'})"
    )
    return Evidence(verdict(not poles), summary, numbers, "proven")


@claim("no-improvement", "text after eq:padeDef", "no order up to [25/28] is significantly better than [3/6]")
def _no_improvement() -> Evidence:
    table = accuracy_table()
    usable = [m for m in range(4, LARGEST_M + 1) if approximant(m, m + 3).usable]
    seen = {_key(V): {m: max(table[m]["eps"][_key(V)], ROUNDING) for m in (3, *usable)} for V in RANGES}
    best = {key: min(usable, key=lambda m, row=row: row[m]) for key, row in seen.items()}  # type: ignore[misc]
    gain = {key: row[3] / row[best[key]] for key, row in seen.items()}
    numbers = {
        "errors": {f"[{m}/{m + 3}]": row for m, row in table.items()},
        "best_m": best,
        "improvement": gain,
        "error_at_1": {f"[{m}/{m + 3}]": error_at(m, 1) for m in (3, best["10"])},
    }
    parts = (
        f"{at_most(seen[key][3], 2)} for [3/6] against {_or_less(seen[key][m])} for [{m}/{m + 3}] up to v* = {key}"
        for key, m in best.items()
    )
    summary = "relative errors of eps, at most: " + "; ".join(parts)
    better = [g > SIGNIFICANT for g in gain.values()]
    return Evidence(verdict(not any(better), sum(better) <= 1), summary, numbers, "sampled")


@claim(
    "higher-orders-usable",
    "text after eq:padeDef",
    "[2/5] is the order that is spoilt by a pole (no other up to [25/28] is mentioned)",
)
def _higher_poles() -> Evidence:
    found = {m: _positive(p) for m, p in family().items()}
    poles = {m: roots["poles"] for m, roots in found.items() if roots["poles"]}
    zeros = {m: roots["zeros"] for m, roots in found.items() if roots["zeros"] and m not in poles}
    numbers = {
        "positive_poles": {str(m): p for m, p in poles.items()},
        "only_zeros": {str(m): z for m, z in zeros.items()},
    }
    clean = [m for m in NAMED if m not in poles and m not in zeros]
    summary = (
        f"[m/m+3] up to m = {LARGEST_M} has poles on v* > 0 for m = {_listed(poles)}, and a zero there, with eps < 0 "
        f"beyond, for m = {_listed(zeros)}; of the others that the paper names, m = {_listed(clean)} have neither"
    )
    only_that_one = set(poles) | set(zeros) == {2}
    return Evidence(verdict(only_that_one, clean == list(NAMED)), summary, numbers, "proven")


def _listed(numbers: Iterable[int]) -> str:
    return ", ".join(map(str, numbers))


@claim(
    "no-divergence",
    "request c) before the numerical solution",
    "unlike truncated series, [1/4] and [3/6] diverge nowhere",
)
def _no_divergence() -> Evidence:
    recommended = [approximant(1, 4), approximant(3, 6)]
    summary = "; ".join(f"{p.label}: {p.verdict}" for p in recommended)
    numbers = {"usable": {p.label: p.usable for p in recommended}}
    return Evidence(verdict(all(p.usable for p in recommended)), summary, numbers, "proven")


@claim(
    "entire-range",
    "text before eq:padeDef; Conclusion",
    "[1/4] and [3/6] represent eps at all speeds, asymptotic behaviour included, with excellent accuracy",
)
def _entire_range() -> Evidence:
    relative = {
        label: {f"{v:g}": at(errors(m, m + 3).epsilon, v) for v in (10.0, 100.0, 1000.0)} for m, label in _RECOMMENDED
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


@claim("figure-of-truncations", "fig:seriesDiverging", "[1/4] almost coincides with the numerical solution")
def _figure_of_truncations() -> Evidence:
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
    "fig:tryingDifferentPadeLin",
    "[3/6] coincides almost perfectly with the solution in the entire range, on a linear axis",
)
def _figure_linear() -> Evidence:
    absolute = float(errors(3, 6).absolute.max())
    v = float(curve().v_star[errors(3, 6).absolute.argmax()])
    summary = (
        f"[3/6] is within {at_most(absolute, 2)} of eps at every v* (worst at v* = {v:.2f}): invisible on a linear axis"
    )
    numbers = {"largest_absolute_error": absolute, "at_v_star": v, "line_width": LINE_LINEAR}
    return Evidence(verdict(absolute < LINE_LINEAR), summary, numbers, "sampled")


# --- numbers ----------------------------------------------------------------------------------------------------------


def _positive(p: Pade) -> dict[str, list[str]]:
    """Return the positive real poles and zeros."""
    found = {"poles": p.poles, "zeros": p.zeros}
    return {kind: [root.decimals(12)[0] for root in roots if root.positive] for kind, roots in found.items()}


def _accuracy(m: int) -> dict[str, Any]:
    """Return the largest errors of [m/m+3] on (0, V]; None if a pole is there, which sampling may miss."""
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


def _or_less(error: float) -> str:
    return at_most(error, 2) if error > ROUNDING else f"less than {error:.0e}"


def _from(v_star: float | None) -> str:
    """Return the beginning of a range of v*, rounded into it."""
    return "infinity" if v_star is None else at_most(v_star)


def _up_to(v_star: float | None) -> str:
    """Return the end of a range of v*, rounded into it."""
    return "infinity" if v_star is None else at_least(v_star)


def _key(v_star: float) -> str:
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
