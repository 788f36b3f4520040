"""Rust: a module."""

from viscopade.kernels.arithmetic import HOST, HOST_FLOAT
from viscopade.kernels.write.language import Language, Number, Runner, shortest

LANGUAGE = Language(
    name="rust",
    ending=".rs",
    comment="//",
    doc="///",
    numbers=tuple(
        Number((a,), kind, shortest(a), suffix, kind + "::{name}", {"pow": kind + "::powf({0}, {1})"}, kind + "::NAN")
        for a, kind, suffix in ((HOST, "f64", ""), (HOST_FLOAT, "f32", "_f32"))
    ),
    begin="#[allow(dead_code)]\npub fn {name}{suffix}({arguments}) -> {type} {{",
    argument="{argument}: {type}",
    index="{argument}: usize",
    list="let {name}: [{type}; {count}] = [{values}];",
    constant="let {name}: {type} = {value};",
    assign="let {name} = {value};",
    result="return {value};",
    last="{value}",
    unless="if !({condition}) {{",
    when="if {condition} {{",
    end="}}",
    close="}}",
    select="if {condition} {{ {met} }} else {{ {otherwise} }}",
    version='/// The version of viscopade that made this file.\n#[allow(dead_code)]\n'
    'pub const VERSION: &str = "{version}";\n'
    "/// 10000 major + 100 minor + patch of the version.\n#[allow(dead_code)]\n"
    "pub const VERSION_NUMBER: u32 = {number};",
    call="viscopade::{name}{suffix}({arguments})",
    take="mod {module};",
    use="let {result} = {call};",
    others="Without std (crate num-traits, feature libm): "
    'mod viscopade { use num_traits::Float; include!("viscopade.rs"); }',
    run=Runner("rust.rs", ("rustc",), "{tool} --edition 2021 -O {driver} -o {program}", "{program}"),
)  # fmt: skip
