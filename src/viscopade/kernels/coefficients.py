"""Records of fits: the coefficients of a formula, and what is proven of them in each format."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
from contextlib import suppress
from dataclasses import dataclass, field
from decimal import Decimal
from fractions import Fraction
from typing import Any

from viscopade import arguments
from viscopade.approximation import remez
from viscopade.approximation.lacunary import Powers
from viscopade.approximation.lawson import LacunaryFit
from viscopade.arithmetic.decimals import at_most, identifier
from viscopade.arithmetic.formats import DOUBLE, FLOAT, FORMATS, Format
from viscopade.collision.exact import Exact
from viscopade.kernels.arithmetic import ARITHMETICS, HOSTS, Arithmetic
from viscopade.kernels.bound import ErrorBound
from viscopade.kernels.certificate import Certificate
from viscopade.kernels.kernel import Proof

LOOSER = 100
"""Without a limit, the error in float may be this many times as large as in double. Chosen by hand: rounding in
float adds 1e-6 to 3e-5, so that formulas to 1e-7 or better would lose most of their accuracy. It decides no kernel of
the catalogue."""


@dataclass(frozen=True)
class ProvenQuotient:
    """A quotient N/D whose coefficients are exactly doubles, with what is proven of it: a record.

    In type float each coefficient is rounded once more, which is in the bounds as rounding.

    Attributes
    ----------
    a, b : tuple of float
        Coefficients, ascending; b_0 = 1.
    certificate : Certificate
        The certificate of N/D, evaluated exactly.
    bounds : tuple of ErrorBound
        The bounds of all functions that compute it, in each arithmetic.
    missing : dict
        Why type float is left out, by its name, if it is.
    """

    a: tuple[float, ...]
    b: tuple[float, ...]
    certificate: Certificate
    bounds: tuple[ErrorBound, ...]
    missing: dict[str, str] = field(default_factory=dict)

    def __post_init__(self) -> None:
        if self.b[0] != 1:
            raise ValueError("b_0 must be 1")

    @property
    def formats(self) -> tuple[Format, ...]:
        """The types that are not left out; double comes first."""
        return tuple(form for form in FORMATS.values() if form.name not in self.missing)

    def rounded(self, form: Format) -> tuple[tuple[float, ...], tuple[float, ...]]:
        """Return the coefficients a and b, rounded to a type."""
        return tuple(map(form.nearest, map(Fraction, self.a))), tuple(map(form.nearest, map(Fraction, self.b)))

    def bound(self, result: str, form: Format = DOUBLE) -> ErrorBound:
        """Return the first bound of a function on the host."""
        return next(b for b in self.bounds if (b.result, b.arithmetic) == (result, HOSTS[form.name]))

    def error(self, result: str) -> Fraction:
        """Return the proven error of a function on the host in type double, with rounding."""
        return _error_and_rounding(self.bound(result))

    def variants(self, rounding: Mapping[str, object]) -> list[dict[str, Any]]:
        """Return each type's coefficients as decimals that read back, and bounds, as JSON-able data.

        `rounding` has the bound of rounding of each type.
        """
        # C's suffix of float literals is no part of a number in JSON.
        return [
            {
                "type": form.name,
                **{
                    letter: [form.decimal(c).rstrip("f") for c in values]
                    for letter, values in zip("ab", self.rounded(form), strict=True)
                },
                "bound": at_most(self.certificate.bound),
                "rounding": rounding[form.name],
            }
            for form in self.formats
        ]

    def proof(self, head: Mapping[str, object], rounding: Mapping[str, object]) -> Proof:
        """Return what independent checks need: `head`, coefficients in hexadecimal, bounds of rounding; certificate."""
        coefficients = {"a": [*map(float.hex, self.a)], "b": [*map(float.hex, self.b)]}
        return {**head, "type": DOUBLE.name, **coefficients, "rounding": rounding}, self.certificate


def proven_quotient(
    a: Sequence[float],
    b: Sequence[float],
    certificate: Certificate,
    bounds: Callable[[Format], Iterable[ErrorBound]],
    limit: Fraction | None = None,
) -> ProvenQuotient:
    """Return a quotient with its bounds in type double, and in type float unless its error is too large.

    Parameters
    ----------
    a, b : sequence of float
        Coefficients of N and D, ascending.
    certificate : Certificate
        That of N/D, evaluated exactly.
    bounds : callable
        Gives the bounds of the functions in a type, the first one on the host.
    limit : Fraction or None
        Largest error of the first function in type float, with rounding; None: `LOOSER` times that in double.
    """
    in_double = tuple(bounds(DOUBLE))
    largest_error = LOOSER * _error_and_rounding(in_double[0]) if limit is None else limit
    try:
        # A coefficient that is no normal float is a ValueError, a sum that may vanish an ArithmeticError.
        in_float = tuple(bounds(FLOAT))
        if _error_and_rounding(in_float[0]) > largest_error:
            raise ValueError(f"in float the error would be {at_most(_error_and_rounding(in_float[0]))}")
    except (ValueError, ArithmeticError) as error:
        return ProvenQuotient(tuple(a), tuple(b), certificate, in_double, {FLOAT.name: str(error)})
    return ProvenQuotient(tuple(a), tuple(b), certificate, (*in_double, *in_float))


def _error_and_rounding(bound: ErrorBound) -> Fraction:
    """Return the formula's error and all of rounding as one relative error; results that underflow are left out."""
    return bound.relative + bound.last


def bounds_on_machines(form: Format, bounds: Callable[[Arithmetic], Iterable[ErrorBound]]) -> Iterator[ErrorBound]:
    """Yield the bounds in each arithmetic of a format, without those of devices that are not proven.

    `bounds` gives those in one arithmetic.
    """
    for machine in ARITHMETICS.values():
        if machine.form != form:
            continue
        try:
            yield from list(bounds(machine))
        except ArithmeticError:
            # On a device a denominator may vanish within its larger error; a kernel without a bound there is none for
            # it. Without a bound on the host there is no kernel.
            if machine.place == "host":
                raise


def checked_accuracy(accuracy: Exact, least: Fraction, name: str = "accuracy", further: str = "") -> Fraction:
    """Return an accuracy, a relative error, exactly; expected is a number from `least` to 0.99.

    `name` is that of the argument in a refusal, and `further` its end.
    """
    # At 1, or 100 %, eps = 0 would be accurate enough; 0.99 is a round number below it.
    expected = f"a number from {float(least):g} to 0.99{further}"
    return arguments.exact_number(name, accuracy, expected, lambda x: least <= x <= Fraction("0.99"))


def accuracy_name(accuracy: Fraction) -> str:
    """Return an accuracy as part of a name, always with an exponent: 1em5 for 1e-5, 3p5em6 for 3.5e-6."""
    return identifier(f"{Decimal(at_most(accuracy)).normalize():e}")


# --- lacunary quotients -----------------------------------------------------------------------------------------------


def powers_text(exponents: Powers) -> str:
    """Return N and D as text, the end of a formula's text: "N = a0 + a4 y^4, D = 1 + b4 y^4"."""
    # b_0 is 1, and y^1 is written y.
    top, bottom = (
        " + ".join(f"{letter}{k} y" + f"^{k}" * (k > 1) if k else constant for k in powers)
        for letter, constant, powers in (("a", "a0", exponents.top), ("b", "1", exponents.bottom))
    )
    return f"N = {top}, D = {bottom}"


def first_accurate(
    accuracy: Fraction, candidates: Iterable[tuple[float, Powers]], error_of: Callable[[Powers], Fraction]
) -> Powers:
    """Return the first powers whose kernel is proven to be accurate enough, rounding in type double included.

    Candidates, the cheapest first, come with their sampled errors, from which those that cannot be accurate enough are
    known; `error_of` proves an error, which takes about a second. The most accurate one is proven to have the least
    error that `checked_accuracy` accepts.
    """
    for error, choice in candidates:
        with suppress(ArithmeticError):  # there is no proof
            if error <= accuracy and error_of(choice) <= accuracy:
                return choice
    raise AssertionError(f"no kernel has a proven error of {float(accuracy):g}, which is accepted")


def sampled_candidates(
    choices: Iterable[Powers], fit: Callable[[Powers], LacunaryFit]
) -> Iterator[tuple[float, Powers]]:
    """Yield the sampled errors of the choices that have a best quotient, and the choices, for `first_accurate`.

    `fit` finds the best quotient with given powers.
    """
    for exponents in choices:
        with suppress(remez.NoBest):
            yield fit(exponents).error, exponents
