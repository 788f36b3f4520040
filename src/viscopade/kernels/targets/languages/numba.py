"""Numba: a Python module of compiled functions and universal functions of NumPy; compact kernels."""

from __future__ import annotations

from viscopade.arithmetic.formats import DOUBLE, FLOAT
from viscopade.kernels.targets.language import FunctionText, Number, of_library, package_of_python

TARGET = package_of_python(
    "numba",
    "numba",
    Number.of(DOUBLE, "np.float64", function="np.{}", both="and"),
    Number.of(FLOAT, "np.float32", "_f32", function="np.{}", literal="np.float32({})", both="and"),
    functions=FunctionText(
        '@njit(error_model="numpy")\ndef {function}_{name}{suffix}({given}):',
        "{constant} = {value}",
        "{variable} = {value}",
        "return {value}",
        "if not ({inside}):\n    return {type}(np.nan)",
        file="{head}\n\nimport numpy as np\nfrom numba import njit\n\n\n{functions}\n",
        apart=1,
        power="np.power({base}, {p})",
    ),
    assumed=of_library("np.log2 and np.exp2"),
)
