"""Fortran: a module of pure elemental functions; compact kernels."""

from __future__ import annotations

from viscopade.arithmetic.formats import DOUBLE, FLOAT
from viscopade.kernels.targets.language import (
    DRIVER,
    FILE,
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
    name="fortran",
    suffix=".f90",
    comment="!",
    numbers=(
        Number.of(DOUBLE, "real64", "_r64", literal="{}_real64", both=".and."),
        Number.of(FLOAT, "real32", "_r32", literal="{}_real32", both=".and."),
    ),
    runner=Runner(("gfortran",), ".f90", (TOOL, "-O2", FILE, DRIVER, "-o", PROGRAM), START, "FC"),
    assumed=of_library("exp and log"),
    log="log",
    exp="exp",
    next_line=" &\n" + " " * 12,
    functions=FunctionText(
        "pure elemental real({type}) function {function}_{name}{suffix}({given}) result(value)\n"
        "    real({type}), intent(in) :: {given}",
        "real({type}), parameter :: {constant} = {value}",
        "{variable} = {value}",
        "value = {value}",
        "real({type}) :: {locals}\n\n"
        "if (.not. ({inside})) then\n"
        "    value = ieee_value({given}, ieee_quiet_nan)\n    return\nend if",
        "end function",
        file="{head}\n\nmodule {module}\n    use, intrinsic :: iso_fortran_env, only: real32, real64\n"
        "    use, intrinsic :: ieee_arithmetic, only: ieee_value, ieee_quiet_nan\n    implicit none\n\ncontains\n\n"
        "{functions}\n\nend module\n",
        power="({base})**{p}",
    ),
    include="use {name}_scene",
    element="{array}({index})",
    first_index=1,
    longest=63,
)
