"""Padé approximants [m/n] of the series (the paper's Eq. 11): proven coefficients, poles, zeros and domain of use.

eps(v*) = sum h_k v*^k is the coefficient of restitution, v* the scaled speed of impact, and [m/n] = a(v*)/b(v*). The
conditions b(v*) eps(v*) - a(v*) = O(v*^(m+n+1)), b_0 = 1 are a linear system for b, whose condition number grows
roughly like 10^(0.35 (m+n)) for m = n - 3 (the hard case pade-systems measures it); enclosing the solution loses up to
half as many digits again. mpmath builds a and b from the middles of the h_k (`built`). Ball arithmetic proves the
distance of these numbers from the true coefficients (`solution`). If the 0.7 (m+n) additional digits are too few for
the measured loss, the series is derived again with more digits.
"""

from __future__ import annotations

import math
from collections.abc import Hashable, Sequence
from contextlib import suppress
from dataclasses import dataclass, field, replace
from functools import lru_cache
from typing import TYPE_CHECKING, SupportsIndex, TypeVar

import numpy as np
from flint import acb, acb_poly, arb, arb_mat, ctx, fmpq, fmpq_mat
from numpy.typing import NDArray

from viscopade import arguments
from viscopade.arithmetic.balls import (
    Determined,
    bits_for,
    context,
    decimal_at,
    decimal_string,
    exact_middle,
    parts_of,
    relative_digits,
    to_mpf,
    working,
)
from viscopade.arrays.checked import Accepted, Values, elementwise
from viscopade.progress import track
from viscopade.theory.law import VISCOELASTIC, Law, law_of
from viscopade.theory.series import derived

if TYPE_CHECKING:
    from mpmath import mp

# Distance of a pole and a zero over the pole's modulus, below which they count as a doublet; a choice, for reports
# only.
DOUBLET_TOLERANCE = 0.01
# Number of coefficients beyond order m+n, among which is the first one that differs from the approximant's series
# (measured for 199 approximants of four laws: number 1 or 2 of them; the others are a margin).
LOOK_AHEAD = 6
# Degrees that replace [m/n] in a message: the largest |m' - m| + |n' - n|, and the digits to which they are determined.
# Both are choices; any few digits show that they exist.
NEAR, NEAR_DIGITS = 4, 20
# Largest m + n for which a singular system is told from one that needs more digits. A choice: h_k as polynomials in the
# lambdas have more and more terms (543 for h_60 of the paper's law).
LARGEST_DECIDED = 40


_SPEEDS = Accepted("a number >= 0, or inf", lambda x: x >= 0)

Number = TypeVar("Number", arb, fmpq)


class DegenerateError(ValueError):
    """The approximant [m/n] does not exist: no a, b with b_0 = 1 meet all the order conditions."""


@dataclass(frozen=True)
class Root:
    """A pole or zero of an approximant.

    Attributes
    ----------
    value : flint.acb
        Proven enclosure of this root and of no other.
    multiplicity : int
    real : bool
        Whether the root is real (proven either way).
    residue : flint.acb or None
        For a simple pole p, a(p)/b'(p).
    """

    value: acb
    multiplicity: int
    real: bool
    residue: acb | None = None

    @property
    def positive(self) -> bool:
        """Whether the root is real and positive."""
        return self.real and bool(self.value.real > 0)

    def decimals(self, digits: int) -> tuple[str, str]:
        """Return real and imaginary part, correctly rounded at the decimal place of the `digits`-th digit of |root|."""
        # One place for both parts: their errors are those of the complex number, so that a part which is much smaller
        # than the modulus has fewer digits. The imaginary part of a real root is 0, its enclosure only contains 0.
        imaginary = arb(0) if self.real else self.value.imag
        size = abs(self.value)
        parts = decimal_at(self.value.real, size, digits), decimal_at(imaginary, size, digits)
        if None in parts:
            raise ArithmeticError(f"the enclosure {self.value} does not determine {digits} digits")
        return parts  # type: ignore[return-value]


@dataclass(frozen=True)
class Doublet:
    """A pole and a zero that nearly cancel (a Froissart doublet); `distance` is |pole - zero| / |pole|."""

    pole: Root
    zero: Root
    distance: float


@dataclass(frozen=True, eq=False)
class Pade(Determined):
    """The Padé approximant [m/n] of eps(v*) (the paper's Eq. 11), a(v*)/b(v*) with b_0 = 1.

    Attributes
    ----------
    m, n : int
        The degrees; the leading coefficients may be exactly zero ([0/3] has b_3 = 0).
    digits : int
        Significant digits to which every coefficient, pole and zero is determined.
    a, b : tuple of flint.arb, lengths m + 1 and n + 1
        Ascending coefficients, as proven enclosures.
    h : tuple of flint.arb
        The coefficients of the series, to beyond order m + n.
    poles, zeros : tuple of Root, by distance from the origin
    digits_lost : int
        Digits by which the worst coefficient is less accurate than the worst h_k; 0 if the system was solved exactly.
    contact_order : int
        Highest k up to which the approximant's Maclaurin series agrees with that of eps; at least m + n.
    next_term : flint.arb
        eps - [m/n] = next_term v*^(contact_order + 1) + …
    """

    m: int
    n: int
    digits: int
    a: tuple[arb, ...]
    b: tuple[arb, ...]
    h: tuple[arb, ...] = field(repr=False)
    poles: tuple[Root, ...] = field(repr=False)
    zeros: tuple[Root, ...] = field(repr=False)
    digits_lost: int
    contact_order: int
    next_term: arb

    def __post_init__(self) -> None:
        """Refuse coefficients that are not those of [m/n] for the series h."""
        # Their numbers, the normalisation, and the order conditions (b eps - a)_k = 0 for k <= m + n within the balls.
        if (len(self.a), len(self.b)) != (self.m + 1, self.n + 1):
            raise ValueError(f"[{self.m}/{self.n}] needs {self.m + 1} and {self.n + 1} coefficients")
        if self.b[0] != 1:
            raise ValueError("b_0 must be 1")
        if not all(defect.contains(0) for defect in self._order_conditions()):
            raise ValueError(f"[{self.m}/{self.n}] does not re-expand to its series")

    def _order_conditions(self) -> list[arb]:
        """Return (b eps - a)_k for k <= m + n: enclosures of zero."""
        # 64 bits (a machine word) more than the accurate digits of h (of the worst h_k), so that rounding does not
        # count.
        with working(bits_for(relative_digits(self.h)) + 64):
            return _defects(self.a, self.b, self.h)[: self.m + self.n + 1]

    @property
    def label(self) -> str:
        """The approximant's name in the paper's notation."""
        return f"[{self.m}/{self.n}]"

    @property
    def domain_end(self) -> Root | None:
        """The first positive real pole or zero, at which eps > 0 ends; None if eps > 0 for all v* >= 0.

        If a pole and a zero agree to all `digits`, it may be either of them.
        """
        positive = (root for root in self.poles + self.zeros if root.positive)
        return min(positive, key=lambda root: exact_middle(root.value.real), default=None)

    @property
    def positive_pole(self) -> Root | None:
        """The first positive real pole."""
        return next((pole for pole in self.poles if pole.positive), None)

    @property
    def decays(self) -> bool:
        """Whether the approximant tends to 0 for v* -> infinity, as eps does."""
        return len(_stripped(self.a)) < len(_stripped(self.b))

    @property
    def usable(self) -> bool:
        """Whether the approximant is finite and positive for all v* >= 0 and tends to 0 (proven)."""
        return self.domain_end is None and self.decays

    @property
    def verdict(self) -> str:
        """The domain of use as one line, with the reason for its end."""
        if self.usable:
            return "defined for all v* >= 0 (no positive real pole or zero)"
        if self.domain_end is None:
            return "not usable for all v* >= 0: it does not tend to 0 for large v*"
        # Six digits of each place, as the paper's table has them.
        places = [
            f"a {kind} at v* = {root.decimals(min(6, self.digits))[0]}"
            for kind, roots in (("zero", self.zeros), ("pole", self.poles))
            for root in roots
            if root.positive
        ]
        return "not usable for all v* >= 0: it has " + " and ".join(places)

    @property
    def residual(self) -> float:
        """Upper bound of |(b eps - a)_k| over the order conditions k <= m + n."""
        return max(_upper(abs(defect)) for defect in self._order_conditions())

    def doublets(self, tolerance: float = DOUBLET_TOLERANCE) -> tuple[Doublet, ...]:
        """Return the pole-zero pairs closer than `tolerance` times the pole's modulus, closest first."""
        pairs = []
        # Each pole with its nearest zero; middles of the enclosures are accurate enough to measure a distance.
        for pole in self.poles if self.zeros else ():
            zero = min(self.zeros, key=lambda z: float(abs(z.value - pole.value).mid()))
            distance = float((abs(zero.value - pole.value) / abs(pole.value)).mid())
            if distance <= tolerance:
                pairs.append(Doublet(pole, zero, distance))
        return tuple(sorted(pairs, key=lambda pair: pair.distance))

    def proven(self) -> Hashable:
        """Return the decimals to all digits; of a coefficient half-way between two decimals, return the ball."""
        coefficients = (decimal_string(ball, self.digits) or parts_of(ball) for ball in self.a + self.b)
        return self.m, self.n, self.digits, *coefficients

    def decimals(self, digits: int | None = None) -> tuple[tuple[str, ...], tuple[str, ...]]:
        """Return a and b as decimal strings, correctly rounded to `digits` (at most `self.digits`)."""
        digits = self.digits if digits is None else arguments.integer("digits", digits, 1, self.digits)
        return _decimals(self.a, digits), _decimals(self.b, digits)

    def mpf(self) -> tuple[tuple[mp.mpf, ...], tuple[mp.mpf, ...]]:
        """Return a and b as mpmath numbers, the middles of the enclosures (relative error below 5 10^-digits)."""
        return tuple(map(to_mpf, self.a)), tuple(map(to_mpf, self.b))

    def __call__(self, v_star: Values) -> Values:
        """Evaluate a(v*)/b(v*) in double precision for v* >= 0 of any shape; infinity gives the limit.

        Raises
        ------
        TypeError, ValueError
            If an element is not a real number, is negative or NaN.
        """
        return elementwise(self._quotient, "v_star", v_star, _SPEEDS)

    def _quotient(self, v: NDArray[np.float64]) -> NDArray[np.float64]:
        """Return a(v)/b(v); infinity gives the limit."""
        a, b = (np.array([float(c.mid()) for c in _stripped(side)]) for side in (self.a, self.b))
        # Up to v* = 1 in powers of v*; beyond, of u = 1/v*, which neither overflow nor give inf/inf:
        # a(v)/b(v) = u^(degree of b - degree of a) (a_m + a_(m-1) u + …)/(b_n + b_(n-1) u + …).
        low = np.minimum(v, 1.0)
        u = 1 / np.maximum(v, 1.0)
        degree = len(b) - len(a)
        high = (u**degree if degree >= 0 else np.maximum(v, 1.0) ** -degree) * (horner(a[::-1], u) / horner(b[::-1], u))
        return np.where(v <= 1, horner(a, low) / horner(b, low), high)


def horner(c: NDArray[np.float64], x: NDArray[np.float64]) -> NDArray[np.float64]:
    """Return sum c_k x^k for ascending coefficients c."""
    value = np.full_like(x, c[-1])
    for c_k in c[-2::-1]:
        value = value * x + c_k
    return value


def pade(m: SupportsIndex, n: SupportsIndex, digits: SupportsIndex = 30, law: Law | str = VISCOELASTIC) -> Pade:
    """Return the Padé approximant [m/n] of eps(v*), everything proven to `digits` significant digits.

    For another law of contact (`law_of`) v* is kappa^(1/law.d), and n = m + `Law.excess` decays nearly like eps.

    Raises
    ------
    TypeError, ValueError
        If an argument is not an integer or out of range (degrees 0 to 200, digits 1 to 5000).
    DegenerateError
        If [m/n] does not exist, such as [1/1] or [1/3].
    """
    # 30 digits by default are a choice: twice those of a double. So are the largest degree and the most digits, which
    # `arguments` has for all functions: a typing error is refused, and not computed for hours.
    return _pade(
        arguments.integer("m", m, 0, arguments.MAX_DEGREE),
        arguments.integer("n", n, 0, arguments.MAX_DEGREE),
        arguments.digits(digits),
        law_of(law),
    )


@lru_cache(maxsize=64)  # a choice: tables and searches ask again for the same degrees
def _pade(m: int, n: int, digits: int, law: Law) -> Pade:
    """Return [m/n] of a law to `digits` digits, from a series of as many digits as that takes."""
    # Measured for 51 pairs of degrees up to [40/43]: the paper's law loses at most 0.47 (m+n) digits, so that 0.7 (m+n)
    # serve at once. The eight guard digits are a choice: with too few of them the loop below takes another turn. Other
    # laws lose up to 1.8 (m+n), and need a second or third attempt.
    series_digits = digits + 8 + int(0.7 * (m + n))
    # Ten times the digits of the coefficients, and ten for each order m+n, five times the largest loss above. Ten more
    # in the brackets are a choice, so that [0/0] to one digit has attempts, too. A system that these do not determine
    # has a coefficient that is 0, or so it seems: then the function refuses.
    limit = 10 * (digits + m + n + 10)
    while series_digits <= limit:
        # Both are rounded up to a multiple of 16 (a choice), so that approximants of like degrees share a derivation.
        h = derived(_rounded_up(m + n + LOOK_AHEAD), _rounded_up(series_digits), law).h[: m + n + LOOK_AHEAD + 1]
        # 64 bits (a machine word) more, for the rounding of the elimination.
        with working(bits_for(series_digits) + 64):
            try:
                return _solved(h, m, n, digits)
            except _TooWideError as shortage:
                series_digits += shortage.digits + 4  # four more than seem to be missing, so that one attempt is enough
            except ZeroDivisionError:
                # The system is singular, or looks so in balls that are too wide: by how much is not known. Steps of all
                # digits and orders come to the limit in ten turns.
                _refuse_if_degenerate(m, n, law)
                series_digits += digits + m + n
    raise ArithmeticError(
        f"{limit} digits of the series do not determine [{m}/{n}], perhaps because a coefficient is 0: "
        + _determined_near(m, n, law)
    )


def _rounded_up(number: int) -> int:
    """Return the next multiple of 16."""
    return -(-number // 16) * 16


def _determined_near(m: int, n: int, law: Law) -> str:
    """Return degrees near [m/n] that `NEAR_DIGITS` digits determine under a law, as the end of an error message."""
    near = [(i, k) for i in range(m + NEAR + 1) for k in range(max(n - NEAR, 0), n + NEAR + 1)]
    near = [(i, k) for i, k in near if 0 < abs(i - m) + abs(k - n) <= NEAR]
    # `near` has the pairs of degrees at a distance of 1 to NEAR (a choice); the nearest one that exists is named. One
    # series for all of them: `derived(…).h` has the balls of h_0, h_1, …. Four digits an order are twice the largest
    # loss that was measured (`_pade`), as there is no second attempt here.
    series_digits = NEAR_DIGITS + 4 * (m + n + NEAR)
    h = derived(m + n + NEAR + LOOK_AHEAD, series_digits, law).h
    with working(bits_for(series_digits) + 64):  # 64 bits as in `_pade`
        for i, k in sorted(near, key=lambda degrees: abs(degrees[0] - m) + abs(degrees[1] - n)):
            with suppress(ArithmeticError):
                _solved(h[: i + k + LOOK_AHEAD + 1], i, k, NEAR_DIGITS)
                return f"expected for instance [{i}/{k}]"
    return "expected other degrees"


class _TooWideError(ArithmeticError):
    """An enclosure is too wide by `digits` digits."""

    def __init__(self, digits: int) -> None:
        super().__init__(f"{digits} digits short")
        self.digits = digits


def _solved(h: tuple[arb, ...], m: int, n: int, digits: int) -> Pade:
    """Return [m/n] from enclosures of the series. To be called within `working`."""
    a, b = solution(h, m, n)
    _demand(a + b, digits)
    # Accurate digits of the worst h_k, less those of the worst coefficient; exact ones do not count.
    lost = max(relative_digits(h) - relative_digits(a + b), 0)
    return assembled(a, b, h, m, n, digits, _roots(a, digits), _roots(b, digits), lost, _contact(a, b, h))


def assembled(
    a: tuple[arb, ...],
    b: tuple[arb, ...],
    h: tuple[arb, ...],
    m: int,
    n: int,
    digits: int,
    zeros: tuple[Root, ...],
    poles: tuple[Root, ...],
    lost: int,
    contact: tuple[int, arb],
) -> Pade:
    """Return the approximant with the residues of its simple poles. To be called within `working`.

    Parameters
    ----------
    a, b, h : tuple of flint.arb
        Coefficients of numerator, denominator and series.
    m, n, digits : int
        The degrees, and the digits to which everything is determined.
    zeros, poles : tuple of Root
        The roots of a and of b.
    lost : int
        `Pade.digits_lost`.
    contact : tuple of int and flint.arb
        `Pade.contact_order` and `Pade.next_term`.
    """
    # The residue of a/b at a simple pole p is a(p)/b'(p).
    numerator, derivative = acb_poly(list(a)), acb_poly(list(b)).derivative()
    poles = tuple(
        replace(p, residue=numerator(p.value) / derivative(p.value)) if p.multiplicity == 1 else p for p in poles
    )
    return Pade(m, n, digits, a, b, h, poles, zeros, lost, *contact)


def solution(h: Sequence[arb], m: int, n: int) -> tuple[tuple[arb, ...], tuple[arb, ...]]:
    """Return mpmath's a and b of [m/n] as proven enclosures of the true coefficients. To be called within `working`.

    Raises
    ------
    ZeroDivisionError
        If the linear system is not proven to be regular.

    Notes
    -----
    Let A b = y be the order conditions, x mpmath's b, and R nearly the inverse of A. Then (R A)(b - x) = R (y - A x).
    FLINT solves this system by elimination in balls, which loses few digits, because R A is nearly the identity. The
    elimination proves that R A is regular, hence A, too: for all h_k within their balls there is one b, and b - x is
    enclosed. The proof assumes nothing about x and R; a poor x makes a wide ball.
    """
    numerator, denominator = built(h, m, n)
    # b_0 = 1 is the normalisation: mpmath's number, with its distance from 1 as radius (0, as mpmath sets it to 1). The
    # error b - x of the others
    # solves the system with the residual as its right side.
    b = [arb(denominator[0], 1 - denominator[0])]
    if n:
        entries, right = order_system(h, m, n, arb(0))
        # A, x, R, and R (y - A x). "approx" is FLINT's unproven solution, "lu" its plain elimination in balls.
        matrix, x = arb_mat(n, n, entries), denominator[1:]
        identity = arb_mat(n, n, [int(i == j) for i in range(n) for j in range(n)])
        inverse = matrix.mid().solve(identity, algorithm="approx")
        residual = arb_mat(n, 1, right) - matrix * arb_mat(n, 1, x)
        errors = (inverse * matrix).solve(inverse * residual, algorithm="lu").entries()
        # The ball around x_i of a radius that no number in the ball `error` exceeds contains b_i.
        b += [arb(x_i, error) for x_i, error in zip(x, errors, strict=True)]
    # The first m + 1 order conditions give the true a.
    a = [arb(a_k, _product_coefficient(b, h, k) - a_k) for k, a_k in enumerate(numerator)]
    return tuple(a), tuple(b)


def built(h: Sequence[arb], m: int, n: int) -> tuple[list[arb], list[arb]]:
    """Return a and b of [m/n] as mpmath builds them from the middles of the h_k, at FLINT's precision; not proven."""
    mpmath = context(ctx.prec)  # a separate mpmath of as many bits
    # For the progress bar: mpmath eliminates column after column, and swaps rows once in each. Column j costs (n - j)^2
    # operations.
    columns, swap_row = iter(track(range(n), f"mpmath builds [{m}/{n}]", lambda j: (n - j) ** 2)), mpmath.swap_row
    mpmath.swap_row = lambda *rows: (next(columns, None), swap_row(*rows))
    a, b = mpmath.pade([mpmath.mpf(to_mpf(h_k)) for h_k in h], m, n)
    for _ in columns:  # the last column has no rows to swap
        pass
    return [arb(a_k) for a_k in a], [arb(b_i) for b_i in b]


def order_system(h: Sequence[Number], m: int, n: int, zero: Number) -> tuple[list[Number], list[Number]]:
    """Return the matrix (by rows) and right side of the order conditions m+1 … m+n for b_1 … b_n.

    Order k is sum_(1<=i<=n) h_(k-i) b_i = -h_k, where h_j = 0 for j < 0: the `zero` of the numbers' type.
    """
    rows = range(m + 1, m + n + 1)
    return [h[k - i] if k >= i else zero for k in rows for i in range(1, n + 1)], [-h[k] for k in rows]


def _product_coefficient(b: Sequence[arb], h: Sequence[arb], k: int) -> arb:
    """Coefficient k of b(v*) eps(v*)."""
    return sum((b[i] * h[k - i] for i in range(min(k, len(b) - 1) + 1)), arb(0))


def _defects(a: Sequence[arb], b: Sequence[arb], h: Sequence[arb]) -> list[arb]:
    """Coefficients of b eps - a to the order of the series; up to order m + n they vanish."""
    return [_product_coefficient(b, h, k) - (a[k] if k < len(a) else 0) for k in range(len(h))]


def _upper(ball: arb) -> float:
    """Return a double that is not below any number of a non-negative ball."""
    return 0.0 if ball.is_zero() else math.nextafter(float(ball.upper()), math.inf)


def _contact(a: Sequence[arb], b: Sequence[arb], h: Sequence[arb]) -> tuple[int, arb]:
    """Return (k, c) with eps - a/b = c v*^(k+1) + …; c is 0 only if a/b agrees with all of h."""
    # b eps - a vanishes up to order m + n, which makes m + n + 1 conditions. As b_0 = 1, its first term that does not
    # vanish is that of eps - a/b.
    conditions = len(a) + len(b) - 1
    for k, defect in enumerate(_defects(a, b, h)[conditions:], conditions):
        if not defect.contains(0):
            return k - 1, defect
        if not (defect.is_exact() and defect.is_zero()):
            # Contains 0, but not proven to be 0. How many digits would tell is not known; ten, a choice, narrow the
            # ball by 10^10, and cost another attempt if they are too few.
            raise _TooWideError(10)
    return len(h) - 1, arb(0)


def _demand(balls: Sequence[arb], digits: int) -> None:
    """Raise `_TooWideError` unless every ball determines its decimal to `digits` digits."""
    if any(decimal_string(ball, digits) is None for ball in balls):
        # Two digits more than are shown, or one more if a ball straddles a boundary of rounding.
        raise _TooWideError(max(digits + 2 - relative_digits(balls), 1))


def _decimals(balls: Sequence[arb], digits: int) -> tuple[str, ...]:
    """Return the numbers in balls as decimal strings, correctly rounded to `digits` digits."""
    texts = tuple(decimal_string(ball, digits) for ball in balls)
    if None in texts:
        raise ArithmeticError(f"an enclosure does not determine {digits} digits")
    return texts  # type: ignore[return-value]


def _stripped(c: Sequence[arb]) -> Sequence[arb]:
    """Drop leading coefficients that are exactly zero."""
    length = len(c)
    while length > 1 and c[length - 1].is_exact() and c[length - 1].is_zero():
        length -= 1
    return c[:length]


def distance_from_origin(root: Root) -> tuple[float, float]:
    """Return the key for order by modulus, with the root in the lower half-plane first in a conjugate pair."""
    # Ten digits of the modulus: those of a conjugate pair, which may differ in the last digits of a double, are then
    # equal.
    return float(f"{float(abs(root.value).mid()):.9e}"), float(root.value.imag.mid())


def _roots(coefficients: Sequence[arb], digits: int) -> tuple[Root, ...]:
    """Return the simple roots of a polynomial given by balls (its `coefficients`), isolated, to `digits` digits."""
    polynomial = _stripped(coefficients)
    if len(polynomial) == 1:
        return ()
    # FLINT stops refining below 10^-(digits + 6), an absolute error; the balls of the coefficients may leave the roots
    # wider. Two digits more than are shown are needed below, relative to the modulus: measured up to [12/15], for four
    # laws, moduli are 0.09 or more; six digits allow for 10^-4.
    try:
        values = acb_poly(list(polynomial)).roots(tol=arb(10) ** -(digits + 6))
    except ValueError:  # not isolated: too few digits, by an unknown number (as many again), or a multiple root
        raise _TooWideError(digits) from None
    roots = [Root(value, 1, is_real(value, values)) for value in values]
    # Each root has two digits more than are shown, and its parts round to one decimal number.
    for root in roots:
        digits_short = digits + 2 - relative_digits([abs(root.value)])
        if digits_short > 0:
            raise _TooWideError(digits_short)
        if None in (decimal_at(part, abs(root.value), digits) for part in (root.value.real, root.value.imag)):
            raise _TooWideError(1)
    return tuple(sorted(roots, key=distance_from_origin))


def is_real(value: acb, values: Sequence[acb]) -> bool:
    """Whether the root in `value`, one of the enclosures `values` of all roots of a real polynomial, is real.

    It is, if its mirror image lies in no other enclosure. Raises `_TooWideError` if enclosures are too wide to decide.
    """
    if not value.imag.contains(0):
        return False
    # The conjugate of a root is a root, which lies in one of the enclosures: if only in this one, it is the root
    # itself.
    mirror = value.conjugate()
    if sum(mirror.overlaps(other) for other in values) > 1:
        raise _TooWideError(10)  # not known by how much; ten digits, a choice, make enclosures 10^10 times narrower
    return True


def _refuse_if_degenerate(m: int, n: int, law: Law) -> None:
    """Raise `DegenerateError` if a law's system for b is singular; the message names the next n with a regular one."""
    if not _singular(m, n, law):
        return
    # The next n, as far as can be decided, so that the message names degrees that exist.
    larger = next((k for k in range(n + 1, LARGEST_DECIDED - m + 1) if not _singular(m, k, law)), None)
    raise DegenerateError(
        f"[{m}/{n}] does not exist: the order conditions contradict each other, because some h_k are 0"
        + ("" if larger is None else f"; expected for instance [{m}/{larger}]")
    )


def _singular(m: int, n: int, law: Law) -> bool:
    """Whether a law's system for b is singular for all lambda_1, lambda_3, … ; False if it is too large to decide.

    The h_k are exact polynomials in the lambdas, so this is algebra: a determinant that is not 0 for some numbers in
    their place is not identically 0.
    """
    if m + n > LARGEST_DECIDED:
        return False
    import sympy

    from viscopade.theory.symbolic import h_polynomial  # loads SymPy, only for a system that may be singular

    h = [h_polynomial(k, law) for k in range(m + n + 1)]
    # Primes in place of the lambdas, from number 2 on, 3, 5, 7, …, and from number 30 on, 113, 127, … (a choice; any
    # two sets of numbers without a relation serve): a determinant that is not identically 0 will hardly be 0 for both,
    # as it is a polynomial with rational coefficients.
    symbols = sorted(set().union(*(h_k.free_symbols for h_k in h)), key=str)
    for offset in (2, 30):
        values = {symbol: sympy.prime(offset + i) for i, symbol in enumerate(symbols)}
        exact = [sympy.Rational(h_k.subs(values)) for h_k in h]
        entries, _ = order_system([fmpq(int(c.p), int(c.q)) for c in exact], m, n, fmpq(0))
        if fmpq_mat(n, n, entries).det() != 0:
            return False
    return True
