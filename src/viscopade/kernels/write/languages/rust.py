"""Rust."""

from viscopade.kernels.arithmetic import HOST, HOST_FLOAT
from viscopade.kernels.write.language import Language, Number, shortest

LANGUAGE = Language(
    name="rust",
    ending=".rs",
    comment="//",
    numbers=(
        Number((HOST,), "f64", shortest(HOST), functions="f64::{name}", nan="f64::NAN", power="f64::powf({base}, {p})"),
        Number((HOST_FLOAT,), "f32", shortest(HOST_FLOAT), "_f32", "f32::{name}", nan="f32::NAN",
               power="f32::powf({base}, {p})"),
    ),
    begin="pub fn {name}{suffix}({arguments}) -> {type} {{",
    argument="{argument}: {type}",
    constant="let {name}: {type} = {value};",
    assign="let {name} = {value};",
    result="return {value};",
    unless="if !({condition}) {{",
    when="if {condition} {{",
    end="}}",
    close="}}",
    select="if {condition} {{ {met} }} else {{ {otherwise} }}",
)  # fmt: skip
