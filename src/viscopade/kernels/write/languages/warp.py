"""NVIDIA Warp: functions for its kernels, on CPUs and GPUs."""

from viscopade.kernels.arithmetic import HOST, HOST_FLOAT
from viscopade.kernels.write.language import Language, Number, Runner, shortest

LANGUAGE = Language(
    name="warp",
    ending=".py",
    comment="#",
    numbers=tuple(
        Number((a,), kind, shortest(a, kind + "({})"), functions="wp.{name}", nan=kind + "(wp.nan)",
               calls={"log2": "wp.log({0})", "exp2": "wp.exp({0})"})
        for a, kind in ((HOST, "wp.float64"), (HOST_FLOAT, "wp.float32"))
    ),
    begin="@wp.func\ndef {name}({arguments}):",
    argument="{argument}: {type}",
    index="{argument}: wp.int32",
    list="{name} = wp.vector({values}, length={count}, dtype={type})",
    constant="{name} = {value}",
    assign="{name} = {value}",
    result="return {value}",
    unless="if not ({condition}):",
    when="if {condition}:",
    select="{met} if {condition} else {otherwise}",
    both="and",
    either="or",
    continued=" \\",
    stem="viscopade_warp",
    version='VISCOPADE_VERSION = "{version}"\nVISCOPADE_VERSION_NUMBER = {number}  # 10000 major + 100 minor + patch',
    file="{head}\n\nimport warp as wp\n\n{version}\n\n\n{functions}\n",
    apart=2,
    call="viscopade.{name}({arguments})",
    take="import {module}",
    use="{result} = {call}",
    run=Runner("warp.py", (), "", "{tool} {driver}", package="warp-lang"),
)  # fmt: skip
