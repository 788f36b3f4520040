"""C header of quotient kernels: C99, also valid C++ from C++98 on; it needs math.h only."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from textwrap import wrap
from typing import Any

from viscopade.arithmetic.formats import DOUBLE, FLOAT, FORMATS, Format
from viscopade.generated import WIDTH, template
from viscopade.kernels.expressions import CodeBranch
from viscopade.kernels.forms import formulas
from viscopade.kernels.forms.quotient import Quotient
from viscopade.kernels.targets.syntax import constant_of_c, of_c, text
from viscopade.kernels.targets.wording import (
    OF_EXPONENTS,
    distinct,
    functions_of,
    lasting,
    lasting_lines,
    preamble,
    takes_speed,
    variable,
)
from viscopade.kernels.v_star import speed_note

_PADE = "for the Pade approximant [M/N]"
_MINIMAX = "for the best approximant [M/N] up to v* = V, with the proven bound B of its error"
_SPELLING = "(p stands for the decimal point, m for the minus of an exponent)"
NAMES = {
    "pade_M_N": f"{_PADE}.",
    "pade_M_N_aA_bB": f"{_PADE} {OF_EXPONENTS}.",
    "minimax_M_N_vV_B": f"{_MINIMAX} {_SPELLING}.",
    "minimax_M_N_aA_bB_vV_B": f"{_MINIMAX} {_SPELLING}, {OF_EXPONENTS}.",
    "minimax_M_N_aA_bB_all_B": f"{_MINIMAX.replace('up to v* = V', 'for all v*')} {_SPELLING}, {OF_EXPONENTS}.",
}
"""By the form of the functions' names, what they stand for."""


def render(kernels: Sequence[Quotient], command: str) -> str:
    """Return the header's text, with functions of type double and float for every kernel.

    The float functions of a kernel are left out, with a comment that says why, where a coefficient is not a
    normal number of type float or the sums cannot be kept below its largest number.

    Parameters
    ----------
    kernels : sequence of Quotient
        At least one, no two of the same degrees.
    command : str
        The command line that makes the file.

    Raises
    ------
    ValueError
        If a kernel does not fit type double either, or `command` is not one line.
    """
    blocks = [_block(kernel) for kernel in distinct(kernels)]
    types = {variant["type"] for block in blocks for variant in block["variants"]}
    note = speed_note(kernels, [f for f in FORMATS.values() if f.name in types])
    lines = [*preamble(kernels, command), *note, *lasting_lines(kernels)]
    head = "\n".join(f" * {line}".rstrip() for line in lines)
    has_derivative = any(kernel.derivative(DOUBLE) for kernel in kernels)
    patterns = {kernel.pattern for kernel in kernels}
    names = [line for form in NAMES if form in patterns for line in wrap(f"NAME is {form} {NAMES[form]}", WIDTH)]
    return template(__name__, "quotient.h.jinja").render(
        head=head,
        blocks=blocks,
        names=names,
        has_derivative=has_derivative,
        lasting=lasting(
            (block["kernel"], functions_of(block["kernel"], (FORMATS[v["type"]] for v in block["variants"])))
            for block in blocks
        ),
        variable=variable(kernels[0].law),
        of_speed=takes_speed(kernels[0]),
        has_ends=takes_speed(kernels[0]) or any(kernel.interval or kernel.end for kernel in kernels),
    )


def _block(kernel: Quotient) -> dict[str, Any]:
    """Return what the template needs of one kernel."""
    variants, reasons = [], []
    for form in (DOUBLE, FLOAT):
        try:
            variants.append(_variant(kernel, form))
        except ValueError as error:
            if form == DOUBLE:
                raise
            reasons += wrap(f"There are no functions of type {form.name}: {error}.", WIDTH)
    return {
        "kernel": kernel,
        "proven": [line for fact in kernel.proven for line in wrap(fact, WIDTH)],
        "guard": f"VISCOPADE_{kernel.name.upper()}",
        "variants": variants,
        "missing": "\n * ".join(reasons),
    }


def _variant(kernel: Quotient, form: Format) -> dict[str, object]:
    """Return what the template needs of one kernel's functions in one type."""
    a, b = kernel.rounded(form)
    given = formulas.dense(a=a, b=b)
    return {
        "type": form.name,
        "suffix": form.suffix,
        "zero": form.decimal(0.0),
        "one": form.decimal(1.0),
        "nan": f'nan{form.suffix}("")',
        **_branches(given, formulas.epsilon_branches(given), "epsilon", kernel.threshold(form), form),
        "is_constant": len(a) == len(b) == 1,
        "derivative": _derivative(kernel, form),
    }


def _derivative(kernel: Quotient, form: Format) -> dict[str, object] | None:
    """Return what the template needs of the derivative v* T/D^2 in one type."""
    found = kernel.derivative(form)
    if found is None:
        return None
    (t, b), threshold = found
    given = formulas.dense(t=t, b=b)
    return _branches(given, formulas.derivative_branches(given), "derivative", threshold, form)


def _branches(
    given: Mapping[str, float], branches: tuple[CodeBranch, CodeBranch], result: str, threshold: int, form: Format
) -> dict[str, object]:
    """Return the constants, and the statements and result of the programs in v_star and in u = 1/v_star."""
    return {
        "constants": [(name, constant_of_c(value, form)) for name, value in given.items()],
        "branches": [_branch(branch, result, form, 4 * (i + 1)) for i, branch in enumerate(branches)],
        "far_threshold": constant_of_c(2.0**threshold, form),
    }


def _branch(branch: CodeBranch, result: str, form: Format, indent: int) -> dict[str, object]:
    language = of_c(form)
    statements = [(name, _wrapped(text(expression, language), indent)) for name, expression in branch.program]
    return {"statements": statements, "result": _wrapped(text(branch.results[result], language), indent)}


def _wrapped(expression: str, indent: int) -> str:
    """Wrap an expression that begins somewhere in a line, with its further lines indented."""
    return f"\n{' ' * (indent + 4)}".join(wrap(expression, WIDTH - 32, drop_whitespace=True))
