"""The derivation that `viscopade reproduce` shows: from the scaled equation alone, and against other routes."""

import csv
import io

import pytest
import sympy as sp
from flint import arb, fmpq, fmpq_poly
from mpmath import MPContext, beta, mp, mpf

from tests.cli import called, json_of, printed
from viscopade.arithmetic.function_balls import Wiener
from viscopade.theory import derivation as module
from viscopade.theory import symbolic
from viscopade.theory.derivation import derive
from viscopade.theory.equation import ScaledEquation, exponents, scaled_equation
from viscopade.theory.law import NAMED, Law, law_of
from viscopade.theory.pade import _pade
from viscopade.theory.series import MeetingPoint, _Inner, _Outer

L_1, L_3 = (symbolic.lambda_symbol(k) for k in (1, 3))


def with_exponents(a: str, b: str) -> ScaledEquation:
    """The paper's equation with other exponents, written in SymPy."""
    scaled = scaled_equation()
    x, speed = scaled.x, scaled.x.diff(scaled.tau)
    elastic, damping = x ** sp.Rational(a), scaled.kappa * speed * x ** sp.Rational(b)
    return scaled._replace(lhs=speed.diff(scaled.tau) + elastic + damping)


def test_the_paper_s_law():
    """h_2, h_4 and h_5 as in section 2 of the design, lambda_1 = (4/5)^(2/5) B(3/5, 3/2)."""
    found = derive(scaled_equation(), 9, 20)
    assert found.equation == "x'' + x^(3/2) + kappa sqrt(x) x' = 0, x(0) = 0, x'(0) = 1"
    assert found.turning_point == "d(g^2)/dr = -5 r^4 - 5 K g r^2, g(1) = 0"
    assert found.hierarchy == "d(g_0 g_n + … + g_n g_0)/dr = -5 g_(n-1) r^2, g_n(1) = 0"
    expected = [-L_1, 0, 3 * L_1**2 / 5, sp.Rational(4, 15)]
    assert [found.polynomials[k] for k in (2, 3, 4, 5)] == expected
    with mp.workdps(30):
        lambda_1 = mpf("0.8") ** mpf("0.4") * beta(mpf("0.6"), mpf("1.5"))
        assert [found.lambdas[1], found.values[4]] == [mp.nstr(x, 20) for x in (lambda_1, lambda_1**2 * 3 / 5)]


def test_linear_spring_against_its_closed_form():
    """exp(-zeta (pi - 2 asin zeta)/w), zeta = kappa/2, in powers of kappa by SymPy."""
    kappa = sp.Symbol("kappa", positive=True)
    zeta = kappa / 2
    closed = sp.exp(-zeta * (sp.pi - 2 * sp.asin(zeta)) / sp.sqrt(1 - zeta**2)).series(kappa, 0, 6).removeO()
    # The odd function is pi zeta/w = pi kappa/2 (1 + kappa^2/8 + …).
    values = {L_1: sp.pi / 2, L_3: sp.pi / 16, symbolic.lambda_symbol(5): 3 * sp.pi / 256}
    for k, polynomial in derive(scaled_equation("linear"), 5, 20).polynomials.items():
        assert sp.simplify(polynomial.subs(values) - closed.coeff(kappa, k)) == 0


@pytest.mark.parametrize(("a", "b"), [("5/2", "1/2"), ("3/2", "1/4"), ("1", "0"), ("2", "1/2")])
def test_the_equation_is_the_only_input(a, b):
    """Other exponents in SymPy's equation give other polynomials; h_d = -lambda_1 has a closed form for every nu."""
    changed = with_exponents(a, b)
    law = Law(a, b)
    assert exponents(changed) == (law.elastic, law.damping)
    found = derive(changed, 9, 20)
    assert found.polynomials != derive(scaled_equation(), 9, 20).polynomials
    with mp.workdps(30):
        nu, half = mpf(law.nu.numerator) / law.nu.denominator, mpf(law.elastic.numerator) / law.elastic.denominator
        lambda_1 = beta(1 / nu, mpf("1.5")) * ((half + 1) / 2) ** (1 / nu - 1)
        assert found.values[law.d] == f"-{mp.nstr(lambda_1, 20)}"


def test_an_equation_of_another_kind_is_refused():
    scaled = scaled_equation()
    with pytest.raises(ValueError, match=r"expected x'' \+ x\^a \+ kappa x\^b x' = 0"):
        derive(scaled._replace(lhs=scaled.lhs + scaled.x / 7), 5, 20)


@pytest.mark.parametrize("end", ["force", "return"])
@pytest.mark.parametrize("name", NAMED)
def test_every_law_has_a_derivation_whose_values_lie_in_the_enclosures(name, end):
    law = law_of(name, end)
    assert derive(scaled_equation(law), 9, 15, end).lambdas


# --- the command line -------------------------------------------------------------------------------------------------


def test_reproduce_shows_the_derivation():
    shown, whole = printed("reproduce"), json_of("reproduce")["derivation"]
    for key in ("equation", "turning_point", "hierarchy"):
        assert whole[key] in " ".join(shown.split())
    assert set(whole["h"]) == {str(k) for k in range(2, 10)}
    assert sp.sympify(whole["h"]["6"]) == -sp.Rational(169, 600) * sp.Symbol("lambda_1") ** 3 - sp.Symbol("lambda_3")
    assert shown.index("h_9 = 17 lambda_1^2/50 = 0.45235105120205073021") < shown.index("[0/3]")
    assert "H(z) = 1 + z/3 + 13 z^2/96 + …" in shown
    assert "mpmath builds a and b of [m/n] from h_0 … h_9" in shown


@pytest.mark.parametrize("law", ["linear", "tsuji"])
def test_polynomials_of_another_law(law):
    """h_1 = -lambda_1 and h_2 = lambda_1^2/2 + H_1 (2/(a+1)), H_1 = 1/2 for nu = 2."""
    whole = json_of("coefficients", "--order", 5, "--digits", 10, "--symbolic", "--law", law)
    first = sp.Rational(2) / (sp.Rational(2) if law == "linear" else sp.Rational(5, 2)) / 2
    l_1 = sp.Symbol("lambda_1")
    assert [sp.sympify(whole["symbolic"][k]) for k in "12"] == [-l_1, l_1**2 / 2 + first]
    values = {f"lambda_{k}": mpf(value) for k, value in whole["lambda"].items()}
    for k, polynomial in whole["symbolic"].items():
        assert abs(sp.sympify(polynomial).subs(values) - sp.Float(whole["h"][int(k)])) < 1e-8
    rows = list(csv.DictReader(io.StringIO(printed("coefficients", "--order", 2, "--symbolic", "--format", "csv"))))
    assert [row["polynomial"] for row in rows] == ["1", "0", "-lambda_1"]


def test_polynomials_of_a_high_order_are_refused():
    refused = called("coefficients", "--order", 61, "--symbolic")
    assert refused.returncode == 2
    assert refused.stderr == "viscopade: the order is 61: expected at most 60 for polynomials in lambda\n"


def test_a_contradiction_ends_reproduce_without_a_file(tmp_path, monkeypatch):
    """lambda_3 off by 1e-25, which no printed digit shows."""
    lambdas = module.lambda_coefficients

    def shifted(*wanted):
        first, third, *rest = lambdas(*wanted)
        return first, third + arb(10) ** -25, *rest

    monkeypatch.setattr(module, "lambda_coefficients", shifted)
    result = called("reproduce", "--out", tmp_path / "out")
    assert (result.returncode, result.stderr) == (1, "viscopade: the derivation contradicts the series in h_6, h_8\n")
    assert not (tmp_path / "out").exists()


def test_reproduce_fails_without_mpmath_s_numbers(tmp_path, monkeypatch):
    """The first coefficient that mpmath builds is off by 1e-5: the balls do not prove it."""
    original = MPContext.pade

    def changed(own, h, m, n):
        a, b = original(own, h, m, n)
        return [a[0] + mpf("1e-5"), *a[1:]], b

    monkeypatch.setattr(MPContext, "pade", changed)
    _pade.cache_clear()
    result = called("reproduce", "--out", tmp_path / "out")
    _pade.cache_clear()
    assert result.returncode == 1
    assert "do not determine [0/3]" in result.stderr
    assert not (tmp_path / "out").exists()


# --- the hierarchy of the symbols is the recursion of the numbers -----------------------------------------------------

BITS, TERMS, ORDERS = 240, 24, 5
TOLERANCE = fmpq(1, 1 << 160)


def inserted(expression: sp.Expr, functions: list[fmpq_poly], slopes: list[fmpq_poly], r: fmpq_poly) -> fmpq_poly:
    """Return the value of a polynomial in r, g_i(r) and their derivatives."""
    g = [symbolic.g_function(i) for i in range(len(functions))]
    symbols = [*(f.diff(symbolic.r) for f in g), *g, symbolic.r]
    names = sp.symbols(f"n0:{len(symbols)}")
    plain = sp.expand(expression.doit())
    for symbol, name in zip(symbols, names, strict=True):
        plain = plain.subs(symbol, name)
    total = fmpq_poly([0])
    for powers, coefficient in sp.Poly(plain, *names).terms():
        term = fmpq_poly([fmpq(int(coefficient.p), int(coefficient.q))])
        for value, power in zip([*slopes, *functions, r], powers, strict=True):
            term *= value**power
        total += term
    return total


def taylor(orders) -> list[list[fmpq]]:
    """Return the middles of the Taylor coefficients of each order."""
    return [[fmpq(int(c), 1 << BITS) for c in orders[i].polynomial.coeffs()] for i in range(ORDERS + 1)]


@pytest.mark.parametrize("name", NAMED)
def test_the_recursion_of_the_series_is_the_hierarchy_term_by_term(name):
    """What `series` computes on both sides solves SymPy's equations of orders 1 … 5, in each of 20 Taylor terms."""
    law = law_of(name)
    meeting = MeetingPoint.balanced(law.n_a).r
    inner, outer = (kind(Wiener(BITS, TERMS), meeting, law.n_a, law.n_b) for kind in (_Inner, _Outer))
    for n in range(1, ORDERS + 1):
        inner.advance(n, *outer.advance(n))
    b = fmpq(meeting.numerator, meeting.denominator)
    a = 1 - b

    # Around r = 0: r = b y, g_i(r) = sum c_j y^j, so that d/dr = 1/b d/dy.
    around_0 = [fmpq_poly(c) for c in taylor(inner.g)]
    slopes_0 = [g.derivative() / b for g in around_0]
    # Around r = 1: 1 - r = a z^2, g_i(r) = z^(i+1) f_i(z^2), so that z d/dr = -1/(2 a) d/dz.
    around_1 = [
        fmpq_poly([0] * (i + 1) + [c for f_j in f for c in (f_j, fmpq(0))]) for i, f in enumerate(taylor(outer.f))
    ]
    slopes_1 = [g.derivative() / (-2 * a) for g in around_1]

    for n in range(1, ORDERS + 1):
        order = symbolic.hierarchy(n, law)
        r = fmpq_poly([0, b])
        at_0 = [inserted(side, around_0, slopes_0, r) for side in order.args]
        assert agree(at_0[0], at_0[1], TERMS - 4)
        r, z = fmpq_poly([1, 0, -a]), fmpq_poly([0, 1])
        at_1 = [inserted(order.lhs, around_1, slopes_1, r), z * inserted(order.rhs, around_1, slopes_1, r)]
        assert agree(at_1[0], at_1[1], 2 * (TERMS - 4))
        # The test can fail: without the damping of the order there is no agreement.
        assert not agree(at_0[0], 2 * at_0[1], TERMS - 4)


def agree(left: fmpq_poly, right: fmpq_poly, terms: int) -> bool:
    """Whether the first coefficients agree; the last ones feel that the series are cut."""
    return all(abs((left - right)[j]) < TOLERANCE for j in range(terms))
