"""JavaScript: an ES module."""

from viscopade.kernels.arithmetic import HOST
from viscopade.kernels.write.language import Language, Number, shortest

LANGUAGE = Language(
    name="javascript",
    ending=".mjs",
    comment="//",
    numbers=(
        Number((HOST,), "number", shortest(HOST), functions="Math.{name}", nan="NaN", power="Math.pow({base}, {p})",
               renamed={"exp2": "exp2"}),
    ),
    begin="export function {name}({arguments}) {{",
    argument="{argument}",
    constant="const {name} = {value};",
    assign="const {name} = {value};",
    result="return {value};",
    unless="if (!({condition})) {{",
    when="if ({condition}) {{",
    end="}}",
    close="}}",
    absent="{argument} === null",
)  # fmt: skip
