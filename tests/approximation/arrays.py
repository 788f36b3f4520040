"""Values of fits on arrays, in double precision."""

import numpy as np

from viscopade.arithmetic.formats import DOUBLE
from viscopade.kernels import formulas
from viscopade.kernels.expressions import read
from viscopade.kernels.machine import machine_arithmetic


def half_line_values(powers, a, b, v_star):
    """Return eps and 1 - eps of a half-line approximant with coefficients that are doubles, for all v* >= 0."""
    constants, names = formulas.constants(powers, a, b), ("epsilon", "one_minus_epsilon")
    pairs = zip(
        *(
            read(branch, names, {"v_star": cut(v_star, 1), **constants}, machine_arithmetic(DOUBLE)).values()
            for branch, cut in zip(formulas.half_line_branches(powers), (np.minimum, np.maximum), strict=True)
        ),
        strict=True,
    )
    return tuple(np.where(v_star <= 1, small, large) for small, large in pairs)
