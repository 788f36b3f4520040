"""Exhaustive checks of exported kernels in compiled C: doubles of the full kernel, floats of the table for 1e-5."""

from __future__ import annotations

import os
import shutil
import subprocess
from collections.abc import Iterable, Iterator, Mapping, Sequence
from concurrent.futures import ThreadPoolExecutor
from contextlib import contextmanager
from fractions import Fraction
from pathlib import Path
from tempfile import TemporaryDirectory

from viscopade.arrays import panels
from viscopade.collision import exact
from viscopade.kernels.forms import last_place

HERE = Path(__file__).parent
MODES = {"plain": ("-O3", "-ffp-contract=off"), "fused": ("-O3", "-march=native", "-ffp-contract=fast")}
"""How the kernels are compiled: without fused multiplications, and with what this machine has."""

ASYMPTOTIC_FROM = 2.0**200  # `exact` accepts less than that; from 2^20 on, one power law holds to 2^-60


def reference_table() -> str:
    """Return table.h: the polynomials of `viscopade.arrays.double` in type long double."""
    lines = [
        f"enum {{ FIRST = {panels.FIRST}, SPLIT = {panels.SPLIT}, FOLD = {panels.FOLD}, PERIOD = {panels.PERIOD},",
        f"       PANELS = {panels.PANELS}, COEFFICIENTS = {panels.COEFFICIENTS} }};",
        "static const long double table[2][PANELS][1 + COEFFICIENTS] = {",
    ]
    for function in last_place.FUNCTIONS:
        lines += ["{", *(_row(*last_place.table_row(function, index)) for index in range(panels.PANELS)), "},"]
    return "\n".join([*lines, "};", ""])


def _row(exponent: int, a: Sequence[int]) -> str:
    high = a[0] >> 8 << 8  # 58 bits
    return "{" + ", ".join(f"{c:#x}p{exponent}L" for c in (high, a[0] - high, *a[1:])) + "},"


@contextmanager
def compiled(program: str, mode: str, files: Mapping[str, str]) -> Iterator[Path]:
    """Compile a program of this folder with generated files that it includes; give the path of the result."""
    with TemporaryDirectory() as name:
        folder = Path(name)
        for file, text in files.items():
            (folder / file).write_text(text)
        result = folder / program
        sources = ["-I", str(folder), str(HERE / f"{program}.c"), "-o", str(result), "-lm"]
        subprocess.run([compiler(), "-std=gnu11", *MODES[mode], *sources], check=True)
        yield result


def compiler() -> str:
    """Return the C compiler, of the environment's CC or "cc"."""
    found = shutil.which(os.environ.get("CC", "cc"))
    if found is None:
        raise FileNotFoundError("there is no C compiler: set CC to one")
    return found


def outputs(
    program: Path, arguments: Iterable[Sequence[object]], jobs: int = 1, given: str | None = None
) -> list[list[str]]:
    """Run a program once with each list of arguments, `jobs` at a time; return the words of all lines printed.

    It finds the text `given` on standard input.
    """

    def run(words: Sequence[object]) -> list[list[str]]:
        command = [str(program), *map(str, words)]
        done = subprocess.run(command, check=True, capture_output=True, text=True, input=given)
        return [line.split() for line in done.stdout.splitlines()]

    with ThreadPoolExecutor(jobs) as pool:
        return [line for lines in pool.map(run, arguments) for line in lines]


def exact_value(function: str, v_star: float, digits: int = 40) -> Fraction:
    """Return eps or 1 - eps from `collision.exact`, to `digits` digits; far out from the power law (section 2.5)."""
    if v_star > ASYMPTOTIC_FROM:
        folds = -(-(int(Fraction(v_star)).bit_length() - 200) // 3)
        epsilon: Fraction = exact_value("epsilon", v_star / 8.0**folds, digits) / 2 ** (10 * folds)
        return epsilon if function == "epsilon" else 1 - epsilon
    return Fraction(exact.collision(v_star, digits).decimals()[function])
