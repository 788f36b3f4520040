"""Kernels of minimax approximants: machine coefficients with proven errors."""

from __future__ import annotations

from dataclasses import dataclass
from fractions import Fraction

from viscopade.arithmetic.decimals import above, below, identifier, power_of_ten
from viscopade.arithmetic.formats import Format
from viscopade.generated import one_line
from viscopade.kernels.certificate import Certificate
from viscopade.kernels.forms.quotient import (
    Values,
    law_name,
    law_pattern,
    law_record,
    proven_errors,
    threshold,
    without_leading_zeros,
)
from viscopade.theory.law import Law


@dataclass(frozen=True)
class Derivative:
    """Derivative of a kernel in one format: d eps/d v* = v* T/D^2, with the kernel's denominator D.

    Attributes
    ----------
    t : tuple of float
        Coefficients of T, ascending, numbers of the format.
    certificate : Certificate
        Of the error relative to the true derivative, evaluated exactly.
    rounding : str
        Proven bound of what rounding adds, relative to the derivative; underflow of v* T excluded.
    """

    t: tuple[float, ...]
    certificate: Certificate
    rounding: str

    def record(self, form: Format) -> dict[str, object]:
        """Return the numerator and its errors as JSON-able data."""
        t = [form.decimal(c).rstrip("f") for c in self.t]
        return {"t": t, "bound": self.certificate.bound, "rounding": self.rounding}


@dataclass(frozen=True)
class MinimaxVariant:
    """The coefficients of a kernel in one format, ascending, and the proof of their error.

    Attributes
    ----------
    form : Format
    a, b : tuple of float
        Numbers of the format; a_0 = b_0 = 1.
    certificate : Certificate
        Of the formula with these coefficients, evaluated exactly.
    rounding : str
        Proven bound of what rounding adds, relative to eps.
    derivative : Derivative or None
        The derivative's numerator; None if nothing is proven of it.
    """

    form: Format
    a: tuple[float, ...]
    b: tuple[float, ...]
    certificate: Certificate
    rounding: str
    derivative: Derivative | None

    def __post_init__(self) -> None:
        if self.a[0] != 1 or self.b[0] != 1:
            raise ValueError("a_0 and b_0 must be 1")
        if any(self.form.nearest(Fraction(c)) != c for c in (*self.a, *self.b)):
            raise ValueError(f"a coefficient is not a number of type {self.form.name}")


@dataclass(frozen=True)
class MinimaxKernel:
    """A best rational approximant of eps on an interval of v*.

    Attributes
    ----------
    m, n : int
        Degrees.
    variants : tuple of MinimaxVariant
        At least one; all of the same interval and measure.
    missing : tuple of (str, str)
        For names of types without a variant, the reason.
    source : str
        One line: where the formula comes from.

    Raises
    ------
    ValueError
        If these contradict each other.
    """

    m: int
    n: int
    variants: tuple[MinimaxVariant, ...]
    missing: tuple[tuple[str, str], ...]
    source: str

    def __post_init__(self) -> None:
        one_line("source", self.source)
        kinds = {(c.low, c.high, c.measure, c.law) for c in (v.certificate for v in self.variants)}
        if len(kinds) != 1:
            raise ValueError(f"{self.label}: the variants must be of one law, one interval and one measure")
        if any((len(v.a), len(v.b)) != (self.m + 1, self.n + 1) for v in self.variants):
            raise ValueError(f"{self.label}: wrong number of coefficients")

    @property
    def interval(self) -> tuple[Fraction, Fraction] | None:
        """The interval of v*; None for all v* >= 0."""
        certificate = self.variants[0].certificate
        return None if certificate.high is None else (certificate.low, certificate.high)

    @property
    def law(self) -> Law:
        """The law of contact."""
        return self.variants[0].certificate.law

    @property
    def bounds(self) -> tuple[Certificate, ...]:
        """The certificate with the largest bound."""
        return (max((v.certificate for v in self.variants), key=lambda certificate: Fraction(certificate.bound)),)

    @property
    def name(self) -> str:
        """The name with degrees, interval and proven bound: "minimax_1_4_v5_9p86em4" has 9.86e-4 up to v* = 5."""
        return f"minimax_{self.m}_{self.n}{law_name(self.law)}_{self._name(identifier(self.bounds[0].bound))}"

    @property
    def lasting_name(self) -> str:
        """The name with a power of ten in place of the bound: "minimax_v5_1em3" keeps it, in double with rounding."""
        total = Fraction(self.variants[0].certificate.bound) + Fraction(self.variants[0].rounding)
        return f"minimax{law_name(self.law)}_{self._name(power_of_ten(total))}"

    def _name(self, error: str) -> str:
        """Return the part of the names with interval, error and measure."""
        if self.interval is None:
            ends = "all"
        else:
            low, high = self.interval
            ends = f"v{identifier(below(high) if low == 0 else f'{above(low)}to{below(high)}')}"
        return f"{ends}_{error}{'' if self.bounds[0].measure == 'both' else '_relative'}"

    @property
    def pattern(self) -> str:
        """The form of the names."""
        return f"minimax_M_N{law_pattern(self.law)}_{'all' if self.interval is None else 'vV'}_B"

    @property
    def label(self) -> str:
        """The name in comments and messages."""
        return f"[{self.m}/{self.n}]"

    @property
    def domain(self) -> str:
        """The interval."""
        if self.interval is None:
            return "all v* >= 0, as far as eps is a normal number"
        low, high = self.interval
        return f"{above(low)} <= v* <= {below(high)}"

    @property
    def end(self) -> None:
        """No end of the domain: the interval has neither pole nor zero."""
        return None

    @property
    def facts(self) -> tuple[str, ...]:
        """Source, domain and error."""
        return (f"source: {self.source}", f"domain: {self.domain}", *self.proven)

    @property
    def proven(self) -> tuple[str, ...]:
        """Sentences on the proven errors, also of the derivative."""
        of_eps = proven_errors(self.bounds, [(v.form.name, v.rounding) for v in self.variants])
        slopes = [(v.form.name, v.derivative) for v in self.variants if v.derivative is not None]
        if not slopes:
            return of_eps
        worst = max((slope.certificate.bound for _, slope in slopes), key=Fraction)
        added = " and ".join(f"{slope.rounding} in type {name}" for name, slope in slopes)
        return (
            *of_eps,
            f"derivative: relative error <= {worst} (proven); rounding adds at most {added} (proven, where nothing is "
            "subnormal)",
        )

    @property
    def a(self) -> tuple[float, ...]:
        """Coefficients of the numerator in the first type."""
        return self.variants[0].a

    @property
    def b(self) -> tuple[float, ...]:
        """Coefficients of the denominator, likewise."""
        return self.variants[0].b

    def record(self) -> dict[str, object]:
        """Return the formula as JSON-able data."""
        low, high = self.interval or (Fraction(0), None)
        return {
            "name": self.name,
            "m": self.m,
            "n": self.n,
            "v_star_min": above(low),
            "v_star_max": None if high is None else below(high),
            "measure": self.bounds[0].measure,
            **law_record(self.law),
            "variants": [
                {
                    "type": v.form.name,
                    "a": [v.form.decimal(c).rstrip("f") for c in v.a],
                    "b": [v.form.decimal(c).rstrip("f") for c in v.b],
                    "bound": v.certificate.bound,
                    "rounding": v.rounding,
                    "derivative": None if v.derivative is None else v.derivative.record(v.form),
                }
                for v in self.variants
            ],
            "missing": dict(self.missing),
            "source": self.source,
        }

    def certificates(self) -> list[dict[str, object]]:
        """Return the data for independent checks of the proofs, ready for JSON; coefficients are hexadecimal."""
        return [
            {
                "name": self.name,
                "type": v.form.name,
                "a": [c.hex() for c in v.a],
                "b": [c.hex() for c in v.b],
                **v.certificate.record(),
                "rounding": v.rounding,
            }
            for v in self.variants
        ] + [
            {
                "name": self.name,
                "type": v.form.name,
                "t": [c.hex() for c in v.derivative.t],
                "b": [c.hex() for c in v.b],
                **v.derivative.certificate.record(),
                "rounding": v.derivative.rounding,
            }
            for v in self.variants
            if v.derivative is not None
        ]

    def variant(self, form: Format) -> MinimaxVariant:
        """Return the variant of a format.

        Raises
        ------
        ValueError
            If there is none.
        """
        for variant in self.variants:
            if variant.form == form:
                return variant
        raise ValueError(dict(self.missing).get(form.name, f"{self.label} has no coefficients in type {form.name}"))

    def rounded(self, form: Format) -> Values:
        """Return the coefficients a and b of a format, without leading ones that are zero."""
        variant = self.variant(form)
        return without_leading_zeros(variant.a), without_leading_zeros(variant.b)

    def derivative(self, form: Format) -> tuple[Values, int] | None:
        """Return the coefficients of T and D of a format, and t such that nothing can overflow for v* <= 2^t."""
        variant = self.variant(form)
        if variant.derivative is None:
            return None
        t, b = without_leading_zeros(variant.derivative.t), without_leading_zeros(variant.b)
        squared = [Fraction(0)] * (2 * len(b) - 1)
        for i, x in enumerate(b):
            for j, y in enumerate(b):
                squared[i + j] += abs(Fraction(x) * Fraction(y))
        return (t, b), threshold(self.label, [Fraction(0), *map(Fraction, t)], squared, form)

    def threshold(self, form: Format) -> int:
        """Return the largest t such that no sum in Horner's rule can overflow for v* <= 2^t."""
        a, b = (tuple(map(Fraction, values)) for values in self.rounded(form))
        return threshold(self.label, a, b, form)
