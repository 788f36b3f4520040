"""Test the float kernels on all 2^31 inputs without a sign, and print how many results are not correctly rounded.

Run as `make exhaustive`, or `python -m viscopade_lab.exhaustive.floats --format json`: +0, all positive numbers,
+infinity and all NaNs, for eps and 1 - eps, compiled without and with fused multiplications. What the reference
(exhaustive/reference.h) cannot decide is decided by `viscopade.collision.exact`. The inputs whose true values lie
nearest to a boundary of rounding are listed; `--close` stores them for the tests.
"""

from __future__ import annotations

import os
import sys
from pathlib import Path
from typing import Any

import click
from rich.table import Table

from viscopade.arithmetic.formats import FLOAT
from viscopade.kernels.forms import last_place
from viscopade_lab import exhaustive
from viscopade_lab.script import FORMAT, console

ALL = 1 << 31
PIECES = 64


def check(function: str, mode: str, step: int = 1, jobs: int = 1, text: str | None = None) -> dict[str, Any]:
    """Return the result for one function, compiled in one of `exhaustive.MODES`.

    Every `step`-th input is tested; `text` is another header than that of the kernels.
    """
    length = -(-ALL // (PIECES * step)) * step
    starts = range(0, ALL, length)
    arguments = [(last_place.FUNCTIONS.index(function), start, min(start + length, ALL), step) for start in starts]
    with exhaustive.compiled("check_float", mode, text) as program:
        lines = exhaustive.outputs(program, arguments, jobs)
    inputs = sum(int(rest[0]) for word, *rest in lines if word == "inputs")
    wrong = [int(rest[0]) for word, *rest in lines if word == "wrong"]
    undecided = [(int(rest[0]), int(rest[1])) for word, *rest in lines if word == "undecided"]
    wrong += [
        at
        for at, result in undecided
        if FLOAT.rounded(exhaustive.exact_value(function, exhaustive.float_of(at), 60)) != exhaustive.float_of(result)
    ]
    largest = max((float(rest[0]), int(rest[1])) for word, *rest in lines if word == "largest")
    return {
        "function": function,
        "mode": mode,
        "inputs": inputs,
        "not_correctly_rounded": len(wrong),
        "wrong_at": [exhaustive.float_of(at).hex() for at in wrong],
        "decided_by_exact": [exhaustive.float_of(at).hex() for at, _ in undecided],
        "close": [exhaustive.float_of(int(rest[0])).hex() for word, *rest in lines if word == "close"],
        "largest_error_ulp": largest[0],
        "largest_error_at": exhaustive.float_of(largest[1]).hex(),
    }


def show(results: list[dict[str, Any]]) -> None:
    """Print the results for people."""
    table = Table("function", "compiled", "inputs", "not correctly rounded", "largest error", "close", "by exact", "s")
    for result in results:
        table.add_row(
            result["function"],
            " ".join(exhaustive.MODES[result["mode"]]),
            f"{result['inputs']:,}",
            f"{result['not_correctly_rounded']} {' '.join(result['wrong_at'][:3])}",
            f"{result['largest_error_ulp']:.10f} ulp at {result['largest_error_at']}",
            f"{len(result['close'])}",
            f"{len(result['decided_by_exact'])} {' '.join(result['decided_by_exact'][:3])}",
            f"{result['seconds']}",
        )
    console(200).print(table)


@click.command()
@FORMAT
@click.option("--step", type=click.IntRange(1), default=1, show_default=True, help="Test every n-th input only.")
@click.option("--jobs", type=click.IntRange(1), default=os.cpu_count() or 1, help="Processes at a time.")
@click.option(
    "--function", "functions", type=click.Choice(last_place.FUNCTIONS), multiple=True, default=last_place.FUNCTIONS
)
@click.option("--mode", "modes", type=click.Choice(list(exhaustive.MODES)), multiple=True, default=exhaustive.MODES)
@click.option("--close", type=click.Path(path_type=Path), help="Write the inputs close to a boundary to this file.")
def main(
    style: str, step: int, jobs: int, functions: tuple[str, ...], modes: tuple[str, ...], close: Path | None
) -> None:
    """Test, print for people or as JSON, and exit with 1 if a result is not correctly rounded."""
    results = [exhaustive.timed(check, function, mode, step, jobs) for function in functions for mode in modes]
    if style == "json":
        click.echo(exhaustive.as_json(results))
    else:
        show(results)
    if close is not None:
        inputs = {result["function"]: result["close"] for result in results}
        close.write_text(exhaustive.as_json(inputs) + "\n")
    sys.exit(any(result["not_correctly_rounded"] for result in results))


if __name__ == "__main__":
    main()
