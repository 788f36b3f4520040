"""Quotients in v*, and inverses of laws, in compact languages: functions that are NaN outside the kernel's domain.

All texts come from the program of `viscopade.kernels.forms.formulas`; a target's `FunctionText` says how its language
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
from viscopade.generated import WIDTH
from viscopade.kernels.expressions import Expression, Name, Program, Statement
from viscopade.kernels.forms import formulas
from viscopade.kernels.forms.kernel import Kernel
from viscopade.kernels.forms.lacunary_kernels import InverseKernel
from viscopade.kernels.forms.quotient import Quotient
from viscopade.kernels.forms.rounding_bounds import inverse_end
from viscopade.kernels.targets.language import Number, Target
from viscopade.kernels.targets.syntax import text
from viscopade.kernels.targets.wording import (
    AnyKernel,
    comment,
    distinct,
    lacunary_preamble,
    lasting_kernels,
    preamble,
    variable,
)

_INDENT = 34  # columns that assignments need besides the expression
_QUOTIENT_ULPS = 2.5  # of a quotient in a shader, by the standards
_IN_SHADERS = (
    "A shader may round sums and products to either neighbour: the rounding is up to twice that stated, which is that "
    "of IEEE 754"
)
_ROOT_ULPS = 9.0  # of v*, which goes like up to y^2, by a root: 2 for 1/sqrt(x) and one quotient


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
    functions = _texts(target, chosen, functions_of_v_star)
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


def render_inverse(target: Target, kernels: Sequence[InverseKernel], command: str, module: str = "viscopade") -> str:
    """Return the text of a file with functions of eps, and of 1 - eps, for each kernel of another law than the paper's.

    Parameters and errors are those of `render`; a root of an order above 2 is refused where nothing is known of pow.
    """
    for kernel in kernels:
        if kernel.root < Fraction(1, 2) and not target.written.power:
            raise ValueError(
                f"{kernel.name} takes a root of order {kernel.root.denominator}, and nothing is guaranteed of pow in "
                f"{target.name}: accepted for it are laws with v* = kappa or kappa^(1/2)"
            )
    functions = _texts(target, kernels, functions_of_epsilon)
    calls = [
        (f"{function}_{kernel.name}", given, f"{variable(kernel.law)} at {what}")
        for kernel in kernels
        for function, given, what in (
            ("v_star", "epsilon", "eps"),
            ("v_star_from_loss", "one_minus_epsilon", "1 - eps"),
        )
    ]
    root = max((_ROOT_ULPS for kernel in kernels if kernel.root < 1), default=0.0)
    added = f"{(2 * _QUOTIENT_ULPS + root) * FLOAT.epsilon:.1g}"
    in_shaders = f"{_IN_SHADERS}, and quotients and roots may add {added} v*."
    ends = [
        f"eps = {float(_least_epsilon(kernel, number.form)):.3g} in type {number.type} ({kernel.label})"
        for kernel in kernels
        for number in target.numbers
        if not kernel.epsilon_low and _holds(partial(kernel.variant, number.form))
    ]
    lines = [*lacunary_preamble(kernels, command, []), "", *_usage(target, kernels, calls, ends, in_shaders)]
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
        head=comment(lines, target.comment), functions=blank.join(functions), module=module
    )


def _usage(
    target: Target,
    kernels: Sequence[Kernel],
    calls: Sequence[tuple[str, str, str]],
    ends: Sequence[str],
    in_shaders: str,
) -> list[str]:
    """Return the lines on the functions, on their results, and on names that last."""
    written = target.written
    first = {kernel.name: kernel.lasting_name for kernel in lasting_kernels(kernels)}
    stay = [
        (name.replace(today, lasting), given, "the same; the name stays when a better kernel comes")
        for name, given, _ in calls
        for today, lasting in first.items()
        if name.endswith(today)
    ]
    names = [
        f"    {written.call.replace('{function}_{name}', name).format(given=given)}    {what}"
        for name, given, what in (*calls, *stay)
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


def _texts(
    target: Target, kernels: Sequence[AnyKernel], functions: Callable[[AnyKernel, Format], list[WrittenFunction]]
) -> list[str]:
    """Return the texts of all functions in each type, with those of lasting names; refuse a kernel without any."""
    found, stay = list[str](), {kernel.name for kernel in lasting_kernels(kernels)}
    for kernel in kernels:
        before, reason = len(found), ""
        for kind in target.numbers:
            try:
                of_type = functions(kernel, kind.form)
            except ValueError as error:
                reason = str(error)
                continue
            found += (_text(target, kernel.name, kind, function) for function in of_type)
            if kernel.name in stay:
                found += (_forward(target, kernel, kind, function) for function in of_type)
        if len(found) == before:
            raise ValueError(
                f"{kernel.name} cannot be written in {target.name}: {reason}; accepted are other degrees or targets"
            )
    return found


def functions_of_v_star(kernel: Quotient, form: Format) -> list[WrittenFunction]:
    """Return eps of v*."""
    a, b = kernel.rounded(form)
    given = formulas.dense(a=a, b=b)
    branch, _ = formulas.epsilon_branches(given)
    found = WrittenFunction(
        "epsilon", "v_star", domain_in(kernel, form), given, branch.program, branch.results["epsilon"]
    )
    return [found]


def functions_of_epsilon(kernel: InverseKernel, form: Format) -> list[WrittenFunction]:
    """Return v* of eps, and of 1 - eps: no branch for small eps, so that eps ends before a sum may overflow."""
    variant = kernel.variant(form)
    given = formulas.constants(kernel.powers, variant.a, variant.b)
    branch = kernel.branches[0]
    low = _least_epsilon(kernel, form)
    ends = {"v_star": (low, Fraction(1)), "v_star_from_loss": (Fraction(0), 1 - low)}
    found = []
    for function, (argument, both) in formulas.portions().items():
        least, most = ends[function]
        domain = form.nearest(least, math.ceil), min(form.nearest(most, math.floor), 1.0)
        start = (Statement(name, e) for name, e in zip(("epsilon", "loss"), both, strict=True) if e != Name(name))
        program = (*start, *branch.program)
        found.append(WrittenFunction(function, argument.name, domain, given, program, branch.results["v_star"]))
    return found


def _least_epsilon(kernel: InverseKernel, form: Format) -> Fraction:
    variant = kernel.variant(form)
    low = kernel.epsilon_low or 1 / inverse_end(kernel.form, variant.a, variant.b, form) ** int(1 / kernel.root)
    return max(low, Fraction(2) ** (1 - form.largest))


def _words(name: str, number: Number, function: WrittenFunction) -> dict[str, str]:
    low, high = function.ends
    ends = {"low": number.coefficient(low) if low else number.constant(low), "high": number.coefficient(high)}
    guard = name if function.function == "epsilon" else f"{function.function}_{name}"
    return {
        "name": name,
        "function": function.function,
        "given": function.given,
        "suffix": number.suffix,
        "guard": f"{guard}_{number.form.name}".upper(),
        "type": number.type,
        **ends,
        "inside": text(formulas.within(function.given, *map(Name, ends.values())), number.syntax),
        "locals": ", ".join(statement.name for statement in function.program),
    }


def _forward(target: Target, kernel: Kernel, number: Number, function: WrittenFunction) -> str:
    """Return the function with the name that lasts, which calls today's."""
    written, words = target.written, _words(kernel.lasting_name, number, function)
    argument = written.argument.format(given=function.given)
    call = written.call.format(function=function.function, name=f"{kernel.name}{number.suffix}", given=argument)
    body = indent(written.result.format(**words, value=call), "    ")
    return "\n".join(filter(None, (written.begin.format(**words), body, written.close.format(**words))))


def _text(target: Target, name: str, number: Number, function: WrittenFunction) -> str:
    written, words = target.written, _words(name, number, function)
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
