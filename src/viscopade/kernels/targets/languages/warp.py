"""NVIDIA Warp: functions for its kernels, on CPUs and GPUs; compact kernels."""

from __future__ import annotations

from viscopade.arithmetic.formats import DOUBLE, FLOAT
from viscopade.kernels.targets.language import FunctionText, Number, of_library, package_of_python

TARGET = package_of_python(
    "warp",
    "warp-lang",
    Number.of(DOUBLE, "wp.float64", function="wp.{}", literal="wp.float64({})", both="and"),
    Number.of(FLOAT, "wp.float32", function="wp.{}", literal="wp.float32({})", both="and"),
    functions=FunctionText(
        "@wp.func\ndef {function}_{name}{suffix}({given}: {type}):",
        "{constant} = {value}",
        "{variable} = {value}",
        "return {value}",
        "if not ({inside}):\n    return {type}(wp.nan)",
        file="{head}\n\nimport warp as wp\n\n\n{functions}\n",
        apart=1,
        power="wp.pow({base}, {p})",
    ),
    assumed=of_library("log and exp"),
    log="log",
    exp="exp",
)
