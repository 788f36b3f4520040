"""Approximants of the inverse, eps -> v*: errors by a second route, there and back, limits, and what is refused."""

import math
from fractions import Fraction
from functools import partial
from itertools import pairwise

import numpy as np
import pytest

from tests.approximation.arrays import half_line_values
from viscopade.approximation import half_line, inverse, lawson
from viscopade.approximation.lacunary import Powers
from viscopade.arrays import double
from viscopade.collision import exact
from viscopade.kernels import formulas
from viscopade.kernels.expressions import Reading, Run, evaluate


class Kernel:
    """A best approximant with given powers on (0, 1], or with degrees on an interval: its error, and v* on arrays."""

    def __init__(self, *given):
        fit = inverse.fit_interval(*given) if len(given) > 1 else inverse.fit_whole(*given)
        self.quotient, self.error, self.points = fit.quotient, fit.error, fit.points
        self.epsilon_min = Fraction(given[2] if len(given) > 1 else 0)
        self.form = inverse.INTERVAL_FORM if self.epsilon_min else inverse.WHOLE_FORM

    def of_portions(self, epsilon, loss):
        powers, numbers = self.quotient.powers, (tuple(map(float, part)) for part in (self.quotient.a, self.quotient.b))
        arrays = Reading(float, {"sqrt": np.sqrt, "pow": np.power})
        given = {"epsilon": epsilon, "loss": loss, **formulas.constants(powers, *numbers)}
        with np.errstate(all="ignore"):
            near, *far = (
                evaluate(branch.results["v_star"], Run(branch.program, given, arrays), arrays)
                for branch in formulas.inverse_branches(powers, self.form)
            )
        return np.where(loss <= epsilon, near, far[0]) if far else near


INTERVALS = [(2, 2, "0.1", 2.4e-4), (2, 3, "0.5", 1.72e-7), (3, 3, "0.1", 1.23e-6)]


@pytest.fixture(params=INTERVALS, ids=str)
def on_interval(request):
    return Kernel(*request.param[:3]), request.param[-1]


def smallest(accuracy):
    """Return the approximant for all of (0, 1] with the fewest coefficients and the wanted accuracy."""
    return next(found for found in map(Kernel, inverse.WHOLE) if found.error <= accuracy)


def of_epsilon(kernel, epsilon=None, *, one_minus_epsilon=None):
    """Return a kernel's v*, from 1 - eps where eps is near 1."""
    loss = np.asarray(1 - epsilon if one_minus_epsilon is None else one_minus_epsilon)
    return kernel.of_portions(np.asarray(1 - loss if epsilon is None else epsilon), loss)


@pytest.fixture(params=inverse.WHOLE, ids=lambda powers: powers.label)
def whole(request):
    return Kernel(request.param)


def test_errors_on_intervals(on_interval):
    kernel, claimed = on_interval
    assert 0.99 * claimed < kernel.error < claimed
    epsilon = np.linspace(float(kernel.epsilon_min), 1, 5003)[:-1]
    error = np.abs(of_epsilon(kernel, epsilon) / double.v_star_from(epsilon) - 1).max()
    assert error < kernel.error * (1 + 1e-9)
    assert error > 0.9 * kernel.error


def test_errors_on_the_whole(whole):
    epsilon = np.geomspace(1e-25, 0.999, 5003)
    error = np.abs(of_epsilon(whole, epsilon) / double.v_star_from(epsilon) - 1).max()
    assert 0.9 * whole.error < error < whole.error * (1 + 1e-9)


def test_more_coefficients_are_better():
    errors = [inverse.fit_whole(powers).error for powers in inverse.WHOLE]
    assert all(left > 1.5 * right for left, right in pairwise(errors))


def test_against_the_exact_inverse(whole):
    for epsilon in ("0.999999", "0.5", "0.01", "1e-8"):
        true = float(exact.invert(epsilon, 20).mpf()["v_star"])
        assert abs(of_epsilon(whole, float(epsilon)) / true - 1) < whole.error * (1 + 1e-6)


def test_there_and_back():
    """An error e of eps in both measures is one of at most 2 e in q, which is at least the square of v*."""
    back, forward = smallest(1e-7), half_line.fit_half_line(half_line.BOTH[-1], "both")
    numbers = (tuple(map(float, part)) for part in (forward.quotient.a, forward.quotient.b))
    of = partial(half_line_values, forward.quotient.powers, *numbers)
    slow, fast = np.geomspace(1e-3, 1, 151), np.geomspace(1, 1e6, 151)
    found = np.concatenate([of_epsilon(back, one_minus_epsilon=of(slow)[1]), of_epsilon(back, of(fast)[0])])
    v_star = np.concatenate([slow, fast])
    assert np.abs(found / v_star - 1).max() < 1.01 * (back.error + forward.error)


def test_near_the_elastic_limit(whole):
    """Given 1 - eps, no digits are lost; v* -> sqrt((1 - eps)/c)."""
    loss = np.geomspace(1e-300, 1e-3, 100)
    true = double.v_star_from(one_minus_epsilon=loss)
    assert np.abs(of_epsilon(whole, one_minus_epsilon=loss) / true - 1).max() < whole.error * (1 + 1e-9)
    assert of_epsilon(whole, 1.0) == 0
    assert of_epsilon(whole, one_minus_epsilon=0.0) == 0


def test_error_alternates():
    kernel = Kernel(2, 2, "0.1")
    assert len(kernel.points) == 6
    q = np.array(kernel.points[1:]) ** 2
    signs = np.sign(of_epsilon(kernel, 1 / (1 + q)) / double.v_star_from(1 / (1 + q)) - 1)
    assert (signs[1:] * signs[:-1] == -1).all()


def test_beyond_double_precision_is_refused():
    with pytest.raises(ArithmeticError, match="too small"):
        inverse.fit_interval(6, 6, "0.99")


@pytest.mark.parametrize(
    ("call", "error", "message"),
    [
        (lambda: inverse.fit_interval(2, 2, 1), ValueError, "expected a number >= 1e-4 and < 1"),
        (lambda: inverse.fit_interval(2, 2, 0), ValueError, "expected a number >= 1e-4 and < 1"),
        (lambda: inverse.fit_interval(10, 2, 0.5), ValueError, "expected an integer from 0 to 9"),
        (lambda: inverse.fit_interval(2.0, 2, 0.5), TypeError, "expected an integer"),
        (lambda: inverse.fit_whole(Powers((0, 16), (0, 10, 17))), ValueError, "deg D = deg N \\+ 2"),
    ],
)
def test_bad_input(call, error, message):
    with pytest.raises(error, match=message):
        call()


def test_what_is_recommended():
    assert smallest(1e-3).quotient.powers.coefficients == 4
    assert smallest(1e-5).quotient.powers.coefficients == 8
    assert smallest(1e-7).quotient.powers.coefficients == 13
    assert all(Fraction(float(c)) == c for c in smallest(1e-3).quotient.a)
    assert math.isinf(lawson.rough(Powers((0,), (0, 1)), _negative()).error)


def _negative():
    """A target that no quotient with a positive denominator comes near: 1/(1 - y) beyond its pole."""
    y = np.linspace(1.5, 3, 30)
    return lawson.Sample(y, 1 / (1 - y), np.ones_like(y))
