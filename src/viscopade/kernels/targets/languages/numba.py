"""Numba: a Python module of compiled functions and universal functions of NumPy; compact kernels."""

from __future__ import annotations

from viscopade.arithmetic.formats import DOUBLE, FLOAT
from viscopade.kernels.targets.language import (
    DRIVER,
    PYTHON_LINES,
    TOOL,
    Number,
    Runner,
    Target,
    of_library,
    taken_in_python,
)

TARGET = Target(
    name="numba",
    suffix=".py",
    comment="#",
    numbers=(
        Number.of(DOUBLE, "np.float64", function="np.{}"),
        Number.of(FLOAT, "np.float32", "_f32", function="np.{}", literal="np.float32({})"),
    ),
    runner=Runner((), ".py", (), (TOOL, "-P", DRIVER), package="numba"),
    templates={
        "table_free": "table_free.numba.py.jinja",
        "scene": "scene.numba.py.jinja",
        "check": "check.numba.py.jinja",
    },
    assumed=of_library("np.log2 and np.exp2"),
    next_line=PYTHON_LINES,
    stem="viscopade_numba",
    include="import {stem} as scene",
    qualifier="scene.",
    pair="{qualifier}{PAIR}",
    capitals=True,
    is_taken=taken_in_python,
)
