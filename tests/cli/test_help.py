"""The help of the command line: sections, widths, and examples that run."""

import os
import re
import shlex
import subprocess
import sys
from importlib import import_module
from pathlib import Path

import click
import pytest

from viscopade.cli.console import GROUPS
from viscopade.cli.main import SECTIONS, command
from viscopade.generated import MARKER

ROOT = Path(__file__).parents[2]
COLUMNS = 80
NAMES = command.list_commands(click.Context(command))
SLOW = {"bench", "reproduce", "hardcases"}


def examples(name):
    """Return the command lines at the end of a command's help."""
    found = command if name == "viscopade" else command.get_command(click.Context(command), name)
    lines = found.epilog.replace("\\\n", " ").splitlines()
    return [line.strip() for line in lines if line.strip().startswith("viscopade ")]


@pytest.mark.parametrize("name", ["export", "simulators"])
def test_help_lists_all_targets(name):
    one = command.get_command(click.Context(command), name)
    targets = next(each.type.choices for each in one.params if each.name == "target")
    assert {*targets} <= {*re.findall(r"[\w-]+", one.help)}


def test_every_command_is_in_one_section():
    """Those of all modules: a command of no section would not be there."""
    modules = [path.stem for path in (ROOT / "src" / "viscopade" / "cli").glob("*.py")]
    found = [import_module(f"viscopade.cli.{name}") for name in modules] + [import_module("viscopade_lab.commands")]
    made = [each.name for module in found for each in getattr(module, "COMMANDS", ())]
    assert sorted(made) == sorted(name for names in SECTIONS.values() for name in names) == sorted(NAMES)


@pytest.mark.parametrize("name", ["viscopade", *NAMES])
def test_help_fits_into_80_columns_and_ends_with_an_example(name):
    words = [] if name == "viscopade" else [name]
    text = subprocess.run(
        [sys.executable, "-m", "viscopade", *words, "--help"],
        capture_output=True,
        text=True,
        check=True,
        env=os.environ | {"COLUMNS": str(COLUMNS)},
    ).stdout
    lines = text.splitlines()
    assert max(len(line) for line in lines if "|" not in line) <= COLUMNS
    assert examples(name)
    assert lines[-1].strip() in " ".join(examples(name)) or lines[-1].strip().startswith("--")


@pytest.mark.parametrize("name", NAMES)
def test_options_stand_in_groups(name):
    """Each option stands once, the groups in one order; a command with few options has one group."""
    one = command.get_command(click.Context(command), name)
    lines = one.get_help(click.Context(one, info_name=name, help_option_names=["-h", "--help"])).splitlines()
    lines = lines[lines.index("Options:") :]
    headings = [line[:-1] for line in lines if line[:-1] in GROUPS]
    flags = [match[1] for line in lines if (match := re.match(r"  (?:-\w, )?(--[a-z-]+)", line))]
    options = [max(each.opts, key=len) for each in one.params if isinstance(each, click.Option)]
    assert sorted(flags) == sorted([*options, "--help"])
    assert headings == [group for group in GROUPS if group in headings]
    assert headings[0] == "Options"
    assert (len(headings) == 1) == (len(flags) <= 8)


def test_common_options_come_first():
    """A first user of `epsilon` needs one of these, or a material."""
    one = command.get_command(click.Context(command), "epsilon")
    text = one.get_help(click.Context(one, info_name="epsilon"))
    assert (
        text.index("--speed QUANTITY")
        < text.index("Material:")
        < text.index("--radius Q")
        < text.index("--stiffness T")
    )
    assert text.index("Advanced:") < text.index("--load NUMBER")


@pytest.mark.parametrize(
    "line",
    [
        pytest.param(line, marks=[pytest.mark.slow] if name in SLOW else [], id=f"{name}{i}")
        for name in ["viscopade", *NAMES]
        for i, line in enumerate(examples(name))
    ],
)
def test_examples_run_and_print_at_most_100_columns(tmp_path, line):
    """Files that are printed may have longer lines."""
    (tmp_path / "examples").symlink_to(ROOT / "examples")
    words = [sys.executable, "-m", *shlex.split(line)]
    ran = subprocess.run(words, capture_output=True, text=True, cwd=tmp_path)
    assert ran.returncode == 0, ran.stderr
    assert ran.stdout or len(list(tmp_path.iterdir())) > 1  # a file was written
    assert MARKER in ran.stdout or max(map(len, ran.stdout.splitlines()), default=0) <= 100
