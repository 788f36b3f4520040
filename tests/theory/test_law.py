"""Laws of contact: what is accepted, and the theory of every law against closed forms and a second derivation."""

import math
from fractions import Fraction

import numpy as np
import pytest
import sympy as sp
from mpmath import mp, mpf

from tests.closed_forms import nu_1, nu_2
from viscopade.arithmetic.balls import to_mpf
from viscopade.collision import exact
from viscopade.theory import symbolic
from viscopade.theory.law import ENDS, NAMED, VISCOELASTIC, Law, law_of
from viscopade.theory.pade import pade
from viscopade.theory.series import end_series, g_coefficients, lambda_coefficients, series

LAWS = [
    law_of(name, end)
    for name in ("viscoelastic", "linear", "hunt-crossley", "kelvin-voigt:1", "3/2,0", "3/2,1", "5/4,1/4", "1,2", "2,0")
    for end in ENDS
]
of_laws = pytest.mark.parametrize("law", LAWS, ids=lambda law: f"{law}-{law.end}")


def test_the_papers_law():
    law = law_of("viscoelastic")
    assert law == VISCOELASTIC == Law("3/2", "1/2") == Law(1.5, 0.5) == law_of("1.5, 0.5")
    assert (law.nu, law.n_a, law.n_b, law.m, law.powers, law.d) == (Fraction(5, 3), 5, 3, 2, (5, 3), 2)
    assert (law.c, law.e, law.decay * law.d, law.excess) == (Fraction(1, 10), Fraction(1, 2), Fraction(10, 3), 3)
    assert str(law) == "3/2,1/2"


@pytest.mark.parametrize(
    ("text", "exponents", "nu"),
    [
        ("linear", (1, 0), 2),
        ("tsuji", ("3/2", "1/4"), 2),
        ("hunt-crossley", ("3/2", "3/2"), 1),
        ("hunt-crossley:1", (1, 1), 1),
        ("kelvin-voigt", ("3/2", "1/2"), "5/3"),
        ("kelvin-voigt:1", (2, 1), "3/2"),
        ("3/2,0", ("3/2", 0), "5/2"),
    ],
)
def test_names(text, exponents, nu):
    assert law_of(text) == Law(*exponents)
    assert law_of(text).nu == Fraction(nu)
    assert law_of(law_of(text), "return") == Law(*exponents, "return") == law_of(text, "return")


@pytest.mark.parametrize(
    "text",
    ["", "hertz", "3/2", "1,1,1", "-1,0", "0,0", "1,-1", "pi,1", "nan,1", "11,1", "1/0,1", "tsuji:2", "1.37,0.1"],
)
def test_refused(text):
    with pytest.raises(ValueError, match="expected"):
        law_of(text)


def test_refused_ends_and_kinds():
    with pytest.raises(ValueError, match="expected 'force' or 'return'"):
        law_of("linear", "sideways")
    for wrong in (None, 3, 1.5, ("1", "2")):
        with pytest.raises(TypeError, match="expected"):
            law_of(wrong)
    with pytest.raises(TypeError, match="expected"):
        Law(None, 1)


# --- physical units ---------------------------------------------------------------------------------------------------


@pytest.mark.parametrize("name", NAMED)
def test_kappa_in_units(name):
    """The scaled force, from the force in units: kappa x^b x' must be c xi^b xi' times time^2/(mass length)."""
    law, k, mass, speed, c = law_of(name), 3.0e3, 0.2, 1.7, 0.31
    length, time = (unit(speed, k=k, mass=mass) for unit in (law.length_scale, law.time_scale))
    assert length / time == pytest.approx(speed)
    assert k * length ** float(law.elastic) * time**2 / (mass * length) == pytest.approx(1)
    kappa = law.kappa(speed, k=k, c=c, mass=mass)
    assert kappa == pytest.approx(c * length ** float(law.damping) * (length / time) * time**2 / (mass * length))
    assert law.damping_constant(kappa, speed, k=k, mass=mass) == pytest.approx(c, rel=1e-14)


@pytest.mark.parametrize(
    ("name", "symbol", "definition", "unit", "value"),
    [
        ("linear", "zeta", "c/(2 sqrt(k m))", "", 0.7 / (2 * math.sqrt(1e3))),
        ("tsuji", "zeta", "c/sqrt(5 k m)", "", 0.7 / math.sqrt(5e3)),
        ("viscoelastic", "A", "2 c/(3 k)", "s", 0.7 / 7500),
        ("kelvin-voigt:1", "A", "c/(2 k)", "s", 0.7 / 1e4),
        ("hunt-crossley", "d", "c/k", "s/m", 0.7 / 5e3),
    ],
)
def test_own_damping(name, symbol, definition, unit, value):
    own = law_of(name).own_damping
    assert (own.symbol, own.definition, own.unit) == (symbol, definition, unit)
    assert own.value(0.7, k=5e3, mass=0.2) == pytest.approx(value, rel=1e-14)


def test_zeta_is_1_where_contact_ceases_to_return():
    """zeta = K/2 for every law of nu = 2: the closed form of eps knows zeta alone."""
    for name in ("linear", "tsuji", "2,1/2"):
        law, c = law_of(name, "return"), 0.7
        kappa = law.kappa(1.0, k=2.0, c=c, mass=0.3)
        eps = exact.collision(kappa=kappa, law=law, digits=15).floats()["epsilon"]
        assert float(nu_2(mpf(law.own_damping.value(c, k=2.0, mass=0.3)), "return")) == pytest.approx(eps, rel=1e-12)
    assert law_of("3/2,0").own_damping is None
    assert (law_of("tsuji").stiffness_unit, law_of("tsuji").damping_unit) == ("N/m^(3/2)", "N s/m^(5/4)")
    assert (law_of("tsuji").force, law_of("linear").force) == ("k x^(3/2) + c x^(1/4) x'", "k x + c x'")


def test_kappa_at_rest():
    assert law_of("3/2,0").kappa(0.0, k=5.0, c=1.0, mass=0.2) == float("inf")


def test_refused_constants():
    with pytest.raises(ValueError, match="mass is 0"):
        VISCOELASTIC.kappa(1.0, k=1.0, c=1.0, mass=0)
    with pytest.raises(TypeError, match="speed is None"):
        VISCOELASTIC.time_scale(None, k=1.0, mass=1.0)


# --- the series -------------------------------------------------------------------------------------------------------


@pytest.mark.parametrize("end", ENDS)
@pytest.mark.parametrize(("name", "squared"), [("linear", 1), ("tsuji", 1.25)])
def test_nu_2_against_the_closed_form(name, squared, end):
    """E_2(K) with kappa = (b+1)^(1/2) K."""
    with mp.workdps(120):
        closed = mp.taylor(lambda kappa: nu_2(kappa / mp.sqrt(squared) / 2, end), 0, 12)
        for ours, theirs in zip(series(12, 40, law_of(name, end)).mpf(), closed, strict=True):
            assert mp.almosteq(ours, theirs, rel_eps=mpf(10) ** -38)


def test_nu_1_against_the_closed_form():
    """Near 0 the Lambert function has a branch point, so the series is summed, at kappa inside its convergence."""
    with mp.workdps(60):
        for kappa in ("0.01", "0.02", "0.03"):
            total = mp.polyval(series(30, 50, "hunt-crossley").mpf()[::-1], mpf(kappa))
            assert mp.almosteq(total, nu_1(mpf(kappa)), rel_eps=mpf(10) ** -44)


@of_laws
def test_numbers_and_symbols_give_the_same_series(law):
    """Every h_k, from proven lambda's and the polynomial that SymPy derives."""
    order = law.n_a + 4 * law.d
    h = series(order, 30, law).mpf()
    values = {symbolic.lambda_symbol(2 * i + 1): to_mpf(x) for i, x in enumerate(lambda_coefficients(order, 40, law))}
    for k in range(order + 1):
        polynomial = sp.lambdify(list(values), symbolic.h_polynomial(k, law), "mpmath")
        with mp.workdps(40):
            assert mp.almosteq(polynomial(*values.values()), h[k], rel_eps=mpf(10) ** -28, abs_eps=mpf(10) ** -35)


@of_laws
def test_lambda_by_three_routes(law):
    """Proven, in closed form, and by SymPy from the proven G_n."""
    first, third = (to_mpf(x) for x in lambda_coefficients(2, 40, law))
    values = {symbolic.G_symbol(n): to_mpf(x) for n, x in enumerate(g_coefficients(3, 50, law)) if n}
    with mp.workdps(45):
        assert mp.almosteq(first, sp.lambdify([], symbolic.lambda_1(law), "mpmath")(), rel_eps=mpf(10) ** -38)
        from_g = sp.lambdify(list(values), symbolic.lambda_from_G(3, law), "mpmath")(*values.values())
        assert mp.almosteq(third, from_g, rel_eps=mpf(10) ** -36)


@of_laws
def test_end_series_by_two_routes(law):
    assert symbolic.delayed_recovery_series(24, law) == end_series(24, law)
    if law.delayed:  # H_nu = 1 + (1 - 1/nu) mu + …, delta = 2/nu mu
        assert end_series(1, law)[1] == (1 - 1 / law.nu) * law.nu / 2


def test_a_coefficient_that_vanishes_exactly():
    """nu = 5/2, c = -1/10: [kappa^10] exp(-Lambda) is a multiple of an even coefficient of the odd function."""
    assert series(12, 30, law_of("3/2,0", "return")).h[10] == 0
    assert symbolic.h_polynomial(10, law_of("3/2,0", "return")) == 0


def test_pairs_of_one_nu_differ_by_the_scale_of_kappa():
    """(3/2, 1/2) and (2/3, 0) are nu = 5/3: E_nu(K), K = kappa (b+1)^-(1-1/nu)."""
    with mp.workdps(40):
        factor = mpf("1.5") ** mpf("-0.2")  # of v* = kappa^(1/2)
        for k, (ours, theirs) in enumerate(zip(series(20, 30).mpf(), series(20, 30, "2/3,0").mpf(), strict=True)):
            assert mp.almosteq(ours, theirs * factor**k, rel_eps=mpf(10) ** -28, abs_eps=mpf(10) ** -30)


@of_laws
def test_pade_of_the_excess_exists_and_meets_its_series(law):
    p = pade(4, 4 + law.excess, 15, law)
    assert p.contact_order >= 8 + law.excess
    assert p.decays == (law.excess > 0)


@pytest.mark.parametrize("bad", [np.arange(40.0).reshape(5, 8), {"viscoelastic": "force"}, 1.5])
def test_what_is_no_law_and_no_end_is_refused_in_one_line(bad):
    for function, name in ((law_of, "law"), (lambda end: Law(1, 1, end), "end")):
        with pytest.raises((TypeError, ValueError), match=rf"^{name} is .*: expected .*") as refused:
            function(bad)
        assert len(str(refused.value).splitlines()) == 1
