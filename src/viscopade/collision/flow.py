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

Balls (`arb`) are FLINT's, a middle and a radius; `working(bits)` sets their precision within a block,
`working(bits, terms)` also the length of power series. `fixed_point(n, 0, bits)` is n 2^-bits, without a radius.
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

# None of these numbers is part of a proof: `validation` bounds the error of whatever polynomials stand here. A bad
# value costs time, or an enclosure that is too wide and a second attempt with more bits. "Measured" is for six k from
# 2^-40 to 1e5, both halves, 60 to 700 bits.

# Coefficients a piece has for each bit: j terms give b bits at 2^(-b/j) = 2^-2 of the radius of convergence. Measured:
# 0.3 to 0.7 take the same time (0.7 a third more at 700 bits), 1.0 twice as long.
TERMS_PER_BIT = 0.5
# Up to so many, over the square of the bits, Taylor coefficients one by one are faster than Newton's iteration: 494 of
# 900 bits, 100 of 2000.
NEWTON_FROM = 400_000_000
# Of `Motion.radius`, 1.018 for n_a = 5: the step is 0.23, a quarter of the distance 0.911 of the nearest singularity,
# as `TERMS_PER_BIT` needs. Measured: 0.15 needs 15 per cent more pieces, and 0.35 is shortened to nearly the same ones.
LONGEST_FIRST_STEP = 0.2258
STEP_AT_CONTACT = 0.16  # of a first step from first contact, times the speed there: r goes to about a third
MAX_PIECES = 20_000  # so that a branch without an end is an error; one of the paper's law has about seven pieces
MAX_SLOW_PIECES = 4_000  # of unloading to x = 0 close below the damping that holds the bodies back
# Largest k^2/(2 n_b - n_a) of unloading to x = 0 for nu < 2: the number of pieces grows like that, to about 4000 here.
STRONGEST_DAMPING = 25_000
# Largest |h k|: p grows like exp(h k), and is zero again at |h k| = 2 pi, which Newton's iteration must avoid.
LARGEST_GROWTH = 6.0
# Excess of the last coefficients over the accuracy, in bits, that is tolerated. Measured: the proven accuracy of p is
# from 4 bits below the one asked for up; with 8 from 6 bits below, with 16 from 14 bits below, and a few pieces fewer.
SPARE_BITS = 4
# By which new steps aim at a higher accuracy, so that few must be shortened. Measured: 1 to 8 take the same time; with
# 0 a step that is shortened may never be short enough.
AIM_BITS = 3


class NoEndError(ArithmeticError):
    """Contact does not end: damping holds the bodies back, and they do not reach x = 0, or too slowly."""


class Motion(NamedTuple):
    """The parameters of a law of contact x'' + x^a + kappa x^b x' = 0 in the flow."""

    n_a: int
    """m (a + 1): the elastic energy is proportional to r^n_a."""
    n_b: int
    """m (b + 1): damping is proportional to r^(n_b-1) dr."""
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
        # From p' = r^(n_a-1) + k p r^(n_b-1), with d = n_a - n_b; one of the last two is 0.
        return min(self.n_a, self.n_b) - 1, max(self.d, 0), max(-self.d, 0)

    @property
    def radius(self) -> float:
        """Distance of a singularity of u(s) from the turning point at k = 0, at most 4; others are hardly nearer.

        On the imaginary axis r is infinite at B(1/2 - 1/n_a, 1/2)/(2 sqrt(n_a)), as p^2 = (1 - r^n_a)/n_a.
        """
        # For n_a = 2 (a sine) or 1 (a parabola) u has no singularity; 4 keeps the first step below one unit of time.
        if self.n_a <= 2:
            return 4.0
        # B(gap, 1/2)/(2 sqrt(n_a)) with B(gap, 1/2) = Gamma(gap) sqrt(pi)/Gamma(gap + 1/2).
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
        """The least n with |value| < 2^n; for 0 a number below the exponent of any other."""
        return self.mantissa.bit_length() + self.exponent if self.mantissa else -(10**9)

    def ball(self) -> arb:
        """Return the number as an exact ball."""
        return arb(self.mantissa) * arb(2) ** self.exponent

    def product(self, other: Dyadic) -> Dyadic:
        """Return the exact product."""
        return Dyadic(self.mantissa * other.mantissa, self.exponent + other.exponent)

    def times(self, number: int) -> int:
        """Return value * number, rounded down to an integer."""
        return shifted(self.mantissa * number, self.exponent)

    def over(self, divisor: Dyadic, number: int) -> int:
        """Return value * number / divisor, less than two units too small or too large."""
        # Two roundings down, each by less than a unit: the shift, whose error the division does not enlarge, as
        # |mantissa| >= 1, and the quotient.
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
        """Refuse a branch to which the proof does not apply (docs/theory/exact-function.md, step 3)."""
        # It starts at the turning point, u = p = 0, and there forwards in s. Only loading may be read backwards: it is
        # then unloading in time. The end is looked for in the last piece, and u has no jump, not even by rounding.
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
        # du/dz = 2 h p: the value before the joint is scaled to the step behind it, h_after/h_before.
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
        # Newton's method needs half of the bits of its result. Those that hold u ~ 1/k^2 are not needed for q; 32 more
        # are for rounding in up to a few hundred terms.
        bits = (self.bits - 2 * max(self.k.size, 0)) // 2 + 32
        q = arb(0)
        for piece in self.pieces:
            with working(bits, len(piece.u) // 2 + 8):  # terms of a series, as in `_half`
                # Variation of constants, from z = 0 where q is known: with p = Y/(2 h) and ds = h dz,
                # q(z) = e^E(z) (q + integral of e^-E r^(n_b-1) Y^2/(4 h) dz), E = integral of h k r^(n_b-1) dz.
                y, r = self._half(piece.y), 1 - self._half(piece.u)
                damping, h = r ** (self.motion.n_b - 1), piece.h.ball()
                growth = (h * self.k.ball() * damping.integral()).exp()
                q_series = growth * (q + (damping * y * y / growth).integral() / (4 * h))
                end = arb(1) if piece is not self.pieces[-1] else fixed_point(self.root, 0, self.bits)
                q = _value(q_series, end).mid()
        with working(bits):
            # d ln p/d ln k = (k/p) (q/p).
            return self.k.ball() * q / self.p_end**2

    def work(self) -> arb:
        """Return the integral of p r^(n_b-1) dr over a branch of `integrate`, without a proof."""
        work, unit = arb(0), arb(2) ** -self.bits
        # Bits as in `sensitivity`: those that hold u ~ 1/k^2 are not needed, 32 are for rounding.
        with working(self.bits - 2 * max(self.k.size, 0) + 32, len(self.pieces[0].u)):
            for piece in self.pieces:
                # p |dr| = p du = (Y/(2 h)) Y dz, up to the end in the last piece.
                y, r = arb_series([c * unit for c in piece.y]), 1 - arb_series([c * unit for c in piece.u])
                end = arb(1) if piece is not self.pieces[-1] else fixed_point(self.root, 0, self.bits)
                work += (_value((y * y * r ** (self.motion.n_b - 1)).integral(), end) / (2 * piece.h.ball())).mid()
        return work

    def _half(self, coefficients: list[int]) -> arb_series:
        """Return half of the terms of a piece's coefficients as a series; they have half of the accuracy."""
        unit = arb(2) ** -self.bits
        length = len(self.pieces[0].u) // 2 + 8  # 8: a margin, by hand; Newton's next step corrects what is cut
        return arb_series([c * unit for c in coefficients[:length]], length)


def _value(series: arb_series, z: arb) -> arb:
    """Return the value of a series' polynomial at z, by Horner's rule."""
    total = arb(0)
    for c in reversed(series.coeffs()):
        total = total * z + c
    return total


def _horner(coefficients: Sequence[int | fmpz], z: int, bits: int) -> int:
    """Return the polynomial with these coefficients at 0 <= z <= 1, at most one unit a coefficient too small.

    Coefficients, z and the result are integers in units of 2^-bits.
    """
    if z == 1 << bits:  # z = 1, where the sum is exact
        return int(sum(coefficients))
    total = 0
    for c in reversed(coefficients):
        total = (total * z >> bits) + int(c)
    return total


# --- integration ------------------------------------------------------------------------------------------------------


def integrate(k: Dyadic, accuracy: int, motion: Motion = HERTZ) -> Branch:
    """Return the branch from the turning point to the end of loading (k >= 0) or of unloading (k < 0).

    `accuracy` is roughly the relative accuracy of p at the end in bits; `validation.ends` proves it. In unloading
    r^d - |k| p, whose zero is the end, has about the same accuracy, although it is of order 1/k^2 long before.
    `motion` has the exponents of the law.

    Raises
    ------
    NoEndError
        If the end is at r = 0, and unloading does not reach it, or too slowly.
    """
    # Unloading to r = 0 against strong damping creeps, r^d = |k| p. For nu < 2, that is q = 2 n_b - n_a > 0, it does
    # end, after a number of pieces that grows like k^2/q (step 10).
    q = 2 * motion.n_b - motion.n_a
    if k.mantissa < 0 and not motion.delayed and q > 0 and k.ball() ** 2 > STRONGEST_DAMPING * q:
        raise NoEndError("x = 0 is reached too slowly")

    # Append pieces until the last one contains the end: `steps` chooses their lengths.
    steps = _steps(k, accuracy, motion)
    bits, pieces = steps.bits, [steps.piece(0, 0, steps.first())]
    while not _ends_in(pieces[-1], k, bits, motion):
        # For nu >= 2 unloading may never reach r = 0: that shows in many pieces, in p <= 0, or by `_creeps`.
        stopped = len(pieces) == MAX_SLOW_PIECES or sum(pieces[-1].y) <= 0  # p > 0 is lost in its errors
        slow = k.mantissa < 0 and not motion.delayed and stopped
        if slow or (k.mantissa < 0 and _creeps(pieces[-1], k, bits, motion)):
            raise NoEndError("x = 0 is not reached")
        if len(pieces) == MAX_PIECES:
            raise ArithmeticError("the end of the collision was not found")
        pieces.append(steps.next(pieces[-1]))
    return Branch(k, bits, tuple(pieces), _root(pieces[-1], k, bits, motion), motion)


def collide(k: Dyadic, speed: Dyadic, accuracy: int) -> tuple[Branch, Branch]:
    """Return loading and unloading of the paper's law, integrated in time from first contact to the end of contact.

    Units belong to a length X close to x_max: k = 2 kappa X^(1/4), and contact begins with r = 0 and
    p = -speed = -1/(2 X^(5/4)), since p < 0 while the bodies approach. Let r = r_t at the turning point. In units of
    x_max, r, k and s are then r/r_t, k r_t^(1/2) and s r_t^(3/2). Loading is unloading backwards in time. `accuracy`
    is that of p in bits, as for `integrate`.
    """
    # Follow the bodies in time, as unloading (-k), from u = 1 - r = 1 and p = -speed until p is positive again. With
    # h = STEP_AT_CONTACT/speed the first piece is u = 1 - 2 * 0.16 z + …, as du/dz = 2 h p; for a step of 1/2 it is p.
    steps = _steps(Dyadic(-k.mantissa, k.exponent), accuracy, HERTZ)
    one, size = 1 << steps.bits, speed.size
    h = _step(STEP_AT_CONTACT / ldexp(float(speed.ball()), -size), -size)
    pieces = [steps.piece(one, -speed.times(one), h, Dyadic(1, -1))]
    # Newton's iteration in `taylor` divides by Y^2: in the last piece it loses bits, but only behind the turning point.
    while sum(pieces[-1].y) < 0 and len(pieces) < MAX_PIECES:
        pieces.append(steps.next(pieces[-1]))
    with working(steps.bits + 32):  # 32 bits for rounding: the pieces' own errors are larger, and all is proven later
        # The turning point gives this collision's k, and so unloading.
        turning = _turning(pieces[-1])
        r_t = 1 - _poly(pieces[-1].u, steps.bits)(turning).mid()
        stretch = r_t * r_t.sqrt()
        k = Dyadic.nearest(k.ball() * r_t.sqrt(), accuracy + 32)  # 32: so that rounding is not the largest error of k
        unloading = integrate(Dyadic(-k.mantissa, k.exponent), accuracy)

        # Its first piece, with s and the odd coefficients reversed, reaches back to before the turning point. Cut the
        # pieces from first contact off there: z is the place of its end in the last of them, or in one before.
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
    """Return z in a piece where Y = 2 h p = 0, the turning point, by Newton's method. To be called within `working`."""
    # From the secant through both ends, each step doubles the right bits; the first two may only bring it near.
    y = _poly(piece.y, 0)
    slope, z = y.derivative(), y[0] / (y[0] - y(arb(1)))
    for _ in range(ctx.prec.bit_length() + 2):
        z = (z - y(z) / slope(z)).mid()
    return z


def _poly(coefficients: list[int], bits: int) -> arb_poly:
    """Return a polynomial from its coefficients in units of 2^-bits."""
    return arb_poly(fmpz_poly(coefficients)) * arb(2) ** -bits


def _steps(k: Dyadic, accuracy: int, motion: Motion) -> _Steps:
    """Return the choice of steps for a branch of k and `motion` with `accuracy` bits: number of terms, unit 2^-bits."""
    size = max(k.size, 0)  # |k| < 2^size
    # The end of unloading needs r^d - |k| p, of which large k loses more. Measured: these bits make the proven p at the
    # end 5 to 11 bits better for k from 30 to 1e5; `size` instead of 10 gains 8 at most.
    if k.mantissa < 0:
        accuracy += min(size, 10)
    # 10 more terms: short polynomials are worse than `TERMS_PER_BIT` says. Measured at 60 bits: without them two thirds
    # more pieces; 30 more save a fifth of the pieces and no time.
    terms = int(TERMS_PER_BIT * accuracy) + 10
    # u begins with 1/k^2, that is 2 size bits, and in unloading r^d - |k| p is of that order, too. A coefficient is a
    # sum of up to `terms` products of rounded numbers, and du/dz multiplies it by its index: about terms^2 units of
    # error. 8 bits are spare.
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
        # k in units of 2^size, so that no float overflows.
        size = max(self.k.size, 0)
        k_scaled = ldexp(abs(self.k.mantissa) / (1 << self.k.mantissa.bit_length()), self.k.size - size)
        # Largest |h k| for large k: (h k)^terms/terms! = 2^-accuracy.
        longest = exp((lgamma(self.terms + 1) - self.accuracy * log(2)) / self.terms)
        longest = min(longest, LARGEST_GROWTH)
        # 1/h = 1/(largest h at k = 0) + |k|/(largest |h k|) is below either limit.
        longest_at_0 = LONGEST_FIRST_STEP * self.motion.radius
        return _step(1 / (ldexp(1 / longest_at_0, -size) + k_scaled / longest), -size)

    def next(self, last: Piece) -> Piece:
        """Return the piece after `last`."""
        # The new step is the last one times `longer`: by what the last coefficients allow, at most twice as long
        # (measured: 1.2 to 8 give the same pieces), and with |h k| r^(n_b-1) up to its limit. 1e-9 stands for k = 0.
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
        """Return the piece from u = start, du/dz = slope (for a step of slope_step), shortened as far as needed.

        `start` and `slope` are in units of 2^-bits, `h` is the step. Without `slope_step` it starts with p = 0.
        """
        # du/dz = 2 h p is proportional to the step.
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
        """Return by how many bits the last coefficients of a piece are smaller than they need to be."""
        # The last four, because one may vanish by chance: measured, with the last alone p has up to 9 bits less than
        # asked for. 1 unit, because log2(0) is not a number.
        largest = max(abs(c) for c in piece.u[-4:]) + 1
        # What is cut off of u'' is about terms^2 times the last coefficient.
        needed = self.accuracy + 2 * _log2(self.terms) - SPARE_BITS + self.force_bits(piece)
        # Errors count relative to Y = 2 h p, which at the turning point begins with u_2 z; where they are absolute, to
        # the size that Y has at p = 1/16, 2 h/16.
        size = max(abs(piece.u[1]), piece.u[2])
        if self.absolute:
            size = max(size, piece.h.times(1 << self.bits) >> 3)
        return _log2(size) - needed - _log2(largest)

    def force_bits(self, piece: Piece) -> float:
        """Return how many bits more than p must be known in order to know r^d - |k| p, at the end of the piece."""
        # Only where unloading ends with the force, and damping can be large; not on the way in from first contact.
        if self.k.mantissa >= 0 or self.k.size <= 0 or not self.motion.delayed or piece.u[1] < 0:
            return 0.0
        # Bits that cancel in r^d - |k| p, |k| p = |k| Y/(2 h), at the start of the piece. On the piece the difference
        # falls by at most e^-LARGEST_GROWTH: measured, without this p has 4 to 8 bits less for k >= 30.
        r = (1 << self.bits) - piece.u[0]
        damping = Dyadic(-self.k.mantissa, self.k.exponent).over(_twice(piece.h), piece.u[1])
        lost = self.bits - _log2(max(_power(r, self.motion.d, self.bits) - damping, 1)) + LARGEST_GROWTH / log(2)
        # The difference is of order 1/k^2 at the end, and not smaller before; 4 bits for the factor (0 do as well).
        return min(lost, 2.0 * self.k.size + 4)

    def stretch(self, spare_bits: float) -> float:
        """Return the factor by which a step can be longer that has so many bits to spare."""
        # The last coefficient grows like the step to the power terms - 1.
        return float(2.0 ** (spare_bits / (self.terms - 1)))


def _compressed(u: list[int], ratio: int, bits: int) -> list[int]:
    """Return the coefficients of u(ratio z), the ratio in units of 2^-bits."""
    power, compressed = 1 << bits, list[int]()
    for c in u:  # power is ratio^j
        compressed.append(c * power >> bits)
        power = power * ratio >> bits
    return compressed


def _log2(number: int) -> float:
    """Return log2 of a positive integer of any size, from its first 64 bits."""
    size = number.bit_length()
    return size + log((number << 64 >> size) / 2.0**64) / log(2)


def _step(value: float, exponent: int) -> Dyadic:
    """Return value 2^exponent with a mantissa of about 20 bits: products with a short step are cheap."""
    return Dyadic(round(ldexp(value, 20)), exponent - 20)


def _scaled(h: Dyadic, factor: float) -> Dyadic:
    """Return about factor * h, with a short mantissa."""
    size = h.mantissa.bit_length()
    return _step(factor * h.mantissa / 2.0**size, h.exponent + size)


def taylor(start: int, slope: int, h: Dyadic, k: Dyadic, bits: int, terms: int, motion: Motion = HERTZ) -> list[int]:
    """Return the first `terms` Taylor coefficients of u(z), u(0) = start, u'(0) = slope, in units of 2^-bits.

    With r = 1 - u, S = r^common and Y = u' the flow is u'' = S V, V = 2 h^2 r^elastic + h k r^viscous Y
    (`Motion.factors`), over a step h of s; `motion` has the powers of the law.
    """
    # The first coefficients one by one, then steps of Newton's iteration, which doubles the right coefficients: each
    # begins with a few more than half (5 is a margin, because the turning point costs some; 16 are a few to start
    # from).
    lengths = [terms]
    while lengths[-1] > max(NEWTON_FROM // bits**2, 16):
        lengths.append((lengths[-1] + 5) // 2)
    constants = Dyadic(2, 0).product(h).product(h), h.product(k)  # 2 h^2 and h k, exactly
    u = Recursion(start, slope, *constants, motion.factors, bits).coefficients(lengths.pop())
    while lengths:
        u = _doubled(u, *constants, bits, lengths.pop(), motion)
    return u


def _doubled(u: list[int], elastic: Dyadic, viscous: Dyadic, bits: int, terms: int, motion: Motion) -> list[int]:
    """Return `terms` coefficients of u, from fewer (but more than half) by one step of Newton's iteration.

    `elastic` is 2 h^2, `viscous` h k, `motion` has the powers of r; coefficients are in units of 2^-bits.

    The correction e solves the linearised flow. With Y = u', which solves it too, w = Y e' - Y' e obeys
    w' = h k r^(n_b-1) w + Y (u'' - S V), and e = Y integral of w/Y^2. The weight is Y exp(-integral of h k r^(n_b-1)).
    """
    # The residual S V - u'' of the polynomial u. Below z^(old - 2) it is 0, and from there on u'' has no coefficients.
    old, new, length = len(u), terms - len(u), terms - 2
    r, y = (1 << bits) - fmpz_poly(u), fmpz_poly(u).derivative()
    powers = {power: _cut_power(r, power, bits, length) for power in {*motion.factors, motion.n_b - 1}}
    s, spring, drag = (powers[power] for power in motion.factors)
    damping = y if motion.d >= 0 else _cut(drag * y, bits, length)
    v = _times(elastic, spring, length) + _times(viscous, damping, length)
    residual = _cut(s * v, bits, length).right_shift(old - 2)
    turning = 1 if u[1] == 0 else 0  # Y has a factor z at the turning point
    # The correction is as short as the residual: its bits, and 64 for rounding (a choice; it costs little).
    with working(residual.height_bits() + 64, new):
        # e = Y integral of (1/(weight Y)) integral of weight * residual. Powers of z are kept apart: the first integral
        # begins with z^(old - 1 + turning), the second with z^(old - turning).
        unit = arb(2) ** -bits
        y_series = arb_series(arb_poly(y.right_shift(turning).truncate(new)) * unit)
        growth = arb_series(arb_poly(_times(viscous, powers[motion.n_b - 1], new)) * unit).integral()
        weight = y_series * (-growth).exp()
        weighted_w = _integral(weight * arb_series(arb_poly(residual) * unit), old + turning - 1)  # w weight/Y
        e = y_series * _integral(weighted_w / (weight * y_series), old - turning)
        scale, corrections = arb(2) ** bits, e.coeffs()
        corrections += [arb(0)] * (new - len(corrections))  # FLINT leaves out zeros at the end
        return u + [_floor(c * scale) for c in corrections]


def _cut_power(r: fmpz_poly, power: int, bits: int, length: int) -> fmpz_poly:
    """Return the first `length` coefficients of a power of r, in units of 2^-bits."""
    # By repeated squaring, r^(2 n + 1) = (r^n)^2 r, each product cut and rounded down.
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


def _floor(value: arb) -> int:
    """Return the middle of a ball rounded down, or 0 if the ball is infinite."""
    whole = value.mid().floor().unique_fmpz()
    return int(whole) if whole is not None else 0


# --- the end of a branch ----------------------------------------------------------------------------------------------


def _ends_in(piece: Piece, k: Dyadic, bits: int, motion: Motion) -> bool:
    """Whether r <= 0, or r^d <= |k| p in unloading with delayed recovery, at z = 1."""
    r = (1 << bits) - sum(piece.u)  # r = 1 - u at z = 1, in units of 2^-bits
    if r <= 0 or k.mantissa >= 0 or not motion.delayed:
        return r <= 0
    # |k| p = |k| Y/(2 h).
    return _power(r, motion.d, bits) <= Dyadic(-k.mantissa, k.exponent).over(_twice(piece.h), sum(piece.y))


def _creeps(piece: Piece, k: Dyadic, bits: int, motion: Motion) -> bool:
    """Whether unloading, at the end of a piece, is so slow that it does not reach r = 0; only for n_a >= 2 n_b.

    There the elastic force is weak near r = 0. The piece's coefficients are in units of 2^-bits.

    Damping alone stops bodies slower than p = |k| r^n_b/(2 n_b). For n_a = 2 n_b there is such an orbit, p
    proportional to r^n_b, if k^2 >= 8 n_b, and the one from the turning point lies below it.
    """
    if motion.delayed or motion.n_a < 2 * motion.n_b:
        return False
    k_size = abs(float(k.ball()))
    # n_a = 2 n_b: p = c r^n_b solves p dp/dr = -(r^(n_a-1) - |k| p r^(n_b-1))/2 if 2 n_b c^2 - |k| c + 1 = 0, which has
    # a real c if k^2 >= 8 n_b.
    if motion.n_a == 2 * motion.n_b:
        return k_size * k_size >= 8 * motion.n_b
    # n_a > 2 n_b: half of the p that damping alone stops. Near r = 0 the elastic force is weaker than damping by
    # r^(n_a - 2 n_b), so that it cannot make up for the other half: r < 1/2 stands for "near" (a choice).
    r = float(fixed_point((1 << bits) - sum(piece.u), 0, bits))
    p = float(fixed_point(sum(piece.y), 0, bits) / (2 * piece.h.ball()))
    return p < 0.0 or (r < 0.5 and p < k_size * r**motion.n_b / (4 * motion.n_b))


def _power(r: int, power: int, bits: int) -> int:
    """Return a power >= 1 of r, all in units of 2^-bits."""
    product = r
    for _ in range(power - 1):
        product = product * r >> bits
    return product


def _twice(h: Dyadic) -> Dyadic:
    """Return 2 h."""
    return Dyadic(h.mantissa, h.exponent + 1)


def _root(piece: Piece, k: Dyadic, bits: int, motion: Motion) -> int:
    """Return z in the last piece where r = (-k p)^(1/d), or r = 0 if nothing is delayed, in units of 2^-bits.

    `motion` has the exponents; d = n_a - n_b. Newton's method, kept within brackets; no proof needs its accuracy
    (`validation` moves away from the end).
    """
    one, y, d = 1 << bits, piece.y, motion.d
    curvature = [j * c for j, c in enumerate(y)][1:]
    damping = Dyadic(max(-k.mantissa, 0) if motion.delayed else 0, k.exponent)
    low, high, z = 0, one, one
    while high - low > 1:
        # f(z) = r - (|k| p)^(1/d), with |k| p = |k| Y/(2 h) = drag; it falls with z.
        slope = _horner(y, z, bits)
        drag = damping.over(_twice(piece.h), slope)
        threshold = int(fmpz(drag << (d - 1) * bits).root(d)) if drag > 0 else 0
        value = one - _horner(piece.u, z, bits) - threshold
        low, high = (z, high) if value > 0 else (low, z)
        # -f' = Y + (|k| p)^(1/d) (|k| p)'/(d |k| p).
        fall = slope
        if threshold:
            fall += damping.over(_twice(piece.h), _horner(curvature, z, bits)) * threshold // (d * drag)
        newton = z + (value << bits) // fall if fall > 0 else low
        if abs(newton - z) <= 1:  # a unit: nothing smaller can be represented
            break
        z = newton if low < newton < high else (low + high) // 2
    return z
