"""JAX: a Python module for jit, vmap and grad, with derivatives by a closed expression; compact kernels."""

from __future__ import annotations

from viscopade.arithmetic.formats import DOUBLE, FLOAT
from viscopade.kernels.targets.language import FunctionText, Number, of_library, package_of_python

TARGET = package_of_python(
    "jax",
    "jax",
    Number.of(DOUBLE, "float64", function="jnp.{}"),
    Number.of(FLOAT, "float32", "_f32", function="jnp.{}"),
    functions=FunctionText(
        "def epsilon_{name}{suffix}(v_star):\n"
        '    v_star = jnp.asarray(v_star, jax.dtypes.canonicalize_dtype("{type}"))\n'
        '    if v_star.dtype != "{type}":\n'
        '        raise TypeError("epsilon_{name}{suffix} needs {type}: set jax_enable_x64")',
        "{constant} = {value}",
        "{variable} = {value}",
        "return jnp.where((v_star >= {low}) & (v_star <= {high}), {value}, jnp.nan)",
        file="{head}\n\nimport jax\nimport jax.numpy as jnp\n\n\n{functions}\n",
        apart=1,
    ),
    assumed=of_library("log and exp") + "; XLA replaces subnormal numbers by 0",
    log="log",
    exp="exp",
    derivatives=True,
)
