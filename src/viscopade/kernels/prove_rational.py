"""Maker of quotient kernels: from a Padé or best approximant to a kernel with its proof."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import replace
from decimal import Decimal
from fractions import Fraction
from functools import lru_cache
from typing import SupportsIndex, TypeVar

from flint import arb, arb_poly

from viscopade import arguments
from viscopade.approximation import cheapest, machine_coefficients, minimax
from viscopade.approximation.measure import RELATIVE_TO, Measure, measure_of
from viscopade.arithmetic.balls import ball_of, bits_for, known_decimal, working
from viscopade.arithmetic.decimals import at_most, below, rounded_up
from viscopade.arithmetic.formats import DOUBLE, FLOAT, FORMATS, Format
from viscopade.collision import exact
from viscopade.collision.exact import Exact
from viscopade.kernels import certificate, rounding_bounds
from viscopade.kernels.certificate import Certificate
from viscopade.kernels.forms import exact_formulas
from viscopade.kernels.forms.exact_formulas import Coefficients
from viscopade.kernels.forms.minimax import MinimaxKernel, MinimaxVariant
from viscopade.kernels.forms.quotient import PadeKernel, threshold
from viscopade.progress import track
from viscopade.store import recorded
from viscopade.theory.law import VISCOELASTIC, Law
from viscopade.theory.pade import Pade, Root, pade

DIGITS = 40  # of the coefficients of Padé approximants
USEFUL = tuple(map(Fraction, ("0.5", "1", "2", "5")))  # v* up to which errors of Padé approximants are stated

SAMPLES, SAMPLE_DIGITS = 8, 30  # of sampled errors

ATTEMPTS = 8
LOOSER = 2  # a float's bound may exceed that of the double by this factor

# Plain ASCII: it stands in source files that compilers with other character sets read.
PADE_SOURCE = (
    "Pade approximant (eq:padeDef) of the exact series (eq:epsSeriesAdvanced), derived from the equation of "
    f"motion; coefficients proven to {DIGITS} digits"
)

Variant = TypeVar("Variant")


def accuracy_of(accuracy: Exact, name: str = "accuracy") -> Fraction:
    """Return an accuracy asked for, by its name in a refusal; accepted is a number from 1e-15 to 0.99."""
    least, most = Fraction("1e-15"), Fraction("0.99")
    return arguments.exact_number(name, accuracy, "a number from 1e-15 to 0.99", lambda x: least <= x <= most)


def in_types(
    make: Callable[[Format], Variant],
    error_of: Callable[[Variant], Fraction],
    reason: Callable[[Fraction], str],
    limit: Fraction | None = None,
) -> tuple[tuple[Variant, ...], tuple[tuple[str, str], ...]]:
    """Return a kernel's variants in type double and float, and the reason for one that is missing.

    The one in type float is left out if its error exceeds the limit, or else the error in type double by far.
    """
    first = make(DOUBLE)
    try:
        second = make(FLOAT)
        if error_of(second) > (limit or LOOSER * error_of(first)):
            raise ValueError(reason(error_of(second)))
    except (ValueError, ArithmeticError) as error:
        return (first,), ((FLOAT.name, str(error)),)
    return (first, second), ()


@recorded("pade_kernel")
def of_pade(m: int, n: int) -> PadeKernel:
    """Return the kernel of a Padé approximant, with bounds on [0, V] for the `USEFUL` V before its first pole or zero.

    Errors as for `pade.pade`.
    """
    bare = without_proof(pade(m, n, DIGITS))
    bounds = list[Certificate]()
    for end in _useful_ends(None if bare.end is None else Fraction(bare.end[1])):
        try:
            bounds.append(_certified(*bare.exact, (Fraction(0), end), "both"))
        except ArithmeticError:  # of high degree, with a pole and a zero that nearly cancel
            break
    return _with_bounds(bare, tuple(bounds)) if bounds else bare


@lru_cache(maxsize=32)
def sampled_pade(m: int, n: int, law: Law) -> PadeKernel:
    """Return the kernel of a Padé approximant of another law, with sampled errors; arguments as for `pade.pade`."""
    approximant = pade(m, n, DIGITS, law)
    return replace(without_proof(approximant, law), sampled=sampled_errors(approximant, law))


def _useful_ends(first: Fraction | None) -> list[Fraction]:
    """Return the `USEFUL` v* before the first pole or zero."""
    return [v for v in USEFUL if first is None or v < first * Fraction(9, 10)]


def without_proof(approximant: Pade, law: Law = VISCOELASTIC) -> PadeKernel:
    """Return the kernel of a Padé approximant with `DIGITS` digits, without errors."""
    a, b = (tuple(map(Decimal, values)) for values in approximant.decimals(DIGITS))
    # The exporters state [m/n] - eps at order m + n + 1, whether or not the approximant does better.
    better = approximant.contact_order > approximant.m + approximant.n
    return PadeKernel(
        m=approximant.m,
        n=approximant.n,
        a=a,
        b=b,
        next_term=Decimal(0 if better else known_decimal(-approximant.next_term, 10)),
        pole=_first_positive(approximant.poles),
        zero=_first_positive(approximant.zeros),
        source=PADE_SOURCE,
        law=law,
    )


def _first_positive(roots: Sequence[Root]) -> Decimal | None:
    """Return the first of the roots, ordered by size, that is proven to be real and positive."""
    root = next((root for root in roots if root.positive), None)
    return None if root is None else Decimal(root.decimals(DIGITS)[0])


def _with_bounds(bare: PadeKernel, bounds: tuple[Certificate, ...]) -> PadeKernel:
    """Return the kernel with bounds, and those of rounding in each format that holds its coefficients."""
    sizes, end = [], Fraction(bounds[-1].high)
    for form in FORMATS.values():
        try:
            bare.rounded(form)
            _require_horner(bare.label, *bare.exact, form, end)
        except ValueError:
            continue
        size = rounding_bounds.quotient_rounding(*bare.exact, form, Fraction(0), end, coefficients=True)
        sizes.append((form.name, _relative_to_eps(size, max(Fraction(bound.bound) for bound in bounds))))
    return replace(bare, bounds=bounds, rounding=tuple(sizes))


def of_minimax(
    m: SupportsIndex,
    n: SupportsIndex,
    v_star_max: Exact,
    v_star_min: Exact = 0,
    measure: Measure = "both",
) -> MinimaxKernel:
    """Return the kernel of the best approximant [m/n]; arguments and errors as for `minimax.fit`."""
    interval, measure = minimax.interval_of(v_star_min, v_star_max), measure_of(measure)
    return _of_minimax(*minimax.degrees_of(m, n), *interval, measure)


@lru_cache(maxsize=256)
def _of_minimax(m: int, n: int, low: Fraction, high: Fraction, measure: Measure) -> MinimaxKernel:
    return _with_proofs(minimax.fit(m, n, high, low, measure))


def accurate(
    accuracy: Exact,
    v_star_max: Exact,
    v_star_min: Exact = 0,
    measure: Measure = "both",
) -> MinimaxKernel:
    """Return the cheapest kernel whose proven errors (formula and rounding in type double) sum to at most `accuracy`.

    (The former is relative to what `measure` says, the latter to eps.)
    Arguments and errors as for `cheapest.cheapest_fit`.
    """
    wanted = accuracy_of(accuracy)
    return _accurate(wanted, *minimax.interval_of(v_star_min, v_star_max), measure_of(measure))


@recorded("minimax_kernel")
def _accurate(wanted: Fraction, low: Fraction, high: Fraction, measure: Measure) -> MinimaxKernel:
    limit = wanted
    for _ in range(ATTEMPTS):
        chosen = cheapest.cheapest_fit(limit, high, low, measure=measure)
        kernel = replace(_with_proofs(chosen.fit, wanted), accuracy=wanted)
        error = kernel.variants[0].total
        if error <= wanted:
            return kernel
        limit = min(limit, Fraction(chosen.error)) * min(wanted / error, Fraction(99, 100))
    raise ArithmeticError(f"no kernel was proven to be as accurate as {float(wanted):g}")


def _with_proofs(fit: minimax.Fit, limit: Fraction | None = None) -> MinimaxKernel:
    """Return the kernel, with a variant of type float if that is about as accurate, or within the limit."""
    variants, missing = in_types(
        lambda form: _variant(fit, form),
        lambda variant: variant.total if limit else variant.error,
        lambda error: f"the error would be {float(error):.3g}",
        limit,
    )
    relative_to = RELATIVE_TO[fit.measure]
    source = f"best approximant with a_0 = b_0 = 1, a_1 = b_1 of the exact eps, in the measure |error|/{relative_to}"
    return MinimaxKernel(fit.m, fit.n, variants, missing, source)


def _variant(fit: minimax.Fit, form: Format) -> MinimaxVariant:
    machine = machine_coefficients.machine(fit, form)
    _require_horner(fit.label, *machine.exact, form, fit.interval[1])
    bound = _certified(*machine.exact, fit.interval, fit.measure)
    size = rounding_bounds.quotient_rounding(*machine.exact, form, *fit.interval)
    return MinimaxVariant(form, machine.a, machine.b, bound, _relative_to_eps(size, Fraction(bound.bound)))


def _certified(a: Coefficients, b: Coefficients, interval: minimax.Interval, measure: Measure) -> Certificate:
    return certificate.prove(exact_formulas.quotient_formula(a, b), *interval, measure)


def error_up_to(a: Sequence[arb], b: Sequence[arb], v_star_max: Exact) -> str:
    """Return a bound of |N/D - eps|/min(eps, 1 - eps) for 0 <= v* <= v_star_max, as a decimal string.

    Parameters
    ----------
    a, b : sequence of flint.arb
        Coefficients of N and D, ascending in v*; a_0 = b_0 and a_1 = b_1.
    v_star_max : str, int, float, Fraction, Decimal, mpmath.mpf or NumPy scalar
        From 1e-3 to 100.

    Raises
    ------
    TypeError, ValueError
        If v_star_max is no such number, or nothing was proven up to there, as for an N/D with a pole.
    """
    try:
        return at_most(_certified(a, b, (Fraction(0), _end_of_interval(v_star_max)), "both").bound)
    except ArithmeticError as error:
        raise ValueError(f"v_star_max is {v_star_max}: {error}; accepted is a smaller number") from None


def _end_of_interval(v_star_max: Exact) -> Fraction:
    """Return the end of an interval of v* exactly, from 1e-3 to 100; errors as for `error_up_to`."""
    return arguments.exact_number(
        "v_star_max", v_star_max, "a number from 0.001 to 100", lambda v: Fraction(1, 1000) <= v <= 100
    )


def sampled_errors(approximant: Pade, law: Law, v_star_max: Exact = None) -> tuple[tuple[str, str], ...]:
    """Return ends V of intervals, and the largest error found for 0 < v* <= V, relative to min(eps, 1 - eps).

    Parameters
    ----------
    approximant : Pade
        Of a law; v* = kappa^(1/law.d).
    law : Law
    v_star_max : like that of `error_up_to`, or None
        The only end. None: the `USEFUL` ones before the first pole or zero, as far as contact ends there.

    Raises
    ------
    TypeError, ValueError
        If v_star_max is no such number, or contact does not end there.
    """
    if v_star_max is None:
        roots = (*approximant.poles, *approximant.zeros)
        positive = [Fraction(root.decimals(min(approximant.digits, 10))[0]) for root in roots if root.positive]
        ends = _useful_ends(min(positive, default=None))
    else:
        ends = [_end_of_interval(v_star_max)]
    a, b = (arb_poly(list(coefficients)) for coefficients in (approximant.a, approximant.b))
    found, most, last = list[tuple[str, str]](), arb(0), Fraction(0)
    for end in ends:
        points = SAMPLES * len(USEFUL) // len(ends)
        for i in track(range(points), "samples of the error"):
            v_star = last + (end - last) * Fraction(i + 1, points)
            try:
                true = exact.collision(v_star, SAMPLE_DIGITS, law=law)
            except ValueError:  # contact does not end with so much damping
                if v_star_max is not None:
                    raise
                return tuple(found)
            with working(bits_for(SAMPLE_DIGITS) + 64):
                off = abs(a(ball_of(v_star)) / b(ball_of(v_star)) - true.epsilon)
                most = most.max((off / true.epsilon.min(true.one_minus_epsilon)).abs_upper())
        found.append((below(end), at_most(rounded_up(most))))
        last = end
    return tuple(found)


def _require_horner(label: str, a: Sequence[Fraction], b: Sequence[Fraction], form: Format, end: Fraction) -> None:
    """Raise ValueError if the exported code evaluates something up to v* = end in powers of 1/v*: not proven."""
    if 2 ** threshold(label, a, b, form) < end:
        raise ValueError(f"{label}: sums could overflow in type {form.name} before v* = {float(end):g}")


def _relative_to_eps(size: arb, error: Fraction) -> str:
    """Return a bound relative to the formula's value as one relative to eps, given the relative error of the former."""
    with working(64):
        return at_most(rounded_up(size * (1 + arb(error.numerator) / error.denominator), 2))
