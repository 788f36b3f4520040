"""Maker of quotient kernels: from a Padé or best approximant to a kernel with its proof."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from decimal import Decimal
from fractions import Fraction
from typing import SupportsIndex

from flint import arb

from viscopade import arguments
from viscopade.approximation import cheapest, machine_coefficients, minimax
from viscopade.approximation.measure import Measure, measure_of
from viscopade.arithmetic.balls import ball_of, known_decimal, working
from viscopade.arithmetic.decimals import rounded_up
from viscopade.arithmetic.formats import DOUBLE, FLOAT, FORMATS, Format
from viscopade.collision.exact import Exact
from viscopade.kernels import certificate, prove_law
from viscopade.kernels.certificate import Certificate
from viscopade.kernels.forms import exact_formulas, rounding_bounds
from viscopade.kernels.forms.minimax import Derivative, MinimaxKernel, MinimaxVariant
from viscopade.kernels.forms.quotient import PadeKernel, threshold
from viscopade.store import recorded
from viscopade.theory.law import VISCOELASTIC, Law
from viscopade.theory.pade import Pade, Root, pade

DIGITS = 40  # of the coefficients of Padé approximants
USEFUL = tuple(map(Fraction, ("0.5", "1", "2", "5")))  # v* up to which errors of Padé approximants are stated

LEAST, MOST = Fraction("1e-15"), Fraction("0.99")
ATTEMPTS = 8
LOOSER = 2  # a float's bound may exceed that of the double by this factor

# Plain ASCII: it stands in source files that compilers with other character sets read.
PADE_SOURCE = (
    "Pade approximant (eq:padeDef) of the exact series (eq:epsSeriesAdvanced), derived from the equation of "
    f"motion; coefficients proven to {DIGITS} digits"
)
RELATIVE_TO = {"both": "min(eps, 1 - eps)", "relative": "eps"}


@recorded
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
            bounds.append(_certified(*bare.exact, (Fraction(0), end), "both", law))
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


@recorded
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
    wanted = arguments.exact_number("accuracy", accuracy, "a number from 1e-15 to 0.99", lambda x: LEAST <= x <= MOST)
    return _accurate(wanted, *minimax.interval_of(v_star_min, v_star_max, law), measure_of(measure), law)


@recorded
def _accurate(
    wanted: Fraction, low: Fraction, high: Fraction | None, measure: Measure, law: Law = VISCOELASTIC
) -> MinimaxKernel:
    limit = wanted
    end = minimax.INFINITY if high is None else high
    for _ in range(ATTEMPTS):
        chosen = cheapest.cheapest_fit(limit, end, low, measure=measure, law=law)
        kernel = _with_proofs(chosen.fit, wanted)
        error = _total(kernel.variants[0])
        if error <= wanted:
            return kernel
        limit = min(limit, Fraction(chosen.error)) * min(wanted / error, Fraction(99, 100))
    raise ArithmeticError(f"no kernel was proven to be as accurate as {float(wanted):g}")


def _total(variant: MinimaxVariant) -> Fraction:
    return Fraction(variant.certificate.bound) + Fraction(variant.rounding)


def _with_proofs(fit: minimax.Fit, limit: Fraction | None = None) -> MinimaxKernel:
    """Return the kernel, with a variant of type float if that is about as accurate, or within the limit."""
    variants = [_variant(fit, DOUBLE)]
    allowed = limit or LOOSER * Fraction(variants[0].certificate.bound)
    missing = []
    try:
        variant = _variant(fit, FLOAT)
        error = Fraction(variant.certificate.bound) if limit is None else _total(variant)
        if error > allowed:
            raise ValueError(f"the error would be {float(error):.3g}")
        variants.append(variant)
    except (ValueError, ArithmeticError) as error:
        missing.append((FLOAT.name, str(error)))
    equal = ", ".join(("a_0 = b_0 = 1", *(f"a_{i} = b_{i}" for i in range(1, fit.law.d))))
    source = f"best approximant with {equal} of the exact eps, in the measure |error|/{RELATIVE_TO[fit.measure]}"
    return MinimaxKernel(fit.m, fit.n, tuple(variants), tuple(missing), source)


def _variant(fit: minimax.Fit, form: Format) -> MinimaxVariant:
    machine = machine_coefficients.machine(fit, form)
    low, high = fit.interval
    if high is not None:
        _require_horner(fit.label, *machine.exact, form, high)
    bound = _certified(*machine.exact, fit.interval, fit.measure, fit.law)
    switch = None if high is not None else Fraction(2) ** threshold(fit.label, *machine.exact, form)
    size = rounding_bounds.quotient_rounding(*machine.exact, form, low, high, switch=switch)
    slope = _derivative(machine, form, (low, high)) if high is not None and fit.law == VISCOELASTIC else None
    return MinimaxVariant(form, machine.a, machine.b, bound, _relative_to_eps(size, Fraction(bound.bound)), slope)


def _certified(
    a: Sequence[Fraction], b: Sequence[Fraction], interval: minimax.Interval, measure: Measure, law: Law
) -> Certificate:
    """Return the proof by the table of panels for the paper's law, and by panels made anew for any other."""
    low, high = interval
    if law == VISCOELASTIC and high is not None:
        return certificate.prove(exact_formulas.quotient_formula(a, b), low, high, measure)
    with working(prove_law.BITS):
        top, bottom = ([ball_of(c) for c in values] for values in (a, b))
        return prove_law.prove_by_panels(top, bottom, law, *interval, measure)


def _derivative(
    machine: machine_coefficients.MachineFit, form: Format, interval: tuple[Fraction, Fraction]
) -> Derivative | None:
    """Return the derivative with its proof; None if it cannot be proven, or not be held by the format."""
    _, b = machine.exact
    try:
        t = tuple(form.nearest(c) for c in exact_formulas.slope_numerator(*machine.exact))
        rounded = tuple(map(Fraction, t))
        bound = certificate.prove_derivative(exact_formulas.derivative_formula(rounded, b), *interval)
        size = rounding_bounds.derivative_rounding(rounded, b, form, *interval)
    except (ArithmeticError, ValueError):
        return None
    return Derivative(t, bound, _relative_to_eps(size, Fraction(bound.bound)))


def _require_horner(label: str, a: Sequence[Fraction], b: Sequence[Fraction], form: Format, end: Fraction) -> None:
    """Raise ValueError if the exported code evaluates something up to v* = end in powers of 1/v*: not proven."""
    if 2 ** threshold(label, a, b, form) < end:
        raise ValueError(f"{label}: sums could overflow in type {form.name} before v* = {float(end):g}")


def _relative_to_eps(size: arb, error: Fraction) -> str:
    """Return a bound relative to the formula's value as one relative to eps, given the relative error of the former."""
    with working(64):
        return rounded_up(size * (1 + arb(error.numerator) / error.denominator), 2)
