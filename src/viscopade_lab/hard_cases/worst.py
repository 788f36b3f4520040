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
"""From x, an array of machine numbers or a ball, to the inputs of a program by name."""

BETA = 1.307
"""beta of the paper's ice, in (s/cm)^(1/5); in a format, the number nearest to it."""
SEED = 1911
"""Of the random numbers. Any would do: with two others the largest errors differ by a hundredth (measured)."""
BITS = 200
"""Of ball arithmetic, about 150 more than double has; 120 to 400 give the same errors (measured)."""
LEAST = 2.0**-40
"""Least v* and 1 - eps that are tried: below, sums are nearly their first terms, as others fall like powers of v*."""
STARTS = 6
"""Arguments whose neighbours are tried; 3 to 12 change the errors found by 4 % on average (measured)."""
NEIGHBOURS, REACH = 12, 12
"""Neighbours of each start in a round, up to 2^REACH machine numbers away. Chosen by hand: 6 to 24 neighbours, or 2^6
to 2^20, change the errors found by 3 % on average (measured)."""


class Function(NamedTuple):
    """An exported function, a branch of it or a row of its table, of one number x of a format, from low to high.

    Attributes
    ----------
    family : str
        Group of functions, such as "quotients" (`rounding.FAMILIES`).
    name : str
        Name in C without the prefix, such as "epsilon_3_6".
    form : Format
        The number format, float or double.
    computed : callable
        From an array of x to the results of the code, each operation rounded.
    exact : callable
        From one x to the exact value of the formula, as a ball; to be called within `working`.
    low, high : float
        Range of x.
    bound : Fraction
        Proven bound of the error, relative to the exact value, or in ulp if `ulp`.
    ulp : bool
    scale : float
        The first argument of the function in C is x times this.
    second : tuple of float
        Its second argument (beta), if it has one.
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
        """Return error / bound for every x of an array, infinite if a result is not finite."""

        def error_over_bound(x_i: float, value: float) -> float:
            """Return the error of the result `value` at x_i, in units of the bound."""
            if not math.isfinite(value):
                return math.inf
            exact = self.exact(x_i)
            size = abs(float(exact))
            # size = f 2^e with 1/2 <= f < 1, e from frexp: its ulp is 2^(e - precision).
            unit = 2.0 ** (math.frexp(size)[1] - self.form.precision) if self.ulp else size
            return float(abs(exact - value)) / (unit * float(self.bound))

        with np.errstate(all="ignore"), working(BITS):
            values = np.broadcast_to(self.computed(x), x.shape).tolist()
            return [error_over_bound(x_i, value) for x_i, value in zip(x.tolist(), values, strict=True)]


class Worst(NamedTuple):
    """The argument x with the largest error that a search found, and error / bound there."""

    x: float
    error: float


def worst(function: Function, number: int, rounds: int) -> Worst:
    """Return the argument of a function with the largest error that a search finds.

    The search tries `number` random arguments, then in each of `rounds` neighbours of the worst ones. Each call tries
    the same arguments.
    """
    kind = TYPES[function.form.name]
    generator = np.random.default_rng(SEED)
    low, high = kind(function.low), kind(function.high)
    # Half of the arguments are uniform in log x, for all sizes; half are uniform in x, for the last octaves. And the
    # ends.
    log_uniform = np.exp(generator.uniform(np.log(function.low), np.log(function.high), number // 2))
    uniform = generator.uniform(function.low, function.high, number - number // 2)
    x = np.clip(np.concatenate([log_uniform, uniform, [low, high]]).astype(kind), low, high)
    errors = function.errors(x)
    starts = [Worst(float(x[i]), errors[i]) for i in np.argsort(errors)[::-1][:STARTS]]
    # Positive machine numbers, read as integers, are consecutive: + 1 is the next number.
    integer = np.int32 if kind is np.float32 else np.int64
    for _ in range(rounds):
        for i, start in enumerate(starts):
            # Random steps, up or down, from 1 to 2^REACH numbers; their log2 is uniform.
            steps = generator.choice(np.array([-1, 1]), NEIGHBOURS) * 2.0 ** generator.uniform(0, REACH, NEIGHBOURS)
            bits = np.full(NEIGHBOURS, start.x, kind).view(integer) + steps.astype(integer)
            near = np.clip(bits.view(kind), low, high)
            errors = function.errors(near)
            largest = int(np.argmax(errors))
            # A start moves to its worst neighbour if that is worse.
            starts[i] = max(start, Worst(float(near[largest]), errors[largest]), key=lambda argument: argument.error)
    return max(starts, key=lambda argument: argument.error)


# --- functions --------------------------------------------------------------------------------------------------------


def _machine(form: Format) -> Reading:
    """Return the arithmetic of a format (each operation rounds), with NumPy's roots, powers and logarithms of doubles.

    In float their results are rounded once more, so that they are nearly exact. Proven bounds allow a C library more.
    """
    kind = TYPES[form.name]
    roots = {"sqrt": np.sqrt, "cbrt": np.cbrt, "pow": np.power, "log2": np.log2, "exp2": np.exp2}

    def rounded(root: Callable[..., Any]) -> Callable[..., Any]:
        """Return the function of numbers of the format that computes `root` in double."""
        return lambda *x: root(*(np.asarray(z, np.float64) for z in x)).astype(kind)

    arithmetic = machine_arithmetic(form)
    nearly_exact = {name: rounded(root) for name, root in roots.items()}
    return replace(arithmetic, functions={**arithmetic.functions, **nearly_exact})


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
"""The arithmetic of balls: a program read with it gives the exact value of its formula."""


def branch_function(
    family: str, name: str, form: Format, branch: CodeBranch, result: str, constants: Mapping[str, float],
    inputs: Inputs, ends: tuple[float, float], bound: Fraction, scale: float = 1.0, second: tuple[float, ...] = (),
) -> Function:  # fmt: skip
    """Return one result of a piece of code, a branch without its condition, as a function of x.

    `result` is its name in the branch. The branch takes `constants` (machine numbers by name) and what `inputs` makes
    of x; x lies between the `ends`. The other arguments are fields of `Function`.
    """
    kind, arithmetic = TYPES[form.name], _machine(form)
    # The constants as numbers of the format, and the same numbers as exact balls.
    numbers = {n: kind(c) for n, c in constants.items()}
    balls = {n: ball_of(Fraction(c)) for n, c in constants.items()}

    # `read` gives the results of a branch by name, computed in an arithmetic from constants and inputs.
    def computed(x: Array) -> Array:
        return np.asarray(read(branch, [result], {**numbers, **inputs(x)}, arithmetic)[result])

    def exact(x: float) -> arb:
        return cast(arb, read(branch, [result], {**balls, **inputs(arb(x))}, _EXACTLY)[result])

    return Function(family, name, form, computed, exact, *ends, bound, False, scale, second)


def functions(rows: int) -> Iterator[Function]:
    """Yield all exported functions, and some rows of each table: about as many as `rows`."""
    # Families, and the groups of the catalogue of kernels that make them.
    for family, groups in (("quotients", ("pade", "minimax")), ("inverse", ("inverse",)), ("compact", ("compact",))):
        for entry in (entry for group in groups for entry in catalogue.group(group)):
            for form in map(FORMATS.get, entry.kernel.formats):
                yield from kernel_functions(family, entry.kernel, cast(Format, form))
    # Speed tables by accuracy; the one of full accuracy is no table of polynomials, and comes last.
    for tier in catalogue.TIERS:
        if isinstance(table := TABLES[tier], Polynomials):
            yield from table_functions(identifier(tier), table, rows)
    # eps and 1 - eps of full accuracy, against the true values.
    for name in full.FUNCTIONS:
        yield full_function(name)
    # eps from speed by the table of full accuracy, for beta = 1, where w = beta^5 speed is exact and v* = w^(1/10).
    kernel, table = speed_table("full"), TABLES["full"]
    yield Function(
        "full", "restitution_full", DOUBLE, lambda x: function_values(kernel, "restitution", x, np.ones_like(x)),
        lambda x: truth.exact_portions(arb(x).root(10)).epsilon,
        # From the beginning of the table, w = 2^first = 2^-64, to four octaves (a choice) before its end, 2^64.
        2.0**table.first, 2.0**60, table_bounds(table)["ulp"], ulp=True, second=(1.0,),
    )  # fmt: skip


def full_function(name: str) -> Function:
    """Return "epsilon" or "one_minus_epsilon" of full accuracy as a function of v*; `exact` is the true value."""

    def exact(x: float) -> arb:
        true = truth.exact_portions(arb(x))
        return true.epsilon if name == "epsilon" else true.loss

    def computed(x: Array) -> Array:
        return np.asarray(function_values(full.full(), name, x))

    # Below 2^-20 1 - eps is v*^2 times its limit to 2^-40, and from 2^20 on eps(8 v*) is eps(v*)/2^10 with the same
    # roundings: nearly all rows of the table are used between these ends.
    low, high = 2.0**-20, 2.0**19
    return Function("full", f"{name}_full", DOUBLE, computed, exact, low, high, full.largest_ulp(name), ulp=True)


def kernel_functions(family: str, kernel: Kernel, form: Format) -> Iterator[Function]:
    """Yield the functions of a kernel without tables, in one format.

    Families "quotients" and "inverse" have functions of one argument, v* or eps or 1 - eps. "compact" has functions of
    speed and beta, which are searched for one beta, `BETA`.
    """
    beta = form.nearest(Fraction(str(BETA)))
    # The largest number below 1, for eps or 1 - eps.
    below_one = float(np.nextafter(TYPES[form.name](1), TYPES[form.name](0)))
    for function in kernel.functions:
        # Bounds on ranges of v*, the last of which is the widest. Functions without bounds are left out, and
        # "restitution" of quotients and "beta" of inverse kernels: a power before or after a function that is searched.
        bounds = kernel.bound(function.name, "host", form.name)
        if not bounds or (function.name in ("restitution", "beta") and family != "compact"):
            continue
        widest = bounds[-1]
        second = (beta,) if family == "compact" else ()
        ends = {
            "quotients": (LEAST, float(widest.high)),
            "inverse": (LEAST, below_one),
            # Speeds whose w = beta^5 speed = 3.8 speed is normal, nine octaves (a choice) above the smallest normal
            # number 2^(1 - largest), and below the cut-off of w, as 3.8 < 2^3.
            "compact": (2.0 ** (10 - form.largest), 2.0 ** (compact.CUT_EXPONENT[form.name] - 3)),
        }[family]
        # `errors` are relative to the formula's value R, bounds of rounding (rounding + last) to the true value, which
        # they reach from R by a factor 1 + formula, formula being the relative error of R. All hold: the least counts.
        sizes = ((b.rounding + b.last) / (1 + b.formula) for b in bounds if b.covers(widest.low, widest.high))
        name = f"{function.name}_{kernel.name}"
        computed, exact = computed_and_exact(kernel, function.pruned, form, second)
        yield Function(family, name, form, computed, exact, *ends, min(sizes), second=second)


def computed_and_exact(
    kernel: Kernel, function: KernelFunction, form: Format, second: tuple[float, ...]
) -> tuple[Callable[[Array], Array], Callable[[float], arb]]:
    """Return a kernel's function as the code computes it, from an array, and its exact value, from one x, as a ball.

    `second` is the function's second argument, if it has one. The exact value takes the branch that the code takes.
    """
    numbers, kind, arithmetic = kernel.constants[form.name], TYPES[form.name], _machine(form)
    balls = {name: ball_of(Fraction(c)) for name, c in numbers.items()}
    # Compact kernels have y = w^(1/30): the rounding of their constant 1/30 belongs to the error, and is not exact.
    balls |= {"thirtieth": arb(1) / 30} if "thirtieth" in balls else {}
    constants = {name: kind(c) for name, c in numbers.items()}
    # Each branch with the statements before it, without its condition.
    programs = [CodeBranch(None, (*function.start, *b.program), b.results) for b in function.branches]

    def branch_index(x: Any) -> Any:
        """Return the index of the branch that the code takes, for each x."""
        return values_and_branches(kernel, function.name, x, *second, form=form)[1]

    def computed(x: Array) -> Array:
        """Return the results of the code: those of each branch where it is taken, NaN where none is."""
        results, taken = np.full(x.shape, math.nan, kind), branch_index(x)
        for index, program in enumerate(programs):
            arguments = dict(zip(function.arguments, (x[taken == index], *map(kind, second)), strict=True))
            values = read(program, [function.result], {**constants, **arguments}, arithmetic)
            results[taken == index] = values[function.result]
        return results

    def exact(x: float) -> arb:
        """Return the exact value of the formula of the branch that is taken."""
        arguments = dict(zip(function.arguments, map(arb, (x, *second)), strict=True))
        values = read(programs[branch_index(x)], [function.result], {**balls, **arguments}, _EXACTLY)
        return cast(arb, values[function.result])

    return computed, exact


def table_functions(accuracy: str, table: Polynomials, rows: int) -> Iterator[Function]:
    """Yield eps and 1 - eps^2 on some rows of a speed table, about as many as `rows`, in each format of its sums.

    They are functions of the mantissa m, where w = v*^10 = 2^e m with 1 <= m <= 2; w is exact. `accuracy` is the end of
    the functions' names in C, such as "1em5".
    """
    # Rows in equal steps. An octave of w has a power of two of them, so that without the offset, up to 6 rows (1, 2 of
    # the tables here), all would begin octaves. And those at the switch w = 1/8: the last with eps = 1 + p, p < 0, and
    # the first with eps = p.
    evenly = range(table.switch % 7, table.size, table.size // rows)
    indices = sorted({*evenly, table.switch - 1, table.switch})
    branch = table.sums()  # from a row's numbers and m (or m - origin) to the results
    for form in forms_of(table):
        unit = Fraction(1, 2**form.precision)
        for index in indices:
            # The row has m from low to high, in the octave of this exponent; `proven` are the bounds of p.
            base, (exponent, low, high), proven = table.base(index), table.interval(index), table.bounds(index)
            # |dp| <= rounding min(eps, 1 - eps), and the smaller one is |p|, except for the formula's error.
            rounding = proven[form.name] * (1 + proven["error"])
            constants = table.coefficients(index) | {"base": float(base), "rest_of_base": float(1 - base)}
            # `high` itself belongs to the next row: two unit roundoffs less are the number before it, or two.
            ends = float(low), float(form.nearest(high * (1 - 2 * unit)))
            # eps = base + p rounds once more. 1 - eps^2 = (1 - base) - p (2 base + p) has three more operations, for
            # which headers state 3 ulp: at most 6 unit roundoffs.
            for result, bound in (("restitution", rounding + unit), ("dissipation", rounding + 6 * unit)):
                # In C the argument is the speed, equal to w for beta = 1: 2^exponent m.
                name, scale = f"{result}_{accuracy}", 2.0**exponent
                origin = float(table.origin(index))
                inputs = lambda x, origin=origin: {table.variable: x - origin}  # noqa: E731
                yield branch_function(
                    "tables", name, form, branch, result, constants, inputs, ends, bound, scale, (1.0,)
                )  # fmt: skip
