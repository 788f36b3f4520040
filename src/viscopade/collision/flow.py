r"""The collision as a polynomial flow, integrated by Taylor polynomials piece by piece (docs/theory/exact-function.md).

Measured from the turning point, with r = (x/x_max)^(1/m) and p = g/sqrt(n_a) (docs/theory/mathematics.md, section 3),
the only parameter is k = sqrt(n_a) K. In a regularised time s,

    u = 1 - r,    u' = 2 p,    p' = r^(n_a-1) + k p r^(n_b-1),    u(0) = p(0) = 0.

For the paper's law r = sqrt(x/x_max), p = |x'|/(2 x_max^(5/4)) and p' = r^2 (r^2 + k p); n_a, n_b and m of the others
are in `Motion`. This is loading, backwards in time, until r = 0, where p = F. With -k for k it is unloading, until
contact ends, where p = m: where the force vanishes, r^(n_a-n_b) = k p, or at r = 0. Both are entire pieces of the same
polynomial flow: no root, no singular point, and not stiff if the force vanishes before r = 0.

`integrate` follows one of them for a given k. `collide` follows both in time, from first contact through the turning
point, whose place gives k.

A `Branch` is a chain of polynomials u(z), 0 <= z <= 1, s = s_0 + h z, with integer coefficients in units of 2^-bits.
They may come from anywhere: `validation` proves how far they are off, from the residual of the equation alone.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from functools import cached_property
from itertools import pairwise
from math import exp, ldexp, lgamma, log, pi, sqrt
from typing import NamedTuple

from flint import arb, arb_poly, arb_series, ctx, fmpz, fmpz_poly

from viscopade.arithmetic.balls import fixed_point, working
from viscopade.collision.recursion import Recursion, shifted
from viscopade.theory.law import VISCOELASTIC, Law

# Coefficients a piece has for each bit: pieces as long as a quarter of the radius of convergence cost least.
TERMS_PER_BIT = 0.5
# Up to so many, over the square of the bits, Taylor coefficients one by one are faster than Newton's iteration: 494 of
# 900 bits, 100 of 2000.
NEWTON_FROM = 400_000_000
# Of `Motion.radius`: for n_a = 5 a quarter of the distance 0.911 of the nearest singularity.
LONGEST_FIRST_STEP = 0.2258
STEP_AT_CONTACT = 0.16  # of a first step from first contact, times the speed there: r goes to about a third
MAX_PIECES = 20_000
MAX_SLOW_PIECES = 4_000  # of unloading to x = 0 close below the damping that holds the bodies back
# Largest k^2/(2 n_b - n_a) of unloading to x = 0 for nu < 2: the number of pieces grows like that, to about 4000 here.
STRONGEST_DAMPING = 25_000
# Largest |h k|: p grows like exp(h k), and is zero again at |h k| = 2 pi, which Newton's iteration must avoid.
LARGEST_GROWTH = 6.0
SPARE_BITS = 4  # excess of the last coefficients over the accuracy, in bits, that is tolerated
AIM_BITS = 3  # by which new steps aim at a higher accuracy, so that few must be shortened


class NoEndError(ArithmeticError):
    """Contact does not end: damping holds the bodies back, and they do not reach x = 0, or too slowly."""


class Motion(NamedTuple):
    """The parameters of a law of contact in the flow."""

    n_a: int
    n_b: int
    m: int
    """x = x_max r^m."""
    delayed: bool
    """Whether unloading ends where the force vanishes, before r = 0."""

    @classmethod
    def from_law(cls, law: Law) -> Motion:
        """Return the motion of a law: its exponents in r = (x/x_max)^(1/m) with the least m that makes them whole."""
        return cls(*law.powers, law.m, law.delayed)

    @property
    def d(self) -> int:
        """n_a - n_b: the force is proportional to r^d + k p."""
        return self.n_a - self.n_b

    @property
    def attractive(self) -> bool:
        """Whether the force vanishes before r = 0, but contact goes on to r = 0."""
        return self.d > 0 and not self.delayed

    @property
    def factors(self) -> tuple[int, int, int]:
        """Powers of r in p' = r^common (r^elastic + k p r^viscous)."""
        return min(self.n_a, self.n_b) - 1, max(self.d, 0), max(-self.d, 0)

    @property
    def radius(self) -> float:
        """Distance of a singularity of u(s) from the turning point at k = 0, at most 4; others are hardly nearer.

        On the imaginary axis r is infinite at B(1/2 - 1/n_a, 1/2)/(2 sqrt(n_a)), as p^2 = (1 - r^n_a)/n_a.
        """
        if self.n_a <= 2:
            return 4.0
        gap = 0.5 - 1 / self.n_a
        return min(exp(lgamma(gap) - lgamma(gap + 0.5)) * sqrt(pi / self.n_a) / 2, 4.0)


HERTZ = Motion.from_law(VISCOELASTIC)


class Dyadic(NamedTuple):
    """A dyadic number, mantissa 2^exponent."""

    mantissa: int
    exponent: int

    @classmethod
    def nearest(cls, value: arb, bits: int) -> Dyadic:
        """Round the middle of a ball to `bits` significant bits."""
        mantissa, exponent = (int(part) for part in value.mid().man_exp())
        excess = max(mantissa.bit_length() - bits, 0)
        return cls(mantissa >> excess, exponent + excess)

    @property
    def size(self) -> int:
        """The least n with |value| < 2^n; very negative for 0."""
        return self.mantissa.bit_length() + self.exponent if self.mantissa else -(10**9)

    def ball(self) -> arb:
        """Return the number as an exact ball."""
        return arb(self.mantissa) * arb(2) ** self.exponent

    def product(self, other: Dyadic) -> Dyadic:
        """Return the exact product."""
        return Dyadic(self.mantissa * other.mantissa, self.exponent + other.exponent)

    def times(self, number: int) -> int:
        """Return the integer part of value * number, rounded down."""
        return shifted(self.mantissa * number, self.exponent)

    def over(self, divisor: Dyadic, number: int) -> int:
        """Return value * number / divisor, less than two units too small or too large."""
        return shifted(self.mantissa * number, self.exponent - divisor.exponent) // divisor.mantissa


class Piece(NamedTuple):
    """Taylor polynomial u(z) = sum u_j z^j, 0 <= z <= 1, over a step h of s; u_j in units of 2^-bits.

    If h < 0, s grows from z = 1 to z = 0: the piece is read backwards.
    """

    u: list[int]
    h: Dyadic

    @property
    def y(self) -> list[int]:
        """Coefficients of du/dz = 2 h p."""
        return [j * c for j, c in enumerate(self.u)][1:]

    def at_ends(self, coefficients: list[int]) -> tuple[int, int]:
        """Return the values of a polynomial in z where the piece begins and where it ends."""
        bottom, top = coefficients[0], sum(coefficients)
        return (bottom, top) if self.h.mantissa > 0 else (top, bottom)


@dataclass(frozen=True)
class Branch:
    """Loading (k >= 0) or unloading (-k) from the turning point to the end, which lies in the last piece.

    Attributes
    ----------
    k : Dyadic
        The parameter, exactly; negative for unloading.
    bits : int
        Coefficients are in units of 2^-bits.
    pieces : tuple of Piece
        At the joints u is continuous; `jumps` bounds the jumps of p. Pieces of loading may be read backwards.
    root : int
        Approximate z of the end in the last piece, in units of 2^-bits.
    motion : Motion
    """

    k: Dyadic
    bits: int
    pieces: tuple[Piece, ...]
    root: int
    motion: Motion = HERTZ

    def __post_init__(self) -> None:
        if self.pieces[0].u[:2] != [0, 0] or self.pieces[0].h.mantissa <= 0:
            raise ValueError("a branch starts with u = p = 0")
        if self.k.mantissa < 0 and any(piece.h.mantissa <= 0 for piece in self.pieces):
            raise ValueError("pieces of unloading are not read backwards")
        if not 0 <= self.root <= 1 << self.bits:
            raise ValueError("the end is not in the last piece")
        if any(before.at_ends(before.u)[1] != after.at_ends(after.u)[0] for before, after in pairwise(self.pieces)):
            raise ValueError("u is not continuous")

    def jumps(self) -> list[int]:
        """Bound the jumps of p at the joints, in units of du/dz of the piece behind the joint."""
        joints = [
            (after.h.over(before.h, before.at_ends(before.y)[1]), after.at_ends(after.y)[0])
            for before, after in pairwise(self.pieces)
        ]
        return [abs(before - after) + 2 for before, after in joints]  # 2: the error of `Dyadic.over`

    @cached_property
    def p_end(self) -> arb:
        """F or m at the end, without a proof. To be called within `working`."""
        last = self.pieces[-1]
        return fixed_point(_horner(last.y, self.root, self.bits), 0, self.bits) / (2 * last.h.ball())

    def sensitivity(self) -> arb:
        """Return d ln p/d ln k at the end of a branch of `integrate`, without a proof, to about half of the bits.

        The derivative of p^2/2 with respect to k at constant r, call it q, obeys q' = r^(n_b-1) (p^2 + k q). As p is
        stationary at an end that moves, dp/dk is q/p there.
        """
        bits = (self.bits - 2 * max(self.k.size, 0)) // 2 + 32
        q = arb(0)
        for piece in self.pieces:
            with working(bits, len(piece.u) // 2 + 8):
                y, r = self._half(piece.y), 1 - self._half(piece.u)
                damping, h = r ** (self.motion.n_b - 1), piece.h.ball()
                growth = (h * self.k.ball() * damping.integral()).exp()
                q_series = growth * (q + (damping * y * y / growth).integral() / (4 * h))
                end = arb(1) if piece is not self.pieces[-1] else fixed_point(self.root, 0, self.bits)
                q = _value(q_series, end).mid()
        with working(bits):
            return self.k.ball() * q / self.p_end**2

    def work(self) -> arb:
        """Return the integral of p r^(n_b-1) dr over a branch of `integrate`, without a proof."""
        total, unit = arb(0), arb(2) ** -self.bits
        with working(self.bits - 2 * max(self.k.size, 0) + 32, len(self.pieces[0].u)):
            for piece in self.pieces:
                y, r = arb_series([c * unit for c in piece.y]), 1 - arb_series([c * unit for c in piece.u])
                end = arb(1) if piece is not self.pieces[-1] else fixed_point(self.root, 0, self.bits)
                total += (_value((y * y * r ** (self.motion.n_b - 1)).integral(), end) / (2 * piece.h.ball())).mid()
        return total

    def _half(self, coefficients: list[int]) -> arb_series:
        """Return half of the terms, which have half of the accuracy."""
        unit = arb(2) ** -self.bits
        length = len(self.pieces[0].u) // 2 + 8
        return arb_series([c * unit for c in coefficients[:length]], length)


def _value(series: arb_series, z: arb) -> arb:
    total = arb(0)
    for c in reversed(series.coeffs()):
        total = total * z + c
    return total


def _horner(coefficients: Sequence[int | fmpz], z: int, bits: int) -> int:
    """Return the polynomial at 0 <= z <= 1 (all in units of 2^-bits), at most one unit a coefficient too small."""
    if z == 1 << bits:
        return int(sum(coefficients))
    total = 0
    for c in reversed(coefficients):
        total = (total * z >> bits) + int(c)
    return total


# --- integration ------------------------------------------------------------------------------------------------------


def integrate(k: Dyadic, accuracy: int, motion: Motion = HERTZ) -> Branch:
    """Integrate from the turning point to the end of loading (k >= 0) or of unloading (k < 0).

    `accuracy` is roughly the relative accuracy of p at the end in bits; `validation.ends` proves it. In unloading
    r^d - |k| p, whose zero is the end, has about the same accuracy, although it is of order 1/k^2 long before.

    Raises
    ------
    NoEndError
        If the end is at r = 0, and unloading does not reach it, or too slowly.
    """
    more = 2 * motion.n_b - motion.n_a
    if k.mantissa < 0 and not motion.delayed and more > 0 and k.ball() ** 2 > STRONGEST_DAMPING * more:
        raise NoEndError("x = 0 is reached too slowly")
    steps = _steps(k, accuracy, motion)
    bits, pieces = steps.bits, [steps.piece(0, 0, steps.first())]
    while not _ends_in(pieces[-1], k, bits, motion):
        stopped = len(pieces) == MAX_SLOW_PIECES or sum(pieces[-1].y) <= 0  # p > 0 is lost in its errors
        slow = k.mantissa < 0 and not motion.delayed and stopped
        if slow or (k.mantissa < 0 and _creeps(pieces[-1], k, bits, motion)):
            raise NoEndError("x = 0 is not reached")
        if len(pieces) == MAX_PIECES:
            raise ArithmeticError("the end of the collision was not found")
        pieces.append(steps.next(pieces[-1]))
    return Branch(k, bits, tuple(pieces), _root(pieces[-1], k, bits, motion), motion)


def collide(k: Dyadic, speed: Dyadic, accuracy: int) -> tuple[Branch, Branch]:
    """Integrate the paper's law in time, from first contact to the end of unloading; return loading and unloading.

    Units belong to a length X close to x_max: k = 2 kappa X^(1/4), and contact begins with r = 0 and
    p = -speed = -1/(2 X^(5/4)), since p < 0 while the bodies approach. Let r = r_t at the turning point. In units of
    x_max, r, k and s are then r/r_t, k r_t^(1/2) and s r_t^(3/2). Loading is unloading backwards in time.
    """
    steps = _steps(Dyadic(-k.mantissa, k.exponent), accuracy, HERTZ)
    one, size = 1 << steps.bits, speed.size
    h = _step(STEP_AT_CONTACT / ldexp(float(speed.ball()), -size), -size)
    pieces = [steps.piece(one, -speed.times(one), h, Dyadic(1, -1))]
    # Newton's iteration in `taylor` divides by Y^2: in the last piece it loses bits, but only behind the turning point.
    while sum(pieces[-1].y) < 0 and len(pieces) < MAX_PIECES:
        pieces.append(steps.next(pieces[-1]))
    with working(steps.bits + 32):
        # The turning point gives this collision's k, and so unloading.
        turning = _turning(pieces[-1])
        r_t = 1 - _poly(pieces[-1].u, steps.bits)(turning).mid()
        stretch = r_t * r_t.sqrt()
        k = Dyadic.nearest(k.ball() * r_t.sqrt(), accuracy + 32)
        unloading = integrate(Dyadic(-k.mantissa, k.exponent), accuracy)

        # Its first piece also reaches back to before the turning point. Cut the pieces from first contact off there.
        first = unloading.pieces[0]
        around = Piece([-c if j % 2 else c for j, c in enumerate(first.u)], first.h)
        z = turning - around.h.ball() / (stretch * pieces[-1].h.ball())
        while z < 0 and len(pieces) > 1:
            z = 1 + z * pieces.pop().h.ball() / pieces[-1].h.ball()
        # At z, which is exact up to the error of the integration, r shall be the same in both.
        u, r_joint = _poly(pieces[-1].u, steps.bits), 1 - fixed_point(sum(around.u), 0, unloading.bits)
        z += (1 - u(z) - r_t * r_joint) / u.derivative()(z)
        ratio, h = _floor(z * one), Dyadic.nearest(z * pieces[-1].h.ball(), steps.bits)
        pieces[-1] = Piece(_compressed(pieces[-1].u, ratio, steps.bits), h)

        # In units of x_max every piece begins exactly where the one before it ends, and the last ends where `around`
        # begins: what is left of the difference becomes a change of its slope.
        loading, start, factor = list[Piece](), 1 << unloading.bits, _floor(arb(2) ** unloading.bits / r_t)
        for piece in pieces:
            u_scaled = [start, *(c * factor >> steps.bits for c in piece.u[1:])]
            loading.append(Piece(u_scaled, Dyadic.nearest(-stretch * piece.h.ball(), steps.bits)))
            start = sum(u_scaled)
        loading[-1].u[1] += sum(around.u) - start
    return Branch(k, unloading.bits, (around, *reversed(loading)), 0), unloading


def _turning(piece: Piece) -> arb:
    """Return z where Y = 0, by Newton's method. To be called within `working`."""
    y = _poly(piece.y, 0)
    slope, z = y.derivative(), y[0] / (y[0] - y(arb(1)))
    for _ in range(ctx.prec.bit_length() + 2):
        z = (z - y(z) / slope(z)).mid()
    return z


def _poly(coefficients: list[int], bits: int) -> arb_poly:
    """Return a polynomial from its coefficients in units of 2^-bits."""
    return arb_poly(fmpz_poly(coefficients)) * arb(2) ** -bits


def _steps(k: Dyadic, accuracy: int, motion: Motion) -> _Steps:
    size = max(k.size, 0)
    if k.mantissa < 0:
        accuracy += min(size, 10)
    terms = int(TERMS_PER_BIT * accuracy) + 10
    bits = accuracy + (4 if k.mantissa < 0 else 2) * size + 2 * terms.bit_length() + 8
    return _Steps(k, bits, terms, accuracy, motion, absolute=k.mantissa < 0 and motion.attractive)


@dataclass(frozen=True)
class _Steps:
    """Choice of the steps h, so that `terms` coefficients give `accuracy` bits."""

    k: Dyadic
    bits: int
    terms: int
    accuracy: int
    motion: Motion
    absolute: bool
    """Whether it is the error of p itself that never grows, however small p is."""

    def first(self) -> Dyadic:
        """Return a first step.

        For large k the solution is made of exp(k s), whose coefficients (h k)^j/j! decide.
        """
        size = max(self.k.size, 0)
        k_scaled = ldexp(abs(self.k.mantissa) / (1 << self.k.mantissa.bit_length()), self.k.size - size)
        longest = exp((lgamma(self.terms + 1) - self.accuracy * log(2)) / self.terms)  # |h k|
        longest = min(longest, LARGEST_GROWTH)
        longest_at_0 = LONGEST_FIRST_STEP * self.motion.radius
        return _step(1 / (ldexp(1 / longest_at_0, -size) + k_scaled / longest), -size)

    def next(self, last: Piece) -> Piece:
        """Return the piece after `last`."""
        growth = max(float(abs(self.k.ball()) * last.h.ball()) * self.damping(last), 1e-9)
        longer = min(self.stretch(self.spare_bits(last) - AIM_BITS), 2.0, LARGEST_GROWTH / growth)
        return self.piece(sum(last.u), sum(last.y), _scaled(last.h, longer), last.h)

    def damping(self, last: Piece) -> float:
        """Return r^(n_b-1) at the end of a piece, by which the growth is less if the way leads to r = 0."""
        if self.motion.delayed or self.k.mantissa >= 0:
            return 1.0
        r = fixed_point((1 << self.bits) - sum(last.u), 0, self.bits)
        return max(float(r), 0.0) ** (self.motion.n_b - 1)

    def piece(self, start: int, slope: int, h: Dyadic, slope_step: Dyadic | None = None) -> Piece:
        """Return the piece from u = start, du/dz = slope (for a step of slope_step), shortened as far as needed."""
        first = h.over(slope_step, slope) if slope_step else 0
        piece = Piece(taylor(start, first, h, self.k, self.bits, self.terms, self.motion), h)
        while (spare := self.spare_bits(piece)) < 0:
            piece = self.shortened(piece, self.stretch(spare - AIM_BITS))
            if slope_step:
                piece.u[1] = piece.h.over(slope_step, slope)
        return piece

    def shortened(self, piece: Piece, factor: float) -> Piece:
        """Return the same polynomial over a step shorter by about `factor`: its coefficients times powers of that."""
        h = _scaled(piece.h, factor)
        return Piece(_compressed(piece.u, h.over(piece.h, 1 << self.bits), self.bits), h)

    def spare_bits(self, piece: Piece) -> float:
        """Return by how many bits the last coefficients are smaller than they need to be."""
        largest = max(abs(c) for c in piece.u[-4:]) + 1
        needed = self.accuracy + 2 * _log2(self.terms) - SPARE_BITS + self.force_bits(piece)
        size = max(abs(piece.u[1]), piece.u[2])
        if self.absolute:
            size = max(size, piece.h.times(1 << self.bits) >> 3)
        return _log2(size) - needed - _log2(largest)

    def force_bits(self, piece: Piece) -> float:
        """Return how many bits more than p must be known in order to know r^d - |k| p, at the end of the piece."""
        if self.k.mantissa >= 0 or self.k.size <= 0 or not self.motion.delayed or piece.u[1] < 0:
            return 0.0
        r = (1 << self.bits) - piece.u[0]
        damping = Dyadic(-self.k.mantissa, self.k.exponent).over(_twice(piece.h), piece.u[1])
        lost = self.bits - _log2(max(_power(r, self.motion.d, self.bits) - damping, 1)) + LARGEST_GROWTH / log(2)
        return min(lost, 2.0 * self.k.size + 4)

    def stretch(self, spare_bits: float) -> float:
        """Return by how much a step can be longer that has so many bits to spare."""
        return float(2.0 ** (spare_bits / (self.terms - 1)))


def _compressed(u: list[int], ratio: int, bits: int) -> list[int]:
    """Return the coefficients of u(ratio z), the ratio in units of 2^-bits."""
    power, compressed = 1 << bits, list[int]()
    for c in u:
        compressed.append(c * power >> bits)
        power = power * ratio >> bits
    return compressed


def _log2(number: int) -> float:
    size = number.bit_length()
    return size + log((number << 64 >> size) / 2.0**64) / log(2)


def _step(value: float, exponent: int) -> Dyadic:
    """Return value 2^exponent with a short mantissa."""
    return Dyadic(round(ldexp(value, 20)), exponent - 20)


def _scaled(h: Dyadic, factor: float) -> Dyadic:
    size = h.mantissa.bit_length()
    return _step(factor * h.mantissa / 2.0**size, h.exponent + size)


def taylor(start: int, slope: int, h: Dyadic, k: Dyadic, bits: int, terms: int, motion: Motion = HERTZ) -> list[int]:
    """Return Taylor coefficients of u(z), u(0) = start, u'(0) = slope, in units of 2^-bits.

    With r = 1 - u, S = r^common and Y = u' the flow is u'' = S V, V = 2 h^2 r^elastic + h k r^viscous Y
    (`Motion.factors`).
    """
    lengths = [terms]
    while lengths[-1] > max(NEWTON_FROM // bits**2, 16):
        lengths.append((lengths[-1] + 5) // 2)
    constants = Dyadic(2, 0).product(h).product(h), h.product(k)
    u = Recursion(start, slope, *constants, motion.factors, bits).coefficients(lengths.pop())
    while lengths:
        u = _doubled(u, *constants, bits, lengths.pop(), motion)
    return u


def _doubled(u: list[int], elastic: Dyadic, viscous: Dyadic, bits: int, terms: int, motion: Motion) -> list[int]:
    """Append coefficients by one step of Newton's iteration, to less than twice as many.

    The correction e solves the linearised flow. With Y = u', which solves it too, w = Y e' - Y' e obeys
    w' = h k r^(n_b-1) w + Y (u'' - S V), and e = Y integral of w/Y^2. The weight is Y exp(-integral of h k r^(n_b-1)).
    """
    old, new, length = len(u), terms - len(u), terms - 2
    r, y = (1 << bits) - fmpz_poly(u), fmpz_poly(u).derivative()
    powers = {power: _cut_power(r, power, bits, length) for power in {*motion.factors, motion.n_b - 1}}
    s, spring, drag = (powers[power] for power in motion.factors)
    damping = y if motion.d >= 0 else _cut(drag * y, bits, length)
    v = _times(elastic, spring, length) + _times(viscous, damping, length)
    residual = _cut(s * v, bits, length).right_shift(old - 2)
    turning = 1 if u[1] == 0 else 0  # Y has a factor z at the turning point
    with working(residual.height_bits() + 64, new):
        unit = arb(2) ** -bits
        y_series = arb_series(arb_poly(y.right_shift(turning).truncate(new)) * unit)
        growth = arb_series(arb_poly(_times(viscous, powers[motion.n_b - 1], new)) * unit).integral()
        weight = y_series * (-growth).exp()
        weighted_w = _integral(weight * arb_series(arb_poly(residual) * unit), old + turning - 1)  # w weight/Y
        e = y_series * _integral(weighted_w / (weight * y_series), old - turning)
        scale = arb(2) ** bits
        return u + [_floor(c * scale) for c in _coefficients(e, new)]


def _cut_power(r: fmpz_poly, power: int, bits: int, length: int) -> fmpz_poly:
    """Return the first coefficients of a power of r, in units of 2^-bits."""
    if power == 0:
        return fmpz_poly([1 << bits])
    if power == 1:
        return r.truncate(length)
    half = _cut_power(r, power // 2, bits, length)
    square = _cut(half * half, bits, length)
    return square if power % 2 == 0 else _cut(square * r, bits, length)


def _times(factor: Dyadic, polynomial: fmpz_poly, length: int) -> fmpz_poly:
    """Return the first coefficients of factor * polynomial, rounded down."""
    return _cut(polynomial * factor.mantissa, -factor.exponent, length)


def _cut(polynomial: fmpz_poly, bits: int, length: int) -> fmpz_poly:
    """Return the first coefficients of polynomial/2^bits, rounded down."""
    return fmpz_poly([c >> bits if bits >= 0 else c << -bits for c in polynomial.truncate(length).coeffs()])


def _integral(series: arb_series, power: int) -> arb_series:
    """Return z^-power times the integral of z^(power - 1) series."""
    coefficients = [c / (power + j) for j, c in enumerate(series.coeffs())]
    return arb_series(coefficients, series.prec)


def _coefficients(series: arb_series, length: int) -> list[arb]:
    coefficients = series.coeffs()
    return coefficients + [arb(0)] * (length - len(coefficients))


def _floor(value: arb) -> int:
    whole = value.mid().floor().unique_fmpz()
    return int(whole) if whole is not None else 0


# --- the end of a branch ----------------------------------------------------------------------------------------------


def _ends_in(piece: Piece, k: Dyadic, bits: int, motion: Motion) -> bool:
    """Whether r <= 0, or r^d <= |k| p in unloading with delayed recovery, at z = 1."""
    r = (1 << bits) - sum(piece.u)
    if r <= 0 or k.mantissa >= 0 or not motion.delayed:
        return r <= 0
    return _power(r, motion.d, bits) <= Dyadic(-k.mantissa, k.exponent).over(_twice(piece.h), sum(piece.y))


def _creeps(piece: Piece, k: Dyadic, bits: int, motion: Motion) -> bool:
    """Whether unloading is so slow that it does not reach r = 0, where the elastic force is weak: n_a >= 2 n_b.

    Damping alone stops bodies slower than p = |k| r^n_b/(2 n_b). For n_a = 2 n_b there is such an orbit, p
    proportional to r^n_b, if k^2 >= 8 n_b, and the one from the turning point lies below it.
    """
    if motion.delayed or motion.n_a < 2 * motion.n_b:
        return False
    size = abs(float(k.ball()))
    if motion.n_a == 2 * motion.n_b:
        return size * size >= 8 * motion.n_b
    r = float(fixed_point((1 << bits) - sum(piece.u), 0, bits))
    p = float(fixed_point(sum(piece.y), 0, bits) / (2 * piece.h.ball()))
    return p < 0.0 or (r < 0.5 and p < size * r**motion.n_b / (4 * motion.n_b))


def _power(r: int, power: int, bits: int) -> int:
    """Return a power of r, all in units of 2^-bits."""
    total = r
    for _ in range(power - 1):
        total = total * r >> bits
    return total


def _twice(h: Dyadic) -> Dyadic:
    return Dyadic(h.mantissa, h.exponent + 1)


def _root(piece: Piece, k: Dyadic, bits: int, motion: Motion) -> int:
    """Return z where r = (-k p)^(1/d), or 0 if nothing is delayed, by Newton's method kept within brackets."""
    one, y, d = 1 << bits, piece.y, motion.d
    curvature = [j * c for j, c in enumerate(y)][1:]
    damping = Dyadic(max(-k.mantissa, 0) if motion.delayed else 0, k.exponent)
    low, high, z = 0, one, one
    while high - low > 1:
        slope = _horner(y, z, bits)
        drag = damping.over(_twice(piece.h), slope)
        threshold = int(fmpz(drag << (d - 1) * bits).root(d)) if drag > 0 else 0
        value = one - _horner(piece.u, z, bits) - threshold
        low, high = (z, high) if value > 0 else (low, z)
        fall = slope
        if threshold:
            fall += damping.over(_twice(piece.h), _horner(curvature, z, bits)) * threshold // (d * drag)
        following = z + (value << bits) // fall if fall > 0 else low
        if abs(following - z) <= 1:
            break
        z = following if low < following < high else (low + high) // 2
    return z
