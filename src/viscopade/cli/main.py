"""Entry point of the command line: numbers go to standard output, progress and errors to standard error."""

from __future__ import annotations

import atexit
import errno
import gc
import logging
import os
import sys
from collections.abc import Callable
from contextlib import suppress
from importlib import import_module
from typing import Any, NoReturn, TextIO

import click

from viscopade import arguments, shipped
from viscopade.cli.console import WORDS, examples, keep_printing, tracker
from viscopade.extras import MissingPackage
from viscopade.generated import printable
from viscopade.progress import use_tracker
from viscopade.simulators import SIMULATORS

# Characters of a message, chosen by hand: our longest sentences are far shorter, and a message that quotes a file of
# megabytes does not flood the terminal.
LONGEST_LINE = 5000
# Errors of the operating system that say that the output cannot be written, not that an input cannot be read: no space,
# a file too large, the quota, the device, a closed stream.
NO_ROOM = {errno.ENOSPC, errno.EFBIG, errno.EDQUOT, errno.EIO, errno.EBADF}


SECTIONS = {
    "Compute": dict.fromkeys(("epsilon", "invert"), "viscopade.cli.derive")
    | dict.fromkeys(("table", "plot"), "viscopade.cli.speeds")
    | {"calculator": "viscopade.cli.calculator"}
    | dict.fromkeys(("coefficients", "pade"), "viscopade.cli.derive"),
    "Measure": {"fit": "viscopade.cli.fit"},
    "Simulators": {"audit": "viscopade.cli.audit", "simulators": "viscopade.cli.simulators"},
    "Code": dict.fromkeys(("scene", "export"), "viscopade.cli.generate"),
    "Evidence": {"reproduce": "viscopade.cli.derive"}
    | dict.fromkeys(("claims", "figures", "bench", "hardcases"), "viscopade_lab.commands"),
}
"""The commands as --help prints them, each with the module that has it in `COMMANDS`."""

_MODULES = {name: module for section in SECTIONS.values() for name, module in section.items()}


class Commands(click.Group):
    """Group of commands, whose modules are loaded when needed."""

    def list_commands(self, context: click.Context) -> list[str]:
        """Return the names of all commands."""
        return sorted(_MODULES)

    def get_command(self, context: click.Context, name: str) -> click.Command | None:
        """Return the command of a name, or None; its module is imported now, with the other commands in it."""
        if name in _MODULES and name not in self.commands:
            for member in import_module(_MODULES[name]).COMMANDS:
                self.add_command(member)
        return self.commands.get(name)

    def resolve_command(
        self, context: click.Context, args: list[str]
    ) -> tuple[str | None, click.Command | None, list[str]]:
        """Return name, command and its words; a refusal names the commands that look like the typed name.

        `args` are the words of the command line from the command's name on. They are kept in the `context`, from which
        `viscopade.cli.console.command_line` makes the heads of files.
        """
        if not args[0].startswith("-") and self.get_command(context, args[0]) is None:
            near = arguments.suggestion(args[0], self.list_commands(context))
            name = args[0].lower()
            if name in SIMULATORS:
                # The first of the targets of `viscopade simulators`; some programs have none.
                meant = [f"audit {name}", *(f"simulators {target}" for target in SIMULATORS[name][:1])]
                near = f": did you mean {' or '.join(meant)}?"
            raise click.UsageError(f"there is no command {args[0]!r}{near}")
        context.meta[WORDS] = args
        return super().resolve_command(context, args)

    def invoke(self, context: click.Context) -> Any:
        """Run the command that the words in the `context` name, and return what it returns.

        A message that begins with an argument's name, "time_step is …", gets the option's name, "--time-step is …".
        """
        try:
            return super().invoke(context)
        except (ValueError, TypeError, click.BadParameter) as error:
            # The names of all options of this command; none if the error came before the command was known.
            running = self.get_command(context, context.meta[WORDS][0]) if WORDS in context.meta else None
            params = running.params if running else []
            flags = [flag for param in params for flag in (*param.opts, *param.secondary_opts)]
            # Replace the first word if it is an option's name; every other message stays.
            text = error.message if isinstance(error, click.BadParameter) else str(error)
            name = text.partition(" ")[0]
            option = "--" + name.replace("_", "-")
            if option not in flags:
                raise
            raise click.UsageError(option + text[len(name) :]) from error

    def format_commands(self, context: click.Context, formatter: click.HelpFormatter) -> None:
        """Write the commands of the group into the help, by section, each with the first sentence of its own help.

        `formatter` collects the help's text, and `context` is that of the group.
        """
        # Names are filled up to one width, so that the summaries of all sections begin in one column.
        width = max(map(len, self.list_commands(context)))
        for section, names in SECTIONS.items():
            with formatter.section(section):
                members = [(name, self.get_command(context, name)) for name in names]
                # Our first sentences are shorter than 100 characters, at which Click would cut them.
                summaries = [(name, member.get_short_help_str(limit=100)) for name, member in members if member]
                formatter.write_dl([(name.ljust(width), summary) for name, summary in summaries])


def _folder_option(name: str, folder: Callable[[], str], text: str) -> Callable[[Any], Any]:
    """Return a decorator that adds an option which prints a folder and ends the program.

    `name` is the option's, `folder` finds the folder, and `text` says in the help what it has.
    """

    def show(context: click.Context, _: click.Parameter, is_typed: bool) -> None:
        # The shell's completion parses a line that is not finished: nothing may be printed then.
        if is_typed and not context.resilient_parsing:
            click.echo(folder())
            context.exit()

    text = f"Print the folder of {text} and exit."
    return click.option(name, is_flag=True, is_eager=True, expose_value=False, callback=show, help=text)


@click.group(
    cls=Commands,
    context_settings={"help_option_names": ["-h", "--help"]},
    epilog=examples(
        'viscopade epsilon --radius "1 cm" --density 1000 --young-modulus "10 MPa" \\\n'
        '      --poisson-ratio 0.45 --dissipative-constant "1e-4 s" --speed "0.5 m/s"',
        "viscopade export c --from-speed 1e-5 --output viscopade_speed_1em5.h",
    ),
)
@click.version_option(package_name="viscopade")
@_folder_option("--include-dir", shipped.get_include, "the C and C++ headers, for -I,")
@_folder_option("--cmake-dir", shipped.cmake_folder, "CMake's configuration, for viscopade_DIR,")
@_folder_option("--examples-dir", shipped.examples_folder, "the example scenes")
def command() -> None:
    """Coefficient of restitution eps of viscoelastic spheres: exact numbers, proven approximants, generated code.

    eps depends on one number, v* = beta^(1/2) v^(1/10). Here v is the impact speed, and beta = 3/2 A
    (rho/m_eff)^(2/5) stands for the material and the sizes. All commands take --help.
    """


def _fail(message: object, status: int) -> NoReturn:
    """Print a message as one line of printable characters, with long words shortened, and exit with `status`."""
    # A number of thousands of digits keeps its first and last 200 characters, which tell it from others (by hand).
    words = (word if len(word) <= 400 else f"{word[:200]}…{word[-200:]}" for word in str(message).split())
    line = printable(" ".join(words))
    try:
        click.echo(f"viscopade: {line if len(line) <= LONGEST_LINE else line[:LONGEST_LINE] + '…'}", err=True)
    except OSError:  # standard error is closed, too; only the exit status can tell
        _forget(sys.stderr)
    sys.exit(status)


def _forget(stream: TextIO | None) -> None:
    """Discard all further output to a broken stream; the interpreter would complain about it at exit."""
    if stream is not None:
        with suppress(OSError, ValueError):
            os.dup2(os.open(os.devnull, os.O_WRONLY), stream.fileno())


def _be_quick() -> None:
    """Set up the process: most commands take less than a second."""
    # Imports make many objects and hardly any garbage: with Python's threshold of 700 to 2000 objects the search for it
    # and NumPy's threads took a quarter of a command's processor time. The number itself is chosen by hand.
    gc.set_threshold(50_000)
    atexit.register(gc.freeze)  # no collection when the process ends
    os.environ.setdefault("OPENBLAS_NUM_THREADS", "1")  # NumPy's threads cost more than they save: matrices are small


def main() -> None:
    """Run the command in the arguments, and exit with its status; errors are one line.

    Exit status 2 means wrong input, 1 that something else failed, 130 (128 and the number of SIGINT) an interruption.
    """
    keep_printing()
    _be_quick()
    logging.getLogger("matplotlib").setLevel(logging.ERROR)  # its messages about its cache
    try:
        # Loops show their progress by `tracker`. Without a command, print the help.
        with use_tracker(tracker):
            try:
                status: object = command.main(prog_name="viscopade", standalone_mode=False)
            except click.exceptions.NoArgsIsHelpError as error:
                click.echo(error.format_message())
                status = 2
            if sys.stdout is not None:  # None if the caller closed it; errors of the last output are raised here
                sys.stdout.flush()
    # The order matters: the first clause that fits has the error, and several are subclasses of later ones.
    except (click.Abort, KeyboardInterrupt):  # the former is a RuntimeError
        _fail("interrupted", 130)
    except click.ClickException as error:
        _fail(error.format_message(), 2)
    except (ValueError, TypeError) as error:
        _fail(error, 2)
    except ModuleNotFoundError as error:  # of ours, an optional package that the user may install
        _fail(error, 2 if isinstance(error, MissingPackage) else 1)
    except (ArithmeticError, RuntimeError) as error:
        _fail(error, 1)
    except MemoryError:
        _fail("there is not enough memory: expected fewer digits, a lower order, or fewer inputs at once", 1)
    except BrokenPipeError:  # the reader of the output has closed it
        _forget(sys.stdout)
        sys.exit(1)
    except OSError as error:  # the disk is full, for instance
        _forget(sys.stdout)
        _fail(f"cannot print: {error.strerror or error}" if error.errno in NO_ROOM else error, 1)
    sys.exit(status if isinstance(status, int) else 0)
