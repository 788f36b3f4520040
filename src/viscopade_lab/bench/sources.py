"""The C code of the benchmark: the timed loops, and the rivals' formulas."""

from __future__ import annotations

from typing import Any

from viscopade import generated
from viscopade.generated import marker_line
from viscopade.kernels.toolchain import Library
from viscopade_lab.bench.contender import Contender

COMMAND = "viscopade bench"


def render(template: str, /, **values: Any) -> str:
    """Return a template of the benchmark, filled in."""
    return generated.template(__name__, template).render(values)


def frame() -> str:
    """Return bench.h, which defines the loops."""
    return render("loops.h.jinja", marker=marker_line(COMMAND))


def unit(contender: Contender, library: Library) -> str:
    """Return the C file of a contender for one of the libraries, or "" if that holds nothing of it."""
    loops = contender.loops(library)
    if not loops:
        return ""
    return render(
        "unit.c.jinja",
        marker=marker_line(COMMAND),
        before=contender.before,
        headers=contender.headers,
        source=contender.source,
        loops=loops,
    )
