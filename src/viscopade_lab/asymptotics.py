r"""Asymptotic expansions of eps, x_max and tau_c for v* -> 0 and v* -> infinity.

They share no code with the exact function (`flow`, `validation`, `exact`) or the series (`series`), so that they
can check it. `derivations/14_expansions.py` derives every recursion.

v* -> 0 (`elastic`): power series in v*. With the perturbation series g = sum K^n g_n of derivation 4, G_n = g_n(0) and
D_n = integral of r [1/g]_n dr over 0 <= r <= 1, all by Taylor series around the turning point r = 1, which converge up
to r = 0.

v* -> infinity (`viscous`): with W = 12^(1/3) v*^(10/3) and lambda = ln W, series in 1/W whose coefficients are
polynomials in lambda. They are asymptotic, not convergent. In the flow z' = g, g' = z^2 (g - z^2), dT = -2 z dsigma
(derivation 10) a constant of the motion is expanded near the turning point, where g = z^2 (1 - sigma), with rational
coefficients, and on the way in, in powers of 1/C, C = (z^3 - 3 g)^(1/3) -> W, with coefficients that are sums of
convergent series.

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

GUARD_BITS = 64

_ELASTIC_GROWTH = 0.2333  # log2 of the radius of convergence 2 sin(pi/5)
_VISCOUS_GROWTH = 0.7924  # log2 of sqrt(3)
_ROUND = 14  # coefficients over which the phase at the singularities goes round at least once

_Polynomials = list[arb_poly]
"""Sum of u^n p_n(lambda), n ascending."""
_Laurent = dict[int, fmpq]
"""Coefficients of a Laurent polynomial in sigma by power."""


@dataclass(frozen=True)
class PowerExpansion:
    """Powers of v*, ascending, with their coefficients, none of which is zero."""

    coefficients: tuple[tuple[int, arb], ...]

    def terms(self, v_star: arb) -> tuple[arb, ...]:
        """Return the terms in their order, at FLINT's precision."""
        return tuple(c * v_star**n for n, c in self.coefficients)


@dataclass(frozen=True)
class LogExpansion:
    """Logarithmic expansion factor W^power (p_0(ln W) + p_1(ln W)/W + …), W = 12^(1/3) v*^(10/3)."""

    factor: arb
    power: Fraction
    polynomials: tuple[arb_poly, ...]

    def terms(self, v_star: arb) -> tuple[arb, ...]:
        """Return the terms in their order, at FLINT's precision."""
        w = arb(12).root(3) * rational_power(v_star, Fraction(10, 3))
        first, log_w = self.factor * rational_power(w, self.power), w.log()
        return tuple(first * p(log_w) / w**n for n, p in enumerate(self.polynomials))


Expansion = PowerExpansion | LogExpansion


# --- v* -> 0 ----------------------------------------------------------------------------------------------------------


@lru_cache(maxsize=8)
def elastic(order: int, digits: int) -> dict[str, PowerExpansion]:
    """Return 1 - eps, x_max and tau_c for v* -> 0, to v*^(2 order), order >= 3."""
    bits = bits_for(digits) + GUARD_BITS + 8 * order
    ends, times = (arb_series(values, order + 1) for values in turning_point_series(order, digits))
    with working(bits, 2 * order + 1):
        ends[0] = 1  # V(0), exactly
        k_of_kappa = (arb_series([0, (arb(25) / 16).root(5)], order + 1) * (ends.log() / 5).exp()).reversion()
        forward, backward, both_times, curve_k = (
            _in_v_star(series, order)
            for series in (
                ends(k_of_kappa),
                _mirrored(ends, order)(k_of_kappa),
                (times + _mirrored(times, order))(k_of_kappa),
                k_of_kappa,
            )
        )
        eps0 = backward / forward
        k_0, rest = _end_of_contact(eps0, order)
        loss = 1 - eps0 / k_0
        x_max = (arb(25) / 16).root(5) * ((forward.log() * -4) / 5).exp()
        tau_c = arb(5).sqrt() * (x_max.log() / -4).exp() * (both_times - curve_k * rest)
        in_v_star = {"one_minus_epsilon": loss, "x_max": x_max, "tau_c": tau_c}
        return {name: _expansion(series) for name, series in in_v_star.items()}


@lru_cache(maxsize=8)
def elastic_in_closed_form(digits: int) -> dict[str, PowerExpansion]:
    """Return the first terms of `elastic`, up to relative order v*^3, in closed form by the Gamma function.

    The first terms left out are those in v*^6 of 1 - eps, and in v*^4 of x_max and tau_c.
    """
    with working(bits_for(digits) + GUARD_BITS):
        g_1 = arb.pi().sqrt() * _ball(fmpq(3, 5)).gamma() / (4 * _ball(fmpq(21, 10)).gamma())
        d_0 = _ball(fmpq(2, 5)).gamma() * arb.pi().sqrt() / (5 * _ball(fmpq(9, 10)).gamma())
        k = (arb(16) / 25).root(5)  # K = k v*^2 + …
        lambda_1 = 2 * k * g_1
        depth, time = (arb(25) / 16).root(5), arb(5).sqrt() / (arb(5) / 4).root(10)
        loss = ((2, lambda_1), (4, -arb(3) / 5 * lambda_1**2), (5, -arb(4) / 15))
        x_max = ((0, depth), (2, -arb(4) / 5 * depth * k * g_1))
        tau_c = ((0, 2 * time * d_0), (2, time * k * (2 * d_0 * g_1 / 5 - arb(1) / 2)))
        return {
            "one_minus_epsilon": PowerExpansion(loss),
            "x_max": PowerExpansion(x_max),
            "tau_c": PowerExpansion(tau_c),
        }


def _expansion(series: arb_series) -> PowerExpansion:
    terms = tuple((n, c) for n, c in enumerate(series.coeffs()) if not c.is_zero())
    if any(c.contains(0) for _, c in terms):
        raise ArithmeticError("too few digits to tell whether a coefficient is zero")
    return PowerExpansion(terms)


def _in_v_star(series: arb_series, order: int) -> arb_series:
    """Put v*^2 for the variable."""
    coefficients = [arb(0)] * (2 * order + 1)
    coefficients[: 2 * len(series.coeffs()) : 2] = series.coeffs()
    return arb_series(coefficients, 2 * order + 1)


def _mirrored(series: arb_series, order: int) -> arb_series:
    return arb_series([-c if n % 2 else c for n, c in enumerate(series.coeffs())], order + 1)


def _end_of_contact(eps0: arb_series, order: int) -> tuple[arb_series, arb_series]:
    """Return k_0 = eps0/eps, and the time that is missing, in units of K.

    In units of the end (derivation 5), with mu = (4/5) v*^5 sqrt(eps), k^2 = 1 + mu (1 - p^5 - 5 integral
    of k q^2 from p to 1), k_0 = k(0), and the time from there to x = 0 is the integral of p/k from 0 to 1. mu itself
    follows from delta = (4/5) v*^5 sqrt(eps0) = mu sqrt(k_0(mu)).
    """
    length = 2 * order // 5 + 2
    k, inverse = [fmpq_poly([1])], [fmpq_poly([1])]
    for n in range(1, length):
        integral = (k[n - 1] * fmpq_poly([0, 0, 1])).integral()
        right = 5 * (integral - integral(fmpq(1))) + (fmpq_poly([1, 0, 0, 0, 0, -1]) if n == 1 else 0)
        k.append((right - sum((k[i] * k[n - i] for i in range(1, n)), fmpq_poly())) / 2)
        inverse.append(-sum((k[i] * inverse[n - i] for i in range(1, n + 1)), fmpq_poly()))
    k_0 = arb_series([_ball(k_n[0]) for k_n in k], length)
    missing = [_ball((e * fmpq_poly([0, 1])).integral()(fmpq(1))) for e in inverse]
    mu_of_delta = (arb_series([0, 1], length) * k_0.sqrt()).reversion().coeffs()
    delta = arb_series([0] * 5 + [arb(4) / 5], 2 * order + 1) * eps0.sqrt()
    mu = _at_series(mu_of_delta, delta)
    return _at_series(k_0.coeffs(), mu), _at_series(missing, mu)


def _at_series(coefficients: list[arb], value: arb_series) -> arb_series:
    """Return a polynomial's value; unlike the composition of power series it may be 0."""
    total = arb_series([0], value.prec)
    for c in reversed(coefficients):
        total = total * value + c
    return total


@lru_cache(maxsize=8)
def turning_point_series(order: int, digits: int) -> tuple[list[arb], list[arb]]:
    """Return G_0 … G_order and D_0 … D_order.

    With y = 1 - r, g_n = y^((n+1)/2) f_n(y) and [1/g]_n = y^((n-1)/2) e_n(y); the singularities of f_n and e_n next to
    0 are at |y| = 2 sin(pi/5) = 1.17…, beyond r = 0.
    """
    bits = bits_for(digits) + GUARD_BITS + 8 * order
    length = int(bits / _ELASTIC_GROWTH)
    with working(bits, length):
        f = [arb_series([5, -10, 10, -5, 1], length).sqrt()]  # 1 - r^5 = y f_0^2
        e = [1 / f[0]]
        for n in range(1, order + 1):
            work = _integrated(f[n - 1] * arb_series([5, -10, 5], length), n + 2)
            f.append((work - sum((f[i] * f[n - i] for i in range(1, n)), arb_series([0], length))) * e[0] / 2)
            e.append(-sum((f[i] * e[n - i] for i in range(1, n + 1)), arb_series([0], length)) * e[0])
        times = [_integrated(e_n * arb_series([1, -1], length), n + 1) for n, e_n in enumerate(e)]
        return [_sum(f_n, _ELASTIC_GROWTH) for f_n in f], [_sum(time, _ELASTIC_GROWTH) for time in times]


def _integrated(series: arb_series, n: int) -> arb_series:
    """Return y^(-n/2) times the integral of y^(n/2 - 1) series."""
    return arb_series([2 * c / (n + 2 * j) for j, c in enumerate(series.coeffs())], series.prec)


def _sum(series: arb_series, growth: float) -> arb:
    """Return the sum of the coefficients; the remainder is estimated by the last ones, which fall by 2^-growth each."""
    coefficients = series.coeffs()
    last = max((abs(c).abs_upper() for c in coefficients[series.prec - _ROUND :]), default=arb(0))
    return sum(coefficients, arb(0)) + arb(0, (last * (4 / growth)).abs_upper())


def _ball(number: fmpq) -> arb:
    return arb(number.p) / arb(number.q)


# --- v* -> infinity ---------------------------------------------------------------------------------------------------


@lru_cache(maxsize=8)
def viscous(order: int, digits: int) -> dict[str, LogExpansion]:
    """Return eps, x_max and tau_c for v* -> infinity, to W^-order relative to the first term."""
    constant, time = way_in(order, digits)
    length = order + 1
    near = near_turning_point(length)
    with working(bits_for(digits) + GUARD_BITS):
        turn = _solved(constant, lambda y: _at_turning_point(y, near, length), length)
        end = _solved(constant, lambda y: _at_end(y, near, length), length)
        ratio = _times(end, end, length)
        lasted = [a - b for a, b in zip(_end_time(end, near, length), time, strict=True)]
        root, slow = arb(12).root(5), Fraction(-2, 5)
        return {
            "epsilon": LogExpansion(arb(3), Fraction(-1), tuple(ratio)),
            "x_max": LogExpansion(root**4 / 4, slow, tuple(_times(turn, turn, length))),
            "tau_c": LogExpansion(1 / root, slow, tuple(lasted)),
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


@lru_cache(maxsize=8)
def near_turning_point(order: int) -> NearTurningPoint:
    """Return the expansions near the turning point, to z^-order."""
    q: list[_Laurent] = [{}]
    right: _Laurent = {-1: fmpq(-2), 1: fmpq(0), 2: fmpq(2)}  # of sigma q_1'
    for n in range(1, order + 1):
        q_n = {i: c / i for i, c in right.items() if i != 0}
        q_n[0] = -_transported(q_n, n).get(0, fmpq(0)) / n  # so that no ln(sigma) comes with the next one
        q.append(q_n)
        right = _transported(q_n, n)
    return NearTurningPoint(q, [sum(q_n.values(), fmpq(0)) for q_n in q], _end_values(order), _times_near(order))


def _transported(q_n: _Laurent, n: int) -> _Laurent:
    """Return -2 (1 - sigma)^2 q_n' + n (1 - sigma) q_n, which is sigma q_(n+1)'."""
    result: _Laurent = {}
    for i, c in q_n.items():
        for power, factor in ((i - 1, -2 * i), (i, 4 * i + n), (i + 1, -2 * i - n)):
            result[power] = result.get(power, fmpq(0)) + factor * c
    return result


def _end_values(order: int) -> list[fmpq]:
    """Return the coefficients of ln(z J/2) in 1/z at sigma = 0, where J = -(Q_1/z + Q_2/z^2 + …) of derivation 10."""
    q = [fmpq_poly([0, 1])]  # in s = -sigma
    for n in range(1, order + 3):
        slope = _next_q(fmpq_poly([0, 1]), n)[1]
        if n > 1:
            q[-1] -= fmpq_poly([0, _next_q(q[-1], n)[1] / slope])
        right = _next_q(q[-1], n)
        q.append(fmpq_poly([c / (m - 1) if m != 1 else fmpq(0) for m, c in enumerate(right.coeffs())]))
    values = [-q_n[0] / 2 for q_n in q[1 : order + 2]]
    logarithm = [fmpq(0)]
    for n in range(1, order + 1):
        logarithm.append(values[n] - sum((i * logarithm[i] * values[n - i] for i in range(1, n)), fmpq(0)) / n)
    return logarithm


def _next_q(previous: fmpq_poly, n: int) -> fmpq_poly:
    """Return s Q_n' - Q_n."""
    s_1 = fmpq_poly([1, 1])
    return s_1 * ((n - 7) * previous + 2 * s_1 * (previous + previous.derivative()))


def _times_near(order: int) -> list[list[fmpq_poly]]:
    """Return R_0 … R_order: with a dot for d/d ln J, sigma R_n' + R_n^. is known from R_(n-1)."""
    one_minus, two_plus = fmpq_poly([1, -1]), fmpq_poly([2, 1])
    found: list[list[fmpq_poly]] = [[fmpq_poly()], [fmpq_poly(), fmpq_poly([-2])]]
    for n in range(2, order + 1):
        previous = found[-1]
        dotted = [k * previous[k] for k in range(1, len(previous))] + [fmpq_poly()]
        known = [
            one_minus * ((n - 1) * p - 2 * one_minus * p.derivative() + 2 * two_plus * d)
            for p, d in zip(previous, dotted, strict=True)
        ]
        found.append(_inverted(known))
    return found


def _inverted(known: list[fmpq_poly]) -> list[fmpq_poly]:
    """Return the R with sigma R' + R^. = known, and no constant."""
    degree = max(p.degree() for p in known)
    table = [[fmpq(0)] * (degree + 1) for _ in range(len(known) + 1)]
    for i in range(degree + 1):
        for k in range(len(known), -1, -1):
            if i:
                above = (k + 1) * table[k + 1][i] if k < len(known) else fmpq(0)
                table[k][i] = ((known[k][i] if k < len(known) else fmpq(0)) - above) / i
            elif k:
                table[k][0] = known[k - 1][0] / k
    return [fmpq_poly(row) for row in table]


# --- the way in -------------------------------------------------------------------------------------------------------


@lru_cache(maxsize=8)
def way_in(order: int, digits: int) -> tuple[_Polynomials, _Polynomials]:
    """Return the constant of the motion and the time at the start of a collision, z = 0, as polynomials in ln C.

    The constant is -C + 6 ln C + sum C^(1-n) mu_n, the time sum C^-n v_n; the lists are mu_1 … and v_1 …. On the way,
    with x = 1 - z/C, x^(n-1) mu_n and x^(n-1) v_n are polynomials in ln(C x) whose coefficients are power series in
    x. They converge for |x| < sqrt(3), beyond the start, x = 1.
    """
    near = near_turning_point(order + 1)
    bits = bits_for(digits) + GUARD_BITS + 8 * order
    length = int(bits / _VISCOUS_GROWTH)
    with working(bits, length):
        rho, x = arb_series([1, -1], length), arb_series([0, 1], length)
        over_p = 1 / arb_series([1, -1, arb(1) / 3], length)  # x/P_0 of derivation 10
        drag = rho**4 * over_p
        constant = _way(drag, (drag, -6 * x * drag), 1, _constant_matches(near, order + 1))
        time = _way(drag, (-2 * rho * over_p, 0 * x), 0, _time_matches(near, order + 1))
    return constant, time


def _way(drag: arb_series, sources: tuple[arb_series, arb_series], power: int, matches: list[fmpq]) -> _Polynomials:
    """Return the first coefficients at x = 1, as many as there are matches.

    With f_n = x^(n-1) mu_n (power 1) or x^(n-1) v_n (power 0) and theta = x d/dx + d/d ln(C x),
    (theta + 1 - n) f_n = right_n = source_n - drag (right_(n-1) - (1 - power) x f_(n-1) - x^2 df_(n-1)/dx).
    In f_n the coefficient of x^(n-1) without a logarithm is free: it is matched.
    """
    length = drag.prec
    step = arb_series([0, 1 - power], length)
    right: list[arb_series] = []
    found: list[arb_series] = []
    values: _Polynomials = []
    for n, match in enumerate(matches, 1):
        right.append(arb_series([0], length))  # f_n has a power of the logarithm more than right_n
        if found:
            slopes = (arb_series([arb(0), *(j * c for j, c in enumerate(f.coeffs()))], length) for f in found)
            right = [-drag * (r - step * f - slope) for r, f, slope in zip(right, found, slopes, strict=True)]
        if n <= len(sources):
            right[0] += sources[n - 1]
        found = _with_logarithms(right, n, match, length)
        values.append(arb_poly([_sum(f, _VISCOUS_GROWTH) for f in found]))
    return values


def _with_logarithms(right: list[arb_series], n: int, match: fmpq, length: int) -> list[arb_series]:
    """Return the f_n with (theta + 1 - n) f_n = right, by the power of the logarithm."""
    known = [[r[j] for j in range(length)] for r in right]
    above = [arb(0)] * length
    found: list[list[arb]] = []
    for k in range(len(known), -1, -1):
        now = [arb(0)] * length
        for j in range(length):
            if j != n - 1:
                now[j] = ((known[k][j] if k < len(known) else 0) - (k + 1) * above[j]) / (j + 1 - n)
        now[n - 1] = known[k - 1][n - 1] / k if k else _ball(match)
        found.append(now)
        above = now
    return [arb_series(row, length) for row in reversed(found)]


def _constant_matches(near: NearTurningPoint, order: int) -> list[fmpq]:
    """Return the free coefficients of mu_1 … mu_order: of C^(1-n), constant in omega = C x and ln(omega).

    Near the turning point z = C (1 - x), sigma = 1 + omega h(x), h = (1 - x + x^2/3)/(1 - x)^2.
    """
    found = [fmpq(-1)]
    for n in range(2, order + 1):
        a = n - 1
        total = -fmpq((-1) ** a, a) * _h_power(-a, 0, a)[a]  # of ln(sigma)
        for m in range(1, n):
            a = n - 1 - m
            weight = sum((c * _binomial(i, i + a) for i, c in near.q[m].items()), fmpq(0))
            total += weight * _h_power(-a, m, a)[a]
        found.append(total)
    return found


def _time_matches(near: NearTurningPoint, order: int) -> list[fmpq]:
    """Return the free coefficients of v_1 … v_order: of C^-n, constant in omega = C x and ln(omega).

    With d = 1/omega, sigma d and (ln J) d without its ln(omega) are power series in x and d; 1/z = d x/(1 - x).
    """
    sigma = [_h_power(1, 0, order), fmpq_poly([1])]
    log_j = [fmpq_poly(), _log_h(order)]
    log_j += [fmpq(-((-1) ** b), b) * _h_power(-b, 0, order) for b in range(1, order)]
    for n in range(1, order + 1):
        for i, c in near.q[n].items():
            for b in range(order + i - n):  # d^(n - i + b) h^(i - b)
                _add(log_j, n - i + b + 1, c * _binomial(i, b) * _h_power(i - b, n, order).left_shift(n))
    powers = [_power_table(series, order) for series in (sigma, log_j)]
    found = []
    for n in range(1, order + 1):
        total = fmpq(0)
        for m in range(1, n + 1):
            start = _h_power(0, m, n)
            for k, by_sigma in enumerate(near.time[m]):
                for i, c in enumerate(by_sigma.coeffs()):
                    if c != 0 and i + k <= n:
                        total += c * _product_at(powers[0][i], powers[1][k], n - m + i + k, start, n - m)
        found.append(total)
    return found


_Bivariate = list[fmpq_poly]
"""Power series in d whose coefficients are power series in x."""


def _power_table(series: _Bivariate, order: int) -> list[_Bivariate]:
    """Return the powers 0 … order of a series."""
    table = [[fmpq_poly([1])]]
    for _ in range(order):
        product: _Bivariate = []
        for i, a in enumerate(table[-1]):
            for j, b in enumerate(series[: order + 1 - i]):
                _add(product, i + j, (a * b).truncate(order + 1))
        table.append(product)
    return table


def _add(series: _Bivariate, n: int, term: fmpq_poly) -> None:
    series.extend([fmpq_poly()] * (n + 1 - len(series)))
    series[n] += term


def _product_at(a: _Bivariate, b: _Bivariate, in_d: int, factor: fmpq_poly, in_x: int) -> fmpq:
    """Return a coefficient of a b factor."""
    pairs = ((a[i], b[in_d - i]) for i in range(len(a)) if 0 <= in_d - i < len(b))
    return (sum((p * q for p, q in pairs), fmpq_poly()) * factor)[in_x]


def _h_power(exponent: int, inverse: int, order: int) -> fmpq_poly:
    """Return h^exponent (1-x)^-inverse to x^order, h = (1 - x + x^2/3)/(1 - x)^2."""
    top = [fmpq(1)]
    for n in range(1, order + 1):
        terms = ((k * (exponent + 1) - n) * c * top[n - k] for k, c in ((1, fmpq(-1)), (2, fmpq(1, 3))) if k <= n)
        top.append(sum(terms, fmpq(0)) / n)
    power = -2 * exponent - inverse
    bottom = fmpq_poly([(-1) ** n * _binomial(power, n) for n in range(order + 1)])
    return (fmpq_poly(top) * bottom).truncate(order + 1)


def _log_h(order: int) -> fmpq_poly:
    """Return ln h to x^order: x times its derivative is (-x + 2/3 x^2)/(1 - x + x^2/3) + 2 x/(1 - x)."""
    slope = fmpq_poly([0, -1, fmpq(2, 3)]) * _h_power(-1, 2, order) + fmpq_poly([0, *[2] * order])
    return fmpq_poly([slope[n] / n if n else fmpq(0) for n in range(order + 1)])


def _binomial(n: int, k: int) -> fmpq:
    result = fmpq(int(k >= 0))
    for i in range(k):
        result = result * (n - i) / (i + 1)
    return result


# --- series in u = 1/W whose coefficients are polynomials in lambda ---------------------------------------------------


def _at_turning_point(y: _Polynomials, near: NearTurningPoint, length: int) -> _Polynomials:
    """Return the constant less 6 ln W - W + W (1 - y), at z = Z = W y and sigma = 1."""
    ours: _Polynomials = [arb_poly([_ball(c)]) for c in near.turning[:length]]
    ours[0] -= 1
    return _sum_of(_in_powers(ours, y, length), _scaled(_log(y, length), 6))


def _at_end(y: _Polynomials, near: NearTurningPoint, length: int) -> _Polynomials:
    """Return the constant less 6 ln W - W + W (1 - y), at z = z_e = W y and sigma = 0."""
    return _sum_of(_log_j_at_end(y, near, length), _scaled(_log(y, length), 6))


def _log_j_at_end(y: _Polynomials, near: NearTurningPoint, length: int) -> _Polynomials:
    """Return ln J at the end of contact, ln 2 - ln(z_e) + …."""
    series = _in_powers([arb_poly([_ball(c)]) for c in near.end[:length]], y, length)
    series[0] += arb_poly([arb.const_log2(), -1])
    return _sum_of(series, _scaled(_log(y, length), -1))


def _end_time(y: _Polynomials, near: NearTurningPoint, length: int) -> _Polynomials:
    """Return W times the time at the end of contact, z_e = W y."""
    log_j = _log_j_at_end(y, near, length)
    one = _constant(1, length)
    total = _constant(0, length)
    over_z = _to_the(y, arb(-1), length)  # W/z_e
    for n in range(length, 0, -1):
        value = _constant(0, length)
        for polynomial in reversed(near.time[n]):
            value = _sum_of(_times(value, log_j, length), _scaled(one, _ball(polynomial[0])))
        total = _times(_sum_of(_shift(total), value), over_z, length)
    return total


def _solved(constant: _Polynomials, there: Callable[[_Polynomials], _Polynomials], length: int) -> _Polynomials:
    """Return y = z/W from 6 ln W - W + W (1 - y) + there(y) = the constant at the start; each turn gives a term."""
    y = _constant(1, length)
    for _ in range(length):
        difference = [a - b for a, b in zip(there(y), constant, strict=True)]
        y = _sum_of(_constant(1, length), _shift(difference))
    return y


def _in_powers(outer: _Polynomials, y: _Polynomials, length: int) -> _Polynomials:
    """Return sum u^n y^-n p_n of constant p_n."""
    over_y, total = _to_the(y, arb(-1), length), _constant(0, length)
    for polynomial in reversed(outer):
        total = _shift(_times(total, over_y, length))
        total[0] += polynomial
    return total


def _constant(value: int, length: int) -> _Polynomials:
    return [arb_poly([value]) if n == 0 else arb_poly() for n in range(length)]


def _shift(series: _Polynomials) -> _Polynomials:
    """Return u times the series."""
    return [arb_poly(), *series[:-1]]


def _scaled(series: _Polynomials, factor: arb | int) -> _Polynomials:
    return [p * factor for p in series]


def _sum_of(a: _Polynomials, b: _Polynomials) -> _Polynomials:
    return [p + q for p, q in zip(a, b, strict=True)]


def _times(a: _Polynomials, b: _Polynomials, length: int) -> _Polynomials:
    return [sum((a[i] * b[n - i] for i in range(n + 1)), arb_poly()) for n in range(length)]


def _log(y: _Polynomials, length: int) -> _Polynomials:
    """Return ln y, y = 1 + O(u)."""
    found = [arb_poly()]
    for n in range(1, length):
        found.append(y[n] - sum((found[k] * k * y[n - k] for k in range(1, n)), arb_poly()) * (arb(1) / n))
    return found


def _to_the(y: _Polynomials, exponent: arb, length: int) -> _Polynomials:
    """Return y^exponent, y = 1 + O(u)."""
    found = [arb_poly([1])]
    for n in range(1, length):
        terms = (y[k] * found[n - k] * (k * (exponent + 1) - n) for k in range(1, n + 1))
        found.append(sum(terms, arb_poly()) * (arb(1) / n))
    return found
