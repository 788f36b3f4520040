"""Rounding bounds of kernels: their programs (`formulas`), run with `rounding.Rounded` all over the domain.

What is assumed of sqrt, cbrt and pow is in `arithmetic.Arithmetic`. The error of y = x^root goes into the bound by the
enclosed slope of the result.
"""

from __future__ import annotations

from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
from dataclasses import replace
from fractions import Fraction
from functools import cache
from heapq import heapify, heappop, heappush
from itertools import pairwise
from typing import TypeVar

from flint import arb

from viscopade.arithmetic.balls import ball_of, exact_middle, interval_ball, working
from viscopade.arithmetic.formats import Format
from viscopade.kernels import formulas
from viscopade.kernels.arithmetic import HOST, Arithmetic
from viscopade.kernels.expressions import CodeBranch, Reading, read
from viscopade.kernels.rounding import Rounded, rounded_reading, rounded_results

BITS = 128
PARTS = 32  # of the values of y, at first
MOST_PARTS = 4096
DIGITS = 2  # of printed bounds
_NEARLY = Fraction(1, 64)  # by which a bound for all may exceed the largest found for a single argument
_NARROWEST = Fraction(1, 2**64)  # width of a part over its end: where there is no bound then, there is none
_NEAR = Fraction(1, 2**8)
_STEP = Fraction(5, 4)  # (1 + 1/9)^5 < 2: powers of a ball of this width do not contain 0

Values = tuple[float, ...]
Part = tuple[Fraction, Fraction]
RoundedResults = Mapping[str, Rounded]
Result = TypeVar("Result")


class _Decimal(Rounded):
    """A literal: its number of the type, and what its decimal says."""

    def __init__(self, text: str, kind: Format) -> None:
        self.exact = Fraction(text)
        self.nearest = Fraction(kind.nearest(self.exact))
        super().__init__(ball_of(self.nearest), kind)


def powers_error(
    branch: CodeBranch,
    result: str,
    machine: Arithmetic,
    errors: Mapping[str, arb | int],
    log: arb | None = None,
    exponent: Fraction | None = None,
) -> arb:
    """Bound the relative error of a product or quotient of powers and roots, all of whose results are normal numbers.

    To be used within `balls.working`.

    Parameters
    ----------
    branch : CodeBranch
    result : str
        Its name in the branch.
    machine : Arithmetic
    errors : mapping of str to arb or int
        The relative errors of the branch's inputs by name.
    log : arb or None
        A bound of |ln x| for the x that is given to pow; None for every positive number of the type.
    exponent : Fraction or None
        The exponent that pow is meant to have, which its literal is near to; None: it is what the literal says.
    """
    normal, form, ulp = arb(1).union(arb(2)), machine.form, ball_of(machine.ulp)

    def power(base: Rounded, written: _Decimal) -> Rounded:
        meant = written.exact if exponent is None else exponent
        of_base = log_error(base.relative) * ball_of(abs(written.nearest))
        return Rounded(normal, form, (of_base + _of_pow(meant, written.nearest, machine, log)).exp() - 1)

    def sqrt(number: Rounded) -> Rounded:
        return Rounded(normal, form, 1 - (1 - number.relative).sqrt()).with_error(ball_of(machine.root) * ulp)

    def cbrt(number: Rounded) -> Rounded:
        return Rounded(normal, form, 1 - (1 - number.relative).root(3)).with_error(ball_of(machine.functions) * ulp)

    given = {name: Rounded(normal, form, error) for name, error in errors.items()}

    def refused(*_: Rounded) -> Rounded:
        raise ValueError("expected products and quotients: a sum has other errors")

    by = machine_reading(machine, pow=power, sqrt=sqrt, cbrt=cbrt)
    operations = {**by.operations, **dict.fromkeys("+-", refused)}
    by = replace(by, literal=lambda text: _Decimal(text, form), operations=operations)
    found: Rounded = read(branch, [result], given, by)[result]
    return found.relative


def machine_reading(machine: Arithmetic, **functions: Callable[..., Rounded]) -> Reading:
    """Return how programs are read with rounded numbers of a machine, whose quotients may be off by more than half."""

    def divided(top: Rounded, bottom: Rounded) -> Rounded:
        return top.exact_quotient(bottom).with_error(ball_of(machine.quotient * machine.ulp))

    by = rounded_reading(machine.form, divide=divided, **functions)
    return by if machine.quotient == HOST.quotient else replace(by, operations={"/": divided})


@cache
def rounding_of_w(form: Format) -> Fraction:
    """Return a bound of the relative error of w = beta^5 speed, where all products as computed are normal numbers."""
    with working(BITS):
        normal = Rounded(arb(1).union(arb(2)), form)
        w = rounded_results(CodeBranch(None, formulas.w_program(), {}), ["w"], {"beta": normal, "speed": normal}, form)[
            "w"
        ]
        return exact_middle(w.relative)


def log_error(relative: arb) -> arb:
    """Bound the error of the logarithm of a number with this relative error."""
    return -(1 - relative).log()


def _of_pow(meant: Fraction, given: Fraction, machine: Arithmetic, log: arb | None = None) -> arb:
    """Bound the error of ln pow(x, given) as that of x^meant, for x > 0 or |ln x| <= log."""
    form = machine.form
    log = (form.largest + form.precision) * arb.const_log2() if log is None else log
    of_exponent = ball_of(abs(given - meant)) * log
    return (log_error(ball_of(machine.power) * ball_of(machine.ulp)) + of_exponent).abs_upper()


def results_on_parts(
    branch: CodeBranch,
    results: Sequence[str],
    variable: str,
    coefficients: Mapping[str, Fraction | float],
    machine: Arithmetic,
    inputs: Callable[[arb], dict[str, Rounded]] = lambda _: {},
    log_error: Callable[[arb], arb] = lambda _: arb(0),
) -> Callable[[Part], RoundedResults]:
    """Return a function from a part of the values of a variable to the results of a branch there.

    It is to be used within `balls.working`, and raises an ArithmeticError where a sum may vanish.

    Parameters
    ----------
    branch : CodeBranch
    results : sequence of str
    variable : str
        Its name, such as that of a root; the slopes are those in ln of the variable.
    coefficients : mapping
        Exact numbers by name. What is no number of the type is rounded to the nearest one, which counts.
    machine : Arithmetic
    inputs : callable
        Gives the other inputs of the branch, from the variable.
    log_error : callable
        Bounds the error of the variable's logarithm, from the variable.
    """
    form, by = machine.form, machine_reading(machine)
    numbers = {name: _coefficient(Fraction(c), form) for name, c in coefficients.items()}

    @cache
    def on(part: Part) -> RoundedResults:
        exact = interval_ball(*part)
        error = log_error(exact)
        y = exact * arb(0, error).exp()  # with all that are computed for it
        found = read(branch, results, {**numbers, **inputs(y), variable: Rounded(y, form, slope=1)}, by)
        return {name: number.with_error_of_y(error) for name, number in found.items()}

    return on


def _coefficient(exact: Fraction, form: Format) -> Rounded:
    """Return a number that is rounded to the nearest one of a type."""
    return Rounded(ball_of(exact), form, ball_of(abs(Fraction(form.nearest(exact)) / exact - 1)))


def relative_error(name: str, least: arb | int = 0) -> Callable[[RoundedResults], arb]:
    """Return the bound of the relative error of a result whose value is at least `least`, for `largest_bound`."""

    def bound(found: RoundedResults) -> arb:
        number = found[name]
        return (number.relative + number.underflow / number.value.abs_lower().max(arb(least))).abs_upper()

    return bound


def largest_bound(on: Callable[[Part], Result], parts: Iterable[Part], bound: Callable[[Result], arb]) -> arb:
    """Return a bound over all parts; arguments and errors as for `refined_bounds`."""
    return max(size for size, _ in refined_bounds(on, parts, bound))


def refined_bounds(
    on: Callable[[Part], Result], parts: Iterable[Part], bound: Callable[[Result], arb]
) -> list[tuple[arb, Part]]:
    """Return parts with their bounds: the part with the largest bound is halved while that lowers it noticeably.

    On wide parts enclosures are far too wide, above all enclosures of slopes.

    Parameters
    ----------
    on : callable
        From the ends of a part to what is known there. An ArithmeticError says that the part is too wide.
    parts : iterable of (Fraction, Fraction)
    bound : callable
        From what is known to an upper bound.

    Raises
    ------
    ArithmeticError
        If there is no bound on some part, however narrow.
    """

    def known(part: Part) -> arb:
        try:
            size = bound(on(part))
        except ArithmeticError:
            return arb.pos_inf()
        return size if size.is_finite() else arb.pos_inf()

    # A heap, the largest bound first; the part tells bounds apart that are the same double.
    heap, reached = [(-float(size), part, size) for part in parts for size in [known(part)]], arb(0)
    heapify(heap)
    while True:
        _, (low, high), worst = heap[0]
        middle = (low + high) / 2
        alone = known((middle, middle))
        reached = max(reached, alone) if alone.is_finite() else reached
        tight = worst <= reached * (1 + ball_of(_NEARLY))
        if tight or len(heap) >= MOST_PARTS or high - low < high * _NARROWEST:
            break
        heappop(heap)
        for half in ((low, middle), (middle, high)):
            size = known(half)
            heappush(heap, (-float(size), half, size))
    if not worst.is_finite():
        on((low, high))
        raise ArithmeticError(f"there is no bound from {float(low):g} to {float(high):g}")
    return [(size, part) for _, part, size in heap]


def parts_to(end: Fraction) -> Iterator[Part]:
    """Yield the parts of [0, end], of which those beyond 1 are the longer the farther they are."""
    last = end / (1 + end)
    marks = [last * i / PARTS for i in range(PARTS + 1)]
    for low, high in pairwise(marks):
        yield low / (1 - low), high / (1 - high)


def parts_from(start: Fraction, end: Fraction) -> Iterator[Part]:
    """Yield the parts of [start, end]: narrow ones below `_NEAR`, so that powers of y are not 0; then `parts_to`."""
    while 0 < start < min(_NEAR, end):
        yield start, min(start * _STEP, end)
        start *= _STEP
    yield from ((max(low, start), high) for low, high in parts_to(end) if high > start)


def power_of_two_below_root(number: Fraction, root: Fraction) -> Fraction:
    """Return a power of 2 that is at most the root of a power of 2."""
    exponent = number.denominator.bit_length() - 1
    return Fraction(1, 2 ** -(-exponent * root.numerator // root.denominator))
