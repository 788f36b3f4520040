r"""Collisions of a whole interval of v*: branches of `flow` whose coefficients are polynomials in z, |z| <= 1.

For k = k(z) > 0, a polynomial, and a scale of time c(z) > 0, another, one piece is

    u(y; z) = sum_j u_j(z) y^j,    0 <= y <= 1,    s = s_0 + H c(z) y,
    u_yy = S (2 H^2 c^2 S + H c k u_y),    S = r^2,    r = 1 - u,

exactly as in `flow` for every single z of the paper's law, with the step h = H c(z). So the theorem of `validation`
holds for every z; here its quantities are bounded for all z at once, by the sum of the absolute values of a
polynomial's coefficients (docs/theory/exact-function.md, step 7). How the polynomials were found is again of no
importance.

`working(bits)` sets the precision of FLINT's balls within a block, `working(bits, terms)` also the length of power
series. A `FunctionBall` is a polynomial in z with integer coefficients and a bound `error` of the norm of the rest, and
`norm` is the sum of |coefficients|.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass
from itertools import chain, pairwise
from typing import NamedTuple

from flint import arb, arb_poly, arb_series, fmpq, fmpq_mat, fmpz, fmpz_poly

from viscopade.arithmetic.balls import coefficient_sum, fixed_point, working
from viscopade.arithmetic.function_balls import FunctionBall, Wiener, norm, shifted_up
from viscopade.collision.flow import Dyadic, integrate
from viscopade.collision.validation import falls_less_than_start

# Choices: no proof needs their values. Bad ones make the residual too large, and the proof is refused.
SCALE_BITS = 30  # of the coefficients of c(z), which only has to follow the time until the end roughly
# Points through which c(z) goes. Measured on four panels: 3 are as good; with 1, a constant, the proof fails for large
# v*, and with 9 the bounds are larger.
SCALE_NODES = 5
END_IN_LAST = 0.7  # where in the last piece the end lies: there is room to either side for c(z)'s error
# Powers of z that a residual takes into account beyond those of the polynomials; others are bounded. Measured: 0 to 12
# give the same bounds, as `END_IN_LAST` from 0.5 to 0.9 does.
CUT_BEHIND = 4
ROUGH = 40  # bits of the times that only lay out the pieces
PARTS = 8  # of a piece, on which the speed is shown to be positive; measured: 1 is not enough for large v*
# Coefficients of a piece, compared with those of a single branch: steps are a little longer. Measured: from 1.0 to 1.6
# the bounds are the same, and the time doubles.
SPARE_TERMS = 1.3


class Scaled(NamedTuple):
    """A scaled polynomial 2^exponent sum_i c_i z^i with integer coefficients."""

    polynomial: fmpz_poly
    exponent: int

    @classmethod
    def nearest(cls, series: arb_series, bits: int) -> Scaled:
        """Round a series' coefficients to integers in a unit that gives the first that is not 0 `bits` bits."""
        # A number is mantissa 2^power: its first bit is that of 2^(bit length + power - 1).
        middles = [c.mid() for c in series.coeffs()]
        first = next(c for c in middles if not c.is_zero())
        mantissa, power = (int(part) for part in first.man_exp())
        exponent = mantissa.bit_length() + power - bits
        with working(2 * bits):  # so that the products are exact up to the rounding to integers
            return cls(fmpz_poly([_integer(c * arb(2) ** -exponent) for c in middles]), exponent)

    def poly(self) -> arb_poly:
        """Return the polynomial, exactly if FLINT's precision holds it."""
        return arb_poly(self.polynomial) * arb(2) ** self.exponent

    def value(self, z: fmpq | int) -> Dyadic:
        """Return the value at z to 64 bits, enough to lay out pieces."""
        with working(128):
            return Dyadic.nearest(self.poly()(arb(z)), 64)

    def least(self) -> arb:
        """Return a lower bound for |z| <= 1."""
        return least(self.polynomial) * arb(2) ** self.exponent

    def most(self) -> arb:
        """Return an upper bound of the absolute value for |z| <= 1."""
        return arb(norm(self.polynomial.coeffs())) * arb(2) ** self.exponent


def least(polynomial: fmpz_poly) -> arb:
    """Return a lower bound of a polynomial for |z| <= 1: c_0 - sum of |c_i|, i >= 1."""
    # norm is the sum of all |c_i|; for c_0 < 0 this is lower still.
    return arb(2 * int(polynomial[0]) - norm(polynomial.coeffs()))


def _integer(value: arb) -> int:
    """Return the integer nearest to the middle of a ball, or 0 if the ball is infinite."""
    whole = (value + arb(1) / 2).mid().floor().unique_fmpz()
    return int(whole) if whole is not None else 0


class ParametricPiece(NamedTuple):
    """Taylor polynomial in y with coefficients u_j(z), in units of 2^-bits, over a step H."""

    u: list[fmpz_poly]
    step: Dyadic

    @property
    def y(self) -> list[fmpz_poly]:
        """Coefficients of u_y = 2 H c p."""
        return [j * c for j, c in enumerate(self.u)][1:]


@dataclass(frozen=True)
class ParametricBranch:
    """Family of branches, loading or unloading, from the turning point to close before the end, for all |z| <= 1.

    Attributes
    ----------
    k, scale : Scaled
        k(z) > 0, also for unloading, and c(z) > 0.
    unloading : bool
    bits, degree : int
        Coefficients are in units of 2^-bits, and polynomials in z are cut behind z^degree.
    pieces : tuple of ParametricPiece
        At the joints u is continuous, exactly.
    end : fmpz_poly
        y close to the end in the last piece, in units of 2^-bits.
    """

    k: Scaled
    scale: Scaled
    unloading: bool
    bits: int
    degree: int
    pieces: tuple[ParametricPiece, ...]
    end: fmpz_poly

    def __post_init__(self) -> None:
        """Refuse a branch to which the proof does not apply: as for `flow.Branch`, for every z."""
        # It starts with u = p = 0, goes forwards in s, and u is continuous: the sum of the coefficients is u at y = 1.
        if any(c != 0 for c in chain(*(p.coeffs() for p in self.pieces[0].u[:2]))):
            raise ValueError("a branch starts with u = p = 0")
        if any(piece.step.mantissa <= 0 for piece in self.pieces):
            raise ValueError("steps must be positive")
        for before, after in pairwise(self.pieces):
            if sum(before.u, fmpz_poly()) != after.u[0]:
                raise ValueError("u is not continuous")

    def at_end(self) -> tuple[FunctionBall, FunctionBall]:
        """Enclose r = 1 - u and u_y of the last piece's polynomial at y = end(z), in units of 2^-bits."""
        # Functions of z, |z| <= 1: polynomials up to z^degree with a bound of the norm of their error.
        ring, last = Wiener(self.bits, self.degree + 1), self.pieces[-1]
        y = ring.element(self.end.coeffs(), 0)
        u, slope = (_value(ring, c, y) for c in (last.u, last.y))
        return ring.element((fmpz_poly([1 << self.bits]) - u.polynomial).coeffs(), u.error), slope

    def roughly(self) -> tuple[arb_poly, arb_poly]:
        """Return u_y = 2 H c p at the end and 2 H c, without a proof. To be called within `working`."""
        _, slope = self.at_end()
        return arb_poly(slope.polynomial) * arb(2) ** -self.bits, self.scale.poly() * (2 * self.pieces[-1].step.ball())


def _value(ring: Wiener, coefficients: Sequence[fmpz_poly], y: FunctionBall) -> FunctionBall:
    """Return sum_j c_j y^j by Horner's rule: `coefficients` are polynomials in z, y and the sum belong to the ring."""
    # A product's polynomial is cut behind z^degree and rounded; its error, which `ring` bounds, is carried along.
    total = ring.element([0], 0)
    for c in reversed(coefficients):
        product = ring.product(total, y)
        total = ring.element((product.polynomial + c).coeffs(), product.error)
    return total


# --- integration ------------------------------------------------------------------------------------------------------


def integrated(k: Scaled, unloading: bool, accuracy: int, degree: int, gap: int) -> ParametricBranch:
    """Return a branch for all z.

    Parameters
    ----------
    k : Scaled
    unloading : bool
    accuracy : int
        About the number of bits that p has, relatively, at the end.
    degree : int
        Of the polynomials in z.
    gap : int
        `end` is where r is larger by 2^-gap than at the true end.
    """
    signed = Scaled(-k.polynomial, k.exponent) if unloading else k
    # A single branch in the middle of the panel decides the pieces: their number, and H c(0) of each.
    branch = integrate(signed.value(_on_panel(k, fmpq(0))), accuracy)
    scale = _scale(signed)
    # 8 bits more than for a single branch: each product adds up to 50 coefficients in z, also rounded ones.
    bits = branch.bits + 8
    terms = int(SPARE_TERMS * len(branch.pieces[0].u))
    steps = _stretched([piece.h for piece in branch.pieces], branch.root / 2.0**branch.bits)
    grow = _Growth(signed, scale, bits, degree, terms)
    pieces: list[ParametricPiece] = []
    for step in steps:
        pieces.append(grow.piece(step, pieces[-1] if pieces else None))
    end = _end(pieces[-1], k if unloading else None, scale, bits, degree, gap)
    return ParametricBranch(k, scale, unloading, bits, degree, tuple(pieces), end)


def _scale(k: Scaled) -> Scaled:
    """Return c(z), the time until the end at k(z) over that in the middle: it puts the end at nearly the same y."""
    # Through Chebyshev's nodes cos((2 i + 1) pi/(2 n)), as fractions of 20 bits: where they lie exactly does not
    # matter. The middle one is z = 0 (1/2 on the panel at 0).
    one = 1 << SCALE_BITS
    cosines = [math.cos((2 * i + 1) * math.pi / (2 * SCALE_NODES)) for i in range(SCALE_NODES)]
    nodes = [_on_panel(k, fmpq(round(c * 2**20), 2**20)) for c in cosines]
    times = [_duration(k.value(z)) for z in nodes]
    middle = times[SCALE_NODES // 2]
    values = fmpq_mat([[fmpq(time * one // middle)] for time in times])
    # sum_n c_n z_i^n = value_i, solved with fractions.
    vandermonde = fmpq_mat([[z**n for n in range(SCALE_NODES)] for z in nodes])
    coefficients = (vandermonde.inv() * values).entries()
    return Scaled(fmpz_poly([int(c.p // c.q) for c in coefficients]), -SCALE_BITS)


def _on_panel(k: Scaled, z: fmpq) -> fmpq:
    """Return z, or (1 + z)/2 where k vanishes at 0 and z >= 0 is all that counts."""
    return z if k.polynomial[0] != 0 else (1 + z) / 2


def _duration(k: Dyadic) -> int:
    """Return the time s from the turning point to the end, roughly, in units of 2^-200.

    Only quotients of such times are used. The unit is far smaller than any time, about 1/k^2 at least.
    """
    branch = integrate(k, ROUGH)
    with working(128):  # bits; `ROUGH` of them are right
        # All steps, and of the last one the part up to the end, z = root/2^bits.
        before_last = sum((piece.h.ball() for piece in branch.pieces[:-1]), arb(0))
        time = before_last + branch.pieces[-1].h.ball() * fixed_point(branch.root, 0, branch.bits)
        return _integer(time * arb(2) ** 200)


def _stretched(steps: list[Dyadic], root: float) -> list[Dyadic]:
    """Return the steps scaled so that the end is at `END_IN_LAST` of the last one; before, it is at `root` of it."""
    with working(64):  # far more bits than the result has
        # factor (before + END_IN_LAST last) = before + root last. 20 bits: products with short steps are cheap.
        before = sum((h.ball() for h in steps[:-1]), arb(0))
        last = steps[-1].ball()
        factor = (before + last * root) / (before + last * END_IN_LAST)
        return [Dyadic.nearest((h.ball() * factor).mid(), 20) for h in steps]


@dataclass(frozen=True)
class _Growth:
    """Taylor's recursion with polynomials in z for coefficients.

    k(z) is negative for unloading, `scale` is c(z). Coefficients are in units of 2^-bits, polynomials in z are cut
    behind z^degree, and a piece has `terms` powers of y.
    """

    k: Scaled
    scale: Scaled
    bits: int
    degree: int
    terms: int

    def piece(self, step: Dyadic, before: ParametricPiece | None) -> ParametricPiece:
        """Return the piece of step H = `step` that follows `before`, or the first, which starts with u = p = 0."""
        if before is None:
            start, slope = fmpz_poly(), fmpz_poly()
        else:
            # u is the sum of the coefficients at y = 1, exactly. u_y = 2 H c p is proportional to the step.
            start = sum(before.u, fmpz_poly())
            with working(self.bits + 64):  # so that the ratio is right to `bits` bits whatever the steps' exponents
                ratio = _integer(step.ball() / before.step.ball() * arb(2) ** self.bits)
            slope = self._floor(sum(before.y, fmpz_poly()) * ratio, self.bits)
        return ParametricPiece(self._coefficients(start, slope, step), step)

    def _floor(self, polynomial: fmpz_poly, shift: int) -> fmpz_poly:
        """Return polynomial/2^shift, rounded down and cut behind z^degree."""
        coefficients = polynomial.coeffs()[: self.degree + 1]
        return fmpz_poly([c >> shift if shift >= 0 else c << -shift for c in coefficients])

    def _coefficients(self, start: fmpz_poly, slope: fmpz_poly, step: Dyadic) -> list[fmpz_poly]:
        """Return u_j(z), of which u_0 = start and u_1 = slope, for a step H: (j+1)(j+2) u_{j+2} = sum_i S_i V_{j-i}."""
        # S = r^2, V = 2 H^2 c^2 S + H c k u_y: the factors are 2 H^2 c^2 and H c k.
        elastic, viscous = _factors(self.k, self.scale, step)
        length = self.degree + 1  # of coefficients; `_floor` drops the others
        u, y = [start, slope], [slope]
        r, s, v = [(1 << self.bits) - start, -slope], list[fmpz_poly](), list[fmpz_poly]()
        for j in range(self.terms - 2):
            # S_j = sum_i r_i r_{j-i}; products occur twice, except for that of a middle one.
            square = 2 * sum((r[i].mul_low(r[j - i], length) for i in range((j + 1) // 2)), fmpz_poly())
            s.append(self._floor(square if j % 2 else square + r[j // 2].mul_low(r[j // 2], length), self.bits))
            # V_j = 2 H^2 c^2 S_j + H c k (u_y)_j
            v.append(
                self._floor(elastic.polynomial * s[j], -elastic.exponent)
                + self._floor(viscous.polynomial * y[j], -viscous.exponent)
            )
            product = sum((s[i].mul_low(v[j - i], length) for i in range(j + 1)), fmpz_poly())
            divisor = (j + 1) * (j + 2)
            u.append(fmpz_poly([c // divisor for c in self._floor(product, self.bits).coeffs()]))
            r.append(-u[-1])
            y.append((j + 2) * u[-1])
        return u


def _factors(k: Scaled, scale: Scaled, step: Dyadic) -> tuple[Scaled, Scaled]:
    """Return 2 H^2 c^2 and H c k, exactly."""
    elastic = Scaled(scale.polynomial * scale.polynomial * step.mantissa**2, 1 + 2 * (scale.exponent + step.exponent))
    viscous = Scaled(scale.polynomial * k.polynomial * step.mantissa, scale.exponent + k.exponent + step.exponent)
    return elastic, viscous


def _end(last: ParametricPiece, k: Scaled | None, scale: Scaled, bits: int, degree: int, gap: int) -> fmpz_poly:
    """Return y(z) in the last piece where r = sqrt(k p) + 2^-gap, in units of 2^-bits; without k, where r = 2^-gap.

    By Newton's method on power series in z; up to z^degree; `scale` is c(z). Nothing is assumed of the result: the
    proof begins there.
    """
    with working(bits, degree + 1):
        unit = arb(2) ** -bits
        u, y_, second = (
            [arb_series(arb_poly(c) * unit, degree + 1) for c in part]
            for part in (last.u, last.y, [j * c for j, c in enumerate(last.y)][1:])
        )
        # k p = (k/(2 H c)) u_y.
        damping = None
        if k is not None:
            inverse_step = 1 / (2 * arb_series(scale.poly() * last.step.ball(), degree + 1))
            damping = arb_series(k.poly(), degree + 1) * inverse_step
        y = arb_series([arb(END_IN_LAST)], degree + 1)
        # Each step doubles the right bits and the right powers of z; 4 more because the start has no right bit.
        for _ in range(bits.bit_length() + 4):
            value, fall = _gap(u, y_, second, y, damping, gap)
            y = _middle(y + value / fall)
        return fmpz_poly([_integer(c / unit) for c in y.coeffs()])


def _gap(
    u: list[arb_series],
    slope: list[arb_series],
    second: list[arb_series],
    y: arb_series,
    damping: arb_series | None,
    gap: int,
) -> tuple[arb_series, arb_series]:
    """Return r - sqrt(k p) - 2^-gap at y(z), and minus its derivative with respect to y.

    `u`, `slope` (u_y) and `second` (u_yy) are coefficients of y^j, `damping` is k p/u_y; all are series in z.
    """
    # Without damping: 1 - u - 2^-gap, and u_y.
    u_value, slope_value = _middle(_horner(u, y)), _middle(_horner(slope, y))
    value, fall = 1 - u_value - arb(2) ** -gap, slope_value
    if damping is not None:
        # k begins with z^(2 low), on the panel at 0 with z^2: sqrt(k p) = z^low sqrt(k p/z^(2 low)), by the logarithm.
        low = next(i for i, c in enumerate(damping.coeffs()) if not c.mid().is_zero()) // 2
        inner = arb_series((damping * slope_value).coeffs()[2 * low :], u[0].prec)
        root = (inner.log() / 2).exp()
        value = value - _shift(root, low)
        # (sqrt(k p))_y = (k p)_y sqrt(k p)/(2 k p).
        rate = arb_series((damping * _horner(second, y)).coeffs()[2 * low :], u[0].prec)
        fall = fall + _shift(rate * root / inner / 2, low)
    return _middle(value), _middle(fall)


def _shift(series: arb_series, power: int) -> arb_series:
    """Return z^power times a series."""
    return arb_series([arb(0)] * power + series.coeffs(), series.prec)


def _horner(coefficients: Sequence[arb_series], y: arb_series) -> arb_series:
    """Return sum_j c_j y^j by Horner's rule, where c_j and y are series in z."""
    total = arb_series([arb(0)], y.prec)
    for c in reversed(coefficients):
        total = total * y + c
    return total


def _middle(series: arb_series) -> arb_series:
    """Return a series without its error bounds: Newton's method needs none."""
    return arb_series([c.mid() for c in series.coeffs()], series.prec)


# --- proof ------------------------------------------------------------------------------------------------------------


class ParametricEnds(NamedTuple):
    """End value 2 H c p as a polynomial in z, with a proven relative error."""

    slope: arb_poly
    """2 H c(z) p(z): u_y of the last piece."""
    step: arb_poly
    """2 H c(z)."""
    error: arb
    """Bound of |p_true/p - 1|."""


def parametric_ends(branch: ParametricBranch, origin: bool = False) -> ParametricEnds:
    """Return p at the end of a branch with a proven error, for all |z| <= 1 (`origin`: for 0 <= z <= 1).

    Raises
    ------
    ArithmeticError
        If the polynomials are too far from a solution for the theorem to apply.
    """
    with working(branch.bits + 64):  # 64 bits (a machine word) more, so that rounding adds nothing to the bounds
        return _Proof(branch, origin).ends()


class _Proof:
    """The steps of docs/theory/exact-function.md, in order; numbers are bounds for all z."""

    def __init__(self, branch: ParametricBranch, origin: bool) -> None:
        """Bound the residuals and eta for all |z| <= 1, or with `origin` for 0 <= z <= 1."""
        self.branch, self.origin = branch, origin
        self.unit = arb(2) ** -branch.bits
        self._require_positive(branch.k.polynomial)
        self.k_most = branch.k.most()
        self.residuals = [_residual(branch, piece) for piece in branch.pieces]
        # eta bounds |p^2/p_true^2 - 1|. In terms of the polynomials it is at most 5/4 of the shares' sum as long as it
        # stays below 1/4 (step 3); 2 instead of 5/4 makes sure that it does.
        shares = self._shares()
        self.eta = 2 * sum(shares, arb(0))
        if not self.eta < arb(1) / 4:
            raise ArithmeticError("the residual is too large")
        self.shares = shares

    def _require_positive(self, k: fmpz_poly) -> None:
        """Require k > 0, for z > 0 where that is all that counts."""
        # A factor z^n, of k on the panel at 0, is positive there.
        coefficients = k.coeffs()
        while self.origin and coefficients and coefficients[0] == 0:
            del coefficients[0]
        if not (coefficients and self._least_poly(arb_poly(coefficients)) > 0):
            raise ArithmeticError("k must be positive")

    def _least_step(self, piece: ParametricPiece) -> arb:
        """Return a lower bound of the step h = H c(z)."""
        return piece.step.ball() * self.branch.scale.least()

    def _most_step(self, piece: ParametricPiece) -> arb:
        """Return an upper bound of the step h = H c(z)."""
        return piece.step.ball() * self.branch.scale.most()

    def _shares(self) -> list[arb]:
        """Bound what each piece adds to eta (step 3)."""
        # First piece: max|R|/(2 h^2 r_1^4) with r_1 = 1 - sum |u_j|, the least r; twice that in unloading, because the
        # proof has 2.12, and 2.12 < 2 * 5/4, the factor in `__init__`.
        pieces = self.branch.pieces
        size = sum(norm(c.coeffs()) for c in pieces[0].u) * self.unit
        least_r, step = 1 - size, self._least_step(pieces[0])
        if not (least_r > 0 and step > 0):
            raise ArithmeticError("the first piece is too long")
        factor = 2 if self.branch.unloading else 1
        shares = [factor * self.residuals[0] / (2 * step**2 * least_r**4)]
        for (before, piece), residual in zip(pairwise(pieces), self.residuals[1:], strict=True):
            # Other pieces: 2 max|R|/u_y(0), and 3 d/u_y(0) for a jump d of u_y: it changes the error by at most
            # (17/8) d/u_y for d <= u_y/8, and (17/8) (5/4) < 3 (step 7).
            slope = least(piece.u[1]) * self.unit
            jump = self._jump(before, piece)
            if not (slope > 0 and jump < slope / 8):
                raise ArithmeticError("too few bits for the speed")
            shares.append((2 * residual + 3 * jump) / slope)
        return shares

    def _jump(self, before: ParametricPiece, after: ParametricPiece) -> arb:
        """Bound the jump of u_y between the pieces `before` and `after`, for a step as long as that of `after`."""
        # |u_y after - (new/old) u_y before| with the steps as integers of one unit: exact up to the last division.
        slope_before = sum(before.y, fmpz_poly())
        exponent = min(before.step.exponent, after.step.exponent)
        old = before.step.mantissa << (before.step.exponent - exponent)
        new = after.step.mantissa << (after.step.exponent - exponent)
        return arb(norm((after.u[1] * old - slope_before * new).coeffs())) / old * self.unit

    def ends(self) -> ParametricEnds:
        """Return p at the end: from piece to piece, then from the last point to the end (step 4)."""
        # At each joint the end must still lie ahead. `error` is what the shares so far have become; twice that bounds
        # the error of p^2, as in `__init__`.
        error, ring = arb(0), Wiener(self.branch.bits, self.branch.degree + 1)
        for i, (piece, residual) in enumerate(zip(self.branch.pieces, self.residuals, strict=True)):
            # `_require_before` assumes g = max|R|/(2 h) < 1/3 (step 7): p >= (3/4) F >= 0.335 then exceeds g, as
            # F^2 >= 1/5. It also assumes 2 g h = max|R| < 1, so that (2 g h)^2 < 2 g h.
            disturbance = residual / (2 * self._least_step(piece))
            if not (disturbance < arb(1) / 3 and residual < 1):
                raise ArithmeticError("the residual is too large")
            self._require_motion(piece)
            if i + 1 == len(self.branch.pieces):
                break
            # r = 1 - u and u_y at y = 1 are the sums of the coefficients, exactly.
            r_1 = ring.element((fmpz_poly([1 << ring.bits]) - sum(piece.u, fmpz_poly())).coeffs(), 0)
            slope_1 = ring.element(sum(piece.y, fmpz_poly()).coeffs(), 0)
            self._require_before(piece, (r_1, slope_1), residual, 2 * (error + self.shares[i]))
            error = error * self._contraction(piece) + self.shares[i]
        # The same at the last point, y = end(z), which must be in the last piece.
        error = 2 * (error + self.shares[-1])
        piece, residual = self.branch.pieces[-1], self.residuals[-1]
        r, slope = self.branch.at_end()
        end = arb_poly(self.branch.end) * self.unit
        if not (self._least_poly(end) >= 0 and self._least_poly(1 - end) >= 0):
            raise ArithmeticError("the end is not in the last piece")
        self._require_before(piece, (r, slope), residual, error)
        return self._completed(piece, r, slope, error)

    def _contraction(self, piece: ParametricPiece) -> arb:
        """Bound the factor by which an error shrinks in unloading during the piece; in loading it is 1."""
        # exp(-k h r^2 (1 - eta)) with the least k, h and r; r falls, so it is least at y = 1 (end of step 2).
        if not self.branch.unloading:
            return arb(1)
        r = (1 - arb(norm(sum(piece.u, fmpz_poly()).coeffs())) * self.unit).max(arb(0))
        k = self.branch.k.least().max(arb(0))
        return (-k * self._least_step(piece) * r**2 * (1 - self.eta)).exp()

    def _require_motion(self, piece: ParametricPiece) -> None:
        """Require u_y > 0 up to the end, except for y = 0 at the turning point, so that p is a function of falling r.

        The speed, or that divided by y, is first bounded by its coefficients at y = 0. If that is not enough, it is
        expanded around the middle of each part of the piece.
        """
        # The end, which is at most `limit`, closes the last piece.
        last = piece is self.branch.pieces[-1]
        limit = (arb(norm(self.branch.end.coeffs())) * self.unit).min(arb(1)) if last else arb(1)
        polynomials = piece.y[1:] if piece is self.branch.pieces[0] else piece.y
        with working(self.branch.bits):
            if falls_less_than_start([self._least_poly(arb_poly(c)) for c in polynomials]):
                return
            # speed[j][i] is the coefficient of y^j z^i; powers_of_z[i] is a polynomial in y. On each part of 0 <= y <=
            # limit it is expanded around the middle: the constants, a polynomial in z, must exceed the sum of all
            # others.
            speed = [c.coeffs() for c in polynomials]
            powers_of_z = [arb_poly([c[i] if i < len(c) else 0 for c in speed]) for i in range(max(map(len, speed)))]
            for part in range(PARTS):
                place = arb_poly([(2 * part + 1) * limit / (2 * PARTS), limit / (2 * PARTS)])
                moved = [c(place).coeffs() for c in powers_of_z]
                rest = sum((abs(d) for c in moved for d in c[1:]), arb(0))
                if not self._least_poly(arb_poly([c[0] if c else arb(0) for c in moved])) > rest:
                    raise ArithmeticError("the speed may vanish before the end")

    def _require_before(
        self, piece: ParametricPiece, point: tuple[FunctionBall, FunctionBall], residual: arb, eta: arb
    ) -> None:
        """Require that a point of a piece, r and u_y there, is certainly not behind the end.

        `residual` bounds |R| on the piece, and `eta` the error of p^2 there.
        """
        # In both halves 0 <= r <= 2 (step 4) and u_y > 0.
        r, slope = point
        one = 1 << self.branch.bits
        if not (self._least(r) >= 0 and arb(r.bound) <= 2 * one and self._least(slope) > 0):
            raise ArithmeticError("the end lies before the last piece")
        if not self.branch.unloading:
            return
        # (5) of step 4, times 2 h: 2 h (r^2 - k p) >= 2 eta k u_y + 2 (k + 8 h) max|R|. Behind the end r^2 - k p is at
        # most (4/3) eta k (p + g) + (k + 8 h) g with g = max|R|/(2 h), by which the residual can change p: r then
        # changes by 2 g h, and r^2 by 2 g h 2 r <= 8 g h. 2 instead of 4/3 and 1 covers the rest.
        force = self._force(piece, r, slope)
        slope_most = arb(slope.bound) * self.unit
        needed = 2 * eta * self.k_most * slope_most + 2 * (self.k_most + 8 * self._most_step(piece)) * residual
        if not self._least_poly(force) >= needed:
            raise ArithmeticError("the end lies before the last piece")

    def _force(self, piece: ParametricPiece, r: FunctionBall, slope: FunctionBall) -> arb_poly:
        """Enclose 2 h (r^2 - k p), the elements' errors being put into the first coefficient."""
        r_poly, slope_poly = _enclosed(r, self.unit), _enclosed(slope, self.unit)
        step = self.branch.scale.poly() * (2 * piece.step.ball())
        return r_poly**2 * step - self.branch.k.poly() * slope_poly

    def _least(self, element: FunctionBall) -> arb:
        """Return a lower bound of a function of z, in its unit."""
        return self._least_poly(_enclosed(element, arb(1)))

    def _least_poly(self, polynomial: arb_poly) -> arb:
        """Return a lower bound of a polynomial for |z| <= 1, or with `origin` for 0 <= z <= 1."""
        # f_0 - sum |f_i|; for 0 <= z <= 1 it is f_0 - D_1, D_i = max(D_(i+1) - f_i, 0) (step 7).
        first, *rest = polynomial.coeffs() or [arb(0)]
        if self.origin:
            debt = arb(0)  # the terms so far are at least -debt z^i
            for c in reversed(rest):
                debt = (debt - c.lower()).max(arb(0))
            return (first - debt).lower()
        return (first - sum((abs(c) for c in rest), arb(0))).lower()

    def _completed(self, piece: ParametricPiece, r: FunctionBall, slope: FunctionBall, eta: arb) -> ParametricEnds:
        """Return p at the end of contact: that at the last point, with what p^2 may grow from there as an error.

        r and `slope`, u_y, belong to the last point, in the last piece; `eta` bounds the error of p^2 there.
        """
        # p = u_y/(2 h); the true p is larger by at most eta.
        step = self.branch.scale.poly() * (2 * piece.step.ball())
        slope_poly = _enclosed(slope, self.unit)
        least_p = self._least(slope) * self.unit / (2 * self._most_step(piece))
        most_p = arb(slope.bound) * self.unit / (2 * self._least_step(piece)) * (1 + eta)
        most_r = arb(r.bound) * self.unit
        if self.branch.unloading:
            # With D = r^2 - k p_true: p^2 grows by at most r D^2 up to the end (step 4).
            force = (
                coefficient_sum(self._force(piece, r, slope).coeffs()) / (2 * self._least_step(piece))
                + self.k_most * most_p * eta
            )
            growth = most_r * force * force
        else:
            # Up to r = 0, r^5/5 + k p_1 r^3/3 with the largest p_1 on the way, and twice that with p_1 = 2 p.
            growth = 2 * most_r**5 / 5 + 4 * self.k_most * most_p * most_r**3 / 3
        # Relative to p^2, whose square root grows by less. Below 1, p does not double, as the loading's bound assumes.
        growth = growth / (least_p * (1 - eta)) ** 2
        if not growth < 1:
            raise ArithmeticError("the end was not reached")
        return ParametricEnds(slope_poly, step, (eta + growth).abs_upper())


def _enclosed(element: FunctionBall, unit: arb) -> arb_poly:
    """Return the element's polynomial times `unit`, its error being put into the first coefficient."""
    return (arb_poly(element.polynomial) + arb(0, element.error)) * unit


def _residual(branch: ParametricBranch, piece: ParametricPiece) -> arb:
    """Bound |u_yy - S V|, V = 2 H^2 c^2 S + H c k u_y, on a piece of the branch, for 0 <= y <= 1, |z| <= 1.

    A polynomial in y and z becomes one in z alone by y = z^stride (Kronecker). Products are cut like elements of
    `Wiener`: the norm of their errors is added to that of u_yy - S V.
    """
    k = Scaled(-branch.k.polynomial, branch.k.exponent) if branch.unloading else branch.k
    elastic, viscous = _factors(k, branch.scale, piece.step)
    # Powers of z up to `degree` are computed. `stride` is so large that a product does not run into the next power of
    # y.
    degree = max(c.degree() for c in piece.u) + CUT_BEHIND
    stride = degree + max(degree, elastic.polynomial.degree(), viscous.polynomial.degree()) + 1
    packing = _Packing(branch.bits, degree, stride, len(piece.u) * stride)
    u, slope = _packed(piece.u, stride), _packed(piece.y, stride)
    second = _packed([j * c for j, c in enumerate(piece.y)][1:], stride)
    r = _ball(fmpz_poly([1 << branch.bits]) - u)
    s = packing.product(r, r)
    # V = 2 H^2 c^2 S + H c k u_y, cut; the error of S goes into that of V.
    v, v_error = fmpz_poly(), 0
    for factor, function in ((elastic, s), (viscous, _ball(slope))):
        product, error = packing.cut(factor.polynomial * function.polynomial, -factor.exponent)
        v, v_error = v + product, v_error + error
        v_error += shifted_up(norm(factor.polynomial.coeffs()) * function.error, -factor.exponent)
    # |R| <= |u_yy - S V| of the cut S and V, plus |S| |error of V| + |error of S| |V|. `second` and S V are in units of
    # 2^-bits and 2^(-2 bits).
    product_error = packing.error(s, _ball(v, v_error))
    defect = shifted_up(norm((second * (1 << branch.bits) - s.polynomial * v).coeffs()), branch.bits)
    return arb(defect + product_error) * arb(2) ** -branch.bits


def _ball(polynomial: fmpz_poly, error: int = 0) -> FunctionBall:
    """Return the functions within `error` of a polynomial, in the norm (the sum of |coefficients|)."""
    return FunctionBall(polynomial, norm(polynomial.coeffs()), error)


class _Packing(NamedTuple):
    """Polynomials in y and z as polynomials in z, y = z^stride, cut behind z^degree and before z^length."""

    bits: int
    degree: int
    stride: int
    length: int

    def product(self, a: FunctionBall, b: FunctionBall) -> FunctionBall:
        """Return a product, cut, with a bound of the norm of its error."""
        polynomial, error = self.cut(a.polynomial * b.polynomial, self.bits)
        return _ball(polynomial, error + self.error(a, b))

    def error(self, a: FunctionBall, b: FunctionBall) -> int:
        """Bound by how much the errors of two factors change their product."""
        return shifted_up(a.bound * b.error + a.error * b.norm, self.bits)

    def cut(self, polynomial: fmpz_poly, shift: int) -> tuple[fmpz_poly, int]:
        """Return polynomial/2^shift, rounded down and cut, and a bound of the norm of the difference."""
        # Cut are all powers from z^length on and, in each block of `stride` powers (one power of y), those behind
        # z^degree. Rounding down costs less than a unit for each coefficient that is kept.
        coefficients = polynomial.coeffs()
        beyond: list[fmpz] = coefficients[self.length :]
        kept: list[fmpz | int] = [*coefficients[: self.length]]
        for start in range(0, self.length, self.stride):
            first, last = start + self.degree + 1, start + self.stride
            beyond += coefficients[first : min(last, self.length)]
            kept[first:last] = [0] * (self.stride - self.degree - 1)
        return fmpz_poly([c >> shift for c in kept]), shifted_up(norm(beyond), shift) + len(kept)


def _packed(coefficients: Sequence[fmpz_poly], stride: int) -> fmpz_poly:
    """Return sum_j c_j z^(j stride), where c_j(z) are the coefficients."""
    flat: list[fmpz | int] = []
    for c in coefficients:
        block = c.coeffs()
        flat += [*block, *([0] * (stride - len(block)))]
    return fmpz_poly(flat)
