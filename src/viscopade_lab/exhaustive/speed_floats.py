"""Test the float functions of the table for 1e-5 on all positive floats, largest errors as parts of the bounds.

Run as `python -m viscopade_lab.exhaustive.speed_floats`: all 2^31 - 2^23 - 1 positive finite speeds with beta = 1, for
eps, the speed after the collision and 1 - eps^2, one by one and as arrays, compiled without and with fused
multiplications. The reference is viscopade_full.h in type double. It takes minutes.
"""

from __future__ import annotations

import os
import struct
import sys
from fractions import Fraction
from typing import Any

import click
from rich.table import Table

from viscopade.arithmetic.formats import FLOAT
from viscopade.kernels import prove_lacunary
from viscopade.kernels.forms import speed_kernel, speed_table
from viscopade.kernels.targets import last_place, speed
from viscopade_lab import exhaustive
from viscopade_lab.script import console

FIRST, END = 1, 0x7F800000  # bits of the least positive float and of infinity
PIECES = 64
FUNCTIONS = tuple(function for function, _ in speed.FUNCTIONS)


ULPS = 3.5
"""What is added to the bound for the functions other than eps, in units in the last place."""


def bounds(kernel: speed_kernel.SpeedKernel) -> tuple[float, float]:
    """Return the proven relative errors of the smaller of eps and 1 - eps, in the table and beyond it.

    Rounding is included, but not the last one of eps.
    """
    # Beyond the table numbers are computed in type double: some roundings in 1e-13 of the result.
    return float(kernel.table.inside(FLOAT)), float(Fraction(kernel.bound) + Fraction(1, 10**13))


def check(kernel: speed_kernel.SpeedKernel, text: str, mode: str, step: int = 1, jobs: int = 1) -> dict[str, Any]:
    """Return the result for a kernel's header, compiled in one of `exhaustive.MODES`.

    Every `step`-th speed is tested.
    """
    length = -(-(END - FIRST) // (PIECES * step)) * step
    starts = range(FIRST, END, length)
    inside, outside = bounds(kernel)
    first = kernel.table.first
    files = {
        "full.h": last_place.render("viscopade_lab.exhaustive.speed_floats"),
        "speed.h": text,
        "bounds.h": f"#define NAME(function) viscopade_##function##_{kernel.name}f\n"
        f"static const double LOW = 0x1p{first}, HIGH = 0x1p{first + speed_table.OCTAVES};\n"
        f"static const double INSIDE = {inside!r}, OUTSIDE = {outside!r}, ULPS = {ULPS!r};\n",
    }
    with exhaustive.compiled("check_speed_float", mode, files) as program:
        lines = exhaustive.outputs(program, [(at, min(at + length, END), step) for at in starts], jobs)
    functions = {}
    for function in FUNCTIONS:
        parts = [rest for word, *rest in lines if word == "largest" and rest[0] == function]
        largest = max((float(part), int(at)) for _, part, at in parts)
        functions[function] = {
            "largest": largest[0],
            "largest_at": float_of(largest[1]).hex(),
            "beyond": sum(int(rest[1]) for word, *rest in lines if word == "beyond" and rest[0] == function),
        }
    rises = [rest for word, *rest in lines if word == "rises"]
    rise = max((float(size), int(at)) for _, size, at in rises)
    return {
        "mode": mode,
        "inputs": sum(int(rest[0]) for word, *rest in lines if word == "inputs"),
        "functions": functions,
        "differ": sum(int(rest[0]) for word, *rest in lines if word == "differ"),
        "rises": sum(int(number) for number, *_ in rises),
        "largest_rise": rise[0],
        "largest_rise_at": float_of(rise[1]).hex(),
    }


def float_of(bits: int) -> float:
    """Return the float of these bits."""
    (number,) = struct.unpack("<f", struct.pack("<I", bits))
    return float(number)


def show(results: list[dict[str, Any]]) -> None:
    """Print the results for people."""
    table = Table("compiled", "inputs", *FUNCTIONS, "arrays differ", "eps rises", "largest rise")
    for result in results:
        table.add_row(
            " ".join(exhaustive.MODES[result["mode"]]),
            f"{result['inputs']:,}",
            *(f"{part['largest']:.4f} at {part['largest_at']}" for part in result["functions"].values()),
            f"{result['differ']}",
            f"{result['rises']:,}",
            f"{result['largest_rise']:.3g} at {result['largest_rise_at']}",
        )
    out = console(240)
    out.print("Errors as parts of the bounds; rises relative to the smaller of eps and 1 - eps.")
    out.print(table)


@click.command()
@click.option("--step", type=click.IntRange(1), default=1, show_default=True, help="Test every n-th speed only.")
@click.option("--jobs", type=click.IntRange(1), default=os.cpu_count() or 1, help="Processes at a time.")
@click.option("--mode", "modes", type=click.Choice(list(exhaustive.MODES)), multiple=True, default=exhaustive.MODES)
def main(step: int, jobs: int, modes: tuple[str, ...]) -> None:
    """Test, print the errors, and exit with 1 if one is beyond its bound."""
    kernel = prove_lacunary.speed_kernel("1e-5")
    text = speed.render(kernel, "viscopade_lab.exhaustive.speed_floats")
    results = [check(kernel, text, mode, step, jobs) for mode in modes]
    show(results)
    sys.exit(any(part["beyond"] for result in results for part in result["functions"].values()))


if __name__ == "__main__":
    main()
