"""Hard case: overflow and underflow of the numerator and denominator of the exported functions.

Written down plainly, N(v*)/D(v*) becomes 0 where D overflows, long before eps does, and NaN where N overflows as well.
The generated code changes to powers of 1/v* in time. Tried are arguments of every size, and those that are refused.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Iterable, Iterator, Sequence
from dataclasses import dataclass, replace
from fractions import Fraction
from typing import Any, NamedTuple

import numpy as np

from viscopade.arithmetic.balls import ball_of, working
from viscopade.arithmetic.formats import DOUBLE, FORMATS, Format
from viscopade.kernels.forms import formulas, last_place
from viscopade.kernels.forms.quotient import threshold
from viscopade.kernels.forms.rounding_bounds import ULPS
from viscopade.kernels.forms.speed_table_last_place import restitution
from viscopade.theory.paper import TABLE
from viscopade_lab.hard_cases import exported
from viscopade_lab.hard_cases.exported import BITS, ExportedFunction, formats
from viscopade_lab.hard_cases.finding import Case, Chart, ChartCurve, Check, Outcome, ResultTable, curve
from viscopade_lab.hard_cases.machine import Array, type_of

SEED = 2011
FAR = (1e30, 1e60)
REFUSED = (-1.0, -1e-300, -1e300, -math.inf, math.nan)


@dataclass(frozen=True)
class FormulaPair:
    """A formula, as it could be written down plainly, and as it is exported.

    Attributes
    ----------
    name : str
    form : Format
    near : ExportedFunction
        The formula in powers of v*, or of its root: the plain one.
    far : ExportedFunction
        The one in powers of 1/v*, or of its root.
    change : float
        The exported code computes `far` beyond this v*.
    degrees : tuple of float
        Of numerator and denominator, in v*.
    """

    name: str
    form: Format
    near: ExportedFunction
    far: ExportedFunction
    change: float
    degrees: tuple[float, float]

    def plain(self, v_star: Array) -> Array:
        """Return what the plain formula gives."""
        return self.near.computed(v_star)

    def exported(self, v_star: Array) -> Array:
        """Return what the generated code gives: NaN for negative numbers."""
        found = np.where(v_star > self.change, self.far.computed(v_star), self.near.computed(v_star))
        return np.where(v_star >= 0, found, np.nan).astype(v_star.dtype)

    def exact(self, v_star: float) -> Any:
        """Enclose the formula's value; to be called within `balls.working`."""
        return self.near.exact(v_star)


def quotients(degrees: Sequence[tuple[int, int]]) -> Iterator[FormulaPair]:
    """Yield Padé's and the best approximants, each in its types."""
    for m, n in TABLE:
        for form in FORMATS.values():
            yield _quotient(f"Padé [{m}/{n}]", form, *exported.pade_kernel(m, n).rounded(form))
    for m, n in degrees:
        for form in formats(f"[{m}/{n}]"):
            yield _quotient(f"best [{m}/{n}]", form, *exported.minimax_coefficients(m, n, form))


def _quotient(name: str, form: Format, a: Sequence[float], b: Sequence[float]) -> FormulaPair:
    near = exported.of_quotient(name, "epsilon", form, a, b, Fraction(1), Fraction(0))
    _, branch = formulas.epsilon_branches(near.constants)
    far = replace(near, program=branch.program, result=branch.results["epsilon"], given=_with_inverse)
    change = threshold(name, tuple(map(Fraction, a)), tuple(map(Fraction, b)), form)
    return FormulaPair(name, form, near, far, 2.0**change, (len(a) - 1, len(b) - 1))


def _with_inverse(x: Any) -> dict[str, Any]:
    with np.errstate(all="ignore"):
        return {"v_star": x, "u": 1 / x}


def half_lines(accuracies: Sequence[str]) -> Iterator[FormulaPair]:
    """Yield eps of the half-line kernels, each in its types."""
    for accuracy in accuracies:
        for form in formats(accuracy):
            powers = exported.HALF_LINE[accuracy]
            near, far = exported.half_line_parts(accuracy, form, "epsilon")
            degrees = powers.bottom[-1] / 3, (6 + powers.top[-1]) / 3
            yield FormulaPair(f"half-line {accuracy}", form, near, far, 1.0, degrees)


# --- what is measured -------------------------------------------------------------------------------------------------


def all_sizes(form: Format, more: int) -> Array:
    """Return 0, every power of 2, subnormal ones too, numbers between them, the largest number and infinity."""
    kind = type_of(form)
    exponents = np.arange(2 - form.largest - form.precision, form.largest + 1)
    ones = np.ldexp(np.ones(1, kind), exponents)
    between = np.random.default_rng(SEED).uniform(1, 2, (more, ones.size)).astype(kind) * ones
    largest = np.finfo(kind).max
    return np.concatenate([[kind(0), largest, kind(np.inf)], ones, np.minimum(between.ravel(), largest)]).astype(kind)


def _of_type(numbers: Sequence[float], form: Format) -> Array:
    with np.errstate(all="ignore"):
        return np.array(numbers).astype(type_of(form))


class PlainFailure(NamedTuple):
    """From which v* on a plain formula fails; infinity if it does not."""

    zero: float
    """It gives 0 or NaN, where eps is a number of the type."""
    nan: float


def failure(kernel: FormulaPair) -> PlainFailure:
    """Return where the plain formula begins to give 0 and NaN, by bisection over the numbers of the type."""
    zero = _first(kernel, lambda found: found == 0 or math.isnan(found))
    if math.isfinite(zero):
        with working(BITS):
            lost = abs(kernel.exact(zero)) > ball_of(kernel.form.smallest / 2)
        zero = zero if lost else math.inf
    return PlainFailure(zero, _first(kernel, math.isnan))


def _first(kernel: FormulaPair, fails: Callable[[float], bool]) -> float:
    """Return the least number from 1 on at which the plain formula fails, which it then does for all larger ones."""
    kind = type_of(kernel.form)
    bits = np.int32 if kind is np.float32 else np.int64

    def at(place: int) -> Array:
        return np.array([place], bits).view(kind)

    def failing(place: int) -> bool:
        return fails(float(kernel.plain(at(place))[0]))

    low, high = (int(np.array([x], kind).view(bits)[0]) for x in (1, np.finfo(kind).max))
    if not failing(high):
        return math.inf
    while high - low > 1:
        middle = (low + high) // 2
        low, high = (low, middle) if failing(middle) else (middle, high)
    return float(at(high)[0])


def predicted(kernel: FormulaPair) -> float:
    """Return where the leading term of a quotient's numerator reaches 2^(largest + 1); infinity if no number does."""
    m = round(kernel.degrees[0])
    if m == 0:
        return math.inf
    lead, end = abs(kernel.near.constants[f"a{m}"]), float(np.finfo(type_of(kernel.form)).max)
    exponent = (kernel.form.largest + 1 - math.log2(lead)) / m
    return 2.0**exponent if exponent < math.log2(end) else math.inf


def relative_error(kernel: FormulaPair, v_star: float) -> float:
    """Return the relative error of the exported form; 0 where the exact value is no normal number of the type."""
    x = _of_type([v_star], kernel.form)
    if not np.isfinite(x[0]):
        return 0.0
    with working(BITS):
        exact = kernel.exact(float(x[0]))
        if abs(exact) < 2.0 ** (1 - kernel.form.largest):
            return 0.0
        return float(abs(float(kernel.exported(x)[0]) / exact - 1))


def product_bound(number: int, form: Format) -> Fraction:
    """Return a bound of |(1 + d_1) … (1 + d_number) - 1|, |d_i| <= u."""
    unit = number * Fraction(1, 1 << form.precision)
    return unit / (1 - unit)


def allowed_far(kernel: FormulaPair) -> float:
    """Bound the relative error far out, where polynomials in 1/v* are their first terms, but for less than u/2 each.

    Rounded are 1/v*, which counts for each of the powers, products with it, two sums (by 3/2 u each) and the quotient;
    a half-line kernel has a cube root instead, which with w^3 u is counted by `ULPS`.
    """
    power = math.ceil(abs(kernel.degrees[0] - kernel.degrees[1]))
    roots = 2 * ULPS if kernel.near.roots else 0
    return float(product_bound(2 * power + 8 + roots, kernel.form))


# --- the case ---------------------------------------------------------------------------------------------------------


def run(thorough: bool) -> Outcome:
    """Try all kernels at arguments of all sizes."""
    degrees, accuracies = exported.MINIMAX, tuple(exported.HALF_LINE)
    # The coefficients of [6/9] take a second.
    chosen = [*quotients(degrees if thorough else degrees[:2]), *half_lines(accuracies if thorough else accuracies[:2])]
    fails = [failure(kernel) for kernel in chosen]
    tables = (_failures(chosen, fails), _far(chosen), _special(chosen))
    checks = tuple(_checks(chosen, fails, thorough))
    return Outcome(_summary(chosen, fails, int(checks[0].measured)), tables, tuple(_charts(chosen)), checks)


def _checks(chosen: Sequence[FormulaPair], fails: Sequence[PlainFailure], thorough: bool) -> Iterator[Check]:
    lost, beyond = 0, 0
    for kernel in chosen:
        x = all_sizes(kernel.form, 40 if thorough else 4)
        found = kernel.exported(x)
        lost += int(np.count_nonzero(~np.isfinite(found)))
        if kernel.near.roots:
            beyond += int(np.count_nonzero((found < 0) | (found > 1)))
    yield Check.never("the exported forms return a finite number for every v* >= 0 tried: exceptions", lost)
    yield Check.never("half-line kernels stay within [0, 1]: exceptions", beyond)
    most = max(relative_error(kernel, v) / allowed_far(kernel) for kernel in chosen for v in (*FAR, 1e20, 1e25, 1e90))
    statement = (
        "error of exported forms at large v*, relative to the round-off bound of leading terms, quotient and powers"
    )
    yield Check.within(statement, most)
    known = [(f.nan, predicted(k)) for k, f in zip(chosen, fails, strict=True) if not k.near.roots]
    off = max(abs(found / expected - 1) if math.isfinite(expected) else found != expected for found, expected in known)
    statement = (
        "plain quotients return NaN from the v* on where their numerator's leading term overflows: relative deviation"
    )
    yield Check(statement, off, "<=", 1e-6)
    statement = "full accuracy, from v*: within [0, 1], eps(0) = 1, eps(inf) = 0, NaN for refused arguments: exceptions"
    yield Check.never(statement, _full())
    statement = (
        "full accuracy, from speed and beta of all sizes: NaN only where the table of its header states it: exceptions"
    )
    yield Check.never(statement, _of_speed())
    statement = "inverse kernels: v* is finite and not negative for every eps in (0, 1], 0 for eps = 1: exceptions"
    yield Check.never(statement, _inverse())


def _full() -> int:
    """Count the wrong results of the functions of full accuracy for arguments of all sizes."""
    wrong = 0
    for form in FORMATS.values():
        for name in last_place.FUNCTIONS:
            found, refused, ends = (
                last_place.evaluated_in(form, name, x) for x in (all_sizes(form, 0), REFUSED, (0.0, -0.0, math.inf))
            )
            wrong += int(np.sum(~((found >= 0) & (found <= 1))) + np.sum(~np.isnan(refused)))
            wrong += ends.tolist() != ([1.0, 1.0, 0.0] if name == "epsilon" else [0.0, 0.0, 1.0])
    return wrong


def _of_speed() -> int:
    """Count the results of `lookup_full` that its header does not promise, for speed and beta of all sizes."""
    sizes = np.concatenate([all_sizes(DOUBLE, 0)[::37], [0.0, -0.0, 5e-324, np.inf, *REFUSED]])
    speed, beta = (part.ravel() for part in np.meshgrid(sizes, sizes))
    with np.errstate(all="ignore"):
        found = restitution(speed, beta)
    refused = ~((speed >= 0) & (beta >= 0)) | ((speed == 0) & np.isinf(beta)) | ((beta == 0) & np.isinf(speed))
    elastic = ~refused & ((speed == 0) | (beta == 0))
    lost = ~refused & (np.isinf(speed) | np.isinf(beta))
    wrong = np.isnan(found) != refused
    wrong |= ~refused & ~((found >= 0) & (found <= 1))
    wrong |= (elastic & (found != 1)) | (lost & (found != 0))
    return int(np.count_nonzero(wrong))


def _inverse() -> int:
    """Count the wrong results of the inverse kernel for portions of all sizes."""
    wrong = 0
    for near, far in batched_pairs(exported.of_inverse(tuple(exported.INVERSE)[:1])):
        x = all_sizes(near.form, 4)
        x = x[(x > 0) & (x <= 1)]
        of_loss = near.name == "v*(1 - eps)"
        x = x[x < 1] if of_loss else x
        loss = x if of_loss else 1 - x
        found = np.where(loss <= 1 - loss, near.computed(x), far.computed(x))
        wrong += int(np.count_nonzero(~(np.isfinite(found) & (found >= 0)) | ((found == 0) & (loss > 0))))
        wrong += int(np.count_nonzero(found[loss == 0]))
    return wrong


def batched_pairs(functions: Iterable[ExportedFunction]) -> Iterator[tuple[ExportedFunction, ExportedFunction]]:
    """Yield the functions by two: the near branch and the far one."""
    found = list(functions)
    return zip(found[::2], found[1::2], strict=True)


def _failures(chosen: Sequence[FormulaPair], fails: Sequence[PlainFailure]) -> ResultTable:
    rows = tuple(
        (
            kernel.name,
            kernel.form.name,
            f"{kernel.degrees[0]:.3g}/{kernel.degrees[1]:.3g}",
            _size(fail.zero),
            _size(fail.nan),
            _size(kernel.change),
        )
        for kernel, fail in zip(chosen, fails, strict=True)
    )
    header = ("formula", "type", "degrees in v*", "plain: 0 from", "plain: NaN from", "exported: in 1/v* beyond")
    return ResultTable("Where the plain quotient N(v*)/D(v*) fails", header, rows)


def _size(number: float) -> str:
    return f"{number:.3g}" if math.isfinite(number) else "never"


def _far(chosen: Sequence[FormulaPair]) -> ResultTable:
    rows = []
    for kernel in chosen:
        row: list[str] = [kernel.name, kernel.form.name]
        for v_star in FAR:
            x = np.array([v_star]).astype(type_of(kernel.form)) if v_star < 2.0**kernel.form.largest else None
            if x is None:
                row += ["no number", "", ""]
                continue
            plain, ours = float(kernel.plain(x)[0]), float(kernel.exported(x)[0])
            row += [f"{plain:.4g}", f"{ours:.4g}", f"{relative_error(kernel, v_star):.1e}"]
        rows.append(tuple(row))
    header = ["formula", "type"]
    for v_star in FAR:
        header += [f"plain, v* = {v_star:.0e}", f"exported, v* = {v_star:.0e}", f"its relative error, {v_star:.0e}"]
    return ResultTable("Plain and exported forms at large v*", tuple(header), tuple(rows))


_ARGUMENTS = (-math.inf, -1.0, -0.0, 0.0, 5e-324, 1e-300, 1e-60, 1e-30, 1e30, 1e60, 1e300, math.inf, math.nan)


def _special(chosen: Sequence[FormulaPair]) -> ResultTable:
    rows = []
    for kernel in chosen:
        if kernel.form.name == "float":
            continue
        found = kernel.exported(np.array(_ARGUMENTS))
        rows.append((kernel.name, *(f"{value:.3g}" for value in found.tolist())))
    for name in last_place.FUNCTIONS:
        values = last_place.evaluated_in(DOUBLE, name, _ARGUMENTS)
        rows.append((f"full, {name}", *(f"{value:.3g}" for value in values)))
    return ResultTable(
        "Results for special arguments, in type double", ("formula", *(f"v* = {x:g}" for x in _ARGUMENTS)), tuple(rows)
    )


def _charts(chosen: Sequence[FormulaPair]) -> Iterator[Chart]:
    by_name = {(kernel.name, kernel.form.name): kernel for kernel in chosen}
    for form, end in (("double", 300), ("float", 38)):
        curves: list[ChartCurve] = []
        v_star = np.logspace(0, end, 400).astype(type_of(FORMATS[form]))
        for name in ("best [3/7]", "half-line 1e-5"):
            kernel = by_name[name, form]
            ours, plain = kernel.exported(v_star), kernel.plain(v_star)
            curves += _positive(f"{name}, exported", v_star, ours, "line")
            curves += _positive(f"{name}, plain", v_star[::8], plain[::8], "points")
        yield Chart(f"eps at large v*, type {form}", r"$v_\ast$", "eps", tuple(curves))


def _positive(name: str, x: Array, y: Array, look: Any) -> list[ChartCurve]:
    """Return the curve through what a logarithmic axis can show."""
    shown = np.isfinite(y) & (y > 0)
    return [curve(name, x[shown], y[shown], look)] if np.any(shown) else []


def _summary(chosen: Sequence[FormulaPair], fails: Sequence[PlainFailure], lost: int) -> str:
    pairs = list(zip(chosen, fails, strict=True))
    parts = []
    for form in FORMATS.values():
        kernel, fail = min((pair for pair in pairs if pair[0].form == form), key=lambda pair: pair[1].zero)
        parts.append(f"from v* = {fail.zero:.3g} on in type {form.name} ({kernel.name})")
    nans = [f.nan for k, f in pairs if math.isfinite(f.nan) and k.form.name == "double"]
    return (
        f"Of {len(chosen)} formulas and types, written down plainly as N(v*)/D(v*), the first gives 0 or NaN instead "
        f"of eps {', and '.join(parts)}; NaN in type double from v* = {min(nans):.3g} to {max(nans):.3g} on. The "
        "exported forms change to powers of 1/v*: at numbers of every size, subnormal and infinite ones included, "
        f"{lost} of their results are not finite. Best approximants fitted for v* <= 5 return finite numbers at large "
        "v*, too; these are no coefficients of restitution, as their headers say."
    )


CASE = Case(
    "overflow",
    "Overflow and underflow of numerator and denominator",
    "From which v* on does N(v*)/D(v*) overflow to 0 or inf/inf? The exported forms must return a finite number for "
    "every v* >= 0 of the type, an accurate one at large v*, and NaN for arguments that are no speeds.",
    run,
)
