r"""Straight-line programs of lacunary quotients, as exported code evaluates them, and their rounding bounds.

Half-line kernels (`half_line`), with y = v*^(1/3), w = 1/v*, u = 1/y and mirrored polynomials N^(u) = u^deg N(1/u):

    v* <= 1:    eps = D(y)/(D(y) + v*^2 N(y)),           1 - eps = v*^2 N(y)/(…)
    v* > 1:     eps = w^3 u D^(u)/(w^3 u D^(u) + N^(u)),  1 - eps = N^(u)/(…)

so that no power overflows. Inverse kernels (`inverse`), with y = ((1 - eps)/eps)^root, u = 1/y:

    v* = y^k N(y)/D(y)    and for eps < 1/2, where y has no end:    v* = N^(u)/(u^j D^(u)),    j = k + deg N - deg D.

The roots are taken by sqrt, cbrt and pow of math.h. sqrt rounds correctly by IEEE 754; of the others it is assumed that
they are within `ULPS` units in the last place, of type float as well. (The largest errors that glibc's manual knows of
for cbrt, and for pow, are no larger.) The error of y = x^root goes into the bound by the enclosed slope of the result.
"""

from __future__ import annotations

from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
from fractions import Fraction
from functools import cache, lru_cache
from itertools import pairwise
from typing import Any, NamedTuple, TypeVar

from flint import arb

from viscopade.approximation.inverse import HALF, INTERVAL_ROOT
from viscopade.approximation.lacunary import Powers
from viscopade.arithmetic.balls import ball_of, exact_middle, working
from viscopade.arithmetic.decimals import rounded_up
from viscopade.arithmetic.formats import DOUBLE, Format
from viscopade.kernels.expressions import (
    Call,
    Expression,
    Literal,
    Name,
    Program,
    Rounded,
    Statement,
    evaluate,
    gaps,
    horner_expression,
    power,
    powers,
    run_program,
    smallest_number,
)

ULPS = 4
"""Assumed of cbrt and pow, and of cbrtf and powf: the error in units in the last place of the result."""

BITS = 128
PARTS = 32  # of the values of y, at first
MOST_PARTS = 4096
DIGITS = 2  # of printed bounds
_NEARLY = Fraction(1, 16)  # by which a bound for all may exceed the largest found for a single argument
_SLACK = Fraction(1, 2**16)  # by which a computed y may be beyond its part; its error is far below
_NEAR = Fraction(1, 2**8)
_STEP = Fraction(5, 4)  # (1 + 1/9)^5 < 2: powers of a ball of this width do not contain 0

Values = tuple[float, ...]
Part = tuple[Fraction, Fraction]
Found = Mapping[str, Rounded]
Result = TypeVar("Result")


class CodeBranch(NamedTuple):
    """A branch of the code: a program for a part of the arguments, and the expressions of its results.

    Attributes
    ----------
    variable : str
        The root, "y" or "u", in whose powers polynomials are; the program assigns it once.
    program : Program
    results : dict
        Expressions by name.
    """

    variable: str
    program: Program
    results: dict[str, Expression]


class Size(NamedTuple):
    """A proven rounding bound: relative |exact value| + underflow (the type's smallest number)."""

    relative: str
    underflow: str


# --- programs ---------------------------------------------------------------------------------------------------------


def constants(form: Powers, a: Values, b: Values) -> dict[str, float]:
    """Return the coefficients by their names in programs: a4 is the coefficient of y^4 in N, b4 the one in D."""
    tops = {f"a{k}": c for k, c in zip(form.top, a, strict=True)}
    return tops | {f"b{k}": c for k, c in zip(form.bottom, b, strict=True)}


def half_line(form: Powers) -> tuple[CodeBranch, CodeBranch]:
    """Return the programs for v* <= 1 and v* > 1; the input is v_star, the results epsilon and one_minus_epsilon."""
    v_star, w = Name("v_star"), Name("w")
    top, bottom = _polynomials(form, "y", mirror=False)
    near = (
        Statement("y", Call("cbrt", (v_star,))),
        *powers("y", _needed(form)),
        Statement("elastic", bottom),
        Statement("lost", v_star * v_star * top),
    )
    top, bottom = _polynomials(form, "u", mirror=True)
    far = (
        Statement("w", Literal("1.0") / v_star),
        Statement("u", Call("cbrt", (w,))),
        *powers("u", _needed(form)),
        Statement("elastic", w * w * w * Name("u") * bottom),
        Statement("lost", top),
    )
    elastic, lost = Name("elastic"), Name("lost")
    results = {"epsilon": elastic / (elastic + lost), "one_minus_epsilon": lost / (elastic + lost)}
    return CodeBranch("y", near, results), CodeBranch("u", far, results)


def inverse(form: Powers, root: Fraction) -> tuple[CodeBranch, ...]:
    """Return the program for root 1/2, or for root 1/10 those for eps >= 1/2 and eps < 1/2.

    Inputs are epsilon and loss, which is 1 - epsilon; the result is v_star.
    """
    epsilon, loss = Name("epsilon"), Name("loss")
    shift = int(HALF / root)
    top, bottom = _polynomials(form, "y", mirror=False)
    near = CodeBranch(
        "y",
        (Statement("y", _root(root, loss / epsilon)), *_with_sums(form, "y", shift, top, bottom)),
        {"v_star": power("y", shift) * Name("top") / Name("bottom")},
    )
    if root == INTERVAL_ROOT:
        return (near,)
    rest = shift + form.top[-1] - form.bottom[-1]
    top, bottom = _polynomials(form, "u", mirror=True)
    far = CodeBranch(
        "u",
        (Statement("u", _root(root, epsilon / loss)), *_with_sums(form, "u", rest, top, bottom)),
        {"v_star": Name("top") / (power("u", rest) * Name("bottom"))},
    )
    return near, far


def _needed(form: Powers) -> set[int]:
    return gaps(form.top) | gaps(form.bottom)


def _with_sums(form: Powers, variable: str, shift: int, top: Expression, bottom: Expression) -> Program:
    needed = _needed(form) | {shift}
    return (*powers(variable, needed), Statement("top", top), Statement("bottom", bottom))


def _root(root: Fraction, argument: Expression) -> Expression:
    if root == INTERVAL_ROOT:
        return Call("sqrt", (argument,))
    return Call("pow", (argument, Literal(str(float(root)))))


def _polynomials(form: Powers, variable: str, mirror: bool) -> tuple[Expression, Expression]:
    """Return N and D, or the mirrored ones."""
    top, bottom = ((letter, list(exponents)) for letter, exponents in (("a", form.top), ("b", form.bottom)))
    return _polynomial(*top, variable, mirror), _polynomial(*bottom, variable, mirror)


def _polynomial(letter: str, exponents: list[int], variable: str, mirror: bool) -> Expression:
    names = [f"{letter}{k}" for k in exponents]
    if mirror:
        exponents, names = [exponents[-1] - k for k in reversed(exponents)], names[::-1]
    return horner_expression(exponents, names, variable)


# --- bounds of rounding errors ----------------------------------------------------------------------------------------


@lru_cache(maxsize=256)
def half_line_sizes(form: Powers, a: Values, b: Values, kind: Format) -> dict[str, Size]:
    """Bound the rounding errors of epsilon and one_minus_epsilon for all v* >= 0, relative to the formula's value.

    Beyond 2^largest w may be subnormal. There w^3 underflows to 0, eps comes out as 0 and 1 - eps as 1, and both are
    right but for less than the smallest number.

    Raises
    ------
    ArithmeticError
        If a sum may vanish.
    """
    near, far = half_line(form)
    numbers = constants(form, a, b)
    with working(BITS):
        unit = arb(2) ** -kind.precision
        of_root = _log_error(2 * ULPS * unit)
        of_far_root = of_root + _log_error(unit) / 3

        def near_inputs(y: arb) -> dict[str, Rounded]:
            return {"v_star": Rounded(y**3, kind)}

        def far_inputs(u: arb) -> dict[str, Rounded]:
            return {"w": Rounded(u**3, kind, relative=unit)}

        both = (
            _on_parts(near, numbers, kind, near_inputs, lambda _: of_root),
            _on_parts(far, numbers, kind, far_inputs, lambda _: of_far_root),
        )

        return {name: _size(both, name, kind) for name in near.results}


@lru_cache(maxsize=256)
def inverse_sizes(
    form: Powers, root: Fraction, epsilon_min: Fraction, a: Values, b: Values, kind: Format
) -> dict[str, Size]:
    """Bound the rounding errors of v_star and beta, relative to the formula's value; nothing underflows there.

    The quotient of 1 - eps and eps has two roundings. (Where it is subnormal, the larger of eps and 1 - eps is
    rounded to 1, and the quotient is exact but for less than that.)

    Raises
    ------
    ArithmeticError
        If a sum may vanish.
    """
    with working(BITS):
        unit = arb(2) ** -kind.precision
        of_ratio = 2 * _log_error(unit) * ball_of(root)

        def of_root(y: arb) -> arb:
            if root == INTERVAL_ROOT:
                return of_ratio + _log_error(unit)
            return of_ratio + _of_pow(root, kind, abs(y.log()) / ball_of(root))

        start = _below_root(smallest_number(kind), root)
        end = _above_root(1 / epsilon_min - 1) if epsilon_min else Fraction(1)
        numbers = constants(form, a, b)
        relative = max(
            largest(_on_parts(branch, numbers, kind, lambda _: {}, of_root), _from(start, end), _of_v_star)
            for branch in inverse(form, root)
        )
        of_beta = (1 + relative) ** 2 * (1 + unit) / (1 - unit) * _of_pow(Fraction(1, 5), kind).exp() - 1
        return {name: Size(rounded_up(size, DIGITS), "0") for name, size in (("v_star", relative), ("beta", of_beta))}


def of_speed(kind: Format = DOUBLE, largest: Fraction | None = None) -> Fraction:
    """Return a bound of the error of ln v*, v* = sqrt(beta) pow(speed, 0.1) in a type: roots and their product.

    It holds for 1/largest <= speed <= largest; if `largest` is None, for every positive speed of the type.
    """
    with working(BITS):
        unit = arb(2) ** -kind.precision
        of_pow = _of_pow(Fraction(1, 10), kind, None if largest is None else ball_of(largest).log())
        return exact_middle((of_pow + 2 * _log_error(unit)).abs_upper())


def _log_error(relative: arb) -> arb:
    """Bound the error of the logarithm of a number with this relative error."""
    return -(1 - relative).log()


def _of_pow(exponent: Fraction, kind: Format, log: arb | None = None) -> arb:
    """Bound the error of ln pow(x, exponent), x > 0 or |ln x| <= log: that of pow, and of the exponent."""
    log = (kind.largest + kind.precision) * arb.const_log2() if log is None else log
    rounded = abs(Fraction(kind.nearest(exponent)) - exponent)
    return (_log_error(2 * ULPS * arb(2) ** -kind.precision) + ball_of(rounded) * log).abs_upper()


def _on_parts(
    branch: CodeBranch,
    numbers: Mapping[str, float],
    kind: Format,
    inputs: Callable[[arb], dict[str, Rounded]],
    log_error: Callable[[arb], arb],
) -> Callable[[Part], Found]:
    """Return a function from a part of the branch's variable to the results there, which raises if a sum may vanish.

    `log_error` bounds the error of the variable's logarithm.
    """
    exact = {name: Rounded(arb(c), kind) for name, c in numbers.items()}

    def literal(text: str) -> Rounded:
        return Rounded(arb(kind.nearest(Fraction(text))), kind)

    @cache
    def on(part: Part) -> Found:
        y = _between(part[0] * (1 - _SLACK), part[1] * (1 + _SLACK))
        error = log_error(y)
        if not error < ball_of(_SLACK) / 2:
            raise ArithmeticError("a computed root may be beyond its part")
        given: dict[str, Any] = {**exact, **inputs(y), branch.variable: Rounded(y, kind, slope=1)}
        values = run_program(branch.program, given, literal)
        return {
            name: evaluate(expression, values, literal).with_error_of_y(error)
            for name, expression in branch.results.items()
        }

    return on


def _size(branches: Sequence[Callable[[Part], Found]], name: str, kind: Format) -> Size:
    """Return the bounds for all parts of [0, 1] on all branches."""
    relative, underflow = (
        max(largest(on, _uniform(Fraction(1)), of) for on in branches)
        for of in (lambda found: found[name].relative, lambda found: found[name].underflow)
    )
    return Size(rounded_up(relative, DIGITS), rounded_up(underflow / ball_of(smallest_number(kind)), DIGITS))


def _of_v_star(found: Found) -> arb:
    v_star = found["v_star"]
    return (v_star.relative + v_star.underflow / arb(v_star.value.abs_lower())).abs_upper()


def largest(on: Callable[[Part], Result], parts: Iterable[Part], bound: Callable[[Result], arb]) -> arb:
    """Return a bound over all parts: the part with the largest bound is halved while that lowers it noticeably.

    On wide parts enclosures, those of slopes above all, exceed what they enclose by far.

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

    found, reached = [(known(part), part) for part in parts], arb(0)
    while True:
        place = max(range(len(found)), key=lambda i: found[i][0])
        worst, (low, high) = found[place]
        middle = (low + high) / 2
        alone = known((middle, middle))
        reached = max(reached, alone) if alone.is_finite() else reached
        if worst <= reached * (1 + ball_of(_NEARLY)):
            return worst
        if len(found) >= MOST_PARTS:
            break
        found[place : place + 1] = [(known(half), half) for half in ((low, middle), (middle, high))]
    if not worst.is_finite():
        on((low, high))
        raise ArithmeticError(f"there is no bound from {float(low):g} to {float(high):g}")
    return worst


def _uniform(end: Fraction) -> Iterator[Part]:
    """Yield the parts of [0, end], of which those beyond 1 are the longer the farther they are."""
    last = end / (1 + end)
    marks = [last * i / PARTS for i in range(PARTS + 1)]
    for low, high in pairwise(marks):
        yield low / (1 - low), high / (1 - high)


def _from(start: Fraction, end: Fraction) -> Iterator[Part]:
    """Yield the parts of [start, end]: narrow ones below `_NEAR`, so that powers of y are not 0; then `_uniform`."""
    low = start
    while low < _NEAR:
        yield low, low * _STEP
        low *= _STEP
    for part in _uniform(end):
        if part[1] > low:
            yield max(part[0], low), part[1]


def _below_root(number: Fraction, root: Fraction) -> Fraction:
    """Return a power of 2 that is at most the root of a power of 2."""
    exponent = number.denominator.bit_length() - 1
    return Fraction(1, 2 ** -(-exponent * root.numerator // root.denominator))


def _above_root(number: Fraction) -> Fraction:
    """Return a number that is a little above the square root."""
    return Fraction(float(number) ** 0.5) * (1 + Fraction(1, 2**40))


def _between(low: Fraction, high: Fraction) -> arb:
    return arb(ball_of((low + high) / 2).mid(), (ball_of((high - low) / 2) * (1 + arb(2) ** -60)).abs_upper())
