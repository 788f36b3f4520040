"""What it costs to start: processor time of `import viscopade` and of each `--help`, beside that of `import numpy`.

Run as `make bench`, or `python -m viscopade_lab.studies.start --format json`. Every time is the median over rounds, in
which all processes take turns; the times depend on the machine, the ratios much less.
"""

from __future__ import annotations

import resource
import statistics
import subprocess
import sys
from functools import partial

import click
from rich.table import Table

from viscopade.cli import main as command_line
from viscopade_lab.script import command, console, in_turn, rounds

YARDSTICK = "import numpy"


def starts() -> dict[str, tuple[str, ...]]:
    """Return what is started, by name: the words that follow the interpreter."""
    with click.Context(command_line.command) as context:
        names = command_line.command.list_commands(context)
    helps = {f"viscopade {name} --help": ("-m", "viscopade", name, "--help") for name in names}
    return {
        YARDSTICK: ("-c", "import numpy"),
        "import viscopade": ("-c", "import viscopade"),
        "viscopade --help": ("-m", "viscopade", "--help"),
        **helps,
    }


def processor_time(words: tuple[str, ...]) -> float:
    """Return the processor time of a process."""
    before = resource.getrusage(resource.RUSAGE_CHILDREN)
    subprocess.run([sys.executable, *words], check=True, stdout=subprocess.DEVNULL)
    after = resource.getrusage(resource.RUSAGE_CHILDREN)
    return after.ru_utime + after.ru_stime - before.ru_utime - before.ru_stime


def measure(rounds: int) -> dict[str, dict[str, float]]:
    """Return for each start its median processor time, and the ratio to that of NumPy."""
    times = in_turn({name: partial(processor_time, words) for name, words in starts().items()}, rounds)
    median = {name: statistics.median(values) for name, values in times.items()}
    return {name: {"seconds": value, "ratio": value / median[YARDSTICK]} for name, value in median.items()}


def show(found: dict[str, dict[str, float]]) -> None:
    """Print the times."""
    table = Table("start", "processor time, s", f"of {YARDSTICK}", title="Medians")
    for name, numbers in found.items():
        table.add_row(name, f"{numbers['seconds']:.3f}", f"{numbers['ratio']:.2f}")
    console().print(table)


main = command(measure, show, rounds(9))


if __name__ == "__main__":
    main()
