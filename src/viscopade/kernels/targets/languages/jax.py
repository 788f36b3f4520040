"""JAX: a Python module for jit, vmap and grad, with derivatives by a closed expression; compact kernels."""

from __future__ import annotations

from viscopade.arithmetic.formats import DOUBLE, FLOAT
from viscopade.kernels.targets.language import FunctionText, Number, of_library, package_of_python

TARGET = package_of_python(
    "jax",
    "jax",
    Number.of(DOUBLE, "float64", function="jnp.{}", zero="0", both="&"),
    Number.of(FLOAT, "float32", "_f32", function="jnp.{}", zero="0", both="&"),
    functions=FunctionText(
        "def {function}_{name}{suffix}({given}):\n"
        '    {given} = jnp.asarray({given}, jax.dtypes.canonicalize_dtype("{type}"))\n'
        '    if {given}.dtype != "{type}":\n'
        '        raise TypeError("{function}_{name}{suffix} needs {type}: set jax_enable_x64")',
        "{constant} = {value}",
        "{variable} = {value}",
        "return jnp.where({inside}, {value}, jnp.nan)",
        file="{head}\n\nimport jax\nimport jax.numpy as jnp\n\n\n{functions}\n",
        apart=1,
        power="jnp.power({base}, {p})",
    ),
    assumed=of_library("log and exp") + "; XLA replaces subnormal numbers by 0",
    log="log",
    exp="exp",
    larger="maximum",
)
