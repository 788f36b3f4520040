r"""Proof that eps(v*) is analytic for |v*| <= 1.04: its series converges there (docs/theory/exact-function.md, 9).

A collision is an orbit of R' = W, W' = -2 R^2 (R^2 + v*^2 W) from R = 0, W = 1 (R = sqrt(x), W = x', d tau = 2 R ds).
Contact ends where R = v* sqrt(-W), with eps = -W. All of this makes sense for complex v* and complex time s. Squares
cover the upper half of the disc; a panel is a disc v* = c + d z, |z| <= 1, around a square. NumPy drafts the orbits of
a panel as polynomials in z and in the time. The proof assumes nothing about these drafts. A bound of their residual
implies that the orbits exist, that contact ends, and that touching panels have the same eps.
"""

from __future__ import annotations

import argparse
import time
from collections.abc import Iterable, Iterator
from dataclasses import dataclass
from fractions import Fraction
from functools import cached_property, lru_cache
from itertools import combinations
from math import ceil
from operator import mul
from typing import NamedTuple

import numpy as np
from flint import acb, acb_poly, arb, arb_mat, arb_poly, fmpz, fmpz_poly
from numpy.typing import NDArray

from viscopade.arithmetic.balls import ball_of, fixed_point, working

RADIUS = Fraction(26, 25)
LARGEST, SMALLEST = Fraction(1, 8), Fraction(1, 2**12)  # half widths of squares
# A piece of an orbit is valid on the disc |y| <= 1 of times s_0 + h(z) y; the next piece starts at y = ADVANCE.
ADVANCE = Fraction(15, 16)
PARTS = 16  # of 0 <= y <= 1, for the growth of errors; ADVANCE is one of their ends
REACH = Fraction(1, 128)  # Paths may differ by this part of |h|; at most 1 - ADVANCE.
TUBE = arb(2) ** -10  # Largest distance of an orbit from its draft.
BITS = 60  # Coefficients of drafts are integers in units of 2^-BITS.
# Drafts: highest power of y, terms in z, terms of h(z); size of the last coefficients in y and z; Newton's method.
ORDER, TERMS, STEP_TERMS = 20, 24, 8
LAST_IN_Y, LAST_IN_Z = 1e-10, 1e-7
DRAFT_STEPS, MAX_STEPS = 12, 60
MAX_NEWTON, NEWTON_TOLERANCE = 8, 1e-9
STRIDE = 2 * TERMS

Array = NDArray[np.complex128]


@dataclass(frozen=True)
class Square:
    """The closed square |Re v* - x| <= half, |Im v* - y| <= half; all three are multiples of 2^(1 - BITS)."""

    x: Fraction
    y: Fraction
    half: Fraction

    def __post_init__(self) -> None:
        if any((number * 2 ** (BITS - 1)).denominator != 1 for number in (self.x, self.y, self.half)):
            raise ValueError(f"{self} has numbers that are not multiples of 2^{1 - BITS}")

    @property
    def centre(self) -> complex:
        """The middle of the square and of its panel."""
        return complex(self.x, self.y)

    @property
    def radius(self) -> Fraction:
        """Radius of the panel, which is more than sqrt(2) half."""
        return Fraction(3, 2) * self.half

    def nearest(self) -> Fraction:
        """Return the least |v*|^2."""
        x, y = (max(abs(c) - self.half, Fraction(0)) for c in (self.x, self.y))
        return x**2 + y**2

    def farthest(self) -> Fraction:
        """Return the largest |v*|^2."""
        return (abs(self.x) + self.half) ** 2 + (abs(self.y) + self.half) ** 2

    def quarters(self) -> list[Square]:
        """Return the four squares of half the width."""
        h = self.half / 2
        return [Square(self.x + i * h, self.y + j * h, h) for i in (-1, 1) for j in (-1, 1)]

    def common_point(self, other: Square) -> tuple[Fraction, Fraction] | None:
        """Return a point that two squares share, if they touch."""
        point = []
        for a, b in ((self.x, other.x), (self.y, other.y)):
            low, high = max(a - self.half, b - other.half), min(a + self.half, b + other.half)
            if low > high:
                return None
            point.append((low + high) / 2)
        return point[0], point[1]


# --- drafts by NumPy, which the proof does not trust ------------------------------------------------------------------


class _Times(NamedTuple):
    """Times from the start to the turning point, and on to the end of contact, for some v*."""

    v: Array
    turning: Array
    rest: Array


def _taylor(r: Array, w: Array, kappa: Array, h: Array) -> tuple[Array, Array]:
    """Return Taylor coefficients of R and W in y, for s = s_0 + h y."""
    R, W, squares, sums = (np.zeros((ORDER + 1, len(r)), complex) for _ in range(4))
    R[0], W[0] = r, w
    for n in range(ORDER):
        squares[n] = np.einsum("ij,ij->j", R[: n + 1], R[n::-1])
        sums[n] = squares[n] + kappa * W[n]
        R[n + 1] = h * W[n] / (n + 1)
        W[n + 1] = -2 * h / (n + 1) * np.einsum("ij,ij->j", squares[: n + 1], sums[n::-1])
    return R, W


def _followed(r: Array, w: Array, kappa: Array, duration: Array) -> tuple[Array, Array]:
    for _ in range(DRAFT_STEPS):
        r, w = (c.sum(0) for c in _taylor(r, w, kappa, duration / DRAFT_STEPS))
    return r, w


def _moved(times: _Times, v: Array) -> _Times:
    """Return the times for other v*, by Newton's method."""
    kappa, turning, rest = v * v, times.turning, times.rest
    for _ in range(MAX_NEWTON):
        r, w = _followed(0 * v, 1 + 0 * v, kappa, turning)
        change = w / (2 * r**4)
        turning = turning + change
        if np.max(abs(change)) < NEWTON_TOLERANCE:
            break
    at_turning = _followed(0 * v, 1 + 0 * v, kappa, turning)
    for _ in range(MAX_NEWTON):
        r, w = _followed(*at_turning, kappa, rest)
        root = np.sqrt(-w)
        change = (r - v * root) / (w - v * r * r * (r * r + kappa * w) / root)
        rest = rest - change
        if np.max(abs(change)) < NEWTON_TOLERANCE:
            break
    return _Times(v, turning, rest)


@lru_cache(maxsize=1)
def _map() -> _Times:
    """Return the times on rays from v* = 0."""
    rays = np.exp(1j * np.pi * np.linspace(0, 1, 33))
    elastic = np.full(len(rays), 1.31 + 0j)  # half of the duration
    found = [_Times(0 * rays, elastic, elastic)]
    for size in np.linspace(0.04, 1.04, 26):
        found.append(_moved(found[-1], size * rays))
    return _Times(*(np.concatenate(parts) for parts in zip(*found, strict=True)))


def _times(square: Square) -> _Times:
    """Return the times on the boundary of the panel."""
    known = _map()
    i = int(np.argmin(abs(known.v - square.centre)))
    times = _Times(*(part[i : i + 1] for part in known))
    for way in np.linspace(0.25, 1, 4):
        times = _moved(times, known.v[i] + way * (square.centre - known.v[i : i + 1]))
    circle = float(square.radius) * np.exp(2j * np.pi * np.arange(TERMS) / TERMS)
    return _moved(_Times(*(np.repeat(part, TERMS) for part in times)), square.centre + circle)


def _coefficients(values: Array) -> Array:
    """Return coefficients in z from the values on |z| = 1 (last axis)."""
    return np.asarray(np.fft.fft(values) / values.shape[-1])


def _steps(r: Array, w: Array, kappa: Array, duration: Array) -> int:
    """Return the number of pieces whose last coefficients in y are small enough."""
    largest = 0.0
    for _ in range(DRAFT_STEPS):
        coefficients = _taylor(r, w, kappa, duration / DRAFT_STEPS)
        largest = max(largest, *(np.max(abs(c[-1])) for c in coefficients))
        r, w = (c.sum(0) for c in coefficients)
    needed = DRAFT_STEPS / float(ADVANCE) * (largest / LAST_IN_Y) ** (1 / ORDER)
    if not needed < MAX_STEPS:
        raise ArithmeticError("the orbits come too close to a singularity")
    return ceil(float(needed))


class _Piece(NamedTuple):
    """Orbits on a disc of times: R(y, z) and W(y, z)."""

    R: BivariateBall
    W: BivariateBall


@dataclass(frozen=True)
class _Leg:
    """Pieces of one length h(z) each, one after the other."""

    h: BivariateBall
    pieces: list[_Piece]

    @property
    def duration(self) -> acb_poly:
        """The time of all pieces together, a polynomial in z."""
        return self.h.in_z() * acb(ball_of(ADVANCE * len(self.pieces)))


class _Draft(NamedTuple):
    """The approximate orbits of a panel up to the turning point and to the end of contact, and sqrt(-W) there."""

    legs: list[_Leg]
    root: BivariateBall


def _draft(square: Square) -> _Draft:
    v, *durations = _times(square)
    r, w = 0 * v, 1 + 0 * v
    powers = float(ADVANCE) ** np.arange(ORDER + 1)
    legs = []
    for duration in durations:
        count = _steps(r, w, v * v, duration)
        h = _coefficients(duration / (float(ADVANCE) * count))[:STEP_TERMS]
        leg = _Leg(BivariateBall.rounded(h[None]), [])
        for _ in range(count):
            series = _taylor(r, w, v * v, TERMS * np.fft.ifft(h, TERMS))
            leg.pieces.append(_Piece(*(BivariateBall.rounded(_coefficients(c)) for c in series)))
            r, w = (np.tensordot(powers, c, 1) for c in series)
        legs.append(leg)
    if not np.max(abs(_coefficients(w)[-4:])) < LAST_IN_Z:
        raise ArithmeticError("the panel comes too close to a singularity")
    return _Draft(legs, BivariateBall.rounded(_coefficients(np.sqrt(-w))[None]))


# --- balls of functions of y and z ------------------------------------------------------------------------------------


@dataclass(frozen=True)
class BivariateBall:
    """Ball of functions: all functions within `error` of a polynomial in y and z on |y| <= 1, |z| <= 1.

    It is `function_balls.FunctionBall` with two variables and complex integers; those of z^i y^j stand at i + STRIDE j
    of `re` and `im`. Everything is in units of 2^-BITS. There are at most TERMS powers of z and ORDER + 1 powers of
    y.
    """

    re: fmpz_poly
    im: fmpz_poly
    error: int = 0

    @classmethod
    def rounded(cls, rows: Array) -> BivariateBall:
        """Round the coefficients of a polynomial, one row for each power of y."""
        table = np.zeros((len(rows), STRIDE), complex)
        table[:, : rows.shape[1]] = rows * 2.0**BITS
        if not np.isfinite(table).all():
            raise ArithmeticError("no draft was found")
        re, im = (fmpz_poly([int(c) for c in part.ravel()]) for part in (table.real, table.imag))
        return cls(re, im)

    @classmethod
    def linear(cls, x: Fraction | int, y: Fraction | int = 0, slope: Fraction | int = 0) -> BivariateBall:
        """Return x + i y + slope z; the numbers must be multiples of 2^-BITS."""
        x, y, slope = (int(number * 2**BITS) for number in (x, y, slope))
        return cls(fmpz_poly([x, slope]), fmpz_poly([y]))

    def __add__(self, other: BivariateBall) -> BivariateBall:
        """Return the sum."""
        return BivariateBall(self.re + other.re, self.im + other.im, self.error + other.error)

    def __sub__(self, other: BivariateBall) -> BivariateBall:
        """Return the difference."""
        return self + other.times(-1)

    def __mul__(self, other: BivariateBall) -> BivariateBall:
        """Return the product; truncation and rounding are added to the error."""
        a, b = self.re * other.re, self.im * other.im
        (re, re_cut), (im, im_cut) = map(_cut, (a - b, (self.re + self.im) * (other.re + other.im) - a - b))
        error = re_cut + im_cut + self.error * other.error
        error += (self.error and self.error * sum(other.sizes)) + (other.error and other.error * sum(self.sizes))
        return BivariateBall(re, im, (error >> BITS) + 1 + 2 * TERMS * (ORDER + 1))

    def times(self, number: int) -> BivariateBall:
        """Return the function times a number."""
        return BivariateBall(self.re * number, self.im * number, self.error * abs(number))

    def slope(self) -> BivariateBall:
        """Return the derivative of a polynomial by y."""
        if self.error:
            raise ValueError("only polynomials have a known slope")
        return BivariateBall(_slope(self.re), _slope(self.im))

    def first(self) -> BivariateBall:
        """Return the function of z at y = 0."""
        re, im = (fmpz_poly(part.coeffs()[:STRIDE]) for part in (self.re, self.im))
        return BivariateBall(re, im, self.error)

    def advanced(self) -> BivariateBall:
        """Return the function of z at y = ADVANCE."""
        return BivariateBall(_advanced(self.re), _advanced(self.im), self.error + 2 * TERMS)

    @cached_property
    def sizes(self) -> list[int]:
        """Bound the polynomial's coefficient of each power of y, for |z| <= 1."""
        pairs = zip(_rows(self.re, len(self.im)), _rows(self.im, len(self.re)), strict=True)
        return [int(sum((a * a + b * b).isqrt() + 1 for a, b in zip(*pair, strict=True))) for pair in pairs]

    def majorant(self) -> arb_poly:
        """Return a polynomial in |y| that bounds the functions for |z| <= 1."""
        return arb_poly([_unit(size) for size in self.sizes]) + _unit(self.error)

    def norm(self) -> arb:
        """Bound the functions."""
        return _unit(sum(self.sizes) + self.error)

    def middle(self) -> acb:
        """Return the polynomial at y = z = 0."""
        return acb(_unit(int(self.re[0])), _unit(int(self.im[0])))

    def variation(self) -> arb:
        """Bound the difference from `middle`."""
        return self.norm() - abs(self.middle())

    def in_z(self) -> acb_poly:
        """Return a function of z alone as a polynomial whose coefficients are balls."""
        length = max(len(self.re), len(self.im))
        coefficients = [acb(_unit(int(self.re[i])), _unit(int(self.im[i]))) for i in range(length)]
        error = arb(0, _unit(self.error))
        return acb_poly(coefficients) + acb(error, error)


def _unit(number: int) -> arb:
    return fixed_point(number, 0, BITS)


def _rows(part: fmpz_poly, length: int = 0) -> list[list[fmpz]]:
    """Return the coefficients of each power of y, at least as many as a polynomial of this length has."""
    coefficients = part.coeffs()
    rows = -(-max(len(coefficients), length, 1) // STRIDE)
    coefficients += [fmpz(0)] * (rows * STRIDE - len(coefficients))
    return [coefficients[STRIDE * j : STRIDE * (j + 1)] for j in range(rows)]


def _cut(part: fmpz_poly) -> tuple[fmpz_poly, int]:
    """Return half of a product in units of 2^-BITS, rounded and without its high powers, and the sum of the latter."""
    rows, blank = _rows(part), [fmpz(0)] * (STRIDE - TERMS)
    kept = [c for row in rows[: ORDER + 1] for c in [c >> BITS for c in row[:TERMS]] + blank]
    dropped = [row[TERMS:] for row in rows[: ORDER + 1]] + rows[ORDER + 1 :]
    return fmpz_poly(kept), int(sum(sum(map(abs, row)) for row in dropped))


def _slope(part: fmpz_poly) -> fmpz_poly:
    return fmpz_poly([j * c for j, row in enumerate(_rows(part)) for c in row][STRIDE:])


def _advanced(part: fmpz_poly) -> fmpz_poly:
    """Return the coefficients in z at y = ADVANCE, rounded down."""
    rows, (top, bottom) = _rows(part), ADVANCE.as_integer_ratio()
    degree = len(rows) - 1
    weights = [top**j * bottom ** (degree - j) for j in range(degree + 1)]
    return fmpz_poly([sum(map(mul, column, weights), fmpz(0)) // bottom**degree for column in zip(*rows, strict=True)])


# --- proofs -----------------------------------------------------------------------------------------------------------


@dataclass(frozen=True)
class ProvenDisc:
    """A disc of the v* plane, v* = c + d z with |z| <= 1, and the proven enclosures on it.

    Orbits exist along all paths 0, M', s with |M' - turning(z)| <= reach, |s - end(z)| <= reach. There is exactly one
    such s with R = v* sqrt(-W), Re sqrt(-W) > 0. Its distance from end(z) is at most `distance`, that of
    eps = -W there from epsilon(z) at most `error`; |eps| <= bound.
    """

    square: Square
    turning: acb_poly
    end: acb_poly
    reach: arb
    distance: arb
    epsilon: acb_poly
    error: arb
    bound: arb

    def z(self, x: Fraction, y: Fraction) -> acb:
        """Return z of v* = x + i y."""
        return acb(*(ball_of((p - c) / self.square.radius) for p, c in ((x, self.square.x), (y, self.square.y))))


def _grown(h: BivariateBall, piece: _Piece, kappa: BivariateBall, errors: arb_mat) -> tuple[arb_mat, arb]:
    """Return the errors of R and W at y = ADVANCE, given those at y = 0, and a bound of |R^2 (R^2 + kappa W)|.

    The bound is for all orbits within TUBE of the piece; this function proves that all orbits are.
    """
    square, damping = piece.R * piece.R, kappa * piece.W
    force = square * (square + damping)
    residuals = piece.R.slope() - h * piece.W, piece.W.slope() + h * force.times(2)
    # Bounds of the force's derivatives by R and W, as polynomials in |y|.
    by_r = piece.R.majorant() * (square.times(4) + damping.times(2)).majorant()
    k, r, w = kappa.norm(), piece.R.majorant() + TUBE, piece.W.majorant() + TUBE
    by_r += TUBE * (12 * r * r + 2 * k * (r + w))
    by_w = k * r * r
    errors = errors + arb_mat([[f.norm()] for f in residuals])
    for part in range(1, PARTS + 1):
        y = arb(part) / PARTS
        rates = h.norm() * arb_mat([[0, 1], [2 * by_r(y), 2 * by_w(y)]])
        errors = (rates / PARTS).exp() * errors
        if part == ADVANCE * PARTS:
            advanced = errors
    if not (errors[0, 0] < TUBE and errors[1, 0] < TUBE):
        raise ArithmeticError("the residual is too large")
    return advanced, force.norm() + TUBE * (by_r(1) + by_w(1))


def _distance_of_end(
    draft: _Draft, v: BivariateBall, r: BivariateBall, w: BivariateBall, errors: arb_mat, acceleration: arb, reach: arb
) -> arb:
    """Bound the distance of the end of contact from the draft's last point.

    `r` and `w` are R(z) and W(z) there up to `errors`; `acceleration` bounds |W'| within `reach` of there.
    """
    root, kappa = draft.root, v * v
    norm, k, error_r, error_w = v.norm(), kappa.norm(), errors[0, 0], errors[1, 0]
    q = root.middle().real - root.variation()
    here = (w + root * root).norm() + error_w
    around = here + reach * acceleration
    if not (q > 0 and around < q * q / 2):
        raise ArithmeticError("sqrt(eps) is not known well enough")
    largest_w = w.norm() + error_w + reach * acceleration
    largest_r = r.norm() + error_r + reach * largest_w
    balance = (r * r + kappa * w).norm() + 2 * largest_r * error_r + k * error_w
    balance += reach * (2 * largest_r * largest_w + k * acceleration)
    value = (r - v * root).norm() + error_r + norm * here / q
    slope = around + norm * largest_r * largest_r * balance / (q - around / q)
    distance = 2 * value / (q * q)
    if not (slope < q * q / 2 and distance < reach):
        raise ArithmeticError("the end of contact is not isolated")
    return distance


def prove_disc(square: Square) -> ProvenDisc:
    """Return the proof for one panel.

    Raises
    ------
    ArithmeticError
        If no draft is close enough to the orbits, as near a singularity of eps.
    """
    with working(BITS + 20), np.errstate(all="ignore"):
        return _proven(square, _draft(square))


def _proven(square: Square, draft: _Draft) -> ProvenDisc:
    v = BivariateBall.linear(square.x, square.y, square.radius)
    r, w, errors = BivariateBall.linear(0), BivariateBall.linear(1), arb_mat([[0], [0]])
    for leg in draft.legs:
        for piece in leg.pieces:
            errors = errors + arb_mat([[(piece.R.first() - r).norm()], [(piece.W.first() - w).norm()]])
            errors, force = _grown(leg.h, piece, v * v, errors)
            r, w = piece.R.advanced(), piece.W.advanced()
    reach = min((ball_of(REACH) * (abs(leg.h.middle()) - leg.h.variation())).lower() for leg in draft.legs)
    acceleration = 2 * force
    distance = _distance_of_end(draft, v, r, w, errors, acceleration, reach)
    error = errors[1, 0] + distance * acceleration
    turning, rest = (leg.duration for leg in draft.legs)
    return ProvenDisc(square, turning, turning + rest, reach, distance, -w.in_z(), error, (w.norm() + error).upper())


# --- the disc ---------------------------------------------------------------------------------------------------------


def proven_discs(radius: Fraction, squares: Iterable[Square] | None = None) -> Iterator[ProvenDisc]:
    """Yield panels that cover the upper half of the disc |v*| <= radius, or its part in `squares`.

    Raises
    ------
    ArithmeticError
        If a square of the smallest size cannot be proven.
    """
    waiting = list(_grid(radius) if squares is None else squares)
    while waiting:
        square = waiting.pop()
        if square.nearest() > radius**2:
            continue
        try:
            yield prove_disc(square)
        except ArithmeticError:
            if square.half <= SMALLEST:
                raise
            waiting += square.quarters()


def _grid(radius: Fraction) -> Iterator[Square]:
    count = ceil(radius / (2 * LARGEST))
    for i in range(-count, count):
        for j in range(count):
            yield Square((2 * i + 1) * LARGEST, (2 * j + 1) * LARGEST, LARGEST)


def agree(one: ProvenDisc, other: ProvenDisc) -> bool:
    """Return whether two panels whose squares touch are proven to have the same eps on their overlap."""
    point = one.square.common_point(other.square)
    if point is None:
        raise ValueError("the squares do not touch")
    with working(BITS + 20):
        z, z_other = one.z(*point), other.z(*point)
        turning = abs(one.turning(z) - other.turning(z_other))
        end = abs(one.end(z) - other.end(z_other))
        return any(turning < a.reach and end + b.distance < a.reach for a, b in ((one, other), (other, one)))


def starts_elastically(panel: ProvenDisc) -> bool:
    """Return whether the panel's end of contact at v* = 0 is proven to be the end of the elastic collision."""
    with working(BITS + 20):
        z = panel.z(Fraction(0), Fraction(0))
        duration = 2 * (arb(5) / 4).root(5) * (arb(1) / 5).gamma() * arb.pi().sqrt() / (5 * (arb(7) / 10).gamma())
        return bool(abs(panel.turning(z).imag) < panel.reach and abs(panel.end(z) - duration) < panel.reach)


class Theorem(NamedTuple):
    """Theorem: eps is analytic for |v*| <= radius, with |eps| <= bound there, so |h_k| <= bound/radius^k."""

    radius: Fraction
    bound: arb
    panels: list[ProvenDisc]


def theorem(radius: Fraction = RADIUS) -> Theorem:
    """Prove the theorem for a radius.

    Raises
    ------
    ArithmeticError
        If the proof fails.
    """
    found = list(proven_discs(radius))
    touching = [pair for pair in combinations(found, 2) if pair[0].square.common_point(pair[1].square)]
    at_zero = [panel for panel in found if panel.square.nearest() == 0]
    if not (all(agree(*pair) for pair in touching) and all(map(starts_elastically, at_zero))):
        raise ArithmeticError("two panels do not agree")
    bound = max(panel.bound for panel in found if panel.square.farthest() >= radius**2)
    return Theorem(radius, bound, found)


def main() -> None:
    """Prove that the series converges for |v*| up to a radius, and print the bound of |eps| there."""
    parser = argparse.ArgumentParser(description=main.__doc__)
    parser.add_argument("radius", nargs="?", type=Fraction, default=RADIUS)
    start = time.perf_counter()
    radius, bound, found = theorem(parser.parse_args().radius)
    print(f"eps is analytic for |v*| <= {float(radius)}, and there |eps| <= {ceil(float(bound) * 100) / 100}")
    print(f"{len(found)} panels, {time.perf_counter() - start:.0f} s")


if __name__ == "__main__":
    main()
