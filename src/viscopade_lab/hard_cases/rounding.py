"""Round-off of exported functions.

Is any exported function farther off than is proven, where round-off is worst, overflow threatens, or eps is nearly 1?

A search finds the arguments with the largest round-off (`worst`). N(v*)/D(v*), written down plainly, becomes 0 where D
overflows, long before eps does, and NaN where N overflows too; exported code changes to powers of 1/v*. And 1 - eps,
computed as a difference, loses its digits near v* = 0: a computed eps is a multiple of u = 2^-53, off by up to u/2.
Functions that give 1 - eps do not use that difference.
"""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from fractions import Fraction
from typing import TYPE_CHECKING, NamedTuple

import numpy as np
from flint import arb

from viscopade.arithmetic.balls import working
from viscopade.arithmetic.formats import DOUBLE, FORMATS
from viscopade.arrays import double
from viscopade.kernels import requests, truth
from viscopade.kernels.forms import formulas, last_place
from viscopade.kernels.machine import TYPES, computed
from viscopade.plots.sheet import BLACK, BLUE, GREEN, PURPLE, VERMILION
from viscopade.progress import track
from viscopade_lab.hard_cases.case import Finding, Row
from viscopade_lab.hard_cases.worst import BITS, functions, worst

if TYPE_CHECKING:
    from matplotlib.figure import Figure

FAMILIES = {
    "quotients": "quotients of polynomials in v*",
    "inverse": "inverse kernels",
    "compact": "kernels of speed without tables",
    "tables": "rows of speed tables",
    "full": "full accuracy",
}
ELASTIC = 10.0 ** -np.arange(1.0, 151.0)  # v* where 1 - eps is a normal number


class FarQuotient(NamedTuple):
    """A quotient at v* of all sizes, in a type.

    `lost` counts results that are no finite number, `error` is the largest one relative to the bound of the leading
    terms' rounding, `plain` the v* from which N/D as written down is 0 or NaN.
    """

    name: str
    lost: int
    error: float
    plain: float


def far_quotients() -> list[FarQuotient]:
    """Evaluate all quotients at every power of two of their types, and at the ends."""
    found = []
    for kernel in (*requests.PAPER.quotients(), *requests.RECOMMENDED.quotients()):
        for form in FORMATS.values():
            try:
                a, b = kernel.rounded(form)
            except ValueError:  # there are no functions of a type that does not hold the coefficients
                continue
            kind, constants = TYPES[form.name], formulas.dense(a=a, b=b)
            x = np.concatenate([np.ldexp(kind(1), np.arange(-form.largest - 20, form.largest + 1)), [0, np.inf]])
            x = np.append(x, np.finfo(kind).max).astype(kind)
            given = {name: kind(c) for name, c in constants.items()} | {"v_star": x}
            with np.errstate(all="ignore"):
                near, far = (
                    np.asarray(computed(one, "epsilon", given, form)) for one in formulas.epsilon_branches(constants)
                )
            values = np.where(x > 2.0 ** kernel.threshold(form), far, near)
            wrong = ~np.isfinite(near) | (near == 0)
            plain = float(x[wrong & np.isfinite(x)].min(initial=np.inf))
            lead = Fraction(a[-1]) / Fraction(b[-1])
            # Rounded are 1/v*, each of its powers, two sums that are nearly their first terms (3/2 u), the quotient.
            power = len(b) - len(a)
            allowed = (2 * power + 8) * 2.0**-form.precision * 1.001
            error = max(
                (_relative(float(y), v, lead, power) for v, y in zip(x.tolist(), values.tolist(), strict=True)
                 if 2.0**60 < v < math.inf and abs(y) > 2.0 ** (1 - form.largest)), default=0.0,
            )  # fmt: skip
            found.append(FarQuotient(kernel.label, int((~np.isfinite(values)).sum()), error / allowed, plain))
    return found


def _relative(value: float, v_star: float, lead: Fraction, power: int) -> float:
    """Return the relative error of a value that should be lead v*^-power."""
    return abs(float(Fraction(value) * Fraction(v_star) ** power / lead - 1))


def losses() -> Mapping[str, list[float]]:
    """Return the relative errors of 1 - eps at `ELASTIC`: naive, of full accuracy, and of `viscopade`'s arrays."""
    ways = {
        "1 minus eps of full accuracy": 1 - np.asarray(last_place.evaluated("epsilon", ELASTIC)),
        "one_minus_epsilon of full accuracy": np.asarray(last_place.evaluated("one_minus_epsilon", ELASTIC)),
        "viscopade.one_minus_epsilon": np.asarray(double.one_minus_epsilon(ELASTIC)),
    }
    with working(BITS):
        exact = [truth.enclosed(arb(v)).loss for v in ELASTIC.tolist()]
        return {
            name: [float(abs(arb(y) - loss) / loss) for y, loss in zip(values.tolist(), exact, strict=True)]
            for name, values in ways.items()
        }


def naive_in_octaves() -> list[float]:
    """Return the largest error of 1 minus eps in each octave of 1 - eps, in units of u/2, u = 2^-53."""
    found = []
    for octave in range(2, DOUBLE.precision):
        # 1 - eps is 1.1534 v*^2, nearly.
        low, high = (math.log(2.0**-e / 1.1534) / 2 for e in (octave, octave - 1))
        x = np.exp(np.random.default_rng(octave).uniform(low, high, 60))
        with working(BITS):
            exact = [truth.enclosed(arb(v)).loss for v in x.tolist()]
            values = (1 - np.asarray(last_place.evaluated("epsilon", x))).tolist()
            found.append(max(float(abs(arb(y) - loss)) for y, loss in zip(values, exact, strict=True)) * 2.0**54)
    return found


def measure(thorough: bool) -> Finding:
    """Search all functions, and look at both ends."""
    rows, number, rounds = (16, 2000, 12) if thorough else (2, 60, 1)
    chosen = list(functions(rows))
    errors: dict[str, list[float]] = {family: [] for family in FAMILIES}
    for i in track(range(len(chosen)), "worst rounding errors"):
        share = rows + 2 if chosen[i].family == "tables" else 1
        errors[chosen[i].family].append(worst(chosen[i], max(number // share, 20), rounds).error)
    return judged(errors, far_quotients(), losses(), naive_in_octaves())


def judged(
    errors: Mapping[str, Sequence[float]],
    far: Sequence[FarQuotient],
    lost: Mapping[str, Sequence[float]],
    naive: Sequence[float],
) -> Finding:
    """Hold all errors to their bounds."""
    naive_way, full, arrays = lost
    ulp = 2.0**-52
    rows = (
        *(Row(f"{FAMILIES[family]}: largest round-off / proven bound", max(e), 1) for family, e in errors.items()),
        Row("quotients at v* of all sizes: results that are no finite number", sum(one.lost for one in far), 0),
        Row("quotients at large v*: error / bound of leading terms", max(one.error for one in far), 1),
        Row(
            "1 - eps of full accuracy, v* to 1e-150: error / proven bound",
            max(lost[full]) / (float(last_place.largest_ulp("one_minus_epsilon")) * ulp),
            1,
        ),
        Row(
            "1 - eps of arrays, v* to 1e-150: error / stated bound",
            max(lost[arrays]) / (double.ULP["one_minus_epsilon"] * ulp),
            1,
        ),
        Row("1 minus eps: error, in units of 2^-54 (the last rounding allows 1.01)", max(naive), 1.01),
    )
    first = min(far, key=lambda one: one.plain)
    at = int(np.argmin(abs(ELASTIC - 1e-8)))
    summary = (
        f"The search covered {sum(map(len, errors.values()))} functions, branches and rows of tables, in float and "
        f"double. It finds from {min(map(max, errors.values())):.2f} ({min(errors, key=lambda f: max(errors[f]))}) to "
        f"{max(map(max, errors.values())):.3f} ({max(errors, key=lambda f: max(errors[f]))}) of the proven bounds. "
        f"Written down plainly, {first.name} would be 0 or NaN from v* = {first.plain:.2g} on; as exported, every "
        f"quotient stays a number. At v* = 1e-8 a difference 1 minus eps is off by {lost[naive_way][at]:.0%}, and "
        f"one_minus_epsilon by {lost[full][at]:.1e}."
    )

    def draw(figure: Figure) -> None:
        left, right = figure.subplots(1, 2)
        start = 0
        for (family, values), color, mark in zip(
            errors.items(), (BLUE, VERMILION, GREEN, PURPLE, BLACK), "os^vD", strict=True
        ):
            left.plot(range(start, start + len(values)), values, mark, color=color, markersize=3, label=family)
            start += len(values)
        left.axhline(1, color=BLACK, linewidth=0.8)
        left.set(title="round-off / proven bound", xlabel="function, branch or row", ylim=(0, 1.45))
        left.legend(loc="upper center", ncols=3, frameon=False, fontsize=8, columnspacing=0.6, handletextpad=0.1)
        for name, color, mark in zip(lost, (VERMILION, BLUE, GREEN), "ox^", strict=True):
            v, e = zip(
                *((v, max(e, 1e-18)) for v, e in zip(ELASTIC, lost[name], strict=True) if v > 1e-17), strict=True
            )
            right.loglog(v, e, mark, color=color, markersize=4, label=name.replace("eps ", r"$\varepsilon$ "))
        right.set(title=r"relative error of $1 - \varepsilon$", xlabel=r"$v_\ast$", ylim=(1e-19, 1e9))
        right.legend(loc="upper right", frameon=False, fontsize=8)

    return Finding(rows, summary, draw)
