"""Best approximants: closed forms, and the theorem of alternation with errors by another route."""

import math
from dataclasses import replace

import numpy as np
import pytest
from flint import arb

from viscopade.approximation import remez
from viscopade.approximation.lacunary import Powers, full_powers
from viscopade.approximation.remez import Coordinate, NoBest, Problem, TooAccurate
from viscopade.approximation.target import target
from viscopade.arithmetic.balls import working


def one(_):
    return arb(1)


def free(m, n, f, interval, weight=one, **more):
    """max |N/D - f|/w without conditions but b_0 = 1."""
    return Problem(full_powers(m, n), lambda v: (1 - f(v), 1 / weight(v)), interval, **more)


def restitution(m, n, v_max, measure="both", v_min=0.0):
    """The elastic problem, written down once more."""

    def values(v):
        epsilon, loss, ratio = target(v)
        return ratio, 1 / ratio if measure == "both" and loss < epsilon else v * v / epsilon

    return Problem(full_powers(m, n), values, (v_min, v_max), 2)


def floats(values):
    return np.array([float(x) for x in values])


def deviation(problem, found, v):
    """The weighted error by Horner's rule in doubles, for v not near 0."""
    ratio = np.polynomial.polynomial.polyval(v, floats(found.a)) / np.polynomial.polynomial.polyval(v, floats(found.b))
    with working(128):
        values = [(arb(x) ** problem.contact, *problem.values(arb(x))) for x in v]
        f, weight = np.array([(float(1 - g * power), float(power / p)) for power, g, p in values]).T
    return (ratio - f) / weight


def assert_levelled(problem, found):
    assert len(found.points) == problem.number_of_points
    assert list(found.points) == sorted(set(found.points))
    assert all(x * y < 0 for x, y in zip(found.deviations, found.deviations[1:], strict=False))
    assert 0 < found.lower_bound <= min(map(abs, found.deviations))
    assert max(map(abs, found.deviations)) <= found.error
    assert found.lower_bound > (1 - 1e-6) * found.error


def assert_error(found, exact):
    """The exact least error, to the tolerance of levelling, between the bounds (to the digits of the values)."""
    assert found.error == pytest.approx(exact, rel=remez.TOLERANCE, abs=0)
    assert found.lower_bound * (1 - 1e-12) <= exact <= found.error * (1 + 1e-12)


# --- closed forms ---------------------------------------------------------------------------------------------------


@pytest.mark.parametrize("n", [2, 3, 7, 12])
def test_powers_by_lower_powers(n):
    """v^n minus its best polynomial is a multiple of Chebyshev's."""
    found = remez.solve(free(n - 1, 0, lambda v: v**n, (0.0, 1.0)))
    assert_error(found, 2 * 4.0**-n)
    nodes = (1 - np.cos(np.pi * np.arange(n + 1) / n)) / 2
    np.testing.assert_allclose(found.points, nodes, atol=1e-5)


@pytest.mark.parametrize("n", [1, 4, 9])
@pytest.mark.parametrize("x", [1.25, 2.0])
def test_a_pole_by_polynomials(n, x):
    """Chebyshev: 1/(t - x) on [-1, 1] has the error (x - sqrt(x^2 - 1))^n/(x^2 - 1)."""
    found = remez.solve(free(n, 0, lambda v: 1 / (2 * v - 1 - arb(x)), (0.0, 1.0)))
    assert_error(found, (x - math.sqrt(x * x - 1)) ** n / (x * x - 1))


def test_the_exponential_by_a_line():
    found = remez.solve(free(1, 0, lambda v: v.exp(), (0.0, 1.0)))
    slope = math.e - 1
    np.testing.assert_allclose(floats(found.a), [(math.e - slope * math.log(slope)) / 2, slope], rtol=1e-12)


@pytest.mark.parametrize(("m", "n"), [(1, 2), (3, 2), (2, 4)])
def test_reciprocals_swap_numerator_and_denominator(m, n):
    """Weighted with f, f ~ N/D and 1/f ~ D/N have nearly the same error E: E/(1 + E) and E/(1 - E) are its ends."""
    interval = (0.0, 2.0)
    error = remez.solve(free(m, n, lambda v: v.exp(), interval, lambda v: v.exp())).error
    swapped = remez.solve(free(n, m, lambda v: (-v).exp(), interval, lambda v: (-v).exp())).error
    assert swapped == pytest.approx(error, rel=3 * error, abs=0)


def test_even_function_on_the_half_line():
    """1/(1 + v)^2 by a/(b_0 + b_1 v): with v = (1 + t)/(1 - t) it is ((1 - t)/2)^2 by a [1/1] in t."""
    found = remez.solve(free(0, 1, lambda v: (1 + v) ** -2, (0.0, 1e9), coordinate=Coordinate(1.0, True)))
    assert_levelled(free(0, 1, lambda v: (1 + v) ** -2, (0.0, 1e9)), found)


def test_more_digits():
    found = remez.solve(free(19, 0, lambda v: v**20, (0.0, 0.125), digits=60))
    assert found.error == pytest.approx(2 * 4.0**-20 * 0.125**20, rel=1e-9, abs=0)


def test_where_no_best_exists():
    """Approximants with a pole that tends to 0 come near the least error, and none attains it."""
    with pytest.raises(NoBest):
        remez.solve(restitution(2, 1, 2.0, "relative"))


# --- the theorem ----------------------------------------------------------------------------------------------------

CASES = [
    (0, 2, 1.0, "both"),
    (2, 0, 1.0, "both"),
    (1, 4, 2.0, "both"),
    (3, 6, 10.0, "both"),
    (6, 1, 1.0, "both"),
    (3, 0, 0.5, "both"),
    (3, 3, 5.0, "both"),  # nearly a common factor at 0
    (5, 6, 30.0, "both"),  # the same
    (3, 9, 1000.0, "both"),
    (3, 6, 30.0, "both"),
    (1, 2, 3.0, "relative"),
    (2, 2, 1.0, "relative"),
    (2, 5, 5.0, "relative"),
    (6, 9, 100.0, "relative"),
]


@pytest.mark.parametrize(("m", "n", "v_max", "measure"), CASES)
def test_alternation(m, n, v_max, measure):
    problem = restitution(m, n, v_max, measure)
    found = remez.solve(problem)
    assert problem.number_of_points == m + n
    assert_levelled(problem, found)
    assert (len(found.a), len(found.b)) == (m + 1, n + 1)
    v = np.geomspace(0.05, v_max, 500)
    assert np.all(np.polynomial.polynomial.polyval(v, floats(found.b)) > 0)
    assert np.max(np.abs(deviation(problem, found, v))) <= found.error * (1 + 1e-6) + 1e-12
    places, signed = (floats(values) for values in (found.points, found.deviations))
    far = places > 0.05
    np.testing.assert_allclose(deviation(problem, found, places[far]), signed[far], rtol=1e-6, atol=1e-12)


@pytest.mark.parametrize(("m", "n"), [(1, 3), (2, 4)])
def test_no_approximant_nearby_is_better_at_all_points(m, n):
    problem = restitution(m, n, 3.0)
    found = remez.solve(problem)
    generator = np.random.default_rng(1)
    for _ in range(50):
        a, b = floats(found.a), floats(found.b)
        a[2:] *= 1 + 1e-3 * generator.normal(size=a.size - 2)
        b[2:] *= 1 + 1e-3 * generator.normal(size=b.size - 2)
        a[1] = b[1] = b[1] * (1 + 1e-3 * generator.normal())
        other = replace(found, a=tuple(map(arb, a)), b=tuple(map(arb, b)))
        points = np.array(found.points[1:])
        errors = list(np.abs(deviation(problem, other, points)))
        errors.append(abs((a[2] - b[2] if m >= 2 else -b[2]) / float(problem.values(arb(0))[0]) + 1))  # at v = 0
        assert max(errors) > found.lower_bound


def test_the_interval_may_begin_later():
    problem = restitution(2, 4, 5.0, v_min=1.0)
    found = remez.solve(problem)
    assert_levelled(problem, found)
    assert found.points[0] >= 1.0
    assert found.error < remez.solve(restitution(2, 4, 5.0)).error


def test_a_start_saves_exchanges():
    first, second = restitution(3, 6, 10.0), restitution(3, 6, 10.0)
    found = remez.solve(first)
    again = remez.solve(second, found.points)
    assert len(second.computed) < len(first.computed)  # points where the target was asked for
    assert again.error == pytest.approx(found.error, rel=1e-9, abs=0)


# --- gaps -----------------------------------------------------------------------------------------------------------


def test_even_powers_are_powers_of_the_square():
    """N/D in v^2 on [0, 1] is the best of the function of w = v^2 in full powers."""
    powers = Powers((0, 2, 4), (0, 2))
    lacunary = free(4, 2, lambda v: (v * v).exp(), (0.0, 1.0))
    found = remez.solve(replace(lacunary, powers=powers))
    full = remez.solve(free(2, 1, lambda w: w.exp(), (0.0, 1.0)))
    assert len(found.points) == powers.coefficients + 1
    assert found.error == pytest.approx(full.error, rel=1e-8)
    np.testing.assert_allclose(floats(found.a)[::2], floats(full.a), rtol=1e-7)
    assert [float(c) for c in (*found.a[1::2], *found.b[1::2])] == [0, 0, 0]


# --- what cannot be had ---------------------------------------------------------------------------------------------


@pytest.mark.parametrize(("m", "n"), [(1, 1), (2, 2), (1, 3)])
def test_what_is_represented_exactly(m, n):
    with pytest.raises(TooAccurate, match="too small for values of 17 digits"):
        remez.solve(free(m, n, lambda v: (1 + v) / (2 + v), (0.0, 1.0)))


def test_values_that_are_not_accurate_enough():
    with pytest.raises(TooAccurate):
        remez.solve(restitution(6, 9, 0.1))


@pytest.mark.parametrize("interval", [(1.0, 1.0), (2.0, 1.0), (-1.0, 1.0), (0.0, math.inf), (0.0, math.nan)])
def test_bad_intervals(interval):
    with pytest.raises(ValueError, match=r"^interval is .* expected two finite numbers"):
        free(1, 1, lambda v: v.exp(), interval)


def test_bad_degrees():
    with pytest.raises(ValueError, match="expected ascending exponents"):
        free(-1, 1, lambda v: v.exp(), (0.0, 1.0))


def test_no_pole_free_approximant():
    """tan crosses its pole: no continuous approximant is near."""
    with pytest.raises(NoBest):
        remez.solve(free(1, 1, lambda v: v.tan(), (0.0, 2.0)))
