"""Command that writes the live calculator, a page for a browser."""

from __future__ import annotations

import shlex
from pathlib import Path

import click

from viscopade.cli.writer import check_targets, write


@click.command("calculator")
@click.option("--out", type=click.Path(path_type=Path), help="File to write; default: standard output.")
def calculator_command(out: Path | None) -> None:
    """Write a calculator of eps, contact times and damping as one HTML file.

    A browser opens it from the disk and asks no server for anything. eps comes from the export for JavaScript, with its
    proven bound.
    """
    if out is not None:
        check_targets([out])
    from viscopade.calculator import page

    words = ["viscopade", "calculator", *([] if out is None else ["--out", out.name])]
    text = page.page(shlex.join(words))
    if out is None:
        click.echo(text, nl=False)
    else:
        write(out, text)


COMMANDS = (calculator_command,)
