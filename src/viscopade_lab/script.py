"""What the scripts of the laboratory share: a command that measures, and prints the result for people or as JSON."""

from __future__ import annotations

import json
import sys
import time
from collections.abc import Callable, Mapping
from dataclasses import asdict
from typing import Any, TypeVar

import click
from rich.console import Console

from viscopade.cli.console import need

Result = TypeVar("Result")
Option = Callable[[Callable[..., Any]], Callable[..., Any]]

FORMAT = click.option("--format", "style", type=click.Choice(["text", "json"]), default="text", show_default=True)


def rounds(default: int, what: str = "Measurements of each kind, in turn.") -> Option:
    """Return the option for the number of rounds."""
    return click.option("--rounds", type=click.IntRange(1), default=default, show_default=True, help=what)


def command(
    measure: Callable[..., Result], show: Callable[[Result], None], *options: Option, needs: str = ""
) -> click.Command:
    """Return the command of a script.

    Parameters
    ----------
    measure : callable
        From the options to the result: plain data, dataclasses among them.
    show : callable
        Prints the result for people.
    options : decorators
        Of `measure`'s arguments.
    needs : str
        A package that is asked for before anything is measured.
    """

    def run(style: str, **given: Any) -> None:
        if needs:
            need(measure.__module__.rpartition(".")[2], needs)
        result = measure(**given)
        if style == "json":
            click.echo(json.dumps(result, indent=1, default=asdict))
        else:
            show(result)

    decorated: Any = run
    for option in (*reversed(options), FORMAT):
        decorated = option(decorated)
    return click.command(help="Measure, and print the result for people or as JSON.")(decorated)


def console(width: int = 120) -> Console:
    """Return a console as wide as the terminal, or else of this width."""
    return Console(width=None if sys.stdout.isatty() else width, highlight=False)


def seconds(run: Callable[[], object]) -> float:
    """Return the wall-clock time of one run."""
    start = time.perf_counter()
    run()
    return time.perf_counter() - start


def in_turn(timers: Mapping[str, Callable[[], float]], rounds: int) -> dict[str, list[float]]:
    """Return what timers measure in each of some rounds, in which all take turns: what drifts hits all alike."""
    times: dict[str, list[float]] = {name: [] for name in timers}
    for _ in range(rounds):
        for name, timer in timers.items():
            times[name].append(timer())
    return times
