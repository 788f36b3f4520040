"""Python module of quotient kernels: one file without dependencies, to copy into other programs."""

from __future__ import annotations

import math
from collections.abc import Sequence
from fractions import Fraction

from viscopade.arithmetic.formats import DOUBLE
from viscopade.generated import template
from viscopade.kernels.forms.quotient import Quotient
from viscopade.kernels.targets.wording import distinct, preamble
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
    lines = [*preamble(kernels, command), *speed_note(kernels, [DOUBLE])]
    head = "\n".join(f"# {line}".rstrip() for line in lines)
    blocks = [_block(kernel) for kernel in distinct(kernels)]
    return template(__name__, "quotient.py.jinja").render(head=head, blocks=blocks)


def _block(kernel: Quotient) -> dict[str, object]:
    """Return what the template needs of one kernel."""
    a, b = kernel.rounded(DOUBLE)
    end = None if kernel.end is None else (kernel.end[0], _not_above(Fraction(kernel.end[1])))
    interval = None if kernel.interval is None else tuple(map(_inside, kernel.interval, (1, -1)))
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


def _inside(number: Fraction, direction: int) -> float:
    """Return the double next to an end of an interval, on the inner side."""
    value = float(number)
    outside = (Fraction(value) - number) * direction < 0
    return math.nextafter(value, direction * math.inf) if outside else value


def _not_above(number: Fraction) -> float:
    """Return the largest double that is not above a positive number."""
    value = DOUBLE.nearest(number)
    return value if value <= number else math.nextafter(value, 0.0)
