"""WGSL: text for shaders of WebGPU; compact kernels."""

from __future__ import annotations

from dataclasses import replace

from viscopade.arithmetic.formats import FLOAT
from viscopade.kernels.forms.table_free import SHADER
from viscopade.kernels.targets.language import DRIVER, TOOL, Number, Runner, Target, of_shaders

TARGET = Target(
    name="wgsl",
    suffix=".wgsl",
    comment="//",
    numbers=(replace(Number.of(FLOAT, "f32", machine=SHADER), exact=FLOAT.hexadecimal),),
    runner=Runner(("naga",), ".wgsl", (TOOL, DRIVER), shader="text"),
    assumed=of_shaders("WGSL"),
    place="shader",
    element="{array}({index})",
)
