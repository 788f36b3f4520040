"""Quotients in v* in compact languages: functions that are NaN outside the kernel's domain.

All texts come from the program of `viscopade.kernels.formulas`; a target's `FunctionText` says how its language
writes a function. C and Python have templates of their own, with more functions.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping, Sequence
from contextlib import suppress
from fractions import Fraction
from functools import partial
from textwrap import indent, wrap
from typing import NamedTuple

from viscopade.arithmetic.formats import FLOAT, Format
from viscopade.generated import WIDTH, comment
from viscopade.kernels import formulas
from viscopade.kernels.expressions import Expression, Name, Program
from viscopade.kernels.forms.kernel import Kernel
from viscopade.kernels.forms.quotient import Quotient
from viscopade.kernels.targets.language import Number, Target
from viscopade.kernels.targets.syntax import text
from viscopade.kernels.targets.wording import (
    distinct,
    preamble,
    variable,
)

_INDENT = 34  # columns that assignments need besides the expression
_QUOTIENT_ULPS = 2.5  # of a quotient in a shader, by the standards
_IN_SHADERS = (
    "A shader may round sums and products to either neighbour: the rounding is up to twice that stated, which is that "
    "of IEEE 754"
)


def render(target: Target, kernels: Sequence[Quotient], command: str, module: str = "viscopade") -> str:
    """Return the text of a file with a function of v* for each kernel, and each type that holds its coefficients.

    Parameters
    ----------
    target : Target
        Of a compact language.
    kernels : sequence of Quotient
        At least one, no two of the same name.
    command : str
        The command line that makes the file.
    module : str
        The name of the module, in languages whose modules have names of their own.

    Raises
    ------
    ValueError
        If a kernel cannot be written in any of the language's types, or `command` is not one line.
    """
    chosen = distinct(kernels)
    functions = _texts(target, chosen)
    calls = [(f"epsilon_{kernel.name}", "v_star", f"eps at {variable(kernel.law)}") for kernel in chosen]
    added = f"{_QUOTIENT_ULPS * FLOAT.epsilon:.1g}"
    in_shaders = f"{_IN_SHADERS}, and the quotient may add {added} eps."
    ends = [
        f"v* = {domain_in(kernel, number.form)[1]:.3g} in type {number.type} ({kernel.label})"
        for kernel in chosen
        for number in target.numbers
        if kernel.interval is None and kernel.end is None and _holds(partial(kernel.rounded, number.form))
    ]
    lines = [*preamble(chosen, command), "", *_usage(target, chosen, calls, ends, in_shaders)]
    return _file(target, lines, functions, module)


def _holds(coefficients: Callable[[], object]) -> bool:
    """Return whether a type holds coefficients."""
    with suppress(ValueError):
        coefficients()
        return True
    return False


def _file(target: Target, lines: Sequence[str], functions: Sequence[str], module: str) -> str:
    blank = "\n\n" + "\n" * target.written.apart
    return target.written.file.format(
        prelude=target.prelude, head=comment(lines, target.comment), functions=blank.join(functions), module=module
    )


def _usage(
    target: Target,
    kernels: Sequence[Kernel],
    calls: Sequence[tuple[str, str, str]],
    ends: Sequence[str],
    in_shaders: str,
) -> list[str]:
    """Return the lines on the functions and on their results."""
    written = target.written
    names = [
        f"    {written.call.replace('{function}_{name}', name).format(given=given)}    {what}"
        for name, given, what in calls
    ]
    types = ", ".join(
        f"{number.type}{f' (its names end in {number.suffix})' * bool(number.suffix)}" for number in target.numbers
    )
    notes = [
        f"For {types}; a type is left out where its coefficients would make the error too large. {written.outside}"
    ]
    if ends:
        notes.append(f"In these functions the domain ends where sums might overflow: at {', '.join(ends)}.")
    if target.place == "shader":
        notes.append(in_shaders)
    return [*names, "", *(line for note in notes for line in wrap(note, WIDTH))]


class WrittenFunction(NamedTuple):
    """A function: the beginning of its name, its argument and the ends of that, its constants, program and result."""

    function: str
    given: str
    ends: tuple[float, float]
    constants: Mapping[str, float]
    program: Program
    result: Expression


def _texts(target: Target, kernels: Sequence[Quotient]) -> list[str]:
    """Return the texts of all functions in each type; refuse a kernel without any."""
    found = list[str]()
    for kernel in kernels:
        before, reason = len(found), ""
        for kind in target.numbers:
            try:
                found.append(_text(target, kernel, kind, function_of_v_star(kernel, kind.form)))
            except ValueError as error:
                reason = str(error)
        if len(found) == before:
            raise ValueError(
                f"{kernel.name} cannot be written in {target.name}: {reason}; accepted are other degrees or targets"
            )
    return found


def function_of_v_star(kernel: Quotient, form: Format) -> WrittenFunction:
    """Return eps of v*."""
    a, b = kernel.rounded(form)
    given = formulas.dense(a=a, b=b)
    branch, _ = formulas.epsilon_branches(given)
    return WrittenFunction(
        "epsilon", "v_star", domain_in(kernel, form), given, branch.program, branch.results["epsilon"]
    )


def _words(kernel: Quotient, number: Number, function: WrittenFunction) -> dict[str, str]:
    low, high = function.ends
    ends = {"low": number.coefficient(low) if low else number.constant(low), "high": number.coefficient(high)}
    return {
        "name": kernel.name,
        "identity": kernel.identity,
        "function": function.function,
        "given": function.given,
        "suffix": number.suffix,
        "guard": f"{kernel.name}_{number.form.name}".upper(),
        "type": number.type,
        **ends,
        "inside": text(formulas.within(function.given, *map(Name, ends.values())), number.syntax),
        "locals": ", ".join(statement.name for statement in function.program),
    }


def _text(target: Target, kernel: Quotient, number: Number, function: WrittenFunction) -> str:
    written, words = target.written, _words(kernel, number, function)
    syntax = written.syntax(number)
    statements = [(name, text(expression, syntax)) for name, expression in function.program]
    lines = [
        *(
            written.constant.format(**words, constant=name, value=number.coefficient(c))
            for name, c in function.constants.items()
        ),
        *([written.guard.format(**words)] if written.guard else []),
        *(
            written.assign.format(**words, variable=name, value=target.next_line.join(wrap(value, WIDTH - _INDENT)))
            for name, value in statements
        ),
        written.result.format(**words, value=text(function.result, syntax)),
    ]
    body = indent("\n".join(line for line in lines), "    ")
    return "\n".join(filter(None, (written.begin.format(**words), body, written.close.format(**words))))


def domain_in(kernel: Quotient, form: Format) -> tuple[float, float]:
    """Return the ends of the domain in a type, rounded inwards; where it has none, sums end before they overflow."""
    if kernel.interval is not None:
        low, high = kernel.interval
        return form.nearest(low, math.ceil), form.nearest(high, math.floor)
    high = Fraction(2) ** kernel.threshold(form)
    if kernel.end is not None:
        high = min(high, Fraction(kernel.end[1]))
    return 0.0, form.nearest(high, math.floor)
