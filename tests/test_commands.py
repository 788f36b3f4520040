"""Commands that any text of the repository names: they exist, with the options and the names that stand there."""

import re
import shlex
from functools import cache
from importlib.util import find_spec
from itertools import chain
from pathlib import Path

import click
import pytest

from viscopade.cli.main import command as viscopade

ROOT = Path(__file__).parents[1]
SUFFIXES = {".md", ".py", ".toml", ".yml", ".cff", ".ipynb", ".h", ".jinja", ".js", ".cmake"}
FOLDERS = ("src", "docs", "tools", "checkers", "derivations", "examples", "notebooks", "exports", ".github")
QUOTED = re.compile(
    r"""`((?:viscopade|python\ -m|make)\ [^`]+)`        # in a sentence, on one line or on two
      | ^(?:\ {4}|\$\ )((?:viscopade|python\ -m|make)\ [^`\n]+)$  # to be typed
      | viscopade\ [\d.]+:\ (viscopade\ [^\n]+)$       # the first line of a generated file
    """,
    re.MULTILINE | re.VERBOSE,
)
STANDS_FOR = re.compile(r"[A-Z][A-Z_/]*|.*(?:…|\.\.\.|[{}<>*]).*|bounce")  # a reader's own words, or simulator


def texts():
    """Yield the names and the texts of the files that people read."""
    for path in sorted(chain(ROOT.glob("*"), *((ROOT / folder).rglob("*") for folder in FOLDERS))):
        if path.suffix in SUFFIXES and path.is_file() and path.name != "CHANGELOG.md":
            text = path.read_text("utf-8")
            yield path.relative_to(ROOT).as_posix(), text[:3000] if path.parent.name == "exports" else text


@cache
def commands():
    """Return the commands as words, each with a file that names it."""
    found = {}
    for name, text in texts():
        for match in QUOTED.finditer(text):
            line = re.sub(r"\s*\n[\s#*/]*|\\n", " ", next(filter(None, match.groups()))).partition("  # ")[0]
            try:
                words = tuple(shlex.split(line.partition(" | ")[0].replace("\\", "")))
            except ValueError:  # a part of a program's text
                continue
            found.setdefault(words, name)
    return found


def of(program):
    return [(name, words) for words, name in commands().items() if words[: len(program)] == program]


def refusal(words):
    """Return why the command line refuses an option, or a name, in the words after `viscopade`; None if it does not."""
    if words[0].startswith("-"):
        known = {flag for option in viscopade.params for flag in option.opts} | {"--help"}
        return None if words[0] in known else f"there is no option {words[0]}"
    command = viscopade.get_command(click.Context(viscopade), words[0])
    if command is None:
        return f"there is no command {words[0]}"
    context = click.Context(command, info_name=words[0])
    rest = [word for word in words[1:] if word != "--help"]
    try:
        values, further, _ = command.make_parser(context).parse_args([*rest])
        further = [word for word in further if not STANDS_FOR.fullmatch(word)]
        if further:
            return f"there is no argument for {further[0]}"
        for option in command.params:
            given = values.get(option.name)
            for value in given if isinstance(given, (list, tuple)) else [given]:
                if isinstance(value, str) and not STANDS_FOR.fullmatch(value):
                    option.type.convert(value, option, context)
    except click.BadOptionUsage as error:
        return None if rest[-1] == error.option_name else error.message  # a sentence names an option, not its value
    except (click.UsageError, ValueError) as error:
        return str(error)
    return None


def test_commands_of_viscopade_are_accepted():
    found = of(("viscopade",))
    assert len(found) > 150
    assert [(name, *words, why) for name, words in found if len(words) > 1 and (why := refusal(words[1:]))] == []


@pytest.mark.parametrize(
    ("line", "why"),
    [
        ("--nothing", "there is no option --nothing"),
        ("nothing", "there is no command nothing"),
        ("export basic", "TARGET is 'basic'"),
        ("export c --accurate 1e-3", "No such option"),
        ("export c d", "there is no argument for d"),
        ("epsilon --speed 3 kg", "there is no argument for kg"),
        ("epsilon --speed '3 kg'", "expected a speed"),
    ],
)
def test_a_stale_command_is_found(line, why):
    assert why in refusal(shlex.split(line))


def runs(name):
    """Return whether `python -m` has something to run."""
    spec = find_spec(name)
    if spec is not None and spec.submodule_search_locations is not None:
        spec = find_spec(f"{name}.__main__")
    return spec is not None


def test_modules_exist():
    named = {words[2] for _, words in of(("python", "-m"))} - {"pip", "venv"}
    assert len(named) > 15
    assert [name for name in named if not runs(name)] == []


def test_targets_of_make_exist():
    rules = re.findall(r"^([^\s#:][^#:=]*):(?!=)", (ROOT / "Makefile").read_text("utf-8"), re.MULTILINE)
    known = {".venv/.tools", *" ".join(rules).split()}  # the former by a variable
    named = {words[-1] for _, words in of(("make",)) if words[1] != ":"}
    assert len(named) > 10
    assert named - known == set()
