"""C++ policy: a class with static functions of the speed, as codes of planetary rings take it; compact kernels."""

from __future__ import annotations

from viscopade.arithmetic.formats import DOUBLE, FLOAT
from viscopade.kernels.targets.language import DRIVER, PROGRAM, START, TOOL, Number, Runner, Target, of_library

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
    include='#include "{file}" (C++14 or later)',
    qualifier="{name}_scene::",
)  # fmt: skip
