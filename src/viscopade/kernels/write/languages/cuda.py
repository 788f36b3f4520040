"""CUDA and HIP: one header for the device and the host, in C99 and C++ as well."""

from dataclasses import replace

from viscopade.kernels.arithmetic import DEVICE, HOST_FLOAT
from viscopade.kernels.write.languages.c import LANGUAGE as C

_DOUBLE, _FLOAT = C.numbers
_CALLS = {"log2": "viscopade_log2f({0})", "divide": "viscopade_dividef({0}, {1})"}

LANGUAGE = replace(
    C,
    name="cuda",
    ending=".cuh",
    numbers=(
        _DOUBLE,
        replace(_FLOAT, arithmetics=(HOST_FLOAT, DEVICE), calls=_CALLS),
    ),
    begin="VISCOPADE_FUNCTION {type} viscopade_{name}{suffix}({arguments})\n{{",
    close="}}\nVISCOPADE_CALLED({function}, {kernel}, {type}, viscopade_{name}{suffix})",
    table="",
    list=C.list.removeprefix("static "),
    generic="namespace viscopade_{kernel} {{ struct {function} : viscopade_all<{procedures}> {{}}; }}",
    kernel=C.kernel.replace("{functions}", "{functions}\n\n#ifdef VISCOPADE_RUNTIME\n{generics}\n#endif"),
    procedure="{function}_{type}",
    prelude="c.h cuda.h launch.h",
    others="Of arrays on the device: viscopade_launch<viscopade_KERNEL::FUNCTION>(n, speed, beta, out, stream), with "
    "beta as viscopade_beta(beta), viscopade_beta_by_pair(pair, beta) or viscopade_beta_each(beta); without a host "
    "compiler (NVRTC) viscopade_apply, as docs/reference/languages.md shows.",
    groups=("compact",),
)
