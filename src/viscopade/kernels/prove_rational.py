"""Maker of quotient kernels: from a Padé or best approximant to a kernel with its proof."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import replace
from decimal import Decimal
from fractions import Fraction
from functools import lru_cache
from typing import SupportsIndex, TypeVar

from flint import arb

from viscopade import arguments
from viscopade.approximation import cheapest, machine_coefficients, minimax
from viscopade.approximation.measure import RELATIVE_TO, Measure, measure_of
from viscopade.arithmetic.balls import known_decimal, working
from viscopade.arithmetic.decimals import rounded_up
from viscopade.arithmetic.formats import DOUBLE, FLOAT, FORMATS, Format
from viscopade.collision.exact import Exact
from viscopade.kernels import certificate
from viscopade.kernels.certificate import Certificate
from viscopade.kernels.forms import exact_formulas, rounding_bounds
from viscopade.kernels.forms.exact_formulas import Coefficients
from viscopade.kernels.forms.minimax import MinimaxKernel, MinimaxVariant
from viscopade.kernels.forms.quotient import PadeKernel, threshold
from viscopade.kernels.reference import Reference, reference_of
from viscopade.store import recorded
from viscopade.theory.law import VISCOELASTIC, Law
from viscopade.theory.pade import Pade, Root, pade

DIGITS = 40  # of the coefficients of Padé approximants
USEFUL = tuple(map(Fraction, ("0.5", "1", "2", "5")))  # v* up to which errors of Padé approximants are stated

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


@recorded("of_pade")
def of_pade(m: int, n: int, law: Law = VISCOELASTIC) -> PadeKernel:
    """Return the kernel of a Padé approximant, with bounds on [0, V] for the `USEFUL` V before its first pole or zero.

    Errors as for `pade.pade`.
    """
    approximant = pade(m, n, DIGITS, law)
    bare = without_proof(approximant, law)
    ends = [v for v in USEFUL if bare.end is None or v < Fraction(bare.end[1]) * Fraction(9, 10)]
    bounds = list[Certificate]()
    for end in ends:
        try:
            bounds.append(_certified(*bare.exact, (Fraction(0), end), "both", reference_of(law)))
        except ArithmeticError:  # of high degree, with a pole and a zero that nearly cancel
            break
    return _with_bounds(bare, tuple(bounds)) if bounds else bare


def without_proof(approximant: Pade, law: Law = VISCOELASTIC) -> PadeKernel:
    """Return the kernel of a Padé approximant, with `DIGITS` digits."""
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
    sizes = []
    for form in FORMATS.values():
        end = bounds[-1].high or Fraction(0)
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
    law: Law = VISCOELASTIC,
) -> MinimaxKernel:
    """Return the kernel of the best approximant [m/n]; arguments and errors as for `minimax.fit`."""
    interval, measure = minimax.interval_of(v_star_min, v_star_max, law), measure_of(measure)
    return _of_minimax(*minimax.degrees_of(m, n, law, interval), *interval, measure, law)


@lru_cache(maxsize=256)
def _of_minimax(
    m: int, n: int, low: Fraction, high: Fraction | None, measure: Measure, law: Law = VISCOELASTIC
) -> MinimaxKernel:
    return _with_proofs(minimax.fit(m, n, minimax.INFINITY if high is None else high, low, measure, law=law))


def accurate(
    accuracy: Exact,
    v_star_max: Exact,
    v_star_min: Exact = 0,
    measure: Measure = "both",
    law: Law = VISCOELASTIC,
) -> MinimaxKernel:
    """Return the cheapest kernel whose proven errors (formula and rounding in type double) sum to at most `accuracy`.

    (The former is relative to what `measure` says, the latter to eps.)
    Arguments and errors as for `cheapest.cheapest_fit`.
    """
    wanted = accuracy_of(accuracy)
    return _accurate(wanted, *minimax.interval_of(v_star_min, v_star_max, law), measure_of(measure), law)


@recorded("accurate")
def _accurate(
    wanted: Fraction, low: Fraction, high: Fraction | None, measure: Measure, law: Law = VISCOELASTIC
) -> MinimaxKernel:
    limit = wanted
    end = minimax.INFINITY if high is None else high
    for _ in range(ATTEMPTS):
        chosen = cheapest.cheapest_fit(limit, end, low, measure=measure, law=law)
        kernel = _with_proofs(chosen.fit, wanted)
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
    equal = ", ".join(("a_0 = b_0 = 1", *(f"a_{i} = b_{i}" for i in range(1, fit.law.d))))
    source = f"best approximant with {equal} of the exact eps, in the measure |error|/{RELATIVE_TO[fit.measure]}"
    return MinimaxKernel(fit.m, fit.n, variants, missing, source)


def _variant(fit: minimax.Fit, form: Format) -> MinimaxVariant:
    machine = machine_coefficients.machine(fit, form)
    low, high = fit.interval
    if high is not None:
        _require_horner(fit.label, *machine.exact, form, high)
    bound = _certified(*machine.exact, fit.interval, fit.measure, reference_of(fit.law))
    switch = None if high is not None else Fraction(2) ** threshold(fit.label, *machine.exact, form)
    size = rounding_bounds.quotient_rounding(*machine.exact, form, low, high, switch=switch)
    return MinimaxVariant(form, machine.a, machine.b, bound, _relative_to_eps(size, Fraction(bound.bound)))


def _certified(
    a: Coefficients, b: Coefficients, interval: minimax.Interval, measure: Measure, reference: Reference
) -> Certificate:
    return certificate.prove(exact_formulas.quotient_formula(a, b, reference.law), *interval, measure, reference)


def error_up_to(a: Sequence[arb], b: Sequence[arb], law: Law, v_star_max: Exact) -> str:
    """Return a bound of |N/D - eps|/min(eps, 1 - eps) for 0 <= v* <= v_star_max, as a decimal string.

    Parameters
    ----------
    a, b : sequence of flint.arb
        Coefficients of N and D, ascending in v* = kappa^(1/law.d); a_i = b_i for i < law.d.
    law : Law
        With no attractive force.
    v_star_max : str, int, float, Fraction, Decimal, mpmath.mpf or NumPy scalar
        From 1e-3 to 100.

    Raises
    ------
    TypeError, ValueError
        If v_star_max is no such number, the force of the law is attractive, or nothing was proven up to there, as for
        an N/D with a pole.
    """
    high = arguments.exact_number(
        "v_star_max", v_star_max, "a number from 0.001 to 100", lambda v: Fraction(1, 1000) <= v <= 100
    )
    try:
        return _certified(a, b, (Fraction(0), high), "both", reference_of(law, stored=False)).bound
    except ArithmeticError as error:
        raise ValueError(f"v_star_max is {v_star_max}: {error}; accepted is a smaller number") from None


def _require_horner(label: str, a: Sequence[Fraction], b: Sequence[Fraction], form: Format, end: Fraction) -> None:
    """Raise ValueError if the exported code evaluates something up to v* = end in powers of 1/v*: not proven."""
    if 2 ** threshold(label, a, b, form) < end:
        raise ValueError(f"{label}: sums could overflow in type {form.name} before v* = {float(end):g}")


def _relative_to_eps(size: arb, error: Fraction) -> str:
    """Return a bound relative to the formula's value as one relative to eps, given the relative error of the former."""
    with working(64):
        return rounded_up(size * (1 + arb(error.numerator) / error.denominator), 2)
