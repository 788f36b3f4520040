"""The derivative of compact kernels, as exported for JAX: its certificate against samples, and that it can fail."""

from fractions import Fraction

import numpy as np
import pytest

from viscopade.arrays import double
from viscopade.kernels import requests
from viscopade.kernels.expressions import Arithmetic, Run
from viscopade.kernels.forms import slope
from viscopade.kernels.forms.formulas import constants

KERNELS = requests.HALF_LINE.in_powers_of_a_root()


def ratio(variant, powers, v_star):
    """Return the formula's (d eps/d v*)/v* over the exact one, in type double."""
    given = constants(powers, variant.a, variant.b) | slope.slope_constants(powers, variant.a, variant.b, variant.form)
    found = Run(slope.slope_program(powers), given | {"y": np.cbrt(v_star)}, Arithmetic(float))["slope"]
    true = double.epsilon(v_star) * double.slope(v_star) / v_star  # double.slope is d ln eps/d ln v*
    return -found / 3 / (true / v_star)


@pytest.mark.parametrize("kernel", KERNELS, ids=lambda kernel: kernel.name)
def test_the_bound_holds_and_is_tight(kernel):
    v_star = np.geomspace(1e-6, 1e6, 60_000)
    for variant in kernel.variants:
        bound = slope.slope_certificate(kernel.powers, variant.a, variant.b, variant.form)
        largest = np.abs(ratio(variant, kernel.powers, v_star) - 1).max()
        reference = max(map(float, bound.record()["slope_errors"]))  # of the exact slopes
        assert 0.97 * (float(bound.bound) - reference) < largest <= float(bound.bound)
        assert bound.high == 2**23


def test_a_wrong_coefficient_has_a_large_bound():
    kernel = KERNELS[0]
    variant = kernel.variants[0]
    right = slope.slope_certificate(kernel.powers, variant.a, variant.b, variant.form)
    wrong = (variant.a[0] * 1.01, *variant.a[1:])
    found = slope.slope_certificate.__wrapped__(kernel.powers, wrong, variant.b, variant.form)
    assert Fraction(found.bound) > 5 * Fraction(right.bound)
