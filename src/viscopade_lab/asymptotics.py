r"""Asymptotic expansions of eps, x_max and tau_c for v* -> 0 and v* -> infinity.

They share no code with the exact function (`flow`, `validation`, `exact`) or the series (`series`), so that they
can check it. `derivations/14_expansions.py` derives every recursion.

v* -> 0 (`elastic`): power series in v*. With the perturbation series g = sum K^n g_n of derivation 4, G_n = g_n(0) and
D_n = integral of r [1/g]_n dr over 0 <= r <= 1, all by Taylor series around the turning point r = 1, which converge up
to r = 0.

v* -> infinity (`viscous`): with W = 12^(1/3) v*^(10/3) and lambda = ln W, series in 1/W whose coefficients are
polynomials in lambda (u = 1/W below). They are asymptotic, not convergent. In the flow z' = g, g' = z^2 (g - z^2),
dT = -2 z dsigma (derivation 10) a constant of the motion is expanded near the turning point, where g = z^2 (1 - sigma),
with rational coefficients, and on the way in, in powers of 1/C, C = (z^3 - 3 g)^(1/3) -> W, with coefficients that are
sums of convergent series.

Coefficients are balls of FLINT. The radius covers rounding, but the remainder of a convergent series is estimated from
its last terms.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from fractions import Fraction
from functools import lru_cache

from flint import arb, arb_poly, arb_series, fmpq, fmpq_poly

from viscopade.arithmetic.balls import bits_for, rational_power, working

# Bits beyond the digits that are asked for, for rounding in series of some hundred terms: they leave about 20 digits.
GUARD_BITS = 64
# Further bits for each order of an expansion, as its recursion takes differences of large terms: measured, an order
# costs 4 bits (up to order 24); with 0 instead of 8 the digits asked for are lost from order 6 on.
_BITS_PER_ORDER = 8

_ELASTIC_GROWTH = 0.2333  # bits that a term gains: log2 of the radius of convergence 2 sin(pi/5), rounded down
_VISCOUS_GROWTH = 0.7924  # likewise log2 of sqrt(3)
# Coefficients over which their phase goes round at least once, so that the largest of them shows how they fall. A pair
# of singularities r exp(+-i phi) has the period 2 pi/phi: 6.7 for phi = 3 pi/10 (elastic), 12 for pi/6 (viscous).
_ROUND = 14

_Polynomials = list[arb_poly]
"""Sum of u^n p_n(lambda), n ascending."""
_Laurent = dict[int, fmpq]
"""Coefficients of a Laurent polynomial in sigma by power."""


@dataclass(frozen=True)
class PowerExpansion:
    """Powers of v*, ascending, with their coefficients, none of which is zero."""

    coefficients: tuple[tuple[int, arb], ...]

    def terms(self, v_star: arb) -> tuple[arb, ...]:
        """Return the terms at a v* > 0 in their order, at FLINT's precision; their sum approximates the quantity."""
        return tuple(c * v_star**n for n, c in self.coefficients)


@dataclass(frozen=True)
class LogExpansion:
    """Logarithmic expansion factor W^power (p_0(ln W) + p_1(ln W)/W + …), W = 12^(1/3) v*^(10/3)."""

    factor: arb
    power: Fraction
    polynomials: tuple[arb_poly, ...]

    def terms(self, v_star: arb) -> tuple[arb, ...]:
        """Return the terms at a v* > 0 in their order, at FLINT's precision; their sum approximates the quantity."""
        # W^3 = 12 v*^10 is -3 g at the start of a collision (derivation 14).
        w = arb(12).root(3) * rational_power(v_star, Fraction(10, 3))
        first, log_w = self.factor * rational_power(w, self.power), w.log()
        return tuple(first * p(log_w) / w**n for n, p in enumerate(self.polynomials))


Expansion = PowerExpansion | LogExpansion


# --- v* -> 0 ----------------------------------------------------------------------------------------------------------


@lru_cache(maxsize=8)  # more orders and digits than one session asks for
def elastic(order: int, digits: int) -> dict[str, PowerExpansion]:
    """Return "one_minus_epsilon", "x_max" and "tau_c" for v* -> 0, to v*^(2 order), order >= 3.

    `digits` are the significant digits that coefficients have at least.
    """
    bits = bits_for(digits) + GUARD_BITS + _BITS_PER_ORDER * order
    # V(K) = sum G_n K^n, the scaled speed at r = 0, and D(K) = sum D_n K^n, the scaled time of loading.
    ends, times = (arb_series(values, order + 1) for values in turning_point_series(order, digits))
    with working(bits, 2 * order + 1):
        ends[0] = 1  # V(0), exactly
        # kappa = (5/4)^(2/5) K V(K)^(1/5), solved for K(kappa); (25/16)^(1/5) = (5/4)^(2/5).
        k_of_kappa = (arb_series([0, (arb(25) / 16).root(5)], order + 1) * (ends.log() / 5).exp()).reversion()
        # Loading V(K), unloading V(-K), the time of both D(K) + D(-K), and K, as series in v* with kappa = v*^2.
        forward, backward, both_times, curve_k = (
            _in_v_star(series, order)
            for series in (
                ends(k_of_kappa),
                _mirrored(ends, order)(k_of_kappa),
                (times + _mirrored(times, order))(k_of_kappa),
                k_of_kappa,
            )
        )
        # eps0 = V(-K)/V(K), eps = eps0/k_0; impact speed 1 = (4/5)^(1/2) x_max^(5/4) V(K), and with
        # d tau = 5^(1/2) x_max^(-1/4) r dr/g, tau_c = 5^(1/2) x_max^(-1/4) (D(K) + D(-K) - K rest).
        eps0 = backward / forward
        k_0, rest = _end_of_contact(eps0, order)
        loss = 1 - eps0 / k_0
        x_max = (arb(25) / 16).root(5) * ((forward.log() * -4) / 5).exp()
        tau_c = arb(5).sqrt() * (x_max.log() / -4).exp() * (both_times - curve_k * rest)
        in_v_star = {"one_minus_epsilon": loss, "x_max": x_max, "tau_c": tau_c}
        return {name: _expansion(series) for name, series in in_v_star.items()}


@lru_cache(maxsize=8)  # more orders and digits than one session asks for
def elastic_in_closed_form(digits: int) -> dict[str, PowerExpansion]:
    """Return the first terms of `elastic`, up to relative order v*^3, in closed form by the Gamma function.

    `digits` are the significant digits of the coefficients. derivations/14_expansions.py derives the formulas.

    The first terms left out are those in v*^6 of 1 - eps, and in v*^4 of x_max and tau_c.
    """
    with working(bits_for(digits) + GUARD_BITS):
        # G_1 = B(3/5, 3/2)/2 and D_0 = integral of r/sqrt(1 - r^5) = B(2/5, 1/2)/5, B the Beta function.
        g_1 = arb.pi().sqrt() * _ball(fmpq(3, 5)).gamma() / (4 * _ball(fmpq(21, 10)).gamma())
        d_0 = _ball(fmpq(2, 5)).gamma() * arb.pi().sqrt() / (5 * _ball(fmpq(9, 10)).gamma())
        k = (arb(16) / 25).root(5)  # K = k v*^2 + …
        lambda_1 = 2 * k * g_1
        # Without damping x_max = (5/4)^(2/5), and times have the unit 5^(1/2) x_max^(-1/4).
        depth, time = (arb(25) / 16).root(5), arb(5).sqrt() / (arb(5) / 4).root(10)
        # eps0 = V(-K)/V(K), V = 1 + G_1 K + …, gives -lambda_1 v*^2 + 3/5 lambda_1^2 v*^4 (mathematics.md, section 9);
        # H = 1 + delta/3, delta = 4/5 v*^5, gives 4/15 v*^5. x_max ~ V^(-4/5).
        loss = ((2, lambda_1), (4, -arb(3) / 5 * lambda_1**2), (5, -arb(4) / 15))
        x_max = ((0, depth), (2, -arb(4) / 5 * depth * k * g_1))
        # Of tau_c ~ V^(1/5) (2 D_0 - K/2): contact lacks the time from its end to x = 0, K times the integral 1/2
        # of p from 0 to 1.
        tau_c = ((0, 2 * time * d_0), (2, time * k * (2 * d_0 * g_1 / 5 - arb(1) / 2)))
        return {
            "one_minus_epsilon": PowerExpansion(loss),
            "x_max": PowerExpansion(x_max),
            "tau_c": PowerExpansion(tau_c),
        }


def _expansion(series: arb_series) -> PowerExpansion:
    """Return the terms of a series in v* that are not 0; exact zeros are, as that of v*^1 in 1 - eps.

    Raises
    ------
    ArithmeticError
        If a ball contains 0 and other numbers.
    """
    terms = tuple((n, c) for n, c in enumerate(series.coeffs()) if not c.is_zero())
    if any(c.contains(0) for _, c in terms):
        raise ArithmeticError("too few digits to tell whether a coefficient is zero")
    return PowerExpansion(terms)


def _in_v_star(series: arb_series, order: int) -> arb_series:
    """Return a series in kappa = v*^2 as a series in v*, to v*^(2 order)."""
    coefficients = [arb(0)] * (2 * order + 1)
    coefficients[: 2 * len(series.coeffs()) : 2] = series.coeffs()
    return arb_series(coefficients, 2 * order + 1)


def _mirrored(series: arb_series, order: int) -> arb_series:
    """Return f(-K) for a series f(K): loading with K becomes unloading."""
    return arb_series([-c if n % 2 else c for n, c in enumerate(series.coeffs())], order + 1)


def _end_of_contact(eps0: arb_series, order: int) -> tuple[arb_series, arb_series]:
    """Return k_0 = eps0/eps and the time from the end of contact to x = 0, in units of K, as series in v*.

    `eps0` is a series in v* to v*^(2 order). In units of the end (derivation 5): p is sqrt(x) over its value at the end
    of contact, k(p) the speed over eps; with mu = (4/5) v*^5 sqrt(eps), k^2 = 1 + mu (1 - p^5 - 5 integral of k q^2 dq
    from p to 1), k_0 = k(0), and the time from there to x = 0 is the integral of p/k from 0 to 1. mu follows from
    delta = (4/5) v*^5 sqrt(eps0) = mu sqrt(k_0(mu)).
    """
    # Powers of mu ~ v*^5 up to v*^(2 order), the constant, and one to spare.
    length = 2 * order // 5 + 2
    # k = sum mu^n k_n(p) and 1/k, polynomials in p with rational coefficients, order by order in mu:
    # 2 k_n = -5 integral of k_(n-1) q^2 from p to 1 (+ 1 - p^5 for n = 1) - sum k_i k_(n-i).
    k, inverse = [fmpq_poly([1])], [fmpq_poly([1])]
    for n in range(1, length):
        integral = (k[n - 1] * fmpq_poly([0, 0, 1])).integral()
        right = 5 * (integral - integral(fmpq(1))) + (fmpq_poly([1, 0, 0, 0, 0, -1]) if n == 1 else 0)
        k.append((right - sum((k[i] * k[n - i] for i in range(1, n)), fmpq_poly())) / 2)
        inverse.append(-sum((k[i] * inverse[n - i] for i in range(1, n + 1)), fmpq_poly()))
    k_0 = arb_series([_ball(k_n[0]) for k_n in k], length)
    time_to_0 = [_ball((e * fmpq_poly([0, 1])).integral()(fmpq(1))) for e in inverse]
    # mu(delta) by reversion, delta(v*), and both results at mu(delta(v*)).
    mu_of_delta = (arb_series([0, 1], length) * k_0.sqrt()).reversion().coeffs()
    delta = arb_series([0] * 5 + [arb(4) / 5], 2 * order + 1) * eps0.sqrt()
    mu = _at_series(mu_of_delta, delta)
    return _at_series(k_0.coeffs(), mu), _at_series(time_to_0, mu)


def _at_series(coefficients: list[arb], value: arb_series) -> arb_series:
    """Return a polynomial's value at a power series, by Horner's scheme.

    FLINT's composition of series refuses an inner series that is 0, as delta is for orders below v*^5.
    """
    result = arb_series([0], value.prec)
    for c in reversed(coefficients):
        result = result * value + c
    return result


@lru_cache(maxsize=8)  # more orders and digits than one session asks for
def turning_point_series(order: int, digits: int) -> tuple[list[arb], list[arb]]:
    """Return G_0 … G_order, coefficients of the scaled speed V(K) at r = 0, and D_0 … D_order, of the time of loading.

    With y = 1 - r, g_n = y^((n+1)/2) f_n(y) and [1/g]_n = y^((n-1)/2) e_n(y); the singularities of f_n and e_n next to
    0 are at |y| = 2 sin(pi/5) = 1.17…, beyond r = 0. `digits` are the significant digits of the results.
    """
    bits = bits_for(digits) + GUARD_BITS + _BITS_PER_ORDER * order
    length = int(bits / _ELASTIC_GROWTH)  # terms of the series in y: the last ones are 2^-bits at y = 1
    with working(bits, length):
        # 1 - r^5 = 5 y - 10 y^2 + 10 y^3 - 5 y^4 + y^5 = y f_0^2.
        f = [arb_series([5, -10, 10, -5, 1], length).sqrt()]
        e = [1 / f[0]]
        for n in range(1, order + 1):
            # 2 g_0 g_n = 5 integral of g_(n-1) r^2 dr from r to 1 - sum g_i g_(n-i), 5 r^2 = 5 - 10 y + 5 y^2; and
            # g [1/g] = 1.
            work = _integrated(f[n - 1] * arb_series([5, -10, 5], length), n + 2)
            f.append((work - sum((f[i] * f[n - i] for i in range(1, n)), arb_series([0], length))) * e[0] / 2)
            e.append(-sum((f[i] * e[n - i] for i in range(1, n + 1)), arb_series([0], length)) * e[0])
        # D_n is the integral of r [1/g]_n = (1 - y) y^((n-1)/2) e_n. Everything is summed at y = 1, that is r = 0.
        times = [_integrated(e_n * arb_series([1, -1], length), n + 1) for n, e_n in enumerate(e)]
        return [_sum(f_n, _ELASTIC_GROWTH) for f_n in f], [_sum(time, _ELASTIC_GROWTH) for time in times]


def _integrated(series: arb_series, n: int) -> arb_series:
    """Return y^(-n/2) times the integral of y^(n/2 - 1) series(y) from 0 to y: c_j y^j becomes c_j y^j/(n/2 + j)."""
    return arb_series([2 * c / (n + 2 * j) for j, c in enumerate(series.coeffs())], series.prec)


def _sum(series: arb_series, growth: float) -> arb:
    """Return the sum of the coefficients; the remainder is estimated by the last ones, which fall by 2^-growth each."""
    coefficients = series.coeffs()
    last = max((abs(c).abs_upper() for c in coefficients[series.prec - _ROUND :]), default=arb(0))
    # A geometric remainder is last/(2^growth - 1), at most last 1.45/growth. 4 instead of 1.45 covers coefficients that
    # fall somewhat more slowly, by a power of their index; it is an estimate, not a bound.
    return sum(coefficients, arb(0)) + arb(0, (last * (4 / growth)).abs_upper())


def _ball(number: fmpq) -> arb:
    """Return a rational number as a ball."""
    return arb(number.p) / arb(number.q)


# --- v* -> infinity ---------------------------------------------------------------------------------------------------


@lru_cache(maxsize=8)  # more orders and digits than one session asks for
def viscous(order: int, digits: int) -> dict[str, LogExpansion]:
    """Return "epsilon", "x_max" and "tau_c" for v* -> infinity, to W^-order relative to the first term.

    `digits` are the significant digits of the coefficients. In units of the damping the motion is x = z^2/(4 v*^8),
    w = v*^10 = W^3/12. A collision starts at z = 0, turns at z = Z and ends at z_e; both are W times a series y(u).
    """
    constant, time = way_in(order, digits)
    length = order + 1  # terms of series in u
    near = near_turning_point(length)
    with working(bits_for(digits) + GUARD_BITS):
        # The constant of the motion at the start equals that at the turning point and that at the end of contact.
        turn = _solved(constant, lambda y: _at_turning_point(y, near, length), length)
        end = _solved(constant, lambda y: _at_end(y, near, length), length)
        ratio = _product(end, end, length)
        duration = [a - b for a, b in zip(_end_time(end, near, length), time, strict=True)]  # W times it
        # eps = z_e^2/(4 w) = 3 y^2/W. x_max = Z^2/(4 v*^8), v*^8 = (W^3/12)^(4/5): 12^(4/5)/4 W^(-2/5) y^2.
        # tau_c = v*^2 T = (W^3/12)^(1/5) (W T)/W: 12^(-1/5) W^(-2/5) (W T).
        root, slow = arb(12).root(5), Fraction(-2, 5)
        return {
            "epsilon": LogExpansion(arb(3), Fraction(-1), tuple(ratio)),
            "x_max": LogExpansion(root**4 / 4, slow, tuple(_product(turn, turn, length))),
            "tau_c": LogExpansion(1 / root, slow, tuple(duration)),
        }


@dataclass(frozen=True)
class NearTurningPoint:
    """Rational coefficients of the expansions for z -> infinity at a given sigma, g = z^2 (1 - sigma).

    The constant is 6 ln z - z - sigma + ln J, ln J = ln(sigma) + sum z^-n q_n(sigma); the time is the sum of
    z^-n R_n(sigma, ln J). The turning point is sigma = 1, the end of contact sigma = 0.
    """

    q: list[_Laurent]
    """q_0 = 0, q_1, …."""
    turning: list[fmpq]
    """Coefficients of ln J at sigma = 1."""
    end: list[fmpq]
    """Coefficients of ln(z J/2) at sigma = 0."""
    time: list[list[fmpq_poly]]
    """R_n, n from 0, as polynomials in sigma by the power of ln J."""


@lru_cache(maxsize=8)  # more orders and digits than one session asks for
def near_turning_point(order: int) -> NearTurningPoint:
    """Return the expansions near the turning point, to z^-order (derivations/14_expansions.py)."""
    q: list[_Laurent] = [{}]
    # sigma q_1' = -6 (1 - sigma) - 2 (1 - sigma)^3/sigma = -2/sigma + 2 sigma^2: the terms sigma^0 and sigma^1 cancel.
    right: _Laurent = {-1: fmpq(-2), 1: fmpq(0), 2: fmpq(2)}
    for n in range(1, order + 1):
        # sigma q_n' = right, by powers. The constant of q_n is free: it makes the sigma^0 of sigma q_(n+1)' vanish,
        # whose integral would be ln(sigma); a constant c contributes n c to it.
        q_n = {i: c / i for i, c in right.items() if i != 0}
        q_n[0] = -_transported(q_n, n).get(0, fmpq(0)) / n
        q.append(q_n)
        right = _transported(q_n, n)
    turning = [sum(q_n.values(), fmpq(0)) for q_n in q]  # at sigma = 1
    return NearTurningPoint(q, turning, _end_values(order), _times_near(order))


def _transported(q_n: _Laurent, n: int) -> _Laurent:
    """Return -2 (1 - sigma)^2 q_n' + n (1 - sigma) q_n, which is sigma q_(n+1)'."""
    result: _Laurent = {}
    for i, c in q_n.items():
        # sigma^i: -2 i (sigma^(i-1) - 2 sigma^i + sigma^(i+1)) + n (sigma^i - sigma^(i+1)).
        for power, weight in ((i - 1, -2 * i), (i, 4 * i + n), (i + 1, -2 * i - n)):
            result[power] = result.get(power, fmpq(0)) + weight * c
    return result


def _end_values(order: int) -> list[fmpq]:
    """Return the coefficients of z^0 … z^-order of ln(z J/2) at sigma = 0, where J = -(Q_1/z + Q_2/z^2 + …).

    The Q_n of derivation 10 are polynomials in s = -sigma, Q_0 = s, s Q_n' - Q_n = right_n(Q_(n-1)) = `_next_q`.
    """
    q = [fmpq_poly([0, 1])]
    # To order + 2: the free term of Q_(order+1), the last one that is used, is determined with the next one.
    for n in range(1, order + 3):
        # A term s^1 on the right would give a logarithm; the free term c s of Q_(n-1) cancels it (Q_0 has none).
        slope = _next_q(fmpq_poly([0, 1]), n)[1]
        if n > 1:
            q[-1] -= fmpq_poly([0, _next_q(q[-1], n)[1] / slope])
        right = _next_q(q[-1], n)
        q.append(fmpq_poly([c / (m - 1) if m != 1 else fmpq(0) for m, c in enumerate(right.coeffs())]))
    # The logarithm l of a series v = 1 + v_1/z + … by n l_n = n v_n - sum i l_i v_(n-i).
    values = [-q_n[0] / 2 for q_n in q[1 : order + 2]]
    logarithm = [fmpq(0)]
    for n in range(1, order + 1):
        logarithm.append(values[n] - sum((i * logarithm[i] * values[n - i] for i in range(1, n)), fmpq(0)) / n)
    return logarithm


def _next_q(previous: fmpq_poly, n: int) -> fmpq_poly:
    """Return s Q_n' - Q_n = (1 + s) ((n - 7) Q_(n-1) + 2 (1 + s) (Q_(n-1) + Q_(n-1)')) of derivation 10."""
    s_1 = fmpq_poly([1, 1])
    return s_1 * ((n - 7) * previous + 2 * s_1 * (previous + previous.derivative()))


def _times_near(order: int) -> list[list[fmpq_poly]]:
    """Return R_0 … R_order of the time sum z^-n R_n(sigma, l), l = ln J: polynomials in sigma by the power of l.

    sigma dR_n/dsigma + dR_n/dl = (n-1) (1-sigma) R_(n-1) - 2 (1-sigma)^2 dR_(n-1)/dsigma
    + 2 (1-sigma) (2+sigma) dR_(n-1)/dl, R_0 = 0, R_1 = -2 l.
    """
    one_minus, two_plus = fmpq_poly([1, -1]), fmpq_poly([2, 1])  # 1 - sigma, 2 + sigma
    times: list[list[fmpq_poly]] = [[fmpq_poly()], [fmpq_poly(), fmpq_poly([-2])]]
    for n in range(2, order + 1):
        previous = times[-1]
        by_l = [k * previous[k] for k in range(1, len(previous))] + [fmpq_poly()]  # dR_(n-1)/dl
        right = [
            one_minus * ((n - 1) * p - 2 * one_minus * p.derivative() + 2 * two_plus * d)
            for p, d in zip(previous, by_l, strict=True)
        ]
        times.append(_time_from_rate(right))
    return times


def _time_from_rate(right: list[fmpq_poly]) -> list[fmpq_poly]:
    """Return the R(sigma, l) with sigma dR/dsigma + dR/dl = right, and no constant; both by the power of l.

    The coefficients of sigma^i l^k obey i R_ik + (k+1) R_i(k+1) = right_ik: for i > 0 from the highest k down, with one
    power of l more than `right` for i = 0, where k R_0k = right_0(k-1).
    """
    degree = max(p.degree() for p in right)
    table = [[fmpq(0)] * (degree + 1) for _ in range(len(right) + 1)]  # table[k][i]: coefficient of sigma^i l^k
    for i in range(degree + 1):
        for k in range(len(right), -1, -1):
            if i:
                above = (k + 1) * table[k + 1][i] if k < len(right) else fmpq(0)
                table[k][i] = ((right[k][i] if k < len(right) else fmpq(0)) - above) / i
            elif k:
                table[k][0] = right[k - 1][0] / k
    return [fmpq_poly(row) for row in table]


# --- the way in -------------------------------------------------------------------------------------------------------


@lru_cache(maxsize=8)  # more orders and digits than one session asks for
def way_in(order: int, digits: int) -> tuple[_Polynomials, _Polynomials]:
    """Return the constant of the motion and the time at the start of a collision, z = 0, as polynomials in ln C.

    The constant is -C + 6 ln C + sum C^(1-n) mu_n, the time sum C^-n v_n; the lists are mu_1 … and v_1 …. On the way,
    with x = 1 - z/C, x^(n-1) mu_n and x^(n-1) v_n are polynomials in ln(C x) whose coefficients are power series in
    x. They converge for |x| < sqrt(3), beyond the start, x = 1. `digits` are the significant digits of the results.
    """
    near = near_turning_point(order + 1)  # mu_1 … mu_(order+1)
    bits = bits_for(digits) + GUARD_BITS + _BITS_PER_ORDER * order
    length = int(bits / _VISCOUS_GROWTH)  # terms of the series in x: the last ones are 2^-bits at x = 1
    with working(bits, length):
        one_minus_x, x = arb_series([1, -1], length), arb_series([0, 1], length)
        over_p = 1 / arb_series([1, -1, arb(1) / 3], length)  # 1/(1 - x + x^2/3) = x/P_0 of derivation 10
        drag = one_minus_x**4 * over_p
        # Sources of derivation 14: those of -C and 6 ln C for the constant, of dT/dz = -2 z/g for the time.
        constant = _coefficients_at_start(drag, (drag, -6 * x * drag), 1, _constant_matches(near, order + 1))
        time = _coefficients_at_start(drag, (-2 * one_minus_x * over_p, 0 * x), 0, _time_matches(near, order + 1))
    return constant, time


def _coefficients_at_start(
    drag: arb_series, sources: tuple[arb_series, arb_series], power: int, matches: list[fmpq]
) -> _Polynomials:
    """Return the first coefficients mu_n (power 1) or v_n (power 0) at x = 1, as many as there are matches.

    They are polynomials in ln(C x), which is ln C at x = 1. `drag` is (1-x)^4/(1 - x + x^2/3), and `sources` those of
    n = 1 and n = 2, all power series in x; `matches` are the free coefficients.

    With f_n = x^(n-1) mu_n (power 1) or x^(n-1) v_n (power 0) and theta = x d/dx + d/d ln(C x),
    (theta + 1 - n) f_n = right_n = source_n - drag (right_(n-1) - (1 - power) x f_(n-1) - x^2 df_(n-1)/dx).
    In f_n the coefficient of x^(n-1) without a logarithm is free: it is matched.
    """
    length = drag.prec
    step = arb_series([0, 1 - power], length)  # (1 - power) x
    right: list[arb_series] = []  # right_n and f_n, by the power of the logarithm
    f_n: list[arb_series] = []
    values: _Polynomials = []
    for n, match in enumerate(matches, 1):
        right.append(arb_series([0], length))  # f_n has a power of the logarithm more than right_n
        if f_n:
            # x^2 df/dx: c x^j becomes j c x^(j+1).
            slopes = (arb_series([arb(0), *(j * c for j, c in enumerate(f.coeffs()))], length) for f in f_n)
            right = [-drag * (r - step * f - slope) for r, f, slope in zip(right, f_n, slopes, strict=True)]
        if n <= len(sources):
            right[0] += sources[n - 1]
        f_n = _with_logarithms(right, n, match, length)
        values.append(arb_poly([_sum(f, _VISCOUS_GROWTH) for f in f_n]))  # at x = 1
    return values


def _with_logarithms(right: list[arb_series], n: int, match: fmpq, length: int) -> list[arb_series]:
    """Return the f_n with (theta + 1 - n) f_n = right, theta = x d/dx + d/dL, by the power of L = ln(C x).

    The coefficients of x^j L^k obey (j + 1 - n) f_jk + (k+1) f_j(k+1) = right_jk. For j = n - 1 this is
    k f_(n-1)k = right_(n-1)(k-1), and the coefficient without L is free: `match`. Series have `length` terms.
    """
    right_terms = [[r[j] for j in range(length)] for r in right]
    above = [arb(0)] * length  # the row of the next higher power of L
    rows: list[list[arb]] = []
    for k in range(len(right_terms), -1, -1):
        row = [arb(0)] * length
        for j in range(length):
            if j != n - 1:
                row[j] = ((right_terms[k][j] if k < len(right_terms) else 0) - (k + 1) * above[j]) / (j + 1 - n)
        row[n - 1] = right_terms[k - 1][n - 1] / k if k else _ball(match)
        rows.append(row)
        above = row
    return [arb_series(row, length) for row in reversed(rows)]


def _constant_matches(near: NearTurningPoint, order: int) -> list[fmpq]:
    """Return the free coefficients of mu_1 … mu_order: of C^(1-n), constant in omega = C x and ln(omega).

    Near the turning point z = C (1 - x), sigma = 1 + omega h(x), h = (1 - x + x^2/3)/(1 - x)^2. A term omega^-a x^a is
    C^-a: so of everything that contains omega^-a, the coefficient of x^a counts.
    """
    matches = [fmpq(-1)]  # of the constant's term -sigma = -1 - …
    for n in range(2, order + 1):
        # ln(sigma) = ln(omega h) - sum (-1)^a/a (omega h)^-a; C^(1-n) is a = n - 1.
        a = n - 1
        match = -fmpq((-1) ** a, a) * _h_power(-a, 0, a)[a]
        # z^-m q_m(sigma) = C^-m (1-x)^-m sum c (1 + omega h)^i has (omega h)^-a with binomial(i, i + a).
        for m in range(1, n):
            a = n - 1 - m
            weight = sum((c * _binomial(i, i + a) for i, c in near.q[m].items()), fmpq(0))
            match += weight * _h_power(-a, m, a)[a]
        matches.append(match)
    return matches


def _time_matches(near: NearTurningPoint, order: int) -> list[fmpq]:
    """Return the free coefficients of v_1 … v_order: of C^-n, constant in omega = C x and ln(omega).

    With d = 1/omega, sigma d and (ln J) d without its ln(omega) are power series in x and d; 1/z = d x/(1 - x). C^-n is
    d^n x^n. sigma = 1 + omega h as in `_constant_matches`.
    """
    # sigma d = h + d.
    sigma = [_h_power(1, 0, order), fmpq_poly([1])]
    # ln J = ln(sigma) + sum z^-n q_n(sigma), times d: first ln(sigma) = ln(omega) + ln h - sum (-1)^b/b h^-b d^b, ...
    # (ln h: its derivative times x is (-x + 2/3 x^2)/(1 - x + x^2/3) + 2 x/(1 - x).)
    slope = fmpq_poly([0, -1, fmpq(2, 3)]) * _h_power(-1, 2, order) + fmpq_poly([0, *[2] * order])
    log_h = fmpq_poly([slope[n] / n if n else fmpq(0) for n in range(order + 1)])
    log_j = [fmpq_poly(), log_h]
    log_j += [fmpq(-((-1) ** b), b) * _h_power(-b, 0, order) for b in range(1, order)]
    # ... then z^-n sigma^i = d^n x^n (1-x)^-n sum binomial(i, b) (h/d)^(i-b).
    for n in range(1, order + 1):
        for i, c in near.q[n].items():
            for b in range(order + i - n):  # up to d^order
                _add(log_j, n - i + b + 1, c * _binomial(i, b) * _h_power(i - b, n, order).left_shift(n))
    # The time is sum z^-m R_m(sigma, ln J) = sum d^m x^m (1-x)^-m c (sigma d)^i (ln J d)^k d^(-i-k). Its coefficient of
    # d^n x^n needs d^(n-m+i+k) of the product of powers, and x^(n-m) of it times (1-x)^-m.
    sigma_powers, log_j_powers = (_power_table(series, order) for series in (sigma, log_j))
    matches = []
    for n in range(1, order + 1):
        match = fmpq(0)
        for m in range(1, n + 1):
            start = _h_power(0, m, n)
            for k, by_sigma in enumerate(near.time[m]):
                for i, c in enumerate(by_sigma.coeffs()):
                    if c != 0 and i + k <= n:
                        first, second, in_d = sigma_powers[i], log_j_powers[k], n - m + i + k
                        pairs = ((first[j], second[in_d - j]) for j in range(len(first)) if 0 <= in_d - j < len(second))
                        match += c * (sum((p * q for p, q in pairs), fmpq_poly()) * start)[n - m]
        matches.append(match)
    return matches


_Bivariate = list[fmpq_poly]
"""Power series in d whose coefficients are power series in x."""


def _power_table(series: _Bivariate, order: int) -> list[_Bivariate]:
    """Return the powers 0 … order of a series in d and x, to d^order and x^order: the last one times the series."""
    table = [[fmpq_poly([1])]]
    for _ in range(order):
        product: _Bivariate = []
        for i, a in enumerate(table[-1]):
            for j, b in enumerate(series[: order + 1 - i]):
                _add(product, i + j, (a * b).truncate(order + 1))
        table.append(product)
    return table


def _add(series: _Bivariate, n: int, term: fmpq_poly) -> None:
    """Add term(x) d^n to a series, in place."""
    series.extend([fmpq_poly()] * (n + 1 - len(series)))
    series[n] += term


def _h_power(exponent: int, inverse: int, order: int) -> fmpq_poly:
    """Return h^exponent (1-x)^-inverse to x^order, h = (1 - x + x^2/3)/(1 - x)^2."""
    # A power p of 1 + c_1 x + c_2 x^2: n p_n = sum (k (exponent + 1) - n) c_k p_(n-k), c_1 = -1, c_2 = 1/3.
    top = [fmpq(1)]
    for n in range(1, order + 1):
        terms = ((k * (exponent + 1) - n) * c * top[n - k] for k, c in ((1, fmpq(-1)), (2, fmpq(1, 3))) if k <= n)
        top.append(sum(terms, fmpq(0)) / n)
    # The power of 1 - x that is left, by the binomial series.
    power = -2 * exponent - inverse
    bottom = fmpq_poly([(-1) ** n * _binomial(power, n) for n in range(order + 1)])
    return (fmpq_poly(top) * bottom).truncate(order + 1)


def _binomial(n: int, k: int) -> fmpq:
    """Return the binomial coefficient n (n-1) … (n-k+1)/k! for any integer n; 0 for k < 0."""
    result = fmpq(int(k >= 0))
    for i in range(k):
        result = result * (n - i) / (i + 1)
    return result


# --- series in u = 1/W whose coefficients are polynomials in lambda ---------------------------------------------------


def _at_turning_point(y: _Polynomials, near: NearTurningPoint, length: int) -> _Polynomials:
    """Return the constant less 6 ln W - W + W (1 - y), at z = Z = W y and sigma = 1.

    6 ln z - z - sigma + ln J with ln z = ln W + ln y leaves 6 ln y - 1 + ln J; near.turning has ln J in powers of 1/z.
    """
    log_j_less_1: _Polynomials = [arb_poly([_ball(c)]) for c in near.turning[:length]]
    log_j_less_1[0] -= 1
    return _sum_of(_in_powers(log_j_less_1, y, length), _scaled(_log(y, length), 6))


def _at_end(y: _Polynomials, near: NearTurningPoint, length: int) -> _Polynomials:
    """Return the constant less 6 ln W - W + W (1 - y), at z = z_e = W y and sigma = 0: 6 ln y + ln J."""
    return _sum_of(_log_j_at_end(y, near, length), _scaled(_log(y, length), 6))


def _log_j_at_end(y: _Polynomials, near: NearTurningPoint, length: int) -> _Polynomials:
    """Return ln J at the end of contact, ln 2 - ln(z_e) + near.end in powers of 1/z_e, with z_e = W y."""
    series = _in_powers([arb_poly([_ball(c)]) for c in near.end[:length]], y, length)
    series[0] += arb_poly([arb.const_log2(), -1])  # ln 2 - lambda, lambda = ln W
    return _sum_of(series, _scaled(_log(y, length), -1))


def _end_time(y: _Polynomials, near: NearTurningPoint, length: int) -> _Polynomials:
    """Return W times the time sum z_e^-n R_n(0, ln J) at the end of contact, z_e = W y, sigma = 0, to u^(length-1)."""
    log_j = _log_j_at_end(y, near, length)
    one = _constant(1, length)
    time = _constant(0, length)
    over_z = _to_the(y, arb(-1), length)  # W/z_e
    # Horner's scheme twice: in 1/z_e = u W/z_e from the last n down, and in ln J for each R_n(0, ln J).
    for n in range(length, 0, -1):
        r_n = _constant(0, length)
        for polynomial in reversed(near.time[n]):
            r_n = _sum_of(_product(r_n, log_j, length), _scaled(one, _ball(polynomial[0])))
        time = _product(_sum_of(_shift(time), r_n), over_z, length)
    return time


def _solved(constant: _Polynomials, rest: Callable[[_Polynomials], _Polynomials], length: int) -> _Polynomials:
    """Return y = z/W from 6 ln W - W + W (1 - y) + rest(y) = the constant of the motion, to u^(length-1).

    `constant` is the constant at the start less 6 ln W - W. So y = 1 + u (rest(y) - constant), and each turn of this
    iteration corrects one more power of u = 1/W.
    """
    y = _constant(1, length)
    for _ in range(length):
        difference = [a - b for a, b in zip(rest(y), constant, strict=True)]
        y = _sum_of(_constant(1, length), _shift(difference))
    return y


def _in_powers(outer: _Polynomials, y: _Polynomials, length: int) -> _Polynomials:
    """Return sum u^n y^-n p_n, p_n = outer[n] independent of u, by Horner's scheme, to u^(length-1)."""
    over_y, result = _to_the(y, arb(-1), length), _constant(0, length)
    for polynomial in reversed(outer):
        result = _shift(_product(result, over_y, length))
        result[0] += polynomial
    return result


def _constant(value: int, length: int) -> _Polynomials:
    """Return a number as a series in u of `length` terms."""
    return [arb_poly([value]) if n == 0 else arb_poly() for n in range(length)]


def _shift(series: _Polynomials) -> _Polynomials:
    """Return u times the series."""
    return [arb_poly(), *series[:-1]]


def _scaled(series: _Polynomials, factor: arb | int) -> _Polynomials:
    return [p * factor for p in series]


def _sum_of(a: _Polynomials, b: _Polynomials) -> _Polynomials:
    return [p + q for p, q in zip(a, b, strict=True)]


def _product(a: _Polynomials, b: _Polynomials, length: int) -> _Polynomials:
    """Return the product of two series in u, to u^(length-1)."""
    return [sum((a[i] * b[n - i] for i in range(n + 1)), arb_poly()) for n in range(length)]


def _log(y: _Polynomials, length: int) -> _Polynomials:
    """Return ln y, y = 1 + O(u), to u^(length-1): n l_n = n y_n - sum k l_k y_(n-k), from y' = y l'."""
    logarithm = [arb_poly()]
    for n in range(1, length):
        logarithm.append(y[n] - sum((logarithm[k] * k * y[n - k] for k in range(1, n)), arb_poly()) * (arb(1) / n))
    return logarithm


def _to_the(y: _Polynomials, exponent: arb, length: int) -> _Polynomials:
    """Return p = y^exponent, y = 1 + O(u), to u^(length-1): n p_n = sum (k (exponent + 1) - n) y_k p_(n-k)."""
    power = [arb_poly([1])]
    for n in range(1, length):
        terms = (y[k] * power[n - k] * (k * (exponent + 1) - n) for k in range(1, n + 1))
        power.append(sum(terms, arb_poly()) * (arb(1) / n))
    return power
