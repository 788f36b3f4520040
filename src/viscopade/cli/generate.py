"""Commands that generate code: export, scene."""

from __future__ import annotations

import shlex
from dataclasses import replace
from pathlib import Path
from typing import TYPE_CHECKING, Any

import click
from click.core import ParameterSource

from viscopade.cli.console import (
    DIGITS,
    ORDER,
    OUTPUT,
    STYLE,
    Command,
    Degrees,
    FilePath,
    OneOf,
    examples,
    option,
    say,
    show,
    write_or_print,
)
from viscopade.cli.writer import check_targets, write_all
from viscopade.kernels.catalogue import SPEEDS, Request
from viscopade.kernels.write.targets import LATEX_DIGITS, SERIES_DIGITS, SERIES_ORDER, TARGETS
from viscopade.shipped import example_scenes

if TYPE_CHECKING:
    from viscopade.scene.description import Scene

_SERIES = ("series-csv", "series-json", "series-latex")
# Other names of languages -> what to type.
_LANGUAGES = {
    **dict.fromkeys(("c++", "cpp", "cxx"), "c, whose headers are C++ headers, too"),
    **dict.fromkeys(("c#", "cs"), "csharp, for C#"),
    "js": "javascript (an ES module), or script",
}
_OTHERS = {name: f"TARGET is {name!r}: expected {meant}" for name, meant in _LANGUAGES.items()}


@click.command(cls=Command, epilog=examples("viscopade export fortran --accuracy 1e-5 --output viscopade.f90"))
@click.argument("target", metavar="TARGET", type=OneOf([*TARGETS, *_SERIES, "version-header"], _OTHERS))
@option(
    "--pade",
    type=Degrees(),
    multiple=True,
    help="Padé approximant, such as 3/6; repeatable.  [default: the four of the paper's table]",
)
@option(
    "--minimax",
    group="Advanced",
    type=Degrees(),
    multiple=True,
    help="Best approximant on the interval from --v-star-min to --v-star-max, such as 1/4; repeatable.",
)
@option(
    "--accuracy",
    multiple=True,
    help="Largest proven error, such as 1e-5; repeatable. The smallest kernel for all v* >= 0 is selected; with "
    "--v-star-max, the cheapest best approximant on the interval.",
)
@option("--inverse", multiple=True, help="Largest proven relative error of a kernel for v*(eps); repeatable.")
@option("--v-star-max", group="Advanced", help="Largest v* of the interval, for --minimax and --accuracy.")
@option(
    "--v-star-min",
    group="Advanced",
    default="0",
    show_default=True,
    help="Smallest v* of the interval, for --minimax and --accuracy.",
)
@option("--full", is_flag=True, help="Kernels that are accurate to the last digit, from v*, in C.")
@option(
    "--from-speed",
    type=click.Choice(SPEEDS),
    multiple=True,
    help="Accuracy of a kernel from speed and beta to eps, in C, with a table instead of a root. The table for 5e-6 is "
    "the smallest; the kernel for 1e-5 is faster.",
)
@option(
    "--order",
    group="Output",
    type=ORDER,
    default=SERIES_ORDER,
    show_default=True,
    help=f"Highest power of v*, for {', '.join(_SERIES)}.",
)
@option(
    "--digits",
    group="Output",
    type=DIGITS,
    help=f"Significant digits, for latex, {', '.join(_SERIES)}.  "
    f"[default: {LATEX_DIGITS} for latex, else {SERIES_DIGITS}]",
)
@OUTPUT
def export(target: str, order: int, digits: int | None, output: Path | None, **of_kernels: Any) -> None:
    """Generate code or tables of proven kernels.

    A kernel is a fast formula for eps, or for v*(eps), with a proven error bound. TARGET is a language or a table.
    Without options the file has

    \b
    - the paper's approximants: c, python, csv, json, latex, certificates,
      vectors;
    - kernels for all v* >= 0: cuda, arrays, fortran, rust, julia, javascript,
      script, warp, csharp;
    - the coefficients h_k: series-csv, series-json, series-latex;
    - the version: version-header, for C.

    An existing file is replaced only if viscopade generated it.
    """  # noqa: D301
    from viscopade.kernels import requests

    # The options that change something in this target's file; others are refused if they are typed.
    of_series = target.startswith("series-")
    used = {"order", "digits"} if of_series else set() if target == "version-header" else {*of_kernels}
    used |= {"digits"} if target == "latex" else set()
    _refuse_unused(target, used | {"target", "output"})
    # Without --digits, 50 digits of a series, and in LaTeX 15, those of a double: choices, as the help says.
    if of_series:
        text = requests.render_series(target.removeprefix("series-"), order, digits or SERIES_DIGITS)
    elif target == "version-header":
        text = requests.file(requests.VERSION_HEADER)
    else:
        # Without options, the target's own kernels.
        request = Request(**of_kernels)
        request = requests.default(target) if request == Request() else request
        text = requests.render(replace(request, digits=digits or LATEX_DIGITS), target)
    write_or_print(text, output)


def _refuse_unused(target: str, used: set[str]) -> None:
    """Refuse options that would change nothing in a target's file; `used` has the names of those that do."""
    # Options with a default always have a value: what counts is whether the user typed it.
    # From an option's name to its flag, such as "--v-star-max".
    context = click.get_current_context()
    flags = {str(option.name): option.opts[-1] for option in context.command.params}
    for name, flag in flags.items():
        if name not in used and context.get_parameter_source(name) is ParameterSource.COMMANDLINE:
            others = ", ".join(flags[other] for other in flags if other in used - {"target"})
            raise click.UsageError(f"{flag} changes nothing in {target}: expected {others}")


@click.command("scene", cls=Command, epilog=examples("viscopade scene --example ice_rings --out ."))
@click.argument("file", type=FilePath(), required=False)
@option(
    "--example",
    metavar="NAME",
    shell_complete=lambda _context, _option, start: [name for name in example_scenes() if name.startswith(start)],
    help="Use an example scene, such as ice_rings, instead of FILE.",
)
@option("--out", type=FilePath(), help="Directory for the generated file.")
@option(
    "--check/--no-check",
    "checking",
    default=True,
    help="Compile and run the generated code, if its compiler or interpreter is installed, and compare its results "
    "with the exact eps.  [default: check]",
)
@option("--cc", help="C compiler for the check.  [default: CC of the environment, or cc]")
@STYLE
def scene_command(
    file: Path | None,
    example: str | None,
    out: Path | None,
    checking: bool,
    cc: str | None,
    style: str,
) -> None:
    """Find the cheapest kernel within a scene's tolerance.

    FILE is a scene in TOML: materials, bodies, speeds, tolerance and language. docs/usage/scenes.md lists its keys, and
    `viscopade --examples-dir` prints a folder with examples. --out writes the code of the kernel.
    """
    from viscopade.scene import check as run
    from viscopade.scene import choice, render, tables

    # The scene is a file or an example; `words` is how the command in the head of the code begins.
    if (file is None) == (example is None):
        raise click.UsageError("expected a scene: either FILE, or --example NAME")
    if example is not None and example not in example_scenes():
        raise click.UsageError(f"there is no example scene {example!r}: expected {', '.join(example_scenes())}")
    words, source = ("", file) if file is not None else ("--example ", example_scenes()[str(example)])
    scene = read_scene(source)
    if cc is not None and not (checking and scene.code.spoken.run.variable == "CC"):
        raise click.UsageError("--cc is given, but no C compiler is needed: expected --cc with the check of code in C")
    if out is not None:
        check_targets([out / render.file_name(scene)], parents=True)
    # Choose the cheapest kernel. Make the code only if it is written or checked; the verdict says whether its results
    # are right.
    kernel_choice = choice.choose(scene)
    verdict = text = None
    if out is not None or checking:
        text = render.render(kernel_choice, f"viscopade scene {words}{example or shlex.quote(source.name)} --out .")
    if checking and text is not None:
        verdict = run.check_code(kernel_choice, text, cc)
    if out is not None and text is not None:
        write_all({out / render.file_name(scene): text}, parents=True)

    # CSV has the table of kernels; as text a table of the pairs of bodies stands before it.
    if style != "text":
        show(style, tables.KERNELS, tables.kernel_rows(kernel_choice), tables.to_json(kernel_choice, verdict))
        return
    say(tables.summary(kernel_choice))
    show(style, tables.PAIRS, tables.pairs(kernel_choice), {}, title=scene.title)
    show(style, tables.KERNELS, tables.kernel_rows(kernel_choice), {}, title="Kernels, operations; errors are proven")
    for line in tables.sentences(kernel_choice):
        say(line)
    if verdict is not None:
        say(tables.check_sentence(verdict))
    if out is not None:
        say(f"wrote {render.file_name(scene)} to {out}")


def read_scene(file: Path) -> Scene:
    """Return the scene that a TOML file describes."""
    from viscopade import files
    from viscopade.scene.read import from_toml

    return from_toml(files.content(file, "a scene in TOML (docs/usage/scenes.md)"), str(file))


COMMANDS = (export, scene_command)
