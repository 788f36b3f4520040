r"""Compact kernels: eps for all speeds by a lacunary quotient in a root of v*, without tables or branches, with proofs.

With w = beta^5 v = v*^10, y = v*^(1/3) = w^(1/30) = exp2(log2(w)/30), and N, D of `approximation.half_line`:

    elastic = D(y),    lost = v*^2 N(y) = y^6 N(y),    eps = elastic/(elastic + lost),
    1 - eps^2 = (1 - eps)(1 + eps),    1 - eps = lost/(elastic + lost),

the last without cancellation. w is cut off at 2^120 in type float, 2^900 in type double, where no power of y overflows,
and eps is below 2e-12 and 2e-90. `half_line` is the same formula as a function of v*, with cbrt and two branches.

An error delta of ln y changes ln eps by d ln eps/d ln y times delta, which `rounding.Rounded` encloses. As
ln y = ln(w)/30, errors of log2(w) are divided by 30: even a log2 that is good to an absolute 2^-22 only, as CUDA's is
near w = 1, costs 1e-8.
"""

from __future__ import annotations

import math
from collections.abc import Iterator, Mapping
from dataclasses import replace
from fractions import Fraction
from functools import partial
from itertools import product

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

ROOT = 30  # y = w^(1/ROOT)
LARGEST = {DOUBLE.name: 900, FLOAT.name: 120}
"""w is cut off at 2 to this power."""
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
OF_V_STAR = ("epsilon", "one_minus_epsilon")
"""Functions of `half_line` kernels."""

LEAST = Fraction("2.9e-8")
"""Accuracy that the best kernel reaches."""
_COMMON_Y = (Fraction(1, 10), Fraction(2155, 1000))  # cube roots of `COMMON`, rounded outwards
_TINY = Fraction(1, 2**40)
_WIDER = Fraction(1, 2**16)  # more than what balls add to an interval of y
_PARTS = 4, 32  # of an octave of y below 1 and beyond, at first: there powers of y vary more, and outweigh the rest
_SECOND_ORDER = 1 + Fraction(1, 1 << 10)  # products of roundings are less


# --- kernels ----------------------------------------------------------------------------------------------------------


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
    name, form, found = _chosen(accuracy)
    functions = tuple(
        Function(result, ("speed", "beta"), meaning, W_ACCEPTED, start(), (body(form),), result)
        for result, meaning in MEANINGS.items()
    )
    more = {kind.name: {"thirtieth": thirtieth(kind), "largest": 2.0 ** LARGEST[kind.name]} for kind in found.formats}
    text = f"eps = D/(D + y^6 N), y = w^(1/30), w = beta^5 speed = v*^10, {powers_text(form)}"
    return _kernel(f"compact_{name}", "speed", text, DOMAIN, functions, form, found, more, NORMAL)


def half_line(accuracy: Exact) -> Kernel:
    """Return the kernel of v*, by cbrt, with the coefficients of the compact one; arguments and errors as for it."""
    name, form, found = _chosen(accuracy)
    v_star = Name("v_star")
    near, far = half_line_branches(form)
    branches = (near._replace(guard=within("v_star", ZERO, ONE)), far._replace(guard=v_star > ONE))
    meanings = zip(OF_V_STAR, ("eps", "1 - eps"), strict=True)
    functions = tuple(
        Function(result, ("v_star",), meaning, None, (), branches, result) for result, meaning in meanings
    )
    text = f"eps = D/(D + v*^2 N), y = v*^(1/3), {powers_text(form)}"
    return _kernel(f"halfline_{name}", "v_star", text, "all v* >= 0", functions, form, found, {})


def _chosen(accuracy: Exact) -> tuple[str, Powers, ProvenQuotient]:
    """Return the end of a kernel's name, and its powers and coefficients."""
    wanted = checked_accuracy(accuracy, LEAST)
    form = compact_powers(wanted)
    return accuracy_name(wanted), form, compact_fit(form)


def _kernel(
    name: str,
    argument: str,
    text: str,
    domain: str,
    functions: tuple[Function, ...],
    form: Powers,
    found: ProvenQuotient,
    more: Mapping[str, Mapping[str, float]],
    normal: tuple[str, ...] = (),
) -> Kernel:
    """Return a kernel with functions of the speed or of v*, the bounds of these, and further constants."""
    results = {function.name for function in functions}
    source = "best N/D found in the measure |error|/min(eps, 1 - eps) over all v* >= 0, with these powers of y"
    head = {"name": name, "kind": "halfline", "root": str(approximants.ROOT), "top": form.top, "bottom": form.bottom}
    rounding = {kind.name: {r: _sizes(found, r, kind) for r in OF_V_STAR} for kind in found.formats}
    return Kernel(
        name, name, argument, text, source, domain, functions,
        {kind.name: {**more.get(kind.name, {}), **constants(form, *found.rounded(kind))} for kind in found.formats},
        tuple(b for b in found.bounds if b.result in results), missing=found.missing,
        record={
            **head, "formula": text, "domain": domain, "measure": found.certificate.measure,
            "variants": found.variants(rounding), "missing": found.missing, "source": source,
        },
        proofs=(found.proof(head, rounding),), normal=normal,
    )  # fmt: skip


def _sizes(found: ProvenQuotient, result: str, form: Format) -> dict[str, str]:
    """Return what rounding adds to a function of v*, relative to the formula's value, and by underflow."""
    bound = found.bound(result, form)
    return {"relative": at_most(bound.last / (1 + bound.formula), DIGITS), "underflow": at_most(bound.absolute, DIGITS)}


# --- fits -------------------------------------------------------------------------------------------------------------


@recorded("compact powers")
def compact_powers(wanted: Fraction) -> Powers:
    """Return the powers of the kernel with the fewest coefficients that is proven to be accurate enough."""
    candidates = sampled_candidates(BEST, approximants.fit_half_line)
    return first_accurate(wanted, candidates, lambda form: compact_fit(form).error("restitution"))


@recorded("compact")
def compact_fit(form: Powers) -> ProvenQuotient:
    """Return the best kernel with given powers of v*^(1/3); errors as for `half_line.fit_half_line`."""
    best = approximants.fit_half_line(form).quotient
    a, b = (tuple(map(float, values)) for values in (best.a, best.b))
    proof = certificate.prove(half_line_formula(best), Fraction(0), math.inf)

    def bounds(kind: Format) -> Iterator[ErrorBound]:
        yield from bounds_on_machines(kind, lambda machine: _compact_bounds(form, a, b, proof.bound, machine))
        yield from _half_line_bounds(form, a, b, proof.bound, HOSTS[kind.name])

    return proven_quotient(a, b, proof, bounds)


def half_line_formula(found: LacunaryQuotient) -> Formula:
    """Return eps = D/(D + v*^2 N), with N and D lacunary in y = v*^(1/3), deg N = deg D + 4, as proofs read it."""
    require_half_line_degrees(found.powers)
    return Formula(3, *half_line_branches(found.powers), constants(found.powers, found.a, found.b))


# --- the program ------------------------------------------------------------------------------------------------------


def thirtieth(form: Format) -> float:
    """Return 1/30 in a format."""
    return form.nearest(Fraction(1, ROOT))


def root_of(w: Expression) -> Expression:
    """Return w^(1/30); log2 and exp2 may be those of any one base."""
    return Call("exp2", (Call("log2", (w,)) * Name("thirtieth"),))


def start() -> tuple[Statement, ...]:
    """Return the assignments from speed and beta to y; there is no logarithm of 0.

    At speed 0, y is 0 also where beta^5 overflows and w is NaN; it is NaN for 0 and infinity together. Arrays compute
    both sides of a choice, so that each has arguments that give no NaN.
    """
    x = Name("x")
    positive = x > ZERO
    return (
        *formulas.w_program(),
        Statement("x", W_CUT),
        Statement("at_rest", Select(positive, ZERO, Name("speed") * Name("beta"))),
        Statement("y", Select(positive, root_of(Select(positive, x, ONE)), ZERO * Name("at_rest"))),
    )


def body(form: Powers) -> CodeBranch:
    """Return the program from y to the results, with given powers of y.

    Raises
    ------
    ValueError
        If a kernel for all v* >= 0 cannot have these powers.
    """
    require_half_line_degrees(form)
    elastic, lost, inverse = Name("elastic"), Name("lost"), Name("inverse")
    program = (
        *powers("y", gaps(form.top) | gaps(form.bottom) | {SHIFT}),
        Statement("elastic", by_powers("y", letter_terms("b", form.bottom))),
        Statement("lost", Name(f"y{SHIFT}") * by_powers("y", letter_terms("a", form.top))),
        Statement("inverse", Call("divide", (ONE, elastic + lost))),
    )
    epsilon = Call("divide", (elastic, elastic + lost))
    results: dict[str, Expression] = {
        "restitution": epsilon,
        "rebound": epsilon * Name("speed"),
        "dissipation": lost * inverse * (ONE + elastic * inverse),
    }
    return CodeBranch(None, program, results)


def check_formula(form: Powers, a: Values, b: Values) -> None:
    """Check that a program without rounding is the formula whose error is proven, and gives eps speed and 1 - eps^2.

    Both have polynomials in y for elastic and lost. The results are quotients of polynomials of degree 4 at most in
    elastic and lost, so that they are the same functions if they agree on a grid of more than 5 by 5 points.

    Raises
    ------
    ArithmeticError
        If it is not.
    """
    own, (proven, _) = body(form), half_line_branches(form)
    y, coefficients = fmpq_poly([0, 1]), constants(form, a, b)
    for name in ("elastic", "lost"):
        given = {"y": y, "v_star": y**3}
        if exact_polynomial(own, name, given, coefficients) != exact_polynomial(proven, name, given, coefficients):
            raise ArithmeticError(f"{name} of the program is not that of the proven formula")
    by = Reading(Fraction, {"divide": lambda top, bottom: top / bottom})
    for speed, beta in product((Fraction(3), Fraction(5)), repeat=2):
        if Run(formulas.w_program(), {"speed": speed, "beta": beta}, by)["w"] != beta**5 * speed:
            raise ArithmeticError("w of the program is not beta^5 speed")
    (inverse,) = (statement for statement in own.program if statement.name == "inverse")
    grid = [Fraction(n) for n in range(1, 7)]
    for elastic, lost, speed in product(grid, grid, (Fraction(3), Fraction(5))):
        run = Run((inverse,), {"elastic": elastic, "lost": lost, "speed": speed}, by)
        eps = evaluate(proven.results["epsilon"], run, by)
        for name, value in zip(MEANINGS, (eps, eps * speed, 1 - eps**2), strict=True):
            if evaluate(own.results[name], run, by) != value:
                raise ArithmeticError(f"{name} of the program is not that of the proven formula")


# --- bounds of functions of the speed ---------------------------------------------------------------------------------


def reach(form: Format) -> tuple[Fraction, Fraction]:
    """Return the least and the largest v* for which bounds hold in a type, rounded inwards."""
    low, high = 2.0 ** ((1 - form.largest) / 10), 2.0 ** (LARGEST[form.name] / 10)
    return Fraction(f"{1.01 * low:.3g}"), Fraction(f"{0.99 * high:.3g}")


def _compact_bounds(form: Powers, a: Values, b: Values, error: Fraction, machine: Arithmetic) -> Iterator[ErrorBound]:
    """Yield the bounds in an arithmetic: for all v*, and in type float the smaller ones in `COMMON`.

    There are two for eps. In one, what rounding adds is relative to eps. In the other it is relative to the smaller one
    of eps and 1 - eps, except for the last sum and quotient: the operations before change lost/elastic by a factor
    1 + eta, and so eps by eps (1 - eps) eta. This is below r_0 eps, with the bound r_0 of eps's relative error. From
    the bound r_2 for 1 - eps^2 it is below r_2 (1 - eps^2)/(2 eps), at most 3/2 r_2 (1 - eps) for eps >= 1/2.
    """
    kind = machine.form
    of_loss = error * (1 + error / 2)  # |d eps| (2 eps + |d eps|)/((1 - eps) (1 + eps)), |d eps| <= error smaller
    sizes = compact_rounding(form, a, b, machine)
    unit = Fraction(2) ** -machine.form.precision
    last = (unit + machine.quotient * machine.ulp) * _SECOND_ORDER  # elastic/(elastic + lost)
    for i, (low, high) in enumerate((reach(kind), COMMON) if kind == FLOAT else (reach(kind),)):
        of_eps, of_rebound, of_dissipation = (sizes[name][i] for name in MEANINGS)
        bound = ErrorBound("restitution", low, high, "smaller", error, arithmetic=machine)
        yield replace(bound, last=of_eps * (1 + error))
        # eps speed may be subnormal: half of the smallest number
        yield replace(bound, result="rebound", last=of_rebound * (1 + error), absolute=Fraction(1, 2))
        yield replace(bound, rounding=max(of_eps, Fraction(3, 2) * of_dissipation) * (1 + error), last=last)
        of_rounding = of_dissipation * (1 + of_loss)
        yield ErrorBound("dissipation", low, high, "value", of_loss, of_rounding, arithmetic=machine)


def compact_rounding(form: Powers, a: Values, b: Values, machine: Arithmetic) -> dict[str, tuple[Fraction, ...]]:
    """Bound each function's rounding error, relative to the formula's value, for all w; in float for `COMMON`, too.

    All w are those up to the cut-off where beta^2, beta^4, beta^5 and w as computed are normal. The bound of rebound
    holds where it is a normal number.

    Raises
    ------
    ArithmeticError
        If a sum may vanish, or a power overflow.
    """
    check_formula(form, a, b)
    with working(BITS):
        _check_overflow(form, a, b, machine.form)
        # The speed is exact, and the slope of rebound that at constant speed.
        exact = {"speed": Rounded(arb(1), machine.form)}
        numbers, of_y = constants(form, a, b), partial(_error_of_y, machine)
        on = results_on_parts(body(form), [*MEANINGS], "y", numbers, machine, lambda _: exact, of_y)
        ranges = [_ends(machine.form), *([_COMMON_Y] if machine.form == FLOAT else [])]
        parts = [tuple(_parts(machine.form, *ends)) for ends in ranges]
        return {
            name: tuple(rounded_up(largest_bound(on, each, relative_error(name)), DIGITS) for each in parts)
            for name in MEANINGS
        }


def _error_of_y(machine: Arithmetic, y: arb) -> arb:
    """Bound the error of ln y; the error of w is included.

    Raises
    ------
    ArithmeticError
        If the program's y is not w^(1/ROOT).
    """
    # The logarithms of a host's library may have either base.
    bases = [arb.const_log2(), *([arb(1)] if machine.place == "host" else [])]
    return max(_error_in_base(ln_base, machine, y) for ln_base in bases)


def _error_in_base(ln_base: arb, machine: Arithmetic, exact_y: arb) -> arb:
    ulp, form, library = ball_of(machine.ulp), machine.form, ball_of(machine.functions)
    ends = exact_y.lower(), exact_y.upper()

    def log(w: Rounded) -> Rounded:  # of w = y^ROOT, a wide ball of which might contain 0
        value, of_w = ends[0].log().union(ends[1].log()) * ROOT / ln_base, -(1 - w.relative).log() / ln_base
        size = value.abs_upper() + of_w
        of_call = size * library * ulp + ball_of(machine.log2_absolute)
        return Rounded(value, form).with_absolute_error(of_call + of_w)

    def exp(x: Rounded) -> Rounded:
        return Rounded((x.value * ln_base).exp(), form, (x.absolute * ln_base).exp() - 1).with_error(ulp * library)

    exact = Fraction(1, ROOT)
    of_constant = abs(Fraction(thirtieth(form)) / exact - 1)
    given = {
        "w": Rounded(arb(1), form, ball_of(rounding_of_w(form))),
        "thirtieth": Rounded(ball_of(exact), form, ball_of(of_constant)),
    }
    branch = CodeBranch(None, (), {"y": root_of(Name("w"))})
    y: Rounded = read(branch, ["y"], given, rounded_reading(form, log2=log, exp2=exp))["y"]
    reached = all(y.value.overlaps(end) for end in ends)
    if not (reached and ends[0] * (1 - ball_of(_WIDER)) < y.value < ends[1] * (1 + ball_of(_WIDER))):
        raise ArithmeticError("y of the program is not the root of w")
    return (1 - y.relative).log().abs_upper()


def _ends(form: Format) -> Part:
    """Return the y of the smallest normal w and of the largest, rounded outwards."""
    low, high = (Fraction(2.0 ** (e / ROOT)) for e in (1 - form.largest, LARGEST[form.name]))
    return low * (1 - _TINY), high * (1 + _TINY)


def _parts(form: Format, beginning: Fraction, end: Fraction) -> Iterator[Part]:
    """Yield parts of octaves, from one y to another."""
    for octave in range((1 - form.largest) // ROOT, -(-LARGEST[form.name] // ROOT) + 1):
        octave_start, number = Fraction(2) ** octave, _PARTS[octave >= 0]
        for i in range(number):
            low, high = (octave_start * (1 + Fraction(k, number)) for k in (i, i + 1))
            if low < end and high > beginning:
                yield max(low, beginning), min(high, end)


def _check_overflow(form: Powers, a: Values, b: Values, kind: Format) -> None:
    """Raise an ArithmeticError if a power or a sum may overflow at the cut-off; sums are largest there."""
    y = Fraction(2) ** (-(-LARGEST[kind.name] // ROOT))
    degree = SHIFT + form.bottom[-1] + DEGREES_MORE
    if y**degree * sum(abs(Fraction(c)) for c in (*a, *b)) * 2 >= Fraction(2) ** kind.largest:
        raise ArithmeticError(f"y to the power {degree} may overflow in type {kind.name}")


# --- bounds of functions of v* ----------------------------------------------------------------------------------------


def _half_line_bounds(form: Powers, a: Values, b: Values, error: Fraction, machine: Arithmetic) -> Iterator[ErrorBound]:
    """Yield the bounds of eps and 1 - eps, on the host.

    Beyond 2^largest w may be subnormal. There w^3 underflows to 0, eps comes out as 0 and 1 - eps as 1, and both are
    right to less than the smallest number.
    """
    near, far = half_line_branches(form)
    numbers, kind = constants(form, a, b), machine.form
    with working(BITS):
        unit = arb(2) ** -kind.precision
        of_y, of_u = (
            log_error(powers_error(branch, name, machine, {"v_star": 0})) for branch, name in ((near, "y"), (far, "u"))
        )
        branches = (
            results_on_parts(
                near, OF_V_STAR, "y", numbers, machine, lambda y: {"v_star": Rounded(y**3, kind)}, lambda _: of_y
            ),
            results_on_parts(
                far, OF_V_STAR, "u", numbers, machine, lambda u: {"w": Rounded(u**3, kind, unit)}, lambda _: of_u
            ),
        )
        for name in OF_V_STAR:
            # Both branches have the parts of [0, 1].
            # 1 - eps^2 may be a normal number where 1 - eps is half of the least one.
            of_normal = relative_error(name, ball_of(kind.least) / (1 + (name == OF_V_STAR[1])))
            walks = [(on, refined_bounds(on, parts_to(Fraction(1)), of_normal)) for on in branches]
            size = max(size for _, parts in walks for size, _ in parts)
            underflow = max(on(part)[name].underflow for on, parts in walks for _, part in parts)
            yield ErrorBound(
                name, Fraction(0), math.inf, "smaller", error, last=rounded_up(size, DIGITS) * (1 + error),
                absolute=rounded_up(underflow / ball_of(kind.smallest), DIGITS), arithmetic=machine,
            )  # fmt: skip
