"""Fortran."""

from viscopade.kernels.arithmetic import HOST, HOST_FLOAT
from viscopade.kernels.write.language import Language, Number, shortest

_NAMES = {"log2": "log", "exp2": "exp"}
_NAN = "ieee_value(1.0_{}, ieee_quiet_nan)"

LANGUAGE = Language(
    name="fortran",
    ending=".f90",
    comment="!",
    numbers=(
        Number((HOST,), "real64", shortest(HOST, "{}_real64"), "_r64", renamed=_NAMES, nan=_NAN.format("real64"),
               power="({base})**{p}"),
        Number((HOST_FLOAT,), "real32", shortest(HOST_FLOAT, "{}_real32"), "_r32", renamed=_NAMES,
               nan=_NAN.format("real32"), power="({base})**{p}"),
    ),
    begin="pure elemental real({type}) function {name}{suffix}({names}) result(value)",
    argument="",
    constant="real({type}), parameter :: {name} = {value}",
    locals="real({type}) :: {names}",
    assign="{name} = {value}",
    set="{name} = {value}",
    result="value = {value}\nreturn",
    unless="if (.not. ({condition})) then",
    when="if ({condition}) then",
    end="end if",
    otherwise="else",
    close="end function",
    select="",
    both=".and.",
    continued=" &",
)  # fmt: skip
