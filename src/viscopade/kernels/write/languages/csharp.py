"""C#: a static class; its library has Log and Exp in type double."""

from viscopade.kernels.arithmetic import HOST, HOST_FLOAT
from viscopade.kernels.write.language import Language, Number, Runner, shortest

_CALLS = {
    "log2": "System.Math.Log({0})",
    "exp2": "System.Math.Exp({0})",
    "sqrt": "System.Math.Sqrt({0})",
    "pow": "System.Math.Pow({0}, {1})",
}

LANGUAGE = Language(
    name="csharp",
    ending=".cs",
    comment="//",
    numbers=(
        Number((HOST,), "double", shortest(HOST), calls=_CALLS, nan="double.NaN"),
        Number((HOST_FLOAT,), "float", shortest(HOST_FLOAT, "{}f"), "_f32", nan="float.NaN",
               calls={name: f"(float){call}" for name, call in _CALLS.items()}),
    ),
    begin="public static {type} {Name}{suffix}({arguments})\n{{",
    argument="{type} {argument}",
    index="int {argument}",
    list="{type}[] {name} = {{ {values} }};",
    constant="const {type} {name} = {value};",
    locals="{type} {names};",  # a name within a block may not be one of the function's end
    assign="{name} = {value};",
    result="return {value};",
    unless="if (!({condition})) {{",
    when="if ({condition}) {{",
    end="}}",
    close="}}",
    version='public const string Version = "{version}";\n'
    "public const int VersionNumber = {number}; // 10000 major + 100 minor + patch",
    file="{head}\n\npublic static class {Module}\n{{\n\n{version}\n\n{functions}\n\n}}\n",
    call="Viscopade.{Name}{suffix}({arguments})",
    use="{type} {result} = {call};",
    run=Runner("csharp.cs", ("mcs",), "{tool} {driver} {file}", "mono driver.exe"),
)  # fmt: skip
