"""What a target is: one object with all facts of a language, by which kernels and scenes are written and run.

A target's module is in `viscopade.kernels.targets.languages`, which lists them. No other module names a language.
"""

from __future__ import annotations

import sys
from collections.abc import Callable, Mapping
from dataclasses import dataclass, field
from keyword import iskeyword
from typing import Any

from viscopade.arithmetic.formats import Format
from viscopade.kernels.forms import table_free
from viscopade.kernels.forms.table_free import LIBRARY, MachineArithmetic
from viscopade.kernels.rounding_bounds import ULPS
from viscopade.kernels.targets.syntax import Syntax, shortest

Constant = Callable[[float], str]
Machines = tuple[tuple[str, MachineArithmetic], ...]
DRIVER, FILE, PROGRAM, TOOL = "{driver}", "{file}", "{program}", "{tool}"  # in command lines


@dataclass(frozen=True)
class Number:
    """A language's numbers of one format: the type, its literals and functions."""

    form: Format
    type: str
    syntax: Syntax
    constant: Constant  # from a number to the shortest decimal
    suffix: str = ""  # of functions' names
    machines: Machines = ()  # where compact kernels run, as the end of a sentence, and what is assumed there
    exact: Constant | None = None  # from a coefficient to its text; None: as other constants
    quotient: table_free.Division = table_free.plain  # how compact kernels write quotients

    @classmethod
    def of(
        cls,
        form: Format,
        kind: str,
        suffix: str = "",
        *,
        function: str = "{}",
        literal: str = "{}",
        zero: str = "",
        both: str = "&&",
        machine: MachineArithmetic | None = None,
    ) -> Number:
        """Return numbers whose functions and constants are written by two patterns, from their names and decimals."""
        syntax = Syntax(
            function.format, lambda text: zero if zero and text == "0.0" else literal.format(text), both=both
        )
        machines = (("", LIBRARY[form.name] if machine is None else machine),)
        return cls(form, kind, syntax, lambda value: literal.format(shortest(value, form)), suffix, machines)

    def coefficient(self, value: float) -> str:
        """Return a coefficient's text."""
        return (self.exact or self.constant)(value)


@dataclass(frozen=True)
class Runner:
    """Recipe to compile and run a driver and its included file; in command lines TOOL, DRIVER, … are replaced."""

    tools: tuple[str, ...]  # the first that is there is taken; none: the interpreter that runs viscopade
    ending: str  # of the driver's name
    build: tuple[str, ...] = ()  # empty if nothing is to be compiled
    start: tuple[str, ...] = ()  # empty if it cannot be run
    variable: str | None = None  # in the environment, what names the tool
    package: str | None = None  # that the interpreter needs


EXECUTABLE = "viscopade-check.exe"  # no scene can have this name
START = (f"./{EXECUTABLE}",)


@dataclass(frozen=True)
class FunctionText:
    """How a language writes a file of functions of v*: patterns, whose words stand in braces.

    {function} is the beginning of the function's name, and {given} the name of its argument.
    """

    begin: str  # {name}, {suffix}, {type}, {guard}: a name in capitals with the type
    constant: str  # {constant}, {value}, {type}
    assign: str  # {variable}, {value}, {type}
    result: str  # {value}, {low}, {high}, {type}
    guard: str = ""  # {inside}: a condition, {low}, {high}, {type}, {locals}: the names of variables
    close: str = ""
    call: str = "{function}_{name}({given})"
    outside: str = "They return NaN for an argument outside the domain, and for NaN."
    mathematics: str = ""  # {name}, {suffix}: of the mathematical library's functions; "": as in compact kernels
    power: str = ""  # {base}, {p}, {type}, {suffix}: base^p; "" where nothing is assumed of its accuracy
    file: str = "{head}\n\n{functions}\n"  # {head}, {prelude}, {functions}, {module}
    apart: int = 0  # lines between functions, besides one

    def syntax(self, number: Number) -> Syntax:
        """Return the syntax of numbers, with the names of the mathematical library's functions and powers."""
        power = self.power.format(base="{base}", p="{p}", type=number.type, suffix=number.suffix)
        syntax = number.syntax._replace(power=power)
        if not self.mathematics:
            return syntax
        return syntax._replace(function=lambda name: self.mathematics.format(name=name, suffix=number.suffix))


Renderer = Callable[[Any, str], str]
"""From kernels of a kind, and the command line that makes the file, to the file's text."""

Kinds = Mapping[str, frozenset[str]]
COMPACT: Kinds = {"speed": frozenset({"compact"})}
"""Kinds of kernels in scenes, by what the functions take: of compact languages."""


@dataclass(frozen=True)
class Target:
    """A target: a language, or a library in one. Patterns have names in braces that are replaced."""

    name: str  # in commands and scenes
    suffix: str  # of files' names
    comment: str  # what begins a line of comment
    numbers: tuple[Number, ...]
    runner: Runner  # of the program that calls a scene's file
    renderers: Mapping[str, Renderer] = field(default_factory=dict)  # by id of `requests.KINDS`; none: compact kernels
    kinds: Kinds = field(default_factory=lambda: COMPACT)
    templates: Mapping[str, str] = field(default_factory=dict)  # those with names of their own
    functions: FunctionText | None = None  # of quotients in v*, in compact languages

    # Compact kernels.
    assumed: str = ""  # what their bounds assume of the arithmetic
    log: str = "log2"
    exp: str = "exp2"
    larger: str = ""  # of two numbers, where there may be no logarithm of 0
    next_line: str = "\n" + " " * 8  # what stands between the lines of an expression
    stem: str = "viscopade"  # of the exported file
    prelude: str = ""  # what each file needs before its functions
    place: str = "host"  # where numbers of type float are computed
    device: Runner | None = None  # what compiles the program "check_on_device" besides, without running it

    # Scenes.
    include: str = ""  # how a program takes the file in: {file}, {stem}, {name}; empty if it is pasted
    qualifier: str = "{name}_"  # before functions' names in a call: {name}, {module}
    pair: str = "{qualifier}{pair}"  # a pair's name in a call: {qualifier}, {pair}, {PAIR}, {title}
    element: str = "{array}[{index}]"
    capitals: bool = False  # whether names of arrays are written in capitals
    first_index: int = 0
    kernel_inside: bool = False  # whether the template places the kernel; else it comes first
    is_taken: Callable[[str], bool] = lambda name: False  # whether a header or a module has a file's name already
    longest: int | None = None  # name, in letters

    def number(self, form: str) -> Number:
        """Return the numbers of a format, by its name."""
        return next(number for number in self.numbers if number.form.name == form)

    def syntax(self, number: Number) -> Syntax:
        """Return the syntax of numbers in functions that call roots and powers."""
        if self.functions is None:
            return number.syntax
        return self.functions.syntax(number)

    def template(self, part: str) -> str:
        """Return the template of "table_free" kernels, of a "scene", or of the program that "check"s it."""
        return self.templates.get(part, f"{part}{self.suffix}.jinja")

    @property
    def written(self) -> FunctionText:
        """How functions of v* are written.

        Raises
        ------
        ValueError
            If the language has templates for them.
        """
        if self.functions is None:
            raise ValueError(f"{self.name} writes functions of v* by a template")
        return self.functions

    @property
    def compact(self) -> bool:
        """Whether its kernels are the compact ones."""
        return not self.renderers

    @property
    def formats(self) -> tuple[str, ...]:
        """Names of the formats."""
        return tuple(number.form.name for number in self.numbers)

    @property
    def arguments(self) -> tuple[str, ...]:
        """What the functions of a scene may take."""
        return tuple(self.kinds)


# --- what languages share ---------------------------------------------------------------------------------------------


def taken_in_python(name: str) -> bool:
    """Return whether no module can have a name: a keyword, or the name of a module that it may import."""
    return iskeyword(name) or name in {*sys.stdlib_module_names, "viscopade", "numpy"}


def package_of_python(name: str, package: str, *numbers: Number, **more: Any) -> Target:
    """Return the target of a package for Python, by the name that it is imported by and that of the distribution."""
    return Target(
        name,
        ".py",
        "#",
        numbers,
        Runner((), ".py", (), (TOOL, "-P", DRIVER), package=package),
        templates={part: f"{part}.{name}.py.jinja" for part in ("table_free", "scene", "check")},
        next_line=" \\\n" + " " * 8,
        stem=f"viscopade_{name}",
        include="import {stem} as scene",
        qualifier="scene.",
        pair="{qualifier}{PAIR}",
        capitals=True,
        is_taken=lambda stem: stem == name or taken_in_python(stem),
        **more,
    )


def of_library(functions: str) -> str:
    """Return what is assumed of the usual library of functions."""
    return f"{functions} are within {ULPS} units in the last place of the result; +, -, *, / are those of IEEE 754"


def of_shaders(standard: str) -> str:
    """Return what a standard guarantees of shaders."""
    return (
        "log2 is within 3 units in the last place or 2^-21, exp2(x) within 3 + 2 |x|, a quotient within 2.5, sums and "
        "products are one of the two neighbours, and results below 2^-126 may be replaced by 0: what "
        f"{standard} guarantees"
    )
