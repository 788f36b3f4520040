"""JavaScript: an ES module; compact kernels."""

from __future__ import annotations

from viscopade.arithmetic.formats import DOUBLE
from viscopade.kernels.targets.language import DRIVER, TOOL, FunctionText, Number, Runner, Target, of_library

TARGET = Target(
    name="javascript",
    suffix=".mjs",
    comment="//",
    numbers=(Number.of(DOUBLE, "number", zero="0"),),
    runner=Runner(("node",), ".mjs", (), (TOOL, DRIVER)),
    assumed=of_library("Math.log2 and Math.pow(2, x)"),
    functions=FunctionText(
        "export function {function}_{name}({given}) {{",
        "const {constant} = {value};",
        "const {variable} = {value};",
        "return {value};",
        "if ({given} === null || !({inside})) {{\n    return NaN;\n}}",
        "}}",
        mathematics="Math.{name}",
        power="Math.pow({base}, {p})",
    ),
    include='import * as scene from "./{file}";',
    qualifier="scene.",
)
