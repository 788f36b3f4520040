"""The series eps = 1 + sum h_k v*^k (the paper's Eq. 7) with a proven enclosure of every coefficient.

eps is the coefficient of restitution, v* the scaled speed of impact, and K and kappa two measures of the damping. Four
steps, each a function below, lead from the equation of motion to h_k. For a law of contact (a, b),
nu = (a + 1)/(b + 1) = n_a/n_b, in brackets for the paper's law:

1. `g_coefficients`: G_n, the coefficients of V(K) = g(0), g(r) the scaled speed during loading, r = 0 at first contact
   and r = 1 at the turning point; by Taylor series from both ends of 0 <= r <= 1, in the ball
   arithmetic of functions of `viscopade.arithmetic.function_balls`;
2. `lambda_coefficients`: the odd function Lambda of time reversal, ln eps0 = -Lambda(kappa eps0^c), c = 1/nu - 1/2,
   with the restitution eps0 if contact ends at x = 0; not needed for
3. `_log_eps0`: ln eps0 as a power series in kappa, from eps0 = V(-K)/V(K), kappa = ((a+1)/2)^(1-1/nu) K V(K)^(2/nu-1)
   [(5/4)^(2/5) K V(K)^(1/5)];
4. `end_series`, `series`: with v* = kappa^(1/d), d = n_a - n_b [2], and the rational series H,
   eps = eps0 H(2/(a+1) v*^n_a eps0^e), e = (2 n_b - n_a)/d [(4/5) v*^5 sqrt(eps0)]; without delayed recovery
   eps = eps0, d = 1.

Steps 2 to 4 are arithmetic of truncated power series in balls (FLINT), which has no truncation error.
"""

from __future__ import annotations

from bisect import bisect_left
from collections import deque
from collections.abc import Callable, Hashable
from dataclasses import dataclass
from fractions import Fraction
from functools import lru_cache
from math import comb, e, floor, log2, pi, sin, sqrt
from typing import TYPE_CHECKING, Any, NamedTuple, SupportsIndex

import numpy as np
from flint import arb, arb_series, fmpq, fmpq_poly, fmpq_series, fmpz_poly
from numpy.typing import NDArray

from viscopade import arguments
from viscopade.arithmetic.balls import (
    Determined,
    ball_of,
    bits_for,
    decimal_string,
    fixed_point,
    rational_power,
    to_mpf,
    working,
)
from viscopade.arithmetic.function_balls import FunctionBall, Orders, Wiener, divided_up
from viscopade.progress import track
from viscopade.theory.law import VISCOELASTIC, Law, law_of

if TYPE_CHECKING:
    from mpmath import mp

# Beyond the bits of the decimals: an enclosure of half a unit of the last digit straddles a boundary of rounding half
# of the time, one that is 2^8 times narrower once in 256 times.
GUARD_BITS = 8
# Two attempts usually suffice (measured: five at most, see `Effort.guess`); after so many, four times the measured ones
# (a choice), a coefficient is exactly zero.
MAX_ATTEMPTS = 20
MOST_MEMORY = 4  # in GB, for the orders: a choice, so that a request does not fill a small computer's memory
# Constant part of the cost of order n, over the cost of a term of its sum over lower orders. It moves the progress bar,
# nothing else.
ORDER_COST = 6


@dataclass(frozen=True, eq=False)
class Series(Determined):
    """The first coefficients of eps = sum h_k v*^k (the paper's Eq. 7).

    Attributes
    ----------
    order : int
        The highest power of v*.
    digits : int
        Significant digits to which every coefficient is determined.
    h : tuple of flint.arb, length order + 1
        Proven enclosures of h_0 … h_order.
    law : Law
        The law of contact; v* = kappa^(1/law.d).
    """

    order: int
    digits: int
    h: tuple[arb, ...]
    law: Law = VISCOELASTIC

    def __post_init__(self) -> None:
        """Refuse coefficients that are not determined to `digits` digits, or whose h_0 is not 1."""
        if len(self.h) != self.order + 1:
            raise ValueError(f"a series of order {self.order} has {self.order + 1} coefficients, not {len(self.h)}")
        if self.h[0] != 1:
            raise ValueError("h_0 must be 1: eps = 1 at v* = 0")
        if not all(_determined(h_k, self.digits) for h_k in self.h):
            raise ValueError(f"an enclosure is too wide for {self.digits} digits")

    def proven(self) -> Hashable:
        """Return the law, and the decimals to all digits."""
        return self.law, self.digits, self.decimals()

    def decimals(self, digits: int | None = None) -> tuple[str, ...]:
        """Return the coefficients as decimal strings, correctly rounded to `digits` (at most `self.digits`).

        Raises
        ------
        ArithmeticError
            If, for fewer digits than `self.digits`, an enclosure contains a boundary of rounding.
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
    """Return the number in a ball, correctly rounded to `digits` digits."""
    text = decimal_string(ball, digits)
    if text is None:
        raise ArithmeticError(f"{ball} does not determine {digits} digits")
    return text


def _determined(ball: arb, digits: int) -> bool:
    """Return whether all numbers in a ball round to one decimal of `digits` digits."""
    return decimal_string(ball, digits) is not None


def series(order: SupportsIndex, digits: SupportsIndex = 30, law: Law | str = VISCOELASTIC) -> Series:
    """Return h_0 … h_order, each proven to `digits` significant digits.

    Parameters
    ----------
    order : int
        Highest power of v*, 0 to 1000.
    digits : int
        Significant digits, 1 to 5000.
    law : Law or str
        Law of contact, or its name or exponents (`law_of`). The series runs in v* = kappa^(1/law.d).

    Raises
    ------
    TypeError, ValueError
        If an argument is not an integer or is out of range, or the law is not known.

    Notes
    -----
    `digits` and `order` determine the working precision and the number of Taylor terms. If the enclosures are too wide,
    they are computed again with more, so that all wanted digits are always proven.
    """
    # 30 digits by default are a choice: twice those of a double. So are the limits 1000 and 5000, which `arguments` has
    # for all functions: a typing error is refused, and not computed for hours.
    return _series(arguments.order(order), arguments.digits(digits), law_of(law))


_derivations: deque[Series] = deque(maxlen=16)  # the latest ones; this number and those of the caches are choices


@lru_cache(maxsize=64)
def _series(order: int, digits: int, law: Law) -> Series:
    """Return h_0 … h_order of a law to `digits` digits, from a longer and more accurate series if there is one.

    So the balls depend on earlier calls; their decimals do not.
    """
    for longer in tuple(_derivations):  # a copy, as another thread may append
        h = longer.h[: order + 1]
        enough = longer.law == law and longer.order >= order and longer.digits >= digits
        # More digits were determined, but an enclosure may straddle a boundary of rounding to fewer.
        if enough and all(_determined(h_k, digits) for h_k in h):
            return Series(order, digits, h, law)
    return derived(order, digits, law)


@lru_cache(maxsize=16)
def derived(order: int, digits: int, law: Law = VISCOELASTIC) -> Series:
    """Return h_0 … h_order, derived to just these digits; the balls do not depend on earlier derivations.

    So what is computed from the balls themselves, such as `Pade.digits_lost`, is the same in every session.
    """
    # v*^order = kappa^(order/d): the highest power of kappa, and of K.
    h = _enclosed(lambda effort: _h(order, effort, law), order // law.d, digits, law)
    new = Series(order, digits, h, law)
    _derivations.append(new)
    return new


def lambda_coefficients(
    count: SupportsIndex, digits: SupportsIndex = 30, law: Law | str = VISCOELASTIC
) -> tuple[arb, ...]:
    """Return enclosures of lambda_1, lambda_3, … (`count` of them), -ln eps0 = sum lambda_k (kappa eps0^c)^k.

    c = 1/nu - 1/2. Every decimal is determined to `digits` significant digits.
    """
    # 30 digits are a choice, and so is the largest order 1000 (`arguments.MAX_ORDER`). At most as many lambdas as
    # h_1000 of the paper's law has, a quarter of the order: v*^1000 = kappa^500, so lambda_1, lambda_3, … lambda_499.
    # `count` lambdas are the odd coefficients below order 2 count.
    count, law_of_contact = arguments.integer("count", count, 1, arguments.MAX_ORDER // 4), law_of(law)
    return _enclosed(
        lambda effort: _lambda(2 * count, effort, law_of_contact), 2 * count, arguments.digits(digits), law_of_contact
    )


def g_coefficients(order: SupportsIndex, digits: SupportsIndex = 30, law: Law | str = VISCOELASTIC) -> tuple[arb, ...]:
    """Return enclosures of G_0 … G_order, the coefficients of V(K) = g(0), to `digits` digits."""
    # 30 digits are a choice. At most as many as h_1000 of the paper's law needs, v*^1000 = kappa^500; 1000 is a choice.
    n, law_of_contact = arguments.integer("order", order, 0, arguments.MAX_ORDER // 2), law_of(law)
    return _enclosed(lambda effort: _g(n, effort, law_of_contact), n, arguments.digits(digits), law_of_contact)


# --- effort: how much precision and how many terms (no proof depends on it: skip it at first) -------------------------


class MeetingPoint(NamedTuple):
    """The r at which the Taylor series around r = 0 and r = 1 meet, and the bits that a term gains in the limit."""

    r: Fraction
    bits_per_term: float

    @classmethod
    def balanced(cls, n_a: int, orders_per_term: float = 0.0) -> MeetingPoint:
        """Return the point at which the last terms of both series are nearly equal in the last order.

        The nearest singularities, the roots of r^n_a = 1, are at distance 1 of r = 0 and R = 2 sin(pi/n_a) of r = 1.
        Except for a common factor, term j of g_n is like r^j on the inner side and, with a = 1 - r, like
        (a/R)^(j + n/2) R^-n on the outer one. For n_a = 5, n much below j, they meet at 0.46. Any point is right for
        the proof; this one needs the fewest terms.

        Parameters
        ----------
        n_a : int
            `Law.n_a`: the elastic force is like r^(n_a - 1).
        orders_per_term : float
            n/j, the highest order in K over the number of Taylor coefficients.
        """
        radius = 2 * sin(pi / max(n_a, 2))  # n_a = 1 has no root but r = 1: any R serves

        def inner_is_larger(i: int) -> bool:
            # The j-th root of r^j / ((a/R)^(j + n/2) R^-n) = (r R/a)^j (R^3/a)^(n/2)
            r = i / 1024
            return bool(r * radius / (1 - r) * sqrt(radius**3 / (1 - r)) ** orders_per_term > 1)

        # A multiple of 1/1024 (a choice), so that powers of the fraction r are short. The bits are rounded down to
        # thousandths: too few cost only terms, and the last digits of a machine's logarithm do not count.
        r = Fraction(bisect_left(range(1024), True, key=inner_is_larger), 1024)
        return cls(r, floor(-1000 * log2(float(r))) / 1000)


@dataclass(frozen=True)
class Effort:
    """Computational effort: working precision in bits, and number of Taylor coefficients on either side."""

    bits: int
    terms: int

    @classmethod
    def guess(cls, orders: int, digits: int, law: Law) -> Effort:
        """Return an estimate of the effort for `orders` orders in K; its slopes were measured, not proven.

        The singularities at the roots of unity grow by one power an order, so Taylor coefficient j of g_n is
        larger than that of g_0 by about j^n/n!, and an order costs about log2(1 + terms/orders) bits of truncation.
        The larger nu above 5/3, the faster fall the h_k, and the more bits an order costs; for 1 <= nu < 3/2 an order
        costs fewer.

        No proof depends on these numbers: too few bits or terms cost another attempt, too many cost time. Measured for
        24 laws, nu from 1/2 to 11: for 10 orders to 15 digits the first attempt is always enough, for 40 orders to 30
        digits it is for 21 laws, for 120 orders to 15 digits it is for 14, and the others need two to five.

        Parameters
        ----------
        orders : int
            Highest power of K.
        digits : int
            Significant decimal digits of every coefficient.
        """
        nu = float(law.nu)
        # All numbers of bits below were fitted by hand to the measurements.
        # Bits that an order costs because the h_k fall: six for each unit of nu above 5/3, at most 1.6, and 2.5 for nu
        # < 1. Bits that it costs less for 1 <= nu < 3/2.
        falling = min(max(6.0 * (nu - 5 / 3), 0.0), 1.6) if nu >= 1 else 2.5
        saved = 0.8 if 1 <= nu < 1.5 else 0.0
        needed = bits_for(digits) + GUARD_BITS
        # The loss depends on the number of terms, and this number on the loss: four rounds come close to the fixed
        # point.
        terms = needed
        for _ in range(4):
            # The estimate of the docstring and half a bit an order, with 0.8 bits more from order 120 on; eight terms
            # more, without which short series have up to 10 bits less (measured).
            lost = orders * (log2(1 + terms / max(orders, 1)) + 0.5 + falling - saved)
            lost += 0.8 * max(orders - 120, 0)
            terms = int((needed + lost) / MeetingPoint.balanced(law.n_a, orders / terms).bits_per_term) + 8
        # Rounding costs 22 bits and 1.1 bits an order or more, more by a quarter of `falling`. Measured for nine laws:
        # these are tight, as 22 bits less are too few for every law with 10 orders, and half a bit less an order for
        # eight of nine with 40 orders.
        return cls(int(needed + (1.1 + 0.25 * falling) * orders) + 22, terms)

    def memory(self, orders: int) -> float:
        """Return the approximate number of bytes of the orders: those of both sides, and of a product of two."""
        # Each order has `terms` coefficients of `bits` bits, eight to a byte, on either side; products and sums take
        # about as much as 40 orders.
        return (2 * orders + 40) * self.terms * self.bits / 8

    def raised(self, missing_bits: int, bits_per_term: float) -> Effort:
        """Return the estimated effort for `missing_bits` more bits."""
        # Eight bits and a term more than seem to be missing, a choice, so that one more attempt is enough.
        more = missing_bits + 8
        return Effort(self.bits + more, self.terms + int(more / bits_per_term) + 1)


def _enclosed(compute: Callable[[Effort], tuple[arb, ...]], orders: int, digits: int, law: Law) -> tuple[arb, ...]:
    """Return the balls of `compute`, called with growing effort until each determines its decimal to `digits` digits.

    `orders` is the highest power of K for the law, which the first effort depends on.
    """
    _require_memory(orders, digits, law)
    effort = Effort.guess(orders, digits, law)
    # What another term gains: the bits of `MeetingPoint`, less the growth of the loss, as orders log2(1 + terms/orders)
    # has the derivative log2(e) orders/(orders + terms), e that of the natural logarithm.
    bits_per_term = MeetingPoint.balanced(law.n_a, orders / effort.terms).bits_per_term
    bits_per_term -= log2(e) * orders / (orders + effort.terms)
    for _ in range(MAX_ATTEMPTS):
        try:
            balls = compute(effort)
        # A condition of the square root fails, by an unknown number of bits: twice as many, a choice.
        except ArithmeticError:
            effort = effort.raised(effort.bits, bits_per_term)
            continue
        if all(_determined(ball, digits) for ball in balls):
            return balls
        # An enclosure may be narrow and still straddle a rounding boundary: then a few more bits settle it.
        accuracy = min(ball.rel_accuracy_bits() for ball in balls)
        effort = effort.raised(max(bits_for(digits) + GUARD_BITS - accuracy, 0), bits_per_term)
    raise ArithmeticError(f"{MAX_ATTEMPTS} attempts did not determine {digits} digits")


def _require_memory(orders: int, digits: int, law: Law) -> None:
    """Raise ValueError if a law's orders to `digits` digits take more than `MOST_MEMORY`, before they are computed.

    `orders` is the highest power of K. The memory is that of the first effort, an estimate.
    """

    def gigabytes(digits: int) -> float:
        """Return the memory that the orders take with the first effort."""
        return Effort.guess(orders, digits, law).memory(orders) / 2**30  # 2^30 bytes are a GB

    if gigabytes(digits) > MOST_MEMORY:
        # The message has the largest number of digits that fits: one less than the first that does not, as memory grows
        # with the digits. `MOST_MEMORY` is a choice.
        fewer = bisect_left(range(digits), True, key=lambda number: gigabytes(number) > MOST_MEMORY) - 1
        expected = f"to this order up to {fewer} digits" if fewer > 0 else "a lower order"
        raise ValueError(
            f"{digits} digits of a series to this order need about {gigabytes(digits):.0f} GB of memory: expected what "
            f"needs at most {MOST_MEMORY} GB, {expected}"
        )


# --- step 1: G_n ------------------------------------------------------------------------------------------------------
# A `FunctionBall` is a polynomial with coefficients in units of 2^-bits, and a bound of the sum of the absolute values
# of all coefficients that it lacks, cut terms and rounding included. `Orders.convolution` is sum_{0<i<n} f_i f_{n-i}.


def _g(order: int, effort: Effort, law: Law) -> tuple[arb, ...]:
    """Return enclosures of G_0 … G_order of a law."""
    values = _g_fixed_point(order, effort, law.n_a, law.n_b)
    with working(effort.bits):
        return tuple(fixed_point(value, error, effort.bits) for value, error in values)


@lru_cache(maxsize=16)  # a choice
def _g_fixed_point(order: int, effort: Effort, n_a: int, n_b: int) -> tuple[tuple[int, int], ...]:
    """Return G_0 … G_order as (value, error) in units of 2^-bits of an effort, from the hierarchy (`symbolic`).

    With P_n = n_a int_r^1 g_{n-1} s^(n_b-1) ds the hierarchy reads 2 g_0 g_n = P_n - sum_{0<i<n} g_i g_{n-i}. On the
    inner side, r = b y, all of g_n is expanded; on the outer side, 1 - r = a y, g_n = y^((n+1)/2) f_n(y) and f_n is.
    The two meet at y = 1, a + b = 1 (`MeetingPoint`). From here on a and b are these two lengths, not the exponents of
    the law, as in docs/theory/error-bounds.md.
    """
    algebra, meeting = Wiener(effort.bits, effort.terms), MeetingPoint.balanced(n_a, order / effort.terms).r
    inner, outer = _Inner(algebra, meeting, n_a, n_b), _Outer(algebra, meeting, n_a, n_b)
    values = [(1 << effort.bits, 0)]  # G_0 = g_0(0) = 1
    # P_n at the meeting point comes from g_(n-1) on the outer side, and carries the integral on to the inner side.
    for n in track(range(1, order + 1), "perturbation orders", lambda n: n + ORDER_COST):
        p_meeting = outer.advance(n)
        values.append(inner.advance(n, *p_meeting))
    return tuple(values)


def _next_order(algebra: Wiener, f: Orders, half_inverse: FunctionBall, p: FunctionBall) -> FunctionBall:
    """Return f_n = (p_n - sum_{0<i<n} f_i f_{n-i}) / (2 f_0) for the next n; `half_inverse` is 1/(2 f_0)."""
    # Products have units of 2^(-2 bits): p_n is brought into them, and the difference is rounded once.
    products, error = f.convolution()
    right = algebra.rounded(p.polynomial * (1 << algebra.bits) - products, error + (p.error << algebra.bits))
    return algebra.product(right, half_inverse)


class _Outer:
    """Taylor series around the turning point: 1 - r = a y, g_n = y^((n+1)/2) f_n, P_n = y^((n+2)/2) p_n.

    a is the length of this side in r, no exponent of the law. Functions of y are balls of `algebra`, integers in units
    of 2^-bits.
    """

    def __init__(self, algebra: Wiener, meeting: Fraction, n_a: int, n_b: int) -> None:
        """Start with f_0, for a law with nu = n_a/n_b; `meeting` is the r at which both sides meet, y = 1."""
        a = 1 - meeting
        self.algebra = algebra
        # g_0^2 = 1 - (1 - a y)^n_a = y f_0^2; `root_and_half_inverse` returns f_0 and 1/(2 f_0).
        square = [-comb(n_a, j) * (-a) ** j for j in range(1, n_a + 1)]
        f0, self.half_inverse = algebra.root_and_half_inverse(square)
        self.f = Orders([f0])
        # For the integral below, in integers: weight = scale^(n_b-1) (1 - a y)^(n_b-1), with scale a whole number; its
        # coefficients have the absolute values of those of (scale + scale a y)^(n_b-1), whose sum is the value at 1.
        scale = a.denominator
        self.weight = fmpz_poly([scale, -a.numerator]) ** (n_b - 1)
        self.weight_norm = (scale + a.numerator) ** (n_b - 1)
        self.scale = scale ** (n_b - 1)
        # Of the integral: n_a a from n_a ds = n_a a dy, and y^(n/2 + j) gives 2/(n + 2 + 2 j).
        self.factor = 2 * n_a * a

    def advance(self, n: int) -> tuple[int, int]:
        """Append f_n and return P_n at y = 1 as (value, error)."""
        p = self._integral(n)
        self.f.append(_next_order(self.algebra, self.f, self.half_inverse, p))
        return int(sum(p.polynomial.coeffs())), p.error

    def _integral(self, n: int) -> FunctionBall:
        """Return p_n: its coefficient j is 2 n_a a / (n + 2 + 2 j) times that of f_{n-1} (1 - a y)^(n_b-1)."""
        previous = self.f[n - 1]
        top, bottom = self.factor.numerator, self.factor.denominator * self.scale
        integrand = (previous.polynomial * self.weight).coeffs()
        coefficients = [top * c // (bottom * (n + 2 + 2 * j)) for j, c in enumerate(integrand)]
        # The factors are at most that of j = 0: the error is at most 2 n_a a/(n + 2) ||weight|| times that of f_(n-1)
        # (docs/theory/error-bounds.md, step 2), and one unit a coefficient for rounding down.
        error = divided_up(top * self.weight_norm * previous.error, bottom * (n + 2)) + len(coefficients)
        return self.algebra.element(coefficients, error)


class _Inner:
    """Taylor series around r = 0: r = b y. b is the length of this side in r, no exponent of the law."""

    def __init__(self, algebra: Wiener, b: Fraction, n_a: int, n_b: int) -> None:
        """Start with g_0, for a law with nu = n_a/n_b; b is the r at which both sides meet, y = 1."""
        self.algebra = algebra
        # g_0^2 = 1 - r^n_a = 1 - b^n_a y^n_a
        g0, self.half_inverse = algebra.root_and_half_inverse([Fraction(1), *(n_a - 1) * [Fraction(0)], -(b**n_a)])
        self.g = Orders([g0])
        self.n_b = n_b
        self.factor = n_a * b**n_b  # of the integral below

    def advance(self, n: int, p_meeting: int, p_meeting_error: int) -> tuple[int, int]:
        """Append g_n, given P_n at y = 1, and return G_n = g_n(0) as (value, error)."""
        p = self._p(n, p_meeting, p_meeting_error)
        g_n = _next_order(self.algebra, self.g, self.half_inverse, p)
        self.g.append(g_n)
        return int(g_n.polynomial[0]), g_n.error

    def _p(self, n: int, p_meeting: int, p_meeting_error: int) -> FunctionBall:
        """Return P_n = P_n(0) - integral; the integral's error enters twice, once in P_n(0)."""
        integral, error = self._integral(n)
        # P_n(0) = P_n at y = 1, plus the integral to y = 1, which is the sum of its coefficients.
        coefficients = [-c for c in integral]
        coefficients[0] += p_meeting + sum(integral)
        return self.algebra.element(coefficients, p_meeting_error + 2 * error)

    def _integral(self, n: int) -> tuple[list[int], int]:
        """Return the coefficients of n_a b^n_b int_0^y g_{n-1} q^(n_b-1) dq, and the error's norm."""
        # Coefficient j of g_(n-1) becomes that of y^(j + n_b), times n_a b^n_b/(j + n_b) <= n_a b^n_b/n_b.
        previous, n_b = self.g[n - 1], self.n_b
        top, bottom = self.factor.numerator, self.factor.denominator
        coefficients = [int(top * c) // (bottom * (j + n_b)) for j, c in enumerate(previous.polynomial.coeffs())]
        return [*n_b * [0], *coefficients], divided_up(top * previous.error, n_b * bottom) + len(coefficients)


# --- steps 2 and 3: from V(K) to Lambda and to eps0 -----------------------------------------------------------------


def _logarithms(orders: int, effort: Effort, law: Law) -> tuple[arb_series, arb_series]:
    """Return ln V(K) and ln V(-K) to K^orders. To be called within `working`."""
    g = _g(orders, effort, law)
    mirrored = [-x if n % 2 else x for n, x in enumerate(g)]
    return tuple(arb_series(list(c), orders + 1).log() for c in (g, mirrored))  # type: ignore[return-value]


def _k_times(log_v: arb_series, exponent: Fraction, orders: int, law: Law) -> arb_series:
    """Return ((a+1)/2)^(1-1/nu) K exp(exponent log_v) to K^orders."""
    base, power = law.kappa_scale
    scale = rational_power(ball_of(base), power)
    return arb_series([arb(0), scale], orders + 1) * (log_v * ball_of(exponent)).exp()


def _lambda(orders: int, effort: Effort, law: Law) -> tuple[arb, ...]:
    """Return lambda_1, lambda_3, … below order `orders`, from kappa eps0^c = scale K (V(K) V(-K))^c."""
    with working(effort.bits, orders + 1):
        forward, backward = _logarithms(orders, effort, law)
        argument = _k_times(forward + backward, law.c, orders, law)
        return tuple(_padded((forward - backward)(argument.reversion()), orders + 1)[1::2])


def _log_eps0(orders: int, effort: Effort, law: Law) -> arb_series:
    """Return ln eps0 as a power series in kappa to kappa^orders. To be called within `working`."""
    forward, backward = _logarithms(orders, effort, law)
    kappa = _k_times(forward, 2 * law.c, orders, law)
    return (backward - forward)(kappa.reversion()) if orders else arb_series([arb(0)], 1)


def _padded(power_series: arb_series, length: int) -> list[arb]:
    """Return the coefficients; FLINT drops zeros at the end."""
    _require_terms(power_series, length)
    coefficients = power_series.coeffs()
    return coefficients + [arb(0)] * (length - len(coefficients))


# --- step 4: the end of contact ---------------------------------------------------------------------------------------


@lru_cache(maxsize=8)  # a choice
def end_series(order: int, law: Law = VISCOELASTIC) -> tuple[Fraction, ...]:
    """Return H_0 … H_order of a law, the rational coefficients of H(delta); 1, 0, 0, … if nothing is delayed.

    delta = (K U)^(n_a/d)/U^2, U = V(-K), which is 2/(a+1) v*^n_a eps0^e. In units of the end values, s = H^(1/d) p,
    h = H k(p), mu = delta H^e, e = (2 n_b - n_a)/d, the problem reads
    k^2 = 1 + mu (1 - p^n_a - n_a int_p^1 k q^(n_b-1) dq), and H = 1/k(0). Each order of mu is a polynomial in p, and
    Lagrange's inversion of mu(delta) gives (independently of `symbolic.delayed_recovery_series`, whose h, s and U these
    are)
    H_j = 1/j [mu^(j-1)] F'/F F^(1 + e j), F(mu) = 1/k(0). derivations/05_end_of_contact.py has the problem for the
    paper's law, 15_laws.py for the others.
    """
    if not law.delayed:
        return (Fraction(1), *order * [Fraction(0)])
    n_a, n_b = law.n_a, law.n_b

    # k = sum mu^i k_i(p). Order mu^i: 2 k_0 k_i = (1 - p^n_a if i = 1) - n_a int_p^1 k_(i-1) q^(n_b-1) dq
    # - sum_{0<j<i} k_j k_(i-j), k_0 = 1; the products in pairs, and for an even i a square.
    k = [fmpq_poly([1])]
    for i in range(1, order + 1):
        integral = (k[i - 1] * fmpq_poly([*(n_b - 1) * [0], 1])).integral()
        right = n_a * (integral - integral(fmpq(1)))
        if i == 1:
            right += fmpq_poly([1, *(n_a - 1) * [0], -1])
        products = 2 * sum((k[j] * k[i - j] for j in range(1, (i + 1) // 2)), fmpq_poly())
        if i % 2 == 0:
            products += k[i // 2] * k[i // 2]
        k.append((right - products) / 2)

    # H_j = 1/j [mu^(j-1)] (ln F)' F^(1 + e j), F = 1/k(0). The fractions are exact at any precision in bits, such as
    # 64; order + 1 is the number of coefficients.
    end = [Fraction(1)]
    with working(64, order + 1):
        log_f: Any = -fmpq_series([k_i[0] for k_i in k], prec=order + 1).log()  # the stub lacks products with fmpq
        for j in range(1, order + 1):
            power = 1 + law.e * j
            c = _coefficient(log_f.derivative() * (log_f * fmpq(power.numerator, power.denominator)).exp(), j - 1) / j
            end.append(Fraction(int(c.p), int(c.q)))
    return tuple(end)


def _require_terms(power_series: arb_series | fmpq_series, length: int) -> None:
    """Raise RuntimeError if the series was cut: then somebody else has changed FLINT's global length meanwhile."""
    if power_series.prec < length:
        raise RuntimeError(f"a power series was cut to {power_series.prec} terms where {length} are needed")


def _coefficient(power_series: fmpq_series, j: int) -> fmpq:
    """Return coefficient j; FLINT drops zeros at the end."""
    _require_terms(power_series, j + 1)
    coefficients = power_series.coeffs()
    return coefficients[j] if j < len(coefficients) else fmpq(0)


def _h(order: int, effort: Effort, law: Law) -> tuple[arb, ...]:
    """Return h_0 … h_order of a law from eps = sum_j H_j (2/(a+1))^j v*^(n_a j) eps0^(1 + e j).

    eps0 comes in powers of v*^d, with the bits and terms of `effort`.
    """
    orders = order // law.d  # of kappa = v*^d
    with working(effort.bits, orders + 1):
        log_eps0 = _log_eps0(orders, effort, law)
        h = [arb(0)] * (order + 1)
        # The term of j begins with v*^(n_a j); without delayed recovery H = 1.
        for j, end_coefficient in enumerate(end_series(order // law.n_a if law.delayed else 0, law)):
            # H_j (2/(a+1))^j, and eps0^(1 + e j) in powers of kappa
            factor_ball = ball_of(end_coefficient * (2 / (law.elastic + 1)) ** j)
            exponent = 1 + law.e * j
            power = _padded((log_eps0 * ball_of(exponent)).exp(), orders + 1)
            vanishing = _vanishing(exponent, law)  # a ball around a coefficient that is 0 would determine no digit
            for n in range((order - law.n_a * j) // law.d + 1):
                if n != vanishing:
                    h[law.n_a * j + law.d * n] += factor_ball * power[n]
        return tuple(h)


def _vanishing(exponent: Fraction, law: Law) -> Fraction | None:
    """Return the n for which the coefficient of kappa^n in eps0^exponent is exactly 0, as it may be for nu > 2.

    By Lagrange's inversion it is a multiple of [x^n] exp(-(exponent + n c) Lambda(x))/(exponent + n c), Lambda odd:
    of an odd function without its first power if exponent + n c = 0 and n is even.
    """
    n = -exponent / law.c if law.c else None
    return n if n is not None and n > 0 and n % 2 == 0 else None
