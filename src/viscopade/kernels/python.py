"""The Python module: one file without dependencies, to be copied into other people's programs."""

from __future__ import annotations

import math
from collections.abc import Sequence
from fractions import Fraction

from viscopade.kernels import Kernel, distinct, preamble, template
from viscopade.kernels.binary import DOUBLE, exact


def render(kernels: Sequence[Kernel], command: str) -> str:
    """Return the module's text, which computes what the C functions of type double compute.

    Parameters
    ----------
    kernels : sequence of Kernel
        At least one, no two of the same degrees.
    command : str
        The command line that makes the file.

    Raises
    ------
    ValueError
        If a kernel does not fit type double, or `command` is not one line.
    """
    head = "\n".join(f"# {line}".rstrip() for line in preamble(kernels, command))
    blocks = [_block(kernel) for kernel in distinct(kernels)]
    return template("module.py.jinja").render(head=head, blocks=blocks)


def _block(kernel: Kernel) -> dict[str, object]:
    """Return what the template needs of one kernel."""
    a, b = kernel.doubles
    end = None if kernel.end is None else (kernel.end[0], _not_above(exact(kernel.end[1])))
    return {"kernel": kernel, "a": a, "b": b, "threshold": kernel.threshold(DOUBLE), "end": end}


def _not_above(number: Fraction) -> float:
    """Return the largest double that is not above a positive number."""
    value = DOUBLE.nearest(number)
    return value if value <= number else math.nextafter(value, 0.0)
