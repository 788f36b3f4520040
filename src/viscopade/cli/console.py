"""Common parts of the commands: types of arguments, tables on standard output, progress on standard error."""

from __future__ import annotations

import csv
import io
import json
import re
import shlex
import sys
from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
from contextlib import contextmanager
from pathlib import Path
from textwrap import wrap
from time import monotonic
from typing import TYPE_CHECKING, Any, NoReturn, TextIO

import click

from viscopade import arguments, extras
from viscopade.cli.writer import check_targets, write
from viscopade.theory.law import ACCEPTED_LAWS, ENDS, VISCOELASTIC

FIRST_SECONDS, LONG_SECONDS = 1.0, 60.0
"""After how long it is estimated how long a loop takes, and from what time on the user is told."""

if TYPE_CHECKING:
    from viscopade.collision.spheres import Pair
    from viscopade.progress import Cost
    from viscopade.theory.law import Law

    _Integer = click.ParamType[int]
    _Number = click.ParamType[float]
    _Pair = click.ParamType[tuple[int, int]]
    _Text = click.ParamType[str]
else:  # before Click 8.4 it takes no type
    _Integer = _Number = _Pair = _Text = click.ParamType


def examples(*lines: str) -> str:
    """Return command lines as the end of a command's help."""
    shown = "\n".join(f"  {line}" for line in lines)
    return f"\b\n{'Examples' if len(lines) > 1 else 'Example'}:\n{shown}"


class OneOf(click.Choice[str]):
    """Type of an argument: one of several names in lower case; one that is nearly so is answered with that.

    `others` has further names, with what is expected instead.
    """

    def __init__(self, choices: Iterable[str], others: Mapping[str, str] | None = None) -> None:
        super().__init__([*choices])
        self.others = others or {}

    def convert(self, value: Any, param: click.Parameter | None, ctx: click.Context | None) -> str:
        """Take one of the names, in upper or lower case."""
        name = str(value).lower()
        if name in self.others:
            self.fail(f"{value!r} is unknown here: expected {self.others[name]}", param, ctx)
        if name not in self.choices:
            listed = ", ".join(self.choices)
            near = arguments.meant(name, self.choices)
            self.fail(f"{value!r} is unknown{near or f': expected {listed}'}", param, ctx)
        return name

    def fail(self, message: str, param: click.Parameter | None = None, ctx: click.Context | None = None) -> NoReturn:
        """Refuse an argument by its name, which is shorter than the list of its values."""
        hint = param.human_readable_name.upper() if isinstance(param, click.Argument) else None
        raise click.BadParameter(message, ctx, param, hint)


class Whole(_Integer):
    """Type of an option: an integer within a range."""

    name = "integer"

    def __init__(self, label: str, low: int, high: int) -> None:
        self.label, self.low, self.high = label, low, high

    def convert(self, value: Any, param: click.Parameter | None, ctx: click.Context | None) -> int:
        """Parse decimal digits with an optional sign."""
        if isinstance(value, str):
            if not re.fullmatch(r"[+-]?[0-9]{1,18}", value):
                self.fail(f"{self.label} is {value!r}: expected an integer from {self.low} to {self.high}")
            value = int(value)
        try:
            return arguments.integer(self.label, value, self.low, self.high)
        except ValueError as error:
            self.fail(str(error))


class Real(_Number):
    """Type of an option: a decimal number, read as a double."""

    name = "number"

    def __init__(self, label: str) -> None:
        self.label = label

    def convert(self, value: Any, param: click.Parameter | None, ctx: click.Context | None) -> float:
        """Parse a decimal number."""
        if isinstance(value, float):
            return value
        try:
            return float(
                arguments.exact_number(
                    self.label, value, "a finite decimal number", lambda number: abs(number) < 10**300
                )
            )
        except ValueError as error:
            self.fail(str(error))


class Quantity(_Text):
    """Type of an option: a number with a unit, or a plain one in SI units; either becomes a decimal in SI units."""

    name = "quantity"

    def __init__(self, label: str, dimension: str) -> None:
        self.label, self.dimension = label, dimension

    def convert(self, value: Any, param: click.Parameter | None, ctx: click.Context | None) -> str:
        """Parse a number, or a number with a unit."""
        try:
            arguments.exact_number(self.label, value, "", lambda _: True)
        except ValueError:
            from viscopade import quantity

            found = quantity.si_decimal(value, self.dimension)
            if found is None:
                unit, example = quantity.DIMENSIONS[self.dimension]
                article = "an" if self.dimension[0] in "aeiou" else "a"
                accepted = f'{article} {self.dimension}, such as "2.5 {example}", or a number in {unit}'
                self.fail(f"{self.label} is {value!r}: expected {accepted}")
            return found
        return str(value)


def double(label: str, number: str) -> float:
    """Return a decimal as a double.

    Raises
    ------
    ValueError
        If it has no place there.
    """
    return float(arguments.exact_number(label, number, "a finite decimal number", lambda x: abs(x) < 10**300))


class Degrees(_Pair):
    """Type of an option: the degrees [m/n] of an approximant, written M/N."""

    name = "M/N"

    def convert(self, value: Any, param: click.Parameter | None, ctx: click.Context | None) -> tuple[int, int]:
        """Parse degrees such as "3/6"."""
        if isinstance(value, tuple):
            return value
        match = re.fullmatch(r"([0-9]{1,3})/([0-9]{1,3})", value)
        degrees = (int(match[1]), int(match[2])) if match else (arguments.MAX_DEGREE + 1, 0)
        if max(degrees) > arguments.MAX_DEGREE:
            accepted = f"M/N with 0 <= M, N <= {arguments.MAX_DEGREE}, such as 3/6"
            self.fail(f"degrees are {value!r}: expected {accepted}")
        return degrees


class Degree(_Pair):
    """Type of an argument: the degree M of a numerator, or both degrees written M/N."""

    name = "M[/N]"

    def convert(self, value: Any, param: click.Parameter | None, ctx: click.Context | None) -> tuple[int, int]:
        """Parse "3" or "3/6"; without the second degree it is -1."""
        if isinstance(value, str) and "/" in value:
            return Degrees().convert(value, param, ctx)
        return Whole("m", 0, arguments.MAX_DEGREE).convert(value, param, ctx), -1


PICTURES = ("svg", "png", "pdf")
_ENDLESS = 1_000_000  # columns: wider than any table
_IN_A_PIPE = 100  # columns of text that no terminal shows
_READABLE = 24  # columns that are enough for a sentence on several lines, and for a name that is no number
_NARROWEST = 20  # columns of a terminal; what is narrower gets lines of this length

ORDER = Whole("order", 0, arguments.MAX_ORDER)
DIGITS = Whole("digits", 1, arguments.MAX_DIGITS)
STYLE = click.option(
    "--format",
    "style",
    type=click.Choice(["text", "json", "csv"]),
    default="text",
    show_default=True,
    help="Format of the output.",
)
# 30 unless a material is given: those numbers are double precision.
DIGITS_IF_EXACT = click.option("--digits", type=DIGITS, help="Significant digits; not with a material.  [default: 30]")


def _checked_output(_context: click.Context, _: click.Parameter, path: str | None) -> Path | None:
    """Refuse a file that is seen not to be writable, before there is anything to write; a minus is no file."""
    if path is None or path == "-":
        return None
    check_targets([path])
    return Path(path)


def to_file(*flags: str) -> Callable[..., Any]:
    """Return the option, of these names, that says where `deliver` writes."""
    return click.option(
        *flags,
        type=click.Path(),
        callback=_checked_output,
        help="File to write; default, or -: standard output.",
    )


OUTPUT = to_file("-o", "--output")


WORDS = "viscopade.words"
"""Where a context has the words of the command line."""


def command_line() -> str:
    """Return the command that runs, for the files that it writes: it can be pasted into a shell and makes them again.

    Files are named without their folders. An option of `to_file` is left out: what is in a file depends on no name.
    """
    context = click.get_current_context()
    name, *words = context.meta[WORDS]
    values, _, order = context.command.make_parser(context).parse_args(list(words))
    given = {param: values[str(param.name)] for param in order}
    found = ["viscopade", name]
    for param in sorted(order, key=lambda param: isinstance(param, click.Option)):  # arguments come first
        value = given[param]
        if param.multiple:
            value, given[param] = value[0], value[1:]
        if param.callback is _checked_output or not isinstance(value, (str, bool, tuple)):
            continue
        texts = [value] if isinstance(value, str) else [] if isinstance(value, bool) else value
        if isinstance(param, click.Option):
            found.append(max(param.secondary_opts if value is False else param.opts, key=len))
        found += (Path(text).name or text if isinstance(param.type, click.Path) else text for text in texts)
    return shlex.join(found)


def deliver(text: str, output: Path | None) -> None:
    """Write generated text to the file that an option names, or to the standard output."""
    if output is None:
        click.echo(text, nl=False)
    else:
        write(output, text)


DIGITS_OPTION = click.option("--digits", type=DIGITS, default=30, show_default=True, help="Significant digits.")


LAW = click.option(
    "--law",
    default="viscoelastic",
    show_default=True,
    metavar="NAME|A,B",
    help=f"Law of contact x'' + x^A + kappa x^B x' = 0: {ACCEPTED_LAWS}.",
)


def with_law(command: Callable[..., None]) -> Callable[..., None]:
    """Decorate a command with --law and --end; `viscopade.theory.law.law_of` makes a law of what they are given."""
    command = click.option(
        "--end",
        type=click.Choice(ENDS),
        help="End of contact: where the force vanishes, or at x = 0.  [default: force]",
    )(command)
    return LAW(command)


def law_words(law: Law) -> tuple[dict[str, Any], str]:
    """Return a law as JSON fields, and as a line if it is not the paper's."""
    fields = {"law": str(law), "end": law.end, "nu": str(law.nu), "d": law.d}
    if law == VISCOELASTIC:
        return fields, ""
    end = "where the force vanishes" if law.end == "force" else "at x = 0"
    variable = "v* = kappa" if law.d == 1 else f"v* = kappa^(1/{law.d})"
    line = f"law {law}: {law.equation}, nu = {law.nu}; {variable}; contact ends {end}"
    return fields, line


MATERIAL = {
    "radius": ("length", "Radius of both spheres; give the option twice for two different radii."),
    "young_modulus": ("pressure", "Young modulus of the material."),
    "poisson_ratio": ("", "Poisson ratio of the material, > -1 and <= 0.5."),
    "density": ("density", "Density of the material."),
    "dissipative_constant": ("time", "Dissipative constant A of the material."),
    "yield_strength": ("pressure", "Yield strength of the material, for a warning; may be left out."),
}
"""By option, the dimension ("" if there is none) and the help."""


def material(*names: str) -> Callable[[Callable[..., None]], Callable[..., None]]:
    """Return a decorator that adds the options of two spheres of one material, or of a sphere and a wall."""

    def decorate(command: Callable[..., None]) -> Callable[..., None]:
        command = click.option("--wall", is_flag=True, help="One sphere hits a plane wall of the same material.")(
            command
        )
        for name in reversed(names):
            command = _material_option(name)(command)
        return _material_option("radius", "radii", multiple=True)(command)

    return decorate


def _material_option(name: str, *also: str, **settings: Any) -> Callable[[Callable[..., None]], Callable[..., None]]:
    dimension, text = MATERIAL[name]
    flag, kind = "--" + name.replace("_", "-"), Quantity(name, dimension) if dimension else Real(name)
    return click.option(flag, *also, type=kind, help=text, **settings)


def pair_of(
    radii: Sequence[str], wall: bool, yield_strength: str | None = None, **properties: str | float | None
) -> Pair | None:
    """Return the pair of bodies that the options describe, or None if no option is given.

    Raises
    ------
    click.UsageError
        If an option is missing, or there are too many radii.
    """
    from viscopade.collision.spheres import Pair, Sphere

    if not radii and not wall and all(value is None for value in (yield_strength, *properties.values())):
        return None
    missing = [name for name, value in properties.items() if value is None] + ([] if radii else ["radius"])
    if missing:
        raise click.UsageError("a material also needs " + ", ".join("--" + name.replace("_", "-") for name in missing))
    if len(radii) > 2 - wall:
        raise click.UsageError(f"--radius is given {len(radii)} times: expected once or twice, and once with --wall")
    values: dict[str, Any] = {"dissipative_constant": 0.0}
    values |= {name: double(name, str(value)) for name, value in properties.items()}
    spheres = [Sphere(radius=double("radius", radius), **values) for radius in radii]
    values.pop("density")
    return Pair(spheres[0], Sphere.wall(**values) if wall else spheres[-1])


def limits_of(pair: Pair, fastest: float, yield_strength: str | None) -> list[str]:
    """Return a sentence for each assumption of the model that a pair violates at a speed, as `limits.violations`."""
    from viscopade.collision import limits

    strength = None if yield_strength is None else double("yield_strength", yield_strength)
    return list(limits.violations(pair, fastest, yield_strength=strength))


class Missing(click.ClickException):
    """Error: an optional package is not installed; the message is one line."""

    exit_code = 2


def need(user: str, *packages: str) -> None:
    """Check that optional packages are installed, before any work that needs them.

    Parameters are those of `viscopade.extras.require`.

    Raises
    ------
    Missing
        If one is not installed; the message has the command that installs it.
    """
    try:
        extras.require(user, *packages)
    except extras.MissingPackage as error:
        raise Missing(str(error)) from None


def picture_kind(option: str, file: Path) -> str:
    """Return the format that a picture's name ends in.

    Raises
    ------
    click.UsageError
        If it is none.
    """
    kind = file.suffix.lower().removeprefix(".")
    if kind not in PICTURES:
        raise click.UsageError(f"{option} is {file}: expected a name that ends in .svg, .png or .pdf")
    return kind


def show(
    style: str, header: Sequence[str], rows: Iterable[Sequence[object]], whole: dict[str, Any], title: str | None = None
) -> None:
    """Print a table as text or CSV, or `whole` as one JSON object."""
    cells = [[str(cell) for cell in row] for row in rows]
    if style == "json":
        click.echo(json.dumps(whole, ensure_ascii=False))
    elif style == "csv":
        buffer = io.StringIO()
        csv.writer(buffer, lineterminator="\n").writerows([header, *cells])
        click.echo(buffer.getvalue(), nl=False)
    else:
        _print_table(header, cells, title)


def _print_table(header: Sequence[str], cells: Sequence[Sequence[str]], title: str | None) -> None:
    """Print a table. If it is too wide, heads and sentences take several lines, or each cell one; no number is cut."""
    from rich import box
    from rich.console import Console
    from rich.table import Table

    table = Table(*header, box=box.SIMPLE_HEAD, title=title, title_justify="left")
    for row in cells:
        table.add_row(*row)
    console = Console(width=_ENDLESS, color_system=None, force_terminal=False, markup=False, highlight=False)
    width = text_width()
    if console.measure(table).maximum > width:
        columns = list(zip(header, *cells, strict=True))
        least = [max(map(_least_width, texts)) for texts in columns]
        widths = [max(map(len, texts)) for texts in columns]
        while sum(widths) + 2 * len(columns) > width and widths != least:
            _, widest = max((have, i) for i, have in enumerate(widths) if have > least[i])
            widths[widest] -= 1
        table.padding, table.pad_edge = (0, 1, 0, 0), False
        for column, wanted in zip(table.columns, widths, strict=True):
            column.width, column.overflow = wanted, "fold"
        in_rows = max(len(columns[i][0]) + have for i, have in enumerate(least))
        if sum(widths) + 2 * len(columns) > width > in_rows:
            _print_rows(header, cells, title)
            return
    with console.capture() as capture:
        console.print(table)
    click.echo("\n".join(line.rstrip() for line in capture.get().splitlines()))


def _least_width(text: str) -> int:
    """Return the columns that a text needs: for a sentence more than its longest word; long names may be broken."""
    whole = (len(word) if re.search("[0-9]", word) else min(len(word), _READABLE) for word in text.split())
    return max([*whole, min(len(text) // 4, _READABLE)])


def _print_rows(header: Sequence[str], cells: Sequence[Sequence[str]], title: str | None) -> None:
    """Print each cell of a table on a line of its own, if it is not empty, after its head."""
    say(title or "")
    for row in cells:
        click.echo()
        for i, (head, text) in enumerate(zip(header, row, strict=True)):
            if text:
                say(f"{'  ' * (i > 0)}{head}: {text}", 4)
    click.echo()


def say(text: str, indent: int = 0) -> None:
    """Print a text; lines break at spaces, but not inside a formula, and all lines but the first are indented."""
    joined = re.sub(r" ([-+<>=]+) ", "\N{NO-BREAK SPACE}\\1\N{NO-BREAK SPACE}", text)
    lines = wrap(joined, text_width(), subsequent_indent=" " * indent, break_long_words=False, break_on_hyphens=False)
    click.echo("\n".join(lines).replace("\N{NO-BREAK SPACE}", " "))


def text_width() -> int:
    """Return the width of the terminal on standard output; that of a pipe or a file is 100 columns."""
    if not _is_terminal(sys.stdout):
        return _IN_A_PIPE
    from rich.console import Console

    return max(Console().width, _NARROWEST)


def _is_terminal(stream: TextIO | None) -> bool:
    """Return whether a stream is an open terminal, whatever the environment says (FORCE_COLOR)."""
    return stream is not None and not stream.closed and stream.isatty()


def keep_printing() -> None:
    """Set up the output: characters outside its encoding are printed as escapes and raise no error."""
    for stream in (sys.stdout, sys.stderr):
        if isinstance(stream, io.TextIOWrapper) and stream.errors == "strict":
            stream.reconfigure(errors="backslashreplace")


def tracker(steps: Sequence[int], description: str, cost: Cost | None) -> Iterable[int]:
    """Iterate over the steps. If their costs are known and they take long, a line on standard error says how long.

    If standard error is a terminal, a progress bar is shown, which disappears at the end.
    """
    costs = [1.0 if cost is None else cost(step) for step in steps]
    total, done, told, begin = sum(costs), 0.0, cost is None, monotonic()
    with _bar(description, total) as advance:
        for step, its_cost in zip(steps, costs, strict=True):
            yield step
            done += its_cost
            advance(done)
            elapsed = monotonic() - begin
            left = elapsed * (total - done) / done
            if not told and elapsed > FIRST_SECONDS and left > LONG_SECONDS:
                click.echo(f"viscopade: {description}: about {max(round(left / 60), 1)} min", err=True)
                told = True


@contextmanager
def _bar(description: str, total: float) -> Iterator[Callable[[float], None]]:
    """Show a progress bar in a `with` block, if standard error is a terminal; the function tells it what is done."""
    if not _is_terminal(sys.stderr):
        yield lambda _: None
        return
    from rich.console import Console
    from rich.progress import BarColumn, Progress, TextColumn, TimeElapsedColumn

    columns = TextColumn("{task.description}"), BarColumn(), TimeElapsedColumn()
    with Progress(*columns, console=Console(stderr=True), transient=True) as progress:
        task = progress.add_task(description, total=total)
        yield lambda done: progress.update(task, completed=done)
