r"""Kernels from speed to eps without tables: a root by log2 and exp2, then a lacunary quotient; for GPUs and shaders.

With w = beta^5 v = v*^10, y = v*^(1/3) = w^(1/30) = exp2(log2(w)/30), and N, D of `half_line`:

    elastic = D(y),    lost = v*^2 N(y) = y^6 N(y),    eps = elastic/(elastic + lost),
    1 - eps^2 = (1 - eps)(1 + eps),    1 - eps = lost/(elastic + lost),

the last without cancellation. There are no branches: w is cut off at 2^120 in type float, 2^900 in type double, where
no power of y overflows, and eps is below 2e-12 and 2e-90.

A `MachineArithmetic` says what is assumed. An error delta of ln y changes ln eps by d ln eps/d ln y times delta, which
`rounding.Rounded` encloses. As ln y = ln(w)/30, errors of log2(w) are divided by 30: even a log2 that is good to an
absolute 2^-21 only, as shaders have it near w = 1, costs 1e-8.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator, Mapping
from dataclasses import dataclass
from fractions import Fraction
from functools import cache
from itertools import product
from operator import itemgetter
from typing import NamedTuple

from flint import arb, fmpq_poly

from viscopade.approximation.half_line import DEGREES_MORE, SHIFT, require_half_line_degrees
from viscopade.approximation.lacunary import Powers
from viscopade.arithmetic.balls import ball_of, working
from viscopade.arithmetic.decimals import at_most, rounded_up
from viscopade.arithmetic.formats import DOUBLE, FLOAT, Format
from viscopade.kernels.enclosure import exactly
from viscopade.kernels.expressions import (
    Call,
    CodeBranch,
    Expression,
    Literal,
    Name,
    Program,
    Reading,
    Run,
    Statement,
    by_powers,
    evaluate,
    gaps,
    powers,
    read,
)
from viscopade.kernels.formulas import constants, half_line_branches, named, w_program
from viscopade.kernels.rounding import Rounded, arithmetic
from viscopade.kernels.rounding_bounds import BITS, DIGITS, ULPS, Part, Values, largest, rounding_of_w
from viscopade.store import recorded

ROOT = 30  # y = w^(1/ROOT)
THIRTIETH = "thirtieth"
FUNCTIONS = ("restitution", "rebound", "dissipation")
LARGEST = {DOUBLE.name: 900, FLOAT.name: 120}
"""w is cut off at 2 to this power."""

COMMON = (Fraction(1, 1000), Fraction(10))
"""The v* for which bounds of type float are given, too, besides those for all: they are smaller there."""

_COMMON_Y = (Fraction(1, 10), Fraction(2155, 1000))  # cube roots of `COMMON`, rounded outwards
_TINY = Fraction(1, 2**40)
_WIDER = Fraction(1, 2**16)  # more than what balls add to an interval of y
_PARTS = 4, 32  # of an octave of y below 1 and beyond, at first: there powers of y vary more, and outweigh the rest

Division = Callable[[Expression, Expression], Expression]


def plain(top: Expression, bottom: Expression) -> Expression:
    """Return top/bottom, written with the language's operator."""
    return top / bottom


def called(top: Expression, bottom: Expression) -> Expression:
    """Return top/bottom, written as a call of a function `divide`."""
    return Call("divide", (top, bottom))


@dataclass(frozen=True)
class MachineArithmetic:
    """Assumptions on a machine's arithmetic; errors are in units in the last place (ulp) of the result.

    Attributes
    ----------
    type : Format
        The type of all numbers.
    model : Format
        One in which rounding to nearest is at least as bad as the machine's rounding and underflow.
    log2, exp2, quotient : Fraction
        Largest errors of these operations.
    log2_absolute : Fraction
        An absolute error of log2, besides.
    exp2_slope : Fraction
        exp2(x) may be off by another exp2_slope |x|.
    """

    type: Format
    model: Format
    log2: Fraction
    exp2: Fraction
    quotient: Fraction
    log2_absolute: Fraction = Fraction(0)
    exp2_slope: Fraction = Fraction(0)

    @property
    def ulp(self) -> Fraction:
        """The largest size of a unit in the last place, relative to the number."""
        return Fraction(2) ** (1 - self.type.precision)


def _library(form: Format) -> MachineArithmetic:
    """Return IEEE arithmetic with the usual library of functions."""
    return MachineArithmetic(form, form, Fraction(ULPS), Fraction(ULPS), Fraction(1, 2))


LIBRARY = {form.name: _library(form) for form in (DOUBLE, FLOAT)}
"""log2 and exp2, or log and exp, within 4 units in the last place, and arithmetic of IEEE 754."""

# The programming guide counts from the correctly rounded result, which adds half an ulp: 2 ulp, or 2^-22 in [1/2, 2].
_DEVICE_ULPS = Fraction(5, 2)
DEVICE = MachineArithmetic(
    FLOAT, FLOAT, _DEVICE_ULPS, _DEVICE_ULPS, _DEVICE_ULPS, log2_absolute=Fraction(1, 2**22) + Fraction(1, 2**25)
)
"""CUDA's __log2f, exp2f and __fdividef: the errors of the programming guide, and arithmetic of IEEE 754."""

# Sums and products are one of the two neighbours, that is rounded to nearest with a bit less; and results below
# 2^-126 may be replaced by 0, as if they were rounded to multiples of 2^-125.
_SHADER_MODEL = Format("shader", "", FLOAT.precision - 1, 104, FLOAT.digits)
SHADER = MachineArithmetic(
    FLOAT, _SHADER_MODEL, Fraction(3), Fraction(3), Fraction(5, 2), Fraction(1, 2**21), exp2_slope=Fraction(2)
)
"""Reading that Vulkan and WGSL guarantee."""


class TableFreeKernel(NamedTuple):
    """A table-free kernel as a straight-line program.

    Attributes
    ----------
    common : Program
        From w to elastic and lost.
    inverse : Statement
        What dissipation needs, besides.
    results : dict
        Expressions by the name of the function; rebound also needs the speed.
    """

    common: Program
    inverse: Statement
    results: dict[str, Expression]


class RoundingBound(NamedTuple):
    """Proven bounds of a function's rounding error, relative to the formula's value.

    Attributes
    ----------
    everywhere : str
        For all w from the type's smallest normal number to the cut-off.
    common : str
        For v* in `COMMON`.
    """

    everywhere: str
    common: str


def table_free_program(
    form: Powers, quotient: Division = plain, log: str = "log2", exp: str = "exp2", larger: str = ""
) -> TableFreeKernel:
    """Return the program with given powers of y; `log` and `exp` share any one base.

    Where there may be no logarithm of 0, `larger` is the function that gives the larger of w and `least`.

    Raises
    ------
    ValueError
        If the powers are not those of a kernel for all v* >= 0.
    """
    require_half_line_degrees(form)
    elastic, lost, inverse, one = Name("elastic"), Name("lost"), Name("inverse"), Literal("1.0")
    top, bottom = by_powers("y", named("a", form.top)), by_powers("y", named("b", form.bottom))
    w = Call(larger, (Name("w"), Name("least"))) if larger else Name("w")
    common = (
        Statement("y", Call(exp, (Call(log, (w,)) * Name(THIRTIETH),))),
        *powers("y", gaps(form.top) | gaps(form.bottom) | {SHIFT}),
        Statement("elastic", bottom),
        Statement("lost", Name(f"y{SHIFT}") * top),
    )
    restitution = quotient(elastic, elastic + lost)
    results = {
        "restitution": restitution,
        "rebound": restitution * Name("speed"),
        "dissipation": lost * inverse * (one + elastic * inverse),
    }
    return TableFreeKernel(common, Statement("inverse", quotient(one, elastic + lost)), results)


def numbers(form: Powers, a: Values, b: Values, kind: Format) -> dict[str, float]:
    """Return the program's constants by name."""
    return {THIRTIETH: kind.nearest(Fraction(1, ROOT)), **constants(form, a, b)}


def check_formula(form: Powers, a: Values, b: Values) -> None:
    """Check that a program without rounding is the formula whose error is proven, and gives eps speed and 1 - eps^2.

    Both have polynomials in y for elastic and lost. The results are quotients of polynomials of degree 4 at most in
    elastic and lost, so that they are the same functions if they agree on a grid of more than 5 by 5 points.

    Raises
    ------
    ArithmeticError
        If it is not.
    """
    program, (proven, _) = table_free_program(form), half_line_branches(form)
    y, coefficients = fmpq_poly([0, 1]), constants(form, a, b)
    given = {"y": y, "v_star": y**3}
    for name in ("elastic", "lost"):
        own = exactly(CodeBranch(None, program.common, {}), name, given, coefficients)
        if own != exactly(proven, name, given, coefficients):
            raise ArithmeticError(f"{name} of the program is not that of the proven formula")
    by = Reading(Fraction)
    for speed, beta in product((Fraction(3), Fraction(5)), repeat=2):
        if Run(w_program(), {"speed": speed, "beta": beta}, by)["w"] != beta**5 * speed:
            raise ArithmeticError("w of the program is not beta^5 speed")
    grid = [Fraction(n) for n in range(1, 7)]
    for elastic, lost, speed in product(grid, grid, (Fraction(3), Fraction(5))):
        run = Run((program.inverse,), {"elastic": elastic, "lost": lost, "speed": speed}, by)
        eps = evaluate(proven.results["epsilon"], run, by)
        for name, value in zip(FUNCTIONS, (eps, eps * speed, 1 - eps**2), strict=True):
            if evaluate(program.results[name], run, by) != value:
                raise ArithmeticError(f"{name} of the program is not that of the proven formula")


# --- bounds of rounding errors ----------------------------------------------------------------------------------------


@recorded("table_free_rounding")
def rounding_bounds(form: Powers, a: Values, b: Values, machine: MachineArithmetic) -> dict[str, RoundingBound]:
    """Bound each function's rounding error where beta^2, beta^4, beta^5, w as computed are normal, w up to the cut.

    That of rebound holds where it is a normal number.

    Raises
    ------
    ArithmeticError
        If a sum may vanish, or a power overflow.
    """
    check_formula(form, a, b)
    with working(BITS):
        _check_overflow(form, a, b, machine.type)

        @cache
        def on(part: Part) -> Mapping[str, arb]:
            return _on_part(form, a, b, machine, *part)

        everywhere, common = (tuple(_parts(machine.type, *ends)) for ends in (_ends(machine.type), _COMMON_Y))
        worst = {name: [largest(on, parts, itemgetter(name)) for parts in (everywhere, common)] for name in FUNCTIONS}
        return {
            name: RoundingBound(*(at_most(rounded_up(size, DIGITS)) for size in sizes)) for name, sizes in worst.items()
        }


def _on_part(
    form: Powers, a: Values, b: Values, machine: MachineArithmetic, low: Fraction, high: Fraction
) -> Mapping[str, arb]:
    """Return bounds of the relative errors for y from low to high."""
    error = _error_of_y(form, machine, low, high)
    y = ball_of(low).union(ball_of(high)) * (arb(0) + _plus_minus(error)).exp()
    model = machine.model
    given = {name: Rounded(arb(c), model) for name, c in constants(form, a, b).items()}
    # The speed is exact, and the slope of rebound that at constant speed.
    given |= {"y": Rounded(y, model, slope=1), "speed": Rounded(arb(1), model)}

    def divide(top: Rounded, bottom: Rounded) -> Rounded:
        return top.over(bottom).with_error(ball_of(machine.quotient * machine.ulp))

    program = table_free_program(form, called)
    rounded = arithmetic(model, divide=divide)
    values = Run((*program.common, program.inverse), given, rounded)
    found = {
        name: evaluate(expression, values, rounded).with_error_of_y(error)
        for name, expression in program.results.items()
    }
    return {name: arb((x.relative + x.underflow / arb(x.value.abs_lower())).abs_upper()) for name, x in found.items()}


def _error_of_y(form: Powers, machine: MachineArithmetic, low: Fraction, high: Fraction) -> arb:
    """Bound the error of ln y for y from low to high, that of w included.

    Raises
    ------
    ArithmeticError
        If the program's y is not w^(1/ROOT).
    """
    # The library's logarithms may have either base.
    bases = [arb.const_log2(), *([arb(1)] if machine == LIBRARY[machine.type.name] else [])]
    common = CodeBranch(None, table_free_program(form).common, {})
    return max(_error_in_base(ln_base, common, machine, low, high) for ln_base in bases)


def _error_in_base(ln_base: arb, common: CodeBranch, machine: MachineArithmetic, low: Fraction, high: Fraction) -> arb:
    ulp, model = ball_of(machine.ulp), machine.model
    ends = ball_of(low), ball_of(high)

    def log(w: Rounded) -> Rounded:  # of w = y^ROOT, a wide ball of which might contain 0
        value, of_w = ends[0].log().union(ends[1].log()) * ROOT / ln_base, -(1 - w.relative).log() / ln_base
        size = arb(value.abs_upper()) + of_w
        of_call = size * ball_of(machine.log2) * ulp + ball_of(machine.log2_absolute)
        return Rounded(value, model).with_absolute_error(of_call + of_w)

    def exp(x: Rounded) -> Rounded:
        size = arb(x.value.abs_upper()) + x.absolute
        of_call = ulp * (ball_of(machine.exp2) + ball_of(machine.exp2_slope) * size)
        return Rounded((x.value * ln_base).exp(), model, (x.absolute * ln_base).exp() - 1).with_error(of_call)

    thirtieth = Fraction(1, ROOT)
    of_constant = abs(Fraction(machine.type.nearest(thirtieth)) / thirtieth - 1)
    given = {
        "w": Rounded(arb(1), model, ball_of(rounding_of_w(model))),
        THIRTIETH: Rounded(ball_of(thirtieth), model, ball_of(of_constant)),
    }
    y: Rounded = read(common, ["y"], given, arithmetic(model, log2=log, exp2=exp))["y"]
    reached = all(y.value.overlaps(end) for end in ends)
    if not (reached and ends[0] * (1 - ball_of(_WIDER)) < y.value < ends[1] * (1 + ball_of(_WIDER))):
        raise ArithmeticError("y of the program is not the root of w")
    return arb((-(1 - y.relative).log()).abs_upper())


def _plus_minus(radius: arb) -> arb:
    return arb(0, radius)


def _ends(form: Format) -> Part:
    """Return the y of the smallest normal w and of the largest, rounded outwards."""
    low, high = (Fraction(2.0 ** (e / ROOT)) for e in (1 - form.largest, LARGEST[form.name]))
    return low * (1 - _TINY), high * (1 + _TINY)


def _parts(form: Format, first: Fraction, last: Fraction) -> Iterator[Part]:
    """Yield parts of octaves, from one y to another."""
    for octave in range((1 - form.largest) // ROOT, -(-LARGEST[form.name] // ROOT) + 1):
        start, number = Fraction(2) ** octave, _PARTS[octave >= 0]
        for i in range(number):
            low, high = (start * (1 + Fraction(k, number)) for k in (i, i + 1))
            if low < last and high > first:
                yield max(low, first), min(high, last)


def _check_overflow(form: Powers, a: Values, b: Values, kind: Format) -> None:
    """Raise an ArithmeticError if a power or a sum may overflow at the cut-off; sums are largest there."""
    y = Fraction(2) ** (-(-LARGEST[kind.name] // ROOT))
    degree = SHIFT + form.bottom[-1] + DEGREES_MORE
    if y**degree * sum(abs(Fraction(c)) for c in (*a, *b)) * 2 >= Fraction(2) ** kind.largest:
        raise ArithmeticError(f"powers up to y^{degree} may overflow in type {kind.name}")
