"""Kernels for every v* >= 0: their limits, their errors by a second route, and the optimum's marks."""

import math
from fractions import Fraction

import numpy as np
import pytest
from flint import arb

from tests.approximation.arrays import half_line_values
from viscopade.approximation import half_line
from viscopade.approximation.lacunary import LacunaryQuotient, Powers
from viscopade.approximation.lawson import Sample, rough
from viscopade.arithmetic.balls import working
from viscopade.arrays import double
from viscopade.collision import exact

RECOMMENDED = [half_line.BEST[1], half_line.BEST[3]]
SPEEDS = np.geomspace(1e-6, 1e9, 20_011)


class Kernel:
    """A best approximant: its error, and its values on arrays."""

    def __init__(self, powers):
        fit = half_line.fit_half_line(powers)
        self.quotient, self.error, self.points = fit.quotient, fit.error, np.array(fit.points) ** 3
        self.numbers = (powers, *(tuple(map(float, part)) for part in (fit.quotient.a, fit.quotient.b)))

    def epsilon(self, v_star):
        return half_line_values(*self.numbers, np.asarray(v_star, dtype=float))[0]

    def one_minus_epsilon(self, v_star):
        return half_line_values(*self.numbers, np.asarray(v_star, dtype=float))[1]

    def parts(self, y):
        """N and D of balls or of arrays."""
        powers, a, b = self.numbers
        return (sum((c * y**k for k, c in zip(*part, strict=True)), 0 * y)
                for part in ((powers.top, a), (powers.bottom, b)))  # fmt: skip


@pytest.fixture(params=RECOMMENDED, ids=lambda powers: powers.label)
def kernel(request):
    return Kernel(request.param)


def test_accuracies_and_sizes_that_are_claimed():
    errors = {powers.coefficients: half_line.fit_half_line(powers).error for powers in half_line.BEST}
    sizes = {
        accuracy: min(size for size, error in errors.items() if error <= accuracy) for accuracy in (1e-3, 1e-5, 1e-7)
    }
    assert sizes == {1e-3: 5, 1e-5: 8, 1e-7: 12}


def test_error_is_the_levelled_one_to_first_order(kernel):
    """A relative error of N/D that is an error E to first order is one between E/(1 + E) and E/(1 - E)."""
    loss = double.one_minus_epsilon(SPEEDS)
    of_epsilon = np.abs(kernel.epsilon(SPEEDS) / double.epsilon(SPEEDS) - 1)
    of_loss = np.abs(kernel.one_minus_epsilon(SPEEDS) / loss - 1)
    worst = np.where(loss < 0.5, of_loss, of_epsilon).max()
    assert 0.999 * kernel.error / (1 + kernel.error) < worst < kernel.error / (1 - kernel.error) * (1 + 1e-6)


def test_formula_against_proven_values(kernel):
    """The exact formula, in ball arithmetic, at the points where the error is largest."""
    for v_star in kernel.points[1:-1]:
        with working(200):
            y = arb(v_star) ** (arb(1) / 3)
            top, bottom = kernel.parts(y)
            true = exact.collision(v_star, 25).epsilon
            error = bottom / (bottom + y**6 * top) / true - 1
            if true > 0.5:
                error = error * true / (1 - true)
            assert abs(abs(float(error)) / kernel.error - 1) < 2e-3  # to first order in the error


def test_errors_are_level_with_alternating_signs(kernel):
    assert len(kernel.points) == kernel.quotient.powers.coefficients + 1
    signs = np.sign(kernel.epsilon(kernel.points[1:]) - double.epsilon(kernel.points[1:]))
    assert (signs[1:] * signs[:-1] == -1).all()


def test_every_neighbouring_choice_of_powers_is_worse():
    """The search's result is a local optimum: no exponent can be moved by one."""
    powers = half_line.BEST[1]
    sample, (_, a, b), (_, c, d) = half_line.half_line_sample(), powers.top, powers.bottom
    others = [Powers((0, a + i, b), (0, c + j, d)) for i, j in ((-1, 0), (1, 0), (0, -1), (0, 1))]
    others += [Powers((0, a, b + i), (0, c, d + i)) for i in (-1, 1)]
    error = rough(powers, sample).error
    assert error < 2.2e-4
    assert min(rough(other, sample).error for other in others) > 1.1 * error


def test_limits(kernel):
    with working(100):
        c = -float(exact.collision("1e-20", 30).one_minus_epsilon) / 1e-40
    assert kernel.one_minus_epsilon(1e-20) / 1e-40 == pytest.approx(-c, rel=1e-3)
    limit = kernel.epsilon(1e40) * 1e40 ** (10 / 3)
    assert abs(limit / 1.5 ** (2 / 3) - 1) <= kernel.error / (1 - kernel.error)
    assert kernel.epsilon(0) == 1
    assert kernel.one_minus_epsilon(0) == 0
    assert kernel.epsilon(math.inf) == 0
    assert kernel.one_minus_epsilon(math.inf) == 1


def test_no_overflow(kernel):
    """Where powers of y would overflow, the limit still comes out."""
    assert kernel.epsilon(1e80) / (1.5 ** (2 / 3) * 1e80 ** (-10 / 3)) == pytest.approx(1, abs=1e-3)
    assert np.isfinite(kernel.epsilon(np.geomspace(1e-300, 1e300, 601))).all()


def test_portions_add_up_to_one_and_epsilon_falls(kernel):
    v_star = np.geomspace(1e-3, 1e4, 5001)
    assert np.allclose(kernel.epsilon(v_star) + kernel.one_minus_epsilon(v_star), 1, rtol=0, atol=1e-15)
    assert (np.diff(kernel.epsilon(v_star)) < 0).all()
    assert all((part > 0).all() for part in kernel.parts(np.cbrt(v_star)))


@pytest.mark.parametrize(
    ("call", "message"),
    [
        (lambda: half_line.fit_half_line(Powers((0, 4, 9), (0, 4))), "deg N = deg D \\+ 4"),
        (lambda: Powers((0, 4, 4), (0, 4)), "ascending exponents that begin with 0"),
        (lambda: Powers((1, 4), (0, 4)), "ascending exponents that begin with 0"),
        (
            lambda: LacunaryQuotient(Powers((0, 4), (0,)), (Fraction(1),), (Fraction(1),)),
            "cannot have",
        ),
        (lambda: LacunaryQuotient(Powers((0,), (0,)), (Fraction(1),), (Fraction(2),)), "expected 1"),
    ],
)
def test_bad_input(call, message):
    with pytest.raises(ValueError, match=message):
        call()


# --- rough fits -------------------------------------------------------------------------------------------------------


def test_rough_fits_find_what_is_there():
    y = np.geomspace(0.01, 100, 60)
    sample = Sample(y, (2 + 3 * y**5) / (1 + 0.5 * y**2), np.ones_like(y))
    found = rough(Powers((0, 5), (0, 2)), sample)
    np.testing.assert_allclose(found.coefficients, [2, 3, 0.5], rtol=1e-9)
    assert found.error < 1e-12
    assert rough(Powers((0, 4), (0, 1)), sample).error > 1e-3


def test_rough_fits_come_near_the_best():
    """Chebyshev: the best line for y^2 on [-1, 1] + 2 is known; here e^y by a constant, error tanh(1/2)."""
    y = np.linspace(1e-9, 1, 200)
    found = rough(Powers((0,), (0,)), Sample(y, np.exp(y), np.ones_like(y)), steps=400)
    assert found.error == pytest.approx(math.tanh(0.5), rel=1e-2)
