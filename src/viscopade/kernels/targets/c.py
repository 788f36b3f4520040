"""C headers of quotients, half-line and inverse kernels: C99, also valid C++ from C++98 on; they need math.h only."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from textwrap import wrap
from typing import Any

from viscopade.arithmetic.formats import DOUBLE, FLOAT, FORMATS, Format
from viscopade.generated import WIDTH, template
from viscopade.kernels.expressions import CodeBranch, Expression, Name, both
from viscopade.kernels.forms import formulas
from viscopade.kernels.forms.lacunary_kernels import HALF_LINE, InverseKernel, LacunaryKernel
from viscopade.kernels.forms.quotient import Quotient
from viscopade.kernels.targets.syntax import constant_of_c, of_c, text
from viscopade.kernels.targets.wording import (
    OF_EXPONENTS,
    comment,
    distinct,
    functions_of,
    head_of,
    lasting,
)

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


def render(kernels: Sequence[Quotient | LacunaryKernel], command: str) -> str:
    """Return the text of a header with functions of type double and float for every kernel.

    The float functions of a kernel are left out, with a comment that says why, where a coefficient is not a normal
    number of type float, the sums cannot be kept below its largest number, or nothing is proven in that type.

    Parameters
    ----------
    kernels : sequence of Quotient, or of LacunaryKernel
        At least one, no two of the same name.
    command : str
        The command line that makes the file.

    Raises
    ------
    ValueError
        If a kernel does not fit type double either, or `command` is not one line.
    """
    blocks = [_block(kernel) for kernel in distinct(kernels)]
    types = [[FORMATS[variant["type"]] for variant in block["variants"]] for block in blocks]
    forms = [form for form in FORMATS.values() if any(form in of for of in types)]
    name, words = head_of(kernels, command, forms)
    patterns = {kernel.pattern for kernel in kernels if isinstance(kernel, Quotient)}
    names = [line for form in NAMES if form in patterns for line in wrap(f"NAME is {form} {NAMES[form]}", WIDTH)]
    return template(__name__, f"{name}.h.jinja").render(
        {"names": names} | words,
        head=comment(words["lines"], " *"),
        blocks=blocks,
        lasting=lasting((kernel, functions_of(kernel, of)) for kernel, of in zip(kernels, types, strict=True)),
        has_derivative=any(variant.get("derivative") for block in blocks for variant in block["variants"]),
        has_ends=kernels[0].of_speed or any(block["warning"] for block in blocks),
    )


def render_functions(kernels: Sequence[LacunaryKernel]) -> str:
    """Return the header's text after its first comment, without the names that last."""
    return template(__name__, "functions.h.jinja").render(blocks=list(map(_block, kernels)), of_speed=True)


def _block(kernel: Quotient | LacunaryKernel) -> dict[str, Any]:
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
        "kind": kernel.kind if isinstance(kernel, LacunaryKernel) else "quotient",
        "proven": [line for fact in kernel.proven for line in wrap(fact, WIDTH)],
        "guard": f"VISCOPADE_{kernel.name.upper()}",
        "variants": variants,
        "warning": _warning(kernel) if isinstance(kernel, Quotient) else None,
        "missing": reasons,
    }


def _warning(kernel: Quotient) -> str | None:
    if kernel.end is not None:
        return "from there on, what these functions return is NOT a coefficient of restitution."
    return None if kernel.interval is None else "outside this interval nothing is known of the error."


def _variant(kernel: Quotient | LacunaryKernel, form: Format) -> dict[str, object]:
    """Return what the templates need of one kernel's functions in one type."""
    made = _quotient(kernel, form) if isinstance(kernel, Quotient) else _lacunary(kernel, form)
    return {
        "type": form.name,
        "suffix": form.suffix,
        "zero": form.decimal(0.0),
        "one": form.decimal(1.0),
        "accepted": {name: text(condition, of_c(form)) for name, condition in _ACCEPTED.items()},
        "fifth": f"0.2{form.suffix}",
        "nan": f'nan{form.suffix}("")',
        **made,
    }


_ACCEPTED = {
    "v_star": Name("v_star") >= formulas.ZERO,
    "epsilon": formulas.within("epsilon", Name("least"), formulas.ONE),
    "loss": formulas.within("one_minus_epsilon", formulas.ZERO, Name("largest")),
    "any_epsilon": both(Name("epsilon") > formulas.ZERO, Name("epsilon") <= formulas.ONE),
    "any_loss": both(Name("one_minus_epsilon") >= formulas.ZERO, Name("one_minus_epsilon") < formulas.ONE),
}


def _quotient(kernel: Quotient, form: Format) -> dict[str, object]:
    a, b = kernel.rounded(form)
    given, derivative = formulas.dense(a=a, b=b), kernel.derivative(form)
    far = None if len(a) == len(b) == 1 else kernel.threshold(form)
    body = _in_v_star(given, formulas.epsilon_branches(given), "epsilon", far, form)
    if derivative is None:
        return {"body": body, "derivative": None}
    (t, b), far = derivative
    given = formulas.dense(t=t, b=b)
    slope = _in_v_star(given, formulas.derivative_branches(given), "derivative", far, form)
    return {"body": body, "derivative": slope}


def _in_v_star(
    given: Mapping[str, float], branches: tuple[CodeBranch, CodeBranch], name: str, far: int | None, form: Format
) -> dict[str, object]:
    """Return a function of v*: beyond 2^far, if there is that, in powers of u = 1/v*."""
    near, beyond = branches
    parts = [_branch(near, near.results[name], form, 4, WIDTH - 32)]
    if far is not None:
        guard = f"v_star > {constant_of_c(2.0**far, form)}"
        parts.insert(0, _branch(beyond, beyond.results[name], form, 8, WIDTH - 32) | {"guard": guard})
    return {"constants": _constants(given, form), "branches": parts}


def _lacunary(kernel: LacunaryKernel, form: Format) -> dict[str, object]:
    variant = kernel.variant(form)
    ends = kernel.ends if isinstance(kernel, InverseKernel) else None
    parts = []
    for branch in kernel.branches:
        result = branch.results["epsilon" if kernel.kind == HALF_LINE else "v_star"]
        part = _branch(branch, result, form, 8, WIDTH - 28)
        if kernel.kind == HALF_LINE:
            part["result"] = f"loss ? {text(branch.results['one_minus_epsilon'], of_c(form))} : {part['result']}"
        parts.append(part)
    return {
        "body": {
            "constants": _constants(formulas.constants(kernel.powers, variant.a, variant.b), form),
            "branches": parts,
        },
        "ends": ends and [constant_of_c(end, form) for end in ends],
    }


def _constants(given: Mapping[str, float], form: Format) -> list[tuple[str, str]]:
    return [(name, constant_of_c(value, form)) for name, value in given.items()]


def _branch(branch: CodeBranch, result: Expression, form: Format, indent: int, width: int) -> dict[str, object]:
    """Return guard, statements and result of a program, wrapped, with further lines indented by more than `indent`."""
    language = of_c(form)

    def wrapped(expression: Expression) -> str:
        return f"\n{' ' * (indent + 4)}".join(wrap(text(expression, language), width))

    return {
        "guard": branch.guard and text(branch.guard, language),
        "statements": [(name, wrapped(expression)) for name, expression in branch.program],
        "result": wrapped(result),
    }
