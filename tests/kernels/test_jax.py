"""Derivatives of the module for JAX, compared with the exact ones, where JAX is installed."""

import subprocess
import sys
from functools import cache

import numpy as np
import pytest

from viscopade.arrays import double
from viscopade.kernels import requests
from viscopade.kernels.targets.languages import target
from viscopade.scene.runners import find_tool

FUNCTIONS = ("restitution", "rebound", "dissipation")
WORST = {"compact_1em3": 1e-3, "compact_1em5": 2e-5, "compact_1em7": 2e-7}
"""More than the relative errors of the derivatives that were found."""
NAMES = {"float64": [*WORST], "float32": [*WORST][:2]}

PROGRAM = """
import sys
import jax
import jax.numpy as jnp
import numpy as np
jax.config.update("jax_enable_x64", sys.argv[1] == "float64")
import viscopade_jax
given = np.load("given.npz")
speed, beta = given["speed"], given["beta"]
found = {}
for name in sys.argv[2:]:
    f = getattr(viscopade_jax, name)
    found[name] = f(speed, beta)
    along = jax.jit(jax.vmap(jax.grad(f, (0, 1))))(speed, beta)
    for argument, values in zip(("speed", "beta"), along):
        found[f"{name}, {argument}"] = values
        assert values.dtype == sys.argv[1]
    if "1em5" in name:
        forward = jax.jvp(lambda s, b: f(s, b), (speed, beta), (jnp.ones_like(speed), jnp.ones_like(speed)))[1]
        assert (abs(forward - along[0] - along[1]) <= 1e-5 * (abs(along[0]) + abs(along[1]))).all()
        one = jax.vmap(jax.grad(f), (0, None))(speed, 1.25)
        np.testing.assert_allclose(one, jax.vmap(jax.grad(f))(speed, jnp.full_like(speed, 1.25)), rtol=1e-6)
        assert f(speed[:, None], beta[:5]).shape == (len(speed), 5)
        second = jax.grad(jax.grad(f))(2.0, 1.25)
        step = 1e-3 if sys.argv[1] == "float64" else 0.05
        middle = (jax.grad(f)(2.0 + step, 1.25) - jax.grad(f)(2.0 - step, 1.25)) / (2 * step)
        assert abs(second / middle - 1) < (1e-5 if sys.argv[1] == "float64" else 1e-2), (second, middle)
    ends = np.array([(0.0, 1.25), (2.0, 0.0), (0.0, 0.0), (jnp.inf, 1.25), (-1.0, 1.25)], sys.argv[1])
    found[f"{name}, ends"] = jnp.stack(jax.jit(jax.vmap(jax.grad(f, (0, 1))))(*ends.T), 1)
    found[f"{name}, beta alone"] = jax.grad(f, 1)(0.0, 1.25)
np.savez("found.npz", **found)
"""


@cache
def given():
    generator = np.random.default_rng(11)
    v_star, beta = 10 ** generator.uniform(-3, 2.5, 2000), 2 ** generator.uniform(-1, 1, 2000)
    return (v_star**2 / beta) ** 5, beta


@pytest.fixture(scope="module", params=NAMES)
def found(request, tmp_path_factory):
    if find_tool(target("jax").runner) is None:
        pytest.skip("the Python package jax is not installed")
    directory = tmp_path_factory.mktemp("jax")
    (directory / "viscopade_jax.py").write_text(requests.file("viscopade_jax.py"))
    (directory / "program.py").write_text(PROGRAM)
    speed, beta = (values.astype(request.param) for values in given())
    np.savez(directory / "given.npz", speed=speed, beta=beta)
    functions = [f"{function}_{name}" for name in NAMES[request.param] for function in FUNCTIONS]
    command = [sys.executable, "program.py", request.param, *functions]
    subprocess.run(command, cwd=directory, check=True, capture_output=True, text=True)
    return request.param, dict(np.load(directory / "found.npz"))


def exact(kind):
    """The derivatives of eps with respect to ln speed."""
    speed, beta = (values.astype(kind).astype(float) for values in given())
    v_star = np.sqrt(beta) * speed**0.1
    eps = np.asarray(double.epsilon(v_star))
    return speed, beta, eps, eps * np.asarray(double.slope(v_star)) / 10


def test_derivatives(found):
    kind, values = found
    speed, beta, eps, change = exact(kind)
    true = {
        "restitution": (change / speed, 5 * change / beta),
        "rebound": (eps + change, 5 * change * speed / beta),
        "dissipation": (-2 * eps * change / speed, -10 * eps * change / beta),
    }
    for name in NAMES[kind]:
        for function, slopes in true.items():
            for argument, slope in zip(("speed", "beta"), slopes, strict=True):
                error = np.abs(values[f"{function}_{name}, {argument}"] / slope - 1)
                normal = np.abs(slope) >= np.finfo(kind).tiny
                assert error[normal].max() < WORST[name] + (3e-5 if kind == "float32" else 0)
                assert error[normal].max() > WORST[name] / 5


def test_ends(found):
    """At speed 0, beta 0, both 0, an infinite and a negative speed: the limits."""
    kind, values = found
    for name in NAMES[kind]:
        eps, rebound, loss = (values[f"{function}_{name}, ends"] for function in FUNCTIONS)
        limit = -(2.0**0.2) * 1.15345  # d eps/d beta = -C_1 speed^(1/5)
        assert eps[0].tolist() == [-np.inf, 0]
        assert eps[1] == pytest.approx([0, limit], rel=1e-3)
        assert eps[2:4].tolist() == [[0, 0], [0, 0]]
        assert loss[0].tolist() == [np.inf, 0]
        assert loss[1] == pytest.approx([0, -2 * limit], rel=1e-3)
        assert rebound[0].tolist() == [1, 0]
        assert rebound[1] == pytest.approx([1, 2 * limit], rel=1e-3)
        assert rebound[2].tolist() == [1, 0]
        assert 0 < rebound[3][0] < 2e-12
        assert np.isnan([eps[4], rebound[4], loss[4]]).all()
        for function in FUNCTIONS:
            assert values[f"{function}_{name}, beta alone"] == 0


def test_without_double_precision_the_most_accurate_kernel_is_refused(tmp_path):
    if find_tool(target("jax").runner) is None:
        pytest.skip("the Python package jax is not installed")
    (tmp_path / "viscopade_jax.py").write_text(requests.file("viscopade_jax.py"))
    program = "import viscopade_jax; viscopade_jax.restitution_compact_1em7(2.0, 1.3)"
    ran = subprocess.run([sys.executable, "-c", program], cwd=tmp_path, capture_output=True, text=True)
    assert "TypeError: the type is float32: accepted for restitution_compact_1em7 is float64" in ran.stderr
