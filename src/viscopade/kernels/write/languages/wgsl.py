"""WGSL: text for shaders of WebGPU."""

from viscopade.kernels.arithmetic import SHADER
from viscopade.kernels.write.language import Language, Number, Runner, shortest

LANGUAGE = Language(
    name="wgsl",
    ending=".wgsl",
    comment="//",
    numbers=(Number((SHADER,), "f32", shortest(SHADER), nan="bitcast<f32>(nan)", coefficient=SHADER.form.hexadecimal),),
    # A constant expression may not be NaN; one that reads a variable may.
    begin="fn viscopade_{name}({arguments}) -> {type} {{\n    var nan = 0x7fc00000u;",
    argument="{argument}: {type}",
    index="{argument}: u32",
    list="var {name} = array<{type}, {count}>({values});",
    constant="const {name}: {type} = {value};",
    assign="let {name} = {value};",
    result="return {value};",
    unless="if !({condition}) {{",
    when="if {condition} {{",
    end="}}",
    close="}}",
    select="select({otherwise}, {met}, {condition})",
    version="const VISCOPADE_VERSION_NUMBER = {number}; // 10000 major + 100 minor + patch",
    call="viscopade_{name}({arguments})",
    use="let {result} = {call};",
    run=Runner("wgsl.wgsl", ("naga",), "{tool} {driver}"),
)  # fmt: skip
