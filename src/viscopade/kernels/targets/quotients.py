"""Quotients of polynomials in v* in the compact languages: functions that are NaN outside the kernel's domain.

All texts come from the program of `viscopade.kernels.forms.formulas`; a target's `FunctionText` says how its language
writes a function. C and Python have templates of their own, with more functions.
"""

from __future__ import annotations

import math
from collections.abc import Iterator, Sequence
from contextlib import suppress
from fractions import Fraction
from textwrap import indent, wrap

from viscopade.arithmetic.formats import FLOAT
from viscopade.generated import WIDTH
from viscopade.kernels.forms import formulas
from viscopade.kernels.forms.quotient import Quotient
from viscopade.kernels.targets.language import Number, Target
from viscopade.kernels.targets.syntax import text
from viscopade.kernels.targets.wording import distinct, preamble, variable

_INDENT = 34  # columns that assignments need besides the expression
_QUOTIENT_ULPS = 2.5  # of a quotient in a shader, by the standards


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
    functions = [function for kernel in chosen for function in _functions(target, kernel)]
    lines = [*preamble(chosen, command), "", *_usage(target, chosen)]
    head = "\n".join(f"{target.comment} {line}".rstrip() for line in lines)
    blank = "\n\n" + "\n" * target.written.apart
    return target.written.file.format(head=head, functions=blank.join(functions), module=module)


def _usage(target: Target, kernels: Sequence[Quotient]) -> list[str]:
    """Return the lines on the functions and on their results."""
    written = target.written
    names = [f"    {written.call.format(name=kernel.name)}    eps at {variable(kernel.law)}" for kernel in kernels]
    types = ", ".join(
        f"{number.type}{f' (names that end in {number.suffix})' * bool(number.suffix)}" for number in target.numbers
    )
    ends = [
        f"{_domain(kernel, number)[1]:.3g} in type {number.type}"
        for kernel in kernels
        for number in target.numbers
        if kernel.interval is None and kernel.end is None and _holds(kernel, number)
    ]
    notes = [f"For {types}, where the type holds the coefficients. {written.outside}"]
    if ends:
        notes.append(f"Here the domain ends where sums might overflow: at v* = {', '.join(ends)}.")
    if target.place == "shader":
        added = f"{_QUOTIENT_ULPS * FLOAT.epsilon:.1g}"
        notes.append(f"The quotient in a shader may add {added} eps to the rounding stated, which is that of IEEE 754.")
    return [*names, "", *(line for note in notes for line in wrap(note, WIDTH))]


def _holds(kernel: Quotient, number: Number) -> bool:
    """Return whether a type holds a kernel's coefficients."""
    with suppress(ValueError):
        kernel.rounded(number.form)
        return True
    return False


def _functions(target: Target, kernel: Quotient) -> Iterator[str]:
    """Yield the functions of a kernel; refuse a language without any."""
    number, reason = 0, ""
    for kind in target.numbers:
        try:
            a, b = kernel.rounded(kind.form)
        except ValueError as error:
            reason = str(error)
            continue
        number += 1
        yield _function(target, kernel, kind, a, b)
    if not number:
        raise ValueError(
            f"{kernel.name} cannot be written in {target.name}: {reason}; accepted are other degrees or targets"
        )


def _function(target: Target, kernel: Quotient, number: Number, a: Sequence[float], b: Sequence[float]) -> str:
    written = target.written
    given = formulas.dense(a=a, b=b)
    branch, _ = formulas.epsilon_branches(given)
    low, high = _domain(kernel, number)
    words = {
        "name": kernel.name,
        "suffix": number.suffix,
        "guard": f"{kernel.name}_{number.form.name}".upper(),
        "type": number.type,
        "low": number.coefficient(low),
        "high": number.coefficient(high),
    }
    statements = [(name, text(expression, number.syntax)) for name, expression in branch.program]
    lines = [
        *(written.constant.format(**words, constant=name, value=number.coefficient(c)) for name, c in given.items()),
        *([written.guard.format(**words)] if written.guard else []),
        *(
            written.assign.format(**words, variable=name, value=target.next_line.join(wrap(value, WIDTH - _INDENT)))
            for name, value in statements
        ),
        written.result.format(**words, value=text(branch.results["epsilon"], number.syntax)),
    ]
    body = indent("\n".join(line for line in lines), "    ")
    return "\n".join(filter(None, (written.begin.format(**words), body, written.close.format(**words))))


def _domain(kernel: Quotient, number: Number) -> tuple[float, float]:
    """Return the ends of the domain in a type, rounded inwards; where it has none, sums end before they overflow."""
    if kernel.interval is not None:
        low, high = kernel.interval
        return number.form.nearest(low, math.ceil), number.form.nearest(high, math.floor)
    high = Fraction(2) ** kernel.threshold(number.form)
    if kernel.end is not None:
        high = min(high, Fraction(kernel.end[1]))
    return 0.0, number.form.nearest(high, math.floor)
