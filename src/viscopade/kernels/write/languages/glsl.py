"""GLSL: text for shaders of OpenGL, Vulkan and WebGL 2."""

from viscopade.kernels.arithmetic import SHADER
from viscopade.kernels.write.language import Language, Number, shortest

LANGUAGE = Language(
    name="glsl",
    ending=".glsl",
    comment="//",
    numbers=(Number((SHADER,), "highp float", shortest(SHADER), nan="uintBitsToFloat(0x7fc00000u)"),),
    begin="{type} viscopade_{name}({arguments})\n{{",
    argument="{type} {argument}",
    constant="const {type} {name} = {value};",
    assign="VISCOPADE_FLOAT {name} = {value};",
    result="VISCOPADE_FLOAT result = {value};\nreturn result;",
    unless="if (!({condition})) {{",
    when="if ({condition}) {{",
    end="}}",
    close="}}",
)
