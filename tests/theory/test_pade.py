"""Padé approximants: order conditions, independent routes, degenerate cases, poles and zeros, refusals."""

import re
import sys
from collections.abc import Sequence
from fractions import Fraction
from itertools import product

import numpy as np
import pytest
from flint import acb, arb, fmpq, fmpq_poly
from mpmath import MPContext, mp, mpf

from viscopade.arithmetic.balls import exact_middle, to_mpf, working
from viscopade.progress import use_tracker
from viscopade.theory.law import VISCOELASTIC
from viscopade.theory.pade import (
    DegenerateError,
    Pade,
    Root,
    _contact,
    _pade,
    _solved,
    _TooWideError,
    is_real,
    pade,
    solution,
)
from viscopade.theory.paper import TABLE
from viscopade.theory.series import derived, series

PAPER_RANGE = range(26)
MPMATH_PADE = MPContext.pade


# --- mpmath builds, balls prove -------------------------------------------------------------------------------------


def by_euclid(h: list[fmpq], m: int, n: int) -> list[fmpq]:
    """Return a and b by Euclid's algorithm on v*^(m+n+1) and the series: no linear system, and no rounding."""
    before, a = fmpq_poly([0] * (m + n + 1) + [1]), fmpq_poly(h[: m + n + 1])
    earlier, b = fmpq_poly([0]), fmpq_poly([1])
    while a.degree() > m:
        quotient, rest = divmod(before, a)
        scale = 1 / rest[rest.degree()]  # keeps the fractions short
        before, a = a, rest * scale
        earlier, b = b, (earlier - quotient * b) * scale
    return [*(a[k] / b[0] for k in range(m + 1)), *(b[i] / b[0] for i in range(n + 1))]


def rationals(order: int, digits: int) -> list[fmpq]:
    return [fmpq(x.numerator, x.denominator) for x in map(Fraction, series(order, digits).decimals())]


def built_by(change):
    """Return a stand-in for `mpmath.pade` that changes what mpmath has built."""
    return lambda own, h, m, n: change(*MPMATH_PADE(own, h, m, n))


def shifted(place: int, by: float):
    """Return a change of one number of a and b."""

    def change(a, b):
        c = [*a, *b]
        c[place] += by
        return c[: len(a)], c[len(a) :]

    return change


def encloses(h: Sequence[arb], true: Sequence[fmpq], m: int, n: int) -> bool:
    """Whether every ball of a and b, made at 300 bits, holds the true number."""
    with working(300):
        a, b = solution(h, m, n)
    with working(3000):
        return all(ball.contains(arb(c)) for ball, c in zip(a + b, true, strict=True))


EVERY_M = [pytest.param(m, m + 3, marks=() if m in (0, 1, 2, 3, 7, 10, 15, 25) else pytest.mark.slow)
           for m in (*PAPER_RANGE, 40, 60)]  # fmt: skip
OTHER_DEGREES = [(0, 0), (4, 0), (0, 4), (2, 2), (5, 3), (8, 8), (12, 1)]


@pytest.mark.parametrize(("m", "n"), [*EVERY_M, *OTHER_DEGREES])
def test_against_euclid_in_fractions(m, n):
    """A second route: 300 digits of the series, of which the system can spoil no 200."""
    true, p = by_euclid(rationals(m + n, 300), m, n), pade(m, n, 30)
    with working(1200):
        assert all(ball.contains(arb(c)) for ball, c in zip(p.a + p.b, true, strict=True))
    for text, c in zip([x for side in p.decimals() for x in side], true, strict=True):
        c = Fraction(int(c.p), int(c.q))
        assert abs(Fraction(text) - c) <= abs(c) * Fraction(5, 10**30)


@pytest.mark.parametrize(("m", "n"), [(0, 3), (4, 7), (4, 0), (2, 2), (11, 14)])
def test_the_numbers_are_mpmath_s(monkeypatch, m, n):
    built = []
    monkeypatch.setattr(MPContext, "pade", built_by(lambda a, b: built.append([*a, *b]) or (a, b)))
    p = _pade.__wrapped__(m, n, 30, VISCOELASTIC)
    assert [to_mpf(c) for c in p.a + p.b] == built[-1]


@pytest.mark.parametrize("m", [2, 5, 8])
@pytest.mark.parametrize("signs", [(1, 1), (1, -1), (1, 1, -1, -1), (-1, 0, 1)])
def test_enclosures_hold_for_every_series_within_the_balls(m, signs):
    n, radius = m + 3, fmpq(1, 10**12)
    h = rationals(m + n, 40)
    ends = [h_k + radius * signs[k % len(signs)] for k, h_k in enumerate(h)]
    with working(300):
        balls = [arb(arb(h_k), arb(radius)) for h_k in h]
    assert encloses(balls, by_euclid(ends, m, n), m, n)


@pytest.mark.parametrize("place", range(9))
@pytest.mark.parametrize("by", [1e-5, -1e-40])
def test_a_number_that_is_off_gets_a_ball_that_is_wide(monkeypatch, place, by):
    """[2/5]: a_0, a_1, a_2, b_0 … b_5. All balls still hold the true numbers."""
    monkeypatch.setattr(MPContext, "pade", built_by(shifted(place, by)))
    assert encloses(series(7, 60).h, by_euclid(rationals(7, 100), 2, 5), 2, 5)
    with working(300):
        a, b = solution(series(7, 60).h, 2, 5)
    assert abs(by) <= float((a + b)[place].rad()) <= 1.01 * abs(by)


def test_a_false_number_is_never_proven(monkeypatch):
    """One number that is off by 1e-5 is refused; off by 1e-40, it has the 30 digits that are asked for."""
    h = series(15, 60).h
    with working(300):
        true = _solved(h, 3, 6, 30)
        monkeypatch.setattr(MPContext, "pade", built_by(shifted(6, 1e-5)))
        with pytest.raises(_TooWideError):
            _solved(h, 3, 6, 30)
        monkeypatch.setattr(MPContext, "pade", built_by(shifted(6, 1e-40)))
        assert _solved(h, 3, 6, 30).decimals() == true.decimals()


def test_without_a_good_solution_there_is_no_approximant(monkeypatch):
    """However many digits of the series: nonsense in mpmath's place ends in a refusal."""
    monkeypatch.setattr(MPContext, "pade", lambda own, h, m, n: ([own.one] * (m + 1), [own.one] * (n + 1)))
    with pytest.raises(ArithmeticError, match=r"do not determine \[1/4\]"):
        _pade.__wrapped__(1, 4, 3, VISCOELASTIC)


@pytest.mark.parametrize("n", [1, 5])
def test_mpmath_s_elimination_is_tracked_column_by_column(n):
    seen = []
    with working(300), use_tracker(lambda steps, text, cost: map(seen.append, steps)):
        solution(series(2 + n, 60).h, 2, n)
    assert seen == list(range(n))


def test_a_system_that_may_be_singular_is_not_solved():
    """[1/1] divides by h_1: a ball about 1e-4 that holds 0, whatever mpmath makes of its middle."""
    with working(300), pytest.raises(ZeroDivisionError):
        solution([arb(1), arb(1e-4, 1e-3), arb(1)], 1, 1)


def test_the_precision_of_others_is_neither_used_nor_changed():
    h = series(15, 60).h
    with working(300):
        usual = _solved(h, 3, 6, 30)
        with mp.workdps(4):
            p = _solved(h, 3, 6, 30)
            assert mp.dps == 4
    assert [(to_mpf(c), to_mpf(c.rad())) for c in p.a + p.b] == [
        (to_mpf(c), to_mpf(c.rad())) for c in usual.a + usual.b
    ]


# --- digits, and series that are known exactly ----------------------------------------------------------------------


@pytest.mark.parametrize("m", [0, 1, 3, 25])
def test_fewer_digits_are_roundings_of_more(m):
    few, many = pade(m, m + 3, 12), pade(m, m + 3, 40)
    assert few.decimals() == many.decimals(12)


def test_conversion_to_mpmath():
    p = pade(3, 6, 30)
    for numbers, texts in zip(p.mpf(), p.decimals(), strict=True):
        with mp.workdps(50):
            assert all(mp.almosteq(x, mpf(y), rel_eps=mpf("0.51e-29")) for x, y in zip(numbers, texts, strict=True))


# --- degenerate cases -----------------------------------------------------------------------------------------------


def test_zero_three_has_exact_zeros():
    p = pade(0, 3, 20)
    assert p.b[1].is_zero()
    assert p.b[3].is_zero()
    assert p.decimals()[1] == ("1", "0", "1.1534488580952887991", "0")
    assert len(p.poles) == 2
    assert all(not pole.real and pole.decimals(5)[0] == "0" for pole in p.poles)


@pytest.mark.parametrize(
    ("m", "n", "law"),
    [(1, 1, "viscoelastic"), (1, 3, "viscoelastic"), (3, 1, "viscoelastic"), (2, 5, "4,1/3"), (2, 5, "5/2,1/2")],
)
def test_approximants_that_do_not_exist_are_named_and_a_larger_one_that_does(m, n, law):
    with pytest.raises(DegenerateError, match=rf"\[{m}/{n}\] does not exist") as refused:
        pade(m, n, 20, law)
    larger = int(re.search(rf"expected for instance \[{m}/(\d+)\]$", str(refused.value))[1])
    assert pade(m, larger, 20, law).n == larger > n
    for k in range(n + 1, larger):
        with pytest.raises(DegenerateError, match="does not exist"):
            pade(m, k, 20, law)


def test_an_approximant_with_a_coefficient_that_seems_0_is_named_and_one_near_that_works():
    with pytest.raises(ArithmeticError, match=r"570 digits of the series do not determine \[2/15\]") as refused:
        pade(2, 15, 30, "3,1/2")
    m, n = map(int, re.search(r"expected for instance \[(\d+)/(\d+)\]$", str(refused.value)).groups())
    assert abs(m - 2) + abs(n - 15) <= 2
    assert pade(m, n, 20, "3,1/2").n == n


def test_contact_order_can_exceed_m_plus_n():
    assert pade(0, 2, 10).contact_order == 3  # h_3 = 0
    assert pade(1, 2, 10).contact_order == 3
    assert pade(3, 6, 10).contact_order == 9


def test_no_other_degenerate_case_up_to_degree_eight():
    missing = set()
    for m, n in product(range(9), range(9)):
        try:
            pade(m, n, 10)
        except DegenerateError:
            missing.add((m, n))
    assert missing == {(1, 1), (1, 3), (3, 1)}


# --- poles and zeros ------------------------------------------------------------------------------------------------


@pytest.mark.parametrize(("m", "n"), [(1, 4), (2, 5), (3, 6), (4, 7), (10, 13)])
def test_roots_against_mpmath(m, n):
    p = pade(m, n, 20)
    for roots, c in ((p.zeros, p.decimals()[0]), (p.poles, p.decimals()[1])):
        with mp.workdps(40):
            theirs = mp.polyroots([mpf(x) for x in c[::-1]], maxsteps=500, extraprec=500)
            assert len(theirs) == len(roots)
            for root in roots:
                re, im = (mpf(x) for x in root.decimals(15))
                assert min(abs(mp.mpc(re, im) - z) / abs(z) for z in theirs) < 1e-14
                assert root.real == (
                    min((abs(z.imag), abs(z - re)) for z in theirs if abs(z - mp.mpc(re, im)) < 1e-9)[0] < 1e-15
                )


def test_two_five_has_a_zero_where_the_paper_sees_a_pole():
    """The denominator of [2/5] has positive coefficients only: no positive pole. At 5.6801 the numerator vanishes."""
    p = pade(2, 5, 20)
    assert all(x > 0 for x in p.b)
    assert p.positive_pole is None
    assert p.domain_end is not None
    assert p.domain_end.decimals(5) == ("5.6801", "0")
    assert p.domain_end in p.zeros
    assert not p.usable
    assert p.verdict == "not usable for all v* >= 0: it has a zero at v* = 5.68012"
    assert p(5.6) > 0 > p(5.8)


@pytest.mark.parametrize(("m", "n"), [(5, 0), (4, 4), (0, 0)])
def test_an_approximant_that_does_not_decay_is_not_usable(m, n):
    p = pade(m, n, 15)
    assert p.domain_end is None
    assert not p.usable
    assert p.verdict == "not usable for all v* >= 0: it does not tend to 0 for large v*"


@pytest.mark.parametrize("m", PAPER_RANGE)
def test_usable_approximants_stay_between_zero_and_one_and_decrease(m):
    p = pade(m, m + 3, 30)
    if p.usable:
        eps = p(np.concatenate(([0.0], np.logspace(-3, 6, 2001))))
        assert np.all((eps > 0) & (eps <= 1))
        assert np.all(np.diff(eps) < 1e-12)


def test_which_approximants_of_the_paper_s_range_have_positive_poles():
    """Against sign changes of the denominator, evaluated exactly at the printed decimals."""
    with_pole = {m for m in PAPER_RANGE if pade(m, m + 3, 30).positive_pole}
    assert with_pole == {4, 7, 10, 16, 19, 25}
    for m in PAPER_RANGE:
        b = [Fraction(x) for x in pade(m, m + 3, 30).decimals()[1]]
        changes = sum(x * y < 0 for x, y in zip([*b], [*b[1:]], strict=False))
        assert m not in with_pole or changes >= 1  # Descartes' rule
        if changes % 2:
            assert m in with_pole


def test_froissart_doublet_of_seven_ten():
    p = pade(7, 10, 30)
    doublet = p.doublets()[0]
    assert doublet.pole.positive
    assert doublet.zero.positive
    assert doublet.distance < 1e-12
    assert abs(complex(doublet.pole.residue)) < 1e-12
    assert "a zero at v* = 0.279952 and a pole at v* = 0.279952" in p.verdict


def test_partial_fractions_of_the_residues():
    """a(x)/b(x) = sum residue/(x - pole) for m < n: checks poles and residues together."""
    p = pade(3, 6, 25)
    x = 1.25
    assert sum(complex(r.residue) / (x - complex(r.value)) for r in p.poles) == pytest.approx(
        float(p(x)), rel=1e-13, abs=0
    )


def test_real_only_if_the_mirror_image_meets_no_other_root():
    above, below, on_axis = acb(1, arb(0.1, 0.2)), acb(1, arb(-0.1, 0.05)), acb(3, arb(0, 1e-9))
    assert is_real(on_axis, [above, below, on_axis])
    assert not is_real(acb(1, 2), [acb(1, 2), acb(1, -2)])
    with pytest.raises(_TooWideError):
        is_real(above, [above, below, on_axis])


def test_a_root_of_unknown_sign_is_not_positive():
    assert not Root(acb(arb(0, 1)), 1, real=True).positive
    assert Root(acb(arb(2, 1)), 1, real=True).positive
    assert not Root(acb(2, 1), 1, real=False).positive


@pytest.mark.parametrize(("m", "n"), [(3, 6), (3, 0), (0, 4)])
def test_too_short_a_series_is_noticed(m, n):
    with working(300), pytest.raises(_TooWideError) as shortage:
        _solved(derived(16, 8).h, m, n, 30)
    assert 10 <= shortage.value.digits <= 30  # a series of 8 digits holds some more


@pytest.mark.parametrize(("m", "n", "order"), [(2, 0, 8), (3, 6, 15)])
def test_coefficients_are_checked_even_without_roots(monkeypatch, m, n, order):
    module = sys.modules["viscopade.theory.pade"]
    monkeypatch.setattr(module, "_roots", lambda coefficients, digits: ())
    with working(300), pytest.raises(_TooWideError):
        _solved(derived(order, 12).h, m, n, 30)


@pytest.mark.parametrize("digits", [10, 310])
def test_residual_is_an_upper_bound(digits):
    p = pade(1, 4, digits)
    with working(4000):
        ends = [abs(exact_middle(d)) + exact_middle(d.rad()) for d in p._order_conditions()]
    assert all(Fraction(p.residual) >= end * (1 - Fraction(1, 10**6)) for end in ends)
    assert 0 < p.residual < 10.0 ** -min(digits, 300)


def test_contact_order_is_not_guessed_from_a_wide_enclosure():
    with working(300), pytest.raises(_TooWideError):
        _contact((arb(1),), (arb(1),), (arb(1), arb(0, 1e-3), arb(1)))


# --- evaluation -----------------------------------------------------------------------------------------------------


@pytest.mark.parametrize(("m", "n"), [*TABLE, (25, 28), (5, 3), (4, 0)])
def test_evaluation_against_mpmath(m, n):
    p = pade(m, n, 30)
    a, b = ([mpf(x) for x in side[::-1]] for side in p.decimals())
    grid = np.concatenate(([0.0, 5e-324], np.logspace(-8, 12, 41)))
    with mp.workdps(40):
        for v, value in zip(grid, p(grid), strict=True):
            top, bottom = mp.polyval(a, mpf(v)), mp.polyval(b, mpf(v))
            size = mp.polyval([abs(x) for x in a], mpf(v)) / abs(top) + mp.polyval([abs(x) for x in b], mpf(v)) / abs(
                bottom
            )
            assert abs(mpf(value) - top / bottom) <= 2 * (m + n + 3) * size * mpf(2) ** -53 * abs(top / bottom)


def test_evaluation_at_the_ends():
    assert np.array_equal(pade(3, 6)([0.0, np.inf]), [1.0, 0.0])
    assert pade(0, 3)(np.inf) == 0
    assert pade(3, 6)(1e300) == 0
    assert pade(3, 6)(np.ones((2, 3))).shape == (2, 3)


@pytest.mark.parametrize("bad", [-1.0, np.nan, [0.5, -1e-300]])
def test_evaluation_refuses(bad):
    with pytest.raises(ValueError, match=r"^v_star is .*: expected a number >= 0, or inf$"):
        pade(1, 4)(bad)


# --- bad input ------------------------------------------------------------------------------------------------------


@pytest.mark.parametrize(("m", "n"), [(-1, 3), (0, -3), (201, 1), (1, 10**9)])
def test_degrees_out_of_range(m, n):
    with pytest.raises(ValueError, match="expected an integer from 0 to 200"):
        pade(m, n)


@pytest.mark.parametrize("bad", ["3", 2.0, None, True])
def test_degrees_of_wrong_type(bad):
    with pytest.raises(TypeError, match="expected an integer"):
        pade(bad, 3)


def test_constructor_checks_identities():
    p = pade(1, 4, 20)
    rest = (p.poles, p.zeros, p.digits_lost, p.contact_order, p.next_term)
    with pytest.raises(ValueError, match="does not re-expand"):
        Pade(1, 4, 20, (p.a[0], p.a[1] * 2), p.b, p.h, *rest)
    with pytest.raises(ValueError, match="needs 2 and 5"):
        Pade(1, 4, 20, p.a, p.b[:4], p.h, *rest)
