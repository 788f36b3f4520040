"""JavaScript: an ES module."""

from viscopade.kernels.arithmetic import HOST
from viscopade.kernels.write.language import Language, Number, Runner, shortest

LANGUAGE = Language(
    name="javascript",
    ending=".mjs",
    comment="//",
    numbers=(
        Number((HOST,), "number", shortest(HOST), functions="Math.{name}", calls={"exp2": "Math.pow(2.0, {0})"},
               nan="NaN"),
    ),
    begin="export function {name}({arguments}) {{",
    argument="{argument}",
    list="const {name} = [{values}];",
    constant="const {name} = {value};",
    assign="const {name} = {value};",
    result="return {value};",
    unless="if (!({condition})) {{",
    when="if ({condition}) {{",
    end="}}",
    close="}}",
    absent="typeof {argument} !== \"number\"",
    version='export const VERSION = "{version}";\n'
    "export const VERSION_NUMBER = {number}; // 10000 major + 100 minor + patch",
    call="viscopade.{name}({arguments})",
    take='import * as {module} from "./{module}.mjs";',
    use="const {result} = {call};",
    run=Runner("javascript.mjs", ("node",), "", "{tool} {driver}"),
)  # fmt: skip
