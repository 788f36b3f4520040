"""Compile a generated header into a shared object and call its functions through ctypes."""

from __future__ import annotations

import ctypes
import os
import re
import shutil
import subprocess
from collections.abc import Callable, Iterable
from functools import cache
from itertools import count
from pathlib import Path

import pytest

WARNINGS = (
    "-Wall", "-Wextra", "-Wpedantic", "-Wconversion", "-Wsign-conversion", "-Wdouble-promotion", "-Wshadow",
    "-Wundef", "-Werror",
)  # fmt: skip
STANDARDS = ("c99", "c2x", "c++98", "c++14", "c++17", "c++23")  # the ends, and where constants are written otherwise

_DEFINITION = re.compile(
    r"^(?:static inline|VISCOPADE_INLINE|VISCOPADE_FUNCTION) (double|float) (viscopade_\w+)\((.*)\)$", re.MULTILINE
)
_TYPES = {"double": ctypes.c_double, "float": ctypes.c_float}
_serial = count()

Library = dict[str, Callable[..., float]]


@cache
def works(*command: str) -> bool:
    """Whether a compiler knows its flags."""
    return not subprocess.run([*command, "-fsyntax-only", "-"], input="", text=True, capture_output=True).returncode


def machine_flags() -> list[str]:
    """Return -march=native, or nothing where the compiler does not know it."""
    command = shutil.which(os.environ.get("CC", "cc"))
    return ["-march=native"] if command and works(command, "-xc", "-march=native") else []


def compiler(standard: str, name: str = "cc", flags: Iterable[str] = ()) -> list[str]:
    """Return the command that compiles this standard of C or C++, by the usual compiler or Clang, or skip."""
    variable, default = ("CXX", "c++") if "++" in standard else ("CC", "cc")
    usual = os.environ.get(variable, default)
    command = shutil.which(usual if name == "cc" else name.replace("clang", "clang++") if "++" in standard else name)
    if command is None:
        pytest.skip(f"there is no {usual if name == 'cc' else name}")
    arguments = [command, f"-std={standard}", "-x", "c++" if "++" in standard else "c", *flags]
    if not works(*arguments):
        pytest.skip(f"{command} does not know {' '.join(arguments[1:])}")
    return arguments


def build(directory: Path, headers: Iterable[str], standard: str = "c99", flags: Iterable[str] = ()) -> Library:
    """Compile headers together into a shared object; return its functions by name, without "viscopade_"."""
    command = compiler(standard)
    here = directory / f"build{next(_serial)}"
    here.mkdir()
    texts = list(headers)
    for i, text in enumerate(texts):
        (here / f"header{i}.h").write_text(text, encoding="utf-8")
    definitions = list(dict.fromkeys(match for text in texts for match in _DEFINITION.findall(text)))
    includes = [f'#include "header{i}.h"' for i in range(len(texts))]
    source, shared = here / "wrapper.src", here / "wrapper.so"
    source.write_text("\n".join([*includes, *(_wrapper(*definition) for definition in definitions), ""]))
    arguments = [
        *WARNINGS,
        "-O2",
        "-ffp-contract=off",
        *flags,
        "-fPIC",
        "-shared",
        "-o",
        str(shared),
        str(source),
    ]
    subprocess.run([*command, *arguments, "-lm"], check=True, capture_output=True, text=True)
    library = ctypes.CDLL(str(shared))
    return {
        name.removeprefix("viscopade_"): _function(library, kind, name, parameters)
        for kind, name, parameters in definitions
    }


def _wrapper(kind: str, name: str, parameters: str) -> str:
    """Return the definition of a function that the linker can see."""
    arguments = ", ".join(parameter.split()[-1] for parameter in parameters.split(","))
    definition = f"{kind} call_{name}({parameters}) {{ return {name}({arguments}); }}"
    return f'#ifdef __cplusplus\nextern "C"\n#endif\n{definition}'


def _function(library: ctypes.CDLL, kind: str, name: str, parameters: str) -> Callable[..., float]:
    function = library[f"call_{name}"]
    function.restype = _TYPES[kind]
    function.argtypes = [_TYPES[kind]] * len(parameters.split(","))
    return function
