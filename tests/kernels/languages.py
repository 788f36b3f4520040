"""Ways to run generated code: compilers and interpreters with flags, and translations of languages without a tool here.

A test is skipped where its tool is missing. Julia runs translated to Python, too, so that its numbers and expressions
are checked everywhere.
"""

from __future__ import annotations

import re
import shutil
import subprocess
import sys
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from importlib.util import find_spec
from pathlib import Path

import numpy as np
import pytest

from tests import compiled
from viscopade.arithmetic.formats import DOUBLE, FLOAT
from viscopade.kernels.write import runners
from viscopade.kernels.write.language import Language
from viscopade.kernels.write.languages import language as language_of

FORMS = {"double": DOUBLE, "float": FLOAT}
TYPES = {"double": np.float64, "float": np.float32}
BITS = {"double": np.uint64, "float": np.uint32}


def tool(name: str) -> str:
    """Return the command's path, or skip the test."""
    command = shutil.which(name)
    if command is None:
        pytest.skip(f"{name} is not installed")
    return command


def built(directory: Path, *command: str) -> None:
    """Run a compiler in a directory."""
    done = subprocess.run(command, cwd=directory, capture_output=True, text=True)
    assert not done.returncode, done.stdout + done.stderr


# --- translations -----------------------------------------------------------------------------------------------------


def julia_as_python(text: str, form: str) -> str:
    kind = {"double": "Float64", "float": "Float32"}[form]
    text = re.sub(r"(?<=\d)f(-?\d+)\b", r"e\1", re.sub(r"#.*", "", text)).replace(")^", ")**").replace("&&", "and")
    text = re.sub(r"(?<=[-+*/:(?])\n +", " ", text)
    text = re.sub(r"\(([^()?]+) \? ([^()?]+) : ([^()?]+)\)", r"(\2 if \1 else \3)", text)
    text = re.sub(r"= (.+) \? (.+) : (.+)", r"= \2 if \1 else \3", text)
    text = re.sub(r"if !(.*)", r"if not \1:", text)
    text = re.sub(r"^( +if (?!not).*)", r"\1:", text, flags=re.M)
    text = re.sub(r"^(    \w+ = )(-?\d[\d.e+-]*)$", rf"\1{kind}(\2)", text, flags=re.M)
    functions = re.findall(rf"function (\w+)\(([^)]*::{kind})\)\n(.*?)^end", text, re.M | re.S)
    lines = ["import numpy as np", "from numpy import exp2, log2, sqrt, cbrt", "np.seterr(all='ignore')"]
    lines += ["NaN, Float64, Float32 = np.nan, np.float64, np.float32"]
    for name, arguments, body in functions:
        given = arguments.replace(f"::{kind}", "")
        typed = "; ".join(f"{x} = {kind}({x})" for x in given.split(", "))
        lines.append(f"def {name}({given}):\n    {typed}\n{re.sub('^ *end$', '', body, flags=re.M)}")
    return "\n".join(lines)


def for_numba(text: str, _: str) -> str:
    return text + (
        "\nimport numba\nfor name, function in list(globals().items()):\n"
        "    if callable(function): globals()[name] = numba.njit(error_model='numpy')(function)\n"
    )


def for_jax(text: str, form: str) -> str:
    switch = f"import jax\njax.config.update('jax_enable_x64', {form == 'double'})\nimport jax.numpy as jnp\n"
    return switch + text.replace("xp=np", "xp=jnp")


# --- all --------------------------------------------------------------------------------------------------------------


@dataclass(frozen=True)
class Way:
    """A way to run the files of a language.

    Attributes
    ----------
    language : str
    flags : tuple of str
        For its compiler.
    standard : str
        Of C or C++, if it is to be compiled so.
    compiler : str
        Its name, if it is not the usual one.
    package : str
        Of Python, that is needed besides.
    translated : (str, callable) or None
        Another language whose runner is taken, and the translation from a text and the name of a type.
    exact : bool
        Whether operations are those of the text, without FMA contraction.
    flushed : bool
        Whether subnormal numbers are set to 0.
    """

    language: str
    flags: tuple[str, ...] = ()
    standard: str = ""
    compiler: str = ""
    package: str = ""
    translated: tuple[str, Callable[[str, str], str]] | None = None
    exact: bool = True
    flushed: bool = False

    @property
    def written(self) -> Language:
        """The language of the text."""
        return language_of(self.language)

    def program(
        self, form: str, text: str, calls: Mapping[str, Sequence[str]], directory: Path, stem: str | None = None
    ) -> Callable[..., dict[str, np.ndarray]]:
        """Return the functions of a file: from columns of arguments to a column for each.

        `calls` has names of functions and of their arguments.
        """
        language, number = self.written, self.written.number(form)
        expressions = [
            language.call.format(
                name=name,
                Name=name[:1].upper() + name[1:],
                suffix=number.suffix,
                arguments=", ".join(runners.ARGUMENTS[: len(arguments)]),
            )
            for name, arguments in calls.items()
        ]
        if self.translated:
            language, text = language_of(self.translated[0]), self.translated[1](text, form)
            number = language.number(form) if form in language.forms else language.numbers[0]
            expressions = [call.replace("Viscopade.", "viscopade.") for call in expressions]
        file = f"{stem or language.stem}{language.ending}", text
        given = runners.build(language, number, file, expressions, self._tool(language), directory, self.flags)

        def compute(*columns: np.ndarray, **environment: str) -> dict[str, np.ndarray]:
            return dict(zip(calls, given(*columns, environment=environment).astype(TYPES[form]), strict=True))

        return compute

    def _tool(self, language: Language) -> runners.Tool:
        if self.package and find_spec(self.package) is None:
            pytest.skip(f"the Python package {self.package} is not installed")
        if self.standard:
            return runners.Tool(tuple(compiled.compiler(self.standard, self.compiler or "cc")), "")
        if self.compiler:
            return runners.Tool((tool(self.compiler),), "")
        found = runners.find_tool(language.run)
        if found is None:
            pytest.skip(f"there is no {runners.missing(language.run)}")
        return runners.Tool((sys.executable,), "") if not language.run.tools else found


_C = (*compiled.WARNINGS, "-ffp-contract=off")
WAYS = {
    "C": Way("c", _C, "c99"),
    "C, fused": Way(
        "c", (*compiled.WARNINGS, "-O3", "-ffp-contract=fast", *compiled.machine_flags()), "c99", exact=False
    ),
    "C, Clang": Way("c", _C, "c99", "clang"),
    **{f"C as {standard}": Way("c", _C, standard) for standard in compiled.STANDARDS[1:]},
    "CUDA, host": Way("cuda", _C, "c99"),
    "CUDA, host, C++": Way("cuda", _C, "c++98"),
    "CUDA, host, nvcc": Way("cuda", ("-x", "cu", "-arch=sm_75", "-Werror", "all-warnings"), compiler="nvcc"),
    "Python": Way("python"),
    "Python, Numba": Way("python", package="numba", translated=("python", for_numba)),
    "arrays": Way("arrays"),
    "arrays, JAX": Way("arrays", package="jax", translated=("arrays", for_jax), exact=False, flushed=True),
    "Fortran": Way(
        "fortran",
        ("-std=f2018", "-Wall", "-Wextra", "-Wpedantic", "-Wconversion", "-Werror", "-ffp-contract=off"),
    ),
    "Rust": Way("rust", ("-D", "warnings")),
    "Julia": Way("julia"),
    "Julia as Python": Way("julia", translated=("python", julia_as_python)),
    "JavaScript": Way("javascript"),
    "JavaScript, script": Way("script"),
    "Warp": Way("warp", package="warp", exact=False),
    "C sharp": Way("csharp"),
}
