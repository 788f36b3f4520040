r"""Proof of the distance between a `flow.Branch` and the true solution (docs/theory/exact-function.md).

Put rho = p' - r^2 (r^2 + k p) for the polynomials of a branch, with r' = -2 p exactly. As a curve in the (r, p) plane
it obeys p dp/du = (r^2 (r^2 + k p) + rho)/2, and comparison with the true curve gives, as long as contact lasts,

    |p^2/p_true^2 - 1| <= eta,    eta = integral of |rho|/p_true^2 du,

in loading and in unloading alike: relative errors never grow. The residual is a polynomial, computed in balls;
no enclosure is carried from step to step.
"""

from __future__ import annotations

from typing import NamedTuple

from flint import arb, arb_poly, fmpz_poly

from viscopade.arithmetic.balls import fixed_point, working
from viscopade.collision.flow import Branch, Dyadic, Piece

GUARD_BITS = 32  # within a piece p may grow by a factor of e^6, nine bits
# For |k| of this many bits or more the balance of energy gives the work, at the cost of few bits.
ENERGY_FROM = -2


class Ends(NamedTuple):
    """Proven enclosures at the end of a branch: p, the time and the work."""

    p: arb
    """F (loading) or m (unloading)."""
    time: arb
    """Integral of r ds over the branch."""
    work: arb
    """Integral of p r^2 dr over the branch."""


def ends(branch: Branch) -> Ends:
    """Enclose p, the time and the work at the end.

    Raises
    ------
    ArithmeticError
        If the polynomials are too far from a solution for the theorem to apply.
    """
    # Where bits are many because u is of order 1/k^2 at first, so many are not needed of anything else.
    with working(branch.bits - 2 * max(branch.k.size, 0) + GUARD_BITS):
        return _ends(branch)


def _ends(branch: Branch) -> Ends:
    functions = [_Functions.of(branch, piece) for piece in branch.pieces]
    residuals = [_residual(branch.k, f) for f in functions]
    shares = _shares(branch, functions, residuals)
    eta = 2 * sum(shares, arb(0)).abs_upper()
    if not eta < arb(1) / 4:
        raise ArithmeticError("the residual is too large")
    z, eta_end = _before_the_end(branch, functions, residuals, shares, eta)
    pairs = list(zip(functions, [arb(1)] * (len(functions) - 1) + [z], strict=True))
    uncertain = 1 + _plus_minus(eta)
    time = sum((f.time(limit) for f, limit in pairs), arb(0)) * uncertain
    work = arb(0) if branch.k.size > ENERGY_FROM else sum((f.work(limit) for f, limit in pairs), arb(0)) * uncertain
    return _completed(branch, Ends(functions[-1].p(z) * (1 + _plus_minus(eta_end)), time, work), functions[-1].r(z))


class _Functions(NamedTuple):
    """R = 1 - u, Y = du/dz = 2 h p and S = R^2 of a piece."""

    r: arb_poly
    y: arb_poly
    s: arb_poly
    h: arb

    @classmethod
    def of(cls, branch: Branch, piece: Piece) -> _Functions:
        u = arb_poly(fmpz_poly(piece.u)) * arb(2) ** -branch.bits
        r = 1 - u
        return cls(r, u.derivative(), r * r, piece.h.ball())

    def p(self, z: arb) -> arb:
        return self.y(z) / (2 * self.h)

    def contraction(self, k: arb, eta: arb) -> arb:
        """Bound the factor by which an error shrinks during a piece of unloading."""
        return (k * self.h * self.r(arb(1)) ** 2 * (1 - eta)).exp()  # r falls

    def time(self, z: arb) -> arb:
        """Enclose the integral of r ds from 0 to z."""
        return self.r.integral()(z) * self.h

    def work(self, z: arb) -> arb:
        """Enclose the integral of p r^2 dr = Y^2 R^2/(2 h) dz from 0 to z."""
        y_r = self.y * self.r
        return (y_r * y_r).integral()(z) / (2 * self.h)


def _residual(k: Dyadic, f: _Functions) -> arb:
    """Bound |u'' - S (2 h^2 S + h k Y)| = 2 h^2 |rho| on 0 <= z <= 1."""
    right = f.s * (f.s * (2 * f.h**2) + f.y * (f.h * k.ball()))
    return (f.y.derivative() - right)(arb(0, 1)).abs_upper()


def _shares(branch: Branch, functions: list[_Functions], residuals: list[arb]) -> list[arb]:
    """Bound what each piece adds to eta, in terms of the polynomials: steps 2 and 3 of the proof.

    In terms of the true solution it is at most 5/4 of that, as long as eta <= 1/4.
    """
    unit = arb(2) ** -branch.bits
    shares = [_first_piece(branch, functions[0]) * residuals[0]]
    for f, residual in zip(functions[1:], residuals[1:], strict=True):
        slope = f.y[0]
        if not slope > 100 * unit:
            raise ArithmeticError("too few bits for the speed")
        shares.append((2 * residual + 8 * unit) / slope)  # 8: u' is continuous but for less than three units
    return shares


def _first_piece(branch: Branch, f: _Functions) -> arb:
    """Return the factor of the residual for the piece that starts with p = 0, where eta is at most max|rho|/r^4.

    In unloading it is twice that, but for what the factor 5/4 covers.
    """
    least_r = 1 - (1 - f.r)(arb(0, 1)).abs_upper()
    if not least_r > 0:
        raise ArithmeticError("the first piece is too long")
    return (2 if branch.k.mantissa < 0 else 1) / (2 * f.h**2 * least_r**4)


def _before_the_end(
    branch: Branch, functions: list[_Functions], residuals: list[arb], shares: list[arb], eta: arb
) -> tuple[arb, arb]:
    """Return z close to the end and certainly not behind it, and the bound of eta there: step 4 of the proof."""
    k = branch.k.ball()
    error = arb(0)
    for f, residual, share in zip(functions[:-1], residuals[:-1], shares[:-1], strict=True):
        if not _is_before(f, arb(1), k, 2 * (error + share), residual):
            raise ArithmeticError("the end lies before the last piece")
        error = error * f.contraction(k, eta) + share if k < 0 else error + share
    error = 2 * (error + shares[-1])
    back = len(branch.pieces[-1].u)
    while back < 1 << branch.bits:
        z = fixed_point(max(branch.root - back, 0), 0, branch.bits)
        if _is_before(functions[-1], z, k, error, residuals[-1]):
            return z, error
        back *= 4
    raise ArithmeticError("the end was not separated")


def _is_before(f: _Functions, z: arb, k: arb, eta: arb, residual: arb) -> bool:
    """Whether z is certainly not behind the end, if the start of the piece is not.

    In loading r >= 0 says so. In unloading r^2 - |k| p must be larger than what it can be behind the end.
    """
    r, p, disturbance = f.r(z), f.p(z), residual / (2 * f.h)
    if not (0 <= r <= 2 and p > 0):
        return False
    if not k < 0:
        return bool(disturbance < arb(1) / 3 or disturbance < k / 8)
    small = disturbance < arb(1) / 3 and disturbance * f.h < arb(1) / 2
    return bool(small and r * r >= -k * p * (1 + 2 * eta) + 2 * (8 * f.h - k) * disturbance)


def _completed(branch: Branch, before: Ends, r: arb) -> Ends:
    """Add what is missing between r, just before the end, and the end itself: step 4 of the proof."""
    p, k = before.p, abs(branch.k.ball())
    if branch.k.mantissa >= 0:
        growth = 2 * r**3 * (1 + k * p)
        if not growth < p * p:
            raise ArithmeticError("the end of loading was not reached")
        p_end = (p * p + _up_to(growth)).sqrt()
        rest, balance = r * r, p_end**2 - arb(1) / 5
    else:
        force = r * r - k * p
        p_end = (p * p + _up_to(r * force * force)).sqrt()
        rest, balance = r * r - k * p_end, (1 - (k * p_end).sqrt() ** 5) / 5 - p_end**2
    work = balance / k if branch.k.size > ENERGY_FROM else before.work + _up_to(p_end * r * rest)
    return Ends(p_end, before.time + _up_to(rest / (4 * p)), work)


def _plus_minus(bound: arb) -> arb:
    """Return the ball 0 ± bound."""
    return arb(0, bound.abs_upper())


def _up_to(bound: arb) -> arb:
    """Return the interval from 0 to bound, which is not negative."""
    half = bound.abs_upper() / 2
    return arb(half.mid(), half.abs_upper())
