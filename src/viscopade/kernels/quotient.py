"""Quotient kernels [m/n]: rational approximants eps = N/D of v*, Padé and best ones, with proofs.

A quotient is evaluated by Horner's rule in v*, and beyond a threshold, where a sum might overflow, in u = 1/v*.
"""

from __future__ import annotations

import math
from bisect import bisect_left
from collections.abc import Callable, Iterator, Mapping, Sequence
from contextlib import suppress
from dataclasses import dataclass, replace
from decimal import ROUND_FLOOR, Context, Decimal
from fractions import Fraction
from functools import lru_cache
from typing import SupportsIndex, TypeVar

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

PADE_DIGITS = 40  # of the coefficients
STEEPEST = Fraction(10, 3)
"""|d ln eps/d ln v*| tends to this number; `panel_proof.steepest` is at least as large."""
USEFUL = tuple(map(Fraction, ("0.5", "1", "2", "5")))
"""v* up to which errors of Padé approximants are stated."""

_SAMPLES, _SAMPLE_DIGITS = 8, 30  # of sampled errors
_ATTEMPTS = 8
# How far, in powers of two, sums in Horner's rule stay below the largest number: it leaves room for rounding, and
# makes the quotient of two such sums a normal number.
_HEADROOM = 8
_ROOT_TOLERANCE = Fraction(1, 10**12)  # of what is left of the terms; the root may come from more digits, or fewer

# Plain ASCII: it stands in source files that compilers with other character sets read.
PADE_SOURCE = (
    "Pade approximant (eq:padeDef) of the exact series (eq:epsSeriesAdvanced), derived from the equation of "
    f"motion; coefficients proven to {PADE_DIGITS} digits"
)

Number = TypeVar("Number", float, Fraction)
Exactly = Sequence[Fraction | arb]


# --- Padé approximants ------------------------------------------------------------------------------------------------


@dataclass(frozen=True)
class ProvenPade:
    """A Padé approximant (a_0 + … + a_m v*^m)/(b_0 + … + b_n v*^n), eq:padeDef, with what is proven: a record.

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
        for number in (*self.a, *self.b, self.next_term):
            if not number.is_finite():
                raise ValueError(f"{self.label}: {number} is not a finite number")
        for kind, at, side in zip(("zero", "pole"), (self.zero, self.pole), self.reduced, strict=True):
            if side[0] != 1:
                raise ValueError(f"{self.label}: a_0 and b_0 must be 1, not {side[0]}")
            if at is None:
                if side[-1] < 0:
                    raise ValueError(f"{self.label} has a positive {kind}, but {kind} is None")
                continue
            terms = [c * Fraction(at) ** i for i, c in enumerate(side)]
            if at <= 0 or abs(sum(terms, Fraction(0))) > _ROOT_TOLERANCE * sum(map(abs, terms), Fraction(0)):
                raise ValueError(f"{self.label} has no positive {kind} at v* = {at}")

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
    def end(self) -> tuple[str, Decimal] | None:
        """The upper end of the domain, "pole" or "zero", and its v*; None if the domain has no end."""
        ends = [(kind, at) for kind, at in (("pole", self.pole), ("zero", self.zero)) if at is not None]
        return min(ends, key=lambda end: end[1], default=None)

    @property
    def domain(self) -> str:
        """The values of v* for which the formula is a coefficient of restitution, as a sentence's part."""
        if self.end is None:
            a, b = self.reduced
            remark = "no positive pole and no positive zero" if len(a) < len(b) else "but it does not tend to 0"
            return f"all v* >= 0 ({remark})"
        kind, at = self.end
        return f"0 <= v* < {Context(prec=10, rounding=ROUND_FLOOR).create_decimal(at)} (there the formula has a {kind})"

    @property
    def error(self) -> str:
        """The error by the Padé property, as part of a sentence."""
        order, deviation = len(self.a) + len(self.b) - 1, Fraction(self.next_term)
        if not deviation:
            return f"{self.label} = eps + O(v*^{order + 1}) as v* -> 0 (agreement to order v*^{order})"
        size = f"{'-' if deviation < 0 else '+'} {float_text(abs(deviation))} v*^{order}"
        return f"{self.label} = eps {size} + ... as v* -> 0 (agreement to order v*^{order - 1})"

    def rounded(self, form: Format) -> tuple[tuple[float, ...], tuple[float, ...]]:
        """Return the reduced coefficients, each rounded once; ValueError if one is neither zero nor a normal number."""

        def nearest(name: str, number: Fraction) -> float:
            try:
                return form.nearest(number)
            except ValueError as error:
                raise ValueError(f"{self.label}: {name} = {error}") from None

        a, b = (
            tuple(nearest(f"{letter}_{i}", c) for i, c in enumerate(values))
            for letter, values in zip("ab", self.reduced, strict=True)
        )
        top, bottom = (values[-1] for values in self.reduced)
        nearest(f"a_{len(a) - 1}/b_{len(b) - 1}", top / bottom)  # what is left for large v*
        return a, b

    def kernel(self) -> Kernel:
        """Return the kernel."""
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
            "proven": [{"v_star_max": below(_end(c)), "bound": at_most(c.bound)} for c in self.certificates],
            "rounding": {
                b.arithmetic.form.name: at_most(b.last)
                for b in self.bounds
                if (b.result, b.arithmetic.place) == ("epsilon", "host")
            },
            "source": PADE_SOURCE,
        }
        name = f"pade_{m}_{n}"
        given, missing = dict[str, _Given](), dict[str, str]()
        for form in FORMATS.values():
            try:
                top, bottom = self.rounded(form)
                limit = threshold(self.label, *self.reduced, form)
            except ValueError as error:
                if form == DOUBLE:
                    raise
                missing[form.name] = str(error)
                continue
            ends = None if self.end is None else (0.0, form.nearest(Fraction(self.end[1]), math.floor))
            given[form.name] = _Given(top, bottom, ends, limit)
        return replace(
            _kernel(name, self.label, given, self.bounds), source=PADE_SOURCE, domain=self.domain,
            missing=missing, record=record,
            proofs=tuple(({"name": name, "type": "exact", "a": a, "b": b}, c) for c in self.certificates),
        )  # fmt: skip


@lru_cache(maxsize=256)
def pade_quotient(m: int, n: int) -> Kernel:
    """Return the kernel of a Padé approximant; errors as for `theory.pade.pade`."""
    return proven_pade(m, n).kernel()


@recorded("pade")
def proven_pade(m: int, n: int) -> ProvenPade:
    """Return a Padé approximant with bounds on [0, V] for the `USEFUL` V before its first pole or zero."""
    bare = without_proof(pade_of(m, n, PADE_DIGITS))
    found = list[Certificate]()
    for end in _useful_ends(None if bare.end is None else Fraction(bare.end[1])):
        try:
            found.append(certificate.prove(quotient_formula(*bare.reduced), Fraction(0), end))
        except ArithmeticError:  # of high degree, with a pole and a zero that nearly cancel
            break
    if not found:
        return bare
    bounds = list[ErrorBound]()
    for form in FORMATS.values():
        with suppress(ValueError):
            bare.rounded(form)
            bounds += bounds_on_machines(form, lambda machine: _bounds(bare.label, *bare.reduced, found, machine))
    of_speed = (b for bound in bounds for b in speed_bounds(bound, _beyond(bare, bound)))
    return replace(bare, certificates=tuple(found), bounds=(*bounds, *of_speed))


def _beyond(approximant: ProvenPade, bound: ErrorBound) -> JustBeyond | None:
    """Return what holds just beyond the end of a bound of eps."""
    machine, high = bound.arithmetic, Fraction(bound.high)
    end = high * (1 + eps_error_from_v_star(machine))
    if 2 ** threshold(approximant.label, *approximant.reduced, machine.form) < end:
        return None
    with working(BITS):
        every = _computed(*approximant.reduced, machine)((high, end))
        found = every["epsilon"]
        smaller = found.value.min(1 - found.value) / (1 + ball_of(bound.formula))  # at most the true one
        if not smaller > 0:
            return None
        steepness = magnitude(abs(found.slope) * found.value / smaller) / STEEPEST
        last = magnitude(relative_error("epsilon")(every) * (1 + ball_of(bound.formula)))
    return JustBeyond(max(Fraction(1), steepness), max(bound.last, last))


def without_proof(approximant: Pade) -> ProvenPade:
    """Return a Padé approximant with `PADE_DIGITS` digits, without errors."""

    def first(roots: Sequence[Root]) -> Decimal | None:
        """Return the first of the roots, ordered by size, that is proven to be real and positive."""
        root = next((root for root in roots if root.positive), None)
        return None if root is None else Decimal(root.decimals(PADE_DIGITS)[0])

    a, b = (tuple(map(Decimal, values)) for values in approximant.decimals(PADE_DIGITS))
    # Files state [m/n] - eps at order m + n + 1, whether or not the approximant does better.
    better = approximant.contact_order > approximant.m + approximant.n
    next_term = Decimal(0 if better else known_decimal(-approximant.next_term, 10))
    return ProvenPade(a, b, next_term, first(approximant.poles), first(approximant.zeros))


def _useful_ends(first: Fraction | None) -> list[Fraction]:
    """Return the `USEFUL` v* before the first pole or zero."""
    return [v for v in USEFUL if first is None or v < first * Fraction(9, 10)]


# --- best approximants ------------------------------------------------------------------------------------------------


def best_fit(m: SupportsIndex, n: SupportsIndex, v_star_max: Exact, v_star_min: Exact = 0) -> Kernel:
    """Return the kernel of the best approximant [m/n] on an interval; arguments and errors as for `minimax.fit`."""
    return _best(*minimax.degrees_of(m, n), *minimax.interval_of(v_star_min, v_star_max))


@lru_cache(maxsize=256)
def _best(m: int, n: int, low: Fraction, high: Fraction) -> Kernel:
    return _of_fit(_with_proofs(minimax.fit(m, n, high, low)), f"{m}_{n}_{_interval_name(low, high)}")


def accurate_quotient(accuracy: Exact, v_star_max: Exact, v_star_min: Exact = 0) -> Kernel:
    """Return the cheapest kernel whose proven errors sum to at most `accuracy` in type double.

    (The formula's error is relative to the smaller of eps and 1 - eps, the rounding error to eps.)
    Arguments and errors as for `cheapest.cheapest_fit`.
    """
    return _accurate(checked_accuracy(accuracy, minimax.SMALLEST_ERROR), *minimax.interval_of(v_star_min, v_star_max))


@lru_cache(maxsize=256)
def _accurate(wanted: Fraction, low: Fraction, high: Fraction) -> Kernel:
    fitted = accurate_fit(wanted, low, high)
    return _of_fit(fitted, f"{_interval_name(low, high)}_{accuracy_name(wanted)}")


@recorded("minimax")
def accurate_fit(wanted: Fraction, low: Fraction, high: Fraction) -> ProvenQuotient:
    """Return the cheapest best approximant that is proven to be accurate enough."""
    limit = wanted
    for _ in range(_ATTEMPTS):
        chosen = cheapest.cheapest_fit(limit, high, low)
        found = _with_proofs(chosen, wanted)
        error = found.error("epsilon")
        if error <= wanted:
            return found
        limit = max(min(limit, Fraction(chosen.error)) * min(wanted / error, Fraction(99, 100)), minimax.SMALLEST_ERROR)
    raise ArithmeticError(f"no kernel was proven to be as accurate as {float(wanted):g}")


def _with_proofs(fit: minimax.Fit, limit: Fraction | None = None) -> ProvenQuotient:
    """Return the approximant with doubles for coefficients, and its proofs; in type float within the limit."""
    a, b = (tuple(map(float, values)) for values in fit.exact)
    exact = tuple(map(Fraction, a)), tuple(map(Fraction, b))
    proof = certificate.prove(quotient_formula(*exact), *fit.interval)

    def bounds(form: Format) -> list[ErrorBound]:
        of_eps = list(bounds_on_machines(form, lambda machine: _bounds(fit.label, *exact, [proof], machine)))
        return [*of_eps, *(b for bound in of_eps for b in speed_bounds(bound))]

    return proven_quotient(a, b, proof, bounds, limit)


def _of_fit(found: ProvenQuotient, name: str) -> Kernel:
    proof = found.certificate
    low, high, name = proof.low, _end(proof), f"minimax_{name}"
    m, n = len(found.a) - 1, len(found.b) - 1
    source = "best approximant with a_0 = b_0 = 1, a_1 = b_1 of the exact eps, in the measure |error|/min(eps, 1 - eps)"
    rounding = {form.name: at_most(found.bound("epsilon", form).last) for form in found.formats}
    record = {
        "name": name,
        "m": m,
        "n": n,
        "v_star_min": above(low),
        "v_star_max": below(high),
        "measure": proof.measure,
        "variants": found.variants(rounding),
        "missing": found.missing,
        "source": source,
    }
    exact = tuple(map(Fraction, found.a)), tuple(map(Fraction, found.b))
    given = dict[str, _Given]()
    for form in found.formats:
        top, bottom = map(without_leading_zeros, found.rounded(form))
        ends = form.nearest(low, math.ceil), form.nearest(high, math.floor)
        given[form.name] = _Given(top, bottom, ends, threshold(name, *exact, form))
    return replace(
        _kernel(name, f"[{m}/{n}]", given, found.bounds), source=source,
        domain=f"{above(low)} <= v* <= {below(high)}", missing=found.missing, record=record,
        proofs=(found.proof({"name": name}, rounding),),
    )  # fmt: skip


def _interval_name(low: Fraction, high: Fraction) -> str:
    """Return an interval as a part of a name: "v5", "v0p1to2"."""
    return f"v{identifier(below(high) if low == 0 else f'{above(low)}to{below(high)}')}"


def _end(proof: Certificate) -> Fraction:
    """Return the end of a certificate's interval, which has one."""
    if not isinstance(proof.high, Fraction):
        raise ValueError("expected a certificate on an interval with an end")
    return proof.high


# --- the kernel -------------------------------------------------------------------------------------------------------


@dataclass(frozen=True)
class _Given:
    """What a kernel is given in a format: coefficients, the ends of the domain, and log2 of the threshold."""

    a: tuple[float, ...]
    b: tuple[float, ...]
    ends: tuple[float, float] | None
    threshold: int


def _kernel(name: str, label: str, given: Mapping[str, _Given], bounds: Sequence[ErrorBound]) -> Kernel:
    """Return a kernel of v*, and of the speed and beta; NaN outside its domain."""
    ends = {form: parts.ends for form, parts in given.items() if parts.ends is not None}
    far = any(
        2.0**parts.threshold < (math.inf if parts.ends is None else parts.ends[1])
        for parts in given.values()
        if not len(parts.a) == len(parts.b) == 1
    )
    constants = {form: formulas.dense(a=parts.a, b=parts.b) for form, parts in given.items()}
    coefficients = constants["double"]
    for form, parts in given.items():
        if far:
            constants[form] = constants[form] | {"threshold": 2.0**parts.threshold}
        if form in ends:
            low, high = ends[form]
            constants[form] = constants[form] | ({"low": low} if low else {}) | {"high": high}
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
    top, bottom = (
        " + ".join(c if i == 0 else f"{c} v*" if i == 1 else f"{c} v*^{i}" for i, c in _terms(coefficients, letter))
        for letter in "ab"
    )
    return Kernel(name, label, "v_star", f"eps = ({top})/({bottom})", "", "", functions, constants, tuple(bounds))


def _terms(coefficients: Mapping[str, object], letter: str) -> list[tuple[int, str]]:
    return [(int(name[1:]), name) for name in coefficients if name[0] == letter]


def threshold(label: str, a: Sequence[Fraction], b: Sequence[Fraction], form: Format) -> int:
    """Return the largest t such that no sum in Horner's rule can overflow for v* <= 2^t.

    Beyond 2^t the polynomials are evaluated in 1/v*. As t >= 0, no sum can overflow there either.

    Raises
    ------
    ValueError
        If there is no such t >= 0.
    """
    limit = Fraction(2) ** (form.largest - _HEADROOM)

    def overflows(t: int) -> bool:
        return any(sum(abs(c) * 2 ** (t * i) for i, c in enumerate(values)) > limit for values in (a, b))

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


def quotient_formula(a: Exactly, b: Exactly) -> Formula:
    """Return eps = N/D with coefficients in ascending order, as proofs read it."""
    given = formulas.dense(a=a, b=b) | formulas.losses(a, b)
    near, _ = formulas.epsilon_branches(given)
    return Formula(1, near, None, given)


def _bounds(
    label: str, a: Sequence[Fraction], b: Sequence[Fraction], proofs: Sequence[Certificate], machine: Arithmetic
) -> Iterator[ErrorBound]:
    """Yield the bounds of eps on the intervals of some proofs.

    Raises
    ------
    ValueError
        If something were evaluated in powers of 1/v* there, of which nothing is proven.
    """
    low, end = min(proof.low for proof in proofs), max(map(_end, proofs))
    if 2 ** threshold(label, a, b, machine.form) < end:
        raise ValueError(f"{label}: sums could overflow in type {machine.form.name} before v* = {float(end):g}")
    size = quotient_rounding(a, b, machine, low, end)
    with working(64):  # relative to eps, not to the formula's value
        last = rounded_up(size * (1 + ball_of(max(proof.bound for proof in proofs))), DIGITS)
    for proof in proofs:
        yield ErrorBound("epsilon", proof.low, _end(proof), "smaller", proof.bound, last=last, arithmetic=machine)


def quotient_rounding(
    a: Sequence[Fraction], b: Sequence[Fraction], machine: Arithmetic, low: Fraction, high: Fraction
) -> arb:
    """Bound the relative rounding error of the computed quotient for low <= v* <= high.

    Parameters
    ----------
    a, b : sequence of Fraction
        Exact coefficients in ascending order. Those that are no numbers of the format are rounded, which counts.
    machine : Arithmetic
    low, high : Fraction
        Interval of v*, of which every number of the format is meant.

    Raises
    ------
    ArithmeticError
        If numerator or denominator may vanish.
    """
    with working(BITS):
        return largest_bound(_computed(a, b, machine), parts_from(low, high), relative_error("epsilon"))


def _computed(a: Sequence[Fraction], b: Sequence[Fraction], machine: Arithmetic) -> Callable[[Part], RoundedResults]:
    """Return the computed quotient on parts of v*."""
    given = formulas.dense(a=a, b=b)
    return results_on_parts(formulas.epsilon_branches(given)[0], ("epsilon",), "v_star", given, machine)


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
    v_star_max : as for `error_up_to`, or None
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
    found, most, last = list[tuple[Fraction, Fraction]](), arb(0), Fraction(0)
    for end in ends:
        points = _SAMPLES * len(USEFUL) // len(ends)
        for i in track(range(points), "samples of the error"):
            v_star = last + (end - last) * Fraction(i + 1, points)
            try:
                true = exact.collision(v_star, _SAMPLE_DIGITS, law=law)
            except ValueError:  # contact does not end with so much damping
                if v_star_max is not None:
                    raise
                return tuple(found)
            with working(bits_for(_SAMPLE_DIGITS) + 64):
                off = abs(a(ball_of(v_star)) / b(ball_of(v_star)) - true.epsilon)
                most = most.max((off / true.epsilon.min(true.one_minus_epsilon)).abs_upper())
        found.append((end, rounded_up(most)))
        last = end
    return tuple(found)
