"""The exact function: two independent routes, limits, inverse, exact input, and refusals."""

from decimal import Decimal
from fractions import Fraction

import flint
import mpmath
import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

import viscopade as vp
from viscopade import progress
from viscopade.collision import exact
from viscopade.collision.recursion import Recursion
from viscopade.theory.series import series
from viscopade_lab.studies import direct

NUMBERS = ("epsilon", "one_minus_epsilon", "x_max", "tau_c")


def agree(collision, other, digits):
    """Whether all four numbers agree with those of an independent route, to `digits` digits."""
    ours = collision.decimals()
    with mpmath.workdps(digits + 10):
        for name in NUMBERS:
            difference = abs(mpmath.mpf(ours[name]) / mpmath.mpf(getattr(other, name)) - 1)
            assert difference <= mpmath.mpf(10) ** (1 - digits), (name, ours[name])


@pytest.mark.parametrize("v_star", ["1e-6", "1e-3", "0.05", "0.3", "1", "1.7", "3", "30", "1e3", "1e4"])
def test_turning_point_and_time_integration_agree(v_star):
    agree(exact.collision(v_star, 30), direct.collide(v_star, 34), 30)


@pytest.mark.slow
@pytest.mark.parametrize("digits", [50, 100])
@pytest.mark.parametrize("exponent", range(-24, 17, 2))
def test_routes_agree_over_the_whole_range(exponent, digits):
    v_star = Fraction(str(10 ** (exponent / 4)))
    agree(exact.collision(v_star, digits), direct.collide(v_star, digits + 4), digits)


@pytest.mark.slow
def test_routes_agree_at_random():
    random = np.random.default_rng(11)
    for v_star in 10 ** random.uniform(-6, 4, 200):
        agree(exact.collision(v_star, 25), direct.collide(v_star, 29), 25)


def test_infinite_speed():
    ours = exact.collision("inf")
    assert ours.decimals() == {"v_star": "inf", "epsilon": "0", "one_minus_epsilon": "1", "x_max": "0", "tau_c": "0"}
    assert ours.floats()["v_star"] == float("inf") == exact.collision(np.inf).mpf()["v_star"]


@pytest.mark.parametrize("v_star", ["1e-4", "1e-20", "1e-300", "5e-324", "1e-1000"])
def test_small_v_star_follows_the_series(v_star):
    """1 - eps = -sum h_k v*^k, to full relative accuracy."""
    h = series(20, 40).mpf()
    with mpmath.workdps(50):
        v = mpmath.mpf(v_star)
        loss = -sum(h[k] * v**k for k in range(2, 21))
        ours = mpmath.mpf(exact.collision(v_star, 30).decimals()["one_minus_epsilon"])
        assert abs(ours / loss - 1) < mpmath.mpf(10) ** -29


@pytest.mark.parametrize("v_star", ["1e10", "1e30", pytest.param("1e100", marks=pytest.mark.slow)])
def test_large_v_star_tends_to_the_power_law(v_star):
    """eps -> (3/2)^(2/3) v*^(-10/3) and x_max -> kappa eps."""
    ours = exact.collision(v_star, 12).decimals()
    with mpmath.workdps(150):
        v, epsilon, x_max = (mpmath.mpf(text) for text in (v_star, ours["epsilon"], ours["x_max"]))
        limit = mpmath.power(mpmath.mpf(9) / 4, mpmath.mpf(1) / 3) * v ** (-mpmath.mpf(10) / 3)
        tolerance = max(mpmath.mpf(10) ** -11, 100 * v ** (-mpmath.mpf(10) / 3))
        assert abs(epsilon / limit - 1) < tolerance
        assert abs(x_max / (v**2 * epsilon) - 1) < tolerance


def test_more_digits_extend_fewer():
    """Enclosures of different precision meet, and a decimal is the rounding of a longer one."""
    for v_star in ("1e-30", "0.01", "1", "47.11", "1e6"):
        short, long = (exact.collision(v_star, digits) for digits in (12, 90))
        for name in NUMBERS:
            assert short.balls()[name].overlaps(long.balls()[name])
            rounded = Decimal(long.decimals()[name]).normalize(exact.Context(prec=12))
            assert Decimal(short.decimals()[name]) == rounded


BORDER = 100.0  # of v*: beyond, the collision is not integrated in time


@pytest.mark.parametrize("digits", [1, 15, 40, 100])
@pytest.mark.parametrize("v_star", ["1e-80", "1e-3", "0.14", "1", "5.5", "30", 0.999 * BORDER])
def test_in_time_and_by_newtons_method(v_star, digits, monkeypatch):
    """The collision integrated in time from first contact, and from the turning point with a k found beforehand."""
    in_time = exact.collision(v_star, digits)
    monkeypatch.setattr(exact, "collide", None)  # never called beyond the border
    assert exact.collision(1.001 * BORDER, digits).v_star > BORDER
    monkeypatch.setattr(exact, "MOST_IN_TIME", -1e9)
    by_newton = exact.collision(v_star, digits)
    assert in_time.decimals() == by_newton.decimals()
    assert all(ball.overlaps(by_newton.balls()[name]) for name, ball in in_time.balls().items())


@pytest.mark.parametrize("digits", [15, 60])
@pytest.mark.parametrize("place", [0.1, 0.6, 0.95])
def test_a_flipped_bit_of_the_recursion_changes_no_decimal(digits, place, monkeypatch):
    """One coefficient of one expansion is wrong; every expansion in turn, while there is one."""
    right, coefficients = exact.collision("0.7", digits).decimals(), Recursion.coefficients
    for wrong in range(8):
        calls = []

        def flipped(recursion, terms, wrong=wrong, calls=calls):
            u = coefficients(recursion, terms)
            calls.append(u)
            if len(calls) == wrong + 1:
                u[2 + (7 * wrong) % (terms - 2)] ^= 1 << int(place * recursion.bits)
            return u

        monkeypatch.setattr(Recursion, "coefficients", flipped)
        assert exact.collision("0.7", digits).decimals() == right
        assert len(calls) > wrong


@pytest.mark.parametrize(("v_star", "digits"), [("0.3", 400), ("0.2", 100), ("1", 100), ("3", 100)])
def test_the_first_attempt_determines_many_digits(v_star, digits, monkeypatch):
    """Both halves are enclosed once; the bounds of errors grow with the number of terms."""
    enclosed, ends = [], exact.ends
    monkeypatch.setattr(exact, "ends", lambda branch: enclosed.append(branch) or ends(branch))
    exact.collision(v_star, digits)
    assert len(enclosed) == 2


@pytest.mark.slow
def test_a_thousand_digits():
    short, long = (exact.collision("1.5", digits) for digits in (1000, 1100))
    for name in NUMBERS:
        assert long.decimals()[name].startswith(short.decimals()[name][:-2])


@settings(max_examples=15)
@given(st.floats(-12, 6).map(lambda exponent: 10**exponent))
def test_properties_for_any_speed(v_star):
    one, other = (exact.collision(v_star * factor, 15).floats() for factor in (1, 1.01))
    assert 0 < other["epsilon"] <= one["epsilon"] <= 1
    assert 0 < one["one_minus_epsilon"] <= other["one_minus_epsilon"] <= 1
    assert (one["epsilon"], one["one_minus_epsilon"]) != (other["epsilon"], other["one_minus_epsilon"])
    assert other["x_max"] <= one["x_max"]
    assert other["tau_c"] <= one["tau_c"]


# --- inverse ----------------------------------------------------------------------------------------------------------


@pytest.mark.parametrize("v_star", ["1e-15", "1e-3", "0.3", "1", "2.5", "30", "1e4"])
def test_inverse_of_epsilon(v_star):
    collision = exact.collision(v_star, 45)
    back = exact.invert(one_minus_epsilon=collision.decimals()["one_minus_epsilon"], digits=30)
    epsilon = exact.invert(collision.decimals()["epsilon"], digits=30)
    chosen = back if float(v_star) < 1 else epsilon
    with mpmath.workdps(50):
        for name in ("v_star", "x_max", "tau_c"):
            ratio = mpmath.mpf(chosen.decimals()[name]) / mpmath.mpf(collision.decimals()[name])
            assert abs(ratio - 1) < mpmath.mpf(10) ** -29, name


@pytest.mark.parametrize(
    "wanted", [{"one_minus_epsilon": "1e-30"}, {"one_minus_epsilon": "1e-1990"}, {"epsilon": "1e-100"}]
)
def test_inverse_at_the_ends(wanted):
    back = exact.invert(**wanted, digits=20)
    ((name, value),) = wanted.items()
    forward = exact.collision(back.decimals()["v_star"], 25).decimals()[name]
    with mpmath.workdps(40):
        assert abs(mpmath.mpf(forward) / mpmath.mpf(value) - 1) < mpmath.mpf(10) ** -18


def test_inverse_of_one_is_zero():
    assert exact.invert(1).decimals()["v_star"] == "0"
    assert exact.invert(one_minus_epsilon=0, speed=1).decimals()["beta"] == "0"


def test_given_ties_do_not_matter():
    """0.12345 to 4 digits lies exactly between two decimals; what was given is rounded as a fraction."""
    assert exact.invert("0.12345", 4).decimals()["epsilon"] == "0.1234"
    assert exact.collision("1.0005", 4).decimals()["v_star"] == "1.000"


def test_rational_v_star_from_beta_and_speed():
    """v* = 2.5 follows from beta = 6.25 at speed 1: a tie at one digit."""
    assert exact.collision(beta="6.25", speed=1, digits=1).decimals()["v_star"] == "2"
    assert "v_star" not in exact.collision(beta="6.25", speed=2, digits=5).fractions


def test_beta_from_epsilon_and_speed():
    back = exact.invert("0.9", 30, speed="2.5")
    forward = exact.collision(beta=back.decimals()["beta"], speed="2.5", digits=28)
    assert forward.decimals()["epsilon"].startswith("0.9000000000000000000000000")
    assert forward.decimals()["v_star"] == exact.invert("0.9", 28).decimals()["v_star"]


# --- input ------------------------------------------------------------------------------------------------------------


def test_strings_never_become_floats():
    text, binary = (exact.collision(value, 30).decimals()["epsilon"] for value in ("0.3", 0.3))
    assert text[:17] == binary[:17]
    assert text != binary
    long = "0.3" + 40 * "0" + "1"
    assert exact.collision(long, 45).decimals()["epsilon"] != exact.collision("0.3", 45).decimals()["epsilon"]


@pytest.mark.parametrize(
    "value",
    [0.5, "0.5", ".5", " 5e-1 ", Fraction(1, 2), Decimal("0.5"), mpmath.mpf(0.5), np.float32(0.5), np.longdouble(0.5)],
)
def test_any_number_type(value):
    assert exact.collision(value, 12).decimals() == exact.collision("0.5", 12).decimals()


@pytest.mark.parametrize(
    "value", ["", "abc", "0x10", "1_000", "nan", "-1", "1e101", "1e-1001", "1e999999999", "1/2", "１"]
)
def test_refused_strings(value):
    with pytest.raises(ValueError, match=r"v_star is .*: expected 0, infinity, or a number from 1e-1000 to 1e100"):
        exact.collision(value)


@pytest.mark.parametrize("value", [True, None, 1j, [1], b"1", float, np.array([1.0, 2.0])])
def test_refused_types(value):
    with pytest.raises(TypeError, match="expected"):
        exact.collision(value)


@pytest.mark.parametrize(
    "value", [float("nan"), -1.0, float("-inf"), Decimal("NaN"), Decimal("sNaN"), mpmath.mpf("nan"), -Fraction(1, 3)]
)
def test_refused_numbers(value):
    with pytest.raises(ValueError, match="expected"):
        exact.collision(value)


@pytest.mark.parametrize("value", [0, "0", 1.5, -0.1, "inf", "1e-331", "nan"])
def test_refused_coefficients_of_restitution(value):
    with pytest.raises(ValueError, match=r"epsilon is .*: expected (0 < epsilon <= 1|1, or a number from 1e-330)"):
        exact.invert(value)


def test_refused_combinations():
    for arguments in ({}, {"v_star": 1, "beta": 1, "speed": 1}, {"beta": 1}, {"v_star": 1, "speed": 1}):
        with pytest.raises(TypeError, match="expected exactly one of v_star, kappa, and both beta and speed"):
            exact.collision(**arguments)
    for arguments in ({}, {"epsilon": 0.5, "one_minus_epsilon": 0.5}):
        with pytest.raises(TypeError, match="expected exactly one of"):
            exact.invert(**arguments)
    with pytest.raises(ValueError, match="digits is 5001"):
        exact.collision(1, 5001)
    with pytest.raises(ValueError, match="speed is 0"):
        exact.invert(0.5, speed=0)


def test_nothing_global_changes():
    before = flint.ctx.prec, flint.ctx.cap, mpmath.mp.prec
    vp.exact.epsilon(1, 40)
    assert (flint.ctx.prec, flint.ctx.cap, mpmath.mp.prec) == before


def test_progress_is_announced():
    announced = []

    def tracker(steps, description, cost):
        announced.append(description)
        return steps

    with progress.use_tracker(tracker):
        exact.collision("1.25", 20).decimals()
        exact.invert("0.5", 20).decimals()
    assert announced == ["Integration and proof", "Newton's method and proof"]


def test_rest_and_no_damping_keep_beta():
    assert exact.collision(beta="0.5", speed=0).decimals()["beta"] == "0.5"
    assert exact.collision(beta=0, speed=1).decimals()["beta"] == "0"


def test_an_inconsistent_collision_is_refused():
    good, nothing = exact.collision(1, 12), flint.arb("nan")
    with pytest.raises(ValueError, match="too wide for 12 digits: x_max"):
        exact.Collision(12, good.v_star, good.epsilon, good.one_minus_epsilon, flint.arb(0, "inf"), good.tau_c, {})
    with pytest.raises(ValueError):
        exact.Collision(12, nothing, nothing, nothing, nothing, nothing, {})
    with pytest.raises(ValueError, match="do not belong together"):
        exact.Collision(12, good.v_star, good.epsilon, good.epsilon, good.x_max, good.tau_c, {})
    with pytest.raises(ValueError, match="too wide for 30 digits: "):
        exact.Collision(30, good.v_star, good.epsilon, good.one_minus_epsilon, good.x_max, good.tau_c, {})


@pytest.mark.parametrize("v_star", ["1e-3", "0.7", "1.5", "4", "1e3"])
def test_without_the_table_of_first_guesses(v_star, monkeypatch):
    """While the table of double precision is made, first guesses come from the two limits."""
    with_table = exact.collision(v_star, 40).decimals()
    inverse = exact.invert(with_table["epsilon"], 30).decimals()

    def missing(_):
        raise OSError

    monkeypatch.setattr(exact.double, "x_max", missing)
    assert exact.collision(v_star, 40).decimals() == with_table
    assert exact.invert(with_table["epsilon"], 30).decimals() == inverse


@pytest.mark.parametrize("digits", [25, 60])
def test_next_to_a_tie_monotony_decides(digits):
    """eps = 0.25 at v*: at a v* rounded down it is above, at one rounded up below, in whatever decimal place."""
    v_star, unit = Fraction(exact.invert("0.25", digits).decimals()["v_star"]), Fraction(10) ** (2 - digits)
    assert exact.collision(v_star - unit, 1).decimals()["epsilon"] == "0.3"
    assert exact.collision(v_star + unit, 1).decimals()["epsilon"] == "0.2"
