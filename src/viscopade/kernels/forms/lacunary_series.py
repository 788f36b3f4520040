"""Formulas of lacunary kernels for `certificate`: exact coefficients, power-series arithmetic."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from fractions import Fraction

from flint import arb, arb_series

from viscopade.approximation.lacunary import Terms, mirrored
from viscopade.arithmetic.balls import ball_of
from viscopade.kernels.certificate import polynomial, quotient

HALF = Fraction(1, 2)


@dataclass(frozen=True)
class HalfLineFormula:
    """Half-line formula eps = D/(D + v*^2 N): N (top), D (bottom) lacunary in y = v*^(1/3), deg N = deg D + 4."""

    top: Terms
    bottom: Terms

    @property
    def power(self) -> int:
        """The r of `certificate.Formula.power`, 3: the formula is a smooth function of v*^(1/3)."""
        return 3

    def epsilon(self, y: arb_series) -> arb_series:
        """Return D/(D + v*^2 N)."""
        n, d = (_evaluated(part, y) for part in (self.top, self.bottom))
        return quotient(d, d + y**6 * n)

    def loss_ratio(self, y: arb_series) -> arb_series:
        """Return N/(D + v*^2 N)."""
        n, d = (_evaluated(part, y) for part in (self.top, self.bottom))
        return quotient(n, d + y**6 * n)

    def limit(self, u: arb) -> arb:
        """Return eps v*^(10/3) for all v* >= 1/u."""
        w = _from_zero(u.root(3))
        n, d = (_evaluated_at(mirrored(part, part[-1][0]), w) for part in (self.top, self.bottom))
        return d / (n + w**10 * d)


@dataclass(frozen=True)
class LacunaryInverse:
    """Inverse formula v* = y^k N/D: N (top), D (bottom) lacunary in y = ((1 - eps)/eps)^root, k = 1/(2 root)."""

    top: Terms
    bottom: Terms
    root: Fraction

    @property
    def power(self) -> int:
        """The r of `certificate.InverseFormula.power`, k: near 0, y is v*^(1/k) times a smooth function."""
        return int(HALF / self.root)

    def ratio(self, y: arb_series, odds_ratio: arb_series) -> arb_series:
        """Return the formula's v* divided by the true one, v*^(1/k), given (1 - eps)/eps / v*^2."""
        log_odds = odds_ratio.log()
        own = y * (log_odds * ball_of(self.root)).exp()
        return (log_odds / 2).exp() * quotient(_evaluated(self.top, own), _evaluated(self.bottom, own))

    def limit(self, odds: arb) -> arb:
        """Return v* ((1 - eps)/eps)^(-3/10) for all eps with eps/(1 - eps) <= odds."""
        if self.root != Fraction(1, 10) or self.bottom[-1][0] - self.top[-1][0] != 2:
            raise ValueError("the formula does not go like ((1 - eps)/eps)^(3/10)")
        w = _from_zero(odds ** ball_of(self.root))
        n, d = (_evaluated_at(mirrored(part, part[-1][0]), w) for part in (self.top, self.bottom))
        return n / d


def _evaluated(lacunary: Terms, y: arb_series) -> arb_series:
    by_exponent: Mapping[int, Fraction] = dict(lacunary)
    dense = [by_exponent.get(i, Fraction(0)) for i in range(lacunary[-1][0] + 1)]
    return polynomial([ball_of(c) for c in dense], y)


def _evaluated_at(lacunary: Terms, y: arb) -> arb:
    return sum((ball_of(c) * y**exponent for exponent, c in lacunary), arb(0))


def _from_zero(upper: arb) -> arb:
    """Return a ball that contains [0, upper]."""
    half = upper.abs_upper() / 2
    return arb(half.mid(), half.abs_upper())
