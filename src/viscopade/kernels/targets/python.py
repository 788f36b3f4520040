"""Python modules of quotients and inverse kernels: files without dependencies, to copy into programs."""

from __future__ import annotations

import math
from collections.abc import Sequence
from fractions import Fraction

from viscopade.arithmetic.formats import DOUBLE
from viscopade.generated import comment, template
from viscopade.kernels.forms.lacunary_kernels import InverseKernel
from viscopade.kernels.forms.quotient import Quotient
from viscopade.kernels.targets import bodies
from viscopade.kernels.targets.syntax import MATH_MODULE
from viscopade.kernels.targets.wording import distinct, head_of

_LANGUAGE = bodies.Language(DOUBLE, MATH_MODULE, repr, continued=" \\")


def render(kernels: Sequence[Quotient | InverseKernel], command: str) -> str:
    """Return the text of a module with the same results as the C functions of type double.

    Parameters
    ----------
    kernels : sequence of Quotient, or of InverseKernel
        At least one, no two of the same name.
    command : str
        The command line that makes the file.

    Raises
    ------
    ValueError
        If a kernel does not fit type double, or `command` is not one line.
    """
    words = head_of(distinct(kernels), command, [DOUBLE])
    return template(__name__, "functions.py.jinja").render(
        words,
        **bodies.of_speed(_LANGUAGE),
        head=comment(words["lines"], "#"),
        blocks=[_block(kernel) for kernel in kernels],
    )


def _block(kernel: Quotient | InverseKernel) -> dict[str, object]:
    """Return what the template needs of one kernel."""
    end = interval = None
    high = math.inf
    if isinstance(kernel, Quotient) and kernel.end is not None:
        high = DOUBLE.nearest(Fraction(kernel.end[1]), math.floor)
        end = kernel.end[0], high, ">=" if Fraction(high) == Fraction(kernel.end[1]) else ">"
    if isinstance(kernel, Quotient) and kernel.interval is not None:
        low, high = map(DOUBLE.nearest, kernel.interval, (math.ceil, math.floor))
        interval = low, high
    return {"kernel": kernel, "end": end, "interval": interval, **bodies.of_kernel(kernel, _LANGUAGE, high)}
