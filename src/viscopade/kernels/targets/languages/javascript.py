"""JavaScript: an ES module; compact kernels."""

from __future__ import annotations

from viscopade.arithmetic.formats import DOUBLE
from viscopade.kernels.targets.language import DRIVER, TOOL, Number, Runner, Target, of_library

TARGET = Target(
    name="javascript",
    suffix=".mjs",
    comment="//",
    numbers=(Number.of(DOUBLE, "number"),),
    runner=Runner(("node",), ".mjs", (), (TOOL, DRIVER)),
    assumed=of_library("Math.log2 and Math.pow(2, x)"),
    include='import * as scene from "./{file}";',
    qualifier="scene.",
)
