"""The C compiler of the benchmark with this machine's flags, and the shared libraries that it builds."""

from __future__ import annotations

import ctypes
import os
import platform
from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import Literal

from viscopade.kernels.write.languages import language
from viscopade.kernels.write.runners import ToolchainError, find_tool, missing, run, succeed

SCALAR_FLAGS = ("-O2",)
FAST_MATH = "-ffast-math"
# Flags for arrays, as users compile for speed; scalar functions have -O2 (SCALAR_FLAGS), so that the loop over them is
# not vectorised. The first set that the compiler takes; gcc and clang for ARM want the second.
_NATIVE = (("-O3", "-march=native"), ("-O3", "-mcpu=native"), ("-O3",))
_FAILS = "the benchmark is not built"

Sources = Mapping[str, str]
Library = Literal["scalar", "array", "vector"]


@dataclass(frozen=True)
class Compiler:
    """A compiler and its flags.

    Attributes
    ----------
    words : tuple of str
        The command.
    version : str
        Its name and version, as it prints them.
    array_flags : tuple of str
        Flags for functions of arrays, with which it uses all that this processor has.
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
    """Return the compiler of the command line `command`, of the environment's CC, or the first installed one.

    Raises
    ------
    ToolchainError
        If there is none, or it does not compile an empty file.
    """
    runner = language("c").run
    tool = find_tool(runner, command)
    if tool is None:
        raise ToolchainError(f"there is no {missing(runner)}: expected a C compiler (--cc, or CC)")
    with TemporaryDirectory() as folder:
        # An empty file with each set of flags; -Werror makes a flag that a compiler does not know an error.
        directory = Path(folder)
        (directory / "empty.c").write_text("int viscopade_empty;\n")
        compiling = (*tool.words, "-c", "empty.c")
        succeed(compiling, directory, _FAILS)
        accepted = (flags for flags in _NATIVE if run((*compiling, *flags, "-Werror"), directory).returncode == 0)
        return Compiler(tool.words, tool.version, next(accepted))


def build_libraries(
    compiler: Compiler, units: Mapping[Library, Sources], headers: Sources
) -> dict[Library, ctypes.CDLL]:
    """Return the loaded libraries, each from its own C files, compiled one by one, and linked.

    `units` maps a library to its files, name to text; `headers` are files that all may include. They are linked without
    their flags: with -ffast-math, gcc would link code that makes the whole process flush subnormal numbers to zero.

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
    """Return one loaded library, built in a folder of its own beside the headers, which lie in `directory`."""
    folder = Path(directory, library)
    folder.mkdir()
    for name, text in sources.items():
        (folder / name).write_text(text, encoding="utf-8")
    # Compile with the library's flags, then link without them (see `build_libraries`).
    succeed((*compiler.words, *compiler.flags(library), "-fPIC", "-I..", "-c", *sources), folder, _FAILS)
    shared = folder / "library.so"
    objects = [str(Path(name).with_suffix(".o")) for name in sources]
    succeed((*compiler.words, "-shared", "-o", shared.name, *objects, "-lm"), folder, _FAILS)
    try:
        return ctypes.CDLL(str(shared))
    except OSError as error:
        # The message names the file in the folder, which the user does not know.
        reason = str(error).replace(f"{folder}{os.sep}", "")
        raise ToolchainError(f"the library that {compiler.words[0]} built cannot be loaded: {reason}") from None


def read_from(directory: str | os.PathLike[str], name: str) -> str:
    """Return the text of the exported header `name` in a directory.

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
    """Return the model of the processor, or less if the system does not tell it."""
    # Linux has a line "model name : …" for each processor, on some machines "cpu model".
    try:
        lines = Path("/proc/cpuinfo").read_text(encoding="utf-8", errors="replace").splitlines()
    except OSError:
        lines = []
    models = (line.partition(":")[2].strip() for line in lines if line.startswith(("model name", "cpu model")))
    return next(models, "") or platform.processor() or platform.machine() or "unknown"
