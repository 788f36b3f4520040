"""JAX: a Python module for jit, vmap and grad, with derivatives by a closed expression; compact kernels."""

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
    name="jax",
    suffix=".py",
    comment="#",
    numbers=(
        Number.of(DOUBLE, "float64", function="jnp.{}"),
        Number.of(FLOAT, "float32", function="jnp.{}"),
    ),
    runner=Runner((), ".py", (), (TOOL, "-P", DRIVER), package="jax"),
    templates={part: f"{part}.jax.py.jinja" for part in ("table_free", "scene", "check")},
    assumed=of_library("log and exp") + "; XLA replaces subnormal numbers by 0",
    log="log",
    exp="exp",
    next_line=PYTHON_LINES,
    stem="viscopade_jax",
    include="import {stem} as scene",
    qualifier="scene.",
    pair="{qualifier}{PAIR}",
    capitals=True,
    is_taken=taken_in_python,
)
