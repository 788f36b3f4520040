"""eps, 1 - eps and v* from the table of proven rows: the same decimals as from an integration, and no other ones."""

import pickle
import random
from fractions import Fraction

import pytest
from flint import arb

import viscopade as vp
from viscopade.arithmetic.balls import ball_of, working
from viscopade.collision import exact, exact_table, panel_proof
from viscopade.collision.exact import _Restitution, _Speed

DRAW = random.Random(53)


def speeds(number):
    return [(repr(10 ** DRAW.uniform(-10, 3)), DRAW.randint(1, 38)) for _ in range(number)]


def losses(number):
    return [(10 ** DRAW.uniform(-20, 0), DRAW.randint(1, 36)) for _ in range(number)]


def assert_integrated(found, wanted, digits):
    """The table gave the same decimals as an integration."""
    assert isinstance(found, exact._Tabulated)
    assert found.decimals() == exact._determined(wanted, digits).decimals()


@pytest.mark.parametrize(("v_star", "digits"), [*speeds(12), ("1", 30), ("0." + 40 * "9", 37)])
def test_a_speed_has_the_decimals_of_an_integration(v_star, digits):
    wanted = _Speed(Fraction(v_star) ** 2, Fraction(1), {"v_star": Fraction(v_star)})
    assert_integrated(exact.collision(v_star, digits), wanted, digits)


@pytest.mark.parametrize(("beta", "velocity"), [("1.307", "0.02"), ("3", "1e-40"), ("0.7", "1")])
def test_beta_and_kappa_have_the_decimals_of_an_integration(beta, velocity):
    given = Fraction(beta), Fraction(velocity)
    assert_integrated(exact.collision(beta=beta, speed=velocity), _Speed(*given, {"beta": given[0]}), 30)
    assert_integrated(exact.collision(kappa=beta), _Speed(given[0], Fraction(1), {"kappa": given[0]}), 30)


@pytest.mark.parametrize("impact", [None, Fraction(5, 2)])
@pytest.mark.parametrize(("loss", "digits"), [*losses(5), (1 - 1e-9, 25), (0.5, 30)])
def test_an_inverse_has_the_decimals_of_an_integration(loss, digits, impact):
    found = exact.invert(one_minus_epsilon=loss, digits=digits, speed=impact)
    assert_integrated(found, _Restitution(1 - Fraction(loss), impact), digits)


@pytest.fixture
def no_integration(monkeypatch):
    """An integration fails."""

    def refuse(*_):
        raise RuntimeError("integrated")

    monkeypatch.setattr(exact, "_determined", refuse)


@pytest.mark.usefixtures("no_integration")
@pytest.mark.parametrize("v_star", ["1.5e-11", "1e-6", "0.0625", "0.3", "1", "4.9", "700"])
def test_the_table_is_enough_for_37_digits(v_star):
    """Forth and back; only x_max and tau_c are integrated."""
    epsilon, loss = vp.exact.epsilon(v_star, 37), vp.exact.one_minus_epsilon(v_star, 37)
    assert abs(epsilon + loss - 1) < 1e-37
    back = exact.invert(epsilon, 35) if epsilon < loss else exact.invert(one_minus_epsilon=loss, digits=35)
    with working(200):
        assert abs(back.v_star / ball_of(Fraction(v_star)) - 1) < arb(10) ** -36
    for name in ("x_max", "tau_c"):
        with pytest.raises(RuntimeError, match="integrated"):
            getattr(back, name)


@pytest.mark.usefixtures("no_integration")
@pytest.mark.parametrize(
    "given",
    [
        {"v_star": "1e-11"},
        {"v_star": 2**23},
        {"v_star": "1e100"},
        {"v_star": "0.3", "digits": 42},
        {"kappa": 1, "law": "linear"},
    ],
)
def test_what_the_table_does_not_tell_is_integrated(given):
    with pytest.raises(RuntimeError, match="integrated"):
        exact.collision(**given)


@pytest.mark.usefixtures("no_integration")
@pytest.mark.parametrize("given", [{"epsilon": "1e-80"}, {"one_minus_epsilon": "1e-25"}, {"epsilon": "1e-330"}])
def test_an_inverse_that_the_table_does_not_tell_is_integrated(given):
    with pytest.raises(RuntimeError, match="integrated"):
        exact.invert(**given)


def test_a_ball_across_the_end_of_a_panel_has_no_enclosure():
    with working(exact_table.BITS):
        for v_star in (arb(1), 1 - arb(2) ** -120, 1 + arb(2) ** -120):
            assert exact_table.portions(v_star) is not None
        assert exact_table.portions(arb(1, 2.0**-100)) is None


@pytest.mark.parametrize("index", [0, 5, 30, 90])
def test_an_enclosure_is_as_wide_as_the_proven_bound(index):
    """At the middle of a panel the smaller function is a_0 (1 ± bound), or on panel 0 c z^2 (1 ± bound) near 0."""
    name, bound, row = panel_proof.exact_rows()[index]
    with working(exact_table.BITS):
        v_star = arb(float(panel_proof.CENTRES[index])) if index else arb(2) ** -30
        found = exact_table.portions(v_star)
        smaller = found.epsilon if name == "epsilon" else found.loss
        exactly = row(Fraction(0 if index else 1, 2**26))
        assert smaller.contains(ball_of(exactly))
        assert 0.99 * bound < float(smaller.rad() / smaller * arb(2) ** panel_proof.EXACT_BITS) < 1.02 * bound + 1
        assert (found.epsilon + found.loss).contains(1)


def test_a_speed_that_is_not_bracketed_is_not_found(monkeypatch):
    half = Fraction(1, 2)
    with working(exact_table.BITS):
        assert exact_table.v_star_of(half) is not None
        for wrong in (exact_table.Portions(arb(1), arb(0)), exact_table.Portions(arb(0), arb(1)), None):
            monkeypatch.setattr(exact_table, "portions", lambda _, wrong=wrong: wrong)
            assert exact_table.v_star_of(half) is None


@pytest.mark.parametrize("rows", [{}, {i: row for i, row in panel_proof.exact_rows().items() if i % 9}])
def test_a_table_that_is_not_whole(monkeypatch, rows):
    """Its rows are named; more digits, from which it is made, are integrated."""
    right = exact.collision("0.8", 42).decimals()
    monkeypatch.setattr(exact_table, "exact_rows", lambda: rows)
    kept = exact_table._row, exact_table._odds_at_end
    for known in kept:
        known.cache_clear()
    try:
        assert exact.collision("0.8", 42).decimals() == right
        for asked in (lambda: exact.collision("0.01", 20), lambda: exact.invert("0.7", 20)):
            with pytest.raises(OSError, match=r"data/exact\.txt has no row of panel \d+: run python -m tools\.exact"):
                asked()
    finally:
        for known in kept:
            known.cache_clear()


def test_a_collision_from_the_table_is_a_record_like_others():
    found = exact.collision("0.3", 20)
    whole = exact._determined(found.problem, 20)
    assert found == whole
    assert whole == found
    assert hash(found) == hash(whole)
    assert pickle.loads(pickle.dumps(exact.collision("0.3", 20))) == whole


def test_a_wrong_row_is_found_where_the_collision_is_integrated(monkeypatch):
    right = exact_table.portions
    off = arb(2) ** -100
    monkeypatch.setattr(
        exact_table, "portions", lambda v: exact_table.Portions(right(v).epsilon + off, right(v).loss - off)
    )
    assert exact.collision("0.3").epsilon is not None
    with pytest.raises(OSError, match=r"data/exact\.txt does not agree with an integration"):
        exact.collision("0.3").decimals()
