"""NVIDIA Warp: functions for its kernels, on CPUs and GPUs; compact kernels."""

from __future__ import annotations

from viscopade.arithmetic.formats import DOUBLE, FLOAT
from viscopade.kernels.targets.language import (
    DRIVER,
    PYTHON_LINES,
    TOOL,
    Number,
    Runner,
    Target,
    of_library,
    taken_in_python,
)

TARGET = Target(
    name="warp",
    suffix=".py",
    comment="#",
    numbers=(
        Number.of(DOUBLE, "wp.float64", function="wp.{}", literal="wp.float64({})"),
        Number.of(FLOAT, "wp.float32", function="wp.{}", literal="wp.float32({})"),
    ),
    runner=Runner((), ".py", (), (TOOL, "-P", DRIVER), package="warp-lang"),
    templates={
        "table_free": "table_free.warp.py.jinja",
        "scene": "scene.warp.py.jinja",
        "check": "check.warp.py.jinja",
    },
    assumed=of_library("log and exp"),
    log="log",
    exp="exp",
    next_line=PYTHON_LINES,
    stem="viscopade_warp",
    include="import {stem} as scene",
    qualifier="scene.",
    pair="{qualifier}{PAIR}",
    capitals=True,
    is_taken=taken_in_python,
)
