"""The exported functions, as the programs that the generated text is made of: computed in a type, and exactly.

Coefficients are those of the files in exports/ (the tests compare them). The bounds of rounding errors are proven anew,
relative to the formula's own value; what the headers print is these numbers, brought to eps and rounded up.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import dataclass, field, replace
from fractions import Fraction
from functools import lru_cache, partial
from typing import Any

import numpy as np
from flint import arb

from viscopade.approximation import half_line, inverse, machine_coefficients, minimax
from viscopade.approximation.inverse import WHOLE_FORM
from viscopade.approximation.lacunary import LacunaryQuotient, Powers
from viscopade.arithmetic.balls import ball_of, exact_middle, working
from viscopade.arithmetic.formats import DOUBLE, FLOAT, FORMATS, Format
from viscopade.kernels import names, prove_rational, rounding, truth
from viscopade.kernels.expressions import (
    Arithmetic,
    CodeBranch,
    Expression,
    Program,
    Run,
    evaluate,
)
from viscopade.kernels.forms import formulas, last_place, rounding_bounds, speed_kernel, table_free
from viscopade.kernels.forms.quotient import PadeKernel
from viscopade.kernels.forms.rounding_bounds import ULPS, Size
from viscopade.kernels.forms.speed_table import REST, Table
from viscopade.kernels.forms.speed_table_last_place import LastPlaceTable, restitution
from viscopade.theory.pade import pade
from viscopade.theory.paper import TABLE
from viscopade_lab.hard_cases.machine import Array, Contracted, moved, type_of

MINIMAX = ((1, 4), (3, 7), (6, 9))
"""Degrees of the best approximants up to v* = `MINIMAX_END` in exports/; the last has no functions of type float."""
MINIMAX_END = Fraction(5)
HALF_LINE = {"1e-3": Powers((0, 9, 19), (0, 6, 15)), "1e-5": Powers((0, 4, 12, 19), (0, 4, 6, 8, 15)),
             "1e-7": Powers((0, 6, 12, 13, 17, 18, 26), (0, 6, 8, 9, 10, 22))}  # fmt: skip
"""Powers of the half-line kernels in exports/, by accuracy; the last has no functions of type float."""
INVERSE = {"1e-3": Powers((0, 16), (0, 10, 18)), "1e-5": Powers((0, 13, 15, 22), (0, 10, 13, 16, 24))}
"""Powers of the inverse kernels."""
ONLY_DOUBLE = ("[6/9]", "1e-7")
BITS = 200
"""Of ball arithmetic."""
BETA = 1.307
"""Of the paper's ice, in (s/cm)^(1/5); in a type, the number nearest to it."""

_LEAST = 2.0**-40  # of v* and 1 - eps in a search; below, sums are their first terms
_LARGEST = {DOUBLE: 2.0**40, FLOAT: 2.0**25}  # results stay normal numbers
_NARROW = Fraction(1, 2**40)
_NEAREST_ZERO = 2.0**-10  # of v* where derivatives are tried

Given = Callable[[Any], dict[str, Any]]


@dataclass(frozen=True)
class ExportedFunction:
    """An exported function of one variable x in one format, on a part of its domain.

    Attributes
    ----------
    kernel, name : str
    form : Format
    program : Program
    result : Expression
    constants : mapping
        Machine numbers by name.
    given : callable
        From x to the program's inputs.
    low, high : float
        Where x is looked for.
    relative : Fraction
        Proven bound of what rounding does, relative to the formula's value.
    underflow : Fraction
        What underflow adds, absolutely.
    exactly : mapping
        By name, constants that the formula has in place of machine numbers.
    roots : bool
        Whether it takes a root that the header assumes to be within `rounding_bounds.ULPS` units in the last place.
    local : callable or None
        From x to what `relative` would be for this x alone, by the same proof.
    """

    kernel: str
    name: str
    form: Format
    program: Program
    result: Any
    constants: Mapping[str, float]
    given: Given
    low: float
    high: float
    relative: Fraction
    underflow: Fraction = Fraction(0)
    exactly: Mapping[str, Fraction] = field(default_factory=dict)
    roots: bool = False
    local: Callable[[float], Fraction] | None = None

    def computed(self, x: Array, steps: Array | int = 0, contracted: bool = False) -> Array:
        """Return what the code returns for numbers of the type.

        `steps` are those by which roots are off what they are here, `contracted` fuses products with sums.
        """
        kind = type_of(self.form)
        wrap: Callable[[Any], Any] = Contracted if contracted else _unchanged
        off = np.broadcast_to(np.asarray(steps), x.shape)

        def literal(text: str) -> Any:
            return wrap(kind(text))

        def called(name: str, *arguments: Any) -> Any:
            values = [np.asarray(z.value if contracted else z) for z in arguments]
            return wrap(_root(name, off, *values))

        functions = {name: lambda *z, name=name: called(name, *z) for name in _ROOTS}
        inputs = {name: wrap(value) for name, value in self.given(x).items()}
        numbers = {name: wrap(kind(c)) for name, c in self.constants.items()}
        with np.errstate(all="ignore"):
            found = read(self.program, self.result, {**numbers, **inputs}, Arithmetic(literal, functions))
        result: Array = np.asarray(found.value if contracted else found)
        return np.broadcast_to(result, x.shape)

    def exact(self, x: float) -> arb:
        """Enclose the formula's value: the program in ball arithmetic; to be called within `balls.working`."""
        constants = {name: ball_of(Fraction(c)) for name, c in self.constants.items()}
        constants |= {name: ball_of(c) for name, c in self.exactly.items()}
        found: arb = read(self.program, self.result, {**constants, **self.given(arb(x))}, _EXACTLY)
        return found

    def allowed(self, exact: float) -> float:
        """Return the proven bound of the error, as a number, where the value is nearly `exact`."""
        return float(self.relative) * abs(exact) + float(self.underflow)


def read(program: Program, result: Expression, given: Mapping[str, Any], arithmetic: Arithmetic) -> Any:
    """Return the result of a program, given its inputs and constants."""
    return evaluate(result, Run(program, given, arithmetic), arithmetic)


def _unchanged(value: Any) -> Any:
    return value


_ROOTS: Mapping[str, Callable[..., Any]] = {
    "sqrt": np.sqrt,
    "cbrt": np.cbrt,
    "pow": np.power,
    "log2": np.log2,
    "exp2": np.exp2,
}


_EXACTLY = Arithmetic(
    lambda text: ball_of(Fraction(text)),
    {
        "sqrt": arb.sqrt,
        "cbrt": lambda x: x.root(3),
        "pow": lambda x, y: (x.log() * y).exp(),
        "log2": lambda x: x.log() / arb.const_log2(),
        "exp2": lambda x: (x * arb.const_log2()).exp(),
    },
)


def _root(name: str, steps: Array, *arguments: Array) -> Array:
    """Return the function's value, but for sqrt moved by steps; in type float it is rounded once, from type double."""
    kind = arguments[0].dtype
    found: Array = np.asarray(_ROOTS[name](*(z.astype(np.float64) for z in arguments))).astype(kind)
    if name == "sqrt" or not np.any(steps):
        return found
    # The numbers are positive but for logarithms; 0, infinities and NaN stay.
    steps = np.where((found == 0) | ~np.isfinite(found), 0, steps)
    shifted: Array = np.copysign(moved(np.abs(found), steps), found)
    return shifted


def upper(ball: arb) -> Fraction:
    """Return an upper bound as a fraction."""
    return exact_middle(arb(ball.abs_upper()))


# --- quotients of polynomials -----------------------------------------------------------------------------------------


def _v_star(x: Any) -> dict[str, Any]:
    return {"v_star": x}


def _pade_end(kernel: PadeKernel) -> Fraction:
    """Return the largest v* for which a header states an error."""
    return max(v for v in prove_rational.USEFUL if kernel.end is None or v < Fraction(kernel.end[1]) * Fraction(9, 10))


@lru_cache(maxsize=8)
def pade_kernel(m: int, n: int) -> PadeKernel:
    """Return an approximant of the paper's table, without proofs."""
    return prove_rational.without_proof(pade(m, n, prove_rational.DIGITS))


def of_pade() -> Iterator[ExportedFunction]:
    """Yield the paper's approximants, compared with the polynomials of machine numbers, and with those of 40 digits."""
    for m, n in TABLE:
        kernel = pade_kernel(m, n)
        end = _pade_end(kernel)
        digits = tuple(map(Fraction, kernel.a)), tuple(map(Fraction, kernel.b))
        for form in FORMATS.values():
            a, b = kernel.rounded(form)
            machine = tuple(map(Fraction, a)), tuple(map(Fraction, b))
            for name, of in (("epsilon", machine), ("epsilon, coefficients too", digits)):
                size = rounding_bounds.quotient_rounding(*of, form, Fraction(0), end, coefficients=of is digits)
                function = of_quotient(f"Padé {kernel.label}", name, form, a, b, end, upper(size))
                given = formulas.dense(a=of[0], b=of[1])
                yield replace(function, exactly=given, local=_of_quotient_at(*of, form, of is digits))


def _of_quotient_at(
    a: Sequence[Fraction], b: Sequence[Fraction], form: Format, coefficients: bool = False
) -> Callable[[float], Fraction]:
    """Return the bound of `rounding_bounds.quotient_rounding` for one v*."""
    return lambda x: upper(rounding_bounds.quotient_rounding(a, b, form, *_around(x), coefficients=coefficients))


def _around(x: float) -> tuple[Fraction, Fraction]:
    """Return an interval that is hardly wider than a number."""
    return Fraction(x) * (1 - _NARROW), Fraction(x) * (1 + _NARROW)


def of_quotient(
    kernel: str,
    name: str,
    form: Format,
    a: Sequence[float],
    b: Sequence[float],
    end: Fraction,
    relative: Fraction,
) -> ExportedFunction:
    """Return a quotient of polynomials with machine numbers a and b, up to v* = end."""
    numbers = formulas.dense(a=a, b=b)
    near, _ = formulas.epsilon_branches(numbers)
    result, ends = near.results["epsilon"], (_LEAST, float(end))
    return ExportedFunction(kernel, name, form, near.program, result, numbers, _v_star, *ends, relative)


@lru_cache(maxsize=8)
def minimax_fit(m: int, n: int, form: Format) -> machine_coefficients.MachineFit:
    """Return a best approximant up to `MINIMAX_END` with machine numbers."""
    return machine_coefficients.machine(minimax.fit(m, n, MINIMAX_END), form)


def minimax_coefficients(m: int, n: int, form: Format) -> tuple[tuple[float, ...], tuple[float, ...]]:
    """Return the machine numbers a and b of a best approximant up to `MINIMAX_END`."""
    found = minimax_fit(m, n, form)
    return found.a, found.b


def of_minimax(degrees: Sequence[tuple[int, int]] = MINIMAX) -> Iterator[ExportedFunction]:
    """Yield the best approximants."""
    for m, n in degrees:
        label = f"[{m}/{n}]"
        for form in formats(label):
            a, b = minimax_coefficients(m, n, form)
            machine = tuple(map(Fraction, a)), tuple(map(Fraction, b))
            size = upper(rounding_bounds.quotient_rounding(*machine, form, Fraction(0), MINIMAX_END))
            function = of_quotient(f"best {label}", "epsilon", form, a, b, MINIMAX_END, size)
            yield replace(function, local=_of_quotient_at(*machine, form))


def formats(name: str) -> tuple[Format, ...]:
    """Return the formats in which a kernel is exported."""
    return (DOUBLE,) if name in ONLY_DOUBLE else (DOUBLE, FLOAT)


# --- quotients in powers of a root ------------------------------------------------------------------------------------


def _machine(quotient: LacunaryQuotient, form: Format) -> tuple[tuple[float, ...], tuple[float, ...]]:
    return tuple(map(form.nearest, quotient.a)), tuple(map(form.nearest, quotient.b))


def half_line_numbers(accuracy: str, form: Format) -> tuple[Powers, tuple[float, ...], tuple[float, ...]]:
    """Return powers and machine numbers of a half-line kernel."""
    powers = HALF_LINE[accuracy]
    return powers, *_machine(half_line.fit_half_line(powers, "both").quotient, form)


def half_line_parts(accuracy: str, form: Format, name: str) -> tuple[ExportedFunction, ExportedFunction]:
    """Return eps or 1 - eps of a half-line kernel for v* <= 1 and beyond, without bounds."""
    powers, a, b = half_line_numbers(accuracy, form)
    numbers, branches = formulas.constants(powers, a, b), formulas.half_line_branches(powers)
    kind = type_of(form)
    beyond = float(np.nextafter(kind(1), kind(2)))
    kernel, ends = f"half-line {accuracy}", ((_LEAST, 1.0), (beyond, _LARGEST[form]))
    near, far = (
        ExportedFunction(
            kernel, name, form, branch.program, branch.results[name], numbers, _v_star, *end, Fraction(0), roots=True
        )
        for branch, end in zip(branches, ends, strict=True)
    )
    return near, far


def of_half_line(accuracies: Sequence[str] = tuple(HALF_LINE)) -> Iterator[ExportedFunction]:
    """Yield eps and 1 - eps of the half-line kernels, on both sides of v* = 1."""
    for accuracy in accuracies:
        for form in formats(accuracy):
            sizes = rounding_bounds.half_line_sizes(*half_line_numbers(accuracy, form), form)
            for name, size in sizes.items():
                near, far = half_line_parts(accuracy, form, name)
                yield _bounded(near, size, "y", _half_line_near_at)
                yield _bounded(far, size, "u", _half_line_far_at)


# From x and a type to the inputs of a branch, its root, and a bound of the error of the root's logarithm.
RootAt = Callable[[arb, Format], tuple[dict[str, rounding.Rounded], arb, arb]]


def _bounded(function: ExportedFunction, size: Size, variable: str, at: RootAt) -> ExportedFunction:
    """Return the function with its bounds, and that for one argument: the program run with `rounding.Rounded`."""
    form = function.form
    branch = CodeBranch(None, function.program, {function.name: function.result})

    def local(x: float) -> Fraction:
        with working(BITS):
            inputs, root, error = at(arb(x), form)
            # A computed root may be beyond a power of 2 that the exact one has not reached.
            near = root * arb(1, arb(2) ** (1 - form.precision))
            numbers = {name: rounding.Rounded(arb(c), form) for name, c in function.constants.items()}
            given = {**numbers, **inputs, variable: rounding.Rounded(near, form, slope=1)}
            found = rounding.of_branch(branch, [function.name], given, form)[function.name].with_error_of_y(error)
            return upper(found.relative + found.underflow / arb(found.value.abs_lower()))

    underflow = Fraction(size.underflow) * form.smallest
    return replace(function, relative=Fraction(size.relative), underflow=underflow, local=local)


def _log_error(relative: arb) -> arb:
    """Bound the error of the logarithm of a number with this relative error."""
    return -(1 - relative).log()


def _of_root(form: Format) -> arb:
    """Bound the error of the logarithm of a root that is within `ULPS` units in the last place."""
    return _log_error(2 * ULPS * arb(2) ** -form.precision)


def _half_line_near_at(x: arb, form: Format) -> tuple[dict[str, rounding.Rounded], arb, arb]:
    return {"v_star": rounding.Rounded(x, form)}, x.root(3), _of_root(form)


def _half_line_far_at(x: arb, form: Format) -> tuple[dict[str, rounding.Rounded], arb, arb]:
    unit = arb(2) ** -form.precision
    return {"w": rounding.Rounded(1 / x, form, relative=unit)}, (1 / x).root(3), _of_root(form) + _log_error(unit) / 3


def of_inverse(accuracies: Sequence[str] = tuple(INVERSE)) -> Iterator[ExportedFunction]:
    """Yield v* of eps and of 1 - eps, on both sides of eps = 1/2."""
    for accuracy in accuracies:
        powers = INVERSE[accuracy]
        quotient = inverse.fit_whole(powers).quotient
        for form in formats(accuracy):
            a, b = _machine(quotient, form)
            size = rounding_bounds.inverse_sizes(powers, WHOLE_FORM, Fraction(0), a, b, form)["v_star"]
            numbers = formulas.constants(powers, a, b)
            near, far = formulas.inverse_branches(powers, WHOLE_FORM)
            kind = type_of(form)
            below, above, one = (float(np.nextafter(kind(x), kind(y))) for x, y in ((0.5, 0), (0.5, 1), (1, 0)))
            parts = (
                ("v*(eps)", _of_epsilon, "y", near, 0.5, one),
                ("v*(eps)", _of_epsilon, "u", far, _LEAST, below),
                ("v*(1 - eps)", _of_loss, "y", near, _LEAST, 0.5),
                ("v*(1 - eps)", _of_loss, "u", far, above, one),
            )
            for name, given, variable, branch, low, high in parts:
                kernel, result, none = f"inverse {accuracy}", branch.results["v_star"], Fraction(0)
                part = ExportedFunction(
                    kernel, name, form, branch.program, result, numbers, given, low, high, none, roots=True
                )
                yield _bounded(part, size, variable, partial(_inverse_at, given, variable))


def _inverse_at(given: Given, variable: str, x: arb, form: Format) -> tuple[dict[str, rounding.Rounded], arb, arb]:
    """Return y or u; rounded are the quotient and what is given (eps or 1 - eps), and the exponent 0.1."""
    portions = given(x)
    ratio = portions["loss"] / portions["epsilon"]
    ratio = ratio if variable == "y" else 1 / ratio
    exponent = abs(Fraction(form.nearest(WHOLE_FORM.root)) - WHOLE_FORM.root)
    of_ratio = 2 * _log_error(arb(2) ** -form.precision) * ball_of(WHOLE_FORM.root)
    return {}, ratio.root(10), of_ratio + _of_root(form) + ball_of(exponent) * abs(ratio.log())


def _of_epsilon(x: Any) -> dict[str, Any]:
    return {"epsilon": x, "loss": 1 - x}


def _of_loss(x: Any) -> dict[str, Any]:
    return {"epsilon": 1 - x, "loss": x}


def of_compact(accuracies: Sequence[str] = tuple(HALF_LINE)) -> Iterator[ExportedFunction]:
    """Yield the functions of a speed without tables, that of CUDA (host), Fortran, Julia, Rust and JavaScript."""
    for accuracy in accuracies:
        for form in formats(accuracy):
            powers, a, b = half_line_numbers(accuracy, form)
            machine = table_free.LIBRARY[form.name]
            bounds = table_free.rounding_bounds(powers, a, b, machine)
            beta = form.nearest(Fraction(str(BETA)))
            program, results, numbers = compact_parts(accuracy, form)
            exactly = {table_free.THIRTIETH: Fraction(1, table_free.ROOT)}
            for name, result in results.items():
                # Where w and beta^5 are normal, w is not cut off, and rebound does not overflow.
                ends = 2.0 ** (10 - form.largest), 2.0 ** (table_free.LARGEST[form.name] - 2)
                given, size = numbers | {"beta": beta}, Fraction(bounds[name].everywhere)
                found = ExportedFunction(
                    f"compact {accuracy}", name, form, program, result, given, _speed, *ends, size, roots=True
                )
                yield replace(found, exactly=exactly)


def compact_parts(accuracy: str, form: Format) -> tuple[Program, Mapping[str, Expression], dict[str, float]]:
    """Return the program of a compact kernel from speed and beta, its results, and the constants."""
    powers, a, b = half_line_numbers(accuracy, form)
    kernel = table_free.table_free_program(powers)
    program = (*formulas.w_program(), *kernel.common, kernel.inverse)
    return program, kernel.results, table_free.numbers(powers, a, b, form)


def _speed(x: Any) -> dict[str, Any]:
    return {"speed": x}


# --- tables over the bits of the speed --------------------------------------------------------------------------------


def of_tables(tiers: Sequence[str], rows: int) -> Iterator[ExportedFunction]:
    """Yield eps and 1 - eps^2 on some rows of the tables of speed, as functions of the mantissa m of w = v*^10.

    The bound of what rounding does is that of the row, for an exact w.
    """
    for tier in tiers:
        table = speed_kernel.TABLES[tier, names.FAST]
        inside = range(table.switch % 7, table.size, table.size // rows)
        chosen = sorted({*inside, table.switch - 1, table.switch})  # the last with base 1, the first with base 0
        for form in (DOUBLE, FLOAT) if table.form == FLOAT else (DOUBLE,):
            for index in chosen:
                yield from _of_row(tier, table, form, index)


def _of_row(tier: str, table: Table, form: Format, index: int) -> Iterator[ExportedFunction]:
    base, (_, low, high) = table.base(index), table.interval(index)
    bound = table.bounds(index)
    # |dp| <= rounding min(eps, 1 - eps), and the smaller one is |p|, but for the formula's error.
    size, unit = dict(bound.rounding)[form.name] * (1 + bound.error), Fraction(1, 2**form.precision)
    numbers = {f"c{n}": c for n, c in enumerate(table.rows[index])} | {"base": float(base), REST: float(1 - base)}
    row = table.sums(table.names)
    ends = float(low), float(form.nearest(high * (1 - 2 * unit)))
    for name, relative in (("restitution", size + unit), ("dissipation", size + 6 * unit)):
        label, result = f"{name}, row {index}", row.results[name]
        yield ExportedFunction(f"table {tier}", label, form, row.program, result, numbers, _mantissa, *ends, relative)


def _mantissa(x: Any) -> dict[str, Any]:
    return {"m": x}


# --- full accuracy ----------------------------------------------------------------------------------------------------


@dataclass(frozen=True)
class FullFunction:
    """A function of full accuracy, whose error is bounded in units in the last place (ulp) of the true value.

    Attributes
    ----------
    kernel, name : str
    form : Format
    low, high : float
        Where v*, or w = v*^10, is looked for.
    ulp : Fraction
        The proven bound.
    power : int
        10 if the argument is w.
    """

    kernel: str
    name: str
    form: Format
    low: float
    high: float
    ulp: Fraction
    power: int = 1

    roots = False

    def computed(self, x: Array, steps: Array | int = 0, contracted: bool = False) -> Array:
        """Return what the code returns without fused multiplications; there is no root to be moved by steps."""
        if self.power > 1:
            return restitution(x, np.ones_like(x))
        return np.asarray(last_place.evaluated_in(self.form, self.name, x))

    def exact(self, x: float) -> arb:
        """Enclose the true function by the polynomials of `panel_proof`; to be called within `balls.working`."""
        return true_value(self.name, arb(x) if self.power == 1 else arb(x).root(self.power))

    def allowed(self, exact: float) -> float:
        """Return the proven bound of the error, as a number, where the value is nearly `exact`."""
        return float(self.ulp) * unit_of(exact, self.form)


def unit_of(number: float, form: Format) -> float:
    """Return the unit in the last place of a number, which is none of the subnormal ones."""
    return 2.0 ** (math.frexp(number)[1] - form.precision)


def true_value(name: str, v_star: arb) -> arb:
    """Enclose eps or 1 - eps."""
    portions = truth.enclosed(v_star)
    return portions.epsilon if name == "epsilon" else portions.loss


def of_full(which: Sequence[tuple[Format, str]]) -> Iterator[FullFunction]:
    """Yield functions of full accuracy of v*."""
    for form, name in which:
        yield FullFunction("full", name, form, 2.0**-20, 2.0**19, last_place.largest_ulp(form, name))


def of_full_speed() -> FullFunction:
    """Return eps of the table of full accuracy, as a function of w = speed with beta = 1, which is exact."""
    table = LastPlaceTable()
    ends = 2.0**table.first, 2.0**60
    return FullFunction("table full", "epsilon", DOUBLE, *ends, table.proven.ulp, 10)
