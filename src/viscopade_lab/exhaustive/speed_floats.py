"""Test the float kernels from speed to eps on all positive floats, largest errors as parts of the bounds.

Run as `python -m viscopade_lab.exhaustive.speed_floats`, or with `--format json`: all 2^31 - 2^23 - 1 positive finite
speeds with beta = 1, for eps, the speed after the collision and 1 - eps^2, one by one and as arrays, compiled without
and with fused multiplications. The reference is viscopade_full.h in type double, which is tested by
`exhaustive_float.py` and `ulp_double.py`. It takes minutes for a kernel.
"""

from __future__ import annotations

import os
import subprocess
import sys
from fractions import Fraction
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import Any, NamedTuple

import click
from rich.table import Table

from viscopade.arithmetic.formats import DOUBLE, FLOAT
from viscopade.kernels import names, prove_lacunary
from viscopade.kernels.forms import speed_kernel, speed_table
from viscopade.kernels.targets import last_place, speed
from viscopade_lab import exhaustive
from viscopade_lab.script import FORMAT, console

FIRST, END = 1, 0x7F800000  # bits of the least positive float and of infinity
PIECES = 64
PROGRAM = "check_speed_float"
FUNCTIONS = tuple(function for function, _ in speed.FUNCTIONS)


class FloatBounds(NamedTuple):
    """What is proven of a kernel's float functions.

    Attributes
    ----------
    first, end : int
        The table is for 2^first <= w < 2^end.
    inside, outside : float
        Of the relative error of the smaller of eps and 1 - eps, rounding included, but not the last one of eps.
    ulps : float
        What is added for the other functions, in units in the last place.
    """

    first: int
    end: int
    inside: float
    outside: float
    ulps: float


def bounds_of(kernel: speed_kernel.SpeedKernel) -> FloatBounds:
    """Return the bounds of a kernel, by its proofs."""
    table = kernel.table
    form = FLOAT if FLOAT in kernel.formats else DOUBLE
    # Beyond the table numbers are computed in type double: some roundings in 1e-13 of the result.
    outside = Fraction(kernel.bound) + Fraction(1, 10**13)
    ends = table.first, table.first + speed_table.OCTAVES
    return FloatBounds(*ends, float(table.inside(form)), float(outside), 3.5 if form == FLOAT else 0.5)


def check(text: str, name: str, bounds: FloatBounds, mode: str, step: int = 1, jobs: int = 1) -> dict[str, Any]:
    """Return the result for the header `text` with the kernel `name`, compiled in one of `exhaustive.MODES`.

    Every `step`-th speed is tested.
    """
    length = -(-(END - FIRST) // (PIECES * step)) * step
    starts = range(FIRST, END, length)
    with TemporaryDirectory() as folder:
        program = compiled(Path(folder), text, name, bounds, mode)
        lines = exhaustive.outputs(program, [(at, min(at + length, END), step) for at in starts], jobs)
    functions = {}
    for function in FUNCTIONS:
        parts = [rest for word, *rest in lines if word == "largest" and rest[0] == function]
        largest = max((float(part), int(at)) for _, part, at in parts)
        functions[function] = {
            "largest": largest[0],
            "largest_at": exhaustive.float_of(largest[1]).hex(),
            "beyond": sum(int(rest[1]) for word, *rest in lines if word == "beyond" and rest[0] == function),
        }
    rises = [rest for word, *rest in lines if word == "rises"]
    rise = max((float(size), int(at)) for _, size, at in rises)
    return {
        "kernel": name,
        "mode": mode,
        "inputs": sum(int(rest[0]) for word, *rest in lines if word == "inputs"),
        "functions": functions,
        "differ": sum(int(rest[0]) for word, *rest in lines if word == "differ"),
        "rises": sum(int(number) for number, *_ in rises),
        "largest_rise": rise[0],
        "largest_rise_at": exhaustive.float_of(rise[1]).hex(),
    }


def compiled(folder: Path, text: str, name: str, bounds: FloatBounds, mode: str) -> Path:
    """Compile the program with a kernel; return its path."""
    (folder / "full.h").write_text(last_place.render("benchmarks/exhaustive"))
    (folder / "speed.h").write_text(text)
    (folder / "bounds.h").write_text(
        f"#define NAME(function) viscopade_##function##_{name}f\n"
        f"static const double LOW = 0x1p{bounds.first}, HIGH = 0x1p{bounds.end};\n"
        f"static const double INSIDE = {bounds.inside!r}, OUTSIDE = {bounds.outside!r}, ULPS = {bounds.ulps!r};\n"
    )
    target = folder / PROGRAM
    sources = ["-I", str(folder), str(exhaustive.HERE / f"{PROGRAM}.c"), "-o", str(target), "-lm"]
    subprocess.run([exhaustive.compiler(), "-std=gnu11", *exhaustive.MODES[mode], *sources], check=True)
    return target


def show(results: list[dict[str, Any]]) -> None:
    """Print the results for people."""
    table = Table("kernel", "compiled", "inputs", *FUNCTIONS, "arrays differ", "eps rises", "largest rise", "s")
    for result in results:
        table.add_row(
            result["kernel"],
            " ".join(exhaustive.MODES[result["mode"]]),
            f"{result['inputs']:,}",
            *(f"{part['largest']:.4f} at {part['largest_at']}" for part in result["functions"].values()),
            f"{result['differ']}",
            f"{result['rises']:,}",
            f"{result['largest_rise']:.3g} at {result['largest_rise_at']}",
            f"{result['seconds']}",
        )
    out = console(240)
    out.print("Errors as parts of the bounds; rises relative to the smaller of eps and 1 - eps.")
    out.print(table)


@click.command()
@FORMAT
@click.option("--step", type=click.IntRange(1), default=1, show_default=True, help="Test every n-th speed only.")
@click.option("--jobs", type=click.IntRange(1), default=os.cpu_count() or 1, help="Processes at a time.")
@click.option("--tier", "tiers", type=click.Choice(names.TIERS), multiple=True, default=names.TIERS)
@click.option("--mode", "modes", type=click.Choice(list(exhaustive.MODES)), multiple=True, default=exhaustive.MODES)
def main(style: str, step: int, jobs: int, tiers: tuple[str, ...], modes: tuple[str, ...]) -> None:
    """Test, print for people or as JSON, and exit with 1 if an error is beyond its bound."""
    results = []
    for tier in tiers:
        kernel = prove_lacunary.speed_kernel(tier)
        text, bounds = speed.render(kernel, "src/viscopade_lab/exhaustive/speed_floats.py"), bounds_of(kernel)
        results += [exhaustive.timed(check, text, kernel.name, bounds, mode, step, jobs) for mode in modes]
    if style == "json":
        click.echo(exhaustive.as_json(results))
    else:
        show(results)
    sys.exit(any(part["beyond"] for result in results for part in result["functions"].values()))


if __name__ == "__main__":
    main()
