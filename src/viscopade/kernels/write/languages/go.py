"""Go: a package. Of its library, log and exp are within 1 ulp; pow, off by 100 ulp, is one of the prelude."""

from viscopade.kernels.arithmetic import HOST, HOST_FLOAT
from viscopade.kernels.write.language import Language, Number, Runner, shortest

_CALLS = {
    "log2": "math.Log({0})",
    "exp2": "math.Exp({0})",
    "sqrt": "math.Sqrt({0})",
    "cbrt": "math.Cbrt({0})",
    "pow": "pow({0}, {1})",
}
_OF_FLOAT = {
    name: f"float32({call.replace('{0}', 'float64({0})').replace('{1}', 'float64({1})')})"
    for name, call in _CALLS.items()
}

LANGUAGE = Language(
    name="go",
    ending=".go",
    comment="//",
    numbers=(
        Number((HOST,), "float64", shortest(HOST), calls=_CALLS, nan="math.NaN()"),
        Number((HOST_FLOAT,), "float32", shortest(HOST_FLOAT), "_f32", calls=_OF_FLOAT, nan="float32(math.NaN())"),
    ),
    begin="func {Name}{suffix}({arguments}) {type} {{",
    argument="{argument} {type}",
    index="{argument} int",
    list="{name} := [...]{type}{{{values}}}",
    constant="const {name} {type} = {value}",
    assign="{name} := {value}",
    declare="var {name} {type}",
    set="{name} = {value}",
    result="return {value}",
    unless="if !({condition}) {{",
    when="if {condition} {{",
    otherwise="}} else {{",
    end="}}",
    close="}}",
    select="",
    version='const Version = "{version}"\nconst VersionNumber = {number} // 10000 major + 100 minor + patch',
    file='{head}\n\npackage {module}\n\nimport "math"\n\n'
    "var _ = math.Pi // functions that are constants call nothing of it\n\n{version}\n\n{functions}\n",
    helpers="pow.go",
    call="viscopade.{Name}{suffix}({arguments})",
    take='import "MODULE/{module}"',
    use="{result} := {call}",
    run=Runner(
        "go.go",
        ("go",),
        "env GO111MODULE=off {tool} build -o {program} {driver}",
        "{program}",
        folder=True,
        asked="version",
    ),
)
