"""Common parts of the commands: types of arguments, tables on standard output, progress on standard error."""

from __future__ import annotations

import csv
import io
import json
import re
import shlex
import sys
from collections import Counter
from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
from contextlib import contextmanager
from decimal import Context, Decimal
from fractions import Fraction
from functools import partial, reduce
from pathlib import Path
from time import monotonic
from typing import TYPE_CHECKING, Any, TextIO

import click

from viscopade import arguments
from viscopade.cli.writer import check_targets, write
from viscopade.generated import printable, wrapped
from viscopade.theory.law import ACCEPTED_LAWS, ENDS, VISCOELASTIC

FIRST_SECONDS, LONG_SECONDS = 1.0, 60.0
"""Seconds after which `tracker` estimates the duration of a loop, and the remaining seconds that a message is worth.

Both are chosen by hand: a second holds enough steps to measure their speed, and nobody needs a message for a minute.
"""

if TYPE_CHECKING:
    from viscopade.collision.spheres import Pair
    from viscopade.plots.sheet import Page
    from viscopade.progress import Cost
    from viscopade.theory.law import Law

    _Integer = click.ParamType[int]
    _Number = click.ParamType[float]
    _Pair = click.ParamType[tuple[int, int]]
else:  # before Click 8.4 it takes no type
    _Integer = _Number = _Pair = click.ParamType


def examples(*lines: str) -> str:
    """Return command lines as the end of a command's help."""
    # A backspace alone on a line tells Click not to join and break the lines of the paragraph.
    shown = "\n".join(f"  {line}" for line in lines)
    return f"\b\n{'Examples' if len(lines) > 1 else 'Example'}:\n{shown}"


def _name(param: click.Parameter | None) -> str:
    """Return how a refusal names an option (its longest flag, "--output"), or an argument ("TARGET")."""
    assert param is not None
    if isinstance(param, click.Argument):
        return (param.metavar or param.human_readable_name).strip("[]").upper()
    return max(param.opts, key=len)


GROUPS = ("Options", "Material", "Other laws", "Output", "Advanced")
"""Headings of options in a help, in the order in which they stand there; the first one has the common options."""
# Chosen by hand: so few options (with --help) are read at a glance and stand under one heading. In a line of 80
# characters the names get 26, in which all of ours but the three longest fit, and the sentences the rest.
_FEW, _NAMES_WIDTH = 8, 26


class Option(click.Option):
    """An option of a command; `group` is its heading in the help, one of `GROUPS`."""

    def __init__(self, *names: Any, group: str = GROUPS[0], **settings: Any) -> None:
        super().__init__(*names, **settings)
        self.group = group


option = partial(click.option, cls=Option)
"""The decorator that adds an `Option` to a command: `option("--law", group="Other laws", help="…")`."""


class Command(click.Command):
    """A command whose help has its options under the headings of `GROUPS`, in the order in which they were added.

    An option that is not repeatable is refused if it is typed twice: Click would take the last one in silence.
    """

    def parse_args(self, ctx: click.Context, args: list[str]) -> list[str]:
        """Parse the typed words `args` into the context of this command."""
        # `order` has each typed parameter once for each time.
        _, _, order = self.make_parser(ctx).parse_args([*args])
        for param, number in Counter(order).items():
            if isinstance(param, click.Option) and number > 1 and not (param.multiple or param.is_flag or param.count):
                raise click.UsageError(f"{_name(param)} is typed {number} times: expected it once", ctx)
        return super().parse_args(ctx, args)

    def format_options(self, ctx: click.Context, formatter: click.HelpFormatter) -> None:
        """Write the options into the help, whose text `formatter` collects; `ctx` is the context of this command."""
        # From a heading to rows (names, sentence). Click itself makes --help, which has no group.
        rows: dict[str, list[tuple[str, str]]] = {group: [] for group in GROUPS}
        for param in self.get_params(ctx):
            if isinstance(param, click.Option) and (row := param.get_help_record(ctx)):
                rows[getattr(param, "group", GROUPS[0])].append(row)
        every_row = [row for group in GROUPS for row in rows[group]]
        headings = {GROUPS[0]: every_row} if len(every_row) <= _FEW else rows
        # Names are filled up to one width, so that the sentences under all headings begin in one column.
        width = min(max(len(names) for names, _ in every_row), _NAMES_WIDTH)
        for heading, rows_below in headings.items():
            if rows_below:
                with formatter.section(heading):
                    formatter.write_dl([(names.ljust(width), text) for names, text in rows_below], col_max=width)


class OneOf(click.Choice[str]):
    """Type of an argument: one of several names in any case; a refusal names those that look like the typed one.

    `others` has further names, with the sentence that refuses each.
    """

    def __init__(self, choices: Iterable[str], others: Mapping[str, str] | None = None) -> None:
        super().__init__([*choices])
        self.others = others or {}

    def convert(self, value: Any, param: click.Parameter | None, ctx: click.Context | None) -> str:
        """Return the typed name in lower case.

        `value` is the typed text, `param` the argument and `ctx` the running command; Click passes them.
        """
        # A name of `others` has its own sentence; any other wrong name has the names that look like it, or else all.
        name = str(value).lower()
        if name in self.others:
            raise click.UsageError(self.others[name])
        if name not in self.choices:
            listed = ", ".join(self.choices)
            near = arguments.suggestion(name, self.choices)  # ": did you mean …?", or "" if no name looks like it
            raise click.UsageError(f"{_name(param)} is {value!r}{near or f': expected {listed}'}")
        return name


class Whole(_Integer):
    """Type of an option: an integer from `low` to `high`."""

    name = "integer"

    def __init__(self, low: int, high: int) -> None:
        self.low, self.high = low, high

    def convert(self, value: Any, param: click.Parameter | None, ctx: click.Context | None) -> int:
        """Return an integer from decimal digits with an optional sign.

        `value` is the typed text, or an integer as a default; `param` is the option and `ctx` the running command.
        """
        # int() alone would also take blanks, underscores and digits of other scripts. 18 digits exceed every range
        # here; a longer text stays one, and is refused below in our own words (int() has others beyond 4300 digits).
        if isinstance(value, str) and re.fullmatch(r"[+-]?[0-9]{1,18}", value):
            value = int(value)
        if isinstance(value, str):
            raise ValueError(f"{_name(param)} is {value!r}: expected an integer from {self.low} to {self.high}")
        return arguments.integer(_name(param), value, self.low, self.high)


# The largest double is 1.8e308: a number below 1e300 is a finite double, also after a conversion of its unit.
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
        """Return the double nearest to the typed decimal `value`; `param` is the option, `ctx` the running command."""
        if isinstance(value, float):  # already converted: Click converts a default and a prompt again
            return value
        # The condition is checked on the exact decimal, before it is rounded: 1e-400 > 0 holds.
        accepted = f"a finite decimal number{self.condition}"
        return float(arguments.exact_number(_name(param), value, accepted, _CONDITIONS[self.condition]))


class Quantity(_Number):
    """Type of an option: a number with a unit, or a plain one in SI units.

    It becomes a double in SI units, or with `exact` a decimal string. `dimension` is a key of
    `viscopade.quantity.DIMENSIONS`, such as "length", and `condition` one of `_CONDITIONS`.
    """

    name = "quantity"

    def __init__(self, dimension: str, condition: str = "", *, exact: bool = False) -> None:
        self.dimension, self.condition, self.exact = dimension, condition, exact

    def decimal(self, value: str, name: str) -> str:
        """Return the number of the typed text `value` in SI units as an exact decimal; `name` is that of the option.

        Raises
        ------
        ValueError
            If the text is neither a number nor a quantity of this dimension, or does not meet the condition.
        """
        from viscopade import quantity

        # A plain number is in SI units already, and so is a plain fraction, 1/60. Other texts have a unit; None says
        # that the unit does not fit.
        unit, example = quantity.DIMENSIONS[self.dimension]
        try:
            arguments.exact_number(name, value, "", lambda _: True)
            in_si: str | None = value
        except ValueError:
            is_plain = re.fullmatch(r"[0-9]+/[0-9]+", value.strip())
            in_si = quantity.si_decimal(f"{value} {unit}" if is_plain else value, self.dimension)
        if in_si is None or not _CONDITIONS[self.condition](Fraction(in_si)):
            # 2.5 stands for any number.
            article = "an" if self.dimension[0] in "aeiou" else "a"
            expected = f'{article} {self.dimension}{self.condition}, such as "2.5 {example}", or a number in {unit}'
            raise ValueError(arguments.refusal(name, value, expected))
        return in_si

    def convert(self, value: Any, param: click.Parameter | None, ctx: click.Context | None) -> Any:
        """Return the quantity of the typed `value` in SI units, as a double or (`exact`) as a decimal string.

        `param` is the option and `ctx` the running command.
        """
        if isinstance(value, float):  # already converted
            return value
        decimal = self.decimal(value, _name(param))
        return decimal if self.exact else float(decimal)


class Degrees(_Pair):
    """Type of an option: the degrees [m/n] of an approximant, written M/N."""

    name = "M/N"

    def convert(self, value: Any, param: click.Parameter | None, ctx: click.Context | None) -> tuple[int, int]:
        """Return (m, n) of a typed `value` such as "3/6"; `param` is the option and `ctx` the running command."""
        if isinstance(value, tuple):  # already converted
            return value
        # Three digits write every degree up to MAX_DEGREE = 200. Any other text becomes a degree that is refused.
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
# Widths are in characters, and chosen by hand; a change moves line breaks and no number.
_ENDLESS = 1_000_000  # wider than any table: Rich then measures a table without folding it
_IN_A_PIPE = 100  # of text in a pipe or a file, as of generated files (`viscopade.generated.WIDTH`)
_READABLE = 24  # of a sentence on several lines, about four words, and of a name without digits, which may be broken
_NARROWEST = 20  # of a line, also on a narrower terminal: one of our longer words

ORDER = Whole(0, arguments.MAX_ORDER)
DIGITS = Whole(1, arguments.MAX_DIGITS)


def style_option(*further: str) -> Callable[..., Any]:
    """Return the option --format, whose value is the `style` of `show`; `further` are formats beside the usual ones."""
    return option(
        "--format",
        "style",
        group="Output",
        type=click.Choice(["text", "json", "csv", *further]),
        default="text",
        show_default=True,
        help="Format of the output.",
    )


STYLE = style_option()
STYLE_OR_LATEX = style_option("latex")
# Both are chosen by hand: 6 digits are read at a glance, and 30 are more than a double has (17).
TEXT_DIGITS, ALL_DIGITS = 6, 30
DIGITS_OPTION = option(
    "--digits",
    group="Output",
    type=DIGITS,
    help=f"Significant digits.  [default: {ALL_DIGITS} in JSON and CSV, else {TEXT_DIGITS}]",
)


def _checked_output(_context: click.Context, _: click.Parameter, path: Path | None) -> Path | None:
    """Return the file to write, None for "-"; refuse one that cannot be written, before the work."""
    if path is None or path == Path("-"):
        return None
    check_targets([path])
    return path


def output_option(default: str = "-") -> Callable[..., Any]:
    """Return the option -o, --output, that says where `write_or_print` writes; "-" is the standard output."""
    place = "-, the standard output" if default == "-" else f"{default}; - is the standard output"
    return option(
        "-o",
        "--output",
        group="Output",
        type=FilePath(),
        default=default,
        callback=_checked_output,  # `command_line` recognises the option by it
        help=f"File to write.  [default: {place}]",
    )


OUTPUT = output_option()


WORDS = "viscopade.words"
"""Key of the words of the command line in a context."""


def typed_text(name: str) -> str | None:
    """Return what was typed for an option of the running command that is not repeatable; None if it was not typed.

    `name` is that of the option's argument, such as "slowest" for --from.
    """
    context = click.get_current_context()
    typed, _, _ = context.command.make_parser(context).parse_args([*context.meta[WORDS][1:]])
    return typed[name] if isinstance(typed.get(name), str) else None


def check_units_of_beta(beta: str, **speeds: str) -> None:
    """Refuse a beta with a unit beside a speed without one, and the reverse: one of them may be meant in another unit.

    The paper's beta of ice, 1.307, is in (s/cm)^(1/5): read in SI units, it gives 0.584 at 1 cm/s, and not 0.318.

    Parameters
    ----------
    beta : str
        As it was typed.
    **speeds : str
        Names of the arguments of the options that have speeds, and their flags.

    Raises
    ------
    click.UsageError
    """
    from viscopade import quantity

    with_unit = quantity.beta_decimal(beta) is not None
    # What is no beta at all, such as "1.3 s/cm", is refused as such where it is read.
    if not with_unit and quantity.unit_of(beta):
        return
    for name, flag in speeds.items():
        speed = typed_text(name)
        if speed is not None and bool(quantity.unit_of(speed)) != with_unit:
            number, units = (speed, ("cm/s", "m/s")) if with_unit else (beta, ("(s/cm)^(1/5)", "(s/m)^(1/5)"))
            either = " or ".join(f'"{number} {unit}"' for unit in units)
            raise click.UsageError(
                f"--beta is {beta!r} and {flag} is {speed!r}: expected a unit for both or for neither, such as {either}"
            )


def command_line() -> str:
    """Return the running command for the heads of its files: pasted into a shell, it makes the same files.

    Files are named without their folders. The option of `output_option` is left out: the text does not depend on it.
    """
    # Parse the typed words again, without conversion. `order` has an option or argument once for each time it was
    # typed; `values` has by name its text, a tuple of texts, or True or False for a flag; of a repeated option a list.
    context = click.get_current_context()
    name, *words = context.meta[WORDS]
    values, _, order = context.command.make_parser(context).parse_args(list(words))
    values_left = {param: values[str(param.name)] for param in order}
    line = ["viscopade", name]
    for param in sorted(order, key=lambda param: isinstance(param, click.Option)):  # arguments come first
        # A repeated option stands in `order` as often as it has values: take the next one.
        value = values_left[param]
        if param.multiple:
            value, values_left[param] = value[0], value[1:]
        # Leave out the file to write, and an optional argument that was not typed.
        if param.callback is _checked_output or not isinstance(value, (str, bool, tuple)):
            continue
        # A flag has no text, and --no-… is the second name of one that is False; the longest name reads best.
        texts = [value] if isinstance(value, str) else [] if isinstance(value, bool) else value
        if isinstance(param, click.Option):
            line.append(max(param.secondary_opts if value is False else param.opts, key=len))
        line += (Path(text).name or text if isinstance(param.type, click.Path) else text for text in texts)
    return shlex.join(line)


def write_or_print(text: str, output: Path | None) -> None:
    """Write generated text to the file that an option names, or else to the standard output."""
    if output is None:
        click.echo(text, nl=False)
    else:
        write(output, text)


def law_words(law: Law) -> tuple[dict[str, Any], str]:
    """Return a law as JSON fields, and as a line if it is not the paper's.

    Here kappa, the damping of the scaled equation, grows with the speed as v^(2/nu - 1), and eps is a power series in
    v* = kappa^(1/d); for the paper's law nu = 5/3 and d = 2.
    """
    fields = {"law": str(law), "end": law.end, "nu": str(law.nu), "d": law.d}
    if law == VISCOELASTIC:
        return fields, ""
    end = "where the force vanishes" if law.end == "force" else "at x = 0"
    variable = "v* = kappa" if law.d == 1 else f"v* = kappa^(1/{law.d})"
    line = f"law {law}: {law.equation}, nu = {law.nu}; {variable}; contact ends {end}"
    return fields, line


def with_options(*options: Callable[..., Any]) -> Callable[[Callable[..., None]], Callable[..., None]]:
    """Return a decorator that adds options to a command; its help lists them in this order."""
    # Click lists the decorator that is applied last first.
    return lambda command: reduce(lambda decorated, option: option(decorated), reversed(options), command)


LAW = option(
    "--law",
    group="Other laws",
    default="viscoelastic",
    show_default=True,
    metavar="NAME|A,B",
    help=f"Law of contact x'' + x^A + kappa x^B x' = 0: {ACCEPTED_LAWS}.",
)
WITH_LAW = with_options(
    LAW,
    option(
        "--end",
        group="Other laws",
        type=click.Choice(ENDS),
        help="End of contact: where the force vanishes, or at x = 0.  [default: force]",
    ),
)
"""The options of `viscopade.theory.law.law_of`."""
GRAVITY = option(
    "--gravity",
    group="Advanced",
    type=Quantity("acceleration", " >= 0"),
    help="Include the weight of a body that falls on a plane.",
)
ADHESION = option(
    "--adhesion",
    group="Advanced",
    type=Quantity("energy per area", " > 0"),
    metavar="QUANTITY",
    help="Work of adhesion of the material's surfaces, twice its surface energy, in J/m^2.",
)


class _Length(Quantity):
    """Type of an option that takes two lengths: what begins with a minus is the next option."""

    def convert(self, value: Any, param: click.Parameter | None, ctx: click.Context | None) -> Any:
        """Return a length in m from a typed `value`; Click also passes the option `param` and the command `ctx`."""
        if str(value).startswith("-"):
            raise click.UsageError("--size needs two lengths, such as '8.6 cm' '6 cm'")
        return super().convert(value, param, ctx)


TITLE = option("--title", group="Output", help='Title above the picture; "" for none.')
SIZE = with_options(
    option(
        "--size",
        group="Output",
        type=_Length("length"),
        nargs=2,
        help="Width and height of a picture, such as '8.6 cm' '6 cm'.",
    ),
    # 8.5 points are `axes.labelsize` of all our pictures (`viscopade.plots.sheet.STYLE`).
    option(
        "--font-size",
        group="Output",
        type=Real(),
        help="Font size of the axes' labels in points; the other letters follow in proportion.  [default: 8.5]",
    ),
)
"""Options that fit a picture to a page, --size and --font-size; `page_of` takes their values."""

EFFECTIVE_MASS = option(
    "--mass", group="Advanced", type=Quantity("mass", " > 0"), help="Effective mass, m1 m2/(m1 + m2)."
)

MATERIAL = {
    "young_modulus": ("Material", Quantity("pressure"), "Young modulus of the material."),
    "poisson_ratio": ("Material", Real(), "Poisson ratio of the material, > -1 and <= 0.5."),
    "density": ("Material", Quantity("density"), "Density of the material."),
    "dissipative_constant": ("Material", Quantity("time"), "Dissipative constant A of the material."),
    "yield_strength": ("Advanced", Quantity("pressure"), "Yield strength of the material, only for a warning."),
}
"""Group, type and help of each option."""


def material(
    *names: str,
    radius: str = "Radius of both spheres; typed twice, their two radii.",
    wall: str = "One sphere hits a plane wall of the same material.",
) -> Callable[[Callable[..., None]], Callable[..., None]]:
    """Return a decorator that adds the options of two spheres of one material, or of a sphere and a wall.

    `names` are the keys of `MATERIAL` that the command takes; `radius` and `wall` are the helps of these options.
    `pair_of` reads the options.
    """
    return with_options(
        option("--radius", "radii", group="Material", type=Quantity("length"), multiple=True, help=radius),
        *(
            option("--" + name.replace("_", "-"), group=group, type=kind, help=text)
            for name, (group, kind, text) in ((name, MATERIAL[name]) for name in names)
        ),
        option("--wall", group="Material", is_flag=True, help=wall),
    )


def pair_of(
    radii: Sequence[float], wall: bool, yield_strength: float | None = None, **properties: float | None
) -> Pair | None:
    """Return the pair of bodies that the options describe, or None if no option is given.

    Parameters
    ----------
    radii : sequence of float
        Radii of the spheres, in m: one for two equal spheres.
    wall : bool
        Whether the second body is a plane wall of the same material.
    yield_strength : float, optional
        Only shows that a material is meant.
    **properties : float or None
        Arguments of `Sphere` in SI units, None where an option is missing; without dissipative_constant it is 0.

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
    # Two bodies have two radii, a sphere and a wall one (`wall` counts as 1).
    if len(radii) > 2 - wall:
        raise click.UsageError(f"--radius is given {len(radii)} times: expected once or twice, and once with --wall")
    # A wall has no density: its mass is infinite. One radius is that of both spheres.
    values: dict[str, Any] = {"dissipative_constant": 0.0} | properties
    spheres = [Sphere(radius=radius, **values) for radius in radii]
    values.pop("density")
    return Pair(spheres[0], Sphere.wall(**values) if wall else spheres[-1])


def pair_with(epsilon: float | None, speed: float, gravity: float | None, **options: Any) -> Pair:
    """Return the pair that `pair_of` describes, with its A, or with the A that gives `epsilon` at `speed` (m/s).

    With `gravity` (m/s^2) the sphere falls on a wall, and eps is the one with its weight. `options` are those of
    `pair_of`, dissipative_constant among them; it is None with `epsilon`.
    """
    from viscopade.collision.weight import calibrated

    # With eps the pair has no damping (A = 0) until it is calibrated.
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


_DECIMAL = r"[+-]?[0-9]*\.?[0-9]+(e[+-]?[0-9]+)?"  # a number as Python and our balls print it


def figures(text: str, digits: int) -> str:
    """Return the decimal number in a text, rounded to significant digits; a text without a number stays, as "inf"."""
    if not re.fullmatch(_DECIMAL, text):
        return text
    # An exponent stays, as e-6. A large number gets one if it is rounded, to show no digits that are not known.
    number = Context(prec=digits).create_decimal(text)
    return f"{number:e}" if "e" in text or (number != Decimal(text) and number.adjusted() >= digits) else f"{number:f}"


def page_of(title: str | None, size: tuple[float, float] | None, font_size: float | None) -> Page:
    """Return the page of a picture, from the typed options --title, --size (width and height in m) and --font-size.

    None stands for an option that is not typed: no title, the drawing's own size, labels of 8.5 points.

    Raises
    ------
    ValueError
        If width or height is not from 2 cm to 2 m, or the font size not from 3 to 72 points.
    """
    from viscopade.plots import sheet

    # Below 2 cm the labels leave no room for the axes, and above 2 m a unit is probably missing (chosen by hand).
    if size is not None and not 0.02 <= min(size) <= max(size) <= 2:
        raise ValueError(f"size is {size[0]:g} m, {size[1]:g} m: expected width and height from 2 cm to 2 m")
    # 3 points can just be read, and 72 points are an inch (chosen by hand).
    if font_size is not None and not 3 <= font_size <= 72:
        raise ValueError(f"font-size is {font_size:g}: expected 3 to 72 points")
    inches = None if size is None else (float(size[0]) / 0.0254, float(size[1]) / 0.0254)  # an inch is 0.0254 m
    return sheet.Page(title, inches, sheet.STYLE["axes.labelsize"] if font_size is None else float(font_size))


def show(
    style: str,
    header: Sequence[str],
    rows: Iterable[Sequence[object]],
    json_object: dict[str, Any],
    title: str | None = None,
) -> None:
    """Print a table as text, CSV or LaTeX, or `json_object` as JSON, in the format `style`: text, csv, latex or json.

    `header` names the columns of `rows`; `title` stands above the table, as text only.
    """
    cells = [[str(cell) for cell in row] for row in rows]
    if style == "json":
        click.echo(json.dumps(json_object, ensure_ascii=False))
    elif style == "csv":
        buffer = io.StringIO()
        csv.writer(buffer, lineterminator="\n").writerows([header, *cells])
        click.echo(buffer.getvalue(), nl=False)
    elif style == "latex":
        heads, *lines = (" & ".join(map(_latex, row)) + r" \\" for row in [header, *cells])
        click.echo(
            "\n".join([rf"\begin{{tabular}}{{{'r' * len(header)}}}", heads, r"\hline", *lines, r"\end{tabular}"])
        )
    else:
        # A terminal would obey invisible characters of a user's text: it gets escapes.
        _print_table(header, [[*map(printable, row)] for row in cells], title)


# Symbols among the heads of columns, and the characters that LaTeX obeys in a text, as it prints them.
_SYMBOLS = {"k": "$k$", "h_k": "$h_k$", "v*": r"$v_\ast$", "eps": r"$\varepsilon$"}
_ESCAPES = str.maketrans(
    {character: rf"\{character}" for character in "&%$#_{}"}
    | {"\\": r"\textbackslash{}", "~": r"\textasciitilde{}", "^": r"\textasciicircum{}"}
)


def _latex(text: str) -> str:
    """Return a cell of a table in LaTeX: a decimal number or a symbol as a formula, another text with escapes."""
    from viscopade.kernels.write.tables import latex_number

    if re.fullmatch(_DECIMAL, text):
        # A number with all of its digits: those that are not known do not become zeros, as in 1.2e+06.
        return f"${latex_number(text, len(Decimal(text).as_tuple().digits))}$"
    return _SYMBOLS.get(text) or printable(text).translate(_ESCAPES)


def say_below(style: str, text: str) -> None:
    """Print a sentence below a table that `show` printed: as text, or in LaTeX as a comment; not in CSV and JSON."""
    if style == "text":
        say(text)
    elif style == "latex":
        click.echo("\n".join(f"% {printable(line)}" for line in wrapped(text, _IN_A_PIPE, "", whole_words=True)))


def _print_table(header: Sequence[str], cells: Sequence[Sequence[str]], title: str | None) -> None:
    """Print a table; if it is too wide, with heads and sentences on several lines, or with one line for each cell.

    `header` has a head for each column, `cells` the texts of each row.
    """
    from rich import box
    from rich.console import Console
    from rich.table import Table

    table = Table(*header, box=box.SIMPLE_HEAD, title=title, title_justify="left")
    for row in cells:
        table.add_row(*row)
    console = Console(width=_ENDLESS, color_system=None, force_terminal=False, markup=False, highlight=False)
    width = text_width()
    if console.measure(table).maximum > width:
        # The table is too wide. Take a character at a time from the widest column that can still be narrower, until
        # the table fits. Beside its text a column takes 2 characters: a blank of padding and one of the frame.
        columns = list(zip(header, *cells, strict=True))
        least = [max(map(_least_width, texts)) for texts in columns]
        widths = [max(map(len, texts)) for texts in columns]
        while sum(widths) + 2 * len(columns) > width and widths != least:
            _, widest = max((present, i) for i, present in enumerate(widths) if present > least[i])
            widths[widest] -= 1
        # Padding (top, right, bottom, left): one blank to the right of each column but the last.
        table.padding, table.pad_edge = (0, 1, 0, 0), False
        for column, narrow in zip(table.columns, widths, strict=True):
            column.width, column.overflow = narrow, "fold"
        # Still too wide: a line for each cell, after its head, if these lines are shorter.
        in_rows = max(len(columns[i][0]) + narrow for i, narrow in enumerate(least))
        if sum(widths) + 2 * len(columns) > width > in_rows:
            _print_rows(header, cells, title)
            return
    # Rich fills lines with blanks up to the width; they go.
    with console.capture() as capture:
        console.print(table)
    click.echo("\n".join(line.rstrip() for line in capture.get().splitlines()))


def _least_width(text: str) -> int:
    """Return the least width of a text: sentences need more than their longest word, and long names may be broken."""
    # A number is never broken, a long name is. A sentence has up to four lines, a long one more of 24 characters.
    unbroken = (len(word) if re.search("[0-9]", word) else min(len(word), _READABLE) for word in text.split())
    return max([*unbroken, min(len(text) // 4, _READABLE)])


def _print_rows(header: Sequence[str], cells: Sequence[Sequence[str]], title: str | None) -> None:
    """Print each cell of a table that is not empty on its own line, after its head.

    `header` has a head for each column, `cells` the texts of each row; a blank line separates the rows.
    """
    say(title or "")
    for row in cells:
        click.echo()
        # All cells but the first of a row are indented by 2, and further lines of a cell by 4, to tell them apart.
        for i, (head, text) in enumerate(zip(header, row, strict=True)):
            if text:
                say(f"{'  ' * (i > 0)}{head}: {text}", 4)
    click.echo()


def say(text: str, indent: int = 0) -> None:
    """Print a text; lines break at spaces, but not inside a formula.

    All lines but the first are indented by `indent` blanks.
    """
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

    `cost` gives a step's duration in any unit; `description` names the loop. If standard error is a terminal, a
    progress bar is shown, which disappears at the end.
    """
    # Without `cost` all steps count 1 in the bar, and no time is stated, as if this were done already.
    costs = [1.0 if cost is None else cost(step) for step in steps]
    total, done, is_stated, begin = sum(costs), 0.0, cost is None, monotonic()
    with _bar(description, total) as advance:
        for step, cost_of_step in zip(steps, costs, strict=True):
            yield step
            done += cost_of_step
            advance(done)
            # The rest takes as long per unit of cost as the steps that are done.
            elapsed = monotonic() - begin
            remaining = elapsed * (total - done) / done
            if not is_stated and elapsed > FIRST_SECONDS and remaining > LONG_SECONDS:
                click.echo(f"viscopade: {description}: about {max(round(remaining / 60), 1)} min", err=True)
                is_stated = True


@contextmanager
def _bar(description: str, total: float) -> Iterator[Callable[[float], None]]:
    """Show a progress bar in a `with` block, if standard error is a terminal; the yielded function updates it.

    That function takes the cost of all steps that are done, in units of `total`; `description` stands left of the bar.
    """
    if not _is_terminal(sys.stderr):
        yield lambda _: None
        return
    from rich.console import Console
    from rich.progress import BarColumn, Progress, TextColumn, TimeElapsedColumn

    # A transient bar disappears at the end: standard error keeps only messages.
    columns = TextColumn("{task.description}"), BarColumn(), TimeElapsedColumn()
    with Progress(*columns, console=Console(stderr=True), transient=True) as progress:
        task = progress.add_task(description, total=total)
        yield lambda done: progress.update(task, completed=done)
