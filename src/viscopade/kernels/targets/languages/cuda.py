"""CUDA: a header for device and host, in C99 and C++ as well; compact kernels."""

from __future__ import annotations

from viscopade.arithmetic.formats import DOUBLE, FLOAT, Format
from viscopade.kernels.forms.table_free import DEVICE, LIBRARY, called, plain
from viscopade.kernels.rounding_bounds import ULPS
from viscopade.kernels.targets.language import DRIVER, PROGRAM, START, TOOL, FunctionText, Number, Runner, Target
from viscopade.kernels.targets.syntax import PRELUDE_OF_CUDA, Syntax, constant_of_c, of_c, shortest

_ASSUMED = (
    f"on the host log2, exp2, and those of type float, are within {ULPS} units in the last place of the result, and on "
    "devices of HIP, where the bounds are those of the host; on devices of CUDA those of type double are, and __log2f "
    "within 2.5 or 2^-22 + 2^-25, exp2f and __fdividef within 2.5: the CUDA programming guide counts 2 and 2^-22 from "
    "the correctly rounded result; +, -, *, / are those of IEEE 754"
)


def _number(form: Format) -> Number:
    host, device = LIBRARY[form.name], form == FLOAT
    return Number(
        form,
        form.name,
        Syntax(lambda name: f"viscopade_{name}f", of_c(form).literal) if device else of_c(form),
        lambda value: shortest(value, form) + form.suffix,
        form.suffix,
        (("on the host", host), ("on the device", DEVICE)) if device else (("", host),),
        lambda value: constant_of_c(value, form),
        called if device else plain,
    )


TARGET = Target(
    name="cuda",
    suffix=".cuh",
    comment=" *",
    numbers=(_number(DOUBLE), _number(FLOAT)),
    runner=Runner(
        ("c++", "g++", "clang++"), ".cpp", (TOOL, "-O2", DRIVER, "-o", PROGRAM, "-lm"), START, "CXX"
    ),
    templates={"scene": "scene.h.jinja", "check": "check.c.jinja", "check_on_device": "check.cu.jinja"},
    assumed=_ASSUMED,
    prelude=PRELUDE_OF_CUDA,
    place="device",
    device=Runner(("nvcc",), ".cu", (TOOL, "-c", DRIVER, "-o", PROGRAM)),
    functions=FunctionText(
        "#ifndef VISCOPADE_{guard}\n#define VISCOPADE_{guard} {identity}\n\nVISCOPADE_KERNEL({identity})\n"
        "VISCOPADE_FUNCTION {type} viscopade_{function}_{name}{suffix}({type} {given})\n{{",
        "const {type} {constant} = {value};",
        "const {type} {variable} = {value};",
        "return {value};",
        'if (!({inside})) {{\n    return nan{suffix}("");\n}}',
        "}}\nVISCOPADE_KERNEL_END\n\n#elif VISCOPADE_{guard} != {identity}\n"
        "#error viscopade: two headers have different kernels of one name\n#endif",
        "viscopade_{function}_{name}({given})",
        mathematics="{name}{suffix}",
        file="/*\n{head}\n */\n{prelude}\n\n#ifdef VISCOPADE_INLINE\n\n{functions}\n\n#endif\n",
        power="pow{suffix}({base}, {p})",
    ),
    include='#include "{file}"',
    element="{array}({index})",
)  # fmt: skip
