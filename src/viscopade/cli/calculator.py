"""Command that writes the live calculator, a page for a browser."""

from __future__ import annotations

from pathlib import Path

import click

from viscopade.cli.console import Command, command_line, examples, output_option, say, write_or_print


@click.command("calculator", cls=Command, epilog=examples("viscopade calculator", "viscopade calculator -o ball.html"))
@output_option("calculator.html")
def calculator_command(output: Path | None) -> None:
    """Write a calculator of eps and damping as one HTML file.

    A browser opens the file from the disk and needs no network. eps is computed by the export for JavaScript, with its
    proven error.
    """
    from viscopade.calculator import page

    write_or_print(page.page(command_line()), output)
    if output is not None:
        say(f"wrote {output}")


COMMANDS = (calculator_command,)
