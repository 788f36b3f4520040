"""Round-off of exported functions.

Does any exported function exceed its proven error where round-off is worst, at overflow, or near eps = 1?

A search finds the arguments with the largest round-off (`worst`). The plain quotient N(v*)/D(v*) becomes 0 where D
overflows, long before eps does, and NaN where N overflows too; exported code changes to powers of 1/v*. The difference
1 - eps loses its digits near v* = 0: functions that return 1 - eps do not use that difference.
"""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from fractions import Fraction
from typing import TYPE_CHECKING, NamedTuple

import numpy as np
from flint import arb

from viscopade.arithmetic.balls import working
from viscopade.arithmetic.formats import FORMATS
from viscopade.kernels import catalogue, full, truth
from viscopade.kernels.machine import TYPES, branch_value, function_values
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
    """A quotient at v* of all sizes, in one format.

    `error` is the largest error at large v*, relative to the bound of the leading terms' rounding; it is infinite if
    any result is not finite. `plain` is the v* from which the plain quotient N/D is 0 or NaN.
    """

    name: str
    error: float
    plain: float


def far_quotients() -> list[FarQuotient]:
    """Evaluate the quotients of unbounded range at every power of two of their formats, and at the ends."""
    found = []
    for kernel in (entry.kernel for entry in catalogue.group("pade")):
        for form in (FORMATS[name] for name in kernel.formats if "high" not in kernel.constants[name]):
            kind, constants = TYPES[form.name], kernel.constants[form.name]
            x = np.concatenate([np.ldexp(kind(1), np.arange(-form.largest - 20, form.largest + 1)), [0, np.inf]])
            x = np.append(x, np.finfo(kind).max).astype(kind)
            with np.errstate(all="ignore"):
                given = {name: kind(c) for name, c in constants.items()} | {"v_star": x}
                near = np.asarray(branch_value(kernel.function("epsilon").branches[-1], "epsilon", given, form))
            values = function_values(kernel, "epsilon", x, form=form)
            plain = float(x[(~np.isfinite(near) | (near == 0)) & np.isfinite(x)].min(initial=np.inf))
            m, n = (max(int(name[1:]) for name in constants if name[0] == letter) for letter in "ab")
            lead, power = Fraction(constants[f"a{m}"]) / Fraction(constants[f"b{n}"]), n - m
            # Roundings: 1/v*, each of its powers, two sums that are nearly their first terms (3/2 u), the quotient.
            allowed = (2 * power + 8) * 2.0**-form.precision * 1.001
            error = 0.0 if np.isfinite(values).all() else math.inf
            for y, v in zip(values.tolist(), x.tolist(), strict=True):
                if 2.0**60 < v < math.inf and 2.0 ** (1 - form.largest) < abs(y) < math.inf:
                    error = max(error, abs(float(Fraction(y) * Fraction(v) ** power / lead - 1)) / allowed)
            found.append(FarQuotient(kernel.label, error, plain))
    return found


def losses() -> tuple[list[float], list[float]]:
    """Return the relative errors of 1 - eps at `ELASTIC`: as a difference of full accuracy, and by its own function."""
    ways = (
        1 - np.asarray(function_values(full.full(), "epsilon", ELASTIC)),
        np.asarray(function_values(full.full(), "one_minus_epsilon", ELASTIC)),
    )
    with working(BITS):
        exact = [truth.exact_portions(arb(v)).loss for v in ELASTIC.tolist()]
        difference, direct = (
            [float(abs(arb(y) - loss) / loss) for y, loss in zip(way.tolist(), exact, strict=True)] for way in ways
        )
    return difference, direct


def measure(thorough: bool) -> Finding:
    """Search all functions, and evaluate them at both ends."""
    rows, number, rounds = (16, 2000, 12) if thorough else (2, 60, 1)
    chosen = list(functions(rows))
    errors: dict[str, list[float]] = {family: [] for family in FAMILIES}
    for i in track(range(len(chosen)), "worst rounding errors"):
        share = rows + 2 if chosen[i].family == "tables" else 1
        errors[chosen[i].family].append(worst(chosen[i], max(number // share, 20), rounds).error)
    return judged(errors, far_quotients(), *losses())


def judged(
    errors: Mapping[str, Sequence[float]],
    far: Sequence[FarQuotient],
    difference: Sequence[float],
    direct: Sequence[float],
) -> Finding:
    """Compare all errors with their bounds."""
    first = min(far, key=lambda one: one.plain)
    at = int(np.argmin(abs(ELASTIC - 1e-8)))
    rows = (
        *(Row(f"{FAMILIES[family]}: largest round-off / proven bound", max(e), 1) for family, e in errors.items()),
        Row("quotients at large v*: error / bound of leading terms", max(one.error for one in far), 1),
        Row(
            "1 - eps of full accuracy, v* to 1e-150: error / proven bound",
            max(direct) / (float(full.largest_ulp("one_minus_epsilon")) * 2.0**-52),
            1,
        ),
        Row(f"v* from which {first.name}, as the plain quotient N/D, is 0 or NaN", first.plain),
        Row("relative error of the difference 1 - eps at v* = 1e-8", difference[at]),
        Row("relative error of one_minus_epsilon at v* = 1e-8", direct[at]),
    )
    summary = (
        f"No exported function exceeds its proven error. The search covered {sum(map(len, errors.values()))} "
        "functions, branches and rows of tables, in float and double. At large v* every exported quotient remains "
        "finite, where the plain quotient overflows. Near v* = 0 one_minus_epsilon keeps all digits, which the "
        "difference 1 - eps loses."
    )

    def draw(figure: Figure) -> None:
        axes = figure.subplots()
        start = 0
        for (family, values), color, mark in zip(
            errors.items(), (BLUE, VERMILION, GREEN, PURPLE, BLACK), "os^vD", strict=True
        ):
            axes.plot(range(start, start + len(values)), values, mark, color=color, markersize=3, label=family)
            start += len(values)
        axes.axhline(1, color=BLACK, linewidth=0.8, label="bound")
        axes.set(ylabel="round-off / proven bound", xlabel="function, branch or row of a table", ylim=(0, 1.25))
        axes.legend(loc="upper center", ncols=6, columnspacing=1.2, handletextpad=0.4)

    return Finding(rows, summary, draw)
