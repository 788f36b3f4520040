"""Python modules of quotients, half-line and inverse kernels: files without dependencies, to copy into programs."""

from __future__ import annotations

import math
from collections.abc import Sequence
from fractions import Fraction

from viscopade.arithmetic.formats import DOUBLE
from viscopade.generated import template
from viscopade.kernels.expressions import CodeBranch
from viscopade.kernels.forms import formulas
from viscopade.kernels.forms.lacunary_kernels import InverseKernel, LacunaryKernel
from viscopade.kernels.forms.quotient import Quotient
from viscopade.kernels.targets.syntax import MATH_MODULE, text
from viscopade.kernels.targets.wording import (
    comment,
    distinct,
    functions_of,
    head_of,
    lasting,
)


def render(kernels: Sequence[Quotient | LacunaryKernel], command: str) -> str:
    """Return the text of a module with the same results as the C functions of type double.

    Parameters
    ----------
    kernels : sequence of Quotient, or of LacunaryKernel
        At least one, no two of the same name.
    command : str
        The command line that makes the file.

    Raises
    ------
    ValueError
        If a kernel does not fit type double, or `command` is not one line.
    """
    name, words = head_of(distinct(kernels), command, [DOUBLE])
    return template(__name__, f"{name}.py.jinja").render(
        words,
        head=comment(words["lines"], "#"),
        blocks=[_quotient(kernel) if isinstance(kernel, Quotient) else _lacunary(kernel) for kernel in kernels],
        lasting=lasting((kernel, functions_of(kernel, [DOUBLE])) for kernel in kernels),
    )


def _quotient(kernel: Quotient) -> dict[str, object]:
    """Return what the template needs of one kernel."""
    a, b = kernel.rounded(DOUBLE)
    end = None if kernel.end is None else (kernel.end[0], DOUBLE.nearest(Fraction(kernel.end[1]), math.floor))
    interval = None if kernel.interval is None else tuple(map(DOUBLE.nearest, kernel.interval, (math.ceil, math.floor)))
    found = kernel.derivative(DOUBLE)
    return {
        "kernel": kernel,
        "a": a,
        "b": b,
        "threshold": kernel.threshold(DOUBLE),
        "end": end,
        "interval": interval,
        "t": None if found is None else found[0][0],
    }


def _lacunary(kernel: LacunaryKernel) -> dict[str, object]:
    variant = kernel.variant(DOUBLE)
    constants = formulas.constants(kernel.powers, variant.a, variant.b)
    return {
        "kernel": kernel,
        "constants": [(name, repr(c)) for name, c in constants.items()],
        "branches": list(map(_branch, kernel.branches)),
        "ends": kernel.ends if isinstance(kernel, InverseKernel) else None,
    }


def _branch(branch: CodeBranch) -> dict[str, object]:
    return {
        "guard": branch.guard and text(branch.guard, MATH_MODULE),
        "statements": [(name, text(expression, MATH_MODULE)) for name, expression in branch.program],
        "results": {name: text(expression, MATH_MODULE) for name, expression in branch.results.items()},
    }
