r"""Balls of functions (Wiener algebra): polynomials with one proven error for rounding and truncation together.

The Wiener algebra of power series f(y) = sum c_j y^j with norm ||f|| = sum |c_j| has ||f g|| <= ||f|| ||g||, and
|f(y)| <= ||f|| on [0, 1]. A `FunctionBall` is the set of all f with

    || f - polynomial / 2^bits || <= error / 2^bits,

the polynomial's coefficients being integers. A product is truncated to `terms` coefficients. The exact norm of the
truncated part is added to the error, and one unit a coefficient for rounding. No bound needs an estimate of the decay
of the true coefficients: every bound is a sum over known integers.
See docs/theory/error-bounds.md for the proofs.
"""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from dataclasses import dataclass
from fractions import Fraction
from math import lcm

from flint import arb, arb_series, fmpz, fmpz_poly

from viscopade.arithmetic.balls import working


@dataclass(frozen=True)
class FunctionBall:
    """A ball of functions; `norm` is the norm of the polynomial, in the same units as `error` (2^-bits)."""

    polynomial: fmpz_poly
    norm: int
    error: int

    @property
    def bound(self) -> int:
        """Norm of the largest member."""
        return self.norm + self.error


def shifted_up(value: int, shift: int) -> int:
    """Return value / 2^shift, rounded up."""
    return -((-value) >> shift)


def divided_up(value: int, divisor: int) -> int:
    """Return value / divisor (divisor > 0), rounded up."""
    return -((-value) // divisor)


def norm(coefficients: Sequence[fmpz]) -> int:
    """Sum of the absolute values."""
    return int(sum(map(abs, coefficients)))


@dataclass(frozen=True)
class Wiener:
    """The arithmetic of `FunctionBall` with `terms` coefficients in units of 2^-bits."""

    bits: int
    terms: int

    def element(self, coefficients: Sequence[fmpz | int], error: int) -> FunctionBall:
        """Return the element with these integer coefficients."""
        polynomial = fmpz_poly(list(coefficients))
        return FunctionBall(polynomial, norm(polynomial.coeffs()), error)

    def rounded(self, polynomial: fmpz_poly, error: int) -> FunctionBall:
        """Return `polynomial` (and `error`), given in units of 2^(-2 bits), cut and rounded to an element."""
        coefficients = polynomial.coeffs()
        head = [c >> self.bits for c in coefficients[: self.terms]]
        # What is cut off counts with its norm. Rounding down (>>) changes each coefficient by less than a unit.
        cut_off = shifted_up(norm(coefficients[self.terms :]) + error, self.bits)
        return self.element(head, cut_off + len(head))

    def product(self, f: FunctionBall, g: FunctionBall) -> FunctionBall:
        """Return f g."""
        # With the polynomials p, q of f, g: ||f g - p q|| <= ||f|| ||g - q|| + ||f - p|| ||q||.
        return self.rounded(f.polynomial * g.polynomial, f.bound * g.error + f.error * g.norm)

    def root_and_half_inverse(self, square: Sequence[Fraction]) -> tuple[FunctionBall, FunctionBall]:
        """Return f = sqrt(square), f(0) > 0, and 1/(2 f), for a polynomial without a zero in |y| <= 1.

        The polynomials f and w (for 1/(2 f)) come from unproven floating-point series; only the residuals f^2 - square
        and 1 - 2 f w, computed exactly, enter the bounds (a Newton-Kantorovich argument: docs/theory/error-bounds.md,
        step 1).

        Parameters
        ----------
        square : sequence of Fraction
            Coefficients of y^0, y^1, … of the polynomial.
        """
        # The number 1 in units of 2^-bits. Products have the unit one^-2, and a shift by `bits` brings them back. All
        # bounds are rounded up.
        one = 1 << self.bits
        f, w = self._approximate_root(square)
        # The polynomial times its common denominator is a polynomial of integers.
        denominator = lcm(*(c.denominator for c in square))
        scaled = fmpz_poly([int(c * denominator) * one * one for c in square])

        # residual = ||f^2 - square||, defect = ||1 - 2 f w|| < 1: so 2 f has an inverse, of norm
        # ||w|| / (1 - defect) at most.
        residual = shifted_up(divided_up(norm((f * f * denominator - scaled).coeffs()), denominator), self.bits)
        defect = shifted_up(norm((2 * f * w - one * one).coeffs()), self.bits)
        _require(defect < one)
        w_norm = norm(w.coeffs())
        inverse_norm = divided_up(w_norm * one, one - defect)

        # Newton-Kantorovich: with 4 inverse_norm^2 residual < 1 there is a root within 2 inverse_norm residual of f. It
        # is the one that is positive at 0 if f(0) exceeds this distance.
        _require(4 * shifted_up(inverse_norm * inverse_norm, self.bits) * residual < one * one)
        f_error = shifted_up(2 * inverse_norm * residual, self.bits)
        _require(f_error < int(f[0]))

        # The root F differs from f by f_error: ||1 - 2 F w|| <= defect + 2 ||w|| f_error, and
        # ||1/(2 F) - w|| <= ||w|| defect / (1 - defect) with the larger defect.
        defect += shifted_up(2 * w_norm * f_error, self.bits)
        _require(defect < one)
        w_error = divided_up(w_norm * defect, one - defect)
        return FunctionBall(f, norm(f.coeffs()), f_error), FunctionBall(w, w_norm, w_error)

    def _approximate_root(self, square: Sequence[Fraction]) -> tuple[fmpz_poly, fmpz_poly]:
        """Return f = sqrt(square) and its half inverse 1/(2 f) as series in units of 2^-bits, unproven.

        `square` has the coefficients of y^0, y^1, …, the first one positive.
        """
        # More bits than the result has, for what the recursions of a long series lose: measured, at most 26 bits for
        # the squares that `viscopade.theory.series` takes, of laws of contact with the parameter nu = (a + 1)/(b + 1)
        # from 1 to 11, with up to 4,200 terms. 64 bits and one for every four terms, a choice, are more than that. Too
        # few would only make the residuals of `root_and_half_inverse` larger, until it refuses them.
        with working(self.bits + self.terms // 4 + 64, self.terms):
            series = arb_series([arb(c.numerator) / c.denominator for c in square], self.terms)
            root = series.sqrt()
            half_inverse = (2 * root).inv()
            scale = arb(2) ** self.bits
            return _scaled_floor(root, scale), _scaled_floor(half_inverse, scale)


class Orders(list[FunctionBall]):
    """Functions f_0, f_1, … that are computed one after the other, each from a sum over those before."""

    def __init__(self, first_orders: Iterable[FunctionBall]) -> None:
        super().__init__()
        self._squares = fmpz_poly()  # f_1^2 + f_2^2 + …
        for f in first_orders:
            self.append(f)

    def append(self, f: FunctionBall) -> None:
        """Append the next function."""
        if self:
            self._squares += f.polynomial * f.polynomial
        super().append(f)

    def convolution(self) -> tuple[fmpz_poly, int]:
        """Return sum_{0<i<n} f_i f_{n-i} for the next n in units of 2^(-2 bits): the exact polynomial, and its error.

        2 f g = (f + g)^2 - f^2 - g^2, as FLINT squares a polynomial in two thirds of the time of a product.
        """
        # In the sum over i < n/2 of f_i and f_(n-i) each square appears once, but for the middle one of an even n.
        n, total, error = len(self), -self._squares, 0
        # The pairs f_i, f_(n-i) for 0 < i < n/2; self[:0:-1] is f_(n-1), f_(n-2), … f_1.
        for f, g in zip(self[1 : (n + 1) // 2], self[:0:-1], strict=False):
            both = f.polynomial + g.polynomial
            total += both * both
            # ||f g - p q|| <= ||f|| ||g - q|| + ||f - p|| ||q||, twice: the sum has f_i f_(n-i) and f_(n-i) f_i.
            error += 2 * (f.bound * g.error + f.error * g.norm)
        if n % 2 == 0:
            # `_squares` takes one square of the middle function away, and the sum has one: so two are added.
            middle = self[n // 2]
            total += 2 * middle.polynomial * middle.polynomial
            # ||f^2 - p^2|| <= (||f|| + ||p||) ||f - p||
            error += (middle.bound + middle.norm) * middle.error
        return total, error


def _require(condition: bool) -> None:
    if not condition:
        raise ArithmeticError("too few terms or bits for the square root")


def _scaled_floor(power_series: arb_series, scale: arb) -> fmpz_poly:
    """Return the middles of the coefficients, times `scale`, as integers; to the unit, which nothing relies on."""
    # A floor that is not unique, None, would shift the others, and so be refused with large residuals.
    whole = ((c.mid() * scale).floor().unique_fmpz() for c in power_series.coeffs())
    return fmpz_poly([c for c in whole if c is not None])
