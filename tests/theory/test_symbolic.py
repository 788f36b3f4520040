"""The symbolic side: the hierarchy, H, h_k in the lambdas, closed forms; each against another route."""

from fractions import Fraction

import pytest
import sympy as sp
from flint import arb, ctx
from hypothesis import given, settings
from hypothesis import strategies as st
from sympy.polys.ring_series import rs_pow, rs_trunc

from viscopade.theory import symbolic
from viscopade.theory.series import g_coefficients, lambda_coefficients, series
from viscopade.theory.symbolic import (
    G_symbol,
    K,
    delayed_recovery_series,
    g,
    g_function,
    h_polynomial,
    hierarchy,
    lambda_from_G,
    lambda_symbol,
    r,
    turning_point_equation,
)

DIGITS = 60


def sympy_float(ball: arb, digits: int = DIGITS) -> sp.Float:
    """Return the middle of a ball that is known to be narrow enough."""
    return sp.Float(ball.str(digits, radius=False), digits)


def close(a: sp.Expr, b: sp.Expr, digits: int = DIGITS - 5) -> bool:
    return abs(sp.N(a - b, DIGITS)) < sp.Float(10, DIGITS) ** -digits


def weights_and_coefficients(expression: sp.Expr) -> list[tuple[int, sp.Rational]]:
    """Return (weight, coefficient) of every monomial, where lambda_k has weight k."""
    symbols = sorted(expression.free_symbols, key=str)
    terms = sp.Poly(expression, *symbols).terms() if symbols else [((), expression)]
    index = [int(symbol.name.removeprefix("lambda_")) for symbol in symbols]
    return [(sum(i * p for i, p in zip(index, powers, strict=True)), c) for powers, c in terms]


# --- the turning point and the hierarchy ----------------------------------------------------------------------


def test_order_zero_is_the_undamped_motion():
    undamped = hierarchy(0).subs(g_function(0), sp.sqrt(1 - r**5)).doit()
    assert sp.simplify(undamped) == sp.true


def test_hierarchy_sums_up_to_the_equation():
    """The orders 0 … 4 together are the turning point equation for a polynomial g, up to K^4."""
    orders = [1 - r**5, r**3 + 2, r**6 - r, r / 3, r**2 + 5]
    g_sum = sum(K**n * g_n for n, g_n in enumerate(orders))
    equation = turning_point_equation()
    residual = sp.expand((equation.lhs - equation.rhs).subs(g, g_sum).doit())
    for n in range(len(orders)):
        functions = {g_function(i): g_i for i, g_i in enumerate(orders)}
        of_order_n = (hierarchy(n).lhs - hierarchy(n).rhs).subs(functions).doit()
        assert sp.expand(residual.coeff(K, n) - of_order_n) == 0


# --- h_k in the lambdas ---------------------------------------------------------------------------------------


@pytest.mark.parametrize("k", [0, 1, 2, 11, 23, 40, 41])
def test_polynomials_are_expanded_rational_and_homogeneous(k):
    """A monomial of weight n stands with v*^(2n) H_j v*^(5j): 2n + 5j = k."""
    polynomial = h_polynomial(k)
    assert polynomial == sp.expand(polynomial)
    for weight, coefficient in weights_and_coefficients(polynomial):
        assert coefficient.is_Rational
        assert coefficient == 0 or ((k - 2 * weight) % 5 == 0 and 2 * weight <= k)


def test_polynomials_against_the_proven_coefficients():
    highest = 40
    balls = lambda_coefficients(highest // 4 + 1, DIGITS)
    values = {lambda_symbol(2 * i + 1): sympy_float(ball) for i, ball in enumerate(balls)}
    for k, ball in enumerate(series(highest, DIGITS).h):
        assert close(h_polynomial(k).subs(values), sympy_float(ball))


rationals = st.fractions(min_value=-2, max_value=2, max_denominator=9)


@settings(max_examples=30)
@given(st.tuples(rationals, rationals, rationals, rationals))
def test_time_reversal(values):
    """For any odd Lambda: eps0(kappa) and eps0 at the mirror image -kappa eps0^(1/5) are reciprocal."""
    order = 7
    lambdas = {lambda_symbol(k): sp.QQ(v.numerator, v.denominator) for k, v in zip((1, 3, 5, 7), values, strict=True)}
    _, kappa = sp.ring("kappa", sp.QQ)

    def truncated(polynomial):
        return rs_trunc(polynomial, kappa, order + 1)

    def leading_part(n):
        """The coefficient of kappa^n in eps0: the terms of h_(2n) without H_1, H_2, …."""
        symbols = list(lambdas)
        terms = sp.Poly(h_polynomial(2 * n), *symbols).terms()
        weights = (1, 3, 5, 7)
        return sum(
            c.p * sp.QQ(1, c.q) * sp.prod(lambdas[s] ** p for s, p in zip(symbols, powers, strict=True))
            for powers, c in terms
            if sum(w * p for w, p in zip(weights, powers, strict=True)) == n
        )

    coefficients = [leading_part(n) for n in range(order + 1)]
    eps0 = sum(c * kappa**n for n, c in enumerate(coefficients))
    mirror = truncated(-kappa * rs_pow(eps0, sp.Rational(1, 5), kappa, order + 1))
    at_mirror = sum(c * truncated(mirror**n) for n, c in enumerate(coefficients))
    assert truncated(eps0 * at_mirror) == 1


# --- the lambdas in the G_n, closed forms ----------------------------------------------------------------------


def test_lambdas_against_the_proven_coefficients():
    values = {G_symbol(n): sympy_float(c) for n, c in enumerate(g_coefficients(9, DIGITS)) if n}
    for i, ball in enumerate(lambda_coefficients(5, DIGITS)):
        assert close(lambda_from_G(2 * i + 1).subs(values), sympy_float(ball))


@pytest.mark.parametrize("n", [1, 2, 3])
def test_closed_forms_of_G(n):
    closed = getattr(symbolic, f"g_{n}_at_0")()
    assert closed.has(sp.gamma)
    assert close(closed, sympy_float(g_coefficients(n, DIGITS)[n]))


@pytest.mark.parametrize("k", [1, 3])
def test_closed_forms_of_lambda(k):
    closed = getattr(symbolic, f"lambda_{k}")()
    assert close(closed, sympy_float(lambda_coefficients(2, DIGITS)[k // 2]))
    closed_G = {G_symbol(n): getattr(symbolic, f"g_{n}_at_0")() for n in range(1, k + 1)}
    assert close(closed, lambda_from_G(k).subs(closed_G))


def test_h_6_needs_no_more_than_the_gamma_function():
    """The cubes of lambda_1 combine to 7/25 (the closed form of lambda_3)."""
    scale = sp.Rational(4, 5) ** sp.Rational(6, 5)
    h_6 = h_polynomial(6).subs({lambda_symbol(1): symbolic.lambda_1(), lambda_symbol(3): symbolic.lambda_3()})
    beta = sp.beta(sp.Rational(9, 5), sp.Rational(1, 2))
    assert close(h_6, -sp.Rational(7, 25) * symbolic.lambda_1() ** 3 - sp.Rational(125, 1452) * scale * beta)


# --- arguments ------------------------------------------------------------------------------------------------

FUNCTIONS = [hierarchy, g_function, delayed_recovery_series, lambda_symbol, G_symbol, lambda_from_G, h_polynomial]


@pytest.mark.parametrize("function", FUNCTIONS)
@pytest.mark.parametrize("bad", [-1, 10**9, 1.5, 2.0, Fraction(3), True, "3", None])
def test_bad_orders_are_refused(function, bad):
    expected = ValueError if type(bad) is int else TypeError
    with pytest.raises(expected, match="expected an integer from") as refusal:
        function(bad)
    assert "\n" not in str(refusal.value)


@pytest.mark.parametrize("function", [lambda_symbol, lambda_from_G])
def test_even_lambdas_do_not_exist(function):
    with pytest.raises(ValueError, match="expected an odd integer"):
        function(2)


def test_global_precision_is_left_alone():
    before = ctx.prec, ctx.cap
    delayed_recovery_series(7)
    h_polynomial(30)
    assert (ctx.prec, ctx.cap) == before
