"""Symbolic derivation of the series: the hierarchy of equations, the rational H_k, h_k as polynomials in lambda_k.

The way from the scaled equation to eps = 1 + sum h_k v*^k (eq:epsSeriesAdvanced) in exact terms:

1. `turning_point_equation`: time eliminated, compression measured by the turning point (section 2.2);
2. `hierarchy`: its perturbation equations, one per order in K, whose end values are G_n = g_n(0);
3. `lambda_from_G`: the odd function of time reversal, lambda_1, lambda_3, … in the G_n (section 2.4);
4. `delayed_recovery_series`: the rational series H of the delayed recovery (section 2.3);
5. `h_polynomial`: every h_k as a polynomial with rational coefficients in lambda_1, lambda_3, ….

G_1, G_2, G_3, and with them lambda_1 and lambda_3, are known in terms of the Gamma function (`g_1_at_0` …).
`derivations/03_turning_point.py` to `08_closed_forms.py` derive all of this.
"""

from __future__ import annotations

from collections.abc import Iterator
from fractions import Fraction
from functools import lru_cache
from math import factorial, prod
from typing import SupportsIndex

import sympy as sp
from flint import fmpq, fmpq_poly

from viscopade import arguments
from viscopade.theory.equation import scaled_equation

r = sp.Symbol("r", positive=True)
"""sqrt(x/x_max), from 0 at first contact to 1 at the turning point."""
K = sp.Symbol("K", real=True)
"""sqrt(4/5) kappa x_max^(1/4), the parameter of the curve (kappa, eps0); unloading is loading with -K."""
g = sp.Function("g", nonnegative=True)(r)
"""|x'| / (sqrt(4/5) x_max^(5/4)), the speed."""

_KAPPA_SCALE = sp.Rational(5, 4) ** sp.Rational(2, 5)  # of kappa = (5/4)^(2/5) K V(K)^(1/5)

# --- the turning point and the hierarchy --------------------------------------------------------------------


def turning_point_equation() -> sp.Eq:
    """Return d(g^2)/dr = -5 r^4 - 5 K g r^2, the loading phase without time (section 2.2).

    It follows from eq:equationOfMotionNatUnit by x = x_max r^2, x' = sqrt(4/5) x_max^(5/4) g(r) and
    kappa = sqrt(5/4) K x_max^(-1/4). The initial condition is g(1) = 0. Unloading is the same with -K for K.

    Returns
    -------
    sympy.Eq
        In the module's symbols `r`, `K` and `g`.
    """
    equation = scaled_equation()
    x, tau = equation.x, equation.tau
    x_max = sp.Symbol("x_max", positive=True)
    compression = x_max * r**2
    speed = sp.sqrt(sp.Rational(4, 5)) * x_max ** sp.Rational(5, 4) * g
    acceleration = speed * speed.diff(r) / compression.diff(r)  # x'' = x' dx'/dx
    kappa = sp.sqrt(sp.Rational(5, 4)) * K * x_max ** sp.Rational(-1, 4)
    in_r = equation.lhs.subs(x.diff(tau, 2), acceleration).subs(x.diff(tau), speed).subs(x, compression)
    (slope,) = sp.solve(in_r.subs(equation.kappa, kappa), g.diff(r))
    return sp.Eq(sp.Derivative(g**2, r), sp.expand(2 * g * slope))


def g_function(n: SupportsIndex) -> sp.Expr:
    """Return g_n(r), the coefficient of K^n in g (section 2.2), as an applied SymPy function.

    Raises
    ------
    TypeError, ValueError
        If `n` is not an integer from 0 to 1000.
    """
    return sp.Function(f"g_{arguments.integer('n', n, 0, arguments.MAX_ORDER)}")(r)


def hierarchy(n: SupportsIndex) -> sp.Eq:
    """Return the equation of order K^n that g = sum K^n g_n(r) gives in the turning point equation.

    It is linear in g_n if n >= 1, and integrates to the recursion of section 2.2. The initial condition is
    g_n(1) = 0.

    Parameters
    ----------
    n : int
        Order, 0 to 1000.

    Returns
    -------
    sympy.Eq
        d(g^2)/dr on the left, in `g_function(0)` … `g_function(n)` and `r`.

    Raises
    ------
    TypeError, ValueError
        If `n` is not an integer from 0 to 1000.
    """
    n = arguments.integer("n", n, 0, arguments.MAX_ORDER)
    equation = turning_point_equation()
    ansatz = sum(K**i * g_function(i) for i in range(n + 1))
    sides = (side.subs(g, ansatz).doit().expand().coeff(K, n) for side in equation.args)
    return sp.Eq(*sides)


# --- the end of contact -------------------------------------------------------------------------------------


def delayed_recovery_series(order: SupportsIndex) -> tuple[Fraction, ...]:
    """Return H_0 … H_order of eps = eps0 H(delta), delta = (4/5) v*^5 sqrt(eps0), exactly (section 2.3).

    Parameters
    ----------
    order : int
        Highest power of delta, 0 to 1000.

    Returns
    -------
    tuple of fractions.Fraction, length order + 1
        1, 1/3, 13/96, 4897/82368, ….

    Raises
    ------
    TypeError, ValueError
        If `order` is not an integer from 0 to 1000.

    Notes
    -----
    With h = sum delta^j h_j(s) the defining problem h^2 = 1 - delta s^5 + 5 delta int_0^s h q^2 dq gives
    polynomials h_j. Contact ends where s^2 = h, so that H = sum delta^j h_j(sqrt(H)): as h_0 = 1, coefficient
    n of the right side needs H_0 … H_(n-1) only.
    """
    return _end_series(arguments.order(order))


@lru_cache(maxsize=8)
def _end_series(order: int) -> tuple[Fraction, ...]:
    polynomials = _unloading_polynomials(order)
    end_values = [fmpq(1)]
    powers = [[fmpq(1)] for _ in range(5 * order + 1)]  # powers[m][i]: coefficient i of H^(m/2)
    for n in range(1, order + 1):
        terms = (c * powers[m][n - j] for j in range(1, n + 1) for m, c in enumerate(polynomials[j]))
        end_values.append(sum(terms, fmpq(0)))
        for m, power in enumerate(powers):
            power.append(_next_in_power(end_values, power, fmpq(m, 2)))
    return tuple(Fraction(int(value.p), int(value.q)) for value in end_values)


def _unloading_polynomials(order: int) -> list[list[fmpq]]:
    """Return the coefficients of h_0(s) … h_order(s), ascending."""
    h = [fmpq_poly([1])]
    for j in range(1, order + 1):
        right = 5 * (h[j - 1] * fmpq_poly([0, 0, 1])).integral()
        if j == 1:
            right -= fmpq_poly([0, 0, 0, 0, 0, 1])
        products = sum((h[i] * h[j - i] for i in range(1, j)), fmpq_poly())
        h.append((right - products) / 2)
    return [polynomial.coeffs() for polynomial in h]


def _next_in_power(base: list[fmpq], power: list[fmpq], exponent: fmpq) -> fmpq:
    """Return the coefficient after `power` of base^exponent, base[0] = 1, from (f^a)' f = a f^a f'."""
    n = len(power)
    return sum(((i * (exponent + 1) - n) * base[i] * power[n - i] for i in range(1, n + 1)), fmpq(0)) / n


# --- time reversal and the coefficients ---------------------------------------------------------------------


def lambda_symbol(k: SupportsIndex) -> sp.Symbol:
    """Return the symbol lambda_k, the coefficient of nu^k in the odd function Lambda(nu) (section 2.4).

    Raises
    ------
    TypeError, ValueError
        If `k` is not an odd integer from 1 to 999.
    """
    return sp.Symbol(f"lambda_{_odd(k)}", positive=True)


def G_symbol(n: SupportsIndex) -> sp.Symbol:
    """Return the symbol G_n, the coefficient of K^n in V(K) = g(0) (section 2.2).

    Raises
    ------
    TypeError, ValueError
        If `n` is not an integer from 1 to 1000; G_0 = 1.
    """
    return sp.Symbol(f"G_{arguments.integer('n', n, 1, arguments.MAX_ORDER)}", positive=True)


def lambda_from_G(k: SupportsIndex) -> sp.Expr:
    """Return lambda_k as a polynomial in G_1 … G_k, times (4/5)^(2k/5) (sections 2.2 and 2.4).

    Parameters
    ----------
    k : int
        Odd, 1 to 999.

    Raises
    ------
    TypeError, ValueError
        If `k` is not an odd integer from 1 to 999.

    Notes
    -----
    Let ln V(K) = E(K) + O(K), even and odd. Then Lambda = -ln eps0 = 2 O(K), and
    nu = kappa eps0^(1/10) = (5/4)^(2/5) K exp(E/5). Lagrange's inversion gives
    lambda_k = (2/k) (5/4)^(-2k/5) [K^(k-1)] O'(K) exp(-k E/5).
    """
    k = _odd(k)
    domain, *symbols = sp.ring([G_symbol(n) for n in range(1, k + 1)], sp.QQ)
    values = [domain.one, *symbols]
    logarithm = [domain.zero]
    for n in range(1, k + 1):
        known = sum((j * logarithm[j] * values[n - j] for j in range(1, n)), domain.zero)
        logarithm.append(values[n] - known * sp.QQ(1, n))
    power = [domain.one]  # exp(-k E/5), odd coefficients left zero
    for n in range(1, k):
        even = sum((j * logarithm[j] * power[n - j] for j in range(2, n + 1, 2)), domain.zero)
        power.append(even * sp.QQ(-k, 5 * n))
    polynomial = sum((n * logarithm[n] * power[k - n] for n in range(1, k + 1, 2)), domain.zero)
    return sp.expand(polynomial.as_expr() * sp.Rational(2, k)) * _KAPPA_SCALE**-k


def h_polynomial(k: SupportsIndex) -> sp.Expr:
    """Return h_k of eq:epsSeriesAdvanced as a polynomial in lambda_1, lambda_3, … (section 2.4).

    Parameters
    ----------
    k : int
        Order in v*, 0 to 1000; the number of terms grows like that of the partitions of k/2 into odd parts.

    Returns
    -------
    sympy.Expr
        Expanded, with rational coefficients: h_2 = -lambda_1, h_4 = 3/5 lambda_1^2, h_5 = 4/15, ….

    Raises
    ------
    TypeError, ValueError
        If `k` is not an integer from 0 to 1000.

    Notes
    -----
    Let p = 10 + 5j. From eps = sum_j H_j (4/5)^j v*^(5j) eps0^(p/10), eps0 = exp(-Lambda(nu)),
    nu = kappa eps0^(1/10) and Lagrange's inversion, with the sum over 5j + 2n = k,

        h_k = sum H_j (4/5)^j p/(p+n) [nu^n] exp(-(p+n)/10 Lambda(nu)).
    """
    k = arguments.integer("k", k, 0, arguments.MAX_ORDER)
    terms: list[sp.Expr] = []
    for j, end_value in enumerate(delayed_recovery_series(k // 5)):
        n, odd = divmod(k - 5 * j, 2)
        if not odd:
            p = 10 + 5 * j
            factor = end_value * Fraction(4, 5) ** j * Fraction(p, p + n)
            terms += _exponential_terms(factor, Fraction(-(p + n), 10), n)
    return sp.Add(*terms)


def _exponential_terms(factor: Fraction, rate: Fraction, n: int) -> Iterator[sp.Expr]:
    """Yield the monomials of factor [nu^n] exp(rate Lambda(nu))."""
    for partition in _odd_partitions(n, n):
        weight = factor * prod(rate**times / factorial(times) for times in partition.values())
        monomial = sp.Mul(*(lambda_symbol(part) ** times for part, times in partition.items()))
        yield sp.Rational(weight.numerator, weight.denominator) * monomial


def _odd_partitions(n: int, largest: int) -> Iterator[dict[int, int]]:
    """Yield the partitions of n into odd parts up to `largest`, as {part: multiplicity}."""
    if n == 0:
        yield {}
        return
    for part in range(min(n, largest) - 1 | 1, 0, -2):
        for times in range(n // part, 0, -1):
            for rest in _odd_partitions(n - part * times, part - 2):
                yield {part: times, **rest}


def _odd(k: SupportsIndex) -> int:
    k = arguments.integer("k", k, 1, arguments.MAX_ORDER - 1)
    if k % 2 == 0:
        raise ValueError(f"k is {k}: accepted is an odd integer, for Lambda is odd (section 2.4)")
    return k


# --- closed forms -------------------------------------------------------------------------------------------


def g_1_at_0() -> sp.Expr:
    """Return G_1 = B(3/5, 3/2)/2 in terms of the Gamma function (section 2.2)."""
    return sp.sqrt(sp.pi) * sp.gamma(sp.Rational(3, 5)) / (4 * sp.gamma(sp.Rational(21, 10)))


def g_2_at_0() -> sp.Expr:
    """Return G_2 = 3/5 G_1^2 - 25/132.

    Proven in derivations/08_closed_forms.py.
    """
    return sp.Rational(3, 5) * g_1_at_0() ** 2 - sp.Rational(25, 132)


def g_3_at_0() -> sp.Expr:
    """Return G_3 = 7/25 G_1^3 - 5/22 G_1 + 125/2904 B(9/5, 1/2).

    Proven in derivations/08_closed_forms.py.
    """
    g_1 = g_1_at_0()
    return sp.Rational(7, 25) * g_1**3 - sp.Rational(5, 22) * g_1 + sp.Rational(125, 2904) * _beta_9_5()


def lambda_1() -> sp.Expr:
    """Return lambda_1 = 2 (4/5)^(2/5) G_1 = 1.153… in terms of the Gamma function (section 2.4)."""
    five, two = sp.Integer(5) ** sp.Rational(2, 5), sp.Integer(2) ** sp.Rational(1, 5)
    return sp.sqrt(sp.pi) * sp.gamma(sp.Rational(3, 5)) / (five * two * sp.gamma(sp.Rational(21, 10)))


def lambda_3() -> sp.Expr:
    """Return lambda_3 = 125/1452 (4/5)^(6/5) B(9/5, 1/2) - lambda_1^3/600 = 0.0906….

    Proven in derivations/08_closed_forms.py.
    """
    return sp.Rational(125, 1452) * _KAPPA_SCALE**-3 * _beta_9_5() - lambda_1() ** 3 / 600


def _beta_9_5() -> sp.Expr:
    """Return B(9/5, 1/2)."""
    return sp.sqrt(sp.pi) * sp.gamma(sp.Rational(9, 5)) / sp.gamma(sp.Rational(23, 10))
