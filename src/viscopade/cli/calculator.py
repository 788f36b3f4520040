"""Command that writes the live calculator, a page for a browser."""

from __future__ import annotations

from pathlib import Path

import click

from viscopade.cli.console import command_line, examples, to_file, write_or_print


@click.command("calculator", epilog=examples("viscopade calculator --out calculator.html"))
@to_file("--out")
def calculator_command(out: Path | None) -> None:
    """Write a calculator of eps and damping as one HTML file.

    A browser opens the file from the disk and needs no network. eps is computed by the export for JavaScript, with its
    proven error.
    """
    from viscopade.calculator import page

    write_or_print(page.page(command_line()), out)


COMMANDS = (calculator_command,)
