"""Check exported C on many arguments: doubles of the full kernel, and all floats of the table for 1e-5.

Run as `python -m viscopade_lab.studies.exhaustive`. Both are compiled without and with FMA contraction.

- `doubles`: eps and 1 - eps at random v*, evenly distributed in the bits, range by range, against the proven
  polynomials in long double, which are accurate to 0.01 ulp.
- `floats`: all 2^31 - 2^23 - 1 positive finite speeds with beta = 1, for eps, the speed after the collision and
  1 - eps^2, one by one and as arrays, against the full kernel in double.
"""

from __future__ import annotations

import os
import shutil
import struct
import subprocess
import sys
from collections.abc import Iterable, Iterator, Mapping, Sequence
from concurrent.futures import ThreadPoolExecutor
from contextlib import contextmanager
from fractions import Fraction
from itertools import pairwise
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import NamedTuple

import click
from rich.console import Console
from rich.table import Table

from viscopade.arithmetic.formats import FLOAT
from viscopade.arrays import panels
from viscopade.kernels import formulas, full, requests, speed_table
from viscopade.kernels.catalogue import Request

MODES = {"plain": ("-O3", "-ffp-contract=off"), "fused": ("-O3", "-march=native", "-ffp-contract=fast")}
"""Flags of the compiler: without FMA contraction, and with the FMA instructions of this machine."""

RANGES = {
    "epsilon": (-30, -4, -1, 0, 2, 6, 20, 23, 306, 324),
    "one_minus_epsilon": (-538, -511, -400, -30, -4, -1, 0, 2, 6, 17),
}
"""Exponents of 2 of v* between ranges: the form of the result changes there; the outer ranges have subnormals.

eps ~ v*^(-10/3) falls below 2^-1022 at v* = 2^306, and 1 - eps ~ v*^2 below v* = 2^-511.
"""
SUBNORMAL = ((306, 324), (-538, -511))  # ranges whose results are subnormal
STREAMS = 4  # of random numbers to a range: as many programs can run at a time
REFERENCE_ULP = 0.01  # error of the reference in long double, which has 11 bits more than double: 2^-11 and some

PIECES = 64  # into which all floats are divided: more than processors, so that all of them are busy
LAST_FLOAT = 0x7F7FFFFF  # bits of the largest finite float, as an integer; positive floats are ordered like their bits
FUNCTIONS = tuple(speed_table.MEANINGS)


class Errors(NamedTuple):
    """The largest error of a function over a range of arguments, its place, and a count of large errors.

    `largest` and `bound` are in ulp (doubles) or in units of the proven bound (floats); `largest` occurs at `argument`,
    a v* or a speed with beta = 1. `noted` of `total` errors are above half an ulp (doubles), or the bound (floats).
    """

    function: str
    arguments: str
    largest: float
    argument: float
    noted: int
    total: int
    bound: float


@contextmanager
def compiled(program: str, mode: str, files: Mapping[str, str]) -> Iterator[Path]:
    """Give the path of a C program of this folder, compiled with the flags of a mode and with generated `files`.

    `program` is the C file's name without .c; `files` has the contents of what it includes, by name.
    """
    compiler = shutil.which(os.environ.get("CC", "cc"))
    if compiler is None:
        raise FileNotFoundError("there is no C compiler: set CC to one")
    with TemporaryDirectory() as name:
        folder = Path(name)
        for file, text in files.items():
            (folder / file).write_text(text)
        source = Path(__file__).with_name(f"{program}.c")
        command = [compiler, "-std=gnu11", *MODES[mode], "-I", name, str(source), "-o", str(folder / program), "-lm"]
        subprocess.run(command, check=True)
        yield folder / program


def outputs(program: Path, arguments: Iterable[Sequence[object]], jobs: int = 1) -> list[list[str]]:
    """Return the words of all lines that a program prints, run once with each list of arguments, `jobs` at a time."""

    def run(words: Sequence[object]) -> list[list[str]]:
        done = subprocess.run([str(program), *map(str, words)], check=True, capture_output=True, text=True)
        return [line.split() for line in done.stdout.splitlines()]

    with ThreadPoolExecutor(jobs) as pool:
        return [line for lines in pool.map(run, arguments) for line in lines]


# --- doubles of the full kernel ---------------------------------------------------------------------------------------


def double_files(text: str) -> dict[str, str]:
    """Return the files that exhaustive_double.c includes: the header, and the proven polynomials in long double."""
    lines = [
        f"enum {{ FIRST = {panels.FIRST}, SPLIT = {panels.SPLIT}, FOLD = {panels.FOLD}, PERIOD = {panels.PERIOD},",
        f"       PANELS = {panels.PANELS}, COEFFICIENTS = {panels.COEFFICIENTS} }};",
        "static const long double table[2][PANELS][1 + COEFFICIENTS] = {",
    ]
    for function in full.FUNCTIONS:
        lines.append("{")
        for index in range(panels.PANELS):
            # Coefficients are integers a_i in units of 2^exponent; a_0 may have 66 bits, two more than a long double.
            exponent, a = full.table_row(function, index)
            high = a[0] >> 8 << 8  # its upper 58 bits; the lower 8 are a number of their own
            lines.append("{" + ", ".join(f"{c:#x}p{exponent}L" for c in (high, a[0] - high, *a[1:])) + "},")
        lines.append("},")
    return {"full.h": text, "table.h": "\n".join([*lines, "};", ""])}


def doubles(program: Path, function: str, samples: int, jobs: int) -> Iterator[Errors]:
    """Yield the errors of a function in ulp, range by range, from about `samples` random v* in each."""
    # The proven bound of normal results. A subnormal one is such a result, whose unit is at most half a subnormal unit,
    # rounded once more, by half a unit: 1/2 + normal/2.
    normal, subnormal = full.largest_ulp(function), (1 + full.largest_ulp(function)) / 2
    for ends in pairwise(RANGES[function]):
        # A double and an integer have the same eight bytes: random integers between are evenly distributed in the bits.
        bits = [struct.unpack("<Q", struct.pack("<d", 2.0**end))[0] for end in ends]
        # Function, first and last bits, number of samples, seed (any, different from stream to stream).
        arguments = [
            (full.FUNCTIONS.index(function), *bits, samples // STREAMS, 1 + 1000 * stream) for stream in range(STREAMS)
        ]
        # Each stream prints: count above half an ulp, largest error in ulp, its v*, and the kernel's result there.
        lines = outputs(program, arguments, jobs)
        largest, v_star = max((float(error), float.fromhex(v_star)) for _, error, v_star, _ in lines)
        above = sum(int(count) for count, *_ in lines)
        bound = float(subnormal if ends in SUBNORMAL else normal)
        total = STREAMS * (samples // STREAMS)
        yield Errors(function, "2^{} … 2^{}".format(*ends), largest, v_star, above, total, bound)


# --- floats of the table for 1e-5 -------------------------------------------------------------------------------------


def floats(text: str, mode: str, step: int = 1, jobs: int = 1) -> tuple[list[Errors], int]:
    """Return error / bound of the functions in a header, and the number of array results that differ.

    `text` is the header with the table for 1e-5, `mode` a key of `MODES`. Every `step`-th speed is tested, by `jobs`
    programs at a time. The bound is relative to the smaller of eps and 1 - eps. It includes rounding, except for the
    last one of eps.
    """
    layout, kernel = speed_table.TABLES["1e-5"], speed_table.speed_table("1e-5")
    inside, first = kernel.table_bound("restitution", FLOAT.name).relative, layout.first
    # Beyond the table numbers are computed in double: some roundings in 1e-13 of the result.
    beyond_table = float(max(bound.formula for bound in kernel.bounds) + Fraction(1, 10**13))
    files = {
        "full.h": requests.render(Request(full=True), "c"),
        "speed.h": text,
        "bounds.h": f"#define NAME(function) viscopade_##function##_{kernel.name}f\n"
        f"static const double LOW = 0x1p{first}, HIGH = 0x1p{first + formulas.OCTAVES};\n"
        f"static const double INSIDE = {float(inside)!r}, OUTSIDE = {beyond_table!r};\n",
    }
    # Pieces of consecutive bits, from 1 (the smallest subnormal): length is a multiple of step, division rounded up.
    length = -(-LAST_FLOAT // (PIECES * step)) * step
    arguments = [(bits, min(bits + length, LAST_FLOAT + 1), step) for bits in range(1, LAST_FLOAT + 1, length)]
    with compiled("exhaustive_float", mode, files) as program:
        lines = outputs(program, arguments, jobs)
    # A line: function, largest error / bound, its speed, number beyond the bound, number of speeds; or "differ", count.
    results = []
    for function in FUNCTIONS:
        pieces = [rest for name, *rest in lines if name == function]
        largest, speed = max((float(share), float.fromhex(speed)) for share, speed, *_ in pieces)
        beyond, total = (sum(int(piece[i]) for piece in pieces) for i in (2, 3))
        arguments_tested = "all floats" if step == 1 else f"every {step}th"
        results.append(Errors(function, arguments_tested, largest, speed, beyond, total, 1))
    return results, sum(int(rest[0]) for name, *rest in lines if name == "differ")


@click.command()
@click.option("--samples", type=click.IntRange(STREAMS), default=10_000_000, show_default=True, help="Of each range.")
@click.option("--step", type=click.IntRange(1), default=1, show_default=True, help="Test every n-th float only.")
@click.option("--jobs", type=click.IntRange(1), default=os.cpu_count() or 1, help="Processes at a time.")
def main(samples: int, step: int, jobs: int) -> None:
    """Test, print the errors, and exit with 1 if one is beyond its bound, or an array differs."""
    out, holds = Console(width=160, highlight=False), True  # 160 columns hold the widest table
    source = requests.render(Request(full=True), "c")
    table = requests.render(Request(from_speed=("1e-5",)), "c")
    for mode, flags in MODES.items():
        with compiled("exhaustive_double", mode, double_files(source)) as program:
            in_ulp = [row for function in full.FUNCTIONS for row in doubles(program, function, samples, jobs)]
        parts, differ = floats(table, mode, step, jobs)
        for title, rows, word in (
            ("full kernel, type double: errors in ulp", in_ulp, "above 0.5"),
            ("table for 1e-5, type float: errors as parts of the bounds", parts, "beyond the bound"),
        ):
            lines = Table("function", "arguments", word, "largest", "at", "bound", title=f"{title}; {' '.join(flags)}")
            for row in rows:
                share = f"{100 * row.noted / row.total:.4f} % of {row.total:,}"
                numbers = (f"{row.largest:.4f}", row.argument.hex(), f"{row.bound:.5f}")
                lines.add_row(row.function, row.arguments, share, *numbers)
            out.print(lines)
        out.print(f"{differ} results of arrays differ from single ones")
        # Errors in ulp contain that of the reference.
        holds &= all(row.largest <= row.bound + REFERENCE_ULP for row in in_ulp)
        holds &= differ == 0 and not any(row.noted for row in parts)
    sys.exit(not holds)


if __name__ == "__main__":
    main()
