"""Julia: a module; compact kernels."""

from __future__ import annotations

from viscopade.arithmetic.formats import DOUBLE, FLOAT, Format
from viscopade.kernels.forms.table_free import LIBRARY
from viscopade.kernels.targets.language import DRIVER, TOOL, FunctionText, Number, Runner, Target, of_library
from viscopade.kernels.targets.syntax import Syntax, shortest


def _number(form: Format, kind: str) -> Number:
    def constant(value: float) -> str:
        written = shortest(value, form)
        if form == DOUBLE:
            return written
        return written.replace("e", "f") if "e" in written else f"{written}f0"

    # Whole numbers take the type of the others.
    syntax = Syntax(literal=lambda text: text[:-2] if text.endswith(".0") else constant(float(text)))
    return Number(form, kind, syntax, constant, machines=(("", LIBRARY[form.name]),))


TARGET = Target(
    name="julia",
    suffix=".jl",
    comment="#",
    numbers=(_number(DOUBLE, "Float64"), _number(FLOAT, "Float32")),
    runner=Runner(("julia",), ".jl", (), (TOOL, "--startup-file=no", DRIVER)),
    assumed=of_library("log2 and exp2"),
    functions=FunctionText(
        "function {function}_{name}({given}::{type})",
        "{constant} = {value}",
        "{variable} = {value}",
        "return {value}",
        "if !({inside})\n    return {type}(NaN)\nend",
        "end",
        file="{head}\n\nmodule Viscopade\n\n{functions}\n\nend\n",
        power="({base})^{p}",
    ),
    include='include("{file}")',
    qualifier="{module}.",
    first_index=1,
    kernel_inside=True,
)
