r"""The singularity of eps(v*) nearest to v* = 0, which limits the convergence of the series, by two independent routes.

`derivations/09_singularity.py` derives it. With the damping as unit of speed every collision is an orbit of

    z' = g,    g' = z^2 (g - z^2),    from z = 0, g = -4 v*^10, to the end of contact at g = z^2 = 4 v*^10 eps,

and eps becomes infinite where the end of contact does: on the creeping orbit g = z^2 + 2 z + 6 + 16/z + …. So a
singular v* is a complex point where the creeping orbit, followed in complex time, passes z = 0 (`from_flow`).
The other way uses no equation of motion, only the proven h_k (`from_coefficients`). The two agree, but their digits
are not proven. It is proven that no singularity has |v*| <= 1.04 (`viscopade_lab.convergence`). Between there and R
only the coefficients show that there is no other one.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from functools import lru_cache
from typing import Any

from flint import acb, arb, arb_mat, arb_poly, arb_series
from mpmath import mp

from viscopade.arithmetic.balls import bits_for, to_mpf, working
from viscopade.theory.pade import order_system
from viscopade.theory.series import series

# Time on the creeping orbit from its arrival at z = 0 to the singular start, to 2 digits, from a search. The other
# zeros are on other sheets of eps, or belong to singularities farther from v* = 0.
TIME_GUESS = -0.06 - 0.72j
# Terms of the creeping orbit's expansion in 1/z; its start z is as large. There the terms fall to 10^-54.8 at the
# hundredth, and grow after some ten more: the expansion is asymptotic.
EXPANSION_TERMS = 100
STEP = 0.1  # length of a Taylor step in radii of convergence: a term gains one digit
SERIES_ORDER = 120  # 5 digits; docs and claims print 4 to 6 of the radius, the last ones from the flow
GUESS_ORDER = 40  # gives the singularity to 1 %, which tells ten roots apart
MAX_NEWTON = 60  # at most 8 steps are needed (quadratic convergence from 2 digits); more mean a wrong guess
CARRIED_DIGITS = 50  # of mpmath's numbers: 10 more than the 40 that `from_flow` gives at most


@dataclass(frozen=True)
class Singularity:
    """The singularity of eps(v*) nearest to v* = 0 in the upper half plane; its mirror image is also a singularity.

    Attributes
    ----------
    v_star : mpmath.mpc
        The singularity, dimensionless as v* is.
    uncertainty : mpmath.mpf
        Estimate of the relative error; not proven.
    """

    v_star: mp.mpc
    uncertainty: mp.mpf

    @property
    def radius(self) -> mp.mpf:
        """R = |v*|, the radius of convergence of the paper's Eq. 7 if no other singularity is nearer."""
        return abs(_context().mpc(self.v_star))

    @property
    def argument(self) -> mp.mpf:
        """The argument Arg(v*)/pi: the signs of h_k repeat about every 2/argument coefficients."""
        ctx = _context()
        return ctx.arg(self.v_star) / ctx.pi


def _context(digits: int = CARRIED_DIGITS) -> Any:
    """Return a separate mpmath context of so many decimal digits; the precision of the global one stays as it is."""
    ctx = mp.clone()
    ctx.dps = digits
    return ctx


# --- from the equation of motion --------------------------------------------------------------------------------------


@lru_cache(maxsize=8)  # more orders and digits than one session asks for
def from_flow(digits: int = 30) -> Singularity:
    """Return the singularity from the creeping orbit, to about `digits` digits, 10 to 40."""
    # 15 digits more than those of the result: 10 of the Taylor steps' order, and 5 for rounding.
    with working(bits_for(digits + 15)):
        w = -_TaylorFlow(digits).singular_start() / 4  # the start is g = -4 w, w = v*^10
        ctx = _context()
        w_s = ctx.mpc(to_mpf(w.real), to_mpf(w.imag))
        # Of the ten roots v* = w^(1/10) the one next to the estimate from h_37 … h_40; 20 digits are more than enough.
        h = [float(h_k.mid()) for h_k in series(GUESS_ORDER, GUESS_ORDER // 2).h]
        v_star = min((ctx.root(w_s, 10, n) for n in range(10)), key=lambda v: abs(complex(v) - from_four(h)))
    return Singularity(v_star, mp.mpf(10) ** -digits)


class _TaylorFlow:
    """The flow z' = g, g' = z^2 (g - z^2) by Taylor steps; rounding and truncation are not enclosed.

    To be used within `working`. A point is (z, g), complex.
    """

    def __init__(self, digits: int) -> None:
        # With steps of 0.1 radii of convergence a term gains a digit; 10 more for sums over some hundred steps.
        self.order = digits + 10
        # Of the last but one step of Newton's method: the error after it is its square, 4 digits below the result's.
        self.tolerance = 10.0 ** (-digits / 2 - 2)

    def singular_start(self) -> acb:
        """Return g where the creeping orbit, followed in complex time from its arrival, passes z = 0 again."""
        # The creeping orbit g = z^2 (c_0 + c_1/z + …), c_0 = 1, from g dg/dz = z^2 (g - z^2):
        # c_j = (5 - j)/2 sum c_i c_(j-1-i), all of them integers: 1, 2, 6, 16, ….
        c = [1]
        for j in range(1, EXPANSION_TERMS):
            c.append((5 - j) * sum(c[i] * c[j - 1 - i] for i in range(j)) // 2)
        z = acb(EXPANSION_TERMS)
        point = z, _middle(z**2 * _polynomial([acb(c_j) for c_j in c], 1 / z))

        # Back along it with real steps until z = 0 is close, then to z = 0. Any end between 0 and the radius of
        # convergence of the last step would do instead of 0.5.
        while float(point[0].real.mid()) > 0.5:
            point = self.step(point, acb(-1))[0]
        arrival = self.to_zero(point, _middle(-point[0] / point[1]))  # first guess of the time: -z/z'

        # From there in complex time to the next z = 0: the start of the collision whose contact does not end.
        return self.to_zero((acb(0), arrival), acb(TIME_GUESS.real, TIME_GUESS.imag))

    def to_zero(self, start: tuple[acb, acb], time: acb) -> acb:
        """Return g where the flow from `start` passes z = 0, about a complex `time` later, by Newton's method."""
        for _ in range(MAX_NEWTON):
            z, g = self.moved(start, time)  # z' = g
            change = _middle(z / g)
            time = _middle(time - change)
            if _size(change) < self.tolerance:
                return self.moved(start, time)[1]
        raise ArithmeticError("Newton's method does not reach z = 0")

    def moved(self, point: tuple[acb, acb], time: acb) -> tuple[acb, acb]:
        """Return the point after a complex time, followed straight."""
        while time != 0:
            point, step = self.step(point, time)
            time = _middle(time - step)
        return point

    def step(self, point: tuple[acb, acb], time: acb) -> tuple[tuple[acb, acb], acb]:
        """Return the point after a step towards `time`, and the step: not longer than the Taylor series is accurate."""
        # Taylor coefficients: (n+1) z_(n+1) = g_n, (n+1) g_(n+1) = sum (z^2)_i (g - z^2)_(n-i).
        z, g = [point[0]], [point[1]]
        squares: list[acb] = []
        differences: list[acb] = []
        for n in range(self.order):
            squares.append(sum((z[i] * z[n - i] for i in range(n + 1)), acb(0)))
            differences.append(g[n] - squares[n])
            z.append(g[n] / (n + 1))
            g.append(sum((squares[i] * differences[n - i] for i in range(n + 1)), acb(0)) / (n + 1))
        # |c_n|^(-1/n) of the last coefficient estimates the radius of convergence.
        length = min(STEP * _size(c[-1]) ** (-1 / self.order) for c in (z, g))
        step = time if _size(time) <= length else _middle(time * (length / _size(time)))
        return (_polynomial(z, step), _polynomial(g, step)), step


def _middle(number: acb) -> acb:
    """Return the middle of a ball as a ball of radius 0, so that radii, which mean nothing here, do not grow."""
    return acb(number.real.mid(), number.imag.mid())


def _size(number: acb) -> float:
    """Return the modulus of a ball's middle."""
    return float(abs(number).mid())


def _polynomial(coefficients: Sequence[acb], x: acb) -> acb:
    """Return the middle of sum c_n x^n, by Horner's scheme."""
    value = acb(0)
    for c in reversed(coefficients):
        value = value * x + c
    return _middle(value)


# --- from the coefficients --------------------------------------------------------------------------------------------


@lru_cache(maxsize=8)  # more orders and digits than one session asks for
def from_coefficients(order: int = SERIES_ORDER) -> Singularity:
    """Return the singularity from h_0 … h_order alone, order 60 to 1000; 5 digits come from order 120.

    Four successive h_k give it to 3 digits: h_{k+1} = 2 cos(arg)/R h_k - h_{k-1}/R^2 would hold for a pair of simple
    poles of v* eps'. In fact it is logarithmic, eps ~ (ln(1 - v*/v_s))^2, and the nearly analytic function with a
    simple zero at v_s is z^5 e^(-z) for z = 2 v*^5 sqrt(eps). That zero is taken from a Padé approximant of its
    series; its uncertainty is the difference from the result of three quarters of the orders.
    """
    # Half as many digits as orders: the order conditions of [n/n], n = order/2, lose less (60 digits for order 120).
    h = series(order, order // 2).h
    guess = from_four([float(h_k.mid()) for h_k in h])
    # From here on the middles of h_k count as exact, and 3 digits for each order make rounding invisible.
    with working(bits_for(3 * order), order + 1):
        # z = 2 v*^5 sqrt(eps) at the end of contact, where g = z^2 = 4 v*^10 eps.
        z = arb_series([arb(0)] * 5 + [arb(2)], order + 1) * arb_series([h_k.mid() for h_k in h], order + 1).sqrt()
        # z^5 e^-z starts with v*^25: the factor that vanishes at v* = 0 is left out.
        f = [c.mid() for c in (z**5 * (-z).exp()).coeffs()[25:]]
        n = (len(f) - 1) // 2  # [n/n] needs 2 n + 1 coefficients
        v_star, rough = (_pade_zero(f, degree, guess) for degree in (n, 3 * n // 4))
    return Singularity(v_star, abs(rough / v_star - 1))


def from_four(h: Sequence[float]) -> complex:
    """Return an estimate of the singularity with Im v* > 0 from the last four coefficients h_k.

    Simple poles of v* eps' at 1/t and its conjugate would make k h_k = c t^k + conjugate, so that
    (k+1) h_(k+1) = p k h_k - q (k-1) h_(k-1), where t^2 = p t - q. Two such equations give p and q.
    """
    c = [k * h_k for k, h_k in enumerate(h)][-4:]
    determinant = c[1] ** 2 - c[0] * c[2]
    # c_2 = p c_1 - q c_0, c_3 = p c_2 - q c_1, by Cramer's rule; then t = p/2 - i sqrt(q - p^2/4), 1/t above the axis.
    p, q = (c[1] * c[2] - c[0] * c[3]) / determinant, (c[2] ** 2 - c[1] * c[3]) / determinant
    return 1 / complex(p / 2, -((q - p * p / 4) ** 0.5))


def _pade_zero(f: Sequence[arb], n: int, guess: complex) -> mp.mpc:
    """Return the zero near `guess` of the Padé approximant [n/n] of the series sum f_k v*^k.

    Raises
    ------
    ArithmeticError
        If Newton's method does not converge.
    """
    # Denominator 1 + b_1 v* + … from the order conditions n+1 … 2n, a linear system; numerator a = b f to v*^n.
    matrix, right = order_system(f, n, n, arb(0))
    # FLINT only: order 1000 means 487 unknowns, for which mpmath's elimination takes minutes.
    b = [arb(1), *arb_mat(n, n, matrix).solve(arb_mat(n, 1, right), algorithm="precond").entries()]
    ctx = _context(3 * len(f))  # 3 digits for each coefficient, as the caller's balls have
    product = arb_poly(b) * arb_poly(f[: n + 1])
    a = [ctx.mpf(to_mpf(product[k].mid())) for k in range(n, -1, -1)]
    v = ctx.mpc(guess)
    for _ in range(MAX_NEWTON):
        value, slope = ctx.polyval(a, v, derivative=True)
        v -= value / slope
        if abs(value / slope) < 1e-20:  # far below the error of [n/n], 1e-5 for order 120
            return +_context().mpc(v)
    raise ArithmeticError(f"[{n}/{n}] has no zero near {guess}")
