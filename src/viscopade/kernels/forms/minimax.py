"""Kernels of minimax approximants: machine coefficients with proven errors."""

from __future__ import annotations

from dataclasses import dataclass
from fractions import Fraction

from viscopade.arithmetic.decimals import above, below, identifier
from viscopade.arithmetic.formats import Format
from viscopade.kernels.certificate import Certificate
from viscopade.kernels.forms.kernel import (
    Fitted,
    Variant,
    accuracy_name,
    hexadecimals,
    measure_name,
)
from viscopade.kernels.forms.quotient import Quotient, Texts, Values, proven_errors, without_leading_zeros


@dataclass(frozen=True)
class MinimaxVariant(Variant):
    """The coefficients of a kernel in one format, with proofs.

    Attributes
    ----------
    rounding : str
        Proven bound of what rounding adds, relative to eps.

    The others are those of `Variant`; a_0 is 1, too.
    """

    rounding: str

    def __post_init__(self) -> None:
        super().__post_init__()
        if self.a[0] != 1:
            raise ValueError("a_0 must be 1")

    def record(self) -> dict[str, object]:
        """Return coefficients and errors as JSON-able data."""
        return {**super().record(), "rounding": self.rounding}

    @property
    def total(self) -> Fraction:
        """The sum of the proven errors of formula and rounding."""
        return self.error + Fraction(self.rounding)


@dataclass(frozen=True)
class MinimaxKernel(Fitted[MinimaxVariant], Quotient):
    """A best rational approximant of eps on an interval of v*.

    Attributes
    ----------
    m, n : int
        Degrees.
    accuracy : Fraction or None
        That asked for; None if the degrees were.

    The others, and errors, are those of `Fitted`.
    """

    m: int
    n: int
    variants: tuple[MinimaxVariant, ...]
    missing: tuple[tuple[str, str], ...]
    source: str
    accuracy: Fraction | None = None

    @property
    def lengths(self) -> tuple[int, int]:
        """The numbers of coefficients a and b."""
        return self.m + 1, self.n + 1

    @property
    def interval(self) -> tuple[Fraction, Fraction]:
        """The interval of v*."""
        return self.bound.low, Fraction(self.bound.high)

    @property
    def bounds(self) -> tuple[Certificate, ...]:
        """The certificate with the largest bound."""
        return (self.bound,)

    @property
    def name(self) -> str:
        """What was asked for: "minimax_1_4_v5" for degrees up to v* = 5, "minimax_v5_1em3" for an accuracy."""
        low, high = self.interval
        interval = f"v{identifier(below(high) if low == 0 else f'{above(low)}to{below(high)}')}"
        if self.accuracy is None:
            asked = f"{self.m}_{self.n}_{interval}"
        else:
            asked = f"{interval}_{accuracy_name(self.accuracy)}"
        return f"minimax_{asked}{measure_name(self.bound.measure)}"

    @property
    def pattern(self) -> str:
        """The form of the names."""
        return "minimax_M_N_vV" if self.accuracy is None else "minimax_vV_B"

    @property
    def domain(self) -> str:
        """The interval."""
        low, high = self.interval
        return f"{above(low)} <= v* <= {below(high)}"

    @property
    def proven(self) -> tuple[str, ...]:
        """Sentences on the proven errors."""
        return proven_errors(self.bounds, [(v.form.name, v.rounding) for v in self.variants])

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
            "v_star_max": below(self.interval[1]),
            "measure": self.bound.measure,
            "variants": [v.record() for v in self.variants],
            "missing": dict(self.missing),
            "source": self.source,
        }

    def certificates(self) -> list[dict[str, object]]:
        """Return the data for independent checks of the proofs, ready for JSON; coefficients are hexadecimal."""
        return [
            {
                "name": self.name,
                "type": v.form.name,
                **hexadecimals(a=v.a, b=v.b),
                **v.certificate.record(),
                "rounding": v.rounding,
            }
            for v in self.variants
        ]

    def rounded(self, form: Format) -> Values:
        """Return the coefficients a and b of a format, without leading ones that are zero."""
        variant = self.variant(form)
        return without_leading_zeros(variant.a), without_leading_zeros(variant.b)
