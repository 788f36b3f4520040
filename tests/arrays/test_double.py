"""Double precision against the proven values, in units in the last place; and the manners of the functions."""

import math
import pkgutil
import random
from decimal import Decimal
from fractions import Fraction
from unittest import mock

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from mpmath import mp, mpf

from tools import double_table
from viscopade import compiled
from viscopade.arithmetic.balls import to_mpf
from viscopade.arrays import double, panels
from viscopade.arrays.double import ULP
from viscopade.arrays.panels import CENTRES, FOLD, HALF_WIDTHS, NAMES, PANELS
from viscopade.collision import exact

FORWARD = {name: getattr(double, name) for name in NAMES}
OF_V_STAR = [*FORWARD.values(), double.slope]
DIGITS = 20
ASYMPTOTIC_FROM = 1e7  # there the terms after the leading ones are below 10^-20
needs_extension = pytest.mark.skipif(compiled.extension is None, reason="the extension was not built")
EDGES = [*(CENTRES - HALF_WIDTHS)[1:], 2.0 ** (FOLD + 3)]


# --- the truth ------------------------------------------------------------------------------------------------------


def truth(v_star: float) -> dict[str, mpf]:
    """Values to 20 digits: proven, or (where those take minutes) the leading terms for large v*."""
    if v_star < ASYMPTOTIC_FROM:
        return {name: to_mpf(ball) for name, ball in exact.collision(v_star, DIGITS).balls().items()}
    return leading_terms(v_star)


def leading_terms(v_star: float) -> dict[str, mpf]:
    """As derivations/10_large_v_star.py derives."""
    with mp.workdps(30):
        v = mpf(v_star)
        epsilon, x_max = ((mpf(3) / 2) ** (mpf(2) / 3) / v ** (mpf(n) / 3) for n in (10, 4))
        bracket = 20 * mp.log(v) + 2 * mp.log(12) + 3 * (mp.log(3) / 2 - mp.pi / mp.sqrt(12) - mp.log(2))
        return {"epsilon": epsilon, "one_minus_epsilon": 1 - epsilon, "x_max": x_max, "tau_c": x_max * bracket * 2 / 9}


def ulps(value: float, true: mpf) -> float:
    """Error in units in the last place of a double of this size; below the normal numbers, of the smallest one."""
    with mp.workdps(30):
        return float(abs(mpf(value) - true) / mpf(math.ulp(float(true))))


def inverse_case(v_star: float, true: dict[str, mpf]) -> tuple[dict[str, float], mpf] | None:
    """Return a double near the smaller of eps and 1 - eps, and the v* that belongs to it.

    That v* is nearly the given one: in between, eps (or 1 - eps) is taken for a power of v*. It is not as near as
    possible, because an inverse is easy where v* is a double.
    """
    name = min(("epsilon", "one_minus_epsilon"), key=true.__getitem__)
    portion = float(true[name]) * (1 + 1e-12)
    if portion == 0:
        return None
    with mp.workdps(30):
        power = mpf(double.slope(v_star))
        if name == "one_minus_epsilon":
            power = -power * true["epsilon"] / true[name] if true[name] > 1e-30 else mpf(2)
        return {name: portion}, mpf(v_star) * (mpf(portion) / true[name]) ** (1 / power)


def worst(points) -> dict[str, tuple[float, float]]:
    """Return for every function the largest error in ulp, and where it occurs."""
    found = dict.fromkeys(ULP, (0.0, 0.0))
    for v_star in map(float, points):
        true = truth(v_star)
        errors = {name: ulps(function(v_star), true[name]) for name, function in FORWARD.items()}
        case = inverse_case(v_star, true) if v_star else None
        if case is not None:
            errors["v_star_from"] = ulps(double.v_star_from(**case[0]), case[1])
        for name, error in errors.items():
            found[name] = max(found[name], (error, v_star))
    return found


def assert_within_limits(found):
    print({name: f"{error:.3f} ulp at v* = {v_star!r}" for name, (error, v_star) in found.items()})
    assert all(error <= ULP[name] for name, (error, _) in found.items()), found


def log_uniform(low: float, high: float, number: int) -> list[float]:
    generator = np.random.default_rng(number)
    return list(np.exp(generator.uniform(math.log(low), math.log(high), number)))


def beside(points) -> list[float]:
    return [w for v in points for w in (np.nextafter(v, 0), v, np.nextafter(v, np.inf))]


# Denormal numbers; where eps, 1 - eps, x_max become denormal and 0; the largest double; eps = 1/2.
HARD = [0.0, 5e-324, 1e-310, 2.3e-308, 1e-300, 1.6e-162, 2e-162, 1e-161, 1e-154, 1e-100, 1e-20, 2**-27, 1e-8, 1e-4]
HARD += [0.8354884430, 0.8354884431, 1.0, 1e7, 1e20, 3e92, 1e95, 1e97, 1.1e97, 1e98, 1e100, 1e231, 1e242, 1e243]
HARD += [1e300, math.ldexp(1.0, 1023), 1.7976931348623157e308]


def test_errors_at_hard_points():
    assert_within_limits(worst(HARD))


def test_errors_at_random_points():
    points = log_uniform(1e-3, 1e3, 60) + log_uniform(1e-320, 1e-3, 10) + log_uniform(1e7, 1.7e308, 400)
    assert_within_limits(worst(points))


@pytest.mark.slow
def test_errors_at_ten_thousand_points():
    points = HARD + beside(EDGES) + log_uniform(1e-3, 1e3, 6000) + log_uniform(1e-320, 1e-3, 800)
    points += log_uniform(1e3, 1e7, 700) + log_uniform(1e7, 1.7e308, 2000)
    assert len(points) > 10_000
    assert_within_limits(worst(points))


@pytest.mark.parametrize("v_star", [1e7, 1e10])
def test_leading_terms_are_as_good_as_proven_values(v_star):
    proven = exact.collision(v_star, DIGITS).mpf()
    for name, value in leading_terms(v_star).items():
        assert abs(value / proven[name] - 1) < mpf(10) ** (2 - DIGITS)


@pytest.mark.parametrize("epsilon", [0.999, 0.75, 0.5, 0.3, 1e-3])
def test_inverse_against_proven_values(epsilon):
    proven = exact.invert(epsilon, DIGITS).mpf()["v_star"]
    assert ulps(double.v_star_from(epsilon), proven) <= ULP["v_star_from"]


@pytest.mark.parametrize("loss", [5e-324, 3e-320, 1e-300, 1e-18, 1e-6])
def test_inverse_of_nearly_elastic_collisions(loss):
    proven = exact.invert(one_minus_epsilon=loss, digits=DIGITS).mpf()["v_star"]
    assert ulps(double.v_star_from(one_minus_epsilon=loss), proven) <= ULP["v_star_from"]


@pytest.mark.parametrize("v_star", [1e-8, 0.01, 0.3, 0.49999, 0.5, 0.9, 2, 40])
def test_slope(v_star):
    step = Decimal("1e-8")
    epsilons = [exact.epsilon(Decimal(v_star) * (1 + sign * step), 40) for sign in (1, -1)]
    with mp.workdps(40):
        expected = mp.log(epsilons[0] / epsilons[1]) / mpf(str(2 * step))
    assert double.slope(v_star) == pytest.approx(float(expected), rel=1e-13, abs=0)


# --- limits and properties ------------------------------------------------------------------------------------------


def test_limits():
    assert [f(0) for f in (double.epsilon, double.one_minus_epsilon, double.slope)] == [1, 0, 0]
    assert [f(math.inf) for f in FORWARD.values()] == [0, 1, 0, 0]
    assert double.slope(math.inf) == pytest.approx(-10 / 3, rel=1e-15, abs=0)
    assert [double.v_star_from(e) for e in (0, 1)] == [math.inf, 0]
    assert [double.v_star_from(one_minus_epsilon=e) for e in (0, 1)] == [0, math.inf]


@pytest.mark.parametrize("function", OF_V_STAR)
def test_minus_zero_is_zero(function):
    assert function(-0.0) == function(0.0)
    assert math.copysign(1, function(-0.0)) == 1


speeds = st.floats(0, math.inf)
moderate = st.floats(1e-150, 1e90)


@given(speeds)
def test_the_two_portions_add_up_to_one(v_star):
    epsilon, loss = double.epsilon(v_star), double.one_minus_epsilon(v_star)
    assert 0 <= epsilon <= 1
    assert 0 <= loss <= 1
    assert abs(epsilon + loss - 1) <= math.ulp(1)


@pytest.mark.parametrize("name", ["epsilon", "x_max", "tau_c"])
def test_they_do_not_rise_from_one_double_to_the_next(name):
    """Not proven: what follows from the errors alone is `test_they_never_rise_by_more_than_their_errors`."""
    edges = np.nextafter([*EDGES, *(2.0 ** np.arange(FOLD, 400))], 0)
    before = np.concatenate([edges, log_uniform(1e-6, 1e6, 100_000), log_uniform(1e-300, 1e300, 50_000)])
    assert np.all(FORWARD[name](np.nextafter(before, np.inf)) <= FORWARD[name](before))


@given(moderate)
def test_there_and_back(v_star):
    if v_star < 0.8:
        back = double.v_star_from(one_minus_epsilon=double.one_minus_epsilon(v_star))
    else:
        back = double.v_star_from(double.epsilon(v_star))
    assert back == pytest.approx(v_star, rel=4 * math.ulp(1), abs=0)


@given(st.floats(0.5, 1))
def test_the_inverse_knows_both_portions(epsilon):
    assert double.v_star_from(epsilon) == double.v_star_from(one_minus_epsilon=1 - epsilon)


@given(speeds)
def test_place(v_star):
    place = panels.place_of(np.array([v_star]))
    s, panel, folds = place.s[0], place.panel[0], int(place.folds[0])
    assert 0 <= panel < PANELS
    assert (0 if panel == 0 else -1) <= place.z[0] <= 1
    assert Fraction(s) == Fraction(CENTRES[panel]) + Fraction(HALF_WIDTHS[panel]) * Fraction(place.z[0])
    assert s * 8.0**folds == min(v_star, 2.0**1023)
    assert folds == 0 or s >= 2.0**FOLD


# --- backends ---------------------------------------------------------------------------------------------------------


def same_bits(first, second) -> bool:
    return np.array_equal(np.asarray(first).view(np.int64), np.asarray(second).view(np.int64))


def check_that_backends_agree(seed: int, number: int) -> None:
    """At all kinds of doubles >= 0, at the edges of panels, and at portions that may be tiny."""
    generator = np.random.default_rng(seed)
    any_bits = generator.integers(0, 2**63, number).view(float)
    speeds = np.concatenate([HARD, [-0.0, math.inf], beside(EDGES), any_bits, log_uniform(1e-3, 1e9, number)])
    speeds = speeds[speeds >= 0]
    for function in range(len(NAMES)):
        assert same_bits(double._compiled(function, speeds), double._in_numpy(function, speeds))
    portions = np.concatenate([[0, 5e-324, 0.5], any_bits[any_bits <= 0.5], generator.uniform(0, 0.5, number)])
    elastic = generator.integers(0, 2, portions.size) == 1
    found = double._inverse(portions, elastic)
    with mock.patch.object(double, "extension", None), np.errstate(under="ignore"):
        assert same_bits(found, double._inverse(portions, elastic))


@needs_extension
def test_backends_agree_to_the_last_bit():
    check_that_backends_agree(1, 100_000)


@pytest.mark.parametrize("extension", [compiled.extension, None], ids=["default", "numpy"])
def test_numbers_and_arrays_of_any_layout_are_alike(extension, monkeypatch):
    monkeypatch.setattr(double, "extension", extension)
    values = np.asfortranarray(np.random.default_rng(2).uniform(0, 1, (40, 30)))
    for function in [*OF_V_STAR, double.v_star_from]:
        whole = function(values)
        assert same_bits(whole.T[::-3, ::2], function(values.T[::-3, ::2]))
        assert same_bits(whole[3], [function(float(v)) for v in values[3]])
        assert type(function(0.25)) is float


@needs_extension
def test_the_extension_takes_arrays_of_its_sizes_only():
    rows, v = double._rows(), np.ones(3)
    native = compiled.extension
    for arguments in [(4, rows, v, v), (-1, rows, v, v), (0, rows[1:], v, v), (0, rows, v, v[1:])]:
        with pytest.raises(ValueError, match="sizes"):
            native.panels(*arguments)
    for arguments in [(rows[1:], v, v > 0, v), (rows, v[1:], v > 0, v), (rows, v, v > 0, v[1:])]:
        with pytest.raises(ValueError, match="sizes"):
            native.inverse(*arguments)


# --- manners ----------------------------------------------------------------------------------------------------------


@pytest.mark.parametrize("function", OF_V_STAR)
def test_every_block_is_computed(function):
    values = np.geomspace(1e-3, 1e9, 2 * double._BLOCK + 5)
    np.testing.assert_array_equal(function(values)[-9:], function(values[-9:]))


# --- the table --------------------------------------------------------------------------------------------------------


def committed() -> str:
    return pkgutil.get_data("viscopade", panels.DATA).decode()


@pytest.mark.parametrize("index", [0, *random.Random(1).sample(range(1, PANELS), 2)])
def test_panels_are_made_again(index):
    lines = committed().splitlines()
    for name, row in double_table.panel(index).items():
        assert double_table.line(name, index, row) in lines


@pytest.mark.slow
def test_table_is_made_again():
    assert double_table.text() == committed()


def test_the_extension_reads_aligned_doubles():
    """As C requires, wherever the array's memory begins."""
    odd = np.ndarray((3,), np.float64, bytes(1) + np.array([0.1, 1.0, 5.0]).tobytes(), 1)
    with mock.patch.object(double, "extension") as extension:
        double.epsilon(odd)
    assert not odd.flags.aligned
    assert extension.panels.call_args.args[2].flags.aligned
