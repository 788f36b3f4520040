"""Python module of quotient kernels: one file without dependencies, to copy into other programs."""

from __future__ import annotations

import math
from collections.abc import Sequence
from fractions import Fraction

from viscopade.arithmetic.formats import DOUBLE
from viscopade.generated import template
from viscopade.kernels.forms.quotient import Quotient
from viscopade.kernels.targets.wording import (
    distinct,
    functions_of,
    lasting,
    lasting_lines,
    preamble,
    takes_speed,
    variable,
)
from viscopade.kernels.v_star import speed_note


def render(kernels: Sequence[Quotient], command: str) -> str:
    """Return the module's text, with the same results as the C functions of type double.

    Parameters
    ----------
    kernels : sequence of Quotient
        At least one, no two of the same degrees.
    command : str
        The command line that makes the file.

    Raises
    ------
    ValueError
        If a kernel does not fit type double, or `command` is not one line.
    """
    lines = [*preamble(kernels, command), *speed_note(kernels, [DOUBLE]), *lasting_lines(kernels)]
    head = "\n".join(f"# {line}".rstrip() for line in lines)
    chosen = distinct(kernels)
    blocks = [_block(kernel) for kernel in chosen]
    return template(__name__, "quotient.py.jinja").render(
        head=head,
        blocks=blocks,
        lasting=lasting((kernel, functions_of(kernel, [DOUBLE])) for kernel in chosen),
        variable=variable(kernels[0].law),
        of_speed=takes_speed(kernels[0]),
    )


def _block(kernel: Quotient) -> dict[str, object]:
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
