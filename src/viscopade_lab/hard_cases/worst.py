"""Search for the arguments at which the rounding errors of exported functions are the largest.

A function is compared with the exact value of its own formula, with the same machine numbers, in ball arithmetic. The
search tries random arguments first, then neighbours of the worst ones, one to thousands of machine numbers away.
`python -m tools.hard_arguments` writes the results into the list for the test vectors.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Iterator, Mapping
from dataclasses import replace
from fractions import Fraction
from typing import Any, NamedTuple, cast

import numpy as np
import numpy.typing as npt
from flint import arb

from viscopade.arithmetic.balls import ball_of, working
from viscopade.arithmetic.decimals import identifier
from viscopade.arithmetic.formats import DOUBLE, FORMATS, Format
from viscopade.kernels import catalogue, compact, full, truth
from viscopade.kernels.expressions import CodeBranch, Reading, read
from viscopade.kernels.kernel import Function as KernelFunction
from viscopade.kernels.kernel import Kernel
from viscopade.kernels.machine import TYPES, function_values, machine_arithmetic, values_and_branches
from viscopade.kernels.speed_table import TABLES, Polynomials, forms_of, speed_table, table_bounds

Array = npt.NDArray[Any]
Inputs = Callable[[Any], dict[str, Any]]

BETA = 1.307
"""beta of the paper's ice, in (s/cm)^(1/5); in a format, the number nearest to it."""
SEED = 1911
BITS = 200  # of ball arithmetic
LEAST = 2.0**-40  # of v* and 1 - eps; below, sums are their first terms
STARTS = 6  # of the search by neighbours
NEIGHBOURS, REACH = 12, 12  # neighbours of each start in a round, up to 2^REACH numbers away


class Function(NamedTuple):
    """An exported function, a branch of it or a row of its table, of one number x of a format, from low to high.

    `computed` returns the results of the code for an array of x, each operation rounded, and `exact` the exact value of
    the formula for one x. The proven `bound` is relative to the exact value, or in units in the last place if `ulp`.
    The function's first argument is x times `scale`; `second` is its second argument, if it has one.
    """

    family: str
    name: str
    form: Format
    computed: Callable[[Array], Array]
    exact: Callable[[float], arb]
    low: float
    high: float
    bound: Fraction
    ulp: bool = False
    scale: float = 1.0
    second: tuple[float, ...] = ()

    def errors(self, x: Array) -> list[float]:
        """Return error / bound, infinite if a result is not finite."""
        with np.errstate(all="ignore"), working(BITS):
            values = np.broadcast_to(self.computed(x), x.shape).tolist()
            return [self._error(at, value) for at, value in zip(x.tolist(), values, strict=True)]

    def _error(self, x: float, value: float) -> float:
        if not math.isfinite(value):
            return math.inf
        exact = self.exact(x)
        size = abs(float(exact))
        unit = 2.0 ** (math.frexp(size)[1] - self.form.precision) if self.ulp else size
        return float(abs(exact - value)) / (unit * float(self.bound))


class Worst(NamedTuple):
    """The argument with the largest error found, and error / bound there."""

    x: float
    error: float


def worst(function: Function, number: int, rounds: int) -> Worst:
    """Try `number` random arguments, then in rounds neighbours of the worst ones; each call tries the same ones."""
    kind = TYPES[function.form.name]
    generator = np.random.default_rng(SEED)
    low, high = kind(function.low), kind(function.high)
    spread = np.exp(generator.uniform(np.log(function.low), np.log(function.high), number // 2))
    even = generator.uniform(function.low, function.high, number - number // 2)
    x = np.clip(np.concatenate([spread, even, [low, high]]).astype(kind), low, high)
    errors = function.errors(x)
    found = [Worst(float(x[i]), errors[i]) for i in np.argsort(errors)[::-1][:STARTS]]
    bits = np.int32 if kind is np.float32 else np.int64
    for _ in range(rounds):
        for i, start in enumerate(found):
            steps = generator.choice(np.array([-1, 1]), NEIGHBOURS) * 2.0 ** generator.uniform(0, REACH, NEIGHBOURS)
            near = np.clip((np.full(NEIGHBOURS, start.x, kind).view(bits) + steps.astype(bits)).view(kind), low, high)
            errors = function.errors(near)
            best = int(np.argmax(errors))
            found[i] = max(start, Worst(float(near[best]), errors[best]), key=lambda one: one.error)
    return max(found, key=lambda one: one.error)


# --- functions --------------------------------------------------------------------------------------------------------


def _machine(form: Format) -> Reading:
    """Return the arithmetic of a format; library functions are rounded once, from double."""
    kind = TYPES[form.name]
    roots = {"sqrt": np.sqrt, "cbrt": np.cbrt, "pow": np.power, "log2": np.log2, "exp2": np.exp2}

    def rounded(root: Callable[..., Any]) -> Callable[..., Any]:
        return lambda *x: root(*(np.asarray(z, np.float64) for z in x)).astype(kind)

    by = machine_arithmetic(form)
    return replace(by, functions={**by.functions, **{name: rounded(root) for name, root in roots.items()}})


_EXACTLY = Reading(
    lambda text: ball_of(Fraction(text)),
    {
        "sqrt": arb.sqrt,
        "cbrt": lambda x: x.root(3),
        "pow": lambda x, y: (x.log() * y).exp(),
        "log2": lambda x: x.log() / arb.const_log2(),
        "exp2": lambda x: (x * arb.const_log2()).exp(),
        "divide": lambda x, y: x / y,
    },
)


def of_branch(
    family: str, name: str, form: Format, branch: CodeBranch, result: str, constants: Mapping[str, float],
    inputs: Inputs, ends: tuple[float, float], bound: Fraction, scale: float = 1.0, second: tuple[float, ...] = (),
) -> Function:  # fmt: skip
    """Return a result of a branch as a function of x."""
    kind, by = TYPES[form.name], _machine(form)
    numbers = {n: kind(c) for n, c in constants.items()}
    balls = {n: ball_of(Fraction(c)) for n, c in constants.items()}

    def computed(x: Array) -> Array:
        return np.asarray(read(branch, [result], {**numbers, **inputs(x)}, by)[result])

    def exact(x: float) -> arb:
        return cast(arb, read(branch, [result], {**balls, **inputs(arb(x))}, _EXACTLY)[result])

    return Function(family, name, form, computed, exact, *ends, bound, False, scale, second)


def functions(rows: int) -> Iterator[Function]:
    """Yield all exported functions, and some rows of each table."""
    for family, groups in (("quotients", ("pade", "minimax")), ("inverse", ("inverse",)), ("compact", ("compact",))):
        for entry in (entry for group in groups for entry in catalogue.group(group)):
            for form in map(FORMATS.get, entry.kernel.formats):
                yield from _of_kernel(family, entry.kernel, cast(Format, form))
    for tier in catalogue.TIERS:
        if isinstance(table := TABLES[tier], Polynomials):
            yield from _of_table(identifier(tier), table, rows)
    for name in full.FUNCTIONS:
        yield _full(name)
    yield _full_from_speed()


def _of_kernel(family: str, kernel: Kernel, form: Format) -> Iterator[Function]:
    """Yield the functions of one argument, and the speed functions of compact kernels for one beta."""
    beta = form.nearest(Fraction(str(BETA)))
    top = float(np.nextafter(TYPES[form.name](1), TYPES[form.name](0)))
    for function in kernel.functions:
        bounds = kernel.bound(function.name, "host", form.name)
        if not bounds or (function.name in ("restitution", "beta") and family != "compact"):
            continue
        widest = bounds[-1]
        second = (beta,) if family == "compact" else ()
        ends = {
            "quotients": (LEAST, float(widest.high)),
            "inverse": (LEAST, top),
            "compact": (2.0 ** (10 - form.largest), 2.0 ** (compact.CUT_EXPONENT[form.name] - 3)),
        }[family]
        sizes = ((b.rounding + b.last) / (1 + b.formula) for b in bounds if b.covers(widest.low, widest.high))
        name = f"{function.name}_{kernel.name}"
        computed, exact = _readings(kernel, function.pruned, form, second)
        yield Function(family, name, form, computed, exact, *ends, min(sizes), second=second)


def _readings(
    kernel: Kernel, function: KernelFunction, form: Format, second: tuple[float, ...]
) -> tuple[Callable[[Array], Array], Callable[[float], arb]]:
    """Return a function as the code computes it, and its exact value with the exact 1/30."""
    numbers, kind, by = kernel.constants[form.name], TYPES[form.name], _machine(form)
    balls = {name: ball_of(Fraction(c)) for name, c in numbers.items()}
    balls |= {"thirtieth": arb(1) / 30} if "thirtieth" in balls else {}
    given = {name: kind(c) for name, c in numbers.items()}
    wholes = [CodeBranch(None, (*function.start, *b.program), b.results) for b in function.branches]

    def branch_at(x: Any) -> Any:
        return values_and_branches(kernel, function.name, x, *second, form=form)[1]

    def computed(x: Array) -> Array:
        found, taken = np.full(x.shape, math.nan, kind), branch_at(x)
        for index, whole in enumerate(wholes):
            arguments = dict(zip(function.arguments, (x[taken == index], *map(kind, second)), strict=True))
            found[taken == index] = read(whole, [function.result], {**given, **arguments}, by)[function.result]
        return found

    def exact(x: float) -> arb:
        arguments = dict(zip(function.arguments, map(arb, (x, *second)), strict=True))
        return cast(
            arb, read(wholes[branch_at(x)], [function.result], {**balls, **arguments}, _EXACTLY)[function.result]
        )

    return computed, exact


def _of_table(kernel: str, table: Polynomials, rows: int) -> Iterator[Function]:
    """Yield eps and 1 - eps^2 on some rows, as functions of the mantissa m of w = v*^10, for an exact w."""
    inside = range(table.switch % 7, table.size, table.size // rows)
    row = table.sums()
    for form in forms_of(table):
        unit = Fraction(1, 2**form.precision)
        for index in sorted({*inside, table.switch - 1, table.switch}):  # the last with base 1, the first with base 0
            base, (exponent, low, high), proven = table.base(index), table.interval(index), table.bounds(index)
            # |dp| <= rounding min(eps, 1 - eps), and the smaller one is |p|, except for the formula's error.
            size = proven[form.name] * (1 + proven["error"])
            constants = table.coefficients(index) | {"base": float(base), "rest_of_base": float(1 - base)}
            ends = float(low), float(form.nearest(high * (1 - 2 * unit)))
            for result, bound in (("restitution", size + unit), ("dissipation", size + 6 * unit)):
                name, scale = f"{result}_{kernel}", 2.0**exponent
                origin = float(table.origin(index))
                given = lambda x, origin=origin: {table.variable: x - origin}  # noqa: E731
                yield of_branch("tables", name, form, row, result, constants, given, ends, bound, scale, (1.0,))


def _full(name: str) -> Function:
    """Return eps or 1 - eps of full accuracy; exact is the true value."""

    def exact(x: float) -> arb:
        true = truth.exact_portions(arb(x))
        return true.epsilon if name == "epsilon" else true.loss

    bound, computed = full.largest_ulp(name), lambda x: np.asarray(function_values(full.full(), name, x))
    return Function("full", f"{name}_full", DOUBLE, computed, exact, 2.0**-20, 2.0**19, bound, ulp=True)


def _full_from_speed() -> Function:
    """Return eps of the table of full accuracy, for beta = 1, where w is exact."""
    kernel, table = speed_table("full"), TABLES["full"]
    return Function(
        "full", "restitution_full", DOUBLE, lambda x: function_values(kernel, "restitution", x, np.ones_like(x)),
        lambda x: truth.exact_portions(arb(x).root(10)).epsilon, 2.0**table.first, 2.0**60, table_bounds(table)["ulp"],
        ulp=True, second=(1.0,),
    )  # fmt: skip
