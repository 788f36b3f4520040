"""Python's two forms: functions of numbers, also compiled by Numba, and functions of arrays of NumPy, JAX, PyTorch."""

import importlib
import inspect
import math
import types
from functools import cache, partial

import numpy as np
import pytest

from viscopade.kernels import catalogue
from viscopade.kernels.write import file
from viscopade.kernels.write.languages import language

KEYS = [entry.key for group in ("pade", "minimax", "compact", "inverse") for entry in catalogue.group(group)]
SPECIAL = (0.0, -0.0, 1.0, -1.0, math.nan, math.inf, -math.inf, 0.5, 5.0, 5.7, 1e-300, 1e-40, 1e200)


@cache
def module(name):
    made = types.ModuleType(name)
    exec(file.file_text([catalogue.kernel(key) for key in KEYS], language(name), "viscopade"), made.__dict__)
    return made


NAMES = [f"{f.name}_{catalogue.kernel(key).name}" for key in KEYS for f in catalogue.kernel(key).functions]


def columns(name):
    """Return arguments of a function: usual ones, and each special one with each."""
    count = len(inspect.signature(getattr(module("python"), name)).parameters)
    usual = np.random.default_rng(3).uniform(0, 1, (count, 200)) * np.array([[2.0], [1.5]])[:count]
    return [
        np.concatenate(pair)
        for pair in zip(usual, np.array(np.meshgrid(*[SPECIAL] * count)).reshape(count, -1), strict=True)
    ]


def scalar(name, given):
    function = getattr(module("python"), name)
    return np.array([function(*row) for row in zip(*(column.tolist() for column in given), strict=True)])


@pytest.fixture(params=[False, True], ids=["x32", "x64"])
def jax(request):
    found = pytest.importorskip("jax")
    before = found.config.jax_enable_x64
    found.config.update("jax_enable_x64", request.param)
    yield found
    found.config.update("jax_enable_x64", before)


AT_0 = {"restitution": (0, 0), "rebound": (1, 0), "dissipation": (0, 0)}
"""The gradients at speed 0 that the file states."""


@pytest.mark.parametrize("name", NAMES)
def test_jax_compiles_maps_and_differentiates(jax, name):
    full = bool(jax.config.jax_enable_x64)
    if not full and not hasattr(module("arrays"), f"{name}_f32"):
        pytest.skip("the kernel is not accurate in type float")
    function = partial(getattr(module("arrays"), name if full else f"{name}_f32"), xp=jax.numpy)
    given = [column[:200] for column in columns(name)]
    expected = scalar(name, given)
    found = np.asarray(jax.jit(function)(*given))
    assert found.dtype == (np.float64 if full else np.float32)
    np.testing.assert_allclose(found, expected, rtol=1e-11 if full else 1e-4, atol=0)
    for place, column in enumerate(given):
        slope = np.asarray(jax.vmap(jax.grad(function, place))(*given))
        assert np.isfinite(slope[~np.isnan(expected)]).all()
        if full:
            h = 1e-6 * column
            ends = [scalar(name, [c + s * h if i == place else c for i, c in enumerate(given)]) for s in (-1, 1)]
            inside = ~np.isnan(ends[0] + ends[1])
            differences = (ends[1] - ends[0])[inside] / (2 * h[inside])
            np.testing.assert_allclose(slope[inside], differences, rtol=1e-3, atol=1e-7)
        of = name.partition("_")[0]
        if of in AT_0:
            assert float(jax.grad(function, place)(0.0, 1.0)) == AT_0[of][place]


@pytest.mark.parametrize("name", NAMES)
def test_pytorch_computes_and_differentiates(name):
    try:
        torch = importlib.import_module("torch")
    except (ImportError, OSError, ValueError) as error:
        pytest.skip(f"there is no PyTorch: {error}")
    given = [column[:200] for column in columns(name)]
    tensors = [torch.tensor(column, requires_grad=True) for column in given]
    found = getattr(module("arrays"), name)(*tensors, xp=torch)
    np.testing.assert_allclose(found.detach().numpy(), scalar(name, given), rtol=1e-11, atol=0)
    found.nansum().backward()
    assert all(np.isfinite(tensor.grad.numpy()).all() for tensor in tensors)
