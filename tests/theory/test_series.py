"""h_k, lambda_k and G_n: two independent routes, the proven bounds, and what is refused."""

import sys
from collections import deque
from concurrent.futures import ThreadPoolExecutor
from decimal import Context, Decimal
from fractions import Fraction

import mpmath
import numpy as np
import pytest
from flint import arb, arb_series, ctx
from mpmath import mp, mpf

from viscopade import arguments
from viscopade import series as exported
from viscopade.arithmetic.balls import bits_for, exact_middle, working
from viscopade.theory.law import VISCOELASTIC, law_of
from viscopade.theory.series import (
    Effort,
    Series,
    _g_fixed_point,
    derived,
    end_series,
    g_coefficients,
    lambda_coefficients,
    series,
)
from viscopade_lab.studies import direct


def test_the_package_offers_the_function():
    assert exported is series


# --- independent routes -------------------------------------------------------------------------------------------


@pytest.mark.parametrize("v_star", ["0.01", "0.05", "0.1"])
def test_sum_of_the_series_against_direct_integration(v_star):
    """Three speeds, so that no wrong h_k can hide behind another one, up to h_35."""
    with mp.workdps(60):
        summed = mp.polyval(series(60, 45).mpf()[::-1], mpf(v_star))
        assert mp.almosteq(summed, direct.collide(v_star, 37).epsilon, rel_eps=mpf(10) ** -35)


def by_lagrange_inversion(order: int, digits: int) -> list[arb]:
    """h_k = sum H_j (4/5)^j (10+5j)/(10+5j+n) [nu^n] exp(-(10+5j+n)/10 Lambda), 5j + 2n = k."""
    lam = lambda_coefficients(order // 4 + 1, digits + 20)
    ends = end_series(order // 5)
    h = [arb(0)] * (order + 1)
    with working(bits_for(digits + 20), order // 2 + 1):
        odd = arb_series([lam[k // 2] if k % 2 else arb(0) for k in range(order // 2 + 1)], order // 2 + 1)
        for j, end in enumerate(ends):
            for n in range((order - 5 * j) // 2 + 1):
                weight = end * Fraction(4, 5) ** j * Fraction(10 + 5 * j, 10 + 5 * j + n)
                power = (odd * (-arb(10 + 5 * j + n) / 10)).exp().coeffs()
                h[5 * j + 2 * n] += arb(weight.numerator) / weight.denominator * power[n]
    return h


def assert_lagrange_agrees(order: int, digits: int) -> None:
    for x, y in zip(by_lagrange_inversion(order, digits), series(order, digits).h, strict=True):
        assert x.overlaps(y)
        assert x.is_exact() or x.rel_accuracy_bits() > bits_for(digits)


def test_lagrange_inversion_in_the_lambdas_gives_the_same_enclosures():
    assert_lagrange_agrees(order=60, digits=30)


def test_known_values():
    """lambda_1 and G_1 have closed forms; h_5 = 4/15; the design's decimals of lambda."""
    with working(200):
        g1 = (arb(3) / 5).gamma() * (arb(3) / 2).gamma() / (arb(21) / 10).gamma() / 2
        assert g1.overlaps(g_coefficients(1, 50)[1])
        lambda_1 = 2 * g1 / (arb(25) / 16).root(5)
        assert lambda_1.overlaps(lambda_coefficients(1, 50)[0])
    h = series(7, 30)
    assert h.decimals()[:2] == ("1", "0")
    assert h.decimals()[3] == "0"
    assert h.decimals()[5] == "0." + "2" + 28 * "6" + "7"
    assert [str(x)[:10] for x in lambda_coefficients(3, 10)] == ["[1.1534488", "[0.0906370", "[0.0113029"]


def test_end_series_is_the_design_s():
    assert end_series(3) == (1, Fraction(1, 3), Fraction(13, 96), Fraction(4897, 82368))
    assert end_series(0) == (1,)


# --- the bounds ---------------------------------------------------------------------------------------------------


@pytest.mark.parametrize("terms", [8, 12, 20, 40])
@pytest.mark.parametrize("bits", [30, 60, 150])
@pytest.mark.parametrize("law", [VISCOELASTIC, law_of("3/2,0"), law_of("hunt-crossley")], ids=str)
def test_g_enclosures_hold_for_any_effort(bits, terms, law):
    """With few terms and few bits the error is large; it must still be covered by the bound."""
    order = 8
    truth = g_coefficients(order, 80, law)
    try:
        rough = _g_fixed_point(order, Effort(bits, terms), law.n_a, law.n_b)
    except ArithmeticError:
        pytest.skip("refused: too few terms or bits")
    for (value, error), g in zip(rough, truth, strict=True):
        actual = abs(Fraction(value, 1 << bits) - exact_middle(g))
        assert actual <= Fraction(error, 1 << bits) + Fraction(1, 10**60)


def test_g_bound_of_truncation_is_not_vacuous():
    """With ample bits the bound is the truncation's alone: it falls with every term, and is near the true error."""
    truth = g_coefficients(6, 80)
    bounds = []
    for terms in (20, 40, 60):
        value, error = _g_fixed_point(6, Effort(400, terms), 5, 3)[6]
        actual = abs(Fraction(value, 1 << 400) - exact_middle(truth[6]))
        assert actual <= Fraction(error, 1 << 400) <= 10**5 * actual
        bounds.append(error)
    assert bounds[0] > 10**4 * bounds[1] > 10**8 * bounds[2]


@pytest.mark.parametrize(("order", "digits"), [(10, 15), (20, 100), (53, 50)])
@pytest.mark.parametrize("law", ["viscoelastic", "3/2,1", "1,1/2", "2,1", "1,1", "1/2,1", "1/2,2"])
def test_the_first_attempt_suffices_below_nu_2(law, order, digits, monkeypatch):
    """Fewer bits and terms for small nu than for the paper's law, but never so few that all is done twice."""
    monkeypatch.setattr(Effort, "raised", lambda *_: pytest.fail("a second attempt"))
    derived.__wrapped__(order, digits, law_of(law))


def test_too_wide_a_first_attempt_is_tried_again(monkeypatch):
    attempts = []

    def too_little(cls, orders, digits, law):
        return Effort(12, 4)

    raised = Effort.raised
    monkeypatch.setattr(Effort, "guess", classmethod(too_little))
    monkeypatch.setattr(Effort, "raised", lambda self, *missing: attempts.append(missing) or raised(self, *missing))
    assert derived.__wrapped__(12, 30).decimals() == series(12, 30).decimals()
    assert attempts


@pytest.mark.parametrize(("order", "digits"), [(0, 1), (1, 3), (2, 1), (5, 5), (20, 7), (33, 40), (60, 25)])
def test_digits_are_right_to_the_last(order, digits):
    """Fewer digits are the correct rounding of more digits."""
    few, many = series(order, digits), series(order, digits + 25)
    for short, long, ball in zip(few.decimals(), many.decimals(), few.h, strict=True):
        assert Decimal(short) == Context(prec=digits).create_decimal(long)
        assert ball.is_exact() or len(Decimal(short).as_tuple().digits) == digits


@pytest.mark.slow
def test_order_160_to_100_digits_against_lagrange_inversion():
    assert_lagrange_agrees(order=160, digits=100)


# --- the object ---------------------------------------------------------------------------------------------------


def test_conversions():
    h = series(20, 40)
    assert np.array_equal(h.floats(), [float(x) for x in h.decimals()])
    with mp.workdps(40):
        assert all(mp.almosteq(x, mpf(y), rel_eps=mpf("1e-39")) for x, y in zip(h.mpf(), h.decimals(), strict=True))
    with pytest.raises(ValueError, match="from 1 to 40"):
        h.decimals(41)


def test_global_precision_is_left_alone():
    saved = ctx.prec, ctx.cap, mpmath.mp.prec
    derived.__wrapped__(10, 77)
    lambda_coefficients(2, 33)
    assert (ctx.prec, ctx.cap, mpmath.mp.prec) == saved


def test_threads_take_turns():
    """FLINT's precision and series length are global: without turns one thread would cut another's series short."""
    tasks = [(8, 12), (40, 20), (15, 60), (60, 10), (3, 200), (24, 33)]
    alone = {task: derived.__wrapped__(*task).decimals() for task in tasks}
    with ThreadPoolExecutor(6) as pool:
        together = list(pool.map(lambda task: (task, derived.__wrapped__(*task).decimals()), tasks * 12))
    assert all(decimals == alone[task] for task, decimals in together)


def test_another_thread_s_series_is_not_returned(monkeypatch):
    class Busy(deque):
        def append(self, found):
            super().append(found)
            super().append(series(2, 5))  # as another thread may do at any time

    monkeypatch.setattr(sys.modules["viscopade.theory.series"], "_derivations", Busy())
    assert derived.__wrapped__(6, 10).order == 6


@pytest.mark.parametrize("step", ["_g", "_k_times"])
def test_a_series_cut_by_somebody_else_is_noticed(monkeypatch, step):
    """A cut series padded with zeros would be a wrong proven number; it must be an error."""
    module = sys.modules["viscopade.theory.series"]
    original = getattr(module, step)

    def meddling(*arguments):
        result = original(*arguments)
        ctx.cap = 5
        return result

    monkeypatch.setattr(module, step, meddling)
    with pytest.raises(RuntimeError, match="cut to"):
        derived.__wrapped__(20, 10)
    monkeypatch.undo()
    assert derived.__wrapped__(20, 10).decimals() == series(20, 10).decimals()


def test_constructor_checks_identities():
    h = series(4, 10).h
    with pytest.raises(ValueError, match="5 coefficients"):
        Series(4, 10, h[:4])
    with pytest.raises(ValueError, match="h_0 must be 1"):
        Series(1, 10, h[1:3])
    with pytest.raises(ValueError, match="too wide for 3000 digits"):
        Series(4, 3000, h)


@pytest.mark.parametrize("order", [-1, arguments.MAX_ORDER + 1])
def test_order_out_of_range(order):
    with pytest.raises(ValueError, match=f"order is {order}: expected an integer from 0 to"):
        series(order, 10)


@pytest.mark.parametrize("digits", [0, -3, 10**6])
def test_digits_out_of_range(digits):
    with pytest.raises(ValueError, match=f"digits is {digits}: expected an integer from 1 to 5000"):
        series(4, digits)


@pytest.mark.parametrize("bad", [2.5, 3.0, "4", None, True, 1 + 0j, Fraction(4)])
def test_not_an_integer(bad):
    with pytest.raises(TypeError, match="expected an integer"):
        series(bad, 10)
    with pytest.raises(TypeError, match="expected an integer"):
        series(10, bad)


def test_numpy_integers_are_integers():
    assert series(np.int64(4), np.int32(10)) is series(4, 10)
