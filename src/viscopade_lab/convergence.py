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

# The numbers below are chosen: whatever they are, what is proven is true. Badly chosen ones need more and smaller
# panels, or the proof fails. Counts of panels are measured on |v*| <= 1.04, 0 <= Re v* <= 1/2, 3/4 <= Im v* <= 1, next
# to the singularity, where 32 are needed.

# Radius of the disc. eps is singular at |v*| = 1.0470; closer to it panels become small and many.
RADIUS = Fraction(26, 25)
# Half widths of squares. The theorem needs 1/8 far from the singularity and 1/512 next to it. The smallest ends the
# division where there is no proof, as at the singularity.
LARGEST, SMALLEST = Fraction(1, 8), Fraction(1, 2**12)
# A piece of an orbit is valid on the disc |y| <= 1 of times s_0 + h(z) y; the next piece starts at y = ADVANCE. The
# rest, 1/16, leaves room for paths beside the drafted one.
ADVANCE = Fraction(15, 16)
# Intervals of 0 <= y <= 1 for the growth of errors; ADVANCE is one of their ends. Errors with 32 are the same to 0.1 %.
PARTS = 16
# Paths may differ by this share of |h|; at most 1 - ADVANCE. 1/512 needs 32 panels, too, 1/32 needs 43.
REACH = Fraction(1, 128)
# Largest distance of an orbit from its draft for which bounds are made. 2^-8 and 2^-14 need 32 panels, too.
TUBE = arb(2) ** -10
# Coefficients of drafts are integers in units of 2^-BITS: below the rounding of doubles, 2^-53, that the drafts have.
BITS = 60
# Drafts: highest power of y, terms in z, and terms of h(z). 4 terms of h(z) need 74 panels, 12 need 32, too; orders and
# terms are balanced with the last coefficients below.
ORDER, TERMS, STEP_TERMS = 20, 24, 8
# Largest size of the last coefficients in y and z: the residual is about as large, and the error of eps that follows is
# 2e-6 for |v*| <= 1/2 and up to 6e-3 near the singularity. 1e-8 in y needs 50 panels.
LAST_IN_Y, LAST_IN_Z = 1e-10, 1e-7
# Taylor steps to find the times: 24 give the same, with 6 no draft is found. A leg has 6 to 32 pieces; orbits that need
# more than MAX_STEPS come close to a singularity in time, which a smaller square may avoid.
DRAFT_STEPS, MAX_STEPS = 12, 60
# Newton's method converges quadratically: 8 steps suffice from a close start, and after a change of 1e-9 the error is
# about 1e-18.
MAX_NEWTON, NEWTON_TOLERANCE = 8, 1e-9
STRIDE = 2 * TERMS  # room for the product of two polynomials with TERMS powers of z

Array = NDArray[np.complex128]


@dataclass(frozen=True)
class Square:
    """The closed square |Re v* - x| <= half, |Im v* - y| <= half; all three are multiples of 2^(1 - BITS)."""

    x: Fraction
    y: Fraction
    half: Fraction

    def __post_init__(self) -> None:
        """Check that x, y and 3/2 half are whole in units of 2^-BITS, so that v* = c + d z of the panel is exact."""
        if any((number * 2 ** (BITS - 1)).denominator != 1 for number in (self.x, self.y, self.half)):
            raise ValueError(f"{self} has numbers that are not multiples of 2^{1 - BITS}")

    @property
    def centre(self) -> complex:
        """The middle of the square and of its panel."""
        return complex(self.x, self.y)

    @property
    def radius(self) -> Fraction:
        """Radius of the panel: more than sqrt(2) half, so that the square lies inside, and its rim, too."""
        return Fraction(3, 2) * self.half  # and a multiple of 2^-BITS

    def nearest(self) -> Fraction:
        """Return the least |v*|^2 of the square's points."""
        # Distances of the square from the imaginary and the real axis, 0 if it crosses them.
        x, y = (max(abs(c) - self.half, Fraction(0)) for c in (self.x, self.y))
        return x**2 + y**2

    def farthest(self) -> Fraction:
        """Return the largest |v*|^2 of the square's points, that of a corner."""
        return (abs(self.x) + self.half) ** 2 + (abs(self.y) + self.half) ** 2

    def quarters(self) -> list[Square]:
        """Return the four squares of half the width."""
        h = self.half / 2
        return [Square(self.x + i * h, self.y + j * h, h) for i in (-1, 1) for j in (-1, 1)]

    def common_point(self, other: Square) -> tuple[Fraction, Fraction] | None:
        """Return a point (Re v*, Im v*) that this and another square share, the middle of all such; None if none."""
        point = []
        for a, b in ((self.x, other.x), (self.y, other.y)):
            low, high = max(a - self.half, b - other.half), min(a + self.half, b + other.half)
            if low > high:
                return None
            point.append((low + high) / 2)
        return point[0], point[1]


# --- drafts by NumPy, which the proof does not trust ------------------------------------------------------------------


class _Times(NamedTuple):
    """Complex times s from the start to the turning point W = 0, and on to the end of contact, for each v* of `v`."""

    v: Array
    turning: Array
    rest: Array


def _taylor(r: Array, w: Array, kappa: Array, h: Array) -> tuple[Array, Array]:
    """Return the Taylor coefficients of R and W in y, s = s_0 + h y: a row for each power, a column for each v*.

    `r` and `w` are R and W at s_0, kappa = v*^2.
    """
    R, W, squares, sums = (np.zeros((ORDER + 1, len(r)), complex) for _ in range(4))
    R[0], W[0] = r, w
    for n in range(ORDER):
        # Coefficients n of R^2 and of R^2 + kappa W; einsum makes the Cauchy product sum R_i R_(n-i) of each column.
        squares[n] = np.einsum("ij,ij->j", R[: n + 1], R[n::-1])
        sums[n] = squares[n] + kappa * W[n]
        # dR/dy = h W,   dW/dy = -2 h R^2 (R^2 + kappa W).
        R[n + 1] = h * W[n] / (n + 1)
        W[n + 1] = -2 * h / (n + 1) * np.einsum("ij,ij->j", squares[: n + 1], sums[n::-1])
    return R, W


def _orbit_end(r: Array, w: Array, kappa: Array, duration: Array) -> tuple[Array, Array]:
    """Return R and W after a straight complex `duration` of time s, from r and w, in `DRAFT_STEPS` Taylor steps."""
    for _ in range(DRAFT_STEPS):
        r, w = (c.sum(0) for c in _taylor(r, w, kappa, duration / DRAFT_STEPS))
    return r, w


def _moved(times: _Times, v: Array) -> _Times:
    """Return the times for other v*, close to those of `times`, by Newton's method from them."""
    kappa, turning, rest = v * v, times.turning, times.rest
    # Each orbit starts from R = 0, W = 1 (arrays, one entry for each v*).
    # The turning point, W = 0, where W' = -2 R^2 (R^2 + kappa W) = -2 R^4.
    for _ in range(MAX_NEWTON):
        r, w = _orbit_end(0 * v, 1 + 0 * v, kappa, turning)
        change = w / (2 * r**4)
        turning = turning + change
        if np.max(abs(change)) < NEWTON_TOLERANCE:
            break
    at_turning = _orbit_end(0 * v, 1 + 0 * v, kappa, turning)
    # The end of contact, G = R - v* sqrt(-W) = 0, where G' = W - v* R^2 (R^2 + kappa W)/sqrt(-W).
    for _ in range(MAX_NEWTON):
        r, w = _orbit_end(*at_turning, kappa, rest)
        root = np.sqrt(-w)
        change = (r - v * root) / (w - v * r * r * (r * r + kappa * w) / root)
        rest = rest - change
        if np.max(abs(change)) < NEWTON_TOLERANCE:
            break
    return _Times(v, turning, rest)


@lru_cache(maxsize=1)
def _map() -> _Times:
    """Return the times on rays from v* = 0 over the upper half of the disc: starts of Newton's method for any panel.

    33 rays and 26 circles are at most 0.1 apart, so that Newton's method finds the end of the same sheet of eps.
    """
    rays = np.exp(1j * np.pi * np.linspace(0, 1, 33))  # angles 0 to pi: the lower half is the mirror image
    elastic = np.full(len(rays), 1.31 + 0j)  # half of the elastic duration (2/5) (5/4)^(1/5) B(1/5, 1/2) = 2.62
    circles = [_Times(0 * rays, elastic, elastic)]
    for size in np.linspace(0.04, 1.04, 26):  # |v*| in steps of 0.04 to the radius
        circles.append(_moved(circles[-1], size * rays))
    return _Times(*(np.concatenate(column) for column in zip(*circles, strict=True)))


def _times(square: Square) -> _Times:
    """Return the times at `TERMS` points on the rim of the square's panel, |v* - centre| = radius."""
    # From the nearest v* of the map to the panel's centre, in four quarters so that Newton's method stays on the sheet.
    start = _map()
    i = int(np.argmin(abs(start.v - square.centre)))
    times = _Times(*(column[i : i + 1] for column in start))
    for way in np.linspace(0.25, 1, 4):
        times = _moved(times, start.v[i] + way * (square.centre - start.v[i : i + 1]))
    # From the centre to the rim: TERMS values determine TERMS coefficients in z.
    circle = float(square.radius) * np.exp(2j * np.pi * np.arange(TERMS) / TERMS)
    return _moved(_Times(*(np.repeat(column, TERMS) for column in times)), square.centre + circle)


def _coefficients(values: Array) -> Array:
    """Return coefficients in z from the values at the roots of unity z = exp(2 pi i k/TERMS) (last axis)."""
    return np.asarray(np.fft.fft(values) / values.shape[-1])


def _steps(r: Array, w: Array, kappa: Array, duration: Array) -> int:
    """Return the number of pieces of a leg whose coefficients of y^ORDER are at most `LAST_IN_Y`.

    `r` and `w` are R and W at the leg's start, on the panel's rim, and `duration` its length in s.
    """
    # The largest coefficient of y^ORDER in a trial with DRAFT_STEPS steps.
    largest = 0.0
    for _ in range(DRAFT_STEPS):
        coefficients = _taylor(r, w, kappa, duration / DRAFT_STEPS)
        largest = max(largest, *(np.max(abs(c[-1])) for c in coefficients))
        r, w = (c.sum(0) for c in coefficients)
    # It grows with the ORDER-th power of a step's length, which is duration/(ADVANCE count) for `count` pieces.
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
    """Pieces s = s_j + h(z) y of one length h(z) each, one after the other: s_(j+1) = s_j + ADVANCE h(z)."""

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
    """Return approximate orbits on the square's panel, as polynomials in y and z.

    Raises
    ------
    ArithmeticError
        If the coefficients in y or z fall too slowly, as near a singularity.
    """
    # Values on the rim of the panel, at v* = c + d exp(2 pi i k/TERMS).
    v, *durations = _times(square)
    r, w = 0 * v, 1 + 0 * v
    powers = float(ADVANCE) ** np.arange(ORDER + 1)  # values of y^j at the end of a piece
    legs = []
    for duration in durations:
        count = _steps(r, w, v * v, duration)
        # h(z) is cut off after STEP_TERMS powers; the pieces use the cut one, whose values on the rim ifft gives.
        # fft and ifft are inverse but for the factor TERMS.
        h = _coefficients(duration / (float(ADVANCE) * count))[:STEP_TERMS]
        leg = _Leg(BivariateBall.rounded(h[None]), [])
        for _ in range(count):
            series = _taylor(r, w, v * v, TERMS * np.fft.ifft(h, TERMS))
            leg.pieces.append(_Piece(*(BivariateBall.rounded(_coefficients(c)) for c in series)))
            r, w = (np.tensordot(powers, c, 1) for c in series)
        legs.append(leg)
    # The last four coefficients in z of W at the end: four, because a single one can vanish by chance.
    if not np.max(abs(_coefficients(w)[-4:])) < LAST_IN_Z:
        raise ArithmeticError("the panel comes too close to a singularity")
    return _Draft(legs, BivariateBall.rounded(_coefficients(np.sqrt(-w))[None]))


# --- balls of functions of y and z ------------------------------------------------------------------------------------


@dataclass(frozen=True)
class BivariateBall:
    """Ball of functions: all functions within `error` of a polynomial in y and z on |y| <= 1, |z| <= 1.

    It is `function_balls.FunctionBall` with two variables and complex integers; those of z^i y^j stand at i + STRIDE j
    of `re` and `im`. (So one product of long integer polynomials is the product in both variables: Kronecker's
    substitution.) Everything is in units of 2^-BITS. There are at most TERMS powers of z and ORDER + 1 powers of y.
    """

    re: fmpz_poly
    im: fmpz_poly
    error: int = 0

    @classmethod
    def rounded(cls, rows: Array) -> BivariateBall:
        """Return the polynomial with these coefficients, cut to whole units: one row for each power of y, z along it.

        The rounded polynomial is the draft; its error is 0 by definition, and the residual contains what it is off.
        """
        table = np.zeros((len(rows), STRIDE), complex)
        table[:, : rows.shape[1]] = rows * 2.0**BITS
        if not np.isfinite(table).all():
            raise ArithmeticError("no draft was found")
        re, im = (fmpz_poly([int(c) for c in numbers.ravel()]) for numbers in (table.real, table.imag))
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
        """Return the product with another function; truncation and rounding are added to the error."""
        # (p + i q)(r + i s) with three products: p r - q s and (p + q)(r + s) - p r - q s.
        a, b = self.re * other.re, self.im * other.im
        (re, re_cut), (im, im_cut) = map(_cut, (a - b, (self.re + self.im) * (other.re + other.im) - a - b))
        # In units of 2^-(2 BITS): what was cut off, and e_1 e_2 + e_1 |f_2| + e_2 |f_1| (sizes only if needed).
        error = re_cut + im_cut + self.error * other.error
        error += (self.error and self.error * sum(other.sizes)) + (other.error and other.error * sum(self.sizes))
        # 1: the shift rounds down. A unit for each rounded coefficient, TERMS (ORDER + 1) of `re`, as many of `im`.
        return BivariateBall(re, im, (error >> BITS) + 1 + 2 * TERMS * (ORDER + 1))

    def times(self, number: int) -> BivariateBall:
        """Return the function times a number."""
        return BivariateBall(self.re * number, self.im * number, self.error * abs(number))

    def slope(self) -> BivariateBall:
        """Return the derivative of a polynomial by y."""
        if self.error:  # functions within it may have any derivative
            raise ValueError("only polynomials have a known slope")
        return BivariateBall(_slope(self.re), _slope(self.im))

    def first(self) -> BivariateBall:
        """Return the function of z at y = 0: the first row of coefficients."""
        re, im = (fmpz_poly(numbers.coeffs()[:STRIDE]) for numbers in (self.re, self.im))
        return BivariateBall(re, im, self.error)

    def advanced(self) -> BivariateBall:
        """Return the function of z at y = ADVANCE."""
        # One unit for each of TERMS rounded coefficients of `re` and of `im`.
        return BivariateBall(_advanced(self.re), _advanced(self.im), self.error + 2 * TERMS)

    @cached_property
    def sizes(self) -> list[int]:
        """Bounds of the polynomial's coefficient of each power of y for |z| <= 1: sums of |a + i b|, rounded up."""
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
        """Return a function of z alone as a polynomial whose coefficients are balls; its error is in the first one."""
        length = max(len(self.re), len(self.im))
        coefficients = [acb(_unit(int(self.re[i])), _unit(int(self.im[i]))) for i in range(length)]
        error = arb(0, _unit(self.error))
        return acb_poly(coefficients) + acb(error, error)


def _unit(number: int) -> arb:
    """Return a number of units of 2^-BITS as a ball."""
    return fixed_point(number, 0, BITS)


def _rows(packed: fmpz_poly, length: int = 0) -> list[list[fmpz]]:
    """Return the coefficients of each power of y, those of z^0 … z^(STRIDE - 1), from `re` or `im` of a ball.

    There are at least as many rows as a packed polynomial of this `length` has, and at least one; zeros fill the last.
    """
    coefficients = packed.coeffs()
    rows = -(-max(len(coefficients), length, 1) // STRIDE)  # division rounded up
    coefficients += [fmpz(0)] * (rows * STRIDE - len(coefficients))
    return [coefficients[STRIDE * j : STRIDE * (j + 1)] for j in range(rows)]


def _cut(packed: fmpz_poly) -> tuple[fmpz_poly, int]:
    """Return `re` or `im` of a product in units of 2^-BITS, without its high powers, and a bound of what was left out.

    The product comes, and the bound is, in units of 2^-(2 BITS). Kept are TERMS powers of z and ORDER + 1 of y, rounded
    down; the bound is the sum of the moduli of all others.
    """
    rows, blank = _rows(packed), [fmpz(0)] * (STRIDE - TERMS)
    kept = [c for row in rows[: ORDER + 1] for c in [c >> BITS for c in row[:TERMS]] + blank]
    dropped = [row[TERMS:] for row in rows[: ORDER + 1]] + rows[ORDER + 1 :]
    return fmpz_poly(kept), int(sum(sum(map(abs, row)) for row in dropped))


def _slope(packed: fmpz_poly) -> fmpz_poly:
    """Return the derivative by y of `re` or `im`: j times row j, which becomes row j - 1."""
    return fmpz_poly([j * c for j, row in enumerate(_rows(packed)) for c in row][STRIDE:])


def _advanced(packed: fmpz_poly) -> fmpz_poly:
    """Return the coefficients in z of `re` or `im` at y = ADVANCE, rounded down: sum of row j times ADVANCE^j.

    With ADVANCE = top/bottom the sum is made of integers over the common denominator bottom^degree.
    """
    rows, (top, bottom) = _rows(packed), ADVANCE.as_integer_ratio()
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
        """Return z = (v* - centre)/radius of v* = x + i y."""
        return acb(*(ball_of((p - c) / self.square.radius) for p, c in ((x, self.square.x), (y, self.square.y))))


def _grown(h: BivariateBall, piece: _Piece, kappa: BivariateBall, errors: arb_mat) -> tuple[arb_mat, arb]:
    """Return bounds of the errors of R and W at y = ADVANCE, given those at y = 0, and one of f = R^2 (R^2 + kappa W).

    `errors` and the first result are columns (|R - R^|, |W - W^|), R^ and W^ being the draft's polynomials. That of
    |f| is for all orbits within TUBE of the piece; this function proves that all orbits are, for |y| <= 1.

    Raises
    ------
    ArithmeticError
        If an error may reach TUBE before y = 1.
    """
    # Residuals dR^/dy - h W^ and dW^/dy + 2 h f(R^, W^).
    square, damping = piece.R * piece.R, kappa * piece.W
    force = square * (square + damping)
    residuals = piece.R.slope() - h * piece.W, piece.W.slope() + h * force.times(2)

    # Bounds of df/dR = R (4 R^2 + 2 kappa W) and df/dW = kappa R^2 within TUBE of R^, W^, as polynomials in |y|. First
    # df/dR at R^, W^; then TUBE times the second derivatives 12 R^2 + 2 kappa W (by R) and 2 kappa R (by W).
    by_r = piece.R.majorant() * (square.times(4) + damping.times(2)).majorant()
    k, r, w = kappa.norm(), piece.R.majorant() + TUBE, piece.W.majorant() + TUBE
    by_r += TUBE * (12 * r * r + 2 * k * (r + w))
    by_w = k * r * r

    # Errors grow like e' <= |h| (0, 1; 2 |df/dR|, 2 |df/dW|) e + residuals (exact-function.md, (7)). With the residuals
    # added to e at the start, e at y = i/PARTS is at most exp(A_i/PARTS) times e at (i - 1)/PARTS; A_i has the maxima
    # for |y| <= i/PARTS.
    errors = errors + arb_mat([[residual.norm()] for residual in residuals])
    for i in range(1, PARTS + 1):
        y = arb(i) / PARTS
        rates = h.norm() * arb_mat([[0, 1], [2 * by_r(y), 2 * by_w(y)]])
        errors = (rates / PARTS).exp() * errors
        if i == ADVANCE * PARTS:
            advanced = errors
    if not (errors[0, 0] < TUBE and errors[1, 0] < TUBE):
        raise ArithmeticError("the residual is too large")
    return advanced, force.norm() + TUBE * (by_r(1) + by_w(1))  # mean value theorem, |y| <= 1


def _distance_of_end(
    draft: _Draft, v: BivariateBall, r: BivariateBall, w: BivariateBall, errors: arb_mat, acceleration: arb, reach: arb
) -> arb:
    """Return a bound of |s - E|, s the time of the true end of contact and E that of the draft's last point.

    Names as in exact-function.md, section 9: q^(z), the draft's sqrt(-W) at E, q_0 <= Re q^, and the end of contact as
    the zero of G = R - v* sqrt(-W), G' = W + v* W'/(2 sqrt(-W)).

    Parameters
    ----------
    draft : _Draft
    v : BivariateBall
        v* = c + d z.
    r, w : BivariateBall
        The draft's R(z) and W(z) at E.
    errors : arb_mat
        Bounds of the errors of r and of w, as a column.
    acceleration, reach : arb
        A bound of |W'| for |s - E| <= reach.

    Raises
    ------
    ArithmeticError
        If there is not proven to be exactly one zero of G with |s - E| <= reach.
    """
    root, kappa = draft.root, v * v
    norm, k, error_r, error_w = v.norm(), kappa.norm(), errors[0, 0], errors[1, 0]
    q = root.middle().real - root.variation()  # q_0
    # Bounds of |W + q^2|, at E and within reach. If it is below q_0^2/2, sqrt(-W) = q^ sqrt(1 + x), |x| <= 1/2, has a
    # positive real part and differs from q^ by at most |W + q^2|/q_0.
    here = (w + root * root).norm() + error_w
    around = here + reach * acceleration
    if not (q > 0 and around < q * q / 2):
        raise ArithmeticError("sqrt(eps) is not known well enough")
    # Bounds of |W|, and of |R| by |R'| = |W|, within reach.
    largest_w = w.norm() + error_w + reach * acceleration
    largest_r = r.norm() + error_r + reach * largest_w
    # Bound of |D|, D = R^2 + kappa W, at E, and within reach by |D'| = |2 R W + kappa W'|.
    balance = (r * r + kappa * w).norm() + 2 * largest_r * error_r + k * error_w
    balance += reach * (2 * largest_r * largest_w + k * acceleration)
    # |G(E)|, and |G' + q^2| = |W + q^2 - v* R^2 D/sqrt(-W)| within reach.
    value = (r - v * root).norm() + error_r + norm * here / q
    slope = around + norm * largest_r * largest_r * balance / (q - around / q)
    # If |G' + q^2| < q_0^2/2, the map s + G/q^2 contracts by 1/2, so its fixed point lies within twice its first step
    # |G(E)|/q_0^2. It is the only one if that is less than reach.
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
    # 20 bits more than the integers of the drafts have, so that bounds are not widened by rounding. NumPy's warnings
    # of overflow are not shown: drafts with infinite numbers are refused.
    with working(BITS + 20), np.errstate(all="ignore"):
        return _proven(square, _draft(square))


def _proven(square: Square, draft: _Draft) -> ProvenDisc:
    """Return the proof for a panel with this draft of its orbits; raise ArithmeticError if it fails."""
    v = BivariateBall.linear(square.x, square.y, square.radius)
    # Along the pieces: errors start with 0 at R = 0, W = 1, get the jump to the next piece's polynomials, and grow.
    r, w, errors = BivariateBall.linear(0), BivariateBall.linear(1), arb_mat([[0], [0]])
    for leg in draft.legs:
        for piece in leg.pieces:
            errors = errors + arb_mat([[(piece.R.first() - r).norm()], [(piece.W.first() - w).norm()]])
            errors, force = _grown(leg.h, piece, v * v, errors)
            r, w = piece.R.advanced(), piece.W.advanced()

    # REACH times the smallest |h(z)| of both legs. |W'| = 2 |f|, f of the last piece, which the end lies in.
    reach = min((ball_of(REACH) * (abs(leg.h.middle()) - leg.h.variation())).lower() for leg in draft.legs)
    acceleration = 2 * force
    distance = _distance_of_end(draft, v, r, w, errors, acceleration, reach)
    error = errors[1, 0] + distance * acceleration  # of eps = -W at the true end of contact
    turning, rest = (leg.duration for leg in draft.legs)
    return ProvenDisc(square, turning, turning + rest, reach, distance, -w.in_z(), error, (w.norm() + error).upper())


# --- the disc ---------------------------------------------------------------------------------------------------------


def proven_discs(radius: Fraction, squares: Iterable[Square] | None = None) -> Iterator[ProvenDisc]:
    """Yield proven panels whose squares cover the upper half of the disc |v*| <= radius, or its part in `squares`.

    A square that cannot be proven is divided into four.

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
    """Yield the largest squares, side by side, over -radius <= Re v* <= radius, 0 <= Im v* <= radius."""
    count = ceil(radius / (2 * LARGEST))  # squares from an axis to the rim; their centres are odd multiples of LARGEST
    for i in range(-count, count):
        for j in range(count):
            yield Square((2 * i + 1) * LARGEST, (2 * j + 1) * LARGEST, LARGEST)


def agree(first: ProvenDisc, second: ProvenDisc) -> bool:
    """Return whether two panels whose squares touch are proven to have the same eps on their overlap.

    At a point of both squares the second panel's path 0, turning, end of contact must be one of the first panel's
    paths, which end within `reach` of its own; or the first panel's path one of the second's.

    Raises
    ------
    ValueError
        If the squares do not touch.
    """
    point = first.square.common_point(second.square)
    if point is None:
        raise ValueError("the squares do not touch")
    with working(BITS + 20):  # as in the proofs of the panels
        z_first, z_second = first.z(*point), second.z(*point)
        turning = abs(first.turning(z_first) - second.turning(z_second))
        end = abs(first.end(z_first) - second.end(z_second))
        return any(turning < a.reach and end + b.distance < a.reach for a, b in ((first, second), (second, first)))


def starts_elastically(panel: ProvenDisc) -> bool:
    """Return whether the panel's end of contact at v* = 0 is proven to be the end of the elastic collision."""
    with working(BITS + 20):  # as in the proofs of the panels
        z = panel.z(Fraction(0), Fraction(0))
        # At v* = 0, W^2 = 1 - 4/5 R^5, so contact lasts s_0 = 2/5 (5/4)^(1/5) B(1/5, 1/2), the Beta function
        # B(1/5, 1/2) = Gamma(1/5) sqrt(pi)/Gamma(7/10). The path 0, Re turning, s_0 is real: Im turning is in reach.
        duration = 2 * (arb(5) / 4).root(5) * (arb(1) / 5).gamma() * arb.pi().sqrt() / (5 * (arb(7) / 10).gamma())
        return bool(abs(panel.turning(z).imag) < panel.reach and abs(panel.end(z) - duration) < panel.reach)


class Theorem(NamedTuple):
    """Theorem: eps is analytic for |v*| <= radius, with |eps| <= bound there, so |h_k| <= bound/radius^k."""

    radius: Fraction
    bound: arb
    panels: list[ProvenDisc]


def theorem(radius: Fraction = RADIUS) -> Theorem:
    """Return the theorem for a radius, proven.

    Raises
    ------
    ArithmeticError
        If the proof fails.
    """
    panels = list(proven_discs(radius))
    # One function on the whole half disc: touching panels have the same eps. It is that of the series: at v* = 0 it
    # begins with the elastic collision.
    touching = [pair for pair in combinations(panels, 2) if pair[0].square.common_point(pair[1].square)]
    at_zero = [panel for panel in panels if panel.square.nearest() == 0]
    if not (all(agree(*pair) for pair in touching) and all(map(starts_elastically, at_zero))):
        raise ArithmeticError("two panels do not agree")
    # The largest |eps| on the circle |v*| = radius, from the panels whose squares reach it.
    bound = max(panel.bound for panel in panels if panel.square.farthest() >= radius**2)
    return Theorem(radius, bound, panels)


def main() -> None:
    """Prove that the series converges for |v*| up to a radius, and print the bound of |eps| there."""
    parser = argparse.ArgumentParser(description=main.__doc__)
    parser.add_argument("radius", nargs="?", type=Fraction, default=RADIUS)
    start = time.perf_counter()
    radius, bound, panels = theorem(parser.parse_args().radius)
    bound_up = ceil(float(bound) * 100) / 100  # rounded up to two decimals
    print(f"eps is analytic for |v*| <= {float(radius)}, and there |eps| <= {bound_up}")
    print(f"{len(panels)} panels, {time.perf_counter() - start:.0f} s")


if __name__ == "__main__":
    main()
