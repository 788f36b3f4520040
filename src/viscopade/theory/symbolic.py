"""Symbolic derivation of the series: the hierarchy of equations, the rational H_k, h_k as polynomials in lambda_k.

The way from the scaled equation of motion of two bodies in contact to their coefficient of restitution
eps = 1 + sum h_k v*^k (the paper's Eq. 7), v* the scaled speed of impact, in exact terms:

1. `turning_point_equation`: time eliminated, compression measured by the turning point;
2. `hierarchy`: its perturbation equations, one per order in K, whose end values are G_n = g_n(0);
3. `lambda_from_G`: time reversal makes ln eps0 = -Lambda(kappa eps0^c) an odd function, c = 1/nu - 1/2, where
   eps0 = V(-K)/V(K), V(K) = sum G_n K^n, is the restitution if contact ends at x = 0; its coefficients lambda_1,
   lambda_3, … in the G_n;
4. `delayed_recovery_series`: the rational series H of the delayed recovery, eps = eps0 H;
5. `h_polynomial`: every h_k as a polynomial with rational coefficients in lambda_1, lambda_3, ….

Laws: nu = (a + 1)/(b + 1) = n_a/n_b in lowest terms, and eps is a series in v* = kappa^(1/d), d = n_a - n_b. For the
paper's law a = 3/2, b = 1/2, n_a = 5, n_b = 3, d = 2.

G_1, and with it lambda_1, is known in terms of the Gamma function for every law of contact, G_2, G_3 and lambda_3 for
the paper's (`g_1_at_0` …). `derivations/03_turning_point.py` to `08_closed_forms.py` derive all of this for the
paper's law, `15_laws.py` for the others.
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
from viscopade.theory.equation import rational, scaled_equation
from viscopade.theory.law import VISCOELASTIC, Law, law_of

r = sp.Symbol("r", positive=True)
"""(x/x_max)^((b+1)/n_b), from 0 at first contact to 1 at the turning point; sqrt(x/x_max) for the paper's law."""
K = sp.Symbol("K", real=True)
"""sqrt(2/(a+1)) kappa x_max^(b-(a-1)/2), the parameter of the curve (kappa, eps0); unloading is loading with -K."""
g = sp.Function("g", nonnegative=True)(r)
"""|x'| / (sqrt(2/(a+1)) x_max^((a+1)/2)), the speed."""


def _kappa_scale(law: Law) -> sp.Expr:
    """Return ((a+1)/2)^(1-1/nu) of kappa = ((a+1)/2)^(1-1/nu) K V(K)^(2/nu-1)."""
    base, power = law.kappa_scale
    return rational(base) ** rational(power)


# --- the turning point and the hierarchy --------------------------------------------------------------------


def turning_point_equation(law: Law | str = VISCOELASTIC) -> sp.Eq:
    """Return d(g^2)/dr = -n_a r^(n_a-1) - n_a K g r^(n_b-1), the loading phase without time.

    For the paper's law it is d(g^2)/dr = -5 r^4 - 5 K g r^2. It follows from the scaled equation
    (the paper's Eq. 9) by x = x_max r^(n_b/(b+1)), x' = sqrt(2/(a+1)) x_max^((a+1)/2) g(r) and
    kappa = sqrt((a+1)/2) K x_max^((a-1)/2-b). The initial condition is g(1) = 0. Unloading is the same with -K for K.

    Returns
    -------
    sympy.Eq
        In the module's symbols `r`, `K` and `g`.
    """
    law = law_of(law)
    equation = scaled_equation(law)
    x, tau, a, b = equation.x, equation.tau, rational(law.elastic), rational(law.damping)
    x_max = sp.Symbol("x_max", positive=True)
    # `equation.lhs` is x'' + x^a + kappa x^b x'; into it go x = x_max r^(n_b/(b+1)), x' = sqrt(2/(a+1)) x_max^((a+1)/2)
    # g(r) and x'' = x' dx'/dx = x' (dx'/dr)/(dx/dr).
    compression = x_max * r ** (law.n_b / (b + 1))
    speed = sp.sqrt(2 / (a + 1)) * x_max ** ((a + 1) / 2) * g
    acceleration = speed * speed.diff(r) / compression.diff(r)
    # kappa = sqrt((a+1)/2) K x_max^((a-1)/2-b), which makes x_max drop out
    kappa = sp.sqrt((a + 1) / 2) * K * x_max ** ((a - 1) / 2 - b)
    # The highest derivative first: SymPy would replace x inside x' and x'', too.
    in_r = equation.lhs.subs(x.diff(tau, 2), acceleration).subs(x.diff(tau), speed).subs(x, compression)
    # The equation is linear in g' = slope, and d(g^2)/dr = 2 g g'.
    (slope,) = sp.solve(in_r.subs(equation.kappa, kappa), g.diff(r))
    return sp.Eq(sp.Derivative(g**2, r), sp.expand(2 * g * slope))


def g_function(n: SupportsIndex) -> sp.Expr:
    """Return g_n(r), the coefficient of K^n in g, as an applied SymPy function.

    Raises
    ------
    TypeError, ValueError
        If `n` is not an integer from 0 to 1000.
    """
    return sp.Function(f"g_{arguments.integer('n', n, 0, arguments.MAX_ORDER)}")(r)


def hierarchy(n: SupportsIndex, law: Law | str = VISCOELASTIC) -> sp.Eq:
    """Return the equation of order K^n that g = sum K^n g_n(r) gives in the turning point equation.

    It is linear in g_n if n >= 1, and integrates to a recursion. The initial condition is
    g_n(1) = 0.

    Parameters
    ----------
    n : int
        Order, 0 to 1000.
    law : Law or str
        Law of contact (`law_of`).

    Returns
    -------
    sympy.Eq
        d(g^2)/dr on the left, in `g_function(0)` … `g_function(n)` and `r`.

    Raises
    ------
    TypeError, ValueError
        If `n` is not an integer from 0 to 1000.
    """
    # The largest order, 1000, is a choice of `arguments` for all functions, against typing errors.
    n = arguments.integer("n", n, 0, arguments.MAX_ORDER)
    equation = turning_point_equation(law)
    # Higher orders of g do not reach K^n.
    ansatz = sum(K**i * g_function(i) for i in range(n + 1))
    sides = (side.subs(g, ansatz).doit().expand().coeff(K, n) for side in equation.args)
    return sp.Eq(*sides)


# --- the end of contact -------------------------------------------------------------------------------------


def delayed_recovery_series(order: SupportsIndex, law: Law | str = VISCOELASTIC) -> tuple[Fraction, ...]:
    """Return H_0 … H_order of eps = eps0 H(delta), exactly: 1, 0, 0, … if nothing is delayed.

    delta = 2/(a+1) v*^n_a eps0^((2 n_b - n_a)/d), which is (4/5) v*^5 sqrt(eps0) for the paper's law.

    Parameters
    ----------
    order : int
        Highest power of delta, 0 to 1000.
    law : Law or str
        Law of contact (`law_of`).

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
    Near the end of unloading let g = U h(s), U = V(-K) the speed at x = 0, and r = (K U)^(1/d) s. Then the turning
    point equation with -K becomes h^2 = 1 - delta s^n_a + n_a delta int_0^s h q^(n_b-1) dq (docs/theory/mathematics.md,
    section 5), and h = sum delta^j h_j(s) with polynomials h_j. Contact ends where the force vanishes, r^d = K g, or
    s^d = h, so that H = sum delta^j h_j(H^(1/d)): as h_0 = 1, coefficient n of the right side needs H_0 … H_(n-1) only.
    `series.end_series` has the same numbers by another way.
    """
    return _end_series(arguments.order(order), law_of(law))


@lru_cache(maxsize=8)  # a choice
def _end_series(order: int, law: Law) -> tuple[Fraction, ...]:
    """Return H_0 … H_order of a law from H = sum delta^j h_j(H^(1/d)) (`delayed_recovery_series`).

    derivations/05_end_of_contact.py and 15_laws.py derive this equation.
    """
    if not law.delayed:
        return (Fraction(1), *order * [Fraction(0)])
    polynomials = _unloading_polynomials(order, law)  # h_0, h_1, …
    end_values = [fmpq(1)]  # H_0 = h_0 = 1
    # powers[m][i] is coefficient i of H^(m/d). h_j has the degree n_a j: delta always comes with s^n_a.
    powers = [[fmpq(1)] for _ in range(law.n_a * order + 1)]
    for n in range(1, order + 1):
        # H_n = sum_(1<=j<=n) [delta^(n-j)] h_j(H^(1/d)), with h_j(s) = sum_m c_m s^m.
        terms = (c * powers[m][n - j] for j in range(1, n + 1) for m, c in enumerate(polynomials[j]))
        end_values.append(sum(terms, fmpq(0)))
        # With H_n, coefficient n of all powers follows, which the next orders need.
        for m, power in enumerate(powers):
            power.append(_next_in_power(end_values, power, fmpq(m, law.d)))
    return tuple(Fraction(int(value.p), int(value.q)) for value in end_values)


def _unloading_polynomials(order: int, law: Law) -> list[list[fmpq]]:
    """Return the coefficients of a law's h_0(s) … h_order(s), ascending.

    h = sum delta^j h_j(s) solves h^2 = 1 - delta s^n_a + n_a delta int_0^s h q^(n_b-1) dq.
    """
    h = [fmpq_poly([1])]
    # Order delta^j: 2 h_0 h_j = n_a int_0^s h_(j-1) q^(n_b-1) dq - (s^n_a if j = 1) - sum_(0<i<j) h_i h_(j-i), h_0 = 1.
    for j in range(1, order + 1):
        right = law.n_a * (h[j - 1] * fmpq_poly([*(law.n_b - 1) * [0], 1])).integral()
        if j == 1:
            right -= fmpq_poly([*law.n_a * [0], 1])
        products = sum((h[i] * h[j - i] for i in range(1, j)), fmpq_poly())
        h.append((right - products) / 2)
    return [polynomial.coeffs() for polynomial in h]


def _next_in_power(base: list[fmpq], power: list[fmpq], exponent: fmpq) -> fmpq:
    """Return the coefficient after `power` of base^exponent, base[0] = 1, from (f^a)' f = a f^a f'."""
    # p = f^a: n p_n = sum_(1<=i<=n) (i (a + 1) - n) f_i p_(n-i)
    n = len(power)
    return sum(((i * (exponent + 1) - n) * base[i] * power[n - i] for i in range(1, n + 1)), fmpq(0)) / n


# --- time reversal and the coefficients ---------------------------------------------------------------------


def lambda_symbol(k: SupportsIndex) -> sp.Symbol:
    """Return the symbol lambda_k, the coefficient of x^k in the odd function Lambda(x), x = kappa eps0^c.

    Raises
    ------
    TypeError, ValueError
        If `k` is not an odd integer from 1 to 999.
    """
    return sp.Symbol(f"lambda_{_odd(k)}", positive=True)


def G_symbol(n: SupportsIndex) -> sp.Symbol:
    """Return the symbol G_n, the coefficient of K^n in V(K) = g(0).

    Raises
    ------
    TypeError, ValueError
        If `n` is not an integer from 1 to 1000; G_0 = 1.
    """
    return sp.Symbol(f"G_{arguments.integer('n', n, 1, arguments.MAX_ORDER)}", positive=True)


def lambda_from_G(k: SupportsIndex, law: Law | str = VISCOELASTIC) -> sp.Expr:
    """Return lambda_k as a polynomial in G_1 … G_k, times ((a+1)/2)^(k/nu-k).

    Parameters
    ----------
    k : int
        Odd, 1 to 999.
    law : Law or str
        Law of contact (`law_of`).

    Raises
    ------
    TypeError, ValueError
        If `k` is not an odd integer from 1 to 999.

    Notes
    -----
    Let ln V(K) = E(K) + O(K), even and odd, and c = 1/nu - 1/2, which is 1/10 for the paper's law. Then
    Lambda = -ln eps0 = 2 O(K), and its argument is kappa eps0^c = ((a+1)/2)^(1-1/nu) K exp(2 c E). Lagrange's
    inversion gives lambda_k = (2/k) ((a+1)/2)^(k/nu-k) [K^(k-1)] O'(K) exp(-2 c k E).
    """
    k, law = _odd(k), law_of(law)
    rate = -2 * k * rational(law.c)
    domain, *symbols = sp.ring([G_symbol(n) for n in range(1, k + 1)], sp.QQ)
    G = [domain.one, *symbols]
    # V = sum G_n K^n, and L = ln V from V' = L' V: n G_n = sum_(1<=j<=n) j L_j G_(n-j)
    logarithm = [domain.zero]
    for n in range(1, k + 1):
        lower_orders = sum((j * logarithm[j] * G[n - j] for j in range(1, n)), domain.zero)
        logarithm.append(G[n] - lower_orders * sp.QQ(1, n))
    # P = exp(rate E), E the even part of L, from P' = rate E' P: n P_n = rate sum_(even j<=n) j L_j P_(n-j)
    power = [domain.one]
    for n in range(1, k):
        even = sum((j * logarithm[j] * power[n - j] for j in range(2, n + 1, 2)), domain.zero)
        power.append(even * sp.QQ(rate.p, rate.q * n))
    # [K^(k-1)] O'(K) P(K), O the odd part of L
    polynomial = sum((n * logarithm[n] * power[k - n] for n in range(1, k + 1, 2)), domain.zero)
    return sp.expand(polynomial.as_expr() * sp.Rational(2, k)) * _kappa_scale(law) ** -k


def h_polynomial(k: SupportsIndex, law: Law | str = VISCOELASTIC) -> sp.Expr:
    """Return h_k of the paper's Eq. 7 as a polynomial in lambda_1, lambda_3, ….

    Parameters
    ----------
    k : int
        Order in v*, 0 to 1000; the number of terms grows like that of the partitions of k/2 into odd parts.
    law : Law or str
        Law of contact (`law_of`); v* = kappa^(1/law.d).

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
    Let q = 1 + e j, e = (2 n_b - n_a)/d, and c = 1/nu - 1/2; q = 1 + j/2, c = 1/10 for the paper's law. From
    eps = sum_j H_j (2/(a+1))^j v*^(n_a j) eps0^q, eps0 = exp(-Lambda(x)), x = kappa eps0^c and Lagrange's inversion,
    with the sum over n_a j + d n = k,

        h_k = sum H_j (2/(a+1))^j q/(q + c n) [x^n] exp(-(q + c n) Lambda(x)).
    """
    # The largest order, 1000, is a choice of `arguments` for all functions, against typing errors.
    k, law = arguments.integer("k", k, 0, arguments.MAX_ORDER), law_of(law)
    terms: list[sp.Expr] = []
    # end_value is H_j, j up to k/n_a, and n the power of x with n_a j + d n = k.
    for j, end_value in enumerate(delayed_recovery_series(k // law.n_a, law)):
        n, rest = divmod(k - law.n_a * j, law.d)
        if not rest and end_value:
            q = 1 + law.e * j
            terms += _exponential_terms(end_value * (2 / (law.elastic + 1)) ** j, q, -(q + law.c * n), n)
    return sp.Add(*terms)


def _exponential_terms(factor: Fraction, q: Fraction, rate: Fraction, n: int) -> Iterator[sp.Expr]:
    """Yield the monomials of -factor q/rate [x^n] exp(rate Lambda(x)), also for rate = 0."""
    # n = 0: rate = -q, and the coefficient of x^0 is 1.
    if n == 0:
        yield rational(factor)
        return
    # exp(rate Lambda) = sum_count rate^count Lambda^count/count!, Lambda = sum lambda_part x^part: the monomials of x^n
    # are the partitions of n into odd parts, each with rate^count/(product of times!). One factor rate cancels with
    # 1/rate.
    for partition in _odd_partitions(n, n):
        count = sum(partition.values())
        weight = -factor * q * rate ** (count - 1) / prod(map(factorial, partition.values()))
        monomial = sp.Mul(*(lambda_symbol(part) ** times for part, times in partition.items()))
        yield rational(weight) * monomial


def _odd_partitions(n: int, largest: int) -> Iterator[dict[int, int]]:
    """Yield the partitions of n into odd parts up to `largest`, as {part: multiplicity}."""
    if n == 0:
        yield {}
        return
    # The largest part first, from the largest odd number up to n and `largest` (x - 1 | 1), then the rest by smaller
    # ones.
    for part in range(min(n, largest) - 1 | 1, 0, -2):
        for times in range(n // part, 0, -1):
            for rest in _odd_partitions(n - part * times, part - 2):
                yield {part: times, **rest}


def _odd(k: SupportsIndex) -> int:
    """Return an index of a lambda, which is an odd integer from 1 to 999."""
    # The largest order, 1000, is a choice of `arguments`; 999 is the odd number below.
    k = arguments.integer("k", k, 1, arguments.MAX_ORDER - 1)
    if k % 2 == 0:
        raise ValueError(f"k is {k}: expected an odd integer, because Lambda is odd")
    return k


# --- closed forms -------------------------------------------------------------------------------------------


def g_1_at_0(law: Law | str = VISCOELASTIC) -> sp.Expr:
    """Return G_1 = B(1/nu, 3/2)/2 in terms of the Gamma function."""
    return _beta_1(law_of(law)) / 2


def _beta_1(law: Law) -> sp.Expr:
    """Return B(1/nu, 3/2)."""
    inverse = rational(1 / law.nu)
    return sp.sqrt(sp.pi) * sp.gamma(inverse) / (2 * sp.gamma(inverse + sp.Rational(3, 2)))


def g_2_at_0() -> sp.Expr:
    """Return G_2 = 3/5 G_1^2 - 25/132.

    Proven in derivations/08_closed_forms.py, and read by derivations/14_expansions.py; the series needs G_1 alone.
    """
    return sp.Rational(3, 5) * g_1_at_0() ** 2 - sp.Rational(25, 132)


def g_3_at_0() -> sp.Expr:
    """Return G_3 = 7/25 G_1^3 - 5/22 G_1 + 125/2904 B(9/5, 1/2).

    Proven in derivations/08_closed_forms.py, and read by derivations/14_expansions.py; the series needs G_1 alone.
    """
    g_1 = g_1_at_0()
    return sp.Rational(7, 25) * g_1**3 - sp.Rational(5, 22) * g_1 + sp.Rational(125, 2904) * _beta_9_5()


def lambda_1(law: Law | str = VISCOELASTIC) -> sp.Expr:
    """Return lambda_1 = B(1/nu, 3/2) ((a+1)/2)^(1/nu-1) in terms of the Gamma function.

    It is 2 (4/5)^(2/5) G_1 = 1.153… for the paper's law.
    """
    law = law_of(law)
    return _beta_1(law) / _kappa_scale(law)


def lambda_3() -> sp.Expr:
    """Return lambda_3 = 125/1452 (4/5)^(6/5) B(9/5, 1/2) - lambda_1^3/600 = 0.0906….

    Proven in derivations/08_closed_forms.py.
    """
    return sp.Rational(125, 1452) * _kappa_scale(VISCOELASTIC) ** -3 * _beta_9_5() - lambda_1() ** 3 / 600


def _beta_9_5() -> sp.Expr:
    """Return B(9/5, 1/2)."""
    return sp.sqrt(sp.pi) * sp.gamma(sp.Rational(9, 5)) / sp.gamma(sp.Rational(23, 10))
