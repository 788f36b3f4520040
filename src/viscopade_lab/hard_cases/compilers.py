"""Exported headers through compilers.

Does any compiler, flag, rounding mode or processor make an exported header exceed its proven error?

The test vectors (`exports/vectors_*.json`) have the exact value and the proven error of every exported function: at
special arguments, at borders of tables, and where round-off is worst. Each header is compiled with each installed
compiler, without warnings, and run at all of them. Rounding to nearest has an error of half a unit, the other modes of
up to one, which doubles the bound of rounding to first order. Other processors are emulated.
"""

from __future__ import annotations

import json
import math
import re
import shutil
import subprocess
from collections.abc import Mapping, Sequence
from fractions import Fraction
from functools import lru_cache
from itertools import groupby
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import TYPE_CHECKING, NamedTuple

import numpy as np

from viscopade.arithmetic.balls import ball_of, exact_middle, working
from viscopade.kernels import requests, truth
from viscopade.kernels.machine import TYPES
from viscopade.kernels.write.runners import ToolchainError
from viscopade.plots.sheet import BLACK, BLUE, GREEN, ORANGE, PURPLE
from viscopade.progress import track
from viscopade_lab.hard_cases.case import Finding, Row

if TYPE_CHECKING:
    from matplotlib.figure import Figure

EXPORTS = Path(__file__).parents[3] / "exports"
WARNINGS = ("-Wall", "-Wextra", "-Wpedantic", "-Werror", "-Wno-unknown-pragmas", "-Wno-unused-function")
QUICK = ("vectors_pade.json", "vectors_full.json")
SECONDS = 600
KINDS = {
    "rounding to nearest": (1.0, BLUE),
    "rounding toward zero, upward, downward": (2.0, PURPLE),
    "other processors and C libraries": (1.0, GREEN),
}
"""Kinds of builds: the bound of error / proven error, and the colour in the picture."""


class Build(NamedTuple):
    """A way to compile and run, of one of the `KINDS`."""

    kind: str
    words: tuple[str, ...]
    label: str
    emulator: tuple[str, ...] = ()
    mode: str = ""


def builds(thorough: bool) -> list[Build]:
    """Return the builds that this machine can run: compilers with flags, and processors."""
    nearest, others, processors = KINDS
    off, native = ("-O2", "-ffp-contract=off"), ("-O3", "-march=native", "-ffp-contract=fast")
    found = [Build(nearest, ("tcc", "-std=c99"), "tcc")]
    for name in ("gcc", "clang", "g++", "clang++") if thorough else ("gcc",):
        start = (name, "-std=c++17") if "++" in name else (name, "-std=c99")
        found += [Build(nearest, (*start, *off), name), Build(nearest, (*start, *native), f"{name} FMA")]
    for mode in ("TOWARDZERO", "UPWARD", "DOWNWARD"):
        words = ("gcc", "-std=c99", "-frounding-math", *off)
        found.append(Build(others, words, f"gcc {mode.lower()}", mode=f"FE_{mode}"))
    if thorough:
        found.append(Build(processors, ("musl-gcc", "-std=c99", *off), "musl"))
        for target, emulator, label in (
            ("aarch64-linux-gnu", "aarch64", "aarch64"), ("arm-linux-gnueabihf", "arm", "armhf"),
            ("riscv64-linux-gnu", "riscv64", "riscv64"), ("s390x-linux-gnu", "s390x", "s390x"),
            ("i686-linux-gnu", "i386", "i386 x87"),
        ):  # fmt: skip
            standard = "-std=gnu17" if label in ("s390x", "i386 x87") else "-std=c99"
            static = (f"{target}-gcc", "-O2", standard, "-static")
            found.append(Build(processors, static, label, (f"qemu-{emulator}",)))
    return [one for one in found if all(shutil.which(tool) for tool in (one.words[0], *one.emulator))]


class Vector(NamedTuple):
    """A function of a header with its arguments in C, the exact value, and the proven error."""

    function: str
    form: str
    given: tuple[float, ...]
    exact: float | Fraction
    error: Fraction


def exported(name: str) -> str:
    """Return an exported file from the source tree, or a new one."""
    path = EXPORTS / name
    return path.read_text(encoding="utf-8") if path.exists() else requests.file(name)


@lru_cache(maxsize=16)
def vectors(file: str) -> tuple[Vector, ...]:
    """Return the test vectors of the functions of a header."""
    header = set(re.findall(r"\bviscopade_(\w+)\(", exported(header_of(file))))
    found = []
    for name, form, x, y, exact, nearest, error, *_ in json.loads(exported(file))["vectors"]:
        function = name + ("f" if form == "float" else "")
        if function not in header or exact == "-":
            continue
        given = tuple(float.fromhex(text) for text in (x, y) if text != "-")
        value: float | Fraction = float.fromhex(nearest) if error == "0" else Fraction(exact)
        if error != "0" and name.endswith("_full") and len(exact.partition("e")[0].strip("-0.")) < 19:
            value = _exact(name, given)  # its decimals are too few to measure an error of half a unit in the last place
        found.append(Vector(function, form, given, value, Fraction(error)))
    return tuple(found)


def _exact(name: str, given: Sequence[float]) -> Fraction:
    """Return the exact value of a function of full accuracy, of v* or of speed and beta, to 20 digits."""
    x, *beta = map(Fraction, given)
    found = truth.sharp_portions(x * beta[0] ** 5 if beta else x**10)
    with working(truth.BITS):
        values = {
            "one_minus_epsilon": found.loss,
            "rebound": found.epsilon * ball_of(x),
            "dissipation": found.loss * (1 + found.epsilon),
        }
        kind = next((kind for kind in values if name.startswith(kind)), "")
        return exact_middle(values.get(kind, found.epsilon))


def header_of(file: str) -> str:
    """Return the name of the header of test vectors."""
    return file.replace("vectors_", "viscopade_").replace(".json", ".h")


def program(file: str, mode: str) -> str:
    """Return a program that reads arguments and prints the results of all functions, computed in a rounding mode."""
    lines = ["#include <fenv.h>", "#include <stdio.h>", f'#include "{header_of(file)}"']
    lines += ["int main(void)", "{", "    int i;", "    volatile double x, y, r;", "    double a, b;"]
    before, after = (f"fesetround({mode}); ", " fesetround(FE_TONEAREST);") if mode else ("", "")
    for (function, form, count), rows in groupby(vectors(file), lambda one: (one.function, one.form, len(one.given))):
        arguments = ", ".join(f"({form}){letter}" for letter in "xy"[:count])
        lines += [
            f"    for (i = 0; i < {len(list(rows))}; i++) {{",
            '        if (scanf("%lf%lf", &a, &b) != 2) { return 1; }',
            f"        x = a; y = b; {before}r = viscopade_{function}({arguments});{after}",
            '        printf("%a\\n", r);',
            "    }",
        ]
    return "\n".join([*lines, "    (void)y;", "    return 0;", "}", ""])


def run(build: Build, file: str, header: str) -> float:
    """Compile and run a header, and return the largest error / proven error.

    Raises
    ------
    ToolchainError
        If the compiler rejects the header or warns, or the program fails.
    """
    pairs = "\n".join(" ".join(map(repr, (*one.given, 0.0)[:2])) for one in vectors(file))
    with TemporaryDirectory() as directory:
        source = Path(directory, "driver.cpp" if "++" in build.words[0] else "driver.c")
        source.write_text(program(file, build.mode), encoding="utf-8")
        Path(directory, header_of(file)).write_text(header, encoding="utf-8")
        warnings = () if build.words[0] == "tcc" else WARNINGS
        words = (*build.words, *warnings, source.name, "-o", "program", "-lm")
        for command in (words, (*build.emulator, "./program")):
            done = subprocess.run(command, cwd=directory, input=pairs, capture_output=True, text=True, timeout=SECONDS)
            if done.returncode:
                raise ToolchainError(f"{build.label}: {(done.stderr or done.stdout)[:300]}")
    values = map(float.fromhex, done.stdout.split())
    return max(error_part(vector, value, build) for vector, value in zip(vectors(file), values, strict=True))


def error_part(vector: Vector, value: float, build: Build) -> float:
    """Return error / proven error."""
    if not math.isfinite(vector.exact):
        return 0.0 if value == vector.exact or (math.isnan(value) and math.isnan(vector.exact)) else math.inf
    if not math.isfinite(value):
        return math.inf
    off = abs(Fraction(value) - Fraction(vector.exact))
    if vector.error == 0:  # a neighbour of the number is right in other rounding modes
        unit = float(np.spacing(TYPES[vector.form](abs(float(vector.exact)))))
        return 0.0 if off <= (unit if build.mode else 0) else math.inf
    return float(off / vector.error)


def measure(thorough: bool) -> Finding:
    """Build with every compiler of this machine."""
    files = [name for name in requests.NAMES if name.startswith("vectors_") and header_of(name) in requests.NAMES]
    jobs = [(build, file) for build in builds(thorough) for file in (files if thorough else QUICK)]
    largest: dict[Build, float] = {}
    for i in track(range(len(jobs)), "compilers"):
        build, file = jobs[i]
        largest[build] = max(largest.get(build, 0.0), run(build, file, exported(header_of(file))))
    return judged(largest)


def judged(largest: Mapping[Build, float]) -> Finding:
    """Compare the largest error of every build with the proven error.

    Raises
    ------
    ToolchainError
        If there is no compiler.
    """
    if not largest:
        raise ToolchainError("there is no C compiler: expected gcc, clang or tcc")
    measured = {kind: [e for build, e in largest.items() if build.kind == kind] for kind in KINDS}
    rows = tuple(Row(f"{kind}: error / proven error", max(e), KINDS[kind][0]) for kind, e in measured.items() if e)
    summary = (
        "With rounding to nearest every build meets the proven error. In the other rounding modes nothing is proven; "
        "there the error is at most twice the proven one. No build gives a warning. "
        f"Builds: {', '.join(build.label for build in largest if not build.mode)}."
    )

    def draw(figure: Figure) -> None:
        axes = figure.subplots()
        for kind, (_, color) in KINDS.items():
            chosen = {build.label: e for build, e in largest.items() if build.kind == kind}
            axes.plot(list(chosen.values()), list(chosen), "o", color=color, markersize=5, label=kind)
        axes.axvline(1, color=BLACK, linewidth=0.8, label="bound, to nearest")
        axes.axvline(2, color=ORANGE, linewidth=0.8, label="bound, other modes")
        axes.invert_yaxis()
        axes.set(xlabel="error / proven error", xlim=(0.9, 2.1))
        axes.legend(loc="upper center")

    return Finding(rows, summary, draw)
