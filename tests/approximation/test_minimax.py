"""Fits of the restitution: equioscillation against proven values, and the choice of degrees."""

import math
import random
import re
from dataclasses import replace
from fractions import Fraction
from pathlib import Path

import pytest

import viscopade as vp
from viscopade.approximation import minimax
from viscopade.approximation.cheapest import cheapest_fit
from viscopade.approximation.minimax import Fit, cost, fit
from viscopade.arithmetic.balls import exact_middle
from viscopade.collision import exact

DEGREES = [(m, n) for m in range(7) for n in range(10) if max(m, n) >= 2]
SPEEDS = ("0.1", "0.5", 1, 2, 5, 10, 30, 100, 1000)
GRID = [(m, n, v) for v in SPEEDS for m, n in DEGREES]
NOT_FOUND = {(3, 8, 30), (2, 9, 100), (0, 9, 1000), (6, 8, 1000)}
"""The only ones of the grid that Remez's algorithm does not find (docs/theory/minimax.md)."""
TOO_ACCURATE = "has an error below 1e-12"


def polynomial(c, v: Fraction) -> Fraction:
    return sum((x * v**i for i, x in enumerate(c)), Fraction(0))


def true_error(approximant: Fit, v_star: Fraction, digits: int = 25) -> float:
    """The error with its sign, from exact arithmetic and a proven value."""
    a, b = approximant.exact
    ratio = polynomial(a, v_star) / polynomial(b, v_star)
    true = exact.collision(v_star, digits)
    epsilon, loss = exact_middle(true.epsilon), exact_middle(true.one_minus_epsilon)
    return float((ratio - 1 + loss) / min(epsilon, loss))


def assert_good(found: Fit):
    assert found.lower_bound > (1 - 1e-6) * found.error
    assert 0 < found.error < 1
    assert found.interval[0] <= Fraction(found.points[0])
    assert Fraction(found.points[-1]) <= found.interval[1]


# --- the grid ---------------------------------------------------------------------------------------------------------


def converges(m, n, high, low=0) -> bool:
    """Whether there is a fit; if not, the reason must be a good one."""
    try:
        found = fit(m, n, high, low)
    except ValueError as reason:
        text = str(reason)
    else:
        assert_good(found)
        return True
    missed = "expected other degrees" in text and (m, n, high) in NOT_FOUND
    assert missed or "expected an error below 1" in text or TOO_ACCURATE in text, (m, n, low, high, text)
    return False


def test_sampled_grid():
    cases = random.Random(4).sample([case for case in GRID if case[2] not in ("0.1", 1)], 40)
    assert sum(converges(*case) for case in cases) > 25


@pytest.mark.slow
@pytest.mark.parametrize("v_max", SPEEDS)
def test_whole_grid(v_max):
    results = {(m, n): converges(m, n, v_max) for m, n in DEGREES}
    wanted = {(m, n) for m, n in DEGREES if n >= 4 and (m, n, v_max) not in NOT_FOUND}
    assert all(results[degrees] for degrees in wanted) or v_max in ("0.1", "0.5", 1)


# --- against proven values --------------------------------------------------------------------------------------------


@pytest.mark.parametrize(
    ("m", "n", "low", "high"),
    [
        (1, 4, 0, 2),
        (3, 6, 0, 10),
        (0, 3, 0, "0.3"),
        (4, 0, 0, "0.5"),
        (2, 4, "0.5", 3),
    ],
)
def test_equioscillation(m, n, low, high):
    found = fit(m, n, high, low)
    assert_good(found)
    for point, deviation in zip(found.points, found.deviations, strict=True):
        if point:
            assert true_error(found, Fraction(point)) == pytest.approx(deviation, rel=1e-6)
    generator = random.Random(1)
    for _ in range(20):
        v_star = found.interval[0] + (found.interval[1] - found.interval[0]) * Fraction(generator.random())
        assert abs(true_error(found, v_star)) <= found.error * (1 + 1e-9)


def test_errors_below_those_of_the_values_are_refused():
    """Degrees one lower have an error above 1e-12; the digits of eps allow no smaller one."""
    with pytest.raises(ValueError, match=r"^the best \[6/9\] on \[0, 0.1\] has an error below 1e-12: expected lower"):
        fit(6, 9, "0.1")


def test_coefficients_for_which_the_limit_at_0_is_right():
    found = fit(3, 6, 10)
    a, b = found.exact
    assert (a[0], b[0]) == (1, 1)
    assert found.a[1] == found.b[1]
    h_2 = float(vp.series(2, 20).h[2])
    assert abs(float(a[2] - b[2]) / h_2 - 1) == pytest.approx(found.error, rel=1e-6)


# --- what a fit's constructor refuses ---------------------------------------------------------------------------------


@pytest.mark.parametrize(
    ("change", "message"),
    [
        (lambda f: {"a": ("1.1", *f.a[1:])}, "a_0 and b_0 must be 1"),
        (lambda f: {"a": (f.a[0], "0.3", *f.a[2:])}, "a_1 and b_1 must be the same"),
        (lambda f: {"b": f.b[:-1]}, r"\[1/4\] has 2 and 5 coefficients"),
        (lambda f: {"b": (*f.b[:-1], "-1")}, r"the denominator of \[1/4\] has a zero at"),
        (lambda f: {"points": f.points[:-1]}, "there are 4 points: expected 5"),
        (lambda f: {"points": f.points[::-1]}, "the points must ascend"),
        (lambda f: {"deviations": tuple(map(abs, f.deviations))}, "alternating signs"),
        (lambda f: {"lower_bound": 2 * f.error}, "between lower_bound and error"),
        (lambda f: {"error": f.error / 2}, "between lower_bound and error"),
    ],
)
def test_contradictions_are_refused(change, message):
    found = fit(1, 4, 2)
    with pytest.raises(ValueError, match=message):
        replace(found, **change(found))


# --- the cheapest degrees ---------------------------------------------------------------------------------------------


@pytest.mark.parametrize(("accuracy", "v_max"), [(1e-3, 2), ("1e-5", 2), (1e-4, 5), ("1e-6", "0.1")])
def test_the_cheapest_is_chosen(accuracy, v_max):
    """On a short interval most degrees are too accurate to be found."""
    found = cheapest_fit(accuracy, v_max)
    assert found.error <= float(accuracy)
    price = cost(found.m, found.n)
    for m, n in DEGREES:
        if cost(m, n) <= price:
            try:
                other = fit(m, n, v_max).error
            except ValueError:
                continue
            assert other >= (float(accuracy) if cost(m, n) < price else found.error)


def test_the_degrees_of_the_pages_table_reach_their_accuracy():
    page = (Path(__file__).parents[2] / "docs" / "usage" / "which-kernel.md").read_text("utf-8")
    columns, *rows = re.findall(r"^\| (V|[\d.]+) \| (.*) \|$", page, re.MULTILINE)
    assert len(rows) == 8
    for end, cells in rows:
        for accuracy, cell in zip(columns[1].split(" | "), cells.split(" | "), strict=True):
            if not cell.startswith("–"):
                m, n = map(int, cell.split()[0].split("/"))
                assert fit(m, n, end).error <= float(accuracy), (end, accuracy)


@pytest.mark.parametrize("accuracy", [0, 1, 1e-13, math.nan, "much"])
def test_accuracies_that_are_refused(accuracy):
    with pytest.raises(ValueError, match=r"^accuracy is .*: expected a number below 1, and at least 1e-12"):
        cheapest_fit(accuracy, 5)


def test_accuracies_that_degrees_do_not_reach():
    with pytest.raises(ValueError, match=r"^accuracy is 2e-12: expected .* reach on \[0, 30\], or") as reason:
        cheapest_fit(2e-12, 30)
    reached = float(str(reason.value).split("expected ")[1].split()[0])
    assert cheapest_fit(reached, 30).error <= reached


# --- bad input --------------------------------------------------------------------------------------------------------


@pytest.mark.parametrize(
    ("arguments", "message"),
    [
        ((1, 1, 2), r"the degrees are \[1/1\]: expected at least 2 for one of them"),
        ((-1, 4, 2), "m is -1: expected an integer from 0 to 12"),
        ((3, 16, 2), "n is 16: expected an integer from 0 to 15"),
        ((1, 4, 0), "v_star_max is 0: expected a number greater than v_star_min = 0"),
        ((1, 4, math.nan), "v_star_max is nan: expected"),
        ((1, 4, 1e7), "v_star_max is 10000000.0: expected .* at most 1000000"),
        ((1, 4, 2, 2), "v_star_max is 2: expected a number greater than v_star_min = 2"),
        ((1, 4, 2, -1), "v_star_min is -1: expected 0, or a number from 1e-06"),
        ((1, 4, "2", "1.9999999"), "is too short"),
        ((1, 4, "fast"), "v_star_max is 'fast': expected"),
    ],
)
def test_values_out_of_range(arguments, message):
    with pytest.raises(ValueError, match=f"^{message}" if not message.startswith("is") else message) as reason:
        fit(*arguments)
    assert "\n" not in str(reason.value)


@pytest.mark.parametrize("arguments", [(1.0, 4, 2), (1, 4, None), (True, 4, 2)])
def test_types_that_are_no_numbers(arguments):
    with pytest.raises(TypeError, match="expected"):
        fit(*arguments)


def test_useless_fits_are_refused():
    with pytest.raises(minimax.TooCoarse, match=r"the best \[2/0\] on \[0, 5\] has a relative error of 23.6"):
        fit(2, 0, 5)


def test_where_no_best_approximant_is_found():
    with pytest.raises(ValueError, match=r"^\[0/9\] on \[0, 1000\]: .*; expected other degrees$"):
        fit(0, 9, 1000)
