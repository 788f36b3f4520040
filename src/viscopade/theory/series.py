"""The series eps = 1 + sum h_k v*^k (eq:epsSeriesAdvanced) with a proven enclosure of every coefficient.

The way from the equation of motion to h_k has four steps, each a function below:

1. `g_coefficients`: G_n, the coefficients of V(K) = g(0) (section 2.2), by Taylor series from both ends of
   0 <= r <= 1, in the ball arithmetic of functions of `viscopade.arithmetic.function_balls`;
2. `lambda_coefficients`: the odd function Lambda of time reversal (section 2.4), not needed for
3. `_log_eps0`: ln eps0 as a power series in kappa = v*^2, from eps0 = V(-K)/V(K), kappa = (5/4)^(2/5) K V(K)^(1/5);
4. `end_series`, `series`: eps = eps0 H((4/5) v*^5 sqrt(eps0)) with the rational series H (section 2.3).

Steps 2 to 4 are arithmetic of truncated power series in balls (FLINT), which has no truncation error.
"""

from __future__ import annotations

from collections import deque
from collections.abc import Callable
from dataclasses import dataclass
from fractions import Fraction
from functools import lru_cache
from math import log2
from typing import Any, SupportsIndex

import numpy as np
from flint import arb, arb_series, fmpq, fmpq_poly, fmpq_series, fmpz_poly
from mpmath import mp
from numpy.typing import NDArray

from viscopade import arguments
from viscopade.arithmetic.balls import bits_for, decimal_string, fixed_point, to_mpf, working
from viscopade.arithmetic.function_balls import FunctionBall, Wiener, divided_up
from viscopade.progress import track

# Where the two Taylor series meet: at r = 15/32 both converge about equally fast, like 0.469^j around r = 0 and like
# ((17/32) / (2 sin(pi/5)))^j = 0.452^j around the turning point r = 1.
MEETING_POINT = Fraction(15, 32)
BITS_PER_TERM = 1.09  # -log2(15/32), rounded down

GUARD_BITS = 16
# Two attempts usually suffice; this many mean that a coefficient is exactly zero.
MAX_ATTEMPTS = 20


@dataclass(frozen=True)
class Series:
    """The first coefficients of eps = sum h_k v*^k (eq:epsSeriesAdvanced).

    Attributes
    ----------
    order : int
        The highest power of v*.
    digits : int
        Significant digits to which every coefficient is determined.
    h : tuple of flint.arb, length order + 1
        Proven enclosures of h_0 … h_order.
    """

    order: int
    digits: int
    h: tuple[arb, ...]

    def __post_init__(self) -> None:
        if len(self.h) != self.order + 1:
            raise ValueError(f"a series of order {self.order} has {self.order + 1} coefficients, not {len(self.h)}")
        if self.h[0] != 1:
            raise ValueError("h_0 must be 1: eps = 1 at v* = 0")
        if not all(_determined(h_k, self.digits) for h_k in self.h):
            raise ValueError(f"an enclosure is too wide for {self.digits} digits")

    def decimals(self, digits: int | None = None) -> tuple[str, ...]:
        """Return the coefficients as decimal strings, correctly rounded to `digits` (at most `self.digits`).

        Raises
        ------
        ArithmeticError
            If, for fewer than `self.digits`, an enclosure happens to lie across a boundary of rounding.
        """
        digits = self.digits if digits is None else arguments.integer("digits", digits, 1, self.digits)
        return tuple(_decimal(h_k, digits) for h_k in self.h)

    def mpf(self) -> tuple[mp.mpf, ...]:
        """Return the middles of the enclosures as mpmath numbers (relative error below 5 10^-digits)."""
        return tuple(to_mpf(h_k) for h_k in self.h)

    def floats(self) -> NDArray[np.float64]:
        """Return the coefficients as doubles."""
        return np.array([float(h_k.mid()) for h_k in self.h])


def _decimal(ball: arb, digits: int) -> str:
    text = decimal_string(ball, digits)
    if text is None:
        raise ArithmeticError(f"{ball} does not determine {digits} digits")
    return text


def _determined(ball: arb, digits: int) -> bool:
    return decimal_string(ball, digits) is not None


def series(order: SupportsIndex, digits: SupportsIndex = 30) -> Series:
    """Return h_0 … h_order, each proven to `digits` significant digits.

    Parameters
    ----------
    order : int
        Highest power of v*, 0 to 1000.
    digits : int
        Significant digits, 1 to 5000.

    Raises
    ------
    TypeError, ValueError
        If an argument is not an integer or out of range.

    Notes
    -----
    Working precision and number of Taylor terms come from `digits` and `order`; if the enclosures turn out too wide
    they are raised by what was missing, so the digits asked for are always there.
    """
    return _series(arguments.order(order), arguments.digits(digits))


_derivations: deque[Series] = deque(maxlen=16)  # the latest ones


@lru_cache(maxsize=64)
def _series(order: int, digits: int) -> Series:
    """Return h_0 … h_order out of a longer and more accurate series, if one was derived: its balls may be narrower."""
    for known in tuple(_derivations):  # another thread may append
        h = known.h[: order + 1]
        if known.order >= order and known.digits >= digits and all(_determined(h_k, digits) for h_k in h):
            return Series(order, digits, h)
    return derived(order, digits)


@lru_cache(maxsize=16)
def derived(order: int, digits: int) -> Series:
    """Return h_0 … h_order, derived to just these digits: the balls are the same whatever was derived before."""
    found = Series(order, digits, _enclosed(lambda effort: _h(order, effort), order // 2, digits))
    _derivations.append(found)
    return found


def lambda_coefficients(count: SupportsIndex, digits: SupportsIndex = 30) -> tuple[arb, ...]:
    """Return enclosures of lambda_1, lambda_3, … (`count` of them), Lambda(nu) = sum lambda_k nu^k (section 2.4).

    Every decimal is determined to `digits` significant digits.
    """
    count = arguments.integer("count", count, 1, arguments.MAX_ORDER // 4)
    return _enclosed(lambda effort: _lambda(2 * count, effort), 2 * count, arguments.digits(digits))


def g_coefficients(order: SupportsIndex, digits: SupportsIndex = 30) -> tuple[arb, ...]:
    """Return enclosures of G_0 … G_order, the coefficients of V(K) = g(0) (section 2.2), to `digits` digits."""
    n = arguments.integer("order", order, 0, arguments.MAX_ORDER // 2)
    return _enclosed(lambda effort: _g(n, effort), n, arguments.digits(digits))


# --- effort: how much precision and how many terms ----------------------------------------------------------------


@dataclass(frozen=True)
class Effort:
    """Computational effort: working precision in bits, and number of Taylor coefficients on either side."""

    bits: int
    terms: int

    @classmethod
    def guess(cls, orders: int, digits: int) -> Effort:
        """Return an estimate of the effort for `orders` orders in K; its slopes were measured, not proven.

        The singularities at the fifth roots of unity grow by one power an order, so Taylor coefficient j of g_n is
        larger than that of g_0 by about j^n/n!, and an order costs about log2(1 + terms/orders) bits of truncation.
        """
        bits = bits_for(digits) + GUARD_BITS
        lost = orders * (log2(1 + bits / max(orders, 1)) + 0.4)
        terms = int((bits + lost) / BITS_PER_TERM) + 8
        return cls(int(bits + 2.2 * orders) + terms.bit_length() + 8, terms)

    def raised(self, missing_bits: int) -> Effort:
        """Return the estimated effort for `missing_bits` more bits."""
        more = missing_bits + 8
        return Effort(self.bits + more, self.terms + int(more / BITS_PER_TERM) + 1)


def _enclosed(compute: Callable[[Effort], tuple[arb, ...]], orders: int, digits: int) -> tuple[arb, ...]:
    """Compute with growing effort until every enclosure determines its decimal to `digits` digits."""
    effort = Effort.guess(orders, digits)
    for _ in range(MAX_ATTEMPTS):
        try:
            balls = compute(effort)
        except ArithmeticError:
            effort = effort.raised(effort.bits)
            continue
        if all(_determined(ball, digits) for ball in balls):
            return balls
        # An enclosure may be narrow and still straddle a rounding boundary: then a few more bits settle it.
        accuracy = min(ball.rel_accuracy_bits() for ball in balls)
        effort = effort.raised(max(bits_for(digits) + GUARD_BITS - accuracy, 0))
    raise ArithmeticError(f"{MAX_ATTEMPTS} attempts did not determine {digits} digits")


# --- step 1: G_n ------------------------------------------------------------------------------------------------------


def _g(order: int, effort: Effort) -> tuple[arb, ...]:
    with working(effort.bits):
        return tuple(fixed_point(value, error, effort.bits) for value, error in _g_fixed_point(order, effort))


@lru_cache(maxsize=16)
def _g_fixed_point(order: int, effort: Effort) -> tuple[tuple[int, int], ...]:
    """Return G_0 … G_order as (value, error) in units of 2^-bits, from the hierarchy of section 2.2.

    With P_n = 5 int_r^1 g_{n-1} s^2 ds the hierarchy reads 2 g_0 g_n = P_n - sum_{0<i<n} g_i g_{n-i}. On the inner
    side, r = 15/32 y, all of g_n is expanded; on the outer side, 1 - r = 17/32 y, g_n = y^((n+1)/2) f_n(y) and f_n
    is. The two meet at y = 1.
    """
    algebra = Wiener(effort.bits, effort.terms)
    inner, outer = _Inner(algebra), _Outer(algebra)
    values = [(1 << effort.bits, 0)]
    for n in track(range(1, order + 1), "perturbation orders"):
        p_meeting = outer.advance(n)
        values.append(inner.advance(n, *p_meeting))
    return tuple(values)


def _next_order(
    algebra: Wiener, f: list[FunctionBall], half_inverse: FunctionBall, n: int, p: FunctionBall
) -> FunctionBall:
    """Return f_n = (p_n - sum f_i f_{n-i}) / (2 f_0)."""
    products, error = algebra.self_convolution(f, n)
    right = algebra.rounded(p.polynomial * (1 << algebra.bits) - products, error + (p.error << algebra.bits))
    return algebra.product(right, half_inverse)


class _Outer:
    """Taylor series around the turning point: 1 - r = a y, g_n = y^((n+1)/2) f_n, P_n = y^((n+2)/2) p_n."""

    def __init__(self, algebra: Wiener) -> None:
        a = 1 - MEETING_POINT
        self.algebra = algebra
        # g_0^2 = 1 - (1 - a y)^5 = y f_0^2
        f0, self.half_inverse = algebra.root_and_half_inverse([5 * a, -10 * a**2, 10 * a**3, -5 * a**4, a**5])
        self.f = [f0]
        scale = a.denominator
        self.weight = fmpz_poly([scale, -a.numerator]) ** 2  # scale^2 (1 - a y)^2
        self.weight_norm = (scale + a.numerator) ** 2
        self.scale = scale**2
        self.factor = 10 * a  # of the integral below

    def advance(self, n: int) -> tuple[int, int]:
        """Append f_n and return P_n at y = 1 as (value, error)."""
        p = self._integral(n)
        self.f.append(_next_order(self.algebra, self.f, self.half_inverse, n, p))
        return int(sum(p.polynomial.coeffs())), p.error

    def _integral(self, n: int) -> FunctionBall:
        """Return p_n: its coefficient j is 10 a / (n + 2 + 2 j) times that of f_{n-1} (1 - a y)^2."""
        previous = self.f[n - 1]
        top, bottom = self.factor.numerator, self.factor.denominator * self.scale
        integrand = (previous.polynomial * self.weight).coeffs()
        coefficients = [top * c // (bottom * (n + 2 + 2 * j)) for j, c in enumerate(integrand)]
        error = divided_up(top * self.weight_norm * previous.error, bottom * (n + 2)) + len(coefficients)
        return self.algebra.element(coefficients, error)


class _Inner:
    """Taylor series around r = 0: r = b y."""

    def __init__(self, algebra: Wiener) -> None:
        b = MEETING_POINT
        self.algebra = algebra
        f0, self.half_inverse = algebra.root_and_half_inverse([Fraction(1), *4 * [Fraction(0)], -(b**5)])
        self.g = [f0]
        self.factor = 5 * b**3  # of the integral below

    def advance(self, n: int, p_meeting: int, p_meeting_error: int) -> tuple[int, int]:
        """Append g_n, given P_n at y = 1, and return G_n = g_n(0) as (value, error)."""
        p = self._p(n, p_meeting, p_meeting_error)
        g_n = _next_order(self.algebra, self.g, self.half_inverse, n, p)
        self.g.append(g_n)
        return int(g_n.polynomial[0]), g_n.error

    def _p(self, n: int, p_meeting: int, p_meeting_error: int) -> FunctionBall:
        """Return P_n = P_n(0) - integral; the integral's error enters twice, once in P_n(0)."""
        integral, error = self._integral(n)
        coefficients = [-c for c in integral]
        coefficients[0] += p_meeting + sum(integral)  # P_n(0)
        return self.algebra.element(coefficients, p_meeting_error + 2 * error)

    def _integral(self, n: int) -> tuple[list[int], int]:
        """Return the coefficients of 5 b^3 int_0^y g_{n-1} q^2 dq, and the error's norm."""
        previous = self.g[n - 1]
        top, bottom = self.factor.numerator, self.factor.denominator
        coefficients = [int(top * c) // (bottom * (j + 3)) for j, c in enumerate(previous.polynomial.coeffs())]
        return [0, 0, 0, *coefficients], divided_up(top * previous.error, 3 * bottom) + len(coefficients)


# --- steps 2 and 3: from V(K) to Lambda and to eps0 -----------------------------------------------------------------


def _logarithms(orders: int, effort: Effort) -> tuple[arb_series, arb_series]:
    """Return ln V(K) and ln V(-K) to K^orders. To be called within `working`."""
    g = _g(orders, effort)
    mirrored = [-x if n % 2 else x for n, x in enumerate(g)]
    return tuple(arb_series(list(c), orders + 1).log() for c in (g, mirrored))  # type: ignore[return-value]


def _k_times(exponent: arb_series, orders: int) -> arb_series:
    """Return (5/4)^(2/5) K exp(exponent) to K^orders."""
    scale = (arb(25) / 16).root(5)
    return arb_series([arb(0), scale], orders + 1) * exponent.exp()


def _lambda(orders: int, effort: Effort) -> tuple[arb, ...]:
    """Return lambda_1, lambda_3, … below nu^orders: Lambda = -ln eps0 in nu = (5/4)^(2/5) K (V(K) V(-K))^(1/10)."""
    with working(effort.bits, orders + 1):
        forward, backward = _logarithms(orders, effort)
        nu = _k_times((forward + backward) / 10, orders)
        return tuple(_padded((forward - backward)(nu.reversion()), orders + 1)[1::2])


def _log_eps0(orders: int, effort: Effort) -> arb_series:
    """Return ln eps0 as a power series in kappa to kappa^orders. To be called within `working`."""
    forward, backward = _logarithms(orders, effort)
    kappa = _k_times(forward / 5, orders)
    return (backward - forward)(kappa.reversion()) if orders else arb_series([arb(0)], 1)


def _padded(power_series: arb_series, length: int) -> list[arb]:
    """Return the coefficients; FLINT drops zeros at the end."""
    _require_terms(power_series, length)
    coefficients = power_series.coeffs()
    return coefficients + [arb(0)] * (length - len(coefficients))


# --- step 4: the end of contact ---------------------------------------------------------------------------------------


@lru_cache(maxsize=8)
def end_series(order: int) -> tuple[Fraction, ...]:
    """Return H_0 … H_order, the rational coefficients of H(delta) (section 2.3).

    In units of the end values, s = sqrt(H) p, h = H k(p), mu = delta sqrt(H), the problem reads
    k^2 = 1 + mu (1 - p^5 - 5 int_p^1 k q^2 dq), and H = 1/k(0). Each order of mu is a polynomial in p, and Lagrange's
    inversion of mu(delta) gives H_j = 2/(2+j) [mu^j] k(0)^(-(2+j)/2).
    """
    k = [fmpq_poly([1])]
    for i in range(1, order + 1):
        integral = (k[i - 1] * fmpq_poly([0, 0, 1])).integral()
        right = 5 * (integral - integral(fmpq(1)))
        if i == 1:
            right += fmpq_poly([1, 0, 0, 0, 0, -1])
        products = 2 * sum((k[j] * k[i - j] for j in range(1, (i + 1) // 2)), fmpq_poly())
        if i % 2 == 0:
            products += k[i // 2] * k[i // 2]
        k.append((right - products) / 2)
    with working(64, order + 1):
        log_k0: Any = fmpq_series([k_i[0] for k_i in k], prec=order + 1).log()  # the stub lacks products with fmpq
        coefficients = [fmpq(2, 2 + j) * _coefficient((log_k0 * fmpq(-(2 + j), 2)).exp(), j) for j in range(order + 1)]
    return tuple(Fraction(int(c.p), int(c.q)) for c in coefficients)


def _require_terms(power_series: arb_series | fmpq_series, length: int) -> None:
    """Raise RuntimeError if the series was cut: then somebody else has changed FLINT's global length meanwhile."""
    if power_series.prec < length:
        raise RuntimeError(f"a power series was cut to {power_series.prec} terms where {length} are needed")


def _coefficient(power_series: fmpq_series, j: int) -> fmpq:
    _require_terms(power_series, j + 1)
    coefficients = power_series.coeffs()
    return coefficients[j] if j < len(coefficients) else fmpq(0)


def _h(order: int, effort: Effort) -> tuple[arb, ...]:
    """Return h_0 … h_order from eps = sum_j H_j (4/5)^j v*^(5j) eps0^(1 + j/2)."""
    orders = order // 2
    with working(effort.bits, orders + 1):
        log_eps0 = _log_eps0(orders, effort)
        h = [arb(0)] * (order + 1)
        for j, end_coefficient in enumerate(end_series(order // 5)):
            factor = end_coefficient * Fraction(4, 5) ** j
            factor_ball = arb(factor.numerator) / factor.denominator
            power = _padded((log_eps0 * (arb(2 + j) / 2)).exp(), orders + 1)
            for n in range((order - 5 * j) // 2 + 1):
                h[5 * j + 2 * n] += factor_ball * power[n]
        return tuple(h)
