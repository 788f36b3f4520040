r"""Proof of the distance between a `flow.Branch` and the true solution (docs/theory/exact-function.md).

Put rho = p' - r^(n_a-1) - k p r^(n_b-1) for the polynomials of a branch, with r' = -2 p exactly. As a curve in the
(r, p) plane it obeys p dp/du = (r^(n_a-1) + k p r^(n_b-1) + rho)/2, and comparison with the true curve gives, as long
as the force is not attractive,

    |p^2/p_true^2 - 1| <= eta,    eta = integral of |rho|/p_true^2 du,

in loading and in unloading alike: relative errors never grow. Where unloading goes on to x = 0 against an attractive
force, it is the error of p^2 that never grows. The residual is a polynomial, computed in balls; no enclosure is
carried from step to step. "Step" is a section of the page.

Balls (`arb`) are FLINT's, a middle and a radius; `working(bits)` sets their precision within a block, and
`fixed_point(n, 0, bits)` is the ball n 2^-bits, without a radius. `abs_upper()` is the largest |number| in a ball.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from typing import NamedTuple

from flint import arb, arb_poly, fmpz_poly

from viscopade.arithmetic.balls import fixed_point, working
from viscopade.collision.flow import Branch, Dyadic, Motion, Piece

GUARD_BITS = 32  # within a piece p may grow by a factor of e^6, nine bits
# For |k| >= 2^ENERGY_FROM = 1/16 the balance of energy gives the work: it costs at most about four bits of 1 - eps, as
# k W is about 0.11 k in a difference of numbers near 1/5, and saves an integral (step 4).
ENERGY_FROM = -4
# Parts of a piece, on which the speed is shown to be positive if that does not work on the whole piece, and
# coefficients of which this is shown; the sum of the others is subtracted. Choices: no part of the proof needs their
# values.
PARTS, LEADING = 8, 100


class Ends(NamedTuple):
    """Proven enclosures at the end of a branch: p, the time and the work."""

    p: arb
    """F (loading) or m (unloading)."""
    time: arb
    """Integral of r^(m-1) ds over the branch."""
    work: arb
    """Integral of p r^(n_b-1) dr over the branch."""


def ends(branch: Branch) -> Ends:
    """Enclose p at the end, the time and the work.

    Raises
    ------
    ArithmeticError
        If the polynomials are too far from a solution for the theorem to apply.
    """
    # Where bits are many because u is of order 1/k^2 at first, so many are not needed of anything else.
    with working(branch.bits - 2 * max(branch.k.size, 0) + GUARD_BITS):
        return _ends(branch)


def _ends(branch: Branch) -> Ends:
    """Return the enclosures of `ends` for a branch, step by step as in docs/theory/exact-function.md."""
    # Step 3: the residual of each piece. Step 4: p > 0 up to the end, so that the curve is a function p(u).
    functions = [_Functions.on_piece(branch, piece) for piece in branch.pieces]
    residuals = [_residual(branch.k, f) for f in functions]
    for f in functions[:-1]:
        _require_motion(f, arb(1))
    _require_motion(functions[-1], fixed_point(branch.root, 0, branch.bits))
    # Step 10: where the force attracts, it is the error of p^2 itself that does not grow. r <= 2 limits its powers.
    if branch.k.mantissa < 0 and branch.motion.attractive:
        z = _last(branch, lambda z: bool(0 <= functions[-1].r(z) <= 2))
        eta = _absolute(branch, functions, residuals, z)
        return _completed(branch, _summed(branch, functions, z, eta, eta), functions[-1].r(z))
    # Steps 2 and 3: the sum j of the shares. The true p in place of the polynomial's costs a factor 5/4 as long as
    # eta <= 1/4; so eta <= (5/4) j <= 2 j, and it never reaches 1/4 if 2 j < 1/4.
    shares = _shares(branch, functions, residuals)
    eta = 2 * sum(shares, arb(0)).abs_upper()
    if not eta < arb(1) / 4:
        raise ArithmeticError("the residual is too large")
    # Step 4: a point just before the end, then from there to the end itself.
    z, eta_end = _before_the_end(branch, functions, residuals, shares, eta)
    return _completed(branch, _summed(branch, functions, z, eta, eta_end), functions[-1].r(z))


def _summed(branch: Branch, functions: list[_Functions], z: arb, eta: arb, eta_end: arb) -> Ends:
    """Enclose the integrals of a branch up to z in the last piece, and p there.

    `functions` belong to the pieces. `eta` bounds |p^2/p_true^2 - 1| everywhere, `eta_end` at z.
    """
    # |p/p_true - 1| <= eta as well. T is an integral of 1/p, W of p: both have at most the relative error eta. (W is 0
    # here where `_completed` takes it from the balance of energy.)
    pairs = list(zip(functions, [*(f.end for f in functions[:-1]), z], strict=True))
    uncertain = 1 + _plus_minus(eta)
    time = sum((f.time(limit) for f, limit in pairs), arb(0)) * uncertain
    work = arb(0) if branch.k.size > ENERGY_FROM else sum((f.work(limit) for f, limit in pairs), arb(0)) * uncertain
    return Ends(functions[-1].p(z) * (1 + _plus_minus(eta_end)), time, work)


class _Functions(NamedTuple):
    """R = 1 - u, Y = du/dz = 2 h p of a piece, and powers of R. If h < 0, the piece begins at z = 1."""

    r: arb_poly
    y: arb_poly
    common: arb_poly
    """S, with p' = R^common (R^elastic + k p R^viscous)."""
    elastic: arb_poly
    viscous: arb_poly
    h: arb
    """The step, s = s_0 + h z."""
    motion: Motion

    @classmethod
    def on_piece(cls, branch: Branch, piece: Piece) -> _Functions:
        """Enclose the functions of a piece of the branch."""
        # The piece's coefficients are integers in units of 2^-bits.
        u = arb_poly(fmpz_poly(piece.u)) * arb(2) ** -branch.bits
        r = 1 - u
        powers = {power: r**power for power in {*branch.motion.factors}}
        common, elastic, viscous = (powers[power] for power in branch.motion.factors)
        return cls(r, u.derivative(), common, elastic, viscous, piece.h.ball(), branch.motion)

    @property
    def start(self) -> arb:
        """The z where the piece begins in s."""
        return arb(0) if self.h > 0 else arb(1)

    @property
    def end(self) -> arb:
        return 1 - self.start

    def p(self, z: arb) -> arb:
        """Enclose p = Y/(2 h) at z."""
        return self.y(z) / (2 * self.h)

    def force(self, z: arb, k: arb) -> arb:
        """Enclose r^d - |k| p, which has the sign of the force."""
        return self.elastic(z) - abs(k) * self.p(z)

    def contraction(self, k: arb, eta: arb) -> arb:
        """Bound the factor by which an error of p^2 shrinks during a piece of unloading (k < 0)."""
        # Step 2: exp(-integral of |k| r^(n_b-1) 2 p/(p + p_true) ds), 2 p/(p + p_true) >= 1 - eta; r is least at the
        # end.
        return (k * self.h * self.r(arb(1)) ** (self.motion.n_b - 1) * (1 - eta)).exp()

    def time(self, z: arb) -> arb:
        """Enclose the integral of r^(m-1) ds from the start to z."""
        return self._integral(self.r ** (self.motion.m - 1), z) * self.h

    def work(self, z: arb) -> arb:
        """Enclose the integral of p r^(n_b-1) dr = Y^2 R^(n_b-1)/(2 h) dz from the start to z."""
        damping = self.common if self.motion.d >= 0 else self.common * self.viscous
        return self._integral(self.y * self.y * damping, z) / (2 * self.h)

    def _integral(self, polynomial: arb_poly, z: arb) -> arb:
        """Enclose the integral from the start of the piece to z."""
        antiderivative = polynomial.integral()
        return antiderivative(z) - antiderivative(self.start)


def _residual(k: Dyadic, f: _Functions) -> arb:
    """Bound |u'' - S (2 h^2 r^elastic + h k r^viscous Y)| = 2 h^2 |rho| on 0 <= z <= 1 (`flow.taylor`)."""
    # V = 2 h^2 r^elastic + h k r^viscous Y, where one of the powers of r is 1.
    drag = f.y if f.motion.d >= 0 else f.viscous * f.y
    v = f.elastic * (2 * f.h**2) + drag * (f.h * k.ball())
    # S V = S_low V_low + S_low V_high + S_high V, split at z^terms, the length of u. The high powers are small: the
    # product of two bounds is enough, and the long product S V is never computed.
    terms = f.r.length()
    low = f.common.truncate(terms)
    high = _largest(low) * _largest(v.right_shift(terms)) + _largest(f.common.right_shift(terms)) * _largest(v)
    return (_largest(f.y.derivative() - low * v.truncate(terms)) + high).abs_upper()


def _require_motion(f: _Functions, end: arb) -> None:
    """Require p > 0 up to z = end, except for the turning point, so that r falls and p is a function of u.

    p has the sign of Y = 2 h p, or of -Y where h < 0; such a piece is covered whole. This, or Y/z from the turning
    point on, is first bounded by its coefficients at z = 0. If that is not enough, it is expanded around the middle of
    each part; its higher coefficients are added up.
    """
    # ±Y, divided by z where it vanishes at z = 0. 64 bits do: only a sign is asked for.
    coefficients = (f.y if f.h > 0 else -f.y).coeffs()[1 if f.y[0] == 0 else 0 :]
    end = end if f.h > 0 else arb(1)
    with working(64):
        if falls_less_than_start(coefficients):
            return
        rest = _largest(arb_poly(coefficients[LEADING:]))
        speed = arb_poly(coefficients[:LEADING])
        if not any(_is_positive(speed, rest, end, parts) for parts in (1, PARTS)):
            raise ArithmeticError("the speed may vanish before the end")


def falls_less_than_start(coefficients: Sequence[arb]) -> bool:
    """Return whether a polynomial with these or larger coefficients is positive on 0 <= z <= 1, as far as they show."""
    # D_i = max(D_(i+1) - c_i, 0) bounds how far c_i z^i + c_(i+1) z^(i+1) + … can fall below 0, over z^i, from the last
    # coefficient down to c_1 (step 7). Then the polynomial is at least c_0 - D_1.
    start, *others = coefficients or [arb(0)]
    fall = arb(0)
    for c in reversed(others):
        fall = arb(0) if fall < c else (fall - c).abs_upper()
    return bool(start > fall)


def _is_positive(speed: arb_poly, rest: arb, end: arb, parts: int) -> bool:
    """Return whether the polynomial `speed` exceeds `rest` on 0 <= z <= end, as far as `parts` expansions show."""
    # Around the middle of each part, z = (2 i + 1) step + step t with |t| <= 1: there the constant exceeds the sum of
    # the other coefficients' absolute values.
    step = end / (2 * parts)
    expansions = (speed(arb_poly([(2 * i + 1) * step, step])) for i in range(parts))
    return all(expansion[0] > _largest(expansion - expansion[0]) + rest for expansion in expansions)


def _largest(polynomial: arb_poly) -> arb:
    """Bound |polynomial| on -1 <= z <= 1, by its value on the ball 0 ± 1: about the sum of |coefficients|."""
    return polynomial(arb(0, 1)).abs_upper()


def _shares(branch: Branch, functions: list[_Functions], residuals: list[arb]) -> list[arb]:
    """Bound what each piece adds to eta, in terms of the polynomials: steps 2 and 3 of the proof.

    In terms of the true solution it is at most 5/4 of that, as long as eta <= 1/4. `residuals` bound |R| on the pieces
    of the branch, whose `functions` these are.
    """
    unit = arb(2) ** -branch.bits
    shares = [_first_piece(branch, functions[0]) * residuals[0]]
    for f, residual, jump in zip(functions[1:], residuals[1:], branch.jumps(), strict=True):
        slope = 2 * abs(f.h) * f.p(f.start)  # |Y| where the piece begins
        # Below 100 units (a choice) a jump, of 2 units at least, adds 3 * 2/100 or more to a sum that must be below
        # 1/8.
        if not slope > 100 * unit:
            raise ArithmeticError("too few bits for the speed")
        # |rho|/p^2 du = |R|/(2 h^2) 4 h^2/Y^2 |Y| dz <= 2 |R|/|Y(start)|, as p grows. A jump d of Y, x = d/|Y|, changes
        # the relative error of p^2 by at most (5/4) (2 + x) x/(1 - x)^2 <= (5/4) 3 x for x <= 1/24; a larger one makes
        # eta too large.
        shares.append((2 * residual + 3 * jump * unit) / slope)
    return shares


def _first_piece(branch: Branch, f: _Functions) -> arb:
    """Return the factor of the residual for the piece that starts with p = 0, where eta is at most max|rho|/r^(n_a-1).

    In unloading it is twice that: at most 2.12 times (step 2), and 2.12 < 2 * 5/4, the factor that `_ends` adds.
    """
    # 2.12 = 1/0.472: while the error e <= 1/4, q = p/p_true <= sqrt(5/4), so that q/(1 + q) < 0.528 of the damping,
    # which the force exceeds, counts against it. |rho| = |R|/(2 h^2), and r >= 1 - max|u| on |z| <= 1.
    least_r = 1 - (1 - f.r)(arb(0, 1)).abs_upper()
    if not least_r > 0:
        raise ArithmeticError("the first piece is too long")
    return (2 if branch.k.mantissa < 0 else 1) / (2 * f.h**2 * least_r ** (branch.motion.n_a - 1))


def _before_the_end(
    branch: Branch, functions: list[_Functions], residuals: list[arb], shares: list[arb], eta: arb
) -> tuple[arb, arb]:
    """Return z close to the end and certainly not behind it, and the bound of eta there: step 4 of the proof.

    `functions`, `residuals` (bounds of |R|) and `shares` (what they add to eta) belong to the pieces; `eta` is for the
    whole branch.
    """
    # From piece to piece: in unloading errors decay, and at each joint the end must still lie ahead. 2: as in `_ends`.
    k = branch.k.ball()
    error = arb(0)
    for f, residual, share in zip(functions[:-1], residuals[:-1], shares[:-1], strict=True):
        if not _is_before(f, f.end, k, 2 * (error + share), residual):
            raise ArithmeticError("the end lies before the last piece")
        error = error * f.contraction(k, eta) + share if k < 0 else error + share
    error = 2 * (error + shares[-1])
    return _last(branch, lambda z: _is_before(functions[-1], z, k, error, residuals[-1])), error


def _last(branch: Branch, is_before: Callable[[arb], bool]) -> arb:
    """Return z in the last piece, close to the end and certainly not behind it, which `is_before` shows."""
    # From the approximate end back by n units of z, one for the rounding of each coefficient, then by 4 n, 16 n, … (4
    # is a choice: what p changes on the rest of the way is the square of a small number).
    one, back = 1 << branch.bits, len(branch.pieces[-1].u)
    while back < one:
        before = max(branch.root - back, 0) if branch.pieces[-1].h.mantissa > 0 else min(branch.root + back, one)
        z = fixed_point(before, 0, branch.bits)
        if is_before(z):
            return z
        back *= 4
    raise ArithmeticError("the end was not separated")


def _is_before(f: _Functions, z: arb, k: arb, eta: arb, residual: arb) -> bool:
    """Whether z is certainly not behind the end, if the start of the piece is not.

    Because r falls, r >= 0 shows this for an end at r = 0. With delayed recovery r^d - |k| p must be larger than it can
    be behind the end. `eta` bounds the error of p^2, `residual` bounds |R|.
    """
    # (5) of docs/theory/exact-function.md: r^d - |k| p >= 2 eta |k| p + 2 (|k| + 8 h) g, with g = max|R|/(2 h), which
    # bounds the integral of |rho| ds over the piece. Behind the end r^d - |k| p is at most (4/3) eta |k| (p + g) + (|k|
    # + 8 h) g: the residual can change p by g, so r by 2 g h, and r^2 by 2 g h 2 r <= 8 g h. 2 covers 4/3 and 1.
    p = f.p(z)
    if not (0 <= f.r(z) <= 2 and p > 0):
        return False
    if not (k < 0 and f.motion.delayed):
        return True
    # g; the factors 2 and 8 are those of (5).
    disturbance = residual / (2 * f.h)
    return bool(f.elastic(z) >= -k * p * (1 + 2 * eta) + 2 * (8 * f.h - k) * disturbance)


def _completed(branch: Branch, before: Ends, r: arb) -> Ends:
    """Add the piece from r, just before the end, to the end itself: step 4 of the proof.

    `before` has p of the branch at r, and the integrals up to r. Each bound below is added as an interval from 0 to it.
    """
    motion, p, k = branch.motion, before.p, abs(branch.k.ball())
    n_a, n_b, d = motion.n_a, motion.n_b, motion.d
    if branch.k.mantissa < 0 and motion.delayed:
        # With D = r^d - |k| p here, r - r_c <= D/r^(d-1), and p^2 grows by the integral of r^(n_b-1) (r^d - |k| p) dr,
        # at most r^(n_b-1) D (r - r_c).
        force = r**d - k * p
        p_end = (p * p + _up_to(r ** (n_b - 1) * force * _least(force / r ** (d - 1), r))).sqrt()
        # The end itself: r_c^d = |k| p. r - r_c <= (r^d - r_c^d)/(d r_c^(d-1)), or r. T lacks the integral of
        # r^(m-1) dr/(2 p), and W at most p_end times that of r^(n_b-1) dr.
        r_c = (k * p_end).root(d)
        rest = _least((r**d - k * p_end).abs_upper() / (d * r_c ** (d - 1)), r)  # of r
        rest_of_time, lost = r ** (motion.m - 1) * rest / (2 * p), r ** (n_b - 1) * rest
        # p^2 = (1 - r^n_a)/n_a - |k| W.
        balance = (1 - r_c**n_a) / n_a - p_end**2
    else:
        # Up to r = 0, p^2 changes by the integrals of r^(n_a-1) dr and k p r^(n_b-1) dr, at most r^n_a/n_a + k p_1
        # r^n_b/n_b with the largest p_1 on the way. Take twice that with p_1 = 2 p: it is below p^2/2, so p does not
        # double.
        growth, drag = 2 * r**n_a / n_a, 4 * k * p * r**n_b / n_b
        if not 2 * (growth + drag) < p * p:
            raise ArithmeticError("the end was not reached")
        # Damping slows the bodies in unloading; in loading, which is followed backwards, it adds to the speed.
        change = _up_to(growth) - _up_to(drag) if branch.k.mantissa < 0 else _up_to(growth + drag)
        p_end = (p * p + change).sqrt()
        # T lacks the integral of r^(m-1) dr/(2 p), below r^m/p as p does not fall to a half; W less than 2 p_end r^n_b.
        rest_of_time, lost = r**motion.m / p, 2 * r**n_b
        # p^2 = 1/n_a + k W in loading, and 1/n_a - |k| W in unloading.
        balance = abs(p_end**2 - arb(1) / n_a)
    # The balance of energy gives W for |k| >= 1/16 (`ENERGY_FROM`), the integral for smaller k.
    work = balance / k if branch.k.size > ENERGY_FROM else before.work + _up_to(p_end * lost)
    return Ends(p_end, before.time + _up_to(rest_of_time), work)


def _least(bound: arb, r: arb) -> arb:
    """Return the smaller of two bounds of the missing part of r; `bound` is infinite if r may be 0."""
    return bound.abs_upper().min(r.abs_upper()) if bound.is_finite() else r.abs_upper()


def _absolute(branch: Branch, functions: list[_Functions], residuals: list[arb], z: arb) -> arb:
    """Bound the relative error of p^2 in unloading up to z in the last of the pieces, also where the force attracts.

    d(p^2 - p_true^2)/du has the sign that makes the difference smaller, except for the residual: the difference at any
    u is at most the integral of |rho| du so far, plus the jump of p^2 at every joint (step 10). `functions` and
    `residuals`, bounds of |R|, belong to the pieces.
    """
    unit = arb(2) ** -branch.bits
    error, least_square = arb(0), arb(1)
    for i, (f, residual, jump_of_y) in enumerate(zip(functions, residuals, [0, *branch.jumps()], strict=True)):
        # With p = Y/(2 h): a jump d of Y behind which Y = Y_0 changes p^2 by at most (2 Y_0 + d) d/(4 h^2). The
        # integral of |rho| du is at most |R|/(2 h^2) times the change of u. The first piece has no joint before it.
        square = 4 * f.h**2
        jump = (2 * f.y[0] + jump_of_y * unit) * jump_of_y * unit / square
        change_of_u = f.r(arb(0)) - (f.r(z) if f is functions[-1] else f.r(arb(1)))  # r falls
        error += 2 * residual / square * change_of_u.abs_upper() + jump
        if i:
            # p rises, then falls: it is least at a joint or at the end.
            least_square = least_square.min(f.p(arb(0)).lower() ** 2)
    least_square = least_square.min(functions[-1].p(z).lower() ** 2)
    # Relative to the least p^2. The true p^2 is smaller by at most `error`: 1/(1 - 1/8) < 2, so 2 eta bounds the error
    # relative to it. In the first piece step 2 gives 2 first, as long as that is below 1/4.
    eta = (error / least_square).abs_upper()
    k, start = branch.k.ball(), functions[0]
    first = _first_piece(branch, start) * residuals[0]
    if not (eta < arb(1) / 8 and first < arb(1) / 8):
        raise ArithmeticError("the residual is too large")
    # The bound of the first piece holds where the force does not attract. 4 first bounds the relative error of p there
    # with room to spare (that of p^2 is at most 2 first).
    if not start.force(arb(1), k) > 4 * first * abs(k) * start.p(arb(1)):
        raise ArithmeticError("the force is attractive in the first piece")
    return (2 * eta).max(2 * first)


def _plus_minus(bound: arb) -> arb:
    """Return the ball 0 ± bound."""
    return arb(0, bound.abs_upper())


def _up_to(bound: arb) -> arb:
    """Return the interval from 0 to bound, which is not negative."""
    half = bound.abs_upper() / 2
    return arb(half.mid(), half.abs_upper())
