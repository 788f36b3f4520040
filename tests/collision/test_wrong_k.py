"""Step 5 of docs/theory/exact-function.md: what is found at one k encloses what is true at another.

The bounds of the derivatives are compared with differences, and results are enclosed from a k that is wrong on purpose.
"""

from fractions import Fraction
from functools import cache

import pytest
from flint import arb

from viscopade.arithmetic.balls import exact_middle, working
from viscopade.collision import exact
from viscopade.collision.exact import _AtK, _Restitution, _Speed
from viscopade.collision.flow import Dyadic, collide
from viscopade.theory.law import VISCOELASTIC

ACCURACY = 120
WORKING = 250
# 1e-6 to 1e6, closely where the bounds are not limits.
DAMPINGS = [Fraction(10) ** e for e in range(-6, 7)]
DAMPINGS += [Fraction(n, 4) for n in (1, 2, 3, 5, 7, 10, 16, 28, 48, 80, 180)]
OFFSETS = [s * Fraction(1, 10**e) for e in (3, 6, 12) for s in (-1, 1)]


@cache
def at(k: Fraction) -> _AtK:
    k_dyadic = Dyadic(k.numerator * 2**150 // k.denominator, -150)
    with working(WORKING):
        return _AtK.enclosed(exact._branches(k_dyadic, ACCURACY), VISCOELASTIC)


@cache
def numbers(k: Fraction) -> dict[str, arb]:
    """All results at k, from formulas (2) and (3) without a bound of step 5."""
    here = at(k)
    with working(WORKING):
        f, time = 2 * here.loading.p, here.loading.time + here.unloading.time
        return {
            "kappa": here.log_kappa.exp(),
            "epsilon": here.epsilon,
            "one_minus_epsilon": here.one_minus_epsilon,
            "x_max": 1 / f.root(5) ** 4,
            "tau_c": 2 * f.root(5) * time,
            "f": f,
            "m": here.unloading.p,
            "work": here.loading.work,
        }


def shifted(k: Fraction, offset: Fraction) -> tuple[Fraction, arb]:
    """Return another k, and by how much ln k differs."""
    other = k * (1 + offset)
    with working(WORKING):
        return other, abs((at(other).k / at(k).k).log())


# --- the bounds -------------------------------------------------------------------------------------------------------


@cache
def slopes(k: Fraction) -> dict[str, float]:
    """d ln(number)/d ln k, by a central difference."""
    step = Fraction(1, 10**9)
    above, below = numbers(k * (1 + step)), numbers(k * (1 - step))
    with working(WORKING):
        return {name: float((above[name] / below[name]).log() / 2) * 10**9 for name in above}


@pytest.mark.parametrize("k", DAMPINGS, ids=float)
def test_the_bounds_of_the_derivatives(k):
    slope, tiny = slopes(k), 1e-12
    assert -tiny <= slope["f"] <= 1
    assert -1 <= slope["m"] <= tiny
    assert 1 <= slope["kappa"] <= 1.2
    assert -2 <= slope["epsilon"] <= tiny
    assert abs(slope["one_minus_epsilon"]) <= 3
    assert -0.8 <= slope["x_max"] <= tiny
    assert 1 <= slope["work"] + 1 <= 2
    with working(WORKING):
        here = at(k)
        time, r_c = float(here.loading.time + here.unloading.time), float((here.k * here.unloading.p).sqrt())
        assert abs(slope["tau_c"]) <= 1.2 + min(float(k) / (4 * time), 2 / r_c)
        assert -slope["epsilon"] >= float(here.least_slope)


def test_the_bounds_are_reached():
    """The slopes tend to them for small or large k, all but those of 1 - eps and tau_c, which are generous."""
    large = slopes(DAMPINGS[12])
    assert large["kappa"] > 1.19
    assert large["epsilon"] < -1.98
    assert large["x_max"] < -0.79
    assert slopes(DAMPINGS[0])["kappa"] < 1.001


# --- enclosed from elsewhere ------------------------------------------------------------------------------------------


def assert_encloses(found: dict[str, arb], k: Fraction):
    truth = numbers(k)
    with working(WORKING):
        for name in ("epsilon", "one_minus_epsilon", "x_max", "tau_c"):
            assert found[name].overlaps(truth[name]), name


@pytest.mark.parametrize("k", DAMPINGS, ids=float)
@pytest.mark.parametrize("offset", OFFSETS, ids=float)
def test_restitution_and_course_at_another_k(k, offset):
    other, delta = shifted(k, offset)
    with working(WORKING):
        assert_encloses({**at(k).restitution(delta), **at(k).course(delta)}, other)


@pytest.mark.parametrize("k", DAMPINGS, ids=float)
@pytest.mark.parametrize("offset", OFFSETS, ids=float)
def test_a_speed_from_another_k(k, offset):
    other, delta = shifted(k, offset)
    with working(WORKING):
        kappa = exact_middle(numbers(other)["kappa"])  # exact to far more digits than the offset
        found = _Speed(kappa, Fraction(1), {}).enclosed(at(k))
        assert_encloses(found, other)
        assert (found["v_star"] ** 2).overlaps(numbers(other)["kappa"])
        # Not much wider than it must be: every relative radius is a small multiple of the offset.
        assert all(found[name].rad() < 12 * delta * found[name] for name in ("one_minus_epsilon", "x_max", "tau_c"))


@pytest.mark.parametrize("k", DAMPINGS, ids=float)
@pytest.mark.parametrize("offset", OFFSETS, ids=float)
def test_an_inverse_from_another_k(k, offset):
    other, delta = shifted(k, offset)
    with working(WORKING):
        truth = numbers(other)
        loss = exact_middle(truth["one_minus_epsilon"])
        wanted = _Restitution(1 - loss if loss < Fraction(1, 2) else exact_middle(truth["epsilon"]), None)
        found = wanted.enclosed(at(k))
        assert_encloses(found, other)
        assert (found["v_star"] ** 2).overlaps(truth["kappa"])
        assert found["v_star"].rad() < 20 * delta * found["v_star"]


@pytest.mark.parametrize("v_star", ["1e-3", "0.3", "1", "3"])
@pytest.mark.parametrize("wrong", [0, 1], ids=["k", "speed"])
@pytest.mark.parametrize("sign", [-1, 1])
def test_in_time_from_a_start_that_is_off(v_star, wrong, sign):
    """By 2^-40: the collision is that of another v*, and the enclosure at the wanted one is as much wider."""
    wanted = _Speed(Fraction(v_star) ** 2, Fraction(1), {})
    start = list(wanted.start(ACCURACY))
    start[wrong] = Dyadic((start[wrong].mantissa << 40) + sign * start[wrong].mantissa, start[wrong].exponent - 40)
    branches = collide(*start, ACCURACY)
    truth = exact.collision(v_star, 60).balls()
    with working(WORKING):
        found = wanted.enclosed(_AtK.enclosed(branches, VISCOELASTIC))
        assert all(ball.overlaps(truth[name]) for name, ball in found.items())
        assert all(33 < found[name].rel_accuracy_bits() < 43 for name in ("one_minus_epsilon", "x_max", "tau_c"))


def test_loading_and_unloading_with_different_k_are_refused():
    (loading, _), (_, other) = (exact._branches(Dyadic((1 << 40) + off, -40), ACCURACY) for off in (0, 1))
    with working(WORKING), pytest.raises(ValueError, match="different k"):
        _AtK.enclosed((loading, other), VISCOELASTIC)


@pytest.mark.parametrize("k", [Fraction(1, 1000), Fraction(1), Fraction(10**5)], ids=float)
def test_a_k_too_far_off_is_refused(k):
    with working(WORKING):
        with pytest.raises(ArithmeticError, match="too far"):
            at(k).course(arb(1) / 8)
        with pytest.raises(ArithmeticError, match="too far"):
            _Restitution(Fraction(1, 3), None).enclosed(at(k))
