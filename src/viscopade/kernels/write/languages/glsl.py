"""GLSL: text for shaders of OpenGL, Vulkan and WebGL 2."""

from viscopade.kernels.arithmetic import SHADER
from viscopade.kernels.write.language import Language, Number, Runner, shortest

LANGUAGE = Language(
    name="glsl",
    ending=".glsl",
    comment="//",
    numbers=(Number((SHADER,), "highp float", shortest(SHADER), nan="uintBitsToFloat(0x7fc00000u)"),),
    begin="{type} viscopade_{name}({arguments})\n{{",
    argument="{type} {argument}",
    index="int {argument}",
    list="const float {name}[{count}] = float[{count}]({values});",
    constant="const {type} {name} = {value};",
    assign="VISCOPADE_FLOAT {name} = {value};",
    result="VISCOPADE_FLOAT result = {value};\nreturn result;",
    unless="if (!({condition})) {{",
    when="if ({condition}) {{",
    end="}}",
    close="}}",
    version="#ifndef VISCOPADE_VERSION_NUMBER\n"
    "#define VISCOPADE_VERSION_NUMBER {number} // 10000 major + 100 minor + patch\n"
    "#endif",
    prelude="glsl.glsl",
    file="{head}\n\n{version}\n\n{prelude}\n\n{functions}\n",
    kernel="#ifndef {GUARD}\n#define {GUARD} {identity}\n\n{functions}\n\n#elif {GUARD} != {identity}\n"
    "#error viscopade: two texts have different kernels of one name\n#endif",
    call="viscopade_{name}({arguments})",
    use="float {result} = {call};",
    run=Runner("glsl.comp", ("glslangValidator", "glslang"), "{tool} -V {driver} -o {program}"),
)  # fmt: skip
