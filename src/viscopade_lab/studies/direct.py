"""The collision integrated in time: the independent second route to the exact function.

`collide` follows the scaled equation of motion (the paper's Eq. 9)

    x'' + x^(3/2) + kappa x' sqrt(x) = 0,    x(0) = 0,  x'(0) = 1,  kappa = v*^2,

forwards from first contact to the end, which is x'' = 0 (the paper's Eq. 6) unless the older end x = 0 is asked for.
Nothing is shared with `viscopade.collision.exact`: no turning point as origin, no parametrised curve, no FLINT and no
balls. It is not proven; a run with more digits and another order checks it.

The square root makes x(tau) singular at x = 0, and only there. With s = sqrt(x), u = dx/dtau and the stretched time
dtau = 2 s dtheta the motion becomes polynomial,

    ds/dtheta = u,    du/dtheta = -2 s^2 (s^2 + kappa u),    dtau/dtheta = 2 s,    s(0) = 0, u(0) = 1, tau(0) = 0,

so s, u and tau are analytic in theta through first contact and through x = 0 at the other end. There is one recursion
for all of it, and a step's length follows from how fast its coefficients decay. `collide_by` does the same for any law
of contact (a, b), with x = s^m, dtau = m s^(m-1) dtheta and du/dtheta = -m (s^(m(a+1)-1) + kappa u s^(m(b+1)-1)).
"""

from __future__ import annotations

import itertools
import math
from collections.abc import Callable
from dataclasses import dataclass
from fractions import Fraction
from typing import Literal, TypeAlias

import mpmath
from mpmath import mpf

from viscopade.theory.law import VISCOELASTIC, Law

End = Literal["force", "position"]
Exact: TypeAlias = str | int | float | Fraction | mpf

# Largest v* with the end x = 0. Before it the motion creeps, x' = -x/kappa, for so long that the number of steps grows
# like kappa^(5/3): a value of 30 digits takes 2 s at v* = 10 and a minute here.
LARGEST_FOR_POSITION = 30

# Terms of a Taylor step per decimal digit carried. More terms allow longer steps; the cost is flat around this.
TERMS_PER_DIGIT = 1.3


@dataclass(frozen=True)
class Direct:
    """One collision, by direct integration; not proven.

    Attributes
    ----------
    epsilon : mpf
        Coefficient of restitution, -x'(tau_c).
    one_minus_epsilon : mpf
        1 - epsilon, to as many digits as epsilon itself.
    x_max : mpf
        Largest compression, scaled.
    tau_c : mpf
        Duration of contact, scaled.
    x_c : mpf
        Compression at the end of contact, scaled: kappa epsilon if the force vanishes there, which is not imposed;
        or 0.
    """

    epsilon: mpf
    one_minus_epsilon: mpf
    x_max: mpf
    tau_c: mpf
    x_c: mpf


@dataclass(frozen=True)
class _State:
    """State of the motion: s = sqrt(x), u = dx/dtau, tau."""

    s: mpf
    u: mpf
    tau: mpf


class _Motion:
    """The equation of motion in theta, in an mpmath context of its own.

    ds/dtheta = u, du/dtheta = -m (s^(n_a - 1) + kappa u s^(n_b - 1)), dtau/dtheta = m s^(m - 1), x = s^m, where
    n_a = m (a + 1) and n_b = m (b + 1) are whole numbers. Viscoelastic spheres have m = 2, n_a = 5, n_b = 3.
    """

    def __init__(self, kappa: Fraction, digits: int, terms: int, law: Law = VISCOELASTIC) -> None:
        """Set the motion up: Taylor steps of so many `terms`, with errors of at most 10^-digits each."""
        self.ctx = mpmath.mp.clone()
        self.ctx.dps = digits + 5  # rounding of a few hundred operations stays below the tolerance of a step
        self.kappa = self.ctx.mpf(kappa.numerator) / kappa.denominator
        self.terms = terms
        self.log2_tolerance = -digits * math.log2(10)
        self.m, (n_a, n_b) = law.m, law.powers
        # log2 of the longest step: n_a <= 2 is a linear motion, whose series converge everywhere.
        self.longest = 0.0 if n_a <= 2 else math.inf
        # s^(n_a-1) + kappa u s^(n_b-1) = s^common (s^elastic + kappa u s^viscous).
        self.common = min(n_a, n_b) - 1
        self.elastic, self.viscous = n_a - 1 - self.common, n_b - 1 - self.common

    def force(self, state: _State) -> mpf:
        """Return s^2 + kappa u: the force over sqrt(x), or over another power of s for another law."""
        return state.s**self.elastic + self.kappa * state.u * state.s**self.viscous

    def force_slope(self, state: _State) -> mpf:
        """Return the derivative of `force` with respect to theta."""
        s, u = state.s, state.u
        # kappa d(u s^viscous)/dtheta + d(s^elastic)/dtheta, ds/dtheta = u.
        drag = self.acceleration(state) * s**self.viscous + self._slope(self.viscous, s) * u * u
        return self._slope(self.elastic, s) * u + self.kappa * drag

    @staticmethod
    def _slope(power: int, s: mpf) -> mpf:
        """Return d(s^power)/ds, also for power 0."""
        return power * s ** (power - 1) if power else 0 * s

    def acceleration(self, state: _State) -> mpf:
        """Return du/dtheta = -m s^common force."""
        return -self.m * state.s**self.common * self.force(state)

    def taylor(self, start: _State) -> tuple[list[mpf], list[mpf], list[mpf]]:
        """Return the Taylor coefficients of s, u and tau in theta about `start`, up to theta^terms."""
        s, u, tau = [start.s], [start.u], [start.tau]
        # powers[i]: coefficients of s^i, each the Cauchy product of the one before and s, as far as any term needs.
        powers: list[list[mpf]] = [[] for _ in range(max(self.common, self.elastic, self.viscous, self.m - 1) + 1)]
        force: list[mpf] = []
        for j in range(self.terms):
            powers[0].append(self.ctx.mpf(j == 0))
            for lower, power in itertools.pairwise(powers):
                power.append(self.ctx.fdot(lower, s[j::-1]))
            # Coefficients j of u s^viscous and of the force; then the equations of motion give those j + 1.
            drag = self.ctx.fdot(powers[self.viscous], u[::-1]) if self.viscous else u[j]
            force.append(powers[self.elastic][j] + self.kappa * drag)
            s.append(u[j] / (j + 1))
            u.append(-self.m * self.ctx.fdot(powers[self.common], force[::-1]) / (j + 1))
            tau.append(self.m * powers[self.m - 1][j] / (j + 1))
        return s, u, tau

    def length(self, coefficients: tuple[list[mpf], ...]) -> mpf:
        """Return the length of a step whose last terms are all below the tolerance.

        It is at most 1, less than a collision, for a linear motion, because its series converge everywhere. Single
        coefficients can vanish (at first contact s has no theta^2, theta^3, theta^5, theta^8), so the last eight count.
        """
        # mag(c) is an integer with |c| <= 2^mag(c): c_j theta^j is below the tolerance if
        # log2(theta) <= (log2(tolerance) - mag(c_j))/j.
        magnitudes = ((float(self.ctx.mag(c[j])), j) for c in coefficients for j in range(self.terms - 7, len(c)))
        return self.ctx.mpf(2) ** min(self.longest, *((self.log2_tolerance - m) / j for m, j in magnitudes))

    def state_after(self, coefficients: tuple[list[mpf], ...], theta: mpf) -> _State:
        """Return the state a time theta after the start of a step, from the step's polynomials."""
        return _State(*(self.ctx.polyval(c[::-1], theta) for c in coefficients))


@dataclass(frozen=True)
class _Event:
    """An event: a zero of `value`, before which `passed` is false and after which it is true.

    `slope` is d value/dtheta.
    """

    passed: Callable[[_State], bool]
    value: Callable[[_State], mpf]
    slope: Callable[[_State], mpf]


def _end_of_contact(motion: _Motion, end: End) -> _Event:
    """Return the event that ends contact: s = 0, or the force vanishing, during rebound (u < 0)."""
    if end == "position":
        return _Event(lambda y: bool(y.u < 0 and y.s <= 0), lambda y: y.s, lambda y: y.u)
    return _Event(
        # The polynomials continue the motion to s < 0, so a step across the short time in which the force attracts is
        # seen too.
        lambda y: bool(y.u < 0 and (y.s <= 0 or motion.force(y) <= 0)),
        motion.force,
        motion.force_slope,
    )


def _locate(motion: _Motion, coefficients: tuple[list[mpf], ...], length: mpf, event: _Event) -> _State:
    """Return the state at an event within a step of this `length`.

    Newton's iteration on the step's polynomials, kept between theta = 0 and `length` by bisection.

    Raises
    ------
    RuntimeError
        If it does not converge.
    """
    low, high = motion.ctx.zero, length
    theta = length / 2
    squarings = 0  # steps of Newton's method since its change was below the square root of the precision
    # Bisection alone needs a step for each bit, prec; with ten times as many something is wrong.
    for _ in range(10 * motion.ctx.prec):
        here = motion.state_after(coefficients, theta)
        passed, value, slope = event.passed(here), event.value(here), event.slope(here)
        low, high = (low, theta) if passed else (theta, high)
        # A value of the wrong sign belongs to another zero: s^2 + kappa u has a second one at s < 0.
        newton = theta - value / slope if slope and passed == (value <= 0) else (low + high) / 2
        if abs(newton - theta) < length * motion.ctx.sqrt(motion.ctx.eps):
            # Each such step squares the error: one reaches the precision, two more also if the slope is small.
            theta, squarings = newton, squarings + 1
            if squarings == 3:
                return motion.state_after(coefficients, theta)
        else:
            theta = newton if low < newton < high else (low + high) / 2
    raise RuntimeError("the event was not located")


def collide(v_star: Exact, digits: int = 30, end: End = "force", terms_per_digit: float = TERMS_PER_DIGIT) -> Direct:
    """Return eps, x_max and tau_c of one collision, followed from first contact to its end.

    Parameters
    ----------
    v_star : str, int, float, Fraction or mpf
        Dimensionless impact velocity v*, taken exactly; positive.
    digits : int
        Significant digits of every result.
    end : {"force", "position"}
        Contact ends where the force vanishes, x'' = 0; or, the older condition, at x = 0, with a force that attracts
        towards the end.
    terms_per_digit : float
        Order of the Taylor steps, per digit carried; another value gives an independent result to compare with.

    Raises
    ------
    ValueError
        If v_star is not positive, digits is not, or v_star is too large for end="position".
    """
    exact = _exact(v_star)
    if exact <= 0 or digits < 1:
        raise ValueError("v_star and digits must be positive")
    if end not in ("force", "position"):
        raise ValueError(f"unknown end of contact: {end!r}")
    if end == "position" and exact > LARGEST_FOR_POSITION:
        raise ValueError(f"end='position' needs too many steps beyond v_star = {LARGEST_FOR_POSITION}")
    # 15 digits more for the errors of all steps, each at the tolerance, and their growth: 15 to 30 steps, but some 10^5
    # with the end x = 0 at the largest v*.
    carried = digits + 15 + _guard(exact, end)
    return _collided(_Motion(exact * exact, carried, round(terms_per_digit * carried)), digits, end)


def collide_by(law: Law, kappa: Exact, digits: int = 30, terms_per_digit: float = TERMS_PER_DIGIT) -> Direct:
    """Return eps, x_max and tau_c of one collision by a law of contact, at a positive kappa.

    kappa is neither very small nor very large: digits that are lost otherwise than `_guard` says are not made up for.
    `digits` and `terms_per_digit` are as for `collide`. The end is that of the law.
    """
    exact = _exact(kappa)
    # As in `collide`, with 10 more, and the larger of both losses: other laws have other powers of kappa.
    carried = digits + 25 + _guard(exact, "position")
    motion = _Motion(exact, carried, round(terms_per_digit * carried), law)
    return _collided(motion, digits, "force" if law.delayed else "position")


def _collided(motion: _Motion, digits: int, end: End) -> Direct:
    """Return the numbers of a collision, each as an mpf of mpmath's own context, rounded to `digits` + 3 digits."""
    ctx = motion.ctx
    turning_point = _Event(lambda y: bool(y.u <= 0), lambda y: y.u, motion.acceleration)
    events = turning_point, _end_of_contact(motion, end)

    # Taylor steps from first contact, s = 0, u = 1, tau = 0, until both events have passed, in this order.
    state, event_states = _State(ctx.zero, ctx.one, ctx.zero), list[_State]()
    while len(event_states) < len(events):
        coefficients = motion.taylor(state)
        length = motion.length(coefficients)
        state = motion.state_after(coefficients, length)
        while len(event_states) < len(events) and events[len(event_states)].passed(state):
            event_states.append(_locate(motion, coefficients, length, events[len(event_states)]))

    turning, last = event_states
    x_c = ctx.zero if end == "position" else last.s**motion.m
    results = -last.u, 1 + last.u, turning.s**motion.m, last.tau, x_c
    rounded = mpmath.mp.clone()
    rounded.dps = digits + 3  # so that a test of `digits` digits does not see the rounding
    return Direct(*(mpmath.mp.make_mpf((+rounded.convert(value))._mpf_) for value in results))


def _exact(v_star: Exact) -> Fraction:
    """Return a number as the fraction that it is; text is a decimal number or a fraction."""
    if isinstance(v_star, float | mpf) and not mpmath.isfinite(v_star):
        raise ValueError("v_star must be finite")
    if isinstance(v_star, str | int | float | Fraction):
        return Fraction(v_star)
    sign, mantissa, exponent, _ = v_star._mpf_  # (-1)^sign mantissa 2^exponent
    return (-1 if sign else 1) * int(mantissa) * Fraction(2) ** int(exponent)


def _guard(v_star: Fraction, end: End) -> int:
    """Return the digits lost because a result is much smaller than the initial velocity, 1.

    These are 1 - eps ~ v*^2; eps ~ v*^(-10/3) when the force vanishes, eps0 ~ v*^-10 at x = 0.
    """
    # log10 of the fraction, which may be outside the range of a float.
    log = math.log10(v_star.numerator) - math.log10(v_star.denominator)
    return math.ceil(-2 * log if log < 0 else (10 if end == "position" else 10 / 3) * log)
