"""Compilers and interpreters that run a scene's generated code, in a temporary directory."""

from __future__ import annotations

import os
import platform
import re
import shlex
import shutil
import subprocess
import sys
from collections.abc import Sequence
from dataclasses import dataclass
from importlib.metadata import PackageNotFoundError, version
from pathlib import Path
from tempfile import TemporaryDirectory

from viscopade.kernels import toolchain
from viscopade.kernels.targets.language import DRIVER, EXECUTABLE, FILE, PROGRAM, START, TOOL, Runner
from viscopade.kernels.toolchain import NoSuchToolError, ToolchainError

INPUT, OUTPUT = "in.bin", "out.bin"  # a driver reads the one and writes the other
_STEM = EXECUTABLE.partition(".")[0]  # of the driver
_TIMEOUT = 300
_ERROR = re.compile(r"error(\[\w+\])?:|undefined reference", re.IGNORECASE)


@dataclass(frozen=True)
class Tool:
    """An installed tool: its command, and its version in its own words."""

    words: tuple[str, ...]
    version: str


def find_tool(runner: Runner, command: str | None = None) -> Tool | None:
    """Return the requested tool, or the one named by the environment, or the first installed one.

    Raises
    ------
    NoSuchToolError
        If the tool that `command` or the environment names cannot be started.
    ToolchainError
        If the C compiler that is asked for does not work.
    """
    if not runner.tools:
        return _interpreter(runner.package)
    if command is not None:
        compiler = toolchain.find_compiler(command)
        return Tool(compiler.words, compiler.version)
    named = os.environ.get(runner.variable) if runner.variable else None
    for candidate in (named,) if named else runner.tools:
        try:
            words = tuple(shlex.split(candidate))
        except ValueError:
            continue
        if words and shutil.which(words[0]) is not None and (known := _version(words)) is not None:
            return Tool(words, known)
    if named:
        raise NoSuchToolError(f"{runner.variable} is {named!r}, which does not start: accepted is a compiler's name")
    return None


def _interpreter(package: str | None) -> Tool | None:
    """Return this interpreter; None if a package that the program needs is not there."""
    python = f"Python {platform.python_version()}"
    try:
        return Tool((sys.executable,), f"{package} {version(package)}, {python}" if package else python)
    except PackageNotFoundError:
        return None


def missing(runner: Runner) -> str:
    """Return the names of the tools in the search, for a message."""
    return " or ".join(runner.tools) or f"Python package {runner.package}"


def _version(words: Sequence[str]) -> str | None:
    """Return the line that a tool prints of its version; None if it does not start."""
    try:
        ran = _run((*words, "--version"), None)
    except ToolchainError:
        return None
    if ran.returncode:
        return None
    line = next((line.strip() for line in ran.stdout.splitlines() if re.search(r"\d\.\d", line)), "")
    name = re.split(r"[/\\]", words[0])[-1]
    return line if name.lower() in line.lower() else f"{name} {line}".strip()


def run_driver(
    runner: Runner,
    tool: Tool,
    driver: str,
    file: tuple[str, str],
    numbers: bytes,
    size: int,
) -> bytes:
    """Compile a driver and run it.

    Parameters
    ----------
    runner : Runner
    tool : Tool
    driver : str
        The program's text.
    file : tuple of str
        Name and text of the file that it is about.
    numbers : bytes
        What the program reads.
    size : int
        Bytes that it must write, if it is run.

    Returns
    -------
    bytes
        What it wrote; nothing if it only compiles.

    Raises
    ------
    ToolchainError
        If the tool or the program fails; one line.
    """
    name = _STEM + runner.ending
    words = {DRIVER: name, FILE: file[0], PROGRAM: EXECUTABLE}
    with TemporaryDirectory() as directory:
        here = Path(directory)
        (here / file[0]).write_text(file[1], encoding="utf-8")
        (here / name).write_text(driver, encoding="utf-8")
        for command in (runner.build, runner.start):
            if command is runner.start:
                (here / INPUT).write_bytes(numbers)
            if command:
                filled = (tool.words if word == TOOL else (words.get(word, word),) for word in command)
                _succeed([word for part in filled for word in part], directory)
        made = here / OUTPUT
        found = made.read_bytes() if made.exists() else b""
    if len(found) != size:
        raise ToolchainError(f"the program that runs the generated code writes {len(found)} bytes, not {size}")
    return found


def _succeed(words: Sequence[str], directory: str) -> None:
    """Run a command; report its first error."""
    name = re.split(r"[/\\]", words[0])[-1]
    ran = _run(words, directory)
    if ran.returncode == 0:
        return
    lines = [line.strip() for line in (ran.stderr + ran.stdout).splitlines() if line.strip()]
    first = next(filter(_ERROR.search, lines), lines[0] if lines else f"exit status {ran.returncode}")
    for place in (os.path.realpath(directory), directory):
        for written in (f"file://{place}{os.sep}", f"{place}{os.sep}", place):
            first = first.replace(written, "")
    raise ToolchainError(f"the generated code fails its check: {name}: {first[:300]}")


def _run(words: Sequence[str], directory: str | None) -> subprocess.CompletedProcess[str]:
    environment = os.environ | {"LC_ALL": "C"}
    start = str(Path(directory, words[0])) if directory is not None and words[0] in START else words[0]
    try:
        return subprocess.run(
            (start, *words[1:]), cwd=directory, capture_output=True, text=True, errors="replace", timeout=_TIMEOUT,
            env=environment, stdin=subprocess.DEVNULL,
        )  # fmt: skip
    except (OSError, subprocess.TimeoutExpired) as error:
        reason = error.strerror if isinstance(error, OSError) else f"no answer in {_TIMEOUT} s"
        raise ToolchainError(f"{words[0]} cannot be run: {reason}") from None
