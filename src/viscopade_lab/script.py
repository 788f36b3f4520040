"""What the scripts of the laboratory share: a command that measures, and prints the result for people or as JSON."""

from __future__ import annotations

import json
import sys
from collections.abc import Callable
from dataclasses import asdict
from typing import Any, TypeVar

import click
from rich.console import Console

from viscopade.cli.console import need

Result = TypeVar("Result")
Option = Callable[[Callable[..., Any]], Callable[..., Any]]

FORMAT = click.option("--format", "style", type=click.Choice(["text", "json"]), default="text", show_default=True)


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
