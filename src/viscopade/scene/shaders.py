"""Compute shaders run through wgpu, if that package is installed and finds a device, which may be a CPU."""

from __future__ import annotations

from collections.abc import Sequence
from importlib import import_module
from importlib.metadata import PackageNotFoundError, version
from typing import Any

import numpy as np
import numpy.typing as npt

from viscopade.arrays.checked import FloatArray
from viscopade.kernels.toolchain import ToolchainError

WORKGROUP = 64


def device() -> str | None:
    """Return the name of the device for shaders; None without one."""
    try:
        info = import_module("wgpu").gpu.request_adapter_sync().info
        return f"wgpu {version('wgpu')} on {info['device']}"
    except (ImportError, PackageNotFoundError, RuntimeError, OSError, KeyError, AttributeError):
        return None


def run_shader(shader: str | bytes, arrays: Sequence[npt.NDArray[Any]], size: int) -> FloatArray:
    """Return the output of a shader.

    Parameters
    ----------
    shader : str or bytes
        In WGSL, or as SPIR-V. `arrays` are at the first bindings, the result at the next one.
    arrays : sequence of ndarray
    size : int
        Of the result, two numbers for each number of an array.

    Raises
    ------
    ToolchainError
        If it is refused.
    """
    compute = import_module("wgpu.utils.compute").compute_with_buffers
    inputs = {i: np.ascontiguousarray(values) for i, values in enumerate(arrays)}
    try:
        out = compute(inputs, {len(arrays): (size, "f")}, shader, n=-(-size // 2 // WORKGROUP))
    except Exception as error:  # the package has many kinds, and does not list them
        lines = [line.strip() for line in str(error).splitlines() if "error" in line.lower()]
        raise ToolchainError(
            f"the generated code fails its check: wgpu: {(lines or [repr(error)])[-1][:300]}"
        ) from None
    return np.frombuffer(out[len(arrays)], dtype=np.float32).astype(np.float64)
