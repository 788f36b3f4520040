"""Lacunary kernels, in powers of a root of v* or of (1 - eps)/eps: machine coefficients with proven errors."""

from __future__ import annotations

import math
from abc import abstractmethod
from collections.abc import Sequence
from dataclasses import dataclass
from fractions import Fraction
from typing import ClassVar

from viscopade.approximation import half_line
from viscopade.approximation.inverse import INTERVAL_FORM, WHOLE_FORM, InverseForm
from viscopade.approximation.lacunary import Powers
from viscopade.approximation.measure import RELATIVE_TO
from viscopade.arithmetic.decimals import above, at_most, identifier
from viscopade.kernels import formulas
from viscopade.kernels.expressions import CodeBranch
from viscopade.kernels.forms.kernel import Fitted, Variant, accuracy_name, hexadecimals, measure_name
from viscopade.kernels.rounding_bounds import DIGITS, Size

HALF_LINE, INVERSE = "halfline", "inverse"

SPELLING = "(1p57em3 is 1.57e-3: p stands for the decimal point, m for the minus of an exponent)"

LEAST_BITS = 24  # an interval of eps begins at a multiple of 2^-24, which both types hold, as they do 1 - eps there


@dataclass(frozen=True)
class LacunaryVariant(Variant):
    """The coefficients of a kernel in one format, in the order of the exponents, and the proof of their error.

    Attributes
    ----------
    sizes : tuple of (str, Size)
        By function, what rounding adds, relative to the value of the formula.

    The others are those of `Variant`.
    """

    sizes: tuple[tuple[str, Size], ...]

    def rounding(self, function: str) -> str:
        """Return a bound of a function's rounding error, relative to the true value.

        Only for functions whose own relative error the certificate bounds.
        """
        return at_most(Fraction(dict(self.sizes)[function].relative) * (1 + self.error), DIGITS)

    def total(self, functions: Sequence[str]) -> Fraction:
        """Return a bound of the relative error, with rounding, of the worst of these functions."""
        return self.error + max(Fraction(self.rounding(name)) for name in functions)

    @property
    def roundings(self) -> dict[str, dict[str, str]]:
        """The sizes as JSON-able data."""
        return {name: {"relative": size.relative, "underflow": size.underflow} for name, size in self.sizes}


@dataclass(frozen=True)
class LacunaryKernel(Fitted[LacunaryVariant]):
    """A lacunary kernel: common base of half-line and inverse kernels.

    Attributes
    ----------
    powers : Powers
        The exponents in N and D.
    accuracy : Fraction or None
        That asked for; None if the powers were.

    The others, and errors, are those of `Fitted`.
    """

    powers: Powers
    variants: tuple[LacunaryVariant, ...]
    missing: tuple[tuple[str, str], ...]
    source: str
    accuracy: Fraction | None
    kind: ClassVar[str]
    """The first part of the name."""

    @property
    def lengths(self) -> tuple[int, int]:
        """The numbers of coefficients in N and D."""
        return len(self.powers.top), len(self.powers.bottom)

    @property
    def _asked(self) -> str:
        """The accuracy asked for, or else the degrees of N and D, as the end of a name."""
        return f"{self.powers.m}_{self.powers.n}" if self.accuracy is None else accuracy_name(self.accuracy)

    @property
    @abstractmethod
    def checked(self) -> tuple[str, ...]:
        """The functions whose relative error the certificate bounds."""

    @property
    @abstractmethod
    def formula(self) -> str:
        """The formula as text."""

    @property
    @abstractmethod
    def branches(self) -> tuple[CodeBranch, ...]:
        """The programs of the exported code."""

    @property
    @abstractmethod
    def root(self) -> Fraction:
        """The exponent of y = v*^root, or of y = ((1 - eps)/eps)^root."""

    @property
    def powers_text(self) -> str:
        """N and D as text, the end of the formula's text."""
        top, bottom = (
            " + ".join(f"{letter}{k} {_power(k)}" if k else constant for k in exponents)
            for letter, constant, exponents in (("a", "a0", self.powers.top), ("b", "1", self.powers.bottom))
        )
        return f"N = {top}, D = {bottom}"

    @property
    def facts(self) -> tuple[str, ...]:
        """Source, formula, domain and error."""
        head = (f"source: {self.source}", f"formula: {self.formula}", f"domain: {self.domain}")
        return (*head, *self.proven)

    def _head(self) -> dict[str, object]:
        """Return what the formula is besides its coefficients, as JSON-able data."""
        return {
            "name": self.name,
            "kind": self.kind,
            "root": str(self.root),
            "top": self.powers.top,
            "bottom": self.powers.bottom,
        }

    def record(self) -> dict[str, object]:
        """Return the formula as JSON-able data."""
        return {
            **self._head(),
            "formula": self.formula,
            "domain": self.domain,
            "measure": self.bound.measure,
            "variants": [v.record() | {"rounding": v.roundings} for v in self.variants],
            "missing": dict(self.missing),
            "source": self.source,
        }

    def certificates(self) -> list[dict[str, object]]:
        """Return the data for independent checks of the proofs, ready for JSON; coefficients are hexadecimal."""
        return [
            {
                **self._head(),
                "type": v.form.name,
                **hexadecimals(a=v.a, b=v.b),
                **v.certificate.record(),
                "rounding": v.roundings,
            }
            for v in self.variants
        ]

    @property
    def _bounds(self) -> str:
        """The bound, or those of the types."""
        same = len({v.certificate.bound for v in self.variants}) == 1
        return at_most(self.bound.bound) if same else self._per_type(lambda v: at_most(v.certificate.bound))


@dataclass(frozen=True)
class HalfLineKernel(LacunaryKernel):
    """Half-line kernel: eps = D/(D + v*^2 N) for all v* >= 0, with lacunary polynomials N and D in y = v*^(1/3).

    Attributes and errors are those of `LacunaryKernel`; the measure is "both" or "relative".
    """

    kind = HALF_LINE
    root = half_line.ROOT
    domain = "all v* >= 0"

    def __post_init__(self) -> None:
        super().__post_init__()
        if self.bound.high < math.inf or self.bound.measure == "speed":
            raise ValueError(f"{self.label}: the proof must be one of eps for all v* >= 0")

    @property
    def name(self) -> str:
        """What was asked for, "halfline_1em5"; "_relative" is appended in that measure."""
        return f"{HALF_LINE}_{self._asked}{measure_name(self.bound.measure)}"

    @property
    def formula(self) -> str:
        """The formula as text."""
        return f"eps = D/(D + v*^2 N), y = v*^(1/3), {self.powers_text}"

    @property
    def branches(self) -> tuple[CodeBranch, ...]:
        """The programs for v* <= 1 and v* > 1."""
        return formulas.half_line_branches(self.powers)

    @property
    def checked(self) -> tuple[str, ...]:
        """The functions whose relative error the certificate bounds."""
        return ("epsilon", "one_minus_epsilon") if self.bound.measure == "both" else ("epsilon",)

    @property
    def proven(self) -> tuple[str, ...]:
        """Sentences on the proven errors of formula and rounding, also for subnormal results."""
        of_loss = "(1 - eps)" if self.bound.measure == "both" else "of the formula's 1 - eps"
        return (
            f"proven: |formula - eps| / {RELATIVE_TO[self.bound.measure]} <= {self._bounds}",
            f"rounding of epsilon: adds at most {self._per_type(lambda v: v.rounding('epsilon') + ' eps')} (proven)",
            f"rounding of one_minus_epsilon: adds at most "
            f"{self._per_type(lambda v: f'{self._of_loss(v)} {of_loss}')} (proven)",
            f"underflow: adds at most {self._most_underflow()} of the type's smallest numbers (proven); that is felt "
            "where results are subnormal",
        )

    def _of_loss(self, variant: LacunaryVariant) -> str:
        function = "one_minus_epsilon"
        return variant.rounding(function) if function in self.checked else dict(variant.sizes)[function].relative

    def _most_underflow(self) -> str:
        return max((size.underflow for v in self.variants for _, size in v.sizes), key=Fraction)


@dataclass(frozen=True)
class InverseKernel(LacunaryKernel):
    """Inverse kernel: v* = y^k N/D with y = ((1 - eps)/eps)^root, for epsilon_min <= eps <= 1 or for 0 < eps <= 1.

    Attributes
    ----------
    epsilon_min : Fraction
        0, or where the interval begins that was asked for; N and D are then full polynomials, and k is 1.

    The others, and errors, are those of `LacunaryKernel`; the measure is "speed".
    """

    epsilon_min: Fraction
    kind = INVERSE
    checked = ("v_star",)

    def __post_init__(self) -> None:
        super().__post_init__()
        if self.bound.measure != "speed":
            raise ValueError(f"{self.label}: the proof must be one of v*")

    @property
    def epsilon_low(self) -> Fraction:
        """0, or where the proof begins: epsilon_min, rounded down to a multiple of 2^-24."""
        return interval_start(self.epsilon_min)

    @property
    def name(self) -> str:
        """What was asked for, with the interval: "inverse_e0p1_1em5", or "inverse_1em5" on (0, 1]."""
        interval = f"e{identifier(above(self.epsilon_min))}_" if self.epsilon_min else ""
        return f"{INVERSE}_{interval}{self._asked}"

    @property
    def form(self) -> InverseForm:
        """The root, and k."""
        return INTERVAL_FORM if self.epsilon_min else WHOLE_FORM

    @property
    def root(self) -> Fraction:
        """Exponent: y = ((1 - eps)/eps)^root."""
        return self.form.root

    @property
    def domain(self) -> str:
        """The values of eps; the least one is a number of both types."""
        if not self.epsilon_min:
            return "0 < eps <= 1"
        rounded = f" ({above(self.epsilon_min)} rounded down to a multiple of 2^-{LEAST_BITS})"
        return f"{float(self.epsilon_low)!r} <= eps <= 1{rounded if self.epsilon_low < self.epsilon_min else ''}"

    @property
    def ends(self) -> tuple[float, float] | None:
        """The least eps and the largest 1 - eps that are accepted; None for all of (0, 1]."""
        return (float(self.epsilon_low), float(1 - self.epsilon_low)) if self.epsilon_low else None

    @property
    def formula(self) -> str:
        """The formula as text."""
        return f"v* = {_power(self.form.shift)} N/D, y = ((1 - eps)/eps)^({self.root}), {self.powers_text}"

    @property
    def branches(self) -> tuple[CodeBranch, ...]:
        """The program, or those for eps >= 1/2 and eps < 1/2."""
        return formulas.inverse_branches(self.powers, self.form)

    def _head(self) -> dict[str, object]:
        ends = {"epsilon_min": str(self.epsilon_min), "epsilon_low": str(self.epsilon_low)}
        return {**super()._head(), **ends}

    @property
    def proven(self) -> tuple[str, ...]:
        """Sentences on the proven errors of formula and rounding."""
        return (
            f"proven: |formula - v*| / v* <= {self._bounds}; |formula - beta| / beta <= {self.bound_of_beta}",
            f"rounding of v_star: adds at most {self._per_type(lambda v: v.rounding('v_star') + ' v*')} (proven)",
            f"rounding of beta: adds at most {self._per_type(lambda v: self._of_beta(v) + ' beta')} (proven)",
        )

    @property
    def bound_of_beta(self) -> str:
        """A bound of the relative error of beta, which is v*^2 but for a factor."""
        return at_most((1 + Fraction(self.bound.bound)) ** 2 - 1)

    def _of_beta(self, variant: LacunaryVariant) -> str:
        return at_most(Fraction(dict(variant.sizes)["beta"].relative) * (1 + Fraction(self.bound_of_beta)), DIGITS)


def interval_start(epsilon_min: Fraction) -> Fraction:
    """Return the largest multiple of 2^-24 up to a number; it and its difference from 1 are exact in both types."""
    return Fraction(epsilon_min.numerator * 2**LEAST_BITS // epsilon_min.denominator, 2**LEAST_BITS)


def _power(exponent: int) -> str:
    return "y" if exponent == 1 else f"y^{exponent}"
