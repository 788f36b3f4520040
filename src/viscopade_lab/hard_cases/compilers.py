"""Exported headers through compilers.

Does a compiler, a flag, a rounding mode or a processor make an error of an exported header exceed its proven bound?

The test vectors (`exports/vectors_*.json`) have the exact value and the proven error of every exported function, at
special arguments, at borders of tables, and where round-off is worst. Each header is compiled with each compiler that
is installed, and run at all of them. -ffast-math breaks the rules of IEEE 754, which bounds rest on: four more units in
the last place are allowed, for reciprocals and sums in another order, and only arguments and results that are 0 or
positive normal numbers are looked at. Rounding to nearest is off by half a unit, the other modes by up to one: that
doubles the bound of rounding, to first order. Other processors are emulated.
"""

from __future__ import annotations

import json
import math
import re
import shutil
import subprocess
from collections.abc import Iterable, Sequence
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
from viscopade.kernels.toolchain import ToolchainError
from viscopade.plots.sheet import BLACK, BLUE, GREEN, ORANGE, PURPLE, VERMILION
from viscopade.progress import track
from viscopade_lab.hard_cases.case import Finding, Row

if TYPE_CHECKING:
    from matplotlib.figure import Figure

EXPORTS = Path(__file__).parents[3] / "exports"
WARNINGS = ("-Wall", "-Wextra", "-Wpedantic", "-Werror", "-Wno-unknown-pragmas", "-Wno-unused-function")
QUICK = ("vectors_pade.json", "vectors_full.json")
FAST_ULPS = 4.0
SECONDS = 600
KINDS = {
    "plain": "error / proven error",
    "bits": "results that differ in a bit from each operation rounded once",
    "fast": "-ffast-math: error beyond the proven one, in ulp",
    "mode": "rounding toward zero, upward, downward: error / proven error",
    "processor": "other processors and C libraries: error / proven error",
    "refused": "headers that a compiler refuses or warns of",
}
LIMITS = {"plain": 1.0, "bits": 0.0, "fast": FAST_ULPS, "mode": 2.0, "processor": 1.0, "refused": 0.0}


class Build(NamedTuple):
    """A way to compile and run: `kind` says what results are held to, and `bits` whether they are known to the bit."""

    kind: str
    words: tuple[str, ...]
    label: str
    bits: bool = False
    emulator: tuple[str, ...] = ()
    mode: str = ""


def builds(thorough: bool) -> list[Build]:
    """Return what is there, of each compiler with its flags and each processor."""
    off, native = ("-O2", "-ffp-contract=off"), ("-O3", "-march=native", "-ffp-contract=fast")
    found = []
    for name in ("gcc", "clang", "g++", "clang++") if thorough else ("gcc",):
        start = (name, "-std=c++17") if "++" in name else (name, "-std=c99")
        found += [Build("plain", (*start, *off), name, True), Build("plain", (*start, *native), f"{name} FMA")]
        found.append(Build("fast", (*start, *native, "-ffast-math"), f"{name} -ffast-math"))
    found.append(Build("plain", ("tcc", "-std=c99"), "tcc", True))
    for mode in ("TOWARDZERO", "UPWARD", "DOWNWARD"):
        words = ("gcc", "-std=c99", "-frounding-math", *off)
        found.append(Build("mode", words, f"gcc {mode.lower()}", mode=f"FE_{mode}"))
    if thorough:
        found.append(Build("processor", ("musl-gcc", "-std=c99", *off), "musl", True))
        for target, emulator, label in (
            ("aarch64-linux-gnu", "aarch64", "aarch64"), ("arm-linux-gnueabihf", "arm", "armhf"),
            ("riscv64-linux-gnu", "riscv64", "riscv64"), ("s390x-linux-gnu", "s390x", "s390x"),
            ("i686-linux-gnu", "i386", "i386 x87"),
        ):  # fmt: skip
            standard = "-std=gnu17" if label in ("s390x", "i386 x87") else "-std=c99"
            static = (f"{target}-gcc", "-O2", standard, "-static")
            found.append(Build("processor", static, label, emulator=(f"qemu-{emulator}",)))
    return [one for one in found if all(shutil.which(tool) for tool in (one.words[0], *one.emulator))]


class Vector(NamedTuple):
    """A function of a header with its arguments in C, the exact value, the error that is proven, and known bits."""

    function: str
    form: str
    given: tuple[float, ...]
    exact: float | Fraction
    error: Fraction
    bits: float | None


def exported(name: str) -> str:
    """Return an exported file as it lies in a source tree, or made anew."""
    path = EXPORTS / name
    return path.read_text(encoding="utf-8") if path.exists() else requests.file(name)


@lru_cache(maxsize=16)
def vectors(file: str) -> tuple[Vector, ...]:
    """Return what is known of the functions of a header, from the file of its test vectors."""
    header = set(re.findall(r"\bviscopade_(\w+)\(", exported(header_of(file))))
    found = []
    for name, form, x, y, exact, nearest, error, _, _, bits in json.loads(exported(file))["vectors"]:
        function = name + ("f" if form == "float" else "")
        if function not in header or exact == "-":
            continue
        given = tuple(float.fromhex(text) for text in (x, y) if text != "-")
        value: float | Fraction = float.fromhex(nearest) if error == "0" else Fraction(exact)
        if error != "0" and name.endswith("_full") and len(exact.partition("e")[0].strip("-0.")) < 19:
            value = _exact(name, given)  # its decimals are too few to measure an error of half a unit in the last place
        known = None if bits == "-" else float.fromhex(bits)
        found.append(Vector(function, form, given, value, Fraction(error), known))
    return tuple(found)


def _exact(name: str, given: Sequence[float]) -> Fraction:
    """Return the exact value of a function of full accuracy, of v* or of speed and beta, to 20 digits."""
    x, *beta = map(Fraction, given)
    found = truth.sharply(x * beta[0] ** 5 if beta else x**10)
    with working(truth.BITS):
        values = {
            "one_minus_epsilon": found.loss,
            "rebound": found.epsilon * ball_of(x),
            "dissipation": found.loss * (1 + found.epsilon),
        }
        kind = next((kind for kind in values if name.startswith(kind)), "")
        return exact_middle(values.get(kind, found.epsilon))


def header_of(file: str) -> str:
    """Return the header that test vectors are for."""
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


class Result(NamedTuple):
    """The errors of a header in a build; `reason` says why there are none."""

    build: Build
    file: str
    part: float = 0.0
    excess: float = 0.0
    differ: int = 0
    reason: str = ""


def run(build: Build, file: str, header: str) -> Result:
    """Compile and run a header, and hold the results to the vectors."""
    try:
        values = _printed(build, file, header)
    except ToolchainError as error:
        return Result(build, file, reason=str(error))
    part, excess, differ = 0.0, 0.0, 0
    for vector, value in zip(vectors(file), values, strict=True):
        if build.kind == "fast" and not _usual(vector):
            continue
        wrong = _error(vector, value, build)
        part, excess = max(part, wrong[0]), max(excess, wrong[1])
        known = vector.bits
        differ += build.bits and known is not None and known != value and not (math.isnan(known) and math.isnan(value))
    return Result(build, file, part, excess, differ)


def _usual(vector: Vector) -> bool:
    """Tell whether arguments and result are 0 or positive normal numbers; -ffast-math promises nothing for others."""
    least = np.finfo(TYPES[vector.form]).tiny
    return all(x == 0 or least <= x < math.inf for x in (*vector.given, vector.exact))


def _error(vector: Vector, value: float, build: Build) -> tuple[float, float]:
    """Return the error relative to the proven one, and beyond it in units in the last place."""
    if not math.isfinite(vector.exact):
        same = value == vector.exact or (math.isnan(value) and math.isnan(vector.exact))
        return (0.0, 0.0) if same else (math.inf, math.inf)
    if not math.isfinite(value):
        return math.inf, math.inf
    kind = TYPES[vector.form]
    unit = Fraction(float(np.spacing(kind(abs(float(vector.exact))))))
    off = abs(Fraction(value) - Fraction(vector.exact))
    excess = float(max(off - vector.error, Fraction(0)) / unit)
    if vector.error == 0:  # a neighbour of the number is right in other rounding modes
        return (0.0 if off <= (unit if build.mode else 0) else math.inf), excess
    return float(off / vector.error), excess


def _printed(build: Build, file: str, header: str) -> list[float]:
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
    return [float.fromhex(line) for line in done.stdout.split()]


def measure(thorough: bool) -> Finding:
    """Build with everything that is there."""
    files = [name for name in requests.NAMES if name.startswith("vectors_") and header_of(name) in requests.NAMES]
    jobs = [(build, file) for build in builds(thorough) for file in (files if thorough else QUICK)]
    return judged([run(*jobs[i], exported(header_of(jobs[i][1]))) for i in track(range(len(jobs)), "compilers")])


def judged(found: Sequence[Result]) -> Finding:
    """Hold the results of all builds to what is proven.

    Raises
    ------
    ToolchainError
        If there is no compiler.
    """
    if not found:
        raise ToolchainError("there is no C compiler: accepted are gcc, clang and tcc")
    ran = [one for one in found if not one.reason]
    measured: dict[str, Iterable[float]] = {
        kind: [one.excess if kind == "fast" else one.part for one in ran if one.build.kind == kind] for kind in KINDS
    }
    measured |= {"bits": [one.differ for one in ran if one.build.bits], "refused": [len(found) - len(ran)]}
    rows = tuple(Row(KINDS[kind], max(values), LIMITS[kind]) for kind, values in measured.items() if values)
    labels = list(dict.fromkeys(one.build.label for one in ran))
    largest = {label: max(one.part for one in ran if one.build.label == label) for label in labels}
    kinds = {one.build.label: one.build.kind for one in ran}
    worst = {kind: max((largest[label] for label in labels if kinds[label] == kind), default=0.0) for kind in KINDS}
    summary = (
        f"{len(ran)} programs by {', '.join(label for label in labels if kinds[label] != 'mode')}. With rounding to "
        f"nearest the largest error is {max(worst['plain'], worst['processor']):.4f} of what is proven; in the other "
        f"rounding modes, for which nothing is proven, {worst['mode']:.3f} of it. No bound is promised under "
        f"-ffast-math: there errors exceed the proven ones by up to {max(measured['fast'], default=0.0):.2f} ulp."
    )

    def draw(figure: Figure) -> None:
        axes = figure.subplots()
        colors = {"plain": BLUE, "fast": VERMILION, "mode": PURPLE, "processor": GREEN}
        names = {
            "plain": "rounding to nearest",
            "fast": "-ffast-math",
            "mode": "other rounding modes",
            "processor": "processors",
        }
        for kind, color in colors.items():
            chosen = [label for label in labels if kinds[label] == kind]
            at = [labels.index(label) for label in chosen]
            axes.plot(at, [largest[label] for label in chosen], "o", color=color, markersize=5, label=names[kind])
        axes.axhline(1, color=BLACK, linewidth=0.8, label="proven, to nearest")
        axes.axhline(2, color=ORANGE, linewidth=0.8, label="limit of other modes")
        axes.set_xticks(range(len(labels)), labels, rotation=40, ha="right")
        axes.set(
            ylabel="error / proven error", ylim=(0, max(4, 1.2 * max(x for x in largest.values() if x < math.inf)))
        )
        axes.legend(loc="upper right", ncols=2, frameon=False, fontsize=8)

    return Finding(rows, summary, draw)
