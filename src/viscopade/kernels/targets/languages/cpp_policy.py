"""C++ policy: a class with static functions of the speed, as codes of planetary rings take it; compact kernels."""

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
    name="cpp-policy",
    suffix=".hpp",
    comment="//",
    numbers=(
        Number.of(DOUBLE, "double", function="std::{}"),
        Number.of(FLOAT, "float", function="std::{}", literal="{}f"),
    ),
    runner=Runner(
        ("c++", "g++", "clang++"), ".cpp", (TOOL, "-std=c++14", "-O2", DRIVER, "-o", PROGRAM), START, "CXX"
    ),
    templates={"check": "check.c.jinja"},
    assumed=of_library("std::log2 and std::exp2"),
    stem="viscopade_policy",
    functions=FunctionText(
        "#ifndef VISCOPADE_{guard}_POLICY\n#define VISCOPADE_{guard}_POLICY\n\n"
        "inline {type} {function}_{name}({type} {given})\n{{",
        "const {type} {constant} = {value};",
        "const {type} {variable} = {value};",
        "return {value};",
        "if (!({inside})) {{\n    return std::numeric_limits<{type}>::quiet_NaN();\n}}",
        "}}\n\n#endif",
        "viscopade::{function}_{name}({given})",
        power="std::pow({base}, {p})",
        file="{head}\n\n#include <cmath>\n#include <limits>\n\nnamespace viscopade {{\n\n{functions}\n\n"
        "}} // namespace viscopade\n",
    ),
    include='#include "{file}" (C++14 or later)',
    qualifier="{name}_scene::",
)  # fmt: skip
