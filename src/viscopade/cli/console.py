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
from fractions import Fraction
from functools import reduce
from pathlib import Path
from time import monotonic
from typing import TYPE_CHECKING, Any, TextIO

import click

from viscopade import arguments
from viscopade.cli.writer import check_targets, write
from viscopade.generated import printable, wrapped
from viscopade.theory.law import ACCEPTED_LAWS, ENDS, VISCOELASTIC

FIRST_SECONDS, LONG_SECONDS = 1.0, 60.0
"""When the duration of a loop is estimated, and the remaining time from which on a message states it."""

if TYPE_CHECKING:
    from viscopade.collision.spheres import Pair
    from viscopade.progress import Cost
    from viscopade.theory.law import Law

    _Integer = click.ParamType[int]
    _Number = click.ParamType[float]
    _Pair = click.ParamType[tuple[int, int]]
else:  # before Click 8.4 it takes no type
    _Integer = _Number = _Pair = click.ParamType


def examples(*lines: str) -> str:
    """Return command lines as the end of a command's help."""
    shown = "\n".join(f"  {line}" for line in lines)
    return f"\b\n{'Examples' if len(lines) > 1 else 'Example'}:\n{shown}"


def _name(param: click.Parameter | None) -> str:
    """Return how a refusal names an option or an argument."""
    assert param is not None
    if isinstance(param, click.Argument):
        return (param.metavar or param.human_readable_name).strip("[]").upper()
    return max(param.opts, key=len)


class OneOf(click.Choice[str]):
    """Type of an argument: one of several names in any case; a refusal names those that look like the given one.

    `others` has further names, with the sentence that refuses each.
    """

    def __init__(self, choices: Iterable[str], others: Mapping[str, str] | None = None) -> None:
        super().__init__([*choices])
        self.others = others or {}

    def convert(self, value: Any, param: click.Parameter | None, ctx: click.Context | None) -> str:
        """Take one of the names, in upper or lower case."""
        name = str(value).lower()
        if name in self.others:
            raise click.UsageError(self.others[name])
        if name not in self.choices:
            listed = ", ".join(self.choices)
            near = arguments.meant(name, self.choices)
            raise click.UsageError(f"{_name(param)} is {value!r}{near or f': expected {listed}'}")
        return name


class Whole(_Integer):
    """Type of an option: an integer within a range."""

    name = "integer"

    def __init__(self, low: int, high: int) -> None:
        self.low, self.high = low, high

    def convert(self, value: Any, param: click.Parameter | None, ctx: click.Context | None) -> int:
        """Parse decimal digits with an optional sign."""
        if isinstance(value, str) and re.fullmatch(r"[+-]?[0-9]{1,18}", value):
            value = int(value)
        if isinstance(value, str):
            raise ValueError(f"{_name(param)} is {value!r}: expected an integer from {self.low} to {self.high}")
        return arguments.integer(_name(param), value, self.low, self.high)


_BEYOND = 10**300
_CONDITIONS: dict[str, Callable[[Fraction], bool]] = {
    "": lambda number: abs(number) < _BEYOND,
    " > 0": lambda number: 0 < number < _BEYOND,
    " >= 0": lambda number: 0 <= number < _BEYOND,
}


class Real(_Number):
    """Type of an option: a decimal number, read as a double. `condition` is a key of `_CONDITIONS`."""

    name = "number"

    def __init__(self, condition: str = "") -> None:
        self.condition = condition

    def convert(self, value: Any, param: click.Parameter | None, ctx: click.Context | None) -> float:
        """Parse a decimal number."""
        if isinstance(value, float):
            return value
        accepted = f"a finite decimal number{self.condition}"
        return float(arguments.exact_number(_name(param), value, accepted, _CONDITIONS[self.condition]))


class Quantity(_Number):
    """Type of an option: a number with a unit, or a plain one in SI units.

    It becomes a double in SI units, or with `exact` a decimal string.
    """

    name = "quantity"

    def __init__(self, dimension: str, condition: str = "", *, exact: bool = False) -> None:
        self.dimension, self.condition, self.exact = dimension, condition, exact

    def decimal(self, value: str, name: str) -> str:
        """Return the number in SI units as an exact decimal."""
        from viscopade import quantity

        try:
            arguments.exact_number(name, value, "", lambda _: True)
            found: str | None = value
        except ValueError:
            found = quantity.si_decimal(value, self.dimension)
        if found is None or not _CONDITIONS[self.condition](Fraction(found)):
            unit, example = quantity.DIMENSIONS[self.dimension]
            article = "an" if self.dimension[0] in "aeiou" else "a"
            expected = f'{article} {self.dimension}{self.condition}, such as "2.5 {example}", or a number in {unit}'
            raise ValueError(f"{name} is {value!r}: expected {expected}")
        return found

    def convert(self, value: Any, param: click.Parameter | None, ctx: click.Context | None) -> Any:
        """Parse a number, or a number with a unit."""
        if isinstance(value, float):
            return value
        decimal = self.decimal(value, _name(param))
        return decimal if self.exact else float(decimal)


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
            expected = f"M/N with 0 <= M, N <= {arguments.MAX_DEGREE}, such as 3/6"
            raise click.UsageError(f"{_name(param)} is {value!r}: expected {expected}")
        return degrees


class Degree(_Pair):
    """Type of an argument: the degree M of a numerator, or both degrees written M/N."""

    name = "M[/N]"

    def convert(self, value: Any, param: click.Parameter | None, ctx: click.Context | None) -> tuple[int, int]:
        """Parse "3" or "3/6"; without the second degree it is -1."""
        if isinstance(value, str) and "/" in value:
            return Degrees().convert(value, param, ctx)
        return Whole(0, arguments.MAX_DEGREE).convert(value, param, ctx), -1


class FilePath(click.Path):
    """Type of an option or argument: the path of a file or a folder. An empty one, of an unset variable, is refused."""

    def __init__(self) -> None:
        super().__init__(path_type=Path)

    def convert(self, value: Any, param: click.Parameter | None, ctx: click.Context | None) -> Any:
        """Return the path."""
        if value == "":
            raise click.UsageError(f"{_name(param)} is '': expected a path")
        return super().convert(value, param, ctx)


PICTURES = ("svg", "png", "pdf")
_ENDLESS = 1_000_000  # columns, more than any table has
_IN_A_PIPE = 100  # columns of text in a pipe or a file
_READABLE = 24  # columns for a sentence on several lines, and for a name without digits
_NARROWEST = 20  # columns; lines are so long on a narrower terminal, too

ORDER = Whole(0, arguments.MAX_ORDER)
DIGITS = Whole(1, arguments.MAX_DIGITS)
STYLE = click.option(
    "--format",
    "style",
    type=click.Choice(["text", "json", "csv"]),
    default="text",
    show_default=True,
    help="Format of the output.",
)
DIGITS_OPTION = click.option("--digits", type=DIGITS, default=30, show_default=True, help="Significant digits.")


def _checked_output(_context: click.Context, _: click.Parameter, path: Path | None) -> Path | None:
    """Return the file to write, None for "-"; refuse one that cannot be written, before the work."""
    if path is None or path == Path("-"):
        return None
    check_targets([path])
    return path


def to_file(*flags: str) -> Callable[..., Any]:
    """Return the option, with these names, that says where `write_or_print` writes."""
    return click.option(
        *flags,
        type=FilePath(),
        callback=_checked_output,
        help="File to write.  [default: -, the standard output]",
    )


OUTPUT = to_file("-o", "--output")


WORDS = "viscopade.words"
"""Key of the words of the command line in a context."""


def command_line() -> str:
    """Return the running command for the heads of its files: pasted into a shell, it makes the same files.

    Files are named without their folders. An option of `to_file` is left out, because the text does not depend on it.
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


def write_or_print(text: str, output: Path | None) -> None:
    """Write generated text to the file that an option names, or else to the standard output."""
    if output is None:
        click.echo(text, nl=False)
    else:
        write(output, text)


def law_words(law: Law) -> tuple[dict[str, Any], str]:
    """Return a law as JSON fields, and as a line if it is not the paper's."""
    fields = {"law": str(law), "end": law.end, "nu": str(law.nu), "d": law.d}
    if law == VISCOELASTIC:
        return fields, ""
    end = "where the force vanishes" if law.end == "force" else "at x = 0"
    variable = "v* = kappa" if law.d == 1 else f"v* = kappa^(1/{law.d})"
    line = f"law {law}: {law.equation}, nu = {law.nu}; {variable}; contact ends {end}"
    return fields, line


def with_options(*options: Callable[..., Any]) -> Callable[[Callable[..., None]], Callable[..., None]]:
    """Return a decorator that adds options to a command, in this order."""
    return lambda command: reduce(lambda made, option: option(made), reversed(options), command)


LAW = click.option(
    "--law",
    default="viscoelastic",
    show_default=True,
    metavar="NAME|A,B",
    help=f"Law of contact x'' + x^A + kappa x^B x' = 0: {ACCEPTED_LAWS}.",
)
WITH_LAW = with_options(
    LAW,
    click.option(
        "--end",
        type=click.Choice(ENDS),
        help="End of contact: where the force vanishes, or at x = 0.  [default: force]",
    ),
)
"""The options of `viscopade.theory.law.law_of`."""
GRAVITY = click.option(
    "--gravity", type=Quantity("acceleration", " >= 0"), help="Include the weight of a body that falls on a plane."
)
ADHESION = click.option(
    "--adhesion",
    type=Quantity("energy per area", " > 0"),
    metavar="QUANTITY",
    help="Work of adhesion of the material's surfaces, twice its surface energy, in J/m^2.",
)
EFFECTIVE_MASS = click.option("--mass", type=Quantity("mass", " > 0"), help="Effective mass, m1 m2/(m1 + m2).")

MATERIAL = {
    "young_modulus": (Quantity("pressure"), "Young modulus of the material."),
    "poisson_ratio": (Real(), "Poisson ratio of the material, > -1 and <= 0.5."),
    "density": (Quantity("density"), "Density of the material."),
    "dissipative_constant": (Quantity("time"), "Dissipative constant A of the material."),
    "yield_strength": (Quantity("pressure"), "Yield strength of the material, only for a warning."),
}
"""Type and help of each option."""


def material(*names: str) -> Callable[[Callable[..., None]], Callable[..., None]]:
    """Return a decorator that adds the options of two spheres of one material, or of a sphere and a wall."""
    radius = "Radius of both spheres; give it twice for two different radii."
    return with_options(
        click.option("--radius", "radii", type=Quantity("length"), multiple=True, help=radius),
        *(
            click.option("--" + name.replace("_", "-"), type=MATERIAL[name][0], help=MATERIAL[name][1])
            for name in names
        ),
        click.option("--wall", is_flag=True, help="One sphere hits a plane wall of the same material."),
    )


def pair_of(
    radii: Sequence[float], wall: bool, yield_strength: float | None = None, **properties: float | None
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
    values: dict[str, Any] = {"dissipative_constant": 0.0} | properties
    spheres = [Sphere(radius=radius, **values) for radius in radii]
    values.pop("density")
    return Pair(spheres[0], Sphere.wall(**values) if wall else spheres[-1])


def pair_with(epsilon: float | None, speed: float, gravity: float | None, **options: Any) -> Pair:
    """Return the pair that `pair_of` describes, with its A, or with the A that gives eps at a speed.

    With gravity the sphere falls on a wall, and eps is the one with its weight.
    """
    from viscopade.collision.weight import calibrated

    pair = pair_of(**options | {"dissipative_constant": options["dissipative_constant"] or 0.0})
    assert pair is not None
    if gravity is not None and not pair.second.is_wall:
        raise click.UsageError(NO_FALL)
    if epsilon is None:
        return pair
    return pair.calibrated(speed, epsilon) if gravity is None else calibrated(pair, speed, epsilon, gravity)


NO_FALL = "--gravity needs a sphere and a plane: expected a material with --wall, or a scene with a wall"
"""Refusal of a weight where no sphere falls on a plane."""


def limits_of(pair: Pair, fastest: float, yield_strength: float | None, adhesion: float | None = None) -> list[str]:
    """Return a sentence for each assumption of the model that a pair, with a work of adhesion, violates at a speed."""
    from viscopade.collision import limits
    from viscopade.collision.adhesion import adhesive

    depth = None if adhesion is None else adhesive(pair, adhesion).collide(fastest).depth
    return list(limits.violations(pair, fastest, yield_strength=yield_strength, depth=depth))


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
        _print_table(header, [[*map(printable, row)] for row in cells], title)


def _print_table(header: Sequence[str], cells: Sequence[Sequence[str]], title: str | None) -> None:
    """Print a table; if it is too wide, with heads and sentences on several lines, or with one line for each cell."""
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
    """Return the least width of a text: sentences need more than their longest word, and long names may be broken."""
    whole = (len(word) if re.search("[0-9]", word) else min(len(word), _READABLE) for word in text.split())
    return max([*whole, min(len(text) // 4, _READABLE)])


def _print_rows(header: Sequence[str], cells: Sequence[Sequence[str]], title: str | None) -> None:
    """Print each cell of a table that is not empty on its own line, after its head."""
    say(title or "")
    for row in cells:
        click.echo()
        for i, (head, text) in enumerate(zip(header, row, strict=True)):
            if text:
                say(f"{'  ' * (i > 0)}{head}: {text}", 4)
    click.echo()


def say(text: str, indent: int = 0) -> None:
    """Print a text; lines break at spaces, but not inside a formula, and all lines but the first are indented."""
    lines = wrapped(text, text_width(), " " * indent, whole_words=True)
    click.echo("\n".join(map(printable, lines)))


def text_width() -> int:
    """Return the width of the terminal on standard output; that of a pipe or a file is 100 columns."""
    if not _is_terminal(sys.stdout):
        return _IN_A_PIPE
    from rich.console import Console

    return max(Console().width, _NARROWEST)


def _is_terminal(stream: TextIO | None) -> bool:
    """Return whether a stream is an open terminal; variables such as FORCE_COLOR do not matter."""
    return stream is not None and not stream.closed and stream.isatty()


def keep_printing() -> None:
    """Set up the output: characters outside its encoding are printed as escapes and raise no error."""
    for stream in (sys.stdout, sys.stderr):
        if isinstance(stream, io.TextIOWrapper) and stream.errors == "strict":
            stream.reconfigure(errors="backslashreplace")


def tracker(steps: Sequence[int], description: str, cost: Cost | None) -> Iterable[int]:
    """Iterate over the steps; if their costs are known and they take long, state the remaining time on standard error.

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
    """Show a progress bar in a `with` block, if standard error is a terminal; the yielded function updates it."""
    if not _is_terminal(sys.stderr):
        yield lambda _: None
        return
    from rich.console import Console
    from rich.progress import BarColumn, Progress, TextColumn, TimeElapsedColumn

    columns = TextColumn("{task.description}"), BarColumn(), TimeElapsedColumn()
    with Progress(*columns, console=Console(stderr=True), transient=True) as progress:
        task = progress.add_task(description, total=total)
        yield lambda done: progress.update(task, completed=done)
