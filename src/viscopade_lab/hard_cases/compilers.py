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
    from matplotlib.axes import Axes

EXPORTS = Path(__file__).parents[3] / "exports"
WARNINGS = ("-Wall", "-Wextra", "-Wpedantic", "-Werror", "-Wno-unknown-pragmas", "-Wno-unused-function")
"""Warnings that are errors; pragmas of other compilers, and functions that the driver does not call, are none."""
QUICK = ("vectors_pade.json", "vectors_full.json")
"""Test vectors of the quick run, chosen by hand: of plain quotients, and of the most delicate code."""
TIMEOUT = 600
"""Seconds for a compiler or a program, chosen by hand: for a header of the quick run both take half a second."""
ENOUGH_CHARACTERS = 19
"""Of the decimals of an exact value, point included: 18 digits are off by 5e-18 of it, a tenth of half an ulp."""
KINDS = {
    "rounding to nearest": (1.0, BLUE),
    "rounding toward zero, upward, downward": (2.0, PURPLE),
    "other processors and C libraries": (1.0, GREEN),
}
"""Kinds of builds: the bound of error / proven error, and the colour in the picture.

The proof is for rounding to nearest, on any processor: 1. Other modes round twice as far (head of this file): 2.
"""


class Build(NamedTuple):
    """A way to compile and run, of one of the `KINDS`.

    Attributes
    ----------
    kind : str
    words : tuple of str
        The compiler's command with its flags.
    label : str
        Its name in the picture.
    emulator : tuple of str
        The command that runs programs of another processor.
    mode : str
        The rounding mode, a macro of C's fenv.h; to nearest if empty.
    """

    kind: str
    words: tuple[str, ...]
    label: str
    emulator: tuple[str, ...] = ()
    mode: str = ""


def builds(thorough: bool) -> list[Build]:
    """Return the builds whose tools this machine has: compilers with flags, rounding modes, and processors.

    `thorough` adds three compilers to gcc and tcc, and the emulated processors.
    """
    nearest, other_modes, processors = KINDS
    # Without FMA contraction, as most users compile; and with all that this processor has.
    off, native = ("-O2", "-ffp-contract=off"), ("-O3", "-march=native", "-ffp-contract=fast")
    # tcc has no such flags to choose from: it does not optimise.
    candidates = [Build(nearest, ("tcc", "-std=c99"), "tcc")]
    for name in ("gcc", "clang", "g++", "clang++") if thorough else ("gcc",):
        # The oldest standards for which headers with tables are made: C99 and C++17.
        start = (name, "-std=c++17") if "++" in name else (name, "-std=c99")
        candidates += [Build(nearest, (*start, *off), name), Build(nearest, (*start, *native), f"{name} FMA")]
    for mode in ("TOWARDZERO", "UPWARD", "DOWNWARD"):
        # Without -frounding-math gcc computes constants beforehand, to nearest.
        words = ("gcc", "-std=c99", "-frounding-math", *off)
        candidates.append(Build(other_modes, words, f"gcc {mode.lower()}", mode=f"FE_{mode}"))
    if thorough:
        # Another C library, and five processors by their cross compilers and QEMU.
        candidates.append(Build(processors, ("musl-gcc", "-std=c99", *off), "musl"))
        for target, emulator, label in (
            ("aarch64-linux-gnu", "aarch64", "aarch64"), ("arm-linux-gnueabihf", "arm", "armhf"),
            ("riscv64-linux-gnu", "riscv64", "riscv64"), ("s390x-linux-gnu", "s390x", "s390x"),
            ("i686-linux-gnu", "i386", "i386 x87"),
        ):  # fmt: skip
            # gcc's -std=c99 switches FMA contraction off, and the excess digits of x87 registers; gnu17, the default of
            # gcc, leaves them on. One processor with contraction is a choice.
            standard = "-std=gnu17" if label in ("s390x", "i386 x87") else "-std=c99"
            static = (f"{target}-gcc", "-O2", standard, "-static")
            # Static, because the emulator has no libraries of that processor.
            candidates.append(Build(processors, static, label, (f"qemu-{emulator}",)))
    return [build for build in candidates if all(shutil.which(tool) for tool in (build.words[0], *build.emulator))]


class Vector(NamedTuple):
    """A test vector: a function of a header at one point.

    Attributes
    ----------
    function : str
        Its name in C without the prefix "viscopade_".
    form : str
        The type of arguments and result: "float" or "double".
    arguments : tuple of float
    exact : float or Fraction
        The exact value; a float where the result must be that number, infinity or NaN.
    error : Fraction
        The proven absolute error; 0 where the result must be `exact`.
    """

    function: str
    form: str
    arguments: tuple[float, ...]
    exact: float | Fraction
    error: Fraction


def export_text(name: str) -> str:
    """Return the text of an exported file, by its name: from the source tree, or made anew where there is none."""
    path = EXPORTS / name
    return path.read_text(encoding="utf-8") if path.exists() else requests.file(name)


@lru_cache(maxsize=16)  # each build reads the same files, of which there are eight
def vectors(file: str) -> tuple[Vector, ...]:
    """Return the test vectors in an exported file, named "vectors_….json", of the functions that its header has."""
    header = set(re.findall(r"\bviscopade_(\w+)\(", export_text(header_of(file))))
    points = []
    # A row: function, type, both arguments in hexadecimal, the exact value in decimals, the nearest number of the type,
    # the proven error, and bounds that are not used here. "-" stands for what a function does not have.
    for name, form, x, y, exact, nearest, error, *_ in json.loads(export_text(file))["vectors"]:
        function = name + ("f" if form == "float" else "")
        if function not in header or exact == "-":
            continue
        arguments = tuple(float.fromhex(text) for text in (x, y) if text != "-")
        value: float | Fraction = float.fromhex(nearest) if error == "0" else Fraction(exact)
        # Functions of full accuracy are off by about half an ulp: decimals with fewer than 18 digits (without zeros at
        # the ends) are too few to measure that.
        if error != "0" and name.endswith("_full") and len(exact.partition("e")[0].strip("-0.")) < ENOUGH_CHARACTERS:
            value = sharp_value(name, arguments)
        points.append(Vector(function, form, arguments, value, Fraction(error)))
    return tuple(points)


def sharp_value(name: str, arguments: Sequence[float]) -> Fraction:
    """Return the exact value of a function of full accuracy to 22 digits.

    `name` begins with what the function returns: "epsilon" or "restitution", "one_minus_epsilon", "rebound" = eps times
    speed, or "dissipation" = 1 - eps^2. `arguments` are v*, or speed and beta.
    """
    x, *beta = map(Fraction, arguments)
    # eps and 1 - eps (fields `epsilon` and `loss`) as balls, at w = v*^10 = beta^5 speed.
    portions = truth.sharp_portions(x * beta[0] ** 5 if beta else x**10)
    with working(truth.BITS):
        values = {
            "one_minus_epsilon": portions.loss,
            "rebound": portions.epsilon * ball_of(x),
            # 1 - eps^2 = (1 - eps) (1 + eps), which loses no digits where eps is near 1
            "dissipation": portions.loss * (1 + portions.epsilon),
        }
        quantity = next((quantity for quantity in values if name.startswith(quantity)), "")
        return exact_middle(values.get(quantity, portions.epsilon))


def header_of(file: str) -> str:
    """Return the header's name for a file of test vectors: "viscopade_pade.h" for "vectors_pade.json"."""
    return file.replace("vectors_", "viscopade_").replace(".json", ".h")


def driver(file: str, mode: str) -> str:
    """Return the C code of a program that prints the results of all functions at the test vectors of a file.

    It reads two arguments a line, in the order of the vectors. `mode` is a rounding mode of fenv.h, or empty.
    """
    lines = ["#include <fenv.h>", "#include <stdio.h>", f'#include "{header_of(file)}"']
    lines += ["int main(void)", "{", "    int i;", "    volatile double x, y, r;", "    double a, b;"]
    # Only the function runs in the mode: reading and printing round to nearest. Variables are volatile, so that the
    # compiler cannot move the call out of the mode.
    before, after = (f"fesetround({mode}); ", " fesetround(FE_TONEAREST);") if mode else ("", "")
    # Consecutive vectors of one function share a loop. %a prints all bits.
    for (function, form, count), rows in groupby(vectors(file), lambda v: (v.function, v.form, len(v.arguments))):
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
    """Return the largest error / proven error of a header, compiled and run at the test vectors of a file.

    `build` says how, and `header` is the header's text.

    Raises
    ------
    ToolchainError
        If the compiler rejects the header or warns, or the program fails.
    """
    # Two numbers a line; 0 stands for a second argument that a function does not have.
    pairs = "\n".join(" ".join(map(repr, (*vector.arguments, 0.0)[:2])) for vector in vectors(file))
    with TemporaryDirectory() as directory:
        source = Path(directory, "driver.cpp" if "++" in build.words[0] else "driver.c")
        source.write_text(driver(file, build.mode), encoding="utf-8")
        Path(directory, header_of(file)).write_text(header, encoding="utf-8")
        # tcc is taken as it is; it accepts the headers of the quick run with these flags, too (measured).
        warnings = () if build.words[0] == "tcc" else WARNINGS
        words = (*build.words, *warnings, source.name, "-o", "program", "-lm")
        for command in (words, (*build.emulator, "./program")):
            done = subprocess.run(command, cwd=directory, input=pairs, capture_output=True, text=True, timeout=TIMEOUT)
            if done.returncode:
                # 300 characters of the message, the first few lines.
                raise ToolchainError(f"{build.label}: {(done.stderr or done.stdout)[:300]}")
    values = map(float.fromhex, done.stdout.split())
    return max(error_over_bound(vector, value, build) for vector, value in zip(vectors(file), values, strict=True))


def error_over_bound(vector: Vector, value: float, build: Build) -> float:
    """Return error / proven error of a result `value` at a test vector: 0 or infinity where the error must be 0.

    Of `build` only the rounding mode matters.
    """
    # Where the exact value is infinite or NaN, so must the result be.
    if not math.isfinite(vector.exact):
        return 0.0 if value == vector.exact or (math.isnan(value) and math.isnan(vector.exact)) else math.inf
    if not math.isfinite(value):
        return math.inf
    error = abs(Fraction(value) - Fraction(vector.exact))
    if vector.error == 0:
        # The number itself; in other rounding modes a neighbour is right, too.
        unit = float(np.spacing(TYPES[vector.form](abs(float(vector.exact)))))
        return 0.0 if error <= (unit if build.mode else 0) else math.inf
    return float(error / vector.error)


def measure(thorough: bool) -> Finding:
    """Return the rows, words and picture of this case: all builds that this machine has, or a few.

    `thorough` takes all files of test vectors that have a header, instead of those of `QUICK`.
    """
    files = [name for name in requests.NAMES if name.startswith("vectors_") and header_of(name) in requests.NAMES]
    jobs = [(build, file) for build in builds(thorough) for file in (files if thorough else QUICK)]
    largest: dict[Build, float] = {}
    for i in track(range(len(jobs)), "compilers"):
        build, file = jobs[i]
        largest[build] = max(largest.get(build, 0.0), run(build, file, export_text(header_of(file))))
    return make_finding(largest)


def make_finding(largest: Mapping[Build, float]) -> Finding:
    """Return the rows, words and picture, from the largest error / proven error of each build (`largest`).

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

    def draw(axes: Axes) -> None:
        """Draw a point for each build, a row for each label, with the two bounds as lines."""
        # Sizes of points and lines, in points, are chosen by hand.
        for kind, (_, color) in KINDS.items():
            chosen = {build.label: e for build, e in largest.items() if build.kind == kind}
            if chosen:  # else its name would stand in the legend
                axes.plot(list(chosen.values()), list(chosen), "o", color=color, markersize=5, label=kind)
        axes.axvline(1, color=BLACK, linewidth=0.8, label="bound, to nearest")
        axes.axvline(2, color=ORANGE, linewidth=0.8, label="bound, other modes")
        axes.invert_yaxis()
        # Bounds are nearly reached: errors lie between them, just below 1 and just below 2.
        axes.set(xlabel="error / proven error", xlim=(0.9, 2.1))
        axes.figure.legend(loc="outside lower center")

    # Inches: 0.13 for each row, whose letters are 7 points high (0.1 inches), and 1.4 for the axis and the legend.
    return Finding(rows, summary, draw, 1.4 + 0.13 * len({build.label for build in largest}))
