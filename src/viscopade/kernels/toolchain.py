"""The C compiler of this machine, and the shared libraries that it builds."""

from __future__ import annotations

import ctypes
import os
import platform
import re
import shlex
import shutil
import subprocess
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import Literal

SCALAR_FLAGS = ("-O2",)
FAST_MATH = "-ffast-math"
# The first that the compiler takes; gcc and clang for ARM want the second.
_NATIVE = (("-O3", "-march=native"), ("-O3", "-mcpu=native"), ("-O3",))
_DEFAULT = "cc"
_TIMEOUT = 600
_ERROR = re.compile(r"\berror\b|undefined reference|multiple definition|unrecognized")

Sources = Mapping[str, str]


Library = Literal["scalar", "array", "vector"]


class ToolchainError(RuntimeError):
    """Error: a compiler or interpreter is missing or fails, or its program fails; the message is one line."""


class NoSuchToolError(ToolchainError, ValueError):
    """Error: there is no compiler of the name that the user gave."""


@dataclass(frozen=True)
class Compiler:
    """A compiler and its flags.

    Attributes
    ----------
    words : tuple of str
        The command.
    version : str
        The first line of its answer to --version.
    array_flags : tuple of str
    """

    words: tuple[str, ...]
    version: str
    array_flags: tuple[str, ...]

    def flags(self, library: Library) -> tuple[str, ...]:
        """Return the flags for a library."""
        if library == "scalar":
            return SCALAR_FLAGS
        return self.array_flags if library == "array" else (*self.array_flags, FAST_MATH)


def find_compiler(command: str | None = None) -> Compiler:
    """Return the compiler named by the argument, by CC, or cc.

    Raises
    ------
    NoSuchToolError
        If there is none of the name given.
    ToolchainError
        If there is no cc, or the compiler does not compile an empty file.
    """
    named = command or os.environ.get("CC")
    asked = named or _DEFAULT
    try:
        words = tuple(shlex.split(asked))
    except ValueError:
        words = ()
    if not words or shutil.which(words[0]) is None:
        kind = NoSuchToolError if named else ToolchainError
        raise kind(f"there is no C compiler {asked!r}: expected the name of one (--cc, or CC)")
    version = _version(words)
    with TemporaryDirectory() as directory:
        Path(directory, "empty.c").write_text("int viscopade_empty;\n")
        _compile((*words, "-c", "empty.c"), directory)
        native = next(flags for flags in _NATIVE if _accepts(words, flags, directory))
    return Compiler(words, version, native)


def _version(words: Sequence[str]) -> str:
    """Return the first line that the compiler prints of its version."""
    run = _run((*words, "--version"), None)
    line = (run.stdout.splitlines() or [""])[0].strip()
    return line or Path(words[0]).name


def _accepts(words: Sequence[str], flags: Sequence[str], directory: str) -> bool:
    return _run((*words, *flags, "-Werror", "-c", "empty.c"), directory).returncode == 0


def build_libraries(
    compiler: Compiler, units: Mapping[Library, Sources], headers: Sources
) -> dict[Library, ctypes.CDLL]:
    """Compile the files of each library one by one, link and load the libraries.

    They are linked without their flags: with -ffast-math, gcc would link code that makes the whole process flush
    subnormal numbers to zero.

    Raises
    ------
    ToolchainError
        If the compiler reports an error, or the library cannot be loaded.
    """
    with TemporaryDirectory() as directory:
        for name, text in headers.items():
            Path(directory, name).write_text(text, encoding="utf-8")
        return {library: _library(compiler, library, sources, directory) for library, sources in units.items()}


def _library(compiler: Compiler, library: Library, sources: Sources, directory: str) -> ctypes.CDLL:
    here = Path(directory, library)
    here.mkdir()
    for name, text in sources.items():
        (here / name).write_text(text, encoding="utf-8")
    _compile((*compiler.words, *compiler.flags(library), "-fPIC", "-I..", "-c", *sources), str(here))
    shared = here / "library.so"
    objects = [str(Path(name).with_suffix(".o")) for name in sources]
    _compile((*compiler.words, "-shared", "-o", shared.name, *objects, "-lm"), str(here))
    try:
        return ctypes.CDLL(str(shared))
    except OSError as error:
        raise ToolchainError(
            f"the library that {compiler.words[0]} built cannot be loaded: {_short(str(error), here)}"
        ) from None


def _compile(words: Sequence[str], directory: str) -> None:
    """Run the compiler; report its first error."""
    run = _run(words, directory)
    if run.returncode == 0:
        return
    lines = [line.strip() for line in (run.stderr + run.stdout).splitlines() if line.strip()]
    first = next(filter(_ERROR.search, lines), lines[0] if lines else f"exit status {run.returncode}")
    raise ToolchainError(f"{words[0]} fails: {_short(first, Path(directory))}")


def _run(words: Sequence[str], directory: str | None) -> subprocess.CompletedProcess[str]:
    environment = os.environ | {"LC_ALL": "C"}
    try:
        return subprocess.run(
            words, cwd=directory, capture_output=True, text=True, errors="replace", timeout=_TIMEOUT, env=environment
        )
    except (OSError, subprocess.TimeoutExpired) as error:
        reason = error.strerror if isinstance(error, OSError) else f"no answer in {_TIMEOUT} s"
        raise ToolchainError(f"{words[0]} cannot be run: {reason}") from None


def _short(message: str, directory: Path) -> str:
    """Return a message without the temporary directory's name."""
    return message.replace(f"{directory}{os.sep}", "")[:300]


def read_from(directory: str | os.PathLike[str], name: str) -> str:
    """Return the text of an exported header in a directory.

    Raises
    ------
    ValueError
        If it cannot be read.
    """
    path = Path(directory, name)
    try:
        return path.read_text(encoding="utf-8")
    except (OSError, UnicodeDecodeError) as error:
        reason = error.strerror if isinstance(error, OSError) else "it is no text"
        raise ValueError(f"cannot read {path}: {reason}; expected a directory with the exported headers") from None


def processor() -> str:
    """Return the model of the processor."""
    try:
        lines = Path("/proc/cpuinfo").read_text(encoding="utf-8", errors="replace").splitlines()
    except OSError:
        lines = []
    models = (line.partition(":")[2].strip() for line in lines if line.startswith(("model name", "cpu model")))
    return next(models, "") or platform.processor() or platform.machine() or "unknown"
