"""Test vectors of exported functions: arguments, exact results, and the least and the largest result within the bounds.

The exact results come from `truth`, never from a kernel. The bits that code without FMA contraction must give are
computed here, operation by operation, for functions that call nothing of the mathematical library but sqrt.

A point has the one or two arguments of a function in their order: (v*), (eps), (1 - eps), (speed, beta) or
(eps, speed). `form` is the number format, float or double.
"""

from __future__ import annotations

import csv
import math
import pkgutil
from collections.abc import Callable, Iterable, Iterator, Sequence
from decimal import Decimal
from fractions import Fraction
from functools import lru_cache
from itertools import product
from json import dumps
from typing import NamedTuple, cast

import numpy as np
from flint import arb

from viscopade.arithmetic.balls import ball_of, exact_middle, known_decimal, magnitude, working
from viscopade.arithmetic.decimals import at_most
from viscopade.arithmetic.formats import DOUBLE, FORMATS, Format
from viscopade.arrays import double
from viscopade.collision.exact_table import Portions
from viscopade.generated import json_head
from viscopade.kernels import machine, truth
from viscopade.kernels.kernel import Function, Kernel
from viscopade.kernels.machine import TYPES

HARD = "data/hard_arguments.csv"
COLUMNS = ("function", "type", "x", "y", "exact", "nearest", "error", "least", "most", "bits")
NOTHING = "-"
"""Stands in a column for what is not stated."""
# Distance of v* from an end of the domain within which rounding may decide on which side it is: sqrt(beta)
# pow(speed, 0.1) is off by about 5 ulp in exported code, and by as many here; 16 are more.
_ULPS_OF_V_STAR = 16
DIGITS = 20
"""Of exact values, where the ball determines as many: three more than identify a double."""
INEXACT = frozenset(("pow", "cbrt", "log2", "exp2"))
"""Functions of the library whose results IEEE 754 does not determine."""

SOURCE = (
    "the exact function, enclosed; a result passes if least <= result <= most, or if both are NaN. least and most are "
    "the exact value plus and minus the proven error (of the formula and of rounding to nearest, with or "
    "without FMA contraction), in numbers of the type. bits is what the operations give if no products and sums are "
    "fused, where nothing but +, -, *, / and sqrt is called; '-' stands for what is not stated"
)

Arguments = tuple[float, ...]
_INF, _NAN = math.inf, math.nan
# Arguments, chosen by hand to spread over all sizes: most are numbers of both types, so that what is exact there is
# computed once. _SIMPLE are v*, _PORTIONS eps or 1 - eps, _SPEEDS speeds for beta = 1.
_SIMPLE = (2.0**-10, 2.0**-7, 0.09375, 0.3125, 0.625, 0.90625, 1.0, 1.5, 2.0, 3.0, 4.5, 5.0, 10.0, 100.0, 1e6, 1e10)
_PORTIONS = tuple(n / 64 for n in (1, 6, 16, 48, 58, 63))
_SPEEDS = (1e-30, 1e-18, 1e-9, 1e-3, 0.125, 0.25, 0.5, 3.0, 30.0, 1e5, 1e10, 1e20)
_OCTAVES = (-95, -63, -33, -1, 0, 7, 8, 31)  # some of those that tables have rows for: from -96 or -64 on, 128 of them
# (speed, beta): the paper's ice at 2 cm/s, extremes whose w = beta^5 speed is no extreme, and some others.
_PAIRS = ((2.0, 1.307), (0.0078125, 1.3125), (2.0**-100, 0.5), (2.0**100, 2.0**-10), (1.0, 1.0), (40.0, 12.5))
# (eps, speed) for beta: inside the domain, and at its ends and beyond.
_BETA_ARGUMENTS = (
    *((0.5, 2.0), (0.984375, 2.0), (0.09375, 1e-20), (0.90625, 1e20), (1.0, 1.0)),
    *((0.5, _INF), (0.5, 0.0), (0.5, -1.0), (0.0, 1.0), (2.0, 1.0), (_NAN, 1.0), (0.5, _NAN)),
)
# (speed, beta) for which the result is NaN.
_REFUSED = ((-1.0, 1.0), (1.0, -1.0), (_NAN, 1.0), (1.0, _NAN), (0.0, _INF), (_INF, 0.0))


def render(kernels: Sequence[Kernel], command: str) -> str:
    """Return one object; its "vectors" hold a list for each vector, on a line of its own, in the order of "columns".

    Raises
    ------
    ValueError
        If `command` is not one line.
    """
    head = {**json_head(command, SOURCE), "columns": COLUMNS}
    if "\n" in command:
        raise ValueError("expected a command of one line")
    # Each kernel after the one that serves outside its table.
    wholes = (whole for kernel in kernels for whole in (kernel.fallback, kernel) if whole is not None)
    lines = (dumps(row) for kernel in wholes for row in vectors_of(kernel))
    # The head ends before the list's bracket, so that each vector gets a line of its own.
    start = dumps(head | {"vectors": []}, indent=1, ensure_ascii=False).removesuffix("]\n}")
    return start + "\n" + ",\n".join(dict.fromkeys(lines)) + "\n]}\n"


def vectors_of(kernel: Kernel) -> Iterator[list[str]]:
    """Yield the vectors of all functions of a kernel, in each format: at `points` and at hard arguments."""
    for form, function in product(map(FORMATS.get, kernel.formats), kernel.functions):
        assert form is not None
        hard = hard_arguments().get((f"{function.name}_{kernel.name}", form.name), ())
        yield from vectors(kernel, function, form, (*points(kernel, function, form), *hard))


def vectors(kernel: Kernel, function: Function, form: Format, arguments: Iterable[Arguments]) -> Iterator[list[str]]:
    """Yield the vectors of a kernel's function at arguments, which are rounded to a format, where anything is stated.

    A vector is a row of texts in the order of `COLUMNS`.
    """
    # Of each branch whether it calls what IEEE 754 does not determine.
    inexact_branches = [bool(function.calls(index) & INEXACT) for index in range(len(function.branches))]
    with working(truth.BITS), np.errstate(all="ignore"):
        for exact_numbers in arguments:
            point = tuple(float(TYPES[form.name](x)) for x in exact_numbers)
            # What code computes, and by which branch; -1 for none, where it is NaN.
            result, branch = machine.values_and_branches(kernel, function.name, *point, form=form)
            computed, inexact = float(result), any(inexact_branches) if branch < 0 else inexact_branches[branch]
            answer = _answer(kernel, function, form, point, computed, int(branch), inexact)
            if answer is None and inexact:
                continue
            x_and_y = [*map(hexadecimal, point), NOTHING][:2]
            # Five columns, "exact" to "most", and the last one, "bits".
            texts = [NOTHING] * 5 if answer is None else answer
            name = f"{function.name}_{kernel.name}"
            yield [name, form.name, *x_and_y, *texts, NOTHING if inexact else hexadecimal(computed)]


# --- what is stated ---------------------------------------------------------------------------------------------------


class ExactResult(NamedTuple):
    """The exact result of a function, v*, and the smaller of eps and 1 - eps; the latter two rounded up a little."""

    value: arb
    v_star: Fraction
    smaller: Fraction = Fraction(0)


def _answer(
    kernel: Kernel,
    function: Function,
    form: Format,
    point: Arguments,
    computed: float,
    branch: int,
    inexact: bool,
) -> list[str] | None:
    """Return the columns from "exact" to "most" at a point; None where no bound is stated.

    `computed` is what code computes there in a format, by a kernel's function and its branch of this index; `inexact`
    says whether that branch calls what IEEE 754 does not determine.
    """
    name = function.name
    bounds = kernel.bound(name, "host", form.name, branch)
    if inexact and _rounding_decides_domain(kernel, function, form, point):
        return None
    if math.isnan(computed):
        return _special_columns(_NAN)
    # At w = 0 and w = infinity the result is a limit, which code must give exactly: without error. At 0 that is
    # certain, as C's Annex F fixes sqrt, cbrt and pow of 0. At infinity it is if no inexact function is called, if the
    # result is 0 or infinite, or if a bound holds for all large v*.
    limit = _limit_of_w(name, point)
    if limit is not None:
        certain = limit == 0 or not inexact or computed in (0, _INF) or any(b.high == _INF for b in bounds)
        return _special_columns(computed + 0.0) if certain else None  # + 0.0 makes 0 of -0
    speed = Fraction(point[function.arguments.index("speed")]) if "speed" in function.arguments else None
    exact = _exact(name, point, truth.portions_of_w)
    if not machine.is_normal(kernel, name, *point, form=form):  # bounds of a part of v* assume that products are
        bounds = [bound for bound in bounds if bound.low == 0]
    # The errors that the bounds which hold here allow, at most; the smallest of them holds.
    value = magnitude(exact.value)
    allowed = [b.allowed(value, exact.smaller, speed) for b in bounds if b.holds_at(exact.v_star, speed)]
    if not allowed:
        return None
    if len({form.rounded(end) for end in _ends(exact.value)}) > 1:  # it is not clear which number is nearest
        exact = _exact(name, point, truth.sharp_portions)
    low, high = _ends(exact.value)
    nearest = {form.rounded(end) for end in (low, high)}
    error = min(allowed)
    return [
        known_decimal(exact.value, DIGITS),
        hexadecimal(nearest.pop()) if len(nearest) == 1 else NOTHING,
        f"{Decimal(at_most(error)):.2e}",
        # The least and the largest number of the type within the error.
        hexadecimal(form.rounded(low - error, math.ceil)),
        hexadecimal(form.rounded(high + error, math.floor)),
    ]


def _rounding_decides_domain(kernel: Kernel, function: Function, form: Format, point: Arguments) -> bool:
    """Return whether the rounding of a library function decides if v* is in the domain of a kernel's function.

    The ends of the domain are the constants "low" and "high" of the kernel in a format.
    """
    if function.arguments != ("speed", "beta") or min(point) < 0:
        return False
    # v* = beta^(1/2) speed^(1/10)
    v_star = math.sqrt(point[1]) * point[0] ** 0.1
    ends = (value for name, value in kernel.constants[form.name].items() if name in ("low", "high"))
    return any(abs(v_star - end) <= _ULPS_OF_V_STAR * form.epsilon * end for end in ends)


def _special_columns(value: float) -> list[str]:
    """Return the columns from "exact" to "most" of a result that must be exactly this value, or NaN."""
    return [repr(value).removesuffix(".0"), hexadecimal(value), "0", hexadecimal(value), hexadecimal(value)]


def _limit_of_w(name: str, point: Arguments) -> float | None:
    """Return 0 or infinity where w = v*^10 is that at a point, or beta is 0; else None: the exact result is enclosed.

    `name` is the function's.
    """
    if name in ("v_star", "v_star_from_loss"):
        # v* = 0 at eps = 1, or at 1 - eps = 0.
        elastic = 1.0 if name == "v_star" else 0.0
        return 0.0 if point[0] == elastic else None
    if name == "beta":
        # beta = v*^2/speed^(1/5) is 0 at eps = 1, and for an infinite speed.
        return 0.0 if point == (1.0, point[1]) or point[1] == _INF else None
    return 0.0 if 0 in point else _INF if _INF in point else None


def _exact(name: str, point: Arguments, eps_and_loss_at: Callable[[Fraction], Portions]) -> ExactResult:
    """Return the exact result of a function at a point inside its domain.

    `eps_and_loss_at` gives balls of eps and 1 - eps at w = v*^10.
    """
    first = Fraction(point[0])
    if name in ("v_star", "v_star_from_loss", "beta"):
        v_star_ball = truth.exact_v_star(1 - first if name == "v_star_from_loss" else first)
        # beta = v*^2/speed^(1/5)
        value = v_star_ball**2 / ball_of(Fraction(point[1])).root(5) if name == "beta" else v_star_ball
        return ExactResult(value, magnitude(v_star_ball))
    # w = v*^10, or beta^5 speed
    w = first**10 if len(point) == 1 else first * Fraction(point[1]) ** 5
    portions = eps_and_loss_at(w)
    values = {
        "one_minus_epsilon": portions.loss,
        # 1 - eps^2 = (1 - eps) (1 + eps)
        "dissipation": portions.loss * (1 + portions.epsilon),
        "rebound": portions.epsilon * ball_of(first),
    }
    # Bounds of rebound are relative to the smaller one times the speed.
    smaller = min(magnitude(portions.epsilon), magnitude(portions.loss)) * (first if name == "rebound" else 1)
    # v* = w^(1/10)
    v_star = first if len(point) == 1 else magnitude(ball_of(w).root(10))
    return ExactResult(values.get(name, portions.epsilon), v_star, smaller)


def _ends(ball: arb) -> tuple[Fraction, Fraction]:
    """Return the lower and the upper end of a ball."""
    return exact_middle(ball.lower()), exact_middle(ball.upper())


def hexadecimal(number: float) -> str:
    """Return a number as C99's strtod and scanf read it."""
    return DOUBLE.hexadecimal(number) if math.isfinite(number) else repr(number)


# --- arguments --------------------------------------------------------------------------------------------------------


@lru_cache(maxsize=1)
def hard_arguments() -> dict[tuple[str, str], list[Arguments]]:
    """Return arguments with large rounding errors: (function and kernel, type) -> arguments.

    They are read from the package's list, which a search made (`tools.hard_arguments`).
    """
    # Lines with "#" are comments. Columns: function, type, x, and y if there are two arguments, hexadecimal.
    text = cast(bytes, pkgutil.get_data("viscopade", HARD)).decode()
    arguments: dict[tuple[str, str], list[Arguments]] = {}
    for row in csv.DictReader(line for line in text.splitlines() if not line.startswith("#")):
        point = tuple(float.fromhex(row[key]) for key in "xy" if row[key])
        arguments.setdefault((row["function"], row["type"]), []).append(point)
    return arguments


def points(kernel: Kernel, function: Function, form: Format) -> list[Arguments]:
    """Return special and simple arguments of a kernel's function in a format.

    Both sides of the borders of the domain and of branches are among them.
    """
    # The smallest normal number, the smallest and the largest one.
    least_normal, smallest = 2.0 ** (1 - form.largest), float(form.smallest)
    largest = (2 - form.epsilon) * 2.0**form.largest
    # 0.75 times the smallest normal number is a subnormal one.
    extremes = (0.0, -0.0, smallest, 0.75 * least_normal, least_normal, largest, _INF, _NAN, -1.0, -smallest, -_INF)
    borders = [y for x in machine.borders(kernel, function.name, form) for y in _beside(x, form)]
    # Ends, in v*, of the ranges of bounds.
    ranges = ((b.low, b.high) for b in kernel.bound(function.name, "host", form.name))
    ends = [float(end) for low, high in ranges for end in (low, high) if 0 < end < _INF]
    # Rows of tables: beside the beginning of an octave, where the row changes, and in the middle.
    octaves = _OCTAVES if kernel.tables else ()
    in_rows = (y for e in octaves for y in (*_beside(2.0**e, form), 1.5 * 2.0**e))
    match function.arguments:
        case ("v_star",):
            # At eps = 1/2 the smaller one of eps and 1 - eps changes.
            near = (y for x in (float(double.v_star_from(0.5)), *ends) for y in _beside(x, form))
            return [(x,) for x in (*extremes, *_SIMPLE, *near, *borders, *in_rows)]
        case ("epsilon",) | ("one_minus_epsilon",):
            # Numbers of both types, of which 1 - eps is one, too: an exact v* takes long. 2^-126 is the smallest normal
            # number of float.
            inside = [2.0**-126, *_beside(0.5, form), *_beside(1.0, form), *_PORTIONS, *borders]
            if function.arguments == ("one_minus_epsilon",):
                # 1 - eps below the unit roundoff of either type, where eps itself rounds to 1.
                inside = [*(1 - x for x in inside), 2.0**-60, 2.0**-120]
            return [(x,) for x in (*extremes, 2.0, *inside)]
        case ("epsilon", "speed"):
            return [*_BETA_ARGUMENTS]
    # (speed, beta): zeros and infinities, then speeds for beta = 1, for which w = v*^10 is the speed: among them those
    # a little inside and outside (0.1 % of w) of the ends of ranges.
    special = product((0.0, -0.0, smallest, 1.0), (0.0, 1.0))
    infinite = ((_INF, 1.0), (1.0, _INF), (_INF, _INF))
    near = (x**10 * factor for x in ends for factor in (1 - 1e-3, 1 + 1e-3))
    speeds = (smallest, *_SPEEDS, *_beside(least_normal, form), *borders, *near, *in_rows)
    return [*special, (1.0, -0.0), (0.0, largest), *infinite, *_REFUSED, *_PAIRS, *((x, 1.0) for x in speeds)]


def _beside(x: float, form: Format) -> Iterator[float]:
    """Yield the number of the type nearest to x, and both of its neighbours, in ascending order."""
    kind = TYPES[form.name]
    for end in (-_INF, x, _INF):
        yield float(np.nextafter(kind(x), kind(end)) if end != x else kind(x))
