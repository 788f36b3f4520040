"""GLSL: text for shaders of OpenGL and Vulkan; compact kernels."""

from __future__ import annotations

from viscopade.arithmetic.formats import FLOAT
from viscopade.kernels.forms.table_free import SHADER
from viscopade.kernels.targets.language import DRIVER, PROGRAM, TOOL, Number, Runner, Target, of_shaders

TARGET = Target(
    name="glsl",
    suffix=".glsl",
    comment="//",
    numbers=(Number.of(FLOAT, "float", machine=SHADER),),
    runner=Runner(
        ("glslangValidator", "glslang"), ".comp", (TOOL, "-V", DRIVER, "-o", PROGRAM), shader="compiled"
    ),
    assumed=of_shaders("Vulkan"),
    place="shader",
)  # fmt: skip
