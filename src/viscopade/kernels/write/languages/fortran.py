"""Fortran: a module of pure elemental functions, of either type by one name."""

from viscopade.kernels.arithmetic import HOST, HOST_FLOAT
from viscopade.kernels.write.language import Language, Number, Runner, shortest

LANGUAGE = Language(
    name="fortran",
    ending=".f90",
    comment="!",
    numbers=tuple(
        Number((a,), kind, shortest(a, "{}_" + kind), suffix,
               calls={"log2": "log({0})", "exp2": "exp({0})", "pow": "({0})**{1}"},
               nan=f"ieee_value(1.0_{kind}, ieee_quiet_nan)")
        for a, kind, suffix in ((HOST, "real64", "_r64"), (HOST_FLOAT, "real32", "_r32"))
    ),
    begin="pure elemental real({type}) function {name}{suffix}({names}) result(value)\n"
    "    {arguments}",
    argument="real({type}), intent(in) :: {argument}",
    index="integer, intent(in) :: {argument}",
    between="\n    ",
    list="real({type}), parameter :: {name}(0:*) = [{values}]",
    item="{name}({index})",
    constant="real({type}), parameter :: {name} = {value}",
    locals="real({type}) :: {names}",
    assign="{name} = {value}",
    result="value = {value}\nreturn",
    last="value = {value}",
    unless="if (.not. ({condition})) then",
    when="if ({condition}) then",
    end="end if",
    close="end function",
    select="merge({met}, {otherwise}, {condition})",
    both=".and.",
    continued=" &",
    generic="interface {name}\n    module procedure {procedures}\nend interface\npublic :: {name}",
    version='character(*), parameter, public :: viscopade_version = "{version}"\n'
    "integer, parameter, public :: viscopade_version_number = {number}  ! 10000 major + 100 minor + patch",
    file="{head}\n\nmodule {module}\nuse, intrinsic :: iso_fortran_env, only: real32, real64\n"
    "use, intrinsic :: ieee_arithmetic, only: ieee_value, ieee_quiet_nan\nimplicit none\nprivate\n\n{version}\n\n"
    "{generics}\n\ncontains\n\n{functions}\n\nend module\n",
    call="{name}({arguments})",
    take="use {module}; use, intrinsic :: iso_fortran_env, only: real64",
    use="{result} = {call}",
    run=Runner("fortran.f90", ("gfortran",), "{tool} -O2 {file} {driver} -o {program}", "{program}", "FC"),
)  # fmt: skip
