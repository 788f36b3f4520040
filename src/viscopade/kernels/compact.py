r"""Compact kernels: eps for all speeds by a lacunary quotient in a root of v*, without tables or branches, with proofs.

With w = beta^5 v = v*^10, y = v*^(1/3) = w^(1/30) = exp2(log2(w)/30), and N, D of `approximation.half_line`:

    elastic = D(y),    lost = v*^2 N(y) = y^6 N(y),    eps = elastic/(elastic + lost),
    1 - eps^2 = (1 - eps)(1 + eps),    1 - eps = lost/(elastic + lost),

the last without cancellation. w is cut off at 2^120 in type float, 2^900 in type double, where no power of y overflows,
and eps is below 2e-12 and 2e-90. `half_line` is the same formula as a function of v*, with cbrt and two branches.

An error delta of ln y changes ln eps by d ln eps/d ln y times delta, which `rounding.Rounded` encloses. As
ln y = ln(w)/30, errors of log2(w) are divided by 30: even a log2 that is good to an absolute 2^-22 only, as CUDA's is
near w = 1, moves ln y by 2^-22 ln(2)/30 = 6e-9.

y^SHIFT = y^6 = v*^2, and DEGREES_MORE = 4 is deg N - deg D, so that eps goes like y^-10 = v*^(-10/3). Balls have
BITS = 128 bits, far more than a double, and bounds of rounding are rounded up to DIGITS = 2 digits.

Names: `exponents` are the powers of y in N (`top`, coefficients a) and in D (`bottom`, coefficients b); `form` is the
number format, float or double; `machine` adds what is assumed of the functions of its library, in ulp.
"""

from __future__ import annotations

import math
from collections.abc import Iterator, Mapping
from dataclasses import replace
from fractions import Fraction
from functools import partial
from itertools import product
from typing import NamedTuple

from flint import arb, fmpq_poly

from viscopade.approximation import half_line as approximants
from viscopade.approximation.half_line import BEST, DEGREES_MORE, SHIFT, require_half_line_degrees
from viscopade.approximation.lacunary import LacunaryQuotient, Powers
from viscopade.arithmetic.balls import ball_of, working
from viscopade.arithmetic.decimals import at_most, rounded_up
from viscopade.arithmetic.formats import DOUBLE, FLOAT, Format
from viscopade.collision.exact import Exact
from viscopade.kernels import certificate, formulas
from viscopade.kernels.arithmetic import HOSTS, Arithmetic
from viscopade.kernels.bound import ErrorBound
from viscopade.kernels.coefficients import (
    ProvenQuotient,
    accuracy_name,
    bounds_on_machines,
    checked_accuracy,
    first_accurate,
    powers_text,
    proven_quotient,
    sampled_candidates,
)
from viscopade.kernels.enclosure import Formula, exact_polynomial
from viscopade.kernels.expressions import (
    Call,
    CodeBranch,
    Expression,
    Name,
    Reading,
    Run,
    Select,
    Statement,
    by_powers,
    evaluate,
    gaps,
    powers,
    read,
)
from viscopade.kernels.formulas import ONE, W_ACCEPTED, W_CUT, ZERO, constants, half_line_branches, letter_terms, within
from viscopade.kernels.kernel import Function, Kernel
from viscopade.kernels.rounding import Rounded, rounded_reading
from viscopade.kernels.rounding_bounds import (
    BITS,
    DIGITS,
    Part,
    Values,
    largest_bound,
    log_error,
    parts_to,
    powers_error,
    refined_bounds,
    relative_error,
    results_on_parts,
    rounding_of_w,
)
from viscopade.store import recorded

ROOT = 30  # y = w^(1/ROOT): w = v*^10 and y = v*^(1/3)
CUT_EXPONENT = {DOUBLE.name: 900, FLOAT.name: 120}
"""w is cut off at 2 to this power: a multiple of ROOT, so that y is at most 2^30 (float: 2^4).

Then powers up to about y^33 (float: y^30) do not overflow, with their coefficients, as `_check_overflow` checks for
each kernel. eps is 2e-90 (2e-12) there.
"""
COMMON = (Fraction(1, 1000), Fraction(10))
"""The v* for which bounds of type float are given, too, besides the bounds for all v*: they are smaller there."""
MEANINGS = {
    "restitution": "eps",
    "rebound": "eps speed, the speed after the collision",
    "dissipation": "1 - eps^2",
}
DOMAIN = (
    "all finite speeds and betas >= 0. The functions replace w beyond 2^900 (2^120 in float) by that number, so that "
    "eps stays positive"
)
NORMAL = ("beta^5", "w = beta^5 speed")
"""What must be normal numbers for the bounds of functions of the speed."""
V_STAR_FUNCTIONS = ("epsilon", "one_minus_epsilon")
"""Functions of `half_line` kernels."""

BEST_ACCURACY = Fraction("2.9e-8")
"""The smallest accuracy that may be asked for: the kernel with most coefficients is proven to 2.79e-8, and rounds.

The largest one, 0.99, is a matter of taste: with an error of 1 a kernel would say nothing.
"""

_COMMON_Y = (Fraction(1, 10), Fraction(2155, 1000))  # cube roots of `COMMON`, 0.1 and 2.15443…, rounded outwards
# Relative width by which ends of y are moved outwards: more than the 2^-52 by which Python's power may be off.
_ABOVE_POWER_ERROR = Fraction(1, 2**40)
# Relative width by which a ball of y may exceed the interval that it encloses: the 30 bits of a ball's radius make that
# up to 6e-8 (measured on all parts), while a program with another root would be off by far more.
_ABOVE_BALL_WIDTH = Fraction(1, 2**16)
# Parts into which an octave of y is cut at first, below y = 1 and beyond: beyond, powers of y outweigh the constants
# and vary more. `refined` halves the worst parts, so that these numbers cost time alone: with 1, 8 and with 16, 128 the
# bounds of the kernel for 1e-5 are the same (measured), and take 2 and 3 times as long.
_PARTS_OF_OCTAVE = 4, 32
# Stands for the product of two roundings beside their sum: in float each is below 2^-21, so that the product is below
# 2^-21 of the sum; 2^-10 is ample, and not seen in two digits.
_SECOND_ORDER = 1 + Fraction(1, 1 << 10)


# --- kernels ----------------------------------------------------------------------------------------------------------


class FitChoice(NamedTuple):
    """What an accuracy asks for: the kernel with the fewest coefficients."""

    suffix: str
    """The accuracy as the end of a kernel's name: "1em5"."""
    exponents: Powers
    quotient: ProvenQuotient


def compact(accuracy: Exact) -> Kernel:
    """Return the kernel of speed and beta with the fewest coefficients and a proven error within the accuracy.

    Parameters
    ----------
    accuracy : str, int, float, Fraction, Decimal, mpmath.mpf or NumPy scalar
        Relative to the smaller of eps and 1 - eps, from 2.9e-8 to 0.99, for type double and with rounding.

    Raises
    ------
    TypeError, ValueError
        If the argument is not of this kind.
    """
    suffix, exponents, quotient = _choose(accuracy)
    functions = tuple(
        Function(result, ("speed", "beta"), meaning, W_ACCEPTED, y_program(), (result_branch(exponents),), result)
        for result, meaning in MEANINGS.items()
    )
    # The constants 1/30 and the cut-off, besides the coefficients.
    more_constants = {
        form.name: {"thirtieth": thirtieth(form), "largest": 2.0 ** CUT_EXPONENT[form.name]}
        for form in quotient.formats
    }
    text = f"eps = D/(D + y^6 N), y = w^(1/30), w = beta^5 speed = v*^10, {powers_text(exponents)}"
    return _kernel(
        f"compact_{suffix}", "speed", text, DOMAIN, functions, exponents, quotient, more_constants, NORMAL
    )  # fmt: skip


def half_line(accuracy: Exact) -> Kernel:
    """Return the kernel of v*, by cbrt, with the coefficients of the compact one.

    The accuracy and the errors raised are those of `compact`.
    """
    suffix, exponents, quotient = _choose(accuracy)
    v_star = Name("v_star")
    # One program in y = v*^(1/3) up to v* = 1, one in 1/y beyond, where powers of y could overflow.
    near, far = half_line_branches(exponents)
    branches = (near._replace(guard=within("v_star", ZERO, ONE)), far._replace(guard=v_star > ONE))
    meanings = zip(V_STAR_FUNCTIONS, ("eps", "1 - eps"), strict=True)
    functions = tuple(
        Function(result, ("v_star",), meaning, None, (), branches, result) for result, meaning in meanings
    )
    text = f"eps = D/(D + v*^2 N), y = v*^(1/3), {powers_text(exponents)}"
    return _kernel(f"halfline_{suffix}", "v_star", text, "all v* >= 0", functions, exponents, quotient, {})


def _choose(accuracy: Exact) -> FitChoice:
    """Return what an accuracy asks for; errors as for `compact`."""
    limit = checked_accuracy(accuracy, BEST_ACCURACY, further=", or tables (--from-speed, --full)")
    exponents = compact_powers(limit)
    return FitChoice(accuracy_name(limit), exponents, compact_fit(exponents))


def _kernel(
    name: str,
    argument: str,
    text: str,
    domain: str,
    functions: tuple[Function, ...],
    exponents: Powers,
    quotient: ProvenQuotient,
    more_constants: Mapping[str, Mapping[str, float]],
    normal: tuple[str, ...] = (),
) -> Kernel:
    """Return a kernel with functions of the speed or of v*, the bounds of these, and further constants.

    Parameters
    ----------
    name : str
        Of the kernel: "compact_1em5".
    argument : str
        "speed" or "v_star".
    text, domain : str
        The formula, and the arguments for which it holds, for the reader.
    functions : tuple of Function
    exponents : Powers
        Those of y in N and D.
    quotient : ProvenQuotient
        The coefficients and the bounds of all functions.
    more_constants : mapping
        Constants besides the coefficients: name of a format -> name -> value.
    normal : tuple of str
        What must be a normal number for the bounds.
    """
    results = {function.name for function in functions}
    source = "best N/D found in the measure |error|/min(eps, 1 - eps) over all v* >= 0, with these powers of y"
    head = {
        "name": name, "kind": "halfline", "root": str(approximants.ROOT), "top": exponents.top,
        "bottom": exponents.bottom,
    }  # fmt: skip
    # What rounding adds to functions of v*, as a checker reads it: relative to the formula's value, which is at most
    # (1 + formula) times the exact one, and by underflow, in smallest numbers of the format.
    rounding = dict[str, dict[str, dict[str, str]]]()
    for form in quotient.formats:
        rounding[form.name] = {}
        for result in V_STAR_FUNCTIONS:
            bound = quotient.bound(result, form)
            rounding[form.name][result] = {
                "relative": at_most(bound.last / (1 + bound.formula), DIGITS),
                "underflow": at_most(bound.absolute, DIGITS),
            }
    return Kernel(
        name, name, argument, text, source, domain, functions,
        {
            form.name: {**more_constants.get(form.name, {}), **constants(exponents, *quotient.rounded(form))}
            for form in quotient.formats
        },
        tuple(b for b in quotient.bounds if b.result in results), missing=quotient.missing,
        record={
            **head, "formula": text, "domain": domain, "measure": quotient.certificate.measure,
            "variants": quotient.variants(rounding), "missing": quotient.missing, "source": source,
        },
        proofs=(quotient.proof(head, rounding),), normal=normal,
    )  # fmt: skip


# --- fits -------------------------------------------------------------------------------------------------------------


@recorded("compact powers")
def compact_powers(accuracy: Fraction) -> Powers:
    """Return the powers of y in the kernel with the fewest coefficients that is proven to be accurate enough.

    The accuracy is the largest |error of eps|/min(eps, 1 - eps) in type double, with rounding.
    """
    candidates = sampled_candidates(BEST, approximants.fit_half_line)
    return first_accurate(accuracy, candidates, lambda exponents: compact_fit(exponents).error("restitution"))


@recorded("compact")
def compact_fit(exponents: Powers) -> ProvenQuotient:
    """Return the best kernel with these exponents of y = v*^(1/3), and its bounds.

    Errors are those of `half_line.fit_half_line`.
    """
    # The best coefficients, which the fit has rounded to doubles: so the proof is that of the program's coefficients.
    best = approximants.fit_half_line(exponents).quotient
    a, b = (tuple(map(float, values)) for values in (best.a, best.b))
    # The error of the formula with exact operations, for v* from 0 to infinity.
    proof = certificate.prove(half_line_formula(best), Fraction(0), math.inf)

    def bounds(form: Format) -> Iterator[ErrorBound]:
        """Yield what rounding adds: to functions of the speed on each machine, to those of v* on the host."""
        yield from bounds_on_machines(form, lambda machine: _compact_bounds(exponents, a, b, proof.bound, machine))
        yield from _half_line_bounds(exponents, a, b, proof.bound, HOSTS[form.name])

    return proven_quotient(a, b, proof, bounds)


def half_line_formula(quotient: LacunaryQuotient) -> Formula:
    """Return eps = D/(D + v*^2 N), with N and D lacunary in y = v*^(1/3), deg N = deg D + 4, as proofs read it."""
    require_half_line_degrees(quotient.powers)
    # 3: the formula is smooth in the cube root of v*.
    return Formula(3, *half_line_branches(quotient.powers), constants(quotient.powers, quotient.a, quotient.b))


# --- the program ------------------------------------------------------------------------------------------------------


def thirtieth(form: Format) -> float:
    """Return the number of a format nearest to 1/30."""
    return form.nearest(Fraction(1, ROOT))


def root_of(w: Expression) -> Expression:
    """Return w^(1/30) = exp2(log2(w)/30); log2 and exp2 may be those of any one base."""
    return Call("exp2", (Call("log2", (w,)) * Name("thirtieth"),))


def y_program() -> tuple[Statement, ...]:
    """Return the assignments from speed and beta to y = w^(1/30); there is no logarithm of 0.

    At speed 0, y is 0 also where beta^5 overflows and w is NaN; it is NaN for 0 and infinity together. Arrays compute
    both sides of a choice, so that each has arguments that give no NaN.
    """
    x = Name("x")  # w, at most the cut-off
    positive = x > ZERO
    return (
        *formulas.w_program(),
        Statement("x", W_CUT),
        # Where x is 0 or NaN: speed beta is NaN for 0 times infinity; for finite arguments 0 times it is 0. Elsewhere
        # it is not used, and 0 stands for it, as 1, whose logarithm is 0, stands for a w that has none.
        Statement("at_rest", Select(positive, ZERO, Name("speed") * Name("beta"))),
        Statement("y", Select(positive, root_of(Select(positive, x, ONE)), ZERO * Name("at_rest"))),
    )


def result_branch(exponents: Powers) -> CodeBranch:
    """Return the program from y and the speed to the three results, with these exponents of y in N and D.

    Raises
    ------
    ValueError
        If a kernel for all v* >= 0 cannot have these powers.
    """
    require_half_line_degrees(exponents)
    elastic, lost, inverse = Name("elastic"), Name("lost"), Name("inverse")
    program = (
        # y2 = y * y, …: the powers that Horner's rule needs in N and D, and y^6 = v*^2
        *powers("y", gaps(exponents.top) | gaps(exponents.bottom) | {SHIFT}),
        # elastic = D(y), lost = y^6 N(y)
        Statement("elastic", by_powers("y", letter_terms("b", exponents.bottom))),
        Statement("lost", Name(f"y{SHIFT}") * by_powers("y", letter_terms("a", exponents.top))),
        Statement("inverse", Call("divide", (ONE, elastic + lost))),
    )
    # eps = elastic/(elastic + lost)
    epsilon = Call("divide", (elastic, elastic + lost))
    results: dict[str, Expression] = {
        "restitution": epsilon,
        "rebound": epsilon * Name("speed"),
        # 1 - eps^2 = (1 - eps) (1 + eps), 1 - eps = lost/(elastic + lost): no difference of nearly equal numbers
        "dissipation": lost * inverse * (ONE + elastic * inverse),
    }
    return CodeBranch(None, program, results)


def check_formula(exponents: Powers, a: Values, b: Values) -> None:
    """Check that a program without rounding is the formula whose error is proven, and gives eps speed and 1 - eps^2.

    a and b are the coefficients of N and D. Both programs have polynomials in y for elastic and lost. The results are
    quotients P/Q of polynomials of degree 2 at most in elastic and in lost. P_1/Q_1 = P_2/Q_2 if P_1 Q_2 - P_2 Q_1, of
    degree 4 at most in each, vanishes on a grid of 5 by 5 points.

    Raises
    ------
    ArithmeticError
        If it is not.
    """
    branch, (proven, _) = result_branch(exponents), half_line_branches(exponents)
    # elastic and lost as polynomials in the variable y, v* being y^3: equal coefficients
    y, coefficients = fmpq_poly([0, 1]), constants(exponents, a, b)
    for name in ("elastic", "lost"):
        variables = {"y": y, "v_star": y**3}
        if exact_polynomial(branch, name, variables, coefficients) != exact_polynomial(
            proven, name, variables, coefficients
        ):
            raise ArithmeticError(f"{name} of the program is not that of the proven formula")
    in_fractions = Reading(Fraction, {"divide": lambda top, bottom: top / bottom})
    # w is a product of speeds and betas: two values of each, any two primes, show their exponents.
    for speed, beta in product((Fraction(3), Fraction(5)), repeat=2):
        if Run(formulas.w_program(), {"speed": speed, "beta": beta}, in_fractions)["w"] != beta**5 * speed:
            raise ArithmeticError("w of the program is not beta^5 speed")
    # The results at elastic and lost = 1 … 6, in fractions: 6 by 6 points, one more than needed in each. In the speed
    # they are linear: two values suffice.
    (inverse,) = (statement for statement in branch.program if statement.name == "inverse")
    grid = [Fraction(n) for n in range(1, 7)]
    for elastic, lost, speed in product(grid, grid, (Fraction(3), Fraction(5))):
        run = Run((inverse,), {"elastic": elastic, "lost": lost, "speed": speed}, in_fractions)
        eps = evaluate(proven.results["epsilon"], run, in_fractions)
        for name, value in zip(MEANINGS, (eps, eps * speed, 1 - eps**2), strict=True):
            if evaluate(branch.results[name], run, in_fractions) != value:
                raise ArithmeticError(f"{name} of the program is not that of the proven formula")


# --- bounds of functions of the speed ---------------------------------------------------------------------------------


def v_star_range(form: Format) -> tuple[Fraction, Fraction]:
    """Return the least and the largest v* for which bounds hold in a format, rounded inwards.

    w = v*^10 goes from the smallest normal number to the cut-off.
    """
    low, high = 2.0 ** ((1 - form.largest) / 10), 2.0 ** (CUT_EXPONENT[form.name] / 10)
    # 1 % inwards: rounding to three digits moves a number by at most 0.5 %.
    return Fraction(f"{1.01 * low:.3g}"), Fraction(f"{0.99 * high:.3g}")


def _compact_bounds(
    exponents: Powers, a: Values, b: Values, error: Fraction, machine: Arithmetic
) -> Iterator[ErrorBound]:
    """Yield the bounds in an arithmetic: for all v*, and in type float the smaller ones in `COMMON`.

    `error` is that of the formula with these exponents of y and coefficients a and b: |error of eps|/min(eps, 1 - eps).
    `machine` says what is assumed of its functions, in ulp.

    There are two for eps. In one, what rounding adds is relative to eps. In the other it is relative to the smaller one
    of eps and 1 - eps, except for the last sum and quotient: the operations before change lost/elastic by a factor
    1 + eta, and so eps by eps (1 - eps) eta. This is below r_0 eps, with the bound r_0 of eps's relative error. From
    the bound r_2 for 1 - eps^2 it is below r_2 (1 - eps^2)/(2 eps), at most 3/2 r_2 (1 - eps) for eps >= 1/2.
    """
    form = machine.form
    # Relative error of 1 - eps^2 by the formula: |d eps| (2 eps + |d eps|)/((1 - eps) (1 + eps)). It is at most
    # error (1 + error/2), as |d eps| <= error (1 - eps), 2 eps/(1 + eps) <= 1 and |d eps| <= error/2.
    dissipation_error = error * (1 + error / 2)
    sizes = compact_rounding(exponents, a, b, machine)
    # Rounding of the last sum, half an ulp, and of the quotient, in elastic/(elastic + lost).
    unit = Fraction(2) ** -form.precision
    last = (unit + machine.quotient * machine.ulp) * _SECOND_ORDER
    ranges = (v_star_range(form), COMMON) if form == FLOAT else (v_star_range(form),)
    for i, (low, high) in enumerate(ranges):
        # Relative errors by rounding: r_0 of eps, r_1 of rebound, r_2 of 1 - eps^2. They are relative to the formula's
        # value, which is up to 1 + error times the exact one.
        r_0, r_1, r_2 = (sizes[name][i] for name in MEANINGS)
        bound = ErrorBound("restitution", low, high, "smaller", error, arithmetic=machine)
        yield replace(bound, last=r_0 * (1 + error))
        # eps speed may be subnormal: its rounding adds half of the smallest number.
        yield replace(bound, result="rebound", last=r_1 * (1 + error), absolute=Fraction(1, 2))
        # 3/2 = (1 + eps)/(2 eps) at eps = 1/2, from where it falls; below eps = 1/2 the smaller one is eps, with r_0.
        yield replace(bound, rounding=max(r_0, Fraction(3, 2) * r_2) * (1 + error), last=last)
        dissipation_rounding = r_2 * (1 + dissipation_error)
        yield ErrorBound(
            "dissipation", low, high, "value", dissipation_error, dissipation_rounding, arithmetic=machine
        )  # fmt: skip


def compact_rounding(exponents: Powers, a: Values, b: Values, machine: Arithmetic) -> dict[str, tuple[Fraction, ...]]:
    """Bound each function's rounding error, relative to the formula's value, for all w; in float for `COMMON`, too.

    The formula has these exponents of y and coefficients a and b. Keys are those of `MEANINGS`. All w are those up to
    the cut-off where beta^2, beta^4, beta^5 and w as computed are normal. The bound of rebound holds where it is a
    normal number.

    Raises
    ------
    ArithmeticError
        If a sum may vanish, or a power overflow.
    """
    check_formula(exponents, a, b)
    with working(BITS):
        _check_overflow(exponents, a, b, machine.form)
        # The speed is exact, and any number serves, as errors are relative: 1. The slope of rebound is that at constant
        # speed.
        exact_speed = {"speed": Rounded(arb(1), machine.form)}
        # From an interval of y to the results there, as numbers that bound their rounding errors.
        results_on = results_on_parts(
            result_branch(exponents), [*MEANINGS], "y", constants(exponents, a, b), machine, lambda _: exact_speed,
            partial(_error_of_y, machine),
        )  # fmt: skip
        ranges = [_range_of_y(machine.form), *([_COMMON_Y] if machine.form == FLOAT else [])]
        parts_of_ranges = [tuple(_octave_parts(machine.form, *ends)) for ends in ranges]
        return {
            name: tuple(
                rounded_up(largest_bound(results_on, parts, relative_error(name)), DIGITS) for parts in parts_of_ranges
            )
            for name in MEANINGS
        }


def _error_of_y(machine: Arithmetic, exact_y: arb) -> arb:
    """Bound the error of ln y on an interval of the exact y; the error of w = y^ROOT is included.

    Raises
    ------
    ArithmeticError
        If the program's y is not w^(1/ROOT).
    """
    ulp, form, library = ball_of(machine.ulp), machine.form, ball_of(machine.functions)
    low, high = exact_y.lower(), exact_y.upper()

    def error_in_base(ln_base: arb) -> arb:
        """Bound the error if log2 and exp2 are logarithm and power of a base, given its natural logarithm."""

        def log(w: Rounded) -> Rounded:
            # log w = ROOT ln y/ln base, from the ends of y: w itself spans many octaves, and its ball might contain 0.
            value = low.log().union(high.log()) * ROOT / ln_base
            # An error of w moves it by ln(1 + relative error)/ln base; the call adds `library` ulp of its result, and
            # that of a device an absolute error besides, near w = 1.
            from_w = -(1 - w.relative).log() / ln_base
            from_call = (value.abs_upper() + from_w) * library * ulp + ball_of(machine.log2_absolute)
            return Rounded(value, form).with_absolute_error(from_call + from_w)

        def exp(x: Rounded) -> Rounded:
            # base^x: an absolute error of x becomes a relative one, base^error - 1; the call adds `library` ulp.
            return Rounded((x.value * ln_base).exp(), form, (x.absolute * ln_base).exp() - 1).with_error(ulp * library)

        exact = Fraction(1, ROOT)
        error_of_thirtieth = abs(Fraction(thirtieth(form)) / exact - 1)
        inputs = {
            # Only the relative error of w counts, as `log` takes its value from y: 1 stands for all.
            "w": Rounded(arb(1), form, ball_of(rounding_of_w(form))),
            "thirtieth": Rounded(ball_of(exact), form, ball_of(error_of_thirtieth)),
        }
        branch = CodeBranch(None, (), {"y": root_of(Name("w"))})
        y: Rounded = read(branch, ["y"], inputs, rounded_reading(form, log2=log, exp2=exp))["y"]
        # The enclosure must be the interval of y again: it contains both ends, and hardly more.
        contains_ends = y.value.overlaps(low) and y.value.overlaps(high)
        wider = ball_of(_ABOVE_BALL_WIDTH)
        if not (contains_ends and low * (1 - wider) < y.value < high * (1 + wider)):
            raise ArithmeticError("y of the program is not the root of w")
        return (1 - y.relative).log().abs_upper()

    # The logarithms of a host's library may have either base, 2 or e; those of a device have base 2.
    bases = [arb.const_log2(), *([arb(1)] if machine.place == "host" else [])]
    return max(map(error_in_base, bases))


def _range_of_y(form: Format) -> Part:
    """Return the y = w^(1/ROOT) of the smallest normal w and of the cut-off, rounded outwards."""
    low, high = (Fraction(2.0 ** (e / ROOT)) for e in (1 - form.largest, CUT_EXPONENT[form.name]))
    return low * (1 - _ABOVE_POWER_ERROR), high * (1 + _ABOVE_POWER_ERROR)


def _octave_parts(form: Format, beginning: Fraction, end: Fraction) -> Iterator[Part]:
    """Yield intervals of y from `beginning` to `end`: octaves of y, from 2^n to 2^(n + 1), each cut into equal parts.

    Octaves reach from the y of the format's smallest normal w to that of the cut-off.
    """
    # Exponents of w over ROOT, rounded down and up, are those of y.
    for octave in range((1 - form.largest) // ROOT, -(-CUT_EXPONENT[form.name] // ROOT) + 1):
        octave_start, number = Fraction(2) ** octave, _PARTS_OF_OCTAVE[octave >= 0]
        for i in range(number):
            low, high = (octave_start * (1 + Fraction(k, number)) for k in (i, i + 1))
            if low < end and high > beginning:
                yield max(low, beginning), min(high, end)


def _check_overflow(exponents: Powers, a: Values, b: Values, form: Format) -> None:
    """Raise an ArithmeticError if a power or a sum may overflow at the cut-off; sums are largest there.

    a and b are the coefficients of N and D.
    """
    # y at the cut-off, 2^(exponent/ROOT), the exponent rounded up
    y = Fraction(2) ** (-(-CUT_EXPONENT[form.name] // ROOT))
    # elastic + lost = D + y^6 N <= y^degree (sum of all |coefficients|), with y >= 1 and degree = 6 + deg N; twice that
    # is more than what rounding adds.
    degree = SHIFT + exponents.bottom[-1] + DEGREES_MORE
    if y**degree * sum(abs(Fraction(c)) for c in (*a, *b)) * 2 >= Fraction(2) ** form.largest:
        raise ArithmeticError(f"y to the power {degree} may overflow in type {form.name}")


# --- bounds of functions of v* ----------------------------------------------------------------------------------------


def _half_line_bounds(
    exponents: Powers, a: Values, b: Values, error: Fraction, machine: Arithmetic
) -> Iterator[ErrorBound]:
    """Yield the bounds of eps and 1 - eps for all v* >= 0, on the host.

    `error` is that of the formula with coefficients a and b, relative to min(eps, 1 - eps). Beyond
    v* = 2^(largest exponent) the program's w = 1/v* may be subnormal. There w^3 underflows to 0, eps comes out as 0 and
    1 - eps as 1, and both are right to less than the smallest number.
    """
    near, far = half_line_branches(exponents)
    coefficients, form = constants(exponents, a, b), machine.form
    with working(BITS):
        # Errors of ln y, y = v*^(1/3), and of ln u, u = (1/v*)^(1/3): v* is exact, and 1/v* is rounded once, by `unit`.
        unit = arb(2) ** -form.precision
        error_of_y, error_of_u = (
            log_error(powers_error(branch, name, machine, {"v_star": 0})) for branch, name in ((near, "y"), (far, "u"))
        )

        def near_inputs(y: arb) -> dict[str, Rounded]:
            return {"v_star": Rounded(y**3, form)}  # v* = y^3, exactly

        def far_inputs(u: arb) -> dict[str, Rounded]:
            return {"w": Rounded(u**3, form, unit)}  # 1/v* = u^3, rounded once

        # From an interval of y, or of u, to the results there, with bounds of their rounding errors.
        branches = (
            results_on_parts(near, V_STAR_FUNCTIONS, "y", coefficients, machine, near_inputs, lambda _: error_of_y),
            results_on_parts(far, V_STAR_FUNCTIONS, "u", coefficients, machine, far_inputs, lambda _: error_of_u),
        )
        for name in V_STAR_FUNCTIONS:
            # Underflow of intermediate numbers is counted relative to the least normal result. For 1 - eps it is half
            # of that: 1 - eps^2, computed from it, may be a normal number there.
            least_result = ball_of(form.least) / (1 + (name == "one_minus_epsilon"))
            relative = relative_error(name, least_result)
            # Both branches have the parts of [0, 1]: y up to 1 is v* up to 1, u up to 1 is v* beyond.
            walks = [
                (results_on, refined_bounds(results_on, parts_to(Fraction(1)), relative)) for results_on in branches
            ]
            size = max(size for _, parts in walks for size, _ in parts)
            underflow = max(results_on(part)[name].underflow for results_on, parts in walks for _, part in parts)
            # Relative to the formula's value, at most 1 + error times the exact one; underflow in smallest numbers.
            yield ErrorBound(
                name, Fraction(0), math.inf, "smaller", error, last=rounded_up(size, DIGITS) * (1 + error),
                absolute=rounded_up(underflow / ball_of(form.smallest), DIGITS), arithmetic=machine,
            )  # fmt: skip
