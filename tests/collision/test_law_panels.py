"""Panels of any law: they enclose proven collisions, cover an interval without a gap, and refuse what is not proven."""

from fractions import Fraction
from itertools import pairwise

import pytest
from flint import arb, arb_series

from viscopade.arithmetic.balls import ball_of, rational_power, working
from viscopade.collision import exact
from viscopade.collision import law_panels as module
from viscopade.collision.law_panels import law_panels, limit, panel
from viscopade.theory.law import law_of

LAWS = ["hunt-crossley", "linear", "tsuji", "3/2,1/2", "3/2,1", "5/2,3"]
every_law = pytest.mark.parametrize(
    "name", [*LAWS[:2], *(pytest.param(law, marks=pytest.mark.slow) for law in LAWS[2:])]
)
HIGH = Fraction("0.9")
WIDEST = 1e-11  # of what is proven


def at(of, z):
    """Return v*, eps and (1 - eps)/v*^d at one z."""
    with working(128, 1):
        return [series.coeffs()[0] for series in of.course(arb_series([arb(z)]))]


@every_law
def test_panels_enclose_proven_collisions(name):
    law = law_of(name)
    for of in law_panels(law, HIGH):
        for z in (0.01, 0.6, 1) if of.origin else (-1, -0.3, 1):
            v_star, epsilon, loss_ratio, root, stem = at(of, z)
            with working(128):
                true = exact.collision(v_star.mid().str(35, radius=False), 20, law=law)
                assert (root * stem).overlaps(v_star)
                deviations = epsilon / true.epsilon - 1, loss_ratio * true.v_star**law.d / true.one_minus_epsilon - 1
                for deviation in deviations:
                    assert deviation.contains(0)
                    assert deviation.abs_upper() < WIDEST


@every_law
def test_panels_leave_no_gap(name):
    panels = law_panels(law_of(name), HIGH)
    assert panels[0].origin
    with working(128):
        for left, right in pairwise(panels):
            assert left.k.poly()(arb(1)) == right.k.poly()(arb(-1))
    assert at(panels[-1], 1)[0] > arb("0.9")


def test_the_case_with_z_as_a_ball_covers_all_z():
    of = law_panels(law_of("linear"), HIGH)[-1]
    whole = at(of, arb(0, 1))
    assert all(ball.contains(at(of, z)[i]) for z in (-1, 0.1, 1) for i, ball in enumerate(whole))


def test_what_is_too_long_is_halved(monkeypatch):
    made = []

    def only_short(law, left, right):
        if right - left > Fraction(1, 4):
            raise ArithmeticError("too long")
        made.append((left, right))
        return panel(law, left, right)

    monkeypatch.setattr(module, "panel", only_short)
    panels = law_panels.__wrapped__(law_of("hunt-crossley"), Fraction("0.7"))
    with working(128):
        assert all(left.k.poly()(arb(1)) == right.k.poly()(arb(-1)) for left, right in pairwise(panels))
    assert made[0][0] == 0
    assert all(left[1] == right[0] for left, right in pairwise(made))
    assert max(right - left for left, right in made) <= Fraction(1, 4)


def test_attraction_is_refused():
    with pytest.raises(
        ValueError, match="the end is 'return': accepted for proofs on an interval, for the law 1,0 is 'force'"
    ):
        law_panels(law_of("linear", "return"), HIGH)


@pytest.mark.parametrize("name", ["hunt-crossley:1", "linear", "tsuji", "kelvin-voigt:1", "3/2,1/2", "3/2,0"])
@pytest.mark.parametrize("kappa", [60, 10**4])
def test_the_limit_encloses_eps(name, kappa):
    """Also for larger kappa; and it is sharp."""
    law = law_of(name)
    with working(128):
        scale = rational_power(ball_of(law.damping + 1), law.nu - 1)
        enclosed = limit(law, rational_power(arb(kappa), Fraction(1, law.d)))
        for larger in (1, 2, 50):
            epsilon = exact.collision(kappa=kappa * larger, law=law, digits=30).epsilon
            assert enclosed.overlaps(epsilon * rational_power(arb(kappa * larger), law.nu) / scale)  # a wider ball
        assert enclosed.rad() < (1e-1 if kappa == 60 else 1e-3)


def test_the_limit_needs_strong_damping_and_the_end_of_the_force():
    with working(128):
        with pytest.raises(ValueError, match="accepted is kappa"):
            limit(law_of("linear"), arb(2))
        for law in (law_of("linear", "return"), law_of("1/2,1")):
            with pytest.raises(ValueError, match="accepted is nu > 1 with end 'force', or nu = 1"):
                limit(law, arb(100))
