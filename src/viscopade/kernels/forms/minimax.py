"""Kernels of minimax approximants: machine coefficients with proven errors."""

from __future__ import annotations

from dataclasses import dataclass
from fractions import Fraction

from viscopade.arithmetic.decimals import above, below, identifier, power_of_ten
from viscopade.arithmetic.formats import Format
from viscopade.kernels.certificate import Certificate
from viscopade.kernels.forms.kernel import (
    Fitted,
    Variant,
    decimals,
    hexadecimals,
    law_name,
    law_pattern,
    law_record,
    measure_name,
)
from viscopade.kernels.forms.quotient import Quotient, Texts, Values, proven_errors, threshold, without_leading_zeros


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
        return {**decimals(form, t=self.t), "bound": self.certificate.bound, "rounding": self.rounding}


@dataclass(frozen=True)
class MinimaxVariant(Variant):
    """The coefficients of a kernel in one format, with proofs.

    Attributes
    ----------
    rounding : str
        Proven bound of what rounding adds, relative to eps.
    derivative : Derivative or None
        The derivative's numerator; None if nothing is proven of it.

    The others are those of `Variant`; a_0 is 1, too.
    """

    rounding: str
    derivative: Derivative | None

    def __post_init__(self) -> None:
        super().__post_init__()
        if self.a[0] != 1:
            raise ValueError("a_0 must be 1")

    def record(self) -> dict[str, object]:
        """Return coefficients and errors as JSON-able data."""
        slope = None if self.derivative is None else self.derivative.record(self.form)
        return {**super().record(), "rounding": self.rounding, "derivative": slope}

    @property
    def total(self) -> Fraction:
        """The sum of the proven errors of formula and rounding."""
        return self.error + Fraction(self.rounding)


@dataclass(frozen=True)
class MinimaxKernel(Fitted[MinimaxVariant], Quotient):
    """A best rational approximant of eps on an interval of v*, or for all v*.

    Attributes
    ----------
    m, n : int
        Degrees.

    The others, and errors, are those of `Fitted`.
    """

    m: int
    n: int
    variants: tuple[MinimaxVariant, ...]
    missing: tuple[tuple[str, str], ...]
    source: str

    @property
    def lengths(self) -> tuple[int, int]:
        """The numbers of coefficients a and b."""
        return self.m + 1, self.n + 1

    @property
    def interval(self) -> tuple[Fraction, Fraction] | None:
        """The interval of v*; None for all v* >= 0."""
        return None if self.bound.high is None else (self.bound.low, self.bound.high)

    @property
    def bounds(self) -> tuple[Certificate, ...]:
        """The certificate with the largest bound."""
        return (self.bound,)

    @property
    def name(self) -> str:
        """The name with degrees, interval and proven bound: "minimax_1_4_v5_9p86em4" has 9.86e-4 up to v* = 5."""
        return f"minimax_{self.m}_{self.n}{law_name(self.law)}_{self._name(identifier(self.bound.bound))}"

    @property
    def lasting_name(self) -> str:
        """The name with a power of ten in place of the bound: "minimax_v5_1em3" keeps it, in double with rounding."""
        return f"minimax{law_name(self.law)}_{self._name(power_of_ten(self.variants[0].total))}"

    def _name(self, error: str) -> str:
        """Return the part of the names with interval, error and measure."""
        if self.interval is None:
            ends = "all"
        else:
            low, high = self.interval
            ends = f"v{identifier(below(high) if low == 0 else f'{above(low)}to{below(high)}')}"
        return f"{ends}_{error}{measure_name(self.bound.measure)}"

    @property
    def pattern(self) -> str:
        """The form of the names."""
        return f"minimax_M_N{law_pattern(self.law)}_{'all' if self.interval is None else 'vV'}_B"

    @property
    def domain(self) -> str:
        """The interval."""
        if self.interval is None:
            return "all v* >= 0, as far as eps is a normal number"
        low, high = self.interval
        return f"{above(low)} <= v* <= {below(high)}"

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
    def texts(self) -> Texts:
        """The coefficients in the first type, as their shortest decimals."""
        a, b = (tuple(map(repr, values)) for values in (self.variants[0].a, self.variants[0].b))
        return a, b

    def record(self) -> dict[str, object]:
        """Return the formula as JSON-able data."""
        return {
            "name": self.name,
            "m": self.m,
            "n": self.n,
            "v_star_min": above(self.bound.low),
            "v_star_max": None if self.bound.high is None else below(self.bound.high),
            "measure": self.bound.measure,
            **law_record(self.law),
            "variants": [v.record() for v in self.variants],
            "missing": dict(self.missing),
            "source": self.source,
        }

    def certificates(self) -> list[dict[str, object]]:
        """Return the data for independent checks of the proofs, ready for JSON; coefficients are hexadecimal."""

        def entry(
            v: MinimaxVariant, proof: MinimaxVariant | Derivative, **values: tuple[float, ...]
        ) -> dict[str, object]:
            head = {"name": self.name, "type": v.form.name, **hexadecimals(**values)}
            return {**head, **proof.certificate.record(), "rounding": proof.rounding}

        slopes = ((v, v.derivative) for v in self.variants if v.derivative is not None)
        return [
            *(entry(v, v, a=v.a, b=v.b) for v in self.variants),
            *(entry(v, slope, t=slope.t, b=v.b) for v, slope in slopes),
        ]

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
