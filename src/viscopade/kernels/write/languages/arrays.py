"""Arrays of Python: functions with a namespace xp, such as numpy, jax.numpy, torch or cupy, without branches."""

from viscopade.kernels.arithmetic import HOST, HOST_FLOAT
from viscopade.kernels.write.language import Language, Number, Runner, shortest

_ROOTS = {name: f"_root(xp.{name}, {{0}}, xp)" for name in ("sqrt", "cbrt")}

LANGUAGE = Language(
    name="arrays",
    ending=".py",
    comment="#",
    numbers=tuple(
        Number((a,), kind, shortest(a), suffix, "xp.{name}", {"pow": "_root(lambda x: x**{1}, {0}, xp)", **_ROOTS})
        for a, kind, suffix in ((HOST, "float64", ""), (HOST_FLOAT, "float32", "_f32"))
    ),
    begin='def {name}{suffix}({arguments}, xp=np):\n    """Return {meaning}, for arrays of type {type}."""',
    argument="{argument}",
    list="{name} = xp.asarray(({values},), dtype=xp.{type})",
    constant="{name} = {value}",
    assign="{name} = {value}",
    result="return {value}",
    unless="",
    when="",
    branchless=True,
    select="xp.where({condition}, {met}, {otherwise})",
    both="&",
    continued=" \\",
    version='VISCOPADE_VERSION = "{version}"\nVISCOPADE_VERSION_NUMBER = {number}  # 10000 major + 100 minor + patch',
    file="{head}\n{prelude}\n\n{version}\n\n\n{functions}\n",
    apart=2,
    take="import {module}",
    use="{result} = {call}  # or arrays of NumPy; for others add xp=torch, jax.numpy or cupy",
    prelude="arrays.py.txt",
    helpers="_root.py.txt",
    stem="viscopade_arrays",
    call="viscopade.{name}{suffix}({arguments})",
    run=Runner("arrays.py", (), "", "{tool} {driver}"),
)  # fmt: skip
