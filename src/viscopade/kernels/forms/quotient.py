"""Quotient kernels [m/n]: rational approximants of eps in v*.

`Quotient` is what exporters need of one. `PadeKernel` is one of its two implementations; the other is
`minimax.MinimaxKernel`.
"""

from __future__ import annotations

from abc import abstractmethod
from bisect import bisect_left
from collections.abc import Sequence
from dataclasses import dataclass
from decimal import ROUND_FLOOR, Context, Decimal
from fractions import Fraction
from functools import cached_property
from typing import ClassVar, TypeVar

from viscopade import arguments
from viscopade.approximation.measure import RELATIVE_TO
from viscopade.arithmetic.decimals import at_most, below
from viscopade.arithmetic.formats import Format, float_text
from viscopade.kernels.certificate import Certificate
from viscopade.kernels.forms.kernel import Kernel, span
from viscopade.theory.law import VISCOELASTIC, Law

QUOTIENT = "quotient"

# How far, in powers of two, sums in Horner's rule stay below the largest number: it leaves room for rounding,
# and keeps the quotient of two such sums a normal number.
_HEADROOM = 8

_ROOT_TOLERANCE = Fraction(1, 10**12)  # of what is left of the terms; the root may come from more digits, or fewer

Number = TypeVar("Number", float, Fraction)
Values = tuple[tuple[float, ...], tuple[float, ...]]
Texts = tuple[tuple[str, ...], tuple[str, ...]]


class Quotient(Kernel):
    """A rational approximant of eps in v*, (a_0 + ... + a_m v*^m) / (b_0 + ... + b_n v*^n).

    Attributes
    ----------
    m, n : int
        Degrees of numerator and denominator.
    """

    m: int
    n: int
    kind: ClassVar[str] = QUOTIENT

    @property
    def label(self) -> str:
        """The paper's name, "[3/6]"."""
        return f"[{self.m}/{self.n}]"

    @property
    @abstractmethod
    def pattern(self) -> str:
        """The form of the names, as a header explains it."""

    @property
    def interval(self) -> tuple[Fraction, Fraction] | None:
        """The interval of v* for which the formula is fitted; None for the whole domain."""
        return None

    @property
    def end(self) -> tuple[str, Decimal] | None:
        """The upper end of the domain, "pole" or "zero", and its v*; None if the domain has no end."""
        return None

    @property
    @abstractmethod
    def texts(self) -> Texts:
        """Coefficients of numerator and denominator, ascending, as decimals for tables."""

    @property
    @abstractmethod
    def bounds(self) -> tuple[Certificate, ...]:
        """The certificates of the error."""

    @abstractmethod
    def rounded(self, form: Format) -> Values:
        """Return the coefficients a and b in a binary format, or raise ValueError if there are none."""

    def threshold(self, form: Format) -> int:
        """Return the largest t such that no sum in Horner's rule can overflow for v* <= 2^t.

        Beyond 2^t the polynomials are evaluated in 1/v*. As t >= 0, no sum can overflow there either.

        Raises
        ------
        ValueError
            If there is no such t >= 0.
        """
        a, b = (tuple(map(Fraction, values)) for values in self.rounded(form))
        return threshold(self.label, a, b, form)


@dataclass(frozen=True)
class PadeKernel(Quotient):
    """A Padé approximant of eps(v*), (a_0 + … + a_m v*^m) / (b_0 + … + b_n v*^n), eq:padeDef.

    Attributes
    ----------
    m, n : int
        Degrees of numerator and denominator (leading coefficients may be zero).
    a, b : tuple of Decimal, lengths m + 1 and n + 1
        Coefficients in ascending order; a_0 = b_0 = 1.
    next_term : Decimal
        c in [m/n](v*) - eps(v*) = c v*^(m+n+1) + … .
    pole, zero : Decimal or None
        The smallest positive ones; None if there are none.
    source : str
        One line: where the formula comes from.
    bounds : tuple of Certificate
        What is proven of the error of the exact formula.
    rounding : tuple of (str, str)
        For names of types, a bound of what rounding (of coefficients, too) adds, relative to eps, where `bounds` hold.
    sampled : tuple of (str, str)
        For another law than the paper's: v*, and the largest error up to there, relative to min(eps, 1 - eps), as found
        at some points.
    law : Law

    Raises
    ------
    ValueError
        If lengths, a_0, b_0, `pole` or `zero` contradict the rest, or a number is not finite. (That there is no smaller
        pole or zero is not looked into: `theory.pade` proves it.)
    TypeError
        If something is not of the type stated.
    """

    m: int
    n: int
    a: tuple[Decimal, ...]
    b: tuple[Decimal, ...]
    next_term: Decimal
    pole: Decimal | None
    zero: Decimal | None
    source: str
    bounds: tuple[Certificate, ...] = ()
    rounding: tuple[tuple[str, str], ...] = ()
    sampled: tuple[tuple[str, str], ...] = ()
    law: Law = VISCOELASTIC

    def __post_init__(self) -> None:
        for name, degree in (("m", self.m), ("n", self.n)):
            arguments.integer(name, degree, 0, arguments.MAX_ORDER)
        for name, degree, values in (("a", self.m, self.a), ("b", self.n, self.b)):
            if not isinstance(values, tuple):
                raise TypeError(f"{self.label}: {name} must be a tuple of decimals")
            if len(values) != degree + 1:
                raise ValueError(f"{self.label} has {degree + 1} coefficients {name}_i, not {len(values)}")
            if values[0] != 1:
                raise ValueError(f"{self.label}: {name}_0 is {values[0]}, it must be 1")
        for number in (*self.a, *self.b, self.next_term):
            if not isinstance(number, Decimal):
                raise TypeError(f"{self.label}: {number!r} is not a decimal")
            if not number.is_finite():
                raise ValueError(f"{self.label}: {number} is not a finite number")
        for kind, at, side in zip(("zero", "pole"), (self.zero, self.pole), self.reduced, strict=True):
            self._check_end(kind, at, side)

    def _check_end(self, kind: str, at: Decimal | None, values: Sequence[Fraction]) -> None:
        """Raise if a polynomial that is 1 at 0 does not vanish at its root, or is negative for large v* without one."""
        if at is None:
            if values[-1] < 0:
                raise ValueError(f"{self.label} has a positive {kind}, but {kind} is None")
            return
        terms = [c * Fraction(at) ** i for i, c in enumerate(values)]
        if at <= 0 or abs(sum(terms, Fraction(0))) > _ROOT_TOLERANCE * sum(map(abs, terms), Fraction(0)):
            raise ValueError(f"{self.label} has no positive {kind} at v* = {at}")

    @cached_property
    def exact(self) -> tuple[tuple[Fraction, ...], tuple[Fraction, ...]]:
        """The coefficients a and b as fractions."""
        return tuple(map(Fraction, self.a)), tuple(map(Fraction, self.b))

    @property
    def name(self) -> str:
        """The name with type and degree, "pade_3_6"; of another law "pade_3_6_a3o2_b1o4" for a = 3/2, b = 1/4."""
        exponents = f"_a{self.law.elastic}_b{self.law.damping}".replace("/", "o")
        return f"pade_{self.m}_{self.n}{'' if self.law == VISCOELASTIC else exponents}"

    @property
    def pattern(self) -> str:
        """The form of the names."""
        return "pade_M_N" if self.law == VISCOELASTIC else "pade_M_N_aA_bB"

    @property
    def facts(self) -> tuple[str, ...]:
        """Source, domain and error."""
        return (f"source: {self.source}", f"domain: {self.domain}", f"error: {self.error}", *self.proven)

    @property
    def proven(self) -> tuple[str, ...]:
        """Sentences on the proven errors, or on the sampled ones."""
        errors = ", ".join(f"{error} for 0 <= v* <= {high}" for high, error in self.sampled)
        sampled = [f"sampled (not proven): |formula - eps| / min(eps, 1 - eps) is at most {errors}"] if errors else []
        return (*proven_errors(self.bounds, self.rounding), *sampled)

    def record(self) -> dict[str, object]:
        """Return the formula as JSON-able data."""
        return {
            "m": self.m,
            "n": self.n,
            **self._law_record(),
            "a": list(self.texts[0]),
            "b": list(self.texts[1]),
            "domain": self.domain,
            "pole": None if self.pole is None else _text(self.pole),
            "zero": None if self.zero is None else repr(float(self.zero)),
            "next_term": _text(self.next_term),
            "error": self.error,
            "proven": [{"v_star_max": below(Fraction(c.high)), "bound": at_most(c.bound)} for c in self.bounds],
            "rounding": dict(self.rounding),
            "source": self.source,
        }

    def _law_record(self) -> dict[str, object]:
        """Return a law that is not the paper's, and the sampled errors, as JSON-able data."""
        if self.law == VISCOELASTIC:
            return {}
        law = {"law": str(self.law), "end": self.law.end, "kappa": self.law.kappa_text, "d": self.law.d}
        return law | {"sampled": [{"v_star_max": high, "error": error} for high, error in self.sampled]}

    @property
    def texts(self) -> Texts:
        """All digits of the coefficients a and b."""
        a, b = (tuple(map(_text, values)) for values in (self.a, self.b))
        return a, b

    def certificates(self) -> list[dict[str, object]]:
        """Return the data for independent checks of the proofs, ready for JSON."""
        a, b = self.texts
        formula = {"name": self.name, "type": "exact", "a": a, "b": b}
        return [{**formula, **bound.record()} for bound in self.bounds]

    @property
    def end(self) -> tuple[str, Decimal] | None:
        """The upper end of the domain, "pole" or "zero", and its v*; None if the domain has no end."""
        bounds = [(kind, at) for kind, at in (("pole", self.pole), ("zero", self.zero)) if at is not None]
        return min(bounds, key=lambda bound: bound[1], default=None)

    @property
    def domain(self) -> str:
        """The values of v* for which the formula is a coefficient of restitution, as a sentence's part."""
        if self.end is None:
            a, b = self.reduced
            remark = "no positive pole and no positive zero" if len(a) < len(b) else "but it does not tend to 0"
            return f"all v* >= 0 ({remark})"
        kind, at = self.end
        below = Context(prec=10, rounding=ROUND_FLOOR).create_decimal(at)
        return f"0 <= v* < {below} (there the formula has a {kind})"

    @property
    def error(self) -> str:
        """The error by the Padé property, as part of a sentence."""
        order = self.m + self.n + 1
        deviation = Fraction(self.next_term)
        if not deviation:
            return f"{self.label} = eps + O(v*^{order + 1}) as v* -> 0 (agreement to order v*^{order})"
        size = f"{'-' if deviation < 0 else '+'} {float_text(abs(deviation))} v*^{order}"
        return f"{self.label} = eps {size} + ... as v* -> 0 (agreement to order v*^{order - 1})"

    @property
    def reduced(self) -> tuple[tuple[Fraction, ...], tuple[Fraction, ...]]:
        """The exact a and b without leading ones that are zero ([0/3] has b_3 = 0)."""
        a, b = map(without_leading_zeros, self.exact)
        return a, b

    def rounded(self, form: Format) -> Values:
        """Return the reduced coefficients a and b, each rounded once to the nearest value of a binary format.

        Raises
        ------
        ValueError
            If one is neither zero nor a normal number of the format.
        """
        a, b = (
            tuple(self._nearest(f"{name}_{i}", c, form) for i, c in enumerate(values))
            for name, values in zip("ab", self.reduced, strict=True)
        )
        return a, b

    def _nearest(self, name: str, number: Fraction, form: Format) -> float:
        try:
            return form.nearest(number)
        except ValueError as error:
            raise ValueError(f"{self.label}: {name} = {error}") from None

    def threshold(self, form: Format) -> int:
        """Return the same; the leading coefficients' quotient must be a normal number, too."""
        a, b = self.reduced
        self._nearest(f"a_{len(a) - 1}/b_{len(b) - 1}", a[-1] / b[-1], form)
        return threshold(self.label, a, b, form)


def threshold(label: str, a: Sequence[Fraction], b: Sequence[Fraction], form: Format) -> int:
    """Return the largest t such that no sum in Horner's rule can overflow for v* <= 2^t.

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


def proven_errors(bounds: Sequence[Certificate], rounding: Sequence[tuple[str, str]]) -> tuple[str, ...]:
    """Return the sentences on the proven error; none without a proof."""
    if not bounds:
        return ()
    errors = ", ".join(f"{at_most(bound.bound)} for {span(bound.low, Fraction(bound.high))}" for bound in bounds)
    sizes = " and ".join(f"{size} eps in type {name}" for name, size in rounding)
    where = f"for {span(bounds[0].low, Fraction(bounds[-1].high))}"
    return (
        f"proven: |formula - eps| / {RELATIVE_TO[bounds[0].measure]} <= {errors}",
        f"rounding: adds at most {sizes} {where} (proven)",
    )


def without_leading_zeros(ascending: Sequence[Number]) -> tuple[Number, ...]:
    """Drop the highest coefficients that are exactly zero."""
    size = len(ascending)
    while size > 1 and not ascending[size - 1]:
        size -= 1
    return tuple(ascending[:size])


def _text(number: Decimal) -> str:
    return str(number).lower()
