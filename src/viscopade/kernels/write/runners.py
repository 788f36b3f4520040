"""Compilers and interpreters of all languages, and programs that call generated code: one driver for each language.

A driver reads rows of arguments, calls functions and writes rows of results; all numbers are of one type.
"""

from __future__ import annotations

import os
import platform
import re
import shlex
import shutil
import subprocess
import sys
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from importlib.metadata import PackageNotFoundError, version
from importlib.resources import files
from pathlib import Path
from typing import Any

import numpy as np
import numpy.typing as npt

from viscopade.generated import environment
from viscopade.kernels.write.language import Language, Number, Runner

ARGUMENTS = ("x", "y", "z")
"""Names of the arguments of calls."""
_TIMEOUT = 600  # seconds, after which a tool or program that hangs is stopped; chosen by hand
_MESSAGE = 300  # most characters of a tool's error that are repeated, so that a message is a few lines; chosen by hand
# The first line that says what is wrong, of all that compilers and linkers print.
_ERROR = re.compile(r"error(\[\w+\])?:|undefined reference|multiple definition|unrecognized", re.IGNORECASE)
_FAILS = "the generated code fails its check"
_PROGRAM = "viscopade-driver.exe"  # no other file can have this name

Array = npt.NDArray[Any]


class ToolchainError(RuntimeError):
    """Error: a compiler or interpreter is missing or fails, or its program fails; the message is one line."""


class NoSuchToolError(ToolchainError, ValueError):
    """Error: there is no compiler of the name that the user gave."""


@dataclass(frozen=True)
class Tool:
    """An installed tool: its command, and its version in its own words."""

    words: tuple[str, ...]
    version: str


def find_tool(runner: Runner, command: str | None = None) -> Tool | None:
    """Return the tool for a runner's programs: the requested one, or that of the environment, or the first installed.

    `command` is the command line of a requested tool, such as "gcc-12 -m32". A runner without tools needs the
    interpreter that runs viscopade, and perhaps a package: None if it is not there.

    Raises
    ------
    NoSuchToolError
        If the tool that `command` or the environment names cannot be started.
    """
    if not runner.tools:
        python = f"Python {platform.python_version()}"
        if not runner.package:
            return Tool((sys.executable,), python)
        try:
            return Tool((sys.executable,), f"{runner.package} {version(runner.package)}, {python}")
        except PackageNotFoundError:
            return None
    named = command or (os.environ.get(runner.variable) if runner.variable else None)
    for candidate in (named,) if named else runner.tools:
        try:
            words = tuple(shlex.split(candidate))
        except ValueError:  # an open quote
            continue
        if words and shutil.which(words[0]) is not None and (tool_version := _version(words)) is not None:
            return Tool(words, tool_version)
    if named:
        given_by = "--cc, or CC" if runner.variable == "CC" else runner.variable
        raise NoSuchToolError(f"there is no compiler {named!r} that starts: expected the name of one ({given_by})")
    return None


def missing(runner: Runner) -> str:
    """Return the names of the tools in the search, for a message."""
    return " or ".join(runner.tools) or f"Python package {runner.package}"


def _version(words: Sequence[str]) -> str | None:
    """Return the line that a tool prints of its version, with its name; None if it does not start.

    `words` are its command line.
    """
    name = re.split(r"[/\\]", words[0])[-1]
    try:
        result = run((*words, "--version"))
    except ToolchainError:
        return None
    if result.returncode:
        return None
    # The first line with a number such as 12.2.
    line = next((line.strip() for line in result.stdout.splitlines() if re.search(r"\d\.\d", line)), "")
    return line if name.lower() in line.lower() else f"{name} {line}".strip()


@dataclass(frozen=True)
class Program:
    """A program that was built, or a driver that an interpreter runs.

    Attributes
    ----------
    command : tuple of str
        Starts it, in the directory.
    type : dtype
        Of arguments and results.
    calls : int
        How many results there are for each row of arguments.
    directory : Path
        Where it reads arguments from in.bin, and writes results to out.bin.
    """

    command: tuple[str, ...]
    type: np.dtype[Any]
    calls: int
    directory: Path

    def __call__(self, *arguments: Array, environment: Mapping[str, str] | None = None) -> Array:
        """Return the results of calls, a row for each call, from arguments that are arrays of one length.

        `environment` has variables that are set besides those of this process.

        Raises
        ------
        ToolchainError
            If the program fails; one line.
        """
        # A row for each call's arguments, in the order of `ARGUMENTS`; results come back a row for each argument row.
        rows = np.stack(arguments, 1).astype(self.type)
        (self.directory / "in.bin").write_bytes(rows.tobytes())
        succeed(self.command, self.directory, _FAILS, environment)
        results = np.frombuffer((self.directory / "out.bin").read_bytes(), self.type)
        if results.size != len(rows) * self.calls:
            raise ToolchainError(f"the program that runs the generated code writes {results.size} numbers")
        return results.reshape(len(rows), self.calls).T


def build(
    language: Language,
    number: Number,
    file: tuple[str, str],
    calls: Sequence[str],
    tool: Tool,
    directory: Path,
    flags: Sequence[str] = (),
) -> Program:
    """Write a file of generated code and its driver, and compile them.

    Parameters
    ----------
    language : Language
    number : Number
        What the calls take and return.
    file : tuple of str
        Name and text.
    calls : sequence of str
        Expressions in the language; their arguments are `ARGUMENTS`.
    tool : Tool
    directory : Path
        Where all this is to be.
    flags : sequence of str
        More flags for the compiler.

    Raises
    ------
    ToolchainError
        If the tool fails; one line.
    """
    runner, (name, text) = language.run, file
    # The driver is a template. Its words are the names of the generated file and of its module, the type and its size,
    # the arguments that occur in calls, and the calls.
    arguments = [x for x in ARGUMENTS if any(re.search(rf"\b{x}\b", call) for call in calls)]
    stem = name.rpartition(".")[0]
    words = {
        "file": name, "text": text, "stem": stem, "module": stem.title().replace("_", ""), "type": number.type,
        "bytes": number.arithmetics[0].form.bytes, "arguments": arguments, "calls": calls,
    }  # fmt: skip
    source = (files(__package__) / "drivers" / f"{runner.driver}.jinja").read_text(encoding="utf-8")
    driver = f"driver{Path(runner.driver).suffix}"
    (directory / name).write_text(text, encoding="utf-8")
    (directory / driver).write_text(environment().from_string(source).render(words), encoding="utf-8")
    # The command lines that build and start it, with words for names: a word may stand for several.
    names = {"{tool}": (*tool.words, *flags), "{driver}": (driver,), "{file}": (name,), "{program}": (_PROGRAM,)}
    compile_command, command = (
        tuple(word for pattern in line.split() for word in names.get(pattern, (pattern,)))
        for line in (runner.build, runner.start)
    )
    if compile_command:
        succeed(compile_command, directory, _FAILS)
    return Program(command, np.dtype(f"f{number.arithmetics[0].form.bytes}"), len(calls), directory)


def succeed(words: Sequence[str], directory: Path, failure: str, more: Mapping[str, str] | None = None) -> None:
    """Run a command line (`words`) in a directory, with more variables in the environment.

    Raises
    ------
    ToolchainError
        If it fails; the message is `failure` and the first error that the command reports.
    """
    result = run(words, directory, more)
    if result.returncode == 0:
        return
    # The first line that names an error, or else the first one.
    lines = [line.strip() for line in (result.stderr + result.stdout).splitlines() if line.strip()]
    first = next(filter(_ERROR.search, lines), lines[0] if lines else f"exit status {result.returncode}")
    # Without the directory, which is a temporary one: as a URL, with a separator, and alone, each resolved or not.
    for place in (os.path.realpath(directory), str(directory)):
        for written in (f"file://{place}{os.sep}", f"{place}{os.sep}", place):
            first = first.replace(written, "")
    name = re.split(r"[/\\]", words[0])[-1]
    raise ToolchainError(f"{failure}: {name}: {first[:_MESSAGE]}")


def run(
    words: Sequence[str], directory: Path | None = None, more: Mapping[str, str] | None = None
) -> subprocess.CompletedProcess[str]:
    """Run a command line (`words`), in a directory or this one, with more variables in the environment.

    Raises
    ------
    ToolchainError
        If it does not start, or does not end.
    """
    # The program that was built is in the directory, which is not on the search path.
    start = str(directory / words[0]) if directory is not None and words[0] == _PROGRAM else words[0]
    try:
        # LC_ALL=C: messages in English, in which errors are looked for. Nothing is read from the terminal.
        return subprocess.run(
            (start, *words[1:]), cwd=directory, capture_output=True, text=True, errors="replace", timeout=_TIMEOUT,
            env={**os.environ, "LC_ALL": "C", **(more or {})}, stdin=subprocess.DEVNULL,
        )  # fmt: skip
    except (OSError, subprocess.TimeoutExpired) as error:
        reason = error.strerror if isinstance(error, OSError) else f"no answer in {_TIMEOUT} s"
        raise ToolchainError(f"{words[0]} cannot be run: {reason}") from None
