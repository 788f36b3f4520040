"""Command that writes the live calculator, a page for a browser."""

from __future__ import annotations

from pathlib import Path

import click

from viscopade.cli.console import command_line, deliver, examples, to_file


@click.command("calculator", epilog=examples("viscopade calculator --out calculator.html"))
@to_file("--out")
def calculator_command(out: Path | None) -> None:
    """Write a calculator of eps and damping as one HTML file.

    A browser opens it from the disk and asks no server for anything. eps comes from the export for JavaScript, with its
    proven bound.
    """
    from viscopade.calculator import page

    deliver(page.page(command_line()), out)


COMMANDS = (calculator_command,)
