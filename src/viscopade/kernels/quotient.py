"""Quotient kernels [m/n]: rational approximants eps = N/D of v*, Padé and best ones, with proofs.

A quotient is evaluated by Horner's rule in v*, and beyond a threshold, where a sum might overflow, in u = 1/v*.
"""

from __future__ import annotations

import math
from bisect import bisect_left
from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
from contextlib import suppress
from dataclasses import dataclass, replace
from decimal import ROUND_FLOOR, Context, Decimal
from fractions import Fraction
from functools import lru_cache
from typing import NamedTuple, SupportsIndex, TypeVar

from flint import arb, arb_poly

from viscopade import arguments
from viscopade.approximation import cheapest, minimax
from viscopade.arithmetic.balls import ball_of, bits_for, known_decimal, magnitude, working
from viscopade.arithmetic.decimals import above, at_most, below, identifier, rounded_up
from viscopade.arithmetic.formats import DOUBLE, FORMATS, Format, float_text
from viscopade.collision import exact
from viscopade.collision.exact import Exact
from viscopade.kernels import certificate, formulas
from viscopade.kernels.arithmetic import Arithmetic
from viscopade.kernels.bound import ErrorBound
from viscopade.kernels.certificate import Certificate
from viscopade.kernels.coefficients import (
    ProvenQuotient,
    accuracy_name,
    bounds_on_machines,
    checked_accuracy,
    proven_quotient,
)
from viscopade.kernels.enclosure import Formula
from viscopade.kernels.expressions import CodeBranch, Expression, Name, both
from viscopade.kernels.formulas import ZERO, within
from viscopade.kernels.kernel import Function, Kernel
from viscopade.kernels.rounding_bounds import (
    BITS,
    DIGITS,
    Part,
    RoundedResults,
    largest_bound,
    parts_from,
    relative_error,
    results_on_parts,
)
from viscopade.kernels.v_star import JustBeyond, eps_error_from_v_star, restitution_function, speed_bounds
from viscopade.progress import track
from viscopade.store import recorded
from viscopade.theory.law import Law
from viscopade.theory.pade import Pade, Root
from viscopade.theory.pade import pade as pade_of

PADE_DIGITS = 40
"""Significant digits of the coefficients: chosen by hand, far more than the 17 of doubles, for files of any type."""
STEEPEST = Fraction(10, 3)
"""|d ln eps/d ln v*| tends to this number, as eps goes like v*^(-10/3); `panel_proof.steepest` is at least as large."""
USEFUL = tuple(map(Fraction, ("0.5", "1", "2", "5")))
"""v* up to which errors of Padé approximants are stated: there eps is 0.76, 0.39, 0.093 and 0.0059."""

# Sampled errors: points in each of the four intervals between `USEFUL` v*, and digits of the exact eps there. Chosen by
# hand: such an error only shows a size, and errors of Padé approximants grow with v*, so that the end is what counts.
_SAMPLES, _SAMPLE_DIGITS = 8, 30
# Fits to make before giving up on an accuracy; the first one was enough for all of eight accuracies tried.
_ATTEMPTS = 8
# How far, in powers of two, sums in Horner's rule stay below the largest number. It leaves room for rounding, which a
# factor of 2 would do. It also makes the quotient of two such sums a normal number: with a numerator of 1 it is at
# least 2^(8 - largest exponent), and normal numbers begin at 2^(1 - largest exponent).
_HEADROOM = 8
# What is left of the terms at a pole or zero, over the sum of their sizes: the root may come from more digits than its
# record has, or fewer; a root of another polynomial leaves far more.
_ROOT_TOLERANCE = Fraction(1, 10**12)

# Plain ASCII: it stands in source files that compilers with other character sets read.
PADE_SOURCE = (
    "Pade approximant (the paper's Eq. 11) of the exact series (the paper's Eq. 7), derived from the equation of "
    f"motion; coefficients proven to {PADE_DIGITS} digits"
)

Number = TypeVar("Number", float, Fraction)
ExactCoefficients = Sequence[Fraction | arb]
"""Coefficients in ascending order, exactly or enclosed."""


# --- Padé approximants ------------------------------------------------------------------------------------------------


class DomainEnd(NamedTuple):
    """The end of the v* for which a formula is a coefficient of restitution."""

    kind: str
    """"pole" or "zero"."""
    v_star: Decimal


@dataclass(frozen=True)
class ProvenPade:
    """A Padé approximant (a_0 + … + a_m v*^m)/(b_0 + … + b_n v*^n), the paper's Eq. 11, with what is proven: a record.

    Attributes
    ----------
    a, b : tuple of Decimal
        Coefficients in ascending order; a_0 = b_0 = 1. (Leading ones may be zero.)
    next_term : Decimal
        c in [m/n](v*) - eps(v*) = c v*^(m+n+1) + … .
    pole, zero : Decimal or None
        The smallest positive ones; None if there are none.
    certificates : tuple of Certificate
        The certificates of the exact formula.
    bounds : tuple of ErrorBound
        The bounds of eps from v* and from the speed, with rounding, also of the coefficients, in each format that holds
        them.

    Raises
    ------
    ValueError
        If a_0, b_0, `pole` or `zero` contradict the rest, or a number is not finite. (That there is no smaller pole or
        zero is not looked into: `theory.pade` proves it.)
    """

    a: tuple[Decimal, ...]
    b: tuple[Decimal, ...]
    next_term: Decimal
    pole: Decimal | None
    zero: Decimal | None
    certificates: tuple[Certificate, ...] = ()
    bounds: tuple[ErrorBound, ...] = ()

    def __post_init__(self) -> None:
        """Refuse numbers that contradict each other, as in a record that was changed by hand."""
        for number in (*self.a, *self.b, self.next_term):
            if not number.is_finite():
                raise ValueError(f"{self.label}: {number} is not a finite number")
        # The zero is a root of the numerator, with the coefficients a, and the pole one of the denominator.
        for kind, root, side in zip(("zero", "pole"), (self.zero, self.pole), self.reduced, strict=True):
            if side[0] != 1:
                raise ValueError(f"{self.label}: a_0 and b_0 must be 1, not {side[0]}")
            if root is None:
                # From 1 at v* = 0 to -infinity: a polynomial with a negative leading coefficient has a positive root.
                if side[-1] < 0:
                    raise ValueError(f"{self.label} has a positive {kind}, but {kind} is None")
                continue
            terms = [c * Fraction(root) ** i for i, c in enumerate(side)]
            if root <= 0 or abs(sum(terms, Fraction(0))) > _ROOT_TOLERANCE * sum(map(abs, terms), Fraction(0)):
                raise ValueError(f"{self.label} has no positive {kind} at v* = {root}")

    @property
    def label(self) -> str:
        """The paper's name, "[3/6]"."""
        return f"[{len(self.a) - 1}/{len(self.b) - 1}]"

    @property
    def reduced(self) -> tuple[tuple[Fraction, ...], tuple[Fraction, ...]]:
        """The exact a and b without leading ones that are zero ([0/3] has b_3 = 0)."""
        a, b = (without_leading_zeros([*map(Fraction, values)]) for values in (self.a, self.b))
        return a, b

    @property
    def end(self) -> DomainEnd | None:
        """The upper end of the domain, the first pole or zero; None if the domain has no end."""
        roots = ("pole", self.pole), ("zero", self.zero)
        ends = [DomainEnd(kind, v_star) for kind, v_star in roots if v_star is not None]
        return min(ends, key=lambda end: end.v_star, default=None)

    @property
    def domain(self) -> str:
        """The values of v* for which the formula is a coefficient of restitution, as a sentence's part."""
        if self.end is None:
            # With m < n the formula tends to 0 for large v*, as eps does.
            a, b = self.reduced
            remark = "no positive pole and no positive zero" if len(a) < len(b) else "but it does not tend to 0"
            return f"all v* >= 0 ({remark})"
        # Ten digits for the reader, rounded down, so that the text does not promise more than the code accepts.
        v_star = Context(prec=10, rounding=ROUND_FLOOR).create_decimal(self.end.v_star)
        return f"0 <= v* < {v_star} (there the formula has a {self.end.kind})"

    @property
    def error(self) -> str:
        """The error by the Padé property, [m/n] - eps = c v*^(m + n + 1) + …, as part of a sentence."""
        # m + n + 1, from m + 1 and n + 1 coefficients; c = `next_term` is 0 if the approximant agrees to more orders.
        order, deviation = len(self.a) + len(self.b) - 1, Fraction(self.next_term)
        if not deviation:
            return f"{self.label} = eps + O(v*^{order + 1}) as v* -> 0 (agreement to order v*^{order})"
        size = f"{'-' if deviation < 0 else '+'} {float_text(abs(deviation))} v*^{order}"
        return f"{self.label} = eps {size} + ... as v* -> 0 (agreement to order v*^{order - 1})"

    def rounded(self, form: Format) -> tuple[tuple[float, ...], tuple[float, ...]]:
        """Return the reduced coefficients a and b, each rounded once to a type.

        Raises
        ------
        ValueError
            If one is neither zero nor a normal number, or the formula's size for large v* is not.
        """

        def nearest(name: str, number: Fraction) -> float:
            try:
                return form.nearest(number)
            except ValueError as error:
                raise ValueError(f"{self.label}: {name} = {error}") from None

        a, b = (
            tuple(nearest(f"{letter}_{i}", c) for i, c in enumerate(values))
            for letter, values in zip("ab", self.reduced, strict=True)
        )
        # For large v* the formula is a_m/b_n v*^(m - n).
        top, bottom = (values[-1] for values in self.reduced)
        nearest(f"a_{len(a) - 1}/b_{len(b) - 1}", top / bottom)
        return a, b

    def kernel(self) -> Kernel:
        """Return the kernel: functions of v* and of the speed in each format that holds the coefficients."""
        m, n = len(self.a) - 1, len(self.b) - 1
        a, b = ([str(c).lower() for c in values] for values in (self.a, self.b))
        record = {
            "m": m,
            "n": n,
            "a": a,
            "b": b,
            "domain": self.domain,
            "pole": None if self.pole is None else str(self.pole).lower(),
            "zero": None if self.zero is None else repr(float(self.zero)),
            "next_term": str(self.next_term).lower(),
            "error": self.error,
            "proven": [{"v_star_max": below(_finite_end(c)), "bound": at_most(c.bound)} for c in self.certificates],
            "rounding": {
                b.arithmetic.form.name: at_most(b.last)
                for b in self.bounds
                if (b.result, b.arithmetic.place) == ("epsilon", "host")
            },
            "source": PADE_SOURCE,
        }
        # A format that cannot hold the coefficients, or whose sums overflow, is left out; without doubles is no kernel.
        name = f"pade_{m}_{n}"
        variants, missing = dict[str, _Variant](), dict[str, str]()
        for form in FORMATS.values():
            try:
                top, bottom = self.rounded(form)
                log2_threshold = threshold(self.label, *self.reduced, form)
            except ValueError as error:
                if form == DOUBLE:
                    raise
                missing[form.name] = str(error)
                continue
            # The end is rounded down, into the domain.
            ends = None if self.end is None else (0.0, form.nearest(Fraction(self.end.v_star), math.floor))
            variants[form.name] = _Variant(top, bottom, ends, log2_threshold)
        return replace(
            _kernel(name, self.label, variants, self.bounds), source=PADE_SOURCE, domain=self.domain,
            missing=missing, record=record,
            proofs=tuple(({"name": name, "type": "exact", "a": a, "b": b}, c) for c in self.certificates),
        )  # fmt: skip


@lru_cache(maxsize=256)  # more kernels than anybody asks for in a process
def pade_quotient(m: int, n: int) -> Kernel:
    """Return the kernel of a Padé approximant; errors as for `theory.pade.pade`."""
    return proven_pade(m, n).kernel()


@recorded("pade")
def proven_pade(m: int, n: int) -> ProvenPade:
    """Return the Padé approximant [m/n] with bounds on [0, V] for the `USEFUL` V before its first pole or zero."""
    # The formula with its 40 digits, and for each V the proof of its error in exact arithmetic.
    bare = without_proof(pade_of(m, n, PADE_DIGITS))
    proofs = list[Certificate]()
    for end in _useful_ends(None if bare.end is None else Fraction(bare.end.v_star)):
        try:
            proofs.append(certificate.prove(quotient_formula(*bare.reduced), Fraction(0), end))
        except ArithmeticError:  # of high degree, with a pole and a zero that nearly cancel
            break
    if not proofs:
        return bare

    # Rounding, in each format that holds the coefficients; then the bounds of eps from the speed, as v* is rounded.
    bounds = list[ErrorBound]()
    for form in FORMATS.values():
        with suppress(ValueError):
            bare.rounded(form)
            bounds += bounds_on_machines(form, lambda machine: _bounds(bare.label, *bare.reduced, proofs, machine))
    from_speed = (b for bound in bounds for b in speed_bounds(bound, _beyond(bare, bound)))
    return replace(bare, certificates=tuple(proofs), bounds=(*bounds, *from_speed))


def _beyond(approximant: ProvenPade, bound: ErrorBound) -> JustBeyond | None:
    """Return what holds of a Padé approximant just beyond the end of a bound of its eps; None if that is not known."""
    # A v* <= V = `high` is computed as V (1 + change) at most: the bound of eps's change is larger than that of v*.
    machine, high = bound.arithmetic, Fraction(bound.high)
    end = high * (1 + eps_error_from_v_star(machine))
    if 2 ** threshold(approximant.label, *approximant.reduced, machine.form) < end:
        return None
    with working(BITS):
        results = _results_on_parts(*approximant.reduced, machine)((high, end))
        epsilon = results["epsilon"]
        # |R - eps| <= formula min(eps, 1 - eps), so that min(R, 1 - R)/(1 + formula) is at most min(eps, 1 - eps).
        smaller = epsilon.value.min(1 - epsilon.value) / (1 + ball_of(bound.formula))
        if not smaller > 0:
            return None
        # |dR/d ln v*| = |slope| R over what the true function's may be, 10/3 min(eps, 1 - eps).
        steepness = magnitude(abs(epsilon.slope) * epsilon.value / smaller) / STEEPEST
        # The relative rounding error of R, relative to eps: R <= eps (1 + formula).
        last = magnitude(relative_error("epsilon")(results) * (1 + ball_of(bound.formula)))
    return JustBeyond(max(Fraction(1), steepness), max(bound.last, last))


def without_proof(approximant: Pade) -> ProvenPade:
    """Return a Padé approximant with `PADE_DIGITS` digits, without errors."""

    def first(roots: Sequence[Root]) -> Decimal | None:
        """Return the first of the roots, ordered by size, that is proven to be real and positive."""
        root = next((root for root in roots if root.positive), None)
        return None if root is None else Decimal(root.decimals(PADE_DIGITS)[0])

    a, b = (tuple(map(Decimal, values)) for values in approximant.decimals(PADE_DIGITS))
    # Files state [m/n] - eps at order m + n + 1, whether or not the approximant does better, to ten digits for readers.
    better = approximant.contact_order > approximant.m + approximant.n
    next_term = Decimal(0 if better else known_decimal(-approximant.next_term, 10))
    return ProvenPade(a, b, next_term, first(approximant.poles), first(approximant.zeros))


def _useful_ends(first: Fraction | None) -> list[Fraction]:
    """Return the `USEFUL` v* before `first`, the v* of the first pole or zero."""
    # Less than 90 % of it, by hand: towards a pole the error grows without limit, towards a zero to 100 %.
    return [v for v in USEFUL if first is None or v < first * Fraction(9, 10)]


# --- best approximants ------------------------------------------------------------------------------------------------


def best_fit(m: SupportsIndex, n: SupportsIndex, v_star_max: Exact, v_star_min: Exact = 0) -> Kernel:
    """Return the kernel of the best approximant [m/n] on an interval; arguments and errors as for `minimax.fit`."""
    return _best(*minimax.degrees_of(m, n), *minimax.interval_of(v_star_min, v_star_max))


@lru_cache(maxsize=256)  # as for `pade_quotient`
def _best(m: int, n: int, low: Fraction, high: Fraction) -> Kernel:
    return _fit_kernel(_with_proofs(minimax.fit(m, n, high, low)), f"{m}_{n}_{_interval_name(low, high)}")


def accurate_quotient(accuracy: Exact, v_star_max: Exact, v_star_min: Exact = 0) -> Kernel:
    """Return the cheapest kernel whose proven errors sum to at most `accuracy` in type double.

    (The formula's error is relative to the smaller of eps and 1 - eps, the rounding error to eps.)
    Arguments and errors as for `cheapest.cheapest_fit`.
    """
    return _accurate(checked_accuracy(accuracy, minimax.SMALLEST_ERROR), *minimax.interval_of(v_star_min, v_star_max))


@lru_cache(maxsize=256)  # as for `pade_quotient`
def _accurate(accuracy: Fraction, low: Fraction, high: Fraction) -> Kernel:
    fitted = accurate_fit(accuracy, low, high)
    return _fit_kernel(fitted, f"{_interval_name(low, high)}_{accuracy_name(accuracy)}")


@recorded("minimax")
def accurate_fit(accuracy: Fraction, low: Fraction, high: Fraction) -> ProvenQuotient:
    """Return the cheapest best approximant on low <= v* <= high that is proven to be accurate enough.

    Its error in type double, with rounding, is at most `accuracy`.

    Raises
    ------
    ArithmeticError
        If none of a few fits is proven to be that accurate.
    """
    largest_error = accuracy  # of the formula alone, in the search
    for _ in range(_ATTEMPTS):
        # The search knows the sampled error of the formula; the proof adds rounding, and may exceed the accuracy.
        cheapest_fit = cheapest.cheapest_fit(largest_error, high, low)
        proven = _with_proofs(cheapest_fit, accuracy)
        error = proven.error("epsilon")
        if error <= accuracy:
            return proven
        # Ask for an error that is smaller by the factor by which this one is too large, and by 1 % at least, so that
        # the same fit is not chosen again.
        factor = min(accuracy / error, Fraction(99, 100))
        largest_error = min(largest_error, Fraction(cheapest_fit.error)) * factor
        largest_error = max(largest_error, minimax.SMALLEST_ERROR)  # the least that the search accepts
    raise ArithmeticError(f"no kernel was proven to be as accurate as {float(accuracy):g}")


def _with_proofs(fit: minimax.Fit, limit: Fraction | None = None) -> ProvenQuotient:
    """Return a best approximant with doubles for coefficients, and its proofs; in type float within the limit.

    `fit` has the exact coefficients and the interval of v*; `limit` is the largest error in type float, with rounding,
    and None leaves it to `proven_quotient`.
    """
    # What is proven is the quotient of the doubles, as exact numbers.
    a, b = (tuple(map(float, values)) for values in fit.exact)
    exact = tuple(map(Fraction, a)), tuple(map(Fraction, b))
    proof = certificate.prove(quotient_formula(*exact), *fit.interval)

    def bounds(form: Format) -> list[ErrorBound]:
        """Return the bounds of eps from v*, and from the speed, in each arithmetic of a format."""
        from_v_star = list(bounds_on_machines(form, lambda machine: _bounds(fit.label, *exact, [proof], machine)))
        return [*from_v_star, *(b for bound in from_v_star for b in speed_bounds(bound))]

    return proven_quotient(a, b, proof, bounds, limit)


def _fit_kernel(fit: ProvenQuotient, name: str) -> Kernel:
    """Return the kernel of a proven best approximant `fit`; `name` is the end of its name, "1_4_v5" or "v5_1em3"."""
    proof = fit.certificate
    low, high, name = proof.low, _finite_end(proof), f"minimax_{name}"
    m, n = len(fit.a) - 1, len(fit.b) - 1
    source = "best approximant with a_0 = b_0 = 1, a_1 = b_1 of the exact eps, in the measure |error|/min(eps, 1 - eps)"
    rounding = {form.name: at_most(fit.bound("epsilon", form).last) for form in fit.formats}
    record = {
        "name": name,
        "m": m,
        "n": n,
        "v_star_min": above(low),
        "v_star_max": below(high),
        "measure": proof.measure,
        "variants": fit.variants(rounding),
        "missing": fit.missing,
        "source": source,
    }
    # Ends are rounded into the interval.
    exact = tuple(map(Fraction, fit.a)), tuple(map(Fraction, fit.b))
    variants = dict[str, _Variant]()
    for form in fit.formats:
        top, bottom = map(without_leading_zeros, fit.rounded(form))
        ends = form.nearest(low, math.ceil), form.nearest(high, math.floor)
        variants[form.name] = _Variant(top, bottom, ends, threshold(name, *exact, form))
    return replace(
        _kernel(name, f"[{m}/{n}]", variants, fit.bounds), source=source,
        domain=f"{above(low)} <= v* <= {below(high)}", missing=fit.missing, record=record,
        proofs=(fit.proof({"name": name}, rounding),),
    )  # fmt: skip


def _interval_name(low: Fraction, high: Fraction) -> str:
    """Return the interval low <= v* <= high as a part of a name: "v5" for [0, 5], "v0p1to2" for [0.1, 2]."""
    return f"v{identifier(below(high) if low == 0 else f'{above(low)}to{below(high)}')}"


def _finite_end(proof: Certificate) -> Fraction:
    """Return the end of a certificate's interval, which must have one."""
    if not isinstance(proof.high, Fraction):
        raise ValueError("expected a certificate on an interval with an end")
    return proof.high


# --- the kernel -------------------------------------------------------------------------------------------------------


class _Variant(NamedTuple):
    """What a kernel has in one format."""

    a: tuple[float, ...]
    b: tuple[float, ...]
    """Coefficients of N and D, ascending in v*."""
    ends: tuple[float, float] | None
    """The least and the largest v* of the domain; None for all v* >= 0."""
    threshold: int
    """log2 of the v* beyond which N/D is evaluated in 1/v*."""


def _kernel(name: str, label: str, variants: Mapping[str, _Variant], bounds: Sequence[ErrorBound]) -> Kernel:
    """Return a kernel of v*, and of the speed and beta; NaN outside its domain.

    `name` is the end of its functions' names, `label` the paper's name "[m/n]", `variants` are by name of a format, and
    `bounds` are those of all its functions.
    """
    ends = {form: variant.ends for form, variant in variants.items() if variant.ends is not None}
    # Whether in any format some v* of the domain lie beyond the threshold. The constant 1/1 has no powers to overflow.
    far = any(
        2.0**variant.threshold < (math.inf if variant.ends is None else variant.ends[1])
        for variant in variants.values()
        if not len(variant.a) == len(variant.b) == 1
    )

    # Constants of each format: coefficients a0, a1, …, b0, … that are not zero, and what conditions compare with.
    constants = {form: formulas.dense(a=variant.a, b=variant.b) for form, variant in variants.items()}
    coefficients = constants["double"]
    for form, variant in variants.items():
        if far:
            constants[form] = constants[form] | {"threshold": 2.0**variant.threshold}
        if form in ends:
            low, high = ends[form]
            constants[form] = constants[form] | ({"low": low} if low else {}) | {"high": high}

    # Branches: N/D in v* inside the domain, and before it, where it is needed, N/D in 1/v* beyond the threshold.
    inside: Expression = formulas.NOT_NEGATIVE
    if ends:
        inside = within("v_star", Name("low") if ends["double"][0] else ZERO, Name("high"))
    near, beyond = formulas.epsilon_branches(coefficients)
    branches: tuple[CodeBranch, ...] = (CodeBranch(inside, near.program, near.results),)
    if far:
        v_star, above_it = Name("v_star"), Name("threshold") < Name("v_star")
        guard = both(above_it, v_star <= Name("high")) if ends else above_it
        branches = (CodeBranch(guard, beyond.program, beyond.results), *branches)
    functions = (Function("epsilon", ("v_star",), "eps", None, (), branches, "epsilon"), restitution_function(branches))

    def polynomial_text(letter: str) -> str:
        """Return N ("a") or D ("b") as text, "a0 + a1 v* + a2 v*^2"."""
        terms = [(int(constant[1:]), constant) for constant in coefficients if constant[0] == letter]
        return " + ".join(c if i == 0 else f"{c} v*" if i == 1 else f"{c} v*^{i}" for i, c in terms)

    text = f"eps = ({polynomial_text('a')})/({polynomial_text('b')})"
    return Kernel(name, label, "v_star", text, "", "", functions, constants, tuple(bounds))


def threshold(label: str, a: Sequence[Fraction], b: Sequence[Fraction], form: Format) -> int:
    """Return the largest t such that no sum in Horner's rule can overflow in a type for v* <= 2^t.

    `a` and `b` are the coefficients of N and D, ascending, and `label` is their name in a refusal. Beyond 2^t the
    polynomials are evaluated in 1/v*. As t >= 0, no sum can overflow there either.

    Raises
    ------
    ValueError
        If there is no such t >= 0.
    """
    largest_sum = Fraction(2) ** (form.largest - _HEADROOM)

    def overflows(t: int) -> bool:
        # Every sum in Horner's rule is at most |c_0| + |c_1| v* + … for v* >= 1.
        return any(sum(abs(c) * 2 ** (t * i) for i, c in enumerate(values)) > largest_sum for values in (a, b))

    # The sums grow with t: bisection for the first t that overflows, among the exponents of the type's numbers >= 1.
    t = bisect_left(range(form.largest + 1), True, key=overflows) - 1
    if t < 0:
        raise ValueError(f"{label}: the coefficients are too large to be summed in type {form.name}")
    return t


def without_leading_zeros(ascending: Sequence[Number]) -> tuple[Number, ...]:
    """Drop the highest coefficients that are exactly zero."""
    size = len(ascending)
    while size > 1 and not ascending[size - 1]:
        size -= 1
    return tuple(ascending[:size])


# --- proofs -----------------------------------------------------------------------------------------------------------


def quotient_formula(a: ExactCoefficients, b: ExactCoefficients) -> Formula:
    """Return eps = N/D with coefficients in ascending order, as proofs read it."""
    coefficients = formulas.dense(a=a, b=b) | formulas.losses(a, b)
    near, _ = formulas.epsilon_branches(coefficients)
    return Formula(1, near, None, coefficients)  # a smooth function of v* itself: of its first root


def _bounds(
    label: str, a: Sequence[Fraction], b: Sequence[Fraction], proofs: Sequence[Certificate], machine: Arithmetic
) -> Iterator[ErrorBound]:
    """Yield the bounds of eps = N/D on the intervals of some proofs, in one arithmetic.

    `a` and `b` are the coefficients of N and D, ascending, and `label` is their name in a refusal.

    Raises
    ------
    ValueError
        If something were evaluated in powers of 1/v* there, of which nothing is proven.
    """
    # One bound of rounding serves all intervals.
    low, end = min(proof.low for proof in proofs), max(map(_finite_end, proofs))
    if 2 ** threshold(label, a, b, machine.form) < end:
        raise ValueError(f"{label}: sums could overflow in type {machine.form.name} before v* = {float(end):g}")
    size = quotient_rounding(a, b, machine, low, end)
    # Relative to eps, not to the formula's value R: R <= eps (1 + formula). Of 64 bits two digits are printed.
    with working(64):
        last = rounded_up(size * (1 + ball_of(max(proof.bound for proof in proofs))), DIGITS)
    for proof in proofs:
        yield ErrorBound(
            "epsilon", proof.low, _finite_end(proof), "smaller", proof.bound, last=last, arithmetic=machine
        )


def quotient_rounding(
    a: Sequence[Fraction], b: Sequence[Fraction], machine: Arithmetic, low: Fraction, high: Fraction
) -> arb:
    """Bound the relative rounding error of the computed quotient for low <= v* <= high.

    Parameters
    ----------
    a, b : sequence of Fraction
        Exact coefficients in ascending order. Those that are no numbers of the format are rounded, which counts.
    machine : Arithmetic
        The type, and what is assumed of operations.
    low, high : Fraction
        Interval of v*, of which every number of the format is meant.

    Raises
    ------
    ArithmeticError
        If numerator or denominator may vanish.
    """
    with working(BITS):
        results_on = _results_on_parts(a, b, machine)
        return largest_bound(results_on, parts_from(low, high), relative_error("epsilon"))


def _results_on_parts(
    a: Sequence[Fraction], b: Sequence[Fraction], machine: Arithmetic
) -> Callable[[Part], RoundedResults]:
    """Return a function from a part of v* to the computed quotient there, with bounds of its rounding ("epsilon")."""
    coefficients = formulas.dense(a=a, b=b)
    near, _ = formulas.epsilon_branches(coefficients)
    return results_on_parts(near, ("epsilon",), "v_star", coefficients, machine)


# --- errors for the command line --------------------------------------------------------------------------------------


def error_up_to(a: Sequence[arb], b: Sequence[arb], v_star_max: Exact) -> Fraction:
    """Return a bound of |N/D - eps|/min(eps, 1 - eps) for 0 <= v* <= v_star_max.

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
        return certificate.prove(quotient_formula(a, b), Fraction(0), _end_of_interval(v_star_max)).bound
    except ArithmeticError as error:
        raise ValueError(f"v_star_max is {v_star_max}: {error}; expected a smaller number") from None


def _end_of_interval(v_star_max: Exact) -> Fraction:
    """Return the end of an interval of v* exactly, from 1e-3 to 100; errors as for `error_up_to`."""
    # Chosen by hand: eps is 1 - 1.2e-6 at 1e-3, and 3e-7 at 100. The proof would reach from 0 to 2^23.
    return arguments.exact_number(
        "v_star_max", v_star_max, "a number from 0.001 to 100", lambda v: Fraction(1, 1000) <= v <= 100
    )


def sampled_errors(approximant: Pade, law: Law, v_star_max: Exact = None) -> tuple[tuple[Fraction, Fraction], ...]:
    """Return ends V of intervals, and the largest error found for 0 < v* <= V, relative to min(eps, 1 - eps).

    Parameters
    ----------
    approximant : Pade
        A Padé approximant of the law, in v* = kappa^(1/law.d).
    law : Law
        The law of contact, whose eps is computed at each sample.
    v_star_max : as for `error_up_to`, or None
        The only end. None: the `USEFUL` ones before the first pole or zero, as far as contact ends there.

    Raises
    ------
    TypeError, ValueError
        If v_star_max is no such number, or contact does not end there.
    """
    if v_star_max is None:
        # Ten digits of poles and zeros: they are compared with 0.5, 1, 2 and 5.
        roots = (*approximant.poles, *approximant.zeros)
        positive = [Fraction(root.decimals(min(approximant.digits, 10))[0]) for root in roots if root.positive]
        ends = _useful_ends(min(positive, default=None))
    else:
        ends = [_end_of_interval(v_star_max)]
    a, b = (arb_poly(list(coefficients)) for coefficients in (approximant.a, approximant.b))
    errors, largest_error, last = list[tuple[Fraction, Fraction]](), arb(0), Fraction(0)
    for end in ends:
        # As many points in all for one interval as for four, equally spaced from the last end, without it.
        points = _SAMPLES * len(USEFUL) // len(ends)
        for i in track(range(points), "samples of the error"):
            v_star = last + (end - last) * Fraction(i + 1, points)
            try:
                collision = exact.collision(v_star, _SAMPLE_DIGITS, law=law)
            except ValueError:  # contact does not end with so much damping
                if v_star_max is not None:
                    raise
                return tuple(errors)
            # 64 bits (a machine word) more than the digits: those of the differences that cancel.
            with working(bits_for(_SAMPLE_DIGITS) + 64):
                deviation = abs(a(ball_of(v_star)) / b(ball_of(v_star)) - collision.epsilon)
                relative = deviation / collision.epsilon.min(collision.one_minus_epsilon)
                largest_error = largest_error.max(relative.abs_upper())
        errors.append((end, rounded_up(largest_error)))
        last = end
    return tuple(errors)


def relative_errors(approximant: Pade, v_stars: Iterable[float], digits: int) -> list[arb]:
    """Return p(v*)/eps(v*) - 1 at each v*, as an enclosure, for a Padé approximant p of the paper's law.

    `digits` are the significant digits of eps; those of p's coefficients are in the enclosure, too.
    """
    a, b = (arb_poly(list(coefficients)) for coefficients in (approximant.a, approximant.b))
    errors = []
    for v_star in v_stars:
        epsilon = exact.collision(v_star, digits).epsilon
        # 64 bits (a machine word) more than the digits: those that the sums of the polynomials lose.
        with working(bits_for(digits) + 64):
            errors.append(a(v_star) / b(v_star) / epsilon - 1)
    return errors
