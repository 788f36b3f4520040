"""Python: modules without dependencies; kernels of v*."""

from __future__ import annotations

from viscopade.arithmetic.formats import DOUBLE
from viscopade.kernels.targets import python
from viscopade.kernels.targets.language import DRIVER, TOOL, Number, Runner, Target, taken_in_python
from viscopade.kernels.targets.syntax import MATH_MODULE, shortest

TARGET = Target(
    name="python",
    suffix=".py",
    comment="#",
    numbers=(Number(DOUBLE, DOUBLE.name, MATH_MODULE, lambda value: shortest(value, DOUBLE)),),
    renderers={"quotient": python.render, "inverse": python.render},
    runner=Runner((), ".py", (), (TOOL, "-P", DRIVER)),
    kinds=dict.fromkeys(("speed", "v_star"), frozenset({"polynomial"})),
    include="import {stem} as scene",
    qualifier="scene.",
    pair='"{title}"',
    capitals=True,
    is_taken=taken_in_python,
)
