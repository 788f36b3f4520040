"""Test vectors of exported functions: arguments, exact results, and the least and the largest result within the bounds.

The exact results come from `truth`, never from a kernel. The bits that code without FMA contraction must give are
computed here, operation by operation, for functions that call nothing of the mathematical library but sqrt.
"""

from __future__ import annotations

import csv
import math
import pkgutil
from collections.abc import Iterable, Iterator, Sequence
from decimal import Decimal
from fractions import Fraction
from functools import lru_cache
from itertools import product
from json import dumps
from typing import Any, NamedTuple, cast

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
_ULPS_OF_V_STAR = 16
DIGITS = 20
"""Of exact values, where the ball determines as many."""
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
# Numbers of both types: what is exact there is computed once.
_SIMPLE = (2.0**-10, 2.0**-7, 0.09375, 0.3125, 0.625, 0.90625, 1.0, 1.5, 2.0, 3.0, 4.5, 5.0, 10.0, 100.0, 1e6, 1e10)
_PORTIONS = tuple(n / 64 for n in (1, 6, 16, 48, 58, 63))
_SPEEDS = (1e-30, 1e-18, 1e-9, 1e-3, 0.125, 0.25, 0.5, 3.0, 30.0, 1e5, 1e10, 1e20)
_OCTAVES = (-95, -63, -33, -1, 0, 7, 8, 31)  # some of those that tables have rows for
_PAIRS = ((2.0, 1.307), (0.0078125, 1.3125), (2.0**-100, 0.5), (2.0**100, 2.0**-10), (1.0, 1.0), (40.0, 12.5))
_OF_BETA = (
    *((0.5, 2.0), (0.984375, 2.0), (0.09375, 1e-20), (0.90625, 1e20), (1.0, 1.0)),
    *((0.5, _INF), (0.5, 0.0), (0.5, -1.0), (0.0, 1.0), (2.0, 1.0), (_NAN, 1.0), (0.5, _NAN)),
)
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
    wholes = (each for kernel in kernels for each in (kernel.fallback, kernel) if each is not None)
    lines = (dumps(row) for kernel in wholes for row in vectors_of(kernel))
    start = dumps(head | {"vectors": []}, indent=1, ensure_ascii=False).removesuffix("]\n}")
    return start + "\n" + ",\n".join(dict.fromkeys(lines)) + "\n]}\n"


def vectors_of(kernel: Kernel) -> Iterator[list[str]]:
    """Yield the vectors of all functions of a kernel."""
    for form, function in product(map(FORMATS.get, kernel.formats), kernel.functions):
        assert form is not None
        hard = hard_arguments().get((f"{function.name}_{kernel.name}", form.name), ())
        yield from vectors(kernel, function, form, (*points(kernel, function, form), *hard))


def vectors(kernel: Kernel, function: Function, form: Format, given: Iterable[Arguments]) -> Iterator[list[str]]:
    """Yield the vectors of a function at arguments, which are rounded to the format, where anything is stated."""
    inexact = [bool(function.calls(index) & INEXACT) for index in range(len(function.branches))]
    with working(truth.BITS), np.errstate(all="ignore"):
        for point in given:
            row = _vector(kernel, function, form, tuple(float(TYPES[form.name](x)) for x in point), inexact)
            if row is not None:
                yield row


def _vector(
    kernel: Kernel, function: Function, form: Format, given: Arguments, inexact: Sequence[bool]
) -> list[str] | None:
    """Return a vector; `inexact` says of each branch whether it calls what IEEE 754 does not determine."""
    found, branch = machine.values_and_branches(kernel, function.name, *given, form=form)
    computed, called = float(found), any(inexact) if branch < 0 else inexact[branch]
    answer = _answer(kernel, function, form, given, computed, int(branch), called)
    if answer is None and called:
        return None
    arguments = [*map(hexadecimal, given), NOTHING][:2]
    texts = [NOTHING] * 5 if answer is None else answer
    name = f"{function.name}_{kernel.name}"
    return [name, form.name, *arguments, *texts, NOTHING if called else hexadecimal(computed)]


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
    given: Arguments,
    computed: float,
    branch: int,
    inexact: bool,
) -> list[str] | None:
    """Return the columns from "exact" to "most"; None where no bound is stated."""
    name = function.name
    bounds = kernel.bound(name, "host", form.name, branch)
    if inexact and _at_end(kernel, function, form, given):
        return None
    if math.isnan(computed):
        return _of_special(_NAN)
    limit = _limit(name, given)
    if limit is not None:
        known = limit == 0 or not inexact or computed in (0, _INF) or any(b.high == _INF for b in bounds)
        return _of_special(computed + 0.0) if known else None
    speed = Fraction(given[function.arguments.index("speed")]) if "speed" in function.arguments else None
    exact = _exact(name, given, truth.portions_of_w)
    if not machine.is_normal(kernel, name, *given, form=form):  # bounds of a part of v* assume that products are
        bounds = [bound for bound in bounds if bound.low == 0]
    value = magnitude(exact.value)
    allowed = [b.allowed(value, exact.smaller, speed) for b in bounds if b.holds_at(exact.v_star, speed)]
    if not allowed:
        return None
    if len({form.rounded(end) for end in _ends(exact.value)}) > 1:  # it is not clear which number is nearest
        exact = _exact(name, given, truth.sharp_portions)
    low, high = _ends(exact.value)
    nearest = {form.rounded(end) for end in (low, high)}
    return [
        known_decimal(exact.value, DIGITS),
        hexadecimal(nearest.pop()) if len(nearest) == 1 else NOTHING,
        f"{Decimal(at_most(min(allowed))):.2e}",
        hexadecimal(form.rounded(low - min(allowed), math.ceil)),
        hexadecimal(form.rounded(high + min(allowed), math.floor)),
    ]


def _at_end(kernel: Kernel, function: Function, form: Format, given: Arguments) -> bool:
    """Return whether the rounding of a library function decides if v* is in the domain."""
    if function.arguments != ("speed", "beta") or min(given) < 0:
        return False
    v_star = math.sqrt(given[1]) * given[0] ** 0.1
    ends = (value for name, value in kernel.constants[form.name].items() if name in ("low", "high"))
    return any(abs(v_star - end) <= _ULPS_OF_V_STAR * form.epsilon * end for end in ends)


def _of_special(value: float) -> list[str]:
    return [repr(value).removesuffix(".0"), hexadecimal(value), "0", hexadecimal(value), hexadecimal(value)]


def _limit(name: str, given: Arguments) -> float | None:
    """Return w = v*^10 where it is 0 or infinite, and the result is no number that is enclosed."""
    if name in ("v_star", "v_star_from_loss"):
        return 0.0 if given[0] == (name == "v_star") else None
    if name == "beta":
        return 0.0 if given == (1.0, given[1]) or given[1] == _INF else None
    return 0.0 if 0 in given else _INF if _INF in given else None


def _exact(name: str, given: Arguments, at: Any) -> ExactResult:
    """Return the exact result of a function at arguments inside its domain."""
    first = Fraction(given[0])
    if name in ("v_star", "v_star_from_loss", "beta"):
        ball = truth.exact_v_star(1 - first if name == "v_star_from_loss" else first)
        value = ball**2 / ball_of(Fraction(given[1])).root(5) if name == "beta" else ball
        return ExactResult(value, magnitude(ball))
    w = first**10 if len(given) == 1 else first * Fraction(given[1]) ** 5
    portions: Portions = at(w)
    values = {
        "one_minus_epsilon": portions.loss,
        "dissipation": portions.loss * (1 + portions.epsilon),
        "rebound": portions.epsilon * ball_of(first),
    }
    smaller = min(magnitude(portions.epsilon), magnitude(portions.loss)) * (first if name == "rebound" else 1)
    v_star = first if len(given) == 1 else magnitude(ball_of(w).root(10))
    return ExactResult(values.get(name, portions.epsilon), v_star, smaller)


def _ends(ball: arb) -> tuple[Fraction, Fraction]:
    return exact_middle(ball.lower()), exact_middle(ball.upper())


def hexadecimal(number: float) -> str:
    """Return a number as C99's strtod and scanf read it."""
    return DOUBLE.hexadecimal(number) if math.isfinite(number) else repr(number)


# --- arguments --------------------------------------------------------------------------------------------------------


@lru_cache(maxsize=1)
def hard_arguments() -> dict[tuple[str, str], list[Arguments]]:
    """Return arguments with large rounding errors by function and type."""
    text = cast(bytes, pkgutil.get_data("viscopade", HARD)).decode()
    found: dict[tuple[str, str], list[Arguments]] = {}
    for row in csv.DictReader(line for line in text.splitlines() if not line.startswith("#")):
        given = tuple(float.fromhex(row[key]) for key in "xy" if row[key])
        found.setdefault((row["function"], row["type"]), []).append(given)
    return found


def points(kernel: Kernel, function: Function, form: Format) -> list[Arguments]:
    """Return special and simple arguments, and both sides of the borders of the domain and of branches."""
    tiny, smallest = 2.0 ** (1 - form.largest), float(form.smallest)
    largest = (2 - form.epsilon) * 2.0**form.largest
    extremes = (0.0, -0.0, smallest, 0.75 * tiny, tiny, largest, _INF, _NAN, -1.0, -smallest, -_INF)
    borders = [y for x in machine.borders(kernel, function.name, form) for y in _beside(x, form)]
    ranges = ((b.low, b.high) for b in kernel.bound(function.name, "host", form.name))
    ends = [float(end) for low, high in ranges for end in (low, high) if 0 < end < _INF]
    octaves = _OCTAVES if kernel.tables else ()
    in_rows = (y for e in octaves for y in (*_beside(2.0**e, form), 1.5 * 2.0**e))
    match function.arguments:
        case ("v_star",):
            near = (y for x in (float(double.v_star_from(0.5)), *ends) for y in _beside(x, form))
            return [(x,) for x in (*extremes, *_SIMPLE, *near, *borders, *in_rows)]
        case ("epsilon",) | ("one_minus_epsilon",):
            # Numbers of both types, of which 1 - eps is one, too: an exact v* takes long.
            inside = [2.0**-126, *_beside(0.5, form), *_beside(1.0, form), *_PORTIONS, *borders]
            if function.arguments == ("one_minus_epsilon",):
                inside = [*(1 - x for x in inside), 2.0**-60, 2.0**-120]
            return [(x,) for x in (*extremes, 2.0, *inside)]
        case ("epsilon", "speed"):
            return [*_OF_BETA]
    special = product((0.0, -0.0, smallest, 1.0), (0.0, 1.0))
    infinite = ((_INF, 1.0), (1.0, _INF), (_INF, _INF))
    near = (x**10 * factor for x in ends for factor in (1 - 1e-3, 1 + 1e-3))
    speeds = (smallest, *_SPEEDS, *_beside(tiny, form), *borders, *near, *in_rows)
    return [*special, (1.0, -0.0), (0.0, largest), *infinite, *_REFUSED, *_PAIRS, *((x, 1.0) for x in speeds)]


def _beside(x: float, form: Format) -> Iterator[float]:
    """Yield the number of the type nearest to x, and both of its neighbours."""
    kind = TYPES[form.name]
    for end in (-_INF, x, _INF):
        yield float(np.nextafter(kind(x), kind(end)) if end != x else kind(x))
