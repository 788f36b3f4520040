"""Records of fits: the coefficients of a formula in each format, and what is proven of them."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Iterator
from contextlib import suppress
from dataclasses import dataclass, replace
from decimal import Decimal
from fractions import Fraction
from typing import Any

from viscopade import arguments
from viscopade.approximation import remez
from viscopade.approximation.lacunary import LacunaryQuotient, Powers
from viscopade.approximation.lawson import LacunaryFit
from viscopade.arithmetic.decimals import at_most, identifier
from viscopade.arithmetic.formats import DOUBLE, FLOAT, Format
from viscopade.collision.exact import Exact
from viscopade.kernels.arithmetic import ARITHMETICS, Arithmetic
from viscopade.kernels.bound import ErrorBound
from viscopade.kernels.certificate import Certificate

LOOSER = 2
"""A bound in float may exceed the bound in double by this factor."""


@dataclass(frozen=True)
class Coefficients:
    """The coefficients of a formula N/D in one format, ascending, and what is proven of them.

    Attributes
    ----------
    form : Format
    a, b : tuple of float
        Numbers of the format; b_0 = 1.
    certificate : Certificate
        The certificate of the formula with these coefficients, evaluated exactly.
    bounds : tuple of ErrorBound
        The bounds of the functions that compute it.
    """

    form: Format
    a: tuple[float, ...]
    b: tuple[float, ...]
    certificate: Certificate
    bounds: tuple[ErrorBound, ...] = ()

    def __post_init__(self) -> None:
        if self.b[0] != 1:
            raise ValueError("b_0 must be 1")
        if any(self.form.nearest(Fraction(c)) != c for c in (*self.a, *self.b)):
            raise ValueError(f"a coefficient is not a number of type {self.form.name}")

    @property
    def exact(self) -> tuple[tuple[Fraction, ...], tuple[Fraction, ...]]:
        """The coefficients a and b as fractions."""
        return tuple(map(Fraction, self.a)), tuple(map(Fraction, self.b))

    def bound(self, result: str) -> ErrorBound:
        """Return the first bound of a function on the host."""
        return next(b for b in self.bounds if (b.result, b.arithmetic.place) == (result, "host"))

    def error(self, result: str) -> Fraction:
        """Return the proven error of a function on the host, with rounding."""
        bound = self.bound(result)
        return bound.relative + bound.last

    def record(self) -> dict[str, Any]:
        """Return type, coefficients as decimals that read back, and the formula's bound, as JSON-able data."""
        a, b = ([self.form.decimal(c).rstrip("f") for c in values] for values in (self.a, self.b))
        return {"type": self.form.name, "a": a, "b": b, "bound": at_most(self.certificate.bound)}

    def proof(self) -> dict[str, Any]:
        """Return type, coefficients in hexadecimal and the certificate, as JSON-able data for independent checks."""
        a, b = ([c.hex() for c in values] for values in (self.a, self.b))
        return {"type": self.form.name, "a": a, "b": b, **self.certificate.record()}


@dataclass(frozen=True)
class Fitted:
    """A fit in its formats.

    Attributes
    ----------
    variants : tuple of Coefficients
        Double comes first.
    missing : dict
        Why a type is left out, by its name.
    """

    variants: tuple[Coefficients, ...]
    missing: dict[str, str]

    @property
    def certificate(self) -> Certificate:
        """The certificate with the largest bound."""
        return max((v.certificate for v in self.variants), key=lambda proof: proof.bound)


def in_formats(
    prove: Callable[[Format], Coefficients],
    bounds: Callable[[Coefficients], Iterable[ErrorBound]],
    limit: Fraction | None = None,
) -> Fitted:
    """Return coefficients in type double, and in type float unless their error is too large.

    Parameters
    ----------
    prove : callable
        Gives the coefficients in a format, with the certificate.
    bounds : callable
        Gives the bounds of the functions, the first one on the host.
    limit : Fraction or None
        Largest error of the first function, with rounding. None: the formula's error is at most `LOOSER` times as large
        as in double.
    """

    def with_bounds(bare: Coefficients) -> Coefficients:
        return replace(bare, bounds=tuple(bounds(bare)))

    def within(error: Fraction, most: Fraction) -> None:
        if error > most:
            raise ValueError(f"with coefficients in float the error would be {at_most(error)}")

    first = with_bounds(prove(DOUBLE))
    try:
        second = prove(FLOAT)
        if limit is None:
            within(second.certificate.bound, LOOSER * first.certificate.bound)
        second = with_bounds(second)
        if limit is not None:
            within(second.error(second.bounds[0].result), limit)
    except (ValueError, ArithmeticError) as error:
        return Fitted((first,), {FLOAT.name: str(error)})
    return Fitted((first, second), {})


def on_machines(form: Format, bounds: Callable[[Arithmetic], Iterable[ErrorBound]]) -> Iterator[ErrorBound]:
    """Yield the bounds in each arithmetic of a format, without those of devices that are not proven."""
    for machine in (one for one in ARITHMETICS.values() if one.form == form):
        try:
            yield from list(bounds(machine))
        except ArithmeticError:
            if machine.place == "host":
                raise


def accuracy_of(accuracy: Exact, least: Fraction, name: str = "accuracy") -> Fraction:
    """Return an accuracy asked for, by its name in a refusal; expected is a number from `least` to 0.99."""
    expected = f"a number from {float(least):g} to 0.99"
    return arguments.exact_number(name, accuracy, expected, lambda x: least <= x <= Fraction("0.99"))


def accuracy_name(accuracy: Fraction) -> str:
    """Return an accuracy as part of a name, always with an exponent: 1em5 for 1e-5, 3p5em6 for 3.5e-6."""
    return identifier(f"{Decimal(at_most(accuracy)).normalize():e}")


# --- lacunary quotients -----------------------------------------------------------------------------------------------


def powers_text(form: Powers) -> str:
    """Return N and D as text, the end of a formula's text."""
    top, bottom = (
        " + ".join(f"{letter}{k} y" + f"^{k}" * (k > 1) if k else constant for k in exponents)
        for letter, constant, exponents in (("a", "a0", form.top), ("b", "1", form.bottom))
    )
    return f"N = {top}, D = {bottom}"


def with_proofs(
    found: LacunaryQuotient,
    prove: Callable[[LacunaryQuotient], Certificate],
    bounds: Callable[[Coefficients], Iterable[ErrorBound]],
) -> Fitted:
    """Return a lacunary quotient in its types, given the proof of one, and the bounds with rounding."""

    def proven(form: Format) -> Coefficients:
        a, b = (tuple(map(form.nearest, part)) for part in (found.a, found.b))
        proof = prove(LacunaryQuotient(found.powers, tuple(map(Fraction, a)), tuple(map(Fraction, b))))
        return Coefficients(form, a, b, proof)

    return in_formats(proven, bounds)


def first(
    wanted: Fraction, candidates: Iterable[tuple[float, Powers]], error_of: Callable[[Powers], Fraction]
) -> Powers:
    """Return the first powers whose kernel is proven to be accurate enough, rounding in type double included.

    Candidates come with their sampled errors, from which those that cannot be accurate enough are known. The most
    accurate one is proven to have the least error that `accuracy_of` accepts.
    """
    for error, choice in candidates:
        with suppress(ArithmeticError):  # there is no proof
            if error <= wanted and error_of(choice) <= wanted:
                return choice
    raise AssertionError(f"no kernel has a proven error of {float(wanted):g}, which is accepted")


def levelled(choices: Iterable[Powers], fit: Callable[[Powers], LacunaryFit]) -> Iterator[tuple[float, Powers]]:
    """Yield the sampled errors of the choices that have a best quotient, and the choices."""
    for form in choices:
        with suppress(remez.NoBest):
            yield fit(form).error, form
