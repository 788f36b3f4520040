"""Maker of lacunary and speed kernels: from a fit or a table to a kernel with its proof."""

from __future__ import annotations

import math
from collections.abc import Callable, Iterable, Iterator
from contextlib import suppress
from dataclasses import replace
from fractions import Fraction
from operator import itemgetter

from viscopade import arguments
from viscopade.approximation import half_line, inverse, remez
from viscopade.approximation.half_line import BEST
from viscopade.approximation.lacunary import LacunaryQuotient, Powers, full_powers
from viscopade.approximation.lawson import LacunaryFit
from viscopade.approximation.measure import RELATIVE_TO, Measure, measure_of
from viscopade.arithmetic.decimals import at_most
from viscopade.arithmetic.formats import DOUBLE, Format
from viscopade.collision.exact import Exact
from viscopade.kernels import certificate, rounding_bounds
from viscopade.kernels.certificate import Certificate
from viscopade.kernels.forms import exact_formulas
from viscopade.kernels.forms.lacunary_kernels import HalfLineKernel, InverseKernel, LacunaryVariant, interval_start
from viscopade.kernels.prove_rational import accuracy_of, in_types
from viscopade.kernels.rounding_bounds import Size, Values
from viscopade.store import recorded

INVERSE_ACCURACY = "accuracy of the inverse"  # in refusals
EPSILON_MIN = Fraction(1, 5000), Fraction(99, 100)
FARTHEST = 2  # |m - n| of the degrees on [epsilon_min, 1] that are tried
HOPELESS = 20  # of the degrees with one sum, the best is not better than the most equal ones by this factor (sampled)


def half_line_kernel(accuracy: Exact, measure: Measure = "both") -> HalfLineKernel:
    """Return the kernel for all v* >= 0 with the fewest coefficients and a proven error within the accuracy.

    Parameters
    ----------
    accuracy : str, int, float, Fraction, Decimal, mpmath.mpf or NumPy scalar
        From 1e-15 to 0.99, for type double and with rounding.
    measure : "both" or "relative"
        What the error is relative to: the smaller of eps and 1 - eps, or eps.

    Raises
    ------
    TypeError, ValueError
        If an argument is not accepted, or none of the known kernels is accurate enough.
    """
    wanted = accuracy_of(accuracy)
    return replace(of_half_line(_half_line_powers(wanted, measure_of(measure)), measure), accuracy=wanted)


@recorded("half_line_powers")
def _half_line_powers(wanted: Fraction, measure: Measure) -> Powers:
    candidates = _levelled(BEST[measure], lambda powers: half_line.fit_half_line(powers, measure))
    return _first(wanted, candidates, lambda powers: of_half_line(powers, measure))


@recorded("half_line_kernel")
def of_half_line(powers: Powers, measure: Measure) -> HalfLineKernel:
    """Return the best kernel for all v* >= 0 with given powers of v*^(1/3); errors as for `half_line.fit_half_line`."""
    quotient = half_line.fit_half_line(powers, measure).quotient
    variants, missing = _variants(
        quotient,
        lambda q: certificate.prove(exact_formulas.half_line_formula(q), Fraction(0), math.inf, measure),
        lambda a, b, form: rounding_bounds.half_line_sizes(powers, a, b, form),
    )
    found = f"best N/D found in the measure |error|/{RELATIVE_TO[measure]} over all v* >= 0, with these powers of y"
    return HalfLineKernel(powers, variants, missing, found, None)


def inverse_kernel(accuracy: Exact, epsilon_min: Exact = 0) -> InverseKernel:
    """Return the kernel for v*(eps) with the fewest coefficients and a proven error within the accuracy.

    Parameters
    ----------
    accuracy : str, int, float, Fraction, Decimal, mpmath.mpf or NumPy scalar
        Relative error of v*, from 1e-15 to 0.99, for type double and with rounding.
    epsilon_min : like accuracy
        0 for all 0 < eps <= 1, or from 2e-4 to 0.99 for a kernel on [epsilon_min, 1]. For such ones the degrees m and
        n of numerator and denominator are tried that differ by at most `FARTHEST`.

    Raises
    ------
    TypeError, ValueError
        If an argument is not accepted, or no kernel is accurate enough.
    """
    wanted = accuracy_of(accuracy, INVERSE_ACCURACY)
    least, most = EPSILON_MIN
    low = arguments.exact_number(
        "epsilon_min", epsilon_min, "0, or a number from 2e-4 to 0.99", lambda e: e == 0 or least <= e <= most
    )
    return replace(of_inverse(_inverse_powers(wanted, low), low), accuracy=wanted)


@recorded("inverse_powers")
def _inverse_powers(wanted: Fraction, epsilon_min: Fraction = Fraction(0)) -> Powers:
    whole = _levelled(inverse.WHOLE, inverse.fit_whole)
    candidates = _on_interval(wanted, epsilon_min) if epsilon_min else whole
    return _first(wanted, candidates, lambda powers: of_inverse(powers, epsilon_min), INVERSE_ACCURACY)


@recorded("inverse_kernel")
def of_inverse(powers: Powers, epsilon_min: Fraction = Fraction(0)) -> InverseKernel:
    """Return the best kernel for epsilon_min <= eps <= 1 with given powers, all up to their degrees if epsilon_min > 0.

    Errors as for `inverse.fit_whole` and `inverse.fit_interval`.
    """
    low = interval_start(epsilon_min)
    form = inverse.INTERVAL_FORM if low else inverse.WHOLE_FORM
    fit = inverse.fit_interval(powers.m, powers.n, low) if low else inverse.fit_whole(powers)
    variants, missing = _variants(
        fit.quotient,
        lambda q: certificate.prove_inverse(exact_formulas.inverse_formula(q, form), low),
        lambda a, b, kind: rounding_bounds.inverse_sizes(powers, form, low, a, b, kind),
    )
    return InverseKernel(powers, variants, missing, "best N/D in the relative error of v*", None, epsilon_min)


def _first(
    wanted: Fraction,
    candidates: Iterable[tuple[float, Powers]],
    make: Callable[[Powers], HalfLineKernel | InverseKernel],
    name: str = "accuracy",
) -> Powers:
    """Return the first powers whose kernel is proven to be accurate enough, rounding in type double included.

    Candidates come with their sampled errors, from which those that cannot be accurate enough are known.
    """
    best, missed = Fraction(1), []
    for error, choice in candidates:
        if error > wanted:
            missed.append((error, choice))
            continue
        total = _total(make, choice)
        if total <= wanted:
            return choice
        best = min(best, total)
    for error, choice in sorted(missed, key=itemgetter(0)):  # the nearest miss that has a proof, for the message
        if best < 1 or error >= best:
            break
        best = min(best, _total(make, choice))
    raise ValueError(
        f"{name} is {float(wanted):g}: accepted is a number >= {at_most(best)}, which the best kernel known reaches"
    )


def _total(make: Callable[[Powers], HalfLineKernel | InverseKernel], powers: Powers) -> Fraction:
    """Return the proven error of the kernel with given powers in type double, with rounding; 1 without a proof."""
    with suppress(ArithmeticError):
        kernel = make(powers)
        return kernel.variant(DOUBLE).total(kernel.checked)
    return Fraction(1)


def _levelled(choices: Iterable[Powers], fit: Callable[[Powers], LacunaryFit]) -> Iterator[tuple[float, Powers]]:
    """Yield the sampled errors of the choices that have a best quotient, and the choices."""
    for powers in choices:
        with suppress(remez.NoBest):
            yield fit(powers).error, powers


def _on_interval(wanted: Fraction, epsilon_min: Fraction) -> Iterator[tuple[float, Powers]]:
    """Yield the sampled errors and powers on [epsilon_min, 1], those with fewest coefficients and least error first.

    Degrees are left out where the most equal ones with the same sum are not accurate enough by far.
    """
    low = interval_start(epsilon_min)
    for total in range(2 * inverse.MAX_DEGREE + 1):
        degrees = [(m, total - m) for m in range(total + 1) if abs(total - 2 * m) <= FARTHEST]
        degrees.sort(key=lambda pair: (abs(pair[1] - pair[0]), pair))
        allowed = (full_powers(m, n) for m, n in degrees if max(m, n) <= inverse.MAX_DEGREE)
        found: list[tuple[float, Powers]] = []
        for candidate in _levelled(allowed, lambda powers: inverse.fit_interval(powers.m, powers.n, low)):
            found.append(candidate)
            if min(found, key=itemgetter(0))[0] > HOPELESS * wanted:
                break
        yield from sorted(found, key=itemgetter(0))


def _variants(
    quotient: LacunaryQuotient,
    prove: Callable[[LacunaryQuotient], Certificate],
    sizes: Callable[[Values, Values, Format], dict[str, Size]],
) -> tuple[tuple[LacunaryVariant, ...], tuple[tuple[str, str], ...]]:
    """Return the kernel in its types, given the proof of a quotient and the bounds of its roundings."""

    def variant(form: Format) -> LacunaryVariant:
        a, b = (tuple(map(form.nearest, part)) for part in (quotient.a, quotient.b))
        rounded = LacunaryQuotient(quotient.powers, tuple(map(Fraction, a)), tuple(map(Fraction, b)))
        return LacunaryVariant(form, a, b, prove(rounded), tuple(sizes(a, b, form).items()))

    return in_types(
        variant,
        lambda v: v.error,
        lambda error: f"with coefficients of that type the error would be {at_most(error)}",
    )
