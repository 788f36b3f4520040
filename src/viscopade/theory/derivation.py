"""The way from the scaled equation of motion to the numbers h_k, as `viscopade reproduce` shows it.

SymPy reads the exponents from the equation, and generates the turning point equation, the hierarchy of perturbation
equations, and every h_k as a polynomial in lambda_1, lambda_3, … (`viscopade.theory.symbolic`). Balls give the lambdas
their proven values. The values of the polynomials are compared with `viscopade.theory.series`, which obtains the h_k
from the same hierarchy without these polynomials.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from fractions import Fraction

import sympy as sp
from flint import arb

from viscopade.arithmetic.balls import ball_of, bits_for, known_decimal, working
from viscopade.theory import symbolic
from viscopade.theory.equation import ScaledEquation, exponents
from viscopade.theory.law import End, Law
from viscopade.theory.series import derived, lambda_coefficients

# Of the lambdas: the value of a polynomial has to fit into the enclosure of h_k by `series`, which is a few digits
# narrower than 10^-digits. The polynomials lose at most one digit (measured for seven laws), so 40 are ample.
MORE_DIGITS = 40
LARGEST_POWER = 30  # of kappa, a choice: h_60 of the paper's law has 543 terms, and the number grows fast


@dataclass(frozen=True)
class Derivation:
    """The steps from a scaled equation to its coefficients h_k.

    Attributes
    ----------
    equation, turning_point, hierarchy : str
        The scaled equation of motion; without time, in r and g; its order K^n for n >= 1.
    polynomials : dict of int to sympy.Expr
        h_k in lambda_1, lambda_3, …, for d <= k <= order, where eps is a series in kappa^(1/d).
    lambdas : dict of int to str
        lambda_1, lambda_3, … up to the largest one in the polynomials, correctly rounded.
    values : dict of int to str
        The values of the polynomials, correctly rounded: proven, and inside the enclosures of `series`.
    """

    equation: str
    turning_point: str
    hierarchy: str
    polynomials: Mapping[int, sp.Expr]
    lambdas: Mapping[int, str]
    values: Mapping[int, str]


def derive(equation: ScaledEquation, order: int, digits: int, end: End = "force") -> Derivation:
    """Return the derivation of h_d … h_order, to `digits` digits; the equation and its end are all that it knows.

    `order` is the highest power of v* = kappa^(1/d), and `digits` counts significant decimal digits.

    Raises
    ------
    ValueError
        If the equation is not x'' + x^a + kappa x^b x' = 0, or the order is beyond kappa^30.
    ArithmeticError
        If the value of a polynomial is not inside the enclosure of h_k by `series`.
    """
    law = Law(*exponents(equation), end)
    if order > LARGEST_POWER * law.d:
        raise ValueError(f"the order is {order}: expected at most {LARGEST_POWER * law.d} for polynomials in lambda")

    # SymPy generates the polynomials; balls give the values of the lambdas.
    polynomials = {k: symbolic.h_polynomial(k, law) for k in range(law.d, order + 1)}
    # h_k has lambdas up to lambda_(k/d), because kappa^n = v*^(d n) needs lambda_1 … lambda_n only; lambda_1 in any
    # case.
    odd = range(1, max(order // law.d, 1) + 1, 2)
    lambdas = dict(zip(odd, lambda_coefficients(len(odd), digits + MORE_DIGITS, law), strict=True))

    # The second way to the same numbers: power series in balls. `derived(…).h` has the balls of h_0 … h_order.
    enclosures = derived(order, digits, law).h
    with working(bits_for(digits + MORE_DIGITS) + 64):  # 64 bits (a machine word) for rounding in sums and products
        values = {k: _value(polynomial, lambdas) for k, polynomial in polynomials.items()}
        outside = [f"h_{k}" for k, value in values.items() if not enclosures[k].contains(value)]
    if outside:
        raise ArithmeticError(f"the derivation contradicts the series in {', '.join(outside)}")

    # The equations as text: x(tau), g(r) and g_0(r) lose their arguments. Order n has g_(n-1) where order 1 has g_0.
    x, speed = equation.x, equation.x.diff(equation.tau)
    forces = (equation.lhs - speed.diff(equation.tau)).subs(speed, sp.Symbol("x'")).subs(x, sp.Symbol("x"))
    without_time = symbolic.turning_point_equation(law).rhs.subs(symbolic.g, sp.Symbol("g"))
    order_n = symbolic.hierarchy(1, law).rhs.subs(symbolic.g_function(0), sp.Symbol("g_(n-1)"))
    return Derivation(
        f"x'' + {plain_text(forces, equation.kappa)} = 0, x(0) = 0, x'(0) = 1",
        f"d(g^2)/dr = {plain_text(without_time, symbolic.K)}, g(1) = 0",
        f"d(g_0 g_n + … + g_n g_0)/dr = {plain_text(order_n)}, g_n(1) = 0",
        polynomials,
        {k: known_decimal(value, digits) for k, value in lambdas.items()},
        {k: known_decimal(value, digits) for k, value in values.items()},
    )


def _value(polynomial: sp.Expr, lambdas: Mapping[int, arb]) -> arb:
    """Return the value of a polynomial in lambda_1, lambda_3, … as a ball; `lambdas` has their balls, by index."""
    symbols = {symbolic.lambda_symbol(k): value for k, value in lambdas.items()}
    total = arb(0)
    # A term is a rational coefficient times a power of each lambda; a power 0 has no part in it.
    for powers, coefficient in sp.Poly(polynomial, *symbols).terms():
        term = ball_of(Fraction(int(coefficient.p), int(coefficient.q)))
        for value, power in zip(symbols.values(), powers, strict=True):
            if power:
                term *= value**power
        total += term
    return total


def plain_text(expression: sp.Expr, damping: sp.Symbol | None = None) -> str:
    """Return a sum as a physicist types it: x^(3/2), blanks for products, and terms with the damping at the end."""
    terms = sorted(expression.as_ordered_terms(), key=lambda term: damping in term.free_symbols)
    return " + ".join(map(str, terms)).replace("+ -", "- ").replace("**", "^").replace("*", " ")
