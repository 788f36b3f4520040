"""Rounding bounds of kernels: their programs (`formulas`), run with `rounding.Rounded` all over the domain.

A `Rounded` number has an enclosure of its exact `value`, bounds `relative`, `underflow` and `absolute` of its error,

    computed = exact (1 + theta) + alpha,    |theta| <= relative,    |alpha| <= underflow,

and a `slope`, d ln|value|/d ln y. What is assumed of sqrt, cbrt and pow is in `arithmetic.Arithmetic`. The error of
y = x^root goes into the bound by the enclosed slope of the result.
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
"""Bits of the middles of balls: from 96 on no bound changes in nine digits; with 64 it is up to 0.4 % off (measured for
[3/6] and the fit to 1e-8, v* <= 5)."""
PARTS = 32
"""Parts of the values of y at first. From 8 to 128 bounds change by less than `_NEARLY` (measured): halving decides."""
MOST_PARTS = 4096
"""Where halving ends without a tight bound. Bounds of kernels need 30 to 1,500 parts (measured); more says that a sum
may vanish."""
DIGITS = 2
"""Significant digits of printed bounds: rounding up to two digits widens a bound by at most 10 %."""
# By which a bound for all may exceed the largest found for a single argument: 1.6 %, less than DIGITS cost. With 1/4
# the bound of [3/6] is 10 % larger, with 1/256 0.1 % smaller (measured).
_NEARLY = Fraction(1, 64)
# Width of a part over its end. Neighbouring doubles are 2^-53 apart or more, so that a part of this width has at most
# one of them: where there is no bound then, there is none.
_NARROWEST = Fraction(1, 2**64)
# Below it parts grow by `_STEP`; above, the parts of `parts_to` begin, whose first one ends at 1/63 for y <= 1. Both
# were chosen by hand; what is too wide in between is halved.
_NEAR = Fraction(1, 2**8)
# The ball of [s, 5/4 s] is 9/8 s (1 ± 1/9), and the radius of its fifth power (1 + 1/9)^5 - 1 = 0.69 of the middle:
# below 1, so that the y^5 of inverse kernels is not 0 in the ball. The seventh power contains 0.
_STEP = Fraction(5, 4)

Values = tuple[float, ...]
"""Coefficients of a polynomial."""
Part = tuple[Fraction, Fraction]
"""Ends of an interval of y, the variable of a program."""
RoundedResults = Mapping[str, Rounded]
"""Results of a program by name."""
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
        The program, with the expressions of its results.
    result : str
        Its name in the branch.
    machine : Arithmetic
        What is assumed of operations, and of sqrt, cbrt and pow (`root`, `functions`, `power`, in ulp).
    errors : mapping of str to arb or int
        The relative errors of the branch's inputs by name.
    log : arb or None
        A bound of |ln x| for the x that is given to pow; None for every positive number of the type.
    exponent : Fraction or None
        The exponent that pow is meant to have, which its literal is near to; None: it is what the literal says.
    """
    # A relative error does not depend on the size of a normal number: [1, 2] stands for all of them.
    normal, form, ulp = arb(1).union(arb(2)), machine.form, ball_of(machine.ulp)
    # All positive numbers of the type lie between 2^-(largest + precision) and 2^(largest + 1).
    log_of_base = (form.largest + form.precision) * arb.const_log2() if log is None else log

    def power(base: Rounded, literal: _Decimal) -> Rounded:
        """Bound the error of ln pow(x, p): |p| times that of ln x, that of pow, and |p - meant| |ln x|."""
        meant = literal.exact if exponent is None else exponent
        from_base = log_error(base.relative) * ball_of(abs(literal.nearest))
        from_pow = log_error(ball_of(machine.power) * ball_of(machine.ulp))
        from_exponent = ball_of(abs(literal.nearest - meant)) * log_of_base
        return Rounded(normal, form, (from_base + (from_pow + from_exponent).abs_upper()).exp() - 1)

    # Of the two errors (1 ± r)^(1/k) - 1 of a root that of 1 - r is the larger one, for k = 2 and k = 3.
    def sqrt(number: Rounded) -> Rounded:
        return Rounded(normal, form, 1 - (1 - number.relative).sqrt()).with_error(ball_of(machine.root) * ulp)

    def cbrt(number: Rounded) -> Rounded:
        return Rounded(normal, form, 1 - (1 - number.relative).root(3)).with_error(ball_of(machine.functions) * ulp)

    def refuse(*_: Rounded) -> Rounded:
        raise ValueError("expected products and quotients: a sum has other errors")

    # A literal keeps its decimal, as pow(x, 0.1) is meant to be the tenth root, and 0.1 is no binary number.
    reading = machine_reading(machine, pow=power, sqrt=sqrt, cbrt=cbrt)
    operations = {**reading.operations, **dict.fromkeys("+-", refuse)}
    reading = replace(reading, literal=lambda text: _Decimal(text, form), operations=operations)
    inputs = {name: Rounded(normal, form, error) for name, error in errors.items()}
    number: Rounded = read(branch, [result], inputs, reading)[result]
    return number.relative


def machine_reading(machine: Arithmetic, **functions: Callable[..., Rounded]) -> Reading:
    """Return how programs are read with rounded numbers of a machine.

    `functions` are those that the programs call, by name, on `Rounded` numbers; "divide" is the machine's quotient,
    which may be off by more than half an ulp (CUDA's __fdividef).
    """

    def divide(top: Rounded, bottom: Rounded) -> Rounded:
        return top.exact_quotient(bottom).with_error(ball_of(machine.quotient * machine.ulp))

    reading = rounded_reading(machine.form, divide=divide, **functions)
    # A quotient as good as a host's is rounded to nearest, for which `Rounded` has the smaller bound.
    return reading if machine.quotient == HOST.quotient else replace(reading, operations={"/": divide})


@cache
def rounding_of_w(form: Format) -> Fraction:
    """Return a bound of the relative error of w = beta^5 speed, where all products as computed are normal numbers."""
    with working(BITS):
        # [1, 2] stands for all normal numbers, whose relative errors do not depend on their size.
        normal = Rounded(arb(1).union(arb(2)), form)
        branch = CodeBranch(None, formulas.w_program(), {})
        w = rounded_results(branch, ["w"], {"beta": normal, "speed": normal}, form)["w"]
        return exact_middle(w.relative)


def log_error(relative: arb) -> arb:
    """Bound the error of the logarithm of a number with this relative error."""
    # |ln(1 + theta)| <= -ln(1 - relative) for |theta| <= relative
    return -(1 - relative).log()


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
        The program, with the expressions of its results.
    results : sequence of str
        Names of the wanted results.
    variable : str
        Its name, such as that of a root; the slopes are those in ln of the variable.
    coefficients : mapping
        Exact numbers by name. What is no number of the type is rounded to the nearest one, which counts.
    machine : Arithmetic
        What is assumed of operations.
    inputs : callable
        Gives the other inputs of the branch, from the variable.
    log_error : callable
        Bounds the error of the variable's logarithm, from the variable.
    """
    form, reading = machine.form, machine_reading(machine)
    # The relative error of a coefficient is what rounding it to the type changes: |nearest/exact - 1|.
    numbers = {
        name: Rounded(ball_of(exact), form, ball_of(abs(Fraction(form.nearest(exact)) / exact - 1)))
        for name, exact in ((name, Fraction(c)) for name, c in coefficients.items())
    }

    @cache
    def results_on(part: Part) -> RoundedResults:
        """Return the results on a part of the variable's exact values, with all of their rounding errors."""
        # The program runs with the computed y: the part, widened by the error of ln y, which multiplies y by up to
        # e^(±error). So the bounds of rounding and the slope hold for all that may be computed.
        exact_y = interval_ball(*part)
        error = log_error(exact_y)
        y = exact_y * arb(0, error).exp()
        # slope=1: d ln y/d ln y
        rounded = read(branch, results, {**numbers, **inputs(y), variable: Rounded(y, form, slope=1)}, reading)
        # What the error of y itself changes is the slope times that error.
        return {name: number.with_error_of_y(error) for name, number in rounded.items()}

    return results_on


def relative_error(name: str, least: arb | int = 0) -> Callable[[RoundedResults], arb]:
    """Return the bound of the relative error of a result whose value is at least `least`, for `largest_bound`."""

    def bound(results: RoundedResults) -> arb:
        # |computed/exact - 1| <= relative + underflow/|exact|
        number = results[name]
        return (number.relative + number.underflow / number.value.abs_lower().max(arb(least))).abs_upper()

    return bound


def largest_bound(results_on: Callable[[Part], Result], parts: Iterable[Part], bound: Callable[[Result], arb]) -> arb:
    """Return a bound over all parts; arguments and errors as for `refined_bounds`."""
    return max(size for size, _ in refined_bounds(results_on, parts, bound))


def refined_bounds(
    results_on: Callable[[Part], Result], parts: Iterable[Part], bound: Callable[[Result], arb]
) -> list[tuple[arb, Part]]:
    """Return bounds with their parts: the part with the largest bound is halved while that lowers it noticeably.

    On wide parts enclosures are far too wide, above all enclosures of slopes.

    Parameters
    ----------
    results_on : callable
        From the ends of a part to the program's results there. An ArithmeticError says that the part is too wide.
    parts : iterable of (Fraction, Fraction)
        Ends of the first parts.
    bound : callable
        From these results to an upper bound of an error.

    Raises
    ------
    ArithmeticError
        If there is no bound on some part, however narrow.
    """

    def bound_on(part: Part) -> arb:
        """Return the bound on a part, infinity if the part is too wide for one."""
        try:
            size = bound(results_on(part))
        except ArithmeticError:
            return arb.pos_inf()
        return size if size.is_finite() else arb.pos_inf()

    # A heap of (-bound as a double, part, bound), the largest bound first; the part tells bounds apart that are the
    # same double. `largest_at_a_point` is the largest bound for a single argument: no bound for all can be below it.
    heap = [(-float(size), part, size) for part in parts for size in [bound_on(part)]]
    largest_at_a_point = arb(0)
    heapify(heap)
    while True:
        _, (low, high), worst = heap[0]
        middle = (low + high) / 2
        at_middle = bound_on((middle, middle))
        if at_middle.is_finite():
            largest_at_a_point = max(largest_at_a_point, at_middle)
        # The worst part stays as it is if its bound is nearly that of an argument, or if halving is of no use.
        tight = worst <= largest_at_a_point * (1 + ball_of(_NEARLY))
        if tight or len(heap) >= MOST_PARTS or high - low < high * _NARROWEST:
            break
        heappop(heap)
        for half in ((low, middle), (middle, high)):
            size = bound_on(half)
            heappush(heap, (-float(size), half, size))

    # Without a bound: the results' own error says why; if there is none, the bound itself is infinite.
    if not worst.is_finite():
        results_on((low, high))
        raise ArithmeticError(f"there is no bound from {float(low):g} to {float(high):g}")
    return [(size, part) for _, part, size in heap]


def parts_to(end: Fraction) -> Iterator[Part]:
    """Yield `PARTS` parts of [0, end], of which those beyond 1 are the longer the farther they are."""
    # Equal parts of s = y/(1 + y), which maps [0, infinity) to [0, 1); y = s/(1 - s).
    last = end / (1 + end)
    marks = [last * i / PARTS for i in range(PARTS + 1)]
    for low, high in pairwise(marks):
        yield low / (1 - low), high / (1 - high)


def parts_from(start: Fraction, end: Fraction) -> Iterator[Part]:
    """Yield the parts of [start, end]: narrow ones below `_NEAR`, so that powers of y are not 0; then `parts_to`."""
    # Each part below `_NEAR` is longer than the one before by the factor `_STEP` = 5/4. A quotient in v*, which is 1 at
    # v* = 0, starts at 0 and needs none of these.
    while 0 < start < min(_NEAR, end):
        yield start, min(start * _STEP, end)
        start *= _STEP
    yield from ((max(low, start), high) for low, high in parts_to(end) if high > start)


def power_of_two_below_root(number: Fraction, root: Fraction) -> Fraction:
    """Return a power of 2 that is at most number^root, for a `number` that is 2 to a negative power, and 0 < root."""
    # number = 2^-exponent; -(-a // b) is a/b rounded up, which makes 2^-(…) smaller.
    exponent = number.denominator.bit_length() - 1
    return Fraction(1, 2 ** -(-exponent * root.numerator // root.denominator))
