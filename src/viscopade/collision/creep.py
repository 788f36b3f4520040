r"""Unloading to x = 0 against strong damping, where the bodies creep (docs/theory/exact-function.md, step 13).

For q = 2 n_b - n_a > 0 (nu < 2) unloading forgets its beginning, but for a part that is exponentially small in k^2: it
follows the slow manifold

    p = r^d w(e)/k,    e = 1/(k^2 r^q),    w = 1 + e (2 d w^2 - q e d(w^2)/de),

to where e is of order 1. The coefficients of w are integers and grow like n! q^n. The flow has the scaling

    k -> k_0:    r = L r_0,    p = L^(n_a/2) p_0,    L = (k_0/k)^(2/q),

so one and the same unloading with a moderate k_0, begun at r_0 = 1, has the end of all with a larger k. Three parts
are enclosed: the beginning with k itself, until it is on the slow manifold (`flow`); the slow manifold, by its series
with a proven remainder; the end, with k_0. None of them gets longer with k.
"""

from __future__ import annotations

from dataclasses import dataclass
from fractions import Fraction
from functools import lru_cache
from math import floor, log2, sqrt
from operator import mul
from typing import NamedTuple

from flint import arb, arb_poly, fmpz_poly

from viscopade.arithmetic.balls import ball_of, rational_power, working
from viscopade.collision import validation
from viscopade.collision.flow import Branch, Dyadic, Motion, at_joint, beginning, integrate
from viscopade.collision.validation import GUARD_BITS, Ends, Joint

FASTER = 1.25
"""The least k/k_0: between the beginning with k and the end with k_0 there must be something left."""
LEAST_RATE = 64  # of k_0^2 to |d| + q, so that the slow manifold's series begins to converge
SQUARE_PER_BIT, SQUARE_PER_D = 2.5, 8.0  # k_0^2 over q and bits, and d: e^(-0.3 k_0^2/q + 0.9 d/q) is not forgotten
SETTLED = 0.4  # r_0^q where the slow manifold is reached, about
SPARE, CLOSE = 14, 6  # bits that the series and the integrations have more, and how many of them count as closeness
MOST_TERMS = 10_000
WIDER = 1.2  # of k_0, if the series does not converge far enough


class Setting(NamedTuple):
    """What depends on the accuracy and the law only, not on k."""

    k_0: Dyadic
    bits: int
    """To which the slow manifold is followed."""
    w: fmpz_poly
    over_w: fmpz_poly
    """The series of 1/w."""


@lru_cache(maxsize=64)
def setting(accuracy: int, motion: Motion) -> Setting | None:
    """Return k_0 and the series, or None if contact does not end so: with delayed recovery, or nu >= 2."""
    q = _q(motion)
    if motion.delayed or q <= 0:
        return None
    square = float(LEAST_RATE * (abs(motion.d) + q))
    while True:
        # What differs at first is small compared with p there, but p itself falls from 1/k_0 to k_0^(-n_a/q).
        falls = (motion.n_a / q - 1) * log2(square) if motion.d > 0 else 0.0
        bits = accuracy + SPARE + round(falls)
        square = max(square, SQUARE_PER_BIT * q * bits + SQUARE_PER_D * max(motion.d, 0))
        found = _series(motion, SETTLED * square, bits)
        if found is not None:
            return Setting(Dyadic(round(16 * sqrt(square)), -4), bits, *found)
        square *= WIDER**2


def _series(motion: Motion, over_e: float, bits: int) -> tuple[fmpz_poly, fmpz_poly] | None:
    """Return w and 1/w with as many terms as it takes, or None if 1/e is too small for that."""
    d, q, size = motion.d, _q(motion), log2(over_e)
    w, least = [1], 0
    for n in range(1, MOST_TERMS):
        square = 2 * sum(map(mul, w[: n // 2], reversed(w[n - n // 2 :])))
        square += w[n // 2] ** 2 if n % 2 else 0
        w.append((2 * d - q * (n - 1)) * square)
        term = w[-1].bit_length() - floor(n * size)
        if d == 0 or (w[-1] and term < -bits - SPARE):
            return fmpz_poly(w), _inverse(w)
        if term > least + SPARE:
            return None
        least = min(least, term) if w[-1] else least
    return None


def _inverse(w: list[int]) -> fmpz_poly:
    """Return as many terms of 1/w, w = 1 + …."""
    over = [1]
    for n in range(1, len(w)):
        over.append(-sum(map(mul, w[1 : n + 1], reversed(over))))
    return fmpz_poly(over)


def _q(motion: Motion) -> int:
    return 2 * motion.n_b - motion.n_a


# --- integration ------------------------------------------------------------------------------------------------------


@dataclass(frozen=True)
class Creep:
    """Unloading to r = 0 with a large k, in three parts, of which the second needs no integration.

    Attributes
    ----------
    k : Dyadic
        Negative, as for `flow.Branch`.
    first : Branch
        From the turning point until the slow manifold is reached.
    last : Branch
        The whole of unloading, with k_0.
    settled : int
        Number of pieces of `last` behind which it is on the slow manifold, too.
    setting : Setting
    """

    k: Dyadic
    first: Branch
    last: Branch
    settled: int
    setting: Setting

    @property
    def motion(self) -> Motion:
        """What the flow knows of the law."""
        return self.first.motion

    def sensitivity(self) -> arb:
        """Return d ln p/d ln k at the end, without a proof: p is a power of k, nearly."""
        return -ball_of(_power(self.motion))


def _power(motion: Motion) -> Fraction:
    """N_a/q: p ~ k^-(n_a/q) at the end."""
    return Fraction(motion.n_a, _q(motion))


def unloading(k: Dyadic, accuracy: int, motion: Motion) -> Branch | Creep:
    """Integrate unloading (k < 0) to the end, as `flow.integrate` does, or for large k in three parts.

    Raises
    ------
    NoEndError
        If the end is at r = 0, and unloading does not reach it.
    """
    of = setting(accuracy, motion)
    if of is None or k.size < of.k_0.size or not abs(k.ball()) > of.k_0.ball() * FASTER:
        return integrate(k, accuracy, motion)
    last, settled = _last(of, motion)
    first = beginning(k, of.bits, motion, lambda r, p: _is_slow(of, motion, k, r, p))
    return Creep(k, first, last, settled, of)


@lru_cache(maxsize=16)
def _branch_of(k: Dyadic, bits: int, motion: Motion) -> Branch:
    return integrate(k, bits, motion)


def _last(of: Setting, motion: Motion) -> tuple[Branch, int]:
    """Return the unloading with k_0, and how many of its pieces lead to the slow manifold."""
    k = Dyadic(-of.k_0.mantissa, of.k_0.exponent)
    branch = _branch_of(k, of.bits + round(2 * log2(float(of.k_0.ball()))), motion)
    with working(branch.bits + 64):
        for count, piece in enumerate(branch.pieces[:-1], 1):
            if _is_slow(of, motion, k, *at_joint(piece, branch.bits)):
                return branch, count
    raise ArithmeticError("unloading does not come to the slow manifold")


def _is_slow(of: Setting, motion: Motion, k: Dyadic, r: arb, p: arb) -> bool:
    e = _e(k.ball(), r, motion)
    return bool(abs(abs(k.ball()) * p / r**motion.d - arb_poly(of.w)(e)) < arb(2) ** (CLOSE - of.bits))


def _e(k: arb, r: arb, motion: Motion) -> arb:
    return 1 / (k**2 * r ** _q(motion))


# --- proof ------------------------------------------------------------------------------------------------------------


def ends_of(branch: Branch | Creep) -> Ends:
    """Enclose p at the end, the time and the work, as `validation.ends` does.

    Raises
    ------
    ArithmeticError
        If what was found is too far from a solution for a theorem to apply.
    """
    if isinstance(branch, Branch):
        return validation.ends(branch)
    with working(branch.setting.bits + GUARD_BITS):
        return _ends(branch)


def _ends(branch: Creep) -> Ends:
    motion, k, k_0 = branch.motion, abs(branch.k.ball()), branch.setting.k_0.ball()
    begun = validation.joint(branch.first, len(branch.first.pieces))
    settled = validation.joint(branch.last, branch.settled)
    scale = rational_power(k_0 / k, Fraction(2, _q(motion)))
    end = scale * settled.r
    if not end < begun.r:
        raise ArithmeticError("there is no slow manifold between the beginning and the end")
    slow = _Slow.of(branch.setting, motion, _e(k_0, settled.r, motion))
    error = slow.error(_apart(slow, k, begun).max(_apart(slow, k_0, settled)))
    rest = validation.ends(branch.last, branch.settled)
    # Both w are in W +- error, W + error < 2. What p^2 differs by never grows, and p is least at one of the ends.
    differs = (settled.r**motion.d / k_0) ** 2 * 8 * error / rest.p.min(settled.p) ** 2
    if not differs < arb(1) / 2:
        raise ArithmeticError("unloading has not forgotten its beginning")
    uncertain = arb(1, differs.abs_upper())
    half = Fraction(motion.n_a, 2)
    p = rational_power(scale, half) * rest.p * uncertain
    last = rational_power(scale, motion.m - half) * rest.time * uncertain
    return Ends(p, begun.time + slow.time(k, end, begun.r, error) + last, (arb(1) / motion.n_a - p**2) / k)


class _Slow(NamedTuple):
    """The slow manifold's truncated series, W of w and V of 1/w, for all e up to a largest one."""

    w: arb_poly
    over_w: arb_poly
    residual: arb
    """Bound of |W - 1 - e (2 d W^2 - q e d(W^2)/de)|."""
    remainder: arb
    """Bound of |V W - 1|."""
    most: arb
    """Bound of W; its lower bound is 1/2."""
    attraction: arb
    """Bound of 2 d e."""
    motion: Motion

    @classmethod
    def of(cls, setting: Setting, motion: Motion, e: arb) -> _Slow:
        w, x = setting.w, fmpz_poly([0, 1])
        square = w * w
        residual = w - 1 - x * (2 * motion.d * square - _q(motion) * x * square.derivative())
        change = _sum(w - 1, e)
        if not change < arb(1) / 2:
            raise ArithmeticError("the series of the slow manifold does not converge")
        return cls(
            arb_poly(w),
            arb_poly(setting.over_w),
            _sum(residual, e),
            _sum(setting.over_w * w - 1, e),
            1 + change,
            2 * max(motion.d, 0) * e,
            motion,
        )

    def error(self, at_first: arb) -> arb:
        """Bound |w - W| up to the largest e, given a bound where the slow manifold is reached."""
        error = at_first.max(4 * self.residual)
        pull = 1 / (self.most + error) - self.attraction * self.most
        if not (error < arb(1) / 8 and error * pull >= 2 * self.residual and pull > 0):
            raise ArithmeticError("the slow manifold does not attract")
        return error

    def time(self, k: arb, low: arb, high: arb, error: arb) -> arb:
        """Enclose the integral of r^(m-1)/(2 p) dr = k r^(m-1-d)/(2 w) dr."""
        if not self.remainder < arb(1) / 2:
            raise ArithmeticError("the series of the slow manifold does not converge")
        power, q = self.motion.m - self.motion.d, _q(self.motion)
        e_low, e_high = (_e(k, r, self.motion) for r in (low, high))
        low_factor, high_factor = low**power, high**power
        total = arb(0)
        for n, c in enumerate(self.over_w.coeffs()):
            exponent = power - n * q
            if exponent:
                total += c * (high_factor - low_factor) / exponent
            else:
                total += c * (high / low).log() * high_factor
            low_factor, high_factor = low_factor * e_low, high_factor * e_high
        return k / 2 * total * arb(1, (4 * error + 2 * self.remainder).abs_upper() * 2)


def _sum(polynomial: fmpz_poly, e: arb) -> arb:
    """Bound a polynomial from 0 to e > 0."""
    return arb_poly([abs(c) for c in polynomial.coeffs()])(e).abs_upper()


def _apart(slow: _Slow, k: arb, joint: Joint) -> arb:
    """Bound |w - W| at a joint."""
    motion = slow.motion
    return (k * joint.p / joint.r**motion.d - slow.w(_e(k, joint.r, motion))).abs_upper()
