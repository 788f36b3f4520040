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
    from matplotlib.axes import Axes

FAMILIES = {
    "quotients": "quotients of polynomials in v*",
    "inverse": "inverse kernels",
    "compact": "kernels of speed without tables",
    "tables": "rows of speed tables",
    "full": "full accuracy",
}
"""Groups of exported functions, and how the table calls them."""
ELASTIC = 10.0 ** -np.arange(1.0, 151.0)
"""v* = 1e-1, 1e-2, … 1e-150. At the last 1 - eps = 1.15 v*^2 is 1e-300, still a normal double (2e-308 and more)."""


class FarQuotient(NamedTuple):
    """A quotient N(v*)/D(v*) at v* of all sizes, in one format.

    Attributes
    ----------
    name : str
        That of the approximant, "[3/6]".
    error : float
        Largest error at large v*, divided by the bound for rounding the leading terms; infinite if any result is not
        finite.
    plain : float
        The v* from which N/D, computed in powers of v*, is 0 or NaN.
    """

    name: str
    error: float
    plain: float


def far_quotients() -> list[FarQuotient]:
    """Return what the exported quotients [m/n] give from the smallest to the largest numbers of their formats.

    Quotients that end at some v* (they have a constant "high") are left out.
    """
    quotients = []
    for kernel in (entry.kernel for entry in catalogue.group("pade")):
        for form in (FORMATS[name] for name in kernel.formats if "high" not in kernel.constants[name]):
            kind, constants = TYPES[form.name], kernel.constants[form.name]
            # Every power of two from 2^-20 of the smallest normal number, 2^(1 - largest), or nearly so; then 0,
            # infinity and the largest number. 20 binades of subnormal numbers are a choice (float has 23).
            x = np.concatenate([np.ldexp(kind(1), np.arange(-form.largest - 20, form.largest + 1)), [0, np.inf]])
            x = np.append(x, np.finfo(kind).max).astype(kind)
            # The last branch of the code is N/D in powers of v*, for small v*; here it is read for all.
            with np.errstate(all="ignore"):
                inputs = {name: kind(c) for name, c in constants.items()} | {"v_star": x}
                near = np.asarray(branch_value(kernel.function("epsilon").branches[-1], "epsilon", inputs, form))
            values = function_values(kernel, "epsilon", x, form=form)
            plain = float(x[(~np.isfinite(near) | (near == 0)) & np.isfinite(x)].min(initial=np.inf))
            # Constants are a0 … a_m, b0 … b_n. For v* -> infinity N/D -> (a_m/b_n) v*^(m - n).
            m, n = (max(int(name[1:]) for name in constants if name[0] == letter) for letter in "ab")
            lead, power = Fraction(constants[f"a{m}"]) / Fraction(constants[f"b{n}"]), n - m
            # Roundings in N/D u … u, u = 1/v*: of u, which stands there `power` times, and of as many products; of two
            # sums that are nearly their first terms, 3/2 each; of the quotient 1. That is 2 power + 4. Four more, and
            # 1.001 for products of errors, are generous: errors are a twentieth of it, as 1/v* is exact at powers of 2.
            allowed = (2 * power + 8) * 2.0**-form.precision * 1.001
            error = 0.0 if np.isfinite(values).all() else math.inf
            for y, v in zip(values.tolist(), x.tolist(), strict=True):
                # Beyond 2^60 further terms, relative to the first like 1/v*, are below a unit roundoff (2^-53); below
                # the smallest normal number, 2^(1 - largest), a relative error has no bound.
                if 2.0**60 < v < math.inf and 2.0 ** (1 - form.largest) < abs(y) < math.inf:
                    error = max(error, abs(float(Fraction(y) * Fraction(v) ** power / lead - 1)) / allowed)
            quotients.append(FarQuotient(kernel.label, error, plain))
    return quotients


def losses() -> tuple[list[float], list[float]]:
    """Return the relative errors of 1 - eps at the v* of `ELASTIC`, computed in two ways.

    The first list is of the difference 1 - (eps of full accuracy), the second of the function of full accuracy for
    1 - eps.
    """
    ways = (
        1 - np.asarray(function_values(full.full(), "epsilon", ELASTIC)),
        np.asarray(function_values(full.full(), "one_minus_epsilon", ELASTIC)),
    )
    # `exact_portions` encloses eps and 1 - eps (field `loss`).
    with working(BITS):
        exact = [truth.exact_portions(arb(v)).loss for v in ELASTIC.tolist()]
        difference, direct = (
            [float(abs(arb(y) - loss) / loss) for y, loss in zip(way.tolist(), exact, strict=True)] for way in ways
        )
    return difference, direct


def measure(thorough: bool) -> Finding:
    """Return the rows, words and picture of this case: a search in all functions, and both ends of v*.

    `thorough` searches longer and in more rows of the tables. The lengths are choices: minutes, or a few seconds. With
    200 arguments, four rounds raise the errors of functions by a twentieth on average, and not the largest (measured).
    """
    # Rows of each table, random arguments of each function, rounds among the neighbours of the worst ones.
    rows, number, rounds = (16, 2000, 12) if thorough else (2, 60, 1)
    chosen = list(functions(rows))
    errors: dict[str, list[float]] = {family: [] for family in FAMILIES}
    for i in track(range(len(chosen)), "worst rounding errors"):
        # A table is searched in `rows` rows and the two where base changes: they share the arguments, at least 20 each.
        share = rows + 2 if chosen[i].family == "tables" else 1
        errors[chosen[i].family].append(worst(chosen[i], max(number // share, 20), rounds).error)
    return make_finding(errors, far_quotients(), *losses())


def make_finding(
    errors: Mapping[str, Sequence[float]],
    far: Sequence[FarQuotient],
    difference: Sequence[float],
    direct: Sequence[float],
) -> Finding:
    """Return the rows, words and picture.

    Parameters
    ----------
    errors : mapping
        From family to the largest error / proven bound of each of its functions.
    far : sequence of FarQuotient
    difference, direct : sequences of float
        Relative errors of 1 - eps at the v* of `ELASTIC`: `losses`.
    """
    # The quotient that fails first as a plain N/D.
    first = min(far, key=lambda quotient: quotient.plain)
    # At v* = 1e-8 1 - eps = 1.15e-16 is about the spacing 2^-53 of doubles below 1: the difference has one digit.
    index = int(np.argmin(abs(ELASTIC - 1e-8)))
    rows = (
        *(Row(f"{FAMILIES[family]}: largest round-off / proven bound", max(e), 1) for family, e in errors.items()),
        Row("quotients at large v*: error / bound of leading terms", max(quotient.error for quotient in far), 1),
        Row(
            "1 - eps of full accuracy, v* to 1e-150: error / proven bound",
            # The bound is in ulp; an ulp of a double is at most 2^-52 of it.
            max(direct) / (float(full.largest_ulp("one_minus_epsilon")) * 2.0**-52),
            1,
        ),
        Row(f"v* from which {first.name}, as the plain quotient N/D, is 0 or NaN", first.plain),
        Row("relative error of the difference 1 - eps at v* = 1e-8", difference[index]),
        Row("relative error of one_minus_epsilon at v* = 1e-8", direct[index]),
    )
    summary = (
        f"No exported function exceeds its proven error. The search covered {sum(map(len, errors.values()))} "
        "functions, branches and rows of tables, in float and double. At large v* every exported quotient remains "
        "finite, where the plain quotient overflows. Near v* = 0 one_minus_epsilon keeps all digits, which the "
        "difference 1 - eps loses."
    )

    def draw(axes: Axes) -> None:
        """Draw the largest error / bound of all functions side by side, a colour and a mark for each family."""
        start = 0
        # Sizes and distances are chosen by hand; letters are Matplotlib's marks.
        for (family, values), color, mark in zip(
            errors.items(), (BLUE, VERMILION, GREEN, PURPLE, BLACK), "os^vD", strict=True
        ):
            axes.plot(range(start, start + len(values)), values, mark, color=color, markersize=3, label=family)
            start += len(values)
        axes.axhline(1, color=BLACK, linewidth=0.8, label="bound")
        # A third above the bound at 1 has room for the legend, which is two rows of three columns.
        axes.set(ylabel="round-off / proven bound", xlabel="function, branch or row of a table", ylim=(0, 1.35))
        axes.legend(loc="upper center", ncols=3, columnspacing=1.2, handletextpad=0.4)

    return Finding(rows, summary, draw)
