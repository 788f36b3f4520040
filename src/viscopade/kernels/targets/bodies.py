"""The bodies of functions in C and Python: what their templates need, read from the programs of `formulas`."""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping, Sequence
from textwrap import wrap
from typing import Any, NamedTuple

from viscopade.arithmetic.formats import Format
from viscopade.generated import WIDTH
from viscopade.kernels import formulas
from viscopade.kernels.expressions import CodeBranch, Expression, Name, Select, both
from viscopade.kernels.forms.lacunary_kernels import InverseKernel, LacunaryKernel
from viscopade.kernels.forms.quotient import Quotient
from viscopade.kernels.targets.syntax import Syntax, text

Texts = dict[str, Any]


class Language(NamedTuple):
    """C or Python in one type: the syntax, how constants are written, and what ends a line that is continued."""

    form: Format
    syntax: Syntax
    constant: Callable[[float], str]
    continued: str = ""


def of_kernel(kernel: Quotient | LacunaryKernel, language: Language, high: float = math.inf) -> Texts:
    """Return the bodies of a kernel's functions in a type, by name.

    That of a quotient is "epsilon", that of a half-line kernel "portion", and that of an inverse kernel "of_both"; its
    "arguments" are the functions that call it.

    Parameters
    ----------
    kernel : Quotient or LacunaryKernel
    language : Language
    high : float
        The largest v* that reaches a quotient's bodies.

    Raises
    ------
    ValueError
        If the kernel cannot be computed in the type.
    """
    if isinstance(kernel, Quotient):
        return _of_quotient(kernel, language, high)
    variant = kernel.variant(language.form)
    given = formulas.constants(kernel.powers, variant.a, variant.b)
    if isinstance(kernel, InverseKernel):
        parts = [(branch, branch.results["v_star"]) for branch in kernel.branches]
        return {"of_both": _body(None, given, parts, language, _LACUNARY), "arguments": _arguments(kernel, language)}
    parts = [
        (branch, Select(Name("loss"), branch.results["one_minus_epsilon"], branch.results["epsilon"]))
        for branch in kernel.branches
    ]
    return {"portion": _body(formulas.NOT_NEGATIVE, given, parts, language, _LACUNARY)}


def of_speed(language: Language) -> Texts:
    """Return v* of the speed and beta, and beta of v* and the speed."""
    branches = {"v_star": formulas.v_star_branch(), "beta": formulas.beta_branch()}
    return {name: _branch(branch, branch.results[name], language, _QUOTIENT) for name, branch in branches.items()}


def _of_quotient(kernel: Quotient, language: Language, high: float) -> Texts:
    """Return eps as a function of v*: beyond the threshold, if v* may be there, in powers of u = 1/v*."""
    a, b = kernel.rounded(language.form)
    given = formulas.dense(a=a, b=b)
    near, beyond = formulas.epsilon_branches(given)
    parts = [(near, near.results["epsilon"])]
    far = None if len(a) == len(b) == 1 else kernel.threshold(language.form)
    if far is not None and high > 2.0**far:
        guard = Name("v_star") > Name(language.constant(2.0**far))
        parts.insert(0, (beyond._replace(guard=guard), beyond.results["epsilon"]))
    return {"epsilon": _body(formulas.NOT_NEGATIVE, given, parts, language, _QUOTIENT)}


def _arguments(kernel: InverseKernel, language: Language) -> list[Texts]:
    """Return the functions of eps and of 1 - eps: names, the end of the domain if it has one, what they accept."""
    zero, one, portions = formulas.ZERO, formulas.ONE, formulas.portions()
    epsilon, loss = (given for given, _ in portions.values())
    (least, largest), whole = kernel.ends or (0.0, 1.0), kernel.ends is None
    of_epsilon = both(epsilon > zero if whole else epsilon >= Name("least"), epsilon <= one)
    of_loss = both(loss >= zero, loss < one if whole else loss <= Name("largest"))
    return [
        {
            "function": function,
            "name": given.name,
            "end": None if whole else end,
            "accepted": text(accepted, language.syntax),
            "both": ", ".join(text(portion, language.syntax) for portion in portions[function][1]),
        }
        for function, given, end, accepted in (
            ("v_star", epsilon, ("least", language.constant(least)), of_epsilon),
            ("v_star_from_loss", loss, ("largest", language.constant(largest)), of_loss),
        )
    ]


# --- text -------------------------------------------------------------------------------------------------------------


class _Layout(NamedTuple):
    """The indentation of continued lines, inside a branch with a guard and outside, and the columns of expressions."""

    inside: int
    outside: int
    width: int


_QUOTIENT, _LACUNARY = _Layout(12, 8, WIDTH - 32), _Layout(12, 12, WIDTH - 28)


def _body(
    accepted: Expression | None,
    given: Mapping[str, float],
    parts: Sequence[tuple[CodeBranch, Expression]],
    language: Language,
    layout: _Layout,
) -> Texts:
    return {
        "accepted": accepted and text(accepted, language.syntax),
        "constants": [(name, language.constant(value)) for name, value in given.items()],
        "branches": [_branch(*part, language, layout) for part in parts],
    }


def _branch(branch: CodeBranch, result: Expression, language: Language, layout: _Layout) -> Texts:
    """Return guard, statements and result of a program, wrapped."""
    indent = layout.outside if branch.guard is None else layout.inside

    def wrapped(expression: Expression) -> str:
        lines = wrap(text(expression, language.syntax), layout.width)
        return f"{language.continued}\n{' ' * indent}".join(lines)

    return {
        "guard": branch.guard and text(branch.guard, language.syntax),
        "statements": [(name, wrapped(expression)) for name, expression in branch.program],
        "result": wrapped(result),
    }
