"""Python: functions of numbers with the module math, which Numba compiles as they are."""

from viscopade.kernels.arithmetic import HOST
from viscopade.kernels.write.language import Language, Number, Runner, shortest

LANGUAGE = Language(
    name="python",
    ending=".py",
    comment="#",
    numbers=(
        Number((HOST,), "float", shortest(HOST), functions="math.{name}", nan="math.nan",
               calls={"log2": "math.log({0})", "exp2": "math.exp({0})"}),
    ),
    begin='def {name}({arguments}) -> float:\n    """Return {meaning}."""',
    argument="{argument}: float",
    constant="{name} = {value}",
    assign="{name} = {value}",
    result="return {value}",
    unless="if not ({condition}):",
    when="if {condition}:",
    select="{met} if {condition} else {otherwise}",
    both="and",
    continued=" \\",
    version='VISCOPADE_VERSION = "{version}"\nVISCOPADE_VERSION_NUMBER = {number}  # 10000 major + 100 minor + patch',
    file="{head}\n\nimport math\n\n{version}\n\n\n{functions}\n",
    apart=2,
    take="import {module}",
    use="{result} = {call}",
    call="viscopade.{name}({arguments})",
    run=Runner("python.py", (), "", "{tool} {driver}"),
    groups=("pade", "minimax", "compact", "inverse"),
)  # fmt: skip
