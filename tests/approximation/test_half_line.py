"""Kernels for every v* >= 0: their errors, the optimum's marks, and what is refused."""

import math
from fractions import Fraction

import numpy as np
import pytest

from viscopade.approximation import half_line, inverse
from viscopade.approximation.lacunary import LacunaryQuotient, Powers
from viscopade.approximation.lawson import Sample, rough
from viscopade.arithmetic.formats import DOUBLE
from viscopade.arrays import double
from viscopade.kernels import formulas
from viscopade.kernels.expressions import read
from viscopade.kernels.machine import machine_arithmetic

RECOMMENDED = [half_line.BEST[1], half_line.BEST[3]]
SPEEDS = np.geomspace(1e-6, 1e9, 20_011)


class Kernel:
    """A best approximant: its error, and its values on arrays."""

    def __init__(self, powers):
        fit = half_line.fit_half_line(powers)
        self.quotient, self.error, self.points = fit.quotient, fit.error, np.array(fit.points) ** 3
        self.numbers = (powers, *(tuple(map(float, part)) for part in (fit.quotient.a, fit.quotient.b)))

    def portions(self, v_star):
        """Return eps and 1 - eps in double precision."""
        powers, names = self.numbers[0], ("epsilon", "one_minus_epsilon")
        constants, by = formulas.constants(*self.numbers), machine_arithmetic(DOUBLE)
        small, large = (
            read(branch, names, {"v_star": cut(v_star, 1), **constants}, by)
            for branch, cut in zip(formulas.half_line_branches(powers), (np.minimum, np.maximum), strict=True)
        )
        return (np.where(v_star <= 1, small[name], large[name]) for name in names)

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
    eps, one_minus_eps = kernel.portions(SPEEDS)
    worst = np.where(loss < 0.5, np.abs(one_minus_eps / loss - 1), np.abs(eps / double.epsilon(SPEEDS) - 1)).max()
    assert 0.999 * kernel.error / (1 + kernel.error) < worst < kernel.error / (1 - kernel.error) * (1 + 1e-6)


def test_errors_are_level_with_alternating_signs(kernel):
    assert len(kernel.points) == kernel.quotient.powers.coefficients + 1
    eps, _ = kernel.portions(kernel.points[1:])
    signs = np.sign(eps - double.epsilon(kernel.points[1:]))
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


def test_portions_add_up_to_one_and_epsilon_falls(kernel):
    v_star = np.geomspace(1e-3, 1e4, 5001)
    eps, loss = kernel.portions(v_star)
    assert np.allclose(eps + loss, 1, rtol=0, atol=1e-15)
    assert (np.diff(eps) < 0).all()
    assert all((part > 0).all() for part in kernel.parts(np.cbrt(v_star)))


@pytest.mark.parametrize(
    ("call", "message"),
    [
        (lambda: half_line.fit_half_line(Powers((0, 4, 9), (0, 4))), "deg N = deg D \\+ 4"),
        (lambda: inverse.fit_inverse(Powers((0, 16), (0, 10, 17))), "deg D = deg N \\+ 2"),
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
