"""Largest errors of the shaders' kernels on a GPU.

Every float with 2^-126 <= w <= 2^120 is a speed, with beta = 1. The program prints the largest
|result - exact| / exact, for all of them and for 1e-3 <= v* <= 10; `viscopade.restitution` is the exact value.
GLSL needs the package moderngl, WGSL the package wgpu; tested with moderngl 5.13.0 and wgpu 0.32.0.
"""

from __future__ import annotations

import argparse
from collections.abc import Callable
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from viscopade import restitution

FIRST, LAST = 0x00800000, 0x7B800000  # the bits of 2^-126 and 2^120
CHUNK = 1 << 23
KERNELS = ("restitution_compact_1em3", "restitution_compact_1em5", "rebound_compact_1em5")

Floats = NDArray[np.float32]

_GLSL = """#version 430
{text}
layout(local_size_x = 256) in;
layout(std430, binding = 0) buffer Speeds {{ float speed[]; }};
layout(std430, binding = 1) buffer Results {{ float result[]; }};
void main() {{ result[gl_GlobalInvocationID.x] = viscopade_{kernel}(speed[gl_GlobalInvocationID.x], 1.0); }}
"""
_WGSL = """{text}
@group(0) @binding(0) var<storage, read> speed: array<f32>;
@group(0) @binding(1) var<storage, read_write> result: array<f32>;
@compute @workgroup_size(256)
fn main(@builtin(global_invocation_id) id: vec3<u32>) {{ result[id.x] = viscopade_{kernel}(speed[id.x], 1.0); }}
"""


def glsl(kernel: str) -> Callable[[Floats], Floats]:
    """Return a function that evaluates a kernel on the GPU, for `CHUNK` speeds, as an OpenGL compute shader."""
    import moderngl

    context = moderngl.create_context(standalone=True, backend="egl", require=430)
    shader = context.compute_shader(_GLSL.format(text=Path("exports/viscopade.glsl").read_text(), kernel=kernel))
    buffers = [context.buffer(reserve=4 * CHUNK) for _ in range(2)]
    for place, buffer in enumerate(buffers):
        buffer.bind_to_storage_buffer(place)

    def evaluate(speed: Floats) -> Floats:
        buffers[0].write(speed)
        shader.run(group_x=CHUNK // 256)
        return np.frombuffer(buffers[1].read(), np.float32)

    return evaluate


def wgsl(kernel: str) -> Callable[[Floats], Floats]:
    """Return a function that evaluates a kernel on the GPU, for `CHUNK` speeds, as a WebGPU compute shader."""
    import wgpu

    device = wgpu.gpu.request_adapter_sync(power_preference="high-performance").request_device_sync()
    module = device.create_shader_module(
        code=_WGSL.format(text=Path("exports/viscopade.wgsl").read_text(), kernel=kernel)
    )
    pipeline = device.create_compute_pipeline(layout="auto", compute={"module": module, "entry_point": "main"})
    usage = wgpu.BufferUsage.STORAGE | wgpu.BufferUsage.COPY_SRC | wgpu.BufferUsage.COPY_DST
    buffers = [device.create_buffer(size=4 * CHUNK, usage=usage) for _ in range(2)]
    entries = [{"binding": place, "resource": {"buffer": buffer}} for place, buffer in enumerate(buffers)]
    group = device.create_bind_group(layout=pipeline.get_bind_group_layout(0), entries=entries)

    def evaluate(speed: Floats) -> Floats:
        device.queue.write_buffer(buffers[0], 0, speed)
        commands = device.create_command_encoder()
        work = commands.begin_compute_pass()
        work.set_pipeline(pipeline)
        work.set_bind_group(0, group)
        work.dispatch_workgroups(CHUNK // 256)
        work.end()
        device.queue.submit([commands.finish()])
        return np.frombuffer(device.queue.read_buffer(buffers[1]), np.float32)

    return evaluate


def largest_errors(kernel: str, evaluate: Callable[[Floats], Floats], every: int) -> tuple[float, float]:
    """Return the largest relative errors of a kernel, for all speeds and for 1e-3 <= v* <= 10."""
    largest, middle = 0.0, 0.0
    for first in range(FIRST, LAST, CHUNK * every):
        bits = np.minimum(first + every * np.arange(CHUNK, dtype=np.uint64), LAST).astype(np.uint32)
        speed = bits.view(np.float32)
        w = speed.astype(np.float64)
        exact = restitution(w, 1.0) * (w if kernel.startswith("rebound") else 1.0)
        error = np.abs(evaluate(speed) / exact - 1.0)
        largest = max(largest, float(error.max()))
        middle = max(middle, float(error[(w >= 1e-30) & (w <= 1e10)].max(initial=0.0)))
    return largest, middle


LANGUAGES = {"glsl": glsl, "wgsl": wgsl}

if __name__ == "__main__":
    parser = argparse.ArgumentParser(prog="python -m viscopade_lab.gpu.shaders", description=__doc__)
    parser.add_argument("language", choices=LANGUAGES)
    parser.add_argument("--every", type=int, default=1, help="take every EVERYth float only")
    options = parser.parse_args()
    for name in KERNELS:
        largest, middle = largest_errors(name, LANGUAGES[options.language](name), options.every)
        print(f"{options.language}  {name:26}  {largest:.3e}  ({middle:.3e} for 1e-3 <= v* <= 10)")
