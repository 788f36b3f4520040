"""Python: modules without dependencies; kernels of v*."""

from __future__ import annotations

import sys
from keyword import iskeyword

from viscopade.arithmetic.formats import DOUBLE
from viscopade.kernels.targets import lacunary_kernels, python
from viscopade.kernels.targets.language import DRIVER, TOOL, Number, Runner, Target
from viscopade.kernels.targets.syntax import MATH_MODULE, shortest

OF_V_STAR = frozenset({"polynomial", "half-line"})


def is_taken(name: str) -> bool:
    """Return whether no module can have a name: a keyword's, or one of the standard library's or ours."""
    return iskeyword(name) or name in sys.stdlib_module_names or name == "viscopade"


TARGET = Target(
    name="python",
    suffix=".py",
    comment="#",
    numbers=(Number(DOUBLE, DOUBLE.name, MATH_MODULE, lambda value: shortest(value, DOUBLE)),),
    renderers={"quotient": python.render, "root": lacunary_kernels.render_python},
    runner=Runner((), ".py", (), (TOOL, "-P", DRIVER)),
    kinds={"speed": OF_V_STAR, "v_star": OF_V_STAR},
    include="import {stem} as scene",
    qualifier="scene.",
    pair='"{title}"',
    capitals=True,
    is_taken=is_taken,
)
