"""C: headers in C99 that are valid C++, too."""

from functools import partial

from viscopade.kernels.arithmetic import HOST, HOST_FLOAT
from viscopade.kernels.write.language import Language, Number, shortest


def _constant(value: float, arithmetic: object) -> str:
    form = arithmetic.form  # type: ignore[attr-defined]
    return f"VISCOPADE_CONSTANT({form.hexadecimal(value)}, {form.decimal(value)})"


LANGUAGE = Language(
    name="c",
    ending=".h",
    comment=" *",
    numbers=tuple(
        Number((a,), a.form.name, shortest(a, "{}" + a.form.suffix), a.form.suffix, "{name}" + a.form.suffix,
               nan=f'nan{a.form.suffix}("")', coefficient=partial(_constant, arithmetic=a))
        for a in (HOST, HOST_FLOAT)
    ),
    begin="VISCOPADE_INLINE {type} viscopade_{name}{suffix}({arguments})\n{{",
    argument="{type} {argument}",
    constant="const {type} {name} = {value};",
    assign="const {type} {name} = {value};",
    condition="const int {name} = {value};",
    result="return {value};",
    unless="if (!({condition})) {{",
    when="if ({condition}) {{",
    end="}}",
    close="}}",
)  # fmt: skip
