r"""The singularity of eps(v*) nearest to v* = 0, which ends the convergence of the series, found in two ways.

`derivations/09_singularity.py` derives it. With the damping as unit of speed every collision is an orbit of

    z' = g,    g' = z^2 (g - z^2),    from z = 0, g = -4 v*^10, to the end of contact at g = z^2 = 4 v*^10 eps,

and eps becomes infinite where the end of contact does: on the creeping orbit g = z^2 + 2 z + 6 + 16/z + …. So a
singular v* is a complex point where the creeping orbit, followed in complex time, passes z = 0 (`from_flow`).
The other way uses no equation of motion, only the proven h_k (`from_coefficients`). The two agree, but their digits
are not proven. That no singularity has |v*| <= 1.04 is proven (`viscopade_lab.convergence`); that no other one lies
between there and R is seen in the coefficients only.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any, NamedTuple, SupportsIndex

from flint import acb, acb_poly, arb, arb_mat, arb_series
from mpmath import mp

from viscopade import arguments
from viscopade.arithmetic.balls import bits_for, to_mpf, working
from viscopade.theory.law import Law
from viscopade.theory.pade import _product_coefficient, order_system
from viscopade.theory.series import series

# Time on the creeping orbit from its arrival at z = 0 to the singular start, to 2 digits. Found by search; the other
# zeros are on other sheets of eps, or belong to singularities farther from v* = 0.
TIME_GUESS = -0.06 - 0.72j
# Terms of the creeping orbit's expansion in 1/z; its start z is as large, where they are below 10^-50.
EXPANSION_TERMS = 100
# A Taylor step is this part of the radius of convergence.
STEP = 0.1
MOST_DIGITS = 40
SERIES_ORDER, LEAST_ORDER = 120, 60
MAX_NEWTON = 60
COMMON = 0.03  # relative distance of poles that are taken for one
CARRIED_DIGITS = 50


@dataclass(frozen=True)
class Singularity:
    """The singularity of eps(v*) nearest to v* = 0, in the upper half plane; its mirror image is one, too.

    Attributes
    ----------
    v_star : mpmath.mpc
    uncertainty : mpmath.mpf
        Estimate of the relative error; not proven.
    """

    v_star: mp.mpc
    uncertainty: mp.mpf

    @property
    def radius(self) -> mp.mpf:
        """R = |v*|, the radius of convergence of eq:epsSeriesAdvanced if no other singularity is nearer."""
        return abs(_context().mpc(self.v_star))

    @property
    def argument(self) -> mp.mpf:
        """The argument Arg(v*)/pi: the signs of h_k repeat about every 2/argument coefficients."""
        ctx = _context()
        return ctx.arg(self.v_star) / ctx.pi


def _context(digits: int = CARRIED_DIGITS) -> Any:
    """Return an mpmath context of its own."""
    ctx = mp.clone()
    ctx.dps = digits
    return ctx


# --- from the equation of motion --------------------------------------------------------------------------------------


class _Point(NamedTuple):
    """A point of the flow."""

    z: acb
    g: acb


@dataclass(frozen=True)
class _TaylorFlow:
    """The flow by Taylor steps; rounding and truncation are not enclosed. To be used within `working`."""

    order: int

    def taylor(self, start: _Point) -> tuple[list[acb], list[acb]]:
        z, g = [start.z], [start.g]
        squares: list[acb] = []
        differences: list[acb] = []
        for n in range(self.order):
            squares.append(_convolution(z, z, n))
            differences.append(g[n] - squares[n])
            z.append(g[n] / (n + 1))
            g.append(_convolution(squares, differences, n) / (n + 1))
        return z, g

    def moved(self, point: _Point, time: acb) -> _Point:
        """Follow the flow for a complex time, straight."""
        while True:
            coefficients = self.taylor(point)
            length, left = self._step(coefficients), _size(time)
            step = time if left <= length else _middle(time * (length / left))
            point = _Point(*(_at(c, step) for c in coefficients))
            if left <= length:
                return point
            time = _middle(time - step)

    def _step(self, coefficients: tuple[list[acb], ...]) -> float:
        return min(STEP * _size(c[-1]) ** (-1 / self.order) if c[-1] != 0 else 1.0 for c in coefficients)

    def to_zero(self, point: _Point, time: acb, tolerance: float) -> _Point:
        """Return where the flow passes z = 0, about `time` later, by Newton's method."""
        for _ in range(MAX_NEWTON):
            there = self.moved(point, time)
            change = _middle(there.z / there.g)
            time = _middle(time - change)
            if _size(change) < tolerance:
                return self.moved(point, time)
        raise ArithmeticError("no zero found")

    def creeping(self, tolerance: float) -> _Point:
        """Return the creeping orbit's arrival at z = 0."""
        c = [1]
        for j in range(1, EXPANSION_TERMS):
            c.append((5 - j) * sum(c[i] * c[j - 1 - i] for i in range(j)) // 2)
        z = acb(EXPANSION_TERMS)
        point = _Point(z, _middle(z**2 * _at([acb(x) for x in c], 1 / z)))
        while float(point.z.real.mid()) > 0.5:
            coefficients = self.taylor(point)
            step = acb(-self._step(coefficients))
            point = _Point(*(_at(x, step) for x in coefficients))
        return self.to_zero(point, _middle(-point.z / point.g), tolerance)


def from_flow(digits: SupportsIndex = 30) -> Singularity:
    """Find the singularity on the creeping orbit, to about `digits` digits.

    Parameters
    ----------
    digits : int
        10 to 40.

    Raises
    ------
    TypeError, ValueError
        If `digits` is not an integer or out of range.
    """
    digits = arguments.integer("digits", digits, 10, MOST_DIGITS)
    order = digits + 10  # a step of a tenth of the radius loses a digit a term
    tolerance = 10.0 ** (-digits / 2 - 2)  # the step of Newton's method that follows is the square of it
    with working(bits_for(digits + 15)):
        flow = _TaylorFlow(order)
        arrival = flow.creeping(tolerance)
        w = -flow.to_zero(_Point(acb(0), arrival.g), acb(TIME_GUESS.real, TIME_GUESS.imag), tolerance).g / 4
        ctx = _context()
        w_s = ctx.mpc(to_mpf(w.real), to_mpf(w.imag))
        rough = complex(from_four(_floats()))
        v_star = min((ctx.root(w_s, 10, n) for n in range(10)), key=lambda v: abs(complex(v) - rough))
    return Singularity(v_star, mp.mpf(10) ** -digits)


def _middle(number: acb) -> acb:
    return acb(number.real.mid(), number.imag.mid())


def _size(number: acb) -> float:
    return float(abs(number).mid())


def _convolution(a: Sequence[acb], b: Sequence[acb], n: int) -> acb:
    return sum((a[i] * b[n - i] for i in range(n + 1)), acb(0))


def _at(coefficients: Sequence[acb], x: acb) -> acb:
    total = acb(0)
    for c in reversed(coefficients):
        total = total * x + c
    return _middle(total)


# --- from the coefficients --------------------------------------------------------------------------------------------


def from_coefficients(order: SupportsIndex = SERIES_ORDER) -> Singularity:
    """Find the singularity from h_0 … h_order alone; 5 digits come from order 120.

    Four successive h_k give it to 3 digits: h_{k+1} = 2 cos(arg)/R h_k - h_{k-1}/R^2 were it a pair of simple poles of
    v* eps'. In truth it is logarithmic, eps ~ (ln(1 - v*/v_s))^2, and what is nearly analytic, with a simple zero at
    v_s, is z^5 e^(-z) for z = 2 v*^5 sqrt(eps). That zero is taken from a Padé approximant of its series, and its
    uncertainty from what three quarters of the orders would have given.

    Parameters
    ----------
    order : int
        60 to 1000.

    Raises
    ------
    TypeError, ValueError
        If `order` is not an integer or out of range.
    """
    order = arguments.integer("order", order, LEAST_ORDER, arguments.MAX_ORDER)
    digits = order // 2
    h = series(order, digits).h
    guess = from_four([float(h_k.mid()) for h_k in h])
    with working(bits_for(3 * order), order + 1):
        z = arb_series([arb(0)] * 5 + [arb(2)], order + 1) * arb_series([h_k.mid() for h_k in h], order + 1).sqrt()
        # z^5 e^-z starts with v*^25: the factor that vanishes at v* = 0 is left out.
        f = [c.mid() for c in (z**5 * (-z).exp()).coeffs()[25:]]
        n = (len(f) - 1) // 2
        v_star, rough = (_pade_zero(f, degree, guess) for degree in (n, 3 * n // 4))
    return Singularity(v_star, abs(rough / v_star - 1))


def from_four(h: Sequence[float]) -> complex:
    """Return 1/t for the root t of t^2 = p t - q, k h_k being made of its powers."""
    c = [k * h_k for k, h_k in enumerate(h)][-4:]
    determinant = c[1] ** 2 - c[0] * c[2]
    p, q = (c[1] * c[2] - c[0] * c[3]) / determinant, (c[2] ** 2 - c[1] * c[3]) / determinant
    return 1 / complex(p / 2, -((q - p * p / 4) ** 0.5))


def _pade_zero(f: Sequence[arb], n: int, guess: complex) -> mp.mpc:
    """Return the zero of [n/n] of a series that Newton's method finds from `guess`."""
    matrix, right = order_system(f, n, n, arb(0))
    # By FLINT alone: from order 1000 come 487 unknowns, for which mpmath's elimination takes minutes.
    b = [arb(1), *arb_mat(n, n, matrix).solve(arb_mat(n, 1, right), algorithm="precond").entries()]
    ctx = _context(3 * len(f))
    a = [ctx.mpf(to_mpf(_product_coefficient(b, f, k).mid())) for k in range(n, -1, -1)]
    v = ctx.mpc(guess)
    for _ in range(MAX_NEWTON):
        value, slope = ctx.polyval(a, v, derivative=True)
        v -= value / slope
        if abs(value / slope) < 1e-20:
            return +_context().mpc(v)
    raise ArithmeticError(f"[{n}/{n}] has no zero near {guess}")


def nearest(law: Law | str, order: SupportsIndex = LEAST_ORDER) -> Singularity:
    """Find the singularity nearest to v* = 0 for any law of contact, to two or three digits, from h_0 … h_order.

    The nearest pole of the Padé approximant [n-1/n] of d ln eps/dv* that two thirds of the orders give, too: a pole of
    one approximant alone is an artefact. The difference of the two is the uncertainty. `from_flow` and
    `from_coefficients` know the kind of the singularity of the paper's law, and are far more accurate.

    Parameters
    ----------
    law : Law or str
        Law of contact (`law_of`); v* = kappa^(1/law.d).
    order : int
        60 to 1000.

    Raises
    ------
    TypeError, ValueError
        If `order` is not an integer or out of range, or there is no such law.
    ArithmeticError
        If no pole is common to both approximants.
    """
    order = arguments.integer("order", order, LEAST_ORDER, arguments.MAX_ORDER)
    h = series(order, order, law).h
    with working(bits_for(3 * order), order + 1):
        f = arb_series([h_k.mid() for h_k in h], order + 1)
        rates = [c.mid() for c in (f.derivative() / f).coeffs()]
        n = len(rates) // 2
        few, many = (_poles(rates, degree) for degree in (2 * n // 3, n))
        for pole in many:
            distance = min(_size(pole - other) for other in few) / _size(pole)
            if distance < COMMON:
                break
        else:
            raise ArithmeticError("no singularity is common to two approximants")
    value = _context().mpc(to_mpf(pole.real), to_mpf(abs(pole.imag)))
    return Singularity(mp.mpc(value), mp.mpf(distance))


def _poles(f: Sequence[arb], n: int) -> list[acb]:
    """Return the poles of [n-1/n] of a series, nearest to 0 first; they are not enclosed."""
    matrix, right = order_system(f, n - 1, n, arb(0))
    b = [arb(1), *arb_mat(n, n, matrix).solve(arb_mat(n, 1, right), algorithm="approx").entries()]
    found = acb_poly([c.mid() for c in b]).roots(tol=1e-12)
    return sorted(map(_middle, found), key=_size)


def _floats() -> list[float]:
    return [float(h_k.mid()) for h_k in series(SERIES_ORDER, SERIES_ORDER // 2).h]
