"""Julia: a module of functions for Float64 and Float32; other real numbers become Float64."""

from viscopade.kernels.arithmetic import HOST, HOST_FLOAT
from viscopade.kernels.write.language import Language, Number, Runner, shortest

_FLOAT_DECIMAL = shortest(HOST_FLOAT)


def _float(value: float) -> str:
    """Return a literal of type Float32, whose exponent begins with f: 1.5f0, 1.0f-30."""
    decimal = _FLOAT_DECIMAL(value)
    return decimal.replace("e", "f") if "e" in decimal else f"{decimal}f0"


LANGUAGE = Language(
    name="julia",
    ending=".jl",
    comment="#",
    numbers=tuple(
        Number((a,), kind, literal, calls={"pow": "({0})^{1}"}, nan=f"{kind}(NaN)")
        for a, kind, literal in ((HOST, "Float64", shortest(HOST)), (HOST_FLOAT, "Float32", _float))
    ),
    begin="function {name}({arguments})",
    argument="{argument}::{type}",
    index="{argument}::Real",
    item="{name}[Int({index}) + 1]",
    constant="{name} = {value}",
    assign="{name} = {value}",
    result="return {value}",
    unless="if !({condition})",
    when="if {condition}",
    end="end",
    close="end",
    generic="export {name}\n{name}({names}) = {name}(Float64.(({names},))...)",
    version='const VERSION = "{version}"\nconst VERSION_NUMBER = {number}  # 10000 major + 100 minor + patch',
    file="{head}\n\nmodule {Module}\n\n{version}\n\n{functions}\n\n{generics}\n\nend\n",
    call="Viscopade.{name}({arguments})",
    take='include("{module}.jl")',
    use="{result} = {call}",
    run=Runner("julia.jl", ("julia",), "", "{tool} --startup-file=no {driver}"),
)  # fmt: skip
