"""Rust: a module; compact kernels."""

from __future__ import annotations

from viscopade.arithmetic.formats import DOUBLE, FLOAT
from viscopade.kernels.targets.language import (
    DRIVER,
    PROGRAM,
    START,
    TOOL,
    FunctionText,
    Number,
    Runner,
    Target,
    of_library,
)

TARGET = Target(
    name="rust",
    suffix=".rs",
    comment="//",
    numbers=(Number.of(DOUBLE, "f64", function="f64::{}"), Number.of(FLOAT, "f32", "_f32", function="f32::{}")),
    runner=Runner(("rustc",), ".rs", (TOOL, "--edition", "2021", "-O", DRIVER, "-o", PROGRAM), START),
    assumed=of_library("log2 and exp2"),
    functions=FunctionText(
        "pub fn {function}_{name}{suffix}({given}: {type}) -> {type} {{",
        "let {constant}: {type} = {value};",
        "let {variable} = {value};",
        "{value}",
        "if !({inside}) {{\n    return {type}::NAN;\n}}",
        "}}",
        power="{type}::powf({base}, {p})",
    ),
    include='#[allow(dead_code)] #[path = "{file}"] mod scene;',
    qualifier="scene::",
    pair="{qualifier}{PAIR}",
    capitals=True,
)
