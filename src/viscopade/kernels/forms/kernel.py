"""Kernels: formulas with what is proven of their errors, frozen, from which every exported file is written.

`Kernel` is what all of them have. `Fitted` kernels have machine coefficients, in each format with a proof of its own.
"""

from __future__ import annotations

from abc import ABC, abstractmethod
from collections.abc import Callable
from dataclasses import dataclass
from decimal import Decimal
from fractions import Fraction
from json import dumps
from typing import Generic, TypeVar
from zlib import crc32

from viscopade.arithmetic.decimals import above, at_most, below, identifier
from viscopade.arithmetic.formats import Format
from viscopade.kernels.certificate import Certificate
from viscopade.theory.law import VISCOELASTIC, Law


class Kernel(ABC):
    """A formula of eps or of v*, with proven errors, for the exporters.

    Attributes
    ----------
    source : str
        One line: where the formula comes from.
    law : Law
        The law of contact; v* = kappa^(1/law.d). All but Padé approximants are of the paper's law.
    """

    source: str
    law: Law = VISCOELASTIC

    @property
    @abstractmethod
    def name(self) -> str:
        """The end of the functions' names, which lasts: it says what was asked for, and not what is proven."""

    @property
    def identity(self) -> str:
        """A number that other kernels do not have, for include guards: 32 bits that depend on the whole record."""
        return identity_of(dumps(self.record()))

    @property
    def label(self) -> str:
        """The name in comments and messages."""
        return self.name

    @property
    def of_speed(self) -> bool:
        """Whether there are functions of speed and beta besides those of v*: for the paper's law."""
        return self.law == VISCOELASTIC

    @property
    @abstractmethod
    def domain(self) -> str:
        """The domain of the formula, as part of a sentence."""

    @property
    def facts(self) -> tuple[str, ...]:
        """Sentences on the formula for the head of a file: source, domain and errors."""
        return (f"source: {self.source}", f"domain: {self.domain}", *self.proven)

    @property
    @abstractmethod
    def proven(self) -> tuple[str, ...]:
        """Sentences on the proven errors, a part of `facts`."""

    @abstractmethod
    def record(self) -> dict[str, object]:
        """Return the formula as JSON-able data."""

    @abstractmethod
    def certificates(self) -> list[dict[str, object]]:
        """Return the data for independent checks of the proofs, ready for JSON."""


@dataclass(frozen=True)
class Variant:
    """The coefficients of a kernel in one format, ascending, and the proof of their error.

    Attributes
    ----------
    form : Format
    a, b : tuple of float
        Numbers of the format; b_0 = 1.
    certificate : Certificate
        Of the formula with these coefficients, evaluated exactly.
    """

    form: Format
    a: tuple[float, ...]
    b: tuple[float, ...]
    certificate: Certificate

    def __post_init__(self) -> None:
        if self.b[0] != 1:
            raise ValueError("b_0 must be 1")
        if any(self.form.nearest(Fraction(c)) != c for c in (*self.a, *self.b)):
            raise ValueError(f"a coefficient is not a number of type {self.form.name}")

    @property
    def error(self) -> Fraction:
        """The proven bound of the error, without rounding."""
        return Fraction(self.certificate.bound)

    def record(self) -> dict[str, object]:
        """Return type, coefficients and bound as JSON-able data."""
        return {
            "type": self.form.name,
            **decimals(self.form, a=self.a, b=self.b),
            "bound": at_most(self.certificate.bound),
        }


AnyVariant = TypeVar("AnyVariant", bound=Variant)


class Fitted(Kernel, Generic[AnyVariant]):
    """A kernel with machine coefficients.

    Attributes
    ----------
    variants : tuple of Variant
        At least one; all of the same measure and interval.
    missing : tuple of (str, str)
        For names of types without a variant, the reason.
    source : str

    Raises
    ------
    ValueError
        If these contradict each other.
    """

    variants: tuple[AnyVariant, ...]
    missing: tuple[tuple[str, str], ...]

    def __post_init__(self) -> None:
        proofs = [v.certificate for v in self.variants]
        if len({(proof.low, proof.high, proof.measure) for proof in proofs}) != 1:
            raise ValueError(f"{self.label}: the variants must be of one interval and one measure")
        if any((len(v.a), len(v.b)) != self.lengths for v in self.variants):
            raise ValueError(f"{self.label}: wrong number of coefficients")

    @property
    @abstractmethod
    def lengths(self) -> tuple[int, int]:
        """The numbers of coefficients a and b."""

    @property
    def bound(self) -> Certificate:
        """The certificate with the largest bound."""
        return max(self.variants, key=lambda v: v.error).certificate

    def variant(self, form: Format) -> AnyVariant:
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

    def _per_type(self, phrase: Callable[[AnyVariant], str]) -> str:
        return " and ".join(f"{phrase(v)} in type {v.form.name}" for v in self.variants)


# --- names and numbers as text ----------------------------------------------------------------------------------------


def measure_name(measure: str) -> str:
    """Return the end of functions' names for a measure that is not "both"."""
    return "" if measure == "both" else f"_{measure}"


def span(low: Fraction, high: Fraction) -> str:
    """Return an interval of v* as text."""
    return f"v* <= {below(high)}" if low == 0 else f"{above(low)} <= v* <= {below(high)}"


def accuracy_name(accuracy: Fraction) -> str:
    """Return an accuracy as part of a name, always with an exponent: 1em5 for 1e-5, 3p5em6 for 3.5e-6."""
    return identifier(f"{Decimal(at_most(accuracy)).normalize():e}")


def identity_of(text: str) -> str:
    """Return 32 bits of a text's checksum as a constant of C."""
    return f"0x{crc32(text.encode()):08x}"


def decimals(form: Format, **coefficients: tuple[float, ...]) -> dict[str, object]:
    """Return coefficients by letter, as decimals that read back."""
    return {letter: [form.decimal(c).rstrip("f") for c in values] for letter, values in coefficients.items()}


def hexadecimals(**coefficients: tuple[float, ...]) -> dict[str, object]:
    """Return coefficients by letter, exactly."""
    return {letter: [c.hex() for c in values] for letter, values in coefficients.items()}
