"""The derivatives of compact kernels, as exported for JAX, against those of eps: the largest errors of a page."""

import re
from pathlib import Path

import numpy as np
import pytest

from viscopade.arrays import double
from viscopade.kernels import requests
from viscopade.kernels.expressions import Reading, Run
from viscopade.kernels.formulas import constants
from viscopade.kernels.targets import slope

PAGE = (Path(__file__).parents[2] / "docs" / "reference" / "languages.md").read_text()
STATED = re.search(r"off by at most (\S+), (\S+) and (\S+) for the\s+three kernels", PAGE).groups()
KERNELS = requests.WITHOUT_TABLES.half_line_kernels()


@pytest.mark.parametrize(("kernel", "stated"), [*zip(KERNELS, map(float, STATED), strict=True)])
def test_derivatives_of_the_formula(kernel, stated):
    v_star = np.geomspace(1e-6, 1e6, 60_000)
    variant = kernel.variants[0]
    given = constants(kernel.powers, variant.a, variant.b)
    given |= slope.slope_constants(kernel.powers, variant.a, variant.b, variant.form)
    found = Run(slope.slope_program(kernel.powers), given | {"y": np.cbrt(v_star)}, Reading(float))["slope"]
    true = double.epsilon(v_star) * double.slope(v_star) / v_star**2  # double.slope is d ln eps/d ln v*
    assert 0.9 * stated < np.abs(-found / 3 / true - 1).max() <= stated
