"""C: headers in C99 that are valid C++ too; kernels of v* and of the speed."""

from __future__ import annotations

import re

from viscopade.arithmetic.formats import DOUBLE, FLOAT, Format
from viscopade.kernels.targets import c
from viscopade.kernels.targets.language import DRIVER, PROGRAM, START, TOOL, Number, Runner, Target
from viscopade.kernels.targets.syntax import constant_of_c, of_c, shortest

_HEADERS = re.compile(
    "assert|complex|ctype|errno|fenv|float|inttypes|iso646|limits|locale|malloc|math|memory|setjmp|signal|std[a-z]+|"
    "strings?|tgmath|threads|time|uchar|unistd|wchar|wctype",
    re.IGNORECASE,
)


def _number(form: Format) -> Number:
    return Number(
        form,
        form.name,
        of_c(form),
        lambda value: shortest(value, form) + form.suffix,
        form.suffix,
        exact=lambda value: constant_of_c(value, form),
    )


TARGET = Target(
    name="c",
    suffix=".h",
    comment=" *",
    numbers=(_number(DOUBLE), _number(FLOAT)),
    renderers={
        "quotient": c.render,
        "inverse": c.render,
    },
    runner=Runner(("cc",), ".c", (TOOL, "-O2", DRIVER, "-o", PROGRAM, "-lm"), START, "CC"),
    kinds={
        "speed": frozenset({"polynomial", "speed"}),
        "v_star": frozenset({"polynomial", "full"}),
    },
    templates={"check": "check.c.jinja"},
    include='#include "{file}" (C99; C++17 or later, or GNU C++)',
    is_taken=lambda name: _HEADERS.fullmatch(name) is not None,
)
