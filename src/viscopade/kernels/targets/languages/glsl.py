"""GLSL: text for shaders of OpenGL and Vulkan; compact kernels."""

from __future__ import annotations

from viscopade.arithmetic.formats import FLOAT
from viscopade.kernels.forms.table_free import SHADER
from viscopade.kernels.targets.language import DRIVER, PROGRAM, TOOL, FunctionText, Number, Runner, Target, of_shaders

TARGET = Target(
    name="glsl",
    suffix=".glsl",
    comment="//",
    numbers=(Number.of(FLOAT, "float", machine=SHADER),),
    runner=Runner(("glslangValidator", "glslang"), ".comp", (TOOL, "-V", DRIVER, "-o", PROGRAM)),
    functions=FunctionText(
        "#ifndef VISCOPADE_{guard}\n#define VISCOPADE_{guard} {identity}\n\n"
        "float viscopade_{function}_{name}(float {given})\n{{",
        "const float {constant} = {value};",
        "precise float {variable} = {value};",
        "precise float result = {value};\n\nreturn result;",
        "{given} = clamp({given}, {low}, {high});",
        "}}\n\n#elif VISCOPADE_{guard} != {identity}\n"
        "#error viscopade: two headers have different kernels of one name\n#endif",
        "viscopade_{function}_{name}({given})",
        "An argument outside the domain is moved to its nearer end; NaN is not promised to come out of a NaN.",
    ),
    assumed=of_shaders("Vulkan"),
    larger="max",
    place="shader",
)  # fmt: skip
