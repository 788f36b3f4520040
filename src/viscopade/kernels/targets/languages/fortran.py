"""Fortran: a module of pure elemental functions; compact kernels."""

from __future__ import annotations

from viscopade.arithmetic.formats import DOUBLE, FLOAT
from viscopade.kernels.targets.language import DRIVER, FILE, PROGRAM, START, TOOL, Number, Runner, Target, of_library

TARGET = Target(
    name="fortran",
    suffix=".f90",
    comment="!",
    numbers=(
        Number.of(DOUBLE, "real64", "_r64", literal="{}_real64"),
        Number.of(FLOAT, "real32", "_r32", literal="{}_real32"),
    ),
    runner=Runner(("gfortran",), ".f90", (TOOL, "-O2", FILE, DRIVER, "-o", PROGRAM), START, "FC"),
    assumed=of_library("exp and log"),
    log="log",
    exp="exp",
    next_line=" &\n" + " " * 12,
    include="use {name}_scene",
    element="{array}({index})",
    first_index=1,
    longest=63,
)
