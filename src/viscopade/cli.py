"""The command line. Numbers go to standard output; progress and errors to standard error."""

from __future__ import annotations

import csv
import io
import json
import os
import re
import sys
from collections.abc import Iterable, Sequence
from pathlib import Path
from typing import Any, NoReturn

import click
from rich import box
from rich.console import Console
from rich.progress import BarColumn, Progress, TextColumn, TimeRemainingColumn
from rich.table import Table

from viscopade import checks, exports
from viscopade.balls import known_decimal
from viscopade.pade import MAX_DEGREE, Pade, Root, pade
from viscopade.paper import CITATION, Entry, approximants, compare
from viscopade.progress import shown_by
from viscopade.series import series
from viscopade.writer import write, write_all

COMPARED_DIGITS = 20


class Whole(click.ParamType[int]):
    """An integer within a range, with our own words for what is accepted."""

    name = "integer"

    def __init__(self, label: str, low: int, high: int) -> None:
        self.label, self.low, self.high = label, low, high

    def convert(self, value: Any, param: click.Parameter | None, ctx: click.Context | None) -> int:
        """Parse decimal digits with an optional sign."""
        if isinstance(value, str):
            if not re.fullmatch(r"[+-]?[0-9]{1,18}", value):
                self.fail(f"{self.label} is {value!r}: accepted is an integer from {self.low} to {self.high}")
            value = int(value)
        try:
            return checks.integer(self.label, value, self.low, self.high)
        except ValueError as error:
            self.fail(str(error))


class Degrees(click.ParamType[tuple[int, int]]):
    """Degrees [m/n] written as M/N."""

    name = "M/N"

    def convert(self, value: Any, param: click.Parameter | None, ctx: click.Context | None) -> tuple[int, int]:
        """Parse "3/6"."""
        if isinstance(value, tuple):
            return value
        match = re.fullmatch(r"([0-9]{1,3})/([0-9]{1,3})", value)
        degrees = (int(match[1]), int(match[2])) if match else (MAX_DEGREE + 1, 0)
        if max(degrees) > MAX_DEGREE:
            self.fail(f"{value!r} are no degrees: accepted is M/N with 0 <= M, N <= {MAX_DEGREE}, such as 3/6")
        return degrees


ORDER = Whole("order", 0, checks.MAX_ORDER)
DIGITS = Whole("digits", 1, checks.MAX_DIGITS)
STYLE = click.option(
    "--format", "style", type=click.Choice(["text", "json", "csv", "latex"]), default="text", show_default=True
)
DIGITS_OPTION = click.option("--digits", type=DIGITS, default=30, show_default=True, help="Significant digits.")


@click.group(context_settings={"help_option_names": ["-h", "--help"]})
@click.version_option(package_name="viscopade")
def command() -> None:
    """Coefficient of restitution of viscoelastic spheres: proven series, Padé approximants, generated code."""


@command.command()
@click.option("--out", type=click.Path(path_type=Path), help="Write the exports to this directory.")
@STYLE
@click.pass_context
def reproduce(context: click.Context, out: Path | None, style: str) -> None:
    """Derive the paper's table, compare every printed entry, and write the exports.

    The exit status is 1 if an entry disagrees; nothing is written then.
    """
    ours = approximants(COMPARED_DIGITS)
    entries = compare(ours)
    agreeing = sum(entry.agrees for entry in entries)
    header = ("[m/n]", "coefficient", "paper", "ours, rounded", "ours", "agrees")
    whole = {"agreeing": agreeing, "entries": [_entry_json(entry) for entry in entries]}
    show(style, header, map(_entry_row, entries), whole, title=CITATION)
    if style == "text":
        click.echo(f"{agreeing} of {len(entries)} printed numbers agree")
        for approximant in ours:
            click.echo(f"{approximant.label} {approximant.verdict}")
    if agreeing < len(entries):
        if out is not None:
            click.echo("viscopade: nothing is written, because of the disagreement", err=True)
        context.exit(1)
    if out is not None:
        texts = exports.files()
        write_all({out / name: text for name, text in texts.items()}, parents=True)
        if style == "text":
            click.echo(f"wrote {', '.join(texts)} to {out}")


@command.command()
@click.option("--order", type=ORDER, default=20, show_default=True, help="Highest power of v*.")
@DIGITS_OPTION
@STYLE
def coefficients(order: int, digits: int, style: str) -> None:
    """Print the coefficients h_0 … h_ORDER of eps = sum h_k v*^k, every digit proven."""
    h = series(order, digits).decimals()
    show(style, ("k", "h_k"), enumerate(h), {"order": order, "digits": digits, "h": h})


# Unknown options are passed on as arguments, so that a negative degree is refused as what it is.
@command.command("pade", context_settings={"ignore_unknown_options": True})
@click.argument("m", type=Whole("m", 0, MAX_DEGREE))
@click.argument("n", type=Whole("n", 0, MAX_DEGREE))
@DIGITS_OPTION
@STYLE
def pade_command(m: int, n: int, digits: int, style: str) -> None:
    """Print the Padé approximant [M/N]: coefficients, poles, zeros, and where it may be used."""
    p = pade(m, n, digits)
    a, b = p.decimals()
    rows = [(name, i, value, "") for name, values in (("a", a), ("b", b)) for i, value in enumerate(values)]
    rows += [(kind, i, *root.decimals(digits)) for kind, roots in _roots(p) for i, root in enumerate(roots, 1)]
    show(style, ("what", "i", "value or real part", "imaginary part"), rows, _pade_json(p))
    if style == "text":
        click.echo(f"{p.label} {p.verdict}")
        click.echo(f"eps - {p.label} = {known_decimal(p.next_term, 10)} v*^{p.contact_order + 1} + …")
        click.echo(f"digits lost by the linear system: {p.digits_lost}; order conditions met within {p.residual:.1e}")
        for d in p.doublets():
            pole, zero = (" + i ".join(root.decimals(min(digits, 10))) for root in (d.pole, d.zero))
            click.echo(f"Froissart doublet: pole {pole}, zero {zero}, relative distance {d.distance:.1e}")


@command.command()
@click.argument("target", type=click.Choice([*exports.RENDERERS, "series-csv", "series-json"]))
@click.option(
    "--pade",
    "degrees",
    type=Degrees(),
    multiple=True,
    help="An approximant, such as 3/6; repeat for more. Default: the four of the paper's table.",
)
@click.option("--order", type=ORDER, default=exports.SERIES_ORDER, show_default=True, help="For series-csv and -json.")
@click.option("--digits", type=DIGITS, default=exports.SERIES_DIGITS, show_default=True, help="Likewise.")
@click.option("-o", "--output", type=click.Path(path_type=Path), help="File to write; default: standard output.")
def export(target: str, degrees: tuple[tuple[int, int], ...], order: int, digits: int, output: Path | None) -> None:
    """Generate code or tables: a C header, a Python module, CSV, JSON or LaTeX.

    An existing file is replaced only if viscopade generated it.
    """
    if target.startswith("series-"):
        text = exports.render_series(target.removeprefix("series-"), order, digits)
    else:
        text = exports.render(target, degrees or exports.PAPER_DEGREES)
    if output is None:
        click.echo(text, nl=False)
    else:
        write(output, text)


def _entry_row(entry: Entry) -> tuple[str, ...]:
    agrees = "yes" if entry.agrees else "NO"
    return f"[{entry.m}/{entry.n}]", entry.name, entry.printed, entry.rounded, entry.ours, agrees


def _entry_json(entry: Entry) -> dict[str, Any]:
    fields = ("m", "n", "symbol", "index", "printed", "rounded", "ours", "agrees")
    return {name: getattr(entry, name) for name in fields}


def _roots(p: Pade) -> tuple[tuple[str, tuple[Root, ...]], ...]:
    return ("pole", p.poles), ("zero", p.zeros)


def _root_json(root: Root, digits: int) -> dict[str, Any]:
    real_part, imaginary_part = root.decimals(digits)
    result: dict[str, Any] = {
        "re": real_part,
        "im": imaginary_part,
        "multiplicity": root.multiplicity,
        "real": root.real,
        "positive": root.positive,
    }
    if root.residue is not None:
        residue = complex(root.residue)
        result["residue"] = {"re": residue.real, "im": residue.imag}
    return result


def _pade_json(p: Pade) -> dict[str, Any]:
    a, b = p.decimals()
    return {
        "m": p.m,
        "n": p.n,
        "digits": p.digits,
        "a": a,
        "b": b,
        "poles": [_root_json(root, p.digits) for root in p.poles],
        "zeros": [_root_json(root, p.digits) for root in p.zeros],
        "doublets": [
            {"pole": d.pole.decimals(p.digits), "zero": d.zero.decimals(p.digits), "distance": d.distance}
            for d in p.doublets()
        ],
        "usable": p.usable,
        "verdict": p.verdict,
        "contact_order": p.contact_order,
        "next_term": known_decimal(p.next_term, 10),
        "digits_lost": p.digits_lost,
        "residual": p.residual,
    }


def show(
    style: str, header: Sequence[str], rows: Iterable[Sequence[object]], whole: dict[str, Any], title: str | None = None
) -> None:
    """Print a table as text, CSV or LaTeX, or `whole` as one JSON object."""
    cells = [[str(cell) for cell in row] for row in rows]
    if style == "json":
        click.echo(json.dumps(whole, ensure_ascii=False))
    elif style == "csv":
        buffer = io.StringIO()
        csv.writer(buffer, lineterminator="\n").writerows([header, *cells])
        click.echo(buffer.getvalue(), nl=False)
    elif style == "latex":
        lines = [" & ".join(row).replace("_", r"\_") + r" \\" for row in ([*header], *cells)]
        body = "\n".join([lines[0], r"\hline", *lines[1:]])
        click.echo(f"\\begin{{tabular}}{{{'l' * len(header)}}}\n{body}\n\\end{{tabular}}")
    else:
        _print_table(header, cells, title)


def _print_table(header: Sequence[str], cells: Iterable[Sequence[str]], title: str | None) -> None:
    table = Table(box=box.SIMPLE_HEAD, title=title, title_justify="left")
    for name in header:
        table.add_column(name, overflow="fold")  # a digit is never left out
    for row in cells:
        table.add_row(*row)
    # In a pipe a line is as long as it needs to be.
    console = Console(width=None if sys.stdout.isatty() else 2 * checks.MAX_DIGITS, markup=False, highlight=False)
    with console.capture() as capture:
        console.print(table)
    click.echo("\n".join(line.rstrip() for line in capture.get().splitlines()))


def _tracker(steps: Sequence[int], description: str) -> Iterable[int]:
    """Show progress on a terminal, and take it away when done."""
    console = Console(stderr=True)
    columns = TextColumn("{task.description}"), BarColumn(), TimeRemainingColumn()
    with Progress(*columns, console=console, transient=True, disable=not console.is_terminal) as progress:
        yield from progress.track(steps, description=description)


def _fail(message: object, status: int) -> NoReturn:
    """Print one line and exit."""
    click.echo("viscopade: " + " ".join(str(message).split()), err=True)
    sys.exit(status)


def main() -> None:
    """Run the command line; errors are one line, and exit status 2 means that the input was at fault."""
    try:
        with shown_by(_tracker):
            status = command.main(prog_name="viscopade", standalone_mode=False)
            sys.stdout.flush()
    except click.exceptions.NoArgsIsHelpError as error:
        click.echo(error.format_message())
        sys.exit(2)
    except click.ClickException as error:
        _fail(error.format_message(), 2)
    except (ValueError, TypeError) as error:
        _fail(error, 2)
    except ArithmeticError as error:
        _fail(error, 1)
    except BrokenPipeError:
        # Whoever read the output has had enough; keep the interpreter from complaining at exit.
        os.dup2(os.open(os.devnull, os.O_WRONLY), sys.stdout.fileno())
        sys.exit(1)
    except (click.Abort, KeyboardInterrupt):
        _fail("interrupted", 130)
    sys.exit(status if isinstance(status, int) else 0)
