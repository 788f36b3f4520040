"""Test vectors of exported functions: arguments, exact results, and the least and the largest result within the bounds.

The exact results come from `truth`, never from a kernel. The bits that code without FMA contraction must give are
computed here, operation by operation, for functions that call nothing of the mathematical library but sqrt.
"""

from __future__ import annotations

import csv
import math
import pkgutil
from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
from contextlib import suppress
from dataclasses import dataclass
from decimal import Decimal
from fractions import Fraction
from functools import lru_cache, partial
from itertools import chain, product
from json import dumps
from typing import Any, cast

import numpy as np
from flint import arb

from viscopade.arithmetic.balls import ball_of, exact_middle, known_decimal, working
from viscopade.arithmetic.decimals import at_most
from viscopade.arithmetic.formats import DOUBLE, FLOAT, FORMATS, Format
from viscopade.arrays import double
from viscopade.arrays.panels import CENTRES, FIRST, FOLD
from viscopade.generated import END_CONDITION, generated_by
from viscopade.kernels import formulas, truth
from viscopade.kernels.expressions import CodeBranch, Name, Run, evaluate
from viscopade.kernels.forms import last_place, table_free
from viscopade.kernels.forms.lacunary_kernels import HalfLineKernel, InverseKernel, LacunaryVariant
from viscopade.kernels.forms.minimax import MinimaxKernel
from viscopade.kernels.forms.quotient import PadeKernel, Quotient
from viscopade.kernels.forms.speed_kernel import SpeedKernel
from viscopade.kernels.forms.speed_table import LAST_ULPS, of_w
from viscopade.kernels.forms.speed_table_last_place import LastPlaceTable, ulp_of_w
from viscopade.kernels.machine import TYPES, computed, machine_arithmetic
from viscopade.kernels.names import FULL
from viscopade.kernels.targets import quotients
from viscopade.kernels.targets.table_free import name_of
from viscopade.kernels.targets.wording import at_least_one
from viscopade.kernels.truth import Portions
from viscopade.kernels.v_star import USUAL, of_v_star

HARD = "data/hard_arguments.csv"
COLUMNS = ("function", "type", "x", "y", "exact", "nearest", "error", "least", "most", "bits")
NOTHING = "-"
DIGITS = 20
"""Of exact values, where the ball determines as many."""

SOURCE = (
    "the exact function, enclosed; a result passes if least <= result <= most, or if both are NaN. least and most are "
    "the exact value plus and minus the proven error (that of the formula and that of rounding to nearest, with or "
    "without FMA contraction), in numbers of the type. bits is what the operations give if no products and sums are "
    "fused, where nothing but +, -, *, / and sqrt is called; '-' stands for what is not stated"
)

BEYOND = (
    "vectors of C, and of Python where it does not refuse the argument, at arguments beyond the domain that functions "
    "have in the other languages: these give NaN, in shaders the result at the nearer end of the domain"
)

Bits = Callable[..., float] | None
Arguments = tuple[float, ...]
Answer = tuple[arb | float, Fraction] | None
"""The exact result, a float where it is 0, 1, infinite or NaN, and the allowed error; None where nothing is stated."""

_INF, _NAN = math.inf, math.nan
# Numbers of both types: what is exact there is computed once.
_SIMPLE = (2.0**-10, 2.0**-7, 0.09375, 0.3125, 0.625, 0.90625, 1.0, 1.5, 2.0, 3.0, 4.5, 5.0, 10.0, 100.0, 1e6, 1e10)
_PAIRS = ((2.0, 1.307), (0.0078125, 1.3125), (2.0**-100, 0.5), (2.0**100, 2.0**-10), (1.0, 1.0), (40.0, 12.5))
_OF_BETA = (
    *((0.5, 2.0), (0.984375, 2.0), (0.09375, 1e-20), (0.90625, 1e20), (1.0, 1.0)),
    *((0.5, _INF), (0.5, 0.0), (0.5, -1.0), (0.0, 1.0), (2.0, 1.0), (_NAN, 1.0), (0.5, _NAN)),
)
_REFUSED = ((-1.0, 1.0), (1.0, -1.0), (_NAN, 1.0), (1.0, _NAN), (0.0, _INF), (_INF, 0.0))


@dataclass(frozen=True)
class Function:
    """An exported function in a type.

    Attributes
    ----------
    name : str
        Without C's ending of the type.
    form : Format
    answer : callable
        From arguments to an `Answer`.
    bits : callable or None
        From arguments to what the code gives without FMA contraction; None where libm is called.
    points : iterable of arguments
    domain : pair of float or None
        Ends of the argument in languages other than C, if they have the function.
    """

    name: str
    form: Format
    answer: Callable[..., Answer]
    bits: Bits
    points: Iterable[Arguments]
    domain: tuple[float, float] | None = None

    def is_beyond(self, given: Arguments) -> bool:
        """Whether the C header gives a number at an argument beyond the domain."""
        if self.domain is None or self.domain[0] <= given[0] <= self.domain[1]:
            return False
        found = self.answer(*given)
        return found is None or not arb(found[0]).is_nan()


def render(kernels: Sequence[Any], command: str) -> str:
    """Return one object; its "vectors" hold a list for each vector, on a line of its own, in the order of "columns".

    So does "beyond", if there are arguments beyond the domain that functions have in some languages.

    Parameters
    ----------
    kernels : sequence of kernels
        At least one; None stands for those of full accuracy.
    command : str
        The command line that makes the file.

    Raises
    ------
    ValueError
        If there is no kernel, or `command` is not one line.
    """
    at_least_one(kernels)
    head = {
        "generated_by": generated_by(),
        "command": command,
        "source": SOURCE,
        "end_condition": END_CONDITION,
        "columns": COLUMNS,
    }
    with working(truth.BITS), np.errstate(all="ignore"):
        lines = [line for kernel in kernels for function in _functions(kernel) for line in _lines(function)]
    everywhere, beyond = ([line for is_beyond, line in lines if is_beyond == which] for which in (False, True))
    start = dumps(head | {"vectors": []}, indent=1, ensure_ascii=False).removesuffix("]\n}")
    text = start + "\n" + ",\n".join(everywhere) + "\n]"
    if beyond:
        text += f',\n "beyond_source": {dumps(BEYOND)},\n "beyond": [\n' + ",\n".join(beyond) + "\n]"
    return text + "}\n"


def _functions(kernel: Any) -> Iterator[Function]:
    if isinstance(kernel, SpeedKernel):
        return chain(_of_speed(kernel), [] if kernel.slow is None else _of_half_line(kernel.slow))
    if isinstance(kernel, InverseKernel):
        return (function for variant in kernel.variants for function in _of_inverse(kernel, variant))
    if isinstance(kernel, HalfLineKernel):
        return _compact(kernel)
    return _of_full() if kernel is None else _of_quotient(kernel)


# --- lines ------------------------------------------------------------------------------------------------------------


def _lines(function: Function) -> Iterator[tuple[bool, str]]:
    """Yield the lines of a function's vectors, each of them once, and whether they are beyond its domain."""
    points = (*function.points, *hard_arguments().get((function.name, function.form.name), ()))
    given = (tuple(float(TYPES[function.form.name](x)) for x in point) for point in points)
    lines = {line: function.is_beyond(point) for point in given if (line := _line(function, point)) is not None}
    yield from ((is_beyond, line) for line, is_beyond in lines.items())


def _line(function: Function, given: Arguments) -> str | None:
    """Return the line of a vector; None if neither a bound nor bits are known."""
    found = function.answer(*given)
    bits = None if function.bits is None else function.bits(*given)
    if found is None and bits is None:
        return None
    texts = [NOTHING] * 5 if found is None else _answer_texts(*found, function.form)
    arguments = [*map(hexadecimal, given), NOTHING][:2]
    last = NOTHING if bits is None else hexadecimal(float(bits))
    return dumps([function.name, function.form.name, *arguments, *texts, last])


def _answer_texts(exact: arb | float, allowed: Fraction, form: Format) -> list[str]:
    """Return the columns from "exact" to "most"."""
    if not isinstance(exact, arb):
        return [repr(exact).removesuffix(".0"), hexadecimal(exact), "0", hexadecimal(exact), hexadecimal(exact)]
    low, high = _ends(exact)
    nearest = {form.rounded(end) for end in (low, high)}
    return [
        known_decimal(exact, DIGITS),
        hexadecimal(nearest.pop()) if len(nearest) == 1 else NOTHING,
        f"{Decimal(at_most(allowed)):.2e}",
        hexadecimal(form.rounded(low - allowed, math.ceil)),
        hexadecimal(form.rounded(high + allowed, math.floor)),
    ]


def _ends(ball: arb) -> tuple[Fraction, Fraction]:
    return exact_middle(arb(ball.lower())), exact_middle(arb(ball.upper()))


def hexadecimal(number: float) -> str:
    """Return a number as C99's strtod and scanf read it."""
    return DOUBLE.hexadecimal(number) if math.isfinite(number) else repr(number)


@lru_cache(maxsize=1)
def hard_arguments() -> dict[tuple[str, str], list[Arguments]]:
    """Return arguments with large rounding errors by function and type."""
    text = cast(bytes, pkgutil.get_data("viscopade", HARD)).decode()
    found: dict[tuple[str, str], list[Arguments]] = {}
    for row in csv.DictReader(line for line in text.splitlines() if not line.startswith("#")):
        given = tuple(float.fromhex(row[key]) for key in "xy" if row[key])
        found.setdefault((row["function"], row["type"]), []).append(given)
    return found


# --- arguments --------------------------------------------------------------------------------------------------------


def _extremes(form: Format) -> Iterator[float]:
    """Yield the special arguments of one variable."""
    tiny = 2.0 ** (1 - form.largest)
    yield from (0.0, -0.0, float(form.smallest), 0.75 * tiny, tiny, (2 - form.epsilon) * 2.0**form.largest)
    yield from (_INF, _NAN, -1.0, -float(form.smallest), -_INF)


def _beside(x: float, form: Format) -> Iterator[float]:
    """Yield the number of the type nearest to x, and both of its neighbours."""
    kind = TYPES[form.name]
    for end in (-_INF, x, _INF):
        yield float(np.nextafter(kind(x), kind(end)) if end != x else kind(x))


def _numbers(form: Format, *borders: float) -> list[Arguments]:
    """Return arguments of one variable: special and simple ones, and both sides of borders."""
    half = float(double.v_star_from(0.5))
    return [(x,) for x in (*_extremes(form), *_SIMPLE, *(y for x in (half, *borders) for y in _beside(x, form)))]


def _pairs(form: Format, *speeds: float) -> list[Arguments]:
    """Return speeds and betas: special and simple ones, and speeds at beta = 1."""
    special = product((0.0, -0.0, float(form.smallest), 1.0), (0.0, 1.0))
    infinite = ((_INF, 1.0), (1.0, _INF), (_INF, _INF))
    return [*special, (1.0, -0.0), *infinite, *_REFUSED, *_PAIRS, *((x, 1.0) for x in speeds)]


def _w(speed: float, beta: float) -> Fraction:
    return Fraction(beta) ** 5 * Fraction(speed)


def _special(x: float, y: float) -> float | None:
    """Return w = v*^10 where it is 0, infinite or undefined."""
    if not (x >= 0 and y >= 0) or (0 in (x, y) and _INF in (x, y)):
        return _NAN
    return 0.0 if 0 in (x, y) else _INF if _INF in (x, y) else None


# --- what is stated ---------------------------------------------------------------------------------------------------


def _above(ball: arb) -> Fraction:
    return exact_middle(arb(ball.abs_upper()))


def _value(portions: Portions, kind: str) -> arb:
    """Return the exact value of a function; of "rebound" and "restitution", eps."""
    if kind == "dissipation":
        return portions.loss * (1 + portions.epsilon)
    return portions.loss if kind == "one_minus_epsilon" else portions.epsilon


def _limits(kind: str, limit: float = 0.0) -> tuple[float, float]:
    """Return the values of a function at v* = 0 and at infinity, given eps at infinity."""
    return (1.0, limit) if kind in ("epsilon", "restitution") else (0.0, 1.0)


def _answered(
    w: Fraction, form: Format, value: Callable[[Portions], arb], allowed: Callable[[Portions], Fraction | None]
) -> Answer:
    """Return an answer; to more digits where it is not clear which number of the type is nearest."""
    portions = truth.at(w)
    error = allowed(portions)
    if error is None:
        return None
    exact = value(portions)
    if len({form.rounded(end) for end in _ends(exact)}) > 1:
        exact = value(truth.sharply(w))
    return exact, error


def _smaller(portions: Portions) -> Fraction:
    return min(_above(portions.epsilon), _above(portions.loss))


def _of_root(speed: float, form: Format) -> Fraction:
    """Bound the error of eps by the rounding of v*, relative to the smaller of eps and 1 - eps."""
    return of_v_star(form, USUAL) if 1 / USUAL <= Fraction(speed) <= USUAL else of_v_star(form)


def _of_v_star(
    form: Format,
    kind: str,
    stated: Callable[[Fraction, Portions], Fraction | None],
    limit: float = 0.0,
) -> Callable[[float], Answer]:
    """Return the answer of a function of v*, given eps at infinity."""

    def answer(x: float) -> Answer:
        if not x >= 0:
            return _NAN, Fraction(0)
        if x in (0, _INF):
            return _limits(kind, limit)[x == _INF], Fraction(0)
        v_star = Fraction(x)
        return _answered(v_star**10, form, lambda p: _value(p, kind), lambda p: stated(v_star, p))

    return answer


def _of_pair(
    form: Format, stated: Callable[[Fraction, Portions], Fraction | None], limit: float = 0.0
) -> Callable[[float, float], Answer]:
    """Return the answer of `restitution` by a function of v*, computed as v* = sqrt(beta) pow(speed, 0.1)."""

    def allowed(x: float, y: float, p: Portions) -> Fraction | None:
        v_star = _above(ball_of(_w(x, y)).root(10))  # nearly, and not below
        of_root, error = _of_root(x, form), stated(v_star, p)
        return None if error is None else error * (1 + of_root) + of_root * _smaller(p)

    return _of_pairs("restitution", form, allowed, limit)


def _of_pairs(
    kind: str, form: Format, stated: Callable[[float, float, Portions], Fraction | None], limit: float = 0.0
) -> Callable[[float, float], Answer]:
    """Return the answer of a function of speed and beta, given what is stated of it, and eps at infinity."""

    def answer(x: float, y: float) -> Answer:
        special = _special(x, y)
        if special is not None:
            if math.isnan(special):
                return _NAN, Fraction(0)
            rebound = abs(x) if special == 0 or x == _INF else 0.0
            return (rebound if kind == "rebound" else _limits(kind, limit)[special > 0]), Fraction(0)
        factor = ball_of(Fraction(x)) if kind == "rebound" else arb(1)
        return _answered(_w(x, y), form, lambda p: _value(p, kind) * factor, lambda p: stated(x, y, p))

    return answer


# --- quotients of polynomials -----------------------------------------------------------------------------------------


def _of_quotient(kernel: Quotient) -> Iterator[Function]:
    for form in FORMATS.values():
        with suppress(ValueError):  # there are no functions of a type that does not hold the coefficients
            kernel.rounded(form)
            yield from _of_quotient_in(kernel, form)


def _of_quotient_in(kernel: Quotient, form: Format) -> Iterator[Function]:
    bounds, rounding = _stated_of(kernel, form)
    relative = any(bound.measure == "relative" for bound in kernel.bounds)
    low = max((bound.low for bound in kernel.bounds), default=Fraction(0))

    def stated(v_star: Fraction, p: Portions) -> Fraction | None:
        found = [Fraction(bound) for high, bound in bounds if low <= v_star <= high]
        size = _above(p.epsilon) if relative else _smaller(p)
        return found[0] * size + rounding * _above(p.epsilon) if found else None

    (a, b), threshold = kernel.rounded(form), 2.0 ** kernel.threshold(form)
    borders = (
        threshold,
        *([float(low)] if low else []),
        *(float(high) for high, _ in bounds),
        *([float(kernel.end[1])] if kernel.end else []),
    )
    limit = 0.0 if len(a) < len(b) else float(TYPES[form.name](a[-1]) / TYPES[form.name](b[-1]))
    points = _numbers(form, *borders)
    given, name = formulas.dense(a=a, b=b), kernel.name
    bits = _quotient_bits(formulas.epsilon_branches(given), given, threshold, form)
    answer = _of_v_star(form, "epsilon", stated, limit)
    yield Function(f"epsilon_{name}", form, answer, bits, points, quotients.domain_in(kernel, form))
    pairs = _pairs(form, float(form.smallest))
    yield Function(f"restitution_{name}", form, _of_pair(form, stated, limit), None, pairs)


def _stated_of(kernel: Quotient, form: Format) -> tuple[list[tuple[Fraction, str]], Fraction]:
    """Return the errors of the formula, each up to a v*, and that of rounding."""
    if isinstance(kernel, PadeKernel):
        bounds, rounding = kernel.bounds, dict(kernel.rounding)[form.name]
    else:
        variant = cast(MinimaxKernel, kernel).variant(form)
        bounds, rounding = (variant.certificate,), variant.rounding
    return sorted((Fraction(bound.high), str(bound.bound)) for bound in bounds), Fraction(rounding)


def _quotient_bits(
    branches: tuple[CodeBranch, CodeBranch], given: Mapping[str, float], threshold: float, form: Format
) -> Bits:
    def bits(x: float) -> float:
        if not x >= 0:
            return _NAN
        numbers = {name: TYPES[form.name](number) for name, number in {**given, "v_star": x}.items()}
        return float(computed(branches[x > threshold], "epsilon", numbers, form))

    return bits


# --- powers of a root -------------------------------------------------------------------------------------------------


def _of_formula(variant: LacunaryVariant) -> Callable[[Portions], Fraction]:
    """Return the bound of the error of eps by a half-line kernel's formula."""
    size = _smaller if variant.certificate.measure == "both" else lambda p: _above(p.epsilon)
    return lambda p: variant.error * size(p)


def _stated_in_powers(variant: LacunaryVariant, kind: str) -> Callable[[Fraction, Portions], Fraction]:
    """Return what is stated of eps or 1 - eps of a half-line kernel."""
    rounding = Fraction(variant.rounding(kind))
    underflow = max(Fraction(size.underflow) for _, size in variant.sizes) * variant.form.smallest
    formula = _of_formula(variant)

    def stated(_: Fraction, p: Portions) -> Fraction:
        return formula(p) + rounding * _above(_value(p, kind)) + underflow

    return stated


def _of_half_line(kernel: HalfLineKernel) -> Iterator[Function]:
    """Yield the functions of v* in the header of a speed table, which are used beyond the table."""
    variant = kernel.variant(DOUBLE)
    for kind in kernel.checked:
        answer = _of_v_star(DOUBLE, kind, _stated_in_powers(variant, kind))
        yield Function(f"{kind}_{kernel.name}", DOUBLE, answer, None, _numbers(DOUBLE, 1.0, 2.0**FOLD))


def _of_inverse(kernel: InverseKernel, variant: LacunaryVariant) -> Iterator[Function]:
    form, name = variant.form, kernel.name
    relative = variant.error + Fraction(variant.rounding("v_star"))
    formula = Fraction(kernel.bound_of_beta)
    of_beta = Fraction(dict(variant.sizes)["beta"].relative) * (1 + formula) + formula

    def v_star(epsilon: Fraction) -> Answer:
        if not max(kernel.epsilon_low, form.smallest) <= epsilon <= 1:
            return _NAN, Fraction(0)
        if epsilon == 1:
            return 0.0, Fraction(0)
        exact = truth.exact_v_star(epsilon)
        return exact, relative * _above(exact)

    def of_epsilon(x: float) -> Answer:
        return v_star(Fraction(x)) if 0 < x <= 1 else (_NAN, Fraction(0))

    def of_loss(x: float) -> Answer:
        return v_star(1 - Fraction(x)) if 0 <= x < 1 else (_NAN, Fraction(0))

    def beta(x: float, y: float) -> Answer:
        if not (y > 0 and 0 < x <= 1 and x >= kernel.epsilon_low):
            return _NAN, Fraction(0)
        if y == _INF or x == 1:
            return 0.0, Fraction(0)
        exact = truth.exact_v_star(Fraction(x)) ** 2 / ball_of(Fraction(y)).root(5)
        return exact, of_beta * _above(exact)

    low = float(kernel.epsilon_low) or 2.0**-126
    # Numbers of both types, of which 1 - eps is one, too: an exact v* takes long.
    inside = [low, *_beside(0.5, form), *_beside(1.0, form), *(n / 64 for n in (1, 6, 16, 48, 58, 63))]
    losses = [*(1 - x for x in inside), 2.0**-60, 2.0**-120]
    for function, answer, among in (("v_star", of_epsilon, inside), ("v_star_from_loss", of_loss, losses)):
        points = [(x,) for x in (*_extremes(form), 2.0, *among)]
        yield Function(f"{function}_{name}", form, answer, None, points)
    yield Function(f"beta_{name}", form, beta, None, _OF_BETA)


# --- full accuracy ----------------------------------------------------------------------------------------------------


def _of_full() -> Iterator[Function]:
    borders = [2.0**FIRST, 2.0**FOLD, 8 * 2.0**FOLD, *map(float, CENTRES[[1, 30, 80, 150]])]
    limits = (2.0**last_place.LARGEST, 2.0**last_place.TINY)
    for kind in last_place.FUNCTIONS:
        answer = _of_v_star(DOUBLE, kind, _stated_of_full(kind))
        points = _numbers(DOUBLE, *borders, *limits)
        yield Function(f"{kind}_{FULL}", DOUBLE, answer, partial(last_place.evaluated, kind), points)


def _stated_of_full(kind: str) -> Callable[[Fraction, Portions], Fraction]:
    ulp, underflow = last_place.largest_ulp(kind), last_place.largest_subnormal(kind)

    def stated(_: Fraction, p: Portions) -> Fraction:
        value = _above(_value(p, kind))
        return (ulp if value >= DOUBLE.least else max(ulp, underflow)) * DOUBLE.ulp(value)

    return stated


# --- from the speed ---------------------------------------------------------------------------------------------------


def _of_speed(kernel: SpeedKernel) -> Iterator[Function]:
    table = kernel.table
    low, high = table.ends
    rows = (1, table.switch - 1, table.switch, table.size // 2, table.size - 1)
    borders = [float(table.interval(i)[1]) * 2.0 ** table.interval(i)[0] for i in rows]
    inside = [float(table.centre(i)) * 2.0 ** table.interval(i)[0] for i in rows]
    for form, kind in product(FORMATS.values(), table_free.FUNCTIONS):
        ends = [low, high, 2.0 ** (table.first - 20)] if form == FLOAT else [low, high, 2.0**-300, 2.0**300]
        speeds = [*inside, *(y for x in (*borders, *ends) for y in _beside(x, form))]

        stated, bits = (partial(of, kernel, kind, form) for of in (_stated_of_speed, _speed_bits))
        answer = _of_pairs(kind, form, cast(Any, stated))
        yield Function(f"{kind}_{kernel.name}", form, answer, cast(Bits, bits), _pairs(form, *speeds))


def _stated_of_speed(kernel: SpeedKernel, kind: str, form: Format, speed: float, beta: float, p: Portions) -> Fraction:
    """Return what a header says of a result, in its table or elsewhere."""
    table, beyond, inner = kernel.table, kernel.beyond, kernel.computed_in(form)
    _, within = table.evaluated_in(inner, kind, speed, beta)
    inner, converted = inner if within else DOUBLE, form == FLOAT and not (within and FLOAT in kernel.formats)
    factor = Fraction(speed) if kind == "rebound" else Fraction(1)
    value = _above(_value(p, kind)) * factor
    underflow = beyond.underflow * (2 if kind == "dissipation" else factor)  # (1 + eps) (1 - eps), eps speed
    # Units in the last place are those of the result, which may be beyond a power of two that the exact value is below.
    last = inner.ulp(value * (1 + of_w(inner)))
    if within and isinstance(table, LastPlaceTable):
        if kind == "restitution":
            error = table.proven.ulp * last + ulp_of_w() * inner.ulp(value)
        else:
            error = table.inside(inner) * value
    elif within:
        relative = table.inside(inner)
        last = inner.ulp(value * (1 + relative))
        error = relative * _smaller(p) + last / 2 if kind == "restitution" else relative * value + LAST_ULPS * last
    elif kind == "restitution":
        error = (beyond.formula + of_v_star()) * _smaller(p) + beyond.of_epsilon * value
    else:
        of_both = beyond.of_epsilon + (beyond.of_loss if kind == "dissipation" else 0)
        error = (beyond.formula + of_v_star() + of_both) * value + LAST_ULPS * last
    if converted:
        error += form.ulp(value + error) / 2
    return error + form.smallest / 2 + underflow * DOUBLE.smallest


def _speed_bits(kernel: SpeedKernel, kind: str, form: Format, speed: float, beta: float) -> float | None:
    """Return what the code gives where it reads the table; None elsewhere."""
    found, within = kernel.table.evaluated_in(kernel.computed_in(form), kind, speed, beta)
    return float(TYPES[form.name](found)) if within else None


# --- without tables ---------------------------------------------------------------------------------------------------


def _compact(kernel: HalfLineKernel) -> Iterator[Function]:
    """Yield the functions of speed and beta in CUDA (on the host), Fortran, Rust, Julia, JavaScript."""
    for variant, kind in product(kernel.variants, table_free.FUNCTIONS):
        form = variant.form
        low, high = (Fraction(2) ** power for power in (1 - form.largest, table_free.LARGEST[form.name]))
        borders = [y for x in (low, high) for y in _beside(float(x), form)]
        speeds = [1e-30, 1e-18, 1e-9, 1e-3, 0.125, 0.25, 0.5, 3.0, 30.0, 1e5, 1e10, 1e20, *borders]
        answer = _of_compact(kernel, variant, kind, low, high)
        yield Function(f"{kind}_{name_of(kernel)}", form, answer, None, _pairs(form, *speeds))


def _products(form: Format, speed: float, beta: float) -> list[float]:
    """Return beta^2, beta^4, beta^5 and w as code computes them."""
    kind, by, square = TYPES[form.name], machine_arithmetic(form), Name("square")
    run = Run(formulas.w_program(), {"speed": kind(speed), "beta": kind(beta)}, by)
    products = (square, square * square, formulas.fifth_power("square"), Name("w"))
    return [float(evaluate(product, run, by)) for product in products]


def _of_compact(
    kernel: HalfLineKernel, variant: LacunaryVariant, kind: str, low: Fraction, high: Fraction
) -> Callable[[float, float], Answer]:
    """Return the answer of a function of speed and beta that is stated for low <= w <= high."""
    library = table_free.LIBRARY[variant.form.name]
    found = table_free.rounding_bounds(kernel.powers, variant.a, variant.b, library)[kind]
    bound, formula = variant.error, _of_formula(variant)
    rounding = Fraction(found.everywhere) * (1 + bound)

    def stated(x: float, y: float, p: Portions) -> Fraction | None:
        if not (_w(x, y) <= high and all(low <= product < _INF for product in _products(variant.form, x, y))):
            return None
        if kind == "dissipation":
            both = variant.certificate.measure == "both"
            return (bound * (1 + bound / 2) + rounding) * _above(_value(p, kind)) if both else None
        factor = Fraction(x) if kind == "rebound" else Fraction(1)
        return (formula(p) + rounding * _above(p.epsilon)) * factor

    within = _of_pairs(kind, variant.form, stated)
    # At infinity, the result is that at the cut-off, which is another number than eps.
    return lambda x, y: None if _special(x, y) == _INF else within(x, y)
