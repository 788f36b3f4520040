"""Command that prints the eps of programs and formulas: audit."""

from __future__ import annotations

import os
from collections.abc import Mapping
from contextlib import suppress
from pathlib import Path
from typing import Any

import click
from click.shell_completion import CompletionItem

from viscopade import arguments
from viscopade.cli.audit_contact import show_contact
from viscopade.cli.audit_deck import DECKS, show_deck
from viscopade.cli.audit_formulas import show_formulas
from viscopade.cli.console import STYLE, Command, OneOf, Quantity, Real, examples, option
from viscopade.simulators import OTHER_NAMES, SIMULATORS
from viscopade.theory.law import ENDS

_NOTHING = (None, False, ())
"""Values of an option that is not typed: of one with a value, of a flag, of a repeatable one."""


class _SimulatorOrFile(OneOf):
    """Type of an argument: the name of a simulator, or a file that is there."""

    def convert(self, value: Any, param: click.Parameter | None, ctx: click.Context | None) -> Any:
        """Return the simulator's name in lower case, or the path of a file.

        `value` is the typed text; Click also passes the argument `param` and the running command `ctx`.
        """
        name = str(value)
        if name.lower() not in self.choices and os.path.exists(name):  # pathlib raises for long names
            return Path(name)
        if name.lower() in (*self.choices, *self.others):
            return super().convert(value, param, ctx)
        # Neither a program nor a file: name the programs, and the files beside it, that look like it.
        (folder, file), beside = os.path.split(name), list[str]()
        with suppress(OSError, ValueError):
            beside = os.listdir(folder or ".")
        near = arguments.suggestion(file, beside) or arguments.suggestion(name.lower(), self.choices)
        accepted = f": expected {DECKS}, or a program, such as {', '.join(self.choices[:3])} (viscopade audit has all)"
        raise click.UsageError(f"there is no file and no program {name!r}{near or accepted}")

    def shell_complete(self, ctx: click.Context, param: click.Parameter, incomplete: str) -> list[CompletionItem]:
        """Return the names, and leave files to the shell."""
        return [*super().shell_complete(ctx, param, incomplete), CompletionItem(incomplete, type="file")]


_MEANT = {
    name: f"simulator is {name!r}: did you mean {meant}?"
    for meant, names in OTHER_NAMES.items()
    for name in names.split()
}
"""The sentence for each name that people use for a simulator and that is not ours."""

_SHORTER_STEP = (
    "expected --time-step with a tenth of your step, which is short enough if eps, from and to hardly change"
)


class _Audit(Command):
    """The command, which refuses an option of LAMMPS by the name that it has here."""

    def parse_args(self, ctx: click.Context, args: list[str]) -> list[str]:
        """Parse the typed words `args` into the context of this command."""
        if {"-var", "-v"} & {*args}:
            raise click.UsageError("-var is an option of LAMMPS: expected --variable NAME=VALUE")
        return super().parse_args(ctx, args)


@click.command(
    cls=_Audit,
    epilog=examples(
        "viscopade audit examples/in.hopper --speed 1",
        "viscopade audit mujoco --epsilon 0.5",
        'viscopade audit mujoco --set "solref=-2500 -100" --speed 1 --time-step 0.003',
    ),
)
@click.argument("simulator", required=False, type=_SimulatorOrFile(SIMULATORS, _MEANT), metavar="[SIMULATOR|FILE]")
# The five default eps, from weak to strong damping, are a choice.
@option("--epsilon", help="The wanted eps, > 0 and < 1.  [default: 0.9, 0.75, 0.5, 0.3, 0.1]")
@option("--time-step", help="Time step: a multiple of the undamped contact time; with --speed or FILE a time.")
@option(
    "--contact-time",
    group="Advanced",
    type=Quantity("time", " > 0"),
    help="Undamped contact time, for a --time-step with a unit.",
)
@option(
    "--step-error",
    group="Advanced",
    type=Real(),
    help="Print the largest time step whose eps has this relative error; not with FILE, --speed, --set or --force.",
)
@option(
    "--set",
    "settings",
    multiple=True,
    metavar="NAME=VALUE",
    help="Parameter in your file, or a line of LAMMPS or LIGGGHTS; repeatable. A wrong NAME prints all names and "
    'defaults. With FILE: "damping=tsuji (2026)" only.',
)
@option(
    "--force", group="Other laws", metavar="FORMULA", help="Force as a function of the compression x and its rate v."
)
@option(
    "--constant",
    "constants",
    group="Other laws",
    multiple=True,
    metavar="NAME=VALUE",
    help="Constant in --force, with a unit or in SI units; repeatable.",
)
@option(
    "--vary", group="Other laws", metavar="NAME", help="Constant in --force that is the damping, which --epsilon finds."
)
@option("--speed", metavar="QUANTITY", help="Impact speed, for FILE, --set and --force.  [default for FILE: 1 m/s]")
@option("--mass", group="Material", metavar="QUANTITY", help="Effective mass, m1 m2/(m1 + m2).")
@option(
    "--radius",
    group="Material",
    multiple=True,
    metavar="[TYPE=]R",
    help="Effective radius, R1 R2/(R1 + R2); with --density '1 mm', '1 mm, 2 mm' or '1 mm, wall'; in a FILE 1=1mm:2mm.",
)
@option(
    "--density",
    group="Material",
    multiple=True,
    metavar="[TYPE=]DENSITY",
    help="Density of the spheres, instead of --mass; of a type in a FILE, such as 1=2500.",
)
@option(
    "--variable",
    group="Advanced",
    multiple=True,
    metavar="NAME=VALUE",
    help="Variable of a FILE, as LAMMPS's -var; repeatable.",
)
@option(
    "--gravity",
    group="Advanced",
    metavar="QUANTITY",
    help="Include the weight of a body that falls on a plane; for FILE, instead of its gravity.",
)
@option("--scheme", group="Advanced", help="Integrator; a wrong name prints the list.  [default: that of the program]")
@option(
    "--end",
    group="Other laws",
    type=click.Choice(ENDS),
    help="End of contact for --force: where the force vanishes, or at x = 0.  [default: force]",
)
@option(
    "--all",
    "with_all",
    group="Output",
    is_flag=True,
    help="With --epsilon: print all formulas of a program, not three only.",
)
@STYLE
def audit(
    simulator: str | Path | None,
    epsilon: str | None,
    time_step: str | None,
    contact_time: float | None,
    step_error: float | None,
    with_all: bool,
    style: str,
    **of_contacts: Any,
) -> None:
    """Print the eps that a program gives, and what to set instead.

    There are three ways to use it. The first example reads FILE, an input of LAMMPS or LIGGGHTS or a model of MuJoCo,
    and prints a row for each contact. With --epsilon the output also has the lines to write instead, after which
    falling, or eps in a row without it, is the wanted one. The columns of a row are

    \b
    eps        without weight, the mean over where in a step contact begins
    from, to   range of this eps
    falling    eps of a body that falls on a plane; at 0 it stays down
    g t_c/v    gravity x contact time/speed: weight matters from 0.02 on
    t_c/step   contact time without damping, in time steps

    The second example starts from the eps that you want. The table has the number that the program's manual tells you
    to write, the eps that this number gives, the reason, and the number to write instead. Without a time step these eps
    are exact, and every digit is proven. --time-step computes the program's own steps. Contact may begin anywhere in a
    step. So the result is the mean of eps and its range, and the number to write instead gives your eps on average. The
    text has three formulas of each program, whose eps differ most.

    The third example, with --speed, starts from the parameters of your file, set by --set. Other parameters have the
    program's defaults. --force replaces the program by a formula with numbers, x, v, + - * / **, min, max, abs, sqrt,
    exp, where(x < 1e-3, ..., ...), the cubic step(x, x0, h0, x1, h1) and names of constants. With --epsilon the output
    also has the number to write for that eps. Of a force, this number is the constant that --vary names. These eps are
    sampled, not proven.

    --contact-time is the contact time without damping. `viscopade epsilon` prints this time for a material with A = 0.
    Plain numbers are in SI units.
    """  # noqa: D301
    # Options that only the table of formulas takes, and those of which any one asks for a single contact.
    of_formulas = {"--contact-time": contact_time, "--step-error": step_error, "--all": with_all}
    of_one_contact = {
        "--speed": of_contacts["speed"],
        "--set": of_contacts["settings"],
        "--force": of_contacts["force"],
    }
    typed = [flag for flag, value in of_one_contact.items() if value not in _NOTHING]

    # A file: all its contacts. It says parameters, masses and integrator itself.
    if isinstance(simulator, Path):
        more = {"--constant": of_contacts.pop("constants")} | {
            f"--{name}": of_contacts.pop(name) for name in ("force", "vary", "mass", "scheme", "end")
        }
        if step_error is not None:
            raise click.UsageError(f"--step-error is given with a file: {_SHORTER_STEP}")
        _refuse("with a file", of_formulas | more)
        show_deck(simulator, epsilon, time_step, style, **of_contacts)
        return
    _refuse("without a file", {"--variable": of_contacts.pop("variable")})

    # One contact, of a program's own parameters or of a force.
    if typed:
        if step_error is not None:
            raise click.UsageError(f"--step-error is given with {' and '.join(typed)}: {_SHORTER_STEP}")
        _refuse(f"with {' and '.join(typed)}", of_formulas)
        show_contact(simulator, epsilon, time_step, style, **of_contacts)

    # Neither: the formulas of manuals, for an eps. No body has a size or a speed there.
    else:
        names = ("vary", "mass", "radius", "density", "gravity", "scheme", "end")
        useless = {"--constant": of_contacts["constants"]} | {f"--{name}": of_contacts[name] for name in names}
        _refuse("without --speed", useless)
        show_formulas(simulator, epsilon, time_step, contact_time, step_error, with_all, style)


def _refuse(where: str, options: Mapping[str, object]) -> None:
    """Raise a usage error for the first option that is typed; `options` has values by flags such as "--set"."""
    for flag, value in options.items():
        if value not in _NOTHING:
            raise click.UsageError(f"{flag} is given {where}: expected a command without it")


COMMANDS = (audit,)
