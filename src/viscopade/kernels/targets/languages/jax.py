"""JAX: a Python module for jit, vmap and grad, with derivatives by a closed expression; compact kernels."""

from __future__ import annotations

from viscopade.arithmetic.formats import DOUBLE, FLOAT
from viscopade.kernels.targets.language import Number, of_library, package_of_python

TARGET = package_of_python(
    "jax",
    "jax",
    Number.of(DOUBLE, "float64", function="jnp.{}"),
    Number.of(FLOAT, "float32", function="jnp.{}"),
    assumed=of_library("log and exp") + "; XLA replaces subnormal numbers by 0",
    log="log",
    exp="exp",
    derivatives=True,
)
