"""WGSL: text for shaders of WebGPU; compact kernels."""

from __future__ import annotations

from dataclasses import replace

from viscopade.arithmetic.formats import FLOAT
from viscopade.kernels.forms.table_free import SHADER
from viscopade.kernels.targets.language import DRIVER, TOOL, FunctionText, Number, Runner, Target, of_shaders

TARGET = Target(
    name="wgsl",
    suffix=".wgsl",
    comment="//",
    numbers=(replace(Number.of(FLOAT, "f32", machine=SHADER), exact=FLOAT.hexadecimal),),
    runner=Runner(("naga",), ".wgsl", (TOOL, DRIVER)),
    functions=FunctionText(
        "fn viscopade_{function}_{name}(at: f32) -> f32 {{",
        "let {constant}: f32 = {value};",
        "let {variable} = {value};",
        "return {value};",
        "let {given} = clamp(at, {low}, {high});",
        "}}",
        "viscopade_{function}_{name}({given})",
        "An argument outside the domain is moved to its nearer end; NaN is not promised to come out of a NaN.",
    ),
    assumed=of_shaders("WGSL"),
    larger="max",
    place="shader",
    element="{array}({index})",
)
