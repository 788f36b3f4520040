"""Approximants of the inverse, eps -> v*: errors by a second route, the elastic limit, and what is recommended."""

import math
from fractions import Fraction
from itertools import pairwise

import numpy as np
import pytest

from viscopade.approximation import inverse, lawson
from viscopade.approximation.lacunary import Powers
from viscopade.arrays import double
from viscopade.kernels import formulas
from viscopade.kernels.expressions import Reading, Run, evaluate


class Kernel:
    """A best approximant with given powers: its error, and v* on arrays."""

    def __init__(self, powers):
        fit = inverse.fit_inverse(powers)
        self.quotient, self.error, self.points = fit.quotient, fit.error, fit.points

    def of_portions(self, epsilon, loss):
        powers, numbers = self.quotient.powers, (tuple(map(float, part)) for part in (self.quotient.a, self.quotient.b))
        arrays = Reading(float, {"sqrt": np.sqrt, "pow": np.power})
        given = {"epsilon": epsilon, "loss": loss, **formulas.constants(powers, *numbers)}
        with np.errstate(all="ignore"):
            near, far = (
                evaluate(branch.results["v_star"], Run(branch.program, given, arrays), arrays)
                for branch in formulas.inverse_branches(powers)
            )
        return np.where(loss <= epsilon, near, far)


def smallest(accuracy):
    """Return the approximant with the fewest coefficients and the wanted accuracy."""
    return next(found for found in map(Kernel, inverse.BEST) if found.error <= accuracy)


def of_epsilon(kernel, epsilon=None, *, one_minus_epsilon=None):
    """Return a kernel's v*, from 1 - eps where eps is near 1."""
    loss = np.asarray(1 - epsilon if one_minus_epsilon is None else one_minus_epsilon)
    return kernel.of_portions(np.asarray(1 - loss if epsilon is None else epsilon), loss)


@pytest.fixture(params=inverse.BEST, ids=lambda powers: powers.label)
def whole(request):
    return Kernel(request.param)


def test_errors_on_the_whole(whole):
    epsilon = np.geomspace(1e-25, 0.999, 5003)
    error = np.abs(of_epsilon(whole, epsilon) / double.v_star_from(epsilon) - 1).max()
    assert 0.9 * whole.error < error < whole.error * (1 + 1e-9)


def test_more_coefficients_are_better():
    errors = [inverse.fit_inverse(powers).error for powers in inverse.BEST]
    assert all(left > 1.5 * right for left, right in pairwise(errors))


def test_near_the_elastic_limit(whole):
    """Given 1 - eps, no digits are lost; v* -> sqrt((1 - eps)/c)."""
    loss = np.geomspace(1e-300, 1e-3, 100)
    true = double.v_star_from(one_minus_epsilon=loss)
    assert np.abs(of_epsilon(whole, one_minus_epsilon=loss) / true - 1).max() < whole.error * (1 + 1e-9)
    assert of_epsilon(whole, 1.0) == 0
    assert of_epsilon(whole, one_minus_epsilon=0.0) == 0


def test_error_alternates(whole):
    q = np.array([y for y in whole.points if 0 < y < 1e3]) ** 10
    at = {"one_minus_epsilon": q / (1 + q)} if q.max() < 1 else {"epsilon": 1 / (1 + q)}
    signs = np.sign(of_epsilon(whole, **at) / double.v_star_from(**at) - 1)
    assert len(signs) >= 4
    assert (signs[1:] * signs[:-1] == -1).all()


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
